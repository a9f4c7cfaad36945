"""Parameter sweeps over scenes."""

from .parameter_sweep import Failure, Sweep, sweep

__all__ = ["Failure", "Sweep", "sweep"]
