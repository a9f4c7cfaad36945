"""The reference solutions against independent codes, against each other and in their limits.

Literals marked "independent code" were computed outside this package, by other programs.
"""

import exact
import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh

SOFT = dict(E=2e8, nu=0.3, rho=7800.0, L=1.0, b=0.01, h=0.01)


def close(value, reference, tol):
    np.testing.assert_allclose(value, reference, rtol=0.0, atol=tol)


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


def test_limit_load_of_the_clamped_hinged_arch():
    close(exact.clamped_hinged_arch_limit(), 8.973089970, 6e-9)  # independent code
    _, uy, load = exact.clamped_hinged_arch(19)
    assert uy.shape == (19,) and 8.9 < load.max() < 8.9731
    assert np.all(np.diff(uy) < 0)


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


def test_euler_bernoulli_frequencies():
    unit = dict(E=1.0, I=1.0, A=1.0, rho=1.0, L=1.0)
    x = np.sqrt(exact.euler_bernoulli_frequencies(**unit, n=3))
    close(x, [1.875104068711961, 4.694091132974175, 7.854757438237613], 1e-13)  # tables
    x = np.sqrt(exact.euler_bernoulli_frequencies(**unit, n=2, ends="free-free"))
    close(x, [4.730040744862704, 7.853204624095838], 1e-13)  # tables
    x = np.sqrt(exact.euler_bernoulli_frequencies(**unit, n=400, ends="fixed-free"))
    close(x[-1], 399.5 * np.pi, 1e-11)
