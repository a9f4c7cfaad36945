"""Grids, views and films: read back, and looked at pixel by pixel."""

import itertools
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

pv = pytest.importorskip("pyvista", reason="pyvista is not installed (the extra 'view')")

from conftest import quarter_arc
from test_io import bent

from skfem_ancf import (Beam, ElementBeamANCF, InputError, MeshBeam, MissingExtra, Scene,
                        StVenantKirchhoff)
from skfem_ancf.io import body_fields
from skfem_ancf.recovery.fields import FIELDS

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
STEEL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)


@pytest.fixture(scope="module")
def state():
    return bent()


@pytest.fixture(scope="module")
def history():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 7), height=0.01), ElementBeamANCF(3), STEEL,
                width=0.01)
    return Scene(beam).pin("left").gravity((0, -9.81)).integrate(0.3, 0.02)


def test_grid_has_the_arrays_of_files(state, tmp_path):
    made = state.to_pyvista(subdivide=(3, 2))
    body = body_fields(state, (3, 2), fields=list(FIELDS))
    assert_allclose(made.points, body.points, atol=1e-14)
    assert_array_equal(made.cells.reshape(-1, 5)[:, 1:], body.cells[0][1])
    assert made.point_data.keys() == list(FIELDS)
    for name in FIELDS:
        assert_allclose(made.point_data[name], body.point_data[name], atol=1e-14)
    read = pv.read(state.save(tmp_path / "a.vtu", subdivide=(3, 2)))
    for name in read.point_data.keys():
        assert_allclose(made.point_data[name], read.point_data[name], atol=1e-14)
    assert made.field_data["load_factor"] == read.field_data["load_factor"] == [1.0]


@pytest.mark.parametrize("recover", [True, False])
def test_grid_is_updated_in_place(state, recover):
    scene = Scene(state.beams[0]).clamp("left").point_force((5, -2), at=(1, 0))
    other = scene.solve_static()
    mesh = state.to_pyvista(fields=["displacement", "stress"], recover=recover)
    points, stress = mesh.points, mesh.point_data["stress"]
    again = other.to_pyvista(fields=["displacement", "stress"], recover=recover, out=mesh)
    new = other.to_pyvista(fields=["displacement", "stress"], recover=recover)
    assert again is mesh
    assert_allclose(points, new.points)
    assert_allclose(stress, new.point_data["stress"])
    smooth = other.to_pyvista(fields=["displacement", "stress"])  # with fewer points, perhaps
    other.to_pyvista(fields=["displacement", "stress"], out=mesh)
    assert mesh.n_points == smooth.n_points
    assert_allclose(mesh.point_data["stress"], smooth.point_data["stress"])
    state.to_pyvista(fields=["displacement", "S_xx"], out=mesh)
    assert set(mesh.point_data) == {"displacement", "S_xx"}  # no stress of another state
    with pytest.raises(InputError, match="out must be a mesh"):
        other.to_pyvista(out=3)
    with pytest.raises(InputError, match="of the same scene"):
        other.to_pyvista(out=pv.MultiBlock({"mast": mesh}))


def test_tensors_are_vtks(state):
    """xx, yy, zz, xy, yz, xz; VTK's filter finds the principal stresses in them."""
    made = state.to_pyvista()
    tensor = made.point_data["cauchy_stress"]
    assert tensor.shape[1] == 6
    assert_allclose(tensor[:, [0, 1, 3]].T, [made["sigma_xx"], made["sigma_yy"], made["sigma_xy"]])
    assert_array_equal(tensor[:, [2, 4, 5]], 0.0)
    full = tensor[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    vtk = pytest.importorskip("vtk")
    calculator = vtk.vtkTensorPrincipalInvariants()
    calculator.SetInputData(made)
    calculator.Update()
    found = pv.wrap(calculator.GetOutput()).point_data
    names = [n for n in found.keys() if "cauchy" in n and "Sigma" in n and "Vector" not in n]
    largest = np.max([np.asarray(found[n]) for n in names], axis=0)
    assert_allclose(largest, np.maximum(made["sigma_1"], 0.0), atol=1e-6 * abs(full).max())
    strain = made.point_data["strain"]
    assert_allclose(strain[:, 3], made["eps_xy"])
    thickness = state.beams[0].material.thickness_stretch(
        np.array([strain[:, 0], strain[:, 1], 2 * strain[:, 3]]))
    assert_allclose(strain[:, 2], 0.5 * (thickness**2 - 1))


def test_beams_by_name():
    a = Beam(MeshBeam.init_line([0, 1], height=0.1), ElementBeamANCF(2), STEEL, 0.1, name="mast")
    b = Beam(quarter_arc(3), ElementBeamANCF(3), STEEL, 0.1)
    state = Scene(a, b).clamp("left", beam=0).clamp("left", beam=1).solve_static()
    blocks = state.to_pyvista(fields=["displacement"])
    assert blocks.keys() == ["mast", "beam 1"]
    assert blocks["beam 1"].n_points == 25 * 5
    assert blocks["mast"].point_data.keys() == ["displacement"]


def test_view_shows_both_signs(state, tmp_path):
    plotter = state.view("S_xx", filename=tmp_path / "new" / "view.png", undeformed=False)
    assert isinstance(plotter, pv.Plotter) and plotter.camera.parallel_projection
    image = np.asarray(pv.read(tmp_path / "new" / "view.png").active_scalars)[:, :3] / 255
    assert np.sum((image[:, 0] > 0.6) & (image[:, 2] < 0.3)) > 50  # red: tension
    assert np.sum((image[:, 2] > 0.5) & (image[:, 0] < 0.4)) > 50  # blue: compression
    low, high = plotter.mapper.scalar_range
    assert high == pytest.approx(-low) and "S_xx" in str(plotter.scalar_bars.keys())
    assert "force / area" in str(plotter.scalar_bars.keys())
    plotter.close()


def test_the_camera_is_close(state, tmp_path):
    """The body fills the width of a picture, or what the bar and the text leave of its height."""
    for size in ((1000, 700), (400, 700)):
        path = tmp_path / "view.png"
        plotter = state.view("S_xx", thickness=1, filename=path, window_size=size)
        low, high = state.to_pyvista().bounds[:4:2], state.to_pyvista().bounds[1:4:2]
        tall = 2.0 * plotter.camera.parallel_scale
        shares = (high[0] - low[0]) / (tall * size[0] / size[1]), (high[1] - low[1]) / tall
        assert 0.85 < max(shares[0], shares[1] / 0.68) <= 1.0
        assert "load 1" in plotter.actors["title"].GetText(2)
        plotter.close()


def test_film(history, tmp_path):
    from PIL import Image

    path = history.animate(tmp_path / "new" / "film.gif", frames=5, size=(320, 240))
    images = []
    with Image.open(path) as film:
        assert film.n_frames == 5 and film.size == (320, 240)
        for k in range(5):
            film.seek(k)
            images.append(np.asarray(film.convert("RGB")).astype(int))
    for a, b in itertools.pairwise(images):
        assert np.sum(np.abs(a - b).max(axis=2) > 60) > 100  # it moves
    assert list(path.parent.iterdir()) == [path]


def test_a_film_is_as_high_as_what_moves(history, tmp_path):
    """A flat beam fills the frame; magnified displacements need more of it."""
    from PIL import Image

    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), ElementBeamANCF(2), STEEL, 0.1)
    flat = Scene(beam).clamp("left").point_force((0, -1e-4), at=(1, 0)).integrate(0.02, 0.01)
    heights = []
    for scale in (1.0, 1e3):
        path = flat.animate(tmp_path / "flat.gif", frames=2, scale=scale, thickness=1)
        with Image.open(path) as film:
            heights.append(film.size[1])
            image = np.asarray(film.convert("L")).astype(int)
        rows = np.flatnonzero((image < 128).sum(axis=1) > 0)
        assert film.size[0] == 800 and np.diff(rows).max() < 0.3 * heights[-1]
    assert 190 <= heights[0] < 300


@pytest.mark.filterwarnings("ignore::ResourceWarning",  # pipes of imageio's reader
                            "ignore::pytest.PytestUnraisableExceptionWarning")
def test_film_as_mp4(history, tmp_path):
    imageio = pytest.importorskip("imageio.v2", reason="imageio is not there: pip install imageio")
    pytest.importorskip("imageio_ffmpeg", reason="no ffmpeg: pip install imageio-ffmpeg")
    path = history.animate(tmp_path / "film.mp4", "von_mises", frames=4, size=(322, 241), fps=10)
    with imageio.get_reader(path) as film:
        images = [np.asarray(image).astype(int) for image in film]
        assert film.get_meta_data()["fps"] == 10
    assert len(images) == 4 and images[0].shape == (242, 322, 3)  # even numbers of pixels
    assert np.sum(np.abs(images[3] - images[0]).max(axis=2) > 60) > 100  # it moves
    assert images[0].mean() > 150 and np.ptp(images[0], axis=2).max() > 50  # white, with colours


def test_without_pyvista(state, history, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    for call in (state.to_pyvista, state.view, history.to_pyvista):
        with pytest.raises(MissingExtra, match=r'pip install "skfem-ancf\[view\]"'):
            call()
    assert history.animate(tmp_path / "a.gif", frames=2, size=(320, 240)).is_file()


def test_notebooks_get_words_and_pictures(state, history, monkeypatch):
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(2), STEEL, 0.1)
    scene = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0))
    path = scene.continuation(steps=2)
    for thing, word in ((state, "equilibrium"), (scene, "item"), (path, "limit"),
                        (history, "instants")):
        text = thing._repr_html_()
        assert word in text and "data:image/png;base64," in text and "<State" not in text
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert "instants" in history._repr_html_() and "<img" not in history._repr_html_()
