"""Loads given by densities at points, for all local functions at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..beam.kinematics import entries_of
from ..core.types import Array
from .loads import Load

#: Component and derivative (0: r, then the slopes) of r_0, r_1, F_00, F_01, F_10, F_11.
VARIABLES = np.array([[0, 2, 3], [1, 4, 5]])


class DensityPoints(NamedTuple):
    """Quadrature points of n elements or facets.

    ``dofs`` (n, 2 nb), material points ``X`` (2, n, np), ``weights`` (n, np), values and both
    derivatives of the local ``functions`` (n, nb, np, 3), and additional data ``of``.
    """

    dofs: Array
    X: Array
    weights: Array
    functions: Array
    of: Any = None


def points_of(dofs: Array, X: Array, weights: Array, N: Array, grad: Array, of: Any
              ) -> DensityPoints:
    """DensityPoints from local functions N, (nb, n, np), and their gradients, (nb, 2, n, np)."""
    both = np.stack(np.broadcast_arrays(N, grad[:, 0], grad[:, 1]), axis=-1)
    return DensityPoints(dofs, X, weights, np.ascontiguousarray(both.swapaxes(0, 1)), of)


class Density(Load):
    """A load defined by the derivative of a density with respect to r and F.

    The six variables ``y``, (6, n, np), are r_0, r_1, F_00, F_01, F_10, F_11. A subclass defines
    ``_slope(y, part)``, the derivatives of the density, (6, n, np), and ``_curvature(y, part)``,
    the second derivatives (6, 6, n, np), the differentiation last. ``_parts`` are the
    :class:`Points`, known once bound.
    """

    constant = False
    # of a bound one
    _parts: Sequence[DensityPoints]
    _time = 0.0

    @property
    def first_order(self) -> bool:
        return True

    def acting(self, t: float | None) -> tuple[float, Load]:
        return self.factor(t), self if t is None else self._with(_time=float(t))

    def _slope(self, y, part):
        raise NotImplementedError

    def _curvature(self, y, part):
        raise NotImplementedError

    def _variables(self, u, part):
        """The six variables at points, shape (6, n, np)."""
        n, nb, points, _ = part.functions.shape
        moved = part.functions.reshape(n, nb, -1).swapaxes(1, 2) @ u[part.dofs].reshape(n, nb, 2)
        moved = moved.reshape(n, points, 3, 2).transpose(3, 2, 0, 1)
        y = np.empty((6, n, points), dtype=moved.dtype)
        y[VARIABLES] = moved
        y[:2] += part.X
        y[2] += 1.0
        y[5] += 1.0
        return y

    def _force(self, P, part):
        """Force (N,) of derivatives P (6, n, np) at the points."""
        n, nb = part.functions.shape[:2]
        P = (P * part.weights)[VARIABLES].transpose(2, 3, 1, 0).reshape(n, -1, 2)
        out = np.zeros(self.beam.N)
        np.add.at(out, part.dofs, -(part.functions.reshape(n, nb, -1) @ P).reshape(n, -1))
        return out

    def force(self, u: Array) -> Array:
        return sum((self._force(self._slope(self._variables(u, part), part), part)
                    for part in self._parts), np.zeros(self.beam.N))

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        rows, columns, values = [], [], []
        for part in self._parts:
            n, nb, points, _ = part.functions.shape
            A = self._curvature(self._variables(u, part), part) * part.weights
            A = A[VARIABLES[:, :, None, None], VARIABLES].transpose(4, 5, 0, 1, 2, 3)
            T = part.functions
            AT = A.reshape(n, points, 12, 3) @ T.transpose(0, 2, 3, 1)  # (n, np, (i, k, j), nb)
            AT = AT.reshape(n, points, 2, 3, 2, nb).transpose(0, 1, 3, 2, 5, 4)
            K = T.reshape(n, nb, -1) @ AT.reshape(n, 3 * points, -1)  # (n, nb, (i, b, j))
            i, j = entries_of(part.dofs)
            rows.append(i)
            columns.append(j)
            values.append(-K.ravel())
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
