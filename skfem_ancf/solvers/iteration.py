"""The iteration to equilibrium: Newton's method, mixed or not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..actions.forces.kernels import (add_elastic_force, add_element_tangent, contact_along,
                                      contact_work)
from ..actions.tables import (add_constraint_rate, add_joint_force, add_load_stiffness, constraint,
                              external_force)
from ..beam.strain_energy import body_carry, body_force, body_tangent
from ..core.band import (clear, copy, diagonal, dot, factorize, fix, largest, multiply, solve,
                         weighted)
from ..core.callbacks import own_solve
from ..core.source import F1, indices, source
from ..equations.tables import Equations

#: Stiffness that a coordinate is taken to have in norms at least, over the mean of all, each times
#: the square of its size: that of a rigid body has none of its own.
SMALLEST = 1e-14
#: How an iteration ends.
CONVERGED, SINGULAR, NOT_CONVERGED, NOT_FINITE = range(4)
#: Corrections at least, where the residual at the start is not round-off.
LEAST = 2
#: The largest residual of joints, over the sizes of their equations.
CLOSED = 1e-12
#: Work of the third correction, as a root over that of all forces, of an iteration that diverges.
DIVERGING = 0.9
#: The same of the second, of a scene so soft that the first was far too large; and of one after
#: the eighth, of an iteration that is not seen to converge.
SOFT, LATE, LARGE = 10.0, 8, 3.0
#: What ends an iteration early: the third correction, or the second and those after the eighth.
FIRST, WATCHED = 1, 2


class Target(NamedTuple):
    """The equilibrium asked for.

    ``factors``, ``before`` and ``scale`` are those of the tables of loads, the same for the first
    tangent, and of user-defined loads; ``when`` the time of loads, NaN for full size; ``at, c, g``
    the time of the joints and their tables; ``gap`` the force that may be missing, (N,);
    ``prescribed`` by how much fixed DOFs have to change.
    """

    factors: F1
    before: F1
    scale: float
    when: float
    at: float
    c: F1
    g: F1
    gap: F1
    prescribed: F1


class Rules(NamedTuple):
    """When it has converged, in so many ``iterations`` at most.

    ``mixed`` is 1 if the geometric part takes independent stresses; ``tol`` the tolerance of a
    correction, ``floor`` and ``force_floor`` the round-off of its work and of the residual;
    ``solver`` the handle of what solves the linear systems, 0 for the band alone; ``wary`` when it
    ends because corrections do not get smaller: 0 never, :data:`FIRST` or :data:`WATCHED`.
    """

    mixed: int
    iterations: int
    tol: float
    floor: float
    force_floor: float
    solver: int
    wary: int


class Unknowns(NamedTuple):
    """What is found: displacement, multipliers, internal force, stresses and independent ones."""

    u: F1
    multipliers: F1
    force: F1
    stresses: F1
    carried: F1


class Work(NamedTuple):
    """Work arrays: residual, correction, displacement before it, 1 / diagonal, loads, joints'
    opening and correction.
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
    """Iterate to equilibrium from x, in place; returns how it ends, and the linear systems solved.

    ``record`` takes the residuals of each iteration, shape (iterations + 1, 2).
    """
    N, m = x.u.size, x.multipliers.size
    clear(w.dm)
    work = before = reference = np.inf
    quiet, moving = False, dot(target.prescribed, target.prescribed) > 0.0
    for k in range(rules.iterations + 1):
        # after the last correction only the residual is wanted, not the tangent
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
            # no more than round-off: of a slender beam that may be a load, the correction tells
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
    """True if correction k says that an iteration will not converge."""
    if wary == FIRST:
        return k == 2 and work > DIVERGING
    return (k == 1 and work > SOFT) or (k >= LATE and work > LARGE)


@source
def reference_work(force, load, u):
    """The root of the work that corrections are compared with: that of the forces on the way."""
    return np.sqrt(max(abs(dot(force, u)), abs(dot(load, u))))


@source
def settled(work, reference, rules):
    """True if a correction's work, as a root, is as small as is asked, or round-off."""
    return work <= rules.tol * reference + rules.floor


@source
def mean_stiffness(diagonal, sizes):
    """The mean of stiffnesses, each times the square of its coordinate's size; 1 of none."""
    mean = weighted(sizes, sizes, diagonal) / sizes.size
    return mean if mean > 0.0 else 1.0


@source
def _tangent(e, target, rules, x, w, k):
    """The internal force, the tangent, and 1 / its diagonal."""
    mixed = rules.mixed > 0 and k > 0
    if mixed:
        body_carry(e.body, w.before, w.du, x.stresses, x.carried)
    body_tangent(e.body, x.u, x.force, x.carried, mixed, x.stresses, e.K)
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
    """The residual at free coordinates; returns how far joints are open, over their sizes."""
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
    """The correction into w; returns the root of its work, negative if there is none."""
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


#: Part of the work that a correction leaves along its direction, up to which it is taken; of the
#: work tried, and how often; parts of a correction that are looked at for obstacles on the way.
LEFT, TRIES, PARTS = 0.5, 12, 16


@source
def _hold_back(e, t, x, w):
    """Shorten a correction that runs into obstacles.

    Of the equations linearised without contact, and contact as it is, what is left along the
    correction has to be small, see Crisfield (1991), 9.2: without that points come and go.
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
    """What is left along the correction at a part s of it."""
    for i in indices(there.size):
        there[i] = x.u[i] + s * w.du[i]
    now = contact_work(e.forces, t, there, w.du, scratch)
    return (1.0 - s) * work - (now - before - s * along)


@source
def _solved(e, target, rules, x, w):
    """Solve for the correction; False if the matrix is singular."""
    if rules.solver > 0:
        return own_solve(rules.solver, target.at, x.u, x.multipliers, w.R, w.phi, w.du, w.dm)
    copy(w.R, w.du)
    if not factorize(e.K):
        return False
    solve(e.K, w.du)
    return True
