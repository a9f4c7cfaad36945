"""Graded meshes: the estimate against the true error, and elements where the error is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, InputError, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.results import State
from skfem_ancf.statics.adapt import refine


def cantilever(element, n, x=None):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1) if x is None else x, 0.01)
    beam = Beam(mesh, element, StVenantKirchhoff(2e8, 0.3, 7800), 0.01)
    return Scene(beam).clamp("left", thickness="free").gravity((0, -9.81))


@pytest.mark.parametrize("element, fine, tolerances", [
    (ElementBeamANCF(2), 1024, (1e-2, 1e-3, 2e-4)),
    (ElementBeamANCFCubic(2), 128, (1e-3, 1e-5)),
    (ElementBeamCable(5), 64, (1e-3, 1e-5)),
], ids=["linear", "cubic", "cable"])
def test_estimate_bounds_the_true_error(element, fine, tolerances):
    reference = cantilever(element, fine).solve_static()
    for tol in tolerances:
        state = cantilever(element, 4).solve_static(adapt=tol)
        error = np.hypot(*(state.displacement((1, 0)) - reference.displacement((1, 0))))
        energy = abs(state.strain_energy / reference.strain_energy - 1)
        estimate = state.error_estimate
        assert max(estimate.values()) <= tol
        assert error < estimate["displacement"] and energy < estimate["energy"]
    assert error > 1e-3 * estimate["displacement"]  # an estimate, not just a bound


def test_elements_go_where_the_beam_bends():
    """The end beyond the load moves rigidly: its elements stay long."""
    mesh = MeshBeam.init_line(np.linspace(0, 10, 5), 0.1)
    beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(1e9, 0.3), 0.1)
    scene = Scene(beam).clamp("left", thickness="free").point_force((0, -300.0), at=(2.5, 0))
    state = scene.solve_static(adapt=1e-3)
    x = state.beams[0].mesh.p[0]
    assert np.sum(x <= 2.5) > 8
    assert np.diff(x[x >= 2.5]).min() >= 8 * np.diff(x[x <= 2.5]).max()
    uniform = np.linspace(0, 10, 1 + int(10 / np.diff(x).min()))
    assert len(x) < 0.5 * len(uniform)
    assert state.scene is not scene and scene.beams[0].mesh.nelements == 4


def test_too_few_elements_keep_the_last_state():
    with pytest.raises(ConvergenceError, match="max_elements") as caught:
        cantilever(ElementBeamANCF(2), 4).solve_static(adapt=1e-6, max_elements=30)
    assert 30 <= caught.value.state.beams[0].mesh.nelements < 120
    with pytest.raises(InputError, match="adapt must be positive"):
        cantilever(ElementBeamANCF(2), 4).solve_static(adapt=0)


@pytest.mark.parametrize("name", [*ELEMENTS, "cable-3", "cable-5"])
def test_refined_space_holds_the_coarse_one(name):
    element = ElementBeamCable(int(name[-1])) if name.startswith("cable") else ELEMENTS[name]()
    mesh = MeshBeam.init_line([0, 0.3, 0.5, 1], 0.1, angle=0.4)
    scene = Scene(Beam(mesh, element, StVenantKirchhoff(2.0, 0.3), 0.3))
    fine, prolong = refine(scene, [[0, 2]])
    u = 0.05 * np.random.default_rng(0).standard_normal(scene.N)
    a, b = State(scene.system, u), State(fine.system, prolong(u))
    heights = [0.5] if element.order == 0 else [0.3, 0.6, 0.2]
    for xi, eta in zip((0.2, 0.6, 0.9), 3 * heights):
        for p in mesh.mapping().F(np.array([[xi], [eta]]))[:, :, 0].T:
            assert_allclose(b.displacement(p), a.displacement(p), rtol=0, atol=1e-13)


def test_scene_is_put_on_other_beams():
    left = Beam(MeshBeam.init_line([0, 1], 0.1), ElementBeamANCF(2), StVenantKirchhoff(1e6, 0.3, 1),
                0.1, name="left")
    right = Beam(MeshBeam.init_line([1, 2], 0.1), ElementBeamANCF(2),
                 StVenantKirchhoff(1e6, 0.3, 1),
                 0.1, name="right")
    scene = Scene(left, right).clamp("left", beam="left").gravity((0, -1))
    scene.joint("weld", beams=(left, right), at=("right", "left"))
    scene.point_force((0, -0.1), at=(2, 0), beam=right).fix("right", ["r^1"], beam=1)
    again = scene.with_beams([b.with_mesh(b.mesh.refined(3)) for b in scene.beams])
    assert (len(again.loads), len(again.joints)) == (3, 1) and again.system.m == 3
    a, b = scene.solve_linear(), again.solve_linear()
    assert_allclose(b.displacement((2, 0), "right"), a.displacement((2, 0), "right"), rtol=0.1)
    numbered = Scene(left).clamp(np.array([0]))
    with pytest.raises(InputError, match="names or functions"):
        numbered.with_beams([left.with_mesh(left.mesh.refined())])
