"""The obstacles of a scene in its equations: their tables, and what steps leave behind."""

from __future__ import annotations

from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.band import Band
from ...core.errors import InputError
from functools import cached_property
from ...core.callbacks import handle_of
from .contact_texts import (ANCHORED, ANCHORS, AUGMENT, DAMPING, DEPTH, FRICTION, HEADER, LAST,
                            LOOK, MEMORY, MIDDLE, NOW, NUMBERS, OWN, POSE, POSES, PRESSURES, RATE,
                            RATES, REACHES, ROWS, SEEN, SETTLE, STIFFNESS, TANGENT, WIDTH,
                            ContactTables, Question, distances, hardened, levers, of_contacts,
                            places, press, resist, slide, stick, surface)
from .poses import taken_back
from .swept import Passage, middle_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ...core.types import Array


#: Penetration, relative to the height, from which on an obstacle is too soft, and that which a
#: stiffness is said for.
SUNK, FIRM = 0.5, 0.1
#: Part of the stiffness with which an equilibrium is found where the whole does not lead to it.
EASED = 1e-2


class Group(NamedTuple):
    """The points of one beam that may touch one obstacle, those of an element side by side.

    Attributes
    ----------
    first, weights, slopes
        First coordinate of the element of each point, (n,), weights of its pairs of coordinates,
        (pairs, n), and those of the slope of the axis, or None.
    areas, offsets, starts
        Area, distance from the axis, (n,), and place and slope without displacement, (4, n).
    elements, points
        How many elements, and points of each.
    depth, height
        How deep a way from one state to the next may cut the obstacle; the beam's height.
    numbers
        By the numbers of :mod:`skfem_ancf.actions.forces.contact_texts`, shape (9,).
    firmest
        How many times as stiff it is made at most where it is too soft.
    """

    first: Any
    weights: Any
    slopes: Any
    areas: Any
    offsets: Any
    starts: Any
    elements: int
    points: int
    depth: float
    height: float
    numbers: Any
    firmest: float


#: Why steps of several points do not hold a body on a wall: at each of them it would be held, and
#: be thrown off by what is beyond.
BY_POINTS = ("its steps do not correct pressures: held at their points, a body that is stopped "
             "would leave up to 3, 4.1 or 5.6 times as fast as it came by 1, 2 or 3 points of "
             "Gauss, 4.3 times by those of Radau")
#: Of scenes without obstacles.
NO_CONTACTS = ContactTables(0, np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(REACHES),
                            np.zeros(0), np.zeros(2, np.int64), 0, 0)
#: For the time of it nothing is lent.
NOTHING: AbstractContextManager[None] = nullcontext()


class Contacts:
    """The obstacles of a scene.

    Places are seen from the middle of the bodies, in tables and memory: far from the origin of the
    scene's coordinates friction would feel their round-off.

    Parameters
    ----------
    elements
        Force elements, bound: those with ``groups`` are obstacles.

    Attributes
    ----------
    obstacles, groups
        These, and pairs of the number of an obstacle and a :class:`Group`.
    origin
        From where places are seen, shape (2,).
    tables
        A :class:`~skfem_ancf.actions.forces.contact_texts.ContactTables`.
    moving, own
        True if an obstacle moves; if one has a shape of one's own.
    """

    def __init__(self, elements: Sequence[Any]) -> None:
        self.obstacles = [element for element in elements if element.groups]
        groups = [(k, group) for k, one in enumerate(self.obstacles) for group in one.groups]
        self.origin = _middle([group.starts[:2] for _, group in groups])
        start = np.append(self.origin, np.zeros(2))[:, None]
        self.groups = [(k, group._replace(starts=group.starts - start)) for k, group in groups]
        self.moving = any(one.moves for one in self.obstacles)
        self.own = any(one.shape.kind == OWN for one in self.obstacles)
        poses = np.zeros(POSES * len(self.obstacles))
        self.put(0.0, 0.0, poses)
        self.tables = self._make(poses)

    def _make(self, poses):
        n = len(self.groups)
        if n == 0:
            return NO_CONTACTS
        ints, floats = _Pieces(HEADER * n), _Pieces(0)
        headers, memory, looks = np.zeros((n, HEADER), dtype=np.int64), REACHES + 2 * n, 0
        for number, (k, group) in enumerate(self.groups):
            shape, none = self.obstacles[k].shape, np.zeros((0, len(group.first)))
            numbers = self.numbers(k)
            slopes = none if group.slopes is None else group.slopes
            headers[number] = (
                shape.kind, k, group.elements, group.points, len(group.weights),
                group.slopes is not None, ints.add(group.first),
                floats.add(np.concatenate([group.weights, slopes])), floats.add(group.areas),
                floats.add(group.offsets), floats.add(group.starts), floats.add(middle_of(group)),
                floats.add(group.numbers), floats.add(numbers), len(numbers), memory,
                number, looks, *_look(group))
            memory += 4 * len(group.first)
            looks += 3 * headers[number, LOOK]
        return ContactTables(n, np.concatenate([headers.ravel(), ints.whole(np.int64)]),
                             floats.whole(float), poses, np.zeros(memory), np.zeros(looks),
                             np.zeros(2 + n, np.int64),
                             int(self.moving or self.own), handle_of(self),
                             int(ANCHORS * self.anchored + PRESSURES * self.augmented))

    def numbers(self, k: int) -> Array:
        """Those of the shape of obstacle k, its corners seen from the origin.

        Parameters
        ----------
        k
            Its number.
        """
        numbers = self.obstacles[k].shape.numbers.copy()
        numbers[3:].reshape(-1, 5)[:, :2] -= self.origin
        return numbers

    def pose(self, k: int, t: float, rates: bool = True) -> Array:
        """Where obstacle k is, its pivot seen from the origin; shape (10,).

        Parameters
        ----------
        k
            Its number.
        t, rates
            As of :meth:`~skfem_ancf.actions.obstacles.obstacle.Obstacle.pose`.
        """
        pose = self.obstacles[k].pose(t, rates)
        pose[4:6] -= self.origin
        return pose

    # what texts ask

    def put(self, t: float, span: float, poses: Array) -> None:
        """Put all obstacles where they are at a time, and at both ends of a span about it.

        Parameters
        ----------
        t, span
            The time, and how long the span is.
        poses
            Written, shape (30 obstacles,).
        """
        for k in range(len(self.obstacles)):
            rows = poses[k * POSES:(k + 1) * POSES].reshape(-1, POSE)
            rows[:] = self.pose(k, t)
            if span > 0.0:
                rows[1:] = self.pose(k, t - 0.5 * span), self.pose(k, t + 0.5 * span)

    def ask(self, obstacle: int, t: float, x: Array, out: Array) -> None:
        """Distance, gradient and second derivatives of a shape of one's own.

        Parameters
        ----------
        obstacle
            Its number.
        t
            The time.
        x
            Points seen from the origin, shape (2, n).
        out
            Written, shape (6, n).
        """
        out[:] = self.obstacles[obstacle].shape.derivatives(x + self.origin[:, None], t)

    # memory

    @property
    def augmented(self) -> bool:
        """True if an obstacle takes the augmented Lagrangian."""
        return any(one.method == "augmented" for one in self.obstacles)

    @property
    def lasting(self) -> int:
        """What is kept from step to step; 0 for nothing."""
        return self.tables.lasting

    @property
    def anchored(self) -> bool:
        """True if an obstacle has friction."""
        return any(one.friction > 0.0 for one in self.obstacles)

    def lent(self, memory: Array | None = None) -> AbstractContextManager[None]:
        """For the time of an evaluation points have the memory of a state.

        States own their memories; tables have one only while a state, or a way of steps, asks
        something, and what they had before is put back. So the order in which states are asked
        does not matter.

        Parameters
        ----------
        memory
            What :meth:`remember` gave, shape (n,), or None: no anchors, no reach.
        """
        return self._lent(memory) if self.obstacles else NOTHING

    @contextmanager
    def _lent(self, memory):
        before = self.tables.memory.copy()
        try:
            self.put_back(memory)
            yield
        finally:
            self.put_back(before)

    @contextmanager
    def eased(self) -> Iterator[None]:
        """For the time of an evaluation there is no friction or, if there is none, less stiffness.

        Iterations converge there that do not with the whole, to a place that is close to theirs.
        """
        floats, memory = self.tables.floats, self.tables.memory
        at = [self.header(k)[NUMBERS] + STIFFNESS for k in range(len(self.groups))]
        before, sticks = floats[at], memory[ANCHORED]
        try:
            if sticks:
                memory[ANCHORED] = 0.0
            else:
                floats[at] = EASED * before
            yield
        finally:
            floats[at], memory[ANCHORED] = before, sticks

    def put_back(self, memory: Array | None) -> None:
        """Go on with what :meth:`remember` gave, or with nothing: no anchors, no reach.

        Parameters
        ----------
        memory
            Shape (n,), or None.
        """
        if self.obstacles:
            self.tables.memory[:] = 0.0 if memory is None else memory

    def remember(self) -> Array | None:
        """What steps have left behind; None where there is nothing of it."""
        if not self.obstacles:
            return None
        memory = self.tables.memory
        return memory.copy() if np.any(memory) else None

    def of_state(self, state: Any) -> Array | None:
        """What points of a state remember, shape (n,); None if its obstacles are others.

        Parameters
        ----------
        state
            A :class:`~skfem_ancf.results.State`, of this scene or of one like it, or None.
        """
        if state is None:
            return None
        ours, theirs = self.tables, state.system.forces.contacts.tables
        same = np.array_equal(ours.ints, theirs.ints) and np.array_equal(ours.floats, theirs.floats)
        return state.memory if same else None

    def begin(self, u: Array, t: float, memory: Array | None = None) -> Array | None:
        """Points stick from here on, and nothing reaches beyond the surface.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        t
            Load factor, or time.
        memory
            What :meth:`remember` gave at this displacement, shape (n,), to go on from; or None.

        Returns
        -------
        ndarray or None
            The memory that steps begin with, shape (n,).
        """
        if not self.obstacles:
            return None
        self.put_back(memory)
        self.tables.memory[RATE] = 0.0
        if memory is None and self.anchored:
            self.settle(u, t)
            self.tables.memory[ANCHORED] = 1.0
        return self.remember()

    def require_path(self) -> None:
        """Raise InputError where there is no path by arc length."""
        for one in self.obstacles:
            if one.friction > 0.0 or one.moves or one.method != "penalty":
                raise InputError(f"continuation knows obstacles that rest, without friction and by "
                                 f"penalty, not {one!r}: use solve_static")

    def require_penalty(self, scheme: Any, kick: float) -> None:
        """Raise InputError if the augmented Lagrangian would drive what it holds.

        A force that stops a body at the end of a step acts on in those that follow, by the weights
        that a scheme gives to accelerations: from the speed 1 it makes up to ``kick - 1``.

        Parameters
        ----------
        scheme
            A :class:`~skfem_ancf.dynamics.Scheme`.
        kick
            ``(1 - alpha_m) / ((1 - alpha_f) beta)``; infinite of steps of points.
        """
        reason = BY_POINTS if kick == np.inf else (
            f"a body that is stopped in a step would leave up to {kick - 1.0:.2g} times as fast as "
            "it came")
        for one in self.obstacles:
            if one.method == "augmented" and kick > 2.0 + 1e-9:
                raise InputError(
                    f"{scheme!r} does not take method='augmented' of {one!r}: {reason}. Take "
                    "'energy-momentum', which keeps to its balance of energy, "
                    "GeneralizedAlpha(0), or method='penalty'")

    def require_free(self, u: Array, what: str, instead: str) -> None:
        """Raise InputError if a linear solution enters an obstacle.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        what, instead
            What it is of, and what to use.
        """
        if any(found[0].min() < 0.0 for _, _, found in self.look(u, 1.0, False)):
            raise InputError(f"{what} knows no contact, and its solution enters an obstacle: use "
                             f"{instead}")

    @property
    def firmness(self) -> Array:
        """How much stiffer than by default obstacles are, shape (groups,), a view; 0: not."""
        first = REACHES + len(self.groups)
        return self.tables.memory[first:first + len(self.groups)]

    def harden(self, firmness: Array, u: Array, t: float) -> None:
        """Make obstacles stiffer than by default; what sticks pulls as before.

        Parameters
        ----------
        firmness
            By how much, shape (groups,).
        u, t
            Displacement at which anchors were left, shape (N,), and time.
        """
        for k, ((which, _), x, _) in enumerate(self.look(u, t, False)):
            part = (1.0 + self.firmness[k]) / (1.0 + firmness[k])
            at, points = self.reach(k), taken_back(self.pose(which, t, False), x)
            at[1:3] = points + part * (at[1:3] - points)
            at[3] *= part
        self.firmness[:] = firmness

    def settle(self, u: Array, t: float) -> float:
        """Anchors go after points that have slipped, to where these just do not slip.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        t
            Load factor, or time.

        Returns
        -------
        float
            The work of friction since they did so last.
        """
        return float(self._ask(SETTLE, u, t)) if self.anchored else 0.0

    def augment(self, u: Array, t: float) -> int:
        """How many points are too deep; the pressures of these reach on by that.

        The augmented Lagrangian: where a point has come to rest below the surface, its pressure
        will hold it on the surface.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        t
            Load factor.

        Returns
        -------
        int
            The number of points whose penetration, or whose distance where there is pressure, is
            more than the tolerance of their obstacle.
        """
        return int(self._ask(AUGMENT, u, t))

    def _ask(self, what, u, t):
        """The sum that a question at one state gives."""
        self._place(t)
        out = np.zeros(1)
        of_contacts(self.tables, Question(what, t, 0.0, 0.0, 0, 0), u, u, out)
        return out[0]

    # values

    def _place(self, t):
        if self.moving or self.own:
            self.put(t, 0.0, self.tables.poses)

    def look(self, u: Array, t: float, whole: bool = True) -> list[tuple[Any, Array, Array]]:
        """Where the points of all groups are.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        t
            Time; in statics the load factor.
        whole
            With the derivatives of distances.

        Returns
        -------
        list
            For each group its number of obstacle and :class:`Group`, the points (2, n) seen from
            the origin, and what :func:`~skfem_ancf.actions.forces.contact_texts.distances` says of
            them, (6, n).
        """
        self._place(t)
        out = []
        for k, (which, group) in enumerate(self.groups):
            header = self.header(k)
            at = np.arange(len(group.first))
            z, x, found = np.empty((4, at.size)), np.empty((2, at.size)), np.empty((6, at.size))
            places(self.tables.ints, self.tables.floats, header, u, 1.0, at, z, 0)
            surface(self.tables.floats, header, at, z, 0, x)
            distances(self.tables, header, NOW, whole, x, found)
            out.append(((which, group), x, found))
        return out

    def header(self, k: int) -> Array:
        """The header of a group in the tables.

        Parameters
        ----------
        k
            Its number.
        """
        return self.tables.ints[k * HEADER:(k + 1) * HEADER]

    def reach(self, k: int) -> Array:
        """What points of a group remember: reach, anchor and way from it, (4, n), a view.

        Parameters
        ----------
        k
            Its number.
        """
        header, n = self.header(k), len(self.groups[k][1].first)
        return self.tables.memory[header[MEMORY]:header[MEMORY] + 4 * n].reshape(4, n)

    def pushes(self, u: Array, v: Array | None, t: float) -> list[tuple[Any, ...]]:
        """What obstacles do to points.

        Parameters
        ----------
        u, v
            Displacement and velocity, shape (N,); no velocity in statics.
        t
            Time; in statics the load factor.

        Returns
        -------
        list
            For each group its number of obstacle, points (2, n), forces on them (2, n), pressures
            and distances, (n,).
        """
        out = []
        for k, ((which, group), x, found) in enumerate(self.look(u, t)):
            n, header = len(group.first), self.header(k)
            at, rows, lever = np.arange(n), np.zeros((ROWS, n)), np.empty((8, n))
            F, more, K = np.zeros((5, n)), np.zeros((5, n)), np.zeros((4, n))
            part = 1.0 / hardened(self.tables, header)
            rows[DEPTH:LAST], rows[LAST:LAST + 2] = part * self.reach(k)[0] - found[0], x
            press(self.tables, header, at, rows, found, F, K)
            if self.tables.memory[ANCHORED] * group.numbers[FRICTION] > 0.0:
                stick(self.tables, header, False, True, at, rows, found, F, K, np.zeros(1))
            if v is not None and group.numbers[DAMPING] > 0.0:
                places(self.tables.ints, self.tables.floats, header, u, 1.0, at, rows, MIDDLE)
                places(self.tables.ints, self.tables.floats, header, v, 0.0, at, rows, RATES)
                levers(self.tables.floats, header, at, rows, lever)
                slide(lever, rows)
                resist(self.tables, header, 0.0, at, rows, x, found, more, K)
            out.append((which, x + self.origin[:, None], -F[:2] - more[:2], F[3] / group.areas,
                        found[0]))
        return out

    @cached_property
    def sweeps(self) -> bool:
        """True if there is an obstacle that bodies may pass through between two instants."""
        return any(group.depth < np.inf for _, group in self.groups)

    @cached_property
    def sweep(self) -> Passage:
        """What looks for obstacles that a body has passed through from one instant to the next."""
        return Passage(self)

    def sunk(self, u: Array, t: float) -> list[str]:
        """Which bodies are deep in obstacles of the default stiffness, in words.

        Parameters
        ----------
        u, t
            Displacement, shape (N,), and time.
        """
        out: list[str] = []
        if not self.groups:
            return out
        seen = self.look(np.array(u), t, False)
        for firmness, ((which, group), _, found) in zip(self.firmness, seen):
            one, deep, h = self.obstacles[which], -float(found[0].min()), group.height
            if one.penalty is None and deep > SUNK * h:
                k = (1.0 + firmness) * group.numbers[STIFFNESS]
                firm = k * (deep + max(0.0, deep - h)) / (FIRM * h)  # both sides of it are in
                out.append(
                    f"a body is {deep:.3g} deep in {one!r}, {deep / h:.2g} times its height: it is "
                    f"pressed harder than its stiffness, {k:.3g}, holds. Give "
                    f"stiffness={firm:.2g}, with which this pressure leaves a tenth of the height")
        return out

    def passed(self, a: tuple[Array, float], b: tuple[Array, float]) -> str | None:
        """Which obstacle a body has passed through from one state to another, in words.

        Parameters
        ----------
        a, b
            Displacement, shape (N,), and time of each.
        """
        if not self.obstacles:
            return None
        done, text = self.sweep.first(np.array([a[0], b[0]]), None, np.array([a[1], b[1]]))
        return None if done else f"a body has passed through {text}"

    def potential(self, u: Array, t: float) -> float:
        """The potential of the penetration; the augmented Lagrangian, which leaves none, has none.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        t
            Time; in statics the load factor.
        """
        total = 0.0
        for firmness, ((which, group), _, found) in zip(self.firmness, self.look(u, t, False)):
            if self.obstacles[which].method == "augmented":
                continue
            a, width = -found[0], group.numbers[WIDTH]
            S = (np.maximum(a, 0.0) ** 3 - np.maximum(a - width, 0.0) ** 3) / (6.0 * width)
            total += (1.0 + firmness) * group.numbers[STIFFNESS] * float(group.areas @ S)
        return total

    def entries(self, t: float, u: Array, bandwidth: int) -> tuple[Array, Array, Array]:
        """The derivative of the force by the coordinates: rows, columns and values.

        Parameters
        ----------
        t
            Time; in statics the load factor.
        u
            Displacement of the coordinates, shape (N,).
        bandwidth
            Subdiagonals of the scene's band.
        """
        if not self.groups:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
        ld = 2 * bandwidth + 1
        A = Band(np.zeros(ld * len(u)), np.zeros(0, dtype=np.int32), ld, bandwidth, bandwidth)
        self._place(t)
        asked = Question(TANGENT, t, 0.0, 0.0, ld, bandwidth)
        of_contacts(self.tables, asked, u, u, A.flat)
        at, = np.nonzero(A.flat)
        j, i = np.divmod(at, ld)
        return i + j - bandwidth, j, A.flat[at]


def _middle(places):
    """The middle of the box round points, of arrays (2, n); zero where there are none."""
    if not places:
        return np.zeros(2)
    x = np.concatenate(places, axis=1)
    return 0.5 * (x.min(axis=1) + x.max(axis=1))


def _look(group):
    """How large a look at a group is, its first coordinate, and how many it has."""
    low = int(group.first.min())
    span = int(group.first.max()) + 2 * len(group.weights) - low
    return span + POSE + group.elements + SEEN * len(group.first), low, span


class _Pieces:
    """Arrays one behind the other."""

    def __init__(self, first):
        self.parts, self.at = [], first

    def add(self, x):
        self.parts.append(np.ravel(x))
        self.at += self.parts[-1].size
        return self.at - self.parts[-1].size

    def whole(self, kind):
        return np.concatenate([np.zeros(0), *self.parts]).astype(kind)
