"""Nodes at which a function of material coordinates jumps along the axis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.types import Array

#: Distance from element ends at which functions are evaluated, relative to the length.
SIDE = 1e-7

#: Smallest jumps: of a function relative to its largest value, of the slope of the height, and of
#: the height times the curvature of the axis.
JUMP, KINK, BEND = 1e-3, 0.02, 0.05


def beside(X: Array) -> Array:
    """Reference points (2, ...), with those at element ends moved slightly inside."""
    return np.array([np.clip(X[0], SIDE, 1.0 - SIDE), X[1]])


def jumps(ask: Callable[[Array, Array], Array], n: int, eta: Array, size: float | None = None
          ) -> Array:
    """Numbers of the elements at whose start a function jumps.

    ``ask(X, e)`` returns its values (..., n, k) at reference points (2, n, k) of elements (n,).
    ``size`` is the smallest change that counts as a jump, by default 1e-3 of the largest value.
    """
    e = np.arange(n)
    left, right = (ask(np.array([np.full((n, len(eta)), xi), np.tile(eta, (n, 1))]), e)
                   for xi in (SIDE, 1.0 - SIDE))
    axes = tuple(k for k in range(left.ndim) if k != left.ndim - 2)
    if size is None:
        size = JUMP * max(np.max(np.abs(left)), np.max(np.abs(right)))
    gap = np.max(np.abs(left[..., 1:, :] - right[..., :-1, :]), axis=axes, initial=0.0)
    return np.nonzero(gap > size)[0] + 1.0
