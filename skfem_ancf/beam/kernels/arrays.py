"""Steps of the kernels in NumPy, for all elements of a block; :mod:`.loops` has them for Numba.

Elements are the last axis of rows, samples and points, and the first of matrices. Displacements may
be complex.
"""

from typing import Any

import numpy as np

from ...core.source import primitive
from .tables import OF_C, OF_FRAME, OF_G, OF_H, OF_WEIGHTS, SECTION

#: Marks steps that Numba compiles from loops.
step = primitive("skfem_ancf.beam.kernels.loops")


@step
def block():
    """Number of elements that are evaluated together, to stay in cache."""
    return 128


def _at(t, first, last, of):
    """Numbers of the elements' entries in a table."""
    return t.at[first:last, of]


def _product(A, at, X):
    """``A[at] @ X`` for X (k, m, ne)."""
    if len(A) == 1:
        return (A[0] @ X.reshape(len(X), -1)).reshape(A.shape[1], *X.shape[1:])
    return (A[at] @ X.transpose(2, 0, 1)).transpose(1, 2, 0)


def _of_elements(A, at):
    """Values (k, ...) with the elements as last axis, of length 1 if all are equal."""
    return np.moveaxis(A if len(A) == 1 else A[at], 0, -1)


@step
def gathered(t, first, last, u):
    """DOFs (nb - 1, 2, ne) of the elements, relative to the left node."""
    m, start = t.G.shape[2], t.start[first:last]
    U = u[start + np.arange(2, 2 * m + 2)[:, None]].reshape(m, 2, -1)
    U[m // 2] -= u[start + np.arange(2)[:, None]]
    return U


@step
def displaced(t, first, last, u):
    """Displacements (rows, 2, ne) of the rows of elements ``first`` to ``last``."""
    return _product(t.G, _at(t, first, last, OF_G), gathered(t, first, last, u))


@step
def sampled(t, first, d, dd):
    """Strains (ns, ne) at d, and directions X (2, ns, 2, ne) of the work of rows g and h.

    The strain changes by ``X[0] . dd_g + X[1] . dd_h`` from d to d + dd; for dd = 0, X are the
    derivatives. If g and h are the same row, X[1] is zero.
    """
    x, (g, h) = _of_elements(t.frame, _at(t, first, first + d.shape[2], OF_FRAME)), t.rows
    r = x + d
    if t.kind == SECTION:
        c = np.where(g == h, 0.5, 1.0)[:, None, None]
        middle = r + 0.5 * dd
        return ((c * (r[g] * d[h] + d[g] * x[h])).sum(axis=1),
                np.array([middle[h], np.where(c == 1.0, middle[g], 0.0)]))
    n, s = len(d) // 2, r + dd
    (a0, b0), (a, b), (a1, b1) = ((y[:n], y[n:]) for y in (x, r, s))
    length0, length, length1 = (np.sqrt((y * y).sum(axis=1)) for y in (a0, a, a1))
    kappa0, kappa, kappa1 = (_cross(y, z) / w**2 for y, z, w in (
        (a0, b0, length0), (a, b, length), (a1, b1, length1)))
    strain = np.concatenate([((a + a0) * d[:n]).sum(axis=1) / (length + length0), kappa - kappa0])
    X = np.zeros((2, 2 * n, *d.shape[1:]), d.dtype)
    square, both = (length**2 + length1**2)[:, None], (kappa + kappa1)[:, None]
    X[0, :n] = (a + a1) / (length + length1)[:, None]
    X[0, n:] = (_turned(b + b1) - both * (a + a1)) / square
    X[1, n:] = -_turned(a + a1) / square
    return strain, X


def _cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _turned(a):
    """Vectors (n, 2, ne) rotated by -90 degrees."""
    return np.stack([a[:, 1], -a[:, 0]], axis=1)


@step
def changed(t, dd, X):
    """Change (ns, ne) of the strains for increments dd of the rows."""
    return (X[0] * dd[t.rows[0]] + X[1] * dd[t.rows[1]]).sum(axis=1)


@step
def middle(strain, change):
    """Mean of the strains (ns, ne) before and after a change, which may be empty."""
    return strain + 0.5 * change if change.size else strain


@step
def difference(X, Y):
    """``X - Y``."""
    return X - Y


@step
def shifted(E, first, shift):
    """E (k, points, ne) plus the shift of the elements from ``first``."""
    return E + shift[:, :, first:first + E.shape[2]]


@step
def stresses_at(given, first, last):
    """Stresses (ns, ne) of some elements, from those of all (ne, ns)."""
    return given[first:last].T


@step
def put_stresses(T, first, more, out):
    """Write stresses (ns, ne), plus ``more`` if not empty, to (ne, ns)."""
    last = first + T.shape[1]
    out[first:last] = T.T + more[first:last] if more.size else T.T


@step
def linear_moduli(t, first, last):
    """Moduli of a linear law between samples, (nq, ne)."""
    return np.broadcast_to(_of_elements(t.H, _at(t, first, last, OF_H)),
                           (t.H.shape[1], last - first))


@step
def at_points(t, strain):
    """Strains at the integration points, (3, points, ne)."""
    return (t.along @ strain).reshape(3, -1, strain.shape[1])


@step
def moduli_of(t, first, D):
    """Moduli between samples, (nq, ne), from those at the points, (9, points, ne)."""
    D = D * _of_elements(t.weights, _at(t, first, first + D.shape[2], OF_WEIGHTS))
    (s, m), A = t.pairs, t.along.reshape(3, -1, t.along.shape[1])
    return np.einsum("cpq,cdpe,dpq->qe", A[:, :, s], D.reshape(3, 3, *D.shape[1:]), A[:, :, m],
                     optimize=True)


@step
def from_points(t, first, S):
    """Weighted stresses (ns, ne) from those at the points, (3, points, ne)."""
    S = S * _of_elements(t.weights, _at(t, first, first + S.shape[2], OF_WEIGHTS))
    return t.along.T @ S.reshape(-1, S.shape[2])


@step
def weighted(t, H, strain):
    """Moduli (nq, ne) times strains, (ns, ne)."""
    s, m = t.pairs
    T = np.add.reduceat(H * strain[m], np.searchsorted(s, np.arange(len(strain))))
    np.add.at(T, m[s != m], (H * strain[s])[s != m])
    return T


@step
def add_forces(t, first, X, T, f):
    """Add the forces of weighted stresses (ns, ne)."""
    at = _at(t, first, first + T.shape[1], OF_G)
    _add_to_nodes(t, first, sum(_product(t.G[:, rows].transpose(0, 2, 1), at, T[:, None] * Y)
                                for rows, Y in zip(t.rows, X)), f)


def _add_to_nodes(t, first, F, f):
    """Add forces (nb - 1, 2, ne) on the DOFs of :func:`gathered`."""
    m, n, start = len(F), len(F) // 2, t.start[first:first + F.shape[2]]
    F = F.reshape(2 * m, -1)
    # left nodes are unique, and right nodes too
    f[start + np.arange(2)[:, None]] -= F[2 * n:2 * n + 2]
    f[start + np.arange(2, m + 1)[:, None]] += F[:m - 1]
    f[start + np.arange(m + 1, 2 * m + 2)[:, None]] += F[m - 1:]


@step
def add_constant(t, first, last, u, f):
    """Add the forces of the constant stiffness."""
    U = gathered(t, first, last, u)
    F = _product(t.C, _at(t, first, last, OF_C), U.reshape(t.C.shape[1], 1, -1))
    _add_to_nodes(t, first, F.reshape(U.shape), f)


@step
def derivatives(t, first, X, B):
    """Write the strain derivatives, (ne, ns, 2 nb - 2)."""
    G = t.G if len(t.G) == 1 else t.G[_at(t, first, first + len(B), OF_G)]
    both, X = B.reshape(*B.shape[:2], -1, 2), X.transpose(0, 3, 1, 2)
    for i in range(2):
        both[..., i] = sum(G[:, rows] * Y[..., i, None] for rows, Y in zip(t.rows, X))


@step
def moved(t, H, B, HB):
    """Write moduli times strain derivatives, (ne, ns, 2 nb - 2)."""
    dense, (s, m) = np.zeros((len(B), B.shape[1], B.shape[1])), t.pairs
    dense[:, s, m] = dense[:, m, s] = H.T
    HB[:] = dense @ B


@step
def add_material(t, H, X, Y, w):
    """Add the coefficients (np, 4, ne) of the material part with moduli H (nq, ne)."""
    product, a, b, q = t.terms
    X, Y = X.reshape(-1, 2, X.shape[3]), Y.reshape(-1, 2, X.shape[3])
    half = np.where(a == b, 0.5, 1.0)[:, None] * H[q]
    x = half[:, None, None] * X[a][:, :, None] * Y[b][:, None]
    w += np.add.reduceat(x.reshape(len(a), 4, -1), np.searchsorted(product, np.arange(len(w))))


@step
def add_geometric(t, first, d, T, w):
    """Add the coefficients of the geometric part with weighted stresses (ns, ne)."""
    if t.kind == SECTION:
        x = np.where(t.rows[0] == t.rows[1], 0.5, 1.0)[:, None] * T
        np.add.at(w, t.of, x[:, None] * np.array([1.0, 0.0, 0.0, 1.0])[:, None])
        return
    n = len(T) // 2
    r = _of_elements(t.frame, _at(t, first, first + T.shape[1], OF_FRAME)) + d
    (a, b), (ax, ay) = (x.transpose(1, 0, 2) for x in (r[:n], r[n:]))
    square = a * a + b * b
    kappa = (a * ay - b * ax) / square
    N, M = 0.5 * T[:n] / (square * np.sqrt(square)), T[n:] / square**2
    c, y, zx, zy = 4.0 * kappa * M, kappa * square, 2.0 * M * a * b, M * (b * b - a * a)
    xx = c * a * a + N * b * b - M * (2.0 * ay * a + y)
    yy = c * b * b + N * a * a + M * (2.0 * ax * b - y)
    xy = (c - N) * a * b - M * (ay * b - ax * a)
    w[t.of[:n]] += np.stack([xx, xy, xy, yy], axis=1)
    w[t.of[n:]] += np.stack([zx, zy, zy, -zx], axis=1)


@step
def add_products(t, first, w, one, other, K):
    """Add ``one Q + other Q^T`` to K, with matrices Q (ne, 2 nb - 2, 2 nb - 2) of coefficients."""
    G, n, m = t.G, len(K), t.G.shape[2]
    G = G if len(G) == 1 else G[_at(t, first, first + n, OF_G)]
    g, h = t.products
    both = (G[:, g, :, None] * G[:, h, None]).reshape(len(G), len(g), m * m)
    Q = (w.transpose(2, 1, 0) @ both).reshape(n, 2, 2, m, m).transpose(0, 3, 1, 4, 2)
    K += (one * Q + other * Q.transpose(0, 3, 4, 1, 2)).reshape(K.shape)


@step
def add_stiffness(t, first, K):
    """Add the constant stiffness."""
    K += t.C[_at(t, first, first + len(K), OF_C)] if len(t.C) > 1 else t.C


@step
def add_to_band(t, first, K, to, halves):
    """Add element matrices to a band; to both halves if it is stored in two."""
    # exactly symmetric, so that translations have no round-off
    K = _with_left(K if halves else 0.5 * (K + K.transpose(0, 2, 1)))
    j, i = np.triu_indices(K.shape[1])
    at = t.start[first:first + len(K), None] * to.ld + (j * (to.ld - 1) + i)
    left = np.searchsorted(j, K.shape[1] // 2)  # both parts have unique entries
    for k in (slice(left), slice(left, None)):
        to.flat[at[:, k]] += K[:, i[k], j[k]]
        if halves:
            to.flat[at[:, k] + to.ld // 2] += K[:, j[k], i[k]]


def _with_left(K):
    """Matrices (ne, 2 nb, 2 nb) that include the left node's position."""
    n = K.shape[1]
    q, out = n // 2 + 1, np.empty((len(K), n + 2, n + 2))
    out[:, 2:, 2:] = K
    out[:, :2, 2:] = -out[:, q:q + 2, 2:]
    out[:, :, :2] = -out[:, :, q:q + 2]
    return out


@step
def put_columns(B, out):
    """Write the derivatives by the DOFs of both nodes, (ne, ns, 2 nb)."""
    n = B.shape[2] // 2 + 1
    out[:, :, 2:], out[:, :, :2] = B, -B[:, :, n - 2:n]


def weights_of(t: Any) -> Any:
    """Weights of the integration points, (points, ne) or (points, 1)."""
    return _of_elements(t.weights, t.at[:, OF_WEIGHTS])


def add_constant_energies(t: Any, u: Any, out: Any) -> None:
    """Add the energies (ne,) of the constant stiffness."""
    if len(t.C):
        U = gathered(t, 0, len(t.start), u).reshape(t.C.shape[1], 1, -1)
        out += 0.5 * (U * _product(t.C, t.at[:, OF_C], U)).sum(axis=(0, 1))


@step
def add_changes(B, start, x, T):
    """Add ``B[e] x`` at start[e] to T (ne ns,), with B repeated for copies of the elements."""
    x = x[start[:, None] + np.arange(B.shape[2])].reshape(-1, len(B), B.shape[2], 1)
    T += (B @ x).ravel()


@step
def add_transposed(B, start, T, f):
    """Add ``B[e]^T T[e]`` at start[e] to f, with B repeated for copies."""
    F = T.reshape(-1, len(B), 1, B.shape[1]) @ B
    np.add.at(f, start[:, None] + np.arange(B.shape[2]), F.reshape(len(start), -1))
