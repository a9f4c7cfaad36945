"""Tables that are kept for the next time, a few of them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    cached_property = functools.cached_property
else:
    class cached_property(functools.cached_property):
        """That of ``functools``, without the lock that it has before Python 3.12."""

        def __get__(self, instance, owner=None):
            if instance is None:
                return self
            value = vars(instance)[self.attrname] = self.func(instance)
            return value


def twin_of(thing: Any) -> Any:
    """Another object with the same attributes: ``copy`` of one without slots, many times faster.

    Examples
    --------
    >>> class Point:
    ...     x = 1.0
    >>> p = Point()
    >>> p.y = 2.0
    >>> q = twin_of(p)
    >>> q is p, vars(q)
    (False, {'y': 2.0})
    """
    other = object.__new__(type(thing))
    other.__dict__.update(thing.__dict__)
    return other


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
