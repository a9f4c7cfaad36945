"""Shapes of obstacles, defined by signed distances, and their outlines for pictures and files."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from ...core import (Array, ArrayLike, CallbackError, Immutable, ask, refuse, refuse_any,
                     require_direction, require_finite, require_flag, require_function,
                     require_not_negative, require_positive, warnings_as_errors)
from ..contact.kernels import outline
from ..contact.tables import CUSTOM, OUTLINE
from ..item import takes

#: Cells along each side of the contour grid.
CELLS = 160
#: Margin of the box relative to the size of the body.
AROUND = 0.15


def circle(center: Array, radius: float, n: int) -> tuple[Array, Array]:
    """Points of a circle and its segments."""
    angle, k = 2.0 * np.pi * np.arange(n) / n, np.arange(n)
    points = center[:, None] + radius * np.array([np.cos(angle), np.sin(angle)])
    return points, np.column_stack([k, np.roll(k, -1)])


def contour(distance: Callable[[Array], Array], box: Array) -> tuple[Array, Array]:
    """Zero contour of a distance function, by marching triangles on a grid."""
    x, y = (np.linspace(low, high, CELLS + 1) for low, high in box)
    points = np.array(np.meshgrid(x, y)).reshape(2, -1)
    values = distance(points)
    corner = (np.arange(CELLS)[:, None] * (CELLS + 1) + np.arange(CELLS)).ravel()
    below, above = (np.stack([corner, corner + a, corner + CELLS + 2], axis=1)
                    for a in (1, CELLS + 1))
    triangles = np.concatenate([below, above])
    inside = values[triangles] < 0.0
    cut = triangles[np.any(inside, axis=1) & ~np.all(inside, axis=1)]
    # the corner alone on its side, and the two others
    inside = values[cut] < 0.0
    alone = np.argmax(inside == (inside.sum(axis=1) == 1)[:, None], axis=1)
    rows = np.arange(len(cut))
    one = cut[rows, alone]
    ends = []
    for k in (1, 2):
        other = cut[rows, (alone + k) % 3]
        share = values[one] / (values[one] - values[other])
        ends.append(points[:, one] + share * (points[:, other] - points[:, one]))
    return np.concatenate(ends, axis=1), np.column_stack([rows, rows + len(rows)])


def around(points: Array, part: float = AROUND) -> Array:
    """A bounding box with a margin relative to its size."""
    low, high = points.min(axis=1), points.max(axis=1)
    margin = part * float(np.max(high - low))
    return np.array([low - margin, high + margin]).T


def outlines(state: Any, box: Array) -> list[Array]:
    """Outlines of the obstacles at a state, as straight segments."""
    out, system = list[Array](), getattr(state, "system", None)
    for one in () if system is None else system.forces.contacts.obstacles:
        points, pieces = one.outline(box, state._time)
        out.append(points.T[pieces])
    return out


#: Relative step of differences of a distance function, and of its gradient.
STEP, COARSE = 1e-6, 1e-4
#: Tolerance of a slope above 1 of a distance function.
STEEP = 0.05
#: Length of an unbounded edge, relative to its vector.
FAR = 1e300
#: Stands for an unknown thickness.
UNKNOWN = 1e300
_COMPLEX = getattr(np, "exceptions", np).ComplexWarning


class Shape(Immutable):
    """A solid region of the plane.

    Attributes
    ----------
    kind
        Its number in :mod:`skfem_ancf.actions.contact.tables`.
    numbers
        Parameters for kernels, shape (n,).
    pivot
        Centre of rotation for a time-dependent angle, shape (2,).
    hollow
        The outside is solid instead of the inside.
    bend
        Smallest radius of its surface; infinite if straight or not known, zero for sharp corners.
    inner
        Largest depth at which the closest surface is the near side: half the least thickness;
        infinite for a half plane, large if not known.

    Other Parameters
    ----------------
    x, t
        Points, shape (2, ...), and time, for a shape given by functions of it.
    box
        Lower left and upper right corner of the view, one a column, shape (2, 2).
    scale
        A length of the body with points x.
    """

    kind = CUSTOM
    bend = inner = np.inf
    numbers: Any = np.zeros(0)
    pivot: Any = np.zeros(2)
    hollow = False

    def distance(self, x: ArrayLike, t: float = 0.0) -> Array:
        """Signed distance (...) of points from the surface, negative in the solid."""
        raise NotImplementedError

    def numbers_about(self, origin: Array) -> Array:
        """:attr:`numbers` in coordinates relative to an origin (2,)."""
        return self.numbers

    def landmarks(self) -> Array:
        """Points of its surface that no beam may contain at the start; shape (2, n)."""
        return np.zeros((2, 0))

    def outline(self, box: Array, t: float = 0.0) -> tuple[Array, Array]:
        """Its surface as straight segments: points (2, n), and both ends of each, (m, 2)."""
        raise NotImplementedError

    def fitted(self, x: Array, scale: float) -> "Shape":
        """The shape for a body; CallbackError if its functions are not valid."""
        return self

    def __repr__(self) -> str:
        return f"<{type(self).__name__}>"


class Outline(Shape):
    """A polygon with rounded corners; circles and lines are special cases."""

    kind = OUTLINE

    def numbers_about(self, origin: Array) -> Array:
        numbers = self.numbers.copy()
        numbers[3:].reshape(-1, 5)[:, :2] -= origin
        return numbers

    def distance(self, x: ArrayLike, t: float = 0.0) -> Array:
        x = np.asarray(x, dtype=float)
        out = np.zeros((6, int(np.prod(x.shape[1:]))))
        outline(self.numbers, False, x.reshape(2, -1), out)
        gap = out[0].reshape(x.shape[1:])
        return -gap if self.hollow else gap


class Line(Outline):
    """A half plane: an infinite straight wall.

    Parameters
    ----------
    point
        A point of its surface, shape (2,).
    normal
        Outward normal of the solid, of any length, shape (2,).

    Examples
    --------
    >>> from skfem_ancf.actions.obstacles import Line
    >>> floor = Line((0, -1), normal=(0, 1))
    >>> float(floor.distance((3.0, 0.5)))
    1.5
    """

    def __init__(self, point: ArrayLike, normal: ArrayLike = (0.0, 1.0)) -> None:
        self.point = require_finite("point", point, (2,))
        self.normal = require_direction("normal", normal)
        self._unit, self.pivot = self.normal / np.hypot(*self.normal), self.point
        p, q = self._unit
        self.numbers = np.array([0.0, -FAR, FAR, *self.point, -q, p, 1.0])

    def outline(self, box: Array, t: float = 0.0) -> tuple[Array, Array]:
        # one segment near the box
        p, q = self._unit
        along, middle, half = np.array([q, -p]), box.mean(axis=1), 0.5 * np.hypot(
            *(box[:, 1] - box[:, 0]))
        foot = self.point + ((middle - self.point) @ along) * along
        return np.array([foot - half * along, foot + half * along]).T, np.array([[0, 1]])

    def __repr__(self) -> str:
        return f"<Line at {_pair(self.point)}, normal {_pair(self.normal)}>"


class Circle(Outline):
    """A disc, or the hole of a ring.

    Parameters
    ----------
    center
        Shape (2,).
    radius
        Positive.
    hollow
        The outside is solid instead of the inside.

    Examples
    --------
    >>> from skfem_ancf.actions.obstacles import Circle
    >>> float(Circle((0, 0), 1.0).distance((0.0, 3.0)))
    2.0
    """

    def __init__(self, center: ArrayLike, radius: float, hollow: bool = False) -> None:
        self.center = require_finite("center", center, (2,))
        self.radius = require_positive("radius", radius)
        self.hollow = require_flag("hollow", hollow)
        self.pivot = self.center
        self.numbers = self.numbers_about(np.zeros(2))
        self.bend = self.radius
        self.inner = np.inf if self.hollow else self.radius

    def numbers_about(self, origin: Array) -> Array:
        far = origin - self.center  # from the centre
        size = np.hypot(*far)
        normal = far / size if size > 0.0 else np.array([1.0, 0.0])
        return np.array([self.radius, *(self.radius * normal - far), *normal])

    def landmarks(self) -> Array:
        points, _ = circle(self.center, self.radius, 8)
        return points if self.hollow else np.column_stack([self.center, points])

    def outline(self, box: Array, t: float = 0.0) -> tuple[Array, Array]:
        return circle(self.center, self.radius, 96)

    def __repr__(self) -> str:
        return f"<Circle about {_pair(self.center)}, radius {self.radius:g}>"


class Polygon(Outline):
    """The inside of a closed polygon, or its outside.

    Parameters
    ----------
    points
        Its corners in order, in either direction: at least three, as a list of pairs or an array of
        shape (n, 2). Sides must not intersect.
    radius
        Offset of the outline with rounded corners. Use it where beams slide over a corner: the
        normal of a sharp corner jumps.
    hollow
        The outside is solid instead of the inside; the radius then enlarges the hole.

    Examples
    --------
    >>> from skfem_ancf.actions.obstacles import Polygon
    >>> box = Polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    >>> box.distance([[0.5, 2.0], [0.75, 0.5]]).tolist()
    [-0.25, 1.0]
    """

    def __init__(self, points: ArrayLike, radius: float = 0.0, hollow: bool = False) -> None:
        try:
            corners = np.array(points, dtype=float)
        except (TypeError, ValueError):
            corners = np.zeros(0)
        refuse(corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3, "points must be "
               "three corners or more, each (x, y), as [(0, 0), (1, 0), (0, 1)], got {!r}", points)
        corners = require_finite("points", corners)
        self.bend = self.radius = require_not_negative("radius", radius, False)
        self.hollow = require_flag("hollow", hollow)
        _require_simple(corners)
        after = np.roll(corners, -1, axis=0)
        if np.sum(_cross(corners, after)) < 0.0:
            corners = corners[::-1].copy()
        self.points, self.pivot = corners, corners.mean(axis=0)
        edges = np.roll(corners, -1, axis=0) - corners
        before = np.roll(edges, 1, axis=0)
        sides = np.where(_cross(before, edges) >= 0.0, 1.0, -1.0)
        self.numbers = np.append([self.radius, 0.0, 1.0], np.column_stack([corners, edges, sides]))
        side = -1.0 if self.hollow else 1.0
        # half the least distance through the solid from the middle of an edge to another edge
        middle, normal = corners + 0.5 * edges, side * np.array([-edges[:, 1], edges[:, 0]]).T
        apart = corners[None] - middle[:, None]  # corner_j + b edge_j = middle_i + a normal_i
        det = _cross(normal[:, None], edges[None])
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = _cross(apart, edges[None]) / det, _cross(apart, normal[:, None]) / det
        met = (a > 1e-9) & (b >= 0.0) & (b <= 1.0)
        inner = side * self.radius + 0.5 * float(np.min(np.where(
            met, a * np.hypot(*normal.T)[:, None], np.inf)))
        self.inner = inner if inner > 0.0 else np.inf

    def landmarks(self) -> Array:
        return self.points.T

    def outline(self, box: Array, t: float = 0.0) -> tuple[Array, Array]:
        if self.radius > 0.0:  # arcs at its corners
            grown = self.radius + 0.02 * float(np.ptp(self.points, axis=0).max())
            own = np.array([self.points.min(axis=0) - grown, self.points.max(axis=0) + grown]).T
            return contour(self.distance, own)
        n = np.arange(len(self.points))
        return self.points.T, np.column_stack([n, np.roll(n, -1)])

    def __repr__(self) -> str:
        return f"<Polygon of {len(self.points)} corners>"


def _pair(x):
    return f"({x[0]:g}, {x[1]:g})"


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _require_simple(points):
    """Raise InputError for repeated corners or intersecting sides."""
    n = len(points)
    sides = np.roll(points, -1, axis=0) - points
    refuse_any(np.hypot(*sides.T) <= 1e-12 * np.abs(points).max(), "the corner {k} of the polygon, "
               "{:g}, and the next are one place: leave one of them out", points.T)
    for i in range(n - 1):
        j = np.arange(i + 1, n)
        a, b, c, d = points[i], points[i + 1], points[j], points[(j + 1) % n]
        side, other = b - a, d - c
        crosses = (_cross(side, c - a) * _cross(side, d - a) < 0) & (
            _cross(other, a - c) * _cross(other, b - c) < 0)
        # neighbours may fold back on each other
        folds = (_cross(side, other) == 0.0) & (other @ side < 0.0)
        beside = (j == i + 1) | ((i == 0) & (j == n - 1))
        refuse_any(np.where(beside, folds, crosses), "the sides {} and {} of the polygon, from "
                   "{:g} to {:g} and from {:g} to {:g}, cross: give its corners in order, round "
                   "what is solid", i, j, tuple(a), tuple(b), c.T, d.T)


class SignedDistance(Shape):
    """A shape defined by the signed distance from its surface.

    Parameters
    ----------
    f
        ``f(x, y)`` or ``f(x, y, t)`` of arrays x and y: distances of the same shape, negative in
        the solid. It must be a true distance near bodies: with a slope above 1 the contact search
        may fail, and the penetration is measured by its values.
    gradient
        ``gradient(x, y)`` or with t: its derivatives, shape (2, ...). By default complex steps, if
        f accepts complex numbers, else differences.
    hessian
        ``hessian(x, y)`` or with t: its second derivatives xx, xy and yy, shape (3, ...). By
        default differences of the gradient.
    pivot
        Centre of rotation for a time-dependent angle, shape (2,).

    Examples
    --------
    A floor with waves:

    >>> import numpy as np
    >>> from skfem_ancf.actions.obstacles import SignedDistance
    >>> waves = SignedDistance(lambda x, y: (y - 0.01 * np.sin(5 * x)) / 1.01)
    >>> float(waves.distance((0.0, 1.01)))
    1.0
    """

    kind = CUSTOM
    inner = UNKNOWN

    def __init__(self, f: Callable[..., Any], gradient: Callable[..., Any] | None = None,
                 hessian: Callable[..., Any] | None = None, pivot: ArrayLike = (0.0, 0.0)) -> None:
        self.f = require_function("f", f, "of x and y that returns distances")
        self.gradient, self.hessian = gradient, hessian
        for name, function in (("gradient", gradient), ("hessian", hessian)):
            refuse(function and not callable(function), "{} must be a function of x and y that "
                   "returns derivatives, got {!r}", name, function)
        self.pivot = require_finite("pivot", pivot, (2,))
        self._timed = {name: takes(g, 3) for name, g in (
            ("f", f), ("gradient", gradient), ("hessian", hessian))}
        self._by_steps, self._scale = False, 1.0

    def _asked(self, name, x, t, rows=()):
        """Values of one of the functions, with a check of the shape."""
        more = (t,) if self._timed[name] else ()
        value = ask(f"{name} of a SignedDistance", getattr(self, name), x[0], x[1], *more)
        value, shape = np.asarray(value), (*rows, *x.shape[1:])
        refuse(value.shape != shape, "{}(x, y) of a SignedDistance must return the shape {} for x "
               "and y of the shape {}, got {}: write it for arrays, as np.hypot(x, y) - 1.0", name,
               shape, x.shape[1:], value.shape, error=CallbackError)
        refuse(value.dtype.kind not in "fiuc" or not np.all(np.isfinite(value)), "{}(x, y) of a "
               "SignedDistance must be finite numbers, got {!r}", name, value, error=CallbackError)
        return value

    def distance(self, x: ArrayLike, t: float = 0.0) -> Array:
        return np.asarray(self._asked("f", np.asarray(x, dtype=float), t), dtype=float)

    def _slope(self, x, t):
        """Gradient at points, shape (2, n)."""
        if self.gradient is not None:
            return self._asked("gradient", x, t, (2,))
        return self._slope_by_steps(x, t, self._by_steps)

    def _slope_by_steps(self, x, t, imaginary):
        """The same by complex steps or by differences."""
        units, step = np.eye(2)[:, :, None], STEP * self._scale
        if imaginary:
            return np.array([np.imag(self._asked("f", x + 1e-30j * e, t)) / 1e-30 for e in units])
        return np.array([(self._asked("f", x + step * e, t) - self._asked("f", x - step * e, t))
                         / (2.0 * step) for e in units])

    def derivatives(self, x: Array, t: float) -> Array:
        """Distance, gradient and second derivatives xx, xy, yy, shape (6, n)."""
        out = np.empty((6, x.shape[1]))
        out[0], out[1:3] = self._asked("f", x, t), self._slope(x, t)
        if self.hessian is not None:
            out[3:] = self._asked("hessian", x, t, (3,))
        elif x.shape[1]:
            step = COARSE * self._scale
            by_x, by_y = ((self._slope(x + step * e, t) - self._slope(x - step * e, t))
                          / (2.0 * step) for e in np.eye(2)[:, :, None])
            out[3:] = by_x[0], 0.5 * (by_x[1] + by_y[0]), by_y[1]
        return out

    def fitted(self, x: Array, scale: float) -> "SignedDistance":
        made = self._thawed()
        made._scale, made._by_steps = scale, False
        rough = made._slope_by_steps(x, 0.0, False)
        steep = np.hypot(*rough)
        worst = int(np.argmax(steep))
        refuse(steep[worst] > 1.0 + STEEP, "f(x, y) of a SignedDistance must be a distance, whose "
               "slope is 1: at {!r} it is {:.4g}. Divide it by its slope, or by a bound of it",
               x[:, worst].tolist(), steep[worst], error=CallbackError)
        if made.gradient is None:
            with suppress(CallbackError, TypeError, ValueError, _COMPLEX), (
                    warnings_as_errors(_COMPLEX)):
                made._by_steps = bool(np.allclose(made._slope_by_steps(x, 0.0, True), rough,
                                                  rtol=0.0, atol=1e-4))
        else:
            off = np.abs(made._slope(x, 0.0) - rough).max()
            refuse(off > 1e-3, "gradient(x, y) of a SignedDistance is not that of f: they differ "
                   "by {:.3g}", off, error=CallbackError)
        made.derivatives(x, 0.0)
        return made

    def outline(self, box: Array, t: float = 0.0) -> tuple[Array, Array]:
        return contour(lambda x: self.distance(x, t), box)

    def __repr__(self) -> str:
        return f"<SignedDistance {getattr(self.f, '__name__', 'function')}>"
