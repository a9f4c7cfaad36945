"""The equilibrium iteration, Newton's method and the mixed iteration; results and failures."""

from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..actions.contact.tables import PASSED
from ..actions.forces.kernels import nothing_touches, rests
from ..actions.tables import add_constraint_rate
from ..core.band import add_multiple, add_to_diagonal, dot, largest, multiply, solve_definite
from ..core import F1, MADE, Array, apart, call_solver, indices, source
from ..equations.convergence import (FEWEST, NEVER, correction_size, diverges, force_size,
                                     is_at_rest, is_balanced, is_small)
from ..equations.tables import Equations
from ..equations.evaluation import (AT_END, AT_START, BETWEEN, DRAG, DU, FORCE, LOAD, MOVED,
                                    RESIDUAL, U, UNSEEN, Target, balance, examine, hold_back)

# results of statics


@dataclass
class LoadStep:
    """One converged load step.

    Attributes
    ----------
    load
        Load factor at its end; 1 is full load.
    iterations
        Number of linear systems solved, including failed attempts.
    force_residuals, energy_residuals
        For each iteration the residual in the norm ``sum R_i^2 / K_ii`` and the work ``R . du`` of
        the correction, as square roots relative to those of the forces and of the work.
    """

    load: float
    iterations: int = 0
    force_residuals: list = field(default_factory=list)
    energy_residuals: list = field(default_factory=list)


class Attempt(NamedTuple):
    """A strategy that was tried, its iterations, and why it failed ("" if it did not)."""

    strategy: str
    iterations: int
    failure: str = ""

    def __str__(self):
        s = "" if self.iterations == 1 else "s"
        return f"{self.strategy} ({self.iterations} iteration{s})"


@dataclass
class StaticResult:
    """Result of a static solution.

    Attributes
    ----------
    u, multipliers, force
        Displacement (N,), multipliers (m,), and internal force (N,) if known.
    load
        The load factor reached.
    steps
        A :class:`LoadStep` for each load step.
    converged, message
        Whether full load was reached, and how.
    rejected
        Number of rejected load steps.
    unstable, doubt
        Whether the equilibrium is unstable, and doubts about the result.
    memory
        History, shape (n,), or None.
    rubbed
        Work that friction and materials dissipate in all load steps.
    diverging
        Whether the equilibrium of the linearised law was no better start; it is not tried again.
    attempts
        An :class:`Attempt` for each strategy tried; the last one succeeded.
    seen
        What is within the range of the model, see
        :func:`~skfem_ancf.equations.evaluation.examine`.
    """

    u: Array
    multipliers: Array
    load: float
    force: Array | None
    steps: list[LoadStep]
    converged: bool
    message: str
    rejected: int = 0
    unstable: bool = False
    doubt: str = ""
    memory: Array | None = None
    rubbed: float = 0.0
    diverging: bool = False
    attempts: tuple[Attempt, ...] = ()
    seen: int = UNSEEN

    @property
    def iterations(self) -> int:
        """Number of linear systems solved for the converged steps, including failed attempts."""
        return sum([step.iterations for step in self.steps])


class Equilibrium(NamedTuple):
    """Displacement (N,), multipliers (m,), internal force (N,) and range of an equilibrium."""

    u: Array
    multipliers: Array
    force: Array
    seen: int = UNSEEN


class LoadStepFailed(Exception):
    """A load step did not converge; the message says why, ``load`` at which level. ``found`` is
    the last Equilibrium, or displacement and multipliers, of some failures."""

    load = 1.0

    def __init__(self, message: str, found: Any = None) -> None:
        super().__init__(message)
        self.found = found


class Diverging(LoadStepFailed):
    """The first corrections of a load step did not decrease."""


class TooManyIterations(LoadStepFailed):
    """The iterations have not sufficed; ``found`` are the last displacement and multipliers."""


class UnboundedMotion(LoadStepFailed):
    """A descent goes on in a motion that nothing restrains."""


class FirstStepTooLarge(LoadStepFailed):
    """The second correction of the mixed iteration did far more work than the loads."""


class Unstable(LoadStepFailed):
    """A load step ended at an unstable equilibrium, ``found``."""


# the iteration

#: Approximate iterations to an equilibrium, by which work in NumPy is counted.
ITERATIONS = 8
#: Of loose members: factors on the drag in tangents that are not definite, and the largest one.
MORE_DRAG, MOST_DRAG = 3.0, 1e6
#: How an iteration ends; INDEFINITE is that of compiled code whose factors need LAPACK.
CONVERGED, SINGULAR, NOT_CONVERGED, NOT_FINITE, INDEFINITE, DIVERGES = range(6)


@source
def equilibrium(e, target, rules, factors, g, x, m, stresses, record):
    """Iterate from x[U] and the multipliers m[0], with c of the joints in m[3] and their g."""
    # ``factors`` are load factors and those of the first tangent, (2, k); ``record`` gets residuals
    # and works. Returns the status, the numbers of residuals and of works, whether the last factors
    # are those of ``e.factors``, and what :func:`examine` says of an equilibrium.
    residuals, works = record[0], record[1]
    u, du, force, load, R, moved = x[U], x[DU], x[FORCE], x[LOAD], x[RESIDUAL], x[MOVED]
    multipliers, phi, dm = m[0], m[1], m[2]
    by_band = target.definite and e.factors.flat.size > 0
    norms, loose = np.empty(3), 1.0 if largest(x[DRAG]) > 0.0 else 0.0
    touches = e.forces.contacts.number > 0 or e.forces.changing > 0
    at_rest, last, clear, moving, k = False, False, not touches, target.moving, 0
    work, before, tol = 0.0, 0.0, rules.tol
    while True:
        # the last residual needs no tangent
        balance(e, target, factors, AT_START if k == 0 else AT_END if last else BETWEEN,
                rules.mixed and k > 0, g, x, m, stresses, norms)
        rho, size, joint_gap = norms[0], norms[1], norms[2]
        if not rho < 1e300:
            return NOT_FINITE, k, k, by_band and k > 0, UNSEEN
        residuals[k] = rho / size if size > 0.0 else 0.0
        clear = clear or nothing_touches(e.forces, u)
        if not clear:
            e.forces.clear[PASSED] += 1.0
        used, tol = tol, rules.tol if clear else rules.rough
        if k == 0:
            balanced = is_at_rest(rho, size, joint_gap, tol)
            # round-off, unless the correction shows that it is the load of a slender beam
            at_rest = rho <= rules.force_noise
        else:
            balanced = last and used <= tol and is_balanced(rho, size, joint_gap, tol,
                                                            rules.force_noise)
        if balanced and not moving:
            return CONVERGED, k + 1, k, by_band and k > 0, examine(e, u, stresses[0])
        if k == rules.iterations or k >= rules.patience and touches and (
                e.forces.clear[PASSED] > 0.0):
            return NOT_CONVERGED, k + 1, k, by_band and k > 0, UNSEEN
        if last:
            balance(e, target, factors, BETWEEN, rules.mixed, g, x, m, stresses, norms)
        if moving:
            _move(e, target, g, moved, u, R, phi)
        if by_band and (e.forces.changing > 0 and not clear and not rests(e.forces, u, 0.0)
                        or solve_definite(e.K, e.factors, e.fixed, R, du) == 0):
            return INDEFINITE, k + 1, k, False, UNSEEN
        good = by_band or _solve(e, target, loose, x, m)
        before, work = work, correction_size(e, R, du, phi, dm) if good else np.inf
        if not work < 1e300:
            return SINGULAR, k + 1, k, False, UNSEEN
        if moving:
            add_multiple(1.0, moved, du)
            clear = not touches
        elif touches:
            clear = hold_back(e, target.at, loose, clear, u, R, du, dm) > 0
        moving = False
        add_multiple(1.0, du, u)
        add_multiple(1.0, dm, multipliers)
        reference = force_size(e, force, load, u)
        works[k] = work / reference if reference > 0.0 else 0.0
        k += 1
        if rules.give_up > NEVER and diverges(rules.give_up, k - 1, works[k - 1]):
            return DIVERGES, k, k, by_band, UNSEEN
        contraction = work / before if before > 0.0 else 1.0
        last = (k >= FEWEST or at_rest) and is_small(work, contraction, tol, reference,
                                                     rules.noise)


@source
def _solve(e, target, loose, x, m):
    """Set the corrections x[DU] and m[2] by the linear solver; False if it fails."""
    u, R, du, multipliers, phi, dm = x[U], x[RESIDUAL], x[DU], m[0], m[1], m[2]
    for i in indices(phi.size):
        phi[i] = -phi[i]
    stiff, more = e.K.flat.copy() if loose > 0.0 else e.K.flat[:0], 1.0
    good = call_solver(target.solver, target.at, u, multipliers, R, phi, du, dm)
    while loose > 0.0 and good and dot(R, du) < 0.0 and more < MOST_DRAG:
        more *= MORE_DRAG  # what snaps through is held, so that corrections go downhill
        e.K.flat[:] = stiff
        add_to_diagonal(e.K, more * x[DRAG])
        good = call_solver(target.solver, target.at, u, multipliers, R, phi, du, dm)
    return good


@apart("statics", Equations, Annotated[Target, MADE], F1, F1, F1, F1, F1)
def _move(e, target, g, moved, u, R, phi):
    """Let residuals take account of the prescribed changes of fixed DOFs, (N,)."""
    force = np.zeros(u.size)
    multiply(e.K, moved, force)
    for i in indices(u.size):
        R[i] -= force[i] * e.free[i]
    add_constraint_rate(e.joints, g, target.at, u, moved, phi)
