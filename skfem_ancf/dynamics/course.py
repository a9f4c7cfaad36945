"""Functions of time, asked for many steps at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .rates import (END, MIDDLE, PARTS, RATE, JointMotion, JointMotions, of_step, steps_of,
                    times_beside)
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
        self._begin: Any = None, None

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
        instants = np.empty((last - first, 2))
        instants[:, 0] = times[PARTS::PARTS]
        instants[:, 1] = times[PARTS // 2 if self._conserving else PARTS::PARTS]
        joints = self._ask_joints(times)
        self._begin = (times[0], dt, limit), [f[:PARTS + 1] for f in joints]
        return Course(float(dt), instants, self._system.machine.tables.factors(instants[:, 1]),
                      self._supports(times, dt), self._joints([*map(steps_of, joints)], dt))

    def _supports(self, times, dt):
        s = self._system
        if not s.moves:
            return np.zeros((1, 3, s.N))
        found = of_step(dt)[END:] @ steps_of(s.values_at(times))
        out = np.zeros((len(found), 3, s.N))
        out[:, :, s.fixed] = found
        return out

    def joints(self, t: float, dt: float, ahead: bool, limit: float) -> JointMotion:
        """What of joints depends on time, at one time.

        Parameters
        ----------
        t, dt, ahead, limit
            As of :func:`~skfem_ancf.dynamics.rates.times_beside`.
        """
        if ahead and self._begin[0] == (t, dt, limit):
            asked = self._begin[1]
        else:
            asked = self._ask_joints(times_beside(t, dt, ahead, limit))
        found = self._joints([f[None, ::-1] for f in asked], -dt if ahead else dt)
        return JointMotion(found.c[0], found.g[0], found.drives)

    def _ask_joints(self, times):
        """c and g at the times, each where it depends on them; of joints that are tables."""
        tables = self._system.machine.tables
        if not tables.motion_varies or tables.plain.joints.own:
            return []
        return [tables.offsets(times), *([tables.slopes(times)] if tables.turns else ())]

    def _joints(self, asked, dt):
        """Of what :meth:`_ask_joints` gave in each step, in the order of time."""
        tables = self._system.machine.tables
        c, g = tables.still
        if asked:
            weights = of_step(dt)
            c = weights[END:] @ asked[0]
            if len(asked) > 1:
                acting = MIDDLE if self._conserving else END
                g = weights[[END, acting, RATE, RATE + 1]] @ asked[1]
        return JointMotions(c, g, int(tables.motion_varies))


def _rows(x, part):
    """A part of the rows of an array, or its only one."""
    return x if len(x) == 1 else x[part]
