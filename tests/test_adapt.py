"""Graded meshes: the estimate against the true error, and elements where the error is."""

import exact
import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, Scene, StVenantKirchhoff)


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


def test_scene_is_put_on_other_beams():
    left = Beam(MeshBeam.init_line([0, 1], 0.1), ElementBeamANCF(2), StVenantKirchhoff(1e6, 0.3, 1),
                0.1, name="left")
    right = Beam(MeshBeam.init_line([1, 2], 0.1), ElementBeamANCF(2),
                 StVenantKirchhoff(1e6, 0.3, 1),
                 0.1, name="right")
    scene = Scene(left, right).clamp("left", beam="left").gravity((0, -1))
    scene.joint("weld", beams=(left, right), at=("right", "left"))
    scene.point_force((0, -0.1), at=(2, 0), beam=right).fix("right", ["r^1"], beam=1)
    again = scene.replace(beams=[b.replace(mesh=b.mesh.refined(3)) for b in scene.beams])
    assert (len(again.loads), len(again.joints)) == (3, 1) and again.system.constraints.m == 3
    a, b = scene.solve_linear(), again.solve_linear()
    assert_allclose(b.displacement((2, 0), "right"), a.displacement((2, 0), "right"), rtol=0.1,
                    atol=1e-12)
    numbered = Scene(left).clamp(np.array([0]))
    with pytest.raises(InputError, match="names or functions"):
        numbered.replace(beams=[left.replace(mesh=left.mesh.refined())])


# the degree

def test_degrees_need_fewer_coordinates_than_halved_elements():
    """5.2 to 1e-8: where the solution is smooth the degree is raised, and the result says so."""
    found = {}
    for most in (5, 7, 15):
        element = ElementBeamCable(min(most, 7))
        state = cantilever(element, 4).solve_static(adapt=1e-8, max_degree=most)
        known = exact.gravity_cantilever(2e8, 0.3, 7800, 1.0, 0.01, 0.01, model="extensible")
        assert np.hypot(*(state.displacement((1, 0)) - known)) < 1e-8
        assert max(state.error_estimate.values()) <= 1e-8
        found[most] = state
        last = state.refinements[-1]
        assert (last.degree, last.elements) == (state.beams[0].element.axis_degree,
                                                state.beams[0].mesh.nelements)
    assert {r.kind for r in found[5].refinements} == {r.kind for r in found[7].refinements} == {
        "split"}
    assert [(r.kind, r.degree) for r in found[15].refinements] == [
        ("degree", 9), ("degree", 11), ("degree", 13)]
    N = {most: state.scene.layout.N for most, state in found.items()}
    assert N[15] <= 70 and N[15] < 0.6 * N[7] and N[15] < 0.6 * N[5]


def test_beams_are_refined_one_by_one():
    """Two beams, one of them of an element that has no other degree."""
    def beam(x, element, name):
        return Beam(MeshBeam.init_line(x, 0.01), element, StVenantKirchhoff(2e8, 0.3, 7800), 0.01,
                    name=name)

    smooth = beam([0, 0.25, 0.5], ElementBeamCable(5), "smooth")
    rough = beam([0.5, 0.75, 1.0], ElementBeamANCF(2), "linear")
    scene = Scene(smooth, rough).clamp("left", beam="smooth").gravity((0, -3.0))
    scene.joint("weld", beams=(smooth, rough), at=("right", "left"))
    state = scene.solve_static(adapt=1e-4)
    assert next(r.kind for r in state.refinements if r.beam == 0) == "degree"
    assert {r.kind for r in state.refinements if r.beam == 1} == {"split"}
    assert state.beams[0].element.axis_degree > 5
    assert 2 * state.beams[0].mesh.nelements < state.beams[1].mesh.nelements
    fine = Scene(*(b.replace(mesh=b.mesh.refined(k)) for b, k in zip((smooth, rough), (3, 6))))
    fine.clamp("left", beam=0).gravity((0, -3.0)).joint("weld", beams=(0, 1), at=("right", "left"))
    assert_allclose(state.displacement((1, 0), 1), fine.solve_static().displacement((1, 0), 1),
                    atol=1e-4)


def test_a_curve_is_followed_and_not_its_first_elements():
    """An arch of one element: a higher degree alone converged to the cubic in its place."""
    def arch(n):
        mesh = MeshBeam.init_curve(lambda s: np.array([s, 0.5 * np.sin(np.pi * s)]),
                                   np.linspace(0, 1, n + 1), 0.02)
        beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e11, 0.3), width=0.02)
        return Scene(beam).clamp("left").point_force((0, -100.0), at=(1, 0))

    state, exact = arch(1).solve_static(adapt=1e-3), arch(64).solve_static()
    assert_allclose(state.displacement((1, 0)), exact.displacement((1, 0)), rtol=1e-4)
