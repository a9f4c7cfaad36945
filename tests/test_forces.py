"""Force elements against closed forms: springs, dashpots, foundations, drag, masses, your own."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, MeshError, RigidBody, Scene, StVenantKirchhoff)
from skfem_ancf.actions.forces import ForceElement, point
from skfem_ancf.actions.forces.kernels import add_elastic_force, add_resisting_force
from skfem_ancf.core.quadrature import gauss

E, H = 2e8, 0.01
EI, RHO_A = E * H**4 / 12, 7800 * H**2
ELEMENTS = {"sections": ElementBeamANCF(2), "cable": ElementBeamCable(5)}


def beam_of(element="cable", ne=4, length=1.0, x0=0.0, y0=0.0, nu=0.3, h=H, **options):
    mesh = MeshBeam.init_line(x0 + np.linspace(0, length, ne + 1), h, origin=(0.0, y0))
    return Beam(mesh, ELEMENTS.get(element, element), StVenantKirchhoff(E, nu, 7800.0), h,
                **options)


def weighing(element="cable", hold="clamp"):
    return getattr(Scene(beam_of(element)), hold)("left").gravity((0, -9.81))


class Own(ForceElement):
    """The spring with a dashpot between two points, written once more."""

    def __init__(self, k, c, length, between, with_potential=True):
        self.k, self.c, self.length, self.between = k, c, length, between
        self.with_potential = with_potential

    def bind(self, scene):
        return [point(scene, None, at) for at in self.between]

    def force(self, x, v, t):
        d, w = x[1] - x[0], v[1] - v[0]
        size = np.sqrt(d @ d)
        f = (self.k * (size - self.length) + self.c * (d @ w) / size) / size * d
        return np.array([f, -f])

    def potential(self, x):
        size = np.sqrt(np.sum((x[1] - x[0]) ** 2))
        return 0.5 * self.k * (size - self.length) ** 2 if self.with_potential else None


SCENES = {
    "to the ground": lambda s: s.spring(20.0, ((1, 0), (1, 0.5)), damping=0.5),
    "between neighbours": lambda s: s.spring(20.0, ((0.5, 0), (0.75, 0)), damping=0.5, length=0.2),
    "far apart": lambda s: s.spring(5.0, ((0.1, 0), (1, 0)), damping=0.5, length=0.8),
    "of no length": lambda s: s.spring(5.0, ((1, 0), (0.9, 0.1)), length=0.0),
    "torsion": lambda s: s.torsional_spring(5.0, at=(0.5, 0), damping=0.01),
    "foundation": lambda s: s.foundation(1e4, damping=10.0),
    "one-sided": lambda s: s.foundation(1e4, one_sided=True, damping=10.0),
    "drag": lambda s: s.drag(1000.0, 1.2, 0.1),
    "mass": lambda s: s.point_mass(0.1, (1, 0), inertia=1e-3),
    "own": lambda s: s.add(Own(20.0, 0.5, 0.4, ((0.75, 0), (1, 0)))),
    "own, far apart": lambda s: s.add(Own(20.0, 0.5, 0.3, ((0.1, 0), (1, 0)))),
    "all": lambda s: s.spring(20.0, ((1, 0), (1, 0.5))).torsional_spring(1.0, (1, 0)).foundation(
        1e3).drag(100.0, 1.0).point_mass(0.05, (0.5, 0)).add(Own(5.0, 0.5, 0.3, ((0.1, 0), (1, 0))))
    .damping(mass=0.1, modal=[0.01]),
}


# derivatives


@pytest.mark.parametrize("name", [n for n in SCENES if n != "all"])
@pytest.mark.parametrize("element", ELEMENTS)
def test_derivatives_are_those_of_the_force(element, name):
    system = SCENES[name](weighing(element)).system
    rng = np.random.default_rng(0)
    forces, tables = system.forces, system.backend.tables.plain.forces
    u, v = 1e-3 * rng.standard_normal(system.N), rng.standard_normal(system.N)

    def matrix(factor, w):
        i, j, values = forces.entries(tables, 0.0, u, w, factor)
        out = np.zeros((system.N, system.N))
        np.add.at(out, (i, j), values)
        return out

    def elastic(x):
        out = np.zeros(system.N)
        add_elastic_force(tables, 0.0, 0.0, x, x, 0, out)
        return out

    def resisting(w):
        out = np.zeros(system.N)
        add_resisting_force(tables, 0.0, u, w, out)
        return out

    step = 1e-6
    K = np.array([(elastic(u + step * e) - elastic(u - step * e)) / (2 * step)
                  for e in np.eye(system.N)]).T
    C = np.array([(resisting(v + step * e) - resisting(v - step * e)) / (2 * step)
                  for e in np.eye(system.N)]).T
    for found, expected in ((matrix(0.0, 0.0 * v), K), (matrix(1.0, v) - matrix(0.0, v), C)):
        assert_allclose(found, expected, rtol=0, atol=2e-5 * max(np.abs(expected).max(), 1e-3))


# energy


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("element", ELEMENTS)
def test_balance_to_round_off_and_to_the_order_of_others(element, name):
    scene = SCENES[name](weighing(element))
    history = scene.integrate(0.1, 2e-3)
    assert np.ptp(history.total_energy + history.dissipated) < 1e-11
    assert np.all(np.diff(history.dissipated) >= -1e-14)
    other = scene.integrate(0.1, 1e-3, scheme="generalized-alpha")
    assert np.ptp(other.total_energy + other.dissipated) < 3e-4
    assert_allclose(other.displacement((1, 0))[-1], history.displacement((1, 0))[-1], rtol=0,
                    atol=1e-3)


def test_two_beams_on_a_spring_keep_their_momenta():
    a, b = beam_of("sections"), beam_of("sections", x0=0.3, y0=0.4)
    scene = Scene(a, b).spring(30.0, ((0, (0.5, 0)), (1, (0.8, 0.4))), length=0.2, damping=0.3)
    scene.initial_velocity(lambda x: np.array([0.0 * x[0], 1.0 * x[0]]), beam=1)
    history = scene.integrate(0.3, 2e-3)
    assert scene.system.forces.couples_far and history.dissipated[-1] > 1e-3
    assert np.ptp(history.total_energy + history.dissipated) < 1e-12
    assert np.abs(history.momentum - history.momentum[0]).max() < 1e-12
    assert np.ptp(history.angular_momentum) < 1e-12


def torsion(k, damping=0.0):
    def add(scene, a, b):
        beam, at = a if isinstance(a, tuple) else (None, a)
        scene.torsional_spring(k, at, damping, beam=beam, other=b)
    return add


@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_bodies_on_a_spring_by_collocation(damping):
    """Order 5 of Radau, against the equations of two points."""
    k, length, masses = 40.0, 0.7, np.array([2.0, 1.0])
    places = np.array([[0.0, 0.0], [1.0, 0.2]])
    bodies = [RigidBody(m, 0.1, position=x, name=str(m)) for m, x in zip(masses, places)]
    between = [RigidBody(1.0, 0.1, position=(x, 5.0), name=f"at {x}") for x in range(3)]
    scene = Scene(bodies[0], *between, bodies[1]).gravity((0.0, -9.81))
    scene.spring(k, ((bodies[0], places[0]), (bodies[1], places[1])), length=length,
                 damping=damping)
    scene.initial_velocity(lambda x: np.array([0.0, 2.0])[:, None] + 0.0 * x, bodies[1])

    def rates(t, y):
        x, v = y.reshape(2, 2, 2)
        d, w = x[1] - x[0], v[1] - v[0]
        size = np.sqrt(d @ d)
        f = (k * (size - length) + damping * (d @ w) / size) / size * d
        return np.concatenate([v, np.array([f, -f]) / masses[:, None] + [0.0, -9.81]]).ravel()

    start = np.array([places, [[0.0, 0.0], [0.0, 2.0]]]).ravel()
    known = solve_ivp(rates, (0.0, 1.0), start, "DOP853", rtol=1e-12, atol=1e-13).y[:4, -1]
    errors = []
    for n in (20, 40):
        history = scene.integrate(1.0, 1.0 / n, scheme="radau")
        found = [history.position(x, body)[-1] for x, body in zip(places, bodies)]
        errors.append(np.abs(np.ravel(found) - known).max())
        assert history.substeps == 0 and history.iterations < 3 * 17 * n
    assert scene.system.forces.couples_far and errors[1] < 1e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5, abs=0.5)


# statics


@pytest.mark.parametrize("element", ELEMENTS)
def test_cantilever_on_a_spring(element):
    k, P = 100.0, 1e-3
    scene = Scene(beam_of(element, 8, nu=0.0)).clamp("left").point_force((0, -P), at=(1, 0))
    scene.spring(k, ((1, 0), (1, -2)))
    w = -P / (3 * EI + k)
    for state in (scene.solve_static(), scene.solve_linear()):
        assert_allclose(state.displacement((1, 0))[1], w, rtol=2e-3)
    assert_allclose(state.reactions("left").force[1], P + k * w, rtol=5e-3)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_stiff_beam_on_a_torsional_spring(element):
    """k phi = m g L / 2 cos phi, and the frequency about it."""
    k = 10.0
    beam = beam_of(element, 2).replace(material=StVenantKirchhoff(2e15, 0.0, 7800.0))
    scene = Scene(beam).pin("left").gravity((0, -9.81)).torsional_spring(k, "left")
    phi = brentq(lambda a: k * a - 0.5 * RHO_A * 9.81 * np.cos(a), 0, 1)
    state = scene.solve_static()
    assert_allclose(state.displacement((1, 0)), [np.cos(phi) - 1, -np.sin(phi)], rtol=1e-4)
    omega = np.sqrt((k + 0.5 * RHO_A * 9.81 * np.sin(phi)) / (RHO_A / 3))
    assert_allclose(scene.modes(1, state).frequencies[0], omega, rtol=1e-4)
    turned = Scene(beam).pin("left").torsional_spring(k, "left", angle=2.9)
    start = scene.state(_rotated(beam, 2.8))
    assert_allclose(turned.solve_static(start=start).position((1, 0)), [np.cos(2.9), np.sin(2.9)],
                    atol=1e-6)


def _rotated(beam, angle):
    c, s = np.cos(angle), np.sin(angle)
    q = beam.q0.reshape(-1, 2)
    return (q @ np.array([[c, s], [-s, c]]) - q).ravel()


@pytest.mark.parametrize("element", ELEMENTS)
def test_winkler_foundation_under_a_force(element):
    """An endless beam: w = P beta / (2 k), beta^4 = k / (4 E I), k the force per length."""
    k = 400.0
    beta = (k / (4 * EI)) ** 0.25
    beam = beam_of(element, 128, length=4.0, nu=0.0)
    scene = Scene(beam).fix((2, 0), "r^1").point_force((0, -1e-3), at=(2, 0)).foundation(k / H)
    state = scene.solve_static()
    assert_allclose(state.displacement((2, 0))[1], -1e-3 * beta / (2 * k), rtol=4e-3)


# frequencies and buckling


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=repr)
def test_cantilever_with_a_mass_as_its_own(element):
    """1 + cos b cosh b + b (cos b sinh b - sin b cosh b) = 0 (Euler-Bernoulli)."""
    b = brentq(lambda b: 1 + np.cos(b) * np.cosh(b) + b * (np.cos(b) * np.sinh(b)
                                                            - np.sin(b) * np.cosh(b)), 1.0, 1.5)
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 1e-3)
    beam = Beam(mesh, element, StVenantKirchhoff(E, 0.0, 7800.0), 1e-3)
    scene = Scene(beam).clamp("left").point_mass(beam.total_mass, (1, 0))
    omega = b**2 * np.sqrt(E * 1e-6 / 12 / 7800)
    assert_allclose(scene.modes(1).frequencies[0], omega, rtol=1e-4)


@pytest.mark.parametrize("element", ELEMENTS)
def test_column_on_a_torsional_spring_buckles(element):
    """sqrt(P / EI) tan sqrt(P / EI) = k / EI."""
    beam = beam_of(element, 16, nu=0.0)
    k = 2.0 * EI
    z = brentq(lambda z: z * np.tan(z) - 2.0, 0.1, 1.5)
    scene = Scene(beam).pin("left").torsional_spring(k, "left").point_force((-EI, 0), at=(1, 0))
    assert_allclose(scene.buckling().factors[0], z**2, rtol=1e-3)


def test_beck_s_column_flutters():
    h = 1e-3
    column = Beam(MeshBeam.init_line(np.linspace(0, 1, 13), h), ElementBeamCable(5),
                  StVenantKirchhoff(12 / h**3, 0, 1 / h), width=1)
    flutter = []
    for P in (20.04, 20.06):
        scene = Scene(column).clamp("left").follower_force((-P, 0), at=(1, 0))
        flutter.append(scene.modes(2, scene.solve_static()).flutter)
    assert flutter == [False, True]
    with pytest.raises(InputError, match="flutter"):
        Scene(column).clamp("left").follower_force((-1, 0), at=(1, 0)).buckling()


def test_a_follower_force_turns_with_the_axis():
    beam = beam_of("sections")
    load = Scene(beam).clamp("left").follower_force((3.0, 1.0), at=(0.6, 0.004)).loads[0]
    c, s = np.cos(0.7), np.sin(0.7)
    total = load.force(_rotated(beam, 0.7)).reshape(-1, beam.nd)[:, :2].sum(axis=0)
    assert_allclose(total, [3 * c - s, 3 * s + c], rtol=1e-12)
    u = 1e-2 * np.random.default_rng(0).standard_normal(beam.N)
    i, j, v = load.stiffness(u)
    K = np.zeros((beam.N, beam.N))
    np.add.at(K, (i, j), v)
    for k, e in enumerate(np.eye(beam.N)):
        assert_allclose(K[:, k], (load.force(u + 1e-6 * e) - load.force(u - 1e-6 * e)) / 2e-6,
                        rtol=0, atol=1e-6)


# motion


def test_terminal_velocity_and_its_approach():
    """v = v_e tanh(g t / v_e) of a beam that falls flat; end on by the other coefficient."""
    beam = beam_of("cable", 2)
    for g, coefficient in (((0, -9.81), 1.2), ((9.81, 0), 0.3)):
        scene = Scene(beam).gravity(g).drag(100.0, 1.2, 0.3)
        end = np.sqrt(RHO_A * 9.81 / (0.5 * 100.0 * coefficient * H))
        history = scene.integrate(0.5, 2e-3)
        speed = np.abs(history.velocity((0.5, 0)) @ np.array(g) / 9.81)
        assert_allclose(speed, end * np.tanh(9.81 * history.t / end), rtol=0, atol=1e-4)


# what there is besides


@pytest.mark.parametrize("element", ELEMENTS)
def test_recovered_shear_force_jumps_by_the_force_of_a_dashpot(element):
    scene = weighing(element).spring(0.0, ((0.6, 0), (0.6, 1)), damping=5.0)
    state = scene.integrate(0.1, 1e-3, scheme="hht").state(-1)
    assert state.recovered == {0: ""}
    d = [0.6, 1.0] - state.position((0.6, 0))
    force = 5.0 * state.velocity((0.6, 0)) @ d / np.hypot(*d)
    jump = state.resultants((0.5999, 0)).Q - state.resultants((0.6001, 0)).Q
    assert abs(force) > 1.0
    assert_allclose(jump, -force, rtol=5e-3)


def test_a_shaken_cantilever_vibrates_as_its_modes():
    """From rest by a base whose acceleration is a cos w t: five modes of Bernoulli's beam."""
    h, modulus, rho, w, a = 0.01, 2e9, 1000.0, 9.0, 1e-2
    mesh = MeshBeam.init_line(np.linspace(0, 1, 13), h)
    scene = Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(modulus, 0.0, rho), h))
    scene.joint("position", at=(0, 0), r=lambda t: np.array([0.0, a / w**2 * (1 - np.cos(w * t))]))
    scene.joint("angle", at="left", angle=lambda t: 0.0)
    history = scene.integrate(0.8, 2e-3, scheme="generalized-alpha")
    x, weights = gauss(60)
    tip = np.zeros(len(history.t))
    for start in 0.5, 3.5, 6.5, 9.5, 12.5:
        b = brentq(lambda b: np.cos(b) * np.cosh(b) + 1, start, start + 3)
        s = (np.sinh(b) - np.sin(b)) / (np.cosh(b) + np.cos(b))
        mode, end = (np.cosh(z) - np.cos(z) - s * (np.sinh(z) - np.sin(z)) for z in (b * x, b))
        own = b**2 * np.sqrt(modulus * h**2 / (12 * rho))
        tip -= (weights @ mode) / (weights @ mode**2) * end * a * (
            np.cos(w * history.t) - np.cos(own * history.t)) / (own**2 - w**2)
    found = history.displacement((1, 0))[:, 1] - history.displacement((0, 0))[:, 1]
    assert_allclose(found, tip, rtol=0, atol=2e-3 * np.abs(tip).max())


class Wrong(ForceElement):
    def __init__(self, links=None, force=None):
        self.given, self.value = links, force

    def bind(self, scene):
        return [point(scene, None, (1, 0))] if self.given is None else self.given

    def force(self, x, v, t):
        return self.value


class Skew(Wrong):
    def force(self, x, v, t):
        return np.array([[3.0 * x[0, 1], -10.0 * x[0, 1]]])


class Doubled(Wrong):
    def force(self, x, v, t):
        return np.array([[0.0, -10.0 * x[0, 1]]])

    def potential(self, x):
        return 10.0 * x[0, 1] ** 2


class Pushed(Doubled):
    def force(self, x, v, t):
        return np.array([[np.sin(t), -20.0 * x[0, 1]]])


BAD = {
    "negative stiffness": lambda s: s.spring(-1.0, ((1, 0), (1, 1))),
    "negative damping": lambda s: s.spring(1.0, ((1, 0), (1, 1)), damping=-1.0),
    "negative length": lambda s: s.spring(1.0, ((1, 0), (1, 1)), length=-1.0),
    "length zero": lambda s: s.spring(1.0, ((1, 0), ("ground", (1, 0)))),
    "no beam": lambda s: s.spring(1.0, ((1, 2), (1, 1))),
    "one place": lambda s: s.spring(1.0, (1, 0)),
    "outside": lambda s: s.spring(1.0, ((0, (2, 0)), (1, 1))),
    "torsion": lambda s: s.torsional_spring(-1.0, "left"),
    "torsion, damping": lambda s: s.torsional_spring(1.0, "left", damping=-1.0),
    "no section": lambda s: s.torsional_spring(1.0, (2.6, 0)),
    "other": lambda s: s.torsional_spring(1.0, "left", other="right"),
    "whole turns": lambda s: s.torsional_spring(1.0, "left", angle=7.0),
    "foundation": lambda s: s.foundation(-1.0),
    "foundation, side": lambda s: s.foundation(1.0, side="below"),
    "foundation, flag": lambda s: s.foundation(1.0, one_sided="yes"),
    "drag": lambda s: s.drag(1.0, -1.0),
    "mass": lambda s: s.point_mass(-1.0, (1, 0)),
    "no mass": lambda s: s.point_mass(0.0, (1, 0)),
    "mass outside": lambda s: s.point_mass(1.0, (2, 0)),
    "inertia": lambda s: s.point_mass(1.0, (1, 0), inertia=-1.0),
    "follower": lambda s: s.follower_force((1, 2, 3), at=(1, 0)),
    "line": lambda s: s.line_load((1, np.nan)),
    "line, function": lambda s: s.line_load(lambda x: 1 / 0),
    "own, no list": lambda s: s.add(Wrong(links=3)),
    "own, shape": lambda s: s.add(Wrong(force=np.zeros(3))),
    "own, nan": lambda s: s.add(Wrong(force=np.full((1, 2), np.nan))),
    "own, None": lambda s: s.add(Wrong()),
    "own, not symmetric": lambda s: s.add(Skew()),
    "own, potential of another force": lambda s: s.add(Doubled()),
    "own, potential and time": lambda s: s.add(Pushed()),
    "own, nothing": lambda s: s.add(ForceElement()),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_values(name):
    scene = weighing()
    with pytest.raises((InputError, MeshError)):
        BAD[name](scene)
    assert not scene.elements and len(scene.loads) == 1
