"""Places on a beam: a boundary, a material point, a function, facets."""

from __future__ import annotations

import numbers
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import (CallbackError, InputError, MeshError, NameUnknown, ask, is_masked,
                           require_point, shown)
from ..core.types import Array, Place
from .location import Finder

#: Tolerance for a point on a section, relative to an adjacent element.
NEAR = 1e-6

KINDS = ("the name of a boundary, a material point (x, y), a function of the points "
         "x that returns truth values, or numbers of facets as an array of integers")


def is_point(place: object) -> bool:
    """True for two numbers in a tuple, a list or an array of floats.

    Examples
    --------
    >>> import numpy as np
    >>> is_point((1, 1)), is_point([0.5, 0]), is_point(np.array([0.5, 0.0]))
    (True, True, True)
    >>> is_point(np.array([1, 1])), is_point(("left", "right"))  # facets; two boundaries
    (False, False)
    """
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


def is_place(place: object) -> bool:
    """True for one place, False for a tuple with a place for each of several beams."""
    return isinstance(place, (str, np.ndarray)) or callable(place) or is_point(place)


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
    """Numbers of the facets at a place, shape (n,), n >= 1.

    All methods that take a place use this function:

    * a name is that of a boundary,
    * two numbers in a tuple, a list or an array of floats are a material point (x, y) on the
      section of a node,
    * a function takes points x, shape (2, n), and returns n truth values: the facets whose
      midpoints satisfy it,
    * an array of integers contains numbers of facets,
    * another tuple, list or set is a union of places; an array (n, 2) contains n points.

    A scikit-fem ``OrientedBoundary`` is returned as it is.

    Parameters
    ----------
    mesh
        A :class:`~skfem_ancf.MeshBeam`.
    place
        As above.

    Raises
    ------
    NameUnknown, MeshError, InputError
        If a name is not known, there is no facet at the place, or the type is wrong.

    Examples
    --------
    >>> from skfem_ancf import MeshBeam
    >>> mesh = MeshBeam.init_line([0, 1, 2], height=0.1)
    >>> facets_of(mesh, "right").tolist(), facets_of(mesh, (1, 0)).tolist()
    ([2], [1])
    """
    if is_masked(place):
        raise InputError(f"a place must not have masked values, got {shown(place)}")
    place = points_of_rows(place)
    if isinstance(place, str):
        return _named(mesh, place)
    if is_point(place):
        return np.array([section_at(mesh, cast("ArrayLike", place))], dtype=np.int32)
    if isinstance(place, np.ndarray):
        return _numbered(mesh, place)
    if callable(place):
        x = mesh.mapping().G(np.array([[0.5]]))[:, :, 0]
        found = satisfying(place, x)
        if not len(found):
            raise MeshError(f"the function {place!r} selects none of the {x.shape[1]} facets, "
                            f"whose middles lie from {_pair(x.min(axis=1))} to "
                            f"{_pair(x.max(axis=1))}; boundaries with names are {_names(mesh)}")
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
    if len(facets) != 1 or facets[0] >= mesh.p.shape[1]:
        raise MeshError(f"boundary {place!r} is not one section of the beam; sections are "
                        "'left' and 'right', or the point of a node of the axis")
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
    if len(found):
        raise MeshError(f"the point {_pair(x)} is on the sections of the nodes {found.tolist()} at "
                        "once: name one of them as a boundary, or by np.array([number])")
    k = int(np.argmin(off))
    raise MeshError(
        f"the point {_pair(x)} is on no section between two elements: the nearest is that of node "
        f"{k} with its axis at {_pair(mesh.p[:, k])}, {off[k]:.6g} away; give that point, or put a "
        "node there")


def _pair(x: Array) -> str:
    x = np.where(np.abs(x) < 1e-15 * np.max(np.abs(x)), 0.0, x)
    return f"({x[0]:.9g}, {x[1]:.9g})"


def _names(mesh: Any) -> str:
    return ", ".join(repr(name) for name, facets in (mesh.boundaries or {}).items() if len(facets))


def _named(mesh: Any, name: str) -> Array:
    if name not in (mesh.boundaries or {}):
        raise NameUnknown("boundary", name, mesh.boundaries or {})
    facets = mesh.boundaries[name]
    if not len(facets):
        raise MeshError(f"the boundary {name!r} is empty: it has no facet of this mesh; others "
                        f"are {_names(mesh)}")
    return facets


def _numbered(mesh: Any, facets: Array) -> Array:
    if facets.dtype.kind not in "iu" or facets.ndim != 1 or not len(facets):
        raise InputError(f"facets are a one-dimensional array of integers that is not empty, got "
                         f"{shown(facets)}; a place may also be {KINDS.rsplit(', or', 1)[0]}")
    bad = facets[(facets < 0) | (facets >= mesh.nfacets)]
    if len(bad):
        n = mesh.p.shape[1]
        raise MeshError(
            f"the facets are numbered 0 to {mesh.nfacets - 1}, got {bad[0]}: 0 to {n - 1} are the "
            f"sections of the nodes, then come the bottom and the top of the {mesh.nelements} "
            "elements")
    return facets


def satisfying(test: Callable[[Array], Any], x: Array, what: str = "a place") -> Array:
    """Numbers of the points x (2, n) that satisfy a function; ``what`` is for messages."""
    found = ask(f"the function that names {what}, of x of shape {x.shape},", test, x)
    chosen = np.asarray(found)
    if is_masked(found) or chosen.shape != x.shape[1:] or chosen.dtype != bool:
        raise CallbackError(
            f"a function that names {what} takes points x of shape (2, n) and returns n truth "
            f"values, as lambda x: x[0] > 1; for n = {x.shape[1]} it returned {chosen.dtype} of "
            f"shape {chosen.shape}")
    return np.nonzero(chosen)[0].astype(np.int32)
