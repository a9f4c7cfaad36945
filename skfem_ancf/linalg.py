"""Banded matrices of chains of elements, over LAPACK, and their borders."""

import numpy as np
from scipy.linalg import blas, lapack, lu_solve
from scipy.sparse import coo_matrix

#: Relative correction of a border's solution above which sparse LU is used.
INACCURATE = 1e-5


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
    """

    def __init__(self, n, bandwidth, symmetric=True):
        self.n, self.bandwidth, self.symmetric = n, bandwidth, symmetric
        # gbtrf wants room for the pivots; the lower half wants one spare row, so that the upper
        # half of an element matrix falls on places that no other entry of it has
        self._ld = bandwidth + 2 if symmetric else 3 * bandwidth + 1
        self._diagonal = 0 if symmetric else 2 * bandwidth
        self._flat = np.zeros(n * self._ld)
        self._factor = None
        self.positive_definite = None

    @property
    def ab(self):
        """LAPACK's band storage, a view of shape (rows, n)."""
        ab = self._flat.reshape(self.n, self._ld).T
        return ab[:-1] if self.symmetric else ab

    def clear(self):
        """Set every entry to zero."""
        self._flat.fill(0.0)
        self._factor = None

    def _blocks(self, start, step, m, count):
        """Diagonal blocks of size m at rows start, start + step, ...: a view (count, m, m)."""
        item, ld = self._flat.itemsize, self._ld
        return np.lib.stride_tricks.as_strided(
            self._flat[start * ld + self._diagonal:], (count, m, m),
            (step * ld * item, item, (ld - 1) * item), writeable=True)

    def add_elements(self, K, start, nd, left):
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
            K *= np.tri(m)
        view = self._blocks(start, nd, m, int(left[-1]) + 1)
        if left[-1] - left[0] == len(left) - 1:
            first = int(left[0])
            view[first::2] += K[0::2]
            view[first + 1::2] += K[1::2]
        else:
            view[left[0::2]] += K[0::2]
            view[left[1::2]] += K[1::2]

    def _position(self, i, j):
        return np.asarray(j) * self._ld + self._diagonal + np.asarray(i) - np.asarray(j)

    def add(self, i, j, values):
        """Add entries; of a symmetric matrix those above the diagonal are ignored."""
        i, j, values = map(np.atleast_1d, (i, j, values))
        if self.symmetric:
            keep = i >= j
            i, j, values = i[keep], j[keep], values[keep]
        np.add.at(self._flat, self._position(i, j), values)

    def fixed_positions(self, dofs):
        """Where rows and columns ``dofs`` are stored, and where their diagonal is."""
        dofs = np.asarray(dofs, dtype=np.int64)
        k = np.arange(-self.bandwidth, self.bandwidth + 1)
        other = dofs[:, None] + k
        inside = (other >= 0) & (other < self.n)
        this = np.broadcast_to(dofs[:, None], other.shape)[inside]
        other = other[inside]
        i, j = np.concatenate([this, other]), np.concatenate([other, this])
        if self.symmetric:
            i, j = i[i >= j], j[i >= j]
        return np.unique(self._position(i, j)), self._position(dofs, dofs)

    def fix(self, positions):
        """Make the rows and columns of :meth:`fixed_positions` those of the identity."""
        everywhere, diagonal = positions
        self._flat[everywhere] = 0.0
        self._flat[diagonal] = 1.0

    def diagonal(self):
        """A copy of the diagonal."""
        return self._flat[self._diagonal::self._ld].copy()

    def multiply(self, v):
        """The matrix times a vector (n,)."""
        if self.symmetric:
            return blas.dsbmv(self.bandwidth, 1.0, self.ab, v, lower=1)
        k = self.bandwidth
        if self.n <= 2 * k:  # scipy's wrapper refuses
            return self.tocsc() @ v
        return blas.dgbmv(self.n, self.n, k, k, 1.0, self.ab[k:], v)

    def combine(self, a, A, b, B):
        """Fill with a A + b B of two matrices of the same layout."""
        np.multiply(A._flat, a, out=self._flat)
        self._flat += b * B._flat
        self._factor = None
        return self

    def factorize(self):
        """Factorise; raises ``numpy.linalg.LinAlgError`` if the matrix is singular."""
        if self.symmetric:
            c, info = lapack.dpbtrf(self.ab, lower=1)
            self.positive_definite = info == 0
            if info == 0:
                self._factor = ("pb", c)
                return self
            general = BandMatrix(self.n, self.bandwidth, symmetric=False)
            ab, lower, top = general.ab, self.ab, 2 * self.bandwidth
            ab[top:] = lower
            for k in range(1, self.bandwidth + 1):
                ab[top - k, k:] = lower[k, :self.n - k]
        else:
            general = self
        lu, pivots, info = lapack.dgbtrf(general.ab, self.bandwidth, self.bandwidth)
        if info != 0 or not np.all(np.isfinite(lu[2 * self.bandwidth])):
            raise np.linalg.LinAlgError("the matrix is singular")
        self._factor = ("gb", lu, pivots)
        return self

    def solve(self, b):
        """Solve with the factors; ``b`` of shape (n,) or (n, k)."""
        if self._factor is None:
            self.factorize()
        if self._factor[0] == "pb":
            return lapack.dpbtrs(self._factor[1], b, lower=1)[0]
        return lapack.dgbtrs(self._factor[1], self.bandwidth, self.bandwidth, b,
                             self._factor[2])[0]

    def tocsc(self):
        """The matrix as a scipy.sparse array in CSC format."""
        k = np.arange(-self.bandwidth, self.bandwidth + 1)
        if self.symmetric:
            k = k[k >= 0]
        j = np.arange(self.n)
        i = j + k[:, None]
        j = np.broadcast_to(j, i.shape)
        inside = (i >= 0) & (i < self.n)
        i, j = i[inside], j[inside]
        v = self._flat[self._position(i, j)]
        if self.symmetric:
            off = i > j
            i, j, v = (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]),
                       np.concatenate([v, v[off]]))
        return coo_matrix((v, (i, j)), shape=(self.n, self.n)).tocsc()


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
        Entries to add to K, of both halves where it is symmetric.
    springs
        Coordinates to hold.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular.
    """

    def __init__(self, K, J, i, j, values, springs):
        inside = np.abs(i - j) <= K.bandwidth
        K.add(i[inside], j[inside], values[inside])
        diagonal = np.abs(K.diagonal())
        stiffness = diagonal[springs]
        stiffness[stiffness == 0.0] = np.mean(diagonal)
        K.add(springs, springs, stiffness)
        K.factorize()
        self._K, self._J = K, J
        i, j, values = i[~inside], j[~inside], values[~inside]
        far, where = np.unique(np.append(i, j), return_inverse=True)
        # A = K + P^T S P, where the rows of P pick the springs and what lies outside the band
        self._picked = np.append(springs, far)
        k, ns = len(self._picked), len(springs)
        self._S = np.zeros((k, k))
        self._S[np.arange(ns), np.arange(ns)] = -stiffness
        np.add.at(self._S, (ns + where[:len(i)], ns + where[len(i):]), values)
        columns = np.zeros((K.n, k + len(J)), order="F")
        columns[self._picked, np.arange(k)] = 1.0
        columns[:, k:] = J.T
        Z = K.solve(columns)
        # equations of joints have units of their own: scale them to a unit diagonal
        size = np.abs(np.einsum("kn,nk->k", J, Z[:, k:]))
        self._scale = 1.0 / np.sqrt(np.where(size > 0, size, 1.0))
        Z[:, k:] *= self._scale
        Z[:, :k] = Z[:, :k] @ self._S
        H = np.vstack([Z[self._picked], self._scale[:, None] * (J @ Z)])
        H[np.arange(k), np.arange(k)] += 1.0
        if not np.all(np.isfinite(H)):
            raise np.linalg.LinAlgError("the matrix is singular")
        self._Z = Z
        lu, pivots, info = lapack.dgetrf(H)
        if info != 0:
            raise np.linalg.LinAlgError("the matrix is singular")
        self._H = lu, pivots

    def tocsc(self):
        """A as a scipy.sparse array in CSC format."""
        rows = np.broadcast_to(self._picked[:, None], self._S.shape)
        S = coo_matrix((self._S.ravel(), (rows.ravel(), rows.T.ravel())),
                       (self._K.n, self._K.n))
        return self._K.tocsc() + S.tocsc()

    def _once(self, b, c):
        x = self._K.solve(b)
        k = len(self._picked)
        y = lu_solve(self._H, np.append(x[self._picked], self._scale * (self._J @ x - c)),
                     check_finite=False)
        return x - self._Z @ y, self._scale * y[k:]

    def _multiply(self, x):
        out = self._K.multiply(x)
        np.add.at(out, self._picked, self._S @ x[self._picked])
        return out

    def solve(self, b, c):
        """x, l and how large the correction by one refinement was, relative to x."""
        x, l = self._once(b, c)
        dx, dl = self._once(b - self._multiply(x) - l @ self._J, c - self._J @ x)
        weight = np.abs(self._K.diagonal())
        size = weight @ (x * x)
        error = np.sqrt(weight @ (dx * dx) / size) if size > 0 else 0.0
        return x + dx, l + dl, float(error)
