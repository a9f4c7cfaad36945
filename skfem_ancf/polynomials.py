"""Functions of several parameters, interpolated by polynomials that grow where they have to.

On a box, by Newton's polynomials of each parameter on the points of Leja, and products of them for
a set of indices that is closed downwards: with the index (2, 1) it has (1, 1) and (2, 0). The next
index is that behind the largest surplus: what the function at its point differs by from what the
others say, see Chkifa, Cohen, Schwab, Foundations of Computational Mathematics 14 (2014).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from .types import Array

#: Indices of a parameter, at most.
MOST = 24


@lru_cache(maxsize=1)
def leja() -> Array:
    """Points in [-1, 1], each where the product of its distances from those before is largest.

    The first is no point of symmetry, so that what is odd or even does not look like less than it
    is.
    """
    grid = np.cos(np.pi * np.arange(4001) / 4000.0)
    points = [0.31830988618379]
    product = np.abs(grid - points[0])
    while len(points) < MOST:
        points.append(float(grid[np.argmax(product)]))
        product *= np.abs(grid - points[-1])
    return np.array(points)


class Polynomial:
    """A function of a box, from its values at a few points.

    Parameters
    ----------
    function
        From parameters, shape (d,), to values, shape (k,).
    low, high
        Corners of the box, shape (d,); low is below high.
    size
        From a surplus, shape (k,), and the largest values so far, shape (k,), to how large it is: 1
        is small enough.
    most
        How often the function may be asked.

    Attributes
    ----------
    asked : int
        How often it has been.
    rest : float
        The largest surplus at the border of the indices, and of those behind which there are no
        more points: about the error, where 1 is small enough.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf.polynomials import Polynomial
    >>> p = Polynomial(lambda x: np.array([x[0] * x[1], x[1]**2]), np.zeros(2), np.ones(2),
    ...                lambda surplus, values: np.max(np.abs(surplus)) / 1e-12, most=50)
    >>> p(np.array([[0.5, 0.2]])).round(9).tolist(), p.rest < 1.0
    ([[0.1, 0.04]], True)
    """

    def __init__(self, function: Callable[[Array], Array], low: Array, high: Array,
                 size: Callable[[Array, Array], float], most: int) -> None:
        self.low, self.high, self.indices = low, high, np.zeros((1, len(low)), dtype=int)
        self.surplus = np.array([function(self._point(self.indices[0]))])
        inside, border = {tuple(self.indices[0])}, {}
        fresh, largest = tuple(self.indices[0]), np.abs(self.surplus[0])
        self.rest, left = 0.0, np.inf
        while True:
            if max(fresh) + 1 == MOST:
                self.rest = max(self.rest, left)
            for d in range(len(low)):
                new = *fresh[:d], fresh[d] + 1, *fresh[d + 1:]
                below = [(*new[:k], new[k] - 1, *new[k + 1:]) for k in range(len(low)) if new[k]]
                if new[d] == MOST or not inside.issuperset(below) or len(self.surplus) == most:
                    continue
                x = self._point(np.array(new))
                value = function(x)
                found = value - self(x[None])[0]
                largest = np.maximum(largest, np.abs(value))
                border[new] = size(found, largest)
                self.indices = np.vstack([self.indices, new])
                self.surplus = np.vstack([self.surplus, found])
            fresh = max(border, key=border.__getitem__, default=fresh)
            if border.get(fresh, 0.0) <= 1.0 or len(self.surplus) == most:
                break
            left = border.pop(fresh)
            inside.add(fresh)
        self.asked = len(self.surplus)
        self.rest = float(max([self.rest, *border.values()]))

    def _point(self, index):
        return self.low + 0.5 * (1.0 + leja()[index]) * (self.high - self.low)

    def basis(self, x: Array) -> Array:
        """What the surpluses are multiplied by at points (n, d): shape (n, asked)."""
        points, out = leja(), np.ones((len(x), len(self.indices)))
        for d, top in enumerate(np.max(self.indices, axis=0)):
            y = 2.0 * (x[:, d] - self.low[d]) / (self.high[d] - self.low[d]) - 1.0
            columns = [np.ones(len(x))]
            for k in range(1, top + 1):
                others = points[k] - points[:k]
                columns.append(np.prod((y[:, None] - points[:k]) / others, axis=1))
            out *= np.array(columns)[self.indices[:, d]].T
        return out

    def __call__(self, x: Array) -> Array:
        """Values at points (n, d), shape (n, k)."""
        return self.basis(x) @ self.surplus
