"""Laws given at one point, which can be compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import Array
from .base import Material

#: Places of the six moduli of a symmetric matrix in its nine entries, row by row.
MODULI = 0, 1, 2, 1, 3, 4, 2, 4, 5


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
        energy, stress, moduli = getattr(self.point, "py_func", self.point)(self.constants, *strain)
        found = [energy] if number == 1 else [*stress, *(moduli[k] for k in MODULI)]
        found = found[3:] if number == 9 else found[:number]
        out = np.empty((number, *strain.shape[1:]), strain.dtype)
        for k, x in enumerate(found):
            out[k] = x
        return out
