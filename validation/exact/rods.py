r"""Rods in large bending.

The rod equations, per unit of undeformed length X, with the section force n, the tangent t at the
angle theta and the normal d = (-sin theta, cos theta):

.. math::

    r' = \lambda t + \gamma d, \quad \theta' = \kappa, \quad n' = -q, \quad m' = -(r' \times n),

closed by a section law that gives the stretch, the shear and the curvature
:math:`(\lambda, \gamma, \kappa)` from :math:`N = n \cdot t`, :math:`Q = n \cdot d` and m. Inside
this module lengths are divided by L and forces by EI/L^2, so EI = 1 and the axial flexibility
is s = I/(A L^2).
"""



import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipkinc

from skfem_ancf.core.errors import InputError, require_positive

from .arguments import choose
from .sections import inertia, shear_factor


def line(s=0.0, curvature=0.0):
    """Section law of a line: stretch 1 + s N (s = 0: inextensible), theta' - curvature = m."""
    return lambda N, Q, m: (1 + s * N, 0 * Q, curvature + m)


def _reissner(s, shear):
    return lambda N, Q, m: (1 + s * N, shear * Q, m)


def _svk(s):
    """Section law of a St. Venant-Kirchhoff body whose sections stay rigid and normal.

    eps_xx = ((lam - Y kappa)^2 - 1)/2 and S_xx = E eps_xx; the virtual work gives
    N = int S_xx (lam - Y kappa) dA and m = -int S_xx (lam - Y kappa) Y dA for a rectangle:
    N = ((lam^3 - lam)/s + 3 lam kappa^2)/2, m = (kappa (3 lam^2 - 1) + 1.8 s kappa^3)/2,
    inverted here by Newton's method.
    """

    def law(N, Q, m):
        lam, k = 1 + s * N, m
        for _ in range(50):
            f = ((lam**3 - lam) / s + 3 * lam * k**2) / 2 - N
            g = (k * (3 * lam**2 - 1) + 1.8 * s * k**3) / 2 - m
            a, d = ((3 * lam**2 - 1) / s + 3 * k**2) / 2, (3 * lam**2 - 1 + 5.4 * s * k**2) / 2
            c = 3 * lam * k
            det = a * d - c * c
            if not (det > 0 and a > 0):
                break
            dl, dk = (d * f - c * g) / det, (a * g - c * f) / det
            lam, k = lam - dl, k - dk
            if abs(dl) + s**0.5 * abs(dk) < 1e-9:  # quadratic: the next error is below 1e-16
                return lam, 0 * Q, k
        raise InputError("a St. Venant-Kirchhoff section collapses under this load; reduce it")

    return law


def march(y, span, force, law):
    """Integrate (x, y, theta, m) over span; real, or complex with one column per direction."""
    y = np.asarray(y)

    def rate(X, v):
        _, _, theta, m = v.reshape(y.shape)
        c, s = np.cos(theta), np.sin(theta)
        nx, ny = force(X)
        lam, gam, kap = law(nx * c + ny * s, ny * c - nx * s, m)
        dx, dy = lam * c - gam * s, lam * s + gam * c
        return np.array([dx, dy, kap, dy * nx - dx * ny]).ravel()

    run = solve_ivp(rate, span, y.ravel(), method="DOP853", rtol=1e-12, atol=1e-14)
    return run.y[:, -1].reshape(y.shape)


def _cantilever(law, P, q):
    """Tip displacement over L of a clamped rod under a tip force P and a line load q, both down.

    Shoots from the tip (m = 0, angle unknown) to the root (angle 0), the well-posed direction.
    The tip hangs at an angle between -pi/2 and 0; the first root from -pi/2 up is the rod that
    hangs without a loop.
    """

    def root(rise):
        tip = [0.0, 0.0, rise - np.pi / 2, 0.0]
        return march(tip, (1.0, 0.0), lambda X: (0.0, -P - q * (1 - X)), law)

    if np.sqrt(P) + np.sqrt(q) / 1.5 > 17:  # the tip is exp(-17) from straight down
        raise InputError("too heavy a load for so soft a rod: P L^2/EI and q L^3/EI below 280, 650")
    low, high = 0.0, 1e-8
    while high < np.pi / 2 and root(high)[2] < 0:
        low, high = high, min(8 * high, np.pi / 2)
    x, y, _, _ = root(brentq(lambda rise: root(rise)[2], low, high, xtol=1e-16, rtol=1e-15))
    return np.array([-x - 1.0, -y])


def elastica_tip_load(alpha):
    """Inextensible cantilever under a tip force of fixed direction, by elliptic integrals.

    Parameters
    ----------
    alpha : float
        P L^2/(E I), positive, up to about 200 (beyond it the modulus rounds to 1).

    Returns
    -------
    u, w : float
        Shortening and deflection of the tip over L, both positive: the displacement is
        L (-u, -w) for a force downwards.

    Notes
    -----
    Bisshopp and Drucker (1945), with the amplitude complemented so that small loads lose no
    digits: for the tip angle phi, k^2 = (1 + sin phi)/2 and
    sqrt(alpha) = K(k) - F(a, k) with sin a = 1/(k sqrt 2).

    Examples
    --------
    >>> u, w = elastica_tip_load(10.0)
    >>> round(u, 10), round(w, 10)
    (0.5549955978, 0.8106090249)
    """
    alpha = require_positive("alpha", alpha)

    def parts(phi):
        s = np.sin(phi)
        modulus, first = np.sin(np.pi / 4 + phi / 2) ** 2, np.arctan2(1.0, np.sqrt(s))
        rest = np.arctan2(np.sqrt(s), np.sin(np.pi / 4 - phi / 2))
        return modulus, first, rest

    def excess(phi):
        modulus, _, rest = parts(phi)
        return ellipkinc(rest, modulus) - np.sqrt(alpha)

    top = np.pi / 2 - 1e-7
    if excess(top) < 0:
        raise InputError(f"alpha must stay below about 280, got {alpha!r}")
    phi = brentq(excess, 0.0, top, xtol=1e-300, rtol=1e-15)
    modulus, first, rest = parts(phi)
    second = ellipeinc(rest, modulus) - modulus * np.sin(first) * np.sin(rest)
    u, w = 1 - np.sqrt(2 * np.sin(phi) / alpha), 1 - 2 * second / np.sqrt(alpha)
    return float(u), float(w)


def elastica_extensible_tip(P, EA, EI, L):
    """Cantilever under a tip force downwards, N = EA (|r'| - 1), m = EI theta'.

    The law of an extensible Euler-Bernoulli rod with the curvature per unit of undeformed length
    ("material" curvature), which is also that of the cubic cable element (Gerstmayr and
    Irschik 2008).

    Parameters
    ----------
    P : float
        Force, positive downwards (N).
    EA, EI, L : float
        Axial (N) and bending stiffness (N m^2), length (m).

    Returns
    -------
    ndarray, shape (2,)
        (u_x, u_y) of the tip (m).

    Examples
    --------
    >>> EI = 2.07e11 * inertia(0.1, 0.1)
    >>> elastica_extensible_tip(3 * EI / 2**2, 2.07e11 * 0.01, EI, 2.0).round(9).tolist()
    [-0.508537304, -1.207239855]
    """
    P, EA, EI, L = map(require_positive, ("P", "EA", "EI", "L"), (P, EA, EI, L))
    return L * _cantilever(line(EI / (EA * L**2)), P * L**2 / EI, 0.0)


def gravity_cantilever(E, nu, rho, L, b, h, g=9.81, model="reissner", plane="stress"):
    """Tip displacement of a cantilever that hangs under its own weight.

    Parameters
    ----------
    E, nu, rho : float
        Young modulus (Pa), Poisson ratio, density (kg/m^3).
    L, b, h : float
        Length, width and height (m).
    g : float
        Gravity, downwards (m/s^2).
    model : str
        The section law, each line adding one effect to a bending stiffness E'I:

        - "elastica": inextensible, m = E'I theta';
        - "extensible": N = E'A (lambda - 1), no shear (Euler-Bernoulli);
        - "reissner": besides, Q = k_s G A gamma with :func:`shear_factor` (Reissner 1972);
        - "svk": no shear, but S_xx = E' eps_xx with the Green-Lagrange strain
          ((lambda - Y theta')^2 - 1)/2 of sections that stay rigid and normal.
    plane : str
        "stress" (E' = E, the ordinary beam) or "strain" (E' = E/(1 - nu^2)).

    Returns
    -------
    ndarray, shape (2,)
        (u_x, u_y) of the tip (m), to about 1e-12 L.

    Examples
    --------
    >>> beam = dict(E=2e8, nu=0.3, rho=7800.0, L=1.0, b=0.01, h=0.01)
    >>> gravity_cantilever(**beam, model="elastica").round(9).tolist()
    [-0.740991757, -0.903131683]
    >>> gravity_cantilever(**beam, plane="strain").round(9).tolist()
    [-0.724507359, -0.897687847]
    """
    E, rho, L, g = map(require_positive, ("E", "rho", "L", "g"), (E, rho, L, g))
    area, I = b * h, inertia(b, h)
    shear_modulus = E / (2 * (1 + nu))
    E = E / choose("plane", plane, {"stress": 1.0, "strain": 1 - nu**2})
    s, shear = I / (area * L**2), E * I / (shear_factor(nu) * shear_modulus * area * L**2)
    laws = {
        "elastica": line(),
        "extensible": line(s),
        "reissner": _reissner(s, shear),
        "svk": _svk(s),
    }
    return L * _cantilever(choose("model", model, laws), 0.0, rho * g * area * L**3 / (E * I))


def rollup_curvature(M, E, b, h):
    """Curvature and axis stretch of a St. Venant-Kirchhoff beam in pure bending, nu = 0.

    With no section force, lambda^2 = 1 - (h kappa)^2/4 and
    M = E I kappa (1 - 0.3 (h kappa)^2) for sections that stay rigid and normal. In a body whose
    sections may strain, radial equilibrium presses them together by a strain of the order of
    (h kappa)^2, and the factor becomes 1 - (h kappa)^2/2 for the two-dimensional body and
    sections of order 3 or more, 1 - 7 (h kappa)^2/15 for order 1 and 2, to that order.

    Parameters
    ----------
    M : float
        End moment, either sign (N m).
    E, b, h : float
        Young modulus (Pa), width and height (m).

    Returns
    -------
    kappa, stretch : float
        Rotation per undeformed length (1/m), and stretch of the axis.

    Raises
    ------
    InputError
        If M is beyond the largest moment the body can carry (at h kappa = 1.054).

    Examples
    --------
    >>> EI = 2e8 * inertia(0.01, 0.01)
    >>> kappa, stretch = rollup_curvature(2 * np.pi * EI, 2e8, 0.01, 0.01)
    >>> round(kappa / (2 * np.pi), 10), round(stretch, 10)
    (1.0011885806, 0.9995052236)
    """
    moment = M * require_positive("h", h) / (require_positive("E", E) * inertia(b, h))
    most = 0.9**-0.5
    if abs(moment) > most * (1 - 0.3 * most**2):
        raise InputError(f"M = {M!r} is beyond the largest moment, {2 * most / 3 * M / moment!r}")
    x = brentq(lambda x: x * (1 - 0.3 * x * x) - moment, -most, most, xtol=1e-300, rtol=1e-15)
    return x / h, float(np.sqrt(1 - x * x / 4))


def rollup_end_angle(M, E, b, h, L):
    """Angle by which an end moment turns the end of a cantilever, see :func:`rollup_curvature`.

    Parameters
    ----------
    M, E, b, h : float
        As in :func:`rollup_curvature`.
    L : float
        Length (m).

    Returns
    -------
    float
        Angle (rad), 2 pi for a closed circle.

    Examples
    --------
    >>> EI = 2e8 * inertia(0.01, 0.01)
    >>> round(rollup_end_angle(2 * np.pi * EI, 2e8, 0.01, 0.01, 1.0) / (2 * np.pi), 10)
    1.0011885806
    """
    return rollup_curvature(M, E, b, h)[0] * L


def rollup_tip(M, E, b, h, L):
    """Tip displacement of a cantilever under an end moment, see :func:`rollup_curvature`.

    Parameters
    ----------
    M, E, b, h, L : float
        As in :func:`rollup_end_angle`; M > 0 bends upwards.

    Returns
    -------
    ndarray, shape (2,)
        (u_x, u_y) (m).

    Examples
    --------
    >>> EI = 2e8 * inertia(0.01, 0.01)
    >>> rollup_tip(np.pi * EI, 2e8, 0.01, 0.01, 1.0).round(6).tolist()
    [-1.000296, 0.636352]
    """
    kappa, stretch = rollup_curvature(M, E, b, h)
    half = kappa * L / 2
    chord = stretch * L * np.sinc(half / np.pi)
    return np.array([chord * np.cos(half) - L, chord * np.sin(half)])
