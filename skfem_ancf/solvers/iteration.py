"""The equilibrium iteration: Newton's method and the mixed iteration."""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from ..actions.tables import (add_constraint_rate, add_joint_force, constraint, external_force)
from ..core.band import largest, multiply
from ..core.types import Array
from ..equations import evaluation
from ..equations.backend import Backend

#: Smallest stiffness of a DOF in norms, relative to the mean; DOFs of a rigid body have none.
SMALLEST = 1e-14
#: Approximate iterations to an equilibrium, by which work in NumPy is counted.
ITERATIONS = 8
#: How an iteration ends.
CONVERGED, SINGULAR, NOT_CONVERGED, NOT_FINITE = range(4)
#: Least number of corrections, unless the initial residual is round-off.
LEAST = 2
#: The largest relative residual of joints.
CLOSED = 1e-12
#: Root of the relative work of the third correction that indicates divergence.
DIVERGING = 0.9
#: The same of the second correction, for a very soft scene; first late correction, and its limit.
SOFT, LATE, LARGE = 10.0, 8, 3.0
#: Early end of an iteration: by the third correction, or by the second and late ones.
FIRST, WATCHED = 1, 2


class Target(NamedTuple):
    """The equilibrium to find."""

    factors: Array  # of the loads
    before: Array  # the same for the first tangent
    scale: float  # load factor of user-defined loads
    when: float  # time of loads; NaN for full size
    at: float  # time of joints
    c: Array  # tables of the joints at that time
    g: Array
    gap: Array  # residual that may remain, (N,)
    prescribed: Array  # required changes of the fixed DOFs


class Rules(NamedTuple):
    """Convergence criteria and options."""

    mixed: bool  # the geometric part uses independent stresses
    iterations: int  # largest number
    tol: float  # of a correction
    floor: float  # round-off of its work
    force_floor: float  # round-off of the residual
    wary: int  # early end: 0, FIRST or WATCHED


class Iterate:
    """A displacement with multipliers, and what the equations give there.

    ``force`` is the internal force, ``load`` the external force, ``opening`` the largest relative
    residual of the joints, ``weights`` (N,) the inverse diagonal of the tangent.
    """

    def __init__(self, backend: Backend, target: Target, u: Array, multipliers: Array) -> None:
        self.e, self.target = backend.tables.plain, target
        self.u, self.multipliers = u, multipliers
        self.force, self.load = np.empty_like(u), np.empty_like(u)
        self.phi, self.squares = np.zeros_like(multipliers), self.e.sizes**2
        self.stresses, self.independent = backend.tables.stresses, backend.tables.stresses
        self._tangent, self._force, self._linearised, self._hold_back = backend.leaves(
            evaluation.tangent, evaluation.force, evaluation.linearised, evaluation.hold_back,
            iterations=ITERATIONS)

    def evaluate_force(self) -> None:
        """Set the internal force."""
        self._force(self.u, self.target.at, self.force)

    def evaluate_tangent(self, du: Array | None, mixed: bool) -> None:
        """Set internal force, stresses, tangent and its inverse diagonal.

        ``du`` is the last correction, None at first. In the mixed iteration, the geometric part
        uses the last stresses, linearised along du.
        """
        target, e, u = self.target, self.e, self.u
        factors, t, mixed = target.factors, target.when, mixed and du is not None
        if du is None:
            factors, t = target.before, np.inf if np.isnan(t) else t
        if mixed:
            self._linearised(u - du, du, self.stresses, self.independent)
        self._tangent(u, factors, t, target.scale, target.at, mixed, self.stresses,
                      self.independent, self.force)
        scale = np.abs(e.K.flat[e.K.top::e.K.ld])
        least = SMALLEST * mean_stiffness(scale, self.squares)
        self.weights = 1.0 / (scale + least / self.squares)

    def residual(self) -> Array:
        """The residual at free DOFs; sets ``load``, ``phi`` and ``opening``."""
        e, target, u = self.e, self.target, self.u
        external_force(e.loads, target.factors, target.when, target.scale, u, self.load)
        self.opening, R = 0.0, self.load - self.force
        if self.phi.size:
            constraint(e.joints, target.c, target.g, target.at, u, self.phi)
            self.opening = largest(self.phi / e.joints.sizes)
            pull = np.zeros(len(u))
            add_joint_force(e.joints, target.g, target.at, u, self.multipliers, pull)
            R -= pull
        R -= target.gap
        R *= e.free
        return R

    def correction(self, R: Array, moving: bool, solver: Any) -> tuple[Array, Array, float]:
        """Corrections of u and the multipliers, and the root of their work; NaN on failure.

        If ``moving``, the fixed DOFs take their prescribed changes.
        """
        e, target, u = self.e, self.target, self.u
        du, phi, dm = np.empty(len(u)), self.phi, np.zeros(len(self.phi))
        if moving:  # R - K du of the fixed DOFs
            moved = np.zeros(len(u))
            moved[e.fixed] = target.prescribed
            multiply(e.K, moved, du)
            R = (R - du) * e.free
            if phi.size:
                add_constraint_rate(e.joints, target.g, target.at, u, moved, phi)
        if not solver.solve_into(target.at, u, self.multipliers, R, -phi, du, dm):
            return du, dm, np.nan
        work = sqrt(abs(np.dot(R, du)) + abs(np.dot(phi, dm)))
        if moving:
            du += moved
        elif e.forces.contacts.number:
            self._hold_back(target.at, u, R, du, dm)
        return du, dm, work


def equilibrium(backend: Backend, target: Target, rules: Rules, solver: Any, u: Array,
                multipliers: Array) -> tuple[int, Iterate, list[float], list[float]]:
    """Iterate to equilibrium from u and the multipliers.

    Parameters
    ----------
    backend
        The :class:`~skfem_ancf.equations.backend.Backend` of the equations.
    target, rules
        What to find, and how accurately.
    solver
        Its ``solve_into`` solves the linear systems, such as a
        :class:`~skfem_ancf.equations.linear_solver.LinearSolver`.
    u, multipliers
        The start, (N,) and (m,); not changed.

    Returns
    -------
    status
        How it ended.
    x
        The last iterate.
    residuals, works
        Relative residuals, and roots of the relative works of the corrections.
    """
    x = Iterate(backend, target, u.copy(), multipliers.copy())
    work = before = reference = np.inf
    quiet, moving, du = False, bool(target.prescribed.any()), None
    residuals: list[float] = []
    works: list[float] = []
    for k in range(rules.iterations + 1):
        # the last residual needs no tangent
        part = min(1.0, work / before) if k > 1 and before > 0.0 else 1.0
        last = (k >= LEAST or (k > 0 and quiet)) and settled(work * part, reference, rules)
        if last:
            x.evaluate_force()
        else:
            x.evaluate_tangent(du, rules.mixed)
        R = x.residual()
        rho, size = norm(R, x.weights), max(norm(x.force, x.weights), norm(x.load, x.weights))
        if not rho < 1e300:
            return NOT_FINITE, x, residuals, works
        residuals.append(rho / size if size > 0.0 else 0.0)
        if k == 0:
            small = rho <= 1e-3 * rules.tol * size
            # round-off, unless the correction shows that it is the load of a slender beam
            quiet = rho <= rules.force_floor
        else:
            small = last and rho <= rules.tol * size + rules.force_floor
        if small and not moving and x.opening <= CLOSED:
            return CONVERGED, x, residuals, works
        if k == rules.iterations:
            break
        if last:
            x.evaluate_tangent(du, rules.mixed)
        before = work
        du, dm, work = x.correction(R, moving, solver)
        if not work < 1e300:
            return SINGULAR, x, residuals, works
        moving = False
        x.u += du
        x.multipliers += dm
        reference = reference_work(x.force, x.load, x.u)
        works.append(work / reference if reference > 0.0 else 0.0)
        if _diverging(rules.wary, k, works[-1]):
            break
    return NOT_CONVERGED, x, residuals, works


def _diverging(wary, k, work):
    """True if correction k indicates that the iteration will not converge."""
    if wary == FIRST:
        return k == 2 and work > DIVERGING
    return wary == WATCHED and ((k == 1 and work > SOFT) or (k >= LATE and work > LARGE))


def norm(x: Array, weights: Array) -> float:
    """Root of the weighted sum of squares."""
    return sqrt(np.dot(x * x, weights))


def reference_work(force: Array, load: Array, u: Array) -> float:
    """Root of the work of the forces, to which corrections are compared."""
    return sqrt(max(abs(np.dot(force, u)), abs(np.dot(load, u))))


def settled(work: float, reference: float, rules: Any) -> bool:
    """True if the root of a correction's work is within tolerance or round-off."""
    return work <= rules.tol * reference + rules.floor


def mean_stiffness(diagonal: Array, squares: Array) -> float:
    """Mean of the stiffnesses, scaled by the squared sizes of the DOFs; 1 if it is zero."""
    return float(np.dot(squares, diagonal)) / squares.size or 1.0
