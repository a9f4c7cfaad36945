"""Von Mises plasticity with isotropic and kinematic hardening.

At points, in NumPy and compiled, an elastic trial stress returns to the yield surface by backward
Euler. Arguments are those of :class:`~skfem_ancf.materials.history.HistoryMaterial`: ``constants``
have the order of the names below, history variables in the order plastic strain (xx, yy, 2 xy),
back stress (xx, yy, xy), accumulated plastic strain p. ``f`` is sqrt(2/3) times the von Mises
stress. In components x whose moduli are diagonal, it is ``f^2 = sum P x^2``, and a plastic
multiplier g makes the trial stress ``x / (1 + A g)``. One search finds g for plane stress, where
there are three components (Simo, Hughes: "Computational inelasticity" (1998), box 3.3), and for
plane strain and fibres, where there is one.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import (Array, ArrayLike, Immutable, everywhere, refuse, require_finite,
                    require_not_negative, require_positive, somewhere, source, where)
from .history import ACROSS, HistoryMaterial
from .library import values_of

if TYPE_CHECKING:
    from typing_extensions import Self

#: Places of the constants. From ROWS on there is p, yield stress, slope and stored energy for each
#: row of a table of hardening but the first.
E, NU, KINEMATIC, YIELD, SATURATION, RATE, LINEAR, ROWS = range(8)
#: Places of the history: plastic strains, back stresses, and the plastic strain summed along the
#: path.
XX, YY, XY, BACK_XX, BACK_YY, BACK_XY, PATH = range(7)
#: Newton corrections of a return to the yield surface; the gap at the end over the yield stress, or
#: over the trial stress, whose round-off it has.
CORRECTIONS, FEW, CLOSED, ROUGH = 100, 10, 1e-13, 1e-14
#: f of the yield stress 1.
ROOT = np.sqrt(2.0 / 3.0)
HALF = np.sqrt(0.5)


@source
def hardened(c, p):
    """The yield stress at an accumulated plastic strain, and its slope."""
    y, K = c[YIELD] + c[LINEAR] * p, c[LINEAR] + 0.0 * p
    if c[SATURATION] > 0.0:
        rest = c[SATURATION] * np.exp(-c[RATE] * p)
        y, K = y + c[SATURATION] - rest, K + c[RATE] * rest
    for k in range(ROWS, len(c), 4):
        over = p >= c[k]
        y, K = where(over, c[k + 1] + c[k + 2] * (p - c[k]), y), where(over, c[k + 2], K)
    return y, K


@source
def locked(c, history):
    """Energy that hardening stores: that of the yield stress beyond the first, and kinematic."""
    p, a, b, d = history[PATH], history[XX], history[YY], history[XY]
    out = 0.5 * c[LINEAR] * p * p
    if c[SATURATION] > 0.0 and c[RATE] > 0.0:
        out = out + c[SATURATION] * (p + np.expm1(-c[RATE] * p) / c[RATE])
    for k in range(ROWS, len(c), 4):
        over = p - c[k]
        out = where(over >= 0.0, c[k + 3] + over * (
            c[k + 1] - c[YIELD] + 0.5 * c[k + 2] * over), out)
    return out + c[KINEMATIC] / 3.0 * (a * a + b * b + 0.5 * d * d + (a + b) * (a + b))


@source
def yields(c, square, p):
    """True where the square of f is beyond the yield stress."""
    y = ROOT * (1.0 + 1e-12) * hardened(c, p)[0]  # what is beyond by less is round-off
    return square > y * y


@source
def multiplier(c, plastic, squares, A, p):
    """Plastic multiplier g (0 where nothing yields), f, and the slope of the yield stress;
    ``squares`` are those of the components, which sum up to f^2."""
    # The ratio of yield stress and stress is nearly linear in g. The start is exact for one
    # component and linear hardening. After some corrections bounds hold them.
    f = 0.0 * p
    for x in squares:
        f = f + x
    y, K = hardened(c, p)
    y = ROOT * y
    f = where(plastic, np.sqrt(f), y)
    g = (f - y) / (y * max(A) + 2.0 / 3.0 * K * f)
    size, low, high = f / ROOT, 0.0 * f, f / (ROOT * c[YIELD] * min(A))
    closed = np.maximum(CLOSED * c[YIELD], ROUGH * size)
    for k in range(CORRECTIONS):
        square, slope = 0.0 * p, 0.0 * p
        for i in range(len(A)):
            part = 1.0 / (1.0 + A[i] * g)
            x = squares[i] * part * part
            square, slope = square + x, slope + A[i] * part * x
        f = where(plastic, np.sqrt(square), size)
        y, K = hardened(c, p + ROOT * g * f)
        ratio = ROOT * y / f
        value = where(plastic, size * (1.0 - ratio), 0.0)
        if everywhere(np.abs(value) <= closed):
            break
        slope = slope / (f * f)  # of minus log f
        better = g + value / (size * (ratio * slope + 2.0 / 3.0 * K * (1.0 - g * slope)))
        if k < FEW:
            g = np.maximum(better, 0.0)
        else:
            low, high = where(value > 0.0, g, low), where(value < 0.0, g, high)
            g = where((better > low) & (better < high), better, 0.5 * (low + high))
    return g, f, K


@source
def plane_stress(c, strain, history, dt, S, D, after):
    """Stress, moduli and history of plane stress."""
    # x, y, z are the trial stress less back stress in the components (xx + yy, xx - yy, xy) over
    # sqrt(2), sqrt(2), 1, in which the moduli are diagonal.
    G, H, p = 0.5 * c[E] / (1.0 + c[NU]), 2.0 / 3.0 * c[KINEMATIC], history[PATH]
    X, Y, Z = c[E] / (1.0 - c[NU]), 2.0 * G, G
    a, b = strain[0] - history[XX], strain[1] - history[YY]
    x = HALF * (X * (a + b) - history[BACK_XX] - history[BACK_YY])
    y = HALF * (Y * (a - b) - history[BACK_XX] + history[BACK_YY])
    z = Z * (strain[2] - history[XY]) - history[BACK_XY]
    for k in range(len(history)):
        after[k] = history[k]
    plastic = yields(c, x * x / 3.0 + y * y + 2.0 * z * z, p)
    if somewhere(plastic):
        A, B, C = X / 3.0 + H, Y + H, 2.0 * Z + H
        g, f, K = multiplier(c, plastic, (x * x / 3.0, y * y, 2.0 * z * z), (A, B, C), p)
        x, y, z = x / (1.0 + A * g), y / (1.0 + B * g), z / (1.0 + C * g)
        q, r = HALF * g * x, HALF * g * y
        after[XX] += q / 3.0 + r
        after[YY] += q / 3.0 - r
        after[XY] += 2.0 * g * z
        after[BACK_XX] += H * (q + r)
        after[BACK_YY] += H * (q - r)
        after[BACK_XY] += H * g * z
        after[PATH] += ROOT * g * f
        one, two = 1.0 + H * g, 1.0 - 2.0 / 3.0 * K * g
        h = g / one
        u, v, w = X / (1.0 + X / 3.0 * h), Y / (1.0 + Y * h), Z / (1.0 + 2.0 * Z * h)
        a, b, d = u * x / 3.0, v * y, 2.0 * w * z
        share = x * a / 3.0 + y * b + 2.0 * z * d + 2.0 / 3.0 * one / two * (
            K * one + c[KINEMATIC] * two) * f * f
        share = where(plastic, 1.0, 0.0) / where(plastic, share, 1.0)
        q, r, n = u - share * a * a, v - share * b * b, share * a * b
        D[0], D[1], D[3] = 0.5 * (q + r) - n, 0.5 * (q - r), 0.5 * (q + r) + n
        n = HALF * share * d
        D[2], D[4], D[5] = -n * (a + b), -n * (a - b), w - share * d * d
    else:
        D[0], D[1], D[3] = 0.5 * (X + Y), 0.5 * (X - Y), 0.5 * (X + Y)
        D[2], D[4], D[5] = 0.0, 0.0, Z
    S[0], S[1] = HALF * (x + y) + after[BACK_XX], HALF * (x - y) + after[BACK_YY]
    S[2] = z + after[BACK_XY]


@source
def plane_stress_energy(c, strain, history):
    """Stored energy of plane stress."""
    a, b, d = strain[0] - history[XX], strain[1] - history[YY], strain[2] - history[XY]
    return 0.5 * c[E] / (1.0 + c[NU]) * (
        (a * a + b * b + 2.0 * c[NU] * a * b) / (1.0 - c[NU]) + 0.5 * d * d) + locked(c, history)


@source
def deviators(c, strain, history):
    """Volumetric strain, and elastic stress deviators xx, yy, xy and zz of plane strain."""
    a, b, z = strain[0] - history[XX], strain[1] - history[YY], history[XX] + history[YY]
    G, mean = 0.5 * c[E] / (1.0 + c[NU]), (a + b + z) / 3.0
    return 3.0 * mean, 2.0 * G * (a - mean), 2.0 * G * (b - mean), G * (
        strain[2] - history[XY]), 2.0 * G * (z - mean)


@source
def plane_strain(c, strain, history, dt, S, D, after):
    """Stress, moduli and history of plane strain: radial return."""
    G, bulk, H = 0.5 * c[E] / (1.0 + c[NU]), c[E] / (3.0 - 6.0 * c[NU]), 2.0 / 3.0 * c[KINEMATIC]
    volume, x, y, s, z = deviators(c, strain, history)
    x, y, s = x - history[BACK_XX], y - history[BACK_YY], s - history[BACK_XY]
    z = z + history[BACK_XX] + history[BACK_YY]
    square = x * x + y * y + 2.0 * s * s + z * z
    for k in range(len(history)):
        after[k] = history[k]
    one, n = 1.0 + 0.0 * square, 0.0 * square
    plastic = yields(c, square, history[PATH])
    if somewhere(plastic):
        A = 2.0 * G + H
        g, f, K = multiplier(c, plastic, (square,), (A,), history[PATH])
        after[PATH] += ROOT * g * f
        g = g / (1.0 + A * g)  # flow is this times the trial stress
        after[XX] += g * x
        after[YY] += g * y
        after[XY] += 2.0 * g * s
        after[BACK_XX] += H * g * x
        after[BACK_YY] += H * g * y
        after[BACK_XY] += H * g * s
        one = 1.0 - 2.0 * G * g
        n = where(plastic, one - 1.0 + 1.0 / (1.0 + (K + c[KINEMATIC]) / (3.0 * G)), 0.0)
        n *= 2.0 * G / where(plastic, square, 1.0)
    S[0] = bulk * volume + history[BACK_XX] + one * x
    S[1] = bulk * volume + history[BACK_YY] + one * y
    S[2] = history[BACK_XY] + one * s
    a, b = bulk + 4.0 / 3.0 * G * one, bulk - 2.0 / 3.0 * G * one
    D[0], D[1], D[2] = a - n * x * x, b - n * x * y, -n * x * s
    D[3], D[4], D[5] = a - n * y * y, -n * y * s, G * one - n * s * s


@source
def plane_strain_energy(c, strain, history):
    """Stored energy of plane strain."""
    volume, x, y, s, z = deviators(c, strain, history)
    return 0.5 * c[E] / (3.0 - 6.0 * c[NU]) * volume * volume + 0.5 * (1.0 + c[NU]) / c[E] * (
        x * x + y * y + 2.0 * s * s + z * z) + locked(c, history)


@source
def fibre(c, strain, history, dt, S, D, after):
    """Stress, modulus and history of a fibre in uniaxial stress."""
    H, x = c[KINEMATIC], c[E] * (strain[0] - history[XX]) - history[BACK_XX]
    square = 2.0 / 3.0 * x * x
    for k in range(len(history)):
        after[k] = history[k]
    plastic = yields(c, square, history[PATH])
    if somewhere(plastic):
        A = 2.0 / 3.0 * (c[E] + H)
        g, _, K = multiplier(c, plastic, (square,), (A,), history[PATH])
        flow = 2.0 / 3.0 * g / (1.0 + A * g) * x
        after[XX] += flow
        after[YY] -= 0.5 * flow
        after[BACK_XX] += H * flow
        after[PATH] += np.abs(flow)
        D[0] = where(plastic, c[E] * (K + H) / (c[E] + K + H), c[E])
    else:
        D[0] = c[E]
    S[0] = c[E] * (strain[0] - after[XX])


@source
def fibre_energy(c, strain, history):
    """Stored energy of a fibre."""
    elastic = strain[0] - history[XX]
    return 0.5 * c[E] * elastic * elastic + locked(c, history)


@source
def across_width(history):
    """A history with zz in place of yy, as :func:`plane_stress` has it: plastic strains have no
    trace, and of the back stress that of yy is zero, as stress is."""
    a, b = history[XX], history[BACK_XX] - history[BACK_YY]
    return (a, -a - history[YY], 0.0 * a, b, -history[BACK_XX] - 2.0 * history[BACK_YY], 0.0 * b,
            history[PATH])


@source
def plane_strain_fibre(c, strain, history, dt, S, D, after):
    """Stress, modulus and history of a fibre in plane strain: :func:`plane_stress` of its length
    and the width, in which it has no strain."""
    e, size = strain[0], strain.shape[1:]
    stress, moduli = np.empty((3, *size)), np.empty((6, *size))
    plane_stress(c, (e, 0.0 * e, 0.0 * e), across_width(history), dt, stress, moduli, after)
    S[0], D[0] = stress[0], moduli[0]
    after[YY], after[BACK_YY] = -after[XX] - after[YY], -(after[BACK_XX] + after[BACK_YY]) / 3.0
    after[BACK_XX] += after[BACK_YY]


@source
def plane_strain_fibre_energy(c, strain, history):
    """Stored energy of a fibre in plane strain."""
    e = strain[0]
    return plane_stress_energy(c, (e, 0.0 * e, 0.0 * e), across_width(history))


#: Functions of a point and of a fibre, with their stored energies.
FUNCTIONS = {"stress": (plane_stress, plane_stress_energy, fibre, fibre_energy),
             "strain": (plane_strain, plane_strain_energy, plane_strain_fibre,
                        plane_strain_fibre_energy)}
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
        """Those of the functions above; a table is linear from its first row on."""
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
        flow = history[XX] + history[YY]
        return (e - flow, S) if self.plane == "stress" else (e, S + self.E * flow)

    def outputs(self, strain: Array, history: Array, stress: Array) -> dict[str, Array]:
        a, b, c = stress - history[BACK_XX:PATH]
        z = self.out_of_plane(strain, history, stress)[1]
        if self.plane == "strain":
            z = z + history[BACK_XX] + history[BACK_YY]
        size = np.sqrt(0.5 * ((a - b) ** 2 + (b - z) ** 2 + (z - a) ** 2) + 3.0 * c * c)
        return {"plastic_strain": history[PATH], "dissipated": self.yield_stress * history[PATH],
                "yield_ratio": size / self.yield_at(history[PATH])}
