"""Prescribed displacements and rotations of the nodes of a frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ...core.sampling import sample
from ...core.types import Array

#: Components of a node's motion that can be fixed.
COMPONENTS = "x", "y", "angle"


class Settlements:
    """Prescribed displacements of supports along x and y, and rotations in radians.

    ``numbers``, (n, 3), are proportional to the load factor of a static solution. ``functions`` of
    time, in statics of the load factor, replace those of the node and the number in
    :data:`COMPONENTS` in ``at``.
    """

    def __init__(self, numbers: Array, functions: Sequence[Callable[[float], float]] = (),
                 at: Sequence[tuple[int, int]] = ()) -> None:
        self.numbers, self.functions, self.at = numbers, tuple(functions), tuple(at)
        self._sampled = [partial(sample, f, name=COMPONENTS[k], shape=())
                         for f, (_, k) in zip(self.functions, self.at)]

    def given(self, nodes: Array, k: int, by: float | Callable[[float], float]) -> Settlements:
        """A copy with nodes displaced by a number or a function of time."""
        numbers, new = self.numbers.copy(), {(int(node), k) for node in nodes}
        kept = [(f, at) for f, at in zip(self.functions, self.at) if at not in new]
        if callable(by):
            numbers[nodes, k] = 0.0
            kept += [(by, at) for at in sorted(new)]
        else:
            numbers[nodes, k] = by
        return Settlements(numbers, [f for f, _ in kept], [at for _, at in kept])

    def moves(self, k: int) -> bool:
        """True if a node is displaced in component k."""
        return bool(np.any(self.numbers[:, k])) or any(way == k for _, way in self.at)

    def by(self, nodes: Array, k: int, times: Array) -> Array:
        """Displacements of nodes at some times, shape (n, m)."""
        out = np.multiply.outer(times, self.numbers[nodes, k])
        for sampled, (node, way) in zip(self._sampled, self.at):
            if way == k:
                out[:, np.searchsorted(nodes, node)] = sampled(times)
        return out
