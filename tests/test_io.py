"""Files for ParaView: what they hold, that they are whole, and that they read back."""

import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest
from conftest import quarter_arc
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamPatelShabana, InputError, MeshBeam,
                        NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.io import PvdWriter, body_fields, save_vtu
from skfem_ancf.recovery.grids import grid
from skfem_ancf.results.state import State

FIELDS = {f"{a}_{k}" for a in ("eps", "S", "sigma") for k in ("xx", "yy", "xy")} | {"displacement"}


def bent(element=None, mesh=None, material=None):
    mesh = mesh or MeshBeam.init_line([0, 0.3, 1.0], height=0.1)
    beam = Beam(mesh, element or ElementBeamANCF(3), material or NeoHookean(E=1e6, nu=0.3), 0.1)
    return Scene(beam).clamp("left").point_force((5, -8), at=mesh.p[:, -1]).solve_static()


def affine(beam, A):
    """The state in which the position is A times the stress-free one."""
    q0 = beam.q0.reshape(-1, 2)
    return State(Scene(beam).system, (q0 @ (np.asarray(A) - np.eye(2)).T).ravel())


def turn(a):
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])


@pytest.fixture(scope="module")
def state():
    return bent()


def test_file_holds_the_fields_of_the_state(state, tmp_path):
    path = state.save(tmp_path / "beam.vtu", subdivide=(3, 2))
    m = meshio.read(path)
    assert [c.type for c in m.cells] == ["quad"] and m.cells[0].data.shape == (2 * 6, 4)
    assert set(m.point_data) == FIELDS and m.points.shape == (2 * 12, 3)
    assert_array_equal(m.cell_data["element"][0], np.repeat([0, 1], 6))
    assert_array_equal(m.cell_data["beam"][0], 0)
    X = grid(3, 2)
    reference = state.beams[0].mesh.mapping().F(X).reshape(2, -1).T
    inside = [k for k in range(24) if X[0, k % 12] not in (0, 1)]  # in one element only
    for k in inside:
        x = reference[k]
        assert_allclose(m.points[k, :2], state.position(x), atol=1e-13)
        assert_allclose(m.point_data["displacement"][k], [*state.displacement(x), 0], atol=1e-13)
        strain, stress = state.strain(x), state.stress(x)
        for i, name in enumerate(("xx", "yy", "xy")):
            assert_allclose(m.point_data["eps_" + name][k], strain[i], atol=1e-12)
            assert_allclose(m.point_data["S_" + name][k], stress[i], rtol=1e-9, atol=1e-4)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_cauchy_stress_of_a_stretched_and_turned_bar(plane, angle):
    """Against sigma_1 = stretch_1 S_1 / (other stretches), turned into the global axes."""
    material = StVenantKirchhoff(E=3e6, nu=0.25, plane=plane)
    mesh = MeshBeam.init_line([0, 1, 3], height=0.5, angle=0.4)
    a, b = 1.2, 0.9
    R = turn(angle)
    e = turn(0.4)  # of the stress-free axis
    state = affine(Beam(mesh, ElementBeamANCF(2), material, 0.3), R @ e @ np.diag([a, b]) @ e.T)
    strain = 0.5 * np.array([a * a - 1, b * b - 1, 0.0])
    S = material.D @ strain
    c = 1.0
    if plane == "stress":
        c = np.sqrt(1 - 2 * 0.25 / 0.75 * strain[:2].sum())
    principal = np.diag([a * S[0] / (b * c), b * S[1] / (a * c)])
    sigma = R @ e @ principal @ e.T @ R.T
    data = body_fields(state).point_data
    for name, (i, j) in {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}.items():
        assert_allclose(data["sigma_" + name], sigma[i, j], rtol=1e-10, atol=1e-4)
    assert_allclose(data["eps_xx"], strain[0], atol=1e-13)
    assert_allclose(data["eps_yy"], strain[1], atol=1e-13)


# Lagrange cells


@pytest.mark.parametrize("order", [1, 3, 5, 10])
def test_vtk_evaluates_lagrange_cells_as_we_do(order, tmp_path):
    vtk = pytest.importorskip("vtk", reason="the check against VTK itself needs the package vtk")
    state = bent(ElementBeamANCF(order), quarter_arc())
    beam = state.beams[0]
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(state.save(tmp_path / "arc.vtu", lagrange=True)))
    reader.Update()
    Y = np.random.default_rng(1).random((2, 5))
    exact = beam.mesh.mapping().F(Y) + beam.displacements(state.u, Y)
    for e in range(beam.mesh.nelements):
        cell = reader.GetOutput().GetCell(e)
        for k in range(5):
            x, w = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
            cell.EvaluateLocation(vtk.reference(0), [*Y[:, k], 0.0], x, w)
            assert_allclose(x[:2], exact[:, e, k], atol=1e-13)


# several beams, places, names

@pytest.mark.parametrize("lagrange", [False, True])
def test_all_beams_are_in_one_file(lagrange, tmp_path):
    steel = StVenantKirchhoff(E=1e6, nu=0.3)
    a = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamANCF(5), steel, 0.1, name="a")
    b = Beam(quarter_arc(3), ElementBeamPatelShabana(), steel, 0.1, name="b")
    scene = Scene(a, b).clamp("left", beam="a").clamp("left", beam="b")
    state = scene.point_force((0, -1), at=(2, 0), beam="a").solve_static()
    m = meshio.read(save_vtu(state, tmp_path / "two.vtu", subdivide=(2, 1), lagrange=lagrange))
    beams, elements = (np.concatenate(m.cell_data[k]) for k in ("beam", "element"))
    n = 1 if lagrange else 2
    assert_array_equal(beams, [0] * 2 * n + [1] * 3 * n)
    assert_array_equal(elements, np.repeat([0, 1, 0, 1, 2], n))
    ends = [m.points[np.concatenate([c.ravel() for c, k in zip(block.data, which) if k == b])]
            for b in (0, 1) for block, which in zip(m.cells, m.cell_data["beam"]) if b in which]
    assert ends[0][:, 0].max() > 1.98 and ends[1][:, 1].max() > 1.0  # the arc's outer face


@pytest.mark.parametrize("name", ["beam.xdmf", "beam", "beam.png"])
def test_other_suffixes_are_refused(state, tmp_path, name):
    with pytest.raises(InputError, match=r"must end with one of \.vtu, \.vtk"):
        state.save(tmp_path / name)


# series

def test_series_lists_its_frames_after_each(state, tmp_path):
    times = [0.1, 1 / 3, np.float64(2e5)]
    with PvdWriter(tmp_path / "out" / "run & more.pvd", subdivide=(1, 1)) as series:
        for k, t in enumerate(times):
            frame = series.add(state, t)
            assert frame.name == f"run & more_{k:05d}.vtu"
            rows = list(ET.parse(series.path).getroot().find("Collection"))
            assert [float(r.get("timestep")) for r in rows] == times[:k + 1]
            for r in rows:
                assert meshio.read(series.path.parent / r.get("file")).points.shape == (8, 3)
    assert len(list(series.path.parent.iterdir())) == 4


def test_a_motion_that_fails_lists_what_there_is(state, tmp_path):
    times = np.arange(5.0)

    def frames():
        for t in times:
            yield state.replace(t=t)
        raise KeyError("lost")

    done = []
    with pytest.raises(KeyError), PvdWriter(tmp_path / "run.pvd", subdivide=(1, 1)) as series:
        series.extend(frames(), lambda: done.append(len(list(tmp_path.iterdir()))))
    assert done == [2, 3, 4, 5, 6]
    rows = list(ET.parse(series.path).getroot().find("Collection"))
    assert [float(r.get("timestep")) for r in rows] == list(times)
    first, last = (meshio.read(tmp_path / rows[k].get("file")) for k in (0, -1))
    assert np.array_equal(first.cells[0].data, last.cells[0].data)
    assert np.array_equal(first.cell_data["element"][0], last.cell_data["element"][0])


def test_series_refuses_bad_names_and_times(state, tmp_path):
    with pytest.raises(InputError, match=r"must end with \.pvd"):
        PvdWriter(tmp_path / "run.vtu")
    series = PvdWriter(tmp_path / "run.pvd")
    series.add(state, 1)
    for t in (1.0, 0.5, np.nan):
        with pytest.raises(InputError):
            series.add(state, t)
