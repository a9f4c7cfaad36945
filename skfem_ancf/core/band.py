"""Band matrices of chains of elements, for kernels and with LAPACK. Symmetric: the lower half,
entry (i, j) at ``j * ld + i - j``, with :data:`SPARE` zeros after each column; L D L^T factors
replace it. Unsymmetric (``top`` > 0): entry (i, j) at ``j * ld + top + i - j``, the storage of
LAPACK's ``gbtrf``, whose factors replace it."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided
from scipy import sparse
from scipy.linalg import blas, eigh, lapack
from scipy.sparse.linalg import splu

from .callbacks import call_solver, handle_of
from .source import F1, F2, I1, apart, indices, primitive, shaped, source
from .types import Array, ArrayLike

#: Zeros after each column of a lower half, for vectorised loops over four columns.
SPARE = 6
#: Relative size of a pivot that is round-off.
LOST = 1e-13
#: Relative squared remainder of a redundant equation.
REPEATED = 1e-13
#: Eigenvalue that is round-off, for a unit diagonal.
SINGULAR = 4.0 * np.finfo(float).eps
#: Pivot below which the smallest eigenvalue may be round-off, for a unit diagonal.
SMALL = 1e-7
#: Growth of entries at which a pivot block is enlarged, for a unit diagonal.
GROWTH = 1e2


def dense(A: Any) -> Array:
    """A dense matrix in C order."""
    return A.toarray(order="C") if sparse.issparse(A) else np.ascontiguousarray(A)


class Inertia(NamedTuple):
    """Signs of the eigenvalues of a symmetric matrix: the number of negative ones, and whether one
    is zero to round-off."""

    negative: int
    singular: bool


def beside_zero(negative: Callable[[float], int]) -> Inertia:
    """The :class:`Inertia` from ``negative(shift)``, a count for a relative shift of the diagonal.
    An eigenvalue that changes sign between two shifts of round-off is zero."""
    below, above = negative(-SINGULAR), negative(SINGULAR)
    return Inertia(above, below != above)


class Band(NamedTuple):
    """A band matrix: entries, pivots of ``gbtrf``, and layout; see :class:`Coupling`."""

    flat: F1
    pivots: I1
    ld: int
    width: int
    top: int
    coupled: I1 = np.zeros(0, np.int64)


class BandMatrix(Band):
    """A square :class:`Band` that is assembled by element, multiplied, factorised and solved with.
    :meth:`factorize` leaves the entries: L D L^T of a positive definite matrix, pivoted LU of
    LAPACK of others. :func:`factorize` of kernels replaces them, without pivots unless the storage
    is that of ``gbtrf``; as ``factors`` they serve the matrix too."""

    factors: Any = None  # a Band

    @classmethod
    def zeros(cls, n: int, width: int, symmetric: bool = True) -> "BandMatrix":
        """A zero matrix (n, n) with ``width`` subdiagonals; the lower half only if symmetric."""
        top = 0 if symmetric else 2 * width  # space for the fill-in of gbtrf
        ld = top + width + 1 if top else width + 1 + SPARE
        return cls(np.zeros(n * ld), np.zeros(n, np.int64), ld, width, top)

    @property
    def n(self) -> int:
        return self.flat.size // self.ld

    @property
    def symmetric(self) -> bool:
        return self.top == 0

    # assembly

    def clear(self) -> None:
        self.flat.fill(0.0)
        self.factors = None

    def add_elements(self, K: Array, start: int, nd: int, left: Array) -> None:
        """Add matrices K (ne, 2 nd, 2 nd) that couple node k and k + 1 of a chain."""
        # ``start`` is the first row of node 0, ``nd`` the number of DOFs of a node, ``left`` (ne,)
        # the increasing left nodes. K is overwritten if the matrix is symmetric.
        m, item, ld = 2 * nd, self.flat.itemsize, self.ld
        if self.symmetric:  # the upper half would overlap other entries
            K *= np.tri(m)
        # diagonal blocks (m, m) at rows start, start + nd, ...
        view = np.ndarray((int(left[-1]) + 1, m, m), float, self.flat,
                          (start * ld + self.top) * item,
                          (nd * ld * item, item, (ld - 1) * item))
        if left[-1] - left[0] == len(left) - 1:
            first = int(left[0])
            view[first::2] += K[0::2]
            view[first + 1::2] += K[1::2]
        else:
            view[left[0::2]] += K[0::2]
            view[left[1::2]] += K[1::2]

    def position(self, i: ArrayLike, j: ArrayLike) -> Array:
        """Positions of entries (k,) in the flat storage."""
        return np.asarray(j) * self.ld + self.top + np.asarray(i) - np.asarray(j)

    def add(self, i: ArrayLike, j: ArrayLike, values: ArrayLike) -> None:
        """Add entries; of a symmetric matrix only those in the lower half count."""
        i, j, values = map(np.atleast_1d, (i, j, values))
        if self.symmetric:
            keep = i >= j
            i, j, values = i[keep], j[keep], values[keep]
        np.add.at(self.flat, self.position(i, j), values)

    def diagonal(self) -> Array:
        return self.flat[self.top::self.ld].copy()

    def add_diagonal(self, values: Array) -> None:
        """Add values (n,) to the diagonal."""
        self.flat[self.top::self.ld] += values
        self.factors = None

    def multiply(self, v: Array) -> Array:
        """The matrix times a vector (n,)."""
        out = np.empty(len(v))
        multiply(self, v, out)
        return out

    def combine(self, a: float, A: "BandMatrix", b: float, B: "BandMatrix") -> "BandMatrix":
        """Set to ``a A + b B``."""
        np.multiply(A.flat, a, out=self.flat)
        self.flat[:] += b * B.flat
        self.factors = None
        return self

    def factorize(self) -> "BandMatrix":
        """Factorise; LinAlgError if the matrix is singular."""
        if self.symmetric:
            self.factors = Band(self.flat.copy(), *self[1:5])
            if _cholesky(self.factors):
                return self
        self.factors, both = None, BandMatrix.zeros(self.n, self.width, symmetric=False)
        add_scaled(self, 0.0, both)
        if not factorize(both):
            raise np.linalg.LinAlgError("the matrix is singular")
        self.factors = both
        return self

    def solve(self, b: Array) -> Array:
        """Solve with the factors for ``b`` (n,) or (n, k)."""
        if self.factors is None:
            self.factorize()
        x = np.array(b.T, dtype=float, ndmin=2)
        solve_many(self.factors, x)
        return x.T.reshape(b.shape)

    @property
    def definite(self) -> bool:
        """True if it has factors with positive pivots."""
        known = self.factors
        return self.symmetric and known is not None and known.top == 0 and bool(
            np.minimum.reduce(known.flat[::known.ld]) > 0.0)

    def pivot_values(self) -> Array:
        """Pivots (n,) of the L D L^T factors."""
        return self.factors.flat[::self.factors.ld].copy()

    def inertia(self) -> Inertia:
        """Inertia of the symmetric part, by Sylvester's law."""
        if not self.symmetric:
            return self.symmetric_part().inertia()
        if self.factors is None:
            self.factorize()
        diagonal = self.diagonal()
        if self.definite and np.all(self.pivot_values() > SMALL * diagonal):
            return Inertia(0, False)
        return beside_zero(self.negative)

    def negative(self, shift: float = 0.0) -> int:
        """Number of negative eigenvalues of a symmetric matrix, including round-off, after the
        diagonal has grown by ``shift`` times its absolute value."""
        # If Cholesky fails, the matrix is eliminated block by block along the chain; blocks whose
        # elimination lets entries grow are merged with the next.
        if shift:
            moved = self._replace(flat=self.flat.copy())
            moved.flat[::self.ld] += shift * np.abs(self.diagonal())
            return moved.negative()
        _, info = lapack.dpbtrf(as_lapack(self), lower=1)
        if info == 0:
            return 0
        size = np.abs(self.diagonal())
        size[size == 0.0] = np.max(size)  # zero at a critical point
        scale = 1.0 / np.sqrt(size)
        negative, n, width = 0, self.n, max(self.width, 1)
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

    def _dense(self, i0, i1, j0, j1, scale):
        """Rows i0 to i1 and columns j0 to j1, scaled on both sides."""
        row, column = np.arange(i0, i1)[:, None], np.arange(j0, j1)
        inside = np.abs(row - column) <= self.width
        if self.symmetric:
            row, column = np.maximum(row, column), np.minimum(row, column)
        out = np.where(inside, self.flat[np.where(inside, self.position(row, column), 0)], 0.0)
        return scale[i0:i1, None] * out * scale[j0:j1]

    def determinant_sign(self) -> int:
        if self.factors is None:
            self.factorize()
        lu = self.factors
        odd = np.sum(lu.flat[lu.top::lu.ld] < 0.0)
        if lu.top > 0:  # exchanges
            odd += np.sum(lu.pivots != np.arange(self.n))
        return -1 if odd % 2 else 1

    def symmetric_part(self) -> "BandMatrix":
        """(A + A^T) / 2 as a symmetric band matrix."""
        out, A = BandMatrix.zeros(self.n, self.width), self.tocsc()
        S = sparse.tril(0.5 * (A + A.T))
        out.flat[out.position(S.row, S.col)] = S.data
        return out

    def toarray(self) -> Array:
        return self._dense(0, self.n, 0, self.n, np.ones(self.n))

    def tocsc(self) -> sparse.csc_matrix:
        n, w, stored = self.n, self.width, self.flat.reshape(-1, self.ld).T
        if self.symmetric:
            lower, stored = stored, np.zeros((2 * w + 1, n))
            for k in range(min(w + 1, n)):
                stored[w - k, k:] = stored[w + k, :n - k] = lower[k, :n - k]
        else:
            stored = stored[self.top - w:]
        return sparse.dia_matrix((stored, range(w, -w - 1, -1)), shape=(n, n)).tocsc()


class Coupling:
    """Sparse factors of a band matrix with entries anywhere beside it, while there are any.
    ``entries()`` returns rows, columns and values (k,) each; of a symmetric matrix of both halves.
    ``band`` is the matrix, whose ``coupled`` are the handle of this and 1 while it has the
    factors."""

    _lu: Any = None

    def __init__(self, A: BandMatrix, entries: Callable[[], tuple[Array, Array, Array]]) -> None:
        self.entries = entries
        self.band = A._replace(coupled=np.array([handle_of(self), 0], dtype=np.int64))

    def solve_into(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, x: Array,
                   dm: Array) -> None:
        """Solve in place of x (N,), or factorise if it is empty."""
        if x.size:
            x[:] = self._lu.solve(x)
            return
        A, (i, j, v) = self.band, self.entries()
        A.coupled[1] = len(v) > 0
        if len(v):
            self._lu = splu(A.tocsc() + sparse.csc_matrix((v, (i, j)), shape=(A.n, A.n)),
                            "MMD_AT_PLUS_A", 0.01, options={"SymmetricMode": True})


@source
def coupling(A, x):
    """Solve with the :class:`Coupling` of A in place of x, or factorise if it is empty."""
    none = x[:0]
    return call_solver(A.coupled[0], 0.0, none, none, none, none, x, none)


def as_lapack(A: Band) -> Array:
    """LAPACK's band storage, a view of shape (rows, n)."""
    ab = A.flat.reshape(-1, A.ld).T
    return ab if A.top > 0 else ab[:A.width + 1]


@primitive("skfem_ancf.core.loops")
def multiply(A, x, y):
    n, k = len(x), A.width
    ab = A.flat.reshape(-1, A.ld).T  # whole columns, of which BLAS needs no copy
    if A.top == 0:
        y[:] = blas.dsbmv(k, 1.0, ab, x, lower=1)
    elif n > 2 * k:
        y[:] = blas.dgbmv(n, n, k, k, 1.0, ab[k:], x)
    else:  # not supported by scipy's wrapper
        y[:] = BandMatrix(*A[:5]).toarray() @ x


@primitive("skfem_ancf.core.loops")
def add_multiple(c, x, y):
    y += c * x


@primitive("skfem_ancf.core.loops")
def factorize(A):
    """Factorise in place; False if a pivot is round-off. Only LAPACK's storage is pivoted."""
    # An indefinite symmetric matrix has L D L^T factors unless a leading submatrix is singular.
    if A.coupled.size > 0:
        if not coupling(A, A.flat[:0]):
            return False
        if A.coupled[1] > 0:
            return True
    ab = as_lapack(A)
    if A.top > 0:
        ab[:], A.pivots[:], info = lapack.dgbtrf(ab, A.width, A.width)
        return bool(info == 0 and np.all(np.isfinite(ab[A.top])))
    before = ab[0].copy()
    return bool(np.all(ab[0] >= LOST * before)) if _cholesky(A) else _eliminate(ab.T, LOST)


def _cholesky(A):
    """L D L^T of a symmetric band in place; False if it is not positive definite."""
    ab = as_lapack(A)
    c, info = lapack.dpbtrf(ab, lower=1)
    if info == 0:
        np.divide(c.T, c[0, :, None], out=ab.T)
        ab[0] = c[0] ** 2
    return info == 0


def _eliminate(columns, lost):
    """L D L^T without pivots of a symmetric band, columns (n, width + 1); False if one is lost."""
    # Entries of a row are ld - 1 apart, so that the next columns form a strided square, whose upper
    # triangle belongs to other entries.
    (n, k), stride = columns.shape, columns.itemsize
    lower = np.tri(k - 1).T  # rows are columns
    for j in range(n):
        m, d = min(k - 1, n - 1 - j), columns[j, 0]
        if not 0.0 < abs(d) < np.inf:
            return False
        if m:
            diagonal, below = columns[j + 1:j + 1 + m, 0], columns[j, 1:m + 1]
            before = np.abs(diagonal)
            left = as_strided(columns[j + 1:], (m, m), (columns.strides[0] - stride, stride))
            left -= lower[:m, :m] * (below / d)[:, None] * below
            if (np.abs(diagonal) < lost * before).any():
                return False
            below /= d
    return True


@primitive("skfem_ancf.core.loops")
def solve(A, x):
    """Solve in place with the factors; x is (n,)."""
    solve_many(A, x[None])


@primitive("skfem_ancf.core.loops")
def solve_dependent(S, b):
    """Solve in place of b a system S (m, m), which is work, with redundant equations."""
    # S is scaled to a unit diagonal; b becomes the minimum-norm solution in that scale. False if S
    # is zero or not finite.
    size = np.sqrt(np.abs(np.diagonal(S)))
    size[size == 0.0] = 1.0
    A = S / (size[:, None] * size)
    if not (np.isfinite(A).all() and A.any()):
        return False
    b[:] = np.linalg.lstsq(A, b / size, rcond=REPEATED)[0] / size
    return True


@primitive("skfem_ancf.core.loops")
def subtract_rows(J, x, out):
    """out -= J^T x."""
    out -= x @ J


@apart("bands", Band, F2, F2, F1, bool, F2, F2, F1, F1, returns=int)
def solve_joined(A, J, J1, free, anew, Y, S, b, x):
    """Project x onto J1 x = -b by multiples of the rows of ``Y = J A^-1``."""
    # A is factorised; J and J1 are (m, n), ``free`` (n,) selects columns of J. Y (m, n) is
    # recomputed if ``anew``; S (m, m) is work. b (m,) becomes the multipliers, x (n,) is reduced by
    # b Y. 0 if ``J1 Y^T`` is zero or not finite; redundant equations are allowed.
    if anew:
        for k in range(b.size):
            for i in indices(x.size):
                Y[k, i] = J[k, i] * free[i]
        solve_many(A, Y)
    np.dot(J1, Y.T, S)
    for k in range(b.size):
        b[k] += dot(J1[k], x)
    if not solve_dependent(S, b):
        return 0
    subtract_rows(Y, b, x)
    return 1


@apart("band", Band, Band, I1, F1, F1, returns=int)
def solve_definite(A, L, fixed, b, x):
    """x = A^-1 b by L D L^T factors in L, with these rows fixed; 0 unless A is definite."""
    fix(A, fixed)
    copy(A.flat, L.flat)
    copy(b, x)
    if not factorize(L):
        return 0
    rows = L.flat.reshape(x.size, L.ld)
    for j in range(x.size):
        if not rows[j, 0] > 0.0:
            return 0
    solve(L, x)
    return 1


@primitive("skfem_ancf.core.loops")
def solve_many(A, X):
    """X[k] = A^-1 X[k] for all k, with factors of A; X is (m, N)."""
    if A.coupled.size > 0 and A.coupled[1] > 0:
        for x in X:
            coupling(A, x)
        return
    if A.top > 0:
        X[:] = lapack.dgbtrs(as_lapack(A), A.width, A.width, X.T, A.pivots)[0].T
        return
    for x in X:
        solve_columns(A.flat, A.ld, A.width, x)


@primitive("skfem_ancf.core.loops")
def solve_columns(A, ld, width, x):
    """Solve in place with L D L^T factors A of a symmetric band, real or complex; x is (n,)."""
    ab = A.reshape(-1, ld).T  # whole columns, of which BLAS needs no copy
    tbsv = blas.ztbsv if A.dtype.kind == "c" else blas.dtbsv
    y = tbsv(width, ab, x, lower=1, diag=1) / ab[0]
    x[:] = tbsv(width, ab, y, lower=1, trans=1, diag=1)


@primitive("skfem_ancf.core.loops")
def factorize_complex(A, ld, width):
    """L D L^T of a complex symmetric band, stored as a real one, in place; False if it fails."""
    return _eliminate(A.reshape(-1, ld)[:, :width + 1], 0.0)


@source
def clear(x):
    for i in indices(x.size):
        x[i] = 0.0


@source
def copy(a, b):
    for i in indices(a.size):
        b[i] = a[i]


@source
def mirror(A):
    """Copy the lower half of an unsymmetric band to the upper half."""
    if A.top > 0:
        rows = A.flat.reshape(A.flat.size // A.ld, A.ld)
        for k in range(1, A.width + 1):
            later = rows[k:]
            for j in indices(later.shape[0]):
                later[j, A.top - k] = rows[j, A.top + k]


@source
def add_scaled(A, factor, U):
    """U = A + factor U, where U is unsymmetric."""
    n, top = A.flat.size // A.ld, U.top
    rows, both = shaped(A.flat, (n, A.ld)), shaped(U.flat, (n, U.ld))
    if A.top > 0:
        for j in indices(n):
            for k in indices(U.ld):
                both[j, k] = rows[j, k] + factor * both[j, k]
        return
    for k in range(min(A.width + 1, n)):
        later = both[k:]
        for j in indices(n - k):
            both[j, top + k] = rows[j, k] + factor * both[j, top + k]
        if k > 0:
            for j in indices(n - k):
                later[j, top - k] = rows[j, k] + factor * later[j, top - k]


@apart("band", Band, I1)
def fix(A, fixed):
    """Set rows and columns of these numbers to those of the identity."""
    fix_stored(A.flat, A.ld, A.width, A.top, fixed)


@source
def fix_stored(flat, ld, width, top, fixed):
    """:func:`fix` for stored entries."""
    n, step = flat.size // ld, max(1, ld - 1)
    for i in fixed:
        at = i * ld + top
        flat[i * ld:(i + 1) * ld] = 0.0
        flat[at - step * min(width, i):at:step] = 0.0
        if top > 0:
            flat[at + step:at + step * min(width, n - 1 - i) + 1:step] = 0.0
        flat[at] = 1.0


@source
def diagonal(A, d):
    rows = A.flat.reshape(A.flat.size // A.ld, A.ld)
    for j in indices(d.size):
        d[j] = rows[j, A.top]


@source
def add_to_diagonal(A, d):
    rows = A.flat.reshape(A.flat.size // A.ld, A.ld)
    for j in indices(d.size):
        rows[j, A.top] += d[j]


@primitive("skfem_ancf.core.loops")
def dot(a, b):
    return np.dot(a, b)


@primitive("skfem_ancf.core.loops")
def weighted_square(x, weights):
    return np.dot(x * x, weights)


@primitive("skfem_ancf.core.loops")
def smallest(x):
    return np.min(x)


@primitive("skfem_ancf.core.loops")
def farthest(weights, u, seen):
    """The largest distances of pairs u from seen (2 n,), by each row of weights (2, n), added."""
    places, others = np.maximum.reduce(weights * np.abs((u - seen).view(complex)), 1, initial=0.0)
    return places + others


@primitive("skfem_ancf.core.loops")
def largest(x):
    """Largest absolute value, 0 if empty."""
    return np.max(np.abs(x), initial=0.0)
