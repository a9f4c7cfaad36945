"""Functions of time, asked for many steps at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .rates import PARTS, JointMotions, step_rates
from .steps import Course

if TYPE_CHECKING:
    from ..system import System


class Courses:
    """Gives the :class:`~skfem_ancf.dynamics.steps.Course` of a block of steps.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    conserving
        The equation of motion holds in the middle of a step, not at its end.
    """

    def __init__(self, system: System, conserving: bool) -> None:
        self._system, self._conserving = system, conserving
        self._asked: Any = None, None

    def of(self, start: float, dt: float, first: int, n: int, block: tuple[int, int],
           limit: float) -> Course:
        """For some steps.

        Parameters
        ----------
        start, first
            The first step begins at ``start + first dt``.
        dt, n
            Size and number of the steps.
        block
            Numbers of steps between which functions are asked at once, so that what they return
            does not depend on ``first`` and ``n``.
        limit
            Time beyond which no function is asked.

        Returns
        -------
        Course
        """
        key = start, dt, *block, limit
        if self._asked[0] != key:
            self._asked = key, self._ask(*key)
        whole: Course = self._asked[1]
        if block[1] - block[0] == n:
            return whole
        part = slice(first - block[0], first - block[0] + n)
        joints = whole.joints
        return whole._replace(
            times=whole.times[part], factors=_rows(whole.factors, part),
            supports=_rows(whole.supports, part),
            joints=JointMotions(_rows(joints.c, part), _rows(joints.g, part), joints.drives))

    def _ask(self, start, dt, first, last, limit):
        times = start + dt * (first + np.arange(PARTS * (last - first) + 1) / PARTS)
        times = np.minimum(times, limit)
        ends = times[PARTS::PARTS]
        acting = times[PARTS // 2::PARTS] if self._conserving else ends
        return Course(float(dt), np.stack([ends, acting], axis=1),
                      self._system.machine.tables.factors(acting), self._supports(times, dt),
                      self._joints(times, dt))

    def _supports(self, times, dt):
        s = self._system
        if not s.moves:
            return np.zeros((1, 3, s.N))
        _, *found = step_rates(s.values_at, times, dt)
        out = np.zeros((len(found[0]), 3, s.N))
        out[:, :, s.fixed] = np.stack(found, axis=1)
        return out

    def _joints(self, times, dt):
        tables = self._system.machine.tables
        joints, drives = tables.plain.joints, int(tables.motion_varies)
        c, g = np.zeros((1, 3, self._system.m)), np.zeros((1, 4, len(joints.gk)))
        if joints.own or not self._system.m:  # asked by the step itself
            return JointMotions(c, g, drives)
        if drives:
            _, *found = step_rates(tables.offsets, times, dt)
            c = np.stack(found, axis=1)
        else:
            c[:, 0] = tables.offsets(times[:1])
        if drives and tables.turns:
            middle, end, *found = step_rates(tables.slopes, times, dt)
            g = np.stack([end, middle if self._conserving else end, *found], axis=1)
        else:
            g[:, :2] = tables.slopes(times[:1])
        return JointMotions(c, g, drives)


def _rows(x, part):
    """A part of the rows of an array, or its only one."""
    return x if len(x) == 1 else x[part]
