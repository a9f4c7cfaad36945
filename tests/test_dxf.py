"""Frames from drawings in DXF."""

import sys

import pytest
from numpy.testing import assert_allclose

from skfem_ancf import FileError, Frame, MeshError, MissingExtra, StVenantKirchhoff

STEEL = StVenantKirchhoff(E=2.1e11, nu=0.0, density=7850)
SECTION = dict(material=STEEL, height=0.02, width=0.02)


@pytest.fixture
def drawn(tmp_path):
    """From a function that draws into the model space to a frame."""
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (the extra 'dxf')")

    def made(draw, **options):
        drawing = ezdxf.new()
        draw(drawing.modelspace())
        drawing.saveas(tmp_path / "frame.dxf")
        return Frame.from_meshio(tmp_path / "frame.dxf", **{**SECTION, **options})

    return made


def on(layer):
    return {"layer": layer}


def test_layers_are_groups_and_names_of_nodes(drawn):
    """A portal with pins: under H at an eave each of them carries H/2 across and H h / l down."""
    def draw(space):
        space.add_line((0, 0), (0, 3), on("columns"))
        space.add_line((4, 3), (4, 0), on("columns"))
        space.add_lwpolyline([(0, 3), (2, 3), (4, 3)], dxfattribs=on("girder"))
        space.add_point((0, 0), on("ground"))
        space.add_point((4, 0), on("ground"))
        space.add_text("the portal", dxfattribs=on("text"))

    frame = drawn(draw, sections={"girder": {"height": 0.03}})
    assert [beam.name for beam in frame.beams] == ["columns", "girder"]
    assert [beam.mesh.height for beam in frame.beams] == [0.02, 0.03]
    state = frame.pin("ground").point_force((2.0, 0), at=(0, 3)).solve_linear()
    left, right = (state.reactions((x, 0)).force for x in (0, 4))
    assert_allclose(left + right, [-2, 0], atol=1e-9)
    assert_allclose([left[1], right[1]], [-1.5, 1.5], rtol=1e-6)
    assert_allclose(left[0], -1.0, rtol=1e-3)


def test_closed_polylines_and_lines_that_nearly_meet(drawn):
    def draw(space):
        space.add_polyline2d([(0, 0), (1, 0), (0.5, 1)], close=True)
        space.add_line((1 + 1e-12, 0), (2, 0))

    frame = drawn(draw, tol=1e-6)
    assert frame.beams[0].mesh.nelements == 4
    state = frame.clamp((0, 0)).point_force((3.0, 0), at=(2, 0)).solve_linear()
    assert_allclose(state.reactions((0, 0)).force, [-3, 0], atol=1e-6)


@pytest.mark.parametrize("draw, message", [
    (lambda space: space.add_arc((0, 0), 1, 0, 90, dxfattribs=on("bow")), "ARC in the layer 'bow'"),
    (lambda space: space.add_lwpolyline([(0, 0, 0, 0, 0.5), (2, 0)]), "has ARC"),
    (lambda space: space.add_text("nothing"), "no lines"),
    (lambda space: space.add_line((0, 0, 0), (0, 3, 1)), "z = ")])
def test_what_is_no_frame_is_said(drawn, draw, message):
    with pytest.raises(MeshError, match=message):
        drawn(draw)


def test_without_ezdxf_or_a_drawing(tmp_path, monkeypatch):
    path = tmp_path / "a.dxf"
    path.write_text("no drawing")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "ezdxf", None)
        with pytest.raises(MissingExtra, match=r'pip install "skfem-ancf\[dxf\]"'):
            Frame.from_meshio(path, **SECTION)
    pytest.importorskip("ezdxf", reason="ezdxf is not installed (the extra 'dxf')")
    with pytest.raises(FileError, match="cannot be read as a drawing"):
        Frame.from_meshio(path, **SECTION)
