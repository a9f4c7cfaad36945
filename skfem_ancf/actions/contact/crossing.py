"""Detection of steps in which bodies pass through an obstacle (tunnelling). The gap changes by no
more than the path length. A point with path length w and gaps g_0 and g_1 at the ends has been no
deeper than ``(w - g_0 - g_1) / 2``, which excludes most points. The others have crossed the
obstacle if they are deeper on the path than at both ends, and on another side at its end."""

from typing import Any

import numpy as np

from ...core import Array
from .kernels import outline
from .tables import CUSTOM, taken_back

#: Largest number of samples of a path; number of points per batch.
MOST_PARTS, TOGETHER = 400, 50_000
#: Bound on the additional length of a cubic path, relative to the deviation of its end rates.
BENT = 0.3
#: Depth that causes a message, relative to half the thickness of an obstacle.
DEEP = 0.5
#: Largest cosine of the angle between the normals at both ends of a crossing; a chord that cuts a
#: circle by a tenth of its radius has 0.62.
ASIDE = 0.62


class CrossingGuard:
    """Finds points that have crossed an obstacle between two instants."""

    def __init__(self, contacts: Any) -> None:
        self._paths = [_Path(contacts, k) for k, (_, group) in enumerate(contacts.groups)
                       if group.depth < np.inf]

    def first(self, u: Array, v: Array | None, t: Array) -> tuple[int, str]:
        """Number of steps without a crossing, and text about the obstacle of the next one."""
        # Arguments are displacements and velocities at all instants, (n + 1, N), None for straight
        # paths, and times or load factors, (n + 1,).
        done, text = len(t) - 1, ""
        for path in self._paths:
            k = path.first(u[:done + 1], None if v is None else v[:done + 1], t[:done + 1])
            if k < done:
                done, text = k, repr(path.obstacle)
            if done == 0:
                break
        return done, text

    def deep(self) -> str:
        """Text about an obstacle that points may leave on its other side, or ""."""
        for path in self._paths:
            inner = path.obstacle.shape.inner
            if path.deepest > DEEP * inner:
                return (f"a body was {path.deepest:.3g} deep in {path.obstacle!r}, whose middle is "
                        f"{inner:.3g} deep: it may leave it on the other side. Give stiffness= of "
                        f"more than {path.obstacle.groups[0].law.stiffness:.3g}")
        return ""

    def begin(self) -> None:
        for path in self._paths:
            path.deepest = 0.0


class _Path:
    """The paths of the points of a group."""

    def __init__(self, contacts, k):
        self._contacts, (self._which, self._group) = contacts, contacts.groups[k]
        self.obstacle = contacts.obstacles[self._which]
        self._numbers, group = self.obstacle.shape.numbers_about(contacts.origin), self._group
        self._dofs = group.first[::group.points, None] + np.arange(2 * len(group.weights))
        self._weights = [w.reshape(len(w), group.elements, -1).transpose(1, 0, 2)
                         for w in (group.weights, group.slopes) if len(w)]
        self.deepest = 0.0

    def first(self, u, v, t):
        """The first step in which a point crosses the obstacle, or the number of steps."""
        size, depth = max(1, TOGETHER // len(self._group.first)), self._group.depth
        for start in range(0, len(t) - 1, size):
            some = slice(start, start + size + 1)
            z, times = self._vectors(u[some]), t[some]
            x = self._seen(z, times)
            gap = self._gap(x, times)
            self.deepest = max(self.deepest, -float(np.min(gap)))
            path = np.hypot(*np.moveaxis(np.diff(x, axis=0), 1, 0))
            if v is not None:
                h, change, rates = (np.diff(times)[:, None, None], np.diff(z, axis=0),
                                    self._vectors(v[some]))
                path += BENT * sum(self._sizes(h * rate - change)
                                   for rate in (rates[:-1], rates[1:]))
            most = depth + np.maximum(-np.minimum(gap[:-1], gap[1:]), 0.0)
            long = path - gap[:-1] - gap[1:] > 2.0 * most
            inside = np.maximum(gap[:-1], gap[1:]) < -depth
            for k in np.flatnonzero((long | inside).any(axis=1)):
                at, = np.nonzero(long[k] | inside[k])
                of = slice(start + k, start + k + 2)
                if self._crosses(at, u[of], None if v is None else v[of], t[of], path[k, at],
                                 most[k, at], long[k, at], inside[k, at]):
                    return int(start + k)
        return len(t) - 1

    def _crosses(self, at, u, v, t, path, most, long, inside):
        """True if one of some points crosses the obstacle in a step."""
        normals = [self._asked(x[:, at], s, True)[1:3]
                   for x, s in zip(self._seen(self._vectors(u), t), t)]
        cosine = np.sum(normals[0] * normals[1], axis=0)
        if np.any(inside & (cosine < 0.0)):
            return True  # through its middle
        chosen = long & (cosine < ASIDE)
        if not chosen.any():
            return False
        at, most = at[chosen], most[chosen]
        parts = int(np.clip(np.ceil(path[chosen].max() / (2.0 * self._group.depth)), 2, MOST_PARTS))
        change, h = u[1] - u[0], t[1] - t[0]
        for s in np.arange(1, parts) / parts:
            time, within = t[:1] + s * h, u[0] + s * change
            if v is not None:  # cubic
                within = within + s * (1.0 - s) * (
                    (1.0 - s) * (h * v[0] - change) - s * (h * v[1] - change))
            x = self._seen(self._vectors(within[None]), time)[..., at]
            if np.any(-self._gap(x, time) > most):
                return True
        return False

    def _vectors(self, u):
        """Displacements (k, 2 or 4, points) of positions and, for cables, slopes."""
        e, n = self._dofs.shape
        of_elements = u[:, self._dofs].reshape(len(u), e, n // 2, 2).transpose(1, 0, 3, 2)
        found = [of_elements.reshape(e, -1, n // 2) @ w for w in self._weights]
        return np.concatenate([x.reshape(e, len(u), 2, -1).transpose(1, 2, 0, 3).reshape(
            len(u), 2, -1) for x in found], axis=1)

    def _sizes(self, z):
        """Upper bounds of displacements, shape (k, points)."""
        out = np.hypot(z[:, 0], z[:, 1])
        if z.shape[1] > 2:
            out += 2.0 * np.abs(self._group.offsets) * np.hypot(z[:, 2], z[:, 3])
        return out

    def _seen(self, z, t):
        """Surface points in the frame of the obstacle, (k, 2, points)."""
        group, z = self._group, z + self._group.starts[:z.shape[1]]
        x = z[:, :2]
        if z.shape[1] > 2:
            normals = np.stack([-z[:, 3], z[:, 2]], axis=1)
            x = x + group.offsets * normals / np.hypot(z[:, 2], z[:, 3])[:, None]
        if self.obstacle.moves:
            x = np.array([taken_back(self._contacts.pose(self._which, float(s), False), y)
                          for s, y in zip(t, x)])
        return x

    def _gap(self, x, t):
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
