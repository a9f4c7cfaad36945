"""Beams that may touch themselves, cut into stretches that cannot, see
:mod:`skfem_ancf.actions.contact.stretches`."""

from math import comb
from typing import Any

import numpy as np

from ...core import Array, gauss_lobatto
from ..contact.stretches import ALONG, Rows
from .facets import Facets

#: Sections extend along d by no more than the height, or ends of cables by this part of it, times
#: the stretch, of which slopes of the element, and mean ones of its neighbours, have EVEN or more.
#: In elements shorter than LONG heights by no more than without stretch.
THIN, EVEN, LONG, TINY = 0.55, 0.82, 1.85, 1e-12


def stretches_of(f: Facets, touch: Array, facets: Facets, moves: Array, places: Array
                 ) -> tuple[Array, Rows]:
    """Of ``facets`` their element of beams that may touch themselves, or -1, (F,); and the Rows.

    Parameters
    ----------
    f
        The facets of the beams, before corners are rounded.
    touch
        True for members that may touch themselves, (M,).
    moves, places
        Weights (2, n) of degrees of freedom in the motion of points, and True for those that are
        places, (n,).
    """
    if not touch.any():
        return np.full(len(facets.sides), -1), NO_ROWS
    n, own = f.starts.shape[1], touch[f.members]
    bottom, top = (np.flatnonzero(own & (f.spans > 0.0) & (f.sides == side))
                   for side in (-1, 1))
    chains, far = f.chains[bottom], 1.0 + np.max(f.places + f.spans)
    along = chains * far + f.places[bottom]
    of, at = (np.where(touch[g.members], np.searchsorted(
        along, g.chains * far + g.places + 0.5 * g.spans, "right") - 1, -1)
        for g in (facets, f))
    # control points of polynomials and of their slopes, (n, F, B + 1)
    C = np.concatenate([f.weights, f.starts[:, None]], axis=1)
    points = _controls(n, C)
    slopes = _controls(n - 1, C[..., 1:] * np.arange(1.0, n))
    deep = f.offsets[bottom] == 0.0
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
    weights, dofs = np.abs(x[:, :-1]), f.dofs[e]
    sums = [np.sum(weights * own / np.maximum(most[dofs], TINY), axis=1)
            for most, own in zip(moves, (places[dofs], ~places[dofs]))]
    return of, Rows(packed(dofs.T, np.int64), packed(x[:, :-1].T, complex),
                    packed(x[:, -1], complex), packed(least, float),
                    packed(np.maximum(*sums), float), packed(at[e], np.int64),
                    packed(chains, np.int64), n - 1)


_I, _C = np.zeros((2, 0), np.int64), np.zeros((2, 0), complex)
#: Of members that cannot touch themselves.
NO_ROWS = Rows(_I, _C, _C[0], np.zeros(0), np.zeros(0), _I[0], _I[0], 1)


def packed(x: Array, kind: Any) -> Array:
    """A contiguous array of a kind."""
    return np.ascontiguousarray(x, dtype=kind)


def _controls(n, C):
    """Control points of polynomials with n coefficients (..., n) on [-1, 1], (n, ...)."""
    x = gauss_lobatto(n)
    rise = 0.5 + 0.5 * x
    basis = np.array([comb(n - 1, k) * rise**k * (1.0 - rise) ** (n - 1 - k) for k in range(n)]).T
    return np.moveaxis(C @ np.linalg.solve(basis, np.vander(x, n, increasing=True)).T, -1, 0)
