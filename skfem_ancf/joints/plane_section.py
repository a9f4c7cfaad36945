"""An end section keeps its direction as a plane, and may change its thickness."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import require_label, teaching
from .base import Joint, Vector, gradients

if TYPE_CHECKING:
    from ..scene import Scene
    from ..types import Array, Place, WhichBeam


@teaching
class PlaneSection(Joint):
    """t . r_Y = 0 at every section point: no section slope leaves the stress-free plane.

    For a cable, n . r_X = 0. On a beam along a coordinate axis it only fixes coordinates.

    Parameters
    ----------
    at
        The end section, "left" or "right".
    beam
        The beam, by Beam, name or number; None where there is only one.
    name
        What messages call the joint.
    """

    def __init__(self, at: Place, beam: WhichBeam = None, name: str | None = None) -> None:
        self.at, self.beam, self.name = at, beam, require_label("name", name)

    def bind(self, scene: Scene) -> None:
        beam = scene.beam(self.beam)
        node = beam.section_node(self.at)
        t = beam.mesh.p_X[:, node]
        direction, held = beam.kinematics.plane(beam, t)
        direction = np.where(np.abs(direction) < 1e-14, 0.0, direction)
        first = scene.offset(beam) + node * beam.nd
        self.vectors = [Vector(np.zeros(2), np.array([[first + 2 * k], [first + 2 * k + 1]]),
                               np.ones(1)) for k in held]
        self.direction = direction
        self.equations = tuple(f"moment on {beam.element.dofnames[k]}" for k in held)
        self.found = gradients(*([(v, direction)] for v in self.vectors))

    def value(self, u: Array, t: float) -> Array:
        return np.array([self.direction @ v(u) for v in self.vectors])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found
