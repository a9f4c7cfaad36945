"""Places on a beam: a boundary, a material point, a function, facets; the location of points."""

import numbers
from collections.abc import Callable
from math import factorial
from typing import Any, cast

import numpy as np
import scipy
from numpy.polynomial.polynomial import polyder, polyval

from ..core import (Array, ArrayLike, CallbackError, InputError, MeshError, Place, ask,
                    cached_property, hermite_basis, is_masked, refuse, refuse_any, require_option,
                    require_point, shown)

EPS = float(np.finfo(float).eps)
#: A distance outside of elements that have no such point.
FARTHEST = float(np.finfo(float).max)

#: Tolerance and largest number of Newton iterations.
CLOSE, ITERATIONS = 1e-7, 30

#: Samples of each element in the search tree.
SAMPLES = 4


def with_slope(coefficients: Array, xi: Any) -> tuple[Any, Any]:
    """A polynomial with coefficients (n, ...), lowest first, and its derivative."""
    return (polyval(xi, coefficients, tensor=False),
            polyval(xi, polyder(coefficients), tensor=False))


class Inverse:
    """The map from the body to the reference cell, from the Hermite coefficients of axis (relative
    to ``start``) and director (times the largest height), and powers of the relative height."""

    def __init__(self, start: Array, axis: Array, director: Array, height: float,
                 heights: Array | None) -> None:
        self.start = start
        self.axis, self.director = (np.array([
            hermite_basis(c.shape[1] // 2, np.zeros(1), d)[:, 0] / factorial(d)
            for d in range(c.shape[1])]) @ c for c in (axis, director))
        n, m = self.axis.shape[1], self.director.shape[1]
        #: Minus the cross product of both; the axial coordinate does not depend on the height.
        self.crossed = np.zeros((n + m - 1, axis.shape[2]))
        for k in range(n):
            self.crossed[k:k + m] -= cross(self.axis[:, k, None], self.director)
        self.largest, self.heights = height, heights

    def height(self, e: Any, xi: Array) -> Any:
        """Height at axial coordinates xi (n, ...) of elements e (n,)."""
        if self.heights is None:
            return self.largest
        return self.largest * polyval(xi, self.heights[:, e, None], tensor=False)

    def __call__(self, x: Array, e: Any) -> Array:
        """Reference points of points (2, n, npoints) of elements e, by Newton's method; or NaN."""
        axis, director, crossed = (
            c[..., e, None] for c in (self.axis, self.director, self.crossed))
        gap = x - self.start[:, e, None]
        # (point - axis) x director vanishes at the section through the point
        crossed = np.broadcast_to(crossed, (len(crossed), *gap.shape[1:])).copy()
        crossed[:director.shape[1]] += cross(gap[:, None], director)
        X = np.full(x.shape, 0.5)
        for _ in range(ITERATIONS):
            value, slope = with_slope(crossed, X[0])
            change = value / slope
            X[0] -= np.clip(change, -1.0, 1.0)
            # the square of the last correction is left
            far = np.abs(change) > CLOSE * (1.0 + np.abs(X[0]))
            if not np.any(far):
                break
        r, n = (np.array([polyval(X[0], c, tensor=False) for c in of]) for of in (axis, director))
        X[1] = 0.5 + np.sum((gap - r) * n, axis=0) * self.largest / (
            np.sum(n * n, axis=0) * self.height(e, X[0]))
        X[:, far] = np.nan
        return X


def cross(a: Array, b: Array) -> Array:
    """The out-of-plane component of a x b for vectors (2, ...)."""
    return a[0] * b[1] - a[1] * b[0]


class InverseOfLines(Inverse):
    """The same for a mesh of straight elements, with the coordinates of a point on the chord."""

    def __init__(self, mesh: Any, heights: Array | None) -> None:
        left, right = mesh.t
        self.start = mesh.p[:, left]
        self.chord = mesh.p[:, right] - self.start
        self.square = self.chord[0] * self.chord[0] + self.chord[1] * self.chord[1]
        self.largest, self.heights = mesh.height, heights

    def __call__(self, x: Array, e: Any) -> Array:
        gap, X = x - self.start[:, e, None], np.empty(x.shape)
        chord, square = self.chord[:, e, None], self.square[e, None]
        X[0] = (chord[0] * gap[0] + chord[1] * gap[1]) / square
        X[1] = 0.5 + cross(chord, gap) / (np.sqrt(square) * self.height(e, X[0]))
        return X


class Finder:
    """Finds the elements of a :class:`~skfem_ancf.MeshBeam` that contain points, vectorised."""

    def __init__(self, mesh: Any) -> None:
        self.mesh, self.mapping, self.is_chain = mesh, mesh.mapping(), mesh.is_chain
        self.size = float(np.abs(mesh.p).max())
        # points of an exact curve may lie a little outside its cubic elements
        self.allowed = 1e-6 if mesh.is_straight else 1e-3
        #: Tolerance of equal distances from axes.
        self.equal = 1e-8 * mesh.height

    def find(self, x: Array, chain: int | None = None) -> tuple[Array, Array, Array, Array]:
        """Elements (n,), reference points (2, n), relative distances outside of them (zero, or
        infinite or not a number far away) for points (2, n) of a ``chain`` or of all, and whether
        chains are equally near."""
        with np.errstate(all="ignore"):
            n = x.shape[1]
            noise = 1e-9 + 8 * EPS * (
                self.size + np.abs(x).max(initial=0.0)) / self.mesh.height
            if self._line is not None:
                d, first, start = self._line
                along, across = d @ (x - first)
                # a point of the section between two elements is one of the left
                e = (start + noise * self.mesh.lengths)[1:].searchsorted(along)
                xi = (along - start[e]) / self.mesh.lengths[e]
                h = self.mesh.height if self.mesh.heights is None else (
                    self.mapping.height(xi[:, None], e)[0][:, 0])
                X = np.array([xi, 0.5 + across / h])
                return (e, np.minimum(np.maximum(X, 0.0), 1.0), self._outside(X, noise),
                        np.zeros(n, dtype=bool))
            if chain is not None or not self.is_chain:
                return self._best(x, noise, *self._pairs(x, chain))
            found = self._best(x, noise, np.arange(n), self._tree.query(x.T)[1] // SAMPLES)
            # outside, in another element than the nearest sample, or on a section
            left = np.flatnonzero((found[2] > 0.0) | (found[1][0] <= noise))
            if len(left):
                for old, new in zip(found, self._best(x[:, left], noise, *self._pairs(x[:, left]))):
                    old[..., left] = new
            return found

    def _best(self, x, noise, k, some):
        """The elements of :meth:`find` from pairs of points k and elements, (m,) each."""
        e, X = np.zeros(x.shape[1], dtype=int), np.zeros(x.shape)
        outside, least = np.full((2, x.shape[1]), np.inf)
        Y = self.mapping.inverse(x[:, k, None], some)[..., 0]
        gap, Y = self._outside(Y, noise), np.minimum(np.maximum(Y, 0.0), 1.0)
        np.minimum.at(outside, k, gap)
        on = gap <= outside[k]
        k, some, Y = k[on], some[on], Y[:, on]
        # of several elements that contain a point that with the nearest axis, and of two the left
        off = self.from_axis(some, Y)
        np.minimum.at(least, k, off)
        on = off <= least[k] + self.equal
        k, some, Y = k[on], some[on], Y[:, on]
        order = np.lexsort((some, k))[::-1]
        e[k[order]], X[:, k[order]] = some[order], Y[:, order]  # the last one stays
        tied, chains = np.zeros(x.shape[1], dtype=bool), self.mesh.chains
        np.logical_or.at(tied, k, chains[some] != chains[e[k]])
        return e, X, outside, tied

    def _pairs(self, x, chain=None):
        """Pairs of points (2, n) and elements whose bounding circles contain them, (2, k)."""
        pairs, points = [], scipy.spatial.cKDTree(x.T)
        for elements, tree, radius in self._groups:
            found = points.sparse_distance_matrix(tree, radius, output_type="ndarray")
            pairs.append([found["i"], elements[found["j"]]])
        found = np.concatenate(pairs, axis=1)
        return found if chain is None else found[:, self.mesh.chains[found[1]] == chain]

    @cached_property
    def _groups(self):
        """Elements of circles of similar size, a tree of their centres, and the largest radius."""
        middle, radius = self._circles
        level = np.floor(np.log2(radius)).astype(int)
        groups = [np.flatnonzero(level == k) for k in np.unique(level)]
        return [(some, scipy.spatial.cKDTree(middle[:, some].T), radius[some].max())
                for some in groups]

    @cached_property
    def _tree(self):
        samples = np.array([(np.arange(SAMPLES) + 0.5) / SAMPLES, np.full(SAMPLES, 0.5)])
        return scipy.spatial.cKDTree(self.mapping.F(samples).reshape(2, -1).T)

    def inside(self, x: Array, chain: int | None = None) -> tuple[Array, Array, Array]:
        """As :meth:`find`, but raises MeshError for points outside the body, or the chain."""
        e, X, outside, tied = self.find(x, chain)
        bad, mesh = ~(outside <= self.allowed), self.mesh
        if bad.any():
            refuse_any(bad, "the point {:.9g} is outside {}{}: the reference configuration has the "
                       "height {:.6g}, and its axis runs from {} to {}; {}", x,
                       "the body" if chain is None else "the line that was named",
                       f" ({bad.sum()} of {len(bad)} points are)" * (len(bad) > 1), mesh.height,
                       mesh.p[:, 0].tolist(), mesh.p[:, -1].tolist(), self.extent, error=MeshError)
        return e, X, tied

    def from_axis(self, e: Array, X: Array) -> Array:
        """Distance of reference points (2, n) of elements (n,) from the axis, shape (n,)."""
        return np.abs(X[1] - 0.5) * np.ravel(self.mapping.inverse.height(e, X[0][:, None]))

    @cached_property
    def _circles(self):
        """Centres (2, nelements) and radii (nelements,) of bounding circles."""
        middle = self.mapping.F(np.array([[0.5], [0.5]])).reshape(2, -1)
        return middle, 0.51 * (self.mesh.lengths + self.mesh.height)

    @staticmethod
    def _outside(X, noise):
        out = np.maximum(*np.abs(X - 0.5)) - 0.5
        out[out < noise] = 0.0
        out[np.isnan(out)] = FARTHEST
        return out

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Least and largest coordinates of a bounding box of the body, (2, 1) each."""
        middle, radius = self._circles
        return ((middle - radius).min(axis=1, keepdims=True),
                (middle + radius).max(axis=1, keepdims=True))

    @cached_property
    def _line(self):
        """Tangent, normal, begin and begins of elements of a single straight line, or None."""
        mesh, first = self.mesh, self.mesh.p[:, :1]
        if not (self.is_chain and (mesh.is_uniform or mesh.is_straight and np.abs(
                mesh.p_X - mesh.p_X[:, :1]).max() < 1e-9)):
            return None
        d = np.array([mesh.p_X[:, 0], mesh.p_Y[:, 0]])
        return d, first, d[0] @ (mesh.p[:, :-1] - first)

    @cached_property
    def extent(self) -> str:
        """Extent of the body as text."""
        X = np.array(np.meshgrid(np.linspace(0, 1, 9), [0.0, 1.0])).reshape(2, -1)
        x = self.mapping.F(X).reshape(2, -1)
        low, high = x.min(axis=1), x.max(axis=1)
        return (f"the body lies within x from {low[0]:.6g} to {high[0]:.6g} and y from "
                f"{low[1]:.6g} to {high[1]:.6g}")


#: Tolerance for a point on a section, relative to an adjacent element.
NEAR = 1e-6

KINDS = ("the name of a boundary, a material point (x, y), a function of the points "
         "x that returns truth values, or numbers of facets as an array of integers")


def is_point(place: object) -> bool:
    """True for two numbers; integers of an array are facets."""
    if isinstance(place, np.ndarray):
        return place.shape == (2,) and place.dtype.kind == "f"
    return (isinstance(place, (tuple, list)) and len(place) == 2
            and all(isinstance(x, numbers.Real) and not isinstance(x, (bool, np.bool_))
                    for x in place))


def points_of_rows(places: Any) -> Any:
    """A list of points (x, y) for an array of shape (n, 2); else the argument itself."""
    if isinstance(places, np.ndarray) and places.ndim == 2 and places.shape[1] == 2:
        return [tuple(point) for point in places.tolist()]
    return places


def as_point(point: Any, mesh: Any = None) -> Array:
    """A material point as an array (2,): two coordinates, or with a mesh the name of a section."""
    if isinstance(point, str) and mesh is not None and point in (mesh.boundaries or {}):
        return mesh.p[:, node_of(mesh, point)]
    return require_point(point)


def on_other_mesh(place: object) -> bool:
    """True if a place is independent of the mesh, without numbers of facets."""
    if isinstance(place, np.ndarray):
        return is_point(place)
    if isinstance(place, (tuple, list, set, frozenset)) and not is_point(place):
        return all(map(on_other_mesh, place))
    return True


def facets_of(mesh: Any, place: Place) -> Array:
    """Numbers of the facets of a mesh at a place, (n,), n >= 1; or NameUnknown, MeshError."""
    # A place is the name of a boundary; two floats, a material point on the section of a node; a
    # function of points (2, n) that returns n truth values, for the facets whose midpoints satisfy
    # it; numbers of facets in an array of integers; a tuple, list or set of places, or an array (n,
    # 2) of points. A scikit-fem ``OrientedBoundary`` is returned as it is.
    if isinstance(place, str):
        named = mesh.boundaries or {}
        found = named[require_option("boundary", place, named)]
        if not len(found):
            raise MeshError(f"the boundary {place!r} is empty; others are {_names(mesh)}")
        return found
    refuse(is_masked(place), "a place must not have masked values, got {!r}", place)
    place = points_of_rows(place)
    if is_point(place):
        return np.array([section_at(mesh, cast("ArrayLike", place))], dtype=np.int32)
    if isinstance(place, np.ndarray):
        refuse(place.dtype.kind not in "iu" or place.ndim != 1 or not len(place), "a place is {}, "
               "got {!r}", KINDS, place)
        refuse_any((place < 0) | (place >= mesh.nfacets), "the facets are numbered 0 to {}, got {}",
                   mesh.nfacets - 1, place, error=MeshError)
        return place
    if callable(place):
        x = mesh.mapping().G(np.array([[0.5]]))[:, :, 0]
        found = satisfying(place, x)
        refuse(not len(found), "the function {!r} selects none of the {} facets, whose middles lie "
               "from {:.9g} to {:.9g}; boundaries with names are {}", place, x.shape[1],
               x.min(axis=1), x.max(axis=1), _names(mesh), error=MeshError)
        return found
    if isinstance(place, (tuple, list, set, frozenset)) and len(place) and not all(
            isinstance(p, numbers.Number) for p in place):
        return np.unique(np.concatenate([np.asarray(facets_of(mesh, p)) for p in place]))
    hint = ""
    if isinstance(place, numbers.Integral) and not isinstance(place, bool):
        hint = f"; for the facet of that number write np.array([{shown(place)}])"
    elif isinstance(place, (tuple, list)) and len(place) and all(
            isinstance(p, numbers.Integral) for p in place):
        hint = f"; for facets of those numbers write np.array({shown(list(place))})"
    raise InputError(f"a place is {KINDS}, got {shown(place)}{hint}")


def node_of(mesh: Any, place: Place) -> int:
    """The node of a place that is one section; MeshError for others."""
    facets = np.asarray(facets_of(mesh, place))
    refuse(len(facets) != 1 or facets[0] >= mesh.p.shape[1], "{!r} is not one section of the beam, "
           "as 'left', 'right', or the point of a node", place, error=MeshError)
    return int(facets[0])


def section_at(mesh: Any, point: ArrayLike) -> int:
    """The node whose section contains a material point (2,); else MeshError."""
    x = as_point(point, mesh)
    d = x[:, None] - mesh.p
    Y = np.sum(d * mesh.p_Y, axis=0) / np.sum(mesh.p_Y**2, axis=0)
    Y = np.clip(Y, -0.5 * mesh.height, 0.5 * mesh.height)
    off = np.hypot(*(d - Y * mesh.p_Y))
    size = np.full(mesh.p.shape[1], np.inf)
    for end in mesh.t:
        size[end] = np.minimum(size[end], mesh.lengths)
    noise = 8 * np.finfo(float).eps * (np.max(np.abs(mesh.p)) + np.max(np.abs(x)))
    found = np.nonzero(off <= NEAR * size + noise)[0]
    if len(found) and not mesh.is_chain:  # not the section of a line whose axis is farther away
        finder = Finder(mesh)
        e, X, *_ = finder.find(x[:, None])
        found = found[np.abs(Y[found]) <= finder.from_axis(e, X)[0] + finder.equal]
    if len(found) == 1:
        return int(found[0])
    refuse(len(found), "the point {} is on the sections of the nodes {}: give np.array([number])",
           _pair(x), found.tolist(), error=MeshError)
    k = int(np.argmin(off))
    raise MeshError(f"the point {_pair(x)} is on no section between two elements: the nearest is "
                    f"that of node {k} at {_pair(mesh.p[:, k])}, {off[k]:.6g} away")


def _pair(x: Array) -> str:
    x = np.where(np.abs(x) < 1e-15 * np.max(np.abs(x)), 0.0, x)
    return f"({x[0]:.9g}, {x[1]:.9g})"


def _names(mesh: Any) -> str:
    return ", ".join(repr(name) for name, facets in (mesh.boundaries or {}).items() if len(facets))


def satisfying(test: Callable[[Array], Any], x: Array, what: str = "a place") -> Array:
    """Numbers of the points x (2, n) that satisfy a function; ``what`` is for messages."""
    found = ask(f"the function that names {what}, of x of shape {x.shape},", test, x)
    chosen = np.asarray(found)
    refuse(is_masked(found) or chosen.shape != x.shape[1:] or chosen.dtype != bool, "a function "
           "that names {} returns n truth values for points x (2, n), as lambda x: x[0] > 1; for "
           "n = {} it returned {!r}", what, x.shape[1], found, error=CallbackError)
    return np.nonzero(chosen)[0].astype(np.int32)
