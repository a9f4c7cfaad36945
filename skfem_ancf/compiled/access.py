"""Single numbers of arrays with the few instructions that they take.

Numba takes an array apart and puts it together again at each access, some fifty instructions for
one number: half of what there was to optimise. Here texts take the address and the shape out of
it. What is not a text, and what is not a single number, is left to Numba.
"""

import operator

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_item_pointer2, unpack_tuple
from numba.core.imputils import lower_builtin
from numba.core.targetconfig import ConfigStack
from numba.np.arrayobj import (getitem_array_tuple, getitem_arraynd_intp, load_item, setitem_array,
                               store_item)

from .flags import Known
from .views import part


@lower_builtin(operator.getitem, types.Array, types.Integer)
def _number_of(context, builder, signature, args):
    return _read(context, builder, signature, args, getitem_arraynd_intp)


@lower_builtin(operator.getitem, types.Array, types.BaseTuple)
def _number_at(context, builder, signature, args):
    return _read(context, builder, signature, args, getitem_array_tuple)


def _read(context, builder, signature, args, otherwise):
    kind, index = signature.args
    if not _is_number(context, kind, index):
        return otherwise(context, builder, signature, args)
    return load_item(context, builder, kind, _pointer(context, builder, kind, index, *args))


@lower_builtin(operator.setitem, types.Array, types.Integer, types.Number)
@lower_builtin(operator.setitem, types.Array, types.BaseTuple, types.Number)
def _write(context, builder, signature, args):
    (kind, index, given), value = signature.args, args[2]
    if not _is_number(context, kind, index):
        return setitem_array(context, builder, signature, args)
    value = context.cast(builder, value, given, kind.dtype)
    store_item(context, builder, kind, value, _pointer(context, builder, kind, index, *args[:2]))


def _is_number(context, kind, index):
    """True if it is asked of a text; not where bounds are to be checked, which Numba does."""
    found = _indices(index)
    return (isinstance(ConfigStack.top_or_none(), Known) and not context.enable_boundscheck
            and len(found) == kind.ndim and all(isinstance(x, types.Integer) for x in found))


def _indices(index):
    """The types of an index."""
    return tuple(index) if isinstance(index, types.BaseTuple) else (index,)


def _pointer(context, builder, kind, index, array, at):
    given = unpack_tuple(builder, at) if isinstance(index, types.BaseTuple) else [at]
    given = [context.cast(builder, x, of, types.int64) for x, of in zip(given, _indices(index))]
    from_end = not all(isinstance(x, ir.Constant) and x.constant >= 0 for x in given)
    data, *ends = (part(context, builder, kind, array, name)
                   for name in ("data", "shape", "strides"))
    shape, strides = (unpack_tuple(builder, x) for x in ends)
    return get_item_pointer2(context, builder, data, shape, strides, kind.layout, given, from_end)
