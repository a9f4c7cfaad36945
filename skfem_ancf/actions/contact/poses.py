"""Poses of obstacles."""

from __future__ import annotations

import numpy as np

from ...core.types import Array


def carried(pose: Array, x: Array) -> Array:
    """Points x, shape (2, n), moved with an obstacle."""
    turn = np.array([[pose[2], -pose[3]], [pose[3], pose[2]]])
    return turn @ (x - pose[4:6, None]) + pose[4:6, None] + pose[:2, None]


def taken_back(pose: Array, x: Array) -> Array:
    """The inverse of :func:`carried`."""
    turn = np.array([[pose[2], pose[3]], [-pose[3], pose[2]]])
    return turn @ (x - pose[4:6, None] - pose[:2, None]) + pose[4:6, None]
