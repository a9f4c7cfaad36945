"""The map from the reference cell to the reference configuration, tapers, nodal values."""

from collections.abc import Callable
from math import factorial, perm
from typing import Any

import numpy as np
from skfem.mapping import Mapping

from ..core import (Array, MeshError, ask_array, cached_property, hermite_basis, lagrange, refuse,
                    refuse_any, require_positive)
from .places import Inverse, InverseOfLines, cross, with_slope

#: Interpolation of sections with 1, 2, ... nodal derivatives along X, the 0th included.
SECTIONS = ("linear", "cubic", "quintic", "septic",
            *(f"of degree {degree}" for degree in (9, 11, 13, 15)))


# heights that vary along the axis: a cubic polynomial of xi in each element

#: Axial coordinates of the heights of an element, and points between at which the fit is checked.
PLACES, BETWEEN = np.arange(4) / 3.0, (1.0 + 2.0 * np.arange(3)) / 6.0


def scaled(function: Callable[[Array], Any], factor: float, s: Array) -> Array:
    return factor * np.asarray(function(s))


def heights_of(height: Any, s: Array, t: Array) -> tuple[float, Array | None, Any]:
    """Largest height, heights (4, ne) in the elements, and the function; None for a number."""
    if not callable(height):
        refuse(isinstance(height, (list, tuple)) or getattr(height, "ndim", 0) > 0, "height is a "
               "number or a function, as lambda x: np.interp(x, nodes, heights), got {!r}", height)
        return require_positive("height", height), None, None
    a, b = s[t]
    at = a + np.append(PLACES, BETWEEN)[:, None] * (b - a)
    found = ask_array("height(x)", (at.size,), height, at.ravel(), number=True)
    found = found.reshape(at.shape)
    refuse_any(found.ravel() <= 0.0, "the height of a beam is positive, got {:.6g} at {:.6g}",
               found.ravel(), at.ravel(), error=MeshError)
    heights, between = found[:4].copy(), found[4:]
    gap = np.max(np.abs(lagrange(PLACES, BETWEEN) @ heights - between) / between, axis=0)
    refuse_any(gap > 0.02, "the height in element {k}, from {:.6g} to {:.6g}, differs from a cubic "
               "by {:.1%}: use more elements, with a node at a kink", a, b, gap, error=MeshError)
    return float(np.max(heights)), heights, height


def halved(heights: Array, marked: Array) -> Array:
    """Heights (4, nelements) after halving the ``marked`` elements."""
    left, right = (lagrange(PLACES, a + 0.5 * PLACES) @ heights[:, marked] for a in (0.0, 0.5))
    out = np.repeat(heights, 1 + marked, axis=1)
    first = np.flatnonzero(marked) + np.arange(np.sum(marked))
    out[:, first], out[:, first + 1] = left, right
    return out


# higher nodal derivatives of a curved axis

def turned(d: Array) -> Array:
    """Vectors (2, ...) rotated by 90 degrees."""
    return np.array([-d[1], d[0]])


def nodal_derivatives(mesh: Any, most: int) -> list[Array]:
    """Position of the axis at the nodes, and ``most`` derivatives by arc length, all (2, n)."""
    # Position, tangent and curvature are those of the mesh. Higher derivatives are those of the
    # polynomial of degree 8 through these at the node and its two neighbours, with a position error
    # of order 9.
    known = [mesh.p, mesh.p_X]
    if most > 1 and mesh.p_XY is not None:
        known.append(-turned(mesh.p_XY))
    more = np.zeros((max(most - 2, 0), *mesh.p.shape))
    result = [*known[:most + 1], *more]
    if most <= 2 or mesh.is_straight:
        return result
    values_known: Any = np.array(known)
    apart = mesh.t[0, 1:] != mesh.t[1, :-1]
    at = np.cumsum(np.bincount(mesh.t[1], mesh.lengths, mesh.p.shape[1]))
    for a, b in zip(mesh.t[0, np.append(True, apart)], mesh.t[1, np.append(apart, True)]):
        few, nodes = min(3, b - a + 1), np.arange(a, b + 1)
        n, near = 3 * few, np.clip(nodes - 1, a, b + 1 - few)[:, None] + np.arange(few)
        x = at[near] - at[nodes, None]
        size = np.max(np.abs(x), axis=1)
        scale = size ** np.arange(n)[:, None]
        # conditions: the derivatives 0, 1, 2 of the powers at each place
        powers = np.array([[perm(k, d) * (x / size[:, None]) ** max(k - d, 0) for k in range(n)]
                           for d in range(3)]).transpose(2, 3, 0, 1).reshape(-1, n, n)
        values = values_known[:, :, near] * scale[:3, None, :, None]
        values = values.transpose(2, 3, 0, 1).reshape(-1, n, 2)
        found = np.linalg.solve(powers, values)
        for k in range(3, min(2 + len(more), n - 1) + 1):
            more[k - 3][:, nodes] = factorial(k) * found[:, k].T / scale[k]
    return result


#: Round-off in coefficients of relative heights.
NOTHING = 2e-14

#: Smallest height over the largest one that is more than round-off.
THIN = 1e-14
#: Points of both faces at which folds are detected.
_FACES = np.array([np.tile(np.linspace(0.0, 1.0, 9), 2), np.repeat([0.0, 1.0], 9)])


class MappingBeam(Mapping):
    """The map from the reference cell to the body: cubic axis, linearly interpolated directors.

    ``X(xi, eta) = sum_i H_i(xi) x_i + h (eta - 1/2) ((1 - xi) n_1 + xi n_2)`` with the cubic
    Hermite functions H_i, nodal positions and tangents x_i and section directors n_1, n_2.
    Every ANCF element of order 1 or more contains this map, so it represents the reference
    configuration and its rigid motions exactly. On a mesh with ``sections="cubic"``, for elements
    with cubic sections, the directors are interpolated by H_i as well; from "quintic" on both are
    interpolated by Hermite functions of that degree (:func:`.mapping.nodal_derivatives`). The
    height of a tapered beam is cubic in xi.

    Methods take reference points ``X`` = (xi, eta), shape (2, npoints) for all elements or
    (2, nelements, npoints), and elements ``tind`` (nelements,), None for all. They return arrays
    (..., nelements, npoints).
    """

    def __init__(self, mesh: Any) -> None:
        self.mesh = mesh
        self.dim = 2
        n = 1 + SECTIONS.index(mesh.sections)
        self._orders = max(2, n), n
        #: Coefficients (4, ne) of powers of xi in the height over the largest; None if constant.
        self.heights = None
        #: Degree of the height in xi: 0 if it is constant.
        self.height_degree = 0
        if mesh.heights is not None:
            self.heights = c = np.linalg.solve(
                np.vander(PLACES, increasing=True), mesh.heights) / mesh.height
            c[np.abs(c) <= NOTHING] = 0.0  # for a linear height
            self.height_degree = int(np.max(np.nonzero(np.any(c, axis=1))))

    # coefficients

    @cached_property
    def _all_coefficients(self):
        m, (k, n) = self.mesh, self._orders
        axis = nodal_derivatives(m, max(k - 1, n if n > 2 else 1))
        directors = [m.p_Y, m.p_XY, *(turned(d) for d in axis[3:])]
        axis, directors = (
            (np.array(values)[:, :, m.t] * (m.lengths ** np.arange(len(values))[:, None])[
                :, None, None]).transpose(1, 2, 0, 3).reshape(2, 2 * len(values), -1)
            for values in (axis[:k], directors[:n]))
        start = axis[:, 0].copy()
        axis[:, [0, k]] -= start[:, None]  # relative to the first node: less round-off
        return start, axis, m.height * directors

    def _vectors(self, kind, xi, tind, derivative=0, times=1.0):
        """The axis (kind 0) or the director (1), or a derivative by xi, times a factor."""
        coefficients = self._all_coefficients[1 + kind]
        coefficients = coefficients if tind is None else coefficients[:, :, tind]
        functions = times * hermite_basis(self._orders[kind], xi, derivative)
        if functions.ndim == 2:
            return coefficients.transpose(0, 2, 1) @ functions
        return np.einsum("ine,nep->iep", coefficients, functions)

    # heights

    def _relative(self, xi, tind):
        """Height over the largest height, and its derivative, (ne, np); 1 and 0 if constant."""
        if self.heights is None:
            return 1.0, 0.0
        return with_slope((self.heights if tind is None else self.heights[:, tind])[..., None],
                           np.asarray(xi))

    def height(self, xi: Array, tind: Array | None = None) -> tuple[Any, Any]:
        """Height of the section and its derivative by xi; numbers if it is constant."""
        g, rate = self._relative(xi, tind)
        return self.mesh.height * g, self.mesh.height * rate

    def offset(self, X: Array, tind: Array | None = None) -> Any:
        """Distance Y of reference points from the axis."""
        return self.height(X[0], tind)[0] * (X[1] - 0.5)

    # the map and its derivatives

    def F(self, X: Array, tind: Array | None = None) -> Array:
        """Points of the body, (2, nelements, npoints)."""
        axis = self._vectors(0, X[0], tind)
        across = self._vectors(1, X[0], tind, times=X[1] - 0.5)
        start = self._all_coefficients[0][:, slice(None) if tind is None else tind, None]
        return start + (axis + self._relative(X[0], tind)[0] * across)

    def _derivatives(self, X, tind):
        """Derivatives of :meth:`F` by xi and eta, and of the axis by xi, (2, ne, np) each."""
        xi, eta = X
        along, across = self._vectors(0, xi, tind, 1), self._vectors(1, xi, tind)
        turning = self._vectors(1, xi, tind, 1, eta - 0.5)
        g, rate = self._relative(xi, tind)
        return along + g * turning + (eta - 0.5) * rate * across, g * across, along

    def DF(self, X: Array, tind: Array | None = None) -> Array:
        """The Jacobian: derivatives of :meth:`F` by xi and eta, (2, 2, nelements, npoints)."""
        return np.stack(self._derivatives(X, tind)[:2], 1)

    def detDF(self, X: Array, tind: Array | None = None) -> Array:
        """The determinant of :meth:`DF`, (nelements, npoints)."""
        m = self.mesh
        if m.is_straight:
            return (m.lengths if tind is None else m.lengths[tind])[:, None] * (
                self.height(X[0], tind)[0] + 0.0 * X[0])
        return cross(*self.DF(X, tind).swapaxes(0, 1))

    def invDF(self, X: Array, tind: Array | None = None) -> Array:
        """The inverse of :meth:`DF`, (2, 2, nelements, npoints)."""
        J = self.DF(X, tind)
        return np.array([[J[1, 1], -J[0, 1]], [-J[1, 0], J[0, 0]]]) / cross(J[:, 0], J[:, 1])

    def full_volume(self, X: Array, tind: Array | None = None) -> Array:
        """Determinant of :meth:`DF` with section directors of unit length, (nelements, npoints)."""
        # directors interpolated between nodes are shorter; mass uses the given height
        if self.mesh.is_straight:
            return self.detDF(X, tind)
        along, across, axis = self._derivatives(X, tind)
        size = np.hypot(*across) / self.height(X[0], tind)[0]
        of_axis = cross(axis, across)
        return (of_axis + (cross(along, across) - of_axis) / size) / size

    def turning(self, X: Array, tind: Array | None = None) -> Array:
        """Derivative by xi of the unit-height section director, (2, nelements, npoints)."""
        return self._vectors(1, X[0], tind, 1) / self.mesh.height

    def frame(self, X: Array, tind: Array | None = None) -> Array:
        """Unit tangent ``frame[:, 0]`` and normal of the axis, (2, 2, nelements, npoints)."""
        d = self._vectors(0, X[0], tind, 1)
        x, y = d / np.hypot(*d)
        return np.array([[x, -y], [y, x]])

    def curvature(self, X: Array, tind: Array) -> Array:
        """Curvature of the axis, (nelements, npoints)."""
        d, dd = (self._vectors(0, X[0], tind, k) for k in (1, 2))
        return cross(d, dd) / np.hypot(*d) ** 3

    # the inverse

    @cached_property
    def inverse(self) -> Inverse:
        if self.mesh.is_straight:
            return InverseOfLines(self.mesh, self.heights)
        start, axis, director = self._all_coefficients
        return Inverse(start, axis, director, self.mesh.height, self.heights)

    def invF(self, x: Array, tind: Array | None = None) -> Array:
        """Reference points of points x (2, nelements, npoints), also outside the cell; or NaN."""
        return self.inverse(x, slice(None) if tind is None else tind)

    # facets

    def facet_points(self, X: Array, find: Array | None = None) -> tuple[Array, Array]:
        """Elements (nf,) and reference points (2, nf, np) of points (1, np) on facets."""
        m = self.mesh
        find = np.arange(m.nfacets, dtype=np.int32) if find is None else np.asarray(find)
        tind = m.f2t[0, find]
        local = np.argmax(m.t2f[:, tind] == find, axis=0)  # number of the facet in the element
        s = np.broadcast_to(X[0], (len(tind), X.shape[-1]))
        end = np.array([0.0, 1.0, 1.0, 0.0])[local][:, None] + 0.0 * s  # bottom, right, top, left
        return tind, np.where((local % 2 == 1)[:, None], [end, s], [s, end])

    def G(self, X: Array, find: Array | None = None) -> Array:
        """Positions of points (1, np) on facets, (2, nf, np)."""
        tind, points = self.facet_points(X, find)
        return self.F(points, tind)

    def detDG(self, X: Array, find: Array | None = None) -> Array:
        """Length of a facet per unit of its parameter, (nf, np)."""
        tind, points = self.facet_points(X, find)
        J, find = self.DF(points, tind), np.arange(self.mesh.nfacets) if find is None else find
        faces = np.asarray(find) >= self.mesh.p.shape[1]  # the others are sections
        return np.hypot(*np.where(faces[:, None], J[:, 0], J[:, 1]))

    def normals(self, X: Array, tind: Array, find: Array, t2f: Array) -> Array:
        """Unit normals of facets (nf,), outward from elements ``tind`` (nf,): (2, nf, np)."""
        local = np.argmax(t2f[:, tind] == find, axis=0)
        reference = self.mesh.elem.refdom.normals[local].T
        n = np.einsum("ijkl,ik->jkl", self.invDF(X, tind), reference)
        return n / np.hypot(*n)

    def check(self) -> None:
        """Raise :class:`MeshError` where the body is too thin, or folds: not one to one."""
        m = self.mesh
        if m.heights is not None:
            thin = np.min(self._relative(_FACES[0], None)[0], axis=1) <= THIN
            refuse_any(thin, "the height is zero to round-off in element {k}, which starts at {}",
                       m.p[:, m.t[0]], error=MeshError)
        least = m.lengths * m.height if m.is_straight and m.heights is None else (
            self.detDF(_FACES).min(axis=1))
        refuse_any(~(least > 0.0), "the body folds in element {k}, which starts at {:.6g}: use a "
                   "height below {:.6g} or more elements", m.p[:, m.t[0]], m.height,
                   error=MeshError)
