"""The reference cell of a beam and the interpolations along its axis."""

from __future__ import annotations

from functools import lru_cache
from math import comb, perm

import numpy as np
from numpy.typing import ArrayLike
from skfem.element import ElementH1
from skfem.refdom import RefLine, RefQuad, Refdom

from ..core.types import Array


#: Interpolation of sections with 1, 2, ... nodal derivatives along X, the 0th included.
SECTIONS = ("linear", "cubic", "quintic", "septic",
            *(f"of degree {degree}" for degree in (9, 11, 13, 15)))


class RefBeam(Refdom):
    """Unit square (xi, eta) with two vertices, at the middle of its left and right side.

    ``xi`` runs along the axis, ``eta`` across the section; the axis is ``eta = 1/2``. The facets
    are bottom, right, top, left as in scikit-fem's ``RefQuad``, whose quadrature is used (attribute
    ``refdom``). Bottom and top share their two vertices; left and right have one, listed twice.
    """

    p = np.array([[0.0, 1.0], [0.5, 0.5]])
    t = np.array([[0], [1]], dtype=np.int32)
    normals = RefQuad.normals
    facets = [[0, 1], [1, 1], [0, 1], [0, 0]]
    refdom = RefQuad
    brefdom = RefLine
    nnodes = 2
    nfacets = 4
    name = "Beam"

    @classmethod
    def on_facet(cls, i: int, X: Array) -> Array:
        """Whether reference points (2, n) are on facet i: bottom, right, top, left."""
        return (np.abs(X[1]) < 1e-4, np.abs(X[0] - 1) < 1e-4,
                np.abs(X[1] - 1) < 1e-4, np.abs(X[0]) < 1e-4)[i]


class ElementBeamP1(ElementH1):
    """Linear along the axis, constant across the section: for scalars such as a temperature."""

    nodal_dofs = 1
    maxdeg = 1
    dofnames = ["u"]
    doflocs = np.array([[0.0, 0.5], [1.0, 0.5]])
    refdom = RefBeam

    def lbasis(self, X: Array, i: int) -> tuple[Array, Array]:
        """The function of the left (0) or right (1) node at points (2, ...), and its gradient."""
        if i not in (0, 1):
            self._index_error()
        slope = 2.0 * i - 1.0
        return 1.0 - i + slope * X[0], np.array([slope + 0.0 * X[0], 0.0 * X[0]])


@lru_cache
def _hermite_coefficients(m: int, derivative: int) -> Array:
    """Factors of ``x^i (1 - x)^(n - i)`` in a derivative of the Hermite functions, n = 2 m - 1.

    Bernstein coefficients times binomials, (2 m, n + 1 - derivative): without cancellation, as all
    have one sign (Farouki and Rajan, "On the numerical condition of polynomials in Bernstein form",
    Computer Aided Geometric Design 4, 1987).
    """
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
    """Hermite functions of degree 2 m - 1 with derivatives 0 ... m-1 at 0, then at 1.

    Shape (2 m,) + xi.shape.
    """
    x, degree = np.asarray(xi), 2 * m - 1 - derivative
    if degree < 0:
        return np.zeros((2 * m,) + x.shape)
    k = _POWERS[:degree + 1]
    if x.ndim == 1:
        return _hermite_coefficients(m, derivative) @ ((x + 0.0)**k * (1.0 - x) ** k[::-1])
    return hermite_basis(m, x.ravel(), derivative).reshape((2 * m,) + x.shape)
