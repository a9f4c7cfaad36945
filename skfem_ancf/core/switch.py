"""Whether compiled kernels may be used."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.util import find_spec

from .errors import InputError

#: Environment variable: "0" leaves Numba out, as if it were not installed; "1" compiles at once;
#: "auto", the default, for tasks that are large enough.
VARIABLE = "SKFEM_ANCF_COMPILED"


def wanted() -> str:
    """What the environment variable ``SKFEM_ANCF_COMPILED`` says: "0", "1" or "auto".

    Raises
    ------
    InputError
        If it says anything else.
    """
    value = os.environ.get(VARIABLE, "auto")
    if value not in ("0", "1", "auto"):
        raise InputError(f"the environment variable {VARIABLE} must be 0 (without Numba), 1 "
                         f"(compile at once) or auto (for large tasks), got {value!r}")
    return value


_EXPECTED: ContextVar[float] = ContextVar("expected", default=1.0)


@contextmanager
def expecting(number: float) -> Iterator[None]:
    """A task that repeats what is in it: the size by which it is decided whether to compile.

    Tasks within tasks multiply: members of a sweep, steps of a motion, iterations of a step.

    Parameters
    ----------
    number
        How often, about, at least once.

    Examples
    --------
    >>> from skfem_ancf.core.switch import expected, expecting
    >>> with expecting(100), expecting(3):
    ...     expected()
    300.0
    """
    token = _EXPECTED.set(expected() * max(1.0, float(number)))
    try:
        yield
    finally:
        _EXPECTED.reset(token)


def expected() -> float:
    """How many iterations are expected of the task that is being done, about."""
    return _EXPECTED.get()


def compiled_off() -> str | None:
    """Why nothing is compiled by Numba, or None where it may be.

    Raises
    ------
    InputError
        If the environment variable ``SKFEM_ANCF_COMPILED`` is neither 0, 1 nor auto.

    Examples
    --------
    >>> import os
    >>> from skfem_ancf.core.switch import compiled_off
    >>> before = os.environ.get("SKFEM_ANCF_COMPILED", "auto")
    >>> os.environ["SKFEM_ANCF_COMPILED"] = "0"
    >>> compiled_off()
    'SKFEM_ANCF_COMPILED=0'
    >>> os.environ["SKFEM_ANCF_COMPILED"] = before
    """
    if wanted() == "0":
        return f"{VARIABLE}=0"
    if "NUMBA_DISABLE_JIT" in os.environ and os.environ["NUMBA_DISABLE_JIT"] not in ("", "0"):
        return "NUMBA_DISABLE_JIT is set"
    return None if _installed() else "Numba is not installed: pip install skfem-ancf[fast]"


def _installed() -> bool:
    """True if Numba is there: asked without importing it, which takes longer than a solution."""
    if "numba" in sys.modules:
        return sys.modules["numba"] is not None
    return _found()


@cache
def _found() -> bool:
    return find_spec("numba") is not None
