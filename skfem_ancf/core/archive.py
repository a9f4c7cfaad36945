"""Files of named arrays, written atomically."""

import os
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from secrets import token_hex

import numpy as np

from .errors import FileError, retold
from .types import Array, ArrayLike, StrPath


class Unreadable(ValueError):
    """A file is damaged, or was not written by :func:`write`."""


def read(path: Path) -> dict[str, Array]:
    """Read named arrays from a .npz file that :func:`write` wrote."""
    # Memory is bounded by the size of the file, and nothing in it is executed. Raises OSError if
    # the file cannot be opened, and Unreadable if it is compressed, damaged or something else.
    with open(path, "rb") as file:
        try:
            size = os.fstat(file.fileno()).st_size
            with zipfile.ZipFile(file) as members:
                if any(x.compress_type != zipfile.ZIP_STORED or x.file_size > size
                       for x in members.infolist()):
                    raise Unreadable("its arrays are compressed: this package writes no such files")
            with np.load(file, allow_pickle=False) as found:
                arrays = dict(found)
        except Exception as error:  # any content
            raise Unreadable(f"{type(error).__name__}: {error}") from None
    for name, array in arrays.items():
        if array.dtype.kind not in "biufcUS":
            raise Unreadable(f"the array {name!r} has the type {array.dtype}, neither numbers nor "
                             "texts")
    return arrays


@contextmanager
def replacing(path: Path, durable: bool = False) -> Iterator[Path]:
    """A new, empty file that replaces ``path`` when the block ends, or is removed on an error."""
    # Links are not followed, and the file mode is kept. With ``durable`` the new file, of the same
    # suffix, is synchronised to disk first.
    # names are limited to 255 characters
    new = path.with_name(f".{path.stem[:100]}.{token_hex(8)}.part{path.suffix}")
    new.touch(0o600 if path.is_file() else 0o666, exist_ok=False)
    try:
        yield new
        if durable:
            with open(new, "rb+") as file:
                os.fsync(file.fileno())
        if path.is_file() and not path.is_symlink():
            shutil.copymode(path, new)
        os.replace(new, path)
    except BaseException:
        with suppress(OSError):
            new.unlink()
        raise


@contextmanager
def output_file(path: StrPath) -> Iterator[Path]:
    """As :func:`replacing`; creates the folder and raises FileError."""
    path = Path(path)
    with retold(OSError, "cannot write {!r}: {error}", str(path), error=FileError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as new:
            yield new


def write(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays to a .npz file, atomically and durably; raises OSError."""
    with replacing(path, durable=True) as new, open(new, "wb") as file:
        content = BytesIO()  # in memory first: NumPy cannot close a file on a full disk
        np.savez(content, **arrays)  # type: ignore[arg-type]
        file.write(content.getbuffer())
