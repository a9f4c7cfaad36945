"""The internal force of a domain as a force element."""

from __future__ import annotations

import numpy as np

from ...beam.domain import Domain
from ...core.types import Array
from ..places import Vector
from .base import ForceElement


class DomainForce(ForceElement):
    """Internal force and tangent of a ``domain``, whose first DOF is ``first``, bound."""

    internal, resists = True, False

    def __init__(self, domain: Domain, first: int) -> None:
        self.domain, self.symmetric, self.name = domain, domain.symmetric, domain.name
        self.entries = domain.pattern
        self.links = [Vector(np.zeros(2), first + k + np.arange(2)[:, None], 1.0)
                      for k in range(0, domain.N, 2)]

    def force(self, x: Array, v: Array, t: float) -> Array:
        return -self.domain.force(x.ravel()).reshape(x.shape)

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        if np.array_equal(x, y):
            return self.force(x, 0.0 * x, t)
        return -self.domain.mean_force(x.ravel(), y.ravel()).reshape(x.shape)

    def potential_at(self, x: Array, t: float) -> float | None:
        return self.domain.energy(x.ravel()) if self.symmetric else None

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        return -self.domain.stiffness(x.ravel())

    def __repr__(self) -> str:
        return repr(self.domain)
