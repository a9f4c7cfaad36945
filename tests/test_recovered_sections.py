"""Recovered fields of layers and profiles: against the plane body, Jourawski and Timoshenko."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from test_sections import (BIMETAL, BRASS, PROFILES, SANDWICH, STEEL, H, cantilever, line, plane,
                           plane_stress, straight)

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, Section)

T = Section.profile("T", width=0.06, web=0.01, flange=0.015)
ELEMENTS = [ElementBeamANCF(2), ElementBeamANCFCubic(2), ElementBeamCable(5)]
elements = pytest.mark.parametrize("element", ELEMENTS, ids=repr)
P = 1e-2


def layers(section):
    y = np.cumsum([-H / 2] + [part[0] for part in section.parts])
    return [(a, b, law, width) for a, b, (_, law, width) in zip(y[:-1], y[1:], section.parts)]


BODIES = {
    "sandwich": (SANDWICH, None, layers(SANDWICH)),
    "bimetal": (BIMETAL, None, layers(BIMETAL)),
    "I": (PROFILES["I"][0], STEEL, [(-0.05, -0.035, STEEL, 0.06), (-0.035, 0.035, STEEL, 0.01),
                                    (0.035, 0.05, STEEL, 0.06)]),
    "T": (T, STEEL, [(-0.05, 0.035, STEEL, 0.01), (0.035, 0.05, STEEL, 0.06)]),
}


@pytest.mark.parametrize("section, material, pieces", BODIES.values(), ids=BODIES)
def test_stress_is_that_of_the_plane_body(section, material, pieces):
    """Ten heights long, in the middle, at Gauss points of the Q2 elements, where they are best."""
    _, basis, u = plane(pieces, 1.0, (0.0, -P), n=(150, 4))
    inside = np.add.outer(np.arange(4), [0.5 - 0.75**0.5 / 3, 0.5 + 0.75**0.5 / 3]).ravel() / 4
    Y = np.concatenate([a + (b - a) * inside for a, b, _, _ in pieces])
    x = np.array([0.5 + (0.5 - 0.75**0.5 / 3) / 150 + 0.0 * Y, Y])
    exact = plane_stress(basis, u, x, pieces)
    for element in ELEMENTS:
        state = cantilever(Beam(line(), element, material, section=section), (0.0, -P))
        assert state.recovered == {0: ""}
        found, own = state.stress(x), state.stress(x, recover=False)
        assert_allclose(found[0], exact[0], atol=2e-4 * np.abs(exact[0]).max())
        assert_allclose(found[2], exact[2], atol=5e-4 * np.abs(exact[2]).max())
        assert np.abs(found[1]).max() < 1e-4 * np.abs(exact[2]).max()
        assert np.abs(own[2] - exact[2]).max() > 0.4 * np.abs(exact[2]).max()


@pytest.mark.parametrize("name", ["I", "box", "tube", "circle"])
def test_shear_stress_of_profiles_is_Jourawskis(name):
    """Q S / (I b), S by integration; where b jumps, both sides."""
    section, _, second = PROFILES[name]
    pieces = section.pieces(H)
    jumps = [p.low * H - H / 2 for p in pieces[1:]]
    Y = np.concatenate([np.linspace(-0.05, 0.05, 20)] + [[y - 1e-7, y + 1e-7] for y in jumps])

    def width(y):
        p = next(p for p in pieces if y / H + 0.5 <= p.high or p is pieces[-1])
        return float(p.width(np.array([y / H + 0.5]))[0]) if callable(p.width) else p.width

    S = [quad(lambda z: z * width(z), y, H / 2, points=[j for j in jumps if j > y + 1e-6] or None,
              limit=200, epsabs=1e-12 * H**3)[0] for y in Y]
    exact = [-P * s / (second * width(y)) if width(y) > 0 else 0.0 for y, s in zip(Y, S)]
    for element in ELEMENTS[1:]:
        state = cantilever(Beam(line(), element, STEEL, section=section), (0.0, -P))
        found = state.stress(np.array([0.5 + 0.0 * Y, Y]))
        assert_allclose(found[2], exact, atol=1e-5 * np.abs(exact).max())
        assert_allclose(found[0], P * 0.5 * Y / second, atol=1e-6 * P * 0.025 / second)


@elements
def test_a_heated_bimetal_strip(element):
    """Timoshenko's strip between the ends: stress by composite theory; it jumps, S_xy is none."""
    law, other = STEEL.replace(thermal_expansion=12e-6), BRASS.replace(thermal_expansion=19e-6)
    section = Section.layers((0.001, law), (0.002, other), width=0.01)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 0.2, 17), height=0.003), element, section=section)
    state = Scene(beam).clamp("left").temperature(50.0).solve_static()
    assert state.recovered == {0: ""}
    parts = [(law.E, -0.0015, -0.0005, 12e-6), (other.E, -0.0005, 0.0015, 19e-6)]
    A, r = np.zeros((2, 2)), np.zeros(2)
    for E, a, b, alpha in parts:
        m = np.array([(b**k - a**k) / k for k in (1, 2, 3)])
        A += E * np.array([m[:2], m[1:]])
        r += E * alpha * 50 * m[:2]
    axis, slope = np.linalg.solve(A, r)
    Y = np.array([-0.0015, -0.00051, -0.00049, 0.001, 0.0015])
    exact = [E * (axis + slope * y - 50 * alpha) for y in Y for E, a, b, alpha in parts
             if a <= y < b or y == b == 0.0015]
    found = state.stress(np.array([0.1 + 0.0 * Y, Y]))
    assert_allclose(found[0], exact, atol=1e-3 * np.abs(exact).max())
    assert np.abs(found[1:]).max() < 1e-3 * np.abs(exact).max()


def test_pressure_goes_through_the_layers():
    """S_yy is continuous, zero at the bottom and the pressure at the top."""
    state = Scene(Beam(line(), ElementBeamANCFCubic(2), section=SANDWICH)).clamp("left").pressure(
        "top", 3.0).solve_static()
    Y = np.array([-0.05, -0.0401, -0.0399, 0.0399, 0.0401, 0.05])
    S = state.stress(np.array([0.5 + 0.0 * Y, Y]))[1]
    assert_allclose(S[[0, -1]], [0.0, -3.0], atol=1e-3)
    assert_allclose(S[[1, 3]], S[[2, 4]], atol=0.02)


def test_section_forces_of_a_cable_whose_centroid_is_off_its_axis():
    """A T that stands: its weight bends it; and an I that is swung has rotary inertia."""
    for section in (T, BIMETAL):
        beam = Beam(line(), ElementBeamCable(5), None if section is BIMETAL else STEEL,
                    section=section)
        scene = Scene(beam).clamp("left").gravity((-1e-6, 0.0))
        r = scene.solve_static().resultants([(0.5, 0.0)])
        mass, first, _ = beam.across.moments(np.array([0.5]), np.array([0]), "mass")[:, 0, 0]
        assert r.recovered and r.N[0] == pytest.approx(-1e-6 * mass * 0.5, rel=1e-6)
        assert r.M[0] == pytest.approx(1e-6 * first * 0.5, rel=1e-4)
    history = Scene(Beam(line(), ElementBeamCable(5), STEEL, section=PROFILES["I"][0])).pin(
        "left").gravity((0, -9.81)).integrate(0.02, 1e-3, scheme="generalized-alpha")
    state = history.state(-1)
    assert state.recovered == {0: ""}
    assert abs(state.resultants((1.0, 0.0)).M) < 1e-6 * np.abs(state.resultants().M).max()


@elements
def test_numbers_have_section_forces_and_no_fields(element):
    """N, Q, M by equilibrium; curvature, stretch and shear by EI, EA and GA."""
    EA, EI, GA = 1e6, 40.0, 2e5
    beam = Beam(line(16, h=0.02), element, section=Section.numbers(EA=EA, EI=EI, GA=GA))
    state = Scene(beam).clamp("left").point_force((1e-3, 1e-3), at=(1, 0)).solve_static()
    assert "has no shape" in state.recovered[0] and state.recovery() is None
    r = state.resultants((0.5, 0.0))
    assert r.recovered
    assert_allclose([r.N, r.Q, r.M], [1e-3, 1e-3, 5e-4], rtol=2e-5)
    assert_allclose([r.curvature, r.stretch - 1.0], [5e-4 / EI, 1e-3 / EA], rtol=2e-3)
    assert r.shear == pytest.approx(1e-3 / GA, rel=1e-2)


def narrower(x):
    return 1.0 - 0.5 * x


@pytest.mark.parametrize("name", ["I", "T"])
def test_tapered_profiles_are_the_plane_body(name):
    """Height halved over ten heights, flanges with it: tip and stress, which the slope changes."""
    section, material, pieces = BODIES[name]
    section = Section.profile(name, scaled=True, **section.sizes)

    def ends(x):
        return straight(pieces)(x) * narrower(x)

    _, basis, u = plane(pieces, 1.0, (0.0, -P), n=(150, 4), ends=ends)
    inside = np.add.outer(np.arange(4), [0.5 - 0.75**0.5 / 3, 0.5 + 0.75**0.5 / 3]).ravel() / 4
    place = 0.5 + (0.5 - 0.75**0.5 / 3) / 150
    Y = narrower(place) * np.concatenate([a + (b - a) * inside for a, b, _, _ in pieces])
    x = np.array([place + 0.0 * Y, Y])
    exact = plane_stress(basis, u, x, pieces, ends)
    tip = basis.probes(np.array([[1 - 1e-12], [0.0]])) @ u
    for element in (*ELEMENTS, ElementBeamANCFCubic(3)):
        mesh = MeshBeam.init_line(np.linspace(0, 1, 17), height=lambda x: H * narrower(x))
        beam = Beam(mesh, element, material, section=section)
        state = cantilever(beam, (0.0, -P))
        assert state.recovered == {0: ""}
        assert_allclose(state.stress(x)[0], exact[0], atol=5e-4 * np.abs(exact[0]).max())
        assert_allclose(state.stress(x)[2], exact[2], atol=5e-3 * np.abs(exact[2]).max())
        # a cable does not shear, and at order 2 the factor of a section that is no wedge serves
        error = {0: 0.02, 2: 0.01, 3: 1e-3}[element.order]
        assert state.displacement((1, 0))[1] == pytest.approx(tip[1], rel=error)
        area = 0.75 * sum((b - a) * width for a, b, _, width in pieces)
        assert beam.total_mass == pytest.approx(7800 * area, rel=1e-9)
