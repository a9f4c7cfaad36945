"""Scenes that obstacles hold: few iterations an increment, or what is missing; and pressures."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from skfem_ancf import (Beam, Circle, ConvergenceError, ElementBeamANCF, ElementBeamCable, Line,
                        MeshBeam, Scene, StVenantKirchhoff, SupportError)

MOST = 105
RUBBER = StVenantKirchhoff(2e8, 0.3, 7800.0)
CABLE, SECTIONS = ElementBeamCable(5), ElementBeamANCF(2)
elements = pytest.mark.parametrize("element", [CABLE, SECTIONS], ids=["cable", "sections"])
frictions = pytest.mark.parametrize("mu", [0.0, 0.3])


def strip(n, length, h, element=CABLE, start=(0.0, 0.0), law=RUBBER):
    mesh = MeshBeam.init_line(np.linspace(0, length, n + 1), h, origin=start)
    return Beam(mesh, element, law, width=h)


def ramp(t):
    return t


def few(history):
    """The last state of a run whose increments took few iterations."""
    assert history.iterations_at.max() <= MOST and not len(history.jumps)
    return history.state(len(history) - 1)


# a wire over a drum


def wire(mu, element=CABLE, n=32):
    h, R = 0.004, 0.3
    b = strip(n, 2.0, h, element, (-1.0, 0.0), StVenantKirchhoff(1e10, 0.3, 7800.0))
    return Scene(b).obstacle(Circle((0, -R - h / 2), R), friction=mu)


@elements
def test_a_wire_hangs_over_a_drum_that_alone_holds_it(element):
    weight, scene = 10.0, wire(0.3, element)
    for x in (-1, 1):
        scene.point_force((0, -weight), at=(x, 0), amplitude=ramp)
    history = scene.run(1.0, increments=5)  # the first wraps a wire that lies on one point
    state = history.state(-1)
    assert history.iterations_at.max() <= MOST
    assert np.allclose(state.contact().total, [0, 2 * weight], atol=1e-3 * weight)
    x, y = state.position([(-1, 0), (1, 0)])
    assert np.allclose(x, [-0.302, 0.302], atol=0.05) and np.allclose(y, y[0], atol=1e-3)


@pytest.mark.parametrize("mu, heavier", [(0.0, 12.0), (0.1, 20.0)])
def test_a_wire_slides_off_a_drum_and_the_error_says_so(mu, heavier):
    scene = wire(mu).point_force((0, -10.0), at=(-1, 0)).point_force((0, -heavier), at=(1, 0))
    # round-off decides whether the descent is seen to go on without end
    with pytest.raises(SupportError, match="nothing holds the beam along its axis|No stable "
                       "equilibrium was found in which the loads hold what is free"):
        scene.solve_static()


# a strip in a channel


def channel(mu, gap, h=0.01, element=CABLE):
    scene = Scene(strip(20, 1.0, h, element))
    for sign in (-1, 1):
        scene.obstacle(Line((0, sign * 0.5 * (h + gap)), (0, -sign)), friction=mu)
    return scene


@elements
@frictions
def test_a_strip_is_pushed_along_a_channel(element, mu):
    scene = channel(mu, 1e-4, element=element).gravity((0, -9.81))
    push = scene.joint("position", at=(0, 0), r=lambda t: (0.1 * t, 0))
    history = scene.run(1.0, increments=5)
    state = few(history)
    assert state.position((1, 0))[0] == pytest.approx(1.1, abs=1e-4)
    floor, (pushed, lift) = state.contact().total, history.joint_force(push)[-1]
    assert floor[1] + lift == pytest.approx(7800 * 1e-4 * 9.81, rel=1e-3)
    assert pushed == pytest.approx(mu * floor[1], rel=1e-2, abs=1e-6)


@elements
def test_a_blocked_strip_buckles_in_a_channel(element):
    scene = channel(0.0, 0.01, element=element).fix("right", "r^1").gravity((0, -9.81))
    scene.joint("position", at=(0, 0), r=lambda t: (0.002 * t, 0))
    assert few(scene.run(1.0, increments=5)).contact().penetration < 1e-3


def test_a_strip_between_walls_that_do_not_touch_it_is_held_by_nothing():
    with pytest.raises(SupportError, match=r"translation along \(0, 1\)"):
        channel(0.0, 0.01).fix("left", "r^1", displacement=0.1).solve_static()


# a rod against a wall


@elements
@frictions
@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_a_rod_is_pressed_end_on_against_a_wall(element, mu, gap):
    h = 0.01
    scene = Scene(strip(8, 1.0, h, element)).obstacle(Line((1 + gap, 0), (-1, 0)), friction=mu)
    load = 0.5 * np.pi**2 / 4 * 2e8 * h**4 / 12
    scene.fix("left", ["r^2", "r_X^2"] if element is CABLE else ["r^2", "r_Y0^1"])
    state = few(scene.point_force((load, 0), at=(0, 0), amplitude=ramp).run(1.0, increments=5))
    assert np.allclose(state.contact().total, [-load, 0], atol=1e-3 * load)


@elements
def test_a_rod_that_friction_holds_at_a_wall_buckles_out(element):
    """Straight it would bear hundreds of times Euler's load, in an equilibrium that is unstable."""
    h, push = 0.01, 0.02
    scene = Scene(strip(8, 1.0, h, element)).obstacle(Line((1, 0), (-1, 0)), friction=0.3)
    scene.joint("position", at=(0, 0), r=lambda t: (push * t, 0))
    scene.fix("left", "r_X^2" if element is CABLE else "r_Y0^1")
    state = scene.solve_static()
    euler = np.pi**2 * 2e8 * h**4 / 12
    assert state.stability == "stable" and state.iterations < 400
    assert euler < -state.contact().total[0] < 4.1 * euler  # its end is hinged or flat


# a circle that touches


@elements
@frictions
@pytest.mark.parametrize("x", [0.5, 0.613])
def test_a_circle_that_touches_a_face_bends_a_beam(element, mu, x):
    h, R, way = 0.01, 0.1, 0.02
    scene = Scene(strip(16, 1.0, h, element)).pin("left").fix("right", "r^2")
    scene.obstacle(Circle((x, h / 2 + R), R), friction=mu, position=lambda t: (0, -way * t))
    state = few(scene.run(1.0, increments=4))
    assert state.displacement((x, 0))[1] == pytest.approx(-way, rel=0.02)
    at_once = scene.solve_static()
    assert at_once.iterations <= MOST * len(at_once.steps)
    if mu == 0.0:  # friction remembers the way
        assert at_once.contact().total[1] == pytest.approx(state.contact().total[1], rel=1e-3)


#: How far its ends hang down with 160 contact points on an element, slowly; sections, cable.
HANGS = -0.036564, -0.036864


def on_two_circles(element, angle, more=0.0, **options):
    """A beam that just touches them, turned by an angle, and a function that turns vectors back."""
    h, R = 0.01, 0.1
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    mesh = MeshBeam.init_line(np.linspace(0, 1.0, 17), h, angle=angle)
    scene = Scene(Beam(mesh, element, RUBBER, width=h))
    scene.gravity(turn @ [0, -9.81 * (1.0 + more)], **options)
    for x in (0.25, 0.75):
        scene.obstacle(Circle(tuple(turn @ [x, -h / 2 - R]), R), friction=0.3)

    def moved(state):
        weight = 7800 * h**2 * 9.81
        assert np.allclose(turn.T @ state.contact().total, [0, weight], rtol=0, atol=1e-3 * weight)
        return [turn.T @ state.displacement(tuple(turn @ [x, 0])) for x in (0, 0.5, 1)]

    return scene, moved


@elements
@pytest.mark.parametrize("angle, more", [(0.0, 0.0), (0.0, -3e-14), (0.3, 0.0), (2.0, 1e-14)])
def test_two_circles_that_touch_a_beam_carry_it(element, angle, more):
    """Both ends hang down alike, however the scene is turned: it does not slide to a side."""
    scene, moved = on_two_circles(element, angle, more)
    state = scene.solve_static()
    assert state.iterations <= MOST and state.stability == "stable"
    left, middle, right = moved(state)
    assert abs(middle[0]) < 1e-9 and np.allclose(left, right * [-1, 1], rtol=0, atol=1e-9)
    assert left[1] == pytest.approx(HANGS[element is CABLE], rel=0.04)
    assert any("points slip on" in text and "scene.run" in text for text in state.checks.findings)


@elements
@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_two_circles_carry_a_beam_that_gets_heavy_slowly(element, angle):
    """In a turned scene too it is at rest before, to round-off, and slips alike on both sides."""
    scene, moved = on_two_circles(element, angle, amplitude=ramp)
    history = scene.run(1.0, increments=5)
    left, middle, right = moved(few(history))
    assert abs(middle[0]) < 1e-9 and np.allclose(left, right * [-1, 1], rtol=0, atol=1e-9)
    assert left[1] == pytest.approx(HANGS[element is CABLE], rel=0.04)
    assert history.found_by[0] == "at rest" and not history.state(-1).checks.findings


# a beam between rollers


@elements
@frictions
def test_a_beam_follows_two_rollers_that_move(element, mu):
    h, R = 0.01, 0.05
    scene = Scene(strip(20, 1.0, h, element)).clamp("left")
    for sign in (-1, 1):
        scene.obstacle(Circle((0.4, sign * (h / 2 + R)), R), friction=mu,
                       position=lambda t: (0.4 * t, 0.05 * t))
    state = few(scene.run(1.0, increments=6))
    assert state.position((0.8, 0))[1] == pytest.approx(0.05, abs=2e-3)


# a shallow arch that a circle pushes through


@pytest.mark.filterwarnings("ignore:the path loses its stability")
@elements
def test_an_arch_does_not_pass_through_the_circle_that_snaps_it(element):
    """In one step the circle would be below the arch, and lift it."""
    h, rise, R, way = 0.01, 0.04, 0.05, 0.1
    mesh = MeshBeam.init_curve(lambda s: np.array([s, rise * np.sin(np.pi * s)]),
                               np.linspace(0, 1, 17), h)
    scene = Scene(Beam(mesh, element, RUBBER, width=h)).pin("left").pin("right")
    scene.obstacle(Circle((0.5, rise + h / 2 + R), R), friction=0.3,
                   position=lambda t: (0, -way * t))
    try:
        state = scene.solve_static()
    except ConvergenceError as error:
        assert "scene.run" in str(error)
        return
    assert state.contact().total[1] < 0.0
    assert state.displacement((0.5, rise))[1] == pytest.approx(-way, rel=0.02)


# a chain on the sea bed


@elements
@pytest.mark.parametrize("mu, pinned", [(0.0, True), (0.3, True), (0.3, False)])
def test_a_chain_on_the_sea_bed_is_pulled_by_its_end(element, mu, pinned):
    h, n, w = 0.05, 25, 7800 * 0.05**2 * 9.81
    law = StVenantKirchhoff(2e9, 0.3, 7800.0)
    scene = Scene(strip(n, 50.0, h, element, law=law)).gravity((0, -9.81))
    scene.obstacle(Line((0, -h / 2)), friction=mu)
    if pinned:
        scene.pin("left")
    H, V = 5 * w, 10 * w
    state = few(scene.point_force((H, V), at=(50, 0), amplitude=ramp).run(1.0, increments=3))
    # it lands where it has lost its weight, see the catenary
    rise = H / w * (np.sqrt(1 + (V / H) ** 2) - 1)
    assert state.position((50, 0))[1] == pytest.approx(rise, rel=0.02)
    assert state.contact().total[1] + (state.reactions("left").force[1] if pinned else 0.0) == (
        pytest.approx(40 * w, rel=1e-3))


@pytest.mark.parametrize("pull", [0.5, 1.0])
def test_a_chain_of_hinged_bars_is_pulled_by_its_end(pull):
    """Those bars slip that the pull reaches, in units of the weight of a bar."""
    h, n, w = 0.05, 6, 7800 * 0.05**2 * 9.81
    law = StVenantKirchhoff(2e9, 0.3, 7800.0)
    scene = Scene(*(strip(2, 1.0, h, ElementBeamCable(3), (k, 0.0), law) for k in range(n)))
    for k in range(n - 1):
        scene.hinge((k, "right"), (k + 1, "left"))
    scene.gravity((0, -9.81)).obstacle(Line((0, -h / 2)), friction=0.3)
    scene.point_force((pull * w, 0), at="right", beam=n - 1)
    state = scene.solve_static()
    assert state.iterations <= MOST
    assert np.allclose(state.contact().total, [-pull * w, n * w], atol=1e-3 * w)


def test_a_chain_that_nothing_anchors_says_so():
    scene = Scene(strip(10, 10.0, 0.05)).gravity((0, -9.81)).obstacle(Line((0, -0.025)))
    with pytest.raises(SupportError, match=r"nothing holds the beam along \(1, 0\).*friction="):
        scene.solve_static()
    with pytest.raises(ConvergenceError, match=r"nothing holds the beam along \(1, 0\)"):
        scene.run(1.0)


# pressure


@pytest.mark.parametrize("element, n", [(ElementBeamCable(3), 16), (CABLE, 12), (SECTIONS, 32)],
                         ids=["cubic", "quintic", "sections"])
def test_a_taut_belt_presses_by_its_tension_over_the_radius(element, n):
    R, h, T, half = 0.3, 2e-3, 10.0, np.pi / 4
    r = R + h / 2
    mesh = MeshBeam.init_curve(lambda s: r * np.array([np.sin(s / r), np.cos(s / r)]),
                               np.linspace(-half * r, half * r, n + 1), h)
    belt = Beam(mesh, element, StVenantKirchhoff(1e9, 0.0), width=h)
    scene = Scene(belt).obstacle(Circle((0, 0), R - 1e-6)).fix(lambda x: abs(x[0]) < 1e-9, "r^1")
    for end, sign in (("left", -1), ("right", 1)):
        scene.point_force((sign * T * np.cos(half), -T * np.sin(half)), at=end)
    contact = scene.solve_static().contact()
    inside = np.abs(np.arctan2(*contact.points)) < 0.7 * half
    assert np.allclose(contact.pressure[inside], T / r / h, rtol=1e-2)
    assert contact.total[1] == pytest.approx(2 * T * np.sin(half), rel=1e-6)


@pytest.mark.parametrize("element", [ElementBeamCable(3), CABLE], ids=["cubic", "quintic"])
def test_a_wiper_blade_presses_evenly(element):
    """E I times its stress-free curvature is the moment of the pressure F / L; it lies flat."""
    L, h, width, F, E = 0.6, 1e-3, 8e-3, 10.0, 2e11
    s = np.linspace(0, L / 2, 4001)
    turn = 2 * F / L / (E * width * h**3) * ((L / 2) ** 3 - (L / 2 - s) ** 3)
    x, y = (CubicSpline(s, CubicSpline(s, f(turn)).antiderivative()(s)) for f in (np.cos, np.sin))
    mesh = MeshBeam.init_curve(
        lambda s: np.array([np.sign(s) * x(np.abs(s)), -y(np.abs(s))]),
        np.linspace(-L / 2, L / 2, 13), h)
    blade = Beam(mesh, element, StVenantKirchhoff(E, 0.0), width=width)
    scene = Scene(blade).obstacle(Line((0, -y(L / 2) - 1.5 * h)))
    scene.fix(lambda x: np.abs(x[0]) < 1e-9, "r^1").point_force((0, -F), at=(0, 0))
    state = scene.solve_static()
    contact = state.contact()
    inside = np.abs(contact.points[0]) < 0.3 * L
    assert state.iterations <= MOST and inside.sum() > 20
    assert np.allclose(contact.pressure[inside], F / L / width, rtol=1e-2)


@elements
def test_a_rod_presses_by_its_force_over_its_end(element):
    """A corner is a point of two faces, and its force is on the one that touches."""
    h, F = 0.01, 10.0
    scene = Scene(strip(4, 0.1, h, element)).obstacle(Line((0.1, 0), (-1, 0)))
    scene.fix("left", ["r^2", "r_X^2"] if element is CABLE else ["r^2", "r_Y0^1"])
    contact = scene.point_force((F, 0), at="left").solve_static().contact()
    assert np.allclose(contact.pressure, F / h**2, rtol=1e-2)


@elements
def test_a_strip_presses_by_its_weight_up_to_its_ends(element):
    h = 0.01
    scene = Scene(strip(16, 1.0, h, element)).obstacle(Line((0, -h / 2)), friction=0.3)
    contact = scene.gravity((0, -9.81)).solve_static().contact()
    assert contact.points[0].min() < 1e-3 and contact.points[0].max() > 0.999
    assert np.allclose(contact.pressure, 7800 * h * 9.81, rtol=1e-2)
