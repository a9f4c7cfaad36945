"""Recovered fields where a modulus, a width, a temperature, a height or a load jumps at a node."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                        ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff)

E, B, H, M, ALPHA = 1e6, 0.05, 0.06, 0.05, 1e-3
elements = pytest.mark.parametrize(
    "element", [ElementBeamANCF(3), ElementBeamANCFCubic(2), ElementBeamCable(3)], ids=repr)


def step(x, y=0.0):
    return 1.0 + 2.0 * (x > 0.5) + 0.0 * y


def cantilever(element, modulus=E, width=B, height=H):
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 17), height=height)
    material = StVenantKirchhoff(E=modulus, nu=0.3, thermal_expansion=ALPHA)
    return Scene(Beam(mesh, element, material, width)).clamp("left")


def strains(state, y=0.02):
    """eps_xx just before the jump, just behind it, and well behind it."""
    return state.strain([(0.49, y), (0.51, y), (0.8, y)])[0]


@elements
@pytest.mark.parametrize("what", ["modulus", "width"])
def test_a_bent_beam_of_two_moduli_or_widths(element, what):
    """Each half is bent as if it were alone: -y M / (E I)."""
    given = {what: lambda x, y: {"modulus": E, "width": B}[what] * step(x, y)}
    state = cantilever(element, **given).moment("right", M).solve_static()
    before, behind, far = strains(state)
    exact = -0.02 * M / (E * B * H**3 / 12)
    assert_allclose([before, behind], [exact, exact / 3.0], rtol=2e-3)
    assert behind == pytest.approx(far, rel=1e-6)


@elements
def test_a_beam_that_is_heated_from_its_middle_on(element):
    """It bends freely there, and not before: eps_xx = alpha T."""
    scene = cantilever(element).temperature(lambda x, y: 40.0 * (x > 0.5) * y / H)
    before, behind, far = strains(scene.solve_static())
    free = ALPHA * 40.0 * 0.02 / H
    if not element.order:  # of a cable it is the stretch minus 1
        free += 0.5 * free**2
    assert before == pytest.approx(0.0, abs=1e-10)
    assert behind == pytest.approx(free, rel=5e-3)
    assert behind == pytest.approx(far, rel=1e-6)


@elements
def test_a_face_that_is_loaded_from_its_middle_on(element):
    q = 50.0
    scene = cantilever(element).traction(
        "top", lambda x: np.array([0.0 * x[0], -q * (x[0] > 0.5)]))
    S = scene.solve_static().stress([(0.48, H / 2), (0.52, H / 2), (0.56, H / 2)])[1]
    assert abs(S[0]) < 1e-6 * q
    assert_allclose(S[1:], -q, rtol=0.07)  # the face has turned and stretched
    assert S[1] == pytest.approx(S[2], rel=0.01)


def test_a_line_load_from_the_middle_on():
    """The section force is that of the part behind it."""
    q = 5.0
    scene = cantilever(ElementBeamANCF(3)).line_load(
        lambda x: np.array([0.0 * x[0], -q * (x[0] > 0.5)]))
    state = scene.solve_static()
    assert list(state.recovery().forces.cuts) == [0.0, 8.0, 16.0]
    r = state.resultants([(x, 0.0) for x in (0.3, 0.49, 0.75)])
    assert_allclose(np.hypot(r.N, r.Q), q * np.array([0.5, 0.5, 0.25]), rtol=1e-8)


def test_where_heights_have_a_kink():
    """The fields of both parts are those of wedges: as if the other one were not there."""
    kinked = cantilever(ElementBeamANCF(3), height=lambda x: H * (1.0 - np.maximum(x - 0.5, 0.0)))
    state = kinked.moment("right", M).solve_static()
    assert list(state.recovery().forces.cuts) == [0.0, 8.0, 16.0]
    assert_allclose(strains(state)[0], -0.02 * M / (E * B * H**3 / 12), rtol=2e-3)


def hook(element, n):
    """S_xx of a line that becomes an arc at 0.5, bent at its end, at places along it."""
    radius, height, y = 0.25, 0.1, 0.045

    def curve(s, y=0.0):
        angle = np.maximum(s - 0.5, 0.0) / radius
        return np.array([np.minimum(s, 0.5) + (radius - y) * np.sin(angle),
                         radius - (radius - y) * np.cos(angle)])

    mesh = MeshBeam.init_curve(curve, np.linspace(0.0, 1.0, n + 1), height=height)
    beam = Beam(mesh, element, StVenantKirchhoff(E=E, nu=0.3), B)
    state = Scene(beam).clamp("left").moment("right", 2e-4).solve_static()
    return state.stress(curve(np.array([0.3, 0.45, 0.48, 0.49, 0.51, 0.52, 0.55, 0.7]), y))[0]


@pytest.mark.parametrize("element, n", [(ElementBeamANCF(2), 16), (ElementBeamANCF(3), 16),
                                        (ElementBeamCable(5), 32), (ElementBeamANCFCubic(2), 8),
                                        (ElementBeamANCFCubic(2), 64),
                                        (ElementBeamANCFCubic(3), 16),
                                        (ElementBeamANCFHermite(2), 16)], ids=repr)
def test_a_line_that_becomes_an_arc(element, n):
    """Each is bent as if it were alone, the arc as Winkler says."""
    height, radius, y = 0.1, 0.25, 0.045
    neutral = height / np.log((radius + height / 2) / (radius - height / 2))
    straight = -2e-4 * y / (B * height**3 / 12)
    bent = 2e-4 * (radius - y - neutral) / (B * height * (radius - neutral) * (radius - y))
    assert_allclose(hook(element, n), 4 * [straight] + 4 * [bent], rtol=1e-2)


def test_short_elements_see_the_layer_between_a_line_and_an_arc():
    """That of the plane body: stock scikit-fem, 64 x 6 isoparametric quads of order 3."""
    plane = [-2.160, -2.154, -2.183, -2.221, -2.344, -2.383, -2.418, -2.412]
    assert_allclose(hook(ElementBeamANCF(3), 32), plane, rtol=1.2e-2)


def test_smooth_functions_do_not_jump():
    scene = cantilever(ElementBeamANCF(3), lambda x, y: E * np.exp(3.0 * x),
                       lambda x, y: B * (1.0 + x * x), lambda x: H * np.cos(x))
    scene = scene.temperature(lambda x, y: 10.0 * np.sin(9.0 * x)).line_load(
        lambda x: np.array([x[0], np.sin(9.0 * x[0])]))
    state = scene.solve_static()
    assert list(state.recovery().forces.cuts) == [0.0, 16.0]


# jumps inside elements


def patch(x):
    """A load from 0.1234 to 0.4321, which grows along x, in elements of 0.2."""
    return np.array([0.0 * x[0], -(1.0 + x[0]) * ((x[0] > 0.1234) & (x[0] < 0.4321))])


@pytest.mark.parametrize("kind", ["force", "force in time", "traction"])
@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCF(3), ElementBeamCable(3),
                                     ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=repr)
def test_a_load_may_begin_and_end_inside_elements(element, angle, kind):
    """Its section forces are integrals of it, in linear and in static solutions."""
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 6), height=H, angle=angle)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    scene = Scene(Beam(mesh, element, StVenantKirchhoff(1e9, 0.3), B)).clamp("left")

    def turned(x):
        return np.tensordot(turn, patch(np.tensordot(turn.T, x, 1)), 1)

    if kind == "traction":
        scene.traction("top", lambda x: turned(x) / B)
    elif kind == "force":
        scene.line_load(turned)
    else:
        scene.line_load(lambda x, t: t * turned(x))
    x = np.array([0.0, 0.1, 0.123, 0.13, 0.25, 0.35, 0.41, 0.43, 0.44, 0.8])
    a, b = np.clip(x, 0.1234, 0.4321), 0.4321
    Q = (b + b**2 / 2) - (a + a**2 / 2)
    M = -((b**2 / 2 + b**3 / 3) - (a**2 / 2 + a**3 / 3) - x * Q)
    for state, rtol in ((scene.solve_linear(), 1e-10), (scene.solve_static(), 1e-5)):
        assert state.recovered == {0: ""}
        found = state.resultants(turn @ np.array([x, 0.0 * x]))
        assert_allclose(found.M, M, atol=rtol * np.max(-M))
        assert_allclose(np.abs(found.Q), Q, atol=rtol * np.max(Q))
        assert_allclose(turn.T @ state.reactions("left").force, [0.0, Q[0]], atol=1e-9 * Q[0])


def test_the_stress_under_a_load_that_ends_inside_an_element():
    """S_yy at the face, and S_xx by the bending moment on both sides of the place."""
    q, a = 50.0, 0.53
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 9), height=H)
    scene = Scene(Beam(mesh, ElementBeamANCF(3), StVenantKirchhoff(1e9, 0.0), B)).clamp("left")
    scene.traction("top", lambda x: np.array([0.0 * x[0], -q * (x[0] < a)]))
    x = np.array([0.3, 0.45, 0.527, 0.533, 0.6])
    S = scene.solve_linear().stress(np.array([x, 0.0 * x + H / 2]))
    assert_allclose(S[1], -q * (x < a), atol=2e-2 * q)
    bent = 0.5 * q * B * np.maximum(a - x, 0.0)**2 / (B * H**3 / 12) * H / 2
    assert_allclose(S[0], bent, atol=1e-3 * bent[0] + 0.25 * q)


def test_a_load_that_moves_over_a_bridge_is_right_at_every_instant():
    """A patch of 0.17 on a hinged beam: reactions and bending moment by the lever."""
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 5), height=0.02)
    beam = Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(1e9, 0.3), 0.02)
    scene = Scene(beam).pin("left").fix("right", "r^2").line_load(
        lambda x, t: np.array([0.0 * x[0], -1.0 * (np.abs(x[0] - t) < 0.085)]))
    history = scene.run(np.linspace(0.1, 0.9, 8), increments=1)
    centre, size = history.t[1:], 0.17
    expected = np.array([size * (1.0 - centre), size * centre]).T
    found = np.array([history.reactions(end).force[1:, 1] for end in ("left", "right")]).T
    assert_allclose(found, expected, rtol=1e-6)
    M = history.resultants((0.5, 0)).M[1:]
    inside = np.array([quad(lambda s: max(0.5 - s, 0.0), c - 0.085, c + 0.085, points=[0.5])[0]
                       for c in centre])
    assert_allclose(M, expected[:, 0] * 0.5 - inside, rtol=1e-5)
