"""Rates of motions that are given as functions of time, by fourth-order differences."""

import numpy as np


def central(f, h):
    """First and second derivative in the middle of five values (5, ...) at distance h."""
    return ((f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * h),
            (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12 * h**2))


def one_sided(f, h):
    """First and second derivative at the first of six values (6, ...) at distance h."""
    return (np.tensordot([-137, 300, -300, 200, -75, 12], f, 1) / (60 * h),
            np.tensordot([45, -154, 214, -156, 61, -10], f, 1) / (12 * h**2))


def rates(function, t, dt, span):
    """First and second derivative at one time, of a function of an array of times.

    Within ``span`` (start, end) only: the function is not asked for other times.
    """
    start, end = span
    h = min(0.5 * dt, 0.2 * (end - start))
    if t - 2 * h >= start and t + 2 * h <= end:
        return central(function(t + h * np.arange(-2, 3)), h)
    h = min(0.25 * dt, 0.2 * (end - start))
    h = h if t - 2 * h < start else -h
    return one_sided(function(t + h * np.arange(6)), h)


def step_rates(function, t, dt, n, span):
    """Values and rates at the ends of n steps from t.

    Returns
    -------
    middle, value, first, second
        Arrays (n, ...): the function in the middle and at the end of each step, and its rates.
    """
    last = t + n * dt
    inside = last + dt <= span[1] and t >= span[0]
    f = function(t + 0.5 * dt * np.arange(2 * n + (3 if inside else 1)))
    m = n if inside else n - 1  # central differences at the first m ends
    first, second = central([f[k:k + 2 * m:2] for k in range(5)], 0.5 * dt)
    if not inside:
        end = rates(function, last, dt, span)
        first, second = (np.concatenate([x, y[None]]) for x, y in zip((first, second), end))
    return f[1:2 * n:2], f[2:2 * n + 1:2], first, second
