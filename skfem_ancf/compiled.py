"""The kernels compiled by Numba, for scenes too small for batched NumPy.

Found at run time: without the package numba nothing changes but the speed. The functions repeat
what :mod:`skfem_ancf.kernel` and :mod:`skfem_ancf.cable` say, element by element and into the band
matrix, and are tested against them.
"""

import math

import numpy as np
from numba import njit

# no "nnan" and "ninf": a strain that is not finite must be seen
LOST = 1e-13  # a pivot that small beside what it came from is round-off
_FAST = {"contract", "reassoc", "nsz", "arcp"}


def jit(function):
    return njit(cache=True, fastmath=_FAST)(function)


# the band: lower half of a symmetric matrix, entry (i, j) at j * ld + i - j


@jit
def add_block(K, flat, ld, row):
    for b in range(K.shape[0]):
        at = (row + b) * ld - b
        for a in range(b, K.shape[0]):
            flat[at + a] += K[a, b]


@jit
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


@jit
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


@jit
def fix(flat, ld, bw, fixed):
    """Rows and columns of the fixed coordinates become those of the identity."""
    n = fixed.size
    for j in range(n):
        for k in range(1, min(bw, n - 1 - j) + 1):
            if fixed[j] or fixed[j + k]:
                flat[j * ld + k] = 0.0
        if fixed[j]:
            flat[j * ld] = 1.0


@jit
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
# pack = Gx, Gy, e1, e2, w, D, where (4 index arrays), along (3 matrices), constant, left, nd


@jit
def _gradients(G, e0, u, first, nb, r, du):
    for p in range(G.shape[0]):
        x, y = 0.0, 0.0
        for k in range(nb):
            x += G[p, k] * u[first + 2 * k]
            y += G[p, k] * u[first + 2 * k + 1]
        du[p, 0], du[p, 1] = x, y
        q = p if e0.shape[0] > 1 else 0
        r[p, 0], r[p, 1] = e0[q, 0] + x, e0[q, 1] + y


@jit
def _interpolate(L, ns, samples, points):
    """points[i, j] = sum_k L[i, k] samples[k, j]."""
    for i in range(L.shape[0]):
        for j in range(ns):
            s = 0.0
            for k in range(L.shape[1]):
                s += L[i, k] * samples[k * ns + j]
            points[i * ns + j] = s


@jit
def _collect(L, ns, points, samples):
    """The transpose of _interpolate."""
    for k in range(L.shape[1]):
        for j in range(ns):
            s = 0.0
            for i in range(L.shape[0]):
                s += L[i, k] * points[i * ns + j]
            samples[k * ns + j] = s


@jit
def _beam_strain(rx, ry, ux, uy, e1, e2, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, s, out):
    for p in range(x_xx.size):
        q = x_xx[p]
        g = q if e1.shape[0] > 1 else 0
        s[p] = 0.5 * ((rx[q, 0] + e1[g, 0]) * ux[q, 0] + (rx[q, 1] + e1[g, 1]) * ux[q, 1])
    _interpolate(Lxx, ns, s, out[0])
    for p in range(y_yy.size):
        q = y_yy[p]
        g = q if e2.shape[0] > 1 else 0
        s[p] = 0.5 * ((ry[q, 0] + e2[g, 0]) * uy[q, 0] + (ry[q, 1] + e2[g, 1]) * uy[q, 1])
    _interpolate(Lyy, ns, s, out[1])
    for p in range(x_xy.size):
        q, h = x_xy[p], y_xy[p]
        g = h if e2.shape[0] > 1 else 0
        s[p] = (rx[q, 0] * uy[h, 0] + rx[q, 1] * uy[h, 1]
                + ux[q, 0] * e2[g, 0] + ux[q, 1] * e2[g, 1])
    _interpolate(Lxy, ns, s, out[2])


@jit
def _beam_force(Gx, Gy, rx, ry, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, w, S, hat, Tx, Ty, f,
                first, nb):
    n = w.size
    for c in range(3):
        for p in range(n):
            S[c, p] *= w[p]
    _collect(Lxx, ns, S[0], hat[0])
    _collect(Lyy, ns, S[1], hat[1])
    _collect(Lxy, ns, S[2], hat[2])
    Tx[:] = 0.0
    Ty[:] = 0.0
    for p in range(x_xx.size):
        q = x_xx[p]
        Tx[q, 0] += hat[0, p] * rx[q, 0]
        Tx[q, 1] += hat[0, p] * rx[q, 1]
    for p in range(y_yy.size):
        q = y_yy[p]
        Ty[q, 0] += hat[1, p] * ry[q, 0]
        Ty[q, 1] += hat[1, p] * ry[q, 1]
    for p in range(x_xy.size):
        q, h = x_xy[p], y_xy[p]
        for i in range(2):
            Tx[q, i] += hat[2, p] * ry[h, i]
            Ty[h, i] += hat[2, p] * rx[q, i]
    for k in range(nb):
        x, y = 0.0, 0.0
        for p in range(Gx.shape[0]):
            x += Gx[p, k] * Tx[p, 0]
            y += Gx[p, k] * Tx[p, 1]
        for p in range(Gy.shape[0]):
            x += Gy[p, k] * Ty[p, 0]
            y += Gy[p, k] * Ty[p, 1]
        f[first + 2 * k] += x
        f[first + 2 * k + 1] += y


@jit
def _normal_row(L, ns, i, j, rows, G, r, B, nb):
    """B of a normal strain at the integration point (i, j): B[0] for x, B[1] for y."""
    B[:, :] = 0.0
    for k in range(L.shape[1]):
        if L[i, k] != 0.0:
            p = rows[k * ns + j]
            x, y = L[i, k] * r[p, 0], L[i, k] * r[p, 1]
            for a in range(nb):
                B[0, a] += x * G[p, a]
                B[1, a] += y * G[p, a]


@jit
def _shear_row(L, ns, i, j, x_rows, y_rows, Gx, Gy, rx, ry, B, nb):
    """B of the shear strain at the integration point (i, j)."""
    B[:, :] = 0.0
    for k in range(L.shape[1]):
        if L[i, k] != 0.0:
            p, q = x_rows[k * ns + j], y_rows[k * ns + j]
            for c in range(2):
                x, y = L[i, k] * ry[q, c], L[i, k] * rx[p, c]
                for a in range(nb):
                    B[c, a] += x * Gx[p, a] + y * Gy[q, a]


@jit
def _pairs(Gx, Gy, x_xx, y_yy, x_xy, y_xy, P, Q):
    """Rows of both factors of the geometric part: sum of stress times P^T Q over the rows."""
    a, b, c = x_xx.size, y_yy.size, x_xy.size
    for p in range(a):
        P[p] = Gx[x_xx[p]]
        Q[p] = Gx[x_xx[p]]
    for p in range(b):
        P[a + p] = Gy[y_yy[p]]
        Q[a + p] = Gy[y_yy[p]]
    for p in range(c):
        P[a + b + p] = Gx[x_xy[p]]
        Q[a + b + p] = Gy[y_xy[p]]
        P[a + b + c + p] = Gy[y_xy[p]]
        Q[a + b + c + p] = Gx[x_xy[p]]


@jit
def beam_loop(pack, u, f, tangent, geometric, carried, use_carried, strains, stresses, flat, ld,
              start):
    """Force into f, tangent into the band; strains and stresses (3, ne, np) are filled."""
    (Gx_, Gy_, e1_, e2_, w_, D, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, constant, left, nd) = pack
    nb, m = nd, 2 * nd
    n, ns = w_.shape[1], x_xx.size // Lxx.shape[1]
    rx, ux = np.empty((Gx_.shape[1], 2)), np.empty((Gx_.shape[1], 2))
    ry, uy = np.empty((Gy_.shape[1], 2)), np.empty((Gy_.shape[1], 2))
    Tx, Ty = np.empty_like(rx), np.empty_like(ry)
    size = max(x_xx.size, y_yy.size, x_xy.size)
    s, hat = np.empty(size), np.empty((3, size))
    strain, S = np.empty((3, n)), np.empty((3, n))
    K, Km, Kg = np.empty((m, m)), np.empty((m, m)), np.empty((nb, nb))
    # rows are strains at points, columns the x components and then the y components
    B, DB = np.empty((3 * n, m)), np.empty((3 * n, m))
    parts = B.reshape(3, n, 2, nb)
    pairs = x_xx.size + y_yy.size + 2 * x_xy.size
    P, Q, SP = np.empty((pairs, nb)), np.empty((pairs, nb)), np.empty((pairs, nb))
    for e in range(left.size):
        t = e if Gx_.shape[0] > 1 else 0
        Gx, Gy, w = Gx_[t], Gy_[t], w_[t]
        e1, e2 = e1_[e if e1_.shape[0] > 1 else 0], e2_[e if e2_.shape[0] > 1 else 0]
        first = left[e] * nd
        _gradients(Gx, e1, u, first, nb, rx, ux)
        _gradients(Gy, e2, u, first, nb, ry, uy)
        _beam_strain(rx, ry, ux, uy, e1, e2, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, s, strain)
        for p in range(n):
            for c in range(3):
                v = D[c, 0] * strain[0, p] + D[c, 1] * strain[1, p] + D[c, 2] * strain[2, p]
                S[c, p] = v
                if tangent:
                    strains[c, e, p], stresses[c, e, p] = strain[c, p], v
        _beam_force(Gx, Gy, rx, ry, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, w, S, hat, Tx, Ty,
                    f, first, nb)
        if tangent:
            for i in range(Lxx.shape[0]):
                for j in range(ns):
                    p = i * ns + j
                    _normal_row(Lxx, ns, i, j, x_xx, Gx, rx, parts[0, p], nb)
                    _normal_row(Lyy, ns, i, j, y_yy, Gy, ry, parts[1, p], nb)
                    _shear_row(Lxy, ns, i, j, x_xy, y_xy, Gx, Gy, rx, ry, parts[2, p], nb)
                    for c in range(3):
                        d0, d1, d2 = w[p] * D[c, 0], w[p] * D[c, 1], w[p] * D[c, 2]
                        for a in range(m):
                            DB[c * n + p, a] = (d0 * B[p, a] + d1 * B[n + p, a]
                                                + d2 * B[2 * n + p, a])
            np.dot(DB.T, B, Km)
            Kg[:] = 0.0
            if geometric:
                if use_carried:
                    for c in range(3):
                        for p in range(n):
                            S[c, p] = w[p] * carried[c, e, p]
                    _collect(Lxx, ns, S[0], hat[0])
                    _collect(Lyy, ns, S[1], hat[1])
                    _collect(Lxy, ns, S[2], hat[2])
                if e == 0 or t > 0:
                    _pairs(Gx, Gy, x_xx, y_yy, x_xy, y_xy, P, Q)
                row = 0
                for c in (0, 1, 2, 2):
                    for p in range((x_xx.size, y_yy.size, x_xy.size)[c]):
                        for a in range(nb):
                            SP[row, a] = hat[c, p] * P[row, a]
                        row += 1
                np.dot(SP.T, Q, Kg)
            for a in range(nb):
                for b in range(nb):
                    K[2 * a, 2 * b] = Km[a, b] + Kg[a, b]
                    K[2 * a + 1, 2 * b + 1] = Km[nb + a, nb + b] + Kg[a, b]
                    K[2 * a + 1, 2 * b] = K[2 * b, 2 * a + 1] = Km[nb + a, b]
        _constant(constant, e, u, first, m, f, K, tangent)
        if tangent:
            add_block(K, flat, ld, start + first)


@jit
def beam_increment(pack, u, du, out):
    """The strain's derivative at u in the direction du, (3, ne, np)."""
    (Gx_, Gy_, e1_, e2_, w_, D, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, constant, left, nd) = pack
    nb, ns = nd, x_xx.size // Lxx.shape[1]
    rx, dx = np.empty((Gx_.shape[1], 2)), np.empty((Gx_.shape[1], 2))
    ry, dy = np.empty((Gy_.shape[1], 2)), np.empty((Gy_.shape[1], 2))
    none = np.zeros((1, 2))
    s = np.empty(max(x_xx.size, y_yy.size, x_xy.size))
    for e in range(left.size):
        t = e if Gx_.shape[0] > 1 else 0
        first = left[e] * nd
        _gradients(Gx_[t], e1_[e if e1_.shape[0] > 1 else 0], u, first, nb, rx, dx)
        _gradients(Gy_[t], e2_[e if e2_.shape[0] > 1 else 0], u, first, nb, ry, dy)
        _gradients(Gx_[t], none, du, first, nb, dx, dx)
        _gradients(Gy_[t], none, du, first, nb, dy, dy)
        for p in range(x_xx.size):
            q = x_xx[p]
            s[p] = rx[q, 0] * dx[q, 0] + rx[q, 1] * dx[q, 1]
        _interpolate(Lxx, ns, s, out[0, e])
        for p in range(y_yy.size):
            q = y_yy[p]
            s[p] = ry[q, 0] * dy[q, 0] + ry[q, 1] * dy[q, 1]
        _interpolate(Lyy, ns, s, out[1, e])
        for p in range(x_xy.size):
            q, h = x_xy[p], y_xy[p]
            s[p] = (rx[q, 0] * dy[h, 0] + rx[q, 1] * dy[h, 1]
                    + dx[q, 0] * ry[h, 0] + dx[q, 1] * ry[h, 1])
        _interpolate(Lxy, ns, s, out[2, e])


@jit
def beam_mean(pack, u0, u1, f):
    """B(middle)^T mean stress, added to f."""
    (Gx_, Gy_, e1_, e2_, w_, D, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, constant, left, nd) = pack
    nb, m, n, ns = nd, 2 * nd, w_.shape[1], x_xx.size // Lxx.shape[1]
    rx, ux = np.empty((Gx_.shape[1], 2)), np.empty((Gx_.shape[1], 2))
    ry, uy = np.empty((Gy_.shape[1], 2)), np.empty((Gy_.shape[1], 2))
    mx, my = np.empty_like(rx), np.empty_like(ry)
    Tx, Ty = np.empty_like(rx), np.empty_like(ry)
    size = max(x_xx.size, y_yy.size, x_xy.size)
    s, hat = np.empty(size), np.empty((3, size))
    old, strain, S = np.empty((3, n)), np.empty((3, n)), np.empty((3, n))
    K, middle = np.empty((1, 1)), 0.5 * (u0 + u1)
    for e in range(left.size):
        t = e if Gx_.shape[0] > 1 else 0
        Gx, Gy = Gx_[t], Gy_[t]
        e1, e2 = e1_[e if e1_.shape[0] > 1 else 0], e2_[e if e2_.shape[0] > 1 else 0]
        first = left[e] * nd
        _gradients(Gx, e1, u0, first, nb, rx, ux)
        _gradients(Gy, e2, u0, first, nb, ry, uy)
        mx[:], my[:] = rx, ry
        _beam_strain(rx, ry, ux, uy, e1, e2, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, s, old)
        _gradients(Gx, e1, u1, first, nb, rx, ux)
        _gradients(Gy, e2, u1, first, nb, ry, uy)
        _beam_strain(rx, ry, ux, uy, e1, e2, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, s, strain)
        for p in range(mx.shape[0]):
            mx[p, 0], mx[p, 1] = 0.5 * (mx[p, 0] + rx[p, 0]), 0.5 * (mx[p, 1] + rx[p, 1])
        for p in range(my.shape[0]):
            my[p, 0], my[p, 1] = 0.5 * (my[p, 0] + ry[p, 0]), 0.5 * (my[p, 1] + ry[p, 1])
        for p in range(n):
            for c in range(3):
                S[c, p] = 0.5 * (D[c, 0] * (old[0, p] + strain[0, p])
                                 + D[c, 1] * (old[1, p] + strain[1, p])
                                 + D[c, 2] * (old[2, p] + strain[2, p]))
        _beam_force(Gx, Gy, mx, my, x_xx, y_yy, x_xy, y_xy, Lxx, Lyy, Lxy, ns, w_[t], S, hat, Tx,
                    Ty, f, first, nb)
        _constant(constant, e, middle, first, m, f, K, False)


# the cable
# pack = G1, G2, a0, b0, s0, kappa0, w, stiffness, constant, left, nd


@jit
def _cable_point(G1, G2, p, u, first, nb):
    a0, a1, b0, b1 = 0.0, 0.0, 0.0, 0.0
    for k in range(nb):
        x, y = u[first + 2 * k], u[first + 2 * k + 1]
        a0 += G1[p, k] * x
        a1 += G1[p, k] * y
        b0 += G2[p, k] * x
        b1 += G2[p, k] * y
    return a0, a1, b0, b1


@jit
def cable_loop(pack, u, f, tangent, geometric, carried, use_carried, strains, stresses, flat, ld,
               start):
    """Force into f, tangent into the band; strains and stresses (2, ne, np) are filled."""
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
            strains[0, e, p], strains[1, e, p] = eps, change
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
        self.packs, self.cable = packs, cable
        self.shapes = [(2, elements, pack[6].shape[1]) if cable else
                       (3, elements, pack[4].shape[1]) for pack in packs]
        self._loop, self._increment, self._mean = (
            (cable_loop, cable_increment, cable_mean) if cable else
            (beam_loop, beam_increment, beam_mean))
        self._none = np.zeros((1, 1, 1))

    def assemble(self, u, K, start, force, carried, geometric):
        """Add force and tangent; see :meth:`skfem_ancf.kernel.Chain.assemble`."""
        stresses = [np.empty(shape) for shape in self.shapes]
        for k, (pack, S) in enumerate(zip(self.packs, stresses)):
            self._loop(pack, u, force, True, geometric, carried[k] if carried else self._none,
                       carried is not None, np.empty_like(S), S, K._flat, K._ld, start)
        return CompiledEvaluation(self, u, stresses)

    def force(self, u):
        """Internal force, shape (N,)."""
        out = np.zeros(u.size)
        for pack in self.packs:
            self._loop(pack, u, out, False, False, self._none, False, self._none, self._none,
                       self._none[0, 0], 1, 0)
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
