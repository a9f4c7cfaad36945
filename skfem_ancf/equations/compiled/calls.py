"""Calls of compiled functions by their address."""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def call(typing, address, arguments):
    """Call a C function of an address with integers, some of which are addresses."""
    count = len(arguments)

    def generate(context, builder, signature, args):
        word = ir.IntType(64)
        function = builder.inttoptr(args[0], ir.FunctionType(ir.VoidType(), [word] * count
                                                             ).as_pointer())
        builder.call(function, [builder.extract_value(args[1], k) for k in range(count)])
        return context.get_dummy_value()

    return types.void(address, arguments), generate
