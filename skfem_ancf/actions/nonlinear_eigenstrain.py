"""Stress-free strains of laws whose stress is not linear in the strain.

The energy of such a law is W(E - E0). As a load that is ``W(E - E0) - W(E)``, whose stress at the
points of integration depends on the strain and, not in proportion, on the size of E0; see
:meth:`~skfem_ancf.beam.kernels.section.Kernel.pushed_packs`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..formulations import COMPONENTS
from ..beam.kernels.law import law_evaluate
from ..beam.kernels.section import with_unit_law

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..beam.beam import Beam
    from ..core.types import Array


def energy_lost(beam: Beam, u: Array, strains: Sequence[Array], factor: float) -> float:
    """The integral of W(E) - W(E - factor E0).

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    u
        Displacement of its coordinates, shape (N,).
    strains
        E0 at the points of each term as :func:`sampled` returns it, (3, points, nelements).
    factor
        On E0.
    """
    total = 0.0
    for pack, E0 in zip(beam.kernel.packs, strains):
        E, W = np.empty(E0.shape), np.empty((2, 1, *E0.shape[1:]))
        beam.kernel.texts.stress(with_unit_law(pack), u, E)
        law_evaluate(pack.law, E, W[0])
        law_evaluate(pack.law, E - factor * E0, W[1])
        total += float(np.sum(pack.weights * (W[0] - W[1])))
    return total


def sampled(beam: Beam, table: Any, eigen: Any) -> Array:
    """A stress-free strain at the points of a term, sampled as the formulation does the strain.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    table
        The tables of the term.
    eigen
        The :class:`~skfem_ancf.actions.eigenstrain.EigenStrain`.

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
