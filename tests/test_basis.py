"""scikit-fem's own machinery on beams: bases, coordinates by name, projection, forms, solvers."""

from math import factorial

import numpy as np
import pytest
from conftest import MESHES
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csr_matrix
from skfem import (Basis, BilinearForm, ElementVector, FacetBasis, Functional, LinearForm, condense,
                   enforce, mpc, penalize, solve)
from skfem.helpers import ddot, div, dot, eye, sym_grad, trace
from skfem.models.poisson import laplace

from skfem_ancf import ElementBeamANCF


@pytest.fixture
def beam():
    """A vector basis of order 3 on three straight elements with one named part."""
    m = MESHES["straight"]().with_subdomains({"tip": np.array([2])})
    return Basis(m, ElementVector(ElementBeamANCF(3)))


# coordinates by name


@pytest.mark.parametrize("name, node", [("left", 0), ("right", 3)])
def test_dofs_of_an_end(beam, name, node):
    dofs = beam.get_dofs(name)
    assert_array_equal(dofs.all(), beam.nodal_dofs[:, node])
    assert_array_equal(dofs.flatten(), beam.nodal_dofs[:, node])
    assert list(dofs.nodal) == [f"{n}^{i}" for n in ("r", "r_X", "r_Y0", "r_Y1", "r_Y2")
                                for i in (1, 2)]
    assert_array_equal(dofs.all(["r^1", "r_Y2^2"]), beam.nodal_dofs[[0, 9], node])
    assert_array_equal(dofs.nodal["r_X^2"], beam.nodal_dofs[3, node])
    assert_array_equal(dofs.keep(["r^1", "r^2"]).all(), beam.nodal_dofs[:2, node])
    assert_array_equal(dofs.drop(["r_X^1", "r_X^2"]).all(),
                       np.delete(beam.nodal_dofs[:, node], [2, 3]))
    assert_array_equal(dofs.keep(["r^1", "r^2"]).keep("r^1"), dofs.keep("r^1"))
    assert_array_equal(dofs.drop("no such"), dofs)
    assert len(dofs.keep("no such")) == 0
    assert_array_equal(beam.get_dofs(name, skip=["r^1"]).all(), beam.nodal_dofs[1:, node])


# functions of the space

def in_the_space(x):
    """A linear function of the place: in every space, on every mesh."""
    return 2.0 + 3.0 * x[0] - 1.5 * x[1]


def coordinates_in_the_space(basis):
    """The coordinates of that function: of the stress-free state along its gradient."""
    q = basis.zeros()
    q[basis.nodal_dofs] = np.einsum("i,kin->kn", [3.0, -1.5], basis.elem.rigid(basis.mesh))
    q[basis.nodal_dofs[0]] = in_the_space(basis.mesh.p)
    return q


@pytest.mark.parametrize("name", ["unequal", "inclined", "arc"])
def test_projection_is_exact_in_the_space(element, name):
    mesh = MESHES[name]().with_sections(element.sections)
    basis = Basis(mesh, element)
    q = basis.project(in_the_space)
    u = basis.interpolate(q)
    assert_allclose(u, in_the_space(basis.global_coordinates()), atol=1e-11)
    g = np.array([3.0, -1.5])
    assert_allclose(u.grad, g[:, None, None] + 0 * u.grad, atol=2e-9)
    exact = coordinates_in_the_space(basis)
    size = [np.min(mesh.lengths) ** mx / factorial(mx) * mesh.height ** my
            for _, mx, my in element.functionals]
    atol = 1e-9 if element.axis_degree < 7 else 3e-7  # the mass is worse conditioned
    assert_allclose((q - exact)[basis.nodal_dofs].T * size, 0, atol=atol)


@pytest.mark.parametrize("name", ["unequal", "inclined", "s-curve"])
def test_probes(element, name):
    """Values anywhere: inside, on surfaces, between elements, at the ends."""
    mesh = MESHES[name]().with_sections(element.sections)
    basis = Basis(mesh, element, intorder=4)
    q = coordinates_in_the_space(basis)
    X = np.array([a.ravel() for a in np.meshgrid([0.0, 0.3, 1.0], [0.0, 0.5, 0.8, 1.0])])
    x = mesh.mapping().F(X).reshape(2, -1)
    assert basis.probes(x).shape == (x.shape[1], basis.N)
    assert_allclose(basis.probes(x) @ q, in_the_space(x), atol=1e-12)
    assert_allclose(basis.interpolator(q)(x), in_the_space(x), atol=1e-12)
    three = x.reshape(2, mesh.nelements, -1)
    assert_allclose(basis.interpolator(q)(three), in_the_space(three), atol=1e-12)
    assert_allclose(basis.point_source(x[:, 5]) @ q, in_the_space(x[:, 5]), atol=1e-12)
    vector = basis.with_element(ElementVector(element))
    both = np.repeat(q, 2)
    assert_allclose((vector.probes(x) @ both).reshape(2, -1), [in_the_space(x)] * 2, atol=1e-12)
    assert_allclose(vector.interpolator(both)(x), [in_the_space(x)] * 2, atol=1e-12)


# kinds of bases


@pytest.mark.parametrize("name", ["unequal", "inclined", "arc", "s-curve, cubic sections"])
def test_divergence_theorem(element, name):
    mesh = MESHES[name]()
    basis = Basis(mesh, ElementVector(element), intorder=2 * element.maxdeg + 8)
    q = np.random.default_rng(2).standard_normal(basis.N)
    flux = Functional(lambda w: dot(w["u"], w.n))
    total = Functional(lambda w: div(w["u"])).assemble(basis, u=q)
    surface = basis.boundary(intorder=2 * element.maxdeg + 8)
    assert_allclose(flux.assemble(surface, u=q), total, atol=1e-8)
    # and on one element alone, whose boundary crosses the body
    own = FacetBasis(mesh, ElementVector(element), facets=mesh.facets_around([0]),
                     intorder=2 * element.maxdeg + 8)
    part = Functional(lambda w: div(w["u"])).assemble(basis.with_elements([0]), u=q)
    assert_allclose(flux.assemble(own, u=q), part, atol=1e-8)


# forms and solvers


def poisson(mesh, element, load, exact, how="condense"):
    """-Laplace u = load with u given at both ends and no flux elsewhere; the largest error."""
    basis = Basis(mesh, element, intorder=12)
    A, b = laplace.assemble(basis), LinearForm(lambda v, w: load(w.x) * v).assemble(basis)
    x = basis.zeros()
    # a welded face: the value at the node and the slopes of its section
    ends = basis.get_dofs(["left", "right"])
    D = ends.all(element.welded)
    x[ends.all("r")] = exact(basis.doflocs[:, ends.all("r")])
    if how == "condense":
        y = solve(*condense(A, b, x=x, D=D))
    elif how == "enforce":
        y = solve(*enforce(A, b, x=x, D=D))
    elif how == "penalize":
        y = solve(*penalize(A, b, x=x, D=D))
    else:  # constraints x_S = T x_M + g, with nothing to depend on
        S = D
        M = np.setdiff1d(np.arange(basis.N), S)
        y = solve(*mpc(A, b, S=S, M=M, T=csr_matrix((len(S), len(M))), g=x[S]))
    X = np.array([a.ravel() for a in np.meshgrid(np.linspace(0, 1, 9), [0.0, 0.5, 1.0])])
    at = mesh.mapping().F(X).reshape(2, -1)
    return np.max(np.abs(basis.probes(at) @ y - exact(at)))


@pytest.mark.parametrize("how", ["condense", "enforce", "penalize", "mpc"])
def test_poisson_in_the_space(element, how):
    """u = X^3 - 2 X, which every space holds."""
    error = poisson(MESHES["unequal"](), element, lambda x: -6 * x[0],
                    lambda x: x[0] ** 3 - 2 * x[0], how)
    assert error < (1e-11 if how != "penalize" else 1e-5)


def elasticity(E, nu):
    """Linear plane stress."""
    lam, mu = E * nu / (1 - nu ** 2), E / (2 * (1 + nu))

    @BilinearForm
    def form(u, v, w):
        e = sym_grad(u)
        return ddot(lam * eye(trace(e), 2) + 2 * mu * e, sym_grad(v))

    return form


@pytest.mark.parametrize("name", ["straight", "inclined"])
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_traction_is_exact(name, order):
    """A bar pulled at its end: uniform stress, Poisson contraction, exact for every order."""
    mesh, E, nu, sigma = MESHES[name](), 200.0, 0.3, 1.7
    basis = Basis(mesh, ElementVector(ElementBeamANCF(order)))
    e1, e2 = mesh.p_X[:, 0], mesh.p_Y[:, 0]
    stress = sigma * np.outer(e1, e1)
    f = LinearForm(lambda v, w: dot(np.einsum("ij,jep->iep", stress, w.n), v)).assemble(
        basis.boundary())
    K = elasticity(E, nu).assemble(basis)
    y = solve(*condense(K, f, D=np.r_[basis.get_dofs("left").all(["r^1", "r^2"]),
                                      basis.get_dofs("left").all("r_X^1" if abs(e1[0]) < abs(e1[1])
                                                                 else "r_X^2")]))
    g = basis.interpolate(y).grad
    strain = sigma / E * (np.outer(e1, e1) - nu * np.outer(e2, e2))
    symmetric = (g + np.swapaxes(g, 0, 1)) / 2
    assert_allclose(symmetric, strain[:, :, None, None] + 0 * g, atol=1e-13)
