"""A point or a section follows a given motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import ask_array, ask_number, require_function, require_label, teaching
from ..sampling import sample
from .base import Joint, gradients, point, section

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from ..scene import Scene
    from ..types import Array, Place, WhichBeam


@teaching
class PrescribedPosition(Joint):
    """r = r(t) for a material point. At a node of the axis it only fixes coordinates.

    Parameters
    ----------
    at
        The material point: its place (x, y) in the stress-free body.
    r
        The motion: a function of time that returns the position (2,).
    beam
        The beam, by Beam, name or number; None where there is only one.
    name
        What messages call the joint.
    """

    equations = ("force along x", "force along y")
    moving = True

    def __init__(self, at: ArrayLike, r: Callable[[float], ArrayLike], beam: WhichBeam = None,
                 name: str | None = None) -> None:
        self.motion = require_function("r", r, "of time that returns a position (2,)")
        self.at, self.beam, self.name = at, beam, require_label("name", name)

    def bind(self, scene: Scene) -> None:
        self.r = point(scene, self.beam, self.at)
        self.found = gradients(*([(self.r, e)] for e in np.eye(2)))

    def value(self, u: Array, t: float) -> Array:
        return self.r(u) - ask_array("r(t={:g})", (2,), self.motion, t)

    def offset(self, times: Array, N: int) -> Array:
        return self.r.start - sample(self.motion, times, "r", (2,))

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found


@teaching
class PrescribedAngle(Joint):
    """The direction of an end section has turned by angle(t): e(t) x d = 0.

    Parameters
    ----------
    at
        The end section, "left" or "right".
    angle
        The angle in radians as a function of time, from the stress-free state, counterclockwise.
    beam
        The beam, by Beam, name or number; None where there is only one.
    name
        What messages call the joint.
    """

    equations = ("moment",)
    constant = False
    moving = True

    def __init__(self, at: Place, angle: Callable[[float], float], beam: WhichBeam = None,
                 name: str | None = None) -> None:
        self.angle = require_function("angle", angle, "of time that returns radians")
        self.at, self.beam, self.name = at, beam, require_label("name", name)

    def bind(self, scene: Scene) -> None:
        _, self.d = section(scene, self.beam, self.at)
        self.start = np.arctan2(*self.d.start[::-1])

    def _angle(self, t: float) -> float:
        return ask_number("angle(t={:g})", self.angle, t)

    def value(self, u: Array, t: float) -> Array:
        a, d = self.start + self._angle(t), self.d(u)
        return np.array([np.cos(a) * d[1] - np.sin(a) * d[0]])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        a = self.start + self._angle(t)
        return gradients([(self.d, (-np.sin(a), np.cos(a)))])

    def _normals(self, times: Array) -> Array:
        a = self.start + sample(self.angle, times, "angle", ())
        return np.array([-np.sin(a), np.cos(a)]).T

    def offset(self, times: Array, N: int) -> Array:
        return self._normals(times) @ self.d.start[:, None]

    def slope(self, times: Array, N: int) -> tuple[Array, Array]:
        values = self._normals(times)[:, :, None] * self.d.weights[None]
        return self.d.dofs.ravel(), values.reshape(len(times), 1, -1)
