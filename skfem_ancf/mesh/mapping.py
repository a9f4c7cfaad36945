"""The map from the reference cell to the stress-free body of a beam."""

from __future__ import annotations

from functools import lru_cache, partial
from math import factorial, perm
from typing import TYPE_CHECKING, Any

import numpy as np
from skfem.mapping import Mapping

from ..core.errors import MeshError
from ..core.frozen import Content, read_only
from ..core.kept import cached_property
from .nodal import nodal_derivatives, turned
from .reference_cell import KEPT_POINTS, SECTIONS, few, hermite_basis
from .taper import powers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike

    from .chain import Chain
    from ..core.types import Array

#: Corrections of Newton's method that are small enough, and powers of xi in relative heights that
#: are round-off.
CLOSE, NOTHING = 1e-7, 2e-14

#: Points of both faces where a body is looked at for folds.
_FACES = np.array([np.tile(np.linspace(0.0, 1.0, 9), 2), np.repeat([0.0, 1.0], 9)])

_FACET_POINTS = (  # the point of the reference cell at X on facet bottom, right, top, left
    lambda s: (s, 0.0 * s), lambda s: (1.0 + 0.0 * s, s),
    lambda s: (s, 1.0 + 0.0 * s), lambda s: (0.0 * s, s),
)


def cross(a: Array, b: Array) -> Array:
    """The out-of-plane component of a x b of vectors (2, ...).

    Parameters
    ----------
    a, b
        Vectors, shape (2, ...).

    Returns
    -------
    ndarray
        Shape (...).
    """
    return a[0] * b[1] - a[1] * b[0]


def _with_slope(coefficients, xi):
    """As :func:`polynomial`, and the derivative."""
    if len(coefficients) == 2:  # of nearly all directors, axes, and both, for single points
        a, b = coefficients
        return a + xi * b, b + 0.0 * xi
    if len(coefficients) == 4:
        a, b, c, d = coefficients
        return a + xi * (b + xi * (c + xi * d)), b + xi * (2.0 * c + xi * (3.0 * d))
    if len(coefficients) == 5:
        a, b, c, d, e = coefficients
        return (a + xi * (b + xi * (c + xi * (d + xi * e))),
                b + xi * (2.0 * c + xi * (3.0 * d + xi * (4.0 * e))))
    value, slope = coefficients[-1], 0.0
    for c in coefficients[-2::-1]:
        slope = value + xi * slope
        value = c + xi * value
    return value, slope


def polynomial(coefficients: Sequence[Any], x: Any) -> Any:
    """A polynomial by Horner's rule.

    Parameters
    ----------
    coefficients
        The lowest first: numbers, or arrays (...).
    x
        A number, or an array (...).
    """
    if len(coefficients) == 2:
        a, b = coefficients
        return a + x * b
    if len(coefficients) == 4:
        a, b, c, d = coefficients
        return a + x * (b + x * (c + x * d))
    value = coefficients[-1]
    for c in coefficients[-2::-1]:
        value = c + x * value
    return value


def _crossed(a, b):
    """The cross product of polynomials (2, n, ne) and (2, m, ne), the lowest coefficients first."""
    n, m = a.shape[1], b.shape[1]
    out = np.zeros((n + m - 1, a.shape[2]))
    for k in range(n):
        out[k:k + m] += cross(a[:, k], b)
    return out


@lru_cache(16)
def _taylor(m):
    """From the functions' factors to coefficients of powers of xi, of m derivatives a node."""
    return read_only(np.array([hermite_basis(m, np.zeros(1), d)[:, 0] / factorial(d)
                               for d in range(2 * m)]))


def _sorted(director, crossed):
    """The coefficients of :attr:`MappingBeam._powers` as :func:`beside_section` takes them."""
    return list(zip(crossed, *director)), list(crossed[len(director[0]):])


def beside_section(turning: list[Any], rest: list[Any], gap: Sequence[Any]) -> list[Any]:
    """How far a point is beside the section of an element, times the height: a polynomial of xi.

    The cross product of what leads from the axis to the point, and of the director: it does not
    depend on eta, and vanishes where the section holds the point.

    Parameters
    ----------
    turning
        For each power of xi in the director the coefficients of minus the cross product of axis and
        director, and of both components of the director, the lowest power first: numbers or arrays
        (...). The axis begins at zero.
    rest
        Those of the cross product with higher powers.
    gap
        The point seen from where the axis begins, two components.
    """
    x, y = gap
    return [c + (x * ny - y * nx) for c, nx, ny in turning] + rest


def height_in_section(axis: Any, director: Any, gap: Sequence[Any], xi: Any, height: Any) -> Any:
    """The place eta of a point across the section that holds it.

    Parameters
    ----------
    axis
        As ``director``, of the axis: it begins at zero.
    director
        For each component the coefficients of a polynomial of xi, the lowest first: numbers or
        arrays (...).
    gap
        As for :func:`beside_section`.
    xi, height
        The place of the section along the element, and its height over that of the director.
    """
    rx, ry = polynomial(axis[0], xi), polynomial(axis[1], xi)
    nx, ny = polynomial(director[0], xi), polynomial(director[1], xi)
    return 0.5 + ((gap[0] - rx) * nx + (gap[1] - ry) * ny) / ((nx * nx + ny * ny) * height)


def _functions(orders, X):
    """At points the derivatives of the functions of the axis by xi, the functions of the director,
    and their derivatives times eta - 1/2."""
    (m, n), (xi, eta) = orders, X
    return hermite_basis(m, xi, 1), hermite_basis(n, xi), (eta - 0.5) * hermite_basis(n, xi, 1)


@lru_cache(256)
def _kept_functions(orders, powers, content):
    """Those as one matrix, by which axis and director of an element are multiplied, one behind the
    other, for the three; of the director times as many powers of xi, of a height."""
    X, = content.arrays
    slopes, across, turning = (f[:, None] for f in _functions(orders, X))
    power, rate = np.split(_kept_powers(Content(X[0]))[:powers], 2, axis=1)
    axis = np.append(slopes, np.zeros((len(slopes), 2, X.shape[1])), axis=1)
    director = np.stack([0.0 * across * power, across * power,
                         turning * power + (X[1] - 0.5) * across * rate], axis=2)
    return read_only(np.append(axis.ravel(), director).reshape(-1, 3 * X.shape[1]))


@lru_cache(256)
def _kept_powers(content):
    """Of 1, xi, xi^2 and xi^3 the values at places (n,), and behind them the derivatives; (4, 2 n).
    """
    xi, = content.arrays
    value = xi ** np.arange(4)[:, None]
    return read_only(np.append(value, np.arange(4)[:, None] * np.roll(value, 1, axis=0), axis=1))


def _frame(tangent):
    """The frame of :meth:`MappingBeam.frame` of unit tangents."""
    x, y = tangent
    return np.array([[x, -y], [y, x]])


def _unit(d):
    """Vectors (2, ...) of length 1."""
    return d / np.sqrt(d[0] ** 2 + d[1] ** 2)


class MappingBeam(Mapping):
    """Reference cell to body: a cubic axis and sections that turn linearly between the nodes.

    ``X(xi, eta) = sum_i H_i(xi) x_i + h (eta - 1/2) ((1 - xi) n_1 + xi n_2)`` with the cubic
    Hermite functions H_i, nodal positions and tangents x_i and section directors n_1, n_2.
    Every ANCF element of order 1 or more contains this map, so the stress-free state, and
    any rigid motion of it, is represented exactly. On a mesh with ``sections="cubic"``, for
    elements whose sections are cubic too, the directors are interpolated by H_i as well; with
    "quintic" and the names beyond, for elements of that degree, both are interpolated by Hermite
    functions of that degree (:func:`.nodal.nodal_derivatives`). The height h of a tapered beam is
    cubic in xi.

    Parameters
    ----------
    mesh
        A :class:`~skfem_ancf.MeshBeam`.
    """

    def __init__(self, mesh: Chain) -> None:
        self.mesh = mesh
        self.dim = 2

    def _coefficients(self, tind):
        """Axis (2, 4, ne) and director (2, 2 or 4, ne) coefficients of the elements ``tind``."""
        axis, director = self._all_coefficients
        return (axis, director) if tind is None else (axis[:, :, tind], director[:, :, tind])

    @cached_property
    def _all_coefficients(self):
        m, (k, n) = self.mesh, self._orders
        axis = nodal_derivatives(m, max(k - 1, n if n > 2 else 1))
        directors = [m.p_Y, m.p_XY, *(turned(d) for d in axis[3:])]
        axis, directors = (
            (np.array(values)[:, :, m.t] * (m.lengths ** np.arange(len(values))[:, None])[
                :, None, None]).transpose(1, 2, 0, 3).reshape(2, 2 * len(values), -1)
            for values in (axis[:k], directors[:n]))
        return axis, m.height * directors

    @cached_property
    def _matrices(self):
        """Both in one matrix for each element, (2, ne, n), directors times heights."""
        axis, director = self._all_coefficients
        if self.mesh.heights is not None:
            director = (director[:, :, None] * self._heights).reshape(2, -1, director.shape[-1])
        return np.concatenate([axis, director], axis=1).transpose(0, 2, 1)

    @property
    def _orders(self):
        """How many derivatives of the axis and of the director a node has, the 0th included."""
        n = 1 + SECTIONS.index(self.mesh.sections)
        return max(2, n), n

    def _axis(self, xi, derivative=0):
        """The functions of xi that interpolate the axis."""
        return hermite_basis(self._orders[0], xi, derivative)

    @cached_property
    def _constant(self):
        """Derivatives by xi and eta of straight elements of one height, (2, 2, ne), or None."""
        m = self.mesh
        if not m.is_straight or m.heights is not None or m.sections != "linear":
            return None
        return np.stack([m.p[:, m.t[1]] - m.p[:, m.t[0]], m.height * m.p_Y[:, m.t[0]]], 1)

    def _everywhere(self, constant, X, tind):
        """What is constant in each element, (2, 2, ne), at the points of :meth:`F`."""
        constant = constant if tind is None else constant[:, :, tind]
        return np.repeat(constant[..., None], X.shape[-1], axis=-1)

    def _director(self, xi, derivative=0):
        """The functions of xi that interpolate the section director."""
        return hermite_basis(self._orders[1], xi, derivative)

    @cached_property
    def _heights(self):
        """Coefficients of the heights of a tapered beam, relative to the largest."""
        c = powers(self.mesh.heights) / self.mesh.height
        c[np.abs(c) <= NOTHING] = 0.0  # of a height that is linear
        return c

    def height(self, xi: Array, tind: Array | None = None) -> tuple[Any, Any]:
        """The height of the section and its derivative by xi.

        Parameters
        ----------
        xi
            Places along the elements, shape (npoints,) or (nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        h, rate
            Shape (nelements, npoints) both; numbers where the height is constant.
        """
        if self.mesh.heights is None:
            return self.mesh.height, 0.0
        g, rate = self._relative(xi, tind)
        return self.mesh.height * g, self.mesh.height * rate

    def _relative(self, xi, tind):
        """The height over the largest, and its derivative, (ne, np); 1 and 0 where constant."""
        if self.mesh.heights is None:
            return 1.0, 0.0
        c, xi = self._heights if tind is None else self._heights[:, tind], np.asarray(xi)
        if xi.ndim == 1 and xi.size <= KEPT_POINTS:
            both = c.T @ _kept_powers(Content(xi))
            return both[:, :xi.size], both[:, xi.size:]
        return _with_slope(c[:, :, None], xi)

    def relative_height(self, e: Any, xi: Any) -> tuple[Any, Any]:
        """The height of a tapered mesh over the largest, and its derivative by xi.

        Parameters
        ----------
        e, xi
            Element and place along it: numbers, or elements (n,) and places (..., n).

        Returns
        -------
        tuple
            Two numbers, or arrays (..., n).
        """
        return _with_slope(self._heights.take(e, axis=-1), xi)

    def heights_of(self, e: Any) -> Callable[[Any], tuple[Any, Any]] | None:
        """From places along elements what :meth:`relative_height` says of them, or None.

        Parameters
        ----------
        e
            Elements, as there.
        """
        return None if self.mesh.heights is None else partial(self.relative_height, e)

    @cached_property
    def height_degree(self) -> int:
        """That of the heights as polynomials of xi: 0 where they are constant."""
        if self.mesh.heights is None:
            return 0
        return int(np.max(np.nonzero(np.any(self._heights, axis=1))))

    def offset(self, X: Array, tind: Array | None = None) -> Any:
        """Distance Y of reference points from the axis.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (nelements, npoints), or as ``X[1]`` where the height is constant.
        """
        return self.height(X[0], tind)[0] * (X[1] - 0.5)

    @staticmethod
    def _sum(coefficients, functions):
        """Combine (2, n, ne) coefficients with functions (n, np) or (n, ne, np)."""
        if functions.ndim == 2:
            return np.einsum("ine,np->iep", coefficients, functions)
        return np.einsum("ine,nep->iep", coefficients, functions)

    def F(self, X: Array, tind: Array | None = None) -> Array:
        """The points of the body of reference points.

        Parameters
        ----------
        X
            Reference points (xi, eta), shape (2, npoints) or (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        ndarray
            Shape (2, nelements, npoints).
        """
        axis, director = self._coefficients(tind)
        xi, eta = X
        across = self._sum(director, (eta - 0.5) * self._director(xi))
        if self.mesh.heights is not None:
            across *= self._relative(xi, tind)[0]
        return self._sum(axis, self._axis(xi)) + across

    def DF(self, X: Array, tind: Array | None = None) -> Array:
        """The Jacobian: derivatives of :meth:`F` by xi and eta.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (2, 2, nelements, npoints).
        """
        if self._constant is not None:
            return self._everywhere(self._constant, X, tind)
        a, across, _ = self._derivatives(X, tind)
        return np.stack([a, across], 1)

    def _derivatives(self, X, tind):
        """Derivatives of :meth:`F` by xi and eta, and of the axis by xi, (2, ne, np) each."""
        if few(X):
            of = self._matrices if tind is None else self._matrices[:, tind]
            found = of @ _kept_functions(
                self._orders, 1 if self.mesh.heights is None else 4, Content(X))
            along, across, turning = found.reshape(*of.shape[:2], 3, X.shape[1]).transpose(
                2, 0, 1, 3)
            return along + turning, across, along
        axis, director = self._coefficients(tind)
        slopes, functions, turned = _functions(self._orders, X)
        along, across = self._sum(axis, slopes), self._sum(director, functions)
        turning = self._sum(director, turned)
        if self.mesh.heights is not None:
            g, rate = self._relative(X[0], tind)
            turning, across = g * turning + (X[1] - 0.5) * rate * across, g * across
        return along + turning, across, along

    def detDF(self, X: Array, tind: Array | None = None) -> Array:
        """The determinant of :meth:`DF`.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (nelements, npoints).
        """
        if self._constant is not None:
            return cross(*self.DF(X, tind).swapaxes(0, 1))
        a, b, _ = self._derivatives(X, tind)
        return cross(a, b)

    def full_volume(self, X: Array, tind: Array | None = None) -> Array:
        """The determinant of :meth:`DF` with directors of length 1.

        Those that are interpolated between nodes are shorter: halfway between two that differ by
        an angle theta by the factor cos(theta / 2). Bodies weigh what their height says.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (nelements, npoints).
        """
        if self.mesh.is_straight:
            return self.detDF(X, tind)
        along, across, axis = self._derivatives(X, tind)
        size = np.hypot(*across) / self.height(X[0], tind)[0]
        of_axis = cross(axis, across)
        return (of_axis + (cross(along, across) - of_axis) / size) / size

    def invDF(self, X: Array, tind: Array | None = None) -> Array:
        """The inverse of :meth:`DF`.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (2, 2, nelements, npoints).
        """
        J = self.DF(X, tind)
        return np.array([[J[1, 1], -J[0, 1]], [-J[1, 0], J[0, 0]]]) / cross(J[:, 0], J[:, 1])

    def turning(self, X: Array, tind: Array | None = None) -> Array:
        """Derivative by xi of the unit-height section director, shape (2, nelements, npoints).

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).
        """
        _, director = self._coefficients(tind)
        return self._sum(director, self._director(X[0], 1)) / self.mesh.height

    def frame(self, X: Array, tind: Array | None = None) -> Array:
        """The beam's own frame: ``frame[:, 0]`` the axis tangent, ``frame[:, 1]`` its normal.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (2, 2, nelements, npoints), orthonormal, the same across a section.
        """
        if self._constant is not None:
            return self._everywhere(_frame(self._constant[:, 0] / self.mesh.lengths), X, tind)
        axis, _ = self._coefficients(tind)
        return _frame(_unit(self._sum(axis, self._axis(X[0], 1))))

    def in_frame(self, X: Array, tind: Array | None = None) -> tuple[Array, Array]:
        """Derivatives of xi and eta along the axis and across it, and the :meth:`frame`.

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        rates, frame
            Shape (2, 2, nelements, npoints) both: ``rates[0]`` those along the axis.
        """
        if self._constant is not None:
            J, frame = self.DF(X, tind), self.frame(X, tind)
            a, b = J[:, 0], J[:, 1]
        else:
            a, b, along = self._derivatives(X, tind)
            frame = _frame(_unit(along))
        x, y = frame[:, 0]
        rates = np.empty_like(frame)
        rates[0, 0], rates[0, 1] = x * b[1] - y * b[0], y * a[0] - x * a[1]
        rates[1, 0], rates[1, 1] = -x * b[0] - y * b[1], x * a[0] + y * a[1]
        rates /= cross(a, b)
        return rates, frame

    @cached_property
    def _powers(self):
        """Axis from the first node, and director, as polynomials of xi, (2, n, ne) both.

        And minus their cross product, (n, ne). The director is that of the largest height: where
        the section is that holds a point does not depend on how high it is.
        """
        axis, director = self._all_coefficients
        axis = axis.copy()
        axis[:, [0, self._orders[0]]] -= axis[:, :1]
        axis, director = (_taylor(m) @ c for m, c in zip(self._orders, (axis, director)))
        return [axis, director, -_crossed(axis, director)]

    def invF(self, x: Array, tind: Array | None = None, max_iterations: int = 30,
             xi: ArrayLike = 0.5) -> Array:
        """The reference points of points of the body, by Newton's method; outside the cell too.

        Parameters
        ----------
        x
            Points, shape (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.
        max_iterations
            Corrections at most.
        xi
            To start from, of any shape that fits (nelements, npoints).

        Returns
        -------
        ndarray
            Shape (2, nelements, npoints); NaN where no such point was found.
        """
        first = self._all_coefficients[0][:, 0]
        axis, director, crossed = ((c if tind is None else c.take(tind, axis=-1))[..., None]
                                   for c in self._powers)
        gap = x - (first if tind is None else first.take(tind, axis=1))[:, :, None]
        turning, rest = _sorted(director, crossed)
        beside = beside_section(turning, rest, gap)
        X = np.empty(x.shape)
        X[0] = xi
        for _ in range(max_iterations):
            value, slope = _with_slope(beside, X[0])
            change = value / slope
            X[0] -= np.clip(change, -1.0, 1.0)
            # the square of the last correction is left
            far = np.abs(change) > CLOSE * (1.0 + np.abs(X[0]))
            if not np.any(far):
                break
        X[1] = height_in_section(axis, director, gap, X[0], self._relative(X[0], tind)[0])
        X[:, far] = np.nan
        return X

    def derivatives(self, e: Any, xi: Any, eta: Any) -> tuple[Any, Any, Any]:
        """The derivatives of the map by xi and eta, and the tangent of the axis.

        Parameters
        ----------
        e, xi, eta
            Elements (n,) and reference points, arrays (..., n).

        Returns
        -------
        tuple
            Three vectors, each a pair of arrays (..., n).
        """
        axis, director = (c.take(e, axis=-1) for c in self._powers[:2])
        dx, dy = _with_slope(axis[0], xi)[1], _with_slope(axis[1], xi)[1]
        (nx, dnx), (ny, dny) = _with_slope(director[0], xi), _with_slope(director[1], xi)
        if self.mesh.heights is not None:
            g, rate = self.relative_height(e, xi)
            dnx, dny, nx, ny = g * dnx + rate * nx, g * dny + rate * ny, g * nx, g * ny
        Y, size = eta - 0.5, (dx * dx + dy * dy) ** 0.5
        return (dx + Y * dnx, dy + Y * dny), (nx, ny), (dx / size, dy / size)

    def curvature(self, X: Array, tind: Array) -> Array:
        """Curvature of the axis, shape (nelements, npoints).

        Parameters
        ----------
        X, tind
            As for :meth:`F`, shapes (2, nelements, npoints) and (nelements,).
        """
        axis = self._powers[0].take(tind, axis=-1)[..., None]
        (x, y), (dx, dy) = ([polynomial([perm(k, d) * c for k, c in enumerate(row)][d:], X[0])
                             for row in axis] for d in (1, 2))
        return (x * dy - y * dx) / (x * x + y * y) ** 1.5

    def _facet_elements(self, find):
        """One element of each facet, and the local number of the facet in it."""
        m = self.mesh
        find = np.arange(m.nfacets, dtype=np.int32) if find is None else np.asarray(find)
        tind = m.f2t[0, find]
        return tind, np.argmax(m.t2f[:, tind] == find, axis=0)

    def facet_points(self, X: Array, find: Array | None = None) -> tuple[Array, Array]:
        """Elements and reference points of points of facets.

        Parameters
        ----------
        X
            Points along the facets, shape (1, np) or (1, nf, np), in [0, 1].
        find
            Numbers of facets, shape (nf,), or None for all.

        Returns
        -------
        tind, points
            Shapes (nf,) and (2, nf, np).
        """
        tind, local = self._facet_elements(find)
        s = np.broadcast_to(X[0], (len(tind), X.shape[-1]))
        points = np.empty((2,) + s.shape)
        for k, place in enumerate(_FACET_POINTS):
            points[:, local == k] = place(s[local == k])
        return tind, points

    def G(self, X: Array, find: Array | None = None) -> Array:
        """The points of the body of points along facets.

        Parameters
        ----------
        X, find
            As for :meth:`facet_points`, shapes (1, np) or (1, nf, np), and (nf,).

        Returns
        -------
        ndarray
            Shape (2, nf, np).
        """
        tind, points = self.facet_points(X, find)
        return self.F(points, tind)

    def detDG(self, X: Array, find: Array | None = None) -> Array:
        """The length of a facet for a unit of its parameter.

        Parameters
        ----------
        X, find
            As for :meth:`facet_points`, shapes (1, np) or (1, nf, np), and (nf,).

        Returns
        -------
        ndarray
            Shape (nf, np).
        """
        tind, points = self.facet_points(X, find)
        _, local = self._facet_elements(find)
        J = self.DF(points, tind)
        along = np.where((local % 2 == 0)[:, None], J[:, 0], J[:, 1])
        return np.sqrt(along[0] ** 2 + along[1] ** 2)

    def normals(self, X: Array, tind: Array, find: Array, t2f: Array) -> Array:
        """Unit normals of facets, outward from the elements ``tind``.

        Parameters
        ----------
        X
            Reference points on the facets, shape (2, nf, np).
        tind
            An element of each facet, shape (nf,).
        find
            Numbers of the facets, shape (nf,).
        t2f
            Facets of all elements, shape (4, nelements).

        Returns
        -------
        ndarray
            Shape (2, nf, np).
        """
        local = np.argmax(t2f[:, tind] == find, axis=0)
        reference = self.mesh.elem.refdom.normals[local].T
        n = np.einsum("ijkl,ik->jkl", self.invDF(X, tind), reference)
        return n / np.sqrt(n[0] ** 2 + n[1] ** 2)

    def check(self) -> None:
        """Raise :class:`MeshError` where the body folds: the map is not one to one."""
        J = self._constant
        if J is not None and np.all(cross(J[:, 0], J[:, 1]) > 0.0):
            return  # they are rectangles
        least = self.detDF(_FACES).min(axis=1)
        if not least.min() > 0.0:
            bad = np.nonzero(~(least > 0.0))[0]
            at = self.mesh.p[:, self.mesh.t[0, bad[0]]]
            raise MeshError(
                f"the body folds in element {bad[0]}, which starts at ({at[0]:.6g}, {at[1]:.6g}): "
                f"the radius of curvature is below half the height {self.mesh.height:.6g}, or the "
                "elements are too long for the curve; use a smaller height, a gentler curve or "
                "more elements")
