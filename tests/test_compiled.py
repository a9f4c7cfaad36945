"""The texts compiled by Numba do what they do as plain NumPy, step by step, to round-off."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, EnergyMomentum, GeneralizedAlpha, MeshBeam,
                        NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.actions.joints import JOINTS, Joint
from skfem_ancf.actions.joints.base import point
from skfem_ancf.core import band
from skfem_ancf.core.band import factorize as factorize_band, solve as solve_band
from skfem_ancf.core.linalg import BandMatrix, halves
from skfem_ancf.materials import LinearLaw
from skfem_ancf.core.source import source
from skfem_ancf.core.switch import compiled_off

if compiled_off() is not None:
    pytest.skip(compiled_off(), allow_module_level=True)


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Compiled at once, where a beam allows it."""
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "1")


def ways(scene):
    """Which way statics and time steps of a scene run."""
    return [scene.system.machine.choose(name).way for name in ("equilibrium", "steps")]

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
        s.assemble(u, carried=s.carried_stress(u, assembly, v))
        found.append((force, K, s.K.tocsc().toarray(), s.internal_force(u),
                      s.mean_internal_force(u, v)))
    assert ways(scenes[0]) == ["plain"] * 2 and "plain" not in ways(scenes[1])
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


@pytest.mark.parametrize("scheme", [EnergyMomentum(), GeneralizedAlpha(0.8)], ids=repr)
def test_same_with_rubber_under_pressure(scheme):
    mesh, results = MESHES["equal"](), []
    for scene in both(mesh, ElementBeamANCF(2), "assumed", NeoHookean(1.0, 0.3, 1.0)):
        scene = scene.clamp("left").pressure("top", 1e-5)
        results.append((scene.solve_static(), scene.integrate(2.0, 0.1, scheme, tol=1e-12)))
    assert "plain" not in ways(scene)
    (a, b), (c, d) = results
    assert a.iterations == c.iterations and np.abs(a.u).max() > 1e-3
    assert_allclose(c.u, a.u, rtol=0, atol=1e-10 * np.abs(a.u).max())
    assert (b.iterations, b.factorizations) == (d.iterations, d.factorizations)
    assert_allclose(d.u, b.u, rtol=0, atol=1e-8 * np.abs(b.u).max())


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_same_statics(element, plane):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
    a, b = (s.clamp("left", thickness="free").gravity((0, -9.81)).solve_static()
            for s in both(mesh, element, "assumed", StVenantKirchhoff(2e8, 0.3, 7800, plane)))
    assert_allclose(b.displacement((1, 0)), a.displacement((1, 0)), rtol=0, atol=1e-11)
    assert a.iterations == b.iterations and abs(a.displacement((1, 0))[1]) > 0.8


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
    a = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), 0.1), ElementBeamANCF(1),
             StVenantKirchhoff(E, 0.3, 1000.0), 0.1, compiled=compiled, name="arm")
    b = Beam(MeshBeam.init_line(np.linspace(0, 1, 4), 0.15, origin=(1, 0), angle=1.1),
             ElementBeamCable(5), StVenantKirchhoff(E, 0.3, 1000.0), 0.07, compiled=compiled,
             name="forearm")
    return Scene(a, b).gravity((0, -9.81))


JOINED = {
    "hinge": dict(beams=("arm", "forearm"), at=(1, 0)),
    "weld": dict(beams=("arm", "forearm"), at=("right", "left")),
    "line": dict(beam="arm", at=(0.3, 0.02), direction=(1, 2)),
    "circle": dict(beam="forearm", at=(1.0, 0.0), center=(0.4, 0.1)),
    "position": dict(beam="arm", at=(0.4, -0.03), r=lambda t: (0.4 + np.sin(t), t * t - 0.03)),
    "angle": dict(beam="forearm", at="right", angle=lambda t: np.sin(3 * t)),
    "turn": dict(at=("arm", "left"), other=("forearm", "right"), angle=lambda t: np.sin(3 * t)),
    "plane": dict(beam="forearm", at="left"),
    "sleeve": dict(at=("ground", (1 + 0.5 * np.cos(1.1), 0.5 * np.sin(1.1))), on="forearm"),
    "slot": dict(at=("arm", (0.3, 0.02)), on="forearm", direction=(0.7, -0.02), through=(1, 0)),
}


def same_motion(build, scheme, t_end=0.1, dt=2.5e-3):
    """Integrate in NumPy and compiled: the same steps, iterations and factors."""
    slow, fast = (build(compiled).integrate(t_end, dt, scheme=scheme, tol=1e-12)
                  for compiled in (False, True))
    assert slow.iterations == fast.iterations and slow.factorizations == fast.factorizations
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
    assert fine.iterations > 2 * coarse.iterations
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


def test_energy_is_kept_under_a_moment_and_a_weld_in_compiled_steps():
    scene = elbow(True)
    scene.joint("weld", **JOINED["weld"])
    scene.moment("left", 3.0, beam="arm")
    history = scene.integrate(0.5, 2.5e-3)
    assert history.kinetic_energy.max() > 1.0
    assert np.ptp(history.total_energy) < 1e-10 * history.kinetic_energy.max()


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
@pytest.mark.parametrize("flag", [False, True])
def test_a_joint_that_is_not_quadratic_is_asked_by_the_steps(flag, scheme):
    class Distance(Joint):
        """|r - c| = R, with a root: the same motion as on the circle."""

        equations = ("force",)
        constant = False
        at, center = (1.0, 0.0), np.array([0.4, 0.1])

        def bind(self, scene):
            self.r, self.N = point(scene, "forearm", self.at), scene.N
            self.R = np.hypot(*(self.r.start - self.center))

        def value(self, u, t):
            return np.array([np.hypot(*(self.r(u) - self.center)) - self.R])

        def jacobian(self, u, t):
            d = self.r(u) - self.center
            return self.r.row(d / np.hypot(*d), self.N)[None]

        def curvature(self, u, t, multipliers):
            d, w = self.r(u) - self.center, self.r.weights
            s = np.hypot(*d)
            H = (np.eye(2) - np.outer(d, d) / s**2) / s * multipliers[0]
            values = np.einsum("ij,ik,jl->ikjl", H, w, w)
            rows = np.broadcast_to(self.r.dofs[:, :, None, None], values.shape)
            columns = np.broadcast_to(self.r.dofs[None, None], values.shape)
            return rows.ravel(), columns.ravel(), values.ravel()

    rooted, squared = elbow(flag), elbow(flag)
    rooted.joint(Distance())
    squared.joint("circle", **JOINED["circle"])
    assert rooted.system.machine.tables.plain.joints.own
    assert not squared.system.machine.tables.plain.joints.own
    a, b = (s.integrate(0.05, 2.5e-3, scheme=scheme, tol=1e-12) for s in (rooted, squared))
    assert_allclose(a.u, b.u, rtol=0, atol=1e-9 if scheme == "generalized-alpha" else 1e-4)


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
            scene.joint("line", beam="forearm", at=(1 + np.cos(1.1), np.sin(1.1)),
                        direction=(1.0, 0.2))
        if name == "weld":
            scene.joint("angle", beam="forearm", at="left", angle=lambda t: 0.3 * t)
        else:
            slow = dict(r=lambda t: (0.4 + 0.01 * t, 0.05 * t - 0.03))
            scene.joint(name, **(JOINED[name] | (slow if name == "position" else {})))
        results.append((scene, scene.solve_static()))
    (_, a), (scene, b) = results
    assert a.iterations == b.iterations and np.abs(b.u).max() > 1e-4
    assert_allclose(b.u, a.u, rtol=0, atol=1e-10)
    assert_allclose(b.multipliers, a.multipliers, rtol=1e-8,
                    atol=1e-10 * np.abs(a.multipliers).max())


def test_same_statics_under_a_moment_of_the_section():
    """A quarter of a turn, from one load step."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
    EI = 2e8 * 0.3 * 0.01**3 / 12
    a, b = (s.clamp("left", thickness="free").moment("right", 0.5 * np.pi * EI).solve_static()
            for s in both(mesh, ElementBeamCable(5), "assumed", StVenantKirchhoff(2e8, 0.3, 7800)))
    assert a.iterations == b.iterations
    assert_allclose(b.u, a.u, rtol=0, atol=1e-10)
    assert abs(b.displacement((1, 0))[0] + 1 - 2 / np.pi) < 1e-4


def test_same_statics_with_prescribed_displacements_and_several_beams():
    results = []
    for compiled in (False, True):
        scene = elbow(compiled).clamp("left", beam="arm")
        scene.fix("left", ["r", "r_X"], beam="forearm")
        scene.fix("right", ["r^1"], beam="arm")
        scene.fix("right", ["r^2"], displacement=0.1, beam="arm")
        results.append(scene.solve_static())
    a, b = results
    assert a.iterations == b.iterations
    assert_allclose(b.u, a.u, rtol=0, atol=1e-10)
    assert_allclose(b.displacement((1, 0), beam="arm")[1], 0.1, rtol=0, atol=1e-14)


def test_an_amplitude_counts_as_one_in_compiled_statics():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
    tips = []
    for amplitude in (None, lambda t: 0.0):
        s = both(mesh, ElementBeamCable(5), "assumed", StVenantKirchhoff(2e8, 0.3, 7800))[1]
        s.clamp("left").point_force((0, -0.1), at=(1, 0), amplitude=amplitude)
        s.moment("right", 0.1, amplitude=amplitude).gravity((0, -1.0))
        tips.append(s.solve_static().displacement((1, 0)))
    assert_allclose(tips[1], tips[0], rtol=0, atol=1e-12)


def test_restart_under_another_load_is_compiled():
    """From a state that another load holds: what is missing there is taken away by steps."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
    results = []
    for s in both(mesh, ElementBeamANCF(2), "assumed", StVenantKirchhoff(2e8, 0.3, 7800)):
        s.clamp("left", thickness="free").gravity((0, -9.81))
        start = s.solve_static()
        other = Scene(s.beams[0]).clamp("left", thickness="free").gravity((0, -4.0))
        results.append(other.solve_static(start=start))
    assert_allclose(results[1].u, results[0].u, rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def bands():
    """What factorises and solves, plain and compiled."""
    from skfem_ancf.core.jit import entry
    A = BandMatrix(2, 1).band
    return ((band.factorize, band.solve),
            (entry(factors_of, (A,)), entry(solution_of, (A, np.zeros(2)))))


@pytest.mark.parametrize("n, width", [(1, 0), (3, 0), (2, 1), (3, 2), (4, 1), (5, 3), (6, 5),
                                      (7, 2), (12, 3), (13, 4), (23, 19), (40, 11)])
@pytest.mark.parametrize("definite", [True, False])
def test_factors_and_solutions(bands, n, width, definite):
    """L D L^T without pivots, of indefinite matrices too."""
    rng = np.random.default_rng(n)
    dense = np.triu(np.tril(rng.standard_normal((n, n)), width), -width)
    dense = dense + dense.T + (4 * width + 8 if definite else 0) * np.eye(n)
    i, j = np.nonzero(np.tril(dense))
    b = rng.standard_normal(n)
    for factorize, solve in bands:
        K, x = BandMatrix(n, width), b.copy()
        K.add(i, j, dense[i, j])
        assert factorize(K.band)
        assert np.all(K.ab[0] > 0.0) == np.all(np.linalg.eigvalsh(dense) > 0.0)
        L = np.eye(n)
        for k in range(1, width + 1):
            L[np.arange(k, n), np.arange(n - k)] = K.ab[k, :n - k]
        size = np.max(np.abs(L)) ** 2 * np.max(np.abs(K.ab[0]))
        assert_allclose(L @ np.diag(K.ab[0]) @ L.T, dense, rtol=0, atol=1e-14 * n * size)
        assert not K.band.flat.reshape(n, -1)[:, width + 1:].any()
        solve(K.band, x)
        assert_allclose(L @ (K.ab[0] * (L.T @ x)), b, rtol=0, atol=1e-14 * n * size * (
            np.max(np.abs(x)) + 1.0))


@pytest.mark.parametrize("n, width", [(1, 0), (3, 0), (2, 1), (3, 2), (5, 3), (6, 5), (7, 2),
                                      (12, 3), (13, 4), (23, 19), (40, 11)])
def test_factors_and_solutions_of_two_halves(bands, n, width):
    """L D R^T without pivots, of a matrix that is not symmetric."""
    rng = np.random.default_rng(n)
    dense = np.triu(np.tril(rng.standard_normal((n, n)), width), -width)
    dense += (4 * width + 8) * np.eye(n)
    b = rng.standard_normal(n)
    for factorize, solve in bands:
        A, x = halves(n, width), b.copy()
        columns = A.flat.reshape(n, 2, -1)
        for k in range(width + 1):
            columns[:n - k, 0, k], columns[:n - k, 1, k] = np.diag(dense, -k), np.diag(dense, k)
        assert factorize(A)
        L, R = np.eye(n), np.eye(n)
        for k in range(1, width + 1):
            at = np.arange(k, n), np.arange(n - k)
            L[at], R[at] = columns[:n - k, 0, k], columns[:n - k, 1, k]
        assert_allclose(L @ np.diag(columns[:, 0, 0]) @ R.T, dense, rtol=0, atol=1e-12)
        solve(A, x)
        assert_allclose(dense @ x, b, rtol=0, atol=1e-13)
        A.flat[:] = 0.0
        assert not factorize(A)


@pytest.mark.parametrize("n", [2, 5, 7])
def test_lost_pivots_are_no_factors(bands, n):
    """Zero, round-off of what they came from, or no numbers: of each row."""
    for (factorize, _), at, lost in itertools.product(
            bands, range(n), [0.0, 1.0, np.nan]):
        K = BandMatrix(n, 1)
        K.add(np.arange(n), np.arange(n), np.where(np.arange(n) == at, lost, 1.0))
        if lost == 1.0:
            K.add([max(at, 1)], [max(at, 1) - 1], [1.0 + 1e-15])
        assert not factorize(K.band)


@source
def factors_of(A):
    return factorize_band(A)


@source
def solution_of(A, x):
    solve_band(A, x)


@pytest.mark.parametrize("mesh", ["equal", "unequal"])
def test_translations_meet_no_round_off_of_the_tangent(mesh):
    """Of an element: what it does on one node's position it undoes on the other's, to the bit."""
    x = {"equal": [0.0, 1 / 3], "unequal": [0.1, 0.4]}[mesh]
    beam = Beam(MeshBeam.init_line(x, 1e-5, angle=0.3), ElementBeamANCF(2),
                StVenantKirchhoff(2.0, 0.3, 1.0), 0.3)
    s = Scene(beam).system
    u = np.random.default_rng(2).standard_normal(s.N)
    s.assemble(u)
    K, right = s.K.tocsc().toarray(), beam.nd
    inside = [k for k in range(s.N) if k not in (0, 1, right, right + 1)]
    for i in range(2):
        assert np.array_equal(K[inside, i], -K[inside, right + i])
        assert K[i, i] == K[right + i, right + i] == -K[right + i, i]


@pytest.mark.parametrize("slenderness, n", [(1e5, 80), (1e5, 100), (1e4, 460), (1e4, 1000)])
def test_fine_and_slender_beams_find_their_equilibrium(slenderness, n):
    """Axial stiffness is up to 1e11 times the bending stiffness: its round-off must cancel.

    As far as it can: eps 12 (L/h n)^2 is 0.3 at most here. At 1, by summing and factorising alone,
    the tangent loses its bending stiffness, and the number of iterations is a matter of luck.
    """
    h = 1.0 / slenderness
    E, rho = 2e8 * (0.01 / h) ** 3, 7800 * 0.01 / h
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), h), ElementBeamANCF(2),
                StVenantKirchhoff(E, 0.3, rho), 0.01)
    state = Scene(beam).clamp("left", thickness="free").gravity((0, -9.81)).solve_static()
    assert state.iterations <= 10
    assert_allclose(state.displacement((1, 0)), (-0.74099, -0.90313), rtol=0, atol=3e-4)
