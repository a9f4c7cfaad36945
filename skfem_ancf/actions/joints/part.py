"""Independent equations of a joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...beam.layout import Layout
from ...core.origin import ours
from ...core.types import Array
from .base import Joint


class Part(Joint):
    """The independent equations of a bound joint, by increasing numbers."""

    def __init__(self, joint: Joint, kept: Array) -> None:
        self.joint, self.kept = joint, kept
        self.equations = tuple(joint.equations[k] for k in kept)
        self.constant, self.moving, self.name = joint.constant, joint.moving, joint.name
        self.tabled = joint.tabled and ours(joint)
        self._number = np.full(len(joint.equations), -1)
        self._number[kept] = np.arange(len(kept))
        self._freeze()

    def __repr__(self) -> str:
        return repr(self.joint)

    def bind(self, layout: Layout) -> None:  # the joint is bound already
        pass

    def _of(self, rows: Array, *others: Array) -> tuple[Any, ...]:
        rows = self._number[rows]
        keep = rows >= 0
        return (rows[keep], *(x[..., keep] for x in others))

    def _all(self, multipliers: Array) -> Array:
        out = np.zeros(len(self._number))
        out[self.kept] = multipliers
        return out

    def value(self, u: Array, t: float) -> Array:
        return np.asarray(self.joint.value(u, t))[self.kept]

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.entries(u, t))

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        return self.joint.curvature(u, t, self._all(multipliers))

    def quadratic(self, u: Array, t: float, v: Array) -> Array:
        return self.joint.quadratic(u, t, v)[self.kept]

    def mean_entries(self, u0: Array, u1: Array, t: float) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.mean_entries(u0, u1, t))

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        return self.joint.mean_turning(u0, u1, v0, v1, t, self._all(multipliers))

    def lost(self, u: Array) -> str:
        return self.joint.lost(u)

    def offset(self, times: Array, N: int) -> Array:
        return self.joint.offset(times, N)[:, self.kept]

    @property
    def turning(self) -> bool:
        return self.joint.turning

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        return self._of(*self.joint.slope_entries(times, N))

    def second_entries(self, N: int) -> tuple[Array, Array, Array, Array]:
        return self._of(*self.joint.second_entries(N))
