"""Newton's method and the mixed iteration, load steps, and the search for an equilibrium."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..beam.kinematics import folded
from ..core.errors import (ConvergenceError, InputError, Interrupted, require_finite, require_flag,
                           require_integer, require_option, require_positive)
from ..core.linalg import INACCURATE, NO_FACTORS
from ..core.callbacks import handle_of
from ..core.progress import progress_bar
from ..core.switch import expecting
from ..equations import stability
from .iteration import (CONVERGED, FIRST, NOT_CONVERGED, NOT_FINITE, SINGULAR, WATCHED, Rules,
                        Target, Unknowns, equilibrium, room_for_iterations)
from .strategies import HELD_BY_LOADS, STRATEGIES, Strategy
from .touching import found_touching

if TYPE_CHECKING:
    from ..equations.system import System
    from ..core.types import Array

logger = logging.getLogger(__name__)

#: Iterations in a load step that are expected, about, and at most.
ITERATIONS = 10
MAX_ITERATIONS = 10000
#: Corrections of the pressure of obstacles in a load step, at most.
AUGMENTED = 50
#: Relative error of an equilibrium that is only a start.
NEAR = 1e-2
#: Iterations to a start, at most.
SOON = 15
#: Iterations of load steps before the next strategy has its turn, and steps that are cut at the
#: begin before.
FEW, CUT = 60, 3
#: "auto" tries the strategies of :mod:`skfem_ancf.solvers.strategies`, the others one iteration.
METHODS = ("mixed", "newton", "auto")


@dataclass
class LoadStep:
    """One converged load step.

    Attributes
    ----------
    load
        Load factor at its end, 1 is full load.
    iterations
        Linear systems solved.
    force_residuals, energy_residuals
        For each iteration the residual in the norm ``sum R_i^2 / K_ii`` and the work of the
        correction ``R . du``, as square roots relative to those of the forces and of the work.
    """

    load: float
    iterations: int
    force_residuals: list = field(default_factory=list)
    energy_residuals: list = field(default_factory=list)


class Attempt(NamedTuple):
    """A strategy that was tried.

    Attributes
    ----------
    strategy
        Its name.
    iterations
        Linear systems solved, those of load steps that were given up included.
    failure
        Why it was given up; empty if it found the equilibrium.
    """

    strategy: str
    iterations: int
    failure: str = ""

    def __str__(self):
        s = "" if self.iterations == 1 else "s"
        return f"{self.strategy} ({self.iterations} iteration{s})"


class Route(NamedTuple):
    """How loads and supports come to their full values as the level goes from 0 to 1.

    Attributes
    ----------
    u
        Displacement at level 0, shape (N,).
    gap
        What is missing there to equilibrium under the full load, shape (N,), which is reduced to
        nothing; None where the loads themselves are applied.
    loads, times
        Load factor, and time of supports and obstacles, at levels 0 and 1.
    """

    u: Array
    gap: Array | None = None
    loads: tuple[float, float] = (0.0, 1.0)
    times: tuple[float, float] = (0.0, 1.0)

    def acting(self, level: float) -> tuple[float, float]:
        """Load factor and time at a level."""
        if self.gap is not None:
            return 1.0, 1.0
        (a, b), (c, d) = self.loads, self.times
        return a + level * (b - a), c + level * (d - c)

    @property
    def proportional(self) -> bool:
        """True if loads and supports grow together from the stress-free state."""
        return self.gap is None and self.loads == self.times == (0.0, 1.0)


class Options(NamedTuple):
    """Of the iteration of a load step.

    Attributes
    ----------
    route
        The :class:`Route`.
    method, tol, most
        "mixed" or "newton", tolerance of a correction, and iterations at most.
    watched
        Whether it is given up where the mixed iteration does not seem to converge.
    """

    route: Route
    method: str
    tol: float
    most: int
    watched: bool = False


class Steps(NamedTuple):
    """Rules of load steps.

    Attributes
    ----------
    method, tol, max_iterations, first_step, min_step
        As for :func:`solve_static`.
    few
        Whether they are given up after :data:`FEW` iterations, or where the first :data:`CUT` do
        not converge.
    """

    method: str
    tol: float
    max_iterations: int
    first_step: float
    min_step: float
    few: bool = False


@dataclass
class StaticResult:
    """What the iteration found.

    Attributes
    ----------
    u, multipliers, force
        Displacement (N,), multipliers (m,) and internal force (N,).
    load
        The load factor reached.
    steps
        A :class:`LoadStep` for each load step.
    converged, message
        Whether full load was reached, and in words how.
    rejected
        Load steps that were given up.
    memory
        What load steps have left behind at obstacles, shape (n,), or None.
    astray
        Whether the equilibrium of the laws' first moduli was no better a start; then it is not
        looked for again.
    unstable, doubt
        Whether the equilibrium gives way in some direction, and what could not be told.
    attempts
        The strategies that were tried, an :class:`Attempt` each; the last is the one that led here.
    """

    u: Array
    multipliers: Array
    load: float
    force: Array
    steps: list[LoadStep]
    converged: bool
    message: str
    rejected: int = 0
    unstable: bool = False
    doubt: str = ""
    memory: Array | None = None
    astray: bool = False
    attempts: tuple[Attempt, ...] = ()

    def followed_by(self, record: LoadStep, **changes: Any) -> StaticResult:
        """The result after a load step more.

        Parameters
        ----------
        record
            The load step.
        **changes
            What it has changed.
        """
        other = object.__new__(type(self))
        vars(other).update(vars(self), steps=[*self.steps, record], **changes)
        return other

    @property
    def iterations(self) -> int:
        """Linear systems solved in the converged steps."""
        return sum(step.iterations for step in self.steps)


def solve_static(system: System, u: Array | None = None, method: str = "auto", tol: float = 1e-8,
                 max_iterations: int = 30, first_step: float = 1.0, min_step: float = 1e-4,
                 progress: bool | None = None, stable: bool = True,
                 memory: Array | None = None) -> StaticResult:
    """Find the equilibrium at full load.

    The default tries a list of strategies (:data:`~skfem_ancf.solvers.strategies.STRATEGIES`) in
    order, the mixed iteration in one step first, until one ends in a stable equilibrium; the
    result's message says which. ``method="mixed"`` and ``method="newton"`` stay with one iteration
    and load steps: the first is ``first_step`` of the load, a step that fails is cut to a
    quarter, a step that goes well doubles the next. The iteration has converged when the
    correction's work ``R . du`` is below ``tol^2`` times the work done, and the residual, in the
    norm ``sqrt(sum R_i^2 / K_ii)`` in which no unit matters, is below ``tol`` times that of the
    forces; both with the round-off of the strain as a floor.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u
        Displacement to start from, shape (N,); the stress-free state by default. Load steps lead
        from it to the equilibrium under the full load, whatever holds it in its place.
    method
        "auto": the strategies in order. "mixed": the geometric part of the tangent uses a stress
        that is carried from one iterate to the next by its linearisation. "newton": it uses the
        stress of the strain. The solution is the same.
    tol
        Relative error of a correction in the energy norm.
    max_iterations
        Iterations before a step is given up and cut.
    first_step, min_step
        Parts of the load. A ``first_step`` below 1 leaves out the strategies that take the whole
        load at once.
    progress
        Show a progress bar: True, False, or None for "if it takes long".
    stable
        Take no unstable equilibrium: a step that lands on one is cut, and where the path itself
        loses its stability the solution goes on along the direction that gives way, see
        :func:`~skfem_ancf.equations.stability.descend`. False takes any.
    memory
        What load steps had left behind at obstacles, at the displacement ``u``; shape (n,).

    Returns
    -------
    StaticResult

    Raises
    ------
    ConvergenceError
        If no strategy finds an equilibrium; the error says which were tried, and has the converged
        ``StaticResult`` of the highest load as ``state``.

    References
    ----------
    Magisano, Leonetti, Garcea: "How to improve efficiency and robustness of the Newton method in
    geometrically non-linear structural problem discretized via displacement-based finite
    elements", Computer Methods in Applied Mechanics and Engineering 313 (2017).
    """
    require_option("method", method, METHODS)
    require_flag("stable", stable)
    tol, min_step = require_positive("tol", tol), require_positive("min_step", min_step)
    if not 0.0 < require_positive("first_step", first_step) <= 1.0:
        raise InputError(f"first_step must lie in (0, 1], got {first_step!r}")
    max_iterations = require_integer("max_iterations", max_iterations, 1, MAX_ITERATIONS)
    if u is not None:
        u = require_finite("u", u, (system.N,))
    rules = Steps(method, tol, max_iterations, float(first_step), min_step)
    steps = 1.0 + max(0.0, np.log2(1.0 / first_step))  # each is twice as long as the one before
    with system.forces.contacts.lent(), expecting(ITERATIONS * steps):
        return Search(system, u, memory, rules, stable, progress).find()


class Search:
    """What strategies ask: the scene, where to start, and ways to look for an equilibrium.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u, memory
        The displacement to start from, shape (N,), and what is left behind there at obstacles,
        (n,); or None.
    steps
        Rules of the load steps, :class:`Steps`.
    stable, progress
        As for :func:`solve_static`.

    Attributes
    ----------
    held_by_loads : bool
        A rigid motion is free: only loads hold the scene, or obstacles.
    soft : bool
        The first correction of the mixed iteration was so large that the second had to do much
        more work than the loads: that of a slack rope.
    attempts : list of Attempt
        What has been tried.
    """

    def __init__(self, system: System, u: Array | None, memory: Array | None, steps: Steps,
                 stable: bool, progress: bool | None) -> None:
        self.system, self.rules, self.stable, self.progress = system, steps, stable, progress
        self.held_by_loads = bool(system.constraints.missing_supports)
        self.attempts: list[Attempt] = []
        self.soft = False
        self.furthest: StaticResult | None = None
        self.other: StaticResult | None = None
        self._folded: StaticResult | None = None
        self._failure: Exception | None = None
        self._spent, self._unstable = 0, False
        contacts = system.forces.contacts
        memory = contacts.begin(np.zeros(system.N) if u is None else u, 0.0 if u is None else 1.0,
                                memory)
        self.route = Route(np.zeros(system.N))
        if u is not None:
            missing = system.external_force(u) - system.internal_force(u)
            self.route = Route(u.copy(), missing * system.constraints.mask)
        self._memory = memory

    def find(self) -> StaticResult:
        """The first equilibrium that a strategy finds; raises ConvergenceError if none does."""
        for strategy in self._strategies():
            self._spent = 0
            try:
                result = strategy.run(self)
                if result is not None:
                    self._require_good(result)
            except KeyboardInterrupt:
                result = self.furthest or self._beginning(self.route)
                raise Interrupted(f"stopped at the load level {result.load:.6g}; the exception's "
                                  "state is what has converged", result) from None
            except _Failed as failure:
                self._note(strategy.name, str(failure))
                self._unstable = self._unstable or isinstance(failure, _Unstable)
                self._failure = failure
                continue
            if result is not None:
                self._note(strategy.name)
                return self._done(result)
        if self._folded is not None:
            return self._done(self._folded)
        if self.other is not None:
            self.other.doubt = self.other.doubt or (
                "of several stable equilibria this one may not be that to which the loads drive "
                "the scene")
            return self._done(self.other)
        raise self._lost()

    def _strategies(self):
        method = self.rules.method
        if method != "auto":
            return [Strategy(_NAMES[method], lambda search: search.load_steps(method))]
        return HELD_BY_LOADS if self.held_by_loads else STRATEGIES

    def _note(self, name, failure=""):
        self.attempts.append(Attempt(name, self._spent, failure))
        if failure:
            logger.info("%s: %s", self.attempts[-1], failure)

    def _done(self, result):
        result.converged, result.attempts = True, tuple(self.attempts)
        result.message = (f"converged in {len(result.steps)} load steps, {result.iterations} "
                          f"iterations, by {self.attempts[-1].strategy}")
        if len(self.attempts) > 1:
            result.message += f"; given up: {_listed(self.attempts[:-1])}"
        if result.doubt:
            result.message += f"; {result.doubt}"
        return result

    def _lost(self):
        """Why there is no solution beyond the last load step, as an error."""
        result = self.furthest or self._beginning(self.route)
        failure, load = self._failure, getattr(self._failure, "load", 1.0)
        text = (f"no equilibrium found beyond the load level {result.load:.6g}: {failure} at "
                f"{load:.6g}, and steps below {self.rules.min_step:g} are not tried. ")
        if self.rules.method == "auto":
            text += f"Tried: {_listed(self.attempts)}. "
        if isinstance(failure, _Unstable):
            text += ("No stable one was found either from there: stable=False takes the unstable "
                     "one, scene.continuation() follows the path")
        else:
            text += ("Beyond a limit point there is none: use scene.continuation(); else more "
                     "elements or a larger max_iterations may help")
        result.message, result.attempts = text, tuple(self.attempts)
        return ConvergenceError(text, result)

    # what strategies ask

    @property
    def at_once(self) -> bool:
        """True if the whole load may be tried in one step."""
        return self.rules.first_step == 1.0

    @property
    def pushed_at_rest(self) -> bool:
        """True if springs push the scene out of its place before any load."""
        force = self.system.internal_force(self.route.u, 0.0, 0.0)
        return self.route.proportional and bool(np.any(force * self.system.constraints.mask))

    @property
    def rubs(self) -> bool:
        """True if there is friction."""
        return bool(self.system.forces.contacts.anchored)

    @property
    def smaller_step(self) -> float:
        """The first load step where the whole load has been tried."""
        return 0.25 if self.at_once else self.rules.first_step

    @property
    def supports_move(self) -> bool:
        """True if supports have displacements, so that loads can be applied before these."""
        moves = self.system.constraints.moves or self.system.constraints.drives
        return self.route.proportional and moves

    def load_steps(self, method: str, route: Route | None = None,
                   start: StaticResult | None = None, **changes: Any) -> StaticResult:
        """The equilibrium at the end of a route.

        Parameters
        ----------
        method
            "mixed" or "newton".
        route, start
            The route, and the result it begins with; those of the search by default.
        **changes
            Of the rules of load steps.
        """
        rules = self.rules._replace(method=method, **changes)
        return self._load_steps(route or self.route, start, rules)

    def one_step(self, method: str, route: Route | None = None,
                 start: StaticResult | None = None) -> StaticResult:
        """As :meth:`load_steps`, at once or not at all.

        Parameters
        ----------
        method, route, start
            As there.
        """
        route = route or self.route
        options = self._options(route, method, watched=True)
        result, record = start or self._beginning(route), LoadStep(1.0, 0)
        try:
            with np.errstate(all="ignore"):  # what overflows is seen in the residual
                found = _step(self.system, result, 1.0, options, record, self._wanted(route))
            if self._elsewhere(route, found):
                self.other = self.other or self._followed(result, record, found, route)
                raise _Unstable("the equilibrium found lies on the other side", found)
        except _Soft:
            self.soft = True
            raise
        finally:
            self._spent += record.iterations
        return self._followed(result, record, found, route)

    def descent(self, method: str, eased: bool = False,
                route: Route | None = None) -> StaticResult:
        """The equilibrium that corrections of bounded size lead down to under the full load.

        Parameters
        ----------
        method
            "mixed" or "newton".
        eased
            First without friction; bodies stick from where they have come to rest.
        route
            Its end is where to; that of the search by default.
        """
        route, system = route or self.route, self.system
        if (not (system.symmetric or self.held_by_loads or self.rubs)
                and not stability.has_potential(system, route.u, 1.0)):
            raise _Failed("the loads have no potential")
        options, record = self._options(route, method), LoadStep(1.0, 0)
        result = self._beginning(route)
        most = min(stability.DESCENT, 7 * self.rules.max_iterations)

        def iterate(u, multipliers, descent):
            return _from((u, multipliers), system, result, 1.0, options._replace(most=most),
                         record, descent)

        descent, contacts = stability.Descent(system), system.forces.contacts
        try:
            with np.errstate(all="ignore"):
                if eased:
                    with contacts.eased():
                        found = iterate(result.u, result.multipliers, descent)
                else:
                    found = stability.descend(system, result, *route.acting(1.0), iterate, descent,
                                              _Failed)
                if contacts.obstacles:
                    found = self._firm(found, options, record, eased)
        except NO_FACTORS as error:
            raise _Failed("a tangent has no factors") from error
        finally:
            self._spent += record.iterations
        return self._followed(result, record, found, route)

    # how

    def _options(self, route, method, watched=False):
        watched = (watched and method == "mixed" and self.rules.method == "auto"
                   and not self.system.forces.contacts.obstacles)
        return Options(route, method, self.rules.tol, self.rules.max_iterations, watched)

    def _wanted(self, route):
        """Whether the end of a route has to be stable."""
        return self.stable and route.acting(1.0) == (1.0, 1.0)

    def _require_good(self, result):
        """Raise _Failed unless what is free is held, and no axis turns back within an element."""
        if self.held_by_loads and not stability.is_held(self.system, result.u, result.multipliers):
            raise _Failed("the loads do not hold what the supports leave free")
        if self.rules.method == "auto" and any(
                folded(b, result.u[self.system.of(b)]) for b in self.system.beams):
            again = self._folded is not None and np.allclose(
                result.u, self._folded.u, rtol=0.0, atol=1e-6 * self.system.size)
            self._folded = self._folded or result
            if not again:  # where two come to it the mesh is too coarse, which a warning says
                raise _Failed("the axis turns back within an element")

    def _elsewhere(self, route, found):
        """True if a strategy but the first comes to where the load does not drive the scene."""
        if (not (self.attempts and self.stable and route.proportional) or self.held_by_loads
                or self.system.forces.contacts.obstacles):
            return False
        return not stability.heads_on(self.system, self._beginning(route), found[0], 1.0)

    def _firm(self, found, options, record, eased):
        """What is found in contact: on obstacles that are hard enough."""
        system, one = self.system, LoadStep(1.0, 0)
        memory = system.forces.contacts.begin(found[0], 1.0) if eased else self._memory
        start = replace(self._beginning(self.route), u=found[0], multipliers=found[1],
                        memory=memory)
        full, at = options.route.acting(1.0)
        at_full = options._replace(route=Route(found[0], None, (full, full), (at, at)))
        try:
            return _step(system, start, 1.0, at_full, one, self.stable)
        finally:
            vars(record).update(vars(_both(record, one)))

    def _beginning(self, route):
        system = self.system
        return StaticResult(route.u.copy(), np.zeros(system.constraints.m), 0.0,
                            np.zeros(system.N), [], False, "no load step has converged",
                            memory=self._memory)

    def _followed(self, result, record, found, route):
        """The result after a load step."""
        contacts = self.system.forces.contacts
        u, multipliers, force = found
        contacts.settle(u, route.acting(record.load)[1])
        return result.followed_by(record, u=u, multipliers=multipliers, force=force,
                                  load=record.load, memory=contacts.remember())

    def _load_steps(self, route, result, rules):
        system, stable = self.system, self._wanted(route)
        result = result or self._beginning(route)
        step, cuts, spent = rules.first_step, 0, 0
        if step < self.rules.first_step:  # a strategy has tried what the step was cut from
            result.rejected, cuts = 1, int(self._unstable)
        options = self._options(route, rules.method, watched=rules.few)
        few = FEW * (3 if system.forces.contacts.obstacles else 1)  # contact takes its time
        with progress_bar(self.progress, total=1.0, desc="load") as bar:
            while result.load < 1.0:
                load = min(1.0, result.load + step)
                if load > 1.0 - 1e-12:
                    load = 1.0
                record = LoadStep(load, 0)
                try:
                    with np.errstate(all="ignore"):  # what overflows is seen in the residual
                        found = _step(system, result, load, options, record, stable)
                except _Failed as failure:
                    result.rejected += 1
                    cuts += isinstance(failure, _Unstable)
                    logger.info("load %.6g failed (%s), step cut", load, failure)
                    step = 0.25 * (load - result.load)
                    found = None
                    many = rules.few and spent + record.iterations >= few
                    if stable and (cuts > stability.CUTS or step < rules.min_step or many):
                        found = _rescue(system, result, load, options, record, failure)
                    spent += record.iterations
                    self._spent += record.iterations
                    if found is None:
                        none = rules.few and not result.steps and result.rejected > CUT
                        if step < rules.min_step or many or none:
                            failure.load = load
                            raise
                        continue
                    step *= 4.0
                else:
                    spent += record.iterations
                    self._spent += record.iterations
                bar.update(load - result.load)
                # one assignment: who interrupts finds the old result or the new one
                result = self._followed(result, record, found, route)
                self._keep(result, route)
                cuts = 0
                logger.info("load %.6g converged in %d iterations", load, record.iterations)
                if record.iterations <= max(8, rules.max_iterations // 3):
                    step *= 2.0
                if rules.few and spent >= few and result.load < 1.0 and not result.doubt:
                    raise _Failed(f"the full load was not reached in {spent} iterations")
        return result

    def _keep(self, result, route):
        """The result of the highest load is what an error has."""
        if route is self.route and (self.furthest is None or result.load > self.furthest.load):
            self.furthest = result


_NAMES = {"mixed": "the mixed iteration", "newton": "Newton's method"}


def _listed(attempts):
    return ", ".join(map(str, attempts))


class _Failed(Exception):
    """A load step did not converge; the message says why.

    Attributes
    ----------
    load
        The load level that was tried.
    """

    load = 1.0


class _Astray(_Failed):
    """The first corrections of a load step did not get smaller."""


class _Soft(_Failed):
    """The second correction of the mixed iteration does far more work than the loads."""


class _Unstable(_Failed):
    """A load step ended at an unstable equilibrium, ``found``."""

    def __init__(self, message, found):
        super().__init__(message)
        self.found = found


def _step(system, result, load, options, record, stable):
    """One load step: a stable equilibrium if that is wanted."""
    full, at = _acting(options, load)
    found = _augmented(system, result, load, options, record, at)
    passed = system.forces.contacts.passed((result.u, _acting(options, result.load)[1]),
                                           (found[0], at))
    if passed:
        raise _Failed(passed)
    if not stable or result.unstable:
        return found
    if not stability.holds(system, found[0], full, found[1], at):
        raise _Unstable("the equilibrium found is unstable", found)
    if (result.rejected and options.route.proportional and result.load > 0.0
            and not stability.heads_on(system, result, found[0], load)):
        raise _Unstable("the equilibrium found lies on the other side", found)
    return found


def _augmented(system, result, load, options, record, at):
    """The equilibrium, again until obstacles that ask for it are entered no deeper than that."""
    contacts = system.forces.contacts
    contacts.put_back(result.memory)
    found = _touching(system, result, load, options, record)
    if not contacts.augmented:
        return found
    for _ in range(AUGMENTED):
        if contacts.augment(found[0], at) == 0:
            return found
        found = _from(found, system, result, load, options, record)
    raise _Failed(f"the penetration of obstacles is above its tolerance after {AUGMENTED} "
                  "corrections of the pressure")


def _touching(system, result, load, options, record):
    """The equilibrium; where there are obstacles, by :mod:`skfem_ancf.solvers.touching`."""
    contacts = system.forces.contacts
    if not contacts.obstacles:
        return _found(system, result, load, options, record)
    at = _acting(options, load)[1]

    def solve(start, rough):
        one, chosen = LoadStep(load, 0), options
        if rough:
            chosen = options._replace(tol=max(options.tol, NEAR), most=min(options.most, SOON))
        try:
            if start is None:
                return _found(system, result, load, chosen, one)
            return _from(start, system, result, load, chosen, one)
        finally:
            vars(record).update(vars(_both(record, one)))

    return found_touching(contacts, (result.u, _acting(options, result.load)[1]), at, solve,
                          lambda u: system.strain_energy(u, at), _Failed)


def _both(first, then):
    """The records of two iterations of a load step as one."""
    return LoadStep(then.load, first.iterations + then.iterations,
                    first.force_residuals + then.force_residuals,
                    first.energy_residuals + then.energy_residuals)


def _found(system, result, load, options, record):
    """The equilibrium; where a law is left behind on the way, from that of its first moduli.

    A correction that turns the beam far strains it for once, more than a law may bear that others
    than Hooke's are; the equilibrium that Hooke's finds is close to theirs.
    """
    machine = None if result.astray else system.machine.linearised
    if machine is None:
        return _iterate(system, result, load, options, record)
    try:
        return _iterate(system, result, load, options, record, wary=True)
    except _Failed as failed:
        failure = failed
    try:
        close = _iterate(system, result, load, options._replace(tol=max(options.tol, NEAR)),
                         record, machine=machine)
        return _from(close, system, result, load, options, record)
    except _Failed:
        result.astray = True
    if isinstance(failure, _Astray):
        return _iterate(system, result, load, options, record)
    raise failure


def _from(found, system, result, load, options, record, descent=None):
    """Iterate on from what has been found; the record takes both."""
    one = LoadStep(load, 0)
    try:
        return _iterate(system, replace(result, u=found[0], multipliers=found[1]), load, options,
                        one, descent)
    finally:
        vars(record).update(vars(_both(record, one)))


def _acting(options, load):
    """Load factor and time at a level."""
    return options.route.acting(load)


def _rescue(system, result, load, options, record, failure):
    """What :func:`_step` returns, from where the path has lost its stability; or None."""
    full, at = _acting(options, load)
    at_rest = isinstance(failure, _Unstable) and options.route.gap is None and not result.steps
    if at_rest and (weak := stability.weak_at_rest(system)):
        raise ConvergenceError(weak, result)
    if not isinstance(failure, _Unstable) and not stability.gives_way(system, result, load):
        return None
    if not stability.has_potential(system, result.u, full):
        if not isinstance(failure, _Unstable):
            return None
        result.unstable = True
        result.doubt = (f"the path is unstable from the load level {load:.6g} on, and its loads "
                        "have no potential that would lead to a stable equilibrium")
        return failure.found
    options = options._replace(most=stability.DESCENT, watched=False)

    def iterate(u, multipliers, descent):
        return _from((u, multipliers), system, result, load, options, record, descent)

    with np.errstate(all="ignore"):
        found, turned = stability.way_down(system, result, load, full, at,
                                           options.route.proportional, iterate, _Failed)
    if turned and not result.doubt:
        result.doubt = (
            f"the path loses its stability between the load levels {result.load:.6g} and "
            f"{load:.6g}, the solution went on along the direction that gives way to a stable "
            "equilibrium, which need not be the only one")
    return found


def _iterate(system, result, load, options, record, descent=None, machine=None, wary=False):
    """Iterate to equilibrium at one load; returns displacement, multipliers, internal force.

    With a ``machine`` it is that of other laws.
    """
    max_iterations = options.most
    machine = machine or system.machine
    tables = machine.tables
    target = _target(system, result, load, options.route)
    rules = rules_of(system, options.method, options.tol, max_iterations,
                     FIRST if wary else WATCHED if options.watched and descent is None else 0)
    room, solver = machine.room(room_for_iterations, system.constraints.m), None
    if descent is not None:
        solver = descent
    elif tables.plain.border.wide:
        solver = system
    while True:
        if solver is not None:
            rules = rules._replace(solver=handle_of(solver))
        x = Unknowns(result.u.copy(), result.multipliers.copy(), np.empty(system.N),
                     tables.stresses, tables.stresses)
        residuals = np.zeros((max_iterations + 1, 2))
        status, n = machine.of(equilibrium)(target, rules, x, room, residuals)
        if status != SINGULAR or solver is not None:
            break
        solver = system  # factors with exchanges of rows, or sparse ones
    record.iterations = n
    record.force_residuals = residuals[:n + 1, 0].tolist()
    record.energy_residuals = residuals[:n, 1].tolist()
    if status == NOT_CONVERGED and n < max_iterations:
        if rules.wary == WATCHED and n == 2:
            raise _Soft("the first correction stretches it far beyond its place")
        raise _Astray("the first corrections do not get smaller" if wary else
                      f"the corrections do not get smaller in {n} iterations")
    if status != CONVERGED:
        raise _Failed(_ENDS[status].format(max_iterations))
    if system.inverted(x.u):
        raise _Failed("the body is turned inside out")
    if system.constraints.lost(x.u):
        raise _Failed(system.constraints.lost(x.u))
    if solver is None:
        if n:
            system.take_factors(room.factors)
        else:
            system.K.clear()
    return x.u, x.multipliers, x.force


def rules_of(system: System, method: str, tol: float, max_iterations: int,
             wary: int = 0) -> Rules:
    """When an iteration of a system has converged.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    method, tol, max_iterations
        As for :func:`solve_static`.
    wary
        When it ends because corrections do not get smaller, as in
        :class:`~skfem_ancf.solvers.iteration.Rules`.
    """
    floor = 8.0 * system.work_noise
    # the residual sums the noise of all coordinates, the work that of the strains
    return Rules(int(method == "mixed"), max_iterations, tol, floor, floor * system.noise,
                 INACCURATE, 0, wary)


_ENDS = {SINGULAR: "the tangent is singular", NOT_FINITE: "the strain is not finite",
         NOT_CONVERGED: "no convergence in {} iterations"}


def _target(system, result, load, route):
    """The Target of a load level."""
    tables, gap = system.machine.tables, route.gap
    full, at = route.acting(load)
    values = system.constraints.values(at)
    if gap is None:
        gap = np.zeros(system.N)
    else:
        begin = route.u[system.constraints.fixed]
        values = begin + load * (values - begin)
        gap = (1.0 - load) * gap
    before = route.acting(result.load)[0]
    factors = tables.static_factors(full)
    return Target(factors, tables.static_factors(full, before) if tables.prestressed else factors,
                  full, at, *tables.at(at), gap, values - result.u[system.constraints.fixed])
