"""Motions that are written to files, killed, and gone on with."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from test_restart import driven, swinging

from skfem_ancf import ElementBeamANCF
from skfem_ancf.core.errors import CheckpointError, InputError
from skfem_ancf.dynamics import SCHEMES, GeneralizedAlpha, Newmark, integrate

NAMES = ("t", "u", "v", "acceleration", "multipliers")


def assert_identical(a, b):
    for name in NAMES:
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    for name in ("steps", "rejected", "substeps", "iterations", "factorizations"):
        assert getattr(a, name) == getattr(b, name), name


def stages(monkeypatch, path):
    """Copies of the file after each time that it is written: a list that grows."""
    copies, write = [], integrate.write

    def kept(target, arrays):
        write(target, arrays)
        copies.append(shutil.copy(path, path.with_name(f"{len(copies)}{path.suffix}")))

    monkeypatch.setattr(integrate, "write", kept)
    return copies


#: Which scene, and how.
OPTIONS = {
    "equal steps": dict(dt=2.5e-3, every=9),
    "compiled blocks": dict(dt=1e-3, every=64),
    "instants asked for": dict(dt=2.5e-3, every=7, t_eval=np.linspace(0.011, 0.099, 12)),
    "automatic": dict(dt="auto", rtol=1e-3, every=6),
    "breakpoints": dict(dt=2.5e-3, every=8, breakpoints=[0.0312, 0.07]),
}


@pytest.mark.parametrize("name", OPTIONS)
def test_from_every_file_bit_for_bit(name, tmp_path, monkeypatch):
    path, options = tmp_path / "run.npz", OPTIONS[name]
    build = swinging if name == "compiled blocks" else driven
    plain = build().integrate(0.1, **{k: v for k, v in options.items() if k != "every"})
    copies = stages(monkeypatch, path)
    whole = build().integrate(0.1, checkpoint=path, **options)
    assert_identical(whole, plain)  # writing changes nothing
    assert len(copies) > 2
    scene = build()
    for copy in copies[::2] + copies[-1:]:
        assert_identical(scene.resume(copy), whole)


@pytest.mark.parametrize("scheme", [cls() for cls in SCHEMES.values() if cls.joined]
                         + [GeneralizedAlpha(0.3), Newmark(0.36, 0.6)], ids=repr)
def test_every_scheme(scheme, tmp_path, monkeypatch):
    path = tmp_path / "run.npz"
    copies = stages(monkeypatch, path)
    whole = driven(False).integrate(0.03, 2.5e-3, scheme=scheme, checkpoint=path, every=5)
    again = driven(False).resume(copies[1])
    assert_identical(again, whole)
    assert repr(again.scheme) == repr(scheme)
    assert sorted(p.name for p in tmp_path.iterdir() if ".part" in p.name) == []
    # an instant of what was gone on with is one of the motion
    assert driven(False).integrate(0.035, 2.5e-3, scheme=scheme, start=again.state(-1)).steps == 2


def test_a_finished_file_gives_the_history(tmp_path):
    path = tmp_path / "run.npz"
    whole = swinging().integrate(0.02, 2.5e-3, checkpoint=path)  # by time: start and end
    assert_identical(swinging().resume(path), whole)
    swinging().integrate(0.01, 2.5e-3, checkpoint=path)  # a finished one may be replaced
    assert swinging().resume(path).t[-1] == pytest.approx(0.01)


# where it cannot be written


@pytest.mark.parametrize("path, error, message", [
    ("missing/run.npz", CheckpointError, "run.npz.* cannot be written"),
    ("run.txt", InputError, "must end with .npz"), (3, InputError, "path of a file"),
])
def test_bad_places(path, error, message, tmp_path):
    path = tmp_path / path if isinstance(path, str) else path
    with pytest.raises(error, match=message):
        swinging(False).integrate(0.1, 2.5e-3, checkpoint=path)
    assert not list(tmp_path.iterdir())


# files that are not the right ones


@pytest.fixture
def unfinished(tmp_path, monkeypatch):
    path = tmp_path / "run.npz"
    copies = stages(monkeypatch, path)
    swinging(False).integrate(0.02, 2.5e-3, checkpoint=path, every=3)
    monkeypatch.undo()
    return Path(copies[1])


def test_an_unfinished_run_is_not_overwritten(unfinished):
    with pytest.raises(CheckpointError, match="holds a run up to t = 0.0075 of 0.02.*resume"):
        swinging(False).integrate(0.02, 2.5e-3, checkpoint=unfinished)
    foreign = unfinished.with_name("mine.npz")
    np.savez(foreign, a=np.zeros(3))
    with pytest.raises(CheckpointError, match="not a checkpoint.*not overwritten"):
        swinging(False).integrate(0.02, 2.5e-3, checkpoint=foreign)
    assert np.load(foreign)["a"].shape == (3,)


def test_files_of_other_versions(unfinished, tmp_path, monkeypatch):
    monkeypatch.setattr(integrate, "FORMAT", "skfem-ancf checkpoint 99")
    with pytest.raises(CheckpointError, match="not of this version, which reads .* 99"):
        swinging(False).resume(unfinished)


def test_other_beams_are_refused(unfinished):
    for options in ({"ne": 3}, {"element": ElementBeamANCF(3)}):
        with pytest.raises(CheckpointError, match="another scene: beams, bodies or their mesh"):
            swinging(False, **options).resume(unfinished)
    with pytest.raises(CheckpointError, match="the run had 0 sensors, the scene has 1"):
        swinging(False).sensor("tip", "position", at="right").resume(unfinished)


def test_a_custom_scheme_is_passed(tmp_path, monkeypatch):
    class Mine(GeneralizedAlpha):
        name = "mine"

    copies = stages(monkeypatch, tmp_path / "run.npz")
    whole = swinging(False).integrate(0.02, 2.5e-3, scheme=Mine(0.5), every=3,
                                      checkpoint=tmp_path / "run.npz")
    with pytest.raises(CheckpointError, match="custom scheme, 'mine': pass it"):
        swinging(False).resume(copies[1])
    with pytest.raises(CheckpointError, match="from a run with 'mine' and .*, not with"):
        swinging(False).resume(copies[1], scheme=Mine(0.3))
    assert_identical(swinging(False).resume(copies[1], scheme=Mine(0.5)), whole)
