"""Sampling of functions of time: load amplitudes, motions of supports and joints. Rates are those
of a polynomial through samples within one step. Samples outside of the step are not used, so that a
kink at the end of a step does not spoil the rates of its neighbours."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander

from ..core import Array, array_cache, read_only, sample
from ..equations.system import System

#: Sample points in a step for the rates.
SAMPLES = np.linspace(0.0, 1.0, 5)
#: Number of intervals of the whole motion at which functions of time are sampled in advance.
AHEAD = 4096
#: Largest deviation from a parabola within one step, relative to the range of the function.
HIDDEN = 0.1


class TimeValues(NamedTuple):
    """Prescribed functions at p instants of n steps; axes of constants have length 1."""

    times: Array  # (n, p)
    factors: Array  # load factors, (n, p, l)
    supports: Array  # displacement, velocity, acceleration of fixed DOFs, else 0, (n, p, 3, N)
    c: Array  # joint terms that depend on time, and their two rates, (n, p, 3, m)
    g: Array  # the same of the joints' derivatives, (n, p, 3, k)


@array_cache(maxsize=8)
def rate_weights(at: Array, samples: Array) -> Array:
    """Weights (2, p, k) of k samples for the first and second derivative at p points."""
    k = len(samples)
    fit = np.linalg.inv(chebvander(2.0 * samples - 1.0, k - 1))
    return read_only(np.array([
        2.0**order * chebval(2.0 * at - 1.0, chebder(np.eye(k), order)).T @ fit
        for order in (1, 2)]))


def rates(function: Callable[[Array], Array], t: float, dt: float, ahead: bool,
          limit: float) -> Array:
    """First and second rate, (2, k), of a function of time at the start or the end t of a step."""
    # If ``ahead``, the step begins at t, else it ends there; no sample lies beyond ``limit``.
    values = function(np.minimum((t if ahead else t - dt) + dt * SAMPLES, limit))
    first, second = rate_weights(np.array([0.0 if ahead else 1.0]), SAMPLES)[:, 0]
    return np.array([first / dt @ values, second / dt**2 @ values])


class TimeFunctions:
    """Samples the functions of time of a system in steps of one size. ``at`` (p,) are the instants
    for values and rates, as fractions of a step; ``samples`` (k,) are the sample points for the
    rates."""

    def __init__(self, system: System, at: Array, samples: Array) -> None:
        self._system, self._at, self._samples = system, np.array(at), np.array(samples)
        self._block: tuple[tuple[float, ...], TimeValues] | None = None

    def of(self, start: float, dt: float, steps: tuple[int, int], limit: float,
           block: tuple[int, int] | None = None) -> TimeValues:
        """Values and rates in the steps ``range(*steps)``; step 0 begins at ``start``."""
        # A whole ``block`` of steps is sampled in one call, so that the result does not depend on
        # ``steps``. No sample lies beyond the time ``limit``.
        first, last = block = block or steps
        key = start, dt, first, last, limit
        if self._block is None or self._block[0] != key:
            self._block = key, self._sampled(*key)
        part = slice(steps[0] - first, steps[1] - first)
        return TimeValues(*(x if len(x) == 1 else x[part] for x in self._block[1]))

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
                rate_weights(self._at, self._samples), 1))], axis=2)

        supports = np.zeros((*times.shape, 3, s.N) if s.constraints.moves else (1, 1, 3, s.N))
        if s.constraints.moves:
            supports[..., s.constraints.fixed] = moving(s.constraints.values_at)
        c, g = tables.still
        c, g = c[:, None], g[:, None]
        if tables.motion_varies and not tables.plain.joints.custom:
            found = moving(tables.driven)
            c = np.ascontiguousarray(found[..., :s.constraints.m])
            if tables.turns:
                g = np.ascontiguousarray(found[..., s.constraints.m:])
        factors = tables.factors(times.ravel())
        factors = factors.reshape(n, len(self._at), -1) if len(factors) > 1 else factors[None]
        return TimeValues(times, factors, supports, c, g)


class Lookahead:
    """Samples of all functions of time over the whole motion, so that no step misses an event."""

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
        """Reduce a step size until every function of time is almost a parabola within the step."""
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
