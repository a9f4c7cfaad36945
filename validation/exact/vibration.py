"""Frequencies of bending."""



import numpy as np
from scipy.optimize import brentq

from skfem_ancf.core.errors import require_positive

from .arguments import choose, count_of


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
    sign, first = choose(
        "ends", ends, {"fixed-free": (1, 0), "free-free": (-1, 1), "pinned-pinned": (0, 0)}
    )

    def equation(x):
        return np.cos(x) + sign * 2 * np.exp(-x) / (1 + np.exp(-2 * x))

    k = np.arange(first, first + count_of(n))
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
        Shear stiffness k_s G A (N), see :func:`exact.shear_factor`.
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
    >>> from exact import shear_factor
    >>> kGA = shear_factor(0.3) / 2.6
    >>> timoshenko_frequencies(1.0, 1 / 1200, 1.0, 1.0, 1.0, kGA, n=2).round(6).tolist()
    [0.100712, 0.60397]
    """
    choose("ends", ends, dict.fromkeys(("fixed-free", "free-free", "pinned-pinned")))
    n, L = count_of(n), require_positive("L", L)

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
