"""The texts of :mod:`skfem_ancf.core.source`, compiled by Numba and kept on disk.

Found at run time: without the package numba nothing changes but the speed. Only what Numba cannot
take from the texts is written here: factors of bands, for which they have LAPACK, and calls of
Python objects. ``python -m skfem_ancf.equations.compiled`` compiles everything beforehand.
"""

from __future__ import annotations

import gc
import hashlib
import logging
import os
import sys
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import CompilationWarning, warn

if TYPE_CHECKING:
    from collections.abc import Iterator

logger = logging.getLogger(__name__)

#: What is compiled apart from the texts that call it, and the module that does so.
ADDRESSES = {"common": "shared", "StrainTables": "blocks",
             "elements": "elements", "contacts": "contacts"}
#: Those of them that this process has.
KNOWN: set[str] = set()
#: Compiled functions that this process has, by the name of their text.
LOADED: dict = {}
#: Why Numba cannot be used though it is installed.
PROBLEMS: list[str] = []


@cache
def _stamp() -> str:
    """Of all texts of the package: a function has parts from other files than its own."""
    total = hashlib.sha256()
    package = Path(str(sys.modules[__name__.partition(".")[0]].__file__)).parent
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if b"@source" in text or path.parent.name == "compiled":
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
    warn(f"compiled code is not kept in {str(path)!r}: each process compiles anew. Make "
                  "the folder writable, or set the environment variable NUMBA_CACHE_DIR to another "
                  "one", CompilationWarning)


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

    Numba's own index of what it keeps is that of one version, which another writes anew.
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
        Of texts, or keys of :data:`ADDRESSES`.
    """
    try:
        return all(_note_of(name).exists() for name in names)
    except OSError:
        return False


def note(name: str) -> None:
    """Note that a text has been compiled; warns where that cannot be written.

    Parameters
    ----------
    name
        Name of the text.
    """
    try:
        folder().mkdir(parents=True, exist_ok=True)
        _note_of(name).touch()
    except OSError as error:
        cannot_keep(error)


@cache
def address(part: str) -> int:
    """That of what all texts call; compiles it or takes it from disk.

    Parameters
    ----------
    part
        A key of :data:`ADDRESSES`.
    """
    found = import_module(f".{ADDRESSES[part]}", __package__).address(part)
    note(part)
    KNOWN.add(part)
    return found


class TextProblem(Exception):
    """A text of a user's own that Numba cannot compile."""


def law(text) -> int:
    """The address of the text of a law; compiles it.

    Raises
    ------
    TextProblem
        If Numba does not take it.
    """
    from numba.core.errors import NumbaError

    from .laws import address

    try:
        return address(text)
    except NumbaError as error:
        name = f"{text.__module__}.{text.__qualname__}"
        raise TextProblem(f"{name} cannot be compiled: {str(error).splitlines()[0]}") from error


def load(text, args):
    """The compiled function of a text, compiled or taken from disk for arguments like these.

    Parameters
    ----------
    text
        Marked by :func:`~skfem_ancf.core.source.source`.
    args
        What it will be called with.

    Returns
    -------
    function
    """
    from .twin import compile_for

    LOADED[text.__name__] = compile_for(text, args)
    note(text.__name__)
    return LOADED[text.__name__]


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
