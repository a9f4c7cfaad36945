"""Time steps of every scheme, as a text.

A step of size h leads from 0 to 1, with eq. (7)-(9) of Arnold and Bruls (2007)::

    M a_1 + f(u_1) + d(u_1, v_1) + J^T lambda = Q,   Phi(u_1) = 0
    u_1 = u_0 + h v_0 + h^2 ((1/2 - beta) w_0 + beta w_1)
    v_1 = v_0 + h ((1 - gamma) w_0 + gamma w_1)
    (1 - alpha_m) w_1 + alpha_m w_0 = (1 - alpha_f) a_1 + alpha_f a_0

The energy-momentum scheme solves the same with ``beta = 1/2``, ``gamma = 1`` and no alpha: then
``w_1`` is the acceleration in the middle of the step, where f and Q are means between 0 and 1, d
is ``d((u_0 + u_1) / 2, (u_1 - u_0) / h)``, whose work is not negative, and J is that of the middle,
or what else has ``J (u_1 - u_0) = Phi(u_1) - Phi(u_0)`` where Phi is not quadratic.
"""

from typing import NamedTuple

import numpy as np

from ..core.band import (Band, add_halves, add_multiple, clear, copy, dot, factorize, fix, multiply,
                         solve_joined, subtract_rows, total)
from ..beam.strain_energy import (add_force_of, add_turned, body_carry, body_force, body_mean,
                                  body_mixed, body_stress, body_tangent, quadratic)
from ..actions.contact.tables import PRESSURES
from ..actions.forces.kernels import (add_contact_tangent, add_elastic_force, add_rubbing_tangent,
                                    augment_contact, element_stiffness, pace_contact, put_between,
                                    settle_contact)
from ..core.callbacks import own_joints, own_solve
from ..core.source import F1, F2, F3, lanes, source
from ..actions.tables import (add_constraint_rate, add_curvature_force, add_joint_force,
                              add_load_stiffness, add_products, constraint, joint_directions,
                              mean_external_force)
from .dampers import (Dampers, Rows, add_damping, damping_beside, damping_force, factorize_rows,
                      solve_rows)
from .rates import JointMotion, JointMotions, acceleration_of_joints, drive_rate

EPS = 2.2e-16
#: Iterations of a step at most.
ITERATIONS = 30
#: Contraction up to which factors are kept.
REUSED = 0.1
#: The same for factors of the step's own where stresses are carried, and for how many steps they
#: are, from one on that wants new factors again.
CARRIED, LASTING = 0.3, 256.0
#: Contraction of symmetric factors beyond which the others pay where stresses are carried, and the
#: least that is expected of these.
SLOW = 0.03
#: Part of the way of a step that a correction is, beyond which its end is a poor place of factors.
FAR = 0.03
#: Corrections that are as many times their round-off tell nothing by how they contract.
ROUGH = 1e3
#: Contraction expected of new factors, and the least that is expected of any.
EXPECTED, LEAST = 0.1, 0.01
#: Iterations of a step in which pressures of obstacles are corrected, at most: those that end take
#: up to two hundred.
AUGMENTED = 300
#: Growth of a correction, with new factors, beyond which the step is given up.
DIVERGING = 2.0

#: What a run of steps keeps, in one array: whether there are factors, how many iterations and
#: factorisations there were, the last contraction, the size of the step before, the largest energy
#: seen, and why a step has failed; of the step, whether its factors are its own, and the sizes of
#: the last two corrections, negative where there is none (of the first of a step, minus how often
#: the one before has factorised); the work of damping so far; for how many
#: steps stresses are carried.
(READY, COUNT, FACTORIZED, RATE, BEFORE, ENERGY, FAILURE, FRESH, SIZE, LAST_SIZE,
 DISSIPATED, MIXED) = range(12)
STATE = 12
#: By the number in ``state[FAILURE]``.
FAILURES = ("", "the iteration matrix is singular", "the residual is not finite",
            "the iteration diverges", f"no convergence in {ITERATIONS} iterations",
            "the joints depend on each other",
            f"the pressures of method='augmented' do not settle in {AUGMENTED} iterations (a "
            "larger tolerance= of the obstacle, or method='penalty', helps)")
SINGULAR, NOT_FINITE, DIVERGES, NOT_CONVERGED, DEPENDENT, UNSETTLED = range(1, 7)
#: What READY is: no factors, those of the symmetric matrix, those of the other one.
SYMMETRIC, TURNED = 1.0, 2.0
#: How impulses of joints are found that are eliminated.
ROUGHLY, EXACTLY = range(2)
#: What a correction tells.
GO_ON, DONE, ASTRAY, FAILED = range(4)


class Rule(NamedTuple):
    """A scheme in numbers.

    Attributes
    ----------
    conserving
        1 for the energy-momentum scheme.
    alpha_m, alpha_f, beta, gamma
        As above.
    tol
        Tolerance of the iteration, relative, in the energy norm.
    floor, inertia
        Round-off of the strains in that norm, and what the square of that of places is a factor of.
    solver, mass_solver
        Handles of what solves with the iteration matrix and with the mass where joints are
        eliminated, see :mod:`skfem_ancf.equations.condensation`; 0 where they are a border.
    """

    conserving: int
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tol: float
    floor: float
    inertia: float
    solver: int
    mass_solver: int


class Matrices(NamedTuple):
    """The mass matrix, its factors with the supports fixed, and those of the iteration matrix.

    Attributes
    ----------
    M, mass, A
        As said.
    U
        That of conserving steps with carried stresses, which is not symmetric; else of no size.
    rows
        What the iteration matrix has beside its band.
    dampers
        What resists velocities.
    """

    M: Band
    mass: Band
    A: Band
    U: Band
    rows: Rows
    dampers: Dampers


class Course(NamedTuple):
    """Functions of time for a block of steps; arrays of one row where nothing depends on time.

    Attributes
    ----------
    dt
        Size of the steps.
    times
        Their ends, and when their equations of motion hold, shape (n, 2).
    factors
        Of the loads, shape (n, l).
    supports
        Displacement, velocity and acceleration at fixed coordinates, zero elsewhere, shape
        (n, 3, N).
    joints
        A :class:`~skfem_ancf.dynamics.rates.JointMotions`.
    """

    dt: float
    times: F2
    factors: F2
    supports: F3
    joints: JointMotions


class Step(NamedTuple):
    """What of the :class:`Course` is that of one step, and what else its equations take.

    Attributes
    ----------
    dt, t, acting
        Its size, its end, and when its equation of motion holds.
    factors, supports, joints
        As of the Course, without the first axis.
    mass_factor, damping_factor, stiffness_factor
        The iteration matrix is ``mass_factor M + damping_factor D + stiffness_factor K``.
    constant, kept
        True if the joints' directions do not depend on the displacement; and nor on time, and the
        step before has solved with them.
    """

    dt: float
    t: float
    acting: float
    factors: np.ndarray
    supports: np.ndarray
    joints: JointMotion
    mass_factor: float
    damping_factor: float
    stiffness_factor: float
    constant: bool
    kept: bool


class Vectors(NamedTuple):
    """Work arrays, all of shape (N,).

    Attributes
    ----------
    u, v, guess
        Displacement and velocity of the iterate, and where it began.
    base, speed, rest
        ``u_1 - beta h^2 w_1``, ``v_1 - gamma h w_1``, and the part of the acceleration without w_1.
    held, middle
        The acceleration held by supports; where the tangent is taken.
    acceleration, residual, du, force, room
        The first four as said; room.
    damping, pace
        The damping force, and the velocity that it resists.
    origin, ahead, straight
        Where the factors were made, of forces and of the strains at the end, and u at the end with
        the velocity at the begin.
    """

    u: F1
    v: F1
    guess: F1
    base: F1
    speed: F1
    rest: F1
    held: F1
    middle: F1
    acceleration: F1
    residual: F1
    du: F1
    force: F1
    room: F1
    damping: F1
    pace: F1
    origin: F1
    ahead: F1
    straight: F1


class Shares(NamedTuple):
    """Of joints, all of shape (m,).

    Attributes
    ----------
    l, dl
        Multipliers of the iterate, and their correction.
    phi, impulse
        How far joints are open, and their impulses.
    l0, last
        The multipliers at the begin, and where the step before took them.
    """

    l: F1
    dl: F1
    phi: F1
    impulse: F1
    l0: F1
    last: F1


class Work(NamedTuple):
    """Work arrays.

    Attributes
    ----------
    y
        u, v, the acceleration and w at the begin of the step, shape (4, N).
    x, m
        As above.
    J
        The joints' directions where they act, those at the end of the step, and the solutions with
        the former, by the factors and by those of the mass, shape (4, m, N); of no joint where they
        are eliminated.
    S
        ``J1 A^-1 J^T``, shape (m, m), or of none.
    stresses
        Of all beams: zero, those at the begin, others, carried ones, those of the iterate, and the
        last two of rates of strains, shape (7, k).
    """

    y: F2
    x: Vectors
    m: Shares
    J: F3
    S: F2
    stresses: F2


def room_for_steps(N: int, m: int, stresses: int, dense: int) -> Work:
    """The :class:`Work` of steps."""
    x, shares = np.zeros((len(Vectors._fields), N)), np.zeros((len(Shares._fields), m))
    return Work(np.zeros((4, N)), Vectors(*x), Shares(*shares), np.zeros((4, dense, N)),
                np.zeros((dense, dense)), np.zeros((7, stresses)))


@source
def steps(e, matrices, rule, course, state, w, memories, rows, multiplier_rows, works):
    """Take steps from ``w.y`` and the multipliers in ``w.m`` on; returns how many were done.

    Written are of each step what obstacles keep, (n, k), u, v, the acceleration and the scheme's
    acceleration, (n, 4, N), the multipliers at its end and where it took them, (n, 2, m), and the
    work of damping up to its end, (n,).
    """
    m, y, u = w.m.l.size, w.y, w.x.u
    joined, damped = m > 0, matrices.dampers.active > 0
    contacts, taken, stale = e.forces.contacts, np.empty(1), joined
    for n in range(rows.shape[0]):
        s = _step(e.joints, rule, course, n)
        if contacts.lasting >= PRESSURES:  # of several solutions its begin decides
            state[READY], state[MIXED], state[FRESH] = 0.0, 0.0, 0.0
        rough, wanted = _begin(e.free, matrices.M, rule, s, w, state)
        told, left, most, stale = GO_ON, ITERATIONS, AUGMENTED, stale or not s.kept
        _start(e, w, state)
        if contacts.lasting > 0:
            pace_contact(e.forces, s.dt)
        while left > 0:
            left, most = left - 1, most - 1
            if state[READY] == 0.0:
                _tangent(e, matrices, rule, s, w, state)
                if not _factorize(e, matrices, rule, s, w, state):
                    return n
                stale = True
            if damped:
                _middle(rule, w)
                _pace(e.free, rule, s, w)
            _internal_force(e, matrices.dampers, rule, w, state)
            _add_elastic(e.forces, rule, s, w)
            if damped:
                _resist(e, matrices, s, w, state)
            anew, stale = joined and (stale or not s.constant), False
            if anew:
                _directions(e.joints, rule, s, w)
            _residual(e.loads, e.joints, e.free, matrices.M, rule, s, w)
            told = GO_ON
            if joined and rule.conserving > 0 and not s.constant:
                told = _velocity(e.joints, e.free, matrices.mass, rule, s, w, state, ROUGHLY)
                _add_impulses(e.joints, s, w)
            if told == GO_ON:
                told = _correct(e.joints, e.free, matrices, rule, s, w, state, anew)
            if told == GO_ON:
                told = _judged(e, matrices, s, w, state, wanted, rough)
            if told == DONE and contacts.lasting >= PRESSURES:
                augment_contact(e.forces, s.t, u, taken)
                if taken[0] > 0.0:
                    told, left, state[SIZE] = GO_ON, min(ITERATIONS, most), -1.0
            if told == ASTRAY:
                _start(e, w, state)
            elif told != GO_ON:
                break
        if told == DONE:
            if joined and not s.constant:
                _directions(e.joints, rule, s, w)
            told = _velocity(e.joints, e.free, matrices.mass, rule, s, w, state, EXACTLY)
            _accelerations(e.free, rule, s, w, state)
            if told == GO_ON and joined and rule.conserving == 0:
                told = _close_acceleration(e.joints, e.free, matrices.mass, rule, s, w, state)
        elif told != FAILED:
            told, state[FAILURE] = FAILED, NOT_CONVERGED if most > 0 else UNSETTLED
        if told == FAILED:
            return n
        if damped:
            _add_work(e, matrices, rule, s, w, state)
        if contacts.lasting > 0:
            _settle(e.forces, rule, s, w, taken)
            state[DISSIPATED] += taken[0]
            copy(contacts.memory, memories[n])
        works[n] = state[DISSIPATED]
        _finish(e.free, matrices.M, s, w, state)
        for k in range(4):
            copy(y[k], rows[n, k])
        copy(w.m.l0, multiplier_rows[n, 0])
        copy(w.m.last, multiplier_rows[n, 1])
    return rows.shape[0]


@source
def judge(state, wanted, rough, reused):
    """What the size of a correction tells: of factors that are kept as long as it contracts."""
    size, before = state[SIZE], state[LAST_SIZE]
    if not size < 1e300:
        state[FAILURE] = NOT_FINITE
        return FAILED
    if before > 0.0:
        rate = size / before
        if rate > 1.0 and size <= ROUGH * rough:
            return DONE
        # of one step, used in the next; sizes by what is not symmetric are no norm
        state[RATE] = max(rate, SLOW if state[READY] == TURNED else LEAST)
        if rate > reused and size * min(1.0, rate) > wanted:
            if state[FRESH] > 0.0 and rate > DIVERGING:
                state[FAILURE] = DIVERGES
                return FAILED
            state[READY] = 0.0
            return ASTRAY if rate > 1.0 and state[FRESH] == 0.0 else GO_ON
    return DONE if size * min(1.0, state[RATE]) <= wanted else GO_ON


@source
def judged(state, wanted, rough, reused, carried, later):
    """What a correction tells, of iterations with carried stresses too."""
    fresh = state[FRESH] > 0.0
    if state[MIXED] > 0.0:
        told = judge(state, wanted, rough, carried)
        if told == GO_ON and not fresh and (state[LAST_SIZE] > 0.0 or not later):
            state[READY] = 0.0  # old ones have turned the beam
        return told
    told = judge(state, wanted, rough, reused)
    if fresh and (told == FAILED or told != DONE and state[READY] == 0.0):
        state[MIXED], state[READY] = LASTING, 0.0
        return ASTRAY
    return told


@source
def round_off(rule, stiffness_factor, mass_factor, noise):
    """The round-off of a correction, by that of the strains and of the mass times u, u."""
    return np.sqrt(rule.floor**2 * stiffness_factor
                   + EPS * EPS * mass_factor * (noise + rule.inertia))


# one step


@source
def mass_factor(rule, dt):
    """The factor of the mass in the iteration matrix: da_1 / du_1."""
    return (1.0 - rule.alpha_m) / ((1.0 - rule.alpha_f) * rule.beta * dt * dt)


@source
def damping_factor(rule, dt):
    """The factor of the damping in the iteration matrix: that of the velocity by u_1."""
    return (1.0 if rule.conserving > 0 else rule.gamma / rule.beta) / dt


@source
def _row(x, n):
    """Of an array that may have one row for all steps."""
    return x[n if x.shape[0] > 1 else 0]


@source
def _step(joints, rule, course, n):
    """The :class:`Step` number n."""
    c, g = course.joints.c, course.joints.g
    constant = joints.hk.size == 0 and joints.own == 0
    kept = constant and g.shape[0] == 1 and n > 0
    joints_now = JointMotion(_row(c, n), _row(g, n), course.joints.drives)
    return Step(course.dt, course.times[n, 0], course.times[n, 1],
                _row(course.factors, n), _row(course.supports, n), joints_now,
                mass_factor(rule, course.dt), damping_factor(rule, course.dt),
                0.5 if rule.conserving > 0 else 1.0, constant, kept)


@source
def _begin(free, M, rule, s, w, state):
    """What does not depend on u_1, and where its iteration begins: by the acceleration at 0.

    Returns the round-off of a correction, and the size of one that is small enough.
    """
    h, u, guess, straight = s.dt, w.x.u, w.x.guess, w.x.straight
    base, speed, rest, held = w.x.base, w.x.speed, w.x.rest, w.x.held
    u0, v0, a0, w0 = w.y[0], w.y[1], w.y[2], w.y[3]
    b, c = h * h * (0.5 - rule.beta), h * (1.0 - rule.gamma)
    p, q = rule.alpha_m / (1.0 - rule.alpha_f), rule.alpha_f / (1.0 - rule.alpha_f)
    d, a = rule.beta * h * h, a0 if rule.conserving > 0 else w0
    for i in lanes(u.size):
        base[i] = u0[i] + h * v0[i] + b * w0[i]
        speed[i] = v0[i] + c * w0[i]
        rest[i] = p * w0[i] - q * a0[i]
        held[i] = s.supports[2, i]
        guess[i] = (base[i] + d * a[i]) * free[i] + s.supports[0, i]
        straight[i] = (u0[i] + h * v0[i]) * free[i] + s.supports[0, i]
        u[i] = guess[i]
    if rule.conserving > 0:  # what the velocity changes by
        for i in lanes(u.size):
            held[i] = (s.supports[1, i] - v0[i]) * (1.0 - free[i]) / h
    state[FRESH], state[SIZE] = 0.0, -max(1.0, state[FRESH])  # of the last step
    _free_velocity(free, rule, s, w)
    energy = max(state[ENERGY], _energy(M, w.x.v, w.x.room))
    noise = 2.0 * abs(_energy(M, u, w.x.room))
    rough = round_off(rule, s.stiffness_factor, s.mass_factor, noise)
    return rough, rule.tol * np.sqrt(energy) + rough


@source
def _middle(rule, w):
    """Where the tangent and the joints' directions are taken, of the iterate."""
    u, u0, middle = w.x.u, w.y[0], w.x.middle
    a = 0.5 if rule.conserving > 0 else 0.0
    for i in lanes(u.size):
        middle[i] = u[i] + a * (u0[i] - u[i])


@source
def _free_velocity(free, rule, s, w):
    """v_1 of the iterate, without the joints' part."""
    u, v, base, speed = w.x.u, w.x.v, w.x.base, w.x.speed
    c = rule.gamma / (rule.beta * s.dt)
    for i in lanes(u.size):
        v[i] = (speed[i] + c * (u[i] - base[i])) * free[i] + s.supports[1, i]


@source
def _pace(free, rule, s, w):
    """The velocity that damping resists, of the iterate."""
    u, u0, v, pace = w.x.u, w.y[0], w.x.v, w.x.pace
    _free_velocity(free, rule, s, w)
    for i in lanes(u.size):
        pace[i] = (u[i] - u0[i]) / s.dt if rule.conserving > 0 else v[i]


@source
def _velocity(joints, free, mass, rule, s, w, state, exact):
    """v_1 of the iterate, with the joints' impulses; FAILED if these are not determined.

    ``v_1 = v - M^-1 J^T impulse`` with ``d Phi / dt = 0`` at the end of the step; up to what an
    iteration leaves, where that is not the last, unless ``exact``.
    """
    _free_velocity(free, rule, s, w)
    if w.m.impulse.size > 0:
        drive_rate(joints, s.joints, s.t, s.dt, w.x.u, w.m.impulse)
        if rule.mass_solver > 0:
            return _eliminated(joints, rule, s, w, w.x.middle, w.m.impulse, w.x.v, state, exact)
        if not solve_joined(mass, w.J[0], w.J[1], free, not s.kept, w.J[3], w.S, w.m.impulse,
                            w.x.v):
            state[FAILURE] = DEPENDENT
            return FAILED
    return GO_ON


@source
def _eliminated(joints, rule, s, w, at, b, x, state, exact):
    """Change x by ``-M^-1 J^T b``, left in ``w.x.pace``, so that ``J1 x`` becomes what -b was.

    Of joints that are eliminated. J is that at the displacement ``at``, J1 that at the end of the
    step. FAILED if they depend on each other.
    """
    change, rate = w.x.pace, w.m.phi
    add_constraint_rate(joints, s.joints.g[0], s.t, w.x.u, x, b)
    for k in lanes(b.size):
        rate[k] = -b[k]
    copy(at, change)
    known = w.m.l if exact > 0 else w.m.l[:0]  # none: roughly
    if not own_solve(rule.mass_solver, s.t, w.x.u, known, x, rate, change, b):
        state[FAILURE] = DEPENDENT
        return FAILED
    for i in lanes(x.size):
        x[i] += change[i]
    return GO_ON


@source
def _energy(M, v, room):
    """v . M v / 2."""
    multiply(M, v, room)
    return 0.5 * dot(v, room)


# its iteration


@source
def _start(e, w, state):
    """Where the iteration begins; with carried stresses on a straight way."""
    copy(w.x.straight if state[MIXED] > 0.0 else w.x.guess, w.x.u)
    copy(w.m.l0, w.m.l)
    if state[MIXED] > 0.0 and state[READY] == 0.0:  # else those of the step before
        body_stress(e.body, w.y[0], w.stresses[3])
        clear(w.stresses[5])


@source
def _internal_force(e, dampers, rule, w, state):
    """The internal force of the iterate, without damping.

    With carried stresses S, what is missing in ``S = D eps(u)`` acts as the factors take it, in the
    directions of where they were made::

        f = B(u)^T S + B(origin)^T (D eps(u) - S)

    and stresses of the rates of strains likewise.
    """
    u0, u, f, S = w.y[0], w.x.u, w.x.force, w.stresses
    missing, carried, own, slow, rates = S[2], S[3], S[4], S[5], S[6]
    if state[MIXED] > 0.0:
        body_mixed(e.body, rule.conserving > 0, u0, u, f, carried, own)
        for i in lanes(missing.size):
            missing[i] = own[i] - carried[i]
        if dampers.viscous > 0:
            body_carry(e.viscous, w.x.middle, w.x.pace, S[0], rates)
            add_force_of(e.body, w.x.middle, slow, f)
            for i in lanes(missing.size):
                missing[i] += rates[i] - slow[i]
        add_force_of(e.body, w.x.origin, missing, f)
    elif rule.conserving > 0:
        body_mean(e.body, u0, u, f)
    else:
        body_force(e.body, u, f)


@source
def _judged(e, matrices, s, w, state, wanted, rough):
    """What the last correction tells, of iterations with carried stresses and without.

    A stiff and slender beam turned by old factors is stretched by what they take for bending: its
    iteration wants ever new ones. Carried stresses, ``S = D (eps(u) + B(origin) du)``, are as far
    off as the factors have turned, whatever D is.
    """
    du, room = w.x.du, w.x.room
    if state[MIXED] > 0.0:
        for i in lanes(du.size):
            room[i] = s.stiffness_factor * du[i]
        body_carry(e.body, w.x.ahead, room, w.stresses[4], w.stresses[3])
        if matrices.dampers.viscous > 0:
            for i in lanes(du.size):
                room[i] = s.damping_factor * du[i]
            body_carry(e.viscous, w.x.origin, room, w.stresses[6], w.stresses[5])
        slow = ROUGH * rough < state[SIZE] and 0.0 < SLOW * state[LAST_SIZE] < state[SIZE]
        if slow and state[FRESH] > 0.0 and state[READY] == SYMMETRIC:
            state[MIXED] = 2.0 * LASTING
    # where nothing but their place is off, and the last step was an easy one, it has to be good
    easy = state[LAST_SIZE] >= -1.0 and state[RATE] <= SLOW
    later = state[READY] == TURNED and easy and quadratic(e.body) and _far(matrices.M, s, w)
    return judged(state, wanted, rough, REUSED, CARRIED if state[FRESH] > 0.0 else REUSED, later)


@source
def _far(M, s, w):
    """True if a correction is not small against the way of a step, at the speed of its begin."""
    way = (FAR * s.dt)**2 * _energy(M, w.y[1], w.x.room)
    return _energy(M, w.x.du, w.x.room) > way


@source
def _tangent(e, matrices, rule, s, w, state):
    """The iteration matrix, with the stresses at the begin of the step, or means that are carried.

    Those of an iterate may be far off: turning by a straight predictor stretches; and so may be
    those that are carried to the end of the step, where stretching is not resolved.
    """
    M, A, dampers, yes = matrices.M.flat, matrices.A.flat, matrices.dampers, w.x.u.size > 0
    stresses = w.stresses
    if state[MIXED] > 0.0 and rule.conserving > 0:
        copy(stresses[3], stresses[1])
        add_multiple(1.0, stresses[5], stresses[1])
    else:
        body_stress(e.body, w.y[0], stresses[1])
        if dampers.viscous > 0:
            body_carry(e.viscous, w.y[0], w.y[1], stresses[1], stresses[1])
    _middle(rule, w)
    copy(w.x.middle, w.x.origin)
    copy(w.x.middle, w.x.ahead)
    body_tangent(e.body, w.x.middle, w.x.force, stresses[1], yes, stresses[2], matrices.A)
    if dampers.active > 0:
        add_damping(e.viscous, dampers, matrices.M, s.damping_factor / s.stiffness_factor,
                    w.x.middle, stresses, w.x.room, matrices.A)
        for k in range(dampers.modes.shape[0]):
            matrices.rows.S[k, k] = s.damping_factor
    add_load_stiffness(e.loads, s.factors, s.acting, 1.0, w.x.middle, matrices.A)
    _add_elements(e.forces, matrices, s, w)
    if e.forces.contacts.number > 0:
        _add_obstacles(e, matrices, rule, s, w)
    for i in lanes(A.size):
        A[i] = s.mass_factor * M[i] + s.stiffness_factor * A[i]


@source
def _add_elements(forces, matrices, s, w):
    """Add the derivatives of force elements to the band, and to what is beside it."""
    if forces.start.size > 0:
        D = np.empty(forces.size)
        element_stiffness(forces, s.acting, w.x.middle, w.y[1],
                          s.damping_factor / s.stiffness_factor, D)
        add_products(matrices.A.flat, forces.band_at, forces.band_weight, D, forces.band_of)
        put_between(forces, D, s.stiffness_factor, matrices.dampers.modes.shape[0],
                    matrices.rows.S)


@source
def _add_obstacles(e, matrices, rule, s, w):
    """Add the derivatives of contact to the band: of the iterate, as its velocity is."""
    u, u0 = w.x.u, w.y[0]
    if rule.conserving > 0:
        add_contact_tangent(e.forces, s.acting, s.dt, u0, u, matrices.A)
    else:
        add_contact_tangent(e.forces, s.acting, 0.0, u, u, matrices.A)
    if matrices.dampers.elements > 0:
        _pace(e.free, rule, s, w)
        add_rubbing_tangent(e.forces, s.acting, s.damping_factor / s.stiffness_factor,
                            w.x.middle, w.x.pace, matrices.A)


@source
def _settle(forces, rule, s, w, taken):
    """Anchors follow at the end of the step; what that has taken."""
    if rule.conserving > 0:
        settle_contact(forces, s.acting, s.dt, w.y[0], w.x.u, taken)
    else:
        settle_contact(forces, s.acting, 0.0, w.x.u, w.x.u, taken)


@source
def _add_elastic(forces, rule, s, w):
    """Add the force of elements to the internal one: that of the iterate, or its mean."""
    u, f = w.x.u, w.x.force
    if rule.conserving > 0:
        add_elastic_force(forces, s.acting, s.dt, w.y[0], u, f)
    else:
        add_elastic_force(forces, s.acting, 0.0, u, u, f)


@source
def _factorize(e, matrices, rule, s, w, state):
    """Factors of the iteration matrix; False if it has none."""
    fix(matrices.A, e.fixed)
    state[FACTORIZED] += 1.0
    state[READY] = SYMMETRIC
    if rule.solver > 0:  # asked without a right-hand side: with what multipliers do at u
        l, dl, none = w.m.l, w.m.dl, w.x.du[:0]
        for k in lanes(l.size):
            dl[k] = s.stiffness_factor * l[k]
        good = own_solve(rule.solver, s.acting, w.x.middle, dl, none, none, none, none)
    else:
        if turning(matrices, state):
            _turn(e, matrices, s, w)
            state[READY] = TURNED
        good = factorize(factors(matrices, state))
    if not good:
        state[READY], state[FAILURE] = 0.0, SINGULAR
        return False
    if rule.solver == 0:
        factorize_rows(factors(matrices, state), matrices.rows, e.free)
    state[RATE], state[FRESH], state[SIZE] = EXPECTED, state[FRESH] + 1.0, -1.0
    return True


@source
def factors(matrices, state):
    """The matrix that has the factors."""
    return matrices.U if state[READY] == TURNED else matrices.A


@source
def turning(matrices, state):
    """True if the next factors are those of the matrix that is not symmetric."""
    return state[MIXED] > LASTING and matrices.U.flat.size > 0


@source
def _turn(e, matrices, s, w):
    """The iteration matrix with the strains' derivatives at the end of the step, into U.

    A force in the middle ``B(u_m)^T S`` has the derivative ``B(u_m)^T D B(u_1)``. For A, which has
    B(u_m) in place of B(u_1), both must be close: they are not where more strains are sampled than
    the axis of a straight beam can stretch, as of cables of degree 5 and more, and what bends it
    must undo the rest. Then the iteration by A contracts slowly, or not at all.
    """
    U = matrices.U
    copy(w.x.u, w.x.ahead)
    clear(U.flat)
    add_turned(e.body, w.x.middle, w.x.ahead, U)
    add_halves(matrices.A, s.stiffness_factor, U)
    fix(U, e.fixed)


@source
def _resist(e, matrices, s, w, state):
    """Add the damping force of the iterate to the internal one, which has what is carried."""
    d, f = w.x.damping, w.x.force
    damping_beside(e, matrices.dampers, matrices.M, s.acting, w.x.middle, w.x.pace, state[MIXED],
                   d, w.x.room)
    for i in lanes(f.size):
        f[i] += d[i]


@source
def _add_work(e, matrices, rule, s, w, state):
    """Add what damping takes in the middle of the step, at its mean velocity.

    In the conserving scheme that is the work of its force. In others velocities at the ends of
    steps may be those of vibrations that the steps do not resolve: the mean force of both ends may
    have a negative work.
    """
    u, u0, d, pace, middle = w.x.u, w.y[0], w.x.damping, w.x.pace, w.x.middle
    for i in lanes(u.size):
        pace[i] = (u[i] - u0[i]) / s.dt
        middle[i] = 0.5 * (u[i] + u0[i])
    t = s.acting if rule.conserving > 0 else s.t - 0.5 * s.dt
    damping_force(e, matrices.dampers, matrices.M, t, middle, pace, d, w.x.room)
    state[DISSIPATED] += s.dt * dot(d, pace)


@source
def _directions(joints, rule, s, w):
    """The joints' directions where they act, and at the end of the step."""
    _middle(rule, w)
    if rule.solver > 0:
        return
    if joints.own > 0 and rule.conserving > 0:
        flat = w.J[0].reshape(w.J[0].size)
        clear(flat)
        own_joints(joints.own, np.int64(5), s.acting, w.x.u, w.y[0], flat)
    else:
        joint_directions(joints, s.joints.g[1], s.acting, w.x.middle, w.J[0])
    joint_directions(joints, s.joints.g[0], s.t, w.x.u, w.J[1])


@source
def _residual(loads, joints, free, M, rule, s, w):
    """R = Q - f - M a - J^T lambda."""
    u, base, rest, held = w.x.u, w.x.base, w.x.rest, w.x.held
    a, R, f, room = w.x.acceleration, w.x.residual, w.x.force, w.x.room
    for i in lanes(u.size):
        a[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * free[i] + held[i]
    multiply(M, a, room)
    mean_external_force(loads, s.factors, s.acting, w.y[0] if rule.conserving > 0 else u, u, R)
    for i in lanes(u.size):
        R[i] = R[i] - f[i] - room[i]
    if rule.solver > 0:
        clear(room)
        add_joint_force(joints, s.joints.g[1], s.acting, w.x.middle, w.m.l, room)
        for i in lanes(u.size):
            R[i] -= room[i]
    else:
        subtract_rows(w.J[0], w.m.l, R)


@source
def _add_impulses(joints, s, w):
    """R -= (impulse . Phi'') (v_0 + v_1) / 4: eq. of Gear, Leimkuhler and Gupta (1985)."""
    v0, v, room, share, impulse = w.y[1], w.x.v, w.x.room, w.m.phi, w.m.impulse
    if joints.own > 0:
        n = v.size
        ends = np.empty(3 * n + impulse.size)
        copy(v0, ends[:n])
        copy(v, ends[n:2 * n])
        copy(w.y[0], ends[2 * n:3 * n])
        copy(impulse, ends[3 * n:])
        own_joints(joints.own, np.int64(6), s.acting, w.x.u, ends, w.x.residual)
        return
    for i in lanes(v.size):
        room[i] = v0[i] + v[i]
    for k in lanes(share.size):
        share[k] = -0.25 * impulse[k]
    add_curvature_force(joints, share, room, w.x.residual)


@source
def _correct(joints, free, matrices, rule, s, w, state, anew):
    """Correct u and the multipliers; FAILED if these are not determined."""
    u, R, du, room = w.x.u, w.x.residual, w.x.du, w.x.room
    l, dl, phi, A, rows = w.m.l, w.m.dl, w.m.phi, factors(matrices, state), matrices.rows
    state[COUNT] += 1.0
    for i in lanes(u.size):
        R[i] *= free[i]
        du[i] = R[i]
    if rule.solver == 0:
        solve_rows(A, rows, du)
    work = abs(dot(R, du))
    if l.size > 0:
        constraint(joints, s.joints.c[0], s.joints.g[0], s.t, u, phi)
        for k in lanes(l.size):
            dl[k] = phi[k]
            phi[k] = -phi[k]
        if anew and rows.P.shape[0] > 0:
            anew = False
            for k in range(l.size):
                row, out = w.J[0, k], w.J[2, k]
                for i in lanes(u.size):
                    out[i] = row[i] * free[i]
                solve_rows(A, rows, out)
        if rule.solver > 0:
            good = own_solve(rule.solver, s.t, u, l, R, phi, du, dl)
        else:
            good = solve_joined(A, w.J[0], w.J[1], free, anew, w.J[2], w.S, dl, du)
        if not good:
            state[FAILURE] = DEPENDENT
            return FAILED
        for i in lanes(u.size):
            room[i] = np.abs(R[i] * du[i])
        work = dot(room, free)
        for k in lanes(l.size):
            l[k] += dl[k]
            phi[k] = np.abs(phi[k] * dl[k])
        work += total(phi)
    for i in lanes(u.size):
        u[i] += du[i]
    state[LAST_SIZE], state[SIZE] = state[SIZE], np.sqrt(work)
    return GO_ON


# its end


@source
def _accelerations(free, rule, s, w, state):
    """w_1 (in place of the correction) and a_1, and the multipliers at the end of the step."""
    u, v, base, rest, v0 = w.x.u, w.x.v, w.x.base, w.x.rest, w.y[1]
    a1, w1, w0, given = w.x.acceleration, w.x.du, w.y[3], s.supports[2]
    l, impulse, l0, last = w.m.l, w.m.impulse, w.m.l0, w.m.last
    if rule.conserving > 0:
        # what acts in the middle of a step, extrapolated to its end from the last two
        ahead = s.dt / (s.dt + state[BEFORE])
        for i in lanes(u.size):
            w1[i] = (v[i] - v0[i]) / s.dt
            a1[i] = (w1[i] + ahead * (w1[i] - w0[i])) * free[i] + given[i]
        for k in lanes(l.size):
            l[k] += impulse[k] / s.dt
            l0[k] = l[k] + ahead * (l[k] - last[k])
            last[k] = l[k]
    else:
        c = 1.0 / (rule.beta * s.dt * s.dt)
        for i in lanes(u.size):
            w1[i] = c * (u[i] - base[i])
            a1[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * free[i] + given[i]


@source
def _close_acceleration(joints, free, mass, rule, s, w, state):
    """Change accelerations and multipliers so that they meet the joints' second rate too."""
    a1, w1, l, dl, shared = w.x.acceleration, w.x.du, w.m.l, w.m.dl, w.m.phi
    l0, last, anew = w.m.l0, w.m.last, rule.conserving > 0  # J are those of the velocity, else
    acceleration_of_joints(joints, s.joints, s.t, s.dt, w.x.u, w.x.v, dl)
    share = (1.0 - rule.alpha_f) / (1.0 - rule.alpha_m)
    if rule.mass_solver > 0:
        if _eliminated(joints, rule, s, w, w.x.u, dl, a1, state, EXACTLY) == FAILED:
            return FAILED
        for i in lanes(w1.size):
            w1[i] += share * w.x.pace[i]
    else:
        if not solve_joined(mass, w.J[1], w.J[1], free, anew, w.J[3], w.S, dl, a1):
            state[FAILURE] = DEPENDENT
            return FAILED
        for k in lanes(l.size):
            shared[k] = share * dl[k]
        subtract_rows(w.J[3], shared, w1)
    for k in lanes(l.size):
        l0[k] = l[k] + dl[k]
        last[k] = l0[k]
    return GO_ON


@source
def _finish(free, M, s, w, state):
    """The end of the step becomes the begin of the next."""
    u, v, a1, w1, given = w.x.u, w.x.v, w.x.acceleration, w.x.du, s.supports[2]
    u0, v0, a0, w0 = w.y[0], w.y[1], w.y[2], w.y[3]
    for i in lanes(u.size):
        u0[i] = u[i]
        v0[i] = v[i]
        a0[i] = a1[i]
        w0[i] = w1[i] * free[i] + given[i]
    state[BEFORE], state[MIXED] = s.dt, max(0.0, state[MIXED] - 1.0)
    state[ENERGY] = max(state[ENERGY], _energy(M, v, w.x.room))
