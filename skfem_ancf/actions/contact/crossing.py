"""A guard against steps in which bodies jump over an obstacle.

The gap changes by no more than the way. So a point that goes the way w and has the gaps g_0 and g_1
at its ends has been no deeper than ``(w - g_0 - g_1) / 2`` in between, which tells most points of
most steps without looking at their way. Of the others those have crossed the obstacle that are
deeper on the way than at both of its ends, and on another side at its end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.types import Array
from .gap import outline
from .poses import taken_back
from .tables import CUSTOM, STIFFNESS

#: Parts of a way at which points are looked at, at most; points that are looked at together.
MOST_PARTS, TOGETHER = 400, 200_000
#: Of a cubic way: its length by the largest of the displacement and of what the rates at both ends
#: would make, and by how much they differ from it.
LONGER, BENT = 1.6, 0.3
#: The way after which short steps are looked at again, and the depth that is said, in what is half
#: of the thickness of an obstacle.
AGAIN, DEEP = 1.0, 0.5
#: Cosine of the angle between the normals at both ends up to which a point is on another side: a
#: chord that cuts a circle by a tenth of its radius has 0.62.
ASIDE = 0.62


class CrossingGuard:
    """Looks for points that have crossed an obstacle between two instants."""

    def __init__(self, contacts: Any) -> None:
        self._paths = [_Path(contacts, k) for k, (_, group) in enumerate(contacts.groups)
                       if group.depth < np.inf]

    def first(self, u: Array, v: Array | None, t: Array) -> tuple[int, str]:
        """How many steps cross nothing, and which obstacle the next one does, in words.

        Of displacements and velocities at all instants, (n + 1, N), none for straight ways, and
        times or load factors, (n + 1,).
        """
        done, text = len(t) - 1, ""
        for path in self._paths:
            k = path.first(u[:done + 1], None if v is None else v[:done + 1], t[:done + 1])
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

    def __init__(self, contacts, k):
        self._contacts, (self._which, self._group) = contacts, contacts.groups[k]
        self.obstacle = contacts.obstacles[self._which]
        self._numbers, group = contacts.numbers(self._which), self._group
        self._dofs = group.first[:, None] + np.arange(2 * len(group.weights))
        self._range = slice(int(self._dofs.min()), int(self._dofs.max()) + 1)
        bound, half = np.abs(group.weights), len(group.weights) // 2
        if len(group.slopes):  # normals turn by no more than twice the change of a slope
            bound = bound + 2.0 * np.abs(group.offsets * group.slopes)
        self._most = (bound[:half] + bound[half:]).max(axis=1)
        self._by_time = self.obstacle.moves or self.obstacle.shape.kind == CUSTOM
        self.deepest = self.gone = 0.0

    def first(self, u, v, t):
        """The first step on which a point crosses the obstacle, or how many there are."""
        steps = np.arange(len(t) - 1)
        if not self._by_time:
            steps, = np.nonzero(self._looked(LONGER * self._longest(u, v, t)))
        size = max(1, TOGETHER // len(self._dofs))
        for k in range(0, len(steps), size):
            found = self._first_of(steps[k:k + size], u, v, t)
            if found is not None:
                return found
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
        way = np.abs(np.diff(u[:, self._range], axis=0))
        if v is not None:
            rate = np.maximum(np.abs(v[:-1, self._range]), np.abs(v[1:, self._range]))
            way = np.maximum(way, np.diff(t)[:, None] * rate)
        size = way.reshape(len(way), -1, 2 * len(self._most)).max(axis=1)
        return np.sqrt(2.0) * (size.reshape(len(way), -1, 2).max(axis=2) @ self._most)

    def _first_of(self, steps, u, v, t):
        """The first of some steps on which a point crosses the obstacle, or None."""
        ends, depth = (steps, steps + 1), self._group.depth
        x = [self._seen(u[at], t[at]) for at in ends]
        gap = [self._gap(y, t[at]) for y, at in zip(x, ends)]
        self.deepest = max(self.deepest, -float(np.min(gap)))
        way = np.hypot(*np.moveaxis(x[1] - x[0], 1, 0))
        if v is not None:
            h, change = (t[steps + 1] - t[steps])[:, None], u[steps + 1] - u[steps]
            way += BENT * sum(self._sizes(h * v[at] - change) for at in ends)
        most = depth + np.maximum(-np.minimum(*gap), 0.0)
        long, inside = way - gap[0] - gap[1] > 2.0 * most, np.maximum(*gap) < -depth
        for k in np.flatnonzero((long | inside).any(axis=1)):
            at, = np.nonzero(long[k] | inside[k])
            of = slice(steps[k], steps[k] + 2)
            if self._crosses(at, u[of], None if v is None else v[of], t[of], way[k, at],
                             most[k, at], long[k, at], inside[k, at]):
                return int(steps[k])
        return None

    def _crosses(self, at, u, v, t, way, most, long, inside):
        """True if one of some points crosses the obstacle in a step."""
        normals = [self._asked(x, s, True)[1:3] for x, s in zip(self._seen(u, t, at), t)]
        cosine = np.sum(normals[0] * normals[1], axis=0)
        if np.any(inside & (cosine < 0.0)):
            return True  # through its middle
        chosen = long & (cosine < ASIDE)
        if not chosen.any():
            return False
        at, most = at[chosen], most[chosen]
        parts = int(np.clip(np.ceil(way[chosen].max() / (2.0 * self._group.depth)), 2, MOST_PARTS))
        for s in np.arange(1, parts) / parts:
            time = t[:1] + s * (t[1] - t[0])
            x = self._seen(_between(u, v, t, s)[None], time, at)
            if np.any(-self._gap(x, time) > most):
                return True
        return False

    def _sizes(self, u):
        """How far points go by rates (k, N) at most, shape (k, points)."""
        pairs = self._pairs(u, slice(None))
        out = np.hypot(*np.einsum("kpac,ap->ckp", pairs, self._group.weights))
        if len(self._group.slopes):
            slopes = np.einsum("kpac,ap->ckp", pairs, self._group.slopes)
            out += 2.0 * np.abs(self._group.offsets) * np.hypot(*slopes)
        return out

    def _pairs(self, u, at):
        return u[:, self._dofs[at]].reshape(len(u), -1, len(self._group.weights), 2)

    def _seen(self, u, t, at=slice(None)):
        """Points of the surface as the obstacle sees them that has not moved, (k, 2, points)."""
        group, pairs = self._group, self._pairs(u, at)
        x = group.starts[:2, at] + np.einsum("kpac,ap->kcp", pairs, group.weights[:, at])
        if len(group.slopes):
            d = group.starts[2:, at] + np.einsum("kpac,ap->kcp", pairs, group.slopes[:, at])
            normals = np.stack([-d[:, 1], d[:, 0]], axis=1)
            x += group.offsets[at] * normals / np.hypot(d[:, 0], d[:, 1])[:, None]
        if self.obstacle.moves:
            x = np.array([taken_back(self._contacts.pose(self._which, float(s), False), y)
                          for s, y in zip(t, x)])
        return x

    def _gap(self, x, t):
        """The gaps of points (k, 2, points), seen from the obstacle, at times (k,)."""
        if self.obstacle.shape.kind == CUSTOM:
            return np.array([self._asked(y, s)[0] for y, s in zip(x, t)])
        return self._asked(np.moveaxis(x, 1, 0).reshape(2, -1), 0.0)[0].reshape(len(x), -1)

    def _asked(self, x, t, whole=False):
        """The gap of points (2, n), seen from the obstacle, and its gradient if whole; (6, n)."""
        shape, out = self.obstacle.shape, np.empty((6, x.shape[1]))
        if shape.kind != CUSTOM:
            outline(self._numbers, whole, np.ascontiguousarray(x), out)
        elif whole:
            out[:] = shape.derivatives(x + self._contacts.origin[:, None], t)
        else:
            out[0] = shape.distance(x + self._contacts.origin[:, None], t)
        return -out if shape.hollow else out


def _between(u, v, t, s):
    """The displacement at a part of a step: cubic, or straight without velocities."""
    change, h = u[1] - u[0], t[1] - t[0]
    straight = u[0] + s * change
    if v is None:
        return straight
    return straight + s * (1.0 - s) * ((1.0 - s) * (h * v[0] - change) - s * (h * v[1] - change))


def middle_of(group: Any) -> Array:
    """Place of the middle of each element; then weights, and how much they differ from these."""
    n, m = group.elements, group.points
    each = group.weights.reshape(-1, n, m)
    mean, half = each.mean(axis=2), len(group.weights) // 2
    spread = np.abs(each - mean[..., None]).max(axis=2)
    spread[0] = 0.0  # both places together are a translation
    spread[half] = np.maximum(spread[half], np.abs(each[0] - mean[0][:, None]).max(axis=1))
    start = group.starts[:2].reshape(2, n, m).mean(axis=2)
    return np.concatenate([start, np.stack([mean, spread], axis=1).reshape(-1, n)])
