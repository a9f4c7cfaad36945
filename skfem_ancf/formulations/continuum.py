"""Full integration: every strain component at every integration point."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.errors import require_like
from ..elements.base import ElementBeam
from ..materials.base import Material
from .base import Formulation, Term, refuse_rigid_sections


class Continuum(Formulation):
    """U = int W(eps) dV with the Green-Lagrange strain of the interpolated position.

    References
    ----------
    "A series of locking-free beam element models in absolute nodal coordinate formulation",
    Archive of Applied Mechanics (2024).
    """

    name = "continuum"

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        require_like("material", material, "Material", "law")
        require_like("element", element, "beam element", "strain_degree", "order")
        law = material.law(material.shear_factor(element))
        refuse_rigid_sections(element, material, law)
        return [Term(law, *self.full_rules(element, material))]
