"""The methods of Gauss."""

from __future__ import annotations

from math import factorial

from ..core.errors import require_integer
from ..core.quadrature import gauss
from ..core.types import Array
from .collocation import Collocation

#: Factors of the estimated error by number of points, as measured: the more points, the more of
#: the error is of vibrations that turn so far in a step that the estimate falls short of them.
SAFETY = {1: 1.0, 2: 0.9, 3: 1.4, 4: 3.0}


class Gauss(Collocation):
    """Collocation at the points of Gauss: of order 2 n with n points, symmetric and symplectic.

    Momentum and angular momentum are conserved to the tolerance of the iteration, as all that is
    quadratic in the state; the energy stays close to what it was for very long times. n = 1 is the
    implicit midpoint rule. Nothing is damped, so that a stiff beam goes on vibrating with what it
    has: see :class:`Radau` for those, above all where accelerations are read. At the end of a step
    they are by the forces there, which for a pendulum of steel in 40 steps are those of vibrations
    that no step resolves, 240 times those of the swing.

    Joints whose equations are linear in the coordinates and do not move, as clamps and lines at an
    angle and hinges of beams, cost no order; others, and rigid bodies, are refused.

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
