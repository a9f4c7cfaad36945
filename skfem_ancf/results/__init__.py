"""Results: states, modes and paths."""

from .state import Reaction, State

__all__ = ["Reaction", "State"]
