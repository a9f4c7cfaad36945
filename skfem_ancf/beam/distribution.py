"""Points on the surface of a beam, and distribution of forces on it, its volume and sections."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy

from ..core import Array, ArrayLike, Place, gauss, lagrange
from ..mesh.mesh_beam import MeshBeam
from ..mesh.places import facets_of
from ..sections.across import jumps, pieces
from .beam import Beam
from .kinematics import direction_weights, probe_reference

#: Points closer to a node than this fraction of an element are at the node.
SNAP = 1e-5

#: The largest xi inside an element of a beam.
LAST = 1.0 - 1e-9

#: Tolerance of a shape function of ``r``, which is flat at the nodes.
FLAT = 1e-11

#: Number of sections at which the search for one by its direction begins.
TRIES = 33


#: Where a :class:`Sampled` density acts; the first two are numbers of faces.
BOTTOM, TOP, AXIS, BODY = range(4)


@dataclass(frozen=True)
class Sampled:
    """A force density given by values at points of elements, with polynomials between them."""

    where: int  # BOTTOM, TOP, AXIS or BODY
    elements: Array  # (n,)
    xi: Array  # points along them, (p,)
    values: Array  # force per xi, (2, ..., n, p); for a body per volume, (2, ..., n, p, q)
    eta: Array | None = None  # for a body points across, (q,)
    parts: Array | None = None  # begin and end of parts of elements in order, (2, n), or all

    def times(self, factor: Any) -> "Sampled":
        """The density times a factor or several, shape (...)."""
        return replace(self, values=np.moveaxis(np.multiply.outer(factor, self.values),
                                                np.ndim(factor), 0))

    def at(self, e: Array, xi: Array, eta: Array, nelements: int) -> Array:
        """The density (2, ..., n, k) on sections e, xi (n,) at points eta (n, k) across them."""
        if self.parts is None:
            rows = np.full(nelements, -1)
            rows[self.elements] = np.arange(len(self.elements))
            row, here = rows[e], xi
        else:
            begin, end = self.parts
            row = np.searchsorted(self.elements + begin, e + np.minimum(xi, LAST), "right") - 1
            row[self.elements[row] != e] = -1
            here = (xi - begin[row]) / (end - begin)[row]
        along = lagrange(self.xi, here) * (row >= 0)[:, None]
        if self.eta is None:
            return np.einsum("...np,np->...n", self.values[..., row, :], along)[..., None]
        here = np.einsum("...npq,np->...nq", self.values[..., row, :, :], along)
        if np.all(eta == eta[:1]):
            return here @ lagrange(self.eta, eta[0]).T
        across = lagrange(self.eta, eta.ravel()).reshape(eta.shape + (-1,))
        return np.einsum("...nq,nkq->...nk", here, across)

    def changes(self, nelements: int) -> Array:
        """Axial coordinates at which it begins or ends."""
        on = np.isin(np.arange(nelements), self.elements)
        inside = [] if self.parts is None else (self.elements + self.parts[0])[self.parts[0] > 0]
        return np.append(np.nonzero(on[1:] != on[:-1])[0] + 1.0, inside)

    def jumps(self, nelements: int) -> Array:
        """Axial coordinates of jumps by more than a tenth of the largest value."""
        eta = np.array([0.0]) if self.eta is None else self.eta
        return jumps(lambda X, e: self.at(e, X[0, :, 0], X[1], nelements), nelements, eta,
                     0.1 * float(np.max(np.abs(self.values), initial=0.0)))


class Facets(NamedTuple):
    """Numbers (n,) of facets of one side, their elements (n,), and points xi (p,) on each."""

    where: int
    chosen: Array
    elements: Array
    xi: Array


@dataclass(frozen=True)
class Distribution:
    """The distribution of a load over a beam, in the reference configuration."""

    body: Array | None = None  # force per volume, (2,)
    gravity: Array | None = None  # force per mass, (2,)
    faces: tuple[Array, ...] | None = None  # loaded elements at bottom and top, bool (nelements,)
    traction: Array | Callable[[Array], Array] | None = None  # per area of faces; function of x
    pressure: float | None = None  # normal force per deformed area
    stations: tuple[float, ...] = ()  # element + xi of loaded sections and points
    sampled: tuple[Sampled, ...] = ()
    points: tuple[tuple[int, float, Array], ...] = ()  # element, xi, nodal force (nb, 2)
    eigen: Any = None  # an eigenstrain instead of a force


def on_points(beam: Beam, places: Sequence[tuple[Array, int, Array]]) -> tuple[Array, Distribution]:
    """The force (N,) of forces (2,) with element and reference point, and its Distribution."""
    vector, points = np.zeros(beam.N), []
    for force, e, X in places:
        dofs, weights = probe_reference(beam, e, X)
        vector[dofs] += force[:, None] * weights
        points.append((e, float(X[0]), np.outer(weights, force)))
    return vector, Distribution(stations=tuple(e + xi for e, xi, _ in points), points=tuple(points))


def on_facets(mesh: MeshBeam, facets: ArrayLike, **how: Any) -> Distribution:
    """The Distribution of a ``traction`` or ``pressure`` on facets (n,)."""
    n, ne = mesh.p.shape[1], mesh.nelements
    on = np.zeros(n + 2 * ne, dtype=bool)
    on[np.asarray(facets)] = True
    stations = tuple(station_of_node(mesh, k) for k in on[:n].nonzero()[0].tolist())
    return Distribution(faces=(on[n:n + ne], on[n + ne:]), stations=stations, **how)


def station_of_node(mesh: MeshBeam, node: int) -> float:
    """Element + xi of a node, by preference at the end of an element."""
    right = np.nonzero(mesh.t[1] == node)[0]
    return float(right[0]) + 1.0 if len(right) else float(np.nonzero(mesh.t[0] == node)[0][0])


def stations_of_vector(beam: Beam, vector: ArrayLike) -> tuple[float, ...] | None:
    """Element + xi of a nodal force that acts on sections or points; None if it is distributed."""
    rows, t = np.asarray(vector).reshape(-1, beam.nd), beam.mesh.t
    loaded = np.nonzero(np.any(rows != 0, axis=1))[0]
    runs = np.split(loaded, np.flatnonzero(np.diff(loaded) > 1) + 1)
    if len(runs) > 1:  # points of elements apart from each other
        alone = [rows * np.isin(np.arange(len(rows)), run)[:, None] for run in runs]
        each: list[Any] = [stations_of_vector(beam, one) for one in alone]
        return None if None in each else sum(each, ())
    if len(loaded) == 2 and loaded[1] == loaded[0] + 1 and np.any(t[0] == loaded[0]):
        e, total = int(np.flatnonzero(t[0] == loaded[0])[0]), rows[loaded, :2].sum(axis=0)
        xi = None
        size = total @ total
        if size <= FLAT * np.max(rows[loaded] ** 2):
            # a moment: the section with a direction of these weights, in both components
            parts = rows[loaded].reshape(2, -1, 2)
            v = parts[..., np.argmax(np.sum(parts**2, axis=(0, 1)))].ravel()

            def gap(xi: float) -> float:
                w = direction_weights(beam, e, xi)
                return float(1.0 - (v @ w) ** 2 / ((v @ v) * (w @ w)))

            tries = np.linspace(0.0, 1.0, TRIES)
            best = tries[int(np.argmin([gap(x) for x in tries]))]
            bounds = max(best - 1.0 / TRIES, 0.0), min(best + 1.0 / TRIES, 1.0)
            found = scipy.optimize.minimize_scalar(gap, bounds=bounds, method="bounded",
                                                   options={"xatol": 1e-10})
            xi = float(found.x) if found.fun < FLAT else None
        elif size > 0:
            # where the shape function of r at the right node is its part of the force
            value = float(rows[loaded[1], :2] @ total / size)
            if min(abs(value), abs(1.0 - value)) <= FLAT:
                xi = float(round(value))
            elif 0.0 < value < 1.0:
                element = beam.element
                xi = scipy.optimize.brentq(lambda xi: float(element.local(
                    np.array([[xi], [0.5]]), 1.0)[0][element.nodal_dofs, 0]) - value, 0.0, 1.0,
                    xtol=1e-15)
        if xi is not None:
            return (e + xi,)
    if np.any(np.diff(loaded) == 1):
        return None
    return tuple(station_of_node(beam.mesh, int(k)) for k in loaded)


# points on the surface

#: Sides of an element in the order of its facets; the body is on the left along the first two.
LOWER, RIGHT, UPPER, LEFT = range(4)


class Surface(NamedTuple):
    """Points of facets on the same side of their elements: LOWER, RIGHT, UPPER or LEFT."""

    side: int
    facets: Array  # numbers, (nf,)
    elements: Array  # numbers, (nf,)
    X: Array  # points of the reference cell, (2, np)
    along: Array  # derivative of the position along a facet, the body on its left, (2, nf, np)
    weights: Array  # those of the quadrature times the width, (nf, np)

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
    for side, first in ((LOWER, n), (UPPER, n + ne)):
        on = found[(found >= first) & (found < first + ne)]
        if len(on):
            X = np.array([rule[0], np.full(points, 0.5 * side)])
            out.append(_along(beam, side, on, on - first, X, rule[1]))
    # right and left ends of elements at nodes, each once, and the elements
    nodes = found[found < n]
    left, right = np.full((2, n), -1)
    left[mesh.t[0]] = right[mesh.t[1]] = np.arange(ne)
    ends = right[nodes] >= 0
    for side, on, of in ((RIGHT, nodes[ends], right), (LEFT, nodes[~ends], left)):
        elements = of[on]
        for layer, (eta, w) in [] if not len(on) else [(None, rule)] if across.plain else (
                across.rules(beam.element.order + 3)):
            X = np.array([np.full(len(eta), float(side == RIGHT)), eta])
            width = across.layers[0].width if layer is None else across.breadth(layer, X, elements)
            out.append(_surface(beam, side, on, elements, X, width * w))
    return out


def divided(beam: Beam, one: Surface, ask: Callable[[Array, Array], Array]) -> Surface:
    """A surface in parts, where a function jumps inside elements; ``ask`` as for pieces()."""
    if one.side not in (LOWER, UPPER):
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
        if one.side in (LOWER, UPPER):
            groups.append(Facets(one.side // UPPER, first + np.arange(len(one.facets)),
                                 one.elements, one.X[0]))
            first += len(one.facets)
        else:
            stations += [station_of_node(mesh, k) for k in one.facets.tolist()]
    return groups, tuple(dict.fromkeys(stations))


def _along(beam: Beam, side: int, facets: Array, elements: Array, X: Array, weights: Array
           ) -> Surface:
    across = beam.across
    width = across.layers[0].width if across.plain else across.face(side // UPPER, X, elements)
    return _surface(beam, side, facets, elements, X, width * weights)


def _surface(beam: Beam, side: int, facets: Array, elements: Array, X: Array, weights: Array
             ) -> Surface:
    slopes = beam.mesh.mapping().DF(X, elements)[:, side % 2]
    return Surface(side, facets, elements, X, slopes if side in (LOWER, RIGHT) else -slopes,
                   np.broadcast_to(weights, slopes.shape[1:]))


def add_nodal(beam: Beam, elements: Array, forces: Array, out: Array) -> None:
    """Add nodal forces (n, 2 nodal_dofs, 2) of elements (n,) to a vector (N,)."""
    half, nodes = forces.shape[1] // 2, out.reshape(-1, forces.shape[1] // 2, 2)
    np.add.at(nodes, beam.mesh.t[0, elements], forces[:, :half])
    np.add.at(nodes, beam.mesh.t[1, elements], forces[:, half:])
