"""Fields of a motion: recovered for many instants at once, equal to those of one at a time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.recovery.section_forces import SectionForces

pytestmark = pytest.mark.filterwarnings("ignore::skfem_ancf.ModelWarning")  # few elements
STEEL = StVenantKirchhoff(2e8, 0.3, 7800.0)


def line(element, material=STEEL, n=4, height=0.05, ends=(0, 1), **options):
    return Beam(MeshBeam.init_line(np.linspace(*ends, n + 1), height=height), element, material,
                width=0.05, **options)


def pendulum():
    """At rest first: the first instant carries no section force along the axis."""
    return Scene(line(ElementBeamANCF(3))).pin("left").gravity((0, -9.81)), (0.4, 0.01)


def curved_under_pressure_that_ends():
    arc = MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1 - np.cos(s)]),
                              np.linspace(0, 1.5, 6), height=0.05)
    scene = Scene(Beam(arc, ElementBeamANCFCubic(2), STEEL, width=0.05)).clamp("left")
    scene.pressure("top", 1e5, amplitude=lambda t: float(t < 0.0105))
    return scene.gravity((0, -9.81)), tuple(arc.p[:, 2])


def two_beams_and_a_hinge():
    beams = [line(ElementBeamANCF(2), ends=ends, name=name)
             for name, ends in (("a", (0, 1)), ("b", (1, 2)))]
    scene = Scene(*beams).clamp("left", beam="a")
    scene.joint("hinge", beams=("a", "b"), at=(1, 0))
    return scene.gravity((0, -9.81)).point_force((0, -50.0), at=(1.3, 0), beam="b"), (1.4, 0.0)


def rubber():
    beam = line(ElementBeamANCF(2), NeoHookean(1e6, 0.3, 1000.0))
    return Scene(beam).clamp("left").traction("right", (1e5, -2e3)), (0.3, 0.02)


def fine_at_the_weld():
    beam = line(ElementBeamANCF(3), height=0.2)
    beam = beam.with_mesh(beam.mesh.graded("left"))
    return Scene(beam).clamp("left").gravity((0, -9.81)), (0.05, 0.05)


def cable():
    return Scene(line(ElementBeamCable())).clamp("left").gravity((0, -9.81)), (0.3, 0.0)


@pytest.mark.parametrize("make", [pendulum, curved_under_pressure_that_ends, two_beams_and_a_hinge,
                                  rubber, fine_at_the_weld, cable],
                         ids=lambda make: make.__name__)
def test_many_instants_as_one_at_a_time(make):
    scene, point = make()
    history = scene.integrate(t_end=0.02, dt=1e-3)
    beam = len(scene.beams) - 1
    alone = [history.state(k) for k in range(len(history))]
    assert [s.recovered for s in history] == [s.recovered for s in alone]
    assert sum(s.recovery(beam) is not None for s in alone) > 15
    for name in ("strain", "stress"):
        expected = np.array([getattr(s, name)(point) for s in alone])
        size = np.abs(expected).max(axis=1, keepdims=True)
        gap = np.abs(getattr(history, name)(point) - expected)
        assert np.all(gap <= 1e-9 * size + 1e-12 * size.max())
    places = scene.beams[beam].mesh.p[:, 1:3]
    many = history.resultants(places, beam=beam)
    ones = [s.resultants(places, beam=beam) for s in alone]
    for name in ("N", "Q", "M", "curvature", "stretch"):
        expected = np.array([getattr(r, name) for r in ones])
        assert_allclose(getattr(many, name), expected, rtol=1e-8,
                        atol=1e-10 * np.nanmax(np.abs(expected)))
    assert_allclose(history.field("von_mises", point),
                    [s.field("von_mises", point) for s in alone], rtol=1e-8)


def test_an_instant_without_a_field_keeps_none_of_the_others_from_theirs():
    """Two of the states are no equilibria, each for its own reason."""
    scene, point = fine_at_the_weld()
    history = scene.integrate(t_end=0.01, dt=1e-3)
    history.acceleration[4] *= -30.0
    history.acceleration[6] *= -20.0
    states, alone = list(history.states()), [history.state(k) for k in range(11)]
    why = [s.recovered[0] for s in states]
    assert why == [s.recovered[0] for s in alone]
    assert all("no equilibrium" in why[k] for k in (4, 6)) and why[4] != why[6]
    assert why[5] == why[7] == ""
    assert_allclose(states[4].strain(point), states[4].strain(point, recover=False))
    assert_allclose(states[5].strain(point), alone[5].strain(point), rtol=1e-10)


def test_schemes_that_conserve_energy_have_the_fields_of_those_in_equilibrium():
    """Their equation of motion holds in the mean over a step; the motion is resolved coarsely."""
    scene, _ = pendulum()
    x = np.array([np.repeat(np.linspace(0.1, 0.9, 9), 3), np.tile([-0.02, 0.0, 0.02], 9)])
    fine = scene.integrate(t_end=0.016, dt=2e-5, scheme="generalized-alpha", t_eval=[4e-3, 0.016])
    coarse = scene.integrate(t_end=0.016, dt=1e-3, scheme="energy-momentum")
    for k, state in ((4, fine.state(0)), (16, fine.state(1))):
        exact, size = state.stress(x), np.abs(state.stress(x)).max()
        gaps = [np.abs(coarse.state(k).stress(x, recover=r) - exact).max() for r in (True, False)]
        assert coarse.state(k).recovered == {0: ""}
        assert gaps[0] < 0.2 * size and gaps[0] < 0.3 * gaps[1]


def test_fields_are_recovered_when_they_are_asked_for(monkeypatch, tmp_path):
    scene, point = pendulum()
    history = scene.integrate(t_end=0.01, dt=1e-3)
    made, own = [], SectionForces.__init__

    def counted(self, beam, u, *args):
        made.append(len(u))
        own(self, beam, u, *args)

    monkeypatch.setattr(SectionForces, "__init__", counted)
    history.save(tmp_path / "u.pvd", fields="displacement", subdivide=(1, 1))
    history.strain(point, recover=False)
    assert made == []
    history.save(tmp_path / "eps.pvd", fields="eps_yy", subdivide=(1, 1))
    assert max(made) > 9
    first = history.states([3, 5])
    assert [s.t for s in first] == [history.t[3], history.t[5]]


def test_files_of_a_motion_have_two_names(tmp_path):
    history = Scene(line(ElementBeamCable(5))).pin("left").gravity((0, -9.81)).integrate(1e-3, 1e-3)
    with pytest.raises(InputError, match=r"must end with one of \.pvd, \.vtkhdf"):
        history.save(tmp_path / "run.vtu")


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=repr)
def test_reactions_change_the_momentum(element):
    scene = Scene(line(element)).clamp("left").gravity((0, -9.81))
    history = scene.integrate(0.05, 1e-3, scheme="generalized-alpha")
    found, last = history.reactions("left"), history.state(-1).reactions("left")
    assert found.force.shape == (51, 2) and found.moment.shape == (51,)
    assert_allclose(found.force[-1], last.force)
    assert_allclose(found.moment[-1], last.moment)
    assert found.coordinates["r^2"][-1] == last.coordinates["r^2"]
    force = found.force + [0.0, -9.81 * 7800 * 0.05**2]
    impulse = np.cumsum(0.5 * (force[1:] + force[:-1]) * 1e-3, axis=0)
    size = np.abs(history.momentum).max()
    assert_allclose(impulse, history.momentum[1:], atol=1e-3 * size)
