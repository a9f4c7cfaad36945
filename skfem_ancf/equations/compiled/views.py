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


def without_owner(context, builder, kind, value):
    """The same arrays, or tuples of them, that have none."""
    if isinstance(kind, types.Array):
        none = cgutils.get_null_value(context.get_value_type(types.voidptr))
        return with_parts(context, builder, kind, value, {"meminfo": none, "parent": none})
    if isinstance(kind, types.BaseTuple):
        for k, of in enumerate(kind.types):
            one = without_owner(context, builder, of, builder.extract_value(value, k))
            value = builder.insert_value(value, one, k)
    return value


def has_arrays(kind):
    """True for the type of an array, or of a tuple that has one."""
    if isinstance(kind, types.BaseTuple):
        return any(map(has_arrays, kind))
    return isinstance(kind, types.Array)


def owners(context, builder, kind, value):
    """Those of an array, or of the arrays of a tuple."""
    if isinstance(kind, types.Array):
        yield part(context, builder, kind, value, "meminfo")
    elif isinstance(kind, types.BaseTuple):
        for k, of in enumerate(kind.types):
            yield from owners(context, builder, of, builder.extract_value(value, k))


@intrinsic
def borrowed(typing, x):
    """The same arrays, or tuples of them."""
    def generate(context, builder, signature, args):
        return without_owner(context, builder, x, args[0])

    return x(x), generate


def array_at(context, builder, kind, pointer, shape):
    """A contiguous array at a pointer."""
    size = _WORD(context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    shape, count, strides = list(shape), shape[-1], [size]
    for n in reversed(shape[:-1]):
        strides.insert(0, builder.mul(count, size))
        count = builder.mul(count, n)
    none = cgutils.get_null_value(context.get_value_type(kind))
    return with_parts(context, builder, kind, none, {
        "data": pointer, "shape": cgutils.pack_array(builder, shape), "itemsize": size,
        "strides": cgutils.pack_array(builder, strides), "nitems": count})


def part(context, builder, kind, array, name):
    """A part of an array: "data", "shape", "strides", "nitems", "meminfo"."""
    return builder.extract_value(array, context.data_model_manager[kind].get_field_position(name))


def with_parts(context, builder, kind, array, parts):
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

