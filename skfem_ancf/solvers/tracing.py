"""Points of an equilibrium path, and the corrector of continuation."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.linalg import NO_FACTORS
from ..core.types import Array
from ..equations.evaluation import invert
from ..equations.stability import position_weights
from ..equations.system import System
from ..results.state import MaterialPoints, State
from .increment import rules_of
from .iteration import CLOSED

#: Relative motion of the nodes below which the load counts in the arc length.
STILL = 1e-3


class Failed(Exception):
    """A step did not converge."""


class Point(MaterialPoints):
    """An equilibrium of a path.

    ``displacement(point)`` and ``position(point)`` are as those of a State; ``state`` is one, with
    strain, stress, section forces and reactions. ``u`` (N,), ``multipliers`` (m,), ``load`` and
    ``force`` (N,) are its data; ``arc`` is the arc length from the start, ``error`` the last
    correction in the energy norm relative to the work done, ``iterations`` the linear systems
    solved. ``rate`` and ``tangent`` (N,) are derivatives of load and displacement by the arc
    length. ``negative`` is the number of negative eigenvalues of the tangent stiffness on the null
    space of J, None if loads have no potential.
    """

    def __init__(self, system: System, u: Array, multipliers: Array, load: float, force: Array,
                 arc: float, error: float, iterations: int) -> None:
        self.system, self.u, self.multipliers, self.load, self.force = (
            system, u, multipliers, load, force)
        self.arc, self.error, self.iterations = arc, error, iterations
        self.rate: Any = np.nan
        self.tangent: Any = None
        self.multiplier_rate: Any = None
        self.negative: Any = None
        #: What forces remember of the path before.
        self.history: Any = None

    @property
    def v(self) -> Array:  # type: ignore[override]
        return np.zeros_like(self.u)

    @property
    def state(self) -> State:
        return State(self.system, self.u, self.load, self.force, True, self.iterations,
                     "a point of a path", (), self.multipliers, memory=self.history)

    @property
    def stable(self) -> bool | None:
        return None if self.negative is None else self.negative == 0


class Tracer:
    """Corrector and tangent of the equilibrium path of a system."""

    def __init__(self, system: System, tol: float, max_iterations: int) -> None:
        self.system, self.rules = system, rules_of(system, "mixed", tol, max_iterations)
        weights = position_weights(system)
        self.weights = weights / (0.5 * weights.sum() * system.size**2)
        self.unit = system.constraints.values(1.0) - system.constraints.values(0.0)
        #: weight of the load in the arc length, if it hardly moves the nodes
        self.of_load: float = 0.0

    def norm(self, v: Array) -> float:
        """Mean nodal displacement over the size of the scene."""
        return np.sqrt(v @ (self.weights * v))

    def stress_free(self) -> Point:
        """The reference configuration as a point."""
        zero = np.zeros(self.system.N)
        return Point(self.system, zero, np.zeros(self.system.constraints.m), 0.0, zero, 0.0, 0.0, 0)

    def begin(self, point: Point) -> Point:
        """Set the tangent at the reference configuration, and the weight of the load in the arc
        length.

        Loads that move no node count with the strain that their forces could cause.
        """
        system = self.system
        forces = float(np.abs(system.external_force(point.u)) @ system.constraints.coordinate_sizes)
        self.of_load = forces / system.scales.energy_of_strains if forces > 0 else 0.0
        self.set_tangent(point)
        motion = self.norm(point.tangent)
        if motion > STILL * self.of_load * point.rate:
            self.of_load = 0.0
            point.rate, point.tangent = point.rate / motion, point.tangent / motion
            point.multiplier_rate = point.multiplier_rate / motion
        return point

    def _drive(self, external, u, load):
        """Derivatives of residual and constraints by the load."""
        system, phi = self.system, np.zeros(self.system.constraints.m)
        if system.constraints.drives:
            h = 1e-6 * max(1.0, abs(load))
            after, before = (system.constraints.constraint(u, load + x) for x in (h, -h))
            phi = (after - before) / (2.0 * h)
        if np.any(self.unit):
            du0 = np.zeros(system.N)
            du0[system.constraints.fixed] = self.unit
            external = external - system.solver.multiply(du0)
            if system.constraints.joints:
                phi = phi + system.constraints.full_jacobian(u, load) @ du0
        return external, -phi

    def factorize(self, point: Point) -> tuple[Array, Array]:
        """Factorise the tangent stiffness at a point and count its negative eigenvalues."""
        system = self.system
        system.assemble(point.u, point.load)
        drive = self._drive(system.external_force(point.u), point.u, point.load)
        try:
            system.solver.factorize(point.u, point.load, point.multipliers)
            if system.symmetric:
                point.negative = system.solver.inertia().negative
        except NO_FACTORS:
            raise Failed("the tangent is singular") from None
        return drive

    def set_tangent(self, point: Point, after: Point | None = None) -> Point:
        """Set the tangent of the path at a point."""
        drive, phi = self.factorize(point)
        dF, mF = self.system.solver.solve(drive, phi)
        dF[self.system.constraints.fixed] += self.unit
        size = np.hypot(self.norm(dF), self.of_load)
        if not size > 0 or not np.isfinite(size):
            raise Failed("the loads move nothing" if size == 0 else "the tangent is singular")
        if after is not None and (self.weights * dF) @ (point.u - after.u) + self.of_load**2 * (
                point.load - after.load) < 0:
            size = -size
        point.rate, point.tangent, point.multiplier_rate = 1.0 / size, dF / size, mF / size
        return point

    def advance(self, start: Point, ds: float) -> Point:
        """The next point at the distance ds."""
        first = ds * start.tangent, ds * start.multiplier_rate, ds * start.rate
        plane, normal = self.weights * start.tangent, self.of_load**2 * start.rate

        def increment(step, dl, dR, dF):  # the plane at distance ds
            return (ds - plane @ (step + dR) - normal * dl) / (plane @ dF + normal)

        return self._correct(start, first, increment, ds)

    def at_load(self, start: Point, load: float, guess: tuple[Array, Array]) -> Point:
        """The point at a load near another one; ``guess`` are increments (N,) and (m,)."""
        first = guess[0], guess[1], load - start.load
        return self._correct(start, first, lambda step, dl, dR, dF: 0.0, np.inf)

    def _small(self, residual, *forces):
        """True if a residual (N,) is within tolerance, as in statics; before K has factors."""
        e, rules, weights = self.system.backend.tables.plain, self.rules, self.system.K.diagonal()
        invert(weights, e.sizes)
        norms = np.sqrt([x * x @ weights for x in (residual * e.free, *forces)])
        return bool(norms[0] <= rules.tol * norms[1:].max() + rules.force_floor)

    def _correct(self, start, first, increment, ds):
        """Iterate from ``start`` and first increments of u, multipliers and load."""
        system, weights = self.system, self.weights
        u, m, load = start.u, start.multipliers, start.load
        _, stresses = system.assemble(u, load)
        du, dm, dl = first
        step, work, rules = np.zeros(system.N), np.inf, self.rules
        for k in range(1, rules.iterations + 1):
            independent = system.linearised_stress(u, stresses, du)
            u, m, load, step = u + du, m + dm, load + dl, step + du
            with np.errstate(over="ignore", invalid="ignore"):
                force, stresses = system.assemble(u, load, independent)
                external = system.external_force(u)
            if not np.all(np.isfinite(force)):
                raise Failed("the strain is not finite")
            residual, phi = load * external - force, system.constraints.constraint(u, load)
            if system.constraints.joints:
                residual = residual - m @ system.constraints.jacobian(u, load)
            closed = np.all(np.abs(phi) <= CLOSED * system.backend.tables.plain.joints.sizes)
            reference = np.sqrt(max(abs(force @ u), abs(load * (external @ u)),
                                    abs(external @ step * dl)))
            if closed and work <= rules.tol * reference + rules.floor and self._small(
                    residual, force, load * external):
                return Point(self.system, u, m, load, force, start.arc + ds,
                             work / reference if reference > 0 else 0.0, k)
            drive, gap = self._drive(external, u, load)
            try:
                system.solver.factorize(u, load, m)
                dR, mR = system.solver.solve(residual, -phi)
                dF, mF = system.solver.solve(drive, gap)
            except NO_FACTORS:
                raise Failed("the tangent is singular") from None
            dF[system.constraints.fixed] += self.unit
            dl = increment(step, load - start.load, dR, dF)
            du, dm = dR + dl * dF, mR + dl * mF
            if not np.all(np.isfinite(du)) or np.sqrt(du @ (weights * du)) > 10 * ds:
                raise Failed("the iteration leaves the path")
            work = np.sqrt(abs((residual * system.constraints.free) @ du) + abs(phi @ dm)
                           + abs(dl * (external @ du)))
        raise Failed(f"no convergence in {rules.iterations} iterations")
