"""Forces and energies to first and second order about a displacement, for linear theory."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from ..core.types import Array
from .system import System


def linear_force(system: System, base: Array, d: Array, load: float = 1.0) -> Array:
    """f(base) + K(base) d, the linearised internal force in statics, shape (N,)."""
    return system.internal_force(base, None, load) + _stiffness_times(system, base, d, load)


def linear_energy(system: System, base: Array, d: Array, load: float = 1.0) -> float:
    """Strain energy and potential of force elements to second order in d (N,)."""
    if base.any() or system.forces.elements:
        second = 0.5 * d @ _stiffness_times(system, base, d, load)
    else:
        second = sum(b.kernel.small_energy(d[s]) for b, s in zip(system.beams, system.slices))
    return float(system.strain_energy(base, load) + second
                 + system.internal_force(base, None, load) @ d)


def linear_external_force(system: System, base: Array, d: Array) -> Array:
    """The linearised force of all loads at full load, shape (N,).

    About the reference configuration the stiffness of the package's follower loads is neglected, as
    in linear theory; that of user-defined loads counts.
    """
    out, at_rest = np.array(system.external_force(base)), not base.any()
    for one in system.loads:
        s, stiff = system.of(one), not one.constant and not (at_rest and not one.first_order)
        if at_rest and one.eigen_stresses:  # eigenstrain of nonlinear laws
            load, (factor, acting) = cast("Any", one), one.acting(None)
            out[s] += load.beam.kernel.scatter(load.small_forces(load.at_rest)) - (
                factor * acting.force(base[s]))
        if stiff:
            factor, acting = one.acting(None)
            i, j, v = acting.stiffness(base[s])
            np.add.at(out[s], i, factor * np.asarray(v) * d[s][j])
    return out


def _stiffness_times(system, base, d, load):
    """The tangent of the internal force times d, by strains where possible."""
    out, at_rest = np.zeros(system.N), not base.any()
    if not d.any():
        return out
    for beam, s in zip(system.beams, system.slices):
        k = beam.kernel
        if at_rest:
            out[s] = k.scatter(k.small_forces(d[s]))
            continue
        K, u = k.tangents(base[s]), k.gather(d[s])
        out[s] = k.scatter(np.einsum("eij,ej->ei", K, u.reshape(len(K), -1)).reshape(u.shape))
    if system.forces.elements:
        i, j, v = system.forces.entries(system.backend.tables.plain.forces, load, base, 0.0 * base,
                                        0.0)
        np.add.at(out, i, v * d[j])
    return out
