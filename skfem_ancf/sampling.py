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
    times = require_finite("times", times, (None,))
    what, n = name + "(t={:g})", len(times)

    def one_by_one(times: Array) -> Array:
        if shape == ():
            return np.array([ask_number(what, function, t) for t in times])
        return np.array([ask_array(what, shape, function, t) for t in times])

    if n > FEW:
        values = _at_once(function, times)
        if values is not None:
            some = [0, n // 2, n - 1]
            alone = one_by_one(times[some])
            size = np.abs(alone)
            if (values.shape == (n,) + alone.shape[1:] and np.isfinite(values).all()
                    and (np.abs(values[some] - alone) <= 1e-13 * size + 1e-15 * size.max()).all()):
                return values
    return one_by_one(times)


def _at_once(function: Callable[[Any], Any], times: Array) -> Array | None:
    try:
        return np.moveaxis(np.asarray(function(times), dtype=float), -1, 0)
    except Exception:  # whatever it is, the function is not made for arrays
        return None
