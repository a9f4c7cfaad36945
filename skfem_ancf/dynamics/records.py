"""Records of time steps: the scheme, matrices, data of each step, and work arrays."""

from typing import NamedTuple

import numpy as np

from ..core.band import Band
from ..core.source import F1, F2, F3, source
from .dampers import Dampers, Rows
from .rates import JointMotion, JointMotions


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


class StepData(NamedTuple):
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
    """What of the :class:`StepData` is that of one step, and what else its equations take.

    Attributes
    ----------
    dt, t, acting
        Its size, its end, and when its equation of motion holds.
    factors, supports, joints
        As of the StepData, without the first axis.
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
    constrained, middle
        The acceleration constrained by supports; where the tangent is taken.
    acceleration, residual, du, force, scratch
        The first four as said; scratch.
    damping, damping_velocity
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
    constrained: F1
    middle: F1
    acceleration: F1
    residual: F1
    du: F1
    force: F1
    scratch: F1
    damping: F1
    damping_velocity: F1
    origin: F1
    ahead: F1
    straight: F1


class Multipliers(NamedTuple):
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
    m: Multipliers
    J: F3
    S: F2
    stresses: F2


def new_work(N: int, m: int, stresses: int, dense: int) -> Work:
    """The :class:`Work` of steps."""
    x, shares = np.zeros((len(Vectors._fields), N)), np.zeros((len(Multipliers._fields), m))
    return Work(np.zeros((4, N)), Vectors(*x), Multipliers(*shares), np.zeros((4, dense, N)),
                np.zeros((dense, dense)), np.zeros((7, stresses)))


@source
def row_of(x, n):
    """Of an array that may have one row for all steps."""
    return x[n if x.shape[0] > 1 else 0]


@source
def mass_factor(rule, dt):
    """The factor of the mass in the iteration matrix: da_1 / du_1."""
    return (1.0 - rule.alpha_m) / ((1.0 - rule.alpha_f) * rule.beta * dt * dt)


@source
def damping_factor(rule, dt):
    """The factor of the damping in the iteration matrix: that of the velocity by u_1."""
    return (1.0 if rule.conserving > 0 else rule.gamma / rule.beta) / dt


@source
def step_of(joints, rule, course, n):
    """The :class:`Step` number n."""
    c, g = course.joints.c, course.joints.g
    constant = joints.hk.size == 0 and joints.own == 0
    kept = constant and g.shape[0] == 1 and n > 0
    joints_now = JointMotion(row_of(c, n), row_of(g, n), course.joints.drives)
    return Step(course.dt, course.times[n, 0], course.times[n, 1],
                row_of(course.factors, n), row_of(course.supports, n), joints_now,
                mass_factor(rule, course.dt), damping_factor(rule, course.dt),
                0.5 if rule.conserving > 0 else 1.0, constant, kept)
