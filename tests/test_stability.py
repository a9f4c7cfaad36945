"""Inertia of the tangent, the verdict of a state, and stable equilibria."""

import warnings

import numpy as np
import pytest
import scipy.linalg
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from skfem import asm

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, MeshBeam, ModelWarning, NeoHookean, Scene,
                        StabilityWarning, StVenantKirchhoff, forms)
from skfem_ancf.core.band import dense
from skfem_ancf.equations.stability import Verdict
from skfem_ancf.results.state import State

ELEMENTS = (ElementBeamANCF(2), ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCFCubic(2))
SUPPORTS = ("clamped", "pinned", "weld", "hinge", "slider")


def line(n=4, h=0.01, element=ELEMENTS[0], origin=(0, 0), angle=0.0, name=None):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), h, origin=origin, angle=angle)
    return Beam(mesh, element, StVenantKirchhoff(2e8, 0.3, 7800), width=h, name=name)


def scene_of(kind, n, h, element):
    a = line(n, h, element, name="a")
    if kind == "clamped":
        return Scene(a).clamp("left")
    if kind == "pinned":
        return Scene(a).pin("left").pin("right")
    b = line(n, h, element, (1, 0), 1.0, "b")
    scene = Scene(a, b).clamp("left", beam="a")
    if kind == "weld":
        scene.joint("weld", beams=("a", "b"), at=("right", "left"))
        return scene
    scene.joint("hinge", beams=("a", "b"), at=(1, 0))
    if kind == "hinge":
        return scene.pin("right", beam="b")
    scene.joint("circle", at=(1, 0), center=(0.4, 0.3), beam="a")
    scene.joint("line", at=(1 + np.cos(1), np.sin(1)), direction=(1, 1), beam="b")
    return scene


def dense_eigenvalues(system, u, multipliers=None):
    """Of the tangent at free coordinates and J x = 0, scaled to a unit diagonal."""
    multipliers = np.zeros(system.constraints.m) if multipliers is None else multipliers
    system.assemble(u)
    K = (system.K.tocsc() + system.constraints.curvature(u, 0.0, multipliers)).toarray()
    free = np.nonzero(system.constraints.free)[0]
    A, J = K[np.ix_(free, free)], dense(system.constraints.full_jacobian(u, 0.0))[:, free]
    if len(J):
        Z = scipy.linalg.null_space(J / np.linalg.norm(J, axis=1)[:, None])
        A = Z.T @ A @ Z
    size = np.sqrt(np.abs(np.diag(A)))
    return np.linalg.eigvalsh(0.5 * (A + A.T) / (size[:, None] * size))


def portal(h, load, n=4):
    """Two clamped columns and a girder, all of length and bending stiffness 1, pushed down."""
    legs = {"a": (0, 0, np.pi / 2), "b": (0, 1, 0.0), "c": (1, 0, np.pi / 2)}
    steel, x = StVenantKirchhoff(12 / h**3, 0.0), np.linspace(0, 1, n + 1)
    beams = [Beam(MeshBeam.init_line(x, h, origin=(x0, y0), angle=angle), ElementBeamCable(5),
                  steel, width=1, name=name) for name, (x0, y0, angle) in legs.items()]
    scene = Scene(*beams)
    scene.weld((0, 1))
    scene.weld((1, 1))
    for name, x0 in (("a", 0), ("c", 1)):
        scene.clamp("left", name, thickness="free").point_force((0, -load), (x0, 1), name)
    return scene


#: Sideways: x cot x = -6, the load x^2 on each column.
SWAY = brentq(lambda x: x / np.tan(x) + 6, 1.6, 3.1) ** 2


@pytest.mark.parametrize("h, tol", [(1e-2, 2e-5), (1e-3, 1e-6), (1e-4, 2e-5), (1e-5, 2e-3)])
def test_slender_beams_that_only_joints_hold_give_way_at_their_load(h, tol):
    path = portal(h, 1.0).continuation(ds=h**2, max_load=1.05 * SWAY)
    assert path.bifurcation_points() == pytest.approx([SWAY], rel=tol)
    assert portal(h, 0.99 * SWAY).solve_static().stability == "stable"
    straight = portal(h, 1.01 * SWAY).solve_static(stable=False)
    assert (straight.stability, straight.negative_pivots) == ("unstable", 1)


# verdicts


def state_of(scene, u, load=1.0):
    return State(scene.system, u, load)


@pytest.mark.parametrize("kind", SUPPORTS)
def test_verdict_of_a_state(kind):
    scene = scene_of(kind, 4, 0.02, ELEMENTS[0])
    zero = state_of(scene, np.zeros(scene.layout.N))
    assert (zero.stability, zero.negative_pivots) == ("stable", 0)
    assert "stable" in str(zero) and "det F from 1, stretch from 1 to 1" in str(zero)
    u = 0.01 * np.random.default_rng(1).standard_normal(scene.layout.N)
    negative = int(np.sum(dense_eigenvalues(scene.system, u) < 0))
    state = state_of(scene, u)
    assert (state.stability, state.negative_pivots) == ("unstable", negative)
    assert f"unstable ({negative} negative pivots)" in str(state)


def test_verdict_of_singular_and_linear_states_and_of_motions():
    loose = Scene(line(6)).pin("left").gravity((0, -9.81))
    assert state_of(loose, np.zeros(loose.N)).stability == "singular"
    motion = loose.integrate(t_end=0.002, dt=1e-3).state(1)
    assert motion.stability is None and motion.negative_pivots is None
    assert "equilibrium" not in str(motion)
    linear = Scene(line(6)).clamp("left").gravity((0, -9.81)).solve_linear()
    assert linear.stability is None and linear.negative_pivots is None
    assert "linear" in str(linear) and "stable:" not in str(linear)


def test_verdict_on_loads_without_a_potential():
    """Pressure on an end: divergence at Euler's load where it is guided, none where it is free."""
    h, n = 0.02, 12
    beam = line(n, h)
    EI = 2e8 * h**4 / 12
    guided = {p: Scene(beam).pin("left").fix("right", "r^2").pressure("right", p * EI / h**2)
              for p in (0.8 * np.pi**2, 1.5 * np.pi**2)}
    below, above = (scene.solve_static(stable=False) for scene in guided.values())
    assert below.stability == "stable" and "flutter" in below.verdict.note
    assert (above.stability, above.negative_pivots) == ("unstable", 1)
    with pytest.warns(StabilityWarning, match="no potential"):
        state = guided[1.5 * np.pi**2].solve_static()
    load = float(state.message.split("load level ")[1].split()[0])
    assert abs(1.5 * load - 1.0) < 0.02 and np.allclose(state.u, above.u, rtol=0, atol=1e-10)
    # Beck's column has no divergence at any load; its tangent's symmetric part is indefinite
    column = Scene(beam).clamp("left").pressure("right", 15.0 * EI / h**2)
    assert column.solve_static().stability == "undecided"
    # edges that do not move: the pressure acts as if it had a potential
    state = Scene(beam).clamp("left").clamp("right").pressure("top", 10.0).solve_static()
    assert state.verdict == Verdict("stable", 0)


# stable equilibria


def quietly(scene, **options):
    """The state, and the warnings' classes."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        state = scene.solve_static(**options)
    return state, [w.category for w in caught]


@pytest.mark.parametrize("options", [{}, {"first_step": 0.1}, {"method": "newton"},
                                     {"method": "newton", "first_step": 0.02}],
                         ids=lambda o: "-".join(map(str, o.values())) or "default")
@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("n", [8, 16])
def test_a_slack_rope_hangs_down(degree, n, options):
    """Length 2, one end moved in by 0.5 under its weight: a catenary but for its stiffness."""
    mesh = MeshBeam.init_line(np.linspace(0, 2, n + 1), 0.01)
    beam = Beam(mesh, ElementBeamCable(degree), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    scene = Scene(beam).pin("left").fix("right", ["r^1"], displacement=-0.5)
    scene.fix("right", ["r^2"]).gravity((0, -9.81))
    a = brentq(lambda a: 2 * a * np.sinh(0.75 / a) - 2, 0.3, 2.0)
    state, _ = quietly(scene, **options)
    assert state.stability == "stable"
    assert abs(state.displacement((1, 0))[1] + a * (np.cosh(0.75 / a) - 1)) < 3e-3


def elastica(load, lateral):
    """Tips of the stable equilibria of a clamped inextensible column, EI = L = 1, by shooting."""
    def shoot(k):
        rates = lambda s, y: [y[1], -(load * np.sin(y[0]) + lateral * np.cos(y[0])),
                              np.sin(y[0]), np.cos(y[0])]
        return solve_ivp(rates, [0, 1], [0, k, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]

    ends = [brentq(lambda k: shoot(k)[1], a, b, xtol=1e-12) for a, b in ((-5, -1), (1, 5))]
    return [shoot(k)[2:] for k in ends]


EULER = 1.88 * np.pi**2 / 4


def column(element, lateral, n=16, h=1e-3):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), h, angle=np.pi / 2)
    EI = 2e8 * h**4 / 12
    scene = Scene(Beam(mesh, element, StVenantKirchhoff(2e8, 0.0), width=h)).clamp("left")
    return scene.point_force((lateral * EI, -EULER * EI), at=(0, 1))


@pytest.mark.parametrize("first_step", [1.0, 0.25, 0.02])
@pytest.mark.parametrize("lateral", [0.0, 1e-6, 1e-3, 0.1])
@pytest.mark.parametrize("element, error", [
    (ElementBeamCable(3), 4e-4), (ElementBeamCable(5), 1e-5), (ElementBeamANCF(2), 1.5e-2)])
def test_a_column_beyond_its_critical_load_buckles(element, error, lateral, first_step):
    """At 1.88 of Euler's load; an imperfect one to the side to which it is pushed."""
    scene = column(element, lateral)
    state, warned = quietly(scene, first_step=first_step)
    tip = np.array([0, 1]) + state.displacement((0, 1))
    if lateral == 0.0:  # both sides are alike
        tip[0] = abs(tip[0])
        assert warned == [StabilityWarning] and "loses its stability" in state.message
    assert np.max(np.abs(tip - elastica(EULER, lateral)[1])) < error
    assert (state.stability, state.negative_pivots) == ("stable", 0)
    plain, warned = quietly(scene, first_step=first_step, stable=False)
    assert (plain.stability, plain.negative_pivots) == ("unstable", 1) and not warned


@pytest.mark.parametrize("factor", [0.7, 1.05, 3.0])
def test_a_truss_snaps_through(factor):
    """Two bars: exact for the engineering strain of the cables, beyond the limit point and before.

    Stocky bars, which do not buckle.
    """
    H, h, E = 0.1, 0.1, 2e8
    l0, angle = np.hypot(1, H), np.arctan(H)
    bars = [Beam(MeshBeam.init_line(np.linspace(0, l0, 4), h, origin=o, angle=a),
                 ElementBeamCable(5), StVenantKirchhoff(E, 0.0), width=h, name=name)
            for name, o, a in (("a", (0, 0), angle), ("b", (1, H), -angle))]

    def load(y):  # that holds the top at the height y
        return -2 * E * h**2 * (np.hypot(1, y) / l0 - 1) * y / np.hypot(1, y)

    limit = load(minimize_scalar(lambda y: -load(y), (0.02, 0.06, 0.09), tol=1e-10).x)
    top = minimize_scalar(lambda y: -load(y), (0.02, 0.06, 0.09), tol=1e-10).x
    scene = Scene(*bars).pin("left", beam="a").pin("right", beam="b")
    scene.joint("hinge", beams=("a", "b"), at=(1, H))
    scene.point_force((0, -factor * limit), at=(1, H), beam="a")
    state, warned = quietly(scene)
    y = brentq(lambda y: load(y) - factor * limit, *((top, H) if factor < 1 else (-1.0, -H)))
    assert np.allclose(state.displacement((1, H), "a"), [0, y - H], rtol=0, atol=1e-8)
    assert state.stability == "stable"
    if factor == 1.05:  # far beyond the limit the iteration may come straight to the stable state
        assert warned == [StabilityWarning]
        assert "loses its stability between the load levels" in state.message


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)])
def test_a_shallow_arch_snaps_through(element):
    R = (0.25 + 0.01) / 0.2
    half = np.arcsin(0.5 / R)
    mesh = MeshBeam.init_curve(
        lambda s: np.array([0.5 + R * np.sin((2 * s - 1) * half),
                            0.1 - R + R * np.cos((2 * s - 1) * half)]), np.linspace(0, 1, 17), 0.01)
    scene = Scene(Beam(mesh, element, StVenantKirchhoff(2e8, 0.0), width=0.01))
    scene.pin("left").pin("right").point_force((0, -40 * 2e8 * 0.01**4 / 12), at=(0.5, 0.1))
    state, warned = quietly(scene)
    assert warned == [StabilityWarning] and state.stability == "stable"
    assert np.min(dense_eigenvalues(scene.system, state.u)) > 0
    # it hangs below its supports, a little longer than before
    u = state.displacement((0.5, 0.1))
    assert abs(u[0]) < 1e-6 and -0.22 < u[1] < -0.2
    missing = scene.system.external_force(state.u) - scene.system.internal_force(state.u)
    assert np.max(np.abs(missing[scene.system.constraints.free])) < 1e-9


# checks


def test_checks_of_a_uniform_stretch():
    stretch = 1.2
    scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], 0.1), ElementBeamANCF(2),
                       StVenantKirchhoff(1e6, 0.0), width=0.1))
    scene.clamp("left", thickness="free")
    scene.traction("right", (1e6 * stretch * (stretch**2 - 1) / 2, 0))
    checks = scene.solve_static().checks
    assert np.allclose([checks.smallest_det, checks.smallest_stretch, checks.largest_stretch],
                       [stretch, 1.0, stretch], rtol=0, atol=1e-8)
    assert checks.turning < 1e-12
    assert len(checks.findings) == 1 and "the strain is 0.2: Hooke's" in checks.findings[0]
    # a cable bent to a circle: fibres of 1 +- h kappa / 2, and sections that get thicker
    h, kappa, nu = 0.1, 2.0, 0.3
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), h), ElementBeamCable(5),
                StVenantKirchhoff(1e6, nu), width=h)
    bent = Scene(beam).clamp("left").moment("right", 1e6 * h**4 / 12 * kappa).solve_static().checks
    fibres = 1 + 0.5 * h * kappa * np.array([-1, 1])
    assert np.allclose([bent.smallest_stretch, bent.largest_stretch], fibres, rtol=0, atol=1e-4)
    low = fibres * np.sqrt(1 - nu * (fibres**2 - 1))
    assert abs(bent.smallest_det - min(low)) < 1e-3 and abs(bent.turning - kappa / 16) < 1e-6


def test_fibres_compressed_beyond_the_law_are_said():
    """A thick cantilever at 4.2 EI / L^2, nu = 0, with cubic sections; at 3 it is in range."""
    L, h, E = 2.0, 0.5, 2.07e11

    def cantilever(material, load):
        beam = Beam(MeshBeam.init_line(np.linspace(0, L, 17), h), ElementBeamANCFCubic(3),
                    material, width=0.1)
        force = load * E * 0.1 * h**3 / 12 / L**2
        return Scene(beam).clamp("left").traction("right", (0, -force / (0.1 * h)))

    svk = StVenantKirchhoff(E, 0.0)
    state, warned = quietly(cantilever(svk, 3.0))
    assert state.checks.smallest_stretch > 0.65 and not warned
    assert not any("resists less" in text for text in state.checks.findings)
    state, warned = quietly(cantilever(svk, 4.2))
    assert state.checks.smallest_stretch < 1 / np.sqrt(3) and ModelWarning in warned
    assert "St. Venant-Kirchhoff resists less" in state.checks.findings[0]
    assert ModelWarning not in quietly(cantilever(NeoHookean(E, 0.0), 4.2))[1]


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)])
def test_strains_outside_of_the_law_ask_for_the_units(element):
    """Steel with E in MPa and lengths in m is a million times too soft."""
    def pulled(E, force, law=StVenantKirchhoff):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.1), element, law(E, 0.3), width=0.1,
                    name="tie")
        return Scene(beam).clamp("left").point_force((force, 0.0), at=(1, 0)).solve_static()

    steel = pulled(210e9, 1e5)
    assert steel.checks.findings == () and "strain" not in str(steel)
    yielding = pulled(210e9, 1.15e8)  # 5 %
    assert len(yielding.checks.findings) == 1
    assert "the strain of beam 'tie' is 0.05" in str(yielding) and "metals" in str(yielding)
    mixed = pulled(210e3, 1e8)
    for words in ("Are E and the lengths in the same units", "recovery failed"):
        assert any(words in text for text in mixed.checks.findings) and words in str(mixed)
    if element.order:
        rubber = pulled(1e6, 6e3, NeoHookean)
        assert rubber.checks.largest_stretch > 1.3 and rubber.checks.findings == ()
        assert any("units" in text for text in pulled(1e3, 1e5, NeoHookean).checks.findings)


def test_eigenstrains_are_not_strains_of_the_law():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.1), ElementBeamANCF(2),
                StVenantKirchhoff(1e6, 0.0, thermal_expansion=1e-3), width=0.1)
    state = Scene(beam).clamp("left", thickness="free").temperature(100.0).solve_static()
    assert state.checks.largest_stretch > 1.05 and state.checks.findings == ()


def test_a_mesh_too_coarse_for_the_curvature_is_said():
    """A cable bent to a circular arc of 4.3 rad by an end moment, against the circle."""
    h, angle = 0.01, 4.3
    tip = np.array([np.sin(angle), 1.0 - np.cos(angle)]) / angle
    errors = {}
    for n in (4, 12):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), h), ElementBeamCable(3),
                    StVenantKirchhoff(2e8, 0.0), width=h)
        state, warned = quietly(Scene(beam).clamp("left").moment("right", angle * 2e8 * h**4 / 12))
        errors[n] = np.linalg.norm(state.position((1, 0)) - tip)
        assert (ModelWarning in warned) == (n == 4)
        assert any("too coarse" in text for text in state.checks.findings) == (n == 4)
    assert 5e-3 < errors[4] < 0.15 and errors[12] < 2e-3


def test_energy_that_is_not_positive_is_said_at_once():
    """The strain split in plane strain at nu = 0.45: the stiffness at rest has negative values."""
    def beam(formulation, nu=0.45):
        law = StVenantKirchhoff(2e8, nu, 78.0, plane="strain")
        mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 4), 0.3)
        return Beam(mesh, ElementBeamANCF(5), law, 0.1, formulation)

    def solve(beam):
        scene = Scene(beam).clamp("left", thickness="fixed").point_force((0, -1e3), at=(1, 0))
        return scene.solve_static()

    split = beam("strain-split")
    K = asm(forms.of(split).tangent, split.basis, r=split.q0).toarray()
    assert np.linalg.eigvalsh(K)[0] < -1e-3 * np.abs(K).max()
    with pytest.raises(ConvergenceError, match=r"unstable without load .*'strain-split'"):
        solve(split)
    for other in (beam("assumed"), beam("continuum"), beam("strain-split", nu=0.2)):
        assert solve(other).converged
