"""Tables: labelled arrays of xarray, data frames of pandas, text."""

import csv
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, InputError, MeshBeam, MissingExtra, RigidBody,
                        Scene, StVenantKirchhoff)

STEEL = StVenantKirchhoff(E=1e6, nu=0.0, density=1e3)
F, B, H = 0.5, 0.1, 0.02  # force at the tip, width, height


def scene(**load):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=H), ElementBeamANCF(2), STEEL,
                width=B, name="arm")
    scene = Scene(beam).clamp("left", thickness="free")
    return scene.point_force(load.get("force", (F, 0)), at=(1, 0))


@pytest.fixture(scope="module")
def state():
    return scene().units("N", "m").solve_linear()


@pytest.fixture(scope="module")
def history():
    shaken = scene(force=(0, -1e-3)).sensor("tip", "position", (1, 0)).sensor("root", "M", (0, 0))
    return shaken.integrate(0.02, 0.005)


def test_fields_of_a_pulled_rod_are_labelled(state):
    pytest.importorskip("xarray")
    data = state.to_xarray(at=[(0.25, 0.0), (0.5, 0.01)])
    assert set(data) == {"displacement", "strain", "stress", "cauchy_stress", "von_mises"}
    stress = F / (B * H)
    assert_allclose(data.stress.sel(tensor="xx"), stress, rtol=1e-6)
    assert_allclose(data.stress.sel(tensor=["yy", "xy"]), 0.0, atol=1e-6 * stress)
    assert_allclose(data.von_mises, stress, rtol=1e-6)
    assert_allclose(data.displacement.sel(component="x"), stress / 1e6 * data.x, rtol=1e-4)
    assert data.stress.attrs == {"long_name": "second Piola–Kirchhoff stress", "units": "Pa"}
    assert data.strain.attrs["units"] == "1" and data.x.attrs == {"units": "m"}
    assert data.attrs == {"load_factor": 1.0}


def test_a_body_is_sampled_all_over():
    pytest.importorskip("xarray")
    body = RigidBody(1.0, 1.0, (2, 0), name="bob")
    beam = scene().beams[0]
    both = Scene(beam, body).clamp("left", beam=0)
    data = both.state().to_xarray(["displacement", "S_xx"], subdivide=(2, 2))
    arm = data.isel(point=data.member.values == "arm")
    assert arm.sizes == {"point": 8 * 9, "component": 2}
    assert_allclose([arm.x.min(), arm.x.max(), arm.y.min(), arm.y.max()], [0, 1, -H / 2, H / 2])
    assert_allclose(arm.S_xx, 0, atol=1e-9)
    bob = data.isel(point=data.member.values == "bob")
    assert np.isnan(bob.S_xx).all() and np.isfinite(bob.displacement).all()
    assert "units" not in data.S_xx.attrs  # the scene says none


def test_a_motion_has_the_time_first(history):
    pytest.importorskip("xarray")
    data = history.to_xarray(["displacement", "S_xx"], at=(1, 0))
    assert data.displacement.dims == ("time", "point", "component")
    assert_allclose(data.time, history.t)
    assert_allclose(data.displacement.sel(time=0.01)[0], history.displacement((1, 0))[2])
    assert history.to_xarray("displacement", subdivide=(1, 1)).sizes == {
        "time": 5, "point": 8 * 4, "component": 2}
    for name in ("strain_energy", "kinetic_energy", "potential_energy", "total_energy",
                 "dissipated"):
        assert data[name].dims == ("time",)
        assert_allclose(data[name], getattr(history, name))
    read = history.sensors.to_xarray()
    assert read.tip.sizes == {"time": 5, "tip_1": 2}
    assert_allclose(read.root, history.sensors["root"])


def test_section_forces_are_a_data_frame(history):
    """A force across a beam: M = F (L - x), Q = -F."""
    pytest.importorskip("pandas")
    force = scene(force=(0, -1e-3)).solve_linear()
    x = np.linspace(0.1, 0.9, 5)
    table = force.resultants(np.array([x, 0 * x])).to_dataframe()
    assert_allclose(table.M, -1e-3 * (1 - x), rtol=1e-6)
    assert_allclose(table.force_y, -1e-3, rtol=1e-6)
    assert_allclose(table[["s", "x"]], np.array([x, x]).T)
    one = force.resultants((0.5, 0)).to_dataframe()
    assert len(one) == 1 and one.M[0] == pytest.approx(-5e-4)
    every = history.resultants([(0.2, 0), (0.7, 0)]).to_dataframe()
    assert every.index.names == ["instant", "section"] and len(every) == 10
    assert_allclose(every.loc[3].x, [0.2, 0.7])
    assert_allclose(every.loc[3].M, history.state(3).resultants([(0.2, 0), (0.7, 0)]).M)
    assert len(history.resultants((0.2, 0)).to_dataframe()) == 5


def test_sensors_are_written_as_text(history, tmp_path):
    path = history.sensors.to_csv(tmp_path / "new" / "run.csv")
    with open(path, newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    assert names == ["t", "tip 0", "tip 1", "root"]
    found = np.array(rows, dtype=float)
    np.testing.assert_array_equal(found, np.column_stack(
        [history.t, history.sensors["tip"], history.sensors["root"]]))
    with pytest.raises(InputError, match=r"must end with \.csv"):
        history.sensors.to_csv(tmp_path / "run.txt")


def test_what_is_missing_is_said(state, history, monkeypatch):
    for module in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, module, None)
    for call in (state.to_xarray, history.to_xarray, history.sensors.to_xarray,
                 state.resultants().to_dataframe):
        with pytest.raises(MissingExtra, match=r'pip install "skfem-ancf\[arrays\]"'):
            call()
