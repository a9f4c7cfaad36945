"""Gauss rules along the axis and across the section of the reference cell; polynomials on it."""

from functools import lru_cache
from math import comb, perm

import numpy as np
import scipy

from .errors import refuse, require_finite, require_integer
from .immutable import read_only
from .types import Array, ArrayLike, Rule

#: Largest number of points.
MAX_POINTS = 1000


def gauss(n: int) -> Rule:
    """n-point Gauss rule on [0, 1], exact to degree 2 n - 1: points (n,) and weights (n,)."""
    # The arrays are read-only.
    if type(n) is not int or not 1 <= n <= MAX_POINTS:
        n = require_integer("the number of Gauss points n", n, 1, MAX_POINTS)
    return _gauss(n)


@lru_cache(64)
def _gauss(n: int) -> Rule:
    x, w = np.polynomial.legendre.leggauss(n)
    return read_only(0.5 * (x + 1.0)), read_only(0.5 * w)


def gauss_lobatto(n: int) -> Array:
    """The n >= 2 Gauss-Lobatto points on [-1, 1], exactly antisymmetric."""
    n = require_integer("the number of Gauss-Lobatto points n", n, 2, MAX_POINTS)
    return _lobatto(n).copy()


@lru_cache(64)
def _lobatto(n: int) -> Array:
    inner = scipy.special.roots_jacobi(n - 2, 1.0, 1.0)[0] if n > 2 else np.zeros(0)
    return np.concatenate([[-1.0], 0.5 * (inner - inner[::-1]), [1.0]])


def tensor(axis: Rule, section: Rule) -> Rule:
    """Tensor product of rules along the axis and across the section."""
    # Returns points (2, n), the section fastest, and weights (n,), as for scikit-fem's
    # ``Basis(quadrature=(X, W))``.
    rules = []
    for name, rule in (("axis", axis), ("section", section)):
        refuse(not isinstance(rule, (tuple, list)) or len(rule) != 2, "{} must be a pair of points "
               "and weights, got {!r}", name, rule)
        x = require_finite(f"the points of {name}", rule[0], (None,))
        rules.append((x, require_finite(f"the weights of {name}", rule[1], x.shape)))
    return product_rule(*rules)


def product_rule(axis: Rule, section: Rule) -> Rule:
    """As :func:`tensor`, without checks."""
    (x, wx), (y, wy) = axis, section
    X = np.empty((2, len(x), len(y)))
    X[0], X[1] = x[:, None], y
    return X.reshape(2, -1), (wx[:, None] * wy).ravel()


def lagrange(nodes: ArrayLike, x: ArrayLike) -> Array:
    """Lagrange polynomials of nodes (n,) at points (m,), shape (m, n)."""
    nodes, x = np.asarray(nodes, dtype=float), np.array(x, ndmin=1)
    refuse(len(set(nodes.tolist())) < nodes.size, "nodes must be different, got {!r}", nodes)
    same = nodes[:, None] == nodes
    # factors (m, i, j) of the i-th polynomial, 1 for j = i
    factors = (x[:, None, None] - nodes) / (nodes[:, None] - nodes + same)
    return np.where(same, 1.0, factors).prod(axis=-1)


@lru_cache
def _hermite_coefficients(m: int, derivative: int) -> Array:
    """Factors of ``x^i (1 - x)^(n - i)`` in a derivative of the Hermite functions, n = 2 m - 1."""
    # Bernstein coefficients times binomials, (2 m, n + 1 - derivative): without cancellation, as
    # all have one sign (Farouki and Rajan, "On the numerical condition of polynomials in Bernstein
    # form", Computer Aided Geometric Design 4, 1987).
    n = 2 * m - 1
    left = [[comb(i, k) * perm(n, m) // perm(n, k) if i < m else 0 for i in range(n + 1)]
            for k in range(m)]
    rows = np.array(left + [[(-1) ** k * b for b in row[::-1]] for k, row in enumerate(left)],
                    dtype=object)
    rows = np.diff(rows, derivative, axis=1) * perm(n, derivative)
    rows = rows * [comb(n - derivative, i) for i in range(rows.shape[1])]
    return np.array(rows / perm(n, m), dtype=float)


#: Exponents of the largest degree, and beyond it.
_POWERS = np.arange(64)[:, None]


def hermite_basis(m: int, xi: ArrayLike, derivative: int = 0) -> Array:
    """Hermite functions of degree 2 m - 1 with derivatives 0 ... m-1 at 0, then at 1."""
    # Shape (2 m,) + xi.shape.
    x, degree = np.asarray(xi), 2 * m - 1 - derivative
    if degree < 0:
        return np.zeros((2 * m,) + x.shape)
    k, flat = _POWERS[:degree + 1], x.reshape(-1) + 0.0
    out = _hermite_coefficients(m, derivative) @ (flat**k * (1.0 - flat) ** k[::-1])
    return out.reshape((2 * m,) + x.shape)
