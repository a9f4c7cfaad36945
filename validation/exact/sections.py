"""Sections, and small deflections."""



import numpy as np

from skfem_ancf.core.errors import require_positive


def inertia(b, h):
    """Second moment of area of a rectangle, b h^3/12.

    Parameters
    ----------
    b, h : float
        Width and height (m).

    Returns
    -------
    float
        I (m^4).

    Examples
    --------
    >>> inertia(0.1, 0.5) == 0.1 * 0.5**3 / 12
    True
    """
    return require_positive("b", b) * require_positive("h", h) ** 3 / 12


def shear_factor(nu):
    """Shear factor of a rectangle, 10 (1 + nu)/(12 + 11 nu) (Cowper 1966).

    Parameters
    ----------
    nu : float
        Poisson ratio.

    Returns
    -------
    float

    Examples
    --------
    >>> round(shear_factor(0.3), 12)
    0.849673202614
    """
    return 10 * (1 + nu) / (12 + 11 * nu)


def euler_bernoulli_tip(P, E, I, L):
    """Tip displacement of a cantilever under a small tip force P downwards, P L^3/(3 E I).

    Parameters
    ----------
    P : float
        Force, positive downwards (N).
    E, I, L : float
        Young modulus (Pa), second moment of area (m^4), length (m).

    Returns
    -------
    ndarray, shape (2,)
        (u_x, u_y) (m).

    Examples
    --------
    >>> euler_bernoulli_tip(10.0, 2e11, inertia(0.01, 0.01), 1.0).round(12).tolist()
    [0.0, -0.02]
    """
    return np.array([0.0, -P * L**3 / (3 * E * I)])


def root_transverse_strain(P, E, nu, L, h, b):
    """Transverse strain eps_y at the root of a cantilever under a tip force P downwards.

    The bending stress is 6 P L/(b h^2) on top and its negative below; nothing acts across, so
    eps_y = -nu sigma_x/E (plane stress).

    Parameters
    ----------
    P : float
        Force, positive downwards (N).
    E, nu, L, h, b : float
        Young modulus (Pa), Poisson ratio, length, height and width (m).

    Returns
    -------
    ndarray, shape (2,)
        eps_y at the top (Y = h/2) and at the bottom (Y = -h/2).

    Examples
    --------
    >>> root_transverse_strain(10.0, 2e11, 0.3, 1.0, 0.01, 0.01).round(12).tolist()
    [-9e-05, 9e-05]
    """
    top = -nu * 6 * P * L / (E * b * h**2)
    return np.array([top, -top])
