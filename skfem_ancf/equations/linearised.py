"""Forces and energies to first and second order about a displacement: what linear theory solves."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from ..core.types import Array
from .system import System


def linear_force(system: System, base: Array, d: Array, load: float = 1.0) -> Array:
    """The internal force in statics, linearised about a displacement; shape (N,).

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    base, d
        The displacement, and what is added to it, shape (N,).
    load
        The load factor.
    """
    return system.internal_force(base, None, load) + _stiffness_times(system, base, d, load)


def linear_energy(system: System, base: Array, d: Array, load: float = 1.0) -> float:
    """The strain energy, and the potential of force elements, to second order.

    Parameters
    ----------
    system, base, d, load
        As for :func:`linear_force`, shape (N,).
    """
    if base.any() or system.forces.elements:
        second = 0.5 * d @ _stiffness_times(system, base, d, load)
    else:
        second = sum(b.kernel.small_energy(d[s]) for b, s in zip(system.beams, system.slices))
    return float(system.strain_energy(base, load) + second
                 + system.internal_force(base, None, load) @ d)


def linear_external_force(system: System, base: Array, d: Array) -> Array:
    """The force of all loads in statics at full size, linearised as it is solved with.

    That loads of the package follow the body is of second order in small displacements from the
    reference configuration. A user-defined load may depend on these otherwise, as a spring does.

    Parameters
    ----------
    system, base, d
        As for :func:`linear_force`, shape (N,).
    """
    out, at_rest = np.array(system.external_force(base)), not base.any()
    for one in system.loads:
        s, stiff = system.of(one), not one.constant and not (at_rest and not one.first_order)
        if at_rest and one.pushes:  # of laws that are not linear
            pushed, (factor, acting) = cast("Any", one), one.acting(None)
            out[s] += pushed.beam.kernel.scatter(pushed.small_forces(pushed.at_rest)) - (
                factor * acting.force(base[s]))
        if stiff:
            factor, acting = one.acting(None)
            i, j, v = acting.stiffness(base[s])
            np.add.at(out[s], i, factor * np.asarray(v) * d[s][j])
    return out


def _stiffness_times(system, base, d, load):
    """The tangent of the internal force times a vector; sums of strains, where it can be."""
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
