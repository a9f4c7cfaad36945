"""Time integration schemes."""

from .base import Motion, Scheme
from .choice import SCHEMES, choose_scheme, get_scheme
from .collocation import Gauss, Radau
from .energy_momentum import EnergyMomentum, EnergyMomentum4
from .generalized_alpha import HHT, GeneralizedAlpha, Newmark

__all__ = ["HHT", "SCHEMES", "EnergyMomentum", "EnergyMomentum4", "Gauss", "GeneralizedAlpha",
           "Motion", "Newmark", "Radau", "Scheme", "choose_scheme", "get_scheme"]
