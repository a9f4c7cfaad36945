"""Scenes and frames: what users write."""

from .frame import Frame
from .scene import Scene

__all__ = ["Frame", "Scene"]
