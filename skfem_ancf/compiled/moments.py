"""Moments that turn with a section.

Given as coordinates (k, 2, c), weights (k, c), directions at the start (k, 2) and sizes (k,).
"""

import math

from .jit import inner


@inner
def _direction(moments, k, u):
    dofs, c, start = moments[0], moments[1], moments[2]
    x, y = start[k, 0], start[k, 1]
    for i in range(c.shape[1]):
        x += c[k, i] * u[dofs[k, 0, i]]
        y += c[k, i] * u[dofs[k, 1, i]]
    return x, y


@inner
def add_moments(moments, factors, u, f):
    """Add the forces of the moments at u."""
    dofs, c, M = moments[0], moments[1], moments[3]
    for k in range(M.size):
        x, y = _direction(moments, k, u)
        size = factors[k] * M[k] / (x * x + y * y)
        for i in range(c.shape[1]):
            f[dofs[k, 0, i]] -= size * y * c[k, i]
            f[dofs[k, 1, i]] += size * x * c[k, i]


@inner
def add_mean_moments(moments, factors, u0, u1, f):
    """Add the forces whose work from u0 to u1 is the moments times the angles turned."""
    dofs, c, M = moments[0], moments[1], moments[3]
    for k in range(M.size):
        x0, y0 = _direction(moments, k, u0)
        x1, y1 = _direction(moments, k, u1)
        x, y, dx, dy = 0.5 * (x0 + x1), 0.5 * (y0 + y1), x1 - x0, y1 - y0
        size = M[k] / (x * x + y * y)
        fx, fy, step = -size * y, size * x, dx * dx + dy * dy
        if step > 0.0:
            angle = math.atan2(x0 * dy - y0 * dx, x0 * x1 + y0 * y1)
            missing = (M[k] * angle - fx * dx - fy * dy) / step
            fx, fy = fx + missing * dx, fy + missing * dy
        for i in range(c.shape[1]):
            f[dofs[k, 0, i]] += factors[k] * c[k, i] * fx
            f[dofs[k, 1, i]] += factors[k] * c[k, i] * fy


@inner
def add_moment_stiffness(moments, factors, u, flat, ld):
    """Subtract the derivative of the moments' forces from the band."""
    dofs, c, M = moments[0], moments[1], moments[3]
    for k in range(M.size):
        x, y = _direction(moments, k, u)
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
