"""The steps of :mod:`.arrays` as loops, for Numba."""

import numpy as np

from ...core.source import source
from .tables import OF_C, OF_FRAME, OF_G, OF_H, OF_WEIGHTS, SECTION


@source
def block():
    return 16


@source
def gathered(t, first, last, u):
    m, n, start = t.G.shape[2], last - first, t.start[first:last]
    U = np.empty((m, 2, n))
    for e in range(n):
        both = u[start[e]:]
        for k in range(m):
            U[k, 0, e], U[k, 1, e] = both[2 + 2 * k], both[3 + 2 * k]
        for i in range(2):
            U[m // 2, i, e] -= both[i]
    return U


@source
def product(A, at, X, transposed):
    """A[at[e]] @ X[:, :, e], or with the transposed matrices."""
    k, m, n = X.shape
    rows = A.shape[2] if transposed else A.shape[1]
    out = np.empty((rows, m, n))
    if len(A) == 1:
        flat = X.reshape(k, m * n)
        if transposed:
            np.dot(A[0].T, flat, out.reshape(rows, m * n))
        else:
            np.dot(A[0], flat, out.reshape(rows, m * n))
        return out
    out[:] = 0.0
    for g in range(rows):
        for j in range(k):
            for i in range(m):
                for e in range(n):
                    out[g, i, e] += (A[at[e], j, g] if transposed else A[at[e], g, j]) * X[j, i, e]
    return out


@source
def displaced(t, first, last, u):
    return product(t.G, t.at[first:last, OF_G], gathered(t, first, last, u), False)


@source
def sampled(t, first, d, dd):
    ns, n = t.rows.shape[1], d.shape[2]
    strain, X, x = np.empty((ns, n)), np.zeros((2, ns, 2, n)), np.empty(d.shape)
    for g in range(d.shape[0]):
        for e in range(n):
            row = t.frame[t.at[first + e, OF_FRAME], g]
            x[g, 0, e], x[g, 1, e] = row[0], row[1]
    if t.kind == SECTION:
        for s in range(ns):
            g, h = t.rows[0, s], t.rows[1, s]
            for i in range(2):
                for e in range(n):
                    X[0, s, i, e] = x[h, i, e] + d[h, i, e] + 0.5 * dd[h, i, e]
                for e in range(n if g != h else 0):
                    X[1, s, i, e] = x[g, i, e] + d[g, i, e] + 0.5 * dd[g, i, e]
            c = 0.5 if g == h else 1.0
            for e in range(n):
                strain[s, e] = c * (
                    (x[g, 0, e] + d[g, 0, e]) * d[h, 0, e] + d[g, 0, e] * x[h, 0, e]
                    + (x[g, 1, e] + d[g, 1, e]) * d[h, 1, e] + d[g, 1, e] * x[h, 1, e])
        return strain, X
    for p in range(ns // 2):
        q = ns // 2 + p
        for e in range(n):
            x0, y0, u, v = x[p, 0, e], x[p, 1, e], d[p, 0, e], d[p, 1, e]
            a, b = x0 + u, y0 + v
            square0, square = x0 * x0 + y0 * y0, a * a + b * b
            length = np.sqrt(square)
            ax, ay = x[q, 0, e] + d[q, 0, e], x[q, 1, e] + d[q, 1, e]
            kappa = (a * ay - b * ax) / square
            strain[p, e] = ((a + x0) * u + (b + y0) * v) / (length + np.sqrt(square0))
            strain[q, e] = kappa - (x0 * x[q, 1, e] - y0 * x[q, 0, e]) / square0
            a1, b1 = a + dd[p, 0, e], b + dd[p, 1, e]
            ax1, ay1 = ax + dd[q, 0, e], ay + dd[q, 1, e]
            square1 = a1 * a1 + b1 * b1
            both = kappa + (a1 * ay1 - b1 * ax1) / square1
            one, two = 1.0 / (length + np.sqrt(square1)), 1.0 / (square + square1)
            X[0, p, 0, e], X[0, p, 1, e] = one * (a + a1), one * (b + b1)
            X[0, q, 0, e] = two * (ay + ay1 - both * (a + a1))
            X[0, q, 1, e] = -two * (ax + ax1 + both * (b + b1))
            X[1, q, 0, e], X[1, q, 1, e] = -two * (b + b1), two * (a + a1)
    return strain, X


@source
def changed(t, dd, X):
    ns, n = X.shape[1], X.shape[3]
    out = np.empty((ns, n))
    for s in range(ns):
        g, h = t.rows[0, s], t.rows[1, s]
        for e in range(n):
            out[s, e] = (X[0, s, 0, e] * dd[g, 0, e] + X[0, s, 1, e] * dd[g, 1, e]
                         + X[1, s, 0, e] * dd[h, 0, e] + X[1, s, 1, e] * dd[h, 1, e])
    return out


@source
def middle(strain, change):
    out = strain.copy()
    for s in range(len(change)):
        for e in range(strain.shape[1]):
            out[s, e] += 0.5 * change[s, e]
    return out


@source
def difference(X, Y):
    out = np.empty(X.shape)
    a, b, c = X.reshape(X.size), Y.reshape(X.size), out.reshape(X.size)
    for k in range(X.size):
        c[k] = a[k] - b[k]
    return out


@source
def shifted(E, first, shift):
    out = np.empty(E.shape)
    for c in range(E.shape[0]):
        for p in range(E.shape[1]):
            for e in range(E.shape[2]):
                out[c, p, e] = E[c, p, e] + shift[c, p, first + e]
    return out


@source
def stresses_at(given, first, last):
    T = np.empty((given.shape[1], last - first))
    for s in range(len(T)):
        for e in range(last - first):
            T[s, e] = given[first + e, s]
    return T


@source
def put_stresses(T, first, more, out):
    for e in range(T.shape[1]):
        for s in range(len(T)):
            out[first + e, s] = T[s, e] + (more[first + e, s] if more.size > 0 else 0.0)


@source
def linear_moduli(t, first, last):
    H = np.empty((t.H.shape[1], last - first))
    for q in range(len(H)):
        for e in range(last - first):
            H[q, e] = t.H[t.at[first + e, OF_H], q]
    return H


@source
def at_points(t, strain):
    return np.dot(t.along, strain).reshape(3, t.weights.shape[1], strain.shape[1])


@source
def moduli_of(t, first, D):
    n, points = D.shape[2], t.weights.shape[1]
    H = np.zeros((t.pairs.shape[1], n))
    for p in range(points):
        for q in range(len(H)):
            s, m = t.pairs[0, q], t.pairs[1, q]
            for c in range(3):
                x = t.along[c * points + p, s]
                for k in range(3 if x != 0.0 else 0):
                    y = x * t.along[k * points + p, m]
                    for e in range(n if y != 0.0 else 0):
                        w = t.weights[t.at[first + e, OF_WEIGHTS], p]
                        H[q, e] += w * y * D[3 * c + k, p, e]
    return H


@source
def from_points(t, first, S):
    points, n = S.shape[1], S.shape[2]
    for p in range(points):
        for e in range(n):
            w = t.weights[t.at[first + e, OF_WEIGHTS], p]
            for c in range(3):
                S[c, p, e] *= w
    return np.dot(t.along.T, S.reshape(3 * points, n))


@source
def weighted(t, H, strain):
    T = np.zeros(strain.shape)
    for q in range(len(H)):
        s, m = t.pairs[0, q], t.pairs[1, q]
        for e in range(H.shape[1]):
            T[s, e] += H[q, e] * strain[m, e]
        for e in range(H.shape[1] if s != m else 0):
            T[m, e] += H[q, e] * strain[s, e]
    return T


@source
def add_forces(t, first, X, T, f):
    ns, n = X.shape[1], X.shape[3]
    F = np.zeros((t.G.shape[1], 2, n))
    for s in range(ns):
        for k in range(2 if t.rows[0, s] != t.rows[1, s] else 1):
            g = t.rows[k, s]
            for i in range(2):
                for e in range(n):
                    F[g, i, e] += T[s, e] * X[k, s, i, e]
    add_to_nodes(t, first, product(t.G, t.at[first:first + n, OF_G], F, True), f)


@source
def add_to_nodes(t, begin, F, f):
    m, n = F.shape[0], F.shape[2]
    for e in range(n):
        both = f[t.start[begin + e]:]
        for i in range(2):
            both[i] -= F[m // 2, i, e]
            for k in range(m):
                both[2 + 2 * k + i] += F[k, i, e]


@source
def add_constant(t, first, last, u, f):
    U, m = gathered(t, first, last, u), t.G.shape[2]
    F = product(t.C, t.at[first:last, OF_C], U.reshape(2 * m, 1, last - first), False)
    add_to_nodes(t, first, F.reshape(U.shape), f)


@source
def derivatives(t, first, X, B):
    ns, n, m = X.shape[1], X.shape[3], t.G.shape[2]
    for e in range(n):
        one, G = B[e], t.G[t.at[first + e, OF_G]]
        for s in range(ns):
            x, y = G[t.rows[0, s]], G[t.rows[1, s]]
            for i in range(2):
                a, b = X[0, s, i, e], X[1, s, i, e]
                for k in range(m):
                    one[s, 2 * k + i] = x[k] * a + y[k] * b


@source
def moved(t, H, B, HB):
    HB[:] = 0.0
    for e in range(len(B)):
        x, y = B[e], HB[e]
        for q in range(len(H)):
            s, m, h = t.pairs[0, q], t.pairs[1, q], H[q, e]
            for i in range(x.shape[1]):
                y[s, i] += h * x[m, i]
            for i in range(x.shape[1] if s != m else 0):
                y[m, i] += h * x[s, i]


@source
def add_material(t, H, X, Y, w):
    n = H.shape[1]
    x, y, h = X.reshape(2 * X.shape[1], 2, n), Y.reshape(2 * X.shape[1], 2, n), np.empty(n)
    for k in range(t.terms.shape[1]):
        p, a, b, q = t.terms[0, k], t.terms[1, k], t.terms[2, k], t.terms[3, k]
        c = 0.5 if a == b else 1.0
        for i in range(2):
            for e in range(n):
                h[e] = c * H[q, e] * x[a, i, e]
            for j in range(2):
                for e in range(n):
                    w[p, 2 * i + j, e] += h[e] * y[b, j, e]


@source
def add_geometric(t, first, d, T, w):
    if t.kind == SECTION:
        for s in range(len(T)):
            c, p = 0.5 if t.rows[0, s] == t.rows[1, s] else 1.0, t.of[s]
            for e in range(T.shape[1]):
                w[p, 0, e] += c * T[s, e]
                w[p, 3, e] += c * T[s, e]
        return
    for p in range(len(T) // 2):
        q = len(T) // 2 + p
        one, two = w[t.of[p]], w[t.of[q]]
        for e in range(T.shape[1]):
            x = t.frame[t.at[first + e, OF_FRAME]]
            a, b = x[p, 0] + d[p, 0, e], x[p, 1] + d[p, 1, e]
            ax, ay = x[q, 0] + d[q, 0, e], x[q, 1] + d[q, 1, e]
            square = a * a + b * b
            kappa = (a * ay - b * ax) / square
            N, M = 0.5 * T[p, e] / (square * np.sqrt(square)), T[q, e] / (square * square)
            c, y = 4.0 * kappa * M, kappa * square
            xy = (c - N) * a * b - M * (ay * b - ax * a)
            zx, zy = 2.0 * M * a * b, M * (b * b - a * a)
            one[0, e] += c * a * a + N * b * b - M * (2.0 * ay * a + y)
            one[1, e] += xy
            one[2, e] += xy
            one[3, e] += c * b * b + N * a * a + M * (2.0 * ax * b - y)
            two[0, e] += zx
            two[1, e] += zy
            two[2, e] += zy
            two[3, e] -= zx


@source
def add_products(t, first, w, one, other, K):
    n, m = len(K), t.G.shape[2]
    if len(t.G) == 1:
        Q = np.empty((m, m, 4, n))
        put_products(t.products, t.G[0], w, Q)
        for e in range(n):
            add_block(Q[:, :, :, e], one, other, K[e])
    else:
        Q = np.empty((m, m, 4, 1))
        for e in range(n):
            each = np.ascontiguousarray(w[:, :, e:e + 1])
            put_products(t.products, t.G[t.at[first + e, OF_G]], each, Q)
            add_block(Q[:, :, :, 0], one, other, K[e])


@source
def put_products(rows, G, w, Q):
    """Write the sum of ``w[p, c, e] G_g[k] G_h[l]`` over pairs of rows, (nb - 1, nb - 1, 4, ne)."""
    m, size, p = G.shape[1], w.shape[1] * w.shape[2], 0
    of_row, flat, total = np.empty((m, size)), w.reshape(len(w), size), Q.reshape(m, m * size)
    every = of_row.reshape(m * size)
    total[:] = 0.0
    for g in range(len(G)):
        of_row[:] = 0.0
        while p < len(w) and rows[0, p] == g:
            x, h = flat[p], G[rows[1, p]]
            for l in range(m):
                c, out = h[l], of_row[l]
                for e in range(size if c != 0.0 else 0):
                    out[e] += c * x[e]
            p += 1
        for k in range(m):
            c, out = G[g, k], total[k]
            for e in range(m * size if c != 0.0 else 0):
                out[e] += c * every[e]


@source
def add_block(Q, one, other, K):
    """Add ``one Q + other Q^T`` of one element, Q (nb - 1, nb - 1, 4)."""
    m = len(Q)
    both = K.reshape(m, 2, m, 2)
    for k in range(m):
        for l in range(m):
            x, y, out = Q[k, l], Q[l, k], both[k, :, l]
            for i in range(2):
                for j in range(2):
                    out[i, j] += one * x[2 * i + j] + other * y[2 * j + i]


@source
def add_stiffness(t, first, K):
    for e in range(len(K)):
        C, one = t.C[t.at[first + e, OF_C]], K[e]
        for i in range(len(C)):
            for j in range(len(C)):
                one[i, j] += C[i, j]


@source
def add_to_band(t, begin, K, to, halves):
    n, ld, half = K.shape[1], to.ld, to.ld // 2
    q = n // 2 - 1
    for e in range(len(K)):
        one, flat = K[e], to.flat[t.start[begin + e] * to.ld:]
        for j in range(n):
            out = flat[(j + 2) * ld - j:]
            for i in range(j, n):
                out[i] += one[i, j]
            for i in range(j, n if halves else 0):
                out[half + i] += one[j, i]
        for j in range(2):
            out = flat[j * ld - j:]
            for i in range(j, 2):
                out[i] += one[q + i, q + j]
            for i in range(n):  # of what is symmetric the entries of the lower half, to the bit
                one_half = halves or i >= q + j
                out[2 + i] -= one[i, q + j] if one_half else one[q + j, i]
            for i in range(j, 2 if halves else 0):
                out[half + i] += one[q + j, q + i]
            for i in range(n if halves else 0):
                out[half + 2 + i] -= one[q + j, i]


@source
def put_columns(B, out):
    k, ns, n = B.shape
    for e in range(k):
        for s in range(ns):
            for i in range(n):
                out[e, s, i + 2] = B[e, s, i]
            for i in range(2):
                out[e, s, i] = -B[e, s, n // 2 - 1 + i]


@source
def add_changes(B, start, x, T):
    k, ns, n = B.shape
    for e in range(len(start)):
        for s in range(ns):
            total = 0.0
            for i in range(n):
                total += B[e % k, s, i] * x[start[e] + i]
            T[e * ns + s] += total


@source
def add_transposed(B, start, T, f):
    k, ns, n = B.shape
    for e in range(len(start)):
        for s in range(ns):
            total = T[e * ns + s]
            for i in range(n):
                f[start[e] + i] += B[e % k, s, i] * total
