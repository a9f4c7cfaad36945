"""Base class of joints: constraint equations on points and sections; parts of joints."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...beam.layout import Layout
from ...beam.rigid import RigidBody
from ...core.errors import InputError, explained, require_finite, require_slope, shown
from ...core.immutable import is_builtin
from ...core.types import Array
from ...mesh.places import is_point
from ..item import Item, at_generic_displacements, require_entries
from ..places import Vector, products


def gradients(*equations: list) -> tuple[Array, Array, Array]:
    """Nonzero entries of a Jacobian."""
    none = np.zeros(0, dtype=int)
    rows, columns, values = [none], [none], [np.zeros(0)]
    for k, terms in enumerate(equations):
        for vector, direction in terms:
            found = vector.entries(direction)
            rows.append(np.full(len(found[0]), k))
            columns.append(found[0])
            values.append(found[1])
    i, j, v = map(np.concatenate, (rows, columns, values))
    keep = v != 0.0
    return i[keep], j[keep], v[keep]


def rotation(angle: float) -> Array:
    """The rotation matrix."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


class Joint(Item):
    """Constraint equations Phi(u, t) = 0 with Lagrange multipliers.

    :meth:`bind` finds the points of a joint in a scene; ``u`` is the displacement of all its
    degrees of freedom. The multipliers are the constraint forces (or moments), in the order of
    :attr:`equations`. A user-defined joint, for :meth:`skfem_ancf.Scene.add`, is a subclass that
    sets :attr:`equations` and defines :meth:`bind`, :meth:`value`, :meth:`jacobian` or
    :meth:`entries`, and :meth:`curvature` if the Jacobian depends on u.

    Attributes
    ----------
    equations : tuple of str
        Names of the equations.
    constant : bool
        The Jacobian depends neither on u nor on t. Otherwise
        :class:`~skfem_ancf.dynamics.EnergyMomentum` is exact if Phi is at most quadratic in u, or
        if :meth:`mean_entries` and :meth:`mean_turning` are exact.
    moving : bool
        Phi depends on t.
    driver : str
        Name of the attribute that is the function of time, if its values may be an input of a
        linear model; else empty.
    tabled : bool
        Phi is at most quadratic in u, with constant second derivatives; for joints of the package.

    Other Parameters
    ----------------
    beam, name
        Beam, name or number, None where there is only one; name in messages.
    layout
        The :class:`~skfem_ancf.beam.layout.Layout` of the scene.
    u, v, t
        Displacement of the scene's degrees of freedom and a direction, shape (N,); time, in statics
        the load factor.
    multipliers
        Lagrange multipliers, shape (m,).
    u0, u1, v0, v1
        Displacements and velocities at the ends of a step, shape (N,); ``t`` is in its middle.
    times, N
        Times, shape (n,), and the number of the scene's degrees of freedom.
    """

    equations: tuple[str, ...] = ()
    constant = True
    moving = False
    tabled = True
    driver = ""

    def bind(self, layout: Layout) -> None:
        """Find the points and sections; called on a copy."""
        raise NotImplementedError

    def value(self, u: Array, t: float) -> Array:
        """Residual Phi, shape (m,)."""
        raise NotImplementedError

    def jacobian(self, u: Array, t: float) -> Array:
        """Derivative of Phi by u, shape (m, N); by default from :meth:`entries`."""
        rows, columns, values = self.entries(u, t)
        J = np.zeros((len(self.equations), len(u)))
        np.add.at(J, (rows, columns), values)
        return J

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        """Rows, columns and values (k,) of :meth:`jacobian`; repeated entries are summed.

        By default from the dense matrix, which is slow in large scenes.
        """
        J = self.jacobian(u, t)
        rows, columns = np.nonzero(J)
        return rows, columns, J[rows, columns]

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        """Hessian, the sum over k of multipliers[k] d^2 Phi_k / du^2.

        Returns
        -------
        rows, columns, values
            Shapes (k,); or None if the Jacobian is constant.
        """
        return None

    def quadratic(self, u: Array, t: float, v: Array) -> Array:
        """Second directional derivative of Phi along v, shape (m,)."""
        out = np.zeros(len(self.equations))
        for k, unit in enumerate(np.eye(len(out))):
            second = self.curvature(u, t, unit)
            if second is not None:
                out[k] = second[2] @ (v[second[0]] * v[second[1]])
        return out

    def mean_entries(self, u0: Array, u1: Array, t: float) -> tuple[Array, Array, Array]:
        """As :meth:`entries`, of a discrete gradient: ``D (u1 - u0) = Phi(u1) - Phi(u0)``.

        By default the Jacobian in the middle, exact for quadratic Phi.
        """
        return self.entries(0.5 * (u0 + u1), t)

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        """X (N,) with ``X . (u1 - u0) = multipliers . D (v1 - v0) / 2``, D of :meth:`mean_entries`.

        By default ``-(multipliers . Phi'') (v0 + v1) / 4`` in the middle, exact for quadratic Phi.
        """
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

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        """Jacobian in the reference configuration at several times.

        Returns
        -------
        rows, columns, values
            Shapes (k,), (k,) and (n, k).
        """
        zero, m = np.zeros(N), len(self.equations)
        if self.turning:
            J = np.array([self.jacobian(zero, t) for t in times])
            return np.repeat(np.arange(m), N), np.tile(np.arange(N), m), J.reshape(len(times), -1)
        rows, columns, values = self.entries(zero, times[0])
        return rows, columns, values[None].repeat(len(times), axis=0)

    def second_entries(self, N: int) -> tuple[Array, Array, Array, Array]:
        """Second derivatives of Phi in the reference configuration.

        Returns
        -------
        equations, rows, columns, values
            Shapes (k,).
        """
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

    def __repr__(self) -> str:
        at = getattr(self, "at", None)
        if isinstance(at, tuple) and not is_point(at) and all(x is at[0] for x in at):
            at = at[0]  # given once for all
        parts = [type(self).__name__, self.name, None if at is None else f"at {shown(at)}"]
        return f"<{' '.join(part for part in parts if part)}>"


def bind_joint(joint: Joint, layout: Layout) -> Joint:
    """A copy of a joint, bound to a scene and checked.

    Parameters
    ----------
    joint, layout
        The unbound joint, and the :class:`~skfem_ancf.beam.layout.Layout` of the scene.
    """
    bound = joint._thawed()
    hint = ("a joint defines bind(scene), value(u, t), jacobian(u, t), and curvature(u, t, "
            "multipliers) unless that is constant")
    with nullcontext() if is_builtin(joint) else explained(
            "{!r} fails in the reference configuration", hint, InputError, joint):
        bound.bind(layout)
        bound._freeze()
        if not is_builtin(joint):
            m, n, zero = len(bound.equations), layout.N, np.zeros(layout.N)
            require_finite(f"value(u, t) of {bound!r}", bound.value(zero, 0.0), (m,))
            require_finite(f"jacobian(u, t) of {bound!r}", bound.jacobian(zero, 0.0), (m, n))
            second = bound.curvature(zero, 0.0, np.ones(m))
            if second is not None:
                i, j, values = second
                require_entries(f"curvature of {bound!r}", i, j, values, n)
            at_generic_displacements(partial(require_derivatives, bound, layout.sizes),
                                     layout.sizes)
    return bound


def require_derivatives(joint: Joint, sizes: Array, u: Array, d: Array) -> None:
    """Raise InputError unless jacobian and curvature of a user-defined joint fit its value."""
    multipliers = np.cos(np.arange(len(joint.equations)))
    try:
        value, *values = (np.asarray(joint.value(u + s * d, 0.0)) for s in (0.0, -1.0, 1.0))
        J, *others = (joint.jacobian(u + s * d, 0.0) for s in (0.0, -1.0, 1.0))
        found = joint.curvature(u, 0.0, multipliers)
    except Exception:  # it may not be defined there
        return
    require_slope(f"jacobian(u, t) of {joint!r}", "value(u, t)", values[1] - values[0],
                  2.0 * (J @ d), 1e-13 * max(1.0, np.abs(value).max()) * np.abs(sizes).max())
    turned = 0.0 * u
    if found is not None:
        i, j, v = found
        np.add.at(turned, i, v * d[j])
    change = multipliers @ (others[1] - others[0])
    require_slope(f"curvature(u, t, multipliers) of {joint!r}, zero unless it is defined,",
                  "multipliers @ jacobian(u, t)", change * sizes, 2.0 * turned * sizes,
                  1e-12 * np.max(np.abs(multipliers @ J) * sizes, initial=0.0))


def equations_of(names: Sequence[str], n: int) -> tuple[str, ...]:
    """Names of the equations between the first of n beams and each of the others."""
    if n == 2:
        return tuple(names)
    return tuple(f"{name}, from number {k}" for k in range(1, n) for name in names)


def angle_to(d: ArrayLike, e: ArrayLike) -> float:
    """Angle from a plane vector e to another one d, in (-2 pi, 2 pi)."""
    return float(np.arctan2(*np.flip(d)) - np.arctan2(*np.flip(e)))


# equations of joints: their value at displacements u (N,) of the scene, their derivative for
# :func:`gradients`, and a factor times their second derivative, rows, columns and values (k,)

class Affine:
    """The sum of ``direction . vector`` over pairs of both, less a constant."""

    def __init__(self, *pairs: tuple[Vector, Any], less: float = 0.0) -> None:
        self.pairs, self.less = pairs, less

    def value(self, u: Array) -> float:
        return sum(float(direction @ vector(u)) for vector, direction in self.pairs) - self.less

    def terms(self, u: Array) -> Sequence[Any]:
        return self.pairs

    def second(self, factor: float) -> tuple[Array, Array, Array]:
        none = np.zeros(0, dtype=int)
        return none, none, np.zeros(0)


class Aligned:
    """``(Q e) x d``: zero if d is parallel to e rotated by Q."""

    def __init__(self, d: Vector, e: Vector, Q: Array) -> None:
        self.d, self.e, self.Q = d, e, Q

    def value(self, u: Array) -> float:
        e, d = self.Q @ self.e(u), self.d(u)
        return e[0] * d[1] - e[1] * d[0]

    def terms(self, u: Array) -> Sequence[Any]:
        e, d = self.Q @ self.e(u), self.d(u)
        return [(self.d, (-e[1], e[0])), (self.e, (d[1], -d[0]) @ self.Q)]

    def second(self, factor: float) -> tuple[Array, Array, Array]:
        J = np.array([[0.0, -1.0], [1.0, 0.0]]) @ self.Q  # (Q e) x d = -d^T [[0, 1], [-1, 0]] Q e
        rows, columns, values = products(self.d, self.e, factor * J)
        return np.append(rows, columns), np.append(columns, rows), np.append(values, values)


class Distant:
    """``(|d|^2 - R^2) / (2 R)``: zero if a vector d has the length R."""

    def __init__(self, d: Vector, R: float) -> None:
        self.d, self.R = d, R

    def value(self, u: Array) -> float:
        d = self.d(u)
        return float(d @ d - self.R**2) / (2 * self.R)

    def terms(self, u: Array) -> Sequence[Any]:
        return [(self.d, self.d(u) / self.R)]

    def second(self, factor: float) -> tuple[Array, Array, Array]:
        return products(self.d, self.d, factor / self.R * np.eye(2))


class ComposedJoint(Joint):
    """A joint whose equations are some of the above, which :meth:`bind` sets."""

    parts: Sequence[Any] = ()

    def parts_at(self, t: float) -> Sequence[Any]:
        """The equations at a time."""
        return self.parts

    def value(self, u: Array, t: float) -> Array:
        return np.array([part.value(u) for part in self.parts_at(t)])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return gradients(*(part.terms(u) for part in self.parts_at(t)))

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        if self.constant:
            return None
        found = [part.second(m) for part, m in zip(self.parts_at(t), multipliers)]
        i, j, values = map(np.concatenate, zip(*found))
        return i, j, values


class UnitDirector(ComposedJoint):
    """(d . d - 1) / 2 = 0 for the director d of a rigid body, whose first DOF is ``first``."""

    equations = ("length of the director",)
    constant = False

    def __init__(self, body: RigidBody, first: int) -> None:
        self.name = body.name
        self.parts = [Distant(Vector(body.q0[2:], first + np.array([[2], [3]]), 1.0), 1.0)]


# independent equations of a joint

class IndependentPart(Joint):
    """The independent equations of a bound joint, by increasing numbers."""

    def __init__(self, joint: Joint, kept: Array) -> None:
        self.joint, self.kept = joint, kept
        self.equations = tuple(joint.equations[k] for k in kept)
        self.constant, self.moving, self.name = joint.constant, joint.moving, joint.name
        self.tabled = joint.tabled and is_builtin(joint)
        self._number = np.full(len(joint.equations), -1)
        self._number[kept] = np.arange(len(kept))
        self._freeze()

    def __repr__(self) -> str:
        return repr(self.joint)

    def bind(self, layout: Layout) -> None:  # the joint is bound already
        pass

    def _of(self, rows: Array, *others: Array) -> tuple[Any, ...]:
        rows = self._number[rows]
        keep = rows >= 0
        return (rows[keep], *(x[..., keep] for x in others))

    def _all(self, multipliers: Array) -> Array:
        out = np.zeros(len(self._number))
        out[self.kept] = multipliers
        return out

    def value(self, u: Array, t: float) -> Array:
        return np.asarray(self.joint.value(u, t))[self.kept]

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.entries(u, t))

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        return self.joint.curvature(u, t, self._all(multipliers))

    def quadratic(self, u: Array, t: float, v: Array) -> Array:
        return self.joint.quadratic(u, t, v)[self.kept]

    def mean_entries(self, u0: Array, u1: Array, t: float) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.mean_entries(u0, u1, t))

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        return self.joint.mean_turning(u0, u1, v0, v1, t, self._all(multipliers))

    def lost(self, u: Array) -> str:
        return self.joint.lost(u)

    def offset(self, times: Array, N: int) -> Array:
        return self.joint.offset(times, N)[:, self.kept]

    @property
    def turning(self) -> bool:
        return self.joint.turning

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.slope_entries(times, N))

    def second_entries(self, N: int) -> tuple[Array, Array, Array, Array]:
        return self._of(*self.joint.second_entries(N))
