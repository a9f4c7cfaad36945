"""Local functions of an element in products of Chebyshev polynomials: their values at any points
follow from a table by products of matrices.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from ..core.frozen import read_only
from ..core.kept import cached_property

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..core.types import Array


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
def _matrices(n: int) -> tuple[Array, Array]:
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


def derivatives(c: Array) -> Array:
    """The derivatives by xi and by eta of polynomials.

    Parameters
    ----------
    c
        Coefficients, shape (along, across, ...).

    Returns
    -------
    ndarray
        Theirs, (2, along, across, ...).
    """
    p, m = c.shape[:2]
    along = _matrices(p)[1] @ c.reshape(p, -1)
    return np.array([along, (_matrices(m)[1] @ c.reshape(p, m, -1)).reshape(p, -1)]).reshape(
        2, *c.shape)


class Series:
    """The local functions of an element of length 1 as ``sum c_ij T_i(2 xi - 1) T_j(2 eta - 1)``.

    Parameters
    ----------
    element
        A beam element.
    h
        Height of the section, the largest.
    degree
        That of the heights of an element as a polynomial of xi.

    Attributes
    ----------
    value, along
        Coefficients c of the functions and of their derivatives by xi, shape (nb, p, m) each.
    tables
        Both of them, (2, nb, p, m).
    power, swell
        The powers of the length, and of the height, that each takes, (nb,).
    shape
        How many polynomials of xi and of eta the functions of an element are, its height included.
    """

    def __init__(self, element: Any, h: float, degree: int = 0) -> None:
        unit, self.swell, self.power = element.series()
        self._value = h ** self.swell[:, None, None] * unit if self.swell.any() else unit
        self._shape = unit.shape[:0:-1]
        self.shape = self._shape[0] + degree * int(self.swell.max()), self._shape[1]

    @cached_property
    def value(self) -> Array:
        return np.ascontiguousarray(self._value.swapaxes(-1, -2))

    @cached_property
    def along(self) -> Array:
        return _matrices(self._shape[0])[1] @ self.value

    @cached_property
    def tables(self) -> Array:
        return np.stack([self.value, self.along])

    def in_elements(self, q: Array, heights: Callable[[Array], Any] | None) -> Array:
        """Sums of the functions of elements of length 1: polynomials, as :func:`chebyshev` says.

        Parameters
        ----------
        q
            Factors, shape (nb, k, n) of n elements.
        heights
            From places xi (p, 1) along the elements to their heights (p, n) over that of the
            functions, and the derivatives of these; None where it is constant.

        Returns
        -------
        ndarray
            Shape (along, across, k, n), as :attr:`shape`.
        """
        if heights is None:
            found = self.value.reshape(len(q), -1).T @ q.reshape(len(q), -1)
        else:
            n = self.shape[0]
            swollen = self.swollen(heights(places(n)[:, None])[0]).swapaxes(0, 1)
            moved = (swollen[:, :, None] * q).reshape(n, len(q), -1)
            found = transform(n) @ (self._at_places @ moved).reshape(n, -1)
        return found.reshape(*self.shape, *q.shape[1:])

    @cached_property
    def _at_places(self) -> Array:
        """The functions at as many places along an element as it has polynomials, (n, m, nb)."""
        n, p = self.shape[0], self._shape[0]
        return (chebyshev(places(n), p).T @ self.value).transpose(1, 2, 0)

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
            The height over that of the functions, shape (...).

        Returns
        -------
        ndarray
            Shape (nb, ...).
        """
        return g ** self.swell.reshape((-1,) + (1,) * np.ndim(g))
