"""Results: what a solution knows."""

from .state import Reaction, State

__all__ = ["Reaction", "State"]
