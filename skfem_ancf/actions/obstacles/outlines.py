"""Outlines of shapes and obstacles as straight pieces, for pictures and files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core.types import Array

#: Cells of a grid along each side, in which a surface is looked for.
CELLS = 160
#: By how much what is drawn is larger than the body, relative to its size.
AROUND = 0.15


def circle(center: Array, radius: float, n: int) -> tuple[Array, Array]:
    """Points of a circle and its pieces."""
    angle, k = 2.0 * np.pi * np.arange(n) / n, np.arange(n)
    points = center[:, None] + radius * np.array([np.cos(angle), np.sin(angle)])
    return points, np.column_stack([k, np.roll(k, -1)])


def clipped(point: Array, normal: Array, box: Array) -> tuple[Array, Array]:
    """A line as one piece, as long as it is beside a box."""
    along = np.array([normal[1], -normal[0]])
    middle, half = box.mean(axis=1), 0.5 * np.hypot(*(box[:, 1] - box[:, 0]))
    foot = point + ((middle - point) @ along) * along
    return np.array([foot - half * along, foot + half * along]).T, np.array([[0, 1]])


def contour(distance: Callable[[Array], Array], box: Array) -> tuple[Array, Array]:
    """Where a distance is zero, by marching triangles on a grid."""
    x, y = (np.linspace(low, high, CELLS + 1) for low, high in box)
    points = np.array(np.meshgrid(x, y)).reshape(2, -1)
    values = distance(points)
    corner = (np.arange(CELLS)[:, None] * (CELLS + 1) + np.arange(CELLS)).ravel()
    below, above = (np.stack([corner, corner + a, corner + CELLS + 2], axis=1)
                    for a in (1, CELLS + 1))
    triangles = np.concatenate([below, above])
    inside = values[triangles] < 0.0
    cut = triangles[np.any(inside, axis=1) & ~np.all(inside, axis=1)]
    # the corner that is alone on its side, and the two others
    inside = values[cut] < 0.0
    alone = np.argmax(inside == (inside.sum(axis=1) == 1)[:, None], axis=1)
    rows = np.arange(len(cut))
    one = cut[rows, alone]
    ends = []
    for k in (1, 2):
        other = cut[rows, (alone + k) % 3]
        share = values[one] / (values[one] - values[other])
        ends.append(points[:, one] + share * (points[:, other] - points[:, one]))
    return np.concatenate(ends, axis=1), np.column_stack([rows, rows + len(rows)])


def around(points: Array, part: float = AROUND) -> Array:
    """A box about points, with a margin that is a part of their size."""
    low, high = points.min(axis=1), points.max(axis=1)
    margin = part * float(np.max(high - low))
    return np.array([low - margin, high + margin]).T


def obstacles_of(state: Any) -> list[Any]:
    """The obstacles of a state's scene; none of what has no system."""
    system = getattr(state, "system", None)
    return [] if system is None else list(system.forces.contacts.obstacles)


def outlines(state: Any, box: Array) -> list[Array]:
    """The surface of each obstacle at a state, as straight pieces."""
    out = []
    for one in obstacles_of(state):
        points, pieces = one.outline(box, state.load if state.t is None else state.t)
        out.append(points.T[pieces])
    return out
