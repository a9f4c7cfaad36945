"""Which points touch an obstacle: a search by elements, then the projection of their points.

Of the middle of each element the gap is asked, and whether its points may be as far as that from
it. Projections are kept for the last displacements: force and tangent are asked at the same ones,
and the end of a step is the begin of the next.
"""

import numpy as np

from ...core.band import clear, copy, differs
from ...core.source import indices, shaped, source
from .gap import distances, middles, places, surface
from .tables import (ELEMENTS, FRICTION, GAP, KNOWN, LARGEST, LOWEST, MULTIPLIER, POSE, PROJECTED,
                     RADIUS, RATE, SETTLE, SLOTS, SPAN, hardening)

#: How far from the surface anchors follow points in a motion, in radii of an element.
BEYOND = 4.0


@source
def projection(pair, which, u):
    """The slot of the projections at u; if there is none, the elements are searched.

    Their slot is not that which was asked last: the begin of a mean stays beside its end.
    """
    h, slot = pair.header, pair.counts[2 + pair.k]
    n, span = h[ELEMENTS], h[SPAN]
    now, pose = u[h[LOWEST]:h[LOWEST] + span], pair.poses[which]
    for _ in range(SLOTS):
        row = pair.cache[slot]
        if not (differs(now, row[:span]) or differs(pose, row[span:span + POSE])):
            pair.counts[2 + pair.k] = slot
            return slot
        slot = 1 - slot
    slot = 1 - slot
    pair.counts[2 + pair.k] = slot
    row, rows = pair.cache[slot], np.empty((9, n))
    x, found, radius = rows[:2], rows[2:8], rows[8]
    copy(now, row[:span])
    copy(pose, row[span:span + POSE])
    middles(pair, u, 1.0, x, radius)
    distances(pair, which, False, x, found)
    gap = row[span + POSE:span + POSE + n]
    for e in indices(n):
        gap[e] = found[0, e] - radius[e]
    clear(projected(pair, slot)[KNOWN])
    pair.counts[0] += n
    return slot


@source
def projected(pair, slot):
    """What is known of all points, shape (8, n), a view."""
    n = pair.first.size
    row = pair.cache[slot]
    return shaped(row[row.size - PROJECTED * n:], (PROJECTED, n))


@source
def chosen(at, flags):
    """Those of some numbers whose flag is not zero."""
    return at[np.nonzero(flags)[0]]


@source
def near_points(pair, what, begin, end):
    """Numbers of the points of elements that may touch in either slot."""
    h, reach = pair.header, pair.common[LARGEST + pair.k]
    n, span = h[ELEMENTS], h[SPAN] + POSE
    if what == SETTLE and pair.numbers[FRICTION] > 0.0:  # also what may touch next
        reach = BEYOND * pair.numbers[RADIUS] if pair.common[RATE] > 0.0 else 1e300
    a, b = pair.cache[begin][span:span + n], pair.cache[end][span:span + n]
    m, flags = pair.first.size // n, np.empty(pair.first.size)
    for p in range(m):
        flag = flags[p::m]
        for e in indices(n):
            flag[e] = 1.0 * (np.minimum(a[e], b[e]) <= reach)
    return np.nonzero(flags)[0]


@source
def project(pair, which, slot, u, at):
    """Project those of some points that were not yet."""
    known = projected(pair, slot)
    flags = np.empty(at.size)
    for i in indices(at.size):
        flags[i] = 1.0 - known[KNOWN, at[i]]
    new = chosen(at, flags)
    if new.size == 0:
        return
    rows = np.empty((12, new.size))
    z, x = rows[:4], rows[4:6]
    places(pair, u, 1.0, new, z)
    surface(pair, new, z, x)
    distances(pair, which, False, x, rows[GAP:])
    for c in range(KNOWN):
        for i in indices(new.size):
            known[c, new[i]] = rows[c, i]
    for i in indices(new.size):
        known[KNOWN, new[i]] = 1.0
    pair.counts[1] += new.size


@source
def touching(pair, begin, end, at):
    """The active set: those of some points that touch in either slot."""
    part, flags = 1.0 / hardening(pair), np.empty(at.size)
    a, b, multiplier = projected(pair, begin)[GAP], projected(pair, end)[GAP], pair.memory[
        MULTIPLIER]
    for i in indices(at.size):
        flags[i] = 1.0 * (np.minimum(a[at[i]], b[at[i]]) < part * multiplier[at[i]])
    return chosen(at, flags)


@source
def stride(pair, u):
    """The largest way of the middle of an element, relative to how far its points are from it."""
    n, way = pair.header[ELEMENTS], 0.0
    rows = np.empty((3, n))
    middles(pair, u, 0.0, rows[:2], rows[2])
    for e in range(n):
        way = max(way, rows[0, e] * rows[0, e] + rows[1, e] * rows[1, e])
    return np.sqrt(way) / pair.numbers[RADIUS]
