"""Formulations of the strain energy. A new one is one file and one line here."""

from __future__ import annotations

from ..core.errors import require_option
from .assumed import Assumed
from .base import COMPONENTS, Continuum, EnhancedContinuum, Formulation, StrainSplit, Term

#: The formulations by name.
FORMULATIONS = {cls.name: cls for cls in (Continuum, EnhancedContinuum, StrainSplit, Assumed)}


def get_formulation(formulation: str | Formulation | type[Formulation]) -> Formulation:
    """A :class:`Formulation` from its name, its class or itself; NameUnknown for another name."""
    if isinstance(formulation, Formulation):
        return formulation
    if isinstance(formulation, type) and issubclass(formulation, Formulation):
        return formulation()
    return FORMULATIONS[require_option("formulation", formulation, FORMULATIONS)]()


__all__ = ["COMPONENTS", "FORMULATIONS", "Assumed", "Continuum", "EnhancedContinuum",
           "Formulation", "StrainSplit", "Term", "get_formulation"]
