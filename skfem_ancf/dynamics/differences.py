"""Divided differences over the steps of a motion, for error estimates."""

from __future__ import annotations

from math import factorial

import numpy as np

from ..core.types import Array
from .base import Motion

#: Largest ratio dt |f^(k + 1)| / |f^(k)| in an extrapolation.
GROWTH = 2.0


def difference(x: Array, a: Array) -> Array:
    """The derivative of order n - 1 of the polynomial through n points, shape (N,)."""
    return difference_row(x) @ a


def difference_row(x: Array) -> Array:
    """Weights (n,) of :func:`difference`."""
    if len(x) < 3:
        return np.ones(1) if len(x) == 1 else np.array([1.0, -1.0]) / (x[0] - x[1])
    gaps = x[:, None] - x
    gaps.flat[::len(x) + 1] = 1.0
    return factorial(len(x) - 1) / gaps.prod(axis=1)


def derivative(old: Motion, new: Motion, t: float, value: Array,
               order: int) -> tuple[int, Array, Array | None]:
    """The two highest derivatives of a function from its values in this step and previous ones.

    Returns the order, the derivative of that order and that of one order less, or None; the values
    are stored in ``new.memory``.
    """
    before = old.memory or {}
    values = np.concatenate([value[None], before.get("values", value[None][:0])])[:order + 1]
    times = np.append(t, before.get("times", ()))[:order + 1]
    new.memory = {**(new.memory or {}), "values": values[:order], "times": times[:order]}
    k = len(times) - 1
    return k, difference(times, values), difference(times[:k], values[:k]) if k else None


def grown(size: Array, lower: Array, missing: int) -> Array:
    """Extrapolate a scaled derivative to a higher one by the ratio of the last two."""
    if not missing:
        return size
    least = np.linalg.norm(lower)
    growth = min(np.linalg.norm(size) / least, GROWTH) if least > 0.0 else 0.0
    return growth**missing * size


__all__ = ["derivative", "difference", "difference_row", "grown"]
