"""Active set: a broad search by elements, then closest point projection of their points. The search
compares the gap of the middle of each element with the radius of its points."""

import numpy as np

from ...core import indices, source
from .gap import distances, middles, places, surface
from .tables import (ELEMENTS, FRICTION, GAP, LARGEST, MULTIPLIER, RADIUS, RATE, SETTLE, hardening)

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
    """Position and slope (4, n) of points, their surface points (2, n), and their gaps."""
    rows = np.empty((12, at.size))
    places(pair, u, 1.0, at, rows[:4])
    surface(pair, at, rows[:4], rows[4:6])
    distances(pair, which, False, rows[4:6], rows[GAP:])
    return rows[:GAP + 1]


@source
def touching(pair, a, b, at):
    """Active set: the points that touch at one of two states."""
    part, flags, multiplier = 1.0 / hardening(pair), np.empty(at.size), pair.memory[MULTIPLIER]
    for i in indices(at.size):
        flags[i] = 1.0 * (np.minimum(a[GAP, i], b[GAP, i]) < part * multiplier[at[i]])
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
