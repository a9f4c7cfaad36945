"""Histories: what the forces of a scene remember of its past."""

from collections.abc import Sequence
from copy import copy
from itertools import accumulate
from typing import Any

import numpy as np

from ..actions.contact.tables import TURNS
from ..actions.forces.system import Forces
from ..beam import Beam, remembers, with_history
from ..beam.kernels.kernel import ElementsWithHistory, Past, history_size
from ..core import Array, InputError
from ..materials.history import HistoryMaterial

#: A displacement or strain, and a time, at which what relaxes shows it.
SMALL, LONG = 1e-6, 1e12


class Histories:
    """The history of a scene: anchors and multipliers of obstacles, whole turns of torsional
    springs, variables of materials and of user-defined items.

    A history is a value, an array (n,), and the equations of a scene are functions of it:
    :meth:`skfem_ancf.equations.system.System.after` returns those after a history. States,
    histories and checkpoints store it; :meth:`accept` computes the next one at the end of an
    increment. ``values`` has the parts ``of_forces`` (obstacles and springs), ``of_beams``, a
    :class:`Past`, and items with a memory; ``span`` (1,) is the time since, for laws with rates.
    ``lasting`` is 1 if steps change it, 3 if that of materials, else 0; ``dissipates`` if energy
    may be lost, ``evolve`` if a material or item has a history, ``path_dependent`` if a material.
    Items with a memory begin at ``end``.
    """

    def __init__(self, forces: Forces, beams: Sequence[Beam], slices: Sequence[slice]) -> None:
        some = [(beam, s) for beam, s in zip(beams, slices) if remembers(beam)]
        first = forces.contacts.tables.memory.size if forces.contacts.keeps else 0
        sizes = [sum(map(history_size, beam.kernel.tables)) for beam, _ in some]
        items, self._beams, self._all = forces.remembering, some, list(beams)
        keys = [id(beam) for beam, _ in some] + [item.element._key for item in items]
        ends = list(accumulate([first, *sizes, *(len(item.start) for item in items)]))
        self._parts: dict[Any, slice] = {
            key: slice(a, b) for key, a, b in zip(keys, ends, ends[1:])}
        self.end = ends[len(some)]
        self.rest = np.concatenate([np.zeros(self.end), *(item.start for item in items)])
        self.path_dependent = bool(some)
        self.evolve = bool(some) or any(item.element.evolves for item in items)
        lasting = forces.contacts.tables.lasting
        self.lasting = int(lasting > 0 or bool(some or items)) + 2 * bool(some)
        self.dissipates = lasting not in (0, TURNS) or self.evolve
        self._have(forces, first, None, 0.0)

    def _have(self, forces, first, history, span):
        """Make arrays for a history, and the force elements that have it."""
        self.values, self.span = np.array(self.rest if history is None else history), np.zeros(1)
        self._now, self.of_forces = self.values.copy(), self.values[:first]
        self.of_beams = self._past(slice(first, self.end))
        self._kernels: dict[int, Any] = {}
        self.span[0] = span
        self.forces = forces
        if self.values.size:
            self.forces = forces.after(self.of_forces, [
                (self.values[self._parts[item.element._key]], self.span)
                for item in forces.remembering])

    def _past(self, part):
        return Past(self.values[part], self.span, self._now[part])

    def past(self, beam: Beam) -> Past | None:
        """That of the laws of a beam; None for elastic ones."""
        return self._past(self._parts[id(beam)]) if id(beam) in self._parts else None

    def after(self, history: Array | None, span: float = 0.0) -> "Histories":
        """A copy with another history, by default that at rest, and the time since."""
        other = copy(self)
        other._have(self.forces, self.of_forces.size, history, span)
        return other

    def of(self, forces: Forces) -> "Histories":
        """Those of some of the force elements, in the same arrays."""
        other = copy(self)
        other._have(forces, self.of_forces.size, None, 0.0)
        return other

    def kernel(self, beam: Beam) -> Any:
        """The kernel of a beam with this history."""
        past = self.past(beam)
        if past is None:
            return beam.kernel
        if id(beam) not in self._kernels:
            self._kernels[id(beam)] = beam.kernel.remembering(past)
        return self._kernels[id(beam)]

    def beam(self, beam: Beam) -> Beam:
        """A beam with this history, for stress and element forces."""
        # It is the beam itself if its laws have no history.
        past = self.past(beam)
        return beam if past is None else with_history(beam, past.history)

    def get(self) -> Array | None:
        """A copy of the history; None if nothing has happened."""
        if not self.values.size or (self.values == self.rest).all():
            return None
        return self.values.copy()

    def put(self, history: Array | None) -> None:
        """Write a history into these arrays, as the kernels of steps do."""
        self.values[:], self.span[0] = self.rest if history is None else history, 0.0
        self._now[:] = self.values

    def begin(self, u: Array, t: float, anew: bool) -> Array | None:
        """The history of a start at u and t; ``anew``, friction begins at u."""
        if self.forces.contacts.obstacles:
            self.forces.contacts.begin(u, t, anew)
        return self.get()

    def sampled(self, u: Array, v: Array, t: float, history: Array | None,
                first: bool) -> Array | None:
        """A history after what controllers measure at t, if it is time to; ``first``, all do."""
        if not self.forces.sampled:
            return history
        now = self.after(history)
        if history is None:
            now.begin(u, t, True)
        for item in now.forces.sampled:
            item.sample(u, v, t, first)
        return now.values

    def accept(self, u0: Array, u: Array, t: float) -> tuple[Array | None, float]:
        """The history after an increment in statics from u0 to u, and what it dissipates."""
        if not self.values.size:
            return None, 0.0
        lost = self.forces.settle(u0, u, t)
        for beam, s in self._beams:
            for e in self.kernel(beam).elements:
                if isinstance(e, ElementsWithHistory):
                    lost += e.accept(u0[s], u[s])
        return self.get(), lost

    def relaxing(self) -> list[Any]:
        """Materials and items whose force changes while nothing moves."""
        out: list[Any] = []
        for material in {layer.material for beam, _ in self._beams for layer in beam.across.layers}:
            if isinstance(material, HistoryMaterial):
                rest = SMALL * np.ones((3, 1)), np.zeros((material.number, 1))
                out += [material] * _differ(*(material.stress(*rest, dt)[0] for dt in (0.0, LONG)))
        for item in self.forces.remembering:
            if not item.changing:
                x = np.array([link.start for link in item.links])
                out += [item] * _differ(*(item.evaluate(x + SMALL, 0.0 * x, 0.0, dt)[0]
                                          for dt in (0.0, LONG)))
        return out

    def relaxed(self, u: Array) -> Array | None:
        """The history with contact between members no stiffer than it needs to be at u."""
        for item in self.forces.remembering:
            item.relax(u)
        return self.get()

    def of_state(self, state: Any) -> Array | None:
        """The history of a State, as far as items and kinds of laws are equal, or None."""
        if state is None or state.memory is None:
            return None
        theirs = state.system.histories
        if theirs._parts is self._parts:
            return state.memory
        now, then = self.after(None), theirs.after(state.memory)
        known = bool(self.values.size) and now.forces.take_over(then.forces, state.u,
                                                                state.t or 0.0)
        for beam, other in zip(self._all, theirs._all):
            old, new = (of._parts.get(id(b), slice(0)) for of, b in ((theirs, other), (self, beam)))
            given = state.memory[old]
            if len(given) == new.stop - (new.start or 0) and _laws(beam) == _laws(other):
                now.values[new], known = given, known or len(given) > 0
            elif np.any(given):
                names = ", ".join(str(layer.material) for layer in other.across.layers)
                raise InputError(
                    f"{beam!r} cannot take over the history of the state, which is that of "
                    f"{names}: without it, what is bent would spring back. Keep the kinds "
                    "of materials, and their points=; or begin with its displacements alone, "
                    "start=scene.state(state.u)")
        return now.values if known else None


def _differ(a, b):
    return not np.allclose(a, b, rtol=1e-6, atol=1e-6 * np.max(np.abs(a)))


def _laws(beam):
    """Kinds of the materials of a beam."""
    return [type(layer.material) for layer in beam.across.layers]
