"""Points on the surface of a beam."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..core.quadrature import gauss
from ..core.types import Array, Place
from ..mesh.mesh_beam import MeshBeam
from ..mesh.places import facets_of
from ..sections.across import pieces
from .beam import Beam
from .distribution import Facets, station_of_node

#: Sides of an element in the order of its facets; the body is on the left along the first two.
BOTTOM, RIGHT, TOP, LEFT = range(4)


class Surface(NamedTuple):
    """Points of facets on the same side of their elements: BOTTOM, RIGHT, TOP or LEFT.

    ``facets`` and ``elements`` (nf,) are numbers; ``X`` (2, np) points of the reference cell;
    ``along`` the derivative of the position along a facet, with the body on its left, (2, nf, np);
    ``weights`` (nf, np) those of the quadrature times the width.
    """

    side: int
    facets: Array
    elements: Array
    X: Array
    along: Array
    weights: Array

    @property
    def areas(self) -> Array:
        """Areas of the points, shape (nf, np)."""
        return self.weights * np.sqrt(self.along[0] ** 2 + self.along[1] ** 2)

    @property
    def normals(self) -> Array:
        """Outward unit normals, shape (2, nf, np)."""
        x, y = self.along
        return np.array([y, -x]) / np.sqrt(x * x + y * y)


def surfaces_of(beam: Beam, place: Place, points: int) -> list[Surface]:
    """Surfaces of a place by side and layer, with Gauss points on each facet."""
    mesh, across, out = beam.mesh, beam.across, []
    found = np.asarray(facets_of(mesh, place))
    n, ne, rule = mesh.p.shape[1], mesh.nelements, gauss(points)
    for side, first in ((BOTTOM, n), (TOP, n + ne)):
        on = found[(found >= first) & (found < first + ne)]
        if len(on):
            X = np.array([rule[0], np.full(points, 0.5 * side)])
            out.append(_along(beam, side, on, on - first, X, rule[1]))
    for side, on, elements in _sections(mesh, found[found < n]):
        for layer, (eta, w) in [(None, rule)] if across.plain else (
                across.rules(beam.element.order + 3)):
            X = np.array([np.full(len(eta), float(side == RIGHT)), eta])
            width = across.layers[0].width if layer is None else across.breadth(layer, X, elements)
            out.append(_surface(beam, side, on, elements, X, width * w))
    return out


def divided(beam: Beam, one: Surface, ask: Callable[[Array, Array], Array]) -> Surface:
    """A surface in parts, where a function jumps inside elements; ``ask`` as for pieces()."""
    if one.side not in (BOTTOM, TOP):
        return one
    part, (x, w) = pieces(ask, one.elements, 0.5 * one.side), gauss(one.X.shape[-1])
    size = (part.end - part.begin)[:, None]
    xi = part.begin[:, None] + size * x
    return _along(beam, one.side, part.elements + one.facets[0] - one.elements[0], part.elements,
                  np.array([xi, np.full(xi.shape, 0.5 * one.side)]), size * w)


def groups_of(mesh: MeshBeam, surfaces: Sequence[Surface]
              ) -> tuple[list[Facets], tuple[float, ...]]:
    """Facets along a beam, numbered as the points of ``surfaces``, and stations of others."""
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
    """Right and left ends of elements at nodes, each once, and the elements."""
    left, right = (np.full(mesh.p.shape[1], -1) for _ in range(2))
    left[mesh.t[0]] = right[mesh.t[1]] = np.arange(mesh.nelements)
    ends = right[nodes] >= 0
    for side, on, of in ((RIGHT, nodes[ends], right), (LEFT, nodes[~ends], left)):
        if len(on):
            yield side, on, of[on]


def _along(beam, side, facets, elements, X, weights):
    across = beam.across
    width = across.layers[0].width if across.plain else across.face(side // TOP, X, elements)
    return _surface(beam, side, facets, elements, X, width * weights)


def _surface(beam, side, facets, elements, X, weights):
    slopes = beam.mesh.mapping().DF(X, elements)[:, side % 2]
    return Surface(side, facets, elements, X, slopes if side in (BOTTOM, RIGHT) else -slopes,
                   np.broadcast_to(weights, slopes.shape[1:]))


def add_nodal(beam: Beam, elements: Array, forces: Array, out: Array) -> None:
    """Add nodal forces (n, 2 nodal_dofs, 2) of elements (n,) to a vector (N,)."""
    half, nodes = forces.shape[1] // 2, out.reshape(-1, forces.shape[1] // 2, 2)
    np.add.at(nodes, beam.mesh.t[0, elements], forces[:, :half])
    np.add.at(nodes, beam.mesh.t[1, elements], forces[:, half:])
