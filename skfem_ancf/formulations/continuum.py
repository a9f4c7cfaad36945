"""Full integration, with and without enhancements against Poisson locking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError, require_like
from ..core.types import Array
from ..elements.base import ElementBeam
from ..materials import LinearLaw
from ..materials.base import Material
from ..materials.history import AtRest
from .base import Formulation, Term, refuse_rigid_sections

# enhanced continuum mechanics: the Poisson coupling acts on the axis only

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


# the strain split method: Poisson coupling of the axial strain only

class StrainSplit(EnhancedContinuum):
    """eps = a + s with a = eps(X, 0): stress D a + diag(E, E, k_s G) s.

    The energy is 1/2 int (a : D : a + 2 a : D : s + s : D_0 : s) dV with
    D_0 = diag(E, E, k_s G). Its derivative by s is the stress of the method. Its derivative by a is
    D (a + s) instead of the same stress: the difference, the Poisson coupling of the mean of s, is
    of second order and makes the tangent symmetric. With D_0 in the middle term it would be "ecm".

    References
    ----------
    Patel, Shabana: "Locking alleviation in the large displacement analysis of beam elements:
    the strain split method", Acta Mechanica 229 (2018).
    """

    name = "strain-split"

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        axis, section = self.full_rules(element)
        uncoupled, coupling = split_moduli(self.name, material, element)
        if not np.any(coupling):
            return [Term(LinearLaw(uncoupled), axis, section)]
        eta, w = section
        # a : C : s + 1/2 a : C : a = 1/2 m : C : m - 1/2 (m - a) : C : (m - a), m the mean
        mean = (eta, w[None])
        places, of = np.unique(np.append(eta, 0.5), return_inverse=True)
        rest = (places, np.bincount(of, np.append(w, -1.0))[None])
        return [Term(LinearLaw(uncoupled), axis, section),
                Term(LinearLaw(coupling), axis, AXIS, section_samples=mean),
                Term(LinearLaw(-coupling), axis, AXIS, section_samples=rest)]
