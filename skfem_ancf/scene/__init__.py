"""Scenes and frames: what users write."""

from .scene import Scene

__all__ = [
    "Scene",
]
