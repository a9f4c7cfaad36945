"""Whole static iterations and blocks of time steps, compiled by Numba.

What :mod:`skfem_ancf.statics.newton` and :mod:`skfem_ancf.dynamics` do, for scenes whose beams are
all compiled: any number of beams, loads of constant direction, end moments, prescribed
displacements, and in motion supports and joints that move as given. The tables that the functions
take are made in :mod:`skfem_ancf.structure`:

* cables, beams: packs, and the coordinates (k, 2) of each, first and behind the last; or None;
* moments: coordinates (k, 2, c), weights (k, c), directions at the start (k, 2), sizes (k,);
* joints: the second derivatives as equation, row, column, value, and where the first derivative
  at u = 0 is not zero, as equation and column. ``Phi = c + g . u + u . H u / 2``.
"""

import math

import numpy as np
from numba import njit
from numba.typed import List

from .compiled import (beam_increment, beam_loop, beam_mean, cable_increment, cable_loop,
                       cable_mean, factorize, fix, inner, jit, multiply, solve)

EPS = 2.2e-16
MAX_ITERATIONS = 30
REUSED = 0.1  # contraction up to which factors are kept


@jit
def new_list(item):
    """A typed list; made here, so that its code is compiled once and kept."""
    items = List()
    items.append(item)
    return items


@jit
def append(items, item):
    """Add to a typed list."""
    items.append(item)


def spliced(function):
    """Compile a function as a part of those that call it."""
    return njit(inline="always")(function)


# forces and tangents of all beams; Numba leaves out what a scene has not, given as None


@spliced
def body_force(cables, beams, u, f, none, flat):
    """The internal force."""
    f[:] = 0.0
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            cable_loop(packs[k], u[a:b], f[a:b], False, False, none, False, none, flat, 1, 0)
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            beam_loop(packs[k], u[a:b], f[a:b], False, False, none, False, none, flat, 1, 0)


@spliced
def body_mean(cables, beams, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the energy."""
    f[:] = 0.0
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            cable_mean(packs[k], u0[a:b], u1[a:b], f[a:b])
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            beam_mean(packs[k], u0[a:b], u1[a:b], f[a:b])


@spliced
def body_tangent(cables, beams, u, f, geometric, carried, use_carried, stresses, flat, ld):
    """The internal force, the tangent into the band, and the stresses."""
    f[:] = 0.0
    flat[:] = 0.0
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b, s = at[k, 0], at[k, 1], stresses[0][k]
            cable_loop(packs[k], u[a:b], f[a:b], True, geometric, carried[0][k], use_carried, s,
                       flat, ld, a)
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b, s = at[k, 0], at[k, 1], stresses[1][k]
            beam_loop(packs[k], u[a:b], f[a:b], True, geometric, carried[1][k], use_carried, s,
                      flat, ld, a)


@inner
def _law(stiffness, strain, before):
    """In place of the strain the stress, added to the one before if there is one."""
    for e in range(strain.shape[1]):
        for p in range(strain.shape[2]):
            x, y, z = strain[0, e, p], strain[1, e, p], strain[2, e, p]
            for c in range(3):
                S = stiffness[c, 0] * x + stiffness[c, 1] * y + stiffness[c, 2] * z
                strain[c, e, p] = S + before[c, e, p] if before.size > 0 else S


@inner
def scale_add(strain, stiffness, before):
    """In place of a cable's strain the stress, added to the one before."""
    for c in range(2):
        for e in range(strain.shape[1]):
            for p in range(strain.shape[2]):
                strain[c, e, p] = stiffness[c] * strain[c, e, p] + before[c, e, p]


@inner
def copy(a, b):
    """b = a; the assignment of a slice would bring in code for its errors."""
    for i in range(a.size):
        b[i] = a[i]


@spliced
def carry(cables, beams, u, du, stresses, out):
    """The stresses, linearised, at u + du."""
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            S, stiffness = out[0][k], packs[k][7]
            cable_increment(packs[k], u[a:b], du[a:b], S)
            scale_add(S, stiffness, stresses[0][k])
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            S = out[1][k]
            beam_increment(packs[k], u[a:b], du[a:b], S)
            _law(packs[k][5], S, stresses[1][k])


@spliced
def body_stress(cables, beams, u, out):
    """The stresses at u."""
    none = np.empty((0, 0, 0))
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            cable_stress(packs[k], u[at[k, 0]:at[k, 1]], out[0][k])
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            S = out[1][k]
            beam_increment(packs[k], 0.5 * u[a:b], u[a:b], S)  # the strain is quadratic
            _law(packs[k][5], S, none)


@inner
def cable_stress(pack, u, out):
    """Normal force and moment at u."""
    G1_, G2_, A0_, B0_, s0_, kappa0_, w_, stiffness, constant, left, nd = pack
    for e in range(left.size):
        t = e if G1_.shape[0] > 1 else 0
        r = e if A0_.shape[0] > 1 else 0
        first = left[e] * nd
        for p in range(w_.shape[1]):
            d0, d1, d2, d3 = 0.0, 0.0, 0.0, 0.0
            for k in range(nd):
                x, y = u[first + 2 * k], u[first + 2 * k + 1]
                d0 += G1_[t, p, k] * x
                d1 += G1_[t, p, k] * y
                d2 += G2_[t, p, k] * x
                d3 += G2_[t, p, k] * y
            A0, A1 = A0_[r, p, 0], A0_[r, p, 1]
            a0, a1, b0, b1 = A0 + d0, A1 + d1, B0_[r, p, 0] + d2, B0_[r, p, 1] + d3
            s = a0 * a0 + a1 * a1
            out[0, e, p] = stiffness[0] * (((a0 + A0) * d0 + (a1 + A1) * d1)
                                           / (math.sqrt(s) + math.sqrt(s0_[r, p])))
            out[1, e, p] = stiffness[1] * ((a0 * b1 - a1 * b0) / s - kappa0_[r, p])


# moments that turn with a section


@inner
def _direction(moments, k, u):
    dofs, c, start = moments[0], moments[1], moments[2]
    x, y = start[k, 0], start[k, 1]
    for i in range(c.shape[1]):
        x += c[k, i] * u[dofs[k, 0, i]]
        y += c[k, i] * u[dofs[k, 1, i]]
    return x, y


@inner
def add_moments(moments, factors, u, f):
    """Add the forces of the moments at u."""
    dofs, c, M = moments[0], moments[1], moments[3]
    for k in range(M.size):
        x, y = _direction(moments, k, u)
        size = factors[k] * M[k] / (x * x + y * y)
        for i in range(c.shape[1]):
            f[dofs[k, 0, i]] -= size * y * c[k, i]
            f[dofs[k, 1, i]] += size * x * c[k, i]


@inner
def add_mean_moments(moments, factors, u0, u1, f):
    """Add the forces whose work from u0 to u1 is the moments times the angles turned."""
    dofs, c, M = moments[0], moments[1], moments[3]
    for k in range(M.size):
        x0, y0 = _direction(moments, k, u0)
        x1, y1 = _direction(moments, k, u1)
        x, y, dx, dy = 0.5 * (x0 + x1), 0.5 * (y0 + y1), x1 - x0, y1 - y0
        size = M[k] / (x * x + y * y)
        fx, fy, step = -size * y, size * x, dx * dx + dy * dy
        if step > 0.0:
            angle = math.atan2(x0 * dy - y0 * dx, x0 * x1 + y0 * y1)
            missing = (M[k] * angle - fx * dx - fy * dy) / step
            fx, fy = fx + missing * dx, fy + missing * dy
        for i in range(c.shape[1]):
            f[dofs[k, 0, i]] += factors[k] * c[k, i] * fx
            f[dofs[k, 1, i]] += factors[k] * c[k, i] * fy


@inner
def add_moment_stiffness(moments, factors, u, flat, ld):
    """Subtract the derivative of the moments' forces from the band."""
    dofs, c, M = moments[0], moments[1], moments[3]
    for k in range(M.size):
        x, y = _direction(moments, k, u)
        size = factors[k] * M[k] / (x * x + y * y) ** 2
        for i in range(2):
            for j in range(2):
                h = size * ((y * y - x * x) if i != j else 2 * x * y * (1 - 2 * i))
                for a in range(c.shape[1]):
                    row = dofs[k, i, a]
                    for b in range(c.shape[1]):
                        column = dofs[k, j, b]
                        if row >= column:
                            flat[column * ld + row - column] -= h * c[k, a] * c[k, b]


# joints


@inner
def constraint(joints, c, g, u, phi):
    """Phi at u."""
    hk, hi, hj, hv, gk, gi = joints
    copy(c, phi)
    for a in range(gk.size):
        phi[gk[a]] += g[a] * u[gi[a]]
    for a in range(hk.size):
        phi[hk[a]] += 0.5 * hv[a] * u[hi[a]] * u[hj[a]]


@inner
def jacobian(joints, g, u, J):
    """dPhi / du at u, shape (m, N)."""
    hk, hi, hj, hv, gk, gi = joints
    J[:] = 0.0
    for a in range(gk.size):
        J[gk[a], gi[a]] += g[a]
    for a in range(hk.size):
        J[hk[a], hi[a]] += hv[a] * u[hj[a]]


@inner
def times_columns(J, x, out):
    """out = J x."""
    for k in range(J.shape[0]):
        s = 0.0
        for i in range(x.size):
            s += J[k, i] * x[i]
        out[k] = s


@inner
def dense_solve(A, b):
    """Solve in place, by elimination with pivots; False if A is singular."""
    n = b.size
    for j in range(n):
        p = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[p, j]):
                p = i
        if not abs(A[p, j]) > 0.0:
            return False
        if p != j:
            for k in range(n):
                A[j, k], A[p, k] = A[p, k], A[j, k]
            b[j], b[p] = b[p], b[j]
        for i in range(j + 1, n):
            c = A[i, j] / A[j, j]
            if c != 0.0:
                for k in range(j, n):
                    A[i, k] -= c * A[j, k]
                b[i] -= c * b[j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            b[j] -= A[j, k] * b[k]
        b[j] /= A[j, j]
    return True


@inner
def solve_rows(flat, ld, bw, J, free, Y):
    """Y[k] = A^-1 J[k] at free coordinates, with the factors of A."""
    for k in range(J.shape[0]):
        for i in range(free.size):
            Y[k, i] = J[k, i] * free[i]
        solve(flat, ld, bw, Y[k])


@inner
def products(J, Y, S):
    """S = J Y^T."""
    for k in range(J.shape[0]):
        for l in range(Y.shape[0]):
            s = 0.0
            for i in range(J.shape[1]):
                s += J[k, i] * Y[l, i]
            S[k, l] = s


@inner
def constraint_rate(joints, c1, g1, J, u, v, out):
    """The rate of Phi."""
    gk, gi = joints[4], joints[5]
    times_columns(J, v, out)
    for k in range(out.size):
        out[k] += c1[k]
    for a in range(gk.size):
        out[gk[a]] += g1[a] * u[gi[a]]


@inner
def constraint_acceleration(joints, c2, g1, g2, J, u, v, acceleration, out):
    """The second rate of Phi."""
    hk, hi, hj, hv, gk, gi = joints
    times_columns(J, acceleration, out)
    for k in range(out.size):
        out[k] += c2[k]
    for a in range(gk.size):
        out[gk[a]] += g2[a] * u[gi[a]] + 2.0 * g1[a] * v[gi[a]]
    for a in range(hk.size):
        out[hk[a]] += hv[a] * v[hi[a]] * v[hj[a]]


# time steps


@jit
def steps(cables, beams, moments, joints, conserving, parameters, vectors, factors, moment_factors,
          fixed, free, supports, motion, M, M_factor, ld, bw, A, stresses, carried, state, y,
          multipliers, dt, tol, floor, energy, rows, multiplier_rows):
    """Time steps; one row of ``rows`` (n, 3, N) for each: u, v and the acceleration.

    Parameters
    ----------
    vectors, factors, moment_factors
        Loads of constant direction (k, N), their factors (n, k), those of the moments (n, l).
    fixed, free, supports
        Fixed coordinates, the others as zeros and ones, and displacement, velocity and
        acceleration of the fixed ones (3, n, k).
    motion
        Of the joints at the end of each step c (n, m), g, and g at the time at which they act;
        then the rates of c and g, and the second rates. Of one row where nothing moves.
    M, M_factor
        Bands of the mass matrix and of its factor, with ``ld`` and ``bw``; ``A`` is for the
        iteration matrix.
    state
        Has factors, iterations, factorisations, rate, size of the step before; kept.
    y
        u, v, acceleration and the scheme's acceleration (4, N); advanced.
    multipliers
        At the end of the step, and in its middle (2, m); advanced.

    Returns
    -------
    The number of steps done, and the energy scale.
    """
    N, m = y.shape[1], multipliers.shape[1]
    alpha_m, alpha_f, beta, gamma = parameters
    c_, g_, at_, c1_, g1_, c2_, g2_ = motion
    u, f, R, du, inertia = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    base, x, v, load, middle = np.empty(N), np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    J, J1, Y = np.zeros((m, N)), np.zeros((m, N)), np.zeros((m, N))
    S, phi, dm = np.empty((m, m)), np.empty(m), np.empty(m)
    impulse, l, guess = np.empty(m), np.empty(m), np.empty(N)
    none = np.empty((1, 1, 1))
    constant = joints[0].size == 0 and g_.shape[0] == 1
    yes = N > 0  # as a constant it would compile the tangent once more
    couples = conserving and not constant
    if conserving:
        c_m, c_k = 2.0 / dt**2, 0.5
    else:
        c_m, c_k = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * dt * dt), 1.0
    for n in range(rows.shape[0]):
        u0, v0, a0, w0 = y[0], y[1], y[2], y[3]
        at = n if supports.shape[1] > 1 else 0
        jt, gt = n if c_.shape[0] > 1 else 0, n if g_.shape[0] > 1 else 0
        position, speed, acceleration = supports[0, at], supports[1, at], supports[2, at]
        load[:] = 0.0
        ft = n if factors.shape[0] > 1 else 0
        for k in range(vectors.shape[0]):
            for i in range(N):
                load[i] += factors[ft, k] * vectors[k, i]
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
        copy(multipliers[0], l)
        for i in range(N):  # the velocity of the guess, for the scale of the energy
            if conserving:
                v[i] = (u[i] - u0[i]) * (2.0 / dt) - v0[i]
            else:
                v[i] = v0[i] + dt * ((1.0 - gamma) * w0[i]
                                     + gamma * (u[i] - base[i]) / (beta * dt * dt))
        for k in range(fixed.size):
            v[fixed[k]] = speed[k]
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
        for k in range(MAX_ITERATIONS):
            for i in range(N):
                middle[i] = 0.5 * (u[i] + u0[i]) if conserving else u[i]
            if state[0] == 0.0:
                # the stress of an iterate may be far off: that of the start is not
                body_stress(cables, beams, u0, carried)
                body_tangent(cables, beams, middle, f, yes, carried, yes, stresses, A, ld)
                add_moment_stiffness(moments, moment, middle, A, ld)
                for i in range(A.size):
                    A[i] = c_m * M[i] + c_k * A[i]
                fix(A, ld, bw, free == 0.0)
                if not factorize(A, ld, bw, N):
                    return n, energy
                state[0], state[3] = 1.0, 0.1
                state[2] += 1.0
                fresh, before, known = True, -1.0, False
            if conserving:
                body_mean(cables, beams, u0, u, f)
                for i in range(N):
                    R[i] = load[i] - f[i]
                add_mean_moments(moments, moment, u0, u, R)
                for i in range(N):
                    x[i] = (u[i] - base[i]) * c_m
                for j in range(fixed.size):
                    x[fixed[j]] = (speed[j] - v0[fixed[j]]) / dt
            else:
                body_force(cables, beams, u, f, none, A)
                for i in range(N):
                    R[i] = load[i] - f[i]
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
            if m > 0:
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
            if m > 0:
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
                state[3] = max(rate, 0.01)  # of one step, used in the next, where it may be larger
                if rate > REUSED and size * min(1.0, rate) > wanted:
                    if fresh and rate > 2.0:
                        return n, energy
                    if rate > 1.0:  # old factors have led astray
                        copy(guess, u)
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
        impulse[:] = 0.0
        if m > 0:
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
        for j in range(m):
            if conserving:
                force = l[j] + impulse[j] / dt
                multipliers[0, j] = force + ahead * (force - multipliers[1, j])
                multipliers[1, j] = force
            else:
                multipliers[0, j] = l[j]
        if m > 0 and not conserving:
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
            rows[n, 0, i], rows[n, 1, i], rows[n, 2, i] = u[i], v[i], x[i]
        for j in range(m):
            multiplier_rows[n, j] = multipliers[0, j]
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


# equilibrium


@jit
def equilibrium(cables, beams, moments, mixed, u, dead, factor, factors, gap, fixed, prescribed, free, A, ld,
                bw, tol, floor, force_floor, carried, stresses, f, record):
    """Iterate to equilibrium from u, in place, as :mod:`skfem_ancf.statics.newton` does.

    ``dead`` is the constant force, ``factor`` the load's, ``gap`` (N,) the force that may be
    missing, ``prescribed`` the change of the fixed coordinates; ``record`` (max_iterations + 1, 2)
    takes the residuals. Returns the number of linear systems solved, or -1 if the tangent is not
    regular, -2 if there is no convergence.
    """
    N, limit = u.size, record.shape[0] - 1
    R, du, scale, load = np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    none = np.empty((1, 1, 1))
    work = before = reference = np.inf
    moved, moving, yes = False, False, N > 0  # as a constant it would compile the tangent anew
    for i in range(N):
        moved = moved or u[i] != 0.0
    for i in range(fixed.size):
        moving = moving or prescribed[i] != 0.0
    for k in range(limit + 1):
        last = k > 1 and work * min(1.0, work / before) <= tol * reference + floor
        for turn in range(2):
            if last and turn == 0:
                body_force(cables, beams, u, f, none, A)
            elif turn == 0 or last:
                body_tangent(cables, beams, u, f, yes, carried, mixed and k > 0, stresses, A, ld)
                add_moment_stiffness(moments, factors, u, A, ld)
                for i in range(N):
                    scale[i] = 1.0 / abs(A[i * ld])
            if turn == 1:
                break
            for i in range(N):
                load[i] = factor * dead[i]
            add_moments(moments, factors, u, load)
            rho, inner, outer = 0.0, 0.0, 0.0
            for i in range(N):
                R[i] = (load[i] - f[i] - gap[i]) * free[i]
                rho += R[i] * R[i] * scale[i]
                inner += f[i] * f[i] * scale[i]
                outer += load[i] * load[i] * scale[i]
            rho, size = math.sqrt(rho), math.sqrt(max(inner, outer))
            if not rho < 1e300:
                return -1
            record[k, 0] = rho / size if size > 0.0 else 0.0
            if k == 0:
                small = rho <= 1e-3 * tol * size + (force_floor if moved else 0.0)
            else:
                small = last and rho <= tol * size + force_floor
            if small and not moving:
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
        for i in range(N):
            du[i] = R[i]
        fix(A, ld, bw, free == 0.0)
        if not factorize(A, ld, bw, N):
            return -1
        solve(A, ld, bw, du)
        before, work = work, 0.0
        for i in range(N):
            work += R[i] * du[i]
        work = math.sqrt(abs(work))
        if not work < 1e300:
            return -1
        if moving:
            for i in range(fixed.size):
                du[fixed[i]] = prescribed[i]
            moving = False
        if mixed:
            carry(cables, beams, u, du, stresses, carried)
        inner, outer = 0.0, 0.0
        for i in range(N):
            u[i] += du[i]
            inner += f[i] * u[i]
            outer += load[i] * u[i]
        reference = math.sqrt(max(abs(inner), abs(outer)))
        record[k, 1] = work / reference if reference > 0.0 else 0.0
    return -2
