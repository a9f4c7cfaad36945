"""The benchmark script in its quick form: rows, errors beside times, a report, no judgement."""

import csv
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
bench = pytest.importorskip("bench")


@pytest.mark.parametrize("case", ["5.1", "tangent"])
def test_quick_case_writes_rows_picture_and_report(case, tmp_path, monkeypatch):
    monkeypatch.setattr(bench.runs, "single_core", lambda: None)  # leave the other tests a core
    bench.run(tmp_path, [case], quick=True)
    with open(tmp_path / f"{case}.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {"case", "code", "variant", "elements", "dofs", "steps", "error", "seconds",
            "whole_seconds", "cold_seconds", "iterations",
            "peak_mb", "versions", "machine"} <= set(rows[0])
    ours = [r for r in rows if r["code"] == "skfem-ancf" and r["seconds"]]
    assert ours and all(float(r["seconds"]) > 0 for r in ours)
    if case == "5.1":
        assert all(float(r["whole_seconds"]) > 0 for r in ours)
        assert sum(r["cold_seconds"] != "" for r in ours) == 1
    if case == "5.1":
        assert min(float(r["error"]) for r in ours if r["error"]) < 1e-4
    assert case in (tmp_path / "report.md").read_text(encoding="utf-8").lower()


def test_a_long_run_is_made_once_and_a_failed_one_says_so(monkeypatch):
    from work_precision import ours

    problem = bench.PROBLEMS["5.1"]
    monkeypatch.setattr(bench.runs, "LONG", 0.0)
    entry = bench.runs.Timed(ours.run(problem, "cable", 3, 2))
    entry.repeat()
    row = entry.row(bench.reference("5.1", "cable"), "", ("", ""))
    assert row["runs"] == 1 and row["seconds"] > 0 and row["error"] < 2e-3
    entry = bench.runs.Timed(ours.run(problem, "cable", 3, 2, method="newton", max_iterations=1))
    entry.repeat()
    row = entry.row(bench.reference("5.1", "cable"), "", ("", ""))
    assert row["runs"] == 0 and row["note"].startswith("failed: ConvergenceError")


def test_frames_are_measured_with_their_errors():
    from work_precision import report

    class Memory:
        def peak(self, case, cells):
            return 1.0

    rows = bench.frames.measure((2,), ("", ""), lambda items, _: items, Memory())
    ours = [r for r in rows if r["code"] == "skfem-ancf"]
    assert len(ours) == 4 and all(r["seconds"] > 0 for r in rows)
    assert min(r["error"] for r in ours) < 1e-8
    peers = [r["error"] for r in rows if "quadratic" in r["variant"]]
    assert peers == sorted(peers, reverse=True)  # towards its own limit
    assert "| 2 | skfem-ancf |" in "\n".join(report.frames(rows))


def test_a_sweep_is_measured_with_its_errors(monkeypatch):
    from work_precision import report

    monkeypatch.setattr(bench.sweeps, "EXUDYN", ())
    monkeypatch.setattr(bench.sweeps, "PLACES", ("threads", "one by one"))
    rows = bench.sweeps.measure((3,), ("", ""), lambda items, _: items)
    assert [row["variant"] for row in rows] == [
        f"{kind}, {place}" for kind in ("ancf 3", "cable 5")
        for place in ("threads", "one by one")]
    assert rows[0]["error"] < 1e-2 and rows[2]["error"] < 1e-3
    assert all(row["seconds"] > 0 for row in rows)
    assert "| cable 5, threads |" in "\n".join(report.sweep({"sweep": rows}))


def test_goals_say_which_error_is_missed():
    """Twice as fast at 1e-2 and 1e-3, half as fast below: from numbers made up."""
    def row(code, error, seconds):
        return dict(code=code, error=error, seconds=seconds, variant="v", elements=4, steps="",
                    note="")

    rows = [row("skfem-ancf", 5e-4, 1e-3), row("skfem-ancf", 5e-8, 1e-2), row("Exudyn", 9e-4, 2e-3),
            row("Exudyn", 6e-8, 5e-3)]
    found = {r[1]: r[3:5] for r in bench.goals({"5.2": rows})}
    assert found["error 1e-02"] == found["error 1e-03"] == ("2", "met")
    assert found["error 1e-04"] == found["error 1e-07"] == ("0.5", "missed")
    times = [dict(elements=16, variant=v, seconds=s) for v, s in (
        ("BilinearForm by pairs", 1.0), ("batched form", 0.1), ("fused with the force", 0.02))]
    (tangent,) = bench.goals({"tangent": times})
    assert tangent[1:5] == ("16 elements", "100 times", "50", "missed")


def test_points_are_measured_with_their_difference(capsys):
    import points

    bodies = "plain", "taper", "neo-Hookean"
    points.main(["--quick", "--only", "strain", "raw stress", "--body", *bodies])
    head, *rows = capsys.readouterr().out.splitlines()
    cables = sum("cable" in name for name in points.ELEMENTS)
    each = 3 * len(points.ELEMENTS) - cables
    assert len(rows) == 2 * each * len(points.MESHES) and "difference" in head
    # of sums of some hundred products: 1e-13 on some processors
    assert all(float(row.rstrip("* ").split()[-1]) < 1e-11 for row in rows)


def test_the_page_is_made_of_a_run(tmp_path):
    """Of numbers made up: what is missed is marked, and what was not measured stays as it was."""
    import page

    text = (page.Path(__file__).parents[1] / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert {m[2] for m in page.BLOCK.finditer(text)} == set(page.TABLES)
    head = bench.runs.COLUMNS
    rows = [dict(dict.fromkeys(head, ""), case="5.2", code=code, variant="cable 5", elements=4,
                 error=error, seconds=seconds, whole_seconds=whole, machine="one", versions="two")
            for code, error, seconds, whole in (("skfem-ancf", 1e-8, 2e-3, 8e-3),
                                                ("Exudyn", 1e-8, 4e-3, 6e-3))]
    rows[0]["cold_seconds"] = 1.5
    bench.write(tmp_path / "5.2.csv", head, ([r[c] for c in head] for r in rows))
    made = page.renewed("<!-- bench 5.2 -->\nold\n<!-- end -->\n<!-- bench thick -->\nold\n"
                        "<!-- end -->\n<!-- bench about -->\n<!-- end -->", page.read(tmp_path))
    assert ("| 1e-07 | 4 x cable 5 | 2 | 8 | 4 x cable 5 | 4 | 6 | 2 | 0.75, **missed** |" in made)
    assert "Cold, a new process with nothing compiled: 1.5 s skfem-ancf" in made
    assert made.count("old\n") == 1 and "Of 12 goals 6 were met, 6 missed" in made
