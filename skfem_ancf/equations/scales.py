"""Energy scales of a scene, for round-off."""

from __future__ import annotations

from functools import cached_property
from math import sqrt
from typing import Any
from weakref import proxy

import numpy as np

EPS = float(np.finfo(float).eps)


class Scales:
    """Energy scales of a system that do not depend on a displacement."""

    def __init__(self, system: Any) -> None:
        self._system = proxy(system)

    @cached_property
    def energy_of_strains(self) -> float:
        """Modulus times volume, or :attr:`energy_of_bodies`."""
        s = self._system
        return (sum(b.kernel.scale for b in s.beams) + sum(d.scale for d in s.domains)
                or self.energy_of_bodies)

    @cached_property
    def energy_of_bodies(self) -> float:
        """Energy scale of springs and loads for rigid bodies alone, else 0; 1 without any force."""
        s = self._system
        if s.beams or s.domains:
            return 0.0
        springs = abs(s.stiffness_at_rest())
        force = np.max(np.abs(s.external_force(np.zeros(s.N))))
        stiffness = springs.max() if springs.nnz else 0.0
        return float(stiffness * s.size**2 + force * s.size) or 1.0

    @cached_property
    def strain_noise(self) -> float:
        """Root of the energy of strains of size eps: eps sqrt(modulus times volume)."""
        return EPS * sqrt(self.energy_of_strains)

    @cached_property
    def work_noise(self) -> float:
        """Root of the work of a correction that is round-off.

        The round-off of displacements is eps times the size of the scene, that of their gradients
        is larger by one over the length of an element.
        """
        s = self._system
        if not s.beams and not s.domains:
            return self.strain_noise
        total = sum(b.kernel.scale / float(b.mesh.lengths.sum())
                    * float(np.add.reduce(1.0 / b.mesh.lengths)) for b in s.beams)
        total += sum(float(abs(d.matrix().diagonal()).sum()) for d in s.domains)
        return EPS * s.size * sqrt(total)

    @cached_property
    def force_noise(self) -> float:
        """:attr:`work_noise` of a residual, which sums the round-off of all DOFs of a node."""
        return self.work_noise * sqrt(max(b.nd for b in self._system.members))

    @cached_property
    def bending_eigenvalue(self) -> float:
        """omega^2 of the slowest bending of a beam as long as the scene, about.

        For rigid bodies, that of their total mass on one spring of the scene's stiffness.
        """
        s = self._system
        if not s.beams:
            mass = sum(body.total_mass for body in s.members)
            return self.energy_of_strains / (mass * s.size**2) or 1.0
        stiffness = min(b.across.bending_over_mass() for b in s.beams)
        return stiffness * (np.pi / s.size) ** 4

    @cached_property
    def inertia_of_places(self) -> float:
        """Mass times squared positions, for the round-off of joints of bodies and of motions."""
        s = self._system
        if not s.bodies and not s.constraints.drives:
            return 0.0
        turn = np.concatenate([b.rigid_motions() @ (-b.origin[1], b.origin[0], 1.0)
                               for b in s.members])
        return float(turn @ s.mass.multiply(turn))
