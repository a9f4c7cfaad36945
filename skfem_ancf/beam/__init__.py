"""Beams and rigid bodies: their strain energy and inertia."""

from .beam import Beam, reference_coordinates

__all__ = [
    "Beam",
    "reference_coordinates",
]
