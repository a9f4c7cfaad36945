"""An end section with fixed direction and free thickness."""

from __future__ import annotations

import numpy as np

from ...beam.kinematics import plane
from ...beam.layout import Layout, WhichBeam
from ...core.errors import require_label
from ...core.types import Array, Place
from ...mesh.places import node_of
from ..places import Vector
from .base import Joint, gradients


class PlaneSection(Joint):
    """t . r_Y = 0 at every section point: section slopes stay in the reference plane.

    For a cable, n . r_X = 0. On a beam along a coordinate axis it only fixes degrees of freedom.

    Parameters
    ----------
    at
        The end section, "left" or "right".
    """

    def __init__(self, at: Place, beam: WhichBeam = None, name: str | None = None) -> None:
        self.at, self.beam, self.name = at, beam, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        beam = layout.beam(self.beam)
        node = node_of(beam.mesh, self.at)
        t = beam.mesh.p_X[:, node]
        direction, fixed = plane(beam, t)
        self.direction = np.array([0.0 if abs(x) < 1e-14 else x for x in direction.tolist()])
        first = layout.offset(beam) + node * beam.nd
        self.equations = tuple(f"moment on {beam.element.dofnames[k]}" for k in fixed)
        self.slopes = [Vector(np.zeros(2), first + 2 * k + np.arange(2)[:, None], 1.0)
                       for k in fixed]
        self.found = gradients(*([(slope, self.direction)] for slope in self.slopes))

    def value(self, u: Array, t: float) -> Array:
        return np.array([self.direction @ slope(u) for slope in self.slopes])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found
