"""Which points touch an obstacle: a search by elements, then the projection of their points.

Of the middle of each element the gap is asked, and whether its points may be as far as that from
it.
"""

import numpy as np

from ...core.source import indices, source
from .gap import distances, middles, places, surface
from .tables import (ELEMENTS, FRICTION, GAP, LARGEST, MULTIPLIER, RADIUS, RATE, SETTLE, hardening)

#: How far from the surface anchors follow points in a motion, in radii of an element.
BEYOND = 4.0


@source
def search(pair, which, u):
    """How far the points of each element are from the obstacle at least, shape (elements,)."""
    rows = np.empty((9, pair.header[ELEMENTS]))
    x, gap, radius = rows[:2], rows[2], rows[8]
    middles(pair, u, 1.0, x, radius)
    distances(pair, which, False, x, rows[2:8])
    for e in indices(gap.size):
        gap[e] -= radius[e]
    return gap


@source
def near_points(pair, what, begin, end):
    """Numbers of the points of elements that may touch, by their distances at both ends."""
    n, reach = begin.size, pair.common[LARGEST + pair.k]
    if what == SETTLE and pair.numbers[FRICTION] > 0.0:  # also what may touch next
        reach = BEYOND * pair.numbers[RADIUS] if pair.common[RATE] > 0.0 else 1e300
    m, flags = pair.first.size // n, np.empty(pair.first.size)
    for p in range(m):
        flag = flags[p::m]
        for e in indices(n):
            flag[e] = 1.0 * (np.minimum(begin[e], end[e]) <= reach)
    return np.nonzero(flags)[0]


@source
def project(pair, which, u, at):
    """Place and slope (4, n) of some points, the point of the surface (2, n), and its gap."""
    rows = np.empty((12, at.size))
    places(pair, u, 1.0, at, rows[:4])
    surface(pair, at, rows[:4], rows[4:6])
    distances(pair, which, False, rows[4:6], rows[GAP:])
    return rows[:GAP + 1]


@source
def touching(pair, a, b, at):
    """The active set: which of some points, projected at both ends, touch at one of them."""
    part, flags, multiplier = 1.0 / hardening(pair), np.empty(at.size), pair.memory[MULTIPLIER]
    for i in indices(at.size):
        flags[i] = 1.0 * (np.minimum(a[GAP, i], b[GAP, i]) < part * multiplier[at[i]])
    return np.nonzero(flags)[0]


@source
def stride(pair, u):
    """The largest way of the middle of an element, relative to how far its points are from it."""
    n, way = pair.header[ELEMENTS], 0.0
    rows = np.empty((3, n))
    middles(pair, u, 0.0, rows[:2], rows[2])
    for e in range(n):
        way = max(way, rows[0, e] * rows[0, e] + rows[1, e] * rows[1, e])
    return np.sqrt(way) / pair.numbers[RADIUS]
