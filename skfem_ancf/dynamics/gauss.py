"""Gauss methods."""

from __future__ import annotations

from math import factorial

from ..core.errors import require_integer
from ..core.quadrature import gauss
from ..core.types import Array
from .collocation import Collocation

#: Calibrated factors of the estimated error by number of points. The more points, the larger the
#: phase of a vibration in a step, and the more the estimate falls short.
SAFETY = {1: 1.0, 2: 0.9, 3: 1.4, 4: 3.0}


class Gauss(Collocation):
    """Collocation at the n Gauss points: order 2 n, symmetric and symplectic.

    Quadratic invariants such as momentum and angular momentum are conserved to the tolerance of the
    iteration; the energy stays close to its initial value for very long times. n = 1 is the
    implicit midpoint rule. Nothing is damped: accelerations of a stiff beam at the end of a step
    are dominated by vibrations that the steps do not resolve; use :class:`Radau` for those.

    Joints that are linear in the degrees of freedom and do not move (rigid connections, hinges of
    beams) keep the order; other joints and rigid bodies raise an InputError.

    Parameters
    ----------
    points
        1 to 4.

    Examples
    --------
    >>> from skfem_ancf.dynamics import Gauss
    >>> Gauss(3), Gauss(3).order
    (<Gauss, 3 points>, 6)

    References
    ----------
    Hairer, Lubich, Wanner: "Geometric Numerical Integration", II.1.3 and VI.4.
    """

    name = "gauss"
    joined = False
    filtered = 2

    def __init__(self, points: int = 3) -> None:
        self.number = require_integer("points", points, 1, 4)
        n = self.number
        self.safety = SAFETY[n]
        self.order = 2 * n
        self.error_constant = factorial(n)**2 / (factorial(2 * n) * factorial(2 * n + 1))

    @property
    def points(self) -> Array:
        return gauss(self.number)[0]
