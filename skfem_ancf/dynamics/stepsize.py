"""Automatic step size."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.types import Array
from ..equations.system import System
from .base import Motion, Scheme
from .time_functions import Lookahead
from .integrator import Integrator

#: Largest error of a point over the root mean square: the tip of a cantilever moves twice as far as
#: the mean, and errors grow with time.
LARGEST = 3.0
#: Fraction of ``rtol`` that a single step may add.
SINGLE = 0.1
#: Relative error above which a step is repeated.
REJECTED = 1.2
#: Growth of the step size below which the size, and the factors, stay.
WORTH = 1.3
#: Error relative to the motion so far, over ``rtol``, where that is small beside the scene.
OF_MOTION = 100.0
#: Size of a motion at rest, over that of the scene.
AT_REST = 1e-7


class StepSize:
    """Chooses steps so that the error of every point is about ``rtol`` times the size of the scene.

    For motions that are small beside the scene it is :data:`OF_MOTION` times ``rtol`` of the
    largest displacement since the start, a root mean square as the error is.

    A step may add an error in proportion to its size (error per unit step). The error is a root
    mean square weighted by mass, times :data:`LARGEST`. Parts of the estimate that do not
    accumulate are removed:

    * what supports and joints undo (a single step counts in full),
    * what the step does not resolve, by the iteration matrix as a filter,
    * what is damped, in collocation,
    * in schemes of second order, vibrations whose phase is lost anyway, by two running averages
      over the time W. After the time T a vibration of frequency w has the phase error C w^3 dt^2 T,
      so W = (C dt^2 T)^(1 / 3) / 2.

    References
    ----------
    Error per unit step: Hairer, Norsett, Wanner: "Solving ordinary differential equations I",
    II.4. The first filter: Shampine, Baca: "Error estimators for stiff differential equations",
    Journal of Computational and Applied Mathematics 11 (1984).
    """

    def __init__(self, system: System, scheme: Scheme, rtol: float, t_start: float,
                 t_end: float) -> None:
        if not scheme.adaptive:
            raise InputError(f"{scheme!r} does not estimate its error: give a step size dt, or use "
                             "a scheme of the package, all of which support dt='auto'")
        self.system, self.scheme, self.rtol = system, scheme, rtol
        self.span, self._averaged = t_end - t_start, scheme.order <= 2
        self._mass = sum(b.total_mass for b in system.members)
        self._averages = self._new = np.zeros((2, system.N))
        self._origin, self._moved = np.zeros(0), 0.0
        self.cut = Lookahead(system, t_start, t_end).cut

    def _mean(self, du):
        """The root mean square of a displacement over the size of the scene."""
        return (np.sqrt(max(du @ self.system.mass.multiply(du), 0.0) / self._mass)
                / self.system.size)

    def _scale(self, old, new):
        """The size to which errors refer, over that of the scene."""
        if not self._origin.size:
            self._origin = old.u
        self._moved = max(self._moved, self._mean(old.u - self._origin))
        moved = max(self._moved, self._mean(new.u - self._origin))
        return min(1.0, OF_MOTION * max(AT_REST, moved))

    def error(self, integrator: Integrator, old: Motion, new: Motion, dt: float) -> float:
        """The error that a step adds, over what it may add."""
        de = self.scheme.local_error(old, new, dt) * self.system.constraints.free
        for _ in range(self.scheme.filtered):
            de = self.scheme.resolved(integrator, de)
        power = self.scheme.order + 1
        rate = self._free(new, self.scheme.lasting(integrator, de, self.span)) / dt**power
        if self._averaged:
            width = 0.5 * (self.scheme.error_constant * dt**2 * self.span) ** (1.0 / 3.0)
            part = -np.expm1(-dt / width)
            self._new = self._averages.copy()
            for average in self._new:
                average += part * (rate - average)
                rate = average
        return LARGEST * self.scheme.safety / (self.rtol * self._scale(old, new)) * max(
            self._mean(rate) * dt**(power - 1) * self.span, self._mean(de) / SINGLE)

    def _free(self, y, de):
        """The increment after projection onto the joints."""
        s = self.system
        if not s.constraints.m or s.mass_solver.by_nodes:
            return de
        J = s.constraints.full_jacobian(y.u, y.t)
        return de + s.mass_solver(y.u, y.t, J)(np.zeros(s.N), -(J @ de))[0]

    def begin(self) -> None:
        """Reset, at the start and after a breakpoint."""
        self._averages = np.zeros_like(self._averages)

    def next(self, error: float, dt: float, size: float) -> tuple[float, bool]:
        """The next step size, and whether to accept the last step of size dt."""
        factor = 0.9 * max(error, 1e-300) ** (-1.0 / self.scheme.order)
        if error > REJECTED and dt > 1e-9 * self.span:
            return dt * max(0.2, min(0.8, factor)), False
        self._averages = self._new
        if factor > WORTH or factor < 0.95:
            new = dt * min(2.0, max(0.5, factor))
        else:
            new = dt
        return (max(size, new) if dt < 0.99 * size and factor >= 1.0 else new), True

    def arrays(self) -> dict[str, Array]:
        """Arrays for a checkpoint."""
        return {"averages": self._averages, "origin": self._origin,
                "moved": np.array(self._moved)}

    def load(self, arrays: dict[str, Any]) -> None:
        """Restore what :meth:`arrays` returned."""
        self._averages, self._origin = arrays["averages"], arrays["origin"]
        self._moved = float(arrays["moved"])
