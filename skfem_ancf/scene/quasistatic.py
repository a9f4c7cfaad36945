"""Quasi-static runs: loads, supports and obstacles as functions of time, without inertia."""

import logging
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..actions.forces.springs import Turns
from ..actions.obstacles.obstacle import stiffest
from ..core import (Array, ArrayLike, ConvergenceError, Immutable, InputError, Interrupted,
                    ModelWarning, progress_bar, refuse, require_finite, require_flag,
                    require_increasing, require_integer, require_option, require_positive, warn)
from ..dynamics.base import Motion, Scheme, columns_of
from ..dynamics.history import History, state_of
from ..dynamics.sensors import Recorder, Sensor
from ..equations.stability import largest_displacement, position_weights
from ..equations.system import System
from ..results.state import State
from ..solvers.increment import Increment, Options, Route
from ..solvers.newton import Search, Steps as Rules
from ..solvers.iteration import StaticResult, LoadStepFailed
from ..solvers.strategies import solved_without_contact
from .solve import displacement

logger = logging.getLogger(__name__)

#: Fraction of the allowed iterations up to which the next increment grows; its growth; reduction
#: after a failure.
FEW, LARGER, CUT = 0.7, 1.5, 0.25
FOLLOWED, JUMPED, AT_REST = "followed", "jumped", "at rest"
#: Smallest increment from rest, relative to the largest, of scenes that only loads or obstacles
#: support: smaller loads stabilise no better. Two smaller ones are tried if all strategies fail.
CUTS_AT_REST, LAST_AT_REST = CUT**3, CUT**5
#: Iterations of a descent in an increment.
BOUNDED = 40
#: Largest number of consecutive jumps.
JUMPS = 3
#: Increments below this fraction of those asked for are slow; number of slow ones in a row after
#: which the strategies of statics take a whole increment.
SLOW, PATIENCE = 1e-2, 30
#: Largest displacement of a node in an increment: in the first one relative to the scene's size,
#: then relative to that at the last rate, or to the size.
FAR, FASTER, NEAR = 0.05, 4.0, 1e-3
#: Drag of loose beams relative to their softest bending, that of a free beam over E I / L^4; its
#: least value relative to E / L; factors for an increment that fails. Least number of iterations
#: allowed: contacts open and close in turn.
DRAG, FREE, LEAST_DRAG, MORE_DRAG, LOOSE = 0.02, 500.0, 1e-9, (10.0, 100.0, 1e3), 60


# named steps of a quasi-static run

class Ramp(Immutable):
    """A piecewise linear function of time, constant outside of its times.

    Parameters
    ----------
    times
        Increasing times, shape (n,).
    values
        Numbers, shape (n,), or vectors, (n, k).

    Examples
    --------
    >>> Ramp([0, 1, 3], [0, 10, 0])(2.0)
    5.0
    """

    def __init__(self, times: ArrayLike, values: ArrayLike) -> None:
        self.times = require_increasing("times of a Ramp", times)
        self.values = require_finite("values", values)
        if self.values.ndim not in (1, 2) or len(self.values) != len(self.times):
            raise InputError(f"a Ramp with {len(self.times)} times has as many numbers or vectors, "
                             f"got values of shape {self.values.shape}")

    def __call__(self, t: Any) -> Any:
        """The value at a time: a number, or (k,); for times (n,) shape (n,) or (k, n)."""
        if self.values.ndim == 1:
            found = np.interp(t, self.times, self.values)
            return found if np.ndim(t) else float(found)
        return np.array([np.interp(t, self.times, one) for one in self.values.T])


class Steps(Immutable):
    """Consecutive steps of a quasi-static run, with names and durations.

    :meth:`ramp` makes functions of time from values at the ends of steps, for the ``amplitude`` of
    loads and temperatures, ``position`` and ``angle`` of obstacles, displacements of supports and
    angles of motors.

    Parameters
    ----------
    *unnamed
        Refused, with a message that says how to write it.
    **durations
        Positive duration of each step by name.

    Attributes
    ----------
    names : tuple of str
    ends : ndarray
        Final time of each step, shape (n,).

    Examples
    --------
    >>> steps = Steps(press=1.0, hold=0.5, release=1.0)
    >>> steps.ends.tolist()
    [1.0, 1.5, 2.5]
    >>> force = steps.ramp(press=20.0, release=0.0)
    >>> [force(t) for t in (0.5, 1.0, 1.2, 2.0)]
    [10.0, 20.0, 20.0, 10.0]
    """

    def __init__(self, *unnamed: Any, **durations: float) -> None:
        refuse(unnamed or not durations, "give durations by name, as Steps(press=1.0, release=1.0) "
               "or Steps(**{{'press': 1.0}}), got Steps{!r}", unnamed)
        self.names = tuple(durations)
        with np.errstate(over="ignore"):
            self.ends = require_finite("the sum of the durations", np.cumsum(
                [require_positive(name, x) for name, x in durations.items()]))

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        return "Steps(" + ", ".join(f"{name}={dt:g}" for name, dt in zip(
            self.names, np.diff(self.ends, prepend=0.0))) + ")"

    def ramp(self, start: ArrayLike | None = None, /, **values: ArrayLike) -> Ramp:
        """A function of time from values at the ends of steps, linear within each step.

        Raises NameUnknown, InputError if a step is unknown, or if there is no value.

        Parameters
        ----------
        start
            The value at time 0: a number or a vector, shape (k,); zero by default.
        **values
            Values at the ends of steps by name; in steps without a value it is constant.
        """
        for name in values:
            require_option("step", name, self.names)
        refuse(not values and start is None, "ramp() has no values: give one at the end of a "
               "step, as ramp({}=1.0)", self.names[0])
        first: Any = next(iter([*values.values(), start]))
        shape = np.shape(first)
        last: Any = np.zeros(shape) if start is None else require_finite("start", start, shape)
        rows = [last]
        for name in self.names:
            rows.append(require_finite(name, values.get(name, rows[-1]), shape))
        return Ramp(np.append(0.0, self.ends), np.array(rows))

    def step_at(self, t: Array) -> Array:
        """Numbers of the steps at times, shape (n,); the end belongs to the step."""
        return np.minimum(np.searchsorted(self.ends, t - 1e-12 * self.ends[-1]), len(self) - 1)


class QuasiStatic(Scheme):
    """Scheme of the states of a :class:`StepHistory`; motions may start from them, at rest."""

    name = "quasi-static"

    def __repr__(self) -> str:
        return "QuasiStatic()"


class StepHistory(History):
    """A quasi-static run: equilibria over the time of its steps.

    It has the methods of a History: positions, strains, reactions, sensors, pictures, films and
    files. Velocities and accelerations are zero; ``dissipated`` is the work of friction and of
    materials since the first instant.

    Attributes
    ----------
    plan : Steps or None
        The named steps.
    found_by : list of str
        How each equilibrium was found: "followed" from the previous one, or "jumped by ..." where
        the path ended and a strategy of statics led to another equilibrium.
    iterations_at : ndarray
        Number of linear systems solved for each, shape (nt,).
    """

    plan: Steps | None
    found_by: list[str]
    iterations_at: Array

    @property
    def jumps(self) -> Array:
        """Times of equilibria reached by a jump, shape (n,)."""
        return self.t[[one.startswith(JUMPED) for one in self.found_by]]

    def during(self, step: str) -> Array:
        """Indices of the instants of a step, its start and end included."""
        if self.plan is None:
            raise InputError("the run had no named steps: scene.run(Steps(press=1, pull=1))")
        require_option("step", step, self.plan.names)
        k, ends = self.plan.names.index(step), np.append(0.0, self.plan.ends)
        slack = 1e-12 * ends[-1]
        return np.nonzero((self.t >= ends[k] - slack) & (self.t <= ends[k + 1] + slack))[0]


def run(system: System, steps: Steps | ArrayLike, increments: int = 20,
        start: State | None = None, sensors: Sequence[tuple[str, Sensor]] = (), *,
        tol: float = 1e-8, max_iterations: int = 30, min_step: float = 1e-4, stable: bool = True,
        progress: bool | None = None) -> StepHistory:
    """Equilibria over the time of steps, see :meth:`skfem_ancf.Scene.run`."""
    # ``sensors`` are names and :class:`~skfem_ancf.dynamics.sensors.Sensor`.
    refuse(isinstance(steps, dict), "steps are given by name as Steps(**{!r}), got a dict", steps)
    one = not isinstance(steps, (list, tuple, Steps)) and np.ndim(steps) == 0
    ends = steps.ends if isinstance(steps, Steps) else require_increasing(
        "steps", [steps] if one else steps)
    increments = require_integer("increments", increments, 1, 100000)
    rules = Rules("auto", require_positive("tol", tol),
                  require_integer("max_iterations", max_iterations, 1, 10000), 1.0,
                  require_positive("min_step", min_step))
    refuse(rules.min_step > 1.0, "min_step must be at most 1, got {!r}", min_step)
    require_flag("stable", stable)
    u = None if start is None else displacement(system, start)
    t_start = 0.0 if start is None else float(start.t or 0.0)
    refuse(ends[-1] <= t_start, "the steps end at t = {:g}, not after the start at t = {:g}",
           ends[-1], t_start)
    made = _Record(system, steps if isinstance(steps, Steps) else None, sensors)
    made.t = t_start
    try:
        with progress_bar(progress, total=ends[-1] - t_start, desc="time") as bar:
            begin = _begin(system, t_start, start, u, rules, stable)
            for instant in follow(system, ends, increments, begin, rules, stable):
                bar.update(instant.t - made.t)
                made.add(instant)
    except (LoadStepFailed, ConvergenceError) as failure:
        raise ConvergenceError(f"no equilibrium found after t = {made.t:.6g}, up to which the "
                               f"error's state is the history: {failure}", made.history()) from None
    except KeyboardInterrupt:
        raise Interrupted(f"stopped at t = {made.t:.6g}; the exception's state is the history up "
                          "to there", made.history()) from None
    return made.history()


class Instant(NamedTuple):
    """An equilibrium at a time."""

    t: float
    result: StaticResult
    found_by: str  # the name of a strategy
    rate: float | None = None  # largest displacement of a node over the last increment of time
    velocity: Array | None = None  # change of displacements over that time, of a loose bundle


def _begin(system, t, start, u, rules, stable):
    """The first instant: ``start`` if it belongs to a run of the scene, or computed from it."""
    # The residual at its displacement is reduced to zero in load steps. A scene that only loads and
    # obstacles stabilise may be at rest before they act.
    memory = system.histories.of_state(start)
    motion = None if start is None else start._motion
    if motion is not None and start.system is system and isinstance(start._origin[0], QuasiStatic):
        given = StaticResult(u, start.multipliers, 1.0, np.zeros(system.N), [], True, "given",
                             memory=memory, rubbed=motion.dissipated)
        return Instant(t, given, "given")
    if memory is None:
        system.forces.contacts.require_clear(np.zeros(system.N) if u is None else u, t)
    search = Search(system.at(t), u, memory, rules, stable, False)
    result = None
    if search.stabilised_by_loads:
        try:
            result, found_by = search.at_rest(), AT_REST
        except LoadStepFailed:
            logger.debug("t = %.6g: not at rest", t)
    if result is None:
        result = search.find()
        found_by = result.attempts[-1].strategy
    result.rubbed = 0.0 if motion is None else motion.dissipated
    return Instant(t, result, found_by)


def follow(system: System, ends: Array, increments: int, begin: Instant, rules: Rules,
           stable: bool) -> Iterator[Instant]:
    """Yield equilibria from ``begin`` on, at instants of grids of ``increments`` between the
    ``ends``.

    Each follows from the one before, by the mixed iteration, then by Newton's method, or by a
    descent if obstacles or only loads stabilise the scene. An increment that fails or moves the
    scene far is cut, since several equilibria may be close. If the smallest one fails, because the
    equilibrium becomes unstable, the strategies of :func:`~skfem_ancf.solvers.newton.solve_static`
    look for another one under constant loads. If increments stay below a hundredth of those asked
    for, they take the next one as a whole, with a ModelWarning, so that the work is bounded.
    """
    yield begin
    jumps, slow, drag = 0, 0, drag_of(system)
    for end in ends[ends > begin.t]:
        grid = np.linspace(begin.t, end, increments + 1)[1:]
        most = (end - begin.t) / increments
        size, least = most, (rules.min_step if drag is None else CUT**2) * most
        while begin.t < end:
            stalled = slow > PATIENCE
            if stalled:
                warn(f"from t = {begin.t:.6g} on only increments of {size:.3g} succeed, where "
                     f"{most:.3g} was asked for: the next one leaves the path", ModelWarning)
                size, slow = most, 0
            target = grid[grid.searchsorted(begin.t, side="right")]
            parts = np.ceil((target - begin.t) / size - 1e-3)
            t = target if parts <= 1.0 else begin.t + (target - begin.t) / parts
            if begin.found_by == AT_REST:
                least = max(least, CUTS_AT_REST * most)
            smallest = stalled or size <= least
            try:
                found = _next(system, begin, t, rules, stable, smallest, drag)
            except (LoadStepFailed, ConvergenceError) as failure:
                if smallest and (begin.found_by != AT_REST or size < 2.0 * LAST_AT_REST * most):
                    raise
                logger.info("t = %.6g failed (%s), increment cut", t, failure)
                size *= CUT
                continue
            jumps = jumps + 1 if found.found_by.startswith(JUMPED) else 0
            if jumps > JUMPS:
                raise LoadStepFailed(f"at t = {t:.6g} even the smallest increments do not lead "
                                     "from one equilibrium to the next")
            slow = slow + 1 if size < SLOW * most else 0
            if found.result.iterations <= FEW * rules.max_iterations:
                size = min(LARGER * size, most)
            begin = found
            yield begin


def _next(system: System, last: Instant, t: float, rules: Rules, stable: bool, smallest: bool,
          drag: Array | None) -> Instant:
    """The equilibrium at t, by that without contact if nothing touches."""
    found: list[Instant] = []

    def solve(free):
        found.append(_after(free, last, t, rules, stable, smallest, drag))
        return found[0].result

    # what yields needs smaller increments
    result = solved_without_contact(system, last.result.u, last.result.memory, solve,
                                    cut=system.histories.path_dependent and not smallest)
    return found[0] if result is not None else _after(
        system, last, t, rules, stable, smallest, drag)


def _after(system: System, last: Instant, t: float, rules: Rules, stable: bool,
           smallest: bool, drag: Array | None) -> Instant:
    """The equilibrium at t; by all strategies if the increment is the smallest."""
    route = Route(last.result.u, None, (1.0, 1.0), (last.t, t), t - last.t)
    start = StaticResult(**vars(last.result) | {
        "load": 0.0, "steps": [], "rejected": 0, "unstable": False, "doubt": "",
        "diverging": False})
    failed: Any = None
    system, far = system.at(t), FAR * system.size
    if last.rate is not None:
        far = max(NEAR * system.size, FASTER * last.rate * (t - last.t))
    if drag is not None:
        return _loose(system, last, t, drag, start, Options(
            route, "mixed", rules.tol, rules.max_iterations, close=True), smallest)
    search = partial(Search, system, last.result.u, last.result.memory, rules=rules, stable=stable,
                     progress=False, span=t - last.t)
    bounded = bool(system.forces.contacts.obstacles or system.constraints.missing_supports)
    for method in ["mixed", "newton", *(("all",) if smallest else ())]:
        if method == "newton" and bounded:
            if system.histories.path_dependent:
                continue  # what yields needs smaller increments: descents fail
            method = "descent"
        try:
            if method == "all":
                logger.info("t = %.6g: %s, looking for another equilibrium", t, failed)
                # the whole increment at once has been tried, where nothing may touch
                result = search(rules=rules if bounded else rules._replace(first_step=CUT)).find()
                method = result.attempts[-1].strategy
                result.rubbed += last.result.rubbed
            elif method == "descent":
                result = search().descent(most=BOUNDED)
                result.rubbed += last.result.rubbed
            else:
                step = Increment(system, start, 1.0, Options(
                    route, method, rules.tol, rules.max_iterations, method == "mixed", True))
                try:
                    result = step.reached(step.solve(stable))
                finally:
                    bounded = bounded or step.touched
        except LoadStepFailed as failure:
            failed = failure
            continue
        moved = largest_displacement(system, result.u - last.result.u)
        if moved <= far or smallest:
            return Instant(t, result, FOLLOWED if moved <= far else f"{JUMPED} by {method}",
                           moved / (t - last.t))
        failed = LoadStepFailed(f"a node moves by {moved:.3g}")
    raise failed


def _loose(system: System, last: Instant, t: float, drag: Array, start: StaticResult,
           options: Options, smallest: bool) -> Instant:
    """The equilibrium at t of loose members that may touch, with the drag of :func:`drag_of`."""
    # From a guess by the last change: from the last equilibrium, where nothing that the lid presses
    # moves yet, contacts open and close in turn for longer. What fails is a body that snaps
    # through: with more drag it does so in several increments.
    dt, u = t - last.t, last.result.u
    start.memory = system.histories.after(start.memory).relaxed(u)
    options = options._replace(most=max(options.most, LOOSE))
    guess = None if last.velocity is None else u + dt * last.velocity
    tries = [options._replace(drag=drag, guess=guess)] + [
        options._replace(drag=factor * drag, method="newton")
        for factor in (MORE_DRAG if smallest else MORE_DRAG[:1])]
    for k, one in enumerate(tries):
        step = Increment(system, start, 1.0, one)
        try:
            result = step.reached(step.solve(False))
            break
        except LoadStepFailed:
            if k == len(tries) - 1:
                raise
    moved = largest_displacement(system, result.u - u)
    return Instant(t, result, FOLLOWED, moved / dt, (result.u - u) / dt)


def drag_of(system: System) -> Array | None:
    """Drag on each DOF per displacement in an increment, (N,), of loose members that may touch."""
    # What no other member touches has no position of its own. With the drag it stays where it was,
    # and what is pushed moves no further than it has to. Other scenes have none.
    if not (system.constraints.missing_supports and system.forces.changing):
        return None
    out = np.zeros(system.N)
    for beam, s in zip(system.beams, system.slices):
        mesh, E = beam.mesh, stiffest(beam.across, np.arange(beam.mesh.nelements))[0]
        length = mesh.lengths.sum() / len(np.unique(mesh.chains))
        bending = max(FREE * mesh.height**3 / 12.0 / length**4, LEAST_DRAG / length)
        drag = DRAG * E * bending * beam.across.outline(np.full((2, 1), 0.5))[0]
        parts = 0.5 * drag * np.bincount(mesh.t.ravel(), np.tile(mesh.lengths, 2))
        out[s].reshape(-1, beam.nd)[:, :2] = parts[:, None]
    bodies = np.setdiff1d(position_weights(system).nonzero()[0], out.nonzero()[0])
    out[bodies] = out[out > 0.0].mean() if out.any() else 0.0
    return out


class _Record:
    """Results so far."""

    def __init__(self, system: System, plan: Steps | None,
                 sensors: Sequence[tuple[str, Sensor]]) -> None:
        self.system, self.plan, self.scheme = system, plan, QuasiStatic()
        self._turns = Turns(system)
        self._instants: list[Instant] = []
        self._motions: list[Motion] = []
        self._recorder = Recorder(sensors, system, self.scheme, lambda y: state_of(
            system, self.scheme, y))
        self.t = 0.0

    def add(self, instant: Instant) -> None:
        u, zero = instant.result.u, np.zeros(self.system.N)
        before = self._motions[-1].turns if self._motions else None
        turns = self._turns.begin(u) if before is None else self._turns.follow(before, u[None])[0]
        memory = instant.result.memory
        if memory is None:
            memory = self.system.histories.rest
        y = Motion(instant.t, u, zero, zero, zero, instant.result.multipliers,
                   instant.result.multipliers, 0.0, instant.result.rubbed, memory, turns)
        self._motions.append(y)
        self._instants.append(instant)
        self._recorder.record([y])
        self.t = instant.t

    def history(self) -> StepHistory:
        columns = columns_of(self._motions)
        if not self._motions:
            empty = np.zeros((0, self.system.N))
            columns |= {"u": empty, "v": empty, "acceleration": empty}
        iterations = [instant.result.iterations for instant in self._instants]
        return StepHistory(
            self.system, self.scheme, columns, (None, None), self._recorder.readings(),
            event=None, steps=max(0, len(iterations) - 1), substeps=0, rejected=0,
            iterations=sum(iterations), factorizations=0, plan=self.plan,
            found_by=[x.found_by for x in self._instants],
            iterations_at=np.array(iterations, dtype=int))
