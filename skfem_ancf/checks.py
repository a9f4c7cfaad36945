"""How far a state is from what the law and the mesh are good for."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ModelWarning
from .kept import cached_property
from .materials import LinearLaw

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .beam import Beam
    from .results import State
    from .types import Array

#: Stretch below which St. Venant-Kirchhoff resists less the more it is compressed: the force of a
#: fibre, E (l^3 - l) / 2, has its smallest value there.
COMPRESSED = 1.0 / np.sqrt(3.0)
#: Angle, in radians, by which the axis may turn over one element, for a cubic axis and others.
#: A cubic cable bent by an end moment is off by 1.7, 4.5, 9, 14 % of its length at 0.76, 0.93, 1.07
#: and 1.18 rad, and beyond 1.2 rad nothing is left of the solution; one of degree 5 by 1.5e-5 at
#: 1.6 rad, of degree 7 by 2.4e-8 at 2, of degree 9 by 5e-11 at 2.5.
TURNING = {3: 1.0, 5: 1.6, 7: 2.0}
TURNING_SMOOTH = 2.5


@dataclass(frozen=True)
class Checks:
    """Extreme values of a state.

    Attributes
    ----------
    smallest_det
        Smallest determinant of the deformation gradient at the integration points.
    smallest_stretch, largest_stretch
        Smallest and largest principal stretch at the integration points; of a cable those of its
        outermost fibres.
    turning
        Largest angle in radians by which the axis turns over one element, from the stress-free
        state.
    findings : tuple of str
        What is beyond the range of the law or of the mesh; empty where nothing is.
    """

    smallest_det: float
    smallest_stretch: float
    largest_stretch: float
    turning: float
    findings: tuple = ()

    def __str__(self):
        lines = [f"det F from {self.smallest_det:.4g}, stretch from {self.smallest_stretch:.4g} to "
                 f"{self.largest_stretch:.4g}, turning {self.turning:.3g} rad an element"]
        return "\n".join(lines + [f"beyond its range: {text}" for text in self.findings])


def check(state: State) -> Checks:
    """The :class:`Checks` of a state."""
    values, found = [], []
    for beam in state.beams:
        u = state.u_of(beam)
        ratio, stretches = beam.kinematics.deformation(beam, u)
        values.append((np.min(ratio), np.min(stretches), np.max(stretches), turning(beam, u)))
        found += _findings(beam, values[-1][1], values[-1][3])
    det, low, high, turn = zip(*values or [(1.0, 1.0, 1.0, 0.0)])
    return Checks(float(min(det)), float(min(low)), float(max(high)), float(max(turn)),
                  tuple(found))


class Screen:
    """A look at the tangents of all nodes that tells whether a state may be out of range.

    Parameters
    ----------
    beams
        The beams of a scene.

    Attributes
    ----------
    start
        Tangents of the nodes in the stress-free state, complex.
    slender
        Height over length of each element.
    """

    def __init__(self, beams: Sequence[Beam]) -> None:
        self._none = not beams
        if self._none:
            return
        # pairs of coordinates as complex numbers: positions of the nodes, and the tangents behind
        self._beams, self._positions, self._tangents = beams, *_nodes_of(beams)
        self.start = _joined([_complex(b.mesh.p_X.T) for b in beams])
        nodes = len(self.start)
        if sum([b.mesh.nelements for b in beams]) == nodes - 1:  # one chain
            self._left, self._right = slice(nodes - 1), slice(1, nodes)
        else:
            node = accumulate([b.N // b.nd for b in beams], initial=0)
            self._left, self._right = _joined([n + b.mesh.t for n, b in zip(node, beams)])
        self.slender = _joined([b.mesh.height / b.mesh.lengths for b in beams])
        limits = [turning_limit(b) for b in beams]
        self._limit = limits[0] if len(set(limits)) == 1 else np.repeat(
            limits, [b.mesh.nelements for b in beams])

    @cached_property
    def _marks(self):
        """Numbers of coordinates of each element, and their values in the stress-free state.

        The end, the begin, and the tangents at both, shape (4, 2, elements).
        """
        nodes, pairs = np.arange(len(self.start)), np.arange(sum([b.N for b in self._beams]) // 2)
        begin, end = nodes[self._left], nodes[self._right]
        at = [pairs[places][ends] for places, ends in (
            (self._positions, end), (self._positions, begin), (self._tangents, begin),
            (self._tangents, end))]
        rest = _joined([_complex(b.mesh.p.T) for b in self._beams])
        start = np.array([rest[end], rest[begin], self.start[begin], self.start[end]])
        return (2 * np.array(at)[:, None] + np.arange(2)[:, None],
                np.stack([start.real, start.imag], 1))

    def passes(self, u: Array, start: Array | None = None, slender: Array | None = None) -> Any:
        """False if a fibre may be compressed, or an element may turn, beyond the range.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (..., N).
        start, slender
            Of others than the beams, (..., nodes) and (..., elements).
        """
        if self._none:
            return True
        start = self.start if start is None else start
        slender = self.slender if slender is None else slender
        r = _paired(u)[..., self._tangents] / start + 1.0
        z = r[..., self._right] * r[..., self._left].conj()
        turn = np.abs(np.arctan2(z.imag, z.real))
        # the largest curvature of an element is seldom more than twice its mean
        shortest = np.minimum.reduce(np.abs(r), -1) - np.maximum.reduce(turn * slender, -1)
        return np.logical_and.reduce(turn < self._limit, -1) & (shortest > 1.1 * COMPRESSED)

    def folded(self, u: Array) -> bool:
        """True if the axis of an element turns back: its ends lie against a tangent of the axis.

        An axis that does so turns by more than pi over the element, or has no length in it.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        """
        if self._none:
            return False
        at, rest = self._marks
        r = u[at] + rest
        along = (r[0] - r[1]) * r[2:]
        return bool(np.minimum.reduce(along[:, 0] + along[:, 1], None) < 0.0)


def _nodes_of(beams):
    """Places of the first and the second pair of coordinates of each node, one beam after another.
    """
    steps, pairs = [b.nd // 2 for b in beams], sum([b.N for b in beams]) // 2
    if len(set(steps)) == 1:
        return slice(0, pairs, steps[0]), slice(1, pairs, steps[0])
    first = accumulate([b.N // 2 for b in beams], initial=0)
    at = np.concatenate([np.arange(n, n + b.N // 2, k) for n, b, k in zip(first, beams, steps)])
    return at, at + 1


def _complex(pairs):
    """Vectors (..., 2) as complex numbers, (...)."""
    return _paired(pairs)[..., 0]


def _paired(x):
    """Numbers (..., 2 n) as n complex ones."""
    return np.ascontiguousarray(x).view(complex)


def _joined(arrays):
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays, axis=-1)


def warn_of(state: State, stacklevel: int) -> None:
    """Give a :class:`~skfem_ancf.errors.ModelWarning` for each finding.

    Parameters
    ----------
    state
        A static State.
    stacklevel
        Of the caller's line, as for ``warnings.warn``.
    """
    for text in state.system.forces.contacts.sunk(state.u, state.load):
        warnings.warn(text, ModelWarning, stacklevel=stacklevel)
    if state.system.screen.passes(state.u):
        return
    for beam in state.beams:
        u = state.u_of(beam)
        for text in _findings(beam, shortest(beam, u), turning(beam, u)):
            warnings.warn(f"{text} (state.checks has the numbers)", ModelWarning,
                          stacklevel=stacklevel)


def _findings(beam, stretch, turn):
    who = "" if beam.name is None else f" of beam {beam.name!r}"
    out = []
    if stretch < COMPRESSED and beam.has_sections and _is_linear(beam):
        out.append(f"a fibre{who} is compressed to {stretch:.3g} of its length; below "
                   f"{COMPRESSED:.3g} St. Venant-Kirchhoff resists less and less: use NeoHookean, "
                   "or a smaller load")
    if not beam.has_sections and stretch <= 0.0:
        out.append(f"the sections{who} overlap: the axis is bent to a radius below half the height")
    limit = turning_limit(beam)
    if turn > limit:
        out.append(f"the mesh{who} is too coarse for the curvature found: the axis turns by "
                   f"{turn:.3g} rad over one element, where {limit:g} is the limit: use more "
                   "elements there, or solve_static(adapt=...); in a Frame, elements=")
    return out


def _is_linear(beam):
    return all(isinstance(t.law, LinearLaw) for t in beam.kernel.tables)


def turning(beam: Beam, u: Array) -> float:
    """Largest angle by which the axis turns over an element, by its tangents at the nodes.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    u
        Displacement of its coordinates, shape (N,).
    """
    turn = tangents(beam, u) / tangents(beam, 0.0)
    left, right = beam.mesh.t
    return float(np.max(np.abs(np.angle(turn[right] * turn[left].conj()))))


def tangents(beam: Beam, u: Array | float) -> Array:
    """The axis' derivative r_X at the nodes, as complex numbers.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    u
        Displacement of its coordinates, shape (N,), or 0.

    Returns
    -------
    ndarray
        Shape (nvertices,), complex.
    """
    return (beam.q0_local + u).reshape(-1, beam.nd)[:, 2:4] @ [1.0, 1.0j]


def turning_limit(beam: Beam) -> float:
    """The angle by which the axis may turn over one element."""
    return TURNING.get(beam.element.axis_degree, TURNING_SMOOTH)


def shortest(beam: Beam, u: Array) -> float:
    """Smallest stretch of the fibres along the axis at the integration points.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    u
        Displacement of its coordinates, shape (N,).
    """
    return float(beam.kinematics.shortest(beam, u))
