"""The numbers of named tuples as words of one array, for
:mod:`skfem_ancf.equations.compiled.records`."""

from __future__ import annotations

import struct
from array import array
from functools import cache
from typing import TypeVar, get_type_hints

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
        arrays, codes, self.of, self.words = [], [], x, array("q")
        _collect(x, arrays, codes, self.words)
        self.address = self.words.buffer_info()[0]
        read, kinds = _reader()
        places, asked = array("q", list(map(id, arrays))), array("q", codes)
        wrong = read(places.buffer_info()[0], asked.buffer_info()[0], len(asked), self.address,
                     *kinds)
        if wrong >= 0:
            code, value = [code for code in codes if code >= 0][wrong], arrays[wrong]
            raise TypeError(f"{type(x).__name__} takes contiguous arrays of "
                            f"{'integers' if code & 1 else 'floats'} with {code >> 1} axes, not "
                            f"{value.dtype} with {value.ndim}")


@cache
def _reader():
    from .heads import reader

    return reader()


@cache
def _plan(kind):
    """Of a class its fields one by one: numbers, as int or float, and tuples; arrays in runs.

    Each is what it is, where, and of a run the codes of :mod:`~skfem_ancf.equations.compiled.heads`
    and words to be written.
    """
    found, begun = [], 0
    all_hints = *hints(kind), None
    for k, hint in enumerate(all_hints):
        if isinstance(hint, tuple):
            continue
        if k > begun:
            run = all_hints[begun:k]
            codes = [2 * axes + (letter == "i") for letter, axes in run]
            found.append((array, slice(begun, k), codes,
                          array("q", bytes(8 * sum(1 + axes for _, axes in run)))))
        if k < len(all_hints) - 1:
            found.append((hint, k, [-1], None))
        begun = k + 1
    return found


def _collect(x, arrays, codes, words):
    """Find the arrays of a tuple, codes, and words, those of arrays yet to be read."""
    for kind, at, code, room in _plan(type(x)):
        value = x[at]
        if kind is array:
            arrays += value
            words += room
        elif kind is int:
            words.append(int(value))
        elif kind is float:
            words.append(_WORD.unpack(_NUMBER.pack(value))[0])
        elif id(value) in _CONSTANT:
            known = _known(value).words
            words += known
            code = [-len(known)]
        else:
            _collect(value, arrays, codes, words)
            continue
        codes += code


#: Tuples that modules keep, by identity, and their words once they have been asked for.
_CONSTANT: dict[int, tuple[tuple, Words | None]] = {}

_Tuple = TypeVar("_Tuple", bound=tuple)


def constant(x: _Tuple) -> _Tuple:
    """A tuple that a module keeps, for scenes that have none of its kind: found once are its words.

    Parameters
    ----------
    x
        As :class:`Words` takes it. Its arrays stay where they are.
    """
    _CONSTANT[id(x)] = x, None
    return x


def _known(x):
    """The Words of a constant tuple."""
    found = _CONSTANT[id(x)][1]
    if found is None:
        found = Words(x)
        _CONSTANT[id(x)] = x, found
    return found


class Kept:
    """The Words of tuples, of the last few kept for those that are given again."""

    def __init__(self):
        self._found = {}

    def of(self, tuples):
        """Another one with those of some tuples, where they are known."""
        other, found = Kept(), [self._found.get(id(x)) for x in tuples]
        other._found = {id(words.of): words for words in found if words is not None}
        return other

    def __call__(self, x):
        """Words of a tuple that a scene keeps, and anything else as it is."""
        if not hasattr(x, "by_place"):
            return x
        if id(x) in _CONSTANT:
            return _known(x)
        found = self._found.pop(id(x), None)
        if found is None or found.of is not x:
            found = Words(x)
        self._found[id(x)] = found
        if len(self._found) > LAST:
            del self._found[next(iter(self._found))]
        return found


#: How many.
LAST = 8
