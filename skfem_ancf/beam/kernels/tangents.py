"""Tangents of a block of elements in the compiled kernels of :mod:`.loops`.

Coefficients of products of rows are w (np, 3 W) and, of skew ones, z (nz, W); K and Z are lower
halves as in :class:`~skfem_ancf.beam.kernels.compiled.CompiledTables`.
"""

import numpy as np

from ...core.source import F1, F2, I1, I2, apart, source
from .blocks import add, block
from .compiled import W, CompiledTables
from .tables import SECTION


@apart("StrainTables", CompiledTables, F2, F2, F2, F2)
def add_material(t, H, X, w, z):
    """Add coefficients of the products to w (np, 3 W) and z (nz, W)."""
    terms, factors = t.pattern.terms, t.pattern.factors[0]
    for k in range(len(factors)):
        n, c = terms[1, k], factors[k]
        o, x, y, h = w[terms[0, k]], X[terms[2, k]], X[terms[3, k]], H[terms[4, k]]
        for e in range(t.width):
            o[e] += c * h[e] * x[e] * y[e]
            o[W + e] += c * h[e] * x[W + e] * y[W + e]
            o[2 * W + e] += 0.5 * c * h[e] * (x[e] * y[W + e] + x[W + e] * y[e])
        if n >= 0:
            o = z[n]
            for e in range(t.width):
                o[e] += 0.5 * c * h[e] * (x[e] * y[W + e] - x[W + e] * y[e])


@apart("StrainTables", CompiledTables, F2, F2, F2)
def add_geometric(t, r, T, w):
    """Add coefficients of the geometric part."""
    of, rows = t.pattern.of, t.pattern.rows
    if t.kind != SECTION:
        add_cable_geometric(of, r, T, w)
        return
    for s in range(len(T)):
        c, o, x = 0.5 if rows[0, s] == rows[1, s] else 1.0, w[of[s]], T[s]
        for e in range(len(x)):
            o[e] += c * x[e]
            o[W + e] += c * x[e]


@apart("cables", I1, F2, F2, F2)
def add_cable_geometric(of, r, T, w):
    """That of extensions and curvatures."""
    n, flat = len(T) // 2, r.reshape(r.size)
    for p in range(n):
        x, one, two, N, M = flat[4 * p * W:], w[of[p]], w[of[n + p]], T[p], T[n + p]
        for e in range(len(N)):
            a, b, c, d = x[e], x[W + e], x[2 * W + e], x[3 * W + e]
            y = 1.0 / (a * a + b * b)
            s, t, k = 0.5 * N[e] * y * np.sqrt(y), M[e] * y * y, a * d - b * c
            z = 4.0 * k * y * t
            one[e] += z * a * a + s * b * b - t * (2.0 * d * a + k)
            one[W + e] += z * b * b + s * a * a + t * (2.0 * c * b - k)
            one[2 * W + e] += (z - s) * a * b - t * (d * b - c * a)
            two[e] += 2.0 * t * a * b
            two[W + e] -= 2.0 * t * a * b
            two[2 * W + e] += t * (b * b - a * a)


@source
def products(t, first, w, z, K, Z):
    """K = P w, Z = Q z."""
    if len(t.own) == 0:
        np.dot(t.P, w, K)
        np.dot(t.Q, z, Z)
        return
    G, m = block(t.own, first), t.G.shape[1]
    own_products(G, t.used, m, t.pattern.products, w, 1, K)
    own_products(G, t.used, m, t.pattern.skew, z, -1, Z)


@apart("own", F2, I1, int, I2, F2, int, F2)
def own_products(G, used, m, rows, w, sign, K):
    """Sums of ``w[p] (G_g G_h^T + sign G_h G_g^T)``, lower halves; skew ones without diagonal."""
    p, width, size = 0, G.shape[1], w.shape[1]
    v, top = np.empty((m, size)), 1 if sign > 0 else 0
    K[:] = 0.0
    for g in range(len(G) // m):
        v[:] = 0.0
        while p < len(w) and rows[0, p] == g:
            x = w[p]
            for l in range(m):
                n = rows[1, p] * m + l
                if used[n]:
                    a, y = G[n], v[l]
                    for c in range(0, size, width):
                        for e in range(width):
                            y[c + e] += a[e] * x[c + e]
            p += 1
        n = 0
        for k in range(m):
            for l in range(k + top):
                a, b, x, y, o = G[g * m + k], G[g * m + l], v[l], v[k], K[n]
                if used[g * m + k] or used[g * m + l]:
                    for c in range(0, size, width):
                        for e in range(width):
                            o[c + e] += a[e] * x[c + e] + sign * b[e] * y[c + e]
                n += 1


@apart("own", F2, F2, int)
def scale_products(D, K, top):
    """Multiply a lower half, with diagonal if ``top`` is 1, by D from both sides."""
    n = 0
    for k in range(len(D)):
        for l in range(k + top):
            a, b, o = D[k], D[l], K[n]
            for c in range(0, len(o), len(a)):
                for e in range(len(a)):
                    o[c + e] *= a[e] * b[e]
            n += 1


@source
def place(i, m):
    """Function, component and sign of DOF i: the left node acts as minus the right."""
    k, a = i // 2, i % 2
    return (m // 2, a, -1.0) if k == 0 else (k - 1, a, 1.0)


@apart("StrainTables", I1, int, int, int, F2, F2, F1)
def add_to_band(start, first, ld, m, K, Z, A):
    """Add tangents to a lower half."""
    last = min(W, len(start) - first)
    at = np.empty(W, np.uint64)
    for e in range(last):
        at[e] = start[first + e] * ld
    for j in range(2 * m + 2):
        l, b, sj = place(j, m)
        for i in range(j, 2 * m + 2):
            k, a, si = place(i, m)
            high, low, sign, p = max(k, l), min(k, l), si * sj, np.uint64(j * ld + i - j)
            x = K[high * (high + 1) // 2 + low][(a if a == b else 2) * W:]
            if a == b or k == l:
                for e in range(last):
                    A[at[e] + p] += sign * x[e]
            else:
                c, y = sign if (k > l) == (a < b) else -sign, Z[high * (high - 1) // 2 + low]
                for e in range(last):
                    A[at[e] + p] += sign * x[e] + c * y[e]


@apart("StrainTables", CompiledTables, int, F2, F2, int, int, F1)
def add_matrices(t, first, w, z, constant, ld, A):
    """Add the matrices of coefficients to a lower half."""
    m, n = t.G.shape[1], t.width
    K, Z = np.empty((m * (m + 1) // 2, 3 * n)), np.empty((m * (m - 1) // 2, n))
    products(t, first, w, z, K, Z)
    if constant > 0 and len(t.K) > 0:
        add(1.0, block(t.K, first), K)
        add(1.0, block(t.Z, first), Z)
    if len(t.D) > 0:
        scale_products(block(t.D, first), K, 1)
        scale_products(block(t.D, first), Z, 0)
    add_to_band(t.start, first, ld, m, K, Z, A)
