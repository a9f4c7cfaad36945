"""Compilation of functions marked by :mod:`skfem_ancf.core.source`, by Numba's public interface.
Marked functions are registered with ``numba.extending``. Functions that are called from Python, or
by address, are cached on disk. Numba compiles a function again in each caller; large parts are
therefore called by address."""

import pickle
from ctypes import CFUNCTYPE, c_double, c_int64, c_void_p, cast
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from types import FunctionType
from inspect import signature
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import cfunc, njit, types, typeof
from numba.extending import (intrinsic, lower_builtin, lower_getattr_generic, models, overload,
                             register_model, type_callable)

from .callbacks import FROM_PYTHON, deferred, kept as keeping, raise_kept
from .code_cache import cannot_keep, can_keep, key, nothing_collected, verified
from .source import APART, MADE, MARKED, PYTHON, Packed, apart, hints, room, shaped


# without "nnan" and "ninf", since strains that are not finite must be detected
OPTIONS = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
#: Numba types by annotation.
SCALARS = {int: types.int64, float: types.float64, bool: types.boolean, type(None): types.void,
           None: types.void}
#: ctypes of functions in Python.
_C: dict[Any, Any] = {int: c_int64, float: c_double, None: None}
_DTYPES = {"f": types.float64, "i": types.int64, "c": types.complex128}
#: Exceptions of a damaged cache.
_SPOILT = RuntimeError, OSError, EOFError, pickle.PickleError, KeyError, ValueError
_registered: set[Any] = set()


def register() -> None:
    """Let compiled code call all marked functions."""
    while new := [one for one in MARKED.items() if one[0] not in _registered]:
        for function, module in new:
            loops = import_module(module) if module else None
            found = getattr(loops, function.__name__, function)
            for one in [function, found] if callable(found) else [function]:
                if one not in _registered:  # loops call each other too
                    _registered.add(one)
                    alone = callable(found) and found in APART
                    (_register_apart if alone else _register)(one, found)


def _register(function, found):
    @overload(function, jit_options=OPTIONS, strict=False,
              inline="never" if callable(found) else "always")
    def choose(*args):
        return found if callable(found) else found[len(args)]


def _register_apart(function, found):
    """Let compiled code call a function by the address in its cell, which is found at need."""
    apart, name = APART[found], _cell(found)[1]
    takes, returns = tuple(map(type_of, apart.takes)), SCALARS[apart.returns]

    def typed(*args):
        return returns

    if apart.part == PYTHON:
        load(found)
    vars(typed)["__signature__"] = signature(found)
    type_callable(function)(lambda context: typed)

    @lower_builtin(function, types.VarArg(types.Any))
    def call(context, builder, made, args):
        word, known = context.get_value_type(types.int64), builder.module.globals

        def cell(name):
            return known.get(name) or ir.GlobalVariable(builder.module, word, name)

        def call_at(place, kind, args):
            address = builder.load(place)
            return builder.call(builder.inttoptr(address, context.get_value_type(kind)), args)

        place = cell(name)
        with builder.if_then(builder.icmp_signed("==", builder.load(place), word(0)), likely=False):
            call_at(cell(_cell(find)[1]), types.FunctionPrototype(types.void, (types.int64,)),
                    [builder.ptrtoint(place, word)])
        given = [_borrowed(context, builder, kind, context.cast(builder, x, of, kind))
                 for x, of, kind in zip(args, made.args, takes)]
        result = call_at(place, types.FunctionPrototype(returns, takes), given)
        return context.get_dummy_value() if returns == types.void else result


def _borrowed(context, builder, kind, x):
    """An array without its owner, whose references need not be counted: the caller holds it."""
    if isinstance(kind, types.Array):  # each view would count up and down, atomically
        array = context.make_array(kind)(context, builder, x)
        array.meminfo = context.get_constant_null(types.MemInfoPointer(kind.dtype))
        x = array._getvalue()
    return x


#: Addresses of the functions that compiled code calls by address, or 0, in arrays of one number.
#: Code on disk finds them by name: Numba has no public way to a global of the process, so their
#: names are given to LLVM by the documented functions of llvmlite.
_CELLS: dict[Any, Any] = {}


def _cell(function):
    """The cell of a function, and the name by which compiled code finds it."""
    name = f"{function.__module__}.{function.__qualname__}"
    if function not in _CELLS:
        _CELLS[function] = np.zeros(1, np.int64)
        binding.add_symbol(name, _CELLS[function].ctypes.data)
    return _CELLS[function], name


@CFUNCTYPE(None)
@keeping
def _missing():
    raise RuntimeError("a part of compiled code could not be compiled")


@apart(PYTHON, int)
def find(place):
    """Load the function whose cell is at an address."""
    function, cell = next(x for x in _CELLS.items() if x[1].ctypes.data == place)
    try:
        load(function)
    except BaseException:
        cell[0] = cast(_missing, c_void_p).value
        raise


def load(function: Any) -> None:
    """Compile a function that is called by address, or load it from disk."""
    cell, apart = _cell(function)[0], APART[function]
    if cell[0] == 0 and apart.part == PYTHON:
        kind = CFUNCTYPE(_C[apart.returns], *(_C[x] for x in apart.takes))
        _alive.append(kind(keeping(function)))
        cell[0] = cast(_alive[-1], c_void_p).value
    elif cell[0] == 0:
        cell[0] = address(function, apart.takes, returns=apart.returns)


def load_part(part: str) -> None:
    """Load all functions of a part."""
    register()
    for function, one in APART.items():
        if one.part == part:
            load(function)
            FROM_PYTHON[function] = partial(_call_entry, function, [])


def _call_entry(function, made, tables, *args):
    """Call the :func:`entry` of a function, which is made once, with exceptions of callbacks."""
    if not made:
        made.append(entry(function, (tables, *args)))
    words = Packed(tables)
    with deferred():
        found = made[0](words.address, *args)
    raise_kept()
    return found


class Record(types.NamedTuple):
    """A named tuple by the address of its :class:`~skfem_ancf.core.source.Packed`. Fields are read
    where they are used. Tuples of many arrays by value take Numba ten times as long, since it
    counts all references."""

    dtype = types.int64  # of the words

    def __init__(self, kind: Any) -> None:
        kind = next(one for one in kind.__mro__ if "_fields" in vars(one))  # not a subclass
        super().__init__([type_of(hint) for hint in hints(kind)], kind)
        sizes = [size_of(hint) for hint in hints(kind)]
        self.name = f"Record({kind.__module__}.{kind.__qualname__})"
        self.places = {name: (self.types[k], sum(sizes[:k])) for k, name in enumerate(self.fields)}


register_model(Record)(models.PointerModel)


@lower_getattr_generic(Record)
def _read(context, builder, record, pointer, name):
    """Read a field from its words."""
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
    data = builder.inttoptr(load(place(at)), context.get_data_type(kind.dtype).as_pointer())
    return _array(context, builder, kind, data, [load(place(at + 1 + k)) for k in range(kind.ndim)])


def _array(context, builder, kind, data, shape):
    """A contiguous array without an owner, whose references need not be counted."""
    array = context.make_array(kind)(context, builder)
    array.data, bytes_each = data, context.get_constant(types.intp, kind.dtype.bitwidth // 8)
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
    """A compiled function from the address of a :class:`~skfem_ancf.core.source.Packed` tuple."""
    made = Record(kind)

    @intrinsic
    def of(typing, address):
        def generate(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(made))

        return made(types.int64), generate

    return of


def type_of(hint: Any) -> Any:
    """Numba's type of an annotation: a number, an array such as ``F1``, or a named tuple."""
    kind = getattr(hint, "__metadata__", [hint])[0]
    if kind == MADE:
        of = [type_of(x) for x in hints(hint.__origin__)]
        if len(set(of)) == 1:  # as Numba infers it
            return types.NamedUniTuple(of[0], len(of), hint.__origin__)
        return types.NamedTuple(of, hint.__origin__)
    if isinstance(kind, str):
        return types.Array(_DTYPES[kind[0]], int(kind[1]), "C")
    if kind in SCALARS:
        return SCALARS[kind]
    return Record(kind)


def size_of(hint: Any) -> int:
    """Number of words of an annotation."""
    kind = getattr(hint, "__metadata__", [hint])[0]
    if isinstance(kind, str):
        return 1 + int(kind[1])
    return 1 if kind in SCALARS else sum(map(size_of, hints(kind)))


@type_callable(room)
def _room(context):
    return lambda shape: types.Array(types.float64, len(shape), "C")


@lower_builtin(room, types.BaseTuple)
def _on_stack(context, builder, made, args):
    shape = _numbers(context, builder, made.args[0], args[0])
    size = shape[0]
    for n in shape[1:]:
        size = builder.mul(size, n)
    data = builder.alloca(context.get_data_type(types.float64), size)
    data.align = 64
    return _array(context, builder, made.return_type, data, shape)


@type_callable(shaped)
def _shaped(context):
    return lambda x, shape: types.Array(x.dtype, len(shape), "C")


@lower_builtin(shaped, types.Array, types.BaseTuple)
def _reshaped(context, builder, made, args):
    kind, view = made.args[0], made.return_type
    x = context.make_array(kind)(context, builder, args[0])
    y = context.make_array(view)(context, builder, _array(
        context, builder, view, x.data, _numbers(context, builder, made.args[1], args[1])))
    y.meminfo, y.parent = x.meminfo, x.parent
    context.nrt.incref(builder, view, y._getvalue())
    return y._getvalue()


def _numbers(context, builder, kind, shape):
    return [context.cast(builder, builder.extract_value(shape, k), of, types.intp)
            for k, of in enumerate(kind)]


def compiled(function: Any) -> Any:
    """A user's function for compiled code; compiled or marked ones are unchanged."""
    register()
    return function if function in MARKED or hasattr(function, "py_func") else njit(
        **OPTIONS)(function)


def entry(function: Any, args: Any) -> Any:
    """A compiled function for Python, for arguments of these types; named tuples become words."""
    # If the first argument is a named tuple, the function takes the address of its words. Named
    # tuples of numbers are passed as these.
    names: dict[str, Any] = {"function": function if function in APART else njit(
        inline="always", **OPTIONS)(function)}
    takes, given, signature = list[str](), list[str](), list[Any]()
    for k, x in enumerate(args):
        one = [f"a{k}"]
        if not isinstance(x, tuple):
            given += one
            signature.append(typeof(x))
        elif _of_numbers(x):
            one = [f"a{k}_{name}" for name in vars(type(x))["_fields"]]
            names[f"kind{k}"] = type(x)
            given.append(f"kind{k}({', '.join(one)})")
            signature += map(type_of, hints(type(x)))
        else:
            names[f"read{k}"] = reader(type(x))
            given.append(f"read{k}(a{k})")
            signature.append(types.int64)
        takes += one
    code = f"def run({', '.join(takes)}):\n    return function({', '.join(given)})\n"
    exec(compile(code, function.__code__.co_filename, "exec"), names)  # noqa: S102
    run = names["run"]
    run.__name__, run.__module__ = function.__name__, function.__module__
    found = _kept(_named(run), lambda **kept: njit(tuple(signature), nogil=True, **kept, **OPTIONS))
    tuples = [k for k, x in enumerate(args) if k > 0 and isinstance(x, tuple)]
    flat = [k for k in reversed(tuples) if _of_numbers(args[k])]  # the last first
    tuples = [k for k in tuples if k not in flat]
    known: dict[int, Packed] = {}

    def call(*args):
        numbers, alive = list(args), ()  # other threads may forget words
        for k in tuples:
            words = known.get(id(args[k]))
            if words is None or words.of is not args[k]:
                known.pop(id(args[k]), None)
                known[id(args[k])] = words = Packed(args[k])
                if len(known) > 16:
                    del known[next(iter(known))]
            numbers[k] = words.address
            alive += (words,)
        for k in flat:
            numbers[k:k + 1] = numbers[k]
        return found(*numbers)

    return call if tuples or flat else found


def _of_numbers(x):
    """True if a named tuple has numbers only."""
    return all(hint in SCALARS for hint in hints(type(x)))


def address(function: Any, hints: Any, name: str = "", kept: bool = True,
            returns: Any = None) -> int:
    """The address of a compiled function with annotated arguments, see :func:`caller`."""
    # ``name`` distinguishes it on disk; it is cached if ``kept``.
    signature, function = SCALARS[returns](*map(type_of, hints)), _named(function, name)

    def made(**options):
        return cfunc(signature, **options, **OPTIONS)

    found = _kept(function, made) if kept else made()(function)
    _alive.append(found)
    return found.address


_alive: list[Any] = []


def _named(function, name=""):
    """A copy with a name that is unique to this version in Numba's cache."""
    copy = FunctionType(function.__code__, function.__globals__, function.__name__,
                        function.__defaults__, function.__closure__)
    copy.__module__ = function.__module__
    copy.__qualname__ = f"{function.__name__}{name}_{key()}"
    return copy


def _kept(function, make):
    """``make(cache=True)(function)``, or ``make()`` without a cache."""
    register()
    with nothing_collected():
        if can_keep():
            try:
                place = Path(njit(cache=True)(function).stats.cache_path)
                with verified(place, function.__qualname__):
                    return make(cache=True)(function)
            except _SPOILT as error:
                cannot_keep(error)
        return make()(function)


def caller(*hints: Any) -> Any:
    """A function for compiled code that calls an address with a tuple of annotated arguments."""
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
