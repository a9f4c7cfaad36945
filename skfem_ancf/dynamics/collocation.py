"""Collocation: implicit Runge-Kutta methods of high order."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander

from ..errors import InputError
from .base import Motion, Scheme
from .integrator import StepFailed
from .rates import JointMotions
from .stages import Interval, Method, collocate, room_for_points

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..system import System
    from ..types import Array
    from .integrator import Integrator

#: Instants of a step at which supports are asked that move.
SAMPLES = 9


class _Tableau:
    """The numbers of a method of collocation.

    Parameters
    ----------
    points
        c, shape (n,).

    Attributes
    ----------
    method
        Its :class:`~skfem_ancf.dynamics.stages.Method`.
    fit
        Of a polynomial without its first two terms, from its values at c.
    samples, rates
        Points in a step, (k,), and what makes both rates at c and at 1 of values there, (2, n + 1,
        k).
    """

    def __init__(self, points: Array) -> None:
        c, n = points, len(points)
        self.points = c
        k = np.arange(1, n + 1)
        inverse = np.linalg.inv(np.vander(c, increasing=True))
        A, weights = (c[:, None]**k / k) @ inverse, (1.0 / k) @ inverse
        first = np.linalg.inv(A)
        values, T = np.linalg.eig(first)
        picked = np.nonzero(values.imag > -1e-12 * abs(values))[0]
        values = np.where(abs(values.imag) > 1e-12 * abs(values), values, values.real)[picked]
        to, back = np.linalg.inv(T)[picked], T[:, picked] * np.where(values.imag > 0.0, 2.0, 1.0)
        self.fit = np.linalg.inv(c[:, None]**(k + 1))
        self.method = Method(c, weights, first, first @ first, *(
            np.ascontiguousarray([x.real, x.imag]) for x in (values, to, back)),
                             (1.0 + c[:, None])**(k + 1) @ self.fit)
        self.samples = 0.5 - 0.5 * np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))
        fit = np.linalg.inv(chebvander(2.0 * self.samples - 1.0, SAMPLES - 1))
        self.rates = np.array([2.0**k * chebval(2.0 * np.append(c, 1.0) - 1.0, chebder(
            np.eye(SAMPLES), k)).T @ fit for k in (1, 2)])


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
    adaptive = False

    @property
    def points(self) -> Array:
        """c, increasing, in (0, 1], shape (n,)."""
        raise NotImplementedError

    @property
    def _table(self):
        """The numbers of the method."""
        return _tableau(tuple(self.points.tolist()))

    def __repr__(self):
        return f"<{type(self).__name__}, {len(self.points)} points>"

    def require(self, system: System) -> None:
        if system.m and not self.joined:
            raise InputError(f"{self!r} loses its order with joints and rigid bodies: take "
                             "'radau', or 'energy-momentum', which conserves energy with them")
        if system.forces.far:
            raise InputError(f"{self!r} is not for scenes with force elements between points far "
                             "apart: take 'energy-momentum' or 'generalized-alpha'")

    def in_blocks(self, system: System) -> bool:
        return True

    def step(self, integrator: Integrator, y: Motion, dt: float) -> Motion:
        done, motion = self.run(integrator, y, dt, 1)
        if not done:
            raise StepFailed(integrator.failure)
        return motion(0)

    def run(self, integrator: Integrator, y: Motion, dt: float, n: int,
            start: float | None = None, first: int = 0,
            block: tuple[int, int] | None = None) -> tuple[int, Callable[[int], Motion]]:
        s, method, w = integrator.system, self._table.method, self._room(integrator)
        given = self._interval(integrator, y, dt, n)
        w.y[:2] = y.u, y.v
        w.guess[:] = self._guess(y, dt)
        w.first[:] = y.memory["forces"] if y.memory else y.multipliers
        points = len(method.points)
        rows, stages = np.empty((n, 3, s.N)), np.empty((n, points, s.N))
        forces, works = np.empty((n, points + 1, s.m)), np.empty(n)
        done = integrator.call(collocate, y, dt, method, integrator.rule, given, w,
                               integrator.state, rows, stages, forces, works)
        times = y.t + dt * np.arange(1, n + 1)

        def motion(k: int) -> Motion:
            """After step k, counted from 0."""
            u, v = rows[k - 1, :2] if k else (y.u, y.v)
            end, _, a = rows[k]
            memory = {"stages": stages[k] - end, "start": u - end, "way": dt * v,
                      "dt": np.array(dt), "forces": forces[k, :-1]}
            return Motion(float(times[k]), *rows[k], a, forces[k, -1], before=dt, memory=memory,
                          dissipated=float(works[k]))

        return done, motion

    def _room(self, integrator):
        """Work arrays, in which factors are kept from step to step."""
        table, s, kept = self._table, integrator.system, integrator.kept
        if integrator.room is None:
            M, method = s.mass.band, table.method
            integrator.room = room_for_points(
                len(method.points), method.values.shape[1], s.N, s.m,
                s.machine.tables.stresses.size, M._replace(flat=np.zeros(M.flat.size)))
        w = integrator.room
        for name in ("re", "im", "J", "Y", "origin"):
            if name in kept and kept[name] is not getattr(w, name):  # of a motion that goes on
                getattr(w, name)[...] = kept[name]
            kept[name] = getattr(w, name)
        return w

    def _interval(self, integrator, y, dt, n):
        """What is given of steps."""
        s, table, h = integrator.system, self._table, float(dt)
        c, limit = table.method.points, integrator.limit
        times = y.t + h * (np.arange(n)[:, None] + np.append(c, 1.0)).ravel()
        times = np.minimum(times, limit)  # before what jumps at the end
        at = y.t + h * (np.arange(n)[:, None] + table.samples).ravel()
        tables, at = s.machine.tables, np.minimum(at, limit)

        def moving(function):
            """Values at the times, and both rates, shape (number of times, 3, ...)."""
            first, second = np.einsum("kps,rs...->kr...p", table.rates,
                                      function(at).reshape(n, len(table.samples), -1))
            first, second = (np.swapaxes(x, 1, 2).reshape(len(times), -1) for x in (first, second))
            return np.stack([function(times), first / h, second / h**2], axis=1)

        held = np.zeros((len(times) if s.moves else 1, 3, s.N))
        if s.moves:
            held[:, :, s.fixed] = moving(s.values_at)
        joints, drives = tables.plain.joints, int(tables.motion_varies)
        c, g = np.zeros((1, 3, s.m)), np.zeros((1, 4, len(joints.gk)))
        if s.m and not joints.own:
            c[:, 0], g[:, :2] = tables.offsets(times[:1]), tables.slopes(times[:1])
            if drives:
                c = moving(tables.offsets)
                if tables.turns:
                    g = moving(tables.slopes)[:, [0, 0, 1, 2]]
        return Interval(h, times, tables.factors(times), held, JointMotions(c, g, drives))

    def _guess(self, y, dt):
        """Z by the polynomial of the step before, or by the acceleration."""
        c, old = self._table.points[:, None], y.memory
        if not old:
            return 0.5 * (dt * c)**2 * y.acceleration
        fit = self._table.fit @ (old["stages"] - old["start"] - c * old["way"])
        x = 1.0 + dt / float(old["dt"]) * c
        return (x**np.arange(2, len(c) + 2) @ fit + old["start"] + x * old["way"]
                - dt * c * y.v)
