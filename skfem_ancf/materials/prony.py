"""Viscoelasticity by a Prony series."""

from typing import Any

import numpy as np

from ..core import Array, ArrayLike, refuse, require_finite, source
from .base import LinearLaw, Material
from .history import HistoryMaterial


#: Places of the constants, and of the first share.
AXIAL, MODULI, COMPLIANCE, SHARES = 0, 1, 7, 13


@source
def relax(c, history, dt, S, after):
    """Relax stresses S (1 or 3, ...) of the law in an increment. Returns the derivative by the
    stresses of the law, for a constant rate over the increment."""
    part = 1.0
    for i in range(len(S)):
        after[i] = S[i]
    for k in range(SHARES, len(c), 2):
        x, j = dt / c[k + 1], 3 * (k - SHARES) // 2 + 3
        lost = -np.expm1(-x)
        mean = lost / x if x > 0.0 else 1.0  # what remains at the end of a change at this rate
        part += c[k] * (mean - 1.0)
        for i in range(len(S)):
            after[j + i] = (1.0 - lost) * history[j + i] + c[k] * mean * (after[i] - history[i])
            S[i] += after[j + i] - c[k] * after[i]
    return part


@source
def square(D, x, y, z):
    """The square of a vector by a symmetric matrix D (6,)."""
    return D[0] * x * x + D[3] * y * y + D[5] * z * z + 2.0 * (
        D[1] * x * y + D[2] * x * z + D[4] * y * z)


@source
def relaxing(c, strain, history, dt, S, D, after):
    """Stress, moduli and history at a point."""
    M, x, y, z = c[MODULI:], strain[0], strain[1], strain[2]
    S[0] = M[0] * x + M[1] * y + M[2] * z
    S[1] = M[1] * x + M[3] * y + M[4] * z
    S[2] = M[2] * x + M[4] * y + M[5] * z
    part = relax(c, history, dt, S, after)
    for k in range(6):
        D[k] = part * M[k]


@source
def of_springs(c, W, history):
    """Stored energy: of the law, which has W, and of the springs of the Maxwell elements."""
    lasting, out = 1.0, 0.0
    for k in range(SHARES, len(c), 2):
        j = 3 * (k - SHARES) // 2 + 3
        lasting -= c[k]
        out = out + 0.5 / c[k] * square(
            c[COMPLIANCE:], history[j], history[j + 1], history[j + 2])
    return lasting * W + out


@source
def stored(c, strain, history):
    """Stored energy at a point."""
    return of_springs(c, 0.5 * square(c[MODULI:], strain[0], strain[1], strain[2]), history)


@source
def relaxing_fibre(c, strain, history, dt, S, D, after):
    """Stress, modulus and history of a fibre."""
    S[0] = c[AXIAL] * strain[0]
    for k in range(len(history)):
        after[k] = history[k]
    D[0] = relax(c, history, dt, S, after) * c[AXIAL]


@source
def stored_fibre(c, strain, history):
    """Stored energy of a fibre, whose stresses across are zero."""
    return of_springs(c, 0.5 * c[AXIAL] * strain[0] * strain[0], history)


class Prony(HistoryMaterial):
    """Relaxation of an elastic law by a Prony series: a generalised Maxwell model.

    With the stress S0 of the law, a strain that is held relaxes it to ``S0 (1 - sum g_i (1 - exp(-t
    / tau_i)))``, and a history of strain superposes such relaxations. In an increment S0 changes at
    a constant rate, for which the stress is exact. At once, as in ``solve_static``, the stress is
    that of the law. See Simo, Hughes: "Computational inelasticity" (1998), section 10.3.

    Parameters
    ----------
    material
        An elastic material with its instantaneous stiffness, such as
        :class:`~skfem_ancf.StVenantKirchhoff`; its density, plane and shear correction are taken.
    shares
        Shares g_i of this stiffness that relax, shape (n,), positive, with a sum below 1.
    times
        Relaxation times tau_i, shape (n,), positive.
    points
        Number of points across a section or layer.

    Attributes
    ----------
    variables
        ``instant``, the stress S0, and ``relaxing``, the stresses of the Maxwell elements.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Prony, StVenantKirchhoff
    >>> polymer = Prony(StVenantKirchhoff(E=1e9, nu=0.0), [0.5], [2.0])
    >>> strain = np.array([1e-3, 0.0, 0.0])
    >>> at_once, history = polymer.stress(strain, np.zeros(6), 0.0)
    >>> later, history = polymer.stress(strain, history, 2.0)
    >>> round(float(later[0] / at_once[0]), 6)  # 1 - 0.5 (1 - exp(-1))
    0.68394
    """

    def __init__(self, material: Material, shares: ArrayLike, times: ArrayLike,
                 points: int = 2) -> None:
        refuse(not isinstance(material, Material) or isinstance(material, HistoryMaterial),
               "material must be elastic, as StVenantKirchhoff(E, nu), got {!r}", material)
        super().__init__(material.E, material.nu, material.density, material.plane,
                         material.shear_correction, material.thermal_expansion, points,
                         material.strength)
        self.material, self._law = material, material.law()
        self.shares = np.ravel(require_finite("shares", np.atleast_1d(shares), (None,)))
        self.times = np.ravel(require_finite("times", np.atleast_1d(times), self.shares.shape))
        refuse(np.any(self.shares <= 0.0) or self.shares.sum() >= 1.0, "shares are parts of the "
               "instantaneous stiffness: positive, with a sum below 1, got {!r}", shares)
        refuse(np.any(self.times <= 0.0), "times must be positive, got {!r}", times)
        self.variables = {"instant": 3, "relaxing": 3 * len(self.shares)}

    def __repr__(self) -> str:
        return f"Prony({self.material!r}, {self.shares.tolist()}, {self.times.tolist()})"

    @property
    def elastic(self) -> Array:
        return self._law.moduli(np.zeros(3))

    @property
    def is_hooke(self) -> bool:
        return self.material.is_hooke

    @property
    def constants(self) -> Array:
        """Axial modulus, moduli (6,) and compliances (6,), then share and time of each element."""
        D, at = self.elastic, np.triu_indices(3)
        return np.concatenate([[self.axial_modulus], D[at], np.linalg.inv(D)[at],
                               np.column_stack([self.shares, self.times]).ravel()])

    @property
    def point(self) -> Any:
        """That of Hooke's law; None for others, which run in NumPy."""
        return relaxing if isinstance(self._law, LinearLaw) else None

    @property
    def stored(self) -> Any:
        return stored if isinstance(self._law, LinearLaw) else None

    fibre, fibre_stored = staticmethod(relaxing_fibre), staticmethod(stored_fibre)

    def stress(self, strain: Array, history: Array, dt: float  # type: ignore[override]
               ) -> tuple[Array, Array]:
        if self.point is not None:
            return super().stress(strain, history, dt)
        S = np.array(self._law.stress(strain))
        after = np.empty(np.broadcast_shapes(np.shape(history), (self.number, *S.shape[1:])))
        relax(self.constants, history, dt, S, after)
        return S, after

    def moduli(self, strain: Array, history: Array, dt: float) -> Array:  # type: ignore[override]
        return relax(self.constants, (), dt, (), ()) * self._law.moduli(strain)  # of no stresses

    def energy(self, strain: Array, history: Array) -> Array:  # type: ignore[override]
        """That of the springs: of the law, and of those that relax with its moduli at rest."""
        if self.stored is not None:
            return super().energy(strain, history)
        return of_springs(self.constants, self._law.energy(strain), history)

    def outputs(self, strain: Array, history: Array, stress: Array) -> dict[str, Array]:
        return {"plastic_strain": 0.0 * history[0]}
