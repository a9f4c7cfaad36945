"""What the texts of kernels leave to others: matrices of each element."""

import numpy as np

from .twin import jit
from .vectors import products, subtract
from .views import room, shaped

#: Elements evaluated together: several vectors wide, with the work arrays still in cache; of
#: elements with many pairs fewer, as these lie on the stack.
BLOCK, PAIRS = 32, 4096


@jit
def block(pairs):
    return max(1, min(BLOCK, PAIRS // pairs))


@jit
def product(A, first, B, out):
    n = B.shape[1] * B.shape[2]
    if A.shape[0] == 1:
        np.dot(A[0], shaped(B, (B.shape[0], n)), shaped(out, (out.shape[0], n)))
        return
    x, y = room((B.shape[0], B.shape[1]), B), room((out.shape[0], B.shape[1]), B)
    for e in range(B.shape[2]):
        for k in range(B.shape[0]):
            for j in range(B.shape[1]):
                x[k, j] = B[k, j, e]
        np.dot(A[first + e], x, y)
        for k in range(out.shape[0]):
            for j in range(B.shape[1]):
                out[k, j, e] = y[k, j]


@jit
def turned_product(A, turned, first, B, out):
    if turned.shape[0] == 1:
        product(turned, first, B, out)
        return
    y = room((2, out.shape[0]), B)
    for e in range(B.shape[2]):
        y[:] = 0.0
        for g in range(B.shape[0]):
            b, c = B[g, 0, e], B[g, 1, e]
            for k in range(out.shape[0]):
                y[0, k] += A[first + e, g, k] * b
                y[1, k] += A[first + e, g, k] * c
        for k in range(out.shape[0]):
            out[k, 0, e], out[k, 1, e] = y[0, k], y[1, k]


@jit
def add_by_rows(table, first, rows, X, out):
    for s in range(out.shape[0]):
        for e in range(out.shape[1]):
            at, g, x, y = first + e if table.shape[0] > 1 else 0, rows[s], X[s, 0, e], X[s, 1, e]
            for k in range(out.shape[2]):
                out[s, e, k, 0] += x * table[at, g, k]
                out[s, e, k, 1] += y * table[at, g, k]


@jit
def add_changes(B, start, x, out):
    flat, n, span = shaped(B, (B.size,)), B.shape[1], B.shape[2]
    y, whole = shaped(out, (n, start.size)), n - n % 4
    for e in range(start.size):
        at, of = e % B.shape[0] * n * span, start[e]
        for s in range(0, whole, 4):
            a = at + s * span
            p, q, r, t = products(x, of, span, flat, (a, a + span, a + 2 * span, a + 3 * span))
            y[s, e] += p
            y[s + 1, e] += q
            y[s + 2, e] += r
            y[s + 3, e] += t
        for s in range(whole, n):
            y[s, e] += products(x, of, span, flat, (at + s * span,))[0]


@jit
def add_pushes(B, start, S, f):
    flat, n, span = shaped(B, (B.size,)), B.shape[1], B.shape[2]
    y, whole = shaped(S, (n, start.size)), n - n % 4
    for e in range(start.size):
        at, to = e % B.shape[0] * n * span, start[e]
        for s in range(0, whole, 4):
            a = at + s * span
            subtract(f, to, flat, (a, a + span, a + 2 * span, a + 3 * span), span,
                     (-y[s, e], -y[s + 1, e], -y[s + 2, e], -y[s + 3, e]))
        for s in range(whole, n):
            subtract(f, to, flat, (at + s * span,), span, (-y[s, e],))


@jit
def element_tangents(table, pairs, first, M, M_skew, K, K_skew):
    nb = table.shape[2]
    H, out = room((table.shape[1], 3 * nb), M), room((nb, 3 * nb), M)
    for e in range(M.shape[2]):
        G = table[first + e]
        H[:] = 0.0
        for p in range(M.shape[0]):
            g, h, q = pairs.pairs[0, p], pairs.pairs[1, p], pairs.pairs[2, p]
            x, y, xy = M[p, 0, e], M[p, 1, e], M[p, 2, e]
            d = M_skew[q, 0, e] if g != h else 0.0
            for a in range(nb):
                H[g, a] += x * G[h, a]
                H[g, nb + a] += y * G[h, a]
                H[g, 2 * nb + a] += (xy + d) * G[h, a]
            if g != h:
                for a in range(nb):
                    H[h, a] += x * G[g, a]
                    H[h, nb + a] += y * G[g, a]
                    H[h, 2 * nb + a] += (xy - d) * G[g, a]
        np.dot(G.T, H, out)
        for n in range(K.shape[0]):
            a, b = pairs.lower[0, n], pairs.lower[1, n]
            K[n, 0, e], K[n, 1, e] = out[a, b], out[a, nb + b]
            K[n, 2, e] = 0.5 * (out[a, 2 * nb + b] + out[b, 2 * nb + a])
        for n in range(K_skew.shape[0]):
            a, b = pairs.strictly[0, n], pairs.strictly[1, n]
            K_skew[n, 0, e] = 0.5 * (out[a, 2 * nb + b] - out[b, 2 * nb + a])


@jit
def element_products(table, pairs, first, M, M_skew, K, K_skew):
    n, nb = table.shape[1], table.shape[2]
    H, out = room((n, 4 * nb), M), room((nb, 4 * nb), M)
    for e in range(M.shape[2]):
        G = table[first + e]
        H[:] = 0.0
        for p in range(M.shape[0]):
            g, h, q = pairs.pairs[0, p], pairs.pairs[1, p], pairs.pairs[2, p]
            for i in range(4):
                x, y, at = M[p, i, e], M_skew[q, i, e] if g != h else 0.0, i * nb
                for a in range(nb):
                    H[g, at + a] += (x + y) * G[h, a]
                if g != h:
                    for a in range(nb):
                        H[h, at + a] += (x - y) * G[g, a]
        np.dot(G.T, H, out)
        for i in range(4):
            for k in range(K.shape[0]):
                a, b = pairs.lower[0, k], pairs.lower[1, k]
                K[k, i, e] = 0.5 * (out[a, i * nb + b] + out[b, i * nb + a])
            for k in range(K_skew.shape[0]):
                a, b = pairs.strictly[0, k], pairs.strictly[1, k]
                K_skew[k, i, e] = 0.5 * (out[a, i * nb + b] - out[b, i * nb + a])


@jit
def own_evaluate(handle, strain, out):
    out[:] = np.nan  # scenes with such laws run in NumPy


@jit
def own_distance(handle, obstacle, t, x, out):
    out[:] = np.nan  # scenes with such shapes run in NumPy


@jit
def log1p(x):
    return np.log1p(x)


@jit
def dot(a, b):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@jit
def weighted(a, b, w):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i] * w[i]
    return total


@jit
def total(x):
    found = 0.0
    for i in range(x.size):
        found += x[i]
    return found


@jit
def smallest(x):
    found = np.inf
    for i in range(x.size):
        found = np.minimum(found, x[i])  # not a number, if one is not
    return found


@jit
def largest(x):
    found = 0.0
    for i in range(x.size):
        found = np.maximum(found, abs(x[i]))
    return found


@jit
def differs(a, b):
    for i in range(a.size):
        if a[i] != b[i]:
            return True
    return False
