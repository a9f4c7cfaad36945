"""Rank, null spaces and inertia of sparse matrices."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..core.band import SMALL, Inertia, beside_zero, dense
from ..core import Array

#: Relative remainder of a dependent row.
DEPENDENT = 1e-9
#: Ratio of singular values that is zero to round-off.
FREE = 1e-9
#: Largest entry of L, with a unit diagonal of the matrix, for trusted pivots.
LARGEST = 1e6
#: Largest number of columns for dense matrices.
DENSE = 300
#: Largest number of null vectors of a sparse matrix, and number of iterations for them.
MOST, ITERATIONS = 8, 6


def is_symmetric(S: Any, sizes: Array, tol: float = 1e-12) -> bool:
    """True if a sparse matrix is symmetric to round-off, with sizes (n,) of its variables."""
    D = sparse.diags_array(sizes)
    S = D @ S @ D
    gap = abs(S - S.T)
    return not gap.nnz or bool(gap.max() <= tol * abs(S).max())


def groups(J: Array | sparse.csr_array) -> Iterator[tuple[Array, Array, Array]]:
    """Yield rows, columns and dense submatrices of groups of rows without a common column."""
    if isinstance(J, np.ndarray):
        columns, = J.any(axis=0).nonzero()
        if len(J):
            yield np.arange(len(J)), columns, J[:, columns]
        return
    J = sparse.csr_array(J)
    J.eliminate_zeros()
    entries = J.tocoo()
    found: list[Any] = []
    for block in blocks(entries.row, entries.col, *J.shape):
        shape = *block.rows.shape, block.columns.shape[1]
        A = np.bincount(block.places, entries.data[block.entries], int(np.prod(shape)))
        found += zip(block.rows, block.columns, A.reshape(shape))
    yield from sorted(found, key=lambda group: group[0][0])


class Block(NamedTuple):
    """Groups of equations of one size without a common DOF."""

    rows: Array  # equations of each group, (g, k)
    columns: Array  # DOFs of each group, (g, c)
    entries: Array  # numbers of the entries of J in these groups
    places: Array  # their positions in a flat array of shape (g, k, c)


def linked(rows: Array, columns: Array, m: int, n: int) -> tuple[int, Array]:
    """How many groups the rows and columns of a matrix (m, n) are linked to by entries (k,), and
    the group of each, (m + n,)."""
    links = sparse.coo_array((np.ones(len(rows)), (rows, m + columns)), (m + n, m + n))
    return connected_components(links, directed=False)


def blocks(rows: Array, columns: Array, m: int, n: int) -> list[Block]:
    """Independent groups of the rows of a matrix (m, n) with entries (k,)."""
    number, group = linked(rows, columns, m, n)
    (all_rows, row), (all_columns, column) = (_members(x, number) for x in (group[:m], group[m:]))
    shape = np.array([[len(x) for x in all_of] for all_of in (all_rows, all_columns)]).T
    out = []
    for k, c in np.unique(shape[shape[:, 0] > 0], axis=0):
        some = np.flatnonzero(np.all(shape == (k, c), axis=1))
        place = np.full(number, -1)
        place[some] = np.arange(len(some))
        entries = np.flatnonzero(place[group[rows]] >= 0)
        i, j = rows[entries], columns[entries]
        out.append(Block(np.array([all_rows[g] for g in some]),
                         np.array([all_columns[g] for g in some]).reshape(len(some), c), entries,
                         (place[group[i]] * k + row[i]) * c + column[j]))
    return out


def _members(group, number):
    """Members of each group, and the position of each member in its group."""
    order, count = np.argsort(group, kind="stable"), np.bincount(group, minlength=number)
    place, ends = np.empty(len(group), dtype=int), np.cumsum(count)
    place[order] = np.arange(len(group)) - np.repeat(ends - count, count)
    return [order[last - n:last] for n, last in zip(count, ends)], place


def inertia_of(A: Array | sparse.csr_array) -> Inertia:
    """The Inertia of a symmetric matrix, by pivots if it is sparse; LinAlgError if these fail."""
    size = np.abs(A.diagonal())
    if not len(size):
        return Inertia(0, False)
    size[size == 0.0] = np.max(size)
    if isinstance(A, np.ndarray):
        root = np.sqrt(size)
        values = np.linalg.eigvalsh(A / (root[:, None] * root))
        largest = max(1.0, values[-1])  # scale of the round-off
        return beside_zero(lambda shift: int(np.sum(values < -shift * largest)))
    scale, positive = sparse.diags(1.0 / np.sqrt(size)), np.all(A.diagonal() > 0.0)
    A, one = scale @ A @ scale, sparse.eye(len(size))
    try:
        if positive and np.all(_pivots(A) > SMALL):
            return Inertia(0, False)
    except np.linalg.LinAlgError:
        pass  # not definite
    return beside_zero(lambda shift: int(np.sum(_pivots(A + shift * one) < 0.0)))


def diagonal_factors(A: sparse.csc_array, order: str) -> Any:
    """Sparse LU of a symmetric matrix with all pivots on the diagonal, or None."""
    # ``order`` is a column ordering of :func:`scipy.sparse.linalg.splu`.
    try:
        lu = splu(A, order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # a pivot is zero
        return None
    return lu if np.array_equal(lu.perm_r, lu.perm_c) else None


def _pivots(A):
    """Pivots of a symmetric matrix with unit diagonal; LinAlgError if they are unreliable."""
    for order in ("MMD_AT_PLUS_A", "COLAMD"):
        lu = diagonal_factors(A.tocsc(), order)
        if lu is not None and np.max(np.abs(lu.L.data)) < LARGEST:
            return lu.U.diagonal()
    raise np.linalg.LinAlgError("the matrix is singular")


def determinant_sign(A: Array | sparse.csr_array) -> int:
    if isinstance(A, np.ndarray):
        return -1 if np.linalg.slogdet(A)[0] < 0.0 else 1
    lu, one = splu(A.tocsc()), sparse.eye(A.shape[0], format="csr")
    odd = np.sum(lu.U.diagonal() < 0.0)
    for order in (lu.perm_r, lu.perm_c):  # parity: a cycle of length k is k - 1 exchanges
        odd += len(order) - connected_components(one[order])[0]
    return -1 if odd % 2 else 1


def row_sizes(A: Array | sparse.csr_array) -> Array:
    """The largest absolute value of each row, shape (m,)."""
    if isinstance(A, np.ndarray) or not A.nnz:
        return np.zeros(A.shape[0]) if not A.size else np.abs(A).max(axis=1)
    return np.asarray(abs(A).max(axis=1).toarray()).ravel()


def unit_rows(A: Array | sparse.csr_array) -> Array | sparse.csr_array:
    """Scale rows to a largest entry of 1 and drop zero rows."""
    size = row_sizes(A)
    keep = size > 0.0
    if not keep.all():
        A, size = A[keep], size[keep]
    return A / size[:, None] if isinstance(A, np.ndarray) else sparse.diags(1.0 / size) @ A


def null_space(H: Array | sparse.csr_array) -> Array:
    """Orthonormal vectors (k, n) of the null space of H (r, n), whose rows have unit size."""
    # With more than :data:`DENSE` columns at most :data:`MOST` vectors are found.
    n = H.shape[1]
    if not H.shape[0]:
        return np.eye(n)[:n if n <= DENSE else MOST]
    if n <= DENSE:
        H = H if isinstance(H, np.ndarray) else dense(H)
        _, sigma, V, info = scipy.linalg.lapack.dgesdd(
            H if len(H) <= 4 * n else np.linalg.qr(H, mode="r"))
        if info != 0:
            raise np.linalg.LinAlgError("the singular values were not found")
        return V[np.count_nonzero(sigma > FREE * sigma[0]):]
    # inverse iteration with H^T H + small^2, in a form with the root of its condition number
    small = 0.1 * FREE
    lu = splu(sparse.bmat([[small * sparse.eye(H.shape[0]), H],
                                  [H.T, -small * sparse.eye(n)]], format="csc"))
    X = np.random.default_rng(0).standard_normal((n, MOST))
    for _ in range(ITERATIONS):
        X = np.linalg.qr(lu.solve(np.vstack([np.zeros((H.shape[0], MOST)), X]))[H.shape[0]:])[0]
    _, sigma, V = np.linalg.svd(np.linalg.qr(H @ X, mode="r"))
    largest = np.sqrt(sparse.linalg.norm(H, 1) * sparse.linalg.norm(H, np.inf))
    X = X @ V[sigma <= FREE * largest].T
    # sparse vectors, with few beams in each
    _, R, pivots = scipy.linalg.qr(X.T, mode="economic", pivoting=True)
    k = len(R)
    out = np.empty((k, n))
    out[:, pivots] = scipy.linalg.solve_triangular(R[:, :k], R)
    return out / np.linalg.norm(out, axis=1)[:, None]
