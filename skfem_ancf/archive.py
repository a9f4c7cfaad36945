"""Files of arrays by name, of which there is never half a one."""

from __future__ import annotations

import os
import zipfile
import zlib
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import MissingExtra

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from .types import Array

#: What reading a file raises that is damaged, or none of these.
DAMAGED = (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, MemoryError,
           RuntimeError, OverflowError, zipfile.BadZipFile, zlib.error)


def find_h5py() -> Any:
    """The package h5py; raises MissingExtra where it is not installed."""
    try:
        import h5py
    except ImportError:
        raise MissingExtra("h5py", "files") from None
    return h5py


def write(path: Path, arrays: Mapping[str, Array]) -> None:
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
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as file:
            content = BytesIO()  # by way of memory: on a full disk neither can be closed
            if path.suffix == ".h5":
                with find_h5py().File(content, "w") as h5:
                    for name, array in arrays.items():
                        h5.create_dataset(name, data=array)
            else:
                np.savez(content, **arrays)  # type: ignore[arg-type]
            file.write(content.getbuffer())
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
        _sync_folder(path.parent)
    except BaseException:
        try:
            part.unlink(missing_ok=True)
        except OSError:
            pass
        raise


def _sync_folder(folder):
    """Put the new name on the disk too, where the system can."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # not on Windows
        return
    try:
        os.fsync(handle)
    except OSError:
        pass
    finally:
        os.close(handle)
