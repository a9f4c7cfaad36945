"""Von Mises plasticity with isotropic and kinematic hardening."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core import (Array, ArrayLike, refuse, require_finite, require_not_negative,
                    require_positive)
from .history import ACROSS, HistoryMaterial

#: Newton corrections of a return to the yield surface; the gap at the end over the yield stress, or
#: over the trial stress, whose round-off it has.
CORRECTIONS, FEW, CLOSED, ROUGH = 100, 10, 1e-13, 1e-14
#: Relative excess of the yield stress that is round-off.
EXCESS = 1e-12
#: (xx, yy, 2 xy) in the basis in which the plane stress moduli are diagonal (a symmetric matrix),
#: and the factors of f^2 there, with f = sqrt(2/3) times the von Mises stress.
BASIS = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, np.sqrt(2.0)]]) / np.sqrt(2.0)
FACTORS = np.array([1.0 / 3.0, 1.0, 2.0])
#: Moduli from those in that basis, (9, 9), and a sum over components.
MODULI, ONES = np.kron(BASIS, BASIS), np.ones(3)
#: f of the yield stress 1.
ROOT = np.sqrt(2.0 / 3.0)


#: History variables of a point.
VARIABLES = {"plastic_strain": 3, "back_stress": 3, "accumulated": 1}


class Voce(NamedTuple):
    """Isotropic hardening that saturates: ``saturation (1 - exp(-rate p)) + linear p``.

    p is the accumulated plastic strain; it is added to the yield stress.

    Examples
    --------
    >>> from skfem_ancf import ElasticPlastic, Voce
    >>> law = ElasticPlastic(2e11, 0.3, 2.5e8, hardening=Voce(1e8, 20.0))
    >>> [float(law.yield_at(p).round(-6)) for p in (0.0, 10.0)]
    [250000000.0, 350000000.0]
    """

    saturation: float
    rate: float
    linear: float = 0.0


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
        self.kinematic = require_not_negative("kinematic", kinematic)
        self.hardening = self._checked(hardening)

    def _checked(self, hardening):
        if isinstance(hardening, Voce):
            for name, value in zip(hardening._fields, hardening):
                require_not_negative(f"{name} of hardening", value)
            return hardening
        if np.ndim(hardening) == 0:
            return require_not_negative("hardening", hardening, False)
        table = require_finite("hardening", hardening, (None, 2))
        rise = np.diff(table, axis=0)
        refuse(len(table) < 2 or table[0, 0] != 0.0 or np.any(rise[:, 0] <= 0.0) or np.any(
            rise[:, 1] < 0.0) or abs(table[0, 1] - self.yield_stress) > 1e-9 * self.yield_stress,
            "hardening as a table has rows (plastic strain, yield stress), strains increasing from "
            "0, stresses not decreasing from yield_stress = {:g}; got {!r}", self.yield_stress,
            table)
        return table

    def __repr__(self) -> str:
        return super().__repr__()[:-1] + f", yield_stress={self.yield_stress:g})"

    # hardening

    def yield_at(self, p: Any) -> Any:
        """The yield stress at an accumulated plastic strain."""
        return self._yield(np.asarray(p, dtype=float))[0]

    def _yield(self, p):
        """The yield stress and its slope."""
        h, y = self.hardening, self.yield_stress
        if isinstance(h, Voce):
            rest = h.saturation * np.exp(-h.rate * p)
            return y + h.saturation - rest + h.linear * p, h.rate * rest + h.linear
        if isinstance(h, float):
            return y + h * p, h + 0.0 * p
        slopes = np.append(np.diff(h[:, 1]) / np.diff(h[:, 0]), 0.0)
        k = np.clip(np.searchsorted(h[:, 0], p, side="right") - 1, 0, None)
        return h[k, 1] + slopes[k] * (p - h[k, 0]), slopes[k]

    def _stored(self, p):
        """Energy of isotropic hardening: the integral of the yield stress beyond the first."""
        h = self.hardening
        if isinstance(h, Voce):
            lost = -np.expm1(-h.rate * p) / h.rate if h.rate else 0.0 * p
            return h.saturation * (p - lost) + 0.5 * h.linear * p * p
        if isinstance(h, float):
            return 0.5 * h * p * p
        steps = np.cumsum(np.append(0.0, np.diff(h[:, 0]) * (
            0.5 * (h[1:, 1] + h[:-1, 1]) - self.yield_stress)))
        k = np.clip(np.searchsorted(h[:, 0], p, side="right") - 1, 0, None)
        end = self._yield(p)[0]
        return steps[k] + (p - h[k, 0]) * (0.5 * (h[k, 1] + end) - self.yield_stress)

    def _returned(self, gap, start, most, size):
        """Zeros (n,) of decreasing functions ``gap(g) -> value, slope`` with gap(0) > 0."""
        # Newton's method, after :data:`FEW` corrections within bounds; ``most`` (n,) is one.
        # The trial stress ``size`` (n,) of iterates may be far beyond the yield stress.
        low, high, g = 0.0 * most, most, start
        closed = np.maximum(CLOSED * self.yield_stress, ROUGH * size)
        for k in range(CORRECTIONS):
            value, slope = gap(g)
            if (np.abs(value) <= closed).all():
                break
            if k < FEW:
                g = np.maximum(g - value / slope, 0.0)
                continue
            low, high = np.where(value > 0.0, g, low), np.where(value < 0.0, g, high)
            g = g - value / slope
            g = np.where((g > low) & (g < high), g, 0.5 * (low + high))
        return g

    # laws

    def stress(self, strain: Array, history: Array, dt: float  # type: ignore[override]
               ) -> tuple[Array, Array]:
        S, _, after = self.evaluate(strain, history, dt)
        return S, after

    def moduli(self, strain: Array, history: Array, dt: float) -> Array:  # type: ignore[override]
        return self.evaluate(strain, history, dt)[1]

    def evaluate(self, strain: Array, history: Array, dt: float) -> tuple[Array, Array, Array]:
        of = self._plane_stress if self.plane == "stress" else self._plane_strain
        strain = np.asarray(strain, dtype=float)
        shape = strain.shape[1:]
        S, D, after = of(strain.reshape(3, -1), np.reshape(history, (7, -1)))
        return S.reshape(3, *shape), D.reshape(3, 3, *shape), after.reshape(7, *shape)

    def _plane_stress(self, E, history):
        """Stress, moduli and history at points (..., n)."""
        G, after = self.G, history.copy()
        C, P, H = np.array([self.E / (1.0 - self.nu), 2.0 * G, G])[:, None], FACTORS[:, None], (
            2.0 / 3.0 * self.kinematic)
        back = BASIS @ history[3:6]
        x = C * (BASIS @ (E - history[:3])) - back
        S, D = x + back, np.empty((3, 3, E.shape[1]))
        D[:] = self.elastic[..., None]
        at, = np.nonzero(ONES @ (P * x * x) > (
            ROOT * (1.0 + EXCESS) * self._yield(history[6])[0]) ** 2)
        if len(at):
            z, g, f, T = self._onto_ellipse(x[:, at], history[6, at], C, P, H)
            D.reshape(9, -1)[:, at] = MODULI @ T.reshape(9, -1)
            after[:3, at] += BASIS @ (g * P * z)
            after[3:6, at] += BASIS @ (g * H * z)
            after[6, at] += ROOT * g * f
            S[:, at] = z + back[:, at] + g * H * z
        return BASIS @ S, D, after

    def _onto_ellipse(self, x, p, C, P, H):
        """Stress less back stress, plastic multiplier, f and moduli on the yield surface."""
        A, squares = C * P + H, P * x * x

        def gap(g):  # the ratio of yield stress and stress is nearly linear
            d = 1.0 / (1.0 + A * g)
            parts = squares * d
            parts *= d
            f = np.sqrt(ONES @ parts)
            parts *= d
            grows = -(A[:, 0] @ parts) / (f * f)  # the slope of log f
            y, K = self._yield(p + ROOT * g * f)
            y = ROOT * y / f
            return size * (1.0 - y), size * (y * grows - 2.0 / 3.0 * K * (1.0 + g * grows))

        size = np.sqrt(ONES @ squares) / ROOT
        most, start = size / self.yield_stress / A.min(), (size / self._yield(p)[0] - 1.0) / A.max()
        g = self._returned(gap, start, most, size)
        z = x / (1.0 + A * g)
        f = np.sqrt(ONES @ (P * z * z))
        K = self._yield(p + ROOT * g * f)[1]
        t1, t2 = 1.0 + H * g, 1.0 - 2.0 / 3.0 * K * g
        X = 1.0 / (1.0 / C + g / t1 * P)
        n = X * P * z
        b = 2.0 / 3.0 * t1 / t2 * (K * t1 + 1.5 * H * t2) * f * f
        T = -n[:, None] * n / (ONES @ (P * z * n) + b)
        T.reshape(9, -1)[::4] += X
        return z, g, f, T

    def _deviators(self, E, history):
        """Mean strain times 3, and stress deviators less back stress, xx, yy, xy and zz."""
        e, b = E - history[:3], history[3:6]
        plastic_zz = -history[0] - history[1]
        volume = e[0] + e[1] - plastic_zz
        e = np.array([e[0], e[1], 0.5 * e[2], -plastic_zz])
        e[[0, 1, 3]] -= volume / 3.0
        return volume, 2.0 * self.G * e - np.array([b[0], b[1], b[2], -b[0] - b[1]])

    def _plane_strain(self, E, history):
        """Stress, moduli and history at points (..., n): radial return."""
        G, bulk, after = self.G, self.E / (3.0 - 6.0 * self.nu), history.copy()
        volume, x = self._deviators(E, history)
        size = np.sqrt(x[0] ** 2 + x[1] ** 2 + 2.0 * x[2] ** 2 + x[3] ** 2)
        plastic = size > ROOT * (1.0 + EXCESS) * self._yield(history[6])[0]
        at, g = np.flatnonzero(plastic), np.zeros(E.shape[1])
        H, n = 2.0 / 3.0 * self.kinematic, x / np.where(size > 0.0, size, 1.0)
        if len(at):
            f, p = size[at], history[6, at]

            def gap(g):
                y, K = self._yield(p + ROOT * g)
                return f - (2.0 * G + H) * g - ROOT * y, -(2.0 * G + H) - 2.0 / 3.0 * K

            g[at] = self._returned(gap, np.zeros_like(p), f / (2.0 * G + H), f)
        flow = g * n
        after[:3] += flow[:3] * [[1.0], [1.0], [2.0]]
        after[3:6] += H * flow[:3]
        after[6] += ROOT * g
        S = x[:3] + history[3:6] - 2.0 * G * flow[:3]
        S[:2] += bulk * volume
        K = self._yield(after[6])[1]
        one = 1.0 - 2.0 * G * g / np.where(size > 0.0, size, 1.0)
        two = np.where(plastic, 1.0 / (1.0 + (K + self.kinematic) / (3.0 * G)) - (1.0 - one), 0.0)
        D = -2.0 * G * two * n[:3, None] * n[:3]
        part = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, 1.5]]) / 3.0
        D += 2.0 * G * one * part[..., None]
        D[:2, :2] += bulk
        return S, D, after

    def axial(self, strain: Array, history: Array, dt: float) -> tuple[Array, Array, Array]:
        if self.plane == "strain":
            return super().axial(strain, history, dt)
        E, H, after = self.E, self.kinematic, np.array(history, dtype=float)
        x = E * (strain - history[0]) - history[3]
        f, p, g = np.abs(x), history[6], np.zeros(np.shape(x))
        plastic = f > (1.0 + EXCESS) * self._yield(p)[0]
        if np.any(plastic):
            size, before = f[plastic], p[plastic]

            def gap(g):
                y, K = self._yield(before + g)
                return size - (E + H) * g - y, -(E + H) - K

            g[plastic] = self._returned(gap, 0.0 * size, size / (E + H), size)
        flow = g * np.sign(x)
        after[0] += flow
        after[1] -= 0.5 * flow
        after[3] += H * flow
        after[6] += g
        K = H + self._yield(after[6])[1]
        return E * (strain - after[0]), np.where(plastic, E * K / (E + K), E), after

    # energy and fields

    def energy(self, strain: Array, history: Array) -> Array:  # type: ignore[override]
        if self.plane == "stress":
            x = strain - history[:3]
            return 0.5 * np.sum(x * np.tensordot(self.elastic, x, 1), axis=0) + (
                self._locked(history))
        b = history[3:6]
        volume, x = self._deviators(strain, history)
        s = x + np.array([b[0], b[1], b[2], -b[0] - b[1]])
        square = s[0] ** 2 + s[1] ** 2 + 2.0 * s[2] ** 2 + s[3] ** 2
        bulk = self.E / (3.0 - 6.0 * self.nu)
        return 0.5 * bulk * volume**2 + 0.25 * square / self.G + self._locked(history)

    def axial_energy(self, strain: Array, history: Array) -> Array:
        if self.plane == "strain":
            return super().axial_energy(strain, history) + self._locked(history)
        return 0.5 * self.E * (strain - history[0]) ** 2 + self._locked(history)

    def _locked(self, history):
        """Energy that hardening stores."""
        stored = self._stored(history[6])
        if self.kinematic == 0.0:
            return stored
        p = history[:3]
        square = p[0] ** 2 + p[1] ** 2 + 0.5 * p[2] ** 2 + (p[0] + p[1]) ** 2
        return stored + self.kinematic / 3.0 * square

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
                "yield_ratio": size / self._yield(history[6])[0]}
