"""Points on the surface of a beam, for forces on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.quadrature import gauss
from ..core.types import Array, Place
from ..mesh.mesh_beam import MeshBeam
from ..mesh.places import facets_of
from .beam import Beam
from .distribution import Facets, station_of_node

#: Sides of an element, as facets are numbered in it; the body is on the left along the first two.
BOTTOM, RIGHT, TOP, LEFT = range(4)


class Surface(NamedTuple):
    """Points of facets that are the same side of their elements: BOTTOM, RIGHT, TOP or LEFT.

    ``facets`` and ``elements`` are the numbers of the facets, (nf,), and of an element of each;
    ``X`` reference points (2, np); ``along`` the derivative of the place by the parameter of a
    facet, with the body on its left, (2, nf, np); ``weights`` those of the rule times the width,
    (nf, np).
    """

    side: int
    facets: Array
    elements: Array
    X: Array
    along: Array
    weights: Array

    @property
    def areas(self) -> Array:
        """What the points stand for, shape (nf, np)."""
        return self.weights * np.sqrt(self.along[0] ** 2 + self.along[1] ** 2)

    @property
    def normals(self) -> Array:
        """Unit normals, outward, shape (2, nf, np)."""
        x, y = self.along
        return np.array([y, -x]) / np.sqrt(x * x + y * y)


def surfaces_of(beam: Beam, place: Place, points: int) -> list[Surface]:
    """Points of a place by sides and layers of the section, so many Gauss points a facet.

    End sections that are no plain rectangles have those that the element needs.
    """
    mesh, across, out = beam.mesh, beam.across, []
    found = np.asarray(facets_of(mesh, place))
    n, ne, rule = mesh.p.shape[1], mesh.nelements, gauss(points)
    for side, first in ((BOTTOM, n), (TOP, n + ne)):
        on = found[(found >= first) & (found < first + ne)]
        if len(on):
            X = np.array([rule[0], np.full(points, 0.5 * side)])
            width = across.layers[0].width if across.plain else (
                across.face(side // TOP, X, on - first))
            out.append(_surface(beam, side, on, on - first, X, width * rule[1]))
    for side, on, elements in _sections(mesh, found[found < n]):
        for layer, (eta, w) in [(None, rule)] if across.plain else (
                across.rules(beam.element.order + 3)):
            X = np.array([np.full(len(eta), float(side == RIGHT)), eta])
            width = across.layers[0].width if layer is None else across.breadth(layer, X, elements)
            out.append(_surface(beam, side, on, elements, X, width * w))
    return out


def groups_of(mesh: MeshBeam, surfaces: Sequence[Surface]
              ) -> tuple[list[Facets], tuple[float, ...]]:
    """Facets along a beam, numbered as the points of ``surfaces`` come, and stations across it."""
    groups, stations, first = [], [], 0
    for one in surfaces:
        if one.side in (BOTTOM, TOP):
            groups.append(Facets(one.side // TOP, first + np.arange(len(one.facets)),
                                 one.elements, one.X[0]))
            first += len(one.facets)
        else:
            stations += [station_of_node(mesh, k) for k in one.facets.tolist()]
    return groups, tuple(dict.fromkeys(stations))


def _sections(mesh, nodes):
    """Nodes that are right and left ends of elements, each once, and the elements."""
    left, right = (np.full(mesh.p.shape[1], -1) for _ in range(2))
    left[mesh.t[0]] = right[mesh.t[1]] = np.arange(mesh.nelements)
    ends = right[nodes] >= 0
    for side, on, of in ((RIGHT, nodes[ends], right), (LEFT, nodes[~ends], left)):
        if len(on):
            yield side, on, of[on]


def _surface(beam, side, facets, elements, X, weights):
    slopes = beam.mesh.mapping().DF(X, elements)[:, side % 2]
    return Surface(side, facets, elements, X, slopes if side in (BOTTOM, RIGHT) else -slopes,
                   np.broadcast_to(weights, slopes.shape[1:]))


def add_nodal(beam: Beam, elements: Array, forces: Array, out: Array) -> None:
    """Add forces (n, 2 nodal_dofs, 2) on the local functions of elements (n,) to a vector (N,)."""
    half, nodes = forces.shape[1] // 2, out.reshape(-1, forces.shape[1] // 2, 2)
    np.add.at(nodes, beam.mesh.t[0, elements], forces[:, :half])
    np.add.at(nodes, beam.mesh.t[1, elements], forces[:, half:])
