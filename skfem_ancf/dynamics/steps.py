"""Time steps of all schemes but collocation.

A step of size h from 0 to 1 follows eq. (7)-(9) of Arnold and Bruls (2007)::

    M a_1 + f(u_1) + d(u_1, v_1) + J^T lambda = Q,   Phi(u_1) = 0
    u_1 = u_0 + h v_0 + h^2 ((1/2 - beta) w_0 + beta w_1)
    v_1 = v_0 + h ((1 - gamma) w_0 + gamma w_1)
    (1 - alpha_m) w_1 + alpha_m w_0 = (1 - alpha_f) a_1 + alpha_f a_0

The energy-momentum scheme is the case ``beta = 1/2``, ``gamma = 1``, no alpha: ``w_1`` is the
acceleration in the middle of the step, f and Q are means over the step, the damping force is
``d((u_0 + u_1) / 2, (u_1 - u_0) / h)``, whose work is not negative, and J is that of the middle, or
a discrete gradient with ``J (u_1 - u_0) = Phi(u_1) - Phi(u_0)``.
"""

import numpy as np

from ..actions.contact.tables import AUGMENT, DAMPED_TANGENT, PRESSURES, RATE, TANGENT, Request
from ..actions.forces.kernels import (add_elastic_force, ask_obstacles, at_rest, at_time,
                                      element_stiffness, keep_entries, nothing_touches,
                                      put_far_stiffness)
from ..actions.tables import (MATERIALS, add_constraint_rate, add_curvature_force, add_joint_force,
                              add_load_stiffness, add_products, carry_eigenstrains, constraint,
                              joint_directions, mean_external_force)
from ..beam.strain_energy import (add_force_of, add_unsymmetric, body_force, body_linearised,
                                  body_mean, body_mixed, body_stress, body_tangent, quadratic)
from ..core.band import (add_multiple, add_scaled, clear, copy, dot, factorize, fix, multiply,
                         solve_joined, subtract_rows)
from ..core.callbacks import JOINTS, call_custom, call_solver
from ..core import F1, apart, indices, room, shaped, source
from ..equations.convergence import (DEPENDENT, DONE, EXPECTED, FAILED, GO_ON, LASTING, MIXED,
                                     NOT_CONVERGED, RESTART, REUSED, ROUGH, SINGULAR, SLOW,
                                     SYMMETRIC, UNSETTLED, UNSYMMETRIC, correction_size,
                                     judged, motion_size, noise_of_step)
from .records import (ALL, AUGMENTED, ITERATIONS, acceleration_of_joints, add_damping,
                      damping_force, drive_rate, factorize_rows, kinetic_energy, settle, solve_rows,
                      step_of)


#: Relative correction beyond which factors of the predicted end of a step are poor.
FAR = 0.03
#: Accuracy of the impulses of eliminated joints.
ROUGHLY, EXACTLY = range(2)


# the residual of a step, ``Q - f - M a - J^T lambda``, at an iterate

@source
def to_middle(rule, w):
    """Set the displacement at which tangent and joint Jacobian are taken."""
    u, u0, middle = w.x.u, w.y[0], w.x.middle
    a = 0.5 if rule.conserving > 0 else 0.0
    for i in indices(u.size):
        middle[i] = u[i] + a * (u0[i] - u[i])


@source
def free_velocity(free, rule, s, w):
    """v_1 of the iterate without joint impulses."""
    u, v, base, speed = w.x.u, w.x.v, w.x.base, w.x.speed
    c = rule.gamma / (rule.beta * s.dt)
    for i in indices(u.size):
        v[i] = (speed[i] + c * (u[i] - base[i])) * free[i] + s.supports[1, i]


@source
def to_damping_velocity(free, rule, s, w):
    """Set the velocity of the damping force."""
    u, u0, v, damping_velocity = w.x.u, w.y[0], w.x.v, w.x.damping_velocity
    free_velocity(free, rule, s, w)
    for i in indices(u.size):
        damping_velocity[i] = (u[i] - u0[i]) / s.dt if rule.conserving > 0 else v[i]


@apart("motion", *ALL)
def internal_force(e, matrices, rule, s, w, state):
    """The internal force of the iterate, with damping."""
    # In the mixed iteration with independent stresses S, the residual of ``S = D eps(u)`` acts in
    # the directions of the factors: ``f = B(u)^T S + B(origin)^T (D eps(u) - S)``, and likewise for
    # viscous stresses.
    conserving, u, f, S = rule.conserving > 0, w.x.u, w.x.force, w.stresses
    u0 = w.y[0] if conserving else u
    missing, independent, constitutive, slow, rates = S[2], S[3], S[4], S[5], S[6]
    if state.mixed_steps[0] > 0:
        body_mixed(e.body, conserving, u0, u, f, independent, constitutive)
        for i in indices(missing.size):
            missing[i] = constitutive[i] - independent[i]
        if matrices.dampers.viscous > 0:
            body_linearised(e.viscous, w.x.middle, w.x.damping_velocity, S[0], rates)
            add_force_of(e.body, w.x.middle, slow, f)
            add_multiple(1.0, rates, missing)
            add_multiple(-1.0, slow, missing)
        add_force_of(e.body, w.x.origin, missing, f)
    elif conserving:
        body_mean(e.body, u0, u, f)
    else:
        body_force(e.body, u, f)
    add_elastic_force(e.forces, s.t_force, s.dt if conserving else 0.0, u0, u, state.guess[0], f)
    if matrices.dampers.active > 0:  # materials are included already in the mixed iteration
        d = w.x.damping
        damping_force(e, matrices.dampers, matrices.M, s.t_force, w.x.middle, w.x.damping_velocity,
                      state.mixed_steps[0], d, w.x.scratch)
        add_multiple(1.0, d, f)


@apart("joints", *ALL)
def directions(e, matrices, rule, s, w, state):
    """Set the joint Jacobian where joints act, and at the end of the step."""
    to_middle(rule, w)
    if rule.solver > 0:
        return
    if e.joints.custom > 0 and rule.conserving > 0:
        flat = w.J[0].reshape(w.J[0].size)
        clear(flat)
        call_custom(JOINTS, e.joints.custom, np.int64(5), s.t_force, 1.0, w.x.u, w.y[0], flat)
    else:
        joint_directions(e.joints, s.g, s.t_force, w.x.middle, w.J[0])
    joint_directions(e.joints, s.joints.g[0], s.t, w.x.u, w.J[1])


@apart("motion", *ALL)
def residual(e, matrices, rule, s, w, state):
    """R = Q - f - M a - J^T lambda."""
    u, base, rest, constrained = w.x.u, w.x.base, w.x.rest, w.x.constrained
    a, R, f, scratch = w.x.acceleration, w.x.residual, w.x.force, w.x.scratch
    for i in indices(u.size):
        a[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * e.free[i] + constrained[i]
    multiply(matrices.M, a, scratch)
    mean_external_force(e.loads, s.factors, s.t_force, w.y[0] if rule.conserving > 0 else u, u, R)
    for i in indices(u.size):
        R[i] = R[i] - f[i] - scratch[i]
    if rule.solver > 0:
        clear(scratch)
        add_joint_force(e.joints, s.g, s.t_force, w.x.middle, w.m.l, scratch)
        add_multiple(-1.0, scratch, R)
    else:
        subtract_rows(w.J[0], w.m.l, R)


@apart("joints", *ALL)
def add_impulses(e, matrices, rule, s, w, state):
    """R -= (impulse . Phi'') (v_0 + v_1) / 4: eq. of Gear, Leimkuhler and Gupta (1985)."""
    v0, v, scratch, share, impulse = w.y[1], w.x.v, w.x.scratch, w.m.phi, w.m.impulse
    if e.joints.custom > 0:
        ends = np.concatenate((v0, v, w.y[0], impulse))
        call_custom(JOINTS, e.joints.custom, np.int64(6), s.t_force, 1.0, w.x.u, ends, w.x.residual)
        return
    for i in indices(v.size):
        scratch[i] = v0[i] + v[i]
    for k in indices(share.size):
        share[k] = -0.25 * impulse[k]
    add_curvature_force(e.joints, share, scratch, w.x.residual)


@apart("motion", *ALL)
def tangent(e, matrices, rule, s, w, state):
    """Assemble the iteration matrix, with the stresses at the start, or mean independent stresses.
    Stresses of an iterate may be far off: a straight prediction of a rotation stretches the beam.
    So may be independent stresses at the end of a step that does not resolve axial vibrations."""
    M, A, dampers, yes = matrices.M.flat, matrices.A.flat, matrices.dampers, w.x.u.size > 0
    stresses = w.stresses
    if state.mixed_steps[0] > 0 and rule.conserving > 0:
        copy(stresses[3], stresses[1])
        add_multiple(1.0, stresses[5], stresses[1])
    else:
        body_stress(e.body, w.y[0], stresses[1])
        if dampers.viscous > 0:
            body_linearised(e.viscous, w.y[0], w.y[1], stresses[1], stresses[1])
    to_middle(rule, w)
    copy(w.x.middle, w.x.origin)
    copy(w.x.middle, w.x.ahead)
    body_tangent(e.body, w.x.middle, w.x.force, stresses[1], yes, stresses[2], matrices.A)
    if dampers.active > 0:
        add_damping(e.viscous, dampers, matrices.M, s.damping_factor / s.stiffness_factor,
                    w.x.middle, stresses, w.x.scratch, matrices.A)
        for k in range(dampers.modes.shape[0]):
            matrices.rows.S[k, k] = s.damping_factor
    add_load_stiffness(e.loads, s.factors, s.t_force, 1.0, w.x.middle, matrices.A)
    forces, conserving, rate = e.forces, rule.conserving > 0, s.damping_factor / s.stiffness_factor
    if forces.start.size > 0:  # to the band and the low-rank rows
        D = np.empty(forces.size)
        element_stiffness(forces, s.t_force, w.x.middle, w.y[1], rate, D)
        add_products(A, forces.band_at, forces.band_weight, D, forces.band_of)
        put_far_stiffness(forces, D, s.stiffness_factor, dampers.modes.shape[0], matrices.rows.S)
    u, u0 = w.x.u, w.y[0] if conserving else w.x.u
    keep_entries(forces, s.t_force, s.stiffness_factor, u0, u, state.guess[0])
    if forces.contacts.number > 0:
        span, ld, top = s.dt if conserving else 0.0, matrices.A.ld, matrices.A.top
        ask_obstacles(forces, Request(TANGENT, s.t_force, span, 0.0, ld, top), u0, u, A)
        if dampers.elements > 0:
            to_damping_velocity(e.free, rule, s, w)
            ask_obstacles(forces, Request(DAMPED_TANGENT, s.t_force, 0.0, rate, ld, top),
                          w.x.middle, w.x.damping_velocity, A)
    for i in indices(A.size):
        A[i] = s.mass_factor * M[i] + s.stiffness_factor * A[i]


@source
def factors(matrices, state):
    """The factorised matrix."""
    return matrices.U if state.factors[0] == UNSYMMETRIC else matrices.A


@apart("motion", *ALL, returns=int)
def factorize_tangent(e, matrices, rule, s, w, state):
    """Factorise the iteration matrix; 0 on failure."""
    fix(matrices.A, e.fixed)
    state.factorizations[0] += 1
    state.factors[0] = SYMMETRIC
    if rule.solver > 0:  # without right-hand side: factorise
        l, dl, none = w.m.l, w.m.dl, w.x.du[:0]
        for k in indices(l.size):
            dl[k] = s.stiffness_factor * l[k]
        good = call_solver(rule.solver, s.t_force, w.x.middle, dl, none, none, none, none)
    else:
        U = matrices.U
        if state.mixed_steps[0] > LASTING and U.flat.size > 0:
            # A mean force ``B(u_m)^T S`` has the derivative ``B(u_m)^T D B(u_1)``. A has B(u_m)
            # instead of B(u_1). They differ if more strains are sampled than the stretch of a
            # straight axis can satisfy, as in cables of degree 5 and above: then the iteration with
            # A converges slowly or not at all.
            copy(w.x.u, w.x.ahead)
            clear(U.flat)
            add_unsymmetric(e.body, w.x.middle, w.x.ahead, U)
            add_scaled(matrices.A, s.stiffness_factor, U)
            fix(U, e.fixed)
            state.factors[0] = UNSYMMETRIC
        good = factorize(factors(matrices, state))
    if not good:
        state.factors[0], state.failure[0] = 0, SINGULAR
        return 0
    if rule.solver == 0 and matrices.rows.P.shape[0] > 0:
        factorize_rows(factors(matrices, state), matrices.rows, e.free)
    state.contraction[0], state.fresh[0], state.correction[0] = EXPECTED, state.fresh[0] + 1, -1.0
    return 1


# velocities, accelerations and multipliers at the end of a step

@apart("joints", *ALL, int, returns=int)
def end_velocity(e, matrices, rule, s, w, state, exact):
    """v_1 = v - M^-1 J^T impulse of the iterate, with d Phi / dt = 0; FAILED for dependent joints.
    Unless ``exact``, the accuracy is that of the iteration."""
    free_velocity(e.free, rule, s, w)
    drive_rate(e.joints, s.joints, s.t, s.dt, w.x.u, w.m.impulse)
    if rule.mass_solver > 0:
        return _eliminated(e.joints, rule, s, w, w.x.middle, w.m.impulse, w.x.v, state, exact)
    if solve_joined(matrices.mass, w.J[0], w.J[1], e.free, not s.kept, w.J[3], w.S, w.m.impulse,
                    w.x.v) == 0:
        state.failure[0] = DEPENDENT
        return FAILED
    return GO_ON


@source
def _eliminated(joints, rule, s, w, at, b, x, state, exact):
    """Change x by ``-M^-1 J^T b`` so that ``J1 x`` becomes the initial -b, for eliminated joints. J
    is taken at the displacement ``at``, J1 at the end of the step. The change is also in
    ``w.x.damping_velocity``. FAILED for dependent joints."""
    change, rate = w.x.damping_velocity, w.m.phi
    add_constraint_rate(joints, s.joints.g[0], s.t, w.x.u, x, b)
    for k in indices(b.size):
        rate[k] = -b[k]
    copy(at, change)
    known = w.m.l if exact > 0 else w.m.l[:0]  # empty: rough solution
    if not call_solver(rule.mass_solver, s.t, w.x.u, known, x, rate, change, b):
        state.failure[0] = DEPENDENT
        return FAILED
    add_multiple(1.0, change, x)
    return GO_ON


@apart("joints", *ALL, returns=int)
def close_acceleration(e, matrices, rule, s, w, state):
    """Project accelerations and multipliers onto the second rate of the joints."""
    a1, w1, l, dl, shared = w.x.acceleration, w.x.du, w.m.l, w.m.dl, w.m.phi
    l0, last, anew = w.m.l0, w.m.last, rule.conserving > 0  # otherwise J is that of the velocity
    acceleration_of_joints(e.joints, s.joints, s.t, s.dt, w.x.u, w.x.v, dl)
    share = (1.0 - rule.alpha_f) / (1.0 - rule.alpha_m)
    if rule.mass_solver > 0:
        if _eliminated(e.joints, rule, s, w, w.x.u, dl, a1, state, EXACTLY) == FAILED:
            return FAILED
        add_multiple(share, w.x.damping_velocity, w1)
    else:
        if solve_joined(matrices.mass, w.J[1], w.J[1], e.free, anew, w.J[3], w.S, dl, a1) == 0:
            state.failure[0] = DEPENDENT
            return FAILED
        for k in indices(l.size):
            shared[k] = share * dl[k]
        subtract_rows(w.J[3], shared, w1)
    for k in indices(l.size):
        l0[k] = l[k] + dl[k]
        last[k] = l0[k]
    return GO_ON


@apart("damping", *ALL)
def add_work(e, matrices, rule, s, w, state):
    """Add the work of damping at the mean velocity of the step."""
    # In the conserving scheme this is the work of its force. In others the mean force of both ends
    # could have negative work, because of unresolved vibrations.
    u, u0, d, middle = w.x.u, w.y[0], w.x.damping, w.x.middle
    damping_velocity = w.x.damping_velocity
    for i in indices(u.size):
        damping_velocity[i] = (u[i] - u0[i]) / s.dt
        middle[i] = 0.5 * (u[i] + u0[i])
    t = s.t_force if rule.conserving > 0 else s.t - 0.5 * s.dt
    damping_force(e, matrices.dampers, matrices.M, t, middle, damping_velocity, 0.0, d, w.x.scratch)
    state.dissipated[0] += s.dt * dot(d, damping_velocity)


@source
def steps(e, matrices, rule, data, state, w, memories, rows, multiplier_rows, _):
    """Take steps from ``w.y`` and the multipliers in ``w.m``; returns how many succeeded."""
    # Written for each step: work of damping, 1 if something may touch and history, (n, 2 + k); u,
    # v, a and w, (n, 4, N); multipliers at the end and where they were evaluated, (n, 2, m).
    contacts, w0, w1 = e.forces.contacts, w.y[3], w.x.du
    for n in range(rows.shape[0]):
        s = step_of(e.joints, rule, data, n)
        if contacts.lasting >= PRESSURES:  # the solution depends on the initial guess
            state.factors[0], state.mixed_steps[0], state.fresh[0] = 0, 0, 0
        status = _iterate(e, matrices, rule, s, w, state)
        if status == DONE:
            status = _end(e, matrices, rule, s, w, state)
        if status == FAILED:
            return n
        if matrices.dampers.active > 0:
            add_work(e, matrices, rule, s, w, state)
        if e.lasting > 0:
            settle(e, (s.t_force, s.t), s.dt if rule.conserving > 0 else 0.0, w.y[0], w.x.u, w.x.v,
                   state, memories[n, 2:])
        free = nothing_touches(e.forces, w.y[0]) and nothing_touches(e.forces, w.x.u)
        memories[n, 1] = 0.0 if free else 1.0
        # the end of the step becomes the start of the next
        copy(w.x.u, w.y[0])
        copy(w.x.v, w.y[1])
        copy(w.x.acceleration, w.y[2])
        for i in indices(w0.size):
            w0[i] = w1[i] * e.free[i] + s.supports[2, i]
        state.last_dt[0], state.mixed_steps[0] = s.dt, max(0, state.mixed_steps[0] - 1)
        state.energy[0] = max(state.energy[0], kinetic_energy(matrices.M, w.x.v, w.x.scratch))
        copy(shaped(w.y, (w.y.size,)), shaped(rows[n], (w.y.size,)))
        copy(w.m.l0, multiplier_rows[n, 0])
        copy(w.m.last, multiplier_rows[n, 1])
        memories[n, 0] = state.dissipated[0]  # last: the step is complete
    return rows.shape[0]


@apart("motion", *ALL, returns=int)
def _iterate(e, matrices, rule, s, w, state):
    """Iterate to the end of a step: DONE or FAILED."""
    joined, damped, taken = w.m.l.size > 0, matrices.dampers.active > 0, room((1,))
    contacts, stale, limits = e.forces.contacts, not s.kept, room((2,))
    _predict(e, matrices, rule, s, w, state, limits)
    status, left, most = GO_ON, ITERATIONS, AUGMENTED
    _start(e, matrices, rule, s, w, state)
    if e.lasting > 0:
        e.span[0] = s.dt
        if e.lasting >= MATERIALS:
            carry_eigenstrains(e.loads, s.ends)
        if contacts.lasting > 0:
            contacts.memory[RATE] = 1.0 / (s.dt * s.dt)
    state.guess[0] = 1 if e.forces.paired > 0 else 0
    while left > 0:
        left, most = left - 1, most - 1
        if state.factors[0] == 0:
            tangent(e, matrices, rule, s, w, state)
            if factorize_tangent(e, matrices, rule, s, w, state) == 0:
                return FAILED
            stale = True
        if damped:
            to_middle(rule, w)
            to_damping_velocity(e.free, rule, s, w)
        internal_force(e, matrices, rule, s, w, state)
        anew, stale = joined and (stale or not s.constant), False
        if anew:
            directions(e, matrices, rule, s, w, state)
        residual(e, matrices, rule, s, w, state)
        status = GO_ON
        if joined and rule.conserving > 0 and not s.constant:
            status = end_velocity(e, matrices, rule, s, w, state, ROUGHLY)
            add_impulses(e, matrices, rule, s, w, state)
        if status == GO_ON:
            status = _correct(e, matrices, rule, s, w, state, anew)
        if status == GO_ON:
            status = _judged(e, matrices, rule, s, w, state, limits[0], limits[1])
        if status == DONE and contacts.lasting >= PRESSURES:
            taken[0] = 0.0  # gets the number of pressures that were too small
            ask_obstacles(e.forces, at_time(AUGMENT, s.t), w.x.u, w.x.u, taken)
            if taken[0] > 0.0:
                status, left, state.correction[0] = GO_ON, min(ITERATIONS, most), -1.0
        if status == DONE and state.guess[0] > 0 and at_rest(e.forces, w.y[0], w.x.u, 1) and (
                not at_rest(e.forces, w.y[0], w.x.u, 0)):  # margins alone said so
            status, state.guess[0] = GO_ON, 0
        if status == RESTART:
            _start(e, matrices, rule, s, w, state)
        elif status != GO_ON:
            return status
    state.failure[0] = NOT_CONVERGED if most > 0 else UNSETTLED
    return FAILED


@apart("motion", *ALL, returns=int)
def _end(e, matrices, rule, s, w, state):
    """Set velocities, accelerations and multipliers of the last iterate; may be FAILED. w_1 takes
    the place of the correction."""
    joined, status = w.m.l.size > 0, GO_ON
    if joined:
        if not s.constant:
            directions(e, matrices, rule, s, w, state)
        status = end_velocity(e, matrices, rule, s, w, state, EXACTLY)
    else:
        free_velocity(e.free, rule, s, w)
    u, v, base, rest, v0 = w.x.u, w.x.v, w.x.base, w.x.rest, w.y[1]
    a1, w1, w0, given = w.x.acceleration, w.x.du, w.y[3], s.supports[2]
    l, impulse, l0, last = w.m.l, w.m.impulse, w.m.l0, w.m.last
    if rule.conserving > 0:
        # values in the middle of steps, extrapolated to the end from the last two
        ahead = s.dt / (s.dt + state.last_dt[0])
        for i in indices(u.size):
            w1[i] = (v[i] - v0[i]) / s.dt
            a1[i] = (w1[i] + ahead * (w1[i] - w0[i])) * e.free[i] + given[i]
        for k in indices(l.size):
            l[k] += impulse[k] / s.dt
            l0[k] = l[k] + ahead * (l[k] - last[k])
            last[k] = l[k]
    else:
        c = 1.0 / (rule.beta * s.dt * s.dt)
        for i in indices(u.size):
            w1[i] = c * (u[i] - base[i])
            a1[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * e.free[i] + given[i]
    if status == GO_ON and joined and rule.conserving == 0:
        status = close_acceleration(e, matrices, rule, s, w, state)
    return status


@apart("motion", *ALL, F1)
def _predict(e, matrices, rule, s, w, state, limits):
    """Set all that does not depend on u_1, and the initial guess with the acceleration at 0."""
    # ``limits`` get the reference of the tolerance, and the round-off of a correction.
    h, u, guess, straight = s.dt, w.x.u, w.x.guess, w.x.straight
    base, speed, rest, constrained = w.x.base, w.x.speed, w.x.rest, w.x.constrained
    u0, v0, a0, w0 = w.y[0], w.y[1], w.y[2], w.y[3]
    b, c = h * h * (0.5 - rule.beta), h * (1.0 - rule.gamma)
    p, q = rule.alpha_m / (1.0 - rule.alpha_f), rule.alpha_f / (1.0 - rule.alpha_f)
    d, a = rule.beta * h * h, a0 if rule.conserving > 0 else w0
    for i in indices(u.size):
        base[i] = u0[i] + h * v0[i] + b * w0[i]
        speed[i] = v0[i] + c * w0[i]
        rest[i] = p * w0[i] - q * a0[i]
        constrained[i] = s.supports[2, i]
        guess[i] = (base[i] + d * a[i]) * e.free[i] + s.supports[0, i]
        straight[i] = (u0[i] + h * v0[i]) * e.free[i] + s.supports[0, i]
        u[i] = guess[i]
    if rule.conserving > 0:  # from the change of velocity
        for i in indices(u.size):
            constrained[i] = (s.supports[1, i] - v0[i]) * (1.0 - e.free[i]) / h
    state.fresh[0], state.correction[0] = 0, -max(1.0, state.fresh[0])
    free_velocity(e.free, rule, s, w)
    energy = max(state.energy[0], kinetic_energy(matrices.M, w.x.v, w.x.scratch))
    inertia = 2.0 * abs(kinetic_energy(matrices.M, u, w.x.scratch))
    limits[0] = motion_size(energy)
    limits[1] = noise_of_step(rule, s.stiffness_factor, s.mass_factor, inertia)


@apart("motion", *ALL)
def _start(e, matrices, rule, s, w, state):
    """Set the initial guess; in the mixed iteration a straight motion."""
    copy(w.x.straight if state.mixed_steps[0] > 0 else w.x.guess, w.x.u)
    copy(w.m.l0, w.m.l)
    if state.mixed_steps[0] > 0 and state.factors[0] == 0:  # otherwise those of the last step
        body_stress(e.body, w.y[0], w.stresses[3])
        clear(w.stresses[5])


@apart("motion", *ALL, bool, returns=int)
def _correct(e, matrices, rule, s, w, state, anew):
    """Correct u and the multipliers; FAILED for dependent joints."""
    u, R, du = w.x.u, w.x.residual, w.x.du
    l, dl, phi, A, rows = w.m.l, w.m.dl, w.m.phi, factors(matrices, state), matrices.rows
    state.iterations[0] += 1
    for i in indices(u.size):
        R[i] *= e.free[i]
        du[i] = R[i]
    if rule.solver == 0:
        solve_rows(A, rows, du)
    if l.size > 0:
        constraint(e.joints, s.joints.c[0], s.joints.g[0], s.t, u, phi)
        for k in indices(l.size):
            dl[k] = phi[k]
            phi[k] = -phi[k]
        if anew and rows.P.shape[0] > 0:
            anew = False
            for k in range(l.size):
                row, out = w.J[0, k], w.J[2, k]
                for i in indices(u.size):
                    out[i] = row[i] * e.free[i]
                solve_rows(A, rows, out)
        if rule.solver > 0:
            good = call_solver(rule.solver, s.t, u, l, R, phi, du, dl)
        else:
            good = solve_joined(A, w.J[0], w.J[1], e.free, anew, w.J[2], w.S, dl, du) > 0
        if not good:
            state.failure[0] = DEPENDENT
            return FAILED
        add_multiple(1.0, dl, l)
    add_multiple(1.0, du, u)
    state.last_correction[0], state.correction[0] = (
        state.correction[0], correction_size(e, R, du, phi, dl))
    return GO_ON


@apart("motion", *ALL, float, float, returns=int)
def _judged(e, matrices, rule, s, w, state, reference, noise):
    """Update the independent stresses and decide what to do after the correction."""
    # If old factors rotate with respect to a stiff, slender beam, they take axial stretch for
    # bending, and Newton's iteration needs new ones all the time. Independent stresses, ``S = D
    # (eps(u) + B(origin) du)``, have an error of the rotation only, whatever D is.
    du, scratch = w.x.du, w.x.scratch
    if state.mixed_steps[0] > 0:
        for i in indices(du.size):
            scratch[i] = s.stiffness_factor * du[i]
        body_linearised(e.body, w.x.ahead, scratch, w.stresses[4], w.stresses[3])
        if matrices.dampers.viscous > 0:
            for i in indices(du.size):
                scratch[i] = s.damping_factor * du[i]
            body_linearised(e.viscous, w.x.origin, scratch, w.stresses[6], w.stresses[5])
        size, before = state.correction[0], SLOW * state.last_correction[0]
        slow = ROUGH * noise < size and 0.0 < before < size
        if slow and state.fresh[0] > 0 and state.factors[0] == SYMMETRIC:
            state.mixed_steps[0] = 2 * LASTING
    # only the displacement of the factors is wrong, and the last step was easy: require more
    easy = state.last_correction[0] >= -1.0 and state.contraction[0] <= SLOW
    later = (state.factors[0] == UNSYMMETRIC and easy and quadratic(e.body)
             and _far(matrices.M, s, w))
    return judged(state, rule.tol, reference, noise, REUSED,
                  MIXED if state.fresh[0] > 0 else REUSED, later)


@source
def _far(M, s, w):
    """True if a correction is large compared with the motion in the step."""
    limit = (FAR * s.dt)**2 * kinetic_energy(M, w.y[1], w.x.scratch)
    return kinetic_energy(M, w.x.du, w.x.scratch) > limit
