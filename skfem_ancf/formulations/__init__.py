"""Formulations of the strain energy. A new one is one file and one line here."""

from ..errors import NameUnknown
from .assumed import Assumed
from .base import COMPONENTS, Formulation, Term
from .continuum import Continuum
from .ecm import EnhancedContinuum
from .strain_split import StrainSplit

#: The formulations by name.
FORMULATIONS = {cls.name: cls for cls in (Continuum, EnhancedContinuum, StrainSplit, Assumed)}


def get_formulation(formulation):
    """A :class:`Formulation` from its name, its class or itself.

    Raises
    ------
    NameUnknown
        If the name is not known; the message lists the known ones.
    """
    if isinstance(formulation, Formulation):
        return formulation
    if isinstance(formulation, type) and issubclass(formulation, Formulation):
        return formulation()
    if formulation not in FORMULATIONS:
        raise NameUnknown("formulation", formulation, FORMULATIONS)
    return FORMULATIONS[formulation]()


__all__ = ["COMPONENTS", "FORMULATIONS", "Assumed", "Continuum", "EnhancedContinuum",
           "Formulation", "StrainSplit", "Term", "get_formulation"]
