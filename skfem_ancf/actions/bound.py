"""What the equations of a scene see of items: forces and constraints on degrees of freedom."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy import sparse

from ..beam import Beam, Facets, Layout
from ..core import (Array, ArrayLike, InputError, cached_property, is_builtin, refuse,
                    along, require_finite, require_slope, shown, warnings_as_errors)
from .places import Vector

#: Relative step of differences, where a force does not accept complex numbers.
STEP = 1e-6
#: Relative perturbation of the reference configuration for checks of user-defined elements.
ASIDE = 0.01
COMPLEX = getattr(np, "exceptions", np).ComplexWarning


class Bound:
    """Part of a bound item, with its name and the key of its copies. ``of_item`` is the item of
    displacements whose functions it has, if it is not bound itself."""

    name: str | None = None
    of_item: Any = None
    _key: bytes = b""

    def same(self, other: Any) -> bool:
        """True if both are of one item, bound or not."""
        return self._key == getattr(other, "_key", None)

    def __repr__(self) -> str:
        return super().__repr__() if self.of_item is None else repr(self.of_item)


class BoundConstraint(Bound):
    """Equations Phi(u, t) = 0: see :class:`~skfem_ancf.actions.joints.Joint` for attributes,
    methods and their arguments."""

    equations: tuple[str, ...] = ()
    constant = True
    moving = False
    tabled = True
    driver = ""

    def value(self, u: Array, t: float) -> Array:
        """Residual Phi, shape (m,)."""
        raise NotImplementedError

    def jacobian(self, u: Array, t: float) -> Array:
        """Derivative of Phi by u, (m, N); by default from :meth:`entries`, or by differences."""
        if type(self).entries is BoundConstraint.entries:
            return derivative(lambda w: self.value(w, t), u)
        rows, columns, values = self.entries(u, t)
        J = np.zeros((len(self.equations), len(u)))
        np.add.at(J, (rows, columns), values)
        return J

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        """Rows, columns and values (k,) of :meth:`jacobian`; repeated entries are summed. By
        default from the dense matrix, which is slow in large scenes."""
        J = self.jacobian(u, t)
        rows, columns = np.nonzero(J)
        return rows, columns, J[rows, columns]

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        """Hessian, the sum over k of multipliers[k] d^2 Phi_k / du^2: rows, columns and values
        (k,); None if the Jacobian is constant. By default by differences of the Jacobian."""
        if self.constant:
            return None
        at = np.flatnonzero(np.any(self.jacobian(u, t) != 0.0, axis=0))

        def pulled(x: Array) -> Array:
            w = np.asarray(u, dtype=x.dtype).copy()
            w[at] = x
            return multipliers @ self.jacobian(w, t)

        H = derivative(pulled, u[at])
        i, j = np.nonzero(H)
        return i, at[j], H[i, j]

    def quadratic(self, u: Array, t: float, v: Array) -> Array:
        """Second directional derivative of Phi along v, shape (m,)."""
        out = np.zeros(len(self.equations))
        for k, unit in enumerate(np.eye(len(out))):
            second = self.curvature(u, t, unit)
            if second is not None:
                out[k] = second[2] @ (v[second[0]] * v[second[1]])
        return out

    def mean_entries(self, u0: Array, u1: Array, t: float) -> tuple[Array, Array, Array]:
        """As :meth:`entries`, of a discrete gradient: ``D (u1 - u0) = Phi(u1) - Phi(u0)``. By
        default the Jacobian in the middle, exact for quadratic Phi."""
        return self.entries(0.5 * (u0 + u1), t)

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        """X (N,) with ``X . (u1 - u0) = multipliers . D (v1 - v0) / 2``, D of :meth:`mean_entries`.
        By default ``-(multipliers . Phi'') (v0 + v1) / 4`` in the middle, exact for quadratic
        Phi."""
        second, v = self.curvature(0.5 * (u0 + u1), t, multipliers), v0 + v1
        if second is None:
            return 0.0 * v
        rows, columns, values = second
        return -0.25 * np.bincount(rows, values * v[columns], len(v))

    def lost(self, u: Array) -> str:
        """Reason why a converged state violates the joint; "" if it does not."""
        return ""

    def offset(self, times: Array, N: int) -> Array:
        """Phi of the reference configuration at several times, shape (n, m)."""
        zero = np.zeros(N)
        return np.array([self.value(zero, t) for t in times])

    @property
    def turning(self) -> bool:
        """True if the Jacobian in the reference configuration depends on time."""
        return self.moving and not self.constant

    def moved(self, times: Array, N: int) -> Array:
        """Time-dependent columns of :meth:`offset`, shape (n, k)."""
        return self.offset(times, N)

    def terms(self, times: Array, N: int) -> tuple[Array, Array]:
        """:meth:`offset` and the values of :meth:`slope_entries`."""
        return self.offset(times, N), self.slope_entries(times, N)[2]

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        """Rows, columns (k,) and values (n, k) of the reference Jacobian at several times."""
        zero, m = np.zeros(N), len(self.equations)
        if self.turning:
            J = np.array([self.jacobian(zero, t) for t in times])
            return np.repeat(np.arange(m), N), np.tile(np.arange(N), m), J.reshape(len(times), -1)
        rows, columns, values = self.entries(zero, times[0])
        return rows, columns, values[None].repeat(len(times), axis=0)

    def second_entries(self, N: int) -> tuple[Array, Array, Array, Array]:
        """Equations, rows, columns and values (k,) of d^2 Phi / du^2 in the reference
        configuration."""
        none = np.zeros(0, dtype=int)
        zero, out = np.zeros(N), [(none, none, none, np.zeros(0))]
        for row, unit in enumerate(np.eye(len(self.equations))):
            found = self.curvature(zero, 0.0, unit)
            if found is not None:
                i, j, v = (np.asarray(x) for x in found)
                keep = v != 0
                out.append((np.full(keep.sum(), row), i[keep], j[keep], v[keep]))
        k, i, j, v = (np.concatenate(x) for x in zip(*out))
        return k, i, j, v


class BoundForce(Bound):
    """A force on ``links``: see :class:`~skfem_ancf.actions.forces.ForceElement` for attributes,
    methods and their arguments."""

    symmetric = True
    distributed = False
    #: It is the internal force of a member of the scene.
    internal = False
    #: Its force may depend on velocities.
    resists = True
    along: tuple[Beam, list[Facets], tuple[float, ...]] | None = None
    links: Any = ()
    groups: Any = ()
    entries: tuple[Array, Array] | None = None
    masses: tuple[Array, Array, Array] | None = None
    changing = False
    #: Steps and increments change its history, if it has one; else only samples do.
    evolves = True
    #: Increments do not change its history, and its mean forces give all work back.
    conserves = False
    #: With a history, its work that it does not store is dissipated: False for a load.
    dissipates = True

    @cached_property
    def all_dofs(self) -> Array:
        """Those of its links, of a changing one (2 n,)."""
        return np.concatenate([link.dofs.ravel() for link in self.links])

    def force(self, x: Array, v: Array, t: float) -> Array:
        """Force on each point, (n, 2); on section directions the conjugate force. By default minus
        the gradient of the potential."""
        if self.potential_at(x, t) is None:
            raise NotImplementedError("neither a force nor a potential")
        return -derivative(lambda y: self.potential_at(y, t), np.asarray(x))

    def potential(self, x: Array) -> float | None:
        """Potential of the force at zero velocity; None if there is none."""
        return None

    def potential_at(self, x: Array, t: float) -> float | None:
        """Potential at a time, for time-dependent energies."""
        return self.potential(x)

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        """Mean force (n, 2) at zero velocity, whose work is minus the change of the potential.

        By default the force in the middle, corrected along the displacement (Gonzalez 1996): the
        work is exact, but the correction may have a moment. :class:`Spring` and
        :class:`TorsionalSpring` define means that conserve the angular momentum exactly.
        """
        d = y - x
        force = np.asarray(self.force(0.5 * (x + y), 0.0 * x, t), dtype=float)
        before = self.potential_at(x, t) if np.any(d) else None
        after = None if before is None else self.potential_at(y, t)
        if before is None or after is None:
            return force
        excess = after - before + np.sum(force * d)
        # next to rest round-off of the potential, divided by |d|, would be a large force
        if abs(excess) <= 1e-14 * (abs(before) + abs(after)):
            return force
        return force - excess / np.sum(d * d) * d

    def stiffness(self, x: Array, v: Array, t: float) -> Any:
        """Derivative of the force by the positions, shape (n, 2, n, 2), the derivative's axes last.
        By default by a complex step or differences."""
        return derivative(lambda y: self.force(y, v, t), x)

    def mean_stiffness(self, x: Array, y: Array, t: float, *past: Any) -> Any:
        """Twice the derivative of :meth:`mean_force` by y, if ``changing``. By default the
        stiffness in the middle."""
        return self.stiffness(0.5 * (x + y), 0.0 * x, t, *past)

    def resistance(self, x: Array, v: Array, t: float) -> Any:
        """Derivative of the force by the velocities, as :meth:`stiffness`."""
        if not self.resists:
            return np.zeros((len(x), 2, len(x), 2))
        return derivative(lambda w: self.force(x, w, t), v)

    def search_intervals(self, x: Array, y: Array) -> float:
        """Number of intervals in which a line search looks at the force from x to y."""
        return 1.0

    def corrected(self, x: Array, t: float, history: Array) -> Array | None:
        """In statics, a history with which to repeat an increment that ends at x, or None."""
        return None

    def passed(self, x: Array, y: Array, t: float) -> str | None:
        """Why a step must not lead from x to y, as through a body; None if it may."""
        return None

    def mass_entries(self) -> tuple[Array, Array, Array] | None:
        """Rows, columns and values (k,) added to the mass matrix; None for none."""
        return self.masses

    def parts(self) -> list[Any] | None:
        """Its parts of kinds that kernels know, once bound; None for a user-defined element."""
        return None if len(self.links) else []


def slope_at_zero(function: Callable[[float], Any], step: float) -> Any:
    """The derivative of a function of a number at 0, by its values at plus and minus a step."""
    return (function(step) - function(-step)) / (2.0 * step)


def differences(function: Callable[[Array], Any], x: Array) -> Array:
    """Derivative of a function of an array by central differences."""
    step = STEP * max(1.0, float(np.abs(x).max(initial=0.0)))
    units = step * np.eye(x.size).reshape(x.size, *x.shape)
    columns = [(np.asarray(function(x + d)) - function(x - d)) / (2.0 * step) for d in units]
    return np.stack(columns, axis=-1).reshape(*np.shape(columns[0]), *x.shape)


def derivative(function: Callable[[Array], Any], x: Array) -> Array:
    """As :func:`differences`, by complex steps where both agree; for complex x by these only."""
    if np.iscomplexobj(x):
        raise TypeError("complex steps of complex steps")
    out = differences(function, x)
    for k in np.ndindex(x.shape):
        column = (..., *k)
        step, rough = np.zeros(x.shape, dtype=complex), out[column]
        step[k] = 1e-30j
        try:
            with warnings_as_errors(COMPLEX):
                found = np.imag(function(x + step)) / 1e-30
            if np.allclose(found, rough, rtol=1e-4, atol=1e-4 * np.abs(rough).max(initial=0.0)):
                out[column] = found
        except (TypeError, ValueError, COMPLEX):
            pass
    return out


class Remembering:
    """A bound force element with a memory, at one history: as one without memory. ``history`` (k,)
    is that at the start of an increment, ``span`` (1,) the time since."""

    def __init__(self, element: Any) -> None:
        self.element = element
        self.start = np.array(require_finite(f"start() of {element!r}", element.start(), (None,)))
        self._at(self.start, np.zeros(1))

    def __getattr__(self, name):
        return getattr(vars(self)["element"], name)

    def __repr__(self) -> str:
        return repr(self.element)

    def after(self, history: Array, span: Array) -> "Remembering":
        """A copy at another history and span, of which it has views."""
        other = object.__new__(Remembering)
        vars(other).update(vars(self))
        other._at(history, span)
        return other

    def _at(self, history, span):
        self.values, self.history, self.span = history, history.view(), span
        self.history.flags.writeable = False

    def evaluate(self, x: Array, v: Array, t: float, dt: float | None = None
                 ) -> tuple[Array, Array]:
        """Force and history after ``dt``, by default the span."""
        dt = float(self.span[0]) if dt is None else dt
        force, after = self.element.evaluate(x, v, t, self.history, dt)
        refuse(np.shape(after) != self.start.shape, "evaluate(x, v, t, history, dt) of {!r} must "
               "return the force and a history of the shape of start(), {}, got {}", self,
               self.start.shape, np.shape(after))
        return np.asarray(force), np.asarray(after)

    def force(self, x: Array, v: Array, t: float) -> Array:
        return self.evaluate(x, v, t)[0]

    def mean_force(self, x: Array, y: Array, t: float, span: float) -> Array:
        """The mean force (n, 2) of a step about t: of its ends; with the span 0 that at the end."""
        if span and hasattr(self.element, "mean"):
            return self.element.mean(x, y, t, self.history, float(self.span[0]))
        end = self.force(y, 0.0 * y, t + 0.5 * span)
        return 0.5 * (self.evaluate(x, 0.0 * x, t - 0.5 * span, 0.0)[0] + end) if span else end

    def _derivative(self, name, function, at, *x):
        own = getattr(self.element, name)
        if getattr(own, "__func__", None) is not getattr(BoundForce, name):
            return own(*x, self.history, float(self.span[0]))
        return derivative(function, at)

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        return self._derivative("stiffness", lambda y: self.force(y, v, t), x, x, v, t)

    def mean_stiffness(self, x: Array, y: Array, t: float) -> Any:
        return self.element.mean_stiffness(x, y, t, self.history, float(self.span[0]))

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        return self._derivative("resistance", lambda w: self.force(x, w, t), v, x, v, t)

    def potential_at(self, x: Array, t: float, history: Array | None = None) -> float | None:
        own = self.element.potential
        if getattr(own, "__func__", None) is BoundForce.potential:
            return None
        found = own(x, self.history if history is None else history)
        return None if found is None else float(found)

    def accept(self, x: Array, y: Array, v: Array, t: float) -> float:
        """Set the history at the end of an increment from x to y; returns what it dissipates."""
        if not self.element.evolves or self.element.conserves:
            return 0.0
        dt, after = float(self.span[0]), self.evaluate(y, v, t)[1]
        mean = self.mean_force(x, y, t - 0.5 * dt, dt or 1e-300)  # also of a span of zero
        lost = -np.sum(mean * (y - x)) + (self.potential_at(x, t) or 0.0) - (
            self.potential_at(y, t, after) or 0.0)
        self.values[:] = after
        return float(lost) if self.element.dissipates else 0.0

    def settle(self, u0: Array, u: Array, t: float) -> float:
        """As :meth:`accept` in statics, between displacements (N,)."""
        x, y = (positions(self, w) for w in (u0, u))
        return self.accept(x, y, 0.0 * y, t)

    def sample(self, u: Array, v: Array, t: float, first: bool) -> None:
        """Set the history after a measurement at u and v (N,), if due; ``first`` starts over."""
        w = np.array([link(v) - link.start for link in self.element.links])
        self.values[:] = self.element.sample(positions(self, u), w, t,
                                              self.start if first else self.history)

    def take_over(self, other: "Remembering") -> None:
        """Set the history to that of the same element in other equations."""
        self.values[:] = other.history

    def relax(self, u: Array) -> None:
        """Set a history with less stiffness, of contact between members at u (N,)."""
        if hasattr(self.element, "relaxed"):
            self.values[:] = self.element.relaxed(positions(self, u), self.history)

    def correct(self, u: Array, t: float) -> bool:
        """Set a history with which to repeat an increment that ends at u (N,); False for none."""
        new = self.element.corrected(positions(self, u), t, self.history)
        if new is not None:
            self.values[:] = new
        return new is not None


def positions(element: Any, u: Array) -> Array:
    """Positions (n, 2) of the links of a bound element at displacements (N,)."""
    if not element.changing:
        return np.array([link(u) for link in element.links])
    return u[element.all_dofs].reshape(-1, 2)


def is_like(one: Remembering, other: Remembering) -> bool:
    """True for elements of one class on the same places, with histories of one size."""
    a, b = (x.element.of_item or x.element for x in (one, other))
    return type(a) is type(b) and one.start.shape == other.start.shape and np.array_equal(
        one.all_dofs, other.all_dofs)


def recalled(element: Any) -> Any:
    """A bound force element as solvers see it: one with a memory is :class:`Remembering`."""
    return Remembering(element) if hasattr(element, "start") else element


def try_force(bound: Any, sizes: Any = None) -> None:
    """Raise InputError unless the methods of a user-defined force element are consistent."""
    bound = recalled(bound)
    x = np.array([x.start for x in bound.links])
    n, zero = len(x), np.zeros_like(x)
    require_finite(f"force(x, v, t) of {bound!r}", bound.force(x, zero, 0.0), (n, 2))
    own = not is_builtin(bound.of_item or bound)
    if bound.changing:
        K = bound.stiffness(x, zero, 0.0)
        if not sparse.issparse(K) or K.shape != (2 * n, 2 * n):
            raise InputError(f"the stiffness of {bound!r}, with changing = True, must be a sparse "
                             f"matrix of shape {(2 * n, 2 * n)}, got {shown(K)}")
        if any(link.dofs.shape != (2, 1) or np.any(link.weights != 1.0) for link in bound.links):
            raise InputError(f"{bound!r} has changing = True: each of its links must be a pair of "
                             "degrees of freedom, as Vector(np.zeros(2), [[0], [1]], 1.0)")
        if not own:
            return
    else:
        for name in ("stiffness", "resistance"):
            require_finite(f"{name}(x, v, t) of {bound!r}", getattr(bound, name)(x, zero, 0.0),
                           (n, 2, n, 2))
    # generic positions, as terms may vanish in the reference configuration
    sizes = max(1.0, float(np.abs(x).max())) if sizes is None else sizes
    y = x + ASIDE * sizes * np.cos(np.arange(2.0 * n)).reshape(n, 2)
    K = _matrix(bound.stiffness(y, zero, 0.0), 2 * n)
    if own:
        at_generic_displacements(partial(_require_derivatives, bound, x), (sizes + 0.0 * x).ravel())
    if bound.symmetric and not abs(K - K.T).max() <= 1e-4 * abs(K).max():
        raise InputError(f"the derivative of force(x, v, t) of {bound!r} by the places is not "
                         "symmetric: it has no potential. Set symmetric = False in its class")
    if not hasattr(bound, "start") and bound.potential_at(y, 0.0) is not None:
        at_generic_displacements(partial(_require_potential, bound, x), (sizes + 0.0 * x).ravel())


def _matrix(K, n):
    return K if sparse.issparse(K) else np.reshape(K, (n, n))


def _require_derivatives(bound, x, u, d):
    v, d = u.reshape(x.shape), d.reshape(x.shape)
    for name, at in (("stiffness", lambda s: (x + v + s * d, 0.0 * d, 0.0)),
                     ("resistance", lambda s: (x, v + s * d, 0.0))):
        require_slope(f"{name}(x, v, t) of {bound!r}", "force(x, v, t)",
                      lambda s, at=at: bound.force(*at(s)),
                      _matrix(getattr(bound, name)(*at(0.0)), d.size) @ d.ravel())


def _require_potential(bound, x, u, d):
    x, d = x + u.reshape(x.shape), d.reshape(x.shape)
    for t in (0.0, ASIDE):
        require_slope(f"minus force(x, v, t) of {bound!r}", "potential(x)",
                      lambda s, t=t: bound.potential_at(x + s * d, t),
                      -np.sum(bound.force(x, 0.0 * x, t) * d), else_=". Without potential(x), as "
                      "for a time-dependent force, the energy balance is that of the scheme")


def require_derivatives(joint: BoundConstraint, sizes: Array) -> None:
    """Raise InputError unless Jacobian and curvature of user-defined equations are derivatives."""
    multipliers = np.cos(np.arange(len(joint.equations)))

    def check(u: Array, d: Array) -> None:
        try:
            values = along(lambda s: joint.value(u + s * d, 0.0))
            before, J, after = (joint.jacobian(u + s * d, 0.0) for s in (-1.0, 0.0, 1.0))
            found = joint.curvature(u, 0.0, multipliers)
        except Exception:  # it may not be defined there
            return
        require_slope(f"jacobian(u, t) of {joint!r}", "value(u, t)", values, J @ d,
                      1e-13 * max(1.0, np.abs(values[1]).max()) * np.abs(sizes).max())
        turned = 0.0 * u
        if found is not None:
            i, j, v = found
            np.add.at(turned, i, v * d[j])
        require_slope(f"curvature(u, t, multipliers) of {joint!r}, zero with constant = True,",
                      "multipliers @ jacobian(u, t)",
                      [multipliers @ one * sizes for one in (before, J, after)], turned * sizes)

    at_generic_displacements(check, sizes)


def require_entries(what: str, i: ArrayLike, j: ArrayLike, v: ArrayLike, n: int) -> None:
    """Raise InputError unless rows, columns and values are entries of an n x n matrix."""
    i, j = np.asarray(i), np.asarray(j)
    v = require_finite(what, v, (None,))
    if i.dtype.kind not in "iu" or j.dtype.kind not in "iu" or not i.shape == j.shape == v.shape:
        raise InputError(f"{what} must be rows, columns and values of one length, got shapes "
                         f"{i.shape}, {j.shape}, {v.shape}")
    if len(i) and not (0 <= min(i.min(), j.min()) and max(i.max(), j.max()) < n):
        raise InputError(f"{what} has entries in rows and columns {min(i.min(), j.min())} to "
                         f"{max(i.max(), j.max())}: there are 0 to {n - 1}")


def at_generic_displacements(check: Callable[[Array, Array], None], sizes: Array) -> None:
    """Call a check of derivatives at two generic displacements."""
    # It may fail at one of them, where there may be a kink.
    angles = np.arange(len(sizes))
    try:
        check(1e-4 * sizes * np.cos(angles), 1e-6 * sizes * np.sin(angles + 1.0))
    except InputError:
        check(1e-4 * sizes * np.cos(angles + 2.0), 1e-6 * sizes * np.sin(angles + 3.0))


#: Multiples of a displacement of the size of a scene at which a function is compared with a table:
#: a profile may be straight at first, have a bump, or rise only far away.
ALONG = np.concatenate([s * np.append(np.linspace(0.01, 1.0, 100), (2.0, 4.0, 10.0))
                        for s in (1.0, -1.0)])


def everywhere(sizes: Array) -> Array:
    """A displacement (N,) that is about as large as the sizes in each component."""
    rng = np.random.default_rng(0)
    return sizes * rng.uniform(0.5, 1.5, len(sizes)) * rng.choice((-1.0, 1.0), len(sizes))


def is_table(value: Callable[[Array, float], Array], u: Array,
             table: Callable[[float, float], Array], sizes: Array) -> bool:
    """True if ``value(s u, t)`` is ``table(s, t)`` along a displacement u (N,), of sizes (m,)."""
    try:
        with np.errstate(all="ignore"):
            return all(np.all(np.abs(value(s * u, t) - table(s, t))
                              <= 1e-9 * sizes * max(1.0, s * s))  # round-off
                       for k, s in enumerate(ALONG) for t in ((0.0, 0.37)[k % 2],))
    except Exception:  # it may not be defined there
        return False


# user-defined items

class MemberForce(BoundForce):
    """The force of a domain, or of a bound ``load`` that no load factor scales, on all DOFs of its
    member, which begin with ``first``."""

    resists = False

    def __init__(self, source: Any, first: int, load: Any = None) -> None:
        self.source, self.symmetric, self.name, self.load = (
            source, source.symmetric, source.name, load)
        self.internal, self.distributed, member = load is None, load is not None, source
        self._key = getattr(source, "_key", b"")
        if load is None:
            self.entries = source.pattern
        else:
            member = load.beam
            self.along, (i, j, _) = (member, [], ()), self._load_entries(np.zeros(member.N), 0.0)
            self.entries = np.array(i), np.array(j)
        self.links = [Vector(np.zeros(2), first + k + np.arange(2)[:, None], 1.0)
                      for k in range(0, member.N, 2)]

    def _at(self, t):
        """The source at a time, and the sign of its force."""
        return (self.source, -1.0) if self.load is None else (self.load.factor_and_load(t)[1], 1.0)

    def _load_entries(self, u, t):
        none = np.zeros(0, dtype=int)
        return (none, none, 0.0 * none) if self.load.constant else self._at(t)[0].stiffness(u)

    def force(self, x: Array, v: Array, t: float) -> Array:
        source, sign = self._at(t)
        return sign * source.force(x.ravel()).reshape(x.shape)

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        source, sign = self._at(t)
        return self.force(x, x, t) if np.array_equal(x, y) else sign * source.mean_force(
            x.ravel(), y.ravel()).reshape(x.shape)

    def potential_at(self, x: Array, t: float) -> float | None:
        source, u = self._at(t)[0], x.ravel()
        if self.load is not None:
            return source.potential(u)
        return source.energy(u) if self.symmetric else None

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        u = x.ravel()
        return -self.source.stiffness(u) if self.load is None else self._load_entries(u, t)[2]

    def __repr__(self) -> str:
        return repr(self.source)


#: What a bound force may have of an item of displacements besides its energy, by name.
OF_ITEMS = ("force", "mean_force", "mean", "evaluate", "stiffness", "damping", "mean_stiffness",
            "start", "corrected", "relaxed", "passed", "search_intervals", "sample")


def of_pairs(where: tuple[Any, int, Array], name: str, *arguments: Any) -> Any:
    """What a bound force has of an item, at arguments of its pairs of DOFs, arrays (n, 2)."""
    item, N, dofs = where
    whole = []
    for x in arguments:
        whole.append(x)
        if np.ndim(x) == 2:
            whole[-1] = np.zeros(N, dtype=x.dtype)
            whole[-1][dofs] = np.ravel(x)
    found = getattr(item, name)(*whole)
    # results on all degrees of freedom become those on the pairs of the item
    if name == "energy":
        return found if np.iscomplexobj(found) else float(found)
    if name in ("stiffness", "damping", "mean_stiffness"):
        matrix, n = sparse.csr_array(found)[dofs][:, dofs], len(dofs) // 2
        return matrix if sparse.issparse(found) else matrix.toarray().reshape(n, 2, n, 2)
    if name not in ("force", "mean_force", "mean", "evaluate"):
        return found
    force = found[0] if name == "evaluate" else found
    refuse(np.shape(force) != (N,), "the force of {!r} must have the shape ({},), got {}", item, N,
           np.shape(force))
    force = np.asarray(force)[dofs].reshape(-1, 2)
    return (force, found[1]) if name == "evaluate" else force


def force_of(item: Any, layout: Layout) -> BoundForce:
    """Energy, force and mass of an item of displacements, on pairs of its degrees of freedom."""
    out, N, zero = BoundForce(), layout.N, np.zeros(layout.N)
    out.of_item, out.name, out._key = item, item.name, item._key
    out.symmetric, out.dissipates = item.symmetric, item.dissipates
    dofs = np.arange(N) if item.dofs is None else np.unique(item.dofs)
    refuse(dofs.dtype.kind != "i" or (dofs.size and not 0 <= dofs[0] <= dofs[-1] < N), "dofs of "
           "{!r} must be numbers from 0 to {}, got {!r}", item, N - 1, item.dofs)
    if hasattr(item, "mass"):
        M = sparse.coo_array(item.mass())
        refuse(M.shape != (N, N), "mass() of {!r} must have the shape {}, got {}", item, (N, N),
               M.shape)
        require_entries(f"mass() of {item!r}", M.row, M.col, M.data, N)
        out.masses = M.row, M.col, M.data
    if not any(hasattr(item, name) for name in ("energy", "force", "evaluate")):
        return out
    pairs = np.unique(dofs // 2)
    out.links = [Vector(np.zeros(2), 2 * k + np.arange(2)[:, None], 1.0) for k in pairs]
    where, past = (item, N, out.all_dofs), [item.start(), 0.0] if hasattr(item, "start") else []
    names = {"damping": "resistance", "energy": "potential" if past else "potential_at"}
    for name in (*OF_ITEMS, "energy"):
        if hasattr(item, name):
            setattr(out, names.get(name, name), partial(of_pairs, where, name))
    if hasattr(item, "stiffness"):
        out.changing = sparse.issparse(item.stiffness(zero, zero, 0.0, *past))
    out.evolves = getattr(item, "evolves", True)
    out.resists = hasattr(item, "damping") or not out.changing and (
        hasattr(item, "force") or hasattr(item, "evaluate"))
    try_force(out, layout.sizes[out.all_dofs].reshape(-1, 2))
    return out


def _array(function, u, t):
    found = function(u, t)
    return found.toarray() if sparse.issparse(found) else np.asarray(found)


def user_parts(item: Any, layout: Layout, force: bool = True) -> list[Any]:
    """The force and the constraint that a bound item has; ``force`` False leaves out the first."""
    parts: list[Any] = []
    if force and any(hasattr(item, name) for name in ("energy", "force", "mass", "evaluate")):
        parts.append(force_of(item, layout))
    if not hasattr(item, "constraint"):
        return parts
    out, zero, u = BoundConstraint(), np.zeros(layout.N), everywhere(layout.sizes)
    out.of_item, out.moving, out.name, out._key = item, item.moving, item.name, item._key
    vars(out)["value"] = partial(_array, item.constraint)
    if hasattr(item, "jacobian"):
        vars(out)["jacobian"] = partial(_array, item.jacobian)
    m = len(require_finite(f"constraint(u, t) of {item!r}", out.value(zero, 0.0), (None,)))
    out.equations = tuple(f"equation {k}" for k in range(m))
    J = require_finite(f"jacobian(u, t) of {item!r}", out.jacobian(zero, 0.0), (m, layout.N))
    out.constant = out.tabled = is_table(
        out.value, u, lambda s, t: out.value(zero, t) + s * (J @ u), np.abs(J) @ np.abs(u))
    require_derivatives(out, layout.sizes)
    return [*parts, out]
