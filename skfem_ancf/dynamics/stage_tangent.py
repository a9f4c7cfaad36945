"""Named tuples of collocation, factors for each eigenvalue, and their solutions."""

from typing import NamedTuple

import numpy as np

from ..actions.forces.kernels import (add_element_damping, add_element_tangent, element_damping,
                                      element_stiffness, put_between)
from ..actions.tables import add_load_stiffness, joint_directions
from ..beam.strain_energy import body_mean_stress, body_stress, body_tangent
from ..core.band import (SPARE, Band, add_multiple, copy, factorize, factorize_complex, fix_stored,
                         solve, solve_complex, solve_dependent)
from ..core import F1, F2, F3, indices, shaped, source
from .records import JointMotions, add_damping, row_of


# named tuples of collocation: coefficients, prescribed functions, work arrays

class Method(NamedTuple):
    """Coefficients of a method of n points and k eigenvalues, one of each conjugate pair. Complex
    numbers have a first axis of length 2: real and imaginary part."""

    points: F1  # c, (n,)
    weights: F1  # b, (n,)
    first: F2  # A^-1
    second: F2  # A^-2
    values: F2  # mu, (2, k)
    to: F3  # rows of T^-1, (2, k, n)
    back: F3  # columns of T, doubled for pairs, (2, n, k)
    ahead: F2  # extrapolation from c to 1 + c by monomials of degree 2 and above, (n, n)


class Interval(NamedTuple):
    """Prescribed functions at the points and the end of s steps; one row if constant."""

    h: float  # step size
    begun: int  # 1 if there is a previous step
    ahead: F2  # Method.ahead for the first step
    times: F1  # (s (n + 1),)
    factors: F2  # of the loads, (s (n + 1), l)
    constrained: F3  # displacement, velocity and acceleration of fixed DOFs, (s (n + 1), 3, N)
    joints: JointMotions


class StageWork(NamedTuple):
    """Iterates, one row for each point, stored factors and work arrays; b low-rank rows."""

    y: F2  # u, v, acceleration at the start of the step, then at its end, (3, N)
    before: F2  # u, v at the start of the previous step, (2, N); U are its points
    Z: F2  # the unknowns, (n, N), as the next five
    U: F2  # displacement
    V: F2  # velocity
    W: F2  # acceleration
    R: F2  # residual and correction
    guess: F2  # initial Z
    l: F2  # multipliers, (n, m), as the next three
    dl: F2  # their correction
    first: F2  # initial multipliers
    gaps: F2  # residual of the joints' rates
    independent: F1  # independent stresses, (n s,)
    constitutive: F1  # stresses of the displacement, (n s,)
    missing: F1  # difference of both, (n s,)
    stresses: F2  # work, (3, s); the first row is zero
    x: F2  # work, (4, N)
    r: F1  # work, (2 b,)
    q: F2  # work, (2 b, 2 b)
    Q: F3  # Schur complement of the rows for each eigenvalue, (k, 2 b, 2 b)
    origins: F2  # displacement of the factorised matrix in each row, (n, N)
    pairs: F2  # factors of complex eigenvalues, real and imaginary parts, (k, 2 N ld)
    real: Band  # factor of the real eigenvalue
    J: F2  # low-rank rows at the origin, joints first, (b, N)
    Y: F3  # their solutions, (2 k, b, N)
    S: F3  # coupling of the other rows by displacement and velocity, (2, b - m, b - m)
    end: F3  # joint Jacobian at the end of the step and its solutions by the mass, (2, m, N)
    shared: F2  # their Schur complement, (m, m)
    shares: F1  # multipliers there, (m,)
    D: Band  # work: damping matrix
    method: Method


def new_points(method: Method, N: int, m: int, rows: int, stresses: int, D: Band) -> StageWork:
    """The StageWork of a method, with zeros."""
    n, k, ld, b = method.points.size, method.values.shape[1], D.width + 1 + SPARE, m + rows
    real = Band(np.zeros(N * ld), np.zeros(0, np.int64), ld, D.width, 0)
    return StageWork._make([
        np.zeros((3, N)), np.zeros((2, N)), *np.zeros((6, n, N)), *np.zeros((4, n, m)),
        *np.zeros((3, n * stresses)), np.zeros((3, stresses)), np.zeros((4, N)), np.zeros(2 * b),
        np.zeros((2 * b, 2 * b)), np.zeros((k, 2 * b, 2 * b)), np.zeros((n, N)),
        np.zeros((k, 2 * N * ld)), real, np.zeros((b, N)), np.zeros((2 * k, b, N)),
        np.zeros((2, rows, rows)), np.zeros((2, m, N)), np.zeros((m, m)), np.zeros(m), D, method])


@source
def flat_points(x):
    """All points in one row, a view."""
    return shaped(x, (x.size,))


@source
def factorize_stages(e, matrices, method, s, w, state, step):
    """Factorise the iteration matrices at the mean of the points; False on failure."""
    origin, f, S, yes = w.origins[0], w.x[0], w.stresses, w.x.size > 0
    at, e.span[0] = step * (method.points.size + 1), s.h
    for i in indices(origin.size):
        origin[i] = 0.0
    for k in range(method.points.size):
        add_multiple(method.weights[k], w.U[k], origin)
    for k in range(1, method.points.size):
        copy(origin, w.origins[k])
    if state.mixed_steps[0] > 0:
        body_mean_stress(e.body, e.copies, method.weights, w.independent, S[1])
    else:
        body_stress(e.body, w.y[0], S[1])
    body_tangent(e.body, origin, f, S[1], yes, S[2], e.K)
    add_load_stiffness(e.loads, row_of(s.factors, at), s.times[at], 1.0, origin, e.K)
    add_element_tangent(e.forces, s.times[at], origin, e.K)
    D = w.D.flat
    for i in indices(D.size):
        D[i] = 0.0
    if matrices.dampers.active > 0:
        add_damping(e.viscous, matrices.dampers, matrices.M, 1.0, origin, S, f, w.D)
        if matrices.dampers.elements > 0:
            add_element_damping(e.forces, s.times[at], origin, w.y[1], w.D)
    if w.J.shape[0] > 0:
        _rows(e, matrices, s, w, at)
    for k in range(method.values.shape[1]):
        a, b = method.values[0, k] / s.h, method.values[1, k] / s.h
        if b != 0.0:
            F = w.pairs[k]
            half = F.size // 2
            _combine(e.K, matrices.M, w.D, e.fixed, 1.0, a * a - b * b, a, F[:half])
            _combine(e.K, matrices.M, w.D, e.fixed, 0.0, 2.0 * a * b, b, F[half:])
            done = factorize_complex(F, e.K.width)
        else:
            _combine(e.K, matrices.M, w.D, e.fixed, 1.0, a * a, a, w.real.flat)
            done = factorize(w.real)
        if not done:
            return False
        for j in range(w.J.shape[0]):
            x, y = w.Y[2 * k, j], w.Y[2 * k + 1, j]
            copy(w.J[j], x)
            for i in indices(y.size):
                y[i] = 0.0
            solve_for(w, k, x, y)
        _between(w, s.h, k)
    return True


@source
def _between(w, h, k):
    """Schur complement of the low-rank rows for the eigenvalue k."""
    q, Q, b, m, values = w.q, w.Q[k], w.J.shape[0], w.l.shape[1], w.method.values
    for a in range(b):
        for j in range(b):
            re, im = np.dot(w.J[a], w.Y[2 * k, j]), np.dot(w.J[a], w.Y[2 * k + 1, j])
            q[j, a], q[b + j, b + a], q[b + j, a], q[j, b + a] = re, re, -im, im  # its columns
    if b > m:
        for j in range(2 * b):
            _stiffen(w.S, values[0, k] / h, values[1, k] / h, m, q[j])
    for a in range(m, b):
        q[a, a] += 1.0
        q[b + a, b + a] += 1.0
    for a in range(2 * b):
        for j in range(2 * b):
            Q[a, j] = q[j, a]


@source
def _rows(e, matrices, s, w, at):
    """Set the low-rank rows at the mean of the points, and the coupling of those of no joint."""
    m, forces, t = w.l.shape[1], e.forces, s.times[at]
    if m > 0:
        joint_directions(e.joints, row_of(s.joints.g, at)[0], t, w.origins[0], w.J[:m])
    for a in range(matrices.rows.P.shape[0]):
        copy(matrices.rows.P[a], w.J[m + a])
    for a in range(w.J.shape[0]):
        J = w.J[a]
        for i in indices(J.size):
            J[i] *= e.free[i]
    modes, D = matrices.dampers.modes.shape[0], np.empty(forces.size)
    if w.S.shape[1] > modes:
        element_stiffness(forces, t, w.origins[0], w.y[1], 0.0, D)
        put_between(forces, D, 1.0, modes, w.S[0])
        element_damping(forces, t, w.origins[0], w.y[1], D)
        put_between(forces, D, 1.0, modes, w.S[1])
    for a in range(modes):
        w.S[1, a, a] = 1.0


@source
def _stiffen(S, p, z, m, column):
    """The last rows of a column of ``q f = r`` times ``C = S[0] + (p + i z) S[1]``."""
    k, b = S.shape[1], column.size // 2
    scratch = np.empty(2 * k)
    for a in range(k):
        scratch[a], scratch[k + a] = column[m + a], column[b + m + a]
    for a in range(k):
        re, im = 0.0, 0.0
        for c in range(k):
            C, D = S[0, a, c] + p * S[1, a, c], z * S[1, a, c]
            re += C * scratch[c] - D * scratch[k + c]
            im += C * scratch[k + c] + D * scratch[c]
        column[m + a], column[b + m + a] = re, im


@source
def solve_for(w, k, x, y):
    """Solve in place with the factors of eigenvalue k; y is unchanged if that is real."""
    if w.method.values[1, k] != 0.0:
        solve_complex(w.pairs[k], w.real.width, x, y)
    else:
        solve(w.real, x)


@source
def join(method, s, w, k, r, q, x, y):
    """Correct x + i y, solved with the band, by forces r along the low-rank rows J. For joints ``mu
    / h J x = -gap``; the force of other rows is ``C J x``."""
    m, b, n = w.l.shape[1], w.J.shape[0], method.points.size
    p, z = method.values[0, k], method.values[1, k]
    c, d = s.h * p / (p * p + z * z), -s.h * z / (p * p + z * z)  # h / mu
    for a in range(b):
        J = w.J[a]
        r[a], r[b + a] = np.dot(J, x), np.dot(J, y)
    for a in range(m):
        re, im = 0.0, 0.0
        for j in range(n):
            re += method.to[0, k, j] * w.gaps[j, a]
            im += method.to[1, k, j] * w.gaps[j, a]
        r[a] += c * re - d * im
        r[b + a] += c * im + d * re
    if b > m:
        _stiffen(w.S, p / s.h, z / s.h, m, r)
    copy(flat_points(w.Q[k]), flat_points(q))
    if not solve_dependent(q, r):
        return False
    for a in range(b):
        re, im, f, g = w.Y[2 * k, a], w.Y[2 * k + 1, a], r[a], r[b + a]
        for i in indices(x.size):
            x[i] -= f * re[i] - g * im[i]
            y[i] -= f * im[i] + g * re[i]
    return True


@source
def _combine(K, M, D, fixed, c, m, d, out):
    """``c K + m M + d D`` with the supports fixed, the lower half of each column."""
    # Of an unsymmetric K, its symmetric part; the iteration corrects the rest.
    ld, top = K.width + 1 + SPARE, K.top
    n, x, y, z = out.size // ld, K.flat, M.flat, D.flat
    columns = shaped(out, (n, ld))
    if top > 0:
        k, l, r = shaped(x, (n, K.ld)), shaped(y, (n, K.ld)), shaped(z, (n, K.ld))
        for h in range(min(K.width + 1, n)):
            for j in indices(n):
                columns[j, h] = c * k[j, top + h] + m * l[j, top + h] + d * r[j, top + h]
            later = k[h:]
            for j in indices(n - h):
                columns[j, h] += 0.5 * c * (later[j, top - h] - k[j, top + h])
    else:
        for i in indices(out.size):
            out[i] = c * x[i] + m * y[i] + d * z[i]
    fix_stored(out, ld, K.width, 0, fixed)
