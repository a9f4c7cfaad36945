"""Band matrices of chains of elements, with LAPACK."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import blas, eigh, lapack
from scipy.sparse import coo_matrix, csc_matrix, issparse

from .band import HALVES, SPARE, Band, as_lapack, solve_many
from .types import Array

#: Eigenvalue that is round-off, for a unit diagonal.
SINGULAR = 4.0 * np.finfo(float).eps
#: Exceptions of factorisations and eigenvalue solvers.
NO_FACTORS = np.linalg.LinAlgError, RuntimeError
#: Pivot below which the smallest eigenvalue may be round-off, for a unit diagonal.
SMALL = 1e-7
#: Growth of entries at which a pivot block is enlarged, for a unit diagonal.
GROWTH = 1e2


def dense(A: Any) -> Array:
    """A dense matrix in C order."""
    return A.toarray(order="C") if issparse(A) else np.ascontiguousarray(A)


class Inertia(NamedTuple):
    """Signs of the eigenvalues of a symmetric matrix.

    Attributes
    ----------
    negative : int
        Number of negative eigenvalues.
    singular : bool
        True if an eigenvalue is zero to round-off.
    """

    negative: int
    singular: bool


def halves(n: int, bandwidth: int) -> Band:
    """A zero unsymmetric :class:`~skfem_ancf.core.band.Band` of n rows, stored in two halves."""
    ld = 2 * max(bandwidth + 1 + SPARE, (3 * bandwidth + 2) // 2)  # space for gbtrf too
    return Band(np.zeros(n * ld), np.zeros(n, np.int64), ld, bandwidth, HALVES)


def beside_zero(negative: Callable[[float], int]) -> Inertia:
    """The :class:`Inertia` from ``negative(shift)``, a count for a relative shift of the diagonal.

    An eigenvalue that changes sign between two shifts of round-off is zero.
    """
    below, above = negative(-SINGULAR), negative(SINGULAR)
    return Inertia(above, below != above)


@lru_cache(32)
def _lower(m):
    return np.tri(m)


class BandMatrix:
    """A square band matrix that is assembled by element and factorised by LAPACK.

    Parameters
    ----------
    n
        Number of rows.
    bandwidth
        Number of subdiagonals, and of superdiagonals.
    symmetric
        Store the lower half only; Cholesky factors, or LU if the matrix is indefinite.
    """

    def __init__(self, n: int, bandwidth: int, symmetric: bool = True) -> None:
        self.n, self.bandwidth, self.symmetric = n, bandwidth, symmetric
        # space for the fill-in of gbtrf; padding for vectorised loops over the lower half
        self._ld = bandwidth + 1 + SPARE if symmetric else 3 * bandwidth + 1
        self._diagonal = 0 if symmetric else 2 * bandwidth
        self._flat = np.zeros(n * self._ld)
        #: View of the entries for kernels, with space for pivots.
        self.band = Band(self._flat, np.zeros(n, np.int64), self._ld, bandwidth, self._diagonal)
        ab = self._flat.reshape(n, self._ld).T
        #: LAPACK's band storage, a view of shape (rows, n).
        self.ab = ab[:-SPARE] if symmetric else ab
        self._rows = ab  # with padding, so that dsbmv needs no copy
        self._factor: Any = None
        self.positive_definite: bool | None = None

    def clear(self) -> None:
        """Set every entry to zero."""
        self._flat.fill(0.0)
        self._factor = None

    def _blocks(self, start, step, m, count):
        """View (count, m, m) of diagonal blocks at rows start, start + step, ..."""
        item, ld = self._flat.itemsize, self._ld
        return np.ndarray((count, m, m), float, self._flat, (start * ld + self._diagonal) * item,
                          (step * ld * item, item, (ld - 1) * item))

    def add_elements(self, K: Array, start: int, nd: int, left: Array) -> None:
        """Add matrices K (ne, 2 nd, 2 nd) that couple node k and k + 1 of a chain.

        ``start`` is the first row of node 0, ``nd`` the number of DOFs of a node, ``left`` (ne,)
        the increasing left nodes. K is overwritten if the matrix is symmetric.
        """
        m = 2 * nd
        if self.symmetric:  # the upper half would overlap other entries
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
        """Positions of entries (k,) in the flat storage."""
        return np.asarray(j) * self._ld + self._diagonal + np.asarray(i) - np.asarray(j)

    def add(self, i: ArrayLike, j: ArrayLike, values: ArrayLike) -> None:
        """Add entries; of a symmetric matrix only those in the lower half count."""
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
        """Set to ``a A + b B``."""
        np.multiply(A._flat, a, out=self._flat)
        self._flat += b * B._flat
        self._factor = None
        return self

    def factorize(self) -> BandMatrix:
        """Factorise; LinAlgError if the matrix is singular."""
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
        """The matrix with both halves stored."""
        if not self.symmetric:
            return self
        general = BandMatrix(self.n, self.bandwidth, symmetric=False)
        ab, lower, top = general.ab, self.ab, 2 * self.bandwidth
        ab[top:] = lower
        for k in range(1, min(self.bandwidth + 1, self.n)):
            ab[top - k, k:] = lower[k, :self.n - k]
        return general

    def solve(self, b: Array) -> Array:
        """Solve with the factors for ``b`` (n,) or (n, k)."""
        if self._factor is None:
            self.factorize()
        if self._factor[0] == "pb":
            return lapack.dpbtrs(self._factor[1], b, lower=1)[0]
        if self._factor[0] == "ldl":
            x = np.array(b.T, dtype=float, ndmin=2)
            solve_many(self._factor[1], x, x)
            return x.T.reshape(b.shape)
        return lapack.dgbtrs(self._factor[1], self.bandwidth, self.bandwidth, b,
                             self._factor[2])[0]

    def take_factors(self, band: Band) -> None:
        """Take its factors of :mod:`skfem_ancf.core.band`, which may have replaced its entries."""
        ab = band.flat.reshape(self.n, self._ld).T
        self._factor = ("ldl", band) if self.symmetric else ("gb", ab, band.pivots)
        self.positive_definite = self.symmetric and bool(
            np.minimum.reduce(band.flat[::self._ld]) > 0.0)

    def to_cholesky(self) -> None:
        """Convert L D L^T factors with positive D to Cholesky factors."""
        if self._factor[0] == "ldl":
            ab = as_lapack(self._factor[1])
            c = ab * np.sqrt(ab[0])
            c[0] = np.sqrt(ab[0])
            self._factor = ("pb", np.asfortranarray(c))

    @property
    def definite(self) -> bool:
        """True if it has factors with positive pivots."""
        if self._factor is None or not self.symmetric:
            return False
        if self._factor[0] == "ldl":
            return bool(self.positive_definite)
        return self._factor[0] == "pb"

    def pivots(self) -> Array:
        """Pivots (n,) of the factors of a symmetric matrix."""
        if self._factor[0] == "pb":
            return self._factor[1][0] ** 2
        return self._factor[1].flat[::self._ld].copy()

    def inertia(self) -> Inertia:
        """Inertia of a symmetric matrix, by Sylvester's law.

        If Cholesky fails, the matrix is eliminated block by block along the chain; blocks whose
        elimination lets entries grow are merged with the next. ValueError if it is not symmetric.
        """
        if not self.symmetric:
            raise ValueError("the inertia needs a symmetric matrix")
        if self._factor is None:
            self.factorize()
        diagonal = self.diagonal()
        if self.positive_definite and np.all(self.pivots() > SMALL * diagonal):
            return Inertia(0, False)
        return beside_zero(lambda shift: self.shifted(shift).negative())

    def negative(self) -> int:
        """Number of negative eigenvalues of a symmetric matrix, including round-off."""
        _, info = lapack.dpbtrf(self.ab, lower=1)
        if info == 0:
            return 0
        size = np.abs(self.diagonal())
        size[size == 0.0] = np.max(size)  # zero at a critical point
        scale = 1.0 / np.sqrt(size)
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
                # earlier rows are eliminated: they are in P and do not couple to later ones
                P = np.block([[P, E], [E.T, A]])
                last = after

    def shifted(self, shift: float) -> BandMatrix:
        """The matrix plus ``shift`` times the absolute diagonal."""
        out = BandMatrix(self.n, self.bandwidth, self.symmetric).combine(1.0, self, 0.0, self)
        out._flat[self._diagonal::self._ld] += shift * np.abs(self.diagonal())
        return out

    def _dense(self, i0, i1, j0, j1, scale):
        """Rows i0 to i1 and columns j0 to j1, scaled on both sides."""
        row, column = np.arange(i0, i1)[:, None], np.arange(j0, j1)
        inside = np.abs(row - column) <= self.bandwidth
        if self.symmetric:
            row, column = np.maximum(row, column), np.minimum(row, column)
        out = np.where(inside, self._flat[np.where(inside, self.position(row, column), 0)], 0.0)
        return scale[i0:i1, None] * out * scale[j0:j1]

    def determinant_sign(self) -> int:
        """Sign of the determinant, 1 or -1."""
        if self._factor is None:
            self.factorize()
        if self._factor[0] != "gb":
            return -1 if int(np.sum(self.pivots() < 0.0)) % 2 else 1
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
        """Largest |entries| of A - A^T and of A, in units of the DOF sizes (n,)."""
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
        """A dense array, shape (n, n)."""
        return self._dense(0, self.n, 0, self.n, np.ones(self.n))

    def tocsc(self) -> csc_matrix:
        """A sparse matrix in CSC format."""
        first = max(self._diagonal - self.bandwidth, 0)
        columns = self._flat.reshape(self.n, self._ld)[:, first:self._diagonal + self.bandwidth + 1]
        j, k = np.nonzero(columns)
        i, v = j + (k + first - self._diagonal), columns[j, k]
        if self.symmetric:
            off = i > j
            i, j, v = (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]),
                       np.concatenate([v, v[off]]))
        return coo_matrix((v, (i, j)), shape=(self.n, self.n)).tocsc()
