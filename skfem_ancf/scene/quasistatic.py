"""Quasi-static runs: loads, supports and obstacles as functions of time, without inertia."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..actions.forces.springs import Turns
from ..core.errors import (ConvergenceError, InputError, Interrupted, NameUnknown, require_finite,
                           require_flag, require_increasing, require_integer, require_positive,
                           shown)
from ..core.immutable import Immutable
from ..core.progress import progress_bar
from ..core.types import Array
from ..dynamics.base import Motion, Scheme
from ..dynamics.history import COLUMNS, History, state_of
from ..dynamics.sensors import Recorder, Sensor
from ..equations.system import System
from .solve import displacement
from ..results.state import State
from ..solvers.newton import Steps as Rules
from ..solvers.outcome import StaticResult, StepFailed
from ..solvers.quasistatic import JUMPED, Instant, first, follow


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
        if unnamed or not durations:
            raise InputError("give durations by name, as Steps(press=1.0, release=1.0) or "
                             f"Steps(**{{'press': 1.0}}), got Steps{shown(unnamed)}")
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

        Parameters
        ----------
        start
            The value at time 0: a number or a vector, shape (k,); zero by default.
        **values
            Values at the ends of steps by name; in steps without a value it is constant.

        Raises
        ------
        NameUnknown, InputError
            If a step is unknown, or if there is no value.
        """
        for name in values:
            if name not in self.names:
                raise NameUnknown("step", name, self.names)
        if not values and start is None:
            raise InputError(f"ramp() has no values: give one at the end of a step, as ramp("
                             f"{self.names[0]}=1.0)")
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


logger = logging.getLogger(__name__)


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
        return self.t[[way.startswith(JUMPED) for way in self.found_by]]

    def during(self, step: str) -> Array:
        """Indices of the instants of a step, its start and end included."""
        if self.plan is None:
            raise InputError("the run had no named steps: scene.run(Steps(press=1, pull=1))")
        if step not in self.plan.names:
            raise NameUnknown("step", step, self.plan.names)
        k, ends = self.plan.names.index(step), np.append(0.0, self.plan.ends)
        slack = 1e-12 * ends[-1]
        return np.nonzero((self.t >= ends[k] - slack) & (self.t <= ends[k + 1] + slack))[0]


def run(system: System, steps: Steps | ArrayLike, increments: int = 20,
        start: State | None = None, sensors: Sequence[tuple[str, Sensor]] = (), *,
        tol: float = 1e-8, max_iterations: int = 30, min_step: float = 1e-4, stable: bool = True,
        progress: bool | None = None) -> StepHistory:
    """Equilibria over the time of steps, see :meth:`skfem_ancf.Scene.run`.

    ``sensors`` are names and :class:`~skfem_ancf.dynamics.sensors.Sensor`.
    """
    ends = _ends_of(steps)
    increments = require_integer("increments", increments, 1, 100000)
    rules = Rules("auto", require_positive("tol", tol),
                  require_integer("max_iterations", max_iterations, 1, 10000), 1.0,
                  require_positive("min_step", min_step))
    if rules.min_step > 1.0:
        raise InputError(f"min_step must be at most 1, the part of an increment, got {min_step!r}")
    require_flag("stable", stable)
    u = None if start is None else displacement(system, start)
    t_start = 0.0 if start is None else float(start.t or 0.0)
    if ends[-1] <= t_start:
        raise InputError(f"the steps end at t = {ends[-1]:g}, which is not after the start at t = "
                         f"{t_start:g}")
    made = _Record(system, steps if isinstance(steps, Steps) else None, sensors)
    made.t = t_start
    try:
        with (system.histories.lent(),
              progress_bar(progress, total=ends[-1] - t_start, desc="time") as bar):
            begin = _begin(system, t_start, start, u, rules, stable)
            for instant in follow(system, ends, increments, begin, rules, stable):
                bar.update(instant.t - made.t)
                made.add(instant)
    except (StepFailed, ConvergenceError) as failure:
        raise ConvergenceError(
            f"no equilibrium found after t = {made.t:.6g}: {failure}. The error's state is the "
            "history up to there; a motion with damping (scene.integrate) goes through what has "
            "no equilibrium", made.history()) from None
    except KeyboardInterrupt:
        raise Interrupted(f"stopped at t = {made.t:.6g}; the exception's state is the history up "
                          "to there", made.history()) from None
    return made.history()


def _ends_of(steps):
    """Times at which steps end, (n,)."""
    if isinstance(steps, Steps):
        return steps.ends
    if isinstance(steps, dict):
        raise InputError(f"steps are given by name as Steps(**{shown(steps)}), got a dict")
    one = not isinstance(steps, (list, tuple)) and np.ndim(steps) == 0
    return require_increasing("steps", [steps] if one else steps)


def _begin(system, t, start, u, rules, stable):
    """The first instant: ``start`` if it belongs to a run of the scene, or computed from it."""
    memory = system.histories.of_state(start)
    motion = None if start is None else start._motion
    if motion is None or start.system is not system or not isinstance(
            start._origin[0], QuasiStatic):
        begin = first(system, t, u, memory, rules, stable)
    else:
        begin = Instant(t, StaticResult(u, start.multipliers, 1.0, np.zeros(system.N), [], True,
                                        "given", memory=memory), "given")
    begin.result.rubbed = 0.0 if motion is None else motion.dissipated
    return begin


class _Record:
    """Results so far."""

    def __init__(self, system: System, plan: Steps | None,
                 sensors: Sequence[tuple[str, Sensor]]) -> None:
        self.system, self.plan, self.scheme = system, plan, QuasiStatic()
        self._turns = Turns(system)
        self._instants: list[Instant] = []
        self._motions: list[Motion] = []
        self._recorder = Recorder(sensors, system, lambda y: state_of(system, self.scheme, y))
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
        empty = np.zeros((0, self.system.N))
        columns: dict[str, Any] = {name: np.array(
            [_stored(getattr(y, name)) for y in self._motions]) for name in COLUMNS}
        if not self._motions:
            columns |= dict.fromkeys(("u", "v", "acceleration"), empty)
        results = [instant.result for instant in self._instants]
        return StepHistory(
            self.system, self.scheme, columns, (None, None), self._recorder.readings(),
            event=None, steps=max(0, len(results) - 1), substeps=0, rejected=0,
            iterations=sum(x.iterations for x in results), factorizations=0, plan=self.plan,
            found_by=[x.way for x in self._instants],
            iterations_at=np.array([x.iterations for x in results], dtype=int))


def _stored(value):
    return np.zeros(0) if value is None else value
