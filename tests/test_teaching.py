"""What users meet first: errors that say what there is, arguments that may be left out."""
import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam, RigidBody,
                        Scene, StVenantKirchhoff, SupportError)
from skfem_ancf.actions.loads import Load
from skfem_ancf.formulations import Formulation

STEEL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
MESH = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.05)


def cantilever(element=None, **options):
    beam = Beam(MESH, element or ElementBeamCable(3), STEEL, width=0.05, **options)
    return Scene(beam).clamp("left").gravity((0, -9.81))


def test_formulations_need_terms():
    class Empty(Formulation):
        """Without terms."""

        name = "empty"

        def terms(self, element, material):
            return []

    class Unsaid(Formulation):
        """Without the method."""

        name = "unsaid"

    with pytest.raises(InputError, match="must return a Term"):
        cantilever(ElementBeamANCF(2), formulation=Empty()).solve_static()
    with pytest.raises(NotImplementedError, match="Unsaid has no terms"):
        cantilever(ElementBeamANCF(2), formulation=Unsaid()).solve_static()


def test_loads_of_the_size_of_a_mesh():
    class Nodal(Load):
        """Forces on the coordinates of one mesh."""

        def force(self, u):
            return np.ones(20)

    scene = cantilever().add(Nodal())
    assert scene.solve_static().converged
    with pytest.raises(InputError, match="Meshes change, by adapt="):
        scene.solve_static(adapt=1e-3)
    with pytest.raises(InputError, match="scene.add"):
        scene.load(np.ones(20))


def test_springs_without_stiffness_are_mentioned():
    body = RigidBody(mass=1, inertia=1, position=(0, 0), name="plate")
    scene = Scene(body).fix(None, ["r^1", "d^2"], beam=body)
    scene.spring(1.0, between=((body, (0, 0)), ("ground", (1, 0))))  # across: not stiff
    with pytest.raises(SupportError, match="springs have no stiffness before the load"):
        scene.solve_static()


def test_modes_and_buckling_print_numbers():
    scene = cantilever()
    modes = scene.modes(2)
    assert f"2 frequencies, {modes.frequencies[0]:.6g}, {modes.frequencies[1]:.6g}" in repr(modes)
    buckling = Scene(scene.beams[0]).clamp("left").point_force((-1, 0), at="right").buckling(1)
    assert repr(buckling) == f"<Buckling at the load factors {buckling.factors[0]:.6g}>"
