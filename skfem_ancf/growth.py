"""Stress-free strains of laws whose stress is not linear in the strain.

The energy of such a law is W(E - E0). As a load that is ``W(E - E0) - W(E)``, whose stress at the
points of integration depends on the strain and, not in proportion, on the size of E0. It is
evaluated by NumPy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .formulations import COMPONENTS
from .kernels.law import conserve, law_evaluate
from .kernels.section import with_unit_law

if TYPE_CHECKING:
    from .beam import Beam
    from .types import Array


class Growth:
    """The stress-free strain E0 of a beam with sections, and what it does to the elements.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    eigen
        The :class:`~skfem_ancf.eigenstrain.EigenStrain`.
    """

    def __init__(self, beam: Beam, eigen: Any) -> None:
        self.beam = beam
        self._E0 = [sampled(beam, table, eigen) for table in beam.kernel.tables]

    def stresses(self, u_e: Array, factor: float) -> list[Array]:
        """S(E) - S(E - factor E0) at the points of each term, (3, points, ne) each.

        Parameters
        ----------
        u_e
            Displacement of the elements' coordinates, shape (ne, nb, 2).
        factor
            On E0.
        """
        return [_loss(3, pack, E, factor * E0) for pack, E, E0 in self._terms(u_e)]

    def forces(self, u_e: Array, factor: float) -> Array:
        """The forces on the coordinates of each element, shape (ne, nb, 2).

        Parameters
        ----------
        u_e, factor
            As for :meth:`stresses`, u_e of shape (ne, nb, 2).
        """
        return self._forces(u_e, self.stresses(u_e, factor))

    def mean_forces(self, u0: Array, u1: Array, factor: float) -> Array:
        """Forces whose work from u0 to u1 is what :meth:`potential` loses, shape (ne, nb, 2).

        The strain being quadratic, discrete gradients of the law at the points act as
        stresses in the middle, and keep momenta too.

        Parameters
        ----------
        u0, u1
            Displacements of the elements' coordinates, shape (ne, nb, 2).
        factor
            On E0.
        """
        ends = zip(self._terms(u0), self._terms(u1))
        return self._forces(0.5 * (u0 + u1), [
            _mean_stress(pack, 0.5 * (A + B), B - A)
            - _mean_stress(pack, 0.5 * (A + B) - factor * E0, B - A)
            for (pack, A, E0), (_, B, _) in ends])

    def tangents(self, u_e: Array, factor: float) -> Array:
        """The derivatives of :meth:`forces`, shape (ne, 2 nb, 2 nb).

        Parameters
        ----------
        u_e, factor
            As for :meth:`stresses`, u_e of shape (ne, nb, 2).
        """
        out = self._geometric(u_e, self.stresses(u_e, factor))
        for pack, E, E0 in self._terms(u_e):
            D = _loss(9, pack, E, factor * E0) * pack.weights
            B = self._slopes(pack, u_e)
            out += np.einsum("icpe,cdpe,jdpe->eij", B, D.reshape(3, *E.shape), B, optimize=True)
        return out

    def potential(self, u_e: Array, factor: float) -> float:
        """The integral of W(E - factor E0) - W(E).

        Parameters
        ----------
        u_e, factor
            As for :meth:`stresses`, u_e of shape (ne, nb, 2).
        """
        return -sum(float(np.sum(pack.weights * _loss(1, pack, E, factor * E0)))
                    for pack, E, E0 in self._terms(u_e))

    # terms

    def _terms(self, u_e):
        """Packs of all elements, each with coordinates of its own, strains and E0 at points."""
        for pack, E0 in zip(self.beam.kernel.apart(), self._E0):
            E = np.empty(E0.shape)
            self.beam.kernel.texts.stress(with_unit_law(pack), np.ascontiguousarray(u_e).ravel(), E)
            yield pack, E, E0

    def _forces(self, u_e, stresses):
        """The forces of given stresses at the points."""
        q = self.beam.kernel.gather(self.beam.q0_local) + u_e
        S = self._geometric(u_e, stresses)
        return np.einsum("eij,ej->ei", S, q.reshape(len(q), -1)).reshape(q.shape)

    def _slopes(self, pack, u_e):
        """The derivative of the strain by each coordinate, (2 nb, 3, points, ne)."""
        u, out = np.ascontiguousarray(u_e).ravel(), []
        for k in range(u_e[0].size):
            unit = np.zeros((len(u_e), u_e[0].size))
            unit[:, k] = 1.0
            out.append(np.empty((3, len(pack.weights), len(u_e))))
            self.beam.kernel.strain_increment(pack, u, unit.ravel(), out[-1])
        return np.array(out)

    def _geometric(self, u_e, stresses):
        """Matrices (ne, 2 nb, 2 nb) whose product with places is the force of given stresses."""
        ne, kernel = len(u_e), self.beam.kernel
        weighted = np.concatenate([(S * np.broadcast_to(pack.weights, S.shape[1:]))
                                   .transpose(2, 0, 1).reshape(ne, -1)
                                   for pack, S in zip(kernel.packs, stresses)], axis=1)
        return np.concatenate([kernel.geometric(u_e[part], part, weighted[part])
                               for part in (slice(k.start, min(k.stop, ne))
                                            for k in kernel.chunks())])


def _loss(rows, pack, E, E0):
    """Energy (1 row), stress (3) or moduli (9) of E, less those of E - E0."""
    out = np.empty((2, rows, *E.shape[1:]))
    for strain, values in zip((E, E - E0), out):
        law_evaluate(pack.law, np.ascontiguousarray(strain), values)
    return out[0] - out[1]


def _mean_stress(pack, middle, change):
    """The stress (3, points, ne) whose product with a change of the strain is that of W."""
    S = np.empty(middle.shape)
    law_evaluate(pack.law, np.ascontiguousarray(middle), S)
    conserve(pack.law, middle, change, S)
    return S


def sampled(beam: Beam, table: Any, eigen: Any) -> Array:
    """A stress-free strain at the points of a term, sampled as the formulation does the strain.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    table
        The tables of the term.
    eigen
        The :class:`~skfem_ancf.eigenstrain.EigenStrain`.

    Returns
    -------
    ndarray
        Shape (3, points, nelements).
    """
    term, out = table.term, []
    for row, name in enumerate(COMPONENTS):
        xi, eta = term.nodes(name), term.section_nodes
        X = np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
        values = eigen.of_slab(table.slab, *beam.across.coordinates(X))[row]
        matrix = term.matrix(name)
        out.append(values if matrix is None else values @ matrix.T)
    return np.ascontiguousarray(np.array(out).transpose(0, 2, 1))
