"""The rule of convergence of all iterations: equilibria, load increments, paths and time steps.

A correction du of the displacement, and dl of the multipliers of joints, solves the linearised
equations for the residuals R and phi. Its size is the root of its work,
``sqrt(|R . du| + |phi . dl|)``, an energy norm in which units do not matter
(:func:`correction_size`). An iteration has converged when

1. the error that the last correction leaves, estimated as its size times the contraction of the
   last corrections, is at most ``tol * reference`` plus round-off (:func:`is_small`),
2. the next residual, in the norm ``sqrt(sum R_i^2 / K_ii)``, is at most ``tol`` times that of the
   larger force plus round-off, and joints are closed to :data:`CLOSED` (:func:`is_balanced`).

The reference is the root of the work of the forces in statics and along paths, and that of the
largest energy so far in motions. ``tol`` is thus the relative error in the energy norm. The
contraction counts as 1 before there are two corrections; in time steps, whose factors may be those
of earlier steps, it is then the last one, or :data:`EXPECTED` of new factors. Time steps omit the
second test, since another residual costs as much as another iteration.
"""

from typing import Any, NamedTuple

import numpy as np

from ..core import Array, source
from ..core.band import dot

# the rule

#: The largest relative residual of joints.
CLOSED = 1e-12
EPS = 2.2e-16


# All iterations measure by the next three. ``e`` are the Equations: other norms than that of the
# energy need the sizes of DOFs, and of joints.


@source
def correction_size(e, R, du, phi, dm):
    """Size of the corrections du (N,) and dm (m,) for the residuals R and phi."""
    work = abs(dot(R, du))
    if phi.size > 0:
        work += abs(dot(phi, dm))
    return np.sqrt(work)


@source
def force_size(e, force, load, u):
    """Size of an equilibrium, or of its change: that of the larger force (N,), displaced by u."""
    return np.sqrt(max(abs(dot(force, u)), abs(dot(load, u))))


@source
def motion_size(energy):
    """Size of a motion of this energy."""
    return np.sqrt(energy)


@source
def is_small(size, contraction, tol, reference, noise):
    """True if the error that a correction leaves is within tolerance."""
    return size * min(1.0, contraction) <= tol * reference + noise


@source
def is_balanced(residual, force, joint_gap, tol, noise):
    """True if the norm of a residual, and the residual of joints, are within tolerance."""
    return residual <= tol * force + noise and joint_gap <= CLOSED


@source
def is_at_rest(residual, force, joint_gap, tol):
    """True if nothing has to be corrected, by the residual before the first correction."""
    return residual <= 1e-3 * tol * force and joint_gap <= CLOSED


def joint_gap(phi: Array, sizes: Array) -> float:
    """The largest relative residual of joints phi (m,), whose equations have these sizes (m,)."""
    return float(np.max(np.abs(phi) / sizes, initial=0.0))


# equilibria: from the first residual to the last

#: Least number of corrections, unless the initial residual is round-off.
FEWEST = 2
#: When corrections that do not decrease end an iteration: by the third one, or by the second and
#: late ones.
NEVER, BY_THIRD, BY_SECOND_OR_LATE = range(3)
#: Root of the relative work of the third correction that indicates divergence; the same of the
#: second one, for a very soft scene; first late correction, and its limit.
DIVERGING, TOO_LARGE, LATE, LARGE = 0.9, 10.0, 8, 3.0


class Rules(NamedTuple):
    """Convergence criteria and options of an equilibrium."""

    mixed: bool  # the geometric part uses independent stresses
    iterations: int  # largest number
    patience: int  # and that once something may have touched
    tol: float
    rough: float  # the same where obstacles or members may touch
    noise: float  # round-off of the size of a correction
    force_noise: float  # round-off of the residual
    give_up: int  # NEVER, BY_THIRD or BY_SECOND_OR_LATE


def rules_of(system: Any, method: str, tol: float, most: int, give_up: int = NEVER,
             rough: float = 0.0, patience: int | None = None) -> Rules:
    """The :class:`Rules` of a system; ``most`` is the largest number of iterations. ``rough`` is a
    larger tolerance where something may touch, ``patience`` the largest number from there on."""
    scales = system.scales
    # the residual has the round-off of all DOFs, the work that of the strains
    return Rules(method == "mixed", most, most if patience is None else min(most, patience), tol,
                 rough or tol, 8.0 * scales.work_noise, 8.0 * scales.force_noise, give_up)


@source
def diverges(give_up, k, size):
    """True if the relative size of correction k indicates that the iteration diverges."""
    if give_up == BY_THIRD:
        return k == 2 and size > DIVERGING
    return (k == 1 and size > TOO_LARGE) or (k >= LATE and size > LARGE)


# time steps: when factors of earlier steps are used again

#: Largest contraction with which factors are reused.
REUSED = 0.1
#: The same for factors of this step in the mixed iteration, and the number of mixed steps after one
#: that needs new factors repeatedly.
MIXED, LASTING = 0.3, 256
#: Contraction of symmetric factors above which unsymmetric ones pay in the mixed iteration, and the
#: least contraction expected of these.
SLOW = 0.03
#: Below this multiple of the round-off, the contraction of corrections is not informative.
ROUGH = 1e3
#: Expected contraction of new factors, and the least contraction expected.
EXPECTED, LEAST = 0.1, 0.01
#: Growth of a correction with new factors that counts as divergence.
GROWTH = 2.0
#: Numbers of messages, see ``FAILURES`` of :mod:`skfem_ancf.dynamics.records`.
SINGULAR, NOT_FINITE, DIVERGES, NOT_CONVERGED, DEPENDENT, UNSETTLED = range(1, 7)
#: Kinds of factors of a step; 0 for none.
SYMMETRIC, UNSYMMETRIC = 1, 2
#: Result of a correction.
GO_ON, DONE, RESTART, FAILED = range(4)


@source
def judge(state, tol, reference, noise, reused):
    """What to do after a correction of a time step, by its size and contraction."""
    # ``state`` is the StepState, ``reused`` the largest contraction with which factors are used
    # again.
    size, before = state.correction[0], state.last_correction[0]
    if not size < 1e300:
        state.failure[0] = NOT_FINITE
        return FAILED
    if before > 0.0:
        rate = size / before
        if rate > 1.0 and size <= ROUGH * noise:
            return DONE
        # used in the next step too; the size is not a norm with an unsymmetric matrix
        state.contraction[0] = max(rate, SLOW if state.factors[0] == UNSYMMETRIC else LEAST)
        if rate > reused and not is_small(size, rate, tol, reference, noise):
            if state.fresh[0] > 0 and rate > GROWTH:
                state.failure[0] = DIVERGES
                return FAILED
            state.factors[0] = 0
            return RESTART if rate > 1.0 and state.fresh[0] == 0 else GO_ON
    return DONE if is_small(size, state.contraction[0], tol, reference, noise) else GO_ON


@source
def judged(state, tol, reference, noise, reused, mixed, later):
    """:func:`judge`, also for the mixed iteration."""
    fresh = state.fresh[0] > 0
    if state.mixed_steps[0] > 0:
        status = judge(state, tol, reference, noise, mixed)
        if status == GO_ON and not fresh and (state.last_correction[0] > 0.0 or not later):
            state.factors[0] = 0  # the beam has rotated since
        return status
    status = judge(state, tol, reference, noise, reused)
    if fresh and (status == FAILED or status != DONE and state.factors[0] == 0):
        state.mixed_steps[0], state.factors[0] = LASTING, 0
        return RESTART
    return status


@source
def noise_of_step(rule, stiffness_factor, mass_factor, inertia):
    """The round-off of a correction, from that of the strains and of the mass."""
    # ``inertia`` is the mass times squared displacements.
    return np.sqrt(rule.noise**2 * stiffness_factor
                   + EPS * EPS * mass_factor * (inertia + rule.inertia))
