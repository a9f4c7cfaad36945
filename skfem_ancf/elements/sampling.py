"""Where along an element the formulation "assumed" samples the strain, and what that misses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..core.quadrature import gauss, gauss_lobatto
from ..core.types import Array
from ..mesh.reference_cell import hermite_basis


class Sampling(NamedTuple):
    """Where the formulation "assumed" evaluates the strain along an element.

    ``points`` is the number of Gauss points of the integration. ``samples`` has for a strain
    component "xx", "yy" or "xy" the places xi in [0, 1]; others are evaluated at the points of
    integration. ``volume`` is the number of Gauss points for the volumetric part of a law in plane
    strain, where all ``points`` would lock as nu goes to 1/2; 0 to leave it with the rest.
    """

    points: int
    samples: dict[str, tuple[float, ...]]
    volume: int = 0

    def places(self, component: str) -> Array:
        """Where a strain component "xx", "yy" or "xy" is evaluated, xi in [0, 1], shape (n,)."""
        return np.array(self.samples.get(component, gauss(self.points)[0]))


class StabilisedMode(NamedTuple):
    """A mode that the samples miss, stabilised by ``1/2 k L |c|^2``, L the length of the element.

    ``weights`` (2 nodal_dofs,) give c, a derivative along X of a field, from the degrees of freedom
    of an element of length 1. ``size`` is k in units of E I over the square of the length of what
    ``per`` names, "element" or "beam"; "" for none, where c is a curvature.
    """

    weights: Array
    size: float
    per: str = ""


def default_sampling(p: int, s: int) -> Sampling:
    """The samples of axes of degree ``p`` and sections of degree ``s`` along X, found by counting.

    Each element of a chain adds a node: p + s + 2 numbers. When nothing stretches, shears or gets
    thinner each sample takes one of them; of those at the nodes neighbours share one. If none is
    left the element locks; fewer samples miss modes, see :func:`missed`, to be stabilised.

    * eps_xx, of degree 2 (p - 1), vanishes best at p - 1 Gauss points.
    * eps_yy vanishes at the nodes, and between them best at the s Gauss-Lobatto points, zeros of
      the mode of the slope that eps_xx misses.
    * eps_xy: sections as rich as the axis follow it at (s + 3) / 2 Gauss-Lobatto points, others at
      the points of eps_xx.

    Linear sections, p = 3 and s = 1, have 1 of 6 left, p = s = 3 has 2 of 8, p = s = 5 1 of 12.
    """
    few = (s + 3) // 2
    if s < p:
        return Sampling(min(p - 1, (p + s + 2 - few) // 2), {"yy": _lobatto(few)},
                        volume=int(s == 1))
    few = max(few, s - 1)
    many = s if s > 5 else min(s, p + s + 2 - (p - 1) - (few - 1))
    return Sampling(many, {"xx": tuple(gauss(p - 1)[0]), "yy": _lobatto(many),
                           "xy": _lobatto(few)})


def _lobatto(n: int) -> tuple[float, ...]:
    return tuple(0.5 + 0.5 * gauss_lobatto(n))


def missed(m: int, n: int) -> list[Array]:
    """What n Gauss points of a slope miss, of a field with m derivatives at nodes, (2 m,) each."""
    x, w = gauss(2 * m)
    out = []
    for degree in range(n, 2 * m - 1):
        P = legendre.legval(2.0 * x - 1.0, np.eye(degree + 1)[degree])
        weights = (2 * degree + 1) * hermite_basis(m, x, 1) @ (w * P)
        weights[m] = -weights[0]  # exactly: a translation is not resisted
        out.append(weights)
    return out
