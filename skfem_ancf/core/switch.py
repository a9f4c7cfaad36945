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

#: Environment variable: "0" disables Numba, "1" compiles at once, "auto" (default) compiles for
#: large tasks.
VARIABLE = "SKFEM_ANCF_COMPILED"


def wanted() -> str:
    """The environment variable ``SKFEM_ANCF_COMPILED``: "0", "1" or "auto"; else InputError."""
    value = os.environ.get(VARIABLE, "auto")
    if value not in ("0", "1", "auto"):
        raise InputError(f"the environment variable {VARIABLE} must be 0 (without Numba), 1 "
                         f"(compile at once) or auto (for large tasks), got {value!r}")
    return value


_EXPECTED: ContextVar[float] = ContextVar("expected", default=1.0)


@contextmanager
def expecting(number: float) -> Iterator[None]:
    """Declare that the block repeats its content; nested numbers multiply.

    The product of members of a sweep, steps and iterations decides whether compiling pays.

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
    """Expected number of iterations of the current task."""
    return _EXPECTED.get()


def compiled_off() -> str | None:
    """Why Numba is not used, or None; InputError for an invalid environment variable."""
    if wanted() == "0":
        return f"{VARIABLE}=0"
    if "NUMBA_DISABLE_JIT" in os.environ and os.environ["NUMBA_DISABLE_JIT"] not in ("", "0"):
        return "NUMBA_DISABLE_JIT is set"
    return None if _installed() else "Numba is not installed: pip install skfem-ancf[fast]"


def _installed() -> bool:
    """True if Numba is installed, without importing it, which is slow."""
    if "numba" in sys.modules:
        return sys.modules["numba"] is not None
    return _found()


@cache
def _found() -> bool:
    return find_spec("numba") is not None
