"""Named tuples of time steps, joint rates and low-rank rows beside the band."""

from typing import Annotated, NamedTuple

import numpy as np

from ..actions.forces.kernels import add_resisting_force, settle_forces
from ..actions.tables import JointTables, add_products, add_triples
from ..beam.strain_energy import accept_body, add_viscous_force, body_tangent
from ..core.band import (Band, add_multiple, clear, copy, dot, multiply, solve, solve_dependent,
                         solve_many, subtract_rows)
from ..core.callbacks import JOINTS, call_custom
from ..core import C2, F1, F2, F3, I1, MADE, apart, indices, source
from ..equations.tables import Equations


# damping in kernels: of materials, proportional to the mass, and of modes

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
def damping_force(e, dampers, M, t, u, v, mixed, out, scratch):
    """The damping force of the equations e at u and v, without materials if ``mixed``."""
    clear(out)
    if dampers.viscous > 0 and mixed == 0.0:
        add_viscous_force(e.viscous, u, v, out)
    if dampers.elements > 0:
        add_resisting_force(e.forces, t, u, v, out)
    if dampers.mass > 0.0:
        multiply(M, v, scratch)
        add_multiple(dampers.mass, scratch, out)
    for k in range(dampers.modes.shape[0]):
        row = dampers.modes[k]
        add_multiple(dot(row, v), row, out)


@source
def add_damping(viscous, dampers, M, factor, u, stresses, scratch, A):
    """Add the derivative of :func:`damping_force` by v, times a factor, to a symmetric band."""
    # Modal damping is excluded. ``stresses`` (3, n) is work, its first row zero.
    if dampers.viscous > 0:
        yes = dampers.viscous > 0
        body_tangent(viscous, u, scratch, stresses[0], yes, stresses[2], dampers.D)
        add_multiple(factor, dampers.D.flat, A.flat)
    if dampers.mass > 0.0:
        add_multiple(factor * dampers.mass, M.flat, A.flat)


@apart("rows", Band, LowRankRows, F1)
def factorize_rows(A, rows, free):
    """Set Z and H with the factors of A."""
    P, Z, H = rows.P, rows.Z, rows.H
    for a in range(P.shape[0]):  # Z = P A^-1
        for i in indices(free.size):
            Z[a, i] = P[a, i] * free[i]
    solve_many(A, Z)
    np.dot(rows.S, np.dot(P, Z.T), H)
    for a in range(P.shape[0]):
        H[a, a] += 1.0


@source
def solve_rows(A, rows, x):
    """Solve in place by the Sherman-Morrison-Woodbury formula."""
    solve(A, x)
    if rows.P.shape[0] > 0:
        _correct_rows(rows, x)


@apart("rows", LowRankRows, F1)
def _correct_rows(rows, x):
    """The part of :func:`solve_rows` beside the band."""
    z = np.dot(rows.S, np.dot(rows.P, x))
    solve_dependent(rows.H.copy(), z)
    subtract_rows(rows.Z, z, x)


# rates of joints that depend on time, by differences within one step

#: Number of intervals of a step.
PARTS = 4
_FIRST = np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0
_SECOND = np.array([35.0, -104.0, 114.0, -56.0, 11.0]) / 12.0

class JointMotion(NamedTuple):
    """Time-dependent terms of the joints at one instant, see :mod:`skfem_ancf.actions.tables`."""

    c: F2  # c and its first two rates, (3, m)
    g: F2  # the same of g, (3, k)
    drives: int  # 1 if a joint moves


@apart("joints", JointTables, Annotated[JointMotion, MADE], float, float, F1, F1)
def drive_rate(joints, motion, t, dt, u, out):
    """The partial rate of Phi, c' + g' . u, at the end t of a step of dt."""
    copy(motion.c[1], out)
    if joints.custom == 0:
        add_products(out, joints.gk, motion.g[1], u, joints.gi)
    elif motion.drives > 0:
        _add_differences(joints, t, dt, u, u, PARTS / dt, 0.0, 0.0, out)


@apart("joints", JointTables, Annotated[JointMotion, MADE], float, float, F1, F1, F1)
def acceleration_of_joints(joints, motion, t, dt, u, v, out):
    """The second rate of Phi without accelerations: c'' + v . H v + g'' . u + 2 g' . v."""
    g = motion.g[1]
    copy(motion.c[2], out)
    if joints.custom == 0:
        add_triples(out, joints.hk, joints.hv, v, joints.hi, v, joints.hj)
        add_products(out, joints.gk, motion.g[2], u, joints.gi)
        add_products(out, joints.gk, g, v, joints.gi)
        add_products(out, joints.gk, g, v, joints.gi)
    else:
        call_custom(JOINTS, joints.custom, np.int64(4), t, 1.0, u, v, out)
        if motion.drives > 0:
            _add_differences(joints, t, dt, u, v, 0.0, (PARTS / dt)**2, 2.0 * PARTS / dt, out)


@source
def _add_differences(joints, t, dt, u, v, first, second, along, out):
    """Custom joints: out += first Phi' + second Phi'' + along (J v)', by differences."""
    # Joints that do not move have none.
    values = np.empty(out.size)
    for part in range(PARTS + 1):
        time = t - part * dt / PARTS
        for k in range(2):
            c = first * _FIRST[part] + second * _SECOND[part] if k == 0 else along * _FIRST[part]
            if c != 0.0:
                clear(values)
                call_custom(JOINTS, joints.custom, 7 + k, time, 1.0, u, v, values)
                add_multiple(c, values, out)


class Rule(NamedTuple):
    """The parameters of a scheme."""

    conserving: int  # 1 for the energy-momentum scheme
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tol: float  # of the iteration, relative, in the energy norm
    noise: float  # round-off of the strains in that norm
    inertia: float  # mass times squared positions, for the round-off of joints
    solver: int  # handle of the linear solver for eliminated joints, or 0
    mass_solver: int  # the same with the mass matrix


class Matrices(NamedTuple):
    """Matrices of a system, with the supports fixed in factors."""

    M: Band
    mass: Band  # factors of M
    A: Band  # iteration matrix and its factors
    U: Band  # unsymmetric one of conserving mixed steps, or empty
    rows: LowRankRows  # of the iteration matrix
    dampers: Dampers


class Interval(NamedTuple):
    """Prescribed functions at p instants of s steps; one row if constant. The last instant is the
    end of the step, the others are the points of collocation, or that of the equation of motion."""

    h: float  # step size
    begun: int  # of collocation: 1 if there is a previous step
    ahead: F2  # and Method.ahead for the first step
    times: F1  # (s p,)
    factors: F2  # of the loads, (s p, l)
    constrained: F3  # displacement, velocity and acceleration of fixed DOFs, else 0, (s p, 3, N)
    c: F3  # of the joints, (s p, 3, m)
    g: F3  # (s p, 3, k)
    drives: int  # 1 if a joint moves


class Step(NamedTuple):
    """The data of one step; the iteration matrix is the sum of ``..._factor`` times M, D, K."""

    dt: float
    t: float  # end of the step
    t_force: float  # instant of the equation of motion
    factors: F1  # of the loads then
    ends: F1  # and at the end
    supports: F2  # displacement, velocity, acceleration of fixed DOFs, else 0, (3, N)
    joints: Annotated[JointMotion, MADE]
    g: F1  # of the joints, where they act
    mass_factor: float
    damping_factor: float
    stiffness_factor: float
    constant: bool  # the joint Jacobian does not depend on the displacement
    kept: bool  # nor on time, and its solutions of the last step are valid


class Vectors(NamedTuple):
    """Work arrays of shape (N,)."""

    u: F1  # displacement of the iterate
    v: F1  # velocity of the iterate
    guess: F1  # initial u
    base: F1  # u_1 - beta h^2 w_1
    speed: F1  # v_1 - gamma h w_1
    rest: F1  # acceleration without w_1
    constrained: F1  # acceleration prescribed by supports
    middle: F1  # displacement at which the tangent is taken
    acceleration: F1
    residual: F1
    du: F1  # correction
    force: F1  # internal force
    scratch: F1
    damping: F1  # damping force
    damping_velocity: F1
    origin: F1  # displacement of the factors: of forces
    ahead: F1  # and of the strains at the end
    straight: F1  # u at the end with the initial velocity


class Multipliers(NamedTuple):
    """Arrays of joints, of shape (m,)."""

    l: F1  # multipliers of the iterate
    dl: F1  # their correction
    phi: F1  # constraint residual
    impulse: F1
    l0: F1  # multipliers at the start
    last: F1  # multipliers where the last step evaluated them


class Work(NamedTuple):
    """Work arrays."""

    y: F2  # u, v, acceleration and w at the start of the step, (4, N)
    x: Vectors
    m: Multipliers
    J: F3  # Jacobian where joints act, at the end, and solutions by A and M, (4, m, N)
    S: F2  # J1 A^-1 J^T, (m, m)
    stresses: F2  # zero; start; work; independent; iterate; the last two of strain rates, (7, k)


#: Largest number of iterations of a step, and with pressure corrections; converging ones need up to
#: 200.
ITERATIONS, AUGMENTED = 30, 300
#: Messages by the number in ``StepState.failure``, see :mod:`skfem_ancf.equations.convergence`.
FAILURES = ("", "the iteration matrix is singular", "the residual is not finite",
            "the iteration diverges", f"no convergence in {ITERATIONS} iterations",
            "the joints are dependent",
            f"the pressures of method='augmented' do not converge in {AUGMENTED} iterations (use "
            "a larger tolerance= of the obstacle, or method='penalty')")


class StepState(NamedTuple):
    """The state of a run of steps: arrays of one number, which the steps change."""

    factors: I1  # factorised matrix: 0, SYMMETRIC or UNSYMMETRIC
    iterations: I1
    factorizations: I1
    contraction: F1  # of the last corrections, or expected of new factors
    last_dt: F1
    energy: F1  # the largest so far
    failure: I1  # number in FAILURES
    fresh: I1  # number of factorisations in this step
    correction: F1  # size; before the first, minus the factorisations of the last step
    last_correction: F1  # the one before
    dissipated: F1  # work of damping
    mixed_steps: I1  # remaining steps of the mixed iteration
    guess: I1  # 1 while margins alone say that members do not touch


# named tuples of collocation: coefficients, work arrays

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
    pairs: C2  # factors of complex eigenvalues, (k, N ld)
    real: Band  # factor of the real eigenvalue
    J: F2  # low-rank rows at the origin, joints first, (b, N)
    Y: F3  # their solutions, (2 k, b, N)
    S: F3  # coupling of the other rows by displacement and velocity, (2, b - m, b - m)
    end: F3  # joint Jacobian at the end of the step and its solutions by the mass, (2, m, N)
    shared: F2  # their Schur complement, (m, m)
    shares: F1  # multipliers there, (m,)
    D: Band  # work: damping matrix
    method: Method


#: Arguments of the functions of a step: equations, matrices, rule, step, work and state.
ALL = Equations, Matrices, Annotated[Rule, MADE], Annotated[Step, MADE], Work, StepState


@source
def settle(e, t, along, u0, u1, v1, state, history):
    """Update the history at the end of a step, which is written to ``history``."""
    # ``t`` and ``along`` are as for :func:`~skfem_ancf.actions.forces.kernels.settle_forces`.
    taken = np.empty(1)  # the dissipated work
    settle_forces(e.forces, t, along, u0, u1, v1, taken)
    accept_body(e.body, u0, u1, taken)
    e.span[0] = 0.0
    state.dissipated[0] += taken[0]
    copy(e.history, history)


@source
def kinetic_energy(M, v, scratch):
    multiply(M, v, scratch)
    return 0.5 * dot(v, scratch)


@source
def row_of(x, n):
    return x[n if x.shape[0] > 1 else 0]


@source
def mass_factor(rule, dt):
    """da_1 / du_1, the factor of M in the iteration matrix."""
    return (1.0 - rule.alpha_m) / ((1.0 - rule.alpha_f) * rule.beta * dt * dt)


@source
def motion_at(s, k):
    """The JointMotion at an instant of an Interval."""
    return JointMotion(row_of(s.c, k), row_of(s.g, k), s.drives)


@source
def step_of(joints, rule, block, n):
    """The :class:`Step` number n."""
    at, end, h = 2 * n, 2 * n + 1, block.h
    constant = joints.hk.size == 0 and joints.custom == 0
    damping_factor = (1.0 if rule.conserving > 0 else rule.gamma / rule.beta) / h  # dv / du_1
    return Step(h, block.times[end], block.times[at], row_of(block.factors, at),
                row_of(block.factors, end), row_of(block.constrained, end), motion_at(block, end),
                row_of(block.g, at)[0], mass_factor(rule, h), damping_factor,
                0.5 if rule.conserving > 0 else 1.0, constant,
                constant and block.g.shape[0] == 1 and n > 0)
