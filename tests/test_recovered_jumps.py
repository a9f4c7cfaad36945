"""Recovered fields where a modulus, a width, a temperature, a height or a load jumps at a node."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

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
