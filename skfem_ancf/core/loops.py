"""Loops that replace calls of NumPy, SciPy and Python in compiled code. Each replaces the function
of its name that :func:`skfem_ancf.core.source.primitive` marks."""

import numpy as np

from .callbacks import ask, solved
from .band import LOST, REPEATED, Band, coupling
from .source import F1, apart, source

indices = {1: lambda n: range(n), 2: lambda a, b: range(a, b), 3: lambda a, b, s: range(a, b, s)}


def column(x):
    return x


everywhere = somewhere = column  # a condition is one truth value here


# band matrices


def multiply(A, x, y):
    if A.top > 0:
        multiply_both(A, x, y)
    else:
        multiply_lower(A.flat, A.ld, A.width, x, y)


def factorize(A):
    if A.coupled.size > 0:
        if not coupling(A, A.flat[:0]):
            return False
        if A.coupled[1] > 0:
            return True
    return (exchange(A) if A.top > 0 else factorize_lower(A.flat, A.ld, A.width)) > 0


def solve(A, x):
    if A.coupled.size > 0 and A.coupled[1] > 0:
        coupling(A, x)
    elif A.top > 0:
        solve_exchanged(A, x)
    else:
        solve_lower(A.flat, A.ld, A.width, x)


def solve_many(A, X):
    for k in range(len(X)):
        solve(A, X[k])


# symmetric: four columns at once, since zeros after each column replace entries that it lacks.
# Unsigned indices: Numba then needs no check for negative ones, which prevents vectorisation.

U = np.uint64
I, J, K = U(1), U(2), U(3)


@apart("bands", Band, F1, F1)
def multiply_both(A, x, y):
    n, top = x.size, A.top
    columns = A.flat.reshape(n, A.ld)
    y[:] = 0.0
    for j in range(n):
        left, m = min(A.width, j), min(A.width, n - 1 - j) + 1
        column, out = columns[j][top - left:], y[j - left:]
        for k in range(left + m):
            out[k] += column[k] * x[j]


@apart("band", F1, int, int, F1, F1)
def multiply_lower(A, ld, width, x, y):
    n = x.size
    last = n - n % 4
    y[:] = 0.0
    for j in range(0, last, 4):
        p, q, r, s, t = U(j * ld), U(j * ld + ld), U(j * ld + 2 * ld), U(j * ld + 3 * ld), U(j + 4)
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        e = A[p] * a + A[p + I] * b + A[p + J] * c + A[p + K] * d
        f = A[p + I] * a + A[q] * b + A[q + I] * c + A[q + J] * d
        g = A[p + J] * a + A[q + I] * b + A[r] * c + A[r + I] * d
        h = A[p + K] * a + A[q + J] * b + A[r + I] * c + A[s] * d
        p, q, r, s = p + U(4), q + K, r + J, s + I
        for k in range(U(min(width, n - 4 - j))):
            z = x[t + k]
            e += A[p + k] * z
            f += A[q + k] * z
            g += A[r + k] * z
            h += A[s + k] * z
            y[t + k] += A[p + k] * a + A[q + k] * b + A[r + k] * c + A[s + k] * d
        y[j], y[j + 1], y[j + 2], y[j + 3] = y[j] + e, y[j + 1] + f, y[j + 2] + g, y[j + 3] + h
    for j in range(last, n):
        y[j] += A[j * ld] * x[j]
        for k in range(1, n - j):
            y[j] += A[j * ld + k] * x[j + k]
            y[j + k] += A[j * ld + k] * x[j]


def add_multiple(c, x, y):
    for i in range(y.size):
        y[i] += c * x[i]


@apart("band", F1, int, int, returns=int)
def factorize_lower(A, ld, width):
    n = A.size // ld
    for j in range(0, n, 4):
        m, w, y, z = min(4, n - j), (j + 1) * ld, (j + 2) * ld, (j + 3) * ld
        g = h = v = x = 1.0  # inverse pivots
        for k in range(1, min(width + 4, n - j)):  # subtract from column j + k
            b, size = U((j + k) * ld), U(min(width + 4, n - j) - k)
            p, before = U(j * ld + k), A[b]
            if k >= m and m == 4:
                if k == 4:  # few divisions
                    g, h, v, x = 1 / A[U(j * ld)], 1 / A[U(w)], 1 / A[U(y)], 1 / A[U(z)]
                q, r, s = U(w + k - 1), U(y + k - 2), U(z + k - 3)
                c, d, e, f = A[p] * g, A[q] * h, A[r] * v, A[s] * x
                for i in range(size):
                    A[b + i] -= c * A[p + i] + d * A[q + i] + e * A[r + i] + f * A[s + i]
            else:
                for l in range(min(k, m)):
                    p = U((j + l) * ld + k - l)
                    c = A[p] / A[U((j + l) * ld)]
                    for i in range(size):
                        A[b + i] -= c * A[p + i]
            if not abs(A[b]) > LOST * abs(before):
                return 0
        for l in range(m):
            p = U((j + l) * ld)
            if not 0.0 < abs(A[p]) < np.inf:
                return 0
            c = 1.0 / A[p]
            for i in range(I, U(width + 1)):
                A[p + i] *= c
    return 1


#: Size of a diagonal entry, relative to the largest below it, that serves as a pivot. LAPACK takes
#: the largest; with fewer exchanges the factors are narrower.
PIVOT = 1e-2


@apart("bands", Band, returns=int)
def exchange(A):
    """As LAPACK's gbtf2."""
    ld, top, width = A.ld, A.top, A.width
    n = A.flat.size // ld
    flat, last = A.flat, 0
    for j in range(n):
        at, m, p = U(j * ld + top), U(min(width, n - 1 - j)), U(0)
        most = abs(flat[at]) / PIVOT
        for i in range(I, m + I):
            if abs(flat[at + i]) > most:
                p, most = i, abs(flat[at + i])
        A.pivots[j] = j + p
        if not abs(flat[at + p]) > 0.0 or not abs(flat[at + p]) < np.inf:
            return 0
        last = max(last, min(j + width + p, n - 1))
        if p != 0:
            for c in range(j, last + 1):
                row = U(c * (ld - 1) + top + j)
                flat[row], flat[row + p] = flat[row + p], flat[row]
        inverse = 1.0 / flat[at]
        for i in range(I, m + I):
            flat[at + i] *= inverse
        for c in range(j + 1, last + 1):
            row = U(c * (ld - 1) + top + j)
            x = flat[row]
            for i in range(I, m + I):
                flat[row + i] -= flat[at + i] * x
    return 1


@apart("band", F1, int, int, F1)
def solve_lower(A, ld, width, x):
    solve_columns(A, ld, width, x)


def solve_columns(A, ld, width, x):
    n = x.size
    last = n - n % 4
    for j in range(0, last, 4):
        p, q, r, s, t = U(j * ld), U(j * ld + ld), U(j * ld + 2 * ld), U(j * ld + 3 * ld), U(j + 4)
        a = x[j]
        b = x[j + 1] - A[p + I] * a
        c = x[j + 2] - A[p + J] * a - A[q + I] * b
        d = x[j + 3] - A[p + K] * a - A[q + J] * b - A[r + I] * c
        x[j + 1], x[j + 2], x[j + 3] = b, c, d
        p, q, r, s = p + U(4), q + K, r + J, s + I
        for k in range(U(min(width, n - 4 - j))):
            x[t + k] -= A[p + k] * a + A[q + k] * b + A[r + k] * c + A[s + k] * d
    for j in range(last, n):
        for k in range(1, n - j):
            x[j + k] -= A[j * ld + k] * x[j]
    for j in range(n):
        x[j] /= A[j * ld]
    for j in range(n - 1, last - 1, -1):
        for k in range(1, n - j):
            x[j] -= A[j * ld + k] * x[j + k]
    for j in range(last - 4, -1, -4):
        p, q, r, s, t = U(j * ld), U(j * ld + ld), U(j * ld + 2 * ld), U(j * ld + 3 * ld), U(j + 4)
        f, g, h, i = p + U(4), q + K, r + J, s + I
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        for k in range(U(min(width, n - 4 - j))):
            y = x[t + k]
            a -= A[f + k] * y
            b -= A[g + k] * y
            c -= A[h + k] * y
            d -= A[i + k] * y
        c -= A[r + I] * d
        b -= A[q + I] * c + A[q + J] * d
        a -= A[p + I] * b + A[p + J] * c + A[p + K] * d
        x[j], x[j + 1], x[j + 2], x[j + 3] = a, b, c, d


@apart("bands", Band, F1)
def solve_exchanged(A, x):
    """As LAPACK's gbtrs."""
    flat, ld, top, n, reach = A.flat, A.ld, A.top, x.size, A.width
    for j in range(n):
        p, at, b = A.pivots[j], U(j * ld + top), U(j)
        reach = max(reach, A.width + p - j)  # bandwidth of U
        x[j], x[p] = x[p], x[j]
        xj = x[j]
        for i in range(I, U(min(A.width, n - 1 - j)) + I):
            x[b + i] -= flat[at + i] * xj
    for j in range(n - 1, -1, -1):
        m = min(reach, j)
        at, b = U(j * ld + top - m), U(j - m)
        x[j] /= flat[at + U(m)]
        xj = x[j]
        for i in range(U(m)):
            x[b + i] -= flat[at + i] * xj


def factorize_complex(A, ld, width):
    n, both, turned = A.size // ld, A.view(np.float64), np.empty(2 * width + 2)
    for j in range(n):
        at, m = U(j * ld), U(min(width, n - 1 - j))
        if not 0.0 < abs(A[at]) < np.inf:
            return False
        inverse = 1.0 / A[at]
        for k in range(I, m + I):  # i times the column
            turned[J * k], turned[J * k + I] = -A[at + k].imag, A[at + k].real
        for k in range(I, m + I):  # real and imaginary parts in turn, which LLVM vectorises
            c, b, p, q = A[at + k] * inverse, J * (at + k * U(ld)), J * (at + k), J * k
            x, y = c.real, c.imag
            for i in range(J * (m + I - k)):
                both[b + i] -= x * both[p + i] + y * turned[q + i]
        for k in range(I, m + I):
            A[at + k] *= inverse
    return True


def solve_dependent(S, b):
    """By orthogonal rows, the largest first, with the solution of Bjorck and Paige (1992)."""
    m = rank = b.size
    size, first = np.empty(m), 0.0
    for i in range(m):
        size[i] = np.sqrt(abs(S[i, i]))
        if size[i] == 0.0:
            size[i] = 1.0
    for i in range(m):
        b[i] /= size[i]
        for k in range(m):
            S[i, k] /= size[i] * size[k]
    for j in range(m):
        p, most = j, 0.0
        for i in range(j, m):
            norm = np.sqrt(dot(S[i], S[i]))
            if not norm < np.inf:
                return False
            if norm > most:
                p, most = i, norm
        if j == 0:
            first = most
        if most <= REPEATED * first:
            rank = j
            break
        b[j], b[p] = b[p], b[j]
        b[j] /= most
        for k in range(m):
            S[j, k], S[p, k] = S[p, k], S[j, k]
            S[j, k] /= most
        for i in range(j + 1, m):
            c = dot(S[i], S[j])
            b[i] -= c * b[j]
            add_multiple(-c, S[j], S[i])
    x = np.zeros(m)
    for j in range(rank - 1, -1, -1):
        add_multiple(b[j] - dot(S[j], x), S[j], x)
    for i in range(m):
        b[i] = x[i] / size[i]
    return rank > 0


def subtract_rows(J, x, out):
    for k in range(J.shape[0]):
        for i in range(out.size):
            out[i] -= J[k, i] * x[k]


# sums


def dot(a, b):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


def weighted_square(x, weights):
    out = 0.0
    for i in range(x.size):
        out += weights[i] * x[i] * x[i]
    return out


def smallest(x):
    found = np.inf
    for i in range(x.size):
        found = np.minimum(found, x[i])  # propagates NaN
    return found


def farthest(weights, u, seen):
    total = 0.0
    for row in weights:
        square = 0.0
        for k in range(row.size):
            x, y = row[k] * (u[2 * k] - seen[2 * k]), row[k] * (u[2 * k + 1] - seen[2 * k + 1])
            square = np.maximum(square, x * x + y * y)
        total += np.sqrt(square)
    return total


def largest(x):
    found = 0.0
    for i in range(x.size):
        found = np.maximum(found, abs(x[i]))
    return found


def add_each(out, at, x):
    for k in range(at.size):
        out[at[k]] += x[k]


def vector(x, y):
    return complex(x, y)


def least_each(out, at, x):
    for k in range(at.size):
        out[at[k]] = min(out[at[k]], x[k])


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
def _places(x, k, places):
    """Note address and size of array number k."""
    places[2 * k], places[2 * k + 1] = x.ctypes.data, x.size


def call_custom(callback, handle, what, t, x, a, b, out):
    places = np.empty(6, np.int64)
    _places(a, 0, places)
    _places(b, 1, places)
    _places(out, 2, places)
    ask(callback, handle, what, t, x, places.ctypes.data)
    places[0] = 0  # it has lived until here


def call_solver(handle, t, u, multipliers, R, phi, du, dm):
    places = np.empty(12, np.int64)
    _places(u, 0, places)
    _places(multipliers, 1, places)
    _places(R, 2, places)
    _places(phi, 3, places)
    _places(du, 4, places)
    _places(dm, 5, places)
    done = solved(handle, t, places.ctypes.data) > 0
    places[0] = 0  # it has lived until here
    return done


def custom_distance(handle, obstacle, t, x, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


def log1p(x):
    return np.log1p(x)


def where(condition, x, y):
    return x if condition else y
