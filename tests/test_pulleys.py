"""Belts on pulleys that turn, and on those that a controller pulls them over, with friction."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.actions.obstacles import Circle

RADIUS, HEIGHT, WIDTH, TAIL, DENSITY = 0.1, 1e-3, 0.01, 0.1, 1000.0
AXIS = RADIUS + HEIGHT / 2
LEFT, RIGHT = (-AXIS, -TAIL), (AXIS, -TAIL)
FRICTION, WEIGHT, SPRING = 0.3, 1.0, 1e3
SCHEMES = "energy-momentum", "generalized-alpha"


def hung(angle=None):
    """A belt over half of a pulley, its ends guided upright, a weight at the right one."""
    end = TAIL + np.pi * AXIS

    def axis(s):
        s = np.asarray(s, dtype=float)
        phi = np.clip((s - TAIL) / AXIS, 0, np.pi)
        up, down = np.minimum(s - TAIL, 0), np.maximum(s - end, 0)
        return np.array([-AXIS * np.cos(phi), AXIS * np.sin(phi) + up - down])

    s = np.concatenate([[0, TAIL / 2], np.linspace(TAIL, end, 9), [end + TAIL / 2, end + TAIL]])
    belt = Beam(MeshBeam.init_curve(axis, s, HEIGHT), ElementBeamCable(5),
                StVenantKirchhoff(1e8, 0.0, DENSITY), width=WIDTH)
    scene = Scene(belt).fix("left", "r^1").fix("right", "r^1").point_force((0, -WEIGHT), at=RIGHT)
    return scene.obstacle(Circle((0, 0), RADIUS - 2e-6), friction=FRICTION, stiffness=1e8,
                          angle=angle)


def turning(rate, ramp):
    """The angle of a pulley that turns clockwise from the time 1 on, the static solution's."""
    def angle(t):
        s = max(t - 1.0, 0.0)
        return -rate * (s * s / (2 * ramp) if s < ramp else s - ramp / 2)
    return angle


def motor(history, rate, ramp, belt_turns, scheme):
    """The power of the pulley's motor at the last instant, and its work (nt,): the speed times
    minus the moment of the belt. Energy-momentum has contact forces that are means of the steps,
    and act where points are in the middle of a step."""
    speed = rate * np.clip((history.t - 1.0) / ramp, 0, 1)
    mean_speed, dt = 0.5 * (speed[1:] + speed[:-1]), np.diff(history.t)
    means = scheme == "energy-momentum"
    back = np.append(0.0, 0.5 * dt * mean_speed if means and belt_turns else 0.0 * dt)
    moments = []
    for state, turn in zip(history, back):
        (x, y), (p, q) = state.contact().points, state.contact().force
        x, y = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
        moments.append(np.sum(y * p - x * q))  # minus that on the belt
    power = np.array(moments) * speed
    work = moments[1:] * mean_speed if means else 0.5 * (power[1:] + power[:-1])
    return power[-1], np.append(0.0, np.cumsum(dt * work))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_driven_pulley_slips_under_a_belt_that_is_held(scheme):
    """exp(mu pi) of Euler and Eytelwein; the motor's work is what is lost, stored and moves."""
    rate, ramp = 0.5, 0.01
    scene = hung(turning(rate, ramp)).spring(SPRING, between=(LEFT, (-AXIS, -2 * TAIL)))
    scene.damping(mass=200.0)
    history = scene.integrate(1.1, 4e-4, t_start=1.0, start=scene.solve_static(), scheme=scheme)
    last = history.state(-1)
    pull = SPRING * last.displacement(LEFT)[1]
    assert pull == pytest.approx(WEIGHT * np.exp(FRICTION * np.pi), rel=1e-2)
    assert np.abs(last.velocity((0, AXIS))).max() < 0.03 * rate * RADIUS  # the belt is at rest
    power, work = motor(history, rate, ramp, False, scheme)
    assert power == pytest.approx((pull - WEIGHT) * AXIS * rate, rel=1e-2)
    lost = np.polyfit(history.t[-25:], history.dissipated[-25:], 1)[0]
    assert lost == pytest.approx(power, rel=1e-2)
    gained = history.total_energy + history.dissipated
    assert_allclose(gained - gained[0], work, rtol=0, atol=1e-2 * work[-1])
    assert history.dissipated[-1] > 0.5 * work[-1]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_belt_that_sticks_goes_with_the_rim(scheme):
    """Weights at both ends, of less than the capstan's ratio; damped by its mass only."""
    rate, ramp, loss, ratio = 1.0, 0.04, 100.0, 1.5
    scene = hung(turning(rate, ramp)).point_force((0, -ratio * WEIGHT), at=LEFT)
    scene.damping(mass=loss)
    history = scene.integrate(1.08, 4e-4, t_start=1.0, start=scene.solve_static(), scheme=scheme)
    last = history.state(-1)
    for phi in (0.25 * np.pi, 0.5 * np.pi, 0.75 * np.pi):
        v = last.velocity((-AXIS * np.cos(phi), AXIS * np.sin(phi)))
        assert np.hypot(*v) == pytest.approx(rate * AXIS, rel=1e-2)
    power, work = motor(history, rate, ramp, True, scheme)
    length = 2 * TAIL + np.pi * AXIS
    drag = loss * DENSITY * HEIGHT * WIDTH * length * rate * AXIS
    assert power == pytest.approx(((ratio - 1) * WEIGHT + drag) * AXIS * rate, rel=2e-2)
    gained = history.total_energy + history.dissipated
    assert_allclose(gained - gained[0], work, rtol=0, atol=1e-3 * work[-1])
    way = history.t[-1] - history.t[0] - ramp / 2
    y = history.displacement(LEFT)[:, 1]
    assert y[-1] - y[0] == pytest.approx(rate * AXIS * way, rel=1e-2)
