"""Functions of time, asked for many steps at once."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.frozen import read_only
from .rates import (END, MIDDLE, PARTS, RATE, JointMotion, JointMotions, of_step, steps_of,
                    times_beside)
from .steps import Course

if TYPE_CHECKING:
    from ..equations.system import System


class Courses:
    """Gives the :class:`~skfem_ancf.dynamics.steps.Course` of a block of steps.

    Parameters
    ----------
    conserving
        The equation of motion holds in the middle of a step, not at its end.

    Attributes
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    """

    system: System

    def __init__(self, conserving: bool) -> None:
        self._conserving = conserving
        self._asked: Any = None, None
        self._beside: Any = None, None

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
        # what is given to functions of others and to texts is theirs
        times, instants = (x.copy() for x in _times(start, dt, first, last, limit,
                                                    self._conserving))
        joints = self._ask_joints(times)
        if joints is not None:
            self._beside = (start + dt * first, dt, True, limit), joints[:PARTS + 1]
            joints = steps_of(joints)
        return Course(float(dt), instants, self.system.machine.tables.factors(instants[:, 1]),
                      self._supports(times, dt), self._joints(joints, dt))

    def _supports(self, times, dt):
        s = self.system
        if not s.constraints.moves:
            return np.zeros((1, 3, s.N))
        found = of_step(dt)[END:] @ steps_of(s.constraints.values_at(times))
        out = np.zeros((len(found), 3, s.N))
        out[:, :, s.constraints.fixed] = found
        return out

    def asked(self, t: float, dt: float, ahead: bool, limit: float) -> Any:
        """Functions of joints within one step, shape (PARTS + 1, k); None where all are steady.

        Parameters
        ----------
        t, dt, ahead, limit
            As of :func:`~skfem_ancf.dynamics.rates.times_beside`.
        """
        beside = t, dt, ahead, limit
        if self._beside[0] != beside:
            self._beside = beside, self._ask_joints(times_beside(*beside))
        return self._beside[1]

    def joints(self, t: float, dt: float, ahead: bool, limit: float) -> JointMotion:
        """What of joints depends on time, at one time.

        Parameters
        ----------
        t, dt, ahead, limit
            As of :meth:`asked`.
        """
        asked = self.asked(t, dt, ahead, limit)
        found = self._joints(asked if asked is None else asked[None, ::-1], -dt if ahead else dt)
        return JointMotion(found.c[0], found.g[0], found.drives)

    def _ask_joints(self, times):
        """c and g at the times, as of ``Tables.driven``; None where they are no tables, or steady.
        """
        tables = self.system.machine.tables
        if not tables.motion_varies or tables.plain.joints.own:
            return None
        return tables.driven(times)

    def _joints(self, asked, dt):
        """Of what :meth:`_ask_joints` gave in each step, in the order of time."""
        tables = self.system.machine.tables
        c, g = tables.still
        if asked is not None:
            found, m = _weights(dt, self._conserving) @ asked, c.shape[2]
            c = found[:, :3, :m].copy()
            if tables.turns:
                g = found[:, 3:, m:].copy()
        return JointMotions(c, g, int(tables.motion_varies))


@lru_cache(16)
def _times(start, dt, first, last, limit, conserving):
    """Times in the steps of a block, and two of each step: its end, and when forces act."""
    times = start + dt * (first + np.arange(PARTS * (last - first) + 1) / PARTS)
    times = np.minimum(times, limit)
    return read_only(times), read_only(np.array([
        times[PARTS::PARTS], times[PARTS // 2 if conserving else PARTS::PARTS]]).T)


@lru_cache(16)
def _weights(dt, conserving):
    """Rows of :func:`~skfem_ancf.dynamics.rates.of_step` for c of joints, and behind them for g."""
    acting = MIDDLE if conserving else END
    return of_step(dt)[[END, RATE, RATE + 1, END, acting, RATE, RATE + 1]]


def _rows(x, part):
    """A part of the rows of an array, or its only one."""
    return x if len(x) == 1 else x[part]
