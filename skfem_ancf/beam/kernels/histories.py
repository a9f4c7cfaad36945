"""Elements of laws with a history."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from scipy import sparse

from ...core.immutable import cached_property
from ...core.types import Array
from .elements import Elements
from .law import HISTORY, material_of
from .tables import CABLE, StrainTables


def history_size(t: StrainTables) -> int:
    """Number of history variables of tables; 0 for elastic laws."""
    if t.law.kind != HISTORY:
        return 0
    return material_of(t.law).number * t.weights.shape[1] * len(t.start)


def elements_of(t: StrainTables) -> Elements:
    """The Elements of tables, those with a history at rest."""
    return ElementsWithHistory(t) if t.law.kind == HISTORY else Elements(t)


def remembering(elements: Sequence[Elements], values: Array, span: Array) -> list[Elements]:
    """The elements with consecutive parts of a history (n,), of which they have views."""
    out, first = [], 0
    for e in elements:
        last = first + history_size(e.t)
        out.append(e.remembering(values[first:last], span) if isinstance(
            e, ElementsWithHistory) else e)
        first = last
    return out


#: Relative difference of strains that is round-off.
SAME = 1e-12


class ElementsWithHistory(Elements):
    """Elements of a :class:`~skfem_ancf.materials.HistoryMaterial`.

    ``history`` (k, points, ne) is that at the start of an increment, ``span`` (1,) its time. Cables
    have fibres: their points have one strain, along the axis.
    """

    def __init__(self, t: StrainTables) -> None:
        super().__init__(t)
        self.material, self._fibres = material_of(t.law), t.kind == CABLE
        self.history = np.zeros((self.material.number, t.weights.shape[1], self.ne))
        self.span = np.zeros(1)
        self._scale = t.law.scale.reshape(3, 1, 1)
        self._known: Any = (np.zeros(0), None, np.zeros(0), np.nan)

    def remembering(self, values: Array, span: Array) -> ElementsWithHistory:
        """A copy with another history (n,) and time span."""
        other = copy(self)
        other.history, other.span = values.reshape(self.history.shape), span
        return other

    def at_points(self, strain: Array) -> Array:
        """Strains (3 or 1, points, ne) at the integration points."""
        return (self.t.along @ strain).reshape(-1, self.t.weights.shape[1], self.ne)

    def evaluate(self, E: Array, dt: float | None = None) -> tuple[Array, Array, Array]:
        """Stress (c, points, ne), moduli (c, c, points, ne) and history at strains at the points.

        ``dt`` is the time since :attr:`history`, by default :attr:`span`.
        """
        dt = float(self.span[0]) if dt is None else dt
        if self._fibres:
            S, D, after = self.material.axial(E[0], self.history, dt)
            return S[None], D[None, None], after
        S, D, after = self.material.evaluate(self._scale * E, self.history, dt)
        return self._scale * S, self._scale[:, None] * D * self._scale, after

    def energy(self, E: Array, history: Array | None = None) -> Array:
        """Stored energy per volume (points, ne)."""
        history = self.history if history is None else history
        if self._fibres:
            return self.material.axial_energy(E[0], history)
        return self.material.energy(self._scale * E, history)

    def _weighted(self, S):
        return self.t.along.T @ (S * self.weights).reshape(-1, self.ne)

    def stress(self, strain: Array, change: Array | None = None, shift: Array | None = None
               ) -> Array:
        """Weighted stresses (ns, ne); with a ``change`` of the strain the mean of both ends.

        The work of this mean is the change of the stored energy and what is dissipated.
        """
        if change is None:
            return self._weighted(self.evaluate(self.at_points(strain))[0])
        E, half = self.at_points(strain), 0.5 * self.at_points(change)
        return self._weighted(0.5 * (self.evaluate(E - half, 0.0)[0] + self.evaluate(E + half)[0]))

    @cached_property
    def _to_moduli(self):
        (s, z), c = self.t.pairs, 1 if self._fibres else 3
        A = self.t.along.reshape(c, -1, self.ns)
        of = np.abs(A).sum(axis=1).argmax(axis=0)
        M = np.zeros((len(s), c * c, A.shape[1]))
        M[np.arange(len(s)), c * of[s] + of[z]] = A[of[s], :, s] * A[of[z], :, z]
        return sparse.csr_matrix(M.reshape(len(s), -1))

    def _between(self, D):
        """Moduli (nq, ne) between samples, as if they were symmetric."""
        return self._to_moduli @ (D * self.weights).reshape(-1, self.ne)

    def stress_and_moduli(self, strain: Array) -> tuple[Array, Array]:
        S, D, _ = self.evaluate(self.at_points(strain))
        moduli = self._between(D)
        self._known = strain.copy(), moduli, self.history.copy(), float(self.span[0])
        return self._weighted(S), moduli

    def moduli_at(self, strain: Array, shift: Array | None = None) -> Array:
        E, moduli, history, dt = self._known  # often where an iteration has been
        if dt == self.span[0] and np.array_equal(history, self.history) and np.max(
                np.abs(strain - E)) <= SAME * np.max(np.abs(E)):
            return moduli
        return self._between(self.evaluate(self.at_points(strain))[1])

    def strain_at(self, u: Array) -> Array:
        """Strain at the integration points, (c, points, ne)."""
        _, d, one = self.at(u)
        return self.at_points(self.strain(d, one))

    def accept(self, u: Array, v: Array) -> float:
        """Set the history at the end of an increment from u to v; returns what it dissipates."""
        E0, E1 = self.strain_at(u), self.strain_at(v)
        S0, (S1, _, after) = self.evaluate(E0, 0.0)[0], self.evaluate(E1)
        work = np.sum(0.5 * (S0 + S1) * (E1 - E0), axis=0)
        lost = float(np.sum(self.weights * (work - self.energy(E1, after) + self.energy(E0))))
        self.history[:] = after
        return lost


def fibres(across: Any, layer: Any, xi: Array, tind: Array | None) -> tuple[Array, Array]:
    """Distances from the axis (m,), and areas at points xi (n,) of elements, (ne, n, m)."""
    eta, w = layer.measure.gauss(max(getattr(layer.material, "points", 2), 2))
    h, X = across.mesh.height, np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
    area = np.tile(w, len(xi)) * h * across.breadth(layer, X, tind) + np.zeros((1, X.shape[1]))
    return (eta - 0.5) * h, area.reshape(-1, len(xi), len(eta))
