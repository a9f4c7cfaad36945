"""Results: states, modes and paths."""

from .output import Extreme
from .state import Reaction, State

__all__ = ["Extreme", "Reaction", "State"]
