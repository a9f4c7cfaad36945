"""Histories: what the forces of a scene remember of its past."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

import numpy as np

from ..actions.contact.tables import TURNS
from ..actions.forces.system import Forces
from ..beam.beam import Beam
from ..beam.kernels.histories import ElementsWithHistory, history_size
from ..beam.remembered import remembers, with_history
from ..core.errors import InputError
from ..core.types import Array


class Histories:
    """The history of a scene: anchors and multipliers of obstacles, whole turns of torsional
    springs, variables of materials and of user-defined items.

    A history is a value, an array (n,). Forces, tangents and energies depend on the one that is
    set, and do not change it; :meth:`accept` replaces it at the end of an increment. To start again
    is to set the old one. States, histories and checkpoints store it.

    Attributes
    ----------
    values
        The history that is set, shape (n,); its parts are ``of_forces``, of obstacles and springs,
        ``of_beams``, and those of items with a memory. ``rest`` is that at rest.
    span
        Time since then, shape (1,), for laws with rates; 0 at once.
    lasting, dissipates, evolve
        True if steps change it; if energy may be lost by that; if a material or item has one.
    """

    def __init__(self, forces: Forces, beams: Sequence[Beam], slices: Sequence[slice]) -> None:
        self._forces, self._contacts, self._increment = forces, forces.contacts, 0.0
        contacts, some = forces.contacts, [
            (beam, s) for beam, s in zip(beams, slices) if remembers(beam)]
        first = contacts.tables.memory.size if contacts.keeps else 0
        sizes = [sum(map(history_size, beam.kernel.tables)) for beam, _ in some]
        self._items, end = forces.remembering, first + sum(sizes)
        self.values = np.concatenate([np.zeros(end), *(item.start for item in self._items)])
        self.rest, self.span = self.values.copy(), np.zeros(1)
        self.of_forces, self.of_beams = self.values[:first], self.values[first:end]
        if first:
            contacts.tables = contacts.tables._replace(memory=self.of_forces)
        self.evolve = bool(some or self._items)
        self.lasting = contacts.tables.lasting > 0 or self.evolve
        self.dissipates = contacts.tables.lasting not in (0, TURNS) or self.evolve
        self._parts, self._kernels, at = dict[Any, slice](), dict[int, Any](), first
        self._beams, self._all = some, list(beams)
        for (beam, _), n in zip(some, sizes):
            self._parts[id(beam)] = part = slice(at, at + n)
            self._kernels[id(beam)] = beam.kernel.remembering(self.values[part], self.span)
            at += n
        for item in self._items:
            self._parts[item.element._key] = part = slice(at, at + len(item.start))
            item.remember(self.values[part], self.span)
            at = part.stop

    def kernel(self, beam: Beam) -> Any:
        """The kernel of a beam with the history that is set."""
        return self._kernels.get(id(beam)) or beam.kernel

    def beam(self, beam: Beam, state: Any) -> Beam:
        """A beam with the history of a State, for stress and element forces.

        It is the beam itself if its laws have no history.
        """
        history = (state.base or state).memory
        if id(beam) not in self._parts:
            return beam
        part = self._parts[id(beam)]
        return with_history(beam, np.zeros(part.stop - part.start) if history is None else
                            np.array(history[part]))

    def lent(self, history: Array | None = None, span: float = 0.0
             ) -> AbstractContextManager[None]:
        """Context with the history of a state, or of the reference configuration for None.

        ``span`` is the time of an increment from there.
        """
        return self._lent(history, span) if self.values.size else nullcontext()

    @contextmanager
    def _lent(self, history: Array | None, span: float) -> Iterator[None]:
        before = self.values.copy(), self.span.copy(), self._increment
        try:
            self._increment = span
            self.put(history)
            yield
        finally:
            self.values[:], self.span[:], self._increment = before

    def put(self, history: Array | None, share: float = 1.0) -> None:
        """Set a history, or None, at the start of an increment.

        It takes a share of the time for which histories are lent.
        """
        self.values[:] = self.rest if history is None else history
        self.span[0] = share * self._increment

    def get(self) -> Array | None:
        """A copy of the history that is set; None if nothing has happened."""
        if not self.values.size or (self.values == self.rest).all():
            return None
        return self.values.copy()

    def begin(self, u: Array, t: float, history: Array | None = None) -> Array | None:
        """Set the history of a start at u and t, or a given one; returns it.

        Without a given one, friction begins at u, and materials in their natural state.
        """
        self.put(history)
        if self._contacts.obstacles:
            self._contacts.begin(u, t, history is None)
        return self.get()

    def accept(self, u0: Array, u: Array, t: float) -> float:
        """Set the history after an increment in statics from u0 to u; returns what it dissipates.
        """
        if not self.values.size:
            return 0.0
        lost = self._forces.settle(u, t) + sum(item.settle(u0, u, t) for item in self._items)
        for beam, s in self._beams:
            for e in self.kernel(beam).elements:
                if isinstance(e, ElementsWithHistory):
                    lost += e.accept(u0[s], u[s])
        return lost

    def after(self, start: Any, end: Any) -> Array | None:
        """The history at an equilibrium after one with ``u`` and ``history``, at once."""
        with self.lent(start.history):
            self.accept(start.u, end.u, end.load)
            return self.get()

    def of_state(self, state: Any) -> Array | None:
        """The history of a State, as far as obstacles and beams are those of its scene, or None."""
        if state is None or state.memory is None:
            return None
        theirs = state.system.histories
        if theirs is self:
            return state.memory
        out, known = self.rest.copy(), False
        a, b = self._contacts.tables, theirs._contacts.tables
        n = self.of_forces.size
        if n == theirs.of_forces.size and np.array_equal(a.ints, b.ints) and np.array_equal(
                a.floats, b.floats):
            out[:n], known = state.memory[:n], n > 0
        for part, other in self._shared(theirs):
            if part.stop - part.start == other.stop - other.start:
                out[part], known = state.memory[other], True
        return out if known else None

    def _shared(self, theirs):
        """Parts of the same items, and of the same beams: the objects, or those in the same place
        with such materials."""
        for key in (item.element._key for item in self._items):
            if key in theirs._parts:
                yield self._parts[key], theirs._parts[key]
        for k, beam in enumerate(self._all):
            other = beam if id(beam) in theirs._parts else (
                theirs._all[k] if k < len(theirs._all) else None)
            if id(beam) not in self._parts or id(other) not in theirs._parts:
                continue
            if _laws(beam) == _laws(other):
                yield self._parts[id(beam)], theirs._parts[id(other)]

    def require_none(self, scheme: Any, because: str) -> None:
        """Raise InputError if a material or a user-defined item has a history."""
        if self.evolve:
            one = [*(beam for beam, _ in self._beams), *self._items][0]
            raise InputError(f"{scheme!r} does not know histories, as that of {one!r}: {because}; "
                             "use 'energy-momentum' or 'generalized-alpha'")


def _laws(beam):
    """Kinds of the materials of a beam."""
    return [type(layer.material) for layer in beam.across.layers]
