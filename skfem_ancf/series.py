"""Local functions of an element in products of Chebyshev polynomials: their values at any points
follow from a table by products of matrices.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from .frozen import read_only
from .kept import cached_property

if TYPE_CHECKING:
    from collections.abc import Callable

    from .elements.base import ElementBeam
    from .types import Array


def chebyshev(x: Any, n: int) -> Array:
    """The polynomials T_0 ... T_(n-1) of 2 x - 1.

    Parameters
    ----------
    x
        A number, or an array of shape (k,), on [0, 1].
    n
        How many.

    Returns
    -------
    ndarray
        Shape (n,), or (n, k).

    Examples
    --------
    >>> chebyshev(0.75, 3).tolist()
    [1.0, 0.5, -0.5]
    """
    return np.array(polynomials(x, n))


def polynomials(x: Any, n: int) -> list[Any]:
    """As :func:`chebyshev`, as a list: of numbers for a number.

    Parameters
    ----------
    x
        A number, or an array of any shape, on [0, 1].
    n
        How many.

    Examples
    --------
    >>> polynomials(0.75, 3)
    [1.0, 0.5, -0.5]
    """
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
def _matrices(n):
    """From values at :func:`places` to coefficients, and from these to those of the slope."""
    slope = np.zeros((n, n))
    slope[:-1] = 2.0 * chebder(np.eye(n))
    return np.linalg.inv(chebvander(2.0 * places(n) - 1.0, n - 1)), slope


def transform(n: int) -> Array:
    """From values at :func:`places` to coefficients of Chebyshev polynomials, shape (n, n)."""
    return _matrices(n)[0]


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

    Examples
    --------
    >>> coefficients(lambda X: np.array([X[0] * X[1]]), 2, 2).round(12).tolist()
    [[[0.25, 0.25], [0.25, 0.25]]]
    """
    X = np.array([np.repeat(places(p), m), np.tile(places(m), p)])
    values = function(X).reshape(-1, p, m)
    return np.ascontiguousarray((_matrices(p)[0] @ values @ _matrices(m)[0].T).swapaxes(-1, -2))


def along(function: Callable[[Array], Array], n: int) -> Array:
    """Polynomials of xi as sums of Chebyshev polynomials.

    Parameters
    ----------
    function
        From places xi (n,) to the values of k polynomials, (k, n).
    n
        How many Chebyshev polynomials they need.

    Returns
    -------
    ndarray
        Coefficients, shape (k, n).

    Examples
    --------
    >>> along(lambda xi: np.array([xi, 1.0 + 0.0 * xi]), 2).round(12).tolist()
    [[0.5, 0.5], [1.0, 0.0]]
    """
    return function(places(n)) @ _matrices(n)[0].T


def products(table: Array, xi: float, eta: float) -> Array:
    """Sums of products of Chebyshev polynomials at one point, shape (...).

    Parameters
    ----------
    table
        Their coefficients, shape (..., across, along).
    xi, eta
        The reference point.
    """
    m, p = table.shape[-2:]
    return table.dot(np.array(polynomials(xi, p))).dot(np.array(polynomials(eta, m)))


def along_slopes(table: Array) -> Array:
    """The table of the derivatives by xi of what a table has, shape (..., across, along) both."""
    return table @ _matrices(table.shape[-1])[1].T


class Series:
    """The local functions of an element of length 1 as ``sum c_ij T_i(2 xi - 1) T_j(2 eta - 1)``.

    Parameters
    ----------
    element
        A beam element.
    h
        Height of the section.

    Attributes
    ----------
    value, along, across
        Coefficients c of the functions and of their derivatives by xi and by eta, shape
        (nb, p, m) each.
    tables
        The first two of them, (2, nb, p, m).
    power, swell
        The powers of the length, and of the height, that each takes, (nb,).
    """

    def __init__(self, element: ElementBeam, h: float) -> None:
        unit, self.swell, self.power = element.series()
        self._value = h ** self.swell[:, None, None] * unit if self.swell.any() else unit
        self._shape = unit.shape[:0:-1]

    @cached_property
    def value(self) -> Array:
        return np.ascontiguousarray(self._value.swapaxes(-1, -2))

    @cached_property
    def along(self) -> Array:
        return _matrices(self._shape[0])[1] @ self.value

    @cached_property
    def across(self) -> Array:
        return self.value @ _matrices(self._shape[1])[1].T

    @cached_property
    def tables(self) -> Array:
        return np.stack([self.value, self.along])

    def at(self, xi: float, eta: float) -> Array:
        """The functions at one point, shape (nb,).

        Parameters
        ----------
        xi, eta
            The reference point.
        """
        return products(self._value, xi, eta)

    def in_element(self, scales: Array, heights: Callable[[Array], Any] | None) -> Array:
        """A table of the functions of one element, of which :func:`products` are the values.

        Parameters
        ----------
        scales
            Of the functions, see :meth:`scales`, (nb,).
        heights
            From places xi (n,) to its height over that of the functions, cubic, and the derivative
            of this; None where it is constant.

        Returns
        -------
        ndarray
            Shape (nb, across, along).
        """
        table = scales[:, None, None] * self._value
        if heights is None or not self.swell.any():
            return table
        n = self._shape[0] + 3 * int(self.swell.max())
        g = self.swollen(heights(places(n))[0])
        return table @ chebyshev(places(n), self._shape[0]) * g[:, None] @ transform(n).T

    def values(self, table: Array, X: Array) -> Array:
        """The values at many points, shape (nb, n).

        Parameters
        ----------
        table
            One of the attributes, shape (nb, p, m).
        X
            Reference points, shape (2, n).
        """
        _, p, m = table.shape
        both = chebyshev(X[0], p)[:, None] * chebyshev(X[1], m)
        return table.reshape(-1, p * m) @ both.reshape(p * m, -1)

    def scales(self, lengths: Array) -> Array:
        """The powers of the lengths (ne,) of elements that the functions take, (ne, nb)."""
        return lengths[:, None] ** self.power

    def swollen(self, g: Any) -> Array:
        """What functions of a height that varies are times those of one: ``h^m P(Y / h)``.

        Parameters
        ----------
        g
            The height over that of the functions: a number, or an array (...) of places.

        Returns
        -------
        ndarray
            Shape (nb, ...).
        """
        return g ** self._power_of_height(g)

    def swelling(self, g: Any, rate: Any) -> Array:
        """The derivative by xi of :meth:`swollen`, over it, shape (nb, ...).

        Parameters
        ----------
        g, rate
            As there, and its derivative by xi: numbers, or arrays (...).
        """
        return self._power_of_height(g) * (rate / g)

    def _power_of_height(self, g):
        return self.swell if type(g) is float else self.swell.reshape((-1,) + (1,) * np.ndim(g))
