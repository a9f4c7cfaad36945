"""One rule of convergence: ``tol`` is the relative error in the energy norm, whatever is solved."""

import numpy as np
import pytest

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff


def cantilever(way=None):
    """A beam that a tip force bends by half its length."""
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 5), 0.1), ElementBeamANCF(3),
                StVenantKirchhoff(2e7, 0.3, 7800.0), width=0.1, formulation="assumed")
    force = (0.0, -600.0) if way is None else (0.0, -600.0, way)
    return Scene(beam).clamp("left").point_force(force[:2], at="right", amplitude=way)


def statics(tol):
    return cantilever().solve_static(tol=tol).u


def increments(tol):
    return cantilever(lambda t: t).run(1.0, 2, tol=tol).u[-1]


def path(tol):
    return cantilever().continuation(ds=0.1, max_load=1.0, tol=tol).points[-1].u


@pytest.mark.parametrize("solve", [statics, increments, path])
@pytest.mark.parametrize("tol", [1e-2, 1e-4, 1e-6])
def test_the_error_is_within_tol_in_the_energy_norm(solve, tol):
    """By the tangent at a solution to round-off, relative to the work of the load."""
    system = cantilever().system
    exact, du = statics(1e-13), solve(tol) - statics(1e-13)
    system.assemble(exact)
    error = np.sqrt(abs(du @ system.K.multiply(du)) / (system.external_force(exact) @ exact))
    assert error <= tol


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau"])
@pytest.mark.parametrize("tol", [1e-5, 1e-7, 1e-9])
def test_the_error_of_a_step_is_within_tol_in_the_energy_norm(scheme, tol):
    """By the iteration matrix of the mass and the tangent, relative to the energy."""
    scene, dt = cantilever(), 0.005

    def at(tol):
        return scene.integrate(dt, dt, scheme, tol=tol)

    exact = at(1e-13)
    du, system = at(tol).u[-1] - exact.u[-1], scene.system
    system.assemble(exact.u[-1])
    inertia = (2.0 / dt)**2 * (du @ system.mass.multiply(du))
    energy = exact.kinetic_energy[-1] + exact.strain_energy[-1]
    assert np.sqrt((0.5 * abs(du @ system.K.multiply(du)) + inertia) / energy) <= tol


def test_a_larger_tolerance_takes_fewer_iterations():
    counts = [cantilever().solve_static(tol=tol).iterations for tol in (1e-1, 1e-4, 1e-12)]
    assert counts == sorted(counts) and counts[0] < counts[-1]
