"""Axes through points, of arrays and of files."""

import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamCable, FileError, MeshBeam, MeshError, Scene,
                        StVenantKirchhoff)

R = 2.0


def quarter(n, noise=0.0):
    angle = np.linspace(0, np.pi / 2, n)
    radius = R + noise * np.random.default_rng(0).standard_normal(n)
    return np.column_stack([radius * np.sin(angle), R - radius * np.cos(angle)])


def test_a_quarter_of_a_circle_bends_as_one(tmp_path):
    """A thin one, clamped below: u_x = -pi F R^3 / (4 E I) at the upper end, by Castigliano."""
    path = tmp_path / "axis.csv"
    np.savetxt(path, quarter(41), delimiter=",", header="x,y", comments="")
    mesh = MeshBeam.from_points(path, height=0.01, elements=12)
    assert_allclose(mesh.lengths, np.pi * R / 2 / 12, rtol=1e-3)
    assert mesh.lengths.sum() == pytest.approx(np.pi * R / 2, rel=1e-6)
    assert_allclose(np.hypot(mesh.p[0], mesh.p[1] - R), R, rtol=1e-6)
    assert_allclose(mesh.p_X[:, [0, -1]], [[1, 0], [0, 1]], atol=1e-4)
    EI, F = 1e9 * 0.01**4 / 12, 1e-4
    state = Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(1e9, 0.0), 0.01)).clamp(
        "left").point_force((-F, 0), at="right").solve_linear()
    # the moment F R cos(phi), phi from below, on itself
    assert state.displacement(mesh.p[:, -1])[0] == pytest.approx(
        -np.pi * F * R**3 / (4 * EI), rel=2e-3)


@pytest.mark.parametrize("text", [
    "x;y\n0;0\n0,5;0\n1,0;0\n1,5;0\n", "# s\n0 0\n0.5 0\n\n1 0\n1.5 0\n", "0,0\n5e-1,0\n1,0\n1.5,0",
    '"x","y"\n"0","0"\n"0.5","0"\n"1","0"\n"1.5","0"\n',
    "\ufeffx [m]\ty [m]\n0\t0\n0.5\t0\n1\t0\n1.5\t0\n"])
def test_files_of_text(tmp_path, text):
    path = tmp_path / "points.txt"
    path.write_text(text, encoding="utf-8")
    mesh = MeshBeam.from_points(path, 0.1)
    assert_allclose(mesh.p, [[0, 0.5, 1, 1.5], [0, 0, 0, 0]], atol=1e-14)


def test_nodes_are_the_points_and_refinement_stays_on_the_axis():
    points = quarter(9)
    mesh = MeshBeam.from_points(points, lambda s: 0.1 + 0.01 * s)
    assert mesh.node_height(8) == pytest.approx(0.1 + 0.01 * np.pi, rel=1e-3)
    mesh = MeshBeam.from_points(points, 0.1)
    assert_allclose(mesh.p.T, points, atol=1e-13)
    fine = pickle.loads(pickle.dumps(mesh)).refined(2)
    assert fine.nelements == 32
    assert_allclose(np.hypot(fine.p[0], fine.p[1] - R), R, rtol=1e-4)
    assert_allclose(MeshBeam.from_points([(0, 0), (3, 4)], 0.1, elements=5).lengths, 1.0)


def test_measured_points_are_smoothed():
    points = quarter(200, 1e-3)
    with pytest.raises(MeshError, match="points need noise="):
        MeshBeam.from_points(points, 0.1, elements=8)
    mesh = MeshBeam.from_points(points, 0.1, elements=8, noise=1e-3)
    assert_allclose(np.hypot(mesh.p[0], mesh.p[1] - R), R, atol=1e-3)
    angle = np.arctan2(mesh.p[0], R - mesh.p[1])
    assert_allclose(np.arctan2(mesh.p_X[1], mesh.p_X[0]), angle, atol=0.02)


def test_what_is_wrong_is_said(tmp_path):
    for points, message in (([(0, 0)], "at least two points"), ([(0, 0), (1, 0), (1, 0)],
                            "points 1 and 2 are both at"), ([(0, 0), (1, 0), (1, 1), (0, 1)],
                            "folds")):
        with pytest.raises(MeshError, match=message):
            MeshBeam.from_points(points, height=1.5)
    with pytest.raises(MeshError, match="points 4 and 5 are both at"):  # the spline would turn
        MeshBeam.from_points(np.insert(quarter(9), 5, quarter(9)[4] + 1e-9, axis=0), 0.1)
    with pytest.raises(MeshError, match="in order along the axis"):
        MeshBeam.from_points(quarter(9)[[0, 1, 4, 2, 3, 5, 6, 7, 8]], 0.1)
    with pytest.raises(MeshError, match="more than noise=0.0001"):
        MeshBeam.from_points(quarter(200, 1e-3), 0.1, elements=8, noise=1e-4)
    with pytest.raises(MeshError, match="noise"):
        MeshBeam.from_points(quarter(9), 0.1, noise=-1)
    with pytest.raises(FileError, match="cannot be read"):
        MeshBeam.from_points(tmp_path / "none.csv", 0.1)
    path = tmp_path / "p.csv"
    for text, message in (("a,b\n1,x\n", "rows of two numbers"), ("1,2,3\n", "3 columns")):
        path.write_text(text)
        with pytest.raises(MeshError, match=message):
            MeshBeam.from_points(path, 0.1)
