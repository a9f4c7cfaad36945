"""Kernels of one beam."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.linear import first_order, step
from ...core.types import Array
from ...elements.base import ElementBeam
from ...mesh.mesh_beam import MeshBeam
from . import arrays
from .law import LINEAR, law_evaluate
from .runs import (run_eigen_force, run_eigen_mean, run_eigen_tangent, run_force, run_given,
                   run_gradients, run_mean, run_stress, run_tangent, run_viscous)
from .tables import StrainTables, apart, linearised, repeated, scaled

#: Approximate number of elements whose energies are evaluated together.
TOGETHER = 4096


class ElementKernel:
    """Base class of the kernels of one beam.

    Displacements u are (N,), element forces (ne, nb, 2), weighted stresses (ne, ns) for each of
    :attr:`tables`, the :class:`~skfem_ancf.beam.kernels.tables.StrainTables` of the terms of the
    strain energy. ``constant`` is the stabilisation, (ne, 2 nb, 2 nb) or (1, ...), or None;
    ``points_number`` the number of integration points of an element.
    """

    tables: list[StrainTables]
    constant: Array | None
    points_number: int

    def __init__(self, mesh: MeshBeam, element: ElementBeam) -> None:
        self.nd, self.t = 2 * element.nodal_dofs, mesh.t
        self.N = self.nd * mesh.p.shape[1]

    def gather(self, u: Array, elements: Any = slice(None)) -> Array:
        """Element values (ne, nb, 2) of DOFs (N,)."""
        nodes, t = u.reshape(-1, self.nd), self.t[:, elements]
        return np.concatenate([nodes[t[0]], nodes[t[1]]], axis=1).reshape(t.shape[1], self.nd, 2)

    def scatter(self, force: Array) -> Array:
        """Sum (N,) of element vectors (ne, nb, 2)."""
        out = np.zeros(self.N, dtype=force.dtype)
        nodes, parts = out.reshape(-1, self.nd), force.reshape(-1, 2, self.nd)
        nodes[self.t[0]] += parts[:, 0]  # left nodes are unique
        nodes[self.t[1]] += parts[:, 1]
        return out

    def _checked(self, u):
        if u.shape != (self.N,):
            raise InputError(f"the displacement of this beam must have the shape ({self.N},), got "
                             f"{u.shape}: is it the state of another mesh?")
        return u if np.iscomplexobj(u) else np.ascontiguousarray(u, dtype=float)

    @property
    def shared(self) -> bool:
        """True if all elements have the same table."""
        return len(self.tables[0].G) == 1

    @property
    def linear(self) -> bool:
        """True if all moduli are constant."""
        return all(t.law.kind == LINEAR for t in self.tables)

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
        out = np.zeros(u.shape[0] * self.t.shape[1], dtype=u.dtype)
        for t in self.tables:
            many = t if len(u) == 1 else repeated(t, len(u), self.N)
            out += _energies_of(many, u.ravel())
            arrays.add_constant_energies(many, u.ravel(), out)
        return out.reshape(len(u), -1)

    def force(self, u: Array) -> Array:
        """Internal force of a displacement, shape (N,)."""
        return self.scatter(self.forces(u))

    def forces(self, u: Array) -> Array:
        """Internal forces of the elements."""
        return self._forces(self.tables, run_force, u)

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """The force (N,) whose work from u0 to u1 is the change of the energy."""
        return self.scatter(self._forces(self.tables, run_mean, u0, u1))

    def forces_of(self, stresses: list[Array], u: Array) -> Array:
        """Element forces of given stresses."""
        return self._forces(self.tables, run_given, u, given=stresses)

    def eigenstrain_forces(self, given: list[Array], u: Array, end: Array | None = None) -> Array:
        """Change of :meth:`forces`, or of their mean from u to ``end``, by eigenstrains.

        ``given`` are stresses for tables of linear laws, and strains at the points of others,
        (3, points, ne).
        """
        run = run_eigen_force if end is None else run_eigen_mean
        return self._forces(self.tables, run, u, end, given)

    def eigenstrain_tangents(self, given: list[Array], u: Array) -> Array:
        """Change of the :meth:`tangents` by eigenstrains, see :meth:`eigenstrain_forces`."""
        return self._tangents(run_eigen_tangent, u, self.tables, given)

    def _forces(self, tables, run, u, v=None, given=None):
        """Element forces by a kernel of :mod:`.runs`."""
        u = [self.gather(self._checked(x)).ravel() for x in (u, v) if x is not None]
        out = np.zeros_like(u[0])
        for k, t in enumerate(map(apart, tables)):
            run(t, *u, *([] if given is None else [given[k].ravel()]), out)
        return out.reshape(self.t.shape[1], -1, 2)

    def viscous_forces(self, u: Array, v: Array, time: float) -> Array:
        """Viscous element forces for the rate v of the displacement."""
        return self._forces(self.viscous_tables(time), run_viscous, u, v)

    def small_forces(self, u: Array) -> Array:
        """Linearised element forces; complex for a :func:`~skfem_ancf.core.linear.step`."""
        z = self._checked(u if np.iscomplexobj(u) else step(0.0, u))
        out = 1j * self._forces(map(linearised, self.tables), run_force, z).imag  # without round-off
        return out if np.iscomplexobj(u) else first_order(out)

    def small_energy(self, u: Array) -> float:
        """The quadratic part of the strain energy."""
        u_e = self.gather(u)
        u_e[:, self.nd // 2] -= u_e[:, 0]  # relative to the first node: less round-off
        u_e[:, 0] = 0.0
        return 0.5 * float(np.sum(u_e * self.small_forces(u)))

    def tangents(self, u: Array) -> Array:
        """Element tangents (ne, 2 nb, 2 nb)."""
        return self._tangents(_run_tangent, u, self.tables)

    def geometric(self, u: Array, stress: Array) -> Array:
        """Geometric element stiffness (ne, 2 nb, 2 nb) for stresses (ne, m).

        The stresses of all :attr:`tables` are side by side; further columns are ignored.
        """
        given = np.split(stress, np.cumsum([t.rows.shape[1] for t in self.tables]), axis=1)
        return self._tangents(run_eigen_tangent, u, map(linearised, self.tables), given)

    def _tangents(self, run, u, tables, given=None):
        u, n = self.gather(self._checked(u)).ravel(), 2 * self.nd
        flat = np.zeros((self.t.shape[1], n, n + 1))
        for k, t in enumerate(map(apart, tables)):
            run(t, u, u[:0] if given is None else given[k].ravel(), flat.reshape(-1), n + 1)
        i, j = np.tril_indices(n)
        out = np.empty((len(flat), n, n))
        out[:, i, j] = out[:, j, i] = flat[:, j, i - j]
        return out

    def gradients(self, u: Array) -> tuple[Array, Array, Array]:
        """Factors of the material element tangents ``B^T HB``, without cancellation in B.

        Returns
        -------
        B, HB
            Derivatives of strains and weighted stresses, (ne, m, 2 nb), including the
            stabilisation.
        stress
            Weighted stresses, (ne, m): ``B^T stress`` is the internal force.
        """
        u, ne, n = self._checked(u), self.t.shape[1], 2 * self.nd
        found, stresses = [], []
        for t in self.tables:
            both, T = np.empty((2, ne, t.rows.shape[1], n)), np.empty((ne, t.rows.shape[1]))
            run_gradients(t, u, both.reshape(-1))
            run_stress(t, u, T.reshape(-1))
            found.append(both)
            stresses.append(T)
        if self.constant is not None:
            R = np.broadcast_to(_square_root(self.constant), (ne, n, n))
            found.append(np.array([R, R]))
            stresses.append((R @ self.gather(u).reshape(ne, n, 1))[..., 0])
        return *np.concatenate(found, axis=2), np.concatenate(stresses, axis=1)

    def viscous_tables(self, time: float) -> list[StrainTables]:
        """Tables of a linear law with ``time`` times the moduli at zero strain."""
        return [scaled(t, time) for t in self.tables]

    def inverted(self, u: Array) -> bool:
        """True if the body is turned inside out somewhere."""
        return False


def _run_tangent(t, u, given, flat, ld):
    run_tangent(t, u, given, given, np.zeros_like(u), flat, ld)


def _square_root(K):
    """R with R^T R = K, for semidefinite matrices (k, n, n)."""
    size = np.sqrt(np.diagonal(K, axis1=1, axis2=2))  # units of the DOFs differ
    size = np.where(size > 0.0, size, 1.0)[:, :, None]
    values, V = np.linalg.eigh(K / (size * size.transpose(0, 2, 1)))
    values = np.where(values > 1e-12 * values[:, -1:], values, 0.0)
    return (np.sqrt(values[:, None]) * V * size).transpose(0, 2, 1)


def strains(t: StrainTables, u: Array) -> Array:
    """Strains of the samples, (ns, ne)."""
    d = arrays.displaced(t, 0, len(t.start), u)
    return arrays.sampled(t, 0, d, np.zeros_like(d))[0]


def _energies_of(t, u):
    """Energies of the elements, (ne,)."""
    strain = strains(t, u)
    if t.law.kind == LINEAR:
        H = arrays.linear_moduli(t, 0, len(t.start))
        return 0.5 * np.sum(strain * arrays.weighted(t, H, strain), axis=0)
    E = arrays.at_points(t, strain)
    return energy_at(t, E)


def energy_at(t: StrainTables, E: Array) -> Array:
    """Energy (ne,) of strains (3, points, ne) at the integration points."""
    W = np.empty((1, *E.shape[1:]), E.dtype)
    law_evaluate(t.law, E, W)
    return np.sum(arrays.weights_of(t) * W[0], axis=0)


def stresses_of(t: StrainTables, strain: Array) -> Array:
    """Weighted stresses (ne, ns) of strains (ns, ne) with constant moduli."""
    return arrays.weighted(t, arrays.linear_moduli(t, 0, len(t.start)), strain).T.copy()
