"""Places at which a function of material coordinates jumps along the axis."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core.types import Array

#: Distance from element ends at which functions are evaluated, relative to the length.
SIDE = 1e-7

#: Smallest jumps: of a function relative to its largest value, of the slope of the height, and of
#: the height times the curvature of the axis.
JUMP, KINK, BEND = 1e-3, 0.02, 0.05

#: Intervals of an element in which a jump is looked for, and how often one is halved.
INTERVALS, HALVED = 32, 50
#: Smallest distance of a jump from a node, relative to the length of the element.
INSIDE = 1e-5


class Pieces(NamedTuple):
    """Parts of elements from ``begin`` to ``end`` (n,), in xi, in order along the beam."""

    elements: Array
    begin: Array
    end: Array


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


def pieces(ask: Callable[[Array, Array], Array], e: Array, eta: float = 0.5) -> Pieces:
    """Elements e (n,) divided where a function jumps inside them; ``ask`` as for :func:`jumps`."""
    def at(xi, e):
        found = ask(np.array([xi, np.full(xi.shape, eta)]), e)
        return found.reshape(-1, *found.shape[-2:])

    grid = np.clip(np.linspace(0.0, 1.0, INTERVALS + 1), SIDE, 1.0 - SIDE)
    values = at(np.tile(grid, (len(e), 1)), e)
    size, steps = JUMP * np.max(np.abs(values), initial=0.0), np.diff(values, axis=-1)
    around = np.pad(steps, ((0, 0), (0, 0), (1, 1)), mode="edge")
    bent = np.abs(steps - 0.5 * (around[..., :-2] + around[..., 2:])).max(axis=0, initial=0.0)
    k, i = np.nonzero(bent > size)
    ends = np.array([grid[i], grid[i + 1]])
    sides = np.array([values[:, k, i], values[:, k, i + 1]])
    for _ in range(HALVED if len(k) else 0):
        middle = 0.5 * (ends[0] + ends[1])
        value = at(middle[:, None], e[k])[..., 0]
        near = np.abs(sides - value).max(axis=1).argmin(axis=0)  # the end that moves there
        n = np.arange(len(k))
        ends[near, n], sides[near, :, n] = middle, value.T
        on = np.abs(sides[1] - sides[0]).max(axis=0) > size
        k, ends, sides = k[on], ends[:, on], sides[..., on]
    where = 0.5 * (ends[0] + ends[1])
    on = (where > INSIDE) & (where < 1.0 - INSIDE)
    rows = np.concatenate([np.arange(len(e)), k[on]])
    begin = np.concatenate([np.zeros(len(e)), where[on]])
    order = np.lexsort((begin, rows))
    rows, begin = rows[order], begin[order]
    last = np.append(rows[1:] != rows[:-1], True)
    return Pieces(e[rows], begin, np.where(last, 1.0, np.append(begin[1:], 1.0)))
