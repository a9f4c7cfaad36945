"""Chains of elements: the reference cell, numbers and names of facets and elements, refinement."""

from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NoReturn

import numpy as np
from skfem import ElementH1, Mesh2D
from skfem.generic_utils import OrientedBoundary
from skfem.refdom import RefLine, RefQuad, Refdom

from ..core import (Array, ArrayLike, Immutable, MeshError, NearMisses, read_only, refuse,
                    refuse_any, require_option)
from .mapping import halved as halved_heights, heights_of
from .places import satisfying


class RefBeam(Refdom):
    """Unit square (xi, eta) with two vertices, at the middle of its left and right side. ``xi``
    runs along the axis, ``eta`` across the section; the axis is ``eta = 1/2``. The facets are
    bottom, right, top, left as in scikit-fem's ``RefQuad``, whose quadrature is used (attribute
    ``refdom``). Bottom and top share their two vertices; left and right have one, listed twice."""

    p = np.array([[0.0, 1.0], [0.5, 0.5]])
    t = np.array([[0], [1]], dtype=np.int32)
    normals = RefQuad.normals
    facets = [[0, 1], [1, 1], [0, 1], [0, 0]]
    refdom = RefQuad
    brefdom = RefLine
    nnodes = 2
    nfacets = 4
    name = "Beam"

    @classmethod
    def on_facet(cls, i: int, X: Array) -> Array:
        """Whether reference points (2, n) are on facet i: bottom, right, top, left."""
        return (np.abs(X[1]) < 1e-4, np.abs(X[0] - 1) < 1e-4,
                np.abs(X[1] - 1) < 1e-4, np.abs(X[0]) < 1e-4)[i]


class ElementBeamP1(ElementH1):
    """Linear along the axis, constant across the section: for scalars such as a temperature."""

    nodal_dofs = 1
    maxdeg = 1
    dofnames = ["u"]
    doflocs = np.array([[0.0, 0.5], [1.0, 0.5]])
    refdom = RefBeam

    def lbasis(self, X: Array, i: int) -> tuple[Array, Array]:
        """The function of the left (0) or right (1) node at points (2, ...), and its gradient."""
        if i not in (0, 1):
            self._index_error()
        slope = 2.0 * i - 1.0
        return 1.0 - i + slope * X[0], np.array([slope + 0.0 * X[0], 0.0 * X[0]])


#: Attributes of a mesh with values at the nodes.
NODAL = "doflocs", "p_X", "p_Y", "p_XY", "s"


def default_tags(p: Array, t: Array) -> dict[str, Array]:
    """Facets of the ends and the surfaces of a mesh by name."""
    n, ne = p.shape[1], t.shape[1]
    facets = np.arange(n + 2 * ne, dtype=np.int32)
    facets.flags.writeable = False
    return {"left": facets[:1], "right": facets[n - 1:n], "bottom": facets[n:n + ne],
            "top": facets[n + ne:]}


def _refused(what: str) -> Callable[..., NoReturn]:
    def refuse(self: Any, *args: Any, **kwargs: Any) -> NoReturn:
        raise MeshError(f"a MeshBeam cannot be {what}: put several beams into one Scene")

    return refuse


class NumberedMesh(Immutable, NearMisses, Mesh2D):
    """What scikit-fem needs of meshes of beams: facets are sections at nodes, then bottoms, then
    tops."""

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
        refuse(elements.dtype.kind not in "iu" or elements.ndim != 1, "elements are numbers, a "
               "subdomain, a function or a mask, got {!r}", given, error=MeshError)
        refuse_any((elements < 0) | (elements >= self.nelements), "the elements are numbered 0 to "
                   "{}, got {}", self.nelements - 1, elements, error=MeshError)
        return elements

    def elements_satisfying(self, test: Callable[[Array], Array]) -> Array:
        return satisfying(test, self._mapping().F(np.array([[0.5], [0.5]]))[:, :, 0], "elements")

    def facets_satisfying(self, test: Callable[[Array], Array], boundaries_only: bool = False,
                          normal: ArrayLike | None = None) -> Array:
        """Facets (k,) whose midpoints satisfy a function of points (2, n). ``boundaries_only``
        excludes sections between two elements. With ``normal`` (2,), the direction of the side of
        the facets, the result is an ``OrientedBoundary``."""
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
    mirrored, morphed, smoothed = map(_refused, ("mirrored", "morphed", "smoothed"))
    __add__, __matmul__ = map(_refused, ("joined with +", "joined with @"))


def halved(mesh: Any, ix: Array) -> Any:
    """The mesh with elements ``ix`` (k,) halved; new nodes are on the curve."""
    marked = np.zeros(mesh.nelements, dtype=bool)
    marked[ix] = True
    new = _midpoints(mesh, ix)
    where = mesh.t[1, ix]
    fields: dict[str, Any] = {name: np.insert(getattr(mesh, name), where, new[name], axis=-1)
                              for name in NODAL if getattr(mesh, name) is not None}
    # children of element e: first[e], and first[e] + 1 if it was marked
    first = np.arange(mesh.nelements) + np.concatenate([[0], np.cumsum(marked)[:-1]])
    parent = np.repeat(np.arange(mesh.nelements), 1 + marked)
    node = np.arange(mesh.p.shape[1]) + np.searchsorted(where, np.arange(mesh.p.shape[1]),
                                                        side="right")
    left = node[mesh.t[0, parent]]
    left[first[ix] + 1] += 1
    lengths = mesh.lengths[parent]
    if mesh.curve is None:
        lengths = np.where(marked[parent], lengths / 2, lengths)
    else:
        lengths[first[ix]], lengths[first[ix] + 1] = new["lengths"]
    fields.update(t=np.array([left, left + 1]), _boundaries=None, _subdomains=None)
    if mesh.taper is not None and mesh.s is not None:
        fields["heights"] = heights_of(mesh.taper, fields["s"], fields["t"])[1]
    elif mesh.heights is not None:
        fields["heights"] = halved_heights(mesh.heights, marked)
    m = replace(mesh, lengths=lengths, **fields)
    if mesh._boundaries is not None:
        # of each facet the first child, and whether there is another behind it
        n, children = m.p.shape[1], np.append(marked, marked)
        start = np.concatenate([node, n + first, n + m.nelements + first])
        two, m._boundaries = np.append(np.zeros(len(node), dtype=bool), children), {}
        for name, facets in mesh._boundaries.items():
            f = np.asarray(facets)
            source = np.repeat(np.arange(len(f)), 1 + two[f])
            found = start[f[source]] + np.append(False, source[1:] == source[:-1])[:len(source)]
            order = np.argsort(found, kind="stable")
            m._boundaries[name] = found[order].astype(np.int32)
            if getattr(facets, "ori", None) is not None:
                m._boundaries[name] = OrientedBoundary(
                    m._boundaries[name], np.asarray(facets.ori)[source][order])
    if mesh._subdomains is not None:
        m._subdomains = {name: np.nonzero(np.isin(parent, e))[0].astype(np.int32)
                         for name, e in mesh._subdomains.items()}
    m._freeze()
    return m


def by_element(mesh: Any, at: Array) -> Any:
    """A mesh of disconnected elements, with one-sided rates of turning at nodes ``at`` (k,)."""
    # cubic and higher directors share one nodal derivative, which fits neither side of a jump of
    # the curvature
    mesh, n, node = mesh.with_sections("cubic"), mesh.nelements, mesh.t.T.ravel()
    fields: dict[str, Any] = {name: getattr(mesh, name)[:, node]
                              for name in ("doflocs", "p_X", "p_Y", "p_XY")}
    ends = np.array([np.tile([0.0, 1.0], (n, 1)), np.full((n, 2), 0.5)])
    bent = mesh.mapping().curvature(ends, np.arange(n)).ravel()
    for k in (2 * at - 1, 2 * at):
        fields["p_XY"][:, k] = -bent[k] * fields["p_X"][:, k]
    fields.update(t=np.arange(2 * n).reshape(-1, 2).T, _boundaries=None, _subdomains=None)
    return replace(mesh, s=None, curve=None, taper=None, **fields)


def _midpoints(mesh, ix):
    """Position, gradients, parameter and, on a curve, lengths for the middle of elements."""
    out = {}
    if mesh.s is not None:
        out["s"] = 0.5 * (mesh.s[mesh.t[0, ix]] + mesh.s[mesh.t[1, ix]])
    if mesh.curve is None:
        middle = np.array([[0.5], [0.5]])
        mapping = mesh._mapping()
        J = mapping.DF(middle, ix)[..., 0]
        return {**out, "doflocs": mapping.F(middle, ix)[..., 0],
                "p_X": J[:, 0] / mesh.lengths[ix],
                "p_Y": J[:, 1] / np.ravel(mapping.height(middle[0], ix)[0]),
                "p_XY": mapping.turning(middle, ix)[..., 0] / mesh.lengths[ix]}
    a, b = mesh.s[mesh.t[:, ix]]
    p, tangent = mesh.curve.nodes(out["s"])
    return {**out, "doflocs": p, "p_X": tangent, "p_Y": np.array([-tangent[1], tangent[0]]),
            "p_XY": mesh.curve.turning(out["s"]),
            "lengths": (mesh.curve.lengths(a, out["s"]), mesh.curve.lengths(out["s"], b))}
