"""Contact of beams, rigid bodies and domains with each other."""

from .contact import BodyContact

__all__ = ["BodyContact"]
