"""The error of a motion, by another one in steps half as long."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..equations.stability import position_weights
from .base import Motion, contacts_of
from .integrator import Integrator, StepFailed

if TYPE_CHECKING:
    from ..equations.system import System
    from ..core.types import Array
    from .base import Scheme


class Companion:
    """Follows a motion from the same start, by two steps for each of its steps.

    With steps of half the size the error is a part ``2^-p`` of what it is, p the order, so that the
    difference of both motions is the part ``1 - 2^-p`` of the error that the whole motion has
    added up by then: whatever it comes from, and however it grows or decays. Where steps do not
    resolve what moves, the part is another one, but those of half the size are still nearer.

    Parameters
    ----------
    system, scheme, tol
        As of the :class:`~skfem_ancf.dynamics.integrator.Integrator` of the motion.

    Attributes
    ----------
    error
        By how far a node or a rigid body has been off so far, at the ends of steps, the farthest,
        over the size of the scene; NaN where steps half as long have failed.

    References
    ----------
    Shampine, Watts: "Global error estimation for ordinary differential equations", ACM Transactions
    on Mathematical Software 2 (1976).
    """

    def __init__(self, system: System, scheme: Scheme, tol: float | None) -> None:
        self.system, self.scheme = system, scheme
        self.integrator = Integrator.lent(system, scheme, tol)
        self.error = 0.0
        self._part = system.size * (1.0 - 0.5**scheme.order)
        self._places = np.nonzero(position_weights(system))[0]
        self._ends: list[Array] = []
        self._dt = self._t = 0.0

    def begin(self, y: Motion, energy: float, limit: float) -> None:
        """Begin where the motion does.

        Parameters
        ----------
        y
            Its start.
        energy, limit
            As its integrator has them: the largest seen, and the time before which functions of
            time are asked.
        """
        self.y = y
        self.integrator.expect(energy)
        self.integrator.limit = limit

    def follow(self, y: Motion, dt: float) -> None:
        """The motion has taken a step.

        Parameters
        ----------
        y
            Its end.
        dt
            Its size.
        """
        if self._ends and dt != self._dt or 2 * len(self._ends) >= self.integrator.longest - 1:
            self.catch_up()
        self._ends.append(y.u)
        self._dt, self._t = dt, y.t

    def turn(self, y: Motion, energy: float, limit: float) -> None:
        """The motion starts afresh, beyond a breakpoint.

        Parameters
        ----------
        y, energy, limit
            As of :meth:`begin`.
        """
        self.catch_up()
        own = self.y
        self.integrator.limit = limit
        self.begin(self.integrator.start(own.u, own.v, y.t, 0.5 * self._dt,
                                         memory=contacts_of(own)), energy, limit)

    def catch_up(self) -> None:
        """Go to where the motion is."""
        ends, self._ends = self._ends, []
        if not ends or np.isnan(self.error):
            return
        try:
            u = self._halves(2 * len(ends))
        except StepFailed:
            self.error = np.nan
            return
        off = (u - ends)[:, self._places].reshape(-1, 2)
        self.error = max(self.error, float(np.hypot(*off.T).max()) / self._part)
        self.y.t = self._t

    def _halves(self, n):
        """n steps: displacements after every second one, shape (n / 2, N)."""
        start, h, done, found = self.y.t, 0.5 * self._dt, 0, []
        while done < n:
            u, self.y = self._some(start, h, done, n)
            done += len(u)
            found.append(u)
        return np.concatenate(found)[1::2]

    def _some(self, start, h, done, n):
        """Displacements after the next steps, and the Motion after them.

        Where there are no blocks that is one step, cut if need be.
        """
        if self.scheme.in_blocks(self.system):
            taken = self.scheme.run(self.integrator, self.y, h, n - done, start, done, (0, n))
            if taken:
                return taken.rows[:len(taken), 0], taken[len(taken) - 1]
        y = self.integrator.step(self.y, h)
        return y.u[None], y


__all__ = ["Companion"]
