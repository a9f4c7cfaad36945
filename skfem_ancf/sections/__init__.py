"""Sections: what lies across a beam, by its width and its materials."""

from .across import Across
from .section import Rectangle, Section, Layer

__all__ = ["Across", "Layer", "Rectangle", "Section"]
