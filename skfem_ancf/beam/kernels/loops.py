"""Compiled kernels: the functions of :mod:`.runs` as loops over blocks of elements.

t are :class:`~skfem_ancf.beam.kernels.compiled.CompiledTables`; ``given`` and ``out`` are stresses
(ne ns,), or of size 0. Work arrays have the elements last: unknowns U and forces F (m, 2 W); rows r,
their change d and forces B (rows, 2 W); directions X; strains E and stresses T (ns, W).
"""

import numpy as np

from ...core.source import primitive, source
from .compiled import W
from .law import LINEAR, conserve, law_evaluate
from .tables import SECTION


@source
def block(x, first):
    """The table of a block of elements, which begins with number ``first``."""
    return x[first // W if len(x) > 1 else 0]


@source
def gather(t, first, u, U):
    """DOFs relative to the left node, scaled."""
    m, start = len(U), t.start
    for e in range(W):
        v = u[start[min(first + e, len(start) - 1)]:]
        for k in range(m):
            U[k, e], U[k, W + e] = v[2 * k + 2], v[2 * k + 3]
        U[m // 2, e] -= v[0]
        U[m // 2, W + e] -= v[1]
    if len(t.D) > 0:
        stretch(block(t.D, first), U)


@source
def stretch(D, X):
    """X *= D for both components."""
    for k in range(len(D)):
        c, x = D[k], X[k]
        for e in range(W):
            x[e] *= c[e]
            x[W + e] *= c[e]


@source
def add_to_nodes(t, first, F, f):
    """Add the forces of elements, scaled."""
    m, start = len(F), t.start
    if len(t.D) > 0:
        stretch(block(t.D, first), F)
    for e in range(min(W, len(start) - first)):
        v = f[start[first + e]:]
        for i in range(2):
            v[i] -= F[m // 2, i * W + e]
            for k in range(m):
                v[2 * k + 2 + i] += F[k, i * W + e]


@source
def to_rows(t, first, U, d):
    """d = G U."""
    if len(t.own) == 0:
        np.dot(t.G, U, d)
        return
    G, used, m = block(t.own, first), t.used, len(U)
    d[:] = 0.0
    for n in range(len(G)):
        if used[n]:
            a, x, y = G[n], U[n % m], d[n // m]
            for e in range(W):
                y[e] += a[e] * x[e]
                y[W + e] += a[e] * x[W + e]


@source
def from_rows(t, first, B, F):
    """F = G^T B."""
    if len(t.own) == 0:
        np.dot(t.G.T, B, F)
        return
    G, used, m = block(t.own, first), t.used, len(F)
    F[:] = 0.0
    for n in range(len(G)):
        if used[n]:
            a, x, y = G[n], B[n // m], F[n % m]
            for e in range(W):
                y[e] += a[e] * x[e]
                y[W + e] += a[e] * x[W + e]


@source
def displaced(t, first, u, U, d, r):
    """Unknowns, change of the rows, and rows at u."""
    gather(t, first, u, U)
    to_rows(t, first, U, d)
    x = block(t.x, first)
    for g in range(len(d)):
        a, b, c = x[g], d[g], r[g]
        for e in range(2 * W):
            c[e] = a[e] + b[e]


# strains


@source
def strains(t, first, d, r, E):
    """Strains of the samples."""
    rows, x = t.rows, block(t.x, first)
    if t.kind != SECTION:
        cable_strains(x, d, r, E)
        return
    for s in range(len(E)):
        g, h = rows[0, s], rows[1, s]
        c, p, q, a, b, o = 0.5 if g == h else 1.0, r[g], x[h], d[g], d[h], E[s]
        for e in range(W):
            o[e] = c * (p[e] * b[e] + p[W + e] * b[W + e] + a[e] * q[e] + a[W + e] * q[W + e])


@source
def cable_strains(x, d, r, E):
    """Extension and change of curvature."""
    n = len(E) // 2
    for p in range(n):
        for e in range(W):
            x0, y0, a, b = x[p, e], x[p, W + e], r[p, e], r[p, W + e]
            square0, square = x0 * x0 + y0 * y0, a * a + b * b
            E[p, e] = ((a + x0) * d[p, e] + (b + y0) * d[p, W + e]) / (
                np.sqrt(square) + np.sqrt(square0))
            E[n + p, e] = ((a * r[n + p, W + e] - b * r[n + p, e]) / square
                           - (x0 * x[n + p, W + e] - y0 * x[n + p, e]) / square0)


@source
def directions(t, r, s, X):
    """Directions in which changes of the rows change the strain, from rows r to s; returns them.

    They are derivatives for equal r and s. Those of sections are means of the rows.
    """
    if t.kind != SECTION:
        cable_directions(r, s, X)
        return X
    if r is s:
        return r
    for g in range(len(r)):
        a, b, c = r[g], s[g], X[g]
        for e in range(2 * W):
            c[e] = 0.5 * (a[e] + b[e])
    return X


@source
def cable_directions(r, s, X):
    """Those of extensions by r_X, then those of curvatures by r_X and by r_XX."""
    n = len(r) // 2
    for p in range(n):
        q, z = n + p, 2 * n + p
        for e in range(W):
            a, b, ax, ay = r[p, e], r[p, W + e], r[q, e], r[q, W + e]
            a1, b1, ax1, ay1 = s[p, e], s[p, W + e], s[q, e], s[q, W + e]
            square, square1 = a * a + b * b, a1 * a1 + b1 * b1
            kappa = (a * ay - b * ax) / square + (a1 * ay1 - b1 * ax1) / square1
            one, two = 1.0 / (np.sqrt(square) + np.sqrt(square1)), 1.0 / (square + square1)
            X[p, e], X[p, W + e] = one * (a + a1), one * (b + b1)
            X[q, e] = two * (ay + ay1 - kappa * (a + a1))
            X[q, W + e] = -two * (ax + ax1 + kappa * (b + b1))
            X[z, e], X[z, W + e] = -two * (b + b1), two * (a + a1)


@source
def changes(t, X, d, E):
    """Change of the strains for a change d of the rows in directions X."""
    rows, ways = t.rows, t.ways
    for s in range(len(E)):
        a, x, o = d[rows[0, s]], X[ways[0, s]], E[s]
        for e in range(W):
            o[e] = a[e] * x[e] + a[W + e] * x[W + e]
        if ways[1, s] >= 0:
            b, y = d[rows[1, s]], X[ways[1, s]]
            for e in range(W):
                o[e] += b[e] * y[e] + b[W + e] * y[W + e]


@source
def add(c, X, Y):
    """Y += c X."""
    for s in range(len(Y)):
        x, y = X[s], Y[s]
        for e in range(len(y)):
            y[e] += c * x[e]


# stresses


@source
def times(pairs, H, E, T):
    """T = H E."""
    T[:] = 0.0
    for q in range(len(H)):
        s, t, h = pairs[0, q], pairs[1, q], H[q]
        a, b, x, y = T[s], T[t], E[s], E[t]
        for e in range(W):
            a[e] += h[e] * y[e]
        if s != t:
            for e in range(W):
                b[e] += h[e] * x[e]


@source
def at_points(t, first, E):
    """Strains at the integration points, (3, points, W)."""
    x = E.copy()
    if len(t.sigma) > 0:
        multiply(block(t.sigma, first), x)
    return np.dot(t.along, x).reshape(3, t.weights.shape[1], W)


@source
def multiply(C, X):
    """X *= C."""
    for s in range(len(X)):
        c, x = C[s], X[s]
        for e in range(W):
            x[e] *= c[e]


@source
def from_points(t, first, S, T):
    """Weighted stresses from those S at the points."""
    w = block(t.weights, first)
    for c in range(3):
        multiply(w, S[c])
    np.dot(t.along.T, S.reshape(3 * len(w), W), T)
    if len(t.sigma) > 0:
        multiply(block(t.sigma, first), T)


@source
def stresses(t, first, E, change, T):
    """Weighted stresses of strains; of their mean from E to E + change, unless that is empty."""
    if t.law.kind == LINEAR:
        if len(change) == 0:
            times(t.pairs, block(t.H, first), E, T)
        else:
            middle = E.copy()
            add(0.5, change, middle)
            times(t.pairs, block(t.H, first), middle, T)
    else:
        law_stresses(t, first, E, change, T)


@primitive("skfem_ancf.equations.loops")
def law_stresses(t, first, E, change, T):
    """:func:`stresses` of a nonlinear law."""
    put_law_stresses(t, first, E, change, T)


@source
def put_law_stresses(t, first, E, change, T):
    """:func:`stresses` of a nonlinear law, by address."""
    S = np.empty((3, t.weights.shape[1], W))
    if len(change) == 0:
        law_evaluate(t.law, at_points(t, first, E), S)
    else:
        middle = E.copy()
        add(0.5, change, middle)
        x = at_points(t, first, middle)
        law_evaluate(t.law, x, S)
        conserve(t.law, x, at_points(t, first, change), S)
    from_points(t, first, S, T)


@source
def moduli(t, first, E):
    """Weighted moduli between samples, (nq, W)."""
    if t.law.kind == LINEAR:
        return block(t.H, first)
    H = np.empty((t.pairs.shape[1], W))
    law_moduli(t, first, E, H)
    return H


@primitive("skfem_ancf.equations.loops")
def law_moduli(t, first, E, H):
    """:func:`moduli` of a nonlinear law."""
    put_law_moduli(t, first, E, H)


@source
def put_law_moduli(t, first, E, H):
    """:func:`moduli` of a nonlinear law, by address."""
    M = np.empty((9, t.weights.shape[1], W))
    law_evaluate(t.law, at_points(t, first, E), M)
    between_samples(t, first, M, H)


@source
def between_samples(t, first, M, H):
    """Moduli between samples from those at the points, (9, points, W)."""
    pairs, along, w, points = t.pairs, t.along, block(t.weights, first), t.weights.shape[1]
    H[:] = 0.0
    for q in range(len(H)):
        s, r, h = pairs[0, q], pairs[1, q], H[q]
        for c in range(9):
            for p in range(points):
                x = along[c // 3 * points + p, s] * along[c % 3 * points + p, r]
                if x != 0.0:
                    a, b = w[p], M[c, p]
                    for e in range(W):
                        h[e] += x * a[e] * b[e]
        if len(t.sigma) > 0:
            a, b = block(t.sigma, first)[s], block(t.sigma, first)[r]
            for e in range(W):
                h[e] *= a[e] * b[e]


@source
def take(t, first, given, T):
    """Given stresses, scaled."""
    ns, ne = len(T), len(t.start)
    for e in range(W):
        one = given[min(first + e, ne - 1) * ns:]
        for s in range(ns):
            T[s, e] = one[s]
    if len(t.sigma) > 0:
        multiply(block(t.sigma, first), T)


@source
def put(t, first, T, more, out):
    """Write stresses, plus ``more`` if not empty."""
    ns = len(T)
    for e in range(min(W, len(t.start) - first)):
        at = (first + e) * ns
        for s in range(ns):
            out[at + s] = T[s, e]
        if len(t.sigma) > 0:
            c = block(t.sigma, first)
            for s in range(ns):
                out[at + s] /= c[s, e]
        if more.size > 0:
            for s in range(ns):
                out[at + s] += more[at + s]


# forces


@source
def push(t, first, X, T, B, F, f):
    """Add the forces of stresses in directions X."""
    rows, ways = t.rows, t.ways
    B[:] = 0.0
    for s in range(len(T)):
        a, x, c = B[rows[0, s]], X[ways[0, s]], T[s]
        for e in range(W):
            a[e] += c[e] * x[e]
            a[W + e] += c[e] * x[W + e]
        if ways[1, s] >= 0:
            b, y = B[rows[1, s]], X[ways[1, s]]
            for e in range(W):
                b[e] += c[e] * y[e]
                b[W + e] += c[e] * y[W + e]
    from_rows(t, first, B, F)
    add_to_nodes(t, first, F, f)


@source
def push_constant(t, first, U, F, f):
    """Add the forces of the constant stiffness."""
    if len(t.K) == 0:
        return
    K, Z, n, p = block(t.K, first), block(t.Z, first), 0, 0
    F[:] = 0.0
    for k in range(len(U)):
        for l in range(k):
            a, z, x, y, X, Y = K[n], Z[p], U[k], U[l], F[k], F[l]
            for e in range(W):
                xy, yx = a[2 * W + e] + z[e], a[2 * W + e] - z[e]
                X[e] += a[e] * y[e] + xy * y[W + e]
                X[W + e] += a[W + e] * y[W + e] + yx * y[e]
                Y[e] += a[e] * x[e] + yx * x[W + e]
                Y[W + e] += a[W + e] * x[W + e] + xy * x[e]
            n, p = n + 1, p + 1
        a, x, X = K[n], U[k], F[k]
        for e in range(W):
            X[e] += a[e] * x[e] + a[2 * W + e] * x[W + e]
            X[W + e] += a[W + e] * x[W + e] + a[2 * W + e] * x[e]
        n += 1
    add_to_nodes(t, first, F, f)


@source
def force(t, u, given, out, f):
    """Force and stresses at u; given stresses act in place of those of the strain.

    Without ``out``, given stresses act without the constant stiffness.
    """
    R, m, ns = t.G.shape[0], t.G.shape[1], t.rows.shape[1]
    U, F, d, r, B = (np.empty((m, 2 * W)), np.empty((m, 2 * W)), np.empty((R, 2 * W)),
                     np.empty((R, 2 * W)), np.empty((R, 2 * W)))
    E, T, X = np.empty((ns, W)), np.empty((ns, W)), np.empty((3 * R // 2, 2 * W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        if out.size > 0 or given.size == 0:
            strains(t, first, d, r, E)
            stresses(t, first, E, E[:0], T)
        if out.size > 0:
            put(t, first, T, out[:0], out)
        if given.size > 0:
            take(t, first, given, T)
        if f.size > 0:
            push(t, first, directions(t, r, r, X), T, B, F, f)
            if out.size > 0 or given.size == 0:
                push_constant(t, first, U, F, f)


@source
def mean(t, u, v, given, out, f):
    """As :func:`force`, but means from u to v whose work is the change of the energy."""
    R, m, ns, du = t.G.shape[0], t.G.shape[1], t.rows.shape[1], v - u
    U, V, F, d, dd, r, z, B = (np.empty((m, 2 * W)), np.empty((m, 2 * W)), np.empty((m, 2 * W)),
                               np.empty((R, 2 * W)), np.empty((R, 2 * W)), np.empty((R, 2 * W)),
                               np.empty((R, 2 * W)), np.empty((R, 2 * W)))
    E, C, T = np.empty((ns, W)), np.empty((ns, W)), np.empty((ns, W))
    X = np.empty((3 * R // 2, 2 * W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        gather(t, first, du, V)
        to_rows(t, first, V, dd)
        z[:] = r
        add(1.0, dd, z)
        D = directions(t, r, z, X)
        if out.size > 0 or given.size == 0:
            strains(t, first, d, r, E)
            changes(t, D, dd, C)
            stresses(t, first, E, C, T)
        if out.size > 0:
            put(t, first, T, out[:0], out)
        if given.size > 0:
            take(t, first, given, T)
        push(t, first, D, T, B, F, f)
        if out.size > 0 or given.size == 0:
            add(0.5, V, U)
            push_constant(t, first, U, F, f)


@source
def linearised(t, u, du, given, out, f):
    """Linearised stresses for a change or rate du at u: written plus the given ones, or as force."""
    R, m, ns = t.G.shape[0], t.G.shape[1], t.rows.shape[1]
    U, F, d, dd, r, B = (np.empty((m, 2 * W)), np.empty((m, 2 * W)), np.empty((R, 2 * W)),
                         np.empty((R, 2 * W)), np.empty((R, 2 * W)), np.empty((R, 2 * W)))
    E, T, X = np.empty((ns, W)), np.empty((ns, W)), np.empty((3 * R // 2, 2 * W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        gather(t, first, du, U)
        to_rows(t, first, U, dd)
        if t.law.kind != LINEAR:
            strains(t, first, d, r, E)
        H, D = moduli(t, first, E), directions(t, r, r, X)
        changes(t, D, dd, E)
        times(t.pairs, H, E, T)
        if out.size > 0:
            put(t, first, T, given, out)
        if f.size > 0:
            push(t, first, D, T, B, F, f)


# tangents


@source
def add_material(t, H, X, w, z):
    """Add coefficients of the products to w (np, 3 W) and z (nz, W)."""
    terms, factors = t.terms, t.factors[0]
    for k in range(len(factors)):
        n, c = terms[1, k], factors[k]
        o, x, y, h = w[terms[0, k]], X[terms[2, k]], X[terms[3, k]], H[terms[4, k]]
        for e in range(W):
            o[e] += c * h[e] * x[e] * y[e]
            o[W + e] += c * h[e] * x[W + e] * y[W + e]
            o[2 * W + e] += 0.5 * c * h[e] * (x[e] * y[W + e] + x[W + e] * y[e])
        if n >= 0:
            o = z[n]
            for e in range(W):
                o[e] += 0.5 * c * h[e] * (x[e] * y[W + e] - x[W + e] * y[e])


@source
def add_geometric(t, r, T, w):
    """Add coefficients of the geometric part."""
    of, rows = t.of, t.rows
    if t.kind != SECTION:
        add_cable_geometric(of, r, T, w)
        return
    for s in range(len(T)):
        c, o, x = 0.5 if rows[0, s] == rows[1, s] else 1.0, w[of[s]], T[s]
        for e in range(W):
            o[e] += c * x[e]
            o[W + e] += c * x[e]


@source
def add_cable_geometric(of, r, T, w):
    """That of extensions and curvatures."""
    n = len(T) // 2
    for p in range(n):
        q = n + p
        one, two = w[of[p]], w[of[q]]
        for e in range(W):
            a, b, ax, ay = r[p, e], r[p, W + e], r[q, e], r[q, W + e]
            square = a * a + b * b
            kappa = (a * ay - b * ax) / square
            N, M = 0.5 * T[p, e] / (square * np.sqrt(square)), T[q, e] / (square * square)
            c, y = 4.0 * kappa * M, kappa * square
            one[e] += c * a * a + N * b * b - M * (2.0 * ay * a + y)
            one[W + e] += c * b * b + N * a * a + M * (2.0 * ax * b - y)
            one[2 * W + e] += (c - N) * a * b - M * (ay * b - ax * a)
            two[e] += 2.0 * M * a * b
            two[W + e] -= 2.0 * M * a * b
            two[2 * W + e] += M * (b * b - a * a)


@source
def products(t, first, w, z, K, Z):
    """K = P w, Z = Q z."""
    if len(t.own) == 0:
        np.dot(t.P, w, K)
        np.dot(t.Q, z, Z)
        return
    G, m = block(t.own, first), t.G.shape[1]
    own_products(G, t.used, m, t.products, w, 1, K)
    own_products(G, t.used, m, t.skew, z, -1, Z)


@source
def own_products(G, used, m, rows, w, sign, K):
    """Sums of ``w[p] (G_g G_h^T + sign G_h G_g^T)``, lower halves; skew ones without diagonal."""
    p, size = 0, w.shape[1] // W
    v, top = np.empty((m, w.shape[1])), 1 if sign > 0 else 0
    K[:] = 0.0
    for g in range(len(G) // m):
        v[:] = 0.0
        while p < len(w) and rows[0, p] == g:
            x = w[p]
            for l in range(m):
                n = rows[1, p] * m + l
                if used[n]:
                    a, y = G[n], v[l]
                    for c in range(size):
                        for e in range(W):
                            y[c * W + e] += a[e] * x[c * W + e]
            p += 1
        n = 0
        for k in range(m):
            for l in range(k + top):
                a, b, x, y, o = G[g * m + k], G[g * m + l], v[l], v[k], K[n]
                if used[g * m + k] or used[g * m + l]:
                    for c in range(size):
                        for e in range(W):
                            o[c * W + e] += a[e] * x[c * W + e] + sign * b[e] * y[c * W + e]
                n += 1


@source
def scale_products(D, K, top):
    """Multiply a lower half, with diagonal if ``top`` is 1, by D from both sides."""
    n = 0
    for k in range(len(D)):
        for l in range(k + top):
            a, b, o = D[k], D[l], K[n]
            for c in range(len(o) // W):
                for e in range(W):
                    o[c * W + e] *= a[e] * b[e]
            n += 1


@source
def place(i, m):
    """Function, component and sign of DOF i of an element: the left node acts as minus the right."""
    k, a = i // 2, i % 2
    return (m // 2, a, -1.0) if k == 0 else (k - 1, a, 1.0)


@source
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


@source
def add_matrices(t, first, w, z, constant, ld, A):
    """Add the matrices of coefficients to a lower half."""
    m = t.G.shape[1]
    K, Z = np.empty((m * (m + 1) // 2, 3 * W)), np.empty((m * (m - 1) // 2, W))
    products(t, first, w, z, K, Z)
    if constant and len(t.K) > 0:
        add(1.0, block(t.K, first), K)
        add(1.0, block(t.Z, first), Z)
    if len(t.D) > 0:
        scale_products(block(t.D, first), K, 1)
        scale_products(block(t.D, first), Z, 0)
    add_to_band(t.start, first, ld, m, K, Z, A)


@source
def tangent(t, u, given, out, f, A, ld):
    """Tangent, force and stresses at u; the geometric part has the given stresses, if any."""
    R, m, ns = t.G.shape[0], t.G.shape[1], t.rows.shape[1]
    U, F, d, r, B = (np.empty((m, 2 * W)), np.empty((m, 2 * W)), np.empty((R, 2 * W)),
                     np.empty((R, 2 * W)), np.empty((R, 2 * W)))
    E, T, Y = np.empty((ns, W)), np.empty((ns, W)), np.empty((3 * R // 2, 2 * W))
    w, z = np.empty((t.products.shape[1], 3 * W)), np.empty((t.skew.shape[1], W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        strains(t, first, d, r, E)
        X = directions(t, r, r, Y)
        if out.size > 0 or f.size > 0 or given.size == 0:
            stresses(t, first, E, E[:0], T)
        if out.size > 0:
            put(t, first, T, out[:0], out)
        if f.size > 0:
            push(t, first, X, T, B, F, f)
            push_constant(t, first, U, F, f)
        w[:] = 0.0
        z[:] = 0.0
        add_material(t, moduli(t, first, E), X, w, z)
        if given.size > 0:
            take(t, first, given, T)
        add_geometric(t, r, T, w)
        add_matrices(t, first, w, z, True, ld, A)


@source
def unsymmetric(t, u, v, A, ld):
    """Add ``B(u)^T H (B(v) - B(u))`` to a matrix in two halves."""
    R, m, ns, n = t.G.shape[0], t.G.shape[1], t.rows.shape[1], 3 * t.G.shape[0] // 2
    U, d, r, s = (np.empty((m, 2 * W)), np.empty((R, 2 * W)), np.empty((R, 2 * W)),
                  np.empty((R, 2 * W)))
    E, X, Y = np.empty((ns, W)), np.empty((n, 2 * W)), np.empty((n, 2 * W))
    w, z = np.empty((t.products.shape[1], 4 * W)), np.empty((t.skew.shape[1], 4 * W))
    K, Z = np.empty((m * (m + 1) // 2, 4 * W)), np.empty((m * (m - 1) // 2, 4 * W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        strains(t, first, d, r, E)
        gather(t, first, v - u, U)
        to_rows(t, first, U, d)
        s[:] = r
        add(1.0, d, s)
        one, two = directions(t, r, r, X), directions(t, s, s, Y)
        w[:] = 0.0
        z[:] = 0.0
        add_difference(t, moduli(t, first, E), one, two, w, z)
        products(t, first, w, z, K, Z)
        if len(t.D) > 0:
            scale_products(block(t.D, first), K, 1)
            scale_products(block(t.D, first), Z, 0)
        add_to_halves(t.start, first, ld, m, K, Z, A)


@source
def add_difference(t, H, X, Y, w, z):
    """Coefficients xx, xy, yx, yy of ``X^T H (Y - X)``, symmetric and skew in the functions."""
    terms, factors = t.terms, t.factors[0]
    for k in range(len(factors)):
        n, p, a, b, h = terms[1, k], terms[0, k], terms[2, k], terms[3, k], H[terms[4, k]]
        for i in range(2):
            for j in range(2):
                at = (2 * i + j) * W
                for e in range(W):
                    x = X[a, i * W + e] * (Y[b, j * W + e] - X[b, j * W + e])
                    y = X[b, i * W + e] * (Y[a, j * W + e] - X[a, j * W + e])
                    c = 0.5 * factors[k] * h[e]
                    w[p, at + e] += c * (x + y)
                    if n >= 0:
                        z[n, at + e] += c * (x - y)


@source
def add_to_halves(start, first, ld, m, K, Z, A):
    """Add matrices to both halves."""
    for j in range(2 * m + 2):
        l, b, sj = place(j, m)
        for i in range(2 * m + 2):
            k, a, si = place(i, m)
            high, low, at = max(k, l), min(k, l), (2 * a + b) * W
            p = j * ld + i - j if i >= j else i * ld + j - i + ld // 2
            for e in range(min(W, len(start) - first)):
                x = K[high * (high + 1) // 2 + low, at + e]
                if k != l:
                    y = Z[high * (high - 1) // 2 + low, at + e]
                    x += y if k > l else -y
                A[start[first + e] * ld + p] += si * sj * x
                if i == j:  # the diagonal is in both
                    A[start[first + e] * ld + p + ld // 2] += si * sj * x


# gradients of strains


@source
def gradients(t, u, out):
    """Write the derivatives of strains and of weighted stresses, (2, ne, ns, 2 nb)."""
    R, m, ns = t.G.shape[0], t.G.shape[1], t.rows.shape[1]
    both = out.reshape(2, len(t.start), ns, 2 * m + 2)
    U, d, r = np.empty((m, 2 * W)), np.empty((R, 2 * W)), np.empty((R, 2 * W))
    E, Y = np.empty((ns, W)), np.empty((3 * R // 2, 2 * W))
    B, C = np.empty((ns, 2 * m * W)), np.empty((ns, 2 * m * W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        strains(t, first, d, r, E)
        put_derivatives(t, first, directions(t, r, r, Y), B)
        H, pairs = moduli(t, first, E), t.pairs
        C[:] = 0.0
        for q in range(len(H)):
            s, p, h = pairs[0, q], pairs[1, q], H[q]
            for i in range(2 * m):
                for e in range(W):
                    C[s, i * W + e] += h[e] * B[p, i * W + e]
                if s != p:
                    for e in range(W):
                        C[p, i * W + e] += h[e] * B[s, i * W + e]
        put_columns(t, first, B, 1, both[0])
        put_columns(t, first, C, -1, both[1])


@source
def put_derivatives(t, first, X, B):
    """Derivatives of the strains by the scaled unknowns, (ns, 2 m W)."""
    rows, ways, m, shared = t.rows, t.ways, t.G.shape[1], len(t.own) == 0
    G = np.empty((t.G.size, W))
    for n in range(len(G)):
        for e in range(W):
            G[n, e] = t.G[n // m, n % m] if shared else t.own[first // W, n, e]
    B[:] = 0.0
    for s in range(len(B)):
        for i in range(2):
            if ways[i, s] >= 0:
                x = X[ways[i, s]]
                for k in range(m):
                    g = G[rows[i, s] * m + k]
                    for e in range(W):
                        B[s, 2 * k * W + e] += g[e] * x[e]
                        B[s, (2 * k + 1) * W + e] += g[e] * x[W + e]


@source
def put_columns(t, first, B, power, out):
    """Write derivatives by the DOFs of both nodes."""
    ns, m = len(B), B.shape[1] // (2 * W)
    for e in range(min(W, len(t.start) - first)):
        for s in range(ns):
            c = 1.0
            if len(t.sigma) > 0:
                c = block(t.sigma, first)[s, e] ** power
            for i in range(2 * m):
                x = c * B[s, i * W + e]
                if len(t.D) > 0:
                    x *= block(t.D, first)[i // 2, e]
                out[first + e, s, i + 2] = x
            for i in range(2):
                out[first + e, s, i] = -out[first + e, s, 2 * (m // 2) + 2 + i]


# eigenstrains


@source
def shifted(t, first, E, change, shift, S):
    """Change of the stresses (3, points, W) of a nonlinear law by a shift of the strain."""
    x, still, ne = at_points(t, first, E), np.empty(S.shape), len(t.start)
    law_evaluate(t.law, x, still)
    if change.size > 0:
        conserve(t.law, x, at_points(t, first, change), still)
    points = x.shape[1]
    for c in range(3):
        for p in range(points):
            for e in range(W):
                x[c, p, e] += shift[(c * points + p) * ne + min(first + e, ne - 1)]
    law_evaluate(t.law, x, S)
    if change.size > 0:
        conserve(t.law, x, at_points(t, first, change), S)
    y, z = S.reshape(S.size), still.reshape(S.size)
    for k in range(S.size):
        y[k] -= z[k]


@source
def eigen_mean(t, u, v, shift, f):
    """Change of the mean force from u to v by eigenstrains (3, points, ne) of a nonlinear law."""
    R, m, ns, du = t.G.shape[0], t.G.shape[1], t.rows.shape[1], v - u
    U, F, d, dd, r, z, B = (np.empty((m, 2 * W)), np.empty((m, 2 * W)), np.empty((R, 2 * W)),
                            np.empty((R, 2 * W)), np.empty((R, 2 * W)), np.empty((R, 2 * W)),
                            np.empty((R, 2 * W)))
    E, C, T = np.empty((ns, W)), np.empty((ns, W)), np.empty((ns, W))
    X, S = np.empty((3 * R // 2, 2 * W)), np.empty((3, t.weights.shape[1], W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        gather(t, first, du, U)
        to_rows(t, first, U, dd)
        z[:] = r
        add(1.0, dd, z)
        D = directions(t, r, z, X)
        strains(t, first, d, r, E)
        changes(t, D, dd, C)
        add(0.5, C, E)
        shifted(t, first, E, C, shift, S)
        from_points(t, first, S, T)
        push(t, first, D, T, B, F, f)


@source
def eigen_tangent(t, u, given, A, ld):
    """Change of the tangent at u by eigenstrains: stresses for linear laws, else strains."""
    R, m, ns = t.G.shape[0], t.G.shape[1], t.rows.shape[1]
    U, d, r = np.empty((m, 2 * W)), np.empty((R, 2 * W)), np.empty((R, 2 * W))
    E, T = np.empty((ns, W)), np.empty((ns, W))
    w, z = np.empty((t.products.shape[1], 3 * W)), np.empty((t.skew.shape[1], W))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        w[:] = 0.0
        z[:] = 0.0
        if t.law.kind == LINEAR:
            take(t, first, given, T)
        else:
            strains(t, first, d, r, E)
            S, M = np.empty((3, t.weights.shape[1], W)), np.empty((9, t.weights.shape[1], W))
            shifted(t, first, E, E[:0], given, S)
            from_points(t, first, S, T)
            shifted(t, first, E, E[:0], given, M)
            H = np.empty((t.pairs.shape[1], W))
            between_samples(t, first, M, H)
            add_material(t, H, r, w, z)
        add_geometric(t, r, T, w)
        add_matrices(t, first, w, z, False, ld, A)


# derivatives of strains in collocation


@source
def add_changes(B, start, x, T):
    """Add ``B[e] x`` at start[e] to T (ne ns,), with B repeated for copies of the elements."""
    k, ns, n = B.shape
    for e in range(len(start)):
        for s in range(ns):
            total = 0.0
            for i in range(n):
                total += B[e % k, s, i] * x[start[e] + i]
            T[e * ns + s] += total


@source
def add_transposed(B, start, T, f):
    """Add ``B[e]^T T[e]`` at start[e] to f, with B repeated for copies."""
    k, ns, n = B.shape
    for e in range(len(start)):
        for s in range(ns):
            total = T[e * ns + s]
            for i in range(n):
                f[start[e] + i] += B[e % k, s, i] * total
