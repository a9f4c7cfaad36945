"""Rules across a section: Gauss rules of the measure b(Y) dY."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from ..core.immutable import Immutable
from ..core.quadrature import gauss
from ..core.types import Array, Rule

#: Points more, where the weight is no polynomial of Y.
MORE = 4

#: Points across a layer for means of functions.
MEAN = 8


class Piece(NamedTuple):
    """Where the width, a number or a function of eta (n,), is smooth: from ``low`` to ``high``.

    At its ends the width may be a square root.
    """

    low: float
    high: float
    width: float | Callable[[Array], Array]


class Measure(Immutable):
    """What a layer has across: rules with its width in their weights, and what these stand for.

    Its ends ``low`` and ``high`` are the same parts of the height all along a beam, and its width
    but for a factor; those of one that ``moves`` are not. Rules spend the degree ``spent`` of
    exactness on the width. Methods take points of a layer, ``at``, as :meth:`.Across.at` gives
    them, and return numbers or arrays (nelements, npoints).
    """

    low: float
    high: float
    pieces: tuple[Piece, ...]
    spent: int = 0
    moves = False

    def gauss(self, n: int) -> Rule:
        """Points eta (m,) and weights (m,), whose sum is 1, exact to degree 2 n - 1."""
        raise NotImplementedError

    def of_order(self, order: int) -> Measure:
        """The measure for an element whose strain energy is of degree 4 N across, N the order."""
        return self

    def at(self, height: float) -> Measure:
        """The measure of one section."""
        return self

    @property
    def highest(self) -> Array:
        """Ends of the pieces, from the bottom to the top, where the beam is highest, (n + 1,)."""
        return np.array([self.pieces[0].low, *(p.high for p in self.pieces)])

    def ends(self, h: Array) -> Array:
        """Ends of the pieces at heights h (...), (npieces + 1, ...)."""
        return np.multiply.outer(self.highest, np.ones(h.shape))

    def values(self, at: Any, name: str, whole: bool = False) -> Array:
        """A function of the layer at points, or the means of their sections, ``whole``."""
        if not whole:
            return at.asked(name)
        X, (eta, w) = at.X, self.gauss(MEAN)
        points = np.array([np.repeat(X[0][..., None], len(eta), -1),
                           np.broadcast_to(eta, X[0].shape + eta.shape)])
        values = at.moved(points.reshape(X.shape[:-1] + (-1,))).asked(name)
        return values.reshape(values.shape[0], -1, len(eta)) @ w

    def breadth(self, at: Any, whole: bool = False, times: str = "") -> Any:
        """What the weights of rules are multiplied by: area over height, or integrals over it."""
        layer, mesh, size = at.layer, at.across.mesh, at.factor("width", whole)
        if callable(layer.width):
            size = size * layer.part
        elif layer.by_height and mesh.heights is not None:
            size = size * at.heights / mesh.height
        return size * at.factor(times, whole) if times else size

    def width(self, at: Any) -> Any:
        """The width at points of the layer."""
        return self.breadth(at) / at.layer.part

    def outline(self, at: Any) -> Any:
        """The largest width of sections, or where that is a function the one at points."""
        layer = at.layer
        scale = layer.outer * layer.part / layer.width if layer.outer else 1.0
        return scale * self.breadth(at) / layer.part

    def sampled(self, at: Any, n: int) -> tuple[Array, Array]:
        """At least n points of sections, for fields that are the layer's own.

        Places across, and what of area over height they stand for, (nsections, q).
        """
        eta, w = self.gauss(n)
        eta = np.repeat(eta[None], at.X.shape[1], 0)
        return eta, self.breadth(at.moved(np.array([at.X[0] + 0.0 * eta, eta]))) * w + 0.0 * eta


class Uniform(Measure):
    """The measure of a constant width: rules of Gauss, with ``more`` points than asked for."""

    def __init__(self, low: float = 0.0, high: float = 1.0, more: int = 0) -> None:
        self.low, self.high, self.more = low, high, more
        self.pieces, self.mean = (Piece(low, high, 1.0),), high - low

    def gauss(self, n: int) -> Rule:
        x, w = gauss(n + self.more if n > 1 else n)
        return (x if (self.low, self.high) == (0.0, 1.0) else
                self.low + (self.high - self.low) * x), w

    def __repr__(self) -> str:
        return f"<one width from {self.low:.4g} to {self.high:.4g} of the height>"


#: That of a full section.
WHOLE = Uniform()


class Weighted(Measure):
    """The measure of a width that varies across: Gauss rules that have the width in their weights.

    They are exact, to round-off, for polynomials of degree 2 n - 1 times the width, jumps and
    square roots at the ends of circles included: the measure is discretised piece by piece, by
    Gauss points of the angle t of ``Y = middle - half cos t``, and its orthogonal polynomials are
    found by the procedure of Stieltjes (Gautschi: "Orthogonal Polynomials: Computation and
    Approximation", Oxford University Press, 2004, section 2.2).
    """

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self.pieces = tuple(pieces)
        self.low, self.high = self.pieces[0].low, self.pieces[-1].high
        #: Integral of the width over eta, the mean width of a section that fills [0, 1].
        self.mean = float(np.sum(self._discrete(20)[1]))

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
