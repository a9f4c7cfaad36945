"""The loop over the steps of a motion: step sizes, breakpoints, events, storage, restart."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, ulp
from typing import Any

import numpy as np
import scipy

from ..actions.forces.springs import Turns
from ..core import (AncfError, Array, CheckpointError, ModelWarning, ask_number, refuse,
                    require_finite, require_finite_scalar, require_increasing, require_positive,
                    warn)
from ..equations.system import System
from ..results.state import State
from .base import COLUMNS, Motion, Scheme, columns_of, in_blocks, interpolate
from .history import History, state_of
from .integrator import DEPTH, Integrator, StageIntegrator, TimeStepFailed
from .sensors import Recorder, Sensor
from .time_functions import Lookahead

# automatic step size

#: Largest error of a point over the root mean square: the tip of a cantilever moves twice as far as
#: the mean, and errors grow with time.
LARGEST = 3.0
#: Fraction of ``rtol`` that a single step may add.
SINGLE = 0.1
#: Relative error above which a step is repeated.
REJECTED = 1.2
#: Growth of the step size below which the size, and the factors, stay.
WORTH = 1.3
#: Error relative to the motion so far, over ``rtol``, where that is small beside the scene.
OF_MOTION = 100.0
#: Size of a motion at rest, over that of the scene.
AT_REST = 1e-7


class StepSize:
    """Chooses steps so that the error of every point is about ``rtol`` times the size of the scene,
    or of motions that are small beside it :data:`OF_MOTION` times ``rtol`` of their root mean
    square.

    A step may add an error in proportion to its size (error per unit step: Hairer, Norsett, Wanner:
    "Solving ordinary differential equations I", II.4). The error is a root mean square weighted by
    mass, times :data:`LARGEST`. Parts of the estimate that do not accumulate are removed:

    * what supports and joints undo (a single step counts in full),
    * what the step does not resolve, by the iteration matrix as a filter (Shampine, Baca: "Error
      estimators for stiff differential equations", J. Comp. Appl. Math. 11 (1984)),
    * what is damped, in collocation,
    * in schemes of second order, vibrations whose phase is lost anyway, by two running averages
      over the time W. After the time T a vibration of frequency w has the phase error C w^3 dt^2 T,
      so W = (C dt^2 T)^(1 / 3) / 2.
    """

    def __init__(self, system: System, scheme: Scheme, rtol: float, t_start: float,
                 t_end: float) -> None:
        refuse(not scheme.adaptive, "{!r} does not estimate its error: give a step size dt, or use "
               "a scheme of the package, all of which support dt='auto'", scheme)
        self.system, self.scheme, self.rtol = system, scheme, rtol
        self.span, self._averaged = t_end - t_start, scheme.order <= 2
        self._mass = sum(b.total_mass for b in system.members)
        self.averages = self._new = np.zeros((2, system.N))
        self._origin, self._moved = np.zeros(0), 0.0
        self.cut = Lookahead(system, t_start, t_end).cut

    def _mean(self, du):
        """The root mean square of a displacement over the size of the scene."""
        return (np.sqrt(max(du @ self.system.mass.multiply(du), 0.0) / self._mass)
                / self.system.size)

    def error(self, integrator: Integrator, old: Motion, new: Motion, dt: float) -> float:
        """The error that a step adds, over what it may add."""
        s, scheme, power = self.system, self.scheme, self.scheme.order + 1
        de = scheme.local_error(old, new, dt) * s.constraints.free
        for _ in range(scheme.filtered):
            de = scheme.resolved(integrator, de)
        lasting = scheme.lasting(integrator, de, self.span)
        if s.constraints.m and not s.mass_solver.by_nodes:  # projected onto the joints
            J = s.constraints.full_jacobian(new.u, new.t)
            lasting = lasting + s.mass_solver(new.u, new.t, J)(np.zeros(s.N), -(J @ lasting))[0]
        rate = lasting / dt**power
        if self._averaged:
            width = 0.5 * (scheme.error_constant * dt**2 * self.span) ** (1.0 / 3.0)
            part = -np.expm1(-dt / width)
            self._new = self.averages.copy()
            for average in self._new:
                average += part * (rate - average)
                rate = average
        # the size to which errors refer, over that of the scene
        if not self._origin.size:
            self._origin = old.u
        self._moved = max(self._moved, self._mean(old.u - self._origin))
        moved = max(self._moved, self._mean(new.u - self._origin))
        scale = min(1.0, OF_MOTION * max(AT_REST, moved))
        return LARGEST * scheme.safety / (self.rtol * scale) * max(
            self._mean(rate) * dt**(power - 1) * self.span, self._mean(de) / SINGLE)

    def next(self, error: float, dt: float, size: float) -> tuple[float, bool]:
        """The next step size, and whether to accept the last step of size dt."""
        factor = 0.9 * max(error, 1e-300) ** (-1.0 / self.scheme.order)
        if error > REJECTED and dt > 1e-9 * self.span:
            return dt * max(0.2, min(0.8, factor)), False
        self.averages, new = self._new, dt
        if factor > WORTH or factor < 0.95:
            new = dt * min(2.0, max(0.5, factor))
        return (max(size, new) if dt < 0.99 * size and factor >= 1.0 else new), True

    def arrays(self) -> dict[str, Array]:
        return {"averages": self.averages, "origin": self._origin, "moved": np.array(self._moved)}

    def load(self, arrays: dict[str, Any]) -> None:
        self.averages, self._origin = arrays["averages"], arrays["origin"]
        self._moved = float(arrays["moved"])


#: Largest number of steps of a motion.
MAX_STEPS = 10**9
#: The smallest tolerance of the automatic step size.
MIN_RTOL = 1e-12
EPS = np.finfo(float).eps
#: Fraction of a step below which an instant is interpolated; so short a step is all round-off.
CLOSE = 1e-6
#: Degrees of freedom times steps of a block, so that progress bars and Ctrl-C react in time.
SHOWN = 50_000
#: The first step of automatic size, over the duration of the motion.
FIRST = 1e-4
#: Smallest automatic step size after failures, over the duration of the motion.
SHORTEST = 1e-7
#: Tolerance of the time of an event, as a fraction of a step.
EXACT = 1e-10


@dataclass
class Task:
    """Arguments of a time integration."""

    t_start: float
    t_end: float
    dt: float | None = None  # None: automatic
    tol: float | None = None  # None: the scheme's
    rtol: float = 1e-5
    t_eval: Array | None = None  # (n,), or None for all steps
    breakpoints: tuple[float, ...] = ()  # interior ones

    @property
    def span(self) -> float:
        return self.t_end - self.t_start


def task_of(t_start: Any, t_end: Any, dt: Any, t_eval: Any, tol: Any, rtol: Any,
            breakpoints: Any, sampled: Sequence[Any] = ()) -> Task:
    """Check arguments of :meth:`skfem_ancf.Scene.integrate`."""
    # ``sampled`` are controllers with zero-order hold, whose samples are ends of steps.
    t_start = require_finite_scalar("t_start", t_start)
    t_end = require_finite_scalar("t_end", t_end)
    refuse(t_end <= t_start, "t_end must lie after t_start, the time of the start: it is a time, "
           "no duration; got t_end = {!r}, t_start = {!r}", t_end, t_start)
    span = t_end - t_start
    breaks = [*np.atleast_1d(breakpoints)]
    for control in sampled:
        refuse(span / control.dt > MAX_STEPS, "dt of {!r} is too small for a motion of {:g}",
               control, span)
        breaks += (t_start + control.dt * np.arange(1, np.ceil(span / control.dt))).tolist()
    auto = isinstance(dt, str)
    refuse(auto and dt != "auto", 'dt must be a positive number or "auto", got {!r}', dt)
    dt = None if auto else require_positive("dt", dt)
    step = 1e-4 * span if auto else min(dt, span)
    # raise InputError if round-off cannot resolve the steps, or if there are too many
    # the squares of times must not overflow
    refuse(step < 1e-100 or t_end > 1e100, "times must lie between 1e-100 and 1e100, got dt = "
           "{!r}, t_end = {!r}", step, t_end)
    refuse(step <= 8 * EPS * max(abs(t_start), abs(t_end)), "dt = {!r} is below the round-off of "
           "the times {!r} to {!r}", step, t_start, t_end)
    steps = (t_end - t_start) / step
    refuse(steps > MAX_STEPS, "dt = {!r} needs {:.3g} steps to t_end = {!r}: the limit is {:.0e}",
           step, steps, t_end, MAX_STEPS)
    if not auto and dt > 10.0 * span:
        warn(f"dt = {dt:g} is longer than the motion, from t = {t_start:g} to {t_end:g}, which "
             "becomes one step: the first argument is t_end, the second is dt", ModelWarning)
    if t_eval is not None:
        t_eval = require_increasing("t_eval", t_eval)
        refuse(t_eval[0] < t_start or t_eval[-1] > t_end * (1 + 1e-12),
               "t_eval must lie within [{}, {}], got {!r}", t_start, t_end, t_eval)
    tol = None if tol is None else require_positive("tol", tol)
    rtol = require_positive("rtol", rtol)
    refuse(rtol < MIN_RTOL, "rtol must be at least {:g}, got {!r}", MIN_RTOL, rtol)
    inside = {t for t in require_finite("breakpoints", breaks, (None,)).tolist()
              if t_start + 1e-9 * span < t < t_end - 1e-9 * span} if breaks else ()
    return Task(t_start, t_end, None if auto else step, tol, rtol, t_eval, tuple(sorted(inside)))


def integrator_of(system: System, scheme: Scheme, tol: float | None = None) -> Integrator:
    return (StageIntegrator if scheme.collocates else Integrator)(system, scheme, tol)


class Run:
    """The loop over steps, which can stop after any step and continue from :meth:`arrays`."""

    y: Motion

    def __init__(self, system: System, scheme: Scheme, task: Task,
                 sensors: Sequence[tuple[str, Sensor]] = (),
                 until: Callable[[State], float] | None = None) -> None:
        self.system, self.scheme, self.task = system, scheme, task
        self.integrator = integrator_of(system, scheme, task.tol)
        self._side: Integrator | None = None
        self._sizes = None
        if task.dt is None:
            self._sizes = StepSize(system, scheme, task.rtol, task.t_start, task.t_end)
        self._times = task.t_start, *task.breakpoints, task.t_end
        self._segment = self._n = self._next = self.steps = self.rejected = self._stuck = 0
        self._size = FIRST * task.span if task.dt is None else task.dt
        self._stored: list[dict[str, Array]] = []  # columns, each of some instants
        self._turns = Turns(system)
        self.recorder = Recorder(sensors, system, scheme, lambda y: state_of(system, scheme, y))
        self.longest: int | None = None
        self._until, self._value = until, None
        self.event: float | None = None
        self._in_blocks = in_blocks(scheme) and self._sizes is None and until is None
        self._limit()

    # the start

    def begin(self, start: State | None, u: Array | None, v: Array) -> None:
        """Start from a State, or from rest: the displacement, and a velocity unless it moves."""
        # Of a motion by the same scheme the run takes the step size; with the same scene it goes on
        # exactly.
        system, task, turns, goes_on = self.system, self.task, None, False
        motion = None if start is None else start._motion
        if start is not None and motion is not None:
            (scheme, arrays), v, turns = start._origin, motion.v, motion.turns
            if type(scheme) is type(self.scheme) and (
                    repr(sorted(vars(scheme).items())) == repr(sorted(vars(self.scheme).items()))):
                if arrays is not None and len(start.u) == system.N and (
                        self._sizes is not None and "averages" in arrays):
                    self._size = min(float(arrays["size"]), task.span)
                    self._sizes.load(arrays)
                goes_on = (start.system is system and task.t_start == start.t
                           and not system.forces.sampled)
        if motion is not None and goes_on:
            self.y = replace(motion, t=task.t_start)
            if arrays is not None:
                self.integrator.load(arrays)
                self.integrator.reset()
        else:
            u = np.zeros(system.N) if u is None else u
            if motion is None:
                system.forces.contacts.require_clear(u, task.t_start)
            self.y = self._begin_segment(u, v, system.histories.of_state(start), True)
            if turns is None or len(turns) != self._turns.number:
                turns = self._turns.begin(self.y.u)
            self._follow(turns, self.y)
        self.recorder.record([self.y])
        if task.t_eval is None or task.t_eval[0] <= task.t_start:
            self._stored.append(columns_of([self.y]))
            self._next = 1

    def _begin_segment(self, u, v, history, first):
        """The Motion at the start of a segment, after due samples of controllers."""
        history = self.system.histories.sampled(u, v, self._begun, history, first)
        step = min(self._size, self._end - self._begun)
        return self.integrator.start(u, v, self._begun, step, history=history)

    def _follow(self, last, y):
        """Set ``y.turns`` from the previous angles (k,); returns y."""
        y.turns = self._turns.follow(last, y.u[None])[0]
        return y

    # segments between breakpoints

    @property
    def done(self) -> bool:
        """True at the end of the motion."""
        return self.event is not None or (self._last and self.y.t >= self._end)

    def _limit(self):
        """Set the times and steps of the segment, and the limit of sampling before its end."""
        self._begun, self._end = self._times[self._segment:self._segment + 2]
        self._last = self._segment == len(self._times) - 2
        near = 16 * ulp(max(abs(self._begun), abs(self._end)))
        self.integrator.limit = np.inf if self._last else self._end - near
        self._count = 0 if self._sizes else max(1, ceil(
            (self._end - self._begun) / self._size * (1 - 1e-12)))
        even = abs(self._begun + self._count * self._size - self._end) < 1e-9 * self._size
        # only the last step may be shorter, so that factors can be reused
        self._whole = self._count if even and self._last else self._count - 1

    def _time(self, n):
        """Time after n steps of the segment."""
        return self._begun + n * self._size if n < self._count else self._end

    # steps

    def advance(self) -> None:
        """Take a step or a block of steps, or reject a step; raises TimeStepFailed."""
        if self._in_blocks and self._n < self._whole and self._block():
            return
        y, left = self.y, self._end - self.y.t
        if self._sizes is None:
            whole = self._n < self._count - 1 or abs(left - self._size) < 1e-9 * self._size
            new = self.integrator.step(y, self._size if whole else left)
            new.t = self._time(self._n + 1)
            self._commit(y, new)
            return
        h = self._sizes.cut(y.t, min(self._size, left))
        if left < (1 + 1e-3) * h:
            h = left
        elif left < 2 * h:
            h = 0.5 * left
        touches = self.system.forces.contacts.obstacles  # halved steps find the time of impact
        try:
            new = (self.integrator.step if touches else self.integrator.attempt)(y, h)
            error = self._sizes.error(self.integrator, y, new, h)
            self._size, kept = self._sizes.next(error, h, self._size)
        except TimeStepFailed:
            if h < SHORTEST * self.task.span:
                raise
            self._size, kept, self._stuck = 0.5 * h, False, self._stuck + 2
            past = self.integrator.leap(y, h) if self._stuck >= 2 * DEPTH else None
            if past is not None and past.t < self._end:
                new, h, kept, self._stuck = past, past.t - y.t, True, 0
        if not kept:
            self.rejected += 1
            return
        self._stuck = max(0, self._stuck - 1)
        if h == left:
            new.t = self._end
        self._commit(y, new)

    def _block(self):
        """Take a block of steps of one size; False if none succeeded."""
        size = self.integrator.longest
        first = self._n - self._n % size
        block = first, min(first + size, self._whole)
        number = min(block[1] - self._n, max(1, SHOWN // self.system.N))
        if self.longest is not None:
            number = min(number, self.longest - self._n % self.longest)
        try:
            taken = self.integrator.run(self.y, self._size, number, self._begun, self._n, block)
        except AncfError:  # from a user's function: continue in single steps
            self._in_blocks = False
            return False
        if not taken and self.integrator.stopped:
            raise KeyboardInterrupt
        if not taken:
            return False
        taken.columns["turns"] = self._turns.follow(self.y.turns, taken.columns["u"])
        taken.columns["t"][-1] = self._time(self._n + len(taken))
        self.recorder.record(taken)
        if self.task.t_eval is None:
            self._stored.append(taken.columns)
        else:
            for old, new in zip([self.y, *taken], taken):
                self._store(old, new)
        self._n, self.steps, self.y = self._n + len(taken), self.steps + len(taken), taken[-1]
        if self.integrator.stopped:
            raise KeyboardInterrupt
        return True

    def _commit(self, old, new):
        """Accept a step: find events, pass breakpoints, record and store."""
        def value(y):
            return ask_number("until(state)", self._until, state_of(self.system, self.scheme, y))

        self._follow(old.turns, new)
        if self._until is not None:
            before = value(old) if self._value is None else self._value
            self._value = value(new)
            if before != 0.0 and before * self._value <= 0.0:  # the event is within the step
                root = scipy.optimize.brentq(lambda t: value(self._interpolated(old, new, t)),
                                             old.t, new.t, xtol=EXACT * (new.t - old.t))
                new = self._interpolated(old, new, root)
                self.event = new.t
        if self.event is None and new.t >= self._end and not self._last:
            # the next segment has new accelerations and rates
            self._segment, self._n, end = self._segment + 1, 0, new
            self._limit()
            if self._sizes is not None:
                self._size = FIRST * self.task.span
                self._sizes.averages = np.zeros_like(self._sizes.averages)
            new = self._begin_segment(end.u, end.v, end.history, False)
            new.dissipated, new.start, new.parts = end.dissipated, end.start, end.parts or [end]
            self._follow(end.turns, new)
            if self._until is not None:  # a change of sign at a breakpoint is an event there
                before, self._value = self._value, value(new)
                if before * self._value < 0.0:
                    self.event = new.t
        else:
            self._n += 1
        self.recorder.record([new])  # first, since users' functions may raise
        self._store(old, new)
        self.y, self.steps = new, self.steps + 1

    # storage

    def _store(self, old, new):
        """Store the instants that were asked for between two Motions."""
        wanted = self.task.t_eval
        if wanted is None:
            self._stored.append(columns_of([new]))
            return
        until = new.t + 1e-14 * max(abs(self.task.t_start), abs(self.task.t_end))
        while self._next < len(wanted) and wanted[self._next] <= until:
            t = float(wanted[self._next])
            self._stored.append(columns_of([new if t == new.t else self._interpolated(
                old, new, t)]))
            self._next += 1
        if self.event is not None and (not self._stored or self._stored[-1]["t"][-1] < new.t):
            self._stored.append(columns_of([new]))

    def _interpolated(self, old, new, t):
        """The motion within a step, by a shorter step from the same start."""
        # Order, conserved quantities and closed joints are thus those of the scheme.
        h, s = new.t - old.t, (t - old.t) / (new.t - old.t)
        if s > 1.0 - 1e-12:
            return new
        if s < CLOSE:
            return self._follow(old.turns, interpolate(old, new, t))
        if self._side is None:
            self._side = integrator_of(self.system, self.scheme, self.task.tol)
        side = self._side
        side.forget()
        side.expect(self.integrator.energy)
        side.limit = self.integrator.limit
        found = side.step(old, s * h)
        self.integrator.count(side)
        found.t = t
        if s < self.scheme.near(self.system):
            smooth = interpolate(old, new, t)
            found.acceleration, found.multipliers = smooth.acceleration, smooth.multipliers
        return self._follow(old.turns, found)

    def columns(self) -> dict[str, Array]:
        """The stored arrays (nt, ...) by the names of the attributes of Motion."""
        if self._stored:
            return {name: np.concatenate([x[name] for x in self._stored]) for name in COLUMNS}
        return {name: np.zeros((0, *np.shape([] if x is None or name == "history" else x)))
                for name, x in ((name, getattr(self.y, name)) for name in COLUMNS)}

    def history(self) -> History:
        at_end = bool(self._stored) and self._stored[-1]["t"][-1] == self.y.t
        taken = self.integrator
        return History(self.system, self.scheme, self.columns(),
                       (self.y, self.arrays()) if at_end else (None, None),
                       self.recorder.readings(), event=self.event, steps=self.steps,
                       rejected=self.rejected, substeps=taken.substeps,
                       iterations=taken.iterations, factorizations=taken.factorizations)

    # checkpoints

    def arrays(self) -> dict[str, Any]:
        """Arrays by name from which, with :attr:`y`, a Run continues exactly."""
        found = self.integrator.arrays() | {"size": np.array(self._size)}
        if self._sizes is not None:
            found |= self._sizes.arrays()
        found["counts"] = np.array([self._segment, self._n, self._next, self.steps, self.rejected])
        return found

    def load(self, y: Motion, arrays: dict[str, Any], columns: dict[str, Array]) -> None:
        """Restore a stopped run."""
        self.y = y
        self._stored = [columns] if len(columns["t"]) else []
        self.integrator.load(arrays)
        if self._sizes is not None:
            self._sizes.load(arrays)
        counts = map(int, arrays["counts"])
        self._segment, self._n, self._next, self.steps, self.rejected = counts
        self._size = float(arrays["size"])
        self._limit()
        if not self._begun <= y.t <= self._end or self._sizes is None and (
                abs(self._time(self._n) - y.t) > 1e-9 * self._size):
            raise CheckpointError(f"the time {y.t} does not belong to the step {self._n}")


__all__ = ["Run", "Task", "TimeStepFailed", "integrator_of", "task_of"]
