"""Parameter sweeps over scenes."""

from .members import Failure, Sweep
from .parameter_sweep import sweep

__all__ = ["Failure", "Sweep", "sweep"]
