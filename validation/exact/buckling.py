"""Loads at which columns buckle."""



import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

from skfem_ancf.core.errors import require_positive

from .arguments import choose


def euler_buckling_load(E, I, L, ends="fixed-free"):
    """Euler buckling load of a column under an end force of fixed direction.

    Parameters
    ----------
    E, I, L : float
        Young modulus (Pa), second moment of area (m^4), length (m).
    ends : str
        "fixed-free", "pinned-pinned", "fixed-pinned" (root of tan x = x) or "fixed-fixed".

    Returns
    -------
    float
        Load (N).

    Examples
    --------
    >>> [round(euler_buckling_load(1, 1, 1, e), 9) for e in ("fixed-free", "fixed-pinned")]
    [2.4674011, 20.190728556]
    """
    pinned = brentq(lambda x: np.sin(x) - x * np.cos(x), np.pi, 1.5 * np.pi, xtol=1e-15)
    roots = {
        "fixed-free": np.pi / 2,
        "pinned-pinned": np.pi,
        "fixed-pinned": pinned,
        "fixed-fixed": 2 * np.pi,
    }
    return float(choose("ends", ends, roots) ** 2 * E * I / require_positive("L", L) ** 2)


def greenhill_load(E, I, L):
    """Weight per length at which a clamped-free column buckles under itself (Greenhill 1881).

    q L^3/(E I) = (3 j/2)^2 with j the first zero of the Bessel function J of order -1/3.

    Parameters
    ----------
    E, I, L : float
        Young modulus (Pa), second moment of area (m^4), length (m).

    Returns
    -------
    float
        q = rho g A (N/m).

    Examples
    --------
    >>> round(greenhill_load(1.0, 1.0, 1.0), 10)
    7.8373474389
    """
    j = brentq(lambda x: jv(-1 / 3, x), 1.0, 3.0, xtol=1e-15)
    return 2.25 * j**2 * E * I / require_positive("L", L) ** 3
