"""The scripts in README.md and docs/*.md run as they stand, and their links lead somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def scripts(page):
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_scripts_of_a_page_run_in_order(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if page.name == "paraview.md":
        pytest.importorskip("pyvista")
    names = {}
    for script in scripts(page):
        exec(compile(script, str(page), "exec"), names)
    if page.name == "README.md":
        assert abs(names["state"].displacement((1, 0))[1] + 0.0199) < 1e-4
        both = names["tip"] @ names["q"], names["bent"].position((1, 0))
        assert abs(both[0] - both[1]).max() < 1e-8
        assert {p.name for p in tmp_path.iterdir()} == {"cantilever.vtu", "cantilever.png"}


def test_recipes_do_what_they_say(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for script in scripts(ROOT / "docs" / "own.md"):
        exec(compile(script, "own.md", "exec"), names)
    linear, I, E = names["tip"](), 0.05**4 / 12, 2e8
    weight = 7800 * 9.81 * 0.05**2
    assert abs(linear / (-weight / (8 * E * I)) - 1) < 0.06  # a large deflection
    strain = 0.5 * weight * 0.025 / (E * I)  # at the clamp
    assert 0.05 * strain**2 < 1 - names["law"] / linear < strain**2  # its modulus is E (1 + eps^2)
    one, same = names["element"]
    assert abs(one / same - 1) < 1e-9
    assert abs(names["formulation"] / linear - 1) < 0.2
    assert abs(names["load"] / (5.0 / (3 * E * I)) - 1) < 0.02
    assert abs(names["joint"]) < 1e-12 and abs(names["level"].displacement((1, 0))[1]) > 1e-5
    assert abs(names["pulled"] / (-0.1 / 0.5**2 / (3 * E * I)) - 1) < 0.02
    newmark = names["pendulum"].integrate(0.05, 1e-3, "newmark").displacement((1, 0))[-1, 1]
    assert 0 < abs(names["scheme"] / newmark - 1) < 1e-2


@pytest.mark.parametrize("name", ["README.md", "docs/recipes.md"])
def test_scripts_of_a_page_to_copy_from_have_at_most_15_lines(name):
    for script in scripts(ROOT / name):
        assert len([line for line in script.splitlines() if line.strip()]) <= 15


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def anchors(page):
    """Names of the headings of a page, as the site and GitHub make them."""
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in
            re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_to_headings(page):
    text = page.read_text(encoding="utf-8")
    for target, anchor in re.findall(r"\]\(([^)#:]*\.md)?#([^)]+)\)", text):
        assert anchor in anchors(page.parent / target if target else page), (target, anchor)


def test_the_index_of_tasks_has_sixty():
    page = (ROOT / "docs" / "howto.md").read_text(encoding="utf-8")
    assert len(re.findall(r"^\| (?!task)", page, re.MULTILINE)) >= 60


def test_targets_of_the_readme_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"`?make (\w+)", PAGES[0].read_text(encoding="utf-8")):
        assert f"\n{target}:" in makefile, target
