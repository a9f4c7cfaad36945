"""Contact in pictures, files and sensors: of members with each other, and with obstacles."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad

from skfem_ancf import (Beam, BodyContact, Circle, Domain, ElementBeamANCF, ElementBeamCable,
                        InputError, Line, MeshBeam, NameUnknown, RigidBody, Scene,
                        StVenantKirchhoff)
from skfem_ancf.io import PvdWriter

STEEL = StVenantKirchhoff(2e11, 0.0, 7800.0)


def leaf(y=0.0, name=None, element=None, n=8):
    mesh = MeshBeam.init_line(np.linspace(0, 0.5, n + 1), height=0.01, origin=(0, y))
    return Beam(mesh, element or ElementBeamCable(3), STEEL, width=0.02, name=name)


def leaves(friction=0.3):
    scene = Scene(leaf(name="upper"), leaf(-0.01, "lower")).units("N", "m")
    scene.clamp("left", "upper").clamp("left", "lower").contact("all", friction=friction)
    return scene.point_force((0, -200.0), at=(0.5, 0), beam="upper")


def on_a_body():
    outline = [[-0.1, 0.1, 0.1, -0.1], [-0.015, -0.015, 0.015, 0.015]]
    plate = RigidBody(1.0, 1.0, (0.5, -0.02), outline=outline, name="plate")
    scene = Scene(leaf(name="upper"), plate).clamp("left", "upper").clamp((0.5, -0.02), "plate")
    return scene.contact("upper", "plate").line_load((0, -1e3), beam="upper")


def on_a_domain():
    mesh = MeshQuad.init_tensor(np.linspace(0.3, 0.6, 7), np.linspace(-0.065, -0.005, 3))
    block = Domain.solid(Basis(mesh.with_defaults(), ElementVector(ElementQuad2())), STEEL, 0.02,
                         name="plate")
    scene = Scene(leaf(name="upper"), block).clamp("left", "upper").clamp("bottom", "plate")
    return scene.contact("upper", "plate").line_load((0, -1e3), beam="upper")


@pytest.mark.parametrize("scene_of", [leaves, on_a_body, on_a_domain])
def test_pictures_show_each_contact_point(scene_of):
    """A line ends at each point and is as long as its pressure; full dots stick."""
    state = scene_of().solve_static()
    found, ax = state.contact(), state.plot("displacement", contact=True)
    lines, = (one for one in ax.collections if one.get_gid() == "contact")
    ends = np.array(lines.get_segments())
    assert len(found) > 0 and ends.shape == (len(found), 2, 2)
    assert_allclose(ends[:, 0].T, found.points, atol=1e-12)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    assert_allclose(length / length.max(), found.pressure / found.pressure.max(), atol=1e-9)
    against = np.sum((ends[:, 0] - ends[:, 1]).T * found.force, axis=0)
    assert np.all(against[found.pressure > 0] > 0)  # the line is where the other body presses from
    stuck, = (one for one in ax.lines if one.get_gid() == "sticking")
    assert len(stuck.get_xdata()) == np.sum(found.sticking)
    label, = (text.get_text() for text in ax.texts if text.get_gid() == "contact pressure")
    size = 1e6 if scene_of is leaves else 1.0
    assert float(re.search(r"[\d.e+]+", label)[0]) * size == pytest.approx(
        found.pressure.max(), rel=1e-3)
    assert label.endswith(" MPa") == (scene_of is leaves)


def test_contact_is_drawn_to_scale_and_only_where_it_is():
    state = leaves().solve_static()
    with pytest.raises(InputError, match="without scale= .* displacements 50 times as large"):
        state.plot(contact=True, scale=50.0)
    with pytest.raises(InputError, match="without scale= and thickness="):
        state.plot(contact=True, thickness=2.0)
    apart = Scene(leaf(), leaf(-0.1)).clamp("left", 0).clamp("left", 1).contact("all").state()
    for one in (apart, Scene(leaf()).clamp("left").state()):
        assert not [c for c in one.plot("displacement", contact=True).collections
                    if c.get_gid() == "contact"]


def test_files_have_contact_points_beside_the_bodies(tmp_path):
    import meshio

    state = leaves().solve_static()
    found = state.contact()
    state.save(tmp_path / "leaves.vtu")
    mesh = meshio.read(tmp_path / "leaves_contact.vtu")
    assert_allclose(mesh.points[:, :2].T, found.points, atol=1e-15)
    assert_allclose(mesh.point_data["force"][:, :2].T, found.force)
    assert_allclose(mesh.point_data["pressure"], found.pressure)
    assert_allclose(mesh.point_data["gap"], found.gap)
    assert_allclose(mesh.point_data["sticking"], found.sticking)
    text = (tmp_path / "leaves_contact.vtu").read_bytes()
    assert all(f">{unit}</InformationKey>".encode() in text for unit in ("Pa", "N", "m"))
    scene = leaves()
    with PvdWriter(tmp_path / "steps.pvd") as series:
        series.add(scene.state(), 0.0)
        series.add(state, 1.0)
    listed = re.findall(r'part="(\d)" file="(.*?)"', (tmp_path / "steps.pvd").read_text())
    assert listed == [("0", "steps_00000.vtu"), ("0", "steps_00001.vtu"),
                      ("1", "steps_00001_contact.vtu")]
    scene.state().save(tmp_path / "leaves.vtu")  # nothing touches any more
    assert not (tmp_path / "leaves_contact.vtu").exists()


def test_a_file_beside_obstacles_has_both(tmp_path):
    import meshio

    scene = Scene(leaf()).clamp("left").point_force((0, -100.0), at=(0.5, 0))
    state = scene.obstacle(Circle((0.3, -0.055), 0.05)).solve_static()
    state.save(tmp_path / "beam.vtu")
    total = meshio.read(tmp_path / "beam_contact.vtu").point_data["force"].sum(axis=0)
    held = state.reactions("left").force
    assert_allclose(total[:2] + held, np.array([0.0, 100.0]), atol=1e-3)
    assert meshio.read(tmp_path / "beam_obstacles.vtu").points.size


def test_pyvista_has_a_block_of_contact_points():
    pytest.importorskip("pyvista")
    scene = leaves()
    state = scene.solve_static()
    blocks = state.to_pyvista(fields=["displacement"])
    assert blocks.keys() == ["upper", "lower", "contact"]
    assert_allclose(blocks["contact"].point_data["pressure"], state.contact().pressure)
    again = scene.state().to_pyvista(fields=["displacement"], out=blocks)
    assert again["contact"].n_points == 0


def test_sensors_of_contact_balance_the_other_forces():
    """Load, reaction and contact of a leaf sum to zero at each increment of a run."""
    scene = leaves()
    contact = next(item for item in scene.items if isinstance(item, BodyContact))
    scene.sensor("on upper", "contact", beam="upper")
    scene.sensor("on lower", "contact", contact, "lower").sensor("pressure", "contact_pressure")
    run = scene.run(np.linspace(0, 1, 5))
    values = run.sensors
    for k, state in enumerate(run):
        load = np.array([0.0, -200.0 * state.load])
        assert_allclose(values["on upper"][k], -load - state.reactions("left", "upper").force,
                        atol=1e-5)
        assert_allclose(values["on lower"][k], -values["on upper"][k], atol=1e-9)
        assert values["pressure"][k] == np.max(state.contact().pressure, initial=0.0)
    assert values["on lower"][-1, 1] < -50.0 and values["pressure"][-1] > 1e5
    ball = Scene(leaf(n=2)).initial_velocity((0, -1.0)).obstacle(Line((0, -0.01)))
    history = ball.sensor("floor", "contact", 0).integrate(0.01, 5e-4)
    assert history.sensors["floor"][0] @ [0, 1] == 0.0
    assert history.sensors["floor"].max() > 0.0
    with pytest.raises(NameUnknown, match="contact"):
        ball.sensor("wrong", "contacts")


def test_a_leaf_of_an_element_with_sections_is_drawn_too():
    scene = Scene(leaf(element=ElementBeamANCF(2)), leaf(-0.01)).clamp("left", 0).clamp("left", 1)
    state = scene.contact("all").point_force((0, -50.0), at=(0.5, 0), beam=0).solve_static()
    assert "contact pressure" in {text.get_gid() for text in state.plot(contact=True).texts}
