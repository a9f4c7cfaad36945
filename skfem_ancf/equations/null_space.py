"""Factors of ``[K, J^T; J, 0]`` on the null space of J, for many joints or an indefinite K.

Each joint equation eliminates a DOF: ``x = T y + x_0`` with ``J T = 0``. The reduced matrix
``T^T K T`` is symmetric if K is, and its pivots give the inertia.
"""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..core.linalg import SMALL, BandMatrix, Inertia
from ..core.types import Array
from .signature import DEPENDENT, Block, blocks, diagonal_factors, inertia_of

logger = logging.getLogger(__name__)

#: Largest number of DOFs for the inertia of a dense matrix.
DENSE = 100
#: Largest relative residual of factors without pivoting.
ROUGH = 1e-8


def eliminated(A: Array) -> tuple[Array, Array, Array]:
    """Reduced row echelon forms of matrices (g, k, c), with complete pivoting.

    Returns
    -------
    pivots
        The pivot column of each row, (g, k).
    R, M
        ``M A = R``, (g, k, c) and (g, k, k): each pivot of R is 1 and alone in its column.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the rows are dependent.
    """
    g, k, c = A.shape
    size = np.max(np.abs(A), axis=2, initial=0.0)
    if not np.all(size):
        raise np.linalg.LinAlgError("a joint repeats a support")
    R = np.concatenate([A / size[:, :, None], np.broadcast_to(np.eye(k), (g, k, k))], axis=2)
    each, pivots, left = np.arange(g), np.empty((g, k), int), np.ones((g, k, 1))
    for _ in range(k):
        row, column = np.divmod(np.argmax(np.abs(R[:, :, :c] * left).reshape(g, -1), axis=1), c)
        pivot = R[each, row, column]
        if np.any(np.abs(pivot) <= DEPENDENT):
            raise np.linalg.LinAlgError("the joints are dependent in this state")
        R[each, row] /= pivot[:, None]
        factor = R[each, :, column]
        factor[each, row] = 0.0
        R -= factor[:, :, None] * R[each, row][:, None]
        pivots[each, row], left[each, row] = column, 0.0
    return pivots, R[:, :, :c], R[:, :, c:] / size[:, None]


class Pattern:
    """The sparsity pattern of a matrix, cached over iterations."""

    def __init__(self) -> None:
        self._band = np.zeros(0, bool)
        self._of: Any = None
        self._blocks: Any = None

    def of_band(self, K: BandMatrix) -> tuple[Any, Any, Any]:
        """Rows, columns and values of a band matrix, with zeros that were nonzero before."""
        flat = K.band.flat
        used = flat != 0.0
        if len(self._band) != len(used):
            self._band = used
        elif np.any(used > self._band):
            self._band = self._band | used
        at, = np.nonzero(self._band)
        j = at // K.band.ld
        i = j + at % K.band.ld - K.band.top
        below, = np.nonzero(i > j) if K.symmetric else (np.zeros(0, int),)
        return np.append(i, j[below]), np.append(j, i[below]), np.append(flat[at], flat[at[below]])

    def blocks(self, rows: Array, columns: Array, m: int, n: int) -> list[Block]:
        """The :func:`blocks` of J, cached."""
        of = self._blocks
        if of is None or not (np.array_equal(of[0], rows) and np.array_equal(of[1], columns)):
            of = self._blocks = rows, columns, blocks(rows, columns, m, n)
        return of[2]

    def csc(self, i: Array, j: Array, values: Array, n: int) -> sparse.csc_array:
        """The matrix (n, n) of entries (k,); duplicates are summed."""
        of = self._of
        if of is None or len(of[0]) != len(i) or not (
                np.array_equal(of[0], i) and np.array_equal(of[1], j)):
            places, where = np.unique(j * np.int64(n) + i, return_inverse=True)
            first = np.searchsorted(places, np.arange(n + 1) * np.int64(n)).astype(np.int32)
            of = self._of = i, j, where, (places % n).astype(np.int32), first
        data = np.bincount(of[2], values, len(of[3]))
        return sparse.csc_array((data, of[3], of[4]), shape=(n, n))


class NullSpace:
    """Sparse factors of ``[K, J^T; J, 0]``.

    ``entries`` are those of K outside of the band K; ``pattern`` is the last one of the system.
    """

    def __init__(self, K: BandMatrix, J: Any, entries: Any, constraints: Any,
                 pattern: Pattern) -> None:
        self._sizes, self._shape = s, (m, n) = constraints.coordinate_sizes, (constraints.m, K.n)
        i, j, v = (np.append(a, b) for a, b in zip(pattern.of_band(K), entries))
        self._K = pattern.csc(i, j, v * s[i] * s[j], n)
        self._groups, given = [], np.zeros(n, bool)
        rows, columns, values = J
        for block in pattern.blocks(rows, columns, m, n):
            (g, k), c = block.rows.shape, block.columns.shape[1]
            A = np.bincount(block.places, (values * s[columns])[block.entries], g * k * c)
            pivots, R, M = eliminated(A.reshape(g, k, c))
            at = np.take_along_axis(block.columns, pivots, axis=1)
            given[at] = True
            self._groups.append((block, at, R, M))
        self._T = self._basis(given)
        self._reduced = (self._T.T @ self._K @ self._T).tocsc()
        self._lu, self._plain = self._factors(K.symmetric)

    def _basis(self, given):
        """A basis (n, n - m) of the null space of J."""
        free = np.flatnonzero(~given)
        number = np.cumsum(~given) - 1
        parts = [(free, number[free], np.ones(len(free)))]
        for block, at, R, _ in self._groups:
            g, a, b = np.nonzero(R * ~given[block.columns][:, None])
            parts.append((at[g, a], number[block.columns[g, b]], -R[g, a, b]))
        i, j, v = map(np.concatenate, zip(*parts))
        return sparse.csc_array((v, (i, j)), shape=(len(given), len(free)))

    def _factors(self, symmetric):
        """LU factors, and whether all pivots are on the diagonal."""
        lu = diagonal_factors(self._reduced, "MMD_AT_PLUS_A") if symmetric else None
        return (splu(self._reduced), False) if lu is None else (lu, True)

    def solve(self, b: Array, c: Array) -> tuple[Array, Array]:
        """Solve for right-hand sides b (n,) and c (m,); returns x and l."""
        x, b, T = np.zeros(self._shape[1]), self._sizes * b, self._T
        for block, at, _, M in self._groups:
            x[at] = (M @ c[block.rows][:, :, None])[:, :, 0]
        right = T.T @ (b - self._K @ x)
        y = self._lu.solve(right)
        if self._plain:
            left = right - self._reduced @ y
            largest = np.max(np.abs(right) + abs(self._reduced) @ np.abs(y), initial=0.0)
            if np.max(np.abs(left), initial=0.0) > ROUGH * largest:
                logger.debug("factors without pivoting are not accurate")
                self._lu, self._plain = splu(self._reduced), False
                y = self._lu.solve(right)
            else:
                y += self._lu.solve(left)
        x += T @ y
        rest, l = b - self._K @ x, np.empty(self._shape[0])
        for block, at, _, M in self._groups:
            l[block.rows] = (M.transpose(0, 2, 1) @ rest[at][:, :, None])[:, :, 0]
        return self._sizes * x, l

    def reduced(self) -> Any:
        """K on the null space of J, dense if small."""
        return self._reduced.toarray() if self._shape[1] <= DENSE else self._reduced

    def inertia(self) -> Inertia:
        """Inertia of the symmetric part of K on the null space of J."""
        if self._plain:
            pivots, diagonal = self._lu.U.diagonal()[self._lu.perm_c], self._reduced.diagonal()
            if np.all(pivots > SMALL * np.abs(diagonal)):
                return Inertia(0, False)
        A = self.reduced()
        return inertia_of(0.5 * (A + A.T))
