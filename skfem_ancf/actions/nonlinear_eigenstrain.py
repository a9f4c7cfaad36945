"""Stress-free strains of laws whose stress is not linear in the strain.

The energy of such a law is W(E - E0). As a load that is ``W(E - E0) - W(E)``, whose stress at the
points of integration depends on the strain and, not in proportion, on the size of E0; see
:meth:`~skfem_ancf.beam.kernels.section.Kernel.pushed_packs`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.legendre import legvander

from ..formulations import COMPONENTS
from ..beam.kernels.law import law_evaluate
from ..beam.kernels.section import with_unit_law

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..beam.beam import Beam
    from ..core.types import Array


#: Half of the points across a layer, and what is no part of a strain relative to the largest.
SECTION, ROUND_OFF = 6, 1e-12


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
        values = eigen.of_layer(table.layer, *beam.across.coordinates(X))[row]
        if name == "yy":
            values = values - unmatched(beam, eigen, table.layer, X)
        matrix = term.matrix(name)
        out.append(values if matrix is None else values @ matrix.T)
    return np.ascontiguousarray(np.array(out).transpose(0, 2, 1))


def unmatched(beam: Beam, eigen: Any, layer: Any, X: Array, tind: Array | None = None) -> Array:
    """The part of eps_yy that a section takes freely and that its element cannot have.

    A section that bends freely under E0 has a plane eps_xx, and S_yy = 0: eps_yy is E0_yy - nu
    (eps_xx - E0_xx). It jumps between layers, and may be of any degree across, where eps_yy of an
    element is one polynomial. Less this part, E0 has no S_yy that resists the element.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    eigen
        The :class:`~skfem_ancf.actions.eigenstrain.EigenStrain`.
    layer, X, tind
        The layer of all points, the points, shape (2, npoints) or (2, nelements, npoints), and
        elements (nelements,), or None for all.

    Returns
    -------
    ndarray
        Shape (nelements, npoints).
    """
    across, degree = beam.across, beam.element.order - 1
    x, y = across.coordinates(X, tind)
    if degree < 1:  # its lateral strain is coupled to the mean over the section
        return np.zeros(x.shape)
    fit: Any = np.zeros((*x.shape, degree + 1, degree + 1))
    right, pushed, parts = np.zeros(fit.shape[:-1]), np.zeros((2, *x.shape)), []
    for one, (eta, w) in across.rules(2 * SECTION):
        Z = np.stack([np.repeat(X[0], len(eta), -1),
                      np.broadcast_to(eta, (*X[0].shape, len(eta))).reshape(*X.shape[1:-1], -1)])
        shape = (*x.shape, len(eta))
        size = (np.tile(w, x.shape[1]) * beam.mesh.mapping().height(Z[0], tind)[0]
                * one.material.axial_modulus * across.breadth(one, Z, tind, times="grade"))
        size = np.broadcast_to(size, (len(x), Z.shape[-1])).reshape(shape)
        s, t = across.coordinates(Z, tind)
        E0 = eigen.of_layer(one, s, t).reshape(3, *shape)
        parts.append((size, t.reshape(shape), legvander(2.0 * eta - 1.0, degree), E0,
                      one.material.lateral_ratio))
        pushed += np.sum(size * E0[0], axis=-1), np.sum(size * E0[0] * parts[-1][1], axis=-1)
    EA, ES, EI = across.moments(X[0], tind)
    det = EA * EI - ES * ES
    mean, slope = (EI * pushed[0] - ES * pushed[1]) / det, (EA * pushed[1] - ES * pushed[0]) / det

    def free(y, mean, slope, E0, ratio):
        return E0[1] - ratio * (mean + slope * y - E0[0])

    largest = 0.0
    for size, t, P, E0, ratio in parts:
        yy = free(t, mean[..., None], slope[..., None], E0, ratio)
        largest = max(largest, float(np.max(np.abs(yy))))
        fit += np.einsum("enk,ki,kj->enij", size, P, P)
        right += np.einsum("enk,ki->eni", size * yy, P)
    c = np.linalg.solve(fit, right[..., None])[..., 0]
    out = free(y, mean, slope, eigen.of_layer(layer, x, y), layer.material.lateral_ratio) - np.sum(
        c * legvander(2.0 * np.broadcast_to(X[1], x.shape) - 1.0, degree), axis=-1)
    return np.where(np.abs(out) > ROUND_OFF * largest, out, 0.0)
