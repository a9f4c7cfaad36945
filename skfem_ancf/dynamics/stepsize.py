"""The automatic step size: what a step adds to the error, and events ahead."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.types import Array
from ..equations.system import System
from .base import Motion, Scheme, stored
from .course import Lookahead
from .integrator import Integrator

#: The largest error of a point's displacement, over the root of the mean square that is added up:
#: a tip moves twice as far as the mean, and errors grow on their way.
LARGEST = 3.0
#: Part of ``rtol`` that a single step may add.
SINGLE = 0.1
#: Error, relative to its share, above which a step is taken again.
REJECTED = 1.2
#: Growth of the step below which it keeps its size, and with it the factors.
WORTH = 1.3


class StepSize:
    """Chooses steps so that no point is off by more than about ``rtol`` times the scene's size.

    The error that a step adds may be its share of ``rtol``, in proportion to its size: error per
    unit step. Errors are added up as root mean squares over the mass, and the largest of a point
    is taken as :data:`LARGEST` times that. Of what a scheme estimates some things are taken out,
    since they do not add up:

    * what supports undo, and joints but for that of a single step,
    * what the step does not resolve, by the iteration matrix as a filter,
    * what is damped away, by collocation,
    * in schemes of second order, whose steps are short enough to follow a blow, vibrations whose
      phase is lost within the motion whatever the tolerance asks, by two averages over the time W
      in which they turn: after the time T a vibration of the frequency w has lost the phase
      C w^3 dt^2 T, so W = (C dt^2 T)^(1 / 3) / 2. Steps of higher order are longer than W.

    References
    ----------
    Error per unit step: Hairer, Norsett, Wanner: "Solving ordinary differential equations I",
    II.4. The first filter: Shampine, Baca: "Error estimators for stiff differential equations",
    Journal of Computational and Applied Mathematics 11 (1984).
    """

    def __init__(self, system: System, scheme: Scheme, rtol: float, t_start: float,
                 t_end: float) -> None:
        if not scheme.adaptive:
            raise InputError(f"{scheme!r} does not estimate its error: give the step size dt, or "
                             "take one of the package's schemes with dt='auto', all of which do")
        self.system, self.scheme, self.rtol = system, scheme, rtol
        self.span, self._averaged = t_end - t_start, scheme.order <= 2
        self._mass = sum(b.total_mass for b in system.members)
        self._averages = self._new = np.zeros((2, system.N))
        self.cut = Lookahead(system, t_start, t_end).cut

    def _size(self, de):
        return (np.sqrt(max(de @ self.system.mass.multiply(de), 0.0) / self._mass)
                / (self.system.size * self.rtol))

    def error(self, integrator: Integrator, old: Motion, new: Motion, dt: float) -> float:
        """What a step adds to the error, over what it may add."""
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
        return LARGEST * self.scheme.safety * max(
            self._size(rate) * dt**(power - 1) * self.span, self._size(de) / SINGLE)

    def _free(self, y, de):
        """What of a change of the displacement joints do not undo."""
        s = self.system
        if not s.constraints.m or s.mass_solver.by_nodes:
            return de
        J = s.constraints.full_jacobian(y.u, y.t)
        return de + s.mass_solver(y.u, y.t, J)(np.zeros(s.N), -(J @ de))[0]

    def begin(self) -> None:
        """Forget what was: at the start, and after a breakpoint."""
        self._averages = np.zeros_like(self._averages)

    def next(self, error: float, dt: float, size: float) -> tuple[float, bool]:
        """Size of the next step after one of dt, and whether this one is to be kept."""
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
        """Arrays by name from which :meth:`load` goes on as if there had been no break."""
        return {"averages": self._averages}

    def load(self, arrays: dict[str, Any]) -> None:
        """Go on with what :meth:`arrays` gave."""
        self._averages = stored(arrays, "averages", self._averages)
