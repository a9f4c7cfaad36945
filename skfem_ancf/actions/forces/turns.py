"""Rotations of rigid bodies and of sections with moments, with full turns."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from ...core.types import Array
from ..loads import EndMoment


class Turns:
    """Rotations of sections with moments, then those of rigid bodies.

    A displacement defines them up to full turns. They are tracked over a sequence of displacements
    with changes of less than half a turn.
    """

    def __init__(self, system: Any) -> None:
        self._system = system
        self._loads = [cast("EndMoment", load) for load in system.loads if load.turning]
        self.moments, self.number = len(self._loads), len(self._loads) + len(system.bodies)
        pack = system.backend.tables.plain.loads.moments
        first = np.array([system.of(body).start for body in system.bodies], dtype=int)
        directions = np.array([body.q0[2:] for body in system.bodies]).reshape(-1, 2)
        self._groups = [(pack.dofs, pack.c, pack.start), (
            first[:, None, None] + [[2], [3]], np.ones((len(first), 1)), directions)]

    def angles(self, u: Array) -> Array:
        """Rotations at displacements (n, N) in (-pi, pi]: (n, k)."""
        found = [np.zeros((len(u), 0))]
        for dofs, c, start in self._groups:
            d = start + np.einsum("nkim,km->nki", u[:, dofs], c)
            found.append(np.arctan2(start[:, 0] * d[..., 1] - start[:, 1] * d[..., 0],
                                    start[:, 0] * d[..., 0] + start[:, 1] * d[..., 1]))
        return np.concatenate(found, axis=1)

    def begin(self, u: Array) -> Array:
        """Rotations at a displacement (N,) without history, shape (k,)."""
        counted = [load.angle(u[self._system.of(load)]) for load in self._loads]
        return np.append(counted, self.angles(u[None])[0, self.moments:])

    def follow(self, last: Array, u: Array) -> Array:
        """Rotations at successive displacements."""
        if not self.number:
            return np.zeros((len(u), 0))
        return np.unwrap(np.vstack([last, self.angles(u)]), axis=0)[1:]
