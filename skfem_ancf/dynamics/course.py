"""Functions of time: amplitudes of loads, motions of supports and joints, sampled step by step.

Their rates are those of a polynomial through samples within one step. No value from outside of the
step is used: neither do rates at the end of a motion differ from those of a motion that goes on,
nor does a kink at the end of a step spoil those of the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander

from ..core.sampling import sample
from ..core.types import Array
from ..equations.system import System

#: Samples of a step from which rates are made.
SAMPLES = np.linspace(0.0, 1.0, 5)
#: Intervals of a whole motion at whose ends functions of time are sampled ahead.
AHEAD = 4096
#: Part of a function's range by which it may leave a parabola within one step.
HIDDEN = 0.1


class Given(NamedTuple):
    """What is given at p instants of n steps; arrays of one row where nothing varies.

    Attributes
    ----------
    times
        Shape (n, p).
    factors
        Of the loads, shape (n, p, l) or (1, 1, l).
    supports
        Displacement of the degrees of freedom that are fixed, zero elsewhere, and its two rates,
        shape (n, p, 3, N) or (1, 1, 3, N).
    c, g
        What the joints' equations have of time, and what their derivatives have, with both rates,
        shapes (n, p, 3, m) and (n, p, 3, k), or (1, 1, ...).
    """

    times: Array
    factors: Array
    supports: Array
    c: Array
    g: Array

    def rows(self, part: slice) -> Given:
        """The same of some of the steps."""
        return Given(*(x if len(x) == 1 else x[part] for x in self))


def rate_weights(at: Array, samples: Array) -> Array:
    """What makes first and second derivatives at p places of values at k others, (2, p, k)."""
    k = len(samples)
    fit = np.linalg.inv(chebvander(2.0 * samples - 1.0, k - 1))
    return np.array([2.0**order * chebval(2.0 * at - 1.0, chebder(np.eye(k), order)).T @ fit
                     for order in (1, 2)])


def rates(function: Callable[[Array], Array], t: float, dt: float, ahead: bool,
          limit: float) -> Array:
    """First and second rate, (2, k), of a function of times (n,) at the start or end t of a step.
    """
    values = function(np.minimum((t if ahead else t - dt) + dt * SAMPLES, limit))
    first, second = rate_weights(np.array([0.0 if ahead else 1.0]), SAMPLES)[:, 0]
    return np.array([first / dt @ values, second / dt**2 @ values])


class Course:
    """Samples the functions of time of a system in steps of one size.

    ``at`` (p,) are the instants, as parts of a step, at which values and rates are wanted;
    ``samples`` (k,) those of which the rates are made.
    """

    def __init__(self, system: System, at: Array, samples: Array) -> None:
        self._system, self._at, self._samples = system, np.array(at), np.array(samples)
        self._rates = rate_weights(self._at, self._samples)
        self._block: tuple[tuple[float, ...], Given] | None = None

    def of(self, start: float, dt: float, steps: tuple[int, int], limit: float,
           block: tuple[int, int] | None = None) -> Given:
        """What is given in the steps ``range(*steps)``, of which the first of all is at ``start``.

        Functions are asked at once in a block of steps, so that what they return does not depend on
        ``steps``, and not beyond the time ``limit``.
        """
        first, last = block = block or steps
        key = start, dt, first, last, limit
        if self._block is None or self._block[0] != key:
            self._block = key, self._sampled(*key)
        return self._block[1].rows(slice(steps[0] - first, steps[1] - first))

    def _sampled(self, start, dt, first, last, limit):
        s, tables, n = self._system, self._system.backend.tables, last - first
        begin = np.arange(first, last)[:, None]

        def at(parts):
            return np.minimum(start + dt * (begin + parts), limit)

        times = at(self._at)
        instants = np.concatenate([times.ravel(), at(self._samples).ravel()])

        def moving(function: Callable[[Array], Array]) -> Array:
            """Values at the instants and both rates, shape (n, p, 3, k)."""
            found = function(instants)
            samples = found[times.size:].reshape(n, len(self._samples), -1)
            values = found[:times.size].reshape(*times.shape, -1)
            return np.stack([values, *(rates / dt**k @ samples for k, rates in enumerate(
                self._rates, 1))], axis=2)

        supports = np.zeros((*times.shape, 3, s.N) if s.constraints.moves else (1, 1, 3, s.N))
        if s.constraints.moves:
            supports[..., s.constraints.fixed] = moving(s.constraints.values_at)
        c, g = tables.still
        c, g = c[:, None], g[:, None, 1:]
        if tables.motion_varies and not tables.plain.joints.own:
            found = moving(tables.driven)
            c = found[..., :s.constraints.m]
            if tables.turns:
                g = found[..., s.constraints.m:]
        factors = tables.factors(times.ravel())
        factors = factors.reshape(n, len(self._at), -1) if len(factors) > 1 else factors[None]
        return Given(times, factors, supports, c, g)


class Lookahead:
    """Functions of time of a whole motion, so that no step passes over an event."""

    def __init__(self, system: System, t_start: float, t_end: float) -> None:
        self._times = np.linspace(t_start, t_end, AHEAD + 1)
        columns = [sample(load.amplitude, self._times).reshape(-1, 1) for load in system.loads
                   if load.amplitude is not None]
        columns += [joint.moved(self._times, system.N) for joint in system.constraints.all_joints
                    if joint.moving]
        values = np.hstack([np.zeros((AHEAD + 1, 0)), *columns])
        values = values[:, np.all(np.isfinite(values), axis=0)]
        size = np.ptp(values, axis=0)
        varies = size > 1e-12 * np.abs(values).max(axis=0, initial=0.0)
        self._values = values[:, varies] / size[varies]

    def cut(self, t: float, dt: float) -> float:
        """A step size, at most dt, in which no function of time does what is not seen.

        It is not seen if it is no parabola within the step: a blow that begins and ends there.
        """
        while self._values.shape[1]:
            i, j = np.searchsorted(self._times, (t, t + dt))
            if j - i < 3:
                break
            at = np.array([np.interp((t, t + 0.5 * dt, t + dt), self._times, column)
                           for column in self._values.T]).T
            x = ((self._times[i:j] - t) / dt)[:, None]
            parabola = (at[0] * (1 - x) * (1 - 2 * x) + at[1] * 4 * x * (1 - x)
                        + at[2] * x * (2 * x - 1))
            if np.all(np.abs(self._values[i:j] - parabola) <= HIDDEN):
                break
            dt *= 0.5
        return dt
