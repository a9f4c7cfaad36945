"""Loops that replace calls of NumPy, SciPy and Python in compiled code.

Each replaces the function of its name that :func:`skfem_ancf.core.source.primitive` marks.
"""

import numpy as np
from numba import objmode

from . import callbacks
from .band import LOST, REPEATED, SPARE
from .source import source

indices = {1: lambda n: range(n), 2: lambda a, b: range(a, b), 3: lambda a, b, s: range(a, b, s)}


def column(x):
    return x


# band matrices


def multiply(A, x, y):
    n, top = x.size, max(A.top, 0)
    columns = A.flat.reshape(n, A.flat.size // n)
    for i in range(n):
        y[i] = 0.0
    for j in range(n):
        # slices instead of x[j + k]: Numba then needs no check for negative indices
        column, later, out, m = columns[j][top:], x[j:], y[j:], min(A.width, n - 1 - j) + 1
        c, s = later[0], column[0] * later[0]
        for k in range(1, m):
            out[k] += column[k] * c
        if A.top > 0:
            left = min(A.width, j)
            above, before = columns[j][top - left:], y[j - left:]
            for k in range(left):
                before[k] += above[k] * c
        else:
            for k in range(1, m):
                s += column[k] * later[k]
        out[0] += s


def add_multiple(c, x, y):
    for i in range(y.size):
        y[i] += c * x[i]


def factorize(A):
    if A.top > 0:
        return _exchanging(A)
    n, halves = A.flat.size // A.ld, 2 if A.top < 0 else 1
    # entry i of half h of column j
    L = A.flat.reshape(n, halves, A.ld // halves)
    for j in range(n):
        m, d = min(A.width, n - 1 - j), L[j, 0, 0]
        if not abs(d) > 0.0 or not abs(d) < np.inf:
            return False
        inverse = 1.0 / d
        for k in range(1, m + 1):
            before, c = L[j + k, 0, 0], L[j, halves - 1, k] * inverse
            for i in range(m + 1 - k):
                L[j + k, 0, i] -= c * L[j, 0, k + i]
            if abs(L[j + k, 0, 0]) < LOST * abs(before):
                return False
            if halves > 1:
                c = L[j, 0, k] * inverse
                for i in range(m + 1 - k):
                    L[j + k, 1, i] -= c * L[j, 1, k + i]
        for k in range(1, m + 1):
            L[j, 0, k] *= inverse
            if halves > 1:
                L[j, 1, k] *= inverse
    return True


@source
def _exchanging(A):
    """As LAPACK's gbtf2."""
    ld, top, width = A.ld, A.top, A.width
    n = A.flat.size // ld
    flat, last = A.flat, 0
    for j in range(n):
        at, m, p = j * ld + top, min(width, n - 1 - j), 0
        for i in range(1, m + 1):
            if abs(flat[at + i]) > abs(flat[at + p]):
                p = i
        A.pivots[j] = j + p
        if not abs(flat[at + p]) > 0.0 or not abs(flat[at + p]) < np.inf:
            return False
        last = max(last, min(j + width + p, n - 1))
        if p != 0:
            for c in range(j, last + 1):
                row = c * ld + top + j - c
                flat[row], flat[row + p] = flat[row + p], flat[row]
        inverse = 1.0 / flat[at]
        for i in range(1, m + 1):
            flat[at + i] *= inverse
        for c in range(j + 1, last + 1):
            row = c * ld + top + j - c
            x = flat[row]
            if x != 0.0:
                for i in range(1, m + 1):
                    flat[row + i] -= flat[at + i] * x
    return True


def solve(A, x):
    if A.top > 0:
        _solve_exchanged(A, x)
        return
    n, half = x.size, A.ld // 2 if A.top < 0 else 0
    columns = A.flat.reshape(n, A.ld)
    for j in range(n):
        column, later, c = columns[j], x[j:], x[j]
        for k in range(1, min(A.width, n - 1 - j) + 1):
            later[k] -= column[k] * c
    for j in range(n - 1, -1, -1):
        column, later, s = columns[j][half:], x[j:], 0.0
        for k in range(1, min(A.width, n - 1 - j) + 1):
            s += column[k] * later[k]
        later[0] = later[0] / columns[j, 0] - s


@source
def _solve_exchanged(A, x):
    """As LAPACK's gbtrs."""
    flat, ld, top, n, reach = A.flat, A.ld, A.top, x.size, A.width
    for j in range(n):
        p = A.pivots[j]
        reach = max(reach, A.width + p - j)  # bandwidth of U
        x[j], x[p] = x[p], x[j]
        xj = x[j]
        for i in range(1, min(A.width, n - 1 - j) + 1):
            x[j + i] -= flat[j * ld + top + i] * xj
    for j in range(n - 1, -1, -1):
        at = j * ld + top
        x[j] /= flat[at]
        xj = x[j]
        for i in range(j - min(reach, j), j):
            x[i] -= flat[at - j + i] * xj


def factorize_complex(A, width):
    ld, half = width + 1 + SPARE, A.size // 2
    n = half // ld
    for j in range(n):
        at, m = j * ld, min(width, n - 1 - j)
        a, b = A[at], A[half + at]
        size = a * a + b * b
        if not size > 0.0 or not size < np.inf:
            return False
        for k in range(1, m + 1):
            re, im, p = at + k, half + at + k, at + k * ld
            c, d = (A[re] * a + A[im] * b) / size, (A[im] * a - A[re] * b) / size
            for i in range(m + 1 - k):
                A[p + i] -= c * A[re + i] - d * A[im + i]
                A[half + p + i] -= c * A[im + i] + d * A[re + i]
        for k in range(1, m + 1):
            x, y = A[at + k], A[half + at + k]
            A[at + k], A[half + at + k] = (x * a + y * b) / size, (y * a - x * b) / size
    return True


def solve_complex(A, width, x, y):
    n, half = x.size, A.size // 2
    ld = half // n
    for j in range(n):
        c, d = x[j], y[j]
        for k in range(1, min(width, n - 1 - j) + 1):
            a, b = A[j * ld + k], A[half + j * ld + k]
            x[j + k] -= a * c - b * d
            y[j + k] -= a * d + b * c
    for j in range(n - 1, -1, -1):
        a, b, c, d = A[j * ld], A[half + j * ld], x[j], y[j]
        size, p, q = a * a + b * b, 0.0, 0.0
        for k in range(1, min(width, n - 1 - j) + 1):
            e, f = A[j * ld + k], A[half + j * ld + k]
            p += e * x[j + k] - f * y[j + k]
            q += e * y[j + k] + f * x[j + k]
        x[j], y[j] = (c * a + d * b) / size - p, (d * a - c * b) / size - q


@source
def _eliminate_column(A, b, j):
    """Eliminate column j below the diagonal."""
    n = b.size
    for i in range(j + 1, n):
        c = A[i, j] / A[j, j]
        if c != 0.0:
            for k in range(j, n):
                A[i, k] -= c * A[j, k]
            b[i] -= c * b[j]


def dense_solve(A, b):
    n = b.size
    for j in range(n):
        p = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[p, j]):
                p = i
        if not abs(A[p, j]) > 0.0:
            return False
        if p != j:
            for k in range(n):
                A[j, k], A[p, k] = A[p, k], A[j, k]
            b[j], b[p] = b[p], b[j]
        _eliminate_column(A, b, j)
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            b[j] -= A[j, k] * b[k]
        b[j] /= A[j, j]
    return True


def solve_dependent(S, b):
    m = b.size
    rank, size, order = m, np.empty(m), np.empty(m, np.int64)
    for j in range(m):
        size[j], order[j] = np.sqrt(abs(S[j, j])), j
        if size[j] == 0.0:
            size[j] = 1.0
    for i in range(m):
        b[i] /= size[i]
        for j in range(m):
            S[i, j] /= size[i] * size[j]
    for j in range(m):
        p, q, pivot = j, j, 0.0
        for i in range(j, m):
            for k in range(j, m):
                if not abs(S[i, k]) < np.inf:
                    return False
                if abs(S[i, k]) > pivot:
                    p, q, pivot = i, k, abs(S[i, k])
        if pivot <= REPEATED:
            if j == 0:
                return False
            rank = j
            break
        for k in range(m):
            S[j, k], S[p, k] = S[p, k], S[j, k]
        b[j], b[p] = b[p], b[j]
        for i in range(m):
            S[i, j], S[i, q] = S[i, q], S[i, j]
        order[j], order[q] = order[q], order[j]
        _eliminate_column(S, b, j)
    free = m - rank
    x = np.zeros((free + 1, m))
    for k in range(free):
        x[k, rank + k] = 1.0
        for i in range(rank):
            x[k, i] = -S[i, rank + k]
    for i in range(rank):
        x[free, i] = b[i]
    for k in range(free + 1):
        for i in range(rank - 1, -1, -1):
            for j in range(i + 1, rank):
                x[k, i] -= S[i, j] * x[k, j]
            x[k, i] /= S[i, i]
    for k in range(free):
        square = 0.0
        for i in range(m):
            square += x[k, i] * x[k, i]
        for l in range(k + 1, free + 1):
            c = 0.0
            for i in range(m):
                c += x[k, i] * x[l, i]
            for i in range(m):
                x[l, i] -= c / square * x[k, i]
    for i in range(m):
        b[order[i]] = x[free, i]
    for i in range(m):
        b[i] /= size[i]
    return True


def subtract_rows(J, x, out):
    for k in range(J.shape[0]):
        for i in range(out.size):
            out[i] -= J[k, i] * x[k]


def solve_joined(A, J, J1, free, anew, Y, S, b, x):
    if anew:
        for k in range(b.size):
            for i in range(x.size):
                Y[k, i] = J[k, i] * free[i]
            solve(A, Y[k])
    for k in range(b.size):
        for l in range(b.size):
            s = 0.0
            for i in range(x.size):
                s += J1[k, i] * Y[l, i]
            S[k, l] = s
        for i in range(x.size):
            b[k] += J1[k, i] * x[i]
    if not solve_dependent(S, b):
        return False
    subtract_rows(Y, b, x)
    return True


# sums


def dot(a, b):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


def weighted(a, b, w):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i] * w[i]
    return total


def total(x):
    found = 0.0
    for i in range(x.size):
        found += x[i]
    return found


def smallest(x):
    found = np.inf
    for i in range(x.size):
        found = np.minimum(found, x[i])  # propagates NaN
    return found


def largest(x):
    found = 0.0
    for i in range(x.size):
        found = np.maximum(found, abs(x[i]))
    return found


def add_each(out, at, x):
    for k in range(at.size):
        out[at[k]] += x[k]


def add_products(out, at, v, x, i):
    for k in range(at.size):
        out[at[k]] += v[k] * x[i[k]]


def add_triples(out, at, v, x, i, y, j):
    for k in range(at.size):
        out[at[k]] += v[k] * x[i[k]] * y[j[k]]


def add_entries(J, k, i, v):
    for a in range(k.size):
        J[k[a], i[a]] += v[a]


def add_weighted_entries(J, k, i, v, x, j):
    for a in range(k.size):
        J[k[a], i[a]] += v[a] * x[j[a]]


def subtract_from_band(A, i, j, v, x, k):
    for a in range(i.size):
        if i[a] >= j[a] or A.top > 0:
            A.flat[j[a] * A.ld + A.top + i[a] - j[a]] -= v[a] * x[k[a]]


# callbacks


@source
def _ask(question, handle, what, t, x, a, b, out):
    with objmode():
        callbacks.QUESTIONS[question](handle, what, t, x, a, b, out)


def custom_force(handle, t, scale, u, out):
    _ask(0, handle, 0, t, scale, u, u, out)


def custom_mean_force(handle, t, u0, u1, out):
    _ask(1, handle, 0, t, 1.0, u0, u1, out)


def custom_load_stiffness(handle, t, scale, u, flat):
    _ask(2, handle, 0, t, scale, u, u, flat)


def custom_joints(handle, what, t, u, v, out):
    _ask(3, handle, what, t, 1.0, u, v, out)


def custom_elements(handle, what, t, factor, a, b, out):
    _ask(4, handle, what, t, factor, a, b, out)


def custom_poses(handle, t, span, poses):
    _ask(5, handle, 0, t, span, poses, poses, poses)


def call_solver(handle, t, u, multipliers, R, phi, du, dm):
    with objmode(done="boolean"):
        done = callbacks.call_solver(handle, t, u, multipliers, R, phi, du, dm)
    return done


def custom_distance(handle, obstacle, t, x, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


def log1p(x):
    return np.log1p(x)


def everywhere(condition):
    return condition
