"""Tables of the contact kernels: surface points, obstacles, and history data. A contact pair is the
surface of one beam with one obstacle. Its arrays are consecutive parts of those in
:class:`ContactTables`; :func:`pair_of` returns views with names."""

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np

from ...core.band import largest
from ...core import F1, F2, I1, MADE, indices, shaped, source

#: Shapes of obstacles: circles and lines are polygons.
OUTLINE, CUSTOM = range(2)
#: Requests to all pairs, see :class:`Request`.
FORCE, RESISTING, TANGENT, DAMPED_TANGENT, ALONG, SETTLE, AUGMENT = map(np.int64, range(7))
#: Header of a pair: kind and number of its obstacle, numbers of elements, of points per element, of
#: pairs of degrees of freedom per point, flag of normals that depend on slopes, number of shape
#: parameters; offsets of its integers, numbers and history data.
KIND, OBSTACLE, ELEMENTS, POINTS, PAIRS, SLOPES, SHAPE, INTS, FLOATS, MEMORY = range(10)
HEADER = 10
#: Parameters of a pair: penalty stiffness, width of the transition, friction, tangential stiffness,
#: damping, additional stiffness in a time step, largest reference distance of a point from the
#: middle of its element, 1 or -1 for outside or inside of the shape, and the tolerance of the
#: augmented Lagrangian, zero for the penalty.
STIFFNESS, WIDTH, FRICTION, STICKING, DAMPING, INERTIA, RADIUS, SIDE, TOLERANCE = range(9)
NUMBERS = 9
#: Rows of reference data of points: area, distance from the axis, position and slope.
AREA, OFFSET, START = range(3)
#: Rows of the points' history data: the multiplier of the augmented Lagrangian over the stiffness,
#: the anchor of friction in the obstacle's frame, and the distance of the point from it.
MULTIPLIER, ANCHOR_X, ANCHOR_Y, SLIP = range(4)
#: Pose of an obstacle: displacement, cosine and sine of its angle, its pivot, its velocities, and
#: the time. There are three: at a time, and at the beginning and end of a mean.
POSE, POSES = 10, 30
NOW, BEGIN, END = map(np.int64, range(3))
#: History data of all pairs: 1 if points stick to anchors; 1 / dt^2 of the last time step; 1 if
#: points with multipliers are bilateral; for each pair the largest multiplier, then the factor of
#: hardening; then the data of the points; at the end the angles of torsional springs.
ANCHORED, RATE, BILATERAL, LARGEST = range(4)
#: Flags of history data: anchors, angles of torsional springs, multipliers.
ANCHORS, TURNS, PRESSURES = 1, 2, 4
TINY = 1e-200


class Request(NamedTuple):
    """A request to all pairs at time ``t``, or over a ``span`` of time about it.

    ``what`` is FORCE: the mean force from u to v. RESISTING: friction and damping at u for velocity
    v. TANGENT: the derivative of FORCE by the end state, twice unless the span is zero, into a band
    of layout ``ld, top``. DAMPED_TANGENT: that of RESISTING by velocities times ``factor``, plus by
    positions. ALONG: the derivative of the work of FORCE at u along v, added to ``out[0]``, and the
    largest displacement relative to element lengths, into ``out[1]``. SETTLE: update anchors after
    a step from u to v, and add the work of friction and augmented pressures to ``out[0]``. AUGMENT:
    update multipliers at u, and add the number of changes.
    """

    what: int
    t: float
    span: float
    factor: float
    ld: int
    top: int


class ContactTables(NamedTuple):
    """The obstacles of a scene, as ``number`` pairs. ``ints`` and ``floats`` are headers of pairs,
    DOFs, and parameters of points and shapes; ``poses`` those of obstacles at the last time;
    ``memory`` history data. ``moving`` tells whether poses depend on time, ``custom`` is the handle
    for poses and user-defined shapes, ``lasting`` the sum of flags of history data: ANCHORS, TURNS,
    PRESSURES. ``clear`` says where nothing touches, see :func:`is_clear`; it is empty if obstacles
    move, or have multipliers."""

    number: int
    ints: I1
    floats: F1
    poses: F1
    memory: F1
    moving: int
    custom: int
    lasting: int
    clear: F1


class Pair(NamedTuple):
    """The surface of one beam with one obstacle: views of :class:`ContactTables`. ``first`` is the
    first degree of freedom of each point's element, (n,); ``weights`` and ``slopes`` those of pairs
    of degrees of freedom in its position and slope, (pairs, n); ``middles`` positions and weights
    of element middles; the parameters end with those of the shape. ``common`` is the history data
    shared by all pairs."""

    k: int
    number: int
    moving: int
    custom: int
    header: I1
    first: I1
    weights: F2
    slopes: F2
    points: F2
    middles: F2
    numbers: F1
    poses: F2
    memory: F2
    common: F1


#: The type of a pair in compiled code.
PAIR: TypeAlias = Annotated[Pair, MADE]


@source
def pair_of(tables, k):
    """The pair number k."""
    h, floats = tables.ints[k * HEADER:(k + 1) * HEADER], tables.floats
    elements, pairs, slopes = h[ELEMENTS], h[PAIRS], h[PAIRS] * h[SLOPES]
    n, at = elements * h[POINTS], h[FLOATS]
    points = at + (pairs + slopes) * n
    middles = points + 6 * n
    numbers = middles + (2 + 2 * pairs) * elements
    pose = h[OBSTACLE] * POSES
    return Pair(
        k, tables.number, tables.moving, tables.custom, h, tables.ints[h[INTS]:h[INTS] + n],
        shaped(floats[at:at + pairs * n], (pairs, n)),
        shaped(floats[at + pairs * n:points], (slopes, n)),
        shaped(floats[points:middles], (6, n)),
        shaped(floats[middles:numbers], (2 + 2 * pairs, elements)),
        floats[numbers:numbers + NUMBERS + h[SHAPE]],
        shaped(tables.poses[pose:pose + POSES], (3, POSE)),
        shaped(tables.memory[h[MEMORY]:h[MEMORY] + 4 * n], (4, n)),
        tables.memory)


#: How far points may move from displacements at which nothing touches; 1 if the tangent of the last
#: step has entries of contact; how far anchors of friction follow points; from SEEN on the
#: displacements (N,), then weights (N,): a point moves by no more than the largest weighted change.
MARGIN, HAS_ENTRIES, FOLLOWED, SEEN = range(4)
#: Part of a gap that is the margin: two surfaces may approach each other.
SAFE = 0.4


@source
def is_clear(clear, u, less):
    """True if nothing can touch at u (N,), with a margin that is smaller by ``less``."""
    n = u.size
    if clear.size == 0 or not clear[MARGIN] > less:
        return False
    moved, seen, weights = np.empty(n), clear[SEEN:SEEN + n], clear[SEEN + n:]
    for i in indices(n):
        moved[i] = weights[i] * (u[i] - seen[i])
    return largest(moved) < clear[MARGIN] - less


@source
def set_clear(clear, u, gap):
    """Note that the least gap at u is ``gap``."""
    clear[MARGIN], seen = SAFE * gap, clear[SEEN:SEEN + u.size]
    for i in indices(u.size):
        seen[i] = u[i]


def clear_table(weights: np.ndarray, followed: float = 0.0) -> np.ndarray:
    """A table without a margin."""
    return np.concatenate([[0.0, 0.0, followed], 0.0 * weights, weights])


def weights_of_motion(weights: np.ndarray, dofs: np.ndarray, n: int) -> np.ndarray:
    """Weights (n,) of pairs of DOFs from those in the motion of points, (P, B) each."""
    largest = np.zeros(n)
    np.maximum.at(largest, dofs, weights)
    return largest * np.max(np.sum(weights / np.maximum(largest[dofs], TINY), axis=1))


@source
def transition(pair):
    """Width of the transition; shorter in proportion if the obstacle is stiffened."""
    return pair.numbers[WIDTH] / np.maximum(1.0, 1.0 + pair.common[LARGEST + pair.number + pair.k])


@source
def hardening(pair):
    """Factor on the given stiffness, from loads or time steps."""
    return (1.0 + pair.common[LARGEST + pair.number + pair.k]
            + pair.numbers[INERTIA] * pair.common[RATE] / pair.numbers[STIFFNESS])
