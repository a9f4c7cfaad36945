"""Files for ParaView: what they hold, that they are whole, and that they read back."""

import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest
from conftest import quarter_arc
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamPatelShabana, InputError, MeshBeam,
                        NeoHookean, Scene, StVenantKirchhoff, __version__)
from skfem_ancf.io import PvdWriter, body_fields, save_vtu
from skfem_ancf.results.state import State

FIELDS = {"displacement", "strain", "stress", "cauchy_stress", "von_mises"}
PLANE = [0, 1, 3]  # xx, yy, xy of the six components of a tensor


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
    m = meshio.read(state.save(tmp_path / "beam.vtu", subdivide=(3, 2)))
    assert [c.type for c in m.cells] == ["quad"] and m.cells[0].data.shape == (2 * 6, 4)
    assert set(m.point_data) == FIELDS and m.points.shape == (7 * 3, 3)
    assert_array_equal(m.cell_data["element"][0], np.repeat([0, 1], 6))
    assert_array_equal(m.cell_data["beam"][0], 0)
    reference = (m.points - m.point_data["displacement"])[:, :2]
    for k in np.flatnonzero(np.abs(reference[:, 0] - 0.3) > 1e-9):  # in one element only
        x = np.clip(reference[k], [0, -0.05], [1, 0.05])
        assert_allclose(m.points[k, :2], state.position(x), atol=1e-12)
        assert_allclose(m.point_data["displacement"][k], [*state.displacement(x), 0], atol=1e-12)
        assert_allclose(m.point_data["strain"][k, PLANE], state.strain(x), atol=1e-10)
        assert_allclose(m.point_data["stress"][k, PLANE], state.stress(x), rtol=1e-7, atol=1e-3)
        assert m.point_data["von_mises"][k] == pytest.approx(state.field("von_mises", x), 1e-7)


def corners(m, name):
    """Values of a field at the corners of all quads, by their reference places."""
    cells = m.cells[0].data
    x = (m.points - m.point_data["displacement"])[cells][..., :2]
    return x, np.asarray(m.point_data[name])[cells]


def test_points_are_shared_where_fields_are_continuous_and_not_where_they_jump(tmp_path):
    """Of an element's own strain both values are in the file, and the cells are the same."""
    state = bent(mesh=MeshBeam.init_line(np.linspace(0, 1, 6), height=0.1))
    smooth, steps = (meshio.read(state.save(tmp_path / f"{k}.vtu", subdivide=(2, 2), recover=k))
                     for k in (True, False))
    assert len(smooth.points) == 11 * 3 and len(steps.points) > 5 * 9 - 4 * 3 + 4
    x, strain = corners(steps, "strain")
    at = np.isclose(x[..., 0], 0.4) & np.isclose(x[..., 1], 0.05)
    left, right = strain[at][:, 0]
    assert abs(left - right) > 0.1 * abs(left)
    inside = state.strain([(0.4 - 1e-9, 0.05), (0.4 + 1e-9, 0.05)], recover=False)[0]
    assert_allclose([left, right], inside, rtol=1e-5)
    for m in (smooth, steps):
        assert_allclose(corners(m, "displacement")[0], x, atol=1e-12)
    alone = meshio.read(state.save(tmp_path / "u.vtu", subdivide=(2, 2), recover=False,
                                   fields="displacement"))
    assert len(alone.points) == 11 * 3


@pytest.mark.parametrize("jump", [0.5, 1.0])
def test_a_stress_that_jumps_at_a_node_has_two_values_there(tmp_path, jump):
    """A rod that is pulled at its middle and at its end: N = 3 before, 1 or 2 behind."""
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(2),
                StVenantKirchhoff(E=1e6, nu=0.0), 0.1)
    scene = Scene(beam).clamp("left", thickness="free").point_force((3 * jump, 0), at=(0.5, 0))
    state = scene.point_force((3 - 3 * jump, 0), at=(1, 0)).solve_static()
    m = meshio.read(state.save(tmp_path / "rod.vtu", subdivide=(1, 1), fields=[
        "displacement", "sigma_xx"]))
    stress = corners(m, "sigma_xx")[1]
    assert len(m.points) == 8
    assert_allclose(stress[0], 300.0, rtol=1e-3)
    assert_allclose(stress[1], 300 - 300 * jump, rtol=1e-3, atol=1e-6)


def test_tensors_have_vtks_six_components(tmp_path):
    """Plane strain: sigma_zz = nu (sigma_xx + sigma_yy), eps_zz = 0; plane stress: S_zz = 0."""
    for plane in ("strain", "stress"):
        mesh = MeshBeam.init_line([0, 1], height=0.5)
        beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(3e6, 0.25, plane=plane), 0.3)
        state = affine(beam, np.diag([1.02, 0.99]))
        m = meshio.read(state.save(tmp_path / "bar.vtu", subdivide=(1, 1)))
        eps = 0.5 * np.array([1.02**2 - 1, 0.99**2 - 1])
        S = np.array(beam.material.D @ [*eps, 0])[:2]
        zz = 0.25 * S.sum() if plane == "strain" else 0.0
        assert_allclose(m.point_data["stress"], [[*S, zz, 0, 0, 0]] * 4, rtol=1e-9, atol=1e-6)
        across = 0.0 if plane == "strain" else -0.25 / 0.75 * eps.sum()
        assert_allclose(m.point_data["strain"], [[*eps, across, 0, 0, 0]] * 4, atol=1e-12)


def test_file_says_names_load_time_version_and_units(tmp_path):
    pv = pytest.importorskip("pyvista", reason="pyvista is not installed (the extra 'view')")
    mesh = MeshBeam.init_line([0, 1, 2], height=0.1)
    a, b = (Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(1e6, 0.3), 0.1, name=name)
            for name in (None, 'mast "<&>"'))
    scene = Scene(a, b).clamp("left", beam=0).clamp("left", beam=1).units("N", "mm")
    path = scene.state(load=0.25).replace(t=1.5).save(tmp_path / "two.vtu")
    assert meshio.read(path).field_data.keys() == {
        'mast "<&>"', "load_factor", "TimeValue", "skfem_ancf_version"}
    read = pv.read(path)
    found = {name: read.field_data[name].tolist() for name in list(read.field_data)}
    version = found.pop("skfem_ancf_version")
    assert ".".join(map(str, version)) == __version__
    assert found == {'mast "<&>"': [1], "load_factor": [0.25], "TimeValue": [1.5]}
    stress = read.GetPointData().GetArray("stress")
    assert [stress.GetComponentName(k) for k in range(6)] == ["xx", "yy", "zz", "xy", "yz", "xz"]
    units = {name: read.GetPointData().GetArray(name).GetInformation().Get(stress.UNITS_LABEL())
             for name in FIELDS}
    assert units == {"displacement": "mm", "strain": None, "stress": "MPa",
                     "cauchy_stress": "MPa", "von_mises": "MPa"}


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
    for k, (i, j) in zip(PLANE, ((0, 0), (1, 1), (0, 1))):
        assert_allclose(data["cauchy_stress"][:, k], sigma[i, j], rtol=1e-10, atol=1e-4)
    assert_allclose(data["strain"][:, :2], [strain[:2]] * len(data["strain"]), atol=1e-13)


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
                assert meshio.read(series.path.parent / r.get("file")).points.shape == (6, 3)
    assert len(list(series.path.parent.iterdir())) == 4


def test_a_motion_that_fails_lists_what_there_is(state, tmp_path):
    times = np.arange(5.0)

    done = []
    with pytest.raises(KeyError), PvdWriter(tmp_path / "run.pvd", subdivide=(1, 1)) as series:
        for t in times:
            series.add(state.replace(t=t), t)
            done.append(len(list(tmp_path.iterdir())))
        raise KeyError("lost")
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
