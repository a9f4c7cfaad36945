"""Laws of contact, for numbers and arrays.

For the penetration ``a`` a point with reference area A has the potential ``k A S(a)`` with::

    S(a) = (<a>^3 - <a - w>^3) / (6 w),   <a> = max(a, 0)

which is ``a^2 / 2`` except for a transition of width w, and twice continuously differentiable. A
mean between two states takes the divided difference of S: its work is the change of the potential.
In the augmented Lagrangian ``a = m - g`` with the gap g and the multiplier m over the stiffness,
which is increased by the remaining penetration.

Friction is a spring along the surface from an anchor to the point, limited by Coulomb's law.
"""

import numpy as np

from ...core import source
from .tables import TINY


@source
def potential(a, width):
    """S(a)."""
    return (np.maximum(a, 0.0) ** 3 - np.maximum(a - width, 0.0) ** 3) / (6.0 * width)


@source
def pressure_slope(a, width):
    """S''(a)."""
    return (np.maximum(a, 0.0) - np.maximum(a - width, 0.0)) / width


@source
def mean_pressure(a, b, width):
    """(S(b) - S(a)) / (b - a), and S'(a) for a = b, without cancellation."""
    return (_mean_cube(a, b) - _mean_cube(a - width, b - width)) / (6.0 * width)


@source
def _mean_cube(a, b):
    """(<b>^3 - <a>^3) / (b - a)."""
    p, q = np.maximum(a, 0.0), np.maximum(b, 0.0)
    same = np.abs(b - a) < TINY
    share = (q - p) / (b - a + same) * (1.0 - same) + same * (a > 0.0)
    return (p * p + p * q + q * q) * share


@source
def mean_pressure_slope(a, b, width, pressure):
    """Twice the derivative of the mean by b; ``pressure`` is the mean of bilateral points."""
    jump = b - a
    apart = 1.0 * (np.abs(jump) > 1e-3 * (width + np.abs(a) + np.abs(b)))
    return (pressure_slope(0.5 * (a + b), width) * (1.0 - apart)
            + 2.0 * (mean_pressure(b, b, width) - pressure) * apart / (jump + (1.0 - apart)))


@source
def return_mapping(trial, limit):
    """Friction traction from a trial traction, and 1 for sticking, 0 for slipping."""
    return np.minimum(np.maximum(trial, -limit), limit), 1.0 * (np.abs(trial) < limit)
