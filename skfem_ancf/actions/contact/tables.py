"""Tables of contact with obstacles. A pair is the surface of one beam with one obstacle.
Poses of obstacles."""

from typing import NamedTuple, TypeAlias

import numpy as np

from ...core import C1, F1, F2, I1, I2, Array, indices, primitive, shaped, source
from ...core.band import farthest

#: Shapes of obstacles: circles and lines are polygons.
OUTLINE, CUSTOM = range(2)
#: Requests to all pairs, see :class:`Request`.
FORCE, RESISTING, TANGENT, DAMPED_TANGENT, ALONG, SETTLE, AUGMENT = map(np.int64, range(7))
#: Pose of an obstacle: displacement, cosine and sine of its angle, its pivot, its velocities, and
#: the time. There are three: at a time, and at the beginning and end of a mean.
POSE, POSES = 10, 30
NOW, BEGIN, END = map(np.int64, range(3))
#: History data of all pairs: 1 if points stick to anchors; 1 / dt^2 of the last time step; 1 if
#: points with multipliers are bilateral. Then follow those of :class:`Pair`: ``largest`` and
#: ``stiffening`` of all, the data of points, and at the end the angles of torsional springs.
ANCHORED, RATE, BILATERAL, HEAD = range(4)
#: Flags of history data: anchors, angles of torsional springs, multipliers.
ANCHORS, TURNS, PRESSURES = 1, 2, 4
TINY = 1e-200
#: The gap where nothing is.
FAR = 1e300


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
    """The obstacles of a scene, as ``number`` pairs: a tuple, or in compiled code their addresses.

    ``poses`` are those of obstacles at the last time; ``memory`` history data. ``moving`` tells
    whether poses depend on time, ``custom`` is the handle for poses and user-defined shapes,
    ``lasting`` the sum of flags of history data: ANCHORS, TURNS, PRESSURES. ``clear`` says where
    nothing touches, see :func:`is_clear`; it is empty if obstacles move, or have multipliers."""

    number: int
    pairs: I1
    poses: F1
    memory: F1
    moving: int
    custom: int
    lasting: int
    clear: F1


class Law(NamedTuple):
    """Numbers of contact with an obstacle."""

    stiffness: float
    width: float  # of the transition from no pressure to proportional pressure
    friction: float
    damping: float
    inertia: float  # additional stiffness in a time step, times its square
    radius: float  # largest reference distance of a point from the middle of its element
    side: float  # 1 or -1 for outside or inside of the shape
    tolerance: float  # of the augmented Lagrangian, zero for the penalty


class Pair(NamedTuple):
    """The surface of one beam with one obstacle: points (n,) of elements (m,), with B pairs of
    degrees of freedom each. The fields from ``common`` on are history data, (1,) or (n,)."""

    obstacle: int  # number, kind and parameters of its shape
    kind: int
    shape: F1
    moving: int
    custom: int
    poses: F2  # at NOW, BEGIN, END
    dofs: I2  # pairs of degrees of freedom, (B, n)
    weights: F2  # in the position, (B, n)
    slopes: F2  # and in the slope of the axis, none with sections
    areas: F1
    offsets: F1  # from the axis
    starts: F2  # reference position and slope, (4, n)
    middles: F2  # positions and weights of element middles, (2 + 2 B, m)
    law: Law
    softness: F1  # factor on the stiffness for difficult equilibria, (1,)
    common: F1  # of all pairs
    largest: F1  # the largest multiplier
    stiffening: F1  # what is added to the stiffness, relative to it
    multipliers: F1  # of the augmented Lagrangian, over the stiffness
    anchors: C1  # of friction, in the obstacle's frame
    slips: F1  # distances of points from their anchors


PAIR: TypeAlias = Pair


@primitive("skfem_ancf.equations.loops")
def pair_of(tables, k):
    """The :class:`Pair` number k."""
    return tables.pairs[k]


#: How far points may move from displacements at which nothing touches; 1 if the tangent of the last
#: step has entries of contact; how far anchors of friction follow points; number of iterations at
#: whose start something may touch; number of searches of members until then; from SEEN on the
#: displacements (N,), then weights of pairs of DOFs (2, N / 2), see :func:`weights_of_motion`.
MARGIN, HAS_ENTRIES, FOLLOWED, PASSED, SEARCHED, SEEN = range(6)
#: Part of a gap that is the margin; half of it if two surfaces may approach each other.
SAFE = 0.9


@source
def is_clear(clear, u, less):
    """True if nothing can touch at u (N,), with a margin that is smaller by ``less``."""
    return clear.size > 0 and clear[MARGIN] > 0.0 and moved(clear, u) < clear[MARGIN] - less


@source
def motion(clear, u, seen):
    """How far points have moved from displacements to u (N,), at most."""
    n = u.size
    return farthest(shaped(clear[SEEN + n:], (2, n // 2)), u, seen)


@source
def moved(clear, u):
    """How far points have moved to u (N,) since surfaces were looked at, at most."""
    return motion(clear, u, clear[SEEN:SEEN + u.size])


@source
def left_of(clear, u):
    """What is left of the margin at u (N,)."""
    return clear[MARGIN] - moved(clear, u) if clear.size > 0 else 0.0


@source
def share_of(clear, u):
    """The part of the way to u (N,) from where surfaces were looked at that the margin allows."""
    return SAFE * min(1.0, clear[MARGIN] / max(moved(clear, u), TINY))


@source
def set_clear(clear, u, margin):
    """Note how far points may move from u."""
    clear[MARGIN], seen = margin, clear[SEEN:SEEN + u.size]
    for i in indices(u.size):
        seen[i] = u[i]


def clear_table(weights: np.ndarray, followed: float = 0.0) -> np.ndarray:
    """A table without a margin."""
    return np.concatenate([[0.0, 0.0, followed, 0.0, 0.0], 0.0 * weights.ravel(), weights.ravel()])


def weights_of_motion(weights: np.ndarray, dofs: np.ndarray, n: int,
                      places: np.ndarray) -> np.ndarray:
    """Weights (2, n) of pairs of DOFs, of places and of others, from those in the motion of points,
    (P, B) each: a point moves by no more than the largest weighted change of places plus that of
    others."""
    # Places together are a translation, of which this is the exact motion.
    out = np.zeros((2, n))
    for largest, own in zip(out, (weights * places, weights * ~places)):
        np.maximum.at(largest, dofs, own)
        largest *= np.max(np.sum(own / np.maximum(largest[dofs], TINY), axis=1))
    return out


@source
def transition(pair):
    """Width of the transition; shorter in proportion if the obstacle is stiffened."""
    return pair.law.width / np.maximum(1.0, 1.0 + pair.stiffening[0])


@source
def stiffness_factor(pair):
    """Factor on the given stiffness, from loads or time steps."""
    law = pair.law
    return 1.0 + pair.stiffening[0] + law.inertia * pair.common[RATE] / (
        pair.softness[0] * law.stiffness)


def carried(pose: Array, x: Array) -> Array:
    """Points x, shape (2, n), moved with an obstacle."""
    return x + pose[:2, None] + _turned(pose[2], pose[3], x - pose[4:6, None])


def taken_back(pose: Array, x: Array) -> Array:
    """The inverse of :func:`carried`."""
    x = x - pose[:2, None]
    return x + _turned(pose[2], -pose[3], x - pose[4:6, None])


def _turned(cos, sin, arm):
    """The change of a lever (2, n); a pivot far away adds no round-off without rotation."""
    return np.array([[cos - 1.0, -sin], [sin, cos - 1.0]]) @ arm
