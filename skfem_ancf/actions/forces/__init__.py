"""Force elements: springs, dashpots, foundations, drag, masses, and user-defined ones."""

from ..places import point, section
from .base import ForceElement, bind_force
from .control import Control
from .distributed import Drag, Foundation
from .masses import PointMass
from .rotating import RotatingFrame
from .springs import Spring, TorsionalSpring

__all__ = ["Control", "Drag", "ForceElement", "Foundation", "PointMass", "RotatingFrame", "Spring",
           "TorsionalSpring", "bind_force", "point", "section"]
