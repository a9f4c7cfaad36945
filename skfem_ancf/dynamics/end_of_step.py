"""Velocities, accelerations and multipliers at the end of a step."""

from ..core.band import copy, dot, solve_joined, subtract_rows
from ..actions.forces.kernels import set_contact_rate, settle_contact, settle_elements
from ..beam.strain_energy import accept_body
from ..core.callbacks import call_solver
from ..core.source import indices, source
from ..actions.tables import add_constraint_rate
from .convergence import DEPENDENT, EXACTLY, FAILED, GO_ON
from .dampers import damping_force
from .records import acceleration_of_joints, drive_rate
from .residual import free_velocity, kinetic_energy


@source
def end_velocity(joints, free, mass, rule, s, w, state, exact):
    """v_1 = v - M^-1 J^T impulse of the iterate, with d Phi / dt = 0; FAILED for dependent joints.

    Unless ``exact``, the accuracy is that of the iteration.
    """
    free_velocity(free, rule, s, w)
    if w.m.impulse.size > 0:
        drive_rate(joints, s.joints, s.t, s.dt, w.x.u, w.m.impulse)
        if rule.mass_solver > 0:
            return _eliminated(joints, rule, s, w, w.x.middle, w.m.impulse, w.x.v, state, exact)
        if not solve_joined(mass, w.J[0], w.J[1], free, not s.kept, w.J[3], w.S, w.m.impulse,
                            w.x.v):
            state.failure[0] = DEPENDENT
            return FAILED
    return GO_ON


@source
def _eliminated(joints, rule, s, w, at, b, x, state, exact):
    """Change x by ``-M^-1 J^T b`` so that ``J1 x`` becomes the initial -b, for eliminated joints.

    J is taken at the displacement ``at``, J1 at the end of the step. The change is also in
    ``w.x.damping_velocity``. FAILED for dependent joints.
    """
    change, rate = w.x.damping_velocity, w.m.phi
    add_constraint_rate(joints, s.joints.g[0], s.t, w.x.u, x, b)
    for k in indices(b.size):
        rate[k] = -b[k]
    copy(at, change)
    known = w.m.l if exact > 0 else w.m.l[:0]  # empty: rough solution
    if not call_solver(rule.mass_solver, s.t, w.x.u, known, x, rate, change, b):
        state.failure[0] = DEPENDENT
        return FAILED
    for i in indices(x.size):
        x[i] += change[i]
    return GO_ON


@source
def accelerations(free, rule, s, w, state):
    """Set w_1 (in place of the correction), a_1 and the multipliers at the end of the step."""
    u, v, base, rest, v0 = w.x.u, w.x.v, w.x.base, w.x.rest, w.y[1]
    a1, w1, w0, given = w.x.acceleration, w.x.du, w.y[3], s.supports[2]
    l, impulse, l0, last = w.m.l, w.m.impulse, w.m.l0, w.m.last
    if rule.conserving > 0:
        # values in the middle of steps, extrapolated to the end from the last two
        ahead = s.dt / (s.dt + state.last_dt[0])
        for i in indices(u.size):
            w1[i] = (v[i] - v0[i]) / s.dt
            a1[i] = (w1[i] + ahead * (w1[i] - w0[i])) * free[i] + given[i]
        for k in indices(l.size):
            l[k] += impulse[k] / s.dt
            l0[k] = l[k] + ahead * (l[k] - last[k])
            last[k] = l[k]
    else:
        c = 1.0 / (rule.beta * s.dt * s.dt)
        for i in indices(u.size):
            w1[i] = c * (u[i] - base[i])
            a1[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * free[i] + given[i]


@source
def close_acceleration(joints, free, mass, rule, s, w, state):
    """Project accelerations and multipliers onto the second rate of the joints."""
    a1, w1, l, dl, shared = w.x.acceleration, w.x.du, w.m.l, w.m.dl, w.m.phi
    l0, last, anew = w.m.l0, w.m.last, rule.conserving > 0  # otherwise J is that of the velocity
    acceleration_of_joints(joints, s.joints, s.t, s.dt, w.x.u, w.x.v, dl)
    share = (1.0 - rule.alpha_f) / (1.0 - rule.alpha_m)
    if rule.mass_solver > 0:
        if _eliminated(joints, rule, s, w, w.x.u, dl, a1, state, EXACTLY) == FAILED:
            return FAILED
        for i in indices(w1.size):
            w1[i] += share * w.x.damping_velocity[i]
    else:
        if not solve_joined(mass, w.J[1], w.J[1], free, anew, w.J[3], w.S, dl, a1):
            state.failure[0] = DEPENDENT
            return FAILED
        for k in indices(l.size):
            shared[k] = share * dl[k]
        subtract_rows(w.J[3], shared, w1)
    for k in indices(l.size):
        l0[k] = l[k] + dl[k]
        last[k] = l0[k]
    return GO_ON


@source
def add_work(e, matrices, rule, s, w, state):
    """Add the work of damping at the mean velocity of the step.

    In the conserving scheme this is the work of its force. In others the mean force of both ends
    could have negative work, because of unresolved vibrations.
    """
    u, u0, d, middle = w.x.u, w.y[0], w.x.damping, w.x.middle
    damping_velocity = w.x.damping_velocity
    for i in indices(u.size):
        damping_velocity[i] = (u[i] - u0[i]) / s.dt
        middle[i] = 0.5 * (u[i] + u0[i])
    t = s.acting if rule.conserving > 0 else s.t - 0.5 * s.dt
    damping_force(e, matrices.dampers, matrices.M, t, middle, damping_velocity, d, w.x.scratch)
    state.dissipated[0] += s.dt * dot(d, damping_velocity)


@source
def begin_step(e, dt):
    """Pass the time step to what has a history."""
    e.span[0] = dt
    if e.forces.contacts.lasting > 0:
        set_contact_rate(e.forces, dt)


@source
def settle(e, rule, s, w, taken):
    """Update the history at the end of the step; ``taken`` is the dissipated work."""
    if rule.conserving > 0:
        settle_contact(e.forces, s.acting, s.dt, w.y[0], w.x.u, taken)
    else:
        settle_contact(e.forces, s.acting, 0.0, w.x.u, w.x.u, taken)
    settle_elements(e.forces, s.t, w.y[0], w.x.u, w.x.v, taken)
    accept_body(e.body, w.y[0], w.x.u, taken)
    e.span[0] = 0.0


@source
def finish(free, M, s, w, state):
    """The end of the step becomes the start of the next."""
    u, v, a1, w1, given = w.x.u, w.x.v, w.x.acceleration, w.x.du, s.supports[2]
    u0, v0, a0, w0 = w.y[0], w.y[1], w.y[2], w.y[3]
    copy(u, u0)
    copy(v, v0)
    copy(a1, a0)
    for i in indices(u.size):
        w0[i] = w1[i] * free[i] + given[i]
    state.last_dt[0], state.mixed_steps[0] = s.dt, max(0, state.mixed_steps[0] - 1)
    state.energy[0] = max(state.energy[0], kinetic_energy(M, v, w.x.scratch))
