"""St. Venant-Kirchhoff: stress linear in the Green-Lagrange strain."""

from typing import cast

import numpy as np

from ..core import Array, Law, require_positive
from .base import LinearLaw, Material, hooke


class StVenantKirchhoff(Material):
    """S = D eps with the energy 1/2 eps : D : eps per volume.

    Parameters and errors are those of :class:`~skfem_ancf.materials.base.Material`. See "A series
    of locking-free beam element models in absolute nodal coordinate formulation", Archive of
    Applied Mechanics (2024).

    Examples
    --------
    >>> from skfem_ancf import StVenantKirchhoff
    >>> StVenantKirchhoff(E=2e8, nu=0.3, plane="stress").D.round(-3).tolist()
    [[219780000.0, 65934000.0, 0.0], [65934000.0, 219780000.0, 0.0], [0.0, 0.0, 76923000.0]]
    """

    @property
    def D(self) -> Array:
        """Moduli without shear correction, shape (3, 3)."""
        self._require_number()
        return hooke(self.E, self.nu, self.plane)

    def law(self, k_s: float = 1.0) -> Law:
        cls, own = type(self), StVenantKirchhoff
        if (cls.energy is not own.energy or cls.stress is not own.stress
                or cls.moduli is not own.moduli):
            return super().law(k_s)  # a subclass with another law
        D = self.D
        D[2, 2] *= require_positive("k_s", k_s)
        return LinearLaw(D)

    @property
    def is_hooke(self) -> bool:
        return type(self) is StVenantKirchhoff or super().is_hooke

    def volumetric_split(self, k_s: float = 1.0) -> tuple[Law, Law] | None:
        # a subclass may have other moduli
        if type(self) is not StVenantKirchhoff or self.plane == "stress" or self.nu == 0.0:
            return None
        volumetric = self.lame * np.outer([1.0, 1.0, 0.0], [1.0, 1.0, 0.0])
        whole = cast("LinearLaw", self.law(k_s))
        return LinearLaw(whole.D - volumetric), LinearLaw(volumetric)

    def energy(self, strain: Array) -> Array:
        return LinearLaw(self.D).energy(strain)

    def stress(self, strain: Array) -> Array:
        return LinearLaw(self.D).stress(strain)

    def moduli(self, strain: Array) -> Array:
        return LinearLaw(self.D).moduli(strain)

    def thickness_stretch(self, strain: Array) -> Array:
        if self.plane == "strain" or not self._fits("thickness_stretch"):
            return super().thickness_stretch(strain)
        return np.sqrt(1.0 - 2.0 * self.nu / (1.0 - self.nu) * (strain[0] + strain[1]))

    def stress_zz(self, strain: Array) -> Array:
        if self.plane == "stress" or not self._fits("stress_zz"):
            return super().stress_zz(strain)
        S = self.stress(strain)
        return self.nu * (S[0] + S[1])
