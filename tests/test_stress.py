"""The stress script in its quick form: every check runs, and its bounds hold."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import stress


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp("stress")
    return stress.run(out, quick=True, progress=False), out


def test_every_check_gives_rows_within_their_bounds(result):
    rows, _ = result
    assert len({r.check for r in rows}) == len(stress.CHECKS)
    assert [r for r in rows if not r.passed] == []
    assert sum(r.bound is not None for r in rows) > 60


def test_tables_and_picture(result):
    rows, out = result
    with open(out / "stress.csv") as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(rows)
    for read, row in zip(table, rows):
        assert read["case"] == row.case and read["passed"] == str(row.passed)
        np.testing.assert_equal(float(read["value"]), float(row.value))
    text = (out / "report.md").read_text()
    assert all(f"## {r.check}\n" in text for r in rows) and ", 0 beyond it" in text
    assert (out / "pendulum.png").stat().st_size > 1000


def test_a_value_beyond_its_bound_is_told(tmp_path, monkeypatch, capsys):
    def bad(quick, out):
        """A check that fails."""
        yield stress.Row("bad", "case", "what", 2.0, 1.0)
        yield stress.Row("bad", "case", "not a number", np.nan, 1.0)
        yield stress.Row("bad", "case", "documented", np.nan)

    run = stress.run
    monkeypatch.setattr(stress, "run", lambda out, quick, progress: run(out, quick, False, [bad]))
    assert stress.main(["--out", str(tmp_path), "--quick"]) == 1
    assert capsys.readouterr().out.count("beyond its bound") == 2
    assert "**beyond**" in (tmp_path / "report.md").read_text()
