"""Whether compiled kernels may be used."""

from __future__ import annotations

import os

from .errors import InputError

#: Environment variable: "0" leaves Numba out, as if it were not installed; "1" is the default.
VARIABLE = "SKFEM_ANCF_COMPILED"


def compiled_off() -> str | None:
    """Why the kernels compiled by Numba are not used, or None where they are.

    Raises
    ------
    InputError
        If the environment variable ``SKFEM_ANCF_COMPILED`` is neither 0 nor 1.

    Examples
    --------
    >>> import os
    >>> from skfem_ancf.switch import compiled_off
    >>> before = os.environ.get("SKFEM_ANCF_COMPILED", "1")
    >>> os.environ["SKFEM_ANCF_COMPILED"] = "0"
    >>> compiled_off()
    'SKFEM_ANCF_COMPILED=0'
    >>> os.environ["SKFEM_ANCF_COMPILED"] = before
    """
    value = os.environ.get(VARIABLE, "1")
    if value not in ("0", "1"):
        raise InputError(f"the environment variable {VARIABLE} must be 0 (without Numba) or 1, "
                         f"got {value!r}")
    if value == "0":
        return f"{VARIABLE}=0"
    try:
        from numba import config
    except ImportError as error:  # not installed, or made for another NumPy
        return f"Numba cannot be imported: {error}"
    return "NUMBA_DISABLE_JIT is set" if config.DISABLE_JIT else None
