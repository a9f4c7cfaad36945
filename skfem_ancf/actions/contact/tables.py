"""What the kernels of contact take: points of beams, obstacles, and what steps leave behind.

A contact pair is the surface of one beam with one obstacle. Its arrays lie one behind the other in
those of :class:`ContactTables`; :func:`pair_of` gives them their names.
"""

from typing import Any, NamedTuple

import numpy as np

from ...core.source import F1, I1, shaped, source

#: Shapes of obstacles: circles and lines are polygons.
OUTLINE, CUSTOM = range(2)
#: What is asked of all pairs, see :class:`Question`.
FORCE, RESISTING, TANGENT, DAMPED_TANGENT, ALONG, SETTLE, AUGMENT = map(np.int64, range(7))
#: Of a pair: kind and number of its obstacle, elements, points of each element, pairs of degrees of
#: freedom of each, whether normals depend on slopes, how many numbers the shape has; where its
#: integers, numbers and memory begin.
KIND, OBSTACLE, ELEMENTS, POINTS, PAIRS, SLOPES, SHAPE, INTS, FLOATS, MEMORY = range(10)
HEADER = 10
#: Numbers of a pair: penalty stiffness, width of the transition, friction, tangential stiffness,
#: damping, what a step in time adds to the stiffness, largest distance of a point from the middle
#: of its element without displacement, 1 or -1 outside or inside of the shape, and the penetration
#: that the augmented Lagrangian leaves, zero for the penalty.
STIFFNESS, WIDTH, FRICTION, STICKING, DAMPING, INERTIA, RADIUS, SIDE, TOLERANCE = range(9)
NUMBERS = 9
#: Rows of the points without displacement: area, distance from the axis, place and slope.
AREA, OFFSET, START = range(3)
#: Rows of the points' memory: the multiplier of the augmented Lagrangian over the stiffness, the
#: anchor of friction in the obstacle's frame, and how far the point was from it.
MULTIPLIER, ANCHOR_X, ANCHOR_Y, SLIP = range(4)
#: Pose of an obstacle: displacement, cosine and sine of its angle, the point about which it turns,
#: its velocities, and the time. There are three: at a time, and at the begin and end of a mean.
POSE, POSES = 10, 30
NOW, BEGIN, END = map(np.int64, range(3))
#: Memory of all pairs: 1 if points stick to anchors; 1 / dt^2 of the last step in time; 1 if points
#: with multipliers are held on both sides; for each pair the largest multiplier, then by how much
#: it is stiffer than by default; then the points' memories.
ANCHORED, RATE, BILATERAL, LARGEST = range(4)
#: What is kept from step to step: anchors, multipliers.
ANCHORS, PRESSURES = 1, 2
#: The row of projections of points that is the gap, behind place and slope and the surface.
GAP = 6


class Question(NamedTuple):
    """What is asked of all pairs, at a time ``t`` or over a ``span`` of time about it.

    ``what`` is FORCE: the mean force from u to v. RESISTING: that of friction and damping at u by
    the velocity v. TANGENT: the derivative of FORCE by the end of the mean, twice unless there is
    no span, to a band of the layout ``ld, top``. DAMPED_TANGENT: that of RESISTING by velocities
    times ``factor``, and by places. ALONG: the derivative of the work of FORCE at u along v to
    ``out[0]``, and the largest way of an element, in lengths of elements, into ``out[1]``. SETTLE:
    anchors follow after a step from u to v; the work of friction and of augmented pressures is
    added to ``out[0]``. AUGMENT: multipliers at u are updated; how many change is added there.
    """

    what: int
    t: float
    span: float
    factor: float
    ld: int
    top: int


class ContactTables(NamedTuple):
    """The obstacles of a scene, as ``number`` pairs.

    ``ints`` and ``floats`` are headers of the pairs and DOFs, and numbers of points and shapes;
    ``poses`` those of obstacles at the time asked last; ``memory`` what steps leave behind.
    ``moving`` says whether poses depend on time, ``custom`` is the handle of what knows them, and
    shapes of the caller's. ``lasting`` is the sum of what is kept from step to step: ANCHORS,
    PRESSURES. ``address`` is that of the compiled function, 0 in NumPy.
    """

    number: int
    ints: I1
    floats: F1
    poses: F1
    memory: F1
    moving: int
    custom: int
    lasting: int = 0
    address: int = 0


class Pair(NamedTuple):
    """The surface of one beam with one obstacle: views of the arrays of :class:`ContactTables`.

    ``first`` is the first degree of freedom of each point's element, (n,); ``weights`` and
    ``slopes`` those of pairs of degrees of freedom in its place and slope, (pairs, n); ``middles``
    places and weights of the elements' middles; behind its numbers are those of the shape.
    ``common`` is the memory of all pairs.
    """

    k: Any
    number: Any
    moving: Any
    custom: Any
    header: Any
    first: Any
    weights: Any
    slopes: Any
    points: Any
    middles: Any
    numbers: Any
    poses: Any
    memory: Any
    common: Any


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


@source
def hardening(pair):
    """How many times the stiffness is as large as given, by what a load has found or in a step."""
    return (1.0 + pair.common[LARGEST + pair.number + pair.k]
            + pair.numbers[INERTIA] * pair.common[RATE] / pair.numbers[STIFFNESS])
