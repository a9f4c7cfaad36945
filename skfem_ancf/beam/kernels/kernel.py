"""Kernels of one beam."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from ...core import Array, cached_property, refuse
from ...elements.base import ElementBeam
from ...mesh.mesh_beam import MeshBeam
from .elements import Elements
from .histories import ElementsWithHistory, Past, elements_of, remembering
from .law import LINEAR, law_evaluate
from .runs import run_eigen_force, run_eigen_tangent, run_force, run_tangent
from .tables import StrainTables, apart, repeated

#: Approximate number of elements whose energies are evaluated together.
TOGETHER = 4096


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
    def shared(self) -> bool:
        """True if all elements have the same table."""
        return len(self.tables[0].G) == 1

    @property
    def linear(self) -> bool:
        """True if all moduli are constant."""
        return all(t.law.kind == LINEAR for t in self.tables)

    def remembering(self, past: Past) -> ElementKernel:
        """The kernel with a history of its laws, of which it has views."""
        other = copy(self)
        vars(other).update(elements=remembering(self.elements, past),
                           _apart=remembering(self._apart, past))
        return other

    def energy(self, u: Array) -> Any:
        """Strain energy of a displacement (N,), or of several, (k, N): shape () or (k,)."""
        if u.ndim == 1:
            return np.sum(self.energies(u))
        n = max(1, TOGETHER // self.t.shape[1])
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
            out += energies_of(e, u.ravel())
        return out.reshape(k, -1)

    @cached_property
    def elements(self) -> list[Elements]:
        """The :class:`~skfem_ancf.beam.kernels.elements.Elements` of :attr:`tables`."""
        return list(map(elements_of, self.tables))

    @cached_property
    def _apart(self):
        """The same with separate DOFs for each element."""
        return [elements_of(apart(t)) for t in self.tables]

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
        return self._tangents(run_eigen_tangent, u, self._apart, given)

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
        return self._tangents(_run_tangent, u, self._apart)

    def geometric(self, u: Array, stress: Array) -> Array:
        """Geometric element stiffness (ne, 2 nb, 2 nb) for stresses (ne, m)."""
        # The stresses of all :attr:`tables` are side by side; further columns are ignored.
        given = np.split(stress, np.cumsum([t.rows.shape[1] for t in self.tables]), axis=1)
        return self._tangents(_run_geometric, u, self._apart, given)

    def _tangents(self, run, u, elements, given=None):
        u, n = self.gather(self._checked(u)).ravel(), 2 * self.nd
        flat = np.zeros((self.t.shape[1], n, n + 1))
        for k, e in enumerate(elements):
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
            R = np.broadcast_to(_square_root(self.constant), (ne, n, n))
            found.append(np.array([R, R]))
            stresses.append((R @ self.gather(u).reshape(ne, n, 1))[..., 0])
        return *np.concatenate(found, axis=2), np.concatenate(stresses, axis=1)

    def inverted(self, u: Array) -> bool:
        """True if the body is turned inside out somewhere."""
        return False


def _run_tangent(e, u, given, flat, ld):
    run_tangent(e, u, given, given, u[:0], flat, ld)


def _run_geometric(e, u, given, flat, ld):
    _, _, one, Y = e.at(u)
    e.add_to_band(e.tangent(one, Y, given.reshape(e.ne, e.ns).T, None), flat, ld)


def _square_root(K):
    """R with R^T R = K, for semidefinite matrices (k, n, n)."""
    size = np.sqrt(np.diagonal(K, axis1=1, axis2=2))  # units of the DOFs differ
    size = np.where(size > 0.0, size, 1.0)[:, :, None]
    values, V = np.linalg.eigh(K / (size * size.transpose(0, 2, 1)))
    values = np.where(values > 1e-12 * values[:, -1:], values, 0.0)
    return (np.sqrt(values[:, None]) * V * size).transpose(0, 2, 1)


def strains(e: Elements, u: Array) -> Array:
    """Strains of the samples, (ns, ne), linearised for a complex u."""
    _, d, one, Y = e.at(u.real)
    strain = e.strain(d, one)
    if not np.iscomplexobj(u):
        return strain
    return strain + 1j * e.change(Y, e.rows(e.relative(u.imag)))


def energies_of(e: Elements, u: Array) -> Array:
    """Energies of the elements, (ne,)."""
    strain = strains(e, u)
    if e.t.law.kind == LINEAR:
        out = 0.5 * np.sum(strain * e.linear_stress(strain), axis=0)
    else:
        out = energy_at(e, e.at_points(strain))
    if e.C is not None:
        U = e.relative(u).reshape(2 * e.m, -1)
        out += 0.5 * np.einsum("ie,kij,je->e" if len(e.C) == 1 else "ie,eij,je->e", U, e.C, U)
    return out


def energy_at(e: Elements, E: Array) -> Array:
    """Energy (ne,) of strains (3, points, ne) at the integration points."""
    if isinstance(e, ElementsWithHistory):
        return np.sum(e.weights * e.energy(E), axis=0)
    W = np.empty((1, *E.shape[1:]), E.dtype)
    law_evaluate(e.t.law, E, W)
    return np.sum(e.weights * W[0], axis=0)


def stresses_of(e: Elements, strain: Array) -> Array:
    """Weighted stresses (ne, ns) of strains (ns, ne) with constant moduli."""
    return e.linear_stress(strain).T.copy()
