"""Joint constraints at one instant: gap, Jacobian and rates."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ..actions.tables import constraint, joint_directions
from ..core.types import Array
from ..equations.system import System
from .course import rates
from .rates import JointMotion, acceleration_of_joints, drive_rate


class Joined:
    """The joints at a displacement and a time."""

    def __init__(self, system: System, motion: JointMotion, u: Array,
                 instant: tuple[float, float, bool, float]) -> None:
        self._system, self._u, self._instant = system, u, instant
        self._tables = system.backend.tables.plain.joints
        if self._tables.custom and motion.drives:
            c = rates(lambda times: np.array([system.constraints.constraint(u, t)
                                              for t in times]), *instant)
            motion = JointMotion(np.vstack([motion.c[:1], c]), motion.g, 0)
        self._motion = motion

    def gap(self) -> Array:
        """Phi, shape (m,)."""
        out, motion = np.empty(self._system.constraints.m), self._motion
        constraint(self._tables, motion.c[0], motion.g[0], self._instant[0], self._u, out)
        return out

    @cached_property
    def J(self) -> Any:
        """The Jacobian of Phi, shape (m, N), dense or sparse."""
        s = self._system
        if not s.constraints.few:
            return s.constraints.sparse_jacobian(self._u, self._instant[0])
        J = np.empty((s.constraints.m, s.N))
        joint_directions(self._tables, self._motion.g[0], self._instant[0], self._u, J)
        return J

    def rate(self, v: Array) -> Array:
        """The first rate of Phi, shape (m,)."""
        out, (t, dt, *_) = np.empty(self._system.constraints.m), self._instant
        drive_rate(self._tables, self._motion, t, dt, self._u, out)
        return out + self.J @ v

    def bend(self, v: Array, a: Array) -> Array:
        """The second rate of Phi, shape (m,)."""
        s, out, (t, dt, *_) = self._system, np.empty(self._system.constraints.m), self._instant
        acceleration_of_joints(self._tables, self._motion, t, dt, self._u, v, out)
        if self._tables.custom and s.constraints.drives:
            out += 2.0 * rates(lambda times: np.array([
                s.constraints.full_jacobian(self._u, t) @ v for t in times]), *self._instant)[0]
        return out + self.J @ a
