"""Controllers: against SciPy on the rigid arm, free bodies, and the work that they do."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamCable, InputError,
                        MeshBeam, NameUnknown, Scene, StVenantKirchhoff)

B, H, G, RHO = 0.02, 0.02, 9.81, 1000.0
MASS = RHO * B * H
J = MASS / 3.0 + MASS * H**2 / 12.0
KP, KD = 30.0, 4.0


def beam_of(element=None, n=4, modulus=1e12, name=None, x=(0, 1)):
    mesh = MeshBeam.init_line(np.linspace(*x, n + 1), height=H)
    return Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(modulus, 0.3, RHO), B,
                name=name)


def target(t):
    return 0.5 * np.sin(3.0 * t)


def pd(t, joint):
    return KP * (target(t) - joint.angle) - KD * joint.rate


def arm(element=None, **options):
    return Scene(beam_of(element)).pin("left").gravity((0, -G)).control(
        pd, at="left", kind="moment", sections={"joint": "left"}, **options)


def angle(history, k=slice(None)):
    tip = history.position((1, 0))[k]
    return np.arctan2(tip[:, 1], tip[:, 0])


def rigid(torque, times):
    def rate(t, y):
        return [y[1], (torque(t, y) - 0.5 * MASS * G * np.cos(y[0])) / J]
    return solve_ivp(rate, (0, times[-1]), [0.0, 0.0], rtol=1e-10, atol=1e-12, t_eval=times).y


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)],
                         ids=["sections", "cable"])
def test_an_arm_that_follows_its_target(element):
    history = arm(element).integrate(0.6, 1e-3, scheme="generalized-alpha")
    exact = rigid(lambda t, y: KP * (target(t) - y[0]) - KD * y[1], history.t[1:])
    assert_allclose(angle(history)[1:], exact[0], atol=1e-3 * np.ptp(exact[0]))


def test_samples_that_are_held():
    """The rigid arm in pieces, with the torque of the start of each; vibrations are damped."""
    dt = 0.02
    history = arm(dt=dt).damping(stiffness=1e-3).integrate(0.4, 5e-4, scheme="generalized-alpha")
    y, expected, torques = np.zeros(2), [], []
    for k in range(20):
        torque = KP * (target(k * dt) - y[0]) - KD * y[1]
        y = solve_ivp(lambda t, z, M=torque: [z[1], (M - 0.5 * MASS * G * np.cos(z[0])) / J],
                      (0, dt), y, rtol=1e-10, atol=1e-13).y[:, -1]
        expected.append(y[0])
        torques.append(torque)
    at = np.searchsorted(history.t, dt * np.arange(1, 21) - 1e-9)
    assert_allclose(history.t[at], dt * np.arange(1, 21), atol=1e-12)
    assert_allclose(angle(history, at), expected, atol=3e-3 * np.ptp(expected))
    held = np.unique([state.memory[1:] for state in history], axis=0)
    assert_allclose(held[:, 0], dt * np.arange(20), atol=1e-12)
    assert_allclose(held[:, 1], torques, atol=1e-2 * np.ptp(torques))


def test_a_state_keeps_the_sample_of_its_motion():
    """The force on it is the one that was held, whatever the scene has done since."""
    scene = Scene(beam_of(ElementBeamCable(3), modulus=1e7)).clamp("left").control(
        lambda t, tip: (0.0, 0.1 - 3.0 * tip.position[1]), (1, 0), points={"tip": (1, 0)}, dt=0.013)
    history = scene.integrate(0.1, 1e-3)
    state, other = history.state(80), scene.solve_static()
    force = scene.matrices(state).force
    scene.integrate(0.1, 1e-3, start=other)
    assert np.array_equal(scene.matrices(state).force, force)
    k = 78  # the last sample before
    assert_allclose(state.memory[1:], [0.078, 0.0, 0.1 - 3.0 * history.position((1, 0))[k, 1]],
                    atol=1e-12)
    # balance at the end: M a is the force of elements and control
    M = scene.matrices(state).M
    assert_allclose(force[-6:], (M @ state.acceleration)[-6:], atol=2e-2 * np.abs(force).max())
    # held from here: a motion that goes on takes a new sample
    assert scene.integrate(0.11, 1e-3, start=state).state(1).memory[1] == pytest.approx(0.08)


def test_a_force_on_a_point_that_another_measures():
    """A constant measured gap: the tip of one beam is pushed until it is level with the other's."""
    a, b = beam_of(modulus=1e8, name="a"), beam_of(modulus=1e8, name="b", x=(2, 3))
    scene = Scene(a, b).clamp("left", beam="a").clamp("right", beam="b").gravity((0, -G), beam="b")
    scene.control(lambda t, mine, his: (0.0, 40.0 * (his.position - mine.position)[1]),
                  at=("a", (1, 0)), points={"mine": (1, 0), "his": (2, 0)})
    state = scene.solve_static()
    force = 40.0 * (state.position((2, 0)) - state.position((1, 0)))[1]
    assert force < -0.1
    assert_allclose(state.reactions("left", beam="a").force, [0, -force], atol=1e-7)
    assert_allclose(state.reactions("left", beam="a").moment, -force * state.position((1, 0))[0],
                    rtol=1e-6)


def test_a_force_between_two_points_and_a_moment_between_two_sections():
    a, b = beam_of(modulus=1e8, name="a"), beam_of(modulus=1e8, name="b", x=(2, 3))
    scene = Scene(a, b).clamp("left", beam="a").clamp("right", beam="b")
    scene.control(lambda t: (0.0, 2.0 * t), at=("a", (1, 0)), other=("b", (2, 0)))
    scene.control(lambda t: 0.3, at=("a", "right"), other=("b", "left"), kind="moment")
    state = scene.solve_static()
    assert_allclose(state.reactions("left", beam="a").force, [0, -2.0], atol=1e-7)
    assert_allclose(state.reactions("right", beam="b").force, [0, 2.0], atol=1e-7)
    x = state.position((1, 0), beam="a")[0]
    assert_allclose(state.reactions("left", beam="a").moment, -2.0 * x - 0.3, rtol=1e-6)


def test_a_loop_that_drives_vibrations_says_what_to_do():
    """A rate that is held, and nothing that damps: the scheme that conserves goes on."""
    with pytest.raises(ConvergenceError, match="sample more often, add damping"):
        arm(dt=4e-3).integrate(0.03, 1e-3, scheme="generalized-alpha")
    assert arm(dt=4e-3).integrate(0.03, 1e-3).steps == 30


@pytest.mark.parametrize("make, error, message", [
    (lambda s: s.control(3.0, (1, 0)), InputError, "law must be a function"),
    (lambda s: s.control(pd, "left", kind="moment"), InputError, "law"),
    (lambda s: s.control(lambda t: 1.0, (1, 0)), InputError, "law"),
    (lambda s: s.control(lambda t: (0, np.nan), (1, 0)), InputError, "law"),
    (lambda s: s.control(lambda t: (0, 0), (1, 0), kind="push"), NameUnknown, "force"),
    (lambda s: s.control(lambda t: (0, 0), (1, 3)), InputError, "material point"),
    (lambda s: s.control(lambda t: (0, 0), (1, 0), dt=0.0), InputError, "dt"),
    (lambda s: s.control(lambda t: (0, 0), (1, 0), points=[(0, 0)]), InputError, "points"),
    (lambda s: s.control(lambda t: (0, 0), (1, 0), points={"t": (0, 0)}), InputError, "points"),
    (lambda s: s.control(lambda t, a: (0, 0), (1, 0), points={"a": (0, 0)},
                         sections={"a": "left"}), InputError, "different names")])
def test_bad_controls(make, error, message):
    with pytest.raises(error, match=message):
        make(Scene(beam_of()))
