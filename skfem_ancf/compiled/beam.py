"""Beams with sections: one term of the strain energy, a law with constant moduli.

G and e are rows of d/dX, then of d/dY, of the local functions and of the frame. A strain sample
is c (r_g . G_h u + G_g u . e_h) of two rows; g = h and c = 1/2 for a normal strain. With moduli
between samples, which have the interpolation and the weights in them, the tangent is a sum over
pairs of rows

    K[(a, i), (b, j)] = sum_{g, h} M[g, h, i, j] G[g, a] G[h, b]

and where elements share G its products are constants: a matrix product for a whole block of
elements. The parts symmetric and skew in (a, b) need each pair of rows once.

pack = G, e, rows, factors, w, D, along (3 matrices), constant, left, nd, terms, moduli, pairs,
symmetric, skew; tables are (1, ...) where elements share them
"""

import numpy as np

from .band import add_block
from .jit import inner, jit

#: Elements evaluated together: several vectors wide, with the work arrays still in cache.
BLOCK = 32


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
def _block_open(pack, first, arrays):
    """Work arrays for the block at ``first``, the last one smaller, with frames and weights."""
    e_, w_, left = pack[1], pack[4], pack[10]
    size = min(BLOCK, left.size - first)
    if size < arrays[0].shape[2]:
        arrays = _block_arrays(pack, size)
    if first == 0 or size < BLOCK or e_.shape[0] > 1 or w_.shape[0] > 1:
        _block_tables(e_, w_, first, arrays[9], arrays[10])
    return arrays


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
    _block_pairs(rows, factors, r, d, e0, samples)


@inner
def _block_pairs(rows, factors, r, d, x, samples):
    """c (r_g . d_h + d_g . x_h): the strain if x is the frame, its derivative if x is r."""
    for s in range(factors.size):
        g, h, c = rows[0, s], rows[1, s], factors[s]
        for e in range(d.shape[2]):
            samples[s, e] = c * (r[g, 0, e] * d[h, 0, e] + r[g, 1, e] * d[h, 1, e]
                                 + d[g, 0, e] * x[h, 0, e] + d[g, 1, e] * x[h, 1, e])


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
def _block_translate(K, skew, e, nd):
    """Take what the right node's position does from the left one's, which is the opposite.

    Round-off, of the size of the axial stiffness, would else resist translations: in a long
    chain of short elements as much as bending does.
    """
    q = nd // 2
    for a in range(nd):  # of the packed lower halves, (a, 0) is entry a, or a - 1 if skew
        low, high = min(a, q), max(a, q)
        n = low * nd - low * (low - 1) // 2 + high - low
        m = low * (nd - 1) - low * (low - 1) // 2 + high - low - 1
        for c in range(3):
            K[c, e, n] = K[c, e, 0] if a == q else -K[c, e, a]
        if a == 0:
            skew[e, m] = 0.0
        elif a != q:
            skew[e, m] = skew[e, a - 1] if a < q else -skew[e, a - 1]


@inner
def _block_element(K, skew, C, e, nd, out):
    """The lower half of one element's tangent, and C: coordinates (a, i) are 2 a + i.

    Their sum is made before it goes into the band: so it is rounded as its opposite is.
    """
    n, m = 0, 0
    for b in range(nd):
        x, y = 2 * b, 2 * b + 1
        out[x, x] = K[0, e, n] + C[x, x]
        out[y, x] = K[2, e, n] + C[y, x]
        out[y, y] = K[1, e, n] + C[y, y]
        n += 1
        for i in range(2, 2 * (nd - b), 2):
            out[x + i, x] = K[0, e, n] + C[x + i, x]
            out[y + i, x] = K[2, e, n] - skew[e, m] + C[y + i, x]
            out[x + i, y] = K[2, e, n] + skew[e, m] + C[x + i, y]
            out[y + i, y] = K[1, e, n] + C[y + i, y]
            n += 1
            m += 1


@inner
def beam_loop(pack, u, f, tangent, geometric, carried, use_carried, stresses, flat, ld, start):
    """Force into f, and if asked for tangent into the band and stresses (3, ne, np)."""
    G_, _, rows, factors, _, D, Lxx, Lyy, Lxy, constant, left, nd = pack[:12]
    terms, moduli, pairs, symmetric, skew = pack[12:]
    alone = G_.shape[0] > 1
    H = np.empty((G_.shape[1], 3 * nd if tangent and alone else 0))
    Ke, C = np.empty((2 * nd, 2 * nd)), np.zeros((2 * nd, 2 * nd))
    out = np.empty((nd, H.shape[1]))
    arrays = _block_arrays(pack, min(BLOCK, left.size))
    tangents = _block_tangents(symmetric, skew, min(BLOCK, left.size) if tangent else 0)
    for first in range(0, left.size, BLOCK):
        arrays = _block_open(pack, first, arrays)
        U, d, r, T, samples, strain, S, F, held, e0, w = arrays
        size = U.shape[2]
        if tangent and size < tangents[1].shape[1]:
            tangents = _block_tangents(symmetric, skew, size)
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
            _block_translate(K, K_skew, e, nd)
            if constant.shape[0] > 0:
                C = constant[first + e if constant.shape[0] > 1 else 0]
            _block_element(K, K_skew, C, e, nd, Ke)
            add_block(Ke, flat, ld, row)


@jit
def beam_carry(pack, u, du, before, out):
    """The stresses, linearised, at u + du, from those before; (3, ne, np)."""
    G_, _, rows, factors, _, D, Lxx, Lyy, Lxy, _, left, nd = pack[:12]
    arrays = _block_arrays(pack, min(BLOCK, left.size))
    for first in range(0, left.size, BLOCK):
        arrays = _block_open(pack, first, arrays)
        U, d, r, _, samples, strain, S, _, _, e0, _ = arrays
        _block_load(left, nd, first, u, U)
        _block_strain(G_, first, e0, rows, factors, U, d, r, samples)
        _block_load(left, nd, first, du, U)
        _block_gradients(G_, first, U, d)
        _block_pairs(rows, factors, r, d, r, samples)
        _block_points(Lxx, Lyy, Lxy, samples, strain)
        _block_stress(D, strain, S)
        for c in range(3):
            for e in range(S.shape[2]):
                for p in range(S.shape[1]):
                    out[c, first + e, p] = before[c, first + e, p] + S[c, p, e]


@inner
def beam_stress(pack, u, out):
    """The stresses at u, (3, ne, np)."""
    G_, _, rows, factors, _, D, Lxx, Lyy, Lxy, _, left, nd = pack[:12]
    arrays = _block_arrays(pack, min(BLOCK, left.size))
    for first in range(0, left.size, BLOCK):
        arrays = _block_open(pack, first, arrays)
        U, d, r, _, samples, strain, S, _, _, e0, _ = arrays
        _block_load(left, nd, first, u, U)
        _block_strain(G_, first, e0, rows, factors, U, d, r, samples)
        _block_points(Lxx, Lyy, Lxy, samples, strain)
        _block_stress(D, strain, S)
        _block_store(S, first, out)


@jit
def beam_mean(pack, u0, u1, f):
    """B(middle)^T mean stress, added to f."""
    G_, _, rows, factors, _, D, Lxx, Lyy, Lxy, constant, left, nd = pack[:12]
    arrays, middle = _block_arrays(pack, min(BLOCK, left.size)), 0.5 * (u0 + u1)
    for first in range(0, left.size, BLOCK):
        arrays = _block_open(pack, first, arrays)
        U, d, r, T, samples, strain, S, F, held, e0, w = arrays
        size = U.shape[2]
        old = np.empty((2, nd, 2, size))
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
