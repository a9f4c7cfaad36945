"""Pieces of the compiled kernels of :mod:`.loops`, for a block of elements.

t are :class:`~skfem_ancf.beam.kernels.compiled.CompiledTables`; ``first`` is the number of the
first element. Arrays have the elements last: unknowns U and forces F (m, 2 W); rows r, their change
d and forces B (rows, 2 W); directions X; strains E and stresses T (ns, W).
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
