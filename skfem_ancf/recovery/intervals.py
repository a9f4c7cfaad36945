"""Points across a section, for fields that are smooth within its panels and may jump between."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.frozen import Frozen
from ..core.quadrature import gauss, lagrange
from ..elements.series import chebyshev, polynomials

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..core.types import Array
    from ..sections import Slab

#: Points of a panel that is the whole section, at least; of one of several, more than the order N
#: and at least; and of one whose width is a function, as the chord of a circle.
ACROSS, MORE, FEW, ROUND = 7, 2, 5, 17


class Panel(NamedTuple):
    """A part of the section, on which fields are polynomials of a coordinate s on [0, 1].

    Attributes
    ----------
    low, high
        Its ends, places eta.
    curved
        ``eta = middle - half cos(pi s)``, in which widths with square roots at the ends are smooth;
        else s is linear in eta.
    nodes
        Points s, shape (n,).
    columns
        Where they are among all points.
    series
        From values at the nodes to coefficients of Chebyshev polynomials of s, shape (n, n).
    """

    low: float
    high: float
    curved: bool
    nodes: Array
    columns: slice
    series: Array

    def eta(self, s: Array) -> Array:
        """Places across of points s."""
        if self.curved:
            s = 0.5 - 0.5 * np.cos(np.pi * s)
        return self.low + (self.high - self.low) * s

    def local(self, eta: Any) -> Any:
        """The points s of places across."""
        s = (eta - self.low) / (self.high - self.low)
        return np.arccos(np.clip(1.0 - 2.0 * s, -1.0, 1.0)) / np.pi if self.curved else s

    def values(self, s: Any) -> Array:
        """Weights of values at the nodes for those at points s, shape (..., n)."""
        return np.array(polynomials(s, len(self.series))).T.dot(self.series)

    def integrals(self, ends: Array) -> Array:
        """From values at the nodes to the integrals over eta from s = 0 to ends, shape (k, n)."""
        size = self.high - self.low
        x, w = gauss(len(self.nodes) + (len(self.nodes) if self.curved else 0))
        out = []
        for end in ends:
            slope = (0.5 * np.pi * np.sin(np.pi * end * x) if self.curved else 1.0) * size * end
            out.append((w * slope) @ lagrange(self.nodes, end * x))
        return np.array(out)


class Moved(NamedTuple):
    """Points of panels at sections of some heights; arrays (n, m).

    Attributes
    ----------
    eta
        Where they are across.
    stretch
        How long panels are there, relative to where they are longest.
    drift, swell
        Derivatives of eta and of the logarithm of the stretch by the height.
    axis
        From values at the points of a section to that on the axis.
    till_axis
        From values to their integral over eta from the lowest place to the axis.
    """

    eta: Array
    stretch: Any
    drift: Any
    swell: Any
    axis: Array
    till_axis: Array


class Panels(Frozen):
    """Points across a section, and the integrals and values of what is given there.

    Where a section has other parts of the height from place to place, the places of panels are
    those where it is highest, and :meth:`moved` says where they are elsewhere.

    Parameters
    ----------
    slabs
        Of the section.
    order
        N of the element.

    Attributes
    ----------
    eta
        The points, shape (m,); those of several panels are inside of them.
    slabs
        For each slab its columns among them.
    width
        Width of a slab at the points over its mean, area by height, shape (m,).
    from_bottom, whole
        From values to the integrals over eta from 0 to the points, (m, m), and to 1, (m,).
    from_axis
        From the axis to the points, (m, m).
    bottom, axis, top
        From values to those at the lowest place, eta = 1/2 and the highest place, shape (m,).
    moving
        A section has other parts of the height from place to place.
    """

    def __init__(self, slabs: Sequence[Slab], order: int) -> None:
        parts = [(piece, k, slab.measure.mean) for k, slab in enumerate(slabs)
                 for piece in slab.measure.pieces]
        self.panels: list[Panel] = []
        of_slab, width, first = [], [], 0
        for (low, high, b), k, mean in parts:
            panel = _panel(low, high, callable(b), order, len(parts) == 1, first)
            eta = panel.eta(panel.nodes)
            first += len(eta)
            self.panels.append(panel)
            of_slab += [k] * len(eta)
            width.append((b(eta) if callable(b) else b) / mean + 0.0 * eta)
        self.eta = np.concatenate([p.eta(p.nodes) for p in self.panels])
        self.width = np.concatenate(width)
        ends = np.searchsorted(of_slab, np.arange(len(slabs) + 1))
        self.slabs = [slice(a, b) for a, b in zip(ends[:-1].tolist(), ends[1:].tolist())]
        self._ends = [p.high for p in self.panels[:-1]]
        self.from_bottom, self.whole = np.zeros((first, first)), np.zeros(first)
        for panel in self.panels:
            self.from_bottom[panel.columns] += self.whole
            self.from_bottom[panel.columns, panel.columns] = panel.integrals(panel.nodes)
            self.whole[panel.columns] = panel.integrals(np.ones(1))
        self.bottom, self.axis, self.top = (
            self.values(eta) for eta in (parts[0][0].low, 0.5, parts[-1][0].high))
        self.from_axis = self.from_bottom - self._till(0.5)
        measures = [slab.measure for slab in slabs]
        self.moving = measures[0].moves
        if self.moving:
            self._lines = self._ends_of(measures)

    def _ends_of(self, measures):
        """a and b of the ends ``a + b / h`` of panels: of the lower ones and the upper ones."""
        h = np.array([measures[0].height, 2.0 * measures[0].height])
        found = [m.ends(h) for m in measures]
        ends = [np.concatenate([e[:-1] for e in found]), np.concatenate([e[1:] for e in found])]
        return [(2.0 * two - one, h[1] * (one - two)) for one, two in (e.T for e in ends)]

    def _till(self, eta):
        """From values to their integral over eta from the lowest place to one, (m,)."""
        panel = self.panels[bisect_right(self._ends, eta)]
        out = np.where(np.arange(len(self.eta)) < panel.columns.start, self.whole, 0.0)
        out[panel.columns] = panel.integrals(np.array([panel.local(eta)]))
        return out

    def _low_high(self, h):
        """Ends of the panels at heights h (...), of shape (npanels, ...) both."""
        return [a + b / h for a, b in (np.expand_dims(line, tuple(range(2, 2 + h.ndim)))
                                       for line in self._lines)]

    def moved(self, h: Array) -> Moved:
        """The points at sections of some heights.

        Parameters
        ----------
        h
            Heights, shape (n,).
        """
        of = np.repeat(np.arange(len(self.panels)), [len(p.nodes) for p in self.panels])
        low, high = (np.array([getattr(p, end) for p in self.panels])[of]
                     for end in ("low", "high"))
        z, size = (self.eta - low) / (high - low), high - low
        # a + b / h: twice the difference of that of 2 h, over h, is the derivative
        (low, high), (low2, high2) = ((end[of].T for end in self._low_high(k * h))
                                      for k in (1.0, 2.0))
        low_rate, high_rate = (2.0 * (b - a) / h[:, None] for a, b in ((low, low2), (high, high2)))
        stretch, at = (high - low) / size, self.place(0.5, h)
        inside = np.array([self._till(x) for x in at])
        return Moved(low + (high - low) * z, stretch, low_rate + (high_rate - low_rate) * z,
                     (high_rate - low_rate) / (high - low),
                     np.array([self.values(x) for x in at]), inside * stretch)

    def place(self, eta: Any, h: Any) -> Any:
        """The place across, where the section is highest, of what is at another elsewhere.

        Parameters
        ----------
        eta, h
            Places, and heights of the sections there: numbers, or arrays (n,).
        """
        low, high = self._low_high(np.asarray(h))
        which = np.sum(np.asarray(eta) >= high[:-1], axis=0)
        low, high = (np.take_along_axis(x, which[None], 0)[0] for x in (low, high))
        starts, ends = (np.array([getattr(p, end) for p in self.panels])[which]
                        for end in ("low", "high"))
        return starts + (ends - starts) * (eta - low) / (high - low)

    def values(self, eta: float) -> Array:
        """Weights (m,) of the values at the points for that at a place.

        Parameters
        ----------
        eta
            The place; one between two panels is in the upper.
        """
        panel = self.panels[bisect_right(self._ends, eta)]
        weights = panel.values(panel.local(eta))
        if len(self.panels) == 1:
            return weights
        out = np.zeros(len(self.eta))
        out[panel.columns] = weights
        return out

    def by_panel(self, eta: Array) -> list[tuple[Any, slice, Array]]:
        """Weights of the values at the points of panels for those at many places.

        Parameters
        ----------
        eta
            The places (n,); those between two panels are in the upper.

        Returns
        -------
        list
            For each panel with places in it which they are, (k,) or all; the columns of its
            points, and the weights of these, (k, columns).
        """
        if len(self.panels) == 1:
            panel, = self.panels
            return [(slice(None), panel.columns, panel.values(panel.local(eta)))]
        which, out = np.searchsorted(self._ends, eta, side="right"), []
        for k, panel in enumerate(self.panels):
            on = np.nonzero(which == k)[0]
            if len(on):
                out.append((on, panel.columns, panel.values(panel.local(eta[on]))))
        return out


def _panel(low, high, curved, order, alone, first):
    """A Panel; the points of one that is alone and smooth are at its ends too."""
    if alone and not curved:
        n = max(ACROSS, 2 * order + 1)
        nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, n))
        nodes[n // 2] = 0.5
    else:
        n = ROUND if curved else max(FEW, order + MORE)
        nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)
    return Panel(low, high, curved, nodes, slice(first, first + n),
                 np.linalg.inv(chebyshev(nodes, n).T))
