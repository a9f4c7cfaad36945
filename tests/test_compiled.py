"""The kernels compiled by Numba do what they do as plain NumPy, step by step, to round-off."""

import numpy as np
import pytest
from elbow import between, joint_examples
from noise import alike
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElasticPlastic, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, ElementBeamPatelShabana, EnergyMomentum,
                        GeneralizedAlpha, MeshBeam, Prony, Scene, StVenantKirchhoff, Voce)
from skfem_ancf.actions.joints import JOINTS
from skfem_ancf.core.code_cache import compiled_off
from skfem_ancf.equations.evaluation import force
from skfem_ancf.materials import HistoryMaterial

if compiled_off() is not None:
    pytest.skip(compiled_off(), allow_module_level=True)


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Compiled at once, where a beam allows it."""
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "1")


def ways(scene):
    """Which way statics and time steps of a scene run."""
    return [scene.system.backend.choose(name).mode for name in ("equilibrium", "steps")]

MESHES = {
    "equal": lambda: MeshBeam.init_line(np.linspace(0, 1, 5), 0.1),
    "unequal": lambda: MeshBeam.init_line([0, 0.3, 0.5, 1], 0.1, angle=0.4),
    "arc": lambda: MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                       np.linspace(0, 1.5, 5), 0.2),
    "tapered": lambda: MeshBeam.init_line([0, 0.3, 0.5, 1], lambda x: 0.2 - 0.1 * x),
}
ELEMENTS = [ElementBeamANCF(1), ElementBeamANCF(3), ElementBeamPatelShabana(),
            ElementBeamANCFCubic(2), ElementBeamCable(), ElementBeamCable(5)]


def both(mesh, element, formulation, material=None):
    material = material or StVenantKirchhoff(2.0, 0.3, 1.0)
    return [Scene(Beam(mesh, element, material, 0.3, formulation, compiled=c))
            for c in (False, True)]


CASES = [(f, "stress") for f in ("assumed", "continuum", "ecm", "strain-split")]


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
@pytest.mark.parametrize("formulation, plane", [*CASES, ("assumed", "strain")])
def test_same_force_tangent_and_carried_stress(mesh, element, formulation, plane):
    rng = np.random.default_rng(1)
    scenes = both(MESHES[mesh](), element, formulation,
                  StVenantKirchhoff(2.0, 0.3, 1.0, plane=plane))
    u, v = 0.05 * rng.standard_normal((2, scenes[0].N))
    if element.order == 0:  # r_XX would bend the cable past its own length
        for x in (u, v):
            x.reshape(-1, element.nodal_dofs, 2)[:, 2:] *= 0.1
    found = []
    for scene in scenes:
        s = scene.system
        force, assembly = s.assemble(u)
        K = s.K.tocsc().toarray()
        s.assemble(u, independent=s.linearised_stress(u, assembly, v))
        found.append((force, K, s.K.tocsc().toarray(), s.internal_force(u),
                      s.mean_internal_force(u, v)))
    assert ways(scenes[0]) == ["plain"] * 2 and "plain" not in ways(scenes[1])
    for a, b in zip(*found):
        assert_allclose(b, a, rtol=0, atol=1e-12 * np.abs(a).max())


class Damaged(HistoryMaterial):
    """Its modulus decreases with the largest stretch; a user-defined law of a point."""

    variables = {"largest": 1}  # noqa: RUF012
    constants = property(lambda self: np.array([self.E]))

    @staticmethod
    def point(constants, strain, history, dt, stress, moduli, after):
        after[0] = np.maximum(history[0], np.abs(strain[0]))
        grows = np.where(np.abs(strain[0]) > history[0], np.abs(strain[0]), 0.0)
        E = constants[0] / (1.0 + 5.0 * after[0])
        stress[0], stress[1], stress[2] = E * strain[0], constants[0] * strain[1], (
            0.5 * constants[0] * strain[2])
        moduli[0], moduli[1], moduli[2] = E - 5.0 * E * grows / (1.0 + 5.0 * after[0]), 0.0, 0.0
        moduli[3], moduli[4], moduli[5] = constants[0], 0.0, 0.5 * constants[0]

    @staticmethod
    def stored(constants, strain, history):
        E = constants[0]
        return 0.5 * E * (strain[0] * strain[0] / (1.0 + 5.0 * history[0]) + strain[1] * strain[1]
                          + 0.5 * strain[2] * strain[2])


#: Laws with a history; fibres of the user-defined one need a lateral strain and run in NumPy.
PLASTIC = dict(E=2.0, nu=0.3, yield_stress=0.02, density=1.0)
REMEMBER = {
    "perfect": ElasticPlastic(**PLASTIC),
    "kinematic": ElasticPlastic(**PLASTIC, hardening=0.05, kinematic=0.1),
    "Voce": ElasticPlastic(**PLASTIC, hardening=Voce(0.02, 20.0, 0.01), kinematic=0.1,
                           plane="strain"),
    "table": ElasticPlastic(**PLASTIC, hardening=[[0.0, 0.02], [0.01, 0.025], [0.05, 0.03]]),
    "Prony": Prony(StVenantKirchhoff(2.0, 0.3, 1.0), [0.3, 0.2], [0.5, 2.0], points=4),
    "plane strain": Prony(StVenantKirchhoff(2.0, 0.3, 1.0, plane="strain"), [0.4], [1.0]),
    "user-defined": Damaged(2.0, 0.0, 1.0),
}
IN_NUMPY = [("user-defined", 0)]


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamANCFCubic(2),
                                     ElementBeamCable(5)], ids=repr)
@pytest.mark.parametrize("law", REMEMBER)
def test_same_laws_with_a_history(law, element, mesh):
    """After two bends: forces, means, tangents, eigenstrains, and what is elastic from there."""
    rng, found = np.random.default_rng(1), []
    scenes = both(MESHES[mesh](), element, "assumed", REMEMBER[law])
    u, v, w = 0.05 * rng.standard_normal((3, scenes[0].N))
    if element.order == 0:
        for x in (u, v, w):
            x.reshape(-1, element.nodal_dofs, 2)[:, 2:] *= 0.1
    for scene in scenes:
        s = scene.clamp("left").eigenstrain(xx=0.01).system
        s = s.after(s.histories.accept(0.0 * u, u, 1.0)[0], 0.2)
        s = s.after(s.histories.accept(u, v, 1.0)[0], 0.3)
        assembly = s.assemble(w)
        K, elastic = s.K.tocsc().toarray(), np.zeros(s.N)
        s.assemble(w, independent=s.linearised_stress(w, assembly[1], u))
        backend = s.backend.after(s.backend.tables.elastic_from(v))
        backend.of(force)(w, 1.0, elastic)
        found.append((*assembly, K, s.K.tocsc().toarray(), s.internal_force(w),
                      s.mean_internal_force(v, w), elastic))
    plain = element.order == 0 and (law, 0) in IN_NUMPY
    assert ("plain" in ways(scenes[1])) == plain
    for a, b in zip(*found):
        assert_allclose(b, a, rtol=0, atol=1e-11 * np.abs(a).max())


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_a_law_that_overrides_a_method_of_a_compiled_one_runs_in_numpy(element):
    class Softer(ElasticPlastic):
        def evaluate(self, strain, history, dt):
            S, D, after = super().evaluate(strain, history, dt)
            return 0.5 * S, 0.5 * D, after

        def axial(self, strain, history, dt):
            S, D, after = super().axial(strain, history, dt)
            return 0.5 * S, 0.5 * D, after

    scenes = [Scene(Beam(MESHES["equal"](), element, law(**PLASTIC), 0.3)).clamp("left")
              for law in (Softer, ElasticPlastic)]
    assert [ways(scene) == ["plain"] * 2 for scene in scenes] == [True, False]
    u = 1e-3 * np.random.default_rng(1).standard_normal(scenes[0].N)
    half, whole = (scene.system.internal_force(u) for scene in scenes)
    assert np.abs(half - whole).max() > 0.1 * np.abs(whole).max()


@pytest.mark.parametrize("law", ["kinematic", "Prony"])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_same_runs_and_motions_of_laws_with_a_history(element, law):
    found = []
    for scene in both(MeshBeam.init_line(np.linspace(0, 1, 9), 0.1), element, "assumed",
                      REMEMBER[law]):
        scene.clamp("left").point_force((0.0, -2e-4), at="right")
        run = scene.run([1.0, 2.0], increments=4)
        motion = scene.integrate(2.0, 0.02)
        found.append((scene.solve_static().u, run.u, run.dissipated, motion.u, motion.dissipated))
    assert "plain" not in ways(scene)
    assert found[0][2][-1] > 0.0 or law == "kinematic"
    for a, b in zip(*found):
        assert_allclose(b, a, rtol=0, atol=1e-9 * np.abs(a).max())


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_same_statics(element, plane):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
    a, b = (s.clamp("left", thickness="free").gravity((0, -9.81)).solve_static()
            for s in both(mesh, element, "assumed", StVenantKirchhoff(2e8, 0.3, 7800, plane)))
    assert_allclose(b.displacement((1, 0)), a.displacement((1, 0)), rtol=0, atol=1e-11)
    assert alike(a.iterations, b.iterations) and abs(a.displacement((1, 0))[1]) > 0.8


@pytest.mark.filterwarnings("ignore::skfem_ancf.StabilityWarning")
@pytest.mark.parametrize("load, tip", [(2.0, 0.07086), (12.0, -0.63217)])
def test_same_statics_beyond_a_tangent_that_is_not_definite(load, tip):
    """A column under a multiple of its Euler load, against the elastica."""
    mesh, found = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), []
    F = load * np.pi**2 * 2e8 * 0.3 * 0.01**3 / 12 / 4
    for scene in both(mesh, ElementBeamCable(5), "assumed", StVenantKirchhoff(2e8, 0.3)):
        scene.clamp("left").point_force((-F, -1e-3 * F), at=(1, 0))
        found.append(scene.solve_static())
    a, b = found
    assert a.stability == b.stability == "stable"
    assert_allclose(b.displacement((1, 0)), a.displacement((1, 0)), rtol=0, atol=1e-9)
    assert abs(a.position((1, 0))[0] - tip) < 3e-3


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
@pytest.mark.parametrize("scheme", [EnergyMomentum(), GeneralizedAlpha(0.8)], ids=repr)
def test_same_motion_in_compiled_blocks(element, scheme):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 4), 0.02)
    numpy, compiled = (s.pin("left").gravity((0, -9.81)) for s in both(
        mesh, element, "assumed", StVenantKirchhoff(2e8, 0.3, 7800)))
    options = dict(dt=1e-3, scheme=scheme, tol=1e-13)
    slow, fast = (s.integrate(0.3007, **options) for s in (numpy, compiled))  # a shorter last step
    assert len(fast) == len(slow) == 302
    assert_allclose(fast.t, slow.t, rtol=0, atol=1e-12)
    assert_allclose(fast.u, slow.u, rtol=0, atol=1e-7 * np.abs(slow.u).max())
    some = compiled.integrate(0.3007, **options, t_eval=[0.1, 0.25])
    assert_allclose(some.u, fast.u[[100, 250]], rtol=0, atol=1e-12)
    if scheme.name == "energy-momentum":
        assert np.ptp(fast.total_energy) < 1e-11 * fast.kinetic_energy.max()


# whole iterations and time steps of scenes with joints, moving supports and loads that vary


def elbow(compiled, E=1e6):
    """Two beams that meet at a corner; a section beam and a cable."""
    return Scene(
        between((0, 0), (1, 0), 2, 1, E=E, compiled=compiled, name="arm"),
        between((1, 0), (1.4, 0.9), 3, h=0.15, E=E, width=0.07, element=ElementBeamCable(5),
                compiled=compiled, name="forearm")).gravity((0, -9.81))


JOINED = joint_examples()


def same_motion(build, scheme, t_end=0.1, dt=2.5e-3):
    """Integrate in NumPy and compiled: the same steps, and as much work."""
    slow, fast = (build(compiled).integrate(t_end, dt, scheme=scheme, tol=1e-12)
                  for compiled in (False, True))
    assert alike(slow.iterations, fast.iterations)
    assert alike(slow.factorizations, fast.factorizations)
    for name in ("t", "u", "v", "acceleration", "multipliers"):
        a, b = getattr(slow, name), getattr(fast, name)
        # rates divide the round-off of the positions by dt and dt^2
        tol = {"t": 1e-14, "u": 1e-10, "v": 1e-7}.get(name, 1e-5)
        assert_allclose(b, a, rtol=0, atol=tol * max(1.0, np.abs(a).max(initial=0.0)), err_msg=name)
    assert np.abs(slow.u[-1] - slow.u[0]).max() > 1e-3
    return fast


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
@pytest.mark.parametrize("name", JOINTS)
def test_same_motion_with_every_joint(name, scheme):
    def build(compiled):
        scene = elbow(compiled)
        scene.joint(name, **JOINED[name])
        return scene

    same_motion(build, scheme)


def test_steps_of_automatic_size_are_compiled():
    scene = elbow(True).pin("left", beam="arm")
    scene.joint("hinge", **JOINED["hinge"])
    coarse, fine = (scene.integrate(0.2, "auto", rtol=rtol, t_eval=[0.2]) for rtol in (1e-4, 1e-6))
    assert fine.iterations > coarse.iterations
    assert 0 < np.abs(coarse.u - fine.u).max() < 0.02


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_same_motion_with_moving_supports_and_varying_loads(scheme):
    """A driven end, a moment that turns with its section, an amplitude."""
    def build(compiled):
        mesh = MeshBeam.init_line(np.linspace(0, 1, 4), 0.05)
        scene = Scene(Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(1e6, 0.3, 1000.0), 0.1,
                           compiled=compiled))
        scene.joint("position", at=(0, 0), r=lambda t: (0.05 * np.sin(8 * t), 0.0))
        scene.point_force((0, -2.0), at=(0.5, 0), amplitude=lambda t: np.cos(20 * t))
        scene.moment("right", 0.4, amplitude=lambda t: 1.0 - t)
        return scene

    fast = same_motion(build, scheme)
    end = fast.position((0, 0))
    assert_allclose(end[:, 0], 0.05 * np.sin(8 * fast.t), rtol=0, atol=1e-14)
    assert_allclose(fast.velocity((0, 0))[1:, 0], 0.4 * np.cos(8 * fast.t[1:]), rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", JOINTS)
def test_same_statics_with_every_joint(name):
    """Through the border, with springs on the beam that only joints hold."""
    results = []
    for compiled in (False, True):
        scene = elbow(compiled, 1e8)
        scene.fix("left", ["r"], beam="arm")
        scene.fix("left", ["r_Y0^1"], beam="arm")
        if name != "hinge":
            scene.joint("hinge", **JOINED["hinge"])
        if name not in ("weld", "angle"):  # the forearm turns
            scene.joint("line", beam="forearm", at=(1.4, 0.9), direction=(1.0, 0.2))
        if name == "weld":
            scene.joint("angle", beam="forearm", at="left", angle=lambda t: 0.3 * t)
        else:
            slow = dict(r=lambda t: (0.4 + 0.01 * t, 0.05 * t - 0.03))
            scene.joint(name, **(JOINED[name] | (slow if name == "position" else {})))
        results.append((scene, scene.solve_static()))
    (_, a), (scene, b) = results
    assert alike(a.iterations, b.iterations) and np.abs(b.u).max() > 1e-4
    assert_allclose(b.u, a.u, rtol=0, atol=1e-10)
    assert_allclose(b.multipliers, a.multipliers, rtol=1e-8,
                    atol=1e-10 * np.abs(a.multipliers).max())
