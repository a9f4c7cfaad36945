"""Force elements against closed forms: springs, dashpots, foundations, drag, masses, your own."""

import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (HHT, Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        EnergyMomentum, GeneralizedAlpha, InputError, MeshBeam, MeshError,
                        ModelWarning, Newmark, RigidBody, Scene, StVenantKirchhoff, SupportError)
from skfem_ancf.core.errors import CheckpointError
from skfem_ancf.actions.forces import ForceElement, point, section
from skfem_ancf.actions.forces.texts import add_elastic_force, add_resisting_force
from skfem_ancf.core.quadrature import gauss
from skfem_ancf.equations.momentum import momentum

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


class Wind(ForceElement):
    """Depends on place, velocity and time; takes no complex numbers."""

    symmetric = False

    def __init__(self, size):
        self.size = size

    def bind(self, scene):
        return [point(scene, None, (1, 0)), section(scene, None, "right")[1]]

    def force(self, x, v, t):
        speed = float(np.sin(3.0 * t) - v[0, 1])
        return np.array([[0.1 * x[0, 1], self.size * speed * abs(speed)], [0.0, 0.0]])


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
    forces, tables = system.forces, system.machine.tables.plain.forces
    u, v = 1e-3 * rng.standard_normal(system.N), rng.standard_normal(system.N)

    def matrix(factor, w):
        i, j, values = forces.entries(tables, 0.0, u, w, factor)
        out = np.zeros((system.N, system.N))
        np.add.at(out, (i, j), values)
        return out

    def elastic(x):
        out = np.zeros(system.N)
        add_elastic_force(tables, 0.0, 0.0, x, x, out)
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
    assert scene.system.forces.far and history.dissipated[-1] > 1e-3
    assert np.ptp(history.total_energy + history.dissipated) < 1e-12
    assert np.abs(history.momentum - history.momentum[0]).max() < 1e-12
    assert np.ptp(history.angular_momentum) < 1e-12


def spinning_pair(kinds, rates=(20.0, 14.0)):
    """Two free members apart from each other, each turning about the origin at its rate."""
    members = [RigidBody(2.0, 0.1 + 0.2 * k, (1.5 * k, 0.5)) if kind == "body" else
               beam_of(kind, 3, x0=1.5 * k, y0=0.5 * k, h=0.1) for k, kind in enumerate(kinds)]
    scene = Scene(*members)
    for k, w in enumerate(rates):
        scene.initial_velocity(lambda x, w=w: w * np.array([-x[1], x[0]]), beam=k)
    places = [member if kind == "body" else (member, end)
              for kind, member, end in zip(kinds, members, ("right", "left"))]
    return scene, places


def cubic(angle):
    return 50.0 * angle + 20.0 * angle**3


def torsion(k, damping=0.0):
    def add(scene, a, b):
        beam, at = a if isinstance(a, tuple) else (None, a)
        scene.torsional_spring(k, at, damping, beam=beam, other=b)
    return add


BETWEEN = {
    "spring": torsion(50.0), "law": torsion(cubic),
    "law and potential": torsion((cubic, lambda angle: 25.0 * angle**2 + 5.0 * angle**4)),
    "damper": torsion(50.0, 0.3),
    "law of the damper": torsion(50.0, lambda rate: 0.3 * rate + 0.01 * rate**3),
    "torque": lambda scene, a, b: scene.motor(a, torque=3.0, other=b),
    "torque of time": lambda scene, a, b: scene.motor(a, torque=np.cos, other=b),
    "control": lambda scene, a, b: scene.control(lambda t: 3.0, a, kind="moment", other=b)}


@pytest.mark.parametrize("what, kinds", [
    *[(what, ("body", "body")) for what in BETWEEN],
    *[(what, kinds) for what in ("law", "damper", "torque") for kinds in (
        ("sections", "body"), ("cable", "sections"), ("body", "cable"), ("cable", "cable"))]])
def test_moments_between_two_members_keep_the_angular_momentum(what, kinds):
    scene, (a, b) = spinning_pair(kinds)
    BETWEEN[what](scene, a, b)
    history = scene.integrate(0.2, 0.02)
    L = history.angular_momentum
    assert np.ptp(L) < 1e-12 * np.abs(L).max()  # 2e-5 to 1e-3 by means of each section's own
    if what not in ("torque of time", "control"):
        energy = history.total_energy + history.dissipated
        assert np.ptp(energy) < 1e-11 * history.kinetic_energy.max()


def test_a_spring_with_a_law_between_two_bodies_keeps_the_angular_momentum():
    scene, (a, b) = spinning_pair(("body", "body"))
    scene.spring(lambda s: 50.0 * s + 30.0 * s**3, ((a, (0.2, 0.5)), (b, (1.5, 0.2))))
    history = scene.integrate(0.2, 0.02)
    assert np.ptp(history.angular_momentum) < 1e-12 * np.abs(history.angular_momentum).max()
    assert np.ptp(history.total_energy) < 1e-11 * history.kinetic_energy.max()


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
        assert history.substeps == 0 and history.iterations < 3 * 15 * n
    assert scene.system.forces.far and errors[1] < 1e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5, abs=0.5)


@pytest.mark.parametrize("scheme", ["radau", "gauss"])
@pytest.mark.parametrize("own", [False, True])
def test_collocation_with_far_springs(scheme, own):
    """Against another scheme, with as few iterations as without."""
    scene, ends = weighing(), []
    if own:
        scene.add(Own(5.0, 0.5, 0.8, ((0.1, 0), (1, 0))))
    else:
        SCENES["far apart"](scene)
    history = scene.integrate(0.1, 5e-3, scheme=scheme, tol=1e-8)
    assert history.substeps == 0 and history.iterations < 3 * 10 * history.steps
    for dt in (1e-3, 5e-4):
        ends.append(scene.integrate(0.1, dt, scheme="energy-momentum").position((1, 0))[-1])
    assert_allclose(history.position((1, 0))[-1], (4.0 * ends[1] - ends[0]) / 3.0, rtol=0,
                    atol=5e-5)


@pytest.mark.parametrize("scheme, iterations", [("radau", 10), ("gauss", 14)])
def test_collocation_knows_modal_damping(scheme, iterations):
    """Of three modes that creep; 150 iterations a step in parts of steps, else."""
    scene = weighing().damping(modal=[5.0, 5.0, 5.0])
    history = scene.integrate(0.3, 1e-2, scheme=scheme, tol=1e-9)
    assert history.substeps == 0 and history.iterations < 3 * iterations * history.steps


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


def test_a_far_spring_is_that_of_one_s_own_and_of_a_sparse_solution():
    between = ((0.1, 0), (1, 0))
    ours = weighing().spring(5.0, between, length=0.8).solve_static()
    own = weighing().add(Own(5.0, 0.0, 0.8, between)).solve_static()
    assert_allclose(ours.u, own.u, rtol=0, atol=1e-9)
    residual = ours.internal_force - ours.system.external_force(ours.u)
    assert np.abs(residual[ours.system.constraints.free]).max() < 1e-9
    assert ours.stability == own.stability


def test_beams_held_by_springs_only():
    """A weighing beam that hangs on two springs, one of them from another beam."""
    upper = beam_of("sections", y0=0.5, name="upper")
    lower = beam_of("sections", name="lower")
    scene = Scene(upper, lower).clamp("left", beam=0).clamp("right", beam=0)
    scene.gravity((0, -0.3), beam="lower")
    with pytest.raises(SupportError, match="translation"):
        scene.solve_static()
    scene.spring(50.0, (("lower", (0, 0)), (0.0, 1.0)))
    scene.spring(50.0, (("lower", (1, 0)), ("upper", (0.5, 0.5))))
    assert scene.solve_static().stability == "stable"  # it hangs on them
    scene.torsional_spring(1.0, "left", beam="lower").spring(1.0, (("lower", (0, 0)), (-1.0, 0.0)))
    state = scene.solve_static()
    left, right = (state.position((x, 0), beam="lower") for x in (0, 1))
    middle, total = state.position((0.5, 0.5), beam="upper"), np.array([0, -0.3 * RHO_A])
    for k, a, b, length in ((50.0, left, (0, 1), 1.0), (1.0, left, (-1, 0), 1.0),
                            (50.0, right, middle, np.hypot(0.5, 0.5))):
        d = np.array(b) - a
        total = total + k * (1.0 - length / np.hypot(*d)) * d
    assert_allclose(total, 0.0, atol=1e-9)


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


def test_a_one_sided_foundation_lets_go():
    beam = beam_of("sections", 8)
    scene = Scene(beam).clamp("left").foundation(1e4, one_sided=True)
    up = scene.solve_static().u
    lifted = Scene(beam).clamp("left").point_force((0, 0.01), at=(1, 0))
    both = Scene(beam).clamp("left").point_force((0, 0.01), at=(1, 0)).foundation(
        1e4, one_sided=True)
    assert np.abs(up).max() == 0.0
    assert_allclose(both.solve_static().displacement((1, 0)), lifted.solve_static().displacement(
        (1, 0)), rtol=1e-9)
    pushed = Scene(beam).clamp("left").point_force((0, -0.01), at=(1, 0)).foundation(
        1e4, one_sided=True).solve_static()
    free = lifted.solve_static().displacement((1, 0))[1]
    assert 0 > pushed.displacement((1, 0))[1] > -0.9 * free


@pytest.mark.parametrize("element", ELEMENTS)
def test_line_loads(element):
    scene = Scene(beam_of(element, 8, nu=0.0)).clamp("left")
    w = scene.line_load((0, -1e-3)).solve_static().displacement((1, 0))[1]
    assert_allclose(w, -1e-3 / (8 * EI), rtol=6e-3)
    scene = Scene(beam_of(element, 8, nu=0.0)).clamp("left")
    w = scene.line_load(lambda x: (0 * x[0], -1e-3 * x[0])).solve_static().displacement((1, 0))[1]
    assert_allclose(w, -1e-3 * 11 / (120 * EI), rtol=6e-3)


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


def test_a_disk_turns_with_the_section_and_weighs():
    beam = beam_of(ElementBeamCable(5), 4).replace(material=StVenantKirchhoff(2e15, 0.0, 7800.0))
    scene = Scene(beam).pin("left").point_mass(0.3, (1, 0), inertia=0.2).torsional_spring(
        9.0, "left")
    inertia = RHO_A / 3 + 0.3 + 0.2
    assert_allclose(scene.modes(1).frequencies[0], np.sqrt(9.0 / inertia), rtol=1e-5)
    state = scene.gravity((0, -9.81)).solve_static()
    assert_allclose(state.reactions("left").force[1], 9.81 * (RHO_A + 0.3), rtol=1e-5)
    assert_allclose(momentum(scene.system, _translation(beam))[0], RHO_A + 0.3, rtol=1e-12)


def _translation(beam):
    out = np.zeros(beam.N)
    out[::beam.nd] = 1.0
    return out


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


def test_a_torsional_dashpot_stops_a_stiff_beam():
    beam = beam_of("cable", 2).replace(material=StVenantKirchhoff(2e15, 0.0, 7800.0))
    scene = Scene(beam).pin("left").torsional_spring(0.0, "left", damping=0.5)
    scene.initial_velocity(lambda x: np.array([0 * x[0], 3.0 * x[0]]))
    history = scene.integrate(1.0, 2e-3)
    omega = 3.0 * np.exp(-0.5 / (RHO_A / 3) * history.t)
    speed = np.hypot(*history.velocity((1, 0)).T)
    assert_allclose(speed, omega, rtol=0, atol=2e-3)  # it begins with a jerk


def soft():
    beam = Beam(MeshBeam.init_line([0, 1], 0.5), ElementBeamANCF(1),
                StVenantKirchhoff(1e3, 0.3, 1000.0), 0.1)
    scene = Scene(beam).clamp("left").gravity((0, -3.0), amplitude=lambda t: np.sin(1.5 * t) ** 2)
    scene.spring(40.0, ((1, 0), (1.5, 0.5)), damping=8.0).point_mass(5.0, (0.5, 0.1))
    scene.torsional_spring(3.0, "right", damping=2.0).foundation(300.0, damping=20.0)
    return scene.drag(1000.0, 2.0, 0.5).add(Wind(2.0))


@pytest.fixture(scope="module")
def by_scipy():
    s = soft().system
    free = np.nonzero(s.constraints.free)[0]
    M = np.linalg.inv(s.mass.tocsc()[free][:, free].toarray())

    def rate(t, y):
        u, v = np.zeros((2, s.N))
        u[free], v[free] = y.reshape(2, -1)
        force = s.external_force(u, t) - s.internal_force(u, t) - s.damping_force(u, v, t)
        return np.append(v[free], M @ force[free])

    run = solve_ivp(rate, (0, 1.0), np.zeros(2 * len(free)), "DOP853", rtol=1e-8, atol=1e-10)
    out = np.zeros((2, s.N))
    out[:, free] = run.y[:, -1].reshape(2, -1)
    return out


@pytest.mark.parametrize("scheme", [EnergyMomentum(), GeneralizedAlpha(0.5), HHT(0.1), Newmark()],
                         ids=repr)
def test_every_scheme_keeps_its_order(scheme, by_scipy):
    runs = [soft().integrate(1.0, 1.0 / n, scheme=scheme) for n in (100, 200)]
    for k, exact in enumerate(by_scipy):
        errors = [np.abs((run.u, run.v)[k][-1] - exact).max() for run in runs]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(scheme.order, abs=0.25)


def test_an_element_of_one_s_own_in_statics_takes_the_load_factor_for_time():
    class Pull(ForceElement):
        def bind(self, scene):
            return [point(scene, None, (1, 0))]

        def force(self, x, v, t):
            return np.array([[0.0, 1e-3 * t]])

    scene = Scene(beam_of("cable", 4)).clamp("left").add(Pull())
    assert_allclose(scene.solve_static().displacement((1, 0))[1], 1e-3 / (3 * EI), rtol=1e-3)
    assert_allclose(scene.solve_static().reactions("left").force, [0, -1e-3], atol=1e-12)


# what there is besides


def test_copies_files_other_meshes_and_adaptive_solutions(tmp_path):
    scene = SCENES["all"](weighing("sections"))
    history, path = scene.integrate(0.03, 1e-3), tmp_path / "run.npz"
    again = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(again.integrate(0.03, 1e-3).u, history.u)
    assert np.array_equal(pickle.loads(pickle.dumps(history)).total_energy, history.total_energy)
    scene.integrate(0.03, 1e-3, checkpoint=path, every=7)
    assert np.array_equal(scene.resume(path).u, history.u)
    with pytest.raises(CheckpointError, match="force element 0"):
        SCENES["to the ground"](weighing("sections")).damping(mass=0.1, modal=[0.01]).resume(path)
    finer = scene.replace(beams=[b.replace(mesh=b.mesh.refined()) for b in scene.beams])
    assert len(finer.elements) == len(scene.elements) == 6
    assert_allclose(finer.integrate(0.03, 1e-3).displacement((1, 0))[-1],
                    history.displacement((1, 0))[-1], atol=3e-4)
    state = weighing("sections").spring(20.0, ((1, 0), (1, 0.5))).solve_static(adapt=1e-3)
    assert state.error_estimate is not None and len(state.scene.elements) == 1


def test_plan_and_recovered_fields():
    scene = weighing("sections").spring(20.0, ((0.6, 0), (0.6, 0.5)))
    assert "1 Spring: 1 in tables" in scene.plan()["force elements"].reason
    other = weighing().follower_force((0, -1), at=(1, 0))
    other.joint("weld", beams=("ground", 0), at=((1, 0), "right"))
    assert "1 FollowerForce" in other.plan()["varying loads"].reason
    assert "1 Weld" in other.plan()["multipliers"].reason
    assert weighing().plan()["force elements"].status == "skipped"
    assert "far apart" in SCENES["far apart"](weighing()).plan()["force elements"].reason
    assert "dashpots" in SCENES["torsion"](weighing()).plan("dynamic")["damping"].reason
    state = scene.solve_static()
    assert state.recovered == {0: ""}
    k, end = 20.0, np.array([0.6, 0.5])
    d = state.position((0.6, 0)) - end
    pull = -k * (np.hypot(*d) - 0.5) * d / np.hypot(*d)
    total = state.reactions("left").force + pull + [0, -9.81 * RHO_A]
    assert_allclose(total, 0.0, atol=1e-8)
    jump = state.resultants((0.599, 0)).Q - state.resultants((0.601, 0)).Q
    assert abs(float(jump)) > 0.3 * np.hypot(*pull)


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


def test_base_excitation_by_a_moving_support_moves_what_springs_hold():
    """A support that follows a function of time, which is what base excitation is here."""
    beam = beam_of("cable", 2)
    scene = Scene(beam).spring(100.0, ((1, 0), (1, 1)), damping=0.1)
    scene.joint("position", at=(0, 0), r=lambda t: np.array([0.0, 0.01 * np.sin(5 * t)]))
    history = scene.integrate(0.2, 1e-3)
    assert_allclose(history.position((0, 0))[:, 1], 0.01 * np.sin(5 * history.t), atol=1e-12)
    assert history.dissipated[-1] > 0.0


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


class Listed(ForceElement):
    """Returns lists in place of arrays."""

    def bind(self, scene):
        return [point(scene, None, (1, 0))]

    def force(self, x, v, t):
        return [[-2.0 * v[0, 0], -10.0 * x[0, 1] - 2.0 * v[0, 1]]]


def test_lists_are_arrays():
    history = weighing().add(Listed()).integrate(0.01, 1e-3)
    assert history.dissipated[-1] > 0.0


def test_springs_between_beams_named_by_themselves_go_to_other_meshes():
    left, right = beam_of(), beam_of(x0=1.5)
    scene = Scene(left, right).clamp("left", beam=0).clamp("right", beam=1)
    scene.spring(5.0, ((left, (1, 0)), (right, (1.5, 0))), length=0.3)
    finer = scene.replace(beams=[b.replace(mesh=b.mesh.refined()) for b in scene.beams])
    assert_allclose(finer.solve_static().displacement((1, 0)),
                    scene.solve_static().displacement((1, 0)), atol=1e-6)


def test_a_torsional_spring_beyond_half_a_turn_says_so():
    scene = Scene(beam_of()).pin("left").torsional_spring(1e-6, "left")
    scene.initial_velocity(lambda x: np.array([0 * x[0], 6.0 * x[0]]))
    with pytest.warns(ModelWarning, match="half a turn"):
        scene.integrate(0.7, 5e-3)
    scene.integrate(0.4, 5e-3)


class Skew(Listed):
    def force(self, x, v, t):
        return np.array([[3.0 * x[0, 1], -10.0 * x[0, 1]]])


class Doubled(Listed):
    def force(self, x, v, t):
        return np.array([[0.0, -10.0 * x[0, 1]]])

    def potential(self, x):
        return 10.0 * x[0, 1] ** 2


class Pushed(Doubled):
    def force(self, x, v, t):
        return np.array([[np.sin(t), -20.0 * x[0, 1]]])


class Wrong(ForceElement):
    def __init__(self, links=None, force=None):
        self.given, self.value = links, force

    def bind(self, scene):
        return [point(scene, None, (1, 0))] if self.given is None else self.given

    def force(self, x, v, t):
        return self.value


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


def test_a_point_of_two_beams_has_to_be_named():
    scene = Scene(beam_of(), beam_of(x0=1.0))
    with pytest.raises(InputError, match="say which"):
        scene.spring(1.0, ((1, 0), (1, 1)))
    assert len(scene.spring(1.0, ((1, (1, 0)), (1, 1))).elements) == 1


@pytest.mark.filterwarnings("ignore::skfem_ancf.ModelWarning")
@pytest.mark.parametrize("name", ["all", "far apart", "one-sided"])
def test_compiled_is_the_same(needs_compiled, name, monkeypatch):
    runs = []
    for way in ("0", "1"):
        monkeypatch.setenv("SKFEM_ANCF_COMPILED", way)
        scene = SCENES[name](weighing("sections"))
        runs.append([scene.solve_static(stable=False).u, scene.integrate(0.02, 1e-3).u,
                     scene.integrate(0.02, 1e-3, scheme="hht").dissipated])
    for plain, fast in zip(*runs):
        assert_allclose(fast, plain, rtol=0, atol=1e-9)
