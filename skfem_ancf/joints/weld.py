"""Two end sections are welded at the angle they have in the stress-free state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, require_flag, require_label, shown, teaching
from ..places import is_place
from .base import Joint, both, cross_terms, gradients, rotation, section

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..scene import Scene
    from ..types import Array


@teaching
class Weld(Joint):
    """The axis points coincide, and the directions of the two sections keep their angle.

    The direction of a section is the best straight line through its face, so the face may still
    warp and change its thickness.

    Parameters
    ----------
    beams
        Two beams, by Beam, name or number.
    at
        The section of each beam, as ``("right", "left")``; or one place for both, as the point of
        the axis ``(1, 0)`` that they share.
    name
        What messages call the joint.
    apart
        Allow that the sections are apart in the stress-free state: the weld draws them together.

    Raises
    ------
    InputError
        If the sections are apart.
    """

    equations = ("force along x", "force along y", "moment")
    constant = False

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None,
                 apart: bool = False) -> None:
        self.beams, self.name = both(beams), require_label("name", name)
        self.apart = require_flag("apart", apart)
        if is_place(at):
            at = at, at
        if not isinstance(at, (tuple, list)) or len(at) != 2:
            raise InputError("a weld needs the section of each of its two beams, as "
                             f"at=('right', 'left'), or one point of both axes, got {shown(at)}")
        self.at = tuple(at)

    def bind(self, scene: Scene) -> None:
        (self.a, self.da), (self.b, self.db) = (
            section(scene, beam, at) for beam, at in zip(self.beams, self.at))
        gap = self.b.start - self.a.start
        if not self.apart and np.hypot(*gap) > 1e-6 * min(
                scene.beam(beam).mesh.lengths.sum() for beam in self.beams):
            raise InputError(
                f"the sections to weld are {np.hypot(*gap):.6g} apart, one at "
                f"({self.a.start[0]:.6g}, {self.a.start[1]:.6g}), the other at "
                f"({self.b.start[0]:.6g}, {self.b.start[1]:.6g}): name sections that meet, move a "
                f"mesh by mesh.translated(({0 - gap[0]:.6g}, {0 - gap[1]:.6g})), or weld with "
                "apart=True to draw them together")
        angle = np.arctan2(*self.da.start[::-1]) - np.arctan2(*self.db.start[::-1])
        self.Q = rotation(angle)
        rows, columns, self.values = gradients(
            *([(self.a, e), (self.b, -e)] for e in np.eye(2)))
        turning = np.append(self.da.dofs.ravel(), self.db.dofs.ravel())
        self.places = (np.append(rows, np.full(len(turning), 2)), np.append(columns, turning))

    def value(self, u: Array, t: float) -> Array:
        d, e = self.da(u), self.Q @ self.db(u)
        return np.append(self.a(u) - self.b(u), e[0] * d[1] - e[1] * d[0])

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        d, e = self.da(u), self.Q @ self.db(u)
        turn = ((-e[1], e[0]) * self.da.weights[:, None],
                (d[1], -d[0]) @ self.Q * self.db.weights[:, None])
        return *self.places, np.concatenate([self.values, *(part.T.ravel() for part in turn)])

    def curvature(self, u: Array, t: float, multipliers: Array) -> tuple[Array, Array, Array]:
        i, j, v = cross_terms(self.da, self.db, self.Q)
        return i, j, -multipliers[2] * v
