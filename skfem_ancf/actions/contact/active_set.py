"""Active set: a broad search by elements, then closest point projection of their points. The search
compares the gap of the middle of each element with the radius of its points."""

import numpy as np

from ...core import indices, source
from .gap import Placed, distances, middles, outside, placed
from .tables import (ELEMENTS, FRICTION, LARGEST, MULTIPLIER, OFFSET, RADIUS, RATE, SETTLE,
                     hardening)

#: Largest distance at which anchors follow points in a motion, in radii of an element.
BEYOND = 4.0


@source
def search(pair, which, u):
    """Lower bound of the gap of each element, shape (elements,)."""
    rows = np.empty((9, pair.header[ELEMENTS]))
    x, gap, radius = rows[:2], rows[2], rows[8]
    middles(pair, u, 1.0, x, radius)
    distances(pair, which, False, x, rows[2:8])
    for e in indices(gap.size):
        gap[e] -= radius[e]
    return gap


@source
def near_points(pair, what, begin, end):
    """Numbers of the points of elements that may touch, from the bounds at both ends."""
    n, reach = begin.size, pair.common[LARGEST + pair.k]
    if what == SETTLE and pair.numbers[FRICTION] > 0.0:  # and points that may touch next
        reach = BEYOND * pair.numbers[RADIUS] if pair.common[RATE] > 0.0 else 1e300
    m, flags = pair.first.size // n, np.empty(pair.first.size)
    for p in range(m):
        flag = flags[p::m]
        for e in indices(n):
            flag[e] = 1.0 * (np.minimum(begin[e], end[e]) <= reach)
    return np.nonzero(flags)[0]


@source
def project(pair, which, u, at):
    """The :class:`~skfem_ancf.actions.contact.gap.Placed` of points."""
    x, t = placed(pair, u, 1.0, at)
    n = at.size
    surface, rows = np.empty(n, np.complex128), np.empty((8, n))
    for i in indices(n):
        surface[i] = outside(x[i], t[i], pair.points[OFFSET, at[i]])
        rows[0, i], rows[1, i] = surface[i].real, surface[i].imag
    distances(pair, which, False, rows[:2], rows[2:])
    return Placed(x, t, surface, rows[2])


@source
def selected(points, some):
    """Some of the points."""
    return Placed(points.x[some], points.t[some], points.surface[some], points.gap[some])


@source
def touching(pair, a, b, at):
    """Active set: the points that touch at one of two states."""
    part, flags, multiplier = 1.0 / hardening(pair), np.empty(at.size), pair.memory[MULTIPLIER]
    for i in indices(at.size):
        flags[i] = 1.0 * (np.minimum(a.gap[i], b.gap[i]) < part * multiplier[at[i]])
    return np.nonzero(flags)[0]


@source
def relative_travel(pair, u):
    """Largest displacement of an element's middle, relative to the radius of its points."""
    n, way = pair.header[ELEMENTS], 0.0
    rows = np.empty((3, n))
    middles(pair, u, 0.0, rows[:2], rows[2])
    for e in range(n):
        way = max(way, rows[0, e] * rows[0, e] + rows[1, e] * rows[1, e])
    return np.sqrt(way) / pair.numbers[RADIUS]
