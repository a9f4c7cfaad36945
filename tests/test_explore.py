"""The live view, off screen: what is moved is solved, and the body of the picture follows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("pyvista", reason="pyvista is not installed (the extra 'view')")

from skfem_ancf import (Beam, ElementBeamANCF, InputError, MeshBeam, PointForce, Scene,
                        StVenantKirchhoff)

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
L, H = 1.0, 0.05


@pytest.fixture
def scene():
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, 9), H), ElementBeamANCF(3),
                StVenantKirchhoff(2e8, 0.3), width=H)
    return Scene(beam).clamp("left")


def tip(explorer):
    """The middle of the points of the mesh that are at the end, where the section is to scale."""
    points = np.asarray(explorer.mesh.points)[:, :2]
    return points[np.argmin(np.hypot(*(points - explorer.state.position((L, 0))).T))]


def same(explorer, state):
    assert_allclose(explorer.state.u, state.u, atol=1e-7)
    assert_allclose(tip(explorer), state.position((L, 0)), atol=1e-5)


def test_the_body_follows_a_slider(scene):
    explorer = scene.explore(lambda F: PointForce((0, -F), at=(L, 0)), (0, 100), 20, title="F",
                             field="S_xx", thickness=1, off_screen=True)
    body, colours = explorer.mesh, np.array(explorer.mesh.point_data["S_xx"])
    assert explorer.value == 20 and explorer.state.converged
    explorer.widget.GetRepresentation().SetValue(80.0)
    explorer.widget.InvokeEvent("InteractionEvent")
    assert explorer.value == 80.0 and explorer.mesh is body
    same(explorer, scene.point_force((0, -80), at=(L, 0)).solve_static())
    now = np.max(body.point_data["S_xx"])  # M h / (2 I) at the root, from F (L - u)
    wanted = 80 * explorer.state.position((L, 0))[0] * 6 / H**3
    assert np.max(colours) < 0.3 * now and abs(now / wanted - 1) < 0.1
    assert len(scene.loads) == 1  # that of this test: to explore changes no scene
    explorer.plotter.close()


def test_a_dragged_force_acts_where_its_arrow_is(scene):
    explorer = scene.explore(PointForce((0, -30), at=(L, 0)), thickness=1, off_screen=True)
    before = np.array(explorer.widget.GetCenter())[:2] - explorer.state.position((L, 0))
    explorer.widget.SetCenter(*np.array(explorer.widget.GetCenter()) + [-0.1, 0.4, 0])
    explorer.widget.InvokeEvent("InteractionEvent")
    scale = np.hypot(*before) / 30
    assert_allclose(explorer.value, [-0.1 / scale, -30 + 0.4 / scale])
    same(explorer, scene.point_force(explorer.value, at=(L, 0)).solve_static())
    now = np.array(explorer.widget.GetCenter())[:2] - explorer.state.position((L, 0))
    assert_allclose(now, scale * explorer.value)
    explorer.plotter.close()


def test_the_parameter_of_a_scene(scene):
    loaded = scene.point_force((0, -40), at=(L, 0))
    explorer = loaded.explore(lambda E: loaded.replace(material=StVenantKirchhoff(E, 0.3)),
                              (2e8, 4e8), off_screen=True)
    assert explorer.value == 4e8
    stiff = explorer.state.displacement((L, 0))[1]
    assert 1.8 < explorer.set(2e8).displacement((L, 0))[1] / stiff < 2.0
    explorer.plotter.close()


def test_where_no_equilibrium_is_found_the_body_stays(scene):
    free = Scene(*scene.beams).point_force((0, -1), at=(L, 0))  # falls
    explorer = scene.explore(lambda x: scene if x < 0.9 else free, (0, 0.5), off_screen=True)
    before, points = explorer.state, np.array(explorer.mesh.points)
    assert explorer.set(1.0) is before and explorer.value == 0.5
    assert_allclose(explorer.mesh.points, points)
    assert "failed" in explorer.plotter.actors
    explorer.set(0.1)
    assert "failed" not in explorer.plotter.actors
    explorer.plotter.close()


@pytest.mark.parametrize("options, message", [
    (dict(load=3), "load must be a function of a number"),
    (dict(load=PointForce((0, 0), at=(L, 0))), "must not be zero"),
    (dict(load=lambda F: PointForce((0, F), (L, 0)), interval=(1, 0)), "numbers that grow"),
    (dict(load=lambda F: PointForce((0, F), (L, 0)), value=2), "value between"),
    (dict(load=lambda F: "force"), "must be an Item"),
])
def test_what_cannot_be_explored(scene, options, message):
    with pytest.raises(InputError, match=message):
        scene.explore(**options, off_screen=True)
