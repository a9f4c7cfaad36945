"""Compressible neo-Hookean material."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import InputError
from ..core.source import lanes, primitive, source
from .text import TextMaterial

if TYPE_CHECKING:
    from ..core.types import Array, Law


@primitive("skfem_ancf.core.loops")
def log1p(x):
    """ln (1 + x), not a number where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log1p(x)


@source
def neo_hookean(constants: Array, strain: Array, out: Array) -> None:
    """W = G/2 (tr C - 3) - G ln J + lambda/2 (ln J)^2 and its derivatives.

    S = G (I - C^-1) + lambda ln J C^-1; the moduli are condensed with S_33 = 0 in plane stress.

    Parameters
    ----------
    constants
        :attr:`NeoHookean.constants`, shape (3,).
    strain
        Shape (3, n, elements).
    out
        The stress, if of shape (3, n, elements); the moduli (9, ...), the energy (1, ...), or
        ln det C and ln C_33, (2, ...).
    """
    G, lame, plane_stress = constants
    n, size = strain.shape[1], strain.shape[2]
    log_det, x = np.empty((n, size), strain.dtype), np.empty((n, size), strain.dtype)
    for p in lanes(n):
        for e in lanes(size):
            # det C = 1 + ...: log1p keeps the digits of small strains
            log_det[p, e] = log1p(2.0 * (strain[0, p, e] + strain[1, p, e])
                                  + 4.0 * strain[0, p, e] * strain[1, p, e]
                                  - strain[2, p, e] * strain[2, p, e])
            x[p, e] = 0.0 * log_det[p, e]
    moved = np.ones((n, size), np.bool_)
    for k in range(60):  # x = ln C_33: G (C_33 - 1) + lambda ln J = 0, by Newton
        if plane_stress == 0.0 or not np.any(moved):
            break
        for p in lanes(n):
            for e in lanes(size):
                change = np.expm1(x[p, e])
                dx = ((G * change + 0.5 * lame * (log_det[p, e] + x[p, e]))
                      / (G * (change + 1.0) + 0.5 * lame))
                dx = np.maximum(dx, -1.0)  # convex: from above it comes down by itself
                x[p, e] -= dx
                moved[p, e] = np.abs(dx) > 1e-14 * (1e-14 + np.abs(x[p, e]))
    for p in lanes(n):
        for e in lanes(size):
            E1, E2, C12 = strain[0, p, e], strain[1, p, e], strain[2, p, e]
            log_J = 0.5 * (log_det[p, e] + x[p, e])
            inverse = np.exp(-log_det[p, e])
            a, b, c = (1.0 + 2.0 * E2) * inverse, (1.0 + 2.0 * E1) * inverse, -C12 * inverse
            if len(out) == 3:
                # det C (I - C^-1), written so that it vanishes without cancellation
                g, m = G * inverse, lame * log_J
                out[0, p, e] = g * (2.0 * E1 * (1.0 + 2.0 * E2) - C12 * C12) + m * a
                out[1, p, e] = g * (2.0 * E2 * (1.0 + 2.0 * E1) - C12 * C12) + m * b
                out[2, p, e] = g * C12 + m * c
            elif len(out) == 9:
                m = G - lame * log_J
                # lambda, or 2 m lambda / (2 m + lambda) in plane stress
                part = 2.0 * m * plane_stress + 1.0 - plane_stress
                stiff = lame * part / (part + plane_stress * lame)
                out[0, p, e], out[4, p, e] = (stiff + 2 * m) * a * a, (stiff + 2 * m) * b * b
                out[8, p, e] = stiff * c * c + m * (a * b + c * c)
                out[1, p, e] = out[3, p, e] = stiff * a * b + 2 * m * c * c
                out[2, p, e] = out[6, p, e] = (stiff + 2 * m) * a * c
                out[5, p, e] = out[7, p, e] = (stiff + 2 * m) * b * c
            elif len(out) == 1:
                trace = 2.0 * (E1 + E2) + np.expm1(x[p, e])
                out[0, p, e] = 0.5 * G * trace - G * log_J + 0.5 * lame * log_J * log_J
            else:
                out[0, p, e], out[1, p, e] = log_det[p, e], x[p, e]


class NeoHookean(TextMaterial):
    """W = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2.

    For small strains it agrees with Hooke's law of the same ``E`` and ``nu``. Unlike
    St. Venant-Kirchhoff it resists compression to zero volume. In plane stress the stretch out
    of the plane follows from S_33 = 0. Parameters and errors are those of
    :class:`~skfem_ancf.materials.base.Material`, except that ``nu`` stays below 1/2.

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

    text = staticmethod(neo_hookean)

    def __init__(self, E: float, nu: float, density: float | None = None, plane: str = "stress",
                 shear_correction: str | float = "auto", thermal_expansion: float = 0.0) -> None:
        super().__init__(E, nu, density, plane, shear_correction, thermal_expansion)
        if self.nu == 0.5:
            raise InputError("the compressible neo-Hookean law needs nu below 0.5, got 0.5")

    def volumetric_split(self, k_s: float = 1.0) -> tuple[Law, Law] | None:
        # a subclass may have changed the law
        if type(self) is not NeoHookean or self.plane == "stress" or self.nu == 0.0:
            return None
        rest = NeoHookean(2.0 * self.G, 0.0, plane=self.plane)
        return rest.law(k_s), _Volumetric(self.E, self.nu, plane=self.plane).law(k_s)

    @property
    def constants(self) -> Array:
        """Shear modulus, Lame's first parameter, and 1 in plane stress."""
        return np.array([self.G, self.lame, float(self.plane == "stress")])

    def thickness_stretch(self, strain: Array) -> Array:
        if not self._fits("thickness_stretch"):
            return super().thickness_stretch(strain)
        return np.exp(0.5 * self.evaluated(np.real(strain), 2)[1])

    def stress_zz(self, strain: Array) -> Array:
        if self.plane == "stress" or not self._fits("stress_zz"):
            return super().stress_zz(strain)
        d = 2.0 * (strain[0] + strain[1]) + 4.0 * strain[0] * strain[1] - strain[2] ** 2
        return 0.5 * self.lame * np.log1p(d)  # lambda ln J, and C_33 = 1


class _Volumetric(NeoHookean):
    """lambda/2 (ln J)^2 alone."""

    G = 0.0
