"""Contact of beams with obstacles: gaps of their surfaces, what may touch, and the points of
:mod:`skfem_ancf.actions.contact.points` for it.

A surface point is ``X = x + c n(s)``: a point x of the body, and for cables the normal n of the
slope s of the axis at a distance c. Its gap, the signed distance from an obstacle, is negative
inside of that; the gradient is the normal at the closest point.

A broad search by elements compares the gap of the middle of each with the radius of its points. Of
points in contact the gap in the middle of a step has a normal, whose correction by a multiple of
the displacement is a discrete gradient (Gonzalez 1996). The spring of friction is that of the end,
which damps its vibrations.

In a motion the stiffness is at least ``inertia`` times the mass over the squared step, so that few
updates of multipliers are needed.
"""

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np

from ...core.band import smallest
from ...core import C1, F1, F2, I1, MADE, apart, custom_distance, indices, source
from ..tables import add_each
from .points import (SHORT, TOUCH, Touch, add_bend, add_coupling, add_resistance, by_slope, cross,
                     dot, mean_pressure, pressure_slope, product, put, respond, return_mapping,
                     scaled, size, spread, turned, vector)
from .tables import (ALONG, ANCHORED, ANCHORS, AUGMENT, BEGIN, BILATERAL, CUSTOM, DAMPED_TANGENT,
                     END, FAR, FOLLOWED, FORCE, NOW, PAIR, RATE, RESISTING, SAFE, SETTLE, TINY,
                     ContactTables, Request, is_clear, pair_of, set_clear, stiffness_factor,
                     transition)

#: Largest distance at which anchors follow points in a motion, in radii of an element.
BEYOND = 4.0
#: Displacement relative to an element below which a mean is evaluated in the middle.
CLOSE = 1e-5
#: Anchors of slipped points are inside of the limit by these parts of it and of an element, so that
#: they stick at the start of the next step whatever the last digit.
INSIDE, NOWHERE = 1e-9, 1e-14
#: Number of parameters of a circle.
DISC = 5


# surface points and their gaps


class Placed(NamedTuple):
    """Points on the axis, slopes there, and surface points, (n,), with their gaps."""

    x: C1
    t: C1
    surface: C1
    gap: F1


@source
def placed(pair, u, factor, at):
    """Positions and slopes of points: factor times the reference ones plus displacements."""
    n, z = at.size, u.view(np.complex128)
    x, t, start = np.empty(n, np.complex128), np.empty(n, np.complex128), pair.starts
    for i in indices(n):
        m = at[i]
        x[i] = scaled(factor, vector(start[0, m], start[1, m]))
        t[i] = scaled(factor, vector(start[2, m], start[3, m]))
    for k in range(pair.weights.shape[0]):
        for i in indices(n):
            x[i] += scaled(pair.weights[k, at[i]], z[pair.dofs[k, at[i]]])
    for k in range(pair.slopes.shape[0]):
        for i in indices(n):
            t[i] += scaled(pair.slopes[k, at[i]], z[pair.dofs[k, at[i]]])
    return x, t


@apart("contacts", PAIR, F1, float, F2, F1)
def middles(pair, u, factor, x, radius):
    """Positions of element middles (2, n), and bounds of the distance of their points."""
    # Reference positions are multiplied by ``factor``.
    n, pairs, z = x.shape[1], pair.dofs.shape[0], u.view(np.complex128)
    m = pair.areas.size // n
    first, p, q = pair.dofs[0, ::m], pair.middles[0], pair.middles[1]
    for e in indices(n):
        x[0, e], x[1, e], radius[e] = factor * p[e], factor * q[e], pair.law.radius
    for k in range(pairs):
        p, q, same = pair.middles[2 + 2 * k], pair.middles[3 + 2 * k], 1.0 * (k == pairs // 2)
        dofs = pair.dofs[k, ::m]
        for e in indices(n):
            a = z[dofs[e]]
            x[0, e] += p[e] * a.real
            x[1, e] += p[e] * a.imag
            # both places of an element together are a translation
            radius[e] += q[e] * size(a - scaled(same, z[first[e]]))


@source
def outside(x, t, offset):
    """Surface points beside points x of an axis with the slope t."""
    return x + scaled(offset / np.sqrt(np.maximum(dot(t, t), SHORT)), turned(t))


@source
def carried(q, p, x):
    """Points that move with an obstacle from pose p to pose q."""
    # x + (turn - 1) (x - pivot): a pivot far away adds no round-off
    cos, sin = q[2] * p[2] + q[3] * p[3] - 1.0, q[3] * p[2] - q[2] * p[3]
    a, b = x.real - p[0] - p[4], x.imag - p[1] - p[5]
    return x + vector(q[0] - p[0] + cos * a - sin * b, q[1] - p[1] + sin * a + cos * b)


@apart("contacts", PAIR, int, bool, F2, F2)
def distances(pair, which, whole, x, out):
    """Gap, its gradient and, if ``whole``, second derivatives xx, xy, yy at points x, (6, n)."""
    pose, y, side = pair.poses[which], np.empty(x.shape), pair.law.side
    cos, sin = pose[2], pose[3]
    for i in indices(x.shape[1]):
        p, q = x[0, i] - pose[0], x[1, i] - pose[1]
        a, b = p - pose[4], q - pose[5]
        y[0, i], y[1, i] = p + (cos - 1.0) * a + sin * b, q + (cos - 1.0) * b - sin * a
    if pair.kind == CUSTOM:
        custom_distance(pair.custom, pair.obstacle, pose[9], y, out)
    else:
        outline(pair.shape, whole, y, out)
    for i in indices(x.shape[1]):
        out[0, i] *= side
    if not whole:
        return
    for i in indices(x.shape[1]):
        a, b = side * out[1, i], side * out[2, i]
        p, q, r = side * out[3, i], side * out[4, i], side * out[5, i]
        out[1, i], out[2, i] = cos * a - sin * b, sin * a + cos * b
        c, d = 0.5 * (p + r), 0.5 * (p - r)
        e, f = (cos * cos - sin * sin) * d - 2.0 * cos * sin * q, 2.0 * cos * sin * d + (
            cos * cos - sin * sin) * q
        out[3, i], out[4, i], out[5, i] = c + e, f, c - e


@source
def disc(shape, whole, y, out):
    """Gap of a circle, from its radius and a point of its surface with the normal there."""
    # The difference of squares is zero at that point, so that a circle far larger than the scene
    # has gaps without the round-off of its radius.
    radius, px, py, nx, ny = shape[0], shape[1], shape[2], shape[3], shape[4]
    for i in indices(y.shape[1]):
        a, b = y[0, i] - px, y[1, i] - py
        gx, gy = a + radius * nx, b + radius * ny
        size = np.maximum(np.sqrt(gx * gx + gy * gy), TINY)
        out[0, i] = (a * a + b * b + 2.0 * radius * (nx * a + ny * b)) / (size + radius)
        if whole:
            gx, gy = gx / size, gy / size
            out[1, i], out[2, i] = gx, gy
            out[3, i], out[4, i], out[5, i] = gy * gy / size, -gx * gy / size, gx * gx / size


@apart("contacts", F1, bool, F2, F2)
def outline(shape, whole, y, out):
    """Closest point projection on a polygon with rounded corners."""
    # Parameters of the shape: radius of the corners, relative ends of the edges, then for each
    # corner: position, vector to the next one, 1 or -1 for convex or not. The surface is a line
    # near an edge, a circle near a corner. A circle alone has five parameters, see :func:`disc`.
    if shape.size == DISC:
        disc(shape, whole, y, out)
        return
    radius, low, high = shape[0], shape[1], shape[2]
    n, best = (shape.size - 3) // 5, np.empty(y.shape[1])
    for i in indices(y.shape[1]):
        best[i] = 1e300
    for c in range(6 if whole else 1):
        for i in indices(y.shape[1]):
            out[c, i] = 0.0
    for k in range(n):
        p, after = shape[3 + 5 * k:8 + 5 * k], shape[7 + 5 * ((k + 1) % n)]
        px, py, before = p[0], p[1], p[4]
        ex, ey = p[2], p[3]
        square = np.maximum(ex * ex + ey * ey, TINY)
        nx, ny = ey / np.sqrt(square), -ex / np.sqrt(square)
        for i in indices(y.shape[1]):
            a, b = y[0, i] - px, y[1, i] - py
            s = np.minimum(np.maximum((a * ex + b * ey) / square, low), high)
            c, d = a - s * ex, b - s * ey
            far = c * c + d * d
            new = 1.0 * (far < best[i])
            best[i] = np.minimum(best[i], far)
            inner = 1.0 * (s > low) * (s < high)
            corner = (1.0 - inner) * (before * (s < 0.5) + after * (s >= 0.5))
            size = np.maximum(np.sqrt(far), TINY)
            out[0, i] += new * (inner * (nx * a + ny * b) + corner * size - radius - out[0, i])
            if whole:
                bend = corner / size
                gx, gy = inner * nx + bend * c, inner * ny + bend * d
                out[1, i] += new * (gx - out[1, i])
                out[2, i] += new * (gy - out[2, i])
                out[3, i] += new * (bend * gy * gy - out[3, i])
                out[4, i] -= new * (bend * gx * gy + out[4, i])
                out[5, i] += new * (bend * gx * gx - out[5, i])


# requests


class Spot(NamedTuple):
    """What points in contact with an obstacle have beside their :class:`Touch`, (n,)."""

    slope: C1  # of the axis, in the middle of a step
    normal: C1  # gradient of the gap of the surface point there
    bend: F2  # and its second derivatives xx, xy, yy, (3, n)
    place: F2  # that surface point, (2, n)
    last: C1  # and the one at the end
    away: C1  # from the anchor
    slip: F1


SPOT: TypeAlias = Annotated[Spot, MADE]


@apart("contacts", ContactTables, Annotated[Request, MADE], F1, F1, F1)
def of_contacts(tables, request, u, v, out):
    """Add the answer of all pairs to a :class:`~skfem_ancf.actions.contact.tables.Request`."""
    n, least, end = tables.number, np.empty(tables.number), v if request.span != 0.0 else u
    if request.what != ALONG and untouched(tables, request.what, u) and (
            request.span == 0.0 or untouched(tables, request.what, end)):
        return
    for k in range(n):
        of_pair(pair_of(tables, k), request, u, v, out, least[k:k + 1])
    if request.what == FORCE and tables.clear.size > 0:
        set_clear(tables.clear, end, SAFE * smallest(least))


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
    what, same, law = request.what, request.span == 0.0, pair.law
    if what == ALONG:  # the largest displacement of an element's middle
        rows, square = np.empty((3, pair.middles.shape[1])), 0.0
        middles(pair, v, 0.0, rows[:2], rows[2])
        for e in range(rows.shape[1]):
            square = max(square, rows[0, e] * rows[0, e] + rows[1, e] * rows[1, e])
        out[1] = max(out[1], np.sqrt(square) / law.radius)
    resists = what == RESISTING or what == DAMPED_TANGENT
    if resists and law.damping == 0.0:
        return
    begin = search(pair, NOW if same else BEGIN, u)
    end = begin if same else search(pair, END, v)
    at = _near_points(pair, what, begin, end)
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
    if what < SETTLE:  # those that touch at one of the states
        part, flags = 1.0 / stiffness_factor(pair), np.empty(at.size)
        for i in indices(at.size):
            flags[i] = 1.0 * (np.minimum(a.gap[i], b.gap[i]) < part * pair.multipliers[at[i]])
        some = np.nonzero(flags)[0]
        at, a, b = at[some], _selected(a, some), _selected(b, some)
    if at.size == 0:
        return
    touch, spot = touch_of(pair, same, a, b, at)
    if what == AUGMENT:
        _augment(pair, at, touch.before, out)
    elif resists:
        R, K, rates = np.zeros((4, at.size)), np.zeros((16, at.size)), np.empty((4, at.size))
        set_rates(pair, v, at, rates)
        damp(pair, request.factor, touch, spot, rates, R, K)
        if what == RESISTING:
            spread(pair.dofs, pair.weights, pair.slopes, at, R, out.view(np.complex128))
        else:
            _add_stiffness(pair, request, at, K, out)
    else:
        _answer(pair, request, same, touch, spot, v, out)


@apart("contacts", PAIR, Annotated[Request, MADE], bool, TOUCH, SPOT, F1, F1)
def _answer(pair, request, same, touch, spot, v, out):
    """Add the answer of points that press and rub."""
    what, at, r = request.what, touch.at, response(pair, same, touch)
    n = at.size
    if what == SETTLE:
        _settle(pair, same, touch, spot, r, out)
        return
    if what == FORCE:
        R = np.zeros((4, n))
        add_resistance(touch, r, R)
        spread(pair.dofs, pair.weights, pair.slopes, at, R, out.view(np.complex128))
        return
    # first the derivatives due to directions that turn; (x, y) in row 4 x + y
    K, half = np.zeros((16, n)), 1.0 if same else 0.5
    for i in indices(n):
        normal, t, offset, w = spot.normal[i], spot.slope[i], pair.offsets[at[i]], spot.away[i]
        P, T, s = r.pressure[i], r.friction[i], half * r.spring[i]
        xx, xy, yy = spot.bend[0, i], spot.bend[1, i], spot.bend[2, i]
        a, b = xy * w.real - xx * w.imag, yy * w.real - xy * w.imag  # the tangent at the anchor
        # of the surface point, then of position and slope
        k = ((s * normal.imag * a - P * xx - T * xy, s * normal.imag * b - P * xy - T * yy),
             (T * xx - P * xy - s * normal.real * a, T * xy - P * yy - s * normal.real * b))
        p, q = by_slope(t, offset, vector(1.0, 0.0)), by_slope(t, offset, vector(0.0, 1.0))
        by = (1.0, 0.0, p.real, p.imag), (0.0, 1.0, q.real, q.imag)
        for x in range(4):
            for y in range(4):
                K[4 * x + y, i] = (by[0][x] * (k[0][0] * by[0][y] + k[0][1] * by[1][y])
                                   + by[1][x] * (k[1][0] * by[0][y] + k[1][1] * by[1][y]))
        add_bend(t, offset, scaled(-P, normal) + scaled(T, turned(normal)), i, K)
    add_coupling(touch, r, K)
    if what == ALONG:
        rates, value = np.empty((4, n)), np.zeros(n)
        set_rates(pair, v, at, rates)
        for x in range(4):
            for y in range(4):
                for i in indices(n):
                    value[i] += K[4 * x + y, i] * rates[x, i] * rates[y, i]
        add_each(out, 0 * at, value)
    else:
        _add_stiffness(pair, request, at, K, out)


# what may touch


@source
def search(pair, which, u):
    """Lower bound of the gap of each element, shape (elements,)."""
    rows = np.empty((9, pair.middles.shape[1]))
    x, gap, radius = rows[:2], rows[2], rows[8]
    middles(pair, u, 1.0, x, radius)
    distances(pair, which, False, x, rows[2:8])
    for e in indices(gap.size):
        gap[e] -= radius[e]
    return gap


@source
def _near_points(pair, what, begin, end):
    """Numbers of the points of elements that may touch, from the bounds at both ends."""
    n, reach, law = begin.size, pair.largest[0], pair.law
    if what == SETTLE and law.friction > 0.0:  # and points that may touch next
        reach = BEYOND * law.radius if pair.common[RATE] > 0.0 else FAR
    flags = np.empty(pair.areas.size)
    m = flags.size // n
    for p in range(m):
        flag = flags[p::m]
        for e in indices(n):
            flag[e] = 1.0 * (np.minimum(begin[e], end[e]) <= reach)
    return np.nonzero(flags)[0]


@source
def project(pair, which, u, at):
    """The :class:`Placed` of points."""
    x, t = placed(pair, u, 1.0, at)
    n = at.size
    surface, rows = np.empty(n, np.complex128), np.empty((8, n))
    for i in indices(n):
        surface[i] = outside(x[i], t[i], pair.offsets[at[i]])
        rows[0, i], rows[1, i] = surface[i].real, surface[i].imag
    distances(pair, which, False, rows[:2], rows[2:])
    return Placed(x, t, surface, rows[2])


@source
def _selected(points, some):
    """Some of the points."""
    return Placed(points.x[some], points.t[some], points.surface[some], points.gap[some])


# points in contact


@source
def touch_of(pair, same, a, b, at):
    """Points between two states, which may be one: :class:`Touch` and :class:`Spot`."""
    n, part, poses, law = at.size, 1.0 / stiffness_factor(pair), pair.poses, pair.law
    slope, last, away, normal = (np.empty(n, np.complex128), np.empty(n, np.complex128), np.zeros(
        n, np.complex128), np.empty(n, np.complex128))
    before, after, held, k, place, found = np.empty(n), np.empty(n), np.empty(n), np.empty(
        n), np.empty((2, n)), np.empty((6, n))
    moved, gap, slips, slip, trial, spring, missing = np.empty((4, n)), np.empty((4, n)), np.empty(
        (4, n)), np.zeros(n), np.zeros(n), np.zeros(n), np.empty(n)
    stiffness = pair.softness[0] * law.stiffness * stiffness_factor(pair)
    for i in indices(n):
        x0, x1, end, m = a.x[i], b.x[i], b.surface[i], at[i]
        if not same and pair.moving > 0:  # with the obstacle to its middle pose
            x0 = x0 + carried(poses[NOW], poses[BEGIN], a.surface[i]) - a.surface[i]
            there = carried(poses[NOW], poses[END], end)
            x1, end = x1 + there - end, there
        more = part * pair.multipliers[m]
        before[i], after[i], last[i] = more - a.gap[i], more - b.gap[i], end
        k[i], held[i] = stiffness * pair.areas[m], pair.common[BILATERAL] * more
        put(moved, 0, i, x1 - x0)
        put(moved, 1, i, b.t[i] - a.t[i])
        slope[i] = scaled(0.5, a.t[i] + b.t[i])
        middle = outside(scaled(0.5, x0 + x1), slope[i], pair.offsets[m])
        place[0, i], place[1, i] = middle.real, middle.imag
    distances(pair, NOW, True, place, found)
    for i in indices(n):
        normal[i] = vector(found[1, i], found[2, i])
        put(gap, 0, i, normal[i])
        put(gap, 1, i, by_slope(slope[i], pair.offsets[at[i]], normal[i]))
        put(slips, 0, i, turned(normal[i]))
        put(slips, 1, i, by_slope(slope[i], pair.offsets[at[i]], turned(normal[i])))
    if law.friction > 0.0:
        # the extrapolation damps vibrations on the springs; a mean does so by itself
        more, anchored = 1.0 if same and pair.common[RATE] > 0.0 else 0.0, np.minimum(
            pair.common[ANCHORED], 1.0)
        for i in indices(n):
            m = at[i]
            away[i] = _from_anchor(poses[NOW], last[i], pair.anchors[m])
            slip[i] = cross(normal[i], away[i])
            c = anchored * law.stiffness * (1.0 + pair.stiffening[0]) * pair.areas[m]
            trial[i] = c * (slip[i] + more * (slip[i] - pair.slips[m]))
            spring[i] = c * (1.0 + more)
    if not same:  # with the work of the change of the gap
        product(gap, moved, missing)
        close = (CLOSE * law.radius) ** 2
        for i in indices(n):
            square = moved[0, i] ** 2 + moved[1, i] ** 2 + moved[2, i] ** 2 + moved[3, i] ** 2
            missing[i] = (missing[i] + after[i] - before[i]) * (square > close) / np.maximum(
                square, TINY)
        for x in range(4):
            for i in indices(n):
                gap[x, i] -= missing[i] * moved[x, i]
    return (Touch(at, k, before, after, held, moved, gap, slips, trial, spring),
            Spot(slope, normal, found[3:], place, last, away, slip))


@source
def _from_anchor(pose, x, anchor):
    """The way of a point from an anchor in the obstacle's frame."""
    cos, sin, a, b = pose[2] - 1.0, pose[3], anchor.real - pose[4], anchor.imag - pose[5]
    return vector(x.real - pose[0] - anchor.real - cos * a + sin * b,
                  x.imag - pose[1] - anchor.imag - sin * a - cos * b)


@source
def response(pair, same, touch):
    """Pressures and friction of points of :func:`touch_of`."""
    return respond(touch, transition(pair), pair.law.friction * np.minimum(
        pair.common[ANCHORED], 1.0), 1.0 * (pair.common[ANCHORED] > 1.0), 1.0 if same else 2.0)


@source
def set_rates(pair, v, at, rates):
    """Set velocities of positions and slopes, (4, n)."""
    x, t = placed(pair, v, 0.0, at)
    for i in indices(at.size):
        put(rates, 0, i, x[i])
        put(rates, 1, i, t[i])


@apart("contacts", PAIR, float, TOUCH, SPOT, F2, F2, F2)
def damp(pair, factor, touch, spot, rates, R, K):
    """Set damping forces proportional to the pressure at rates, and their derivatives: those by
    velocities times a factor, and by positions (Hunt and Crossley)."""
    width, damping, pose, speed = transition(pair), pair.law.damping, pair.poses[NOW], np.empty(
        touch.k.size)
    product(touch.gap, rates, speed)
    for i in indices(speed.size):
        n, k, a = spot.normal[i], touch.k[i], touch.before[i]
        right, up = spot.place[0, i] - pose[0] - pose[4], spot.place[1, i] - pose[1] - pose[5]
        obstacle = vector(pose[6] - pose[8] * up, pose[7] + pose[8] * right)
        # the share of the pressure that is lost, at most all
        loss = np.minimum(damping * (speed[i] - dot(n, obstacle)), 1.0)
        P = k * mean_pressure(a, a, width)
        c = factor * P * damping * (loss < 1.0) - loss * k * pressure_slope(a, width)
        for x in range(4):
            R[x, i] = P * loss * touch.gap[x, i]
            for y in range(4):
                K[4 * x + y, i] = c * touch.gap[x, i] * touch.gap[y, i]
        add_bend(spot.slope[i], pair.offsets[touch.at[i]], scaled(P * loss, n), i, K)


# history data


@source
def _settle(pair, same, touch, spot, r, out):
    """Move anchors of slipping points to the limit of sticking; add the work to ``out[0]``."""
    pose, lost, augmented = pair.poses[NOW], np.empty(touch.k.size), pair.law.tolerance > 0.0
    friction = pair.law.friction * np.minimum(pair.common[ANCHORED], 1.0) / (
        pair.law.stiffness * (1.0 + pair.stiffening[0]))
    product(touch.slip, touch.moved, lost)
    for i in indices(lost.size):
        m, n, last, slip = touch.at[i], spot.normal[i], spot.last[i], spot.slip[i]
        if same:
            lost[i] = slip - pair.slips[m]
        lost[i] *= r.friction[i]
        if augmented:
            lost[i] += r.pressure[i] * (touch.after[i] - touch.before[i])
        limit = friction * r.pressure[i] / pair.areas[m]
        after, _ = return_mapping(slip, np.maximum(
            (1.0 - INSIDE) * limit - NOWHERE * pair.law.radius, 0.0))
        x, y = last.real + after * n.imag - pose[0], last.imag - after * n.real - pose[1]
        a, b, cos, sin = x - pose[4], y - pose[5], pose[2] - 1.0, pose[3]
        pair.slips[m] = after
        pair.anchors[m] = vector(x + cos * a + sin * b, y + cos * b - sin * a)
    add_each(out, 0 * touch.at, lost)


@source
def _augment(pair, at, depth, out):
    """Increase multipliers by penetrations, decrease them by gaps, beyond the tolerance."""
    tolerance, multipliers, largest = pair.law.tolerance, pair.multipliers, pair.largest
    if tolerance == 0.0:
        return
    where, far, square, k = 0 * at, np.empty(at.size), np.empty(at.size), stiffness_factor(pair)
    for i in indices(at.size):
        before = multipliers[at[i]] / k
        change = np.maximum(depth[i], 0.0) - before
        far[i] = 1.0 * (np.abs(change) > tolerance)
        after = k * (before + far[i] * change)
        multipliers[at[i]] = after
        square[i] = after * after
    add_each(out, where, far)
    largest[0] = 0.0
    add_each(largest, where, square)
    largest[0] = np.sqrt(largest[0])  # no less than it


@apart("contacts", PAIR, Annotated[Request, MADE], I1, F2, F1)
def _add_stiffness(pair, request, at, S, flat):
    """Add the derivatives to a band matrix, or its lower half if only that is stored."""
    value, where, n = np.empty(at.size), request.ld * 2 * pair.dofs[0][at], 2 * len(pair.weights)
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
