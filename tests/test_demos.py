"""The demos run, say what they should and write their files."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

ROOT = Path(__file__).resolve().parent.parent
DEMOS = sorted(p.stem for p in (ROOT / "demos").glob("*.py"))


@pytest.fixture
def demo(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "demos")
    return importlib.import_module


def test_cantilever_gives_the_numbers_of_the_paper(demo, tmp_path, capsys):
    large, small = demo("cantilever").main(tmp_path, progress=True)
    assert_allclose(large.displacement((1, 0))[1], -0.885455, atol=1.5e-6)
    assert_allclose(small.displacement((1, 0))[1], -0.02, atol=5e-5)
    assert_allclose([small.strain((0, y))[1] for y in (0.005, -0.005)], [-90e-6, 90e-6], atol=4e-6)
    out = capsys.readouterr()
    assert "-0.885455" in out.out and "load: 100%" in out.err
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        f"cantilever_{load}.{kind}" for load in ("force", "gravity") for kind in ("png", "vtu")]


def test_plain_scikit_fem_and_scene_agree(demo, capsys):
    tips = demo("plain_scikit_fem").main()
    assert len(tips) == 2
    for tip, short in tips:
        assert_allclose(tip, short, atol=1e-9)
    reference = -0.903311513  # of the same law with normal sections that stay plane and rigid
    assert abs(tips[1][0][1] - reference) < 1e-3 < abs(tips[0][0][1] - reference)
    assert "Newton, " in capsys.readouterr().out


def test_rollup_turns_as_the_body_does(demo, tmp_path, capsys):
    rollup = demo("rollup")
    state = rollup.main(tmp_path, elements=12, progress=False)
    angle = 2 * np.pi + rollup.end_angle(state)
    assert_allclose(angle, rollup.closed_form(), rtol=5e-4)
    assert abs(angle - rollup.closed_form()) < abs(angle - 2 * np.pi)
    assert len(list(tmp_path.glob("rollup_*.vtu"))) == 4 and (tmp_path / "rollup.png").is_file()
    assert f"{angle / (2 * np.pi):.6f}" in capsys.readouterr().out


def test_spring_stiffens(demo, tmp_path, capsys):
    spring = demo("spring")
    state = spring.main(tmp_path, elements=24, progress=False)
    end = state.beams[0].mesh.p[:, -1]
    length = state.beams[0].mesh.lengths.sum()
    assert end[0] < 0.9 * length < state.position(end)[0] < 1.02 * length
    table = [line.split() for line in capsys.readouterr().out.splitlines()[2:6]]
    assert np.all(np.diff([float(row[2]) for row in table]) > 0)
    assert {p.name for p in tmp_path.iterdir()} == {"spring.png", "spring.vtu"}


def test_every_demo_is_tested_and_named_in_the_readme():
    tests, readme = Path(__file__).read_text(), (ROOT / "README.md").read_text()
    for name in DEMOS:
        assert f'demo("{name}")' in tests and f"demos/{name}.py" in readme


def test_demos_say_how_to_run_them():
    for name in DEMOS:
        assert f"python demos/{name}.py" in (ROOT / "demos" / f"{name}.py").read_text()
