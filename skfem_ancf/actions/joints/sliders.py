"""Sliders: a point on a line, a circle, the axis of a beam, or a line of a rigid body."""

from collections.abc import Iterable
from math import factorial, floor
from typing import Any, NamedTuple

import numpy as np

from ...beam import Beam, Layout, RigidBody, WhichBeam, WhichMember, select_beam
from ...core import (Array, ArrayLike, InputError, array_cache, hermite_basis, refuse,
                     require_direction, require_finite, require_flag, require_label,
                     require_positive)
from ...mesh.mapping import cross, turned
from ..places import GROUND, Vector, is_ground, named_place, point, section
from ..symbols import Symbol, tangent_at
from .base import ComposedJoint, Equation, Joint, aligned, angle_to, distant, rotation


class OnLine(ComposedJoint):
    """n . (r - p) = 0: a material point slides on a straight line.

    Parameters
    ----------
    at
        The material point (x, y) in the reference configuration.
    direction
        Direction of the line, shape (2,).
    through
        A point of the line, shape (2,); by default the material point's reference position.
    """

    equations = ("force normal to the line",)

    def __init__(self, at: ArrayLike, direction: ArrayLike, beam: WhichBeam = None,
                 through: ArrayLike | None = None, name: str | None = None) -> None:
        d = require_direction("direction", direction)
        self.normal = np.array([-d[1], d[0]]) / np.hypot(*d)
        self.through = None if through is None else require_finite("through", through, (2,))
        self.beam, self.at, self.name = beam, at, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        r = point(layout, self.beam, self.at)
        through = r.start if self.through is None else self.through
        self.parts = [Equation((r - Vector(through), self.normal))]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = point(layout, self.beam, self.at)
        return (_slider(at, self.normal),)


class OnCircle(ComposedJoint):
    """``(|r - c|^2 - R^2) / (2 R) = 0``: a material point slides on a circle.

    Parameters
    ----------
    at
        The material point (x, y) in the reference configuration.
    center
        Centre of the circle, shape (2,).
    radius
        Its radius; by default the distance of the point in the reference configuration.
    """

    equations = ("force away from the centre",)
    constant = False

    def __init__(self, at: ArrayLike, center: ArrayLike, beam: WhichBeam = None,
                 radius: float | None = None, name: str | None = None) -> None:
        self.center = require_finite("center", center, (2,))
        self.radius = None if radius is None else require_positive("radius", radius)
        self.beam, self.at, self.name = beam, at, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        d = point(layout, self.beam, self.at) - Vector(self.center)
        distance = np.hypot(*d.start)
        R = self.radius or require_positive("the distance of the point from the centre", distance)
        refuse(R < 1e-9 * distance, "radius = {!r} is negligible against the distance of the point "
               "from the centre", R)
        self.parts = [distant(d, R)]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = point(layout, self.beam, self.at)
        return (_slider(at, at.start - self.center),)


def _slider(at: Vector, normal: Array) -> Symbol:
    """The symbol at a point that slides across a normal (2,)."""
    x, y = normal / np.hypot(*normal)
    return Symbol("slider", (at,), (np.array([-y, x]),))


# the axis of a beam as a curve, and the closest point on it

class Axis:
    """The axis of a beam, a polynomial of s in each element; ``first`` is the beam's first DOF."""

    def __init__(self, beam: Beam, first: int) -> None:
        self.beam, self.first, degree = beam, first, beam.element.axis_degree
        # DOFs of the axis in the order of the Hermite functions
        along = np.array([-1 if across else a for _, a, across in beam.element.functionals])
        m, nb = (degree + 1) // 2, len(along)
        one = np.array([int(np.flatnonzero(along == k)[0]) for k in range(m)])
        used = np.concatenate([one, nb + one])
        # coefficients of the functions and their derivatives by s, (4, nb, degree + 1), in powers
        # of the distance from the middle of the element
        self._powers = np.zeros((4, len(used), degree + 1))
        for k in range(degree + 1):
            self._powers[0, :, k] = hermite_basis(m, 0.5, k) / factorial(k)
        for k in range(1, 4):
            self._powers[k, :, :-1] = self._powers[k - 1, :, 1:] * np.arange(1, degree + 1)
        self._start = np.asarray(beam.q0)
        x = np.linspace(0.0, 1.0, max(5, degree))  # where the search for the closest point begins
        self._samples = self._powers[0] @ (x - 0.5) ** np.arange(degree + 1)[:, None]
        starts = (beam.mesh.t[0] * beam.nd)[:, None, None]
        self._dofs = first + starts + 2 * used + np.arange(2)[:, None]  # (ne, 2, nb)
        self._scales = beam.mesh.lengths[:, None] ** np.tile(np.arange(m), 2)
        self._range = np.arange(degree + 1)

    def element(self, s: float) -> int:
        """The element at s; the end element beyond the ends."""
        return min(max(floor(s), 0), len(self._dofs) - 1)

    def weights(self, s: float) -> tuple[Array, Array]:
        """DOFs of the scene, and their weights in the axis and its derivatives by s."""
        e = self.element(s)
        return self._dofs[e], (self._powers @ (s - e - 0.5) ** self._range) * self._scales[e]

    def divided_differences(self, s0: float, s1: float) -> tuple[Array, Array, Array]:
        """Weights at two parameters, and their divided differences."""
        (one, a), (two, b) = self.weights(s0), self.weights(s1)
        e, f = self.element(s0), self.element(s1)
        nb = one.shape[1]
        weights = np.zeros((2, 2, 2 * nb))
        weights[0, :, :nb] = a[:2] / self.beam.mesh.lengths[e] ** np.arange(2)[:, None]
        weights[1, :, nb:] = b[:2] / self.beam.mesh.lengths[f] ** np.arange(2)[:, None]
        dofs = np.hstack([one, two])
        if e != f:
            return dofs, weights, (weights[1] - weights[0]) / (self.length(s1) - self.length(s0))
        x, y, n = s0 - e - 0.5, s1 - e - 0.5, self._powers.shape[2]
        powers = [sum(x**j * y**(k - 1 - j) for j in range(k)) for k in range(n)]
        quotients = np.zeros((2, 2 * nb))
        quotients[:, :nb] = ((self._powers[:2] @ powers) * self._scales[e]
                             / self.beam.mesh.lengths[e] ** np.arange(1, 3)[:, None])
        return dofs, weights, quotients

    def at(self, u: Array, s: float) -> Array:
        """Position and its first three derivatives by s, shape (4, 2)."""
        dofs, weights = self.weights(s)
        return weights @ self.places(u, dofs).T

    def nearest(self, u: Array, p: Array) -> float:
        """Parameter of the closest point of the axis to p."""
        x = (self.places(u, self._dofs) * self._scales[:, None]) @ self._samples
        gap = np.sum((x - p[:, None]) ** 2, axis=1)
        e, k = np.unravel_index(int(np.argmin(gap)), gap.shape)
        s, n = float(e + k / (gap.shape[1] - 1)), self.beam.mesh.nelements
        for _ in range(40):
            c, d, dd, _ = self.at(u, s)
            gap, size = c - p, float(d @ d)
            slope = size + float(gap @ dd)
            step = -float(gap @ d) / (slope if slope > 0.1 * size else size)
            inside = min(max(s + min(max(step, -0.5), 0.5), -0.5), n + 0.5)
            done, s = abs(inside - s) <= 1e-15 * n, inside
            if done:
                break
        return s

    def places(self, u: Array, dofs: Array) -> Array:
        return self._start[dofs - self.first] + u[dofs]

    def length(self, s: float) -> float:
        """Length of the reference axis from its start to s."""
        e = self.element(s)
        return float(np.sum(self.beam.mesh.lengths[:e]) + (s - e) * self.beam.mesh.lengths[e])


# discrete gradients of the equations of a sleeve between two displacements

def _mean(pair: Any) -> Array:
    return 0.5 * (pair[0] + pair[1])


class AffineVector(NamedTuple):
    """A vector, affine in the DOFs, at both parameters, and its divided difference."""

    rows: Array  # derivatives by the DOFs at both parameters, (2, 2, n)
    values: Array  # at parameter k and displacement j, (2, 2, 2)
    quotient: Array  # derivative of the divided difference, (2, n)
    slopes: Array  # the divided difference at both displacements, (2, 2)

    def times(self, Q: Array) -> "AffineVector":
        """Q times the vector, Q of shape (2, 2)."""
        return AffineVector(Q @ self.rows, self.values @ Q.T, Q @ self.quotient, self.slopes @ Q.T)


class ScalarProduct:
    """The scalar product of two families between two displacements."""

    def __init__(self, x: AffineVector, y: AffineVector) -> None:
        self._x, self._y = x, y
        self._passing = [_mean(f.values) for f in (x, y)]  # means over s, at each displacement
        a, b = self._passing
        #: f_s
        self.quotient = 0.5 * float(np.sum(a * y.slopes + x.slopes * b))
        #: f_u
        self.row = _mean([self._row(_mean(x.values[k]), _mean(y.values[k]), k) for k in range(2)])

    def _row(self, x: Array, y: Array, k: int) -> Array:
        return x @ self._y.rows[k] + y @ self._x.rows[k]

    def rate(self, j: int, v: Array) -> float:
        """f_u(u_j, s_j) . v."""
        x, y = self._x, self._y
        return float(self._row(x.values[j, j], y.values[j, j], j) @ v)

    def second(self, v: Array) -> Array:
        """Mean over s of the second derivative by u, times v (n,)."""
        return _mean([self._row(self._x.rows[k] @ v, self._y.rows[k] @ v, k) for k in range(2)])

    def mixed(self) -> Array:
        """The derivative of f_s by u at u_m."""
        (a, b), x, y = map(_mean, self._passing), self._x, self._y
        return (a @ y.quotient + _mean(y.slopes) @ _mean(x.rows)
                + b @ x.quotient + _mean(x.slopes) @ _mean(y.rows))


class Span(NamedTuple):
    """The equations of a sleeve between two displacements."""

    columns: Array  # numbers of DOFs
    change: Array  # u_1 - u_0 of these, (n,)
    advance: float  # s_1 - s_0, in elements
    place: ScalarProduct  # G, zero at both ends
    equations: list[ScalarProduct]
    shares: Array  # f_s / G_s of each equation at both ends, (m, 2)
    rows: Array  # D of each equation, (m, n)


#: Tolerance beyond an end of a beam, in elements.
BEYOND = 1e-6
#: Size of the cache of closest points, for all sleeves.
KNOWN = 64


def _placed(*dofs: Array) -> tuple[Array, Any]:
    """All DOFs of vectors, (n,), and a function from weights of one to rows (..., 2, n)."""
    columns = np.concatenate([x.ravel() for x in dofs])
    first = np.cumsum([0, *(x.size for x in dofs)])

    def rows(vector: int, weights: Array) -> Array:
        out, k = np.zeros((*weights.shape[:-2], 2, len(columns))), dofs[vector].shape[1]
        for c in range(2):
            at = first[vector] + c * k
            out[..., c, at:at + k] = weights[..., c % weights.shape[-2], :]
        return out

    return columns, rows


class Sleeve(Joint):
    """A material point slides along the axis of a beam.

    With the point p and its closest point c(s) on the axis, ``c'(s) . (p - c(s)) = 0``, the
    equation is ``c'(s) x (p - c(s)) = 0``, with the derivative c' by the reference length. Thus s
    is not an unknown, and the multiplier is the normal force over the stretch of the axis. With
    ``angle`` the section of the point keeps its angle to c'. See Hong, Ren: "Modeling of sliding
    joint on one-dimensional flexible medium", Multibody System Dynamics 26 (2011), with s as an
    unknown.

    Parameters
    ----------
    at
        The point: (beam, (x, y)) with a Beam, a RigidBody, a name or a number, or
        ("ground", (x, y)); a RigidBody for its centre of mass.
    on
        The beam along which it slides, its name or number.
    angle
        Keep the angle: the sleeve transmits a moment.
    """

    constant = tabled = False

    def __init__(self, at: Any, on: WhichBeam, angle: bool = False,
                 name: str | None = None) -> None:
        self.at, self.on, self.angle = at, on, require_flag("angle", angle)
        self.name = require_label("name", name)
        self.equations = ("force normal to the axis",) + ("moment",) * self.angle

    def bind(self, layout: Layout) -> None:
        which, at = named_place(layout, self.at)
        beam = select_beam(layout.beams, self.on)
        if which != GROUND and layout.beam(which) is beam:
            raise InputError(f"{self!r}: a point of {beam!r} cannot slide along the beam itself")
        self.axis = Axis(beam, layout.offset(beam))
        zero = np.zeros(layout.N)
        if self.angle:
            self.p, self.d = section(layout, which, at)
        else:
            self.p = self.d = point(layout, which, at)
        s = self.axis.nearest(zero, self.p.start)
        gap = np.hypot(*(self.p.start - self.axis.at(zero, s)[0]))
        if gap > 1e-6 * beam.size or self._outside(s):
            raise InputError(f"{self!r}: the point ({self.p.start[0]:.6g}, {self.p.start[1]:.6g}) "
                             f"is {gap:.6g} off the axis of {beam!r}: name one that is on it")
        tangent = self.axis.at(zero, s)[1]
        self.Q = rotation(angle_to(self.d.start, tangent))

    def _outside(self, s: float) -> bool:
        return not -BEYOND <= s <= self.axis.beam.mesh.nelements + BEYOND

    def distance(self, u: Array) -> float:
        """Location of the point: reference length of the axis from its left end."""
        return self.axis.length(self._parameter(np.asarray(u)))

    def lost(self, u: Array) -> str:
        s = self._parameter(u)
        if not self._outside(s):
            return ""
        end = "left" if s < 0 else "right"
        beam = self.axis.beam
        return (f"{self!r} has left the beam {beam.name or ''!r} at its {end} end: "
                "stop before, with until=, restrain it by a spring or a support, or lengthen the "
                "beam")

    @array_cache(KNOWN)
    def _parameter(self, u: Array) -> float:
        return self.axis.nearest(u, self.p(u))

    def value(self, u: Array, t: float) -> Array:
        s = self._parameter(u)
        c, d = self.axis.at(u, s)[:2]
        d = d / self.axis.beam.mesh.lengths[self.axis.element(s)]
        out = [cross(d, self.p(u) - c)]
        if self.angle:
            out.append(cross(self.d(u), self.Q @ d))
        return np.array(out)

    @array_cache(KNOWN)
    def _slopes(self, u: Array) -> tuple[Any, ...]:
        """Derivatives of the equations and of s; those c, C of the axis are by its length."""
        s = self._parameter(u)
        dofs, weights = self.axis.weights(s)
        lengths = self.axis.beam.mesh.lengths[self.axis.element(s)] ** np.arange(4)[:, None]
        columns, rows = _placed(self.p.dofs, self.d.dofs, dofs)
        c, C = self.axis.at(u, s) / lengths, rows(2, (weights / lengths)[:, None])
        e, E, D = self.p(u) - c[0], rows(0, self.p.weights) - C[0], rows(1, self.d.weights)
        Gs = c[2] @ e - c[1] @ c[1]
        s_y = -(c[1] @ E + e @ C[1]) / Gs
        first = [(cross(c[2], e), cross(c[1], E) - cross(e, C[1]))]
        if self.angle:
            d, Q = self.d(u), self.Q
            first.append((cross(d, Q @ c[2]), cross(d, Q @ C[1]) - cross(Q @ c[1], D)))
        return columns, c, e, E, C, D, Gs, s_y, first

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        columns, *_, s_y, first = self._slopes(u)
        rows = [slope + by_s * s_y for by_s, slope in first]
        k, n = len(rows), len(columns)
        return np.repeat(np.arange(k), n), np.tile(columns, k), np.concatenate(rows)

    def curvature(self, u: Array, t: float, multipliers: Array) -> tuple[Array, Array, Array]:
        columns, c, e, E, C, D, Gs, s_y, first = self._slopes(u)
        n, square = len(columns), np.outer(s_y, s_y)

        def both(A: Array, B: Array, row: Array) -> Array:
            M = A.T @ B + np.outer(row, s_y)  # of the variations of two factors, in both orders
            return M + M.T

        # of c'(s) . (p - c(s)) = 0
        s_yy = -(both(C[1], E, c[2] @ E + e @ C[2] - 2.0 * c[1] @ C[1])
                 + (c[3] @ e - 3.0 * c[1] @ c[2]) * square) / Gs
        H = multipliers[0] * (
            both(turned(C[1]), E, cross(c[2], E) - cross(e, C[2]))
            + (cross(c[3], e) - cross(c[2], c[1])) * square + first[0][0] * s_yy)
        if self.angle:
            d, Q = self.d(u), self.Q
            H = H + multipliers[1] * (
                both(turned(D), Q @ C[1], cross(d, Q @ C[2]) - cross(Q @ c[2], D))
                + cross(d, Q @ c[3]) * square + first[1][0] * s_yy)
        return np.repeat(columns, n), np.tile(columns, n), H.ravel()

    # between two displacements

    @array_cache(KNOWN)
    def _span(self, u0: Array, u1: Array) -> Span:
        ends = u0, u1
        s = [self._parameter(u) for u in ends]
        dofs, weights, quotients = self.axis.divided_differences(*s)
        columns, rows = _placed(self.p.dofs, self.d.dofs, dofs)

        def held(part: int, vector: Vector) -> AffineVector:
            at = np.array([vector(u) for u in ends])
            matrix = rows(part, vector.weights)
            return AffineVector(np.array([matrix, matrix]), np.array([at, at]), 0.0 * matrix,
                                0.0 * at)

        def along(order: int) -> AffineVector:
            places, w, q = [self.axis.places(u, dofs).T for u in ends], weights, quotients[order]
            return AffineVector(rows(2, w[:, order, None]),
                          np.array([[w[k, order] @ x for x in places] for k in range(2)]),
                          rows(2, q[None]), np.array([q @ x for x in places]))

        # a x b is the scalar product of a, turned by a right angle, and b
        c, right = along(1), np.array([[0.0, -1.0], [1.0, 0.0]])
        gap = AffineVector(*map(np.subtract, held(0, self.p), along(0)))
        equations = [ScalarProduct(c.times(right), gap)]
        if self.angle:
            equations.append(ScalarProduct(held(1, self.d).times(right), c.times(self.Q)))
        shares = [[by_s / slopes[6] for by_s, _ in slopes[8]]
                  for slopes in (self._slopes(u) for u in ends)]
        place = ScalarProduct(c, gap)
        return Span(columns, (ends[1] - ends[0])[columns], s[1] - s[0], place, equations,
                    np.array(shares).T, np.array([
                        f.row - f.quotient / place.quotient * place.row for f in equations]))

    def mean_entries(self, u0: Array, u1: Array, t: float) -> tuple[Array, Array, Array]:
        span = self._span(u0, u1)
        k = len(self.equations)
        return (np.repeat(np.arange(k), len(span.columns)), np.tile(span.columns, k),
                span.rows.ravel())

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        # Both velocities satisfy the constraint; for quadratic Phi, X is -(multipliers . Phi'')
        # (v0 + v1) / 4. The part linear in u1 - u0 is written as such; the rest has the factor
        # s_1 - s_0, which is -G_u . (u1 - u0) / G_s.
        span = self._span(u0, u1)
        place, at = span.place, span.columns
        v0, v1, v = v0[at], v1[at], (v0 + v1)[at]
        passing = [place.rate(0, v0), place.rate(1, v1)]
        out, work = np.zeros(len(v)), 0.0
        for f, share, multiplier, D in zip(span.equations, span.shares, multipliers, span.rows):
            mean = f.quotient / place.quotient
            row = -0.5 * (f.second(v) - mean * place.second(v))
            row += 0.5 / place.quotient * (sum(passing) * f.mixed()
                                           - (share @ passing) * place.mixed())
            out += 0.5 * multiplier * row
            work += 0.5 * multiplier * float(D @ (v1 - v0) - row @ span.change)
        if abs(span.advance) > 1e-9:  # else there is nothing to divide by
            out += work / float(place.row @ span.change) * place.row
        return np.bincount(at, out, len(u0))

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at, beam = point(layout, *named_place(layout, self.at)), layout.beam(self.on)
        e, X, *_ = beam.finder.find(at.start[:, None])
        return (Symbol("slider", (at,), (tangent_at(beam, int(e[0]), float(X[0, 0])),)),)


class Slot(ComposedJoint):
    """A material point slides along a straight line of a rigid body, or of the ground.

    ``e x (p - b) = 0``, with a point b of the body and a direction e that rotates with it.

    Parameters
    ----------
    at
        The point: (beam, (x, y)) with a Beam, a RigidBody, a name or a number; a RigidBody for its
        centre of mass.
    on
        The body, its name or number, or "ground"; a Beam for a line fixed to the section at
        ``through``.
    direction
        Initial direction of the line, shape (2,).
    through
        A point of the initial line, shape (2,); the material point by default.
    angle
        Keep the angle between the point's section and the line: a moment is transmitted.
    """

    constant = False

    def __init__(self, at: Any, on: WhichMember, direction: ArrayLike,
                 through: ArrayLike | None = None, angle: bool = False,
                 name: str | None = None) -> None:
        d = require_direction("direction", direction)
        self.direction = d / np.hypot(*d)
        self.through = None if through is None else require_finite("through", through, (2,))
        self.at, self.on, self.angle = at, on, require_flag("angle", angle)
        self.name = require_label("name", name)
        self.equations = ("force normal to the line",) + ("moment",) * self.angle

    def bind(self, layout: Layout) -> None:
        which, at = named_place(layout, self.at)
        p, d = section(layout, which, at) if self.angle else (point(layout, which, at), None)
        b, e = section(layout, self.on, tuple(map(
            float, p.start if self.through is None else self.through)))
        self.constant, w = not e.dofs.size, p - b
        refuse(not w.dofs.size, "{!r}: the point and the line are both of the ground", self)
        if which == self.on or (which != GROUND and self.on != GROUND
                                and layout.beam(which) is layout.beam(self.on)):
            raise InputError(f"{self!r}: a point cannot slide along a line of its beam or body")
        gap = cross(self.direction, w.start)
        size = max(layout.beam(k).size for k in (which, self.on) if k != GROUND)
        refuse(abs(gap) > 1e-6 * size, "{!r}: the point ({:.6g}, {:.6g}) is {:.6g} off the line: "
               "give another through=", self, p.start[0], p.start[1], abs(gap))
        kept = [(w, self.direction)] if d is None else [(w, self.direction), (d, d.start)]
        self.parts = [aligned(vector, e, rotation(angle_to(start, e.start)))
                      for vector, start in kept]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = point(layout, *named_place(layout, self.at))
        return (Symbol("slider", (at,), (self.direction,)),)


def slider(layout: Layout, at: Any, on: WhichMember, direction: ArrayLike | None = None,
           angle: bool = False, name: str | None = None) -> Joint:
    """A :class:`Sleeve` on a beam, or a :class:`Slot` of a rigid body or the ground."""
    at = tuple(named_place(layout, at))
    if is_ground(on) or isinstance(layout.beam(on), RigidBody):
        refuse(direction is None, "a slider on {!r} needs the direction of its line", on)
        return Slot(at, on, direction, angle=angle, name=name)  # type: ignore[arg-type]
    refuse(direction is not None, "a slider on a beam moves along its axis: give no direction")
    return Sleeve(at, on, angle, name)  # type: ignore[arg-type]
