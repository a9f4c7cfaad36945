"""Files of the package: written whole and in nobody's way, and looked at before they are loaded."""

import os
import stat

import numpy as np
import pytest

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff, sweep
from skfem_ancf.io import PvdWriter

posix = pytest.mark.skipif(os.name != "posix", reason="modes and links of files are those of POSIX")


def scene():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 3), 0.05)
    return Scene(Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(2e8, 0.3, 7800), 0.05)
                 ).clamp("left").gravity((0, -9.81))


def _series(path):
    with PvdWriter(path) as writer:
        writer.add(scene().solve_linear(), 0.0)


WRITERS = {
    "run.npz": lambda path: scene().integrate(0.02, 0.01, checkpoint=path),
    "run.h5": lambda path: scene().integrate(0.02, 0.01, checkpoint=path),
    "sweep.npz": lambda path: sweep(lambda x: x, {"x": [1.0, 2.0]}, lambda x: x).save(path),
    "mesh.npz": lambda path: scene().beams[0].mesh.save(path),
    "mesh.json": lambda path: scene().beams[0].mesh.save(path),
    "mesh.vtk": lambda path: scene().beams[0].mesh.save(path),
    "state.vtu": lambda path: scene().solve_linear().save(path),
    "state.vtk": lambda path: scene().solve_linear().save(path),
    "series.pvd": _series,
    "motion.vtkhdf": lambda path: scene().integrate(0.02, 0.01).save(path),
    "state.png": lambda path: scene().solve_linear().plot(filename=path),
    "film.gif": lambda path: scene().integrate(0.02, 0.01).animate(path, backend="matplotlib"),
}
NEEDS = {".h5": "h5py", ".vtkhdf": "h5py", ".png": "matplotlib", ".gif": "PIL"}


@pytest.fixture(params=WRITERS)
def writer(request, tmp_path):
    """A function that writes a file, and its path."""
    pytest.importorskip(NEEDS.get(os.path.splitext(request.param)[1], "numpy"))
    if request.param == "film.gif":
        pytest.importorskip("matplotlib")
    path = tmp_path / request.param
    return lambda: WRITERS[request.param](path), path


@posix
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
def test_a_file_that_is_replaced_keeps_its_mode(writer, mode):
    write, path = writer
    write()
    before = os.umask(0)
    os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~before
    path.chmod(mode)
    if path.name.startswith("run"):  # one that is done is begun again
        assert write().t[-1] == 0.02
    else:
        write()
    assert stat.S_IMODE(path.stat().st_mode) == mode


@posix
def test_links_beside_a_file_are_not_followed(writer, tmp_path):
    """Under all names that could be known beforehand."""
    write, path = writer
    victim = tmp_path / "victim"
    victim.write_text("mine")
    names = {f"{path.name}.part", f"{path.name}.tmp", f".{path.stem}.{os.getpid()}{path.suffix}",
             f".{path.stem}.{os.getpid()}.spare"}
    for name in names:
        (tmp_path / name).symlink_to(victim)
    write()
    assert victim.read_text() == "mine" and not victim.is_symlink()
    assert path.stat().st_size > 0 and not path.is_symlink()
    left = {p.name for p in tmp_path.iterdir()} - names - {"victim", path.name, "series_00000.vtu"}
    assert not left


@posix
def test_a_link_in_place_of_a_file_is_replaced(writer, tmp_path):
    write, path = writer
    victim = tmp_path / "victim"
    victim.write_text("mine")
    path.symlink_to(victim)
    if path.name.startswith("run"):  # what is there is no checkpoint, and stays
        path.unlink()
        return
    write()
    assert victim.read_text() == "mine" and not path.is_symlink()


def test_what_was_there_stays_where_writing_fails(writer, monkeypatch, tmp_path):
    write, path = writer
    write()
    before, names = path.read_bytes(), set(tmp_path.iterdir())

    def fail(*args, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(Exception, match="cannot be written|cannot write"):
        write()
    assert path.read_bytes() == before and set(tmp_path.iterdir()) == names
