"""Sections: what lies across a beam, by its width and its materials."""

from .across import Across
from .section import Rectangle, Section, Slab

__all__ = ["Across", "Rectangle", "Section", "Slab"]
