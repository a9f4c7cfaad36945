"""Obstacles: rigid shapes in contact with the surface of beams."""

from .contact import Contact
from .obstacle import Obstacle
from .shapes import Circle, Line, Polygon, Shape, SignedDistance

__all__ = ["Circle", "Contact", "Line", "Obstacle", "Polygon", "Shape", "SignedDistance"]
