"""Von Mises plasticity with isotropic and kinematic hardening."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import (Array, ArrayLike, Immutable, refuse, require_finite, require_not_negative,
                    require_positive)
from .history import ACROSS, HistoryMaterial
from .library import values_of
from .return_mapping import FUNCTIONS, hardened

if TYPE_CHECKING:
    from typing_extensions import Self

#: History variables of a point.
VARIABLES = {"plastic_strain": 3, "back_stress": 3, "accumulated": 1}


class Voce(Immutable):
    """Isotropic hardening that saturates: ``saturation (1 - exp(-rate p)) + linear p``.

    p is the accumulated plastic strain; it is added to the yield stress.

    Parameters
    ----------
    saturation, linear
        Stress, and slope of the stress; zero or positive.
    rate
        Zero or positive.

    Examples
    --------
    >>> from skfem_ancf import ElasticPlastic, Voce
    >>> law = ElasticPlastic(2e11, 0.3, 2.5e8, hardening=Voce(1e8, 20.0))
    >>> [float(law.yield_at(p).round(-6)) for p in (0.0, 10.0)]
    [250000000.0, 350000000.0]
    """

    def __init__(self, saturation: float, rate: float, linear: float = 0.0) -> None:
        self.saturation = require_not_negative("saturation", saturation, False)
        self.rate = require_not_negative("rate", rate, False)
        self.linear = require_not_negative("linear", linear, False)

    def __iter__(self) -> Iterator[float]:
        return iter((self.saturation, self.rate, self.linear))

    def __repr__(self) -> str:
        return "Voce({:g}, {:g}, {:g})".format(*self)


def _by_plane(k: int) -> Any:
    def function(self: Any) -> Any:
        """One of :data:`FUNCTIONS`."""
        return FUNCTIONS[self.plane][k]

    return property(function)


class ElasticPlastic(HistoryMaterial):
    """Von Mises plasticity with an associated flow rule, in plane stress or plane strain.

    The stress is Hooke's of the elastic part of the Green-Lagrange strain, which adds to the
    plastic part: for small strains and any rotation. Yielding starts at ``yield_stress`` in
    uniaxial tension, as in the fibres of cables. In an increment the stress returns to the yield
    surface (backward Euler), with the consistent tangent.

    Without hardening all points of a section can yield at once, and a hinge then takes all further
    bending in one element: give a slight hardening, of a thousandth of E. See Simo, Hughes:
    "Computational inelasticity" (1998), boxes 3.2 and 3.3.

    Parameters
    ----------
    E, nu, density, plane, shear_correction, thermal_expansion, strength
        Those of :class:`~skfem_ancf.materials.base.Material`; E is a number.
    yield_stress
        Positive.
    hardening
        Isotropic: slope of the yield stress over the accumulated plastic strain; a
        :class:`Voce`; or a table (n, 2) of accumulated plastic strains and yield stresses, linear
        between, constant beyond.
    kinematic
        Slope of the back stress over the plastic strain in uniaxial tension (Prager).
    points
        Number of points across a section or layer.

    Attributes
    ----------
    variables
        ``plastic_strain`` (xx, yy, 2 xy), ``back_stress`` (xx, yy, xy), and ``accumulated``, the
        accumulated plastic strain.

    Examples
    --------
    A fibre is stretched to four times its yield strain:

    >>> import numpy as np
    >>> from skfem_ancf import ElasticPlastic
    >>> steel = ElasticPlastic(E=2e11, nu=0.3, yield_stress=2e8)
    >>> stress, modulus, history = steel.axial(np.array(4e-3), np.zeros(7), 0.0)
    >>> float(stress), round(float(history[0]), 6)
    (200000000.0, 0.003)
    """

    variables = VARIABLES

    def __init__(self, E: float, nu: float, yield_stress: float,
                 hardening: float | Voce | ArrayLike = 0.0, kinematic: float = 0.0,
                 density: float | None = None, plane: str = "stress",
                 shear_correction: str | float = "auto", thermal_expansion: float = 0.0,
                 points: int = ACROSS,
                 strength: float | tuple[float, float] | None = None) -> None:
        super().__init__(E, nu, density, plane, shear_correction, thermal_expansion, points,
                         strength)
        refuse(self.nu == 0.5, "ElasticPlastic needs nu below 0.5, got 0.5: use 0.49")
        self.yield_stress = require_positive("yield_stress", yield_stress)
        self.kinematic = require_not_negative("kinematic", kinematic, False)
        refuse(isinstance(hardening, str), "hardening is a number, a table (n, 2) or "
               "Voce(saturation, rate), got {!r}", hardening)
        if isinstance(hardening, Voce):
            self.hardening: Any = hardening
        elif np.ndim(hardening) == 0:
            self.hardening = require_not_negative("hardening", hardening, False)
        else:
            self.hardening = table = require_finite("hardening", hardening, (None, 2))
            rise, wrong = np.diff(table, axis=0), len(table) < 2 or table[0, 0] != 0.0
            refuse(wrong or np.any(rise[:, 0] <= 0.0) or np.any(rise[:, 1] < 0.0) or abs(
                table[0, 1] - self.yield_stress) > 1e-9 * self.yield_stress,
                "hardening as a table has rows (plastic strain, yield stress), strains increasing "
                "from 0, stresses not decreasing from yield_stress = {:g}; got {!r}",
                self.yield_stress, table)

    @classmethod
    def named(cls, name: str, units: tuple[str, str] = ("N", "m"), **changes: Any) -> "Self":
        """As :meth:`Material.named <skfem_ancf.materials.base.Material.named>`; the yield stress is
        the strength.

        Examples
        --------
        >>> ElasticPlastic.named("S235", ("N", "mm"), hardening=1000.0).yield_stress
        235.0
        """
        strength = values_of(name, units)[0]["strength"]
        return super().named(name, units, **{"yield_stress": strength, **changes})


    def __repr__(self) -> str:
        return super().__repr__()[:-1] + f", yield_stress={self.yield_stress:g})"

    # hardening

    def yield_at(self, p: Any) -> Any:
        """The yield stress at an accumulated plastic strain."""
        return hardened(self.constants, np.asarray(p, dtype=float))[0]

    @property
    def constants(self) -> Array:
        """Those of the functions below; a table is linear from its first row on."""
        h, rows = self.hardening, np.zeros((0, 4))
        if not isinstance(h, Voce | float):
            (p, y), step = h.T, np.diff(h, axis=0)
            slopes = np.append(step[:, 1] / step[:, 0], 0.0)
            stored = np.cumsum(step[:, 0] * (0.5 * (y[1:] + y[:-1]) - y[0]))
            h, rows = float(slopes[0]), np.column_stack([p[1:], y[1:], slopes[1:], stored])
        h = h if isinstance(h, Voce) else Voce(0.0, 0.0, h)
        return np.concatenate([[self.E, self.nu, self.kinematic, self.yield_stress, *h],
                               rows.ravel()])

    point, stored, fibre, fibre_stored = map(_by_plane, range(4))

    def out_of_plane(self, strain: Array, history: Array, stress: Array) -> tuple[Array, Array]:
        e, S = super().out_of_plane(strain, history, stress)
        flow = history[0] + history[1]
        return (e - flow, S) if self.plane == "stress" else (e, S + self.E * flow)

    def outputs(self, strain: Array, history: Array, stress: Array) -> dict[str, Array]:
        a, b, c = stress - history[3:6]
        z = self.out_of_plane(strain, history, stress)[1]
        if self.plane == "strain":
            z = z + history[3] + history[4]
        size = np.sqrt(0.5 * ((a - b) ** 2 + (b - z) ** 2 + (z - a) ** 2) + 3.0 * c * c)
        return {"plastic_strain": history[6], "dissipated": self.yield_stress * history[6],
                "yield_ratio": size / self.yield_at(history[6])}
