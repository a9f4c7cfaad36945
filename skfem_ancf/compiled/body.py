"""The kernels of all beams behind one address.

Numba compiles what a function calls anew with each that calls it; the kernels are most of the
code. Behind an address they are compiled once.
"""

from numba import carray, types

from ..band import Band
from ..body import FlatBody, evaluate_body
from .calls import call
from .twin import address_of, jit, named, twin

_evaluate = twin(evaluate_body)


def kernels(what, floats, ints, where, fields, table, packs, n_floats, n_ints, u, v, n, f, given,
            use_given, out, size, flat, n_flat, ld, width, top):
    """Arrays by their addresses and sizes."""
    body = FlatBody(0, carray(floats, (n_floats,)), carray(ints, (n_ints,)),
                    carray(where, (packs, fields, 4)), carray(table, (packs, 8)))
    A = Band(carray(flat, (n_flat,)), carray(ints, (0,)), ld, width, top)
    _evaluate(body, what, carray(u, (n,)), carray(v, (n,)), carray(f, (n,)),
              carray(given, (size,)), use_given, carray(out, (size,)), A)


_F, _I, _N = types.CPointer(types.float64), types.CPointer(types.int64), types.int64
_SIGNATURE = types.void(_N, _F, _I, _I, _N, _I, _N, _N, _N, _F, _F, _N, _F, _F, _N, _F, _N, _F, _N,
                        _N, _N, _N)


def address():
    """Of the compiled function; compiles it or takes it from disk."""
    return address_of(named(kernels), _SIGNATURE)


@jit
def run_kernels(body, what, u, v, f, given, use_given, out, A):
    call(body.address, (
        what, body.floats.ctypes.data, body.ints.ctypes.data, body.where.ctypes.data,
        body.where.shape[1], body.table.ctypes.data, body.table.shape[0], body.floats.size,
        body.ints.size, u.ctypes.data, v.ctypes.data, u.size, f.ctypes.data, given.ctypes.data,
        use_given, out.ctypes.data, out.size, A.flat.ctypes.data, A.flat.size, A.ld, A.width,
        A.top))
