"""Tables of springs, foundations and drag, and kernels of their forces and derivatives. An element
has vectors that are affine in the degrees of freedom: positions, their differences, directions of
sections. Elements of the kinds below have two, ``d`` and ``e``: four numbers, the rows of arrays
(4, n), with elements of one kind side by side. Vectors of user-defined elements follow in the same
array. Forces are resisting, as internal forces."""

from typing import Annotated, NamedTuple

import numpy as np

from ...core.band import clear, copy, dot
from ...beam.kernels.moments import mean_turning
from ...core.callbacks import ELEMENTS, POSES, call_custom
from ...core import F1, F2, I1, MADE, apart, indices, shaped, source
from ..tables import add_each, add_products
from ..contact.kernels import of_contacts, untouched
from ..contact.pairs import pair_accept, pair_force, pair_tables
from ..contact.stretches import straight_within
from ..contact.tables import (ALONG, FAR, FORCE, HAS_ENTRIES, SAFE, SEARCHED, SETTLE, TANGENT,
                              TURNS, ContactTables, Request, RESISTING as RUBBING, is_clear,
                              left_of, motion, set_clear, share_of)

#: Kinds of elements.
KINDS = 4
SPRING, TORSION, FOUNDATION, DRAG = map(np.int64, range(KINDS))
#: Parameters of an element. All but drags have a coordinate, its stiffness and damping, two
#: numbers, of a spring the free length, of torsion cosine and sine of the free angle, of a
#: foundation the normal, and 1 if they act at positive coordinates only. Those of a drag are
#: factors of the squared normal and tangential velocity.
NUMBERS = 5
TINY = 1e-200
TURN = 2.0 * np.pi
#: For the layout of a band where there is none.
NONE = np.int64(0)
#: The span of a mean between two states at one time.
NO_SPAN = 1e-300
#: Largest number of looks on the way of a correction.
BALLS = 8


class Kinds(NamedTuple):
    """Elements of the kinds above. Their number, the first of each kind, their parameters, and the
    angles of torsional springs at the end of the last step, with whole turns."""

    number: int
    ends: I1
    numbers: F2
    turns: F1


class Rested(NamedTuple):
    """The last two displacements at which changing elements were known to rest, how far points may
    move from each, and which one was asked for last: 0 or 1."""

    at: F2  # (2, N)
    within: F1
    last: I1


class ForceTables(NamedTuple):
    """The force elements of a scene.

    ``start, at, of, weight`` are vectors in the reference configuration; rows, DOFs and weights of
    their derivatives, of the length ``size``. ``number, ends, numbers``: of elements of the kinds
    above, of kinds among them, and parameters (5, n). ``band_at, band_of, band_weight`` are
    positions in the band, derivatives and weights; ``row_at, row_of`` those of elements that couple
    distant DOFs. ``custom`` is the handle of user-defined elements or 0, of which ``changing``
    change their pattern; ``clear`` says where they do nothing, see
    :func:`~skfem_ancf.actions.contact.tables.is_clear`. ``paired`` of these are contact of members,
    with ``pairs``: their :class:`~skfem_ancf.actions.contact.pairs.PairTables`, or the addresses of
    these in compiled code.
    """

    start: F1
    at: I1
    of: I1
    weight: F1
    number: int
    ends: I1
    numbers: F2
    size: int
    band_at: I1
    band_of: I1
    band_weight: F1
    row_at: I1
    row_of: I1
    custom: int
    contacts: ContactTables
    changing: int
    clear: F1
    paired: int
    pairs: I1
    rested: Rested


@source
def vectors_of(tables, u, factor, out):
    """out = factor * start + the part linear in u."""
    for k in indices(out.size):
        out[k] = factor * tables.start[k]
    add_products(out, tables.at, tables.weight, u, tables.of)


@source
def _part(kinds, kind, x):
    """A view of the columns of one kind."""
    return x[:, kinds.ends[kind]:kinds.ends[kind + 1]]


@source
def _of(kinds, kind, y, q):
    """Parameters, vectors, and numbers (n,) of one kind."""
    return (_part(kinds, kind, kinds.numbers), _part(kinds, kind, y),
            q[kinds.ends[kind]:kinds.ends[kind + 1]])


#: Values of ``what``; from PUSHING on of elements whose stiffness changes its pattern alone: their
#: force, its derivative along a correction, and the entries of the tangent of a step.
ELASTIC, RESISTING, DERIVATIVES, TURNED, SETTLED, PUSHING, ALONG_PUSHING, ENTRIES = range(8)


@source
def kinds_of(tables):
    """The :class:`Kinds` of a scene."""
    # the angles of their torsional springs are the last of the history data
    memory, turning = tables.contacts.memory, tables.ends[TORSION + 1] - tables.ends[TORSION]
    return Kinds(tables.number, tables.ends, tables.numbers, memory[memory.size - turning:])


@source
def _evaluate(tables, what, t, factor, y, w, out):
    """Evaluate ``what`` for all kinds and for user-defined elements."""
    if tables.number > 0:
        of_kinds(kinds_of(tables), what, y, w, factor, out)
    if tables.custom > 0:
        call_custom(ELEMENTS, tables.custom, what, t, factor, y, w, out)


@apart("elements", ForceTables, int, float, float, F1, F1, float, F1)
def _add_force(tables, what, t, span, u, v, start, f):
    """Add the force for vectors at u and, without ``start``, rates at v."""
    size = tables.start.size
    y, w, F = np.empty(size), np.empty(size), np.zeros(size)
    vectors_of(tables, u, 1.0, y)
    vectors_of(tables, v, start, w)
    _evaluate(tables, what, t, span, y, w, F)
    add_products(f, tables.of, tables.weight, F, tables.at)


@source
def at_rest(tables, u0, u1, guess):
    """True if no changing element does anything at both displacements. Sections of a ``guess`` may
    be turned so far that no stretch is known to be straight: margins alone are asked."""
    if guess > 0:
        return is_clear(tables.clear, u0, 0.0) and is_clear(tables.clear, u1, 0.0)
    return rests(tables, u0, 0.0) and rests(tables, u1, 0.0)


@source
def rests(tables, u, less):
    """True if it is known that no changing element does anything at u, with a margin that is
    smaller by ``less``."""
    rested, last = tables.rested, tables.rested.last[0]
    for k in (last, 1 - last):  # it is asked several times in an iteration
        room = rested.within[k] - max(less, 0.0)
        if room >= 0.0 and motion(tables.clear, u, rested.at[k]) <= room:
            rested.last[0] = k
            return True
    if not is_clear(tables.clear, u, less):
        return False
    searches, straight, left = 0.0, FAR, left_of(tables.clear, u)
    for k in range(tables.paired):
        pair = pair_tables(tables, k)
        searches += pair.found[1]
        straight = min(straight, straight_within(pair.rows, pair.cut, _used(pair, u)))
    # the margin is that of pairs not in one stretch
    if not straight > 0.0 or searches != tables.clear[SEARCHED]:
        return False
    if left > 0.0:
        copy(u, rested.at[1 - last])
        rested.within[1 - last], rested.last[0] = min(straight, left), 1 - last
    return True


@source
def add_elastic_force(tables, t, span, u0, u1, guess, f):
    """Add the mean force at zero velocity with exact work from u0 to u1."""
    # It is a mean over a time span about t; the force at t for u0 = u1 and span zero. ``guess`` is
    # that of :func:`at_rest`.
    if tables.start.size > 0:
        _add_force(tables, np.int64(ELASTIC), t, span, u0, u1, 1.0, f)
    if tables.paired > 0 and not at_rest(tables, u1 if span == 0.0 else u0, u1, guess):
        _add_pairs(tables, span, u0, u1, f)
    ask_obstacles(tables, Request(FORCE, t, span, 0.0, NONE, NONE), u0, u1, f)


@source
def _add_pairs(tables, span, u0, u1, f):
    """Add the mean force of members that touch each other."""
    found, total = np.empty(1), f.view(np.complex128)
    least = FAR if tables.changing == tables.paired else 0.0  # of others no gap is known
    tables.clear[SEARCHED] = 0.0
    for k in range(tables.paired):
        pair = pair_tables(tables, k)
        out = np.zeros(pair.used.size, np.complex128)
        pair_force(pair, _used(pair, u0), _used(pair, u1), span == 0.0, out, found)
        least = min(least, found[0])
        tables.clear[SEARCHED] += pair.found[1]
        add_each(total, pair.used, out)
    set_clear(tables.clear, u1, 0.5 * SAFE * least)
    tables.rested.within[0] = tables.rested.within[1] = -1.0  # of another margin


@source
def _used(pair, u):
    """The pairs of degrees of freedom of surfaces, as complex numbers."""
    return u.view(np.complex128)[pair.used]


@source
def add_resisting_force(tables, t, u, v, f):
    """Add the velocity-dependent part of the force."""
    if tables.start.size > 0:
        _add_force(tables, np.int64(RESISTING), t, 0.0, u, v, 0.0, f)
    ask_obstacles(tables, at_time(RUBBING, t), u, v, f)


@apart("contacts", ContactTables, Annotated[Request, MADE], F1, F1, F1)
def add_contact(contacts, at, u, v, out):
    if contacts.moving > 0:
        call_custom(POSES, contacts.custom, np.int64(0), at.t, at.span, contacts.poses,
                    contacts.poses, contacts.poses)
        if np.isnan(contacts.poses[0]):  # a user's function failed: no iteration may end with it
            for i in range(out.size):
                out[i] = np.nan
            return
    of_contacts(contacts, at, u, v, out)


@source
def ask_obstacles(tables, request, u, v, out):
    """Add the answer of the obstacles to a :class:`~skfem_ancf.actions.contact.tables.Request`."""
    if tables.contacts.number > 0:
        add_contact(tables.contacts, request, u, v, out)


@source
def at_time(what, t):
    """A request at one time that needs no band."""
    return Request(what, t, 0.0, 0.0, NONE, NONE)


@source
def nothing_touches(tables, u):
    """True if it is known that no obstacle touches at u, and that changing elements do nothing."""
    return _is_free(tables, tables.contacts.number > 0, u)


@source
def _is_free(tables, walls, u):
    """True if it is known that members do not touch at u and, with ``walls``, nor do obstacles."""
    return (not walls or untouched(tables.contacts, FORCE, u)) and (
        tables.changing == 0 or rests(tables, u, 0.0))


@source
def contact_work(tables, t, u, du, f):
    """Product of the contact force at u and du; f is workspace, zero on return."""
    if nothing_touches(tables, u):
        return 0.0
    ask_obstacles(tables, at_time(FORCE, t), u, u, f)
    if tables.changing > tables.paired:
        call_custom(ELEMENTS, tables.custom, np.int64(PUSHING), t, 0.0, u, u, f)
    if tables.paired > 0:
        _add_pairs(tables, 0.0, u, u, f)
    work = dot(f, du)
    clear(f)
    return work


@source
def looked_free(tables, t, walls, u, f):
    """:func:`_is_free`, after a look at u; f is workspace, zero on return."""
    if walls:
        ask_obstacles(tables, at_time(FORCE, t), u, u, f)
    if tables.paired > 0:
        _add_pairs(tables, 0.0, u, u, f)
    clear(f)
    return _is_free(tables, walls, u)


@apart("contacts", ForceTables, float, bool, F1, F1, F1, returns=bool)
def way_is_clear(tables, t, walls, u, du, f):
    """True if it is known that members do not touch on the way from u, where they do not, along du
    and, with ``walls``, nor do obstacles; f is workspace."""
    ahead = u + du
    if _is_free(tables, walls, ahead):
        return True
    # what is left at u, and what is found ahead, are balls around points that have to meet, or
    # others between them
    contacts = tables.contacts
    by_obstacles, by_members = left_of(contacts.clear, u), left_of(tables.clear, u)
    for _ in range(BALLS):
        if not looked_free(tables, t, walls, ahead, f):
            return False
        if (not walls or is_clear(contacts.clear, u, -by_obstacles)) and (
                tables.changing == 0 or rests(tables, u, -by_members)):
            return True
        share = min(share_of(contacts.clear, u) if walls else 1.0,
                    share_of(tables.clear, u) if tables.changing > 0 else 1.0)
        if not share * BALLS > 1.0:
            return False
        for i in indices(u.size):
            ahead[i] += share * (u[i] - ahead[i])
    return False


@source
def contact_along(tables, t, u, du, out):
    """Derivative of :func:`contact_work` along du, and the largest slip of an element, (2,)."""
    out[0], out[1] = 0.0, 0.0
    ask_obstacles(tables, at_time(ALONG, t), u, du, out)
    if tables.changing > 0:
        call_custom(ELEMENTS, tables.custom, np.int64(ALONG_PUSHING), t, 0.0, u, du, out)


@apart("elements", ForceTables, float, F1, F1, float, F1)
def element_stiffness(tables, t, u, v, factor, D):
    """Derivative by the vectors plus factor times that by their velocities, shape (size,)."""
    size = tables.start.size
    y, w = np.empty(size), np.empty(size)
    vectors_of(tables, u, 1.0, y)
    vectors_of(tables, v, 0.0, w)
    clear(D)
    _evaluate(tables, np.int64(DERIVATIVES), t, factor, y, w, D)


@source
def add_element_tangent(tables, t, u, A):
    """Add the derivative of :func:`add_elastic_force` to a band, without distant couplings."""
    if tables.start.size > 0:
        D, v = np.empty(tables.size), np.zeros(u.size)
        element_stiffness(tables, t, u, v, 0.0, D)
        add_products(A.flat, tables.band_at, tables.band_weight, D, tables.band_of)
    ask_obstacles(tables, Request(TANGENT, t, 0.0, 0.0, A.ld, A.top), u, u, A.flat)


@source
def keep_entries(tables, t, factor, u0, u1, guess):
    """Keep the derivatives of changing elements, times a factor, beside the band of a step."""
    if tables.changing > 0 and (tables.clear[HAS_ENTRIES] > 0.0 or not at_rest(
            tables, u0, u1, guess)):
        call_custom(ELEMENTS, tables.custom, np.int64(ENTRIES), t, factor, u0, u1, u0)


@source
def settle_forces(tables, t, along, u0, u1, v, out):
    """Update the histories at the end of a step, with the velocity v there; the dissipated energy
    goes to out, (1,)."""
    # ``t`` are the instants of the forces of contact and of the end. Contact works from u0 to u1 in
    # the time ``along`` of a conserving step, or at u1 if that is 0.
    out[0], n = 0.0, tables.start.size
    y, w = np.empty(n), np.empty(2 * n)
    if tables.contacts.lasting & TURNS or tables.custom > 0:
        vectors_of(tables, u1, 1.0, w[:n])
    if tables.contacts.lasting & TURNS:  # less than half a turn from the last ones
        _evaluate(tables, np.int64(TURNED), 0.0, 0.0, w[:n], w[:n], y)
    ask_obstacles(tables, Request(SETTLE, t[0], along, 0.0, NONE, NONE),
                  u0 if along != 0.0 else u1, u1, out)
    if tables.custom > 0 and n > 0:
        vectors_of(tables, u0, 1.0, y)
        vectors_of(tables, v, 0.0, w[n:])
        call_custom(ELEMENTS, tables.custom, np.int64(SETTLED), t[1], 0.0, y, w, out)
    for k in range(tables.paired):
        pair = pair_tables(tables, k)
        if pair.friction > 0.0 and not at_rest(tables, u0, u1, 0):
            out[0] += pair_accept(pair, _used(pair, u0), _used(pair, u1), pair.history)


@source
def element_damping(tables, t, u, v, D):
    """Derivative by the velocities of the vectors, shape (size,)."""
    elastic = np.empty(tables.size)
    element_stiffness(tables, t, u, v, 1.0, D)
    element_stiffness(tables, t, u, v, 0.0, elastic)
    for i in indices(D.size):
        D[i] -= elastic[i]


@source
def put_far_stiffness(tables, D, factor, first, S):
    """Put derivatives of distant couplings times a factor between their rows, from ``first`` on."""
    k = S.shape[0] - first
    between = np.zeros(k * k)
    add_products(between, tables.row_at, np.ones(tables.row_at.size), D, tables.row_of)
    for a in range(k):
        for b in range(k):
            S[first + a, first + b] = factor * between[a * k + b]


# the kinds


@apart("elements", Annotated[Kinds, MADE], int, F1, F1, float, F1)
def of_kinds(kinds, what, y, w, factor, out):
    """Evaluate ``what`` for all kinds from vectors y, and end vectors or rates w."""
    n, p = kinds.number, kinds.numbers
    d, v = shaped(y[:4 * n], (4, n)), shaped(w[:4 * n], (4, n))
    if what == DERIVATIVES:
        derivatives(kinds, d, v, factor, shaped(out[:16 * n], (16, n)))
        return
    if what == TURNED:
        turned(_part(kinds, TORSION, p), _part(kinds, TORSION, d), kinds.turns, kinds.turns)
        return
    f = shaped(out[:4 * n], (4, n))
    q, g = coordinates(kinds, d), mean_slopes(kinds, d, v if what == ELASTIC else d)
    if what == ELASTIC:  # a mean between two states, which may be equal
        r = coordinates(kinds, v)
        for e in indices(q.size):  # (V1 - V0) / (q1 - q0), V = k q^2 / 2 or zero for q < 0
            a, b = q[e] * (1.0 - p[4, e] * (q[e] < 0.0)), r[e] * (1.0 - p[4, e] * (r[e] < 0.0))
            same = np.abs(r[e] - q[e]) < TINY
            share = (b - a) / (r[e] - q[e] + same) * (1.0 - same) + same * (
                1.0 - p[4, e] * (q[e] + r[e] < 0.0))
            q[e] = 0.5 * p[0, e] * (a + b) * share
    else:
        for e in indices(q.size):
            q[e] = p[1, e] * (1.0 - p[4, e] * (q[e] < 0.0)) * (
                g[0, e] * v[0, e] + g[1, e] * v[1, e] + g[2, e] * v[2, e] + g[3, e] * v[3, e])
    for i in range(4):
        for e in indices(q.size):
            f[i, e] = q[e] * g[i, e]
    if what == ELASTIC:
        return
    p, d = _part(kinds, DRAG, p), _part(kinds, DRAG, d)
    v, f = _part(kinds, DRAG, v), _part(kinds, DRAG, f)
    for e in indices(p.shape[1]):
        size = np.sqrt(d[2, e] * d[2, e] + d[3, e] * d[3, e])
        x, z = d[2, e] / size, d[3, e] / size
        along, across = v[0, e] * x + v[1, e] * z, v[1, e] * x - v[0, e] * z
        a, b = p[1, e] * np.abs(along) * along, p[0, e] * np.abs(across) * across
        f[0, e], f[1, e] = a * x - b * z, a * z + b * x


@source
def distance(d, e):
    """Length of vectors number e, not zero."""
    return np.sqrt(np.maximum(d[0, e] * d[0, e] + d[1, e] * d[1, e], TINY))


@source
def turned(p, y, last, out):
    """Angle from e to d minus the one without moment, less than half a turn from the last one."""
    for e in indices(out.size):
        cross = y[2, e] * y[1, e] - y[3, e] * y[0, e]
        dot = y[0, e] * y[2, e] + y[1, e] * y[3, e]
        angle = np.arctan2(p[2, e] * cross - p[3, e] * dot, p[2, e] * dot + p[3, e] * cross)
        out[e] = angle + TURN * np.rint((last[e] - angle) / TURN)


@source
def coordinates(kinds, y):
    """Elongations, angles and displacements along normals, (n,); zero for drags."""
    q = np.zeros(kinds.number)
    p, d, s = _of(kinds, SPRING, y, q)
    for e in indices(s.size):
        s[e] = distance(d, e) - p[2, e]
    p, d, s = _of(kinds, TORSION, y, q)
    turned(p, d, kinds.turns, s)
    p, d, s = _of(kinds, FOUNDATION, y, q)
    for e in indices(s.size):
        s[e] = p[2, e] * d[0, e] + p[3, e] * d[1, e]
    return q


@source
def mean_slopes(kinds, y0, y1):
    """Means of the derivatives of coordinates by the vectors, (4, n): times the change of these
    the change of the coordinates. For equal vectors, which may be one array, the derivatives."""
    g = np.zeros((4, kinds.number))
    a, b, f = _part(kinds, SPRING, y0), _part(kinds, SPRING, y1), _part(kinds, SPRING, g)
    for e in indices(f.shape[1]):
        c = 1.0 / (distance(a, e) + distance(b, e))
        f[0, e], f[1, e] = c * (a[0, e] + b[0, e]), c * (a[1, e] + b[1, e])
    a, b, f = _part(kinds, TORSION, y0), _part(kinds, TORSION, y1), _part(kinds, TORSION, g)
    if f.shape[1] > 0:
        mean_turning(a, b, f)
    p, f = _part(kinds, FOUNDATION, kinds.numbers), _part(kinds, FOUNDATION, g)
    for e in indices(f.shape[1]):
        f[0, e], f[1, e] = p[2, e], p[3, e]
    return g


@source
def add_bends(kinds, y, g, T, D):
    """Add T (n,) times the second derivatives of coordinates with derivatives g; (i, j) at 4 i + j.
    """
    _, d, c = _of(kinds, SPRING, y, T)
    h, s = g[:, :c.size], _part(kinds, SPRING, D)
    for e in indices(c.size):
        k = c[e] / distance(d, e)
        s[0, e] += k * h[1, e] * h[1, e]
        s[5, e] += k * h[0, e] * h[0, e]
        s[1, e] -= k * h[0, e] * h[1, e]
        s[4, e] -= k * h[0, e] * h[1, e]
    _, d, c = _of(kinds, TORSION, y, T)
    s = _part(kinds, TORSION, D)
    for k in range(2):  # that of the angle of d, and minus that of e
        for e in indices(c.size):
            x, z = d[2 * k, e], d[2 * k + 1, e]
            r = (1.0 - 2.0 * k) * c[e] / (x * x + z * z) ** 2
            s[10 * k, e] += 2.0 * r * x * z
            s[10 * k + 5, e] -= 2.0 * r * x * z
            s[10 * k + 1, e] += r * (z * z - x * x)
            s[10 * k + 4, e] += r * (z * z - x * x)


@source
def derivatives(kinds, y, w, factor, D):
    """Derivatives of forces, and factor times those of resisting ones by w; (i, j) at 4 i + j."""
    p, s, c = kinds.numbers, D, np.empty(kinds.number)
    q, g = coordinates(kinds, y), mean_slopes(kinds, y, y)
    for e in indices(q.size):
        c[e] = (p[0, e] + factor * p[1, e]) * (1.0 - p[4, e] * (q[e] < 0.0))
        q[e] = p[0, e] * q[e]
    for i in range(4):
        for j in range(4):
            for e in indices(q.size):
                s[4 * i + j, e] = c[e] * g[i, e] * g[j, e]
    add_bends(kinds, y, g, q, D)
    p, d = _part(kinds, DRAG, kinds.numbers), _part(kinds, DRAG, y)
    v, s = _part(kinds, DRAG, w), _part(kinds, DRAG, D)
    for e in indices(p.shape[1]):
        size = np.sqrt(d[2, e] * d[2, e] + d[3, e] * d[3, e])
        x, z = d[2, e] / size, d[3, e] / size
        a = 2.0 * factor * p[1, e] * np.abs(v[0, e] * x + v[1, e] * z)
        b = 2.0 * factor * p[0, e] * np.abs(v[1, e] * x - v[0, e] * z)
        s[0, e], s[5, e] = a * x * x + b * z * z, a * z * z + b * x * x
        s[1, e], s[4, e] = (a - b) * x * z, (a - b) * x * z
