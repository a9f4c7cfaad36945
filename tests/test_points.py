"""Material points, one and many: found, remembered, refused, and what they give."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from conftest import quarter_arc, s_curve
from test_io import affine
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        InputError, MeshBeam, MeshError, NameUnknown, NeoHookean, Scene, Section,
                        StVenantKirchhoff)
from skfem_ancf.mesh import location as finder
from skfem_ancf.beam.strains import strain_at

STEEL = StVenantKirchhoff(E=1e6, nu=0.3, density=10.0)
LINE = MeshBeam.init_line([0, 0.3, 1.0], height=0.1)
METHODS = ("displacement", "position", "velocity", "strain", "stress")
MESHES = {"straight": lambda: MeshBeam.init_line([-1.0, -0.4, 0.3, 1.2], 0.1, angle=0.7),
          "arc": lambda: quarter_arc(height=0.1), "s-curve": lambda: s_curve(0.1)}
TAPERS = {True: lambda: MeshBeam.init_line([0.0, 0.5, 1.2], height=lambda x: 0.1 - 0.05 * x),
          False: lambda: MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                             [0.0, 0.5, 1.2], height=lambda s: 0.1 - 0.05 * s)}
SETTINGS = dict(max_examples=60, deadline=None, database=None, derandomize=True)
PART = st.floats(0.0, 1.0)


def inside(mesh, n=40, seed=0):
    """Elements and points of a body, some of them on faces, between elements and on the axis."""
    rng = np.random.default_rng(seed)
    e, X = rng.integers(0, mesh.nelements, n), rng.random((2, n))
    X[0, :8], X[1, 4:12] = np.tile([0.0, 1.0], 4), np.repeat([0.0, 1.0], 4)
    X[1, 12:16] = 0.5
    return e, X, mesh.mapping().F(X[:, :, None], e)[..., 0]


def bent(mesh, element):
    return Scene(Beam(mesh, element, STEEL, 0.1)).clamp("left").point_force(
        (2, -3), at=mesh.p[:, -1]).solve_static()


def agree(state, x, tol=1e-13, names=METHODS, beam=None):
    """All that is known at points, one by one and together."""
    for name in names:
        for options in ({}, {"recover": False}) if name in ("strain", "stress") else ({},):
            ask = getattr(state, name)
            many = ask(x, beam, **options)
            one = np.array([ask(tuple(p), beam, **options) for p in x.T.tolist()]).T
            assert_allclose(one, many, rtol=0, atol=tol * np.abs(many).max(),
                            err_msg=f"{name} {options}")


def loaded(beam):
    end = beam.mesh.p[:, -1]
    return Scene(beam).clamp("left").point_force((0.5, -1.5), at=end).solve_static()


@pytest.mark.parametrize("mesh", MESHES)
def test_every_element(mesh, element):
    """On faces, between elements, on the axis, and anywhere; at rest."""
    state = loaded(Beam(MESHES[mesh](), element, STEEL, 0.1))
    agree(state, inside(state.beams[0].mesh)[2])


@pytest.mark.parametrize("mesh", ["straight", "arc"])
@pytest.mark.parametrize("kind", ["taper", "profile", "layers", "law", "tapered profile",
                                  "tapered layers"])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_other_sections_and_laws(kind, element, mesh):
    mesh, material, section = MESHES[mesh](), STEEL, None
    if "taper" in kind:
        mesh = TAPERS[mesh.is_straight]()
    if "profile" in kind:
        section = Section.profile("I", width=0.1, web=0.04, flange=0.01)
    elif "layers" in kind:
        material, section = None, Section.layers(
            (0.02, STEEL), (None if "taper" in kind else 0.08, STEEL.replace(E=3e6)), width=0.1)
    elif kind == "law" and element.order:
        material = NeoHookean(1e6, 0.3)
    beam = Beam(mesh, element, material, None if section else 0.1, section=section)
    agree(loaded(beam), inside(mesh, 30)[2])


@pytest.mark.parametrize("mesh", [LINE, s_curve(), quarter_arc()], ids=["line", "s-curve", "arc"])
def test_points_of_an_affine_body(mesh):
    """x goes to A x; the strain is (F^T F - 1) / 2, turned into the frame of the section."""
    A = np.array([[1.1, 0.2], [-0.1, 0.9]])
    state = affine(Beam(mesh, ElementBeamANCF(2), STEEL, 0.1, "continuum"), A)
    e, X, x = inside(mesh)
    assert_allclose(state.position(x), A @ x, atol=1e-12)
    assert_allclose(state.displacement(x), A @ x - x, atol=1e-12)
    C = 0.5 * (A.T @ A - np.eye(2))
    frame = mesh.mapping().frame(X[:, :, None], e)[..., 0]
    E = np.einsum("iJp,ij,jKp->JKp", frame, C, frame)
    assert_allclose(state.strain(x, recover=False), [E[0, 0], E[1, 1], E[0, 1]], atol=1e-10)


@pytest.mark.parametrize("mesh", [
    LINE, s_curve(), quarter_arc(), MeshBeam.init_line(np.linspace(0, 1, 30) ** 3, height=0.3),
    MeshBeam.init_curve(lambda s: (1 + 0.03 * s) * np.array([np.cos(s), np.sin(s)]),
                        np.linspace(0, 20, 41), height=0.15)],
    ids=["line", "s-curve", "arc", "graded", "coil"])
def test_finder_finds_the_point_again(mesh):
    e, X, x = inside(mesh, 300)
    found, at, outside = finder.Finder(mesh)(x)
    assert np.all(outside == 0)
    assert_allclose(mesh.mapping().F(at[:, :, None], found)[..., 0], x, atol=1e-11)
    within = (X[0] > 1e-6) & (X[0] < 1 - 1e-6)
    assert_array_equal(found[within], e[within])
    # between two elements: the left one
    nodes = mesh.p[:, mesh.t[0, 1:]]
    assert_array_equal(finder.Finder(mesh)(nodes)[0], np.arange(mesh.nelements - 1))
    away = x + 3.0 * np.max(np.abs(mesh.p)) + 9.0
    find = finder.Finder(mesh)
    assert np.all(find(away)[2] > find.allowed)


def test_gaps_and_parts_at_other_places():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 11), height=0.1).restrict(np.array([0, 1, 5, 6]))
    find = finder.Finder(mesh)
    x = np.array([[0.0, 0.2, 0.2 + 1e-9, 0.3, 0.5, 0.6, 0.7, 0.75], np.zeros(8)])
    e, _X, outside = find(x)
    assert_array_equal(e[[0, 1, 4, 5, 6]], [0, 1, 2, 2, 3])
    assert_array_equal(outside > find.allowed, [0, 0, 0, 1, 0, 0, 0, 1])


def test_points_of_several_beams():
    a = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamANCF(3), STEEL, 0.1, name="a")
    b = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1, origin=(2, 1), angle=0.5),
             ElementBeamCable(5), STEEL, 0.1, name="b")
    scene = Scene(a, b).clamp("left", beam="a").clamp("left", beam="b")
    state = scene.gravity((0, -9.81)).solve_static()
    xa, xb = (inside(beam.mesh, 20)[2] for beam in (a, b))
    order = np.random.default_rng(3).permutation(40)
    x = np.hstack([xa, xb])[:, order]
    for name in METHODS:
        parts = [getattr(state, name)(xa, beam="a"), getattr(state, name)(xb, beam="b")]
        assert_allclose(getattr(state, name)(x), np.hstack(parts)[:, order], rtol=1e-13,
                        atol=1e-15 * np.abs(parts[0]).max())
    with pytest.raises(MeshError, match=r"outside the body \(20 of 20 points are\)"):
        state.strain(xb, beam="a")
    with pytest.raises(MeshError, match=r"none of the 2 beams .1 of 2 points are.; 'a': the body "
                       r"lies within x from 0 to 2 and y from -0\.05 to 0\.05"):
        state.strain([(0.5, 0), (0.5, 3)])
    with pytest.raises(NameUnknown, match="known: 'a', 'b'"):
        state.strain(xa, beam="c")


def test_points_of_a_motion():
    scene = Scene(Beam(LINE, ElementBeamANCF(2), STEEL, 0.1)).pin("left").gravity((0, -9.81))
    history = scene.integrate(0.05, 0.01)
    x = inside(LINE, 20)[2]
    for name in METHODS:
        many = getattr(history, name)(x)
        assert many.shape == (len(history), 3 if name in ("strain", "stress") else 2, 20)
        assert_allclose(getattr(history, name)(x[:, 3]), many[:, :, 3], atol=1e-12 * np.abs(
            many).max())
        assert_allclose(getattr(history.state(4), name)(x), many[4], atol=1e-12 * np.abs(
            many).max())
    # the velocity is the rate of the position
    dt = 1e-6
    y = history.state(3)
    moved = y.replace(u=y.u + dt * y.v).position(x) - y.replace(u=y.u - dt * y.v).position(x)
    assert_allclose(moved / (2 * dt), y.velocity(x), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("mesh", [LINE, quarter_arc(height=0.1)], ids=["straight", "arc"])
def test_velocity_off_the_axis_of_a_turning_cable(mesh):
    """omega x r, with the axis where it is and the sections normal to it."""
    beam = Beam(mesh, ElementBeamCable(5), STEEL, 0.1)
    state = affine(beam, np.eye(2))
    v = beam.rigid_motions()[:, 2]
    x = inside(mesh)[2]
    at, dt = state.system.points.find(x), 1e-6
    velocity = at.velocity(state.u, v)
    rate = (at.displacement(state.u + dt * v) - at.displacement(state.u - dt * v)) / (2 * dt)
    assert_allclose(velocity, rate, atol=1e-9)
    r = x - beam.origin[:, None]
    # the sections of a curved mesh are a little shorter between its nodes
    assert_allclose(velocity, [-r[1], r[0]], atol=1e-12 if mesh.is_straight else 2e-3)


def test_no_points_and_one_of_many():
    state = bent(LINE, ElementBeamANCF(2))
    assert state.displacement(np.zeros((2, 0))).shape == (2, 0)
    assert state.displacement(np.zeros((2, 1))).shape == (2, 1)
    assert state.displacement([(0.5, 0.0)]).shape == (2, 1)
    assert state.strain(np.zeros((2, 1))).shape == (3, 1)


@pytest.mark.parametrize("what, error, message", [
    (np.zeros((5, 2)), MeshError, r"shape \(2, n\).*got \(5, 2\); give its transpose"),
    (np.zeros((3, 4)), MeshError, r"got \(3, 4\)$"),
    ([(0, 1, 2), (3, 4, 5)], MeshError, r"two coordinates.*got \(0, 1, 2\)"),
    ([(0, 1), (0, (1, 2))], MeshError, "two coordinates"),
    ([(0.1, 0), (np.nan, 0)], InputError, "NaN"),
    (np.array([[0.1], [np.inf]]), InputError, "infinite"),
    ([(True, 0.0)], MeshError, "two coordinates"),
    ((True, 0.0), MeshError, "two coordinates"),
    ([], MeshError, "two coordinates"),
    ("lef", MeshError, "name of an end"),
])
def test_what_is_no_point(what, error, message):
    state = bent(LINE, ElementBeamANCF(2))
    for name in METHODS:
        with pytest.raises(error, match=message):
            getattr(state, name)(what)


def test_two_numbers_are_not_a_point_and_a_beam():
    state = bent(LINE, ElementBeamANCF(2))
    for y in (0.0, 0, 0.01):
        with pytest.raises(MeshError, match=r"two coordinates \(x, y\).* got 0\.5"):
            state.displacement(0.5, y)


def test_points_outside_name_the_extent_of_the_body():
    state = bent(LINE, ElementBeamANCF(2))
    with pytest.raises(MeshError, match=r"\(0\.5, 2\) is outside the body: .*lies within x from 0 "
                       r"to 1 and y from -0\.05 to 0\.05"):
        state.displacement((0.5, 2.0))
    with pytest.raises(MeshError, match=r"\(1e\+200, 0\) is outside"):
        state.displacement((1e200, 0.0))
    with pytest.raises(MeshError, match=r"outside the body \(2 of 3 points are\)"):
        state.displacement(np.array([[0.5, 2.0, 3.0], [0.0, 0.0, 0.0]]))


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("formulation", ["assumed", "continuum", "ecm"])
@pytest.mark.parametrize("mesh", [LINE, quarter_arc(height=0.1)], ids=["straight", "arc"])
def test_strain_of_the_elements_at_few_and_at_many_points(mesh, formulation, plane, monkeypatch):
    """Single points, blocks of many, and the derivative of the displacement agree."""
    material = StVenantKirchhoff(E=1e6, nu=0.3, plane=plane)
    beam = Beam(mesh, ElementBeamANCF(2), material, 0.1, formulation=formulation)
    state = Scene(beam).clamp("left").point_force((2, -3), at=mesh.p[:, -1]).solve_static()
    e, X, x = inside(mesh)
    few = [np.array([ask(p, recover=False) for p in x.T]).T for ask in (state.strain, state.stress)]
    monkeypatch.setattr("skfem_ancf.beam.strains.CHUNK", 7)
    many = [state.strain(x, recover=False), state.stress(x, recover=False)]
    assert_allclose(few, many, rtol=1e-10, atol=1e-13 * np.abs(few[1]).max())
    if formulation == "continuum":  # r(X + d) - r(X) by differences, in the frame of the beam
        d = 1e-6
        X = np.clip(X, 0.1, 0.9)
        frame = mesh.mapping().frame(X[:, :, None], e)[..., 0]
        at = mesh.mapping().F(X[:, :, None], e)[..., 0]
        F = [(state.position(at + d * frame[:, k]) - state.position(at - d * frame[:, k])) / (2 * d)
             for k in (0, 1)]
        exact = [0.5 * (np.sum(F[0]**2, 0) - 1), 0.5 * (np.sum(F[1]**2, 0) - 1),
                 0.5 * np.sum(F[0] * F[1], 0)]
        assert_allclose(state.strain(at, recover=False), exact, atol=1e-8)


@pytest.mark.parametrize("offset", [0.0, 1e7])
def test_points_far_from_the_origin_are_found_on_curves(offset):
    near = quarter_arc(height=0.1)
    mesh = near.translated((offset, -offset))
    e, X, _ = inside(near, n=200)
    X = 0.02 + 0.96 * X
    found, at, outside = Beam(mesh, ElementBeamANCF(2), STEEL, 0.1).finder(
        mesh.mapping().F(X[:, :, None], e)[..., 0])
    assert_array_equal(found, e)
    assert np.all(outside == 0)
    assert_allclose(at, X, atol=1e-11 + 1e-14 * offset)


@settings(**SETTINGS)
@given(xi=PART, eta=PART, bend=st.floats(-1.2, 1.2), height=st.floats(1e-3, 0.4),
       n=st.integers(1, 6), offset=st.sampled_from([0.0, 100.0]))
@example(xi=0.0, eta=0.0, bend=1.0, height=0.3, n=3, offset=0.0)
@example(xi=1.0, eta=1.0, bend=0.0, height=0.3, n=1, offset=0.0)
def test_a_point_of_a_parabola_is_found(xi, eta, bend, height, n, offset):
    """At the place that it was made from."""
    nodes = np.linspace(-0.5, 0.5, n + 1)
    mesh = MeshBeam.init_curve(lambda s: np.array([s + offset, bend * s * s]), nodes, height)
    find, e = finder.Finder(mesh), (n - 1) // 2
    x = mesh.mapping().F(np.array([[xi], [eta]]), np.array([e]))[:, 0]
    found, X, (outside,) = find(x)
    assert outside == 0
    at = mesh.mapping().F(X, found)[:, 0]
    assert_allclose(at, x, atol=1e-14 + 1e-15 * offset)


@pytest.mark.parametrize("mesh", [quarter_arc(1, height=0.4), s_curve(0.4),
                                  MeshBeam.init_line([0.0, 3.0], 0.4, angle=0.3)], ids=repr)
def test_what_is_in_the_body_is_in_its_box(mesh):
    x0, x1, y0, y1 = finder.Finder(mesh).box
    x, y = inside(mesh, 500)[2]
    assert x0 < x.min() and x.max() < x1 and y0 < y.min() and y.max() < y1


@pytest.mark.parametrize("straight", [True, False])
@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamANCFCubic(2)], ids=repr)
def test_strain_of_a_tapered_beam_is_that_of_its_displacement_gradient(element, straight):
    beam = Beam(TAPERS[straight](), element, STEEL, 0.1, "continuum")
    u = 0.05 * np.random.default_rng(2).standard_normal(beam.N)
    e, X, _ = inside(beam.mesh)
    H, frame = beam.gradients(u, X[:, :, None], e)
    F = (H + frame)[..., 0]
    C = np.einsum("iJn,iKn->JKn", F, F)
    assert_allclose(strain_at(beam, u, e, X),
                    [0.5 * (C[0, 0] - 1.0), 0.5 * (C[1, 1] - 1.0), C[0, 1]],
                    atol=1e-12 * np.abs(C).max())


@pytest.mark.parametrize("degree", [3, 5, 7])
def test_points_of_the_exact_curve_are_points_of_a_cable(degree):
    """A force, a spring, a hinge between nodes at the place that the curve's function says; the
    elements of the mesh are cubics beside it."""
    def arc(s):
        return np.array([np.sin(s), 1 - np.cos(s)])

    mesh = MeshBeam.init_curve(arc, np.linspace(0, 1, 9), height=0.02)
    beam = Beam(mesh, ElementBeamCable(degree), StVenantKirchhoff(2e9, 0.3, 1000), width=0.02)
    at = tuple(arc(0.546875))
    force = np.array([0.03, -0.04])
    scene = Scene(beam).clamp("left").point_force(force, at)
    state = scene.solve_static(tol=1e-12)
    reaction = state.reactions("left")
    arm = state.position(at)
    assert np.allclose(reaction.force, -force, rtol=0, atol=1e-10)
    assert reaction.moment == pytest.approx(arm[1] * force[0] - arm[0] * force[1], rel=2e-5)
    Scene(beam).clamp("left").spring(1.0, between=((beam, at), ("ground", (0.5, 1.0)))).system
    with pytest.raises(InputError, match="off the axis"):
        Scene(beam).clamp("left").point_force(force, tuple(arc(0.546875) + [-1e-4, 1e-4]))
