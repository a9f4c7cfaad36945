"""One load increment."""

import logging
from typing import Any, NamedTuple

import numpy as np

from ..actions.contact.tables import AUGMENT, PASSED
from ..core import NO_FACTORS, Array, ConvergenceError
from ..equations import stability
from ..equations.convergence import BY_SECOND_OR_LATE, BY_THIRD, CLOSED, NEVER, joint_gap, rules_of
from ..equations.evaluation import DRAG, FORCE, GAP, MOVED, ROWS, U, Target
from ..equations.system import System
from . import strategies
from .continuation import Point, Tracer
from .iteration import (CONVERGED, DIVERGES, INDEFINITE, ITERATIONS, NOT_CONVERGED, SINGULAR,
                        Diverging, Equilibrium, FirstStepTooLarge, LoadStep, LoadStepFailed,
                        StaticResult, TooManyIterations, Unstable, equilibrium)

logger = logging.getLogger(__name__)

#: Largest number of pressure corrections (augmented Lagrangian) in a load step.
AUGMENTED = 50
#: Number of corrections after which they are too slow, and the obstacles are stiffened; by which
#: factor, and up to which.
SLOW, STIFFER, STIFFEST = 5, 10.0, 1e6


class Route(NamedTuple):
    """How loads and supports change with the level from 0 to 1. ``u`` (N,) is the displacement at
    level 0. With ``gap`` (N,), the residual there under full load is reduced to zero; otherwise
    ``loads`` and ``times`` are the load factor, and the time of supports and obstacles, at both
    levels. ``span`` is the time that passes for materials."""

    u: Array
    gap: Array | None = None
    loads: tuple[float, float] = (0.0, 1.0)
    times: tuple[float, float] = (0.0, 1.0)
    span: float = 0.0

    def load_and_time(self, level: float) -> tuple[float, float]:
        """Load factor and time at a level."""
        (a, b), (c, d) = self.loads, self.times
        if self.gap is not None:
            return 1.0, d
        return a + level * (b - a), c + level * (d - c)

    @property
    def proportional(self) -> bool:
        """True if loads and supports are proportional from the reference configuration."""
        return self.gap is None and self.loads == self.times == (0.0, 1.0)


class Options(NamedTuple):
    """Options of an iteration: method "mixed" or "newton", tolerance, largest number of iterations.
    If ``watched``, the iteration stops where the mixed method does not seem to converge. ``close``:
    the start is close to the equilibrium. ``drag`` (N,) is a force on each DOF per displacement in
    the increment, and ``guess`` (N,) a first displacement. ``rough`` is a larger tolerance where
    something may touch, ``patience`` the largest number of iterations once something may have."""

    route: Route
    method: str
    tol: float
    most: int
    watched: bool = False
    close: bool = False
    drag: Any = None
    guess: Any = None
    rough: float = 0.0
    patience: int | None = None


class Increment:
    """The step from the last equilibrium to a load level; ``record`` counts all iterations. Its
    ``system`` is that after the history of the last equilibrium. ``touched`` says whether anything
    may have touched in its iterations."""

    touched = False

    def __init__(self, system: System, start: StaticResult, level: float,
                 options: Options) -> None:
        self.system = system.recycled(start.memory, (level - start.load) * options.route.span)
        self.start, self.level, self.options = start, level, options
        self.load, self.time = options.route.load_and_time(level)
        self.record = LoadStep(level)

    @np.errstate(all="ignore")  # overflow shows in the residual
    def solve(self, stable: bool) -> Equilibrium:
        """The equilibrium, a stable one if requested; raises LoadStepFailed."""
        system, start, route = self.system, self.start, self.options.route
        contacts = system.forces.contacts
        found = (strategies.ContactSearch(self).find() if contacts.obstacles else
                 self.from_start(self.options))
        # Pressures are corrected until the penetration is within tolerance. Where the body alone is
        # unstable, as a buckled strip at a wall, this converges only if obstacles are stiffer than
        # it is unstable, see Bertsekas: "Constrained Optimization and Lagrange Multiplier Methods",
        # Academic Press 1982, 2.2.
        for _ in range(AUGMENTED):
            if not system.forces.corrected(found.u, self.time):
                break
            found = self.iterate(found)
        for k in range(1, AUGMENTED + 1):
            if not contacts.augmented or contacts.ask_all(AUGMENT, found.u, self.time) == 0.0:
                break
            if k % SLOW == 0:
                multipliers = [group.law.tolerance > 0.0 for _, group in contacts.groups]
                stiffening = np.where(multipliers, STIFFER, 1.0) * (
                    1.0 + contacts.stiffening) - 1.0
                contacts.stiffen(np.minimum(stiffening, STIFFEST), found.u, self.time)
            found = self.iterate(found)
        else:
            raise LoadStepFailed("the penetration of obstacles is above its tolerance after "
                                 f"{AUGMENTED} corrections of the pressure")
        passed = system.forces.passed((start.u, route.load_and_time(start.load)[1]),
                                      (found.u, self.time))
        if passed:
            raise LoadStepFailed(passed)
        if not stable or start.unstable:
            return found
        try:  # the last factors usually decide; else those of the tangent at the solution
            stays = system.solver.stays()
        except NO_FACTORS:
            stays = False
        if not stays and stability.verdict(system, found.u, self.load, found.multipliers,
                                           self.time).stability == "unstable":
            raise Unstable("the equilibrium found is unstable", found)
        if start.rejected and not self._heads_on(found.u):
            raise Unstable("the equilibrium found lies on the side away from the load", found)
        return found

    def _heads_on(self, u):
        """True if u lies on the side of the last equilibrium to which the load increment points."""
        # Close to a bifurcation an iteration may jump to the other side. The displacement is
        # compared with the tangent of the path of proportional loads.
        system, start = self.system, self.start
        if (not self.options.route.proportional or start.load == 0.0
                or system.forces.contacts.moving):  # the tangent has no motion of obstacles
            return True
        try:
            ahead = Tracer(system).set_tangent(Point(
                system, start.u, start.multipliers, start.load, start.u)).tangent
        except LoadStepFailed:
            return True
        return bool(ahead @ (stability.position_weights(system) * (u - start.u)) >= 0.0)

    def resting(self) -> Equilibrium | None:
        """The last equilibrium, if only round-off acts there; else None."""
        # As of a body in a turned scene that just touches an obstacle.
        system, (u, multipliers) = self.system, (self.start.u, self.start.multipliers)
        tables = system.backend.tables
        target, *_ = self._target(tables, u, system.solver)
        force = system.internal_force(u, self.time, self.load)
        missing = self.load * system.external_force(u) - force
        gap = joint_gap(system.constraints.constraint(u, self.load), tables.plain.joints.sizes)
        still = not target.moving and gap <= CLOSED
        rests = still and stability.is_nothing(system, missing)
        return Equilibrium(u, multipliers, force) if rests else None

    def reached(self, found: Equilibrium) -> StaticResult:
        """The result after the increment, with updated contact history."""
        start = self.start
        memory, lost = self.system.accept(start.u, found.u, self.load, self.time)
        if (drag := self.options.drag) is not None:
            lost += float(drag @ (found.u - start.u) ** 2)
        self.system.recycle()
        return StaticResult(**vars(start) | {
            "steps": [*start.steps, self.record], "load": self.level,
            "rubbed": start.rubbed + lost, "memory": memory, "u": found.u,
            "multipliers": found.multipliers, "force": found.force, "seen": found.seen})

    def from_start(self, options: Options) -> Equilibrium:
        """Iterate from the last equilibrium; if that fails, from the equilibrium of Hooke's law,
        which is close to the final one. A correction that turns a beam far strains it temporarily,
        possibly beyond the range of a nonlinear law. Of laws with a history it is far beyond yield:
        there Hooke's law comes first, except in the increments of a run, which are small."""
        system, start, failure, backend = self.system, self.start, None, None
        if not system.histories.path_dependent:
            backend = system.backend.linearised
        elif system.clock is None:
            backend = system.backend.after(system.backend.tables.elastic_from(start.u))
        if start.diverging or backend is None:
            return self.iterate(options=options)
        if not system.histories.path_dependent:
            try:
                return self.iterate(options=options, by_third=True)
            except LoadStepFailed as failed:
                failure = failed
        try:
            close = self.iterate(options=options._replace(tol=max(options.tol, strategies.CLOSE)),
                                 backend=backend)
            return self.iterate(close, options)
        except LoadStepFailed:
            start.diverging = True
        if failure is None or isinstance(failure, Diverging):
            return self.iterate(options=options)
        raise failure

    def iterate(self, begin: Any = None, options: Options | None = None, solver: Any = None,
                backend: Any = None, by_third: bool = False) -> Equilibrium:
        """Iterate to equilibrium from ``begin``, by default the last one; raises LoadStepFailed."""
        # ``solver`` solves the linear systems, such as a
        # :class:`~skfem_ancf.solvers.strategies.Descent`; ``backend`` is that of other laws;
        # ``by_third`` stops if the third correction is not smaller than the first.
        system, options = self.system, options or self.options
        u = self.start.u if options.guess is None else options.guess
        u, multipliers = (begin or (u, self.start.multipliers))[:2]
        backend, by, drag = backend or system.backend, solver or system.solver, options.drag
        give_up = BY_THIRD if by_third else (
            BY_SECOND_OR_LATE if options.watched and not solver else NEVER)
        rules = rules_of(system, options.method, options.tol, options.most, give_up,
                         options.rough, options.patience)
        tables = backend.tables
        target, factors, gap, moved = self._target(tables, u, by)
        looked = tables.plain.forces.clear[PASSED:PASSED + 1]
        c, g = tables.at(self.time)
        status, record = INDEFINITE, np.empty((2, rules.iterations + 1))
        try:
            while status == INDEFINITE:
                x, m = np.zeros((ROWS, system.N)), np.zeros((4, len(multipliers)))
                looked[:] = 0.0
                x[U], x[GAP], x[MOVED], x[DRAG] = u, gap, moved, 0.0 if drag is None else drag
                m[0], m[3] = multipliers, c
                run = backend.of(equilibrium, ITERATIONS, not target.definite)
                status, k, n, definite, seen = run(target, rules, factors, g, x, m, np.zeros(
                    (2, tables.stresses_size)), record)
                target = target._replace(definite=False)
        except (ConvergenceError, np.linalg.LinAlgError) as failure:  # of a law
            raise LoadStepFailed(str(failure)) from None
        if definite:
            backend.keep_factors()
            by.keep_band()
        self.touched, self.record.iterations = (
            self.touched or bool(looked.any()), self.record.iterations + n)
        self.record.force_residuals += record[0, :k].tolist()
        self.record.energy_residuals += record[1, :n].tolist()
        if status != CONVERGED:
            self._failed(status, n, rules, (x[U], m[0]))
        if system.inverted(x[U]):
            raise LoadStepFailed("an element is turned inside out")
        if lost := system.constraints.lost(x[U]):
            raise LoadStepFailed(lost)
        if n == 0:  # factorise the first tangent, if it is that of the solution
            solver = system.solver
            try:
                if (backend is not system.backend or tables.prestressed
                        or tables.plain.loads.custom):
                    solver.forget()
                else:
                    solver.factorize(x[U], target.at, m[0])
            except NO_FACTORS:
                solver.forget()
        return Equilibrium(x[U], m[0], x[FORCE], seen)

    def _target(self, tables, u, solver):
        """The Target of the level for a solver, load factors, residual that may remain, and
        prescribed changes of fixed DOFs."""
        system, route = self.system, self.options.route
        gap, clock, fixed = route.gap, system.clock, system.constraints.fixed
        values = system.constraints.values(self.time if clock is None else self.load, self.time)
        if gap is None:
            gap = 0.0
        else:
            begin = route.u[fixed]
            values = begin + self.level * (values - begin)
            gap = (1.0 - self.level) * gap
        if self.options.drag is not None:
            gap = gap - self.options.drag * self.start.u
        moved, changes = 0.0, values - u[fixed]
        if moving := bool(np.logical_or.reduce(changes)):
            moved = np.zeros(system.N)
            moved[fixed] = changes
        factors = first = tables.static_factors(self.load)
        if tables.prestressed:
            first = tables.static_factors(self.load, route.load_and_time(self.start.load)[0])
        if clock is not None:
            factors = first = self.load * tables.factors(np.array([clock]))[0]
        definite = solver is system.solver and system.symmetric and solver.at_times
        target = Target(self.load, np.nan if clock is None else clock, self.time, moving,
                        solver.handle, definite)
        return target, np.array([factors, first]), gap, moved

    def _failed(self, status, n, rules, reached):
        """Raise LoadStepFailed after n corrections."""
        if status == DIVERGES:
            if rules.give_up == BY_SECOND_OR_LATE and n == 2:
                raise FirstStepTooLarge("the first correction is far too large")
            raise Diverging("the first corrections do not decrease"
                            if rules.give_up == BY_THIRD else
                            f"the corrections do not decrease in {n} iterations")
        if status == NOT_CONVERGED:
            raise TooManyIterations(f"no convergence in {n} iterations", reached)
        raise LoadStepFailed("the tangent is singular" if status == SINGULAR else
                             "the strain is not finite")

    @np.errstate(all="ignore")  # overflow shows in the residual
    def rescue(self, failure: LoadStepFailed) -> Equilibrium | None:
        """A stable equilibrium if the path has lost its stability, else None."""
        system, start, route = self.system, self.start, self.options.route
        unstable = isinstance(failure, Unstable)
        if unstable and route.gap is None and not start.steps and (
                weak := stability.weak_at_rest(system)):
            raise ConvergenceError(weak, start)
        if not unstable and not strategies.near_limit(system, start):
            return None
        if not stability.has_potential(system, start.u, self.load):
            if not unstable:
                return None
            start.unstable = True
            start.doubt = (f"the path is unstable from the load level {self.level:.6g} on, and the "
                           "loads have no potential by which to find a stable equilibrium")
            return failure.found
        # of all radii, the first result to which the load drives the scene is preferred
        options, found = self.options._replace(most=strategies.DESCENT, watched=False), None
        saw_unstable = False
        for radius in strategies.RADII:
            descent = strategies.Descent(system, radius)
            try:
                other = strategies.descend(self, options, descent)
            except (LoadStepFailed, *NO_FACTORS) as error:
                logger.info("no descent at load %.6g: %s", self.level, error)
                continue
            heads_on = self._heads_on(other.u)
            if heads_on or found is None:
                found, saw_unstable = other, descent.saw_unstable
            if heads_on:
                break
        if saw_unstable and not start.doubt:
            start.doubt = (
                f"the path loses its stability between the load levels {start.load:.6g} and "
                f"{self.level:.6g}; the solution followed the unstable direction to a stable "
                "equilibrium, which need not be the only one")
        return found
