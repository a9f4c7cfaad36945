"""What a scene does not need is not computed: counted by calls, not read from the plan alone."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, KelvinVoigt, Line,
                        MeshBeam, NameUnknown, Scene, StVenantKirchhoff, SupportError)
from skfem_ancf.beam.beam import Beam as BeamClass
from skfem_ancf.equations.backend import LOADED
from skfem_ancf.beam import strain_energy as body
from skfem_ancf.dynamics import choose_scheme
from skfem_ancf.dynamics import steps
from skfem_ancf.beam.kernels.strain import FORCE, TANGENT
from skfem_ancf.solvers import iteration
from skfem_ancf.core.linalg import BandMatrix
from skfem_ancf.beam.strains import Gradients
from skfem_ancf.equations.system import System


def scene(element=None, nu=0.3, formulation="assumed", **options):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), element or ElementBeamANCF(2),
                StVenantKirchhoff(2e8, nu, 7800), 0.01, formulation, compiled=False, **options)
    return Scene(beam).clamp("left").gravity((0, -9.81))


@pytest.fixture
def count(monkeypatch):
    """Count the calls of methods: count(cls, name) returns a list that grows."""
    def patch(cls, name):
        calls, original = [], getattr(cls, name)

        def wrapper(self, *args, **kwargs):
            calls.append(args)
            return original(self, *args, **kwargs)

        monkeypatch.setattr(cls, name, wrapper)
        return calls

    return patch


@pytest.fixture
def evaluated(monkeypatch):
    """What kernels are asked for, and whether a tangent has no stress: a list that grows."""
    calls, original = [], body.evaluate_body

    def wrapper(b, what, u, v, f, given, out, flat, ld):
        calls.append("linear tangent" if what == TANGENT and given.size and not given.any() else
                     {FORCE: "force", TANGENT: "tangent"}.get(int(what), "stress"))
        original(b, what, u, v, f, given, out, flat, ld)

    monkeypatch.setattr(body, "evaluate_body", wrapper)
    return calls


def factors_in(module, monkeypatch):
    """Count the factors that a text makes."""
    calls, original = [], module.factorize
    monkeypatch.setattr(module, "factorize", lambda A: calls.append(1) or original(A))
    return calls


def test_statics_have_no_mass_and_one_factorisation_an_iteration(count, evaluated, monkeypatch):
    s = scene()
    mass, factors = count(BeamClass, "mass_elements"), factors_in(iteration, monkeypatch)
    state = s.solve_static()
    assert len(mass) == 0 and s.plan()["mass"].status == "skipped"
    # none after the last correction
    assert len(factors) == evaluated.count("tangent") == state.iterations
    assert evaluated.count("force") == 1


def test_dynamics_assemble_the_mass_once_and_keep_factors(count, monkeypatch):
    s = scene()
    mass, factors = count(BeamClass, "mass_elements"), factors_in(steps, monkeypatch)
    history = s.integrate(0.05, 1e-3, "generalized-alpha")
    assert len(mass) == 1 and s.plan("dynamic")["mass"].status == "constant"
    # fewer than steps for the iteration
    assert len(factors) == history.factorizations < 50 < history.iterations


def test_linear_problem_is_one_solve_without_geometric_term(count, evaluated):
    s = scene(nu=0.0)
    factors = count(BandMatrix, "factorize")
    tip = s.solve_linear().displacement((1, 0))
    assert evaluated == ["linear tangent"] and len(factors) == 1
    assert s.plan("linear")["geometric term"].status == "skipped"
    EI = 2e8 * 0.01**4 / 12
    assert_allclose(tip, [0, -7800 * 9.81 * 1e-4 / (8 * EI)], rtol=6e-3, atol=1e-12)
    s.solve_static()
    assert evaluated.count("tangent") > 1


def test_linear_solve_meets_prescribed_displacements_and_joints():
    s = scene(nu=0.0)
    s = Scene(s.beams[0]).clamp("left")
    s.fix("right", "r^2", displacement=0.01)
    state = s.solve_linear()
    assert_allclose(state.displacement((1, 0))[1], 0.01, rtol=1e-12)
    assert_allclose(state.displacement((0.5, 0))[1], 0.01 * 5 / 16, rtol=1e-2)
    with pytest.raises(SupportError, match="rotation about"):
        Scene(s.beams[0]).pin("left").solve_linear()


@pytest.mark.parametrize("formulation, terms", [("ecm", 2), ("strain-split", 3), ("assumed", 1)])
def test_no_poisson_coupling_at_nu_zero(formulation, terms):
    with_nu, without = (scene(nu=nu, formulation=formulation).beams[0].kernel for nu in (0.3, 0.0))
    assert len(with_nu.tables) == terms and len(without.tables) == 1
    assert scene(nu=0.0).plan()["Poisson coupling"].status == "skipped"
    assert scene(nu=0.3).plan()["Poisson coupling"].status == "computed"


def test_no_viewer_is_imported():
    code = ("import sys, skfem_ancf; "
            "print(sorted({'matplotlib', 'tqdm', 'pyvista', 'numba', 'h5py'} & set(sys.modules)))")
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_no_field_that_nobody_asked_for(count):
    strains = count(Gradients, "__init__")
    state = scene().solve_static()
    state.displacement((1, 0)), state.strain_energy, state.reactions("left")
    assert len(strains) == 0
    assert "_recoveries" not in vars(state)
    state.strain((0.5, 0), recover=False)
    assert len(strains) == 1


def compiled_scene():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), ElementBeamCable(3),
                StVenantKirchhoff(2e8, 0.3, 7800), 0.01)
    return Scene(beam).pin("left").gravity((0, -9.81))


@pytest.mark.parametrize("add", ["nothing", "joint", "moment", "pressure"])
def test_compiled_loop_as_planned(needs_compiled, count, add, monkeypatch):
    """Everything is in the whole loops, and nothing of them in Python's assembly."""
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "1")
    s = compiled_scene()
    if add == "joint":
        s.joint("line", at=(0.9, 0), direction=(1, 0.1))
    else:
        s.fix("left", ["r_X^2"])
    if add == "moment":
        s.moment("right", 0.01)
    if add == "pressure":
        s.pressure("top", 1e-3)
    assembled = count(System, "assemble")
    for kind, text in (("static", "equilibrium"), ("dynamic", "steps")):
        assert s.plan(kind)["compiled loop"].status == "computed"
        s.solve_static() if kind == "static" else s.integrate(0.02, 1e-3)
        assert text in LOADED
        assert s.plan(kind)["compiled loop"].reason.endswith("compiled code is loaded")
    assert not assembled or add == "pressure"  # whose tangent the verdict on stability asks for
    assert s.plan("linear")["compiled loop"].status == "skipped"


def test_numba_is_left_out_on_request(monkeypatch):
    """One variable for all beams; what else it may be set to is refused, and the plan says why."""
    assert "compiled=False" in scene().plan()["compiled loop"].reason
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "0")
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(3),
                StVenantKirchhoff(2e8, 0.3, 7800), 0.01)
    off = Scene(beam).pin("left").plan()["compiled loop"]
    assert off.status == "skipped" and "SKFEM_ANCF_COMPILED=0" in off.reason
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "no")
    with pytest.raises(InputError, match="must be 0 .* 1 .* auto .*, got 'no'"):
        Scene(beam).pin("left").plan()


@pytest.mark.parametrize("numba", ["raise ImportError('NumPy is too new')", None])
def test_a_numba_that_cannot_be_used_is_left_out(tmp_path, numba):
    if numba is not None:
        (tmp_path / "numba.py").write_text(numba)
    code = ("from skfem_ancf import *; beam = Beam(MeshBeam.init_line([0, 1], 0.1), "
            "ElementBeamCable(3), StVenantKirchhoff(1.0, 0.3), 0.1); "
            "scene = Scene(beam).clamp('left'); scene.solve_static(); "
            "print(scene.plan()['compiled loop'].reason)")
    paths = [str(tmp_path), os.getcwd(), *filter(None, [os.environ.get("PYTHONPATH")])]
    env = {**os.environ, "SKFEM_ANCF_COMPILED": "1", "PYTHONPATH": os.pathsep.join(paths)}
    if numba is None:
        env["NUMBA_DISABLE_JIT"] = "1"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                         env=env).stdout
    assert ("NUMBA_DISABLE_JIT" if numba is None else "NumPy is too new") in out


def test_plan_of_every_kind():
    s = scene()
    assert s.plan()["multipliers"].status == "skipped"
    assert s.plan()["varying loads"].status == "skipped"
    assert "Cholesky" in s.plan()["linear solver"].reason
    s.pressure("top", 1.0)
    s.joint("line", at=(1, 0), direction=(1, 0.5))
    plan = s.plan()
    assert plan["multipliers"].status == plan["varying loads"].status == "computed"
    assert "sparse LU" in plan["linear solver"].reason
    s = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 121), 0.01), ElementBeamCable(3),
                   StVenantKirchhoff(2e8, 0.3, 7800), 0.01)).pin("left").pressure("top", 1.0)
    for k in range(110):
        s.joint("line", at=(1 - k / 120, 0), direction=(1, 0.5))
    assert "sparse" in s.plan()["linear solver"].reason
    assert "LU" in s.plan("dynamic")["linear solver"].reason
    assert all(item.term in str(plan) and item.reason in str(plan) for item in plan)
    with pytest.raises(NameUnknown, match="'static', 'linear', 'dynamic'"):
        s.plan("modal")
    with pytest.raises(NameUnknown, match="'mass'"):
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
            (touching, 1e-6, "energy-momentum", "obstacles")):
        choice = choose_scheme(scene.system, rtol)
        assert choice.scheme.name == name and why in choice.reason
        item = scene.plan("dynamic")["scheme"]
        assert repr(choose_scheme(scene.system).scheme) in item.reason
    history = held.integrate(0.1, "auto", scheme="auto", rtol=1e-6)
    other = held.integrate(0.1, "auto", scheme="gauss", rtol=1e-6)
    assert np.array_equal(history.u, other.u) and len(history) == len(other)


def test_a_linear_solve_computes_no_contact():
    touched = scene().obstacle(Line((0, -0.5), (0, 1)))
    plan = touched.plan("linear")["obstacles"]
    assert plan.status == "skipped" and "refused" in plan.reason
    assert touched.plan()["obstacles"].status == "computed"
    touched.gravity((0, -90.0))
    with pytest.raises(InputError):
        touched.solve_linear()
