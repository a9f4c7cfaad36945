"""Viscoelasticity by a Prony series."""

from __future__ import annotations

import numpy as np

from ..core import Array, ArrayLike, refuse, require_finite
from .base import Material
from .history import HistoryMaterial


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

    def _fractions(self, dt):
        """What remains of stresses after an increment, and of a change at a constant rate."""
        x = dt / self.times
        return np.exp(-x), np.where(x > 0.0, -np.expm1(-x) / np.where(x > 0.0, x, 1.0), 1.0)

    def _relaxed(self, S, history, dt):
        """Stress (c, ...), its part in the derivative by S0, and history."""
        remains, part = self._fractions(dt)
        after = np.array(history, dtype=np.result_type(S, history))
        out, c = (1.0 - self.shares.sum()) * S, len(S)
        for k, (g, a, b) in enumerate(zip(self.shares, remains, part)):
            rows = slice(3 + 3 * k, 3 + 3 * k + c)
            after[rows] = a * history[rows] + g * b * (S - history[:c])
            out = out + after[rows]
        after[:c] = S
        return out, 1.0 - float(np.sum(self.shares * (1.0 - part))), after

    def stress(self, strain: Array, history: Array, dt: float  # type: ignore[override]
               ) -> tuple[Array, Array]:
        S, _, after = self._relaxed(self._law.stress(strain), np.asarray(history), dt)
        return S, after

    def moduli(self, strain: Array, history: Array, dt: float) -> Array:  # type: ignore[override]
        part = 1.0 - float(np.sum(self.shares * (1.0 - self._fractions(dt)[1])))
        return part * self._law.moduli(strain)

    def energy(self, strain: Array, history: Array) -> Array:  # type: ignore[override]
        """That of the springs: of the law, and of those that relax with its moduli at rest."""
        out = (1.0 - self.shares.sum()) * self._law.energy(strain)
        inverse = np.linalg.inv(self.elastic)
        for k, g in enumerate(self.shares):
            S = history[3 + 3 * k:6 + 3 * k]
            out = out + 0.5 / g * np.sum(S * np.tensordot(inverse, S, 1), axis=0)
        return out

    def axial(self, strain: Array, history: Array, dt: float) -> tuple[Array, Array, Array]:
        E = self.axial_modulus
        S, part, after = self._relaxed(E * np.asarray(strain)[None], history, dt)
        return S[0], part * E + 0.0 * strain, after

    def axial_energy(self, strain: Array, history: Array) -> Array:
        E = self.axial_modulus
        squares = sum(history[3 + 3 * k] ** 2 / g for k, g in enumerate(self.shares))
        return 0.5 * (1.0 - self.shares.sum()) * E * strain**2 + 0.5 * squares / E
