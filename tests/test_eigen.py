"""Slender beams, loads that follow the body, and whole spectra, against beam theory and scipy."""

import exact
import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, ModelWarning, PointForce, Scene, StVenantKirchhoff)
from skfem_ancf.solvers import eigen

# units in which E I = rho A = L = 1 at every slenderness


def unit_beam(element, ne, slenderness, nu=0.3, L=1.0, **options):
    h = 1.0 / slenderness
    mesh = MeshBeam.init_line(np.linspace(0, L, ne + 1), h, **options)
    return Beam(mesh, element, StVenantKirchhoff(12.0 * slenderness**3, nu, slenderness), 1.0)


def cantilever(element, ne, slenderness, nu=0.3):
    return Scene(unit_beam(element, ne, slenderness, nu)).clamp("left", thickness="free")


def theory(ends, n):
    return exact.euler_bernoulli_frequencies(1.0, 1.0, 1.0, 1.0, 1.0, n, ends)


# slender beams


@pytest.mark.parametrize("slenderness", [1e1, 1e2, 1e3, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("element", [ElementBeamANCFCubic(2), ElementBeamANCF(3)])
def test_every_slenderness(element, slenderness):
    """Timoshenko's beam has the terms in (h / L)^2 that Euler's lacks; at nu = 0."""
    coarse, fine = (cantilever(element, n, slenderness, nu=0.0).modes(1).frequencies[0]
                    for n in (12, 24))
    order = 4 if element.sections == "cubic" else 2
    limit = fine + (fine - coarse) / (2**order - 1)
    h = 1.0 / slenderness
    if slenderness <= 1e2:
        known = exact.timoshenko_frequencies(12 / h**3, h**3 / 12, h, 1 / h, 1.0,
                                             exact.shear_factor(0.0) * 6 / h**2, 1)[0]
    else:
        known = theory("fixed-free", 1)[0]
    # a section of order 3 that is clamped cannot carry its parabola there: order (h / L)^3
    assert limit == pytest.approx(known, rel=1e-4 if slenderness > 10 else 1e-3)


@pytest.mark.parametrize("dense", [600, 10], ids=["dense", "sparse"])
@pytest.mark.parametrize("element, tol", [(ElementBeamCable(5), 1e-8),
                                          (ElementBeamANCFCubic(2), 2e-4)])
def test_slender_and_under_an_axial_force(element, tol, dense, monkeypatch):
    """omega^2 = (n pi)^4 (1 + T / n^2), T in units of pi^2; -6 is beyond two buckling loads."""
    monkeypatch.setattr(eigen, "DENSE", dense)
    for T in (-6.0, -0.8, 20.0):
        scene = Scene(unit_beam(element, 16, 1e6)).pin("left").fix("right", "r^2")
        state = scene.point_force((T * np.pi**2, 0), (1, 0)).solve_linear()  # stays straight
        n = np.arange(1, 4)
        known = np.sort((n * np.pi) ** 4 * (1 + T / n**2))
        modes = scene.modes(3, state)
        assert np.allclose(modes.eigenvalues, known, rtol=10 * tol)
        assert np.allclose(np.sign(modes.frequencies) * modes.frequencies**2, known, rtol=10 * tol)
        assert modes.stable == (T > -1.0) and not modes.flutter


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)])
def test_bent_states_do_not_see_the_slenderness(element):
    """The normal force of the strain is round-off of E A: 7 % of E I / L^2 at L / h = 1e6."""
    found = []
    for slenderness in (1e4, 1e6):
        scene = cantilever(element, 16, slenderness).gravity((0, -10))
        found.append(scene.modes(3, scene.solve_static()).frequencies)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-5)


# loads that follow the body


def becks_column(P, slenderness=1e3):
    """A cantilever pushed at its end by a force P along its end section's normal."""
    scene = Scene(unit_beam(ElementBeamANCFCubic(2), 12, slenderness, nu=0.0)).clamp("left")
    return scene.pressure("right", P * slenderness)


def becks_equation(P, omega):
    """The frequency equation of the cantilever under a tangential force at its end.

    w'''' + P w'' = omega^2 w, w = w' = 0 at the foot and w'' = w''' = 0 at the end.
    """
    root = np.sqrt(P**2 / 4 + omega**2)
    a, b = np.sqrt(P / 2 + root), np.sqrt(root - P / 2)
    return (P**2 + 2 * omega**2 * (1 + np.cos(a) * np.cosh(b))
            + omega * P * np.sin(a) * np.sinh(b))


def test_becks_column_below_flutter():
    scene = becks_column(10.0)
    modes = scene.modes(2, scene.solve_static())
    known = [brentq(lambda x: becks_equation(10.0, x), *ends) for ends in ((4, 6), (17, 20))]
    assert known[0] == pytest.approx(5.18, abs=5e-3)
    np.testing.assert_allclose(modes.frequencies, known, rtol=2e-3)
    assert not modes.flutter and modes.stable and modes.frequencies.dtype == float


def test_becks_column_flutters():
    """Two roots of the frequency equation meet at 20.05 E I / L^2."""
    def meet(z):
        P, omega = z
        step = 1e-4
        return [becks_equation(P, omega),
                (becks_equation(P, omega + step) - becks_equation(P, omega - step)) / (2 * step)]

    known = fsolve(meet, (20.0, 11.0))[0]
    assert known == pytest.approx(20.05, abs=2e-3)
    low, high = 19.5, 20.5
    while high - low > 1e-3:
        P = 0.5 * (low + high)
        scene = becks_column(P, 1e4)
        modes = scene.modes(2, scene.solve_static())
        low, high = (low, P) if modes.flutter else (P, high)
    assert 0.5 * (low + high) == pytest.approx(known, rel=1e-3)


def test_flutter_is_a_complex_pair(monkeypatch):
    scene = becks_column(25.0)
    state = scene.solve_static()
    modes = scene.modes(3, state)
    assert modes.flutter and not modes.stable
    omega = modes.frequencies
    assert omega[0] == pytest.approx(omega[1].conj()) and omega[0].imag != 0
    assert omega[2].imag == 0
    np.testing.assert_allclose(omega**2, modes.eigenvalues, rtol=1e-12)
    # the roots of the frequency equation in the complex plane
    def parts(z):
        value = becks_equation(25.0, z[0] + 1j * z[1])
        return value.real, value.imag

    known = fsolve(parts, (10.7, 4.8))
    assert [omega[0].real, abs(omega[0].imag)] == pytest.approx(list(known), rel=0.02)
    # K x = omega^2 M x, and it can be drawn
    shape = modes.mode(0, 0.1)
    assert shape.u.dtype == float and np.any(shape.u != state.u)
    monkeypatch.setattr(eigen, "DENSE", 10)
    np.testing.assert_allclose(scene.modes(3, state).eigenvalues, modes.eigenvalues, rtol=1e-6)


def test_pressure_between_clamped_ends_has_a_potential():
    """A clamped half circle under pressure: p R^3 / E I = k^2 - 1.

    With k tan(a) cot(k a) = 1 and a = pi / 2 that is 8 for a thin arch (Timoshenko and Gere, Theory
    of Elastic Stability, 1961).
    """
    h = 1e-3
    mesh = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                               np.linspace(0, np.pi, 17), h)

    def arch(side):
        beam = Beam(mesh, ElementBeamANCFCubic(2), StVenantKirchhoff(12 / h**3, 0.0, 1 / h), 1.0)
        return Scene(beam).clamp("left").clamp("right").pressure(side, 1.0)

    buckling = arch("bottom").buckling()
    assert buckling.factors[0] == pytest.approx(8.0, rel=2e-3) and not buckling.follower
    with pytest.raises(InputError, match="stiffen the beam"):
        arch("top").buckling()


@pytest.mark.parametrize("dead", [0.0, 1.0, 2.2, -3.0])
def test_a_live_load_on_top_of_a_dead_one(dead):
    """Cantilever with a constant force below its top: tan(k1 a) tan(k2 b) = k1 / k2."""
    E, h, a = 12e6, 0.01, 0.6
    column = Scene(Beam(MeshBeam.init_line([0, 0.3, a, 0.8, 1], h), ElementBeamCable(5),
                        StVenantKirchhoff(E, 0.0), width=1.0)).clamp("left")

    def balance(P):
        k1, k2 = np.emath.sqrt(P + dead), np.sqrt(P)
        return (k2 * np.sin(k1 * a) * np.sin(k2 * (1 - a))
                - k1 * np.cos(k1 * a) * np.cos(k2 * (1 - a))).real

    exact = brentq(balance, max(0.1, 0.01 - dead), 4.0)
    state = column.replace(loads=[PointForce((-dead, 0), at=(a, 0))]).solve_static()
    live = column.replace(loads=[PointForce((-2.0, 0), at=(1, 0))])
    found = live.buckling(1, state)
    assert found.factors[0] == pytest.approx(exact / 2, rel=2e-4)
    # at that sum of loads the whole is critical
    for part, verdict in ((0.99, "stable"), (1.01, "unstable")):
        both = column.replace(loads=[PointForce((-dead, 0), at=(a, 0)),
                                     PointForce((-part * exact, 0), at=(1, 0))])
        assert both.solve_static(stable=False).stability == verdict
    with pytest.raises(InputError, match="the state is unstable"):
        live.buckling(1, column.replace(loads=[PointForce((-3.0, 0), at=(1, 0))]).solve_static(
            stable=False))
    with pytest.raises(InputError, match="other supports"):
        column.replace(loads=[PointForce((-2.0, 0), at=(1, 0))]).fix("right", "r^2").buckling(
            1, state)


def test_buckling_knows_springs_that_act_on_one_side():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), ElementBeamCable(5),
                StVenantKirchhoff(E=12e6, nu=0, density=1), width=1.0)  # E I = 1

    def column():
        return Scene(beam).pin("left").fix("right", "r^2").point_force((-1, 0), at="right")

    both = column().foundation(500.0, "bottom").buckling(2).factors
    n = np.array([2, 1])
    assert both == pytest.approx((n * np.pi) ** 2 + 500 / (n * np.pi) ** 2, rel=1e-3)
    with pytest.raises(InputError, match="stiffer to one side"):  # it lifts off at less than pi^2
        column().foundation(500.0, "bottom", one_sided=True).buckling(1)

    def flagpole(law):
        scene = Scene(beam).clamp("left").point_force((-1, 0), at="right")
        return scene.spring(law, between=((1, 0), (1, 1)))

    with pytest.raises(InputError, match="stiffer to one side"):
        flagpole(lambda e: 100.0 * max(e, 0.0)).buckling(1)
    slack = flagpole(lambda e: 100.0 * max(e - 0.01, 0.0)).buckling(1)
    assert slack.factors == pytest.approx([np.pi**2 / 4], rel=1e-3)
    # a rope along the column that becomes tight before it buckles
    tied = column().spring(lambda e: 1e9 * max(e - 1e-5, 0.0), between=((1, 0), (2, 0)))
    with pytest.warns(ModelWarning, match="stiffer or softer before buckling"):
        tied.buckling(1)


@pytest.mark.parametrize("share", [0.4, -1.0])
def test_what_load_factors_do_not_scale_acts_before_buckling(share):
    """A cantilever column with a dead weight on its end, as an energy linear in the position."""
    euler, height = np.pi**2 / 16.0, 0.01
    beam = Beam(MeshBeam.init_line(np.linspace(0, 2, 9), height), ElementBeamANCF(2),
                StVenantKirchhoff(12e6, 0.0), width=1.0)
    column = Scene(beam).clamp("left").point_force((-euler, 0), at=(2, 0))
    alone = column.buckling(1).factors[0]
    column.energy(lambda r, F, X, t: share * euler / height * r[0], over="right", scaled=False)
    assert column.buckling(1).factors[0] == pytest.approx(alone - share, rel=1e-4)


def test_a_prestressed_spring_acts_before_buckling():
    """A taut cord of length 1 along a column of length 2 pulls its end back to the other end."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 2, 9), 0.01), ElementBeamCable(5),
                StVenantKirchhoff(12e6, 0.0), width=1.0)  # E I = 1
    column, tension = Scene(beam).clamp("left").point_force((-1, 0), at=(2, 0)), 0.2 * 0.5
    column.spring(0.2, (("ground", (1.0, 0)), (beam, (2, 0))), length=0.5)

    def balance(P):
        # w = A (1 - cos k x) + B (k x - sin k x) with w_xx = 0, w_xxx + k^2 w_x = T w at the end
        k = np.sqrt(P + tension)
        c, s = np.cos(2.0 * k), np.sin(2.0 * k)
        return np.linalg.det([[c, s], [-tension * (1.0 - c), k**3 - tension * (2.0 * k - s)]])

    exact = brentq(balance, 0.3, 1.0)
    assert column.buckling(1).factors[0] == pytest.approx(exact, rel=1e-4)
    assert abs(exact - np.pi**2 / 16.0) > 0.02
