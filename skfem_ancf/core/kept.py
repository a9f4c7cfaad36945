"""Older names for ``functools.cached_property`` and ``copy.copy``, until everything has moved."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from copy import copy
from functools import cached_property
from typing import Any

__all__ = ["cached_property", "kept", "twin_of"]

def twin_of(thing: Any) -> Any:
    return copy(thing)


def kept(store: dict, key: Hashable, make: Callable[[], Any], most: int = 32) -> Any:
    """What is kept under a key, or what ``make()`` returns, which is kept then.

    Parameters
    ----------
    store
        Where it is kept.
    key
        What it depends on.
    make
        A function without arguments.
    most
        How many things are kept; the first of them go.

    Examples
    --------
    >>> store = {}
    >>> [kept(store, k, lambda: k * k, most=2) for k in (1, 2, 1, 3)], list(store)
    ([1, 4, 1, 9], [2, 3])
    """
    found = store.get(key)
    if found is None:
        found = make()
        while len(store) >= most:
            store.pop(next(iter(store)), None)
        store[key] = found
    return found
