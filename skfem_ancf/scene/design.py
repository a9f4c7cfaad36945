"""Readings of static solutions as functions of parameters, and their derivatives by the adjoint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..actions.forces.base import derivative
from ..core.errors import (ConvergenceError, InputError, NameUnknown, ask, ask_array,
                           require_finite, require_function, shown)
from ..core.types import Array
from ..dynamics.sensors import Sensor, locate, read
from ..equations.matrices import matrices_of
from ..results.state import State
from .eigen_readings import EigenReading, residual
from .linear_model import Bordered, rows_of

#: Step of the parameters, relative to their size, and a stencil of fourth order.
STEP = 1e-3
#: The same with contact, where it must not lift the body off.
TOUCHING = 1e-6
STENCIL = ((-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0))
#: Relative change of an equation that is no round-off.
CHANGED = 1e-9
#: Relative difference of a change by all parameters from the sum of those by each.
AGREE = 1e-3
#: Step of displacements for readings that are functions, relative to the size of the scene.
ASIDE = 1e-6


class Design:
    """Readings of the static solution of a scene as functions of parameters, with derivatives.

    With the equations ``R(z, p) = 0`` of the displacements and multipliers z, a reading ``y(z, p)``
    has the derivative ``dy/dp = y_p - a . R_p`` with the adjoint ``R_z^T a = y_z``: one
    factorisation for all parameters and readings [1]. ``R_p`` and ``y_p`` are differences of
    fourth order at fixed z, for which nothing is solved. Parameters that act on different degrees
    of freedom, as heights at nodes, are changed together, see [2].

    Parameters
    ----------
    build
        A function of the parameters, an array (n,), that returns a
        :class:`~skfem_ancf.Scene`. Materials, heights, shapes, loads, springs, obstacles and
        user-defined energies may depend on them, but not the number of degrees of freedom.
    readings
        Names of sensors of that scene, or functions of the State that return a number or an array.
        Functions are derived by differences by each degree of freedom: for small scenes. Or a
        :class:`~skfem_ancf.Frequency`, :class:`~skfem_ancf.BucklingLoad` or
        :class:`~skfem_ancf.CriticalLoad`.
    sizes
        Typical sizes of the parameters, (n,), by default their absolute values.

    Raises
    ------
    InputError
        If forces depend on the path, as friction or plasticity: then the state is at a kink, and a
        derivative depends on the direction.

    References
    ----------
    [1] Tortorelli, Michaleris: "Design sensitivity analysis: overview and review", Inverse Problems
    in Engineering 1 (1994).

    [2] Curtis, Powell, Reid: "On the estimation of sparse Jacobian matrices", IMA Journal of
    Applied Mathematics 13 (1974).

    Examples
    --------
    The deflection of a cantilever by its modulus and its load, F L^3 / (3 E I):

    >>> import numpy as np
    >>> from skfem_ancf import Beam, Design, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
    >>> mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01)
    >>> def build(p):
    ...     beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(p[0], 0.3), width=0.01)
    ...     scene = Scene(beam).clamp("left").point_force((0, -p[1]), at=(1, 0))
    ...     return scene.sensor("tip", "displacement", at=(1, 0))
    >>> (_, tip), jacobian = Design(build, ["tip"])([2e8, 1e-4])
    >>> jacobian.shape, bool(abs(2e8 * jacobian[1, 0] / -tip - 1) < 1e-4)
    ((2, 2), True)
    """

    def __init__(self, build: Callable[[Array], Any], readings: Sequence[Any],
                 sizes: ArrayLike | None = None) -> None:
        self.build = require_function("build", build, "of parameters (n,) that returns a Scene")
        self.readings = list(readings)
        self._sizes = None if sizes is None else require_finite("sizes", sizes, (None,))
        self._p: Any = None
        self._built: Any = None
        self._values: Any = None
        self._J: Any = None
        self._groups: list[tuple[Array, Array]] | None = None
        self._static = not all(isinstance(one, EigenReading) and not one.loaded
                               for one in self.readings)
        self.state: State | None = None

    def __call__(self, p: ArrayLike) -> tuple[Array, Array]:
        """Values of the readings (r,), and their derivatives by the parameters, (r, n)."""
        return self.values(p), self.jacobian(p)

    def values(self, p: ArrayLike) -> Array:
        """Values of the readings, shape (r,)."""
        self._solve(p)
        return self._values.copy()

    def jacobian(self, p: ArrayLike) -> Array:
        """Their derivatives by the parameters, shape (r, n)."""
        self._solve(p)
        if self._J is None:
            self._J = self._jacobian(self._p, self._built, self.state)
        return self._J.copy()

    def objective(self, function: Callable[[Array], float]) -> Callable[[ArrayLike], Any]:
        """For ``scipy.optimize.minimize(..., jac=True)``: a function of p.

        Parameters
        ----------
        function
            A number as a function of the readings, an array (r,).
        """
        def value_and_gradient(p: ArrayLike) -> tuple[float, Array]:
            y, J = self(p)
            return float(function(y)), derivative(function, y) @ J

        return value_and_gradient

    # the state

    def _solve(self, p):
        """Find the readings at p, unless it is the last one."""
        p = np.atleast_1d(require_finite("p", p)).astype(float)
        if self._p is not None and np.array_equal(self._p, p):
            return
        scene = self._scene(p)
        state = self._solved(scene) if self._static else None
        self._p, self._built, self.state, self._J = p, scene, state, None
        self._found = [(one, *one._find(scene, state if one.loaded else None))
                       for one in self.readings if isinstance(one, EigenReading)]
        self._values = self._read(scene, state)

    def _scene(self, p):
        scene = ask("build(p)", self.build, p)
        if not hasattr(scene, "solve_static"):
            raise InputError(f"build(p) must return a Scene, got {shown(scene)}")
        return scene

    def _solved(self, scene):
        last = self.state
        if last is not None and last.system.N == scene.N:
            try:
                return scene.solve_static(start=scene.state(last.u))
            except (ConvergenceError, InputError):  # the start may be the cause
                pass
        return scene.solve_static()

    def _sensors(self, scene):
        for one in self.readings:
            if isinstance(one, str) and one not in scene.sensors:
                raise NameUnknown("sensor", one, scene.sensors)
            yield scene.sensors[one] if isinstance(one, str) else one

    def _read(self, scene, state):
        """Values of the readings; those of eigenvalues are the ones found."""
        values, self._places, at = [np.zeros(0)], [], 0
        for one in self._sensors(scene):
            if isinstance(one, EigenReading):
                value = self._found[len(self._places)][1]
                self._places.append(at)
            elif isinstance(one, Sensor):
                value = read(one, locate(one, state.system), state)
            else:
                value = ask_array("a reading", None, one, state)
            values.append(np.ravel(value))
            at += len(values[-1])
        return np.concatenate(values)

    # derivatives

    def _jacobian(self, p, scene, state):
        if state is not None and state.system.histories.dissipates:
            raise InputError("forces of this scene depend on the path (friction, plasticity): the "
                             "derivative of a reading depends on the direction, and is not defined")
        self._frozen = [one._freeze(scene, found) for one, _, found in self._found]
        c, first = scene.system.constraints, len(self._values)
        # the readings, then the rows of eigenvalues and those of their checks
        owners = [one for k, frozen in enumerate(self._frozen) for one in (
            self._places[k], first + k)[:1 if frozen.check is None else 2]]
        self._owners = np.concatenate([np.arange(first), np.repeat(owners, c.N + c.m)]).astype(int)
        numbers, at, change = self._changes(p, state)
        found = np.zeros((len(self._values) + len(self._frozen), len(p)))
        if state is not None:
            adjoint = self._adjoint(scene, state)
            n = adjoint.shape[1]
            own = at < n
            np.add.at(found[:len(self._values)].T, numbers[own],
                      -(adjoint[:, at[own]] * change[own]).T)
            numbers, at, change = numbers[~own], at[~own] - n, change[~own]
        np.add.at(found, (self._owners[at], numbers), change)
        for frozen, work in zip(self._frozen, found[len(self._values):]):
            if frozen.check is not None:
                frozen.check(work)
        return found[:len(self._values)]

    def _adjoint(self, scene, state):
        """The adjoint of each reading, (r, N + m)."""
        system, found = state.system, matrices_of(state.system, state)
        equations = Bordered([found.K], found.J, system.constraints, np.zeros((system.N, 0)))
        return equations.adjoint([1.0], self._by_state(scene, state).T).T

    def _by_state(self, scene, state):
        """Derivatives of the readings by displacements and multipliers, (r, N + m)."""
        n = state.system.N + state.system.constraints.m
        rows, frozen = [np.zeros((0, n))], iter(self._frozen)
        for one in self._sensors(scene):
            if isinstance(one, EigenReading):
                own = next(frozen).by_state
                rows.append(np.zeros((1, n)) if own is None else own[None])
            elif isinstance(one, Sensor) and not callable(one.what):
                row = rows_of(state.system, state, one)
                rows.append(np.hstack([row.u, row.multipliers]))
            else:
                function = one.what if isinstance(one, Sensor) else one
                rows.append(_differences(function, state))
        return np.concatenate(rows)

    def _changes(self, p, state):
        """Derivatives of equations and readings by parameters: numbers, places, values."""
        sizes = np.abs(p) if self._sizes is None else self._sizes
        touching = state is not None and state.system.forces.contacts.obstacles
        h = (TOUCHING if touching else STEP) * np.where(
            sizes > 0.0, sizes, sizes.max() or 1.0)
        before = self._equations(p, state)
        noise = CHANGED * self._magnitudes(state, before)
        if self._groups is not None:
            found = self._of_groups(p, h, state)
            if self._agree(found, p, h, state, noise):
                return found
        # parameters act elsewhere than they did at the last groups: contact, say
        self._groups = self._grouped(p, h, state, before, noise)
        return self._of_groups(p, h, state)

    def _of_groups(self, p, h, state):
        found = []
        for members, of in self._groups:
            moved = np.isin(np.arange(len(p)), members) * h
            change = sum(c * self._equations(p + k * moved, state) for k, c in STENCIL)
            at = np.flatnonzero(of >= 0)
            found.append((of[at], at, change[at] / h[of[at]]))
        return tuple(map(np.concatenate, zip(*found)))

    def _agree(self, found, p, h, state, noise):
        """True if derivatives add up to the change by all parameters, by steps of their own."""
        numbers, at, values = found
        moved = h * (1.0 + 0.5 * np.cos(np.arange(1.0, len(p) + 1.0)))
        ends = [self._equations(p + sign * moved, state) for sign in (1.0, -1.0)]
        parts, change = values * moved[numbers], 0.5 * (ends[0] - ends[1])
        sums, sizes = (np.bincount(at, x, len(change)) for x in (parts, np.abs(parts)))
        return np.all(np.abs(change - sums) <= AGREE * (sizes + np.abs(change))
                      + 10.0 * noise)

    def _grouped(self, p, h, state, before, noise):
        """Parameters that change different equations, with the parameter of each equation."""
        groups = []
        for k in range(len(p)):
            moved = p.copy()
            moved[k] += h[k]
            touched = np.abs(self._equations(moved, state) - before) > noise
            for members, of in groups:
                if not np.any(touched & (of >= 0)):
                    break
            else:
                members, of = [], np.full(len(before), -1)
                groups.append((members, of))
            members.append(k)
            of[touched] = k
        return groups

    def _equations(self, p, state):
        """The equations at the displacements and multipliers of a state, and the readings.

        An eigenvalue has rows whose sum it is.
        """
        scene = self._scene(p)
        system, old = scene.system, self._built.system
        if system.N != old.N or system.constraints.m != old.constraints.m:
            raise InputError("the parameters change the number of degrees of freedom or of joint "
                             f"equations, from {old.N} and {old.constraints.m} "
                             f"to {system.N} and {system.constraints.m}")
        parts, seen = [np.zeros(0)], self._values
        if state is not None:
            u, l = np.array(state.u), state.multipliers
            parts.append(residual(system, u, l, state.load, state.memory))
            seen = self._read(scene, State(system, u, state.load, multipliers=l,
                                           memory=state.memory))
        return np.concatenate([*parts, seen, *(frozen.rows(scene) for frozen in self._frozen)])

    def _magnitudes(self, state, before):
        """Typical magnitudes of the terms in the equations, of the readings and their rows."""
        c, own = self._built.system.constraints, np.abs(before[-len(self._owners):])
        first = len(self._values)
        rows = own[first:].reshape(-1, c.N + c.m)
        largest = np.append(np.full(first, own[:first].max(initial=0.0)),
                            np.repeat(rows.max(axis=1, initial=0.0), c.N + c.m))
        if state is None:
            return largest
        system, s = state.system, c.coordinate_sizes
        force = system.after(state.memory).internal_force(np.array(state.u), None, state.load)
        work = np.abs(force * s).max()
        return np.concatenate([np.where(c.free, work / s, s), np.full(c.m, system.size),
                               largest])


def _differences(function, state):
    """Derivatives of a function of the State by displacements and multipliers, (r, N + m)."""
    system = state.system
    steps = np.concatenate([ASIDE * system.constraints.coordinate_sizes,
                            ASIDE * np.maximum(1.0, np.abs(state.multipliers))])

    def at(k, step):
        z = np.concatenate([state.u, state.multipliers])
        z[k] += step
        return np.ravel(ask_array("a reading", None, function, State(
            system, z[:system.N], state.load, multipliers=z[system.N:], memory=state.memory)))

    return np.array([(at(k, step) - at(k, -step)) / (2.0 * step)
                     for k, step in enumerate(steps)]).T
