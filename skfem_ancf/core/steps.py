"""Named steps of a quasi-static run."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .errors import (InputError, NameUnknown, require_finite, require_increasing, require_positive,
                     shown)
from .immutable import Immutable
from .types import Array


class Ramp(Immutable):
    """A piecewise linear function of time, constant outside of its times.

    Parameters
    ----------
    times
        Increasing times, shape (n,).
    values
        Numbers, shape (n,), or vectors, (n, k).

    Examples
    --------
    >>> Ramp([0, 1, 3], [0, 10, 0])(2.0)
    5.0
    """

    def __init__(self, times: ArrayLike, values: ArrayLike) -> None:
        self.times = require_increasing("times of a Ramp", times)
        self.values = require_finite("values", values)
        if self.values.ndim not in (1, 2) or len(self.values) != len(self.times):
            raise InputError(f"a Ramp with {len(self.times)} times has as many numbers or vectors, "
                             f"got values of shape {self.values.shape}")

    def __call__(self, t: Any) -> Any:
        """The value at a time: a number, or (k,); for times (n,) shape (n,) or (k, n)."""
        if self.values.ndim == 1:
            found = np.interp(t, self.times, self.values)
            return found if np.ndim(t) else float(found)
        return np.array([np.interp(t, self.times, one) for one in self.values.T])


class Steps(Immutable):
    """Consecutive steps of a quasi-static run, with names and durations.

    :meth:`ramp` makes functions of time from values at the ends of steps, for the ``amplitude`` of
    loads and temperatures, ``position`` and ``angle`` of obstacles, displacements of supports and
    angles of motors.

    Parameters
    ----------
    *unnamed
        Refused, with a message that says how to write it.
    **durations
        Positive duration of each step by name.

    Attributes
    ----------
    names : tuple of str
    ends : ndarray
        Final time of each step, shape (n,).

    Examples
    --------
    >>> steps = Steps(press=1.0, hold=0.5, release=1.0)
    >>> steps.ends.tolist()
    [1.0, 1.5, 2.5]
    >>> force = steps.ramp(press=20.0, release=0.0)
    >>> [force(t) for t in (0.5, 1.0, 1.2, 2.0)]
    [10.0, 20.0, 20.0, 10.0]
    """

    def __init__(self, *unnamed: Any, **durations: float) -> None:
        if unnamed or not durations:
            raise InputError("give durations by name, as Steps(press=1.0, release=1.0) or "
                             f"Steps(**{{'press': 1.0}}), got Steps{shown(unnamed)}")
        self.names = tuple(durations)
        with np.errstate(over="ignore"):
            self.ends = require_finite("the sum of the durations", np.cumsum(
                [require_positive(name, x) for name, x in durations.items()]))

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        return "Steps(" + ", ".join(f"{name}={dt:g}" for name, dt in zip(
            self.names, np.diff(self.ends, prepend=0.0))) + ")"

    def ramp(self, start: ArrayLike | None = None, /, **values: ArrayLike) -> Ramp:
        """A function of time from values at the ends of steps, linear within each step.

        Parameters
        ----------
        start
            The value at time 0: a number or a vector, shape (k,); zero by default.
        **values
            Values at the ends of steps by name; in steps without a value it is constant.

        Raises
        ------
        NameUnknown, InputError
            If a step is unknown, or if there is no value.
        """
        for name in values:
            if name not in self.names:
                raise NameUnknown("step", name, self.names)
        if not values and start is None:
            raise InputError(f"ramp() has no values: give one at the end of a step, as ramp("
                             f"{self.names[0]}=1.0)")
        first: Any = next(iter([*values.values(), start]))
        shape = np.shape(first)
        last: Any = np.zeros(shape) if start is None else require_finite("start", start, shape)
        rows = [last]
        for name in self.names:
            rows.append(require_finite(name, values.get(name, rows[-1]), shape))
        return Ramp(np.append(0.0, self.ends), np.array(rows))

    def step_at(self, t: Array) -> Array:
        """Numbers of the steps at times, shape (n,); the end belongs to the step."""
        return np.minimum(np.searchsorted(self.ends, t - 1e-12 * self.ends[-1]), len(self) - 1)
