"""Quadrature across a section: Gauss rules of the measure b(Y) dY."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from ..core.immutable import Immutable
from ..core.quadrature import gauss
from ..core.types import Array, Rule

#: Additional points where the width is not a polynomial of Y.
MORE = 4

#: Points across a layer for mean values.
MEAN = 8


class Piece(NamedTuple):
    """An interval from ``low`` to ``high`` with smooth width, a number or a function of eta (n,).

    The width may behave like a square root at its ends.
    """

    low: float
    high: float
    width: float | Callable[[Array], Array]


class Measure(Immutable):
    """Width and quadrature across a layer.

    ``low`` and ``high`` are relative heights, constant along the beam unless ``moves`` is true; the
    width varies along the beam by a factor only. A rule uses up the degree ``spent`` of exactness
    on the width. Methods take a layer at points, from :meth:`.Across.at`, and return numbers or
    arrays (nelements, npoints).
    """

    low: float
    high: float
    pieces: tuple[Piece, ...]
    spent: int = 0
    moves = False

    def gauss(self, n: int) -> Rule:
        """Points eta (m,) and weights (m,) of sum 1, exact to degree 2 n - 1."""
        raise NotImplementedError

    def of_order(self, order: int) -> Measure:
        """The measure for elements of order N, whose strain energy has degree 4 N across."""
        return self

    def at(self, height: float) -> Measure:
        """The measure at one height."""
        return self

    @property
    def highest(self) -> Array:
        """Interval ends at the largest height, bottom to top, (n + 1,)."""
        return np.array([self.pieces[0].low, *(p.high for p in self.pieces)])

    def ends(self, h: Array) -> Array:
        """Interval ends at heights h (...), (npieces + 1, ...)."""
        return np.multiply.outer(self.highest, np.ones(h.shape))

    def values(self, at: Any, name: str, whole: bool = False) -> Array:
        """A function of the layer at points, or with ``whole`` its means over the sections."""
        if not whole:
            return at.evaluated(name)
        X, (eta, w) = at.X, self.gauss(MEAN)
        points = np.array([np.repeat(X[0][..., None], len(eta), -1),
                           np.broadcast_to(eta, X[0].shape + eta.shape)])
        values = at.moved(points.reshape(X.shape[:-1] + (-1,))).evaluated(name)
        return values.reshape(values.shape[0], -1, len(eta)) @ w

    def breadth(self, at: Any, whole: bool = False, times: str = "") -> Any:
        """Factor on the weights of rules: area over height, or a weighted integral over height."""
        layer, mesh, size = at.layer, at.across.mesh, at.factor("width", whole)
        if callable(layer.width):
            size = size * layer.part
        elif layer.by_height and mesh.heights is not None:
            size = size * at.heights / mesh.height
        return size * at.factor(times, whole) if times else size

    def width(self, at: Any) -> Any:
        """Width at points of the layer."""
        return self.breadth(at) / at.layer.part

    def outline(self, at: Any) -> Any:
        """Largest width of the sections; for a function the width at the points."""
        layer = at.layer
        scale = layer.outer * layer.part / layer.width if layer.outer else 1.0
        return scale * self.breadth(at) / layer.part

    def sampled(self, at: Any, n: int) -> tuple[Array, Array]:
        """At least n points across each section and weights times the breadth, (nsections, q)."""
        eta, w = self.gauss(n)
        eta = np.repeat(eta[None], at.X.shape[1], 0)
        return eta, self.breadth(at.moved(np.array([at.X[0] + 0.0 * eta, eta]))) * w + 0.0 * eta


class Uniform(Measure):
    """Constant width: Gauss rules with ``more`` points than requested."""

    def __init__(self, low: float = 0.0, high: float = 1.0, more: int = 0) -> None:
        self.low, self.high, self.more = low, high, more
        self.pieces, self.mean = (Piece(low, high, 1.0),), high - low

    def gauss(self, n: int) -> Rule:
        x, w = gauss(n + self.more if n > 1 else n)
        return (x if (self.low, self.high) == (0.0, 1.0) else
                self.low + (self.high - self.low) * x), w

    def __repr__(self) -> str:
        return f"<one width from {self.low:.4g} to {self.high:.4g} of the height>"


#: The measure of a full section.
WHOLE = Uniform()


class Weighted(Measure):
    """Width that varies across: Gauss rules of the measure b(Y) dY.

    They are exact, to round-off, for polynomials of degree 2 n - 1 times the width, jumps and
    square roots at the ends of circles included. The measure is discretised interval by interval
    with ``Y = middle - half cos t`` and Gauss points in t; its orthogonal polynomials follow from
    the Stieltjes procedure (Gautschi: "Orthogonal Polynomials: Computation and Approximation",
    Oxford University Press, 2004, section 2.2).
    """

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self.pieces = tuple(pieces)
        self.low, self.high = self.pieces[0].low, self.pieces[-1].high
        #: Integral of the width over eta, the mean width of a section that fills [0, 1].
        self.mean = float(np.sum(self._discrete(20)[1]))

    def __repr__(self) -> str:
        return f"<{len(self.pieces)} widths, one above the other>"

    def _discrete(self, n):
        """Points and weights of the discretised measure, exact for degree n."""
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
