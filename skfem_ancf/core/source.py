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

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, TypeAlias, TypeVar

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
