"""Factors of band matrices and of small dense ones: compiled, for what LAPACK does elsewhere."""

import numpy as np

from ...core.band import LOST, REPEATED, SPARE
from .twin import jit
from .vectors import eliminate, products, scale, subtract, subtract_columns


@jit
def multiply(A, x, y):
    """y = A x."""
    n, flat, ld, top, width = x.size, A.flat, A.ld, A.top, A.width
    for i in range(n):
        y[i] = 0.0
    if top > 0:
        for j in range(n):
            up = min(width, j)
            subtract(y, j - up, flat, (top + j * ld - up,), up + 1 + min(width, n - 1 - j),
                     (-x[j],))
        return
    last = n - n % 4
    for j in range(0, last, 4):
        a, m = j * ld, min(width, n - 4 - j)
        b, c, d = a + ld, a + 2 * ld, a + 3 * ld
        e, f, g, h = x[j], x[j + 1], x[j + 2], x[j + 3]
        p, q, r, s = products(x, j + 4, m, flat, (a + 4, b + 3, c + 2, d + 1))
        y[j] += p + flat[a] * e + flat[a + 1] * f + flat[a + 2] * g + flat[a + 3] * h
        y[j + 1] += q + flat[a + 1] * e + flat[b] * f + flat[b + 1] * g + flat[b + 2] * h
        y[j + 2] += r + flat[a + 2] * e + flat[b + 1] * f + flat[c] * g + flat[c + 1] * h
        y[j + 3] += s + flat[a + 3] * e + flat[b + 2] * f + flat[c + 1] * g + flat[d] * h
        subtract(y, j + 4, flat, (a + 4, b + 3, c + 2, d + 1), m, (-e, -f, -g, -h))
    for j in range(last, n):
        y[j] += flat[j * ld] * x[j]
        for k in range(1, n - j):
            y[j] += flat[j * ld + k] * x[j + k]
            y[j + k] += flat[j * ld + k] * x[j]


@jit
def add_multiple(c, x, y):
    """y += c x."""
    subtract(y, 0, x, (0,), x.size, (-c,))


@jit
def factorize(A):
    """L D L^T, L D R^T, or L U with exchanges of rows, in place; False if a pivot is lost.

    Four columns at a time. The places between columns, which are zero, let vectors end behind them.
    """
    if A.top > 0:
        return _exchanging(A)
    if A.top < 0:
        return _all_columns(A, A.ld // 2)
    return _all_columns(A, None)


@jit
def _all_columns(A, back):
    """Factors of a lower half, or of both, the other one ``back`` behind."""
    flat, ld, n = A.flat, A.ld, A.flat.size // A.ld
    last = n - n % 4
    for j in range(0, last, 4):
        if not _four_columns(flat, back, ld, A.width, j, min(A.width + 3, n - 1 - j)):
            return False
    for j in range(last, n):
        at = j * ld
        inverse = _inverse(flat[at], flat[at])
        for k in range(1, n - j):
            other = at + k * ld
            before = flat[other]
            eliminate(flat, back, other, n - j - k, (at + k,), (inverse,))
            if abs(flat[other]) < LOST * abs(before):
                return False
        if inverse == 0.0:
            return False
        scale(flat, back, at + 1, n - 1 - j, inverse)
    return True


@jit
def _four_columns(flat, back, ld, width, j, last):
    """Eliminate columns j to j + 3, which reach to row j + last; False if a pivot is lost."""
    a = j * ld
    b, c, d = a + ld, a + 2 * ld, a + 3 * ld
    ia, before = _inverse(flat[a], flat[a]), flat[b]
    eliminate(flat, back, b, width, (a + 1,), (ia,))
    ib, before = _inverse(flat[b], before), flat[c]
    eliminate(flat, back, c, width, (a + 2, b + 1), (ia, ib))
    ic, before = _inverse(flat[c], before), flat[d]
    eliminate(flat, back, d, width, (a + 3, b + 2, c + 1), (ia, ib, ic))
    id_ = _inverse(flat[d], before)
    if ia == 0.0 or ib == 0.0 or ic == 0.0 or id_ == 0.0:
        return False
    for k in range(4, last + 1):
        to = a + k * ld
        before = flat[to]
        eliminate(flat, back, to, last + 1 - k, (a + k, b + k - 1, c + k - 2, d + k - 3),
              (ia, ib, ic, id_))
        if abs(flat[to]) < LOST * abs(before):
            return False
    scale(flat, back, a + 1, width, ia)
    scale(flat, back, b + 1, width, ib)
    scale(flat, back, c + 1, width, ic)
    scale(flat, back, d + 1, width, id_)
    return True


@jit
def _inverse(pivot, before):
    """1 / pivot; 0 if it is lost: round-off of what it came from, or not finite."""
    if abs(pivot) > LOST * abs(before) and abs(pivot) < np.inf:
        return 1.0 / pivot
    return 0.0


@jit
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
                subtract(flat, row + 1, flat, (at + 1,), m, (x,))
    return True


@jit
def solve(A, x):
    """Solve in place with the factors, of a lower half four columns at a time."""
    if A.top > 0:
        _solve_exchanged(A, x)
        return
    flat, ld, n = A.flat, A.ld, x.size
    last = n - n % 4
    for j in range(0, last, 4):
        a, m = j * ld, min(A.width, n - 4 - j)
        b, c, d = a + ld, a + 2 * ld, a + 3 * ld
        x[j + 1] -= flat[a + 1] * x[j]
        x[j + 2] -= flat[a + 2] * x[j] + flat[b + 1] * x[j + 1]
        x[j + 3] -= flat[a + 3] * x[j] + flat[b + 2] * x[j + 1] + flat[c + 1] * x[j + 2]
        subtract(x, j + 4, flat, (a + 4, b + 3, c + 2, d + 1), m,
                 (x[j], x[j + 1], x[j + 2], x[j + 3]))
    for j in range(last, n):
        for k in range(1, n - j):
            x[j + k] -= flat[j * ld + k] * x[j]
    h = ld // 2 if A.top < 0 else 0
    for j in range(n - 1, last - 1, -1):
        x[j] /= flat[j * ld]
        for k in range(1, n - j):
            x[j] -= flat[j * ld + h + k] * x[j + k]
    for j in range(last - 4, -1, -4):
        a, m = j * ld, min(A.width, n - 4 - j)
        b, c, d = a + ld, a + 2 * ld, a + 3 * ld
        p, q, r, s = products(x, j + 4, m, flat, (a + h + 4, b + h + 3, c + h + 2, d + h + 1))
        s = x[j + 3] / flat[d] - s
        r = x[j + 2] / flat[c] - r - flat[c + h + 1] * s
        q = x[j + 1] / flat[b] - q - flat[b + h + 1] * r - flat[b + h + 2] * s
        p = x[j] / flat[a] - p - flat[a + h + 1] * q - flat[a + h + 2] * r - flat[a + h + 3] * s
        x[j], x[j + 1], x[j + 2], x[j + 3] = p, q, r, s


@jit
def _solve_exchanged(A, x):
    """As LAPACK's gbtrs."""
    flat, ld, top, n, reach = A.flat, A.ld, A.top, x.size, A.width
    for j in range(n):
        p = A.pivots[j]
        reach = max(reach, A.width + p - j)  # of U: as far as rows were exchanged
        x[j], x[p] = x[p], x[j]
        subtract(x, j + 1, flat, (j * ld + top + 1,), min(A.width, n - 1 - j), (x[j],))
    for j in range(n - 1, -1, -1):
        at = j * ld + top
        x[j] /= flat[at]
        xj = x[j]
        for i in range(j - min(reach, j), j):
            x[i] -= flat[at - j + i] * xj


@jit
def factorize_complex(A, width):
    """L D L^T of a complex symmetric band, in place; False if there is none."""
    ld, half = width + 1 + SPARE, A.size // 2
    n = half // ld
    for j in range(n):
        at = j * ld
        a, b = A[at], A[half + at]
        size = a * a + b * b
        if not size > 0.0 or not size < np.inf:
            return False
        last = at + min(width, n - 1 - j)
        for re in range(at + 1, last + 1):
            x, y, im, to = A[re], A[half + re], half + re, at + (re - at) * ld
            c, d = (x * a + y * b) / size, (y * a - x * b) / size
            subtract_columns(A, to, last + 1 - re, (re, im), (c, -d))
            subtract_columns(A, half + to, last + 1 - re, (im, re), (c, d))
        for re in range(at + 1, last + 1):
            x, y = A[re], A[half + re]
            A[re], A[half + re] = (x * a + y * b) / size, (y * a - x * b) / size
    return True


@jit
def solve_complex(A, width, x, y):
    """Solve in place with the factors; x + i y is (n,)."""
    n, half = x.size, A.size // 2
    ld = half // n
    for j in range(n):
        m, re, im = min(width, n - 1 - j), j * ld + 1, half + j * ld + 1
        subtract(x, j + 1, A, (re, im), m, (x[j], -y[j]))
        subtract(y, j + 1, A, (im, re), m, (x[j], y[j]))
    for j in range(n - 1, -1, -1):
        m, re, im = min(width, n - 1 - j), j * ld, half + j * ld
        a, b, c, d = A[re], A[im], x[j], y[j]
        size = a * a + b * b
        p, q = products(x, j + 1, m, A, (re + 1, im + 1))
        r, s = products(y, j + 1, m, A, (re + 1, im + 1))
        x[j], y[j] = (c * a + d * b) / size - p + s, (d * a - c * b) / size - q - r


@jit
def dense_solve(A, b):
    """Solve in place, by elimination with pivots; False if A is singular."""
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
        for i in range(j + 1, n):
            c = A[i, j] / A[j, j]
            if c != 0.0:
                for k in range(j, n):
                    A[i, k] -= c * A[j, k]
                b[i] -= c * b[j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            b[j] -= A[j, k] * b[k]
        b[j] /= A[j, j]
    return True


@jit
def solve_dependent(S, b):
    """Solve in place of b, a vector, equations of which some may repeat others."""
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
        for i in range(j + 1, m):
            c = S[i, j] / S[j, j]
            if c != 0.0:
                for k in range(j, m):
                    S[i, k] -= c * S[j, k]
                b[i] -= c * b[j]
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


@jit
def subtract_rows(J, x, out):
    """out -= J^T x."""
    for k in range(J.shape[0]):
        for i in range(out.size):
            out[i] -= J[k, i] * x[k]


@jit
def solve_joined(A, J, J1, free, anew, Y, S, b, x):
    """Change x by multiples of the rows of ``Y = J A^-1`` so that ``J1 x`` becomes what -b was."""
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
