"""Points across a section, for fields that are smooth within its panels and may jump between."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .frozen import Frozen
from .quadrature import gauss, lagrange
from .series import chebyshev

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .types import Array
    from .sections import Slab

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
        return chebyshev(s, self.series.shape[0]).T.dot(self.series)

    def integrals(self, ends: Array) -> Array:
        """From values at the nodes to the integrals over eta from s = 0 to ends, shape (k, n)."""
        size = self.high - self.low
        x, w = gauss(len(self.nodes) + (len(self.nodes) if self.curved else 0))
        out = []
        for end in ends:
            slope = (0.5 * np.pi * np.sin(np.pi * end * x) if self.curved else 1.0) * size * end
            out.append((w * slope) @ lagrange(self.nodes, end * x))
        return np.array(out)


class Panels(Frozen):
    """Points across a section, and the integrals and values of what is given there.

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
        self.from_axis = self.from_bottom - self._till_axis()

    def _till_axis(self):
        panel = self.panels[bisect_right(self._ends, 0.5)]
        out = np.where(np.arange(len(self.eta)) < panel.columns.start, self.whole, 0.0)
        out[panel.columns] = panel.integrals(np.array([panel.local(0.5)]))
        return out

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
