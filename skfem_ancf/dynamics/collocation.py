"""Collocation: Gauss and Radau methods of high order."""

from dataclasses import replace
from functools import lru_cache
from math import factorial
from typing import Any

import numpy as np

from ..core import Array, gauss, read_only, refuse, require_integer
from ..equations.system import System
from .base import Motion, Scheme, derivative, difference_row, grown
from .records import Method

#: Fraction of a step below which accelerations are interpolated, with prescribed motions.
NEAR = 3e-3


class _Tableau:
    """Coefficients of a collocation method. ``bends`` (2, n + 1) are the weights of dt^2 times the
    highest derivative of the acceleration and the one below. They apply to Z and to the
    acceleration at the end of the step (at the start if the last point is the end)."""

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
        self._fit = np.linalg.inv(c[:, None]**(k + 1))  # monomials of degree 2 and above
        one = np.append(c, 1.0) if c[-1] < 1.0 else np.append(0.0, c)
        bends = np.array([difference_row(one), np.append(0.0, difference_row(one[1:]))])
        bends = bends if c[-1] < 1.0 else np.roll(bends, -1, axis=1)
        self.bends = np.hstack([bends[:, :n] @ first @ first, bends[:, n:]])
        parts = (np.ascontiguousarray([x.real, x.imag]) for x in (values, to, back))
        self.method = Method._make([c, weights, first, first @ first, *parts, self.ahead(1.0)])

    def ahead(self, ratio: float) -> Array:
        """``Method.ahead`` for a step whose size changes by this ratio."""
        powers = np.arange(2, len(self.points) + 2)
        return np.ascontiguousarray((1.0 + ratio * self.points[:, None])**powers @ self._fit)


@lru_cache(16)
def _tableau(points):
    return _Tableau(np.array(points))


class Collocation(Scheme):
    """Collocation: the equation of motion holds at n points of each step.

    With ``a_ij`` the integral of the Lagrange polynomial j from 0 to c_i, and b_j that from 0 to 1,

    * ``M W_i = Q(U_i, t_i) - f(U_i) - d(U_i, V_i)`` at the times ``t_i = t_0 + c_i h``,
    * ``V = v_0 + h A W`` and ``U = u_0 + h A V``,
    * ``v_1 = v_0 + h b W`` and ``u_1 = u_0 + h b V``.

    The unknowns are ``Z = U - u_0 - h c v_0``: ``W = A^-2 Z / h^2``, ``V = v_0 + A^-1 Z / h``.
    With ``A^-1 = T diag(mu) T^-1`` the iteration matrix decouples into ``K + mu D / h + mu^2 M /
    h^2``, one complex band matrix for each pair of eigenvalues; its factors are reused while the
    iteration contracts. The initial guess is the polynomial of the previous step. Joints enter as
    ``J(U) V = 0`` at the points (index 2); the end of the step is projected onto the constraints.
    Materials and items with a history have that of the start of the step at all points, with the
    time since then: the order is that of their law.

    A method is a subclass with :attr:`points` and ``order``. See Hairer, Lubich, Wanner: "Geometric
    Numerical Integration", II.1.4, and Hairer, Wanner: "Solving Ordinary Differential Equations
    II", IV.8, eq. (8.8), for the transformation.
    """

    tol = 1e-12
    collocates = True

    @property
    def points(self) -> Array:
        """c, increasing, in (0, 1], shape (n,)."""
        raise NotImplementedError

    @property
    def table(self) -> _Tableau:
        return _tableau(tuple(self.points.tolist()))

    def __repr__(self):
        return f"<{type(self).__name__}, {len(self.points)} points>"

    def require(self, system: System) -> None:
        refuse(system.forces.changing, "{!r} does not take {[0][0]!r}, whose stiffness has entries "
               "that change from step to step: use 'energy-momentum' or 'generalized-alpha'", self,
               system.forces.changing)
        refuse(system.constraints.m and not (self.joined or system.backend.tables.linear_joints),
               "{!r} loses its order with joints that turn or move, and with rigid bodies: use "
               "'radau', or 'energy-momentum', which conserves energy with them", self)

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate the error that a step adds to the displacement, shape (N,).

        The estimate uses a derivative of the acceleration, by divided differences over the points
        of the step, one of its ends and previous steps. (Both ends of a Gauss step would give zero
        for linear problems.) At the start, missing derivatives are extrapolated.

        Parameters
        ----------
        old, new, dt
            Start and end of the step, and its size.
        """
        table, memory = self.table, new.memory or {}
        c, k, (u, v) = table.points, len(table.points), memory["start"]
        known = new.acceleration if c[-1] < 1.0 else old.acceleration
        Z = memory["points"][:, :len(u)] - u - dt * c[:, None] * v
        bend, lower = table.bends[:, :k] @ Z + dt**2 * table.bends[:, k:] * known
        n, high, low = derivative(old, new, old.t + 0.5 * dt, bend / dt**(k + 2),
                                  self.order - 1 - k)
        if low is not None:
            lower = dt**(k + n + 1) * low
        return self.error_constant * grown(dt**(k + n + 2) * high, lower, self.order - 1 - k - n)

    def near(self, system: System) -> float:
        """As in :class:`Scheme`; only prescribed motions have rates by differences."""
        return NEAR if system.constraints.moves or system.backend.tables.motion_varies else 0.0

    def force_instants(self, y: Motion) -> list[tuple[float, Motion]]:
        if y.memory is None:
            return super().force_instants(y)
        h, (c, b, inverse, *_), (u, v) = y.before, self.table.method, y.memory["start"]
        U = y.memory["points"][:, :len(u)]
        V = v + inverse @ (U - u - h * c[:, None] * v) / h
        return [(h * weight, replace(y, t=y.t + (at - 1.0) * h, u=one, v=rate, memory=None))
                for weight, at, one, rate in zip(b, c, U, V)]

    def lasting(self, integrator: Any, du: Array, time: float) -> Array:
        return integrator.damped(du, time) if integrator.system.damped else du


# gauss methods

#: Calibrated factors of the estimated error by number of points. The more points, the larger the
#: phase of a vibration in a step, and the more the estimate falls short.
SAFETY = {1: 1.0, 2: 0.9, 3: 1.4, 4: 3.0}


class Gauss(Collocation):
    """Collocation at the n Gauss points: order 2 n, symmetric and symplectic.

    Quadratic invariants such as momentum and angular momentum are conserved to the tolerance of the
    iteration; the energy stays close to its initial value for very long times. n = 1 is the
    implicit midpoint rule. Nothing is damped: accelerations of a stiff beam at the end of a step
    are dominated by vibrations that the steps do not resolve; use :class:`Radau` for those.

    Joints that are linear in the degrees of freedom and do not move (rigid connections, hinges of
    beams) keep the order; other joints and rigid bodies raise an InputError. See Hairer, Lubich,
    Wanner: "Geometric Numerical Integration", II.1.3 and VI.4.

    Parameters
    ----------
    points
        1 to 4.

    Examples
    --------
    >>> from skfem_ancf.dynamics import Gauss
    >>> Gauss(3), Gauss(3).order
    (<Gauss, 3 points>, 6)
    """

    name = "gauss"
    joined = False
    filtered = 2

    def __init__(self, points: int = 3) -> None:
        self.number = require_integer("points", points, 1, 4)
        n = self.number
        self.safety = SAFETY[n]
        self.order = 2 * n
        self.error_constant = factorial(n)**2 / (factorial(2 * n) * factorial(2 * n + 1))

    @property
    def points(self) -> Array:
        return gauss(self.number)[0]


# the Radau IIA method

POINTS = read_only(np.array([0.4 - 0.1 * np.sqrt(6.0), 0.4 + 0.1 * np.sqrt(6.0), 1.0]))


class Radau(Collocation):
    """Radau IIA with three points: order 5, L-stable.

    Vibrations that a step does not resolve are damped at once: for stiff beams and large steps. See
    Hairer, Wanner: "Solving Ordinary Differential Equations II", IV.5, table 5.6.

    Examples
    --------
    >>> from skfem_ancf.dynamics import Radau
    >>> Radau().points.round(4).tolist()
    [0.1551, 0.6449, 1.0]
    """

    name = "radau"
    order = 5
    error_constant = 1.0 / 7200.0
    safety = 0.8

    @property
    def points(self) -> Array:
        return POINTS
