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

Points are in groups: those of one beam at one obstacle. A search asks first for the distance of
the middle of each element, and whether its points may be as far as that from it.
"""

from typing import NamedTuple

import numpy as np

from ..own import own_distance
from ..source import F1, I1, lanes, primitive, shaped, source
from ..tables import add_products

#: Shapes, by their number.
LINE, CIRCLE, POLYGON, OWN = range(4)
#: What is asked of all groups.
FORCE, RESISTING, TANGENT, DAMPED_TANGENT, ALONG = map(np.int64, range(5))
#: Of a group: its shape, obstacle, elements, points of each, pairs of coordinates of each, whether
#: there are slopes; then where among the integers the first coordinates of its points begin, among
#: the numbers the rest, and how many numbers the shape has; where its memory
#: begins, and its number.
(SHAPE, OBSTACLE, ELEMENTS, POINTS, PAIRS, SLOPES, FIRST, WEIGHTS, SLOPE_WEIGHTS, AREAS, OFFSETS,
 STARTS, MEAN_WEIGHTS, MEAN_STARTS, SPREADS, NUMBERS, SHAPES, SIZE, MEMORY,
 GROUP) = map(np.int64, range(20))
HEADER = 20
#: Numbers of a group: stiffness, width of the transition, friction, stiffness of sticking,
#: damping, speed of slipping, largest distance of a point from the middle of its element without
#: displacement, and 1 or -1 outside or inside of the shape.
STIFFNESS, WIDTH, FRICTION, STICKING, DAMPING, SLIPPING, RADIUS, SIDE = range(8)
#: Where an obstacle is: its displacement, the cosine and sine of its angle, the point about which
#: it turns, its velocities, and when. Of each there are three: at a time, and for a mean at the
#: begin and the end.
POSE, POSES = 10, 30
NOW, BEGIN, END = map(np.int64, range(3))
#: Memory: 1 if points stick to anchors; for each group how far pressure reaches beyond the
#: surface; for each point that reach, and its anchor.
ANCHORED = 0
TINY = 1e-200
#: A change of places, relative to an element, below which a mean is that of the middle.
CLOSE = 1e-5


class Question(NamedTuple):
    """What is asked of all groups.

    Attributes
    ----------
    what
        FORCE: the mean force from u to v. RESISTING: that of friction and damping at u by the
        velocity v. TANGENT: the derivative of FORCE by the end of the mean, twice unless u and v
        are the same, to a band. DAMPED_TANGENT: that of RESISTING by velocities times the factor,
        and by places. ALONG: the derivative of the work of FORCE at u along a direction v to
        ``out[0]``, and the largest way of an element along it, in lengths of elements, into
        ``out[1]``.
    t, span
        A time, and for a mean how long it is about it.
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
        What load steps leave behind.
    counts
        Elements searched, points looked at.
    moving, own
        Whether poses depend on time; handle of what knows them, and shapes of one's own.
    address
        That of the compiled function of :mod:`skfem_ancf.compiled.contacts`; 0 for plain texts.
    """

    number: int
    ints: I1
    floats: F1
    poses: F1
    memory: F1
    counts: I1
    moving: int
    own: int
    address: int = 0


@source
def of_contacts(tables, asked, u, v, out):
    """Add what is asked of all groups, a :class:`Question`."""
    for k in range(tables.number):
        group = tables.ints[k * HEADER:(k + 1) * HEADER]
        if asked.what == ALONG:
            out[1] = max(out[1], _stride(tables, group, v))
        if asked.what == RESISTING or asked.what == DAMPED_TANGENT:
            _rubbing(tables, group, asked, u, v, out)
        else:
            _pushing(tables, group, asked, u, v, out)


@primitive("contacts")
def run_contacts(tables, asked, u, v, out):
    """As :func:`of_contacts`; compiled once, and not anew in each text that calls it."""
    of_contacts(tables, asked, u, v, out)


@source
def _pose(tables, group, which):
    """Where the obstacle of a group is."""
    at = group[OBSTACLE] * POSES + which * POSE
    return tables.poses[at:at + POSE]


@source
def _table(tables, group, which, rows, columns):
    """Rows of the group's numbers."""
    at = group[which]
    return shaped(tables.floats[at:at + rows * columns], (rows, columns))


@source
def _numbers(tables, group):
    return tables.floats[group[NUMBERS]:group[NUMBERS] + 8]


@source
def _memory(tables, group):
    """Reach and anchor of each point, shape (3, points)."""
    n = group[ELEMENTS] * group[POINTS]
    return shaped(tables.memory[group[MEMORY]:group[MEMORY] + 3 * n], (np.int64(3), n))


# where points are


@source
def middles(tables, group, u, x, radius):
    """The middle of each element's points, and how far from it they may be."""
    n, pairs, half = group[ELEMENTS], group[PAIRS], group[PAIRS] // 2
    weights, spreads = (_table(tables, group, MEAN_WEIGHTS, pairs, n),
                        _table(tables, group, SPREADS, pairs, n))
    start = _table(tables, group, MEAN_STARTS, np.int64(2), n)
    largest, every = _numbers(tables, group)[RADIUS], group[POINTS]
    at = tables.ints[group[FIRST]:group[FIRST] + n * every]
    for e in lanes(n):
        x[0, e], x[1, e], radius[e] = start[0, e], start[1, e], largest
    first = at[::every]
    for k in range(pairs):
        for e in lanes(n):
            a, b = u[first[e] + 2 * k], u[first[e] + (2 * k + 1)]
            x[0, e] += weights[k, e] * a
            x[1, e] += weights[k, e] * b
            # both places of an element together are a translation
            c = a - u[first[e]] * (k == half)
            d = b - u[first[e] + 1] * (k == half)
            radius[e] += spreads[k, e] * np.sqrt(c * c + d * d)


@source
def places(tables, group, u, at, z):
    """Places and slopes at points ``at`` of a group, (4, n)."""
    pairs, total = group[PAIRS], group[ELEMENTS] * group[POINTS]
    weights = _table(tables, group, WEIGHTS, pairs, total)
    start = _table(tables, group, STARTS, np.int64(4), total)
    first = tables.ints[group[FIRST]:group[FIRST] + total]
    for c in range(4):
        for i in lanes(at.size):
            z[c, i] = start[c, at[i]]
    add_places(weights, first, u, at, z[:2])
    if group[SLOPES] > 0:
        add_places(_table(tables, group, SLOPE_WEIGHTS, pairs, total), first, u, at, z[2:])


@source
def add_places(weights, first, u, at, z):
    """Add the sums of coordinates by weights."""
    for k in range(weights.shape[0]):
        for i in lanes(at.size):
            z[0, i] += weights[k, at[i]] * u[first[at[i]] + 2 * k]
            z[1, i] += weights[k, at[i]] * u[first[at[i]] + (2 * k + 1)]


@source
def surface(tables, group, at, z, x):
    """The points of the surface, of places and slopes."""
    for i in lanes(at.size):
        x[0, i], x[1, i] = z[0, i], z[1, i]
    if group[SLOPES] > 0:
        c = tables.floats[group[OFFSETS]:]
        for i in lanes(at.size):
            size = np.sqrt(z[2, i] * z[2, i] + z[3, i] * z[3, i])
            x[0, i] -= c[at[i]] * z[3, i] / size
            x[1, i] += c[at[i]] * z[2, i] / size


@source
def _stride(tables, group, u):
    """The largest way of the middle of an element, relative to how far its points are from it."""
    n = group[ELEMENTS]
    x, radius = np.empty((2, n)), np.empty(n)
    middles(tables, group, u, x, radius)
    start = _table(tables, group, MEAN_STARTS, np.int64(2), n)
    way = (x[0] - start[0]) ** 2 + (x[1] - start[1]) ** 2
    return np.sqrt(np.max(way)) / _numbers(tables, group)[RADIUS]


@source
def _near(tables, group, u, v, same):
    """Numbers of the points of elements that may touch, at u or at v."""
    n, points = group[ELEMENTS], group[POINTS]
    x, radius, found = np.empty((2, n)), np.empty(n), np.empty((6, n))
    gap = np.empty(n)
    middles(tables, group, u, x, radius)
    distances(tables, group, NOW if same else BEGIN, x, found)
    for e in lanes(n):
        gap[e] = found[0, e] - radius[e]
    if not same:
        middles(tables, group, v, x, radius)
        distances(tables, group, END, x, found)
        for e in lanes(n):
            gap[e] = np.minimum(gap[e], found[0, e] - radius[e])
    near = np.nonzero(gap <= tables.memory[1 + group[GROUP]])[0]
    at = np.empty(near.size * points, np.int64)
    for p in range(points):
        part = at[p * near.size:(p + 1) * near.size]
        for i in lanes(near.size):
            part[i] = near[i] * points + p
    tables.counts[0] += n
    tables.counts[1] += at.size
    return at


# shapes


@source
def distances(tables, group, which, x, out):
    """Distance, its gradient and second derivatives xx, xy, yy at points x, shape (6, n)."""
    pose = _pose(tables, group, which)
    numbers = tables.floats[group[SHAPES]:group[SHAPES] + group[SIZE]]
    cos, sin = pose[2], pose[3]
    y = np.empty(x.shape)
    for i in lanes(x.shape[1]):
        a, b = x[0, i] - pose[0] - pose[4], x[1, i] - pose[1] - pose[5]
        y[0, i], y[1, i] = cos * a + sin * b + pose[4], cos * b - sin * a + pose[5]
    if group[SHAPE] == LINE:
        _line(numbers, y, out)
    elif group[SHAPE] == CIRCLE:
        _circle(numbers, y, out)
    elif group[SHAPE] == POLYGON:
        polygon(numbers, y, out)
    else:
        own_distance(tables.own, group[OBSTACLE], pose[9], y, out)
    side = _numbers(tables, group)[SIDE]
    for i in lanes(x.shape[1]):
        out[0, i] *= side
        a, b = side * out[1, i], side * out[2, i]
        out[1, i], out[2, i] = cos * a - sin * b, sin * a + cos * b
        p, q, r = side * out[3, i], side * out[4, i], side * out[5, i]
        out[3, i] = cos * cos * p - 2.0 * cos * sin * q + sin * sin * r
        out[4, i] = cos * sin * (p - r) + (cos * cos - sin * sin) * q
        out[5, i] = sin * sin * p + 2.0 * cos * sin * q + cos * cos * r


@source
def _line(numbers, y, out):
    """Numbers: a point, and the normal away from what is solid."""
    for i in lanes(y.shape[1]):
        out[0, i] = (numbers[2] * (y[0, i] - numbers[0]) + numbers[3] * (y[1, i] - numbers[1]))
        out[1, i], out[2, i] = numbers[2], numbers[3]
        out[3, i], out[4, i], out[5, i] = 0.0, 0.0, 0.0


@source
def _circle(numbers, y, out):
    """Numbers: center and radius."""
    for i in lanes(y.shape[1]):
        a, b = y[0, i] - numbers[0], y[1, i] - numbers[1]
        size = np.maximum(np.sqrt(a * a + b * b), TINY)
        out[0, i], out[1, i], out[2, i] = size - numbers[2], a / size, b / size
        out[3, i], out[4, i], out[5, i] = (b * b / size**3, -a * b / size**3, a * a / size**3)


@source
def polygon(numbers, y, out):
    """Numbers: radius of the corners, then of each: place, edge to the next, 1 or -1 if it is
    convex or not. Next to an edge it is a line, next to a corner a circle.
    """
    n = (numbers.size - 1) // 5
    corners = shaped(numbers[1:1 + 5 * n], (n, np.int64(5)))
    best = np.full(y.shape[1], 1e300)
    for k in range(n):
        p, q = corners[k], corners[(k + 1) % n]
        square = p[2] * p[2] + p[3] * p[3]
        nx, ny = p[3] / np.sqrt(square), -p[2] / np.sqrt(square)
        for i in lanes(y.shape[1]):
            a, b = y[0, i] - p[0], y[1, i] - p[1]
            s = np.minimum(np.maximum((a * p[2] + b * p[3]) / square, 0.0), 1.0)
            c, d = a - s * p[2], b - s * p[3]
            new = 1.0 * (c * c + d * d < best[i])
            old = 1.0 - new
            best[i] = old * best[i] + new * (c * c + d * d)
            inner = 1.0 * (s > 0.0) * (s < 1.0)
            side = p[4] * (s < 0.5) + q[4] * (s >= 0.5)  # of the corner
            size = np.maximum(np.sqrt(c * c + d * d), TINY)
            gx = inner * nx + (1.0 - inner) * side * c / size
            gy = inner * ny + (1.0 - inner) * side * d / size
            bend = new * (1.0 - inner) * side / size
            distance = inner * (nx * a + ny * b) + (1.0 - inner) * side * size - numbers[0]
            out[0, i] = old * out[0, i] + new * distance
            out[1, i], out[2, i] = old * out[1, i] + new * gx, old * out[2, i] + new * gy
            out[3, i] = old * out[3, i] + bend * gy * gy
            out[4, i] = old * out[4, i] - bend * gx * gy
            out[5, i] = old * out[5, i] + bend * gx * gx


# the law


@source
def slope_of(a, width):
    """S'(a)."""
    p, q = np.maximum(a, 0.0), np.maximum(a - width, 0.0)
    return (p * p - q * q) / (2.0 * width)


@source
def curvature_of(a, width):
    """S''(a)."""
    return (np.maximum(a, 0.0) - np.maximum(a - width, 0.0)) / width


@source
def mean_slope(a, b, width):
    """(S(b) - S(a)) / (b - a), and S' where they are the same: without differences of S."""
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
def _pushing(tables, group, asked, u, v, out):
    """The pressure and, in statics, friction at anchors: force or tangent."""
    d = v - u
    same = asked.what == ALONG or np.dot(d, d) == 0.0
    at = _near(tables, group, u, v, same)
    if at.size == 0:
        return
    n = at.size
    z, x, found, a = np.empty((3, 4, n)), np.empty((2, n)), np.empty((6, n)), np.empty((2, n))
    memory, numbers = _memory(tables, group), _numbers(tables, group)
    ends = 1 if same else 2
    for end in range(ends):
        places(tables, group, u if end == 0 else v, at, z[end])
        surface(tables, group, at, z[end], x)
        distances(tables, group, NOW if same else BEGIN + end, x, found)
        for i in lanes(n):
            a[end, i] = memory[0, at[i]] - found[0, i]
        if tables.moving > 0 and not same:
            _carry(tables, group, BEGIN + end, x, z[end])
    for i in lanes(n):
        a[1, i] = a[ends - 1, i]
    touching = np.nonzero((a[0] > 0.0) | (a[1] > 0.0))[0]
    if touching.size == 0:
        return
    at, a, z = at[touching], _chosen(a, touching), _both(z, touching, same)
    x, found = np.empty((2, at.size)), np.empty((6, at.size))
    surface(tables, group, at, z[2], x)
    distances(tables, group, NOW, x, found)
    F, K, pressure = np.empty((2, at.size)), np.empty((4, at.size)), np.empty(at.size)
    areas = tables.floats[group[AREAS]:]
    for i in lanes(at.size):
        pressure[i] = numbers[STIFFNESS] * areas[at[i]] * mean_slope(a[0, i], a[1, i],
                                                                      numbers[WIDTH])
        F[0, i], F[1, i] = -pressure[i] * found[1, i], -pressure[i] * found[2, i]
    if asked.what != FORCE:
        _stiffness(numbers, areas, at, a, pressure, found, K)
    if tables.memory[ANCHORED] > 0.0 and numbers[FRICTION] > 0.0:
        stick(tables, group, at, x, a[1], pressure, found, F, K)
    if asked.what == TANGENT:
        add_tangent(tables, group, asked, at, z[2], F, K, out)
        return
    if asked.what == ALONG:
        _add_along(tables, group, at, z[2], v, F, K, out)
        return
    G = np.zeros((4, at.size))
    _pulled_back(tables, group, at, z[2], F, G)
    if not same:
        _keep_work(numbers[RADIUS], pressure, a, z, G)
    add_forces(tables, group, at, G, out)


@source
def _carry(tables, group, which, x, z):
    """Move places with the obstacle, from where it was or will be to where it is."""
    p, q = _pose(tables, group, which), _pose(tables, group, NOW)
    cos, sin = q[2] * p[2] + q[3] * p[3], q[3] * p[2] - q[2] * p[3]
    for i in lanes(x.shape[1]):
        a, b = x[0, i] - p[0] - p[4], x[1, i] - p[1] - p[5]
        z[0, i] += q[0] + q[4] + cos * a - sin * b - x[0, i]
        z[1, i] += q[1] + q[5] + sin * a + cos * b - x[1, i]


@source
def _chosen(x, at):
    """Columns of rows."""
    out = np.empty((x.shape[0], at.size))
    for k in range(x.shape[0]):
        for i in lanes(at.size):
            out[k, i] = x[k, at[i]]
    return out


@source
def _both(z, at, same):
    """Columns of both ends, and their middle."""
    out = np.empty((3, 4, at.size))
    last = 0 if same else 1
    for c in range(4):
        for i in lanes(at.size):
            p, q = z[0, c, at[i]], z[last, c, at[i]]
            out[0, c, i], out[1, c, i], out[2, c, i] = p, q, p + 0.5 * (q - p)
    return out


@source
def _keep_work(size, pressure, a, z, G):
    """Correct forces, so that their work is what the potential changes by."""
    for i in lanes(pressure.size):
        p, q, r, s = (z[1, 0, i] - z[0, 0, i], z[1, 1, i] - z[0, 1, i], z[1, 2, i] - z[0, 2, i],
                      z[1, 3, i] - z[0, 3, i])
        square = p * p + q * q + r * r + s * s
        missing = (pressure[i] * (a[1, i] - a[0, i])
                   - (G[0, i] * p + G[1, i] * q + G[2, i] * r + G[3, i] * s))
        far = square > CLOSE * CLOSE * size * size
        c = missing * far / np.maximum(square, TINY)
        G[0, i] += c * p
        G[1, i] += c * q
        G[2, i] += c * r
        G[3, i] += c * s


@source
def _stiffness(numbers, areas, at, a, pressure, found, K):
    """The derivative of the force by the point: xx, xy, yx, yy."""
    for i in lanes(at.size):
        jump = a[1, i] - a[0, i]
        apart = np.abs(jump) > 1e-3 * (numbers[WIDTH] + np.abs(a[0, i]) + np.abs(a[1, i]))
        scale = numbers[STIFFNESS] * areas[at[i]]
        k = (scale * curvature_of(0.5 * (a[0, i] + a[1, i]), numbers[WIDTH]) * (1.0 - apart)
             + 2.0 * (scale * slope_of(a[1, i], numbers[WIDTH]) - pressure[i]) * apart
             / (jump + (1.0 - apart)))
        K[0, i] = k * found[1, i] * found[1, i] - pressure[i] * found[3, i]
        K[1, i] = k * found[1, i] * found[2, i] - pressure[i] * found[4, i]
        K[2, i] = K[1, i]
        K[3, i] = k * found[2, i] * found[2, i] - pressure[i] * found[5, i]


@source
def stick(tables, group, at, x, a, pressure, found, F, K):
    """Friction in statics: a spring to the anchor, which gives way at the limit of Coulomb."""
    pose = _pose(tables, group, NOW)
    memory, numbers = _memory(tables, group), _numbers(tables, group)
    areas = tables.floats[group[AREAS]:]
    for i in lanes(at.size):
        tx, ty = -found[2, i], found[1, i]
        slip = slip_of(pose, memory[1, at[i]], memory[2, at[i]], x[0, i], x[1, i], tx, ty)
        k, limit = numbers[STICKING] * areas[at[i]], numbers[FRICTION] * pressure[i]
        sticks = 1.0 * (np.abs(k * slip) < limit)
        T = np.minimum(np.maximum(k * slip, -limit), limit)
        change = (numbers[FRICTION] * np.sign(slip) * (1.0 - sticks) * numbers[STIFFNESS]
                  * areas[at[i]] * curvature_of(a[i], numbers[WIDTH]))
        F[0, i] += T * tx
        F[1, i] += T * ty
        _add_friction(found, i, tx, ty, T, k * sticks, change, K)


@source
def slip_of(pose, p, q, x, y, tx, ty):
    """How far a point (x, y) is along t from its anchor (p, q), which moves with the obstacle."""
    a, b = p - pose[4], q - pose[5]
    return ((x - pose[0] - pose[4] - pose[2] * a + pose[3] * b) * tx
            + (y - pose[1] - pose[5] - pose[3] * a - pose[2] * b) * ty)


@source
def _add_friction(found, i, tx, ty, T, k, change, K):
    """Add the derivative of T t: k along t, ``change`` by the penetration, and the turn of t."""
    K[0, i] += k * tx * tx - change * tx * found[1, i] - T * found[4, i]
    K[1, i] += k * tx * ty - change * tx * found[2, i] - T * found[5, i]
    K[2, i] += k * ty * tx - change * ty * found[1, i] + T * found[3, i]
    K[3, i] += k * ty * ty - change * ty * found[2, i] + T * found[4, i]


@source
def _rubbing(tables, group, asked, u, v, out):
    """Friction and damping by velocities: force or tangent."""
    numbers = _numbers(tables, group)
    if numbers[FRICTION] == 0.0 and numbers[DAMPING] == 0.0:
        return
    at = _near(tables, group, u, u, True)
    if at.size == 0:
        return
    n = at.size
    z, x, found = np.empty((4, n)), np.empty((2, n)), np.empty((6, n))
    places(tables, group, u, at, z)
    surface(tables, group, at, z, x)
    distances(tables, group, NOW, x, found)
    touching = np.nonzero(found[0] < 0.0)[0]
    if touching.size == 0:
        return
    at, z, x, found = (at[touching], _chosen(z, touching), _chosen(x, touching),
                       _chosen(found, touching))
    w = np.empty((2, at.size))
    velocities(tables, group, at, v, z, x, w)
    F, K = np.empty((2, at.size)), np.zeros((4, at.size))
    resist(tables, group, at, asked.factor, w, found, F, K)
    if asked.what == DAMPED_TANGENT:
        add_tangent(tables, group, asked, at, z, F, K, out)
        return
    G = np.zeros((4, at.size))
    _pulled_back(tables, group, at, z, F, G)
    add_forces(tables, group, at, G, out)


@source
def velocities(tables, group, at, v, z, x, w):
    """Of points of the surface, relative to the obstacle."""
    pose = _pose(tables, group, NOW)
    pairs, total = group[PAIRS], group[ELEMENTS] * group[POINTS]
    first = tables.ints[group[FIRST]:group[FIRST] + total]
    for i in lanes(at.size):
        w[0, i] = pose[8] * (x[1, i] - pose[1] - pose[5]) - pose[6]
        w[1, i] = -pose[8] * (x[0, i] - pose[0] - pose[4]) - pose[7]
    add_places(_table(tables, group, WEIGHTS, pairs, total), first, v, at, w)
    if group[SLOPES] > 0:
        rate, c = np.zeros((2, at.size)), tables.floats[group[OFFSETS]:]
        add_places(_table(tables, group, SLOPE_WEIGHTS, pairs, total), first, v, at, rate)
        for i in lanes(at.size):
            square = z[2, i] * z[2, i] + z[3, i] * z[3, i]
            turn = c[at[i]] * (z[2, i] * rate[1, i] - z[3, i] * rate[0, i]) / square**1.5
            w[0, i] -= turn * z[2, i]
            w[1, i] -= turn * z[3, i]


@source
def resist(tables, group, at, factor, w, found, F, K):
    """Coulomb's friction, smooth about rest, and damping in proportion to the pressure.

    Of friction the tangent takes its mean slope by the velocity from rest on, not its slope there,
    and not that it grows with the pressure: so an iteration finds the rest from any velocity.
    """
    numbers, areas = _numbers(tables, group), tables.floats[group[AREAS]:]
    for i in lanes(at.size):
        k = numbers[STIFFNESS] * areas[at[i]]
        pressure = k * slope_of(-found[0, i], numbers[WIDTH])
        nx, ny = found[1, i], found[2, i]
        tx, ty = -ny, nx
        along, apart = w[0, i] * tx + w[1, i] * ty, w[0, i] * nx + w[1, i] * ny
        speed = np.sqrt(along * along + numbers[SLIPPING] * numbers[SLIPPING])
        share = numbers[FRICTION] * along / speed
        loss = np.minimum(numbers[DAMPING] * apart, 1.0)
        F[0, i] = pressure * (share * tx + loss * nx)
        F[1, i] = pressure * (share * ty + loss * ny)
        stiff = k * curvature_of(-found[0, i], numbers[WIDTH])
        c = factor * pressure * numbers[DAMPING] * (loss < 1.0) - loss * stiff
        _add_friction(found, i, tx, ty, pressure * share,
                      factor * pressure * numbers[FRICTION] / speed, 0.0, K)
        K[0, i] += c * nx * nx
        K[1, i] += c * nx * ny
        K[2, i] += c * ny * nx
        K[3, i] += c * ny * ny


# from points to coordinates


@source
def _pulled_back(tables, group, at, z, F, G):
    """What forces on points of the surface do to places and slopes."""
    for i in lanes(at.size):
        G[0, i], G[1, i] = F[0, i], F[1, i]
    if group[SLOPES] > 0:
        c = tables.floats[group[OFFSETS]:]
        for i in lanes(at.size):
            square = z[2, i] * z[2, i] + z[3, i] * z[3, i]
            turn = c[at[i]] * (F[0, i] * z[2, i] + F[1, i] * z[3, i]) / square**1.5
            G[2, i], G[3, i] = turn * z[3, i], -turn * z[2, i]


@source
def add_forces(tables, group, at, G, f):
    """Add forces on places and slopes to those on coordinates."""
    pairs, total = group[PAIRS], group[ELEMENTS] * group[POINTS]
    first = tables.ints[group[FIRST]:group[FIRST] + total]
    where, weight, all_of = np.empty(at.size, np.int64), np.empty(at.size), np.arange(at.size)
    for part in range(2 if group[SLOPES] > 0 else 1):
        weights = _table(tables, group, SLOPE_WEIGHTS if part > 0 else WEIGHTS, pairs, total)
        for k in range(pairs):
            for c in range(2):
                for i in lanes(at.size):
                    where[i] = first[at[i]] + (2 * k + c)
                    weight[i] = weights[k, at[i]]
                add_products(f, where, weight, G[2 * part + c], all_of)


@source
def add_tangent(tables, group, asked, at, z, F, K, flat):
    """Add derivatives by the points to a band: its lower half, or all of it."""
    pairs, total, slopes = group[PAIRS], group[ELEMENTS] * group[POINTS], group[SLOPES]
    first = tables.ints[group[FIRST]:group[FIRST] + total]
    weights = np.zeros((2, pairs, at.size))
    for part in range(1 + slopes):
        table = _table(tables, group, SLOPE_WEIGHTS if part > 0 else WEIGHTS, pairs, total)
        for k in range(pairs):
            for i in lanes(at.size):
                weights[part, k, i] = table[k, at[i]]
    D = np.empty((4, 4, at.size))
    _by_slopes(tables, group, at, z, F, K, D)
    where, one, all_of = np.empty(at.size, np.int64), np.empty(at.size), np.arange(at.size)
    for a in range(2 * pairs):
        for b in range(2 * pairs if asked.top > 0 else a + 1):
            for i in lanes(at.size):
                where[i] = (first[at[i]] + b) * asked.ld + (asked.top + a - b)
                one[i] = weights[0, a // 2, i] * weights[0, b // 2, i] * D[a % 2, b % 2, i]
            if slopes > 0:
                for i in lanes(at.size):
                    one[i] += (
                        weights[0, a // 2, i] * weights[1, b // 2, i] * D[a % 2, 2 + b % 2, i]
                        + weights[1, a // 2, i] * weights[0, b // 2, i] * D[2 + a % 2, b % 2, i]
                        + weights[1, a // 2, i] * weights[1, b // 2, i]
                        * D[2 + a % 2, 2 + b % 2, i])
            add_products(flat, where, one, np.ones(at.size), all_of)


@source
def _add_along(tables, group, at, z, d, F, K, out):
    """Add d . K d."""
    pairs, total = group[PAIRS], group[ELEMENTS] * group[POINTS]
    first = tables.ints[group[FIRST]:group[FIRST] + total]
    way, D = np.zeros((4, at.size)), np.empty((4, 4, at.size))
    add_places(_table(tables, group, WEIGHTS, pairs, total), first, d, at, way[:2])
    if group[SLOPES] > 0:
        add_places(_table(tables, group, SLOPE_WEIGHTS, pairs, total), first, d, at, way[2:])
    _by_slopes(tables, group, at, z, F, K, D)
    for a in range(4 if group[SLOPES] > 0 else 2):
        for b in range(4 if group[SLOPES] > 0 else 2):
            out[0] += np.dot(way[a] * way[b], D[a, b])


@source
def _by_slopes(tables, group, at, z, F, K, D):
    """The derivatives by place and slope, of those by the point of the surface."""
    for a in range(2):
        for b in range(2):
            for i in lanes(at.size):
                D[a, b, i] = K[2 * a + b, i]
    if group[SLOPES] == 0:
        return
    c = tables.floats[group[OFFSETS]:]
    for i in lanes(at.size):
        size = np.sqrt(z[2, i] * z[2, i] + z[3, i] * z[3, i])
        tx, ty = z[2, i] / size, z[3, i] / size
        r = c[at[i]] / size  # dX = dx - r t (n . ds) with n = (-ty, tx)
        p, q = K[0, i] * tx + K[1, i] * ty, K[2, i] * tx + K[3, i] * ty
        D[0, 2, i], D[0, 3, i] = r * p * ty, -r * p * tx
        D[1, 2, i], D[1, 3, i] = r * q * ty, -r * q * tx
        p, q = tx * K[0, i] + ty * K[2, i], tx * K[1, i] + ty * K[3, i]
        D[2, 0, i], D[2, 1, i] = r * ty * p, r * ty * q
        D[3, 0, i], D[3, 1, i] = -r * tx * p, -r * tx * q
        across = r * r * (p * tx + q * ty) - r / size * (F[1, i] * tx - F[0, i] * ty)
        both = r / size * (F[0, i] * tx + F[1, i] * ty)
        D[2, 2, i] = across * ty * ty - 2.0 * both * tx * ty
        D[2, 3, i] = -across * tx * ty + both * (tx * tx - ty * ty)
        D[3, 2, i] = D[2, 3, i]
        D[3, 3, i] = across * tx * tx + 2.0 * both * tx * ty
