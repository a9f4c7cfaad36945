"""Compiled kernels: the kernels of :mod:`.elements` as loops over blocks of elements. t are
:class:`~skfem_ancf.beam.kernels.compiled.CompiledTables`; ``given`` and ``out`` are stresses (ne
ns,), or of size 0. Other arrays are as in :mod:`.blocks`."""

import numpy as np

from ...core import F1, F2, add_multiple, apart, room, source
from .blocks import (AT_START, add, add_forces_of, add_geometric, add_material, add_matrices,
                     at_points, between_samples, block, changes, components, directions, displaced,
                     evaluate_increment, from_points, gather, law_stresses, moduli, of_block, place,
                     products, put, scale_products, strains, take, times, to_rows)
from .compiled import W, CompiledTables
from .tables import HISTORY, LINEAR, conserve, evaluate_history, law_evaluate


@apart("StrainTables", CompiledTables, F1, F1, F1, F1, F1)
def run_force(t, u, v, given, out, f):
    """Force and stresses at u, or with v means from u to v whose work is the change of the energy.
    Given stresses act in place of those of the strain; without ``out``, they act without the
    constant stiffness."""
    R, m, ns, du, moving = t.G.shape[0], t.G.shape[1], t.pattern.rows.shape[1], v, v.size > 0
    if moving:
        du = v.copy()
        add_multiple(-1.0, u, du)
    work, samples = room((3 * m + 4 * R + 3 * R // 2, 2 * t.width)), room((3, ns, t.width))
    U, V, F, rows = work[:m], work[m:2 * m], work[2 * m:3 * m], work[3 * m:]
    d, dd, r, B, X = rows[:R], rows[R:2 * R], rows[2 * R:3 * R], rows[3 * R:4 * R], rows[4 * R:]
    E, C, T, whole = samples[0], samples[1], samples[2], out.size > 0 or given.size == 0
    if not moving:
        dd, C = dd[:0], C[:0]
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        if moving:
            gather(t, first, du, V)
            to_rows(t, first, V, dd)
        D = directions(t, r, dd, X)
        if whole:
            strains(t, first, d, r, E)
            if moving:
                changes(t, D, dd, C)
                add(0.5, C, E)
                add(0.5, V, U)
            if t.law.kind == LINEAR:
                times(t.pattern.pairs, block(t.H, first), E, T)
            else:
                law_stresses(t, first, E, C, T)
        if out.size > 0:
            put(t, first, T, out[:0], out)
        if given.size > 0:
            take(t, first, given, T)
        if f.size > 0:
            add_forces_of(t, first, D, T, U if whole else U[:0], B, F, f)


@apart("StrainTables", CompiledTables, F1, F1, F1, F1, F1)
def run_linearised(t, u, du, given, out, f):
    """Linearised stresses of a change or rate du at u: plus given ones to out, or as forces."""
    R, m, ns = t.G.shape[0], t.G.shape[1], t.pattern.rows.shape[1]
    work, samples = room((2 * m + 4 * R + 3 * R // 2, 2 * t.width)), room((2, ns, t.width))
    U, F, rows, E, T = work[:m], work[m:2 * m], work[2 * m:], samples[0], samples[1]
    d, dd, r, B, X = rows[:R], rows[R:2 * R], rows[2 * R:3 * R], rows[3 * R:4 * R], rows[4 * R:]
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        gather(t, first, du, U)
        to_rows(t, first, U, dd)
        if t.law.kind != LINEAR:
            strains(t, first, d, r, E)
        H, D = moduli(t, first, E, T), directions(t, r, d[:0], X)
        changes(t, D, dd, E)
        times(t.pattern.pairs, H, E, T)
        if out.size > 0:
            put(t, first, T, given, out)
        if f.size > 0:
            add_forces_of(t, first, D, T, U[:0], B, F, f)


@apart("StrainTables", CompiledTables, F1, F1, F1, F1, F1, int)
def run_tangent(t, u, given, out, f, A, ld):
    R, m, ns = t.G.shape[0], t.G.shape[1], t.pattern.rows.shape[1]
    work, samples = room((2 * m + 3 * R + 3 * R // 2, 2 * t.width)), room((2, ns, t.width))
    U, F, rows, E, T = work[:m], work[m:2 * m], work[2 * m:], samples[0], samples[1]
    d, r, B, Y = rows[:R], rows[R:2 * R], rows[2 * R:3 * R], rows[3 * R:]
    terms, skew = t.pattern.products.shape[1], t.pattern.skew.shape[1]
    w, z = room((terms, 3 * t.width)), room((skew, t.width))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        strains(t, first, d, r, E)
        X = directions(t, r, d[:0], Y)
        H = moduli(t, first, E, T)
        if t.law.kind == LINEAR and (out.size > 0 or f.size > 0 or given.size == 0):
            times(t.pattern.pairs, H, E, T)
        if out.size > 0:
            put(t, first, T, out[:0], out)
        if f.size > 0:
            add_forces_of(t, first, X, T, U, B, F, f)
        w[:] = 0.0
        z[:] = 0.0
        add_material(t, H, X, w, z)
        if given.size > 0:
            take(t, first, given, T)
        add_geometric(t, r, T, w)
        add_matrices(t, first, w, z, 1, ld, A)


@apart("unsymmetric", CompiledTables, F1, F1, F1, int)
def run_unsymmetric(t, u, v, A, ld):
    R, m, ns, n = t.G.shape[0], t.G.shape[1], t.pattern.rows.shape[1], 3 * t.G.shape[0] // 2
    du = v.copy()
    add_multiple(-1.0, u, du)
    work = room((m + 3 * R + 2 * n, 2 * t.width))
    U, d, r, s = work[:m], work[m:m + R], work[m + R:m + 2 * R], work[m + 2 * R:m + 3 * R]
    E, T = room((ns, t.width)), room((ns, t.width))
    X, Y = work[m + 3 * R:m + 3 * R + n], work[m + 3 * R + n:]
    terms, skew = t.pattern.products.shape[1], t.pattern.skew.shape[1]
    w, z = room((terms, 4 * t.width)), room((skew, 4 * t.width))
    K, Z = room((m * (m + 1) // 2, 4 * t.width)), room((m * (m - 1) // 2, 4 * t.width))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        strains(t, first, d, r, E)
        gather(t, first, du, U)
        to_rows(t, first, U, d)
        for g in range(R):
            before, change, after = r[g], d[g], s[g]
            for e in range(len(after)):
                after[e] = before[e] + change[e]
        one, two = directions(t, r, d[:0], X), directions(t, s, d[:0], Y)
        add(-1.0, one, two)
        w[:] = 0.0
        z[:] = 0.0
        add_difference(t, moduli(t, first, E, T), one, two, w, z)
        products(t, first, w, z, K, Z)
        if len(t.D) > 0:
            scale_products(block(t.D, first), K, 1)
            scale_products(block(t.D, first), Z, 0)
        # matrices that are not symmetric
        for j in range(2 * m + 2):
            l, b, sj = place(j, m)
            for i in range(2 * m + 2):
                k, a, si = place(i, m)
                high, low, at = max(k, l), min(k, l), (2 * a + b) * W
                for e in range(min(W, len(t.start) - first)):
                    x = K[high * (high + 1) // 2 + low, at + e]
                    if k != l:
                        y = Z[high * (high - 1) // 2 + low, at + e]
                        x += y if k > l else -y
                    A[(t.start[first + e] + j) * ld + i - j] += si * sj * x


@apart("unsymmetric", CompiledTables, F2, F2, F2, F2, F2)
def add_difference(t, H, X, D, w, z):
    """Coefficients xx, xy, yx, yy of ``X^T H D``, symmetric and skew in the functions."""
    terms, factors = t.pattern.terms, t.pattern.factors[0]
    for k in range(len(factors)):
        n, p, a, b, h = terms[1, k], terms[0, k], terms[2, k], terms[3, k], H[terms[4, k]]
        x, y, X0, Y0, c = X[a], D[b], X[b], D[a], 0.5 * factors[k]
        for i in range(0, 2 * W, W):
            for j in range(0, 2 * W, W):
                o = w[p, 2 * i + j:]
                for e in range(t.width):
                    o[e] += c * h[e] * (x[i + e] * y[j + e] + X0[i + e] * Y0[j + e])
                if n >= 0:
                    o = z[n, 2 * i + j:]
                    for e in range(t.width):
                        o[e] += c * h[e] * (x[i + e] * y[j + e] - X0[i + e] * Y0[j + e])


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
            for e in range(t.width):
                x[c, p, e] += shift[(c * points + p) * ne + min(first + e, ne - 1)]
    law_evaluate(t.law, x, S)
    if change.size > 0:
        conserve(t.law, x, at_points(t, first, change), S)
    y, z = S.reshape(S.size), still.reshape(S.size)
    for k in range(S.size):
        y[k] -= z[k]


@apart("eigenstrains", CompiledTables, F1, F1, F1, F1)
def eigen_mean(t, u, v, shift, f):
    """Change of the mean force from u to v by eigenstrains (3, points, ne) of a nonlinear law."""
    R, m, ns, du = t.G.shape[0], t.G.shape[1], t.pattern.rows.shape[1], v.copy()
    add_multiple(-1.0, u, du)
    work, samples = room((m + 4 * R + 3 * R // 2, 2 * t.width)), room((3, ns, t.width))
    U, rows, E, C, T = work[:m], work[m:], samples[0], samples[1], samples[2]
    d, dd, r, B, X = rows[:R], rows[R:2 * R], rows[2 * R:3 * R], rows[3 * R:4 * R], rows[4 * R:]
    S = room((3, t.weights.shape[1], t.width))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        gather(t, first, du, U)
        to_rows(t, first, U, dd)
        D = directions(t, r, dd, X)
        strains(t, first, d, r, E)
        changes(t, D, dd, C)
        add(0.5, C, E)
        shifted(t, first, E, C, shift, S)
        from_points(t, first, S, T)
        add_forces_of(t, first, D, T, U[:0], B, U, f)


def run_eigen_force(t, u, v, given, f):
    if t.law.kind == LINEAR:
        run_force(t, u, v, given, u[:0], f)
    elif t.law.kind != HISTORY:
        eigen_mean(t, u, v if v.size > 0 else u, given, f)


def run_eigen_tangent(t, u, given, A, ld):
    if t.law.kind != HISTORY:
        eigen_tangent(t, u, given, A, ld)


@apart("eigenstrains", CompiledTables, F1, F1, F1, int)
def eigen_tangent(t, u, given, A, ld):
    """Change of the tangent at u by eigenstrains."""
    R, m, ns = t.G.shape[0], t.G.shape[1], t.pattern.rows.shape[1]
    U, d, r = room((m, 2 * t.width)), room((R, 2 * t.width)), room((R, 2 * t.width))
    E, T = room((ns, t.width)), room((ns, t.width))
    terms, skew = t.pattern.products.shape[1], t.pattern.skew.shape[1]
    w, z = room((terms, 3 * t.width)), room((skew, t.width))
    for first in range(0, len(t.start), W):
        displaced(t, first, u, U, d, r)
        w[:] = 0.0
        z[:] = 0.0
        if t.law.kind == LINEAR:
            take(t, first, given, T)
        else:
            strains(t, first, d, r, E)
            points = t.weights.shape[1]
            S, M = np.empty((3, points, t.width)), np.empty((9, points, t.width))
            shifted(t, first, E, E[:0], given, S)
            from_points(t, first, S, T)
            shifted(t, first, E, E[:0], given, M)
            H = np.empty((t.pattern.pairs.shape[1], t.width))
            between_samples(t, first, M, H)
            add_material(t, H, r, w, z)
        add_geometric(t, r, T, w)
        add_matrices(t, first, w, z, 0, ld, A)


def run_put(t, given):
    if t.law.kind == HISTORY:
        now = t.memory.now.ravel()
        for k in range(len(now)):
            now[k] = -given[k]


def run_accept(t, u, v, out):
    if t.law.kind == HISTORY:
        accept(t, u, v, out)


@apart("histories", CompiledTables, F1, F1, F1)
def accept(t, u, v, out):
    """Set the history after an increment from u to v; add what it dissipates to ``out[0]``."""
    R, m, memory = t.G.shape[0], t.G.shape[1], t.memory
    U, d, r = room((m, 2 * t.width)), room((R, 2 * t.width)), room((R, 2 * t.width))
    E, ne, points = room((t.pattern.rows.shape[1], t.width)), len(t.start), t.weights.shape[1]
    n, k = components(t), len(memory.history)
    S, x = np.empty((2, n + n * n, points, t.width)), np.empty((2, n, points, t.width))
    h, energy = np.empty((2, k, points, t.width)), np.empty((2, 1, points, t.width))
    for first in range(0, ne, W):
        for end in range(2):
            displaced(t, first, u if end == 0 else v, U, d, r)
            strains(t, first, d, r, E)
            x[end] = at_points(t, first, E)
            evaluate_increment(
                t, first, x[end], AT_START if end == 0 else memory.span[0], S[end], h[1])
            if end == 0:
                of_block(memory.history, first, h[1])
            evaluate_history(t.law, x[end], h[1], 0.0, energy[end], h[0])
        w = block(t.weights, first)
        for p in range(points):
            for e in range(min(t.width, ne - first)):
                lost = energy[0, 0, p, e] - energy[1, 0, p, e]
                for c in range(n):  # strains are scaled
                    lost += 0.5 * (S[0, c, p, e] + S[1, c, p, e]) * (
                        x[1, c, p, e] - x[0, c, p, e]) / t.law.scale[c]
                    memory.before[c, p, first + e] = memory.now[c, p, first + e]
                for c in range(k):
                    memory.history[c, p, first + e] = h[1, c, p, e]
                out[0] += w[p, e] * lost
