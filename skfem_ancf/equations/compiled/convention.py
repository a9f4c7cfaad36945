"""How texts call each other: of an array they are given its place and shape, and no owner.

Numba hands on seven numbers and two for each axis, asks what each call returns in eight ways, and
clears what it returns beforehand.
"""

from llvmlite import ir
from numba import types
from numba.core.callconv import CPUCallConv
from numba.core.cgutils import get_or_insert_function, pack_array, unpack_tuple
from numba.core.datamodel.packer import ArgPacker

from .views import array_at, has_arrays, part, with_parts, without_owner

_WORD = ir.IntType(64)


def is_known(returns):
    """True if texts that return something of this type are called so."""
    return not has_arrays(returns) and not isinstance(returns, types.Optional)


class _Array:
    """An array as an argument."""

    def __init__(self, context, kind):
        self._context, self._kind = context, kind

    def get_argument_type(self):
        words = (_WORD,) * self._kind.ndim
        place = self._context.get_data_type(self._kind.dtype).as_pointer()
        return (place, words) if self._kind.layout == "C" else (place, words, words)

    def as_argument(self, builder, array):
        names = ("data", "shape") if self._kind.layout == "C" else ("data", "shape", "strides")
        place, *rest = (part(self._context, builder, self._kind, array, x) for x in names)
        return place, *(tuple(unpack_tuple(builder, x)) for x in rest)

    def from_argument(self, builder, given):
        place, shape, *strides = given
        array = array_at(self._context, builder, self._kind, place, shape)
        if strides:
            return with_parts(self._context, builder, self._kind, array, {
                "strides": pack_array(builder, strides[0])})
        return array


class _Models:
    """Numba's models of arguments, but for arrays."""

    def __init__(self, context):
        self._context = context

    def lookup(self, kind):
        if isinstance(kind, types.Array):
            return _Array(self._context, kind)
        return self._context.data_model_manager.lookup(kind)


class TextCallConv(CPUCallConv):
    """The convention of texts that give back no arrays."""

    def _get_arg_packer(self, argtypes):
        return ArgPacker(_Models(self.context), argtypes)

    def declared(self, module, symbol, returns, takes):
        """A text by its name for the linker."""
        return get_or_insert_function(module, self.get_function_type(returns, takes), symbol)

    def call(self, builder, symbol, signature, values, fails=True):
        """What a text returns; what it raises is handed on, if it ``fails`` at all."""
        function = self.declared(
            builder.module, symbol, signature.return_type, signature.args)
        with builder.goto_entry_block():
            place = builder.alloca(function.args[0].type.pointee)
        if self.context.enable_nrt:
            values = [without_owner(self.context, builder, kind, x)
                      for kind, x in zip(signature.args, values)]
        status = builder.call(function, [
            place, self._get_excinfo_argument(builder.function),
            *self._get_arg_packer(signature.args).as_arguments(builder, values)])
        if fails:
            with builder.if_then(builder.icmp_signed("!=", status, status.type(0)), likely=False):
                builder.ret(status)
        return self.context.get_returned_value(builder, signature.return_type, builder.load(place))
