"""Functions of time at many times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ask_array, ask_number, require_finite, require_function, taught

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from .types import Array

FEW = 8  # times up to which a function is asked one by one


@taught
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
    return sampled(function, require_finite("times", times, (None,)), name, shape)


def sampled(function: Callable[[Any], Any], times: Array, name: str,
            shape: tuple[int, ...] | None = None) -> Array:
    """As :func:`sample`, of a function and of times that are known to be good.

    Parameters
    ----------
    function, name, shape
        As there.
    times
        Shape (n,).
    """
    n = len(times)
    values = _at_once(function, times) if n > FEW else None
    if values is not None:
        some = [0, n // 2, n - 1]
        alone = _one_by_one(function, times.take(some), name, shape)
        if (values.shape == (n,) + alone.shape[1:] and _are_close(values.take(some, 0), alone)
                and np.logical_and.reduce(np.isfinite(values), None)):
            return values
    return _one_by_one(function, times, name, shape)


def _are_close(found: Array, alone: Array) -> bool:
    """True if a few numbers are the same to round-off."""
    numbers = alone.ravel().tolist()
    size = 1e-15 * max(map(abs, numbers), default=0.0)
    for x, y in zip(found.ravel().tolist(), numbers):
        if not abs(x - y) <= 1e-13 * abs(y) + size:
            return False
    return True


def _one_by_one(function: Callable[[Any], Any], times: Array, name: str,
                shape: tuple[int, ...] | None) -> Array:
    what = name + "(t={:g})"
    if shape == ():
        return np.array([ask_number(what, function, t) for t in times])
    return np.array([ask_array(what, shape, function, t) for t in times])


def _at_once(function: Callable[[Any], Any], times: Array) -> Array | None:
    try:
        values = np.asarray(function(times), dtype=float)
        return values if values.ndim == 1 else np.moveaxis(values, -1, 0)
    except Exception:  # whatever it is, the function is not made for arrays
        return None
