"""Steps one at a time, with inputs that are given at each: for controllers, games, learning."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from ..actions.forces.springs import Turns
from ..actions.loads import Amplitude
from ..core import Array, ArrayLike, ConvergenceError, InputError, refuse, require_finite
from ..dynamics.base import Scheme
from ..dynamics.history import state_of
from ..dynamics.run import TimeStepFailed, integrator_of
from ..dynamics.sensors import locate, read, read_steps
from ..results.state import State


class Held(Amplitude):
    """A function of time whose value is set before each step. Sizes of loads are constant in a
    step, ``ramped`` motions go straight from one value to another."""

    def __init__(self, first: Any, ramped: bool) -> None:
        self.first, self.ramped = np.asarray(first, dtype=float), ramped
        self.set(self.first, self.first, 0.0, 1.0)

    def set(self, before: Array, value: Array, t: float, dt: float) -> None:
        """Set the values at both ends of the step from t to t + dt."""
        self._before, self._value, self._t, self._dt = before, value, t, dt

    def sampled(self, times: Array) -> Array:
        return np.full(len(times), self._value)

    def __call__(self, t: Any) -> Any:
        if not self.ramped:
            return float(self._value)
        part = min(max((t - self._t) / self._dt, 0.0), 1.0)
        return self._before + part * (self._value - self._before)


class Stepper:
    """A motion step by step. :meth:`Scene.stepper <skfem_ancf.Scene.stepper>` makes one.

    The numbers are those of ``scene.integrate`` with the same inputs, to the last bit. Copies and
    pickles continue in the same way.

    Parameters
    ----------
    scene
        A scene with the inputs.
    scheme, dt
        A :class:`~skfem_ancf.Scheme`, and the size of a step.
    held
        The inputs by name.
    start, velocity
        A State to start from, or None, and velocities without one, shape (N,).

    Attributes
    ----------
    inputs : list of str
        Names of the inputs.
    """

    def __init__(self, scene: Any, scheme: Scheme, dt: float, held: dict[str, Held],
                 start: State | None, velocity: Array) -> None:
        self.scene, self.dt, self.inputs = scene, dt, list(held)
        self._scheme, self._held, self._given = scheme, list(held.values()), (start, velocity)
        self.reset()

    def _begin(self):
        """The equations, and what takes steps of them."""
        self._system = s = self.scene.system
        if s.forces.sampled:
            raise InputError(f"{s.forces.sampled[0]!r} samples by itself, and a stepper is sampled "
                             "by its caller: leave out dt= of the Control")
        self._integrator, self._turns = integrator_of(s, self._scheme), Turns(s)
        self._integrator.longest = 1
        self._sensors = [(name, sensor, locate(sensor, s))
                         for name, sensor in self.scene.sensors.items()]

    def reset(self) -> Stepper:
        """Go back to the start."""
        motion = None if self._given[0] is None else self._given[0]._motion
        self._begun, self._n = 0.0 if motion is None else motion.t, 0
        self._values = [one.first for one in self._held]
        self._begin()
        self._set(self._values)
        self._y = self._start()
        return self

    def _start(self):
        """The Motion at the start, with accelerations due to the inputs."""
        s, (start, velocity) = self._system, self._given
        motion = None if start is None else start._motion
        u = np.zeros(s.N) if start is None else np.array(start.u)
        y = self._integrator.start(u, velocity if motion is None else motion.v, self._begun,
                                   self.dt, history=s.histories.of_state(start))
        y.turns = self._turns.begin(u) if motion is None else motion.turns
        return y

    def copy(self) -> Stepper:
        """A stepper that continues from here by itself."""
        return copy(self)

    def __getstate__(self):
        found = {name: value for name, value in vars(self).items()
                 if name not in ("_system", "_integrator", "_turns", "_sensors")}
        return found | {"arrays": self._integrator.arrays()}

    def __setstate__(self, state):
        arrays = state.pop("arrays")
        vars(self).update(state)
        self._begin()
        self._integrator.load(arrays)

    def _set(self, values):
        t = self._begun + self.dt * self._n
        for one, before, value in zip(self._held, self._values, values):
            one.set(before, value, t, self.dt)

    @property
    def t(self) -> float:
        """Time."""
        return self._y.t

    @property
    def u(self) -> Array:
        """Displacement of the degrees of freedom, shape (N,)."""
        return self._y.u

    @property
    def v(self) -> Array:
        """Their velocity, shape (N,)."""
        return self._y.v

    @property
    def state(self) -> State:
        """The :class:`~skfem_ancf.State` at the end of the last step."""
        return state_of(self._system, self._scheme, self._y)

    @property
    def readings(self) -> dict[str, Array]:
        """Values of the sensors of the scene by name."""
        fields = [sensor for _, sensor, _ in self._sensors if not sensor.moving]
        state: Any = self.state if fields else None
        return {name: read_steps(sensor, at, [self._y])[0] if sensor.moving else
                read(sensor, at, state) for name, sensor, at in self._sensors}

    def step(self, inputs: ArrayLike = ()) -> Stepper:
        """Take a step.

        Raises ConvergenceError if the step fails, halved steps too; the stepper stays where it was.

        Parameters
        ----------
        inputs
            Sizes of the inputs in this step, shape (k,), in the order of :attr:`inputs`; a
            prescribed position has two numbers.
        """
        plain = type(inputs) is np.ndarray and inputs.dtype == float and np.isfinite(inputs).all()
        given = np.atleast_1d(inputs if plain else require_finite("inputs", inputs))  # 10 us less
        first, values = 0, []
        for one in self._held:
            # a copy: the caller may use the array again
            values.append(given[first:first + one.first.size].reshape(one.first.shape).copy())
            first += one.first.size
        refuse(given.shape != (first,), "inputs must have the shape ({},) of {}, got {}", first,
               self.inputs, given.shape)
        self._set(values)
        y = self._y if self._n else self._start()
        taken = self._integrator.run(y, self.dt, 1, self._begun, self._n)
        try:
            self._y = taken[0] if taken else self._integrator.step(y, self.dt)  # in halves
        except TimeStepFailed as failure:
            raise ConvergenceError(f"the step from t = {y.t:.6g} failed: {failure}; try a smaller "
                                   "dt", self.state) from None
        self._n, self._values = self._n + 1, values
        self._y.turns = self._turns.follow(y.turns, self._y.u[None])[0]
        return self
