"""A band matrix with a border, by its entries: how many of its eigenvalues are negative.

What solves with it are the texts of :mod:`skfem_ancf.border`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix

from .border import Border, Factors, factors_of, join, solve_bordered
from .linalg import SINGULAR, SMALL, BandMatrix, Inertia, beside_zero

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

    from .types import Array

#: Columns of a border that are solved for together where only the inertia is wanted.
COLUMNS = 64


def hold(K: BandMatrix, i: Array, j: Array, values: Array, springs: Array,
         loose: int = 0) -> tuple[Array, Array]:
    """Add entries and springs to a band matrix, and factorise it.

    Parameters
    ----------
    K, i, j, values, springs, loose
        As for :class:`BorderedMatrix`: the matrix, entries of shapes (k,), coordinates (s,), and
        how many of them are loose.

    Returns
    -------
    picked, S
        The matrix with its entries and without springs is ``K + P^T S P``; the rows of P pick the
        coordinates ``picked``: springs, and what lies outside of the band.
    """
    inside = np.abs(i - j) <= K.bandwidth
    K.add(i[inside], j[inside], values[inside])
    diagonal = np.abs(K.diagonal())
    stiffness = diagonal[springs]
    loosely = np.arange(len(springs)) >= len(springs) - loose
    stiffness[loosely | (stiffness == 0.0)] += np.mean(diagonal)
    K.add(springs, springs, stiffness)
    K.factorize()
    return border(K.bandwidth, i, j, values, springs, stiffness)


def border(bandwidth: int, i: Array, j: Array, values: Array, springs: Array,
           stiffness: Array) -> tuple[Array, Array]:
    """What :func:`hold` returns, of springs of a given stiffness.

    Parameters
    ----------
    bandwidth
        Of the matrix.
    i, j, values, springs
        As for :class:`BorderedMatrix`, shapes (k,) and (s,).
    stiffness
        Of the springs, shape (s,).
    """
    outside = np.abs(i - j) > bandwidth
    i, j, values = i[outside], j[outside], values[outside]
    far, where = np.unique(np.append(i, j), return_inverse=True)
    picked, ns = np.append(springs, far), len(springs)
    S = np.zeros((len(picked), len(picked)))
    S[np.arange(ns), np.arange(ns)] = -stiffness
    np.add.at(S, (ns + where[:len(i)], ns + where[len(i):]), values)
    return picked, S


def border_inertia(K: BandMatrix, picked: Array, S: Array, J: Array) -> Inertia:
    """The :class:`Inertia` of ``K + P^T S P`` on the null space of J.

    By Haynsworth: with ``S = V L V^T`` and ``C = [P^T V, J^T]`` the matrix
    ``[K, C; C^T, -L^-1 (+) 0]`` has as many negative eigenvalues as K and
    ``-(L^-1 (+) 0) - C^T K^-1 C`` together, and as ``-L^-1`` and the bordered matrix together; the
    latter has one more for each row of J than the matrix on its null space.

    Parameters
    ----------
    K : BandMatrix
        Symmetric, held by springs.
    picked, S
        What :func:`hold` returned, shapes (k,) and (k, k); S symmetric.
    J
        Shape (m, n).
    """
    negative, smallest = border_negative(K.negative(), columns_product(K, picked, J), S, len(J))
    if negative == 0 and smallest > SMALL and K.positive_definite:
        return Inertia(0, False)

    def of(shift):
        beside = K.shifted(shift)
        return border_negative(beside.negative(), columns_product(beside, picked, J), S, len(J))[0]

    return beside_zero(of)


def gives_way(f: Factors) -> bool:
    """False if a matrix, symmetric with a border, is positive definite where J x = 0.

    As in :func:`border_inertia`, where K is positive definite; the matrix of the border times S
    from both sides is ``[S, 0; 0, 1] H``, which factors have. What is too close to zero to tell
    gives way.

    Parameters
    ----------
    f
        A :class:`~skfem_ancf.border.Factors`.
    """
    k = len(f.S)
    n = len(f.H)
    size = np.ones(n)
    size[:k] = np.sqrt(np.abs(f.S).max(axis=1, initial=0.0))
    size[size == 0.0] = 1.0
    both = np.zeros((n + k, n + k))  # with -S beside it, for the directions that S adds
    both[:n, :n], both[n:, n:] = f.H, -f.S / (size[:k, None] * size[:k])
    both[:k, :n] = f.S @ f.H[:k]
    both[:n, :n] /= size[:, None] * size
    values = np.linalg.eigvalsh(both, "U")
    least = SINGULAR * max(-values[0], values[-1])
    return np.sum(values > least) - np.sum(values < -least) != len(f.J)


def columns_product(K: BandMatrix, picked: Array, J: Array) -> Array:
    """C K^-1 C^T of a factorised band matrix.

    Parameters
    ----------
    K : BandMatrix
        With factors.
    picked
        Coordinates that the first rows of C pick, shape (k,).
    J
        The other rows of C, shape (m, n).

    Returns
    -------
    ndarray
        Shape (k + m, k + m).
    """
    k = len(picked)
    C = np.zeros((k + len(J), K.n))
    C[np.arange(k), picked] = 1.0
    C[k:] = J
    out = np.empty((len(C), len(C)))
    for first in range(0, len(C), COLUMNS):
        some = slice(first, first + COLUMNS)
        Z = K.solve(np.asfortranarray(C[some].T))
        out[:k, some], out[k:, some] = Z[picked], J @ Z
    return out


def border_negative(held: int, product: Array, S: Array, m: int) -> tuple[int, float]:
    """The number of negative eigenvalues, and the smallest eigenvalue of the border, scaled.

    Parameters
    ----------
    held
        The number of negative eigenvalues of the band matrix.
    product
        What :func:`columns_product` returned, shape (k + m, k + m).
    S, m
        As for :func:`border_inertia`, shape (k, k), and the number of rows of J.
    """
    n = len(S)
    size = 1.0 / np.sqrt(np.abs(np.diag(product)[:n]))
    size[~np.isfinite(size)] = 1.0
    values, V = np.linalg.eigh(S / (size[:, None] * size))
    keep = np.abs(values) > SINGULAR * np.max(np.abs(values), initial=0.0)
    values, V = values[keep], size[:, None] * V[:, keep]
    k = len(values)
    G = np.empty((k + m, k + m))
    G[:k, :k] = V.T @ product[:n, :n] @ V
    G[np.arange(k), np.arange(k)] += 1.0 / values
    G[k:, :k] = product[n:, :n] @ V
    G[:k, k:] = G[k:, :k].T
    G[k:, k:] = product[n:, n:]
    size = np.sqrt(np.abs(np.diag(G)))
    size[size == 0.0] = 1.0
    mu = np.linalg.eigvalsh(0.5 * (G + G.T) / (size[:, None] * size))
    negative = held + int(np.sum(mu > 0.0)) - int(np.sum(values > 0.0)) - m
    return negative, float(np.min(np.abs(mu), initial=1.0))


class BorderedMatrix:
    """Solves ``[A, J^T; J, 0] [x; l] = [b; c]`` by the factors of a band matrix.

    ``A`` is the band matrix plus a few entries outside of its band. Coordinates in ``springs``
    are held by springs before the band is factorised, and let go in the border, because a beam
    that only joints hold has a singular matrix of its own.

    Parameters
    ----------
    K : BandMatrix
        With its supports fixed. Springs, and the entries that lie in the band, are added to it.
    J
        Shape (m, n), dense and small.
    i, j, values
        Entries to add to K, of both halves where it is symmetric, shapes (k,).
    springs
        Coordinates to hold, shape (s,).
    loose
        How many of the last of them have no stiffness of their own.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular.
    """

    def __init__(self, K: BandMatrix, J: Array, i: Array, j: Array, values: Array,
                 springs: Array, loose: int = 0) -> None:
        picked, S = hold(K, i, j, values, springs, loose)
        none = np.zeros(0, np.int64)
        self._K, self._J = K, J
        self._border = Border(picked, len(springs), loose, none, none, none, none, 0)
        self.factors = factors_of(K.band, K.factors, np.array(J), S)
        join(self.factors, self._border, np.ones(J.shape[1]))
        finite = np.all(np.isfinite(self.factors.H))
        self._sign = int(np.linalg.slogdet(self.factors.H)[0]) if finite else 0
        if self._sign == 0:
            raise np.linalg.LinAlgError("the matrix is singular")

    def inertia(self) -> Inertia:
        """The :class:`Inertia` of A where J x = 0; of its symmetric part if K is not symmetric."""
        K = self._K if self._K.symmetric else self._K.symmetric_part()
        return border_inertia(K, self._border.picked, self.factors.S, self._J)

    def determinant_sign(self) -> int:
        """The sign of the determinant of A where J x = 0: 1 or -1."""
        return self._K.determinant_sign() * self._sign

    def tocsc(self) -> csc_matrix:
        """A as a scipy.sparse array in CSC format."""
        picked, S = self._border.picked, self.factors.S
        rows = np.broadcast_to(picked[:, None], S.shape)
        outside = coo_matrix((S.ravel(), (rows.ravel(), rows.T.ravel())), (self._K.n, self._K.n))
        return self._K.tocsc() + outside.tocsc()

    def solve(self, b: Array, c: Array) -> tuple[Array, Array, float]:
        """The solution, and how large the correction by one refinement was, relative to x.

        Parameters
        ----------
        b
            Shape (n,).
        c
            Shape (m,).

        Returns
        -------
        x, l, correction
            Shapes (n,) and (m,), and a number.
        """
        x, l = np.empty(len(b)), np.empty(len(c))
        error = float(solve_bordered(self.factors, self._border, b, c, x, l))
        if error < 0.0:
            raise np.linalg.LinAlgError("the matrix is singular")
        return x, l, error
