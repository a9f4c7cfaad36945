"""The gap between points of surfaces and facets, and its derivatives.

A point of a surface is ``x = r + i s t / |t|``, with the place r and the slope t of its own facet
and its signed offset s. Its gap from the facet with the curve c and the slope T is

    g = side Im(conj(T) (x - c)) / |T| - offset

where c is the closest point: ``Re(conj(T) (x - c)) = 0``. All of r, t, c, T are linear in the
degrees of freedom. Plane vectors v are complex numbers; a derivative by v is the number d with the
change ``Re(conj(d) dv)``.
"""

from __future__ import annotations

from math import perm
from typing import Any, NamedTuple

import numpy as np

from ...core import Array
from .facets import Facets

#: Iterations of the projection, its largest step along a facet, and how far it may leave it.
PROJECT, FAR, LEFT = 12, 1.0, 1.5
#: A point is on a facet if its projection leaves it by less, so that round-off does not decide
#: about points on edges, as of equal rods that collide.
EDGE = 0.02


class Pairs(NamedTuple):
    """Points p and facets e at zeta: weights of r, t, c, T, (n, B), and their constant parts."""

    p: Array
    e: Array
    zeta: Array
    dofs: Array  # of the point and of the facet, (n, 2 B)
    weights: tuple[Array, ...]
    starts: tuple[Array, ...]
    shift: Array  # signed offset of the point
    side: Array
    offset: Array

    def vectors(self, z: Array) -> tuple[Array, ...]:
        """r, t, c and T at displacements z, (n,) each."""
        B = self.weights[0].shape[1]
        both = z[self.dofs[:, :B]], z[self.dofs[:, B:]]
        return tuple(start + np.einsum("nb,nb->n", w, both[k // 2]) for k, (start, w) in enumerate(
            zip(self.starts, self.weights)))

    def rows(self, by_r: Any, by_t: Any, by_c: Any, by_T: Any) -> Array:
        """Derivatives by the degrees of freedom (n, 2 B) from those by r, t, c, T, (n,) each."""
        N, D, C, T = (np.conj(w) for w in self.weights)
        own, other = ((_times(a, M) + _times(b, L)) for a, M, b, L in (
            (by_r, N, by_t, D), (by_c, C, by_T, T)))
        return np.concatenate([own, other], axis=1)


def _times(c, w):
    return np.reshape(c, (-1, 1)) * w


def dot(a: Array, b: Array) -> Array:
    return np.real(np.conj(a) * b)


def cross(a: Array, b: Array) -> Array:
    return np.imag(np.conj(a) * b)


def horner(c: Array, zeta: Array) -> Any:
    """Polynomials with coefficients c (k, n) at zeta (n,); 0 for none."""
    out = 0.0 * zeta
    for row in c[::-1]:
        out = out * zeta + row
    return out


def powers(zeta: Array, n: int, order: int) -> Array:
    """A derivative of the powers 0 to n - 1 of zeta, (len(zeta), n)."""
    out = np.zeros((len(zeta), n))
    for k in range(order, n):
        out[:, k] = zeta ** (k - order) * perm(k, order)
    return out


class Surfaces:
    """The facets of a scene, with the weights of the points of their surfaces."""

    def __init__(self, facets: Facets) -> None:
        self.facets = f = facets
        self.points = [self.curve(f.of, f.zeta, order) for order in (0, 1)]
        self.shift = (f.sides * f.offsets)[f.of]
        self.dofs = f.dofs[f.of]

    def curve(self, e: Array, zeta: Array, order: int) -> tuple[Array, Array]:
        """Weights (n, B) and constant part (n,) of a derivative of facets by zeta."""
        V = powers(zeta, self.facets.starts.shape[1], order)
        return (np.einsum("nbk,nk->nb", self.facets.weights[e], V),
                np.einsum("nk,nk->n", self.facets.starts[e], V))

    def along(self, e: Array, zeta: Array, order: int, z: Array) -> Array:
        """A derivative of facets by zeta at displacements z, (n,)."""
        weights, start = self.curve(e, zeta, order)
        return start + np.einsum("nb,nb->n", weights, z[self.facets.dofs[e]])

    def outside(self, z: Array) -> tuple[Array, Array]:
        """Points of the surfaces and their outer normals, (P,) each."""
        r, t = (start + np.einsum("nb,nb->n", w, z[self.dofs]) for w, start in self.points)
        n = 1j * t / np.abs(t)
        return r + self.shift * n, self.facets.sides[self.facets.of] * n

    def project(self, x: Array, e: Array, zeta: Array, z: Array) -> tuple[Array, Array]:
        """The closest point of facets e to places x, from a guess zeta; True where it is there."""
        f, zeta = self.facets, zeta.copy()
        curve = (f.starts[e] + np.einsum("nbk,nb->nk", f.weights[e], z[f.dofs[e]])).T
        slope = curve[1:] * np.arange(1.0, len(curve))[:, None]
        bends = slope[1:] * np.arange(1.0, len(slope))[:, None]
        for _ in range(PROJECT):
            d, T, A = (horner(y, zeta) for y in (curve, slope, bends))
            d, square = x - d, np.abs(T) ** 2
            bend = square - dot(A, d)
            step = np.clip(dot(T, d) / np.where(bend > 0.1 * square, bend, square), -FAR, FAR)
            new = np.clip(zeta + step, -LEFT, LEFT)
            still, zeta = np.abs(new - zeta), new
            if np.max(still, initial=0.0) < 1e-14:
                break
        return zeta, (np.abs(step) < 1e-9) & (np.abs(zeta) <= 1.0 + EDGE)

    def pairs(self, p: Array, e: Array, zeta: Array) -> Pairs:
        """Pairs of points and facets."""
        f = self.facets
        target = [self.curve(e, zeta, order) for order in (0, 1)]
        (weights, starts) = zip(*((w[p], start[p]) for w, start in self.points), *target)
        return Pairs(p, e, zeta, np.concatenate([self.dofs[p], f.dofs[e]], axis=1), weights, starts,
                     self.shift[p], f.sides[e], f.offsets[e])


def gaps(pairs: Pairs, z: Array) -> Array:
    """The gap of pairs, (n,)."""
    r, t, c, T = pairs.vectors(z)
    x = r + 1j * pairs.shift * t / np.abs(t)
    return pairs.side * cross(T, x - c) / np.abs(T) - pairs.offset


def mean_slope(pairs: Pairs, z0: Array, z1: Array) -> Array:
    """Mean derivative (n, 2 B) of the gap between two states: its product with the change of the
    degrees of freedom is the change of the gap. The gap is a function of the products of r - c, t
    and T, which do not change with rigid motions: differences of products are exact with means of
    the factors, so a force along the mean derivative keeps both momenta. For equal states it is the
    derivative."""
    (r0, t0, c0, T0), (r1, t1, c1, T1) = pairs.vectors(z0), pairs.vectors(z1)
    rho0, rho1, side, s = r0 - c0, r1 - c1, pairs.side, pairs.shift
    rho, t, T = 0.5 * (rho0 + rho1), 0.5 * (t0 + t1), 0.5 * (T0 + T1)
    m0, m1, M0, M1 = (1.0 / np.abs(x) for x in (t0, t1, T0, T1))
    b0, b1 = dot(T0, t0), dot(T1, t1)
    m, M, b = 0.5 * (m0 + m1), 0.5 * (M0 + M1), 0.5 * (b0 + b1)
    a = 0.5 * (cross(T0, rho0) + s * b0 * m0 + cross(T1, rho1) + s * b1 * m1)
    of_t, of_T = (-2.0 * x * x * y * y / (x + y) for x, y in ((m0, m1), (M0, M1)))
    by_r = side * M * 1j * T
    by_t = side * M * s * (m * T + b * of_t * t)
    by_T = side * (M * (s * m * t - 1j * rho) + a * of_T * T)
    return pairs.rows(by_r, by_t, -by_r, by_T)


def slip_row(pairs: Pairs, z: Array) -> Array:
    """Derivative (n, 2 B) of the place of the point along the facet, ``conj(T) (x - c) / |T|``."""
    r, t, c, T = pairs.vectors(z)
    unit = t / np.abs(t)
    d, way = r + 1j * pairs.shift * unit - c, T / np.abs(T)
    turn = -1j * pairs.shift / np.abs(t) * dot(way, unit) * unit
    return pairs.rows(way, turn, -way, d / np.abs(T))


def curvature(pairs: Pairs, bend: Array, z: Array) -> Array:
    """Second derivative (n, 4 B, 4 B) of the gap; ``bend`` (n,) is c''."""
    r, t, c, T = pairs.vectors(z)
    size, Size, s = np.abs(t), np.abs(T), pairs.shift
    unit, n = t / size, pairs.side * 1j * T / Size
    depth = dot(n, r + 1j * s * unit - c)
    square, along = Size**2, dot(n, bend)
    turns = _real(pairs.rows(0.0 * r, 0.0 * t, 0.0 * c, n))
    moves = _real(slip_row(pairs, z)) * Size[:, None] / (square - depth * along)[:, None]
    m = turns + along[:, None] * moves
    H = _outer(depth / square, m, m) - _outer(along, moves, moves)
    both = _outer(1.0 + 0.0 * along, turns, moves)
    H -= both + both.transpose(0, 2, 1)
    if np.any(s):
        zero = 0.0 * r
        theta, stretch = (_real(pairs.rows(zero, k * t / size**2, zero, zero)) for k in (1j, 1.0))
        both = _outer(s * dot(n, unit), theta, stretch)
        H += both + both.transpose(0, 2, 1) - _outer(s * dot(n, 1j * unit), theta, theta)
    return H


def _real(rows):
    """Rows of the single degrees of freedom, (n, 4 B)."""
    return np.ascontiguousarray(rows).view(float)


def _outer(c, a, b):
    return (c[:, None] * a)[:, :, None] * b[:, None]
