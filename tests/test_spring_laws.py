"""Springs and dashpots by functions of the caller's: against linear ones, SciPy and energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam, RigidBody,
                        Scene, StVenantKirchhoff)
from skfem_ancf.actions.forces.springs import Law

E, B, H, G = 2e8, 0.01, 0.01, 9.81
MESH = MeshBeam.init_line(np.linspace(0, 1, 9), height=H)


def beam_of(element=None, modulus=E, density=7800.0):
    return Beam(MESH, element or ElementBeamANCF(2), StVenantKirchhoff(modulus, 0.3, density), B)


def hardening(s):
    return 20.0 * s + 500.0 * s**3


def hardening_potential(s):
    return 10.0 * s**2 + 125.0 * s**4


def drag(w):
    return 0.5 * w * abs(w)


def wound(a):
    return 0.4 * a + 0.3 * a**3


LAWS = [hardening, (hardening, hardening_potential)]
ELEMENTS = {"sections": ElementBeamANCF(2), "cable": ElementBeamCable(3)}


def test_a_rigid_bar_on_a_hardening_spring_at_rest():
    """A stiff bar hangs from a pin and a spring at its tip: moments about the pin."""
    scene = Scene(beam_of(modulus=2e13)).pin("left").gravity((0, -G))
    scene.spring(hardening, between=((1, 0), (1, 0.5)))
    state = scene.solve_static()
    weight = 7800 * B * H * G

    def moment(angle):
        tip, end = np.array([np.cos(angle), np.sin(angle)]), np.array([1.0, 0.5])
        d = end - tip
        force = hardening(np.hypot(*d) - 0.5) * d / np.hypot(*d)
        return tip[0] * force[1] - tip[1] * force[0] - 0.5 * weight * np.cos(angle)

    angle = brentq(moment, -1.0, 0.2, xtol=1e-14)
    tip = [np.cos(angle), np.sin(angle)]
    assert_allclose(state.position((1, 0)), tip, atol=1e-6)


@pytest.mark.parametrize("law", LAWS, ids=["force", "both"])
def test_a_rigid_pendulum_with_a_hardening_torsional_spring(law):
    """Against SciPy: J phi'' = -M(phi) - c phi' |phi'| - m g / 2 cos(phi)."""
    scene = Scene(beam_of(modulus=2e13)).pin("left").gravity((0, -G))
    scene.torsional_spring(law, at="left", damping=drag)
    history = scene.integrate(0.3, 1e-3, scheme="generalized-alpha")
    m = 7800 * B * H
    J = m / 3.0 + m * H**2 / 12.0

    def rate(t, y):
        return [y[1], (-hardening(y[0]) - drag(y[1]) - 0.5 * m * G * np.cos(y[0])) / J]

    exact = solve_ivp(rate, (0, 0.3), [0.0, 0.0], rtol=1e-10, atol=1e-12, t_eval=[0.1, 0.2, 0.3])
    tip = history.position((1, 0))[[100, 200, 300]]
    assert_allclose(np.arctan2(tip[:, 1], tip[:, 0]), exact.y[0], atol=2e-3 * np.ptp(exact.y[0]))


@pytest.mark.parametrize("law", LAWS, ids=["force", "both"])
@pytest.mark.parametrize("element", list(ELEMENTS))
def test_energy_is_kept(element, law):
    scene = Scene(beam_of(ELEMENTS[element])).pin("left").gravity((0, -G))
    scene.spring(law, between=((1, 0), (1, 0.5)), damping=drag).torsional_spring(wound, at="left")
    history = scene.integrate(0.2, 2e-3)
    assert history.dissipated[-1] > 1e-4
    total = history.total_energy + history.dissipated
    assert np.ptp(total) < 1e-9 * np.ptp(history.kinetic_energy)


def test_a_spring_that_only_pulls():
    """A rope: no force while it is slack; its potential by integration over the kink."""
    law = Law("k", lambda s: 30.0 * max(s, 0.0))
    assert law.potential(-0.5) == 0.0
    assert_allclose(law.potential(0.2), 15.0 * 0.04, rtol=1e-9)
    scene = Scene(beam_of()).clamp("left").gravity((0, -G))
    slack = scene.spring(lambda s: 30.0 * max(s, 0.0), ((1, 0), (1, -3.0))).solve_static()
    free = Scene(beam_of()).clamp("left").gravity((0, -G)).solve_static()
    assert_allclose(slack.u, free.u, atol=1e-9)


@pytest.mark.parametrize("add, message", [
    (lambda s: s.spring("soft", ((1, 0), (1, 1))), "k"),
    (lambda s: s.spring((), ((1, 0), (1, 1))), "a function and its potential"),
    (lambda s: s.spring((np.sin, 3.0), ((1, 0), (1, 1))), "potential of k must be a function"),
    (lambda s: s.spring(lambda s: "much", ((1, 0), (1, 1))), r"k\(elongation"),
    (lambda s: s.spring(lambda s: 1 / 0, ((1, 0), (1, 1))), "ZeroDivisionError"),
    (lambda s: s.spring((lambda s: s, lambda s: s * s), ((1, 0), (1, 1))), "is not the derivative"),
    (lambda s: s.spring(1.0, ((1, 0), (1, 1)), damping=np.cos), "must be 0 where that is 0"),
    (lambda s: s.torsional_spring(lambda a: np.nan, "left"), r"k\(angle"),
    (lambda s: s.torsional_spring(1.0, "left", damping=lambda w: None), "damping")])
def test_bad_laws(add, message):
    with pytest.raises(InputError, match=message):
        add(Scene(beam_of()))


# whole turns

STIFF, INERTIA, MOST = 2.0, 0.5, 5.37
TURNING = {"number": STIFF, "function": lambda a: STIFF * a,
           "pair": (lambda a: STIFF * a, lambda a: 0.5 * STIFF * a**2)}


def wheel(law, **options):
    """A wheel on a torsional spring, which turns as MOST sin 2 t from where the spring is free."""
    body = RigidBody(INERTIA, INERTIA, (0.3, 0.2))
    scene = Scene(body).pin(body).torsional_spring(law, body, **options)
    return scene.initial_velocity(
        lambda x: 2.0 * MOST * np.array([0.2 - x[1], x[0] - 0.3]), beam=body)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("law", TURNING.values(), ids=TURNING)
@pytest.mark.parametrize("scheme, rtol", [("energy-momentum", 5e-3), ("generalized-alpha", 1e-2),
                                          ("hht", 1e-2), ("newmark", 1e-2), ("radau", 1e-6)])
def test_a_wheel_on_a_torsional_spring_turns_by_more_than_half_a_turn(law, scheme, rtol):
    scene = wheel(law)
    history = scene.integrate(3.0, 0.01, scheme=scheme)
    exact = MOST * np.sin(2.0 * history.t)
    assert_allclose(history.angle(0), exact, atol=rtol * MOST)
    assert_allclose(history.spring_force(0), STIFF * exact, atol=rtol * STIFF * MOST)
    assert_allclose(history.total_energy, history.total_energy[0],
                    rtol=1e-11 if scheme == "energy-momentum" else rtol)
    # a state far from the start knows its turns, and a motion goes on from it
    middle = history.state(70)
    assert middle.spring_force(0) == pytest.approx(STIFF * history.angle(0)[70], rel=1e-12)
    again = scene.integrate(3.0, 0.01, scheme=scheme, start=middle)
    assert_allclose(again.angle(0)[-1] - 0.0, history.angle(0)[-1], rtol=1e-6)
    assert_allclose(again.u[-1], history.u[-1], atol=1e-9)


def test_a_wheel_turns_on_in_a_scheme_of_order_4_and_in_automatic_steps():
    for options, atol in (({"dt": 0.01, "scheme": "energy-momentum-4"}, 1e-5),
                          ({"dt": "auto", "scheme": "auto"}, 1e-3)):
        history = wheel(STIFF).integrate(3.0, **options)
        assert_allclose(history.angle(0), MOST * np.sin(2.0 * history.t), atol=atol)


@pytest.mark.parametrize("law", TURNING.values(), ids=TURNING)
def test_two_wheels_on_one_spring_turn_against_each_other(law):
    """The relative angle has half the inertia."""
    a, b = (RigidBody(INERTIA, INERTIA, (x, 0.0)) for x in (0.0, 1.0))
    scene = Scene(a, b).pin(a).pin(b).torsional_spring(law, a, other=b, angle=0.5)
    for body, sign in ((a, 1.0), (b, -1.0)):
        scene.initial_velocity(lambda x, at=body, sign=sign: 12.0 * sign * np.array(
            [-x[1], x[0] - at.position[0]]), beam=body)
    history = scene.integrate(2.0, 4e-3)
    rate = np.sqrt(2.0 * STIFF / INERTIA)
    exact = 0.5 - 0.5 * np.cos(rate * history.t) + 24.0 / rate * np.sin(rate * history.t)
    assert exact.max() > 8.0
    assert_allclose(history.angle(a) - history.angle(b), exact, atol=5e-3 * 8.0)
    assert np.ptp(history.total_energy) < 1e-11 * history.total_energy[0]


@pytest.mark.parametrize("law", TURNING.values(), ids=TURNING)
def test_a_run_winds_a_spring_up_and_back(law):
    """From an angle of 0.4, by a moment of 30 and back to -20: moment over stiffness."""
    def wound(t):
        return 30.0 * t if t < 1.0 else 80.0 - 50.0 * t

    body = RigidBody(1.0, 1.0)
    scene = Scene(body).pin(body).torsional_spring(law, body, angle=0.4).moment(
        body, 1.0, amplitude=wound)
    history = scene.run([1.0, 2.0], increments=20)
    moment = np.array([wound(t) for t in history.t])
    assert_allclose(history.spring_force(0), moment, atol=1e-9)
    assert_allclose(history.angle(0), 0.4 + moment / STIFF, atol=1e-9)
    # parts of it go on
    half = scene.run([1.0], increments=20).state(-1)
    rest = scene.run([2.0], increments=20, start=half)
    assert rest.spring_force(0)[-1] == pytest.approx(-20.0, rel=1e-9)
    near = Scene(body).pin(body).torsional_spring(law, body, angle=0.4).moment(body, 29.0)
    assert near.solve_static(start=half).spring_force(0) == pytest.approx(29.0, rel=1e-9)


@pytest.mark.parametrize("law", TURNING.values(), ids=TURNING)
def test_a_bar_is_swung_round_by_more_than_two_turns(law):
    """A stiff bar, pinned at its end, against m L^2 / 3"""
    rho, rate = 7800.0, 30.0
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), 0.01, angle=0.7), ElementBeamCable(5),
                StVenantKirchhoff(2e13, 0.0, rho), 0.01)
    stiff = STIFF / 2.0
    k = stiff if isinstance(law, float) else (lambda a: stiff * a)
    scene = Scene(beam).pin("left").torsional_spring(k, "left")
    scene.initial_velocity(lambda x: rate * np.array([-x[1], x[0]]))
    history = scene.integrate(1.5, 2e-3)
    inertia = rho * 1e-4 * (1 / 3 + 1e-4 / 12)
    own = np.sqrt(stiff / inertia)
    exact = rate / own * np.sin(own * history.t)
    assert exact.max() > 4 * np.pi
    assert_allclose(history.spring_force(0), stiff * exact, atol=2e-3 * stiff * exact.max())
    assert np.ptp(history.total_energy) < 1e-9 * history.total_energy[0]


@pytest.mark.parametrize("law", TURNING.values(), ids=TURNING)
def test_a_path_goes_on_beyond_half_a_turn(law):
    """A stiff bar on a spring is turned by a moment: moment over stiffness, in each of its states.
    """
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), 0.02, angle=0.7), ElementBeamCable(5),
                StVenantKirchhoff(2e11, 0.0), 0.02)
    scene = Scene(beam).pin("left").torsional_spring(law, "left").moment("right", 12.0)
    path = scene.continuation(steps=200, max_load=1.3, ds=0.2)
    forces = [path.state(k).spring_force(0) for k in range(len(path))]
    assert_allclose(forces, 12.0 * path.load, atol=1e-6)
    turned = np.arctan2(*path.position("right")[-1][::-1]) - 0.7
    assert path.load[-1] == pytest.approx(1.3) and all(path.stable)
    assert (12.0 * 1.3 / STIFF - turned) / (2 * np.pi) == pytest.approx(1.0, abs=1e-3)
    assert path.points[-1].state.spring_force(0) == pytest.approx(15.6, rel=1e-6)
