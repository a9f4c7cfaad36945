"""What bodies pass through on their way from one instant to the next.

The distance from an obstacle changes by no more than the way. So a point that goes the way w and
has the distances g_0 and g_1 at its ends has been no deeper than ``(w - g_0 - g_1) / 2`` in
between, which tells most points of most steps without looking at their way. Of the others those
have passed through that are deeper on it than at both of its ends, and on another side at its end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .gap import outline, places, surface
from .poses import taken_back
from .tables import CUSTOM, RADIUS, STIFFNESS

if TYPE_CHECKING:
    from ...core.types import Array

#: Parts of a way at which points are looked at, at most.
MOST_PARTS = 400
#: Of a cubic way: its length by the largest of the displacement and of what the rates at both ends
#: would make, and by how much they differ from it.
LONGER, BENT = 1.6, 0.3
#: How far points are from the middle of an element on the way, by how far at its ends.
WIDER = 1.2
#: The way after which short steps are looked at again, and the depth that is said, in what is half
#: of the thickness of an obstacle.
AGAIN, DEEP = 1.0, 0.5
#: Cosine of the angle between the normals at both ends up to which a point is on another side: a
#: chord that cuts a circle by a tenth of its radius has 0.62.
ASIDE = 0.62


class Passage:
    """Looks for points that have passed through an obstacle between two instants.

    Parameters
    ----------
    contacts
        The obstacles of a scene.
    """

    def __init__(self, contacts: Any) -> None:
        self._poses: dict[tuple[int, float], Array] = {}
        self._paths = [_Path(contacts, k, self._poses) for k, (_, group) in enumerate(
            contacts.groups) if group.depth < np.inf]

    def first(self, u: Array, v: Array | None, t: Array) -> tuple[int, str]:
        """How many steps pass through nothing, and through what the next one does.

        Parameters
        ----------
        u, v
            Displacement and velocity of the coordinates at all instants, shape (n + 1, N); no
            velocity for ways that are straight.
        t
            Times, shape (n + 1,); in statics load factors.

        Returns
        -------
        int, str
            The number of steps, n if there are no more, and the obstacle in words.
        """
        done, text = len(t) - 1, ""
        self._poses.clear()
        for path in self._paths:
            rates = np.zeros((done + 1, 0)) if v is None else v[:done + 1]
            k = path.first(u[:done + 1], rates, t[:done + 1])
            if k < done:
                done, text = k, repr(path.obstacle)
            if done == 0:
                break
        return done, text

    def deep(self) -> str:
        """Which obstacle points were so deep in that they may leave it on its other side, or ""."""
        for path in self._paths:
            inner = path.obstacle.shape.inner
            if path.deepest > DEEP * inner:
                return (f"a body was {path.deepest:.3g} deep in {path.obstacle!r}, whose middle is "
                        f"{inner:.3g} deep: it may leave it on the other side. Give stiffness= of "
                        f"more than {path.obstacle.groups[0].numbers[STIFFNESS]:.3g}")
        return ""

    def begin(self) -> None:
        """As if nothing had been looked at."""
        for path in self._paths:
            path.deepest = path.gone = 0.0


class _Path:
    """The ways of the points of a group."""

    def __init__(self, contacts, k, poses):
        self._which, self._group = contacts.groups[k]
        self.obstacle, self._poses = contacts.obstacles[self._which], poses
        self._contacts, self._numbers = contacts, contacts.numbers(self._which)
        self._pair = contacts.pair(k)
        self._tables, group = contacts.tables, self._group
        first = group.first[::group.points]
        self._dofs = first[:, None] + np.arange(2 * len(group.weights))
        self._range = slice(int(first.min()), int(first.max()) + self._dofs.shape[1])
        middle = middle_of(group)
        self._start, self._mean, self._spread = middle[:2], middle[2::2], middle[3::2]
        bound, half = np.abs(group.weights), len(group.weights) // 2
        self._bound = self._spread = self._spread.max(axis=1)[1:]
        if len(group.slopes):  # normals turn by no more than twice the change of a slope
            turned = 2.0 * np.abs(group.offsets * group.slopes)
            bound, self._bound = bound + turned, self._bound + turned.max(axis=1)[1:]
        self._most = (bound[:half] + bound[half:]).max(axis=1)
        self._by_time = self.obstacle.moves or self.obstacle.shape.kind == CUSTOM
        self._turns = 0.0 if self.obstacle.angle is None else 2.0
        self.deepest = self.gone = 0.0

    def first(self, u, v, t):
        """The first step on which a point passes through the obstacle, or how many there are."""
        steps = np.arange(len(t) - 1)
        if not self._by_time:
            steps, = np.nonzero(self._looked(LONGER * self._longest(u, v, t)))
        if len(steps):
            ends = [np.array([x[steps], x[steps + 1]]) for x in (u, v, t)]
            near = self._near(*ends)
            for k in np.nonzero(near.any(axis=1))[0]:
                if self._passes(np.nonzero(near[k])[0], *(x[:, k] for x in ends)):
                    return int(steps[k])
        return len(t) - 1

    def _looked(self, ways):
        """Which steps are looked at: long ones, and now and then one of many that are short."""
        gone = self.gone + np.cumsum(ways)
        part = AGAIN * self.obstacle.shape.inner
        looked = (ways > 2.0 * self._group.depth) | (np.diff(gone // part, prepend=0.0) > 0.0)
        self.gone = gone[-1] % part
        return looked

    def _longest(self, u, v, t):
        """No less than the largest of displacements, and of what rates would make; shape (n,)."""
        h = np.diff(t)[:, None]
        way = np.abs(np.diff(u[:, self._range], axis=0))
        for rate in (v[:-1], v[1:]) if v.size else ():
            way = np.maximum(way, np.abs(h * rate[:, self._range]))
        types = 2 * len(self._most)
        size = way.reshape(len(way), -1, types).max(axis=1).reshape(len(way), -1, 2).max(axis=2)
        return np.sqrt(2.0) * (size @ self._most)

    def _near(self, u, v, t):
        """Which elements may pass through the obstacle in each step, or be deep in it.

        Of both ends of n steps, the first axis; shape (n, elements).
        """
        x, change = self._middles(u)
        wide = self._group.numbers[RADIUS] + _sizes(change) @ self._spread
        if self._by_time:
            x = np.array([[self._seen(*each) for each in zip(*end)] for end in zip(x, t)])
            gap = np.array([[self._asked(*each)[0] for each in zip(*end)] for end in zip(x, t)])
        else:
            gap = self._asked(np.moveaxis(x, 2, 0).reshape(2, -1), 0.0)[0].reshape(wide.shape)
        self._tables.counts[0] += gap.size
        way = np.hypot(*np.moveaxis(x[1] - x[0], 1, 0)) + self._bent(u, v, t)
        wide = WIDER * np.maximum(wide[1], wide[0])
        passes = way + self._turns * wide + _sizes(change[1] - change[0]) @ self._bound > (
            2.0 * self._group.depth)
        deep = gap[1] - wide < -DEEP * self.obstacle.shape.inner
        return (gap[1] + gap[0] - way < 2.0 * wide) & (passes | deep)

    def _middles(self, u):
        """Middles of elements, and pairs of coordinates, the places of both nodes as one way."""
        pairs = u[..., self._dofs].reshape(*u.shape[:2], len(self._dofs), -1, 2)
        x = np.einsum("ntepc,pe->ntce", pairs, self._mean)
        pairs[..., len(self._mean) // 2, :] -= pairs[..., 0, :]
        return self._start + x, pairs[..., 1:, :]

    def _bent(self, u, v, t):
        """How much longer than straight the ways of points are, at most; (n, elements)."""
        if not v.size:
            return 0.0
        h, out = (t[1] - t[0])[:, None], 0.0
        for rate in v:
            x, change = self._middles((h * rate - (u[1] - u[0]))[None])
            out = out + BENT * (np.hypot(*np.moveaxis(x[0] - self._start, 1, 0))
                                + _sizes(change[0]) @ self._bound)
        return out

    def _passes(self, elements, u, v, t):
        """True if a point of some elements passes through the obstacle in a step."""
        m = self._group.points
        at = (elements[:, None] * m + np.arange(m)).ravel()
        ends = [self._points(at, *end) for end in zip(u, t)]
        found = [self._asked(x, time, True) for x, time in zip(ends, t)]
        way = np.hypot(*(ends[1] - ends[0]))
        if v.size:
            way += np.repeat(self._bent(*(x[:, None] for x in (u, v, t)))[0, elements], m)
        least, deep = self._group.depth, -np.minimum(found[0][0], found[1][0])
        self.deepest = max(self.deepest, float(deep.max()))
        most = least + np.maximum(deep, 0.0)
        turned = np.sum(found[0][1:3] * found[1][1:3], axis=0)
        if np.any((turned < 0.0) & (np.maximum(found[0][0], found[1][0]) < -least)):
            return True  # through its middle
        chosen = (turned < ASIDE) & (way - found[0][0] - found[1][0] > 2.0 * most)
        if not chosen.any():
            return False
        at, most = at[chosen], most[chosen]
        parts = int(np.clip(np.ceil(way[chosen].max() / (2.0 * self._group.depth)), 2, MOST_PARTS))
        for s in np.arange(1, parts) / parts:
            x = self._points(at, _between(u, v, t, s), t[0] + s * (t[1] - t[0]))
            if np.any(-self._asked(x, t[0] + s * (t[1] - t[0]))[0] > most):
                return True
        return False

    def _points(self, at, u, t):
        """Points of the surface, seen from the obstacle; shape (2, n)."""
        z, x = np.empty((4, at.size)), np.empty((2, at.size))
        places(self._pair, u, 1.0, at, z)
        surface(self._pair, at, z, x)
        self._tables.counts[1] += at.size
        return self._seen(x, t)

    def _seen(self, x, t):
        """Points as the obstacle sees them that has not moved."""
        if not self.obstacle.moves:
            return x
        key = self._which, float(t)
        if key not in self._poses:
            self._poses[key] = self._contacts.pose(self._which, float(t), False)
        return taken_back(self._poses[key], x)

    def _asked(self, x, t, whole=False):
        """The distance of points, seen from the obstacle, and its gradient if whole; (6, n)."""
        shape, out = self.obstacle.shape, np.empty((6, x.shape[1]))
        if shape.kind != CUSTOM:
            outline(self._numbers, whole, np.ascontiguousarray(x), out)
        elif whole:
            out[:] = shape.derivatives(x + self._contacts.origin[:, None], t)
        else:
            out[0] = shape.distance(x + self._contacts.origin[:, None], t)
        return -out if shape.hollow else out


def _sizes(pairs):
    return np.hypot(pairs[..., 0], pairs[..., 1])


def _between(u, v, t, s):
    """The displacement at a part of a step: cubic, or straight without velocities."""
    straight, change = u[0] + s * (u[1] - u[0]), u[1] - u[0]
    if not v.size:
        return straight
    h = t[1] - t[0]
    return straight + s * (1.0 - s) * ((1.0 - s) * (h * v[0] - change) - s * (h * v[1] - change))


def middle_of(group: Any) -> Array:
    """Place of the middle of each element; then weights, and how much they differ from these.

    Parameters
    ----------
    group
        Its points.
    """
    n, m = group.elements, group.points
    each = group.weights.reshape(-1, n, m)
    mean, half = each.mean(axis=2), len(group.weights) // 2
    spread = np.abs(each - mean[..., None]).max(axis=2)
    spread[0] = 0.0  # both places together are a translation
    spread[half] = np.maximum(spread[half], np.abs(each[0] - mean[0][:, None]).max(axis=1))
    start = group.starts[:2].reshape(2, n, m).mean(axis=2)
    return np.concatenate([start, np.stack([mean, spread], axis=1).reshape(-1, n)])


__all__ = ["Passage", "middle_of"]
