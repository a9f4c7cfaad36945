"""Actions on the beams of a state, for :mod:`skfem_ancf.recovery`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import sparse

from ..actions.forces.base import Unscaled
from ..actions.forces.springs import spring_force, spring_of
from ..beam.beam import Beam
from ..beam.distribution import Sampled, station_of_node, stations_of_vector
from ..recovery.recovered import Recovery
from ..recovery.section_forces import NotRecovered, SectionForces


# forces in springs, of states and histories

class SpringForces:
    """The method of states and histories for forces in springs."""

    system: Any
    u: Any
    v: Any
    base: Any = None
    memory: Any = None
    _columns: Any

    def spring_force(self, spring: Any = 0) -> Any:
        """Tension of a spring, or moment of a torsional spring against its rotation.

        The force of the dashpot is included. A history returns an array of all instants, (nt,).

        Parameters
        ----------
        spring
            One of ``scene.elements``, or its number among the springs and torsional springs of the
            scene, in the order in which they were added.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1], 0.1), ElementBeamCable(5),
        ...             StVenantKirchhoff(1e9, 0.3), width=0.1)
        >>> scene = Scene(beam).pin("left").spring(100.0, ((1, 0), (1, 1)), length=0.9)
        >>> state = scene.line_load((0, -20.0)).solve_static()
        >>> round(state.spring_force(), 2)
        10.0
        """
        forces, base = self.system.forces, self.base
        found = spring_of(forces.elements, spring)

        def at(u, v, memory, start=None):
            with self.system.histories.lent(memory):
                forces.recall()
                return spring_force(found, u, v, start)

        if self.u.ndim > 1:
            memories = (one if one.size else None for one in self._columns["history"])
            return np.array([at(*row) for row in zip(self.u, self.v, memories)])
        return at(self.u, self.v, self.memory, None if base is None else base.u)


def stations(state: Any) -> list[list[float]]:
    """Axial coordinates (element + xi) of supports and joints, a list for each beam."""
    system = state.system
    fixed = np.zeros(system.N, dtype=bool)
    fixed[system.constraints.fixed] = True
    acting = system.forces.acting_rows()
    J = None
    if system.constraints.m or len(acting):
        u = state.u if state.base is None else state.base.u
        J = sparse.vstack([system.constraints.sparse_jacobian(
            u, state.load if state.t is None else state.t), acting]).tocsc()
    out: list[list[float]] = []
    for beam, s in zip(system.beams, system.slices):
        nodes = np.nonzero(np.any(fixed[s].reshape(-1, beam.nd), axis=1))[0]
        found = [station_of_node(beam.mesh, int(k)) for k in nodes]
        here = None if J is None else J[:, s]
        for row in () if here is None else here[np.unique(here.indices)].toarray():
            if np.any(row):
                # an equation between neighbouring nodes: at both
                loaded = np.nonzero(np.any(row.reshape(-1, beam.nd) != 0, axis=1))[0]
                found += (stations_of_vector(beam, row)
                          or [station_of_node(beam.mesh, int(k)) for k in loaded])
        out.append(found)
    return out


def distributed(state: Any, beam: Beam, unit: Any) -> tuple[list[Sampled], list[float]]:
    """Densities of distributed force elements, and the axial coordinates of concentrated ones."""
    system = state.system
    sampled: list[Sampled] = []
    places: list[float] = []
    elements = [e for e in system.forces.elements if e.distributed]
    if not elements:
        return sampled, places
    tables = system.backend.tables.plain.forces
    force = -(system.forces.part_forces(tables, state.u, state.v) if state.base is None else unit
              * system.forces.small_part_forces(tables, state.load, state.base.u,
                                                state.u - state.base.u))
    for element in elements:
        if element.along is None:
            raise NotRecovered(f"the distribution of {element!r} along the beam is not known")
        where, facets, at = element.along
        if where is not beam:
            continue
        places += at
        rows = system.forces.rows_of(element)
        for group in facets:
            w = np.linalg.solve(np.vander(group.xi, increasing=True).T,
                                1.0 / np.arange(1, len(group.xi) + 1))  # of its own rule
            values = force[:, rows[len(w) * group.chosen[:, None] + np.arange(len(w))]] / w
            sampled.append(Sampled(group.where, group.elements, group.xi, values))
    return sampled, places


def recover(states: Sequence[Any], number: int) -> list[Any]:
    """The Recovery of a beam at each of some states, or the NotRecovered why there is none."""
    found: list[Any] = [_section_forces(state, number) for state in states]
    known = [k for k, forces in enumerate(found) if not isinstance(forces, NotRecovered)]
    with np.errstate(all="ignore"):
        together = Recovery.together([found[k] for k in known],
                                     [states[k]._places_of(number) for k in known])
    for k, one in zip(known, together):
        found[k] = one
    return found


def _section_forces(state, number):
    beam, system, unit = state.beams[number], state.system, state._unit
    if state.base is not None and not np.iscomplexobj(unit):
        return NotRecovered("it is linearised about a state that is not free of load, a mode of "
                            "it: its strain and stress are those of the elements")
    s = system.of(beam)
    try:
        acting = [(unit * state.load, load, state.t) for load in system.loads]
        acting += [(unit, e.load, state.load if state.t is None else state.t)
                   for e in system.forces.elements if isinstance(e, Unscaled)]
        loads: list[Any] = []
        for scale, load, t in acting:
            if load.beam is beam:
                at_rest = state.base is not None and not load.first_order
                factor, now = load.acting(t)
                loads.append((scale * factor, now.distribution(
                    (state.base if at_rest else state).u_of(number))))
        sampled, places = distributed(state, beam, unit)
        acceleration = viscous = None
        if state.acceleration is not None:
            acceleration = unit * (
                state.acceleration + system.damping.mass * state.v
                + system.modal_damping.acceleration(state.v))[s]
        time = system.retardation[number]
        if state.t is not None and time:
            viscous = beam.kernel.viscous_forces(state.u[s], state.v[s], time)
        with np.errstate(all="ignore"):
            remembering = system.histories.beam(beam, state)
            return SectionForces(remembering, state._places_of(number), loads,
                                 [*state._stations[number], *places], acceleration, sampled,
                                 viscous)
    except NotRecovered as why:
        return why
