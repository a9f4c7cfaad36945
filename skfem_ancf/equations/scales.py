"""Energies of a scene by which round-off is judged."""

from __future__ import annotations

from functools import cached_property
from math import sqrt
from typing import Any
from weakref import proxy

import numpy as np

EPS = float(np.finfo(float).eps)


class Scales:
    """Energies of a system that no displacement enters, and the round-off that follows from them.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`, which has to live as long.
    """

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
        """What springs and loads do to rigid bodies over the scene's size; zero with others.

        One where there are neither: a mechanism that is driven, in which no force has a unit.
        """
        s = self._system
        if s.beams or s.domains:
            return 0.0
        springs = abs(s.stiffness_at_rest())
        force = np.max(np.abs(s.external_force(np.zeros(s.N))))
        stiffness = springs.max() if springs.nnz else 0.0
        return float(stiffness * s.size**2 + force * s.size) or 1.0

    @cached_property
    def strain_noise(self) -> float:
        """The root of the energy of strains that are round-off: eps times modulus times volume."""
        return EPS * sqrt(self.energy_of_strains)

    @cached_property
    def work_noise(self) -> float:
        """The root of the work of a correction that is round-off.

        A displacement of the scene's size is known to eps times that size, its gradient in an
        element to that over the element's length; the stiffness is that of the beam's mean section.
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
        """As :attr:`work_noise`, of a residual: it sums the round-off of all degrees of freedom."""
        return self.work_noise * sqrt(max(b.nd for b in self._system.members))

    @cached_property
    def bending_eigenvalue(self) -> float:
        """omega^2 of the slowest bending that a beam as long as the scene could have.

        Of rigid bodies alone that of all their mass on one spring, or swinging by all loads.
        """
        s = self._system
        if not s.beams:
            mass = sum(body.total_mass for body in s.members)
            return self.energy_of_strains / (mass * s.size**2) or 1.0
        stiffness = min(b.across.bending_over_mass() for b in s.beams)
        return stiffness * (np.pi / s.size) ** 4

    @cached_property
    def inertia_of_places(self) -> float:
        """The mass times places and directions, squared; zero where no joint knows them.

        Of rigid bodies, whose directions are unit vectors, and where functions of time are places:
        joints close to eps times these, however little has moved.
        """
        s = self._system
        if not s.bodies and not s.constraints.drives:
            return 0.0
        turn = np.concatenate([b.rigid_motions() @ (-b.origin[1], b.origin[0], 1.0)
                               for b in s.members])
        return float(turn @ s.mass.multiply(turn))
