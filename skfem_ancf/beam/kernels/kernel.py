"""Kernels of one beam, and elements of laws with a history."""

from collections.abc import Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, cached_property, refuse
from ...elements.base import ElementBeam
from ...mesh.mesh_beam import MeshBeam
from .elements import Elements, run_eigen_force, run_eigen_tangent, run_force, run_tangent
from .tables import CABLE, HISTORY, LINEAR, StrainTables, material_of, repeated, separated


class ElementKernel:
    """Base class of the kernels of one beam. Displacements u are (N,), element forces (ne, nb, 2),
    weighted stresses (ne, ns) for each of :attr:`tables`, the
    :class:`~skfem_ancf.beam.kernels.tables.StrainTables` of the terms of the strain energy.
    ``constant`` is the stabilisation, (ne, 2 nb, 2 nb) or (1, ...), or None; ``points_number`` the
    number of integration points of an element."""

    tables: list[StrainTables]
    constant: Array | None
    points_number: int

    def __init__(self, mesh: MeshBeam, element: ElementBeam) -> None:
        self.nd, self.t = 2 * element.nodal_dofs, mesh.t
        self._ends: Any = (slice(-1), slice(1, None)) if mesh.is_chain else mesh.t
        self.N = self.nd * mesh.p.shape[1]

    def _tables_of(self, pattern, G, frame, H, law, *points, constant=True):
        """StrainTables of all elements, with the constant stiffness or without; ``points`` are
        their last three."""
        n, whole = 2 * self.nd - 2, self.constant if constant else None
        C = np.zeros((0, n, n)) if whole is None else whole[:, 2:, 2:]
        each = [len(x) > 1 for x in (G, frame, H, C, points[1])]
        return StrainTables(
            pattern, self.nd * self.t[0].astype(np.int64),
            np.arange(self.t.shape[1])[:, None] * each,
            *map(np.ascontiguousarray, (G, frame, H, C)), law,
            *map(np.ascontiguousarray, points))

    def gather(self, u: Array, elements: Any = slice(None)) -> Array:
        """Element values (ne, nb, 2) of DOFs (N,)."""
        return u.reshape(-1, self.nd).take(self.t[:, elements].T, 0).reshape(-1, self.nd, 2)

    def scatter(self, force: Array) -> Array:
        """Sum (N,) of element vectors (ne, nb, 2)."""
        out = np.zeros(self.N, dtype=force.dtype)
        nodes, parts = out.reshape(-1, self.nd), force.reshape(-1, 2, self.nd)
        left, right = self._ends
        nodes[left] += parts[:, 0]  # left nodes are unique
        nodes[right] += parts[:, 1]
        return out

    def _checked(self, u):
        refuse(u.shape != (self.N,), "the displacement of this beam must have the shape ({},), "
               "got {}: is it the state of another mesh?", self.N, u.shape)
        return u if u.dtype.kind == "c" else np.ascontiguousarray(u, dtype=float)

    @property
    def linear(self) -> bool:
        """True if all moduli are constant."""
        return all(t.law.kind == LINEAR for t in self.tables)

    def remembering(self, past: "Past") -> "ElementKernel":
        """The kernel with a history of its laws, of which it has views."""
        other = copy(self)
        vars(other).update(elements=remembering(self.elements, past),
                           _apart=remembering(self._apart, past))
        return other

    def energy(self, u: Array) -> Any:
        """Strain energy of a displacement (N,), or of several, (k, N): shape () or (k,)."""
        if u.ndim == 1:
            return np.sum(self.energies(u))
        n = max(1, 4096 // self.t.shape[1])  # of about so many elements together
        return np.concatenate([np.sum(self._energies(u[k:k + n]), axis=1)
                               for k in range(0, len(u), n)])

    def energies(self, u: Array) -> Array:
        """Strain energy of each element, shape (ne,)."""
        return self._energies(self._checked(u)[None])[0]

    def _energies(self, u):
        """Energies (k, ne) of displacements (k, N)."""
        k, out = len(u), np.zeros(u.shape[0] * self.t.shape[1], dtype=u.dtype)
        many = self.elements if k == 1 else [
            elements_of(repeated(t, k, self.N)) for t in self.tables]
        for e in many:
            strain = strains(e, u.ravel())
            if e.t.law.kind == LINEAR:
                out += 0.5 * np.sum(strain * e.linear_stress(strain), axis=0)
            else:
                out += energy_at(e, e.at_points(strain))
            if e.C is not None:
                U = e.relative(u.ravel()).reshape(2 * e.m, -1)
                out += 0.5 * np.einsum("ie,kij,je->e" if len(e.C) == 1 else "ie,eij,je->e", U,
                                       e.C, U)
        return out.reshape(k, -1)

    @cached_property
    def elements(self) -> list[Elements]:
        """The :class:`~skfem_ancf.beam.kernels.elements.Elements` of :attr:`tables`."""
        return list(map(elements_of, self.tables))

    @cached_property
    def _apart(self):
        """The same with separate DOFs for each element."""
        return [elements_of(separated(t)) for t in self.tables]

    def force(self, u: Array) -> Array:
        """Internal force of a displacement, shape (N,)."""
        return self.scatter(self.forces(u))

    def forces(self, u: Array) -> Array:
        """Internal forces of the elements, linearised for a complex u."""
        if not np.iscomplexobj(u):
            return self._forces(u)
        return self.forces(u.real) + 1j * self._times(self.tangents(u.real), u.imag)

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """The force (N,) whose work from u0 to u1 is the change of the energy."""
        return self.scatter(self._forces(u0, u1))

    def forces_of(self, stresses: list[Array], u: Array) -> Array:
        return self._forces(u, given=stresses)

    def eigenstrain_forces(self, given: list[Array], u: Array, end: Array | None = None) -> Array:
        """Change of :meth:`forces`, or of their mean from u to ``end``, by eigenstrains."""
        # ``given`` are stresses for tables of linear laws, and strains at the points of others, (3,
        # points, ne).
        if np.iscomplexobj(u):
            return self.eigenstrain_forces(given, u.real) + 1j * self._times(
                self.eigenstrain_tangents(given, u.real), u.imag)
        return self._forces(u, end, given, eigen=True)

    def eigenstrain_tangents(self, given: list[Array], u: Array) -> Array:
        """Change of the :meth:`tangents` by eigenstrains, see :meth:`eigenstrain_forces`."""
        return self._tangents(run_eigen_tangent, u, given)

    def _forces(self, u, v=None, given=None, eigen=False):
        """Element forces at u, or means from u to v, of the strain, or of given stresses."""
        u = self.gather(self._checked(u)).ravel()
        v = u[:0] if v is None else self.gather(self._checked(v)).ravel()
        out = np.zeros_like(u)
        for k, e in enumerate(self._apart):
            T = u[:0] if given is None else given[k].ravel()
            if eigen:
                run_eigen_force(e, u, v, T, out)
            else:
                run_force(e, u, v, T, u[:0], out)
        return out.reshape(self.t.shape[1], -1, 2)

    def _times(self, K, u):
        """Element matrices times a displacement, as element forces."""
        u_e = self.gather(u)
        return (K @ u_e.reshape(len(K), -1, 1)).reshape(u_e.shape)

    def viscous_forces(self, u: Array, v: Array, time: float) -> Array:
        """Viscous element forces for the rate v of the displacement."""
        u, v = (self.gather(self._checked(x)).ravel() for x in (u, v))
        out = np.zeros_like(u)
        for e in self._apart:
            Y = e.at(u)[3]
            e.add(e.force(Y, time * e.linear_stress(e.change(Y, e.rows(e.relative(v))))), out)
        return out.reshape(self.t.shape[1], -1, 2)

    def small_forces(self, u: Array) -> Array:
        """Linearised element forces, ``K(0) u`` by the strain, which has less round-off."""
        if np.iscomplexobj(u):
            return 1j * self.small_forces(self._checked(u).imag)
        u_e = self.gather(self._checked(u)).ravel()
        out = np.zeros_like(u_e)
        for e in self._apart:
            U, Y = e.relative(u_e), e.directions(e.rest, e.rest)
            Y = np.broadcast_to(Y, (*Y.shape[:2], e.ne))
            e.add(e.force(Y, e.linear_stress(e.change(Y, e.rows(U))), U), out)
        return out.reshape(self.t.shape[1], -1, 2)

    def small_energy(self, u: Array) -> float:
        """The quadratic part of the strain energy."""
        u_e = self.gather(u)
        u_e[:, self.nd // 2] -= u_e[:, 0]  # relative to the first node: less round-off
        u_e[:, 0] = 0.0
        return 0.5 * float(np.sum(u_e * self.small_forces(u)))

    def tangents(self, u: Array) -> Array:
        """Element tangents (ne, 2 nb, 2 nb)."""
        return self._tangents(lambda e, u, given, flat, ld: run_tangent(
            e, u, given, given, given, flat, ld), u)

    def geometric(self, u: Array, stress: Array) -> Array:
        """Geometric element stiffness (ne, 2 nb, 2 nb) for stresses (ne, m)."""
        # The stresses of all :attr:`tables` are side by side; further columns are ignored.
        given = np.split(stress, np.cumsum([t.pattern.ns for t in self.tables]), axis=1)

        def run(e, u, given, flat, ld):
            _, _, one, Y = e.at(u)
            e.add_to_band(e.tangent(one, Y, given.reshape(e.ne, e.ns).T, None), flat, ld)

        return self._tangents(run, u, given)

    def _tangents(self, run, u, given=None):
        u, n = self.gather(self._checked(u)).ravel(), 2 * self.nd
        flat = np.zeros((self.t.shape[1], n, n + 1))
        for k, e in enumerate(self._apart):
            run(e, u, u[:0] if given is None else given[k].ravel(), flat.reshape(-1), n + 1)
        i, j = np.tril_indices(n)
        out = np.empty((len(flat), n, n))
        out[:, i, j] = out[:, j, i] = flat[:, j, i - j]
        return out

    def gradients(self, u: Array) -> tuple[Array, Array, Array]:
        """B, HB (ne, m, 2 nb) of tangents ``B^T HB``, stresses (ne, m); no cancellation in B."""
        u, ne, n = self._checked(u), self.t.shape[1], 2 * self.nd
        found, stresses = [], []
        for e in self.elements:
            _, d, one, Y = e.at(u)
            strain, B = e.strain(d, one), e.derivatives(Y)
            found.append(np.array([B, e.square(e.moduli_at(strain)) @ B]))
            stresses.append(e.stress(strain).T)
        if self.constant is not None:
            # R with R^T R = constant, which is semidefinite
            size = np.sqrt(np.diagonal(self.constant, axis1=1, axis2=2))  # units of DOFs differ
            size = np.where(size > 0.0, size, 1.0)[:, :, None]
            values, V = np.linalg.eigh(self.constant / (size * size.transpose(0, 2, 1)))
            values = np.where(values > 1e-12 * values[:, -1:], values, 0.0)
            R = (np.sqrt(values[:, None]) * V * size).transpose(0, 2, 1)
            R = np.broadcast_to(R, (ne, n, n))
            found.append(np.array([R, R]))
            stresses.append((R @ self.gather(u).reshape(ne, n, 1))[..., 0])
        return *np.concatenate(found, axis=2), np.concatenate(stresses, axis=1)

    def inverted(self, u: Array) -> bool:
        """True if the body is turned inside out somewhere."""
        return False


def strains(e: Elements, u: Array) -> Array:
    """Strains of the samples, (ns, ne), linearised for a complex u."""
    _, d, one, Y = e.at(u.real)
    strain = e.strain(d, one)
    if not np.iscomplexobj(u):
        return strain
    return strain + 1j * e.change(Y, e.rows(e.relative(u.imag)))


def energy_at(e: Elements, E: Array) -> Array:
    """Energy (ne,) of strains (3, points, ne) at the integration points."""
    if isinstance(e, ElementsWithHistory):
        return np.sum(e.weights * e.energy(E), axis=0)
    return np.sum(e.weights * e.of_law(1, E)[0], axis=0)


def stresses_of(e: Elements, strain: Array) -> Array:
    """Weighted stresses (ne, ns) of strains (ns, ne) with constant moduli."""
    return e.linear_stress(strain).T.copy()


class Past(NamedTuple):
    """A history (n,) at the start of an increment, and the time ``span`` (1,) since. ``now`` (n,)
    has the eigenstrains at the end, where the history has those at the start."""

    history: Array
    span: Array
    now: Array


def history_size(t: StrainTables) -> int:
    """Number of history variables and components of eigenstrain; 0 for elastic laws."""
    if t.law.kind != HISTORY:
        return 0
    rows = material_of(t.law).number + (1 if t.pattern.kind == CABLE else 3)
    return rows * t.weights.shape[1] * len(t.start)


def elements_of(t: StrainTables) -> Elements:
    """The Elements of tables, those with a history at rest."""
    return ElementsWithHistory(t) if t.law.kind == HISTORY else Elements(t)


def remembering(elements: Sequence[Elements], past: Past) -> list[Elements]:
    """The elements with consecutive parts of a Past, of which they have views."""
    out, first = [], 0
    for e in elements:
        last = first + history_size(e.t)
        out.append(e.remembering(past.history[first:last], past.span, past.now[first:last])
                   if isinstance(e, ElementsWithHistory) else e)
        first = last
    return out


#: Relative difference of strains that is round-off.
SAME = 1e-12
#: What copies of elements share.
CONSTANT = ("weights", "reach", "constant", "_G_ends", "_to_moduli", "_reach_of_pairs",
            "_products", "_signs")


class ElementsWithHistory(Elements):
    """Elements of a :class:`~skfem_ancf.materials.HistoryMaterial`. ``history`` (k, points, ne) is
    that at the start of an increment, ``span`` (1,) its time; ``before`` and ``now`` (c, points,
    ne) are the eigenstrains at its start and end. The law has the strain minus these. Cables have
    fibres: their points have one strain, along the axis."""

    def __init__(self, t: StrainTables) -> None:
        super().__init__(t)
        self.material, self._fibres = material_of(t.law), t.pattern.kind == CABLE
        self._own(np.zeros(history_size(t)), np.zeros(1), np.zeros(history_size(t)))
        self._scale = t.law.scale.reshape(3, 1, 1)
        self._known: Any = (np.zeros(0), None, np.zeros(0), np.zeros(0), np.nan)
        self.elastic: Any = None  # moduli (c, c) and stress at zero strain if it is elastic

    def _own(self, history, span, now):
        shape, n = (-1, self.t.weights.shape[1], self.ne), self.material.number
        self.history, self.before = np.split(history.reshape(shape), [n])
        self.now, self.span = now.reshape(shape)[n:], span

    def remembering(self, history: Array, span: Array, now: Array) -> "ElementsWithHistory":
        """A copy with another history, time span and eigenstrains at the end, see :class:`Past`."""
        for name in CONSTANT:  # made once for all copies
            getattr(self, name)
        other = copy(self)
        other._own(history, span, now)
        return other

    def elastic_from(self, u: Array) -> "ElementsWithHistory":
        """A copy that is elastic from its stress at u: no yielding, no relaxation."""
        other, E = copy(self), self.strain_at(u)
        D = np.atleast_2d(self.material.axial_modulus) if self._fibres else self.t.law.D
        other.elastic = D, self.evaluate(E, 0.0)[0] - np.tensordot(D, E - self.before, 1)
        return other

    def evaluate(self, E: Array, dt: float | None = None) -> tuple[Array, Array, Array]:
        """Stress (c, points, ne), moduli (c, c, points, ne) and history at strains at the points.
        They are at the end of the increment; with ``dt = 0`` at its start."""
        E = E - (self.now if dt is None else self.before)
        dt = float(self.span[0]) if dt is None else dt
        if self.elastic is not None:
            D, S0 = self.elastic
            return S0 + np.tensordot(D, E, 1), np.broadcast_to(
                D[..., None, None], (*D.shape, *E.shape[1:])), self.history
        if self._fibres:
            S, D, after = self.material.axial(E[0], self.history, dt)
            return S[None], D[None, None], after
        S, D, after = self.material.evaluate(self._scale * E, self.history, dt)
        return self._scale * S, self._scale[:, None] * D * self._scale, after

    def energy(self, E: Array, history: Array | None = None) -> Array:
        """Stored energy per volume (points, ne), at the end with its history, or at the start."""
        E = E - (self.before if history is None else self.now)
        history = self.history if history is None else history
        if self._fibres:
            return self.material.axial_energy(E[0], history)
        return self.material.energy(self._scale * E, history)

    def stress(self, strain: Array, change: Array | None = None, shift: Array | None = None
               ) -> Array:
        """Weighted stresses (ns, ne); with a ``change`` of the strain the mean of both ends."""
        # The work of this mean is the change of the stored energy and what is dissipated.
        if change is None:
            return self._weighted(self.evaluate(self.at_points(strain))[0])
        E, half = self.at_points(strain), 0.5 * self.at_points(change)
        return self._weighted(0.5 * (self.evaluate(E - half, 0.0)[0] + self.evaluate(E + half)[0]))

    def stress_and_moduli(self, strain: Array) -> tuple[Array, Array]:
        S, D, _ = self.evaluate(self.at_points(strain))
        moduli = self._moduli_of_samples(D)
        self._known = (strain.copy(), moduli, self.now.copy(), self.history.copy(),
                       float(self.span[0]))
        return self._weighted(S), moduli

    def moduli_at(self, strain: Array, shift: Array | None = None) -> Array:
        E, moduli, now, history, dt = self._known  # often where an iteration has been
        if dt == self.span[0] and np.array_equal(now, self.now) and np.array_equal(
                history, self.history) and np.max(np.abs(strain - E)) <= SAME * np.max(np.abs(E)):
            return moduli
        return self._moduli_of_samples(self.evaluate(self.at_points(strain))[1])

    def strain_at(self, u: Array) -> Array:
        """Strain at the integration points, (c, points, ne)."""
        _, d, one, _ = self.at(u)
        return self.at_points(self.strain(d, one))

    def accept(self, u: Array, v: Array) -> float:
        """Set the history at the end of an increment from u to v; returns what it dissipates."""
        E0, E1 = self.strain_at(u), self.strain_at(v)
        S0, (S1, _, after) = self.evaluate(E0, 0.0)[0], self.evaluate(E1)
        change = E1 - self.now - (E0 - self.before)  # eigenstrains do no work
        work = np.sum(0.5 * (S0 + S1) * change, axis=0)
        lost = float(np.sum(self.weights * (work - self.energy(E1, after) + self.energy(E0))))
        self.history[:], self.before[:] = after, self.now
        return lost


def fibre_points(layer: Any, xi: Array) -> tuple[Array, Array]:
    """Weights of the fibres of a layer, and their places at points xi (n,), (m,) and (2, n m)."""
    eta, w = layer.measure.gauss(max(getattr(layer.material, "points", 2), 2))
    return w, np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])


def fibres(across: Any, layer: Any, xi: Array, tind: Array | None) -> tuple[Array, Array, Array]:
    """Distances from the axis over the height (m,), heights (ne or 1, n) and areas (ne or 1, n, m)
    at points xi (n,) of elements."""
    w, X = fibre_points(layer, xi)
    n, m = len(xi), len(w)
    h = across.heights(X[0], tind) + np.zeros((1, n * m))
    A = (np.tile(w, n) * h * across.breadth(layer, X, tind)).reshape(-1, n, m)
    return X[1, :m] - 0.5, h.reshape(-1, n, m)[..., 0], A
