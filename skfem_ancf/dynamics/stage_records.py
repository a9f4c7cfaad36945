"""Named tuples of collocation: coefficients, prescribed functions, work arrays."""

from typing import NamedTuple

import numpy as np

from ..core.band import SPARE, Band
from ..core.source import F1, F2, F3
from .rates import JointMotions


class Method(NamedTuple):
    """Coefficients of a method of n points and k eigenvalues, one of each conjugate pair.

    Complex numbers have a first axis of length 2: real and imaginary part.
    """

    points: F1  # c, (n,)
    weights: F1  # b, (n,)
    first: F2  # A^-1
    second: F2  # A^-2
    values: F2  # mu, (2, k)
    to: F3  # rows of T^-1, (2, k, n)
    back: F3  # columns of T, doubled for pairs, (2, n, k)
    ahead: F2  # extrapolation from c to 1 + c by monomials of degree 2 and above, (n, n)


class Interval(NamedTuple):
    """Prescribed functions at the points and the end of s steps; one row if constant."""

    h: float  # step size
    begun: int  # 1 if there is a previous step
    ahead: F2  # Method.ahead for the first step
    times: F1  # (s (n + 1),)
    factors: F2  # of the loads, (s (n + 1), l)
    constrained: F3  # displacement, velocity and acceleration of fixed DOFs, (s (n + 1), 3, N)
    joints: JointMotions


class Points(NamedTuple):
    """Iterates, one row for each point, stored factors and work arrays; b low-rank rows."""

    y: F2  # u, v, acceleration at the start of the step, then at its end, (3, N)
    before: F2  # u, v at the start of the previous step, (2, N); U are its points
    Z: F2  # the unknowns, (n, N), as the next five
    U: F2  # displacement
    V: F2  # velocity
    W: F2  # acceleration
    R: F2  # residual and correction
    guess: F2  # initial Z
    l: F2  # multipliers, (n, m), as the next three
    dl: F2  # their correction
    first: F2  # initial multipliers
    gaps: F2  # residual of the joints' rates
    independent: F1  # independent stresses, (n s,)
    constitutive: F1  # stresses of the displacement, (n s,)
    missing: F1  # difference of both, (n s,)
    stresses: F2  # work, (3, s); the first row is zero
    x: F2  # work, (4, N)
    r: F1  # work, (2 b,)
    q: F2  # work, (2 b, 2 b)
    Q: F3  # Schur complement of the rows for each eigenvalue, (k, 2 b, 2 b)
    origin: F1  # displacement of the factorised matrix, (N,)
    B: F1  # strain gradients there
    pairs: F2  # factors of complex eigenvalues, real and imaginary parts, (k, 2 N ld)
    real: Band  # factor of the real eigenvalue
    J: F2  # low-rank rows at the origin, joints first, (b, N)
    Y: F3  # their solutions, (2 k, b, N)
    S: F3  # coupling of the other rows by displacement and velocity, (2, b - m, b - m)
    end: F3  # joint Jacobian at the end of the step and its solutions by the mass, (2, m, N)
    shared: F2  # their Schur complement, (m, m)
    shares: F1  # multipliers there, (m,)
    D: Band  # work: damping matrix
    method: Method


def new_points(method: Method, N: int, m: int, rows: int, stresses: int, gradients: int,
                    D: Band) -> Points:
    """The Points of a method, with zeros."""
    n, k, ld, b = method.points.size, method.values.shape[1], D.width + 1 + SPARE, m + rows
    real = Band(np.zeros(N * ld), np.zeros(0, np.int64), ld, D.width, 0)
    return Points._make([
        np.zeros((3, N)), np.zeros((2, N)), *np.zeros((6, n, N)), *np.zeros((4, n, m)),
        *np.zeros((3, n * stresses)), np.zeros((3, stresses)), np.zeros((4, N)), np.zeros(2 * b),
        np.zeros((2 * b, 2 * b)), np.zeros((k, 2 * b, 2 * b)), np.zeros(N), np.zeros(gradients),
        np.zeros((k, 2 * N * ld)), real, np.zeros((b, N)), np.zeros((2 * k, b, N)),
        np.zeros((2, rows, rows)), np.zeros((2, m, N)), np.zeros((m, m)), np.zeros(m), D, method])
