"""A border about a band matrix: what :class:`skfem_ancf.linalg.BorderedMatrix` does.

Given as the coordinates picked, springs first, their number, and for each second derivative of a
joint where its row and its column are among those picked, -1 for entries inside the band.
"""

import math

import numpy as np

from .band import dense_solve, multiply, solve, solve_rows, times_columns
from .jit import inner


@inner
def add_outside(joints, border, l, free, flat, ld, S):
    """Add the joints' curvature and the springs to the band; into S what has to be added to it."""
    hk, hi, hj, hv = joints[0], joints[1], joints[2], joints[3]
    picked, ns, row, column = border
    S[:] = 0.0
    for a in range(hk.size):
        i, j = hi[a], hj[a]
        value = l[hk[a]] * hv[a] * free[i] * free[j]
        if row[a] >= 0:
            S[row[a], column[a]] += value
        elif i >= j:
            flat[j * ld + i - j] += value
    mean = 0.0
    for i in range(free.size):
        mean += abs(flat[i * ld]) / free.size
    for k in range(ns):
        at = picked[k] * ld
        stiffness = abs(flat[at]) if flat[at] != 0.0 else mean
        flat[at] += stiffness
        S[k, k] = -stiffness


@inner
def make_border(flat, ld, bw, J, free, picked, S, Z, W, scale, H):
    """Columns Z^T and the matrix H of the border, from the factors of the band matrix."""
    k, m, N = picked.size, J.shape[0], J.shape[1]
    W[:] = 0.0
    for a in range(k):
        W[a, picked[a]] = 1.0
        solve(flat, ld, bw, W[a])
    solve_rows(flat, ld, bw, J, free, Z[k:])
    for b in range(m):
        size = 0.0
        for i in range(N):
            size += J[b, i] * Z[k + b, i]
        scale[b] = 1.0 / math.sqrt(abs(size)) if size != 0.0 else 1.0
        for i in range(N):
            Z[k + b, i] *= scale[b]
    Z[:k] = 0.0
    for a in range(k):
        for c in range(k):
            if S[c, a] != 0.0:
                for i in range(N):
                    Z[a, i] += S[c, a] * W[c, i]
    for b in range(k + m):
        for a in range(k):
            H[a, b] = Z[b, picked[a]] + (1.0 if a == b else 0.0)
        for a in range(m):
            s = 0.0
            for i in range(N):
                s += J[a, i] * Z[b, i]
            H[k + a, b] = scale[a] * s


@inner
def _once(flat, ld, bw, J, picked, Z, scale, H, x, c, dm, work, y):
    """Solve in place of x and c for du and the multipliers; False if H is singular."""
    k = picked.size
    solve(flat, ld, bw, x)
    times_columns(J, x, dm)
    for a in range(k):
        y[a] = x[picked[a]]
    for b in range(c.size):
        y[k + b] = scale[b] * (dm[b] - c[b])
    for a in range(H.shape[0]):
        for b in range(H.shape[0]):
            work[a, b] = H[a, b]
    if not dense_solve(work, y):
        return False
    for a in range(y.size):
        for i in range(x.size):
            x[i] -= Z[a, i] * y[a]
    for b in range(c.size):
        dm[b] = scale[b] * y[k + b]
    return True


@inner
def border_solve(K, flat, ld, bw, J, picked, S, Z, scale, H, b, c, x, dm):
    """x and dm with one refinement; returns its size relative to x, or -1 if H is singular.

    ``K`` is the band matrix, ``flat`` its factors.
    """
    N, m, n = x.size, c.size, H.shape[0]
    work, y, r, rc, dl = np.empty((n, n)), np.empty(n), np.empty(N), np.empty(m), np.empty(m)
    for i in range(N):
        x[i] = b[i]
    if not _once(flat, ld, bw, J, picked, Z, scale, H, x, c, dm, work, y):
        return -1.0
    multiply(K, ld, bw, x, r)
    for a in range(picked.size):
        for e in range(picked.size):
            r[picked[a]] += S[a, e] * x[picked[e]]
    for i in range(N):
        r[i] = b[i] - r[i]
        for a in range(m):
            r[i] -= J[a, i] * dm[a]
    times_columns(J, x, rc)
    for a in range(m):
        rc[a] = c[a] - rc[a]
    if not _once(flat, ld, bw, J, picked, Z, scale, H, r, rc, dl, work, y):
        return -1.0
    size, error = 0.0, 0.0
    for i in range(N):
        w = abs(K[i * ld])
        size += w * x[i] * x[i]
        error += w * r[i] * r[i]
        x[i] += r[i]
    for a in range(m):
        dm[a] += dl[a]
    return math.sqrt(error / size) if size > 0.0 else 0.0
