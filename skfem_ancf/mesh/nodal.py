"""Higher nodal derivatives of a curved axis."""

from __future__ import annotations

from math import factorial, perm
from typing import Any

import numpy as np

from ..core.types import Array


def turned(d: Array) -> Array:
    """Vectors (2, ...) rotated by 90 degrees."""
    return np.array([-d[1], d[0]])


def nodal_derivatives(mesh: Any, most: int) -> list[Array]:
    """Position of the axis at the nodes, and ``most`` derivatives by arc length, all (2, n).

    Position, tangent and curvature are those of the mesh. Higher derivatives are those of the
    polynomial of degree 8 through these at the node and its two neighbours, with a position error
    of order 9.
    """
    known = [mesh.p, mesh.p_X]
    if most > 1 and mesh.p_XY is not None:
        known.append(-turned(mesh.p_XY))
    more = np.zeros((max(most - 2, 0), *mesh.p.shape))
    if most > 2 and not mesh.is_straight:
        _add_higher(mesh, np.array(known), more)
    return [*known[:most + 1], *more]


def _add_higher(mesh, known, out):
    """Fill in derivatives from the third on, (n, 2, nvertices), from ``known`` ones (3, ...)."""
    apart = mesh.t[0, 1:] != mesh.t[1, :-1]
    at = np.cumsum(np.bincount(mesh.t[1], mesh.lengths, mesh.p.shape[1]))
    for a, b in zip(mesh.t[0, np.append(True, apart)], mesh.t[1, np.append(apart, True)]):
        few, nodes = min(3, b - a + 1), np.arange(a, b + 1)
        n, near = 3 * few, np.clip(nodes - 1, a, b + 1 - few)[:, None] + np.arange(few)
        x = at[near] - at[nodes, None]
        size = np.max(np.abs(x), axis=1)
        scale = size ** np.arange(n)[:, None]
        # conditions: the derivatives 0, 1, 2 of the powers at each place
        powers = np.array([[perm(k, d) * (x / size[:, None]) ** max(k - d, 0) for k in range(n)]
                           for d in range(3)]).transpose(2, 3, 0, 1).reshape(-1, n, n)
        values = known[:, :, near] * scale[:3, None, :, None]
        values = values.transpose(2, 3, 0, 1).reshape(-1, n, 2)
        found = np.linalg.solve(powers, values)
        for k in range(3, min(2 + len(out), n - 1) + 1):
            out[k - 3][:, nodes] = factorial(k) * found[:, k].T / scale[k]
