"""Time integration schemes."""

from __future__ import annotations

from ..core.errors import require_option
from .base import Motion, Scheme
from .choice import choose_scheme
from .energy_momentum import EnergyMomentum, EnergyMomentum4
from .gauss import Gauss
from .generalized_alpha import HHT, GeneralizedAlpha, Newmark
from .radau import Radau

#: The schemes by name.
SCHEMES = {cls.name: cls for cls in (EnergyMomentum, EnergyMomentum4, GeneralizedAlpha, HHT,
                                    Newmark, Gauss, Radau)}


def get_scheme(scheme: str | Scheme | type[Scheme]) -> Scheme:
    """A :class:`Scheme` from its name, its class or itself.

    Raises
    ------
    NameUnknown
        If the name is not known; the message lists the known ones.
    """
    if isinstance(scheme, Scheme):
        return scheme
    if isinstance(scheme, type) and issubclass(scheme, Scheme):
        return scheme()
    return SCHEMES[require_option("scheme", scheme, SCHEMES)]()


__all__ = ["HHT", "SCHEMES", "EnergyMomentum", "EnergyMomentum4", "Gauss", "GeneralizedAlpha",
           "Motion", "Newmark", "Radau", "Scheme", "choose_scheme", "get_scheme"]
