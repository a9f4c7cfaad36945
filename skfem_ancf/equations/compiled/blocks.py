"""The kernels of beams behind an address.

Numba compiles what a function calls anew with each that calls it; the kernels are most of the
code. Behind an address they are compiled once.
"""

from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from ...beam.kernels.strain import evaluate
from .calls import call
from .packs import READER
from .twin import address_of, jit, named, twin


def block(place, what, u, v, n, f, n_f, given, n_given, out, n_out, flat, n_flat, ld):
    """Arrays by their addresses and sizes."""
    text(read(place), what, carray(u, (n,)), carray(v, (n,)), carray(f, (n_f,)),  # noqa: F821
         carray(given, (n_given,)), carray(out, (n_out,)), carray(flat, (n_flat,)), ld)


_F, _N = types.CPointer(types.float64), types.int64
_SIGNATURE = types.void(_N, _N, _F, _F, _N, _F, _N, _F, _N, _F, _N, _F, _N, _N)


def address(name):
    """Of the compiled function; compiles it or takes it from disk."""
    return address_of(named(block, {"carray": carray, "text": twin(evaluate), "read": READER}),
                      _SIGNATURE)


@intrinsic
def _place(typing, record):
    def generate(context, builder, signature, args):
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(record), generate


@jit
def run(t, what, u, v, f, given, out, flat, ld):
    call(t.address, (
        _place(t), what, u.ctypes.data, v.ctypes.data, u.size, f.ctypes.data, f.size,
        given.ctypes.data, given.size, out.ctypes.data, out.size, flat.ctypes.data, flat.size, ld))
