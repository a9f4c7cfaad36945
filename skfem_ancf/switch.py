"""Whether compiled texts may be used."""

from __future__ import annotations

import os
import sys
from functools import cache
from importlib.util import find_spec

from .errors import InputError

#: Environment variable: "0" leaves Numba out, as if it were not installed; "1" compiles at once;
#: "auto", the default, where it pays.
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
                         f"(compile at once) or auto (where it pays), got {value!r}")
    return value


def compiled_off() -> str | None:
    """Why nothing is compiled by Numba, or None where it may be.

    Raises
    ------
    InputError
        If the environment variable ``SKFEM_ANCF_COMPILED`` is neither 0, 1 nor auto.

    Examples
    --------
    >>> import os
    >>> from skfem_ancf.switch import compiled_off
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
