"""Records of collocation: the method, what is given, and work arrays."""

from typing import NamedTuple

import numpy as np

from ..core.band import SPARE, Band
from ..core.source import F1, F2, F3
from .rates import JointMotions


class Method(NamedTuple):
    """The numbers of a method of n points and k eigenvalues, one of each pair.

    Attributes
    ----------
    points, weights
        c and b.
    first, second
        A^-1 and its square.
    values, to, back
        mu, shape (2, k), rows of T^-1, (2, k, n), and columns of T, those of pairs twice, (2, n,
        k): real and imaginary parts.
    ahead
        Values at 1 + c of the polynomial without its first two terms, from those at c, (n, n).
    """

    points: F1
    weights: F1
    first: F2
    second: F2
    values: F2
    to: F3
    back: F3
    ahead: F2


class Interval(NamedTuple):
    """What is given of s steps, at the points and the end of each; one row where nothing varies.

    Attributes
    ----------
    h, begun
        Their size, and 1 if there is a step before the first.
    ahead
        As of the Method for the first step, from one before of another size.
    times, factors
        Shape (s (n + 1),), and of the loads there, (s (n + 1), l) or (1, l).
    constrained
        Displacement, velocity and acceleration of fixed coordinates, (s (n + 1), 3, N) or (1, ...).
    joints
        A :class:`~skfem_ancf.dynamics.rates.JointMotions`.
    """

    h: float
    begun: int
    ahead: F2
    times: F1
    factors: F2
    constrained: F3
    joints: JointMotions


class Points(NamedTuple):
    """What is found, a row for each point, and what of factors is kept.

    Attributes
    ----------
    y
        u, v and the acceleration at the begin of the step, then at its end, shape (3, N).
    before
        u and v at the begin of the step before, shape (2, N); U is that of its points.
    Z, U, V, W, R, guess
        The unknowns, displacement, velocity, acceleration, residual and correction, and where the
        iteration begins, shape (n, N).
    l, dl, first, gaps
        Multipliers, their correction, those at the begin of the iteration, and what rates of
        joints miss, (n, m).
    carried, own, missing
        Stresses that are carried, those of the displacement, and the difference, shape (n s,): as
        a body has them of which there are n.
    stresses
        Room, shape (3, s), the first row zero.
    x, r, q
        Room, shape (4, N), (2 b,) and (2 b, 2 b), with b rows beside the band.
    Q
        The matrix between these rows for each eigenvalue, shape (k, 2 b, 2 b).
    origin, B
        Where the factors were made, shape (N,), and with carried stresses the gradients there.
    pairs, real
        Factors of complex eigenvalues, real parts and imaginary ones, shape (k, 2 N ld), and of
        the real one, of which an odd number of points has one.
    J, Y, S
        The rows beside the band there, the joints' directions before those of the Matrices, (b, N),
        the solutions for them, (2 k, b, N), and what is between the latter by displacement and by
        velocity, (2, b - m, b - m).
    end, shared, shares
        The joints' directions at the end of the step, and solutions by the mass, (2, m, N), both
        together, (m, m), and multipliers there, (m,).
    D
        Room for the derivative of damping.
    method
        As above.
    """

    y: F2
    before: F2
    Z: F2
    U: F2
    V: F2
    W: F2
    R: F2
    guess: F2
    l: F2
    dl: F2
    first: F2
    gaps: F2
    carried: F1
    own: F1
    missing: F1
    stresses: F2
    x: F2
    r: F1
    q: F2
    Q: F3
    origin: F1
    B: F1
    pairs: F2
    real: Band
    J: F2
    Y: F3
    S: F3
    end: F3
    shared: F2
    shares: F1
    D: Band
    method: Method


def new_points(method: Method, N: int, m: int, rows: int, stresses: int, gradients: int,
                    D: Band) -> Points:
    """The Points of a method."""
    n, k, ld, b = method.points.size, method.values.shape[1], D.width + 1 + SPARE, m + rows
    real = Band(np.zeros(N * ld), np.zeros(0, np.int64), ld, D.width, 0)
    return Points._make([
        np.zeros((3, N)), np.zeros((2, N)), *np.zeros((6, n, N)), *np.zeros((4, n, m)),
        *np.zeros((3, n * stresses)), np.zeros((3, stresses)), np.zeros((4, N)), np.zeros(2 * b),
        np.zeros((2 * b, 2 * b)), np.zeros((k, 2 * b, 2 * b)), np.zeros(N), np.zeros(gradients),
        np.zeros((k, 2 * N * ld)), real, np.zeros((b, N)), np.zeros((2 * k, b, N)),
        np.zeros((2, rows, rows)), np.zeros((2, m, N)), np.zeros((m, m)), np.zeros(m), D, method])
