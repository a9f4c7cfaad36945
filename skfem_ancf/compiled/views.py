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
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        for k, part in enumerate(kind.types):
            one = _without_owner(context, builder, part, builder.extract_value(value, k))
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
    array = context.make_array(kind)(context, builder)
    size = _WORD(context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    count, strides = _WORD(1), []
    for n in reversed(shape):
        strides.insert(0, builder.mul(count, size))
        count = builder.mul(count, n)
    array.data = builder.bitcast(pointer, array.data.type)
    array.shape, array.strides = (cgutils.pack_array(builder, x) for x in (shape, strides))
    array.itemsize, array.nitems = size, count
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()


def _sizes(context, builder, shape, value):
    """The numbers of a shape, a number or a tuple of them."""
    if not isinstance(shape, types.BaseTuple):
        return [context.cast(builder, value, shape, types.int64)]
    return [context.cast(builder, builder.extract_value(value, k), part, types.int64)
            for k, part in enumerate(shape)]


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
        array = context.make_array(x)(context, builder, args[0])
        return array_at(context, builder, found, array.data,
                      _sizes(context, builder, shape, args[1]))

    return found(x, shape), generate

