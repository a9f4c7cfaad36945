"""The benchmark script in its quick form: rows, errors beside times, a report, no judgement."""

import csv
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
bench = pytest.importorskip("bench")


@pytest.mark.parametrize("case", ["5.1", "tangent", "steps"])
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
    if case == "steps":
        assert max(float(r["error"]) for r in ours) < 0.05
    if case == "5.1":
        assert min(float(r["error"]) for r in ours if r["error"]) < 1e-4
    assert case in (tmp_path / "report.md").read_text(encoding="utf-8").lower()


def test_the_page_is_made_of_a_run(tmp_path):
    """Of numbers made up: what is missed is marked, and what was not measured stays as it was."""
    import page

    text = "".join((page.ROOT / name).read_text(encoding="utf-8") for name in page.PAGES)
    assert {m[2] for m in page.BLOCK.finditer(text)} == set(page.TABLES)
    head = bench.runs.COLUMNS
    rows = [dict(dict.fromkeys(head, ""), case="5.2", code=code, variant="cable 5", elements=4,
                 error=error, seconds=seconds, whole_seconds=whole, machine="one", versions="two")
            for code, error, seconds, whole in (("skfem-ancf", 1e-8, 2e-3, 8e-3),
                                                ("Exudyn", 1e-8, 4e-3, 6e-3),
                                                ("skfem-ancf", 1e-4, 8e-3, 12e-3))]
    rows[-1]["variant"] += ", NumPy"
    rows[0]["cold_seconds"] = 1.5
    bench.write(tmp_path / "5.2.csv", head, ([r[c] for c in head] for r in rows))
    made = page.renewed("<!-- bench 5.2 -->\nold\n<!-- end -->\n<!-- bench thick -->\nold\n"
                        "<!-- end -->\n<!-- bench about -->\n<!-- end -->", page.read(tmp_path))
    assert "4 x cable 5 | 4 | 6 | 2, **missed** | 0.75, **missed** | - |" in made
    assert "| 1e-02 | 4 x cable 5 | 2 | 8 |" in made
    assert "4 x cable 5 | 4 | 6 | 2 | 0.75, **missed** | 0.5 / 0.5 |" in made
    assert "Cold, a new process with nothing compiled: 1.5 s skfem-ancf" in made
    assert made.count("old\n") == 1 and "Of 12 goals 1 were met, 11 missed" in made


def test_pages_have_the_numbers_of_the_files(tmp_path, monkeypatch):
    """Also where the code that is timed has changed since; another number is found."""
    import page

    page.main(["--check"])
    results = page.ROOT / "benchmarks" / "results"
    (tmp_path / "docs").mkdir()
    for name in page.PAGES:
        text = (page.ROOT / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace(" ms |", "9 ms |", 1), encoding="utf-8")
    monkeypatch.setattr(page, "ROOT", tmp_path)
    monkeypatch.setattr(page, "changed", lambda commit: [])
    with pytest.raises(SystemExit, match="does not say what was measured"):
        page.main(["--check", "--results", str(results)])
