"""Statics: the strategies in order, and the load steps that they are made of."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import (ConvergenceError, InputError, Interrupted, require_finite, require_flag,
                           require_integer, require_option, require_positive)
from ..core.linalg import NO_FACTORS
from ..core.progress import progress_bar
from ..core.switch import expecting
from ..core.types import Array
from ..equations import stability
from ..equations.system import System
from . import descent
from .increment import Increment, Options, Route
from .outcome import Attempt, Equilibrium, Soft, StaticResult, StepFailed, Unstable
from .strategies import HELD_BY_LOADS, STRATEGIES, Strategy

logger = logging.getLogger(__name__)

#: Iterations in a load step that are expected, about, and at most.
ITERATIONS = 10
MAX_ITERATIONS = 10000
#: Iterations of load steps before the next strategy has its turn, and steps that are cut at the
#: begin before.
FEW, CUT = 60, 3
#: Equilibria found that nothing holds, after which without friction no further one is looked for.
UNHELD = 2
#: "auto" tries the strategies of :mod:`skfem_ancf.solvers.strategies`, the others one iteration.
METHODS = ("mixed", "newton", "auto")
_NAMES = {"mixed": "the mixed iteration", "newton": "Newton's method"}


class Steps(NamedTuple):
    """Rules of load steps, as for :func:`solve_static`.

    ``few``: they are given up after :data:`FEW` iterations, or where the first :data:`CUT` fail.
    """

    method: str
    tol: float
    max_iterations: int
    first_step: float
    min_step: float
    few: bool = False


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
        Displacement to start from, shape (N,); the reference configuration by default. Load steps
        lead from it to the equilibrium under the full load, whatever holds it in its place.
    method
        "auto": the strategies in order. "mixed": the geometric part of the tangent uses an
        independent stress, which follows its linearisation. "newton": it uses the stress of the
        strain. The solution is the same.
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
        :func:`~skfem_ancf.solvers.descent.descend`. False takes any.
    memory
        What load steps had left behind at obstacles, at the displacement ``u``; shape (n,).

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

    ``u`` and ``memory`` are the displacement to start from, (N,), and what is left behind there at
    obstacles, (n,), or None; ``steps`` are rules of load steps.

    Attributes
    ----------
    held_by_loads : bool
        A rigid motion is free: only loads hold the scene, or obstacles.
    soft : bool
        The first correction of the mixed iteration was so large that the second had to do much
        more work than the loads: that of a slack rope.
    attempts : list of Attempt
        What has been tried.
    loose : str
        What nothing holds at an equilibrium that was found, in words.
    """

    def __init__(self, system: System, u: Array | None, memory: Array | None, steps: Steps,
                 stable: bool, progress: bool | None) -> None:
        self.system, self.rules, self.stable, self.progress = system, steps, stable, progress
        self.held_by_loads = bool(system.constraints.missing_supports)
        self.attempts: list[Attempt] = []
        self.soft, self.loose = False, ""
        self.furthest: StaticResult | None = None
        self.other: StaticResult | None = None
        self._folded: StaticResult | None = None
        self._failure: Exception | None = None
        self._spent, self._unheld, self._unstable = 0, 0, False
        contacts, clock = system.forces.contacts, system.clock
        times = (0.0, 1.0) if clock is None else (clock, clock)
        memory = contacts.begin(np.zeros(system.N) if u is None else u, times[u is not None],
                                memory)
        self.route = Route(np.zeros(system.N), times=times)
        if u is not None:
            missing = system.external_force(u) - system.internal_force(u)
            self.route = Route(u.copy(), missing * system.constraints.mask, times=times)
        self._memory = memory

    def find(self) -> StaticResult:
        """The first equilibrium that a strategy finds; raises ConvergenceError if none does."""
        for strategy in self._strategies():
            self._spent = 0
            try:
                result = strategy.run(self)
                if result:
                    self._require_good(result)
            except KeyboardInterrupt:
                result = self.furthest or self._beginning(self.route)
                raise Interrupted(f"stopped at the load level {result.load:.6g}; the exception's "
                                  "state is what has converged", result) from None
            except StepFailed as failure:
                self._note(strategy.name, str(failure))
                self._unstable = self._unstable or isinstance(failure, Unstable)
                self._failure = failure
                if self._unheld == UNHELD and not self.rubs:
                    break
                continue
            if result:
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
        if self.held_by_loads:
            text = f"{self._missing()}. Tried: {_listed(self.attempts)}"
        elif isinstance(failure, Unstable):
            text += ("No stable one was found either from there: stable=False takes the unstable "
                     "one, scene.continuation() follows the path")
        else:
            text += ("Beyond a limit point there is none: use scene.continuation(); else more "
                     "elements or a larger max_iterations may help")
        result.message, result.attempts = text, tuple(self.attempts)
        return ConvergenceError(text, result)

    def _missing(self):
        """What would hold a scene that neither supports nor loads do, in words."""
        text = self.system.constraints.missing_supports
        text += ". No stable equilibrium was found in which the loads hold what is free"
        if self.loose:
            text += f": at the one found nothing holds {self.loose}"
        if self.touches and not self.rubs:
            text += ". Obstacles without friction hold nothing along their surface: friction= does"
        return text

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
    def touches(self) -> bool:
        """True if there are obstacles."""
        return bool(self.system.forces.contacts.obstacles)

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

    def at_rest(self) -> StaticResult:
        """The displacement to start from, if it is an equilibrium; raises StepFailed."""
        result = self._beginning(self.route)
        step = Increment(self.system, result, 1.0, self._options(self.route, "mixed")._replace(
            most=0))
        return step.reached(step.iterate())

    def load_steps(self, method: str, route: Route | None = None,
                   start: StaticResult | None = None, **changes: Any) -> StaticResult:
        """The equilibrium at the end of a route, with ``changes`` of the rules of load steps."""
        rules = self.rules._replace(method=method, **changes)
        return self._load_steps(route or self.route, start, rules)

    def one_step(self, method: str, route: Route | None = None) -> StaticResult:
        """As :meth:`load_steps`, at once or not at all."""
        route = route or self.route
        result = self._beginning(route)
        step = Increment(self.system, result, 1.0, self._options(route, method, watched=True))
        try:
            with np.errstate(all="ignore"):  # what overflows is seen in the residual
                found = step.solve(self._wanted(route))
            if self._elsewhere(route, found):
                self.other = self.other or step.reached(found)
                raise Unstable("the equilibrium found lies on the other side", found)
        except Soft:
            self.soft = True
            raise
        finally:
            self._spent += step.record.iterations
        return step.reached(found)

    def descent(self, method: str, eased: bool = False, route: Route | None = None,
                most: int = descent.DESCENT) -> StaticResult:
        """The equilibrium that corrections of bounded size lead down to under the full load.

        ``eased``: first without friction; bodies stick from where they have come to rest.
        ``most``: iterations at most.
        """
        route, system = route or self.route, self.system
        if (not (system.symmetric or self.held_by_loads or self.rubs)
                and not stability.has_potential(system, route.u, 1.0)):
            raise StepFailed("the loads have no potential")
        result = self._beginning(route)
        options, contacts = self._options(route, method), system.forces.contacts
        step, down = Increment(system, result, 1.0, options), descent.Descent(system)
        far = options._replace(most=min(most, 7 * self.rules.max_iterations))

        contacts.put_back(self._memory)

        def iterate(begin: Any) -> Equilibrium:
            return step.iterate(begin, far, down)

        try:
            with np.errstate(all="ignore"):
                if eased:
                    with contacts.eased():
                        found = iterate((result.u, result.multipliers))
                else:
                    found = descent.descend(step, iterate, down)
                if contacts.obstacles:
                    found = self._firm(found, step, eased)
        except NO_FACTORS as error:
            raise StepFailed("a tangent has no factors") from error
        finally:
            self._spent += step.record.iterations
        return step.reached(found)

    # how

    def _options(self, route, method, watched=False):
        watched = (watched and method == "mixed" and self.rules.method == "auto"
                   and not self.touches)
        return Options(route, method, self.rules.tol, self.rules.max_iterations, watched)

    def _wanted(self, route):
        """Whether the end of a route has to be stable."""
        return self.stable and route.acting(1.0) == (1.0, self.route.times[1])

    def _require_good(self, result):
        """Raise StepFailed unless what is free is held, and no axis turns back in an element."""
        if self.held_by_loads and not stability.is_held(self.system, result.u, result.multipliers):
            self.loose, self._unheld = self._loose(result.u), self._unheld + 1
            raise StepFailed("the loads do not hold what the supports leave free" + (
                f": nothing holds {self.loose}" if self.loose else ""))
        if self.rules.method == "auto" and self.system.folded(result.u):
            again = self._folded is not None and np.allclose(
                result.u, self._folded.u, rtol=0.0, atol=1e-6 * self.system.size)
            self._folded = self._folded or result
            if not again:  # where two come to it the mesh is too coarse, which a warning says
                raise StepFailed("the axis turns back within an element")

    def _loose(self, u):
        """What is not held at an equilibrium, in words, by the factors that have told so."""
        try:
            directions = descent.Descent(self.system).directions(1)
        except NO_FACTORS:
            return ""
        return stability.motion_in_words(self.system, u, directions[0][0]) if directions else ""

    def _elsewhere(self, route, found):
        """True if a strategy but the first comes to where the load does not drive the scene."""
        if (not (self.attempts and self.stable and route.proportional) or self.held_by_loads
                or self.touches):
            return False
        return not descent.heads_on(self.system, self._beginning(route), found.u, 1.0)

    def _firm(self, found, step, eased):
        """What is found in contact: on obstacles that are hard enough."""
        memory = self._memory
        if eased:
            memory = self.system.forces.contacts.begin(found.u, self.route.times[1])
        start = replace(self._beginning(self.route), u=found.u, multipliers=found.multipliers,
                        memory=memory)
        loads, times = ((x, x) for x in step.options.route.acting(1.0))
        again = Increment(self.system, start, 1.0, step.options._replace(
            route=Route(found.u, None, loads, times), close=True))
        again.record = step.record
        return again.solve(self.stable)

    def _beginning(self, route):
        system = self.system
        return StaticResult(route.u.copy(), np.zeros(system.constraints.m), 0.0,
                            np.zeros(system.N), [], False, "no load step has converged",
                            memory=self._memory)

    def _load_steps(self, route, result, rules):
        stable = self._wanted(route)
        result = result or self._beginning(route)
        size, cuts, spent = rules.first_step, 0, 0
        if size < self.rules.first_step:  # a strategy has tried what the step was cut from
            result.rejected, cuts = 1, int(self._unstable)
        options = self._options(route, rules.method, watched=rules.few)
        patience = 3 if self.touches else 1  # contact takes its time
        with progress_bar(self.progress, total=1.0, desc="load") as bar:
            while result.load < 1.0:
                load = min(1.0, result.load + size)
                if load > 1.0 - 1e-12:
                    load = 1.0
                step = Increment(self.system, result, load, options)
                try:
                    with np.errstate(all="ignore"):  # what overflows is seen in the residual
                        found = step.solve(stable)
                except StepFailed as failure:
                    result.rejected += 1
                    cuts += isinstance(failure, Unstable)
                    logger.info("load %.6g failed (%s), step cut", load, failure)
                    size, found = 0.25 * (load - result.load), None
                    many = rules.few and spent + step.record.iterations >= FEW * patience
                    if stable and (cuts > descent.CUTS or size < rules.min_step or many):
                        found = step.rescue(failure)
                    none = rules.few and not result.steps and result.rejected > CUT
                    if found is None and (size < rules.min_step or many or none):
                        failure.load = load
                        raise
                finally:
                    spent += step.record.iterations
                    self._spent += step.record.iterations
                if found is None:
                    continue
                size = load - result.load
                bar.update(size)
                # one assignment: who interrupts finds the old result or the new one
                result = step.reached(found)
                if route is self.route and (self.furthest is None
                                            or result.load > self.furthest.load):
                    self.furthest = result  # what an error has
                cuts = 0
                logger.info("load %.6g converged in %d iterations", load, step.record.iterations)
                if step.record.iterations <= patience * max(8, rules.max_iterations // 3):
                    size *= 2.0
                if rules.few and spent >= FEW * patience and result.load < 1.0 and not result.doubt:
                    raise StepFailed(f"the full load was not reached in {spent} iterations")
        return result


def _listed(attempts):
    return ", ".join(map(str, attempts))
