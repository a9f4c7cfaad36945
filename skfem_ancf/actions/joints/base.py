"""Base class of joints: constraint equations on points and sections; parts of joints."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...beam import Layout, RigidBody
from ...core import Array, ArrayLike, InputError, explained, is_builtin, require_finite, shown
from ...mesh.places import is_point
from ..bound import BoundConstraint, require_derivatives, require_entries, user_parts
from ..item import Item
from ..places import Vector, dense_entries


def rotation(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


class Joint(BoundConstraint, Item):
    """Constraint equations Phi(u, t) = 0 with Lagrange multipliers.

    :meth:`bind` finds the points of a joint in a scene; ``u`` is the displacement of all its
    degrees of freedom. The multipliers are the constraint forces (or moments), in the order of
    :attr:`equations`. A user-defined joint, for :meth:`skfem_ancf.Scene.add`, is a subclass that
    sets :attr:`equations` and defines :meth:`bind` and :meth:`value`; :meth:`jacobian` or
    :meth:`entries`, and :meth:`curvature`, both by default differences. Set ``constant = False`` if
    the Jacobian depends on u. It may have forces too, as any :class:`~skfem_ancf.Item`: an energy,
    a force, a memory, a mass.

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

    def bind(self, layout: Layout) -> None:
        """Find the points and sections; called on a copy."""
        raise NotImplementedError

    def bound_on(self, layout: Layout) -> list[Any]:
        bound = self._thawed()
        if is_builtin(self):
            bound.bind(layout)
            bound._freeze()
            return [bound]
        hint = ("a joint defines bind(scene) and value(u, t), and sets constant = False where the "
                "derivative of that is not")
        with explained("{!r} fails in the reference configuration", hint, InputError, self):
            bound.bind(layout)
            bound._freeze()
            m, n, zero = len(bound.equations), layout.N, np.zeros(layout.N)
            require_finite(f"value(u, t) of {bound!r}", bound.value(zero, 0.0), (m,))
            require_finite(f"jacobian(u, t) of {bound!r}", bound.jacobian(zero, 0.0), (m, n))
            second = bound.curvature(zero, 0.0, np.ones(m))
            if second is not None:
                i, j, values = second
                require_entries(f"curvature of {bound!r}", i, j, values, n)
            require_derivatives(bound, layout.sizes)
            return [bound, *user_parts(bound, layout)]

    def __repr__(self) -> str:
        at = getattr(self, "at", None)
        if isinstance(at, tuple) and not is_point(at) and all(x is at[0] for x in at):
            at = at[0]  # given once for all
        parts = [type(self).__name__, self.name, None if at is None else f"at {shown(at)}"]
        return f"<{' '.join(part for part in parts if part)}>"


def angle_to(d: ArrayLike, e: ArrayLike) -> float:
    """Angle from a plane vector e to another one d, in (-2 pi, 2 pi)."""
    return float(np.arctan2(*np.flip(d)) - np.arctan2(*np.flip(e)))


# equations of joints

class Equation:
    """The sum of ``n . v`` over pairs of a vector and a direction, plus ``d . M e``, less a number.
    Vectors v, d and e are affine in the degrees of freedom u (N,) of the scene; M is (2, 2)."""

    def __init__(self, *pairs: tuple[Vector, Any],
                 product: tuple[Vector, Vector, Array] | None = None, less: float = 0.0) -> None:
        self.pairs, self.product, self.less = pairs, product, less

    def value(self, u: Array) -> float:
        out = -self.less
        if self.product is not None:
            d, e, M = self.product
            out += float(d(u) @ M @ e(u))
        return out + sum(float(direction @ vector(u)) for vector, direction in self.pairs)

    def terms(self, u: Array) -> Sequence[Any]:
        """Pairs of vectors and directions whose products have the same derivative at u."""
        if self.product is None:
            return self.pairs
        d, e, M = self.product
        both = [(d, (M + M.T) @ d(u))] if d is e else [(d, M @ e(u)), (e, d(u) @ M)]
        return [*self.pairs, *both]

    def second(self, factor: float) -> tuple[Array, Array, Array]:
        """A factor times the second derivative: rows, columns and values (k,)."""
        if self.product is None:
            none = np.zeros(0, dtype=int)
            return none, none, np.zeros(0)
        d, e, M = self.product
        rows, columns, values = dense_entries(d.dofs, e.dofs, np.einsum(
            "ij,ik,jl->ikjl", factor * (M + M.T if d is e else M), d.weights, e.weights))
        if d is e:
            return rows, columns, values
        return np.append(rows, columns), np.append(columns, rows), np.append(values, values)


def aligned(d: Vector, e: Vector, Q: Array) -> Equation:
    """``(Q e) x d``: zero if d is parallel to e rotated by Q."""
    return Equation(product=(d, e, np.array([[0.0, -1.0], [1.0, 0.0]]) @ Q))


def distant(d: Vector, R: float) -> Equation:
    """``(|d|^2 - R^2) / (2 R)``: zero if a vector d has the length R."""
    return Equation(product=(d, d, 0.5 / R * np.eye(2)), less=0.5 * R)


class ComposedJoint(Joint):
    """A joint whose equations are :class:`Equation`, which :meth:`bind` sets."""

    parts: Sequence[Equation] = ()

    def parts_at(self, t: float) -> Sequence[Any]:
        return self.parts

    def value(self, u: Array, t: float) -> Array:
        return np.array([part.value(u) for part in self.parts_at(t)])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        none = np.zeros(0, dtype=int)
        rows, columns, values = [none], [none], [np.zeros(0)]
        for k, part in enumerate(self.parts_at(t)):
            for vector, direction in part.terms(u):
                found = vector.entries(direction)
                rows.append(np.full(len(found[0]), k))
                columns.append(found[0])
                values.append(found[1])
        i, j, v = map(np.concatenate, (rows, columns, values))
        keep = v != 0.0
        return i[keep], j[keep], v[keep]

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
        self.parts = [distant(Vector(body.q0[2:], first + np.array([[2], [3]]), 1.0), 1.0)]


# independent equations of a joint

class IndependentPart(Joint):
    """The independent equations of a bound joint, by increasing numbers."""

    turning = False

    def __init__(self, joint: Joint, kept: Array) -> None:
        self.joint, self.kept = joint, kept
        self.equations = tuple(joint.equations[k] for k in kept)
        self.constant, self.moving, self.name = joint.constant, joint.moving, joint.name
        self.tabled, self.turning = joint.tabled and is_builtin(joint), joint.turning
        self._number = np.full(len(joint.equations), -1)
        self._number[kept] = np.arange(len(kept))
        self._freeze()

    def __repr__(self) -> str:
        return repr(self.joint)

    def _of(self, rows: Array, *others: Array) -> tuple[Any, ...]:
        rows = self._number[rows]
        keep = rows >= 0
        return (rows[keep], *(x[..., keep] for x in others))

    def value(self, u: Array, t: float) -> Array:
        return np.asarray(self.joint.value(u, t))[self.kept]

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.entries(u, t))

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        return self.joint.curvature(u, t, np.bincount(self.kept, multipliers, len(self._number)))

    def mean_entries(self, u0: Array, u1: Array, t: float) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.mean_entries(u0, u1, t))

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        return self.joint.mean_turning(u0, u1, v0, v1, t, np.bincount(
            self.kept, multipliers, len(self._number)))

    def lost(self, u: Array) -> str:
        return self.joint.lost(u)

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.slope_entries(times, N))
