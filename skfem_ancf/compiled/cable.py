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


@inner
def cable_stress(pack, u, out):
    """Normal force and moment at u."""
    G1_, G2_, A0_, B0_, s0_, kappa0_, w_, stiffness, constant, left, nd = pack
    for e in range(left.size):
        t = e if G1_.shape[0] > 1 else 0
        r = e if A0_.shape[0] > 1 else 0
        first = left[e] * nd
        for p in range(w_.shape[1]):
            d0, d1, d2, d3 = 0.0, 0.0, 0.0, 0.0
            for k in range(nd):
                x, y = u[first + 2 * k], u[first + 2 * k + 1]
                d0 += G1_[t, p, k] * x
                d1 += G1_[t, p, k] * y
                d2 += G2_[t, p, k] * x
                d3 += G2_[t, p, k] * y
            A0, A1 = A0_[r, p, 0], A0_[r, p, 1]
            a0, a1, b0, b1 = A0 + d0, A1 + d1, B0_[r, p, 0] + d2, B0_[r, p, 1] + d3
            s = a0 * a0 + a1 * a1
            out[0, e, p] = stiffness[0] * (((a0 + A0) * d0 + (a1 + A1) * d1)
                                           / (math.sqrt(s) + math.sqrt(s0_[r, p])))
            out[1, e, p] = stiffness[1] * ((a0 * b1 - a1 * b0) / s - kappa0_[r, p])
