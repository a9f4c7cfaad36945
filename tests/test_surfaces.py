"""Forces on surfaces, against scikit-fem's assembly of their forms."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, ModelWarning, Scene,
                        Section, StVenantKirchhoff)
from skfem_ancf.actions.loads import Traction

LAW = StVenantKirchhoff(2e9, 0.3, 7800.0)


def bend(x):
    return np.array([50.0 * x[1], 0.0 * x[1]])


@pytest.mark.parametrize("place, t, moment", [("top", (3.0, 0.0), 3.0 * 0.02 * 0.05),
                                              ("right", bend, 50.0 * 0.02 * 0.1**3 / 12)])
def test_a_moment_that_a_cable_does_not_take_from_a_traction_is_said(place, t, moment):
    """Its axis was not bent at all; sections bend by that moment."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.1)
    scene = Scene(Beam(mesh, ElementBeamCable(5), LAW, 0.02)).clamp("left")
    with pytest.warns(ModelWarning, match=f"leaves out a moment of {moment:.3g} "):
        scene.traction(place, t)
    state = scene.solve_static()
    assert state.reactions("left").moment == pytest.approx(0.0, abs=1e-9 * moment)
    scene = Scene(Beam(mesh, ElementBeamANCF(2), LAW, 0.02)).clamp("left").traction(place, t)
    assert abs(scene.solve_static().reactions("left").moment) == pytest.approx(moment, rel=1e-5)


@pytest.mark.parametrize("section", [dict(width=0.02), dict(section=Section.profile(
    "I", width=0.06, web=0.01, flange=0.015))], ids=["plain", "I"])
@pytest.mark.parametrize("place, t", [("top", (0.0, -1.0)), ("right", (5.0, 1.0)),
                                      (("left", "right"), (5.0, 0.0))])
def test_tractions_that_a_cable_takes_whole(place, t, section):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.1)
    Traction(place, t).bind(Beam(mesh, ElementBeamCable(5), LAW, **section))
