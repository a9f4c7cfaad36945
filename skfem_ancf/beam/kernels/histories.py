"""Elements of laws with a history."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np

from ...core import Array
from .elements import Elements
from .law import HISTORY, material_of
from .tables import CABLE, StrainTables


class Past(NamedTuple):
    """A history (n,) at the start of an increment, and the time ``span`` (1,) since. ``now`` (n,)
    has the eigenstrains at the end, where the history has those at the start."""

    history: Array
    span: Array
    now: Array


def history_size(t: StrainTables) -> int:
    """Number of history variables and components of eigenstrain; 0 for elastic laws."""
    return 0 if t.law.kind != HISTORY else _rows(t) * t.weights.shape[1] * len(t.start)


def _rows(t):
    """Variables of a point, and its components of strain: cables have fibres."""
    return material_of(t.law).number + (1 if t.kind == CABLE else 3)


def elements_of(t: StrainTables) -> Elements:
    """The Elements of tables, those with a history at rest."""
    return ElementsWithHistory(t) if t.law.kind == HISTORY else Elements(t)


def remembering(elements: Sequence[Elements], past: Past) -> list[Elements]:
    """The elements with consecutive parts of a Past, of which they have views."""
    out, first = [], 0
    for e in elements:
        last = first + history_size(e.t)
        out.append(e.remembering(past.history[first:last], past.span, past.now[first:last])
                   if isinstance(e, ElementsWithHistory) else e)
        first = last
    return out


#: Relative difference of strains that is round-off.
SAME = 1e-12
#: What copies of elements share.
CONSTANT = ("weights", "constant", "_G_ends", "_to_moduli", "_ends", "_products", "_signs",
            "_at_band")


class ElementsWithHistory(Elements):
    """Elements of a :class:`~skfem_ancf.materials.HistoryMaterial`. ``history`` (k, points, ne) is
    that at the start of an increment, ``span`` (1,) its time; ``before`` and ``now`` (c, points,
    ne) are the eigenstrains at its start and end. The law has the strain minus these. Cables have
    fibres: their points have one strain, along the axis."""

    def __init__(self, t: StrainTables) -> None:
        super().__init__(t)
        self.material, self._fibres = material_of(t.law), t.kind == CABLE
        self._own(np.zeros(history_size(t)), np.zeros(1), np.zeros(history_size(t)))
        self._scale = t.law.scale.reshape(3, 1, 1)
        self._known: Any = (np.zeros(0), None, np.zeros(0), np.zeros(0), np.nan)

    def _own(self, history, span, now):
        shape, n = (_rows(self.t), self.t.weights.shape[1], self.ne), self.material.number
        self.history, self.before = np.split(history.reshape(shape), [n])
        self.now, self.span = now.reshape(shape)[n:], span

    def remembering(self, history: Array, span: Array, now: Array) -> ElementsWithHistory:
        """A copy with another history, time span and eigenstrains at the end, see :class:`Past`."""
        for name in CONSTANT:  # made once for all copies
            getattr(self, name)
        other = copy(self)
        other._own(history, span, now)
        return other

    def evaluate(self, E: Array, dt: float | None = None) -> tuple[Array, Array, Array]:
        """Stress (c, points, ne), moduli (c, c, points, ne) and history at strains at the points.
        They are at the end of the increment; with ``dt = 0`` at its start."""
        E = E - (self.now if dt is None else self.before)
        dt = float(self.span[0]) if dt is None else dt
        if self._fibres:
            S, D, after = self.material.axial(E[0], self.history, dt)
            return S[None], D[None, None], after
        S, D, after = self.material.evaluate(self._scale * E, self.history, dt)
        return self._scale * S, self._scale[:, None] * D * self._scale, after

    def energy(self, E: Array, history: Array | None = None) -> Array:
        """Stored energy per volume (points, ne), at the end with its history, or at the start."""
        E = E - (self.before if history is None else self.now)
        history = self.history if history is None else history
        if self._fibres:
            return self.material.axial_energy(E[0], history)
        return self.material.energy(self._scale * E, history)

    def stress(self, strain: Array, change: Array | None = None, shift: Array | None = None
               ) -> Array:
        """Weighted stresses (ns, ne); with a ``change`` of the strain the mean of both ends."""
        # The work of this mean is the change of the stored energy and what is dissipated.
        if change is None:
            return self._weighted(self.evaluate(self.at_points(strain))[0])
        E, half = self.at_points(strain), 0.5 * self.at_points(change)
        return self._weighted(0.5 * (self.evaluate(E - half, 0.0)[0] + self.evaluate(E + half)[0]))

    def stress_and_moduli(self, strain: Array) -> tuple[Array, Array]:
        S, D, _ = self.evaluate(self.at_points(strain))
        moduli = self._between(D)
        self._known = (strain.copy(), moduli, self.now.copy(), self.history.copy(),
                       float(self.span[0]))
        return self._weighted(S), moduli

    def moduli_at(self, strain: Array, shift: Array | None = None) -> Array:
        E, moduli, now, history, dt = self._known  # often where an iteration has been
        if dt == self.span[0] and np.array_equal(now, self.now) and np.array_equal(
                history, self.history) and np.max(np.abs(strain - E)) <= SAME * np.max(np.abs(E)):
            return moduli
        return self._between(self.evaluate(self.at_points(strain))[1])

    def strain_at(self, u: Array) -> Array:
        """Strain at the integration points, (c, points, ne)."""
        _, d, one, _ = self.at(u)
        return self.at_points(self.strain(d, one))

    def accept(self, u: Array, v: Array) -> float:
        """Set the history at the end of an increment from u to v; returns what it dissipates."""
        E0, E1 = self.strain_at(u), self.strain_at(v)
        S0, (S1, _, after) = self.evaluate(E0, 0.0)[0], self.evaluate(E1)
        change = E1 - self.now - (E0 - self.before)  # eigenstrains do no work
        work = np.sum(0.5 * (S0 + S1) * change, axis=0)
        lost = float(np.sum(self.weights * (work - self.energy(E1, after) + self.energy(E0))))
        self.history[:], self.before[:] = after, self.now
        return lost


def fibre_points(layer: Any, xi: Array) -> tuple[Array, Array]:
    """Weights of the fibres of a layer, and their places at points xi (n,), (m,) and (2, n m)."""
    eta, w = layer.measure.gauss(max(getattr(layer.material, "points", 2), 2))
    return w, np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])


def fibres(across: Any, layer: Any, xi: Array, tind: Array | None) -> tuple[Array, Array]:
    """Distances from the axis and areas at points xi (n,) of elements, (ne or 1, n, m)."""
    w, X = fibre_points(layer, xi)
    h = across.heights(X[0], tind)
    Y, A = (X[1] - 0.5) * h, np.tile(w, len(xi)) * h * across.breadth(layer, X, tind)
    return tuple((x + np.zeros((1, X.shape[1]))).reshape(-1, len(xi), len(w)) for x in (Y, A))
