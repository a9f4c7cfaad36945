"""Functions that run in NumPy and compiled by Numba.

A function marked by :func:`source` is plain Python on arrays; :mod:`skfem_ancf.core.jit` compiles
it with all that it calls. A loop of compiled code is an array operation in NumPy: an index of
:func:`indices` is an integer in the former and a slice in the latter::

    @source
    def normal_force(EA, strain, N):
        for p in range(strain.shape[0]):
            for e in indices(strain.shape[1]):
                N[p, e] = EA * strain[p, e]

Rules for an index ``e`` of :func:`indices`:

* use it in ``[..., e]`` only: no ``if`` on values, sums into ``s[e]`` instead of a scalar,
  ``np.sqrt`` instead of ``math.sqrt``, no arithmetic with ``e`` (but ``left[e] * nd + k``),
* loops may be nested if the arrays broadcast: ``for s in indices(n): for e in indices(m):`` with
  ``column(c[s]) * x[s, e]``,
* ``out[at[e]] += x[e]`` needs unique ``at``.
"""

from array import array
from collections.abc import Callable
from ctypes import addressof, c_char
from functools import cache
from struct import Struct
from typing import Annotated, Any, NamedTuple, TypeAlias, TypeVar, cast, get_type_hints

import numpy as np

#: Annotations of contiguous arrays of floats or integers by the number of axes.
F1: TypeAlias = Annotated[np.ndarray, "f1"]
F2: TypeAlias = Annotated[np.ndarray, "f2"]
F3: TypeAlias = Annotated[np.ndarray, "f3"]
I1: TypeAlias = Annotated[np.ndarray, "i1"]
I2: TypeAlias = Annotated[np.ndarray, "i2"]
I3: TypeAlias = Annotated[np.ndarray, "i3"]
#: The same of complex numbers, which stand for vectors in the plane.
C1: TypeAlias = Annotated[np.ndarray, "c1"]
C2: TypeAlias = Annotated[np.ndarray, "c2"]
C3: TypeAlias = Annotated[np.ndarray, "c3"]

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Tuple = TypeVar("_Tuple")

#: Marked functions, with the module of the loops that replace them in compiled code, or None.
MARKED: dict[Any, str | None] = {}


def source(function: _Function) -> _Function:
    """Mark a function for compilation."""
    MARKED[function] = None
    return function


class Apart(NamedTuple):
    """How compiled code calls a function of :func:`apart`."""

    part: str
    takes: tuple[Any, ...]  # annotations of the arguments
    returns: Any  # int, float or None


#: ``Annotated[Kind, MADE]`` marks a small named tuple that compiled code makes by value.
MADE = "made"
#: The part of functions that run in Python.
PYTHON = "Python"
#: Functions that compiled code calls by address.
APART: dict[Any, Apart] = {}


def apart(part: str, *takes: Any, returns: Any = None) -> Callable[[_Function], _Function]:
    """Mark a function that is compiled once for all callers, which call it by its address."""
    # LLVM optimises others again in each caller, and in the callers of that. ``part`` is a name of
    # what is loaded together, ``takes`` are annotations of the arguments.
    def mark(function: _Function) -> _Function:
        APART[function] = Apart(part, takes, returns)
        return source(function)

    return mark


def primitive(module: str) -> Callable[[_Function], _Function]:
    """Mark a NumPy function that is replaced by one of its name in ``module`` in compiled code."""
    def mark(function: _Function) -> _Function:
        MARKED[function] = module
        return function

    return mark


@primitive("skfem_ancf.core.loops")
def indices(*ends):
    """Indices as of ``range(*ends)``: one slice in NumPy, integers in compiled code.

    >>> import numpy as np
    >>> from skfem_ancf.core.source import indices
    >>> x, y = np.arange(3.0), np.empty(3)
    >>> for i in indices(3):
    ...     y[i] = 2.0 * x[i]
    >>> y.tolist()
    [0.0, 2.0, 4.0]
    """
    return (slice(*ends),)


@primitive("skfem_ancf.core.loops")
def column(x):
    """``x[:, None]`` in NumPy, x in compiled code."""
    return x[:, None]


@primitive("skfem_ancf.core.loops")
def where(condition, x, y):
    """x where a condition holds, else y; sums with factors 0 and 1 lose digits when reordered."""
    return np.where(condition, x, y)


@primitive("skfem_ancf.core.loops")
def somewhere(condition):
    """True if a condition holds at a point."""
    return np.any(condition)


@primitive("skfem_ancf.core.loops")
def everywhere(condition):
    """True if a condition holds at all points."""
    return np.all(condition)


def room(shape: Any) -> Any:
    """An array for work. Compiled code has it on the stack until the function marked by
    :func:`apart` ends: not for loops, nor for what grows with the scene."""
    return np.empty(shape)


def shaped(x: Any, shape: Any) -> Any:
    """A reshaped view of a contiguous array."""
    return x.reshape(shape)


# Named tuples as flat arrays of 64-bit words, which compiled code receives by address. A number is
# one word; an array is its address and shape; a tuple is the words of its fields.

_DTYPES, _FLOAT, _INTEGER = (
    frozenset([np.dtype(float), np.dtype(np.int64), np.dtype(complex)]), Struct("d"), Struct("q"))
#: A ctypes array that may lie anywhere.
_NOTHING = c_char * 0


class Packed:
    """A named tuple as words, which live as long as this object. Fields are contiguous arrays of
    floats or integers, numbers, or named tuples, packed or not."""

    def __init__(self, x: tuple[Any, ...]) -> None:
        found: list[int] = []
        _collect(x, found)
        self.of, self.words = x, array("q", found)
        self.address, _ = self.words.buffer_info()


_CONSTANT: dict[int, Packed] = {}


def constant(x: _Tuple) -> _Tuple:
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
