"""What frames are made of: lines and names of mesh files, and points that nearly meet."""

import warnings

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import Frame, InputError, MeshError, ModelWarning, NameUnknown, StVenantKirchhoff

E, H = 2e11, 0.02
OPTIONS = {"material": StVenantKirchhoff(E, 0.3, density=7800.0), "height": H, "width": H}
PORTAL = [(0, 0), (0, 1), (1, 1), (1, 0)], [(0, 1), (1, 2), (2, 3)]
QUARTER = np.linspace(0.0, np.pi / 2, 5)
ARC = np.column_stack([np.cos(QUARTER), np.sin(QUARTER)])


def length(frame):
    return sum(float(beam.mesh.lengths.sum()) for beam in frame.beams)


def abaqus(path, elements, points=ARC):
    """A file of Abaqus."""
    nodes = [f"{k + 1}, {x:.17g}, {y:.17g}, 0." for k, (x, y) in enumerate(points)]
    path.write_text("\n".join(["*NODE", *nodes, elements, ""]))
    return path


# lines

@pytest.mark.parametrize("kind", ["B22", "B32", "T2D3"])
def test_quadratic_lines_of_abaqus_end_in_their_first_and_last_node(tmp_path, kind):
    path = abaqus(tmp_path / "arc.inp", f"*ELEMENT, TYPE={kind}, ELSET=arc\n1, 1,2,3\n2, 3,4,5")
    for mesh in (path, meshio.read(path)):
        frame = Frame.from_meshio(mesh, elements=8, **OPTIONS)
        assert [beam.name for beam in frame.beams] == ["arc"]
        assert_allclose(frame.points.T, ARC[[0, 2, 4]], rtol=0, atol=1e-15)
        assert length(frame) == pytest.approx(np.pi / 2, rel=1e-3)


@pytest.mark.parametrize("n", range(2, 12))
def test_lines_of_every_order_go_through_their_points(n):
    """In the order of meshio: both ends, then what is between them."""
    s = np.linspace(0.0, 1.0, n)[[0, n - 1, *range(1, n - 1)]]
    points = np.column_stack([s, 0.2 * s**min(n - 1, 3)])
    kind = "line" if n == 2 else f"line{n}"
    frame = Frame.from_meshio(meshio.Mesh(points, [(kind, [range(n)])]), elements=16, **OPTIONS)
    x = np.linspace(0.0, 1.0, 10001)
    exact = np.hypot(np.diff(x), np.diff(0.2 * x**min(n - 1, 3))).sum()
    assert length(frame) == pytest.approx(exact, rel=1e-6)


def test_what_is_no_line_is_refused():
    points = [(0, 0), (1, 0), (1, 1)]
    for kind, cell in (("triangle", [0, 1, 2]), ("VTK_LAGRANGE_CURVE", [0, 1, 2])):
        mesh = meshio.Mesh(points, [("line", [[0, 1]]), (kind, [cell])])
        with pytest.raises(MeshError, match=f"kinds \\['{kind}'\\]: a frame is made of .*'line3'"):
            Frame.from_meshio(mesh, **OPTIONS)
    mesh = meshio.Mesh([(1, 0), (0, 0), (2, 0)], [("line3", [[0, 1, 2]])])
    with pytest.raises(MeshError, match="not in the order end, end, middle"):
        Frame.from_meshio(mesh, **OPTIONS)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_a_plane_is_one_up_to_round_off_of_its_size(size):
    points = size * np.array([(0, 0, 0), (1, 0, 1e-16), (2, 1, -1e-9)])
    cells = [("line", [[0, 1], [1, 2]])]
    assert length(Frame.from_meshio(meshio.Mesh(points, cells), **{
        **OPTIONS, "height": 0.1 * size})) == pytest.approx(size * (1 + np.sqrt(2)))
    points[1, 2] = 1e-3 * size
    with pytest.raises(MeshError, match="the point 1 of the mesh is at z = "):
        Frame.from_meshio(meshio.Mesh(points, cells), **OPTIONS)


# names


def test_sets_of_abaqus_may_overlap(tmp_path):
    path = abaqus(tmp_path / "arc.inp", "*ELEMENT, TYPE=B31, ELSET=left\n1, 1,2\n2, 2,3\n"
                  "*ELEMENT, TYPE=B31, ELSET=right\n3, 3,4\n4, 4,5\n*ELSET, ELSET=loaded\n2, 3\n"
                  "*ELSET, ELSET=all, GENERATE\n1, 4, 1\n*NSET, NSET=foot\n1, 5")
    load = np.array([0.0, -1e3])
    tips = []
    for options, beams in (({}, ["lines"]), ({"groups": ["right", "left"]}, ["left", "right"]),
                           ({"groups": "all"}, ["all"]), ({"groups": []}, ["lines"]),
                           ({"sections": {"left": {"width": H}}}, ["left", "lines"]),
                           ({"groups": "loaded"}, ["loaded", "lines"])):
        frame = Frame.from_meshio(path, **OPTIONS, **options)
        assert sorted(beam.name for beam in frame.beams) == sorted(beams)
        state = frame.clamp("foot").line_load(load, beam="loaded").solve_static(tol=1e-11)
        total = state.reactions("foot").force
        assert_allclose(total, -load * np.hypot(*(ARC[1] - ARC[0])) * 2, rtol=1e-6, atol=1e-6)
        assert frame.nodes("loaded").tolist() == [1, 2, 3]
        tips.append(state.displacement(tuple(ARC[2])))
    assert_allclose(tips, [tips[0]] * len(tips), rtol=1e-8)
    with pytest.raises(InputError, match="line . is in the groups .* groups= names the sets"):
        Frame.from_meshio(path, groups=["left", "loaded"], **OPTIONS)
    with pytest.raises(NameUnknown, match="set of lines in groups 'rigth'.*did you mean 'right'"):
        Frame.from_meshio(path, groups=["rigth"], **OPTIONS)


@pytest.mark.parametrize("text, message", [
    ("*ELEMENT, TYPE=B31\n1, 1,2\n2, 2,3\n*ELEMENT, TYPE=B31, ELSET=b\n3, 3,4\n4, 4,5",
     "an .ELEMENT has no set before one that has"),
    ("*Element, type=B31, elset=b\n1, 1,2\n2, 2,3\n*Element, type=B31, elset=b\n3, 3,4\n4, 4,5",
     "'b' is there twice"),
    ("*ELEMENT, TYPE=B31, ELSET=a\n1, 1,2\n2, 2,3\n3, 3,4\n4, 4,5\n*ELSET, ELSET=a\n1",
     "'a' is there twice"),
    ("*ELEMENT, TYPE=B31\n1, 1,2\n2, 2,3\n3, 3,4\n4, 4,5\n*ELSET, ELSET=a\n1\n*ELSET, ELSET=a\n2",
     "'a' is there twice"),
    ("*ELEMENT, TYPE=B31, ELSET=a\n1, 1,2\n2, 2,3\n*ELEMENT, TYPE=B31, ELSET=c\n3, 3,4\n4, 4,5\n"
     "*ELSET, ELSET=b\nc,\na", "set 'b' lists names of sets")])
def test_sets_of_abaqus_that_meshio_takes_for_others_are_refused(tmp_path, text, message):
    """Sets in which it has other elements than the file."""
    with pytest.raises(MeshError, match=message):
        Frame.from_meshio(abaqus(tmp_path / "arc.inp", text), **OPTIONS)
    plain = text.replace(", ELSET=b\n3", "\n3").replace(", elset=b", "").split("*ELSET")[0]
    assert length(Frame.from_meshio(abaqus(tmp_path / "plain.inp", plain), **OPTIONS)) > 1.5


# points that nearly meet

def sway(points, lines, size=1.0, **options):
    """Sway of a portal, relative to its size, under a force that grows with it."""
    frame = Frame.from_lines(size * np.array(points), lines, **{
        **OPTIONS, "height": H * size, "width": H * size, **options})
    frame.clamp([0, len(points) - 1]).point_force((100.0 * size**2, 0.0), at=1)
    return frame.solve_static(tol=1e-10).displacement((0.0, size))[0] / size


@pytest.mark.parametrize("size", [1e-2, 1.0, 1e3])
@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-6, 9e-6])
def test_points_that_nearly_meet_are_one_node(gap, size):
    exact = sway(*PORTAL, size)
    points = [(0, 0), (0, 1), (gap, 1), (1, 1), (1, 0)]
    for lines in ([(0, 1), (2, 3), (3, 4)], [(0, 1), (1, 2), (2, 3), (3, 4)]):
        with pytest.warns(ModelWarning, match="points 1 and 2, .* are one node.*tol = "):
            assert sway(points, lines, size) == pytest.approx(exact, rel=1e-4)
        assert sway(points, lines, size, tol=2e-5 * size) == pytest.approx(exact, rel=1e-4)


def test_gaps_stay_open_where_that_is_asked_for_or_said():
    lines, exact = [(0, 1), (2, 3), (3, 4)], sway(*PORTAL)
    points = [(0, 0), (0, 1), (1e-6, 1), (1, 1), (1, 0)]
    assert sway(points, lines, tol=0) > 3.0 * exact
    points[2] = (3e-5, 1)
    with pytest.warns(ModelWarning, match="points 1 and 2, 3e-05 apart, are different nodes"):
        assert sway(points, lines) > 3.0 * exact
    points[2] = (1e-3, 1)
    assert sway(points, lines) > 3.0 * exact
    assert sway(points, lines, tol=1e-3) == pytest.approx(exact, rel=0.02)
    with pytest.warns(ModelWarning, match="apart, are different nodes"):
        assert sway(points, lines, tol=6e-4) > 3.0 * exact


def test_a_node_on_a_line_that_passes_is_said():
    with pytest.warns(ModelWarning, match=r"node 2 at \(1, 0\) is on line 0 .*not joined"):
        Frame.from_lines([(0, 0), (2, 0), (1, 0), (1, 1)], [(0, 1), (2, 3)], **OPTIONS)
    with warnings.catch_warnings():  # lines may cross, and a curve may pass
        warnings.simplefilter("error")
        Frame.from_lines([(0, 0), (2, 2), (0, 2), (2, 0)], [(0, 1), (2, 3)], **OPTIONS)
        Frame.from_lines([(0, 0), (2, 0), (1, 0), (1, -1)], [(0, 1), (2, 3)], curves={
            0: lambda s: np.array([2 * s, np.sin(np.pi * s)])}, **OPTIONS)


def test_numbers_of_points_and_lines_stay_where_some_are_one():
    """Groups, hinges, heights and names are those of the lines and points that were given."""
    points = [(0, 0), (0, 1), (1e-6, 1), (1, 1), (1, 0)]
    lines = [(0, 1), (1, 2), (2, 3), (3, 4)]
    options = {**OPTIONS, "groups": {"columns": [0, 3], "girder": [1, 2]}, "tol": 1e-5,
               "nodes": {"corner": [2], "ground": [0, 4]}, "height": [0.02, 0.9, 0.03, 0.02],
               "elements": [1, 7, 2, 1], "hinges": [2]}
    frame = Frame.from_lines(points, lines, **options).clamp("ground")
    plain = Frame.from_lines(*PORTAL, **{
        **OPTIONS, "groups": {"columns": [0, 2], "girder": [1]}, "height": [0.02, 0.03, 0.02],
        "elements": [1, 2, 1], "hinges": [(1, 1)]}).clamp([0, 3])
    assert frame.nodes("corner").tolist() == frame.nodes(2).tolist() == frame.nodes(1).tolist()
    assert repr(frame).startswith("<Frame of 3 line(s) between 4 nodes")
    a = frame.point_force((100.0, 0), at=2).solve_static(tol=1e-11)
    b = plain.point_force((100.0, 0), at=1).solve_static(tol=1e-11)
    assert_allclose(a.displacement((0, 1)), b.displacement((0, 1)), rtol=1e-4)
    assert_allclose(frame.rotations(a)[[0, 1, 3, 4]], plain.rotations(b), rtol=1e-4, atol=1e-9)
    assert frame.rotations(a)[2] == frame.rotations(a)[1]
    assert_allclose(frame.modes(2).frequencies, plain.modes(2).frequencies, rtol=1e-4)
    with pytest.raises(InputError, match="line 1 cannot be hinged"):
        Frame.from_lines(points, lines, **{**options, "hinges": [(1, 2)]})
    with pytest.raises(MeshError, match="all lines of the group 'link' are shorter than tol"):
        Frame.from_lines(points, lines, **{**options, "groups": {"link": [1]}})
    with pytest.raises(MeshError, match="all lines are shorter than tol = 3"):
        Frame.from_lines(points, lines, **{**options, "groups": {}, "tol": 3})
    for tol in (-1.0, np.nan, "1"):
        with pytest.raises(InputError, match="tol must be"):
            Frame.from_lines(points, lines, **{**options, "tol": tol})
