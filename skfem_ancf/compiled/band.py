"""Band matrices: the lower half of a symmetric one, entry (i, j) at ``j * ld + i - j``."""

from .jit import inner, jit

LOST = 1e-13  # a pivot that small beside what it came from is round-off


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
def copy(a, b):
    """b = a; the assignment of a slice would bring in code for its errors."""
    for i in range(a.size):
        b[i] = a[i]


@inner
def times_columns(J, x, out):
    """out = J x."""
    for k in range(J.shape[0]):
        s = 0.0
        for i in range(x.size):
            s += J[k, i] * x[i]
        out[k] = s


@inner
def solve_rows(flat, ld, bw, J, free, Y):
    """Y[k] = A^-1 J[k] at free coordinates, with the factors of A."""
    for k in range(J.shape[0]):
        for i in range(free.size):
            Y[k, i] = J[k, i] * free[i]
        solve(flat, ld, bw, Y[k])


@inner
def products(J, Y, S):
    """S = J Y^T."""
    for k in range(J.shape[0]):
        for l in range(Y.shape[0]):
            s = 0.0
            for i in range(J.shape[1]):
                s += J[k, i] * Y[l, i]
            S[k, l] = s


@inner
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
