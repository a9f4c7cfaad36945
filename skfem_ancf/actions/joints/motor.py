"""A motor rotates a section or a rigid body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...beam.layout import Layout
from ...core.errors import InputError, require_finite_scalar
from ...core.types import TimeFunction
from ..item import Item
from ..loads import EndMoment
from ..places import both_of
from .prescribed import PrescribedAngle, PrescribedTurn, Turned


class Motor(Item):
    """Rotate a rigid body or a section by a given angle, at a given speed, or with a torque.

    For a torque that depends on the state use a :class:`~skfem_ancf.Control`.

    Parameters
    ----------
    at
        A RigidBody, or (beam, place) with a place that is one section, as (0, "left").
    angle
        Rotation from the start as a function of time, in radians.
    speed
        Angular velocity, a number or a function of time, integrated from time 0.
    torque
        Moment, a number or a function of time; a function is 1 in statics, as every amplitude.
    other
        The base of the motor, as ``at``: the angle is relative to it, and it takes the opposite
        torque. The ground by default.
    """

    def __init__(self, at: Any, angle: TimeFunction = None, speed: Any = None, torque: Any = None,
                 other: Any = None) -> None:
        given = [name for name, value in (("angle", angle), ("speed", speed), ("torque", torque))
                 if value is not None]
        if len(given) != 1:
            raise InputError("a motor has an angle, a speed or a torque: give one of them, got "
                             f"{given or 'none'}")
        self.at = both_of("at", at)
        self.other = None if other is None else both_of("other", other)
        self.torque = torque if torque is None or callable(torque) else (
            require_finite_scalar("torque", torque))
        self.angle: Any = angle if speed is None else Turned(speed)

    def expand(self, layout: Layout) -> Sequence[Item]:
        if self.torque is None:
            if self.other is None:
                return (PrescribedAngle(self.at[1], self.angle, self.at[0]),)
            return (PrescribedTurn(self.at, self.other, self.angle),)
        M, amplitude = (1.0, self.torque) if callable(self.torque) else (self.torque, None)
        couple = None if self.other is None else object()
        places = [(self.at, M)] + ([] if self.other is None else [(self.other, -M)])
        return [EndMoment(place, size, layout.number(which), amplitude)._with(couple=couple)
                for (which, place), size in places]
