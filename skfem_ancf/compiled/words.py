"""The numbers of named tuples as words of one array, for :mod:`skfem_ancf.compiled.records`."""

from __future__ import annotations

import struct
import sys
from array import array
from ctypes import c_size_t
from functools import cache
from typing import TypeVar, get_type_hints

import numpy as np

_NUMBER, _WORD = struct.Struct("d"), struct.Struct("q")


def read(hint):
    """What a hint says: letter and axes of an array, a number's type, or another class."""
    code = getattr(hint, "__metadata__", [None])[0]
    return (code[0], int(code[1])) if code else hint


@cache
def hints(kind):
    """What the fields of a class are."""
    return tuple(map(read, get_type_hints(kind, include_extras=True).values()))


class Words:
    """The words of a named tuple; it and they live as long as this.

    Parameters
    ----------
    x
        Of a class whose annotations say what its fields are: arrays as ``F1``, ``I2``, ...,
        ``int``, ``float``, or another such tuple.

    Attributes
    ----------
    of, words, address
        x, an array, and its place.

    Raises
    ------
    TypeError
        If an array is not what its annotation says, or not contiguous.
    """

    __slots__ = "address", "of", "words"

    def __init__(self, x):
        known, found = _CONSTANT.get(id(x)), list[int]()
        if known is None:
            _fill(x, found)
        else:
            found = known[1]
        self.of, self.words = x, array("q", found)
        self.address = self.words.buffer_info()[0]


_KINDS = {"f": np.dtype(np.float64), "i": np.dtype(np.int64)}


def _asked(x):
    """Where an array begins."""
    return x.__array_interface__["data"][0]


#: NumPy's arrays begin as every Python object does, and go on with the place of their numbers.
_HEAD, _at = object.__basicsize__, c_size_t.from_address


def _is_there():
    """True if arrays are laid out so, where reading it is ten times faster: it is tried once."""
    tried = np.zeros(3), np.zeros((2, 3))[1:]
    return sys.implementation.name == "cpython" and all(
        _at(id(x) + _HEAD).value == _asked(x) for x in tried)


_LAID_OUT = _is_there()


@cache
def _plan(kind):
    """As :func:`hints`, a type for each field, and its axes, -1 of what is no array."""
    found = [(_KINDS[hint[0]], hint[1]) if isinstance(hint, tuple) else (hint, -1)
             for hint in hints(kind)]
    return tuple(zip(*found))


def _fill(x, out):
    inner = {}  # some are there twice
    for value, kind, axes in zip(x, *_plan(type(x))):
        if axes >= 0:
            if value.dtype != kind or value.ndim != axes or not value.flags.c_contiguous:
                raise TypeError(f"{type(x).__name__} takes contiguous arrays of {kind} with "
                                f"{axes} axes, not {value.dtype} with {value.ndim}")
            out.append(_at(id(value) + _HEAD).value if _LAID_OUT else _asked(value))
            out += value.shape
        elif kind is int:
            out.append(int(value))
        elif kind is float:
            out.append(_WORD.unpack(_NUMBER.pack(value))[0])
        else:
            known = _CONSTANT.get(id(value)) or inner.get(id(value))
            if known is None:
                first = len(out)
                _fill(value, out)
                inner[id(value)] = value, out[first:]
            else:
                out += known[1]


#: Tuples that modules keep, by identity, with their words.
_CONSTANT: dict[int, tuple[tuple, list[int]]] = {}

_Tuple = TypeVar("_Tuple", bound=tuple)


def constant(x: _Tuple) -> _Tuple:
    """A tuple that a module keeps, for scenes that have none of its kind: found once are its words.

    Parameters
    ----------
    x
        As :class:`Words` takes it. Its arrays stay where they are.
    """
    found: list[int] = []
    _fill(x, found)
    _CONSTANT[id(x)] = x, found
    return x


class Kept:
    """The Words of tuples, of the last few kept for those that are given again."""

    def __init__(self):
        self._found = {}

    def __call__(self, x):
        """Words of a tuple that a scene keeps, and anything else as it is."""
        if not hasattr(x, "by_place"):
            return x
        found = self._found.pop(id(x), None)
        if found is None or found.of is not x:
            found = Words(x)
        self._found[id(x)] = found
        if len(self._found) > LAST:
            del self._found[next(iter(self._found))]
        return found


#: How many.
LAST = 8
