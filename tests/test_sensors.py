"""Sensors: what they read is what the states of every step say."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam, MeshError,
                        NameUnknown, Scene, StVenantKirchhoff)


def swinging(element=None, **options):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.02)
    beam = Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(1e8, 0.3, 1000), 0.02,
                **options)
    scene = Scene(beam).gravity((0, -9.81))
    scene.joint("position", at=(0, 0), r=lambda t: np.array([0.0, 0.01 * np.sin(9.0 * t)]))
    return scene


def tip_energy(state):
    return np.array([state.strain_energy, state.t])


def with_all(scene):
    joint = scene.joints[0]
    return (scene.sensor("tip", "position", at=(1, 0)).sensor("u", "displacement", at=[(0.5, 0.0)])
            .sensor("v", "velocity", at=(1, 0)).sensor("a", "acceleration", at=(1, 0))
            .sensor("eps", "strain", at=(0.3, 0.005)).sensor("S", "stress", at=(0.3, 0.005))
            .sensor("fine", "strain", at=(0.3, 0.005), recover=True)
            .sensor("M", "M", at=(0.5, 0), recover=True).sensor("mises", "von_mises", at=(0.4, 0))
            .sensor("pin", "joint_force", at=joint).sensor("energy", tip_energy))


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)],
                         ids=["sections", "cable"])
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_sensors_say_what_states_of_every_step_say(element, scheme):
    scene = with_all(swinging(element))
    every = scene.integrate(0.05, 1e-3, scheme=scheme)
    few = scene.integrate(0.05, 1e-3, scheme=scheme, t_eval=[0.02, 0.05])
    assert len(few) == 2 and len(few.sensors.t) == 51
    read = few.sensors
    assert_allclose(read.t, every.t, atol=1e-15)
    assert_allclose(read["tip"], every.position((1, 0)), atol=1e-13)
    assert_allclose(read["u"], every.displacement([(0.5, 0.0)]), atol=1e-13)
    assert_allclose(read["v"], every.velocity((1, 0)), atol=1e-12)
    beam, end = scene.beams[0], np.array([[1.0], [0.5]])
    rates = [beam.displacements(a, end, np.array([3]))[:, 0, 0] for a in every.acceleration]
    assert_allclose(read["a"], rates, atol=1e-10)
    assert_allclose(read["eps"], every.strain((0.3, 0.005), recover=False), atol=1e-15)
    assert_allclose(read["S"], every.stress((0.3, 0.005), recover=False), atol=1e-7)
    assert_allclose(read["fine"], every.strain((0.3, 0.005)), atol=1e-10)
    assert_allclose(read["M"], every.resultants((0.5, 0)).M, atol=1e-8)
    assert_allclose(read["mises"], every.field("von_mises", (0.4, 0), recover=False), atol=1e-6)
    assert_allclose(read["pin"], every.joint_force(scene.joints[0]), atol=1e-8)
    assert_allclose(read["energy"], np.column_stack([every.strain_energy, every.t]), atol=1e-12)


def test_acceleration_of_a_falling_beam():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.02)
    beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(1e8, 0.3, 1000), 0.02)
    scene = Scene(beam).gravity((1.0, -9.81)).sensor("a", "acceleration", at=(0.3, 0.01))
    read = scene.integrate(0.05, 1e-2, t_eval=[0.05]).sensors
    assert_allclose(read["a"], np.tile([1.0, -9.81], (6, 1)), atol=1e-6)
    assert_allclose(read.t, np.linspace(0, 0.05, 6), atol=1e-15)


@pytest.mark.parametrize("make, error, message", [
    (lambda s: s.sensor("a", "posit", at=(1, 0)), NameUnknown, "position"),
    (lambda s: s.sensor("a", "position"), InputError, "at="),
    (lambda s: s.sensor("a", "position", at=(1, 3)), MeshError, "outside"),
    (lambda s: s.sensor("", "position", at=(1, 0)), InputError, "name"),
    (lambda s: s.sensor(None, "position", at=(1, 0)), InputError, "name"),
    (lambda s: s.sensor("a", tip_energy, at=(1, 0)), InputError, "leave out at="),
    (lambda s: s.sensor("a", "joint_force", at=(1, 0)), InputError, "joint"),
    (lambda s: s.sensor("a", "strain", at=(1, 0), recover=1), InputError, "recover"),
    (lambda s: s.sensor("a", "acceleration", at=(1, 0.01)), InputError, "axis"),
    (lambda s: s.sensor("a", lambda state: "x").integrate(0.01, 1e-3), InputError, "sensor"),
    (lambda s: s.sensor("a", "position", at=(1, 0)).integrate(0.01, 1e-3).sensors["b"],
     NameUnknown, "a")])
def test_bad_sensors(make, error, message):
    with pytest.raises(error, match=message):
        make(swinging(ElementBeamCable(3)))
