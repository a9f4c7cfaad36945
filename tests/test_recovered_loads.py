"""Recovered fields under forms, foundations, drag and damping: closed forms and free bodies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import LinearForm

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, KelvinVoigt,
                        MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.beam.distribution import Distribution
from skfem_ancf.core.quadrature import gauss
from skfem_ancf.recovery.section_forces import SectionForces

E, NU, RHO, H, B, G = 2e8, 0.3, 7800.0, 0.01, 0.02, 9.81
ELEMENTS = [ElementBeamANCF(2), ElementBeamANCF(3), ElementBeamANCFCubic(2), ElementBeamCable(5)]
IDS = ["2", "3", "cubic", "cable"]
POINTS = np.array([[0.3, 0.5, 0.71], [0.002, -0.003, 0.0041]])


def beam_of(element=ELEMENTS[1], n=16, density=RHO, **options):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), height=H)
    return Beam(mesh, element, StVenantKirchhoff(E, NU, density), width=B, **options)


def held(*args, **options):
    return Scene(beam_of(*args, **options)).clamp("left")


def balanced(state):
    """The section at the clamp has the force and the moment of the support, the free end none."""
    assert state.recovered == {0: ""}
    r, support = state.resultants(), state.reactions("left")
    size = np.abs(r.force).max(), np.abs(r.M).max()
    assert_allclose(r.force[:, 0], -support.force, atol=1e-8 * size[0])
    assert_allclose(r.M[0], -support.moment, atol=1e-8 * size[1])
    assert_allclose([*r.force[:, -1], r.M[-1]], 0.0, atol=1e-8 * size[0])


@pytest.mark.parametrize("element", ELEMENTS, ids=IDS)
def test_forms_are_spread_as_the_loads_that_they_say(element):
    weight = LinearForm(lambda v, w: -G * RHO * B * v[1])
    push = LinearForm(lambda v, w: B * (20.0 * w.x[0] * v[0] - 100.0 * v[1]))
    for known, form in ((held(element).gravity((0, -G)), held(element).load(weight)),
                        (held(element).traction("top", lambda x: [20.0 * x[0], -100.0 + 0 * x[0]]),
                         held(element).load(push, "top"))):
        known, form = known.solve_static(), form.solve_static()
        assert form.recovered == {0: ""}
        for ask in ("strain", "stress"):
            expected = getattr(known, ask)(POINTS)
            assert_allclose(getattr(form, ask)(POINTS), expected,
                            atol=1e-7 * np.abs(expected).max())
        balanced(form)


@pytest.mark.parametrize("element", ELEMENTS[:3], ids=IDS[:3])
def test_normal_stress_across_under_a_body_force_that_varies_across(element):
    """S_yy from dS_yy/dY = -b_y - dS_xy/dX, S_xy the parabola of Q."""
    b, c = -0.04, 30.0  # force per volume b + c Y, small
    form = LinearForm(lambda v, w: B * (b + c * w.x[1]) * v[1])
    state = held(element, n=32).load(form).solve_static()
    Y = np.linspace(-0.5, 0.5, 9) * H
    q = b * H  # per width and length
    exact = (-b * Y - 0.5 * c * (Y**2 - 0.25 * H**2)
             + q * (6.0 / H**3) * (0.25 * H**2 * Y - Y**3 / 3.0))
    found = state.stress(np.array([0.0 * Y + 0.45, Y]))[1]
    assert_allclose(found, exact, atol=2e-3 * np.abs(exact).max())


@pytest.mark.parametrize("element", ELEMENTS, ids=IDS)
@pytest.mark.parametrize("one_sided", [False, True])
def test_a_foundation_presses_the_face(element, one_sided):
    k = 1e5
    scene = held(element, n=32).gravity((0, -G)).foundation(k, one_sided=one_sided)
    state = scene.solve_static()
    balanced(state)
    at = np.array([[0.3, 0.5, 0.7, 0.9], 4 * [-0.5 * H]])
    pressed = k * state.displacement(at)[1]
    assert_allclose(state.stress(at)[1], pressed, rtol=3e-3)
    assert np.abs(state.stress(at + [[0.0], [H]])[1]).max() < 1e-3 * np.abs(pressed).max()


@pytest.mark.parametrize("element", ELEMENTS, ids=IDS)
def test_moment_of_an_endless_beam_on_a_foundation(element):
    """Hetenyi: M = P / (4 beta) under the force, beta^4 = k / (4 E I)."""
    k, P = 400.0, 1e-3
    EI = E * B * H**3 / 12.0
    beta = (k / (4.0 * EI)) ** 0.25
    mesh = MeshBeam.init_line(np.linspace(-2, 2, 129), height=H)
    beam = Beam(mesh, element, StVenantKirchhoff(E, 0.0), width=B)
    scene = Scene(beam).fix((0, 0), "r^1").point_force((0, -P), at=(0, 0)).foundation(k / B)
    state = scene.solve_static()
    assert state.recovered == {0: ""}
    x = np.array([0.0, 0.1, 0.3, 0.5])
    exact = P / (4 * beta) * np.exp(-beta * x) * (np.cos(beta * x) - np.sin(beta * x))
    assert_allclose(state.resultants(np.array([x, 0 * x])).M, exact, atol=5e-3 * exact[0])


TAU, END = 0.02, 0.04


def rising(t):
    return t / END


def crept(t):
    """What tau d(strain)/dt + strain = t / END has grown to."""
    return (t - TAU * (1.0 - np.exp(-t / TAU))) / END


@pytest.mark.parametrize("element", ELEMENTS, ids=IDS)
def test_creep_of_a_light_bar_and_a_light_beam(element):
    """A load that rises, on springs and dashpots side by side."""
    F, moment, y, times = 3.0, 1e-3, 0.004, np.array([0.01, 0.02, END])
    for load, exact, total in (
            (lambda s: s.traction("right", (F / (B * H), 0), amplitude=rising), F / (E * B * H),
             ("N", F)),
            (lambda s: s.moment("right", moment, amplitude=rising),
             -12 * moment * y / (E * B * H**3), ("M", moment))):
        scene = load(held(element, density=1e-2, damping=KelvinVoigt(TAU)))
        history = scene.integrate(END, 1e-4, scheme="generalized-alpha", t_eval=times)
        for t, state in zip(times, history):
            assert state.recovered == {0: ""}
            strain = state.strain((0.5, y))
            assert_allclose(strain[:2], [exact * crept(t), -NU * exact * crept(t)], rtol=4e-3)
            section = getattr(state.resultants((0.5, 0)), total[0])
            assert_allclose(section, total[1] * rising(t), rtol=4e-3)


@pytest.mark.parametrize("element", ELEMENTS, ids=IDS)
def test_shear_stress_of_a_beam_that_creeps(element):
    """The elastic part of the parabola of Q grows as the strain does."""
    Q = 0.01
    scene = held(element, density=1e-2, damping=KelvinVoigt(TAU)).point_force(
        (0, -Q), at=(1, 0), amplitude=rising)
    state = scene.integrate(END, 1e-4, scheme="generalized-alpha").state(-1)
    assert_allclose(state.resultants((0.5, 0)).Q, -Q, rtol=5e-3)
    y = np.array([0.0, 0.002])
    exact = -1.5 * Q / (B * H) * crept(END) * (1 - (2 * y / H) ** 2)
    assert_allclose(state.stress(np.array([0 * y + 0.5, y]))[2], exact, rtol=1e-2)


@pytest.mark.parametrize("element", ELEMENTS[:3], ids=IDS[:3])
def test_section_force_of_a_damped_beam_is_that_of_the_part_behind_it(element):
    """Inertia, damping of the mass and drag of the rest, integrated here."""
    alpha, q = 3.0, 0.5 * 5.0 * 1.2
    scene = held(element, n=8).gravity((0, -G)).damping(mass=alpha).drag(5.0, 1.2)
    state = scene.integrate(0.05, 1e-3, scheme="generalized-alpha").state(-1)
    beam = scene.beams[0]
    x, w = gauss(8)
    elements, total = np.arange(4, 8), np.zeros(2)
    axis = np.array([x, 0 * x + 0.5])
    v = beam.displacements(state.v, axis, elements)
    slope, frame = beam.gradients(state.u, axis, elements)
    t = (slope + frame)[:, 0] / np.sqrt(np.sum((slope + frame)[:, 0] ** 2, axis=0))
    across = v[1] * t[0] - v[0] * t[1]
    total -= np.sum(w * q * B * np.abs(across) * across * np.array([-t[1], t[0]]), axis=(1, 2)) / 8
    for eta, weight in zip(*gauss(5)):
        X = np.array([x, 0 * x + eta])
        a, v = (beam.displacements(z, X, elements) for z in (state.acceleration, state.v))
        total -= weight * RHO * B * H / 8 * np.sum(w * (a + alpha * v), axis=(1, 2))
    total += [0.0, -G * RHO * B * H / 2]
    assert_allclose(state.resultants((0.5, 0)).force, total, atol=1e-4 * np.abs(total).max())


def test_what_touches_a_beam_a_little_beyond_its_end_acts_there():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.1), ElementBeamANCF(2),
                StVenantKirchhoff(E=1e6, nu=0.0), width=0.1)
    state = Scene(beam).clamp("left").point_force((3.0, 0.0), at=(1, 0)).solve_static()
    found = SectionForces(beam, state.u, [(1.0, Distribution(stations=(4.1,)))], stations=(-0.1,))
    assert found.cuts.tolist() == [0.0, 4.0]
    R, M = found.at(np.array([2]), np.array([0.3]), np.zeros(1))
    assert_allclose(R[:, 0], [3.0, 0.0], atol=1e-8)
    assert abs(M[0]) < 1e-8
