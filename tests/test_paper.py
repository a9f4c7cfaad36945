"""The reproduction of the paper: values on small settings, files, report, command line."""

import importlib.util
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("tqdm")

SCRIPT = Path(__file__).resolve().parent.parent / "benchmarks" / "paper.py"
if not SCRIPT.exists():
    pytest.skip("benchmarks/ is not part of this installation", allow_module_level=True)


@pytest.fixture(scope="module")
def paper():
    spec = importlib.util.spec_from_file_location("benchmarks_paper", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    path = list(sys.path)
    spec.loader.exec_module(module)
    yield module
    sys.path[:] = path


@pytest.fixture(scope="module")
def parts(paper):
    from reproduction import continuum, examples, figures, models, report

    class Parts:
        pass

    for module in (continuum, examples, figures, models, report):
        setattr(Parts, module.__name__.split(".")[-1], module)
    Parts.tiny = models.Settings(elements_small=(2, 32), elements_large=(2, 4, 16),
                                 elements_thick=(4, 8), meshes_2d=((8, 2), (16, 2)), elements=4,
                                 dt=5e-3, every=2)
    return Parts


def silent(items, label):
    return iter(items)


@pytest.fixture(scope="module")
def statics(parts):
    return {k: parts.examples.EXAMPLES[k].compute(parts.tiny, silent)
            for k in ("5.1", "5.2", "5.3")}


@pytest.fixture(scope="module")
def motions(parts):
    return {k: parts.examples.EXAMPLES[k].compute(parts.tiny, silent)
            for k in ("5.4", "5.5", "5.6")}


def test_table_4(parts, statics):
    """Every row of the paper's Table 4 but N=4 to its last digit."""
    sheet = statics["5.2"].sheets["table4"]
    assert sheet.columns == ("model", "elements", "dofs", "value", "paper")
    worst = parts.report.deviations(sheet)
    assert set(worst) == set(parts.models.TABLE4)
    assert all(worst[name] < 1.5e-6 for name in worst if name != "N=4")
    assert 1e-5 < worst["N=4"] < 1e-4  # on these meshes


def test_order_4_is_not_stiffer_than_order_2(statics):
    result = statics["5.2"]
    sheet = result.sheets["table4"]
    two, four = (sheet.of(name, "value")[0] for name in ("N=2", "N=4"))
    assert np.all(four < two) and np.all(result.facts["gain"] < 0)


def test_transverse_strain(statics):
    """Beam theory's -/+ 90e-6 where the section can carry it, zero on order 1."""
    sheet = statics["5.1"].sheets["fig07"]
    for name in sheet.models:
        Y, eps, theory = sheet.of(name, "Y", "eps_yy", "theory")
        np.testing.assert_allclose(theory, -90e-6 * Y / 0.005, atol=1e-12)
        if name in ("N=1", "ECM", "strain split"):
            np.testing.assert_allclose(eps, 0.0, atol=1e-12)
        else:
            np.testing.assert_allclose(eps, theory, atol=2e-6)  # 32 elements


def test_small_displacement_locks_by_poisson_on_order_1_only(statics):
    sheet, limit = statics["5.1"].sheets["fig06"], statics["5.1"].facts["limit"]
    for name in sheet.models:
        ratio = sheet.of(name, "value")[0][-1] / limit
        assert ratio == pytest.approx(0.91 if name == "N=1" else 1.0, abs=8e-3)


def test_thick_cantilever(statics):
    result = statics["5.3"]
    sheet = result.sheets["fig11"]
    assert sheet.of("N=2", "value")[0][-1] == pytest.approx(-0.213679, abs=1e-6)
    assert sheet.of("N=2", "paper")[0][-1] == -0.21479
    assert result.facts["limit"] == pytest.approx(-0.2139800, abs=5e-4)


def test_2d_body_against_an_independent_solution(parts):
    """Thick cantilever of another code: tip (-0.15792, -0.71438), plane stress."""
    case = replace(parts.models.CASES["5.3"], L=2.0, h=0.5, b=0.1, E=2.07e11,
                   force=(0.0, -62.5e6))
    _, _, u_x, u_y = parts.continuum.cantilever_tip(case, [(16, 4)])[0]
    assert (u_x, u_y) == pytest.approx((-0.15792, -0.71438), abs=8e-4)


@pytest.mark.parametrize("number, file, t_end", [
    ("5.4", "fig14", 1.0), ("5.5", "fig18", 1.0), ("5.6", "fig23", 0.3)])
def test_time_files(parts, motions, number, file, t_end):
    sheet = motions[number].sheets[file]
    assert sheet.columns == ("t", "model", "tip_x", "tip_y", "strain_energy", "kinetic_energy",
                             "potential_energy", "total_energy")
    case = parts.models.CASES[number]
    for name in sheet.models:
        t, x, y, *energies = sheet.of(name, "t", *sheet.columns[2:])
        assert (t[0], t[-1]) == (0.0, pytest.approx(t_end))
        assert (x[0], y[0]) == pytest.approx((case.L, 0.0), abs=1e-14)
        np.testing.assert_allclose(sum(energies[:3]), energies[3], atol=1e-12)
        assert np.ptp(energies[3]) < 1e-9  # released at rest, conserved
        assert np.min(energies[0]) > -1e-12 and np.min(energies[1]) > -1e-12


def test_stiff_pendulum_is_nearly_a_rigid_rod(motions):
    result = motions["5.4"]
    _t, *rigid = result.facts["rigid"]
    for name in result.sheets["fig14"].models:
        tip = result.sheets["fig14"].of(name, "tip_x", "tip_y")
        np.testing.assert_allclose(tip, rigid, atol=3e-3)


def test_patel_shabana_moves_as_order_2(motions):
    """One space in two sets of coordinates, held at r only."""
    sheet = motions["5.5"].sheets["fig18"]
    for column in ("tip_x", "tip_y", "strain_energy"):
        two, patel = (sheet.of(name, column)[0] for name in ("N=2", "Patel-Shabana"))
        np.testing.assert_allclose(two, patel, atol=1e-7)


def test_released_cantilever_locks_on_order_1_only(motions):
    static = motions["5.6"].facts["static"]
    for name, tip in static.items():
        short = 1 - tip[1] / static["N=4"][1]
        assert short == pytest.approx(0.083 if name == "N=1" else 0.0, abs=0.012)


def test_figures_and_report(parts, statics, motions):
    results = statics | motions
    assert list(results) == list(parts.examples.EXAMPLES)
    for number, result in results.items():
        drawn = parts.figures.DRAW[number](result)
        assert set(drawn) == set(result.sheets)
        for figure in drawn.values():
            for ax in figure.axes:
                assert ax.get_ylabel()
            assert figure.axes[-1].get_xlabel()
            assert figure.legends or any(ax.get_legend() for ax in figure.axes)
    text = parts.report.report(results, parts.tiny, 1.0, False)
    for phrase in ("N=4 row cannot be right", "lost", "recovered by matching the paper's own "
                   "numbers", "Largest deviation", "Halving dt", "ECM: U =", "coarse settings"):
        assert phrase in text
    assert not re.search(r"\b(nan|None)\b", text)


def test_command_line(paper, parts, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(paper, "QUICK", parts.tiny)
    paper.main(["--quick", "--only", "5.1", "--out", str(tmp_path / "out")])
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"fig06.csv", "fig06.png", "fig07.csv", "fig07.png", "report.md"}
    assert "100%" in capsys.readouterr().err
