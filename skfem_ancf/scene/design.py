"""Readings of static solutions as functions of parameters, with derivatives by the adjoint; among
them frequencies, buckling loads and critical loads."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from ..actions.bound import derivative, slope_at_zero
from ..core import (NO_FACTORS, Array, ArrayLike, ConvergenceError, InputError, ask, ask_array,
                    refuse, refuse_any, require_finite, require_flag, require_function,
                    require_integer, require_module, require_option)
from ..dynamics.sensors import Sensor, locate, read
from ..equations.matrices import Inverse, StrainTangent, matrices_of
from ..results.state import State
from ..solvers import eigen
from .control import Bordered, rows_of
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
#: Relative distance of the squares of frequencies, or of buckling loads, that are not simple.
SIMPLE = 1e-4
#: Displacements for second derivatives along a shape, relative to the size of the scene.
BENT = 1e-3
#: The same for first derivatives of strains.
SMALL = 1e-5
#: Change of a load factor for derivatives by it.
LOADED = 1e-3
#: Tolerance of critical points: a limit point itself has the error of its root.
LOCATE = 1e-12
#: Relative work of a parameter on the mode of a bifurcation that is round-off.
SYMMETRIC = 1e-4


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
        first, n = len(self._values), scene.system.N + scene.system.constraints.m
        # the readings, then the rows of eigenvalues and those of their checks
        owners = [one for k, frozen in enumerate(self._frozen) for one in (
            self._places[k], first + k)[:2 if frozen.checked else 1]]
        self._owners = np.concatenate([np.arange(first), np.repeat(owners, n)]).astype(int)
        P = self._changes(p, state)
        out = np.zeros((first + len(self._frozen), len(p)))
        if state is not None:
            # sensors and eigenvalues by the adjoint
            by_state, R, P = np.zeros((first, n)), P[:n], P[n:]
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
            out[:first] = -(adjoint_of(state, by_state, R) @ R)
            # functions by differences along the changes of the solution
            N, sizes = state.system.N, scene.system.constraints.coordinate_sizes
            for k, z in enumerate(changes_of(state, R).T if functions else ()):
                largest = np.abs(z[:N] / sizes).max()
                small = TOUCHING if state.system.forces.contacts.obstacles else ASIDE
                step = small / largest if largest > 0.0 else 1.0
                for x, c in STENCIL:
                    moved = State(state.system, state.u + x * step * z[:N], state.load,
                                  memory=state.memory,
                                  multipliers=state.multipliers + x * step * z[N:])
                    for function, at, size in functions:
                        out[at:at + size, k] += c / step * np.ravel(
                            ask_array("a reading", None, function, moved))
        np.add.at(out, self._owners, P.toarray())
        for frozen, work in zip(self._frozen, out[first:]):
            if frozen.checked and np.any(np.abs(work) > SYMMETRIC):
                raise InputError(f"parameter {np.argmax(np.abs(work))} disturbs the symmetry of "
                                 "the bifurcation: the critical load has no derivative")
        return out[:first]

    def _changes(self, p, state):
        """Derivatives of equations, readings and rows of eigenvalues by parameters, sparse."""
        values, c = np.abs(self._values), self._built.system.constraints
        n, s = len(values), c.coordinate_sizes
        step, stencil = (MANY_STEP, PAIR) if len(p) > MANY else (STEP, STENCIL)
        # magnitudes of the terms in the equations, of the readings and their rows
        size = [np.full(n, values.max(initial=0.0)), *(
            np.repeat(np.abs(row).reshape(-1, c.N + c.m).max(axis=1), c.N + c.m)
            for row in (one.rows(self._built) for one in self._frozen))]
        if state is not None:
            step = TOUCHING if state.system.forces.contacts.obstacles else step
            force = state.system.after(state.memory).internal_force(
                np.array(state.u), None, state.load)
            size = [np.where(c.free, np.abs(force * s).max() / s, s),
                    np.full(c.m, state.system.size), *size]
        by = Differences(lambda p: self._equations(p, state), p, step * self._typical(p), stencil,
                         CHANGED * np.concatenate(size))
        if isinstance(self.build, Parameters):
            # the same degrees of freedom in the equations and in the rows of each eigenvalue
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
        require_same_size(system, old.N, old.constraints.m)
        parts, seen = [np.zeros(0)], self._values
        if state is not None:
            u, l = np.array(state.u), state.multipliers
            parts.append(residual(system, u, l, state.load, state.memory))
            seen = self._read(scene, State(system, u, state.load, multipliers=l,
                                           memory=state.memory))
        return np.concatenate([*parts, seen, *(frozen.rows(scene) for frozen in self._frozen)])


def require_same_size(system: Any, N: int, m: int) -> Any:
    """The constraints of equations of this size; InputError for other DOFs or joint equations."""
    found = system.N, system.constraints.m
    refuse(found != (N, m), "the parameters change the number of degrees of freedom or of joint "
           "equations, from {} and {} to {} and {}", N, m, *found)
    return system.constraints


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
        refuse(state.t is not None or state.base is not None, "derivatives are of static "
               "solutions, got {!r}", state)
        self.build: Parameters = Parameters(scene, wrt)
        super().__init__(self.build, readings)
        self._begin(self.build.start, scene, state)

    def found(self) -> list[Array]:
        """For each of ``wrt`` an array (r, ...), of one number (...); without readings (N, ...),
        the derivatives of the displacement."""
        if self.readings:
            found = self.jacobian(self.build.start)
            found = found[0] if len(found) == 1 else found
        else:
            require_smooth(self.state)
            self._frozen, self._owners = [], np.zeros(0, int)
            P = self._changes(self._p, self.state)
            adjoint_of(self.state, np.zeros((0, P.shape[0])), P)  # or why there is none
            found = changes_of(self.state, P)[:self.state.system.N]
        return [found[..., one.at].reshape((*found.shape[:-1], *one.start.shape))
                for one in self.build.each]


def require_smooth(state: State) -> None:
    """Raise InputError if forces depend on the path."""
    refuse(state.system.histories.dissipates, "forces of this scene depend on the path (friction, "
           "plasticity): derivatives are not defined")


def adjoint_of(state: State, by_state: Array, P: Any) -> Array:
    """The adjoint (r, N + m) of readings, for products with changes P (N + m, n)."""
    # Raises InputError at a critical point, or where a point just touches an obstacle. ``soft`` is
    # the displacement for any force, at a critical point the mode: there loads take away the
    # stiffness by which elements resist.
    system, u, resists, found = state.system.after(state.memory), np.array(state.u), 0.0, None
    c, N = system.constraints, system.N
    force = c.free * np.cos(np.arange(N)**2) / c.coordinate_sizes
    by = np.vstack([by_state, np.append(force, np.zeros(c.m))])
    if system.symmetric and not P[c.fixed].count_nonzero():  # as in an iteration
        with suppress(*NO_FACTORS):
            system.assemble(u, state.load)
            system.solver.factorize(u, state.load, state.multipliers)
            found = np.array([np.concatenate(system.solver.solve(row[:N], row[N:])) for row in by])
    if found is None:
        found = tangent_of(state, P[:, :0]).adjoint([1.0], by.T).T
    soft = found[-1, :N] * c.free
    for beam in system.beams:
        x, y, kernel = u[system.of(beam)], soft[system.of(beam)], beam.kernel
        if kernel.linear:
            resists += np.vdot(kernel.gather(y), kernel.viscous_forces(x, y, 1.0))
        else:
            B, HB, _ = kernel.gradients(x)
            y = kernel.gather(y).reshape(len(B), -1, 1)
            resists += np.vdot(B @ y, HB @ y)
    if abs(soft @ force) < SNAP * resists:
        raise InputError(f"this state snaps or branches: one shape has a stiffness of only "
                         f"{soft @ force / resists:.1g} of its material; read CriticalLoad()")
    if system.forces.contacts.groups:
        largest = np.abs(system.internal_force(u, None, state.load)
                         * c.coordinate_sizes).max() / system.size
        contacts = system.forces.contacts
        for (_, group), push in zip(contacts.groups, contacts.pushes(u, None, state.load)):
            i = group.first + 2 * np.arange(len(group.weights))[:, None]
            # a point that supports hold can neither lift nor press
            moves = np.hypot(*(np.sum(group.weights * soft[i + k], axis=0) for k in (0, 1)))
            at = (np.abs(push.gap) < TOUCH * group.height) & (
                np.hypot(*push.force) <= TOUCH * largest) & (moves > HELD * moves.max())
            refuse_any(at, "a point just touches an obstacle, at {:.6g}: take another load",
                       push.points)
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


# eigenvalues as readings

def residual(system: Any, u: Array, multipliers: Array, load: float, memory: Any = None,
             t: float | None = None) -> Array:
    """The equations without inertia, (N + m,); those of supports at fixed degrees of freedom."""
    c, time = system.constraints, load if t is None else t
    rest = system.after(memory).internal_force(u, t, load) - load * system.external_force(u, t) + (
        c.sparse_jacobian(u, time).T @ multipliers)
    rest[c.fixed] = u[c.fixed] - c.values(load, t)
    return np.concatenate([rest, c.constraint(u, time)])


class Frozen(NamedTuple):
    """The derivatives of an eigenvalue: by parameters that of the sum of ``rows`` of a scene.
    ``by_state`` (N + m,) is that by the displacements and multipliers of the static solution, or
    None. If ``checked``, the sum of the second half of the rows must vanish for each parameter: it
    is the work on the mode of a bifurcation."""

    rows: Any
    by_state: Array | None = None
    checked: bool = False


class EigenReading:
    """Base class: an eigenvalue of a scene as a reading of a :class:`~skfem_ancf.Design`.

    Parameters
    ----------
    number
        Its number, from 0.
    """

    loaded = False

    def __init__(self, number: int = 0) -> None:
        self.number = require_integer("number", number, 0)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.number}>"

    def _find(self, scene: Any, state: State | None) -> tuple[float, Any]:
        """The value in a scene, and what ``_freeze`` needs."""
        raise NotImplementedError

    def _freeze(self, scene: Any, found: Any) -> Frozen:
        """What its derivatives need."""
        raise NotImplementedError

    def _require_simple(self, values):
        """Values are sorted; that of the number must differ from its neighbours."""
        own = values[self.number]
        for other in (self.number - 1, self.number + 1):
            if 0 <= other < len(values) and abs(values[other] - own) <= SIMPLE * abs(own):
                raise InputError(
                    f"{self!r} is not simple, and has no derivative: numbers "
                    f"{min(other, self.number)} and {max(other, self.number)} are equal to "
                    f"{abs(values[other] / own - 1):.1g}")


class Frequency(EigenReading):
    """An angular frequency, as a reading of a :class:`~skfem_ancf.Design`.

    Parameters
    ----------
    number
        Its number, from 0 for the lowest.
    loaded
        About the static solution, with its stress, instead of the reference configuration.

    Examples
    --------
    A frequency is proportional to the root of the modulus:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, Design, ElementBeamCable, Frequency, MeshBeam, Scene
    >>> from skfem_ancf import StVenantKirchhoff
    >>> mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01)
    >>> def build(p):
    ...     material = StVenantKirchhoff(p[0], 0.3, 7800)
    ...     return Scene(Beam(mesh, ElementBeamCable(5), material, width=0.01)).clamp("left")
    >>> (omega,), ((by_E,),) = Design(build, [Frequency()])([2e8])
    >>> bool(abs(by_E * 2e8 / omega - 0.5) < 1e-8)
    True
    """

    def __init__(self, number: int = 0, loaded: bool = False) -> None:
        super().__init__(number)
        self.loaded = require_flag("loaded", loaded)

    def _find(self, scene: Any, state: State | None) -> tuple[float, Any]:
        c = scene.system.constraints
        k = min(self.number + 2, max(int(c.free.sum()) - c.m, self.number + 1))
        # without the estimate of errors of scene.modes, which a design need not repeat
        modes = eigen.modes(scene.system, scene.state(load=0.0) if state is None else state, k)
        return float(modes.frequencies[self.number].real), modes

    def _freeze(self, scene: Any, found: Any) -> Frozen:
        values, system, state = found.eigenvalues, scene.system, found.state
        mu, omega = values[self.number].real, found.frequencies[self.number].real
        refuse(found.flutter or not system.symmetric, "the loads have no potential: use "
               "differences of values")
        if abs(mu) <= 1e2 * eigen.ROUND_OFF**2 * system.scales.bending_eigenvalue:
            raise InputError(f"{self!r} is that of a rigid motion, zero for all parameters: give "
                             "a higher number, or supports")
        self._require_simple(values.real)
        shape, factor = found.shapes[self.number].real, 0.5 / omega
        one = _Quadratic(system, state, shape, mu)

        return Frozen(lambda scene: factor * one.rows(scene.system),
                      factor * second(state, one.vector) if self.loaded else None)


class BucklingLoad(EigenReading):
    """A factor of linear buckling, as a reading of a :class:`~skfem_ancf.Design`.

    Parameters
    ----------
    number
        Its number, from 0 for the lowest.
    """

    def _find(self, scene: Any, state: State | None) -> tuple[float, Any]:
        c = scene.system.constraints
        found = scene.buckling(min(self.number + 2, int(c.free.sum()) - c.m))
        refuse(len(found.factors) <= self.number, "{!r} does not exist: these loads have {} "
               "positive factors of buckling", self, len(found.factors))
        return float(found.factors[self.number]), found

    def _freeze(self, scene: Any, found: Any) -> Frozen:
        system, factor = scene.system, found.factors[self.number]
        zero, sizes = np.zeros(system.N), system.constraints.coordinate_sizes
        rest = residual(system, zero, np.zeros(system.constraints.m), 0.0)[:system.N] * sizes
        push = np.abs(system.external_force(zero) * sizes).max()
        if not system.symmetric or system.domains or np.any(
                np.abs(rest) > eigen.UNSTRESSED * push):
            raise InputError("derivatives of buckling loads are of beams under loads with a "
                             "potential, free of stress without them: use CriticalLoad()")
        self._require_simple(found.factors)
        free, shape = system.constraints.free, found.shapes[self.number]
        x, at = shape[free], _tangent(system, zero)
        du, _, multipliers = at.response()
        geometric = x @ (at.geometric(at.stresses(du), multipliers, 1.0) @ x)
        # the geometric stiffness is linear in the stress: strains of second order
        bent = slope_at_zero(lambda s: _tangent(system, s * shape).B, SMALL / np.abs(
            shape / system.constraints.coordinate_sizes).max()) @ x
        turned = second(State(system, 0.0 * shape, 0.0), np.append(shape, 0.0 * multipliers))
        a, b = (part[:, 0] for part in Inverse(at).solve_both(
            (at.CB.T @ bent)[:, None], turned[system.N:, None]))
        y = _multipliers(at.J, at.multiply(x) + factor * (
            at.geometric(at.stresses(du), multipliers, 1.0) @ x))
        settled = system.constraints.values(1.0)

        def rows(scene):
            system = scene.system
            if np.any(np.abs(system.constraints.values(1.0) - settled) > 0.0):
                raise InputError("derivatives of a buckling load by settlements of supports are "
                                 "not available: use CriticalLoad()")
            at = _tangent(system, np.zeros(system.N))
            own = system.external_force(np.zeros(system.N))[free] - (
                at.B.T @ at.stresses(du) + at.S @ du[free] + at.J.T @ multipliers)
            K = at.multiply(x) + factor * (at.geometric(at.stresses(du), multipliers, 1.0) @ x)
            out = np.zeros(system.N + len(y))
            out[:system.N][free] = x * K + factor * a * own
            out[system.N:] = 2.0 * y * (at.J @ x) - factor * b * (at.J @ du[free])
            return out / -geometric

        return Frozen(rows)


class CriticalLoad(EigenReading):
    """The load factor of a limit or bifurcation point of a path, as a reading of a Design.

    Parameters
    ----------
    number
        Its number on the path, from 0.
    **options
        As for :meth:`skfem_ancf.Scene.continuation`; ``max_load`` ends the path after the point.
    """

    def __init__(self, number: int = 0, **options: Any) -> None:
        super().__init__(number)
        self.options = {"locate": LOCATE, **options}

    def _find(self, scene: Any, state: State | None) -> tuple[float, Any]:
        points = scene.continuation(**self.options).critical_points
        refuse(len(points) <= self.number, "{!r} does not exist: the path has {} critical points; "
               "give steps= or max_load=", self, len(points))
        return float(points[self.number].load), points[self.number]

    def _freeze(self, scene: Any, found: Any) -> Frozen:
        system, state, load = scene.system, found.state, found.load
        refuse(not system.symmetric or system.histories.dissipates, "derivatives of critical loads "
               "are of scenes with a potential: no follower loads, friction or plasticity")
        u, l = np.array(state.u), state.multipliers
        vector = np.append(found.mode, found.critical.multiplier_rate)
        K, J = matrices_of(system, state)[2::2]
        by_load = slope_at_zero(lambda s: residual(system, u, l, load + s, state.memory), LOADED)
        left, fixed = vector.copy(), system.constraints.fixed
        left[fixed] = -(K @ found.mode + J.T @ vector[system.N:])[fixed]
        if found.kind == "limit":
            factor = -1.0 / (left @ by_load)
            return Frozen(lambda scene: factor * left * residual(scene.system, u, l, load,
                                                                 state.memory))
        none, one = np.zeros((system.N, 0)), _Quadratic(system, state, found.mode, 0.0, vector)
        border = Bordered([K], sparse.vstack([J, sparse.csr_array(found.mode[None])]),
                          system.constraints, none)
        bent = np.append(second(state, vector), 0.0)[:, None]
        adjoint = border.adjoint([1.0], bent)[:-1, 0]
        stiffer = slope_at_zero(lambda s: one.rows(system, load + s).sum(), LOADED)
        factor = -1.0 / (stiffer - adjoint @ by_load)
        size = np.abs(left * by_load).sum() + np.abs(adjoint * by_load).sum()

        def rows(scene):
            rest = residual(scene.system, u, l, load, state.memory)
            return np.concatenate([factor * (one.rows(scene.system) - adjoint * rest),
                                   left * rest / size])

        return Frozen(rows, checked=True)


class _Quadratic:
    """``x . (K - mu M) x + 2 y . J x`` in a state, as a sum of rows (N + m,). x is a shape (N,)
    with multipliers y (m,), in ``vector``."""

    def __init__(self, system: Any, state: State, x: Array, mu: float,
                 vector: Array | None = None) -> None:
        self._state, self._x, self._mu = state, x, mu
        self.vector = np.append(x, np.zeros(system.constraints.m)) if vector is None else vector
        if vector is None:
            at = self._tangent(system, state.load)
            self.vector[system.N:] = _multipliers(at.J, self._forces(system, at))

    def _tangent(self, system, load):
        s = self._state
        return StrainTangent(system.after(s.memory), np.array(s.u), load, s.t, s.multipliers)

    def _forces(self, system, at):
        free = system.constraints.free
        out = at.multiply(self._x[free])
        return out - self._mu * system.mass.multiply(self._x)[free] if self._mu else out

    def rows(self, system: Any, load: float | None = None) -> Array:
        """The rows for a system with other parameters, at the same displacements."""
        at, x = self._tangent(system, self._state.load if load is None else load), self._x
        out, free = 0.0 * self.vector, system.constraints.free
        out[:system.N][free] = x[free] * self._forces(system, at)
        out[system.N:] = 2.0 * self.vector[system.N:] * (at.J @ x[free])
        return out


def second(state: State, vector: Array) -> Array:
    """The second derivative (N + m,) of the equations along a vector (N + m,)."""
    system = state.system
    step = BENT / np.abs(vector[:system.N] / system.constraints.coordinate_sizes).max()
    z = np.concatenate([state.u, state.multipliers])

    def at(k):
        moved = z + k * step * vector
        return residual(system, moved[:system.N], moved[system.N:], state.load, state.memory)

    return (16.0 * (at(1) + at(-1)) - 30.0 * at(0) - at(2) - at(-2)) / (12.0 * step**2)


def _multipliers(J, forces):
    """y with ``J^T y = -forces``, (m,)."""
    J = sparse.csc_array(J)
    return -spsolve(sparse.csc_array(J @ J.T), J @ forces) if J.shape[0] else np.zeros(0)


def _tangent(system, u):
    return StrainTangent(system, u, 0.0, None, np.zeros(system.constraints.m))
