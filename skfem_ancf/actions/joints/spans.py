"""Discrete gradients of the equations of a sleeve between two displacements.

At fixed s the equations are products of two vectors that are affine in the degrees of freedom,
``f(u, s) = x(u, s) . y(u, s)`` or ``x x y``, and s is the zero of one of them, G. From (u_0, s_0)
to (u_1, s_1) such a product changes by ::

    f_1 - f_0 = f_u . (u_1 - u_0) + f_s (s_1 - s_0)
    f_u = (f_u(u_m, s_0) + f_u(u_m, s_1)) / 2,   u_m = (u_0 + u_1) / 2
    f_s = (f[u_0; s_0, s_1] + f[u_1; s_0, s_1]) / 2,   f[u; s_0, s_1] a divided difference

exactly, also across element boundaries. With ``0 = G_1 - G_0`` the row
``D = f_u - (f_s / G_s) G_u`` satisfies ``D . (u_1 - u_0) = f_1 - f_0``: a discrete gradient
(Gonzalez: "Time integration and discrete Hamiltonian systems", Journal of Nonlinear Science 6,
1996). Products and divided differences are invariant under rigid motions of the scene, so D
conserves both momenta.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...core.types import Array

#: Least ``way``, in elements, by which is divided.
TINY = 1e-9


def _mean(pair: Any) -> Array:
    return 0.5 * (pair[0] + pair[1])


class Family(NamedTuple):
    """A vector, affine in the DOFs, at both parameters, and its divided difference.

    ``rows`` are derivatives by the DOFs at both parameters, (2, 2, n), ``values`` those at
    parameter k and displacement j, (2, 2, 2), ``quotient`` the derivative of the divided
    difference, (2, n), and ``slopes`` the divided difference at both displacements, (2, 2).
    """

    rows: Array
    values: Array
    quotient: Array
    slopes: Array

    def turned(self, Q: Array) -> Family:
        """The family of Q times the vector, Q of shape (2, 2)."""
        return Family(Q @ self.rows, self.values @ Q.T, Q @ self.quotient, self.slopes @ Q.T)

    def minus(self, other: Family) -> Family:
        """The difference of two families."""
        return Family(*(a - b for a, b in zip(self, other)))


class Product:
    """A product of two families between two displacements; ``times`` is that of two vectors."""

    def __init__(self, times: Callable[[Array, Array], Array], x: Family, y: Family) -> None:
        self._times, self._x, self._y = times, x, y
        self._passing = [_mean(f.values) for f in (x, y)]  # means over s, at each displacement
        (a, b), d, e = self._passing, x.slopes, y.slopes
        #: f_s
        self.quotient = 0.5 * sum(float(times(a[j], e[j]) + times(d[j], b[j])) for j in range(2))
        #: f_u
        self.row = _mean([self._row(_mean(x.values[k]), _mean(y.values[k]), k) for k in range(2)])

    def _row(self, x: Array, y: Array, k: int) -> Array:
        return self._times(x, self._y.rows[k]) + self._times(self._x.rows[k], y)

    def rate(self, j: int, v: Array) -> float:
        """f_u(u_j, s_j) . v."""
        x, y = self._x, self._y
        return float(self._row(x.values[j, j], y.values[j, j], j) @ v)

    def second(self, v: Array) -> Array:
        """Mean over s of the second derivative by u, times v (n,)."""
        return _mean([self._row(self._x.rows[k] @ v, self._y.rows[k] @ v, k) for k in range(2)])

    def mixed(self) -> Array:
        """The derivative of f_s by u at u_m."""
        x, y, times = self._x, self._y, self._times
        a, b = map(_mean, self._passing)
        return (times(a, y.quotient) + times(_mean(x.rows), _mean(y.slopes))
                + times(x.quotient, b) + times(_mean(x.slopes), _mean(y.rows)))


class Span(NamedTuple):
    """The equations of a sleeve between two displacements.

    ``columns`` are numbers of DOFs, ``change`` is ``u_1 - u_0`` of these, (n,), ``way`` is
    ``s_1 - s_0`` in elements, ``place`` the Product G, zero at both ends, ``equations`` the other
    products, and ``shares`` ``f_s / G_s`` of each at both ends, (m, 2).
    """

    columns: Array
    change: Array
    way: float
    place: Product
    equations: list[Product]
    shares: Array

    def rows(self) -> Array:
        """D of each equation, shape (m, n)."""
        return np.array([f.row - f.quotient / self.place.quotient * self.place.row
                         for f in self.equations])

    def force(self, multipliers: Array, v0: Array, v1: Array) -> Array:
        """X with ``X . (u_1 - u_0) = multipliers . D (v_1 - v_0) / 2``.

        Both velocities satisfy the constraint. For quadratic Phi, X is ``-(multipliers . Phi'')
        (v_0 + v_1) / 4``. The part linear in ``u_1 - u_0`` is written as such; the rest has the
        factor ``s_1 - s_0``, which is ``-G_u . (u_1 - u_0) / G_s``.
        """
        place, v = self.place, v0 + v1
        passing = [place.rate(0, v0), place.rate(1, v1)]
        out, work, rows = np.zeros(len(v)), 0.0, self.rows()
        for f, share, multiplier, D in zip(self.equations, self.shares, multipliers, rows):
            mean = f.quotient / place.quotient
            row = -0.5 * (f.second(v) - mean * place.second(v))
            row += 0.5 / place.quotient * (sum(passing) * f.mixed()
                                           - (share @ passing) * place.mixed())
            out += 0.5 * multiplier * row
            work += 0.5 * multiplier * float(D @ (v1 - v0) - row @ self.change)
        if abs(self.way) > TINY:
            out += work / float(place.row @ self.change) * place.row
        return out
