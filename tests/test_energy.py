"""Energies of one's own, against closed forms and differential equations solved by SciPy."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp, trapezoid
from scipy.optimize import minimize_scalar

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, Energy,
                        InputError, MeshBeam, MissingExtra, Scene, StVenantKirchhoff,
                        check_derivatives)

MATERIAL = StVenantKirchhoff(2e8, 0.0, 1000.0)


def cantilever(n=16, height=0.005, width=0.01, element=None, material=MATERIAL):
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, n + 1), height)
    beam = Beam(mesh, element or ElementBeamANCFCubic(2), material, width)
    return Scene(beam).clamp("left", thickness="free")


def stiffness(height, width):
    return MATERIAL.E * width * height**3 / 12


# closed forms


@pytest.mark.parametrize("over", ["axis", "cells", "bottom"])
def test_a_long_beam_on_an_elastic_bedding(over):
    """Hetenyi, "Beams on elastic foundation" (1946): a force at the end of a half-infinite beam."""
    height, width, force = 0.001, 0.01, 1e-6
    k = 4.0 * 10.0**4 * stiffness(height, width)
    size = {"axis": k, "cells": k / (width * height), "bottom": k / width}[over]
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 41), height)
    scene = Scene(Beam(mesh, ElementBeamANCFCubic(2), MATERIAL, width)).clamp("right")
    scene.energy(lambda r, F, X, t: 0.5 * size * ((r - X)**2).sum(axis=0), over=over)
    state = scene.point_force((0.0, force), at=(0.0, 0.0)).solve_static()
    x = np.linspace(0.0, 0.5, 6)
    found = state.displacement(np.array([x, 0.0 * x]))[1]
    assert_allclose(found, 2.0 * force * 10.0 / k * np.exp(-10.0 * x) * np.cos(10.0 * x),
                    rtol=0, atol=2e-3 * found[0])


def test_a_gravity_potential_is_gravity():
    def weight(r, F, X, t):
        return 1000.0 * 9.81 * r[1]

    one, two = cantilever().gravity((0.0, -9.81)), cantilever().energy(weight)
    for solve in ("solve_linear", "solve_static"):
        a, b = getattr(one, solve)(), getattr(two, solve)()
        assert_allclose(b.u, a.u, rtol=0, atol=1e-10 * np.abs(a.u).max())
    one, two = cantilever(4, 0.05).gravity((0.0, -9.81)), cantilever(4, 0.05).energy(weight)
    a, b = (s.integrate(0.02, 1e-3) for s in (one, two))
    assert_allclose(b.u, a.u, rtol=0, atol=1e-8 * np.abs(a.u).max())
    assert_allclose(b.total_energy - b.total_energy[0], 0.0, atol=1e-9 * b.kinetic_energy.max())


def arch(element):
    mesh = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                               np.linspace(0.0, 2.0, 7), height=0.1)
    beam = Beam(mesh, element, StVenantKirchhoff(2e8, 0.3, 1000.0), width=0.1)
    return Scene(beam).clamp("left")


@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCFCubic(3)])
def test_a_gravity_potential_of_an_arch(element):
    a = arch(element).gravity((0.0, -9.81)).solve_static()
    b = arch(element).energy(lambda r, F, X, t: 9810.0 * r[1]).solve_static()
    assert_allclose(b.u, a.u, rtol=0, atol=1e-9 * np.abs(a.u).max())


@pytest.mark.parametrize("over", ["cells", "axis", "top", "right"])
def test_the_gradient_is_that_of_the_place(over):
    """Of a bent arch r is the place of the state, and F the differences of that."""
    seen = []

    def look(r, F, X, t):
        if not np.iscomplexobj(r):
            seen.append((r, F, X))
        return 0.0 * r[0]

    scene = arch(ElementBeamANCF(2)).gravity((0.0, -9.81)).energy(look, over=over)
    state = scene.solve_static()
    item, = (one for one in scene.system.loads if hasattr(one, "psi"))
    seen.clear()
    item.potential(state.u)
    r, F, X = seen[-1]
    flat = X.reshape(2, -1)
    assert_allclose(r.reshape(2, -1), state.position(flat), rtol=0, atol=1e-9)
    if over == "cells":
        step = 1e-5 * np.eye(2)[:, :, None]
        slopes = [(state.position(flat + d) - state.position(flat - d)) / 2e-5 for d in step]
        assert_allclose(F.reshape(2, 2, -1), np.stack(slopes, axis=1), rtol=0, atol=1e-5)


def test_a_magnetic_rod_buckles_in_an_opposing_field():
    """Magnetised along its axis, -B . F M is -A M B . (r(L) - r(0)): the column of Euler.

    Zhao, Kim, Cheng, Zhao: "Mechanics of hard-magnetic soft materials", Journal of the Mechanics
    and Physics of Solids 124 (2019).
    """
    height, width, M = 0.005, 0.01, 1e4
    field = np.pi**2 / 4.0 * stiffness(height, width) / (width * height * M)
    scene = cantilever(height=height, width=width)
    scene.energy(lambda r, F, X, t: field * M * F[0, 0])
    assert scene.buckling(1).factors[0] == pytest.approx(1.0, abs=1e-4)


def pull_in():
    """The largest load of w'''' = load / (1 - w)^2 of a cantilever, over the deflection of its end.
    """
    x = np.linspace(0.0, 1.0, 41)

    def load(tip):
        found = solve_bvp(lambda x, y, p: np.array([y[1], y[2], y[3], p[0] / (1.0 - y[0])**2]),
                          lambda a, b, p: np.array([a[0], a[1], b[2], b[3], b[0] - tip]),
                          x, tip * np.array([x**2, 2 * x, 2 + 0 * x, 0 * x]), [1.0], tol=1e-8)
        return found.p[0]

    best = minimize_scalar(lambda tip: -load(tip), bounds=(0.3, 0.6), method="bounded")
    return -best.fun


def test_an_electrode_pulls_a_beam_in():
    """Parallel plates: the force per area is that of the gap; above a voltage there is no state."""
    height, width, gap = 0.002, 0.01, 0.01
    unit = stiffness(height, width) / width * gap**3  # of the force at rest per area times gap^2

    def plates(r, F, X, t):
        return -unit / (gap + r[1] - X[1])

    load = pull_in()
    scene = cantilever(8, height, width).energy(plates, over="bottom")
    path = scene.continuation(max_load=1.5 * load, ds=0.2)
    limit = next(p for p in path.critical_points if p.kind == "limit")
    assert limit.load == pytest.approx(load, rel=1e-3)


# not scaled with the loads


def column(k, **options):
    """Pinned at both ends, on springs of k per length and deflection, under a force of 1."""
    height, width = 0.01, 0.01
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 17), height)
    scene = Scene(Beam(mesh, ElementBeamANCFCubic(2), MATERIAL, width))
    scene.pin("left").fix("right", "r^2").point_force((-1.0, 0.0), at=(1.0, 0.0))
    return scene.energy(lambda r, F, X, t: 0.5 * k * (r[1] - X[1])**2, over="axis", **options)


@pytest.mark.parametrize("waves", [1, 2])
def test_a_column_on_a_bedding_buckles(waves):
    """Timoshenko, Gere: "Theory of elastic stability" (1961), 2.10: a bedding that buckling() does
    not scale."""
    EI = stiffness(0.01, 0.01)
    k = {1: 1.0, 2: 15.0}[waves] * np.pi**4 * EI
    force = EI * (waves * np.pi)**2 + k / (waves * np.pi)**2
    found = column(k, scaled=False).buckling(1)
    assert found.factors[0] == pytest.approx(force, rel=2e-3)
    path = column(k, scaled=False).continuation(ds=force * 1e-3, max_load=1.2 * force)
    assert path.critical_points[0].load == pytest.approx(force, rel=3e-3)


@pytest.mark.parametrize("scaled", [True, False])
def test_a_bedding_alone_holds_a_beam(scaled):
    """It sinks by its weight over the bedding's stiffness, and vibrates as a mass on a spring."""
    k = 2e6
    mesh = MeshBeam.init_line(np.linspace(0.0, 1.0, 9), 0.05)
    scene = Scene(Beam(mesh, ElementBeamANCF(2), MATERIAL, 0.05)).gravity((0.0, -9.81))
    scene.energy(lambda r, F, X, t: 0.5 * k * ((r - X)**2).sum(axis=0), scaled=scaled)
    for state in (scene.solve_linear(), scene.solve_static()):
        assert_allclose(state.displacement((0.3, 0.0)), (0.0, -9.81 * 1000.0 / k), atol=1e-12)
    assert str(state.verdict).startswith("stable")
    assert_allclose(scene.modes(2, state).frequencies, np.sqrt(k / 1000.0), rtol=1e-6)
    history = scene.integrate(0.05, 1e-3, scheme="energy-momentum")
    assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy.max()


def test_what_is_not_scaled_is_a_body_force_too():
    one = cantilever().gravity((0.0, -9.81)).solve_static()
    two = cantilever().energy(lambda r, F, X, t: 9810.0 * r[1], scaled=False).solve_static()
    assert_allclose(two.u, one.u, rtol=0, atol=1e-9 * np.abs(one.u).max())
    for at in ((0.0, 0.0), (0.4, 0.0)):
        a, b = one.resultants(at), two.resultants(at)
        assert_allclose((b.M, b.Q), (a.M, a.Q), rtol=1e-6)


# derivatives, shapes of problems


def soft(r, F, X, t):
    J = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    return 50.0 * (((r - X)**2).sum(axis=0) + J**2 * r[1]) + 10.0 * F[0, 1]**2


def soft_gradient(r, F, X, t):
    J = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    d = 100.0 * (r - X)
    d[1] += 50.0 * J**2
    P = 100.0 * J * r[1] * np.array([[F[1, 1], -F[1, 0]], [-F[0, 1], F[0, 0]]])
    P[0, 1] += 20.0 * F[0, 1]
    return d, P


def test_derivatives_given_and_found_agree():
    a, b = (cantilever(4, 0.1, 0.1, ElementBeamANCF(2)).gravity((0.0, -9.81)).energy(
        soft, gradient).solve_static() for gradient in (None, soft_gradient))
    assert_allclose(a.u, b.u, rtol=0, atol=1e-10)
    assert str(a.verdict).startswith("stable")


def test_psi_compiled_by_numba():
    njit = pytest.importorskip("numba").njit
    gradient = njit(soft_gradient)

    @njit
    def psi(r, F, X, t):
        J = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
        return (50.0 * ((r[0] - X[0])**2 + (r[1] - X[1])**2 + J**2 * r[1]) + 10.0 * F[0, 1]**2
                + 1e-9 * t)

    def solved(*functions):
        return cantilever(4, 0.1, 0.1, ElementBeamANCF(2)).gravity((0.0, -9.81)).energy(
            *functions).solve_static().u

    u = solved(soft)
    assert_allclose(solved(psi), u, rtol=0, atol=1e-10)
    assert_allclose(solved(psi, gradient), u, rtol=0, atol=1e-10)
    with pytest.raises(InputError, match="has to be, too"):
        Energy(psi, soft_gradient)


def test_derivatives_by_jax():
    jnp = pytest.importorskip("jax.numpy")

    def psi(r, F, X, t):
        return soft(r, F, X, t) + 3.0 * jnp.abs(r[1] + 5.0)

    a, b = (cantilever(4, 0.1, 0.1, ElementBeamANCF(2)).gravity((0.0, -9.81)).energy(
        one, autodiff=auto).solve_static() for one, auto in (
            (lambda r, F, X, t: soft(r, F, X, t) + 3.0 * r[1], False), (psi, True)))
    assert_allclose(b.u, a.u, rtol=0, atol=1e-10)


def test_jax_is_an_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(MissingExtra, match="autodiff"):
        cantilever(2).energy(lambda r, F, X, t: 4.0 * r[1], autodiff=True)
    with pytest.raises(InputError, match="leave it out"):
        Energy(soft, soft_gradient, autodiff=True)


def test_an_energy_of_the_material_does_not_change_with_the_frame():
    def neo_hooke(r, F, X, t):
        J = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
        return (F**2).sum(axis=(0, 1)) - 2.0 - 2.0 * np.log(J)

    assert len(cantilever(2).energy(neo_hooke, check=True).loads) == 1
    for psi, word in ((lambda r, F, X, t: F[0, 1]**2, "turned"),
                      (lambda r, F, X, t: r[1]**2, "moved")):
        with pytest.raises(InputError, match=f"is {word} as a whole"):
            cantilever(2).energy(psi, check=True)


def test_derivatives_are_checked_where_one_asks():
    def psi(r, F, X, t):
        return r[1] + (np.abs(r[1]) > 0.5) * (r[1] - 0.5)**2

    beam = cantilever(2).beams[0]
    wrong = Energy(psi, lambda r, F, X, t: (np.array([0 * r[0], 1.0 + 0 * r[1]]), 0 * F))
    check_derivatives(wrong, beam)
    with pytest.raises(InputError, match="not the derivative of psi"):
        check_derivatives(wrong, beam, beam.rigid_motions()[:, 1])
    with pytest.raises(InputError, match="takes an Energy"):
        check_derivatives(psi, beam)


@pytest.mark.parametrize("over", ["cells", "axis", "top", "right"])
def test_the_total_energy_is_kept(over):
    scene = cantilever(4, 0.05, 0.05, material=StVenantKirchhoff(2e6, 0.3, 1000.0))
    scene.gravity((0.0, -9.81)).energy(
        lambda r, F, X, t: 400.0 * ((r - X)**2).sum(axis=0)**2 + 20.0 * F[0, 1]**2, over=over)
    history = scene.integrate(0.2, 5e-3, scheme="energy-momentum")
    assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy.max()


def test_recovered_forces_know_a_body_force():
    one = cantilever().gravity((0.0, -9.81)).solve_static()
    two = cantilever().energy(lambda r, F, X, t: 9810.0 * r[1]).solve_static()
    for at in ((0.0, 0.0), (0.4, 0.0)):
        a, b = one.resultants(at), two.resultants(at)
        assert_allclose((b.M, b.Q), (a.M, a.Q), rtol=1e-6)


def test_recovered_forces_of_linear_theory_and_of_time():
    """The shear force at the clamp is what gravity leaves of that of the bedding."""
    k, x = 1e3 * 0.005 * 0.01, np.linspace(0.0, 1.0, 201)
    for scaled in (True, False):
        scene = cantilever().gravity((0.0, -0.01)).energy(
            lambda r, F, X, t: 0.5e3 * ((r - X)**2).sum(axis=0), scaled=scaled)
        state = scene.solve_linear()
        w = state.displacement(np.array([x, 0.0 * x]))[1]
        for at in (0.0, 0.5):
            load = np.where(x >= at, -0.01 * 1000.0 * 0.005 * 0.01 - k * w, 0.0)
            Q = trapezoid(load[x >= at], x[x >= at])
            assert float(state.resultants((at, 0.0)).Q) == pytest.approx(-abs(Q), rel=1e-3)
    scene = cantilever(4, 0.05).energy(lambda r, F, X, t: -1e4 * t * r[1])
    ramp = cantilever(4, 0.05).gravity((0.0, 10.0), amplitude=lambda t: t)
    a, b = (s.integrate(0.02, 1e-3).state(-1).resultants((0.3, 0.0)) for s in (scene, ramp))
    assert float(a.Q) == pytest.approx(float(b.Q), rel=1e-6)


def test_it_depends_on_time():
    scene = cantilever(4, 0.05).energy(lambda r, F, X, t: -1e4 * t * r[1])
    ramp = cantilever(4, 0.05).gravity((0.0, 10.0), amplitude=lambda t: t)
    a, b = (s.integrate(0.02, 1e-3) for s in (scene, ramp))
    assert_allclose(a.u, b.u, rtol=0, atol=1e-9)


@pytest.mark.parametrize("psi, gradient, words", [
    (lambda r, F, X, t: r, None, "must return the shape"),
    (lambda r, F, X, t: np.abs(r[1]), None, "complex"),
    (lambda r, F, X, t: np.nan * r[1], None, "NaN"),
    (lambda r, F, X, t: r[1], lambda r, F, X, t: (2.0 + 0.0 * r, 0.0 * F), "not the derivative"),
    (lambda r, F, X, t: r[1], lambda r, F, X, t: r, "two arrays"),
    (lambda r, F, X, t: 1 / 0, None, "raised ZeroDivisionError"),
    (3, None, "must be a function")])
def test_what_is_no_energy_is_said(psi, gradient, words):
    with pytest.raises(InputError, match=words):
        cantilever(2).energy(psi, gradient)


def test_what_is_not_scaled_has_no_amplitude():
    with pytest.raises(InputError, match="scaled=False"):
        Energy(soft, amplitude=np.sin, scaled=False)


def test_a_cable_has_none():
    with pytest.raises(InputError, match="elements with sections"):
        cantilever(2, element=ElementBeamCable(5)).add(Energy(soft))


@pytest.mark.parametrize("place", [[np.nan, np.nan], (0.0, np.inf)])
def test_places_that_are_no_numbers_say_so(place):
    with pytest.raises(InputError, match="material point has a value that is NaN or infinite"):
        cantilever(element=ElementBeamANCF(2)).energy(lambda r, F, X, t: r[1], over=place)
