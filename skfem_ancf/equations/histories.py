"""Histories: what the forces of a scene remember of its past."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..actions.contact.tables import TURNS
from ..actions.forces.system import Forces
from ..beam.beam import Beam
from ..core.types import Array


class Histories:
    """The history of a scene: anchors and multipliers of obstacles, whole turns of torsional
    springs, variables of materials.

    A history is a value, an array (n,). Forces, tangents and energies depend on the one that is
    set, and do not change it; :meth:`accept` replaces it at the end of an increment. To start again
    is to set the old one. States, histories and checkpoints store it.

    Attributes
    ----------
    values
        The history that is set, shape (n,): first that of the obstacles
        and springs, then that of the beams.
    span
        Time since then, shape (1,), for laws with rates; 0 in statics.
    lasting, dissipates
        True if steps change it; if energy may be lost by that.
    """

    def __init__(self, forces: Forces, beams: Sequence[Beam]) -> None:
        self._forces, contacts = forces, forces.contacts
        self._contacts = contacts
        first = contacts.tables.memory.size if contacts.keeps else 0
        self.values, self.span = np.zeros(first), np.zeros(1)
        if first:
            contacts.tables = contacts.tables._replace(memory=self.values[:first])
        self.lasting = contacts.tables.lasting > 0
        self.dissipates = contacts.tables.lasting not in (0, TURNS)

    @contextmanager
    def lent(self, history: Array | None = None, span: float = 0.0) -> Iterator[None]:
        """Context with the history of a state, or of the reference configuration for None."""
        before = self.values.copy(), self.span.copy()
        try:
            self.put(history)
            self.span[0] = span
            yield
        finally:
            self.values[:], self.span[:] = before

    def put(self, history: Array | None) -> None:
        """Set a history; None for that of the reference configuration."""
        self.values[:] = 0.0 if history is None else history

    def get(self) -> Array | None:
        """A copy of the history that is set; None if nothing has happened."""
        return self.values.copy() if self.values.size and self.values.any() else None

    def begin(self, u: Array, t: float, history: Array | None = None) -> Array | None:
        """Set the history of a start at u and t, or a given one; returns it.

        Without a given one, friction begins at u.
        """
        self.put(history)
        if self._contacts.obstacles:
            self._contacts.begin(u, t, history is None)
        return self.get()

    def accept(self, u0: Array, u: Array, t: float) -> float:
        """Set the history after an increment in statics from u0 to u; returns what it dissipates.
        """
        return self._forces.settle(u, t)

    def of_state(self, state: Any) -> Array | None:
        """The history of a State, as far as the obstacles are those of its scene, or None."""
        if state is None or state.memory is None:
            return None
        ours, theirs = self._contacts.tables, state.system.forces.contacts.tables
        same = np.array_equal(ours.ints, theirs.ints) and np.array_equal(ours.floats, theirs.floats)
        return state.memory if same else None
