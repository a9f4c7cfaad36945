"""Eigenstrains of nonlinear laws.

The strain energy is W(E - E0), so the load is ``W(E - E0) - W(E)``. Its stress at the integration
points depends on the strain, and nonlinearly on E0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legvander

from ..beam.beam import Beam
from ..beam.kernels.kernel import energy_at, strains, stresses_of
from ..beam.kernels.law import LINEAR
from ..core.types import Array
from ..formulations import COMPONENTS


#: Half the number of points across a layer, and round-off relative to the largest strain.
SECTION, ROUND_OFF = 6, 1e-12


def energy_difference(beam: Beam, u: Array, eigen: Sequence[Array], factor: float) -> float:
    """The integral of W(E) - W(E - factor E0)."""
    total = 0.0
    for e, E0 in zip(beam.kernel.elements, eigen):
        E = strains(e, u)
        if e.t.law.kind == LINEAR:
            total += factor * float(np.sum(stresses_of(e, E0).T * (E - 0.5 * factor * E0)))
        else:
            total += float(np.sum(energy_at(e, e.at_points(E))
                                  - energy_at(e, e.at_points(E - factor * E0))))
    return total


def kernel_argument(e: Any, E0: Array, stresses: Array) -> Array:
    """The kernel's argument for an eigenstrain: strains at the points, or linear stresses."""
    return stresses if e.t.law.kind == LINEAR else e.at_points(E0)


def sampled(beam: Beam, integral: Any, eigen: Any) -> Array:
    """An eigenstrain where a term samples the strain, (ns, nelements)."""
    term, layer, out = integral.term, integral.layer, []
    for row, name in enumerate(COMPONENTS):
        xi, eta = term.nodes(name), term.section_nodes
        X = np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
        values = eigen.of_layer(layer, *beam.across.coordinates(X))[row]
        out.append(values - unmatched(beam, eigen, layer, X) if name == "yy" else values)
    return np.concatenate(out, axis=1).T


def unmatched(beam: Beam, eigen: Any, layer: Any, X: Array, tind: Array | None = None) -> Array:
    """The part of eps_yy that a section develops freely and its element cannot represent.

    A section that bends freely under E0 has a linear eps_xx and S_yy = 0, thus eps_yy = E0_yy - nu
    (eps_xx - E0_xx). It jumps between layers and may have any degree, while eps_yy of an element is
    one polynomial. Without this part E0 causes no spurious S_yy.
    """
    across, degree = beam.across, beam.element.order - 1
    x, y = across.coordinates(X, tind)
    if degree < 1:  # its Poisson coupling is to the mean over the section
        return np.zeros(x.shape)
    fit: Any = np.zeros((*x.shape, degree + 1, degree + 1))
    right, N, M, parts = np.zeros(fit.shape[:-1]), np.zeros(x.shape), np.zeros(x.shape), []
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
        N += np.sum(size * E0[0], axis=-1)
        M += np.sum(size * E0[0] * parts[-1][1], axis=-1)
    EA, ES, EI = across.moments(X[0], tind)
    det = EA * EI - ES * ES
    mean, slope = (EI * N - ES * M) / det, (EA * M - ES * N) / det

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
