"""The blocks of each kind of beams behind an address.

Numba compiles what a function calls anew with each that calls it; the kernels are most of the
code. Behind an address they are compiled once.
"""

from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from ...beam.kernels.base import Destination
from ...beam.kernels.cable import cable_block
from ...beam.kernels.section import section_block
from .calls import call
from .packs import READERS
from .twin import address_of, jit, named, twin

#: The text of a kind of packs, by the name of its class.
BLOCKS = {"SectionPack": section_block, "CablePack": cable_block}


def block(place, what, first, last, u, v, f, n, given, n_given, out, n_out, flat, n_flat,
          ld, start):
    """Arrays by their addresses and sizes."""
    pack = read(place)  # noqa: F821
    points, elements = pack.weights.shape[0], pack.start.size
    number = points * elements
    text(pack, what, first, last, carray(u, (n,)), carray(v, (n,)),  # noqa: F821
         carray(f, (n,)), carray(given, (n_given // number, points, elements)),
         carray(out, (n_out // number, points, elements)),
         Destination(carray(flat, (n_flat,)), ld, start))


_F, _N = types.CPointer(types.float64), types.int64
_SIGNATURE = types.void(_N, _N, _N, _N, _F, _F, _F, _N, _F, _N, _F, _N, _F, _N, _N, _N)


def address(name):
    """Of the compiled function of a kind of packs; compiles it or takes it from disk."""
    function = named(block, {"carray": carray, "Destination": Destination,
                             "text": twin(BLOCKS[name]), "read": READERS[name]})
    function.__qualname__ = f"{function.__qualname__}_{name}"
    return address_of(function, _SIGNATURE)


@intrinsic
def _place(typing, record):
    def generate(context, builder, signature, args):
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(record), generate


@jit
def run_section(pack, what, first, last, u, v, f, given, out, to):
    call(pack.address, (
        _place(pack), what, first, last, u.ctypes.data, v.ctypes.data, f.ctypes.data, u.size,
        given.ctypes.data, given.size, out.ctypes.data, out.size, to.flat.ctypes.data,
        to.flat.size, to.ld, to.start))


run_cable = run_section
