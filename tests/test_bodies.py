"""Rigid bodies: pendulums, masses on beams, frequencies, stability, files, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam, MeshError,
                        RigidBody, Scene, StabilityWarning, StVenantKirchhoff, SupportError)
from skfem_ancf.dynamics import SCHEMES

G = 9.81
EI = 1e4 * 0.1**4 / 12


def beam_of(n=4, length=1.0, element=None, E=1e4, density=1.0, h=0.1, name=None, damping=None):
    mesh = MeshBeam.init_line(np.linspace(0, length, n + 1), h)
    return Beam(mesh, element or ElementBeamCable(5),
                StVenantKirchhoff(E, 0.0, density), width=h, name=name, damping=damping)


def pendulum(mass=2.0, inertia=0.1, arm=0.6):
    """A body that hangs from a pin, beside a beam that stays at rest."""
    body = RigidBody(mass, inertia, position=(0, -arm), name="bob")
    scene = Scene(body, beam_of(2)).clamp("left").gravity((0, -G), beam="bob")
    return scene.pin((0, 0), body), body, mass * G * arm / (inertia + mass * arm**2)


def spun(scene, body, rate):
    """With an angular velocity about the origin."""
    return scene.initial_velocity(lambda x: rate * np.array([-x[1], x[0]]), beam=body)


# motion


@pytest.mark.parametrize("scheme", [name for name, cls in SCHEMES.items() if cls.joined])
def test_a_pendulum_swings_as_it_should(scheme):
    scene, body, stiffness = pendulum()
    exact = solve_ivp(lambda t, y: [y[1], -stiffness * np.sin(y[0])], (0, 1), [0, 4.0], rtol=1e-11,
                      atol=1e-11).y[:, -1]
    errors = []
    for dt in (0.02, 0.01):
        history = spun(scene, body, 4.0).integrate(1.0, dt, scheme=scheme)
        errors.append(abs(history.angle(body)[-1] - exact[0]))
        point = history.position((0, 0), body)
        assert np.abs(point).max() < 1e-12
        r = history.position(body)
        assert_allclose(np.hypot(*r.T), 0.6, rtol=0, atol=1e-9)
    assert errors[1] < 2e-3 and np.log2(errors[0] / errors[1]) > 0.9
    if scheme == "energy-momentum":
        assert np.ptp(history.total_energy) < 1e-10
        assert abs(history.angular_velocity("bob")[-1] - exact[1]) < 5e-3


def test_a_thrown_body_keeps_its_momenta():
    body = RigidBody(3.0, 0.7, position=(1, 2), angle=0.4)
    scene = Scene(beam_of(2), body).clamp("left")
    scene.initial_velocity(lambda x: np.array([2.0 - 5.0 * (x[1] - 2.0), 1.0 + 5.0 * (x[0] - 1.0)]),
                           beam=body)
    history = scene.integrate(1.0, 0.02)
    assert_allclose(history.momentum[:, 0], 6.0, rtol=1e-11)
    assert_allclose(history.angular_momentum, 0.7 * 5.0 + 3.0 * (1 * 1 - 2 * 2), rtol=1e-11)
    assert_allclose(history.kinetic_energy, 0.5 * 3 * 5 + 0.5 * 0.7 * 25, rtol=1e-11)
    assert_allclose(history.position(body)[-1], (3.0, 3.0), atol=1e-11)
    assert_allclose(history.angle(body)[-1], 0.4 + 5.0, rtol=1e-3)
    assert_allclose(history.velocity((1.3, 2.0), body)[0], (2.0, 1.0 + 1.5), atol=1e-12)


def test_a_moment_turns_a_body():
    body = RigidBody(1.0, 0.5, position=(0, 2))
    scene = Scene(beam_of(2), body).clamp("left").moment(body, 3.0)
    history = scene.integrate(0.5, 1e-3)
    assert_allclose(history.angle(body)[-1], 0.5 * 3.0 / 0.5 * 0.25, rtol=1e-5)
    assert_allclose(history.position(body), np.tile((0, 2), (len(history), 1)), atol=1e-12)
    assert np.ptp(history.total_energy) < 1e-10


def test_a_follower_force_turns_with_a_body():
    """A thruster off the centre: the body spins up, and its path is that of the integrals."""
    body = RigidBody(2.0, 0.4, position=(0, 2), angle=0.3)
    scene = Scene(beam_of(2), body).clamp("left").follower_force((3.0, 0.0), (0.0, 1.8), body)
    history = scene.integrate(1.0, 2e-3)
    rate = 3.0 * 0.2 / 0.4
    assert_allclose(history.angle(body) - 0.3, 0.5 * rate * history.t**2, atol=1e-5)
    exact = solve_ivp(lambda t, y: [*y[2:], 1.5 * np.cos(0.5 * rate * t * t),
                                    1.5 * np.sin(0.5 * rate * t * t)], (0, 1), [0, 2, 0, 0],
                      rtol=1e-10, atol=1e-10).y[:2, -1]
    assert_allclose(history.position(body)[-1], exact, atol=1e-5)


def frequency_with_body(m, J, c):
    """The lowest of an Euler-Bernoulli cantilever (length 1, EI, rho A = 0.01) with a body."""
    rhoA = 0.01

    def determinant(w):
        k = (w * w * rhoA / EI) ** 0.25
        C, S, Ch, Sh = np.cos(k), np.sin(k), np.cosh(k), np.sinh(k)
        # w(x) = a (cosh - cos) + b (sinh - sin); at x = 1 shear and moment of the body
        f = [np.array([Ch - C, k * (Sh + S), k**2 * (Ch + C), k**3 * (Sh - S)]),
             np.array([Sh - S, k * (Ch - C), k**2 * (Sh + S), k**3 * (Ch + C)])]
        rows = []
        for y, dy, ddy, dddy in f:
            acc = -w * w * (y + c * dy)
            rows.append([-EI * dddy + m * acc, EI * ddy + J * (-w * w * dy) + c * m * acc])
        return np.linalg.det(np.array(rows))

    grid = np.linspace(0.05, 40.0, 4000)
    values = [determinant(w) for w in grid]
    k = int(np.flatnonzero(np.diff(np.sign(values)))[0])
    return brentq(determinant, grid[k], grid[k + 1])


@pytest.mark.parametrize("m, J, c", [(0.01, 1e-5, 0.0), (0.02, 5e-4, 0.3)])
def test_frequency_of_a_cantilever_with_a_body(m, J, c):
    """The tip mass equal to the beam's own; and one that is off the end."""
    E = EI * 12 / 0.01**4
    beam = beam_of(16, E=E, h=0.01, density=100.0)  # of rotary inertia 1e-5 of the translation
    body = RigidBody(m, J, position=(1 + c, 0))
    scene = Scene(beam, body).clamp("left")
    scene.weld((beam, "right"), (body, (1, 0)))
    assert_allclose(scene.modes(1).frequencies[0], frequency_with_body(m, J, c), rtol=1e-4)


def test_frequencies_of_two_bodies_on_springs():
    """Carts on a line between springs: of the matrix [[2, -1], [-1, 1]]."""
    a, b = RigidBody(2.0, 1.0, (2, 3), name="a"), RigidBody(2.0, 1.0, (4, 3), name="b")
    scene = Scene(beam_of(2), a, b).clamp("left")
    for body in (a, b):
        scene.joint("line", at=None, beam=body, direction=(1, 0))
        scene.joint("angle", at=None, beam=body, angle=lambda t: 0.0)
    scene.spring(50.0, (("ground", (0, 3)), a)).spring(50.0, (a, "b" and b))
    known = np.sqrt(50.0 / 2.0 * np.linalg.eigvalsh([[2.0, -1.0], [-1.0, 1.0]]))
    slow = scene.modes(4).frequencies
    assert all(np.min(np.abs(slow - w)) < 1e-6 * w for w in known)


# statics and stability

def test_a_body_off_the_end_of_a_cantilever():
    """It hangs by its own frame: force and moment at the end are those of its weight."""
    beam, body = beam_of(8, E=1e8), RigidBody(0.5, 0.01, position=(1.2, 0.1))
    scene = Scene(beam, body).clamp("left").gravity((0, -G), beam=body)
    weld = scene.weld((beam, "right"), (body, (1, 0)))
    state = scene.solve_static()
    d = state.displacement((1, 0), beam)
    arm = state.position(body)[0] - 1.0 - d[0]
    force = state.joint_force(weld)
    assert_allclose(force[:2], (0, -0.5 * G), atol=1e-9)
    root = state.reactions("left", beam)
    assert_allclose(root.moment, 0.5 * G * state.position(body)[0], rtol=1e-9)
    slope = state.angle(body)
    M, F, I = 0.5 * G * arm, 0.5 * G, 1e8 * 0.1**4 / 12
    assert_allclose(slope, -(F / 2 + M) / I, rtol=1e-4)
    assert_allclose(d[1], -(F / 3 + M / 2) / I, rtol=1e-4)


@pytest.mark.parametrize("ratio, stable", [(0.9, True), (1.1, False)])
def test_an_inverted_pendulum_on_a_spring(ratio, stable):
    """Stable as long as m g l is below the stiffness of the spring."""
    body = RigidBody(2.0, 0.1, position=(0, 0.5))
    scene = Scene(beam_of(2), body).clamp("left").gravity((0, -G), beam=body).pin((0, 0), body)
    scene.torsional_spring(2.0 * G * 0.5 / ratio, body)
    state = scene.solve_static(stable=False)
    assert (state.stability == "stable") == stable
    assert state.negative_pivots == (not stable)
    frequency = scene.modes(1, state).frequencies[0]
    square = (2.0 * G * 0.5 / ratio - 2.0 * G * 0.5) / (0.1 + 2.0 * 0.25)
    assert_allclose(frequency * abs(frequency), square, rtol=1e-8)
    if not stable:
        with pytest.warns(match="loses its stability"):
            fallen = scene.solve_static()
        theta = brentq(lambda x: x / np.sin(x) - ratio, 0.1, 2.0)
        assert_allclose(abs(fallen.angle(body)), theta, rtol=1e-6)


def test_buckling_with_a_body_between_column_and_load():
    """A rigid link of length a on a clamped column: tan(k) k a = 1 - ... by its own equation."""
    beam, body = beam_of(16, E=1e8, h=0.01), RigidBody(1.0, 1.0, position=(1.25, 0))
    I, a = 1e8 * 0.01**4 / 12, 0.5
    scene = Scene(beam, body).clamp("left").point_force((-1, 0), (1.5, 0), body)
    scene.weld((beam, "right"), (body, (1, 0)))
    # w'' + k^2 w = k^2 (w(1) + a w'(1)): k a tan k = 1
    k = brentq(lambda k: k * a * np.tan(k) - 1.0, 0.1, 1.5)
    assert_allclose(scene.buckling().factors[0], k * k * I, rtol=1e-4)


# what else a scene does

def mechanism(share=0.5):
    """A crank with a spring, a beam on it, and a body that hangs on its end.

    Beyond 0.5913 of its weight the crank tips over.
    """
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 4), 0.05), ElementBeamANCF(2),
                StVenantKirchhoff(1e6, 0.3, 100.0), width=0.05, name="beam")
    crank = RigidBody(0.3, 0.01, position=(-0.1, 0), angle=0.2, name="crank")
    bob = RigidBody(0.2, 0.002, position=(1.1, -0.1), name="bob",
                    outline=[(-0.1, -0.1), (0.1, -0.1), (0.0, 0.2)])
    scene = Scene(crank, beam, bob).gravity((0, -share * G)).pin((-0.2, 0), crank)
    scene.weld((crank, (0, 0)), (beam, "left"))
    scene.hinge((beam, (1, 0)), (bob, (1, 0)))
    scene.torsional_spring(8.0, crank).torsional_spring(0.5, bob)
    return scene.spring(3.0, (("ground", (1.1, -1)), bob), damping=0.1)


def test_the_crank_says_that_it_has_tipped_over():
    """Towards a limit load the lowest eigenvalue of the stiffness falls as the root of the rest."""
    shares, rest = (0.590, 0.591), []
    for share in shares:
        scene = mechanism(share)
        state = scene.solve_static()
        rest.append(scene.modes(1, state).frequencies[0] ** 4)
    limit = shares[1] + rest[1] * (shares[1] - shares[0]) / (rest[0] - rest[1])
    with pytest.warns(StabilityWarning, match="limit point at the load level") as caught:
        tipped = mechanism(1.0).solve_static()
    level = float(re.search(r"level (0\.\d+)", str(caught[0].message))[1])
    assert level == pytest.approx(limit, rel=2e-4)
    assert tipped.angle("crank") < -0.05 < 0.05 < state.angle("crank")
    assert tipped.stability == "stable"


def test_points_of_bodies_are_found():
    scene = mechanism()
    state = scene.solve_static()
    bob = scene.bodies[1]
    assert bob.contains(np.array([[1.1, 1.1, 1.3], [-0.1, 0.09, 0.0]])).tolist() == [
        True, True, False]
    many = np.array([[0.5, 1.1, -0.1], [0.0, -0.15, 0.0]])  # of all three
    found = state.position(many)
    assert_allclose(found[:, 1], state.position((1.1, -0.15), bob))
    assert_allclose(found[:, 0], state.position((0.5, 0), "beam"))
    turn = state.angle(bob)
    assert_allclose(state.position((1.1, -0.15), bob) - state.position(bob),
                    0.05 * np.array([np.sin(turn), -np.cos(turn)]), atol=1e-12)
    assert_allclose(state.position((1.0, 0.0), "beam"), state.position((1.0, 0.0), bob), atol=1e-12)
    with pytest.raises(MeshError, match="none of the 1 beams"):
        state.position((5.0, 5.0))
    with pytest.raises(InputError, match="no strain"):
        state.strain((1.1, -0.1))


def test_the_default_outline_is_a_plate_of_that_mass_and_inertia():
    x = RigidBody(6.0, 4.0).outline
    side = np.ptp(x[0])
    assert_allclose(6.0 * side**2 / 6.0, 4.0)
    assert_allclose(np.ptp(x[1]), side)


# files and pictures

def test_files_hold_the_outlines(tmp_path):
    meshio = pytest.importorskip("meshio")
    scene = mechanism()
    state = scene.solve_static()
    for lagrange in (False, True):
        found = meshio.read(state.save(tmp_path / "s.vtu", lagrange=lagrange))
        polygons = [cells.data for cells in found.cells if cells.type in ("polygon", "polygon4",
                                                                          "quad", "triangle")]
        corners = [found.points[rows[-1]] for rows in polygons]
        bob = next(x for x in corners if len(x) == 3)
        assert_allclose(bob[:, :2].T, scene.bodies[1].outline_at(state.u_of("bob")), atol=1e-12)
        moved = next(rows[-1] for rows in polygons if len(rows[-1]) == 3)
        assert_allclose(found.point_data["displacement"][moved][:, :2].T,
                        state.displacement(bob_start(scene), "bob"), atol=1e-12)
        assert np.all(np.isnan(found.point_data["strain"][moved]))
    history = scene.integrate(0.02, 0.01)
    history.save(tmp_path / "run.pvd")
    assert len(list(tmp_path.rglob("*.vtu"))) > 2


def bob_start(scene):
    return scene.bodies[1].outline_at(np.zeros(4))


# what is refused

@pytest.mark.parametrize("options, what", [
    (dict(mass=-1.0), "mass"), (dict(mass=0.0), "mass"), (dict(mass=np.nan), "mass"),
    (dict(inertia=-1.0), "inertia"), (dict(inertia=0), "inertia"), (dict(inertia="1"), "inertia"),
    (dict(position=(1, 2, 3)), "position"), (dict(position=(1, np.nan)), "position"),
    (dict(angle=np.inf), "angle"), (dict(name=3), "name"), (dict(outline=[(0, 0), (1, 0)]), "out"),
    (dict(outline=[[0, 1, 1], [0, 0, np.nan]]), "outline"), (dict(outline=np.zeros((2, 4))), "out"),
])
def test_bad_bodies(options, what):
    with pytest.raises(InputError, match=what):
        RigidBody(**{"mass": 1.0, "inertia": 1.0, **options})


# motors, and a mechanism against another code

def lever(position=(0.3, 2.0), name="lever"):
    """A body on a pin at (0, 2), beside a beam at rest."""
    body = RigidBody(1.5, 0.2, position, name=name)
    return Scene(beam_of(2), body).clamp("left").pin((0, 2), body), body


def accelerating(t):
    return 2.0 + 3.0 * t


@pytest.mark.parametrize("options, angle", [
    (dict(angle=lambda t: t**3), lambda t: t**3),
    (dict(speed=4.0), lambda t: 4.0 * t),
    (dict(speed=accelerating), lambda t: 2 * t + 1.5 * t * t)], ids=["angle", "speed", "function"])
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_motors_that_prescribe_a_motion(options, angle, scheme):
    scene, body = lever()
    motor = scene.motor(body, **options)
    history = scene.integrate(0.8, 2e-3, scheme=scheme)
    assert_allclose(history.angle(body), angle(history.t), atol=1e-9)
    J, t = 0.2 + 1.5 * 0.09, 0.4
    rate = (angle(t + 1e-4) - 2 * angle(t) + angle(t - 1e-4)) / 1e-8
    assert_allclose(history.joint_force(motor)[200, 0], J * rate, rtol=2e-2, atol=1e-3)


@pytest.mark.parametrize("options", [dict(angle=lambda t: 2 * t * t), dict(speed=lambda t: 4 * t)])
def test_a_motor_between_two_bodies(options):
    """Free in space: angular momentum stays zero, the angle between them is given."""
    a, b = RigidBody(1.0, 0.2, (0, 2), name="a"), RigidBody(1.0, 0.3, (0, 2), name="b")
    scene = Scene(beam_of(2), a, b).clamp("left")
    scene.hinge(a, b)
    scene.motor(a, other=b, **options)
    assert scene.system.backend.tables.plain.joints.custom  # it turns with time and with the other
    history = scene.integrate(0.8, 4e-3, scheme="generalized-alpha")
    relative = 2 * history.t**2
    assert_allclose(history.angle(a) - history.angle(b), relative, atol=1e-8)
    assert_allclose(history.angle(a), relative * 0.3 / 0.5, atol=1e-4)
    assert np.abs(history.angular_momentum).max() < 1e-3


def test_a_flexible_slider_crank_as_by_exudyn(monkeypatch):
    """To 1e-3 of what the rod bends; the stored motion is that of benchmarks/slider_crank.py."""
    root = Path(__file__).parents[1]
    monkeypatch.syspath_prepend(root / "benchmarks")
    case = pytest.importorskip("slider_crank")
    exudyn = np.load(root / "tests" / "data" / "slider_crank.npz")
    scene, crank, rod, slider = case.scene(16)
    history = scene.integrate(case.END, 5e-5, scheme="generalized-alpha", t_eval=exudyn["t"])
    angle = case.angle(history.t)
    lean = np.arcsin(case.CRANK * np.sin(angle) / case.ROD)
    stiff = np.array([case.CRANK * np.cos(angle) + 0.5 * case.ROD * np.cos(lean),
                      0.5 * case.CRANK * np.sin(angle)]).T
    bent = np.hypot(*(exudyn["middle"] - stiff).T).max()
    assert bent > 8e-3 * case.ROD and exudyn["error"] < 1e-4 * bent
    assert_allclose(history.angle(crank), angle, atol=1e-8)
    assert_allclose(history.position(slider)[:, 0], exudyn["slider"], rtol=0, atol=1e-3 * bent)
    middle = history.position((case.CRANK + 0.5 * case.ROD, 0), rod)
    assert_allclose(middle, exudyn["middle"], rtol=0, atol=1e-3 * bent)


def test_two_bodies_alone_are_a_double_pendulum():
    """SciPy's double pendulum."""
    bodies = [RigidBody(2.0, 0.1, (0.5, 0)), RigidBody(1.0, 0.05, (1.5, 0))]
    scene = Scene(*bodies).pin((0, 0), bodies[0])
    scene.hinge((bodies[0], (1, 0)), (bodies[1], (1, 0)))
    scene.gravity((0, -9.81))
    history = scene.integrate(1.0, 1e-3)

    def rate(t, y):
        a, b, va, vb = y
        M = np.array([[0.1 + 2.0 * 0.25 + 1.0, 0.5 * np.cos(a - b)],
                      [0.5 * np.cos(a - b), 0.05 + 0.25]])
        f = [-9.81 * 2.0 * np.cos(a) - 0.5 * np.sin(a - b) * vb**2,
             -9.81 * 0.5 * np.cos(b) + 0.5 * np.sin(a - b) * va**2]
        return np.append([va, vb], np.linalg.solve(M, f))

    exact = solve_ivp(rate, (0, 1), np.zeros(4), rtol=1e-10, atol=1e-12).y[:2, -1]
    assert_allclose([history.angle(body)[-1] for body in bodies], exact, atol=1e-4)
    assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy.max()


def test_two_masses_and_a_spring():
    a, b = RigidBody(1.0, 0.1, name="a"), RigidBody(2.0, 0.1, position=(1, 0), name="b")
    turned = Scene(a, b).torsional_spring(5.0, a, other=b).modes(6).frequencies
    assert_allclose(turned, [0.0] * 5 + [10.0], atol=1e-5)
    scene = Scene(a, b).spring(100.0, between=(a, b))
    omega = np.sqrt(100.0 * 1.5)
    modes = scene.modes(6)
    assert_allclose(modes.frequencies, [0.0] * 5 + [omega], atol=1e-6 * omega)
    scene.initial_velocity(lambda x: np.array([1.0 + 0.0 * x[0], 0.0 * x[0]]), a)
    dt = 2.0 * np.pi / omega / 800
    scene.sensor("left", "position", at=a).sensor("pull", "acceleration", at=a)
    history = scene.integrate(1.0, dt)
    exact = history.t / 3.0 + 2.0 / 3.0 * np.sin(omega * history.t) / omega
    assert_allclose(history.position(a)[:, 0], exact, rtol=0, atol=2e-5)
    assert_allclose(history.sensors["left"][:, 0], exact, rtol=0, atol=2e-5)
    pull = -omega * 2.0 / 3.0 * np.sin(omega * history.t)
    assert_allclose(history.sensors["pull"][:, 0], pull, rtol=0, atol=5e-3 * omega)
    assert_allclose(history.momentum, np.tile([1.0, 0.0], (len(history.t), 1)), atol=1e-12)
    assert np.ptp(history.total_energy) < 1e-10


def test_statics_of_bodies_alone():
    """A body on three springs sags as its stiffness says; it buckles on a weak turning spring."""
    body = RigidBody(1.0, 0.1, name="plate")
    scene = Scene(body)
    for x, y, dx, dy in ((-0.2, 0, 0, 1), (0.2, 0, 0, 1), (0.2, 0, 1, 0)):
        scene.spring(1e4, between=(("ground", (x + dx, y + dy)), (body, (x, y))))
    state = scene.gravity((0, -G)).solve_static()
    assert state.converged and state.stability == "stable"
    assert_allclose(state.position(body), [0, -G / 2e4], atol=1e-6)
    post = RigidBody(1.0, 0.1, position=(0, 0.5))
    scene = Scene(post).pin((0, 0)).torsional_spring(2.0, post).point_force((0, -1), (0, 1))
    assert_allclose(scene.buckling(1).factors, [2.0], rtol=1e-9)
    fallen = scene.point_force((0, -2), (0, 1)).point_force((1e-3, 0), (0, 1)).solve_static()
    turn = abs(fallen.angle(post))
    assert_allclose(turn / np.sin(turn), 1.5, rtol=2e-3)


def test_a_body_that_is_held_by_all_of_its_coordinates():
    """Nothing is free: its weight is what its support carries, and there are no modes."""
    body = RigidBody(mass=2.0, inertia=0.5)
    scene = Scene(body).clamp(body).gravity((0, -G))
    state = scene.solve_static()
    assert state.iterations <= 3 and state.stability == "stable"
    assert_allclose(state.reactions(None, body).force, (0.0, 2.0 * G))
    with pytest.raises(InputError, match="no modes: supports and joints fix all"):
        scene.modes(1)


@pytest.mark.parametrize("weight", [0.0, 9.81])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_linkages_that_are_driven_are_found_by_statics(weight, unit):
    crank = RigidBody(mass=1, inertia=unit**2, position=(0.5 * unit, 0), name="crank")
    rod = RigidBody(mass=1, inertia=unit**2, position=(1.5 * unit, 0), name="rod")
    scene = Scene(crank, rod).pin((0, 0), crank)
    if weight:
        scene.gravity((0, -weight))
    scene.hinge((crank, (unit, 0)), (rod, (unit, 0)))
    scene.slider((rod, (2 * unit, 0)), on="ground", direction=(1, 0))
    motor = scene.motor(crank, angle=lambda t: t * np.pi / 3)
    state = scene.solve_static()
    assert_allclose(state.position((2 * unit, 0), rod), [unit, 0], atol=1e-9 * unit)
    # virtual work: both centres rise by unit / 2 sin(angle)
    assert_allclose(state.joint_force(motor), weight * unit / 2, atol=1e-9 * unit)
    if weight:
        assert state.stability == "stable"
        assert scene.solve_static(start=state).converged


# linkages through positions in which all bars are in line

def rod(a, b):
    """A bar of the mass 1 between two points."""
    a, b = np.array(a), np.array(b)
    return RigidBody(1.0, np.sum((b - a)**2) / 12, position=tuple(0.5 * (a + b)))


def parallelogram(angle):
    """Crank, coupler and rocker of 1 m, and the base of 1 m."""
    A = (np.cos(angle), np.sin(angle))
    B = (1.0 + A[0], A[1])
    crank, coupler, rocker = rod((0.0, 0.0), A), rod(A, B), rod((1.0, 0.0), B)
    scene = Scene(crank, coupler, rocker).pin((0, 0), crank).pin((1, 0), rocker)
    scene.hinge((crank, A), (coupler, A))
    scene.hinge((coupler, B), (rocker, B))
    return scene, crank, coupler, rocker


def slider_crank(angle):
    """Crank and rod of 1 m: they fold up where the crank is upright."""
    A, B = (np.cos(angle), np.sin(angle)), (2.0 * np.cos(angle), 0.0)
    crank, bar = rod((0.0, 0.0), A), rod(A, B)
    scene = Scene(crank, bar).pin((0, 0), crank)
    scene.hinge((crank, A), (bar, A))
    scene.slider((bar, B), "ground", direction=(1, 0))
    return scene, crank, bar, B


#: Steps that end in the position, close to it, and well beside it.
STEPS = {"at it": np.pi / 150, "near it": (1 + 1e-9) * np.pi / 150, "beside it": 0.02,
         "automatic": "auto"}


@pytest.mark.parametrize("dt", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau", "auto"])
@pytest.mark.parametrize("start", [np.pi / 3, np.pi / 2])
def test_a_driven_parallelogram_passes_its_positions_in_line(start, scheme, dt):
    scene, crank, coupler, rocker = parallelogram(start)
    scene.motor(crank, speed=1.0)
    history = scene.integrate(3.0, dt, scheme=scheme)
    for body, rate in ((crank, 1.0), (coupler, 0.0), (rocker, 1.0)):
        assert_allclose(history.angle(body), history.angle(body)[0] + rate * history.t, rtol=0,
                        atol=1e-5)


@pytest.mark.parametrize("dt", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau", "auto"])
@pytest.mark.parametrize("start", [np.pi / 6, np.pi / 4])
def test_a_slider_crank_passes_where_it_folds_up(start, scheme, dt):
    scene, crank, bar, B = slider_crank(start)
    scene.motor(crank, speed=1.0)
    history = scene.integrate(2.0, dt, scheme=scheme)
    x, y = history.position(B, bar).T
    assert_allclose(x, 2.0 * np.cos(start + history.t), rtol=0, atol=1e-5)
    assert_allclose(y, 0.0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau"])
def test_a_parallelogram_may_begin_in_line(scheme):
    """Where its velocity says which way it goes on; it has no equilibrium there to be found."""
    scene, crank, coupler, rocker = parallelogram(0.0)
    scene.initial_velocity(lambda x: np.array([-x[1], x[0]]), beam=crank)
    scene.initial_velocity(lambda x: np.array([-x[1], x[0] - 1.0]), beam=rocker)
    scene.initial_velocity((0.0, 1.0), beam=coupler)
    history = scene.integrate(2.0, 0.02, scheme=scheme)
    for body, rate in ((crank, 1.0), (coupler, 0.0), (rocker, 1.0)):
        assert_allclose(history.angle(body), rate * history.t, rtol=0, atol=1e-3)
    with pytest.raises(SupportError, match="depends in this position"):
        scene.solve_static()
