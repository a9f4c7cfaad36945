"""The beam elements: their space, their coordinates, and what they represent exactly."""

from math import factorial

import numpy as np
import pytest
from numpy.polynomial import Polynomial, chebyshev
from numpy.testing import assert_allclose, assert_array_equal
from skfem import Basis, ElementVector, Functional
from skfem.models.poisson import mass

from conftest import MESHES
from skfem_ancf import (ElementBeamANCF, ElementBeamPatelShabana, InputError, MeshBeam, MeshError,
                        NameUnknown)
from skfem_ancf.elements.ancf import POINT_FAMILIES
from skfem_ancf.mesh.reference_cell import SECTIONS, ElementBeamP1, RefBeam, hermite, linear

ORDERS = range(1, 11)
SIZES = [(1.0, 1.0), (0.01, 3.0), (250.0, 1e-3)]
STEP = 1e-30  # of the complex step: exact to round-off
POINTS = np.random.default_rng(0).random((2, 40))


def one_element(L=1.0, h=1.0):
    return MeshBeam.init_line([0.0, L], h)


def tabulate(element, mesh, X=POINTS, tind=None):
    """Values (n, ne, np) and gradients (n, 2, ne, np) of all local functions."""
    fields = [element.gbasis(mesh.mapping(), X, i, tind)[0] for i in range(len(element.doflocs))]
    return np.array([np.asarray(f) for f in fields]), np.array([f.grad for f in fields])


def functionals(element, mesh, L, h):
    """Each coordinate applied to each local function: (element, coordinate, function).

    Derivatives are taken of the values, or of the gradient along Y, by Cauchy's integral around
    the point along a reference axis, exact for polynomials; on elements of length L and height h.
    """
    L, coordinates, n, radius = np.broadcast_to(L, mesh.nelements), 2 * element.functionals, 32, 0.5
    circle = np.exp(2j * np.pi * np.arange(n) / n)
    out = np.empty((mesh.nelements, len(coordinates), len(coordinates)))
    for k, (y, mx, my) in enumerate(coordinates):
        more, axis = (mx, 0) if mx else (max(my - 1, 0), 1)
        assert mx == 0 or my < 2
        X = np.array([[element.doflocs[k, 0]], [0.5 + y]]) + np.zeros(n, dtype=complex)
        X[axis] += radius * circle
        values, gradients = tabulate(element, mesh, X)
        if my:
            values = np.einsum("niep,iep->nep", gradients, mesh.mapping().DF(X)[:, 1] / h)
        applied = factorial(more) * (values @ circle**-more).real / n / radius**more
        out[:, k] = (applied / (h if axis else L) ** more).T
    return out


def reference_state(element, mesh):
    """Vector basis and the coordinates of the stress-free state."""
    basis = Basis(mesh, ElementVector(element), intorder=6)
    q = element.rigid(mesh)
    q[0] += mesh.p
    x = basis.zeros()
    x[basis.nodal_dofs] = q.reshape(basis.nodal_dofs.shape)
    return basis, x


# the section

@pytest.mark.parametrize("order", ORDERS)
def test_section_points(order):
    points = ElementBeamANCF(order).section_points
    if order == 1:
        expected = [0.0]
    elif order == 2:
        expected = [-0.5, 0.5]
    else:
        zeros = chebyshev.chebroots(np.eye(order - 1)[order - 2])
        expected = np.concatenate([[-0.5], 0.5 * zeros, [0.5]])
    assert_allclose(points, expected, atol=1e-14)
    assert_array_equal(points, -points[::-1])


@pytest.mark.parametrize("family", POINT_FAMILIES)
@pytest.mark.parametrize("order", ORDERS)
def test_section_functions_integrate_the_lagrange_polynomials(order, family):
    element = ElementBeamANCF(order, points=family)
    points, eta = element.section_points, np.linspace(-0.5, 0.5, 23)
    assert len(np.unique(points)) == order and np.max(np.abs(points)) <= 0.5
    if order > 1:
        assert points[0] == -0.5 and points[-1] == 0.5
    for k in range(order):
        at_points = element.section(points, k)[1]
        assert_allclose(at_points, np.eye(order)[k], atol=1e-12)
        assert element.section(0.0, k)[0] == 0.0
        others = np.delete(points, k)
        lagrange = Polynomial.fromroots(others) if order > 1 else Polynomial([1.0])
        lagrange = lagrange / np.prod(points[k] - others)
        P, dP = element.section(eta, k)
        assert_allclose(dP, lagrange(eta), atol=1e-11)
        assert_allclose(P, lagrange.integ(lbnd=0.0)(eta), atol=1e-12)


def test_fourth_order_function_in_full():
    """P_1 = h eta (-1/2 + eta/2 + 4 eta^2/3 - 2 eta^3): the printed appendix has it wrong."""
    eta = np.linspace(-0.5, 0.5, 9)
    P, _ = ElementBeamANCF(4).section(eta, 0)
    assert_allclose(P, eta * (-1 / 2 + eta / 2 + 4 * eta ** 2 / 3 - 2 * eta ** 3), atol=1e-15)


@pytest.mark.parametrize("n", range(3, 13))
def test_gauss_lobatto_points_are_the_roots(n):
    """Of (1 - x^2) P'_{n-1}: real, antisymmetric to the last digit, with the rule's exactness."""
    x = 2 * ElementBeamANCF(n, "gauss-lobatto").section_points
    assert x.dtype == np.float64 and np.array_equal(x, -x[::-1]) and np.all(np.diff(x) > 0)
    P = np.polynomial.Legendre.basis(n - 1)
    w = 2 / (n * (n - 1) * P(x)**2)
    for k in range(2 * n - 2):
        assert_allclose(w @ x**k, 2 / (k + 1) if k % 2 == 0 else 0.0, atol=1e-14)


# the space and its coordinates

@pytest.mark.parametrize("L, h", SIZES)
def test_space_is_reproduced_exactly(element, L, h):
    """{1, X, ... X^p} and {Y^k, ... X^s Y^k : k = 1..N}, from coordinates taken analytically."""
    mesh = one_element(L, h)
    values, gradients = tabulate(element, mesh)
    powers = [(a, 0) for a in range(element.axis_degree + 1)]
    powers += [(a, k) for a in range(2 * SECTIONS.index(element.sections) + 2)
               for k in range(1, element.order + 1)]
    assert len(powers) == len(element.doflocs)
    xi, eta = POINTS[0], POINTS[1] - 0.5
    for a, b in powers:  # the function (X/L)^a (2Y/h)^b
        f, g = Polynomial.basis(a), Polynomial.basis(b)(Polynomial([0.0, 2.0]))
        q = [f.deriv(mx)(x) / L ** mx * g.deriv(my)(y) / h ** my
             for x, (y, mx, my) in zip(element.doflocs[:, 0], 2 * element.functionals)]
        assert_allclose(np.tensordot(q, values, 1)[0], f(xi) * g(eta), atol=2e-12)
        grad = np.tensordot(q, gradients, 1)[:, 0] * [[L], [h]]
        assert_allclose(grad, [f.deriv()(xi) * g(eta), f(xi) * g.deriv()(eta)], atol=2e-11)


def units(element, L, h):
    return np.array([L ** -mx * h ** -my for _, mx, my in 2 * element.functionals])


@pytest.mark.parametrize("name", MESHES)
def test_functions_are_dual_to_the_coordinates(element, name):
    mesh = MESHES[name]()
    L = np.hypot(*np.diff(mesh.p)) if mesh.is_straight else mesh.lengths
    for length, matrix in zip(L, functionals(element, mesh, L, mesh.height)):
        size = units(element, length, mesh.height)
        assert_allclose(matrix * size / size[:, None], np.eye(len(matrix)), atol=1e-10)


def test_gradients_are_those_of_the_values(element, mesh):
    X = POINTS[:, :7]
    for axis in (0, 1):
        step = np.zeros((2, 1), dtype=complex)
        step[axis] = 1j * STEP
        along = mesh.mapping().DF(X)[:, axis]
        expected = tabulate(element, mesh, X + step)[0].imag / STEP
        gradients = tabulate(element, mesh, X)[1]
        assert_allclose(np.einsum("niep,iep->nep", gradients, along), expected, atol=1e-12)


def test_partition_of_unity(element, mesh):
    values, gradients = tabulate(element, mesh)
    position = [0, element.nodal_dofs]
    assert_allclose(values[position].sum(0), 1.0, atol=1e-14)
    assert_allclose(gradients[position].sum(0), 0.0, atol=1e-12)


def test_points_per_element_and_subsets(element, arc):
    value, grad = tabulate(element, arc)
    each = np.repeat(POINTS[:, None], 2, axis=1)
    subset = np.array([2, 0])
    got, got_grad = tabulate(element, arc, each, subset)
    assert_allclose(got, value[:, subset], atol=1e-15)
    assert_allclose(got_grad, grad[:, :, subset], atol=1e-13)


# elements against each other

def test_patel_shabana_is_order_two_in_other_coordinates():
    """r_Y at -+h/2 is r_Y -+ (h/2) r_YY: the same fields, and so the same mass matrix."""
    mesh = MESHES["s-curve"]()
    h = mesh.height
    node = np.eye(4)
    node[2:, 2:] = [[1.0, -h / 2], [1.0, h / 2]]
    T = np.kron(np.eye(2), node)
    ps, zheng = (tabulate(e, mesh) for e in (ElementBeamPatelShabana(), ElementBeamANCF(2)))
    for a, b in zip(ps, zheng):
        assert_allclose(a, np.tensordot(T.T, b, 1), atol=1e-14)
    M_ps, M = (mass.assemble(Basis(mesh, e)).toarray()
               for e in (ElementBeamPatelShabana(), ElementBeamANCF(2)))
    T = np.kron(np.eye(mesh.nvertices), node)
    assert_allclose(M_ps, T.T @ M @ T, atol=1e-15)


# the stress-free state

def test_stress_free_state_and_rigid_motion_are_exact(element, mesh):
    mesh = mesh.with_sections(element.sections)
    basis, q = reference_state(element, mesh)
    x = basis.global_coordinates()
    for angle, shift in ((0.0, (0.0, 0.0)), (0.3, (1.0, -2.0)), (3.9, (-7.0, 0.1))):
        Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        moved = basis.zeros()
        moved[basis.nodal_dofs] = np.einsum(
            "ij,kjn->kin", Q, q[basis.nodal_dofs].reshape(-1, 2, mesh.nvertices)
        ).reshape(basis.nodal_dofs.shape)
        moved[basis.nodal_dofs[:2]] += np.array(shift)[:, None]
        field = basis.interpolate(moved)
        expected = np.einsum("ij,jep->iep", Q, x) + np.array(shift)[:, None, None]
        assert_allclose(field, expected, atol=1e-13)
        assert_allclose(field.grad, Q[:, :, None, None] + 0 * field.grad, atol=2e-11)


@pytest.mark.parametrize("sections", ["linear", "cubic"])
def test_stress_free_state_needs_sections_of_its_own_kind(element, sections):
    mesh = MESHES["arc"]().with_sections(sections)
    if sections == element.sections:
        assert element.rigid(mesh).shape == (element.nodal_dofs, 2, mesh.nvertices)
    else:
        with pytest.raises(MeshError, match=rf"use mesh.with_sections\('{element.sections}'\)"):
            element.rigid(mesh)
    assert_array_equal(element.rigid(MESHES["straight"]().with_sections(sections)),
                       element.rigid(MESHES["straight"]()))


# attributes

def test_attributes(element):
    n, number = element.order, element.nodal_dofs
    assert number == len(element.dofnames) == len(element.functionals)
    p = element.axis_degree
    assert number == (p + 1) // 2 + n * (SECTIONS.index(element.sections) + 1)
    assert element.dofnames[:2] == ["r", "r_X"] and len(set(element.dofnames)) == number
    welded = [name for name, f in zip(element.dofnames, element.functionals) if f[1] == 0]
    assert element.welded == welded and len(welded) == n + 1
    assert element.carries_shear_parabola == (n >= 3)
    assert element.doflocs.shape == (2 * number, 2)
    assert_array_equal(element.doflocs[:, 0], np.repeat([0.0, 1.0], number))
    assert element.refdom is RefBeam and p >= 3 and p % 2 == 1
    assert f"order {n}" in repr(element)
    with pytest.raises(ValueError, match="basis functions"):
        element.gbasis(one_element().mapping(), POINTS, 2 * number)
    with pytest.raises(ValueError, match="basis functions"):
        element.gbasis(one_element().mapping(), POINTS, -1)


def test_default_quadrature_is_exact(element):
    mesh = one_element(0.7, 0.3)
    energy = Functional(lambda w: np.sum(w["r"].grad ** 2, (0, 1)) ** 2)  # degree of the strain's
    bases = [Basis(mesh, ElementVector(element), **kw)
             for kw in ({}, {"intorder": 4 * element.order + 4 * element.axis_degree + 8})]
    q = np.random.default_rng(5).standard_normal(bases[0].N)
    U, exact = (energy.assemble(basis, r=basis.interpolate(q)) for basis in bases)
    assert_allclose(U, exact, rtol=1e-11)
    M, exact = (mass.assemble(basis.with_element(element)).toarray() for basis in bases)
    assert_allclose(M, exact, atol=1e-14)


@pytest.mark.parametrize("order", [0, -1, 2.0, 1.5, True, "3", None, np.nan])
def test_bad_order(order):
    with pytest.raises(InputError, match="integer from 1 to 64"):
        ElementBeamANCF(order)


@pytest.mark.parametrize("points", ["gauss", "Chebyshev", None, [0.0]])
def test_bad_points(points):
    with pytest.raises(NameUnknown, match="'chebyshev', 'gauss-lobatto', 'equispaced'") as info:
        ElementBeamANCF(3, points=points)
    assert info.value.name == points


# the functions of the axis, and the scalar element

def test_axis_functions():
    for x, node in ((0.0, 0), (1.0, 1)):
        assert_array_equal(hermite(x), np.eye(4)[2 * node])
        assert_array_equal(hermite(x, 1), np.eye(4)[2 * node + 1])
        assert_array_equal(linear(x), np.eye(2)[node])
    x = np.linspace(0, 1, 7)
    for f, degree in ((hermite, 2), (linear, 1)):
        for d in range(degree):
            assert_allclose(f(x + 1j * STEP, d).imag / STEP, f(x, d + 1), atol=1e-14)
    assert_array_equal(linear(x, 2), 0)
    with pytest.raises(ValueError, match="derivative"):
        hermite(x, 3)


def test_scalar_element_is_nodal():
    element = ElementBeamP1()
    values = np.array([element.lbasis(element.doflocs.T, i)[0] for i in range(2)])
    assert_array_equal(values, np.eye(2))
    for i in range(2):
        d = element.lbasis(POINTS + np.array([[1j * STEP], [0]]), i)[0].imag / STEP
        assert_allclose(element.lbasis(POINTS, i)[1], [d, 0 * d], atol=1e-15)
    with pytest.raises(ValueError, match="basis functions"):
        element.lbasis(POINTS, 2)


def test_reference_cell():
    X = np.array([[0.3, 1.0, 0.6, 0.0], [0.0, 0.2, 1.0, 0.7]])
    for i in range(4):
        assert_array_equal(RefBeam.on_facet(i, X), np.arange(4) == i)
    assert_array_equal(RefBeam.normals, [[0, -1], [1, 0], [0, 1], [-1, 0]])
