"""Where lines or beams overlap all readings and loads take the one whose axis is nearest."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, InputError, MeshBeam,
                        MeshError, Scene, StVenantKirchhoff)

STEEL = StVenantKirchhoff(2e11, 0.3, density=7800.0)
F, H = 1000.0, 0.4
POINTS, LINES = [(0, 0), (0, 4), (-2, 4), (2, 4)], [(0, 1), (2, 1), (1, 3)]
GROUPS = {"together": {}, "apart": {"column": [0], "girder": [1, 2]},
          "each": {"right": [2], "left": [1], "column": [0]}}


def joint(element, groups, points=POINTS, lines=LINES, **options):
    """A column with a girder on it, in the shape of a T."""
    return Frame.from_lines(points, lines, **{
        "groups": GROUPS.get(groups), "height": H, "width": 0.1, "material": STEEL,
        "element": element, "elements": 3, **options}).clamp(0)


@pytest.fixture(params=[(e, g) for e in (ElementBeamCable(5), ElementBeamANCF(2)) for g in GROUPS],
                ids=lambda p: f"{p[0]!r} {p[1]}")
def case(request):
    frame = joint(*request.param)
    return frame, frame.point_force((0, -F), at=3).solve_static(tol=1e-11)


def test_section_forces_near_a_joint_are_those_of_the_nearest_axis(case):
    """Of statics, by hand, with small displacements."""
    _, state = case
    for at, M, force in (((0, 3.9), -2 * F, (0, -F)), ((0, 3.99), -2 * F, (0, -F)),
                         ((0.05, 3.85), -2 * F, (0, -F)), ((0.15, 3.95), -1.85 * F, (0, -F)),
                         ((0.1, 4), -1.9 * F, (0, -F)), ((-0.15, 3.95), 0, (0, 0)),
                         ((-0.1, 4), 0, (0, 0)), ((0, 2), -2 * F, (0, -F))):
        found = state.resultants(at)
        assert_allclose(found.M, M, rtol=0, atol=1e-3 * F)
        assert_allclose(found.force, force, rtol=0, atol=1e-5 * F)
        EI = 2e11 * 0.1 * H**3 / 12
        assert_allclose(found.curvature, M / EI, rtol=1e-2, atol=1e-8)


def test_a_follower_force_at_a_node_turns_with_the_line_that_is_named():
    """A weak column that leans as the girder on it is pushed: the force turns with either."""
    for groups in ("together", "apart"):
        frame = joint(ElementBeamCable(5), groups)
        with pytest.raises(InputError, match=r"axes of lines \[0, 1, 2\].*line=0"
                           if groups == "together" else "beam"):
            frame.follower_force((0.0, -F), at=(0, 4))
        if groups == "apart":
            with pytest.raises(InputError, match=r"axes of lines \[1, 2\].*line=1"):
                frame.follower_force((0.0, -F), at=(0, 4), beam="girder")
        for line in range(3):
            loads = joint(ElementBeamCable(5), groups).follower_force(
                (0.0, -F), at=(0, 4), line=line).loads
            beam, force = loads[0].beam, loads[0].force(np.zeros(loads[0].beam.N))
            assert_allclose(force @ beam.rigid_motions()[:, :2], [0, -F], atol=1e-9)
            # the slope that turns it is that of the end of the line
            _, j, v = loads[0].stiffness(np.zeros(beam.N))
            at = beam.finder.find(np.array([[0.0], [4.0]]), line if groups == "together" else
                                  max(0, line - 1))
            node = beam.mesh.t[round(at[1][0, 0]), at[0][0]]
            assert set(np.unique(j[np.abs(v) > 1e-9 * np.abs(v).max()]) // beam.nd) == {node}
    with pytest.raises(InputError, match="lines are numbered 0 to 2"):
        joint(ElementBeamCable(5), "together").follower_force((0, -F), at=(0, 4), line=3)
    # away from the node nothing is asked
    joint(ElementBeamCable(5), "apart").follower_force((0, -F), at=(1, 4)).solve_static()


def test_lines_that_are_not_there_are_refused(case):
    frame, state = case
    with pytest.raises(InputError, match="the frame has no line 3: lines are numbered 0 to 2"):
        state.strain((0, 4), line=3)
    with pytest.raises(MeshError, match="outside the line that was named"):
        state.strain((0, 1), line=1)
    for line in (-1, 0.5, "0", True):
        with pytest.raises(InputError, match="line must be an integer"):
            state.strain((0, 4), line=line)
    if len(frame.beams) > 1:
        with pytest.raises(InputError, match="line 0 is in the beam 'column', not in"):
            state.strain((0, 4), frame.beams[-1 if frame.beams[0].name == "column" else 0], line=0)


@pytest.mark.parametrize("groups, beam", [("together", 0), ("apart", "column")])
def test_a_force_beside_a_node_is_one_of_the_nearest_axis(groups, beam):
    frame = joint(ElementBeamANCF(2), groups).point_force((F, 0), at=(0, 3.9), beam=beam)
    load, member = frame.loads[-1], frame.beam(beam)
    loaded = np.unique(np.flatnonzero(load.force(np.zeros(member.N))) // member.nd)
    assert_allclose(member.mesh.p[:, loaded], [[0, 0], [8 / 3, 4]], atol=1e-12)
    assert_allclose(frame.solve_static(tol=1e-11).reactions(0).moment, 3.9 * F, rtol=1e-3)
    tips = []  # a spring on the section of the column, which a node is on, or none
    for elements in (40, 38):
        frame = joint(ElementBeamANCF(2), groups, elements=elements)
        frame.torsional_spring(1e7, (0, 3.9), beam=beam).point_force((0, -F), at=3)
        tips.append(frame.solve_static(tol=1e-11).displacement((2, 4)))
    free = joint(ElementBeamANCF(2), groups).point_force((0, -F), at=3).solve_static()
    assert_allclose(tips[0], tips[1], rtol=2e-3)
    assert abs(tips[0][1]) < 0.95 * abs(free.displacement((2, 4))[1])


def test_frames_of_random_lines_are_in_balance_at_each_node():
    rng = np.random.default_rng(5)
    points = np.array(np.divmod(np.arange(9), 3)[::-1]).T + 0.15 * rng.uniform(-1, 1, (9, 2))
    lines = [(i, j) for i in range(9) for j in range(i + 1, 9)
             if (j == i + 1 and j % 3) or j == i + 3 or (j == i + 4 and j % 3)]
    frame = Frame.from_lines(points, lines, material=STEEL, height=0.05, width=0.05, elements=2,
                             groups={"a": range(0, len(lines), 2)})
    loads = {k: 1e4 * rng.uniform(-1, 1, 2) for k in range(3, 9)}
    frame.clamp([0, 1, 2])
    for k, force in loads.items():
        frame.point_force(force, at=k)
    state = frame.solve_static(tol=1e-11)
    for k, force in loads.items():
        total, moment = np.array(force), 0.0
        for number, ends in enumerate(lines):
            if k in ends:
                end = state.resultants(tuple(points[k]), line=number)
                sign = 1.0 if k == ends[0] else -1.0  # what is behind pulls at what is before
                total, moment = total + sign * end.force, moment + sign * end.M
        assert_allclose(total, 0.0, atol=1.0)
        assert abs(moment) < 1.0


def test_of_two_beams_the_nearest_axis_is_read():
    """Welded at a corner, in either order: the beam that comes first does not matter."""
    def beam(name, origin, angle):
        return Beam(MeshBeam.init_line(np.linspace(0, 2, 5), 0.2, origin=origin, angle=angle),
                    ElementBeamANCF(2), STEEL, width=0.1, name=name)

    post, arm = beam("post", (0, 0), np.pi / 2), beam("arm", (0, 2), 0.0)
    found = []
    for beams in ((post, arm), (arm, post)):
        scene = Scene(*beams).clamp("left", beam="post").point_force((0, -F), at=(2, 2))
        scene.weld(("post", "right"), ("arm", "left"))
        state = scene.solve_static(tol=1e-11)
        found.append([state.resultants(at).M for at in ((0.0, 1.95), (0.08, 2.0), (0.06, 1.97))])
        with pytest.raises(InputError, match="to the axes of the beams .*choose one, as beam="):
            state.strain((0, 2))
        assert_allclose(state.resultants((0, 2), beam="post").M, -2 * F, rtol=1e-3)
        assert_allclose(state.displacement((0, 2)), state.displacement((0, 2), "arm"), atol=1e-9)
    assert_allclose(found[0], found[1], rtol=1e-6)
    assert_allclose(found[0], [-2 * F, -1.92 * F, -1.94 * F], rtol=1e-3)
