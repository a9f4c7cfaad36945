"""Forces of impacts: their product with the steps is the change of momentum, resolved or not."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.actions.obstacles import Line
from skfem_ancf.dynamics import GeneralizedAlpha

E, RHO, L, H = 2e11, 7800.0, 0.5, 0.02
WAVE = np.sqrt(E / RHO)
MASS = RHO * L * H**2
STEEL = StVenantKirchhoff(E, 0.0, RHO)


def bar(element, x, n=8, angle=0.0):
    mesh = MeshBeam.init_line(np.linspace(0.0, L, n + 1), height=H, origin=x, angle=angle)
    return Beam(mesh, element, STEEL, width=H)


def impulse(history, name="force"):
    t = history.sensors.t
    return np.diff(t) @ history.sensors[name][1:]


ELEMENTS = ElementBeamANCF(2), ElementBeamCable(3)


@pytest.mark.parametrize("scheme", ["energy-momentum", "energy-momentum-4", "gauss", "radau"])
@pytest.mark.parametrize("dt", [5e-6, 4e-5, 1e-4], ids=["resolved", "coarse", "not resolved"])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_the_force_of_a_rod_on_a_wall_has_its_impulse(element, dt, scheme):
    """Steps that are halved, taken back in time or evaluated at points within count by their time.

    By St. Venant the force is ``rho c v A`` for the time 2 L / c (less what the penalty gives way).
    """
    v = 1.0
    scene = Scene(bar(element, (-L - 3e-4, 0.0))).obstacle(Line((0, 0), (-1, 0)))
    scene = scene.initial_velocity((v, 0), 0).sensor("force", "contact")
    history = scene.integrate(7e-4, dt, scheme=scheme)
    change = history.momentum[-1] - history.momentum[0]
    assert impulse(history) == pytest.approx(change, rel=1e-6, abs=1e-6 * MASS * v)
    if scheme == "energy-momentum":
        assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy[0]
    if dt < 1e-5:
        force, t = -history.sensors["force"][:, 0], history.sensors.t
        touches = t[force > 0.05 * force.max()]
        assert np.ptp(touches) == pytest.approx(2 * L / WAVE, rel=0.1)
        plateau = (t > 3e-4 + 0.4 * L / WAVE) & (t < 3e-4 + 1.6 * L / WAVE)
        assert force[plateau].mean() == pytest.approx(RHO * WAVE * v * H**2, rel=0.02)
        assert -change[0] == pytest.approx(2 * MASS * v, rel=0.02)
    else:
        assert np.abs(history.sensors["force"]).max() < 2 * MASS * v / dt


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_a_stiff_block_on_a_springy_floor(element):
    """The largest force is ``v sqrt(k m)`` for half a period, if the steps resolve it."""
    v, k = 1.0, 1e10  # the first frequency of the block is 60 times that on the floor
    m, omega = RHO * 0.05 * H**2, np.sqrt(k * H**2 / (RHO * 0.05 * H**2))
    # points of the sides at the corners press too, with the area of a short element
    mesh = MeshBeam.init_line([0.0, 0.001, 0.05], height=H, angle=np.pi / 2)
    scene = Scene(Beam(mesh, element, STEEL, width=H)).obstacle(Line((0, -1e-5)), stiffness=k)
    scene = scene.initial_velocity((0, -v), 0).sensor("force", "contact")
    for dt, exact in ((0.05 / omega, True), (20.0 / omega, False)):
        history = scene.integrate(4e-5 + 20 * np.pi / omega, dt)
        force = history.sensors["force"][:, 1]
        assert impulse(history)[1] == pytest.approx(2 * m * v, rel=2e-2 if exact else 0.2)
        assert impulse(history)[1] == pytest.approx(
            history.momentum[-1][1] - history.momentum[0][1], rel=1e-9)
        if exact:
            assert force.max() == pytest.approx(v * np.sqrt(k * H**2 * m), rel=0.02)
            assert np.ptp(history.t[force > 0.0]) == pytest.approx(np.pi / omega, rel=0.1)
        else:
            assert force.max() < 2.2 * m * v / dt


@pytest.mark.parametrize("dt", [5e-6, 1e-4], ids=["resolved", "not resolved"])
@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_the_force_between_two_rods_has_its_impulse(element, friction, dt):
    v = 1.0
    a, b = bar(element, (0.0, 0.0)), bar(element, (L + 3e-4, 0.0))
    scene = Scene(a, b).contact("all", friction=friction).initial_velocity((v, 0), 0)
    scene = scene.sensor("on a", "contact", beam=a).sensor("on b", "contact", beam=b)
    history = scene.integrate(7e-4, dt)
    assert np.allclose(history.sensors["on a"], -history.sensors["on b"], rtol=0, atol=1e-6)
    gained = history.state(-1).system.mass.multiply(history.v[-1])[b.N:][:: b.nd].sum()
    assert impulse(history, "on b")[0] == pytest.approx(gained, rel=1e-6)
    assert gained == pytest.approx(MASS * v, rel=0.05 if dt < 1e-5 else 0.2)
    if dt < 1e-5:
        assert history.sensors["on b"].max() == pytest.approx(0.5 * RHO * WAVE * v * H**2, rel=0.1)


@pytest.mark.parametrize("dt", [1e-6, 5e-5], ids=["resolved", "not resolved"])
def test_friction_between_members_has_its_impulse(dt):
    """A block that slides while it bounces: friction is that of the step, not of its end."""
    floor, block = (Beam(MeshBeam.init_line(np.linspace(0, size, n), height=0.01, origin=x),
                         ElementBeamANCF(2), STEEL, width=0.01)
                    for size, n, x in ((0.4, 9, (0, 0)), (0.1, 3, (0.15, 0.01002))))
    scene = Scene(floor, block).contact("all", friction=0.2).clamp("left", 0).clamp("right", 0)
    scene = scene.initial_velocity((3.0, -1.0), block).sensor("force", "contact", beam=block)
    history = scene.integrate(1e-4, dt)
    mass = history.state(-1).system.mass
    gained = mass.multiply(history.v[-1] - history.v[0])[floor.N:].reshape(-1, block.nd)[:, :2]
    assert impulse(history) == pytest.approx(gained.sum(axis=0), rel=1e-6)
    assert gained.sum(axis=0)[0] == pytest.approx(-0.2 * gained.sum(axis=0)[1], rel=1e-3)
    assert history.state(-1).contact(on=block).total == pytest.approx(
        history.sensors["force"][-1], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("method", ["penalty", "augmented"])
def test_states_have_the_forces_of_sensors(method):
    """Of a fall flat on a floor that rises, with friction; each step is stored and is whole."""
    scene = Scene(bar(ElementBeamANCF(2), (0.0, 0.0))).gravity((0, -9.81)).obstacle(
        Line((0, -H / 2 - 1e-4)), friction=0.3, method=method, position=lambda t: (0, 0.05 * t))
    scene = scene.initial_velocity((0.3, -0.5), 0).sensor("force", "contact")
    history = scene.sensor("pressure", "contact_pressure").integrate(2e-3, 1e-4)
    for k in range(len(history) if method == "penalty" else 0):  # augmented, some are halved
        contact = history.state(k).contact()
        assert np.allclose(contact.total, history.sensors["force"][k], rtol=1e-12, atol=1e-9)
        assert contact.pressure.max(initial=0.0) == history.sensors["pressure"][k]
    weight = np.array([0.0, -9.81 * MASS])
    change = history.momentum[-1] - history.momentum[0] - weight * history.t[-1]
    assert impulse(history) == pytest.approx(change, rel=1e-6, abs=1e-6 * MASS)
    assert abs(change[0]) == pytest.approx(0.3 * change[1], rel=1e-3)


def test_the_force_of_an_impact_between_stored_instants_and_after_a_restart(tmp_path):
    scene = Scene(bar(ElementBeamANCF(2), (-L - 3e-4, 0.0))).obstacle(Line((0, 0), (-1, 0)))
    scene = scene.initial_velocity((1.0, 0), 0).sensor("force", "contact")
    whole = scene.integrate(6e-4, 5e-5)
    half = scene.integrate(3.5e-4, 5e-5)
    rest = scene.integrate(6e-4, 5e-5, start=half.state(-1))
    assert half.state(-1).contact().total == pytest.approx(rest.state(0).contact().total)
    assert impulse(half) + impulse(rest) == pytest.approx(impulse(whole), rel=1e-9, abs=1e-9)
    between = scene.integrate(6e-4, 5e-5, t_eval=np.linspace(0, 6e-4, 40))
    assert impulse(between) == pytest.approx(impulse(whole), rel=1e-9, abs=1e-9)
    scene.integrate(6e-4, 5e-5, checkpoint=tmp_path / "impact.npz")
    assert len(whole.state(7).contact()) and whole.state(7).contact().total == pytest.approx(
        whole.sensors["force"][7])


def test_the_alpha_family_has_the_force_of_its_impulse():
    scene = Scene(bar(ElementBeamANCF(2), (-L - 3e-4, 0.0))).obstacle(Line((0, 0), (-1, 0)))
    scene = scene.initial_velocity((1.0, 0), 0).sensor("force", "contact")
    history = scene.integrate(9e-4, 5e-5, scheme=GeneralizedAlpha(0.5))
    change = history.momentum[-1] - history.momentum[0]
    assert impulse(history)[0] == pytest.approx(change[0], rel=0.05)
