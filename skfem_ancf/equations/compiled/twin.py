"""Compiles the texts that :mod:`skfem_ancf.core.source` marks."""

import hashlib
import logging
import pickle
from functools import cache
from glob import escape
from importlib import import_module
from pathlib import Path
from types import FunctionType

from numba import __version__, cfunc, njit, typeof, version_info

from ...core.archive import replacing
from ...core.origin import ours
from ...core.source import column, lanes
from . import can_keep, cannot_keep, key
from .flags import Known, KnownOfOthers, TextFlags
from .loops import counted
from .records import record_type
from .together import Entry, Text
from .words import Words

#: From this version on Numba itself runs the passes of LLVM that texts are compiled by: the one
#: before has them, and seldom they end Python.
LEAST = 0, 62

if version_info.short < LEAST:
    raise ImportError(f"version {__version__} is older than {'.'.join(map(str, LEAST))}, which "
                      "texts are compiled by: pip install --upgrade numba")

logger = logging.getLogger(__name__)

# no "nnan" and "ninf": a strain that is not finite must be seen
OPTIONS = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
#: Of what Python calls: other threads of Python go on meanwhile.
ENTRY = {"nogil": True, **OPTIONS}
_FLAGS, _OTHERS = ([TextFlags(OPTIONS, counts, kind) for counts in (False, True)]
                   for kind in (Known, KnownOfOthers))
#: What texts call in place of ``range``.
COUNTED = "range of texts"
#: What reading a cache raises that holds something else.
_SPOILT = OSError, EOFError, pickle.PickleError, KeyError, ValueError


@cache
def twin(function):
    """The compiled twin of a marked function: that of a primitive, or a Text.

    Parameters
    ----------
    function
        Marked by :func:`~skfem_ancf.core.source.source` or
        :func:`~skfem_ancf.core.source.primitive`.
    """
    if function is lanes:
        return counted
    if function is column:
        return _one
    if function.twin is not None:
        if "." in function.twin:  # loops in another folder
            return twin(getattr(import_module(function.twin), function.__name__))
        return getattr(import_module(f"{__package__}.{function.twin}"), function.__name__)
    return jit(linked(function))


def linked(function):
    """A copy of a text that calls the twins of what it calls."""
    names = {**function.__globals__, COUNTED: counted}
    for name in _names(function.__code__):
        if hasattr(names.get(name), "twin"):
            names[name] = twin(names[name])
    return named(function, names)


def named(function, names=None):
    """A copy, under a name by which Numba does not find code of other texts on disk."""
    code = function.__code__
    if names and COUNTED in names:  # Numba takes no other function by the name of a builtin
        code = code.replace(co_names=tuple(
            COUNTED if name == "range" else name for name in code.co_names))
    text = FunctionType(code, names or function.__globals__, function.__name__,
                        function.__defaults__)
    text.__module__, text.__doc__ = function.__module__, function.__doc__
    text.__qualname__ = f"{function.__qualname__}_{key()}"
    return text


def jit(function):
    """What compiled functions alone call.

    It has no entrance for Python, which takes as long to compile as a small function.
    """
    return Text(function, _FLAGS if ours(function) else _OTHERS)


def entry_of(function, types, compiler=Entry):
    """What Python calls, compiled for types of arguments or taken from disk.

    Returns
    -------
    entry, dispatcher
        The latter has objects of Python that the former needs: it has to live as long.
    """
    _prepare(function)

    def compiled(**kept):
        dispatcher = njit(pipeline_class=compiler, **kept, **ENTRY)(function)
        return dispatcher.compile(types), dispatcher

    return _kept_on_disk(function, compiled)


def address_of(function, signature, kept=True):
    """The address of a function compiled as one of C, ``kept`` on disk."""
    _prepare(function)

    def compiled(**kept):
        return cfunc(signature, pipeline_class=Entry, **kept, **OPTIONS)(function).address

    return _kept_on_disk(function, compiled) if kept else compiled()


def _kept_on_disk(function, compiled):
    """What ``compiled(cache=True)`` returns, or without where there is no folder to write to.

    Numba keeps an index and code in files of their own. It does not see that they do not belong
    together, and Python ends where they do not: their hash is kept beside them.
    """
    try:
        folder, name = _files_of(function)
        note = folder / f"{name}.sha256"
        before = _hash_of(folder, name)
        if before is not None and (not note.exists() or note.read_text() != before):
            logger.warning("compiled code in %s is not what was written there: it is compiled anew",
                           folder)
            for path in _all_of(folder, name):
                path.unlink(missing_ok=True)
            before = None
        found = compiled(cache=True)
        now = _hash_of(folder, name)
        if now is not None and now != before:
            with replacing(note) as new:
                new.write_text(now)
        return found
    except (RuntimeError, *_SPOILT) as error:
        if can_keep():  # another process writes the same files just now
            logger.info("compiled code is not taken from disk this time: %s", error)
        else:
            cannot_keep(error)
    return compiled()


def _files_of(function):
    """The folder in which Numba keeps a function, and how the names of its files begin."""
    dispatcher = njit(cache=True)(function)
    return Path(dispatcher.stats.cache_path), dispatcher._cache._impl.filename_base


def _all_of(folder, name):
    return sorted(path for path in folder.glob(f"{escape(name)}.*")
                  if path.suffix in (".nbi", ".nbc"))


def _hash_of(folder, name):
    """Of the names and contents of all files of a function; None where there is none."""
    paths, total = _all_of(folder, name), hashlib.sha256()
    for path in paths:
        content = path.read_bytes()
        total.update(f"{path.name} {len(content)} ".encode() + content)
    return total.hexdigest() if paths else None


def _prepare(function):
    """Have what it shares with other entries."""
    import_module(".shared", __package__).prepare(function)


def compile_for(text, args):
    """The twin of a text for arguments of these types, which it does not look at again.

    Numba would compare them at each call, which takes longer than small scenes do. Named tuples
    marked ``by_place`` are given by the address of their words.
    """
    entry, dispatcher = entry_of(linked(text), tuple(type_of(x) for x in args))

    def run(*args):
        args = [Words(x) if hasattr(x, "by_place") else x for x in args]
        return entry(*[x.address if type(x) is Words else x for x in args])

    run.dispatcher = dispatcher
    return run


def type_of(x):
    """The type of an argument, marked tuples as records."""
    if isinstance(x, Words):
        x = x.of
    return record_type(type(x), x) if hasattr(x, "by_place") else typeof(x)


def _names(code):
    """Names that a function takes from its module, inner functions included."""
    for constant in code.co_consts:
        if hasattr(constant, "co_names"):
            yield from _names(constant)
    yield from code.co_names


@jit
def _one(x):
    return x
