"""Beams that may touch themselves, cut into stretches that cannot, see
:mod:`skfem_ancf.actions.contact.stretches`."""

from math import comb
from typing import Any

import numpy as np

from ...core import Array, gauss_lobatto
from ..contact.stretches import ALONG, Cut, Rows, progress
from .facets import Facets

#: Largest change of direction in a part of a beam, of which a stretch has two; directions that are
#: as near to each other count as equal.
TURN, EQUAL = 0.7, 0.2
#: Sections extend along d by no more than the height, or ends of cables by this part of it, times
#: the stretch, of which slopes of the element, and mean ones of its neighbours, have EVEN or more.
#: In elements shorter than LONG heights by no more than without stretch.
THIN, EVEN, LONG, TINY = 0.55, 0.82, 1.85, 1e-12


class Stretches:
    """Vectors of beams, from their facets before corners are rounded; ``touch`` (M,) says which
    members may touch themselves. All ``facets`` have an element of these, or -1."""

    def __init__(self, f: Facets, touch: Array, facets: Facets) -> None:
        self.of, self.rows, self._chains = np.full(len(facets.sides), -1), NO_ROWS, f.chains[:0]
        if not touch.any():
            return
        n, own = f.starts.shape[1], touch[f.members]
        bottom, top = (np.flatnonzero(own & (f.spans > 0.0) & (f.sides == side))
                       for side in (-1, 1))
        self._chains, far = f.chains[bottom], 1.0 + np.max(f.places + f.spans)
        self._others = (np.diff(self._chains) != 0).tolist()
        places = self._chains * far + f.places[bottom]
        self.of, at = (np.where(touch[g.members], np.searchsorted(
            places, g.chains * far + g.places + 0.5 * g.spans, "right") - 1, -1)
            for g in (facets, f))
        # control points of polynomials and of their slopes, (n, F, B + 1)
        C = np.concatenate([f.weights, f.starts[:, None]], axis=1)
        points = _controls(n, C)
        slopes = _controls(n - 1, C[..., 1:] * np.arange(1.0, n))
        self._each, deep = n - 1, f.offsets[bottom] == 0.0
        ends = np.flatnonzero(own & (f.spans == 0.0))
        last, right = at[ends], f.places[ends] > f.places[bottom[at[ends]]]
        # sections, and ends from both corners, which must not go back along d
        most = np.where(deep, 1.0, THIN) * f.heights[bottom]
        across, parts = points[:, top[deep]] - points[:, bottom[deep]], list[Any]()
        backward = [(bottom[deep], across), (bottom[deep], -across)]
        for side in (bottom, top):
            corner = np.where(right[:, None], points[-1, side[last]], points[0, side[last]])
            backward.append((bottom[last], np.where(right[:, None], 1.0, -1.0) * (
                points[:, ends] - corner)))
        for e in (bottom, top[deep]):
            parts.append((slopes[:, e], e, 0.5 * ALONG * f.spans[e]))
        # they may be as large as the beam is stretched there, if it is nearly as much nearby
        e = bottom[np.union1d(np.flatnonzero(deep), last)]
        mean = np.mean(slopes, axis=0)
        near = slopes[:, e] - EVEN * mean[e], mean[e] - EVEN * slopes[[0, -1]][:, e]
        parts.append((np.concatenate(near), e, TINY * f.spans[e]))
        for e, x in backward:
            size, grows = most[at[e]], f.spans[e] > LONG * f.heights[e]
            parts.append((x + (grows * 2.0 * size / f.spans[e])[:, None] * mean[e], e, np.where(
                grows, TINY, -1.0) * size))
        # those of an element one after another
        x, e, least = (np.concatenate(y) for y in zip(*(
            (x.transpose(1, 0, 2).reshape(-1, C.shape[1]), np.repeat(e, len(x)),
             np.repeat(least, len(x))) for x, e, least in parts)))
        self._elements = at[e]
        self.rows = Rows(*(np.ascontiguousarray(y, kind) for y, kind in (
            (f.dofs[e].T, np.int64), (x[:, :-1].T, complex), (x[:, -1], complex), (least, float))))

    def cut(self, z: Array) -> tuple[Cut, Array, Array]:
        """The Cut at displacements z; of facets their part or -1, and which stretches are straight,
        of which number k has the parts k and k + 1."""
        if not len(self._chains):
            return NOTHING, self.of, np.zeros(1, bool)
        E, rows, each = len(self._chains), self.rows, self._each
        w, dofs = rows.weights[:, :E * each], rows.dofs[:, :E * each]
        t = (rows.starts[:E * each] + np.sum(w * z[dofs], axis=0)).reshape(E, each).sum(axis=1)
        angles = np.cumsum(np.append(0.0, np.angle(t[1:] * np.conj(t[:-1]))))
        parts, k, low, high = [1], 1, angles[0], angles[0]
        for angle, other in zip(angles[1:].tolist(), self._others):
            low, high = min(low, angle), max(high, angle)
            if other or high - low > TURN:  # another chain has no stretch with the part before
                k, low, high = k + 1 + other, angle, angle
            parts.append(k)
        part, level = np.array(parts), np.round(angles / EQUAL)
        ends, half = np.zeros((2, k + 1), np.int64), each // 2
        first, last = (part.searchsorted(np.arange(k + 2), side) for side in ("left", "right"))
        for s in range(k + 1):
            own = level[first[s]:last[s + 1]]
            if len(own):
                low, high = np.argmin(own), len(own) - 1 - np.argmax(own[::-1])
                ends[:, s] = (first[s] + np.array([low, high])) * each + half
        of = np.array([part - 1, part][-k:])[:, self._elements]  # one part is one stretch
        fits = np.ones(k + 1, bool)
        fits[of[~(progress(rows, Cut(of, ends), z) > 0.0)]] = False
        return (Cut(np.ascontiguousarray(np.where(fits[of], of, -1)), ends),
                np.where(self.of < 0, -1, part[self.of]), fits)


#: Of members that cannot touch themselves.
NOTHING = Cut(*np.zeros((2, 2, 0), np.int64))
NO_ROWS = Rows(NOTHING.of, np.zeros((2, 0), complex), np.zeros(0, complex), np.zeros(0))


def _controls(n, C):
    """Control points of polynomials with n coefficients (..., n) on [-1, 1], (n, ...)."""
    x = gauss_lobatto(n)
    rise = 0.5 + 0.5 * x
    basis = np.array([comb(n - 1, k) * rise**k * (1.0 - rise) ** (n - 1 - k) for k in range(n)]).T
    return np.moveaxis(C @ np.linalg.solve(basis, np.vander(x, n, increasing=True)).T, -1, 0)
