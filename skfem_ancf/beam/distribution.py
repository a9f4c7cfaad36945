"""Distribution of forces over a beam: on its volume, faces, sections and points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..core.quadrature import lagrange
from ..core.types import Array
from ..elements.base import ElementBeam
from ..mesh.mesh_beam import MeshBeam
from ..sections.across import jumps
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
    """A force density given by values at points of elements, with polynomials between them.

    It acts on ``where`` (BOTTOM, TOP, AXIS or BODY) of ``elements`` (n,). ``values`` at the points
    ``xi`` (p,) are force per xi, (2, ..., n, p); for a body, with points ``eta`` (q,) across, force
    per volume, (2, ..., n, p, q). ``parts`` (2, n) are begin and end of parts of elements, in
    order, between which the points lie; None for whole elements.
    """

    where: int
    elements: Array
    xi: Array
    values: Array
    eta: Array | None = None
    parts: Array | None = None

    def times(self, factor: Any) -> Sampled:
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
        """Axial coordinates of jumps by more than a tenth of the largest value.

        Smaller jumps are interpolation errors of a smooth density.
        """
        eta = np.array([0.0]) if self.eta is None else self.eta
        return jumps(lambda X, e: self.at(e, X[0, :, 0], X[1], nelements), nelements, eta,
                     0.1 * float(np.max(np.abs(self.values), initial=0.0)))


class Facets(NamedTuple):
    """Numbers (n,) of facets of one side, their elements (n,), and points xi (p,) on each."""

    where: int
    chosen: Array
    elements: Array
    xi: Array


def facets_along(mesh: MeshBeam, basis: Any) -> tuple[list[Facets], tuple[float, ...]]:
    """Facets of a FacetBasis along a beam, and axial coordinates of those across it."""
    n, ne, find = mesh.p.shape[1], mesh.nelements, np.asarray(basis.find)
    found = []
    for side in (BOTTOM, TOP):
        chosen = np.nonzero((find >= n + side * ne) & (find < n + (side + 1) * ne))[0]
        if len(chosen):
            found.append(Facets(side, chosen, find[chosen] - n - side * ne,
                                np.asarray(basis.X[0]).ravel()))
    return found, tuple(station_of_node(mesh, int(k)) for k in find[find < n])


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
    """Element + xi of a nodal force that acts on sections or points; None if it is distributed.

    A force at a point inside an element acts on ``r`` of both nodes; its point follows from the
    ratio.
    """
    rows = np.asarray(vector).reshape(-1, beam.nd)
    loaded = np.nonzero(np.any(rows != 0, axis=1))[0]
    if len(loaded) == 2 and np.any(beam.mesh.t[0] == loaded[0]) and loaded[1] == loaded[0] + 1:
        a, b = rows[loaded, :2]
        total = a + b
        if total @ total <= FLAT * np.max(rows[loaded] ** 2):
            xi = _where_turned(beam, int(np.nonzero(beam.mesh.t[0] == loaded[0])[0][0]),
                               rows[loaded])
            if xi is not None:
                return (float(np.nonzero(beam.mesh.t[0] == loaded[0])[0][0]) + xi,)
        elif total @ total > 0:
            value = float(b @ total / (total @ total))
            xi = _where(beam.element, value)
            if xi is not None:
                return (float(np.nonzero(beam.mesh.t[0] == loaded[0])[0][0]) + xi,)
    if np.any(np.diff(loaded) == 1):
        return None
    return tuple(station_of_node(beam.mesh, int(k)) for k in loaded)


def _where_turned(beam: Beam, e: int, rows: Array) -> float | None:
    """The section of element e with a direction of these weights (2, nd), in both components."""
    parts = rows.reshape(2, -1, 2)
    v = parts[..., np.argmax(np.sum(parts**2, axis=(0, 1)))].ravel()

    def gap(xi: float) -> float:
        w = direction_weights(beam, e, xi)
        return float(1.0 - (v @ w) ** 2 / ((v @ v) * (w @ w)))

    tries = np.linspace(0.0, 1.0, TRIES)
    best = tries[int(np.argmin([gap(x) for x in tries]))]
    found = scipy.optimize.minimize_scalar(
        gap, bounds=(max(best - 1.0 / TRIES, 0.0), min(best + 1.0 / TRIES, 1.0)), method="bounded",
        options={"xatol": 1e-10})
    return float(found.x) if found.fun < FLAT else None


def _where(element: ElementBeam, value: float) -> float | None:
    """Solve for xi at which the shape function of ``r`` at the right node has a value."""
    if not -FLAT <= value <= 1.0 + FLAT:
        return None
    if min(value, 1.0 - value) < FLAT:
        return float(round(value))

    def rest(xi: float) -> Any:
        return element.local(np.array([[xi], [0.5]]), 1.0)[0][element.nodal_dofs, 0] - value

    return scipy.optimize.brentq(rest, 0.0, 1.0, xtol=1e-15)
