"""Files for ParaView: what they hold, that they are whole, and that they read back."""

import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from conftest import quarter_arc, s_curve
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, InputError, MeshBeam, NeoHookean, Scene,
                        StVenantKirchhoff)
from skfem_ancf.io import PvdWriter, body_fields, save_vtu
from skfem_ancf.recovery.grids import grid, lagrange_cell
from skfem_ancf.materials import Material
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


def test_quads_are_counterclockwise_and_cover_the_body(state):
    body = body_fields(state, subdivide=(40, 20))
    x = body.points[body.cells[0][1]][..., :2]
    d = x - np.roll(x, 1, axis=1)
    corner = d[..., 0] * np.roll(d, -1, axis=1)[..., 1] - d[..., 1] * np.roll(d, -1, axis=1)[..., 0]
    assert np.all(corner > 0)
    area = 0.5 * np.sum(x[..., 0] * np.roll(x, -1, axis=1)[..., 1]
                        - x[..., 1] * np.roll(x, -1, axis=1)[..., 0])
    basis = state.beams[0].exact_basis()
    F = basis.interpolate(state.q).grad
    assert_allclose(area, np.sum((F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]) * basis.dx), rtol=1e-3)


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


def test_shear_strain_is_the_tensor_component():
    beam = Beam(MeshBeam.init_line([0, 1], height=1), ElementBeamANCF(1),
                StVenantKirchhoff(E=1.0, nu=0.3), 1.0)
    data = body_fields(affine(beam, [[1, 0.2], [0, 1]])).point_data
    assert_allclose(data["eps_xy"], 0.1, atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1.0, np.pi])
def test_a_turned_curved_beam_has_no_strain_and_no_stress(angle):
    beam = Beam(s_curve(), ElementBeamANCF(4), NeoHookean(E=1.0, nu=0.3), 1.0)
    data = body_fields(affine(beam, turn(angle))).point_data
    assert max(abs(v).max() for k, v in data.items() if k != "displacement") < 1e-12


def test_no_thickness_left_is_nan_without_a_warning():
    beam = Beam(MeshBeam.init_line([0, 1], height=1), ElementBeamANCF(1),
                StVenantKirchhoff(E=1.0, nu=0.3), 1.0)
    data = body_fields(affine(beam, [[3, 0], [0, 3]])).point_data
    assert np.all(np.isnan(data["sigma_xx"])) and np.all(np.isfinite(data["S_xx"]))


# Lagrange cells

@pytest.mark.parametrize("order", [1, 3, 4, 10])
def test_lagrange_cells_are_the_exact_body(order, tmp_path):
    state = bent(ElementBeamANCF(order), quarter_arc())
    beam = state.beams[0]
    m = meshio.read(state.save(tmp_path / "arc.vtu", lagrange=True))
    p = max(3, order)
    assert [c.type for c in m.cells] == ["VTK_LAGRANGE_QUADRILATERAL"]
    assert m.cells[0].data.shape == (beam.mesh.nelements, (p + 1) ** 2)
    X, cell = lagrange_cell(beam)
    powers = [(i, j) for i in range(p + 1) for j in range(p + 1)]

    def monomials(X):
        return np.array([(2 * X[0] - 1) ** i * (2 * X[1] - 1) ** j for i, j in powers])

    Y = np.random.default_rng(1).random((2, 9))
    exact = beam.mesh.mapping().F(Y) + beam.displacements(state.u, Y)
    for e, points in enumerate(m.cells[0].data):
        c = np.linalg.solve(monomials(X[:, cell[0]]).T, m.points[points, :2])
        assert_allclose(monomials(Y).T @ c, exact[:, e].T, atol=1e-11)


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


def test_lagrange_degree_that_vtk_does_not_evaluate():
    beam = Beam(MeshBeam.init_line([0, 1], height=1), ElementBeamANCF(11),
                StVenantKirchhoff(E=1.0, nu=0.3), 1.0)
    with pytest.raises(InputError, match="up to degree 10, this element has 11"):
        body_fields(affine(beam, np.eye(2)), lagrange=True)


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


def test_undeformed_points_and_displacement_give_the_deformed_body(state):
    here, there = body_fields(state), body_fields(state, undeformed=True)
    assert_allclose(there.points + there.point_data["displacement"], here.points, atol=1e-15)
    assert there.points[:, 1].max() == pytest.approx(0.05)


def test_vtk_suffix_and_missing_folders(state, tmp_path):
    path = state.save(str(tmp_path / "a" / "b" / "beam.vtk"))
    assert path.is_file() and set(meshio.read(path).point_data) == FIELDS


@pytest.mark.parametrize("name", ["beam.xdmf", "beam", "beam.png"])
def test_other_suffixes_are_refused(state, tmp_path, name):
    with pytest.raises(InputError, match=r"must end with one of \.vtu, \.vtk"):
        state.save(tmp_path / name)


@pytest.mark.parametrize("subdivide", [(0, 1), (2,), 3, (2.5, 1), (True, 1), None, (1, 2, 3)])
def test_bad_subdivision(state, tmp_path, subdivide):
    with pytest.raises(InputError, match="two positive integers"):
        state.save(tmp_path / "beam.vtu", subdivide=subdivide)


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


@pytest.mark.parametrize("element", [ElementBeamCable(), ElementBeamCable(5),
                                     ElementBeamANCFCubic(2), ElementBeamANCFCubic(4)], ids=str)
@pytest.mark.parametrize("mesh", [MeshBeam.init_line([0, 0.3, 1.0], height=0.1), quarter_arc()],
                         ids=["straight", "arc"])
def test_elements_of_other_kinds(element, mesh, tmp_path):
    state = bent(element, mesh, StVenantKirchhoff(E=1e6, nu=0.3))
    beam = state.beams[0]
    m = meshio.read(state.save(tmp_path / "beam.vtu", subdivide=(2, 2)))
    assert set(m.point_data) == FIELDS
    assert all(np.all(np.isfinite(v)) for v in m.point_data.values())
    end = beam.mesh.p[:, -1]  # on the axis: the point next to last but one of the last element
    assert_allclose(m.points[-2, :2], state.position(end), atol=1e-12)
    assert_allclose([m.point_data["eps_" + k][-2] for k in ("xx", "yy", "xy")],
                    state.strain(end), atol=1e-10)
    lagrange = meshio.read(state.save(tmp_path / "lagrange.vtu", lagrange=True))
    degree = max(element.axis_degree, element.order)
    assert lagrange.cells[0].data.shape == (beam.mesh.nelements, (degree + 1) ** 2)


def test_a_law_that_does_not_say_its_thickness_is_written_without_cauchy_stress(tmp_path):
    class Fibres(Material):
        def energy(self, strain):
            return 0.5 * self.E * np.sum(strain**2, axis=0)

        def stress(self, strain):
            return self.E * strain

    beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.1), ElementBeamANCF(2), Fibres(1e6, 0.0), 0.1)
    state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    state.save(tmp_path / "own.vtu")
    data = meshio.read(tmp_path / "own.vtu").point_data
    assert np.isnan(data["sigma_xx"]).all() and np.abs(data["S_xx"]).max() > 0.0
    with pytest.raises(InputError, match="thickness_stretch"):
        state.save(tmp_path / "own.vtu", fields=["sigma_xx"])
