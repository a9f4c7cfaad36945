"""Facets, elements and their names on chains of elements, numbered along the axis."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike
from skfem.generic_utils import OrientedBoundary
from skfem.mesh import Mesh2D

from ..core.errors import MeshError, require_option, shown
from ..core.immutable import Immutable, read_only
from ..core.near_misses import NearMisses
from ..core.types import Array
from .places import satisfying


def default_tags(p: Array, t: Array) -> dict[str, Array]:
    """Facets of the ends and the surfaces of a mesh by name."""
    n, ne = p.shape[1], t.shape[1]
    facets = read_only(np.arange(n + 2 * ne, dtype=np.int32))
    return {"left": facets[:1], "right": facets[n - 1:n], "bottom": facets[n:n + ne],
            "top": facets[n + ne:]}


class NumberedMesh(Immutable, NearMisses, Mesh2D):
    """The numbering of facets and elements that scikit-fem needs, for meshes of beams.

    Facets are the sections at the nodes, then the bottoms and the tops of the elements.
    """

    def _freeze(self):
        super()._freeze()
        self._boundaries, self._subdomains = (
            None if tags is None else {name: read_only(numbers) for name, numbers in tags.items()}
            for tags in (self._boundaries, self._subdomains))

    @property
    def boundaries(self) -> MappingProxyType[str, Any] | None:
        """Numbers of facets by name, see :meth:`with_boundaries`."""
        return None if self._boundaries is None else MappingProxyType(self._boundaries)

    @property
    def subdomains(self) -> MappingProxyType[str, Array] | None:
        """Numbers of elements by name, see :meth:`with_subdomains`."""
        return None if self._subdomains is None else MappingProxyType(self._subdomains)

    def _init_facets(self):
        n, ne, t = self.doflocs.shape[1], self.t.shape[1], self.t
        nodes, elements = np.arange(n, dtype=np.int32), np.arange(ne, dtype=np.int32)
        bottom, top = n + elements, n + ne + elements
        self._facets = np.hstack([np.array([nodes, nodes]), t, t])
        self._t2f = np.array([bottom, t[1], top, t[0]], dtype=np.int32)
        f2t = np.full((2, n + 2 * ne), -1, dtype=np.int32)
        f2t[0, bottom] = f2t[0, top] = elements
        f2t[1, t[0]] = f2t[0, t[1]] = elements
        starts = f2t[0] < 0
        f2t[0, starts], f2t[1, starts] = f2t[1, starts], -1
        self._f2t = f2t

    @property
    def f2t(self) -> Array:
        if not hasattr(self, "_f2t"):
            self._init_facets()
        return self._f2t

    def _build_default_tags(self):
        return default_tags(self.doflocs, self.t)

    def normalize_facets(self, facets: Any) -> Array:
        if isinstance(facets, str):
            require_option("boundary", facets, self.boundaries or {})
        return super().normalize_facets(facets)

    def normalize_elements(self, elements: Any) -> Array:
        if isinstance(elements, str):
            known: Any = self.subdomains or {}
            return np.asarray(known[require_option("subdomain", elements, known)])
        if callable(elements):
            return self.elements_satisfying(elements)
        given = elements
        if isinstance(elements, (tuple, list, set)):
            elements = list(elements)
            if any(isinstance(e, str) for e in elements):
                return np.unique(np.concatenate([self.normalize_elements(e) for e in elements]))
        try:
            elements = np.atleast_1d(np.asarray(elements))
        except (ValueError, TypeError):
            elements = np.zeros(1, dtype=object)
        if elements.dtype == bool and elements.shape == (self.nelements,):
            elements = np.nonzero(elements)[0]
        if not elements.size:
            return np.zeros(0, dtype=np.int32)
        if elements.dtype.kind not in "iu" or elements.ndim != 1:
            raise MeshError("elements are given by their numbers, by the name of a subdomain, by a "
                            f"function or a mask, got {shown(given)}")
        bad = elements[(elements < 0) | (elements >= self.nelements)]
        if len(bad):
            raise MeshError(f"the elements are numbered 0 to {self.nelements - 1}, got {bad[0]}")
        return elements

    def elements_satisfying(self, test: Callable[[Array], Array]) -> Array:
        return satisfying(test, self._mapping().F(np.array([[0.5], [0.5]]))[:, :, 0], "elements")

    def facets_satisfying(self, test: Callable[[Array], Array], boundaries_only: bool = False,
                          normal: ArrayLike | None = None) -> Array:
        """Facets (k,) whose midpoints satisfy a function of points (2, n).

        ``boundaries_only`` excludes sections between two elements. With ``normal`` (2,), the
        direction of the side of the facets, the result is an ``OrientedBoundary``.
        """
        middle, mapping = np.array([[0.5]]), self._mapping()
        facets = satisfying(test, mapping.G(middle)[:, :, 0])
        if boundaries_only:
            facets = np.intersect1d(facets, self.boundary_facets())
        if normal is None:
            return facets
        tind, points = mapping.facet_points(middle, facets)
        normals = mapping.normals(points, tind, facets, self.t2f)[:, :, 0]
        return OrientedBoundary(facets, 1 * (np.asarray(normal) @ normals < 0))

    # methods of scikit-fem's meshes without a meaning for a chain of elements

    def _refuse(self, what: str) -> NoReturn:
        raise MeshError(
            f"a MeshBeam cannot be {what}: it is one chain of nodes with sections. Put several "
            "beams into one Scene and join them, or build the mesh with init_line or init_curve")

    def mirrored(self, normal: Any, point: Any = None) -> NoReturn:
        self._refuse("mirrored")

    def morphed(self, *args: Any) -> NoReturn:
        self._refuse("morphed")

    def smoothed(self, fixed_nodes: Any = None) -> NoReturn:
        self._refuse("smoothed")

    def __add__(self, other):
        self._refuse("joined with +")

    def __matmul__(self, other):
        self._refuse("joined with @")
