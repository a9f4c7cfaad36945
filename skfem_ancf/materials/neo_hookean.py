"""Compressible neo-Hookean material."""

import numpy as np

from ..core import Array, Law, everywhere, primitive, refuse, source
from .pointwise import PointwiseMaterial


@primitive("skfem_ancf.core.loops")
def log1p(x):
    """ln (1 + x); NaN for x < -1."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log1p(x)


@source
def log_thickness(G, lame, log_det):
    """x = ln C_33 from ``G (C_33 - 1) + lambda ln J = 0`` (plane stress) by Newton's method."""
    x = 0.0 * log_det
    for _ in range(60):
        change = np.expm1(x)
        dx = ((G * change + 0.5 * lame * (log_det + x)) / (G * (change + 1.0) + 0.5 * lame))
        dx = np.maximum(dx, -1.0)  # convex: converges monotonically from above
        x = x - dx
        if everywhere(np.abs(dx) <= 1e-14 * (1e-14 + np.abs(x))):
            break
    return x


@source
def log_determinant(xx, yy, xy):
    """ln det C, accurate for small strains."""
    return log1p(2.0 * (xx + yy) + 4.0 * xx * yy - xy * xy)


@source
def neo_hookean(constants, xx, yy, xy):
    """W = G/2 (tr C - 3) - G ln J + lambda/2 (ln J)^2 and its derivatives."""
    # S = G (I - C^-1) + lambda ln J C^-1; the moduli are condensed with S_33 = 0 in plane stress.
    # Arguments are those of :class:`~skfem_ancf.materials.pointwise.PointwiseMaterial`.
    G, lame, plane_stress = constants[0], constants[1], constants[2]
    log_det = log_determinant(xx, yy, xy)
    x = log_thickness(G, lame, log_det) if plane_stress > 0.0 else 0.0 * log_det
    log_J, inverse = 0.5 * (log_det + x), np.exp(-log_det)
    a, b, c = (1.0 + 2.0 * yy) * inverse, (1.0 + 2.0 * xx) * inverse, -xy * inverse
    energy = (0.5 * G * (2.0 * (xx + yy) + np.expm1(x)) - G * log_J + 0.5 * lame * log_J * log_J)
    # det C (I - C^-1), written so that it vanishes without cancellation
    g, m = G * inverse, lame * log_J
    stress = (g * (2.0 * xx * (1.0 + 2.0 * yy) - xy * xy) + m * a,
              g * (2.0 * yy * (1.0 + 2.0 * xx) - xy * xy) + m * b, g * xy + m * c)
    m = G - lame * log_J
    # lambda, or 2 m lambda / (2 m + lambda) in plane stress
    part = 2.0 * m * plane_stress + 1.0 - plane_stress
    stiff = lame * part / (part + plane_stress * lame)
    both = stiff + 2.0 * m
    return energy, stress, (both * a * a, stiff * a * b + 2.0 * m * c * c, both * a * c,
                            both * b * b, both * b * c, stiff * c * c + m * (a * b + c * c))


class NeoHookean(PointwiseMaterial):
    """W = mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2.

    For small strains it agrees with Hooke's law of the same ``E`` and ``nu``. Unlike St.
    Venant-Kirchhoff it resists compression to zero volume. In plane stress S_33 = 0 determines the
    stretch out of the plane. Parameters and errors are those of
    :class:`~skfem_ancf.materials.base.Material`, except that ``nu`` is below 1/2. See Simo, Pister
    (1984); Bonet, Wood, "Nonlinear continuum mechanics for finite element analysis", 2nd ed.
    (2008), section 6.4.3.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import NeoHookean
    >>> law = NeoHookean(E=1.0, nu=0.3)
    >>> float(round(law.stress(np.array([1e-9, 0.0, 0.0]))[0] / 1e-9, 6))  # 1 / (1 - nu^2)
    1.098901
    """

    point = staticmethod(neo_hookean)

    def __init__(self, E: float, nu: float, density: float | None = None, plane: str = "stress",
                 shear_correction: str | float = "auto", thermal_expansion: float = 0.0,
                 strength: float | tuple[float, float] | None = None) -> None:
        super().__init__(E, nu, density, plane, shear_correction, thermal_expansion, strength)
        refuse(self.nu == 0.5, "the compressible neo-Hookean law needs nu below 0.5, got 0.5")

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
        log_det = log_determinant(*np.real(strain))
        if self.plane != "stress":
            return np.ones_like(log_det)
        return np.exp(0.5 * log_thickness(self.G, self.lame, log_det))

    def stress_zz(self, strain: Array) -> Array:
        if self.plane == "stress" or not self._fits("stress_zz"):
            return super().stress_zz(strain)
        d = 2.0 * (strain[0] + strain[1]) + 4.0 * strain[0] * strain[1] - strain[2] ** 2
        return 0.5 * self.lame * np.log1p(d)  # lambda ln J, and C_33 = 1


class _Volumetric(NeoHookean):
    """lambda/2 (ln J)^2 alone."""

    G = 0.0
