"""Blocks of time steps: what :mod:`skfem_ancf.dynamics` does step by step."""

import math

import numpy as np

from .band import (copy, dense_solve, factorize, fix, multiply, products, solve, solve_rows,
                   times_columns)
from .body import body_force, body_mean, body_stress, body_tangent
from .constraints import constraint, constraint_acceleration, constraint_rate, jacobian
from .jit import inner, jit
from .moments import add_mean_moments, add_moment_stiffness, add_moments

EPS = 2.2e-16


@jit
def steps(cables, beams, moments, joints, conserving, parameters, vectors, factors, moment_factors,
          fixed, free, supports, motion, M, M_factor, ld, bw, A, stresses, carried, state, y,
          multipliers, dt, tol, floor, iteration, energy, rows, multiplier_rows):
    """Time steps; one row of ``rows`` (n, 4, N) and ``multiplier_rows`` (n, 2, m) for each.

    They are ``y`` and ``multipliers`` at its end.

    Parameters
    ----------
    vectors, factors, moment_factors
        Loads of constant direction (k, N), their factors (n, k), those of the moments (n, l).
    fixed, free, supports
        Fixed coordinates, the others as zeros and ones, and displacement, velocity and
        acceleration of the fixed ones (3, n, k).
    motion
        Of the joints, None without: at the end of each step c (n, m), g, and g at the time at which
        they act; then the rates of c and g, and the second rates. Of one row where nothing moves.
    M, M_factor
        Bands of the mass matrix and of its factor, with ``ld`` and ``bw``; ``A`` is for the
        iteration matrix.
    state
        Has factors, iterations, factorisations, rate, size of the step before; kept.
    y
        u, v, acceleration and the scheme's acceleration (4, N); advanced.
    multipliers
        At the end of the step, and in its middle (2, m); advanced.
    iteration
        :data:`skfem_ancf.dynamics.base.ITERATION`.

    Returns
    -------
    The number of steps done, and the energy scale.
    """
    N, m = y.shape[1], multipliers.shape[1]
    alpha_m, alpha_f, beta, gamma = parameters
    most, reused, fresh_rate, least_rate, diverging = iteration
    u, f, R, du, inertia = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    base, x, v, load, middle = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    J, J1, Y = np.zeros((m, N)), np.zeros((m, N)), np.zeros((m, N))
    S, phi, dm = np.empty((m, m)), np.empty(m), np.empty(m)
    impulse, l, guess = np.empty(m), np.empty(m), np.empty(N)
    none = np.empty((1, 1, 1))
    yes = N > 0  # as a constant it would compile the tangent once more
    if joints is not None:
        c_, g_, at_, c1_, g1_, c2_, g2_ = motion
        constant = joints[0].size == 0 and g_.shape[0] == 1
        couples = conserving and not constant
    if conserving:
        c_m, c_k = 2.0 / dt**2, 0.5
    else:
        c_m, c_k = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * dt * dt), 1.0
    for n in range(rows.shape[0]):
        u0, v0, a0, w0 = y[0], y[1], y[2], y[3]
        at = n if supports.shape[1] > 1 else 0
        if joints is not None:
            jt, gt = n if c_.shape[0] > 1 else 0, n if g_.shape[0] > 1 else 0
            copy(multipliers[0], l)
        position, speed, acceleration = supports[0, at], supports[1, at], supports[2, at]
        load[:] = 0.0
        ft = n if factors.shape[0] > 1 else 0
        for k in range(vectors.shape[0]):
            for i in range(N):
                load[i] += factors[ft, k] * vectors[k, i]
        if moments is not None:
            moment = moment_factors[n if moment_factors.shape[0] > 1 else 0]
        for i in range(N):
            if conserving:
                u[i] = u0[i] + dt * v0[i] + 0.5 * dt * dt * a0[i]
                base[i] = u0[i] + dt * v0[i]
            else:
                base[i] = u0[i] + dt * v0[i] + dt * dt * (0.5 - beta) * w0[i]
                u[i] = base[i] + dt * dt * beta * w0[i]
        for k in range(fixed.size):
            u[fixed[k]] = position[k]
        copy(u, guess)
        # the velocity of the guess, for the scale of the energy
        _velocity(conserving, u, u0, v0, w0, base, dt, beta, gamma, fixed, speed, v)
        multiply(M, ld, bw, v, inertia)
        kinetic, noise = 0.0, 0.0
        for i in range(N):
            kinetic += 0.5 * v[i] * inertia[i]
        multiply(M, ld, bw, u, inertia)
        for i in range(N):
            noise += u[i] * inertia[i]
        rough = math.sqrt(floor * floor * c_k + EPS * EPS * c_m * abs(noise))
        wanted = tol * math.sqrt(max(energy, kinetic)) + rough
        fresh, before, done, known = False, -1.0, False, False
        for k in range(most):
            for i in range(N):
                middle[i] = 0.5 * (u[i] + u0[i]) if conserving else u[i]
            if state[0] == 0.0:
                # the stress of an iterate may be far off: that of the start is not
                body_stress(cables, beams, u0, carried)
                body_tangent(cables, beams, middle, f, yes, carried, yes, stresses, A, ld)
                if moments is not None:
                    add_moment_stiffness(moments, moment, middle, A, ld)
                for i in range(A.size):
                    A[i] = c_m * M[i] + c_k * A[i]
                fix(A, ld, bw, free == 0.0)
                if not factorize(A, ld, bw, N):
                    return n, energy
                state[0], state[3] = 1.0, fresh_rate
                state[2] += 1.0
                fresh, before, known = True, -1.0, False
            if conserving:
                body_mean(cables, beams, u0, u, f)
                for i in range(N):
                    R[i] = load[i] - f[i]
                if moments is not None:
                    add_mean_moments(moments, moment, u0, u, R)
                for i in range(N):
                    x[i] = (u[i] - base[i]) * c_m
                for j in range(fixed.size):
                    x[fixed[j]] = (speed[j] - v0[fixed[j]]) / dt
            else:
                body_force(cables, beams, u, f, none, A)
                for i in range(N):
                    R[i] = load[i] - f[i]
                if moments is not None:
                    add_moments(moments, moment, u, R)
                for i in range(N):
                    w = (u[i] - base[i]) / (beta * dt * dt)
                    x[i] = (1.0 - alpha_m) * w + alpha_m * w0[i] - alpha_f * a0[i]
                    x[i] /= 1.0 - alpha_f
                for j in range(fixed.size):
                    x[fixed[j]] = acceleration[j]
            multiply(M, ld, bw, x, inertia)
            for i in range(N):
                R[i] = (R[i] - inertia[i]) * free[i]
            if joints is not None:
                if not known or not constant:
                    jacobian(joints, at_[gt], middle, J)
                    jacobian(joints, g_[gt], u, J1)
                for j in range(m):
                    for i in range(N):
                        R[i] -= l[j] * J[j, i] * free[i]
                if couples:
                    _velocity(conserving, u, u0, v0, w0, base, dt, beta, gamma, fixed, speed, v)
                    if not _impulse(joints, c1_[jt], g1_[gt], J, J1, M_factor, ld, bw, free, u, v,
                                    Y, S, impulse):
                        return n, energy
                    hk, hi, hj, hv = joints[0], joints[1], joints[2], joints[3]
                    for a in range(hk.size):
                        R[hi[a]] -= (free[hi[a]] * 0.25 * impulse[hk[a]] * hv[a]
                                     * (v0[hj[a]] + v[hj[a]]))
            for i in range(N):
                du[i] = R[i]
            solve(A, ld, bw, du)
            size = 0.0
            if joints is not None:
                constraint(joints, c_[jt], g_[gt], u, phi)
                if not known or not constant:
                    solve_rows(A, ld, bw, J, free, Y)
                    known = constant
                products(J1, Y, S)
                times_columns(J1, du, dm)
                for j in range(m):
                    dm[j] += phi[j]
                if not dense_solve(S, dm):
                    return n, energy
                for j in range(m):
                    size += abs(dm[j] * phi[j])
                    l[j] += dm[j]
                    for i in range(N):
                        du[i] -= dm[j] * Y[j, i]
            for i in range(N):
                size += abs(R[i] * du[i]) if m > 0 else R[i] * du[i]
                u[i] += du[i]
            size = math.sqrt(abs(size))
            state[1] += 1.0
            if not size < 1e300:
                return n, energy
            if before > 0.0:
                rate = size / before
                if rate > 1.0 and size <= 1e3 * rough:
                    done = True
                    break
                state[3] = max(rate, least_rate)  # of one step, used in the next
                if rate > reused and size * min(1.0, rate) > wanted:
                    if fresh and rate > diverging:
                        return n, energy
                    if rate > 1.0:  # old factors have led astray
                        copy(guess, u)
                        if joints is not None:
                            copy(multipliers[0], l)
                    state[0] = 0.0
                    continue
            if size * min(1.0, state[3]) <= wanted:
                done = True
                break
            before = size
        if not done:
            return n, energy
        _velocity(conserving, u, u0, v0, w0, base, dt, beta, gamma, fixed, speed, v)
        if joints is not None:
            for i in range(N):
                middle[i] = 0.5 * (u[i] + u0[i]) if conserving else u[i]
            jacobian(joints, at_[gt], middle, J)
            jacobian(joints, g_[gt], u, J1)
            if not _impulse(joints, c1_[jt], g1_[gt], J, J1, M_factor, ld, bw, free, u, v, Y, S,
                            impulse):
                return n, energy
        ahead = dt / (dt + state[4])
        state[4] = dt
        for i in range(N):
            if conserving:
                mean = (v[i] - v0[i]) / dt
                x[i], R[i] = mean + ahead * (mean - w0[i]), mean
            else:
                w = (u[i] - base[i]) / (beta * dt * dt)
                x[i] = ((1.0 - alpha_m) * w + alpha_m * w0[i] - alpha_f * a0[i]) / (1.0 - alpha_f)
                R[i] = w
        for j in range(fixed.size):
            x[fixed[j]] = R[fixed[j]] = acceleration[j]
        for j in range(m):  # none without joints
            if conserving:
                force = l[j] + impulse[j] / dt
                multipliers[0, j] = force + ahead * (force - multipliers[1, j])
                multipliers[1, j] = force
            else:
                multipliers[0, j] = l[j]
        if joints is not None:
            if not conserving:
                # the acceleration that meets the joints' second rate too
                constraint_acceleration(joints, c2_[jt], g1_[gt], g2_[gt], J1, u, v, x, dm)
                solve_rows(M_factor, ld, bw, J1, free, Y)
                products(J1, Y, S)
                if not dense_solve(S, dm):
                    return n, energy
                share = (1.0 - alpha_f) / (1.0 - alpha_m)
                for j in range(m):
                    multipliers[0, j] += dm[j]
                    for i in range(N):
                        x[i] -= dm[j] * Y[j, i]
                        R[i] -= share * dm[j] * Y[j, i]
        for i in range(N):
            y[0, i], y[1, i], y[2, i], y[3, i] = u[i], v[i], x[i], R[i]
            for j in range(4):
                rows[n, j, i] = y[j, i]
        for j in range(m):
            multiplier_rows[n, 0, j] = multipliers[0, j]
            multiplier_rows[n, 1, j] = multipliers[1, j] if conserving else multipliers[0, j]
        multiply(M, ld, bw, v, inertia)
        kinetic = 0.0
        for i in range(N):
            kinetic += 0.5 * v[i] * inertia[i]
        energy = max(energy, kinetic)
    return rows.shape[0], energy


@inner
def _velocity(conserving, u, u0, v0, w0, base, dt, beta, gamma, fixed, speed, v):
    """The velocity at the end of the step, without the joints' part."""
    for i in range(u.size):
        if conserving:
            v[i] = (u[i] - u0[i]) * (2.0 / dt) - v0[i]
        else:
            v[i] = v0[i] + dt * ((1.0 - gamma) * w0[i]
                                 + gamma * (u[i] - base[i]) / (beta * dt * dt))
    for k in range(fixed.size):
        v[fixed[k]] = speed[k]


@inner
def _impulse(joints, c1, g1, J, J1, M_factor, ld, bw, free, u, v, Y, S, impulse):
    """The joints' impulses, and their part in the velocity."""
    solve_rows(M_factor, ld, bw, J, free, Y)
    products(J1, Y, S)
    constraint_rate(joints, c1, g1, J1, u, v, impulse)
    if not dense_solve(S, impulse):
        return False
    for k in range(impulse.size):
        for i in range(v.size):
            v[i] -= Y[k, i] * impulse[k]
    return True
