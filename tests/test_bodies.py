"""Rigid bodies: pendulums, masses on beams, frequencies, stability, files, and what is refused."""

import pickle
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, InputError, KelvinVoigt,
                        Line, MeshBeam, MeshError, ModelWarning, NameUnknown, RigidBody, Scene,
                        StVenantKirchhoff, SupportError)
from skfem_ancf.dynamics import SCHEMES
from skfem_ancf.core.errors import AncfError, CallbackError, CheckpointError, ImmutableError

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

def driven_round(what):
    """Free bodies and beams that a moment turns by some turns in 2 s."""
    body, beam = RigidBody(1.0, 1.0, name="a"), beam_of(3, E=2e7, density=1000.0)
    if what == "body":
        return Scene(body).moment(None, 40.0, beam=body)
    if what == "motor":
        scene = Scene(body)
        scene.motor(body, torque=40.0)
        return scene
    if what == "couple":
        other = RigidBody(1.0, 3.0, position=(2, 1))
        scene = Scene(body, other)
        scene.motor(body, torque=40.0, other=other)
        return spun(scene, body, 2.0)
    if what == "end":
        return Scene(beam).moment("right", 30.0)
    if what == "inside":
        return Scene(beam).pin("left").moment((1 / 3, 0), 30.0)
    frame = Frame.from_lines([(0, 0), (1, 0)], [[0, 1]], height=0.1, width=0.1,
                             material=StVenantKirchhoff(2e7, 0.3, 1000.0))
    return frame.pin(0).moment(1, 30.0)


@pytest.mark.parametrize("what", ["body", "motor", "couple", "end", "inside", "frame"])
def test_the_energy_under_moments_counts_turns(what, tmp_path):
    scene, path = driven_round(what), tmp_path / "run.npz"
    whole = scene.integrate(2.0, 0.01)
    most = whole.kinetic_energy.max()
    assert np.ptp(whole.potential_energy) > 4 * np.pi * (40.0 if what in (
        "body", "motor", "couple") else 30.0)
    assert np.ptp(whole.total_energy) < 1e-9 * most
    # of few instants between which there are whole turns
    few = scene.integrate(2.0, 0.01, t_eval=[0.0, 1.03, 1.9994, 2.0])
    assert_allclose(few.potential_energy[[0, -1]], whole.potential_energy[[0, -1]],
                    rtol=0, atol=1e-9 * most)
    assert np.ptp(few.total_energy) < 1e-9 * most
    # of a motion that goes on, by the same scheme and by another one, and from a file
    half = scene.integrate(1.0, 0.01, t_eval=[1.0])
    for scheme, end, exact in (("energy-momentum", 2.0, 1e-9), ("radau", 1.02, 1e-3)):
        rest = scene.integrate(end, 0.01, scheme=scheme, start=half.state(0), t_eval=[1.0, end])
        assert_allclose(rest.total_energy, whole.total_energy[0], rtol=0, atol=exact * most)
    ends = [1.4]
    scene.sensor("within", lambda state: 1.0 / (state.t < ends[-1]))
    with pytest.raises(CallbackError):
        scene.integrate(2.0, 0.01, checkpoint=path, every=50)
    ends.append(7.0)
    assert np.ptp(scene.resume(path).total_energy) < 1e-9 * most


def test_the_angle_of_a_body_counts_turns_between_instants():
    body = RigidBody(1.0, 0.5)
    scene = Scene(body)
    scene.motor(body, torque=2.0)
    history = scene.integrate(6.0, 0.01, t_eval=[0.0, 3.0, 6.0])
    assert_allclose(history.angle(body), [0.0, 18.0, 72.0], rtol=1e-2)


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


def test_turns_are_counted():
    scene, body, stiffness = pendulum()
    history = spun(scene, body, 14.0).integrate(2.0, 5e-3)
    exact = solve_ivp(lambda t, y: [y[1], -stiffness * np.sin(y[0])], (0, 2), [0, 14.0], rtol=1e-10,
                      atol=1e-10).y[0, -1]
    assert exact > 6 * np.pi
    assert abs(history.angle(body)[-1] - exact) < 2e-2
    assert abs(history.state(200).angle(body)) <= np.pi
    assert np.ptp(history.total_energy) < 1e-9


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


def test_a_prescribed_angle():
    body = RigidBody(1.0, 0.5, position=(0.1, 2))
    scene = Scene(beam_of(2), body).clamp("left").pin((0, 2), body)
    joint = scene.joint("angle", at=None, beam=body, angle=lambda t: 3 * t * t)
    history = scene.integrate(1.0, 5e-3, scheme="generalized-alpha")
    assert_allclose(history.angle(body), 3 * history.t**2, atol=1e-9)
    moment = history.joint_force(joint)[-1, 0]  # J about the pin
    assert_allclose(moment, 6.0 * (0.5 + 0.01), rtol=1e-3)


def test_a_body_is_as_a_point_mass_where_its_centre_is():
    """The same mass and inertia as a force element of its own."""
    runs = []
    for rigid in (True, False):
        beam = beam_of(4, name="beam", damping=KelvinVoigt(1e-3))
        body = RigidBody(0.02, 1e-4, position=(1, 0))
        scene = Scene(beam, body) if rigid else Scene(beam)
        scene.clamp("left", beam).gravity((0, -G))
        if rigid:
            scene.weld((1, 0))
        else:
            scene.point_mass(0.02, at=(1, 0), inertia=1e-4)
        static = scene.solve_static()
        history = scene.integrate(0.3, 2e-3)
        runs.append((static.displacement((1, 0), "beam"), history.displacement((1, 0), "beam"),
                     history.dissipated[-1], scene.modes(3, static).frequencies))
    for a, b in zip(*runs):
        # the section's direction of the point mass is no unit vector: it may stretch
        assert_allclose(a, b, rtol=3e-3, atol=3e-4)


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


def test_a_free_body_is_said_to_be_free():
    body = RigidBody(1.0, 1.0, position=(3, 0), name="loose")
    scene = Scene(beam_of(2), body).clamp("left").gravity((0, -1))
    with pytest.raises(SupportError, match="translation along .*of the rigid body loose"):
        scene.solve_static()
    scene.pin((2, 0), body)
    with pytest.raises(SupportError, match=r"rotation about \(2, 0\) of the rigid body loose"):
        scene.replace(loads=[]).solve_static()
    hanging = scene.solve_static()  # its weight holds it
    assert_allclose(hanging.position(body), (2, -1), atol=1e-6)
    assert scene.torsional_spring(1.0, body).solve_static().converged


def test_clamped_pinned_and_fixed_bodies():
    body = RigidBody(1.0, 1.0, position=(3, 0), angle=0.3)
    scene = Scene(beam_of(2), body).clamp("left").clamp(body).point_force((2, 3), (4, 1), body)
    reaction = scene.solve_static().reactions(None, body)
    assert_allclose(reaction.force, (-2, -3))
    assert_allclose(reaction.moment, -(1 * 3 - 1 * 2))
    history = scene.integrate(0.1, 0.01)
    assert np.abs(history.displacement(body)).max() == 0
    lifted = Scene(beam_of(2), body).clamp("left").fix(None, "r^2", 0.5, body)
    lifted.fix(None, "r^1", beam=body).torsional_spring(1.0, body).moment(body, 0.2)
    state = lifted.solve_static()
    assert_allclose(state.position(body), (3, 0.5))
    assert_allclose(state.angle(body), 0.3 + 0.2)


def test_a_pin_beside_the_centre_of_mass_has_a_reaction():
    """A pendulum at rest at an angle for a moment: a pin and a line hold it."""
    scene, body, _ = pendulum(mass=2.0, arm=0.6)
    scene.torsional_spring(5.0, body)
    scene.moment(body, 3.0)
    state = scene.solve_static()
    reaction = state.reactions(None, body)
    assert_allclose(reaction.force, [0.0, 2.0 * G], atol=1e-9)
    lever = -state.position(body)  # from the centre of mass to the pin
    about = lever[0] * reaction.force[1] - lever[1] * reaction.force[0]
    assert abs(reaction.moment - about) < 1e-9
    assert abs(reaction.moment + 3.0 - 5.0 * state.angle(body)) < 1e-7
    assert abs(reaction.moment) > 0.5


def test_many_bodies_are_solved_by_sparse_factors():
    """A chain of thirty links hangs down."""
    links = [RigidBody(1.0, 0.01, position=(0, -k - 0.5), name=f"link {k}") for k in range(30)]
    scene = Scene(beam_of(2), *links).clamp("left").gravity((0, -G)).pin((0, 0), links[0])
    joints = [scene.hinge((a, (0, -k - 1)), (b, (0, -k - 1)))
              for k, (a, b) in enumerate(pairwise(links))]
    for link in links:
        scene.torsional_spring(0.1, link)
    scene.point_force((40.0, 0.0), (0, -30), links[-1])
    state = scene.solve_static()
    assert_allclose(state.joint_force(joints[0])[1], -29 * G, rtol=1e-8)
    # without the springs each link has tan(angle) = 40 / (weight below)
    below = 29.5 - np.arange(30)
    angles = [state.angle(link) for link in links]
    assert_allclose(angles, np.arctan(40.0 / (below * G)), rtol=2e-2)


# what else a scene does

def mechanism():
    """A crank with a spring, a beam on it, and a body that hangs on its end."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 4), 0.05), ElementBeamANCF(2),
                StVenantKirchhoff(1e6, 0.3, 100.0), width=0.05, name="beam")
    crank = RigidBody(0.3, 0.01, position=(-0.1, 0), angle=0.2, name="crank")
    bob = RigidBody(0.2, 0.002, position=(1.1, -0.1), name="bob",
                    outline=[(-0.1, -0.1), (0.1, -0.1), (0.0, 0.2)])
    scene = Scene(crank, beam, bob).gravity((0, -G)).pin((-0.2, 0), crank)
    scene.weld((crank, (0, 0)), (beam, "left"))
    scene.hinge((beam, (1, 0)), (bob, (1, 0)))
    scene.torsional_spring(8.0, crank).torsional_spring(0.5, bob)
    return scene.spring(3.0, (("ground", (1.1, -1)), bob), damping=0.1)


def test_order_of_beams_and_bodies():
    scene = mechanism()
    assert [b.name for b in scene.layout.members] == ["beam", "crank", "bob"]
    assert scene.beam(0) is scene.beams[0] and scene.beam("bob") is scene.beam(2)
    assert scene.beam() is scene.beams[0]
    N = scene.beams[0].N
    assert scene.layout.N == N + 8 and scene.layout.offset("crank") == N
    assert "2 rigid bodies" in repr(scene)
    plan = scene.plan()
    assert plan["rigid bodies"].status == "computed" and "2:" in plan["rigid bodies"].reason


def test_states_and_motions_with_bodies_can_be_pickled():
    scene = mechanism()
    state, history = scene.solve_static(), scene.integrate(0.05, 0.01)
    again = pickle.loads(pickle.dumps(scene))
    assert_allclose(again.solve_static().u, state.u, rtol=0, atol=1e-13)
    for thing in (state, history):
        other = pickle.loads(pickle.dumps(thing))
        assert np.array_equal(other.u, thing.u)
        assert np.array_equal(other.position((1, 0), beam="bob"), thing.position((1, 0), "bob"))
        assert np.array_equal(other.angle("crank"), thing.angle("crank"))
    body = scene.bodies[0]
    assert pickle.loads(pickle.dumps(body)).angle == body.angle


def test_a_run_with_bodies_goes_on_from_its_checkpoint(tmp_path):
    scene = mechanism()
    whole = scene.integrate(0.2, 0.01)
    part = scene.integrate(0.1, 0.01)
    joined = scene.integrate(0.2, 0.01, start=part.state(len(part) - 1))
    assert_allclose(joined.u[-1], whole.u[-1], rtol=0, atol=1e-10)
    path = tmp_path / "run.npz"
    scene.integrate(0.2, 0.01, checkpoint=path, every=5)
    assert np.array_equal(scene.resume(path).u, whole.u)
    other = Scene(*(b.replace(mass=0.31) if b.name == "crank" else b for b in scene.layout.members))
    with pytest.raises(CheckpointError, match="rigid body crank"):
        other.resume(path)


def test_a_start_of_other_bodies_is_refused():
    scene = mechanism()
    other = Scene(scene.beams[0], scene.bodies[0], RigidBody(1.0, 1.0, (0, 5)))
    with pytest.raises(InputError, match="other rigid bodies"):
        scene.solve_static(start=other.state())


def test_finer_meshes_keep_the_bodies():
    scene = mechanism()
    state = scene.solve_static(adapt=1e-3)
    assert state.beams[0].mesh.nelements > 3
    fine = MeshBeam.init_line(np.linspace(0, 1, 49), 0.05)
    fine = scene.replace(beams=[scene.beams[0].replace(mesh=fine)]).solve_static()
    assert_allclose(state.angle("crank"), fine.angle("crank"), rtol=3e-3)
    assert state.error_estimate["displacement"] <= 1e-3


def test_what_names_a_body_itself_is_found_again():
    """On a finer mesh, where beams are others and bodies the same."""
    beam, body = beam_of(2, E=1e6), RigidBody(0.01, 1e-4, (1.1, 0), name="bob")
    scene = Scene(beam, body).clamp("left").gravity((0, -G))
    scene.weld((beam, "right"), (body, (1, 0)))
    scene.control(lambda t, bob: -0.5 * bob.angle, at=body, kind="moment", sections={"bob": body})
    scene.spring(2.0, (("ground", (1.1, 1.0)), body)).torsional_spring(0.1, body)
    state = scene.solve_static(adapt=1e-3)
    fine = scene.replace(beams=[beam_of(24, E=1e6)]).solve_static()
    assert_allclose(state.angle("bob"), fine.angle("bob"), rtol=2e-3)
    assert_allclose(state.angle(body), scene.solve_static().angle(body), rtol=1e-2)


def test_automatic_steps_with_bodies():
    scene, body, stiffness = pendulum()
    history = spun(scene, body, 4.0).integrate(1.0, "auto", rtol=1e-5)
    exact = solve_ivp(lambda t, y: [y[1], -stiffness * np.sin(y[0])], (0, 1), [0, 4.0], rtol=1e-11,
                      atol=1e-11).y[0, -1]
    assert abs(history.angle(body)[-1] - exact) < 1e-3


def test_energy_of_a_mechanism():
    history = mechanism().integrate(0.5, 5e-3)
    total = history.total_energy + history.dissipated
    assert np.ptp(total) < 1e-10 * np.ptp(history.kinetic_energy)
    assert history.dissipated[-1] > 0


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_compiled_is_the_same(needs_compiled, monkeypatch, scheme):
    runs = []
    for way in ("0", "1"):
        monkeypatch.setenv("SKFEM_ANCF_COMPILED", way)
        scene = mechanism()
        runs.append([scene.solve_static().u, scene.integrate(0.1, 5e-3, scheme=scheme).u])
    for plain, fast in zip(*runs):
        assert_allclose(fast, plain, rtol=0, atol=1e-9)


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
        assert np.all(np.isnan(found.point_data["eps_xx"][moved]))
    history = scene.integrate(0.02, 0.01)
    history.save(tmp_path / "run.pvd")
    assert len(list(tmp_path.rglob("*.vtu"))) > 2


def bob_start(scene):
    return scene.bodies[1].outline_at(np.zeros(4))


def test_hdf_files_hold_the_outlines(tmp_path):
    h5py = pytest.importorskip("h5py")
    history = mechanism().integrate(0.02, 0.01)
    history.save(tmp_path / "run.vtkhdf")
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        assert file["VTKHDF/Types"][()].tolist().count(7) == 2


def test_pictures_show_the_outlines():
    pytest.importorskip("matplotlib")
    scene = mechanism()
    state = scene.solve_static()
    axes = state.plot("displacement")
    paths = [path.vertices[:-1] for c in axes.collections for path in c.get_paths()]
    want = scene.bodies[1].outline_at(state.u_of("bob")).T
    assert any(p.shape == want.shape and np.allclose(p, want) for p in paths)
    assert "rigid body" in scene._repr_html_() and "crank" in scene._repr_html_()


def test_pyvista_shows_the_outlines():
    pytest.importorskip("pyvista")
    scene = mechanism()
    history = scene.integrate(0.02, 0.01)
    series = history.to_pyvista()
    assert series.mesh.keys() == ["beam", "crank", "bob"]
    series.update(2)
    assert_allclose(series.mesh["bob"].points[:, :2].T,
                    scene.bodies[1].outline_at(history.state(2).u_of("bob")), atol=1e-6)
    plotter = history.state(1).view("displacement", off_screen=True)
    assert plotter.mesh.n_points > 0


def test_films_show_the_outlines(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("PIL")
    history = mechanism().integrate(0.02, 0.01)
    history.animate(tmp_path / "film.gif", "displacement")
    assert (tmp_path / "film.gif").stat().st_size > 0


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


@pytest.mark.parametrize("corners", [[(0, 0), (2, 0), (0, 1)], [(0, 0), (2, 0), (2, 1), (0, 1)]])
def test_rows_of_an_outline_are_its_corners(corners):
    for outline in (corners, np.array(corners), np.transpose(corners)):
        body = RigidBody(1.0, 1.0, outline=outline)
        assert_allclose(body.outline.T, corners, rtol=0, atol=0)
        assert body.contains(np.array([[0.5, 0.5], [0.25, 1.5]])).tolist() == [True, False]


def test_a_force_on_no_point_is_refused_beside_a_body():
    """It was a ValueError of NumPy."""
    scene = mechanism()
    for at in (1, [1], (1, 2, 3), {}, np.zeros((2, 2)), object()):
        for add in (scene.point_force, scene.follower_force):
            with pytest.raises(MeshError, match="a material point has two coordinates"):
                add((0, -1), at=at)


def test_a_body_does_not_change():
    body = RigidBody(1.0, 2.0)
    with pytest.raises(ImmutableError):
        body.mass = 3.0
    assert body.replace(mass=3.0).mass == 3.0 and body.replace(mass=3.0).inertia == 2.0
    with pytest.raises(NameUnknown):
        body.replace(weight=3.0)


BAD = {
    "no beam and no body": lambda s, b: Scene(),
    "twice": lambda s, b: Scene(beam_of(), b, b),
    "same names": lambda s, b: Scene(beam_of(name="bob"), b),
    "a boundary": lambda s, b: s.clamp("left", b),
    "pin at a name": lambda s, b: s.pin("left", b),
    "a coordinate": lambda s, b: s.fix(None, "r_X", beam=b),
    "another body": lambda s, b: s.clamp(RigidBody(1.0, 1.0)),
    "an unknown name": lambda s, b: s.pin((0, 0), "crank"),
    "an unknown number": lambda s, b: s.pin((0, 0), 7),
    "traction": lambda s, b: s.traction("left", (1, 0), b),
    "pressure": lambda s, b: s.pressure("top", 1.0, b),
    "line load": lambda s, b: s.line_load((1, 0), b),
    "follower": lambda s, b: s.follower_force((1, 0), "left", b),
    "foundation": lambda s, b: s.foundation(1.0, beam=b),
    "drag": lambda s, b: s.drag(1.0, 1.0, beam=b),
    "nowhere": lambda s, b: s.hinge((9, 9), (8, 8)),
    "alone": lambda s, b: s.hinge((0.5, 0)),
    "one place": lambda s, b: s.weld(b),
    "nothing": lambda s, b: s.weld(),
    "ground to ground": lambda s, b: s.hinge(("ground", (0, 0)), ("ground", (0, 0))),
    "apart": lambda s, b: s.weld((0, (1, 0)), (b, (1, 1))),
    "a word": lambda s, b: s.hinge((b, "left"), (0, "left")),
    "ambiguous": lambda s, b: s.hinge((1, 0), (0, 0)),
    "moment": lambda s, b: s.moment("left", 1.0, b),
    "velocities": lambda s, b: s.initial_velocity([1.0, 2.0, 3.0], b),
    "angle of a beam": lambda s, b: s.state().angle(0),
    "angle of nothing": lambda s, b: s.state().angle(None),
    "strain of a body": lambda s, b: s.state().strain((1, 0), b),
    "resultants of a body": lambda s, b: s.state().resultants((1, 0), b),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_calls(name):
    body = RigidBody(1.0, 0.01, (1, 0), name="bob")
    scene = Scene(beam_of(), body)
    with pytest.raises(InputError):
        BAD[name](scene, body)
    assert not scene.loads and not scene.joints and not scene.elements


# motors, and a mechanism against another code

def lever(position=(0.3, 2.0), name="lever"):
    """A body on a pin at (0, 2), beside a beam at rest."""
    body = RigidBody(1.5, 0.2, position, name=name)
    return Scene(beam_of(2), body).clamp("left").pin((0, 2), body), body


def accelerating(t):
    return 2.0 + 3.0 * t


def pulsing(t):
    return 0.5 * np.cos(5 * t)


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


@pytest.mark.parametrize("torque, expected", [(0.7, lambda t: 0.35 * t * t),
                                              (pulsing, lambda t: 0.02 * (1 - np.cos(5 * t)))])
def test_motors_with_a_torque(torque, expected):
    scene, body = lever()
    scene.motor(body, torque=torque)
    history = scene.integrate(1.0, 2e-3)
    assert_allclose(history.angle(body), expected(history.t) / 0.335, atol=1e-5)


@pytest.mark.parametrize("options", [dict(angle=lambda t: 2 * t * t), dict(speed=lambda t: 4 * t)])
def test_a_motor_between_two_bodies(options):
    """Free in space: angular momentum stays zero, the angle between them is given."""
    a, b = RigidBody(1.0, 0.2, (0, 2), name="a"), RigidBody(1.0, 0.3, (0, 2), name="b")
    scene = Scene(beam_of(2), a, b).clamp("left")
    scene.hinge(a, b)
    scene.motor(a, other=b, **options)
    assert scene.system.machine.tables.plain.joints.own  # it turns with time and with the other
    history = scene.integrate(0.8, 4e-3, scheme="generalized-alpha")
    relative = 2 * history.t**2
    assert_allclose(history.angle(a) - history.angle(b), relative, atol=1e-8)
    assert_allclose(history.angle(a), relative * 0.3 / 0.5, atol=1e-4)
    assert np.abs(history.angular_momentum).max() < 1e-3


def test_a_torque_between_two_bodies():
    a, b = RigidBody(1.0, 0.2, (0, 2), name="a"), RigidBody(1.0, 0.3, (0, 2), name="b")
    scene = Scene(beam_of(2), a, b).clamp("left")
    scene.hinge(a, b)
    scene.motor(a, torque=0.6, other=b)
    history = scene.integrate(0.5, 2e-3)
    assert_allclose(history.angle(a), 1.5 * history.t**2, atol=1e-5)
    assert_allclose(history.angle(b), -history.t**2, atol=1e-5)
    assert np.abs(history.angular_momentum).max() < 1e-6
    assert np.ptp(history.total_energy) < 1e-12


def test_a_motor_at_the_root_of_a_beam():
    """A beam turned by its section, and in statics by the angle at full load."""
    beam = beam_of(8, E=1e6)
    scene = Scene(beam).pin("left")
    scene.motor((beam, "left"), angle=lambda t: 0.5 * t)
    state = scene.solve_static()
    assert_allclose(state.position((1, 0)), (np.cos(0.5), np.sin(0.5)), atol=1e-9)


@pytest.mark.parametrize("options, what", [
    (dict(), "got none"), (dict(angle=lambda t: t, speed=1.0), "give one of them"),
    (dict(angle=3.0), "angle"), (dict(speed="fast"), "speed"), (dict(speed=np.nan), "speed"),
    (dict(torque="1"), "torque"), (dict(torque=1.0, other=3), "other"),
    (dict(angle=lambda t: t, other=(9, "left")), "9"), (dict(torque=1.0, at=(0, 1.0)), "at is a"),
])
def test_bad_motors(options, what):
    scene, body = lever()
    n = len(scene.joints)
    with pytest.raises(InputError, match=what):
        scene.motor(**{"at": body, **options})
    assert len(scene.joints) == n and not scene.loads


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


def alone(angle=1.0, arm=0.6):
    """A pendulum without any beam, and its small frequency."""
    body = RigidBody(2.0, 0.1, position=(arm * np.sin(angle), -arm * np.cos(angle)), name="bob")
    scene = Scene(body).pin((0, 0)).gravity((0, -G))
    return scene, body, np.sqrt(2.0 * G * arm / (0.1 + 2.0 * arm**2))


@pytest.mark.parametrize("scheme, error", [("energy-momentum", 2e-4), ("generalized-alpha", 1e-3),
                                           ("radau", 1e-8)])
def test_the_period_of_a_pendulum_alone(scheme, error):
    scene, body, omega = alone()
    quarter = ellipk(np.sin(0.5) ** 2) / omega
    history = scene.integrate(2.0 * quarter, quarter / 50, scheme=scheme,
                              until=lambda state: state.angle(body) + 1.0)
    assert abs(history.event - quarter) < error * quarter
    if scheme == "energy-momentum":
        assert np.ptp(history.total_energy) < 1e-10


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


@pytest.mark.parametrize("scheme, most", [("energy-momentum", 3), ("generalized-alpha", 3),
                                          ("radau", 25)])
@pytest.mark.parametrize("dt", [1e-2, 1e-3])
def test_a_motor_that_starts_smoothly_turns_a_body_at_rest(scheme, most, dt):
    """There is no energy yet, and directions are known to eps only."""
    for power in (3, 4):
        body = RigidBody(1.0, 0.1, (0.4, 0.3), name="arm")
        scene = Scene(body).pin((0, 0))
        motor = scene.motor(body, angle=lambda t: 3.0 * t**power)
        history = scene.integrate(20 * dt, dt, scheme=scheme)
        turn = 3.0 * history.t**power
        assert_allclose(history.angle(body), turn, rtol=0, atol=1e-14)
        assert history.substeps == 0 and history.iterations <= 20 * most
        moment = 3.0 * power * (power - 1) * 0.35 * history.t[-1]**(power - 2)
        assert_allclose(abs(history.joint_force(motor)[-1]), moment, rtol=0.2)


def test_statics_of_bodies_alone():
    """A body on three springs sags as its stiffness says; it buckles on a weak turning spring."""
    body = RigidBody(1.0, 0.1, name="plate")
    scene = Scene(body)
    for x, y, dx, dy in ((-0.2, 0, 0, 1), (0.2, 0, 0, 1), (0.2, 0, 1, 0)):
        scene.spring(1e4, between=(("ground", (x + dx, y + dy)), (body, (x, y))))
    state = scene.gravity((0, -G)).solve_static()
    assert state.converged and state.stability == "stable" and len(scene.plan()) > 5
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
    assert state.iterations <= 1 and state.stability == "stable"
    assert_allclose(state.reactions(None, body).force, (0.0, 2.0 * G))
    with pytest.raises(InputError, match="no modes, as supports and joints hold all"):
        scene.modes(1)


def test_a_scene_of_bodies_is_kept_and_written(tmp_path):
    scene, body, _ = alone()
    history = scene.integrate(0.2, 0.01, checkpoint=tmp_path / "half.npz", every=7)
    again = pickle.loads(pickle.dumps(scene)).resume(tmp_path / "half.npz")
    assert np.array_equal(again.u, history.u)
    history.save(tmp_path / "swing.pvd")
    grid = history.state(-1).to_pyvista()
    assert grid.n_cells == 1 and np.allclose(grid.bounds[:2], [
        np.min(body.outline_at(history.u[-1])[0]), np.max(body.outline_at(history.u[-1])[0])])
    assert len(history.state(-1).plot().collections) == 1  # outlines, and none of a beam
    assert "det F" not in str(history.state(-1))


@pytest.mark.parametrize("wrong, words", [
    (lambda scene, body: scene.replace(loads=[]).solve_static(), "scene.pin"),
    (lambda scene, body: scene.obstacle(Line((0, -3), (0, 1))), "surfaces of beams"),
    (lambda scene, body: scene.pressure("top", 1.0), "beams"),
    (lambda scene, body: scene.integrate(0.02, 0.01).state(-1).resultants(), "bodies alone"),
])
def test_what_bodies_alone_have_not(wrong, words):
    scene, body, _ = alone()
    with pytest.raises(AncfError, match=words):
        wrong(scene, body)


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


def test_bodies_that_joints_drive_altogether():
    body = RigidBody(mass=1, inertia=1, position=(0.5, 0))
    scene = Scene(body)
    scene.joint("angle", beam=body, angle=lambda t: t)
    scene.joint("position", at=(0, 0), beam=body, r=lambda t: (0, t))
    state = scene.solve_static()
    assert_allclose(state.angle(body), 1, atol=1e-9)
    assert_allclose(state.position(body), (0.5 * np.cos(1), 1 + 0.5 * np.sin(1)), atol=1e-9)


@pytest.mark.parametrize("stiffness, stability", [(100.0, "stable"), (-100.0, "unstable")])
def test_a_body_on_a_guide_is_as_stable_as_its_spring(stiffness, stability):
    body = RigidBody(mass=2, inertia=1e-3, position=(0, 0))
    scene = Scene(body).point_force((0, -1), at=(0, 0), beam=body)
    scene.slider(body, on="ground", direction=(0, 1), angle=True)
    scene.spring(lambda longer: stiffness * longer, between=((body, (0, 0)), ("ground", (0, -0.2))))
    state = scene.solve_static(stable=False)
    assert_allclose(state.displacement(body), [0, -1 / stiffness], atol=1e-9)
    assert state.stability == stability


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


@pytest.mark.parametrize("dt", [np.pi / 150, 0.02, "auto"])
@pytest.mark.parametrize("scheme", ["energy-momentum", "radau"])
def test_a_spun_parallelogram_passes_its_positions_in_line(scheme, dt):
    scene, crank, coupler, rocker = parallelogram(np.pi / 3)
    v = np.array([-np.sin(np.pi / 3), np.cos(np.pi / 3)])
    scene.initial_velocity(lambda x: np.array([-x[1], x[0]]), beam=crank)
    scene.initial_velocity(lambda x: np.array([-x[1], x[0] - 1.0]), beam=rocker)
    scene.initial_velocity(tuple(v), beam=coupler)
    history = scene.integrate(3.0, dt, scheme=scheme)
    turn = history.angle(rocker) - history.angle(rocker)[0]
    assert_allclose(turn, history.t, rtol=0, atol=1e-3)
    assert np.ptp(history.total_energy) < 1e-5 * history.total_energy[0]


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


def three_cranks(angle):
    """The parallelogram with a third crank in its middle, which its other joints do not need."""
    _, crank, coupler, rocker = parallelogram(angle)
    A = (0.5 + np.cos(angle), np.sin(angle))
    third = rod((0.5, 0.0), A)
    scene = Scene(crank, coupler, rocker, third)
    scene.pin((0, 0), crank).pin((1, 0), rocker).pin((0.5, 0), third)
    first, second = (np.cos(angle), A[1]), (1.0 + np.cos(angle), A[1])
    scene.hinge((crank, first), (coupler, first))
    scene.hinge((coupler, second), (rocker, second))
    scene.hinge((coupler, A), (third, A))
    return scene, crank, coupler, rocker, third


@pytest.mark.parametrize("dt", [np.pi / 150, 0.02])
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau"])
def test_three_cranks_turn_past_positions_in_line(scheme, dt):
    scene, *bodies = three_cranks(np.pi / 3)
    scene.motor(bodies[0], speed=1.0)
    with pytest.warns(ModelWarning, match="^1 of 17 equations of joints repeat others"):
        history = scene.integrate(3.0, dt, scheme=scheme)
    for body, rate in zip(bodies, (1.0, 0.0, 1.0, 1.0)):
        assert_allclose(history.angle(body), history.angle(body)[0] + rate * history.t, rtol=0,
                        atol=1e-5)


def test_three_cranks_carry_a_load():
    """On the coupler, held by a guide on the first crank, which takes all of it."""
    scene, *bodies = three_cranks(np.pi / 3)
    top = (0.5, np.sin(np.pi / 3))  # of the first crank
    scene.joint("line", beam=bodies[0], at=top, direction=(0, 1))
    scene.point_force((4.0, 0.0), at=(1.5, top[1]), beam=bodies[1])
    with pytest.warns(ModelWarning):
        state = scene.solve_static()
    assert abs(state.joint_force(scene.joints[-1])[0]) == pytest.approx(4.0, abs=1e-9)


def plates(way):
    """A pendulum of two bodies that are one, by a weld or by two hinges."""
    a = RigidBody(1.0, 0.1, position=(0.5, 0.0))
    b = RigidBody(1.0, 0.2, position=(1.5, 0.0))
    scene = Scene(a, b).pin((0, 0), a)
    scene.point_force((0.0, -9.81), at=(0.5, 0.0), beam=a)
    scene.point_force((0.0, -9.81), at=(1.5, 0.0), beam=b)
    if way == "weld":
        return scene, [scene.joint("weld", beams=(a, b), at=(1.0, 0.0))]
    return scene, [scene.hinge((a, x), (b, x)) for x in ((0.9, 0.0), (1.1, 0.02))]


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_two_hinges_are_a_weld(scheme):
    one, (weld,) = plates("weld")
    two, hinges = plates("hinges")
    a = one.integrate(1.0, 0.01, scheme=scheme)
    with pytest.warns(ModelWarning, match="^1 of 8 equations"):
        b = two.integrate(1.0, 0.01, scheme=scheme)
    assert_allclose(b.u[-1], a.u[-1], rtol=0, atol=1e-8)
    force = a.joint_force(weld)[-1, :2]
    assert_allclose(sum(b.joint_force(hinge)[-1] for hinge in hinges), force, rtol=0,
                    atol=1e-5 * np.abs(force).max())


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
