"""Steps one at a time: the numbers of integrate, copies, pickles, inputs of all kinds."""

import pickle

import numpy as np
import pytest

from skfem_ancf import (Beam, Control, ConvergenceError, ElementBeamANCF, InputError, KelvinVoigt,
                        MeshBeam, PointForce, Scene, StVenantKirchhoff)

DT = 1e-3
UP, ALONG = PointForce((0, 1.0), at=(1, 0)), PointForce((1.0, 0), at=(0.5, 0))


def scene_of(**options):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamANCF(2),
                StVenantKirchhoff(2e8, 0.3, 1000.0), width=0.02, **options)
    scene = Scene(beam).clamp("left").gravity((0, -9.81))
    return scene.sensor("tip", "displacement", at=(1, 0)).sensor("speed", "velocity", at=(1, 0))


def inputs(n):
    t = DT * np.arange(n)
    return np.column_stack([0.5 * np.sin(20 * t), 0.1 * np.cos(11 * t)])


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau"])
def test_constant_inputs_are_those_of_integrate(scheme):
    loaded = scene_of().point_force((0, 0.5), at=(1, 0)).point_force((0.1, 0), at=(0.5, 0))
    history = loaded.integrate(40 * DT, DT, scheme)
    stepper = scene_of().stepper(DT, [UP, ALONG], scheme)
    for _ in range(40):
        stepper.step([0.5, 0.1])
    assert np.allclose(stepper.u, history.u[-1], rtol=0.0, atol=1e-13)
    assert np.isclose(stepper.t, 40 * DT)
    assert np.allclose(stepper.readings["tip"], history.displacement((1, 0))[-1], atol=1e-13)
    assert np.allclose(stepper.readings["speed"], history.velocity((1, 0))[-1], atol=1e-11)


def test_varying_inputs_copies_pickles_and_reset():
    given = inputs(60)
    amplitudes = [lambda t, k=k: given[min(int(t / DT + 1e-9), 59), k] for k in (0, 1)]
    whole = scene_of().point_force((0, 1.0), (1, 0), amplitude=amplitudes[0])
    whole.point_force((1.0, 0), (0.5, 0), amplitude=amplitudes[1])
    history = whole.integrate(60 * DT, DT)
    stepper = scene_of().stepper(DT, {"up": UP, "along": ALONG})
    assert stepper.inputs == ["up", "along"]
    for row in given[:30]:
        stepper.step(row)
    others = [stepper.copy(), pickle.loads(pickle.dumps(stepper))]
    for row in given[30:]:
        stepper.step(row)
    assert np.allclose(stepper.u, history.u[-1], rtol=0.0, atol=1e-12)
    for other in others:
        for row in given[30:]:
            other.step(row)
        assert np.array_equal(other.u, stepper.u)
    aside = stepper.copy().step([5.0, 0.0])
    assert aside.t > stepper.t and not np.array_equal(aside.u, stepper.u)
    stepper.reset()
    assert stepper.t == 0.0 and not stepper.u.any()
    for row in given:
        stepper.step(row)
    assert np.allclose(stepper.u, history.u[-1], rtol=0.0, atol=1e-12)


def test_motor_follows_its_input():
    beam = scene_of().beams[0]
    scene, reference = Scene(beam).pin("left"), Scene(beam).pin("left")
    joint = scene.motor((0, "left"), angle=lambda t: 0.0)
    stepper = scene.stepper(DT, {"angle": joint})
    for k in range(100):
        stepper.step([0.01 * (k + 1)**2 / 100])
    reference.motor((0, "left"), angle=lambda t: 1e-4 * _parts(t))
    history = reference.integrate(100 * DT, DT)
    assert np.allclose(stepper.state.position((1, 0)), history.position((1, 0))[-1], atol=1e-9)


def test_the_caller_may_use_its_array_of_inputs_again():
    """A motion starts from the last value, not from what the array holds now."""
    beam = scene_of().beams[0]

    def stepper():
        scene = Scene(beam).pin("left")
        return scene.stepper(DT, {"angle": scene.motor((0, "left"), angle=lambda t: 0.0)})

    one, other, again = stepper(), stepper(), np.zeros(1)
    for k in range(20):
        again[0] = 1e-4 * (k + 1)**2
        one.step(again)
        other.step([1e-4 * (k + 1)**2])
    assert np.array_equal(one.u, other.u)


def _parts(t):
    """Piecewise linear through the squares."""
    k = int(min(t / DT + 1e-9, 99))
    return k**2 + (t / DT - k) * (2 * k + 1)


def test_feedback_damps():
    """A force against the velocity of the tip takes energy out."""
    scene = scene_of().replace(loads=[])
    bent = scene_of().solve_static()
    stepper = scene.sensor("speed", "velocity", at=(1, 0)).stepper(
        2e-3, [UP], start=scene.state(bent.u))
    first = np.abs(stepper.readings["tip"][1])
    for _ in range(400):
        stepper.step([-0.4 * stepper.readings["speed"][1]])
    assert np.abs(stepper.readings["tip"][1]) < 0.2 * first


def test_start_from_a_motion():
    scene = scene_of(damping=KelvinVoigt(1e-4))
    history = scene.integrate(40 * DT, DT)
    stepper = scene.stepper(DT, start=scene.integrate(20 * DT, DT).state(-1))
    for _ in range(20):
        stepper.step()
    assert np.isclose(stepper.t, 40 * DT)
    assert np.allclose(stepper.u, history.u[-1], atol=1e-8)


def test_what_a_stepper_refuses():
    scene = scene_of()
    stepper = scene.stepper(DT, [UP])
    with pytest.raises(InputError, match="inputs must have the shape"):
        stepper.step([1.0, 2.0])
    with pytest.raises(InputError, match="dt"):
        scene.stepper(-1.0)
    with pytest.raises(InputError, match="an input is a Load"):
        scene.stepper(DT, ["up"])
    with pytest.raises(InputError, match="finite"):
        stepper.step([np.nan])
    before = stepper.step([1.0]).u.copy()
    with pytest.raises(ConvergenceError, match="smaller dt"):
        stepper.step([1e12])
    assert np.array_equal(stepper.u, before)
    stepper.step([1.0])
    sampled = scene_of()
    sampled.add(Control(lambda t: (0.0, 0.0), at=(1, 0), dt=0.01))
    with pytest.raises(InputError, match="leave out dt= of"):
        sampled.stepper(DT)
