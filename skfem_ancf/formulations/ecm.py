"""Enhanced continuum mechanics: the Poisson coupling acts on the axis only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError, require_like
from ..core.types import Array
from ..elements.base import ElementBeam
from ..materials import LinearLaw
from ..materials.base import Material
from ..materials.history import AtRest
from .base import Formulation, Term

#: The rule across the section that is the axis alone, with the weight of the whole section.
AXIS = (np.array([0.5]), np.array([1.0]))


def split_moduli(name: str, material: Material, element: ElementBeam) -> tuple[Array, Array]:
    """Moduli diag(E, E, k_s G) without Poisson coupling, and the rest of D, (3, 3) both."""
    require_like("material", material, "Material", "law")
    law = material.law(material.shear_factor(element))
    if not isinstance(law, LinearLaw) or isinstance(law, AtRest):
        raise InputError(
            f"formulation {name!r} needs constant moduli, which {type(material).__name__} does not "
            "have: use StVenantKirchhoff, or another formulation")
    uncoupled = np.diag([material.E, material.E, law.D[2, 2]])
    return uncoupled, law.D - uncoupled


class EnhancedContinuum(Formulation):
    """U = 1/2 int eps : diag(E, E, k_s G) : eps dV + 1/2 int eps : (D - diag(E, E)) : eps h b dX.

    The second integral is over the axis. This avoids Poisson locking of sections without linear
    thickness strain, as those of order 1.

    References
    ----------
    Gerstmayr, Matikainen, Mikkola: "A geometrically exact beam element based on the absolute
    nodal coordinate formulation", Multibody System Dynamics 20 (2008), for the split.
    """

    name = "ecm"

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        axis, section = self.full_rules(element)
        uncoupled, coupling = split_moduli(self.name, material, element)
        terms = [Term(LinearLaw(uncoupled), axis, section)]
        if np.any(coupling):  # not at nu = 0 in plane stress
            terms.append(Term(LinearLaw(coupling), axis, AXIS))
        return terms
