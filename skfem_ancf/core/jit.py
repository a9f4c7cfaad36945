"""Compiles the functions that :mod:`skfem_ancf.core.source` marks, by Numba's public interface.

Marked functions are registered by ``numba.extending``, so that compiled code finds them by what
Python calls. What is called from Python, or by its address, is kept on disk. Numba compiles what a
function calls anew with each that calls it: behind an address large parts are compiled once.
"""

from __future__ import annotations

import pickle
from functools import cache
from importlib import import_module
from types import FunctionType
from typing import Any

from numba import carray, cfunc, njit, types, typeof
from numba.experimental import structref
from numba.extending import intrinsic, overload

from .code_cache import cannot_keep, can_keep, key, nothing_collected
from .source import MARKED
from .words import Words, hints


# no "nnan" and "ninf": a strain that is not finite must be seen
OPTIONS = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
#: Types of fields and arguments, by their annotations.
SCALARS = {int: types.int64, float: types.float64, bool: types.boolean, type(None): types.none}
#: Of a small named tuple that compiled code makes, which stays a tuple: ``Annotated[Kind, MADE]``.
MADE = "made"
_DTYPES = {"f": types.float64, "i": types.int64}
#: What reading or writing what is kept raises, where there is something else.
_SPOILT = RuntimeError, OSError, EOFError, pickle.PickleError, KeyError, ValueError
_registered: set[Any] = set()


def register() -> None:
    """Let compiled code call all marked functions that there are."""
    while len(_registered) < len(MARKED):
        for function, module in list(MARKED.items()):
            if function not in _registered:
                _registered.add(function)
                loops = import_module(module) if module else None
                found = getattr(loops, function.__name__, function)
                _register(function, found)
                if found is not function and callable(found):
                    _register(found, found)  # loops call each other


def _register(function, found):
    @overload(function, jit_options=OPTIONS, strict=False)
    def choose(*args):
        return found if callable(found) else found[len(args)]


@structref.register
class Struct(types.StructRef):
    """What a named tuple is in compiled code: passed as one pointer, where a tuple would be as
    all numbers of all its arrays, which takes far longer to compile.
    """


structref.define_attributes(Struct)


def type_of(hint: Any) -> Any:
    """Numba's type of an annotation: a number, an array as ``F1``, or a class of named tuples."""
    kind = getattr(hint, "__metadata__", [hint])[0]
    if kind == MADE:
        return types.NamedTuple([type_of(x) for x in hints(hint.__origin__)], hint.__origin__)
    if isinstance(kind, str):
        return types.Array(_DTYPES[kind[0]], int(kind[1]), "C")
    if kind in SCALARS:
        return SCALARS[kind]
    return Struct([(name, type_of(x)) for name, x in zip(kind._fields, hints(kind))])


def compiled(function: Any) -> Any:
    """A user's function for compiled code; what is compiled or marked already as it is."""
    register()
    return function if function in MARKED or hasattr(function, "py_func") else njit(
        **OPTIONS)(function)


def entry(function: Any, args: Any) -> Any:
    """The compiled function for Python, compiled or taken from disk.

    Named tuples are given as their words: Numba takes longer to unpack a hundred arrays than a
    small scene takes to solve.

    Parameters
    ----------
    function
        A marked function.
    args
        What it is called with: it takes arguments of these types only.
    """
    names: dict[str, Any] = {"function": function}
    given = [f"a{k}" for k in range(len(args))]
    for k, x in enumerate(args):
        if isinstance(x, tuple):
            names[f"read{k}"], given[k] = reader(type(x)), f"read{k}(a{k})"
    arguments = ", ".join(f"a{k}" for k in range(len(args)))
    code = f"def run({arguments}):\n    return function({', '.join(given)})\n"
    exec(compile(code, function.__code__.co_filename, "exec"), names)  # noqa: S102
    run = names["run"]
    run.__name__, run.__module__ = function.__name__, function.__module__
    signature = tuple(types.int64 if isinstance(x, tuple) else typeof(x) for x in args)
    found = _kept(lambda **kept: njit(signature, nogil=True, **kept, **OPTIONS)(_named(run)))
    known: dict[int, Words] = {}

    def call(*args):
        words = [_words(x, known) if isinstance(x, tuple) else x for x in args]
        return found(*[x.address if type(x) is Words else x for x in words])

    return call


#: Tuples whose words are kept for the next call.
LAST = 16


def _words(x, known):
    found = known.pop(id(x), None)
    if found is None or found.of is not x:
        found = Words(x)
    known[id(x)] = found
    if len(known) > LAST:
        del known[next(iter(known))]
    return found


def address(function: Any, hints: Any, name: str = "", kept: bool = True) -> int:
    """The address of a compiled function, see :func:`caller`.

    Parameters
    ----------
    function, hints
        The function, and annotations of its arguments.
    name
        Of it on disk, where it has to be told from others.
    kept
        Keep it on disk.
    """
    signature = types.void(*map(type_of, hints))

    def made(**options):
        return cfunc(signature, **options, **OPTIONS)(_named(function, name))

    found = _kept(made) if kept else made()
    _alive.append(found)
    return found.address


_alive: list[Any] = []


def _named(function, name=""):
    """A copy, under a name by which Numba finds no code of other versions on disk."""
    copy = FunctionType(function.__code__, function.__globals__, function.__name__,
                        function.__defaults__, function.__closure__)
    copy.__module__ = function.__module__
    copy.__qualname__ = f"{function.__name__}{name}_{key()}"
    return copy


def _kept(make):
    """What ``make(cache=True)`` returns, or without where nothing can be kept."""
    register()
    with nothing_collected():
        if can_keep():
            try:
                return make(cache=True)
            except _SPOILT as error:
                cannot_keep(error)
        return make()


def caller(*hints: Any) -> Any:
    """What compiled code calls an address with, and a tuple of arguments.

    Parameters
    ----------
    *hints
        Annotations of the arguments.
    """
    takes = tuple(map(type_of, hints))
    function = types.FunctionPrototype(types.void, takes)

    @intrinsic
    def call(typing, address, arguments):
        def generate(context, builder, signature, args):
            pointer = builder.inttoptr(args[0], context.get_value_type(function))
            builder.call(pointer, [builder.extract_value(args[1], k) for k in range(len(takes))])
            return context.get_dummy_value()

        return types.void(types.int64, types.Tuple(takes)), generate

    return call


def _pointer(kind):
    """What makes a pointer of an address."""
    @intrinsic
    def pointer(typing, address):
        def generate(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(signature.return_type))

        return types.CPointer(kind)(types.int64), generate

    return pointer


_POINTERS = {letter: _pointer(kind) for letter, kind in _DTYPES.items()}


@cache
def reader(kind: Any) -> Any:
    """A function of the address of :class:`~skfem_ancf.core.words.Words`: their named tuple."""
    names: dict[str, Any] = {"carray": carray, "new": structref.new, **_POINTERS}
    lines: list[str] = []

    def read(kind, at):
        made = f"t{len(names)}"
        names[f"{made}_type"] = type_of(kind)
        lines.append(f"{made} = new({made}_type)")
        for field, hint in zip(kind._fields, hints(kind)):
            code = getattr(hint, "__metadata__", [hint])[0]
            if isinstance(code, str):
                shape = "".join(f"w[{at + 1 + k}], " for k in range(int(code[1])))
                value = f"carray({code[0]}(w[{at}]), ({shape}))"
                at += 1 + int(code[1])
            elif code in SCALARS:
                value, at = f"{'x' if code is float else 'w'}[{at}]", at + 1
            else:
                value, at = read(code, at)
            lines.append(f"{made}.{field} = {value}")
        return made, at

    made, size = read(kind, 0)
    code = "".join(f"    {line}\n" for line in (
        f"w = carray(i(address), ({size},))", f"x = carray(f(address), ({size},))", *lines,
        f"return {made}"))
    exec(f"def read(address):\n{code}", names)  # noqa: S102
    return njit(**OPTIONS)(names["read"])
