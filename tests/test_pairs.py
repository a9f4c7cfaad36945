"""Contact of beams, rigid bodies and domains with each other."""

import copy
import pickle
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, LinearForm, MeshQuad
from skfem.helpers import ddot, sym_grad

from skfem_ancf import (Beam, BodyContact, Domain, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, Frame, InputError, MeshBeam, ModelWarning, RigidBody,
                        Scene, StVenantKirchhoff)
from skfem_ancf.actions.bound import recalled
from skfem_ancf.actions.contact import contacts, kernels, pairs
from skfem_ancf.actions.contact.tables import is_clear
from skfem_ancf.actions.forces import kernels as pair_forces, system as forces_of_scene
from skfem_ancf.actions.obstacles import Circle, Line
from skfem_ancf.actions.pairs import search
from skfem_ancf.actions.pairs.search import stretches_of
from skfem_ancf.beam.layout import Layout
from skfem_ancf.scene.quasistatic import drag_of

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import stress

ELEMENTS = (ElementBeamANCF(2), ElementBeamANCFCubic(1), ElementBeamCable(3), ElementBeamCable(5))
STEEL = StVenantKirchhoff(2e11, 0.0, 7800.0)
RUBBER = StVenantKirchhoff(1e7, 0.0, 1000.0)


def line(length, n, height, origin=(0.0, 0.0), element=ELEMENTS[2], material=STEEL, angle=0.0,
         width=0.02):
    mesh = MeshBeam.init_line(np.linspace(0.0, length, n + 1), height=height, origin=origin,
                              angle=angle)
    return Beam(mesh, element, material, width=width)


def strips(element, friction=0.0):
    """The contact of two strips bound to them, and positions at which they touch."""
    beams = [line(0.5, 3, 0.01, (0.0, y), element) for y in (0.0, -0.0102)]
    layout = Layout(*beams)
    u = 3e-4 * layout.sizes * np.cos(np.arange(layout.N))
    u[1:beams[0].N:beams[0].nd] -= 6e-4
    contact = recalled(BodyContact(friction=friction).bound_on(layout)[0])
    if friction:
        x = u.reshape(-1, 2)
        contact.accept(x, x, 0.0 * x, 0.0)
        u[0:beams[0].N:beams[0].nd] += 2e-6
    d = layout.sizes * np.random.default_rng(0).standard_normal(layout.N)
    return contact, beams, u.reshape(-1, 2), d.reshape(-1, 2)


def crossed(join=lambda scene: None, right=0.5, held=True):
    """A beam of length 1, one across it at (0.5, 0), and what joins them."""
    beams = [line(1.0, 8, 0.02), line(0.5 + right, 10, 0.02, (0.5, -0.5), angle=0.5 * np.pi)]
    scene = Scene(*beams).clamp("left", 0).contact("all")
    if held:
        scene.clamp("left", 1)
    join(scene)
    return scene


@pytest.mark.parametrize("join", [
    lambda s: s.hinge((0.5, 0)), lambda s: s.weld((0, (0.5, 0)), (1, (0.5, 0))),
    lambda s: s.spring(1e5, [(0, (0.5, 0)), (1, (0.5, 0))], length=0),
    lambda s: s.pin((0.5, 0), beam=0).pin((0.5, 0), beam=1)],
    ids=["hinge", "weld", "spring", "pins"])
@pytest.mark.parametrize("right", [0.5, 0.0])
def test_members_that_meet_unjoined_are_said_to(join, right):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        assert crossed(join, right).system
    with pytest.warns(ModelWarning, match=r"beam 0 meets beam 1 near \(0.5, 0\) in the ref"):
        assert crossed(right=right).system
    with pytest.warns(ModelWarning, match="nothing joins them there"):  # joined elsewhere
        assert crossed(lambda s: s.spring(1e5, [(0, "right"), (1, "left")]), right).system


def test_a_beam_that_ends_in_a_body_is_joined_by_one_weld_to_it():
    """Also where its elements enter the body, far from the weld."""
    beam, side = line(1.0, 8, 0.02), np.array([-0.3, 0.3, 0.3, -0.3])
    body = RigidBody(1.0, 0.1, (1.0, 0.0), outline=np.column_stack([side, [-0.1, -0.1, 0.1, 0.1]]))
    scene = Scene(beam, body).clamp("left", 0).obstacle(Line((0, -1))).contact("all")
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        scene.weld((0, "right"), (1, (1.0, 0.0)))
        assert scene.system
    with pytest.warns(ModelWarning, match="beam 0 meets the rigid body 1 near"):
        assert Scene(beam, body).clamp("left", 0).contact("all").system


@pytest.mark.parametrize("n", [1, 2])
def test_long_elements_that_are_hinged_inside_are_no_crossing(n):
    beams = [line(1.0, n, 0.005), line(0.8, n, 0.005, (0.3, 0.4), angle=-0.5 * np.pi)]
    scene = Scene(*beams).pin("left", 0).gravity((0, -9.81)).contact("all")
    scene.hinge((0.3, 0.0))
    history = scene.integrate(0.02, 2e-3)
    assert not len(history.state(-1).contact())
    assert np.ptp(history.total_energy) < 1e-10 * np.abs(history.kinetic_energy).max()


def test_a_frame_of_one_element_a_line_may_touch_itself():
    """At a node lines overlap within their heights, and are joined there."""
    frame = Frame.from_lines([(0, 0), (1, 0), (2, 0), (1, 1)], [(0, 1), (1, 2), (1, 3)], elements=1,
                             element=ElementBeamCable(3), material=STEEL, width=0.02, height=0.02)
    frame.clamp(0).contact("all", self_contact=True)
    assert not len(frame.point_force((0, -100.0), at=2).solve_static().contact())


def test_ends_of_a_ring_that_meet_unjoined_are_said_to():
    a = np.linspace(0.0, 2.0 * np.pi, 33)
    mesh = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]), a, height=0.02)
    scene = Scene(Beam(mesh, ELEMENTS[0], STEEL, width=0.02)).contact(0, self_contact=True)
    with pytest.warns(ModelWarning, match="the beam meets itself near"):
        assert scene.system


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_force_stiffness_and_potential_agree(element, friction):
    contact, _, x, d = strips(element, friction)
    s = 1e-7
    change = (contact.force(x + s * d, 0 * x, 0.0) - contact.force(x - s * d, 0 * x, 0.0)) / (2 * s)
    slope = (contact.stiffness(x, 0 * x, 0.0) @ d.ravel()).reshape(x.shape)
    size = np.abs(change).max()
    assert_allclose(slope, change, rtol=0, atol=(2e-5 if friction else 3e-9) * size)
    if not friction:
        work = np.sum(contact.force(x, 0 * x, 0.0) * d)
        gain = contact.potential_at(x + s * d, 0.0) - contact.potential_at(x - s * d, 0.0)
        assert gain / (2 * s) == pytest.approx(-work, rel=1e-8)


@pytest.mark.parametrize("slip", [1e-6, 1e-5], ids=["sticking", "slipping"])
@pytest.mark.parametrize("place", [(6.3e-4, 6.3e-4), (8.2e-4, 4.7e-4)], ids=["middle", "side"])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_stiffness_of_friction_on_rounded_corners(element, place, slip):
    """The direction of friction turns along the arc, and the speed there changes the slip."""
    beams = [line(0.5, 3, 0.02, (0.0, 0.0), element),
             line(0.4, 3, 0.02, (0.5103, 0.0103), element, angle=np.pi / 2)]
    layout = Layout(*beams)
    contact = recalled(BodyContact(friction=0.3).bound_on(layout)[0])
    u, (x, y) = 1e-6 * layout.sizes * np.cos(np.arange(layout.N)), (
        slice(beams[0].N + k, None, beams[1].nd) for k in range(2))
    u[x] -= place[0]
    u[y] -= place[1]
    contact.accept(u.reshape(-1, 2), u.reshape(-1, 2), 0.0 * u.reshape(-1, 2), 0.0)
    u[x] += slip
    u[y] -= slip
    u, d = u.reshape(-1, 2), layout.sizes * np.random.default_rng(0).standard_normal(layout.N)
    sticks = contact.look(u, 0.0, contact.history)[5]
    assert len(sticks) >= 2 and np.all(sticks == (slip < 5e-6))
    s, d = 1e-8, d.reshape(-1, 2)
    change = (contact.force(u + s * d, 0 * u, 0.0) - contact.force(u - s * d, 0 * u, 0.0)) / (2 * s)
    slope = (contact.stiffness(u, 0 * u, 0.0) @ d.ravel()).reshape(u.shape)
    assert_allclose(slope, change, rtol=0, atol=5e-5 * np.abs(change).max())


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_a_mean_force_has_no_resultant_and_exact_work(element, friction):
    contact, beams, x, d = strips(element, friction)
    y = x + 1e-5 * d
    force = contact.mean_force(x, y, 0.0, 1.0)
    middle = np.concatenate([b.q0 for b in beams]).reshape(-1, 2) + 0.5 * (x + y)
    moments = middle[:, 0] * force[:, 1] - middle[:, 1] * force[:, 0]
    assert abs(moments.sum()) < 1e-12 * np.abs(moments).sum()
    places = force.reshape(-1, beams[0].nd // 2, 2)[:, 0]
    assert_allclose(places.sum(axis=0), 0.0, atol=1e-12 * np.abs(places).sum())
    gain = contact.potential_at(y, 0.0) - contact.potential_at(x, 0.0)
    lost = contact.accept(x, y, 0.0 * y, 0.0)
    assert np.sum(force * (y - x)) == pytest.approx(-gain - lost, rel=1e-9)
    assert lost > 1e-3 * abs(gain) if friction else abs(lost) < 1e-9 * abs(gain)


def test_a_cantilever_on_a_shorter_one():
    """They touch at the end of the shorter one: Euler-Bernoulli in closed form."""
    E, b, h, L, a, F = 2e11, 0.02, 0.01, 1.0, 0.6, 5.0
    scene = Scene(line(L, 10, h), line(a, 6, h, (0.0, -h))).clamp("left", 0).clamp("left", 1)
    scene.contact(0, 1).point_force((0.0, -F), at=(L, 0.0), beam=0)
    state = scene.solve_static()
    EI, push = E * b * h**3 / 12, F * (3 * L / a - 1) / 4
    tip = (F * L**3 - push * a * a * (3 * L - a) / 2) / (3 * EI)
    assert state.displacement("right", 0)[1] == pytest.approx(-tip, rel=2e-3)
    for on, sign in ((0, 1.0), (1, -1.0)):
        found = state.contact(on=on)
        assert found.total[1] == pytest.approx(sign * push, rel=5e-3)
        where = found.force[1] @ found.points[0] / found.total[1]
        assert where == pytest.approx(a, rel=1e-3) and found.penetration < 0.01 * h
    assert_allclose(state.contact().total, 0.0, atol=1e-9 * push)
    assert str(state.verdict) == "stable" and np.all(scene.modes(2, state).frequencies > 0)


@pytest.mark.parametrize("element", [ELEMENTS[2], ElementBeamANCF(3)], ids=repr)
def test_section_forces_of_members_that_touch(element):
    """Where the shorter of two cantilevers ends, the shear force of the longer one jumps."""
    h, L, a, F = 0.01, 1.0, 0.6, 5.0
    scene = Scene(line(L, 10, h, element=element), line(a, 6, h, (0.0, -h), element))
    scene = scene.clamp("left", 0).clamp("left", 1).contact(0, 1, friction=0.1)
    state = scene.point_force((0.0, -F), at=(L, 0.0), beam=0).solve_static()
    push = F * (3 * L / a - 1) / 4  # F at this ratio of lengths, see above
    for beam, y, values in ((0, 0.0, {0.11: push - F, 0.47: push - F, 0.73: -F, 0.97: -F}),
                            (1, -h, {0.11: -push, 0.47: -push})):
        for x, value in values.items():
            assert state.resultants((x, y), beam).force[1] == pytest.approx(value, abs=5e-3 * push)
        root = state.reactions("left", beam)
        first = state.resultants((0.0, y), beam)
        assert_allclose(first.force, -np.array(root.force), atol=1e-6 * F)
        assert first.M == pytest.approx(-root.moment, abs=1e-6 * F)
    assert state.resultants((0.0, -h), 1).M == pytest.approx(-push * a, rel=5e-3)


@pytest.mark.parametrize("element", [ELEMENTS[2], ElementBeamANCF(3)], ids=repr)
def test_section_forces_of_leaves_that_touch_at_their_ends(element):
    """Each carries half; the points that touch are next to the ends, some just beyond."""
    h, L, F = 0.01, 0.5, 20.0
    scene = Scene(*(line(L, 8, h, (0.0, -k * h), element) for k in range(2))).contact("all")
    scene.clamp("left", 0).clamp("left", 1)
    state = scene.point_force((0.0, -F), at="right", beam=0).solve_static()
    for x in (0.03, 0.31):
        forces = [state.resultants((x, -k * h), k).force for k in range(2)]
        assert_allclose(np.array(forces)[:, 1], -F / 2, rtol=0.02)
        assert_allclose(np.sum(forces, axis=0), [0.0, -F], atol=1e-6 * F)


@pytest.mark.parametrize("element", [*ELEMENTS[1:], ElementBeamANCF(3)], ids=repr)
@pytest.mark.parametrize("n", [2, 3])
def test_leaves_without_friction_are_so_many_springs(n, element):
    h, L = 0.01, 0.5
    scene = Scene(*(line(L, 8, h, (0.0, -k * h), element) for k in range(n))).contact("all")
    for k in range(n):
        scene.clamp("left", k)
    stiffness = n * 3 * 2e11 * 0.02 * h**3 / 12 / L**3
    scene.point_force((0.0, -2e-3 * stiffness), at=(L, 0.0), beam=0)
    state = scene.solve_static()
    assert state.displacement("right", 0)[1] == pytest.approx(-2e-3, rel=5e-3)
    assert state.contact().penetration < 0.01 * h


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=repr)
def test_an_impact_keeps_energy_and_momenta(element, friction):
    beams = [line(1.0, 4, 0.05, (0.0, 0.0), element, RUBBER),
             line(1.0, 4, 0.05, (0.4, 0.06), element, RUBBER, angle=0.1)]
    scene = Scene(*beams).contact("all", friction=friction)
    scene.initial_velocity((0.0, -2.0), 1)
    history = scene.integrate(0.02, 4e-4)
    energy = history.total_energy + history.dissipated
    assert np.ptp(energy) < 1e-11 * energy[0]
    for momentum in (history.momentum, history.angular_momentum):
        assert np.ptp(momentum, axis=0).max() < 1e-11 * np.abs(momentum).max()
    assert np.abs(history.u[-1][:beams[0].N]).max() > 1e-3  # they have touched
    assert (history.dissipated[-1] > 1e-4 * energy[0]) == (friction > 0.0)


@pytest.mark.parametrize("dt", [1e-3, 2e-4])
def test_what_bounces_on_a_member_slides_by_coulombs_law(dt):
    """Friction acts in the steps in which points begin to touch or part, as on an obstacle."""
    rubber, mu, g, end = StVenantKirchhoff(1e9, 0.0, density=1000.0), 0.2, 9.81, 0.04
    block = Beam(MeshBeam.init_line(np.linspace(0.4, 0.6, 2), height=0.02, origin=(0.0, 0.01001)),
                 ElementBeamANCF(2), rubber, width=0.02)
    floor = Beam(MeshBeam.init_line(np.linspace(0.0, 2.0, 3), height=0.1, origin=(0.0, -0.05)),
                 ElementBeamANCF(2), rubber.replace(E=1e10), width=0.02)
    scene = Scene(block, floor).contact("all", friction=mu, stiffness=1e9).clamp("left", 1)
    scene.clamp("right", 1).gravity((0.0, -g)).initial_velocity((1.0, 0.0), 0)
    history = scene.integrate(end, dt)
    lost = 1.0 - history.state(-1).displacement("left", 0)[0] / end
    total = history.total_energy + history.dissipated
    assert lost == pytest.approx(0.5 * mu * g * end, rel=0.1)
    assert np.ptp(total) < 1e-9 * total[0]


def test_rods_that_collide_lengthwise_part_after_two_passages():
    """St. Venant (1867): equal rods exchange their velocities in the time 2 L / c."""
    c, L, v, gap = 100.0, 1.0, -1.0, 2e-4
    beams = [line(L, 16, 0.05, (x, 0.0), ElementBeamANCF(2), RUBBER) for x in (0.0, L + gap)]
    scene = Scene(*beams).contact("all")
    scene.initial_velocity((v, 0.0), 1)
    t = np.linspace(0.0, 0.03, 61)
    history = scene.integrate(0.03, 2.5e-4, t_eval=t)
    mass = 0.5 * history.momentum[0, 0] / v
    momenta = []
    for k in range(len(t)):
        state, s = history.state(k), scene.system.slices[0]
        momenta.append(scene.system.mass.multiply(np.where(
            np.arange(scene.N) < s.stop, state.v, 0.0))[0:s.stop:beams[0].nd].sum())
    share = np.array(momenta) / history.momentum[0, 0]
    begin, end = (np.interp(level, share, t) for level in (0.1, 0.9))
    assert mass > 0.0 and share[-1] == pytest.approx(1.0, abs=0.03)
    assert end - begin == pytest.approx(0.8 * 2 * L / c, rel=0.03)
    assert np.ptp(history.total_energy) < 1e-10 * history.total_energy[0]
    assert_allclose(history.momentum[:, 0], history.momentum[0, 0], rtol=1e-11)


def test_two_leaves_with_friction_have_a_loop():
    """Coulomb in closed form: 1 / (1 -+ 3 mu h / 4 L) times the stiffness that they have without.
    """
    h, L, mu, ends = 0.05, 0.5, 0.3, [1.0, 1.8]
    stiffness, slopes = 2 * 3 * 2e11 * 0.02 * h**3 / 12 / L**3, []
    for friction in (0.0, mu):
        scene = Scene(*(line(L, 8, h, (0.0, -k * h), ElementBeamANCFCubic(1)) for k in range(2)))
        scene.clamp("left", 0).clamp("left", 1).contact("all", friction=friction)
        scene.point_force((0.0, -1e-3 * stiffness), at="right", beam=0,
                          amplitude=lambda t: np.interp(t, [0.0, *ends], [0.0, 1.0, 0.2]))
        run = scene.run(ends, increments=5)
        tip = run.displacement("right", 0)[:, 1] / -1e-3
        slopes.append((0.2 / (tip[5] - tip[4]), 0.16 / (tip[7] - tip[8])))
    share = 3 * mu * h / (4 * L)
    assert slopes[1][0] / slopes[0][0] == pytest.approx(1 / (1 - share), abs=2e-3)
    assert slopes[1][1] / slopes[0][1] == pytest.approx(1 / (1 + share), abs=2e-3)
    work = -1e-3 * 1e-3 * stiffness * trapezoid(
        [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.84, 0.68, 0.52, 0.36, 0.2], -tip)
    state = run.state(10)
    assert run.dissipated[10] == pytest.approx(work - state.strain_energy, rel=0.15)
    assert np.all(np.diff(run.dissipated)[1:] > 0.0) and not state.contact().sticking.all()


def test_a_rigid_plate_lies_on_a_cantilever():
    weight, half = 2.0 * 9.81, np.array([[-0.05, 0.05, 0.05, -0.05], [-0.05, -0.05, 0.05, 0.05]])
    plate = RigidBody(2.0, 0.01, (0.9, 0.06), outline=half)
    beam = line(1.0, 8, 0.02, element=ElementBeamCable(5))
    scene = Scene(beam, plate).clamp("left", 0).fix(None, "r^1", 0.0, plate)
    state = scene.contact(beam, plate).gravity((0.0, -9.81)).solve_static()
    found = state.contact(on=plate)
    assert found.total[1] == pytest.approx(weight, rel=1e-6)
    assert_allclose(found.total, -state.contact(on=beam).total, rtol=1e-9, atol=1e-9 * weight)
    assert 0.849 < found.points[0].min() < found.points[0].max() < 0.951
    arm = found.force[1] @ found.points[0] / weight  # deflection there, and by its own weight
    EI, q = 2e11 * 0.02 * 0.02**3 / 12, 7800 * 9.81 * 0.02 * 0.02
    tip = weight * arm**2 * (3 - arm) / 6 / EI + q / 8 / EI
    assert state.displacement("right", 0)[1] == pytest.approx(-tip, rel=5e-3)


def test_a_beam_presses_on_a_domain():
    def law(u, v):
        return 5e5 * ddot(sym_grad(u), sym_grad(v))

    mesh = MeshQuad.init_tensor(np.linspace(0, 1, 9), np.linspace(-0.2, -0.02, 3)).with_defaults()
    block = Domain(Basis(mesh, ElementVector(ElementQuad2())),
                   LinearForm(lambda v, w: law(w["u"], v)), BilinearForm(lambda u, v, w: law(u, v)))
    beam = line(1.0, 8, 0.02, element=ElementBeamCable(5),
                material=StVenantKirchhoff(1e8, 0.0, 1000.0), width=0.05)
    scene = Scene(beam, block).clamp("bottom", block).clamp("left", 0).contact(beam, block)
    state = scene.point_force((0.0, -5.0), at="right", beam=0).solve_static()
    found, supports = state.contact(on=block), state.reactions("bottom", block).force
    assert_allclose(found.total, -supports, rtol=1e-6, atol=1e-6)
    assert found.total[1] < -4.0 and found.penetration < 0.01 * 0.02
    assert abs(state.contact(on=beam).total + found.total).max() < 1e-9


def test_a_ring_is_pressed_flat_until_it_touches_itself():
    """Its faces then are at the pole: the axes a height apart. Without contact they would cross."""
    E, h, R = 1e6, 0.05, 1.0
    ends = [np.linspace(-np.pi / 2, np.pi / 2, 25) + k * np.pi for k in range(2)]
    halves = [Beam(MeshBeam.init_curve(lambda s: R * np.array([np.cos(s), np.sin(s)]), a, height=h),
                   ElementBeamANCFCubic(1), StVenantKirchhoff(E, 0.0, 1.0), width=1.0)
              for a in ends]
    scene = Scene(*halves).contact("all", self_contact=True)
    scene.weld((0, "left"), (1, "right"))
    scene.weld((0, "right"), (1, "left"))
    scene.fix("left", "r", 0.0, 0).fix("right", "r^1", 0.0, 0)
    scene.point_force((0.0, -15 * E * h**3 / 12 / R**2), at="right", beam=0)
    state = scene.run(1.0, increments=1).state(1)
    assert state.displacement("right", 0)[1] == pytest.approx(h - 2 * R, abs=0.02 * h)
    assert len(state.contact()) and state.contact().penetration < 0.01 * h


def require_balanced(run, walls):
    """Walls and the drag of what moved in the last increment are in balance; no wires cross."""
    state, system = run.state(-1), run.system
    drag = (drag_of(system) * (run.u[-1] - run.u[-2])).reshape(-1, 4)[:, :2].sum(axis=0)
    assert_allclose(walls.sum(axis=0), drag, rtol=0, atol=1e-5 * abs(walls).max())
    y = np.array([state.u[s][1::4] + b.mesh.p[1] for s, b in zip(system.slices, system.beams)])
    assert np.all(np.diff(y, axis=0) > 0.01)
    return abs(drag[1] / walls[3, 1])


def test_wires_that_nothing_holds_are_squeezed_in_a_box():
    run, deepest, walls = stress.squeezed(3, 0.0)
    assert walls[3, 1] < -1.0 and deepest < 0.01 and require_balanced(run, walls) < 0.06


@pytest.mark.parametrize("unit", [2.0**20, 2.0**-20])
def test_what_nothing_holds_moves_alike_in_all_units_of_length(unit):
    """Other lengths in metres than micrometres made a drag of three times as much."""
    runs = [stress.squeezed(2, 0.0, unit=one)[0] for one in (1.0, unit)]
    size = np.tile([unit, unit, 1.0, 1.0], runs[0].u.shape[1] // 4)
    assert_allclose(runs[1].u / size, runs[0].u, rtol=0, atol=1e-7)


def test_wires_with_friction_are_squeezed_in_a_box(needs_compiled):
    run, deepest, walls = stress.squeezed(4, 0.2)
    assert run.t[-1] == 1.0 and walls[3, 1] < -1.0 and deepest < 0.01
    assert require_balanced(run, walls) < 0.15 and np.all(np.diff(run.dissipated) >= -1e-6)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_clip_of_two_flexible_parts(friction):
    """A finger is moved over an arch and back: force against travel, and balance of work."""
    R, h = 0.1, 0.004
    arch = Beam(MeshBeam.init_curve(lambda s: R * np.array([np.sin(s), np.cos(s)]),
                                    np.linspace(-0.5, 0.5, 9), height=h), ElementBeamCable(3),
                RUBBER, width=0.02)
    finger = line(0.03, 3, 0.006, (-0.02, R + 0.5 * h - 6e-4 + 0.03), ElementBeamCable(3), RUBBER,
                  -np.pi / 2)
    scene = Scene(arch, finger).contact(0, 1, friction=friction).clamp("left", 0).clamp("right", 0)
    scene.fix("left", "r^1", lambda t: 0.04 * min(t, 2 - t), 1)
    scene.fix("left", "r^2", 0.0, 1).fix("left", "r_X", 0.0, 1)
    run = scene.run([1.0, 2.0], increments=32)
    x, states = 0.04 * np.minimum(run.t, 2 - run.t), [run.state(k) for k in range(len(run.t))]
    force = np.array([state.reactions("left", 1).force[0] for state in states])
    energy = np.array([state.strain_energy for state in states])
    work = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(x)))
    assert max(state.contact().penetration for state in states) < 0.01 * h
    assert force.max() > 0.01 and energy[-1] < 1e-9 * energy.max()
    assert_allclose(work - energy, run.dissipated, rtol=0.2, atol=0.1 * energy.max())
    if friction:
        assert work[-1] > energy.max() and force.max() > -1.2 * force[:33].min()
    else:  # up the arch as down, there as back
        half = np.interp([0.013, 0.016], x[:33], force[:33])
        assert_allclose(np.interp([0.027, 0.024], x[:33], force[:33]), -half, rtol=1e-2)
        assert abs(work[-1]) < 1e-6 * energy.max() and run.dissipated[-1] < 1e-6 * energy.max()


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)], ids=repr)
def test_a_nose_with_sharp_corners_passes_the_end_of_a_leg(element):
    """A chamfer of 45 degrees, then a flat side, move over the end of a cantilever and back."""
    h, L, w = 0.002, 0.1, 0.003
    leg = line(L, 9, h, element=element, material=StVenantKirchhoff(2e9, 0.0, 1000.0), width=0.01)
    outline = np.array([[0.004, 0.02, 0.02, 0.0], [0.0, 0.0, 0.01, 0.004]])
    c = outline.mean(axis=1)
    part = RigidBody(1.0, 1.0, (L + 0.001 + c[0], 0.5 * h - w + c[1]), outline=outline - c[:, None])
    scene = Scene(leg, part).contact("all").clamp("left", 0)
    scene.fix(None, "r^1", lambda t: -0.012 * min(t, 2.0 - t), part)
    scene.fix(None, "r^2", 0.0, part).fix(None, "d", 0.0, part)
    run = scene.run([1.0, 2.0], increments=12)
    assert len(run.t) == 25  # without a cut
    force = np.array([run.state(k).contact(on=0).total for k in range(25)])
    k = 3 * 2e9 * 0.01 * h**3 / 12 / L**3
    for n, lift in ((3, 1e-3), (4, 2e-3)):  # the chamfer reaches the corner after 2 mm
        assert_allclose(force[n], -k * lift, rtol=0.02)
    for n in range(6, 13):  # the corner of the part is on the face of the leg
        a = L - (n * 1e-3 - 0.005)
        assert force[n, 1] == pytest.approx(-k * w * (L / a)**3, rel=0.02)
        assert force[n, 0] == pytest.approx(1.5 * w / a * force[n, 1], rel=0.1)
    assert_allclose(force[13:], force[11::-1], atol=1e-6 * k * w)


@pytest.mark.parametrize("dt", [0.02, 0.05])
def test_what_passes_a_body_in_a_step_is_seen(dt):
    """A rod 0.02 high meets a plate 0.02 thick, and would be beyond it at the end of the step."""
    plate = RigidBody(1.0, 1.0, (0.5, 0.0), outline=[[-0.3, 0.3, 0.3, -0.3],
                                                     [-0.01, -0.01, 0.01, 0.01]])
    rod = line(1.0, 4, 0.02, (0.0, 0.1), element=ElementBeamCable(3))
    scene = Scene(rod, plate).contact(rod, plate).initial_velocity((0.0, -6.0), rod)
    for name in ("r", "d"):
        scene.fix(None, name, 0.0, plate)
    history = scene.integrate(0.1, dt)
    assert history.u[:, 1].min() > -0.1 and np.ptp(history.total_energy) < 1e-9 * (
        history.total_energy[0])
    x = np.zeros((2, rod.N // 2 + 2, 2))
    x[1, :rod.N // 2:rod.nd // 2] = 0.0, -0.2
    contact = recalled(BodyContact().bound_on(Layout(rod, plate))[0])
    with_bodies = np.flatnonzero(np.isin(np.arange(rod.N + 4) // 2, [
        link.dofs[0, 0] // 2 for link in contact.links]))
    assert "into a body" in contact.passed(*(y.ravel()[with_bodies].reshape(-1, 2) for y in x), 0.0)


def test_pressure_begins_at_the_face():
    """A gap that a cantilever has to close is not smaller for the pressure: closed form."""
    E, b, h, L, gap = 2e11, 0.02, 0.01, 0.5, 2e-5
    scene = Scene(line(L, 8, h), line(L, 8, h, (0.0, -h - gap))).clamp("left", 0).clamp("left", 1)
    k = 3 * E * b * h**3 / 12 / L**3
    scene.contact(0, 1).point_force((0.0, -1.2 * k * gap), at=(L, 0.0), beam=0)
    state = scene.solve_static()
    below = -state.displacement("right", 1)[1]
    assert below == pytest.approx(0.1 * gap, rel=0.02)  # half of the rest of the force


def test_a_motion_with_contact_goes_on_from_a_checkpoint(tmp_path):
    beams = [line(1.0, 4, 0.05, (0.0, 0.0), material=RUBBER),
             line(1.0, 4, 0.05, (0.4, 0.06), material=RUBBER, angle=0.1)]
    scene = Scene(*beams).contact("all", friction=0.3).initial_velocity((0.0, -2.0), 1)
    whole, path = scene.integrate(0.012, 4e-4), tmp_path / "motion.npz"
    scene.integrate(0.008, 4e-4, checkpoint=path)
    part = scene.integrate(0.012, 4e-4, start=whole.state(20), t_start=0.008)
    assert_allclose(part.u[-1], whole.u[-1], rtol=0, atol=1e-9 * np.abs(whole.u[-1]).max())
    for one in (copy.copy(scene), pickle.loads(pickle.dumps(scene))):
        assert np.array_equal(one.integrate(0.004, 4e-4).u, whole.u[:11])


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_compiled_motions_are_those_of_numpy(monkeypatch, needs_compiled, scheme, friction):
    """Leaves that rub beside a floor; also of a scene whose obstacle alone has a history."""
    found = []
    for mode in ("0", "1"):
        monkeypatch.setenv("SKFEM_ANCF_COMPILED", mode)
        leaves = [line(0.5, 6, 0.01, (0.0, -0.0102 * k), ElementBeamANCF(2), RUBBER)
                  for k in range(2)]
        scene = Scene(*leaves).contact("all", friction=friction).clamp("left", 0).clamp("left", 1)
        scene.obstacle(Line((0.0, -0.02), (0.0, 1.0)), friction=0.2).gravity((0.0, -9.81))
        alone = Scene(leaves[0]).obstacle(Line((0.0, -0.0052), (0.0, 1.0)), friction=0.2)
        for one in (scene, alone.gravity((0.0, -9.81))):
            history = one.integrate(0.02, 5e-4, scheme=scheme)
            found.append((history.u, history.v))
            assert one.system.backend.choose("steps").mode == ("loaded" if mode == "1" else "plain")
    for numpy, compiled in zip(found[:2], found[2:]):
        for a, b in zip(numpy, compiled):
            assert_allclose(b, a, rtol=0, atol=1e-9 * np.abs(a).max())


def test_what_does_not_fit_is_said():
    scene = Scene(line(1.0, 4, 0.01), line(1.0, 4, 0.01, (0.0, -0.007)))
    with pytest.raises(InputError, match="overlap by"):
        scene.contact("all")
    with pytest.raises(InputError, match="self_contact=True"):
        Scene(line(1.0, 4, 0.01)).contact()
    with pytest.raises(InputError, match="no contact"):
        scene.state().contact()
    with pytest.raises(InputError, match="unknown beam 'al'; known: 'all'"):
        scene.contact("al")
    top = Scene(line(1.0, 4, 0.01), line(1.0, 4, 0.01, (0.0, -0.02))).contact("all").state()
    with pytest.raises(InputError, match=r"unknown member 'top'; known: 0, 1"):
        top.contact(on="top")
    with pytest.raises(InputError, match="has no obstacle"):
        top.contact(0)
    with pytest.raises(InputError, match=r"state.contact\(on=...\) has pressure"):
        top.field("pressure", (0.5, 0.0))
    apart = Scene(line(1.0, 4, 0.01), line(1.0, 4, 0.01, (0.0, -0.1))).clamp("left", 0)
    with pytest.raises(InputError, match="use 'energy-momentum'"):
        apart.clamp("left", 1).contact("all").integrate(1e-3, 1e-3, scheme="radau")


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_nothing_touches_within_the_margin(element):
    """Surfaces are looked at again only when a point may have moved far; before, none touches."""
    h, rng = 0.02, np.random.default_rng(1)
    scene = Scene(*(line(0.5, 4, h, (0.0, 2.0 * k * h), element) for k in range(3))).contact("all")
    system = scene.obstacle(Line((0.0, -1.5 * h), (0.1, 1.0))).system
    forces, N = system.forces, system.N
    apart = [s for beam, s in zip(system.beams, system.slices)]
    for table, part in ((forces.clear, 0.45), (forces.contacts.tables.clear, 0.9)):
        margin, weights = table[0], table[-N:].reshape(2, -1)
        assert 0.7 * part * h < margin < 1.1 * part * h
        towards = np.zeros(N // 2, complex)  # translations are the shortest way
        for s, way in zip(apart, (1.0, -1.0, 1.0)):
            towards[s.start // 2:s.stop // 2:system.beams[0].nd // 2] = 1j * way
        ways = [towards / np.max(weights[0])]
        for share in rng.random(20):  # of places in the motion
            sizes = np.where(weights[0] > 0.0, share, 1.0 - share) / np.maximum(
                np.max(weights, axis=0), 1e-3)
            ways.append(sizes * np.exp(2j * np.pi * rng.random(N // 2)))
        for way in ways:
            u = margin * way.view(float)
            assert is_clear(table, 0.999 * u, 0.0) and not is_clear(table, 1.001 * u, 0.0)
            least = min(
                element.least_gap(0.999 * u[at].reshape(-1, 2)) for element, at in forces.changing
            ) if table is forces.clear else min(
                gap.min() for _, _, gap in forces.contacts.look(0.999 * u, 0.0))
            assert least > 0.0


@pytest.mark.parametrize("element", ELEMENTS[1:3], ids=repr)
def test_the_mean_force_of_a_small_move_is_near_that_at_its_ends(element):
    """Also where a corner passes from one facet to the next: the gap jumps there by more than it
    changes, and work that is exact would need any force."""
    h, rng = 0.01, np.random.default_rng(1)
    strip = line(0.2, 4, h, (-0.1, 0.0), element)
    post = line(0.1, 2, h, (0.002, 0.52 * h), element, angle=0.5 * np.pi - 0.05)
    layout = Layout(strip, post)
    contact = recalled(BodyContact().bound_on(layout)[0])

    def moved(way):
        u = np.zeros(layout.N)
        u[strip.N:].view(complex)[::post.nd // 2] = way
        return u.reshape(-1, 2)

    for _ in range(800):
        way = rng.uniform(-0.03, 0.03) - 1j * rng.uniform(3.5e-4, 6e-4)
        small = rng.uniform(-3e-4, 3e-4) + 1j * rng.uniform(-1, 1) * 10**rng.uniform(-9, -5)
        x, y = moved(way), moved(way + small)
        ends = [np.abs(contact.force(z, 0.0 * z, 0.0)).max() for z in (x, y)]
        assert 0.0 < np.abs(contact.mean_force(x, y, 0.0, 1e-3)).max() < 1.15 * max(ends)


@pytest.mark.parametrize("seed", [38, 90, 107])
def test_coarse_beams_that_meet_with_their_corners_keep_energy_and_momenta(seed):
    """Corners turn and slide from face to face, in steps of a tenth of the height and more."""
    rng = np.random.default_rng(seed)
    rods = [line(1.0, 3, rng.uniform(0.01, 0.08), (rng.uniform(-0.3, 0.3), 0.75 * k),
                 ELEMENTS[seed % 4], RUBBER, angle=rng.uniform(-0.6, 0.6)) for k in range(2)]
    scene = Scene(*rods).contact("all", friction=0.3 * (seed % 3 == 2))
    history = scene.initial_velocity((rng.uniform(-1.0, 1.0), -6.0), 1).integrate(0.3, 2e-3)
    energy, turn = history.total_energy + history.dissipated, history.angular_momentum
    assert any(len(history.state(k).contact()) for k in range(0, 151, 3))
    assert np.ptp(energy) < 1e-10 * energy[0] and np.ptp(turn) < 1e-10 * np.abs(turn).max()


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_contact_is_that_of_a_search_in_each_evaluation(monkeypatch, friction):
    """Also of fast, thin members; what is not looked at does not touch."""
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "0")
    h, soft = 0.002, ElementBeamANCF(2)

    def solved():
        leaves = [line(0.5, 6, h, (0.0, -6.0 * h * k), soft) for k in range(2)]
        scene = Scene(*leaves).contact("all", friction=friction).clamp("left", 0).clamp("left", 1)
        scene.obstacle(Circle((0.4, -0.25), 0.22), friction=friction)
        scene.point_force((0.0, -0.5), at=(0.5, 0.0), beam=0, amplitude=lambda t: t)
        thrown = Scene(line(0.1, 3, h, (0.0, 0.05), soft, RUBBER, angle=0.2),
                       line(0.4, 6, h, (-0.1, 0.0), soft, RUBBER)).contact("all", friction=friction)
        thrown.initial_velocity((1.0, -6.0), 0).clamp("left", 1).clamp("right", 1)
        thrown.obstacle(Circle((0.1, -0.025), 0.02), friction=friction)
        schemes = "energy-momentum", "generalized-alpha"
        runs = [scene.run(1.0, increments=6),
                *(thrown.integrate(0.014, 2e-4, scheme=scheme) for scheme in schemes)]
        return [scene.solve_static().u, *(one.u for one in runs)], [
            any(len(one.state(k).contact()) for k in range(len(one.t))) for one in runs]

    found, touches = solved()
    assert all(touches[1:])
    for module in (kernels, contacts, pair_forces, forces_of_scene):
        monkeypatch.setattr(module, "SAFE", 0.0)
    for a, b in zip(found, solved()[0]):
        assert_allclose(a, b, rtol=0, atol=1e-9 * np.abs(b).max())


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_a_beam_that_turns_and_folds_finds_itself(monkeypatch, element):
    """Stretches that are hardly bent are no candidates, however far they move; none is missed."""
    h, n = 0.01, 24
    s = np.linspace(0.0, 1.0, 20 * n + 1)

    def shape(share):  # a hairpin whose legs meet at their ends, turned two and a half times
        turn = 5.0 * np.pi * share + 1.1 * np.pi * share * np.clip((s - 0.4) / 0.2, 0.0, 1.0)
        t = np.exp(1j * turn)
        r = np.append(0.0, np.cumsum(0.5 * (t[1:] + t[:-1]) * np.diff(s)))
        return r[::20], t[::20]

    def bound():
        layout = Layout(line(1.0, n, h, element=element))
        return recalled(BodyContact(self_contact=True).bound_on(layout)[0])

    contact, straight = bound(), shape(0.0)
    each = len(contact.dofs) // (n + 1)
    monkeypatch.setattr(search, "stretches_of", lambda f, touch, *args: stretches_of(
        f, np.zeros_like(touch), *args))
    plain, found = bound(), []
    turned = np.zeros((len(contact.dofs), 2))  # a straight axis with all slopes reversed
    turned.reshape(n + 1, each, 2)[:, 1:] = -2.5
    for share in np.linspace(0.0, 1.0, 30):
        r, t = (a - b for a, b in zip(shape(share), straight))
        z = np.column_stack([r, t] + [1j * t] * (each - 2))
        x = np.column_stack([z.real.ravel(), z.imag.ravel()])
        contact.force(turned, 0.0 * x, 0.0)  # as a first guess may be: nothing is known from it
        f = contact.force(x, 0.0 * x, 0.0)
        assert_allclose(f, plain.force(x, 0.0 * x, 0.0), rtol=1e-9, atol=1e-9 * np.abs(f).max())
        assert contact.least_gap(x) <= 0.0 or not f.any()
        found.append((contact.least_gap(x) > 10.0 * h, f.any()))
    unbent, touches = np.array(found).T
    assert unbent[:10].all() and not touches[:20].any() and touches[-1]


@pytest.mark.parametrize("turn", [1.0, 2.5, 4.5])
def test_what_does_not_touch_is_solved_as_without_contact(turn):
    """In the same iterations, with the same result: of a beam with itself, and beside a wall."""
    EI = 1e7 * 0.02 * 0.01**3 / 12.0
    alone = Scene(line(1.0, 24, 0.01, element=ELEMENTS[0], material=RUBBER)).clamp("left").moment(
        "right", turn * EI, amplitude=lambda t: t)
    state, run = alone.solve_static(), alone.run(1.0, increments=4)
    for scene in (alone.contact(0, self_contact=True), alone.obstacle(Line((0, -2), (0, 1)))):
        same, steps = scene.solve_static(), scene.run(1.0, increments=4)
        assert same.message == state.message and steps.found_by == run.found_by
        assert steps.iterations_at.tolist() == run.iterations_at.tolist()
        assert_allclose(same.u, state.u, rtol=0.0, atol=1e-12)
        assert_allclose(steps.u[-1], run.u[-1], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("turn", [3.0, 4.5, 5.5])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_a_strip_bent_far_is_solved_without_searches(monkeypatch, element, turn):
    """Corrections of Newton's method lead through many lengths: no way of theirs is looked at."""
    searches, found, states = [], search.Search.search, []
    for touch in (False, True):
        scene = Scene(line(1.0, 24, 0.01, element=element, material=RUBBER)).clamp("left")
        if touch:
            scene.contact(0, self_contact=True)
        scene.moment("right", turn * 1e7 * 0.02 * 0.01**3 / 12.0)
        _ = scene.system
        monkeypatch.setattr(search.Search, "search", lambda self, z: (
            searches.append(z), found(self, z)))
        states.append(scene.solve_static())
        monkeypatch.setattr(search.Search, "search", found)
    without, state = states
    assert state.message == without.message and len(searches) <= 2
    assert_allclose(state.u, without.u, rtol=0.0, atol=1e-12)


def test_tips_that_are_apart_at_the_end_do_not_pass_each_other():
    """Without contact one tip is below the other and beside it; with it, on the other."""
    h, EI = 0.02, 1e7 * 0.02 * 0.02**3 / 12.0
    stiff = StVenantKirchhoff(3e8, 0.0, 1000.0)
    places = []
    for touch in (False, True):
        beams = line(1.0, 10, h, material=RUBBER), line(1.0, 10, h, (1.95, -0.1), material=stiff,
                                                        angle=np.pi)
        scene = Scene(*beams).clamp("left", 0).clamp("left", 1)
        if touch:
            scene.contact(0, 1)
        state = scene.point_force((0.0, -EI), at=(1.0, 0.0), beam=0).solve_static()
        places.append([state.position("right", k) for k in (0, 1)])
    (a, b), (c, d) = places
    assert b[0] - a[0] > 0.2 * h and a[1] < b[1] - 5.0 * h
    assert c[0] - d[0] > h and 0.8 * h < c[1] - d[1] < 1.5 * h and len(state.contact()) > 0


@pytest.mark.parametrize("obstacle", ["plate", "post"])
def test_what_is_in_the_way_is_not_passed(obstacle):
    """The end of a beam would come to rest far behind it, and touch nothing there."""
    h, EI = 0.02, 1e7 * 0.02 * 0.02**3 / 12.0
    ends = []
    for touch in (False, True):
        beam = line(1.0, 16, h, material=RUBBER)
        if obstacle == "plate":
            other = RigidBody(1.0, 1.0, (0.7, -0.15), outline=[
                (-0.1, -h), (0.1, -h), (0.1, h), (-0.1, h)])
            scene = Scene(beam, other).clamp((0.7, -0.15), other)
            scene.point_force((0.0, -4.0 * EI), at=(1.0, 0.0), beam=0)
        else:
            other = line(0.4, 5, h, (0.6, 0.25), material=STEEL, angle=np.pi / 2)
            scene = Scene(beam, other).clamp("left", 1).moment("right", 3.5 * EI, beam=0)
        if touch:
            scene.contact(beam, other)
        state = scene.clamp("left", 0).solve_static()
        ends.append(state.position("right", 0))
    assert len(state.contact()) > 0 and np.linalg.norm(ends[1] - ends[0]) > 0.2


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_a_strip_wound_on_itself_stops_there(element):
    """By a moment that would close it to a circle and more."""
    ends = []
    for touch in (False, True):
        scene = Scene(line(1.0, 24, 0.01, element=element, material=RUBBER)).clamp("left")
        if touch:
            scene.contact(0, self_contact=True)
        state = scene.moment("right", 6.6 * 1e7 * 0.02 * 0.01**3 / 12.0).solve_static()
        ends.append(state.displacement("right"))
    assert len(state.contact()) > 0 and np.linalg.norm(ends[1] - ends[0]) > 0.01


def test_what_does_not_touch_is_seldom_looked_at(monkeypatch):
    """A step evaluates forces at least three times."""
    looks = {"look": 0, "search": 0}

    def counted(place, name):
        function = getattr(place, name)

        def run(*args):
            looks[name] += 1
            return function(*args)

        monkeypatch.setattr(place, name, run)

    counted(pairs, "look")
    counted(kernels, "search")
    scene = Scene(*(line(1.0, 16, 0.02, (0.0, 0.12 * k), ELEMENTS[0]) for k in (0, 1)))
    scene = scene.clamp("left", 0).clamp("left", 1).gravity((0, -9.81)).contact("all")
    scene.obstacle(Circle((0.5, -1.0), 0.9)).integrate(0.1, 1e-3)
    assert all(n < 60 for n in looks.values()), looks
    assert looks["look"] > 0


@pytest.mark.parametrize("element", ELEMENTS[2:], ids=repr)
def test_a_strip_folded_on_itself_is_half_of_it_on_a_rigid_plane(element):
    """The legs of a hairpin are pressed together until they lie on each other."""
    h, R, leg, F = 0.01, 0.04, 0.3, 40.0

    def hairpin(pieces):  # from the end of the upper leg on
        places = np.concatenate([np.linspace(0.0, leg, 9), leg + R * np.linspace(0, np.pi, 17)[1:],
                                 leg + np.pi * R + np.linspace(0.0, leg, 9)[1:]])

        def axis(s):
            turn = np.clip((s - leg) / R, 0.0, np.pi)
            along = np.maximum(s - leg - np.pi * R, 0.0) - np.minimum(s - leg, 0.0)
            return np.array([along - R * np.sin(turn), R * np.cos(turn)])

        mesh = MeshBeam.init_curve(axis, places[:pieces + 1], h)
        return Scene(Beam(mesh, element, StVenantKirchhoff(1e8, 0.0, 1000.0), width=0.02))

    half, whole = hairpin(16).obstacle(Line((0.0, 0.0), (0.0, 1.0))), hairpin(32)
    for scene, at in ((half, "right"), (whole, (-R, 0.0))):
        for name in ("r^1", "r^2", "r_X^1"):
            scene.fix(at, name)
        scene.point_force((0.0, -F), at=(0.5 * leg, R), amplitude=lambda t: t**3)
    whole.point_force((0.0, F), at=(0.5 * leg, -R), amplitude=lambda t: t**3).contact(
        0, self_contact=True)
    a, b = (scene.run(1.0, increments=20) for scene in (half, whole))
    one, both = a.state(-1), b.state(-1)
    for place in ("left", (0.6 * leg, R)):
        assert_allclose(both.displacement(place), one.displacement(place), atol=3e-3 * R)
    assert_allclose(both.displacement("right"), both.displacement("left") * [1, -1], atol=1e-6 * R)
    on_floor, found = one.contact().total[1], both.contact()
    assert on_floor > 0.8 * F and np.ptp(found.points[0]) > 0.5 * h  # they lie on each other
    up = found.force[1] > 0.0
    assert found.force[1, up].sum() == pytest.approx(on_floor, rel=1e-3)
    assert found.penetration < 0.01 * h
    # balance: the work of both forces is stored
    way = np.array([b.state(k).displacement((0.5 * leg, R))[1] for k in range(len(b.t))])
    work = -2.0 * trapezoid(F * b.t**3, way)
    assert both.strain_energy == pytest.approx(work, rel=0.02)
