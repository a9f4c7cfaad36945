"""Frames and arches: a rod from support to support, four unknowns, three end conditions."""



import itertools

import numpy as np
from scipy.optimize import brentq

from skfem_ancf.core.errors import InputError, require_positive

from .arguments import count_of
from .rods import line, march

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
    n = count_of(n, 2)
    parts = int(np.ceil(require_positive("reach", reach) / (step * (n - 1))))
    path = _path(frame, reach / (parts * (n - 1)))
    points = itertools.islice(path, 0, parts * (n - 1) + 1, parts)
    return np.array([np.append(out, z[3]) for z, _, out in points]).T


def _lee(A, I, L):
    s = 0.0 if A is None else require_positive("I", I) / (require_positive("A", A) * L**2)
    law = line(s)

    def frame(z):
        angle, nx, ny, P = z
        zero = 0 * angle
        y = march([zero, zero, np.pi / 2 + angle, zero], (0, 1), lambda X: (nx, ny), law)
        y[2] -= np.pi / 2
        y = load = march(y, (0, 0.2), lambda X: (nx, ny), law)
        y = march(y, (0, 0.8), lambda X: (nx, ny + P), law)
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
        law, zero = line(curvature=-1.0), 0 * m
        y = [zero - np.sin(a), zero + np.cos(a), zero + a, m]
        y = load = march(y, (0, a), lambda X: (nx, ny), law)
        y = march(y, (0, a), lambda X: (nx, ny + P), law)
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
    law, targets = line(EI / (EA * L**2)), np.atleast_1d(np.asarray(v, dtype=float)) / L

    def member(z, down):
        nx, ny, m = z
        zero = 0 * m
        y = march([zero, zero, zero + angle, m], (0, 1), lambda X: (nx, ny), law)
        return np.array([y[0] - np.cos(angle), y[1] - np.sin(angle) + down, y[2] - angle]), z

    state, at, loads = np.zeros(3), 0.0, []
    for target in targets:
        for down in np.linspace(at, target, 1 + max(1, int(np.ceil(abs(target - at) / 0.005))))[1:]:
            state = _newton(lambda z, down=down: member(z, down), state)[0]
        at = target
        loads.append(0.0 - 2 * state[1] * EI / L**2)
    return np.array(loads) if np.ndim(v) else float(loads[0])
