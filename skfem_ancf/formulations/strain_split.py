"""The strain split method: Poisson coupling of the axial strain only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..elements.base import ElementBeam
from ..materials import LinearLaw
from ..materials.base import Material
from .base import Term
from .ecm import AXIS, EnhancedContinuum, split_moduli


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
