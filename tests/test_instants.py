"""Fields, files and reactions of the instants of a motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, StVenantKirchhoff)
from skfem_ancf.recovery.section_forces import SectionForces

pytestmark = pytest.mark.filterwarnings("ignore::skfem_ancf.ModelWarning")  # few elements
STEEL = StVenantKirchhoff(2e8, 0.3, 7800.0)


def line(element, material=STEEL, n=4, height=0.05, ends=(0, 1), **options):
    return Beam(MeshBeam.init_line(np.linspace(*ends, n + 1), height=height), element, material,
                width=0.05, **options)


def pendulum():
    """At rest first: the first instant carries no section force along the axis."""
    return Scene(line(ElementBeamANCF(3))).pin("left").gravity((0, -9.81)), (0.4, 0.01)


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

    def counted(self, *args):
        made.append(self)
        own(self, *args)

    monkeypatch.setattr(SectionForces, "__init__", counted)
    history.save(tmp_path / "u.pvd", fields="displacement", subdivide=(1, 1))
    history.strain(point, recover=False)
    assert made == []
    history.save(tmp_path / "eps.pvd", fields="eps_yy", subdivide=(1, 1))
    assert len(made) == len(history)
    first = history.states([3, 5])
    assert [s.t for s in first] == [history.t[3], history.t[5]]


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


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=repr)
def test_reactions_do_not_depend_on_the_direction_of_a_clamp(element):
    """Its equations are fixed degrees of freedom along x, and joints at an angle."""
    found = []
    for angle in (0.0, 0.7):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 5), height=0.05, angle=angle)
        scene = Scene(Beam(mesh, element, StVenantKirchhoff(2e8, 0.3, 7800), width=0.05))
        history = scene.clamp("left", thickness="free").gravity(turn @ [0.0, -9.81]).integrate(
            0.2, 0.02, scheme="energy-momentum")
        r = history.reactions("left")
        found.append(np.column_stack([r.force @ turn, r.moment]))
    assert found[0][:, 2].max() > 0.5 * 9.81 * 7800 * 0.05**2 * 0.5  # half of the static moment
    assert_allclose(found[1], found[0], atol=1e-8 * np.abs(found[0]).max())
