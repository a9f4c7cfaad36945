"""The matrices of a scene in a state, sparse, for custom solvers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from ..beam.kinematics import element_dofs, entries_of
from ..beam.strain_energy import body_tangent
from ..core.errors import InputError
from ..core.linalg import BandMatrix
from ..core.types import Array
from .strain_tangent import load_stiffness


class SceneMatrices(NamedTuple):
    """The equations of a scene, linearised in a state.

    ``M u'' + D u' + K u + J^T l = force`` holds for changes of displacement u and multipliers l
    from the state, with ``J u = 0``, of the free degrees of freedom ``scene.free``; N is the number
    of all. At an equilibrium the force is ``J^T`` times the multipliers there, and the reaction of
    the supports.

    Attributes
    ----------
    M
        The mass matrix, (N, N), in CSR format; None where a material has no density.
    D
        The derivative of the force by the velocity, with the opposite sign, (N, N).
    K
        The tangent stiffness, (N, N): the derivative of the force by the displacement, with the
        opposite sign, stress, loads and multipliers of the state included.
    force
        Loads less internal and damping force, shape (N,).
    J
        The derivative of the constraints of joints by the displacement, (m, N).
    """

    M: Any
    D: Any
    K: Any
    force: Array
    J: Any


def matrices_of(system: Any, state: Any) -> SceneMatrices:
    """The SceneMatrices of a :class:`~skfem_ancf.equations.system.System` in a State of it."""
    u, v, t, tables = np.array(state.u), state.v, state.t, system.backend.tables
    time = state.load if t is None else t
    K = load_stiffness(system, u, state.load, t) + system.constraints.curvature(
        u, time, state.multipliers)
    D = sparse.csr_array((system.N, system.N))
    for beam, s in zip(system.beams, system.slices):
        i, j = entries_of(s.start + element_dofs(beam))
        K = K + _square(system, i, j, beam.kernel.tangents(u[s]))
    if system.viscous:
        band, none = BandMatrix(system.N, system.bandwidth), tables.stresses
        body_tangent(tables.plain.viscous, u, 0.0 * u, none, True, tables.stresses, band.band)
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
