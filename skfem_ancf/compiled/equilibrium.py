"""Whole static iterations: what :mod:`skfem_ancf.statics.newton` does."""

import math

import numpy as np

from .band import copy, factorize, fix, multiply, solve
from .body import body_carry, body_force, body_tangent
from .border import add_outside, border_solve, make_border
from .constraints import constraint, jacobian
from .jit import jit
from .moments import add_moment_stiffness, add_moments


@jit
def equilibrium(cables, beams, moments, joints, motion, border, mixed, u, multipliers, dead, factor,
                factors, gap, fixed, prescribed, free, A, ld, bw, tol, floor, force_floor, closed,
                inaccurate, carried, stresses, f, record):
    """Iterate to equilibrium from u and the multipliers, in place.

    Parameters
    ----------
    motion
        c (m,) and g of the joints.
    border
        As :mod:`~skfem_ancf.compiled.border` says.
    dead, factor, factors
        The constant force, its factor, and those of the moments.
    gap
        The force that may be missing, shape (N,).
    fixed, prescribed
        Fixed coordinates, and by how much they have to change.
    closed, inaccurate
        What the joints may be open by, and the border's solution may be wrong by.
    record
        Takes the residuals, shape (max_iterations + 1, 2).

    Returns
    -------
    The number of linear systems solved, or -1 if one has no solution, -2 if there is no
    convergence.
    """
    N, limit = u.size, record.shape[0] - 1
    R, du, scale, load = np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    none = np.empty((1, 1, 1))
    if joints is not None:
        m, k_ = multipliers.size, border[0].size
        phi, dm, size_ = np.empty(m), np.empty(m), np.empty(m)
        J, S, H = np.zeros((m, N)), np.zeros((k_, k_)), np.empty((k_ + m, k_ + m))
        Z, W, K = np.empty((k_ + m, N)), np.empty((k_, N)), np.empty(A.size)
    work = before = reference = np.inf
    quiet, moving, yes = False, False, N > 0  # as a constant it would compile the tangent anew
    for i in range(fixed.size):
        moving = moving or prescribed[i] != 0.0
    for k in range(limit + 1):
        part = min(1.0, work / before) if k > 1 else 1.0
        last = (k > 1 or k > 0 and quiet) and work * part <= tol * reference + floor
        for turn in range(2):
            if last and turn == 0:
                body_force(cables, beams, u, f, none, A)
            elif turn == 0 or last:
                body_tangent(cables, beams, u, f, yes, carried, mixed and k > 0, stresses, A, ld)
                if moments is not None:
                    add_moment_stiffness(moments, factors, u, A, ld)
                for i in range(N):
                    scale[i] = 1.0 / abs(A[i * ld])
            if turn == 1:
                break
            for i in range(N):
                load[i] = factor * dead[i]
            if moments is not None:
                add_moments(moments, factors, u, load)
            for i in range(N):
                R[i] = (load[i] - f[i] - gap[i]) * free[i]
            open_ = 0.0
            if joints is not None:
                jacobian(joints, motion[1], u, J)
                constraint(joints, motion[0], motion[1], u, phi)
                for j in range(m):
                    open_ = max(open_, abs(phi[j]))
                    for i in range(N):
                        R[i] -= multipliers[j] * J[j, i] * free[i]
            rho, inner, outer = 0.0, 0.0, 0.0
            for i in range(N):
                rho += R[i] * R[i] * scale[i]
                inner += f[i] * f[i] * scale[i]
                outer += load[i] * load[i] * scale[i]
            rho, size = math.sqrt(rho), math.sqrt(max(inner, outer))
            if not rho < 1e300:
                return -1
            record[k, 0] = rho / size if size > 0.0 else 0.0
            if k == 0:
                small, quiet = rho <= 1e-3 * tol * size, rho <= force_floor
            else:
                small = last and rho <= tol * size + force_floor
            if small and not moving and open_ <= closed:
                return k
            if k == limit:
                return -2
        if moving:
            du[:] = 0.0
            for i in range(fixed.size):
                du[fixed[i]] = prescribed[i]
            push = np.empty(N)
            multiply(A, ld, bw, du, push)
            for i in range(N):
                R[i] = (R[i] - push[i]) * free[i]
            if joints is not None:
                for j in range(m):
                    for i in range(N):
                        phi[j] += J[j, i] * du[i]
        fix(A, ld, bw, free == 0.0)
        before, work = work, 0.0
        if joints is not None:
            for j in range(m):
                for i in range(N):
                    J[j, i] *= free[i]
                phi[j] = -phi[j]
            add_outside(joints, border, multipliers, free, A, ld, S)
            copy(A, K)
            if not factorize(A, ld, bw, N):
                return -1
            make_border(A, ld, bw, J, free, border[0], S, Z, W, size_, H)
            error = border_solve(K, A, ld, bw, J, border[0], S, Z, size_, H, R, phi, du, dm)
            if not 0.0 <= error <= inaccurate:
                return -1
            gained = 0.0
            for j in range(m):
                multipliers[j] += dm[j]
                gained += phi[j] * dm[j]
            work = abs(gained)
        else:
            copy(R, du)
            if not factorize(A, ld, bw, N):
                return -1
            solve(A, ld, bw, du)
        gained = 0.0
        for i in range(N):
            gained += R[i] * du[i]
        work = math.sqrt(work + abs(gained))
        if not work < 1e300:
            return -1
        if moving:
            for i in range(fixed.size):
                du[fixed[i]] = prescribed[i]
            moving = False
        if mixed:
            body_carry(cables, beams, u, du, stresses, carried)
        inner, outer = 0.0, 0.0
        for i in range(N):
            u[i] += du[i]
            inner += f[i] * u[i]
            outer += load[i] * u[i]
        reference = math.sqrt(max(abs(inner), abs(outer)))
        record[k, 1] = work / reference if reference > 0.0 else 0.0
    return -2
