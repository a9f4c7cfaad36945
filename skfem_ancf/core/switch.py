"""Whether compiled kernels may be used."""

from __future__ import annotations

import os
import sys
from functools import cache
from importlib.util import find_spec

from .errors import InputError, shown

#: Environment variable: "0" disables Numba, "1" compiles at once, "auto" (default) compiles
#: when the process has worked long enough in NumPy.
VARIABLE = "SKFEM_ANCF_COMPILED"


def compiled_setting() -> str:
    """The environment variable ``SKFEM_ANCF_COMPILED``: "0", "1" or "auto"; else InputError."""
    value = os.environ.get(VARIABLE, "auto")
    if value in ("0", "1", "auto"):
        return value
    raise InputError(f"the environment variable {VARIABLE} must be 0 (without Numba), 1 (compile "
                     f"at once) or auto (when it pays), got {shown(value)}")


def compiled_off() -> str | None:
    """Why Numba is not used, or None; InputError for an invalid environment variable."""
    if compiled_setting() == "0":
        return f"{VARIABLE}=0"
    if "NUMBA_DISABLE_JIT" in os.environ and os.environ["NUMBA_DISABLE_JIT"] not in ("", "0"):
        return "NUMBA_DISABLE_JIT is set"
    # without importing Numba, which is slow
    installed = sys.modules["numba"] is not None if "numba" in sys.modules else _found("numba")
    return None if installed else "Numba is not installed: pip install skfem-ancf[fast]"


_found = cache(find_spec)
