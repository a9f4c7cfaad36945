"""Time integration schemes."""

from .base import Motion, Scheme
from .collocation import Gauss, Radau
from .schemes import (HHT, SCHEMES, EnergyMomentum, EnergyMomentum4, GeneralizedAlpha, Newmark,
                      choose_scheme, get_scheme)

__all__ = ["HHT", "SCHEMES", "EnergyMomentum", "EnergyMomentum4", "Gauss", "GeneralizedAlpha",
           "Motion", "Newmark", "Radau", "Scheme", "choose_scheme", "get_scheme"]
