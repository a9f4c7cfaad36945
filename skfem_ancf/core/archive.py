"""Files of named arrays, written atomically."""

from __future__ import annotations

import os
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from io import BytesIO
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np

from .errors import FileError, MissingExtra
from .types import Array, ArrayLike, StrPath

#: Longest stem of a temporary file's name; names are limited to 255 characters.
STEM = 100
#: NumPy kinds of arrays in files.
KINDS = "biufcUS"


class Unreadable(ValueError):
    """A file is damaged, or was not written by :func:`write`."""


def find_h5py() -> Any:
    """The package h5py; MissingExtra if it is not installed."""
    try:
        import h5py
    except ImportError:
        raise MissingExtra("h5py", "files") from None
    return h5py


def read(path: Path) -> dict[str, Array]:
    """Read named arrays from a .npz or .h5 file that :func:`write` wrote.

    Memory is bounded by the size of the file, and nothing in it is executed. Raises OSError if the
    file cannot be opened, and Unreadable if it is compressed, damaged or something else.
    """
    load = _read_npz if path.suffix != ".h5" else partial(_read_h5, find_h5py())
    with open(path, "rb") as file:
        try:
            arrays = load(file)
        except Exception as error:  # any content
            raise Unreadable(f"{type(error).__name__}: {error}") from None
    for name, array in arrays.items():
        if array.dtype.kind not in KINDS:
            raise Unreadable(f"the array {name!r} has the type {array.dtype}, neither numbers nor "
                             "texts")
    return arrays


def _read_npz(file):
    size = os.fstat(file.fileno()).st_size
    with zipfile.ZipFile(file) as members:
        if any(x.compress_type != zipfile.ZIP_STORED or x.file_size > size
               for x in members.infolist()):
            raise Unreadable("its arrays are compressed: this package writes no such files")
    with np.load(file, allow_pickle=False) as arrays:
        return dict(arrays)


def _read_h5(h5py, file):
    arrays = {}
    with h5py.File(file, "r") as h5:
        for name, found in h5.items():
            if (not isinstance(h5.get(name, getlink=True), h5py.HardLink)
                    or not isinstance(found, h5py.Dataset) or found.is_virtual or found.external
                    or found.chunks is not None or found.id.get_storage_size() != found.nbytes):
                raise Unreadable(f"{name!r} is not a contiguous array")
            arrays[name] = np.asarray(found[()])
    return arrays


@contextmanager
def replacing(path: Path, durable: bool = False) -> Iterator[Path]:
    """A new, empty file that replaces ``path`` when the block ends, or is removed on an error.

    Links are not followed, and the file mode is kept. With ``durable`` the new file, of the same
    suffix, is synchronised to disk first.

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
    """As :func:`replacing`; creates the folder and raises FileError."""
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as new:
            yield new
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"cannot write {str(path)!r}: {error}") from error


def new_file(path: Path) -> Path:
    """Create an empty file with a random name beside a path."""
    new = path.with_name(f".{path.stem[:STEM]}.{token_hex(8)}.part{path.suffix}")
    new.touch(0o600 if path.is_file() else 0o666, exist_ok=False)
    return new


def put_in_place(new: Path, path: Path, durable: bool = False) -> None:
    """Replace a file by a complete one, see :func:`replacing`."""
    if durable:
        with open(new, "rb+") as file:
            os.fsync(file.fileno())
    if path.is_file() and not path.is_symlink():
        shutil.copymode(path, new)
    os.replace(new, path)


def write(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays to a .npz or .h5 file, atomically and durably; raises OSError."""
    with replacing(path, durable=True) as new, open(new, "wb") as file:
        content = BytesIO()  # in memory first: neither library can close a file on a full disk
        if path.suffix == ".h5":
            with find_h5py().File(content, "w") as h5:
                for name, array in arrays.items():
                    h5.create_dataset(name, data=array)
        else:
            np.savez(content, **arrays)  # type: ignore[arg-type]
        file.write(content.getbuffer())
