"""The smooth axis of a curved beam: a function of a parameter, its derivative and arc length."""

from __future__ import annotations

import itertools
import logging
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import CallbackError, MeshError, ask_array, warnings_as_errors

if TYPE_CHECKING:
    from collections.abc import Callable

    from .types import Array

logger = logging.getLogger(__name__)

#: Where differences are taken of a function, in steps.
STENCIL = np.arange(-3, 4)
#: Angle of a kink of a curve that is refused; one of a fine polygon is smaller.
KINK = 1e-2


def _components(value, s):
    """Two components at parameters s; one may be a constant."""
    if isinstance(value, (tuple, list)) and len(value) == 2:
        return [np.broadcast_to(v, s.shape) if np.ndim(v) == 0 else v for v in value]
    return value


def _on_curve(what, function, s):
    """A function of parameters s (n,) that returns (2, n), asked."""
    try:
        return ask_array(what, (2, len(s)), lambda s: _components(function(s), s), s)
    except CallbackError as error:
        raise CallbackError(f"{error}; the function takes parameters of shape (n,) and returns "
                            "positions of shape (2, n): a component that is constant is 0 * s + 1"
                            ) from error.__cause__


class Curve:
    """A plane curve r(s) with its derivative.

    Parameters
    ----------
    r, derivative
        Functions of parameters (n,) that return (2, n).
    ends
        The parameters between which they are defined.
    """

    def __init__(self, r: Callable[[Array], Any], derivative: Callable[[Array], Any],
                 ends: tuple[float, float]) -> None:
        self.r, self.derivative, self.ends = r, derivative, ends

    def __call__(self, s):
        return _on_curve("r(s)", self.r, s)

    def rate(self, s: Array) -> Array:
        """The derivative at parameters ``s``, shape (2, n)."""
        return _on_curve("the derivative of r", self.derivative, s)

    def nodes(self, s: Array) -> tuple[Array, Array]:
        """Positions and unit tangents at parameters ``s``, both of shape (2, n)."""
        p, d = self(s), self.rate(s)
        size = np.hypot(*d)
        if len(s) and np.min(size) <= 1e-12 * np.max(size):
            raise MeshError(f"the curve stands still at s = {s[np.argmin(size)]:.9g}: it has no "
                            "tangent there")
        return p, d / size

    def turning(self, s: Array) -> Array:
        """Derivative of the unit normal by the arc length at parameters ``s``, shape (2, n)."""
        dt = _differences(lambda x: self.nodes(x)[1], s, *self.ends)
        return np.array([-dt[1], dt[0]]) / np.hypot(*self.rate(s))

    def lengths(self, a: Array, b: Array) -> Array:
        """Arc lengths from parameters ``a`` to ``b``, both of shape (n,).

        Parameters
        ----------
        a, b
            Parameters where the pieces begin and end, shapes (n,).
        """
        d, w = self._at_gauss_points(a, b)
        return np.hypot(*d) @ w * (b - a)

    def check(self, s: Array) -> None:
        """Raise :class:`MeshError` if the derivative is not that of r between nodes ``s``."""
        d, w = self._at_gauss_points(s[:-1], s[1:])
        gap = np.hypot(*(d @ w * np.diff(s) - np.diff(self(s))))
        length = np.hypot(*d) @ w * np.diff(s)
        k = int(np.argmax(gap / length))
        if not gap[k] <= 0.02 * length[k]:
            raise MeshError(
                f"r jumps, or its derivative does not fit, between s = {s[k]:.9g} and "
                f"{s[k + 1]:.9g}: the derivative adds up to a point {gap[k]:.6g} from r")

    def check_kinks(self, s: Array) -> None:
        """Raise :class:`MeshError` if the direction of the curve jumps at a node inside.

        The angle between chords to both sides of a node falls with their length where the curve
        is smooth; at a kink it stays.
        """
        at = s[1:-1]
        if not len(at):
            return
        size, p = np.minimum(np.diff(s)[:-1], np.diff(s)[1:]), self(at)
        angles = []
        for part in (1e-3, 2.5e-4):
            before, after = p - self(at - part * size), self(at + part * size) - p
            cross = before[0] * after[1] - before[1] * after[0]
            angles.append(np.arctan2(cross, np.sum(before * after, axis=0)))
        # far from the origin chords that short have the direction of round-off
        chord = np.minimum(np.hypot(*before), np.hypot(*after))
        seen = chord * KINK > 32.0 * np.finfo(float).eps * np.max(np.abs(p))
        stays = seen & (np.abs(angles[1]) > 0.7 * np.abs(angles[0]))
        kink = np.where(stays, np.abs(angles[1]), 0.0)
        k = int(np.argmax(kink))
        if kink[k] > KINK:
            raise MeshError(
                f"the curve has a kink of {np.rad2deg(angles[1][k]):.3g} degrees at s = "
                f"{at[k]:.9g}: give one beam for each smooth part, and weld them in a scene with "
                'scene.joint("weld", ...)')

    def _at_gauss_points(self, a, b):
        x, w = _legendre()
        at = a[:, None] + (b - a)[:, None] * (0.5 + 0.5 * x)
        return np.reshape(self.rate(at.ravel()), (2,) + at.shape), 0.5 * w

    def moved(self, A: Array, shift: Array) -> Curve:
        """The curve ``A r(s) + shift``.

        Parameters
        ----------
        A, shift
            Shapes (2, 2) and (2,).
        """
        return Curve(_Moved(self, A, shift), _Moved(self.rate, A, np.zeros(2)), self.ends)

    def functions(self) -> list[tuple[str, Callable[[Array], Any]]]:
        """Pairs of a description and a function, for those that the curve was given."""
        r, rate = self.r, self.derivative
        while isinstance(r, _Moved):
            r, rate = r.function.r, r.function.derivative
        items = [("the curve r(s) of the mesh", r)]
        if not isinstance(rate, (_ComplexStep, _Differences)):
            items.append(("the derivative dr of the curve of the mesh", rate))
        return items


class _Moved:
    """``A f(s) + shift`` for a function f of parameters."""

    def __init__(self, function, A, shift):
        self.function, self.A, self.shift = function, A, shift

    def __call__(self, s):
        return self.A @ self.function(s) + self.shift[:, None]


class _ComplexStep:
    """The derivative of a function of parameters that takes complex ones."""

    def __init__(self, r):
        self.r = r

    def __call__(self, s):
        return np.imag(np.asarray(_components(self.r(s + 1e-30j), s))) / 1e-30


class _Differences:
    """The derivative of a function of parameters on [s0, s1] by differences."""

    def __init__(self, r, s0, s1):
        self.r, self.ends = r, (s0, s1)

    def __call__(self, s):
        return _differences(lambda s: _on_curve("r(s)", self.r, s), s, *self.ends)


def derivative_of(r: Callable[[Array], Any], s0: float, s1: float) -> Callable[[Array], Array]:
    """The derivative of ``r`` on [s0, s1]: complex step if exact, else sixth-order differences.

    Parameters
    ----------
    r
        Function of parameters (n,) that returns (2, n).
    s0, s1
        The ends of the parameters.
    """
    differences, complex_step = _Differences(r, s0, s1), _ComplexStep(r)
    try:
        probe = s0 + (s1 - s0) * np.linspace(0.0137, 0.991, 24)
        with warnings_as_errors():  # among them: the imaginary part is discarded
            exact, near = complex_step(probe), differences(probe)
        if exact.shape == near.shape and np.allclose(exact, near, rtol=1e-6,
                                                     atol=1e-6 * np.max(np.abs(near))):
            return complex_step
    except Exception:  # r is the user's: whatever it raises, it has no complex step
        logger.debug("the curve has no complex step; differences are used", exc_info=True)
    return differences


def _differences(r, s, s0, s1):
    """Derivative of a function on [s0, s1] by seven-point differences, of sixth order."""
    d = 1e-3 * (s1 - s0)
    k = STENCIL
    c = np.clip(s, s0 + 3 * d, s1 - 3 * d)  # the stencil stays inside
    values = np.array([np.asarray(r(c + i * d), dtype=np.float64) for i in k])
    x = (s - c) / d
    weights = np.zeros((len(k), len(x)))
    for coefficients in _lagrange_derivatives().T:
        weights = weights * x + coefficients[:, None]
    return np.einsum("is,ijs->js", weights, values) / d


@cache
def _lagrange_derivatives():
    """Of each Lagrange polynomial of the stencil the coefficients of its derivative, (7, 6)."""
    out = []
    for i, here in enumerate(STENCIL):
        others = np.delete(STENCIL, i)
        out.append(np.polyder(np.poly(others) / np.prod(here - others)))
    return np.array(out)


@cache
def _legendre():
    """Gauss points and weights of arc lengths, on [-1, 1]."""
    return np.polynomial.legendre.leggauss(12)


def check_curvature(curve: Curve, s: Array, height: float | Array) -> None:
    """Raise MeshError where the radius of curvature of the curve is below h/2.

    Parameters
    ----------
    curve
        The curve.
    s
        Parameters of the nodes, shape (n,).
    height
        Height of the section, or the largest between two nodes, shape (n - 1,).
    """
    at = np.unique(np.concatenate([np.linspace(a, b, 17) for a, b in itertools.pairwise(s)]))
    _, tangent = curve.nodes(at)
    angle = np.unwrap(np.arctan2(tangent[1], tangent[0]))
    kappa = np.abs(np.diff(angle)) / curve.lengths(at[:-1], at[1:])
    height = np.repeat(np.broadcast_to(height, len(s) - 1), 16)
    k = int(np.argmax(kappa * height))
    if kappa[k] * height[k] / 2 >= 1.0:
        raise MeshError(
            f"the curve folds near s = {at[k]:.6g}: its radius of curvature {1 / kappa[k]:.6g} is "
            f"below half the height {height[k] / 2:.6g}; use a smaller height or a gentler curve")
