"""Where compiled code is kept, and what of it is there; without Numba, which loads slowly."""

from __future__ import annotations

import gc
import hashlib
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from .errors import CompilationWarning, warn

logger = logging.getLogger(__name__)


class NotCompiled(Exception):
    """A user's function that Numba cannot compile."""


@cache
def _stamp() -> str:
    """Of all that is compiled: Numba looks at the file of a function, not at what it calls."""
    total = hashlib.sha256()
    package = Path(str(sys.modules[__name__.partition(".")[0]].__file__)).parent
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if b"@source" in text or b"numba" in text or path.name == "loops.py":
            total.update(text)
    return total.hexdigest()[:10]


@cache
def folder() -> Path:
    """Where notes are kept of what has been compiled: as Numba keeps its own."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    own = Path(__file__).parent / "__pycache__"
    if _writable(own):
        return own
    return Path.home() / ".cache" / "skfem_ancf"


def _writable(path):
    """True if a folder can be written to, or made."""
    while not path.exists() and path != path.parent:
        path = path.parent
    return path.is_dir() and os.access(path, os.W_OK)


@cache
def can_keep() -> bool:
    """True if compiled code can be kept on disk, as far as is known before; else warns, once."""
    if not _writable(folder()):
        cannot_keep("it cannot be written")
        return False
    return True


@cache
def _warn_of(path):
    warn(f"compiled code is not kept in {str(path)!r}: each process compiles again. Make "
         "the folder writable, or set the environment variable NUMBA_CACHE_DIR to another one",
         CompilationWarning)


def cannot_keep(reason: object) -> None:
    """Warn, once a process, that what is compiled is not kept on disk.

    Parameters
    ----------
    reason
        Why.
    """
    logger.info("compiled code is not kept: %s", reason)
    _warn_of(folder())


@cache
def key() -> str:
    """What compiled code depends on, in 16 letters: names by which it is kept end with them.

    Numba's own index of what it keeps is that of one version, which another writes again.
    """
    try:
        numba = version("numba")
    except PackageNotFoundError:
        numba = "none"
    parts = (_stamp(), numba, sys.implementation.cache_tag,
             os.environ.get("NUMBA_CPU_NAME", ""), os.environ.get("NUMBA_CPU_FEATURES", ""))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _note_of(name: str) -> Path:
    return folder() / f"skfem_ancf-{name}-{key()}.compiled"


def on_disk(*names: str) -> bool:
    """True if all are compiled and kept, as far as is known without Numba.

    Parameters
    ----------
    *names
        Names of what is compiled.
    """
    try:
        return all(_note_of(name).exists() for name in names)
    except OSError:
        return False


def note(name: str) -> None:
    """Note that something has been compiled; warns where that cannot be written."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        _note_of(name).touch()
    except OSError as error:
        cannot_keep(error)


@contextmanager
def nothing_collected() -> Iterator[None]:
    """Collect no garbage: Numba makes millions of small objects that live as long as it works."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
