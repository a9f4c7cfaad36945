"""What a scene does not need is not computed: counted by calls, not read from the plan alone."""

import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, KelvinVoigt, Line,
                        MeshBeam, NameUnknown, Scene, StVenantKirchhoff, SupportError)
from skfem_ancf.dynamics import choose_scheme


def scene(element=None, nu=0.3, formulation="assumed", **options):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), element or ElementBeamANCF(2),
                StVenantKirchhoff(2e8, nu, 7800), 0.01, formulation, compiled=False, **options)
    return Scene(beam).clamp("left").gravity((0, -9.81))


def test_linear_solve_meets_prescribed_displacements_and_joints():
    s = scene(nu=0.0)
    s = Scene(s.beams[0]).clamp("left")
    s.fix("right", "r^2", displacement=0.01)
    state = s.solve_linear()
    assert_allclose(state.displacement((1, 0))[1], 0.01, rtol=1e-12)
    assert_allclose(state.displacement((0.5, 0))[1], 0.01 * 5 / 16, rtol=1e-2)
    with pytest.raises(SupportError, match="rotation about"):
        Scene(s.beams[0]).pin("left").solve_linear()


def test_no_viewer_is_imported():
    code = ("import sys, skfem_ancf; "
            "print(sorted({'matplotlib', 'tqdm', 'pyvista', 'numba'} & set(sys.modules)))")
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_numba_is_left_out_on_request(monkeypatch):
    """One variable for all beams; what else it may be set to is refused, and the plan says why."""
    assert "compiled=False" in scene().plan()["compiled loop"]
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "0")
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(3),
                StVenantKirchhoff(2e8, 0.3, 7800), 0.01)
    off = Scene(beam).pin("left").plan()["compiled loop"]
    assert off.startswith("no") and "SKFEM_ANCF_COMPILED=0" in off
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "no")
    with pytest.raises(InputError, match="must be 0 .* 1 .* auto .*, got 'no'"):
        Scene(beam).pin("left").plan()


def test_plan_of_every_kind():
    s = scene()
    assert "Cholesky" in s.plan()["linear solver"]
    assert "8 x <ElementBeamANCF" in s.plan()["elements"]
    s.pressure("top", 1.0)
    s.joint("line", at=(1, 0), direction=(1, 0.5))
    plan = s.plan()
    assert "sparse LU" in plan["linear solver"]
    s = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 121), 0.01), ElementBeamCable(3),
                   StVenantKirchhoff(2e8, 0.3, 7800), 0.01)).pin("left").pressure("top", 1.0)
    for k in range(110):
        s.joint("line", at=(1 - k / 120, 0), direction=(1, 0.5))
    assert "sparse" in s.plan()["linear solver"]
    assert "LU" in s.plan("dynamic")["linear solver"]
    assert all(name in str(plan) and text in str(plan) for name, text in plan.items())
    with pytest.raises(NameUnknown, match="'static', 'linear', 'dynamic'"):
        s.plan("modal")
    with pytest.raises(NameUnknown, match="'elements'"):
        plan["inertia"]


# the element is chosen

@pytest.mark.parametrize("fields, height, tolerance, order", [
    ((), 0.01, 1e-3, 0), ((), 0.01, 5e-5, 2), ("eps_yy", 0.01, 1e-2, 2), ("eps_xy", 0.01, 1e-2, 3),
    ((), 0.1, 2e-3, 2), ((), 0.2, 1e-3, 5), (("eps_xx", "S_yy"), 0.01, 1e-2, 5)])
def test_lowest_order_that_will_do(fields, height, tolerance, order):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), height)
    beam = Beam(mesh, "auto", StVenantKirchhoff(1.0, 0.3), 0.1, fields=fields, tolerance=tolerance)
    assert beam.element.order == order


@pytest.mark.parametrize("height, tolerance", [
    (0.01, 1e-3), (0.05, 1e-3), (0.1, 1e-2), (0.1, 2e-3)])
def test_chosen_element_keeps_the_tolerance(height, tolerance):
    """Tip of a linear cantilever against sections of order 7; a fine mesh for both."""
    def tip(element):
        mesh = MeshBeam.init_line(np.linspace(0, 1, 65), height)
        beam = Beam(mesh, element, StVenantKirchhoff(1.0, 0.3), 1.0, tolerance=tolerance)
        s = Scene(beam).clamp("left", thickness="free").traction("right", (0, -1e-6))
        return s.solve_linear().displacement((1, 0))[1]

    assert abs(tip("auto") / tip(ElementBeamANCF(7)) - 1) < tolerance


def test_choice_refuses_unknown_fields():
    mesh = MeshBeam.init_line([0, 1], 0.1)
    with pytest.raises(NameUnknown, match="'eps_yy'"):
        Beam(mesh, "auto", StVenantKirchhoff(1.0, 0.3), 0.1, fields=["eps_zz"])
    with pytest.raises(InputError, match="below 1"):
        Beam(mesh, "auto", StVenantKirchhoff(1.0, 0.3), 0.1, tolerance=2.0)
    assert not Beam(mesh, ElementBeamCable(), StVenantKirchhoff(1.0, 0.3), 0.1).has_sections


def test_which_scheme_a_motion_takes():
    """By joints, damping, stiffness, contact and tolerance; the plan says which, and why."""
    def rod(height=0.1, **options):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height), ElementBeamANCF(2),
                    StVenantKirchhoff(1e5, 0.3, 1000.0), 0.1, **options)
        return Scene(beam).gravity((0, -9.81))

    held, hinged, touching = rod().clamp("left"), rod(), rod().clamp("left")
    hinged.joint("circle", at=(0, 0), center=(0, 1))
    touching.obstacle(Line((0, -0.2), (0, 1)))
    damped = rod(damping=KelvinVoigt(1e-3)).clamp("left")
    for scene, rtol, name, why in (
            (held, 1e-6, "gauss", "no joints"), (held, 1e-3, "energy-momentum", "nothing is lost"),
            (hinged, 1e-6, "radau", "joints"), (damped, 1e-6, "radau", "damping"),
            (damped, 1e-2, "generalized-alpha", "damping"),
            (rod(1e-3).clamp("left"), 1e-6, "radau", "no step resolves"),
            (touching, 1e-6, "energy-momentum", "obstacles"),
            (rod().contact("all", self_contact=True), 1e-6, "energy-momentum", "contact")):
        choice = choose_scheme(scene.system, rtol)
        assert choice.scheme.name == name and why in choice.reason
        assert repr(choose_scheme(scene.system).scheme) in scene.plan("dynamic")["scheme"]
    history = held.integrate(0.1, "auto", scheme="auto", rtol=1e-6)
    other = held.integrate(0.1, "auto", scheme="gauss", rtol=1e-6)
    assert np.array_equal(history.u, other.u) and len(history) == len(other)
