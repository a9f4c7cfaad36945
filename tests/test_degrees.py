"""Elements of any odd degree along the axis: their functions, accuracy, slenderness and curves."""

from math import comb, factorial

import exact
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCFHermite, ElementBeamCable,
                        InputError, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.elements.base import DEGREES
from skfem_ancf.mesh.mapping import SECTIONS
from skfem_ancf.core.quadrature import hermite_basis

E, NU, RHO, B = 2e8, 0.3, 7800.0, 0.01


def quarter(n, h=0.01):
    return MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1 - np.cos(s)]),
                               np.linspace(0.0, np.pi / 2, n + 1), h)


def hanging(element, n, slenderness=100.0, **options):
    """A cantilever under its weight, whose line does not depend on the height."""
    h = 1.0 / slenderness
    law = StVenantKirchhoff(E * (0.01 / h) ** 3, NU, RHO * 0.01 / h)
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, n + 1), h), element, law, B, **options)
    return Scene(beam).clamp("left", thickness="free").gravity((0, -9.81))


def tip_error(degree, n, slenderness=100.0):
    h = 1.0 / slenderness
    state = hanging(ElementBeamCable(degree), n, slenderness).solve_static()
    known = exact.gravity_cantilever(E * (0.01 / h) ** 3, NU, RHO * 0.01 / h, 1.0, B, h,
                                     model="extensible")
    return np.hypot(*(state.displacement((1, 0)) - known)), state


# the functions


@pytest.mark.parametrize("m", (3, 5, 8))
def test_hermite_functions_in_closed_form(m):
    """H_k = x^k / k! (1 - x)^m sum_j binom(m - 1 + j, j) x^j, j < m - k, all terms positive."""
    x = np.linspace(0.0, 1.0, 23)
    found = hermite_basis(m, x)
    for k in range(m):
        known = x**k / factorial(k) * (1 - x)**m * sum(
            comb(m - 1 + j, j) * x**j for j in range(m - k))
        assert_allclose(found[k], known, rtol=1e-13, atol=0)
        assert_allclose(found[m + k], (-1)**k * known[::-1], rtol=1e-13, atol=0)


def test_degrees_that_are_refused():
    for degree in (2, 17, True, "5"):
        with pytest.raises(InputError, match="one of 3, 5, 7, 9, 11, 13, 15, got"):
            ElementBeamANCFHermite(2, degree)
    assert [ElementBeamANCFHermite(1, p).sections for p in DEGREES] == list(SECTIONS[1:])


# accuracy

@pytest.mark.parametrize("degree, coarse, fine, error", [
    (3, 8, 16, 4e-4), (5, 4, 8, 4e-6), (7, 4, 8, 2e-9), (9, 2, 4, 6e-9), (11, 2, 4, 4e-11),
    (13, 1, 2, 4e-9), (15, 1, 2, 6e-11)])
def test_rate_of_every_degree(degree, coarse, fine, error):
    """Halved elements: the tip of a smoothly bent cable converges at least by its degree."""
    (a, _), (b, state) = (tip_error(degree, n) for n in (coarse, fine))
    assert b < error and len(state.steps) == 1 and state.iterations <= 24
    assert np.log2(a / b) > (3.0 if degree == 3 else min(degree, 7.0))


def test_one_element_converges_in_the_degree():
    errors = [tip_error(degree, 1)[0] for degree in DEGREES[3:]]
    assert errors[-1] < 6e-8
    assert np.all(np.divide(errors[:-1], errors[1:]) > 10.0)


@pytest.mark.parametrize("slenderness", [1e2, 1e3, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("degree, most", [(7, 45), (11, 36), (15, 72)])
def test_no_degree_locks(degree, most, slenderness):
    bound = 1e-10
    if slenderness > 1e5:  # the edge of round-off, and beyond it for 16 elements of degree 15
        degree, most, bound = min(degree, 11), 90, 1e-9
    error, state = tip_error(degree, 16, slenderness)
    assert error < bound and state.iterations <= most


@pytest.mark.parametrize("slenderness, n", [
    (1.48e6, 16), (1.77e6, 12), (1.8e6, 12), (1.81e6, 16)])
def test_round_off_is_no_limit_point(slenderness, n):
    """A cantilever under its weight has none; here K has its bending in the last digits."""
    scene = hanging(ElementBeamCable(15), n, slenderness)

    def ends(point):
        return point.rate < 0.0 or point.stable is False

    try:
        path = scene.continuation(until=ends, max_load=1.0, locate=1e-6)
    except ConvergenceError as failed:
        path = failed.state
    assert not path.critical_points and all(point.stable for point in path.points)


# curves


def arch_tip(P):
    """The end of a quarter of an inextensible circle of radius 1, clamped, under a force down.

    Its direction psi obeys EI psi'' = P cos(psi), and psi' = 1 at the free end: by shooting.
    """
    EI = E * B * 0.01**3 / 12

    def shoot(k):
        out = solve_ivp(lambda s, y: [y[1], P / EI * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])],
                        (0.0, np.pi / 2), [0.0, k, 0.0, 0.0], rtol=1e-12, atol=1e-13)
        return out.y[:, -1]

    k = brentq(lambda k: shoot(k)[1] - 1.0, -2.0, 1.5, xtol=1e-13)
    return shoot(k)[2:] - [1.0, 1.0]


@pytest.mark.parametrize("degree, n, error", [(7, 2, 3e-5), (9, 2, 3e-5), (7, 4, 2e-7),
                                              (15, 4, 1e-7)])
def test_cables_on_a_curve(degree, n, error):
    """Against 16 elements of degree 7; those against the inextensible line, (h / L)^2 apart."""
    def tip(degree, n):
        beam = Beam(quarter(n), ElementBeamCable(degree), StVenantKirchhoff(E, NU, RHO), B)
        return Scene(beam).clamp("left").point_force((0, -0.05), (1, 1)).solve_static(
            ).displacement((1, 1))

    fine = tip(7, 16)
    assert_allclose(fine, arch_tip(0.05), atol=2e-4)
    assert np.hypot(*(tip(degree, n) - fine)) < error
