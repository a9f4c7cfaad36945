"""Derivatives of what is known at instants of a motion, of the size of its steps."""

from __future__ import annotations

from math import factorial

import numpy as np

from ..core.types import Array
from .base import Motion

#: Growth from one derivative to the next, times the size of the step, at most.
GROWTH = 2.0


def difference(x: Array, a: Array) -> Array:
    """The derivative of the highest order of a polynomial, shape (N,)."""
    return difference_row(x) @ a


def difference_row(x: Array) -> Array:
    """What makes the derivative of the highest order of a polynomial of its values, shape (n,)."""
    if len(x) < 3:
        return np.ones(1) if len(x) == 1 else np.array([1.0, -1.0]) / (x[0] - x[1])
    gaps = x[:, None] - x
    gaps.flat[::len(x) + 1] = 1.0
    return factorial(len(x) - 1) / gaps.prod(axis=1)


def derivative(old: Motion, new: Motion, t: float, value: Array,
               order: int) -> tuple[int, Array, Array | None]:
    """Derivatives of a function of time from its value in a step and those in steps before."""
    before = old.memory or {}
    values = np.concatenate([value[None], before.get("values", value[None][:0])])[:order + 1]
    times = np.append(t, before.get("times", ()))[:order + 1]
    new.memory = {**(new.memory or {}), "values": values[:order], "times": times[:order]}
    k = len(times) - 1
    return k, difference(times, values), difference(times[:k], values[:k]) if k else None


def grown(size: Array, lower: Array, missing: int) -> Array:
    """A derivative times a power of the step, grown by those that are missing as from the last."""
    if not missing:
        return size
    least = np.linalg.norm(lower)
    growth = min(np.linalg.norm(size) / least, GROWTH) if least > 0.0 else 0.0
    return growth**missing * size


__all__ = ["derivative", "difference", "difference_row", "grown"]
