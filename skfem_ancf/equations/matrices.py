"""Sparse matrices of a scene in a state, and its linearised equations."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np
from scipy import sparse

from ..beam.kinematics import element_dofs, entries_of
from ..beam.strain_energy import body_tangent
from ..core import Array, InputError
from ..core.band import BandMatrix
from .strain_tangent import load_stiffness
from .system import System


# forces and energies to first and second order about a displacement, for linear theory


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
    """The linearised force of all loads at full load, shape (N,)."""
    # About the reference configuration the stiffness of the package's follower loads is neglected,
    # as in linear theory; that of user-defined loads counts.
    out, at_rest = np.array(system.external_force(base)), not base.any()
    for one in system.loads:
        s, stiff = system.of(one), not one.constant and not (at_rest and not one.first_order)
        if at_rest and one.eigen_stresses:  # eigenstrain of nonlinear laws
            load, (factor, acting) = cast("Any", one), one.factor_and_load(None)
            out[s] += load.beam.kernel.scatter(load.small_forces(load.at_rest)) - (
                factor * acting.force(base[s]))
        if stiff:
            factor, acting = one.factor_and_load(None)
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
        out += system.element_stiffness(base, load) @ d
    return out


class SceneMatrices(NamedTuple):
    """The linearised equations of a scene in a state.

    ``M u'' + D u' + K u + J^T l = force``, ``J u = 0`` for changes of displacement u and
    multipliers l from the state, at the free degrees of freedom ``scene.free`` of all N. At an
    equilibrium the force is that of joints and supports.

    Attributes
    ----------
    M
        Mass matrix, (N, N), in CSR format; None if a material has no density.
    D
        Damping matrix, (N, N): minus the derivative of the force by the velocity.
    K
        Tangent stiffness, (N, N): minus the derivative of the force by the displacement, with the
        stress, loads and multipliers of the state. Points stick that touch an obstacle with
        friction, also those that slip.
    force
        Loads minus internal and damping force, shape (N,).
    J
        Jacobian of the joint equations, (m, N).
    """

    M: Any
    D: Any
    K: Any
    force: Array
    J: Any


def matrices_of(system: Any, state: Any) -> SceneMatrices:
    """The SceneMatrices of a System in one of its States, with its history of contact."""
    system = system.after(state.memory).sticking()
    u, v, t, tables = np.array(state.u), state.v, state.t, system.backend.tables
    time = state.load if t is None else t
    K = load_stiffness(system, u, state.load, t) + system.constraints.curvature(
        u, time, state.multipliers)
    D = sparse.csr_array((system.N, system.N))
    for beam, s in zip(system.beams, system.slices):
        i, j = entries_of(s.start + element_dofs(beam))
        K = K + _square(system, i, j, system.histories.kernel(beam).tangents(u[s]))
    if system.viscous:
        band, none = BandMatrix.zeros(system.N, system.bandwidth), tables.stresses
        body_tangent(tables.plain.viscous, u, 0.0 * u, none, True, tables.stresses, band)
        D = D + band.tocsc()
    if system.forces.elements:
        forces = tables.plain.forces
        i, j, k = system.forces.entries(forces, time, u, v, 0.0)
        K = K + _square(system, i, j, k)
        D = D + _square(system, i, j, system.forces.entries(forces, time, u, v, 1.0)[2] - k)
    try:
        M = sparse.csr_array(system.mass.tocsc())
    except InputError:  # no density
        M = None
    if system.damping:
        modes = sparse.csr_array(system.modal_damping.rows)
        D = D + system.damping.mass * M + modes.T @ modes
    force = state.load * system.external_force(u, t) - system.internal_force(u, t, state.load)
    if system.damped:
        force = force - system.damping_force(u, v, t)
    return SceneMatrices(M, sparse.csr_array(D), sparse.csr_array(K), force,
                         system.constraints.sparse_jacobian(u, time))


def _square(system, i, j, values):
    return sparse.csr_array((np.ravel(values), (i, j)), shape=(system.N, system.N))
