"""Unit length of the director of a rigid body."""

from __future__ import annotations

import numpy as np

from ...beam.rigid import RigidBody
from ...core.types import Array
from .base import Joint


class UnitDirector(Joint):
    """(d . d - 1) / 2 = 0 for the director d of a rigid body, whose first DOF is ``first``."""

    equations = ("length of the director",)
    constant = False

    def __init__(self, body: RigidBody, first: int) -> None:
        self.name = body.name
        self.dofs, self.start = first + 2 + np.arange(2), body.q0[2:]

    def value(self, u: Array, t: float) -> Array:
        du = u[self.dofs]  # d . d = 1 in the reference configuration
        return np.array([self.start @ du + 0.5 * (du @ du)])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return np.zeros(2, dtype=int), self.dofs, self.start + u[self.dofs]

    def curvature(self, u: Array, t: float, multipliers: Array) -> tuple[Array, Array, Array]:
        return self.dofs, self.dofs, np.full(2, multipliers[0])
