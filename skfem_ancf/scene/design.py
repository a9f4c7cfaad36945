"""Readings of static solutions as functions of parameters, and their derivatives by the adjoint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from scipy import sparse

from ..actions.bound import derivative
from ..core import (Array, ArrayLike, ConvergenceError, InputError, ask, ask_array, refuse,
                    require_finite, require_function, require_module, require_option)
from ..core.band import NO_FACTORS
from ..dynamics.sensors import Sensor, locate, read
from ..equations.matrices import matrices_of
from ..results.state import State
from .eigen_readings import EigenReading, residual
from .linear_model import Bordered, rows_of
from .parameters import Parameters

#: Step of the parameters, relative to their size, and a stencil of fourth order.
STEP = 1e-3
#: The same with contact, where it must not lift the body off.
TOUCHING = 1e-6
STENCIL = ((-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0))
#: Relative change of an equation that is no round-off.
CHANGED = 1e-9
#: Relative difference of a change by all parameters from the sum of those by each.
AGREE = 1e-3
#: The same for more than MANY parameters, of second order.
MANY_STEP, MANY, PAIR = 1e-4, 20, ((-1.0, -0.5), (1.0, 0.5))
#: Step of displacements for readings that are functions, relative to the size of the scene.
ASIDE = 1e-4
#: Stiffness relative to that of the material at a critical point: an imperfect one is 0.01 at 1 %
#: less load, and a limit point that is found to 1e-8 has 4e-5.
SNAP = 1e-4
#: Gap in heights, and force relative to the largest, of a point that just touches; motion relative
#: to that of others below which a point is held.
TOUCH, HELD = 1e-6, 1e-3


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
        Functions cost a solution of the tangent and four values for each parameter. Or a
        :class:`~skfem_ancf.Frequency`, :class:`~skfem_ancf.BucklingLoad` or
        :class:`~skfem_ancf.CriticalLoad`.
    sizes
        Typical sizes of the parameters, (n,), by default their absolute values.

    Raises
    ------
    InputError
        If forces depend on the path, as friction or plasticity: then the state is at a kink, and a
        derivative depends on the direction. Also where a point just touches an obstacle, and at a
        critical point, where derivatives have no bounds.

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
        self._static = not readings or not all(isinstance(one, EigenReading) and not one.loaded
                               for one in self.readings)
        self.state: Any = None

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
            y = self.values(p)
            return float(function(y)), self._weighted(derivative(function, y))

        return value_and_gradient

    def _weighted(self, weights):
        """The derivative (n,) of the sum of weighted readings (r,) at the last parameters."""
        return weights @ self.jacobian(self._p)

    def to_jax(self, p: ArrayLike) -> Callable[[Any], Any]:
        """The readings (r,) as a function of p (n,) for JAX, with derivatives by the adjoint.

        ``jax.grad`` and ``jax.jit`` work with what is computed from them. Needs the extra
        ``autodiff``; the numbers are those of JAX, single precision unless ``jax_enable_x64``.

        Parameters
        ----------
        p
            Parameters for which there is a solution: they show the number of readings.
        """
        jax, rows = require_module("jax", "autodiff"), len(self.values(p))

        def called(function, shape, p):
            return jax.pure_callback(lambda p: function(np.asarray(p, dtype=float)).astype(p.dtype),
                                     jax.ShapeDtypeStruct(shape, p.dtype), p)

        @jax.custom_vjp
        def readings(p):
            return called(self.values, (rows,), p)

        readings.defvjp(lambda p: (readings(p), p), lambda p, back: (
            back @ called(self.jacobian, (rows, len(p)), p),))
        return readings

    # the state

    def _solve(self, p):
        """Find the readings at p, unless it is the last one."""
        p = np.atleast_1d(require_finite("p", p)).astype(float)
        if self._p is None or not np.array_equal(self._p, p):
            scene, last, found = self._scene(p), self.state, None
            if last is not None and last.system.N == scene.N:
                with suppress(ConvergenceError, InputError):  # the start may be the cause
                    found = scene.solve_static(start=scene.state(last.u))
            self._begin(p, scene, found or scene.solve_static() if self._static else None)

    def _begin(self, p, scene, state):
        """Take the state at p."""
        self._p, self._built, self.state, self._J = p, scene, state, None
        self._found = [(one, *one._find(scene, state if one.loaded else None))
                       for one in self.readings if isinstance(one, EigenReading)]
        self._values = self._read(scene, state)

    def _scene(self, p):
        scene = ask("build(p)", self.build, p)
        refuse(not hasattr(scene, "solve_static"), "build(p) must return a Scene, got {!r}", scene)
        return scene

    def _sensors(self, scene):
        for one in self.readings:
            yield (scene.sensors[require_option("sensor", one, scene.sensors)]
                   if isinstance(one, str) else one)

    def _read(self, scene, state):
        """Values of the readings; those of eigenvalues are the ones found."""
        values: list[Array] = [np.zeros(0)]
        self._places: list[int] = []
        for one in self._sensors(scene):
            if isinstance(one, EigenReading):
                value = self._found[len(self._places)][1]
                self._places.append(sum(map(len, values)))
            elif isinstance(one, Sensor):
                value = read(one, locate(one, state.system), state)
            else:
                value = ask_array("a reading", None, one, state)
            values.append(np.ravel(value))
        self._counts = [len(one) for one in values[1:]]
        return np.concatenate(values)

    # derivatives

    def _jacobian(self, p, scene, state):
        if state is not None:
            require_smooth(state)
        self._frozen = [one._freeze(scene, found) for one, _, found in self._found]
        c, first = scene.system.constraints, len(self._values)
        # the readings, then the rows of eigenvalues and those of their checks
        owners = [one for k, frozen in enumerate(self._frozen) for one in (
            self._places[k], first + k)[:1 if frozen.check is None else 2]]
        self._owners = np.concatenate([np.arange(first), np.repeat(owners, c.N + c.m)]).astype(int)
        P = self._changes(p, state)
        out = np.zeros((first + len(self._frozen), len(p)))
        if state is not None:
            n = c.N + c.m
            out[:first] = self._by_solution(scene, state, P[:n])
            P = P[n:]
        np.add.at(out, self._owners, P.toarray())
        for frozen, work in zip(self._frozen, out[first:]):
            if frozen.check is not None:
                frozen.check(work)
        return out[:first]

    def _by_solution(self, scene, state, P):
        """The part of the derivatives by displacements and multipliers, (r, n)."""
        # Sensors and eigenvalues by the adjoint; functions by differences along the changes of the
        # solution.
        by_state = np.zeros((len(self._values), P.shape[0]))
        at, functions, eigenvalues = 0, [], iter(self._frozen)
        for one, size in zip(self._sensors(scene), self._counts):
            if isinstance(one, EigenReading):
                row = next(eigenvalues).by_state
                by_state[at] = 0.0 if row is None else row
            elif isinstance(one, Sensor) and not callable(one.what):
                row = rows_of(state.system, state, one)
                by_state[at:at + size] = np.hstack([row.u, row.multipliers])
            else:
                functions.append((one.what if isinstance(one, Sensor) else one, at, size))
            at += size
        out = -(adjoint_of(state, by_state, P) @ P)
        if functions:
            z = changes_of(state, P)
            for function, at, size in functions:
                out[at:at + size] = np.array([_along(function, state, x) for x in z.T]).T
        return out

    def _changes(self, p, state):
        """Derivatives of equations, readings and rows of eigenvalues by parameters, sparse."""
        sizes = self._typical(p)
        touching = state is not None and state.system.forces.contacts.obstacles
        step, stencil = (MANY_STEP, PAIR) if len(p) > MANY else (STEP, STENCIL)
        h = (TOUCHING if touching else step) * sizes
        noise = CHANGED * self._magnitudes(state, [one.rows(self._built) for one in self._frozen])
        by = Differences(lambda p: self._equations(p, state), p, h, stencil, noise)
        if isinstance(self.build, Parameters):
            # the same degrees of freedom in the equations and in the rows of each eigenvalue
            n, c = len(self._values), self._built.system.constraints
            before, after = (0 if state is None else 1), (len(self._owners) - n) // (c.N + c.m)
            return by.of([(members, np.concatenate([np.tile(of, before), np.full(n, -1),
                                                    np.tile(of, after)]))
                          for members, of in self.build.groups(c.N + c.m)])
        if self._groups is not None:
            found = by.of(self._groups)
            if by.agree(found):
                return found
        # parameters act elsewhere than they did at the last groups: contact, say
        self._groups = by.grouped()
        return by.of(self._groups)

    def _typical(self, p):
        """Typical sizes of the parameters, (n,)."""
        sizes = np.abs(p) if self._sizes is None else self._sizes
        if isinstance(self.build, Parameters):
            sizes = np.where(self.build.sizes > 0.0, self.build.sizes, sizes)
        return np.where(sizes > 0.0, sizes, sizes.max() or 1.0)

    def _equations(self, p, state):
        """The equations at the displacements and multipliers of a state, and the readings."""
        # An eigenvalue has rows whose sum it is.
        scene = self._scene(p)
        system, old = scene.system, self._built.system
        refuse(system.N != old.N or system.constraints.m != old.constraints.m, "the parameters "
               "change the number of degrees of freedom or of joint equations, from {} and {} to "
               "{} and {}", old.N, old.constraints.m, system.N, system.constraints.m)
        parts, seen = [np.zeros(0)], self._values
        if state is not None:
            u, l = np.array(state.u), state.multipliers
            parts.append(residual(system, u, l, state.load, state.memory))
            seen = self._read(scene, State(system, u, state.load, multipliers=l,
                                           memory=state.memory))
        return np.concatenate([*parts, seen, *(frozen.rows(scene) for frozen in self._frozen)])

    def _magnitudes(self, state, rows):
        """Typical magnitudes of the terms in the equations, of the readings and their rows."""
        c, values = self._built.system.constraints, np.abs(self._values)
        largest = np.concatenate([np.full(len(values), values.max(initial=0.0)), *(
            np.repeat(np.abs(row).reshape(-1, c.N + c.m).max(axis=1), c.N + c.m) for row in rows)])
        if state is None:
            return largest
        system, s = state.system, c.coordinate_sizes
        force = system.after(state.memory).internal_force(np.array(state.u), None, state.load)
        work = np.abs(force * s).max()
        return np.concatenate([np.where(c.free, work / s, s), np.full(c.m, system.size),
                               largest])


class Differences:
    """Derivatives of equations by parameters p at a fixed state, by steps h."""

    def __init__(self, equations: Any, p: Array, h: Array, stencil: Any, noise: Array) -> None:
        self._equations, self._p, self._h = equations, p, h
        self._stencil, self._noise = stencil, noise

    def _change(self, members):
        """The change by all of these parameters, relative to a step."""
        moved = np.isin(np.arange(len(self._p)), members) * self._h
        return sum(c * self._equations(self._p + k * moved) for k, c in self._stencil)

    def of(self, groups: Any) -> Any:
        """Derivatives, sparse (rows, n), by groups of parameters that change different rows."""
        found: list[Any] = []
        for members, of in groups:
            change = self._change(members)
            self._share(members, of, change, np.arange(len(change)), found)
        numbers, at, values = map(np.concatenate, zip(*found))
        return sparse.csr_array((values / self._h[numbers], (at, numbers)),
                                shape=(len(self._noise), len(self._p)))

    def _share(self, members, of, change, rows, found):
        """Attribute changes of rows; where it is not known to which parameter, by halves."""
        if len(members) == 1:
            found.append((np.full(len(rows), members[0]), rows, change[rows]))
            return
        known = rows[of[rows] >= 0]
        found.append((of[known], known, change[known]))
        rows = rows[(of[rows] < 0) & (np.abs(change[rows]) > self._noise[rows])]
        if len(rows):
            none, half = np.full(len(of), -1), len(members) // 2
            for part in (members[:half], members[half:]):
                self._share(part, none, self._change(part), rows, found)

    def agree(self, found: Any) -> bool:
        """True if derivatives add up to the change by all parameters, by steps of their own."""
        moved = self._h * (1.0 + 0.5 * np.cos(np.arange(1.0, len(self._p) + 1.0)))
        ends = [self._equations(self._p + sign * moved) for sign in (1.0, -1.0)]
        change = 0.5 * (ends[0] - ends[1])
        return bool(np.all(np.abs(change - found @ moved) <= AGREE * (
            abs(found) @ moved + np.abs(change)) + 10.0 * self._noise))

    def grouped(self) -> list[tuple[list[int], Array]]:
        """Parameters that change different equations, with the parameter of each equation."""
        groups: list[tuple[list[int], Array]] = []
        before = self._equations(self._p)
        for k in range(len(self._p)):
            moved = self._p.copy()
            moved[k] += self._h[k]
            touched = np.abs(self._equations(moved) - before) > self._noise
            for members, of in groups:
                if not np.any(touched & (of >= 0)):
                    break
            else:
                members, of = [], np.full(len(before), -1)
                groups.append((members, of))
            members.append(k)
            of[touched] = k
        return groups


class Gradient(Design):
    """Derivatives by the :class:`~skfem_ancf.scene.parameters.Parameters` ``wrt`` of a scene in its
    known static solution; ``readings`` as for :class:`Design`."""

    def __init__(self, scene: Any, state: State, wrt: Sequence[Any],
                 readings: Sequence[Any] = ()) -> None:
        if state.t is not None or state.base is not None:
            raise InputError("derivatives are of static solutions, and this state is "
                             + ("linear" if state.t is None else "an instant of a motion"))
        self.build: Parameters = Parameters(scene, wrt)
        super().__init__(self.build, readings)
        self._begin(self.build.start, scene, state)

    def _shaped(self, found):
        return [found[..., one.at].reshape((*found.shape[:-1], *one.start.shape))
                for one in self.build.each]

    def of_readings(self) -> list[Array]:
        """Of the readings, for each of ``wrt`` an array (r, ...); (...) of one number."""
        found = self.jacobian(self.build.start)
        return self._shaped(found[0] if len(found) == 1 else found)

    def of_displacements(self) -> list[Array]:
        """Of the displacement, for each of ``wrt`` an array (N, ...)."""
        require_smooth(self.state)
        self._frozen, self._owners = [], np.zeros(0, int)
        P, N = self._changes(self._p, self.state), self.state.system.N
        adjoint_of(self.state, np.zeros((0, P.shape[0])), P)  # or why there is none
        return self._shaped(changes_of(self.state, P)[:N])


def require_smooth(state: State) -> None:
    """Raise InputError if forces depend on the path."""
    refuse(state.system.histories.dissipates, "forces of this scene depend on the path (friction, "
           "plasticity): the derivative of a reading depends on the direction, and is not defined")


def require_regular(state: State, force: Array, soft: Array) -> None:
    """Raise InputError at a critical point, or where a point just touches an obstacle."""
    # ``soft`` (N,) is the displacement for any force (N,), at a critical point the mode. There
    # loads take away the stiffness by which elements resist.
    system, u, resists = state.system.after(state.memory), np.array(state.u), 0.0
    for beam in system.beams:
        x, y, kernel = u[system.of(beam)], soft[system.of(beam)], beam.kernel
        if kernel.linear:
            resists += np.vdot(kernel.gather(y), kernel.viscous_forces(x, y, 1.0))
        else:
            B, HB, _ = kernel.gradients(x)
            y = kernel.gather(y).reshape(len(B), -1, 1)
            resists += np.vdot(B @ y, HB @ y)
    if abs(soft @ force) < SNAP * resists:
        raise InputError(f"this state snaps or branches: in one shape it has {soft @ force:.1g} of "
                         f"the stiffness of its material, {resists:.1g}, so that derivatives have "
                         "no bounds. Take another load, or CriticalLoad() as reading")
    contacts = system.forces.contacts
    if not contacts.groups:
        return
    largest = np.abs(system.internal_force(u, None, state.load)
                     * system.constraints.coordinate_sizes).max() / system.size
    for (_, group), (_, x, push, _, gap) in zip(contacts.groups, contacts.pushes(
            u, None, state.load)):
        i = group.first + 2 * np.arange(len(group.weights))[:, None]
        # a point that supports hold can neither lift nor press
        moves = np.hypot(*(np.sum(group.weights * soft[i + k], axis=0) for k in (0, 1)))
        at = (np.abs(gap) < TOUCH * group.height) & (np.hypot(*push) <= TOUCH * largest) & (
            moves > HELD * moves.max())
        if at.any():
            x, y = x[:, at.argmax()]
            raise InputError(f"a point just touches an obstacle, at ({x:.6g}, {y:.6g}): the "
                             "derivative depends on whether a change lifts or presses it. Take a "
                             "load or a place at which it is in contact, or is not")


def adjoint_of(state: State, by_state: Array, P: Any) -> Array:
    """The adjoint (r, N + m) of readings, for products with changes P (N + m, n)."""
    # Raises InputError if it has no bounds, or depends on the direction.
    system = state.system.after(state.memory)
    c, N = system.constraints, system.N
    force = c.free * np.cos(np.arange(N)**2) / c.coordinate_sizes
    by, found = np.vstack([by_state, np.append(force, np.zeros(c.m))]), None
    if system.symmetric and not P[c.fixed].count_nonzero():  # as in an iteration
        with suppress(*NO_FACTORS):
            system.assemble(np.array(state.u), state.load)
            system.solver.factorize(np.array(state.u), state.load, state.multipliers)
            found = np.array([np.concatenate(system.solver.solve(row[:N], row[N:])) for row in by])
    if found is None:
        found = tangent_of(state, P[:, :0]).adjoint([1.0], by.T).T
    require_regular(state, force, found[-1, :N] * c.free)
    return found[:-1]


def tangent_of(state: State, P: Any) -> Bordered:
    """The equations about a state, for changes P (N + m, n) of their residual, sparse."""
    system, found = state.system, matrices_of(state.system, state)
    prescribed, fixed = np.zeros((system.N, P.shape[1])), system.constraints.fixed
    prescribed[fixed] = -P[fixed].toarray()
    return Bordered([found.K], found.J, system.constraints, prescribed)


def changes_of(state: State, P: Any) -> Array:
    """The changes of displacements and multipliers by those of their equations, (N + m, n)."""
    N = state.system.N
    return np.concatenate(tangent_of(state, P).solve([1.0], -P[:N].toarray(), -P[N:].toarray()))


def _along(function, state, z):
    """The derivative of a function of the State along a change (N + m,) of the solution, (r,)."""
    system, N = state.system, state.system.N
    size = np.abs(z[:N] / system.constraints.coordinate_sizes).max()
    step = (TOUCHING if system.forces.contacts.obstacles else ASIDE) / size if size > 0.0 else 1.0

    def at(k):
        return np.ravel(ask_array("a reading", None, function, State(
            system, state.u + k * step * z[:N], state.load, memory=state.memory,
            multipliers=state.multipliers + k * step * z[N:])))

    return sum(c / step * at(k) for k, c in STENCIL)
