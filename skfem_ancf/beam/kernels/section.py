"""Tables of beams with sections: Green-Lagrange strains, sampled as the formulation says. Rows are
d/dX, then d/dY, at the points of the samples.

Tables of the shear-rigid cable. ``U = 1/2 int E A eps^2 - 2 E S eps k + E I k^2 ds`` with ``eps
= |r'| - 1``, the change ``k`` of the material curvature ``kappa = r' x r'' / |r'|^2`` (rotation of
the tangent per reference length), and the first moment S of the section about the axis. Both are
sampled at 2 m - 2 Gauss points for an axis of degree 2 m - 1. Those of the cubic axis miss a mode
(equal axial slopes at both nodes), which gets a third point in the middle with a weight that
decreases with the slenderness. Rows are d/dX and d^2/dX^2 at each point."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, array_cache, first_order, gauss, lagrange, product_rule, refuse
from ...elements.base import ElementBeam
from ...formulations import Formulation, Term
from ...materials.history import HistoryMaterial
from ...mesh.mesh_beam import MeshBeam
from ...sections import Across, Layer
from .kernel import ElementKernel, fibres, strains
from .tables import CABLE, LINEAR, NO_LAW, OF_WEIGHTS, SECTION, law_tables, pattern_of


class Integral(NamedTuple):
    """One term of the strain energy of one layer."""

    layer: Layer
    term: Term
    samples: "Samples"
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
        self.tables, self.integrals = [], []
        tind, rows = np.array([0]) if across.uniform else None, dict[Any, Any]()
        for layer, terms in across.terms(formulation):
            for k, term in enumerate(terms):
                *nodes, eta, axis = (tuple(np.asarray(x, dtype=float).tolist()) for x in (
                    *map(term.nodes, ("xx", "yy", "xy")), term.section_nodes, term.axis[0]))
                samples = samples_of(*nodes, eta)
                if samples not in rows:
                    rows[samples] = _rows(across.mesh, across.element, samples, tind)
                G, frame = rows[samples]
                whole, (X, W) = len(term.section[0]) == 1, term.quadrature
                volumes = across.volume(layer, X, W, tind, whole)
                weights = volumes if layer.grade is None else across.volume(
                    layer, X, W, tind, whole, "grade")
                law = law_tables(term.law, self)
                linear, means = law.kind == LINEAR, (
                    len(eta) if term.section_samples is None else tuple(
                        map(tuple, np.asarray(term.section_samples[1]).tolist())))
                A, pairs, products, sizes = _mixing(samples, tuple(nodes), axis, means, (
                    law.D != 0.0) | (not linear))
                H, along = weights @ products, np.zeros((0, A.shape[1]))
                if linear:  # others are round-off
                    keep = (np.abs(H) > 1e-14 * (np.abs(weights) @ sizes)).any(axis=0)
                    keep |= pairs[0] == pairs[1]
                    pairs, H = pairs.compress(keep, 1), H.compress(keep, 1)
                else:
                    along = np.concatenate([
                        np.where(samples.component == k, A, 0.0) for k in range(3)])
                H *= law.D[tuple(samples.component[pairs])]
                self.tables.append(self._tables_of(
                    pattern_of(SECTION, samples.rows, pairs), G, frame, H, law, along, weights,
                    np.zeros((len(weights), 0)), constant=not self.tables))
                self.integrals.append(Integral(layer, term, samples, volumes, k == 0))
        self.points_number = sum(one.volumes.shape[1] for one in self.integrals)

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
                yield r[e.t.pattern.rows[:, one.samples.component == component]]

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


@array_cache(64)
def _mixing(samples, nodes, axis, means, coupled):
    """Matrix A (points, ns) from the samples to the integration points, pairs s <= t of samples
    that the law couples (2, nq), and the products of their columns and the sizes of these.

    ``nodes`` and ``axis`` are axial coordinates of the samples of each component, and of the
    integration points; ``means`` are the weights of the samples across, or their number if these
    are the points. ``coupled`` is a matrix (3, 3): which components are.
    """
    across = np.eye(means) if isinstance(means, int) else np.array(means)
    A = np.concatenate([np.kron(np.eye(len(axis)) if at == axis else lagrange(at, axis), across)
                        for at in nodes], axis=1)
    c, size, row = samples.component, np.abs(A), np.arange(A.shape[1])
    both = coupled[c[:, None], c] & (size.T @ size > 0.0)
    pairs = np.array((both & (row[:, None] < row) | (row[:, None] == row)).nonzero())
    products = A[:, pairs[0]] * A[:, pairs[1]]
    return A, pairs, products, np.abs(products)


@array_cache(64)
def _unit(element, points):
    """Derivatives of the axis by xi at each point, the first and the second, (rows, nb), and the
    powers of the length with which they are those by X, (rows,)."""
    slopes = np.stack([element.axis(points, d).T for d in (1, 2)], axis=1)
    return slopes.reshape(2 * len(points), -1), np.tile([-1.0, -2.0], len(points))


@lru_cache(64)
def _samples(n, moduli):
    """The Pattern of n points with the moduli EA, EI, and -ES if three, and the order of these."""
    s = np.arange(n)
    rows = 2 * np.array([[*s, *s], [*s, *s]])
    rows[1, n:] += 1
    pairs = np.concatenate([[c * n + s, d * n + s] for c, d in (
        (0, 0), (1, 1), (0, 1))[:moduli]], axis=1)
    order = np.lexsort(pairs[::-1])
    return pattern_of(CABLE, rows, pairs[:, order]), order


class CableKernel(ElementKernel):
    """The kernel of a cable; ``points`` (points,) are its Gauss points on [0, 1]."""

    def __init__(self, across: Across, formulation: Formulation) -> None:
        mesh, element = across.mesh, across.element
        super().__init__(mesh, element)
        self.constant = across.stabilisation(formulation)
        n = formulation.points_along(element, across.layers[0].material)
        if n == 2:
            alpha, length = getattr(formulation, "alpha", 1.0), float(mesh.chain_lengths.min())
            if across.simple:
                square = mesh.height**2 / 12.0
            else:
                EA, ES, EI = across.moments(np.array([0.5]), None, "E")[:, :, 0]
                square = float(np.max((EI - ES**2 / EA) / EA))  # E I about the centroid
            # exact for cubics: two Gauss points and a weighted middle one; a weight of 4/9 gives
            # the three-point Gauss rule, which is the maximum. 1200 is the stiffness of the mode
            # that two points miss, in EI over the squared length of the beam; the third point has
            # a quarter of it
            middle = min(alpha * 1200.0 * square / length**2, 4.0 / 9.0)
            x, outer = 0.5 / np.sqrt(3.0 * (1.0 - middle)), 0.5 * (1.0 - middle)
            self._rule = np.array([0.5 - x, 0.5, 0.5 + x]), np.array([outer, middle, outer])
        else:
            joined = mesh.t[0, 1:] == mesh.t[1, :-1]
            alone = ~(np.append(False, joined) | np.append(joined, False))
            if self.constant is None and alone.any():
                n = max(n, element.axis_degree)  # no neighbour stabilises modes of fewer points
            self._rule = gauss(n)
        self.points, self._across = self._rule[0], across
        self.points_number = len(self.points)
        same = mesh.is_uniform or np.ptp(mesh.lengths) <= 1e-13 * mesh.lengths.max()
        history = any(isinstance(layer.material, HistoryMaterial) for layer in across.layers)
        self.tables = (self._with_fibres(mesh, element, same) if history else
                       [self._table(mesh, element, same)])

    def _table(self, mesh, element, same):
        """Tables of the reference element scaled by the lengths, for one or all elements."""
        n, w = self.points_number, self._rule[1]
        L = (mesh.lengths[:1] if same else mesh.lengths)[:, None]
        unit, orders = _unit(element, self.points)
        G = unit * (L**orders)[:, :, None] * element.powers(1.0, L)[:, None]
        EA, ES, EI = self._across.moments(
            self.points, np.zeros(1, int) if same and self._across.constant else None) * (w * L)
        moduli = [EA, EI, -ES] if ES.any() else [EA, EI]
        pattern, order = _samples(n, len(moduli))
        #: Modulus times volume.
        self.scale = float(EA.sum()) * (mesh.nelements // len(EA))
        H = np.concatenate(moduli, axis=1).take(order, 1)
        # r_X and r_XX in the reference configuration
        if mesh.is_straight:
            left = mesh.t[0, :1] if mesh.is_uniform else mesh.t[0]
            frame = np.zeros((len(left), 2 * n, 2))
            frame[:, ::2] = mesh.p_X[:, left].T[:, None]
        else:
            q0 = element.rigid(mesh)
            q0[0] = mesh.p - mesh.p.mean(axis=1, keepdims=True)
            frame = G @ self.gather(np.ascontiguousarray(q0.transpose(2, 0, 1)).ravel())
        return self._tables_of(pattern, G[:, :, 1:], frame, H, NO_LAW, np.zeros((0, 2 * n)),
                               *np.zeros((2, 1, 0)))

    def _with_fibres(self, mesh, element, same):
        """A table of fibres for each layer."""
        across = self._across
        refuse(any(callable(layer.grade) for layer in across.layers), "a cable with a law that has "
               "a history needs a constant E in its other layers: give more layers in place of "
               "E(x, y), or use an element with sections")
        same = same and across.constant
        whole, n = self._table(mesh, element, same), self.points_number
        L, tind = mesh.lengths[:, None], None
        if same:
            L, tind = L[:1], np.zeros(1, int)
        (pattern, order), out = _samples(n, 3), []
        for layer in across.layers:
            y, h, A = fibres(across, layer, self.points, tind)
            Y, every = h[..., None] * y, np.repeat(np.eye(n), len(y), 0)
            along = np.concatenate([every, -np.tile(y, n)[:, None] * every], axis=1)
            weights = L * (self._rule[1][:, None] * A).reshape(len(A), -1)
            reach = np.concatenate([np.ones_like(h), h], axis=1) + np.zeros((len(weights), 1))
            E = layer.material.axial_modulus
            H = np.concatenate([E * np.sum(A * Y**k, axis=-1) * (-1.0) ** k * L * self._rule[1]
                                for k in (0, 2, 1)], axis=1)
            law = law_tables(layer.material.law(), self)
            if law.kind == LINEAR:
                along, (weights, reach) = np.zeros((0, 2 * n)), np.zeros((2, 1, 0))
            at = whole.at.copy()
            at[:, OF_WEIGHTS] = np.arange(len(at)) if len(weights) > 1 else 0
            out.append(whole._replace(
                at=at, pattern=pattern, H=np.ascontiguousarray(H[:, order]),
                C=whole.C[:0] if out else whole.C, law=law, along=along, weights=weights,
                reach=reach))
        return out

    @property
    def weights(self) -> Array:
        """Weights of the points of each element, (ne, points)."""
        return np.outer(self._across.mesh.lengths, self._rule[1])

    @property
    def volume(self) -> float:
        w, area = self._rule[1], self._across.moments(self.points, what="area")[0]
        return float(area @ w @ self._across.mesh.lengths)

    def strain(self, u: Array) -> Array:
        """Extension and change of curvature at the points, (2, points, ne)."""
        return strains(self.elements[0], self._checked(u)).reshape(2, self.points_number, -1)

    def outer_stretches(self, u: Array) -> Array:
        """Stretch of the bottom and top fibres, (2, points, ne)."""
        def measured(z):
            return np.abs(z[:, ::2]), (z[:, 1::2] / z[:, ::2]).imag

        t, h = self.tables[0], self._across.mesh.mapping().height(self.points)[0]
        z = t.frame.view(complex)[..., 0]
        start, bent = measured(z)
        y = np.array([-0.5, 0.5])[:, None, None] * h
        if u.dtype.kind == "c":
            eps, kappa = (x.T for x in first_order(self.strain(u)))
        else:
            U = self.gather(self._checked(u)).view(complex)[..., 0]
            U[:, self.nd // 2] -= U[:, 0]
            U = U[:, 1:]
            length, curvature = measured(z + (
                U @ t.G[0].T if len(t.G) == 1 else (t.G @ U[..., None])[..., 0]))
            eps, kappa = length - start, curvature - bent
        return (1.0 + (eps - y * kappa) / (1.0 - y * bent)).swapaxes(1, 2)
