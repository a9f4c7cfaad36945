"""Hinge between two or more beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...beam.layout import Layout
from ...core.errors import require_label
from ...core.types import Array
from ..places import each, point, several
from .base import Joint, equations_of, gradients


class Hinge(Joint):
    """r_a = r_b for a material point of two beams, and of further ones; rotations are free.

    Parameters
    ----------
    beams
        Two or more, each a Beam or a RigidBody, its name or number, or "ground".
    at
        The point (x, y) in the reference configuration; or one point for each beam, if they are
        apart. None is the centre of mass of a rigid body.
    """

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None) -> None:
        self.beams = several(beams)
        self.at = each(at, "the point at=", len(self.beams))
        self.name = require_label("name", name)
        self.equations = equations_of(("force along x", "force along y"), len(self.beams))

    def bind(self, layout: Layout) -> None:
        self.points = [point(layout, beam, at) for beam, at in zip(self.beams, self.at)]
        first = self.points[0]
        self.found = gradients(*([(first, e), (other, -e)]
                                 for other in self.points[1:] for e in np.eye(2)))

    def value(self, u: Array, t: float) -> Array:
        first = self.points[0](u)
        return np.concatenate([first - other(u) for other in self.points[1:]])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found
