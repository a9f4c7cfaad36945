"""The fields of the elements at single points: polynomials, where many are asked for one by one.

The first points of a state are evaluated by themselves. Once they took as long as that would, the
fields of the elements around the next are evaluated at the zeros of Chebyshev polynomials, by what
serves many points: they are known at all others then. Where they are no polynomials, as on
curves, the series is as long as round-off wants it; where it does not end, as of a modulus with a
kink, points are evaluated by themselves.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .materials import LinearLaw
from .parts import Part
from .series import places, polynomials, transform

if TYPE_CHECKING:
    from collections.abc import Callable

    from .point import Point
    from .types import Array

#: Elements whose polynomials are made together, and those of which they are kept.
BLOCK, ELEMENTS = 16, 4096

#: Polynomials along the elements and across a slab at first, and at most.
FIRST, MOST = (6, 4), 24

#: The last two coefficients of a series that is long enough, relative to the largest of the block;
#: those of one that no longer falls, as they are round-off; and those that are left out.
ENDED, NOISE, NOTHING = 1e-14, 1e-12, 2e-16

#: Points that polynomials are worth, and how many of these a point counts for that takes long by
#: itself: is evaluated as many are, in a hundred microseconds and more.
WORTH, LONG = 64, 16


class Patch(NamedTuple):
    """A field of three components in one element.

    Attributes
    ----------
    tops
        The upper ends of the slabs but the last, places across.
    slabs
        Of each its lower end, its height and coefficients (3 along, across).
    along, across
        How many polynomials.
    """

    tops: list[float]
    slabs: list[tuple[float, float, Array]]
    along: int
    across: int

    def __call__(self, xi: float, eta: float) -> list[float]:
        """The components at a reference point."""
        tops, slabs, along, across = self
        low, size, table = slabs[bisect_right(tops, eta) if tops else 0]
        found = table.dot(np.array(polynomials((eta - low) / size, across)))
        return found.reshape(3, along).dot(np.array(polynomials(xi, along))).tolist()


class RawField:
    """One field of the elements at single points of one state."""

    def __init__(self) -> None:
        #: By beam and element; False of one without a series.
        self._patches: dict[tuple[int, int], Any] = {}
        #: By beam what single points have taken since polynomials were made.
        self._spent: dict[int, int] = {}

    def __call__(self, point: Point, name: str, alone: Callable[[Point], Any],
                 many: Callable[[Part], Array]) -> Any:
        """The components (3,) at a point.

        Parameters
        ----------
        point
            The :class:`~skfem_ancf.point.Point`.
        name
            Of the field.
        alone, many
            Return the field at one point, three numbers, and at a
            :class:`~skfem_ancf.parts.Part`, (3, n).
        """
        key = point.number, point.place[0]
        patch = self._patches.get(key)
        if patch is None and self._worth(point, name):
            if len(self._patches) >= ELEMENTS:
                self._patches.clear()
            self._patches.update(patches(point, name, many))
            patch = self._patches[key]
        return patch(*point.place[1:]) if patch else alone(point)

    def _worth(self, point, name):
        """True if points of the beam that are evaluated by themselves take longer by now."""
        beam = point.beam
        count = LONG if name == "stress" and not (
            beam.across.plain and isinstance(beam.law, LinearLaw)) else 1
        if (beam.across.moving and len(_ends(beam, name)) > 1) or (
                count == 1 and not beam.has_sections):
            return False  # no polynomials where slabs have other places; cables say it at once
        spent = self._spent.get(point.number, 0) + count
        self._spent[point.number] = spent if spent < WORTH else 0
        return spent >= WORTH


def patches(point: Point, name: str, many: Callable[[Part], Array]
            ) -> dict[tuple[int, int], Patch | bool]:
    """The Patch of each element of the block around a point, or False.

    Parameters
    ----------
    point, name, many
        As for :class:`RawField`; ``many`` returns arrays (3, n).
    """
    beam, first = point.beam, point.place[0] // BLOCK * BLOCK
    of = np.arange(first, min(first + BLOCK, beam.mesh.nelements))
    shape, ends = beam.touched.get(("raw", name), FIRST), _ends(beam, name)
    while True:
        part = Part(beam, point.number, point.coordinates, None, *_grid(ends, of, shape))
        with np.errstate(all="ignore"):
            c = _series(many(part), len(of), shape)
        size = np.max(np.abs(c))
        ended = [_ended(np.max(np.abs(c), axis=axes), size) for axes in ((0, 2, 4), (0, 2, 3))]
        if np.all(ended) or not np.isfinite(size) or all(
                n >= MOST or np.all(end) for n, end in zip(shape, ended)):
            break
        shape = tuple(n if np.all(end) else min(n + n // 2, MOST) for n, end in zip(shape, ended))
    good, used = ended[0] & ended[1], np.abs(c) > NOTHING * size
    n, m = (1 + int(np.max(np.nonzero(np.any(used, axis=axes))[0], initial=1))
            for axes in ((0, 1, 2, 4), (0, 1, 2, 3)))
    beam.touched["raw", name] = min(n + 2, shape[0]), min(m + 2, shape[1])
    tops = [high for _, high in ends[:-1]]
    return {(point.number, e): good[k] and Patch(tops, [
        (low, high - low, np.ascontiguousarray(c[:, k, j, :n, :m]).reshape(-1, m))
        for j, (low, high) in enumerate(ends)], n, m) for k, e in enumerate(of.tolist())}


def _ends(beam, name):
    """Both ends of the parts of the section in which a field is smooth."""
    if name == "strain" and beam.has_sections:
        return [(0.0, 1.0)]
    return [(slab.measure.low, slab.measure.high) for slab in beam.across.slabs]


def _ended(c, size):
    """True for the elements whose coefficients (elements, n) have fallen to round-off."""
    before, last = np.max(c[:, -4:-2], axis=1), np.max(c[:, -2:], axis=1)
    return (last <= ENDED * size) | ((last <= NOISE * size) & (last >= 0.1 * before))


def _grid(ends, of, shape):
    """Elements (n,) and reference points (2, n) at which series are found."""
    x, z = (places(n) for n in shape)
    eta = [low + (high - low) * z for low, high in ends]
    X = np.array(np.broadcast_arrays(x[:, None], np.array(eta)[:, None])).reshape(2, -1)
    return np.repeat(of, X.shape[1]), np.tile(X, len(of))


def _series(values, n, shape):
    """Coefficients (3, n, slabs, along, across) of values at the grid of n elements."""
    values = values.reshape(3, n, -1, *shape)
    return transform(shape[0]) @ values @ transform(shape[1]).T
