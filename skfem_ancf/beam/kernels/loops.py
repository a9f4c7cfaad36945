"""The steps of :mod:`.arrays` as loops, for Numba."""

import numpy as np

from ...core.source import source
from .tables import OF_C, OF_FRAME, OF_G, OF_H, OF_WEIGHTS, SECTION


@source
def block():
    return 32


@source
def gathered(t, first, last, u):
    m, n, start = t.G.shape[1], last - first, t.start[first:last]
    U = np.empty((m, 2, n))
    for k in range(m):
        for i in range(2):
            for e in range(n):
                U[k, i, e] = u[start[e] + 2 + 2 * k + i]
    for i in range(2):
        for e in range(n):
            U[m // 2, i, e] -= u[start[e] + i]
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
    return product(t.G, t.at[first:last, OF_G], gathered(t, first, last, u), True)


@source
def sampled(t, first, d, dd):
    ns, n = t.rows.shape[1], d.shape[2]
    strain, X, x = np.empty((ns, n)), np.zeros((2, ns, 2, n)), np.empty(d.shape)
    for g in range(d.shape[0]):
        for i in range(2):
            for e in range(n):
                x[g, i, e] = t.frame[t.at[first + e, OF_FRAME], i, g]
    if t.kind == SECTION:
        for s in range(ns):
            g, h = t.rows[0, s], t.rows[1, s]
            c = 0.5 if g == h else 1.0
            for e in range(n):
                u, v, p, q = d[g, 0, e], d[g, 1, e], d[h, 0, e], d[h, 1, e]
                a, b, r, w = x[g, 0, e] + u, x[g, 1, e] + v, x[h, 0, e], x[h, 1, e]
                strain[s, e] = c * (a * p + b * q + u * r + v * w)
                X[0, s, 0, e] = c * (r + p + 0.5 * dd[h, 0, e])
                X[0, s, 1, e] = c * (w + q + 0.5 * dd[h, 1, e])
                X[1, s, 0, e] = c * (a + 0.5 * dd[g, 0, e])
                X[1, s, 1, e] = c * (b + 0.5 * dd[g, 1, e])
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
def own_moduli(t, first, last):
    if len(t.H) == 1:
        return t.H
    H = np.empty((last - first, t.H.shape[1]))
    for e in range(len(H)):
        H[e] = t.H[t.at[first + e, OF_H]]
    return H


@source
def at_points(t, strain):
    return np.dot(t.along, strain).reshape(3, t.weights.shape[1], strain.shape[1])


@source
def moduli_of(t, first, D):
    n, points = D.shape[2], t.weights.shape[1]
    H = np.zeros((n, t.pairs.shape[1]))
    for p in range(points):
        for q in range(H.shape[1]):
            s, m = t.pairs[0, q], t.pairs[1, q]
            for c in range(3):
                x = t.along[c * points + p, s]
                for k in range(3 if x != 0.0 else 0):
                    y = x * t.along[k * points + p, m]
                    for e in range(n if y != 0.0 else 0):
                        w = t.weights[t.at[first + e, OF_WEIGHTS], p]
                        H[e, q] += w * y * D[3 * c + k, p, e]
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
    ns, n = strain.shape
    out = np.zeros((ns, n))
    for q in range(H.shape[1]):
        s, m = t.pairs[0, q], t.pairs[1, q]
        if len(H) == 1:
            h = H[0, q]
            for e in range(n):
                out[s, e] += h * strain[m, e]
        else:
            for e in range(n):
                out[s, e] += H[e, q] * strain[m, e]
    return out


@source
def add_forces(t, first, X, T, f):
    ns, n = X.shape[1], X.shape[3]
    F = np.zeros((t.G.shape[2], 2, n))
    for s in range(ns):
        for k in range(2):
            g = t.rows[k, s]
            for i in range(2):
                for e in range(n):
                    F[g, i, e] += T[s, e] * X[k, s, i, e]
    add_to_nodes(t, first, product(t.G, t.at[first:first + n, OF_G], F, False), f)


@source
def add_to_nodes(t, begin, F, f):
    m, n = F.shape[0], F.shape[2]
    for e in range(n):
        first = t.start[begin + e]
        for i in range(2):
            f[first + i] -= F[m // 2, i, e]
            for k in range(m):
                f[first + 2 + 2 * k + i] += F[k, i, e]


@source
def add_constant(t, first, last, u, f):
    U, m = gathered(t, first, last, u), t.G.shape[1]
    F = product(t.C, t.at[first:last, OF_C], U.reshape(2 * m, 1, last - first), False)
    add_to_nodes(t, first, F.reshape(U.shape), f)


@source
def derivatives(t, first, X, B):
    ns, n, m = X.shape[1], X.shape[3], t.G.shape[1]
    for e in range(n):
        one, G = B[e], t.G[t.at[first + e, OF_G]]
        for s in range(ns):
            g, h = t.rows[0, s], t.rows[1, s]
            a, b, c, d = X[0, s, 0, e], X[0, s, 1, e], X[1, s, 0, e], X[1, s, 1, e]
            for k in range(m):
                x, y = G[k, g], G[k, h]
                one[s, 2 * k], one[s, 2 * k + 1] = x * a + y * c, x * b + y * d


@source
def moved(t, H, B, HB):
    HB[:] = 0.0
    for e in range(len(B)):
        row, x, y = H[e if len(H) > 1 else 0], B[e], HB[e]
        for q in range(len(row)):
            s, m, h = t.pairs[0, q], t.pairs[1, q], row[q]
            for i in range(x.shape[1]):
                y[s, i] += h * x[m, i]


@source
def between(B, HB, K):
    for e in range(len(B)):
        np.dot(B[e].T, HB[e], K[e])


@source
def add_stiffness(t, first, K):
    for e in range(len(K)):
        C, one = t.C[t.at[first + e, OF_C]], K[e]
        for i in range(len(C)):
            for j in range(len(C)):
                one[i, j] += C[i, j]


@source
def add_geometric(t, first, d, T, K):
    m, ns, last, points = t.G.shape[1], len(T), -1, len(T) // 2
    both, P = np.empty((ns, m * m)), np.empty((len(K), m * m))
    if t.kind == SECTION:
        if len(t.G) == 1:
            products(t.rows, t.G[0], both)
            np.dot(np.ascontiguousarray(T.T), both, P)
        for e in range(len(K)):
            if len(t.G) > 1:
                if t.at[first + e, OF_G] != last:
                    last = t.at[first + e, OF_G]
                    products(t.rows, t.G[last], both)
                np.dot(T[:, e].copy(), both, P[e])
            one = K[e]
            for k in range(m):
                for l in range(m):
                    x = P[e, k * m + l]
                    one[2 * k, 2 * l] += x
                    one[2 * k + 1, 2 * l + 1] += x
        return
    for e in range(len(K)):
        if t.at[first + e, OF_G] != last:
            last = t.at[first + e, OF_G]
            products(t.rows, t.G[last], both)
        one, x = K[e], t.frame[t.at[first + e, OF_FRAME]]
        for p in range(points):
            q = points + p
            a, b = x[0, p] + d[p, 0, e], x[1, p] + d[p, 1, e]
            ax, ay = x[0, q] + d[q, 0, e], x[1, q] + d[q, 1, e]
            square = a * a + b * b
            kappa = (a * ay - b * ax) / square
            N, M = T[p, e] / (square * np.sqrt(square)), 2.0 * T[q, e] / (square * square)
            c, y = 4.0 * kappa * M, kappa * square
            xx = c * a * a + N * b * b - M * (2.0 * ay * a + y)
            yy = c * b * b + N * a * a + M * (2.0 * ax * b - y)
            xy = (c - N) * a * b - M * (ay * b - ax * a)
            zx, zy = M * a * b, 0.5 * M * (b * b - a * a)
            for k in range(m):
                for l in range(m):
                    f, g = both[p, k * m + l], both[q, k * m + l]
                    one[2 * k, 2 * l] += xx * f + zx * g
                    one[2 * k + 1, 2 * l + 1] += yy * f - zx * g
                    one[2 * k, 2 * l + 1] += xy * f + zy * g
                    one[2 * k + 1, 2 * l] += xy * f + zy * g


@source
def products(rows, G, out):
    """``G_g G_h^T + G_h G_g^T`` of each sample, half of it where g is h; (ns, (nb - 1)^2)."""
    m = len(G)
    for s in range(len(out)):
        g, h = rows[0, s], rows[1, s]
        c = 0.5 if g == h else 1.0
        for k in range(m):
            for l in range(m):
                out[s, k * m + l] = c * (G[k, g] * G[l, h] + G[k, h] * G[l, g])


@source
def add_to_band(t, begin, K, to, halves):
    n, flat = K.shape[1], to.flat
    q, half = n // 2 - 1, to.ld // 2
    for e in range(len(K)):
        one, first = K[e], t.start[begin + e]
        for j in range(n):
            at = (first + j + 2) * to.ld - j
            for i in range(j, n):
                flat[at + i] += one[i, j]
            for i in range(j, n if halves else 0):
                flat[at + half + i] += one[j, i]
        for j in range(2):
            at = (first + j) * to.ld - j
            for i in range(j, 2):
                flat[at + i] += one[q + i, q + j]
            for i in range(n):  # of what is symmetric the entries of the lower half, to the bit
                one_half = halves or i >= q + j
                flat[at + 2 + i] -= one[i, q + j] if one_half else one[q + j, i]
            for i in range(j, 2 if halves else 0):
                flat[at + half + i] += one[q + j, q + i]
            for i in range(n if halves else 0):
                flat[at + half + 2 + i] -= one[q + j, i]


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
def add_pushes(B, start, T, f):
    k, ns, n = B.shape
    for e in range(len(start)):
        for s in range(ns):
            total = T[e * ns + s]
            for i in range(n):
                f[start[e] + i] += B[e % k, s, i] * total
