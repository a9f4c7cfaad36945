"""Motions that end where a function of the state changes its sign."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, CallbackError, ElementBeamANCF, ElementBeamCable, InputError,
                        KelvinVoigt, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.dynamics import SCHEMES


def falling(**options):
    """A beam that falls flat from rest."""
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(5),
                StVenantKirchhoff(2e8, 0.3, 7800), width=0.01, **options)
    return Scene(beam).gravity((0, -9.81))


@pytest.mark.parametrize(("scheme", "dt"), [
    (name, dt) for name, cls in SCHEMES.items() for dt in (0.013, "auto")
    if cls.adaptive or dt != "auto"])
def test_time_of_a_fall(scheme, dt):
    history = falling().integrate(1.0, dt, scheme=scheme,
                                  until=lambda state: state.position((0.5, 0))[1] + 0.3)
    # in equal steps all but the first-order start of a scheme is exact for a parabola
    assert_allclose(history.event, np.sqrt(0.6 / 9.81), rtol=1e-8 if dt != "auto" else 1e-4)
    assert history.event == history.t[-1] and np.all(np.diff(history.t) > 0)
    assert_allclose(history.position((0.5, 0))[-1, 1], -0.3, rtol=1e-8)


def test_no_event_and_one_at_the_start_that_is_left():
    def until(state):
        return state.position((0.5, 0))[1]

    history = falling().integrate(0.1, 0.01, until=lambda state: until(state) + 1.0)
    assert history.event is None and history.t[-1] == pytest.approx(0.1)
    assert falling().integrate(0.1, 0.01).event is None
    assert falling().integrate(0.1, 0.01, until=until).event is None  # zero at the start


def pendulum():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamANCF(2),
                StVenantKirchhoff(2e8, 0.3, 7800), width=0.01, damping=KelvinVoigt(1e-3))
    return Scene(beam).pin("left").gravity((0, -9.81))


def test_stored_times_breakpoints_energy_and_going_on():
    def until(state):
        return state.position((1, 0))[0] - 0.3

    scene = pendulum()
    whole = scene.integrate(1.0, 2e-3, until=until, breakpoints=[0.1])
    assert np.ptp(whole.total_energy + whole.dissipated) < 1e-11
    some = scene.integrate(1.0, 2e-3, until=until, breakpoints=[0.1], t_eval=[0.05, 0.2, 0.9])
    assert_allclose(some.t, [0.05, 0.2, whole.event], rtol=1e-12)
    assert_allclose(some.u[-1], whole.u[-1], rtol=0, atol=1e-12)
    on = scene.integrate(whole.event + 0.1, 2e-3, start=whole.state(-1))
    straight = scene.integrate(whole.event + 0.1, 2e-3, breakpoints=[0.1])
    assert_allclose(on.displacement((1, 0))[-1], straight.displacement((1, 0))[-1], atol=2e-5)
    assert on.dissipated[0] == whole.dissipated[-1]


def test_what_is_no_event(tmp_path):
    with pytest.raises(InputError, match="checkpoint"):
        falling().integrate(0.1, 0.01, until=lambda state: 1.0, checkpoint=tmp_path / "run.npz")
    with pytest.raises(InputError, match="until"):
        falling().integrate(0.1, 0.01, until=0.05)
    with pytest.raises(CallbackError, match="until") as caught:
        falling().integrate(0.1, 0.01, until=lambda state: "text")
    assert len(caught.value.state) == 1


def test_what_a_breakpoint_changes_at_once_is_an_event_there():
    """An acceleration jumps at a breakpoint, to another sign or within its sign."""
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(5),
                StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    for after, event in ((-3.0, 0.005), (3.0, None)):
        scene = Scene(beam).gravity((0, -1.0), amplitude=lambda t, after=after: np.where(
            np.asarray(t) < 0.005, 1.0, after))
        for scheme in ("energy-momentum", "hht"):
            history = scene.integrate(0.01, 1e-3, scheme=scheme, breakpoints=[0.005],
                                      until=lambda state: state.acceleration[1])
            assert history.event == event
            assert history.t[-1] == pytest.approx(event or 0.01)
