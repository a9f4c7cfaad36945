"""The kernels compiled by Numba give what NumPy gives, to round-off."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, EnergyMomentum, GeneralizedAlpha, MeshBeam,
                        NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.linalg import BandMatrix
from skfem_ancf.materials import LinearLaw

pytest.importorskip("numba")

MESHES = {
    "equal": lambda: MeshBeam.init_line(np.linspace(0, 1, 5), 0.1),
    "unequal": lambda: MeshBeam.init_line([0, 0.3, 0.5, 1], 0.1, angle=0.4),
    "arc": lambda: MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                       np.linspace(0, 1.5, 5), 0.2),
}
ELEMENTS = [ElementBeamANCF(1), ElementBeamANCF(3), ElementBeamPatelShabana(),
            ElementBeamANCFCubic(2), ElementBeamCable(), ElementBeamCable(5)]


def both(mesh, element, formulation, material=None):
    material = material or StVenantKirchhoff(2.0, 0.3, 1.0)
    return [Scene(Beam(mesh, element, material, 0.3, formulation, compiled=c))
            for c in (False, True)]


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
@pytest.mark.parametrize("formulation", ["assumed", "continuum", "ecm", "strain-split"])
def test_same_force_tangent_and_carried_stress(mesh, element, formulation):
    rng = np.random.default_rng(1)
    scenes = both(MESHES[mesh](), element, formulation)
    u, v = 0.05 * rng.standard_normal((2, scenes[0].N))
    if element.order == 0:  # r_XX would bend the cable past its own length
        for x in (u, v):
            x.reshape(-1, element.nodal_dofs, 2)[:, 2:] *= 0.1
    found = []
    for scene in scenes:
        s = scene.system
        force, assembly = s.assemble(u)
        K = s.K.tocsc().toarray()
        s.assemble(u, carried=s.stress_step(assembly, v))
        found.append((force, K, s.K.tocsc().toarray(), s.internal_force(u),
                      s.mean_internal_force(u, v, s.strains(u))))
    assert scenes[1].beams[0].kernel.compiled is not None
    for a, b in zip(*found):
        assert_allclose(b, a, rtol=0, atol=1e-12 * np.abs(a).max())


@pytest.mark.parametrize("n", [1, 2, 31, 32, 33, 70])
@pytest.mark.parametrize("grading", [1.0, 1.5])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCFCubic(2)], ids=repr)
@pytest.mark.parametrize("formulation", ["assumed", "continuum"])
@pytest.mark.parametrize("geometric", [True, False])
def test_same_in_blocks(n, grading, element, formulation, geometric):
    rng = np.random.default_rng(n)
    mesh = MeshBeam.init_line(n * np.linspace(0, 1, n + 1)**grading, 0.5, angle=0.3)
    kernels = [scene.beams[0].kernel for scene in both(mesh, element, formulation)]
    assert kernels[0].shared == (n == 1 or grading == 1.0)
    N, start = kernels[0].N, 3
    u, v = 0.05 * rng.standard_normal((2, N))
    found = []
    for kernel in kernels:
        out = [kernel.force(u), kernel.mean_force(u, v, kernel.strains(u))]
        carried = None
        for _ in range(2):
            K, force = BandMatrix(start + N, 2 * kernel.nd - 1), np.ones(N)
            assembly = kernel.assemble(u, K, start, force, carried, geometric)
            out += [K.ab.copy(), force]
            carried = assembly.carry(v)
        found.append(out)
    for a, b in zip(*found):
        assert_allclose(b, a, rtol=0, atol=1e-12 * np.abs(a).max())


def test_same_with_moduli_that_couple_all_components():
    class Skew(StVenantKirchhoff):
        def law(self, shear_factor=1.0):
            A = np.array([[2.0, 0.5, 0.4], [0.5, 1.0, -0.3], [0.4, -0.3, 0.7]])
            return LinearLaw(A)

    mesh = MeshBeam.init_line(np.linspace(0, 2, 4), 0.3)
    for formulation in ("assumed", "continuum"):
        systems = [s.system for s in both(mesh, ElementBeamANCF(3), formulation,
                                          Skew(2.0, 0.3, 1.0))]
        u = 0.05 * np.random.default_rng(2).standard_normal(systems[0].N)
        found = []
        for s in systems:
            force, _ = s.assemble(u)
            found.append((force, s.K.tocsc().toarray()))
        for a, b in zip(*found):
            assert_allclose(b, a, rtol=0, atol=1e-12 * np.abs(a).max())


def test_other_laws_and_followers_fall_back():
    mesh = MESHES["equal"]()
    assert Scene(Beam(mesh, ElementBeamANCF(2), NeoHookean(1.0, 0.3), 0.1)
                 ).beams[0].kernel.compiled is None
    pressed = [scene.clamp("left").pressure("top", 1e-6).solve_static()
               for scene in both(mesh, ElementBeamANCF(2), "assumed")]
    assert pressed[1].beams[0].kernel.compiled is not None
    assert_allclose(pressed[1].u, pressed[0].u, rtol=0, atol=1e-10 * np.abs(pressed[0].u).max())


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_same_statics(element):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
    a, b = (s.clamp("left", thickness="free").gravity((0, -9.81)).solve_static()
            for s in both(mesh, element, "assumed", StVenantKirchhoff(2e8, 0.3, 7800)))
    assert_allclose(b.displacement((1, 0)), a.displacement((1, 0)), rtol=0, atol=1e-11)
    assert a.iterations == b.iterations and abs(a.displacement((1, 0))[1]) > 0.8


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
@pytest.mark.parametrize("scheme", [EnergyMomentum(), GeneralizedAlpha(0.8)], ids=repr)
def test_same_motion_in_compiled_blocks(element, scheme, monkeypatch):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 4), 0.02)
    numpy, compiled = (s.pin("left").gravity((0, -9.81)) for s in both(
        mesh, element, "assumed", StVenantKirchhoff(2e8, 0.3, 7800)))
    from skfem_ancf.dynamics.integrate import Integrator
    options = dict(dt=1e-3, scheme=scheme, tol=1e-13)
    slow = numpy.integrate(0.3007, **options)  # the last step is shorter
    calls = []
    advance = Integrator.advance
    monkeypatch.setattr(Integrator, "advance",
                        lambda self, y, dt: calls.append(dt) or advance(self, y, dt))
    fast = compiled.integrate(0.3007, **options)
    assert len(calls) == 1 and len(fast) == len(slow) == 302  # only the shorter step in Python
    assert_allclose(fast.t, slow.t, rtol=0, atol=1e-12)
    assert_allclose(fast.u, slow.u, rtol=0, atol=1e-7 * np.abs(slow.u).max())
    some = compiled.integrate(0.3007, **options, t_eval=[0.1, 0.25])
    assert_allclose(some.u, fast.u[[100, 250]], rtol=0, atol=1e-12)
    if scheme.name == "energy-momentum":
        assert np.ptp(fast.total_energy) < 1e-11 * fast.kinetic_energy.max()
