"""Diagrams of section forces on the structure, and section forces beside obstacles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, Circle, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        Frame, InputError, Line, MeshBeam, NameUnknown, Scene, StVenantKirchhoff)

STEEL = StVenantKirchhoff(2.1e11, 0.3, density=7850)


def portal():
    frame = Frame.from_lines([(0, 0), (0, 4), (10, 4), (10, 0)], [(0, 1), (1, 2), (3, 2)],
                             material=STEEL, height=0.3, width=0.2)
    return frame.units("N", "m")


def curve(ax):
    """Points (2, n) of the diagrams: closed lines that begin and end on the member."""
    return [line.get_xydata().T for line in ax.lines if line.get_linewidth() == 0.9]


def test_extremes_of_a_girder_are_on_it_with_their_units():
    """M = q L^2 / 8 = 125 kN m in the middle, Q = q L / 2 at the ends; M hangs below."""
    frame = Frame.from_lines([(0, 0), (10, 0)], [(0, 1)], height=0.3, width=0.2, material=STEEL)
    frame.units("N", "m").pin(0).hold(1, "y").line_load((0, -1e4))
    axes = frame.solve_linear().plot_resultants()
    texts = [[text.get_text() for text in ax.texts] for ax in axes]
    assert texts == [[], ["50 kN", "-50 kN"], ["125 kN m"]] or texts == [
        [], ["-50 kN", "50 kN"], ["125 kN m"]]
    assert axes[0].get_title(loc="left") == "normal force $N$ = 0"
    tip, = axes[2].texts
    assert tip.xy[0] == pytest.approx(5.0, abs=1e-6) and tip.xy[1] < -1.0
    (x, y), = curve(axes[2])
    assert_allclose(y, tip.xy[1] * 4 * x * (10 - x) / 100, atol=1e-6)  # a parabola, not 8 pieces
    assert len(x) > 60
    note, = (text for text in axes[0].figure.texts if text.get_gid() == "note")
    assert "tension" in note.get_text()


def test_a_portal_has_one_scale_for_all_members():
    """The corner moment has the same ordinate on column and girder; both point outwards."""
    frame = portal().clamp([0, 3]).line_load((0, -1e4), beam=0)
    state = frame.solve_linear()
    M = curve(state.plot_resultants()[2])
    left, girder, right = M
    corner = abs(state.resultants(line=1).M[0])
    assert_allclose([left[0, -2], girder[1, 1] - 4.0, right[0, -2] - 10.0],
                    np.array([-1.0, 1.0, 1.0]) * (girder[1, 1] - 4.0), rtol=1e-6)
    assert state.resultants(line=0).M[-1] == pytest.approx(-corner, rel=1e-6)


def test_the_normals_and_chains_of_sections():
    frame = portal().clamp([0, 3]).line_load((0, -1.0), beam=0)
    r = frame.solve_linear().resultants(sections=5)
    assert np.bincount(r.chain).tolist() == [5, 5, 5]
    assert_allclose(r.normal[:, ::5], [[-1, 0, -1], [0, 1, 0]], atol=1e-12)
    motion = frame.solve_linear().resultants([(5, 4), (6, 4)])
    assert motion.normal.shape == (2, 2)
    with pytest.raises(InputError, match="sections"):
        frame.solve_linear().resultants(sections=1)


def test_where_diagrams_are_drawn(tmp_path):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.02)
    beam = Beam(mesh, ElementBeamANCF(2), STEEL, width=0.1)
    state = Scene(beam).clamp("left").point_force((0, -7.0), at=(1, 0)).solve_static()
    length, structure = state.plot_resultants(), state.plot_resultants(on="structure")
    assert length[2].get_xlabel() == "arc length $s$" and structure[2].get_xlabel() == "x"
    text, = structure[2].texts
    assert text.get_text() == "-7" and text.xy[1] > 0  # stretches the upper side
    state.plot_resultants(on="structure", filename=tmp_path / "a.png", title="arm")
    assert (tmp_path / "a.png").stat().st_size > 5000
    with pytest.raises(NameUnknown, match="structure"):
        state.plot_resultants(on="members")


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2), ElementBeamANCF(3),
                                     ElementBeamANCFCubic(2)], ids=repr)
def test_section_forces_beside_an_obstacle_are_those_of_equilibrium(element):
    """A clamped beam over a roller at L / 2: the roller has M = P L / 2, the clamp half of it less
    what the roller yields; elements alone give steps and waves of 30 %."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), 0.01), element, STEEL, width=0.05)
    scene = Scene(beam).clamp("left").point_force((0, -20.0), at=(1, 0))
    state = scene.obstacle(Circle((0.5, -0.055), 0.05)).solve_static(tol=1e-12)
    r, roller = state.resultants(), state.contact().total
    assert r.recovered and "obstacle" in state.recovered[0]
    before, after = r.s < 0.499, r.s > 0.501
    assert_allclose(r.force[1][after], -20.0, rtol=1e-9)
    assert_allclose(r.force[1][before], roller[1] - 20.0, rtol=1e-9)
    x = r.x[0]
    assert_allclose(r.M[after], -20.0 * (1 - x[after]), atol=0.01)
    assert_allclose(r.M[before], roller[1] * (0.5 - x[before]) - 20 * (1 - x[before]), atol=0.02)
    assert r.M.min() == pytest.approx(-10.0, rel=2e-3) and r.M[0] == pytest.approx(5.0, rel=0.03)
    assert r.M[0] == pytest.approx(-state.reactions("left").moment, rel=1e-9)


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(3)], ids=repr)
def test_friction_and_the_offset_of_the_face_are_in_the_section_forces(element):
    """Pushed along a floor by a force on its axis: what acts on the part behind a section, friction
    on its lower face included, is its force and moment."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.04), element, STEEL, width=0.05)
    scene = Scene(beam).gravity((0, -9.81)).point_force((30.0, 0), at=(1, 0))
    scene.obstacle(Line((0, -0.02)), friction=0.3)
    state = scene.run(1.0, 4, tol=1e-11).state(-1)
    rub, weight = state.contact(), 7850 * 0.002 * 9.81
    assert_allclose(rub.total, [-30.0, weight], rtol=1e-5)
    for x in (0.3, 0.55):
        r, (a, b) = state.resultants((x, 0)), state.position((x, 0))
        behind = rub.points[0] > a
        fx, fy = rub.force[:, behind]
        px, py = rub.points[:, behind] - [[a], [b]]
        assert r.force[0] == pytest.approx(30.0 + fx.sum(), abs=1e-3)
        assert r.force[1] == pytest.approx(fy.sum() - weight * (1 - x), abs=1e-3)
        assert r.M == pytest.approx(
            np.sum(px * fy - py * fx) - 0.5 * weight * (1 - x)**2, abs=1e-3)
        assert abs(np.sum(py * fx)) > 0.1  # the lever of the friction


def test_an_obstacle_that_is_not_touched_leaves_the_recovered_fields():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.02)
    beam = Beam(mesh, ElementBeamANCF(2), STEEL, width=0.1)
    free, above = (Scene(beam).clamp("left").point_force((0, -50.0), at=(1, 0)) for _ in range(2))
    state = above.obstacle(Line((0, -1.0))).solve_static()
    assert state.recovered == {0: ""}
    assert_allclose(state.stress((0.3, 0.01)), free.solve_static().stress((0.3, 0.01)), rtol=1e-6,
                    atol=1.0)


def test_labels_of_a_frame_do_not_overlap():
    """Three bays of three storeys: neither each other, nor at the ends of columns the girders."""
    number = np.arange(16).reshape(4, 4)
    columns = np.column_stack([number[:-1].ravel(), number[1:].ravel()])
    girders = np.column_stack([number[1:, :-1].ravel(), number[1:, 1:].ravel()])
    frame = Frame.from_lines([(4.0 * x, 3.0 * y) for y in range(4) for x in range(4)],
                             np.vstack([columns, girders]), height=0.3, width=0.1,
                             groups={"columns": range(12), "girders": range(12, 21)},
                             material=StVenantKirchhoff(2.1e11, 0.3)).units("N", "m")
    frame.clamp(list(range(4))).line_load((0, -2e4), beam="girders").point_force((2e4, 0), at=12)
    normal, shear, _ = frame.solve_static().plot_resultants()
    normal.figure.canvas.draw()
    boxes = [text.get_window_extent() for text in shear.texts]
    assert len(boxes) > 8
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    storeys = normal.transData.transform([(0.0, 3.0 * y) for y in range(1, 4)])[:, 1]
    boxes = [text.get_window_extent() for text in normal.texts]
    assert not any(box.y0 < y < box.y1 for box in boxes for y in storeys)
