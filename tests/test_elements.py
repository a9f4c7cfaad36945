"""The beam elements: their space, their coordinates, and what they represent exactly."""

from math import factorial

import numpy as np
import pytest
from conftest import MESHES
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose, assert_array_equal
from skfem import Basis, ElementVector

from skfem_ancf import ElementBeamANCF, InputError, MeshBeam, MeshError, NameUnknown
from skfem_ancf.elements.ancf import POINT_FAMILIES
from skfem_ancf.mesh.mapping import SECTIONS

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


@pytest.mark.parametrize("order", [0, -1, 2.0, 1.5, True, "3", None, np.nan])
def test_bad_order(order):
    with pytest.raises(InputError, match="integer from 1 to 64"):
        ElementBeamANCF(order)


@pytest.mark.parametrize("points", ["gauss", "Chebyshev", None, [0.0]])
def test_bad_points(points):
    with pytest.raises(NameUnknown, match="'chebyshev', 'gauss-lobatto', 'equispaced'") as info:
        ElementBeamANCF(3, points=points)
    assert info.value.name == points
