"""Cables.

pack = G1, G2, a0, b0, s0, kappa0, w, stiffness, constant, left, nd
"""

import math

import numpy as np

from .band import add_block
from .jit import inner, jit


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
def _cable_tables(pack, e):
    """The tables of one element: G1, G2, a0, b0, s0, kappa0 and w."""
    G1, G2, A, B, s0, kappa0, w = pack[:7]
    t = e if G1.shape[0] > 1 else 0
    r = e if A.shape[0] > 1 else 0
    return G1[t], G2[t], A[r], B[r], s0[r], kappa0[r], w[t]


@inner
def _cable_strain(G1, G2, A, B, s0, p, u, first, nb):
    """At one point: r' and r'', |r'|^2, the extension without cancellation, and the curvature."""
    d0, d1, d2, d3 = _cable_point(G1, G2, p, u, first, nb)
    a0, a1, b0, b1 = A[p, 0] + d0, A[p, 1] + d1, B[p, 0] + d2, B[p, 1] + d3
    s = a0 * a0 + a1 * a1
    eps = (((a0 + A[p, 0]) * d0 + (a1 + A[p, 1]) * d1) / (math.sqrt(s) + math.sqrt(s0[p])))
    return a0, a1, b0, b1, s, eps, (a0 * b1 - a1 * b0) / s


@inner
def cable_loop(pack, u, f, tangent, geometric, carried, use_carried, stresses, flat, ld, start):
    """Force into f, and if asked for tangent into the band and stresses (2, ne, np)."""
    stiffness, constant, left, nd = pack[7:]
    nb, m = nd, 2 * nd
    K, T = np.empty((m, m)), np.empty((4, 4))
    e_a, k_a, k_b, c_a = np.empty(2), np.empty(2), np.empty(2), np.empty(2)
    EA, EI = stiffness
    for e in range(left.size):
        G1, G2, A, B, s0, kappa0, w = _cable_tables(pack, e)
        first = left[e] * nd
        if tangent:
            K[:] = 0.0
        for p in range(w.size):
            a0, a1, b0, b1, s, eps, kappa = _cable_strain(G1, G2, A, B, s0, p, u, first, nb)
            root = math.sqrt(s)
            N, M = EA * eps, EI * (kappa - kappa0[p])
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
def cable_carry(pack, u, du, before, out):
    """The stresses, linearised, at u + du, from those before; (2, ne, np)."""
    stiffness, _, left, nd = pack[7:]
    for e in range(left.size):
        G1, G2, A, B, s0, _, w = _cable_tables(pack, e)
        first = left[e] * nd
        for p in range(w.size):
            a0, a1, b0, b1, s, _, kappa = _cable_strain(G1, G2, A, B, s0, p, u, first, nd)
            x0, x1, x2, x3 = _cable_point(G1, G2, p, du, first, nd)
            ax = a0 * x0 + a1 * x1
            change = (x0 * b1 - x1 * b0 + a0 * x3 - a1 * x2 - 2 * kappa * ax) / s
            out[0, e, p] = before[0, e, p] + stiffness[0] * ax / math.sqrt(s)
            out[1, e, p] = before[1, e, p] + stiffness[1] * change


@inner
def cable_stress(pack, u, out):
    """Normal force and moment at u, (2, ne, np)."""
    stiffness, _, left, nd = pack[7:]
    for e in range(left.size):
        G1, G2, A, B, s0, kappa0, w = _cable_tables(pack, e)
        for p in range(w.size):
            _, _, _, _, _, eps, kappa = _cable_strain(G1, G2, A, B, s0, p, u, left[e] * nd, nd)
            out[0, e, p], out[1, e, p] = stiffness[0] * eps, stiffness[1] * (kappa - kappa0[p])


@jit
def cable_mean(pack, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the energy, added to f."""
    stiffness, constant, left, nd = pack[7:]
    EA, EI = stiffness
    K, middle = np.empty((1, 1)), 0.5 * (u0 + u1)
    for e in range(left.size):
        G1, G2, A, B, s0, kappa0, w = _cable_tables(pack, e)
        first = left[e] * nd
        for p in range(w.size):
            a0, a1, b0, b1, s, eps, k0 = _cable_strain(G1, G2, A, B, s0, p, u0, first, nd)
            c0, c1, g0, g1, z, eps1, k1 = _cable_strain(G1, G2, A, B, s0, p, u1, first, nd)
            rs, rz = math.sqrt(s), math.sqrt(z)
            N = 0.5 * w[p] * EA * (eps + eps1)
            kappa = 0.5 * (k0 + k1)
            M = w[p] * EI * (kappa - kappa0[p])
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
