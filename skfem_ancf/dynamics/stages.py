"""Steps of collocation, as a text.

With ``A^-1 = T diag(mu) T^-1`` the points of a step fall into systems ``K + mu D / h + mu^2 M /
h^2`` for each eigenvalue, one for each pair: complex and symmetric, with a positive real part but
for a factor, so that their factors L D L^T need no exchanges.
"""

from typing import NamedTuple

import numpy as np

from ..core.band import (SPARE, Band, add_multiple, clear, copy, factorize,
                         factorize_complex, fix_stored, multiply, solve, solve_complex,
                         solve_dependent, solve_joined)
from ..beam.strain_energy import (add_force_by, add_viscous_stress, body_force, body_gradients,
                                  body_mean_stress, body_mixed, body_stress, body_tangent,
                                  body_tangent_by, carry_by)
from ..actions.forces.kernels import (add_elastic_force, add_element_damping, add_element_tangent,
                                    element_damping, element_stiffness, pace_contact, put_between,
                                    settle_contact)
from ..core.source import F1, F2, F3, lanes, shaped, source
from ..actions.tables import (add_constraint_rate, add_joint_force, add_load_stiffness, constraint,
                              external_force, joint_directions)
from .dampers import add_damping, damping_beside, damping_force
from .rates import JointMotion, JointMotions, acceleration_of_joints, drive_rate
from .steps import (ASTRAY, BEFORE, COUNT, DEPENDENT, DISSIPATED, DONE, ENERGY, FACTORIZED, FAILED,
                    FAILURE, FRESH, GO_ON, ITERATIONS, LAST_SIZE, MIXED, NOT_CONVERGED, RATE, READY,
                    SINGULAR, SIZE, judged, round_off)

#: Contraction up to which factors are kept, and where stresses are carried: new ones at points
#: as far apart turn as far from them. For how many steps they are.
REUSED, CARRIED, LASTING = 0.3, 0.5, 32.0
#: Corrections that close joints at the end of a step.
CLOSINGS = 2


class Method(NamedTuple):
    """The numbers of a method of n points and k eigenvalues, one of each pair.

    Attributes
    ----------
    points, weights
        c and b.
    first, second
        A^-1 and its square.
    values, to, back
        mu, shape (2, k), rows of T^-1, (2, k, n), and columns of T, those of pairs twice, (2, n,
        k): real and imaginary parts.
    ahead
        Values at 1 + c of the polynomial without its first two terms, from those at c, (n, n).
    """

    points: F1
    weights: F1
    first: F2
    second: F2
    values: F2
    to: F3
    back: F3
    ahead: F2


class Interval(NamedTuple):
    """What is given of s steps, at the points and the end of each; one row where nothing varies.

    Attributes
    ----------
    h, begun
        Their size, and 1 if there is a step before the first.
    ahead
        As of the Method for the first step, from one before of another size.
    times, factors
        Shape (s (n + 1),), and of the loads there, (s (n + 1), l) or (1, l).
    held
        Displacement, velocity and acceleration of fixed coordinates, (s (n + 1), 3, N) or (1, ...).
    joints
        A :class:`~skfem_ancf.dynamics.rates.JointMotions`.
    """

    h: float
    begun: int
    ahead: F2
    times: F1
    factors: F2
    held: F3
    joints: JointMotions


class Points(NamedTuple):
    """What is found, a row for each point, and what of factors is kept.

    Attributes
    ----------
    y
        u, v and the acceleration at the begin of the step, then at its end, shape (3, N).
    before
        u and v at the begin of the step before, shape (2, N); U is that of its points.
    Z, U, V, W, R, guess
        The unknowns, displacement, velocity, acceleration, residual and correction, and where the
        iteration begins, shape (n, N).
    l, dl, first, gaps
        Multipliers, their correction, those at the begin of the iteration, and what rates of
        joints miss, (n, m).
    carried, own, missing
        Stresses that are carried, those of the displacement, and the difference, shape (n s,): as
        a body has them of which there are n.
    stresses
        Room, shape (3, s), the first row zero.
    x, r, q
        Room, shape (4, N), (2 b,) and (2 b, 2 b), with b rows beside the band.
    Q
        The matrix between these rows for each eigenvalue, shape (k, 2 b, 2 b).
    origin, B
        Where the factors were made, shape (N,), and with carried stresses the gradients there.
    pairs, real
        Factors of complex eigenvalues, real parts and imaginary ones, shape (k, 2 N ld), and of
        the real one, of which an odd number of points has one.
    J, Y, S
        The rows beside the band there, the joints' directions before those of the Matrices, (b, N),
        the solutions for them, (2 k, b, N), and what is between the latter by displacement and by
        velocity, (2, b - m, b - m).
    end, shared, shares
        The joints' directions at the end of the step, and solutions by the mass, (2, m, N), both
        together, (m, m), and multipliers there, (m,).
    D
        Room for the derivative of damping.
    method
        As above.
    """

    y: F2
    before: F2
    Z: F2
    U: F2
    V: F2
    W: F2
    R: F2
    guess: F2
    l: F2
    dl: F2
    first: F2
    gaps: F2
    carried: F1
    own: F1
    missing: F1
    stresses: F2
    x: F2
    r: F1
    q: F2
    Q: F3
    origin: F1
    B: F1
    pairs: F2
    real: Band
    J: F2
    Y: F3
    S: F3
    end: F3
    shared: F2
    shares: F1
    D: Band
    method: Method


def room_for_points(method: Method, N: int, m: int, rows: int, stresses: int, gradients: int,
                    D: Band) -> Points:
    """The Points of a method."""
    n, k, ld, b = method.points.size, method.values.shape[1], D.width + 1 + SPARE, m + rows
    real = Band(np.zeros(N * ld), np.zeros(0, np.int64), ld, D.width, 0)
    return Points._make([
        np.zeros((3, N)), np.zeros((2, N)), *np.zeros((6, n, N)), *np.zeros((4, n, m)),
        *np.zeros((3, n * stresses)), np.zeros((3, stresses)), np.zeros((4, N)), np.zeros(2 * b),
        np.zeros((2 * b, 2 * b)), np.zeros((k, 2 * b, 2 * b)), np.zeros(N), np.zeros(gradients),
        np.zeros((k, 2 * N * ld)), real, np.zeros((b, N)), np.zeros((2 * k, b, N)),
        np.zeros((2, rows, rows)), np.zeros((2, m, N)), np.zeros((m, m)), np.zeros(m), D, method])


@source
def collocate(e, matrices, rule, s, w, state, memories, rows, stages, multiplier_rows):
    """Take steps from ``w.y`` and ``w.first`` on; returns how many were done.

    Written are of each step the work of damping up to its end and what obstacles keep, (s, 1 + k),
    u, v and the acceleration, (s, 3, N), the displacements of its points, (s, n, N), and the
    multipliers of these and at the end, (s, n + 1, m).
    """
    method = w.method
    contacts, taken = e.forces.contacts, np.empty(1)
    if contacts.lasting > 0:
        pace_contact(e.forces, s.h)
    for k in range(rows.shape[0]):
        if k > 0 or s.begun > 0:
            _ahead(method, method.ahead if k > 0 else s.ahead, s.h, state[BEFORE], w)
        if not _converges(e, matrices, method, rule, s, w, state, k):
            return k
        copy(w.y[0], w.before[0])
        copy(w.y[1], w.before[1])
        if not _end(e, matrices, method, s, w, state, k):
            state[FAILURE] = DEPENDENT
            return k
        if contacts.lasting > 0:
            t = s.times[(k + 1) * (method.points.size + 1) - 1]
            settle_contact(e.forces, t, 0.0, w.y[0], w.y[0], taken)
            state[DISSIPATED] += taken[0]
            copy(contacts.memory, memories[k, 1:])
        state[BEFORE], state[MIXED] = s.h, max(0.0, state[MIXED] - 1.0)
        for j in range(3):
            copy(w.y[j], rows[k, j])
        for j in range(method.points.size):
            copy(w.U[j], stages[k, j])
            copy(w.l[j], w.first[j])
            copy(w.l[j], multiplier_rows[k, j])
        copy(w.shares, multiplier_rows[k, method.points.size])
        memories[k, 0] = state[DISSIPATED]
    return rows.shape[0]


@source
def _converges(e, matrices, method, rule, s, w, state, step):
    """Iterate to the points of a step: U, V and W are theirs then; False if there are none."""
    n, room, told, u0 = method.points.size, w.x[0], GO_ON, w.y[0]
    rates = w.gaps.size > 0 or matrices.dampers.active > 0
    multiply(matrices.M, u0, room)
    largest = 0.0
    for k in range(method.values.shape[1]):
        a, b = method.values[0, k], method.values[1, k]
        largest = max(largest, (a * a + b * b) / (s.h * s.h))
    rough = round_off(rule, 1.0, largest, abs(np.dot(u0, room)))
    wanted = rule.tol * np.sqrt(state[ENERGY]) + rough
    state[FRESH], state[SIZE] = 0.0, -1.0
    if state[MIXED] > 0.0:
        state[READY] = 0.0  # old ones have turned the beam
    _start(e, matrices, method, s, w, state, step)
    for _ in range(ITERATIONS):
        _states(e.free, method, s, w, step, rates)
        if state[READY] == 0.0:
            if not _factorize(e, matrices, method, s, w, state, step):
                state[FAILURE] = SINGULAR
                return False
            state[FACTORIZED] += method.values.shape[1]
            state[READY], state[RATE], state[FRESH], state[SIZE] = 1.0, REUSED, 1.0, -1.0
        _internal(e, matrices, w, state)
        for k in range(n):
            _residual(e, matrices, method, s, w, state, step, k)
        state[COUNT] += n
        if not _correct(e.free, method, s, w, state):
            state[FAILURE] = DEPENDENT
            return False
        told = judged(state, wanted, rough, REUSED, CARRIED, False)
        if told == GO_ON and state[FRESH] > 0.0 and _is_lost(state):
            state[MIXED], told = LASTING, ASTRAY  # its factors serve
            body_gradients(e.body, w.origin, w.B)
        if told == ASTRAY:
            _start(e, matrices, method, s, w, state, step)
        elif told != GO_ON:
            break
        elif state[MIXED] > 0.0:
            carry_by(e.body, e.copies, w.B, _flat(w.R), w.own, w.carried)
            if matrices.dampers.viscous > 0:
                _carry_rates(e, method, s.h, w)
    _states(e.free, method, s, w, step, True)
    if told != DONE and told != FAILED:
        state[FAILURE] = NOT_CONVERGED
    return told == DONE


@source
def _ahead(method, ahead, h, before, w):
    """Where the iteration begins: the polynomial of the step before, at this one's points."""
    n, u0, v0, u, v = method.points.size, w.y[0], w.y[1], w.before[0], w.before[1]
    for k in range(n):
        guess, c = w.guess[k], h * method.points[k]
        for i in lanes(u.size):
            guess[i] = u[i] + (before + c) * v[i] - u0[i] - c * v0[i]
        for j in range(n):
            p = ahead[k, j]
            add_multiple(p, w.U[j], guess)
            add_multiple(-p, u, guess)
            add_multiple(-p * before * method.points[j], v, guess)


@source
def _end(e, matrices, method, s, w, state, step):
    """The end of the step into ``w.y``, and the work of damping; False if joints are dependent."""
    n, dampers, first = method.points.size, matrices.dampers, step * (method.points.size + 1)
    t = s.times[first + n]
    u, v, a, f, room = w.y[0], w.y[1], w.y[2], w.x[0], w.x[2]
    ends = method.points[n - 1] == 1.0
    for k in range(n):
        c, U, V, W = s.h * method.weights[k], w.U[k], w.V[k], w.W[k]
        if dampers.active > 0:
            damping_force(e, dampers, matrices.M, s.times[first + k], U, V, f, room)
            state[DISSIPATED] += c * np.dot(f, V)
        if not ends:
            add_multiple(c, V, u)
            add_multiple(c, W, v)
    if ends:
        copy(w.U[n - 1], u)
        copy(w.V[n - 1], v)
        copy(w.W[n - 1], a)
    held, motion, joined = _row(s.held, first + n), _motion(s.joints, first + n), w.shares.size > 0
    for i in lanes(u.size):
        u[i] = u[i] * e.free[i] + held[0, i]
        v[i] = v[i] * e.free[i] + held[1, i]
    if joined and not _close(e, matrices, s, w, motion, t, step):
        return False
    if not ends:
        _balance(e, matrices, s, w, first + n)
    if joined:
        acceleration_of_joints(e.joints, motion, t, s.h, u, v, w.shares)
        if not _meet(matrices.mass, e.free, w, a, not joined):  # J as for the velocity
            return False
        if ends:
            add_multiple(1.0, w.l[n - 1], w.shares)
    multiply(matrices.M, v, room)
    state[ENERGY] = max(state[ENERGY], 0.5 * np.dot(v, room))
    return True


@source
def _balance(e, matrices, s, w, at):
    """The acceleration at the end of the step by the forces there, without those of joints.

    A method whose last point is the end has it from its points: there errors of the iteration are
    not multiplied by the stiffness.
    """
    u, v, a, f, Q, room = w.y[0], w.y[1], w.y[2], w.x[0], w.x[1], w.x[2]
    held, t = _row(s.held, at), s.times[at]
    copy(held[2], a)
    multiply(matrices.M, a, room)
    body_force(e.body, u, f)
    add_elastic_force(e.forces, t, 0.0, u, u, f)
    external_force(e.loads, _row(s.factors, at), t, 1.0, u, Q)
    for i in lanes(a.size):
        a[i] += (Q[i] - f[i] - room[i]) * e.free[i]
    if matrices.dampers.active > 0:
        damping_force(e, matrices.dampers, matrices.M, t, u, v, f, room)
        for i in lanes(a.size):
            a[i] -= f[i] * e.free[i]
    solve(matrices.mass, a)


@source
def _close(e, matrices, s, w, motion, t, step):
    """Move u to where joints are closed, the nearest in the norm of the mass, and v with it."""
    u, v, g, x = w.y[0], w.y[1], motion.g[0], w.x[3]
    bends = e.joints.hk.size > 0 or e.joints.own > 0  # J depends on u, or on the time
    turns = step == 0 or s.joints.g.shape[0] > 1
    for k in range(CLOSINGS):
        joint_directions(e.joints, g, t, u, w.end[0])
        constraint(e.joints, motion.c[0], g, t, u, w.shares)
        for i in lanes(x.size):
            x[i] = 0.0
        if not _meet(matrices.mass, e.free, w, x, bends or (turns and k == 0)):
            return False
        for i in lanes(x.size):
            u[i] += x[i]
    joint_directions(e.joints, g, t, u, w.end[0])
    drive_rate(e.joints, motion, t, s.h, u, w.shares)
    return _meet(matrices.mass, e.free, w, v, bends)


@source
def _meet(mass, free, w, x, anew):
    """Change x so that J x becomes minus ``w.shares``, which become the multipliers for it.

    Of ``J M^-1`` made anew, or of that of the last time.
    """
    J = w.end[0]
    return solve_joined(mass, J, J, free, anew, w.end[1], w.shared, w.shares, x)


# the iteration


@source
def _flat(x):
    """The coordinates of all points in one row, a view."""
    return shaped(x, (x.size,))


@source
def _start(e, matrices, method, s, w, state, step):
    """Where it begins; with carried stresses by the mean acceleration of the step before.

    A polynomial through points where a stiff beam vibrates leads far away.
    """
    for k in range(w.Z.shape[0]):
        copy(w.guess[k], w.Z[k])
        copy(w.first[k], w.l[k])
    if state[MIXED] > 0.0:
        for k in range(w.R.shape[0]):
            copy(w.y[0], w.R[k])
        body_stress(e.copies, _flat(w.R), w.carried)
        if step > 0 or s.begun > 0:
            v0, v = w.y[1], w.before[1]
            for k in range(w.Z.shape[0]):
                Z, c = w.Z[k], 0.5 * (s.h * method.points[k])**2 / state[BEFORE]
                for i in lanes(v.size):
                    Z[i] = c * (v0[i] - v[i])


@source
def _is_lost(state):
    """True if the first correction has more energy than the motion: it would stretch far."""
    return (state[MIXED] == 0.0 and state[LAST_SIZE] < 0.0
            and state[SIZE] > np.sqrt(state[ENERGY]))


@source
def _states(free, method, s, w, step, rates):
    """Displacements, accelerations and, if asked for, velocities of the points."""
    u0, v0, n, N = w.y[0], w.y[1], method.points.size, free.size
    for k in range(n):
        U, V, W, Z, c = w.U[k], w.V[k], w.W[k], w.Z[k], s.h * method.points[k]
        held = _row(s.held, step * (n + 1) + k)
        for i in lanes(N):
            U[i] = (u0[i] + c * v0[i] + Z[i]) * free[i] + held[0, i]
            W[i] = 0.0
        for j in range(n):
            add_multiple(method.second[k, j] / (s.h * s.h), w.Z[j], W)
        for i in lanes(N):
            W[i] = W[i] * free[i] + held[2, i]
        if rates:
            copy(v0, V)
            for j in range(n):
                add_multiple(method.first[k, j] / s.h, w.Z[j], V)
            for i in lanes(N):
                V[i] = V[i] * free[i] + held[1, i]


@source
def _row(x, k):
    """Of an array that may have one row for all points."""
    return x[k if x.shape[0] > 1 else 0]


@source
def _motion(joints, k):
    """The joints' motion at a point."""
    return JointMotion(_row(joints.c, k), _row(joints.g, k), joints.drives)


@source
def _internal(e, matrices, w, state):
    """The internal forces of all points at once, into R; carried stresses are viscous ones too."""
    U, f, missing, own, carried = _flat(w.U), _flat(w.R), w.missing, w.own, w.carried
    if state[MIXED] > 0.0:
        body_mixed(e.copies, False, U, U, f, carried, own)
        if matrices.dampers.viscous > 0:
            for k in range(w.U.shape[0]):
                add_viscous_stress(e.viscous, e.body, e.copies, k, w.U[k], w.V[k], w.stresses, own)
        for i in lanes(missing.size):
            missing[i] = own[i] - carried[i]
        add_force_by(e.body, e.copies, w.B, missing, f)
    else:
        body_force(e.copies, U, f)


@source
def _carry_rates(e, method, h, w):
    """Add what the correction R makes of viscous stresses to those that are carried."""
    dv = w.x[0]
    for k in range(w.R.shape[0]):
        clear(dv)
        for j in range(w.R.shape[0]):
            add_multiple(method.first[k, j] / h, w.R[j], dv)
        add_viscous_stress(e.viscous, e.body, e.copies, k, w.origin, dv, w.stresses, w.carried)


@source
def _residual(e, matrices, method, s, w, state, step, k):
    """What is missing in the equation of motion at a point, and in the rates of joints.

    R has the internal force.
    """
    u, v, f, Q, d, room = w.U[k], w.V[k], w.R[k], w.x[0], w.x[1], w.x[2]
    at = step * (method.points.size + 1) + k
    t = s.times[at]
    add_elastic_force(e.forces, t, 0.0, u, u, f)
    if matrices.dampers.active > 0:
        damping_beside(e, matrices.dampers, matrices.M, t, u, v, state[MIXED], d, room)
        for i in lanes(f.size):
            f[i] += d[i]
    external_force(e.loads, _row(s.factors, at), t, 1.0, u, Q)
    multiply(matrices.M, w.W[k], room)
    for i in lanes(f.size):
        f[i] += room[i]
    if w.gaps.shape[1] > 0:
        gap, l, motion = w.gaps[k], w.l[k], _motion(s.joints, at)
        g = motion.g
        add_joint_force(e.joints, g[0], t, u, l, f)
        drive_rate(e.joints, motion, t, s.h * method.points[k], u, gap)
        add_constraint_rate(e.joints, g[0], t, u, v, gap)
    for i in lanes(f.size):
        f[i] = (Q[i] - f[i]) * e.free[i]


@source
def _correct(free, method, s, w, state):
    """Correct Z and the multipliers; R becomes the correction. False if joints are dependent.

    The velocities' place is room for it.
    """
    n, N, m, b, work, closing = (method.points.size, free.size, w.l.shape[1], w.J.shape[0], 0.0,
                                 0.0)
    D, dl, x, y, r, q = w.V, w.dl, w.x[0], w.x[1], w.r, w.q
    clear(_flat(D))
    clear(_flat(dl))
    for k in range(method.values.shape[1]):
        for i in lanes(N):
            x[i] = 0.0
            y[i] = 0.0
        for j in range(n):
            add_multiple(method.to[0, k, j], w.R[j], x)
            add_multiple(method.to[1, k, j], w.R[j], y)
        solve_for(w, k, x, y)
        if b > 0 and not _join(method, s, w, k, r, q, x, y):
            return False
        for j in range(n):
            c, d = method.back[0, j, k], method.back[1, j, k]
            add_multiple(c, x, D[j])
            add_multiple(-d, y, D[j])
            for l in range(m):
                dl[j, l] += c * r[l] - d * r[b + l]
    for j in range(n):
        Z, R, d, l, share = w.Z[j], w.R[j], D[j], w.l[j], dl[j]
        work += np.dot(d, R)
        for a in range(m):  # what closes them needs no residual
            closing += abs(np.dot(w.J[a], d) * share[a])
            l[a] += share[a]
        for i in lanes(N):
            Z[i] += d[i]
            R[i] = d[i]
    state[LAST_SIZE], state[SIZE] = state[SIZE], np.sqrt(abs(work) + closing)
    return True


@source
def _join(method, s, w, k, r, q, x, y):
    """Change x + i y, solved with the band for the eigenvalue k, by the rows J beside it.

    By forces r along them: with those of joints ``mu / h J x = -gap``, others are ``C J x``.
    """
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
    copy(_flat(w.Q[k]), _flat(q))
    if not solve_dependent(q, r):
        return False
    for a in range(b):
        re, im, f, g = w.Y[2 * k, a], w.Y[2 * k + 1, a], r[a], r[b + a]
        for i in lanes(x.size):
            x[i] -= f * re[i] - g * im[i]
            y[i] -= f * im[i] + g * re[i]
    return True


@source
def _stiffen(S, p, z, m, column):
    """The last rows of a column of ``q f = r`` times ``C = S[0] + (p + i z) S[1]``."""
    k, b = S.shape[1], column.size // 2
    room = np.empty(2 * k)
    for a in range(k):
        room[a], room[k + a] = column[m + a], column[b + m + a]
    for a in range(k):
        re, im = 0.0, 0.0
        for c in range(k):
            C, D = S[0, a, c] + p * S[1, a, c], z * S[1, a, c]
            re += C * room[c] - D * room[k + c]
            im += C * room[k + c] + D * room[c]
        column[m + a], column[b + m + a] = re, im


# its factors


@source
def _factorize(e, matrices, method, s, w, state, step):
    """Factors of the iteration matrices at the mean of the points; False if there are none."""
    origin, f, S, yes = w.origin, w.x[0], w.stresses, w.x.size > 0
    at = step * (method.points.size + 1)
    for i in lanes(origin.size):
        origin[i] = 0.0
    for k in range(method.points.size):
        add_multiple(method.weights[k], w.U[k], origin)
    if state[MIXED] > 0.0:
        body_mean_stress(e.body, e.copies, method.weights, w.carried, S[1])
        body_tangent_by(e.body, origin, S[1], w.B, e.K)
    else:
        body_stress(e.body, w.y[0], S[1])
        body_tangent(e.body, origin, f, S[1], yes, S[2], e.K)
    add_load_stiffness(e.loads, _row(s.factors, at), s.times[at], 1.0, origin, e.K)
    add_element_tangent(e.forces, s.times[at], origin, e.K)
    D = w.D.flat
    for i in lanes(D.size):
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
            for i in lanes(y.size):
                y[i] = 0.0
            solve_for(w, k, x, y)
        _between(w, s.h, k)
    return True


@source
def _between(w, h, k):
    """The matrix between the rows beside the band, with the factors for the eigenvalue k."""
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
    """The rows beside the band at the mean of the points, and what is between those of no joint."""
    m, forces, t = w.l.shape[1], e.forces, s.times[at]
    if m > 0:
        joint_directions(e.joints, _row(s.joints.g, at)[0], t, w.origin, w.J[:m])
    for a in range(matrices.rows.P.shape[0]):
        copy(matrices.rows.P[a], w.J[m + a])
    for a in range(w.J.shape[0]):
        J = w.J[a]
        for i in lanes(J.size):
            J[i] *= e.free[i]
    modes, D = matrices.dampers.modes.shape[0], np.empty(forces.size)
    if w.S.shape[1] > modes:
        element_stiffness(forces, t, w.origin, w.y[1], 0.0, D)
        put_between(forces, D, 1.0, modes, w.S[0])
        element_damping(forces, t, w.origin, w.y[1], D)
        put_between(forces, D, 1.0, modes, w.S[1])
    for a in range(modes):
        w.S[1, a, a] = 1.0


@source
def solve_for(w, k, x, y):
    """Solve in place with the factors for the eigenvalue k; y is not touched if that is real."""
    if w.method.values[1, k] != 0.0:
        solve_complex(w.pairs[k], w.real.width, x, y)
    else:
        solve(w.real, x)


@source
def _combine(K, M, D, fixed, c, m, d, out):
    """``c K + m M + d D`` with the supports fixed, the lower half of each column.

    Of a matrix that is not symmetric the mean of both halves: the iteration corrects the rest.
    """
    ld, top = K.width + 1 + SPARE, K.top
    n, x, y, z = out.size // ld, K.flat, M.flat, D.flat
    columns = shaped(out, (n, ld))
    if top > 0:
        k, l, r = shaped(x, (n, K.ld)), shaped(y, (n, K.ld)), shaped(z, (n, K.ld))
        for h in range(min(K.width + 1, n)):
            for j in lanes(n):
                columns[j, h] = c * k[j, top + h] + m * l[j, top + h] + d * r[j, top + h]
            later = k[h:]
            for j in lanes(n - h):
                columns[j, h] += 0.5 * c * (later[j, top - h] - k[j, top + h])
    else:
        for i in lanes(out.size):
            out[i] = c * x[i] + m * y[i] + d * z[i]
    fix_stored(out, ld, K.width, 0, fixed)
