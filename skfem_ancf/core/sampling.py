"""Functions of time at many times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ask_array, ask_number, require_finite, require_function

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from .types import Array

FEW = 8  # times up to which a function is asked one by one


def sample(function: Callable[[Any], Any], times: ArrayLike, name: str = "function",
           shape: tuple[int, ...] | None = None) -> Array:
    """A function of one time at each of several times.

    A function that takes arrays is asked once; it is one if what it returns has the shape, and at
    the first, the middle and the last time the value that it has for that time alone.

    Parameters
    ----------
    function
        Takes a time, returns a number or an array.
    times
        Times, shape (n,).
    name
        What messages call the function.
    shape
        That of its value; None for any.

    Returns
    -------
    ndarray
        Shape (n,) + that of the value.

    Examples
    --------
    >>> float(sample(lambda t: 2 * t, np.linspace(0, 1, 11))[-1])
    2.0
    >>> sample(lambda t: (t, 1.0 if t < 0.5 else 2.0), np.array([0.0, 1.0])).tolist()
    [[0.0, 1.0], [1.0, 2.0]]
    """
    require_function(name, function, "of time")
    return Sampled(function, name, shape)(require_finite("times", times, (None,)))


class Sampled:
    """As :func:`sample`, of a function that is asked again and again, at times known to be good.

    Between the same first and last time it is seen once whether it takes arrays.

    Parameters
    ----------
    function, name, shape
        As there.
    """

    def __init__(self, function: Callable[[Any], Any], name: str,
                 shape: tuple[int, ...] | None = None) -> None:
        self._function, self._name, self._shape = function, name, shape
        self._seen: Any = None

    def __call__(self, times: Array) -> Array:
        n, function = len(times), self._function
        values = _at_once(function, times) if n > FEW else None
        if values is not None and np.logical_and.reduce(np.isfinite(values), None):
            seen = n, times[0], times[-1], values.shape
            if seen == self._seen:
                return values
            some = [0, n // 2, n - 1]
            alone = self._one_by_one(times.take(some))
            if values.shape == (n,) + alone.shape[1:] and _are_close(values.take(some, 0), alone):
                self._seen = seen
                return values
        return self._one_by_one(times)

    def _one_by_one(self, times: Array) -> Array:
        what, function, shape = self._name + "(t={:g})", self._function, self._shape
        if shape == ():
            return np.array([ask_number(what, function, t) for t in times])
        return np.array([ask_array(what, shape, function, t) for t in times])


def _are_close(found: Array, alone: Array) -> bool:
    """True if a few numbers are the same to round-off."""
    numbers = alone.ravel().tolist()
    size = 1e-15 * max(map(abs, numbers), default=0.0)
    for x, y in zip(found.ravel().tolist(), numbers):
        if not abs(x - y) <= 1e-13 * abs(y) + size:
            return False
    return True


def _at_once(function: Callable[[Any], Any], times: Array) -> Array | None:
    try:
        values = np.asarray(function(times), dtype=float)
        return values if values.ndim == 1 else np.moveaxis(values, -1, 0)
    except Exception:  # whatever it is, the function is not made for arrays
        return None
