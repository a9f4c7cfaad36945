"""Rates of motions that are given as functions of time, by differences within one step.

No value from outside of a step is used: neither do the rates at the end of a motion differ from
those of a motion that goes on, nor does a kink at the end of a step spoil those of the next.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..types import Array

#: Intervals into which a step is divided.
PARTS = 4
_FIRST = np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0
_SECOND = np.array([35.0, -104.0, 114.0, -56.0, 11.0]) / 12.0


def rates(function: Callable[[Array], Array], t: float, dt: float, ahead: bool = False,
          limit: float = np.inf) -> tuple[Array, Array]:
    """First and second derivative at one time, of a function of an array of times.

    Parameters
    ----------
    function
        Takes times (n,), returns (n, ...).
    t, dt
        End and size of the step; its start with ``ahead``.
    ahead
        The rates at the start of the step, not at its end.
    limit
        Time beyond which the function is not asked.

    Returns
    -------
    first, second
        Shapes (...).
    """
    h = dt / PARTS if ahead else -dt / PARTS
    f = function(np.minimum(t + h * np.arange(PARTS + 1), limit))
    return np.tensordot(_FIRST, f, 1) / -h, np.tensordot(_SECOND, f, 1) / h**2


def step_rates(function: Callable[[Array], Array], times: Array,
               dt: float) -> tuple[Array, Array, Array, Array]:
    """Values and rates at the ends of steps.

    Parameters
    ----------
    function
        Takes times (n,), returns (n, ...).
    times
        The times at which the function is asked, ``PARTS`` in each step, shape (4 n + 1,).
    dt
        Size of a step.

    Returns
    -------
    middle, value, first, second
        Arrays (n, ...): the function in the middle and at the end of each step, and its rates.
    """
    f, h = function(times), dt / PARTS
    n = len(f) - 1
    back = [f[PARTS - k:n + 1 - k:PARTS] for k in range(PARTS + 1)]
    return (f[PARTS // 2::PARTS], back[0], np.tensordot(_FIRST, back, 1) / h,
            np.tensordot(_SECOND, back, 1) / h**2)
