"""Kernels of contact of members: what points face, gaps, pressures, friction.

A point of a surface is ``x = r + i s t / |t|``, with the place r and the slope t of its own facet
and its signed offset s. Its gap from the facet with the curve c and the slope T is

    g = side Im(conj(T) (x - c)) / |T| - offset

where c is the closest point: ``Re(conj(T) (x - c)) = 0``. All of r, t, c, T are linear in the
degrees of freedom. Plane vectors v are complex numbers; a derivative by v is the number d with the
change ``Re(conj(d) dv)``.
"""

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np

from ...core import (C1, C2, C3, F1, F2, I1, I2, MADE, apart, everywhere, indices, primitive,
                     source, where)
from ...core.band import copy, dot as inner, farthest, largest, smallest
from ...core.callbacks import SEARCHES, call_custom, owner
from ..tables import least_each
from .stretches import Cut, Rows, cut_anew, straight_within
from .points import (Touch, add_bend, add_coupling, add_resistance, by_slope, cross, dot,
                     mean_pressure, product, put, respond, return_mapping, scaled, size, spread,
                     turned, vector)

#: Iterations of the projection, its largest step along a facet, and how far it may leave it.
PROJECT, FAR, LEFT = 12, 1.0, 1.5
#: A point is on a facet if its projection leaves it by less, so that round-off does not decide
#: about points on edges, as of equal rods that collide. The same for ends that go on as an arc.
EDGE, ON = 0.02, 1e-6
#: No contact of a beam with itself, or with a beam that it is joined to, within so many heights.
APART = 3.0
#: Largest penetration, in heights; a point as deep as the height lies on the other face.
DEEPEST = 0.75
#: Largest cosine of the angle between outer normals of surfaces that touch.
OPPOSED = -0.2
#: And the cosine at another place of a facet, from which on it faces the same way everywhere.
SAME = 0.8
#: Iterations for the place of a mean force; change of a gap in heights below which none is needed.
MEANS, CLOSE = 8, 1e-9
#: Largest change of a gap in a step, over the motion along and across a facet, that is no jump.
JUMP = 1.0
#: The gap where nothing is.
NOTHING = 1e300
#: Distance in heights for which a list of candidates is enough, and the largest one; part of it
#: after which boxes are compared again.
SKIN, FARTHEST, AGAIN = 0.5, 1e6, 0.1
#: Components of the vectors r, t, c, T of a contact point.
COMPONENTS = 8


class Candidates(NamedTuple):
    """Points and facets that may touch, with a guess of the place on the facet, (n,)."""

    p: I1
    e: I1
    zeta: F1
    group: I1  # numbers of pairs of a point and a chain


class Seeds(NamedTuple):
    """Places of facets, as ``starts + sum(weights * z[dofs])``, (S,), and the largest distance of
    the surface from the nearest."""

    e: I1
    dofs: I2  # (B, S)
    weights: C2
    starts: C1
    widest: float


class Groups(NamedTuple):
    """Facets of members, or of parts of a beam; which of these may touch."""

    of: I1  # groups of facets, (F,)
    members: I1  # of groups
    elements: I1  # of facets of beams that may touch themselves, else -1, (F,)
    allowed: I2  # 1 for members that may touch


class Facing(NamedTuple):
    """What points of surfaces face at a state: facet or -1, closest point and gap, (P,)."""

    curve: C2  # coefficients of facets, (k, F)
    x: C1
    normal: C1
    e: I1
    zeta: F1
    gap: F1
    clear: F1  # the least gap of all, negative if any touches, (1,)


class PairTables(NamedTuple):
    """The surfaces of members that may touch, see :class:`~skfem_ancf.actions.pairs.facets.Facets`.
    F facets and P points with B pairs of degrees of freedom each, among the ``n`` that are used."""

    used: I1  # pairs of degrees of freedom of the scene, (n,)
    dofs: I2  # (B, F)
    weights: C3  # coefficients of powers of zeta, (B, k, F)
    starts: C2  # (k, F)
    sides: F1
    offsets: F1
    places: F1
    lengths: F1
    spans: F1
    heights: F1
    stiffness: F1
    reach: F2  # the least and largest zeta of closest points, (2, F)
    near: F1  # distance of a point of a facet from the guess for it
    members: I1
    chains: I1
    curves: I1
    joined: F2  # chain and place on it, of two parts that are joined, (j, 4)
    of: I1  # facets of points
    zeta: F1
    areas: F1
    begins: F1  # gaps at which the pressure begins
    opposed: F1  # largest cosine of the angle to normals of surfaces that they touch
    point_dofs: I2  # (B, P)
    N: C2  # weights of places, (B, P)
    D: C2  # and of slopes
    height: float
    width: float  # of the transition from no pressure to proportional pressure
    friction: float
    handle: int  # of the search
    found: I1  # address of the Candidates, number of searches, 1 if there are Candidates, (3,)
    seen: C1  # displacements at the last search, (n,)
    moves: F2  # their weights, see :func:`~skfem_ancf.actions.contact.tables.weights_of_motion`
    skin: F1  # the candidates are complete until points or facets have moved by half of it, (1,)
    seeds: Seeds
    groups: Groups
    rows: Rows  # and while stretches of the beams are straight
    cut: Cut
    start: Facing  # at the start of the last step, with the displacements there
    start_at: C1
    history: F1  # factor on the stiffness, less 1; with friction curves and anchors of points


class Meeting(NamedTuple):
    """Pairs in contact at one of two states, with penetrations at both, (n,)."""

    at: I1
    e: I1
    zeta: F1
    before: F1
    after: F1


PAIRS: TypeAlias = PairTables
FACING: TypeAlias = Annotated[Facing, MADE]


@primitive("skfem_ancf.equations.loops")
def pair_tables(tables, k):
    """The PairTables number k of :class:`~skfem_ancf.actions.forces.kernels.ForceTables`."""
    return tables.pairs[k]


@primitive("skfem_ancf.equations.loops")
def candidates_of(t):
    """The :class:`Candidates` of the last search."""
    return owner(t.handle).candidates


# curves


@source
def along(curve, e, zeta):
    """Polynomials number e at zeta, with their first two derivatives."""
    last = curve.shape[0] - 1
    x, y, X, Y = curve[last, e].real, curve[last, e].imag, 0.0 * zeta, 0.0 * zeta
    A, B = X, Y
    for k in range(last - 1, -1, -1):
        A, B = A * zeta + 2.0 * X, B * zeta + 2.0 * Y
        X, Y = X * zeta + x, Y * zeta + y
        x, y = x * zeta + curve[k, e].real, y * zeta + curve[k, e].imag
    return vector(x, y), vector(X, Y), vector(A, B)


@source
def clipped(x, low, high):
    return np.minimum(np.maximum(x, low), high)


@source
def project(t, curve, e, zeta, x):
    """The closest point of facets e to x, from a guess: zeta, and True if it is there."""
    step = 0.0 * zeta
    for _ in range(PROJECT):
        c, T, A = along(curve, e, zeta)
        d, square = x - c, dot(T, T)
        bend = square - dot(A, d)
        bend = where(bend > 0.1 * square, bend, square)
        step = clipped(dot(T, d) / bend, -FAR, FAR)
        new = clipped(zeta + step, -LEFT, LEFT)
        still, zeta = np.abs(new - zeta), new
        if everywhere(still < 1e-14):
            break
    return zeta, (np.abs(step) < 1e-9) & (zeta >= t.reach[0, e]) & (zeta <= t.reach[1, e])


# what points face


@apart("pairs", PAIRS, C1, FACING)
def look(t, z, found):
    """Find what all points face at displacements z."""
    curve, x, normal = found.curve, found.x, found.normal
    B, n, F = t.weights.shape
    for k in range(n):
        for e in indices(F):
            curve[k, e] = t.starts[k, e]
        for b in range(B):
            for e in indices(F):
                curve[k, e] += t.weights[b, k, e] * z[t.dofs[b, e]]
    for p in indices(x.size):
        r, T, _ = along(curve, t.of[p], t.zeta[p])
        side = t.sides[t.of[p]]
        outer = scaled(side / size(T), turned(T))
        normal[p], x[p] = outer, r + scaled(t.offsets[t.of[p]], outer)
        found.e[p], found.zeta[p], found.gap[p] = -1, 0.0, 0.0
    u, none = z.view(np.float64), t.sides[:0]
    travel = farthest(t.moves, u, t.seen.view(np.float64))
    enough = 0.5 if t.found[2] > 0 else AGAIN  # boxes are soon compared again
    if not travel < enough * t.skin[0] or not straight_within(t.rows, t.cut, z) > 0.0:
        travel = 0.0
        _group(t, z)
        t.skin[0], t.found[1], t.found[2] = _room(t, x, z), t.found[1] + 1, 0
        copy(u, t.seen.view(np.float64))
        if not t.skin[0] > SKIN * t.height:
            call_custom(SEARCHES, t.handle, np.int64(0), 0.0, 0.0, u, none, none)
    known = candidates_of(t)
    far = np.empty(known.p.size if t.found[2] > 0 else 0)
    for i in indices(far.size):
        p, e = known.p[i], known.e[i]
        c, T, _ = along(curve, e, known.zeta[i])
        far[i] = size(x[p] - c) - t.near[e]
        # the other face of a member, which faces the same way, is never touched
        same = t.sides[e] * cross(T, normal[p]) > SAME * size(T)
        far[i] = where(same, 0.25 * NOTHING, far[i])
    found.clear[0] = t.skin[0] + t.height - 2.0 * travel
    for i in indices(far.size):
        far[i] = where(far[i] < t.height, NOTHING, far[i])
    found.clear[0] = min(found.clear[0], smallest(far) if far.size > 0 else NOTHING)
    near = np.nonzero(far > 0.5 * NOTHING)[0]
    if near.size > 0:
        _face(t, known, near, found)


@source
def _group(t, z):
    """Set groups of facets at displacements z."""
    n = t.cut.fits.size
    if t.rows.starts.size > 0:
        cut_anew(t.rows, t.cut, z)
    for e in indices(t.sides.size):
        at = t.groups.elements[e]
        t.groups.of[e] = where(at < 0, n + t.members[e], t.cut.parts[at])
        t.groups.members[t.groups.of[e]] = t.members[e]


@source
def may_touch(t, i, j):
    """True for groups that may touch: of two members, or parts of a beam not in one stretch."""
    n, s = t.cut.fits.size, np.minimum(i, j)
    beams = np.maximum(i, j) < n
    s = where(beams, s, 1)
    one = (t.cut.fits[s] > 0.0) | ((i == j) & (t.cut.fits[s - 1] > 0.0))
    return (t.groups.allowed[t.groups.members[i], t.groups.members[j]] > 0) & ~(
        beams & (np.abs(i - j) < 2) & one)


@source
def _room(t, x, z):
    """The largest skin within which boxes around groups say that there is nothing."""
    y, G = t.seeds.starts.copy(), t.groups.members.size
    for b in range(t.seeds.dofs.shape[0]):
        for k in indices(y.size):
            y[k] += t.seeds.weights[b, k] * z[t.seeds.dofs[b, k]]
    a, c = _boxes(t.groups.of, t.of, x, G), _boxes(t.groups.of, t.seeds.e, y, G)
    least, some, others = FARTHEST * t.height, np.nonzero(a[0] < NOTHING)[0], np.nonzero(
        c[0] < NOTHING)[0]
    apart = np.empty(others.size)
    for i in some:
        for k in indices(apart.size):
            j = others[k]
            wide = np.maximum(0.0, np.maximum(a[0, i] + c[2, j], c[0, j] + a[2, i]))
            high = np.maximum(0.0, np.maximum(a[1, i] + c[3, j], c[1, j] + a[3, i]))
            apart[k] = where(may_touch(t, i, j), np.sqrt(wide * wide + high * high), NOTHING)
        least = min(least, smallest(apart))
    return least - t.seeds.widest - t.height


@source
def _boxes(groups, e, x, G):
    """The least x, y, -x, -y of places x of facets e by group, (4, G)."""
    out, of, sides = np.full((4, G), NOTHING), np.empty(e.size, np.int64), np.empty((4, e.size))
    for k in indices(e.size):
        of[k], sides[0, k], sides[1, k] = groups[e[k]], x[k].real, x[k].imag
        sides[2, k], sides[3, k] = -x[k].real, -x[k].imag
    for k in range(4):
        least_each(out[k], of, sides[k])
    return out


@source
def _face(t, known, near, found):
    """Find the nearest facet of each point of some candidates that it may touch."""
    curve, n, P = found.curve, near.size, found.x.size
    zeta, gap, away, beyond = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    of, facets, order = np.empty(n, np.int64), np.empty(n, np.int64), np.arange(n)
    front, groups = np.full(known.p.size, NOTHING), np.empty(n, np.int64)
    before = np.empty(n)
    for i in indices(n):
        p, e = known.p[near[i]], known.e[near[i]]
        x = found.x[p]
        s, there = project(t, curve, e, known.zeta[near[i]], x)
        s = where(there, s, clipped(s, -1.0, 1.0))
        c, T, _ = along(curve, e, s)
        outer, d, begins = scaled(t.sides[e] / size(T), turned(T)), x - c, t.begins[p]
        g, joined = where(there, dot(outer, d), size(d)) - t.offsets[e], together(t, p, e, s, 0.0)
        left = where(g < begins, -DEEPEST * t.height - g, g - begins)
        beyond[i] = where(joined, NOTHING, left)
        fits = there & (g < begins) & (g > -DEEPEST * t.height) & (
            dot(outer, found.normal[p]) < t.opposed[p])
        away[i] = where(fits, np.abs(g) + np.maximum(np.abs(s) - 1.0, 0.0) * t.lengths[e], NOTHING)
        away[i] = where(joined, NOTHING, away[i])
        zeta[i], gap[i], of[i], facets[i] = s, g, p, e
        groups[i], before[i] = known.group[near[i]], where(
            there & ((g > 0.0) | (g >= begins)) & ~joined, np.maximum(g, 0.0), NOTHING)
    found.clear[0] = min(found.clear[0], smallest(beyond))
    # what is in front of the nearest face of an outline is not behind another one of it
    least_each(front, groups, before)
    for i in indices(n):
        away[i] = where(away[i] > front[groups[i]], NOTHING, away[i])
    least, first = np.full(P, 0.5 * NOTHING), np.full(P, n)
    least_each(least, of, away)
    for i in indices(n):
        order[i] += n * (away[i] > least[of[i]])
    least_each(first, of, order)
    hit = np.nonzero(first < n)[0]
    for p in indices(hit.size):
        i = first[hit[p]]
        found.e[hit[p]], found.zeta[hit[p]], found.gap[hit[p]] = facets[i], zeta[i], gap[i]


@source
def place(t, e, zeta):
    """Where points of facets are along their curve."""
    return t.places[e] + 0.5 * (1.0 + zeta) * t.lengths[e]


@source
def together(t, p, e, zeta, less):
    """True for points and facets of one beam, or of joined ones, near to each other; closer by
    ``less`` lengths of the facet."""
    own = t.of[p]
    a = t.places[own] + 0.5 * (1.0 + t.zeta[p]) * t.spans[own]
    b, apart = t.places[e] + 0.5 * (1.0 + zeta) * t.spans[e], (
        APART * t.heights[e] - less * t.lengths[e])
    out = (t.members[own] == t.members[e]) & (t.chains[own] == t.chains[e]) & (
        np.abs(a - b) < apart)
    for k in range(t.joined.shape[0]):
        i, s, j, r = t.joined[k, 0], t.joined[k, 1], t.joined[k, 2], t.joined[k, 3]
        out = out | ((t.chains[own] == i) & (t.chains[e] == j) & (np.abs(a - s) < apart) & (
            np.abs(b - r) < apart))
    return out


@source
def facing(n, F, P):
    """A :class:`Facing` of P points and F facets with n coefficients."""
    return Facing(np.empty((n, F), np.complex128), np.empty(P, np.complex128),
                  np.empty(P, np.complex128), np.empty(P, np.int64), np.empty(P), np.empty(P),
                  np.empty(1))


@source
def faced(t, z):
    """The :class:`Facing` at displacements z."""
    found = facing(t.starts.shape[0], t.starts.shape[1], t.of.size)
    look(t, z, found)
    return found


# pairs at the two ends of a step


@source
def gap_to(t, curve, e, zeta, x):
    """The gap of x from facets e at zeta."""
    c, T, _ = along(curve, e, zeta)
    return t.sides[e] * cross(T, x - c) / size(T) - t.offsets[e]


@source
def meet(t, same, f0, f1):
    """The :class:`Meeting` between two states, or at one."""
    P = f1.e.size
    facets = np.empty(P, np.int64)
    for p in indices(P):
        facets[p] = where(f1.e[p] < 0, f0.e[p], f1.e[p])
    at = np.nonzero(facets >= 0)[0]
    n, of = at.size, facets[at]
    zeta, before, after = np.empty(n), np.empty(n), np.empty(n)
    for i in indices(n):
        p, e = at[i], of[i]
        begins = t.begins[p]
        if same:
            zeta[i], before[i], after[i] = f1.zeta[p], begins - f1.gap[p], begins - f1.gap[p]
        else:
            here, there = f1.e[p] == e, f0.e[p] == e
            guess = where(here, f1.zeta[p], f0.zeta[p])
            s0, g0 = _other(t, f0, p, e, guess, there)
            s1, g1 = _other(t, f1, p, e, guess, here)
            before[i], after[i] = begins - g0, begins - g1
            zeta[i] = _mean_place(t, f0, f1, p, e, s0, s1, g1 - g0)
    return Meeting(at, of, zeta, before, after)


@source
def _other(t, found, p, e, guess, known):
    """Place and gap of pairs at a state, of known ones and others; no penetration of those that
    are apart."""
    s, there = project(t, found.curve, e, guess, found.x[p])
    s = where(there, s, guess)
    gap = np.maximum(gap_to(t, found.curve, e, s, found.x[p]), t.begins[p])
    return where(known, found.zeta[p], s), where(found.e[p] >= 0, found.gap[p], gap)


@source
def _mean_place(t, f0, f1, p, e, s0, s1, given):
    """Where between two places the gap changes as ``given``, or nearly so."""
    # The gap is least at the closest point, so there is one.
    low, high = np.minimum(s0, s1), np.maximum(s0, s1)
    x, y = f0.x[p], f1.x[p]
    below = gap_to(t, f1.curve, e, low, y) - gap_to(t, f0.curve, e, low, x) - given
    above = gap_to(t, f1.curve, e, high, y) - gap_to(t, f0.curve, e, high, x) - given
    zeta, left, going = low, below, np.abs(given) >= 0.0
    for _ in range(MEANS):
        slope = above - below
        share = where(slope == 0.0, 0.5, -below / where(slope == 0.0, 1.0, slope))
        zeta = where(going, low + clipped(share, 0.0, 1.0) * (high - low), zeta)
        left = gap_to(t, f1.curve, e, zeta, y) - gap_to(t, f0.curve, e, zeta, x) - given
        going = going & (np.abs(left) > 1e-3 * np.abs(given) + 1e-15 * t.height)
        if everywhere(np.logical_not(going)):
            break
        up = left * below > 0.0
        low, below = where(going & up, zeta, low), where(going & up, left, below)
        high, above = where(up, high, where(going, zeta, high)), where(
            up, above, where(going, left, above))
    return zeta


@source
def stiffness_of(t, p, e):
    """Stiffness times area of pairs."""
    k = np.minimum(t.stiffness[t.of[p]], t.stiffness[e])
    return 0.5 * (1.0 + t.history[0]) * k * t.areas[p]


@source
def slip_along(t, end, p, e):
    """Slip of pairs along the facet at the end of a step, 1 for those with an anchor there, and the
    rate of the slip by the place along the facet. Those that have parted have none."""
    zeta, n = end.zeta[p], t.of.size
    _, T, A = along(end.curve, e, zeta)
    length = size(T)
    depth = (end.gap[p] + t.offsets[e]) * t.sides[e] * cross(T, A) / length
    rate = (length - depth / length) * 2.0 / t.lengths[e]
    held = (end.e[p] >= 0) & (t.history[1 + p] == t.curves[e] + 1.0)
    slip = where(held, rate * (place(t, e, zeta) - t.history[1 + n + p]), 0.0)
    return slip, 1.0 * held, rate


# derivatives of the gap and of the place along the facet by r, t, c and T


@source
def mean_slope(a, b, side, s):
    """Mean derivative of the gap between two states, r, t, c and T each: its product with their
    change is the change of the gap.

    The gap is a function of the products of r - c, t and T, which do not change with rigid motions:
    differences of products are exact with means of the factors, so a force along the mean
    derivative keeps both momenta. For equal states it is the derivative.
    """
    rho0, rho1 = a[0] - a[2], b[0] - b[2]
    rho, t, T = scaled(0.5, rho0 + rho1), scaled(0.5, a[1] + b[1]), scaled(0.5, a[3] + b[3])
    m0, m1, M0, M1 = 1.0 / size(a[1]), 1.0 / size(b[1]), 1.0 / size(a[3]), 1.0 / size(b[3])
    b0, b1 = dot(a[3], a[1]), dot(b[3], b[1])
    m, M, both = 0.5 * (m0 + m1), 0.5 * side * (M0 + M1), 0.5 * (b0 + b1)
    depth = 0.5 * (cross(a[3], rho0) + s * b0 * m0 + cross(b[3], rho1) + s * b1 * m1)
    of_t, of_T = -2.0 * (m0 * m1) ** 2 / (m0 + m1), -2.0 * (M0 * M1) ** 2 / (M0 + M1)
    by_r = scaled(M, turned(T))
    return (by_r, scaled(M * s * m, T) + scaled(M * s * both * of_t, t), -by_r,
            scaled(M * s * m, t) - scaled(M, turned(rho)) + scaled(side * depth * of_T, T))


@source
def slip_row(a, b, s):
    """Derivative of the place of the point along the facet, ``conj(T) (x - c) / |T|``, for the mean
    of r, t, c and T at two states."""
    t, T = scaled(0.5, a[1] + b[1]), scaled(0.5, a[3] + b[3])
    length = 1.0 / size(T)
    slip, x = scaled(length, T), scaled(0.5, a[0] + b[0]) + scaled(s / size(t), turned(t))
    return slip, by_slope(t, s, slip), -slip, scaled(length, x - scaled(0.5, a[2] + b[2]))


@source
def vectors(t, found, p, e, zeta):
    """r, t, c and T of pairs at a state."""
    r, d, _ = along(found.curve, t.of[p], t.zeta[p])
    c, T, _ = along(found.curve, e, zeta)
    return r, d, c, T


@source
def way_along(a, b, row):
    """Change of the place along the facet between two states."""
    way = 0.0
    for v in range(COMPONENTS // 2):
        way = way + dot(row[v], b[v] - a[v])
    return way


@source
def touch_of(t, f0, f1, met):
    """The :class:`~skfem_ancf.actions.contact.points.Touch` of pairs."""
    n = met.at.size
    gap, slip, moved, k, trial, spring = (
        np.empty((COMPONENTS, n)), np.empty((COMPONENTS, n)), np.empty((COMPONENTS, n)),
        np.empty(n), np.zeros(n), np.zeros(n))
    for i in indices(n):
        p, e = met.at[i], met.e[i]
        s, stiffness = t.sides[t.of[p]] * t.offsets[t.of[p]], stiffness_of(t, p, e)
        a, b = vectors(t, f0, p, e, met.zeta[i]), vectors(t, f1, p, e, met.zeta[i])
        by_gap, by_slip = mean_slope(a, b, t.sides[e], s), slip_row(a, b, s)
        # where the gap is that of another facet at one end, its mean derivative is between both:
        # the nearest one along the motion with exact work, unless the gap jumps
        way, change = way_along(a, b, by_slip), way_along(a, b, by_gap)
        missing = met.before[i] - met.after[i] - change
        more = missing / (np.maximum(way * way + change * change, (missing / JUMP) ** 2)
                          + (CLOSE * t.height) ** 2)
        for v in range(COMPONENTS // 2):
            put(gap, v, i, scaled(1.0 + more * change, by_gap[v]) + scaled(
                more * way, by_slip[v]))
            put(slip, v, i, by_slip[v])
            put(moved, v, i, b[v] - a[v])
        k[i] = stiffness
        if t.friction > 0.0:
            path, held, _ = slip_along(t, f1, p, e)
            # what has no anchor slips from where it was at the start of the step
            new = held == 0.0
            trial[i] = stiffness * where(new, way, path)
            spring[i] = stiffness * where(new, 1.0 * (way != 0.0), held)
    return Touch(met.at, k, met.before, met.after, np.zeros(n), moved, gap, slip, trial, spring)


# forces


@source
def both_faced(t, z0, z1, same):
    """The :class:`Facing` at two states, or at one."""
    end = faced(t, z1)
    if same:
        return end, end
    start, away = Facing(t.start.curve, t.start.x, t.start.normal, t.start.e, t.start.zeta,
                         t.start.gap, t.start.clear), np.empty(z0.size)
    for k in indices(away.size):
        away[k] = size(z0[k] - t.start_at[k])
    if not largest(away) <= 0.0:  # all iterations of a step begin there
        look(t, z0, start)
        copy(z0, t.start_at)
    return start, end


@apart("pairs", PAIRS, C1, C1, bool, C1, F1)
def pair_force(t, z0, z1, same, out, clear):
    """Add the mean force between two states, or that at one; ``clear`` (1,) gets the least gap."""
    f0, f1 = both_faced(t, z0, z1, same)
    clear[0] = f1.clear[0]
    met = meet(t, same, f0, f1)
    if met.at.size > 0:
        touch, n, B = touch_of(t, f0, f1, met), met.at.size, t.N.shape[0]
        R, c, T, dofs = np.zeros((COMPONENTS, n)), np.empty((B, n), np.complex128), np.empty(
            (B, n), np.complex128), np.empty((B, n), np.int64)
        add_resistance(touch, respond(touch, t.width, t.friction, 0.0, 1.0), R)
        spread(t.point_dofs, t.N, t.D, met.at, R, out)
        for b in range(B):
            weights = t.weights[b]
            for i in indices(n):
                c[b, i], T[b, i], _ = along(weights, met.e[i], met.zeta[i])
                dofs[b, i] = t.dofs[b, met.e[i]]
        spread(dofs, c, T, np.arange(n), R[4:], out)


@apart("pairs", PAIRS, C1, C1, F1, returns=float)
def pair_accept(t, z0, z1, after):
    """Set the history at the end of a step between two states, and return what it dissipates."""
    f0, f1 = both_faced(t, z0, z1, False)
    met, n = meet(t, False, f0, f1), t.of.size
    touch = touch_of(t, f0, f1, met)
    r, lost = respond(touch, t.width, t.friction, 0.0, 1.0), np.empty(met.at.size)
    product(touch.slip, touch.moved, lost)
    at = np.nonzero(f1.e >= 0)[0]
    curves, anchors = np.zeros(n), np.zeros(n)
    for i in indices(at.size):
        p, e = at[i], f1.e[at[i]]
        a, (slip, held, rate) = t.begins[p] - f1.gap[p], slip_along(t, f1, p, e)
        x, y = vectors(t, f0, p, e, f1.zeta[p]), vectors(t, f1, p, e, f1.zeta[p])
        row = slip_row(x, y, t.sides[t.of[p]] * t.offsets[t.of[p]])
        slip = where(held == 0.0, way_along(x, y, row), slip)
        left, _ = return_mapping(slip, t.friction * mean_pressure(a, a, t.width))
        curves[p], anchors[p] = t.curves[e] + 1.0, place(t, e, f1.zeta[p]) - left / rate
    copy(curves, after[1:1 + n])
    copy(anchors, after[1 + n:])
    return inner(r.friction, lost)


@apart("pairs", PAIRS, C1, C1, bool, I1, F1, F2, returns=int)
def pair_stiffness(t, z0, z1, same, facets, zeta, K):
    """Derivative of the resisting force of n pairs by r, t, c and T, twice that of the mean force.
    ``facets`` (P,) get those of points in contact, else -1, ``zeta`` (P,) the places on them, K the
    derivatives, (64, n), for P columns."""
    f0, f1 = both_faced(t, z0, z1, same)
    met, n = meet(t, same, f0, f1), COMPONENTS
    touch = touch_of(t, f0, f1, met)
    r = respond(touch, t.width, t.friction, 0.0, 1.0 if same else 2.0)
    for p in indices(facets.size):
        facets[p] = -1
    for i in indices(met.at.size):
        p, e = met.at[i], met.e[i]
        facets[p], zeta[p] = e, met.zeta[i]
        (x0, d0, c0, T0), (x1, d1, c1, T1) = (vectors(t, f0, p, e, met.zeta[i]), vectors(
            t, f1, p, e, met.zeta[i]))
        d, T, s = scaled(0.5, d0 + d1), scaled(0.5, T0 + T1), t.sides[t.of[p]] * t.offsets[t.of[p]]
        # curvature of the gap: of the facet, of its turns and of the point along it
        bend = scaled(0.5, along(f0.curve, e, met.zeta[i])[2] + along(
            f1.curve, e, met.zeta[i])[2])
        length = size(T)
        outer, x = scaled(t.sides[e] / length, turned(T)), scaled(0.5, x0 + x1 - c0 - c1) + scaled(
            s / size(d), turned(d))
        tangent, P, F = scaled(1.0 / length, T), r.pressure[i], r.friction[i] / length
        # the slip from the anchor stretches
        held = (1.0 if same else 2.0) * r.friction[i] * (r.spring[i] > 0.0)
        depth, curl, stretch = dot(outer, x) / length, dot(outer, bend), dot(tangent, bend)
        share = 1.0 / (length - depth * curl)  # of the slip in the change of zeta
        turns = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, outer.real, outer.imag)
        grows = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, tangent.real, tangent.imag)
        for a in range(n):
            on = share * touch.slip[a, i]
            w = on - depth / length * (turns[a] + curl * on)
            for b in range(n):
                at = share * touch.slip[b, i]
                K[n * a + b, i] = P * (w * turns[b] + (curl * w + turns[a]) * at) + F * (
                    touch.gap[a, i] * (turns[b] + curl * at)
                    + turns[a] * (touch.gap[b, i] - depth * (grows[b] + stretch * at))
                    + grows[a] * (touch.slip[b, i] - depth * turns[b] - 2.0 * length * at)) + (
                    held * on * (grows[b] + stretch * at - curl / length * touch.gap[b, i]))
        add_bend(d, s, scaled(-P, outer) + scaled(r.friction[i], tangent), i, K)
    add_coupling(touch, r, K[:, :met.at.size])
    return met.at.size
