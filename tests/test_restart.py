"""A motion goes on from one of its instants."""

import numpy as np
import pytest
from noise import alike
from numpy.testing import assert_allclose

from skfem_ancf import Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.core.errors import InputError
from skfem_ancf.dynamics import SCHEMES, GeneralizedAlpha, Newmark

VARIANTS = [*(cls() for cls in SCHEMES.values() if cls.joined), GeneralizedAlpha(0.3),
            Newmark(0.36, 0.6)]


def swinging(compiled=True, ne=2, element=None, material=None):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, ne + 1), 0.1), element or ElementBeamANCF(2),
                material or StVenantKirchhoff(1e5, 0.3, 1000.0), 0.1, compiled=compiled)
    scene = Scene(beam).pin("left").gravity((0, -9.81))
    return scene.initial_velocity(lambda x: np.array([0 * x[0], 2 * x[0]]))


def driven(compiled=True):
    """Everything at once: a driven support, a driven joint, a hinge, amplitudes, a moment."""
    a = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), 0.1), ElementBeamANCF(1),
             StVenantKirchhoff(1e5, 0.3, 1000.0), 0.1, compiled=compiled, name="arm")
    b = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), 0.1, origin=(1, 0), angle=0.5),
             ElementBeamCable(3), StVenantKirchhoff(1e5, 0.3, 1000.0), 0.1, compiled=compiled,
             name="forearm")
    scene = Scene(a, b).gravity((0, -9.81))
    scene.joint("position", at=(0, 0), beam="arm", r=lambda t: (0.05 * np.sin(8 * t), 0.0))
    scene.joint("angle", at="left", beam="arm", angle=lambda t: 0.3 * np.sin(5 * t))
    scene.joint("hinge", beams=("arm", "forearm"), at=(1, 0))
    scene.point_force((0, -2.0), (0.5, 0), beam="arm", amplitude=lambda t: np.cos(20 * t))
    return scene.moment("right", 0.4, beam="forearm", amplitude=lambda t: 1.0 - t)


NAMES = ("u", "v", "acceleration", "multipliers")
#: What the sizes are divided by: rates have the round-off of positions over dt and dt^2.
ROUND_OFF = {"u": 1e-11, "v": 1e-9, "acceleration": 1e-6, "multipliers": 1e-6}


def assert_same_end(parts, whole, tolerances=ROUND_OFF):
    assert parts.t[-1] == pytest.approx(whole.t[-1], rel=1e-14)
    for name in NAMES:
        a, b = getattr(parts, name)[-1], getattr(whole, name)[-1]
        size = np.abs(getattr(whole, name)).max(initial=1.0)
        assert_allclose(a, b, rtol=0, atol=tolerances[name] * size, err_msg=name)


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("build", [swinging, driven])
@pytest.mark.parametrize("scheme", VARIANTS, ids=repr)
def test_two_halves_are_the_whole(scheme, build, compiled):
    scene = build(compiled)
    whole = scene.integrate(0.2, 2.5e-3, scheme=scheme)
    half = scene.integrate(0.1, 2.5e-3, scheme=scheme)
    rest = scene.integrate(0.2, 2.5e-3, scheme=scheme, start=half.state(-1))
    assert rest.t[0] == half.t[-1] and len(half) + len(rest) == len(whole) + 1
    assert np.array_equal(rest.u[0], half.u[-1]) and np.array_equal(rest.v[0], half.v[-1])
    assert_same_end(rest, whole)
    assert alike(half.factorizations + rest.factorizations, whole.factorizations)
    assert np.abs(whole.u[-1] - half.u[-1]).max() > 0.01


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_what_a_sensor_ends_goes_on_in_its_steps(error):
    """The step whose end it did not read is not stored."""
    def watched(end):
        def read(state):
            if state.t > end:
                raise error("of the caller's")
            return state.t
        return swinging().sensor("watch", read)

    with pytest.raises((InputError, KeyboardInterrupt)) as caught:
        watched(0.1).integrate(0.2, "auto", rtol=1e-4)
    begun = caught.value.state
    assert np.array_equal(begun.sensors["watch"], begun.t)
    rest = watched(1.0).integrate(0.2, "auto", rtol=1e-4, start=begun.state(-1))
    assert rest.t[1] - rest.t[0] > 0.1 * (begun.t[-2] - begun.t[-3])
