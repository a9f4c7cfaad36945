"""Surface points of beams and their gap, the signed distance from an obstacle. A surface point is
``X = x + c n(s)``: a point x of the body, and for cables the normal n of the slope s of the axis at
a distance c. The gap is negative inside the obstacle; its gradient is the normal at the closest
point."""

from typing import NamedTuple

import numpy as np

from ...core import C1, F1, F2, apart, custom_distance, indices, source
from .points import SHORT, dot, scaled, size, turned, vector
from .tables import CUSTOM, PAIR, TINY

#: Number of parameters of a circle.
DISC = 5


class Placed(NamedTuple):
    """Points on the axis, slopes there, and surface points, (n,), with their gaps."""

    x: C1
    t: C1
    surface: C1
    gap: F1


@source
def placed(pair, u, factor, at):
    """Positions and slopes of points: factor times the reference ones plus displacements."""
    n, z = at.size, u.view(np.complex128)
    x, t, start = np.empty(n, np.complex128), np.empty(n, np.complex128), pair.starts
    for i in indices(n):
        m = at[i]
        x[i] = scaled(factor, vector(start[0, m], start[1, m]))
        t[i] = scaled(factor, vector(start[2, m], start[3, m]))
    for k in range(pair.weights.shape[0]):
        for i in indices(n):
            x[i] += scaled(pair.weights[k, at[i]], z[pair.dofs[k, at[i]]])
    for k in range(pair.slopes.shape[0]):
        for i in indices(n):
            t[i] += scaled(pair.slopes[k, at[i]], z[pair.dofs[k, at[i]]])
    return x, t


@apart("contacts", PAIR, F1, float, F2, F1)
def middles(pair, u, factor, x, radius):
    """Positions of element middles (2, n), and bounds of the distance of their points."""
    # Reference positions are multiplied by ``factor``.
    n, pairs, z = x.shape[1], pair.dofs.shape[0], u.view(np.complex128)
    m = pair.areas.size // n
    first, p, q = pair.dofs[0, ::m], pair.middles[0], pair.middles[1]
    for e in indices(n):
        x[0, e], x[1, e], radius[e] = factor * p[e], factor * q[e], pair.law.radius
    for k in range(pairs):
        p, q, same = pair.middles[2 + 2 * k], pair.middles[3 + 2 * k], 1.0 * (k == pairs // 2)
        dofs = pair.dofs[k, ::m]
        for e in indices(n):
            a = z[dofs[e]]
            x[0, e] += p[e] * a.real
            x[1, e] += p[e] * a.imag
            # both places of an element together are a translation
            radius[e] += q[e] * size(a - scaled(same, z[first[e]]))


@source
def outside(x, t, offset):
    """Surface points beside points x of an axis with the slope t."""
    return x + scaled(offset / np.sqrt(np.maximum(dot(t, t), SHORT)), turned(t))


@source
def carried(q, p, x):
    """Points that move with an obstacle from pose p to pose q."""
    # x + (turn - 1) (x - pivot): a pivot far away adds no round-off
    cos, sin = q[2] * p[2] + q[3] * p[3] - 1.0, q[3] * p[2] - q[2] * p[3]
    a, b = x.real - p[0] - p[4], x.imag - p[1] - p[5]
    return x + vector(q[0] - p[0] + cos * a - sin * b, q[1] - p[1] + sin * a + cos * b)


@apart("contacts", PAIR, int, bool, F2, F2)
def distances(pair, which, whole, x, out):
    """Gap, its gradient and, if ``whole``, second derivatives xx, xy, yy at points x, (6, n)."""
    pose, y, side = pair.poses[which], np.empty(x.shape), pair.law.side
    cos, sin = pose[2], pose[3]
    for i in indices(x.shape[1]):
        p, q = x[0, i] - pose[0], x[1, i] - pose[1]
        a, b = p - pose[4], q - pose[5]
        y[0, i], y[1, i] = p + (cos - 1.0) * a + sin * b, q + (cos - 1.0) * b - sin * a
    if pair.kind == CUSTOM:
        custom_distance(pair.custom, pair.obstacle, pose[9], y, out)
    else:
        outline(pair.shape, whole, y, out)
    for i in indices(x.shape[1]):
        out[0, i] *= side
    if not whole:
        return
    for i in indices(x.shape[1]):
        a, b = side * out[1, i], side * out[2, i]
        p, q, r = side * out[3, i], side * out[4, i], side * out[5, i]
        out[1, i], out[2, i] = cos * a - sin * b, sin * a + cos * b
        c, d = 0.5 * (p + r), 0.5 * (p - r)
        e, f = (cos * cos - sin * sin) * d - 2.0 * cos * sin * q, 2.0 * cos * sin * d + (
            cos * cos - sin * sin) * q
        out[3, i], out[4, i], out[5, i] = c + e, f, c - e


@source
def disc(shape, whole, y, out):
    """Gap of a circle, from its radius and a point of its surface with the normal there."""
    # The difference of squares is zero at that point, so that a circle far larger than the scene
    # has gaps without the round-off of its radius.
    radius, px, py, nx, ny = shape[0], shape[1], shape[2], shape[3], shape[4]
    for i in indices(y.shape[1]):
        a, b = y[0, i] - px, y[1, i] - py
        gx, gy = a + radius * nx, b + radius * ny
        size = np.maximum(np.sqrt(gx * gx + gy * gy), TINY)
        out[0, i] = (a * a + b * b + 2.0 * radius * (nx * a + ny * b)) / (size + radius)
        if whole:
            gx, gy = gx / size, gy / size
            out[1, i], out[2, i] = gx, gy
            out[3, i], out[4, i], out[5, i] = gy * gy / size, -gx * gy / size, gx * gx / size


@apart("contacts", F1, bool, F2, F2)
def outline(shape, whole, y, out):
    """Closest point projection on a polygon with rounded corners."""
    # Parameters of the shape: radius of the corners, relative ends of the edges, then for each
    # corner: position, vector to the next one, 1 or -1 for convex or not. The surface is a line
    # near an edge, a circle near a corner. A circle alone has five parameters, see :func:`disc`.
    if shape.size == DISC:
        disc(shape, whole, y, out)
        return
    radius, low, high = shape[0], shape[1], shape[2]
    n, best = (shape.size - 3) // 5, np.empty(y.shape[1])
    for i in indices(y.shape[1]):
        best[i] = 1e300
    for c in range(6 if whole else 1):
        for i in indices(y.shape[1]):
            out[c, i] = 0.0
    for k in range(n):
        p, after = shape[3 + 5 * k:8 + 5 * k], shape[7 + 5 * ((k + 1) % n)]
        px, py, before = p[0], p[1], p[4]
        ex, ey = p[2], p[3]
        square = np.maximum(ex * ex + ey * ey, TINY)
        nx, ny = ey / np.sqrt(square), -ex / np.sqrt(square)
        for i in indices(y.shape[1]):
            a, b = y[0, i] - px, y[1, i] - py
            s = np.minimum(np.maximum((a * ex + b * ey) / square, low), high)
            c, d = a - s * ex, b - s * ey
            far = c * c + d * d
            new = 1.0 * (far < best[i])
            best[i] = np.minimum(best[i], far)
            inner = 1.0 * (s > low) * (s < high)
            corner = (1.0 - inner) * (before * (s < 0.5) + after * (s >= 0.5))
            size = np.maximum(np.sqrt(far), TINY)
            out[0, i] += new * (inner * (nx * a + ny * b) + corner * size - radius - out[0, i])
            if whole:
                bend = corner / size
                gx, gy = inner * nx + bend * c, inner * ny + bend * d
                out[1, i] += new * (gx - out[1, i])
                out[2, i] += new * (gy - out[2, i])
                out[3, i] += new * (bend * gy * gy - out[3, i])
                out[4, i] -= new * (bend * gx * gy + out[4, i])
                out[5, i] += new * (bend * gx * gx - out[5, i])
