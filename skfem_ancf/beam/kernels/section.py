"""Tables of beams with sections: Green-Lagrange strains, sampled as the formulation says. Rows are
d/dX, then d/dY, at the points of the samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, lagrange, product_rule
from ...elements.base import ElementBeam
from ...formulations import Formulation, Term
from ...mesh.mesh_beam import MeshBeam
from ...sections import Across, Layer
from .kernel import ElementKernel
from .tables import LINEAR, SECTION, StrainTables, law_tables, pattern_of

#: Relative size of a modulus between samples that is round-off.
ORTHOGONAL = 1e-14


class Integral(NamedTuple):
    """One term of the strain energy of one layer."""

    layer: Layer
    term: Term
    samples: Samples
    volumes: Array  # of the integration points, (1 or ne, points)
    first: bool  # the first term of its layer

    @property
    def section_points(self) -> int:
        """Number of integration points across the section."""
        return len(self.term.section[0])


class SectionKernel(ElementKernel):
    """The kernel of a beam with sections; ``integrals`` has the :class:`Integral` of each table."""

    def __init__(self, across: Across, formulation: Formulation) -> None:
        super().__init__(across.mesh, across.element)
        self.constant = across.stabilisation(formulation)
        self.tables, self.integrals, self._across = [], [], across
        rows: dict[Any, Any] = {}
        for layer, terms in across.terms(formulation):
            for k, term in enumerate(terms):
                constant = self.constant if not self.tables else None
                samples, volumes = self._add(layer, term, constant, rows)
                self.integrals.append(Integral(layer, term, samples, volumes, k == 0))
        self.points_number = sum(one.volumes.shape[1] for one in self.integrals)

    def _add(self, layer, term, constant, rows):
        """Add the tables of a term; returns its samples and the volumes of its points."""
        across, ne, nb = self._across, self.t.shape[1], self.nd
        tind = np.array([0]) if across.uniform else None
        *nodes, eta, axis = (tuple(np.asarray(x, dtype=float).tolist()) for x in (
            *map(term.nodes, ("xx", "yy", "xy")), term.section_nodes, term.axis[0]))
        samples = samples_of(*nodes, eta)
        if samples not in rows:
            rows[samples] = _rows(across.mesh, across.element, samples, tind)
        G, frame = rows[samples]
        whole, X = len(term.section[0]) == 1, term.quadrature
        volumes = across.volume(layer, *X, tind, whole)
        weights = volumes if layer.grade is None else across.volume(layer, *X, tind, whole, "grade")
        law = law_tables(term.law, self)
        linear, means = law.kind == LINEAR, len(eta) if term.section_samples is None else tuple(
            map(tuple, np.asarray(term.section_samples[1]).tolist()))
        A, pairs, products, sizes = _mixing(samples, tuple(nodes), axis, means, (
            law.D != 0.0).tobytes() if linear else b"\1" * 9)
        H, along = weights @ products, np.zeros((0, A.shape[1]))
        if linear:
            keep = (np.abs(H) > ORTHOGONAL * (np.abs(weights) @ sizes)).any(axis=0)
            keep |= pairs[0] == pairs[1]
            pairs, H = pairs.compress(keep, 1), H.compress(keep, 1)
        else:
            along = np.concatenate([np.where(samples.component == k, A, 0.0) for k in range(3)])
        H *= law.D[tuple(samples.component[pairs])]
        C = np.zeros((0, 2 * nb - 2, 2 * nb - 2)) if constant is None else constant[:, 2:, 2:]
        each = [len(x) > 1 for x in (G, frame, H, C, weights)]
        self.tables.append(StrainTables(
            pattern_of(SECTION, samples.rows, pairs), nb * self.t[0].astype(np.int64),
            np.arange(ne)[:, None] * each, *map(np.ascontiguousarray, (G, frame, H, C)), law,
            along, np.ascontiguousarray(weights)))
        return samples, volumes

    @property
    def volume(self) -> float:
        return sum(float(np.sum(one.volumes)) * (self.t.shape[1] // len(one.volumes))
                   for one in self.integrals if one.first)

    @property
    def scale(self) -> float:
        """Modulus times volume."""
        return sum(one.layer.material.E * float(t.weights.sum()) * (
            self.t.shape[1] // len(t.weights)) for one, t in zip(self.integrals, self.tables)
            if one.first)

    def _gradients(self, u, component):
        """Rows g and h (n, 2, ne) of the samples of a component, in the first terms."""
        for one, e in zip(self.integrals, self.elements):
            if one.first:
                r = e.x + e.rows(e.relative(u))
                yield r[e.t.rows[:, one.samples.component == component]]

    def inverted(self, u: Array) -> bool:
        for x, y in self._gradients(u, 2):
            if not (x[:, 0] * y[:, 1] > x[:, 1] * y[:, 0]).all():
                return True
        return False

    def shortest(self, u: Array) -> Any:
        """Smallest axial stretch where eps_xx is sampled."""
        return min([np.hypot(x[:, 0], x[:, 1]).min() for x, _ in self._gradients(u, 0)])


def beam_gradients(mesh: MeshBeam, element: ElementBeam, X: Array,
                   tind: Array | None = None) -> tuple[Array, Array]:
    """Derivatives of the shape functions along the axis and across it, and the beam frame."""
    # Shapes are (2, nelements, npoints, 2 nodal_dofs) and (2, nelements, npoints, 2); X (2,
    # npoints) are points of the reference cell.
    slopes, frame = element.slopes(mesh.mapping(), X, tind)
    G = np.ascontiguousarray(slopes.transpose(1, 2, 3, 0))
    # derivatives of a translation vanish exactly
    G[..., element.nodal_dofs] = -G[..., 0]
    return G, frame.transpose(1, 2, 3, 0)


@dataclass(frozen=True, eq=False)
class Samples:
    """Sampling points of the strains of a term."""

    X: Array  # points, (2, n)
    where: list[Array]  # numbers of the points of the axial rows, and of the others
    rows: Array  # as in StrainTables
    component: Array  # 0, 1 or 2 of each sample


@lru_cache(64)
def samples_of(at_xx: Any, at_yy: Any, at_xy: Any, eta: Any) -> Samples:
    """The :class:`Samples` for axial coordinates of xx, yy and xy, and coordinates across."""
    along, across = (np.union1d(at, at_xy) for at in (at_xx, at_yy))
    places, n, m = np.union1d(along, across), len(along) * len(eta), len(eta)

    def rows(at, xi):
        return (np.searchsorted(xi, at)[:, None] * m + np.arange(m)).ravel()

    xx, yy = rows(at_xx, along), n + rows(at_yy, across)
    x, y = rows(at_xy, along), n + rows(at_xy, across)
    return Samples(product_rule((places, places), (eta, eta))[0],
                   [rows(along, places), rows(across, places)],
                   np.array([np.concatenate([xx, yy, x]), np.concatenate([xx, yy, y])]),
                   np.repeat([0, 1, 2], [len(xx), len(yy), len(x)]))


@lru_cache(64)
def _unit_slopes(element, samples):
    X, (x, y) = samples.X, samples.where
    return element.unit_slopes(X[:, x], X[:, y])


def _rows(mesh, element, samples, tind):
    """G (1 or ne, rows, nb - 1) and frame (1 or ne, rows, 2)."""
    X, (x, y) = samples.X, samples.where
    if mesh.is_straight and mesh.heights is None and element.by_reference:
        unit, n, h = _unit_slopes(element, samples), len(x), mesh.height
        t = mesh.t if tind is None else mesh.t[:, tind]
        L = (mesh.lengths if tind is None else mesh.lengths[tind])[:, None]
        scale = np.empty((len(L), len(unit)))
        scale[:, :n], scale[:, n:] = 1.0 / L, 1.0 / h
        G = unit * (scale[:, :, None] * element.powers(h, L)[:, None])
        frame = np.empty((len(L), len(unit), 2))
        e = ((mesh.p[:, t[1]] - mesh.p[:, t[0]]) / L.T).T[:, None]
        frame[:, :n], frame[:, n:, 0], frame[:, n:, 1] = e, -e[..., 1], e[..., 0]
    else:
        both, frames = beam_gradients(mesh, element, X, tind)
        G = np.concatenate([both[0][:, x], both[1][:, y]], axis=1)
        frame = np.concatenate([frames[0][:, x], frames[1][:, y]], axis=1)
    return G[:, :, 1:], frame


@lru_cache(64)
def _mixing(samples, nodes, axis, means, coupled):
    """Matrix A (points, ns) from the samples to the integration points, pairs s <= t of samples
    that the law couples (2, nq), and the products of their columns and the sizes of these.

    ``nodes`` and ``axis`` are axial coordinates of the samples of each component, and of the
    integration points; ``means`` are the weights of the samples across, or their number if these
    are the points. ``coupled`` are the bytes of a matrix (3, 3): which components are.
    """
    across = np.eye(means) if isinstance(means, int) else np.array(means)
    A = np.concatenate([np.kron(np.eye(len(axis)) if at == axis else lagrange(at, axis), across)
                        for at in nodes], axis=1)
    c, size, row = samples.component, np.abs(A), np.arange(A.shape[1])
    both = np.frombuffer(coupled, bool).reshape(3, 3)[c[:, None], c] & (size.T @ size > 0.0)
    pairs = np.array((both & (row[:, None] < row) | (row[:, None] == row)).nonzero())
    products = A[:, pairs[0]] * A[:, pairs[1]]
    return A, pairs, products, np.abs(products)
