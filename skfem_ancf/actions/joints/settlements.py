"""Displacements and rotations that the nodes of a frame are given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ...core.sampling import sample
from ...core.types import Array

#: What may be held of a node.
HELD = "x", "y", "angle"


class Settlements:
    """What held nodes are displaced by: along x, along y, and in radians.

    ``numbers``, (n, 3), are in proportion to the load of a static solution; ``functions`` of time,
    in statics of the load factor, take the place of those at the node and the number in
    :data:`HELD` that ``at`` says.
    """

    def __init__(self, numbers: Array, functions: Sequence[Callable[[float], float]] = (),
                 at: Sequence[tuple[int, int]] = ()) -> None:
        self.numbers, self.functions, self.at = numbers, tuple(functions), tuple(at)
        self._sampled = [partial(sample, f, name=HELD[k], shape=())
                         for f, (_, k) in zip(self.functions, self.at)]

    def given(self, nodes: Array, k: int, by: float | Callable[[float], float]) -> Settlements:
        """The same with nodes displaced by a number or a function of time."""
        numbers, new = self.numbers.copy(), {(int(node), k) for node in nodes}
        kept = [(f, at) for f, at in zip(self.functions, self.at) if at not in new]
        if callable(by):
            numbers[nodes, k] = 0.0
            kept += [(by, at) for at in sorted(new)]
        else:
            numbers[nodes, k] = by
        return Settlements(numbers, [f for f, _ in kept], [at for _, at in kept])

    def moves(self, k: int) -> bool:
        """True if a node is displaced in the way number k."""
        return bool(np.any(self.numbers[:, k])) or any(way == k for _, way in self.at)

    def by(self, nodes: Array, k: int, times: Array) -> Array:
        """What nodes are displaced by at some times, shape (n, m)."""
        out = np.multiply.outer(times, self.numbers[nodes, k])
        for sampled, (node, way) in zip(self._sampled, self.at):
            if way == k:
                out[:, np.searchsorted(nodes, node)] = sampled(times)
        return out
