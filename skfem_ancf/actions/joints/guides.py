"""End sections and material points on fixed planes, lines and circles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...beam.kinematics import plane
from ...beam.layout import Layout, WhichBeam
from ...core.errors import (InputError, require_direction, require_finite, require_label,
                            require_positive)
from ...core.types import Array, Place
from ...mesh.places import node_of
from ..places import Vector, point
from .base import Joint, gradients


# an end section with fixed direction and free thickness

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


class OnLine(Joint):
    """n . (r - p) = 0: a material point slides on a straight line.

    Parameters
    ----------
    at
        The material point (x, y) in the reference configuration.
    direction
        Direction of the line, shape (2,).
    through
        A point of the line, shape (2,); by default the material point's reference position.
    """

    equations = ("force normal to the line",)

    def __init__(self, at: ArrayLike, direction: ArrayLike, beam: WhichBeam = None,
                 through: ArrayLike | None = None, name: str | None = None) -> None:
        d = require_direction("direction", direction)
        self.normal = np.array([-d[1], d[0]]) / np.hypot(*d)
        self.through = None if through is None else require_finite("through", through, (2,))
        self.beam, self.at, self.name = beam, at, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        self.r = point(layout, self.beam, self.at)
        self.p = self.r.start if self.through is None else self.through
        self.found = gradients([(self.r, self.normal)])

    def value(self, u: Array, t: float) -> Array:
        return np.array([self.normal @ (self.r(u) - self.p)])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found


class OnCircle(Joint):
    """``(|r - c|^2 - R^2) / (2 R) = 0``: a material point slides on a circle.

    Parameters
    ----------
    at
        The material point (x, y) in the reference configuration.
    center
        Centre of the circle, shape (2,).
    radius
        Its radius; by default the distance of the point in the reference configuration.
    """

    equations = ("force away from the centre",)
    constant = False

    def __init__(self, at: ArrayLike, center: ArrayLike, beam: WhichBeam = None,
                 radius: float | None = None, name: str | None = None) -> None:
        self.center = require_finite("center", center, (2,))
        self.radius = None if radius is None else require_positive("radius", radius)
        self.beam, self.at, self.name = beam, at, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        self.r = point(layout, self.beam, self.at)
        self.R = self.radius or require_positive(
            "the distance of the point from the centre", np.hypot(*(self.r.start - self.center)))
        if self.R < 1e-9 * np.hypot(*(self.r.start - self.center)):
            raise InputError(f"radius = {self.R!r} is negligible against the distance of the point "
                             "from the centre")

    def value(self, u: Array, t: float) -> Array:
        d = self.r(u) - self.center
        return np.array([(d @ d - self.R**2) / (2 * self.R)])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return gradients([(self.r, (self.r(u) - self.center) / self.R)])

    def curvature(self, u: Array, t: float, multipliers: Array) -> tuple[Array, Array, Array]:
        w = self.r.weights
        values = np.einsum("ik,il->ikl", w, w) * (multipliers[0] / self.R)
        rows = np.broadcast_to(self.r.dofs[:, :, None], values.shape)
        return rows.ravel(), rows.transpose(0, 2, 1).ravel(), values.ravel()
