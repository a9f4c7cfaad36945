"""All items of the package by name. A new item is one file and one line here."""

from typing import Any

from .axial import FollowerForce, LineLoad
from .eigenstrain import EigenStrain, Temperature
from .energy import Energy
from .forces import Control, Drag, Foundation, PointMass, Spring, TorsionalSpring
from .joints import JOINTS, Motor
from .loads import EndMoment, FormLoad, PointForce, Pressure, Traction, Weight
from .obstacles import Obstacle
from .supports import Clamp, Pin, Support

#: Where a :class:`~skfem_ancf.Scene` has a method of the name, that adds the item.
ITEMS: dict[str, Any] = {
    "clamp": Clamp,
    "pin": Pin,
    "fix": Support,
    "motor": Motor,
    "gravity": Weight,
    "point_force": PointForce,
    "follower_force": FollowerForce,
    "line_load": LineLoad,
    "traction": Traction,
    "pressure": Pressure,
    "temperature": Temperature,
    "eigenstrain": EigenStrain,
    "moment": EndMoment,
    "load": FormLoad,
    "energy": Energy,
    "spring": Spring,
    "torsional_spring": TorsionalSpring,
    "control": Control,
    "foundation": Foundation,
    "drag": Drag,
    "point_mass": PointMass,
    "obstacle": Obstacle,
    **JOINTS,
}
