"""Obstacles: shapes, and contact of the surface of beams with them."""

from .contact import Contact
from .obstacle import Obstacle
from .shapes import Circle, Line, Polygon, Shape, SignedDistance

__all__ = ["Circle", "Contact", "Line", "Obstacle", "Polygon", "Shape", "SignedDistance"]
