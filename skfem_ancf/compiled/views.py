"""Arrays that nobody has to count owners of.

Each mention of an array that Python or Numba allocates counts its owners up and down, atomically:
a third of the time in the iterations of small scenes. Views of what lives longer need none.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_WORD = ir.IntType(64)
_ALIGNED = 64


def _without_owner(context, builder, kind, value):
    if isinstance(kind, types.Array):
        none = cgutils.get_null_value(context.get_value_type(types.voidptr))
        return _with(context, builder, kind, value, {"meminfo": none, "parent": none})
    if isinstance(kind, types.BaseTuple):
        for k, of in enumerate(kind.types):
            one = _without_owner(context, builder, of, builder.extract_value(value, k))
            value = builder.insert_value(value, one, k)
    return value


@intrinsic
def borrowed(typing, x):
    """The same arrays, or tuples of them."""
    def generate(context, builder, signature, args):
        return _without_owner(context, builder, x, args[0])

    return x(x), generate


def array_at(context, builder, kind, pointer, shape):
    """A contiguous array at a pointer."""
    size = _WORD(context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    shape, count, strides = list(shape), shape[-1], [size]
    for n in reversed(shape[:-1]):
        strides.insert(0, builder.mul(count, size))
        count = builder.mul(count, n)
    return _with(context, builder, kind, cgutils.get_null_value(context.get_value_type(kind)), {
        "data": pointer, "shape": cgutils.pack_array(builder, shape), "itemsize": size,
        "strides": cgutils.pack_array(builder, strides), "nitems": count})


def part(context, builder, kind, array, name):
    """A part of an array: "data", "shape", "strides"."""
    return builder.extract_value(array, context.data_model_manager[kind].get_field_position(name))


def _with(context, builder, kind, array, parts):
    """An array with other parts."""
    model = context.data_model_manager[kind]
    for name, value in parts.items():
        array = builder.insert_value(array, value, model.get_field_position(name))
    return array


def _sizes(context, builder, shape, value):
    """The numbers of a shape, a number or a tuple of them."""
    if not isinstance(shape, types.BaseTuple):
        return [context.cast(builder, value, shape, types.int64)]
    return [context.cast(builder, builder.extract_value(value, k), of, types.int64)
            for k, of in enumerate(shape)]


def _kind(like, shape):
    return types.Array(like.dtype, len(shape) if isinstance(shape, types.BaseTuple) else 1, "C")


@intrinsic
def room(typing, shape, like):
    """An array on the stack."""
    found = _kind(like, shape)

    def generate(context, builder, signature, args):
        sizes, count = _sizes(context, builder, shape, args[0]), _WORD(1)
        for n in sizes:
            count = builder.mul(count, n)
        pointer = builder.alloca(context.get_data_type(like.dtype), count)
        pointer.align = _ALIGNED
        return array_at(context, builder, found, pointer, sizes)

    return found(shape, like), generate


@intrinsic
def shaped(typing, x, shape):
    """An array's numbers in another shape."""
    found = _kind(x, shape)

    def generate(context, builder, signature, args):
        return array_at(context, builder, found, part(context, builder, x, args[0], "data"),
                        _sizes(context, builder, shape, args[1]))

    return found(x, shape), generate

