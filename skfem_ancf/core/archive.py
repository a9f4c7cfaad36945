"""Files of arrays by name, of which there is never half a one."""

from __future__ import annotations

import os
import stat
import zipfile
from contextlib import contextmanager, suppress
from io import BytesIO
from math import prod
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import FileError, MissingExtra

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from .types import Array, ArrayLike, StrPath

#: Letters of a name that the one of a new file beside it has, at most: names may have 255.
STEM = 100
#: Kinds of numbers and texts in files, by the letters of NumPy.
KINDS = "biufcUS"


class Unreadable(ValueError):
    """A file is none of arrays of numbers and texts as :func:`write` writes them, or is damaged."""


def find_h5py() -> Any:
    """The package h5py; raises MissingExtra where it is not installed."""
    try:
        import h5py
    except ImportError:
        raise MissingExtra("h5py", "files") from None
    return h5py


def read(path: Path) -> dict[str, Array]:
    """The arrays of a file by name, those of :func:`write`.

    What a file says of their sizes is compared with its own before anything is loaded, so that
    reading takes no more memory than the file and a copy of it. Nothing in it is executed.

    Parameters
    ----------
    path
        Its name: .h5, or else an archive of NumPy.

    Raises
    ------
    OSError
        If it cannot be opened.
    Unreadable
        If it is something else, compressed, or damaged.
    """
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        try:
            return _read_h5(file, size) if path.suffix == ".h5" else _read_npz(file, size)
        except MissingExtra:
            raise
        except Exception as error:  # whatever is in it
            raise Unreadable(f"{type(error).__name__}: {error}") from None


def _read_npz(file, size):
    arrays = {}
    with zipfile.ZipFile(file) as members:
        infos = members.infolist()
        if any(x.compress_type != zipfile.ZIP_STORED or x.file_size != x.compress_size
               for x in infos):
            raise Unreadable("its arrays are compressed, which no file of this package is")
        if sum(x.file_size for x in infos) > size:
            raise Unreadable("its arrays are said to be larger than the file")
        for info in infos:
            name, _, suffix = info.filename.rpartition(".")
            if suffix != "npy" or name in arrays:
                raise Unreadable(f"it has a member {info.filename!r} that is no array of its own")
            with members.open(info) as content:
                arrays[name] = _read_npy(name, content, info.file_size)
    return arrays


def _read_npy(name, content, size):
    version = np.lib.format.read_magic(content)
    if version not in ((1, 0), (2, 0)):
        raise Unreadable(f"the array {name!r} is of the version {version} of files of NumPy")
    shape, fortran, dtype = (np.lib.format.read_array_header_1_0 if version == (1, 0) else
                             np.lib.format.read_array_header_2_0)(content)
    _require(name, shape, dtype, size - content.tell())
    flat = np.frombuffer(content.read(), dtype=dtype).copy()
    return flat.reshape(shape, order="F" if fortran else "C")


def _read_h5(file, size):
    h5py, arrays = find_h5py(), {}
    with h5py.File(file, "r") as h5:
        for name in h5:
            if not isinstance(h5.get(name, getlink=True), h5py.HardLink):
                raise Unreadable(f"{name!r} is a link")
            found = h5[name]
            if not isinstance(found, h5py.Dataset) or found.shape is None:
                raise Unreadable(f"{name!r} is no array")
            if found.chunks is not None or found.is_virtual or found.external:
                raise Unreadable(f"the array {name!r} is not stored in one piece")
            _require(name, found.shape, found.dtype, found.id.get_storage_size())
            size -= found.nbytes
            if size < 0:
                raise Unreadable("its arrays are said to be larger than the file")
            arrays[name] = np.asarray(found[()])
    return arrays


def _require(name, shape, dtype, size):
    """Raise Unreadable if an array is none of numbers or texts, or not as large as what there is.
    """
    if dtype.kind not in KINDS or dtype.names or dtype.subdtype or not dtype.itemsize:
        raise Unreadable(f"the array {name!r} is of {dtype}, neither numbers nor texts")
    if any(n < 0 for n in shape) or prod(shape) * dtype.itemsize != size:
        raise Unreadable(f"the array {name!r} is said to have the shape {shape} of {dtype}, but "
                         f"{size} bytes are there")


@contextmanager
def replacing(path: Path, durable: bool = False) -> Iterator[Path]:
    """A new file beside a path, which takes its place when all is written, or is removed.

    Its name is one that nobody knows beforehand, no link is followed, and it may be read and
    written by whom the file that it replaces may, or else a new file.

    Parameters
    ----------
    path
        Where it goes at the end. The new file has the same suffix.
    durable
        Wait until it is on the disk, before and after.

    Yields
    ------
    pathlib.Path
        The new file, empty.

    Raises
    ------
    OSError
        If it cannot be written; what was there stays.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from skfem_ancf.core.archive import replacing
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "note.txt"
    ...     with replacing(path) as new:
    ...         size = new.write_text("whole")
    ...     path.read_text()
    'whole'
    """
    new = new_file(path)
    try:
        yield new
        put_in_place(new, path, durable)
    except BaseException:
        with suppress(OSError):
            new.unlink()
        raise


@contextmanager
def output_file(path: StrPath) -> Iterator[Path]:
    """As :func:`replacing`, of any file: makes the folder, and raises FileError.

    Parameters
    ----------
    path
        Where the file goes.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot make the folder {str(path.parent)!r}: {error}") from error
    try:
        with replacing(path) as new:
            yield new
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"cannot write {str(path)!r}: {error}") from error


def new_file(path: Path) -> Path:
    """A new, empty file beside a path, see :func:`replacing`.

    Parameters
    ----------
    path
        What it is for.
    """
    new = path.with_name(f".{path.stem[:STEM]}.{token_hex(8)}.part{path.suffix}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
    mode = _mode(path)
    os.close(os.open(new, flags, 0o666 if mode is None else 0o600))
    if mode is not None:
        os.chmod(new, mode | 0o600)
    return new


def put_in_place(new: Path, path: Path, durable: bool = False) -> None:
    """Let a complete file take the place of another, see :func:`replacing`.

    Parameters
    ----------
    new
        Of :func:`new_file`.
    path, durable
        As of :func:`replacing`.
    """
    mode = _mode(path)
    if mode is not None:
        os.chmod(new, mode)
    if durable:
        _sync(new)
    os.replace(new, path)
    if durable:
        _sync(path.parent)


def _mode(path):
    """Who may read and write a file that is there; None where there is none, or no plain one."""
    try:
        found = os.lstat(path)
    except OSError:
        return None
    return stat.S_IMODE(found.st_mode) if stat.S_ISREG(found.st_mode) else None


def write(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write a file beside its place, and put it there when it is complete and on the disk.

    Parameters
    ----------
    path
        Its name: .h5, or else an archive of NumPy.
    arrays
        Arrays of any shapes by name, (...).

    Raises
    ------
    OSError
        If it cannot be written; what was there stays.
    """
    with replacing(path, durable=True) as new, open(new, "wb") as file:
        content = BytesIO()  # by way of memory: on a full disk neither can be closed
        if path.suffix == ".h5":
            with find_h5py().File(content, "w") as h5:
                for name, array in arrays.items():
                    h5.create_dataset(name, data=array)
        else:
            np.savez(content, **arrays)  # type: ignore[arg-type]
        file.write(content.getbuffer())


def _sync(path):
    """Put a file, or the names in a folder, on the disk, where the system can."""
    try:
        handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    except OSError:  # of a folder, not on Windows; of a file that may not be written again
        return
    try:
        os.fsync(handle)
    except OSError:
        if not path.is_dir():
            raise
    finally:
        os.close(handle)
