"""The map from the reference cell to the body: inverse, derivatives, facets, normals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import MeshBeam, MeshError

STEP = 1e-30
POINTS = np.random.default_rng(2).random((2, 30))
ALONG = np.linspace(0.0, 1.0, 9)[None]
GAUSS = np.array(np.polynomial.legendre.leggauss(8)) / 2 + [[0.5], [0.0]]


def test_reference_cell_is_mapped_to_itself():
    m = MeshBeam.init_refdom()
    assert_array_equal(m.mapping().F(m.p)[:, 0], m.p)
    assert_allclose(m.mapping().F(POINTS)[:, 0], POINTS, atol=1e-15)


def test_axis_and_sections_of_an_arc(arc):
    """On the nodes the sections are radial; the axis is within the error of a cubic."""
    mapping, h = arc.mapping(), arc.height
    for xi, node in ((0.0, 0), (1.0, 1)):
        ends = mapping.F(np.array([[xi, xi], [0.0, 1.0]]))
        radial = arc.p[:, arc.t[node]]
        assert_allclose(ends[..., 0], (1 + h / 2) * radial, atol=1e-14)  # Y points inwards
        assert_allclose(ends[..., 1], (1 - h / 2) * radial, atol=1e-14)
    axis = mapping.F(np.array([ALONG[0], 0.5 + 0 * ALONG[0]]))
    assert np.max(np.abs(np.hypot(*axis) - 1)) < 3e-4


def test_derivative(mesh):
    mapping = mesh.mapping()
    J, F = mapping.DF(POINTS), mapping.F(POINTS)
    for axis in (0, 1):
        step = np.zeros((2, 1), dtype=complex)
        step[axis] = 1j * STEP
        assert_allclose(J[:, axis], mapping.F(POINTS + step).imag / STEP, atol=1e-13)
    identity = np.einsum("ijep,jkep->ikep", mapping.invDF(POINTS), J)
    assert_allclose(identity, np.eye(2)[:, :, None, None] + 0 * J, atol=1e-13)
    det = np.linalg.det(np.moveaxis(J, (0, 1), (-2, -1)))
    assert_allclose(mapping.detDF(POINTS), det, rtol=1e-12)
    assert np.all(det > 0)
    # points of their own for each element, and a subset of the elements
    each, subset = np.repeat(POINTS[:, None], 2, axis=1), np.array([mesh.nelements - 1, 0])
    for f, whole in ((mapping.F, F), (mapping.DF, J), (mapping.detDF, mapping.detDF(POINTS)),
                     (mapping.invDF, mapping.invDF(POINTS))):
        assert_allclose(f(each, subset), whole[..., subset, :], atol=1e-13)


def test_area_is_that_inside_the_boundary(mesh):
    """The integral of detDF against half the integral of x . n over the boundary."""
    mapping, (x, w) = mesh.mapping(), GAUSS
    X = np.array([a.ravel() for a in np.meshgrid(x, x)])
    area = np.sum(mapping.detDF(X) @ np.outer(w, w).ravel())
    find = mesh.boundary_facets()
    tind, points = mapping.facet_points(x[None], find)
    n = mapping.normals(points, tind, find, mesh.t2f)
    flux = np.sum(mapping.G(x[None], find) * n, 0) * mapping.detDG(x[None], find)
    assert_allclose(np.sum(flux @ w) / 2, area, rtol=1e-9)
    if mesh.is_straight:
        assert_allclose(area, mesh.height * mesh.lengths.sum(), rtol=1e-14)


def test_facets(mesh):
    """Each facet is its side of its element, with the length detDG and an outward unit normal."""
    mapping = mesh.mapping()
    sides = [lambda s: (s, 0 * s), lambda s: (1 + 0 * s, s), lambda s: (s, 1 + 0 * s),
             lambda s: (0 * s, s)]
    s = ALONG[0]
    for local, side in enumerate(sides):
        find = mesh.t2f[local]
        assert_allclose(mapping.G(ALONG, find), mapping.F(np.array(side(s))), atol=1e-14)
        d = mapping.F(np.array(side(s + 1j * STEP))).imag / STEP
        assert_allclose(mapping.detDG(ALONG, find), np.hypot(*d), rtol=1e-12)
        elements = np.arange(mesh.nelements)
        points = np.repeat(np.array(side(s))[:, None], mesh.nelements, axis=1)
        n = mapping.normals(points, elements, find, mesh.t2f)
        assert_allclose(np.hypot(*n), 1.0, rtol=1e-14)
        assert_allclose(np.sum(n * d, 0) / np.hypot(*d), 0.0, atol=1e-13)
        outside = mapping.invF(mapping.F(points, elements) + 1e-4 * mesh.height * n, elements)
        assert np.all(np.abs(outside[1 - local % 2] - 0.5) > 0.5)


def test_folding_map_is_refused():
    """A body that folds between good nodes: a tangent that points backwards, a left-handed one."""
    p, t = np.array([[0.0, 1.0, 2.0], [0.0, 0.0, 0.0]]), np.array([[0, 1], [1, 2]])
    e = np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    n = e[::-1]
    good = dict(height=0.1, p_X=e, p_Y=n, lengths=np.ones(2))
    MeshBeam(p, t, **good)
    with pytest.raises(MeshError, match=r"folds in element 1, which starts at \(1, 0\)"):
        MeshBeam(p, t, **{**good, "p_X": np.array([[1.0, 1.0, -1.0], [0.0, 0.0, 0.0]])})
    with pytest.raises(MeshError, match="folds in element 0"):
        MeshBeam(p, t, **{**good, "p_Y": -n})
