"""One text for two machines: plain NumPy, and compiled by Numba.

A function marked by :func:`source` is plain Python on arrays.
:func:`skfem_ancf.equations.compiled.twin` compiles the same text, with every marked function that
it calls. What a scalar loop is for a compiler is an array operation for NumPy: an index of
:func:`lanes` is a number in the one and a slice in the other::

    @source
    def normal_force(EA, strain, N):
        for p in range(strain.shape[0]):
            for e in lanes(strain.shape[1]):
                N[p, e] = EA * strain[p, e]

Rules of such a text, where ``e`` is an index of lanes:

* statements on ``[..., e]`` only: no ``if`` on values, sums into ``s[e]`` and not into a number,
  ``np.sqrt`` and not ``math.sqrt``; ``e`` takes no part in arithmetic, an array of numbers
  indexed by it does: ``left[e] * nd + k``,
* lanes may be nested where the arrays broadcast: ``for s in lanes(n): for e in lanes(m):`` with
  ``column(c[s]) * x[s, e]``,
* ``out[at[e]] += x[e]`` needs ``at`` without repetitions,
* an index is not negative in a text of the package: compiled code does not ask.
"""

from collections.abc import Callable
from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np

#: Arrays in the fields of named tuples: of floats or integers, with so many axes, contiguous.
F1: TypeAlias = Annotated[np.ndarray, "f1"]
F2: TypeAlias = Annotated[np.ndarray, "f2"]
F3: TypeAlias = Annotated[np.ndarray, "f3"]
I1: TypeAlias = Annotated[np.ndarray, "i1"]
I2: TypeAlias = Annotated[np.ndarray, "i2"]
I3: TypeAlias = Annotated[np.ndarray, "i3"]

_Text = TypeVar("_Text", bound=Callable[..., Any])
_Tuple = TypeVar("_Tuple", bound=type)


def by_place(kind: _Tuple) -> _Tuple:
    """Mark a class of named tuples that a scene keeps: compiled code is given their place.

    Those of a single call are given by value.
    """
    kind.by_place = True  # type: ignore[attr-defined]
    return kind


def lanes(*ends):
    """Indices from ``ends`` as of ``range``: all at once, as one slice; compiled, one by one.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf.core.source import lanes
    >>> x, y = np.arange(3.0), np.empty(3)
    >>> for i in lanes(3):
    ...     y[i] = 2.0 * x[i]
    >>> y.tolist()
    [0.0, 2.0, 4.0]
    """
    return (slice(*ends),)


def column(x):
    """A number for each row, beside the elements: ``x[:, None]``; compiled, the number."""
    return x[:, None]


def source(function: _Text) -> _Text:
    """Mark a function as a text for both machines; it stays what it is."""
    vars(function)["twin"] = None
    return function


def primitive(module: str) -> Callable[[_Text], _Text]:
    """Mark a plain function whose compiled twin is another: that of its name in a module.

    For what a library does better than a text: LAPACK, and calls of Python functions.

    Parameters
    ----------
    module
        Name of a module in :mod:`skfem_ancf.equations.compiled`.
    """
    def mark(function: _Text) -> _Text:
        vars(function)["twin"] = module
        return function

    return mark


@primitive("views")
def borrowed(x):
    """Arrays, or tuples of arrays, of which others take care: that of arguments, the caller."""
    return x


@primitive("views")
def room(shape, like):
    """An array without values, of the kind of ``like``; it ends with the function that asks.

    Compiled, it lies on the stack: ask once in a function and not in a loop, return no part of it,
    and let what may grow with a scene be asked elsewhere.
    """
    return np.empty(shape, like.dtype)


@primitive("views")
def shaped(x, shape):
    """A contiguous array in another shape, as a view."""
    return x.reshape(shape)


for _text in (lanes, column):
    vars(_text)["twin"] = "jit"
