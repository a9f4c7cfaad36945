"""Frequencies, buckling loads and critical loads as readings of a :class:`Design`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from ..core import Array, InputError, refuse, require_flag, require_integer
from ..equations.matrices import matrices_of
from ..equations.strain_tangent import Inverse, StrainTangent
from ..results.state import State
from ..solvers import eigen
from .linear_model import Bordered

#: Relative distance of the squares of frequencies, or of buckling loads, that are not simple.
SIMPLE = 1e-4
#: Displacements for second derivatives along a shape, relative to the size of the scene.
ASIDE = 1e-3
#: The same for first derivatives of strains.
SMALL = 1e-5
#: Change of a load factor for derivatives by it.
LOADED = 1e-3
#: Tolerance of critical points: a limit point itself has the error of its root.
LOCATE = 1e-12
#: Relative work of a parameter on the mode of a bifurcation that is round-off.
SYMMETRIC = 1e-4


def residual(system: Any, u: Array, multipliers: Array, load: float, memory: Any = None) -> Array:
    """The equations of statics, (N + m,); those of supports at fixed degrees of freedom."""
    c = system.constraints
    force = system.after(memory).internal_force(u, None, load)
    rest = force - load * system.external_force(u) + c.sparse_jacobian(u, load).T @ multipliers
    rest[c.fixed] = u[c.fixed] - c.values(load)
    return np.concatenate([rest, c.constraint(u, load)])


class Frozen(NamedTuple):
    """The derivatives of an eigenvalue: by parameters that of the sum of ``rows`` of a scene.
    ``by_state`` (N + m,) is that by the displacements and multipliers of the static solution, or
    None. ``check`` is a function of the sum of the second half of the rows of each parameter,
    (n,)."""

    rows: Any
    by_state: Array | None = None
    check: Any = None


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
                    f"{self!r} is not simple: numbers {min(other, self.number)} and "
                    f"{max(other, self.number)} are equal to {abs(values[other] / own - 1):.1g}. "
                    "A multiple eigenvalue has no derivative, as its shapes depend on the "
                    "direction: use a smooth function, as the sum of both, of differences, or "
                    "break the symmetry")


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
        refuse(found.flutter or not system.symmetric, "the loads have no potential: derivatives of "
               "frequencies need a symmetric stiffness, so use differences of values")
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
        step = SMALL / np.abs(shape / system.constraints.coordinate_sizes).max()
        up, down = (_tangent(system, sign * step * shape) for sign in (1.0, -1.0))
        bent = ((up.B - down.B) @ x) / (2.0 * step)
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
        refuse(len(points) <= self.number, "{!r} does not exist: the path has {} critical points. "
               "Follow it further, by steps= or max_load=", self, len(points))
        return float(points[self.number].load), points[self.number]

    def _freeze(self, scene: Any, found: Any) -> Frozen:
        system, state, load = scene.system, found.state, found.load
        refuse(not system.symmetric or system.histories.dissipates, "derivatives of critical loads "
               "are of scenes with a potential: no follower loads, friction or plasticity")
        u, l = np.array(state.u), state.multipliers
        vector = np.append(found.mode, found.critical.multiplier_rate)
        K, J = matrices_of(system, state)[2::2]
        by_load = sum(sign * residual(system, u, l, load + sign * LOADED, state.memory)
                      for sign in (1.0, -1.0)) / (2.0 * LOADED)
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
        stiffer = sum(sign * one.rows(system, load + sign * LOADED).sum()
                      for sign in (1.0, -1.0)) / (2.0 * LOADED)
        factor = -1.0 / (stiffer - adjoint @ by_load)
        size = np.abs(left * by_load).sum() + np.abs(adjoint * by_load).sum()

        def rows(scene):
            rest = residual(scene.system, u, l, load, state.memory)
            return np.concatenate([factor * (one.rows(scene.system) - adjoint * rest),
                                   left * rest / size])

        return Frozen(rows, check=_require_symmetry)


def _require_symmetry(work):
    if np.any(np.abs(work) > SYMMETRIC):
        k = int(np.argmax(np.abs(work)))
        raise InputError(f"parameter {k} disturbs the symmetry of the bifurcation, which becomes a "
                         "limit point below it: the critical load has no derivative, it falls as "
                         "the power 2/3 of the disturbance. Start from a disturbed structure")


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
    step = ASIDE / np.abs(vector[:system.N] / system.constraints.coordinate_sizes).max()
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

