"""Tapered sections with constant thicknesses: their interfaces move in relative height."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legval, legvander

from ..core.quadrature import gauss
from ..core.types import Array, Rule
from .measure import MORE, Measure, Piece, Weighted

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
