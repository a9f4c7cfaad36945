"""Motions that are written to files, killed, and gone on with."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from test_restart import driven, swinging

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.core.errors import CheckpointError, InputError, MissingExtra
from skfem_ancf.dynamics import SCHEMES, GeneralizedAlpha, Newmark, checkpoint

NAMES = ("t", "u", "v", "acceleration", "multipliers")


def assert_identical(a, b):
    for name in NAMES:
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    for name in ("steps", "rejected", "substeps", "iterations", "factorizations"):
        assert getattr(a, name) == getattr(b, name), name


def stages(monkeypatch, path):
    """Copies of the file after each time that it is written: a list that grows."""
    copies, write = [], checkpoint.write

    def kept(target, arrays):
        write(target, arrays)
        copies.append(shutil.copy(path, path.with_name(f"{len(copies)}{path.suffix}")))

    monkeypatch.setattr(checkpoint, "write", kept)
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
    if scheme.name == "radau":
        pytest.importorskip("h5py")
        path = tmp_path / "run.h5"
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
    ("missing/run.npz", CheckpointError, "folder .*missing.* does not exist"),
    ("run.txt", InputError, "ends in .npz or .h5"), (3, InputError, "path of a file"),
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
    monkeypatch.setattr(checkpoint, "FORMAT", "skfem-ancf checkpoint 99")
    with pytest.raises(CheckpointError, match="has the format .* this version reads .* 99"):
        swinging(False).resume(unfinished)
    np.savez(tmp_path / "old.npz", text=np.zeros(3, np.uint8), checksum=np.zeros(3, np.uint8))
    with pytest.raises(CheckpointError, match="of an earlier version"):
        swinging(False).resume(tmp_path / "old.npz")


def test_other_scenes_are_refused(tmp_path, monkeypatch):
    def build(E=1e5, ne=2, width=0.1, element=2, g=-9.81, at=(0.5, 0), joint=(1, 0), f=np.cos,
              hold="pin"):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, ne + 1), 0.1), ElementBeamANCF(element),
                    StVenantKirchhoff(E, 0.3, 1000.0), width, compiled=False)
        scene = getattr(Scene(beam), hold)("left").gravity((0, g))
        scene.point_force((1, 0), at, amplitude=f)
        scene.joint("line", at=(1, 0), direction=joint)
        return scene

    path = tmp_path / "run.npz"
    copies = stages(monkeypatch, path)
    build().integrate(0.02, 2.5e-3, checkpoint=path, every=3)
    assert build().resume(copies[1]).t[-1] == pytest.approx(0.02)
    for change, part in (({"E": 1.1e5}, "stiffness of beam 0"), ({"ne": 3}, "mesh of beam 0"),
                         ({"width": 0.2}, "mass of beam 0"), ({"element": 3}, "mesh of beam 0"),
                         ({"g": -9.82}, "load 0"), ({"at": (0.6, 0)}, "load 1"),
                         ({"joint": (1, 1)}, "joint 0"), ({"f": np.sin}, "amplitude of load 1"),
                         ({"f": None}, "amplitude of load 1"), ({"hold": "clamp"}, "supports")):
        with pytest.raises(CheckpointError, match=f"from another scene, .*{part}"):
            build(**change).resume(copies[1])


def test_without_h5py(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtra, match=r"skfem-ancf\[files\]"):
        swinging(False).integrate(0.01, 2.5e-3, checkpoint=tmp_path / "run.h5")
    with pytest.raises(MissingExtra, match=r"skfem-ancf\[files\]"):
        swinging(False).resume(tmp_path / "run.h5")
