"""A band matrix with a border, by its entries.

What solves with it are the texts of :mod:`skfem_ancf.equations.border`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import lapack
from scipy.sparse import coo_matrix

from .border import Border, Factors, factors_of, join, mean_stiffness, solve_bordered, stiffen
from ..core.linalg import SINGULAR

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

    from ..core.linalg import BandMatrix
    from ..core.types import Array

#: No directions that are made stiff.
NONE_ALONG = np.zeros((0, 3), np.int64)
#: Eigenvalue of a border, of springs of unit stiffness, that may be round-off.
UNSURE = 1e-7


def hold(K: BandMatrix, i: Array, j: Array, values: Array, springs: Array, sizes: Array,
         loose: int = 0) -> tuple[Array, Array]:
    """Add entries and springs to a band matrix, and factorise it.

    Parameters
    ----------
    K, i, j, values, springs, sizes, loose
        As for :class:`BorderedMatrix`: the matrix, entries of shapes (k,), coordinates (s,), sizes
        of all (n,), and how many of them are loose.

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
    loosely |= stiffness == 0.0
    stiffness[loosely] += mean_stiffness(diagonal, sizes) / sizes[springs[loosely]]**2
    K.add(springs, springs, stiffness)
    K.factorize()
    i, j, values = i[~inside], j[~inside], values[~inside]
    far, where = np.unique(np.append(i, j), return_inverse=True)
    picked, ns = np.append(springs, far), len(springs)
    S = np.zeros((len(picked), len(picked)))
    S[np.arange(ns), np.arange(ns)] = -stiffness
    np.add.at(S, (ns + where[:len(i)], ns + where[len(i):]), values)
    return picked, S


def gives_way(f: Factors) -> bool:
    """False if a matrix, symmetric with a border, is positive definite where J x = 0.

    By Haynsworth, of a K that is: ``[K, C; C^T, -S^-1 (+) 0]`` with the columns ``C = [P^T, J^T]``
    has as many negative eigenvalues as the border's ``-(S^-1 (+) 0) - C^T K^-1 C``, and as
    ``-S^-1`` and the bordered matrix together, which has one more for each row of J. The
    matrix of the border times S from both sides is ``[S, 0; 0, 1] H``, which factors have. What
    is too close to zero to tell, as what springs hold of slender beams, gives way.

    Parameters
    ----------
    f
        A :class:`~skfem_ancf.equations.border.Factors`.
    """
    k, n = len(f.S), len(f.H)
    S = f.S / (f.scale[:k, None] * f.scale[:k])
    size = np.ones(n)
    size[:k] = np.sqrt(np.abs(S).max(axis=1, initial=0.0))
    size[size == 0.0] = 1.0
    both = np.zeros((n + k, n + k))  # with -S beside it, for the directions that S adds
    both[:n, :n], both[n:, n:] = f.H, -S / (size[:k, None] * size[:k])
    both[:k, :n] = S @ f.H[:k]
    both[:n, :n] /= size[:, None] * size
    values, _, info = lapack.dsyevd(both, compute_v=0)  # increasing, of the upper half
    if info != 0:
        raise np.linalg.LinAlgError("the eigenvalues of the border are not found")
    least = UNSURE * max(-values[0], values[-1])
    negative, others = values.searchsorted(-least), values.searchsorted(least, "right")
    return bool(len(values) - others - negative != len(f.J))


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
    sizes
        Those of all coordinates, 0 of fixed ones, whose diagonal is no stiffness; shape (n,).
    loose
        How many of the last of them have no stiffness of their own.
    along
        Rows of J along which K is made stiff, shape (k, 3), see
        :class:`~skfem_ancf.equations.border.Border`.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular.
    """

    def __init__(self, K: BandMatrix, J: Array, i: Array, j: Array, values: Array,
                 springs: Array, sizes: Array, loose: int = 0, along: Array = NONE_ALONG) -> None:
        size, stiffness = np.abs(K.diagonal()), np.zeros(len(J))
        for row, first, last in along.tolist():
            stiffness[row] = stiffen(K.band, size, J[row], first, last)
        picked, S = hold(K, i, j, values, springs, sizes, loose)
        none = np.zeros(0, np.int64)
        self._K, self._J = K, J
        self._border = Border(picked, len(springs), loose, none, none, none, none, 0, along)
        self.factors = factors_of(K.band, K.factors, np.array(J), S)
        self.factors.stiffness[:] = stiffness
        join(self.factors, self._border, np.ones(J.shape[1]))
        if not np.all(np.isfinite(self.factors.H)) or np.linalg.slogdet(self.factors.H)[0] == 0.0:
            raise np.linalg.LinAlgError("the matrix is singular")

    def is_definite(self) -> bool:
        """True if A is positive definite where J x = 0; False where one band does not tell.

        ``A + J^T W J`` with a stiff W is so then. Its band is that of A where each joint is of one
        place.
        """
        springs = self._border.picked
        if len(springs) > self._border.springs:
            return False
        K = self._K.symmetric_part()
        K.add(springs, springs, np.diag(self.factors.S))
        size = np.abs(K.diagonal())
        for row in self._J:
            at, = np.nonzero(row)
            if np.ptp(at) > K.bandwidth:
                return False
            v = row[at] * (np.sqrt(np.max(size[at])) / np.max(np.abs(row)))
            i, j = np.repeat(at, len(at)), np.tile(at, len(at))
            K.add(i, j, np.outer(v, v).ravel())
        try:
            return bool(K.shifted(-SINGULAR).factorize().positive_definite)
        except np.linalg.LinAlgError:  # a body's direction, which has no stiffness to go by
            return False

    def toarray(self) -> Array:
        """A as an array, stiff along directions, shape (n, n)."""
        A, at = self._K.toarray(), self._border.picked
        np.add.at(A, (at[:, None], at), self.factors.S)
        return A

    def tocsc(self) -> csc_matrix:
        """A as a scipy.sparse array in CSC format, stiff along directions."""
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
