"""Details that change results or costs and that no other test sees: a factor, a sign, a bound.

Each of these tests was written against a mutant in benchmarks/mutation/named.py that the others
let live.
"""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import Basis, Functional, asm

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, ElementBeamPatelShabana, Frame, InputError, MeshBeam,
                        MeshError, ModelWarning, RigidBody, Scene, Section, StVenantKirchhoff,
                        SupportError, forms)
from skfem_ancf.actions.joints import Joint, PrescribedAngle, Weld
from skfem_ancf.beam.distribution import BODY, Sampled
from skfem_ancf.beam.kinematics import locate
from skfem_ancf.core.quadrature import gauss, tensor
from skfem_ancf.dynamics import steps
from skfem_ancf.dynamics.integrator import Integrator
from skfem_ancf.equations.evaluation import mean_stiffness
from skfem_ancf.io import PvdWriter
from skfem_ancf.mesh.mapping import PLACES, halved
from skfem_ancf.solvers import newton
from skfem_ancf.solvers.continuation import Tracer

STEEL = StVenantKirchhoff(1e6, 0.3, 1.0)


def line(n, height=0.1, L=1.0, **options):
    return MeshBeam.init_line(np.linspace(0.0, L, n + 1), height, **options)


def arc(n=4, height=0.2, end=1.5):
    return MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                               np.linspace(0, end, n + 1), height)


# formulations


def green(grad, frame):
    F = np.einsum("ij...,jJ...->iJ...", grad, frame)
    return np.array([0.5 * (F[0, 0]**2 + F[1, 0]**2 - 1), 0.5 * (F[0, 1]**2 + F[1, 1]**2 - 1),
                     F[0, 0] * F[0, 1] + F[1, 0] * F[1, 1]])


@pytest.mark.parametrize("mesh", [line(2), arc(2)], ids=["line", "arc"])
@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(3),
                                     ElementBeamPatelShabana()], ids=repr)
@pytest.mark.parametrize("name", ["ecm", "strain-split"])
def test_energy_of_split_strains(name, element, mesh):
    """By scikit-fem alone: a the strain of the axis, s the rest, D_0 without Poisson coupling."""
    beam = Beam(mesh, element, STEEL, 0.3, name)
    D = STEEL.law(STEEL.shear_factor(element)).D
    D0 = np.diag([STEEL.E, STEEL.E, D[2, 2]])
    X, W = tensor(gauss(5), gauss(2 * element.order + 1))
    body = Basis(beam.mesh, beam.basis.elem, quadrature=(X, W))
    axis = Basis(beam.mesh, beam.basis.elem, quadrature=(X * [[1], [0]] + [[0], [0.5]], W))
    # the axis' part is an integral along the axis, times h b
    rule = tensor(gauss(5), (np.array([0.5]), np.ones(1)))
    thin = Basis(beam.mesh, beam.basis.elem, quadrature=rule)
    q = beam.q0 + 0.05 * np.random.default_rng(3).standard_normal(beam.N)

    def strain(basis):
        return green(np.array(basis.interpolate(q).grad), beam.mesh.mapping().frame(basis.X))

    eps, a = strain(body), strain(thin)
    on_axis = strain(axis)
    C = D - D0

    def dot(A, x, y):
        return np.einsum("a...,ab,b...->...", x, A, y)

    uncoupled = asm(Functional(lambda w: 0.5 * dot(D0, eps, eps)), body)
    if name == "ecm":
        coupled = asm(Functional(lambda w: 0.5 * dot(C, a, a)), thin)
    else:  # a : C : s + a : C : a / 2 with the section's mean of s
        w_section = gauss(2 * element.order + 1)[1]
        s = (eps - on_axis).reshape(3, mesh.nelements, 5, -1) @ w_section
        coupled = asm(Functional(lambda w: 0.5 * dot(C, a, a) + dot(C, a, s)), thin)
    expected = 0.3 * (uncoupled + coupled)
    assert abs(coupled) > 1e-3 * uncoupled
    assert beam.kernel.energy(q - beam.q0) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(3),
                                     ElementBeamANCFCubic(1), ElementBeamANCFCubic(2)], ids=repr)
def test_full_quadrature_is_exact(element):
    """The energy of any displacement, against scikit-fem with 12 by 12 points an element."""
    beam = Beam(line(2), element, STEEL, 0.3, "continuum")
    basis = Basis(beam.mesh, beam.basis.elem, quadrature=tensor(gauss(12), gauss(12)))
    q = beam.q0 + 0.2 * np.random.default_rng(3).standard_normal(beam.N)
    energy = asm(forms.energy(STEEL, 0.3, STEEL.shear_factor(element)), basis, r=q)
    assert beam.kernel.energy(q - beam.q0) == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("name", ["ecm", "strain-split", "assumed", "continuum"])
def test_stress_of_a_pulled_bar(name):
    """P = F / A along the bar and nothing across it, though it gets thinner by 5 %."""
    beam = Beam(line(4), ElementBeamANCF(2), STEEL, 0.1, name)
    scene = Scene(beam).clamp("left", thickness="free").traction("right", (2e5, 0))
    state = scene.solve_static()
    S, strain = (ask((0.45, 0.03), recover=False) for ask in (state.stress, state.strain))
    assert strain[1] == pytest.approx(-0.3 * strain[0], rel=1e-9)
    assert S[0] * np.sqrt(1 + 2 * strain[0]) == pytest.approx(2e5, rel=1e-7)
    assert abs(S[1]) < 1e-4 and abs(S[2]) < 1e-4


@pytest.mark.parametrize("name", ["ecm", "strain-split"])
def test_stress_of_a_bent_beam_without_coupling_off_the_axis(name):
    """-M Y / I at the point, not that over 1 - nu^2: the axis has no strain."""
    beam = Beam(line(8, 0.05), ElementBeamANCF(2), STEEL, 0.1, name)
    state = Scene(beam).clamp("left", thickness="free").moment("right", 1e-5).solve_linear()
    S = state.stress((0.5, 0.02), recover=False)
    assert S[0] == pytest.approx(-1e-5 * 0.02 / (0.1 * 0.05**3 / 12), rel=1e-3)
    assert abs(S[1]) < 1e-3 * abs(S[0])


@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_a_free_cable_has_three_zero_modes(degree, n):
    beam = Beam(line(n), ElementBeamCable(degree), STEEL, 0.1)
    u, out = np.zeros(beam.N), np.zeros((beam.N, beam.N))
    for e, K in enumerate(beam.kernel.tangents(u)):
        k = slice(e * beam.nd, e * beam.nd + 2 * beam.nd)
        out[k, k] += K
    scale = 1.0 / np.sqrt(np.diag(out))
    values = np.linalg.eigvalsh(scale[:, None] * out * scale)
    assert np.all(np.abs(values[:3]) < 1e-12) and values[3] > 1e-9


@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(3), ElementBeamCable(5)],
                         ids=repr)
@pytest.mark.parametrize("nodes", [np.linspace(0, 2, 5), np.array([0, 0.3, 2])], ids=str)
def test_volume_and_mass(element, nodes):
    beam = Beam(MeshBeam.init_line(nodes, 0.1, angle=0.2), element, STEEL, 0.3)
    assert beam.kernel.volume == pytest.approx(2 * 0.1 * 0.3, rel=1e-13)
    assert beam.total_mass == pytest.approx(2 * 0.1 * 0.3, rel=1e-13)


@pytest.mark.parametrize("plane, stiffer", [("stress", 1.0), ("strain", 1.0 / 0.91)])
@pytest.mark.parametrize("order", [1, 2])
def test_no_poisson_locking(order, plane, stiffer):
    """A linear tip force against E I, in plane strain E I / (1 - nu^2)."""
    material = StVenantKirchhoff(1e6, 0.3, plane=plane)
    beam = Beam(line(32, 0.02), ElementBeamANCF(order), material, 0.1)
    scene = Scene(beam).clamp("left", thickness="free").point_force((0.0, -1e-3), at=(1, 0))
    tip = scene.solve_linear().displacement((1, 0))[1]
    assert tip == pytest.approx(-1e-3 / (3 * 1e6 * 0.1 * 0.02**3 / 12 * stiffer), rel=3e-3)


# what is chosen


@pytest.mark.parametrize("height, tolerance, order", [
    (0.05, 2e-4, 3), (0.05, 3e-4, 2), (0.1, 9e-4, 5), (0.02, 1e-4, 2), (0.02, 3.5e-4, 0)])
def test_the_order_chosen_is_enough_and_no_more(height, tolerance, order):
    """Tip of a linear cantilever against sections of order 7."""
    def tip(element):
        beam = Beam(line(64, height), element, STEEL, 1.0, tolerance=tolerance)
        s = Scene(beam).clamp("left", thickness="free").traction("right", (0, -1e-3))
        return s.solve_linear().displacement((1, 0))[1], beam.element.order

    (found, chosen), (exact, _) = tip("auto"), tip(ElementBeamANCF(7))
    assert chosen == order
    assert abs(found / exact - 1) < tolerance


def test_adaptive_meshes_take_few_rounds_and_few_elements(monkeypatch):
    solves, solve = [], newton.solve_static
    monkeypatch.setattr(newton, "solve_static", lambda *a, **k: solves.append(1) or solve(*a, **k))
    beam = Beam(line(4, 0.1, L=10.0), ElementBeamANCF(2), StVenantKirchhoff(1e9, 0.3), 0.1)
    scene = Scene(beam).clamp("left", thickness="free").point_force((0, -300.0), at=(2.5, 0))
    state = scene.solve_static(adapt=1e-3)
    assert len(solves) <= 2 * 9  # 7 rounds: with small parts marked 16
    assert state.beams[0].mesh.nelements <= 72  # 54: halved everywhere 128


# the mesh and its points


def test_a_fold_between_the_nodes_is_seen():
    """Sections fit at both ends of the element and cross in its middle."""
    p = np.array([[0.0, 1.0], [0.0, 0.0]])
    for angle, height, folds in ((1.2, 0.3, False), (1.2, 1.5, True)):
        X = np.array([[np.cos(angle), np.cos(angle)], [np.sin(angle), -np.sin(angle)]])
        Y = np.array([-X[1], X[0]])
        arguments = dict(height=height, p_X=X, p_Y=Y, lengths=np.array([1.2]))
        mesh = None
        try:
            mesh = MeshBeam(p, np.array([[0], [1]]), **arguments)
        except MeshError as error:
            assert folds and "folds in element 0" in str(error)
        assert (mesh is None) == folds
    # at the left end: d/dxi of the lower face, and the director
    a, b = 1.2 * X[:, 0] - 0.5 * height * (Y[:, 1] - Y[:, 0]), height * Y[:, 0]
    assert a[0] * b[1] - a[1] * b[0] > 0


@pytest.mark.parametrize("mesh", [
    arc(12, 1.2), arc(3, 0.5, end=3.0), line(5, 2.0, angle=0.7),
    MeshBeam.init_curve(lambda s: (0.3 + 0.03 * s) * np.array([np.cos(s), np.sin(s)]),
                        np.linspace(0, 14, 60), 0.18)], ids=["thick arc", "long", "high", "spiral"])
def test_points_off_the_axis_are_found_in_their_element(mesh):
    beam = Beam(mesh, ElementBeamANCF(2), STEEL, 0.1)
    rng = np.random.default_rng(5)
    for e in range(mesh.nelements):
        xi = rng.uniform(0.02, 0.98, 2)
        for X in ((xi[0], 0.03), (xi[1], 0.97)):
            x = beam.mesh.mapping().F(np.array(X)[:, None, None], np.array([e]))[:, 0, 0]
            found, where = locate(beam, x)
            assert found == e
            assert_allclose(where, X, rtol=0, atol=1e-9)


# rigid motions, supports and joints


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e10])
def test_supports_hold_in_any_unit_of_length(unit):
    """A slope's part in a turn of the beam is one over its length: 1e-10 for 10 m in nm."""
    beam = Beam(line(4, 0.1 * unit, L=unit), ElementBeamCable(),
                StVenantKirchhoff(1e6 / unit**2, 0.3), 0.1 * unit)
    scene = Scene(beam).fix("left", ["r", "r_X^2"]).point_force((0, -0.01), at=(unit, 0))
    tip = scene.solve_linear().displacement((unit, 0))[1] / unit
    assert tip == pytest.approx(-4e-4, rel=0.05)  # P L^3 / (3 E I) = 4e-4
    apart = Scene(beam).fix("left", ["r"]).fix("right", ["r_X^2"])  # the same, seen from the tip
    apart.point_force((0, -0.01), at=(unit, 0))
    assert apart.solve_linear().displacement((unit, 0))[1] / unit == pytest.approx(tip, rel=1e-6)
    two = [Beam(line(4, 0.1 * unit, L=unit, origin=(k * unit, 0)), ElementBeamCable(),
                StVenantKirchhoff(1e6 / unit**2, 0.3), 0.1 * unit) for k in (0, 1)]
    joined = Scene(*two).clamp("left", beam=0)
    joined.joint("weld", beams=(0, 1), at=("right", "left"))
    joined.point_force((0, -0.01), at=(2 * unit, 0), beam=1)
    tip = joined.solve_linear().displacement((2 * unit, 0), 1)[1] / unit
    assert tip == pytest.approx(-8 * 4e-4, rel=0.05)


def guided(tilt, gap=0.0):
    """A beam whose tip is on two lines with an angle of ``tilt`` between them."""
    scene = Scene(Beam(line(4), ElementBeamANCF(2), STEEL, 0.1)).clamp("left")
    scene.joint("line", at=(1, 0), direction=(1, 1))
    scene.joint("line", at=(1, 0), direction=(1, 1 + 2 * tilt), through=(1.0, gap), name="second")
    return scene.point_force((0.0, -0.1), at=(0.5, 0))


def test_lines_that_differ_a_little_are_two():
    state = guided(1e-6).solve_static()
    assert np.max(np.abs(state.displacement((1, 0)))) < 1e-9  # held by both
    assert state.displacement((0.5, 0))[1] < -1e-5


@pytest.mark.parametrize("tilt, gap", [(1e-13, 0.0), (1e-13, 1e-13)])
def test_lines_that_differ_by_round_off_are_one(tilt, gap):
    with pytest.warns(ModelWarning, match="^1 of 2 equations.*second"):
        state = guided(tilt, gap).solve_static()
    assert np.max(np.abs(state.displacement((1, 0)))) > 1e-7  # held by one


def test_lines_that_are_apart_contradict_each_other():
    with pytest.raises(SupportError, match="second.*contradicts"):
        guided(0.0, 1e-6).solve_static()


def test_moment_of_a_plane_section_is_that_of_the_cantilever():
    """The joint's forces on t . r_Yk: their sum is minus the clamp's moment, which is P L."""
    for angle in (0.0, 0.4):  # coordinates that are fixed, and multipliers
        mesh = line(8, angle=angle)
        beam = Beam(mesh, ElementBeamANCF(3), STEEL, 0.1)
        tip, across = mesh.p[:, -1], np.array([-np.sin(angle), np.cos(angle)])
        scene = Scene(beam).pin("left").point_force(-1e-4 * across, at=tip)
        plane = scene.joint("plane", at="left")
        moment = np.sum(scene.solve_linear().joint_force(plane))
        assert moment == pytest.approx(-1e-4, rel=1e-6)


@pytest.mark.parametrize("xi", [1e-3, 0.004, 0.25])
def test_a_joint_holds_the_very_point(xi):
    """Near a node the weights of the slopes are small: the point would be off by 1e-3."""
    beam = Beam(line(4), ElementBeamANCF(2), STEEL, 0.1)
    at = (0.5 + 0.25 * xi, 0.03)
    scene = Scene(beam).clamp("left").point_force((0.0, -0.5), at=(1, 0))
    scene.joint("position", at=at, r=lambda t: (at[0] - 0.02, at[1] + 0.1))
    state = scene.solve_static()
    assert_allclose(state.position(at), (at[0] - 0.02, at[1] + 0.1), rtol=0, atol=1e-11)


# statics


def loaded(P, element=None, n=6, **options):
    beam = Beam(line(n), element or ElementBeamANCF(2), STEEL, 0.1, **options)
    EI = 1e6 * 0.1 * 0.1**3 / 12
    return Scene(beam).clamp("left", thickness="free").point_force((0.0, -P * EI), at=(1, 0))


@pytest.mark.parametrize("compiled", [False, True])
def test_the_residual_is_below_the_tolerance_whatever_it_is(compiled):
    """In the norm that the solver names; a small correction alone is not enough."""
    for tol in (1e-1, 1e-2, 1e-4):
        for element in (ElementBeamANCF(2), ElementBeamCable(), ElementBeamCable(5)):
            for P in (0.5, 2.0, 4.0):
                scene = loaded(P, element, n=4, compiled=compiled)
                state, s = scene.solve_static(tol=tol), scene.system
                f = s.internal_force(state.u)
                R = (s.external_force(state.u) - f) * s.constraints.mask
                s.assemble(state.u)
                scale = 1.0 / np.abs(s.K.diagonal())
                assert R @ (R * scale) <= 1.05 * tol**2 * (f @ (f * scale))


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("P, most", [(0.5, 12), (3.0, 18)])
def test_iterations_that_are_enough(P, most, compiled):
    """The size of the next correction is foreseen from the last two: few are made in vain."""
    state = loaded(P, n=8, compiled=compiled).solve_static()
    fine = loaded(P, n=8, compiled=compiled).solve_static(tol=1e-12)
    assert len(state.steps) == 1 and state.iterations <= min(most, fine.iterations)
    assert_allclose(state.u, fine.u, rtol=0, atol=1e-8)


def test_a_moved_support_and_a_joint_beside_it_take_no_more_iterations():
    """The joint's equation sees what the support moves in the first step."""
    beams = [Beam(line(3, origin=(k, 0)), ElementBeamCable(), STEEL, 0.1, compiled=False)
             for k in (0, 1)]
    scene = Scene(*beams).clamp("left", beam=0).fix("right", ["r^2"], displacement=0.05, beam=1)
    scene.joint("hinge", beams=(0, 1), at=(1, 0))
    scene.joint("line", at=(2.0, 0.0), direction=(1, 0.2), beam=1, through=(2.0, 0.05))
    state = scene.solve_static()
    assert len(state.steps) == 1 and state.iterations <= 15
    assert_allclose(state.displacement((2, 0), 1), (0.0, 0.05), rtol=0, atol=1e-12)


def test_a_restart_at_the_solution_costs_little():
    """Round-off of slender strains is known to be that: the tolerance is below it."""
    beam = Beam(line(4, 1e-4), ElementBeamCable(5), STEEL, 0.1, compiled=False)
    scene = Scene(beam).clamp("left").point_force((0, -1e-10), at=(1, 0))
    state = scene.solve_static(tol=1e-13)
    assert scene.solve_static(start=state, tol=1e-13).iterations <= 3


def test_a_restart_goes_by_way_of_the_loads_between():
    """Every load step has something to do; the last ends where a new start ends."""
    old, scene = loaded(1.0).solve_static(), loaded(8.0)
    state = scene.solve_static(start=old, first_step=0.25)
    assert len(state.steps) >= 2
    assert min(step.iterations for step in state.steps) >= 1
    assert_allclose(state.u, scene.solve_static().u, rtol=0, atol=1e-7)


def test_a_path_begins_with_any_arc_length():
    """Ten times the size of the scene is cut until it leads somewhere: more than 10 times here."""
    scene = loaded(1.0)
    path = scene.continuation(ds=10.0, steps=1)
    assert len(path) == 2 and 0.05 < path.arc[1] < 1.0
    expected = loaded(path.load[1]).solve_static()
    assert_allclose(path.displacement((1, 0))[1], expected.displacement((1, 0)), rtol=0, atol=1e-6)


# motion


def fails_above(monkeypatch, longest):
    run = Integrator.run

    def only_short(self, y, dt, n, *args):
        if dt > longest:
            return ()
        return run(self, y, dt, n, *args)

    monkeypatch.setattr(Integrator, "run", only_short)
    beam = Beam(line(2), ElementBeamANCF(1), STEEL, 0.1, compiled=False)
    return Scene(beam).pin("left").gravity((0.0, -1.0))


def test_a_step_is_halved_six_times(monkeypatch):
    history = fails_above(monkeypatch, 0.0101 / 64).integrate(0.01, 0.01)
    assert history.t.tolist() == [0.0, 0.01]
    assert np.ptp(history.total_energy) < 1e-13


def test_and_not_more_often(monkeypatch):
    with pytest.raises(ConvergenceError, match=f"nor with steps of {0.01 / 64:.3g}"):
        fails_above(monkeypatch, 0.0099 / 64).integrate(0.01, 0.01)


def test_loads_that_vary_push_in_steps_of_energy_and_momentum():
    """Impulse of a gravity that grows with time, g t^2 / 2: the midpoint rule is exact."""
    beam = Beam(line(2), ElementBeamANCF(2), STEEL, 0.1, compiled=False)
    history = Scene(beam).gravity((0.0, -2.0), amplitude=lambda t: t).integrate(0.2, 0.05)
    assert_allclose(history.momentum[:, 1], -beam.total_mass * history.t**2, rtol=0, atol=1e-13)
    assert_allclose(history.momentum[:, 0], 0.0, rtol=0, atol=1e-13)


def test_acceleration_between_two_steps():
    """A free beam in gravity that grows with time: its acceleration is g t, exactly."""
    beam = Beam(line(2), ElementBeamANCF(2), STEEL, 0.1)
    scene = Scene(beam).gravity((0.0, -2.0), amplitude=lambda t: t)
    times = np.array([0.105, 0.125, 0.19, 0.2])
    history = scene.integrate(0.2, 0.1, "generalized-alpha", t_eval=times)
    fall = history.acceleration.reshape(len(times), -1, beam.nd)[:, :, 1]
    assert_allclose(fall, np.outer(-2.0 * times, np.ones(3)), rtol=0, atol=1e-9)


# files


def test_an_interrupted_series_keeps_its_list(tmp_path, monkeypatch):
    state = loaded(1.0).solve_linear()
    write = Path.write_text
    with PvdWriter(tmp_path / "run.pvd", subdivide=(1, 1)) as series:
        series.add(state, 0.0)
        before = series.path.read_bytes()

        def broken(self, text, **options):
            write(self, text[:len(text) // 2], **options)
            raise OSError("disk full")

        monkeypatch.setattr(Path, "write_text", broken)
        with pytest.raises(OSError, match="disk full"):
            series.add(state, 1.0)
        monkeypatch.undo()
        assert series.path.read_bytes() == before
        assert not [f for f in tmp_path.iterdir() if f.suffix not in (".pvd", ".vtu")]


# lines that no other test runs, or does not notice


def test_what_a_unit_of_load_drives():
    """Of supports and joints that move with it: by differences of residual and constraints."""
    left = Beam(line(2), ElementBeamANCF(2), STEEL, 0.1, name="left")
    right = Beam(line(2, origin=(1.0, 0.0)), ElementBeamANCF(2), STEEL, 0.1, name="right")
    scene = Scene(left, right).clamp("left", "left")
    scene.joint(Weld(beams=("left", "right"), at=((1.0, 0.0), (1.0, 0.0))))
    scene.joint(PrescribedAngle("right", lambda t: 0.3 * t, "right"))
    scene.fix("left", "r^2", displacement=0.02, beam="right").gravity((0.0, -10.0))
    system, load = scene.system, 0.7
    u = 1e-3 * np.random.default_rng(1).standard_normal(system.N)
    moved = np.zeros(system.N)
    c = system.constraints
    moved[c.fixed] = c.values(1.0) - c.values(0.0)
    assert moved.any() and system.constraints.drives
    external = system.external_force(u)
    system.assemble(u, load)
    drive, gap = Tracer(system, 1e-9, 20)._drive(external, u, load)

    def residual(s):
        return (load + s) * external - system.internal_force(u + s * moved, load + s)

    def phi(s):
        return system.constraints.constraint(u + s * moved, load + s)

    h = 1e-5
    expected = (residual(h) - residual(-h)) / (2 * h)
    assert_allclose(drive, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert np.abs(gap).max() > 0.01
    assert_allclose(gap, (phi(-h) - phi(h)) / (2 * h), rtol=0, atol=1e-8)


def bent():
    lines = [(0, 1), (1, 2), (2, 3)]
    return Frame.from_lines([(0, 0), (0, 1), (1, 1), (1, 0)], lines, material=STEEL, height=0.1,
                            width=0.1).clamp([0, 3])


def test_second_differences_of_the_nodes_of_a_frame():
    """Equations of nodes are quadratic: second differences are exact."""
    system = bent().system
    u, v = 0.1 * np.random.default_rng(2).standard_normal((2, system.N))
    phi = [system.constraints.constraint(u + s * v, 0.0) for s in (-1.0, 0.0, 1.0)]
    expected = phi[0] - 2.0 * phi[1] + phi[2]
    assert np.abs(expected).max() > 1e-3
    found = np.zeros(system.constraints.m)
    system.constraints.add_custom_joints(4, 0.0, u, v, found)
    assert_allclose(found, expected, rtol=0, atol=1e-13)


def test_a_moment_at_a_node_turns_as_its_node():
    frame = bent().moment(1, 2.0)
    state = frame.solve_static()
    (load,) = frame.system.loads
    s = frame.system.slices[0]
    turned = frame.rotations(state)[1]
    assert 0.005 < turned < 1.0
    assert load.angle(state.u[s]) == pytest.approx(turned, rel=1e-9)
    assert load.potential(state.u[s]) == pytest.approx(-2.0 * turned, rel=1e-9)


def test_tangent_of_a_moment_that_varies():
    """At a time the stiffness of a moment is that of what it is then, times the load."""
    def tangent(M, amplitude, *args, **options):
        scene = Scene(Beam(line(2), ElementBeamANCF(2), STEEL, 0.1)).clamp("left")
        system = scene.moment("right", M, amplitude=amplitude).system
        u = 0.1 * np.random.default_rng(3).standard_normal(system.N)
        system.assemble(u, *args, **options)
        return system.K.toarray()

    expected = tangent(30.0, None, 0.5)
    assert np.abs(tangent(0.0, None) - expected).max() > 1e-5 * np.abs(expected).max()
    assert_allclose(tangent(10.0, lambda t: 3.0 * t, 0.5, t=1.0), expected, rtol=1e-12,
                    atol=1e-12 * np.abs(expected).max())


def test_slope_of_a_joint_that_does_not_say_it():
    class Plain(PrescribedAngle):
        slope_entries = Joint.slope_entries

    found = []
    for kind in (PrescribedAngle, Plain):
        scene = Scene(Beam(line(2), ElementBeamANCF(2), STEEL, 0.1)).pin("left")
        joint = scene.joint(kind("right", lambda t: 0.3 * t))
        N = scene.system.N
        _, columns, values = joint.slope_entries(np.array([0.0, 1.0, 2.0]), N)
        dense = np.zeros((3, N))
        for out, row in zip(dense, values):
            np.add.at(out, columns, row)
        found.append(dense)
    assert np.ptp(found[0], axis=0).max() > 0.1
    assert_allclose(found[1], found[0], rtol=0, atol=1e-14)


def test_a_density_at_points_that_differ_from_section_to_section():
    def density(e, xi, eta):
        return np.array([(1 + e) * (xi + eta**2), xi * eta - e])

    e, p, q = np.array([0, 2]), np.array([0.1, 0.5, 0.9]), np.array([0.0, 0.4, 1.0])
    sampled = Sampled(BODY, e, p, density(e[:, None, None], p[:, None], q), q)
    at, xi = np.array([0, 2, 2, 1]), np.array([0.3, 0.0, 0.7, 0.5])
    for eta in (np.array([[0.2, 0.9], [0.1, 0.3], [0.5, 0.6], [0.2, 0.2]]),
                np.tile([0.2, 0.9], (4, 1))):
        expected = density(at[:, None], xi[:, None], eta)
        expected[:, 3] = 0.0
        assert_allclose(sampled.at(at, xi, eta, 3), expected, rtol=0, atol=1e-13)


def test_heights_of_halved_elements():
    def cubic(x):
        return 1.0 + x - 2.0 * x**2 + 0.5 * x**3

    heights = np.array([cubic(PLACES), cubic(1.0 + PLACES)]).T
    found = halved(heights, np.array([False, True]))
    expected = [cubic(PLACES), cubic(1.0 + PLACES / 2), cubic(1.5 + PLACES / 2)]
    assert_allclose(found.T, expected, rtol=1e-13)


def test_refined_meshes_without_their_curve_have_the_same_points(tmp_path):
    """Children of elements with cubic sections: their map is that of the parent."""
    mesh = MeshBeam.init_curve(lambda s: np.array([2 * s + 0.2 * s**2, 0.4 * np.sin(2.5 * s)]),
                               [-1.0, -0.2, 0.8], 0.2).with_sections("cubic")
    mesh.save(tmp_path / "mesh.npz")
    mesh = MeshBeam.load(tmp_path / "mesh.npz")
    assert mesh.curve is None
    fine = mesh.refined([0])
    X = np.array([[0.1, 0.6, 1.0], [0.1, 0.9, 0.3]])
    for child, begin in ((0, 0.0), (1, 0.5)):
        there = np.array([begin + X[0] / 2, X[1]])
        assert_allclose(fine.mapping().F(X, np.array([child])),
                        mesh.mapping().F(there, np.array([0])), rtol=0, atol=1e-13)


def test_small_beams_that_do_not_meet_are_not_welded():
    """A gap counts against the beams' size, not against a unit of length."""
    size, gap = 1e-2, 1e-7
    left = Beam(line(1, 1e-3, size), ElementBeamANCF(2), STEEL, 0.1, name="left")
    for far in (False, True):
        right = Beam(line(1, 1e-3, size, origin=(size + gap * (1.0 if far else 0.01), 0.0)),
                     ElementBeamANCF(2), STEEL, 0.1, name="right")
        scene = Scene(left, right)
        weld = Weld(beams=("left", "right"), at=("right", "left"))
        if far:
            with pytest.raises(InputError, match="apart"):
                scene.joint(weld)
        else:
            scene.joint(weld)


def test_mean_stiffness_below_one():
    """It has the unit of the scene: 1 stands for none only."""
    sizes = np.array([1.0, 2.0])
    assert mean_stiffness(np.array([1e-3, 2e-3]), sizes) == pytest.approx(4.5e-3)
    assert mean_stiffness(np.zeros(2), sizes) == 1.0


def test_energy_of_bodies_on_springs():
    """Stiffness times the square of the size, and force times the size."""
    def asked(k, weight):
        body = RigidBody(1.0, 0.5, position=(0.0, -2.0))
        scene = Scene(body).gravity((0.0, -weight))
        system = (scene.spring(k, [(0.0, 0.0), (body, (0.0, -2.0))]) if k else scene).system
        return system.scales.energy_of_bodies, system.size

    for k, weight in ((7.0, 3.0), (7.0, 0.0), (0.0, 3.0)):
        energy, size = asked(k, weight)
        assert energy == pytest.approx(k * size**2 + weight * size, rel=1e-12)
    assert asked(0.0, 0.0)[0] == 1.0


@pytest.mark.parametrize("part, far", [(0.9, False), (1.1, True)])
def test_corrections_far_against_the_way_of_a_step(part, far):
    system = Scene(Beam(line(2), ElementBeamANCF(2), STEEL, 0.1)).system
    v, dt = np.random.default_rng(4).standard_normal(system.N), 0.2
    x = SimpleNamespace(du=part * steps.FAR * dt * v, scratch=np.zeros(system.N))
    w = SimpleNamespace(x=x, y=np.array([0.0 * v, v]))
    assert steps._far(system.mass, SimpleNamespace(dt=dt), w) == far


def test_mass_of_a_tapered_round_rod():
    """A frustum: its width is a part of the height everywhere."""
    mesh = line(3, lambda x: 0.2 - 0.1 * x, 1.5)
    beam = Beam(mesh, ElementBeamANCF(2), STEEL, section=Section.profile("circle"))
    a, b = 0.1, 0.025
    assert beam.total_mass == pytest.approx(np.pi * 1.5 / 3 * (a * a + a * b + b * b), rel=1e-12)
