"""Whether a class or function belongs to the package."""

from __future__ import annotations

from typing import Any


def ours(thing: Any) -> bool:
    """True if a function, or the class of an object, is defined in this package.

    Examples
    --------
    >>> from skfem import ElementLineP1
    >>> from skfem_ancf import ElementBeamCable
    >>> ours(ElementBeamCable(5)), ours(ElementLineP1()), ours(ours)
    (True, False, True)
    """
    named = thing if isinstance(getattr(thing, "__qualname__", None), str) else type(thing)
    return str(named.__module__).partition(".")[0] == __package__.partition(".")[0]
