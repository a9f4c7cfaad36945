"""Contact of the surface of beams with obstacles, as texts.

A point of the surface is ``X = x + c n(s)``: a place x of the body, and for cables, whose surface
is no coordinate, the normal n of the slope s of the axis at a distance c. An obstacle has a signed
distance g(X), negative inside. Of the penetration ``a = -g`` each point has the potential
``k A S(a)`` with its area A in the stress-free body and::

    S(a) = (<a>^3 - <a - w>^3) / (6 w),   <a> = max(a, 0)

which is ``a^2 / 2`` but for a transition of the width w that makes it twice continuously
differentiable. Where a motion keeps the energy, the force is a mean between two states whose work
is the change of the potential: the discrete gradient of Gonzalez (1996) of g, times the slope of S
between them.

Friction is a spring along the surface from an anchor to the point, which gives way at Coulomb's
limit: the anchor then follows, where a load step or a time step is accepted. In a mean the spring
is that of the end, so that what vibrates on it comes to rest.

Of the augmented Lagrangian each point has a reach r, and the penetration is ``a = r - g``: where a
point ends below the surface its reach grows by that, until its pressure holds it on the surface. In
a motion this takes few corrections if the stiffness is not small beside that of the mass in a
step: it is grown by ``INERTIA`` over the square of the step.

Points are in groups: those of one beam at one obstacle. A search asks first for the distance of
the middle of each element, and whether its points may be as far as that from it.
"""

from typing import NamedTuple

import numpy as np

from ...core.band import clear, copy, differs
from ...core.callbacks import own_distance
from ...core.source import F1, I1, lanes, primitive, source
from ..tables import add_each

#: Shapes, by their number: circles and lines are polygons.
OUTLINE, OWN = range(2)
#: What is asked of all groups.
FORCE, RESISTING, TANGENT, DAMPED_TANGENT, ALONG, SETTLE, AUGMENT = map(np.int64, range(7))
#: Of a group: its shape, obstacle, elements, points of each, pairs of coordinates of each, whether
#: there are slopes; then where among the integers the first coordinates of its points begin, among
#: the numbers the rest, and how many numbers the shape has; where its memory
#: begins, and its number; where its looks are, how large each is, the first coordinate of its
#: elements, and how many there are.
(SHAPE, OBSTACLE, ELEMENTS, POINTS, PAIRS, SLOPES, FIRST, WEIGHTS, AREAS, OFFSETS, STARTS, MIDDLES,
 NUMBERS, SHAPES, SIZE, MEMORY, GROUP, LOOKS, LOOK, LOWEST, SPAN) = map(np.int64, range(21))
HEADER = 21
#: Numbers of a group: stiffness, width of the transition, friction, stiffness of sticking,
#: damping, what a step in time adds to the stiffness, largest distance of a point from the middle
#: of its element without displacement, 1 or -1 outside or inside of the shape, and the penetration
#: that the augmented Lagrangian leaves, zero for the penalty.
STIFFNESS, WIDTH, FRICTION, STICKING, DAMPING, INERTIA, RADIUS, SIDE, TOLERANCE = range(9)
#: Where an obstacle is: its displacement, the cosine and sine of its angle, the point about which
#: it turns, its velocities, and when. Of each there are three: at a time, and for a mean at the
#: begin and the end.
POSE, POSES = 10, 30
NOW, BEGIN, END = map(np.int64, range(3))
#: Memory: 1 if points stick to anchors; 1 / dt^2 of the last step in time; 1 if points are held:
#: where pressure reaches beyond the surface, it pulls there; for each group how far that is, and by
#: how much it is stiffer than by default; for each point its reach, its anchor, and how far it was
#: from that along the surface at the last step.
ANCHORED, RATE, HOLDS, REACHES = range(4)
#: What is kept from step to step: anchors, reaches.
ANCHORS, PRESSURES = 1, 2
TINY = 1e-200
#: The least square of a slope: sections have none, and levers of no length.
SHORT = 1e-30
#: How far from the surface anchors follow points in a motion, relative to an element.
BEYOND = 4.0
#: A change of places, relative to an element, below which a mean is that of the middle.
CLOSE = 1e-5
#: Rows of points: places and slopes, four each, in the middle of a mean, and their rates or ways;
#: the penetration at both ends, and the place on the surface at the end; the rate or way of the
#: surface.
MIDDLE, RATES, DEPTH, LAST, WAY = map(np.int64, (0, 4, 8, 10, 12))
ROWS = 14
#: What is seen of each point: place, slope, point of the surface, distance, and that it was looked
#: at. Of both ends of a mean and of a single state a group keeps a look: of which coordinates and
#: pose, of each element the distance less the radius, then what was seen.
SEEN, ALONE = 8, np.int64(2)


class Question(NamedTuple):
    """What is asked of all groups.

    Attributes
    ----------
    what
        FORCE: the mean force from u to v. RESISTING: that of friction and damping at u by the
        velocity v. TANGENT: the derivative of FORCE by the end of the mean, twice unless there is
        no span, to a band. DAMPED_TANGENT: that of RESISTING by velocities times the factor,
        and by places. ALONG: the derivative of the work of FORCE at u along a direction v to
        ``out[0]``, and the largest way of an element along it, in lengths of elements, into
        ``out[1]``. SETTLE: anchors follow after a step from u to v, whose friction and augmented
        pressures add their work to ``out[0]``. AUGMENT: where points at u are too deep pressures
        reach on, and their number is added to ``out[0]``.
    t, span
        A time, and for a mean how long it is about it; zero at u alone.
    factor
        Of derivatives by velocities.
    ld, top
        Layout of the band.
    """

    what: int
    t: float
    span: float
    factor: float
    ld: int
    top: int


class ContactTables(NamedTuple):
    """The obstacles of a scene.

    Attributes
    ----------
    number
        Of groups; 0 for a scene without obstacles.
    ints, floats
        All that is above, the headers of the groups first.
    poses
        Of each obstacle, at the time asked last.
    memory
        What steps leave behind.
    looks
        What was seen last, so that it is not looked at again.
    counts
        Elements searched, points looked at, and of each group which look is that of the begin.
    moving, own
        Whether poses depend on time; handle of what knows them, and shapes of one's own.
    lasting
        Sum of what is kept from step to step: ANCHORS, PRESSURES.
    address
        That of the compiled :func:`of_contacts`; 0 for plain texts.
    """

    number: int
    ints: I1
    floats: F1
    poses: F1
    memory: F1
    looks: F1
    counts: I1
    moving: int
    own: int
    lasting: int = 0
    address: int = 0


@source
def of_contacts(tables, asked, u, v, out):
    """Add what is asked of all groups, a :class:`Question`."""
    for k in range(tables.number):
        _of_group(tables, tables.ints[k * HEADER:(k + 1) * HEADER], asked, u, v, out)


@primitive("skfem_ancf.equations.loops")
def run_contacts(tables, asked, u, v, out):
    """As :func:`of_contacts`; compiled once, and not anew in each text that calls it."""
    of_contacts(tables, asked, u, v, out)


# where points are


@source
def _middles(ints, floats, group, u, factor, x, radius):
    """The middle of each element's points, and how far from it they may be.

    Of the places without displacement, times the factor, and what u adds to them.
    """
    n, pairs, every = group[ELEMENTS], group[PAIRS], group[POINTS]
    half, row, largest = pairs // 2, group[MIDDLES], floats[group[NUMBERS] + RADIUS]
    first = ints[group[FIRST]:group[FIRST] + n * every:every]
    p, q = floats[row:row + n], floats[row + n:row + 2 * n]
    for e in lanes(n):
        x[0, e], x[1, e], radius[e] = factor * p[e], factor * q[e], largest
    for k in range(pairs):
        row += 2 * n
        p, q = floats[row:row + n], floats[row + n:row + 2 * n]
        for e in lanes(n):
            a, b = u[first[e] + 2 * k], u[first[e] + (2 * k + 1)]
            x[0, e] += p[e] * a
            x[1, e] += p[e] * b
            # both places of an element together are a translation
            c = a - u[first[e]] * (k == half)
            d = b - u[first[e] + 1] * (k == half)
            radius[e] += q[e] * np.sqrt(c * c + d * d)


@source
def places(ints, floats, group, u, factor, at, rows, r):
    """Places and slopes at points ``at`` of a group, without displacement times a factor.

    Pairs of coordinates are two of each node, or more in twos.
    """
    total = group[ELEMENTS] * group[POINTS]
    weights, start, first = group[WEIGHTS], group[STARTS], group[FIRST]
    for c in range(4):
        row = rows[r + c]
        for i in lanes(at.size):
            row[i] = factor * floats[start + c * total + at[i]]
    for part in range(1 + group[SLOPES]):
        p, q = rows[r + 2 * part], rows[r + (2 * part + 1)]
        for k in range(group[PAIRS] // 2):
            for i in lanes(at.size):
                dof = ints[first + at[i]] + 4 * k
                a, b = floats[weights + at[i]], floats[weights + total + at[i]]
                p[i] += a * u[dof] + b * u[dof + 2]
                q[i] += a * u[dof + 1] + b * u[dof + 3]
            weights += 2 * total


@source
def surface(floats, group, at, rows, r, x):
    """The points of the surface, of places and slopes."""
    p, q, offset = rows[r], rows[r + 1], group[OFFSETS]
    s, t = rows[r + 2], rows[r + 3]
    for i in lanes(at.size):
        c = floats[offset + at[i]] / np.sqrt(np.maximum(s[i] * s[i] + t[i] * t[i], SHORT))
        x[0, i], x[1, i] = p[i] - c * t[i], q[i] + c * s[i]


@source
def _looked(tables, group, look, which, u, anew):
    """Where a look begins, and whether it was of u; if ``anew`` it is now."""
    n, span, low = group[ELEMENTS], group[SPAN], group[LOWEST]
    begin, now = group[LOOKS] + look * group[LOOK], group[OBSTACLE] * POSES + which * POSE
    at, pose = u[low:low + span], tables.poses[now:now + POSE]
    of, when = tables.looks[begin:begin + span], tables.looks[begin + span:begin + span + POSE]
    known = not (differs(at, of) or differs(pose, when))
    if anew and not known:
        copy(at, of)
        copy(pose, when)
        rows = np.empty((9, n))
        x, found, radius = rows[:2], rows[2:8], rows[8]
        _middles(tables.ints, tables.floats, group, u, 1.0, x, radius)
        distances(tables, group, which, False, x, found)
        total, gap = n * group[POINTS], tables.looks[begin + span + POSE:]
        for e in lanes(n):
            gap[e] = found[0, e] - radius[e]
        clear(gap[n + (SEEN - 1) * total:n + SEEN * total])
        tables.counts[0] += n
    return begin + span + POSE, known


@source
def _both(tables, group, same, u, v):
    """Where the looks of u and v are; the end of a step is the begin of the next."""
    if same:
        begin, _ = _looked(tables, group, ALONE, NOW, u, True)
        return begin, begin
    turn = 2 + group[GROUP]
    begin, known = _looked(tables, group, tables.counts[turn], BEGIN, u, False)
    if not known:
        tables.counts[turn] = 1 - tables.counts[turn]
        begin, _ = _looked(tables, group, tables.counts[turn], BEGIN, u, True)
    end, _ = _looked(tables, group, 1 - tables.counts[turn], END, v, True)
    return begin, end


@source
def _near(tables, group, what, begin, end):
    """Numbers of the points of elements that may touch at either end."""
    n, points = group[ELEMENTS], group[POINTS]
    reach, numbers = tables.memory[REACHES + group[GROUP]], group[NUMBERS]
    if what == SETTLE and tables.floats[numbers + FRICTION] > 0.0:  # also what may touch next
        reach = BEYOND * tables.floats[numbers + RADIUS] if tables.memory[RATE] > 0.0 else 1e300
    flags, gap, last = np.empty(n * points), tables.looks[begin:begin + n], tables.looks[
        end:end + n]
    for p in range(points):
        flag = flags[p::points]
        for e in lanes(n):
            flag[e] = 1.0 * (np.minimum(gap[e], last[e]) <= reach)
    return np.nonzero(flags)[0]


@source
def _see(tables, group, which, look, u, near):
    """Look at those of some points that were not looked at yet."""
    total, begin = group[ELEMENTS] * group[POINTS], look + group[ELEMENTS]
    seen, flags = tables.looks[begin:begin + SEEN * total], np.empty(near.size)
    for i in lanes(near.size):
        flags[i] = 1.0 - seen[7 * total + near[i]]
    new = np.nonzero(flags)[0]
    if new.size == 0:
        return
    for i in lanes(new.size):
        new[i] = near[new[i]]
    rows = np.empty((12, new.size))
    z, x, found = rows[:4], rows[4:6], rows[6:]
    places(tables.ints, tables.floats, group, u, 1.0, new, z, 0)
    surface(tables.floats, group, new, z, 0, x)
    distances(tables, group, which, False, x, found)
    for c in range(4):
        row, part = seen[c * total:(c + 1) * total], z[c]
        for i in lanes(new.size):
            row[new[i]] = part[i]
    for i in lanes(new.size):
        seen[4 * total + new[i]], seen[5 * total + new[i]] = x[0, i], x[1, i]
        seen[6 * total + new[i]], seen[7 * total + new[i]] = found[0, i], 1.0
    tables.counts[1] += new.size


@source
def _stride(tables, group, u):
    """The largest way of the middle of an element, relative to how far its points are from it."""
    n, way = group[ELEMENTS], 0.0
    rows = np.empty((3, n))
    x = rows[:2]
    _middles(tables.ints, tables.floats, group, u, 0.0, x, rows[2])
    for e in range(n):
        way = max(way, x[0, e] * x[0, e] + x[1, e] * x[1, e])
    return np.sqrt(way) / tables.floats[group[NUMBERS] + RADIUS]


# shapes


@source
def distances(tables, group, which, whole, x, out):
    """Distance, its gradient and second derivatives xx, xy, yy at points x, shape (6, n).

    Derivatives where ``whole`` is true.
    """
    row = group[OBSTACLE] * POSES + which * POSE
    pose, y = tables.poses[row:row + POSE], np.empty(x.shape)
    cos, sin = pose[2], pose[3]
    px, py = pose[4], pose[5]
    for i in lanes(x.shape[1]):
        a, b = x[0, i] - pose[0] - px, x[1, i] - pose[1] - py
        y[0, i], y[1, i] = cos * a + sin * b + px, cos * b - sin * a + py
    if group[SHAPE] == OWN:
        own_distance(tables.own, group[OBSTACLE], pose[9], y, out)
    else:
        outline(tables.floats[group[SHAPES]:group[SHAPES] + group[SIZE]], whole, y, out)
    side = tables.floats[group[NUMBERS] + SIDE]
    for i in lanes(x.shape[1]):
        out[0, i] *= side
    if not whole:
        return
    for i in lanes(x.shape[1]):
        a, b = side * out[1, i], side * out[2, i]
        p, q, r = side * out[3, i], side * out[4, i], side * out[5, i]
        out[1, i], out[2, i] = cos * a - sin * b, sin * a + cos * b
        c, d = 0.5 * (p + r), 0.5 * (p - r)
        e, f = (cos * cos - sin * sin) * d - 2.0 * cos * sin * q, 2.0 * cos * sin * d + (
            cos * cos - sin * sin) * q
        out[3, i], out[4, i], out[5, i] = c + e, f, c - e


@source
def outline(numbers, whole, y, out):
    """Numbers: radius of the corners, where edges begin and end in parts of their lengths, then of
    each corner: place, edge to the next, 1 or -1 if it is convex or not.

    Next to an edge it is a line, next to a corner a circle.
    """
    radius, low, high = numbers[0], numbers[1], numbers[2]
    n, best = (numbers.size - 3) // 5, np.empty(y.shape[1])
    for c in range(6 if whole else 1):
        row = out[c]
        for i in lanes(y.shape[1]):
            best[i] = 1e300
            row[i] = 0.0
    for k in range(n):
        p, after = numbers[3 + 5 * k:8 + 5 * k], numbers[7 + 5 * ((k + 1) % n)]
        px, py, before = p[0], p[1], p[4]
        ex, ey = p[2], p[3]
        square = np.maximum(ex * ex + ey * ey, TINY)
        nx, ny = ey / np.sqrt(square), -ex / np.sqrt(square)
        for i in lanes(y.shape[1]):
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


# the law


@source
def curvature_of(a, width):
    """S''(a)."""
    return (np.maximum(a, 0.0) - np.maximum(a - width, 0.0)) / width


@source
def mean_slope(a, b, width):
    """(S(b) - S(a)) / (b - a), and S'(a) where they are the same: without differences of S."""
    return (_mean_cube(a, b) - _mean_cube(a - width, b - width)) / (6.0 * width)


@source
def _mean_cube(a, b):
    """(<b>^3 - <a>^3) / (b - a)."""
    p, q = np.maximum(a, 0.0), np.maximum(b, 0.0)
    same = np.abs(b - a) < TINY
    share = (q - p) / (b - a + same) * (1.0 - same) + same * (a > 0.0)
    return (p * p + p * q + q * q) * share


# forces


@source
def _of_group(tables, group, asked, u, v, out):
    """Add what is asked, of the points that touch."""
    what, same = asked.what, asked.span == 0.0
    rubs = what == RESISTING or what == DAMPED_TANGENT
    if what == ALONG:
        out[1] = max(out[1], _stride(tables, group, v))
    if rubs and tables.floats[group[NUMBERS] + DAMPING] == 0.0:
        return
    begin, end = _both(tables, group, same, u, v)
    at = _near(tables, group, what, begin, end)
    if at.size == 0:
        return
    _see(tables, group, NOW if same else BEGIN, begin, u, at)
    if not same:
        _see(tables, group, END, end, v, at)
    touching = at if what >= SETTLE else _touching(tables, group, begin, end, at)
    n = touching.size
    if n == 0:
        return
    rows = np.empty((ROWS + 25, n))
    some, x, found = rows[:ROWS], rows[ROWS:ROWS + 2], rows[ROWS + 2:ROWS + 8]
    F, K, lever = rows[ROWS + 8:ROWS + 13], rows[ROWS + 13:ROWS + 17], rows[ROWS + 17:]
    _ends(tables, group, begin, end, same, touching, some)
    if what == AUGMENT:
        _reach_on(tables, group, touching, some, out)
        return
    surface(tables.floats, group, touching, some, MIDDLE, x)
    distances(tables, group, NOW, True, x, found)
    levers(tables.floats, group, touching, some, lever)
    if what == ALONG or rubs:
        places(tables.ints, tables.floats, group, v, 0.0, touching, some, RATES)
        slide(lever, some)
    if rubs:
        resist(tables, group, asked.factor, touching, some, x, found, F, K)
    else:
        press(tables, group, touching, some, found, F, K)
        if what == FORCE or what == SETTLE:
            _keep_work(tables.floats[group[NUMBERS] + RADIUS], some, lever, F)
        if what == SETTLE or tables.memory[ANCHORED] * tables.floats[
                group[NUMBERS] + FRICTION] > 0.0:
            stick(tables, group, what == SETTLE, same, touching, some, found, F, K, out)
        if what == SETTLE:
            return
    _add(tables.ints, tables.floats, group, asked, touching, some, lever, F, K, out)


@source
def _touching(tables, group, begin, end, at):
    """Those of some points that touch at either end."""
    n, total = group[ELEMENTS], group[ELEMENTS] * group[POINTS]
    first, last = begin + n + 6 * total, end + n + 6 * total
    part = 1.0 / hardened(tables, group)
    reach, flags = group[MEMORY], np.empty(at.size)
    for i in lanes(at.size):
        flags[i] = 1.0 * (np.minimum(tables.looks[first + at[i]], tables.looks[last + at[i]])
                          < part * tables.memory[reach + at[i]])
    touching = np.nonzero(flags)[0]
    for i in lanes(touching.size):
        touching[i] = at[touching[i]]
    return touching


@source
def _ends(tables, group, begin, end, same, at, rows):
    """Fill the rows of points by what is seen at both ends."""
    n, total = group[ELEMENTS], group[ELEMENTS] * group[POINTS]
    reach, part = group[MEMORY], 1.0 / hardened(tables, group)
    for c in range(4):
        first, last = begin + n + c * total, end + n + c * total
        middle, way = rows[MIDDLE + c], rows[RATES + c]
        for i in lanes(at.size):
            middle[i] = tables.looks[first + at[i]]
            way[i] = tables.looks[last + at[i]] - middle[i]
    before, after = rows[DEPTH], rows[DEPTH + 1]
    last_x, last_y = rows[LAST], rows[LAST + 1]
    first, last = begin + n + 4 * total, end + n + 4 * total
    for i in lanes(at.size):
        more = part * tables.memory[reach + at[i]]
        before[i] = more - tables.looks[first + 2 * total + at[i]]
        after[i] = more - tables.looks[last + 2 * total + at[i]]
        last_x[i], last_y[i] = tables.looks[last + at[i]], tables.looks[last + total + at[i]]
    if same:
        return
    if tables.moving > 0:
        _carry(tables, group, first, BEGIN, at, rows)
        _carry(tables, group, last, END, at, rows)
    for c in range(4):
        middle, way = rows[MIDDLE + c], rows[RATES + c]
        for i in lanes(at.size):
            middle[i] += 0.5 * way[i]


@source
def _carry(tables, group, where, which, at, rows):
    """Move points with the obstacle, from where it was or will be to where it is."""
    now, total = group[OBSTACLE] * POSES, group[ELEMENTS] * group[POINTS]
    p = tables.poses[now + which * POSE:now + (which + 1) * POSE]
    q, end = tables.poses[now:now + POSE], 1.0 * (which == END)
    cos, sin = q[2] * p[2] + q[3] * p[3], q[3] * p[2] - q[2] * p[3]
    middle_x, middle_y = rows[MIDDLE], rows[MIDDLE + 1]
    way_x, way_y = rows[RATES], rows[RATES + 1]
    last_x, last_y = rows[LAST], rows[LAST + 1]
    for i in lanes(at.size):
        x, y = tables.looks[where + at[i]], tables.looks[where + total + at[i]]
        a, b = x - p[0] - p[4], y - p[1] - p[5]
        x, y = q[0] + q[4] + cos * a - sin * b - x, q[1] + q[5] + sin * a + cos * b - y
        middle_x[i] += (1.0 - end) * x
        middle_y[i] += (1.0 - end) * y
        way_x[i] += (2.0 * end - 1.0) * x
        way_y[i] += (2.0 * end - 1.0) * y
        last_x[i] += end * x
        last_y[i] += end * y


@source
def levers(floats, group, at, rows, lever):
    """The derivative of the surface by place and slope: xx, xy, and xs; yx, yy and ys."""
    p, q, offset = rows[MIDDLE + 2], rows[MIDDLE + 3], group[OFFSETS]
    for i in lanes(at.size):
        s, t = p[i], q[i]
        square = np.maximum(s * s + t * t, SHORT)
        c = floats[offset + at[i]] / square / np.sqrt(square)
        lever[0, i], lever[1, i] = 1.0, 0.0
        lever[2, i], lever[3, i] = c * s * t, -c * s * s
        lever[4, i], lever[5, i] = 0.0, 1.0
        lever[6, i], lever[7, i] = c * t * t, -c * s * t


@source
def slide(lever, rows):
    """How a point of the surface moves, of the rates of its place and slope."""
    s, t = rows[RATES + 2], rows[RATES + 3]
    for k in range(2):
        way, rate = rows[WAY + k], rows[RATES + k]
        p, q = lever[4 * k + 2], lever[4 * k + 3]
        for i in lanes(way.size):
            way[i] = rate[i] + p[i] * s[i] + q[i] * t[i]


@source
def hardened(tables, group):
    """How many times the stiffness is as large as given, by what a load has found or in a step."""
    numbers = group[NUMBERS]
    return (1.0 + tables.memory[REACHES + tables.number + group[GROUP]]
            + tables.floats[numbers + INERTIA] * tables.memory[RATE]
            / tables.floats[numbers + STIFFNESS])


@source
def press(tables, group, at, rows, found, F, K):
    """The pressure: F is force, pressure twice and stiffness; K is xx, xy, yx, yy of the point."""
    numbers, area = tables.floats[group[NUMBERS]:group[NUMBERS] + 9], group[AREAS]
    part = hardened(tables, group)
    k, holds, reach = numbers[STIFFNESS] * part, tables.memory[HOLDS] / part, group[MEMORY]
    width, before, after = numbers[WIDTH], rows[DEPTH], rows[DEPTH + 1]
    for i in lanes(at.size):
        a, b, scale = before[i], after[i], k * tables.floats[area + at[i]]
        jump = b - a
        pressure = scale * (mean_slope(a, b, width) - holds * tables.memory[reach + at[i]])
        apart = 1.0 * (np.abs(jump) > 1e-3 * (width + np.abs(a) + np.abs(b)))
        c = (scale * curvature_of(0.5 * (a + b), width) * (1.0 - apart)
             + 2.0 * (scale * mean_slope(b, b, width) - pressure) * apart / (jump + (1.0 - apart)))
        x, y = found[1, i], found[2, i]
        F[0, i], F[1, i], F[2, i] = -pressure * x, -pressure * y, pressure
        F[3, i], F[4, i] = pressure, c
        K[0, i], K[3, i] = c * x * x - pressure * found[3, i], c * y * y - pressure * found[5, i]
        K[1, i] = c * x * y - pressure * found[4, i]
        K[2, i] = K[1, i]


@source
def stick(tables, group, settles, same, at, rows, found, F, K, out):
    """Add friction; or let anchors follow, and add to ``out[0]`` what is taken."""
    numbers, area = tables.floats[group[NUMBERS]:group[NUMBERS] + 9], group[AREAS]
    now, total, anchor = group[OBSTACLE] * POSES, group[ELEMENTS] * group[POINTS], group[MEMORY]
    pose, friction = tables.poses[now:now + POSE], numbers[FRICTION] * tables.memory[ANCHORED]
    last_x, last_y = rows[LAST], rows[LAST + 1]
    way_x, way_y = rows[WAY], rows[WAY + 1]
    where, lost = np.empty(at.size, np.int64), np.empty(at.size)
    augmented, first = numbers[TOLERANCE] > 0.0, REACHES + tables.number + group[GROUP]
    sticking = numbers[STICKING] * (1.0 + tables.memory[first])
    # what vibrates on the springs comes to rest: in a mean by itself
    calms = 1.0 if same and tables.memory[RATE] > 0.0 else 0.0
    for i in lanes(at.size):
        nx, ny = found[1, i], found[2, i]
        x, y = last_x[i] - pose[0] - pose[4], last_y[i] - pose[1] - pose[5]
        a = tables.memory[anchor + total + at[i]] - pose[4]
        b = tables.memory[anchor + 2 * total + at[i]] - pose[5]
        slip = ((y - pose[3] * a - pose[2] * b) * nx - (x - pose[2] * a + pose[3] * b) * ny)
        before = tables.memory[anchor + 3 * total + at[i]]
        k, limit = sticking * tables.floats[area + at[i]], friction * F[3, i]
        pull = k * (slip + calms * (slip - before))
        T = np.minimum(np.maximum(pull, -limit), limit)
        sticks = 1.0 * (np.abs(pull) < limit)
        if settles:
            where[i] = 0 * at[i]
            lost[i] = T * (slip - before if same else way_y[i] * nx - way_x[i] * ny)
            if augmented:
                lost[i] += F[0, i] * way_x[i] + F[1, i] * way_y[i] + F[2, i] * F[4, i]
            after = np.minimum(np.maximum(slip, -limit / k), limit / k)
            x, y = x + after * ny, y - after * nx
            tables.memory[anchor + 3 * total + at[i]] = after
            tables.memory[anchor + total + at[i]] = pose[2] * x + pose[3] * y + pose[4]
            tables.memory[anchor + 2 * total + at[i]] = pose[2] * y - pose[3] * x + pose[5]
        change = friction * np.sign(pull) * (1.0 - sticks) * F[4, i]
        c = (1.0 + calms if same else 2.0) * k * sticks
        F[0, i] -= T * ny
        F[1, i] += T * nx
        K[0, i] += c * ny * ny + change * ny * nx - T * found[4, i]
        K[1, i] += change * ny * ny - c * nx * ny - T * found[5, i]
        K[2, i] += T * found[3, i] - c * nx * ny - change * nx * nx
        K[3, i] += c * nx * nx - change * nx * ny + T * found[4, i]
    if settles:
        add_each(out, where, lost)


@source
def _reach_on(tables, group, at, rows, out):
    """Reaches grow by the penetration, and shrink by the distance, where these are too large."""
    tolerance, first = tables.floats[group[NUMBERS] + TOLERANCE], group[MEMORY]
    if tolerance == 0.0:
        return
    where, far, square = np.empty(at.size, np.int64), np.empty(at.size), np.empty(at.size)
    depth, k = rows[DEPTH], hardened(tables, group)
    for i in lanes(at.size):
        before = tables.memory[first + at[i]] / k
        change = np.maximum(depth[i], 0.0) - before
        where[i], far[i] = 0 * at[i], 1.0 * (np.abs(change) > tolerance)
        after = k * (before + far[i] * change)
        tables.memory[first + at[i]] = after
        square[i] = after * after
    add_each(out, where, far)
    widest = tables.memory[REACHES + group[GROUP]:REACHES + group[GROUP] + 1]
    widest[0] = 0.0
    add_each(widest, where, square)
    widest[0] = np.sqrt(widest[0])  # no less than the largest


@source
def resist(tables, group, factor, at, rows, x, found, F, K):
    """Damping in proportion to the pressure."""
    numbers, area = tables.floats[group[NUMBERS]:group[NUMBERS] + 9], group[AREAS]
    now, rate_x, rate_y = group[OBSTACLE] * POSES, rows[WAY], rows[WAY + 1]
    stiffness = numbers[STIFFNESS] * hardened(tables, group)
    pose, depth = tables.poses[now:now + POSE], rows[DEPTH]
    for i in lanes(at.size):
        k, a = stiffness * tables.floats[area + at[i]], depth[i]
        nx, ny = found[1, i], found[2, i]
        pressure = k * mean_slope(a, a, numbers[WIDTH])
        p = rate_x[i] + pose[8] * (x[1, i] - pose[1] - pose[5]) - pose[6]
        q = rate_y[i] - pose[8] * (x[0, i] - pose[0] - pose[4]) - pose[7]
        loss = np.minimum(numbers[DAMPING] * (p * nx + q * ny), 1.0)
        F[0, i], F[1, i], F[2, i] = pressure * loss * nx, pressure * loss * ny, 0.0
        c = (factor * pressure * numbers[DAMPING] * (loss < 1.0)
             - loss * k * curvature_of(a, numbers[WIDTH]))
        K[0, i], K[1, i] = c * nx * nx, c * nx * ny
        K[2, i], K[3, i] = c * ny * nx, c * ny * ny


@source
def _keep_work(size, rows, lever, F):
    """By how much of their way forces miss that their work is what the potential changes by.

    Into F in place of the first pressure; the square of the way in place of the stiffness.
    """
    before, after = rows[DEPTH], rows[DEPTH + 1]
    p, q = rows[RATES], rows[RATES + 1]
    s, t = rows[RATES + 2], rows[RATES + 3]
    slide(lever, rows)
    way_x, way_y, close = rows[WAY], rows[WAY + 1], CLOSE * size
    for i in lanes(p.size):
        square = p[i] * p[i] + q[i] * q[i] + s[i] * s[i] + t[i] * t[i]
        missing = F[2, i] * (after[i] - before[i]) - F[0, i] * way_x[i] - F[1, i] * way_y[i]
        F[2, i] = missing * (square > close * close) / np.maximum(square, TINY)
        F[4, i] = square


# from points to coordinates


@source
def _add(ints, floats, group, asked, at, rows, lever, F, K, out):
    """Add forces on points of the surface, or their derivatives, to those of coordinates."""
    pairs, slopes, total = group[PAIRS], group[SLOPES], group[ELEMENTS] * group[POINTS]
    what, first, weights = asked.what, group[FIRST], group[WEIGHTS]
    n, offset, further = at.size, group[OFFSETS], pairs * total * slopes
    work, where = np.empty((8 + 4 * pairs, n)), np.empty(n, np.int64)
    value, H, G, V = work[0], work[1:4], work[4:8], work[8:]
    forces = what == FORCE or what == RESISTING
    if forces:
        for c in range(4):
            b_x, b_y = lever[c], lever[4 + c]
            way, pull = rows[RATES + c], G[c]
            for i in lanes(n):
                pull[i] = b_x[i] * F[0, i] + b_y[i] * F[1, i] + way[i] * F[2, i]
    for i in lanes(n):
        where[i] = ints[first + at[i]] * (1 if forces else asked.ld)
    for a in range(2 * pairs):
        row, c = weights + (a // 2) * total, a % 2
        if forces:
            pull, turn = G[c], G[2 + c]
            for i in lanes(n):  # without slopes their levers are zero
                value[i] = floats[row + at[i]] * pull[i] + floats[row + further + at[i]] * turn[i]
            add_each(out[a:], where, value)
        else:
            V_x, V_y = V[2 * a], V[2 * a + 1]
            b_x, b_y = lever[c], lever[4 + c]
            s_x, s_y = lever[2 + c], lever[6 + c]
            for i in lanes(n):
                p, q = floats[row + at[i]], floats[row + further + at[i]]
                V_x[i], V_y[i] = p * b_x[i] + q * s_x[i], p * b_y[i] + q * s_y[i]
    if forces:
        return
    s_x, s_y = rows[MIDDLE + 2], rows[MIDDLE + 3]
    K0, K1 = K[0], K[1]
    K2, K3 = K[2], K[3]
    for i in lanes(n):
        s, t = s_x[i], s_y[i]
        square = np.maximum(s * s + t * t, SHORT)
        c = floats[offset + at[i]] / square / square / np.sqrt(square)
        across, both = -c * (F[1, i] * s - F[0, i] * t), c * (F[0, i] * s + F[1, i] * t)
        H[0, i] = across * t * t - 2.0 * both * s * t
        H[1, i] = both * (s * s - t * t) - across * s * t
        H[2, i] = across * s * s + 2.0 * both * s * t
    if what == ALONG:
        V_x, V_y = rows[WAY], rows[WAY + 1]
        s_x, s_y = rows[RATES + 2], rows[RATES + 3]
        for i in lanes(n):
            x, y = V_x[i], V_y[i]
            s, t = s_x[i], s_y[i]
            where[i] = 0 * at[i]
            value[i] = (x * (K0[i] * x + K1[i] * y) + y * (K2[i] * x + K3[i] * y)
                        + H[0, i] * s * s + 2.0 * H[1, i] * s * t + H[2, i] * t * t)
        add_each(out, where, value)
        return
    P_x, P_y = G[0], G[1]
    for a in range(2 * pairs):
        V_x, V_y = V[2 * a], V[2 * a + 1]
        for i in lanes(n):
            x, y = V_x[i], V_y[i]
            P_x[i], P_y[i] = x * K0[i] + y * K2[i], x * K1[i] + y * K3[i]
        for b in range(2 * pairs if asked.top > 0 else a + 1):
            V_x, V_y = V[2 * b], V[2 * b + 1]
            for i in lanes(n):
                value[i] = P_x[i] * V_x[i] + P_y[i] * V_y[i]
            if slopes > 0:
                row, column = weights + further + (a // 2) * total, (b // 2 - a // 2) * total
                both = H[a % 2 + b % 2]
                for i in lanes(n):
                    p, q = floats[row + at[i]], floats[row + column + at[i]]
                    value[i] += p * q * both[i]
            add_each(out[b * asked.ld + asked.top + a - b:], where, value)
