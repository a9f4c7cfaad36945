"""Pendulums of rigid rods."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from skfem_ancf.core.errors import InputError, require_positive


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
