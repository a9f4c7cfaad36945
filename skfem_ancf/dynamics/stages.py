"""Steps of collocation. With ``A^-1 = T diag(mu) T^-1`` the points decouple into systems ``K + mu D
/ h + mu^2 M / h^2``, one for each pair of eigenvalues: complex symmetric, with a positive real part
up to a factor, so that L D L^T factors need no pivoting. Materials and items with a history have
that of the start of the step at all points, and the time since then; it changes at the end of the
step."""

import numpy as np

from ..actions.contact.tables import RATE
from ..actions.forces.kernels import (add_elastic_force, add_element_tangent, element_damping,
                                      element_stiffness, put_far_stiffness)
from ..actions.tables import (MATERIALS, add_constraint_rate, add_joint_force, add_load_stiffness,
                              add_products, carry_eigenstrains, constraint, external_force,
                              joint_directions)
from ..beam.strain_energy import (add_force_of, add_viscous_stress, body_force, body_linearised,
                                  body_mean_stress, body_mixed, body_stress, body_tangent)
from ..core.band import (add_multiple, clear, copy, factorize, factorize_complex, fix, fix_stored,
                         multiply, solve, solve_columns, solve_dependent, solve_joined,
                         subtract_rows)
from ..core import indices, shaped, source
from ..equations.convergence import (DEPENDENT, DONE, FAILED, GO_ON, NOT_CONVERGED, RESTART,
                                     SINGULAR, correction_size, judged, motion_size,
                                     noise_of_step)
from .records import (ITERATIONS, acceleration_of_joints, add_damping, damping_force, drive_rate,
                      kinetic_energy, motion_at, row_of, settle)

#: Largest contraction with which factors are reused, also in the mixed iteration; number of mixed
#: steps.
REUSED, MIXED, LASTING = 0.3, 0.5, 32


@source
def flat_points(x):
    """All points in one row, a view."""
    return shaped(x, (x.size,))


@source
def factorize_stages(e, matrices, method, s, w, state, step):
    """Factorise the iteration matrices at the mean of the points; False on failure."""
    origin, f, S, yes = w.origins[0], w.x[0], w.stresses, w.x.size > 0
    at, e.span[0] = step * (method.points.size + 1), s.h
    np.dot(method.weights, w.U, origin)
    w.origins[1:] = origin
    if state.mixed_steps[0] > 0:
        body_mean_stress(e.body, e.copies, method.weights, w.independent, S[1])
    else:
        body_stress(e.body, w.y[0], S[1])
    body_tangent(e.body, origin, f, S[1], yes, S[2], e.K)
    add_load_stiffness(e.loads, row_of(s.factors, at), s.times[at], 1.0, origin, e.K)
    add_element_tangent(e.forces, s.times[at], origin, e.K)
    clear(w.D.flat)
    if matrices.dampers.active > 0:
        add_damping(e.viscous, matrices.dampers, matrices.M, 1.0, origin, S, f, w.D)
        if matrices.dampers.elements > 0 and e.forces.start.size > 0:
            rates = np.empty(e.forces.size)
            element_damping(e.forces, s.times[at], origin, w.y[1], rates)
            add_products(w.D.flat, e.forces.band_at, e.forces.band_weight, rates, e.forces.band_of)
    if w.J.shape[0] > 0:
        _rows(e, matrices, s, w, at)
    ld, width, shape = w.real.ld, w.real.width, (origin.size, w.real.ld)
    for k in range(method.values.shape[1]):
        a, b = method.values[0, k] / s.h, method.values[1, k] / s.h
        if b != 0.0:
            F = w.pairs[k]
            columns = shaped(F, shape)
            _combine(e.K, matrices.M, w.D, 1.0, a * a - b * b, a, columns.real)
            _combine(e.K, matrices.M, w.D, 0.0, 2.0 * a * b, b, columns.imag)
            fix_stored(F, ld, width, 0, e.fixed)
            done = factorize_complex(F, ld, width)
        else:
            _combine(e.K, matrices.M, w.D, 1.0, a * a, a, shaped(w.real.flat, shape))
            fix(w.real, e.fixed)
            done = factorize(w.real)
        if not done:
            return False
        for j in range(w.J.shape[0]):
            x, y = w.Y[2 * k, j], w.Y[2 * k + 1, j]
            copy(w.J[j], x)
            clear(y)
            solve_for(w, k, x, y)
        if w.J.shape[0] > 0:
            _form_schur_complement(w, s.h, k)
    return True


@source
def _form_schur_complement(w, h, k):
    """Schur complement of the low-rank rows for the eigenvalue k."""
    q, b, m, values = w.q, w.J.shape[0], w.l.shape[1], w.method.values
    re, im = np.dot(w.Y[2 * k], w.J.T), np.dot(w.Y[2 * k + 1], w.J.T)
    q[:b, :b], q[b:, b:], q[b:, :b], q[:b, b:] = re, re, -im, im  # its columns
    for j in range(2 * b if b > m else 0):
        _stiffen(w.S, values[0, k] / h, values[1, k] / h, m, q[j])
    for a in range(m, b):
        q[a, a] += 1.0
        q[b + a, b + a] += 1.0
    w.Q[k] = q.T


@source
def _rows(e, matrices, s, w, at):
    """Set the low-rank rows at the mean of the points, and the coupling of those of no joint."""
    m, forces, t = w.l.shape[1], e.forces, s.times[at]
    if m > 0:
        joint_directions(e.joints, row_of(s.g, at)[0], t, w.origins[0], w.J[:m])
    for a in range(matrices.rows.P.shape[0]):
        copy(matrices.rows.P[a], w.J[m + a])
    for a in range(w.J.shape[0]):
        J = w.J[a]
        for i in indices(J.size):
            J[i] *= e.free[i]
    modes, D = matrices.dampers.modes.shape[0], np.empty(forces.size)
    if w.S.shape[1] > modes:
        element_stiffness(forces, t, w.origins[0], w.y[1], 0.0, D)
        put_far_stiffness(forces, D, 1.0, modes, w.S[0])
        element_damping(forces, t, w.origins[0], w.y[1], D)
        put_far_stiffness(forces, D, 1.0, modes, w.S[1])
    for a in range(modes):
        w.S[1, a, a] = 1.0


@source
def _stiffen(S, p, z, m, column):
    """The last rows of a column of ``q f = r`` times ``C = S[0] + (p + i z) S[1]``."""
    b = column.size // 2
    C, D, x, y = S[0] + p * S[1], z * S[1], column[m:b].copy(), column[b + m:].copy()
    column[m:b], column[b + m:] = np.dot(C, x) - np.dot(D, y), np.dot(C, y) + np.dot(D, x)


@source
def solve_for(w, k, x, y):
    """Solve in place with the factors of eigenvalue k; y is unchanged if that is real."""
    if w.method.values[1, k] == 0.0:
        solve(w.real, x)
        return
    z = np.empty(x.size, np.complex128)
    copy(x, z.real)
    copy(y, z.imag)
    solve_columns(w.pairs[k], w.real.ld, w.real.width, z)
    copy(z.real, x)
    copy(z.imag, y)


@source
def join(method, s, w, k, r, q, x, y):
    """Correct x + i y, solved with the band, by forces r along the low-rank rows J. For joints ``mu
    / h J x = -gap``; the force of other rows is ``C J x``."""
    m, b = w.l.shape[1], w.J.shape[0]
    p, z = method.values[0, k], method.values[1, k]
    c, d = s.h * p / (p * p + z * z), -s.h * z / (p * p + z * z)  # h / mu
    r[:b], r[b:] = np.dot(w.J, x), np.dot(w.J, y)
    for j in range(method.points.size if m > 0 else 0):
        re, im = method.to[0, k, j], method.to[1, k, j]
        add_multiple(c * re - d * im, w.gaps[j], r[:m])
        add_multiple(c * im + d * re, w.gaps[j], r[b:b + m])
    if b > m:
        _stiffen(w.S, p / s.h, z / s.h, m, r)
    copy(flat_points(w.Q[k]), flat_points(q))
    if not solve_dependent(q, r):
        return False
    subtract_rows(w.Y[2 * k], r[:b], x)
    subtract_rows(w.Y[2 * k + 1], -r[b:], x)
    subtract_rows(w.Y[2 * k + 1], r[:b], y)
    subtract_rows(w.Y[2 * k], r[b:], y)
    return True


@source
def _combine(K, M, D, c, m, d, columns):
    """``c K + m M + d D``, the lower half of each column."""
    # Of an unsymmetric K, its symmetric part; the iteration corrects the rest.
    top, n = K.top, columns.shape[0]
    whole = shaped(K.flat, (n, K.ld))
    x, y, z = whole[:, top:], shaped(M.flat, (n, K.ld))[:, top:], shaped(D.flat, (n, K.ld))[:, top:]
    for j in indices(n):
        for h in indices(x.shape[1]):
            columns[j, h] = c * x[j, h] + m * y[j, h] + d * z[j, h]
    for h in range(min(K.width + 1, n) if top > 0 else 0):
        later = whole[h:]
        for j in indices(n - h):
            columns[j, h] += 0.5 * c * (later[j, top - h] - x[j, h])


# steps

@source
def collocate(e, matrices, rule, s, state, w, memories, rows, multiplier_rows, points):
    """Take steps from ``w.y`` and ``w.first``; returns how many succeeded."""
    # Written for each step as by :func:`~skfem_ancf.dynamics.steps.steps`, w is the acceleration;
    # and displacements and multipliers of the points, (s, n, N + m).
    method = w.method
    if e.lasting > 0:
        e.forces.contacts.memory[RATE] = 1.0 / (s.h * s.h)
    for k in range(rows.shape[0]):
        if k > 0 or s.begun > 0:
            _ahead(method, method.ahead if k > 0 else s.ahead, s.h, state.last_dt[0], w)
        if not _converges(e, matrices, method, rule, s, w, state, k):
            return k
        copy(w.y[0], w.before[0])
        copy(w.y[1], w.before[1])
        if not _end(e, matrices, method, s, w, state, k):
            state.failure[0] = DEPENDENT
            return k
        if e.lasting > 0:
            t = s.times[(k + 1) * (method.points.size + 1) - 1]
            e.span[0] = s.h
            if e.lasting >= MATERIALS:
                carry_eigenstrains(e.loads, row_of(
                    s.factors, (k + 1) * (method.points.size + 1) - 1))
            settle(e, (t, t), 0.0, w.before[0], w.y[0], w.y[1], state, memories[k, 2:])
        state.last_dt[0], state.mixed_steps[0] = s.h, max(0, state.mixed_steps[0] - 1)
        rows[k, :3], rows[k, 3], multiplier_rows[k], w.first[:] = w.y, w.y[2], w.shares, w.l
        points[k, :, :e.free.size], points[k, :, e.free.size:] = w.U, w.l
        memories[k, 1] = 1.0  # what points lead through
        memories[k, 0] = state.dissipated[0]  # last: the step is complete
    return rows.shape[0]


@source
def _converges(e, matrices, method, rule, s, w, state, step):
    """Iterate to the points of a step, which sets U, V and W; False on failure."""
    n, scratch, status, u0 = method.points.size, w.x[0], GO_ON, w.y[0]
    rates = w.gaps.size > 0 or matrices.dampers.active > 0
    largest = np.max(method.values[0]**2 + method.values[1]**2) / (s.h * s.h)
    reference = motion_size(state.energy[0])
    noise = noise_of_step(rule, 1.0, largest, abs(2.0 * kinetic_energy(matrices.M, u0, scratch)))
    state.fresh[0], state.correction[0] = 0, -1.0
    if state.mixed_steps[0] > 0:
        state.factors[0] = 0  # the beam has rotated since
    _start(e, method, s, w, state, step)
    for _ in range(ITERATIONS):
        _states(e.free, method, s, w, step, rates)
        if state.factors[0] == 0:
            if not factorize_stages(e, matrices, method, s, w, state, step):
                state.failure[0] = SINGULAR
                return False
            state.factorizations[0] += method.values.shape[1]
            state.factors[0], state.fresh[0] = 1, 1
            state.contraction[0], state.correction[0] = REUSED, -1.0
        _internal(e, matrices, method, s, w, state, step)
        for k in range(n):
            _residual(e, matrices, method, s, w, state, step, k)
        state.iterations[0] += n
        if not _correct(e, method, s, w, state):
            state.failure[0] = DEPENDENT
            return False
        status = judged(state, rule.tol, reference, noise, REUSED, MIXED, False)
        # the first correction has more energy than the motion
        lost = (state.mixed_steps[0] == 0 and state.last_correction[0] < 0.0
                and state.correction[0] > reference)
        if status == GO_ON and state.fresh[0] > 0 and e.lasting < MATERIALS and lost:
            state.mixed_steps[0], status = LASTING, RESTART  # with the same factors
        if status == RESTART:
            _start(e, method, s, w, state, step)
        elif status != GO_ON:
            break
        elif state.mixed_steps[0] > 0:
            body_linearised(e.copies, flat_points(w.origins), flat_points(w.R), w.constitutive,
                            w.independent)
            if matrices.dampers.viscous > 0:  # and by the rates of the correction R
                for k in range(n):
                    np.dot(method.first[k] / s.h, w.R, scratch)
                    add_viscous_stress(e.viscous, e.body, e.copies, k, w.origins[0], scratch,
                                       w.stresses, w.independent)
    _states(e.free, method, s, w, step, True)
    if status != DONE and status != FAILED:
        state.failure[0] = NOT_CONVERGED
    return status == DONE


@source
def _ahead(method, ahead, h, before, w):
    """Initial guess: the polynomial of the last step at this one's points."""
    n, u0, v0, u, v = method.points.size, w.y[0], w.y[1], w.before[0], w.before[1]
    for k in range(n):
        guess, c = w.guess[k], h * method.points[k]
        for i in indices(u.size):
            guess[i] = u[i] + (before + c) * v[i] - u0[i] - c * v0[i]
        for j in range(n):
            p = ahead[k, j]
            add_multiple(p, w.U[j], guess)
            add_multiple(-p, u, guess)
            add_multiple(-p * before * method.points[j], v, guess)


@source
def _end(e, matrices, method, s, w, state, step):
    """Set the end of the step in ``w.y``, and the work of damping; False for dependent joints."""
    n, dampers, first = method.points.size, matrices.dampers, step * (method.points.size + 1)
    t = s.times[first + n]
    u, v, a, f, scratch = w.y[0], w.y[1], w.y[2], w.x[0], w.x[2]
    ends = method.points[n - 1] == 1.0
    for k in range(n):
        c, U, V, W = s.h * method.weights[k], w.U[k], w.V[k], w.W[k]
        e.span[0] = s.h * method.points[k]
        if dampers.active > 0:
            damping_force(e, dampers, matrices.M, s.times[first + k], U, V, 0.0, f, scratch)
            state.dissipated[0] += c * np.dot(f, V)
        if not ends:
            add_multiple(c, V, u)
            add_multiple(c, W, v)
    if ends:
        copy(w.U[n - 1], u)
        copy(w.V[n - 1], v)
        copy(w.W[n - 1], a)
    constrained, motion = row_of(s.constrained, first + n), motion_at(s, first + n)
    joined = w.shares.size > 0
    for i in indices(u.size):
        u[i] = u[i] * e.free[i] + constrained[0, i]
        v[i] = v[i] * e.free[i] + constrained[1, i]
    if joined and not _close(e, matrices, s, w, motion, t, step):
        return False
    if not ends:
        _balance(e, matrices, s, w, first + n)
    if joined:
        acceleration_of_joints(e.joints, motion, t, s.h, u, v, w.shares)
        if not _meet(matrices.mass, e.free, w, a, not joined):  # J of the velocity
            return False
        if ends:
            add_multiple(1.0, w.l[n - 1], w.shares)
    state.energy[0] = max(state.energy[0], kinetic_energy(matrices.M, v, scratch))
    return True


@source
def _balance(e, matrices, s, w, at):
    """The acceleration at the end of the step by its forces, without joints."""
    # If the last point is the end, the points give it without amplifying errors by the stiffness.
    u, v, a, f, Q, scratch = w.y[0], w.y[1], w.y[2], w.x[0], w.x[1], w.x[2]
    constrained, t = row_of(s.constrained, at), s.times[at]
    e.span[0] = s.h
    if e.lasting >= MATERIALS:
        carry_eigenstrains(e.loads, row_of(s.factors, at))
    copy(constrained[2], a)
    multiply(matrices.M, a, scratch)
    body_force(e.body, u, f)
    add_elastic_force(e.forces, t, 0.0, u, u, 0, f)
    external_force(e.loads, row_of(s.factors, at), t, 1.0, u, Q)
    for i in indices(a.size):
        a[i] += (Q[i] - f[i] - scratch[i]) * e.free[i]
    if matrices.dampers.active > 0:
        damping_force(e, matrices.dampers, matrices.M, t, u, v, 0.0, f, scratch)
        for i in indices(a.size):
            a[i] -= f[i] * e.free[i]
    solve(matrices.mass, a)


@source
def _close(e, matrices, s, w, motion, t, step):
    """Project u onto the joints in the mass norm, and v onto their rates."""
    u, v, g, x = w.y[0], w.y[1], motion.g[0], w.x[3]
    bends = e.joints.hk.size > 0 or e.joints.custom > 0  # J depends on u or t
    turns = step == 0 or s.g.shape[0] > 1
    for k in range(2):  # Newton corrections
        joint_directions(e.joints, g, t, u, w.end[0])
        constraint(e.joints, motion.c[0], g, t, u, w.shares)
        clear(x)
        if not _meet(matrices.mass, e.free, w, x, bends or (turns and k == 0)):
            return False
        add_multiple(1.0, x, u)
    joint_directions(e.joints, g, t, u, w.end[0])
    drive_rate(e.joints, motion, t, s.h, u, w.shares)
    return _meet(matrices.mass, e.free, w, v, bends)


@source
def _meet(mass, free, w, x, anew):
    """Project x onto J x = -``w.shares``, which become multipliers; J M^-1 is new if ``anew``."""
    J = w.end[0]
    return solve_joined(mass, J, J, free, anew, w.end[1], w.shared, w.shares, x) > 0


@source
def _start(e, method, s, w, state, step):
    """Set the initial guess; in the mixed iteration from the mean acceleration of the last step."""
    # A polynomial through the vibrations of a stiff beam extrapolates badly.
    w.Z[:], w.l[:] = w.guess, w.first
    if state.mixed_steps[0] > 0:
        w.R[:] = w.y[0]
        body_stress(e.copies, flat_points(w.R), w.independent)
        if step > 0 or s.begun > 0:
            v0, v = w.y[1], w.before[1]
            for k in range(w.Z.shape[0]):
                Z, c = w.Z[k], 0.5 * (s.h * method.points[k])**2 / state.last_dt[0]
                for i in indices(v.size):
                    Z[i] = c * (v0[i] - v[i])


@source
def _states(free, method, s, w, step, rates):
    """Set displacements, accelerations and, if ``rates``, velocities of the points."""
    u0, v0 = w.y[0], w.y[1]
    np.dot(method.second, w.Z, w.W)
    if rates:
        np.dot(method.first, w.Z, w.V)
    for k in range(method.points.size):
        U, V, W, Z, c = w.U[k], w.V[k], w.W[k], w.Z[k], s.h * method.points[k]
        constrained = row_of(s.constrained, step * (method.points.size + 1) + k)
        for i in indices(free.size):
            U[i] = (u0[i] + c * v0[i] + Z[i]) * free[i] + constrained[0, i]
            W[i] = W[i] / (s.h * s.h) * free[i] + constrained[2, i]
        if rates:
            for i in indices(free.size):
                V[i] = (v0[i] + V[i] / s.h) * free[i] + constrained[1, i]


@source
def _internal(e, matrices, method, s, w, state, step):
    """Internal forces of all points, into R; independent stresses include viscous ones."""
    U, f, missing, constitutive = flat_points(w.U), flat_points(w.R), w.missing, w.constitutive
    independent = w.independent
    if state.mixed_steps[0] > 0:
        body_mixed(e.copies, False, U, U, f, independent, constitutive)
        if matrices.dampers.viscous > 0:
            for k in range(w.U.shape[0]):
                add_viscous_stress(e.viscous, e.body, e.copies, k, w.U[k], w.V[k], w.stresses,
                                   constitutive)
        for i in indices(missing.size):
            missing[i] = constitutive[i] - independent[i]
        add_force_of(e.copies, flat_points(w.origins), missing, f)
    elif e.lasting >= MATERIALS:
        for k in range(w.U.shape[0]):
            e.span[0] = s.h * method.points[k]
            carry_eigenstrains(e.loads, row_of(s.factors, step * (w.U.shape[0] + 1) + k))
            body_force(e.body, w.U[k], w.R[k])
    else:
        body_force(e.copies, U, f)


@source
def _residual(e, matrices, method, s, w, state, step, k):
    """Set R, which has the internal force, to the residual at point k, and the joints' rates."""
    u, v, f, Q, d, scratch = w.U[k], w.V[k], w.R[k], w.x[0], w.x[1], w.x[2]
    at = step * (method.points.size + 1) + k
    t, e.span[0] = s.times[at], s.h * method.points[k]
    add_elastic_force(e.forces, t, 0.0, u, u, 0, f)
    if matrices.dampers.active > 0:
        damping_force(e, matrices.dampers, matrices.M, t, u, v, state.mixed_steps[0], d, scratch)
        add_multiple(1.0, d, f)
    external_force(e.loads, row_of(s.factors, at), t, 1.0, u, Q)
    multiply(matrices.M, w.W[k], scratch)
    add_multiple(1.0, scratch, f)
    if w.gaps.shape[1] > 0:
        gap, l, motion = w.gaps[k], w.l[k], motion_at(s, at)
        g = motion.g
        add_joint_force(e.joints, g[0], t, u, l, f)
        drive_rate(e.joints, motion, t, s.h * method.points[k], u, gap)
        add_constraint_rate(e.joints, g[0], t, u, v, gap)
    for i in indices(f.size):
        f[i] = (Q[i] - f[i]) * e.free[i]


@source
def _correct(e, method, s, w, state):
    """Correct Z and the multipliers; R becomes the correction. False for dependent joints."""
    # V is used as work array.
    n, m, b = method.points.size, w.l.shape[1], w.J.shape[0]
    D, dl, x, y, r, q = w.V, w.dl, w.x[0], w.x[1], w.r, w.q
    clear(flat_points(D))
    clear(flat_points(dl))
    for k in range(method.values.shape[1]):
        np.dot(method.to[0, k], w.R, x)
        np.dot(method.to[1, k], w.R, y)
        solve_for(w, k, x, y)
        if b > 0 and not join(method, s, w, k, r, q, x, y):
            return False
        for j in range(n):
            c, d = method.back[0, j, k], method.back[1, j, k]
            add_multiple(c, x, D[j])
            add_multiple(-d, y, D[j])
            add_multiple(c, r[:m], dl[j])
            add_multiple(-d, r[b:b + m], dl[j])
    if m > 0:
        np.dot(D, w.J[:m].T, w.gaps)  # that the correction closes
        add_multiple(1.0, flat_points(dl), flat_points(w.l))
    state.last_correction[0] = state.correction[0]
    state.correction[0] = correction_size(e, flat_points(w.R), flat_points(D),
                                          flat_points(w.gaps), flat_points(dl))
    add_multiple(1.0, flat_points(D), flat_points(w.Z))
    copy(flat_points(D), flat_points(w.R))
    return True
