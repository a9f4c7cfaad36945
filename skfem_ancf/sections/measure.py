"""Quadrature across a section: Gauss rules of the measure b(Y) dY, fixed or moving."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import legval, legvander
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


# tapered sections with constant thicknesses: their interfaces move in relative height

#: Least degree of the series of a width, and additional points for a square root.
LEAST, ROUND = 8, 40


class Moving(Measure):
    """Width with interval ends ``a + b / h``: constant thicknesses on a varying height.

    Formulations sample strains at constant relative heights, so the points eta are the same along
    the beam and the weights vary: Gauss weights times the Legendre series of the width, which
    reproduces its moments up to ``degree``. Single weights may be negative.
    """

    low, high, moves = 0.0, 1.0, True

    def __repr__(self) -> str:
        return f"<{len(self.pieces)} widths, whose thicknesses stay along a taper>"

    def __init__(self, pieces_of: Callable[[Any], Sequence[Piece]], height: float,
                 degree: int = LEAST) -> None:
        self.pieces_of, self.height, self.degree = pieces_of, height, degree
        largest = self.at(height)
        self.pieces, self.mean = largest.pieces, largest.mean
        self.spent = 2 * ((degree + 1) // 2)

    def of_order(self, order: int) -> Moving:
        return Moving(self.pieces_of, self.height, max(LEAST, 4 * order))

    def at(self, height: float) -> Weighted:
        return Weighted(self.pieces_of(height))

    def gauss(self, n: int) -> Rule:
        """Points eta and weights, exact to degree 2 n - 1 times the series; one for n = 1."""
        if n == 1:
            return np.array([0.5 * (self.pieces[0].low + self.pieces[-1].high)]), np.ones(1)
        return gauss(n + (self.degree + 1) // 2)

    def ends(self, h: Array) -> Array:
        found = self.pieces_of(h[..., None])
        return np.array([np.broadcast_to(end, h.shape + (1,))[..., 0]
                         for end in (found[0].low, *(p.high for p in found))])

    def _inside(self, at):
        """The points, moved to the layer's ends where they are outside of it."""
        low, *_, high = self.ends(at.heights)
        return at.moved(np.array([np.broadcast_to(at.X[0], low.shape),
                                  np.clip(at.X[1], low, high)]))

    def values(self, at: Any, name: str, whole: bool = False) -> Array:
        return self._inside(at).evaluated(name)

    def width(self, at: Any) -> Array:
        eta, h = (x[..., None] for x in np.broadcast_arrays(at.X[1], at.heights))
        found = self.pieces_of(h)
        out = 0.0 * eta
        for piece in found:
            inside = (eta >= piece.low) & (eta < piece.high if piece is not found[-1] else True)
            out = np.where(inside, piece.width(eta) if callable(piece.width) else piece.width, out)
        return at.factor("width") * out[..., 0]

    def outline(self, at: Any) -> Any:
        if at.layer.by_height:  # a tube
            return at.heights
        return at.layer.outer or at.factor("width")

    def breadth(self, at: Any, whole: bool = False, times: str = "") -> Array:
        xi = np.asarray(at.X[0])
        back: Any = slice(None)
        if xi.ndim == 1:
            xi, back = np.unique(xi, return_inverse=True)
        elif np.all(xi == xi[:, :1]):
            xi, back = xi[:, :1], np.zeros(xi.shape[1], dtype=int)
        names = ("width", times) if times else ("width",)
        functions = [name for name in names if callable(getattr(at.layer, name))]
        c = np.prod([at.factor(name) for name in names if name not in functions])

        def product(eta):
            X = np.array([np.broadcast_to(xi[..., None], eta.shape), eta])
            there = at.moved(X.reshape(2, len(eta), -1))
            return np.prod([there.evaluated(name) for name in functions], axis=0).reshape(eta.shape)

        c = c * self.moments(at.across.heights(xi, at.tind), product if functions else None)
        return c[0][:, back] if whole else self.series(c[:, :, back], at.X[1])

    def sampled(self, at: Any, n: int) -> tuple[Array, Array]:
        eta, w = self.points(at.heights[:, 0], n)
        there = at.moved(np.array([at.X[0] + 0.0 * eta, eta]))
        return eta, w * (there.evaluated("width") if callable(at.layer.width) else at.layer.width)

    def points(self, h: Array, n: int) -> tuple[Array, Array]:
        """n points in each interval of smooth width, and weights that include it, (..., q)."""
        places, weights = [], []
        for low, high, width in self.pieces_of(h[..., None]):
            t, w = gauss(n + ROUND * callable(width))
            if callable(width):  # its square roots at the ends are smooth in an angle
                t, w = 0.5 - 0.5 * np.cos(np.pi * t), 0.5 * np.pi * np.sin(np.pi * t) * w
            eta = low + (high - low) * t + 0.0 * h[..., None]
            places.append(eta)
            weights.append((high - low) * w * (width(eta) if callable(width) else width)
                           + 0.0 * eta)
        return np.concatenate(places, axis=-1), np.concatenate(weights, axis=-1)

    def moments(self, h: Array, times: Callable[[Array], Any] | None = None) -> Array:
        """Coefficients (degree + 1, ...) of the Legendre series of the width times a function."""
        eta, w = self.points(h, self.degree // 2 + 1 + (0 if times is None else 2 * MORE))
        if times is not None:
            w = w * times(eta)
        k = np.arange(self.degree + 1)
        return np.moveaxis((2 * k + 1) * np.einsum("...q,...qk->...k", w, legvander(
            2.0 * eta - 1.0, self.degree)), -1, 0)

    @staticmethod
    def series(moments: Array, eta: Any) -> Array:
        """The Legendre series with coefficients ``moments`` at eta (...)."""
        return legval(2.0 * np.asarray(eta) - 1.0, moments, tensor=False)
