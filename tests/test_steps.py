"""The time step: one text, which takes the same iterations in NumPy and compiled."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, EnergyMomentum, GeneralizedAlpha,
                        MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.core.band import BandMatrix, add_scaled, fix


def stiff_pendulum(slenderness, element, flag, law=StVenantKirchhoff, rods=1, n=16):
    """Hinged rods that fall from the horizontal, of the EI of L/h = 100 to a mass."""
    h, L = 1.0 / slenderness, 1.0 / rods
    material = law(2e8 * (0.01 / h)**2, 0.3, 7800.0)
    x = np.linspace(0, L, 1 + n // rods)
    scene = Scene(*(Beam(MeshBeam.init_line(x, h, origin=(k * L, 0)), element, material, 0.01,
                         name=f"rod {k}", compiled=flag) for k in range(rods)))
    scene.gravity((0, -9.81)).pin("left", beam="rod 0")
    if rods == 2:
        scene.joint("hinge", beams=("rod 0", "rod 1"), at=(0.5, 0.0))
    return scene


@pytest.mark.parametrize("slenderness", [1e3, 1e4])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)])
@pytest.mark.parametrize("scheme", [EnergyMomentum(), GeneralizedAlpha(1.0)])
def test_few_iterations_where_the_axis_is_stiff(slenderness, element, scheme):
    """And the equation of the scheme holds, whatever its iteration carried."""
    scene = stiff_pendulum(slenderness, element, False)
    history = scene.integrate(0.2, 1e-2, scheme)
    assert history.substeps == 0
    assert history.iterations <= 21 * history.steps
    assert history.factorizations <= 3 * history.steps
    if not scheme.conserving:
        return
    assert np.ptp(history.total_energy) < 2e-12 * history.kinetic_energy.max()
    system, (u0, u1), (v0, v1) = scene.system, history.u[-2:], history.v[-2:]
    inertia, weight = system.mass.multiply((v1 - v0) / 1e-2), system.external_force(u1, 0.2)
    missing = (inertia + system.mean_internal_force(u0, u1) - weight)[system.constraints.free]
    assert np.abs(missing).max() < 1e-6 * np.abs(weight).max()


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)])
def test_few_iterations_of_a_stiff_rod_that_turns_fast(element):
    """By 10 degrees in a step, where the stresses at its end go up and down from step to step."""
    scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 1e-3), element,
                       StVenantKirchhoff(2e10, 0.3, 7800.0), 0.01))
    scene.initial_velocity(lambda x: np.array(
        [1.0 - 10.0 * x[1] * (1.0 + 2.0 * x[0]), 10.0 * x[0] * (1.0 + x[0])]))
    history = scene.integrate(0.5, 1e-2, EnergyMomentum())
    assert history.substeps == 0
    assert history.iterations <= 21 * history.steps
    assert history.factorizations <= 3 * history.steps


@pytest.mark.parametrize("degree, n", [(5, 8), (7, 4), (9, 4)])
def test_few_iterations_where_more_strains_are_sampled_than_the_axis_has(degree, n):
    """Symmetric factors contract slowly there, or not at all: 19 to 24 iterations a step."""
    history = stiff_pendulum(1e4, ElementBeamCable(degree), False, n=n).integrate(
        0.7, 1e-2, EnergyMomentum())
    assert history.substeps == 0
    assert history.iterations <= 21 * history.steps
    assert history.factorizations <= 3 * history.steps
    assert np.ptp(history.total_energy) < 1e-12 * history.kinetic_energy.max()


@pytest.mark.parametrize("symmetric", [True, False])
def test_fixed_rows_and_columns_of_a_band_are_those_of_the_identity(symmetric):
    n, width, fixed, free = 9, 2, np.array([4, 0]), np.ones(9)
    i, j = np.nonzero(abs(np.arange(n)[:, None] - np.arange(n)) <= width)
    inside = (i >= j) | (not symmetric)
    A = BandMatrix.zeros(n, width, symmetric)
    A.add(i[inside], j[inside], 2.0 + np.sin(i + 7.0 * j)[inside])
    free[fixed] = 0.0
    wanted = A.tocsc().toarray() * np.outer(free, free) + np.diag(1.0 - free)
    U = BandMatrix.zeros(n, width, symmetric=False)
    add_scaled(A, 0.0, U)
    fix(A, fixed)
    fix(U, fixed)
    assert np.array_equal(A.tocsc().toarray(), wanted)
    assert np.array_equal(U.tocsc().toarray(), wanted)
