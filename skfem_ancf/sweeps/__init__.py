"""Many scenes, solved side by side."""

from .members import Failure, Sweep
from .sweep import sweep

__all__ = ["Failure", "Sweep", "sweep"]
