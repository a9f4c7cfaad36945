"""Callbacks from kernels to user-defined loads, joints and force elements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from weakref import proxy

import numpy as np

from ..actions.loads import Load
from ..core.linalg import dense
from ..core.types import Array


class UserDefined:
    """The items of a system without tables.

    Times are nan in statics; results are added to ``out`` (N,). Force elements are called through
    ``forces``.
    """

    def __init__(self, system: Any, loads: Sequence[Load]) -> None:
        self._system = proxy(system)
        self.forces, self._loads = system.forces, list(loads)

    def add_custom_force(self, t: float, scale: float, u: Array, out: Array) -> None:
        """Add the force of the loads."""
        for load in self._loads:
            s, (factor, acting) = self._system.of(load), load.acting(None if np.isnan(t) else t)
            out[s] += scale * factor * acting.force(u[s])

    def add_custom_mean_force(self, t: float, u0: Array, u1: Array, out: Array) -> None:
        """Add the mean force of the loads from u0 to u1."""
        for load in self._loads:
            s, (factor, acting) = self._system.of(load), load.acting(t)
            force = acting.force(u1[s]) if np.array_equal(u0[s], u1[s]) else acting.mean_force(
                u0[s], u1[s])
            out[s] += factor * force

    def subtract_custom_stiffness(self, t: float, scale: float, u: Array, flat: Array) -> None:
        """Subtract the derivative of :meth:`add_custom_force` from the entries (n,) of a band.

        An infinite time stands for linear theory, in which the package's loads have no stiffness.
        """
        system = self._system
        for load in self._loads:
            if np.isinf(t) and not load.first_order:
                continue
            first, (factor, acting) = system.of(load).start, load.acting(
                t if np.isfinite(t) else None)
            i, j, v = map(np.asarray, acting.stiffness(u[system.of(load)]))
            keep = np.full(len(v), not system.symmetric) | (i >= j)
            at = system.K.position(first + i, first + j)
            np.add.at(flat, at[keep], -scale * factor * v[keep])

    def add_custom_joints(self, what: int, t: float, u: Array, v: Array, out: Array) -> None:
        """Evaluate joints.

        ``what`` is 0: Phi, 1: J v, 2: J^T v with v (m,), 3: J, 4: v^T Phi'' v. For the
        energy-momentum scheme, 5: the discrete gradient from v to u, 6: the force of impulses, with
        u at the end of the step and v = (v0, v1, u0, impulses). 7 and 8 are 0 and 1 of the joints
        that depend on time, with zeros for the others.
        """
        c, N = self._system.constraints, self._system.N
        if what == 0:
            out[:] = c.constraint(u, t)
        elif what == 1:
            out += c.full_jacobian(u, t) @ v
        elif what == 2:
            out += v @ c.full_jacobian(u, t)
        elif what == 3:
            out += dense(c.full_jacobian(u, t)).ravel()
        elif what == 4:
            out += c.quadratic(u, t, v)
        elif what == 5:
            out += c.mean_jacobian(v, u, t).ravel()
        elif what >= 7:
            c.add_moving(what == 8, u, v, t, out)
        else:
            v0, v1, u0 = v[:3 * N].reshape(3, N)
            out += c.mean_turning(u0, u, v0, v1, t, v[3 * N:])
