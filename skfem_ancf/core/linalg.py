"""Banded matrices of chains of elements, over LAPACK."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import blas, eigh, lapack
from scipy.sparse import coo_matrix, csc_matrix, issparse

from .band import HALVES, SPARE, Band, solve
from .types import Array

#: Eigenvalue of a matrix of unit diagonal that is round-off.
SINGULAR = 4.0 * np.finfo(float).eps
#: What factors and eigenvalues raise: singular matrices, Arnoldi without convergence.
NO_FACTORS = np.linalg.LinAlgError, RuntimeError
#: Pivot of a matrix of unit diagonal below which its smallest eigenvalue may be round-off.
SMALL = 1e-7
#: Growth of the entries of a matrix of unit diagonal at which a pivot block is made larger.
GROWTH = 1e2


def dense(A: Any) -> Array:
    """A sparse or dense matrix as a dense one in C order."""
    return A.toarray(order="C") if issparse(A) else np.ascontiguousarray(A)


class Inertia(NamedTuple):
    """Signs of the eigenvalues of a symmetric matrix, on the tangent space of the constraints.

    Attributes
    ----------
    negative : int
        Number of negative eigenvalues.
    singular : bool
        An eigenvalue is zero to round-off.
    """

    negative: int
    singular: bool


def halves(n: int, bandwidth: int) -> Band:
    """A :class:`~skfem_ancf.core.band.Band` in two halves.

    Parameters
    ----------
    n, bandwidth
        Numbers of rows, and of subdiagonals.
    """
    ld = 2 * (bandwidth + 1 + SPARE)
    return Band(np.zeros(n * ld), np.zeros(0, np.int64), ld, bandwidth, HALVES)


def beside_zero(negative: Callable[[float], int]) -> Inertia:
    """The :class:`Inertia` of a matrix, from the negative eigenvalues of those beside it.

    ``negative`` is a function of the shift, relative to the diagonal. What changes its sign
    between two shifts of round-off is zero.
    """
    below, above = negative(-SINGULAR), negative(SINGULAR)
    return Inertia(above, below != above)


@lru_cache(32)
def _lower(m):
    """The lower half of ones, shape (m, m)."""
    return np.tri(m)


class BandMatrix:
    """A square band matrix that is filled element by element and factorised by LAPACK.

    Parameters
    ----------
    n
        Number of rows.
    bandwidth
        Number of subdiagonals, and of superdiagonals.
    symmetric
        Store and factorise the lower half only: Cholesky, or LU where it is not positive
        definite.

    Other Parameters
    ----------------
    i, j, values
        Rows, columns and values of entries, shape (k,).
    """

    def __init__(self, n: int, bandwidth: int, symmetric: bool = True) -> None:
        self.n, self.bandwidth, self.symmetric = n, bandwidth, symmetric
        # gbtrf wants space for the pivots, the lower half zeros that vectors may reach to
        self._ld = bandwidth + 1 + SPARE if symmetric else 3 * bandwidth + 1
        self._diagonal = 0 if symmetric else 2 * bandwidth
        self._flat = np.zeros(n * self._ld)
        #: What kernels take: a view of the entries, and space for their factors.
        self.band = Band(self._flat, np.zeros(n, np.int64), self._ld, bandwidth, self._diagonal)
        ab = self._flat.reshape(n, self._ld).T
        #: LAPACK's band storage, a view of shape (rows, n).
        self.ab = ab[:-SPARE] if symmetric else ab
        self._rows = ab  # with the zeros behind it need not be copied to be multiplied
        self._factor: Any = None
        self.positive_definite: bool | None = None

    def clear(self) -> None:
        """Set every entry to zero."""
        self._flat.fill(0.0)
        self._factor = None

    def _blocks(self, start, step, m, count):
        """Diagonal blocks of size m at rows start, start + step, ...: a view (count, m, m)."""
        item, ld = self._flat.itemsize, self._ld
        return np.ndarray((count, m, m), float, self._flat, (start * ld + self._diagonal) * item,
                          (step * ld * item, item, (ld - 1) * item))

    def add_elements(self, K: Array, start: int, nd: int, left: Array) -> None:
        """Add element matrices that couple node k and k + 1 of a chain.

        Parameters
        ----------
        K
            Element matrices, shape (ne, 2 nd, 2 nd). Overwritten if the matrix is symmetric.
        start
            Row of the first coordinate of node 0.
        nd
            Coordinates of a node.
        left
            Left node of each element, increasing, shape (ne,).
        """
        m = 2 * nd
        if self.symmetric:  # the upper half falls on entries of other elements
            K *= _lower(m)
        view = self._blocks(start, nd, m, int(left[-1]) + 1)
        if left[-1] - left[0] == len(left) - 1:
            first = int(left[0])
            view[first::2] += K[0::2]
            view[first + 1::2] += K[1::2]
        else:
            view[left[0::2]] += K[0::2]
            view[left[1::2]] += K[1::2]

    def position(self, i: ArrayLike, j: ArrayLike) -> Array:
        """Where entries lie among the numbers of the band, rows and columns of shape (k,)."""
        return np.asarray(j) * self._ld + self._diagonal + np.asarray(i) - np.asarray(j)

    def add(self, i: ArrayLike, j: ArrayLike, values: ArrayLike) -> None:
        """Add entries; of a symmetric matrix those above the diagonal are ignored."""
        i, j, values = map(np.atleast_1d, (i, j, values))
        if self.symmetric:
            keep = i >= j
            i, j, values = i[keep], j[keep], values[keep]
        np.add.at(self._flat, self.position(i, j), values)

    def diagonal(self) -> Array:
        """A copy of the diagonal."""
        return self._flat[self._diagonal::self._ld].copy()

    def add_diagonal(self, values: Array) -> None:
        """Add values (n,) to the diagonal."""
        self._flat[self._diagonal::self._ld] += values
        self._factor = None

    def multiply(self, v: Array) -> Array:
        """The matrix times a vector (n,)."""
        if self.symmetric:
            return blas.dsbmv(self.bandwidth, 1.0, self._rows, v, lower=1)
        k = self.bandwidth
        if self.n <= 2 * k:  # scipy's wrapper refuses
            return self.tocsc() @ v
        return blas.dgbmv(self.n, self.n, k, k, 1.0, self.ab[k:], v)

    def combine(self, a: float, A: BandMatrix, b: float, B: BandMatrix) -> BandMatrix:
        """Fill with ``a A + b B``."""
        np.multiply(A._flat, a, out=self._flat)
        self._flat += b * B._flat
        self._factor = None
        return self

    def factorize(self) -> BandMatrix:
        """Factorise; raises ``numpy.linalg.LinAlgError`` if the matrix is singular."""
        if self.symmetric:
            c, info = lapack.dpbtrf(self.ab, lower=1)
            self.positive_definite = info == 0
            if info == 0:
                self._factor = ("pb", c)
                return self
        general = self.general()
        lu, pivots, info = lapack.dgbtrf(general.ab, self.bandwidth, self.bandwidth)
        if info != 0 or not np.all(np.isfinite(lu[2 * self.bandwidth])):
            raise np.linalg.LinAlgError("the matrix is singular")
        self._factor = ("gb", lu, pivots)
        return self

    def general(self) -> BandMatrix:
        """The same matrix with both halves; itself if it has them."""
        if not self.symmetric:
            return self
        general = BandMatrix(self.n, self.bandwidth, symmetric=False)
        ab, lower, top = general.ab, self.ab, 2 * self.bandwidth
        ab[top:] = lower
        for k in range(1, min(self.bandwidth + 1, self.n)):
            ab[top - k, k:] = lower[k, :self.n - k]
        return general

    def solve(self, b: Array) -> Array:
        """Solve with the factors; ``b`` of shape (n,) or (n, k)."""
        if self._factor is None:
            self.factorize()
        if self._factor[0] == "pb":
            return lapack.dpbtrs(self._factor[1], b, lower=1)[0]
        if self._factor[0] == "ldl":
            x = np.array(b, dtype=float)
            solve(self.band, x)
            return x
        return lapack.dgbtrs(self._factor[1], self.bandwidth, self.bandwidth, b,
                             self._factor[2])[0]

    def take_factors(self) -> None:
        """Note that the entries have been replaced by factors, of :mod:`skfem_ancf.core.band`."""
        self._factor = ("ldl",) if self.symmetric else ("gb", self.ab, self.band.pivots)

    def to_cholesky(self) -> None:
        """Turn factors of :meth:`take_factors` with positive D into those of Cholesky."""
        if self._factor[0] == "ldl":
            c = self.ab * np.sqrt(self.ab[0])
            c[0] = np.sqrt(self.ab[0])
            self._factor = ("pb", np.asfortranarray(c))

    @property
    def definite(self) -> bool:
        """True if it has factors that are those of a positive definite symmetric matrix."""
        if self._factor is None or not self.symmetric:
            return False
        if self._factor[0] == "ldl":
            return bool(np.minimum.reduce(self._flat[::self._ld]) > 0.0)
        return self._factor[0] == "pb"

    def pivots(self) -> Array:
        """The pivots of the factors of a symmetric matrix, that of Cholesky squared; (n,)."""
        if self._factor[0] == "pb":
            return self._factor[1][0] ** 2
        return self._flat[::self._ld].copy()

    def inertia(self) -> Inertia:
        """Signs of the eigenvalues of a symmetric matrix, from its factors.

        Cholesky says it where it succeeds. Else the matrix, scaled to a unit diagonal, is
        eliminated block by block along the chain; a block whose elimination makes entries grow is
        merged with the next one.

        Returns
        -------
        Inertia
            By Sylvester's law, as that of any symmetric matrix it is congruent to.

        Raises
        ------
        ValueError
            If the matrix is not symmetric.
        """
        if not self.symmetric:
            raise ValueError("the inertia is that of a symmetric matrix")
        if self._factor is None:
            self.factorize()
        diagonal = self.diagonal()
        if self.positive_definite and np.all(self.pivots() > SMALL * diagonal):
            return Inertia(0, False)
        return beside_zero(lambda shift: self.shifted(shift).negative())

    def negative(self) -> int:
        """The number of negative eigenvalues of a symmetric matrix, round-off counted too."""
        _, info = lapack.dpbtrf(self.ab, lower=1)
        if info == 0:
            return 0
        size = np.abs(self.diagonal())
        size[size == 0.0] = np.max(size)  # a diagonal may be zero where a beam has buckled
        return self._block_negative(1.0 / np.sqrt(size))

    def shifted(self, shift: float) -> BandMatrix:
        """The matrix plus ``shift`` times its diagonal's size."""
        out = BandMatrix(self.n, self.bandwidth, self.symmetric).combine(1.0, self, 0.0, self)
        out._flat[self._diagonal::self._ld] += shift * np.abs(self.diagonal())
        return out

    def _block_negative(self, scale):
        negative, n, width = 0, self.n, max(self.bandwidth, 1)
        first, last = 0, min(width, n)
        P = self._dense(first, last, first, last, scale)
        while True:
            values, X = eigh(P)
            if last == n:
                return negative + int(np.sum(values < 0.0))
            after = min(last + width, n)
            A = self._dense(last, after, last, after, scale)
            E = self._dense(first, last, last, after, scale)
            Y = X.T @ E
            used = values != 0.0
            update = Y[used].T @ (Y[used] / values[used, None])
            if np.max(np.abs(update)) <= GROWTH and not np.any(Y[~used]):
                negative += int(np.sum(values < 0.0))
                first, last, P = last, after, A - update
            else:
                # rows before these are eliminated: they are in P, and touch no later ones
                P = np.block([[P, E], [E.T, A]])
                last = after

    def _dense(self, i0, i1, j0, j1, scale):
        """Rows i0 to i1 and columns j0 to j1, scaled on both sides."""
        row, column = np.arange(i0, i1)[:, None], np.arange(j0, j1)
        inside = np.abs(row - column) <= self.bandwidth
        if self.symmetric:
            row, column = np.maximum(row, column), np.minimum(row, column)
        out = np.where(inside, self._flat[np.where(inside, self.position(row, column), 0)], 0.0)
        return scale[i0:i1, None] * out * scale[j0:j1]

    def determinant_sign(self) -> int:
        """The sign of the determinant, from the factors of :meth:`factorize`: 1 or -1."""
        if self._factor is None:
            self.factorize()
        if self._factor[0] == "pb":
            return 1
        _, lu, pivots = self._factor
        exchanges = int(np.sum(pivots != np.arange(self.n)))
        return -1 if (exchanges + int(np.sum(lu[2 * self.bandwidth] < 0.0))) % 2 else 1

    def symmetric_part(self) -> BandMatrix:
        """(A + A^T) / 2 as a symmetric band matrix."""
        out = BandMatrix(self.n, self.bandwidth)
        if self.symmetric:
            out._flat[:] = self._flat
            return out
        lower, ab, top = out.ab, self.ab, 2 * self.bandwidth
        lower[0] = ab[top]
        for k in range(1, min(self.bandwidth + 1, self.n)):
            lower[k, :self.n - k] = 0.5 * (ab[top + k, :self.n - k] + ab[top - k, k:])
        return out

    def skew_size(self, sizes: Array) -> tuple[float, float]:
        """The largest entries, without sign, of A - A^T and of A, of coordinates over their sizes.

        Parameters
        ----------
        sizes
            Of the coordinates, which have units of their own, shape (n,).
        """
        ab, top, n = self.ab, self._diagonal, self.n
        size, skew = float(np.max(np.abs(ab[top]) * sizes**2)), 0.0
        for k in range(1, min(self.bandwidth + 1, n)):
            both = sizes[k:] * sizes[:n - k]
            below = ab[top + k, :n - k] * both
            above = below if self.symmetric else ab[top - k, k:] * both
            size = max(size, float(np.max(np.abs(below))), float(np.max(np.abs(above))))
            skew = max(skew, float(np.max(np.abs(below - above))))
        return skew, size

    def toarray(self) -> Array:
        """The matrix as an array, shape (n, n)."""
        return self._dense(0, self.n, 0, self.n, np.ones(self.n))

    def tocsc(self) -> csc_matrix:
        """The matrix as a scipy.sparse array in CSC format, without the zeros of the band."""
        first = max(self._diagonal - self.bandwidth, 0)
        columns = self._flat.reshape(self.n, self._ld)[:, first:self._diagonal + self.bandwidth + 1]
        j, k = np.nonzero(columns)
        i, v = j + (k + first - self._diagonal), columns[j, k]
        if self.symmetric:
            off = i > j
            i, j, v = (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]),
                       np.concatenate([v, v[off]]))
        return coo_matrix((v, (i, j)), shape=(self.n, self.n)).tocsc()
