"""Named tuples of texts by the place of their numbers, and not by value.

A tuple of sixty arrays by value is some four hundred numbers, which each call of a function would
take apart and hand on: two thirds of what there was to compile. Its words are an array: of a number
itself, of an array address and shape, of a tuple its words. Compiled code is given their address
and reads what it uses; nobody changes them.
"""

from __future__ import annotations

from hashlib import sha256

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (NativeValue, infer_getattr, intrinsic, lower_getattr_generic, models,
                             register_model, unbox)

from .views import array_at
from .words import hints

_WORD = ir.IntType(64)
_NUMBERS = {int: types.int64, float: types.float64, bool: types.boolean,
            type(None): types.none}
_DTYPES = {"f": types.float64, "i": types.int64}


class Record(types.Type):
    """The type of a tuple by its place; ``fields`` are names, types and numbers of words."""

    def __init__(self, name, fields):
        self.fields = fields
        text = repr([(field, str(kind)) for field, kind in fields])
        super().__init__(name=f"{name}_{sha256(text.encode()).hexdigest()[:12]}")

    def place(self, name):
        """The type of a field, and the number of its first word."""
        at = 0
        for field, kind in self.fields:
            if field == name:
                return kind, at
            at += _size(kind)
        return None, at

    @property
    def size(self):
        """Number of words."""
        return sum(_size(kind) for _, kind in self.fields)


def _size(kind):
    if isinstance(kind, Record):
        return kind.size
    return 1 + kind.ndim if isinstance(kind, types.Array) else 1


def record_type(kind, x=None):
    """The Record of a class of named tuples, or of ``x``, which tells what is a tuple in it.

    Parameters
    ----------
    kind, x
        Class, and instance if there are fields of which the class does not say what they are.
    """
    return Record(kind.__name__, tuple(
        (name, kind_of(hint, None if x is None else x[k]))
        for k, (name, hint) in enumerate(zip(kind._fields, hints(kind)))))


def kind_of(hint, x=None):
    """The type of what a hint says, see :func:`~skfem_ancf.equations.compiled.words.read`."""
    if isinstance(hint, tuple):
        return types.Array(_DTYPES[hint[0]], hint[1], "C")
    return _NUMBERS.get(hint) or record_type(hint if x is None else type(x), x)


@register_model(Record)
class _Model(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _WORD.as_pointer())


@unbox(Record)
def _unbox(kind, value, c):
    """Of the address."""
    return NativeValue(c.builder.inttoptr(c.pyapi.long_as_ulonglong(value), _WORD.as_pointer()))


@infer_getattr
class _Fields(AttributeTemplate):
    key = Record

    def generic_resolve(self, record, name):
        return record.place(name)[0]


@lower_getattr_generic(Record)
def _field(context, builder, record, pointer, name):
    kind, at = record.place(name)
    first = builder.gep(pointer, [_WORD(at)])
    if isinstance(kind, Record):
        return first
    if not isinstance(kind, types.Array):
        return _load(builder, builder.bitcast(first, context.get_value_type(kind).as_pointer()))
    place, *shape = (_load(builder, builder.gep(pointer, [_WORD(at + k)]))
                     for k in range(1 + kind.ndim))
    data = context.get_data_type(kind.dtype).as_pointer()
    return array_at(context, builder, kind, builder.inttoptr(place, data), shape)


def _load(builder, pointer):
    """What never changes, so that loops need to load it once."""
    value = builder.load(pointer)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


def reader(record):
    """A compiled function of an address: the record there."""
    @intrinsic
    def read(typing, address):
        def generate(context, builder, signature, args):
            return builder.inttoptr(args[0], _WORD.as_pointer())

        return record(address), generate

    return read
