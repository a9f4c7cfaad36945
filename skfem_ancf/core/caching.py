"""Caches for functions of arrays and for properties."""

from __future__ import annotations

import functools
from collections.abc import Callable
from functools import lru_cache, wraps
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])


if TYPE_CHECKING:
    from functools import cached_property
else:
    class cached_property(functools.cached_property):
        """As of Python 3.12: without the lock for all objects, at which other threads wait."""

        def __get__(self, instance, owner=None):
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value


class ArrayKey:
    """A hashable key of arrays, compared by shape, type and values."""

    def __init__(self, *arrays: Any) -> None:
        self.arrays = arrays
        self._key = tuple((x.shape, x.dtype.str, x.tobytes()) for x in arrays)

    def __eq__(self, other):
        return isinstance(other, ArrayKey) and self._key == other._key

    def __hash__(self):
        return hash(self._key)


def array_cache(maxsize: int) -> Callable[[Function], Function]:
    """``functools.lru_cache`` for functions of arrays; results must be read-only.

    Examples
    --------
    >>> @array_cache(maxsize=8)
    ... def total(x):
    ...     print("computed")
    ...     return x.sum()
    >>> bool(total(np.ones(3)) == total(np.ones(3)))
    computed
    True
    """
    def decorate(function: Function) -> Any:
        @lru_cache(maxsize)
        def of_keys(*keys: Any) -> Any:
            return function(*(k.arrays[0] if isinstance(k, ArrayKey) else k for k in keys))

        @wraps(function)
        def cached(*args: Any) -> Any:
            return of_keys(*(ArrayKey(a) if isinstance(a, np.ndarray) else a for a in args))

        return cached

    return decorate
