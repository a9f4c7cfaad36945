"""Forms of scikit-fem as loads, dead and not, against stock assembly, closed forms and others."""

import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import BilinearForm, LinearForm, asm
from skfem.helpers import div, dot

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, Scene, StVenantKirchhoff)

MATERIAL = StVenantKirchhoff(2e8, 0.0, 1000.0)
HEIGHT, WIDTH = 0.01, 0.02


def cantilever(n=8, element=None):
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, n + 1), HEIGHT)
    beam = Beam(mesh, element or ElementBeamANCFCubic(2), MATERIAL, WIDTH)
    return Scene(beam).clamp("left", thickness="free")


def arc():
    mesh = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                               np.linspace(0.0, 2.0, 5), 0.1)
    return Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 1000.0), 0.1)


def moved(beam):
    return 1e-2 * beam.sizes * np.cos(np.arange(beam.N))


@LinearForm
def swell(v, w):
    return w.r[1] * v[0] + w.r[0]**2 * div(v) + w.r.grad[0, 1] * v.grad[1, 0]


@BilinearForm
def swelling(u, v, w):
    return u[1] * v[0] + 2.0 * w.r[0] * u[0] * div(v) + u.grad[0, 1] * v.grad[1, 0]


@pytest.mark.parametrize("boundary", [None, "top", "right"])
def test_forces_and_tangents_are_those_of_stock_assembly(boundary):
    beam = arc()
    basis = beam.exact_basis() if boundary is None else beam.facet_basis(boundary)
    u = moved(beam)
    for tangent in (None, swelling):
        load, = Scene(beam).load(swell, boundary, tangent=tangent).loads
        force, K = asm(swell, basis, r=beam.q0 + u), asm(swelling, basis, r=beam.q0 + u).toarray()
        found = np.zeros_like(K)
        i, j, v = load.stiffness(u)
        np.add.at(found, (i, j), v)
        assert_allclose(load.force(u), force, rtol=0, atol=1e-12 * np.abs(force).max())
        # of differences of second order in the step
        assert_allclose(found, K, rtol=0, atol=(1e-12 if tangent else 1e-8) * np.abs(K).max())


@pytest.mark.parametrize("boundary", [None, "bottom", "left"])
def test_a_dead_form_is_assembled_as_by_scikit_fem(boundary):
    @LinearForm
    def form(v, w):
        return w.x[0] * v[1] - 0.3 * v.grad[0, 1] + (w.n[0] * v[0] if boundary else 0.0)

    beam = arc()
    basis = beam.exact_basis() if boundary is None else beam.facet_basis(boundary)
    scene = Scene(beam).load(form, boundary)
    found, exact = scene.system.external_force(moved(beam)), asm(form, basis)
    assert_allclose(found, exact, rtol=0, atol=1e-13 * np.abs(exact).max())


def test_a_pressure_as_a_form():
    """Nanson: n da = det F F^-T N dA; it follows the surface."""
    @LinearForm
    def pressure(v, w):
        F = w.F
        n = np.array([F[1, 1] * w.n[0] - F[1, 0] * w.n[1], F[0, 0] * w.n[1] - F[0, 1] * w.n[0]])
        return -80.0 * WIDTH * dot(n, v)

    a, b = cantilever().pressure("top", 80.0), cantilever().load(pressure, "top")
    path = b.continuation(ds=0.2, max_load=1.0)
    for state in (b.solve_static(), path.state(-1)):
        assert_allclose(state.u, a.solve_static().u, rtol=0, atol=1e-6)
    assert a.solve_static().displacement((1, 0))[1] < -0.2


@pytest.mark.parametrize("given", [True, False])
def test_the_column_of_beck_flutters(given):
    """A force along the tangent of the end: flutter at 20.05 EI / L^2 (Beck 1952)."""
    EI = MATERIAL.E * WIDTH * HEIGHT**3 / 12

    def follower(factor):
        size = factor * EI / HEIGHT
        form = LinearForm(lambda v, w: -size * dot(w.F[:, 0], v))
        tangent = BilinearForm(lambda u, v, w: -size * dot(u.grad[:, 0], v)) if given else None
        scene = cantilever(8).load(form, "right", tangent=tangent)
        return scene.modes(2, scene.solve_static(stable=False))

    assert not follower(19.9).flutter and follower(20.3).flutter


def test_it_moves_with_time():
    """A wind that grows as t, on a body that is free: the centre moves as a t^3 / 6."""
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 5), HEIGHT)
    scene = Scene(Beam(mesh, ElementBeamANCF(2), MATERIAL, WIDTH))
    scene.load(LinearForm(lambda v, w: 1000.0 * WIDTH * w.t * v[1]))
    history = scene.integrate(0.4, 0.01)
    assert_allclose(history.displacement((0.5, 0.0))[:, 1], history.t**3 / 6, rtol=0, atol=1e-5)
    assert cantilever(2).load(LinearForm(lambda v, w: w.t * v[1])).solve_static().u.max() == 0.0


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau"])
def test_a_spring_as_a_form_vibrates(scheme):
    """On a bedding alone, a mass on a spring: cos(sqrt(k / m) t)."""
    k = 1e5
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 5), HEIGHT)
    scene = Scene(Beam(mesh, ElementBeamANCF(2), MATERIAL, WIDTH))
    scene.load(LinearForm(lambda v, w: -WIDTH * k * dot(w.r - w.x, v)))
    history = scene.initial_velocity((0.0, 1.0)).integrate(0.5, 2e-3, scheme=scheme)
    omega = np.sqrt(k / 1000.0)
    assert_allclose(history.displacement((0.5, 0.0))[:, 1], np.sin(omega * history.t) / omega,
                    rtol=0, atol=2e-4)


def test_a_bedding_as_a_form_is_not_scaled():
    """The column on a bedding of tests/test_energy.py, by forms."""
    k = 15.0 * np.pi**4 * MATERIAL.E * HEIGHT**2 / 12  # per volume
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 17), HEIGHT)
    scene = Scene(Beam(mesh, ElementBeamANCFCubic(2), MATERIAL, WIDTH))
    scene.pin("left").fix("right", "r^2").point_force((-1.0, 0.0), at=(1.0, 0.0))
    scene.load(LinearForm(lambda v, w: -k * WIDTH * (w.r[1] - w.x[1]) * v[1]), scaled=False)
    EI = MATERIAL.E * WIDTH * HEIGHT**3 / 12
    force = EI * (2 * np.pi)**2 + 15.0 * np.pi**4 * EI / (2 * np.pi)**2
    assert scene.buckling(1).factors[0] == pytest.approx(force, rel=2e-3)


def test_differences_are_said(caplog):
    with caplog.at_level(logging.INFO):
        cantilever(2).load(swell)
    assert "by differences" in caplog.text


@pytest.mark.parametrize("form, options, words", [
    (swell, dict(tangent=BilinearForm(lambda u, v, w: u[1] * v[0])), "not the derivative"),
    (swell, dict(tangent=lambda u, v, w: 0.0), "must be a scikit-fem BilinearForm"),
    (swell, dict(tangent=BilinearForm(lambda u, v, w: w.q * v[0])), "uses w.q"),
    (LinearForm(lambda v, w: w.r), {}, "must return a real number at each point"),
    (LinearForm(lambda v, w: 1j * w.r[0] * v[0]), {}, "must return a real number"),
])
def test_what_is_no_load_is_said(form, options, words):
    with pytest.raises(InputError, match=words):
        cantilever(2).load(form, **options)


def test_a_cable_takes_dead_forms_alone():
    scene = cantilever(2, ElementBeamCable(5)).load(LinearForm(lambda v, w: w.x[0] * v[1]))
    with pytest.raises(InputError, match="elements with sections"):
        scene.load(swell)
