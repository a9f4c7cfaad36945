"""Two beams share a point and turn freely about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import require_label, teaching
from .base import Joint, both, gradients, pair, point

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..scene import Scene
    from ..types import Array


@teaching
class Hinge(Joint):
    """r_a = r_b for a material point of each of two beams.

    Parameters
    ----------
    beams
        Two beams, by Beam, name or number.
    at
        The point, its place (x, y) in the stress-free bodies; or one point for each beam, if they
        are apart.
    name
        What messages call the joint.

    References
    ----------
    Eq. (26) of "A series of locking-free beam element models in absolute nodal coordinate
    formulation", Archive of Applied Mechanics (2024).
    """

    equations = ("force along x", "force along y")

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None) -> None:
        self.beams, self.at = both(beams), pair(at, "the point at=")
        self.name = require_label("name", name)

    def bind(self, scene: Scene) -> None:
        self.a, self.b = (point(scene, beam, at) for beam, at in zip(self.beams, self.at))
        self.found = gradients(*([(self.a, e), (self.b, -e)] for e in np.eye(2)))

    def value(self, u: Array, t: float) -> Array:
        return self.a(u) - self.b(u)

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found
