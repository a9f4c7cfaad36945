"""Beams, rigid bodies and domains: strain energy and inertia."""

from .beam import Beam, reference_coordinates
from .rigid import RigidBody

__all__ = ["Beam", "RigidBody", "reference_coordinates"]
