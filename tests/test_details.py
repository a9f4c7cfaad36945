"""Details that change results or costs and that no other test sees: a factor, a sign, a bound.

Each of these tests was written against a mutant in benchmarks/mutation/named.py that the others
let live.
"""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import Basis, Functional, asm

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, ElementBeamPatelShabana, MeshBeam, MeshError, Scene,
                        StVenantKirchhoff, SupportError, forms)
from skfem_ancf.dynamics.integrate import Integrator
from skfem_ancf.io import PvdWriter
from skfem_ancf.quadrature import gauss, tensor
from skfem_ancf.statics import newton

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
    body = Basis(beam.mesh, beam.vector_element, quadrature=(X, W))
    axis = Basis(beam.mesh, beam.vector_element, quadrature=(X * [[1], [0]] + [[0], [0.5]], W))
    # the axis' part is an integral along the axis, times h b
    rule = tensor(gauss(5), (np.array([0.5]), np.ones(1)))
    thin = Basis(beam.mesh, beam.vector_element, quadrature=rule)
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
    basis = Basis(beam.mesh, beam.vector_element, quadrature=tensor(gauss(12), gauss(12)))
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


@pytest.mark.filterwarnings("ignore:the mesh is too coarse")  # 4 elements
def test_cubic_cables_are_held_firmly_enough():
    """A tenth of the stabilisation: 16 iterations, and 4 elements at a wrong equilibrium."""
    for n, error in ((4, 0.05), (8, 0.01), (16, 1e-3)):
        for h in (1e-2, 1e-4):
            beam = Beam(line(n, h), ElementBeamCable(),
                        StVenantKirchhoff(2e8 * (0.01 / h)**3, 0.3, 78 / h), 0.01)
            state = Scene(beam).clamp("left").gravity((0, -9.81)).solve_static()
            assert abs(state.displacement((1, 0))[1] + 0.9032) < error
            assert state.iterations <= (12 if n == 4 else 10)


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
            found, where = beam.locate(x)
            assert found == e
            assert_allclose(where, X, rtol=0, atol=1e-9)


def test_round_off_has_units():
    """Its squares are energies: in another unit of length, u, with E / u^2, they are u times."""
    def noise(unit):
        beam = Beam(line(4, 0.1 * unit, L=unit), ElementBeamANCF(2),
                    StVenantKirchhoff(1e6 / unit**2, 0.3), 0.1 * unit)
        s = Scene(beam).clamp("left").system
        return np.array([s.work_noise, s.stiffness_scale])

    assert_allclose(noise(1e3)**2, 1e3 * noise(1.0)**2, rtol=1e-12)


# rigid motions, supports and joints


@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(4),
                                     ElementBeamPatelShabana()], ids=repr)
def test_a_moved_beam_has_no_force_at_all(element):
    """Exactly: the rows of both nodes cancel to the bit, wherever the beam goes."""
    mesh = MeshBeam.init_line([0, 0.1, 0.35, 1.0], 1e-3, angle=0.3)
    beam = Beam(mesh, element, STEEL, 0.1, compiled=False)
    u = np.zeros(beam.N).reshape(-1, beam.nd)
    u[:, :2] = 2.0**20, -2.0**17  # products with them are exact
    for t in beam.kernel.tables:
        assert np.all(t.pack.table[..., 0] + t.pack.table[..., element.nodal_dofs] == 0)
    assert np.max(np.abs(beam.kernel.force(u.ravel()))) == 0.0


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
    assert len(apart.system.constraints.stiff[1]) == 0
    two = [Beam(line(4, 0.1 * unit, L=unit, origin=(k * unit, 0)), ElementBeamCable(),
                StVenantKirchhoff(1e6 / unit**2, 0.3), 0.1 * unit) for k in (0, 1)]
    joined = Scene(*two).clamp("left", beam=0)
    joined.joint("weld", beams=(0, 1), at=("right", "left"))
    joined.point_force((0, -0.01), at=(2 * unit, 0), beam=1)
    tip = joined.solve_linear().displacement((2 * unit, 0), 1)[1] / unit
    assert tip == pytest.approx(-8 * 4e-4, rel=0.05)
    assert len(joined.system.constraints.stiff[1]) == 4  # on the beam that only the joint holds


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


@pytest.mark.parametrize("tilt, gap, word", [
    (1e-13, 0.0, "repeats"), (1e-13, 1e-13, "repeats"), (0.0, 1e-6, "contradicts")])
def test_lines_that_differ_by_round_off_are_one(tilt, gap, word):
    with pytest.raises(SupportError, match=f"second.*{word}"):
        guided(tilt, gap).solve_static()


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
                R = (s.external_force(state.u) - f) * s.mask
                s.assemble(state.u)
                scale = 1.0 / np.abs(s.K.diagonal())
                assert R @ (R * scale) <= 1.05 * tol**2 * (f @ (f * scale))


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("P, most", [(0.5, 4), (3.0, 6)])
def test_iterations_that_are_enough(P, most, compiled):
    """The size of the next correction is foreseen from the last two: none is made in vain."""
    state = loaded(P, n=8, compiled=compiled).solve_static()
    fine = loaded(P, n=8, compiled=compiled).solve_static(tol=1e-12)
    assert len(state.steps) == 1 and state.iterations <= most
    assert_allclose(state.u, fine.u, rtol=0, atol=1e-8)


def test_a_moved_support_and_a_joint_beside_it_take_no_more_iterations():
    """The joint's equation sees what the support moves in the first step."""
    beams = [Beam(line(3, origin=(k, 0)), ElementBeamCable(), STEEL, 0.1, compiled=False)
             for k in (0, 1)]
    scene = Scene(*beams).clamp("left", beam=0).fix("right", ["r^2"], displacement=0.05, beam=1)
    scene.joint("hinge", beams=(0, 1), at=(1, 0))
    scene.joint("line", at=(2.0, 0.0), direction=(1, 0.2), beam=1, through=(2.0, 0.05))
    state = scene.solve_static()
    assert len(state.steps) == 1 and state.iterations <= 5
    assert_allclose(state.displacement((2, 0), 1), (0.0, 0.05), rtol=0, atol=1e-12)


def test_a_restart_at_the_solution_costs_one_correction():
    """Round-off of slender strains is known to be that: the tolerance is below it."""
    beam = Beam(line(4, 1e-4), ElementBeamCable(5), STEEL, 0.1, compiled=False)
    scene = Scene(beam).clamp("left").point_force((0, -1e-10), at=(1, 0))
    state = scene.solve_static(tol=1e-13)
    assert scene.solve_static(start=state, tol=1e-13).iterations <= 1


def test_a_restart_goes_by_way_of_the_loads_between():
    """Every load step has something to do; the last ends where a new start ends."""
    old, scene = loaded(1.0).solve_static(), loaded(8.0)
    state = scene.solve_static(start=old, first_step=0.25)
    assert len(state.steps) >= 2
    assert min(step.iterations for step in state.steps) >= 2
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
