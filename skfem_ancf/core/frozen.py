"""Older names of :mod:`skfem_ancf.core.immutable`, until everything has moved there."""

from __future__ import annotations

from typing import Any

from .immutable import Immutable, _Numbers, read_only, rebuilt

__all__ = ["Content", "Frozen", "Sealable", "read_only", "rebuilt"]


class Frozen(Immutable):
    def _seal(self):
        self._freeze()

    def _unsealed(self):
        return self._thawed()


Sealable = Frozen


class Content:
    """Arrays as the key of a cache: equal where they have the same numbers."""

    def __init__(self, *arrays: Any) -> None:
        self.arrays = arrays
        self._key = tuple(map(_Numbers, arrays))

    def __eq__(self, other):
        return isinstance(other, Content) and self._key == other._key

    def __hash__(self):
        return hash(self._key)
