"""Collocation: implicit Runge-Kutta methods of high order."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander
from scipy.linalg import lapack

from ..errors import InputError
from ..linalg import dense
from .base import Motion, Scheme
from .dampers import add_damping
from .integrator import StepFailed
from .steps import (DONE, FAILED, FAILURE, FAILURES, FRESH, ITERATIONS, LAST_SIZE, NOT_CONVERGED,
                    RATE, READY, SIZE, STATE, judge)

if TYPE_CHECKING:
    from ..system import System
    from ..types import Array
    from .integrator import Integrator

#: Contraction up to which factors are kept.
REUSED = 0.3
#: Instants of a step at which supports are asked that move.
SAMPLES = 9
#: Corrections that close joints at the end of a step.
CLOSINGS = 2


class _Tableau:
    """The numbers of a method of collocation.

    Parameters
    ----------
    points
        c, shape (n,).

    Attributes
    ----------
    weights
        b, shape (n,).
    first, second
        A^-1 and its square.
    values, to, back
        Eigenvalues mu of A^-1, one of each pair; rows of T^-1 for them; columns of T, those of
        pairs twice.
    fit
        Of a polynomial without its first two terms, from its values at c.
    samples, rates
        Points in a step, (k,), and what makes both rates at c of values there, (2, n, k).
    """

    def __init__(self, points: Array) -> None:
        c, n = points, len(points)
        self.points = c
        k = np.arange(1, n + 1)
        inverse = np.linalg.inv(np.vander(c, increasing=True))
        A, self.weights = (c[:, None]**k / k) @ inverse, (1.0 / k) @ inverse
        self.first = np.linalg.inv(A)
        self.second = self.first @ self.first
        values, T = np.linalg.eig(self.first)
        picked = np.nonzero(values.imag > -1e-12 * abs(values))[0]
        pair = values.imag[picked] > 1e-12 * abs(values[picked])
        self.values = [complex(x) if two else float(x.real)
                       for x, two in zip(values[picked], pair)]
        self.to = np.linalg.inv(T)[picked]
        self.back = T[:, picked] * np.where(pair, 2.0, 1.0)
        self.fit = np.linalg.inv(c[:, None]**(k + 1))
        self.samples = 0.5 - 0.5 * np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))
        fit = np.linalg.inv(chebvander(2.0 * self.samples - 1.0, SAMPLES - 1))
        self.rates = np.array([2.0**k * chebval(2.0 * c - 1.0, chebder(
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

    def step(self, integrator: Integrator, y: Motion, dt: float) -> Motion:
        stages = _Stages(self, integrator, y, dt)
        U, V, W = stages.solve(self._guess(y, dt))
        s, t, work, table = integrator.system, y.t + dt, 0.0, self._table
        u, v = y.u + dt * (table.weights @ V), y.v + dt * (table.weights @ W)
        if table.points[-1] == 1.0:
            u, v = U[-1], V[-1]
        if s.damped:
            work = dt * sum(b * (s.damping_force(p, q, at) @ q) for b, p, q, at in zip(
                table.weights, U, V, stages.times))
        new = integrator.start(self._closed(s, u, t), v, t, dt, ahead=False)
        new.before, new.dissipated = dt, y.dissipated + work
        new.memory = {"stages": U - new.u, "start": y.u - new.u, "way": dt * y.v,
                      "dt": np.array(dt), "forces": stages.multipliers}
        return new

    @staticmethod
    def _closed(system, u, t):
        """The nearest displacement with closed joints, in the norm of the mass."""
        for _ in range(CLOSINGS if system.joints else 0):
            u = u.copy()
            u[system.fixed] = system.values(1.0, t)
            u = u + system.solve_mass(np.zeros(system.N), u, t, -system.constraint(u, t))[0]
        return u

    def _guess(self, y, dt):
        """Z by the polynomial of the step before, or by the acceleration."""
        c, old = self._table.points[:, None], y.memory
        if not old:
            return 0.5 * (dt * c)**2 * y.acceleration
        fit = self._table.fit @ (old["stages"] - old["start"] - c * old["way"])
        x = 1.0 + dt / float(old["dt"]) * c
        return (x**np.arange(2, len(c) + 2) @ fit + old["start"] + x * old["way"]
                - dt * c * y.v)


class _Stages:
    """The equations of the points of one step."""

    def __init__(self, scheme, integrator, y, dt):
        self.table, self.integrator, self.y, self.dt = scheme._table, integrator, y, dt
        s, c = integrator.system, self.table.points
        self.times = np.minimum(y.t + dt * c, integrator.limit)  # before what jumps at the end
        self.system, self.multipliers = s, np.tile(y.multipliers, (len(c), 1))
        if y.memory:
            self.multipliers = y.memory["forces"].copy()
        if s.moves:
            at = np.minimum(y.t + dt * self.table.samples, integrator.limit)
            rates = self.table.rates @ s.values_at(at)
            self._held = np.array([s.values(1.0, t) for t in self.times]), rates[0] / dt, (
                rates[1] / dt**2)

    def states(self, Z):
        """Displacements, velocities and accelerations at the points."""
        c, h, y, s = self.table.points[:, None], self.dt, self.y, self.system
        U, V, W = y.u + h * c * y.v + Z, y.v + self.table.first @ Z / h, (
            self.table.second @ Z / h**2)
        if s.moves:
            U[:, s.fixed], V[:, s.fixed], W[:, s.fixed] = self._held
        return U, V, W

    def residual(self, u, v, w, t, multipliers):
        """What is missing in the equation of motion at a point."""
        s = self.system
        out = s.external_force(u, t) - s.internal_force(u, t) - s.mass.multiply(w)
        if s.damped:
            out -= s.damping_force(u, v, t)
        if s.joints:
            out -= multipliers @ s.full_jacobian(u, t)
        return out * s.free

    def solve(self, Z):
        """Simplified Newton iteration."""
        i, h, joints, state = self.integrator, self.dt, self.system.joints, np.zeros(STATE)
        rough = i.rough(self.y.u, max(abs(x) for x in self.table.values)**2 / h**2)
        wanted = i.tol * np.sqrt(i.energy) + rough
        state[READY], state[RATE], state[SIZE] = i.kept.get("dt") == h, REUSED, -1.0
        for _ in range(ITERATIONS):
            if not state[READY]:
                self._factorize()
                state[READY], state[FRESH], state[SIZE] = 1.0, 1.0, -1.0
            U, V, W = self.states(Z)
            R = np.array([self.residual(*x) for x in zip(U, V, W, self.times, self.multipliers)])
            gaps = np.zeros(self.multipliers.shape)
            if joints:
                gaps = np.array([i.constraint_rate(u, v, t, h, False)
                                 for u, v, t in zip(U, V, self.times)])
            dZ, forces = self._correction(R, gaps)
            i.tally(len(R), 0)
            work = abs(np.sum(dZ * R))
            if joints:  # what closes them needs no residual
                work += np.sum(np.abs(dZ @ i.kept["J"].T * forces))
            state[LAST_SIZE], state[SIZE] = state[SIZE], np.sqrt(work)
            Z, self.multipliers = Z + dZ, self.multipliers + forces
            told = judge(state, wanted, rough, REUSED)
            if told == DONE:
                return self.states(Z)
            if told == FAILED:
                raise StepFailed(FAILURES[int(state[FAILURE])])
        raise StepFailed(FAILURES[NOT_CONVERGED])

    def _factorize(self):
        """Factors of the iteration matrix at the start of the step."""
        i, s, h, y = self.integrator, self.system, self.dt, self.y
        s.assemble(y.u, t=y.t)
        K, M, D = s.K.general(), s.mass.general().band.flat, 0.0
        if s.damped:
            band, tables = s.new_band(), s.machine.tables
            add_damping(tables.plain.viscous, i.matrices.dampers, s.mass.band, 1.0, y.u,
                        np.zeros((3, len(tables.stresses))), np.zeros(s.N), band.band)
            D = band.general().band.flat
        everywhere, diagonal = K.fixed_positions(s.fixed)
        i.kept = {"dt": np.array(h)}
        if s.joints:
            i.kept["J"] = np.ascontiguousarray(dense(s.jacobian(y.u, y.t)))
        for k, x in enumerate(self.table.values):
            flat = K.band.flat + x / h * D + (x / h)**2 * M
            flat[everywhere], flat[diagonal] = 0.0, 1.0
            trf = lapack.zgbtrf if isinstance(x, complex) else lapack.dgbtrf
            lu, pivots, info = trf(flat.reshape(s.N, -1).T, K.bandwidth, K.bandwidth)
            if info != 0:
                raise np.linalg.LinAlgError("the iteration matrix is singular")
            i.kept[f"lu {k}"], i.kept[f"pivots {k}"] = lu, pivots
            if s.joints:
                i.kept[f"Y {k}"] = np.ascontiguousarray(self._solve(k, i.kept["J"].T + 0.0))
        i.tally(0, len(self.table.values))

    def _correction(self, R, gaps):
        """What the iteration matrix makes of residuals (points, N) and of rates of joints."""
        kept, table, s = self.integrator.kept, self.table, self.system
        b, r, out = table.to @ R, table.to @ gaps, np.zeros(R.shape)
        forces = np.zeros(gaps.shape)
        for k, x in enumerate(table.values):
            y = self._solve(k, b[k])
            if s.joints:  # x / h J y = -r
                J, Y = kept["J"], kept[f"Y {k}"]
                push = np.linalg.solve(J @ Y, J @ y + self.dt / x * r[k])
                y = y - Y @ push
                forces += np.outer(table.back[:, k], push).real
            out += np.outer(table.back[:, k], y).real
        return out, forces

    def _solve(self, k, b):
        kept, width = self.integrator.kept, self.system.bandwidth
        trs, b = (lapack.zgbtrs, b) if isinstance(self.table.values[k], complex) else (
            lapack.dgbtrs, b.real)
        return trs(kept[f"lu {k}"], width, width, b, kept[f"pivots {k}"])[0]
