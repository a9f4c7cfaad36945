"""For controllers: linear models about a state, and motions one step at a time."""

from collections.abc import Sequence
from copy import copy
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy
from scipy import sparse
from scipy.sparse.linalg import splu

from ..actions.forces.springs import Turns
from ..actions.loads import Amplitude, Load
from ..beam import BeamPoints
from ..core import (Array, ArrayLike, ConvergenceError, InputError, ModelWarning, SupportError,
                    refuse, require_finite, require_integer, warn)
from ..dynamics.base import Scheme
from ..dynamics.history import state_of
from ..dynamics.run import TimeStepFailed, integrator_of
from ..dynamics.sensors import Sensor, locate, read, read_steps
from ..equations.matrices import matrices_of
from ..results.modes import FrequencyResponse
from ..results.state import State
from ..solvers import eigen

#: Shift of the stiffness for a static correction, relative to the highest kept eigenvalue.
SHIFT = 1e-6
#: Relative effect of the rate of an input on a reading that is round-off.
DIRECT = 1e-9
#: Change of a prescribed motion for derivatives of joints, in radians.
TURN = 1e-5


class Readings(NamedTuple):
    """Derivatives of readings by u (r, N), u', u'', and the multipliers (r, m)."""

    u: Array
    v: Array
    a: Array
    multipliers: Array


class StateSpace(NamedTuple):
    """``x' = A x + B s``, ``y = C x + D s`` for changes s of the inputs and y of the outputs.

    x are 2 n numbers: n coordinates q with ``u = T q``, and their rates. For inputs s that are
    prescribed motions these are coordinates relative to what s makes at once. scipy.signal and
    python-control take ``model.state_space()[:4]``.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    T: Array


class LinearModel:
    """The linearised equations of a scene about a state, with inputs and outputs.

    ``M u'' + D u' + K u + J^T l = B s``, ``J u = G s``, ``y = C u + ...`` for small changes of the
    displacement u, of sizes s of loads and prescribed motions, and of readings y of sensors.
    :meth:`Scene.linearize <skfem_ancf.Scene.linearize>` makes one.

    Parameters
    ----------
    system, state
        The :class:`~skfem_ancf.equations.system.System` of the scene, and its State.
    inputs
        For each its name, its bound Loads, and the joint that it drives or None.
    sensors
        Names and :class:`~skfem_ancf.dynamics.sensors.Sensor`.

    Attributes
    ----------
    matrices
        :class:`~skfem_ancf.SceneMatrices` about the state.
    inputs, outputs : list of str
        Their names, k and r.
    B
        Forces of unit inputs, (N, k).
    G
        Right-hand sides of the joints for unit inputs, (m, k).
    prescribed
        Displacements of fixed degrees of freedom for unit inputs, (N, k).
    readings
        Derivatives of the outputs by displacement, velocity and acceleration, (r, N) each, and by
        the multipliers, (r, m).
    """

    def __init__(self, system: Any, state: State, inputs: Sequence[tuple[str, Sequence[Load], Any]],
                 sensors: Sequence[tuple[str, Sensor]]) -> None:
        self.state, self._system = state, system
        self.matrices = matrices_of(system, state)
        self._free = system.constraints.free
        refuse(np.any(state.v), "a linear model is about a state at rest, and this one moves")
        if relaxing := system.histories.relaxing():
            warn(f"a linear model has the stiffness at once of {relaxing[0]!r}, which relaxes in "
                 "time: integrate(...) has all of it", ModelWarning)
        refuse(not inputs or not sensors, "a linear model has inputs, as [PointForce((0, 1), at="
               "(1, 0))], and outputs, as scene.sensor('tip', 'displacement', at=(1, 0))")
        columns = [(name, _columns(system, state, *item)) for name, *item in inputs]
        self.inputs = [label for name, c in columns for label in _labels(name, len(c))]
        self.B, self.G, self.prescribed = (
            np.column_stack(parts) for parts in zip(*(c for _, some in columns for c in some)))
        rows = [(name, rows_of(system, state, sensor)) for name, sensor in sensors]
        self.outputs = [label for name, row in rows for label in _labels(name, len(row.u))]
        self.readings = Readings(*(np.concatenate(parts) for parts in zip(*(r for _, r in rows))))

    def __repr__(self) -> str:
        return (f"<LinearModel of {self._free.sum()} unknowns, inputs {self.inputs}, outputs "
                f"{self.outputs}>")

    # state space

    def state_space(self, modes: int | None = None) -> StateSpace:
        """Matrices of the state space, joints and supports eliminated.

        Raises InputError if a material has no density, an output is the force of a joint, or the
        velocity or acceleration that a prescribed motion causes at once: it needs the rate of the
        input.

        Parameters
        ----------
        modes
            Reduce to this number of lowest modes, with the static response of all others in D; by
            default all coordinates. With modes the numbers of slender beams are more accurate, as
            the assembled stiffness has the round-off of (L / h)^2.
        """
        if np.any(self.readings.multipliers):
            raise InputError("an output is the force of a joint, which a state space eliminates: "
                             "use frequency_response()")
        system, (_, D, K, _, J) = self._system, self.matrices
        # the basis (N, n) of all motions that joints allow, or of the lowest modes
        if modes is None:
            T = np.diag(system.constraints.coordinate_sizes)[:, self._free]
            T = T @ scipy.linalg.null_space(J @ T) if J.shape[0] else T
            M, D, K = (T.T @ (A @ T) for A in (self._mass(), D, K))
        else:
            found = eigen.modes(system, self.state, require_integer("modes", modes, 1))
            T = found.shapes.T
            refuse(np.iscomplexobj(T), "modes are complex: use state_space() without modes")
            M, D = np.eye(T.shape[1]), T.T @ (D @ T)
            K = np.diag(found.eigenvalues.real) if system.symmetric else T.T @ (K @ T)
        n, inertia, U = len(M), scipy.linalg.cho_factor(M), np.zeros_like(self.B)
        # static displacements of unit prescribed motions, and their forces
        if np.any(self.G) or np.any(self.prescribed):
            slow = SHIFT * system.scales.bending_eigenvalue
            U = self._dynamic.solve((1.0, 0.0, slow), 0.0 * self.B, self.G)[0]
        m, d, k = (T.T @ (A @ U) for A in (self._mass(), *self.matrices[1:3]))
        # q + M^-1 m s and its rate less M^-1 d s are the state, which the rates of s leave out
        shift = scipy.linalg.cho_solve(inertia, m)
        rate = scipy.linalg.cho_solve(inertia, D @ shift - d)
        force = scipy.linalg.cho_solve(inertia, T.T @ self.B + K @ shift - k - D @ rate)
        lower = -scipy.linalg.cho_solve(inertia, np.hstack([K, D]))
        A = np.block([[np.zeros((n, n)), np.eye(n)], [lower]])
        u, v, a, _ = self.readings
        moved = U - T @ shift
        refuse(np.any(np.abs((v + a) @ moved) + np.abs(a @ T @ rate) > DIRECT * np.abs(
            v + a) @ np.abs(U)), "an output depends on the rate of a prescribed motion: read "
               "displacements, or use frequency_response()")
        C = np.hstack([u @ T, v @ T]) + a @ T @ lower
        through = a @ T @ force + u @ moved + v @ T @ rate
        if modes is not None:  # static displacements of unit inputs without those of modes
            slow = SHIFT * max(np.abs(np.diag(K)).max(), np.finfo(float).tiny)
            rest = self._dynamic.solve((1.0, 0.0, slow), self.B, self.G)[0] - (
                T @ np.linalg.solve(K + slow * np.eye(n), T.T @ self.B))
            through = through + u @ np.where(U.any(axis=0), 0.0, rest)
        return StateSpace(A, np.vstack([rate, force]), C, through, T)

    def _mass(self):
        refuse(self.matrices.M is None, "a material has no density: give density= of the material")
        return self.matrices.M

    # frequencies

    def frequency_response(self, frequencies: ArrayLike,
                           modes: int | None = None) -> FrequencyResponse:
        """The harmonic response: amplitudes of ``y exp(i omega t)`` for inputs ``exp(i omega t)``.

        One sparse factorisation for each frequency, with the damping matrix as it is.

        Parameters
        ----------
        frequencies
            Angular frequencies omega in rad/s, shape (n,); 0 for the static response.
        modes
            Superpose this number of lowest modes and the static response of all others, as in
            :meth:`state_space`: faster for many frequencies well below the last of them.
        """
        omega = np.atleast_1d(require_finite("frequencies", frequencies))
        refuse(omega.ndim != 1, "frequencies must be an array (n,), got the shape {}", omega.shape)
        missing = "" if omega.all() else self._system.constraints.missing_supports
        if missing:
            raise SupportError(f"there is no static response, at the frequency 0: {missing}")
        if modes is not None:
            A, B, C, D, _ = self.state_space(modes)
            dynamic = 1j * omega[:, None, None] * np.eye(len(A)) - A
            values = C @ np.linalg.solve(dynamic, B[None]) + D
            return FrequencyResponse(omega, values, tuple(self.inputs), tuple(self.outputs))
        dynamic = self._dynamic
        out = np.empty((len(omega), len(self.outputs), len(self.inputs)), complex)
        for k, w in enumerate(omega):
            u, multipliers = dynamic.solve((1.0, 1j * w, -w * w), self.B, self.G)
            r = self.readings
            out[k] = (r.u + 1j * w * r.v - w * w * r.a) @ u + r.multipliers @ multipliers
        return FrequencyResponse(omega, out, tuple(self.inputs), tuple(self.outputs))

    @cached_property
    def _dynamic(self):
        _, D, K, _, J = self.matrices
        return Bordered((K, D, self._mass()), J, self._system.constraints, self.prescribed)


class Factors(NamedTuple):
    """LU factors of a scaled matrix, of the unknowns that are kept."""

    lu: Any
    left: Array
    right: Array
    keep: Array

    @classmethod
    def of(cls, rows: Any, left: Array, right: Array, keep: Array) -> "Factors":
        """Those of a matrix of blocks, scaled from both sides."""
        A = sparse.diags_array(left) @ sparse.block_array(rows, format="csr") @ (
            sparse.diags_array(right))
        return cls(splu(sparse.csc_array(A[keep][:, keep])), left, right, keep)

    def solve(self, b: Array, trans: str = "N") -> Array:
        """The solution for b (k,) or (k, n); zero where it is not kept."""
        before, after = (self.left, self.right) if trans == "N" else (self.right, self.left)
        b = (b.T * before).T[self.keep]
        x = (self.lu.solve(b, trans).T * after[self.keep]).T
        out = np.zeros((len(self.keep), *b.shape[1:]), x.dtype)
        out[self.keep] = x
        return out


class Bordered:
    """Solutions with sums of matrices such as K, D and M, with joints and supports. ``prescribed``
    are displacements of fixed degrees of freedom, (N, k)."""

    def __init__(self, matrices: Sequence[Any], J: Any, constraints: Any,
                 prescribed: Array) -> None:
        self._free, self._prescribed, self._J = constraints.free, prescribed, J
        self._matrices, m = matrices, J.shape[0]
        self._keep = np.append(self._free, np.ones(m, bool))
        # rows of joints by the size of the stiffness: pivots of one size
        s = constraints.coordinate_sizes
        scale = np.abs(matrices[0].diagonal() * s**2)[self._free].max()
        self._sizes = np.append(s, np.full(m, scale))

    def solve(self, factors: Sequence[complex], B: Array, G: Array) -> tuple[Array, Array]:
        """Displacements (N, k) and multipliers (m, k) for forces B and right-hand sides G."""
        K, solver = self._factors(factors)
        x = solver.solve(np.concatenate([B - K @ self._prescribed, G - self._J @ self._prescribed]))
        u, multipliers = np.split(x, [len(self._free)])
        return np.where(self._free[:, None], u, self._prescribed), multipliers

    def adjoint(self, factors: Sequence[float], by: Array) -> Array:
        """The adjoint (N + m, r) of readings with derivatives ``by`` (N + m, r)."""
        # At fixed degrees of freedom the equation is that of the prescribed displacement.
        K, solver = self._factors(factors)
        found, N, fixed = solver.solve(by, "T"), len(self._free), ~self._keep
        found[fixed] = (by[:N] - K.T @ found[:N] - self._J.T @ found[N:])[~self._free]
        return found

    def _factors(self, factors):
        """The sum of the matrices, and its Factors with the joints."""
        K = sum(c * A for c, A in zip(factors, self._matrices))
        try:
            return K, Factors.of([[K, self._J.T], [self._J, None]], self._sizes, self._sizes,
                                 self._keep)
        except RuntimeError:
            raise SupportError("the dynamic stiffness is singular: this is the frequency of an "
                               "undamped mode") from None


def _labels(name, n):
    return [name] if n == 1 else [f"{name} {k}" for k in range(n)]


def _columns(system, state, loads, joint):
    """Columns of B (N,), G (m,) and prescribed displacements (N,) for each number of an input."""
    none = np.zeros(system.N)
    if joint is None:
        B = np.zeros(system.N)
        for load in loads:
            s, (factor, acting) = system.of(load), load.factor_and_load(state.t)
            B[s] += factor * acting.force(np.array(state.u[s]))
        return [(B, np.zeros(system.constraints.m), none)]
    # derivatives of the equations of the joint by what it prescribes
    t, function = state._time, getattr(joint, joint.driver)

    def moved(by):
        other = joint._with(**{joint.driver: lambda time: np.asarray(function(time)) + by})
        return other.value(np.array(state.u), t)

    steps = TURN * np.eye(np.size(function(t))) if np.ndim(function(t)) else [TURN]
    return [(none, *system.constraints.driven(joint, (moved(by) - moved(-by)) / (2.0 * TURN)))
            for by in steps]


def rows_of(system: Any, state: State, sensor: Sensor) -> Readings:
    """Derivatives of the readings of a sensor."""
    at: Any = locate(sensor, system)
    N, m = system.N, system.constraints.m
    local = np.arange(N) if at is None or sensor.recover else np.unique(np.concatenate(
        [np.ravel(part.dofs) if isinstance(part, BeamPoints) else np.arange(N)[part.slice]
         for part in at.parts]))

    def moved(u, multipliers=0.0):
        return State(system, state.u + u, state.load, base=state, t=state.t, memory=state.memory,
                     multipliers=state.multipliers + multipliers)

    def by(n, numbers, change):
        rest = np.ravel(read(sensor, at, moved(0.0)))
        out, unit = np.zeros((len(rest), n)), np.zeros(n)
        for k in numbers:
            unit[k] = 1.0
            out[:, k] = np.ravel(read(sensor, at, change(unit))) - rest
            unit[k] = 0.0
        return out

    if sensor.what in ("velocity", "acceleration"):
        units = np.zeros((len(local), N))
        units[np.arange(len(local)), local] = 1.0
        row = np.zeros((len(np.ravel(at.start)), N))
        row[:, local] = at.velocity(state.u + 0.0 * units, units).reshape(len(local), -1).T
        zero = np.zeros_like(row)
        parts = (zero, row, zero) if sensor.what == "velocity" else (zero, zero, row)
        return Readings(*parts, np.zeros((len(row), m)))
    row = by(N, local, moved)
    pull = np.zeros((len(row), m)) if at is not None else by(m, range(m), lambda l: moved(0.0, l))
    return Readings(row, 0.0 * row, 0.0 * row, pull)


# steps one at a time, with inputs that are given at each: for controllers, games, learning

class Held(Amplitude):
    """A function of time whose value is set before each step. Sizes of loads are constant in a
    step, ``ramped`` motions go straight from one value to another."""

    def __init__(self, first: Any, ramped: bool) -> None:
        self.first, self.ramped = np.asarray(first, dtype=float), ramped
        #: The values at both ends of a step, its start and its size.
        self.step = self.first, self.first, 0.0, 1.0

    def sampled(self, times: Array) -> Array:
        return np.full(len(times), self.step[1])

    def __call__(self, t: Any) -> Any:
        before, value, start, dt = self.step
        if not self.ramped:
            return float(value)
        return before + min(max((t - start) / dt, 0.0), 1.0) * (value - before)


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
            raise InputError(f"leave out dt= of {s.forces.sampled[0]!r}: a stepper samples it")
        self._integrator, self._turns = integrator_of(s, self._scheme), Turns(s)
        self._integrator.longest = 1
        self._sensors = [(name, sensor, locate(sensor, s))
                         for name, sensor in self.scene.sensors.items()]

    def reset(self) -> "Stepper":
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

    def copy(self) -> "Stepper":
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
            one.step = before, value, t, self.dt

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

    def step(self, inputs: ArrayLike = ()) -> "Stepper":
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
