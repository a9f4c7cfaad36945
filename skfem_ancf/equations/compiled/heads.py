"""Where arrays begin and what shape they have, read from the objects that Python has of them.

Asked for by attributes, those of a scene's hundred arrays would take as long as it takes to solve.
"""

from ctypes import c_int64
from functools import cache

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ...core.errors import AncfError
from .twin import entry_of, named

_WORD = ir.IntType(64)
#: Of an object its head in bytes; behind it of an array, in words: place of the numbers, axes,
#: place of the shape, place of its type, flags; and of a type what it is.
_HEAD, _PLACE, _AXES, _SHAPE, _TYPE, _FLAGS, _WHAT = object.__basicsize__, 0, 1, 2, 5, 6, 1
#: What is known of these words: 32 bits of a number, a flag, and number, order and kind of a type.
_HALF, _CONTIGUOUS, _KNOWN = 0xffffffff, 1, 0x7fffffff00ff00ff


@intrinsic
def _word(typing, address):
    """The word at an address."""
    def generate(context, builder, signature, args):
        return builder.load(builder.inttoptr(args[0], _WORD.as_pointer()))

    return types.int64(address), generate


@intrinsic
def _write(typing, address, word):
    """Write a word to an address."""
    def generate(context, builder, signature, args):
        builder.store(args[1], builder.inttoptr(args[0], _WORD.as_pointer()))
        return context.get_dummy_value()

    return types.void(address, word), generate


def _read(arrays, codes, number, out, floats, integers):
    found = 0
    for k in range(number):
        code = _word(codes + 8 * k)
        if code < 0:  # so many words are there already
            out -= 8 * code
            continue
        head, axes = _word(arrays + 8 * found) + _HEAD, code >> 1
        what = _word(_word(head + 8 * _TYPE) + _HEAD + 8 * _WHAT) & _KNOWN
        if (_word(head + 8 * _AXES) & _HALF != axes or not _word(head + 8 * _FLAGS) & _CONTIGUOUS
                or what != (integers if code & 1 else floats)):
            return found
        _write(out, _word(head + 8 * _PLACE))
        shape = _word(head + 8 * _SHAPE)
        for axis in range(axes):
            _write(out + 8 + 8 * axis, _word(shape + 8 * axis))
        out += 8 + 8 * axes
        found += 1
    return -1


@cache
def reader():
    """A compiled function, and what it takes for the types of floats and integers.

    Its arguments are addresses of the addresses of arrays, of codes, their number, and the address
    of the words to write. A code is ``2 axes`` of an array of floats, one more of integers, or
    minus the number of words that are there. It returns the number of the first array that is
    another or not contiguous, or -1. What is read is what C code built with NumPy reads; where it
    is not there, an AncfError is raised.
    """
    if not laid_out(np.zeros((2, 3))[1:]):
        raise AncfError(f"arrays of NumPy {np.__version__} are laid out in another way than the "
                        "compiled code reads them: take another NumPy, or compute without it by "
                        "the environment variable SKFEM_ANCF_COMPILED=0")
    entry, _ = entry_of(named(_read), (types.int64,) * 6)
    kinds = [_at(id(np.zeros(0, kind).dtype) + _HEAD + 8 * _WHAT) & _KNOWN
             for kind in (float, np.int64)]
    return entry, kinds


def laid_out(x):
    """True if the head of a contiguous array is what is read here.

    Parameters
    ----------
    x
        The array.
    """
    head = id(x) + _HEAD
    return (type(x).__basicsize__ >= _HEAD + 8 * (_FLAGS + 1)
            and _at(head + 8 * _PLACE) == x.__array_interface__["data"][0]
            and _at(head + 8 * _AXES) & _HALF == x.ndim
            and _at(head + 8 * _TYPE) == id(x.dtype) and _at(head + 8 * _FLAGS) & _CONTIGUOUS == 1
            and tuple(_at(_at(head + 8 * _SHAPE) + 8 * k) for k in range(x.ndim)) == x.shape)


def _at(address):
    return c_int64.from_address(address).value
