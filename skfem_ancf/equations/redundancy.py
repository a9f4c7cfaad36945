"""Redundant equations of joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from ..core.types import Array
from .signature import DEPENDENT, groups

#: Relative size of a remainder, compared with the largest, from which a row may be the next pivot.
MUCH = 0.5
#: Relative size of the trial motion.
MOVED = 3e-3
#: Largest relative residual of closed equations.
CLOSED = 1e-10
#: Largest number of Newton corrections.
CORRECTIONS = 12


def repeated(constraints: Any) -> tuple[Array | None, bool]:
    """The redundant equations of joints.

    An equation is redundant if its row of J is a linear combination of others, at the start and
    after a small random motion that the joints allow, and if it is closed. A linkage in a singular
    position has such rows at the start only. No equation involved may depend on time.

    Returns
    -------
    ndarray or None
        Increasing numbers of the equations; None if there are dependent equations of another kind.
    bool
        True if these are dependent in this position only, and closed there.
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
    # entries may be zero at the start only
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
    """The smallest multipliers (m,) with the same forces as given ones.

    Multipliers of internal equations (``inner``, bool (m,)) are not minimised; ``left`` are the
    redundant equations.
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
    """The Jacobian in units of DOFs and equations, sparse."""
    sizes = c.equation_sizes(*c.slopes)
    return sparse.csr_array(
        sparse.diags_array(1.0 / sizes) @ c.sparse_jacobian(u, 0.0)
        @ sparse.diags_array(c.coordinate_sizes))


def _basis(A):
    """Rows that span all rows, by pivoted Gram-Schmidt."""
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
        for _ in range(2):  # reorthogonalise
            A -= np.outer(A @ q, q)
    return np.sort(np.array(kept, dtype=int))


def _beside(c, start, move, rows, rank):
    """A position near the start in which equations of this rank are closed, or None."""
    found = _closed(c, start, rows, rank)
    if found is None:
        return None
    u, V = found
    found = _closed(c, u + c.coordinate_sizes * (move - V.T @ (V @ move)), rows, rank)
    return None if found is None else found[0]


def _closed(c, u, rows, rank):
    """Close equations of this rank by Newton's method; position and row space, or None."""
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
