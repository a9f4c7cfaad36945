"""Compiles the functions that :mod:`skfem_ancf.core.source` marks, by Numba's public interface.

Marked functions are registered by ``numba.extending``, so that compiled code finds them by what
Python calls. What is called from Python, or by its address, is kept on disk. Numba compiles what a
function calls again with each that calls it: behind an address large parts are compiled once.
"""

from __future__ import annotations

import pickle
from functools import cache
from importlib import import_module
from types import FunctionType
from typing import Any

from numba import cfunc, njit, types, typeof
from numba.extending import intrinsic, lower_getattr_generic, models, overload, register_model

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


class Record(types.NamedTuple):
    """A named tuple by its address, that of its :class:`~skfem_ancf.core.words.Words`.

    A field is read where it is used. Of tuples of a hundred arrays, by value, Numba counts all
    references wherever they are passed on, and takes ten times as long to compile.

    Parameters
    ----------
    kind
        The class of named tuples.
    """

    dtype = types.int64  # of the words

    def __init__(self, kind: Any) -> None:
        super().__init__([type_of(hint) for hint in hints(kind)], kind)
        sizes = [size_of(hint) for hint in hints(kind)]
        self.name = f"Record({kind.__module__}.{kind.__qualname__})"
        self.places = {name: (self.types[k], sum(sizes[:k])) for k, name in enumerate(self.fields)}


register_model(Record)(models.PointerModel)


@lower_getattr_generic(Record)
def _read(context, builder, record, pointer, name):
    """A field from its words."""
    kind, at = record.places[name]

    def place(k):
        return builder.gep(pointer, [context.get_constant(types.intp, k)])

    def load(place):
        found = builder.load(place)
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    if isinstance(kind, Record):
        return builder.bitcast(place(at), context.get_value_type(kind))
    if not isinstance(kind, types.Array):
        value = context.get_value_type(kind)
        if kind == types.boolean:
            return builder.trunc(load(place(at)), value)
        return load(builder.bitcast(place(at), value.as_pointer()))
    array = context.make_array(kind)(context, builder)
    array.data = builder.inttoptr(load(place(at)), array.data.type)
    shape = [load(place(at + 1 + k)) for k in range(kind.ndim)]
    bytes_each = context.get_constant(types.intp, 8)
    size, strides = context.get_constant(types.intp, 1), []
    for n in reversed(shape):
        strides.insert(0, builder.mul(bytes_each, size))
        size = builder.mul(size, n)
    numbers = types.UniTuple(types.intp, kind.ndim)
    array.shape = context.make_tuple(builder, numbers, shape)
    array.strides = context.make_tuple(builder, numbers, strides)
    array.itemsize, array.nitems = bytes_each, size
    array.meminfo = context.get_constant_null(types.MemInfoPointer(kind.dtype))
    array.parent = context.get_constant_null(types.pyobject)
    return array._getvalue()


@cache
def reader(kind: Any) -> Any:
    """A function of the address of :class:`~skfem_ancf.core.words.Words`: their Record."""
    made = Record(kind)

    @intrinsic
    def of(typing, address):
        def generate(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(made))

        return made(types.int64), generate

    return of


def type_of(hint: Any) -> Any:
    """Numba's type of an annotation: a number, an array as ``F1``, or a class of named tuples."""
    kind = getattr(hint, "__metadata__", [hint])[0]
    if kind == MADE:
        return types.NamedTuple([type_of(x) for x in hints(hint.__origin__)], hint.__origin__)
    if isinstance(kind, str):
        return types.Array(_DTYPES[kind[0]], int(kind[1]), "C")
    if kind in SCALARS:
        return SCALARS[kind]
    return Record(kind)


def size_of(hint: Any) -> int:
    """How many words an annotation has."""
    kind = getattr(hint, "__metadata__", [hint])[0]
    if isinstance(kind, str):
        return 1 + int(kind[1])
    return 1 if kind in SCALARS else sum(map(size_of, hints(kind)))


def compiled(function: Any) -> Any:
    """A user's function for compiled code; what is compiled or marked already as it is."""
    register()
    return function if function in MARKED or hasattr(function, "py_func") else njit(
        **OPTIONS)(function)


def entry(function: Any, args: Any) -> Any:
    """The compiled function for Python, compiled or taken from disk.

    Named tuples are given as their words, see :class:`Record`.

    Parameters
    ----------
    function
        A marked function.
    args
        What it is called with: it takes arguments of these types only.
    """
    names: dict[str, Any] = {"function": njit(inline="always", **OPTIONS)(function)}
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
