"""Laws given at one point, which can be compiled, and that of beams given by stiffnesses."""

from typing import Any

import numpy as np

from ..core import Array, source
from .base import Material

#: Places of the six moduli of a symmetric matrix in its nine entries, row by row.
MODULI = 0, 1, 2, 1, 3, 4, 2, 4, 5


def python(function: Any) -> Any:
    """A function in Python, of one that may be compiled."""
    return getattr(function, "py_func", function)


class PointwiseMaterial(Material):
    """A law whose energy, stress and moduli are one function of the strain at a point.

    A subclass has a static method ``point(constants, xx, yy, xy)`` of the property
    :attr:`constants` and the strains eps_xx, eps_yy and 2 eps_xy. It returns the strain energy per
    volume, the second Piola-Kirchhoff stress (S_xx, S_yy, S_xy) and its derivatives (D_11, D_12,
    D_13, D_22, D_23, D_33).

    In NumPy the strains are arrays, which may be complex; in code compiled by Numba they are
    numbers. Use NumPy expressions that work for both, with ``np.where`` instead of ``if``. The
    method may be decorated with ``numba.njit``. Parameters are those of
    :class:`~skfem_ancf.materials.base.Material`. A subclass that overrides ``energy``, ``stress``
    or ``moduli`` runs in NumPy.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf.materials import PointwiseMaterial
    >>> class Springs(PointwiseMaterial):
    ...     constants = property(lambda self: np.array([self.E]))
    ...
    ...     @staticmethod
    ...     def point(constants, xx, yy, xy):
    ...         E = constants[0]
    ...         energy = 0.5 * E * (xx * xx + yy * yy + xy * xy)
    ...         return energy, (E * xx, E * yy, E * xy), (E, 0.0, 0.0, E, 0.0, E)
    >>> Springs(2.0, 0.0).stress(np.array([0.5, 0.0, 0.0])).tolist()
    [1.0, 0.0, 0.0]
    """

    point: Any = None

    @property
    def constants(self) -> Array:
        """Constants that ``point`` takes, shape (k,)."""
        raise NotImplementedError(f"{type(self).__name__} has a method point and no constants")

    @property
    def is_pointwise(self) -> bool:
        """True if ``point`` defines the energy, the stress and the moduli."""
        return self.point is not None and all(
            getattr(type(self), name) is getattr(PointwiseMaterial, name)
            for name in ("energy", "stress", "moduli"))

    def energy(self, strain: Array) -> Array:
        return self.evaluated(strain, 1)[0]

    def stress(self, strain: Array) -> Array:
        return self.evaluated(strain, 3)

    def moduli(self, strain: Array) -> Array:
        found = self.evaluated(strain, 9)
        return found.reshape((3, 3) + found.shape[1:])

    def evaluated(self, strain: Array, number: int) -> Array:
        """Energy, stress or moduli, or stress and moduli, shape (number, ...).

        Parameters
        ----------
        strain
            Shape (3, ...).
        number
            1 (energy), 3 (stress), 9 (moduli, row by row) or 12 (stress, then moduli).
        """
        strain = np.asarray(strain)
        strain = strain.astype(np.result_type(strain, float), copy=False)
        energy, stress, moduli = python(self.point)(self.constants, *strain)
        found = [energy] if number == 1 else [*stress, *(moduli[k] for k in MODULI)]
        found = found[3:] if number == 9 else found[:number]
        out = np.empty((number, *strain.shape[1:]), strain.dtype)
        for k, x in enumerate(found):
            out[k] = x
        return out


@source
def plane_sections(constants, xx, yy, xy):
    """W = E/2 (a - 1)^2 + G/2 g^2 + K/2 eps_yy^2 and its derivatives."""
    # With the axial derivative f of the position and the unit vector n along the section, a is the
    # part of f normal to n, and g = f . n. In terms of the strain g^2 = (2 eps_xy)^2 / C_22 and a^2
    # = C_11 - g^2. Arguments are those of :class:`PointwiseMaterial`.
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
    G = 0.0

    def __init__(self, E: float, shear: float, density: float | None = None) -> None:
        super().__init__(E, 0.0, density)
        self.G = shear

    @property
    def constants(self) -> Array:
        """E, the shear modulus, and the stiffness of the thickness."""
        return np.array([self.E, self.G, 1e4 * self.E])

    def shear_factor(self, element: Any) -> float:
        return 1.0
