"""Forces in springs, of states and histories."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..actions.forces.springs import spring_force, spring_of


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
