"""The reference solutions against independent codes, against each other and in their limits.

Literals marked "independent code" were computed outside this package, by other programs.
"""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.optimize import brentq

import exact
from skfem_ancf.core.errors import InputError

SOFT = dict(E=2e8, nu=0.3, rho=7800.0, L=1.0, b=0.01, h=0.01)


def close(value, reference, tol):
    np.testing.assert_allclose(value, reference, rtol=0.0, atol=tol)


# Sections and small deflections


def test_small_deflection_of_the_slender_cantilever():
    I = exact.inertia(0.01, 0.01)
    close(exact.euler_bernoulli_tip(10.0, 2e11, I, 1.0), [0.0, -0.02], 1e-16)
    strain = exact.root_transverse_strain(10.0, 2e11, 0.3, L=1.0, h=0.01, b=0.01)
    close(strain, [-90e-6, 90e-6], 1e-18)  # the fibre in tension is on top


def test_shear_factor_of_a_rectangle():
    assert exact.shear_factor(0.0) == pytest.approx(5 / 6)
    assert exact.shear_factor(0.3) == pytest.approx(13 / 15.3)


# Rods in large bending


@pytest.mark.parametrize(
    "model, plane, tip, tol",
    [  # independent code
        ("elastica", "stress", (-0.7409917574, -0.9031316830831), 6e-10),
        ("elastica", "strain", (-0.7244805807, -0.8974327927637), 6e-10),
        ("extensible", "stress", (-0.7409795738, -0.9032869463686), 6e-10),
        ("extensible", "strain", (-0.7244692457, -0.8975726079360), 6e-10),
        ("reissner", "stress", (-0.7410168535, -0.9033972258502), 6e-10),
        ("reissner", "strain", (-0.7245073589, -0.8976878470927), 6e-10),
        ("svk", "stress", (-0.7411086333, -0.903311513), 6e-9),
        ("svk", "strain", (-0.7245923453, -0.897596109), 6e-9),
    ],
)
def test_gravity_cantilever(model, plane, tip, tol):
    ours = exact.gravity_cantilever(**SOFT, model=model, plane=plane)
    close(ours, tip, tol)
    if model != "svk":
        close(ours[1], tip[1], 1e-12)


@pytest.mark.parametrize("model", ["extensible", "reissner", "svk"])
def test_gravity_cantilever_tends_to_the_elastica_with_the_square_of_the_height(model):
    """Fixed E I and fixed weight: what is left is the stretch, the shear, the section."""
    limit = exact.gravity_cantilever(**SOFT, model="elastica")
    gaps = []
    for scale in (1.0, 0.5, 0.25):
        beam = {**SOFT, "h": 0.01 * scale, "E": 2e8 / scale**3, "rho": 7800.0 / scale}
        gaps.append(exact.gravity_cantilever(**beam, model=model) - limit)
    gaps = np.linalg.norm(gaps, axis=1)
    close(np.log2(gaps[:-1] / gaps[1:]), 2.0, 0.01)


def test_gravity_cantilever_under_little_load_is_the_linear_beam():
    beam = {**SOFT, "E": 2e14}
    q, EI = 7800.0 * 9.81 * 1e-4, 2e14 * exact.inertia(0.01, 0.01)
    shear = exact.shear_factor(0.3) * 2e14 / 2.6 * 1e-4
    tip = exact.gravity_cantilever(**beam, model="elastica")
    assert tip[1] == pytest.approx(-q / (8 * EI), rel=1e-8)
    tip = exact.gravity_cantilever(**beam, model="reissner")
    assert tip[1] == pytest.approx(-q / (8 * EI) - q / (2 * shear), rel=1e-8)


def test_scaling_the_gravity_cantilever():
    """Twice the size in every direction and half the density: the same shape."""
    beam = {**SOFT, "L": 2.0, "b": 0.02, "h": 0.02, "rho": 3900.0}
    for model in ("elastica", "svk"):
        one = exact.gravity_cantilever(**SOFT, model=model)
        close(exact.gravity_cantilever(**beam, model=model), 2 * one, 1e-11)


def test_elastica_under_a_tip_load():
    u, w = exact.elastica_tip_load(10.0)
    close(w, 0.8106090248803, 1e-13)  # independent code
    close(u, 0.55499559775, 6e-11)  # independent code
    u, w = exact.elastica_tip_load(1e-4)
    assert w == pytest.approx(1e-4 / 3, rel=1e-7)
    assert u == pytest.approx(1e-8 / 15, rel=1e-5)


@pytest.mark.parametrize("alpha, tol", [(0.01, 1e-12), (1.0, 1e-12), (10.0, 1e-12), (200.0, 1e-9)])
def test_elliptic_integrals_agree_with_shooting(alpha, tol):
    u, w = exact.elastica_tip_load(alpha)
    close(exact.elastica_extensible_tip(alpha, 1e18, 1.0, 1.0), [-u, -w], tol)


def test_elastica_of_the_slender_cantilever():
    alpha = 10.0 / (2e11 * exact.inertia(0.01, 0.01))
    close(exact.elastica_tip_load(alpha)[1], 0.019991777751, 6e-12)  # independent code


def test_cubic_cable_under_a_tip_load():
    EI = 2.07e11 * exact.inertia(0.1, 0.1)
    tip = exact.elastica_extensible_tip(3 * EI / 2.0**2, 2.07e11 * 0.01, EI, 2.0)
    close(tip, [-0.508537304326, -1.207239854550], 1e-11)  # independent code


def test_rollup_of_a_continuum():
    b = h = 0.01
    M = 2 * np.pi * 2e8 * exact.inertia(b, h)
    turns = exact.rollup_end_angle(M, 2e8, b, h, 1.0) / (2 * np.pi)
    close(turns, 1.0011885806, 6e-10)  # independent code
    kappa, stretch = exact.rollup_curvature(M, 2e8, b, h)
    # the stress resultants of S = E ((stretch - Y kappa)^2 - 1)/2, integrated exactly
    Y, weight = legendre.leggauss(4)
    a = stretch - Y * h / 2 * kappa
    traction = 2e8 * (a * a - 1) / 2 * a * weight * b * h / 2
    close(traction.sum() / (2e8 * b * h), 0.0, 1e-15)
    assert -(traction * Y * h / 2).sum() == pytest.approx(M, rel=1e-12)
    thin = exact.rollup_end_angle(M * 1e-9, 2e8, b, h * 1e-3, 1.0) / (2 * np.pi)
    close(thin - 1, 1.1844e-9, 1e-12)  # 0.3 (2 pi h/L)^2
    left, right = exact.rollup_tip(-M / 2, 2e8, b, h, 1.0), exact.rollup_tip(M / 2, 2e8, b, h, 1.0)
    close(left, right * [1, -1], 1e-15)
    close(right, [-1.0, 2 / np.pi], 5e-4)


# Frames, arches, buckling


@pytest.mark.parametrize(
    "section, highest, lowest",
    [  # independent code
        ({}, 18.558746539, -9.421287454),
        (dict(A=6.0, I=2.0, L=120.0), 18.556727538, -9.414431556),
    ],
)
def test_limit_loads_of_lees_frame(section, highest, lowest):
    close(exact.lee_frame_limits(**section), (highest, lowest), 6e-9)


def test_path_of_lees_frame():
    ux, uy, load = exact.lee_frame(41)
    assert ux.shape == uy.shape == load.shape == (41,)
    close([ux[0], uy[0], load[0]], 0.0, 1e-12)
    assert 17.9 < load.max() < 18.5588 and -9.4213 < load.min() < -8.9
    assert np.sum(np.diff(np.sign(np.diff(load))) != 0) == 2  # one maximum, one minimum
    assert np.sum(np.diff(np.sign(np.diff(uy))) != 0) >= 2  # and it snaps back


def test_lees_frame_at_rest():
    """Slope deflection: half the clamping moment b (1 - b^2)/2 stays at the corner."""
    a, b = 0.2, 0.8
    corner = b * (1 - b**2) / 4
    v = a**2 * b**2 / 3 - corner * a * b * (1 + b) / 6
    _, uy, load = exact.lee_frame(2, reach=0.001)
    assert -uy[1] / load[1] == pytest.approx(v, rel=1e-3)


def test_limit_load_of_the_clamped_hinged_arch():
    close(exact.clamped_hinged_arch_limit(), 8.973089970, 6e-9)  # independent code
    _, uy, load = exact.clamped_hinged_arch(19)
    assert uy.shape == (19,) and 8.9 < load.max() < 8.9731
    assert np.all(np.diff(uy) < 0)


def shallow_toggle(v, EA, EI, a, rise):
    """Williams' toggle for small rotations: a beam-column, clamped, its far end guided."""
    L = np.hypot(a, rise)

    def shear(H):
        k = np.sqrt(H / EI)
        return v * a / L * H * k / (2 * np.tan(k * L / 2) - k * L)

    def misfit(H):
        k, ratio = np.sqrt(H / EI), shear(H) / H

        def slope(x):
            return ratio * (np.cos(k * x) + np.tan(k * L / 2) * np.sin(k * x) - 1)

        return rise / L * v - quad(lambda x: slope(x) ** 2, 0, L)[0] / 2 - H * L / EA

    H = brentq(misfit, 1.0, 3.9 * np.pi**2 * EI / L**2)
    return 2 * (H * rise / L + shear(H) * a / L)


def test_williams_toggle():
    EA, EI, a, rise = 1.885e6, 9.27e3, 12.943, 0.386
    L = np.hypot(a, rise)
    linear = 2 * (EA / L * (rise / L) ** 2 + 12 * EI / L**3 * (a / L) ** 2)
    assert exact.williams_toggle(1e-6) == pytest.approx(1e-6 * linear, rel=1e-4)
    v = np.array([0.1, 0.2, 0.3, 0.4])
    loads = exact.williams_toggle(v)
    assert loads[1] == pytest.approx(exact.williams_toggle(0.2), rel=1e-9)
    assert loads[0] < loads[1] > loads[2] > loads[3]
    np.testing.assert_allclose(loads, [shallow_toggle(x, EA, EI, a, rise) for x in v], rtol=5e-3)


@pytest.mark.parametrize(
    "ends, factor", [("fixed-free", 0.25), ("pinned-pinned", 1.0), ("fixed-fixed", 4.0)]
)
def test_euler_buckling(ends, factor):
    load = exact.euler_buckling_load(3.0, 2.0, 0.5, ends)
    assert load == pytest.approx(factor * np.pi**2 * 24.0, rel=1e-14)


def test_euler_buckling_of_the_fixed_pinned_column():
    x = np.sqrt(exact.euler_buckling_load(1.0, 1.0, 1.0, "fixed-pinned"))
    assert np.tan(x) == pytest.approx(x, rel=1e-12)
    close(x, 4.493409457909064, 1e-14)  # first positive root of tan x = x, tables


def test_self_buckling():
    close(exact.greenhill_load(1.0, 1.0, 1.0), 7.837347438943, 1e-11)  # independent code
    assert exact.greenhill_load(6.0, 5.0, 2.0) == pytest.approx(7.837347438943 * 30 / 8)


# Vibration


def ritz(E, I, A, rho, L, kGA, n, clamped, degree=24):
    """Timoshenko frequencies by a Ritz method with Legendre polynomials."""
    x, weight = legendre.leggauss(degree + 4)
    V = legendre.legvander(x, degree)
    D = np.stack([legendre.legval(x, legendre.legder(e)) for e in np.eye(degree + 1)], 1)
    if clamped:
        V, D = (1 + x)[:, None] * V, V + (1 + x)[:, None] * D
    D, weight = D * 2 / L, weight * L / 2
    zero = np.zeros_like(V)

    def form(c, left, right):
        return c * (left * weight[:, None]).T @ right

    shear, bend = np.hstack([D, -V]), np.hstack([zero, D])
    K = form(kGA, shear, shear) + form(E * I, bend, bend)
    w, theta = np.hstack([V, zero]), np.hstack([zero, V])
    values = eigh(K, form(rho * A, w, w) + form(rho * I, theta, theta), eigvals_only=True)
    return np.sqrt(values[(0 if clamped else 2) :][:n])


def section(h):
    return dict(E=1.0, I=h**3 / 12, A=h, rho=1.0, L=1.0, kGA=exact.shear_factor(0.3) / 2.6 * h)


@pytest.mark.parametrize("ends", ["fixed-free", "free-free"])
@pytest.mark.parametrize("h", [0.1, 0.5])  # at 0.5 the second spectrum begins inside
def test_timoshenko_frequencies_against_ritz(ends, h):
    ours = exact.timoshenko_frequencies(**section(h), n=8, ends=ends)
    other = ritz(**section(h), n=8, clamped=ends == "fixed-free")
    np.testing.assert_allclose(ours, other, rtol=1e-7)


@pytest.mark.parametrize("ends", ["fixed-free", "free-free", "pinned-pinned"])
def test_timoshenko_tends_to_euler_bernoulli(ends):
    gaps = []
    for h in (0.02, 0.01, 0.005):
        beam = section(h)
        thick = exact.timoshenko_frequencies(**beam, n=3, ends=ends)
        del beam["kGA"]
        gaps.append(1 - thick / exact.euler_bernoulli_frequencies(**beam, n=3, ends=ends))
    assert np.all(np.array(gaps) > 0)
    close(np.log2(np.array(gaps)[:-1] / np.array(gaps)[1:]), 2.0, 0.03)


def test_timoshenko_pinned_pinned_solves_its_equations():
    beam = section(0.3)
    omega = exact.timoshenko_frequencies(**beam, n=3, ends="pinned-pinned")
    for k, w in enumerate(omega, start=1):
        p, kGA = k * np.pi, beam["kGA"]
        M = [[kGA * p**2 - 0.3 * w**2, -kGA * p],
             [-kGA * p, beam["I"] * (p**2 - w**2) + kGA]]  # fmt: skip
        close(np.linalg.det(M) / (M[0][0] * M[1][1]), 0.0, 1e-12)


def test_euler_bernoulli_frequencies():
    unit = dict(E=1.0, I=1.0, A=1.0, rho=1.0, L=1.0)
    x = np.sqrt(exact.euler_bernoulli_frequencies(**unit, n=3))
    close(x, [1.875104068711961, 4.694091132974175, 7.854757438237613], 1e-13)  # tables
    x = np.sqrt(exact.euler_bernoulli_frequencies(**unit, n=2, ends="free-free"))
    close(x, [4.730040744862704, 7.853204624095838], 1e-13)  # tables
    x = np.sqrt(exact.euler_bernoulli_frequencies(**unit, n=400, ends="fixed-free"))
    close(x[-1], 399.5 * np.pi, 1e-11)


# Rigid motion


def test_rigid_pendulum():
    t = np.linspace(0.0, 1.0, 2001)
    theta = exact.rigid_pendulum(t, 2.0, theta0=2.5)
    rate = np.gradient(theta, t, edge_order=2)
    energy = rate**2 / 2 - 1.5 * 9.81 / 2.0 * np.cos(theta)  # constant: released from rest
    close(energy, -1.5 * 9.81 / 2.0 * np.cos(2.5), 1e-4)
    period = exact.rigid_pendulum_period(2.0, 2.5)
    close(exact.rigid_pendulum([0.0, period / 2, period], 2.0, 2.5), [2.5, -2.5, 2.5], 1e-12)
    small = 2 * np.pi / np.sqrt(1.5 * 9.81 / 2.0)
    assert exact.rigid_pendulum_period(2.0, 1e-3) == pytest.approx(small, rel=1e-7)


def test_double_pendulum_with_a_light_second_rod_is_the_pendulum():
    t = np.linspace(0.0, 1.0, 11)
    y = exact.double_pendulum(t, lengths=(1.0, 0.3), masses=(1.0, 1e-13), angles=(1.5, 0.0))
    assert y.shape == (4, 11)
    close(y[0], exact.rigid_pendulum(t, 1.0, 1.5), 1e-10)


def test_double_pendulum_keeps_its_energy():
    (L1, L2), (m1, m2), g = (1.0, 0.7), (2.0, 1.5), 9.81
    p, q, dp, dq = exact.double_pendulum(
        np.linspace(0.0, 2.0, 41), (L1, L2), (m1, m2), (2.0, 2.5), (0.5, -1.0), g
    )
    # the centres of both rods
    v1 = L1 / 2 * dp * np.array([np.cos(p), np.sin(p)])
    v2 = 2 * v1 + L2 / 2 * dq * np.array([np.cos(q), np.sin(q)])
    kinetic = m1 * (v1**2).sum(0) / 2 + m1 * L1**2 * dp**2 / 24
    kinetic += m2 * (v2**2).sum(0) / 2 + m2 * L2**2 * dq**2 / 24
    potential = -m1 * g * L1 / 2 * np.cos(p) - m2 * g * (L1 * np.cos(p) + L2 / 2 * np.cos(q))
    close(kinetic + potential, kinetic[0] + potential[0], 1e-8)


def test_double_pendulum_at_one_time_is_its_start():
    close(exact.double_pendulum(0.0)[:, 0], [np.pi / 2, np.pi / 2, 0.0, 0.0], 0.0)


# Bad input


@pytest.mark.parametrize(
    "call",
    [
        lambda: exact.inertia(0.1, -0.5),
        lambda: exact.elastica_tip_load(0.0),
        lambda: exact.elastica_tip_load(1e4),
        lambda: exact.gravity_cantilever(**SOFT, model="timoshenko"),
        lambda: exact.gravity_cantilever(**SOFT, plane="both"),
        lambda: exact.gravity_cantilever(**{**SOFT, "E": 1.0}),
        lambda: exact.rollup_curvature(1.0, 1.0, 0.1, 0.1),
        lambda: exact.lee_frame(1),
        lambda: exact.lee_frame(5, A=-1.0),
        lambda: exact.euler_buckling_load(1.0, 1.0, 1.0, "glued"),
        lambda: exact.euler_bernoulli_frequencies(1, 1, 1, 1, 1, n=0),
        lambda: exact.timoshenko_frequencies(1, 1, 1, 1, 1, 1, ends="glued"),
        lambda: exact.rigid_pendulum(0.0, 1.0, 4.0),
        lambda: exact.double_pendulum([1.0, 0.0]),
    ],
)
def test_bad_input_is_refused(call):
    with pytest.raises(InputError):
        call()
