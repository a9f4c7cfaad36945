"""Evaluations of the equations of a scene, which run in NumPy or compiled."""

from typing import Annotated, NamedTuple

import numpy as np

from ..actions.forces.kernels import (NO_SPAN, add_elastic_force, add_element_tangent,
                                      contact_along, contact_work, looked_free, rests,
                                      way_is_clear)
from ..actions.tables import (MATERIALS, add_joint_force, add_load_stiffness, carry_eigenstrains,
                              constraint, external_force)
from ..beam.strain_energy import (add_viscous_force, body_force, body_linearised, body_mean,
                                  body_stress, body_tangent)
from ..core.band import add_multiple, add_to_diagonal, diagonal, dot, largest, weighted_square
from ..core import F1, F2, MADE, apart, indices, source
from .tables import Equations


@apart("statics", Equations, F1, float, F1)
def force(e, u, at, f):
    """Set the internal force f at u; ``at`` is the time, or the load factor in statics."""
    body_force(e.body, u, f)
    add_elastic_force(e.forces, at, 0.0, u, u, 0, f)


@source
def mean_force(e, u0, u1, at, f):
    """Set the mean of the internal force, with exact work from u0 to u1."""
    body_mean(e.body, u0, u1, f)
    add_elastic_force(e.forces, at, NO_SPAN, u0, u1, 0, f)


@source
def viscous_force(e, u, v, f):
    """Add the viscous force of the materials at the velocity v."""
    add_viscous_force(e.viscous, u, v, f)


@apart("statics", Equations, F1, F1, float, float, float, bool, F1, F1, F1)
def tangent(e, u, factors, t, scale, at, use_independent, stresses, independent, f):
    """Set internal force, stresses, and the tangent of the residual, in ``e.K``."""
    # The geometric part uses the independent stresses if ``use_independent``. ``factors``, ``t``
    # and ``scale`` are as for :func:`~skfem_ancf.actions.tables.external_force`.
    body_tangent(e.body, u, f, independent, use_independent, stresses, e.K)
    add_elastic_force(e.forces, at, 0.0, u, u, 0, f)
    add_load_stiffness(e.loads, factors, t, scale, u, e.K)
    add_element_tangent(e.forces, at, u, e.K)


@source
def linearised(e, u, du, stresses, independent):
    """Set the independent stresses: stresses at u plus their linearised change by du."""
    body_linearised(e.body, u, du, stresses, independent)


class Target(NamedTuple):
    """The static equilibrium to find."""

    scale: float  # load factor of user-defined loads
    when: float  # time of loads; NaN for full size
    at: float  # time of joints
    moving: bool  # fixed DOFs have to move
    solver: int  # handle of the linear solver
    definite: bool  # compiled code may solve by itself, as long as the tangent is definite


#: Rows of the vectors of a static iteration: displacement and its last correction, internal and
#: external force, residual, inverse diagonal of the tangent; residual that may remain, prescribed
#: changes of the fixed DOFs, and drag: a force on each DOF per displacement.
U, DU, FORCE, LOAD, RESIDUAL, WEIGHTS, GAP, MOVED, DRAG, ROWS = range(10)
#: Which residual of an iteration is evaluated.
BETWEEN, AT_START, AT_END = range(3)
#: Smallest stiffness of a DOF in norms, relative to the mean; DOFs of a rigid body have none.
SMALLEST = 1e-14


@apart("statics", Equations, Annotated[Target, MADE], F2, int, bool, F1, F2, F2, F2, F1)
def balance(e, target, factors, which, mixed, g, x, m, stresses, norms):
    """Set forces, residual, tangent and its inverse diagonal."""
    # ``which`` is AT_START for the first tangent, AT_END for the last residual, without a tangent.
    # ``factors`` are load factors and those for the first tangent; ``m`` the multipliers and
    # residuals of joints, and in row 3 their c; ``stresses`` those of the strain and the
    # independent ones. If ``mixed``, the geometric part uses the last stresses, linearised along
    # the correction. ``norms`` gets those of residual and larger force, and the largest relative
    # residual of joints.
    u, f, load, R, weights, phi = x[U], x[FORCE], x[LOAD], x[RESIDUAL], x[WEIGHTS], m[1]
    gap, drag, opened = x[GAP], x[DRAG], 0.0
    if e.lasting >= MATERIALS:
        carry_eigenstrains(e.loads, factors[0])
    if which == AT_END:
        force(e, u, target.at, f)
    else:
        if mixed:
            before, du = np.empty(u.size), x[DU]
            for i in indices(u.size):
                before[i] = u[i] - du[i]
            linearised(e, before, du, stresses[0], stresses[1])
        t = np.inf if which == AT_START and np.isnan(target.when) else target.when
        tangent(e, u, factors[1 if which == AT_START else 0], t, target.scale, target.at, mixed,
                stresses[0], stresses[1], f)
        add_to_diagonal(e.K, drag)
        diagonal(e.K, weights)
        invert(weights, e.sizes)
    external_force(e.loads, factors[0], target.when, target.scale, u, load)
    for i in indices(u.size):
        R[i] = load[i] - f[i] - gap[i] - drag[i] * u[i]
    if phi.size > 0:
        constraint(e.joints, m[3], g, target.at, u, phi)
        opening, pull = np.empty(phi.size), np.zeros(u.size)
        for k in indices(phi.size):
            opening[k] = phi[k] / e.joints.sizes[k]
        opened = largest(opening)
        add_joint_force(e.joints, g, target.at, u, m[0], pull)
        for i in indices(u.size):
            R[i] -= pull[i]
    for i in indices(u.size):
        R[i] *= e.free[i]
    size = np.sqrt(max(weighted_square(f, weights), weighted_square(load, weights)))
    norms[0], norms[1], norms[2] = np.sqrt(weighted_square(R, weights)), size, opened


#: What an iteration has seen to be within the range of the model: nothing, the axes of all beams
#: (none turns by more than a radian over an element, or folds), or their strains too.
UNSEEN, AXES, RANGE = range(3)


@source
def examine(e, u, stresses):
    """UNSEEN, AXES or RANGE, whichever is sure at u; ``stresses`` are overwritten."""
    nodes, rest, n = e.axes.nodes, e.axes.rest, e.axes.nodes.shape[1]
    beyond = np.empty(n)
    for k in indices(n):
        i, j = nodes[0, k], nodes[1, k]
        a, b = rest[0, k] + u[i + 2], rest[1, k] + u[i + 3]
        c, d = rest[2, k] + u[j + 2], rest[3, k] + u[j + 3]
        x, y = rest[4, k] + (u[j] - u[i]), rest[5, k] + (u[j + 1] - u[i + 1])
        p, q = a * c + b * d, a * d - b * c
        turn = np.abs(q * rest[6, k] + p * rest[7, k]) - 1.557 * (  # tangent of a radian
            p * rest[6, k] - q * rest[7, k])
        beyond[k] = np.maximum(0.0, np.maximum(turn, -np.minimum(a * x + b * y, c * x + d * y)))
    if largest(beyond) != 0.0:
        return UNSEEN
    limits = e.axes.limits
    if limits.size < stresses.size:
        return AXES
    body_stress(e.body, u, stresses)
    for k in indices(limits.size):
        stresses[k] *= limits[k]
    return RANGE if largest(stresses) < 1.0 else AXES


@source
def invert(weights, sizes):
    """Replace the diagonal of a tangent by the weights of residuals, its inverse."""
    for i in indices(weights.size):
        weights[i] = np.abs(weights[i])
    least = SMALLEST * mean_stiffness(weights, sizes)
    for i in indices(weights.size):
        weights[i] = 1.0 / (weights[i] + least / (sizes[i] * sizes[i]))


@source
def mean_stiffness(diagonal, sizes):
    """Mean of the stiffnesses, scaled by the squared sizes of the DOFs; 1 if it is zero."""
    mean = weighted_square(sizes, diagonal) / sizes.size
    return mean if mean > 0.0 else 1.0


#: Line search with contact: accepted relative residual along the correction; largest number of
#: trials; largest number of intervals.
LEFT, TRIES, PARTS = 0.5, 12, 16


@apart("contacts", Equations, float, float, bool, F1, F1, F1, F1, returns=int)
def hold_back(e, t, loose, clear, u, R, du, dm):
    """Line search for a correction that runs into obstacles; scales du and dm. Returns 1 if it is
    known that nothing touches at its end, as at u if ``clear``."""
    # If ``loose`` is 1, bodies move by no more than an interval, as nothing but contact stops them.
    # The residual along the correction, of the equations linearised without contact plus the actual
    # contact forces, has to be small, see Crisfield (1991), 9.2. Otherwise contacts open and close
    # in turn.
    work, two, scratch = dot(R, du), np.empty(2), np.zeros(u.size)
    if loose == 0.0 and clear and way_is_clear(
            e.forces, t, e.forces.contacts.number > 0, u, du, scratch):
        return 1
    contact_along(e.forces, t, u, du, two)
    if not work > 0.0 and loose == 0.0:
        return 0
    parts, most = int(min(max(np.ceil(two[1]), 1.0), PARTS)), 1.0
    if loose > 0.0 and two[1] > 1.0:
        parts, most = 1, 1.0 / two[1]
    before, low, high, s = contact_work(e.forces, t, u, du, scratch), 0.0, most, most
    left, left_low = work, work
    for k in range(parts):
        high = most * (k + 1.0) / parts
        left = _left(e, t, u, du, high, work, two[0], before, scratch)
        if left < -LEFT * work:
            break
        low, left_low = high, left
    tries = 0 if left >= -LEFT * work else TRIES
    for k in range(tries):
        s = 0.5 * (low + high) if left_low <= 0.0 or k > 2 else max(
            low + 0.1 * (high - low), low + (high - low) * left_low / (left_low - left))
        now = _left(e, t, u, du, s, work, two[0], before, scratch)
        if abs(now) <= LEFT * work:
            break
        if now > 0.0:
            low, left_low = s, now
        else:
            high, left = s, now
    for i in indices(du.size):
        du[i] *= s
    for k in indices(dm.size):
        dm[k] *= s
    return 0


@source
def motion_is_clear(e, motion):
    """True if it is known that members do not touch on straight ways between displacements (n, N).
    """
    n, f = motion.shape[0], np.zeros(motion.shape[1])
    for k in range(n):
        u = motion[k]
        if not rests(e.forces, u, 0.0) and not looked_free(e.forces, 0.0, False, u, f):
            return False
        if k + 1 < n and not way_is_clear(
                e.forces, 0.0, False, u, motion[k + 1] - u, f):
            return False
    return True


@source
def _left(e, t, u, du, s, work, along, before, scratch):
    """Residual along the correction at a fraction s of it."""
    ahead = u.copy()
    add_multiple(s, du, ahead)
    return (1.0 - s) * work - (contact_work(e.forces, t, ahead, du, scratch) - before - s * along)
