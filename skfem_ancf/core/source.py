"""Functions that run as plain NumPy, and compiled by Numba.

A function marked by :func:`source` is plain Python on arrays, and :mod:`skfem_ancf.core.jit`
compiles it, with all that it calls. What is a loop for a compiler is an array operation for NumPy:
an index of :func:`indices` is a number in the one and a slice in the other::

    @source
    def normal_force(EA, strain, N):
        for p in range(strain.shape[0]):
            for e in indices(strain.shape[1]):
                N[p, e] = EA * strain[p, e]

Rules of such a function, where ``e`` comes from :func:`indices`:

* statements on ``[..., e]`` only: no ``if`` on values, sums into ``s[e]`` and not into a number,
  ``np.sqrt`` and not ``math.sqrt``; ``e`` takes no part in arithmetic, an array of numbers
  indexed by it does: ``left[e] * nd + k``,
* they may be nested where the arrays broadcast: ``for s in indices(n): for e in indices(m):``
  with ``column(c[s]) * x[s, e]``,
* ``out[at[e]] += x[e]`` needs ``at`` without repetitions.
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

_Function = TypeVar("_Function", bound=Callable[..., Any])

#: Marked functions, and the module of the loops that are compiled in their place, or None.
MARKED: dict[Any, str | None] = {}


def source(function: _Function) -> _Function:
    """Mark a function that is compiled as it is; it stays what it is."""
    MARKED[function] = None
    return function


def primitive(module: str) -> Callable[[_Function], _Function]:
    """Mark a function that NumPy has, in place of which loops of its name are compiled.

    Parameters
    ----------
    module
        Where these are.
    """
    def mark(function: _Function) -> _Function:
        MARKED[function] = module
        return function

    return mark


@primitive("skfem_ancf.core.loops")
def indices(*ends):
    """Indices from ``ends`` as of ``range``: all at once, as one slice; compiled, one by one.

    Examples
    --------
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
    """A number for each row, beside the elements: ``x[:, None]``; compiled, the number."""
    return x[:, None]


@source
def shaped(x, shape):
    """A contiguous array in another shape, as a view."""
    return x.reshape(shape)
