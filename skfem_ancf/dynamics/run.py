"""A motion on its way: steps, their sizes, instants to store, and what it takes to go on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import ceil, ulp
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..core.errors import (AncfError, CheckpointError, InputError, ask_number, require_finite,
                           require_finite_scalar, require_positive, shown)
from .base import Motion, Scheme, contacts_of, interpolate, recalled
from .history import History
from .integrator import DEPTH, Integrator, StepFailed
from .sensors import Recorder
from .stepsize import StepSize

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..results.state import State
    from ..equations.system import System
    from ..core.types import Array
    from .sensors import Sensor

#: Steps of a motion, at most.
MAX_STEPS = 10**9
#: The smallest tolerance of automatic steps.
MIN_RTOL = 1e-12
EPS = np.finfo(float).eps
#: Part of a step by which one may end before an instant that is looked for there.
NEARLY = 1e-6
#: Part of a step up to which an instant is interpolated: a step that short is all round-off.
CLOSE = 1e-6
#: Coordinates times steps of a block: after some hundredths of a second, compiled, and about a
#: second in NumPy it is to be seen, by a progress bar, and on Ctrl-C.
SHOWN = 50_000
#: Iterations of a step, about, and steps of automatic size in a motion, as many as may be expected.
ITERATIONS, AUTOMATIC = 3, 1000
#: Part of the motion below which a step that fails is not taken again in one half as long.
SHORTEST = 1e-7
#: Part of a step to which an event is found.
EXACT = 1e-10


@dataclass
class Task:
    """What is asked for.

    Attributes
    ----------
    t_start, t_end
        Times of start and end.
    dt
        Step size, or None for an automatic one.
    tol, rtol
        Tolerances of the iteration (None: the scheme's), and of the automatic step size.
    t_eval
        Times to store, shape (n,), or None for all steps.
    breakpoints
        Times inside of the motion at which a step ends and the next starts afresh.
    """

    t_start: float
    t_end: float
    dt: float | None = None
    tol: float | None = None
    rtol: float = 1e-5
    t_eval: np.ndarray | None = None
    breakpoints: tuple[float, ...] = ()

    @property
    def span(self) -> float:
        """Length of the motion in time."""
        return self.t_end - self.t_start


def task_of(t_start: Any, t_end: Any, dt: Any, t_eval: Any, tol: Any, rtol: Any,
            breakpoints: Any) -> Task:
    """What is asked for, checked: arguments of :func:`~skfem_ancf.dynamics.integrate.integrate`.

    Parameters
    ----------
    t_start, t_end, dt, t_eval, tol, rtol, breakpoints
        As for that function; ``t_eval`` and ``breakpoints`` of shape (n,).

    Raises
    ------
    InputError
        If they do not fit.
    """
    t_start = require_finite_scalar("t_start", t_start)
    t_end = require_finite_scalar("t_end", t_end)
    span = require_positive("t_end - t_start", t_end - t_start)
    auto = isinstance(dt, str)
    if auto and dt != "auto":
        raise InputError(f'dt must be a positive number or "auto", got {dt!r}')
    dt = None if auto else min(require_positive("dt", dt), span)
    _require_step(t_start, t_end, 1e-4 * span if auto else dt)
    if t_eval is not None:
        t_eval = require_finite("t_eval", t_eval, (None,))
        if (not len(t_eval) or len(t_eval) > 1 and (t_eval[1:] <= t_eval[:-1]).any()
                or t_eval[0] < t_start
                or t_eval[-1] > t_end * (1 + 1e-12)):
            raise InputError(f"t_eval must increase within [{t_start}, {t_end}], got "
                             f"{shown(t_eval)}")
    tol = None if tol is None else require_positive("tol", tol)
    rtol = require_positive("rtol", rtol)
    if rtol < MIN_RTOL:
        raise InputError(f"rtol must be at least {MIN_RTOL:g}, got {rtol!r}")
    inside = []
    if len(breakpoints):
        breaks = np.unique(require_finite("breakpoints", breakpoints, (None,)))
        inside = breaks[(breaks > t_start + 1e-9 * span) & (breaks < t_end - 1e-9 * span)].tolist()
    return Task(t_start, t_end, dt, tol, rtol, t_eval, tuple(inside))


def _require_step(t_start, t_end, step):
    """Raise InputError where the times of the steps cannot be told apart, or never end."""
    if step < 1e-100 or t_end > 1e100:  # their squares are in the equations
        raise InputError(f"times must lie between 1e-100 and 1e100, got dt = {step!r}, t_end = "
                         f"{t_end!r}")
    if step <= 8 * EPS * max(abs(t_start), abs(t_end)):
        raise InputError(f"dt = {step!r} is below the round-off of the times {t_start!r} to "
                         f"{t_end!r}")
    steps = (t_end - t_start) / step
    if steps > MAX_STEPS:
        raise InputError(f"dt = {step!r} takes {steps:.3g} steps to t_end = {t_end!r}: more than "
                         f"{MAX_STEPS:.0e} are not taken")


class Run:
    """The loop over steps, so that it can stop after any of them and go on.

    Parameters
    ----------
    system, scheme
        What is integrated, and how.
    task : Task
        From when to when, and what to store.
    sensors
        Pairs of name and :class:`~skfem_ancf.dynamics.sensors.Sensor`.

    Attributes
    ----------
    y : Motion
        Where the motion is.
    history : History
        The instants stored so far.
    steps, rejected
        Steps done, and steps that the automatic size took again.
    longest
        Steps of a block at most, or None.
    until
        A function of a State whose change of sign ends the motion, or None.
    event
        The time at which it did, or None.
    """

    def __init__(self, system: System, scheme: Scheme, task: Task,
                 sensors: Sequence[tuple[str, Sensor]] = ()) -> None:
        self.system, self.scheme, self.task = system, scheme, task
        self.integrator = Integrator.lent(system, scheme, task.tol)
        self._side: Integrator | None = None
        self.sizes = None
        if task.dt is None:
            self.sizes = StepSize(system, scheme, task.rtol, task.t_start, task.t_end)
        self._times = task.t_start, *task.breakpoints, task.t_end
        self.segment = self.n = self._next = self.steps = self.rejected = 0
        self.size = 1e-4 * task.span if task.dt is None else task.dt
        self.history = History(system, scheme, self)
        self._turns = self.history._turns
        self.recorder = Recorder(sensors, system, self.history.instant)
        self.y: Any = None
        self.longest: int | None = None
        self.until: Callable[[State], float] | None = None
        self.event: float | None = None
        self._stuck = 0
        self._value: float | None = None
        self._in_blocks = scheme.in_blocks(system)
        self._limit()

    # the start

    def _sample(self, u, v, t, first):
        """Ask controls whose law is asked now and then, if it is their time."""
        s = self.system
        if s.forces.sampled:
            s.forces.sample(s.machine.tables.plain.forces, u, v, t, first)

    def begin(self, u: Array, v: Array, memory: Array | None = None,
              turns: Array | None = None) -> None:
        """Begin with a displacement and a velocity.

        Parameters
        ----------
        u, v
            Of the coordinates, shape (N,).
        memory
            What points remember of obstacles there, shape (k,), or None.
        turns
            Angles there, those of another motion of this scene, shape (k,), or None.
        """
        self._sample(u, v, self.task.t_start, True)
        self.y = self._start(u, v, memory)
        known = self._turns
        if turns is None or len(turns) != known.number:
            turns = known.begin(self.y.u)
        self._follow(turns, self.y)
        self._store_start()

    def _start(self, u, v, memory):
        """The Motion where a segment begins."""
        if self._in_blocks and self.until is None and self._whole > 0:
            self.integrator.ask(self._begun, self.size, self._whole)
        return self.integrator.start(u, v, self._begun, self._first_step(), memory=memory)

    def _follow(self, last, y):
        """Tell a Motion by how much everything has turned, from the angles (k,) before; it."""
        y.turns = self._turns.follow(last, y.u[None])[0]
        return y

    def go_on(self, y: Motion, memory: dict[str, Any] | None = None) -> None:
        """Begin where another run of the same scene was.

        Parameters
        ----------
        y
            Its Motion there.
        memory
            What its :meth:`remember` gave, or None.
        """
        self.y = replace(y, t=self.task.t_start)
        if memory is not None:
            self.integrator.recall(memory)
            self.integrator.reset()
            if self.sizes is not None and "averages" in memory:
                self.size = min(float(memory["size"]), self.task.span)
                self.sizes.recall(memory)
        self._store_start()

    def _store_start(self):
        self.recorder.record([self.y])
        wanted = self.task.t_eval
        if wanted is None or wanted[0] <= self.task.t_start:
            self.history.append(self.y)
            self._next = 1

    @property
    def iterations(self) -> float:
        """Those that are expected from here to the end, about."""
        y, task = self.y, self.task
        left = task.t_end - (task.t_start if y is None else y.t)
        return ITERATIONS * (AUTOMATIC * left / task.span if task.dt is None else left / task.dt)

    def _first_step(self):
        """Size of the first step of a segment."""
        return min(self.size, self._end - self._begun)

    def give_back(self) -> None:
        """Leave the work arrays to the next motion: this one has ended."""
        for one in (self.integrator, self._side):
            if one is not None:
                one.give_back()

    # segments between breakpoints

    @property
    def _begun(self):
        return self._times[self.segment]

    @property
    def _end(self):
        return self._times[self.segment + 1]

    @property
    def _last(self):
        return self.segment == len(self._times) - 2

    @property
    def done(self) -> bool:
        """True at the end of the motion."""
        return self.event is not None or (self._last and self.y.t >= self._end)

    def _limit(self):
        """Functions of time are asked before a breakpoint in the steps that end there."""
        near = 16 * ulp(max(abs(self._begun), abs(self._end)))
        self.integrator.limit = np.inf if self._last else self._end - near
        self._count = 0 if self.sizes else max(1, ceil(
            (self._end - self._begun) / self.size * (1 - 1e-12)))
        even = abs(self._begun + self._count * self.size - self._end) < 1e-9 * self.size
        # the last step may be shorter; the others are of one size, to keep the factors
        self._whole = self._count if even and self._last else self._count - 1

    def _turn(self, y):
        """Beyond a breakpoint: accelerations and rates are those of what comes."""
        self.segment, self.n = self.segment + 1, 0
        self._limit()
        if self.sizes is not None:
            self.size = 1e-4 * self.task.span
            self.sizes.begin()
        self._sample(y.u, y.v, self._begun, False)
        turned = self._start(y.u, y.v, contacts_of(y))
        turned.dissipated = y.dissipated
        return self._follow(y.turns, turned)

    # steps

    def advance(self) -> None:
        """Go on by a step, or by a block of them; raises StepFailed."""
        if self.sizes is not None:
            self._automatic()
            return
        old = self.y
        if self._in_blocks and self.until is None and self.n < self._whole:
            taken = self._block()
            if taken:
                self._store_block(taken)
                return
        h = self._end - old.t
        if self.n < self._count - 1 or abs(h - self.size) < 1e-9 * self.size:
            h = self.size
        new = self.integrator.step(old, h)
        new.t = self._time(self.n + 1)
        self._commit(old, new)

    def _block(self):
        """A block of steps of one size, :data:`SHOWN` over the number of coordinates or fewer."""
        size = self.integrator.longest
        first = self.n - self.n % size
        block = first, min(first + size, self._whole)
        number = min(block[1] - self.n, max(1, SHOWN // self.system.N))
        if self.longest is not None:
            number = min(number, self.longest - self.n % self.longest)
        try:
            taken = self.scheme.run(self.integrator, self.y, self.size, number, self._begun,
                                    self.n, block)
        except AncfError:  # of a function of the caller's: go on as far as it goes
            self._in_blocks = False
            return None
        if not taken:  # not one of them, or a scheme of one's own says so
            return None
        if self.n + len(taken) == self._count:
            taken.end = self._end
        taken.turns = self._turns.follow(self.y.turns, taken.rows[:len(taken), 0])
        return taken

    def _time(self, n):
        """Time after n steps of the segment."""
        return self._begun + n * self.size if n < self._count else self._end

    def _automatic(self):
        """One step of automatic size, or a rejected one."""
        y = self.y
        left = self._end - y.t
        h = self.sizes.cut(y.t, min(self.size, left))
        if left < (1 + 1e-3) * h:
            h = left
        elif left < 2 * h:
            h = 0.5 * left
        touches = self.system.forces.contacts.obstacles  # when, is found in parts of a step
        try:
            new = (self.integrator.step if touches else self.integrator.attempt)(y, h)
            error = self.sizes.error(self.integrator, y, new, h)
            self.size, kept = self.sizes.next(error, h, self.size)
        except StepFailed:
            if h < SHORTEST * self.task.span:
                raise
            self.size, kept, self._stuck = 0.5 * h, False, self._stuck + 2
            past = self.integrator.leap(y, h) if self._stuck >= 2 * DEPTH else None
            if past is not None and past.t < self._end:
                new, h, error, kept, self._stuck = past, past.t - y.t, 1.0, True, 0
        if not kept:
            self.rejected += 1
            return
        self._stuck = max(0, self._stuck - 1)  # steps that fail between others that do not
        if h == left:
            new.t = self._end
        self._commit(y, new)

    def _commit(self, old, new):
        """A step is done."""
        self._follow(old.turns, new)
        if self.until is not None:
            new = self._look(old, new)
        if self.event is None and new.t >= self._end and not self._last:
            new = self._turn(new)
            if self.until is not None:
                self._look_beyond(new)
        else:
            self.n += 1
        self.recorder.record([new])  # first: functions of the caller's may end it here
        self._store(partial(_same, old), new)
        self.y, self.steps = new, self.steps + 1

    def _look(self, old, new):
        """The end of a step, or the instant in it at which the event is."""
        before = self._asked(old) if self._value is None else self._value
        self._value = self._asked(new)
        if before == 0.0 or before * self._value > 0.0:
            return new
        root = scipy.optimize.brentq(lambda t: self._asked(self._between(old, new, t)), old.t,
                                     new.t, xtol=EXACT * (new.t - old.t))
        new = self._between(old, new, root)
        self.event = new.t
        return new

    def _look_beyond(self, new):
        """What a breakpoint changes at once is an event there."""
        before, self._value = self._value, self._asked(new)
        if before * self._value < 0.0:
            self.event = new.t

    def _asked(self, y):
        return ask_number("until(state)", self.until, self.history.instant(y))

    # storage

    def _wanted(self):
        """The next time to store."""
        wanted = self.task.t_eval
        return np.inf if wanted is None or self._next == len(wanted) else float(wanted[self._next])

    def _store(self, begin, new):
        """Keep what was asked for of a step to a Motion; ``begin()`` is the one before it."""
        if self.task.t_eval is None:
            self.history.append(new)
            return
        until = new.t + 1e-14 * max(abs(self.task.t_start), abs(self.task.t_end))
        while (t := self._wanted()) <= until:
            self.history.append(new if t == new.t else self._between(begin(), new, t))
            self._next += 1
        if self.event is not None:
            self.history.end(new)

    def _store_block(self, taken):
        """The same for steps taken together; those are made that hold a time to store."""
        first, k, last, done = self.n, -1, self.y, len(taken)
        if self.recorder.sensors:
            self.recorder.record(list(taken))
        if self.task.t_eval is None:
            self.history.extend(taken)
            k, last = done - 1, taken[done - 1]
        while k < done - 1:
            old, k = k, k + 1
            wanted = self._wanted()
            until = (wanted - self._begun) / self.size - 1 - first if wanted < np.inf else done
            k = min(max(k, ceil(until - NEARLY)), done - 1)
            begin = partial(taken.__getitem__, k - 1) if k > old + 1 else partial(_same, last)
            last = taken[k]
            self._store(begin, last)
        self.n, self.steps, self.y = first + done, self.steps + done, last

    def _between(self, old, new, t):
        """The motion at a time within a step: by a shorter step from the same start.

        So it has what a step of the scheme keeps: its order, energy and momenta, closed joints.
        """
        h, s = new.t - old.t, (t - old.t) / (new.t - old.t)
        if s > 1.0 - 1e-12:
            return new
        if s < CLOSE:
            return self._follow(old.turns, interpolate(old, new, t))
        if self._side is None:
            self._side = Integrator.lent(self.system, self.scheme, self.task.tol)
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

    # what it takes to go on

    def remember(self) -> dict[str, Any]:
        """Numbers and arrays that, with :attr:`y` and the history, make a Run go on exactly."""
        memory = self.integrator.remember()
        if self.sizes is not None:
            memory.update(self.sizes.remember())
        memory["size"] = self.size
        for k, control in enumerate(self.system.forces.sampled):
            memory[f"held {k}"] = control.held
        memory["counts"] = self.segment, self.n, self._next, self.steps, self.rejected
        return memory

    def recall(self, y: Motion, memory: dict[str, Any]) -> None:
        """Go on with what :meth:`remember` gave.

        Parameters
        ----------
        y
            Where the motion is.
        memory
            Numbers and arrays by name.
        """
        self.y = y
        self.integrator.recall(memory)
        if self.sizes is not None:
            self.sizes.recall(memory)
        for k, control in enumerate(self.system.forces.sampled):
            control.hold(memory[f"held {k}"])
        counts = recalled(memory, "counts", (5,), "i").tolist()
        self.segment, self.n, self._next, self.steps, self.rejected = counts
        self.size = float(recalled(memory, "size", ()))
        wanted = self.task.t_eval
        if min(counts) < 0 or self.segment > len(self._times) - 2 or self._next > (
                1 if wanted is None else len(wanted)) or not self.size > 0.0:
            raise CheckpointError(f"the counts of steps are {counts}, their size {self.size}")
        self._limit()
        if not self._begun <= y.t <= self._end or self.sizes is None and (
                self.n > self._count or abs(self._time(self.n) - y.t) > 1e-9 * self.size):
            raise CheckpointError(f"the time {y.t} is not that of the step {self.n}")


def _same(y):
    return y


__all__ = ["Run", "StepFailed", "Task", "interpolate"]
