"""The equilibrium iteration: Newton's method and the mixed iteration."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..actions.tables import add_constraint_rate
from ..core.band import multiply
from ..core.types import Array
from ..equations import evaluation
from ..equations.backend import Backend
from ..equations.evaluation import ROWS, Target, U

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


class Rules(NamedTuple):
    """Convergence criteria and options."""

    mixed: bool  # the geometric part uses independent stresses
    iterations: int  # largest number
    tol: float  # of a correction
    floor: float  # round-off of its work
    force_floor: float  # round-off of the residual
    wary: int  # early end: 0, FIRST or WATCHED


class Iterate(NamedTuple):
    """The end of an iteration."""

    status: int
    u: Array  # (N,)
    multipliers: Array  # (m,)
    force: Array  # the internal force, (N,)
    residuals: list[float]  # relative residuals
    works: list[float]  # roots of the relative works of the corrections


def equilibrium(backend: Backend, target: Target, rules: Rules, solver: Any, u: Array,
                multipliers: Array) -> Iterate:
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
    """
    e, at, out = backend.tables.plain, target.at, np.empty(3)
    evaluate, hold_back = backend.leaves(evaluation.balance, evaluation.hold_back,
                                         iterations=ITERATIONS)
    x, m = np.zeros((ROWS, len(u))), np.zeros((2, len(multipliers)))
    stresses, dm = np.zeros((2, backend.tables.stresses.size)), np.empty(len(multipliers))
    x[U], m[0] = u, multipliers
    u, du, force, load, R, _ = x
    multipliers, phi = m
    residuals: list[float] = []
    works: list[float] = []
    quiet, moving = False, bool(np.logical_or.reduce(target.prescribed))
    work = before = reference = np.inf
    status = NOT_CONVERGED
    for k in range(rules.iterations + 1):
        # the last residual needs no tangent
        part = work / before if k > 1 and 0.0 < work < before else 1.0
        last = (k >= LEAST or (k > 0 and quiet)) and (
            work * part <= rules.tol * reference + rules.floor)
        evaluate(target, k == 0, last, rules.mixed and k > 0, x, m, stresses, out)
        rho, size, opening = out.tolist()
        if not rho < 1e300:
            status = NOT_FINITE
            break
        residuals.append(rho / size if size > 0.0 else 0.0)
        if k == 0:
            small = rho <= 1e-3 * rules.tol * size
            # round-off, unless the correction shows that it is the load of a slender beam
            quiet = rho <= rules.force_floor
        else:
            small = last and rho <= rules.tol * size + rules.force_floor
        if small and not moving and opening <= CLOSED:
            status = CONVERGED
            break
        if k == rules.iterations:
            break
        if last:
            evaluate(target, False, False, rules.mixed, x, m, stresses, out)
        if moving:
            moved = _move(e, target, u, R, phi)
        before, work = work, np.inf
        if solver.solve_into(at, u, multipliers, R, -phi, du, dm):
            work = float(abs(R @ du) + abs(phi @ dm) if phi.size else abs(R @ du)) ** 0.5
        if not work < 1e300:
            status = SINGULAR
            break
        if moving:
            du += moved
        elif e.forces.contacts.number:
            hold_back(at, u, R, du, dm)
        moving = False
        u += du
        multipliers += dm
        reference = float(max(abs(force @ u), abs(load @ u))) ** 0.5
        works.append(work / reference if reference > 0.0 else 0.0)
        if rules.wary and _diverging(rules.wary, k, works[-1]):
            break
    return Iterate(status, u.copy(), multipliers.copy(), force.copy(), residuals, works)


def _diverging(wary, k, work):
    """True if correction k indicates that the iteration will not converge."""
    if wary == FIRST:
        return k == 2 and work > DIVERGING
    return (k == 1 and work > SOFT) or (k >= LATE and work > LARGE)


def _move(e, target, u, R, phi):
    """The prescribed changes of the fixed DOFs (N,), of which residuals take account."""
    moved, force = np.zeros(len(u)), np.empty(len(u))
    moved[e.fixed] = target.prescribed
    multiply(e.K, moved, force)
    R -= force * e.free
    add_constraint_rate(e.joints, target.g, target.at, u, moved, phi)
    return moved
