"""A family of elements from outside: one class, and the default formulation fits it."""

import exact
import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from skfem import Basis, ElementVector, asm

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, NeoHookean, Scene, StVenantKirchhoff, forms
from skfem_ancf.elements import ElementBeam
from skfem_ancf.elements.base import SectionFunctions
from skfem_ancf.formulations import Assumed

WIDTH = 0.01


class Quintic(ElementBeam):
    """r and r_Y at the axis with their first two derivatives along X: quintic, linear in Y."""

    def __init__(self):
        super().__init__(SectionFunctions([[1.0]]), ["r_XX", "r_Y", "r_XY", "r_XXY"],
                         [(0.0, 2, 0), (0.0, 0, 1), (0.0, 1, 1), (0.0, 2, 1)], ["r_Y"])


class QuinticSections(ElementBeam):
    """As the element of order 2, quintic along X."""

    def __init__(self):
        at = (-0.5, 0.5)
        super().__init__(
            ElementBeamANCF(2).section,
            ["r_XX"] + [f"r_{k * 'X'}Y{j}" for k in range(3) for j in range(2)],
            [(0.0, 2, 0)] + [(y, k, 1) for k in range(3) for y in at], ["r_Y0", "r_Y1"])


class QuinticAxis(ElementBeam):
    """A quintic axis, and r_Y that is cubic along X."""

    def __init__(self):
        super().__init__(SectionFunctions([[1.0]]), ["r_XX", "r_Y", "r_XY"],
                         [(0.0, 2, 0), (0.0, 0, 1), (0.0, 1, 1)], ["r_Y"])


OWN = {"quintic": Quintic, "quintic sections": QuinticSections, "quintic axis": QuinticAxis}


def line(n, h, L=1.0):
    return MeshBeam.init_line(np.linspace(0.0, L, n + 1), h)


def tangent(beam, u=None):
    """Of the whole beam, dense."""
    K, nd = np.zeros((beam.N, beam.N)), beam.nd
    for e, k in enumerate(beam.kernel.tangents(np.zeros(beam.N) if u is None else u)):
        K[e * nd:(e + 2) * nd, e * nd:(e + 2) * nd] += k
    return K


def eigenvalues(beam):
    """Of the tangent at rest, scaled to unit diagonal."""
    K = tangent(beam)
    scale = 1.0 / np.sqrt(np.diag(K))
    return eigh(K * np.outer(scale, scale), eigvals_only=True)


# the quintic elements

@pytest.mark.parametrize("name", OWN)
def test_no_mode_is_stabilised_in_vain(name):
    sizes = [np.abs(mode.weights).max() for mode in OWN[name]().stabilised]
    assert min(sizes, default=1.0) > 1e-6


@pytest.mark.parametrize("name", OWN)
def test_space_and_coordinates(name):
    """X^a Y^k from coordinates taken analytically, its values and gradients."""
    element, L, h = OWN[name](), 0.7, 0.3
    mesh = MeshBeam.init_line([0.0, L], h)
    X = np.random.default_rng(0).random((2, 9))
    fields = [element.gbasis(mesh.mapping(), X, i)[0] for i in range(2 * element.nodal_dofs)]
    assert element.axis_degree == 5
    assert element.sections == ("cubic" if name == "quintic axis" else "quintic")
    powers = [(a, 0) for a in range(6)] + [
        (a, k) for a in range(4 if name == "quintic axis" else 6)
        for k in range(1, element.order + 1)]
    assert len(powers) == len(fields)
    for a, k in powers:
        f, g = Polynomial.basis(a), Polynomial.basis(k)
        q = [f.deriv(mx)(x * L) * g.deriv(my)(y * h)
             for x, (y, mx, my) in zip(element.doflocs[:, 0], 2 * element.functionals)]
        x, y = L * X[0], h * (X[1] - 0.5)
        assert_allclose(sum(c * np.asarray(v) for c, v in zip(q, fields))[0], f(x) * g(y),
                        atol=1e-13)
        assert_allclose(sum(c * v.grad for c, v in zip(q, fields))[:, 0],
                        [f.deriv()(x) * g(y), f(x) * g.deriv()(y)], atol=1e-12)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("name", OWN)
def test_three_zero_modes(name, plane):
    for n in (1, 2, 3):
        for slenderness in (10.0, 1e3, 1e5):
            h = 1.0 / slenderness
            law = StVenantKirchhoff(2e8 * (0.01 / h) ** 3, 0.3, plane=plane)
            w = eigenvalues(Beam(line(n, h), OWN[name](), law, WIDTH))
            assert np.max(np.abs(w[:3])) < 1e-13
            assert w[3] > 2e-2 / slenderness**2
    loose = Beam(line(1, 0.1), OWN[name](), law, WIDTH, formulation=Assumed(alpha=0.0))
    assert np.sum(eigenvalues(loose) < 1e-12) > 3


@pytest.mark.parametrize("law", [StVenantKirchhoff, NeoHookean])
@pytest.mark.parametrize("name", OWN)
def test_patch(name, law):
    """A constant strain on unequal elements: energy and stress exact, no force inside."""
    material = law(2.0, 0.3, plane="strain", shear_correction=1.0)
    mesh = MeshBeam.init_line([0.0, 0.2, 0.7, 1.0], 0.3)
    beam = Beam(mesh, OWN[name](), material, 0.4)
    F = np.array([[1.1, 0.2], [-0.1, 0.95]])
    if beam.element.order == 1:  # the Poisson coupling takes the section's mean, constant here
        assert len(beam.formulation.terms(beam.element, material)) == 1 + (
            law is StVenantKirchhoff)
    u = (beam.q0.reshape(-1, 2) @ F.T).ravel() - beam.q0
    C = 0.5 * (F.T @ F - np.eye(2))
    strain = np.array([C[0, 0], C[1, 1], 2 * C[0, 1]])
    assert_allclose(beam.kernel.energy(u), material.energy(strain) * 0.3 * 0.4, rtol=1e-13)
    X = np.array([[0.1, 0.8], [0.0, 0.6]])
    assert_allclose(beam.stress(u, X) - material.stress(strain)[:, None, None], 0, atol=1e-12)
    rows = beam.kernel.force(u).reshape(mesh.nvertices, -1, 2)
    assert np.max(np.abs(rows[1:-1, 0])) < 1e-13


@pytest.mark.parametrize("name", OWN)
def test_forms(name):
    """Textbook form and own form by stock assembly, and what a scene solves with."""
    mesh = MeshBeam.init_line([0.0, 0.5, 1.2], 0.2, angle=0.4)
    for formulation in ("continuum", "assumed"):
        beam = Beam(mesh, OWN[name](), StVenantKirchhoff(2.0, 0.3), 0.4, formulation)
        scale = [L**a * 0.2**b for L in (0.5,) for _, a, b in beam.element.functionals]
        rng = np.random.default_rng(0)
        u = 0.05 * (rng.uniform(-1, 1, (3, beam.nd // 2, 2)) / np.array(scale)[:, None]).ravel()
        force, _ = Scene(beam).system.assemble(u)
        own, basis = forms.of(beam), Basis(mesh, ElementVector(beam.element))
        assert_allclose(asm(own.internal_force, basis, r=beam.q0 + u), force,
                        atol=1e-11 * np.max(np.abs(force)))
        K = asm(own.tangent, basis, r=beam.q0 + u).toarray()
        assert_allclose(K, tangent(beam, u), atol=1e-11 * np.max(np.abs(K)))
        step = 1e-20j  # the derivative of the force, by the complex step
        J = np.array([beam.kernel.force(u + step * e).imag for e in np.eye(beam.N)]).T / 1e-20
        assert_allclose(K, J, atol=1e-12 * np.max(np.abs(K)))
        if formulation == "continuum":
            k_s = beam.material.shear_factor(beam.element)
            textbook = asm(forms.textbook.tangent(beam.material, beam.width, k_s), beam.basis,
                           r=beam.q0 + u).toarray()
            assert_allclose(K, textbook, atol=1e-11 * np.max(np.abs(K)))


def cantilever(name, n, slenderness, plane, weight=1.0):
    h = 1.0 / slenderness
    law = StVenantKirchhoff(2e8 * (0.01 / h) ** 3, 0.3, 7800 * 0.01 / h, plane=plane)
    scene = Scene(Beam(line(n, h), OWN[name](), law, WIDTH)).clamp("left", thickness="free")
    return scene.gravity((0, -9.81 * weight)).solve_static()


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("name, error", [("quintic", 3e-6), ("quintic sections", 3e-6),
                                         ("quintic axis", 2e-3)])
def test_the_error_does_not_depend_on_the_slenderness(name, error, plane):
    """Of 8 elements, against the inextensible line."""
    line = exact.gravity_cantilever(2e8, 0.3, 7800, 1.0, WIDTH, 0.01, model="elastica",
                                    plane=plane)[1]
    tips = []
    for slenderness in (30.0, 1e2, 1e3, 1e4, 1e5):
        state = cantilever(name, 8, slenderness, plane)
        assert len(state.steps) == 1 and state.iterations <= 27
        tips.append(state.displacement((1, 0))[1])
    found = np.array(tips) / line - 1.0
    assert np.all(np.abs(found[3:]) < error)
    assert abs(found[2] - found[4]) < 1e-5  # what a beam that is not inextensible adds
    assert abs(found[3] - found[4]) < 1e-6


def test_modes_motion_and_recovery():
    """Frequencies of the free Euler-Bernoulli beam; energy kept; the bending stress -E kappa Y."""
    E, rho, h = 2e8, 7800.0, 1e-3
    beam = Beam(line(6, h), Quintic(), StVenantKirchhoff(E, 0.0, rho), WIDTH)
    found = Scene(beam).modes(6).frequencies
    roots = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    assert_allclose(found[3:], roots**2 * np.sqrt(E * h**2 / (12 * rho)), rtol=1e-3)
    thick = Beam(line(4, 0.02), Quintic(), StVenantKirchhoff(E, 0.3, rho), WIDTH)
    history = Scene(thick).pin("left").gravity((0, -9.81)).integrate(t_end=0.03, dt=1e-3)
    assert np.ptp(history.total_energy) < 1e-10 * np.max(history.kinetic_energy)
    M = 1e-4
    state = Scene(thick).clamp("left", thickness="free").moment("right", M).solve_static()
    for recover in (True, False):
        stress = state.stress((0.4, 0.005), recover=recover)
        assert stress[0] == pytest.approx(-M * 0.005 / (WIDTH * 0.02**3 / 12), rel=1e-3)
