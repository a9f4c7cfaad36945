"""Static equilibrium: strategies, and load steps."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..beam import bent
from ..core import (NO_FACTORS, AncfError, Array, ConvergenceError, InputError, Interrupted,
                    cached_property, progress_bar, require_finite, require_flag, require_integer,
                    require_option, require_positive)
from ..equations import stability
from ..equations.system import System
from . import strategies
from .continuation import continuation
from .increment import Increment, Options, Route
from .iteration import (Attempt, FirstStepTooLarge, LoadStepFailed, StaticResult, UnboundedMotion,
                      Unstable)

logger = logging.getLogger(__name__)

#: Number of iterations of load steps, of which one fails then, before the next strategy.
FEW = 150
#: Largest number of iterations of all strategies for the whole load, in scenes with obstacles.
MOST = 1000
#: Largest number of iterations of a user-defined energy's equilibrium close to the reference
#: configuration: beyond a pole of the energy there are others.
SURE = 6
#: Rotation of an axis of degree 7 or less over one element, in radians, that is tried again:
#: round-off may be its reason.
FOLDED = 2.5
#: Methods and their names; "auto" tries several strategies, the others are a single iteration.
METHODS = {"mixed": "the mixed iteration", "newton": "Newton's method", "auto": ""}


class Steps(NamedTuple):
    """Options of load steps, see :func:`solve_static`."""

    method: str
    tol: float
    max_iterations: int
    first_step: float
    min_step: float


def solve_static(system: System, u: Array | None = None, method: str = "auto", tol: float = 1e-8,
                 max_iterations: int = 30, first_step: float = 1.0, min_step: float = 1e-4,
                 progress: bool | None = None, stable: bool = True,
                 memory: Array | None = None) -> StaticResult:
    """Find the equilibrium at full load.

    By default several strategies are tried in order, first the mixed iteration in one step, until
    one finds a stable equilibrium; the message of the result says which. ``method="mixed"`` and
    ``method="newton"`` use one iteration and load steps: the first is ``first_step`` of the load, a
    failed step is cut to a quarter, an easy step doubles the next. When an iteration has converged
    is said by :mod:`skfem_ancf.equations.convergence`. See Magisano, Leonetti, Garcea: "How to
    improve efficiency and robustness of the Newton method in geometrically non-linear structural
    problem discretized via displacement-based finite elements", Computer Methods in Applied
    Mechanics and Engineering 313 (2017).

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u
        Initial displacement, shape (N,); the reference configuration by default. Load steps reduce
        its residual under full load to zero.
    method
        "auto": the strategies in order. "mixed": the geometric stiffness uses an independent
        stress, which is updated by linearisation. "newton": it uses the stress of the strain. All
        have the same solution.
    tol
        Relative error in the energy norm.
    max_iterations
        Iterations before a step is cut.
    first_step, min_step
        Fractions of the load. A ``first_step`` below 1 skips the strategies that apply the whole
        load at once.
    progress
        Show a progress bar: True, False, or None for long runs only.
    stable
        Reject unstable equilibria: a step that ends at one is cut, and where the path itself
        becomes unstable, the solution follows the unstable direction, see
        :func:`~skfem_ancf.solvers.strategies.descend`. False accepts any equilibrium.
    memory
        Contact history at ``u``, shape (n,).

    Raises
    ------
    ConvergenceError
        If no strategy finds an equilibrium. The error lists those tried; its ``state`` is the
        converged ``StaticResult`` of the highest load.
    """
    require_option("method", method, METHODS)
    require_flag("stable", stable)
    tol, min_step = require_positive("tol", tol), require_positive("min_step", min_step)
    if not 0.0 < require_positive("first_step", first_step) <= 1.0:
        raise InputError(f"first_step must lie in (0, 1], got {first_step!r}")
    max_iterations = require_integer("max_iterations", max_iterations, 1, 10000)
    if u is not None:
        u = require_finite("u", u, (system.N,))
    rules = Steps(method, tol, max_iterations, float(first_step), min_step)
    if memory is None:
        start = (np.zeros(system.N), 0.0) if u is None else (u, 1.0)
        system.forces.contacts.require_clear(*start)
    return Search(system, u, memory, rules, stable, progress).find()


class Search:
    """The search for an equilibrium: initial state, options, and its strategies. ``u`` (N,) and
    ``memory`` (n,) are initial displacement and history, or None; ``rules`` the options of load
    steps; ``span`` the time that passes for materials. ``stabilised_by_loads`` is True if the
    supports leave a rigid motion free, so that only loads or obstacles stabilise the scene;
    ``touches`` if there are obstacles, or members that may touch. ``attempts`` lists the strategies
    tried."""

    #: The first correction of the mixed iteration was far too large, as for a slack rope.
    _too_large = False
    _loose = ""  # an unstabilised motion in words
    _furthest: StaticResult | None = None
    _folded: StaticResult | None = None
    _failure: Exception | None = None
    _spent, _unstabilised, _unstable, _touched = 0, 0, False, True

    def __init__(self, system: System, u: Array | None, memory: Array | None, rules: Steps,
                 stable: bool, progress: bool | None, span: float = 0.0) -> None:
        if memory is not None or span or system.forces.contacts.anchored:
            system = system.after(memory, span)
        self.system = system
        self.rules, self.stable, self.progress, self._span = rules, stable, progress, span
        contacts, clock = system.forces.contacts, system.clock
        self.stabilised_by_loads = bool(system.constraints.missing_supports)
        self.touches = self.bounded = bool(contacts.obstacles or system.forces.changing)
        self._has_friction = bool(contacts.anchored)
        self._auto, self._at_once = rules.method == "auto", rules.first_step == 1.0
        self.attempts: list[Attempt] = []
        times = (0.0, 1.0) if clock is None else (clock, clock)
        memory = system.histories.begin(np.zeros(system.N) if u is None else u,
                                        times[u is not None], memory is None)
        self._start, self._times, self._memory = u, times, memory
        if contacts.keeps and not (contacts.obstacles and u is not None and contacts.untouched(u)):
            _ = self.route  # with the contact history of the start

    @cached_property
    def route(self) -> Route:
        """The whole load; from a displacement that is given, the way to reduce its residual."""
        system, u = self.system, self._start
        if u is None:
            return Route(np.zeros(system.N), times=self._times, span=self._span)
        missing = system.external_force(u) - system.internal_force(u)
        return Route(u.copy(), missing * system.constraints.mask, times=self._times,
                     span=self._span)

    def find(self) -> StaticResult:
        """The first equilibrium that a strategy finds; raises ConvergenceError if none does."""
        found = strategies.solved_without_contact(self.system, self.route.u, self._memory,
                                                  self._free)
        if found is not None:
            return found
        for name, solve in self._strategies():
            self._spent = 0
            try:
                result = solve()
                self._require_good(result)
            except KeyboardInterrupt:
                result = self._furthest or self._beginning(self.route)
                raise Interrupted(f"stopped at the load level {result.load:.6g}; the exception's "
                                  "state is what has converged", result) from None
            except LoadStepFailed as failure:
                self._note(name, str(failure))
                self._unstable = self._unstable or isinstance(failure, Unstable)
                # that of load steps along the path says more
                if name not in ("descent", METHODS["newton"]) or self._failure is None:
                    self._failure = failure
                if self._exhausted or isinstance(failure, UnboundedMotion):
                    break
                # without friction others would be as loose as the first two
                if self._unstabilised == 2 and not self._has_friction:
                    break
                continue
            self._note(name)
            return self._done(result)
        if self._folded is not None:
            return self._done(self._folded)
        raise self._lost()

    def _free(self, system):
        """The equilibrium of the scene without contact of members."""
        other = Search(system, self._start, self._memory, self.rules, self.stable, self.progress,
                       self._span)
        other.bounded = True
        return other.find()

    def _strategies(self) -> Iterator[tuple[str, Callable[[], StaticResult]]]:
        """Names and functions of strategies, in order; what applies depends on those before."""
        rules, system, at_once = self.rules, self.system, self._at_once
        if not self._auto:
            yield METHODS[rules.method], partial(self.load_steps, rules.method)
            return
        if at_once and not self.stabilised_by_loads:
            yield METHODS["mixed"], partial(self.one_step, "mixed")
            # The first correction of a slack rope is far too large. The stress of the strain
            # corrects that, the independent stress does not.
            if self._too_large:
                yield METHODS["newton"], partial(self.one_step, "newton")
        # if contacts open and close, a descent needs fewer corrections than load steps; the tangent
        # at rest is singular if only loads stabilise, and springs that push make steps no smaller
        early = self.stabilised_by_loads or at_once and self.touches and self._touched or (
            self.route.proportional and bool(np.any(
                system.internal_force(self.route.u, 0.0, 0.0) * system.constraints.mask)))
        if early and self.stable:
            yield "descent", self.descent
        # the last one may take as many iterations as it needs; what yields may need many steps
        few = not system.histories.path_dependent and (
            self.stabilised_by_loads or self.stable and not early)
        yield "smaller load steps", partial(self.load_steps, "mixed", few)
        if self.stable and not early:
            yield "descent", self.descent
            if few and system.clock is None:  # increments of a run are cut instead
                yield "load steps as small as may be", partial(self.load_steps, "mixed")
        if not self.touches and system.clock is None:
            # without an independent stress it may jump where the path of loads without a potential
            # ends
            yield METHODS["newton"], partial(self.load_steps, "newton", True)

    def _note(self, name, failure=""):
        self.attempts.append(Attempt(name, self._spent, failure))
        self._spent = 0
        if failure:
            logger.info("%s: %s", self.attempts[-1], failure)

    def _done(self, result):
        """The result with its message."""
        # If it was not found easily, the path from the reference configuration is followed: has the
        # load a maximum below 1?
        system, loads, n = self.system, [0.0], result.iterations
        if (not result.doubt and (len(self.attempts) > 1 or (n > SURE and any(
                hasattr(load, "psi") for load in system.loads)))
                and self._auto and self.stable and self.route.proportional
                and not (self.stabilised_by_loads or self.touches) and system.clock is None):

            def turned(point: Any) -> bool:
                loads.append(point.load)
                return point.load < loads[-2] or point.stable is False

            try:
                _, critical = continuation(system, 100, max_load=1.0, until=turned, locate=1e-6,
                                           progress=False)
            except (AncfError, *NO_FACTORS):
                critical = []
            for point in critical:
                if 0.0 < point.load < 1.0 and not result.doubt:
                    result.doubt = (
                        f"the path from the reference configuration has a {point.kind} point at "
                        f"the load level {point.load:.4g}; the equilibrium found lies beyond it, "
                        "and need not be the only one")
        result.converged, result.attempts = True, tuple(self.attempts)
        result.message = (f"converged in {len(result.steps)} load steps, {n} iterations, by "
                          f"{self.attempts[-1].strategy}")
        if len(self.attempts) > 1:
            result.message += f"; given up: {_listed(self.attempts[:-1])}"
        if result.doubt:
            result.message += f"; {result.doubt}"
        return result

    def _lost(self):
        """The ConvergenceError of a search that failed."""
        result = self._furthest or self._beginning(self.route)
        failure, load = self._failure, getattr(self._failure, "load", 1.0)
        text = (f"no equilibrium found beyond the load level {result.load:.6g}: {failure} at "
                f"{load:.6g}; the smallest step is {self.rules.min_step:g}. ")
        if self._auto:
            text += f"Tried: {_listed(self.attempts)}. "
        if self.stabilised_by_loads:
            text = (f"{self.system.constraints.missing_supports}. No stable equilibrium was found "
                    "in which the loads hold what is free")
            if self._loose:
                text += f": nothing holds {self._loose}"
            if self.touches and not self._has_friction:
                text += (". Obstacles without friction hold nothing along their surface: friction= "
                         "does")
            text += f". Tried: {_listed(self.attempts)}"
        elif isinstance(failure, Unstable):
            text += ("No stable equilibrium was found from there: stable=False accepts the "
                     "unstable one, scene.continuation() follows the path")
        elif self.touches:
            text += ("Around obstacles the way matters: use scene.run(), which takes it in small "
                     "increments; or a larger max_iterations")
        else:
            text += ("Beyond a limit point there is none: use scene.continuation(). Otherwise more "
                     "elements or a larger max_iterations may help, or scene.run() with loads and "
                     "supports that grow in another order")
        result.message, result.attempts = text, tuple(self.attempts)
        return ConvergenceError(text, result)

    @property
    def _exhausted(self):
        """True if all strategies together have reached :data:`MOST`."""
        spent = self._spent + sum(attempt.iterations for attempt in self.attempts)
        return self.bounded and self._at_once and self._auto and spent >= MOST

    # strategies

    def at_rest(self) -> StaticResult:
        """The initial displacement, if it is an equilibrium; raises LoadStepFailed."""
        result = self._beginning(self.route)
        step = Increment(self.system, result, 1.0, self._options(self.route, "mixed")._replace(
            most=0))
        with np.errstate(all="ignore"):  # overflow shows in the residual
            return step.reached(step.resting() or step.iterate())

    def one_step(self, method: str) -> StaticResult:
        """The equilibrium at full load in one step."""
        route, result = self.route, self._beginning(self.route)
        options = self._options(route, method, watched=True)
        if self.touches and self.stable:  # a descent follows
            options = options._replace(patience=strategies.MOST_FROM_SOFT)
        step = Increment(self.system, result, 1.0, options)
        try:
            found = step.solve(self.stable)
        except FirstStepTooLarge:
            self._too_large = True
            raise
        finally:
            self._spent += step.record.iterations
            self._touched = step.touched or bool(self.system.forces.contacts.obstacles)
        return step.reached(found)

    def descent(self, most: int = strategies.DESCENT, route: Route | None = None) -> StaticResult:
        """The equilibrium at the end of a route by descents of ``most`` iterations."""
        # They go to minima of the potential, by a trust-region method. Loads act before supports
        # move: a chain sags to the side of its weight before its ends approach.
        system, constraints, before = self.system, self.system.constraints, []
        if route is None:
            route = self.route
            if (route.proportional and (constraints.moves or constraints.drives)
                    and (self.stabilised_by_loads or not self.touches)):
                loaded = self.descent(most, route._replace(times=(0.0, 0.0)))
                route, before = route._replace(u=loaded.u, loads=(1.0, 1.0)), loaded.steps
        result = replace(self._beginning(route), steps=before)
        options = self._options(route, "mixed")
        step = Increment(system, result, 1.0, options)
        system = step.system
        if (not (system.symmetric or self.stabilised_by_loads or self._has_friction)
                and not stability.has_potential(system, route.u, 1.0)):
            raise LoadStepFailed("the loads have no potential")
        down, far = strategies.Descent(system), options._replace(
            most=min(most, strategies.SHORTER * self.rules.max_iterations))
        # descents start where obstacles have moved to
        times = (route.load_and_time(level)[1] for level in (0.0, 1.0))
        if passed := system.forces.passed(*((result.u, t) for t in times)):
            raise LoadStepFailed(passed)

        try:
            with np.errstate(all="ignore"):
                found = strategies.descend(step, far, down)
                if system.forces.contacts.obstacles:
                    found = self._with_stiff_contact(found, step)
        except NO_FACTORS as error:
            raise LoadStepFailed("a tangent has no factors") from error
        except LoadStepFailed as failure:
            away = down.onward() if self.stabilised_by_loads else None
            if away is None:
                raise
            self._loose = stability.motion_in_words(system, *away)
            raise UnboundedMotion(f"{failure}, and the scene goes on") from None
        finally:
            self._spent += step.record.iterations
        return step.reached(found)

    # implementation

    def _options(self, route, method, watched=False):
        watched = watched and method == "mixed" and self._auto and not self.touches
        return Options(route, method, self.rules.tol, self.rules.max_iterations, watched)

    def _require_good(self, result):
        """Raise LoadStepFailed if a rigid motion is not stabilised, or an axis is folded."""
        system = self.system
        if self.stabilised_by_loads and not stability.is_stabilised(
                system.after(result.memory), result.u, result.multipliers):
            self._loose, self._unstabilised = "", self._unstabilised + 1
            try:  # from the last factors
                value, v = strategies.Descent(system).extreme("SA")
                if value < 0.0:
                    self._loose = stability.motion_in_words(system, result.u, v)
            except NO_FACTORS:
                pass
            raise LoadStepFailed("the loads do not hold what the supports leave free" + (
                f": nothing holds {self._loose}" if self._loose else ""))
        if not self._auto or result.seen:
            return
        bends = [bent(beam, result.u[s]) for beam, s in zip(system.beams, system.slices)]
        if any(folded or (turn > FOLDED and beam.element.axis_degree <= 7)
               for beam, (turn, folded) in zip(system.beams, bends)):
            again = self._folded is not None and np.allclose(
                result.u, self._folded.u, rtol=0.0, atol=1e-6 * system.size)
            self._folded = self._folded or result
            if not again:  # if two strategies find it, the mesh is too coarse: a warning says so
                raise LoadStepFailed("the axis folds back within an element")

    def _with_stiff_contact(self, found, step):
        """Solve again, with contact that is stiff enough."""
        start = replace(self._beginning(self.route), u=found.u, multipliers=found.multipliers)
        loads, times = ((x, x) for x in step.options.route.load_and_time(1.0))
        again = Increment(self.system, start, 1.0, step.options._replace(
            route=Route(found.u, None, loads, times, step.options.route.span), close=True))
        again.record, step.system = step.record, again.system  # with its pressures
        return again.solve(self.stable)

    def _beginning(self, route):
        return StaticResult(route.u, np.zeros(self.system.constraints.m), 0.0, None, [], False,
                            "no load step has converged", memory=self._memory)

    def load_steps(self, method: str, few: bool = False) -> StaticResult:
        """The equilibrium at full load by load steps."""
        # With ``few``, they stop after :data:`FEW` iterations.
        rules, route, stable, spent = self.rules, self.route, self.stable, 0
        result, size, cuts = self._beginning(route), rules.first_step, 0
        if self._auto and self._at_once:  # a strategy has tried the larger step
            size, result.rejected, cuts = 0.25, 1, int(self._unstable)
        options = self._options(route, method, watched=few)
        patience = 3 if self.touches else 1
        with progress_bar(self.progress, total=1.0, desc="load") as bar:
            while result.load < 1.0:
                load = min(1.0, result.load + size)
                if load > 1.0 - 1e-12:
                    load = 1.0
                step = Increment(self.system, result, load, options)
                try:
                    found = step.solve(stable)
                except LoadStepFailed as failure:
                    result.rejected += 1
                    cuts += isinstance(failure, Unstable)
                    logger.info("load %.6g failed (%s), step cut", load, failure)
                    size, found = 0.25 * (load - result.load), None
                    many = few and spent + step.record.iterations >= FEW * patience
                    # so many cuts at unstable points show that the path is unstable
                    if stable and (cuts > 3 or size < rules.min_step or many):
                        found = step.rescue(failure)
                    if found is None and (size < rules.min_step or many or self._exhausted):
                        failure.load = load
                        raise
                finally:
                    spent += step.record.iterations
                    self._spent += step.record.iterations
                if found is None:
                    continue
                size = load - result.load
                bar.update(size)
                # one assignment, so that an interrupt finds the old or the new result
                result = step.reached(found)
                if self._furthest is None or result.load > self._furthest.load:
                    self._furthest = result  # for errors
                cuts = 0
                logger.info("load %.6g converged in %d iterations", load, step.record.iterations)
                if step.record.iterations <= patience * max(8, rules.max_iterations // 3):
                    size *= 2.0
                if result.load < 1.0 and self._exhausted:
                    raise LoadStepFailed(f"the full load was not reached in {spent} iterations")
        return result


def _listed(attempts):
    return ", ".join(map(str, attempts))
