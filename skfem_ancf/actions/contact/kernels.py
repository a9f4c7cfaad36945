"""Kernels of contact: forces, tangents, friction, multipliers.

Each active point has a force on its position and slope, (4,), with the derivative (4, 4),
distributed to the degrees of freedom by the weights of the point. Energy-conserving schemes take
means between two states whose work is the change of the potential: the discrete gradient of the
gap (Gonzalez 1996) times the slope of S between the states. The spring of friction is that of the
end, which damps its vibrations.

In a motion the stiffness is at least ``INERTIA`` times the mass over the squared step, so that few
updates of multipliers are needed.
"""

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np

from ...core.band import smallest
from ...core import C1, F1, F2, I1, MADE, apart, indices, source
from ..tables import add_each
from .active_set import near_points, project, relative_travel, search, selected, touching
from .gap import SHORT, TINY, carried, distances, outside, placed
from .laws import (damping_loss, from_anchor, mean_pressure, mean_pressure_slope, pressure_slope,
                   return_mapping)
from .plane import cross, dot, scaled, turned, vector
from .tables import (ALONG, ANCHOR_X, ANCHOR_Y, ANCHORED, ANCHORS, AREA, AUGMENT, BEGIN, BILATERAL,
                     DAMPED_TANGENT, DAMPING, END, FOLLOWED, FORCE, FRICTION, LARGEST,
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


class Touch(NamedTuple):
    """Points in contact between two states, (n,); plane vectors are complex numbers."""

    at: I1
    slope: C1  # of the axis, in the middle
    moved: C1  # displacement of the place on it, and change of the slope
    turns: C1
    before: F1  # penetrations
    after: F1
    last: C1  # surface point at the end
    place: F2  # and in the middle, (2, n)
    normal: C1  # gradient of the gap there
    bend: F2  # and its second derivatives xx, xy, yy, (3, n)


TOUCH: TypeAlias = Annotated[Touch, MADE]


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
        least[0] = min(least[0], smallest(b.gap))
    if what < SETTLE:
        some = touching(pair, a, b, at)
        at = at[some]
        a, b = selected(a, some), selected(b, some)
    if at.size == 0:
        return
    p = touch_of(pair, same, a, b, at)
    if what == AUGMENT:
        _augment(pair, at, p.before, out)
        return
    force, missing, K, pressure = np.empty(at.size, np.complex128), np.zeros(at.size), np.empty(
        (4, at.size)), np.empty(at.size)
    moved, turns = p.moved, p.turns
    if resists or what == ALONG:
        moved, turns = placed(pair, v, 0.0, at)
    if resists:
        damp(pair, request.factor, p, moved, turns, force, K)
    else:
        respond(pair, same, p, force, missing, K, pressure)
    if what == SETTLE:
        _settle(pair, same, p, pressure, out)
    elif what == FORCE or what == RESISTING:
        _add_force(pair, p, force, missing, out)
    else:
        S = np.zeros((16, at.size))
        _stiffness(pair, p, force, K, S)
        if what == ALONG:
            _add_along(moved, turns, S, out)
        else:
            _add_stiffness(pair, request, at, S, out)


@source
def touch_of(pair, same, a, b, at):
    """The :class:`Touch` between two states of points, which may be one."""
    n, part, poses = at.size, 1.0 / hardening(pair), pair.poses
    moved, turns, slope, last = (np.empty(n, np.complex128), np.empty(n, np.complex128),
                                 np.empty(n, np.complex128), np.empty(n, np.complex128))
    before, after, x, found, normal = np.empty(n), np.empty(n), np.empty((2, n)), np.empty(
        (6, n)), np.empty(n, np.complex128)
    for i in indices(n):
        x0, x1, end = a.x[i], b.x[i], b.surface[i]
        if not same and pair.moving > 0:  # with the obstacle to its middle pose
            x0 = x0 + carried(poses[NOW], poses[BEGIN], a.surface[i]) - a.surface[i]
            there = carried(poses[NOW], poses[END], end)
            x1, end = x1 + there - end, there
        more = part * pair.memory[MULTIPLIER, at[i]]
        before[i], after[i], last[i] = more - a.gap[i], more - b.gap[i], end
        moved[i], turns[i], slope[i] = x1 - x0, b.t[i] - a.t[i], scaled(0.5, a.t[i] + b.t[i])
        middle = outside(scaled(0.5, x0 + x1), slope[i], pair.points[OFFSET, at[i]])
        x[0, i], x[1, i] = middle.real, middle.imag
    distances(pair, NOW, True, x, found)
    for i in indices(n):
        normal[i] = vector(found[1, i], found[2, i])
    return Touch(at, slope, moved, turns, before, after, last, x, normal, found[3:])


@source
def lever(pair, p, i):
    """u and a of the derivative ``-u (a . dt)`` of surface points by their slope t."""
    t, c = p.slope[i], pair.points[OFFSET, p.at[i]]
    short = 1.0 / np.sqrt(np.maximum(dot(t, t), SHORT))
    unit = scaled(short, t)
    return scaled(c * short, unit), turned(unit)


# laws


@apart("contacts", PAIR, bool, TOUCH, C1, F1, F2, F1)
def respond(pair, same, p, force, missing, K, pressure):
    """Set resisting forces of pressure and Coulomb friction, their derivatives, and pressures.

    ``missing`` is the difference of the work of the pressure from the change of its potential, over
    the squared displacement.
    """
    width, part, memory = transition(pair), hardening(pair), pair.memory
    holds = pair.common[BILATERAL] / part
    close, (friction, all_stick, sticking) = (CLOSE * pair.numbers[RADIUS]) ** 2, _tangential(pair)
    # damps vibrations on the springs; a mean does so by itself
    extrapolates = 1.0 if same and pair.common[RATE] > 0.0 else 0.0
    for i in indices(pressure.size):
        m, n = p.at[i], p.normal[i]
        a, b, area = p.before[i], p.after[i], pair.points[AREA, m]
        scale = pair.numbers[STIFFNESS] * part * area
        mean = mean_pressure(a, b, width) - holds * memory[MULTIPLIER, m]
        P, c = scale * mean, scale * mean_pressure_slope(a, b, width, mean)
        u, across = lever(pair, p, i)
        way = p.moved[i] - scaled(dot(across, p.turns[i]), u)
        square = dot(p.moved[i], p.moved[i]) + dot(p.turns[i], p.turns[i])
        missing[i] = P * (b - a + dot(n, way)) * (square > close) / np.maximum(square, TINY)
        x, y, xx, xy, yy = n.real, n.imag, p.bend[0, i], p.bend[1, i], p.bend[2, i]
        T, to_x, to_y, change = 0.0, 0.0, 0.0, 0.0
        if friction > 0.0:
            aside, up = from_anchor(pair.poses[NOW], p.last[i].real, p.last[i].imag,
                                    memory[ANCHOR_X, m], memory[ANCHOR_Y, m])
            slip, k = up * x - aside * y, sticking * area
            trial = k * (slip + extrapolates * (slip - memory[SLIP, m]))
            T, sticks = return_mapping(trial, friction * P)
            sticks = np.maximum(sticks, all_stick)
            change = friction * np.sign(trial) * (1.0 - sticks) * c
            # the slip changes along the surface, and as that turns, in a mean by half of it
            turning = (1.0 + extrapolates) * k * sticks
            stick = turning if same else 2.0 * turning
            to_x = turning * (xx * up - xy * aside) - stick * y
            to_y = turning * (xy * up - yy * aside) + stick * x
        pressure[i], force[i] = P, scaled(-P, n) + scaled(T, turned(n))
        K[0, i] = c * x * x - P * xx - to_x * y + change * x * y - T * xy
        K[1, i] = c * x * y - P * xy - to_y * y + change * y * y - T * yy
        K[2, i] = c * x * y - P * xy + to_x * x - change * x * x + T * xx
        K[3, i] = c * y * y - P * yy + to_y * x - change * x * y + T * xy


@source
def _tangential(pair):
    """Coefficient of friction, zero without anchors; 1 if all points stick; stiffness per area."""
    firmness, anchored = pair.common[LARGEST + pair.number + pair.k], pair.common[ANCHORED]
    return (pair.numbers[FRICTION] * np.minimum(anchored, 1.0), 1.0 * (anchored > 1.0),
            pair.numbers[STICKING] * (1.0 + firmness))


@apart("contacts", PAIR, float, TOUCH, C1, C1, C1, F2)
def damp(pair, factor, p, moved, turns, force, K):
    """Set damping forces proportional to the pressure at a velocity, and their derivatives."""
    damping, width = pair.numbers[DAMPING], transition(pair)
    for i in indices(force.size):
        k = pair.numbers[STIFFNESS] * hardening(pair) * pair.points[AREA, p.at[i]]
        n, (u, across) = p.normal[i], lever(pair, p, i)
        way = moved[i] - scaled(dot(across, turns[i]), u)
        loss = damping_loss(pair.poses[NOW], damping, n.real, n.imag, p.place[0, i],
                            p.place[1, i], way.real, way.imag)
        P = k * mean_pressure(p.before[i], p.before[i], width)
        c = factor * P * damping * (loss < 1.0) - loss * k * pressure_slope(p.before[i], width)
        force[i] = scaled(P * loss, n)
        K[0, i], K[1, i] = c * n.real * n.real, c * n.real * n.imag
        K[2, i], K[3, i] = c * n.imag * n.real, c * n.imag * n.imag


# history data


@apart("contacts", PAIR, bool, TOUCH, F1, F1)
def _settle(pair, same, p, pressure, out):
    """Move anchors of slipping points to the limit of sticking; add the work to ``out[0]``."""
    friction, _, sticking = _tangential(pair)
    pose, memory = pair.poses[NOW], pair.memory
    augmented, lost = pair.numbers[TOLERANCE] > 0.0, np.empty(pressure.size)
    extrapolates = 1.0 if same and pair.common[RATE] > 0.0 else 0.0
    for i in indices(lost.size):
        m, n, last = p.at[i], p.normal[i], p.last[i]
        aside, up = from_anchor(pose, last.real, last.imag, memory[ANCHOR_X, m],
                                memory[ANCHOR_Y, m])
        slip = up * n.real - aside * n.imag
        k, limit, (u, across) = sticking * pair.points[AREA, m], friction * pressure[i], lever(
            pair, p, i)
        gone = cross(n, p.moved[i] - scaled(dot(across, p.turns[i]), u))
        if same:
            gone = slip - memory[SLIP, m]
        T, _ = return_mapping(k * (slip + extrapolates * gone), limit)
        after, _ = return_mapping(slip, np.maximum(
            (1.0 - INSIDE) * limit / k - NOWHERE * pair.numbers[RADIUS], 0.0))
        lost[i] = T * gone
        if augmented:
            lost[i] += pressure[i] * (p.after[i] - p.before[i])
        x, y = last.real + after * n.imag - pose[0], last.imag - after * n.real - pose[1]
        a, b, cos, sin = x - pose[4], y - pose[5], pose[2] - 1.0, pose[3]
        memory[SLIP, m] = after
        memory[ANCHOR_X, m] = x + cos * a + sin * b
        memory[ANCHOR_Y, m] = y + cos * b - sin * a
    add_each(out, 0 * p.at, lost)


@apart("contacts", PAIR, I1, F1, F1)
def _augment(pair, at, depth, out):
    """Increase multipliers by penetrations, decrease them by gaps, beyond the tolerance."""
    tolerance, multiplier = pair.numbers[TOLERANCE], pair.memory[MULTIPLIER]
    if tolerance == 0.0:
        return
    where, far, square = 0 * at, np.empty(at.size), np.empty(at.size)
    k = hardening(pair)
    for i in indices(at.size):
        before = multiplier[at[i]] / k
        change = np.maximum(depth[i], 0.0) - before
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


@apart("contacts", PAIR, TOUCH, C1, F1, F1)
def _add_force(pair, p, force, missing, out):
    """Add forces on surface points to those on degrees of freedom."""
    n = force.size
    turn, value, where = np.empty(n, np.complex128), np.empty(n, np.complex128), (
        pair.first[p.at] // 2)
    for i in indices(n):
        u, across = lever(pair, p, i)
        turn[i] = scaled(missing[i], p.turns[i]) - scaled(dot(u, force[i]), across)
        force[i] += scaled(missing[i], p.moved[i])
    for a in range(pair.weights.shape[0]):
        row = pair.weights[a]
        for i in indices(n):
            value[i] = scaled(row[p.at[i]], force[i])
        if pair.slopes.shape[0] > 0:
            row = pair.slopes[a]
            for i in indices(n):
                value[i] += scaled(row[p.at[i]], turn[i])
        add_each(out.view(np.complex128)[a:], where, value)


@apart("contacts", PAIR, TOUCH, C1, F2, F2)
def _stiffness(pair, p, force, K, S):
    """Derivative of the force on position and slope; entry (c, d) in row 4 c + d."""
    for i in indices(force.size):
        u, v = lever(pair, p, i)
        a, k = (v.real, v.imag), ((K[0, i], K[1, i]), (K[2, i], K[3, i]))
        left = (k[0][0] * u.real + k[1][0] * u.imag, k[0][1] * u.real + k[1][1] * u.imag)
        right = (k[0][0] * u.real + k[0][1] * u.imag, k[1][0] * u.real + k[1][1] * u.imag)
        both = left[0] * u.real + left[1] * u.imag
        for c in range(2):
            for d in range(2):
                S[4 * c + d, i] = k[c][d]
                S[4 * c + 2 + d, i] = -right[c] * a[d]
                S[4 * (2 + c) + d, i] = -a[c] * left[d]
                S[4 * (2 + c) + 2 + d, i] = both * a[c] * a[d]
        # and the second derivative of the surface by the slope
        t, f = p.slope[i], force[i]
        square = np.maximum(dot(t, t), SHORT)
        c = pair.points[OFFSET, p.at[i]] / square / square / np.sqrt(square)
        over, along = c * cross(f, t), c * dot(f, t)
        x, y = t.real, t.imag
        mixed = along * (x * x - y * y) - over * x * y
        S[10, i] += over * y * y - 2.0 * along * x * y
        S[11, i] += mixed
        S[14, i] += mixed
        S[15, i] += over * x * x + 2.0 * along * x * y


@apart("contacts", C1, C1, F2, F1)
def _add_along(moved, turns, S, out):
    """Add the derivative of the work along the velocities to ``out[0]``."""
    value, zero = np.zeros(moved.size), np.zeros(moved.size, np.int64)
    for i in indices(value.size):
        rates = (moved[i].real, moved[i].imag, turns[i].real, turns[i].imag)
        for a in range(4):
            for b in range(4):
                value[i] += S[4 * a + b, i] * rates[a] * rates[b]
    add_each(out, zero, value)


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
