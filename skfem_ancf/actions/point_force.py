"""A dead force on a material point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..beam.beam import Beam
from ..beam.distribution import on_points
from ..beam.kinematics import locate
from ..beam.layout import Layout, WhichMember
from ..beam.rigid import RigidBody, on_body
from ..core.errors import require_finite
from ..core.types import TimeFunction
from .item import Item
from .loads import DeadLoad, Load, number_at
from .moving import MovingForce
from .off_axis import OffAxisForce, is_off_axis


class PointForce(Load):
    """A dead force on a material point.

    Parameters
    ----------
    force
        The force, shape (2,).
    at
        The point (x, y) in the reference configuration, shape (2,), or "right" for the axis at that
        end; None for the centre of mass of a rigid body. At a point of a cable beside its axis the
        force has a couple. For a function of time see
        :class:`~skfem_ancf.actions.moving.MovingForce`.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`; the beam may be a RigidBody.
    """

    for_bodies = for_domains = True

    def __init__(self, force: ArrayLike, at: Any, beam: WhichMember = None,
                 amplitude: TimeFunction = None) -> None:
        at, beam = on_body(at, beam)
        super().__init__(beam, amplitude)
        self.total, self.at = require_finite("force", force, (2,)), at

    def expand(self, layout: Layout) -> Sequence[Item]:
        if callable(self.at):
            return MovingForce(self.total, self.at, self.beam, self.amplitude).expand(layout)
        return (self._with(beam=number_at(layout, self.at, self.beam)),)

    def bind(self, beam: Beam | RigidBody) -> Load:
        if not isinstance(beam, Beam):
            vector = np.zeros(beam.N)
            dofs, weights = beam.probe(self.at)
            np.add.at(vector, dofs, self.total[:, None] * weights)
            return DeadLoad(beam, vector, self.amplitude)
        e, X = locate(beam, self.at)
        if is_off_axis(beam, X):
            return OffAxisForce(self.total, e, X, beam, self.amplitude)
        vector, distribution = on_points(beam, [(self.total, e, X)])
        return DeadLoad(beam, vector, self.amplitude, distribution)
