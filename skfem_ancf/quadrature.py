"""Gauss rules on the reference cell of a beam, given along the axis and across the section."""

import numpy as np


def gauss(n):
    """The n-point Gauss rule on [0, 1], exact to degree 2 n - 1: points (n,) and weights (n,)."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


def tensor(axis, section):
    """The product of a rule along the axis and one across the section.

    Parameters
    ----------
    axis, section
        Pairs of points and weights on [0, 1].

    Returns
    -------
    X, W
        Points (2, n) and weights (n,), the section running fastest: as scikit-fem's
        ``Basis(quadrature=(X, W))`` wants them.
    """
    (x, wx), (y, wy) = axis, section
    X = np.array([np.repeat(x, len(y)), np.tile(y, len(x))])
    return X, np.outer(wx, wy).ravel()


def lagrange(nodes, x):
    """Values at ``x`` of the Lagrange polynomials of ``nodes``, shape (len(x), len(nodes))."""
    nodes, x = np.asarray(nodes, dtype=float), np.asarray(x, dtype=float)
    out = np.ones((len(x), len(nodes)))
    for i, a in enumerate(nodes):
        for j, b in enumerate(nodes):
            if i != j:
                out[:, i] *= (x - b) / (a - b)
    return out
