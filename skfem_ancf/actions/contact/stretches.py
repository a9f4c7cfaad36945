"""Stretches of a beam that cannot touch themselves, since they are bent by less than a right angle.

If the axis and both faces of a stretch go along a direction d by ALONG of their reference length at
least, and sections extend along d by no more than the height, times the stretch there, then places
at least :data:`~skfem_ancf.actions.contact.pairs.APART` heights apart along the axis, which alone
may touch, are farther from each other than :data:`~skfem_ancf.actions.contact.pairs.DEEPEST`,
whatever the motion. Slopes of polynomials lie between their control points.
"""

from typing import NamedTuple

import numpy as np

from ...core import C1, C2, F1, I2, indices, shaped, source, where
from ...core.band import smallest
from .points import dot, scaled, size
from .tables import TINY

#: Least progress along d, relative to the reference length: 3 ALONG - 1 > 0.75.
ALONG = 0.65


class Rows(NamedTuple):
    """Vectors ``starts + sum(weights * z[dofs])`` of beams that may touch themselves, (K,): slopes,
    which go along d by ``least``, and sections, by no more than ``-least``."""

    dofs: I2  # (B, K)
    weights: C2
    starts: C1
    least: F1


class Cut(NamedTuple):
    """Stretches: one or two of each vector, or -1, (2, K); slopes between which d is, (2, T)."""

    of: I2
    ends: I2


@source
def progress(rows, cut, z):
    """How much more than the least vectors go along d of their stretches, (2, K)."""
    b, d, out = rows.starts.copy(), np.empty(cut.ends.shape[1], np.complex128), np.empty(
        cut.of.shape)
    for a in range(rows.dofs.shape[0]):
        for k in indices(b.size):
            b[k] += rows.weights[a, k] * z[rows.dofs[a, k]]
    for s in indices(d.size):
        low, high = b[cut.ends[0, s]], b[cut.ends[1, s]]
        mid = scaled(1.0 / np.maximum(size(low), TINY), low) + scaled(
            1.0 / np.maximum(size(high), TINY), high)
        d[s] = scaled(1.0 / np.maximum(size(mid), TINY), mid)
    for part in range(cut.of.shape[0]):
        of = cut.of[part]
        for k in indices(b.size):
            way = dot(d[of[k]], b[k])
            way = where(rows.least[k] > 0.0, way, -np.abs(way)) - rows.least[k]
            out[part, k] = where(of[k] < 0, 1.0, way)
    return out


@source
def straight(rows, cut, z):
    """True if no stretch can touch itself at displacements z."""
    if rows.starts.size == 0:
        return True
    return smallest(shaped(progress(rows, cut, z), (cut.of.size,))) > 0.0
