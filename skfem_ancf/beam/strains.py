"""Strain and stress of the elements at points. Stress and history variables of laws with a history
are linear between the integration points, also across the section: at the edge of a plastic zone
the stress has a kink, at which polynomials oscillate; and it is no function of the strain alone."""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander
from numpy.polynomial.polynomial import polyval

from ..core import Array, Law, Rule
from ..formulations import COMPONENTS, Term
from ..materials import HistoryMaterial
from .kernels.kernel import Past

def remembers(beam: Any) -> bool:
    """True if a material of a beam has a history."""
    return any(has_history(beam, k) for k in range(len(beam.across.layers)))


def with_history(beam: Any, history: Array) -> Any:
    """A beam with a history (n,) of its materials, for stress, energy and element forces."""
    other = object.__new__(type(beam))
    vars(other).update({name: x for name, x in vars(beam).items()
                        if name not in ("layers", "terms", "basis", "interpolation")})
    vars(other)["kernel"] = beam.kernel.remembering(Past(history, np.zeros(1), history))
    return other


def elements_of(beam: Any, k: int) -> Any:
    """The elements of layer k of a beam, with their history."""
    if not beam.has_sections:
        return beam.kernel.elements[k]
    layer = beam.across.layers[k]
    return next(e for one, e in zip(beam.kernel.integrals, beam.kernel.elements)
                if one.layer is layer)


def interpolated(beam: Any, k: int, values: Array, e: Array, X: Array) -> Array:
    """Values (c, points, ne) of layer k at points X (2, n) of elements e (n,), (c, n)."""
    if beam.has_sections:
        term = beam.layers[k].terms[0]
        along, across = term.axis[0], term.section[0]
    else:
        layer = beam.across.layers[k]
        along, across = beam.kernel.points, layer.measure.gauss(max(layer.material.points, 2))[0]
    values = values.reshape(len(values), len(along), len(across), -1)
    out = np.zeros((len(values), len(e)))
    (i, s), (j, t) = _places(along, X[0]), _places(across, X[1])
    for di, a in ((0, 1.0 - s), (1, s)):
        for dj, b in ((0, 1.0 - t), (1, t)):
            out += a * b * values[:, i + di, j + dj, e]
    return out


def _places(nodes, x):
    """Number of the interval of points, and their place in it, beyond [0, 1] outside."""
    k = np.clip(np.searchsorted(nodes, x) - 1, 0, len(nodes) - 2)
    return k, (x - nodes[k]) / (nodes[k + 1] - nodes[k])


def has_history(beam: Any, k: int) -> bool:
    """True if the material of layer k has a history."""
    return isinstance(beam.across.layers[k].material, HistoryMaterial)


def by_history(beam: Any, e: Array, X: Array, ask: Callable[[Any, Array], Array],
               other: float) -> Array:
    """A field (n,) of materials and histories (k, n) at points; ``other`` without a history."""
    like = np.zeros((len(e), 1))

    def of(k):
        if not has_history(beam, k):
            return like + other
        history = interpolated(beam, k, elements_of(beam, k).history, e, X)
        return ask(beam.across.layers[k].material, history)[:, None]

    return beam.across.of_layers(X[:, :, None], like, of, e, False)[:, 0]


def cable_forces(beam: Any, u: Array, e: Array, xi: Array) -> tuple[Array, Array]:
    """Normal force and moment (n,) of a cable, from the stress at its integration points."""
    kernel, n = beam.kernel, len(beam.kernel.points)
    T = sum(of.stress(of.strain(*of.at(np.array(u))[1:3])) for of in kernel.elements)
    T = T.reshape(2, n, -1) / kernel.weights.T
    k, s = _places(kernel.points, xi)
    N, M = (1.0 - s) * T[:, k, e] + s * T[:, k + 1, e]
    return N, M


class Interpolation:
    """Displacements as Chebyshev sums ``c_ij T_i(2 xi - 1) T_j(2 eta - 1)``."""

    def __init__(self, beam: Any) -> None:
        mesh, element, mapping = beam.mesh, beam.element, beam.mesh.mapping()
        self.nodes, self.lengths, self.start = mesh.t, mesh.lengths, beam.q0_local
        #: The reference configuration is curved, or its height varies.
        self.is_general = not mesh.is_straight or mesh.heights is not None
        self.tangents, self.height = mesh.p_X[:, mesh.t[0]], mesh.height
        self._heights = None if mesh.heights is None else mapping.heights
        #: Lateral contraction over stretch in the layers of a cable.
        self.lateral_ratios = None if beam.has_sections else np.array(
            [layer.material.lateral_ratio for layer in beam.across.layers])
        p, m = element.axis_degree + 1, max(element.order, 1) + 1
        swell = np.array([across for _, _, across in element.functionals] * 2)
        X = np.array([np.repeat(places(p), m), np.tile(places(m), p)])
        unit = transform(p) @ element.local(X, 1.0)[0].reshape(-1, p, m) @ transform(m).T
        self.table = mesh.height ** swell[:, None, None] * unit
        n = p + mapping.height_degree * int(swell.max())
        self.shape, self.swell = (n, m), swell
        #: Matrices from Chebyshev coefficients to those of the derivative.
        self.by_xi, self.by_eta = (
            np.vstack([2.0 * chebder(np.eye(k)), np.zeros(k)]) for k in (n, m))
        self.slope = element.local(np.zeros((2, 1)), 1.0)[3]

    def height_at(self, e: Array, xi: Array) -> Any:
        """Relative heights at xi (..., n) of elements (n,)."""
        return 1.0 if self._heights is None else polyval(xi, self._heights[:, e], tensor=False)

    def of_elements(self, q: Array, e: Array) -> Array:
        """Coefficients (p, m, 2, n) for DOFs (N,) on elements (n,)."""
        nodes = q.reshape(-1, len(self.slope) // 2, 2)
        q_e = np.concatenate([nodes[self.nodes[0, e]], nodes[self.nodes[1, e]]], axis=1)
        q_e[:, len(self.slope) // 2] -= q_e[:, 0]  # relative to the first node: less round-off
        q_e[:, 0] = 0.0
        q_e = q_e.transpose(1, 2, 0) * (self.lengths[e] ** self.slope[:, None])[:, None]
        if self._heights is None:
            found = self.table.reshape(len(q_e), -1).T @ q_e.reshape(len(q_e), -1)
        else:  # functions of the section are h^m P(Y / h)
            n, p = self.shape[0], self.table.shape[1]
            x = places(n)
            functions = (chebvander(2.0 * x - 1.0, p - 1) @ self.table).transpose(1, 2, 0)
            swollen = self.height_at(e, x[:, None])[:, None] ** self.swell[:, None]
            found = transform(n) @ (functions @ (
                swollen[:, :, None] * q_e).reshape(n, len(q_e), -1)).reshape(n, -1)
        return found.reshape(*self.shape, *q_e.shape[1:])


def places(n: int) -> Array:
    """Zeros of T_n(2 x - 1), shape (n,)."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)


def transform(n: int) -> Array:
    """Matrix (n, n) from values at :func:`places` to Chebyshev coefficients."""
    return np.linalg.inv(chebvander(2.0 * places(n) - 1.0, n - 1))


class Gradients:
    """Displacement gradient for ``u`` (N,) at points of elements ``e`` (n,)."""

    def __init__(self, beam: Any, u: Array, e: Array) -> None:
        self.at: Array
        self.basis = basis = beam.interpolation
        self.e, ne = e, len(basis.lengths)
        of, self.at = (e, np.arange(len(e))) if len(e) < ne else (np.arange(ne), e)
        c = basis.of_elements(u, of)
        if basis.is_general:  # the mapping is represented in the element's space
            c = np.concatenate([c, basis.of_elements(basis.start, of)], axis=2)
        self.by = np.array([np.tensordot(basis.by_xi, c, 1),
                            np.einsum("jk,pk...->pj...", basis.by_eta, c)])

    def __call__(self, xi: Any, eta: Any) -> tuple[Any, Any, Any]:
        """Derivatives along and across the axis, and its tangent, at points (n,)."""
        e, at, basis = self.e, self.at, self.basis
        if np.ndim(xi):
            table, at = _sum(self.by.swapaxes(0, 1), xi, at), np.arange(len(at))
        else:
            T = chebvander(2.0 * xi - 1.0, self.by.shape[1] - 1)[0]
            table = np.tensordot(T, self.by, (0, 1))
        by_xi, by_eta = _sum(table.swapaxes(0, 1), eta, at)
        if not basis.is_general:
            return by_xi / basis.lengths[e], by_eta / basis.height, basis.tangents[:, e]
        (a, b), (c, d) = by_xi[2:], by_eta[2:]
        x, y = _sum(table[0, :, 2:], 0.5, at)
        size = np.sqrt(x * x + y * y)
        x, y, det = x / size, y / size, a * d - b * c
        return (((x * d - y * c) * by_xi[:2] + (a * y - b * x) * by_eta[:2]) / det,
                ((a * x + b * y) * by_eta[:2] - (x * c + y * d) * by_xi[:2]) / det, (x, y))


def _sum(tables, x, at):
    """``sum_k T_k(2 x - 1) tables[k]`` at some elements."""
    T = chebvander(2.0 * x - 1.0, len(tables) - 1).T
    out = tables[0].take(at, axis=-1)
    for c, t in zip(tables[1:], T[1:]):
        out += c.take(at, axis=-1) * t
    return out


def strain_at(beam: Any, u: Array, e: Array, X: Array, term: Term | None = None,
              across: Rule | None = None) -> Array:
    """Green-Lagrange strain (eps_xx, eps_yy, 2 eps_xy), shape (3, n)."""
    # ``u`` (N,) is the displacement, ``e`` (n,) are elements, ``X`` (2, n) points of the reference
    # cell. Each component is sampled and interpolated as ``term`` says, by default the first term
    # of the formulation. ``across``, points and weights, gives the mean over sections.
    if not beam.has_sections:
        longer, ratio = fibres(beam, e, X, *cable_axis(beam, u, e, X[0])[1:])
        xx = longer + 0.5 * longer * longer
        return np.array([xx, ratio * xx, 0.0 * xx])
    rows = (0, 1, 2) if term is None else getattr(term.law, "rows", (0, 1, 2))
    samples = (term or beam.terms[0]).samples
    # sampling points along the axis (None: the points themselves), with components and weights
    sampled: dict[Any, list[Any]] = {}
    for row in rows:
        nodes = samples.get(COMPONENTS[row])
        if nodes is None:
            sampled.setdefault(None, []).append((row, 1.0))
        else:
            T = [chebvander(2.0 * np.asarray(x) - 1.0, len(nodes) - 1) for x in (nodes, X[0])]
            for place, w in zip(nodes, np.linalg.solve(T[0].T, T[1].T)):
                sampled.setdefault(float(place), []).append((row, w))
    gradients, out = Gradients(beam, u, e), np.zeros((3, len(e)), np.result_type(u, float))
    for eta, weight in ((X[1], 1.0),) if across is None else zip(*across):
        for place, wanted in sampled.items():
            a, b, (x, y) = gradients(X[0] if place is None else place, eta)
            # from the displacement derivatives a along the axis and b across it; (x, y) is the
            # tangent of the axis in the reference configuration
            for row, w in wanted:
                out[row] += weight * w * (
                    (x + 0.5 * a[0]) * a[0] + (y + 0.5 * a[1]) * a[1] if row == 0 else
                    (0.5 * b[0] - y) * b[0] + (x + 0.5 * b[1]) * b[1] if row == 1 else
                    (x + a[0]) * b[0] + (y + a[1]) * b[1] - y * a[0] + x * a[1])
    return out


def stress_at(beam: Any, u: Array, e: Array, X: Array) -> Array:
    """Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy), shape (3, n)."""
    E, at = strain_at(beam, u, e, X)[..., None], X[:, :, None]
    law = (partial(beam.formulation.stress, strain=E, u=u, X=at, tind=e) if beam.has_sections else
           partial(_stress_of_cable, strain=E, X=at, tind=e))

    def of(k):
        S = law(beam.layers[k])
        if not has_history(beam, k):
            return S
        own = elements_of(beam, k)
        S, *_ = own.evaluate(own.strain_at(np.array(u.real)))
        found = interpolated(beam, k, S, e, X)[..., None]
        if not beam.has_sections:
            found = np.array([found[0] / stretched(E[0].real)[0], 0.0 * E[0].real, 0.0 * E[0].real])
        return found + 1j * S.imag if np.iscomplexobj(S) else found

    return beam.across.of_layers(at, E, of, e)[..., 0]


def on_grid(of: Any, beam: Any, u: Array, X: Array, tind: Array | None, *more: Any) -> Array:
    """Evaluate :func:`strain_at` or :func:`stress_at` at points of elements."""
    e, points, shape = points_of_grid(beam.mesh.nelements, X, tind)
    return of(beam, u, e, points, *more).reshape(3, *shape)


def points_of_grid(ne: int, X: Array, tind: Array | None) -> tuple[Array, Array, tuple[int, int]]:
    """Elements (n,), points (2, n) and (nelements, npoints) of X (2, [nelements,] npoints)."""
    tind = np.arange(ne) if tind is None else tind
    shape = len(tind), X.shape[-1]
    return (np.repeat(tind, shape[1]), X.reshape(2, -1) if X.ndim == 3 else np.tile(X, shape[0]),
            shape)


class BeamLayer:
    """A layer of a beam with the terms of its strain energy."""

    def __init__(self, beam: Any, layer: Any, terms: Sequence[Term]) -> None:
        self.beam, self.material, self.terms = beam, layer.material, terms
        self._element = beam.across.element_of(layer)

    @cached_property
    def law(self) -> Law:
        """The constitutive law, with the shear factor of the section."""
        return self.material.law(self.material.shear_factor(self._element))

    def strain(self, term: Term, u: Array, X: Array, tind: Array | None = None,
               across: Rule | None = None) -> Array:
        """The strain of a term, or its mean ``across`` sections; (3, nelements, npoints)."""
        return on_grid(strain_at, self.beam, u, X, tind, term, across)


# cables


def stretched(xx: Array) -> tuple[Array, Array]:
    """Stretch of a fibre with a Green-Lagrange strain, and stretch - 1 without cancellation."""
    stretch = np.sqrt(1.0 + 2.0 * xx)
    return stretch, 2.0 * xx / (1.0 + stretch)


def cable_axis(beam: Any, u: Array, e: Array, xi: Array) -> tuple[Any, Any, Any, Any]:
    """The axis of a cable at xi (n,) of elements e (n,)."""
    # Unit tangents before and after, (2, 2, n); stretch - 1, change of curvature, and initial
    # curvature, (n,).
    L, basis = beam.mesh.lengths[e], beam.interpolation
    derivatives = []
    for q in (beam.q0_local, u):
        by_xi = np.tensordot(basis.by_xi, basis.of_elements(q, e)[:, 0], 1)
        derivatives += [_sum(c, xi, np.arange(len(e))) / L ** (k + 1)
                        for k, c in enumerate((by_xi, np.tensordot(basis.by_xi, by_xi, 1)))]
    a0, b0, da, db = derivatives
    if beam.mesh.is_straight:
        b0 = 0.0 * b0
    a, b = a0 + da, b0 + db
    (square0, square), (kappa0, kappa) = zip(*(
        (s := x[0] * x[0] + x[1] * x[1], (x[0] * y[1] - x[1] * y[0]) / s)
        for x, y in ((a0, b0), (a, b))))
    length0, length = np.sqrt(square0), np.sqrt(square)
    strain = np.array([((2.0 * a[0] - da[0]) * da[0] + (2.0 * a[1] - da[1]) * da[1])
                       / (length + length0), kappa - kappa0])
    if np.iscomplexobj(strain) and not u.real.any():
        strain.real = 0.0  # exactly, without round-off of a curved axis
    return (a0 / length0, a / length), strain[0], strain[1], kappa0


def fibres(beam: Any, e: Array, X: Array, extension: Array, bending: Array, kappa0: Array) -> Any:
    """Stretch - 1 of the fibres of a cable at points (2, n), and eps_yy over eps_xx."""
    basis = beam.interpolation
    Y = (X[1] - 0.5) * basis.height * basis.height_at(e, X[0])
    ratios = basis.lateral_ratios
    if len(ratios) > 1:
        ratios = ratios[beam.across.which(X[:, :, None], e)[:, 0]]
    return (extension - Y * bending) / (1.0 - Y * kappa0), -ratios


def _stress_of_cable(layer, strain, X, tind):
    beam, (stretch, longer) = layer.beam, stretched(strain[0])
    if not beam.mesh.is_straight:
        kappa0 = cable_axis(beam, 0.0 * beam.q0, tind, X[0, :, 0])[3][:, None]
        longer = longer * (1.0 - beam.mesh.mapping().offset(X, tind) * kappa0)
    S = layer.material.axial_modulus * longer / stretch
    return np.array([S, 0.0 * S, 0.0 * S])
