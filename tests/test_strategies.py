"""The default of statics: what it tries, and scenes that only loads hold, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid
from scipy.optimize import brentq, root

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, MeshBeam, Scene,
                        StVenantKirchhoff, SupportError)
from skfem_ancf.actions.obstacles import Circle, Line

GRAVITY = (0.0, -9.81)


def line(n, L=1.0, h=0.01, **options):
    return MeshBeam.init_line(np.linspace(0, L, n + 1), h, **options)


def steel(E=2e11, nu=0.3):
    return StVenantKirchhoff(E, nu, 7800.0)


# slack ropes


def slack_rope(slack, weight, n, element):
    """Between pins 300 m apart, one moved in by the slack under the weight."""
    L = 300.0 * (1.0 + slack)
    beam = Beam(line(n, L, 0.03), element, StVenantKirchhoff(4e10, 0.3, 1800.0), width=0.03)
    scene = Scene(beam).pin("left").fix("right", "r^2")
    return scene.fix("right", "r^1", displacement=300.0 - L).line_load((0, -weight))


def elastic_catenary(slack, weight, EA=4e10 * 0.03**2, span=300.0):
    """Sag and horizontal force."""
    L = span * (1.0 + slack)
    H = brentq(lambda H: H * L / EA + 2 * H / weight * np.arcsinh(0.5 * weight * L / H) - span,
               1e-3 * weight * L, 1e4 * weight * L)
    rise = H / weight * (np.sqrt(1.0 + (0.5 * weight * L / H) ** 2) - 1.0)
    return rise + weight * L**2 / (8.0 * EA), H


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamCable(3)], ids=repr)
@pytest.mark.parametrize("n", [16, 40])
@pytest.mark.parametrize("weight", [5.0, 25.0, 400.0, 6000.0])
@pytest.mark.parametrize("slack", [0.0005, 0.0027, 0.05])
def test_slack_ropes_are_elastic_catenaries(slack, weight, n, element):
    """Newton's method found them, the default did not; none of them is doubtful."""
    state = slack_rope(slack, weight, n, element).solve_static()
    sag, H = elastic_catenary(slack, weight)
    middle = state.displacement((150.0 * (1.0 + slack), 0))
    assert state.stability == "stable" and "by " in state.message
    assert abs(middle[1] + sag) < 2e-3 * sag
    assert abs(state.reactions("left").force[0] + H) < 2e-3 * H
    newton = slack_rope(slack, weight, n, element).solve_static(method="newton")
    assert state.iterations <= 10 * newton.iterations
    assert abs(state.strain_energy - newton.strain_energy) < 1e-5 * newton.strain_energy


# a rod under a line of constant tension


def guyed(tension, anchor, n=16):
    """A rod on the ground, clamped, EI = 1 / 6, whose top a line pulls to an anchor."""
    beam = Beam(line(n, angle=np.pi / 2), ElementBeamCable(5), StVenantKirchhoff(2e8, 0.0), 0.01)
    constant = lambda s: tension + 0.0 * s, lambda s: tension * s
    return Scene(beam).clamp("left").spring(constant, between=((0, 1), ("ground", anchor)))


@pytest.mark.parametrize("anchor", [(2.0, 0.0), (0.7, -1.0), (-1.0, 2.0), (3.0, 1.0)])
@pytest.mark.parametrize("tension", [0.3, 2.0, 10.0])
def test_a_rod_under_a_line_of_constant_tension(tension, anchor):
    """An elastica whose end force points to the anchor, by shooting."""
    EI, state = 2e8 * 0.01**4 / 12, guyed(tension, anchor).solve_static()
    tip = np.array([0, 1]) + state.displacement((0, 1))

    def ends(x):  # curvature at the foot and direction of the pull: what is open at the tip
        k, a = x
        pull = tension / EI * np.array([np.cos(a), np.sin(a)])
        rates = lambda s, y: [y[1], pull[0] * np.sin(y[0]) - pull[1] * np.cos(y[0]),
                              np.cos(y[0]), np.sin(y[0])]
        return solve_ivp(rates, [0, 1], [np.pi / 2, k, 0, 0], rtol=1e-9, atol=1e-11).y[:, -1]

    def gap(x):
        end, to = ends(x), np.array(anchor)
        to = to - end[2:]
        return [end[1], (to[1] * np.cos(x[1]) - to[0] * np.sin(x[1])) / np.hypot(*to)]

    pull = np.array(anchor) - tip
    start = tension / EI * (pull[0] * tip[1] - pull[1] * tip[0]) / np.hypot(*pull)
    found = root(gap, [-start, np.arctan2(pull[1], pull[0])], tol=1e-9)
    assert found.success and state.stability == "stable"
    assert np.max(np.abs(ends(found.x)[2:] - tip)) < 1e-3


# what only loads hold


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)], ids=repr)
@pytest.mark.parametrize("angle", [-np.pi / 2, 0.0, 1.2, np.pi / 2])
def test_a_pendulum_hangs(element, angle):
    """At rest, and from any place: also from the one above its pin, where it is unstable."""
    beam = Beam(line(8, angle=angle), element, steel(2e9), width=0.01)
    state = Scene(beam).pin("left").gravity(GRAVITY).solve_static()
    tip = state.position((np.cos(angle), np.sin(angle)))
    stretch = 7800 * 9.81 / 2e9 / 2
    assert state.stability == "stable"
    assert np.allclose(tip, [0.0, -1.0 - stretch], rtol=0, atol=1e-7)
    assert np.allclose(state.reactions("left").force, [0, 7800 * 9.81 * 1e-4], rtol=0, atol=1e-6)


@pytest.mark.parametrize("radius", [0.5, 0.823])
@pytest.mark.parametrize("angle", [0.0, 2.0, 2.4])
def test_a_slender_arc_that_is_pulled_straight_is_solved_at_any_degree(angle, radius):
    """Its tip lies in the direction of the force. At degree 13 a mode has nearly no stiffness."""
    force, across, reach = (3.22 * np.array([np.cos(angle), np.sin(angle)]),
                            np.array([-np.sin(angle), np.cos(angle)]), [])
    for element, n in ((ElementBeamCable(13), 3), (ElementBeamCable(5), 8)):
        mesh = MeshBeam.init_curve(lambda s: radius * np.array(
            [np.sin(s / radius), 1.0 - np.cos(s / radius)]), np.linspace(0.0, 1.35, n + 1), 1.35e-3)
        scene = Scene(Beam(mesh, element, steel(), 0.1)).pin("left")
        state = scene.point_force(force, at="right").solve_static()
        tip = state.position("right")
        assert state.stability == "stable" and abs(tip @ across) < 1e-9
        reach.append(tip @ force / 3.22)
    assert reach[0] == pytest.approx(reach[1], rel=1e-6) and reach[0] > 1.04


def chain(bars, angle, E=2e11, h=0.02):
    d = np.array([np.cos(angle), np.sin(angle)])
    beams = [Beam(line(3, 1.0, h, origin=tuple(k * d), angle=angle), ElementBeamCable(5), steel(E),
                  width=h, name=f"bar {k}") for k in range(bars)]
    scene = Scene(*beams).gravity(GRAVITY).pin("left", beam="bar 0")
    for k in range(bars - 1):
        scene.joint("hinge", beams=(f"bar {k}", f"bar {k + 1}"), at=("right", "left"))
    return scene, d


@pytest.mark.parametrize("angle", [-np.pi / 2, 0.0, 2.0])
@pytest.mark.parametrize("side", [0.0, 40.0])
def test_a_chain_of_bars_hangs(angle, side):
    """Pulled to the side at its end: each bar by the weights below it."""
    scene, d = chain(4, angle)
    if side:
        scene.point_force((side, 0), at=tuple(4 * d), beam="bar 3")
    state = scene.solve_static()
    weight = 7800 * 0.02**2 * 9.81
    lean = np.arctan2(side, weight * (np.arange(4)[::-1] + 0.5))
    assert state.stability == "stable"
    for k in range(4):
        at = np.array([np.sin(lean), -np.cos(lean)])[:, :k + 1].sum(axis=1)
        assert np.allclose(state.position(tuple((k + 1) * d), f"bar {k}"), at, rtol=0, atol=2e-4)


def test_a_mooring_line_on_the_sea_bed_is_a_catenary_where_it_is_lifted():
    h, n, H, V = 0.05, 100, 3000.0, 3000.0
    beam = Beam(line(n, 100.0, h), ElementBeamCable(5), steel(2e9), width=h)
    scene = Scene(beam).pin("left").obstacle(Line((0, -h / 2), (0, 1))).gravity(GRAVITY)
    state = scene.point_force((H, V), at=(100, 0)).solve_static()
    w, EA = 7800 * h**2 * 9.81, 2e9 * h**2
    s = np.linspace(0, V / w, 2001)  # from where it is lifted
    T = np.hypot(H, w * s)
    x, y = (trapezoid(c * (1 / T + 1 / EA), s) for c in (H, w * s))
    end = 100 - V / w + H / EA * (100 - V / w) + x, y
    assert state.stability == "stable"
    assert np.allclose(state.position((100, 0)), end, rtol=0, atol=0.02)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_wire_over_a_drum_hangs_down_on_both_sides(friction):
    """Pinned at one end above the ground, a weight at the other; the drum carries both."""
    h, R, weight = 0.002, 0.3, 10.0
    beam = Beam(MeshBeam.init_line(np.linspace(-1, 1, 81), h), ElementBeamCable(5), steel(1e10),
                width=h)
    scene = Scene(beam).obstacle(Circle((0, -R - h / 2), R), friction=friction).pin("left")
    state = scene.point_force((0, -weight), at=(1, 0)).solve_static()
    assert state.stability == "stable"
    x, y = state.position((1, 0))
    assert abs(x - (R + h / 2)) < 0.02 and y < -0.7


def test_a_truss_without_diagonals_is_refused_in_a_few_lines():
    """Cells with one bar each between the chords, all hinged: no posts, so many motions."""
    n = 3
    points = [(k, y) for y in (0, 1) for k in range(n + 1)]
    bars = [pair for k in range(n) for pair in ((k, k + 1), (n + 1 + k, n + 2 + k), (k, n + 2 + k))]
    frame = Frame.from_lines(points, bars, hinges="all", height=0.01, width=0.01, material=steel())
    frame.pin(0).hold(n, "y").point_force((0, -1), at=1)
    with pytest.raises(SupportError, match="leave rigid motions free") as error:
        frame.solve_static()
    assert "others" in str(error.value) and len(str(error.value)) < 2000


def test_what_nothing_holds_is_refused():
    beam = Beam(line(8), ElementBeamCable(5), steel(), width=0.01)
    free = "the supports leave rigid motions free"
    for scene in (Scene(beam).gravity(GRAVITY),  # falls
                  Scene(beam).pin("left"),  # no load
                  Scene(beam).fix("left", "r^2").fix("right", "r^2").gravity(GRAVITY),  # rolls
                  Scene(beam).fix("left", "r^2").fix("right", "r^2").point_force((1, 0), (1, 0)),
                  Frame.from_lines([(0, 0), (1, 0)], [(0, 1)], height=0.01, material=steel(),
                                   width=0.01).point_force((0, -1), at=(1, 0))):
        with pytest.raises(SupportError, match=free):
            scene.solve_static()
