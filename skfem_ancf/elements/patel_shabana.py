"""The element of Patel and Shabana."""

from __future__ import annotations

import numpy as np

from ..core.origin import ours
from .ancf import ElementBeamANCF
from .base import ElementBeam, SectionFunctions


class ElementBeamPatelShabana(ElementBeam):
    """Beam element with ``r``, ``r_X``, ``r_Y`` and ``r_YY`` on the axis.

    Its space is that of :class:`ElementBeamANCF` of order 2, with other degrees of freedom.

    References
    ----------
    Patel, Shabana: "Locking alleviation in the large displacement analysis of beam elements:
    the strain split method", Acta Mechanica 229 (2018).

    Examples
    --------
    >>> from skfem_ancf import ElementBeamPatelShabana
    >>> ElementBeamPatelShabana().dofnames
    ['r', 'r_X', 'r_Y', 'r_YY']
    """

    def __init__(self) -> None:
        # P' = 1 for r_Y, and P' = eta for h r_YY: legendre coefficients in 2 eta
        super().__init__(SectionFunctions(np.array([[1.0, 0.0], [0.0, 0.5]])),
                         ["r_Y", "r_YY"], [(0.0, 0, 1), (0.0, 0, 2)], ["r_Y", "r_YY"])

    def plane(self) -> ElementBeam | None:
        return ElementBeamANCF(1) if ours(self) else None
