"""Thicknesses that stay on tapers: against integrals of beam theory and the plane body."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_sections import BRASS, FOAM, PLAIN, STEEL, H, cantilever, plane, plane_stress

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, Scene, Section)
from skfem_ancf.core.quadrature import gauss
from skfem_ancf.formulations import Formulation, Term

P = 1e-2
ELEMENTS = {"order 2": ElementBeamANCF(2), "cubic": ElementBeamANCFCubic(2),
            "cubic 3": ElementBeamANCFCubic(3), "quintic cable": ElementBeamCable(5)}
every = pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS)
few = pytest.mark.parametrize("element", list(ELEMENTS.values())[1::2], ids=list(ELEMENTS)[1::2])


def height(x):
    return H * (1.0 - 0.5 * x)


def taper(n=16, h=height):
    return MeshBeam.init_line(np.linspace(0, 1, n + 1), height=h)


#: From the bottom: where it ends, as (a, b) of a h + b, and material and width of a piece.
I, T = (Section.profile(name, width=0.06, web=0.01, flange=0.01) for name in "IT")
SECTIONS = {
    "I": (I, STEEL, [(-0.5, 0.01, STEEL, 0.06), (0.5, -0.01, STEEL, 0.01), (0.5, 0, STEEL, 0.06)]),
    "T": (T, STEEL, [(0.5, -0.01, STEEL, 0.01), (0.5, 0, STEEL, 0.06)]),
    "box": (Section.profile("box", width=0.06, wall=0.01), STEEL,
            [(-0.5, 0.01, STEEL, 0.06), (0.5, -0.01, STEEL, 0.02), (0.5, 0, STEEL, 0.06)]),
    "coating": (Section.layers((None, BRASS), (0.005, STEEL), width=0.02), None,
                [(0.5, -0.005, BRASS, 0.02), (0.5, 0, STEEL, 0.02)]),
    "core": (Section.layers((0.01, STEEL), (None, FOAM, 0.05), (0.005, STEEL), width=0.02), None,
             [(-0.5, 0.01, STEEL, 0.02), (0.5, -0.005, FOAM, 0.05), (0.5, 0, STEEL, 0.02)]),
}
sections = pytest.mark.parametrize("section, material, pieces", SECTIONS.values(), ids=SECTIONS)


def breaks(pieces):
    """Where the pieces begin and end, (npieces + 1, n), for x (n,)."""
    return lambda x: np.array([-0.5 * height(x), *(a * height(x) + b for a, b, _, _ in pieces)])


def integral(pieces, x, k, of):
    """Of ``of(material)`` Y^k over the section, at x (n,)."""
    y = breaks(pieces)(x)
    return sum(of(law) * width * (top**(k + 1) - low**(k + 1)) / (k + 1)
               for low, top, (_, _, law, width) in zip(y[:-1], y[1:], pieces))


@every
@sections
def test_mass_and_turning_inertia_are_exact(element, section, material, pieces):
    beam = Beam(taper(6), element, material, section=section)
    x, w = gauss(20)
    mass, first, second = (w * integral(pieces, x, k, lambda law: law.density) for k in range(3))
    assert beam.total_mass == pytest.approx(np.sum(mass), rel=1e-13)
    q = beam.q0.reshape(-1, 2)
    spin = np.stack([-q[:, 1], q[:, 0]], 1).ravel()
    assert spin @ (beam.mass() @ spin) == pytest.approx(np.sum(mass * x**2 + second), rel=1e-12)
    assert beam.weight((0, -2.0)) @ beam.rigid_motions()[:, 1] == pytest.approx(-2 * np.sum(mass))
    assert -beam.weight((-1.0, 0.0)) @ spin == pytest.approx(-np.sum(first), abs=1e-12 * mass.sum())
    k, u = beam.kernel, 1e-3 * np.random.default_rng(1).standard_normal((2, beam.N))
    change = np.imag(k.force(u[0] + 1e-30j * u[1])) / 1e-30
    K = np.einsum("eij,ej->ei", k.tangents(u[0]), k.gather(u[1]).reshape(6, -1))
    assert_allclose(k.scatter(K.reshape(6, -1, 2)), change, atol=1e-11 * np.abs(change).max())
    turned = (q @ np.array([[np.cos(1), np.sin(1)], [-np.sin(1), np.cos(1)]]) - q).ravel()
    assert np.abs(k.force(turned)).max() < 1e-9 * np.abs(k.tangents(0 * turned)).max()


def theory(h, flange, width, web):
    """E I and mass per length of a T or an I by their flanges: (E I) of the whole about its own."""
    y = [-h / 2, h / 2 - flange, h / 2]
    A, S, second = (sum(b * (top**(k + 1) - low**(k + 1)) / (k + 1) for low, top, b in zip(
        y[:-1], y[1:], (web, width))) for k in range(3))
    return PLAIN.E * (second - S**2 / A)


@pytest.mark.parametrize("element, n, error", [
    (ElementBeamCable(5), 12, 2e-7), (ElementBeamANCFCubic(2), 32, 1e-6),
    (ElementBeamANCF(2), 64, 1e-4)], ids=["cable", "cubic", "order 2"])
@pytest.mark.parametrize("ratio", [1e3, 1e4])
def test_a_slender_tapered_T_is_a_beam(element, n, error, ratio):
    h = 1.0 / ratio
    sizes = dict(flange=0.15 * h, width=0.6 * h, web=0.1 * h)
    EI = 1e-4 * theory(h, **sizes)
    x, w = gauss(60)
    tip = np.sum(w * EI * (1 - x)**2 / np.array([theory(h * (1 - z / 2), **sizes) for z in x]))
    beam = Beam(taper(n, lambda x: h * (1 - 0.5 * x)), element, PLAIN,
                section=Section.profile("T", **sizes))
    state = cantilever(beam, (0.0, -EI))
    assert -state.displacement((1, 0))[1] == pytest.approx(tip, rel=error)
    assert state.iterations <= 12


@pytest.mark.parametrize("name", ["I", "T", "coating", "core"])
def test_stress_is_that_of_the_plane_body(name):
    """At Gauss points of Q2 elements; sections meet oblique faces and layers there."""
    section, material, pieces = SECTIONS[name]
    ends, place = breaks(pieces), 0.5 + (0.5 - 0.75**0.5 / 3) / 150
    _, basis, u = plane([(0, 0, law, b) for _, _, law, b in pieces], 1.0, (0.0, -P), (150, 4), ends)
    inside = np.add.outer(np.arange(4), [0.5 - 0.75**0.5 / 3, 0.5 + 0.75**0.5 / 3]).ravel() / 4
    y = ends(np.array([place]))[:, 0]
    Y = np.concatenate([a + (b - a) * inside for a, b in pairwise(y)])
    x = np.array([place + 0.0 * Y, Y])
    exact = plane_stress(basis, u, x, [(0, 0, law, b) for _, _, law, b in pieces], ends)
    tip = basis.probes(np.array([[1 - 1e-12], [0.0]])) @ u
    for element in ELEMENTS.values():
        state = cantilever(Beam(taper(), element, material, section=section), (0.0, -P))
        assert state.recovered == {0: ""}
        found = state.stress(x)
        assert_allclose(found[0], exact[0], atol=5e-4 * np.abs(exact[0]).max())
        assert_allclose(found[2], exact[2], atol=1e-3 * np.abs(exact[2]).max())
        assert_allclose(found[1], exact[1], atol=1e-3 * np.abs(exact[2]).max())
        assert_allclose([state.stress(p) for p in x.T[::5]], found[:, ::5].T, rtol=1e-9,
                        atol=1e-9 * np.abs(found).max())
        own, r = state.stress(x, recover=False), state.resultants((0.5, 0.0), recover=False)
        assert np.abs(own[0] - exact[0]).max() < 0.05 * np.abs(exact[0]).max()
        assert r.M == pytest.approx(-0.5 * P, rel=2e-2)
        assert_allclose([state.stress(p, recover=False) for p in x.T[::5]], own[:, ::5].T,
                        atol=1e-9 * np.abs(own).max())
        if FOAM not in [law for _, _, law, _ in pieces]:  # whose shear depends on the inclination
            error = {0: 0.02, 2: 0.01, 3: 2e-3}[element.order]
            assert state.displacement((1, 0))[1] == pytest.approx(tip[1], rel=error)
        elif element.order == 3:
            assert state.displacement((1, 0))[1] == pytest.approx(tip[1], rel=1e-2)


@few
def test_a_heated_coating_bends_a_blade_by_its_own_curvature(element):
    """Timoshenko's curvature of each section, twice integrated."""
    cold, hot = STEEL.replace(thermal_expansion=12e-6, nu=0.0), PLAIN.replace(
        E=5e7, thermal_expansion=30e-6)
    section = Section.layers((None, cold), (0.001, hot), width=0.02)
    h = 0.01
    beam = Beam(taper(16, lambda x: h * (1 - 0.5 * x)), element, section=section)
    state = Scene(beam).clamp("left").temperature(10.0).solve_static()
    x, w = gauss(40)
    curvature = []
    for height in h * (1 - 0.5 * x):
        y = [-height / 2, height / 2 - 0.001, height / 2]
        m = np.array([[law.E * (b**k - a**k) / k for k in (1, 2, 3)]
                      for law, a, b in zip((cold, hot), y, y[1:])])
        A = np.sum(m, axis=0)
        push = 10 * (cold.thermal_expansion * m[0] + hot.thermal_expansion * m[1])
        _, slope = np.linalg.solve([[A[0], A[1]], [A[1], A[2]]], push[:2])
        curvature.append(-slope)
    assert state.displacement((1, 0))[1] == pytest.approx(np.sum(w * curvature * (1 - x)), rel=2e-4)


class Few(Formulation):
    """With a rule across that does not know the section."""

    name = "few"

    def terms(self, element, material):
        return [Term(material.law(), gauss(4), gauss(3))]


@pytest.mark.parametrize("make, words", [
    (lambda: Beam(taper(), ElementBeamANCF(2), STEEL, section=I, formulation=Few()).kernel,
     "rule of .*thicknesses stay.*full_rules"),
    (lambda: Section.layers((None, STEEL), (None, BRASS), width=1.0), "only one layer"),
    (lambda: Beam(taper(), ElementBeamANCF(2), section=Section.layers(
        (0.05, STEEL), (0.05, BRASS), width=1.0)), "give one layer the thickness None"),
    (lambda: Beam(taper(), ElementBeamANCF(2), section=Section.layers(
        (None, STEEL), (0.06, BRASS), width=1.0)), "height of 0.05 leave nothing"),
    (lambda: Beam(MeshBeam.init_line([0, 1], height=0.05), ElementBeamANCF(2),
                  section=Section.layers((None, STEEL), (0.06, BRASS), width=1.0)), "nothing for"),
    (lambda: Beam(taper(), ElementBeamANCF(2), STEEL, section=Section.profile(
        "I", width=0.06, web=0.01, flange=0.03)), "do not fit in a height of 0.05"),
    (lambda: Beam(taper(), ElementBeamANCF(1), STEEL, section=I).kernel, "order 2 or more"),
    (lambda: Beam(taper(), ElementBeamANCF(2), STEEL, section=I,
                  formulation="strain-split").kernel, "does not fit a taper"),
])
def test_errors_teach(make, words):
    with pytest.raises(InputError, match=words):
        make()
