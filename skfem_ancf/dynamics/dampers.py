"""Damping in kernels: of materials, proportional to the mass, and of modes."""

from typing import NamedTuple

import numpy as np

from ..core.band import Band, clear, dense_solve, dot, multiply, solve, subtract_rows
from ..beam.strain_energy import add_viscous_force, body_tangent
from ..actions.forces.kernels import add_resisting_force
from ..core.source import F2, indices, source


class LowRankRows(NamedTuple):
    """A matrix ``A + P^T S P`` with few rows P besides the band A."""

    P: F2  # (k, N)
    S: F2  # (k, k)
    Z: F2  # P A^-1 at free DOFs, (k, N)
    H: F2  # 1 + S P Z^T, (k, k)


class Dampers(NamedTuple):
    """The damping of a system."""

    active: int  # 1 if there is any
    viscous: int  # 1 if a material has
    elements: int  # 1 if a force element has
    mass: float  # factor of M v
    D: Band  # work: damping matrix
    modes: F2  # modal damping force modes^T (modes v), (k, N)


@source
def inverse_rows(A, J, free, Y):
    """Y[k] = A^-1 J[k] at free DOFs, with the factors of A."""
    for k in range(J.shape[0]):
        row, out = J[k], Y[k]
        for i in indices(free.size):
            out[i] = row[i] * free[i]
        solve(A, out)


@source
def damping_force(e, dampers, M, t, u, v, out, scratch):
    """The damping force of the equations e at u and v."""
    damping_beside(e, dampers, M, t, u, v, 0.0, out, scratch)


@source
def damping_beside(e, dampers, M, t, u, v, mixed, out, scratch):
    """The same, without materials in the mixed iteration (``mixed``)."""
    clear(out)
    if dampers.viscous > 0 and mixed == 0.0:
        add_viscous_force(e.viscous, u, v, out)
    if dampers.elements > 0:
        add_resisting_force(e.forces, t, u, v, out)
    if dampers.mass > 0.0:
        multiply(M, v, scratch)
        for i in indices(out.size):
            out[i] += dampers.mass * scratch[i]
    for k in range(dampers.modes.shape[0]):
        row = dampers.modes[k]
        size = dot(row, v)
        for i in indices(out.size):
            out[i] += size * row[i]


@source
def add_damping(viscous, dampers, M, factor, u, stresses, scratch, A):
    """Add the derivative of :func:`damping_force` by v, times a factor, to a symmetric band.

    Modal damping is excluded. ``stresses`` (3, n) is work, its first row zero.
    """
    if dampers.viscous > 0:
        yes = dampers.viscous > 0
        body_tangent(viscous, u, scratch, stresses[0], yes, stresses[2], dampers.D)
        for i in indices(A.flat.size):
            A.flat[i] += factor * dampers.D.flat[i]
    if dampers.mass > 0.0:
        for i in indices(A.flat.size):
            A.flat[i] += factor * dampers.mass * M.flat[i]


@source
def factorize_rows(A, rows, free):
    """Set Z and H with the factors of A."""
    P, S, Z, H = rows.P, rows.S, rows.Z, rows.H
    k = P.shape[0]
    G = np.empty((k, k))
    inverse_rows(A, P, free, Z)
    for a in range(k):
        for b in range(k):
            G[a, b] = dot(P[a], Z[b])
    for a in range(k):
        for b in range(k):
            H[a, b] = 1.0 if a == b else 0.0
            for c in range(k):
                H[a, b] += S[a, c] * G[c, b]


@source
def solve_rows(A, rows, x):
    """Solve in place by the Sherman-Morrison-Woodbury formula."""
    solve(A, x)
    k = rows.P.shape[0]
    if k > 0:
        y, z, H = np.empty(k), np.zeros(k), rows.H.copy()
        for a in range(k):
            y[a] = dot(rows.P[a], x)
        for a in range(k):
            for c in range(k):
                z[a] += rows.S[a, c] * y[c]
        dense_solve(H, z)
        subtract_rows(rows.Z, z, x)
