"""The smooth axis of a curved beam: a function of a parameter, or a spline of points."""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..core import (Array, CallbackError, FileError, MeshError, ask_array, gauss, refuse,
                    refuse_any, require_finite, require_finite_scalar, require_integer,
                    require_path, retold, warnings_as_errors)

# a smooth axis through points from an array or a text file

#: Chords per interval between two points for its length.
PIECES = 32
#: Smallest distance of adjacent points, relative to the largest.
CLOSE = 1e-6


def axis_of(points: Any, elements: int | None, noise: float) -> tuple[Any, Array]:
    """A cubic spline r(s) and parameters of the nodes, see :meth:`MeshBeam.from_points`."""
    from scipy.interpolate import BSpline, splprep

    if isinstance(points, str) or hasattr(points, "__fspath__"):
        # rows x, y of a file, separated by commas, blanks or semicolons, with an optional header
        path = require_path("points", points)
        with retold((OSError, UnicodeDecodeError), "{} cannot be read: {error}", path,
                    error=FileError):
            lines = path.read_text(encoding="utf-8-sig").splitlines()
        lines = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
        if any(";" in line for line in lines):  # maybe with decimal commas
            lines = [line.replace(",", ".").replace(";", ",") for line in lines]
        if lines and any(letter.isalpha() and letter not in "eE" for letter in lines[0]):
            lines = lines[1:]
        with retold(ValueError, "{} must hold rows of two numbers, x and y: {error}", path,
                    error=MeshError):
            points = np.loadtxt(lines, delimiter="," if lines and "," in lines[0] else None,
                                ndmin=2, quotechar='"')
        refuse(points.shape[1] != 2, "{} has {} columns in place of x and y", path, points.shape[1],
               error=MeshError)
    x = require_finite("points", points, (None, 2))
    noise, n = require_finite_scalar("noise", noise), len(x)
    refuse(n < 2, "an axis needs at least two points, got {}", n, error=MeshError)
    refuse(noise < 0, "noise must not be negative, got {!r}", noise, error=MeshError)
    steps = np.hypot(*np.diff(x, axis=0).T)
    # the spline would turn between points so close
    refuse_any(steps <= CLOSE * np.max(steps), "the points {k} and {} are both at {}: "
               "leave one out", np.arange(1, n), x[:-1].T, error=MeshError)
    s = np.append(0.0, np.cumsum(steps))
    (t, c, k), _ = splprep(x.T, u=s, s=n * noise**2, k=min(3, n - 1))
    curve = BSpline(t, np.array(c), k, axis=1)
    if elements is None:
        return curve, s
    elements = require_integer("elements", elements, 1)
    fine = np.interp(np.arange(PIECES * (n - 1) + 1) / PIECES, np.arange(n), s)
    length = np.append(0.0, np.cumsum(np.hypot(*np.diff(curve(fine)))))
    return curve, np.interp(np.linspace(0.0, length[-1], elements + 1), length, fine)


logger = logging.getLogger(__name__)

#: Stencil of differences, in steps.
STENCIL = np.arange(-3, 4)
#: Relative coordinates in an element for curvatures, and beside a node for kinks.
FINE, ASIDE = np.arange(32) / 32.0, np.array([-1e-3, 1e-3, -2.5e-4, 2.5e-4])
#: Smallest angle of a kink that is refused; fine polygons have smaller ones.
KINK = 1e-2


def _components(value, s):
    if isinstance(value, (tuple, list)) and len(value) == 2:
        return [np.broadcast_to(v, s.shape) if np.ndim(v) == 0 else v for v in value]
    return value


def _on_curve(what, function, s):
    """Evaluate a function of parameters s (n,), and check that it returns (2, n)."""
    try:
        return ask_array(what, (2, len(s)), lambda s: _components(function(s), s), s)
    except CallbackError as error:
        raise CallbackError(f"{error}; for s (n,) it returns positions (2, n), a constant as 0 * s "
                            "+ 1") from error.__cause__


class Curve:
    """A plane curve r(s) on ``ends`` with its derivative: functions of (n,) that return (2, n)."""

    def __init__(self, r: Callable[[Array], Any], derivative: Callable[[Array], Any],
                 ends: tuple[float, float]) -> None:
        self.r, self.derivative, self.ends = r, derivative, ends

    def __call__(self, s):
        return _on_curve("r(s)", self.r, s)

    def rate(self, s: Array) -> Array:
        """The derivative at parameters ``s``, shape (2, n)."""
        return _on_curve("the derivative of r", self.derivative, s)

    def _moving(self, s):
        """The derivative at parameters s, checked to be nonzero."""
        d = self.rate(s)
        size = np.hypot(*d)
        refuse_any(size <= 1e-12 * size.max(initial=0.0), "the derivative of the curve is zero at "
                   "s = {:.9g}", s, error=MeshError)
        return d

    def nodes(self, s: Array) -> tuple[Array, Array]:
        """Positions and unit tangents at parameters ``s``, both of shape (2, n)."""
        d = self._moving(s)
        return self(s), d / np.hypot(*d)

    def turning(self, s: Array) -> Array:
        """Derivative of the unit normal by the arc length at parameters ``s``, shape (2, n)."""
        at, weights, step = _stencil(s, *self.ends)
        d, near = _each(self._moving, s, at)
        x, y = np.einsum("is,jis->js", weights, near / np.hypot(*near)) / step
        return np.array([-y, x]) / np.hypot(*d)

    def lengths(self, a: Array, b: Array) -> Array:
        """Arc lengths from parameters ``a`` to ``b``, all of shape (n,)."""
        x, w = gauss(12)
        d, = _each(self.rate, a[:, None] + (b - a)[:, None] * x)
        return np.hypot(*d) @ w * (b - a)

    def elements(self, s: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Positions, tangents, lengths, turning, curvature of sixteenths, between nodes at ``s``.
        """
        a, step = s[:-1], np.diff(s)
        beside = s[1:-1] + ASIDE[:, None] * np.minimum(step[:-1], step[1:])
        x, w = gauss(12)
        fine = np.append(a[:, None] + step[:, None] * FINE, s[-1])
        p, p_beside = _each(self, s, beside)
        here, d_gauss, d_fine = _each(self._moving, s, a[:, None] + step[:, None] * x, fine)
        lengths = np.hypot(*d_gauss) @ w * step
        gap = np.hypot(*(d_gauss @ w * step - np.diff(p))) / lengths
        refuse_any(~(gap <= 0.02), "r jumps, or its derivative misses it by {:.6g}, between s = "
                   "{:.9g} and {:.9g}", gap * lengths, a, s[1:], error=MeshError)
        if len(s) > 2:
            chords = (p_beside - p[:, None, 1:-1]) * np.sign(ASIDE)[:, None]
            wide, narrow = _angles(chords[:, 0], chords[:, 1]), _angles(chords[:, 2], chords[:, 3])
            # far from the origin the direction of such short chords is round-off
            chord = np.hypot(*chords[:, 2:]).min(axis=0)
            seen = chord * KINK > 32.0 * np.finfo(float).eps * np.abs(p[:, 1:-1]).max()
            kink = np.where(seen & (np.abs(narrow) > 0.7 * np.abs(wide)), np.abs(narrow), 0.0)
            refuse_any(kink > KINK, "the curve has a kink of {:.3g} degrees at s = {:.9g}: weld "
                       "one beam for each smooth part", np.rad2deg(narrow), s[1:-1],
                       error=MeshError)
        v = np.hypot(*d_fine)
        pieces = (v[:-2:2] + 4.0 * v[1::2] + v[2::2]) * np.repeat(step / 96.0, 16)  # Simpson's rule
        bent = np.abs(_angles(d_fine[:, :-2:2], d_fine[:, 2::2])) / pieces
        return p.copy(), here / np.hypot(*here), lengths, self.turning(s), bent

    def moved(self, A: Array, shift: Array) -> "Curve":
        """The curve ``A r(s) + shift``."""
        return Curve(partial(_moved, self, A, shift), partial(_moved, self.rate, A, np.zeros(2)),
                     self.ends)


def _moved(function, A, shift, s):
    return A @ function(s) + shift[:, None]


def _complex_step(r, s):
    return np.imag(np.asarray(_components(r(s + 1e-30j), s))) / 1e-30


def _differences(r, s0, s1, s):
    at, weights, d = _stencil(s, s0, s1)
    values, = _each(partial(_on_curve, "r(s)", r), at)
    return np.einsum("is,jis->js", weights, values) / d


def derivative_of(r: Callable[[Array], Any], s0: float, s1: float) -> Callable[[Array], Array]:
    """Derivative of ``r`` on [s0, s1] by the complex step, or else by sixth-order differences."""
    differences, complex_step = partial(_differences, r, s0, s1), partial(_complex_step, r)
    try:
        probe = s0 + (s1 - s0) * np.linspace(0.0137, 0.991, 24)
        with warnings_as_errors():  # among them: the imaginary part is discarded
            exact, near = complex_step(probe), differences(probe)
        size = np.abs(near)
        if exact.shape == near.shape and (
                np.abs(exact - near) <= 1e-6 * (size + size.max())).all():
            return complex_step
    except Exception:  # r is user-defined and may raise anything
        logger.debug("the curve has no complex step; differences are used", exc_info=True)
    return differences


def _each(function, *parameters):
    return [np.asarray(function(s.ravel())).reshape(2, *s.shape) for s in parameters]


def _angles(a, b):
    return np.arctan2(a[0] * b[1] - a[1] * b[0], np.sum(a * b, axis=0))


def _stencil(s, s0, s1):
    """Points and weights (7, n) for differences on [s0, s1], and their spacing."""
    d = 1e-3 * (s1 - s0)
    c = np.clip(s, s0 + 3 * d, s1 - 3 * d)  # the stencil stays inside
    x = (s - c) / d
    # the inverse has the coefficients of Lagrange's polynomials, those of the highest powers first
    weights = np.array([np.polyval(np.polyder(one), x)
                        for one in np.linalg.inv(np.vander(STENCIL)).T])
    return c + STENCIL[:, None] * d, weights, d
