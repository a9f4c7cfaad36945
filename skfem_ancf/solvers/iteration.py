"""The equilibrium iteration: Newton's method and the mixed iteration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..actions.forces.kernels import (add_elastic_force, add_element_tangent, contact_along,
                                      contact_work)
from ..actions.tables import (add_constraint_rate, add_joint_force, add_load_stiffness, constraint,
                              external_force)
from ..beam.strain_energy import body_force, body_linearised, body_tangent
from ..core.band import (clear, copy, diagonal, dot, factorize, fix, largest, multiply, solve,
                         weighted)
from ..core.callbacks import call_solver
from ..core.source import F1, indices, source
from ..equations.tables import Equations

#: Smallest stiffness of a DOF in norms, relative to the mean; DOFs of a rigid body have none.
SMALLEST = 1e-14
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

    factors: F1  # of the loads
    before: F1  # the same for the first tangent
    scale: float  # load factor of user-defined loads
    when: float  # time of loads; NaN for full size
    at: float  # time of joints
    c: F1  # tables of the joints at that time
    g: F1
    gap: F1  # residual that may remain, (N,)
    prescribed: F1  # required changes of the fixed DOFs


class Rules(NamedTuple):
    """Convergence criteria and options."""

    mixed: int  # 1 if the geometric part uses independent stresses
    iterations: int  # largest number
    tol: float  # of a correction
    floor: float  # round-off of its work
    force_floor: float  # round-off of the residual
    solver: int  # handle of a linear solver; 0 for the band
    wary: int  # early end: 0, FIRST or WATCHED


class Unknowns(NamedTuple):
    """Displacement, multipliers, internal force, stresses and independent stresses."""

    u: F1
    multipliers: F1
    force: F1
    stresses: F1
    independent: F1


class Work(NamedTuple):
    """Work arrays: residual, correction, displacement before it, 1 / diagonal, loads, joint force,
    constraint residual and multiplier correction.
    """

    R: F1
    du: F1
    before: F1
    scale: F1
    load: F1
    push: F1
    phi: F1
    dm: F1


def workspace_for_iterations(e: Equations, m: int) -> Work:
    """The :class:`Work` of a scene with m multipliers."""
    N = e.free.size
    R, du, before, scale, load, push = np.empty((6, N))
    return Work(R, du, before, scale, load, push, np.zeros(m), np.zeros(m))


@source
def equilibrium(e, target, rules, x, w, record):
    """Iterate to equilibrium from x, in place; returns how it ended, and the linear systems solved.

    ``record`` (iterations + 1, 2) takes the residuals of each iteration.
    """
    N, m = x.u.size, x.multipliers.size
    clear(w.dm)
    work = before = reference = np.inf
    quiet, moving = False, dot(target.prescribed, target.prescribed) > 0.0
    for k in range(rules.iterations + 1):
        # the last residual needs no tangent
        part = min(1.0, work / before) if k > 1 else 1.0
        last = (k >= LEAST or (k > 0 and quiet)) and settled(work * part, reference, rules)
        if last:
            body_force(e.body, x.u, x.force)
            add_elastic_force(e.forces, target.at, 0.0, x.u, x.u, x.force)
        else:
            _tangent(e, target, rules, x, w, k)
        opening = _residual(e, target, x, w)
        rho = np.sqrt(weighted(w.R, w.R, w.scale))
        size = np.sqrt(max(weighted(x.force, x.force, w.scale), weighted(w.load, w.load, w.scale)))
        if not rho < 1e300:
            return NOT_FINITE, k
        record[k, 0] = rho / size if size > 0.0 else 0.0
        if k == 0:
            small = rho <= 1e-3 * rules.tol * size
            # round-off, unless the correction shows that it is the load of a slender beam
            quiet = rho <= rules.force_floor
        else:
            small = last and rho <= rules.tol * size + rules.force_floor
        if small and not moving and opening <= CLOSED:
            return CONVERGED, k
        if k == rules.iterations:
            break
        if last:
            _tangent(e, target, rules, x, w, k)
        before, work = work, _correction(e, target, rules, x, w, moving)
        if not (0.0 <= work < 1e300):
            return SINGULAR, k
        if e.forces.contacts.number > 0 and not moving:
            _hold_back(e, target.at, x, w)
        moving = False
        copy(x.u, w.before)
        for i in indices(N):
            x.u[i] += w.du[i]
        for i in indices(m):
            x.multipliers[i] += w.dm[i]
        reference = reference_work(x.force, w.load, x.u)
        record[k, 1] = work / reference if reference > 0.0 else 0.0
        if rules.wary > 0 and _diverging(rules.wary, k, record[k, 1]):
            return NOT_CONVERGED, k + 1
    return NOT_CONVERGED, rules.iterations


@source
def _diverging(wary, k, work):
    """True if correction k indicates that the iteration will not converge."""
    if wary == FIRST:
        return k == 2 and work > DIVERGING
    return (k == 1 and work > SOFT) or (k >= LATE and work > LARGE)


@source
def reference_work(force, load, u):
    """Root of the work of the forces, to which corrections are compared."""
    return np.sqrt(max(abs(dot(force, u)), abs(dot(load, u))))


@source
def settled(work, reference, rules):
    """True if the root of a correction's work is within tolerance or round-off."""
    return work <= rules.tol * reference + rules.floor


@source
def mean_stiffness(diagonal, sizes):
    """Mean of the scaled stiffnesses; 1 if it is zero."""
    mean = weighted(sizes, sizes, diagonal) / sizes.size
    return mean if mean > 0.0 else 1.0


@source
def _tangent(e, target, rules, x, w, k):
    """Internal force, tangent, and 1 / diagonal."""
    mixed = rules.mixed > 0 and k > 0
    if mixed:
        body_linearised(e.body, w.before, w.du, x.stresses, x.independent)
    body_tangent(e.body, x.u, x.force, x.independent, mixed, x.stresses, e.K)
    add_elastic_force(e.forces, target.at, 0.0, x.u, x.u, x.force)
    factors, t = (target.factors, target.when) if k > 0 else (
        target.before, np.inf if np.isnan(target.when) else target.when)
    add_load_stiffness(e.loads, factors, t, target.scale, x.u, e.K)
    add_element_tangent(e.forces, target.at, x.u, e.K)
    diagonal(e.K, w.scale)
    for i in indices(x.u.size):
        w.scale[i] = np.abs(w.scale[i])
    least = SMALLEST * mean_stiffness(w.scale, e.sizes)
    for i in indices(x.u.size):
        w.scale[i] = 1.0 / (w.scale[i] + least / (e.sizes[i] * e.sizes[i]))


@source
def _residual(e, target, x, w):
    """The residual at free DOFs; returns the largest relative residual of joints."""
    external_force(e.loads, target.factors, target.when, target.scale, x.u, w.load)
    clear(w.push)
    opening = 0.0
    if w.phi.size > 0:
        constraint(e.joints, target.c, target.g, target.at, x.u, w.phi)
        add_joint_force(e.joints, target.g, target.at, x.u, x.multipliers, w.push)
        for k in indices(w.phi.size):
            w.dm[k] = w.phi[k] / e.joints.sizes[k]
        opening = largest(w.dm)
    for i in indices(x.u.size):
        w.R[i] = (w.load[i] - x.force[i] - target.gap[i] - w.push[i]) * e.free[i]
    return opening


@source
def _correction(e, target, rules, x, w, moving):
    """The correction; returns the root of its work, negative on failure."""
    N, m = x.u.size, w.phi.size
    clear(w.push)
    if moving:  # R = R - K du of the fixed coordinates
        for k in indices(e.fixed.size):
            w.push[e.fixed[k]] = target.prescribed[k]
        multiply(e.K, w.push, w.du)
        for i in indices(N):
            w.R[i] = (w.R[i] - w.du[i]) * e.free[i]
        if m > 0:
            add_constraint_rate(e.joints, target.g, target.at, x.u, w.push, w.phi)
    for k in indices(m):
        w.phi[k] = -w.phi[k]
    fix(e.K, e.fixed)
    if not _solved(e, target, rules, x, w):
        return -1.0
    work = np.sqrt(abs(dot(w.R, w.du)) + abs(dot(w.phi, w.dm)))
    for i in indices(N):
        w.du[i] += w.push[i]
    return work


#: Line search with contact: accepted relative residual along the correction; largest number of
#: trials; largest number of intervals.
LEFT, TRIES, PARTS = 0.5, 12, 16


@source
def _hold_back(e, t, x, w):
    """Line search for a correction that runs into obstacles.

    The residual along the correction, of the equations linearised without contact plus the actual
    contact forces, has to be small, see Crisfield (1991), 9.2. Otherwise contacts open and close in
    turn.
    """
    N, work, two = x.u.size, dot(w.R, w.du), np.empty(2)
    there, scratch = np.empty(N), np.zeros(N)
    contact_along(e.forces, t, x.u, w.du, two)
    if not work > 0.0:
        return
    parts = int(min(max(np.ceil(two[1]), 1.0), PARTS))
    before, low, high = contact_work(e.forces, t, x.u, w.du, scratch), 0.0, 1.0
    left, left_low = work, work
    for k in range(parts):
        high = (k + 1.0) / parts
        left = _left(e, t, x, w, high, work, two[0], before, there, scratch)
        if left < -LEFT * work:
            break
        low, left_low = high, left
    if left >= -LEFT * work:
        return
    s = high
    for k in range(TRIES):
        s = 0.5 * (low + high) if left_low <= 0.0 or k > 2 else max(
            low + 0.1 * (high - low), low + (high - low) * left_low / (left_low - left))
        now = _left(e, t, x, w, s, work, two[0], before, there, scratch)
        if abs(now) <= LEFT * work:
            break
        if now > 0.0:
            low, left_low = s, now
        else:
            high, left = s, now
    for i in indices(N):
        w.du[i] *= s
    for k in indices(w.dm.size):
        w.dm[k] *= s


@source
def _left(e, t, x, w, s, work, along, before, there, scratch):
    """Residual along the correction at a fraction s of it."""
    for i in indices(there.size):
        there[i] = x.u[i] + s * w.du[i]
    now = contact_work(e.forces, t, there, w.du, scratch)
    return (1.0 - s) * work - (now - before - s * along)


@source
def _solved(e, target, rules, x, w):
    """Solve for the correction; False if the matrix is singular."""
    if rules.solver > 0:
        return call_solver(rules.solver, target.at, x.u, x.multipliers, w.R, w.phi, w.du, w.dm)
    copy(w.R, w.du)
    if not factorize(e.K):
        return False
    solve(e.K, w.du)
    return True
