"""A load that load factors do not scale, as a force element."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...beam.layout import Layout
from ...core.types import Array
from ..places import Vector
from .base import ForceElement


class Unscaled(ForceElement):
    """A bound ``load`` on the degrees of freedom of its beam, in a scene with a ``layout``."""

    distributed, resists = True, False

    def __init__(self, load: Any, layout: Layout) -> None:
        self.load, self.symmetric, self.name = load, load.symmetric, load.name
        self._key, beam = load._key, load.beam
        self.along, dofs = (beam, [], ()), layout.offset(beam) + np.arange(beam.N).reshape(-1, 2, 1)
        self.links = [Vector(np.zeros(2), pair, 1.0) for pair in dofs]
        i, j, _ = self._entries(np.zeros(beam.N))
        self.entries = np.array(i), np.array(j)

    def _entries(self, u, t=0.0):
        none = np.zeros(0, dtype=int)
        return (none, none, 0.0 * none) if self.load.constant else (
            self.load.acting(t)[1].stiffness(u))

    def force(self, x: Array, v: Array, t: float) -> Array:
        return self.load.acting(t)[1].force(x.ravel()).reshape(-1, 2)

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        if np.array_equal(x, y):
            return self.force(x, x, t)
        return self.load.acting(t)[1].mean_force(x.ravel(), y.ravel()).reshape(-1, 2)

    def potential_at(self, x: Array, t: float) -> float | None:
        return self.load.acting(t)[1].potential(x.ravel())

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        return self._entries(x.ravel(), t)[2]

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        return 0.0 * self.stiffness(x, v, t)

    def __repr__(self) -> str:
        return repr(self.load)
