"""Collocation: implicit Runge-Kutta methods of high order."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander

from ..core.band import factorize, fix, solve
from ..beam.strain_energy import gradients_size
from ..core.errors import InputError
from .base import Memories, Motion, Scheme, Steps, contacts_of, recalled
from .differences import derivative, difference_row, grown
from .integrator import StepFailed
from .rates import JointMotions
from .stages import Interval, Method, collocate, room_for_points, solve_for

if TYPE_CHECKING:
    from ..equations.system import System
    from ..core.types import Array
    from .integrator import Integrator

#: Part of a step up to which accelerations are interpolated where something is driven.
NEAR = 3e-3
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
    ends, half_square
        The points, and 1, shape (n + 1,), and c^2 / 2, shape (n, 1).
    method
        Its :class:`~skfem_ancf.dynamics.stages.Method`.
    fit
        Of a polynomial without its first two terms, from its values at c.
    bends
        Of the acceleration, times the square of the step: its highest derivative and the one below,
        from Z and from the acceleration at the end, or at the begin if the last point is the end,
        shape (2, n + 1).
    samples, rates
        Points in a step, (k,), and what makes both rates at c and at 1 of values there, (2, n + 1,
        k).
    """

    def __init__(self, points: Array) -> None:
        c, n = points, len(points)
        self.points, self.ends, self.half_square = c, np.append(c, 1.0), 0.5 * c[:, None]**2
        k = np.arange(1, n + 1)
        inverse = np.linalg.inv(np.vander(c, increasing=True))
        A, weights = (c[:, None]**k / k) @ inverse, (1.0 / k) @ inverse
        first = np.linalg.inv(A)
        values, T = np.linalg.eig(first)
        picked = np.nonzero(values.imag > -1e-12 * abs(values))[0]
        values = np.where(abs(values.imag) > 1e-12 * abs(values), values, values.real)[picked]
        to, back = np.linalg.inv(T)[picked], T[:, picked] * np.where(values.imag > 0.0, 2.0, 1.0)
        self.fit = np.linalg.inv(c[:, None]**(k + 1))
        one = np.append(c, 1.0) if c[-1] < 1.0 else np.append(0.0, c)
        bends = np.array([difference_row(one), np.append(0.0, difference_row(one[1:]))])
        bends = bends if c[-1] < 1.0 else np.roll(bends, -1, axis=1)
        self.bends = np.hstack([bends[:, :n] @ first @ first, bends[:, n:]])
        parts = (np.ascontiguousarray([x.real, x.imag]) for x in (values, to, back))
        self.method = Method._make([c, weights, first, first @ first, *parts, self.ahead(1.0)])
        self.samples = 0.5 - 0.5 * np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))
        fit = np.linalg.inv(chebvander(2.0 * self.samples - 1.0, SAMPLES - 1))
        self.rates = np.array([2.0**k * chebval(2.0 * np.append(c, 1.0) - 1.0, chebder(
            np.eye(SAMPLES), k)).T @ fit for k in (1, 2)])

    def ahead(self, ratio: float) -> Array:
        """``ahead`` of the Method from a step of which the next is so many times as long."""
        powers = np.arange(2, len(self.fit) + 2)
        return np.ascontiguousarray((1.0 + ratio * self.points[:, None])**powers @ self.fit)


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
    text = "collocate"

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
        if system.constraints.m and not (self.joined or system.machine.tables.linear_joints):
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
        table, memory = self._table, new.memory or {}
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
        """As of :class:`Scheme`: accelerations are those of the equation of motion.

        Only rates of what is driven are differences.

        Parameters
        ----------
        system
            A :class:`~skfem_ancf.equations.system.System`.
        """
        return NEAR if system.constraints.moves or system.machine.tables.motion_varies else 0.0

    def resolved(self, integrator: Integrator, du: Array) -> Array:
        s, w = integrator.system, integrator.room
        k = int(np.argmin(np.abs(w.method.values[1])))
        mu = complex(*w.method.values[:, k]) / integrator.dt
        x = mu**2 * s.mass.multiply(du) * s.constraints.free
        x, y = np.ascontiguousarray(x.real), np.ascontiguousarray(x.imag)
        solve_for(w, k, x, y)
        return x

    def lasting(self, integrator: Integrator, du: Array, time: float) -> Array:
        s, M = integrator.system, integrator.system.mass.band
        if not s.damped:
            return du
        A = M._replace(flat=M.flat + 0.5 * time * integrator.room.D.flat, pivots=M.pivots.copy())
        fix(A, s.constraints.fixed)
        if not factorize(A):
            return du
        x = s.mass.multiply(du) * s.constraints.free
        solve(A, x)
        return x

    def in_blocks(self, system: System) -> bool:
        return True

    def step(self, integrator: Integrator, y: Motion, dt: float) -> Motion:
        taken = self.run(integrator, y, dt, 1)
        if not taken:
            raise StepFailed(integrator.failure)
        return taken[0]

    def run(self, integrator: Integrator, y: Motion, dt: float, n: int,
            start: float | None = None, first: int = 0,
            block: tuple[int, int] | None = None) -> Steps:
        s, table = integrator.system, self._table
        method, w = table.method, self._room(integrator, table)
        begun, contacts = y.t if start is None else start, s.forces.contacts
        block = (first, first + n) if block is None else block
        w.y[0], w.y[1], w.first[:] = y.u, y.v, y.multipliers
        given = self._given(integrator, table, begun, dt, first, n, block)
        if not y.memory or "stages" not in y.memory:
            np.multiply(integrator.asked[2], y.acceleration, out=w.guess)
        else:
            for name, room in (("stages", w.U), ("start", w.before), ("forces", w.first)):
                room[:] = recalled(y.memory, name, room.shape)
            ahead = method.ahead if dt == y.before else table.ahead(dt / y.before)
            given = given._replace(begun=1, ahead=ahead)
        rows, stages = np.empty((n + 1, 3, s.N)), np.empty((n, len(method.points), s.N))
        rows[0, 0], rows[0, 1] = y.u, y.v
        forces = np.empty((n, len(method.points) + 1, s.constraints.m))
        memories = np.empty((n, 1 + (contacts.tables.memory.size if contacts.lasting else 0)))
        with contacts.lent(contacts_of(y)):
            done = integrator.call(collocate, y, dt, integrator.rule, given, w, integrator.state,
                                   memories, rows[1:], stages, forces)

        memory = Memories(y, done, memories[:, 1:] if contacts.lasting else None,
                          stages=stages, start=rows[:, :2], forces=forces[:, :-1])
        return Steps(begun, dt, first, rows[1:], forces[:, -1:], memories[:, 0], memory)

    def _room(self, integrator, table):
        """Work arrays, in which factors are kept from step to step."""
        s, kept = integrator.system, integrator.kept
        if integrator.room is None:
            M, size, n = s.mass.band, s.machine.tables.stresses.size, len(table.points)
            rows = len(integrator.matrices.rows.P)
            integrator.room = room_for_points(table.method, s.N, s.constraints.m, rows, size,
                                              gradients_size(s.machine.tables.plain.body),
                                              M._replace(flat=np.zeros(M.flat.size)))
            integrator.machine = s.machine.with_tables(s.machine.tables.copied(n))
        w = integrator.room
        if kept.get("pairs") is w.pairs:
            return w
        factors = {"pairs": w.pairs, "real": w.real.flat} | (
            {"J": w.J, "Y": w.Y, "S": w.S, "Q": w.Q} if len(w.J) else {})
        for name, room in factors.items():
            if name in kept and kept[name] is not room:  # of a motion that goes on
                room[...] = recalled(kept, name, room.shape, room.dtype.kind, finite=False)
            kept[name] = room
        return w

    def _given(self, integrator, table, start, dt, first, n, block):
        """What is given of some steps of a block, whose functions of time are asked at once."""
        key, points = (start, dt, block, integrator.limit), len(table.method.points) + 1
        if integrator.asked[0] != key:
            integrator.asked = (key, self._interval(integrator, table, *key),
                                table.half_square * dt**2)
        whole = integrator.asked[1]
        if block[1] - block[0] == n:
            return whole
        part = slice((first - block[0]) * points, (first - block[0] + n) * points)

        def rows(x):
            return x if len(x) == 1 else x[part]

        return whole._replace(
            times=whole.times[part], factors=rows(whole.factors), held=rows(whole.held),
            joints=JointMotions(rows(whole.joints.c), rows(whole.joints.g), whole.joints.drives))

    def _interval(self, integrator, table, start, dt, block, limit):
        """What is given of a block of steps."""
        s, h, steps = integrator.system, float(dt), np.arange(*block)[:, None]
        times = start + h * (steps + table.ends).ravel()
        if limit < np.inf:  # before what jumps at the end
            times = np.minimum(times, limit)
        tables = s.machine.tables

        moves, drives, at = s.constraints.moves, int(tables.motion_varies), times
        if moves or drives:  # where the functions are asked, those times first
            at = np.append(times, np.minimum(start + h * (steps + table.samples).ravel(), limit))

        def moving(function):
            """Values at the times, and both rates, shape (number of times, 3, ...)."""
            found = function(at)
            samples = found[len(times):].reshape(len(steps), len(table.samples), -1)
            out = np.empty((len(times), 3, found.shape[1]))
            out[:, 0] = found[:len(times)]
            for k, rates in enumerate(table.rates, 1):
                out[:, k] = (rates / h**k @ samples).reshape(len(times), -1)
            return out

        held = np.zeros((len(times) if moves else 1, 3, s.N))
        if moves:
            held[:, :, s.constraints.fixed] = moving(s.constraints.values_at)
        c, g = tables.still
        if drives and not tables.plain.joints.own:
            found = moving(tables.driven)
            c = found[:, :, :s.constraints.m].copy()
            if tables.turns:
                g = np.ascontiguousarray(found[:, [0, 0, 1, 2], s.constraints.m:])
        return Interval(h, 0, table.method.ahead, times, tables.factors(times), held,
                        JointMotions(c, g, drives))
