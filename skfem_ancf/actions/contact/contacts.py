"""The obstacles of a scene: tables for kernels, and history data of steps."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, Band, InputError, handle_of, refuse, shown
from .crossing import CrossingGuard
from .kernels import (BEYOND, damp, of_contacts, of_pair, project, response, set_rates, touch_of,
                      untouched)
from .points import add_resistance, mean_pressure, potential, pressure_slope
from .tables import (ANCHORED, ANCHORS, BEGIN, CUSTOM, END, FORCE, HEAD, NOW, POSE, POSES,
                     PRESSURES, RATE, SAFE, SEEN as SEEN_AT, SETTLE, TANGENT, TINY, TURNS,
                     ContactTables, Law, Pair, Request, carried, clear_table, set_clear,
                     taken_back, transition, weights_of_motion)


#: Penetration relative to the height that stiffens an obstacle, and the one for which a stiffness
#: is suggested.
SUNK, SUGGESTED = 0.5, 0.1
#: Largest factor of stiffening beyond that for deep penetration.
LARGEST_FACTOR = 1e5
#: Relative error of the answer above which an obstacle is too soft; largest extent of a stout body,
#: relative to its height.
YIELDS, STOUT = 0.01, 5.0
#: Penetration of the reference configuration allowed, relative to the height, as meshes of curves
#: are approximate.
CUT = 1e-2
#: Depth of an obstacle between the surface points of a body that counts as inside, relative to the
#: height.
HIDDEN = 0.25
#: Relative change of the stiffness for derivatives.
CHANGE = 1e-4
#: Relative pressure of points that count, and relative distance from the limit of friction.
SEEN = 1e-3
#: Factor on the stiffness for difficult equilibria.
SOFTENED = 1e-2
#: Collocation cannot correct multipliers within a step: constraints at its points cause rebound.
BY_POINTS = ("its steps do not update multipliers: a stopped body would rebound up to 3, 4.1 or "
             "5.6 times as fast with 1, 2 or 3 Gauss points, 4.3 times with Radau points")
#: For scenes without obstacles.
NO_CONTACTS: Any = ContactTables(0, np.zeros(0, np.int64), np.zeros(0), np.zeros(HEAD), 0, 0, 0,
                                 np.zeros(0))


class Group(NamedTuple):
    """The surface points of one beam for one obstacle, element by element.

    ``first`` is the first DOF of the element of each point, (n,); ``weights`` and ``slopes`` are
    the weights of pairs of DOFs in its position and in the slope of the axis, (pairs, n), none with
    sections; ``areas`` and ``offsets`` from the axis (n,); ``starts`` reference position and slope,
    (4, n). Steps may cut the obstacle by ``depth``; ``height`` is that of the beam;
    ``largest_factor`` is that of stiffening.
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
    law: Law
    largest_factor: float


class Push(NamedTuple):
    """What an obstacle does to the points of a group."""

    points: Array  # (2, n)
    force: Array  # on each, (2, n)
    pressure: Array  # with that of damping, (n,)
    gap: Array  # (n,)
    touches: Array  # True for points in contact, (n,)
    held: Array  # and where friction holds them, (n,)


class Contacts:
    """The obstacles of a scene: its force elements with ``groups``. Positions are relative to
    ``origin``, the middle of the bodies, to reduce round-off in friction. Arguments are
    displacements and velocities ``u, v``, (N,), and the time ``t``, in statics the load factor.
    ``groups`` are pairs of an obstacle's number and a :class:`Group`. An obstacle may be
    ``moving``, ``custom`` (a user-defined shape), ``anchored`` (friction), ``augmented``; ``keeps``
    if there are history data, with the angles of torsional springs, ``springs`` (k, n)."""

    def __init__(self, elements: Sequence[Any], N: int, springs: int = 0) -> None:
        self.obstacles = [element for element in elements if element.groups]
        groups = [(k, group) for k, one in enumerate(self.obstacles) for group in one.groups]
        self.origin = np.zeros(2)
        if groups:
            x = np.concatenate([group.starts[:2] for _, group in groups], axis=1)
            self.origin = 0.5 * (x.min(axis=1) + x.max(axis=1))
        start = np.array([*self.origin, 0.0, 0.0])[:, None]
        self.groups = [(k, group._replace(starts=group.starts - start)) for k, group in groups]
        self.moving = any(one.moves for one in self.obstacles)
        self.custom = any(one.shape.kind == CUSTOM for one in self.obstacles)
        self.anchored = any(one.friction > 0.0 for one in self.obstacles)
        self.augmented = any(one.method == "augmented" for one in self.obstacles)
        self.softness, self.tables = np.ones(1), NO_CONTACTS
        self._springs, self.keeps = springs, bool(groups or springs)
        memory = np.zeros(HEAD + springs + sum(2 + 4 * len(group.first) for _, group in groups))
        if groups:
            poses, varies = np.zeros(POSES * len(self.obstacles)), int(self.moving or self.custom)
            handle = handle_of(self)
            pairs: Any = tuple(self._pair(*one, poses, varies, handle) for one in self.groups)
            self.tables = ContactTables(
                len(groups), pairs, poses, memory, varies, handle,
                ANCHORS * self.anchored + PRESSURES * self.augmented,
                np.zeros(0) if varies or self.augmented else self._clear(N))
        if self.keeps:
            self.tables = self._tables_after(memory)._replace(
                lasting=self.tables.lasting | TURNS * (springs > 0))
        self._answers: Any = None
        self._by_obstacle = [*self._side_by_side()]
        self.put(0.0, 0.0, self.tables.poses)
        if self.tables.clear.size:
            u = np.zeros(N)
            set_clear(self.tables.clear, u, SAFE * min(
                gap.min() for _, _, gap in self.look(u, 0.0)))

    def _pair(self, k, group, poses, varies, handle):
        """The :class:`~skfem_ancf.actions.contact.tables.Pair` of a group, without history."""
        pairs, none = np.arange(len(group.weights))[:, None], np.zeros(0)
        # position and weights of each element's middle, and the spread of its points' weights
        n, m = group.elements, group.points
        each = group.weights.reshape(-1, n, m)
        mean, half = each.mean(axis=2), len(group.weights) // 2
        spread = np.abs(each - mean[..., None]).max(axis=2)
        spread[0] = 0.0  # both places together are a translation
        spread[half] = np.maximum(spread[half], np.abs(each[0] - mean[0][:, None]).max(axis=1))
        start = group.starts[:2].reshape(2, n, m).mean(axis=2)
        middles = np.concatenate([start, np.stack([mean, spread], axis=1).reshape(-1, n)])
        return Pair(
            k, self.obstacles[k].shape.kind, self.obstacles[k].shape.numbers_about(self.origin),
            varies, handle,
            poses[k * POSES:(k + 1) * POSES].reshape(3, POSE),
            np.ascontiguousarray(group.first // 2 + pairs, dtype=np.int64),
            *map(np.ascontiguousarray, (group.weights, group.slopes, group.areas, group.offsets,
                                        group.starts, middles)),
            group.law, self.softness, none, none, none, none, none + 0j, none)

    def _tables_after(self, memory):
        """The tables with other history data."""
        at, pairs, n = HEAD + 2 * self.tables.number, list[Pair](), self.tables.number
        for k, pair in enumerate(self.tables.pairs):
            m, own = pair.areas.size, memory[at:at + 4 * pair.areas.size]
            pairs.append(pair._replace(
                common=memory[:HEAD], largest=memory[HEAD + k:HEAD + k + 1],
                stiffening=memory[HEAD + n + k:HEAD + n + k + 1], multipliers=own[:m],
                anchors=own[m:3 * m].view(complex), slips=own[3 * m:]))
            at += 4 * m
        return self.tables._replace(memory=memory, pairs=tuple(pairs) or self.tables.pairs)

    def _clear(self, N):
        """The table of :func:`~skfem_ancf.actions.contact.tables.is_clear`."""
        out = np.zeros((2, N // 2))
        for _, group in self.groups:
            a, pairs = np.abs(group.weights), np.arange(len(group.weights))
            if len(group.slopes):
                a = a + 2.0 * np.abs(group.slopes * group.offsets) / np.hypot(*group.starts[2:])
            out = np.maximum(out, weights_of_motion(
                a.T, group.first[:, None] // 2 + pairs, N // 2, pairs % (len(a) // 2) == 0))
        return clear_table(out, BEYOND * max(group.law.radius for _, group in self.groups))

    def pose(self, k: int, t: float, rates: bool = True) -> Array:
        """Pose of obstacle k, with its pivot relative to the origin; shape (10,)."""
        pose = self.obstacles[k].pose(t, rates)
        pose[4:6] -= self.origin
        return pose

    @property
    def turns(self) -> Array:
        """Angles of torsional springs at the end of the last step, (k,), a view."""
        memory = self.tables.memory
        return memory[memory.size - self._springs:]

    # callbacks of kernels

    def put(self, t: float, span: float, poses: Array) -> None:
        """Write the poses of all obstacles at a time, and at both ends of a span about it."""
        for k in range(len(self.obstacles)):
            rows = poses[k * POSES:(k + 1) * POSES].reshape(-1, POSE)
            rows[:] = self.pose(k, t)
            if span != 0.0:
                rows[1:] = self.pose(k, t - 0.5 * span), self.pose(k, t + 0.5 * span)

    def ask(self, obstacle: int, t: float, x: Array, out: Array) -> None:
        """Distance, gradient and second derivatives of a user-defined shape, (6, n)."""
        out[:] = self.obstacles[obstacle].shape.derivatives(x + self.origin[:, None], t)

    # history

    @contextmanager
    def without_friction(self, soft: bool = False) -> Iterator[None]:
        """Context in which nothing sticks, if ``soft`` with reduced stiffness too."""
        # Iterations converge there more easily, to a nearby state.
        memory = self.tables.memory
        before = memory[ANCHORED], self.softness[0]
        try:
            memory[ANCHORED] = 0.0
            self.softness[0] *= SOFTENED if soft else 1.0
            yield
        finally:
            memory[ANCHORED], self.softness[0] = before

    def after(self, memory: Array) -> "Contacts":
        """A copy with other history data (n,)."""
        _ = self.sweep if self.obstacles else None  # one, whatever the history
        other = copy(self)
        other.tables = self._tables_after(memory)._replace(clear=self.tables.clear.copy())
        other._answers = self  # as handle
        return other

    def begin(self, u: Array, t: float, anew: bool) -> None:
        """Begin a run; ``anew``, friction begins at u."""
        memory = self.tables.memory
        memory[RATE] = 0.0
        if anew and self.anchored:
            self.settle(u, t)
            memory[ANCHORED] = 1.0

    @property
    def stiffening(self) -> Array:
        """What is added to the default stiffness, relative to it, (groups,), a view; 0 for none."""
        first = HEAD + len(self.groups)
        return self.tables.memory[first:first + len(self.groups)]

    def stiffen(self, stiffening: Array, u: Array, t: float) -> None:
        """Set the stiffening; the tractions of sticking points at u do not change."""
        for k, ((which, _), x, _) in enumerate(self.look(u, t)):
            part, pair = (1.0 + self.stiffening[k]) / (1.0 + stiffening[k]), self.tables.pairs[k]
            points = taken_back(self.pose(which, t, False), x)
            points = points[0] + 1j * points[1]
            pair.anchors[:] = points + part * (pair.anchors - points)
            pair.slips[:] *= part
        self.stiffening[:] = stiffening

    def yielding(self, u: Array, t: float, respond: Callable[..., Any]) -> Array:
        """The relative error of the answer by the penetration, shape (groups,), to first order."""
        # For obstacles of default stiffness that the ends of a beam or a stout body touch: that of
        # their forces, or of the largest displacement. A slender beam yields more in bending.
        # ``respond`` returns changes of displacements (N,) for forces (N,), from the tangent, and a
        # measure of displacements; None without a tangent.
        out = np.zeros(len(self.groups))
        for k, ((_, group), _, gap) in enumerate(self.look(u, t)):
            if group.largest_factor <= 1.0 or not np.any(gap < 0.0):
                continue
            # derivatives of the force on the degrees of freedom by the logarithm of the stiffness;
            # by point the derivative, and the force, times the penetration
            pair, factor, penetration = (
                self.tables.pairs[k], 1.0 + self.stiffening[k], np.maximum(-gap, 0.0))
            width, push = transition(pair), (
                factor * group.law.stiffness * group.areas * penetration)
            ends, sticks = np.zeros((2, len(u))), self.tables.memory[ANCHORED]
            try:
                self.tables.memory[ANCHORED] = 0.0
                for step, end in zip((-CHANGE, CHANGE), ends):
                    self.stiffening[k] = factor * (1.0 + step) - 1.0
                    of_pair(pair, Request(FORCE, t, 0.0, 0.0, 0, 0), u, u, end, np.empty(1))
            finally:
                self.tables.memory[ANCHORED], self.stiffening[k] = sticks, factor - 1.0
            force = (ends[0] - ends[1]) / (2.0 * CHANGE)
            change = push * pressure_slope(penetration, width) * penetration
            work = push * mean_pressure(penetration, penetration, width)
            slender = np.ptp(group.starts[:2], axis=1).max() > STOUT * group.height
            if slender and 2.0 * work[-2 * group.points:].sum() < work.sum():
                continue
            found = respond(force)
            if found is None:
                return 0.0 * out
            du, size = found
            if not (work.sum() > 0.0 and size(u) > 0.0):  # at rest, touching by round-off
                continue
            out[k] = max((change.sum() - force @ du) / work.sum(), size(du) / size(u))
        return out

    def settle(self, u: Array, t: float) -> float:
        """Update anchors of slipped points; returns the work of friction."""
        return self.ask_all(SETTLE, u, t) if self.anchored else 0.0

    def ask_all(self, what: Any, u: Array, t: float) -> float:
        """What all pairs answer to SETTLE, or to AUGMENT: the number of points with large
        penetration or gap, whose multipliers were updated."""
        self._place(t)
        out = np.zeros(1)
        of_contacts(self.tables, Request(what, t, 0.0, 0.0, 0, 0), u, u, out)
        return float(out[0])

    # restrictions of solvers

    def require_clear(self, u: Array, t: float) -> None:
        """Raise InputError if an obstacle cuts a body at the start."""
        # ``u`` (N,) is the displacement there. Unless it is zero the start may be in contact, and
        # is refused from a penetration of its height on; obstacles that move may push it.
        if not self.obstacles or (self._starts_clear and self.untouched(u)):
            return
        given = bool(np.any(u))
        cut = 1.0 if given else CUT
        for (which, group), x, gap in self.look(u, t):
            one, deepest = self.obstacles[which], int(np.argmin(gap))
            if given and one.moves:
                continue
            refuse(not gap[deepest] >= -cut * group.height, "{!r} cuts the body at the start: the "
                   "point {!r} of its surface is {:.4g} deep in it. Move the obstacle, or the body "
                   "to where it is, or give a start= that is clear of it", one,
                   (x[:, deepest] + self.origin).tolist(), -gap[deepest])
            landmarks = self._landmarks(which, t)
            inside = _inside(group, x, landmarks, cut * group.height)
            if inside is not None:
                place = (landmarks[:, inside] + self.origin).tolist()
                raise InputError(f"{one!r} cuts the body at the start: its point {shown(place)} is "
                                 "inside of it")

    @cached_property
    def _starts_clear(self):
        """True if no obstacle is inside a body, or touches one, in the reference configuration."""
        seen = self.look(np.zeros((len(self.tables.clear) - SEEN_AT) // 2), 0.0) if (
            self.tables.clear.size) else ()
        return bool(seen) and all(_inside(group, x, self._landmarks(which, 0.0), 0.0) is None
                                  for (which, group), x, _ in seen)

    def _landmarks(self, which, t):
        """Points of an obstacle that no beam may contain (2, k), relative to the origin."""
        points = self.obstacles[which].shape.landmarks() - self.origin[:, None]
        return carried(self.pose(which, t, False), points)

    def require_path(self) -> None:
        for one in self.obstacles:
            refuse(one.friction > 0.0 or one.moves or one.method != "penalty", "continuation knows "
                   "obstacles that rest, without friction and by penalty, not {!r}: use "
                   "solve_static", one)

    def require_penalty(self, scheme: Any, kick: float) -> None:
        """Raise InputError if the augmented Lagrangian is unstable with a scheme."""
        # A force that stops a body at the end of a step continues to act: a speed 1 becomes up to
        # ``kick - 1`` with ``(1 - alpha_m) / ((1 - alpha_f) beta)``.
        reason = BY_POINTS if kick == np.inf else (
            f"a body that is stopped in a step would rebound up to {kick - 1.0:.2g} times as fast")
        for one in self.obstacles:
            refuse(one.method == "augmented" and kick > 2.0 + 1e-9, "{!r} does not take "
                   "method='augmented' of {!r}: {}. Use 'energy-momentum', which conserves energy, "
                   "GeneralizedAlpha(0), or method='penalty'", scheme, one, reason)

    def require_free(self, u: Array, what: str, instead: str) -> None:
        refuse(any(gap.min() < 0.0 for _, _, gap in self.look(u, 1.0)), "{} knows no contact, and "
               "its solution enters an obstacle: use {}", what, instead)

    # values

    def _place(self, t):
        if self.moving or self.custom:
            self.put(t, 0.0, self.tables.poses)

    def look(self, u: Array, t: float) -> list[tuple[Any, Array, Array]]:
        """For each group its obstacle's number, the :class:`Group`, points (2, n) and gaps (n,)."""
        # Points are relative to the origin.
        self._place(t)
        out: list[Any] = [None] * len(self.groups)
        for numbers, pair, ends in self._by_obstacle:
            found = project(pair, NOW, u, np.arange(ends[-1]))
            x = np.array([found.surface.real, found.surface.imag])
            for k, surface, gap in zip(numbers, np.split(x, ends, 1), np.split(found.gap, ends)):
                out[k] = self.groups[k], surface, gap
        return out

    def _side_by_side(self):
        """Groups of one obstacle with as many weights, side by side in one Pair: their numbers, it
        and the ends of their points. Each call of NumPy then does many points."""
        alike: dict[Any, list[int]] = {}
        for k, (which, group) in enumerate(self.groups):
            alike.setdefault((which, len(group.weights), len(group.slopes)), []).append(k)
        for numbers in alike.values():
            pairs = [self.tables.pairs[k] for k in numbers]
            whole = {name: np.concatenate([getattr(pair, name) for pair in pairs], axis=-1)
                     for name in ("dofs", "weights", "slopes", "offsets", "starts")}
            yield (numbers, pairs[0]._replace(**whole),
                   np.cumsum([pair.offsets.size for pair in pairs]))

    def pushes(self, u: Array, v: Array | None, t: float, start: Array | None = None,
               span: float = 0.0) -> list[Push]:
        """Contact forces, in statics without velocities; means of a step from ``start`` (N,)."""
        if self.moving or self.custom:
            self.put(t - 0.5 * span, span, self.tables.poses)
        same, out = start is None, []
        middle, rate = (u, v) if start is None else (0.5 * (u + start), (u - start) / span)
        for pair, (_, group) in zip(self.tables.pairs, self.groups):
            at = np.arange(len(group.first))
            found, R, K = project(pair, NOW if same else END, u, at), np.zeros(
                (4, at.size)), np.zeros((16, at.size))
            touch, _ = touch_of(pair, same, found if same else project(pair, BEGIN, start, at),
                                found, at)
            r, lost = response(pair, same, touch), 0.0
            if rate is not None and group.law.damping > 0.0:
                there, rates = project(pair, NOW, middle, at), np.empty((4, at.size))
                set_rates(pair, rate, at, rates)
                pressed, spot = touch_of(pair, True, there, there, at)
                damp(pair, 0.0, pressed, spot, rates, R, K)
                lost = np.sum(R[:2] * pressed.gap[:2], axis=0)
            add_resistance(touch, r, R)
            held = np.abs(r.friction) < (1.0 - SEEN) * group.law.friction * r.pressure
            x = np.array([found.surface.real, found.surface.imag]) + self.origin[:, None]
            out.append(Push(x, -R[:2], (r.pressure - lost) / group.areas, found.gap,
                            r.pressure > 0.0, held))
        return out

    def slipping(self, u: Array, t: float) -> list[Any]:
        """The obstacles at which points are at the limit of friction, in statics."""
        out = []
        for (which, group), push in zip(self.groups, self.pushes(u, None, t)):
            one, normal = self.obstacles[which], push.pressure * group.areas
            pressed = normal > SEEN * normal.max(initial=0.0)
            if one.friction > 0.0 and one not in out and not np.all(push.held[pressed]):
                out.append(one)
        return out

    def potential(self, u: Array, t: float) -> float:
        """Penalty energy; zero for the augmented Lagrangian."""
        total = 0.0
        for k, ((which, group), _, gap) in enumerate(
                () if self.untouched(u) else self.look(u, t)):
            if self.obstacles[which].method == "augmented":
                continue
            stiffening, width = self.stiffening[k], transition(self.tables.pairs[k])
            total += (1.0 + stiffening) * group.law.stiffness * float(
                group.areas @ potential(-gap, width))
        return total

    def entries(self, t: float, u: Array, bandwidth: int) -> tuple[Array, Array, Array]:
        """Derivative of the force by the degrees of freedom: rows, columns and values."""
        if not self.groups:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
        ld = 2 * bandwidth + 1
        A = Band(np.zeros(ld * len(u)), np.zeros(0, dtype=np.int32), ld, bandwidth, bandwidth)
        self._place(t)
        request = Request(TANGENT, t, 0.0, 0.0, ld, bandwidth)
        of_contacts(self.tables, request, u, u, A.flat)
        at, = np.nonzero(A.flat)
        j, i = np.divmod(at, ld)
        return i + j - bandwidth, j, A.flat[at]

    # tunnelling and deep penetration

    def untouched(self, u: Array) -> bool:
        """True if it is known that nothing touches at u."""
        return bool(untouched(self.tables, FORCE, u))

    @cached_property
    def sweeps(self) -> bool:
        """True if bodies could pass through an obstacle within a step."""
        return any(group.depth < np.inf for _, group in self.groups)

    @cached_property
    def sweep(self) -> CrossingGuard:
        """A detector of obstacles that a body has passed through."""
        return CrossingGuard(self)

    def passed(self, a: tuple[Array, float], b: tuple[Array, float]) -> str | None:
        """Text about the obstacle that a body has passed through between two states, or ""."""
        if not self.obstacles or all(self.untouched(u) for u, _ in (a, b)):
            return None
        done, text = self.sweep.first(np.array([a[0], b[0]]), None, np.array([a[1], b[1]]))
        if not done:
            return f"a body has passed through {text}"
        for (which, group), x, _ in self.look(*b):
            if _inside(group, x, self._landmarks(which, b[1]), HIDDEN * group.height) is not None:
                return f"{self.obstacles[which]!r} is inside of a body"
        return None

    def sunk(self, u: Array, t: float) -> list[str]:
        """Text about bodies deep inside obstacles of default stiffness, or ""."""
        out: list[str] = []
        seen = self.look(np.array(u), t) if self.groups and not self.untouched(u) else []
        for stiffening, ((which, group), _, gap) in zip(self.stiffening, seen):
            one, deep, h = self.obstacles[which], -float(gap.min()), group.height
            if one.penalty is None and deep > SUNK * h:
                k = (1.0 + stiffening) * group.law.stiffness
                # both faces may be inside
                enough = k * (deep + max(0.0, deep - h)) / (SUGGESTED * h)
                out.append(
                    f"a body is {deep:.3g} deep in {one!r}, {deep / h:.2g} times its height: its "
                    f"stiffness, {k:.3g}, is too small for this pressure. Give "
                    f"stiffness={enough:.2g}, with a penetration of a tenth of the height")
        return out


def _inside(group, x, places, depth):
    """The number of the first place (2, k) that is deeper than ``depth`` in a body, or None."""
    # ``x`` (2, n) are the points of its surface.
    m, half = group.points, group.points // 2
    sides = x[:, :-2 * m].reshape(2, -1, 2, half)
    loops = np.concatenate([sides[:, :, 0], sides[:, :, 1, ::-1]], axis=2)  # around each element
    low, high = loops.min(axis=2), loops.max(axis=2)
    for k, place in enumerate(places.T[:, :, None]):
        near, = np.nonzero(np.all((low <= place) & (place <= high), axis=0))
        a = loops[:, near] - place[..., None]
        b = np.roll(a, -1, axis=2)
        crosses = (a[1] > 0.0) != (b[1] > 0.0)
        right = a[0] * (b[1] - a[1]) - a[1] * (b[0] - a[0])
        odd = np.sum(crosses & ((right > 0.0) == (b[1] > a[1])), axis=1) % 2 == 1
        d = b - a
        s = np.clip(-np.sum(a * d, axis=0) / np.maximum(np.sum(d * d, axis=0), TINY), 0, 1)
        distance = np.hypot(*(a + s * d))
        distance[:, [half - 1, -1]] = np.inf  # between elements
        if np.any(odd & (distance.min(axis=1) > depth)):
            return k
    return None


def matched(items: Iterable[Any], others: Iterable[Any],
            *same: Callable[[Any, Any], bool]) -> Iterator[tuple[Any, Any]]:
    """Pairs of the same things in two lists, each once, by the first rule that finds one."""
    rest, left = list(items), list(others)
    for rule in same:
        for one in tuple(rest):
            k = next((k for k, other in enumerate(left) if rule(one, other)), None)
            if k is not None:
                rest.remove(one)
                yield one, left.pop(k)


def take_over(contacts: Contacts, earlier: Contacts, u: Array, t: float) -> bool:
    """Give contacts the history of others, where there is one; else friction begins at u, t."""
    def known(contacts, k):
        which, group = contacts.groups[k]
        shape = contacts.obstacles[which].shape
        return (group.first, group.weights, group.law, np.array(shape.kind),
                shape.numbers_about(np.zeros(2)))

    found = [*matched(range(len(contacts.groups)), range(len(earlier.groups)), lambda k, j: all(
        map(np.array_equal, known(contacts, k), known(earlier, j))))]
    if found:
        new, old = contacts.tables.memory, earlier.tables.memory
        contacts.begin(u, t, len(found) < len(contacts.groups))
        new[:HEAD] = old[:HEAD]
        new[ANCHORED] = contacts.anchored
    for k, j in found:
        a, b = contacts.tables.pairs[k], earlier.tables.pairs[j]
        for x, y in zip(a[-5:], b[-5:]):  # largest multiplier, stiffening, and those of points
            x[:] = y
        a.anchors[:] += complex(*(earlier.origin - contacts.origin))
    return bool(found)
