"""Polynomials on [0, 1] as sums of Chebyshev polynomials."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from ..core.immutable import read_only

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..core.types import Array


def chebyshev(x: Any, n: int) -> Array:
    """The polynomials T_0 ... T_(n-1) of 2 x - 1 at a number or an array (k,): (n,) or (n, k)."""
    return np.array(polynomials(x, n))


def polynomials(x: Any, n: int) -> list[Any]:
    """As :func:`chebyshev`, as a list; x of any shape."""
    z = 2.0 * x - 1.0
    before, last, twice = 1.0 + 0.0 * z, z, 2.0 * z
    out = [before, last]
    for _ in range(n - 2):
        before, last = last, twice * last - before
        out.append(last)
    return out[:n]


@lru_cache(64)
def places(n: int) -> Array:
    """The zeros of the polynomial T_n of 2 x - 1, shape (n,)."""
    return read_only(0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n))


@lru_cache(64)
def transform(n: int) -> Array:
    """From values at :func:`places` to coefficients of Chebyshev polynomials, shape (n, n)."""
    return read_only(np.linalg.inv(chebvander(2.0 * places(n) - 1.0, n - 1)))


def coefficients(function: Callable[[Array], Array], p: int, m: int) -> Array:
    """Polynomials of (xi, eta) as sums of products of Chebyshev polynomials.

    Parameters
    ----------
    function
        From reference points (2, p m) to the values of k polynomials, (k, p m).
    p, m
        How many Chebyshev polynomials of xi and of eta they need.

    Returns
    -------
    ndarray
        Those of eta come first, shape (k, m, p).
    """
    X = np.array([np.repeat(places(p), m), np.tile(places(m), p)])
    values = function(X).reshape(-1, p, m)
    return np.ascontiguousarray((transform(p) @ values @ transform(m).T).swapaxes(-1, -2))
