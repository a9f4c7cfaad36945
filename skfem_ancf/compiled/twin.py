"""Compiles the texts that :mod:`skfem_ancf.source` marks."""

import hashlib
from functools import cache
from importlib import import_module
from pathlib import Path
from types import FunctionType

from numba import njit

from ..source import column, lanes

# no "nnan" and "ninf": a strain that is not finite must be seen
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


@cache
def stamp():
    """Of all texts of the package: a function has parts from other files than its own."""
    total = hashlib.sha256()
    for path in sorted(Path(__file__).parent.parent.rglob("*.py")):
        text = path.read_bytes()
        if b"@source" in text or path.parent.name == "compiled":
            total.update(text)
    return total.hexdigest()[:10]


@cache
def twin(function, entry=False):
    """The compiled twin of a marked function.

    Parameters
    ----------
    function
        Marked by :func:`~skfem_ancf.source.source` or :func:`~skfem_ancf.source.primitive`.
    entry
        Python calls it: it is kept on disk. What compiled functions alone call has no entrance
        for Python, which takes as long to compile as a small function.

    Returns
    -------
    function
        A Numba dispatcher.
    """
    if function is lanes:
        return range
    if function is column:
        return _one
    if function.twin is not None:
        return getattr(import_module(f"{__package__}.{function.twin}"), function.__name__)
    names = dict(function.__globals__)
    for name in _names(function.__code__):
        if hasattr(names.get(name), "twin"):
            names[name] = twin(names[name])
    text = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
    text.__module__, text.__doc__ = function.__module__, function.__doc__
    # Numba keeps it under this name: code of other texts is not found again
    text.__qualname__ = f"{function.__qualname__}_{stamp()}"
    return jit(text, entry)


def jit(function, entry=False):
    """Compile a function; ``entry`` as for :func:`twin`."""
    return njit(fastmath=_FAST, error_model="numpy", **({"cache": True} if entry else _INNER)
                )(function)


def _names(code):
    """Names that a function takes from its module, inner functions included."""
    for constant in code.co_consts:
        if hasattr(constant, "co_names"):
            yield from _names(constant)
    yield from code.co_names


@njit(inline="always")
def _one(x):
    return x
