"""The scripts in README.md and docs/*.md run as they stand, and their links lead somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def scripts(page):
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_scripts_of_a_page_run_in_order(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for script in scripts(page):
        exec(compile(script, str(page), "exec"), names)
    if page.name == "README.md":
        assert abs(names["state"].displacement((1, 0))[1] + 0.0199) < 1e-4
        assert {p.name for p in tmp_path.iterdir()} == {"cantilever.vtu", "cantilever.png"}


def test_the_readme_has_one_script_of_at_most_15_lines():
    script, = scripts(PAGES[0])
    assert len([line for line in script.splitlines() if line.strip()]) <= 15


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_targets_of_the_readme_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"`?make (\w+)", PAGES[0].read_text(encoding="utf-8")):
        assert f"\n{target}:" in makefile, target
