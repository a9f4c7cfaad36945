"""Which equations of joints depend on others, and which rigid motions nothing holds."""

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

#: Rest of a row beside those before it, relative to the row, that is round-off.
DEPENDENT = 1e-9
#: Smallest over largest singular value of what is held that is round-off.
FREE = 1e-9
#: Columns up to which singular values are found by dense matrices.
DENSE = 300
#: Vectors of a null space that are looked for where it is not dense, and iterations for them.
MOST, ITERATIONS = 8, 6


def first_dependent(J, free, phi):
    """The first equation that those before it hold already, or None.

    The rows of J fall apart into groups without a common coordinate. In each group QR
    orthogonalises the rows in their order: what is left of a row is on the diagonal of R.

    Parameters
    ----------
    J
        Sparse, shape (m, N).
    free
        Truth values of the coordinates that supports leave free, shape (N,).
    phi
        What each equation is open by, shape (m,).

    Returns
    -------
    tuple or None
        The number of the equation, and what it is open by where those before it are met.
    """
    size = np.sqrt(np.asarray(J.multiply(J).sum(axis=1)).ravel())
    first = None
    for rows, A in groups(J @ sparse.diags_array(free.astype(float))):
        if first is not None and rows[0] > first[0]:
            continue
        R = scipy.linalg.qr(A.T, mode="r", check_finite=False)[0]
        rest, k = np.zeros(len(rows)), min(R.shape)
        rest[:k] = np.abs(np.diag(R))
        dependent = np.flatnonzero(rest <= DEPENDENT * size[rows])
        if len(dependent) and (first is None or rows[dependent[0]] < first[0]):
            k = dependent[0]
            known = scipy.linalg.solve_triangular(R[:k, :k], phi[rows[:k]], trans="T")
            first = int(rows[k]), float(phi[rows[k]] - R[:k, k] @ known)
    return first


def groups(J):
    """The rows of a sparse matrix in groups without a common column.

    Yields
    ------
    rows, A
        Numbers of the rows, increasing, and these rows without columns that are zero in all.
    """
    J = sparse.csr_array(J)
    J.eliminate_zeros()
    (m, n), entries = J.shape, J.tocoo()
    links = sparse.coo_array((np.ones(J.nnz), (entries.row, m + entries.col)), (m + n, m + n))
    number, group = connected_components(links, directed=False)
    size = [np.bincount(part, minlength=number) for part in (group[:m], group[m:])]
    at = [_place(part, count) for part, count in zip((group[:m], group[m:]), size)]
    which = group[entries.row]
    order = np.argsort(which, kind="stable")
    ends = np.cumsum(np.bincount(which, minlength=number))
    members = np.split(np.argsort(group[:m], kind="stable"), np.cumsum(size[0])[:-1])
    for g in np.flatnonzero(size[0]):
        some = order[ends[g - 1] if g else 0:ends[g]]
        A = np.zeros((size[0][g], size[1][g]))
        A[at[0][entries.row[some]], at[1][entries.col[some]]] = entries.data[some]
        yield members[g], A


def _place(group, count):
    """The place of each member in its group."""
    out = np.empty(len(group), dtype=int)
    order = np.argsort(group, kind="stable")
    out[order] = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count)
    return out


def unit_rows(A):
    """The rows of a matrix scaled to a largest entry of 1, without those that are zero.

    Rows for slopes have another unit than rows for positions.
    """
    norms = abs(A).max(axis=1) if A.shape[0] else np.zeros(0)
    norms = norms.toarray().ravel() if sparse.issparse(norms) else norms
    A, scale = A[norms > 0], 1.0 / norms[norms > 0]
    return sparse.diags_array(scale) @ A if sparse.issparse(A) else scale[:, None] * A


def null_space(H):
    """Vectors that span the null space of a sparse matrix, as rows; of a large one some.

    Parameters
    ----------
    H
        Shape (r, n), rows of about unit size.

    Returns
    -------
    ndarray
        Shape (k, n); with more than :data:`DENSE` columns at most :data:`MOST`.
    """
    n = H.shape[1]
    if not H.shape[0]:
        return np.eye(n)[:n if n <= DENSE else MOST]
    if n <= DENSE:
        _, sigma, V = np.linalg.svd(np.linalg.qr(H.toarray(), mode="r"))
        return V[int(np.sum(sigma > FREE * sigma[0])):]
    # inverse iteration with H^T H + small^2, whose condition number is the square of this one's
    small = 0.1 * FREE
    lu = splu(sparse.block_array([[small * sparse.eye_array(H.shape[0]), H],
                                  [H.T, -small * sparse.eye_array(n)]], format="csc"))
    X = np.random.default_rng(0).standard_normal((n, MOST))
    for _ in range(ITERATIONS):
        X = np.linalg.qr(lu.solve(np.vstack([np.zeros((H.shape[0], MOST)), X]))[H.shape[0]:])[0]
    _, sigma, V = np.linalg.svd(np.linalg.qr(H @ X, mode="r"))
    largest = np.sqrt(sparse.linalg.norm(H, 1) * sparse.linalg.norm(H, np.inf))
    X = X @ V[sigma <= FREE * largest].T
    # as few beams in each vector as there may be
    _, R, pivots = scipy.linalg.qr(X.T, mode="economic", pivoting=True)
    k = len(R)
    out = np.empty((k, n))
    out[:, pivots] = scipy.linalg.solve_triangular(R[:, :k], R)
    return out / np.linalg.norm(out, axis=1)[:, None]
