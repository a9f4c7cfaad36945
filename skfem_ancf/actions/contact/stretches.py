"""Stretches of a beam that cannot touch themselves, since they are bent by less than a right angle.

If the axis and both faces of a stretch go along a direction d by ALONG of their reference length at
least, and sections extend along d by no more than the height, times the stretch there, then places
at least :data:`~skfem_ancf.actions.contact.pairs.APART` heights apart along the axis, which alone
may touch, are farther from each other than :data:`~skfem_ancf.actions.contact.pairs.DEEPEST`,
whatever the motion. Slopes of polynomials lie between their control points.
"""

from typing import NamedTuple

import numpy as np

from ...core import C1, C2, F1, I1, I2, indices, shaped, source, where
from ...core.band import smallest
from ..tables import least_each
from .points import cross, dot, scaled, size
from .tables import FAR, TINY

#: Least progress along d, relative to the reference length: 3 ALONG - 1 > 0.75.
ALONG = 0.65
#: Largest change of direction in a part of a beam, of which a stretch has two; directions that are
#: as near to each other count as equal.
TURN, EQUAL = 0.7, 0.2


class Rows(NamedTuple):
    """Vectors ``starts + sum(weights * z[dofs])`` of beams that may touch themselves, (K,): slopes,
    which go along d by ``least``, and sections, by no more than ``-least``."""

    dofs: I2  # (B, K)
    weights: C2
    starts: C1
    least: F1
    changes: F1  # at most, for each unit by which points move
    elements: I1  # numbers of elements of these beams, (K,)
    chains: I1  # of elements, (E,)
    each: int  # the first vectors are slopes, as many of each element


class Cut(NamedTuple):
    """How beams are cut. Elements are in parts from 1 on; stretch k has the parts k and k + 1."""

    parts: I1  # (E,)
    number: I1  # of stretches, (1,)
    ends: I2  # vectors between which d is, (2, S)
    fits: F1  # positive if the stretch was straight, (S,)


@source
def vectors(rows, z):
    """The vectors at displacements z, (K,)."""
    b = rows.starts.copy()
    for a in range(rows.dofs.shape[0]):
        for k in indices(b.size):
            b[k] += rows.weights[a, k] * z[rows.dofs[a, k]]
    return b


@source
def cut_anew(rows, cut, z):
    """Cut beams into stretches at displacements z."""
    E, b, k, angle, low, high = rows.chains.size, vectors(rows, z), 1, 0.0, 0.0, 0.0
    slopes, turns = shaped(b[:E * rows.each], (E, rows.each)), np.zeros(E)
    mean = np.zeros(E, np.complex128)
    for j in range(rows.each):
        for e in indices(E):
            mean[e] += slopes[e, j]
    for e in indices(E - 1):
        turns[1:][e] = np.arctan2(cross(mean[:-1][e], mean[1:][e]), dot(mean[:-1][e], mean[1:][e]))
    levels = np.full((2, cut.fits.size), FAR)
    for e in range(E):
        angle += turns[e]
        low, high = min(low, angle), max(high, angle)
        other = e > 0 and rows.chains[e] != rows.chains[e - 1]
        if other or high - low > TURN:  # another chain has no stretch with the part before
            k, low, high = k + (2 if other else 1), angle, angle
        cut.parts[e], level, at = k, np.floor(angle / EQUAL + 0.5), e * rows.each + rows.each // 2
        for s in range(k - 1, k + 1):
            if level < levels[0, s]:  # the first of the lowest
                levels[0, s], cut.ends[0, s] = level, at
            if -level <= levels[1, s]:  # the last of the highest
                levels[1, s], cut.ends[1, s] = -level, at
    cut.number[0] = 1 if k == 1 else k + 1  # one part is one stretch
    for s in indices(cut.fits.size):
        cut.fits[s] = 0.0
    cut.fits[:cut.number[0]] = FAR
    of, way, _ = progress(rows, cut, b)
    for part in range(len(of)):
        least_each(cut.fits, of[part], way[part])


@source
def progress(rows, cut, b):
    """Numbers of the one or two stretches of vectors b, how much more than the least they go along
    d, and by how much that changes at most if points move, (1, K) or (2, K) each."""
    S, K = cut.number[0], b.size
    d, turning = np.zeros(S, np.complex128), np.zeros(S)
    for s in indices(S):
        low, high = cut.ends[0, s], cut.ends[1, s]
        p, q = np.maximum(size(b[low]), TINY), np.maximum(size(b[high]), TINY)
        mid = scaled(1.0 / p, b[low]) + scaled(1.0 / q, b[high])
        length = np.maximum(size(mid), TINY)
        # a unit vector changes by no more than twice the relative change
        d[s], turning[s] = scaled(1.0 / length, mid), 4.0 / length * (
            rows.changes[low] / p + rows.changes[high] / q)
    n = min(S, 2)
    of, way, change = np.zeros((n, K), np.int64), np.empty((n, K)), np.empty((n, K))
    for part in range(n):
        for k in indices(K):
            s = cut.parts[rows.elements[k]] - 1 + part
            along = dot(d[s], b[k])
            of[part, k], way[part, k] = s, where(
                rows.least[k] > 0.0, along, -np.abs(along)) - rows.least[k]
            change[part, k] = rows.changes[k] + turning[s] * size(b[k])
    return of, way, change


@source
def straight_within(rows, cut, z):
    """How far points may move from displacements z until a stretch may touch itself; not positive
    if one may."""
    if rows.starts.size == 0:
        return FAR
    of, way, change = progress(rows, cut, vectors(rows, z))
    least = FAR
    for part in range(len(of)):
        for k in indices(of.shape[1]):
            way[part, k] = where(cut.fits[of[part, k]] > 0.0, way[part, k] / change[part, k], FAR)
        least = min(least, smallest(way[part]))
    return least
