"""Compressible neo-Hookean material."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, taught
from .base import Material

if TYPE_CHECKING:
    from ..types import Array, Law


class NeoHookean(Material):
    """W = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2.

    For small strains it agrees with Hooke's law of the same ``E`` and ``nu``. Unlike
    St. Venant-Kirchhoff it resists compression to zero volume. In plane stress the stretch out
    of the plane follows from S_33 = 0. Parameters and errors are those of
    :class:`~skfem_ancf.materials.base.Material`, except that ``nu`` stays below 1/2.

    Parameters
    ----------
    E
        Young's modulus (force per area), positive.
    nu
        Poisson ratio, in (-1, 1/2).
    density
        Mass per volume in the stress-free state, positive, or None.
    plane
        "stress" or "strain".
    shear_correction
        "auto", "paper" or a positive number, see :class:`~skfem_ancf.materials.base.Material`.

    References
    ----------
    Simo, Pister (1984); Bonet, Wood, "Nonlinear continuum mechanics for finite element
    analysis", 2nd ed. (2008), section 6.4.3.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import NeoHookean
    >>> law = NeoHookean(E=1.0, nu=0.3)
    >>> float(round(law.stress(np.array([1e-9, 0.0, 0.0]))[0] / 1e-9, 6))  # 1 / (1 - nu^2)
    1.098901
    """

    @taught
    def __init__(self, E: float, nu: float, density: float | None = None, plane: str = "stress",
                 shear_correction: str | float = "auto") -> None:
        super().__init__(E, nu, density, plane, shear_correction)
        if self.nu == 0.5:
            raise InputError("the compressible neo-Hookean law needs nu below 0.5, got 0.5")

    def volumetric_split(self, k_s: float = 1.0) -> tuple[Law, Law] | None:
        # a subclass may have changed the law
        if type(self) is not NeoHookean or self.plane == "stress" or self.nu == 0.0:
            return None
        rest = NeoHookean(2.0 * self.G, 0.0, plane=self.plane)
        return rest.law(k_s), _Volumetric(self.E, self.nu, plane=self.plane).law(k_s)

    def _state(self, strain):
        """C_11, C_22, C_12, ln det C and ln C_33."""
        C11, C22, C12 = 1.0 + 2.0 * strain[0], 1.0 + 2.0 * strain[1], strain[2]
        # det C = 1 + d: log1p keeps the digits of small strains
        d = 2.0 * (strain[0] + strain[1]) + 4.0 * strain[0] * strain[1] - strain[2] ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            log_det = np.log1p(d)
        x = np.zeros_like(log_det)
        if self.plane == "stress":  # mu (C_33 - 1) + lambda ln J = 0 for x = ln C_33, by Newton
            for _ in range(60):
                g = self.G * np.expm1(x) + 0.5 * self.lame * (log_det + x)
                dx = g / (self.G * np.exp(x) + 0.5 * self.lame)
                x = x - np.clip(dx.real, -1.0, 1.0) - (1j * dx.imag if np.iscomplexobj(dx) else 0.0)
                if not np.any(np.abs(dx) > 1e-14 * (1e-14 + np.abs(x))):
                    break
        return C11, C22, C12, log_det, x

    def energy(self, strain: Array) -> Array:
        _, _, _, log_det, x = self._state(strain)
        log_J = 0.5 * (log_det + x)
        with np.errstate(invalid="ignore"):
            trace = 2.0 * (strain[0] + strain[1]) + np.expm1(x)
        return 0.5 * self.G * trace - self.G * log_J + 0.5 * self.lame * log_J**2

    @staticmethod
    def _inverse(C11, C22, C12, log_det):
        return np.array([C22, C11, -C12]) * np.exp(-log_det)

    def stress(self, strain: Array) -> Array:
        C11, C22, C12, log_det, x = self._state(strain)
        c = self._inverse(C11, C22, C12, log_det)
        # det C (I - C^-1), written so that it vanishes without cancellation
        change = np.array([2 * strain[0] * C22 - C12**2, 2 * strain[1] * C11 - C12**2, C12])
        return self.G * change * np.exp(-log_det) + 0.5 * self.lame * (log_det + x) * c

    def moduli(self, strain: Array) -> Array:
        C11, C22, C12, log_det, x = self._state(strain)
        a, b, c = self._inverse(C11, C22, C12, log_det)
        lame, m = self.lame, self.G - 0.5 * self.lame * (log_det + x)
        if self.plane == "stress":  # condensed with S_33 = 0
            lame = 2.0 * m * lame / (lame + 2.0 * m)
        xx, yy, xy = (lame + 2 * m) * a * a, (lame + 2 * m) * b * b, lame * a * b + 2 * m * c * c
        xs, ys = (lame + 2 * m) * a * c, (lame + 2 * m) * b * c
        return np.array([[xx, xy, xs], [xy, yy, ys],
                         [xs, ys, lame * c * c + m * (a * b + c * c)]])

    def thickness_stretch(self, strain: Array) -> Array:
        if not self._fits("thickness_stretch"):
            return super().thickness_stretch(strain)
        return np.exp(0.5 * self._state(strain)[4].real)


class _Volumetric(NeoHookean):
    """lambda/2 (ln J)^2 alone."""

    G = 0.0
