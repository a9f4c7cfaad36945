"""Files of the package: written whole and in nobody's way, and looked at before they are loaded."""

import os
import zipfile

import numpy as np
import pytest

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.core import archive
from skfem_ancf.core.errors import AncfError
from skfem_ancf.dynamics import integrate
from skfem_ancf.io import PvdWriter


def scene():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 3), 0.05)
    return Scene(Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(2e8, 0.3, 7800), 0.05)
                 ).clamp("left").gravity((0, -9.81))


def _series(path):
    with PvdWriter(path) as writer:
        writer.add(scene().solve_linear(), 0.0)


WRITERS = {
    "run.npz": lambda path: scene().integrate(0.02, 0.01, checkpoint=path),
    "mesh.npz": lambda path: scene().beams[0].mesh.save(path),
    "mesh.vtk": lambda path: scene().beams[0].mesh.save(path),
    "state.vtu": lambda path: scene().solve_linear().save(path),
    "state.vtk": lambda path: scene().solve_linear().save(path),
    "series.pvd": _series,
    "state.png": lambda path: scene().solve_linear().plot(filename=path),
    "film.gif": lambda path: scene().integrate(0.02, 0.01).animate(path),
}
NEEDS = {".png": "matplotlib", ".gif": "PIL"}


@pytest.fixture(params=WRITERS)
def writer(request, tmp_path):
    """A function that writes a file, and its path."""
    pytest.importorskip(NEEDS.get(os.path.splitext(request.param)[1], "numpy"))
    if request.param == "film.gif":
        pytest.importorskip("matplotlib")
    path = tmp_path / request.param
    return lambda: WRITERS[request.param](path), path


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


# what is read


def _stopped(path, **options):
    """A file of a motion that has stopped in the middle."""
    whole = dict(dt=0.01, every=3, scheme="generalized-alpha") | options
    write, copies = integrate.write, []

    def kept(target, arrays):
        write(target, arrays)
        copies.append(path.read_bytes())

    integrate.write = kept
    try:
        scene().integrate(0.1, checkpoint=path, **whole)
    finally:
        integrate.write = write
    path.write_bytes(copies[1])
    return path


READERS = {
    "run.npz": lambda path: scene().resume(path),
    "mesh.npz": MeshBeam.load,
}


@pytest.fixture(params=READERS)
def reader(request, tmp_path):
    """A function that reads a file, and the path of one that is good."""
    path = tmp_path / request.param
    if request.param.startswith("run"):
        _stopped(path)
    else:
        WRITERS[request.param](path)
    return READERS[request.param], path


def test_sizes_are_looked_at_before_anything_is_loaded(reader):
    """Files that are much larger in memory, or say so."""
    read, path = reader
    arrays = archive.read(path)
    name = max(arrays, key=lambda name: arrays[name].nbytes)
    np.savez_compressed(path, **{**arrays, name: np.zeros(2**22)})
    with pytest.raises(AncfError, match="compressed"):
        read(path)
    for size in (2**29, 10**17):  # said in the head of one array
        head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({size},), }}"
        npy = b"\x93NUMPY\x01\x00v\x00" + head.ljust(117).encode() + b"\n" + bytes(800)
        with zipfile.ZipFile(path, "w") as members:
            members.writestr(f"{name}.npy", npy)
        with pytest.raises(AncfError, match="expected .* bytes got 800|Unable to allocate|too big"):
            read(path)


def test_objects_are_refused(reader):
    read, path = reader
    arrays = archive.read(path)
    np.savez(path, **{**arrays, "more": np.array([{}], dtype=object)})
    with pytest.raises(AncfError, match="Object arrays cannot be loaded"):
        read(path)


def test_damaged_files_end_in_the_errors_of_the_package(reader):
    """Bytes changed and ends cut off, at random places."""
    read, path = reader
    content, rng = path.read_bytes(), np.random.default_rng(1)
    for k in range(60):
        damaged = bytearray(content)
        for at in rng.integers(len(content), size=1 + k % 4):
            damaged[at] = rng.integers(256)
        path.write_bytes(damaged[:rng.integers(len(content))] if k % 5 == 0 else damaged)
        try:
            read(path)
        except AncfError as error:
            assert str(path) in str(error)
