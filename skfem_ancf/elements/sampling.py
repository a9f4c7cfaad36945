"""Sampling points of the formulation "assumed", and the modes that they miss."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..core.quadrature import gauss, gauss_lobatto
from ..core.types import Array
from ..mesh.reference_cell import hermite_basis


class Sampling(NamedTuple):
    """Sampling of the strain along an element in the formulation "assumed".

    ``points`` is the number of integration points (Gauss). ``samples`` maps a strain component
    "xx", "yy" or "xy" to the points xi in [0, 1] where it is evaluated; others are evaluated at the
    integration points. ``volume`` is the number of Gauss points for the volumetric part in plane
    strain, reduced against volumetric locking; 0 to integrate it with the rest.
    """

    points: int
    samples: dict[str, tuple[float, ...]]
    volume: int = 0

    def places(self, component: str) -> Array:
        """Points xi in [0, 1] where a strain component is evaluated, shape (n,)."""
        return np.array(self.samples.get(component, gauss(self.points)[0]))


class StabilisedMode(NamedTuple):
    """A mode that the samples miss, stabilised by ``1/2 k L |c|^2``, L the length of the element.

    ``weights`` (2 nodal_dofs,) give c, a derivative along X of a field, from the degrees of freedom
    of an element of length 1. ``size`` is k in units of E I over the squared length of the
    "element" or the "beam", as ``per`` says; "" for a curvature c, without division.
    """

    weights: Array
    size: float
    per: str = ""


def default_sampling(p: int, s: int) -> Sampling:
    """Samples for axes of degree ``p`` and sections of degree ``s`` along X.

    They follow from constraint counting. An element of a chain adds one node with p + s + 2
    unknowns. In the thin limit each sample is a constraint; neighbours share those at nodes. If no
    unknown is left the element locks; with fewer samples modes are missed (:func:`missed`) and must
    be stabilised.

    * eps_xx, of degree 2 (p - 1): p - 1 Gauss points.
    * eps_yy: the nodes, and between them the s Gauss-Lobatto points, zeros of the mode of the slope
      that eps_xx misses.
    * eps_xy: (s + 3) / 2 Gauss-Lobatto points where sections have the degree of the axis, else the
      points of eps_xx.

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
    """Modes with m nodal derivatives whose slope vanishes at n Gauss points, (2 m,) each."""
    x, w = gauss(2 * m)
    out = []
    for degree in range(n, 2 * m - 1):
        P = legendre.legval(2.0 * x - 1.0, np.eye(degree + 1)[degree])
        weights = (2 * degree + 1) * hermite_basis(m, x, 1) @ (w * P)
        weights[m] = -weights[0]  # exactly zero for a translation
        out.append(weights)
    return out
