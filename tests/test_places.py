"""Places: a boundary, a point, a function, facets; what is refused leaves the scene as it was."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import (AncfError, Beam, ElementBeamANCF, InputError, MeshBeam, MeshError,
                        NameUnknown, RigidBody, Scene, StVenantKirchhoff)
from skfem_ancf.mesh.places import facets_of

MATERIAL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)


def line(n=4, length=2.0, **options):
    return MeshBeam.init_line(np.linspace(0, length, n + 1), 0.1, **options)


def beam(mesh=None, element=None, **options):
    return Beam(mesh or line(), element or ElementBeamANCF(2), MATERIAL, 0.1, **options)


@pytest.mark.parametrize("place, facets", [
    ("right", [4]),
    ((1, 0), [2]), ([1, 0], [2]), ((np.int64(1), 0.0), [2]), (np.array([1.0, 0.0]), [2]),
    ((1, 0.05), [2]), ((1.0, -0.02), [2]),  # on the section, off the axis
    (np.array([1, 0]), [1, 0]), (np.array([3]), [3]), (np.array([12], dtype=np.uint8), [12]),
    (lambda x: x[0] > 1.9, [4]), (lambda x: x[1] > 0.04, [9, 10, 11, 12]),
    (("left", "right"), [0, 4]), ([(0, 0), (1, 0)], [0, 2]), ({"left"}, [0]),
    (np.array([[0.0, 0.0], [1.0, 0.0]]), [0, 2]), (np.array([[0, 0], [1, 0], [2, 0]]), [0, 2, 4]),
])
def test_the_rule(place, facets):
    assert_array_equal(facets_of(line(), place), facets)


@pytest.mark.parametrize("place, error, message", [
    ((1, 1), MeshError, r"the point \(1, 1\) is on no section .* node 2 at \(1, 0\)"),
    ((0.9, 0), MeshError, r"nearest is that of node 2 at \(1, 0\), 0.1 away"),
    ((1, 0.06), MeshError, "0.01 away"),
    (lambda x: x[0] > 99, MeshError,
     r"selects none of the 13 facets.* \(0, -0.05\) to \(2, 0.05\)"),
    (lambda x: 3, InputError, "returns n truth values .*, as lambda"),
    (lambda x: x[0], InputError, "returned array"),
    (lambda x: x[7] > 0, InputError, "of x of shape .* raised IndexError"),
    ("lefft", NameUnknown, "'left', 'right'"),
    ("empty", MeshError, "'empty' is empty.*'left'"),
    (1, InputError, r"np.array\(\[1\]\)"), ([1, 2, 3], InputError, r"np.array\(\[1, 2, 3\]\)"),
    (3.5, InputError, "a place is"), ([], InputError, "a place is"), (None, InputError, "a place"),
    (True, InputError, "a place is"), ((1, "a"), InputError, "a place is"),
    (np.array([99]), MeshError, "numbered 0 to 12, got 99"),
    (np.array([-1]), MeshError, "got -1"),
    (np.array([], dtype=int), InputError, "a place is .*, got array"),
    (np.array([True, False]), InputError, "array of integers"),
    (np.array([1.0, 2.0, 3.0]), InputError, "array of integers"),
    ((np.nan, 0), InputError, "NaN"),
])
def test_what_is_no_place(place, error, message):
    mesh = line().with_boundaries({"empty": np.array([], dtype=np.int32)})
    with pytest.raises(error, match=message):
        facets_of(mesh, place)
    scene = Scene(beam(mesh))
    for ask in (scene.clamp, scene.pin, scene.fix, lambda p: scene.traction(p, (0, 1)),
                lambda p: scene.pressure(p, 1.0), lambda p: scene.moment(p, 1.0),
                lambda p: scene.joint("plane", at=p), scene.state().reactions):
        with pytest.raises(error, match=message):
            ask(place)
    assert repr(scene) == "<Scene of 1 beam(s), 0 fixed coordinates, 0 load(s)>"


def test_a_point_is_where_it_says():
    """Points of a turned, a curved and a closed beam; what they hold does not move."""
    turned = line(angle=0.5, origin=(3, 1))
    point = (3 + np.cos(0.5), 1 + np.sin(0.5))
    scene = Scene(beam(turned)).clamp("left").pin(point).point_force((0, -1e3), at=turned.p[:, -1])
    state = scene.solve_static()
    assert_allclose(state.displacement(point), 0, atol=1e-15)
    assert np.abs(state.displacement(turned.p[:, -1])).max() > 1e-3
    arc = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                              np.linspace(0, 2 * np.pi, 9), 0.1)
    assert_array_equal(facets_of(arc, (0, 1)), [2])
    assert_array_equal(facets_of(arc, (0, 1.03)), [2])
    with pytest.raises(MeshError, match=r"sections of the nodes \[0, 8\]: give np.array"):
        facets_of(arc, (1, 0))
    with pytest.raises(InputError, match=r"pin fixes the axis, at \(0, 1\)"):
        Scene(beam(arc)).pin((0, 1.03))


def test_ends_are_material_points():
    """What takes a point takes the name of an end: of the only beam that has it."""
    a, b = beam(line(), name="a"), beam(line(origin=(2.5, 0)), name="b")
    body = RigidBody(mass=1.0, inertia=0.1, position=(0, 5), name="body")
    found = []
    for end in ("right", (2, 0)):
        scene = Scene(a, body).clamp("left", "a").clamp(body).gravity((0, -1))
        scene.point_force((0, -1), at=end).follower_force((1, 0), at=end).point_mass(2.0, at=end)
        scene.spring(3.0, between=(end, (2, 1)))
        scene.sensor("tip", "displacement", at=end)
        state = scene.solve_static()
        motion = scene.integrate(0.02, 1e-2)
        found.append(np.concatenate([state.u, state.position(end), motion.velocity(end)[-1],
                                     motion.sensors["tip"][-1], [state.resultants(end).angle]]))
    assert_allclose(*found, rtol=1e-12, atol=1e-12)
    scene = Scene(a, b).clamp("left", "a").clamp("left", "b")
    assert scene.point_force((0, -1), at="right", beam="b").solve_static().displacement(
        "right", "b")[1] < 0
    for call in (lambda: scene.point_force((0, -1), at="right"),
                 lambda: scene.spring(1.0, between=("right", (9, 9))),
                 lambda: scene.state().displacement("right")):
        with pytest.raises(InputError, match="choose one"):
            call()
    with pytest.raises(InputError, match="got 'rigth'"):
        Scene(a).clamp("left").spring(1.0, between=("rigth", (9, 9)))


def test_welds_meet():
    a, b = beam(line(), name="a"), beam(line(origin=(2.5, 0)), name="b")
    scene = Scene(a, b).clamp("left", beam="a")
    with pytest.raises(InputError, match=r"0.5 apart.*mesh.translated\(\(-0.5, 0\)\)"):
        scene.joint("weld", beams=("a", "b"), at=("right", "left"))
    with pytest.raises(MeshError, match=r"the point \(1, 1\) is outside the body"):
        scene.joint("weld", beams=("a", "b"), at=((1, 1), "left"))
    for wrong in (None, ("right",), 3):
        with pytest.raises(InputError, match="needs the section of each"):
            scene.joint("weld", beams=("a", "b"), at=wrong)
    assert scene.joints == ()
    moved = b.replace(mesh=b.mesh.translated((-0.5, 0)))
    for at in (("right", "left"), (2, 0), ((2, 0), "left")):
        joined = Scene(a, moved).clamp("left", beam="a").gravity((0, -9.81))
        joined.joint("weld", beams=(a, moved), at=at)
        tip = joined.solve_static().displacement((4, 0))
    whole = Scene(beam(line(8, 4.0))).clamp("left").gravity((0, -9.81)).solve_static()
    assert_allclose(tip, whole.displacement((4, 0)), rtol=1e-3)  # the axis may bend sharply
    drawn = Scene(a, b).clamp("left", beam="a")
    drawn.joint("weld", beams=("a", "b"), at=("right", "left"), apart=True)
    assert_allclose(drawn.solve_static().displacement((4.5, 0)), (-0.5, 0), atol=1e-12)


def kinked(angle):
    """Straight to s = 1, then on in another direction; the derivative by any of three ways."""
    d = np.array([[np.cos(angle)], [np.sin(angle)]])
    e = np.array([[1.0], [0.0]])

    def exact(s):
        return np.where(s < 1, e * s, e + d * (s - 1))

    def by_differences(s):
        return np.where(s < 1, e * np.abs(s), e + d * np.abs(s - 1))

    return [(exact, None), (by_differences, None), (exact, lambda s: np.where(s < 1, e, d + 0 * s))]


@pytest.mark.parametrize("angle", [0.02, 0.5, -1.5])
@pytest.mark.parametrize("way", [0, 1, 2])
def test_a_curve_has_no_kink_at_a_node(angle, way):
    r, dr = kinked(angle)[way]
    with pytest.raises(MeshError, match=r"kink of .* degrees at s = 1:.*weld"):
        MeshBeam.init_curve(r, np.linspace(0, 2, 9), 0.001, dr=dr)


# what fails leaves the scene as it was


def test_a_force_finds_the_beam_that_has_its_point():
    arm = beam(line(origin=(2.0, 0.0)), name="arm")
    post = beam(name="post")
    named, found = (Scene(post, arm).clamp("left", "post") for _ in range(2))
    for scene, where in ((named, {"beam": "arm"}), (found, {})):
        scene.weld((2.0, 0.0))
        scene.point_force((0, -1), at=(3.0, 0.0), **where)
        scene.follower_force((0, -1), at=(3.5, 0.0), **where)
    assert_array_equal(found.solve_linear().u, named.solve_linear().u)
    for at in ((2.0, 0.0), (9.0, 0.0), "right"):  # of both, of none, no point
        with pytest.raises(AncfError, match="choose one"):
            found.point_force((0, -1), at=at)
