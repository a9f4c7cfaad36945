"""A border about a band matrix: multipliers, springs, and entries outside of the band.

``[A, J^T; J, 0] [x; l] = [b; c]`` with ``A = K + P^T S P``, of which K is in the band and the rows
of P pick a few coordinates: those held by springs before the band is factorised and let go again,
because a beam that only joints hold has a singular matrix of its own, and those that joints couple
outside of the band. With ``Z = K^-1 [P^T S, J^T]``, by Sherman, Morrison and Woodbury::

    H y = [P K^-1 b; J K^-1 b - c],  H = [1, 0; 0, 0] + [P; J] Z,  x = K^-1 b - Z y

Where joints hold such a beam by directions that fit into the band, as a clamp at an angle does, K
is made stiff along these in place of springs: x is the same, l is less by that stiffness times c.
"""

from typing import NamedTuple

import numpy as np

from ..core.band import (Band, clear, copy, dense_solve, diagonal, dot, factorize, largest,
                         multiply, solve, weighted)
from ..core.source import F1, F2, I1, I2, lanes, source
from ..actions.tables import add_products
from ..core.types import Array


class Border(NamedTuple):
    """Where a scene has what lies outside of its band.

    Attributes
    ----------
    picked, springs, loose
        Coordinates picked; the first of them, so many, are held by springs, of which the last have
        no stiffness of their own.
    inside_at, inside_of, outside_at, outside_of
        Where the second derivatives of joints go: their places in the band and in S, and which
        of :class:`~skfem_ancf.actions.tables.JointTables` they are.
    wide
        1 if sparse factors are used in its place.
    along
        Equations of joints whose directions are made stiff, the first of their coordinates and
        the one behind the last, shape (n, 3).
    """

    picked: I1
    springs: int
    loose: int
    inside_at: I1
    inside_of: I1
    outside_at: I1
    outside_of: I1
    wide: int
    along: I2


class Factors(NamedTuple):
    """A matrix with its border, factorised: the matrix before, its factors, and the border.

    ``scale`` has what makes picked coordinates and multipliers numbers without units, (k + m,),
    ``stiffness`` that of the matrix along directions of joints, (m,).
    Of work arrays ``rest`` and ``weight`` have (N,), ``closing`` and ``more`` (m,), ``y`` and
    ``G`` the size of H.
    """

    before: Band
    after: Band
    J: F2
    S: F2
    Z: F2
    H: F2
    scale: F1
    rest: F1
    weight: F1
    closing: F1
    more: F1
    y: F1
    G: F2
    stiffness: F1


def factors_of(before: Band, after: Band, J: Array, S: Array) -> Factors:
    """Room for the factors of a matrix with its border.

    Parameters
    ----------
    before, after
        The matrix and its factors.
    J, S
        The border, shapes (m, N) and (k, k).
    """
    (m, N), n = J.shape, len(S) + len(J)
    (rest, weight), (closing, more) = np.empty((2, N)), np.empty((2, m))
    return Factors(before, after, J, S, np.zeros((n, N)), np.zeros((n, n)), np.ones(n),
                   rest, weight, closing, more, np.empty(n), np.empty((n, n)), np.zeros(m))


#: No numbers: vectors, a matrix, and integers.
_NONE = np.empty(0), np.empty((0, 0)), np.empty(0, np.int64)


def new_factors(border: Border, A: Band, m: int, N: int) -> Factors:
    """Room for the factors of A with m multipliers; none where there is no border to make.

    Parameters
    ----------
    border, A
        The Border and a band matrix.
    m, N
        Numbers of multipliers and of coordinates.
    """
    x, X, none = _NONE
    if border.wide > 0 or m == 0:
        return Factors(A._replace(flat=x, pivots=none), A, X, X, X, X, x, x, x, x, x, x, X, x)
    before = A._replace(flat=np.empty(A.flat.size), pivots=none)
    k = border.picked.size
    return factors_of(before, A, np.zeros((m, N)), np.zeros((k, k)))


@source
def mean_stiffness(diagonal, sizes):
    """The mean of stiffnesses, each times the square of its coordinate's size; 1 of none."""
    mean = weighted(sizes, sizes, diagonal) / sizes.size
    return mean if mean > 0.0 else 1.0


@source
def add_curvature(joints, border, multipliers, free, sizes, A, f):
    """Add the joints' second derivative and the springs to the band, and to S what is not in it."""
    S = f.S
    flat, size, value = S.reshape(S.size), np.empty(free.size), np.empty(joints.hk.size)
    clear(flat)
    for a in lanes(value.size):
        value[a] = (multipliers[joints.hk[a]] * joints.hv[a] * free[joints.hi[a]]
                    * free[joints.hj[a]])
    add_products(A.flat, border.inside_at, np.ones(border.inside_at.size), value,
                 border.inside_of)
    add_products(flat, border.outside_at, np.ones(border.outside_at.size), value,
                 border.outside_of)
    diagonal(A, size)
    for i in lanes(size.size):
        size[i] = np.abs(size[i]) * free[i]  # what is fixed has 1 there, of no unit
    mean = mean_stiffness(size, sizes)
    for k in range(border.springs):
        at = border.picked[k]
        stiffness = size[at]
        if stiffness == 0.0 or k >= border.springs - border.loose:
            stiffness += mean / (sizes[at] * sizes[at])
        A.flat[at * A.ld + A.top] += stiffness
        S[k, k] = -stiffness
    for k in range(border.along.shape[0]):
        of, first, last = border.along[k, 0], border.along[k, 1], border.along[k, 2]
        f.stiffness[of] = stiffen(A, size, f.J[of], first, last)


@source
def stiffen(A, size, direction, first, last):
    """Make A stiff along a direction as its coordinates, from one to before another, are; how."""
    most = largest(direction[first:last])
    stiffness = 0.0
    for i in range(first, last):
        if direction[i] != 0.0:
            stiffness = max(stiffness, size[i] / (most * most))
    for j in range(first, last):
        for i in range(first if A.top > 0 else j, last):
            A.flat[j * A.ld + A.top + i - j] += stiffness * direction[i] * direction[j]
    return stiffness


@source
def inverse_rows(A, J, free, Y):
    """Y[k] = A^-1 J[k] at free coordinates, with the factors of A."""
    for k in range(J.shape[0]):
        row, out = J[k], Y[k]
        for i in lanes(free.size):
            out[i] = row[i] * free[i]
        solve(A, out)


@source
def factorize_bordered(f, border, free):
    """Factorise what :func:`add_curvature` has completed; False if a pivot is lost.

    ``f.J`` must be zero at fixed coordinates.
    """
    copy(f.after.flat, f.before.flat)
    if not factorize(f.after):
        return False
    join(f, border, free)
    return True


@source
def join(f, border, free):
    """Z, H and the scale of the multipliers, by the factors of the band."""
    J, Z, H, S, scale, A = f.J, f.Z, f.H, f.S, f.scale, f.before
    k, m, N = S.shape[0], J.shape[0], free.size
    for a in range(k):
        row, size = Z[a], abs(A.flat[border.picked[a] * A.ld + A.top])
        scale[a] = np.sqrt(size) if size > 0.0 else 1.0
        clear(row)
        for c in range(k):
            row[border.picked[c]] += S[c, a] / scale[a]
        solve(f.after, row)
    inverse_rows(f.after, J, free, Z[k:])
    for b in range(k, k + m):
        row = Z[b]
        size = dot(J[b - k], row)
        scale[b] = 1.0 / np.sqrt(abs(size)) if size != 0.0 else 1.0
        for i in lanes(N):
            row[i] *= scale[b]
    for b in range(k + m):
        for a in range(k):
            H[a, b] = scale[a] * Z[b, border.picked[a]]
        for a in range(m):
            H[k + a, b] = scale[k + a] * dot(J[a], Z[b])
    for a in range(k):
        H[a, a] += 1.0


@source
def _once(f, border, x, c, dm):
    """Solve in place of x for x and the multipliers; False if H is singular."""
    k, m = f.S.shape[0], c.size
    y, G, scale = f.y, f.G, f.scale
    for a in range(k + m):
        copy(f.H[a], G[a])
    solve(f.after, x)
    for a in range(k):
        y[a] = scale[a] * x[border.picked[a]]
    for b in range(m):
        y[k + b] = scale[k + b] * (dot(f.J[b], x) - c[b])
    if not dense_solve(G, y):
        return False
    for a in range(k + m):
        row = f.Z[a]
        for i in lanes(x.size):
            x[i] -= row[i] * y[a]
    for b in range(m):
        dm[b] = scale[k + b] * y[k + b]
    return True


@source
def solve_bordered(f, border, b, c, x, dm):
    """x and dm with one refinement; returns its size relative to x, or -1 if H is singular.

    0 where all joints are directions that the band is stiff along: its round-off remains that of a
    band.
    """
    N, m, picked = x.size, c.size, border.picked
    r, rc, dl, weight = f.rest, f.closing, f.more, f.weight
    copy(b, x)
    if not _once(f, border, x, c, dm):
        return -1.0
    multiply(f.before, x, r)
    for i in lanes(N):
        r[i] = b[i] - r[i]
    for a in range(picked.size):
        for e in range(picked.size):
            r[picked[a]] -= f.S[a, e] * x[picked[e]]
    for a in range(m):
        row = f.J[a]
        for i in lanes(N):
            r[i] -= row[i] * dm[a]
        rc[a] = c[a] - dot(row, x)
    if not _once(f, border, r, rc, dl):
        return -1.0
    diagonal(f.before, weight)
    for i in lanes(N):
        weight[i] = np.abs(weight[i])
    size, error = weighted(x, x, weight), weighted(r, r, weight)
    for i in lanes(N):
        x[i] += r[i]
    for a in range(m):
        dm[a] += dl[a] + f.stiffness[a] * c[a]
    if picked.size == 0 and border.along.shape[0] == m:
        return 0.0
    return np.sqrt(error / size) if size > 0.0 else 0.0
