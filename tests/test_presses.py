"""Bodies pressed between obstacles: their own stiffness decides, not that of the contact."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Line, MeshBeam, NeoHookean, Scene,
                        StVenantKirchhoff)

E, ALPHA, H = 2e5, 1.2e-5, 10.0
elements = pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCF(1),
                                               ElementBeamCable(3)], ids=str)


SECTIONS = ElementBeamANCF(2)


def bar(length, element=SECTIONS, law=StVenantKirchhoff, turn=0.0):
    c, s = np.cos(turn), np.sin(turn)
    x = np.linspace(0.0, length, 5)
    mesh = MeshBeam.init_line(x, H) if turn == 0.0 else MeshBeam.from_points(
        np.array([c * x, s * x]).T, H)
    return Beam(mesh, element, law(E, 0.0, thermal_expansion=ALPHA), width=10.0)


@elements
@pytest.mark.parametrize("length", [5.0, 30.0, 100.0])
@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_a_heated_bar_against_a_wall_bears_what_the_wall_takes_back(element, length, gap):
    """EA (alpha dT - gap / L); with E / h for the contact it is 12 % less at L / h = 10."""
    free = ALPHA * 200.0
    scene = Scene(bar(length, element)).clamp("left").temperature(200.0)
    scene.obstacle(Line(((1.0 + gap * free) * length, 0.0), (-1.0, 0.0)))
    state = scene.solve_static()
    right = E * H * 10.0 * (1.0 - gap) * free
    assert abs(-state.contact().total[0] / right - 1.0) < 0.012
    assert state.iterations < 60


@elements
@pytest.mark.parametrize("strain", [1e-7, 1e-3])
def test_a_short_press_gives_way_by_its_own_stiffness(element, strain):
    """By a dead load: its stroke is F L / (E A), also where the contact is just beginning."""
    length = 20.0
    scene = Scene(bar(length, element)).obstacle(Line((0, 0), (1, 0)))
    scene.fix("right", "r^2").fix("right", "r_X^2")
    scene.traction("right", (-strain * E, 0.0)) if element.order else scene.point_force(
        (-strain * E * H * 10.0, 0.0), at=(length, 0.0))
    stroke = -scene.solve_static().displacement((length, 0.0))[0]
    assert abs(stroke / (strain * length) - 1.0) < 0.015


@pytest.mark.parametrize("law", [StVenantKirchhoff, NeoHookean])
@pytest.mark.parametrize("turn", [0.0, 0.7, -2.3])
def test_a_bar_between_two_presses_at_any_angle(law, turn):
    """One of them moves; the force is that of the strain."""
    length, strain = 20.0, 1e-4
    e = np.array([np.cos(turn), np.sin(turn)])
    beam = bar(length, law=law, turn=turn)
    scene = Scene(beam).obstacle(Line((0, 0), e)).obstacle(
        Line(length * e, -e), position=lambda t: -t * strain * length * e)
    for end in ("left", "right"):
        at = beam.mesh.p[:, 0 if end == "left" else -1]
        scene.spring(1e-3, between=[end, at + 30.0 * np.array([-e[1], e[0]])])
    state = scene.solve_static()
    for k, sign in ((0, 1.0), (1, -1.0)):
        force = state.contact(k).total @ e * sign
        assert abs(force / (E * H * 10.0 * strain) - 1.0) < 0.025


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_block_that_lies_between_two_plates(friction):
    """Pressed across its axis: h^3 strain, E b L strain."""
    length, strain = 20.0, 1e-4
    scene = Scene(bar(length)).fix("left", "r^1").obstacle(Line((0, -H / 2), (0, 1)),
                                                           friction=friction)
    scene.obstacle(Line((0, H / 2), (0, -1)), position=lambda t: (0, -t * strain * H))
    force = scene.solve_static().contact(0).total[1]
    assert abs(force / (E * 10.0 * length * strain) - 1.0) < 0.025


def test_a_given_stiffness_stays_as_it_is():
    """A foundation of the given stiffness in series with the bar."""
    scene = Scene(bar(100.0)).clamp("left").temperature(200.0)
    scene.obstacle(Line((100.0, 0), (-1, 0)), stiffness=E / H, width=1e-9)
    right = E * H * 10.0 * ALPHA * 200.0 / (1.0 + H / 100.0)
    assert abs(-scene.solve_static().contact().total[0] / right - 1.0) < 0.03


def test_a_run_presses_as_hard_as_one_solution():
    scene = Scene(bar(30.0)).clamp("left").obstacle(
        Line((30.0, 0), (-1, 0)), position=lambda t: (-3e-2 * t, 0.0))
    right = E * H * 10.0 * 1e-3
    history = scene.run(1.0, increments=4)
    force = [-history.state(k).contact().total[0] / right for k in range(1, 5)]
    np.testing.assert_allclose(force, history.t[1:], rtol=0.012)
