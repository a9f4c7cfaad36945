"""Springs of a frame, also between the lines of a joint: closed forms, and beams with joints."""

import copy
from itertools import permutations, product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.actions.loads import Load
from skfem_ancf.core.errors import InputError, MeshError

E, H = 2e11, 0.1
EA, EI = E * H**2, E * H**4 / 12
STEEL = StVenantKirchhoff(E, 0.0, density=7850.0)
POINTS = [(0, 0), (2, 0), (4, 0)]


def frame_of(points, lines, order=None, hinges=(), **options):
    """A frame whose lines "a", "b", ... are drawn in an order; the hinges are pairs of these."""
    order = range(len(lines)) if order is None else order
    named = {"abc"[i]: [k] for k, i in enumerate(order)}
    return Frame.from_lines(points, [lines[i] for i in order], named, hinges=list(hinges), **{
        "material": STEEL, "height": H, "width": H, **options})


def two_lines(k, lines=((0, 1), (1, 2)), order=(0, 1), **options):
    """A clamped cantilever of two lines, with a torsional spring between them."""
    frame = frame_of(POINTS, lines, order, [("b", 1)], **options).clamp(0)
    return frame.torsional_spring(k, (2, 0), beam="a", other=("b", (2, 0)))


def scene_of_two(k):
    """The same of two beams and a hinge."""
    a, b = (Beam(MeshBeam.init_line([0, 2], H, (x, 0)), ElementBeamCable(5), STEEL, width=H)
            for x in (0.0, 2.0))
    scene = Scene(a, b).clamp("left", a, thickness="free")
    scene.hinge((2, 0))
    return scene.torsional_spring(k, "right", beam=a, other=(b, "left"))


DRAWN = [(lines, order) for lines in product([(0, 1), (1, 0)], [(1, 2), (2, 1)])
         for order in permutations(range(2))]


@pytest.mark.parametrize("lines, order", DRAWN)
@pytest.mark.parametrize("k", [1e5, 1e6, 1e7])
def test_a_semi_rigid_joint(k, lines, order):
    frame = two_lines(k, lines, order).point_force((0, 1.0), at=2)
    right = 64 / (3 * EI) + 4 / k
    assert_allclose(frame.solve_linear().displacement((4, 0))[1], right, rtol=1e-9)
    assert_allclose(frame.solve_static().displacement((4, 0))[1], right, rtol=1e-8)


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCF(3)])
@pytest.mark.parametrize("elements", [1, 3])
def test_a_semi_rigid_joint_of_sections(element, elements):
    """Sections with free ends: more than the two rotations is condensed."""
    k = 1e6
    found = [two_lines(k, lines, order, element=element, elements=elements).point_force(
        (0, 1.0), at=2).solve_linear().displacement((4, 0))[1] for lines, order in DRAWN]
    rigid = frame_of(POINTS, [(0, 1), (1, 2)], element=element, elements=elements).clamp(0)
    rigid = rigid.point_force((0, 1.0), at=2).solve_linear().displacement((4, 0))[1]
    assert_allclose(found, rigid + 4 / k, rtol=1e-9)


@pytest.mark.parametrize("lines, order", DRAWN)
def test_large_deflections_modes_and_motions(lines, order):
    k = 2e5
    frame, scene, force = two_lines(k, lines, order), scene_of_two(k), (0, 3e5)
    frame.point_force(force, at=2)
    scene.point_force(force, (4, 0))
    u, v = (one.solve_static() for one in (frame, scene))
    assert abs(v.displacement((4, 0))[1]) > 1.0
    assert_allclose(u.displacement((4, 0)), v.displacement((4, 0)), rtol=1e-7)
    assert u.stability == v.stability == "stable"
    for a, b in ((None, None), (u, v)):
        assert_allclose(frame.modes(4, a).frequencies, scene.modes(4, b).frequencies, rtol=1e-7)
    a, b = (one.integrate(t_end=0.02, dt=1e-3) for one in (frame, scene))
    assert_allclose(a.displacement((4, 0))[-1], b.displacement((4, 0))[-1], rtol=1e-6)


@pytest.mark.parametrize("lines, order", DRAWN)
def test_a_spring_between_two_tips(lines, order):
    """Cantilevers that face each other: the spring takes F k c / (1 + 2 k c), c of a tip."""
    points, ends = [(0, 0), (2, 0), (2.5, 1), (4.5, 1)], [(0, 1), (2, 3)]
    drawn = [end[::-1] if line[0] > line[1] else end for end, line in zip(ends, lines)]
    frame = frame_of(points, drawn, order).clamp([0, 3])
    k, c, slope = 3e6, 8 / (3 * EI), np.array([0.5, 1.0]) / np.hypot(0.5, 1.0)
    frame.spring(k, ((2, 0), (2.5, 1))).point_force((0, 1.0), at=(2, 0))
    # forces on both tips along the spring, and their compliance along it
    C = np.diag([2 / EA, c])
    tension = k * slope @ C @ [0, 1.0] / (1 + 2 * k * slope @ C @ slope)
    right = C @ ([0, 1.0] - tension * slope)
    u = frame.solve_linear()
    assert_allclose(u.displacement((2, 0)), right, rtol=1e-9)
    assert_allclose(frame.solve_static().displacement((2, 0))[1], right[1], rtol=1e-6)


@pytest.mark.parametrize("lines, order", DRAWN)
def test_buckling_of_a_joint(lines, order):
    """Pinned bars: with a the root of a tan a = 2 k L / (E I) the load is a^2 E I / L^2."""
    h, L = 0.02, 2.0
    stiffness = E * h**4 / 12
    k = stiffness / L
    a = brentq(lambda x: x * np.tan(x) - 2, 0.5, 1.5)
    load = a**2 * stiffness / L**2
    frame = frame_of(POINTS, lines, order, [("b", 1)], height=h, width=h)
    frame.pin(0).hold(2, "y").torsional_spring(k, (2, 0), beam="a", other=("b", (2, 0)))
    frame.point_force((-load, 0), at=2)
    assert_allclose(frame.buckling(1).factors[0], 1.0, rtol=1e-3)
    path = frame.continuation(max_load=1.2, ds=0.05)
    assert_allclose(path.bifurcation_points(), [1.0], rtol=1e-3)
    assert path.stable[0] and not path.stable[-1]


def test_a_grid_of_springs():
    """Springs between all lines of a bay against the same with multipliers."""
    points, lines = [(0, 0), (0, 3), (4, 3), (4, 0)], [(0, 1), (1, 2), (2, 3)]
    frame = frame_of(points, lines, hinges=[("b", 1), ("b", 2)]).clamp([0, 3])
    beams = []
    for i, j in lines:
        a, d = np.array(points[i]), np.subtract(points[j], points[i])
        beams.append(Beam(MeshBeam.init_line([0, np.hypot(*d)], H, a, np.arctan2(d[1], d[0])),
                          ElementBeamCable(5), STEEL, width=H))
    scene = Scene(*beams).clamp("left", 0, thickness="free").clamp("right", 2, thickness="free")
    for a, b, at in ((0, 1, (0, 3)), (1, 2, (4, 3))):
        scene.hinge((a, at), (b, at))
        for one, names in ((frame, ["abc"[a], "abc"[b]]), (scene, [a, b])):
            one.torsional_spring(4e5, at, beam=names[0], other=(names[1], at))
    frame.point_force((1e4, 0), at=(0, 3))
    scene.point_force((1e4, 0), (0, 3), beam=0)
    for u, v in ((frame.solve_linear(), scene.solve_linear()),
                 (frame.solve_static(), scene.solve_static())):
        assert_allclose(u.displacement((4, 3), "c"), v.displacement((4, 3), 2), rtol=1e-7)


@pytest.mark.parametrize("groups", [True, False])
def test_places_without_the_name_of_a_beam(groups):
    """At a rigid node the beam does not matter; a force may act between nodes."""
    def made(hinges=()):
        named = {"a": [0], "b": [1]} if groups else None
        return Frame.from_lines(POINTS, [(0, 1), (1, 2)], named, hinges=hinges, material=STEEL,
                                height=H, width=H).hold(0, ["x", "y"], "angle")

    F, k, c = 1e3, 2e5, 3e5
    bent = made().point_force((0, F), at=2).torsional_spring(c, (2, 0)).solve_linear()
    # the spring takes the moment c phi at 2: F (2 4 - 2) / EI = phi (1 + 2 c / EI)
    phi = F * 6 / EI / (1 + 2 * c / EI)
    assert_allclose(bent.displacement((4, 0))[1], 64 * F / (3 * EI) - c * phi * 6 / EI, rtol=1e-9)
    propped = made().point_force((0, F), at=2).spring(k, ((2, 0), ("ground", (2, -1))))
    R = k * F * (4 * (12 - 2) / 6) / EI / (1 + k * 8 / (3 * EI))
    assert_allclose(propped.solve_linear().displacement((2, 0), *["a"] * groups)[1], R / k,
                    rtol=1e-9)
    between = made().point_force((0, F), at=(1.3, 0)).solve_linear()
    assert_allclose(between.displacement((4, 0))[1], F * 1.3**2 * (12 - 1.3) / (6 * EI), rtol=1e-9)
    assert_allclose(between.resultants((0.5, 0), *["a"] * groups).M, F * 0.8, rtol=1e-9)
    heavy = made().point_mass(50.0, (2, 0))
    assert heavy.modes(1).frequencies[0] < made().modes(1).frequencies[0]
    with pytest.raises(MeshError, match="no node of the frame"):
        made().point_force((0, F), at=(1.3, 0.2))
    with pytest.raises(InputError, match="each has a rotation of its own"):
        made([1]).torsional_spring(c, (2, 0))
    one = made([(1, 1)]).point_force((0, F), at=1).torsional_spring(c, (2, 0)).hold(2, "x", "y")
    assert one.solve_linear().converged and copy.deepcopy(one).torsional_spring(
        c, (2, 0)).solve_linear().converged


class Ties(Load):
    """Springs between the nodes given."""

    constant = False

    def __init__(self, nodes, beam=None):
        super().__init__(beam)
        self.nodes = nodes

    def bind(self, beam):
        bound = super().bind(beam)
        bound.dofs = beam.nd * np.array(self.nodes) + 1
        return bound

    def force(self, u):
        out, (a, b) = np.zeros(self.beam.N), self.dofs
        out[a], out[b] = u[b] - u[a], u[a] - u[b]
        return out

    def stiffness(self, u):
        a, b = self.dofs
        return np.array([a, a, b, b]), np.array([a, b, a, b]), np.array([-1.0, 1.0, 1.0, -1.0])


def test_a_user_defined_load_that_couples_two_lines_is_refused():
    """The last node of a line and the first of the next have consecutive numbers."""
    frame = Frame.from_lines(POINTS, [(0, 1), (1, 2)], material=STEEL, height=H, width=H).clamp(0)
    assert frame.add(Ties((0, 1))).solve_linear().converged
    with pytest.raises(InputError, match="couples the nodes 1 and 2: only neighbours"):
        frame.add(Ties((1, 2)))
