"""Material points, one and many: found, remembered, refused, and what they give."""

import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import quarter_arc, s_curve
from numpy.testing import assert_allclose
from test_io import affine

import skfem_ancf
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, InputError, MeshBeam,
                        MeshError, NameUnknown, Scene, StVenantKirchhoff)

STEEL = StVenantKirchhoff(E=1e6, nu=0.3, density=10.0)
LINE = MeshBeam.init_line([0, 0.3, 1.0], height=0.1)
METHODS = ("displacement", "position", "velocity", "strain", "stress")
MESHES = {"straight": lambda: MeshBeam.init_line([-1.0, -0.4, 0.3, 1.2], 0.1, angle=0.7),
          "arc": lambda: quarter_arc(height=0.1), "s-curve": lambda: s_curve(0.1)}


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


def test_points_outside_name_the_extent_of_the_body():
    state = bent(LINE, ElementBeamANCF(2))
    with pytest.raises(MeshError, match=r"\(0\.5, 2\) is outside the body: .*lies within x from 0 "
                       r"to 1 and y from -0\.05 to 0\.05"):
        state.displacement((0.5, 2.0))
    with pytest.raises(MeshError, match=r"\(1e\+200, 0\) is outside"):
        state.displacement((1e200, 0.0))
    with pytest.raises(MeshError, match=r"outside the body \(2 of 3 points are\)"):
        state.displacement(np.array([[0.5, 2.0, 3.0], [0.0, 0.0, 0.0]]))


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
        Scene(beam).clamp("left").spring(1.0, between=(
            (beam, tuple(arc(0.546875) + [-1e-4, 1e-4])), ("ground", (0.5, 1.0))))


def modules_of(call):
    """Modules of the package that a call passes, in order, and from which each is entered."""
    folder, found = str(Path(skfem_ancf.__file__).parent), {}

    def watch(frame, event, _):
        if event != "call" or not frame.f_code.co_filename.startswith(folder):
            return
        back = frame.f_back
        while back is not None and not back.f_code.co_filename.startswith(folder):
            back = back.f_back
        here, there = (f and f.f_code.co_filename[len(folder) + 1:] for f in (frame, back))
        if here != there:
            found.setdefault(here, set()).add(there)

    sys.setprofile(watch)
    try:
        call()
    finally:
        sys.setprofile(None)
    return found


@pytest.mark.parametrize("recover", [True, False])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
@pytest.mark.parametrize("mesh", MESHES)
def test_the_strain_at_points_takes_one_short_road(mesh, element, recover):
    """One point and many pass the same modules, each once, and at most six."""
    state = loaded(Beam(MESHES[mesh](), element, STEEL, 0.1))
    require_short_road(state, inside(state.beams[0].mesh)[2], recover)


@pytest.mark.parametrize("recover", [True, False])
def test_the_road_is_as_short_in_frames_and_with_several_beams(recover):
    frame = Frame.from_lines([(0, 0), (0, 3), (4, 3)], [(0, 1), (1, 2)], height=0.2, elements=3,
                             material=STEEL, width=0.1)
    state = frame.clamp(0).point_force((1, 0), at=2).solve_static()
    require_short_road(state, np.array([[0.0, 0.05, 2.0], [1.5, 2.0, 3.05]]), recover)
    beams = [Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1, origin=(0, k)), ElementBeamANCF(2),
                  STEEL, 0.1) for k in (0, 1)]
    scene = Scene(*beams).clamp("left", beam=0).clamp("left", beam=1).gravity((0, -1))
    require_short_road(scene.solve_static(), np.array([[0.2, 0.7], [0.0, 1.02]]), recover)


def require_short_road(state, x, recover):
    state.strain(x, recover=recover)  # recovered fields are made when they are first asked for
    roads = [modules_of(lambda p=p: state.strain(p, recover=recover))
             for p in (x, x[:, 0], [tuple(p) for p in x.T])]
    assert roads[0] == roads[1] == roads[2]
    assert len(roads[0]) <= 6, list(roads[0])
    for module, entered in roads[0].items():
        assert len(entered) == 1 or module == "core/errors.py", (module, entered)
