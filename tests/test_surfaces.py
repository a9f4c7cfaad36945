"""Forces on surfaces, against scikit-fem's assembly of their forms."""

import numpy as np
import pytest
from skfem.assembly import asm

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        ModelWarning, Scene, Section, StVenantKirchhoff)
from skfem_ancf import forms
from skfem_ancf.actions.loads import Pressure, Traction
from skfem_ancf.beam.surfaces import surfaces_of

LAW = StVenantKirchhoff(2e9, 0.3, 7800.0)
X = np.array([0.0, 0.7, 1.1, 2.0])
BODIES = {
    "straight": lambda: MeshBeam.init_line(X, 0.2, origin=(1.0, -2.0), angle=0.4),
    "tapered": lambda: MeshBeam.init_line(X, lambda s: 0.2 + 0.05 * s),
    "arc": lambda: MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1.0 - np.cos(s)]), X, 0.2),
}
PLACES = ["left", "right", "bottom", "top", np.array([1, 2]), ("right", "bottom")]


@pytest.mark.filterwarnings("ignore:a traction on .* acts on its axis")
@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(3),
                                     ElementBeamANCFCubic(2), ElementBeamCable(5)])
@pytest.mark.parametrize("body", BODIES)
def test_forces_on_surfaces_are_those_of_the_forms(body, element):
    beam = Beam(BODIES[body](), element, LAW, 0.3)
    rng = np.random.default_rng(0)
    q = beam.q0 + 1e-2 * rng.standard_normal(beam.N)

    def field(x):
        return np.array([x[0] * x[1], 1.0 + x[1]**2])

    for place in PLACES:
        basis = beam.facet_basis(place)
        for t, of in (((2.0, -3.0), basis), (field, beam.facet_basis(place, intorder=12))):
            found = Traction(place, t).bind(beam).force(0.0 * q)
            expected = asm(forms.traction(t, 0.3), of)
            assert np.allclose(found, expected, rtol=1e-12, atol=1e-13 * np.max(np.abs(expected)))
        if not beam.has_sections and not isinstance(place, str):
            continue
        if not beam.has_sections and place in ("left", "right"):
            continue
        load = Pressure(place, 2.0).bind(beam)
        expected = 2.0 * (asm(forms.pressure(0.3), basis) @ q)
        assert np.allclose(load.force(q - beam.q0), expected, rtol=1e-11,
                           atol=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("body", BODIES)
def test_points_of_surfaces_have_areas_and_normals(body):
    beam = Beam(BODIES[body](), ElementBeamANCF(2), LAW, 0.3)
    for place in PLACES:
        basis, found = beam.facet_basis(place), surfaces_of(beam, place, beam.element.facet_points)
        total = sum(one.areas.sum() for one in found)
        assert total == pytest.approx(0.3 * basis.dx.sum(), rel=1e-13)
        both = sum(np.einsum("ifp,fp->i", one.normals, one.areas) for one in found)
        if not isinstance(place, np.ndarray):
            assert np.allclose(both, 0.3 * np.einsum("ifp,fp->i", np.asarray(basis.normals),
                                                     basis.dx), rtol=0, atol=1e-13)


def test_sections_of_layers_have_the_areas_of_all():
    stiff = StVenantKirchhoff(4e9, 0.3, 7800.0)
    section = Section.layers((0.05, LAW), (0.15, stiff, 0.1), width=0.2)
    beam = Beam(MeshBeam.init_line(X, 0.2), ElementBeamANCF(2), section=section)
    for place, area in (("left", 0.05 * 0.2 + 0.15 * 0.1), ("bottom", 0.4), ("top", 0.2)):
        found = surfaces_of(beam, place, 4)
        assert sum(one.areas.sum() for one in found) == pytest.approx(area, rel=1e-12)
        force = Traction(place, (3.0, 0.0)).bind(beam).force(np.zeros(beam.N))
        assert force.reshape(-1, beam.nd)[:, 0].sum() == pytest.approx(3.0 * area, rel=1e-12)


def test_a_closed_surface_under_pressure_has_no_resultant():
    beam = Beam(BODIES["arc"](), ElementBeamANCF(2), LAW, 0.2)
    load = Pressure(("left", "right", "bottom", "top"), 5.0).bind(beam)
    q = beam.q0 + 1e-2 * np.random.default_rng(1).standard_normal(beam.N)
    nodal = load.force(q - beam.q0).reshape(-1, beam.nd // 2, 2)
    assert np.allclose(nodal[:, 0].sum(axis=0), 0.0, atol=1e-12 * np.max(np.abs(nodal)))


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
