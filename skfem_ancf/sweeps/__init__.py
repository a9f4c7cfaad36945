"""Many scenes, solved side by side."""

from .sweep import sweep

__all__ = [
    "sweep",
]
