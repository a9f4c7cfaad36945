"""Named tuples as flat arrays of 64-bit words, which compiled code receives by address. A number is
one word; an array is its address and shape; a tuple is the words of its fields."""

from array import array
from ctypes import addressof, c_char
from functools import cache
from struct import Struct
from typing import Any, TypeVar, cast, get_type_hints

import numpy as np


_DTYPES, _FLOAT, _INTEGER = (
    frozenset([np.dtype(float), np.dtype(np.int64), np.dtype(complex)]), Struct("d"), Struct("q"))
#: A ctypes array that may lie anywhere.
_NOTHING = c_char * 0

T = TypeVar("T")


class Packed:
    """A named tuple as words, which live as long as this object. Fields are contiguous arrays of
    floats or integers, numbers, or named tuples, packed or not."""

    def __init__(self, x: tuple[Any, ...]) -> None:
        found: list[int] = []
        _collect(x, found)
        self.of, self.words = x, array("q", found)
        self.address, _ = self.words.buffer_info()


_CONSTANT: dict[int, Packed] = {}


def constant(x: T) -> T:
    """A named tuple that lives as long as the process, whose words are made once."""
    words = Packed(cast("tuple[Any, ...]", x))
    _CONSTANT[id(x)] = words
    return x


@cache
def hints(kind: Any) -> tuple[Any, ...]:
    """Types of the fields of a named tuple."""
    found = get_type_hints(kind, include_extras=True)
    return tuple(found[name] for name in kind._fields)


def _collect(x, found):
    for value, hint in zip(x, hints(type(x))):
        if isinstance(value, np.ndarray):
            flags = value.flags
            if value.dtype not in _DTYPES or not flags.c_contiguous:
                raise TypeError(f"{type(x).__name__} takes contiguous arrays of floats or integers")
            # the first is several times as fast
            found.append(0 if not value.size else addressof(_NOTHING.from_buffer(value))
                         if flags.writeable else value.ctypes.data)
            found.extend(value.shape)
        elif isinstance(value, tuple):
            known = _CONSTANT.get(id(value))
            if known is None:
                _collect(value, found)
            else:
                found += known.words
        elif isinstance(value, Packed):
            found += value.words
        elif hint is float:
            found += _INTEGER.unpack(_FLOAT.pack(value))
        else:
            found.append(int(value))
