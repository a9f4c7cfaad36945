"""Rules across a section: Gauss rules of the measure b(Y) dY."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from ..frozen import Frozen
from ..quadrature import gauss

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..types import Array, Rule

#: Points more, where the weight is no polynomial of Y.
MORE = 4


class Piece(NamedTuple):
    """Where the width is smooth: from ``low`` to ``high``, places eta in [0, 1].

    Attributes
    ----------
    low, high
        Its ends, where the width may be a square root.
    width
        A number, or a function of eta (n,) that returns (n,).
    """

    low: float
    high: float
    width: float | Callable[[Array], Array]


class Uniform(Frozen):
    """The measure of a constant width from ``low`` to ``high``: its rules are those of Gauss.

    Parameters
    ----------
    low, high
        Its ends, places eta.
    more
        Points added to each rule, for what is not constant across.
    """

    def __init__(self, low: float = 0.0, high: float = 1.0, more: int = 0) -> None:
        self.low, self.high, self.more = low, high, more
        self.pieces, self.mean = (Piece(low, high, 1.0),), high - low

    def gauss(self, n: int) -> Rule:
        """Points eta (m,) and weights (m,), whose sum is 1, exact to degree 2 n - 1.

        Parameters
        ----------
        n
            Number of points asked for.
        """
        x, w = gauss(n + self.more if n > 1 else n)
        return (x if (self.low, self.high) == (0.0, 1.0) else
                self.low + (self.high - self.low) * x), w

    def __repr__(self) -> str:
        return f"<one width from {self.low:.4g} to {self.high:.4g} of the height>"


#: That of a full section.
WHOLE = Uniform()


class Weighted(Frozen):
    """The measure of a width that varies across: Gauss rules that have the width in their weights.

    They are exact, to round-off, for polynomials of degree 2 n - 1 times the width, jumps and
    square roots at the ends of circles included: the measure is discretised piece by piece, by
    Gauss points of the angle t of ``Y = middle - half cos t``, and its orthogonal polynomials are
    found by the procedure of Stieltjes.

    Parameters
    ----------
    pieces
        The width, piece by piece.

    References
    ----------
    Gautschi: "Orthogonal Polynomials: Computation and Approximation", Oxford University Press
    (2004), section 2.2.
    """

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self.pieces = tuple(pieces)
        self.low, self.high = self.pieces[0].low, self.pieces[-1].high
        #: Integral of the width over eta, the mean width of a section that fills [0, 1].
        self.mean = float(np.sum(self._discrete(20)[1]))
        self._rules = lru_cache(64)(self._gauss)

    def __reduce__(self):
        return Weighted, (self.pieces,)

    def __repr__(self) -> str:
        return f"<{len(self.pieces)} widths, one above the other>"

    def _discrete(self, n):
        """Points and weights of the measure, enough for polynomials of degree n."""
        t, w = gauss(n + 40)
        t, w = np.pi * t, np.pi * w
        points, weights = [], []
        for low, high, width in self.pieces:
            half = 0.5 * (high - low)
            eta = 0.5 * (low + high) - half * np.cos(t)
            b = width(eta) if callable(width) else width
            points.append(eta)
            weights.append(half * np.sin(t) * w * b)
        return np.concatenate(points), np.concatenate(weights)

    def gauss(self, n: int) -> Rule:
        """Points eta (n,) and weights (n,), whose sum is 1, exact to degree 2 n - 1.

        Parameters
        ----------
        n
            Number of points.
        """
        x, w = self._rules(n)
        return x.copy(), w.copy()

    def _gauss(self, n):
        x, w = self._discrete(2 * n)
        w = w / np.sum(w)
        a, b = np.zeros(n), np.zeros(n)
        before, now, size = np.zeros_like(x), np.ones_like(x), 1.0
        for k in range(n):
            a[k] = w @ (x * now * now) / size
            before, now = now, (x - a[k]) * now - b[k] * before
            old, size = size, w @ (now * now)
            if k + 1 < n:
                b[k + 1] = size / old
        points, vectors = eigh_tridiagonal(a, np.sqrt(b[1:]))
        return points, vectors[0] ** 2
