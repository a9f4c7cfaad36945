"""Kernels of contact: forces, tangents, friction, multipliers.

Each active point has a force on its position and slope, (4,), with the derivative (4, 4),
distributed to the degrees of freedom by the weights of the point. Energy-conserving schemes take
means between two states whose work is the change of the potential: the discrete gradient of the
gap (Gonzalez 1996) times the slope of S between the states. The spring of friction is that of the
end, which damps its vibrations.

In a motion the stiffness is at least ``INERTIA`` times the mass over the squared step, so that few
updates of multipliers are needed.
"""

from typing import Annotated

import numpy as np

from ...core.band import smallest
from ...core import F1, F2, I1, MADE, apart, indices, source
from ..tables import add_each
from .active_set import near_points, project, search, relative_travel, touching
from .gap import SHORT, TINY, carried, distances, levers, places, surface
from .laws import (damping_loss, mean_pressure, mean_pressure_slope, pressure_slope,
                   return_mapping, slip_of)
from .tables import (ALONG, ANCHOR_X, ANCHOR_Y, ANCHORED, ANCHORS, AREA, AUGMENT, BEGIN, BILATERAL,
                     DAMPED_TANGENT, DAMPING, END, FOLLOWED, FORCE, FRICTION, GAP, LARGEST,
                     MULTIPLIER, NOW, OFFSET, PAIR, RADIUS, RATE, RESISTING, SETTLE, SLIP, STICKING,
                     STIFFNESS, TOLERANCE, ContactTables, Request, hardening, is_clear, pair_of,
                     set_clear, transition)

#: Displacement relative to an element below which a mean is evaluated in the middle.
CLOSE = 1e-5
#: The gap where nothing is.
FAR = 1e300
#: Anchors of slipped points are inside of the limit by these parts of it and of an element, so that
#: they stick at the start of the next step whatever the last digit.
INSIDE, NOWHERE = 1e-9, 1e-14
#: Rows of active points: position and slope in the middle of a mean; their displacement, or
#: velocity; penetration at both ends; surface point at the end; its displacement, or velocity;
#: surface point in the middle, its gap with derivatives, and its derivative by the slope; force and
#: its derivative; pressure and its derivative; missing work over the squared displacement.
(MIDDLE, RATES, DEPTH, LAST, WAY, PLACE, FOUND, LEVER, PUSH, K, PRESSURE, SLOPE, MISSING,
 ROWS) = 0, 4, 8, 10, 12, 14, 16, 22, 26, 28, 32, 33, 34, 35
NX, NY = FOUND + 1, FOUND + 2


@apart("contacts", ContactTables, Annotated[Request, MADE], F1, F1, F1)
def of_contacts(tables, request, u, v, out):
    """Add the answer of all pairs to a :class:`~skfem_ancf.actions.contact.tables.Request`."""
    n, least, end = tables.number, np.empty(tables.number), v if request.span > 0.0 else u
    if request.what != ALONG and untouched(tables, request.what, u) and (
            request.span == 0.0 or untouched(tables, request.what, end)):
        return
    for k in range(n):
        of_pair(pair_of(tables, k), request, u, v, out, least[k:k + 1])
    if request.what == FORCE and tables.clear.size > 0:
        set_clear(tables.clear, end, smallest(least))


@source
def untouched(tables, what, u):
    """True if no point can touch at u, nor is to be followed by its anchor."""
    less, memory = 0.0, tables.memory
    if memory[BILATERAL] > 0.0:
        return False
    if what == SETTLE and tables.lasting & ANCHORS:
        less = tables.clear[FOLLOWED] if memory[RATE] > 0.0 and tables.clear.size > 0 else FAR
    return is_clear(tables.clear, u, less)


@source
def of_pair(pair, request, u, v, out, least):
    """Add the answer of the active points of a pair; of a FORCE set also the least gap."""
    what, same = request.what, request.span == 0.0
    if what == ALONG:
        out[1] = max(out[1], relative_travel(pair, v))
    resists = what == RESISTING or what == DAMPED_TANGENT
    if resists and pair.numbers[DAMPING] == 0.0:
        return
    begin = search(pair, NOW if same else BEGIN, u)
    end = begin if same else search(pair, END, v)
    at = near_points(pair, what, begin, end)
    if what == FORCE:
        beyond = np.empty(end.size)
        for e in indices(end.size):
            beyond[e] = end[e] + FAR * (end[e] <= 0.0)
        least[0] = smallest(beyond)
    if at.size == 0:
        return
    a = project(pair, NOW if same else BEGIN, u, at)
    b = a if same else project(pair, END, v, at)
    if what == FORCE:
        least[0] = min(least[0], smallest(b[GAP]))
    if what < SETTLE:
        some = touching(pair, a, b, at)
        at, a, b = at[some], a[:, some], b[:, some]
    if at.size == 0:
        return
    w = np.empty((ROWS, at.size))
    states(pair, same, a, b, at, w)
    if what == AUGMENT:
        _augment(pair, at, w, out)
        return
    if resists or what == ALONG:
        places(pair, v, 0.0, at, w[RATES:DEPTH])
        surface_velocities(w)
    if resists:
        damp(pair, request.factor, at, w)
    else:
        press(pair, at, w)
        if what == FORCE:
            _keep_work(pair, w)
        if what == SETTLE:
            _settle(pair, same, at, w, out)
            return
        add_friction(pair, same, at, w)
    if what == FORCE or what == RESISTING:
        _add_force(pair, at, w, out)
    else:
        S = np.zeros((16, at.size))
        _stiffness(pair, at, w, S)
        if what == ALONG:
            _add_along(w, S, out)
        else:
            _add_stiffness(pair, request, at, S, out)


@apart("contacts", PAIR, bool, F2, F2, I1, F2)
def states(pair, same, a, b, at, w):
    """Fill the rows of points up to the derivative by the slope."""
    part, multiplier = 1.0 / hardening(pair), pair.memory[MULTIPLIER]
    for c in range(4):
        for i in indices(at.size):
            w[RATES + c, i] = b[c, i] - a[c, i]
            w[MIDDLE + c, i] = a[c, i]
    for i in indices(at.size):
        more = part * multiplier[at[i]]
        w[DEPTH, i], w[DEPTH + 1, i] = more - a[GAP, i], more - b[GAP, i]
        w[LAST, i], w[LAST + 1, i] = b[4, i], b[5, i]
    if not same and pair.moving > 0:
        _carry(pair, a, w)
    if not same:
        for c in range(4):
            for i in indices(at.size):
                w[MIDDLE + c, i] += 0.5 * w[RATES + c, i]
    surface(pair, at, w[MIDDLE:RATES], w[PLACE:FOUND])
    levers(pair, at, w[MIDDLE:RATES], w[LEVER:PUSH])
    distances(pair, NOW, True, w[PLACE:FOUND], w[FOUND:LEVER])
    surface_velocities(w)


@source
def _carry(pair, a, w):
    """Move points with the obstacle to its middle pose."""
    for i in indices(w.shape[1]):
        x, y = carried(pair.poses[NOW], pair.poses[BEGIN], a[4, i], a[5, i])
        p, q = x - a[4, i], y - a[5, i]
        x, y = carried(pair.poses[NOW], pair.poses[END], w[LAST, i], w[LAST + 1, i])
        w[MIDDLE, i] += p
        w[MIDDLE + 1, i] += q
        w[RATES, i] += x - w[LAST, i] - p
        w[RATES + 1, i] += y - w[LAST + 1, i] - q
        w[LAST, i], w[LAST + 1, i] = x, y


@source
def surface_velocities(w):
    """Velocities of surface points from those of positions and slopes."""
    for k in range(2):
        for i in indices(w.shape[1]):
            w[WAY + k, i] = (w[RATES + k, i] + w[LEVER + 2 * k, i] * w[RATES + 2, i]
                             + w[LEVER + 2 * k + 1, i] * w[RATES + 3, i])


# laws


@apart("contacts", PAIR, I1, F2)
def press(pair, at, w):
    """Force of the pressure, and its derivative."""
    area, multiplier, width = pair.points[AREA], pair.memory[MULTIPLIER], transition(pair)
    part = hardening(pair)
    stiffness, holds = pair.numbers[STIFFNESS] * part, pair.common[BILATERAL] / part
    for i in indices(at.size):
        a, b, scale, pulls = w[DEPTH, i], w[DEPTH + 1, i], stiffness * area[at[i]], holds * (
            multiplier[at[i]])
        mean = mean_pressure(a, b, width) - pulls
        p, c = scale * mean, scale * mean_pressure_slope(a, b, width, mean)
        x, y = w[NX, i], w[NY, i]
        w[PUSH, i], w[PUSH + 1, i], w[PRESSURE, i], w[SLOPE, i] = -p * x, -p * y, p, c
        w[MISSING, i] = 0.0
        w[K, i], w[K + 3, i] = c * x * x - p * w[FOUND + 3, i], c * y * y - p * w[FOUND + 5, i]
        w[K + 1, i] = c * x * y - p * w[FOUND + 4, i]
        w[K + 2, i] = w[K + 1, i]


@source
def _keep_work(pair, w):
    """Correct forces such that their work is the change of the potential."""
    close = (CLOSE * pair.numbers[RADIUS]) ** 2
    for i in indices(w.shape[1]):
        square = (w[RATES, i] * w[RATES, i] + w[RATES + 1, i] * w[RATES + 1, i]
                  + w[RATES + 2, i] * w[RATES + 2, i] + w[RATES + 3, i] * w[RATES + 3, i])
        missing = (w[PRESSURE, i] * (w[DEPTH + 1, i] - w[DEPTH, i])
                   - w[PUSH, i] * w[WAY, i] - w[PUSH + 1, i] * w[WAY + 1, i])
        w[MISSING, i] = missing * (square > close) / np.maximum(square, TINY)


@source
def _tangential(pair):
    """Coefficient of friction, zero without anchors; 1 if all points stick; stiffness per area."""
    firmness, anchored = pair.common[LARGEST + pair.number + pair.k], pair.common[ANCHORED]
    return (pair.numbers[FRICTION] * np.minimum(anchored, 1.0), 1.0 * (anchored > 1.0),
            pair.numbers[STICKING] * (1.0 + firmness))


@apart("contacts", PAIR, bool, I1, F2)
def add_friction(pair, same, at, w):
    """Add Coulomb friction and its derivative."""
    friction, holds, sticking = _tangential(pair)
    if friction == 0.0:
        return
    area, pose, memory = pair.points[AREA], pair.poses[NOW], pair.memory
    # damps vibrations on the springs; a mean does so by itself
    extrapolates = 1.0 if same and pair.common[RATE] > 0.0 else 0.0
    for i in indices(at.size):
        nx, ny = w[NX, i], w[NY, i]
        slip = slip_of(pose, nx, ny, w[LAST, i], w[LAST + 1, i], memory[ANCHOR_X, at[i]],
                       memory[ANCHOR_Y, at[i]])
        k = sticking * area[at[i]]
        trial = k * (slip + extrapolates * (slip - memory[SLIP, at[i]]))
        T, sticks = return_mapping(trial, friction * w[PRESSURE, i])
        sticks = np.maximum(sticks, holds)
        change = friction * np.sign(trial) * (1.0 - sticks) * w[SLOPE, i]
        c = (1.0 + extrapolates if same else 2.0) * k * sticks
        w[PUSH, i] -= T * ny
        w[PUSH + 1, i] += T * nx
        w[K, i] += c * ny * ny + change * ny * nx - T * w[FOUND + 4, i]
        w[K + 1, i] += change * ny * ny - c * nx * ny - T * w[FOUND + 5, i]
        w[K + 2, i] += T * w[FOUND + 3, i] - c * nx * ny - change * nx * nx
        w[K + 3, i] += c * nx * nx - change * nx * ny + T * w[FOUND + 4, i]


@apart("contacts", PAIR, float, I1, F2)
def damp(pair, factor, at, w):
    """Damping force proportional to the pressure, and its derivative."""
    area, pose, damping = pair.points[AREA], pair.poses[NOW], pair.numbers[DAMPING]
    stiffness, width = pair.numbers[STIFFNESS] * hardening(pair), transition(pair)
    for i in indices(at.size):
        k, a, nx, ny = stiffness * area[at[i]], w[DEPTH, i], w[NX, i], w[NY, i]
        loss = damping_loss(pose, damping, nx, ny, w[PLACE, i], w[PLACE + 1, i], w[WAY, i],
                            w[WAY + 1, i])
        p = k * mean_pressure(a, a, width)
        c = factor * p * damping * (loss < 1.0) - loss * k * pressure_slope(a, width)
        w[PUSH, i], w[PUSH + 1, i], w[MISSING, i] = p * loss * nx, p * loss * ny, 0.0
        w[K, i], w[K + 1, i] = c * nx * nx, c * nx * ny
        w[K + 2, i], w[K + 3, i] = c * ny * nx, c * ny * ny


# history data


@apart("contacts", PAIR, bool, I1, F2, F1)
def _settle(pair, same, at, w, out):
    """Move anchors of slipping points to the limit of sticking; add the work to ``out[0]``."""
    friction, _, sticking = _tangential(pair)
    area, pose, memory = pair.points[AREA], pair.poses[NOW], pair.memory
    augmented, lost, where = pair.numbers[TOLERANCE] > 0.0, np.empty(at.size), 0 * at
    for i in indices(at.size):
        nx, ny, x, y = w[NX, i], w[NY, i], w[LAST, i], w[LAST + 1, i]
        slip = slip_of(pose, nx, ny, x, y, memory[ANCHOR_X, at[i]], memory[ANCHOR_Y, at[i]])
        k, limit, gone = sticking * area[at[i]], friction * w[PRESSURE, i], w[WAY + 1, i] * nx - (
            w[WAY, i] * ny)
        if same:
            gone = slip - memory[SLIP, at[i]]
        extrapolates = 1.0 if same and pair.common[RATE] > 0.0 else 0.0
        T, _ = return_mapping(k * (slip + extrapolates * gone), limit)
        after, _ = return_mapping(slip, np.maximum(
            (1.0 - INSIDE) * limit / k - NOWHERE * pair.numbers[RADIUS], 0.0))
        lost[i] = T * gone
        if augmented:
            lost[i] += w[PRESSURE, i] * (w[DEPTH + 1, i] - w[DEPTH, i])
        x, y = x + after * ny - pose[0], y - after * nx - pose[1]
        a, b, cos, sin = x - pose[4], y - pose[5], pose[2] - 1.0, pose[3]
        memory[SLIP, at[i]] = after
        memory[ANCHOR_X, at[i]] = x + cos * a + sin * b
        memory[ANCHOR_Y, at[i]] = y + cos * b - sin * a
    add_each(out, where, lost)


@apart("contacts", PAIR, I1, F2, F1)
def _augment(pair, at, w, out):
    """Increase multipliers by penetrations, decrease them by gaps, beyond the tolerance."""
    tolerance, multiplier = pair.numbers[TOLERANCE], pair.memory[MULTIPLIER]
    if tolerance == 0.0:
        return
    where, far, square = 0 * at, np.empty(at.size), np.empty(at.size)
    k = hardening(pair)
    for i in indices(at.size):
        before = multiplier[at[i]] / k
        change = np.maximum(w[DEPTH, i], 0.0) - before
        far[i] = 1.0 * (np.abs(change) > tolerance)
        after = k * (before + far[i] * change)
        multiplier[at[i]] = after
        square[i] = after * after
    add_each(out, where, far)
    largest = pair.common[LARGEST + pair.k:LARGEST + pair.k + 1]
    largest[0] = 0.0
    add_each(largest, where, square)
    largest[0] = np.sqrt(largest[0])  # no less than it


# from points to degrees of freedom


@apart("contacts", PAIR, I1, F2, F1)
def _add_force(pair, at, w, out):
    """Add forces on surface points to those on degrees of freedom."""
    value, turn, where = np.empty(at.size), np.empty(at.size), pair.first[at]
    for c in range(2):
        for i in indices(at.size):
            turn[i] = (w[LEVER + c, i] * w[PUSH, i] + w[LEVER + 2 + c, i] * w[PUSH + 1, i]
                       + w[MISSING, i] * w[RATES + 2 + c, i])
        for a in range(pair.weights.shape[0]):
            row = pair.weights[a]
            for i in indices(at.size):
                value[i] = row[at[i]] * (w[PUSH + c, i] + w[MISSING, i] * w[RATES + c, i])
            if pair.slopes.shape[0] > 0:
                row = pair.slopes[a]
                for i in indices(at.size):
                    value[i] += row[at[i]] * turn[i]
            add_each(out[2 * a + c:], where, value)


@apart("contacts", PAIR, I1, F2, F2)
def _stiffness(pair, at, w, S):
    """Derivative of the force on position and slope; entry (c, d) in row 4 c + d."""
    offset = pair.points[OFFSET]
    for c in range(2):
        for d in range(2):
            for i in indices(at.size):
                S[4 * c + d, i] = w[K + 2 * c + d, i]
    if pair.slopes.shape[0] == 0:
        return
    for c in range(2):
        for d in range(2):
            for i in indices(at.size):
                # K L and L^T K
                S[4 * c + 2 + d, i] = (w[K + 2 * c, i] * w[LEVER + d, i]
                                       + w[K + 2 * c + 1, i] * w[LEVER + 2 + d, i])
                S[4 * (2 + d) + c, i] = (w[LEVER + d, i] * w[K + c, i]
                                         + w[LEVER + 2 + d, i] * w[K + 2 + c, i])
    for c in range(2):
        for d in range(2):
            for i in indices(at.size):
                S[4 * (2 + c) + 2 + d, i] = (w[LEVER + c, i] * S[2 + d, i]
                                             + w[LEVER + 2 + c, i] * S[6 + d, i])
    for i in indices(at.size):  # and the second derivative of the surface by the slope
        s, t, p, q = w[MIDDLE + 2, i], w[MIDDLE + 3, i], w[PUSH, i], w[PUSH + 1, i]
        square = np.maximum(s * s + t * t, SHORT)
        c = offset[at[i]] / square / square / np.sqrt(square)
        across, both = -c * (q * s - p * t), c * (p * s + q * t)
        mixed = both * (s * s - t * t) - across * s * t
        S[10, i] += across * t * t - 2.0 * both * s * t
        S[11, i] += mixed
        S[14, i] += mixed
        S[15, i] += across * s * s + 2.0 * both * s * t


@apart("contacts", F2, F2, F1)
def _add_along(w, S, out):
    """Add the derivative of the work along the velocities to ``out[0]``."""
    value, where = np.empty(w.shape[1]), np.zeros(w.shape[1], np.int64)
    for a in range(4):
        for b in range(4):
            for i in indices(value.size):
                value[i] = S[4 * a + b, i] * w[RATES + a, i] * w[RATES + b, i]
            add_each(out, where, value)


@apart("contacts", PAIR, Annotated[Request, MADE], I1, F2, F1)
def _add_stiffness(pair, request, at, S, flat):
    """Add the derivatives to a band matrix, or its lower half if only that is stored."""
    value, where = np.empty(at.size), request.ld * pair.first[at]
    n = 2 * pair.weights.shape[0]
    for a in range(n):
        p, c = pair.weights[a // 2], 4 * (a % 2)
        for b in range(n if request.top > 0 else a + 1):
            q, d = pair.weights[b // 2], b % 2
            for i in indices(at.size):
                value[i] = p[at[i]] * q[at[i]] * S[c + d, i]
            if pair.slopes.shape[0] > 0:
                g, h = pair.slopes[a // 2], pair.slopes[b // 2]
                for i in indices(at.size):
                    value[i] += (p[at[i]] * h[at[i]] * S[c + 2 + d, i]
                                 + g[at[i]] * (q[at[i]] * S[8 + c + d, i]
                                               + h[at[i]] * S[10 + c + d, i]))
            add_each(flat[b * request.ld + request.top + a - b:], where, value)
