"""Bind items to the degrees of freedom of a scene; adapt user-defined items."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy import sparse

from ..beam.layout import Layout
from ..core.errors import InputError, explained, require_finite, shown
from ..core.types import Array
from .forces.base import ForceElement, KernelElement, Unscaled, bind_force, derivative, try_force
from .item import Item, at_generic_displacements, require_entries
from .joints.base import Joint, bind_joint, require_derivatives
from .loads import Load, bind_load
from .places import Vector
from .supports import Support


def bind_item(item: Item, layout: Layout) -> list[Any]:
    """The bound loads, joints, force elements and supports of an item."""
    if isinstance(item, Support):
        return [item.bind(layout)]
    if isinstance(item, Load):
        load = bind_load(item, layout.beam(item.beam))
        return [load if load.scaled else Unscaled(load, layout)]
    if isinstance(item, Joint):
        return [bind_joint(item, layout)]
    if isinstance(item, ForceElement):
        return [bind_force(item, layout)]
    hint = ("its energy(u, t), force(u, v, t) and constraint(u, t) take displacements and "
            f"velocities of all degrees of freedom, shape ({layout.N},)")
    with explained("{!r} fails in the reference configuration", hint, InputError, item):
        bound = item.bind(layout)
        if not isinstance(bound, Item):
            raise InputError(f"bind(layout) of {item!r} must return an Item, got {shown(bound)}")
        out: list[Any] = []
        if any(hasattr(bound, name) for name in ("energy", "force", "mass", "evaluate")):
            out.append(_Force(bound, layout))
        if hasattr(bound, "constraint"):
            out.append(_Constraint(bound, layout))
    if not out:
        raise InputError(f"{item!r} does nothing: an item defines energy(u, t), force(u, v, t), "
                         "constraint(u, t) or mass()")
    for part in out:
        part._freeze()
    return out


class _Force(ForceElement):
    """Energy, force and mass of a user-defined item, on pairs of its degrees of freedom.

    ``past`` are history and time of an increment, of an item with a memory.
    """

    def __init__(self, item: Any, layout: Layout) -> None:
        if hasattr(item, "start"):
            self.start, self.evaluate = item.start, self._evaluate
        self.item, self._N, self.symmetric = item, layout.N, item.symmetric
        self.name, self._key = item.name, item._key
        dofs = np.arange(layout.N) if item.dofs is None else np.unique(item.dofs)
        if dofs.dtype.kind != "i" or (dofs.size and not 0 <= dofs[0] <= dofs[-1] < layout.N):
            raise InputError(f"dofs of {item!r} must be numbers from 0 to {layout.N - 1}, got "
                             f"{shown(item.dofs)}")
        self.resists = hasattr(item, "force") or hasattr(item, "evaluate")
        self._forced = hasattr(item, "energy") or self.resists
        pairs = np.unique(dofs // 2) if self._forced else dofs[:0]
        self._dofs = (2 * pairs[:, None] + np.arange(2)).ravel()
        self.links = [Vector(np.zeros(2), 2 * k + np.arange(2)[:, None], 1.0) for k in pairs]
        self._mass = None if not hasattr(item, "mass") else _entries(
            f"mass() of {item!r}", item.mass(), layout.N)
        if self._forced:
            self.changing = self._is_sparse(layout)
            try_force(self, layout.sizes[self._dofs].reshape(-1, 2))

    def _is_sparse(self, layout):
        if not hasattr(self.item, "stiffness"):
            return False
        zero = np.zeros(layout.N)
        past = (self.item.start(), 0.0) if hasattr(self.item, "start") else ()
        return sparse.issparse(self.item.stiffness(zero, zero, 0.0, *past))

    def _whole(self, x):
        out = np.zeros(self._N, dtype=np.asarray(x).dtype)
        out[self._dofs] = np.ravel(x)
        return out

    def _evaluate(self, x, v, t, history, dt):
        force, after = self.item.evaluate(self._whole(x), self._whole(v), t, history, dt)
        return self._at(force), after

    def force(self, x: Array, v: Array, t: float, *past: Any) -> Array:
        if past:
            return self._evaluate(x, v, t, *past)[0]
        if hasattr(self.item, "force"):
            return self._at(self.item.force(self._whole(x), self._whole(v), t))
        return -derivative(lambda y: self.item.energy(self._whole(y), t), np.asarray(x))

    def _at(self, force):
        found = np.asarray(force)
        if found.shape != (self._N,):
            raise InputError(f"the force of {self.item!r} must have the shape ({self._N},), got "
                             f"{found.shape}")
        return found[self._dofs].reshape(-1, 2)

    def potential(self, x: Array, *past: Any) -> float | None:
        """Energy at a history, or at a time without a memory."""
        return float(self.item.energy(self._whole(x), *past)) if hasattr(
            self.item, "energy") else None

    def potential_at(self, x: Array, t: float) -> float | None:
        return self.potential(x, t)

    def _derivative_by(self, name, x, v, t, otherwise, *past):
        if not hasattr(self.item, name):
            return sparse.csr_array((x.size, x.size)) if self.changing else otherwise()
        found = getattr(self.item, name)(self._whole(x), self._whole(v), t, *past)
        matrix = sparse.csr_array(found)[self._dofs][:, self._dofs]
        n = len(self._dofs) // 2
        return matrix if self.changing else matrix.toarray().reshape(n, 2, n, 2)

    def stiffness(self, x: Array, v: Array, t: float, *past: Any) -> Any:
        return self._derivative_by("stiffness", x, v, t, lambda: derivative(
            lambda y: self.force(y, v, t, *past), x), *past)

    def resistance(self, x: Array, v: Array, t: float, *past: Any) -> Any:
        if not (self.resists or self.changing):
            return np.zeros((len(x), 2, len(x), 2))
        return self._derivative_by("damping", x, v, t, lambda: derivative(
            lambda w: self.force(x, w, t, *past), v), *past)

    def mass_entries(self) -> tuple[Array, Array, Array] | None:
        return self._mass

    def parts(self) -> list[KernelElement] | None:
        return None if self._forced else []

    def __repr__(self) -> str:
        return repr(self.item)


class _Constraint(Joint):
    """The constraint of a user-defined item."""

    constant = tabled = False

    def __init__(self, item: Any, layout: Layout) -> None:
        self.item, self.moving, self.name, self._key = item, item.moving, item.name, item._key
        zero = np.zeros(layout.N)
        value = item.constraint(zero, 0.0)
        m = len(require_finite(f"constraint(u, t) of {item!r}", value, (None,)))
        self.equations = tuple(f"equation {k}" for k in range(m))
        require_finite(f"jacobian(u, t) of {item!r}", self.jacobian(zero, 0.0), (m, layout.N))
        at_generic_displacements(partial(require_derivatives, self, layout.sizes), layout.sizes)

    def value(self, u: Array, t: float) -> Array:
        return np.asarray(self.item.constraint(u, t))

    def jacobian(self, u: Array, t: float) -> Array:
        if hasattr(self.item, "jacobian"):
            found = self.item.jacobian(u, t)
            return found.toarray() if sparse.issparse(found) else np.asarray(found)
        return derivative(lambda w: self.item.constraint(w, t), u)

    def curvature(self, u: Array, t: float, multipliers: Array) -> tuple[Array, Array, Array]:
        rows = np.flatnonzero(np.any(self.jacobian(u, t) != 0.0, axis=0))

        def pulled(x: Array) -> Array:
            w = np.asarray(u, dtype=x.dtype).copy()
            w[rows] = x
            return multipliers @ self.jacobian(w, t)

        H = derivative(pulled, u[rows])
        i, j = np.nonzero(H)
        return i, rows[j], H[i, j]

    def __repr__(self) -> str:
        return repr(self.item)


def _entries(what, matrix, N):
    """Rows, columns and values of a matrix, checked."""
    found = sparse.coo_array(matrix)
    if found.shape != (N, N):
        raise InputError(f"{what} must have the shape ({N}, {N}), got {found.shape}")
    require_entries(what, found.row, found.col, found.data, N)
    return found.row, found.col, found.data
