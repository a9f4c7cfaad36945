"""Temperature and stress-free strains: Timoshenko's strip, exact curls, buckling, free motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from skfem import (Basis, BilinearForm, ElementQuad2, ElementVector, LinearForm, MeshQuad, condense,
                   solve)
from skfem.helpers import sym_grad

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, Frame,
                        InputError, MeshBeam, Scene, Section, StVenantKirchhoff)
from skfem_ancf.core.errors import CallbackError
from skfem_ancf.core.quadrature import gauss

STEEL = StVenantKirchhoff(E=2e11, nu=0.0, density=8000, thermal_expansion=12e-6)
BRASS = StVenantKirchhoff(E=1e11, nu=0.0, density=8500, thermal_expansion=19e-6)
ELEMENTS = {"order 1": ElementBeamANCF(1), "order 2": ElementBeamANCF(2),
            "cubic": ElementBeamANCFCubic(2), "cubic of order 3": ElementBeamANCFCubic(3),
            "cable": ElementBeamCable(3), "quintic cable": ElementBeamCable(5)}
every = pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS)


def strip(element, lower=0.001, upper=0.001, n=16, L=0.2, laws=(STEEL, BRASS), **options):
    section = Section.layers((lower, laws[0]), (upper, laws[1]), width=0.01)
    mesh = MeshBeam.init_line(np.linspace(0, L, n + 1), height=lower + upper)
    return Beam(mesh, element, section=section, **options)


def timoshenko(lower, upper, change):
    """Curvature of a bimetal strip that is heated: Timoshenko (1925), equation 4."""
    m, n, h = lower / upper, STEEL.E / BRASS.E, lower + upper
    # the layer that expands less is below: the strip bends down
    return -6 * (19e-6 - 12e-6) * change * (1 + m) ** 2 / (
        h * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))))


@every
@pytest.mark.parametrize("upper", [0.001, 0.003])
@pytest.mark.parametrize("solver", ["solve_static", "solve_linear"])
def test_timoshenkos_strip(element, upper, solver):
    beam = strip(element, upper=upper)
    state = getattr(Scene(beam).clamp("left").temperature(20.0), solver)()
    kappa = timoshenko(0.001, upper, 20.0)
    assert state.displacement((0.2, 0.0))[1] == pytest.approx(kappa * 0.02, rel=1e-3)


@pytest.mark.parametrize("element, n", [(ElementBeamANCFCubic(2), 48), (ElementBeamCable(5), 32),
                                        (ElementBeamANCF(2), 160)])
def test_a_strip_curls_three_turns(element, n):
    """A stress-free strain linear across: an exact circle arc, its end at the start again."""
    L, h = 1.0, 0.002
    kappa = 6.0 * np.pi / L
    mesh = MeshBeam.init_line(np.linspace(0, L, n + 1), height=h)
    beam = Beam(mesh, element, STEEL, width=0.01)
    scene = Scene(beam).clamp("left").eigenstrain(xx=lambda x, y: -kappa * y + kappa**2 * y**2 / 2)
    state = scene.solve_static()
    assert_allclose(state.displacement((L, 0.0)), [-L, 0.0], atol=2e-3)
    middle = 1.0 / kappa
    x = state.displacement((0.5, 0.0)) + [0.5, 0.0]
    assert np.hypot(x[0], x[1] - middle) == pytest.approx(middle, rel=1e-2)
    assert state.iterations < 250


def test_heat_buckles_a_beam_between_walls():
    """alpha T E A = 4 pi^2 E I / L^2: without the change of length before."""
    h, L = 0.01, 1.0
    for element in (ElementBeamANCFCubic(2), ElementBeamANCF(2)):
        mesh = MeshBeam.init_line(np.linspace(0, L, 33), height=h)
        beam = Beam(mesh, element, STEEL, width=0.02)
        factor = Scene(beam).clamp("left").clamp("right").temperature(1.0).buckling(1).factors[0]
        assert factor == pytest.approx(np.pi**2 * h**2 / (3 * L**2) / 12e-6, rel=5e-3)


def arched(T, alpha, EA):
    """Rise of a heated beam between clamps, EI = L = 1, that has buckled: a two-point problem."""
    def rates(s, y, p):
        stretch = 1 + alpha * T - p[0] * np.cos(y[2]) / EA
        return np.array([stretch * np.cos(y[2]), stretch * np.sin(y[2]), y[3],
                         -p[0] * np.sin(y[2]) * stretch])

    s = np.linspace(0, 0.5, 101)
    a = 2 / np.pi * np.sqrt(alpha * T - 4 * np.pi**2 / EA)  # of small slopes
    guess = np.array([s, a / 2 * (1 - np.cos(2 * np.pi * s)), a * np.pi * np.sin(2 * np.pi * s),
                      2 * np.pi**2 * a * np.cos(2 * np.pi * s)])
    found = solve_bvp(rates, lambda a, b, p: np.array([a[0], a[1], a[2], b[0] - 0.5, b[2]]),
                      s, guess, p=[4 * np.pi**2], tol=1e-9, max_nodes=10**5)
    assert found.success
    return found.y[1, -1]


@pytest.mark.parametrize("element, n, tol", [
    (ElementBeamCable(5), 8, 1e-6), (ElementBeamANCFCubic(2), 16, 1e-3),
    (ElementBeamANCF(2), 48, 1e-2)], ids=["cable", "cubic", "order 2"])
def test_the_path_of_a_heated_beam_between_walls(element, n, tol):
    """No node moves before it buckles: critical temperatures, and the rise beyond."""
    h, alpha = 1e-3, 1e-5
    EA = 12 / h**2
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), h), element,
                StVenantKirchhoff(EA / h, 0.3, thermal_expansion=alpha), width=1.0)
    scene = Scene(beam).clamp("left", thickness="free").clamp("right", thickness="free")
    first = 4 * np.pi**2 / (EA * alpha)
    path = scene.temperature(1.0).continuation(ds=1e-6, max_load=3 * first)
    # tan(x) = x of the antisymmetric mode
    second = brentq(lambda x: np.sin(x) - x * np.cos(x), np.pi, 1.5 * np.pi) ** 2 / np.pi**2
    assert_allclose(path.bifurcation_points(), [first, second * first], rtol=tol)
    assert len(path) > 5 and np.all(np.diff(path.load) > 0)  # no wandering by round-off
    arch = scene.continuation(branch=path.critical_points[0], ds=1e-4, max_load=3 * first)
    assert arch.stable[-1]
    rise = abs(arch.displacement((0.5, 0))[-1, 1])
    assert rise == pytest.approx(arched(3 * first, alpha, EA), rel=tol)


@pytest.mark.parametrize("element, error", [
    (ElementBeamCable(5), 1e-9), (ElementBeamANCFCubic(2), 2e-3), (ElementBeamANCF(2), 2e-3)])
def test_a_muscle_layer_bends_a_finger_as_its_moment_does(element, error):
    """A layer that contracts by up to 1 % curls the other to 0.88 rad: composite section, exactly.

    The stretch of a section that is no cable is that of Green and Lagrange.
    """
    L, h, pull = 0.1, 8e-4, 0.01
    passive, muscle = (StVenantKirchhoff(E=E, nu=0.0, density=1000) for E in (1e6, 3e6))
    section = Section.layers((0.75 * h, passive), (0.25 * h, muscle), width=0.01)
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, 33), height=h), element, section=section)
    scene = Scene(beam).clamp("left").eigenstrain(
        xx=lambda x, y: np.where(y > 0.25 * h, -pull * x / L, 0.0))
    y = h * np.array([-0.5, 0.25, 0.5])
    EA, ES, EI = (1e6 * (y[1]**k - y[0]**k) / k + 3e6 * (y[2]**k - y[1]**k) / k for k in (1, 2, 3))
    N, M = (-pull * 3e6 * (y[2]**k - y[1]**k) / k for k in (1, 2))
    stretch, curvature = np.linalg.solve([[EA, -ES], [-ES, EI]], [N, -M])
    s, w = gauss(40)
    angle = curvature * L * s**2 / 2
    tip = [L * np.sum(w * (1 + stretch * s) * f(angle)) for f in (np.cos, np.sin)]
    assert curvature * L / 2 > 0.8
    assert_allclose(scene.solve_static().displacement((L, 0)) + [L, 0], tip, rtol=error)


@pytest.mark.parametrize("make, words", [
    (lambda s: s.temperature(None), "temperature|number"),
    (lambda s: s.temperature("hot"), "number or a function"),
    (lambda s: s.temperature(np.nan), "number or a function"),
    (lambda s: s.eigenstrain(xx=lambda x, y: np.nan * x), "finite"),
    (lambda s: s.eigenstrain(), "give xx, yy or xy"),
    (lambda s: s.eigenstrain(xx=lambda x, y: np.zeros(3)), "shape"),
    (lambda s: s.eigenstrain(xx=lambda x, y, t: np.tanh(50.0 * (x - t))), "no sum of at most"),
])
def test_errors_teach(make, words):
    with pytest.raises((InputError, CallbackError), match=words):
        make(Scene(strip(ElementBeamANCF(2))).clamp("left"))


def test_what_cannot_expand_says_so():
    mesh = MeshBeam.init_line([0, 1], height=0.1)
    dull = Scene(Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(1e6, 0.3), width=0.1))
    with pytest.raises(InputError, match="thermal_expansion"):
        dull.temperature(1.0)


SQUARE = {"width": 0.02}
POINTS = np.linspace(0, 1, 9)


def quarter(height=0.02):
    return MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1 - np.cos(s)]), 1.5 * POINTS, height)


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamCable(9)])
def test_a_cable_of_uniform_curvature_is_a_circle_and_a_heated_arc_stays_similar(element):
    kappa = 1.6 * np.pi
    line = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), element, STEEL, width=0.02)
    state = Scene(line).clamp("left").eigenstrain(xx=lambda x, y: -kappa * y).solve_static()
    for s in (0.5, 1.0):
        x = state.displacement((s, 0.0)) + [s, 0.0]
        assert_allclose(x, [np.sin(kappa * s) / kappa, (1 - np.cos(kappa * s)) / kappa], atol=1e-10)
    arc = Beam(quarter(), element, STEEL, **SQUARE)
    state = Scene(arc).clamp("left").temperature(5000.0).solve_static()  # by six per cent
    for point in arc.mesh.p.T[1:]:
        assert_allclose(state.displacement(tuple(point)), 0.06 * point, rtol=1e-8)
    N = state.resultants(tuple(arc.mesh.p[:, 4]), recover=False).N
    assert abs(N) < 1e-9 * 2e11 * 4e-4 * 0.06


@pytest.mark.parametrize("degree", [3, 5, 7])
def test_a_held_cable_buckles_when_heated_and_frames_of_cables_expand(degree):
    """alpha T E A = 4 pi^2 E I / L^2 and, free to move, every place by alpha T of itself."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), ElementBeamCable(degree),
                STEEL, width=0.02)
    factor = Scene(beam).clamp("left").clamp("right").temperature(1.0).buckling(1).factors[0]
    assert factor == pytest.approx(np.pi**2 * 1e-4 / 3 / 12e-6, rel=2e-3 if degree == 3 else 1e-8)
    points = [(0, 0), (0, 1), (1, 1), (1, 0.2)]
    frame = Frame.from_lines(points, [(0, 1), (1, 2), (2, 3)], nodes={"ground": [0]},
                             material=STEEL, height=0.02, width=0.02, elements=2,
                             element=ElementBeamCable(degree)).clamp("ground")
    state = frame.temperature(100.0).solve_static()
    for point in points[1:]:
        assert_allclose(state.displacement(point), 1.2e-3 * np.array(point), atol=1e-12)


# layers of different nu, and temperatures of a high degree across


def plane_bow(L, h, layers, T):
    """Axis of a free strip heated by T(y), plane stress, Q2 elements: v at 0, L/4, ..., L."""
    y = np.unique(np.concatenate([np.linspace(a, b, 5) for a, b, _ in layers]))
    mesh = MeshQuad.init_tensor(np.linspace(0.0, L, 61), y)
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=6)
    K, f = 0.0, 0.0
    for a, b, law in layers:
        middle = mesh.p[1, mesh.t].mean(axis=0)
        part = Basis(mesh, basis.elem, intorder=6,
                     elements=np.nonzero((middle > a) & (middle < b))[0])
        c, nu, alpha = law.E / (1 - law.nu**2), law.nu, law.thermal_expansion

        def form(u, v, w, c=c, nu=nu):
            e, d = sym_grad(u), sym_grad(v)
            return c * (e[0, 0] * d[0, 0] + e[1, 1] * d[1, 1] + nu * (
                e[0, 0] * d[1, 1] + e[1, 1] * d[0, 0]) + 2 * (1 - nu) * e[0, 1] * d[0, 1])

        def heat(v, w, c=c, nu=nu, alpha=alpha):
            d = sym_grad(v)
            return c * (1 + nu) * alpha * T(w.x[0], w.x[1]) * (d[0, 0] + d[1, 1])

        K, f = K + BilinearForm(form).assemble(part), f + LinearForm(heat).assemble(part)
    left = basis.get_dofs(lambda x: (np.abs(x[0]) < 1e-9) & (np.abs(x[1]) < 1e-9)).all()
    right = basis.get_dofs(lambda x: (np.abs(x[0] - L) < 1e-9) & (np.abs(x[1]) < 1e-9)).all("u^2")
    u = solve(*condense(K, f, D=np.concatenate([left, right])))
    x = np.array([np.linspace(0.0, L, 5), np.zeros(5)])
    return (basis.probes(x) @ u).reshape(2, -1)[1]


@pytest.mark.parametrize("element, at_ends", [
    (ElementBeamANCF(2), 2.5e-2), (ElementBeamANCF(3), 2.5e-2), (ElementBeamANCF(6), 4e-3),
    (ElementBeamANCFCubic(3), 2.5e-2)], ids=repr)
def test_layers_of_different_nu_bend_as_the_plane_body(element, at_ends):
    """Under a temperature that is quadratic across: in the middle, and with what the ends do."""
    laws = [StVenantKirchhoff(2e8, 0.1, thermal_expansion=1e-5),
            StVenantKirchhoff(1e8, 0.45, thermal_expansion=1.5e-5)]
    L, h = 1.0, 0.1

    def T(x, y):
        return 4e3 * y**2

    beam = Beam(MeshBeam.init_line(np.linspace(0.0, L, 33), h), element,
                section=Section.layers((0.05, laws[0]), (0.05, laws[1]), width=0.02))
    state = Scene(beam).pin("left").fix("right", "r^2").temperature(T).solve_static()
    own = state.displacement(np.array([np.linspace(0.0, L, 5), np.zeros(5)]))[1]
    plane = plane_bow(L, h, [(-0.05, 0.0, laws[0]), (0.0, 0.05, laws[1])], T)
    (inner, outer), (exact, whole) = ((v[1] - 2 * v[2] + v[3], v[0] - 2 * v[2] + v[4])
                                      for v in (own, plane))
    assert inner == pytest.approx(exact, rel=1e-3)
    assert outer == pytest.approx(whole, rel=at_ends)
    S = state.stress((0.5, 0.03), recover=False)
    assert abs(S[1]) < 2e-3 * abs(S[0])  # no stress across is left
    assert S[0] == pytest.approx(state.stress((0.5, 0.03))[0], rel=1e-3)
