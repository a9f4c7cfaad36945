"""Contact with obstacles behind one address, as the kernels in :mod:`.body`."""

from numba import carray, types

from ...actions.forces.contact_texts import ContactTables, Question, of_contacts
from .calls import call
from .twin import address_of, jit, named, twin
from .views import room

_of_contacts = twin(of_contacts)


def contacts(what, number, ints, n_ints, floats, n_floats, poses, n_poses, memory, n_memory,
             looks, n_looks, counts, moving, numbers, u, v, n, out, size, ld, top):
    """Arrays by their addresses and sizes; time, span and factor are an array of three."""
    given = carray(numbers, (3,))
    tables = ContactTables(number, carray(ints, (n_ints,)), carray(floats, (n_floats,)),
                           carray(poses, (n_poses,)), carray(memory, (n_memory,)),
                           carray(looks, (n_looks,)), carray(counts, (2 + number,)), moving, 0, 0,
                           0)
    asked = Question(what, given[0], given[1], given[2], ld, top)
    _of_contacts(tables, asked, carray(u, (n,)), carray(v, (n,)), carray(out, (size,)))


_F, _I, _N = types.CPointer(types.float64), types.CPointer(types.int64), types.int64
_SIGNATURE = types.void(_N, _N, _I, _N, _F, _N, _F, _N, _F, _N, _F, _N, _I, _N, _F, _F, _F, _N,
                        _F, _N, _N, _N)


def address(name):
    """Of the compiled function; compiles it or takes it from disk."""
    return address_of(named(contacts), _SIGNATURE)


@jit
def run_contacts(tables, asked, u, v, out):
    numbers = room(3, u)
    numbers[0], numbers[1], numbers[2] = asked.t, asked.span, asked.factor
    call(tables.address, (
        asked.what, tables.number, tables.ints.ctypes.data, tables.ints.size,
        tables.floats.ctypes.data, tables.floats.size, tables.poses.ctypes.data,
        tables.poses.size, tables.memory.ctypes.data, tables.memory.size,
        tables.looks.ctypes.data, tables.looks.size,
        tables.counts.ctypes.data, tables.moving, numbers.ctypes.data, u.ctypes.data,
        v.ctypes.data, u.size, out.ctypes.data, out.size, asked.ld, asked.top))
