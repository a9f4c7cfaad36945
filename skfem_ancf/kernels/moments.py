"""Moments that turn with a section."""

from typing import NamedTuple

import numpy as np

from ..source import F1, F2, I3, source


class MomentPack(NamedTuple):
    """Moments on sections.

    Attributes
    ----------
    dofs, c
        Coordinates (moments, 2, k) and weights (moments, k): a section's direction is ``start +
        c u[dofs]``. What is left over has no weight.
    start
        Directions in the stress-free state, (moments, 2).
    M
        Sizes, counterclockwise.
    """

    dofs: I3
    c: F2
    start: F2
    M: F1


@source
def moment_direction(moments, k, u):
    """The direction (x, y) of the section of moment k."""
    x, y = moments.start[k, 0], moments.start[k, 1]
    for i in range(moments.c.shape[1]):
        x += moments.c[k, i] * u[moments.dofs[k, 0, i]]
        y += moments.c[k, i] * u[moments.dofs[k, 1, i]]
    return x, y


@source
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
def add_mean_moments(moments, factors, u0, u1, f):
    """Add the forces whose work from u0 to u1 is the moments times the angles turned.

    The discrete gradient of Gonzalez (1996).
    """
    dofs, c, M = moments.dofs, moments.c, moments.M
    for k in range(M.size):
        x0, y0 = moment_direction(moments, k, u0)
        x1, y1 = moment_direction(moments, k, u1)
        x, y, dx, dy = 0.5 * (x0 + x1), 0.5 * (y0 + y1), x1 - x0, y1 - y0
        size = M[k] / (x * x + y * y)
        fx, fy, step = -size * y, size * x, dx * dx + dy * dy
        if step > 0.0:
            angle = np.arctan2(x0 * dy - y0 * dx, x0 * x1 + y0 * y1)
            missing = (M[k] * angle - fx * dx - fy * dy) / step
            fx, fy = fx + missing * dx, fy + missing * dy
        for i in range(c.shape[1]):
            f[dofs[k, 0, i]] += factors[k] * c[k, i] * fx
            f[dofs[k, 1, i]] += factors[k] * c[k, i] * fy


@source
def add_moment_stiffness(moments, factors, u, flat, ld):
    """Subtract the derivative of the moments' forces from entries (i, j), i >= j, of a band.

    They are at ``flat[j * ld + i - j]``.
    """
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
