"""The kernels compiled by Numba, for scenes too small for batched NumPy.

Found at run time: without the package numba nothing changes but the speed. The functions repeat
what :mod:`skfem_ancf.kernel` and :mod:`skfem_ancf.cable` say, a block of elements at a time and
into the band matrix, and are tested against them.
"""

import math

import numpy as np
from numba import njit

# no "nnan" and "ninf": a strain that is not finite must be seen
LOST = 1e-13  # a pivot that small beside what it came from is round-off
_FAST = {"contract", "reassoc", "nsz", "arcp"}

#: Elements evaluated together: several vectors wide, with the work arrays still in cache.
BLOCK = 32


def jit(function):
    """Compile a function that Python calls, and keep it on disk."""
    return njit(cache=True, fastmath=_FAST, error_model="numpy")(function)


def inner(function):
    """Compile a function that compiled ones call: no entrance for Python, which takes as long."""
    return njit(fastmath=_FAST, error_model="numpy", no_cpython_wrapper=True,
                no_cfunc_wrapper=True)(function)


# the band: lower half of a symmetric matrix, entry (i, j) at j * ld + i - j


@inner
def add_block(K, flat, ld, row):
    for b in range(K.shape[0]):
        at = (row + b) * ld - b
        for a in range(b, K.shape[0]):
            flat[at + a] += K[a, b]


@inner
def multiply(flat, ld, bw, x, y):
    n = x.size
    for i in range(n):
        y[i] = 0.0
    for j in range(n):
        at = j * ld
        y[j] += flat[at] * x[j]
        for k in range(1, min(bw, n - 1 - j) + 1):
            y[j + k] += flat[at + k] * x[j]
            y[j] += flat[at + k] * x[j + k]


@jit
def factorize(flat, ld, bw, n):
    """Factorise in place into L D L^T; returns False if a pivot is lost.

    There is no pivoting: a matrix that is not positive definite has factors too, unless one of
    its leading parts is singular.
    """
    for j in range(n):
        at = j * ld
        d = flat[at]
        if not abs(d) > 0.0:
            return False
        m = min(bw, n - 1 - j)
        inverse = 1.0 / d
        for k in range(1, m + 1):
            c = flat[at + k]
            if c != 0.0:
                c *= inverse
                other = (j + k) * ld - k
                before = flat[other + k]
                for i in range(k, m + 1):
                    flat[other + i] -= c * flat[at + i]
                if abs(flat[other + k]) < LOST * abs(before):
                    return False
        for k in range(1, m + 1):
            flat[at + k] *= inverse
    return True


@inner
def solve(flat, ld, bw, x):
    """Solve in place with the factors."""
    n = x.size
    for j in range(n):
        at, xj = j * ld, x[j]
        for k in range(1, min(bw, n - 1 - j) + 1):
            x[j + k] -= flat[at + k] * xj
    for j in range(n - 1, -1, -1):
        at = j * ld
        s = x[j] / flat[at]
        for k in range(1, min(bw, n - 1 - j) + 1):
            s -= flat[at + k] * x[j + k]
        x[j] = s


@inner
def fix(flat, ld, bw, fixed):
    """Rows and columns of the fixed coordinates become those of the identity."""
    n = fixed.size
    for j in range(n):
        for k in range(1, min(bw, n - 1 - j) + 1):
            if fixed[j] or fixed[j + k]:
                flat[j * ld + k] = 0.0
        if fixed[j]:
            flat[j * ld] = 1.0


@inner
def _constant(constant, e, u, first, m, f, K, tangent):
    """The stabilisation: f += C u, K += C."""
    if constant.shape[0] == 0:
        return
    c = constant[e if constant.shape[0] > 1 else 0]
    for a in range(m):
        s = 0.0
        for b in range(m):
            s += c[a, b] * u[first + b]
            if tangent:
                K[a, b] += c[a, b]
        f[first + a] += s


# the beam: one term, a law with constant moduli
#
# G and e are rows of d/dX, then of d/dY, of the local functions and of the frame. A strain sample
# is c (r_g . G_h u + G_g u . e_h) of two rows; g = h and c = 1/2 for a normal strain. With moduli
# between samples, which have the interpolation and the weights in them, the tangent is a sum over
# pairs of rows
#
#     K[(a, i), (b, j)] = sum_{g, h} M[g, h, i, j] G[g, a] G[h, b]
#
# and where elements share G its products are constants: a matrix product for a whole block of
# elements. The parts symmetric and skew in (a, b) need each pair of rows once.
#
# pack = G, e, rows, factors, w, D, along (3 matrices), constant, left, nd, terms, moduli, pairs,
# symmetric, skew; tables are (1, ...) where elements share them


def beam_tables(Gx, Gy, e1, e2, w, D, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, constant, left, nd):
    """The pack of a beam, from the tables of its NumPy kernel.

    Of each sample, ``rows`` (3, samples) are g, h and the number of that pair, ``factors`` its c.
    ``pairs`` (3, pairs) are g <= h and the number of the skew part, -1 if g = h. ``terms`` (4, n)
    are the pair, its skew part, and the rows k and l of ``M[pair] += modulus r_k r_l``; the moduli
    are (1 or elements, n). ``symmetric`` and ``skew`` have the products of G, a row each pair;
    where elements have tables of their own they have no contents but the shapes.
    """
    n, nt = Gx.shape[1], len(Gx)
    G = np.concatenate([Gx, Gy], axis=1)
    e = np.concatenate([np.broadcast_to(frame, (max(len(e1), len(e2)), rows.shape[1], 2))
                        for frame, rows in ((e1, Gx), (e2, Gy))], axis=1)
    rows = np.array([np.concatenate([x_xx, n + y_yy, x_xy]),
                     np.concatenate([x_xx, n + y_yy, n + y_xy])])
    factors = np.where(rows[0] == rows[1], 0.5, 1.0)
    s, t, A = _sample_moduli(w, D, (Lxx, Lyy, Lxy))
    A = A * (factors[s] * factors[t])
    # derivative of a sample: G_h with r_g and G_g with r_h
    terms = np.stack(np.broadcast_arrays(rows[:, None, s], rows[None, :, t], rows[::-1, None, s],
                                         rows[None, ::-1, t])).reshape(4, -1)
    A = np.tile(A, 4)
    keep = terms[0] <= terms[1]  # the others are the same transposed
    terms, A = terms[:, keep], A[:, keep]
    same = terms[0] == terms[1]
    terms[2:, same] = np.sort(terms[2:, same], axis=0)
    terms, of = np.unique(terms, axis=1, return_inverse=True)
    total = np.zeros((terms.shape[1], len(A)))
    np.add.at(total, of.ravel(), A.T)
    pairs, of = np.unique(np.concatenate([terms[:2], rows], axis=1), axis=1, return_inverse=True)
    of, count = of.ravel(), terms.shape[1]
    off = pairs[0] != pairs[1]
    pairs = np.stack([*pairs, np.where(off, np.cumsum(off) - 1, -1)])
    terms = np.stack([of[:count], pairs[2, of[:count]], terms[2], terms[3]])
    symmetric = np.empty((pairs.shape[1], nd * (nd + 1) // 2))
    skew = np.empty((np.sum(off), nd * (nd - 1) // 2))
    if nt == 1:
        _pair_products(G[0], pairs, symmetric, skew)
    return (G, e, np.stack([*rows, of[count:]]), factors, w, np.ascontiguousarray(D), Lxx, Lyy, Lxy,
            np.ascontiguousarray(constant), left, nd, terms, w @ total.T, pairs, symmetric, skew)


def _sample_moduli(w, D, along):
    """Samples s and t of all strain components, and A with moduli w A: L_ps D L_pt."""
    ns = w.shape[1] // len(along[0])
    L = [np.kron(matrix, np.eye(ns)) for matrix in along]
    start = np.cumsum([0] + [matrix.shape[1] for matrix in L])
    found = []
    for c, d in np.argwhere(D):
        s, t = np.nonzero((L[c] != 0.0).T.astype(float) @ (L[d] != 0.0))
        A = D[c, d] * L[c][:, s] * L[d][:, t]
        keep = np.any(np.abs(w @ A) > 1e-14 * (w @ np.abs(A)), axis=0)  # else orthogonal
        found.append((start[c] + s[keep], start[d] + t[keep], A[:, keep]))
    return [np.concatenate(part, axis=-1) for part in zip(*found)]


@jit
def _pair_products(G, pairs, symmetric, skew):
    """Products of G of each pair, by the lower half of (a, b); without the diagonal if skew."""
    nb = G.shape[1]
    for p in range(pairs.shape[1]):
        g, h, q = pairs[0, p], pairs[1, p], pairs[2, p]
        n, m = 0, 0
        for b in range(nb):
            if q < 0:
                for a in range(b, nb):
                    symmetric[p, n + a - b] = G[g, a] * G[g, b]
            else:
                x, y = G[g, b], G[h, b]
                for a in range(b, nb):
                    symmetric[p, n + a - b] = G[g, a] * y + G[h, a] * x
                for a in range(b + 1, nb):
                    skew[q, m + a - b - 1] = G[g, a] * y - G[h, a] * x
                m += nb - b - 1
            n += nb - b


@inner
def _pair_rows(G, pairs, M, M_skew, e, H, out, K, K_skew):
    """What the products of G do, for one element with tables of its own: G^T (M G)."""
    nb = G.shape[1]
    H[:] = 0.0
    for p in range(pairs.shape[1]):
        g, h, q = pairs[0, p], pairs[1, p], pairs[2, p]
        x, y, xy = M[0, p, e], M[1, p, e], M[2, p, e]
        d = M_skew[q, e] if q >= 0 else 0.0
        for a in range(nb):
            H[g, a] += x * G[h, a]
            H[g, nb + a] += y * G[h, a]
            H[g, 2 * nb + a] += (xy + d) * G[h, a]
        if q >= 0:
            for a in range(nb):
                H[h, a] += x * G[g, a]
                H[h, nb + a] += y * G[g, a]
                H[h, 2 * nb + a] += (xy - d) * G[g, a]
    np.dot(G.T, H, out)
    n, m = 0, 0
    for b in range(nb):
        for a in range(b, nb):
            K[0, e, n], K[1, e, n] = out[a, b], out[a, nb + b]
            K[2, e, n] = 0.5 * (out[a, 2 * nb + b] + out[b, 2 * nb + a])
            n += 1
            if a > b:
                K_skew[e, m] = 0.5 * (out[a, 2 * nb + b] - out[b, 2 * nb + a])
                m += 1


@inner
def _block_arrays(pack, size):
    """Work arrays for a block of elements; the elements are the last axis, for vector units."""
    G, factors, w, nd = pack[0], pack[3], pack[4], pack[11]
    rows = G.shape[1]
    return (np.empty((nd, 2, size)), np.empty((rows, 2, size)), np.empty((rows, 2, size)),
            np.empty((rows, 2, size)), np.empty((factors.size, size)),
            np.empty((3, w.shape[1], size)), np.empty((3, w.shape[1], size)),
            np.empty((2, size, nd)), np.empty((2 * nd, size)),
            np.empty((rows, 2, size)), np.empty((w.shape[1], size)))


@inner
def _block_tangents(symmetric, skew, size):
    """Work arrays for the tangents of a block: factors of the pairs, and what comes of them."""
    return (np.empty((3, symmetric.shape[0], size)), np.empty((skew.shape[0], size)),
            np.empty((3, size, symmetric.shape[1])), np.empty((size, skew.shape[1])))


@inner
def _block_tables(e_, w_, first, e0, w):
    """The frame and the weights of each element of the block."""
    for e in range(w.shape[1]):
        t = first + e if e_.shape[0] > 1 else 0
        for g in range(e0.shape[0]):
            e0[g, 0, e], e0[g, 1, e] = e_[t, g, 0], e_[t, g, 1]
        t = first + e if w_.shape[0] > 1 else 0
        for p in range(w.shape[0]):
            w[p, e] = w_[t, p]


@inner
def _block_load(left, nd, first, u, U):
    for e in range(U.shape[2]):
        at = left[first + e] * nd
        for k in range(nd):
            U[k, 0, e], U[k, 1, e] = u[at + 2 * k], u[at + 2 * k + 1]
@inner
def _block_gradients(G, first, U, d):
    """d = G U."""
    size = d.shape[2]
    if G.shape[0] == 1:
        np.dot(G[0], U.reshape(U.shape[0], 2 * size), d.reshape(d.shape[0], 2 * size))
        return
    u, du = np.empty((U.shape[0], 2)), np.empty((d.shape[0], 2))
    for e in range(size):
        for k in range(U.shape[0]):
            u[k, 0], u[k, 1] = U[k, 0, e], U[k, 1, e]
        np.dot(G[first + e], u, du)
        for g in range(d.shape[0]):
            d[g, 0, e], d[g, 1, e] = du[g, 0], du[g, 1]


@inner
def _block_strain(G, first, e0, rows, factors, U, d, r, samples):
    """Displacement gradients d, position gradients r, and the strain samples."""
    size = d.shape[2]
    _block_gradients(G, first, U, d)
    for g in range(d.shape[0]):
        for i in range(2):
            for e in range(size):
                r[g, i, e] = e0[g, i, e] + d[g, i, e]
    for s in range(factors.size):
        g, h, c = rows[0, s], rows[1, s], factors[s]
        for e in range(size):
            samples[s, e] = c * (r[g, 0, e] * d[h, 0, e] + r[g, 1, e] * d[h, 1, e]
                                 + d[g, 0, e] * e0[h, 0, e] + d[g, 1, e] * e0[h, 1, e])


@inner
def _block_along(L, first, samples, points):
    """points = L samples, from the sample ``first``; returns the sample after."""
    ns = points.shape[0] // L.shape[0]
    for p in range(points.shape[0]):
        for e in range(points.shape[1]):
            points[p, e] = 0.0
    for i in range(L.shape[0]):
        for k in range(L.shape[1]):
            c = L[i, k]
            if c != 0.0:
                for j in range(ns):
                    p, s = i * ns + j, first + k * ns + j
                    for e in range(points.shape[1]):
                        points[p, e] += c * samples[s, e]
    return first + L.shape[1] * ns


@inner
def _block_back(L, first, w, points, samples):
    """samples = L^T w points, from the sample ``first``; returns the sample after."""
    ns = points.shape[0] // L.shape[0]
    for k in range(L.shape[1]):
        for j in range(ns):
            s = first + k * ns + j
            for e in range(points.shape[1]):
                samples[s, e] = 0.0
            for i in range(L.shape[0]):
                if L[i, k] != 0.0:
                    p = i * ns + j
                    c = L[i, k]
                    for e in range(points.shape[1]):
                        samples[s, e] += c * w[p, e] * points[p, e]
    return first + L.shape[1] * ns


@inner
def _block_points(Lxx, Lyy, Lxy, samples, points):
    """Samples of the strain, interpolated to the integration points, (3, points, elements)."""
    first = _block_along(Lxx, 0, samples, points[0])
    first = _block_along(Lyy, first, samples, points[1])
    _block_along(Lxy, first, samples, points[2])


@inner
def _block_samples(Lxx, Lyy, Lxy, w, points, samples):
    """The transpose of _block_points, with the weights of the points."""
    first = _block_back(Lxx, 0, w, points[0], samples)
    first = _block_back(Lyy, first, w, points[1], samples)
    _block_back(Lxy, first, w, points[2], samples)


@inner
def _block_stress(D, strain, S):
    for p in range(strain.shape[1]):
        for c in range(3):
            d0, d1, d2 = D[c, 0], D[c, 1], D[c, 2]
            for e in range(strain.shape[2]):
                S[c, p, e] = d0 * strain[0, p, e] + d1 * strain[1, p, e] + d2 * strain[2, p, e]
@inner
def _block_store(points, first, out):
    for c in range(3):
        for e in range(points.shape[2]):
            for p in range(points.shape[1]):
                out[c, first + e, p] = points[c, p, e]
@inner
def _block_force(G, rows, factors, constant, left, nd, first, u, U, r, samples, T, F, held, f):
    """Add G^T T to f, where T is what the stress samples do on the gradients; and C u."""
    size = r.shape[2]
    T[:] = 0.0
    for s in range(factors.size):
        g, h, c = rows[0, s], rows[1, s], factors[s]
        for i in range(2):
            for e in range(size):
                T[g, i, e] += c * samples[s, e] * r[h, i, e]
            for e in range(size):
                T[h, i, e] += c * samples[s, e] * r[g, i, e]
    if G.shape[0] == 1:
        np.dot(T.reshape(T.shape[0], 2 * size).T, G[0], F.reshape(2 * size, nd))
    else:
        F[:] = 0.0
        for e in range(size):
            for g in range(G.shape[1]):
                x, y = T[g, 0, e], T[g, 1, e]
                for k in range(nd):
                    F[0, e, k] += G[first + e, g, k] * x
                    F[1, e, k] += G[first + e, g, k] * y
    held[:] = 0.0
    if constant.shape[0] == 1:
        np.dot(constant[0], U.reshape(2 * nd, size), held)
    elif constant.shape[0] > 1:
        for e in range(size):
            for i in range(2 * nd):
                x = 0.0
                for j in range(2 * nd):
                    x += constant[first + e, i, j] * u[left[first + e] * nd + j]
                held[i, e] = x
    for e in range(size):
        at = left[first + e] * nd
        for k in range(nd):
            f[at + 2 * k] += F[0, e, k] + held[2 * k, e]
            f[at + 2 * k + 1] += F[1, e, k] + held[2 * k + 1, e]


@inner
def _block_geometric(rows, samples, M):
    """Add the stress to the factors of the pairs, the same for both components."""
    for s in range(samples.shape[0]):
        p = rows[2, s]
        for e in range(samples.shape[1]):
            M[0, p, e] += samples[s, e]
            M[1, p, e] += samples[s, e]


@inner
def _block_moduli(terms, moduli, first, r, M, skew, c):
    """Add the material part to the factors of the pairs: xx, yy, xy symmetric, and xy skew."""
    skew[:] = 0.0
    for t in range(moduli.shape[1]):
        p, q, g, h = terms[0, t], terms[1, t], terms[2, t], terms[3, t]
        for e in range(c.size):
            c[e] = moduli[first + e if moduli.shape[0] > 1 else 0, t]
        if q >= 0:
            for e in range(r.shape[2]):
                gx, gy, hx, hy = r[g, 0, e], r[g, 1, e], r[h, 0, e], r[h, 1, e]
                x, y = c[e] * gx * hy, c[e] * gy * hx
                M[0, p, e] += c[e] * gx * hx
                M[1, p, e] += c[e] * gy * hy
                M[2, p, e] += 0.5 * (x + y)
                skew[q, e] += 0.5 * (x - y)
        else:
            for e in range(r.shape[2]):
                gx, gy, hx, hy = r[g, 0, e], r[g, 1, e], r[h, 0, e], r[h, 1, e]
                M[0, p, e] += c[e] * gx * hx
                M[1, p, e] += c[e] * gy * hy
                M[2, p, e] += 0.5 * c[e] * (gx * hy + gy * hx)


@inner
def _block_add(K, skew, e, nd, flat, ld, row):
    """Add one element of the block to the band: coordinates (a, i) are 2 a + i."""
    n, m = 0, 0
    for b in range(nd):
        left, right = (row + 2 * b) * ld, (row + 2 * b + 1) * ld
        flat[left] += K[0, e, n]
        flat[left + 1] += K[2, e, n]
        flat[right] += K[1, e, n]
        n += 1
        for k in range(1, nd - b):
            flat[left + 2 * k] += K[0, e, n]
            flat[left + 2 * k + 1] += K[2, e, n] - skew[e, m]
            flat[right + 2 * k - 1] += K[2, e, n] + skew[e, m]
            flat[right + 2 * k] += K[1, e, n]
            n += 1
            m += 1
@inner
def beam_loop(pack, u, f, tangent, geometric, carried, use_carried, stresses, flat, ld, start):
    """Force into f, and if asked for tangent into the band and stresses (3, ne, np)."""
    (G_, e_, rows, factors, w_, D, Lxx, Lyy, Lxy, constant, left, nd, terms, moduli, pairs,
     symmetric, skew) = pack
    size = min(BLOCK, left.size)
    alone = G_.shape[0] > 1
    H = np.empty((G_.shape[1], 3 * nd if tangent and alone else 0))
    out = np.empty((nd, H.shape[1]))
    arrays = _block_arrays(pack, size)
    tangents = _block_tangents(symmetric, skew, size if tangent else 0)
    for first in range(0, left.size, BLOCK):
        if left.size - first < size:
            size = left.size - first
            arrays = _block_arrays(pack, size)
            tangents = _block_tangents(symmetric, skew, size if tangent else 0)
        U, d, r, T, samples, strain, S, F, held, e0, w = arrays
        if first == 0 or left.size - first < BLOCK or e_.shape[0] > 1 or w_.shape[0] > 1:
            _block_tables(e_, w_, first, e0, w)
        _block_load(left, nd, first, u, U)
        _block_strain(G_, first, e0, rows, factors, U, d, r, samples)
        _block_points(Lxx, Lyy, Lxy, samples, strain)
        _block_stress(D, strain, S)
        _block_samples(Lxx, Lyy, Lxy, w, S, samples)
        _block_force(G_, rows, factors, constant, left, nd, first, u, U, r, samples, T, F,
                     held, f)
        if not tangent:
            continue
        M, M_skew, K, K_skew = tangents
        _block_store(S, first, stresses)
        if use_carried:
            for c in range(3):
                for p in range(S.shape[1]):
                    for e in range(size):
                        S[c, p, e] = carried[c, first + e, p]
            _block_samples(Lxx, Lyy, Lxy, w, S, samples)
        M[:] = 0.0
        if geometric:
            _block_geometric(rows, samples, M)
        _block_moduli(terms, moduli, first, r, M, M_skew, np.empty(size))
        if alone:
            for e in range(size):
                _pair_rows(G_[first + e], pairs, M, M_skew, e, H, out, K, K_skew)
        else:
            for c in range(3):
                np.dot(M[c].T, symmetric, K[c])
            np.dot(M_skew.T, skew, K_skew)
        for e in range(size):
            row = start + left[first + e] * nd
            _block_add(K, K_skew, e, nd, flat, ld, row)
            if constant.shape[0] > 0:
                add_block(constant[first + e if constant.shape[0] > 1 else 0], flat, ld, row)


@jit
def beam_increment(pack, u, du, out):
    """The strain's derivative at u in the direction du, (3, ne, np)."""
    (G_, e_, rows, factors, w_, D, Lxx, Lyy, Lxy, constant, left, nd) = pack[:12]
    size = min(BLOCK, left.size)
    arrays = _block_arrays(pack, size)
    for first in range(0, left.size, BLOCK):
        if left.size - first < size:
            size = left.size - first
            arrays = _block_arrays(pack, size)
        U, d, r, T, samples, strain, S, F, held, e0, w = arrays
        if first == 0 or left.size - first < BLOCK or e_.shape[0] > 1 or w_.shape[0] > 1:
            _block_tables(e_, w_, first, e0, w)
        _block_load(left, nd, first, u, U)
        _block_strain(G_, first, e0, rows, factors, U, d, r, samples)
        _block_load(left, nd, first, du, U)
        _block_gradients(G_, first, U, d)
        for s in range(factors.size):
            g, h, c = rows[0, s], rows[1, s], factors[s]
            for e in range(size):
                samples[s, e] = c * (r[g, 0, e] * d[h, 0, e] + r[g, 1, e] * d[h, 1, e]
                                     + d[g, 0, e] * r[h, 0, e] + d[g, 1, e] * r[h, 1, e])
        _block_points(Lxx, Lyy, Lxy, samples, strain)
        _block_store(strain, first, out)


@jit
def beam_mean(pack, u0, u1, f):
    """B(middle)^T mean stress, added to f."""
    (G_, e_, rows, factors, w_, D, Lxx, Lyy, Lxy, constant, left, nd) = pack[:12]
    size, middle = min(BLOCK, left.size), 0.5 * (u0 + u1)
    arrays, old = _block_arrays(pack, size), np.empty((2, nd, 2, size))
    for first in range(0, left.size, BLOCK):
        if left.size - first < size:
            size = left.size - first
            arrays, old = _block_arrays(pack, size), np.empty((2, nd, 2, size))
        U, d, r, T, samples, strain, S, F, held, e0, w = arrays
        if first == 0 or left.size - first < BLOCK or e_.shape[0] > 1 or w_.shape[0] > 1:
            _block_tables(e_, w_, first, e0, w)
        _block_load(left, nd, first, u0, old[0])
        _block_load(left, nd, first, u1, U)
        for k in range(nd):
            for i in range(2):
                for e in range(size):
                    old[1, k, i, e] = 0.5 * (U[k, i, e] - old[0, k, i, e])
                    U[k, i, e] = 0.5 * (U[k, i, e] + old[0, k, i, e])
        # the mean of both strains is the strain of the mean, and half the square of the rest
        _block_strain(G_, first, e0, rows, factors, U, d, r, samples)
        _block_gradients(G_, first, old[1], d)
        for s in range(factors.size):
            g, h, c = rows[0, s], rows[1, s], factors[s]
            for e in range(size):
                samples[s, e] += c * (d[g, 0, e] * d[h, 0, e] + d[g, 1, e] * d[h, 1, e])
        _block_points(Lxx, Lyy, Lxy, samples, strain)
        _block_stress(D, strain, S)
        _block_samples(Lxx, Lyy, Lxy, w, S, samples)
        _block_force(G_, rows, factors, constant, left, nd, first, middle, U, r, samples, T, F,
                     held, f)


@jit
def beam_force(pack, u, f):
    """The internal force, added to f."""
    none = np.empty((1, 1, 1))
    beam_loop(pack, u, f, False, False, none, False, none, none[0, 0], 1, 0)


@jit
def beam_tangent(pack, u, f, geometric, carried, use_carried, stresses, flat, ld, start):
    """The internal force, added to f, the tangent, added to the band, and the stresses."""
    beam_loop(pack, u, f, True, geometric, carried, use_carried, stresses, flat, ld, start)


# the cable
# pack = G1, G2, a0, b0, s0, kappa0, w, stiffness, constant, left, nd


@inner
def _cable_point(G1, G2, p, u, first, nb):
    a0, a1, b0, b1 = 0.0, 0.0, 0.0, 0.0
    for k in range(nb):
        x, y = u[first + 2 * k], u[first + 2 * k + 1]
        a0 += G1[p, k] * x
        a1 += G1[p, k] * y
        b0 += G2[p, k] * x
        b1 += G2[p, k] * y
    return a0, a1, b0, b1


@inner
def cable_loop(pack, u, f, tangent, geometric, carried, use_carried, stresses, flat, ld, start):
    """Force into f, and if asked for tangent into the band and stresses (2, ne, np)."""
    G1_, G2_, A0_, B0_, s0_, kappa0_, w_, stiffness, constant, left, nd = pack
    nb, m, n = nd, 2 * nd, w_.shape[1]
    K, T = np.empty((m, m)), np.empty((4, 4))
    e_a, k_a, k_b, c_a = np.empty(2), np.empty(2), np.empty(2), np.empty(2)
    EA, EI = stiffness
    for e in range(left.size):
        t = e if G1_.shape[0] > 1 else 0
        r = e if A0_.shape[0] > 1 else 0
        G1, G2, w = G1_[t], G2_[t], w_[t]
        first = left[e] * nd
        if tangent:
            K[:] = 0.0
        for p in range(n):
            d0, d1, d2, d3 = _cable_point(G1, G2, p, u, first, nb)
            a0, a1 = A0_[r, p, 0] + d0, A0_[r, p, 1] + d1
            b0, b1 = B0_[r, p, 0] + d2, B0_[r, p, 1] + d3
            s = a0 * a0 + a1 * a1
            root = math.sqrt(s)
            eps = (((a0 + A0_[r, p, 0]) * d0 + (a1 + A0_[r, p, 1]) * d1)
                   / (root + math.sqrt(s0_[r, p])))
            kappa = (a0 * b1 - a1 * b0) / s
            change = kappa - kappa0_[r, p]
            N, M = EA * eps, EI * change
            e_a[0], e_a[1] = a0 / root, a1 / root
            k_a[0], k_a[1] = (b1 - 2 * kappa * a0) / s, (-b0 - 2 * kappa * a1) / s
            k_b[0], k_b[1] = -a1 / s, a0 / s
            n_, m_ = w[p] * N, w[p] * M
            for k in range(nb):
                for i in range(2):
                    f[first + 2 * k + i] += (G1[p, k] * (n_ * e_a[i] + m_ * k_a[i])
                                             + G2[p, k] * m_ * k_b[i])
            if not tangent:
                continue
            stresses[0, e, p], stresses[1, e, p] = N, M
            # the 4 x 4 second derivative by (a, b)
            T[:] = 0.0
            if geometric:
                if use_carried:
                    n_, m_ = w[p] * carried[0, e, p], w[p] * carried[1, e, p]
                c_a[0], c_a[1] = b1, -b0
                c = kappa * s
                for i in range(2):
                    for j in range(2):
                        ai, aj = (a0, a1)[i], (a0, a1)[j]
                        normal = (a1, -a0)[i] * (a1, -a0)[j] / s
                        delta = 1.0 if i == j else 0.0
                        T[i, j] = (n_ / root * normal + m_ * (
                            -2.0 / (s * s) * (c_a[i] * aj + ai * c_a[j] + c * delta)
                            + 8.0 * c / (s * s * s) * ai * aj))
                        J = 0.0 if i == j else (1.0 if i == 0 else -1.0)
                        T[i, 2 + j] = m_ * (J / s + 2.0 / (s * s) * ai * (a1, -a0)[j])
                        T[2 + j, i] = T[i, 2 + j]
            x, y = w[p] * EA, w[p] * EI
            for i in range(2):
                for j in range(2):
                    T[i, j] += x * e_a[i] * e_a[j] + y * k_a[i] * k_a[j]
                    T[i, 2 + j] += y * k_a[i] * k_b[j]
                    T[2 + i, j] += y * k_b[i] * k_a[j]
                    T[2 + i, 2 + j] += y * k_b[i] * k_b[j]
            for k in range(nb):
                g, h = G1[p, k], G2[p, k]
                for i in range(2):
                    t0, t1 = g * T[i, 0] + h * T[2 + i, 0], g * T[i, 1] + h * T[2 + i, 1]
                    t2, t3 = g * T[i, 2] + h * T[2 + i, 2], g * T[i, 3] + h * T[2 + i, 3]
                    for l in range(k + 1):
                        K[2 * k + i, 2 * l] += t0 * G1[p, l] + t2 * G2[p, l]
                        K[2 * k + i, 2 * l + 1] += t1 * G1[p, l] + t3 * G2[p, l]
        _constant(constant, e, u, first, m, f, K, tangent)
        if tangent:
            add_block(K, flat, ld, start + first)


@jit
def cable_increment(pack, u, du, out):
    """The strain's derivative at u in the direction du, (2, ne, np)."""
    G1_, G2_, A0_, B0_, s0_, kappa0_, w_, stiffness, constant, left, nd = pack
    for e in range(left.size):
        t = e if G1_.shape[0] > 1 else 0
        r = e if A0_.shape[0] > 1 else 0
        first = left[e] * nd
        for p in range(w_.shape[1]):
            d0, d1, d2, d3 = _cable_point(G1_[t], G2_[t], p, u, first, nd)
            x0, x1, x2, x3 = _cable_point(G1_[t], G2_[t], p, du, first, nd)
            a0, a1 = A0_[r, p, 0] + d0, A0_[r, p, 1] + d1
            b0, b1 = B0_[r, p, 0] + d2, B0_[r, p, 1] + d3
            s = a0 * a0 + a1 * a1
            ax = a0 * x0 + a1 * x1
            kappa = (a0 * b1 - a1 * b0) / s
            out[0, e, p] = ax / math.sqrt(s)
            out[1, e, p] = (x0 * b1 - x1 * b0 + a0 * x3 - a1 * x2 - 2 * kappa * ax) / s


@jit
def cable_mean(pack, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the energy, added to f."""
    G1_, G2_, A0_, B0_, s0_, kappa0_, w_, stiffness, constant, left, nd = pack
    EA, EI = stiffness
    K, middle = np.empty((1, 1)), 0.5 * (u0 + u1)
    for e in range(left.size):
        t = e if G1_.shape[0] > 1 else 0
        r = e if A0_.shape[0] > 1 else 0
        G1, G2, w = G1_[t], G2_[t], w_[t]
        first = left[e] * nd
        for p in range(w.size):
            A0, A1, start = A0_[r, p, 0], A0_[r, p, 1], math.sqrt(s0_[r, p])
            d0, d1, d2, d3 = _cable_point(G1, G2, p, u0, first, nd)
            a0, a1, b0, b1 = A0 + d0, A1 + d1, B0_[r, p, 0] + d2, B0_[r, p, 1] + d3
            x0, x1, x2, x3 = _cable_point(G1, G2, p, u1, first, nd)
            c0, c1, g0, g1 = A0 + x0, A1 + x1, B0_[r, p, 0] + x2, B0_[r, p, 1] + x3
            s, z = a0 * a0 + a1 * a1, c0 * c0 + c1 * c1
            rs, rz = math.sqrt(s), math.sqrt(z)
            k0, k1 = (a0 * b1 - a1 * b0) / s, (c0 * g1 - c1 * g0) / z
            N = 0.5 * w[p] * EA * (((a0 + A0) * d0 + (a1 + A1) * d1) / (rs + start)
                                   + ((c0 + A0) * x0 + (c1 + A1) * x1) / (rz + start))
            kappa = 0.5 * (k0 + k1)
            M = w[p] * EI * (kappa - kappa0_[r, p])
            m0, m1, q0, q1 = 0.5 * (a0 + c0), 0.5 * (a1 + c1), 0.5 * (b0 + g0), 0.5 * (b1 + g1)
            mean = 0.5 * (s + z)
            x = 2.0 * N / (rs + rz)
            p0 = x * m0 + M * (q1 - 2 * kappa * m0) / mean
            p1 = x * m1 + M * (-q0 - 2 * kappa * m1) / mean
            y0, y1 = -M * m1 / mean, M * m0 / mean
            for k in range(nd):
                f[first + 2 * k] += G1[p, k] * p0 + G2[p, k] * y0
                f[first + 2 * k + 1] += G1[p, k] * p1 + G2[p, k] * y1
        _constant(constant, e, middle, first, 2 * nd, f, K, False)


@jit
def cable_force(pack, u, f):
    """The internal force, added to f."""
    none = np.empty((1, 1, 1))
    cable_loop(pack, u, f, False, False, none, False, none, none[0, 0], 1, 0)


@jit
def cable_tangent(pack, u, f, geometric, carried, use_carried, stresses, flat, ld, start):
    """The internal force, added to f, the tangent, added to the band, and the stresses."""
    cable_loop(pack, u, f, True, geometric, carried, use_carried, stresses, flat, ld, start)


class CompiledKernel:
    """The compiled functions of one beam, with the tables of its NumPy kernel.

    Parameters
    ----------
    packs
        The tables of each term of the strain energy, in the order that the functions take.
    cable
        Whether it is a cable.
    elements
        Number of elements.
    """

    def __init__(self, packs, cable, elements):
        self.packs = packs = packs if cable else [beam_tables(*pack) for pack in packs]
        self.cable = cable
        self.shapes = [(2, elements, pack[6].shape[1]) if cable else
                       (3, elements, pack[4].shape[1]) for pack in packs]
        self._force, self._tangent, self._increment, self._mean = (
            (cable_force, cable_tangent, cable_increment, cable_mean) if cable else
            (beam_force, beam_tangent, beam_increment, beam_mean))

    def assemble(self, u, K, start, force, carried, geometric):
        """Add force and tangent; see :meth:`skfem_ancf.kernel.Chain.assemble`."""
        stresses = [np.empty(shape) for shape in self.shapes]
        for k, (pack, S) in enumerate(zip(self.packs, stresses)):
            self._tangent(pack, u, force, geometric, carried[k] if carried else S,
                          carried is not None, S, K._flat, K._ld, start)
        return CompiledEvaluation(self, u, stresses)

    def force(self, u):
        """Internal force, shape (N,)."""
        out = np.zeros(u.size)
        for pack in self.packs:
            self._force(pack, u, out)
        return out

    def mean_force(self, u0, u1):
        """The force whose work from u0 to u1 is the change of the energy."""
        out = np.zeros(u0.size)
        for pack in self.packs:
            self._mean(pack, u0, u1, out)
        return out


class CompiledEvaluation:
    """What :meth:`CompiledKernel.assemble` found."""

    def __init__(self, compiled, u, stresses):
        self._compiled, self._u, self._stresses = compiled, u.copy(), stresses

    def carry(self, du):
        """The stresses, linearised, at ``u + du``: one array a term."""
        c, carried = self._compiled, []
        for pack, S in zip(c.packs, self._stresses):
            out = np.empty_like(S)
            c._increment(pack, self._u, np.ascontiguousarray(du), out)
            if c.cable:
                out *= pack[7][:, None, None]
            else:
                out = np.tensordot(pack[5], out, 1)
            out += S
            carried.append(out)
        return carried
