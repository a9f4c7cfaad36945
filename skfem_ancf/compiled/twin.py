"""Compiles the texts that :mod:`skfem_ancf.source` marks."""

import logging
import pickle
from functools import cache
from importlib import import_module
from types import FunctionType

from numba import njit, typeof

from ..source import column, lanes
from . import stamp

logger = logging.getLogger(__name__)

# no "nnan" and "ninf": a strain that is not finite must be seen
FAST = {"contract", "reassoc", "nsz", "arcp"}
_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


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
    if not entry and (function.spliced or _small(function)):
        return njit(fastmath=FAST, error_model="numpy", inline="always")(named(function, names))
    return jit(named(function, names), entry)


import os
_S1,_S3=int(os.environ.get("S1","1500")),int(os.environ.get("S3","250"))
def _small(function):
    size=len(function.__code__.co_code)
    n=_sites().get(function.__name__,0)
    r = (n==1 and size<_S1) or (n<=3 and size<_S3)
    if os.environ.get("SV"): print("splice" if r else "call  ", function.__name__, size, n)
    return r

@cache
def _sites():
    import dis, sys
    out={}
    for m in list(sys.modules.values()):
        if not getattr(m,"__name__","").startswith("skfem_ancf"): continue
        for f in vars(m).values():
            if isinstance(f,FunctionType) and f.__module__==m.__name__ and hasattr(f,"twin"):
                for i in dis.get_instructions(f.__code__):
                    if i.opname=="LOAD_GLOBAL": out[i.argval]=out.get(i.argval,0)+1
    return out


def named(function, names=None):
    """A copy, under a name by which Numba does not find code of other texts on disk."""
    text = FunctionType(function.__code__, names or function.__globals__, function.__name__,
                        function.__defaults__)
    text.__module__, text.__doc__ = function.__module__, function.__doc__
    text.__qualname__ = f"{function.__qualname__}_{stamp()}"
    return text


def jit(function, entry=False):
    """Compile a function; ``entry`` as for :func:`twin`."""
    options = {"fastmath": FAST, "error_model": "numpy"}
    if not entry:
        return njit(**options, **_INNER)(function)
    try:
        return njit(cache=True, **options)(function)
    except RuntimeError as error:  # there is no folder that can be written
        logger.info("compiled code is not kept: %s", error)
        return njit(**options)(function)


def compile_for(text, args):
    """The twin of a text, compiled for arguments of these types."""
    function, types = twin(text, True), tuple(typeof(x) for x in args)
    try:
        function.compile(types)
    except (OSError, EOFError, pickle.PickleError, KeyError, ValueError) as error:
        logger.info("what was kept of compiled code cannot be used: %s", error)
        function = njit(fastmath=FAST, error_model="numpy")(function.py_func)
        function.compile(types)
    return function


def _names(code):
    """Names that a function takes from its module, inner functions included."""
    for constant in code.co_consts:
        if hasattr(constant, "co_names"):
            yield from _names(constant)
    yield from code.co_names


@njit(inline="always")
def _one(x):
    return x
