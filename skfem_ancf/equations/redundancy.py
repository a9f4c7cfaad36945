"""Equations of joints that repeat others in all positions the joints allow."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from ..core.types import Array
from .signature import DEPENDENT, groups

#: Part of the largest rest of a row beside those kept, from which on the first one is kept.
MUCH = 0.5
#: Size of the motion, relative to the sizes of coordinates, after which the rank is asked again.
MOVED = 3e-3
#: By how much equations may be open that others hold, relative to their sizes.
CLOSED = 1e-10
#: Corrections at most.
CORRECTIONS = 12


def repeated(constraints: Any) -> tuple[Array | None, bool]:
    """The equations of joints that repeat others, or None where that cannot be said of all.

    An equation repeats others if its row of the Jacobian is a sum of theirs at the start and after
    a small random motion that the joints allow, and if it is closed where they are. A linkage that
    starts in a position in line has such rows at the start alone. None of what takes part may move
    with time.

    Parameters
    ----------
    constraints
        :class:`~skfem_ancf.equations.constraints.Constraints` with all equations.

    Returns
    -------
    ndarray or None
        Numbers of the equations, increasing; None where equations depend on others otherwise.
    bool
        True if the others do so in this position alone, and are closed in it.
    """
    c, found, passing = constraints, [], False
    start = np.zeros(c.N)
    start[c.fixed] = c.values(1.0)
    J = _scaled(c, start)
    moving = np.array([joint.moving for joint in c.joints for _ in joint.equations])
    driven = np.zeros(c.N, dtype=bool)
    driven[c.fixed[c.given != 0.0]] = True
    for joint, first, factors in c._moving:
        driven[c.fixed[first:first + len(factors)]] = True
    # what one coordinate does to an equation may be zero at the start
    move = np.random.default_rng(0).uniform(-MOVED, MOVED, c.N) * c.free
    pattern = abs(J) + abs(_scaled(c, start + c.coordinate_sizes * move))
    for rows, _, _ in groups(pattern * c.free):
        size = np.sqrt((J[rows] * J[rows]).sum(axis=1))
        size[size == 0.0] = 1.0
        kept = _basis(J[rows].toarray() * c.free / size[:, None])
        rest = np.setdiff1d(np.arange(len(rows)), kept)
        if not len(rest):
            continue
        u = _beside(c, start, move, rows, len(kept))
        if u is None and _closed(c, start, rows, len(kept)) is None:
            return None, False
        if u is None:
            passing = True
            continue
        for J1 in (J, _scaled(c, u)):
            A = J1[rows].toarray() / size[:, None]
            C = np.linalg.lstsq(A[kept][:, c.free].T, A[rest][:, c.free].T, rcond=None)[0].T
            gap = A[rest] - C @ A[kept]
            if (np.abs(gap[:, c.free]).max(initial=0.0) > 1e3 * DEPENDENT
                    or np.abs(gap[:, driven]).max(initial=0.0) > DEPENDENT
                    or moving[rows[rest]].any()
                    or moving[rows[kept]][np.abs(C).max(axis=0) > DEPENDENT].any()):
                return None, False
        found.append(rows[rest])
    if passing:
        return None, True
    return np.sort(np.concatenate([np.zeros(0, dtype=int), *found])), False


def shared(J: sparse.csr_array, multipliers: Array, left: Array, inner: Array) -> Array:
    """The smallest multipliers with the same forces, of equations that repeat each other.

    Those inside of bodies may be as large as they like.

    Parameters
    ----------
    J
        The rows of all equations, of unit size, shape (m, N).
    multipliers
        Of unit rows, shape (m,), zero for equations left out.
    left
        Numbers of these, shape (k,).
    inner
        Truth values of equations that are of a body alone, shape (m,).

    Returns
    -------
    ndarray
        Shape (m,).
    """
    out = multipliers.copy()
    for rows, columns, A in groups(J):
        if np.isin(rows, left).any() and A.size:
            own, rows = A[inner[rows]], rows[~inner[rows]]
            A = J[rows].toarray()[:, columns]
            Q = np.linalg.qr(own.T)[0]
            A = A - (A @ Q) @ Q.T
            out[rows] = np.linalg.lstsq(A.T, A.T @ multipliers[rows], rcond=DEPENDENT)[0]
    return out


def _scaled(c, u):
    """The Jacobian in units of the coordinates' and the equations' sizes, sparse."""
    sizes = c.equation_sizes(*c.slopes)
    return sparse.csr_array(
        sparse.diags_array(1.0 / sizes) @ c.sparse_jacobian(u, 0.0)
        @ sparse.diags_array(c.coordinate_sizes))


def _basis(A):
    """Numbers of rows that span all rows: the first one of those with much left, one by one."""
    kept: list[int] = []
    A = A.copy()
    for _ in range(min(A.shape)):
        left = np.linalg.norm(A, axis=1)
        left[kept] = 0.0
        if not left.max() > DEPENDENT:
            break
        k = int((left >= MUCH * left.max()).argmax())
        q = A[k] / left[k]
        kept.append(k)
        for _ in range(2):  # once more for the round-off of the first time
            A -= np.outer(A @ q, q)
    return np.sort(np.array(kept, dtype=int))


def _beside(c, start, move, rows, rank):
    """A position beside the start in which some equations of this rank are closed, or None."""
    found = _closed(c, start, rows, rank)
    if found is None:
        return None
    u, V = found
    found = _closed(c, u + c.coordinate_sizes * (move - V.T @ (V @ move)), rows, rank)
    return None if found is None else found[0]


def _closed(c, u, rows, rank):
    """Where Newton's method closes some equations of this rank, and an orthonormal basis of them.

    None if it does not, or if their rank is larger there.
    """
    sizes = c.equation_sizes(*c.slopes)[rows]
    for _ in range(CORRECTIONS):
        A, phi = _scaled(c, u)[rows].toarray() * c.free, c.constraint(u, 0.0)[rows] / sizes
        W, sigma, V = np.linalg.svd(A, full_matrices=False)
        if rank and not sigma[rank - 1] > 0.0:
            return None
        if np.abs(phi).max() <= CLOSED:
            independent = (sigma[rank:] > 1e3 * DEPENDENT * sigma[:1]).any()
            return None if independent else (u, V[:rank])
        u = u - c.coordinate_sizes * (V[:rank].T @ (W[:, :rank].T @ phi / sigma[:rank]))
    return None
