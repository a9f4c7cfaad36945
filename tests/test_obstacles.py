"""Contact of beams with obstacles."""

import re

import numpy as np
import pytest
from scipy.integrate import solve_bvp, trapezoid
from scipy.linalg import null_space
from scipy.sparse import csr_array

from skfem_ancf import (Beam, CallbackError, ElementBeamANCF, ElementBeamCable, InputError,
                        MeshBeam, ModelWarning, RigidBody, Scene, StVenantKirchhoff)
from skfem_ancf.actions.contact.kernels import of_contacts
from skfem_ancf.actions.contact.tables import FORCE, Request
from skfem_ancf.actions.obstacles import Circle, Line, Polygon, SignedDistance
from skfem_ancf.dynamics import GeneralizedAlpha

ELEMENTS = ElementBeamANCF(2), ElementBeamCable(3)


def beam(element=None, n=8, height=0.01, nu=0.3, E=2e8, length=1.0):
    return Beam(MeshBeam.init_line(np.linspace(0, length, n + 1), height=height),
                ElementBeamANCF(2) if element is None else element,
                StVenantKirchhoff(E, nu, 7800), width=0.01)


def test_what_an_obstacle_cannot_be_told():
    body = RigidBody(mass=1.0, inertia=1.0, position=(0, 2), name="ball")
    with pytest.raises(InputError, match="beam is needed here, got <RigidBody ball"):
        Scene(beam(), body).obstacle(Line((0, -1)), beam=body)
    with pytest.raises(InputError, match="beam is needed here, got <RigidBody ball"):
        Scene(beam(), body).drag(1.0, 1.0, beam=body)
    with pytest.raises(TypeError, match="Obstacle has no option 'body'; known: 'shape', "):
        Scene(beam(), body).obstacle(Line((0, -1)), body=body)


# the shapes


def test_the_distance_of_a_polygon_is_that_of_its_nearest_point():
    corners = np.array([(0, 0), (2, 0), (2, 1), (1, 0.4), (0, 1)])
    shape = Polygon(corners[::-1])
    points = np.random.default_rng(0).uniform(-1, 3, (2, 400))
    s = np.linspace(0, 1, 4001)
    rim = np.concatenate([a + s[:, None] * (b - a)
                          for a, b in zip(corners, np.roll(corners, -1, axis=0))])
    nearest = np.array([np.hypot(*(rim - p).T).min() for p in points.T])
    from matplotlib.path import Path
    inside = Path(corners).contains_points(points.T)
    assert np.allclose(shape.distance(points), np.where(inside, -nearest, nearest), atol=1e-3)


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
@pytest.mark.parametrize("slip", [1e-6, 1e-4], ids=["little", "much"])
@pytest.mark.parametrize("shape", [
    Circle((0.5, -0.005), 0.005), Polygon([(0.45, -0.1), (0.5, 0.0), (0.4, -0.1)], 0.004)],
    ids=repr)
def test_stiffness_of_friction_on_round_shapes(shape, slip, element):
    """Where a surface turns, so does the way from the anchor, of points as deep as may be."""
    system = Scene(beam(element, height=0.02, E=1e7)).obstacle(shape, friction=0.3).system
    contacts, b = system.forces.contacts, system.beams[0]
    size = np.tile(np.where(np.arange(b.nd) < 2, 1.0, 10.0), system.N // b.nd)
    u = 1e-6 * size * np.cos(np.arange(system.N))
    u[1::b.nd] += 0.01 - 2e-4
    contacts.begin(u, 0.0, True)
    u[::b.nd] += slip
    d = size * np.random.default_rng(0).standard_normal(system.N)

    def force(u):
        out = np.zeros(len(u))
        of_contacts(contacts.tables, Request(FORCE, 0.0, 0.0, 0.0, 0, 0), u, u, out)
        return out

    s = 1e-8
    change = (force(u + s * d) - force(u - s * d)) / (2 * s)
    i, j, values = contacts.entries(0.0, u, system.bandwidth)
    slope = csr_array((values, (i, j)), shape=(system.N, system.N)) @ d
    assert np.abs(change).max() > 0.0
    assert np.allclose(slope, change, rtol=0, atol=1e-7 * np.abs(change).max())


# statics


def test_a_beam_lies_on_the_floor_with_the_weight_that_the_clamp_leaves():
    """Its free part is that of the elastica, its end lies flat."""
    b = beam(ElementBeamCable(5), 32, nu=0.0)
    scene = Scene(b).clamp("left").gravity((0, -9.81)).obstacle(Line((0, -0.055)), stiffness=1e12)
    state = scene.solve_static()
    assert state.stability == "stable" and state.contact().penetration < 1e-6
    weight = 7800 * 1e-4 * 9.81
    assert np.allclose(state.contact().total, [0, weight - state.reactions("left").force[1]],
                       atol=1e-9 * weight)
    EI = 2e8 * 1e-8 / 12

    def right(s, y, p):
        """Angle, moment, height over the part s of the free length p[0]; V p[1] at the clamp."""
        V = p[1] - weight * s * p[0]
        return p[0] * np.array([y[1] / EI, V * np.cos(y[0]), np.sin(y[0])])

    def ends(a, b, p):
        return np.array([a[0], a[2], b[0], b[1], b[2] + 0.05])

    s = np.linspace(0, 1, 41)
    guess = np.array([-0.25 * s * (1 - s), -0.1 * (4 - 16 * s + 12 * s**2), -0.05 * s])
    found = solve_bvp(right, ends, s, guess, p=[0.53, 0.35 * weight], tol=1e-8)
    assert found.success
    free = found.p[0]
    x = np.linspace(0.05, 0.95 * free, 7)
    heights = state.position([(a, 0) for a in x])[1]
    assert np.allclose(heights, found.sol(x / free)[2], rtol=0, atol=5e-6)


def test_a_strip_pressed_on_a_cylinder_wraps_it():
    """Where it touches its axis has the curvature 1 / (R + h / 2); beyond it is an elastica."""
    R, h, L, E = 0.3, 0.004, 0.5, 2e9
    b = Beam(MeshBeam.init_line(np.linspace(0, L, 41), h), ElementBeamCable(5),
             StVenantKirchhoff(E, 0.0), width=1.0)
    F = 250.0
    scene = Scene(b).clamp("left").point_force((0, -F), (L, 0))
    scene.obstacle(Circle((0, -R - h / 2), R), stiffness=1e13)
    state = scene.solve_static()
    r, EI = R + h / 2, E * h**3 / 12

    def right(s, y, p):
        """Angle, curvature over the free length p[0], from where the circle is left."""
        return p[0] * np.array([y[1], F / EI * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a, b, p):
        angle = -(L - p[0]) / r
        return np.array([a[0] - angle, a[1] + 1 / r, b[1], a[2] + r * np.sin(angle),
                         a[3] + r - r * np.cos(angle)])

    s = np.linspace(0, 1, 41)
    guess = np.array([-0.8 - 0.5 * s, -3 + 3 * s, 0.2 + 0.2 * s, -0.1 - 0.2 * s])
    found = solve_bvp(right, ends, s, guess, p=[0.15], tol=1e-8)
    assert found.success
    tip = found.y[2:, -1]
    assert np.allclose(state.position((L, 0)), tip, rtol=0, atol=1e-4 * L)
    wrapped = L - found.p[0]
    assert wrapped > 0.1
    at = np.linspace(0.02, 0.8 * wrapped, 9)
    kappa = [state.resultants((a, 0), recover=False).curvature for a in at]
    assert np.allclose(np.abs(kappa), 1 / r, rtol=1e-4)


@pytest.mark.parametrize("shape", [Circle((0.8, -0.06), 0.05), SignedDistance(
    lambda x, y: np.sqrt((x - 0.8) ** 2 + (y + 0.06) ** 2) - 0.05)], ids=["circle", "distance"])
def test_a_stop_holds_a_leaf_spring_as_a_support_does(shape):
    """Beyond the gap the force of the stop is that of a propped cantilever."""
    b = beam(ElementBeamCable(5), 20, height=0.002, nu=0.0)
    EI, F, a = 2e8 * 0.01 * 0.002**3 / 12, 2e-4, 0.8
    state = Scene(b).clamp("left").point_force((0, -F), (1, 0)).obstacle(
        shape, stiffness=1e13).solve_static()
    gap = 0.009
    # deflection at a by F at the end, less that by the stop's force there
    R = (F * a**2 * (3 - a) / 6 - EI * gap) * 3 / a**3
    contact = state.contact()
    assert R > 0 and abs(contact.total[1] / R - 1) < 5e-3
    assert np.allclose(contact.points.mean(axis=1), [0.8, -0.01], atol=0.02)
    assert state.stability == "stable"


def test_an_elastica_between_walls_touches_both():
    """A strip held in its middle's height buckles to an S, and touches each wall in a point."""
    h, d, way, m = 0.004, 0.028, 0.009, 2e-3
    b = beam(ElementBeamCable(5), 32, height=h, nu=0.0)
    scene = Scene(b).clamp("left").fix("right", "r^1", -way).fix("right", ["r^2", "r_X^2"])
    scene.fix(lambda x: np.abs(x[0] - 0.5) < 1e-9, "r^2").moment((0.5, 0), m)
    scene.obstacle(Line((0, 0.03), (0, -1)), stiffness=1e10)
    scene.obstacle(Line((0, -0.03), (0, 1)), stiffness=1e10)
    state = scene.solve_static(first_step=0.1)
    walls = state.contact(0), state.contact(1)
    assert state.stability == "stable" and max(w.penetration for w in walls) < 5e-6
    EI, EA = 2e8 * 0.01 * h**3 / 12, 2e8 * 0.01 * h

    def right(s, y, p):
        """Angle, moment, x, y from the clamp to the wall, and from there to the middle."""
        thrust, shear, wall, at = p
        out = []
        for z, V, length in ((y[:4], shear, at), (y[4:], shear + wall, 0.5 - at)):
            cos, sin = np.cos(z[0]), np.sin(z[0])
            stretch = 1 - (thrust * cos - V * sin) / EA
            out += [length * f for f in (z[1] / EI, -thrust * sin - V * cos, stretch * cos,
                                         stretch * sin)]
        return np.array(out)

    def ends(a, b, p):
        return np.array([a[0], a[2], a[3], b[0], b[3] + d, a[4], a[5] - b[1], a[6] - b[2],
                         a[7] + d, b[5] - m / 2, b[6] - 0.5 + way / 2, b[7]])

    s = np.linspace(0, 1, 41)
    wave = 0.5 * d * (np.cos(np.pi * s) - 1)
    guess = np.array([-0.2 * np.sin(np.pi * s), -EI * np.cos(np.pi * s), 0.3 * s, wave,
                      0.2 * np.sin(np.pi / 2 * s), EI * np.cos(np.pi / 2 * s), 0.3 + 0.2 * s,
                      -d * np.cos(np.pi / 2 * s)])
    found = solve_bvp(right, ends, s, guess, p=[18 * np.pi**2 * EI, 0.1, -0.3, 0.31], tol=1e-8)
    assert found.success
    thrust, wall = found.p[[0, 2]]
    assert abs(state.reactions("left").force[0] / thrust - 1) < 3e-3
    assert abs(walls[1].total[1] / abs(wall) - 1) < 1e-2
    assert np.allclose(walls[0].total, -walls[1].total, rtol=1e-6, atol=1e-9)
    assert np.allclose(walls[1].points.mean(axis=1)[0], found.y[2, -1], atol=0.01)


def test_a_buckled_strip_at_a_wall_by_the_augmented_lagrangian():
    """Pushed lengthwise until it touches a wall in its middle: the force of an extensible elastica.

    Beyond 80.8 E I / L^2 the strip alone is unstable, and multipliers of a soft obstacle diverge.
    """
    h, d, way, aside = 1e-3, 0.02, 1.06e-3, 0.01
    E = 12.0 / h**3  # E I = 1
    EA = E * h
    strip = Beam(MeshBeam.init_line(np.linspace(0, 1, 41), h), ElementBeamCable(5),
                 StVenantKirchhoff(E, 0.0), width=1.0)
    scene = Scene(strip).clamp("left").fix("right", ["r^2", "r_X^2"]).point_force(
        (0, aside), at=(0.5, 0)).obstacle(Line((0, d + h / 2), (0, -1)), method="augmented")
    state = scene.fix("right", "r^1", displacement=lambda t: -way * t).run(1.0).state(-1)

    def right(s, y, p):
        cos, sin = np.cos(y[0]), np.sin(y[0])
        stretch = 1 - (p[0] * cos - p[1] * sin) / EA
        return np.array([y[1], -p[0] * sin - p[1] * cos, stretch * cos, stretch * sin])

    def ends(a, b, p):
        return np.array([a[0], a[2], a[3], b[0], b[2] - 0.5 + way / 2, b[3] - d])

    s = np.linspace(0, 0.5, 41)
    guess = np.array([np.pi * d * np.sin(2 * np.pi * s), 2 * np.pi**2 * d * np.cos(2 * np.pi * s),
                      s, 0.5 * d * (1 - np.cos(2 * np.pi * s))])
    found = solve_bvp(right, ends, s, guess, p=[90.0, -3.0], tol=1e-7)
    assert found.success
    thrust, shear = found.p
    assert state.reactions("left").force[0] == pytest.approx(thrust, rel=5e-4)
    assert state.contact().total[1] == pytest.approx(-2 * abs(shear) - aside, rel=2e-3)
    assert state.contact().penetration <= 1e-5 * h


@pytest.mark.parametrize("degree", [3, 5])
def test_a_rope_on_a_pulley_has_the_capstan_ratio(degree):
    """exp(mu pi) where it slips all round, pulled against a spring; Euler, Eytelwein."""
    R, h, k, mu = 0.5, 0.004, 1e3, 0.3
    r, tail = R + h / 2, 0.3

    def axis(s):
        s = np.asarray(s, dtype=float)
        phi = np.clip((s - tail) / r, 0, np.pi)
        up, down = np.minimum(s - tail, 0), np.maximum(s - tail - np.pi * r, 0)
        return np.array([-r * np.cos(phi), r * np.sin(phi) + up - down])

    end = tail + np.pi * r
    s = np.concatenate([[0, tail / 2], np.linspace(tail, end, 17), [end + tail / 2, end + tail]])
    rope = Beam(MeshBeam.init_curve(axis, s, h), ElementBeamCable(degree),
                StVenantKirchhoff(1e7, 0.0), width=1.0)
    scene = Scene(rope).fix("left", "r^1").fix("right", "r^1").fix("right", "r^2", -0.05)
    scene.spring(k, between=((-r, -tail), (-r, -tail - 1)))
    scene.obstacle(Circle((0, 0), R - 2e-5), friction=mu, stiffness=1e7)
    state = scene.solve_static()
    pull = -state.reactions("right").force[1]
    hold = k * state.displacement((-r, -tail))[1]
    assert abs(pull / hold / np.exp(mu * np.pi) - 1) < 5e-3
    assert "friction" in state.verdict.note and state.stability == "stable"
    assert np.allclose(state.contact().total[1], pull + hold, rtol=1e-6)


def test_friction_holds_what_sticks_and_gives_way_at_its_limit():
    """A strip between a wall and a stamp: pulled by less than mu N it stays, by more it slips."""
    b = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamANCF(2),
             StVenantKirchhoff(2e8, 0.0), width=0.01)
    pressure, mu = 1e4, 0.4
    limit = mu * pressure * 0.01

    def pulled(force):
        scene = Scene(b).spring(1.0, between=((1, 0), (2, 0)))
        scene.foundation(1e-3, side="top").pressure("top", pressure)
        scene.point_force((force, 0), (1, 0)).obstacle(Line((0, -0.01)), friction=mu)
        return scene, scene.solve_static(first_step=0.25)

    (scene, held), (_, slipped) = pulled(0.5 * limit), pulled(1.5 * limit)
    again = scene.solve_static(start=held)  # its anchors too
    assert np.allclose(again.u, held.u, rtol=0, atol=1e-9)
    assert abs(held.displacement((0, 0))[0]) < 1e-4
    assert np.allclose(held.contact().total, [-0.5 * limit, pressure * 0.01], rtol=2e-2)
    assert np.allclose(slipped.contact().total, [-limit, pressure * 0.01], rtol=2e-2)
    assert slipped.displacement((0, 0))[0] > 1.0


def test_a_thin_ring_on_the_floor_takes_tens_of_iterations():
    """Half of it; pressed so far that it leaves the floor in the middle, as rings do."""
    R, h, n = 0.5, 1e-3, 32
    EI = 2e8 * 0.01 * h**3 / 12
    s = np.linspace(0, np.pi * R, n + 1)
    arc = Beam(MeshBeam.init_curve(
        lambda s: np.array([R * np.sin(np.asarray(s) / R), R - R * np.cos(np.asarray(s) / R)]),
        s, h), ElementBeamCable(5), StVenantKirchhoff(2e8, 0.3), width=0.01)
    held = ["r^1", "r_X^2"]
    scene = Scene(arc).fix("left", held).fix("right", held).spring(
        1e-3 * EI / R**3, between=((0, 2 * R), (0, 3 * R)))
    scene.point_force((0, -3 * EI / R**2), (0, 2 * R)).obstacle(Line((0, -h / 2)))
    state = scene.solve_static()
    contact = state.contact()
    assert state.iterations < 105 and contact.penetration < 1e-2 * h
    assert contact.points[0].min() > 0.1 * R and state.displacement((0, 0))[1] > 1e-2 * h
    assert abs(contact.total[1] / (3 * EI / R**2) - 1) < 2e-3


def taut_belt(stiffness=None, R=0.5, h=2e-4, way=1e-2, **options):
    """On a quarter of a pulley, guided along both tangents, pulled by a way at one end."""
    axis = MeshBeam.init_curve(lambda s: (R + h / 2) * np.array([np.sin(s), np.cos(s)]),
                               np.linspace(0, 0.5 * np.pi, 17), h)
    band = Beam(axis, ElementBeamCable(5), StVenantKirchhoff(2e8, 0.0, 1000), width=1.0)
    scene = Scene(band).fix("left", ["r^1", "r_X^2"]).fix("right", "r_X^1")
    scene.fix("right", "r^2", -way)
    return scene.obstacle(Circle((0, 0), R - 1e-6), stiffness=stiffness, **options)


def test_a_taut_belt_has_its_tension_at_the_default_stiffness():
    """E A times the way over the length; over the radius it is the pressure."""
    R, h, way = 0.5, 2e-4, 1e-2
    state = taut_belt().solve_static()
    strain = way / (0.5 * np.pi * (R + h / 2))
    wanted = 2e8 * h * strain
    tension = abs(state.reactions("right").force[1])
    assert tension == pytest.approx(wanted, rel=1e-3)
    assert state.contact().penetration < 0.05 * h and state.iterations < 30
    assert np.median(state.contact().pressure) * R == pytest.approx(tension, rel=2e-2)


def hung_belt(element, h, mu, wrap, R=0.5, tail=0.3, stretch=1e-3, way=2e-2, **options):
    """A belt over a part of a pulley, its stress-free shape, weighted at one end and pulled."""
    r = R + h / 2
    end, out = tail + wrap * r, np.array([np.sin(wrap), np.cos(wrap)])

    def axis(s):
        s = np.asarray(s, dtype=float)
        phi = np.clip((s - tail) / r, 0, wrap)
        up, on = np.minimum(s - tail, 0), np.maximum(s - end, 0)
        return np.array([-r * np.cos(phi) + out[0] * on, r * np.sin(phi) + up + out[1] * on])

    on = np.linspace(tail, end, round(24 * wrap / np.pi) + 1)
    s = np.concatenate([[0, tail / 2], on, [end + tail / 2, end + tail]])
    belt = Beam(MeshBeam.init_curve(axis, s, h), element, StVenantKirchhoff(2e8, 0.0), width=1.0)
    weight = stretch * 2e8 * h
    scene = Scene(belt).fix("left", ["r^1", "r_X^1"])
    scene.point_force((0, -weight), at=tuple(axis(0.0)))
    scene.fix("right", "r^1", way * out[0]).fix("right", "r^2", way * out[1])
    scene.obstacle(Circle((0, 0), R - 2e-5), friction=mu, **options)
    return scene, lambda state: state.reactions("right").force @ out / weight


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)],
                         ids=["sections", "cable"])
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 0.6])
@pytest.mark.parametrize("wrap", [0.5 * np.pi, np.pi], ids=["quarter", "half"])
@pytest.mark.parametrize("h", [5e-2, 5e-3, 5e-4])
def test_belts_slip_by_the_capstan_ratio_at_the_default_stiffness(element, mu, wrap, h):
    """exp(mu phi), Euler, Eytelwein; and the integral of the pressure of it, (T2 - T1) / mu."""
    scene, ratio = hung_belt(element, h, mu, wrap)
    state = scene.solve_static()
    assert state.iterations <= 115 and state.contact().penetration < 0.1 * h
    if h < 0.05:  # a thick belt is bent where it goes on, and stretched where it goes off
        wanted = np.exp(mu * wrap)
        assert ratio(state) == pytest.approx(wanted, rel=1e-2)
        pushed = np.hypot(*state.contact().force).sum() / (1e-3 * 2e8 * h * np.hypot(1.0, mu))
        assert pushed == pytest.approx((wanted - 1.0) / mu if mu > 0.0 else wrap, rel=2e-2)


def test_the_augmented_lagrangian_leaves_the_penetration_that_was_asked_for():
    def lying(**options):
        return Scene(beam(ElementBeamCable(5), 32)).clamp("left").gravity((0, -9.81)).obstacle(
            Line((0, -0.05)), stiffness=1e9, **options).solve_static()

    soft, exact = lying(), lying(method="augmented", tolerance=1e-7)
    assert soft.contact().penetration > 1e-6 and exact.contact().penetration < 1e-7
    hard = Scene(beam(ElementBeamCable(5), 32)).clamp("left").gravity((0, -9.81)).obstacle(
        Line((0, -0.05)), stiffness=1e13).solve_static()
    at = [(x, 0) for x in np.linspace(0, 1, 21)]
    assert np.allclose(exact.position(at), hard.position(at), rtol=0, atol=1e-6)
    assert np.allclose(exact.reactions("left").force + exact.contact().total,
                       [0, 7800 * 1e-4 * 9.81], atol=1e-7)


# motion


@pytest.mark.parametrize("element", ELEMENTS, ids=["sections", "cable"])
@pytest.mark.parametrize("shape", [Line((0, -0.03)), Circle((0.45, -0.23), 0.2)],
                         ids=["line", "circle"])
def test_energy_is_kept_by_a_beam_that_bounces(element, shape):
    b = beam(element, 6, height=0.02)
    history = Scene(b).gravity((0, -9.81)).obstacle(shape).integrate(0.15, 5e-4)
    assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy.max()
    nearest = [state.contact().nearest for state in history]
    assert min(nearest) < -1e-6 and nearest[-1] > -1e-3 and max(nearest[-60:]) > 0


def test_a_beam_that_falls_on_the_floor_comes_to_rest_on_it():
    b = beam(ElementBeamCable(3), 4, height=0.02)
    scene = Scene(b).gravity((0, -9.81)).obstacle(Line((0, -0.015)), stiffness=1e8, damping=2.0)
    history = scene.damping(mass=30.0, stiffness=1e-4).integrate(0.3, 1e-3)
    last, late = history.state(-1), history.states(range(200, 300))
    weight = 7800 * 0.02 * 0.01 * 9.81
    force = np.mean([state.contact().total for state in late], axis=0)
    assert np.allclose(force, [0, weight], atol=1e-2 * weight)
    assert np.abs(last.v).max() < 2e-2 and history.dissipated[-1] > 0.9 * weight * 0.005
    assert np.ptp(history.total_energy + history.dissipated) < 1e-8 * weight


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_a_wall_that_moves_bounces_a_beam_off_with_twice_its_velocity(scheme):
    b = beam(ElementBeamCable(3), 2, height=0.02)
    scene = Scene(b).obstacle(Line((0, -0.0105)), position=lambda t: (0.0, 0.5 * t),
                              stiffness=1e7)
    history = scene.integrate(0.04, 5e-4, scheme=scheme)
    p = history.momentum[-1, 1] / (7800 * 0.02 * 0.01)
    assert abs(p - 1) < (1e-3 if scheme == "energy-momentum" else 0.02)


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_a_beam_slides_down_a_slope_as_coulomb_says(scheme):
    """With the acceleration g (sin a - mu cos a); what friction takes is in the balance."""
    a, mu, g = np.radians(30), 0.3, 9.81
    b = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), height=0.02), ElementBeamCable(3),
             StVenantKirchhoff(2e8, 0.3, 7800), width=0.02)
    scene = Scene(b).gravity((g * np.sin(a), -g * np.cos(a))).obstacle(
        Line((0, -0.01)), friction=mu, stiffness=1e8, damping=1.0)
    history = scene.integrate(0.15, 1e-3, scheme=scheme)
    speed = history.momentum[:, 0] / (7800 * 0.02**2)
    slope = np.polyfit(history.t[50:], speed[50:], 1)[0]
    assert abs(slope / (g * (np.sin(a) - mu * np.cos(a))) - 1) < 1e-2
    energy = history.total_energy + history.dissipated
    assert np.ptp(energy) < (1e-9 if scheme == "energy-momentum" else 1e-2) * history.dissipated[-1]


def test_schemes_that_go_back_in_time_refuse_friction():
    scene = Scene(beam()).obstacle(Line((0, -0.5)), friction=0.1)
    with pytest.raises(InputError, match="back in time"):
        scene.integrate(1e-3, 1e-3, scheme="energy-momentum-4")


# around it


def still(t):
    return 0.0, 0.001 * np.sin(t)


def test_outlines_are_in_files_and_pictures(tmp_path):
    meshio = pytest.importorskip("meshio")
    b = beam(ElementBeamCable(3), 4, height=0.02)
    scene = Scene(b).gravity((0, -9.81)).obstacle(
        Circle((0.5, -0.3), 0.2), position=lambda t: (t, 0.0)).obstacle(
            SignedDistance(lambda x, y: y + 0.3 + 0 * x))
    history = scene.integrate(2e-3, 1e-3)
    history.state(-1).save(tmp_path / "one.vtu")
    lines = meshio.read(tmp_path / "one_obstacles.vtu")
    assert [c.type for c in lines.cells] == ["line"]
    which = lines.cell_data["obstacle"][0]
    at = lines.points[lines.cells[0].data]
    rim = at[which == 0].reshape(-1, 3)
    assert np.allclose(np.hypot(rim[:, 0] - 0.502, rim[:, 1] + 0.3), 0.2)
    # the second is below the box that is drawn: the first only, or a line at its height
    assert np.allclose(at[which == 1][..., 1], -0.3)
    history.save(tmp_path / "run.pvd")
    text = (tmp_path / "run.pvd").read_text()
    assert text.count('part="1"') == 3 and (tmp_path / "run_00002_obstacles.vtu").exists()
    plain = Scene(b).gravity((0, -9.81)).integrate(1e-3, 1e-3)
    plain.state(-1).save(tmp_path / "plain.vtu")
    assert not (tmp_path / "plain_obstacles.vtu").exists()
    ax = history.state(-1).plot()
    drawn = [len(c.get_segments()) for c in ax.collections if hasattr(c, "get_segments")]
    assert sum(n >= 96 for n in drawn) == 1
    history.animate(tmp_path / "run.gif")
    pytest.importorskip("pyvista")
    series = history.to_pyvista()
    first = series.mesh["obstacle 0"].points.copy()
    series.update(2)
    assert np.allclose(series.mesh["obstacle 0"].points - first, [0.002, 0, 0], atol=1e-6)


# what is wrong


@pytest.mark.parametrize("make, message", [
    (lambda: Circle((0, 0), -1.0), "radius must be positive"),
    (lambda: Circle((0, np.nan), 1.0), "center"),
    (lambda: Line((0, 0), (0, 0)), "normal must not be zero"),
    (lambda: Polygon([(0, 0), (1, 0)]), "three corners"),
    (lambda: Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), r"from \(0, 0\) to \(1, 1\) and .* cross"),
    (lambda: Polygon([(0, 0), (1, 0), (1, 0), (0, 1)]), "one place"),
    (lambda: Polygon([(0, 0), (1, 0), (np.inf, 1)]), "finite"),
    (lambda: Polygon([(0, 0), (1, 0), (0, 1)], radius=-1), "radius"),
    (lambda: SignedDistance(3.0), "function"),
])
def test_shapes_that_are_none_say_so(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("shape, message", [
    (Line((0, -0.001)), "0.004 deep"),
    (Circle((0.5, -0.1), 0.0977), "0.0027 deep"),
    (Circle((0.53, 0.0), 0.002), "inside of"),
    (Circle((0.5, 0.0), 0.4, hollow=True), "cuts the body"),
])
def test_an_obstacle_that_cuts_the_body_at_the_start_is_refused(shape, message):
    scene = Scene(beam()).clamp("left").obstacle(shape)
    for solve in (scene.solve_static, lambda: scene.integrate(0.01, 0.01), lambda: scene.run(1.0),
                  scene.continuation, lambda: scene.modes(1)):
        with pytest.raises(InputError, match=message):
            solve()


def hooked(element):
    """A clamped strip, bent down and free, in two scenes."""
    strip = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.02), element,
                 StVenantKirchhoff(2e8, 0.3), width=0.02)
    return (Scene(strip).clamp("left").point_force((0, -1.5), at=(1, 0)),
            Scene(strip).clamp("left"))


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)])
@pytest.mark.parametrize("shape", [Circle((0.9, 0.05), 0.1), Circle((0.9, 0.0), 0.003)])
def test_an_obstacle_is_judged_at_the_start_of_an_assembly(element, shape):
    """Let go under the obstacle, the strip rests against it, with the force of beam theory."""
    bent, free = hooked(element)
    start = bent.solve_static()
    assert start.displacement((1, 0))[1] < -0.15
    free.obstacle(shape)
    with pytest.raises(InputError, match="cuts the body at the start"):
        free.solve_static()
    held = free.solve_static(start=start)
    assert held.stability == "stable"
    far, turn = shape.radius + 0.01, 0.0
    for _ in range(20):  # the axis at the contact, turned by 3 w / (2 a) there
        a, w = shape.center[0] - far * np.sin(turn), far * np.cos(turn) - shape.center[1]
        turn = 1.5 * w / a
    force = 3.0 * 2e8 * 0.02**4 / 12.0 * w / a**3
    for state in (held, free.run(1.0, increments=2, start=start).state(-1)):
        assert abs(np.hypot(*state.contact().total) / force - 1) < 0.02


@pytest.mark.parametrize("f, message", [
    (lambda x, y: 1.0, "shape"),
    (lambda x, y: (x, y), "shape"),
    (lambda x, y: np.nan * x, "finite"),
    (lambda x, y: 5.0 * (y + 1.0), "slope is 1"),
    (lambda x, y: {}["a"], "KeyError"),
])
def test_distance_functions_that_are_none_say_so(f, message):
    with pytest.raises(CallbackError, match=message):
        Scene(beam()).obstacle(SignedDistance(f))


def test_linear_solutions_that_enter_an_obstacle_are_refused():
    """Far from it they are what they are without it."""
    hanging = Scene(beam()).clamp("left").gravity((0, -0.1))
    free = hanging.solve_linear()
    hanging.obstacle(Line((0, -0.5)))
    np.testing.assert_allclose(hanging.solve_linear().u, free.u, rtol=0, atol=1e-12)
    with pytest.raises(InputError, match="solve_linear.. knows no contact"):
        Scene(beam()).clamp("left").gravity((0, -9.81)).obstacle(Line((0, -0.1))).solve_linear()


def test_buckling_loads_beyond_a_contact_are_refused():
    """A column that the load bends aside: a wall close by is touched before it buckles."""
    def column(distance):
        scene = Scene(beam()).clamp("left").point_force((-1.0, -1e-2), at=(1, 0))
        return scene.obstacle(Line((0, -distance)))

    assert column(0.5).buckling(1).factors[0] > 0.0
    with pytest.raises(InputError, match="touches before it buckles"):
        column(0.0051).buckling(1)


def on_a_slope(degrees, mu=0.3, element=None, **options):
    """A beam that lies on it; gravity is turned, not the slope."""
    a, g = np.radians(degrees), 9.81
    b = beam(ElementBeamCable(3) if element is None else element, 2, height=0.02)
    return Scene(b).gravity((g * np.sin(a), -g * np.cos(a))).obstacle(
        Line((0, -0.01)), friction=mu, **options)


@pytest.mark.parametrize("scheme, still", [
    ("energy-momentum", 1e-6), ("generalized-alpha", 1e-5)])
def test_a_beam_rests_on_a_slope_below_the_angle_of_friction(scheme, still):
    """Once what its weight, put on at once, has shaken has come to rest."""
    history = on_a_slope(10, stiffness=1e8, damping=20.0).integrate(
        0.18, 1e-3, scheme=scheme)
    late, weight = history.t > history.t[-1] - 0.02, 7800 * 0.02 * 0.01 * 9.81
    assert np.abs(history.v[-1]).max() < still
    assert np.ptp(history.u[late], axis=0).max() < 1e-2 * still
    push = history.state(-1).contact().total
    assert np.allclose(push, weight * np.array([-np.sin(np.radians(10)), np.cos(np.radians(10))]),
                       rtol=0, atol=10 * still * weight)
    assert np.ptp(history.total_energy + history.dissipated) < (
        1e-9 if scheme == "energy-momentum" else 0.2) * history.dissipated[-1]


@pytest.mark.parametrize("ratio", [1.0, 0.1])
def test_an_impact_goes_in_as_deep_as_the_guide_says(ratio):
    """v sqrt(density height / stiffness)."""
    b, h = beam(ElementBeamCable(5), 4, height=0.02), 0.02
    stiffness = ratio * 2e8 / h
    time = np.sqrt(7800 * h / stiffness)
    scene = Scene(b).gravity((0, -9.81)).obstacle(Line((0, -0.02)), stiffness=stiffness, width=1e-7)
    history = scene.integrate(0.05, 0.5 * time)
    deepest = max(state.contact().penetration for state in history)
    assert abs(deepest / (np.sqrt(2 * 9.81 * 0.01) * time) - 1) < 0.05


@pytest.mark.parametrize("scheme, why", [
    ("generalized-alpha", "up to 3 times"), (GeneralizedAlpha(0.5), "up to 2.4 times"),
    ("newmark", "up to 3 times"), ("radau", "do not update")], ids=repr)
def test_schemes_that_do_not_take_the_augmented_lagrangian_name_one_that_does(scheme, why):
    scene = Scene(beam()).obstacle(Line((0, -0.5)), method="augmented")
    with pytest.raises(InputError, match=f"{why}.*energy-momentum.*GeneralizedAlpha\\(0\\)"):
        scene.integrate(1e-3, 1e-3, scheme=scheme)


def test_what_points_cannot_see_is_said():
    """The smallest of circles, and a rule that is the caller's."""
    scene = Scene(beam(ElementBeamCable(5), 8)).clamp("left")
    with pytest.warns(ModelWarning, match="apart"):
        scene.obstacle(Circle((0.6, -0.02), 0.002), points=7)
    group = scene.obstacle(Circle((0.6, -0.1), 0.05)).system.forces.contacts.obstacles[1].groups[0]
    x, areas = group.starts[0, :group.points // 2], group.areas[:group.points // 2]
    assert np.diff(x).max() < np.sqrt(8 * 0.01 * 0.05 * 0.01) and np.all(areas > 0)
    assert abs(areas.sum() - 0.01 / 8) < 1e-15 and abs(areas @ x**3 - 0.01 * (1 / 8)**4 / 4) < 1e-15


# what lies in the way


def turning_rod(pin, stiffness=None):
    """A rod of 1 m turns about its left end at 10 rad/s, towards what stands in its way."""
    rod = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamCable(3),
               StVenantKirchhoff(2e9, 0.3, 1000), width=0.01)
    return Scene(rod).pin("left").obstacle(pin, stiffness=stiffness).initial_velocity(
        lambda x: 10.0 * np.array([-x[1], x[0]]))


PIN = Circle((0.8 * np.cos(0.468), 0.8 * np.sin(0.468)), 0.002)


@pytest.mark.filterwarnings("ignore:a body was .* deep")
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_a_pin_that_a_step_would_jump_over_stops_a_rod(scheme, monkeypatch):
    """Of 2 mm, in steps in which the rod goes 40 mm there."""
    found = {}
    for sweeps in (True, False):
        if not sweeps:
            monkeypatch.setattr("skfem_ancf.actions.contact.contacts.Contacts.sweeps", False)
        history = turning_rod(PIN).integrate(0.06, 5e-3, scheme=scheme)
        found[sweeps] = history.angular_momentum[-1], history.substeps
    assert abs(found[False][0] - 1 / 3) < 1e-3 and found[False][1] == 0
    assert found[True][0] < 0.1 and found[True][1] > 2


# driven against friction


def driven_arm(scheme, **motor):
    """An arm turned about its left end, whose tip rubs on a ring: its history, and the motor."""
    arm = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.05), ElementBeamCable(3),
               StVenantKirchhoff(2e9, 0.3, 1000), width=0.01)
    scene = Scene(arm).pin("left").damping(stiffness=2e-4).obstacle(
        Circle((0, 0), np.hypot(1, 0.025), hollow=True), friction=0.2, stiffness=1e9)
    made = scene.motor((arm, "left"), **motor)
    return scene.integrate(0.05, 2e-4, scheme=scheme), made


def rubbing_moment(history, window):
    """mu N R of the tip, its mean: Coulomb's law by the pressures alone."""
    found = [history.state(k).contact() for k in window]
    normal = [-np.sum(c.points * c.force) / np.hypot(1, 0.025) for c in found]
    return 0.2 * np.hypot(1, 0.025) * np.mean(normal)


def turned(history):
    """The angle of the arm's left end."""
    return np.unwrap(np.arctan2(history.u[:, 3], 1.0 + history.u[:, 2]))


@pytest.mark.parametrize("scheme, small", [("energy-momentum", 1e-10), ("generalized-alpha", 5e-3)])
def test_a_torque_that_drives_against_friction_is_in_the_balance(scheme, small):
    """Its work is what vibrates, moves and is lost; its moment turns the arm and rubs."""
    history, _ = driven_arm(scheme, torque=60.0)
    work = 60.0 * turned(history)
    energy = history.kinetic_energy + history.strain_energy + history.dissipated
    assert work[-1] > 10.0 and history.dissipated[-1] > 1.0
    assert np.abs(energy - energy[0] - work).max() < small * work[-1]
    window = slice(-60, None)
    L, t = history.angular_momentum[window], history.t[window]
    rubs = rubbing_moment(history, range(len(history.t) - 60, len(history.t)))
    assert rubs > 0.5 and abs(60.0 - (L[-1] - L[0]) / (t[-1] - t[0]) - rubs) < 0.03 * rubs


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0])
def test_modes_after_friction_has_slipped_are_those_of_points_that_stick(angle):
    """Slipped points are at the limit, on this side of it or on that by the last digit."""
    E, h, rho = 2e9, 0.01, 7800.0
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    mesh = MeshBeam.init_line(np.linspace(0, 1, 17), h, angle=angle)
    bent = Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(E, 0.3, rho), width=h))
    bent.clamp("left").point_force(turn @ [1.0, -4.0], at="right")
    bent.obstacle(Circle(tuple(turn @ [0.5, -0.1 - h / 2 - 0.002]), 0.1), friction=0.1)
    state = bent.solve_static()
    force = turn.T @ state.contact().total
    assert force[0] == pytest.approx(2.1505, rel=1e-3)  # slipped: the contact's normal is inclined
    found = bent.modes(4, state).frequencies
    assert np.allclose(found, [20.7021, 123.9823, 158.6258, 337.6570], rtol=1e-4)
    matrices, free = bent.matrices(state), bent.free
    Z = null_space(matrices.J[:, free].toarray())
    K, M = (Z.T @ A[free][:, free] @ Z for A in (matrices.K, matrices.M))
    squares = np.sort(1.0 / np.linalg.eigvals(np.linalg.solve(K, M)).real)
    assert np.allclose(squares[:4], found**2, rtol=1e-3)


@pytest.mark.parametrize("element", ELEMENTS, ids=["sections", "cable"])
@pytest.mark.parametrize("angle", [0.0, -2.3, 1.0])
def test_a_beam_rests_on_a_circle_of_any_size_at_any_angle(element, angle):
    """Its middle sinks as on a flat floor: the radius has round-off, gaps and slips have none."""
    c, s = np.cos(angle), np.sin(angle)
    turn, x = np.array([[c, -s], [s, c]]), np.linspace(-0.5, 0.5, 9)
    mesh = MeshBeam.from_points((turn @ np.array([x, 0.0 * x])).T, 0.01)
    up, law = turn[:, 1], StVenantKirchhoff(2e8, 0.3, 7800.0)

    def sag(shape):
        scene = Scene(Beam(mesh, element, law, width=0.01)).gravity(-9.81 * up)
        state = scene.obstacle(shape, friction=0.3).solve_static()
        assert state.stability == "stable"
        assert np.allclose(state.contact().total, 7800 * 9.81 * 1e-4 * up, rtol=1e-7, atol=1e-6)
        return state.displacement((0, 0)) @ up

    flat = sag(Line(-0.0051 * up, up))
    assert flat == pytest.approx(-1e-4, rel=0.02)
    for radius in (2000.0, 1e5):
        assert sag(Circle(-(radius + 0.0051) * up, radius)) == pytest.approx(flat, rel=1e-3)


@pytest.mark.parametrize("angle", [0.0, -2.3, 1.0])
def test_a_pinned_rod_leans_on_a_circle_of_any_size(angle):
    """A stiff rod, pinned at one end, turns until it touches the circle in a point."""
    c, s = np.cos(angle), np.sin(angle)
    turn, x, radius, gap = np.array([[c, -s], [s, c]]), np.linspace(0.0, 1.0, 5), 3000.0, 0.001
    mesh = MeshBeam.from_points((turn @ np.array([x, 0.0 * x])).T, 0.01)
    rod = Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(2e14, 0.3), width=0.01)
    wall = Circle(turn @ np.array([1.5, -radius - 0.005 - gap]), radius)
    scene = Scene(rod).pin("left").point_force(turn @ np.array([0.0, -1.0]), at=turn[:, 0])
    state = scene.obstacle(wall).solve_static()
    tip = turn.T @ state.position(turn[:, 0])
    # its lower face is 0.005 below the axis; it touches at the tip, below the top of the circle
    drop = radius + 0.005 + gap - np.sqrt(radius**2 - 0.5**2)
    assert -tip[1] == pytest.approx(drop - 0.005, rel=1e-3)


def test_motions_and_paths_say_where_the_default_stiffness_yields():
    """A bar that heat presses on a wall: E A (alpha T - gap / L); a path does not stiffen the wall.

    With the stiffness of the finding it is right to 2 %.
    """
    law = StVenantKirchhoff(2e5, 0.0, 1e-9, thermal_expansion=1.2e-5)
    bar = Beam(MeshBeam.init_line(np.linspace(0, 100, 9), 10.0), ElementBeamANCF(2), law, width=1.0)
    right = 2e5 * 10.0 * (1.2e-5 * 200.0 - 0.1 / 100.0)

    def pressed(**options):
        return Scene(bar).clamp("left").temperature(200.0).obstacle(
            Line((100.1, 0), (-1, 0)), **options)

    state = pressed().solve_static()
    assert not state.checks.findings
    assert state.reactions("left").force[0] == pytest.approx(right, rel=1e-2)
    soft = pressed().continuation(max_load=1.0).state(-1)
    assert soft.reactions("left").force[0] < 0.9 * right
    (finding,) = soft.checks.findings
    assert "of default stiffness yields" in finding
    stiffness = float(re.search(r"stiffness=([\d.e+]+)", finding)[1])
    firm = pressed(stiffness=stiffness).continuation(max_load=1.0).state(-1)
    assert not firm.checks.findings
    assert firm.reactions("left").force[0] == pytest.approx(right, rel=2e-2)
    slow = Scene(bar).clamp("left").temperature(200.0, amplitude=lambda t: min(t, 1.0))
    history = slow.obstacle(Line((100.1, 0), (-1, 0))).integrate(1.0, 0.02)
    assert any("of default stiffness yields" in text for text in history.state(-1).checks.findings)
    assert not history.state(5).checks.findings  # before it touches


def test_slender_beams_that_lie_on_an_obstacle_have_no_such_finding():
    scene = Scene(beam(ElementBeamCable(3))).clamp("left").gravity((0, -9.81)).obstacle(
        Line((0, -0.05)))
    assert not scene.integrate(0.4, 2e-3).state(-1).checks.findings


def test_a_small_radius_slides_without_a_ripple():
    """Without friction the force along a strip is that of its slope under the circle."""
    h, L, R = 0.003, 0.03, 0.0005
    strip = Beam(MeshBeam.init_line(np.linspace(0, L, 7), height=h), ElementBeamANCF(2),
                 StVenantKirchhoff(2e9, 0.0, 1000.0), width=0.01)
    scene = Scene(strip).clamp("left").clamp("right").obstacle(
        Circle((0.4 * L, 0.5 * h + R), R),
        position=lambda t: (2e-3 * max(t - 1.0, 0.0), -1e-5 * min(t, 1.0)))
    run = scene.run([1.0, 2.0], increments=15)
    force = np.array([run.state(k).contact().total for k in range(15, 31)])
    assert np.all(force[:, 1] < -1.0) and np.all(np.abs(force[:, 0]) < -5e-3 * force[:, 1])


@pytest.mark.parametrize("scheme", ["generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_damped_impact_has_its_pressure_and_slips(scheme, damping):
    """A bar that lands flat and slides: the pressure is that of the force, with damping."""
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 9), height=0.05, origin=(0.0, 0.1)),
                ElementBeamANCF(2), StVenantKirchhoff(1e7, 0.3, 1000.0), width=0.02)
    scene = Scene(beam).gravity((0.0, -9.81)).initial_velocity((2.0, -3.0))
    scene.obstacle(Line((0.0, 0.0)), friction=0.2, damping=damping)
    history = scene.integrate(0.026, 5e-4, scheme=scheme)
    found = [history.state(k).contact() for k in range(len(history))]
    pressed = [contact for contact in found if len(contact)]
    assert len(pressed) > 2
    for contact in pressed[:3]:
        order = np.argsort(contact.points[0])
        total = 0.02 * trapezoid(contact.pressure[order], contact.points[0][order])
        assert total == pytest.approx(contact.total[1], rel=0.02)
        assert not contact.sticking.any()
