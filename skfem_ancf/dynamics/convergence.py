"""When the iteration of a step ends, keeps its factors, begins again or fails."""

from typing import NamedTuple, get_type_hints

import numpy as np

from ..core.source import F1, I1, source

EPS = 2.2e-16
#: Iterations of a step at most.
ITERATIONS = 30
#: Contraction up to which factors are kept.
REUSED = 0.1
#: The same for factors of the step's own where stresses are carried, and for how many steps they
#: are, from one on that wants new factors again.
CARRIED, LASTING = 0.3, 256
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
GROWTH = 2.0

#: By the number in ``StepState.failure``.
FAILURES = ("", "the iteration matrix is singular", "the residual is not finite",
            "the iteration diverges", f"no convergence in {ITERATIONS} iterations",
            "the joints depend on each other",
            f"the pressures of method='augmented' do not settle in {AUGMENTED} iterations (a "
            "larger tolerance= of the obstacle, or method='penalty', helps)")
SINGULAR, NOT_FINITE, DIVERGES, NOT_CONVERGED, DEPENDENT, UNSETTLED = range(1, 7)
#: What ``StepState.factors`` is: no factors, those of the symmetric matrix, those of the other one.
SYMMETRIC, TURNED = 1, 2
#: How impulses of joints are found that are eliminated.
ROUGHLY, EXACTLY = range(2)
#: What a correction tells.
GO_ON, DONE, RESTART, FAILED = range(4)


class StepState(NamedTuple):
    """What a run of steps keeps; arrays of one number, which the steps change.

    Attributes
    ----------
    factors
        Which matrix has factors: 0 for none, :data:`SYMMETRIC` or :data:`TURNED`.
    iterations, factorizations
        Their numbers so far.
    contraction
        Of the last corrections, or as expected of new factors.
    last_dt
        Size of the step before.
    energy
        The largest so far.
    failure
        Why a step has failed, see :data:`FAILURES`.
    fresh
        How often the step has factorised.
    correction, last_correction
        Sizes of the last two corrections, negative where there is none: of the first of a step
        minus how often the one before has factorised.
    dissipated
        The work of damping.
    mixed_steps
        For how many steps more stresses are independent of displacements.
    """

    factors: I1
    iterations: I1
    factorizations: I1
    contraction: F1
    last_dt: F1
    energy: F1
    failure: I1
    fresh: I1
    correction: F1
    last_correction: F1
    dissipated: F1
    mixed_steps: I1


def new_state() -> StepState:
    """The StepState before the first step."""
    return StepState._make(np.zeros(1, int if hint is I1 else float)
                           for hint in get_type_hints(StepState, include_extras=True).values())


@source
def judge(state, wanted, rough, reused):
    """What the size of a correction tells: of factors that are kept as long as it contracts."""
    size, before = state.correction[0], state.last_correction[0]
    if not size < 1e300:
        state.failure[0] = NOT_FINITE
        return FAILED
    if before > 0.0:
        rate = size / before
        if rate > 1.0 and size <= ROUGH * rough:
            return DONE
        # of one step, used in the next; sizes by what is not symmetric are no norm
        state.contraction[0] = max(rate, SLOW if state.factors[0] == TURNED else LEAST)
        if rate > reused and size * min(1.0, rate) > wanted:
            if state.fresh[0] > 0 and rate > GROWTH:
                state.failure[0] = DIVERGES
                return FAILED
            state.factors[0] = 0
            return RESTART if rate > 1.0 and state.fresh[0] == 0 else GO_ON
    return DONE if size * min(1.0, state.contraction[0]) <= wanted else GO_ON


@source
def judged(state, wanted, rough, reused, carried, later):
    """What a correction tells, of iterations with carried stresses too."""
    fresh = state.fresh[0] > 0
    if state.mixed_steps[0] > 0:
        status = judge(state, wanted, rough, carried)
        if status == GO_ON and not fresh and (state.last_correction[0] > 0.0 or not later):
            state.factors[0] = 0  # old ones have turned the beam
        return status
    status = judge(state, wanted, rough, reused)
    if fresh and (status == FAILED or status != DONE and state.factors[0] == 0):
        state.mixed_steps[0], state.factors[0] = LASTING, 0
        return RESTART
    return status


@source
def round_off(rule, stiffness_factor, mass_factor, noise):
    """The round-off of a correction, by that of the strains and of the mass times u, u."""
    return np.sqrt(rule.floor**2 * stiffness_factor
                   + EPS * EPS * mass_factor * (noise + rule.inertia))
