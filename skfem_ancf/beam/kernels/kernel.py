"""Kernels of one beam: energy, internal force and tangent of all its elements."""

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
from .strain import (FORCE, GIVEN, GRADIENTS, MEAN, PUSH, PUSH_MEAN, PUSH_TANGENT, STRESS, TANGENT,
                     VISCOUS, evaluate)
from .tables import StrainTables, apart, linearised, repeated, scaled

#: Elements, about, whose energies are found at once.
TOGETHER = 4096


class ElementKernel:
    """What kernels of all kinds of beams share.

    Displacements u of the nodes are of shape (N,), forces of elements (ne, nb, 2), weighted
    stresses (ne, ns) for each of :attr:`tables`.

    Attributes
    ----------
    tables
        The :class:`~skfem_ancf.beam.kernels.tables.StrainTables` of the terms of the strain energy.
    constant
        The stabilisation, shape (ne, 2 nb, 2 nb) or (1, ...), or None.
    points_number
        Integration points of an element.
    """

    tables: list[StrainTables]
    constant: Array | None
    points_number: int

    def __init__(self, mesh: MeshBeam, element: ElementBeam) -> None:
        self.nd, self.t = 2 * element.nodal_dofs, mesh.t
        self.N = self.nd * mesh.p.shape[1]

    def gather(self, u: Array, elements: Any = slice(None)) -> Array:
        """Element values (ne, nb, 2) of degrees of freedom (N,)."""
        nodes, t = u.reshape(-1, self.nd), self.t[:, elements]
        return np.concatenate([nodes[t[0]], nodes[t[1]]], axis=1).reshape(t.shape[1], self.nd, 2)

    def scatter(self, force: Array) -> Array:
        """The sum (N,) of element vectors (ne, nb, 2)."""
        out = np.zeros(self.N, dtype=force.dtype)
        nodes, parts = out.reshape(-1, self.nd), force.reshape(-1, 2, self.nd)
        nodes[self.t[0]] += parts[:, 0]  # a node is the left end of one element at most
        nodes[self.t[1]] += parts[:, 1]
        return out

    def _checked(self, u):
        if u.shape != (self.N,):
            raise InputError(f"this beam has {self.N} coordinates: their displacement is of shape "
                             f"({self.N},), got {u.shape}; the state of another mesh?")
        return u if np.iscomplexobj(u) else np.ascontiguousarray(u, dtype=float)

    @property
    def shared(self) -> bool:
        """One table serves all elements."""
        return len(self.tables[0].G) == 1

    @property
    def linear(self) -> bool:
        """True if all moduli are constant."""
        return all(t.law.kind == LINEAR for t in self.tables)

    def energy(self, u: Array) -> Any:
        """Strain energy of a displacement (N,), or of many, (k, N): shape () or (k,)."""
        if u.ndim == 1:
            return np.sum(self.energies(u))
        n = max(1, TOGETHER // self.t.shape[1])
        return np.concatenate([np.sum(self._energies(u[k:k + n]), axis=1)
                               for k in range(0, len(u), n)])

    def energies(self, u: Array) -> Array:
        """Strain energy of each element, shape (ne,)."""
        return self._energies(self._checked(u)[None])[0]

    def _energies(self, u):
        """Those of displacements (k, N), as of k times the elements; shape (k, ne)."""
        out = np.zeros(u.shape[0] * self.t.shape[1], dtype=u.dtype)
        for t in self.tables:
            many = t if len(u) == 1 else repeated(t, len(u), self.N)
            out += _energies_of(many, u.ravel())
            arrays.add_held_energies(many, u.ravel(), out)
        return out.reshape(len(u), -1)

    def force(self, u: Array) -> Array:
        """Internal force of a displacement, shape (N,)."""
        return self.scatter(self.forces(u))

    def forces(self, u: Array) -> Array:
        """Internal forces of the elements."""
        return self._forces(self.tables, FORCE, u)

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """A force (N,) whose work from u0 to u1 is the change of the energy."""
        return self.scatter(self._forces(self.tables, MEAN, u0, u1))

    def forces_of(self, stresses: list[Array], u: Array) -> Array:
        """Forces of the elements of given stresses."""
        return self._forces(self.tables, GIVEN, u, given=stresses)

    def pushed_forces(self, given: list[Array], u: Array, end: Array | None = None) -> Array:
        """What strains without stress change of :meth:`forces`, or of their mean from u to end.

        Parameters
        ----------
        given
            Stresses of tables of linear laws, and strains at the points of others, (3, points, ne).
        u, end
            Displacements, shape (N,).
        """
        return self._forces(self.tables, PUSH if end is None else PUSH_MEAN, u, end, given)

    def pushed_tangents(self, given: list[Array], u: Array) -> Array:
        """What :meth:`pushed_forces` adds to the :meth:`tangents`."""
        return self._tangents(PUSH_TANGENT, u, given)

    def _forces(self, tables, what, u, v=None, given=None):
        """What :func:`~skfem_ancf.beam.kernels.strain.evaluate` does, of each element."""
        u = self.gather(self._checked(u)).ravel()
        v = u if v is None else self.gather(self._checked(v)).ravel()
        out = np.zeros_like(u)
        for k, t in enumerate(map(apart, tables)):
            evaluate(t, what, u, v, out, u[:0] if given is None else given[k].ravel(), u[:0],
                     u[:0], 0)
        return out.reshape(self.t.shape[1], -1, 2)

    def viscous_forces(self, u: Array, v: Array, time: float) -> Array:
        """Forces of the elements that resist the rate v of the displacement."""
        return self._forces(self.viscous_tables(time), VISCOUS, u, v)

    def small_forces(self, u: Array) -> Array:
        """Forces of the elements of a small displacement: linear in it.

        Of a :func:`~skfem_ancf.core.linear.step` from the reference configuration they are one,
        too.
        """
        z = self._checked(u if np.iscomplexobj(u) else step(0.0, u))
        out = 1j * self._forces(map(linearised, self.tables), FORCE, z).imag  # without round-off
        return out if np.iscomplexobj(u) else first_order(out)

    def small_energy(self, u: Array) -> float:
        """The quadratic part of the strain energy: that of small displacements."""
        u_e = self.gather(u)
        u_e[:, self.nd // 2] -= u_e[:, 0]  # seen from the first node: less round-off
        u_e[:, 0] = 0.0
        return 0.5 * float(np.sum(u_e * self.small_forces(u)))

    def tangents(self, u: Array) -> Array:
        """Element tangents (ne, 2 nb, 2 nb)."""
        return self._tangents(TANGENT, u)

    def geometric(self, u: Array, stress: Array) -> Array:
        """The part of the element tangents (ne, 2 nb, 2 nb) due to stresses, (ne, m).

        These are those of :attr:`tables` beside each other; what follows them is not used.
        """
        given = np.split(stress, np.cumsum([t.rows.shape[1] for t in self.tables]), axis=1)
        return self._tangents(PUSH_TANGENT, u, given, map(linearised, self.tables))

    def _tangents(self, what, u, given=None, tables=None):
        u, n = self.gather(self._checked(u)).ravel(), 2 * self.nd
        flat = np.zeros((self.t.shape[1], n, n + 1))
        for k, t in enumerate(map(apart, self.tables if tables is None else tables)):
            evaluate(t, what, u, u, np.zeros_like(u), u[:0] if given is None else given[k].ravel(),
                     u[:0], flat.reshape(-1), n + 1)
        i, j = np.tril_indices(n)
        out = np.empty((len(flat), n, n))
        out[:, i, j] = out[:, j, i] = flat[:, j, i - j]
        return out

    def gradients(self, u: Array) -> tuple[Array, Array, Array]:
        """The material part of the element tangents as ``B^T HB``: in B nothing cancels.

        Returns
        -------
        B, HB
            Derivatives of the strains and of the weighted stresses, (ne, m, 2 nb); what is
            stabilised is a strain too.
        stress
            Weighted stresses, (ne, m): ``B^T stress`` is the internal force.
        """
        u, ne, n = self._checked(u), self.t.shape[1], 2 * self.nd
        found, stresses, none = [], [], u[:0]
        for t in self.tables:
            both, T = np.empty((2, ne, t.rows.shape[1], n)), np.empty((ne, t.rows.shape[1]))
            evaluate(t, GRADIENTS, u, u, none, none, both.reshape(-1), none, 0)
            evaluate(t, STRESS, u, u, none, none, T.reshape(-1), none, 0)
            found.append(both)
            stresses.append(T)
        if self.constant is not None:
            R = np.broadcast_to(_square_root(self.constant), (ne, n, n))
            found.append(np.array([R, R]))
            stresses.append((R @ self.gather(u).reshape(ne, n, 1))[..., 0])
        return *np.concatenate(found, axis=2), np.concatenate(stresses, axis=1)

    def viscous_tables(self, time: float) -> list[StrainTables]:
        """The tables of a linear law with ``time`` times the moduli at no strain."""
        return [scaled(t, time) for t in self.tables]

    def inverted(self, u: Array) -> bool:
        """True if the body is turned inside out somewhere: no deformation of a real one."""
        return False


def _square_root(K):
    """R with R^T R = K, semidefinite stiffnesses (k, n, n)."""
    size = np.sqrt(np.diagonal(K, axis1=1, axis2=2))  # degrees of freedom have units
    size = np.where(size > 0.0, size, 1.0)[:, :, None]
    values, V = np.linalg.eigh(K / (size * size.transpose(0, 2, 1)))
    values = np.where(values > 1e-12 * values[:, -1:], values, 0.0)
    return (np.sqrt(values[:, None]) * V * size).transpose(0, 2, 1)


def strains(t: StrainTables, u: Array) -> Array:
    """Strains of the samples, (ns, ne)."""
    d = arrays.displaced(t, 0, len(t.start), u)
    return arrays.sampled(t, 0, d, np.zeros_like(d))[0]


def _energies_of(t, u):
    """The energies of the strains of the elements, (ne,)."""
    strain = strains(t, u)
    if t.law.kind == LINEAR:
        H = arrays.own_moduli(t, 0, len(t.start))
        return 0.5 * np.sum(strain * arrays.weighted(t, H, strain), axis=0)
    E = arrays.at_points(t, strain)
    return energy_at(t, E)


def energy_at(t: StrainTables, E: Array) -> Array:
    """The energy (ne,) of strains (3, points, ne) at the points of integration."""
    W = np.empty((1, *E.shape[1:]), E.dtype)
    law_evaluate(t.law, E, W)
    return np.sum(arrays.weights_of(t) * W[0], axis=0)


def stresses_of(t: StrainTables, strain: Array) -> Array:
    """Weighted stresses (ne, ns) of strains (ns, ne) by the law with constant moduli."""
    return arrays.weighted(t, arrays.own_moduli(t, 0, len(t.start)), strain).T.copy()
