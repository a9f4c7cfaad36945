"""Meshes: construction, topology, names, refinement, parts, motion, files and bad input."""

import numpy as np
import pytest
from conftest import MESHES, quarter_arc, s_curve
from numpy.testing import assert_allclose, assert_array_equal
from skfem import Basis, FacetBasis, MeshLine, MeshQuad
from skfem.generic_utils import OrientedBoundary

from skfem_ancf import AncfError, InputError, MeshBeam, MeshError
from skfem_ancf.mesh.numbering import ElementBeamP1


def area(mesh):
    return Basis(mesh, ElementBeamP1(), intorder=8).dx.sum()


def perimeter(mesh):
    return FacetBasis(mesh, ElementBeamP1(), intorder=12).dx.sum()


def tagged(mesh):
    """The mesh with subdomains, an inner section, and an oriented and an empty boundary."""
    last = np.array([mesh.nelements - 1], dtype=np.int32)
    return mesh.with_subdomains({"first": np.array([0], dtype=np.int32), "last": last}) \
        .with_boundaries({"around": mesh.facets_around(last),
                          "inner": OrientedBoundary(np.array([1], dtype=np.int32), [0]),
                          "none": np.zeros(0, dtype=np.int32)})


def assert_same_tags(a, b):
    for which in ("boundaries", "subdomains"):
        x, y = getattr(a, which) or {}, getattr(b, which) or {}
        assert list(x) == list(y)
        for name in x:
            assert_array_equal(x[name], y[name])
            assert_array_equal(getattr(x[name], "ori", None), getattr(y[name], "ori", None))


def assert_same(a, b, atol=0.0):
    assert type(a) is type(b) is MeshBeam
    assert_array_equal(a.t, b.t)
    assert a.sections == b.sections
    for name in ("p", "p_X", "p_Y", "p_XY", "lengths", "height", "s"):
        if getattr(a, name) is None:
            assert getattr(b, name) is None
        else:
            assert_allclose(getattr(b, name), getattr(a, name), rtol=0, atol=atol)
    assert_same_tags(a, b)


def where(mesh, facets):
    """Midpoints of facets, one row each, sorted."""
    x = mesh.mapping().G(np.array([[0.5]]), np.asarray(facets))[..., 0].T
    return x[np.lexsort(np.round(x, 9).T)]


# construction and topology

def test_line():
    m = MeshBeam.init_line([0, 1, 3], 0.2, origin=(1.0, 2.0), angle=np.pi / 2)
    assert_allclose(m.p, [[1, 1, 1], [2, 3, 5]], atol=1e-15)
    assert_array_equal(m.t, [[0, 1], [1, 2]])
    assert_allclose(m.p_X, np.outer([0, 1], np.ones(3)), atol=1e-15)
    assert_allclose(m.p_Y, np.outer([-1, 0], np.ones(3)), atol=1e-15)
    assert_array_equal(m.lengths, [1, 2])
    assert m.param() == 2.0 and m.height == 0.2 and m.is_straight
    assert_array_equal(m.params(), m.lengths)


def test_facets_and_elements_name_each_other(mesh):
    n, ne = mesh.nvertices, mesh.nelements
    assert mesh.nfacets == n + 2 * ne and len(mesh.boundary_facets()) == 2 * ne + 2
    for facet, (a, b) in enumerate(mesh.f2t.T):
        assert facet in mesh.t2f[:, a]
        assert b == -1 or facet in mesh.t2f[:, b]
    assert_array_equal(np.bincount(mesh.t2f.ravel()), 1 + (mesh.f2t[1] >= 0))
    for local, nodes in enumerate(mesh.elem.refdom.facets):
        assert_array_equal(mesh.facets[:, mesh.t2f[local]], mesh.t[nodes])
    assert mesh.f2t.dtype == mesh.t2f.dtype == mesh.t.dtype == np.int32


def test_own_boundaries_and_subdomains(arc):
    m = arc.with_boundaries({"root": lambda x: x[1] < 1e-9, "outer": lambda x: np.hypot(*x) > 1.1})
    assert_array_equal(m.boundaries["root"], m.boundaries["left"])
    assert_array_equal(m.boundaries["outer"], m.boundaries["bottom"])
    axis = {"axis": lambda x: np.abs(np.hypot(*x) - 1) < 1e-9}
    assert_array_equal(arc.with_boundaries(axis).boundaries["axis"], [0, 3])
    inner = arc.with_boundaries(axis, boundaries_only=False)
    assert_array_equal(inner.boundaries["axis"], [0, 1, 2, 3])
    assert_array_equal(arc.with_subdomains({"low": lambda x: x[1] < 0.8}).subdomains["low"], [0, 1])
    assert_array_equal(arc.facets_satisfying(lambda x: x[0] > 0.8), arc.normalize_facets(
        lambda x: x[0] > 0.8))
    assert_array_equal(arc.normalize_facets(["left", "right"]), [0, 3])


def test_oriented_facets():
    m = MESHES["straight"]()
    for normal, ori in (([1, 0], 0), ([-1, 0], 1)):
        f = m.facets_satisfying(lambda x: np.isclose(x[0], 0.5), normal=normal)
        assert_array_equal(f, [1])
        assert_array_equal(f.ori, [ori])
    around = m.facets_around([1])
    n = FacetBasis(m, ElementBeamP1(), facets=around).normals
    x = FacetBasis(m, ElementBeamP1(), facets=around).global_coordinates()
    out = np.sum(n * (x - np.array([0.75, 0.0])[:, None, None]), axis=0)
    assert np.all(out > 0) and len(around) == 4


# curved geometry

def ellipse(s):
    return np.array([2.0 * np.cos(s), np.sin(s)])


def ellipse_derivative(s):
    return np.array([-2.0 * np.sin(s), np.cos(s)])


ELLIPSE_QUARTER = 2.422112055136919  # 2 E(3/4)


@pytest.mark.parametrize("dr", [None, ellipse_derivative])
def test_arc_length(dr):
    m = MeshBeam.init_curve(ellipse, np.linspace(0, np.pi / 2, 5), 0.1, dr=dr)
    assert_allclose(m.lengths.sum(), ELLIPSE_QUARTER, rtol=1e-10)
    d = ellipse_derivative(m.s)
    assert_allclose(m.p_X, d / np.hypot(*d), atol=1e-14)
    assert_allclose(m.p_Y, np.array([-d[1], d[0]]) / np.hypot(*d), atol=1e-14)
    assert_allclose(m.p, ellipse(m.s), atol=1e-15)


@pytest.mark.parametrize("sections, bound, rate", [("linear", 1e-3, 2), ("cubic", 1e-6, 4)])
def test_area_converges_to_that_of_the_exact_body(sections, bound, rate):
    """Height times length, whatever the curvature."""
    errors = []
    for n in (8, 16, 32):
        m = MeshBeam.init_curve(ellipse, np.linspace(0, np.pi / 2, n + 1), 0.3)
        errors.append(abs(area(m.with_sections(sections)) / (0.3 * ELLIPSE_QUARTER) - 1))
    assert errors[-1] < bound, errors
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(rates - rate) < 0.2), rates


@pytest.mark.parametrize("r", [s_curve, quarter_arc])
@pytest.mark.parametrize("how", [2, [0], [1, 2]])
def test_refined_nodes_lie_on_the_curve(r, how):
    m = r()
    fine = m.refined(how)
    assert_array_equal(fine.p, m.curve(fine.s))
    _p, tangent = m.curve.nodes(fine.s)
    assert_array_equal(fine.p_X, tangent)
    assert_allclose(fine.lengths, m.curve.lengths(fine.s[:-1], fine.s[1:]), rtol=1e-14)
    assert_allclose(fine.lengths.sum(), m.lengths.sum(), rtol=1e-10)
    assert fine.nelements > m.nelements and np.all(np.diff(fine.s) > 0)


# refinement

def test_uniform_refinement(mesh):
    fine = mesh.refined(2)
    assert fine.nelements == 4 * mesh.nelements
    assert_allclose(fine.p[:, ::4], mesh.p, atol=0)
    assert_allclose(fine.lengths.reshape(-1, 4).sum(1), mesh.lengths, rtol=1e-9)
    assert_array_equal(fine.t, [np.arange(fine.nelements), np.arange(1, fine.nvertices)])
    assert fine.height == mesh.height and fine.is_straight == mesh.is_straight
    assert_same(mesh.refined(0), mesh)
    assert_same(mesh.refined().refined(), fine)
    assert_same(mesh.refined(np.int64(2)), fine)


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("elements", [[0], [2], [0, 2], [0, 1, 2], np.array([1]), (2, 1), {1},
                                      np.array([True, False, True]), []])
def test_adaptive_refinement(curved, elements):
    mesh = MESHES["arc" if curved else "unequal"]()
    chosen = np.nonzero(elements)[0] if getattr(elements, "dtype", int) == bool else elements
    fine = mesh.refined(elements)
    assert fine.nelements == mesh.nelements + len(chosen)
    assert_array_equal(fine.t, [np.arange(fine.nelements), np.arange(1, fine.nvertices)])
    s = np.sort(np.concatenate([mesh.s, [0.5 * (mesh.s[e] + mesh.s[e + 1]) for e in chosen]]))
    assert_allclose(fine.s, s, atol=1e-15)
    assert_allclose(fine.lengths.sum(), mesh.lengths.sum(), rtol=1e-12)


@pytest.mark.parametrize("how", [1, [1], [0, 2]])
def test_refinement_keeps_names_where_they_are(how):
    """Naming and refining commute."""
    tests = {"root": lambda x: x[0] < 1e-9, "inner": lambda x: np.isclose(x[0], 0.5),
             "upper": lambda x: (x[1] > 0.09) & (x[0] < 1.0)}
    parts = {"front": lambda x: x[0] < 1.0, "back": lambda x: x[0] > 1.0}
    m = MESHES["straight"]()
    a = m.with_boundaries(tests, boundaries_only=False).with_subdomains(parts).refined(how)
    b = m.refined(how).with_boundaries(tests, boundaries_only=False).with_subdomains(parts)
    assert_same_tags(a, b)
    assert len(a.subdomains["front"]) + len(a.subdomains["back"]) == a.nelements


@pytest.mark.parametrize("sections", ["linear", "cubic"])
def test_refinement_without_the_curve_keeps_the_body(tmp_path, sections):
    """A loaded mesh has lost r(s): its own cubics are halved, exactly."""
    m = s_curve().with_sections(sections)
    m.save_npz(tmp_path / "m.npz")
    loaded = MeshBeam.load_npz(tmp_path / "m.npz")
    fine = loaded.refined([1, 3]).refined(1)
    assert loaded.curve is None
    assert_allclose(area(fine), area(m), rtol=1e-12)
    assert_allclose(perimeter(fine), perimeter(m), rtol=1e-7)
    x = np.array([[0.1, 0.6, 0.9], [0.0, 0.7, 1.0]])
    at = m.mapping().F(x).reshape(2, -1)
    cells = fine.element_finder()(*at)
    X = fine.mapping().invF(at[:, :, None], cells)
    assert np.all(np.abs(X - 0.5) < 0.5 + 1e-9)
    assert_allclose(X[1, :, 0], np.tile(x[1], m.nelements), atol=1e-12)


# parts of a mesh

@pytest.mark.parametrize("elements", [[0, 1], [2], [2, 0], np.array([1, 2]), "last", {0, 2},
                                      np.array([True, False, True])])
def test_restrict(elements):
    mesh = tagged(MESHES["arc"]().with_sections("cubic"))
    part, nodes = mesh.restrict(elements, return_mapping=True)
    kept = np.unique(mesh.normalize_elements(elements))
    assert_array_equal(part.p, mesh.p[:, nodes])
    assert_array_equal(nodes[part.t], mesh.t[:, kept])
    assert_array_equal(part.lengths, mesh.lengths[kept])
    assert_array_equal(part.p_XY, mesh.p_XY[:, nodes])
    for name, facets in mesh.boundaries.items():
        there = np.asarray(facets)[np.isin(facets, mesh.t2f[:, kept])]
        assert_allclose(where(part, part.boundaries[name]), where(mesh, there), atol=1e-14)
    for name, e in mesh.subdomains.items():
        assert_array_equal(kept[part.subdomains[name]], np.intersect1d(e, kept))
    assert_allclose(area(part), Basis(mesh, ElementBeamP1(), elements=kept,
                                      intorder=8).dx.sum(), rtol=1e-13)
    assert part.refined().nelements == 2 * len(kept)
    bare = mesh.restrict(elements, skip_boundaries=True, skip_subdomains=True)
    assert bare.boundaries is None and bare.subdomains is None


# files

def test_round_trip(mesh, tmp_path):
    for original in (mesh, tagged(mesh) if mesh.nelements > 1 else mesh):
        original.save(tmp_path / "m.npz")
        back = MeshBeam.load(tmp_path / "m.npz")
        back.save(str(tmp_path / "n.npz"))
        assert_same(MeshBeam.load(str(tmp_path / "n.npz")), back)
        assert_same(original, back)


def test_load_of_another_mesh(tmp_path):
    MeshQuad().save_npz(tmp_path / "quad.npz")
    with pytest.raises(MeshError, match=r"quad.npz' contains no beam: \['height', 'lengths'"):
        MeshBeam.load(tmp_path / "quad.npz")


# finding elements


def test_element_finder_on_surfaces_sections_and_ends(mesh):
    find, finder = np.arange(mesh.nfacets), mesh.element_finder()
    x = mesh.mapping().G(np.array([[0.0, 0.3, 1.0]]), find)
    cells = finder(*x.reshape(2, -1)).reshape(x.shape[1:])
    touching = np.array([np.unique(np.r_[e - 1, e, e + 1]) for e in mesh.f2t[0]], dtype=object)
    for k, near in enumerate(touching):
        assert set(cells[k]) <= set(near)
    X = mesh.mapping().invF(x.reshape(2, -1, 1), cells.ravel())
    assert np.max(np.abs(X - 0.5)) < 0.5 + 1e-9
    assert_array_equal(finder(*mesh.p)[1:-1], np.arange(mesh.nelements - 1))  # the left of two
    assert len(finder(*np.zeros((2, 0)))) == 0


def test_element_finder_of_a_coil():
    """Long elements of neighbouring coils are nearer than the right one."""
    m = MeshBeam.init_curve(lambda s: (1 + 0.004 * s) * np.array([np.cos(s), np.sin(s)]),
                            np.linspace(0, 20 * np.pi, 62), 0.02)
    X = np.random.default_rng(6).random((2, 20))
    cells = m.element_finder()(*m.mapping().F(X).reshape(2, -1))
    assert_array_equal(cells, np.repeat(np.arange(61), 20))


# bad input


@pytest.mark.parametrize("x, message", [
    ([0, 1, 0.5], "x must increase .* element 1 from 1 to 0.5 has no length"),
    ([0, 1, 1], "element 1 from 1 to 1 has no length"),
    ([1, 0], "must increase along the axis"),
    ([0.0], "at least two nodes, got 1"), ([], "at least two nodes, got 0"),
    ([0, np.nan], "x has a value that is NaN or infinite: nan"),
    ([0, np.inf], "x has a value that is NaN or infinite: inf"),
    ([[0, 1]], r"x must have shape \(n\), as np.linspace.*, got \(1, 2\)"),
    (3, r"x must have shape .*, as np.linspace\(0, length, elements \+ 1\), got .*: 3"),
    ("abc", "x must be an array of numbers"), ([0, 1j], "x must be real"),
])
def test_bad_nodes(x, message):
    with pytest.raises(InputError, match=message):
        MeshBeam.init_line(x, 0.1)


def circle(s):
    return np.array([np.cos(s), np.sin(s)])


@pytest.mark.parametrize("r, s, height, message", [
    (circle, np.linspace(0, 1, 9), 2.01,
     "radius of curvature, 1, is below half the height, 1.005"),
    (lambda s: np.array([s, 5 * s ** 2]), np.linspace(-1, 1, 5), 0.25,
     "folds near s = (0|-0.03125): "),
    (lambda s: np.array([s ** 3, 0 * s]), [-1, 0, 1], 0.1, "is zero at s = 0"),
    (lambda s: np.array([s ** 3, 0 * s]), [-1, 1], 0.1, "is zero at s = 0"),
    (lambda s: 0 * np.array([s, s]), [0, 1], 0.1, "is zero"),
    (lambda s: np.array([s ** 2, 0 * s]), [-1, -0.3, 1], 0.1, "is zero|folds"),
    (lambda s: np.array([s, s > 0.5]) * 1.0, [0, 0.4, 1], 0.1,
     "r jumps, or its derivative misses it by .*, between s = 0.4 and 1"),
    (lambda s: s, [0, 1], 0.1, r"r\(s\) must have shape \(2, 2\), got \(2,\)"),
    (lambda s: np.array([s, s, s]), [0, 1], 0.1, r"r\(s\) must have shape"),
    (lambda s: circle(s).T, [0, 0.1, 0.2], 0.1, r"r\(s\) must have shape"),
    (lambda s: np.array([s, np.nan * s]), [0, 1], 0.1, r"r\(s\) has a value that is NaN"),
    (lambda s: np.array([s, 1j * s]), [0, 1], 0.1, r"r\(s\) must be real"),
    (circle, [0, 2 * np.pi], 0.1, "element 0 from .* has no length"),
])
def test_bad_curves(r, s, height, message):
    with pytest.raises(InputError, match=message):
        MeshBeam.init_curve(r, s, height)


P = np.array([[0.0, 1.0, 2.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize("p, t, message", [
    (P, [[1, 0], [2, 1]], "numbered along the axis"),
    (P, [[0, 2], [1, 1]], "numbered along the axis"),
    (P, [[0, 0], [1, 1]], "numbered along the axis"),
    (P, [[0], [1]], "node 2 of 3 is only in the nodes: every node is part"),
    (P, [[0, 1, 2], [1, 2, 3]], "node 3 of 3 is only in t"),
    (P, np.zeros((2, 0), int), r"shape \(2, n\), got \(2, 0\)"),
    (P, [[0], [1], [2]], r"shape \(2, n\), got \(3, 1\)"),
    (P, [[0], [1], [2], [1]], "to_meshquad"),
    (P[:1], [[0, 1], [1, 2]], r"the nodes must have shape \(2, n\), got \(1, 3\)"),
    (P.T, [[0, 1], [1, 2]], r"the nodes must have shape \(2, n\)"),
    (P * np.nan, [[0, 1], [1, 2]], "the nodes has a value that is NaN"),
    (P, [[0, 1], [1, 2]], "p_X is missing: use MeshBeam.init_line"),
])
def test_bad_direct_construction(p, t, message):
    with pytest.raises(InputError, match=message):
        MeshBeam(p, np.array(t), height=0.1)


@pytest.mark.parametrize("action, message", [
    (lambda m: m.refined([3]), "numbered 0 to 2, got 3"),
    (lambda m: m.refined(np.array([-1])), "numbered 0 to 2, got -1"),
    (lambda m: m.refined(-1), "refinements must be an integer from 0 to 22 .*, got -1"),
    (lambda m: m.restrict([0, 7]), "numbered 0 to 2, got 7"),
    (lambda m: m.restrict([]), "at least one element"),
    (lambda m: Basis(m, ElementBeamP1(), elements=[5]), "numbered 0 to 2, got 5"),
    (lambda m: m.refined("tip"), "unknown subdomain 'tip'; known: 'first', 'last'"),
    (lambda m: m.refined(["tip"]), "unknown subdomain 'tip'"),
    (lambda m: m.normalize_facets("tip"),
     "unknown boundary 'tip'; known: 'left', 'right', 'bottom', 'top', 'around'"),
    (lambda m: m.normalize_facets(["left", "tip"]), "unknown boundary 'tip'"),
    (lambda m: m + m, r"cannot be joined with \+: .*Scene"),
    (lambda m: m @ m, "cannot be joined with @"),
    (lambda m: m @ MeshLine(), "cannot be joined with @"),
    (lambda m: m.mirrored((1, 0)), "cannot be mirrored"),
    (lambda m: m.morphed(lambda p: p[0]), "cannot be morphed"),
    (lambda m: m.smoothed(), "cannot be smoothed"),
    (lambda m: m.scaled((1, 2)), r"one positive factor, got \(1, 2\)"),
    (lambda m: m.scaled(0.0), "one positive factor"), (lambda m: m.scaled(-1), "one positive"),
    (lambda m: m.scaled(np.nan), "factors has a value"),
    (lambda m: m.translated((1, 2, 3)), r"the shift must have shape \(2\), .* got \(3,\)"),
    (lambda m: m.rotated(np.nan), "angle must be finite"),
    (lambda m: m.rotated(1.0, about=3), "about must have shape"),
    (lambda m: m.element_finder()(np.array([np.nan]), np.array([0.0])), "the points has a value"),
    (lambda m: m.with_sections("quadratic"), "known: 'linear', 'cubic'"),
    (lambda m: MeshBeam.from_mesh(m), "height must be a number"),
    (lambda m: MeshBeam.init_line([0, 1, 2], height=[0.1, 0.2, 0.1]), "np.interp"),
])
def test_refused(action, message):
    with pytest.raises(AncfError, match=message):
        action(tagged(MESHES["straight"]()))


def test_the_mapping_of_a_mesh_has_its_own_arrays():
    """What a user does to the arrays that he gave changes neither the mesh nor its mapping."""
    given = {name: np.array(getattr(MeshBeam.init_line([0.0, 1.0, 2.0], height=0.1), name))
             for name in ("doflocs", "t", "p_X", "p_Y", "lengths")}
    mesh = MeshBeam(**given, height=0.1)
    given["doflocs"][:] += 5.0
    given["lengths"][:] *= 3.0
    middle = mesh.mapping().F(np.array([[0.5], [0.5]]))[:, :, 0]
    np.testing.assert_allclose(middle, [[0.5, 1.5], [0.0, 0.0]], rtol=0, atol=1e-15)
