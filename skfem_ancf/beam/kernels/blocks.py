"""Pieces of the compiled kernels of :mod:`.loops`, for a block of elements. t are
:class:`~skfem_ancf.beam.kernels.compiled.CompiledTables`; ``first`` is the number of the first
element. Arrays have the elements last: unknowns U and forces F (m, 2 W); rows r, their change d and
forces B (rows, 2 W); directions X; strains E and stresses T (ns, W). Loops over elements end at
``t.width``, which is W: LLVM unrolls those whose length it knows, which prevents vectors. So do too
many arrays in one loop, whose addresses it compares."""

import numpy as np

from ...core import F1, F2, F3, I1, I2, apart, room, shaped, source
from .compiled import W, CompiledTables
from .tables import HISTORY, LINEAR, SECTION, conserve, evaluate_history, law_evaluate


@source
def block(x, first):
    """The table of a block of elements, which begins with number ``first``."""
    return x[first // W if len(x) > 1 else 0]


@apart("StrainTables", CompiledTables, int, F1, F2)
def gather(t, first, u, U):
    """DOFs relative to the left node, scaled; those of no element are zero."""
    m, last, at = len(U), min(t.width, len(t.start) - first), t.start[first:]
    if last < t.width:
        U[:] = 0.0
    for k in range(m):
        x, v = U[k], u[2 * k + 2:]
        for e in range(last):
            x[e], x[W + e] = v[np.uint64(at[e])], v[np.uint64(at[e] + 1)]
    x = U[m // 2]
    for e in range(last):
        x[e] -= u[np.uint64(at[e])]
        x[W + e] -= u[np.uint64(at[e] + 1)]
    if len(t.D) > 0:
        multiply(block(t.D, first), U)


@source
def multiply(C, X):
    for s in range(len(X)):
        c, x = C[s], X[s]
        for i in range(0, len(x), len(c)):
            for e in range(len(c)):
                x[i + e] *= c[e]


@source
def add_to_nodes(t, first, F, f):
    """Add the forces of elements, scaled."""
    m, last, at = len(F), min(t.width, len(t.start) - first), t.start[first:]
    if len(t.D) > 0:
        multiply(block(t.D, first), F)
    for k in range(m):
        x, v = F[k], f[2 * k + 2:]
        for e in range(last):
            v[np.uint64(at[e])] += x[e]
            v[np.uint64(at[e] + 1)] += x[W + e]
    x = F[m // 2]
    for e in range(last):
        f[np.uint64(at[e])] -= x[e]
        f[np.uint64(at[e] + 1)] -= x[W + e]


@source
def to_rows(t, first, U, d):
    """d = G U."""
    if len(t.own) == 0:
        np.dot(t.G, U, d)
        return
    d[:] = 0.0
    add_own(block(t.own, first), t.used, len(U), U, d, 0)


@apart("own", F2, I1, int, F2, F2, int)
def add_own(G, used, m, X, Y, back):
    """Y += G X, or with ``back`` G^T X, for derivatives of each element."""
    for n in range(len(G)):
        if used[n]:
            row, column = n // m, n % m
            a, x, y = G[n], X[row if back > 0 else column], Y[column if back > 0 else row]
            for e in range(len(a)):
                y[e] += a[e] * x[e]
                y[W + e] += a[e] * x[W + e]


@apart("StrainTables", CompiledTables, int, F1, F2, F2, F2)
def displaced(t, first, u, U, d, r):
    """Unknowns, change of the rows, and rows at u."""
    gather(t, first, u, U)
    to_rows(t, first, U, d)
    x = block(t.x, first)
    for g in range(len(d)):
        a, b, c = x[g], d[g], r[g]
        for e in range(len(c)):
            c[e] = a[e] + b[e]


# strains


@apart("StrainTables", CompiledTables, int, F2, F2, F2)
def strains(t, first, d, r, E):
    """Strains of the samples."""
    rows, x = t.pattern.rows, block(t.x, first)
    if t.kind != SECTION:
        cable_strains(block(t.rest, first), d, r, E)
        return
    for s in range(len(E)):
        g, h = rows[0, s], rows[1, s]
        c, p, q, a, b, o = 0.5 if g == h else 1.0, r[g], x[h], d[g], d[h], E[s]
        for e in range(len(o)):
            o[e] = c * (p[e] * b[e] + p[W + e] * b[W + e] + a[e] * q[e] + a[W + e] * q[W + e])


@apart("cables", F2, F2, F2, F2)
def cable_strains(rest, d, r, E):
    """Extension and change of curvature; ``rest`` are |r_X| and the curvature of the reference."""
    n, flat = len(E) // 2, shaped(r, (r.size,))
    for p in range(n):
        change, x, h, k, still = d[2 * p], flat[4 * p * W:], E[p], E[n + p], rest[p]
        for e in range(len(h)):
            a, b, c, f = x[e], x[W + e], change[e], change[W + e]
            square = a * a + b * b
            size = np.sqrt(square) + still[e]
            y = 1.0 / (square * size)  # one division is faster than two
            h[e] = ((2.0 * a - c) * c + (2.0 * b - f) * f) * square * y
            k[e] = (a * x[3 * W + e] - b * x[2 * W + e]) * size * y - still[W + e]


@source
def directions(t, r, dd, X):
    """Directions in which a change of the rows from r to r + dd changes the strain; returns them.
    They are derivatives without dd. Those of sections are means of the rows."""
    if t.kind != SECTION:
        cable_directions(r, dd if len(dd) > 0 else r, min(1.0, len(dd)), X)
        return X
    if len(dd) == 0:
        return r
    for g in range(len(r)):
        a, b, c = r[g], dd[g], X[g]
        for e in range(len(c)):
            c[e] = a[e] + 0.5 * b[e]
    return X


@apart("cables", F2, F2, float, F2)
def cable_directions(r, dd, part, X):
    """Those of the extension, and of the curvature by r_X and r_XX, at each point, from r to ``r +
    part dd``."""
    start, change, out = shaped(r, (r.size,)), shaped(dd, (dd.size,)), shaped(X, (X.size,))
    width = r.shape[1] // 2
    for p in range(len(r) // 2):
        a, b, c = start[4 * p * W:], change[4 * p * W:], out[6 * p * W:]
        for e in range(width):
            x0, y0, u0, v0 = a[e], a[W + e], a[2 * W + e], a[3 * W + e]
            x1, y1 = x0 + part * b[e], y0 + part * b[W + e]
            u1, v1 = u0 + part * b[2 * W + e], v0 + part * b[3 * W + e]
            one, two = x0 * x0 + y0 * y0, x1 * x1 + y1 * y1
            length, square, x, y = np.sqrt(one) + np.sqrt(two), one + two, x0 + x1, y0 + y1
            h = 1.0 / (one * two * length * square)  # one division is faster than four
            kappa = ((x0 * v0 - y0 * u0) * two + (x1 * v1 - y1 * u1) * one) * length * square * h
            k = h * one * two
            h = k * square
            k *= length
            c[e], c[W + e] = h * x, h * y
            c[2 * W + e] = k * (v0 + v1 - kappa * x)
            c[3 * W + e] = -k * (u0 + u1 + kappa * y)
            c[4 * W + e], c[5 * W + e] = -k * y, k * x


@apart("StrainTables", CompiledTables, F2, F2, F2)
def changes(t, X, d, E):
    """Change of the strains for a change d of the rows in directions X."""
    rows, ways = t.pattern.rows, t.pattern.ways
    for s in range(len(E)):
        a, x, o = d[rows[0, s]], X[ways[0, s]], E[s]
        for e in range(len(o)):
            o[e] = a[e] * x[e] + a[W + e] * x[W + e]
        if ways[1, s] >= 0:
            b, y = d[rows[1, s]], X[ways[1, s]]
            for e in range(len(o)):
                o[e] += b[e] * y[e] + b[W + e] * y[W + e]


@source
def add(c, X, Y):
    for s in range(len(Y)):
        x, y = X[s], Y[s]
        for e in range(len(y)):
            y[e] += c * x[e]


# stresses


@apart("StrainTables", I2, F2, F2, F2)
def times(pairs, H, E, T):
    T[:] = 0.0
    for q in range(len(H)):
        s, t, h = pairs[0, q], pairs[1, q], H[q]
        a, b, x, y = T[s], T[t], E[s], E[t]
        for e in range(len(a)):
            a[e] += h[e] * y[e]
        if s != t:
            for e in range(len(b)):
                b[e] += h[e] * x[e]


@source
def at_points(t, first, E):
    """Strains at the integration points, (3 or, of fibres, 1, points, W)."""
    x, out = E.copy(), np.empty((components(t), t.weights.shape[1], t.width))
    if len(t.reach) > 0:
        multiply(block(t.reach, first), x)
    product(t.along.rows, t.along.columns, t.along.values, x, shaped(
        out, (len(out) * out.shape[1], t.width)))
    return out


@source
def components(t):
    """Number of strains at an integration point: fibres have one."""
    return 3 if t.kind == SECTION else 1


@source
def product(rows, columns, values, X, Y):
    """Y = A X of a sparse matrix; of its transpose, if rows and columns are exchanged."""
    Y[:] = 0.0
    for k in range(len(values)):
        c, x, y = values[k], X[columns[k]], Y[rows[k]]
        for e in range(len(y)):
            y[e] += c * x[e]


@source
def from_points(t, first, S, T):
    """Weighted stresses from those S at the points."""
    w, A = block(t.weights, first), t.along
    for c in range(len(S)):
        multiply(w, S[c])
    product(A.columns, A.rows, A.values, shaped(S, (len(S) * len(w), t.width)), T)
    if len(t.reach) > 0:
        multiply(block(t.reach, first), T)


@apart("laws", CompiledTables, int, F2, F2, F2)
def law_stresses(t, first, E, change, T):
    """Weighted stresses of strains E by a nonlinear law."""
    # With a ``change`` about E, their work on it is the change of the energy.
    if t.law.kind == HISTORY:
        mean_with_history(t, first, E, change, T)
        return
    S, x = room((3, t.weights.shape[1], t.width)), at_points(t, first, E)
    law_evaluate(t.law, x, S)
    if len(change) > 0:
        conserve(t.law, x, at_points(t, first, change), S)
    from_points(t, first, S, T)


@apart("histories", CompiledTables, int, F2, F2, F2)
def mean_with_history(t, first, E, change, T):
    """Stresses at the end of an increment, or with a ``change`` about E the mean of both ends."""
    x, ends, m = at_points(t, first, E), 1 if len(change) == 0 else 2, t.memory
    half, S = np.zeros(x.shape), np.zeros(x.shape)
    if ends == 2:
        half = at_points(t, first, change)
    both, y = np.empty((len(x) + len(x)**2, *x.shape[1:])), np.empty(x.shape)
    after = np.empty((len(m.history), *x.shape[1:]))
    for end in range(ends):
        a, b, c = x.ravel(), half.ravel(), y.ravel()
        for k in range(len(a)):
            c[k] = a[k] + (0.5 - end) * b[k]
        evaluate_increment(t, first, y, AT_START if end == 1 else m.span[0], both, after)
        a, b = S.ravel(), both.ravel()
        for k in range(len(a)):
            a[k] += b[k] / ends
    from_points(t, first, S, T)


@source
def moduli(t, first, E, T):
    """Weighted moduli between samples, (nq, W), and of a nonlinear law the stresses."""
    if t.law.kind == LINEAR:
        return block(t.H, first)
    H = np.empty((t.pattern.pairs.shape[1], t.width))
    law_moduli(t, first, E, T, H)
    return H


@apart("laws", CompiledTables, int, F2, F2, F2)
def law_moduli(t, first, E, T, H):
    """:func:`moduli` of a nonlinear law."""
    n, points = components(t), t.weights.shape[1]
    both = np.empty((n + n * n, points, t.width))
    if t.law.kind == HISTORY:
        after = np.empty((len(t.memory.history), points, t.width))
        evaluate_increment(t, first, at_points(t, first, E), t.memory.span[0], both, after)
    else:
        law_evaluate(t.law, at_points(t, first, E), both)
    from_points(t, first, both[:n], T)
    between_samples(t, first, both[n:], H)


@source
def between_samples(t, first, M, H):
    """Moduli between samples from those at the points, (9 or 1, points, W)."""
    pairs, w, A = t.pattern.pairs, block(t.weights, first), t.mixing
    for c in range(len(M)):
        multiply(w, M[c])
    product(A.rows, A.columns, A.values, shaped(M, (len(M) * len(w), t.width)), H)
    if len(t.reach) > 0:
        x = block(t.reach, first)
        for q in range(len(H)):
            a, b, h = x[pairs[0, q]], x[pairs[1, q]], H[q]
            for e in range(t.width):
                h[e] *= a[e] * b[e]


@apart("StrainTables", CompiledTables, int, F1, F2)
def take(t, first, given, T):
    """Given stresses, scaled."""
    ns, last = len(T), min(t.width, len(t.start) - first)
    if last < t.width:
        T[:] = 0.0
    for e in range(last):
        one = given[(first + e) * ns:]
        for s in range(ns):
            T[s, e] = one[s]
    if len(t.sigma) > 0:
        multiply(block(t.sigma, first), T)


@apart("StrainTables", CompiledTables, int, F2, F1, F1)
def put(t, first, T, more, out):
    """Write stresses, plus ``more`` if not empty."""
    ns = len(T)
    for e in range(min(t.width, len(t.start) - first)):
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


@apart("StrainTables", CompiledTables, int, F2, F2, F2, F2, F2, F1)
def add_forces_of(t, first, X, T, U, B, F, f):
    """Add the forces of stresses in directions X; with U, those of the constant stiffness too."""
    rows, ways = t.pattern.rows, t.pattern.ways
    B[:] = 0.0
    for s in range(len(T)):
        a, x, c = B[rows[0, s]], X[ways[0, s]], T[s]
        for e in range(t.width):
            a[e] += c[e] * x[e]
            a[W + e] += c[e] * x[W + e]
        if ways[1, s] >= 0:
            b, y = B[rows[1, s]], X[ways[1, s]]
            for e in range(t.width):
                b[e] += c[e] * y[e]
                b[W + e] += c[e] * y[W + e]
    if len(t.own) == 0:
        np.dot(t.G.T, B, F)
    else:
        F[:] = 0.0
        add_own(block(t.own, first), t.used, len(F), B, F, 1)
    if len(U) > 0 and len(t.K) > 0:
        add_constant(t.coupled, block(t.K, first), block(t.Z, first), U, F)
    add_to_nodes(t, first, F, f)


@apart("StrainTables", I2, F2, F2, F2, F2)
def add_constant(coupled, K, Z, U, F):
    """Add the forces of the constant stiffness."""
    for n in range(coupled.shape[1]):
        k, l = coupled[0, n], coupled[1, n]
        a, x, y, X, Y = K[k * (k + 1) // 2 + l], U[k], U[l], F[k], F[l]
        for e in range(len(x)):
            X[e] += a[e] * y[e]
        if k != l:
            for e in range(len(x)):
                Y[e] += a[e] * x[e]
        if coupled[2, n] > 0:
            add_crossed(a[2 * W:], 1.0, 1.0, y, X)
            if k != l:
                z = Z[k * (k - 1) // 2 + l]
                add_crossed(a[2 * W:], 1.0, 1.0, x, Y)
                add_crossed(z, 1.0, -1.0, y, X)
                add_crossed(z, -1.0, 1.0, x, Y)


@source
def add_crossed(c, one, two, x, y):
    """Add c times component x to y with a factor, and the other way round."""
    for e in range(len(x) // 2):
        y[e] += one * c[e] * x[W + e]
        y[W + e] += two * c[e] * x[e]


# tangents: coefficients of products of rows are w (np, 3 W) and, of skew ones, z (nz, W); K and Z
# are lower halves as in CompiledTables


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
    n, flat = len(T) // 2, shaped(r, (r.size,))
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
    v, top = room((m, size)), 1 if sign > 0 else 0
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
    K, Z = room((m * (m + 1) // 2, 3 * n)), room((m * (m - 1) // 2, n))
    products(t, first, w, z, K, Z)
    if constant > 0 and len(t.K) > 0:
        add(1.0, block(t.K, first), K)
        add(1.0, block(t.Z, first), Z)
    if len(t.D) > 0:
        scale_products(block(t.D, first), K, 1)
        scale_products(block(t.D, first), Z, 0)
    add_to_band(t.start, first, ld, m, K, Z, A)


# laws with a history: :class:`~.kernel.ElementsWithHistory` is for NumPy

#: The time of an increment that stands for its start.
AT_START = -1.0


@source
def of_block(x, first, out):
    """Values (., points, ne) of a block of elements, (., points, W); the last fills the block."""
    last = min(out.shape[2], x.shape[2] - first)
    for k in range(len(out)):
        for p in range(out.shape[1]):
            a, b = x[k, p, first:], out[k, p]
            for e in range(last):
                b[e] = a[e]
            for e in range(last, len(b)):
                b[e] = a[last - 1]


@apart("histories", CompiledTables, int, F3, float, F3, F3)
def evaluate_increment(t, first, E, dt, out, after):
    """Stress and moduli (c + c^2, points, W), or energy (1, ...), of strains (c, points, W) less
    eigenstrains, and the history after an increment; at its start if dt is AT_START."""
    m, n, scale = t.memory, len(E), t.law.scale
    shift, h = np.empty(E.shape), np.empty(after.shape)
    of_block(m.before if dt < 0.0 else m.now, first, shift)
    if len(m.elastic) > 0:
        elastic(m, first, E, shift, out)
        return
    of_block(m.history, first, h)
    for c in range(n):
        x, y, z = E[c].ravel(), shift[c].ravel(), scale[c]
        for k in range(len(x)):
            x[k] = z * (x[k] - y[k])
    evaluate_history(t.law, E, h, max(dt, 0.0), out, after)
    for c in range(len(out)):
        z = scale[c] if c < n else scale[(c - n) // n] * scale[(c - n) % n]
        if z != 1.0:
            x = out[c].ravel()
            for k in range(len(x)):
                x[k] *= z


@source
def elastic(m, first, E, shift, out):
    """Stress and moduli of what is elastic."""
    n = len(E)
    of_block(m.stress, first, out[:n])
    for c in range(n):
        for d in range(n):
            out[n + n * c + d] = m.elastic[c, d]
            x, y, z = E[d].ravel(), shift[d].ravel(), out[c].ravel()
            for k in range(len(x)):
                z[k] += m.elastic[c, d] * (x[k] - y[k])
