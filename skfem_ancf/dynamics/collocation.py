"""Collocation: implicit Runge-Kutta methods of high order."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.types import Array
from ..equations.system import System
from .base import Motion, Scheme
from .differences import derivative, difference_row, grown
from .stage_records import Method

#: Part of a step up to which accelerations are interpolated where something is driven.
NEAR = 3e-3


class _Tableau:
    """The numbers of a method of collocation.

    Attributes
    ----------
    method
        Its :class:`~skfem_ancf.dynamics.stages.Method`.
    bends
        Of the acceleration, times the square of the step: its highest derivative and the one below,
        from Z and from the acceleration at the end, or at the begin if the last point is the end,
        shape (2, n + 1).
    """

    def __init__(self, points: Array) -> None:
        c, n = points, len(points)
        self.points, k = c, np.arange(1, n + 1)
        inverse = np.linalg.inv(np.vander(c, increasing=True))
        A, weights = (c[:, None]**k / k) @ inverse, (1.0 / k) @ inverse
        first = np.linalg.inv(A)
        values, T = np.linalg.eig(first)
        picked = np.nonzero(values.imag > -1e-12 * abs(values))[0]
        values = np.where(abs(values.imag) > 1e-12 * abs(values), values, values.real)[picked]
        to, back = np.linalg.inv(T)[picked], T[:, picked] * np.where(values.imag > 0.0, 2.0, 1.0)
        self._fit = np.linalg.inv(c[:, None]**(k + 1))  # a polynomial without its first two terms
        one = np.append(c, 1.0) if c[-1] < 1.0 else np.append(0.0, c)
        bends = np.array([difference_row(one), np.append(0.0, difference_row(one[1:]))])
        bends = bends if c[-1] < 1.0 else np.roll(bends, -1, axis=1)
        self.bends = np.hstack([bends[:, :n] @ first @ first, bends[:, n:]])
        parts = (np.ascontiguousarray([x.real, x.imag]) for x in (values, to, back))
        self.method = Method._make([c, weights, first, first @ first, *parts, self.ahead(1.0)])

    def ahead(self, ratio: float) -> Array:
        """``ahead`` of the Method from a step of which the next is so many times as long."""
        powers = np.arange(2, len(self.points) + 2)
        return np.ascontiguousarray((1.0 + ratio * self.points[:, None])**powers @ self._fit)


@lru_cache(16)
def _tableau(points):
    return _Tableau(np.array(points))


class Collocation(Scheme):
    """The equation of motion holds at points of the step, of a polynomial.

    With ``A = (a_ij)`` the integrals from 0 to c_i of the Lagrange polynomials of the points, and b
    those to 1,

    * ``M W_i = Q(U_i, t_i) - f(U_i) - d(U_i, V_i)`` at the times ``t_i = t_0 + c_i h``,
    * ``V = v_0 + h A W`` and ``U = u_0 + h A V``,
    * ``v_1 = v_0 + h b W`` and ``u_1 = u_0 + h b V``.

    The unknowns are ``Z = U - u_0 - h c v_0``: ``W = A^-2 Z / h^2``, ``V = v_0 + A^-1 Z / h``.
    With ``A^-1 = T diag(mu) T^-1`` the iteration matrix falls into ``K + mu D / h + mu^2 M / h^2``
    for each eigenvalue, one complex band for each pair; its factors are kept as long as the
    iteration contracts. It begins with the polynomial of the step before. Joints hold as rates at
    the points, ``J(U) V = 0``, with multipliers in the equation of motion (index 2), and the end is
    moved to where they are closed.

    A method is a subclass with :attr:`points` and ``order``.

    References
    ----------
    Hairer, Lubich, Wanner: "Geometric Numerical Integration", II.1.4, and Hairer, Wanner: "Solving
    Ordinary Differential Equations II", IV.8, eq. (8.8), for the transformation.
    """

    tol = 1e-12
    collocates = True

    @property
    def points(self) -> Array:
        """c, increasing, in (0, 1], shape (n,)."""
        raise NotImplementedError

    @property
    def table(self) -> _Tableau:
        """The numbers of the method."""
        return _tableau(tuple(self.points.tolist()))

    def __repr__(self):
        return f"<{type(self).__name__}, {len(self.points)} points>"

    def require(self, system: System) -> None:
        if system.constraints.m and not (self.joined or system.backend.tables.linear_joints):
            raise InputError(f"{self!r} loses its order with joints that turn or move, and with "
                             "rigid bodies: take 'radau', or 'energy-momentum', which conserves "
                             "energy with them")

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate of the error that a step adds to the displacement, shape (N,).

        From a derivative of the acceleration of as high an order as the method's: the divided
        difference over the points of a step and one of its ends, and of those of the steps before.
        With both ends of a step of Gauss it would vanish for all that is linear, as the residual
        of collocation is odd or even. At the start the orders that are missing grow as the last.

        Parameters
        ----------
        old, new, dt
            Start and end of the step, and its size.
        """
        table, memory = self.table, new.memory or {}
        c, k, (u, v) = table.points, len(table.points), memory["start"]
        known = new.acceleration if c[-1] < 1.0 else old.acceleration
        Z = memory["stages"] - u - dt * c[:, None] * v
        bend, lower = table.bends[:, :k] @ Z + dt**2 * table.bends[:, k:] * known
        n, high, low = derivative(old, new, old.t + 0.5 * dt, bend / dt**(k + 2),
                                  self.order - 1 - k)
        if low is not None:
            lower = dt**(k + n + 1) * low
        return self.error_constant * grown(dt**(k + n + 2) * high, lower, self.order - 1 - k - n)

    def near(self, system: System) -> float:
        """As of :class:`Scheme`: only rates of what is driven are differences."""
        return NEAR if system.constraints.moves or system.backend.tables.motion_varies else 0.0

    def lasting(self, integrator: Any, du: Array, time: float) -> Array:
        return integrator.damped(du, time) if integrator.system.damped else du
