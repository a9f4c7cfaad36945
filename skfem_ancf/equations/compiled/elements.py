"""The kinds of force elements behind one address, as the kernels in :mod:`.body`."""

from numba import carray, types

from ...actions.forces.texts import Kinds, of_kinds
from .calls import call
from .twin import address_of, jit, named, twin
from .views import room

_of_kinds = twin(of_kinds)


def elements(what, number, ends, n_ends, numbers, n_numbers, y, w, rows, factor, out, size):
    """Arrays by their addresses and sizes; the factor is an array of one."""
    kinds = Kinds(number, carray(ends, (n_ends,)), carray(numbers, (n_numbers,)))
    _of_kinds(kinds, what, carray(y, (rows,)), carray(w, (rows,)), carray(factor, (1,))[0],
              carray(out, (size,)))


_F, _I, _N = types.CPointer(types.float64), types.CPointer(types.int64), types.int64
_SIGNATURE = types.void(_N, _N, _I, _N, _F, _N, _F, _F, _N, _F, _F, _N)


def address(name):
    """Of the compiled function; compiles it or takes it from disk."""
    return address_of(named(elements), _SIGNATURE)


@jit
def run_kinds(tables, what, y, w, factor, out):
    if tables.number == 0:
        return
    number = room(1, y)
    number[0] = factor
    call(tables.address, (
        what, tables.number, tables.ends.ctypes.data, tables.ends.size,
        tables.numbers.ctypes.data, tables.numbers.size, y.ctypes.data, w.ctypes.data, y.size,
        number.ctypes.data, out.ctypes.data, out.size))
