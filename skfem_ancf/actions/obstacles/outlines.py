"""Outlines of shapes and obstacles as straight segments, for pictures and files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core import Array

#: Cells along each side of the contour grid.
CELLS = 160
#: Margin of the box relative to the size of the body.
AROUND = 0.15


def circle(center: Array, radius: float, n: int) -> tuple[Array, Array]:
    """Points of a circle and its segments."""
    angle, k = 2.0 * np.pi * np.arange(n) / n, np.arange(n)
    points = center[:, None] + radius * np.array([np.cos(angle), np.sin(angle)])
    return points, np.column_stack([k, np.roll(k, -1)])


def clipped(point: Array, normal: Array, box: Array) -> tuple[Array, Array]:
    """A line as one segment near a box."""
    along = np.array([normal[1], -normal[0]])
    middle, half = box.mean(axis=1), 0.5 * np.hypot(*(box[:, 1] - box[:, 0]))
    foot = point + ((middle - point) @ along) * along
    return np.array([foot - half * along, foot + half * along]).T, np.array([[0, 1]])


def contour(distance: Callable[[Array], Array], box: Array) -> tuple[Array, Array]:
    """Zero contour of a distance function, by marching triangles on a grid."""
    x, y = (np.linspace(low, high, CELLS + 1) for low, high in box)
    points = np.array(np.meshgrid(x, y)).reshape(2, -1)
    values = distance(points)
    corner = (np.arange(CELLS)[:, None] * (CELLS + 1) + np.arange(CELLS)).ravel()
    below, above = (np.stack([corner, corner + a, corner + CELLS + 2], axis=1)
                    for a in (1, CELLS + 1))
    triangles = np.concatenate([below, above])
    inside = values[triangles] < 0.0
    cut = triangles[np.any(inside, axis=1) & ~np.all(inside, axis=1)]
    # the corner alone on its side, and the two others
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
    """A bounding box with a margin relative to its size."""
    low, high = points.min(axis=1), points.max(axis=1)
    margin = part * float(np.max(high - low))
    return np.array([low - margin, high + margin]).T


def outlines(state: Any, box: Array) -> list[Array]:
    """Outlines of the obstacles at a state, as straight segments."""
    out, system = list[Array](), getattr(state, "system", None)
    for one in () if system is None else system.forces.contacts.obstacles:
        points, pieces = one.outline(box, state._time)
        out.append(points.T[pieces])
    return out
