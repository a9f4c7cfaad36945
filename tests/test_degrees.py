"""Elements of any odd degree along the axis: their functions, accuracy, slenderness and curves."""

from math import comb, factorial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import svdvals
from scipy.optimize import brentq

import exact
from skfem_ancf import (Beam, ElementBeamANCFHermite, ElementBeamCable, InputError, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.elements.base import DEGREES
from skfem_ancf.mesh.nodal import nodal_derivatives
from skfem_ancf.mesh.reference_cell import SECTIONS, hermite_basis

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

@pytest.mark.parametrize("m", range(1, 9))
def test_hermite_functions_are_dual_to_the_derivatives_at_the_ends(m):
    for k in range(m):
        values = hermite_basis(m, np.array([0.0, 1.0]), k)
        expected = np.zeros((2 * m, 2))
        expected[k, 0] = expected[m + k, 1] = 1.0
        assert_allclose(values / factorial(k), expected / factorial(k), atol=1e-14)
    assert not np.any(hermite_basis(m, np.array([0.3]), 2 * m))


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
    assert b < error and len(state.steps) == 1 and state.iterations <= 8
    assert np.log2(a / b) > (3.0 if degree == 3 else min(degree, 7.0))


def test_one_element_converges_in_the_degree():
    errors = [tip_error(degree, 1)[0] for degree in DEGREES[3:]]
    assert errors[-1] < 6e-8
    assert np.all(np.divide(errors[:-1], errors[1:]) > 10.0)


@pytest.mark.parametrize("slenderness", [1e2, 1e3, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("degree, most", [(7, 15), (11, 10), (15, 24)])
def test_no_degree_locks(degree, most, slenderness):
    bound = 1e-10
    if slenderness > 1e5:  # the edge of round-off: 17 to 60 of degree 15, by 1e-13 of the height
        most, bound = 30 if degree < 15 else 100, 1e-9
    error, state = tip_error(degree, 16, slenderness)
    assert error < bound and state.iterations <= most


@pytest.mark.parametrize("degree", DEGREES)
def test_resists_all_but_rigid_motions(degree):
    """The strains of one, two and three elements at rest have three zero modes, no more."""
    for n in (1, 2, 3):
        for element in (ElementBeamANCFHermite(1, degree), ElementBeamCable(degree)):
            beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), 0.1), element,
                        StVenantKirchhoff(E, NU, RHO), B)
            nd = beam.nd
            part = beam.kernel.gradients(np.zeros(beam.N))[0]
            whole = np.zeros((n, part.shape[1] + beam.N, beam.N))
            for e in range(n):
                whole[e, beam.N:, e * nd:(e + 2) * nd] = part[e]
            whole = whole.reshape(-1, beam.N)
            s = svdvals(whole / np.linalg.norm(whole, axis=0))
            assert s[-3] < 1e-13 * s[0] and s[-4] > 1e-7 * s[0]


@pytest.mark.parametrize("slenderness, known", [(1e2, -0.9034994), (1e4, -0.90313168)])
def test_sections_of_a_high_degree(slenderness, known):
    for degree, n, error in ((7, 4, 2e-5), (9, 2, 8e-5), (9, 4, 1e-6), (11, 1, 4e-5)):
        state = hanging(ElementBeamANCFHermite(2, degree), n, slenderness).solve_static()
        assert abs(state.displacement((1, 0))[1] - known) < error
        assert state.iterations <= 9 and len(state.steps) == 1


# curves

def test_derivatives_at_the_nodes_of_a_curve():
    errors = []
    for n in (4, 8):
        mesh = quarter(n)
        found = nodal_derivatives(mesh, 7)
        for k, d in enumerate(found):
            known = np.real(np.array([-1j, -1.0])[:, None] * 1j**k * np.exp(1j * mesh.s))
            known[1] += k == 0
            errors.append(np.max(np.abs(d - known)) * mesh.lengths[0]**k / factorial(k))
    assert max(errors[3:8]) < 1e-6 and max(errors[11:]) < 1e-8  # of the first three: the mesh's own


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


@pytest.mark.parametrize("degree, error", [(3, 1e-5), (5, 1e-5), (7, 1e-9), (15, 1e-9)])
def test_weight_of_a_cable_on_a_curve(degree, error):
    """The mass is that of the axis, not of directors that are interpolated between nodes."""
    beam = Beam(quarter(8), ElementBeamCable(degree), StVenantKirchhoff(E, NU, RHO), B)
    state = Scene(beam).clamp("left").gravity((0, -0.3)).solve_static()
    assert_allclose(state.reactions("left").force, [0.0, 0.3 * RHO * B * 0.01 * np.pi / 2],
                    atol=error * RHO * B * 0.01 * 0.3)


# what looks at a solution

@pytest.mark.parametrize("element, mesh", [
    (ElementBeamCable(11), MeshBeam.init_line([0.0, 0.5, 1.0], 0.02)),
    (ElementBeamCable(9), quarter(2, 0.02)),
    (ElementBeamANCFHermite(3, 9), MeshBeam.init_line([0.0, 1.0], 0.02)),
    (ElementBeamANCFHermite(2, 7), quarter(2, 0.02))], ids=repr)
def test_two_elements_are_looked_at_as_many_short_ones_are(element, mesh, tmp_path):
    """Fields, section forces, modes, a motion and a joint: against 16 elements of degree 5."""
    def look(element, mesh):
        beam = Beam(mesh, element, StVenantKirchhoff(E, NU, RHO), B)
        scene = Scene(beam).clamp("left", thickness="free").gravity((0, -3.0))
        state = scene.solve_static()
        hung = Scene(beam).pin("left")
        motion = hung.gravity((0, -3.0)).integrate(t_end=0.05, dt=5e-3)
        return state, [state.displacement(mesh.p[:, -1]), state.reactions("left").moment,
                       scene.modes(3).frequencies, motion.displacement(mesh.p[:, -1])[-1]]

    finer = (ElementBeamCable(5) if element.order == 0 else
             ElementBeamANCFHermite(element.order, 5))
    fine = mesh.refined(3)
    state, found = look(element, mesh)
    for a, b in zip(found, look(finer, fine)[1]):
        assert_allclose(a, b, rtol=2e-3, atol=1e-4)
    middle = 0.5 * (fine.p[:, 4] + fine.p[:, 5]) if mesh.is_straight else fine.p[:, 4]
    assert state.strain(middle).shape == (3,)
    for options in ({}, {"lagrange": True}):
        path = tmp_path / "beam.vtu"
        state.save(path, **options)
        assert path.stat().st_size > 1000


def test_meshes_of_a_high_degree_are_moved_saved_and_cut_as_others(tmp_path):
    mesh = quarter(4, 0.1).with_sections("septic")
    X = np.array([[0.2, 0.7], [0.1, 0.9]])
    x = mesh.mapping().F(X)
    on_the_arc = np.hypot(x[0], x[1] - 1.0) + 0.1 * (X[1] - 0.5)
    assert_allclose(on_the_arc, 1.0, atol=1e-7)
    c, s = np.cos(0.3), np.sin(0.3)
    moved = mesh.rotated(0.3).translated([1.0, 2.0])
    assert_allclose(moved.mapping().F(X),
                    np.einsum("ij,jep->iep", [[c, -s], [s, c]], x) + [[[1.0]], [[2.0]]], atol=1e-14)
    mesh.save_npz(tmp_path / "mesh.npz")
    same = MeshBeam.load_npz(tmp_path / "mesh.npz")
    assert same.sections == "septic"
    assert_allclose(same.mapping().F(X), x, atol=1e-15)
    fine = mesh.refined()
    assert fine.sections == "septic" and mesh.restrict([1, 2]).nelements == 2
    assert_allclose(fine.mapping().F(np.array([[0.4], [0.9]]))[:, ::2, 0],
                    mesh.mapping().F(np.array([[0.2], [0.9]]))[:, :, 0], atol=1e-7)
