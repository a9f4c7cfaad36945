"""Force elements: springs, dashpots, foundations, drag, masses, and user-defined ones."""

from ..places import point, section
from .base import ForceElement
from .control import Control
from .springs import Drag, Foundation, Spring, TorsionalSpring
from .inertia import PointMass, RotatingFrame

__all__ = ["Control", "Drag", "ForceElement", "Foundation", "PointMass", "RotatingFrame", "Spring",
           "TorsionalSpring", "point", "section"]
