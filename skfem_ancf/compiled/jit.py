"""How functions are compiled."""

from pathlib import Path

from numba import njit

# no "nnan" and "ninf": a strain that is not finite must be seen
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_FILES = [path.stat() for path in sorted(Path(__file__).parent.glob("*.py"))]
#: Of all files here: a function has parts from others, and Numba looks at its own file only.
STAMP = max(s.st_mtime for s in _FILES), sum(s.st_size for s in _FILES)


def jit(function):
    """Compile a function that Python calls, and keep it on disk."""
    compiled = njit(cache=True, fastmath=_FAST, error_model="numpy")(function)
    kept = getattr(compiled._cache, "_cache_file", None)
    if kept is not None:
        kept._source_stamp = STAMP
    return compiled


def inner(function):
    """Compile a function that compiled ones call: no entrance for Python, which takes as long."""
    return njit(fastmath=_FAST, error_model="numpy", no_cpython_wrapper=True,
                no_cfunc_wrapper=True)(function)


def spliced(function):
    """Compile a function as a part of those that call it."""
    return njit(inline="always")(function)
