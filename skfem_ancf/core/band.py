"""Band matrices as kernels and LAPACK see them.

Symmetric: the lower half, entry (i, j) at ``j * ld + i - j``, and :data:`SPARE` zeros behind each
column; its factors L D L^T take its place.
In two halves, ``top`` below 0: in each column that of the lower half, and behind it that of the
transpose's; its factors L D R^T take its place.
Else entry (i, j) at ``j * ld + top + i - j``, LAPACK's storage for ``gbtrf``, whose factors take
its place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided
from scipy.linalg import blas, lapack

from .source import F1, I1, indices, primitive, shaped, source
from .types import Array

#: Zeros behind each column of a lower half: compiled code works on four columns at once, by
#: vectors that may end there.
SPARE = 6
#: A pivot that small beside what it came from is round-off.
LOST = 1e-13
#: ``top`` of a matrix in two halves.
HALVES = -1
#: Rest of an equation of joints beside the others, of the square of its size, that is round-off.
REPEATED = 1e-13


class Band(NamedTuple):
    """A band matrix: its entries, the exchanges of ``gbtrf``, and its layout."""

    flat: F1
    pivots: I1
    ld: int
    width: int
    top: int


def as_lapack(A: Band) -> Array:
    """A view of LAPACK's band storage, shape (rows, n)."""
    ab = A.flat.reshape(-1, A.ld).T
    return ab if A.top > 0 else ab[:A.width + 1]


def _transposed(A):
    """The same of the transpose, of a matrix without exchanges."""
    first = A.ld // 2 if A.top < 0 else 0
    return A.flat.reshape(-1, A.ld).T[first:first + A.width + 1]


@primitive("skfem_ancf.core.loops")
def multiply(A, x, y):
    """y = A x."""
    n, k = len(x), A.width
    ab = as_lapack(A)
    if A.top == 0:
        y[:] = blas.dsbmv(k, 1.0, ab, x, lower=1)
    elif n > 2 * k:
        y[:] = blas.dgbmv(n, n, k, k, 1.0, ab[k:], x)
    else:  # scipy's wrapper refuses
        y[:] = ab[A.top] * x
        for d in range(1, min(k, n - 1) + 1):
            y[d:] += ab[A.top + d, :n - d] * x[:n - d]
            y[:n - d] += ab[A.top - d, d:] * x[d:]


@primitive("skfem_ancf.core.loops")
def add_multiple(c, x, y):
    """y += c x, of vectors; compiled for short ones."""
    y += c * x


@primitive("skfem_ancf.core.loops")
def factorize(A):
    """Factorise in place; False if a pivot is lost.

    A symmetric matrix is not pivoted: one that is not positive definite has factors L D L^T too,
    unless one of its leading parts is singular. Nor is one in two halves.
    """
    ab = as_lapack(A)
    if A.top < 0:
        return _eliminate(A)
    if A.top > 0:
        lu, A.pivots[:], info = lapack.dgbtrf(ab, A.width, A.width)
        ab[:] = lu
        return bool(info == 0 and np.all(np.isfinite(lu[A.top])))
    c, info = lapack.dpbtrf(ab, lower=1)
    if info != 0:
        return _eliminate(A)
    before, ab[0] = ab[0].copy(), c[0] ** 2
    ab[1:] = c[1:] / c[0]
    return bool(np.all(ab[0] >= LOST * before))


def _eliminate(A):
    """L D L^T, or L D R^T of two halves.

    From one column to the next an entry of a row is ld - 1 numbers on: what is left of the next
    columns is a square, and what of it is above the diagonal belongs to others.
    """
    columns, rows = (x.T for x in (as_lapack(A), _transposed(A)))
    n, stride = len(columns), columns.itemsize
    lower = np.tri(min(A.width, n - 1)).T  # its rows are columns
    both = ((columns, rows), (rows, columns))[:1 if A.top == 0 else 2]
    for j in range(n):
        m, d = min(A.width, n - 1 - j), columns[j, 0]
        if not abs(d) > 0.0:
            return False
        if m:
            diagonal = columns[j + 1:j + 1 + m, 0]
            before = np.abs(diagonal)
            for x, y in both:
                left = as_strided(x[j + 1:], (m, m), (stride * (A.ld - 1), stride))
                left -= lower[:m, :m] * (y[j, 1:m + 1] / d)[:, None] * x[j, 1:m + 1]
            if (np.abs(diagonal) < LOST * before).any():
                return False
            for x, _ in both:
                x[j, 1:m + 1] /= d
    return bool(np.all(np.isfinite(columns[:, 0])))


@primitive("skfem_ancf.core.loops")
def solve(A, x):
    """Solve in place with the factors; x is (n,)."""
    ab = as_lapack(A)
    if A.top > 0:
        x[:] = lapack.dgbtrs(ab, A.width, A.width, x, A.pivots)[0]
        return
    y = lapack.dtbtrs(ab, x, uplo="L", diag="U")[0].ravel() / ab[0]
    x[:] = lapack.dtbtrs(_transposed(A), y, uplo="L", trans="T", diag="U")[0].ravel()


@primitive("skfem_ancf.core.loops")
def dense_solve(A, b):
    """Solve in place of b, a vector; False if A is singular."""
    try:
        b[:] = np.linalg.solve(A, b)
    except np.linalg.LinAlgError:
        return False
    return True


@primitive("skfem_ancf.core.loops")
def solve_dependent(S, b):
    """Solve in place of b, a vector, equations of which some may repeat others.

    S, shape (m, m), is scaled to a unit diagonal and eliminated with complete pivots up to those
    that are round-off: the other equations determine what is left, up to what b does not say. Of
    all solutions b becomes the smallest in that scale. False if S is not finite or zero.
    """
    m, size = b.size, np.abs(np.diagonal(S)).copy()
    size[size == 0.0] = 1.0
    size = np.sqrt(size)
    A, y, order, rank = S / (size[:, None] * size), b / size, np.arange(m), m
    for j in range(m):
        left = np.abs(A[j:, j:])
        p, q = np.unravel_index(left.argmax(), left.shape)
        pivot = left[p, q]
        if not pivot < np.inf or j == 0 and pivot <= REPEATED:
            return False
        if pivot <= REPEATED:
            rank = j
            break
        A[[j, j + p]], y[[j, j + p]] = A[[j + p, j]], y[[j + p, j]]
        A[:, [j, j + q]], order[[j, j + q]] = A[:, [j + q, j]], order[[j + q, j]]
        c = A[j + 1:, j] / A[j, j]
        A[j + 1:, j:] -= np.outer(c, A[j, j:])
        y[j + 1:] -= c * y[j]
    x, free = np.zeros((m, m - rank + 1)), m - rank
    x[:rank, free], x[:rank, :free], x[rank:, :free] = y[:rank], -A[:rank, rank:], np.eye(free)
    x[:rank] = np.linalg.solve(np.triu(A[:rank, :rank]), x[:rank])
    for k in range(free):  # away from what changes nothing
        one = x[:, k] / np.sqrt(x[:, k] @ x[:, k])
        x[:, k + 1:] -= np.outer(one, one @ x[:, k + 1:])
    b[order] = x[:, free]
    b /= size
    return True


@primitive("skfem_ancf.core.loops")
def subtract_rows(J, x, out):
    """out -= J^T x."""
    out -= x @ J


@primitive("skfem_ancf.core.loops")
def solve_joined(A, J, J1, free, anew, Y, S, b, x):
    """Change x by multiples of the rows of ``Y = J A^-1`` so that ``J1 x`` becomes what -b was.

    Parameters
    ----------
    A
        With its factors.
    J, J1
        Shape (m, n).
    free
        The columns of J that are used, as ones and zeros.
    anew
        Make Y, shape (m, n), which is else taken as it is.
    S
        Becomes ``J1 Y^T``, shape (m, m).
    b, x
        Shapes (m,), (n,); b becomes what Y is multiplied by, subtracted from x.

    Returns
    -------
    bool
        False if S is not finite, or zero: equations that repeat others are met by these.
    """
    if anew:
        solve_many(A, J * free, Y)
    np.dot(J1, Y.T, out=S)
    b += J1 @ x
    if not solve_dependent(S, b):
        return False
    x -= b @ Y
    return True


def solve_many(A: Band, B: Array, X: Array) -> None:
    """X[k] = A^-1 B[k] for all k.

    Parameters
    ----------
    A
        A matrix that :func:`factorize` has factorised.
    B, X
        Right-hand sides and solutions, shape (m, N).
    """
    ab = as_lapack(A)
    if A.top > 0:
        X[:] = lapack.dgbtrs(ab, A.width, A.width, B.T, A.pivots)[0].T
        return
    y = lapack.dtbtrs(ab, B.T, uplo="L", diag="U")[0] / ab[0][:, None]
    X[:] = lapack.dtbtrs(_transposed(A), y, uplo="L", trans="T", diag="U")[0].T


@primitive("skfem_ancf.core.loops")
def factorize_complex(A, width):
    """L D L^T of a complex symmetric band, in place of its lower half; False if there is none.

    Parameters
    ----------
    A
        Real parts, then imaginary ones, each as of a symmetric :class:`Band`.
    width
        Half bandwidth.
    """
    ld = width + 1 + SPARE
    n, flat = A.size // (2 * ld), np.append(_complex(A), np.zeros((width + 1) * ld))
    for j in range(n):
        column = flat[j * ld:j * ld + width + 1]
        d = column[0]
        if not 0.0 < abs(d) < np.inf:
            return False
        below = column[1:].copy()
        column[1:] /= d
        later = np.lib.stride_tricks.as_strided(flat[(j + 1) * ld:], (width, width), (
            (ld - 1) * flat.itemsize, flat.itemsize))
        later -= np.triu(np.outer(column[1:], below))  # entries (i, k) of column j + 1 + k
    A[:A.size // 2], A[A.size // 2:] = flat[:n * ld].real, flat[:n * ld].imag
    return True


@primitive("skfem_ancf.core.loops")
def solve_complex(A, width, x, y):
    """Solve in place with the factors of :func:`factorize_complex`; x + i y is (n,)."""
    ab = _complex(A).reshape(x.size, -1)[:, :width + 1].T
    z = lapack.ztbtrs(ab, x + 1j * y, uplo="L", diag="U")[0].ravel() / ab[0]
    z = lapack.ztbtrs(ab, z, uplo="L", trans="T", diag="U")[0].ravel()
    x[:], y[:] = z.real, z.imag


def _complex(A):
    return A[:A.size // 2] + 1j * A[A.size // 2:]


@source
def clear(x):
    """x = 0."""
    for i in indices(x.size):
        x[i] = 0.0


@source
def copy(a, b):
    """b = a."""
    for i in indices(a.size):
        b[i] = a[i]


@source
def mirror(A):
    """Of a matrix that is not stored as symmetric: the upper half becomes as the lower."""
    if A.top > 0:
        rows = A.flat.reshape(A.flat.size // A.ld, A.ld)
        for k in range(1, A.width + 1):
            later = rows[k:]
            for j in indices(later.shape[0]):
                later[j, A.top - k] = rows[j, A.top + k]


@source
def add_halves(A, factor, U):
    """U = A + factor U, of which U stores two halves."""
    n, m, top = A.flat.size // A.ld, A.width + 1, A.top
    rows, both = shaped(A.flat, (n, A.ld)), shaped(U.flat, (n, 2, U.ld // 2))
    if top > 0:
        for k in range(min(m, n)):
            later = rows[k:]
            for j in indices(n - k):
                both[j, 0, k] = rows[j, top + k] + factor * both[j, 0, k]
                both[j, 1, k] = later[j, top - k] + factor * both[j, 1, k]
        return
    for i in range(2):
        for j in indices(n):
            for k in indices(m):
                both[j, i, k] = rows[j, k] + factor * both[j, i, k]


@source
def fix(A, fixed):
    """Rows and columns of these numbers become those of the identity."""
    fix_stored(A.flat, A.ld, A.width, A.top, fixed)


@source
def fix_stored(flat, ld, width, top, fixed):
    """The same of what a band stores."""
    n, step = flat.size // ld, max(1, ld - 1)
    for i in fixed:
        at = i * ld + max(top, 0)
        for k in indices(i * ld, (i + 1) * ld):
            flat[k] = 0.0
        for k in indices(at - step * min(width, i), at, step):
            flat[k] = 0.0
        if top > 0:
            for k in indices(at + step, at + step * min(width, n - 1 - i) + 1, step):
                flat[k] = 0.0
        if top < 0:
            back = at + ld // 2
            for k in indices(back - step * min(width, i), back, step):
                flat[k] = 0.0
        flat[at] = 1.0


@source
def diagonal(A, d):
    """The diagonal into d."""
    rows = A.flat.reshape(A.flat.size // A.ld, A.ld)
    for j in indices(d.size):
        d[j] = rows[j, A.top]


@primitive("skfem_ancf.core.loops")
def dot(a, b):
    """The product of two vectors."""
    return np.dot(a, b)


@primitive("skfem_ancf.core.loops")
def total(x):
    """The sum of a vector's numbers."""
    return np.sum(x)


@primitive("skfem_ancf.core.loops")
def smallest(x):
    """The smallest number of a vector."""
    return np.min(x)


@primitive("skfem_ancf.core.loops")
def largest(x):
    """The largest absolute value of a vector, 0 if it has none."""
    return np.max(np.abs(x), initial=0.0)


@primitive("skfem_ancf.core.loops")
def weighted(a, b, w):
    """The sum of a b w."""
    return np.dot(a * b, w)
