"""Points across a section, for fields that are smooth in each interval and may jump between."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from ..core.quadrature import gauss

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..core.types import Array
    from ..sections import Layer

#: Points of an interval that is the whole section, at least; of one of several, more than the
#: order N and at least; and of one whose width is a function, as the chord of a circle.
ACROSS, MORE, FEW, ROUND = 7, 2, 5, 17


class Interval(NamedTuple):
    """A part of the section from ``low`` to ``high`` (eta) with nodes of a coordinate s on [0, 1].

    Fields are polynomials of s. If it is curved, ``eta = middle - half cos(pi s)``, in which widths
    with square roots at the ends are smooth; else s is linear in eta.
    """

    low: float
    high: float
    curved: bool
    nodes: Array

    @property
    def eta(self) -> Array:
        """Places of the nodes."""
        s = 0.5 - 0.5 * np.cos(np.pi * self.nodes) if self.curved else self.nodes
        return self.low + (self.high - self.low) * s

    def local(self, eta: Array) -> Array:
        """The points s of places eta."""
        s = (eta - self.low) / (self.high - self.low)
        return np.arccos(np.clip(1.0 - 2.0 * s, -1.0, 1.0)) / np.pi if self.curved else s

    def weights(self, s: Array) -> Array:
        """Weights of the values at the nodes for those at points s (...), shape (..., n)."""
        degree = len(self.nodes) - 1
        return chebvander(2.0 * s - 1.0, degree) @ np.linalg.inv(
            chebvander(2.0 * self.nodes - 1.0, degree))

    def integrals(self, ends: Array) -> Array:
        """From values at the nodes to the integrals over eta from s = 0 to ends (k,), (k, n)."""
        x, w = gauss(len(self.nodes) * (2 if self.curved else 1))
        s = ends[:, None] * x
        slope = 0.5 * np.pi * np.sin(np.pi * s) if self.curved else 1.0 + 0.0 * s
        return (self.high - self.low) * np.einsum("kg,kgn->kn", ends[:, None] * w * slope,
                                                  self.weights(s))


class Points(NamedTuple):
    """Points across given sections: arrays (n, m), or (m,) where all sections are alike.

    Attributes
    ----------
    eta
        Where they are across.
    stretch
        Length of their interval, relative to the longest.
    drift, swell
        Derivatives of eta and of the logarithm of the stretch by the height.
    axis, till_axis
        From values at the points to that on the axis, and to their integral over the longest
        intervals from the lowest place to the axis.
    """

    eta: Array
    stretch: Any
    drift: Any
    swell: Any
    axis: Array
    till_axis: Array


class Intervals:
    """Points across a section of given slabs, with integrals and values of fields given there.

    The intervals of some tapered sections are other parts of the height from place to place
    (``moves``). Their points are then given where the section is highest; :meth:`points` has them
    elsewhere.

    Attributes
    ----------
    eta
        The points, shape (m,); those of several intervals are inside of them.
    slabs
        For each slab the columns of its points.
    width
        Width of a slab at the points over its mean, area by height, shape (m,).
    from_bottom, whole
        From values to the integrals over eta from 0 to the points, (m, m), and to 1, (m,).
    bottom, top
        From values to those at the lowest and the highest place, shape (m,).
    """

    def __init__(self, layers: Sequence[Layer], order: int) -> None:
        self._measures = [layer.measure for layer in layers]
        pieces = [(piece, m.mean) for m in self._measures for piece in m.pieces]
        self._intervals = [_interval(low, high, callable(b), order, len(pieces) == 1)
                           for (low, high, b), _ in pieces]
        ends = np.cumsum([0] + [len(i.nodes) for i in self._intervals])
        self._columns = [slice(a, b) for a, b in pairwise(ends.tolist())]
        counts = np.cumsum([0] + [len(m.pieces) for m in self._measures])
        self.layers = [slice(ends[a], ends[b]) for a, b in pairwise(counts)]
        self.eta = np.concatenate([i.eta for i in self._intervals])
        self.width = np.concatenate([
            (b(i.eta) if callable(b) else b) / mean + 0.0 * i.eta
            for i, ((_, _, b), mean) in zip(self._intervals, pieces)])
        self._low, self._high = (np.array([getattr(i, end) for i in self._intervals])
                                 for end in ("low", "high"))
        self.moves = self._measures[0].moves
        self.from_bottom, self.whole = self._integrals(self.eta), np.zeros(ends[-1])
        for i, columns in zip(self._intervals, self._columns):
            self.whole[columns] = i.integrals(np.ones(1))
        self.bottom, self.top = self.weights(np.array([self._low[0], self._high[-1]]))

    def _which(self, eta):
        """The interval of each place; the upper one between two."""
        return np.searchsorted(self._high[:-1], eta, side="right")

    def weights(self, eta: Array) -> Array:
        """Weights of the values at the points for those at places eta (k,), shape (k, m)."""
        which, out = self._which(eta), np.zeros((len(eta), len(self.eta)))
        for k in np.unique(which):
            i, on = self._intervals[k], np.flatnonzero(which == k)
            out[on, self._columns[k]] = i.weights(i.local(eta[on]))
        return out

    def _integrals(self, eta):
        """From values at the points to their integrals from the bottom to places, (k, m)."""
        which, out = self._which(eta), np.zeros((len(eta), len(self.eta)))
        for k, (i, columns) in enumerate(zip(self._intervals, self._columns)):
            s = np.where(which > k, 1.0, i.local(np.clip(eta, i.low, i.high)))
            out[:, columns] = np.where(which[:, None] < k, 0.0, i.integrals(s))
        return out

    def _ends_at(self, h):
        """Lower and upper ends of the intervals at heights (n,), shape (nintervals, n) both."""
        ends = [m.ends(h) for m in self._measures]
        return (np.concatenate([e[:-1] for e in ends]), np.concatenate([e[1:] for e in ends]))

    def points(self, h: Array) -> Points:
        """The points at sections of heights h, shape (n,)."""
        middle = np.array([0.5])
        if not self.moves:
            return Points(self.eta, 1.0, 0.0, 0.0, self.weights(middle)[0],
                          self._integrals(middle)[0])
        of = np.repeat(np.arange(len(self._low)), [len(i.nodes) for i in self._intervals])
        size = (self._high - self._low)[of]
        z = (self.eta - self._low[of]) / size
        (low, high), (low2, high2) = ((end[of].T for end in self._ends_at(k * h))
                                      for k in (1.0, 2.0))
        # ends are a + b / h: twice the difference of that of 2 h, over h, is the derivative
        low_rate, high_rate = (2.0 * (b - a) / h[:, None] for a, b in ((low, low2), (high, high2)))
        at = self.place(0.5 + 0.0 * h, h)
        return Points(low + (high - low) * z, (high - low) / size,
                      low_rate + (high_rate - low_rate) * z, (high_rate - low_rate) / (high - low),
                      self.weights(at), self._integrals(at))

    def place(self, eta: Array, h: Array) -> Array:
        """Places where the section is highest, of places eta in sections of heights h, (n,)."""
        if not self.moves:
            return eta
        low, high = self._ends_at(h)
        which = np.sum(eta >= high[:-1], axis=0)
        low, high = (np.take_along_axis(x, which[None], 0)[0] for x in (low, high))
        starts, ends = self._low[which], self._high[which]
        return starts + (ends - starts) * (eta - low) / (high - low)


def _interval(low, high, curved, order, alone):
    """An Interval; the points of one that is alone and smooth are at its ends too."""
    if alone and not curved:
        n = max(ACROSS, 2 * order + 1)
        nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, n))
        nodes[n // 2] = 0.5
    else:
        n = ROUND if curved else max(FEW, order + MORE)
        nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)
    return Interval(low, high, curved, nodes)
