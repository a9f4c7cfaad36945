"""Joints: constraints with Lagrange multipliers. A new joint is one file and one line here."""

from typing import Any

from ...core import require_option
from .base import Joint
from .sliders import OnCircle, OnLine, Sleeve, Slot
from .weld import (Glue, Hinge, Motor, PlaneSection, PrescribedAngle, PrescribedPosition,
                   PrescribedTurn, Weld)

#: The joints by name.
JOINTS = {
    "hinge": Hinge,
    "weld": Weld,
    "line": OnLine,
    "circle": OnCircle,
    "position": PrescribedPosition,
    "angle": PrescribedAngle,
    "turn": PrescribedTurn,
    "plane": PlaneSection,
    "sleeve": Sleeve,
    "slot": Slot,
}


def get_joint(joint: str | Joint, **options: Any) -> Joint:
    """A :class:`Joint` from its name and options, or itself.

    Parameters
    ----------
    joint
        A name from :data:`JOINTS`, or a Joint.
    **options
        Arguments of the class, for a name.
    """
    if isinstance(joint, Joint):
        return joint
    return JOINTS[require_option("joint", joint, JOINTS)](**options)


__all__ = ["JOINTS", "Glue", "Hinge", "Joint", "Motor", "OnCircle", "OnLine", "PlaneSection",
           "PrescribedAngle", "PrescribedPosition", "PrescribedTurn", "Sleeve", "Slot", "Weld",
           "get_joint"]
