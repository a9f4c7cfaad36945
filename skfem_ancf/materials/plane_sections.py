"""The law of beams that are given by stiffnesses: sections stay plane and keep their size."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import Array, source
from .pointwise import PointwiseMaterial

#: Stiffness of the thickness over E.
THICKNESS = 1e4


@source
def plane_sections(constants, xx, yy, xy):
    """W = E/2 (a - 1)^2 + G/2 g^2 + K/2 eps_yy^2 and its derivatives."""
    # With the axial derivative f of the position and the unit vector n along the section, a is the
    # part of f normal to n, and g = f . n. In terms of the strain g^2 = (2 eps_xy)^2 / C_22 and a^2
    # = C_11 - g^2. Arguments are those of
    # :class:`~skfem_ancf.materials.pointwise.PointwiseMaterial`.
    E, G, K = constants[0], constants[1], constants[2]
    across = 1.0 / (1.0 + 2.0 * yy)
    slide = across * xy  # half the derivative of g^2 by 2 eps_xy
    square = slide * xy  # g^2
    change = 2.0 * xx - square  # a^2 - 1
    a = np.sqrt(1.0 + change)
    longer = change / (1.0 + a)
    p, r = 0.5 * E * longer / a, 0.25 * E / (a * a * a)  # derivatives by a^2
    m, b, c = 0.5 * G - p, 2.0 * square * across, -2.0 * slide
    energy = 0.5 * (E * longer * longer + G * square + K * yy * yy)
    return energy, (2.0 * p, K * yy - m * b, -m * c), (
        4.0 * r, 2.0 * r * b, 2.0 * r * c, r * b * b + 4.0 * m * b * across + K,
        r * b * c + 2.0 * m * c * across, r * c * c + 2.0 * m * across)


class PlaneSections(PointwiseMaterial):
    """The geometrically exact beam of one point of its section (Reissner: "On one-dimensional
    finite-strain beam theory: the plane problem", Z. angew. Math. Phys. 23 (1972); Simo). The axial
    stress is E times the stretch normal to the section minus one, the shear stress is ``shear``
    times the derivative of the position within the section. Both are linear in the strains of
    Reissner's beam for sections that stay plane and keep their size, which a large stiffness holds:
    with a curvature kappa its change is ``EI kappa^2 / (1e4 EA)``."""

    point = staticmethod(plane_sections)
    #: Hooke's law for the small strains of a cable.
    is_hooke = True

    def __init__(self, E: float, shear: float, density: float | None = None) -> None:
        super().__init__(E, 0.0, density)
        self.shear = shear

    @property
    def G(self) -> float:
        return self.shear

    @property
    def constants(self) -> Array:
        """E, the shear modulus, and the stiffness of the thickness."""
        return np.array([self.E, self.shear, THICKNESS * self.E])

    def shear_factor(self, element: Any) -> float:
        return 1.0
