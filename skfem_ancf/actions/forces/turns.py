"""Angles of rigid bodies, and of sections on which moments act, with their whole turns."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from ...core.types import Array
from ..loads import EndMoment


class Turns:
    """The angles of a system by which moments have turned, and those of its rigid bodies.

    A displacement has them up to whole turns. They are followed from one to the next, between which
    none changes by more than half a turn. Those of moments come first, in the order of the loads.
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
        """Angles from the reference configuration at displacements (n, N), in (-pi, pi]: (n, k)."""
        found = [np.zeros((len(u), 0))]
        for dofs, c, start in self._groups:
            d = start + np.einsum("nkim,km->nki", u[:, dofs], c)
            found.append(np.arctan2(start[:, 0] * d[..., 1] - start[:, 1] * d[..., 0],
                                    start[:, 0] * d[..., 0] + start[:, 1] * d[..., 1]))
        return np.concatenate(found, axis=1)

    def begin(self, u: Array) -> Array:
        """The angles at a displacement (N,) of which nothing is known before, shape (k,)."""
        counted = [load.angle(u[self._system.of(load)]) for load in self._loads]
        return np.append(counted, self.angles(u[None])[0, self.moments:])

    def follow(self, last: Array, u: Array) -> Array:
        """The angles at displacements one after the other."""
        if not self.number:
            return np.zeros((len(u), 0))
        return np.unwrap(np.vstack([last, self.angles(u)]), axis=0)[1:]
