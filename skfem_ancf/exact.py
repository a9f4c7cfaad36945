r"""Reference solutions: what a beam must give, computed without finite elements.

Every function evaluates a closed form, finds the root of a characteristic equation, or solves
the ordinary differential equations of a rod by shooting; no result is stored. Displacements are
``(u_x, u_y)`` of a beam that starts along +x, a load downwards is a positive number and gives a
negative ``u_y``. Units are free but consistent (m, N, Pa, kg, s throughout the docstrings).

The rod equations, per unit of undeformed length X, with the section force n, the tangent t at the
angle theta and the normal d = (-sin theta, cos theta):

.. math::

    r' = \lambda t + \gamma d, \quad \theta' = \kappa, \quad n' = -q, \quad m' = -(r' \times n),

closed by a section law that gives the stretch, the shear and the curvature
:math:`(\lambda, \gamma, \kappa)` from :math:`N = n \cdot t`, :math:`Q = n \cdot d` and m. Inside
this module lengths are divided by L and forces by EI/L^2, so EI = 1 and the axial flexibility
is s = I/(A L^2).
"""

# ruff: noqa: E741 - I is the second moment of area, as everywhere in mechanics

import itertools

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipj, ellipk, ellipkinc, jv

from .errors import InputError, require_positive


def _choose(kind, name, table):
    if name not in table:
        raise InputError(f"unknown {kind} {name!r}; known: " + ", ".join(map(repr, table)))
    return table[name]


def _count(n, least=1):
    if int(n) != n or n < least:
        raise InputError(f"n must be a whole number from {least} up, got {n!r}")
    return int(n)


# Sections and small deflections


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


# Rods in large bending


def _line(s=0.0, curvature=0.0):
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


def _march(y, span, force, law):
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
        return _march(tip, (1.0, 0.0), lambda X: (0.0, -P - q * (1 - X)), law)

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
    return L * _cantilever(_line(EI / (EA * L**2)), P * L**2 / EI, 0.0)


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
    E = E / _choose("plane", plane, {"stress": 1.0, "strain": 1 - nu**2})
    s, shear = I / (area * L**2), E * I / (shear_factor(nu) * shear_modulus * area * L**2)
    laws = {
        "elastica": _line(),
        "extensible": _line(s),
        "reissner": _reissner(s, shear),
        "svk": _svk(s),
    }
    return L * _cantilever(_choose("model", model, laws), 0.0, rho * g * area * L**3 / (E * I))


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


# Frames and arches: a rod from support to support, four unknowns, three end conditions


# of the unknowns in the length of a path: one of order 1 (angle or moment), three forces
_WEIGHT = np.array([1.0, 0.1, 0.1, 0.1])


def _newton(f, z):
    """Solve f(z)[0] = 0; return z, the Jacobian (complex steps) and the second output of f."""
    for _ in range(20):
        res, out = f(z[:, None] + 1e-30j * np.eye(len(z)))
        value, J = res[:, 0].real, res.imag / 1e-30
        if np.abs(value).max() < 1e-11:
            return z, J, out[:, 0].real
        if not np.abs(value).max() < 2.0:  # lost; integrating further could take minutes
            break
        z = z - np.linalg.solve(J, value)
    raise InputError("no equilibrium found from the previous one; take smaller steps")


def _step(frame, z, t):
    """The point of the path in the plane through z with the normal t, its tangent and output."""

    def in_plane(w):
        res, out = frame(w)
        return np.vstack([res, (t * _WEIGHT) @ (w - z[:, None])]), out

    z, J, out = _newton(in_plane, z)
    new = np.linalg.svd(J[:3] / _WEIGHT)[2][-1]
    return z, new * np.sign(new @ t), out


def _ahead(frame, z, t, step, guess):
    """The point a step further, in four smaller ones where the path is too curved for one."""
    try:
        return _step(frame, guess, t)
    except InputError:
        if step < 1e-3:
            raise
    for _ in range(4):
        z, t, out = _ahead(frame, z, t, step / 4, z + step / 4 * t / _WEIGHT)
    return z, t, out


def _path(frame, step):
    """Equilibria (z, tangent, output) from rest, z = 0, by pseudo-arc-length; z[3] is the load."""
    z, t, out = _step(frame, np.zeros(4), np.array([0.0, 0.0, 0.0, 1.0]))
    before = t
    while True:
        yield z, t, out
        guess = z + step * (1.5 * t - 0.5 * before) / _WEIGHT  # of second order
        before = t
        z, t, out = _ahead(frame, z, t, step, guess)


def _limit_loads(frame, count, step):
    """The first limit loads of a path: where the load component of the tangent vanishes."""
    found = []
    for (z, t, _), (y, after, _) in itertools.pairwise(itertools.islice(_path(frame, step), 200)):
        if t[3] * after[3] < 0:

            def between(part, z=z, y=y, t=t):
                return _step(frame, z + part * (y - z), t)

            part = brentq(lambda part: between(part)[1][3], 0.0, 1.0, xtol=1e-7)
            found.append(float(between(part)[0][3]))
            if len(found) == count:
                return found
    raise InputError("the path has fewer limit points than asked for")


def _sample(frame, n, reach, step):
    """n points of a path of the length reach, in steps of at most step: output and load."""
    n = _count(n, 2)
    parts = int(np.ceil(require_positive("reach", reach) / (step * (n - 1))))
    path = _path(frame, reach / (parts * (n - 1)))
    points = itertools.islice(path, 0, parts * (n - 1) + 1, parts)
    return np.array([np.append(out, z[3]) for z, _, out in points]).T


def _lee(A, I, L):
    s = 0.0 if A is None else require_positive("I", I) / (require_positive("A", A) * L**2)
    law = _line(s)

    def frame(z):
        angle, nx, ny, P = z
        zero = 0 * angle
        y = _march([zero, zero, np.pi / 2 + angle, zero], (0, 1), lambda X: (nx, ny), law)
        y[2] -= np.pi / 2
        y = load = _march(y, (0, 0.2), lambda X: (nx, ny), law)
        y = _march(y, (0, 0.8), lambda X: (nx, ny + P), law)
        return np.array([y[0] - 1, y[1] - 1, y[3]]), np.array([load[0] - 0.2, load[1] - 1])

    return frame


def lee_frame(n=41, A=None, I=1.0, L=1.0, reach=8.0):
    """Load path of Lee's frame, through snap-through and snap-back.

    A column of length L, pinned at its foot, carries a beam of length L, rigidly joined to it and
    pinned at its far end; the load acts downwards on the beam, L/5 from the corner (Lee, Manuel
    and Rossow 1968). Shooting along the path in pseudo-arc-length.

    Parameters
    ----------
    n : int
        Number of points, the unloaded frame included.
    A, I, L : float
        Area (m^2), second moment of area (m^4) and length of either member (m). Without A the
        frame is inextensible.
    reach : float
        Length of path, in the scaled unknowns: 8 passes both limit points until the load is
        positive again.

    Returns
    -------
    ndarray, shape (3, n)
        u_x/L and u_y/L of the loaded point, and the load in E I/L^2.

    Examples
    --------
    >>> ux, uy, load = lee_frame(17)
    >>> ux.shape, bool(load.max() > 18.0), bool(load.min() < -8.0)
    ((17,), True, True)
    """
    return _sample(_lee(A, I, L), n, reach, 0.2)


def lee_frame_limits(A=None, I=1.0, L=1.0):
    """The limit load and the following minimum of Lee's frame, see :func:`lee_frame`.

    Parameters
    ----------
    A, I, L : float
        As in :func:`lee_frame`.

    Returns
    -------
    highest, lowest : float
        Loads in E I/L^2.

    Examples
    --------
    >>> highest, lowest = lee_frame_limits()
    >>> round(highest, 6), round(lowest, 6)
    (18.558747, -9.421287)
    """
    return tuple(_limit_loads(_lee(A, I, L), 2, 0.2))


def _arch(angle):
    a = np.deg2rad(angle) / 2

    def frame(z):
        m, nx, ny, P = z
        law, zero = _line(curvature=-1.0), 0 * m
        y = [zero - np.sin(a), zero + np.cos(a), zero + a, m]
        y = load = _march(y, (0, a), lambda X: (nx, ny), law)
        y = _march(y, (0, a), lambda X: (nx, ny + P), law)
        return np.array([y[0] - np.sin(a), y[1] - np.cos(a), y[3]]), load[:2] - [[0], [1]]

    return frame


def clamped_hinged_arch(n=33, angle=215.0, reach=3.6):
    """Load path of a circular inextensible arch, clamped at the left and hinged at the right.

    The load acts downwards on the crown (DaDeppo and Schmidt 1975, for 215 degrees).

    Parameters
    ----------
    n : int
        Number of points, the unloaded arch included.
    angle : float
        Angle that the arch spans (degrees).
    reach : float
        Length of path in the scaled unknowns: 3.6 passes the limit load.

    Returns
    -------
    ndarray, shape (3, n)
        u_x/R and u_y/R of the crown, and the load in E I/R^2.

    Examples
    --------
    >>> ux, uy, load = clamped_hinged_arch(10)
    >>> uy.shape, bool(load.max() > 8.8), bool(uy[-1] < -1.1)
    ((10,), True, True)
    """
    return _sample(_arch(angle), n, reach, 0.2)


def clamped_hinged_arch_limit(angle=215.0):
    """First limit load along the path of :func:`clamped_hinged_arch`.

    Parameters
    ----------
    angle : float
        Angle that the arch spans (degrees).

    Returns
    -------
    float
        Load in E I/R^2.

    Examples
    --------
    >>> round(clamped_hinged_arch_limit(), 6)
    8.97309
    """
    return _limit_loads(_arch(angle), 1, 0.2)[0]


def williams_toggle(v, EA=1.885e6, EI=9.27e3, half_span=12.943, rise=0.386):
    """Load of Williams' toggle frame for a given deflection of its apex.

    Two straight members, clamped at their feet and rigidly joined at the apex, carry a load
    downwards at the apex and stay symmetric. Williams (1964) expands for small rotations; here
    each member is an extensible rod in exact large rotations, N = EA (|r'| - 1),
    m = EI theta'. The defaults are his frame, in inches and pounds.

    Parameters
    ----------
    v : float or array_like, shape (n,)
        Deflection of the apex, positive downwards; an array is best ordered.
    EA, EI : float
        Axial and bending stiffness of a member.
    half_span, rise : float
        Horizontal and vertical extent of a member.

    Returns
    -------
    float or ndarray, shape (n,)
        The load at the apex, positive downwards.

    Examples
    --------
    >>> williams_toggle([0.0, 0.1, 0.7]).round(3).tolist()
    [0.0, 25.201, 88.155]
    """
    EA, EI, half_span = map(require_positive, ("EA", "EI", "half_span"), (EA, EI, half_span))
    L, angle = np.hypot(half_span, rise), np.arctan2(rise, half_span)
    law, targets = _line(EI / (EA * L**2)), np.atleast_1d(np.asarray(v, dtype=float)) / L

    def member(z, down):
        nx, ny, m = z
        zero = 0 * m
        y = _march([zero, zero, zero + angle, m], (0, 1), lambda X: (nx, ny), law)
        return np.array([y[0] - np.cos(angle), y[1] - np.sin(angle) + down, y[2] - angle]), z

    state, at, loads = np.zeros(3), 0.0, []
    for target in targets:
        for down in np.linspace(at, target, 1 + max(1, int(np.ceil(abs(target - at) / 0.005))))[1:]:
            state = _newton(lambda z, down=down: member(z, down), state)[0]
        at = target
        loads.append(0.0 - 2 * state[1] * EI / L**2)
    return np.array(loads) if np.ndim(v) else float(loads[0])


# Buckling


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
    return float(_choose("ends", ends, roots) ** 2 * E * I / require_positive("L", L) ** 2)


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


# Vibration


def euler_bernoulli_frequencies(E, I, A, rho, L, n=3, ends="fixed-free"):
    """Lowest bending frequencies of an Euler-Bernoulli beam.

    omega = x^2 sqrt(E I/(rho A))/L^2 with the roots of cos x cosh x = -1 (fixed-free),
    cos x cosh x = 1 (free-free) and sin x = 0 (pinned-pinned).

    Parameters
    ----------
    E, I, A, rho, L : float
        Young modulus (Pa), second moment of area (m^4), area (m^2), density (kg/m^3), length (m).
    n : int
        How many.
    ends : str
        "fixed-free", "free-free" (its rigid motions left out) or "pinned-pinned".

    Returns
    -------
    ndarray, shape (n,)
        Angular frequencies (rad/s), ascending.

    Examples
    --------
    >>> np.sqrt(euler_bernoulli_frequencies(1, 1, 1, 1, 1)).round(9).tolist()
    [1.875104069, 4.694091133, 7.854757438]
    """
    sign, first = _choose(
        "ends", ends, {"fixed-free": (1, 0), "free-free": (-1, 1), "pinned-pinned": (0, 0)}
    )

    def equation(x):
        return np.cos(x) + sign * 2 * np.exp(-x) / (1 + np.exp(-2 * x))

    k = np.arange(first, first + _count(n))
    roots = np.pi * (k + 1.0)
    if sign:
        roots = np.array([brentq(equation, np.pi * i, np.pi * (i + 1), xtol=1e-14) for i in k])
    return roots**2 * np.sqrt(E * I / (rho * A)) / require_positive("L", L) ** 2


def timoshenko_frequencies(E, I, A, rho, L, kGA, n=3, ends="fixed-free"):
    """Lowest bending frequencies of a Timoshenko beam.

    E I theta'' + kGA (w' - theta) + rho I omega^2 theta = 0 and
    kGA (w'' - theta') + rho A omega^2 w = 0 (Timoshenko 1921). Closed form for pinned-pinned;
    otherwise the roots of the determinant of the four end conditions.

    Parameters
    ----------
    E, I, A, rho, L : float
        Young modulus (Pa), second moment of area (m^4), area (m^2), density (kg/m^3), length (m).
    kGA : float
        Shear stiffness k_s G A (N), see :func:`shear_factor`.
    n : int
        How many.
    ends : str
        "fixed-free", "free-free" (its rigid motions left out) or "pinned-pinned" (the bending
        branch only: the second spectrum starts at sqrt(kGA/(rho I))).

    Returns
    -------
    ndarray, shape (n,)
        Angular frequencies (rad/s), ascending.

    Examples
    --------
    >>> kGA = shear_factor(0.3) / 2.6
    >>> timoshenko_frequencies(1.0, 1 / 1200, 1.0, 1.0, 1.0, kGA, n=2).round(6).tolist()
    [0.100712, 0.60397]
    """
    _choose("ends", ends, dict.fromkeys(("fixed-free", "free-free", "pinned-pinned")))
    n, L = _count(n), require_positive("L", L)

    def squared(beta):
        """omega^2 of a wave of number beta on the bending branch."""
        a = rho**2 * A / (E * kGA)
        b = beta**2 * (rho / E + rho * A / kGA) + rho * A / (E * I)
        return 2 * beta**4 / (b + np.sqrt(b * b - 4 * a * beta**4))

    def determinant(x):
        beta = x / L
        w2 = squared(beta)
        s = rho * A * w2 / kGA
        other = beta**2 - (rho / E * w2 + s)  # the two p^2 of exp(p X) add to -(rho/E w2 + s)
        columns = []
        for p2 in (-(beta**2), other):
            # two solutions f'' = p2 f: f and f' at both ends; theta = f, w = f'/(p2 + s),
            # theta' = f', w' - theta = -s f/(p2 + s)
            a = np.sqrt(abs(p2)) * L
            if p2 < 0:
                f = [[1, 0], [np.cos(a), np.sin(a) / a]]
                d = [[0, 1], [-a * np.sin(a), np.cos(a)]]
            else:  # decaying from either end; the limit of a/sinh(a) is 1
                e = np.exp(-2 * a)
                tall = a * (1 + e) / (1 - e) if a else 1.0
                low = 2 * a * np.exp(-a) / (1 - e) if a else 1.0
                f, d = [[1, 0], [0, 1]], [[-tall, low], [-low, tall]]
            (f0, f1), (d0, d1) = np.array(f, float), np.array(d, float)
            c = 1 / ((p2 + s) * L**2)
            start = [d0 * c, f0] if ends == "fixed-free" else [d0, f0 * c]
            columns.append(np.array([*start, d1, f1 * c]))
        return np.linalg.det(np.hstack(columns))

    if ends == "pinned-pinned":
        return np.sqrt(squared(np.pi * np.arange(1, n + 1) / L))
    roots, x, step = [], 0.5, np.pi / 64
    value = determinant(x)
    while len(roots) < n:
        previous, x = value, x + step
        value = determinant(x)
        if previous * value < 0:
            roots.append(brentq(determinant, x - step, x, xtol=1e-14))
    return np.sqrt(squared(np.array(roots) / L))


# Rigid motion


def rigid_pendulum(t, L, theta0=np.pi / 2, g=9.81):
    """Angle of a uniform rigid rod, hung at one end and released from rest.

    sin(theta/2) = k cd(omega t, k) with k = sin(theta0/2), omega^2 = 3 g/(2 L).

    Parameters
    ----------
    t : array_like, shape (n,)
        Times (s).
    L : float
        Length (m).
    theta0 : float
        Angle at t = 0 from the downward vertical (rad), between -pi and pi.
    g : float
        Gravity (m/s^2).

    Returns
    -------
    ndarray, shape (n,)
        Angles from the downward vertical (rad); the tip is at L (sin theta, -cos theta).

    Examples
    --------
    >>> rigid_pendulum([0.0, 0.25, 0.5], 1.0).round(9).tolist()
    [1.570796327, 1.114159968, -0.09035209]
    """
    if not abs(theta0) < np.pi:
        raise InputError(f"theta0 must lie between -pi and pi, got {theta0!r}")
    k = np.sin(theta0 / 2)
    omega = np.sqrt(1.5 * require_positive("g", g) / require_positive("L", L))
    _, cn, dn, _ = ellipj(omega * np.asarray(t, dtype=float), k * k)
    return 2 * np.arcsin(k * cn / dn)


def rigid_pendulum_period(L, theta0=np.pi / 2, g=9.81):
    """Period of :func:`rigid_pendulum`, 4 K(k)/omega.

    Parameters
    ----------
    L, theta0, g : float
        As in :func:`rigid_pendulum`.

    Returns
    -------
    float
        Period (s).

    Examples
    --------
    >>> round(rigid_pendulum_period(1.0), 9)
    1.933334854
    """
    return float(4 * ellipk(np.sin(theta0 / 2) ** 2) / np.sqrt(1.5 * g / require_positive("L", L)))


def double_pendulum(
    t,
    lengths=(1.0, 1.0),
    masses=(1.0, 1.0),
    angles=(np.pi / 2, np.pi / 2),
    rates=(0.0, 0.0),
    g=9.81,
):
    """Angles of two uniform rigid rods, the first hung at one end, the second hinged to it.

    Integrates the exact equations of motion by DOP853 to a relative tolerance of 1e-13.

    Parameters
    ----------
    t : array_like, shape (n,)
        Times, ascending from the start of the motion (s).
    lengths, masses : (float, float)
        Of the rods (m, kg).
    angles, rates : (float, float)
        Angles from the downward vertical (rad) and their rates (rad/s) at t[0].
    g : float
        Gravity (m/s^2).

    Returns
    -------
    ndarray, shape (4, n)
        Both angles (rad), then both rates (rad/s).

    Examples
    --------
    >>> double_pendulum([0.0, 0.5, 1.0])[:2, -1].round(8).tolist()
    [-1.20771624, -0.81439102]
    """
    (L1, L2), (m1, m2) = lengths, masses
    a, c, d = (m1 / 3 + m2) * L1**2, m2 * L2**2 / 3, m2 * L1 * L2 / 2

    def rate(_, y):
        p, q, dp, dq = y
        b, twist = d * np.cos(p - q), d * np.sin(p - q)
        f = -twist * dq**2 - (m1 / 2 + m2) * g * L1 * np.sin(p)
        h = twist * dp**2 - m2 / 2 * g * L2 * np.sin(q)
        det = a * c - b * b
        return [dp, dq, (c * f - b * h) / det, (a * h - b * f) / det]

    t = np.atleast_1d(np.asarray(t, dtype=float))
    if np.any(np.diff(t) <= 0):
        raise InputError("t must ascend")
    y0 = np.concatenate([angles, rates])
    if len(t) == 1:
        return y0[:, None]
    run = solve_ivp(rate, (t[0], t[-1]), y0, "DOP853", t_eval=t, rtol=1e-13, atol=1e-14)
    return run.y
