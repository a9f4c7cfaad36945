"""Whether Numba is used, and the cache of compiled code on disk; without importing Numba, which is
slow."""

import gc
import hashlib
import logging
import os
import re
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from .errors import CompilationWarning, InputError, shown, warn

logger = logging.getLogger(__name__)

#: Environment variable: "0" disables Numba, "1" compiles at once, "auto" (default) compiles
#: when the process has worked long enough in NumPy.
VARIABLE = "SKFEM_ANCF_COMPILED"


def compiled_setting() -> str:
    """The environment variable ``SKFEM_ANCF_COMPILED``: "0", "1" or "auto"; else InputError."""
    value = os.environ.get(VARIABLE, "auto")
    if value in ("0", "1", "auto"):
        return value
    raise InputError(f"the environment variable {VARIABLE} must be 0 (without Numba), 1 (compile "
                     f"at once) or auto (when it pays), got {shown(value)}")


def compiled_off() -> str | None:
    """Why Numba is not used, or None; InputError for an invalid environment variable."""
    if compiled_setting() == "0":
        return f"{VARIABLE}=0"
    if "NUMBA_DISABLE_JIT" in os.environ and os.environ["NUMBA_DISABLE_JIT"] not in ("", "0"):
        return "NUMBA_DISABLE_JIT is set"
    # without importing Numba, which is slow
    installed = sys.modules["numba"] is not None if "numba" in sys.modules else _found("numba")
    return None if installed else "Numba is not installed: pip install skfem-ancf[fast]"


_found = cache(find_spec)


class NotCompiled(Exception):
    """A user's function that Numba cannot compile."""


#: Lines of files that are compiled.
_MARKS = re.compile(rb"^\s*(@source|@primitive|@apart|import numba|from (numba|\.+source) |"
                    rb"from \.+core import (\([^)]*|[^(\n]*)"
                    rb"\b(source|primitive|apart|indices|[FI][123])\b)", re.MULTILINE)


@cache
def compiled_files() -> dict[Path, bytes]:
    """Text of all compiled files by path: of marked functions, their loops, and their tables."""
    package = Path(str(sys.modules[__name__.partition(".")[0]].__file__)).parent
    texts = {path: path.read_bytes() for path in sorted(package.rglob("*.py"))}
    return {path: text for path, text in texts.items()
            if path.name == "loops.py" or _MARKS.search(text)}


@cache
def folder() -> Path:
    """The folder of notes on compiled code, as Numba's cache."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    local = Path(__file__).parent / "__pycache__"
    if _writable(local):
        return local
    return Path.home() / ".cache" / "skfem_ancf"


def _writable(path):
    """True if a folder can be written or created."""
    while not path.exists() and path != path.parent:
        path = path.parent
    return path.is_dir() and os.access(path, os.W_OK)


@cache
def can_keep() -> bool:
    """True if compiled code can be cached on disk; otherwise it warns once."""
    if not _writable(folder()):
        cannot_keep("it cannot be written")
        return False
    return True


@cache
def _warn_of(path):
    warn(f"compiled code is not cached in {str(path)!r}: each process compiles again. Make "
         "the folder writable, or set the environment variable NUMBA_CACHE_DIR to another one",
         CompilationWarning)


def cannot_keep(reason: object) -> None:
    """Warn once per process that compiled code is not cached on disk."""
    logger.info("compiled code is not cached: %s", reason)
    _warn_of(folder())


@cache
def key() -> str:
    """Hash of all that compiled code depends on, in 16 characters, part of names in the cache."""
    try:
        numba = version("numba")
    except PackageNotFoundError:
        numba = "none"
    # all compiled files: Numba checks only the file of a function, not its callees
    stamp = hashlib.sha256(b"".join(compiled_files().values())).hexdigest()[:10]
    parts = (stamp, numba, sys.implementation.cache_tag,
             os.environ.get("NUMBA_CPU_NAME", ""), os.environ.get("NUMBA_CPU_FEATURES", ""))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _note_of(name: str) -> Path:
    return folder() / f"skfem_ancf-{name}-{key()}.compiled"


def on_disk(*names: str) -> bool:
    """True if all named parts are cached, as far as is known without Numba."""
    try:
        return all(_note_of(name).exists() for name in names)
    except OSError:
        return False


def note(name: str) -> None:
    """Note that a part is compiled; warns if that cannot be written."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        _note_of(name).touch()
    except OSError as error:
        cannot_keep(error)


@contextmanager
def verified(place: Path, name: str) -> Iterator[None]:
    """Around work that uses the cached files of a function: removes those that have been damaged. A
    checksum lies beside each file, since Numba runs what it finds in it."""
    def files():
        for path in place.glob(f"*.{name}-*.nb[ci]"):
            yield (path, path.with_suffix(f"{path.suffix}-sum"),
                   b"%08x" % zlib.crc32(path.read_bytes()))

    for path, noted, checksum in files():
        if not noted.exists() or noted.read_bytes() != checksum:
            logger.info("%s is damaged, and compiled again", path)
            path.unlink()
    yield
    for _, noted, checksum in files():
        noted.write_bytes(checksum)


@contextmanager
def nothing_collected() -> Iterator[None]:
    """Disable garbage collection: Numba makes millions of small objects that live on."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
