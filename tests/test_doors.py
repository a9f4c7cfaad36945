"""Doors: states of other meshes, objects that do not change, laws and loads of one's own."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, InputError, MeshBeam,
                        NameUnknown, Scene, StVenantKirchhoff)
from skfem_ancf.core.errors import ImmutableError
from skfem_ancf.materials import Material

MATERIAL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
E, NU = 2e8, 0.3


def line(n=8, **options):
    return MeshBeam.init_line(np.linspace(0, 1, n + 1), 0.01, **options)


def cantilever(mesh=None, element=None, material=MATERIAL, **options):
    beam = Beam(line() if mesh is None else mesh, element or ElementBeamANCF(2), material, 0.01,
                **options)
    return Scene(beam).clamp("left").gravity((0, -9.81))


# states of other meshes

def others():
    """Scenes of as many coordinates as the cantilever, or not; and why their states do not fit."""
    graded = MeshBeam.init_line(np.linspace(0, 1, 9) ** 1.1, 0.01)
    arc = MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1 - np.cos(s)]), np.linspace(0, 1, 9),
                              0.01)
    two = Scene(Beam(line(), ElementBeamANCF(2), MATERIAL, 0.01),
                Beam(line(), ElementBeamANCF(2), MATERIAL, 0.01))
    return {
        "finer": (cantilever(line(16)), "16 elements, that of the scene 8"),
        "coarser": (cantilever(line(4)), "4 elements"),
        "graded": (cantilever(graded), "nodes lie elsewhere"),
        "turned": (cantilever(line(angle=0.3)), "nodes lie elsewhere"),
        "curved": (cantilever(arc), "nodes lie elsewhere"),
        "thicker": (cantilever(line().replace(height=0.02)), "its height is 0.02"),
        "order": (cantilever(element=ElementBeamANCF(3)), "its element is"),
        "points": (cantilever(element=ElementBeamANCFCubic(1)), "its element is"),
        "beams": (two, "a state of 2 beams"),
    }


@pytest.mark.parametrize("name", list(others()))
def test_a_state_of_another_mesh_is_refused(name):
    other, why = others()[name]
    scene, state = cantilever(), other.state()
    for call in (lambda: scene.solve_static(start=state), lambda: scene.modes(2, state),
                 lambda: scene.integrate(0.01, 0.01, start=state)):
        with pytest.raises(InputError, match=why):
            call()
    if state.system.N != scene.layout.N:
        for call in (lambda: scene.state(state.u), lambda: scene.initial_velocity(state.u),
                     lambda: scene.system.internal_force(state.u),
                     lambda: scene.system.assemble(state.u)):
            with pytest.raises(InputError, match="shape"):
                call()


def test_what_is_no_state_is_refused():
    scene = cantilever()
    for start in (np.zeros(scene.layout.N), "state", 3, scene):
        with pytest.raises(InputError, match=r"is a State.*scene.state\(u\)"):
            scene.solve_static(start=start)
        with pytest.raises(InputError, match="is a State"):
            scene.modes(1, start)
    with pytest.raises(InputError, match="without start"):
        scene.solve_static(start=scene.state(), adapt=1e-2)
    with pytest.raises(InputError, match="u has a value that is NaN"):
        scene.state(np.full(scene.layout.N, np.nan))
    with pytest.raises(InputError, match="multipliers must have shape"):
        scene.state(multipliers=np.zeros(3))


def test_multipliers_of_other_joints_are_refused():
    a, b = cantilever(), cantilever()
    a.joint("line", at=(1, 0), direction=(1, 1))
    b.joint("circle", at=(1, 0), center=(1, 1))
    with pytest.raises(InputError, match="multipliers of other joints"):
        a.modes(1, b.state())


# what does not change

def things():
    scene = cantilever()
    state = scene.solve_static()
    beam = scene.beams[0]
    return {"beam": (beam, "width"), "material": (beam.material, "E"),
            "mesh": (beam.mesh, "height"),
            "element": (beam.element, "section"), "formulation": (beam.formulation, "alpha"),
            "state": (state, "load"), "own": (Cubed(E, NU), "E")}


def test_arrays_do_not_change():
    x = np.linspace(0, 1, 5)
    mesh = MeshBeam.init_line(x, 0.01)
    x[2] = 99.0  # still the caller's own
    assert mesh.p[0, 2] == 0.5 and mesh.s[2] == 0.5
    scene = cantilever()
    state, beam = scene.solve_static(), scene.beams[0]
    for array in (mesh.p, mesh.t, mesh.lengths, mesh.boundaries["left"], state.u,
                  state.multipliers, beam.q0, beam.element.section_points,
                  scene.loads[0].vector):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(TypeError, match="does not support item assignment"):
        mesh.boundaries["middle"] = np.array([2])
    assert "middle" in mesh.with_boundaries({"middle": np.array([2])}).boundaries
    for things in (scene.loads, scene.joints, scene.items, scene.beams):
        assert isinstance(things, tuple)
    with pytest.raises(AttributeError):
        scene.loads = []
    with pytest.raises(ImmutableError):
        scene.loads[0].vector = np.zeros(scene.layout.N)


def test_replace_returns_a_changed_copy():
    scene = cantilever()
    beam = scene.beams[0]
    tip = scene.solve_linear().displacement((1, 0))[1]
    for changed, factor in ((beam.replace(material=beam.material.replace(E=4e8)), 2.0),
                            (beam.replace(mesh=beam.mesh.replace(height=0.02)), 4.0),
                            (beam.replace(width=0.02), 1.0)):
        other = scene.replace(beams=[changed]).solve_linear().displacement((1, 0))[1]
        assert_allclose(tip / other, factor, rtol=2e-3)
    assert beam.width == 0.01 and beam.material.E == 2e8 and beam.mesh.height == 0.01
    assert_allclose(scene.solve_linear().displacement((1, 0))[1], tip, rtol=1e-12)
    for thing, known in ((beam, "'material'"), (beam.material, "'density'"),
                         (beam.mesh, "'height'"),
                         (scene.state(), "'message'")):
        with pytest.raises(NameUnknown, match=known):
            thing.replace(lenght=3)
    with pytest.raises(InputError, match="E must be positive"):
        beam.material.replace(E=-1)


# laws that are honoured or refused

class Cubed(Material):
    """Hooke's law and the cube of the strain: a law of one's own."""

    def energy(self, strain):
        D = StVenantKirchhoff(self.E, self.nu).D
        return 0.5 * np.sum(strain * np.tensordot(D, strain, 1), axis=0) + 0.25 * self.E * np.sum(
            strain**4, axis=0)

    def stress(self, strain):
        return (np.tensordot(StVenantKirchhoff(self.E, self.nu).D, strain, 1)
                + self.E * np.asarray(strain)**3)
