"""Convergence control of the iteration in a step."""

from typing import NamedTuple, get_type_hints

import numpy as np

from ..core.source import F1, I1, source

EPS = 2.2e-16
#: Largest number of iterations of a step.
ITERATIONS = 30
#: Largest contraction with which factors are reused.
REUSED = 0.1
#: The same for factors of this step in the mixed iteration, and the number of mixed steps after one
#: that needs new factors repeatedly.
MIXED, LASTING = 0.3, 256
#: Contraction of symmetric factors above which unsymmetric ones pay in the mixed iteration, and the
#: least contraction expected of these.
SLOW = 0.03
#: Relative correction beyond which factors of the predicted end of a step are poor.
FAR = 0.03
#: Below this multiple of the round-off, the contraction of corrections is not informative.
ROUGH = 1e3
#: Expected contraction of new factors, and the least contraction expected.
EXPECTED, LEAST = 0.1, 0.01
#: Largest number of iterations with pressure corrections; converging ones need up to 200.
AUGMENTED = 300
#: Growth of a correction with new factors that counts as divergence.
GROWTH = 2.0

#: Messages by the number in ``StepState.failure``.
FAILURES = ("", "the iteration matrix is singular", "the residual is not finite",
            "the iteration diverges", f"no convergence in {ITERATIONS} iterations",
            "the joints are dependent",
            f"the pressures of method='augmented' do not converge in {AUGMENTED} iterations (use "
            "a larger tolerance= of the obstacle, or method='penalty')")
SINGULAR, NOT_FINITE, DIVERGES, NOT_CONVERGED, DEPENDENT, UNSETTLED = range(1, 7)
#: Values of ``StepState.factors``; 0 for none.
SYMMETRIC, UNSYMMETRIC = 1, 2
#: Accuracy of the impulses of eliminated joints.
ROUGHLY, EXACTLY = range(2)
#: Result of a correction.
GO_ON, DONE, RESTART, FAILED = range(4)


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


def new_state() -> StepState:
    """The StepState before the first step."""
    return StepState._make(np.zeros(1, int if hint is I1 else float)
                           for hint in get_type_hints(StepState, include_extras=True).values())


@source
def judge(state, wanted, rough, reused):
    """What to do after a correction, by its size and contraction."""
    size, before = state.correction[0], state.last_correction[0]
    if not size < 1e300:
        state.failure[0] = NOT_FINITE
        return FAILED
    if before > 0.0:
        rate = size / before
        if rate > 1.0 and size <= ROUGH * rough:
            return DONE
        # used in the next step too; the size is not a norm with an unsymmetric matrix
        state.contraction[0] = max(rate, SLOW if state.factors[0] == UNSYMMETRIC else LEAST)
        if rate > reused and size * min(1.0, rate) > wanted:
            if state.fresh[0] > 0 and rate > GROWTH:
                state.failure[0] = DIVERGES
                return FAILED
            state.factors[0] = 0
            return RESTART if rate > 1.0 and state.fresh[0] == 0 else GO_ON
    return DONE if size * min(1.0, state.contraction[0]) <= wanted else GO_ON


@source
def judged(state, wanted, rough, reused, mixed, later):
    """:func:`judge`, also for the mixed iteration."""
    fresh = state.fresh[0] > 0
    if state.mixed_steps[0] > 0:
        status = judge(state, wanted, rough, mixed)
        if status == GO_ON and not fresh and (state.last_correction[0] > 0.0 or not later):
            state.factors[0] = 0  # the beam has rotated since
        return status
    status = judge(state, wanted, rough, reused)
    if fresh and (status == FAILED or status != DONE and state.factors[0] == 0):
        state.mixed_steps[0], state.factors[0] = LASTING, 0
        return RESTART
    return status


@source
def round_off(rule, stiffness_factor, mass_factor, noise):
    """The round-off of a correction, from that of the strains and of the mass."""
    return np.sqrt(rule.floor**2 * stiffness_factor
                   + EPS * EPS * mass_factor * (noise + rule.inertia))
