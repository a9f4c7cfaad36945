"""Poses of obstacles."""

from __future__ import annotations

import numpy as np

from ...core import Array


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
