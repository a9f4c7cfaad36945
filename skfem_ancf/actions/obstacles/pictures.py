"""Outlines of a scene's obstacles, for pictures and files."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.types import Array

#: By how much what is drawn is larger than the body, relative to its size.
AROUND = 0.15


def around(points: Array) -> Array:
    """A box about points, with a margin."""
    low, high = points.min(axis=1), points.max(axis=1)
    margin = AROUND * float(np.max(high - low))
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
