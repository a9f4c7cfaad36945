"""What kernels ask of user-defined loads, joints and force elements, in Python.

Kernels know the object by a handle, see :mod:`skfem_ancf.core.callbacks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from weakref import proxy

import numpy as np

from ..actions.loads import Load
from ..core.linalg import dense
from ..core.types import Array


class UserDefined:
    """The items of a system that kernels have no tables of.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`, which has to live as long.
    loads
        The loads without a table.

    Other Parameters
    ----------------
    t, scale
        Time, nan for none, and a factor.
    u, out
        Displacement, and what is added to, shape (N,).

    Attributes
    ----------
    forces : Forces
        The force elements, which answer themselves.
    """

    def __init__(self, system: Any, loads: Sequence[Load]) -> None:
        self._system = proxy(system)
        self.forces, self._loads = system.forces, list(loads)

    def add_own_force(self, t: float, scale: float, u: Array, out: Array) -> None:
        """Add the force of the loads."""
        for load in self._loads:
            s, (factor, acting) = self._system.of(load), load.acting(None if np.isnan(t) else t)
            out[s] += scale * factor * acting.force(u[s])

    def add_own_mean_force(self, t: float, u0: Array, u1: Array, out: Array) -> None:
        """As :meth:`add_own_force`, of their mean force from u0 to u1 at a time t."""
        for load in self._loads:
            s, (factor, acting) = self._system.of(load), load.acting(t)
            force = acting.force(u1[s]) if np.array_equal(u0[s], u1[s]) else acting.mean_force(
                u0[s], u1[s])
            out[s] += factor * force

    def subtract_own_stiffness(self, t: float, scale: float, u: Array, flat: Array) -> None:
        """Subtract the derivative of :meth:`add_own_force` from the numbers of a band matrix.

        Parameters
        ----------
        t, scale, u
            As there; u of shape (N,). An infinite time is that of the first tangent in statics, and
            of linear theory: the stiffness of the package's own loads is of second order there.
        flat
            The numbers of the matrix, shape (n,).
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

    def add_own_joints(self, what: int, t: float, u: Array, v: Array, out: Array) -> None:
        """What joints do.

        Parameters
        ----------
        what
            0: Phi. 1: J v. 2: J^T v, v of shape (m,). 3: J. 4: the second derivative of Phi in the
            direction v. In a step that conserves energy, 5: J of u and v at its ends; 6: the force
            of impulses, of u at its end and v of the velocities at its ends, u at its begin and
            the impulses, shape (3 N + m,).
        t, u, v
            Time, displacement (N,) and a vector, (N,) where no other shape is said.
        out
            What is set, or added to, shape (m,), (N,) or (m N,).
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
        else:
            v0, v1, u0 = v[:3 * N].reshape(3, N)
            out += c.mean_turning(u0, u, v0, v1, t, v[3 * N:])
