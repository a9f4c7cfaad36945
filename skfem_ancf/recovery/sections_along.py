"""Derivatives, integrals and smoothing along sections of one segment, factorised once."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg.lapack import dgttrf, dgttrs, dpttrf, dpttrs

from ..core.types import Array


class SectionsAlong:
    """Operators on values at n >= 3 sections of arc lengths s (n,), for values (..., n, m).

    Derivative and integral are those of the cubic spline through the values, whose third derivative
    is continuous at the second section and at the last but one (de Boor, "A Practical Guide to
    Splines", chapter 4); of the parabola through three values.
    """

    def __init__(self, s: Array, smoothing: float) -> None:
        self.d = d = np.diff(s)
        if len(d) == 2:
            low, middle, high = d[1:], np.array([1.0, 2.0 * (d[0] + d[1]), 1.0]), d[:1]
            low, high = np.append(low, 1.0), np.append(1.0, high)
        else:
            middle = np.concatenate([d[1:2], 2.0 * (d[:-1] + d[1:]), d[-2:-1]])
            low = np.append(d[1:], d[-1] + d[-2])
            high = np.append(d[0] + d[1], d[:-1])
        self._slopes = dgttrf(low, middle, high)[:-1]
        # f - smoothing^2 f'' = values, with f' = 0 at both ends
        c = smoothing**2 / d
        self._w = 0.5 * (np.append(d, 0.0) + np.append(0.0, d))
        self._smooth = dpttrf(self._w + np.append(c, 0.0) + np.append(0.0, c), -c)[:-1]

    def d_ds(self, values: Array) -> Array:
        """Axial derivative."""
        d, y = self.d[:, None], _rows(values)
        b, slope = np.empty_like(y), (y[1:] - y[:-1]) / d
        b[1:-1] = 3.0 * (d[1:] * slope[:-1] + d[:-1] * slope[1:])
        if len(d) == 2:
            b[0], b[-1] = 2.0 * slope
        else:
            for end, first, second in ((0, 0, 1), (-1, -1, -2)):
                both = d[first] + d[second]
                b[end] = ((d[first] + 2.0 * both) * d[second] * slope[first]
                          + d[first]**2 * slope[second]) / both
        return _back(dgttrs(*self._slopes, b)[0], values)

    def integral(self, values: Array) -> Array:
        """Integral from the first section, of values (..., n)."""
        slope, d = self.d_ds(values[..., None])[..., 0], self.d
        parts = 0.5 * d * (values[..., :-1] + values[..., 1:]) + d * d / 12.0 * (
            slope[..., :-1] - slope[..., 1:])
        out = np.zeros_like(values)
        np.cumsum(parts, axis=-1, out=out[..., 1:])
        return out

    def smoothed(self, values: Array) -> Array:
        """Solution f of ``f - smoothing^2 f'' = values`` with f' = 0 at both ends."""
        return _back(dpttrs(*self._smooth, self._w[:, None] * _rows(values))[0], values)


def _rows(values: Array) -> Array:
    """Values (..., n, m) as floats, one row for each section."""
    rows = np.ascontiguousarray(values.swapaxes(0, -2))
    return rows.reshape(values.shape[-2], -1).view(float)


def _back(rows: Array, like: Any) -> Array:
    """The values of :func:`_rows`."""
    shape = like.swapaxes(0, -2).shape
    return np.ascontiguousarray(rows).view(like.dtype).reshape(shape).swapaxes(0, -2)
