"""Sliders on beams and bodies; welds and hinges at points between the ends of beams."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, InputError, MeshBeam, RigidBody, Scene, StVenantKirchhoff)
from skfem_ancf.dynamics.history import angular_momentum, momentum

G = 9.81
E, H = 1e9, 0.01
EI, EA = E * H**4 / 12, E * H * H


def line(a, b, n, element=None, name=None, E=E, h=H, density=100.0, grading=1.0, damping=None):
    """A straight beam from a to b."""
    a, d = np.array(a, dtype=float), np.subtract(b, a)
    mesh = MeshBeam.init_line(np.hypot(*d) * np.linspace(0, 1, n + 1)**grading, h, origin=a,
                              angle=np.arctan2(d[1], d[0]))
    return Beam(mesh, element or ElementBeamCable(), StVenantKirchhoff(E, 0.0, density), width=h,
                name=name, damping=damping)


# motion

@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
@pytest.mark.parametrize("angle", [False, True])
def test_a_mass_on_an_inclined_plane(scheme, angle):
    """g sin(slope) along it, across all elements; m g cos(slope) on it."""
    plane = line((0, 0), (2, -1), 5, E=1e14)
    body = RigidBody(1.0, 0.1, (0.2, -0.1))
    scene = Scene(plane, body).clamp("left").clamp("right").gravity((0, -G), beam=body)
    slider = scene.slider(body, plane, angle=angle)
    history = scene.integrate(0.6, 5e-3, scheme=scheme)
    way = [slider.distance(u) for u in history.u]
    assert_allclose(way, np.hypot(0.2, 0.1) + 0.5 * G / np.sqrt(5) * history.t**2, atol=1e-5)
    # of the plane's own vibration the mean is zero
    force = history.joint_force(slider)[:, 0]
    assert_allclose(np.mean(force[20:]), G * 2 / np.sqrt(5), rtol=1e-2)
    assert np.ptp(history.total_energy) < 1e-6


def thrown(element, angle=True, **options):
    """A body slides along a beam that bends under it and vibrates."""
    beam = line((0, 0), (2, 0), 6, element, E=3e7, h=0.05, name="rail", **options)
    body = RigidBody(1.0, 0.01, (0.3, 0))
    scene = Scene(beam, body).pin("left").pin("right").gravity((0, -G))
    scene.initial_velocity(to_the_right, beam=body)
    slider = scene.slider(body, beam, angle=angle)
    return scene, body, slider


def to_the_right(x):
    return np.array([1.0 + 0 * x[0], 0 * x[0]])


@pytest.mark.parametrize("angle", [False, True])
@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)], ids=repr)
def test_energy_of_a_body_that_slides_on_a_beam(element, angle):
    """Kept with coarse steps."""
    scene, body, slider = thrown(element, angle)
    history = scene.integrate(0.4, 16e-3)
    assert np.ptp(history.total_energy) < 1e-11 * history.strain_energy.max()
    s = [slider.distance(u) for u in history.u]
    assert s[0] < 0.31 and s[-1] > 0.7  # over element boundaries
    assert_allclose(history.position(body)[-1], scene_position(scene, history, s[-1]), atol=1e-7)


def scene_position(scene, history, s):
    """The point of the axis at a length of the stress-free one."""
    return history.position((s, 0.0), beam="rail")[-1]


def flying(element, angle):
    """A body on a spring goes to and fro along a beam; both turn freely."""
    beam = line((0, 0), (2, 0), 6, element, E=3e7, h=0.05, name="rail", grading=1.2)
    body = RigidBody(1.0, 0.02, (1.3, 0))
    scene = Scene(beam, body).spring(50.0, between=(("rail", (0.0, 0.0)), (body, (1.3, 0.0))),
                                    length=1.0)
    for member in (beam, body):
        scene.initial_velocity(turning, beam=member)
    return scene, scene.slider(body, beam, angle=angle)


def turning(x):
    return np.array([0.3 - x[1], x[0] - 1.0])


@pytest.mark.parametrize("element, angle, n", [
    (ElementBeamCable(), True, 250), (ElementBeamCable(5), False, 40),
    (ElementBeamANCF(2), True, 40), (ElementBeamANCFCubic(1), False, 40)], ids=str)
def test_what_a_sleeve_in_flight_keeps(element, angle, n):
    """Energy and both momenta, to round-off."""
    scene, slider = flying(element, angle)
    history, system = scene.integrate(n * 1e-2, 1e-2), scene.system
    s = [slider.distance(u) for u in history.u]
    assert min(s) < 0.75 and max(s) > 1.29
    assert np.ptp(history.total_energy) < 1e-11 * history.total_energy[0]
    momenta = np.array([momentum(system, v) for v in history.v])
    assert_allclose(momenta - momenta[0], 0.0, atol=1e-10)
    turn = [angular_momentum(system, u, v) for u, v in zip(history.u, history.v)]
    assert_allclose(turn, turn[0], rtol=1e-10)


def test_a_mass_that_leaves_its_beam_is_said_to():
    plane = line((0, 0), (1, -0.5), 4, E=1e12, name="plane")
    body = RigidBody(1.0, 0.1, (0.8, -0.4))
    scene = Scene(plane, body).clamp("left").clamp("right").gravity((0, -G), beam=body)
    scene.slider(body, plane, name="skate")
    with pytest.raises(ConvergenceError, match="skate.*left the beam 'plane' at its right") as o:
        scene.integrate(1.0, 0.01)
    leave = np.sqrt(2 * np.hypot(0.2, 0.1) / (G / np.sqrt(5)))
    assert abs(o.value.state.t[-1] - leave) < 0.02


# statics

def overhang(F, a, length):
    """Elastica of EI = 1, clamped at 0, through a smooth ring at (a, 0), a force F up at its end.

    The ring pushes along the normal: unknowns are that force, the curvature at the root, and where
    and at which angle the ring is.
    """
    def shoot(z, F):
        k0, R, s, theta = z

        def bend(force, begin, end, y):
            return solve_ivp(lambda _, y: [np.cos(y[2]), np.sin(y[2]), y[3], force[0] * np.sin(y[2])
                                           - force[1] * np.cos(y[2])],
                             (begin, end), y, rtol=1e-11, atol=1e-13).y[:, -1]

        first = bend((-R * np.sin(theta), F + R * np.cos(theta)), 0.0, s, [0.0, 0.0, 0.0, k0])
        second = bend((0.0, F), s, length, first)
        return np.array([first[0] - a, first[1], first[2] - theta, second[3]]), second

    over, z = length - a, np.array([0.0, 0.0, a, 0.0])
    z[:2] = -0.1 * F * over / 2, -0.1 * F * (1 + 1.5 * over / a)
    for part in np.linspace(0.1, 1.0, 10):
        z = fsolve(lambda z: shoot(z, part * F)[0], z, xtol=1e-11)
    return z[:3], shoot(z, F)[1]


@pytest.mark.parametrize("element", [ElementBeamCable(), ElementBeamANCF(2)], ids=repr)
def test_a_beam_through_a_ring(element):
    """Large bending; the beam is drawn through the ring."""
    (_, R, s), end = overhang(2.5, 1.0, 2.0)
    assert s > 1.009
    beam = line((0, 0), (2, 0), 64, element)
    scene = Scene(beam).clamp("left").point_force((0, 2.5 * EI), (2, 0))
    ring = scene.slider(("ground", (1, 0)), beam)
    state = scene.solve_static()
    assert_allclose(ring.distance(state.u), s, atol=3e-5)
    assert_allclose(state.position((2, 0)), end[:2], atol=1e-4)
    assert_allclose(state.joint_force(ring)[0], -R * EI, rtol=2e-4)
    assert state.stability == "stable"


def test_a_sleeve_that_carries_a_moment():
    """Clamped, guided at 1, a force at the end of the overhang: nothing reaches the root."""
    F = 1e-3 * EI
    beam = line((0, 0), (2, 0), 128)
    scene = Scene(beam).clamp("left").point_force((0, F), (2, 0))
    guide = scene.slider(("ground", (1, 0)), beam, angle=True)
    state = scene.solve_static()
    assert_allclose(state.displacement((2, 0))[1], F / (3 * EI), rtol=1e-4)
    assert_allclose(np.abs(state.joint_force(guide)), (F, F * 1.0), rtol=2e-3)
    assert abs(state.reactions("left").moment) < 1e-2 * F


def test_a_beam_on_a_beam():
    """The end of a cantilever rests on the middle of another, across: springs of 3 EI / l^3."""
    low = line((0, 0), (2, 0), 32, name="low")
    high = line((1, 0), (1, 1), 32, name="high", E=2 * E)
    scene = Scene(low, high).clamp("left", "low").clamp("right", "high")
    slider = scene.slider(("high", (1, 0)), "low")
    F = 1e-3 * EI
    scene.point_force((F, 0), (1, 0), "high")
    state = scene.solve_static()  # along the axis nothing is held
    assert_allclose(state.displacement((1, 0), "high")[0], F / (3 * 2 * EI), rtol=1e-4)
    assert abs(state.joint_force(slider)[0]) < 1e-2 * F
    scene = Scene(low, high).clamp("left", "low").clamp("right", "high")
    slider = scene.slider(("high", (1, 0)), "low")
    state = scene.point_force((0, F), (2, 0), "low").solve_static()
    # the upper beam is a strut of 2 EA, the lower one a propped cantilever with an overhang
    assert_allclose(state.joint_force(slider)[0], F * 2.5, rtol=1e-3)


@pytest.mark.parametrize("beams", [1, 0])
def test_a_slot_in_a_body(beams):
    """Whitworth's quick return: a pin on a crank drives a rocker with a slot."""
    crank = RigidBody(1.0, 0.1, (0.0, 0.15), name="crank")
    rocker = RigidBody(2.0, 0.3, (0.0, -0.2), angle=0.5 * np.pi, name="rocker")
    scene = Scene(*[line((5, 0), (6, 0), 2)][:beams], crank, rocker)
    if beams:
        scene.clamp("left", 0)
    scene.pin((0, 0), crank).pin((0, -0.7), rocker)
    scene.joint("angle", at=None, beam=crank, angle=lambda t: 4.0 * t + t * t)
    slot = scene.slider((crank, (0.0, 0.3)), rocker, direction=(0, 1))
    history = scene.integrate(1.0, 5e-3, scheme="generalized-alpha")
    turn = 4.0 * history.t + history.t**2
    pin = 0.3 * np.array([-np.sin(turn), np.cos(turn)])
    assert_allclose(history.position((0.0, 0.3), crank), pin.T, atol=1e-8)
    expected = np.arctan2(pin[1] + 0.7, pin[0])
    assert_allclose(history.angle(rocker), np.unwrap(expected), atol=1e-8)
    assert not scene.system.backend.tables.plain.joints.custom  # quadratic: a table
    assert history.joint_force(slot).shape == (201, 1)


def test_energy_in_a_slot_is_kept():
    """A bead in a slot of a body that turns freely, angular momentum too."""
    disk = RigidBody(2.0, 0.5, (0, 3), name="disk")
    bead = RigidBody(0.4, 1e-3, (0.1, 3), name="bead")
    scene = Scene(line((5, 0), (6, 0), 2), disk, bead).clamp("left", 0)
    scene.pin((0, 3), disk).slider(bead, disk, direction=(1, 0), angle=True)
    for body in (disk, bead):
        scene.initial_velocity(lambda x: 6.0 * np.array([-(x[1] - 3.0), x[0]]), beam=body)
    history = scene.integrate(0.5, 2.5e-3)
    assert np.ptp(history.total_energy) < 1e-10
    r = np.hypot(*(history.position(bead) - (0, 3)).T)
    J = 0.5 + 1e-3 + 0.4 * r**2
    assert_allclose(J * history.angular_velocity(disk), (0.501 + 0.004) * 6.0, rtol=1e-9)
    # r'^2 = w0^2 (J0 / J) r^2 ... by energy
    rate = np.sqrt(36.0 * 0.505 * (1 - 0.505 / J[-1]) / 0.4)
    v = history.velocity(bead)[-1]
    along = history.position(bead)[-1] - (0, 3)
    assert_allclose(v @ along / r[-1], rate, rtol=1e-4)


# welds and hinges between ends


@pytest.mark.parametrize("kind", ["one call", "several calls", "a body between"])
def test_a_star(kind):
    """Four arms of length 1 clamped at their ends: a moment at the middle turns it by M / 16 EI."""
    arms = [line((0, 0), (np.cos(a), np.sin(a)), 24, name=f"arm {k}")
            for k, a in enumerate((0.1, 1.7, 3.5, 4.9))]
    hub = RigidBody(1.0, 0.1, (0, 0), name="hub")
    scene = Scene(*arms, hub) if kind == "a body between" else Scene(*arms)
    for arm in arms:
        scene.clamp("right", arm, thickness="free")
    if kind == "several calls":
        for arm in arms[1:]:
            scene.weld((arms[0], "left"), (arm, "left"))
    else:
        scene.weld((0, 0))
    M = 1e-3 * EI
    if kind == "a body between":
        scene.moment(hub, M)
    else:
        scene.moment("left", M, arms[2])
    state = scene.solve_static()
    turn = M / (16 * EI)
    angles = [float(state.resultants((0, 0), arm).angle) for arm in arms]
    start = np.array([0.1, 1.7, 3.5, 4.9])
    assert_allclose(np.angle(np.exp(1j * (np.array(angles) - start))), turn, rtol=1e-4)
    if kind == "a body between":
        assert_allclose(state.angle(hub), turn, rtol=1e-4)


# what is refused

@pytest.mark.parametrize("call, what", [
    (lambda s: s.slider((0, (1.0, 0.0)), 0), "along the beam itself"),
    (lambda s: s.slider((2, (0.5, 0.3)), 0), "0.3 off the axis"),
    (lambda s: s.slider(("ground", (2.5, 0.0)), 0), "off the axis"),
    (lambda s: s.slider(("ground", (0.5, 0.0)), 0, direction=(1, 0)), "give no direction"),
    (lambda s: s.slider((0, (0.5, 0.0)), 2), "needs the direction"),
    (lambda s: s.slider((0, (0.5, 0.0)), "ground"), "needs the direction"),
    (lambda s: s.slider((0, (0.5, 0.0)), 2, direction=(0, 0)), "must not be zero"),
    (lambda s: s.slider((0, (0.5, 0.0)), 2, direction=(1, np.nan)), "direction"),
    (lambda s: s.slider((0, (0.5, 0.0)), 2, direction=(1, 0), angle="yes"), "angle"),
    (lambda s: s.slider(("ground", (0.5, 0.0)), "ground", direction=(1, 0)), "both of the ground"),
    (lambda s: s.slider((0, (0.5, 0.0)), "rail"), "rail"),
    (lambda s: s.joint("slot", at=(0, (0.5, 0.0)), on=2, direction=(1, 0), through=(0, 1)),
     "off the line"),
    (lambda s: s.slider((2, (0.5, 2.0)), 2, direction=(1, 0)), "its beam or body"),
    (lambda s: s.slider((9.0, 9.0), 0), "no beam and no rigid body"),
    (lambda s: s.slider((1.0, 0.0), 0), "choose one"),
])
def test_bad_sliders(call, what):
    scene = Scene(line((0, 0), (1, 0), 4), line((1, 0), (2, 0), 4), RigidBody(1.0, 1e-3, (0.5, 2)))
    with pytest.raises(InputError, match=what):
        call(scene)
    assert not scene.joints
