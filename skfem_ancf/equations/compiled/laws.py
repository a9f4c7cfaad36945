"""Laws with texts, each behind an address: compiled when a scene has it."""

from functools import cache

from numba import carray, types

from ...core.origin import ours
from .calls import call
from .twin import address_of, jit, named, twin


def law(constants, number, strain, points, elements, out, rows):
    """Arrays by their addresses and sizes."""
    text(carray(constants, (number,)), carray(strain, (3, points, elements)),  # noqa: F821
         carray(out, (rows, points, elements)))


_F, _N = types.CPointer(types.float64), types.int64
_SIGNATURE = types.void(_F, _N, _F, _N, _N, _F, _N)


@cache
def address(text):
    """Of the compiled text.

    That of another package is compiled in each process: what it calls may have changed.
    """
    function = named(law, {"carray": carray, "text": twin(text)})
    function.__qualname__ = f"{function.__qualname__}_{text.__module__}_{text.__qualname__}"
    return address_of(function, _SIGNATURE, ours(text))


@jit
def run_text(law, strain, out):
    call(law.address, (law.constants.ctypes.data, law.constants.size, strain.ctypes.data,
                       strain.shape[1], strain.shape[2], out.ctypes.data, out.shape[0]))
