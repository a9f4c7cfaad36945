"""Moments on sections."""

from typing import NamedTuple

import numpy as np

from ...core import F1, F2, I1, I3, apart, indices, room, source

TINY = 1e-200


class MomentPack(NamedTuple):
    """Moments on sections, whose direction is ``start + c u[dofs]``."""

    dofs: I3  # (moments, 2, k)
    c: F2  # weights, padded with zeros, (moments, k)
    start: F2  # directions in the reference configuration, (moments, 2)
    M: F1  # moments, counterclockwise
    opposite: I1  # number of the opposite moment of a couple, or -1


@source
def moment_direction(moments, k, u):
    """The direction (x, y) of the section of moment k."""
    x, y = moments.start[k, 0], moments.start[k, 1]
    for i in range(moments.c.shape[1]):
        x += moments.c[k, i] * u[moments.dofs[k, 0, i]]
        y += moments.c[k, i] * u[moments.dofs[k, 1, i]]
    return x, y


@apart("moments", MomentPack, F1, F1, F1)
def add_moments(moments, factors, u, f):
    """Add the forces of the moments at u: M times the derivative of the angle."""
    dofs, c, M = moments.dofs, moments.c, moments.M
    for k in range(M.size):
        x, y = moment_direction(moments, k, u)
        size = factors[k] * M[k] / (x * x + y * y)
        for i in range(c.shape[1]):
            f[dofs[k, 0, i]] -= size * y * c[k, i]
            f[dofs[k, 1, i]] += size * x * c[k, i]


@source
def mean_turning(a, b, g):
    """A mean derivative of the angle from e to d, whose work from a to b is the change of angle."""
    # The rows of a, b and g are components of d and e. The angle is a function of ``c = e . d`` and
    # ``s = e x d``. Its discrete gradient by both (Gonzalez 1996), times their derivatives in the
    # middle of the step, has no resultant moment, since both are invariant under common rotations
    # of d and e.
    for e in indices(a.shape[1]):
        c0, s0 = a[2, e] * a[0, e] + a[3, e] * a[1, e], a[2, e] * a[1, e] - a[3, e] * a[0, e]
        c1, s1 = b[2, e] * b[0, e] + b[3, e] * b[1, e], b[2, e] * b[1, e] - b[3, e] * b[0, e]
        dx, dy = 0.5 * (a[0, e] + b[0, e]), 0.5 * (a[1, e] + b[1, e])
        ex, ey = 0.5 * (a[2, e] + b[2, e]), 0.5 * (a[3, e] + b[3, e])
        x0, x1, x2, x3 = (b[0, e] - a[0, e], b[1, e] - a[1, e], b[2, e] - a[2, e],
                          b[3, e] - a[3, e])
        c, s = ex * x0 + ey * x1 + dx * x2 + dy * x3, ex * x1 - ey * x0 + dy * x2 - dx * x3
        cm, sm = 0.5 * (c0 + c1), 0.5 * (s0 + s1)
        size, square = np.maximum(cm * cm + sm * sm, TINY), c * c + s * s
        gc, gs = -sm / size, cm / size
        angle = np.arctan2(c0 * s - s0 * c, c0 * c1 + s0 * s1)
        missing = (angle - gc * c - gs * s) * (square > TINY) / np.maximum(square, TINY)
        gc, gs = gc + missing * c, gs + missing * s
        g[0, e], g[1, e] = gc * ex - gs * ey, gc * ey + gs * ex
        g[2, e], g[3, e] = gc * dx + gs * dy, gc * dy - gs * dx


@apart("moments", MomentPack, F1, F1, F1, F1)
def add_mean_moments(moments, factors, u0, u1, f):
    """Add the mean forces from u0 to u1, whose work is the moments times the rotations."""
    # A couple acts on the angle between its two sections, without resultant moment.
    M, opposite = moments.M, moments.opposite
    a, b, g = room((4, 1)), room((4, 1)), room((4, 1))
    for k in range(M.size):
        other = opposite[k]
        if other < k and other >= 0:
            continue
        a[0, 0], a[1, 0] = moment_direction(moments, k, u0)
        b[0, 0], b[1, 0] = moment_direction(moments, k, u1)
        if other >= 0:
            a[2, 0], a[3, 0] = moment_direction(moments, other, u0)
            b[2, 0], b[3, 0] = moment_direction(moments, other, u1)
        else:
            a[2, 0], a[3, 0] = moments.start[k, 0], moments.start[k, 1]
            b[2, 0], b[3, 0] = a[2, 0], a[3, 0]
        mean_turning(a, b, g)
        size = factors[k] * M[k]
        _add_force(moments, k, size * g[0, 0], size * g[1, 0], f)
        if other >= 0:
            _add_force(moments, other, size * g[2, 0], size * g[3, 0], f)


@source
def _add_force(moments, k, x, y, f):
    for i in range(moments.c.shape[1]):
        f[moments.dofs[k, 0, i]] += moments.c[k, i] * x
        f[moments.dofs[k, 1, i]] += moments.c[k, i] * y


@apart("moments", MomentPack, F1, F1, F1, int)
def add_moment_stiffness(moments, factors, u, flat, ld):
    """Subtract the derivative of the forces from a lower half, at ``flat[j * ld + i - j]``."""
    dofs, c, M = moments.dofs, moments.c, moments.M
    for k in range(M.size):
        x, y = moment_direction(moments, k, u)
        size = factors[k] * M[k] / (x * x + y * y) ** 2
        for i in range(2):
            for j in range(2):
                h = size * ((y * y - x * x) if i != j else 2 * x * y * (1 - 2 * i))
                for a in range(c.shape[1]):
                    row = dofs[k, i, a]
                    for b in range(c.shape[1]):
                        column = dofs[k, j, b]
                        if row >= column:
                            flat[column * ld + row - column] -= h * c[k, a] * c[k, b]
