"""The demos run without a warning, check what they claim, draw something, and have one form."""

import ast
import re
import runpy
from pathlib import Path

import pytest

matplotlib = pytest.importorskip("matplotlib")

ROOT = Path(__file__).resolve().parent.parent
DEMOS = sorted((ROOT / "demos").glob("*.py"), key=lambda path: path.stem)


@pytest.fixture(params=DEMOS, ids=lambda path: path.stem)
def demo(request):
    return request.param


@pytest.fixture
def pyplot(monkeypatch):
    """matplotlib.pyplot without a display, figures or windows of others."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.close("all")
    monkeypatch.setattr(plt, "show", lambda: None)
    yield plt
    plt.close("all")


def test_a_demo_runs_and_draws(demo, pyplot, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("skfem_ancf.visuals.matplotlib.FRAMES", 2)
    runpy.run_path(str(demo), run_name="__main__")
    figures = [pyplot.figure(number) for number in pyplot.get_fignums()]
    assert figures and all(ax.has_data() for figure in figures for ax in figure.axes)
    for figure in figures:
        figure.canvas.draw()
    assert capsys.readouterr().out
    films = set(re.findall(r'animate\("([^"]*)"', demo.read_text()))
    assert films <= {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.gif")}


def test_a_demo_has_the_form_of_a_gallery(demo):
    text = demo.read_text()
    tree = ast.parse(text)
    title, line, blank, *prose = ast.get_docstring(tree).splitlines()
    assert line == "=" * len(line) and len(title) <= len(line) and not blank
    first, *more = "\n".join(prose).split("\n\n")  # the first one is under the thumbnail
    assert not title.endswith(".") and len(first.split()) <= 25 and more
    assert re.fullmatch(r"[^.?!]+\.", re.sub(r"\d\.\d", "", " ".join(first.split()))), first
    assert 40 <= text.count("\n") <= 100 and text.count("\n# %%\n") >= 2
    assert any(isinstance(node, ast.Assert) for node in ast.walk(tree))


def test_demos_use_what_is_public(demo):
    for node in ast.walk(ast.parse(demo.read_text())):
        names = [node.attr] if isinstance(node, ast.Attribute) else []
        if isinstance(node, ast.ImportFrom):
            names = [*node.module.split("."), *(alias.name for alias in node.names)]
        assert not [name for name in names if name.startswith("_") and not name.endswith("_")]


def test_every_demo_is_in_the_gallery_once():
    titles = [ast.get_docstring(ast.parse(path.read_text())).splitlines()[0] for path in DEMOS]
    assert len(set(titles)) == len(titles)
    assert (ROOT / "demos" / "GALLERY_HEADER.rst").is_file()
    order = runpy.run_path(str(ROOT / "docs" / "order.py"))["ORDER"]
    assert len(set(order)) == len(order) and set(order) <= {path.stem for path in DEMOS}


def test_demos_that_the_readme_names_exist():
    named = re.findall(r"\(demos/(\w+\.py)\)", (ROOT / "README.md").read_text())
    assert named and set(named) <= {path.name for path in DEMOS}
