"""Sampling of functions of time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .errors import ask_array, require_finite, require_function
from .types import Array

#: Up to this number of times a function is called one by one.
FEW = 8


def sample(function: Callable[[Any], Any], times: ArrayLike, name: str = "function",
           shape: tuple[int, ...] | None = None) -> Array:
    """Evaluate a function of time at times (n,), shape (n,) + shape of its value.

    If the function accepts arrays, it is called once. This is checked at the first, the middle and
    the last time. ``shape`` is the expected shape of a value, None for any.

    Examples
    --------
    >>> float(sample(lambda t: 2 * t, np.linspace(0, 1, 11))[-1])
    2.0
    >>> sample(lambda t: (t, 1.0 if t < 0.5 else 2.0), np.array([0.0, 1.0])).tolist()
    [[0.0, 1.0], [1.0, 2.0]]
    """
    require_function(name, function, "of time")
    times = require_finite("times", times, (None,))

    def alone(some: Array) -> Array:
        return np.array([ask_array(name + "(t={:g})", shape, function, t) for t in some.tolist()])

    n = len(times)
    some = [0, n // 2, n - 1]
    if n <= FEW:
        return alone(times)
    with suppress(Exception):  # the function does not accept arrays
        values = np.asarray(function(times), dtype=float)
        values = values if values.ndim == 1 else np.moveaxis(values, -1, 0)
        few = alone(times[some])
        if values.shape == (n,) + few.shape[1:] and np.isfinite(values).all() and np.allclose(
                values[some], few, rtol=1e-13, atol=1e-15 * np.max(np.abs(few), initial=0.0)):
            return values
    return alone(times)
