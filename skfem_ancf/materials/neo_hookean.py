"""Compressible neo-Hookean material."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, taught
from ..source import lanes, primitive, source
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

    @property
    def has_texts(self) -> bool:
        """True if the texts of this module are its energy, stress and moduli."""
        return all(getattr(type(self), name) is getattr(NeoHookean, name)
                   for name in ("energy", "stress", "moduli"))

    def energy(self, strain: Array) -> Array:
        return _evaluated(neo_hookean_energy, self, strain, ())

    def stress(self, strain: Array) -> Array:
        return _evaluated(neo_hookean_stress, self, strain, (3,))

    def moduli(self, strain: Array) -> Array:
        return _evaluated(neo_hookean_moduli, self, strain, (3, 3))

    def thickness_stretch(self, strain: Array) -> Array:
        if not self._fits("thickness_stretch"):
            return super().thickness_stretch(strain)
        return np.exp(0.5 * _evaluated(_thickness, self, np.real(strain), ()))

    def stress_zz(self, strain: Array) -> Array:
        if self.plane == "stress" or not self._fits("stress_zz"):
            return super().stress_zz(strain)
        d = 2.0 * (strain[0] + strain[1]) + 4.0 * strain[0] * strain[1] - strain[2] ** 2
        return 0.5 * self.lame * np.log1p(d)  # lambda ln J, and C_33 = 1


class _Volumetric(NeoHookean):
    """lambda/2 (ln J)^2 alone."""

    G = 0.0


# the texts: strains (3, n, elements) and constants as neo_hookean_constants gives them


def neo_hookean_constants(law):
    """Shear modulus, Lame's first parameter, and 1 in plane stress."""
    return np.array([law.G, law.lame, float(law.plane == "stress")])


def _evaluated(text, law, strain, shape):
    """What a text gives for strains of any shape (3, ...)."""
    strain = np.asarray(strain)
    strain = strain.astype(np.result_type(strain, float), copy=False)
    out = np.empty(shape + (1, strain[0].size), strain.dtype)
    text(neo_hookean_constants(law), strain.reshape(3, 1, -1), out)
    return out.reshape(shape + strain.shape[1:])


@primitive("primitives")
def log1p(x):
    """ln (1 + x), not a number where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log1p(x)


@source
def _logarithms(constants, strain, log_det, x):
    """ln det C in the plane, and x = ln C_33."""
    G, lame, plane_stress = constants
    for p in lanes(strain.shape[1]):
        for e in lanes(strain.shape[2]):
            # det C = 1 + ...: log1p keeps the digits of small strains
            log_det[p, e] = log1p(2.0 * (strain[0, p, e] + strain[1, p, e])
                                  + 4.0 * strain[0, p, e] * strain[1, p, e]
                                  - strain[2, p, e] * strain[2, p, e])
            x[p, e] = 0.0 * log_det[p, e]
    if plane_stress == 0.0:
        return
    moved = np.empty(x.shape, np.bool_)
    for _ in range(60):  # G (C_33 - 1) + lambda ln J = 0, by Newton
        for p in lanes(x.shape[0]):
            for e in lanes(x.shape[1]):
                change = np.expm1(x[p, e])
                dx = ((G * change + 0.5 * lame * (log_det[p, e] + x[p, e]))
                      / (G * (change + 1.0) + 0.5 * lame))
                dx = dx / np.maximum(1.0, np.abs(dx))
                x[p, e] -= dx
                moved[p, e] = np.abs(dx) > 1e-14 * (1e-14 + np.abs(x[p, e]))
        if not np.any(moved):
            return


@source
def _thickness(constants, strain, x):
    """ln C_33."""
    _logarithms(constants, strain, np.empty(x.shape, x.dtype), x)


@source
def neo_hookean_energy(constants, strain, W):
    """W = G/2 (tr C - 3) - G ln J + lambda/2 (ln J)^2."""
    G, lame = constants[0], constants[1]
    log_det, x = np.empty(W.shape, W.dtype), np.empty(W.shape, W.dtype)
    _logarithms(constants, strain, log_det, x)
    for p in lanes(W.shape[0]):
        for e in lanes(W.shape[1]):
            log_J = 0.5 * (log_det[p, e] + x[p, e])
            trace = 2.0 * (strain[0, p, e] + strain[1, p, e]) + np.expm1(x[p, e])
            W[p, e] = 0.5 * G * trace - G * log_J + 0.5 * lame * log_J * log_J


@source
def neo_hookean_stress(constants, strain, S):
    """S = G (I - C^-1) + lambda ln J C^-1."""
    G, lame = constants[0], constants[1]
    log_det, x = np.empty(S[0].shape, S.dtype), np.empty(S[0].shape, S.dtype)
    _logarithms(constants, strain, log_det, x)
    for p in lanes(S.shape[1]):
        for e in lanes(S.shape[2]):
            E1, E2, C12 = strain[0, p, e], strain[1, p, e], strain[2, p, e]
            inverse = np.exp(-log_det[p, e])
            g, m = G * inverse, 0.5 * lame * (log_det[p, e] + x[p, e]) * inverse
            C11, C22 = 1.0 + 2.0 * E1, 1.0 + 2.0 * E2
            # det C (I - C^-1), written so that it vanishes without cancellation
            S[0, p, e] = g * (2.0 * E1 * C22 - C12 * C12) + m * C22
            S[1, p, e] = g * (2.0 * E2 * C11 - C12 * C12) + m * C11
            S[2, p, e] = (g - m) * C12


@source
def neo_hookean_moduli(constants, strain, D):
    """The derivative of the stress, condensed with S_33 = 0 in plane stress."""
    G, lame, plane_stress = constants
    shape = strain[0].shape
    log_det, x = np.empty(shape, strain.dtype), np.empty(shape, strain.dtype)
    _logarithms(constants, strain, log_det, x)
    for p in lanes(shape[0]):
        for e in lanes(shape[1]):
            inverse = np.exp(-log_det[p, e])
            a, b = (1.0 + 2.0 * strain[1, p, e]) * inverse, (1.0 + 2.0 * strain[0, p, e]) * inverse
            c = -strain[2, p, e] * inverse
            m = G - 0.5 * lame * (log_det[p, e] + x[p, e])
            # lambda, or 2 m lambda / (2 m + lambda) in plane stress
            part = 2.0 * m * plane_stress + 1.0 - plane_stress
            stiff = lame * part / (part + plane_stress * lame)
            D[0, 0, p, e], D[1, 1, p, e] = (stiff + 2 * m) * a * a, (stiff + 2 * m) * b * b
            D[2, 2, p, e] = stiff * c * c + m * (a * b + c * c)
            D[0, 1, p, e] = D[1, 0, p, e] = stiff * a * b + 2 * m * c * c
            D[0, 2, p, e] = D[2, 0, p, e] = (stiff + 2 * m) * a * c
            D[1, 2, p, e] = D[2, 1, p, e] = (stiff + 2 * m) * b * c
