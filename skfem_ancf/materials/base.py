"""Interface of constitutive laws: energy, stress and moduli from the Green-Lagrange strain."""

from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import (Array, ArrayLike, Immutable, InputError, Law, along, gauss, is_builtin, rebuilt,
                    refuse, require_finite, require_finite_scalar, require_like, require_option,
                    require_positive, require_slope, shown)
from .library import values_of

if TYPE_CHECKING:
    from typing_extensions import Self


class Material(Immutable):
    """An isotropic hyperelastic material in plane stress or plane strain.

    A material is immutable; :meth:`replace` returns a changed copy. Strains and stresses are in the
    beam's frame (first index along the axis, second across the section):

    * strain: Green-Lagrange, ``(eps_xx, eps_yy, 2 eps_xy)``, shape (3, ...),
    * stress: second Piola-Kirchhoff, ``(S_xx, S_yy, S_xy)``, shape (3, ...).

    A user-defined law is a subclass that defines :meth:`energy` and :meth:`stress`, and
    :meth:`moduli` where the complex step of ``stress`` does not work; in plane stress also
    :meth:`thickness_stretch` if Cauchy stress is needed. It runs in NumPy; a
    :class:`~skfem_ancf.materials.pointwise.PointwiseMaterial` is compiled. A subclass of a law of
    the package that overrides ``stress`` alone gets the energy by integration of the stress along
    the strain from zero, and the moduli by the complex step. Raises InputError if a value is out of
    its range, NameUnknown if ``plane`` or ``shear_correction`` is a name that is not known.

    Parameters
    ----------
    E
        Young's modulus (force per area), positive: a number, or a function of material coordinates
        (x, y), the parameter of the axis and the distance from it. The energy is proportional to
        it.
    nu
        Poisson ratio, in (-1, 1/2), or 1/2 in plane stress.
    density
        Mass per volume, positive: a number or a function of (x, y);
        None if neither mass nor gravity is needed.
    plane
        "stress" or "strain".
    shear_correction
        "auto": ``10 (1 + nu) / (12 + 11 nu)`` where the section cannot represent the shear parabola
        (order 1, 2 and Patel-Shabana), else 1; for profiles and layers
        :func:`skfem_ancf.sections.across.shear_factor`. "paper": that number at every order. Or a
        positive number.
    thermal_expansion
        Strain per degree of temperature, see :meth:`skfem_ancf.Scene.temperature`.
    strength
        Stress that the material bears, for the field "utilisation" and :meth:`State.extremes
        <skfem_ancf.State.extremes>`: a positive number, with which the von Mises stress is
        compared, or a pair for the principal stresses in tension and compression (force per area).
    """

    #: The name of :meth:`named`, and that its values are typical; else "".
    title = ""

    def __init__(self, E: float, nu: float, density: float | None = None, plane: str = "stress",
                 shear_correction: str | float = "auto", thermal_expansion: float = 0.0,
                 strength: float | tuple[float, float] | None = None) -> None:
        self.E = _number_or_function("E", E)
        self.nu = require_finite_scalar("nu", nu)
        self.density = None if density is None else _number_or_function("density", density)
        self.plane = require_option("plane", plane, ("stress", "strain"))
        refuse(not (-1.0 < self.nu < 0.5 or (self.nu == 0.5 and plane == "stress")), "nu must lie "
               "in (-1, 0.5), or be 0.5 in plane stress, got {!r} in plane {}", nu, plane)
        self.shear_correction = (
            require_option("shear correction", shear_correction, ("auto", "paper"))
            if isinstance(shear_correction, str) else
            require_positive("shear_correction", shear_correction))
        self.thermal_expansion = require_finite_scalar("thermal_expansion", thermal_expansion)
        self.strength: float | tuple[float, float] | None = strength
        if strength is not None and np.ndim(strength) > 0:
            tension, compression = require_finite("strength", strength, (2,))
            self.strength = (require_positive("strength", tension),
                             require_positive("strength", compression))
        elif strength is not None:
            self.strength = require_positive("strength", strength)

    @classmethod
    def named(cls, name: str, units: tuple[str, str] = ("N", "m"), **changes: Any) -> "Self":
        """A material of this law with the values of a common one.

        E, nu, density, thermal expansion and strength (yield or proof stress) are those of
        :mod:`skfem_ancf.materials.library`: steels "S235", "S275", "S355", "S460", "1.4301",
        "spring steel"; "EN AW-6060 T66", "EN AW-6082 T6", "EN AW-7075 T6"; "brass", "Ti-6Al-4V";
        "POM", "PA 6", "PA 66 GF30", "PC", "ABS", "PP", "PETG", "PLA", "silicone". Those that are
        typical say so in :attr:`title`: ask the data sheet before you rely on them. Raises
        NameUnknown, InputError if the name, or the units, are not known.

        Parameters
        ----------
        name
            The name.
        units
            Units of force and length, as of :meth:`Scene.units <skfem_ancf.Scene.units>`; the
            density is that of time in seconds.
        **changes
            Other arguments of the law, which replace those of the name.

        Examples
        --------
        >>> from skfem_ancf import StVenantKirchhoff
        >>> steel = StVenantKirchhoff.named("S235", ("N", "mm"))
        >>> round(steel.E), round(steel.strength), round(steel.density, 12), steel.title
        (210000, 235, 7.85e-09, 'S235')
        >>> StVenantKirchhoff.named("POM").title
        'POM, typical values'
        """
        values, title = values_of(name, units)
        made = cls(**{**values, **changes})
        vars(made)["title"] = title if not changes.keys() & values.keys() else ""
        return made

    @property
    def graded(self) -> bool:
        """True if the modulus or the density is a function of material coordinates."""
        return callable(self.E) or callable(self.density)

    def reference(self) -> "tuple[Material, Callable[..., Any] | None]":
        """The material with E = 1, and the function E(x, y); ``(self, None)`` for a number E."""
        return (self.replace(E=1.0), self.E) if callable(self.E) else (self, None)

    @property
    def G(self) -> float:
        """Shear modulus E / (2 (1 + nu))."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def axial_modulus(self) -> float:
        """Uniaxial modulus: E, or E / (1 - nu^2) in plane strain."""
        return self.E / (1.0 if self.plane == "stress" else 1.0 - self.nu**2)

    @property
    def lateral_ratio(self) -> float:
        """Ratio of lateral contraction to axial strain: nu, or nu / (1 - nu) in plane strain."""
        return self.nu / (1.0 if self.plane == "stress" else 1.0 - self.nu)

    def shear_factor(self, element: Any) -> float:
        """Factor k_s on the shear modulus for sections of an element."""
        require_like("element", element, "beam element", "carries_shear_parabola")
        if isinstance(self.shear_correction, float):
            return self.shear_correction
        rectangle = 10.0 * (1.0 + self.nu) / (12.0 + 11.0 * self.nu)
        shape = getattr(element, "shear", None)
        if self.shear_correction == "auto" and shape is not None:
            return shape if element.carries_shear_parabola else 1.2 * rectangle * shape
        if self.shear_correction == "auto" and element.carries_shear_parabola:
            return 1.0
        return rectangle

    def replace(self, **changes: Any) -> "Material":
        """A copy with changed constructor arguments, as ``replace(E=2e8)``.

        Raises NameUnknown if an argument is not known.

        Examples
        --------
        >>> from skfem_ancf import StVenantKirchhoff
        >>> StVenantKirchhoff(E=1.0, nu=0.3).replace(E=2.0).E
        2.0
        """
        return rebuilt(self, changes, ("E", "nu", "density", "plane", "shear_correction",
                                       "thermal_expansion", "strength"))

    def law(self, k_s: float = 1.0) -> Law:
        """The law with corrected shear, as a function of (eps_xx, eps_yy, sqrt(k_s) 2 eps_xy)."""
        k_s = require_positive("k_s", k_s)
        self._require_number()
        refuse(not self._fits("stress", "energy"), "{} overrides energy and not stress(strain), "
               "its derivative", type(self).__name__)
        law = self if self._fits("energy") and self._fits("moduli") else OverriddenLaw(self)
        corrected = law if k_s == 1.0 else ShearCorrected(law, k_s)
        if is_builtin(self):
            return corrected
        kind = type(self).__name__
        E, d = np.array([[1.3e-3], [-0.7e-3], [0.9e-3]]), np.array([[1e-6], [0.7e-6], [-1.6e-6]])
        try:
            stress = along(lambda s: law.stress(E + s * d))
            energy = along(lambda s: law.energy(E + s * d))
            D, D0 = (np.asarray(law.moduli(strain)) for strain in (E, 0.0 * E))
        except NotImplementedError:
            raise InputError(f"{kind} must define energy(strain) and stress(strain)") from None
        except TypeError:
            raise InputError(f"{kind}: the derivative of stress cannot be found by the complex "
                             "step: define moduli(strain), too") from None
        for moduli, name in ((D, "moduli(strain)"),
                             (D.swapaxes(0, 1), "moduli(strain), transposed,")):
            require_slope(f"{name} of {kind}", "stress(strain)", stress,
                          np.einsum("ij...,j...->i...", moduli, d))
        require_slope(f"stress(strain) of {kind}", "energy(strain)", energy,
                      np.sum(stress[1] * d, axis=0))
        lowest, *_, highest = np.linalg.eigvalsh(D0.reshape(3, 3, -1)[..., 0])
        refuse(lowest < -1e-6 * abs(highest), "moduli(strain) of {} at zero strain must not be "
               "negative, got the eigenvalue {:.6g}", kind, lowest)
        return corrected

    def _require_number(self):
        refuse(callable(self.E), "the modulus E of {!r} varies: use replace(E=number)", self)

    def _fits(self, name, other="stress"):
        """False if a subclass of the class that defines ``name`` overrides ``other``."""
        def depth(name):
            return next(k for k, cls in enumerate(type(self).__mro__) if name in vars(cls))

        return vars(Material)[name] is getattr(type(self), name) or depth(name) <= depth(other)

    @property
    def is_hooke(self) -> bool:
        """True if the law is Hooke's of E and nu, in Green-Lagrange strain."""
        law, D = self.law(), hooke(self.E, self.nu, self.plane)
        return isinstance(law, LinearLaw) and bool(np.all(
            np.abs(law.D - D) <= 1e-9 * (np.abs(D) + D[0, 0])))

    @property
    def lame(self) -> float:
        """Lame's first parameter, unbounded as nu goes to 1/2."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))

    def volumetric_split(self, k_s: float = 1.0) -> tuple[Law, Law] | None:
        """:meth:`law` as a sum of a part with the shear modulus and a part with Lame's parameter.

        The formulation "assumed" integrates the second with fewer points, against volumetric
        locking. The first part must be positive definite at every strain. None if there is no such
        split.
        """
        return None

    def energy(self, strain: Array) -> Array:
        """Energy per volume of the reference configuration, shape (...)."""
        raise NotImplementedError

    def stress(self, strain: Array) -> Array:
        """Second Piola-Kirchhoff stress, shape (3, ...)."""
        raise NotImplementedError

    def moduli(self, strain: Array) -> Array:
        """Derivative of the stress with respect to ``strain``, shape (3, 3, ...)."""
        return stress_rates(self.stress, strain)

    def thickness_stretch(self, strain: Array) -> Array:
        """Stretch out of the plane, shape (...): 1 in plane strain. Needed for Cauchy stress."""
        if self.plane == "strain":
            return np.ones(np.shape(strain)[1:])
        raise InputError(f"{type(self).__name__} does not define thickness_stretch(strain), the "
                         "stretch out of the plane in plane stress")

    def stress_zz(self, strain: Array) -> Array:
        """Second Piola-Kirchhoff stress normal to the plane, shape (...): 0 in plane stress. Needed
        for von Mises and Tresca stress in plane strain."""
        if self.plane == "stress":
            return np.zeros(np.shape(strain)[1:])
        raise InputError(f"{type(self).__name__} does not define stress_zz(strain), the stress "
                         "normal to the plane in plane strain")

    def __repr__(self):
        E = shown(self.E) if callable(self.E) else f"{self.E:g}"
        title = f"{self.title!r}: " if self.title else ""
        return (f"{title}{type(self).__name__}(E={E}, nu={self.nu:g}, density={self.density}, "
                f"plane={self.plane!r}, shear_correction={self.shear_correction!r})")


def _number_or_function(name, value):
    """Check a positive number, or a function of material coordinates."""
    return value if callable(value) and not isinstance(value, type) else require_positive(
        name, value)


def stress_rates(stress: Callable[[Array], Array], strain: Array) -> Array:
    """Derivative (3, 3, ...) of a stress (3, ...) by the strain (3, ...), by complex steps."""
    strain, out = np.asarray(strain), []
    for j in range(3):
        step = np.zeros((3,) + (1,) * (strain.ndim - 1), dtype=complex)
        step[j] = 1e-30j
        out.append(np.imag(stress(strain + step)) / 1e-30)
    return np.stack(out, 1)


def hooke(E: float, nu: float, plane: str) -> Array:
    """Hooke's moduli (3, 3) for (eps_xx, eps_yy, 2 eps_xy); plane "stress" or "strain"."""
    if plane == "stress":
        a, b = E / (1.0 - nu**2), E * nu / (1.0 - nu**2)
    else:
        a = E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
        b = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return np.array([[a, b, 0.0], [b, a, 0.0], [0.0, 0.0, E / (2.0 * (1.0 + nu))]])


class ShearCorrected:
    """A law with the shear strain multiplied by sqrt(k_s), so that its shear modulus is k_s G."""

    def __init__(self, law: Law, k_s: float) -> None:
        self.base = law
        self.scale = np.array([1.0, 1.0, np.sqrt(k_s)])

    def _scaled(self, strain):
        return strain * self.scale.reshape((3,) + (1,) * (np.ndim(strain) - 1))

    def energy(self, strain: Array) -> Array:
        return self.base.energy(self._scaled(strain))

    def stress(self, strain: Array) -> Array:
        return self._scaled(self.base.stress(self._scaled(strain)))

    def moduli(self, strain: Array) -> Array:
        D = self.base.moduli(self._scaled(strain))
        return D * np.outer(self.scale, self.scale).reshape((3, 3) + (1,) * (D.ndim - 2))


class OverriddenLaw:
    """The law of a subclass that overrides ``stress`` alone. Its energy is ``int_0^1 strain .
    stress(x strain) dx`` by eight Gauss points. Its moduli are the complex step of the stress,
    unless the subclass overrides ``moduli``."""

    def __init__(self, material: Material) -> None:
        self.base, self.stress = material, material.stress
        self.energy = material.energy if material._fits("energy") else self._energy
        self.moduli = material.moduli if material._fits("moduli") else partial(
            Material.moduli, material)

    def _energy(self, strain):
        strain = np.asarray(strain)
        return sum(w * np.sum(strain * self.stress(x * strain), axis=0) for x, w in zip(*gauss(8)))


class LinearLaw:
    """Stress linear in the Green-Lagrange strain: S = D eps with a constant D of shape (3, 3)."""

    def __init__(self, D: ArrayLike) -> None:
        self.D = np.asarray(D)
        self._compliances: dict[tuple[int, ...], Array] = {}

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Components of the strain that cause stress."""
        return tuple(k for k, column in enumerate(self.D.T) if np.any(column))

    def compliance(self, rows: tuple[int, ...]) -> Array:
        """Inverse (n, n) of the moduli of consecutive components."""
        if rows not in self._compliances:
            part = slice(rows[0], rows[-1] + 1)
            self._compliances[rows] = np.linalg.inv(self.D[part, part])
        return self._compliances[rows]

    def energy(self, strain: Array) -> Array:
        return 0.5 * np.sum(strain * self.stress(strain), axis=0)

    def stress(self, strain: Array) -> Array:
        strain = np.asarray(strain)
        if strain.ndim == 1:
            return self.D @ strain
        return (self.D @ strain.reshape(3, -1)).reshape(strain.shape)

    def moduli(self, strain: Array) -> Array:
        shape = np.shape(strain)[1:]
        return np.broadcast_to(self.D.reshape((3, 3) + (1,) * len(shape)), (3, 3) + shape)
