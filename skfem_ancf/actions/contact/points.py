"""Contact points, from the gap to the scatter: one text for obstacles and for members.

A gap is a function of vectors that are affine in the degrees of freedom: the place r of a point on
its curve and the slope t there, and, of members, the closest place c on the other curve and the
slope T there. With the derivatives G of the gap and S of the slip by them, a pressure P and a
friction F are the resisting forces ``F S - P G`` on the vectors. Vectors are complex numbers.

For the penetration ``a`` a point with reference area A has the potential ``k A S(a)`` with::

    S(a) = (<a>^3 - <a - w>^3) / (6 w),   <a> = max(a, 0)

which is ``a^2 / 2`` except for a transition of width w, and twice continuously differentiable. A
mean between two states takes the divided difference of S: its work is the change of the potential,
so that energy is conserved if G times the change of the vectors is that of the gap. In the
augmented Lagrangian ``a = m - g`` with the gap g and the multiplier m over the stiffness, which is
increased by the remaining penetration. F is a spring along the surface from an anchor to the point,
limited by Coulomb's law.
"""

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np

from ...core import F1, F2, I1, MADE, indices, primitive, source
from ..tables import add_each
from .tables import TINY


@source
def dot(a, b):
    """The scalar product."""
    return a.real * b.real + a.imag * b.imag


@source
def cross(a, b):
    """The product ``a_1 b_2 - a_2 b_1``."""
    return a.real * b.imag - a.imag * b.real


@source
def size(a):
    """The length."""
    return np.sqrt(a.real * a.real + a.imag * a.imag)


@source
def scaled(c, a):
    """A multiple; Numba would multiply and divide by a complex number."""
    return vector(c * a.real, c * a.imag)


@source
def turned(a):
    """A vector turned by a right angle, ``1j a``."""
    return vector(-a.imag, a.real)


@primitive("skfem_ancf.core.loops")
def vector(x, y):
    """The vector with two components; Numba would multiply by 1j."""
    return x + 1j * y


@source
def potential(a, width):
    """S(a)."""
    return (np.maximum(a, 0.0) ** 3 - np.maximum(a - width, 0.0) ** 3) / (6.0 * width)


@source
def pressure_slope(a, width):
    """S''(a)."""
    return (np.maximum(a, 0.0) - np.maximum(a - width, 0.0)) / width


@source
def mean_pressure(a, b, width):
    """(S(b) - S(a)) / (b - a), and S'(a) for a = b, without cancellation."""
    return (_mean_cube(a, b) - _mean_cube(a - width, b - width)) / (6.0 * width)


@source
def _mean_cube(a, b):
    """(<b>^3 - <a>^3) / (b - a)."""
    p, q = np.maximum(a, 0.0), np.maximum(b, 0.0)
    same = np.abs(b - a) < TINY
    share = (q - p) / (b - a + same) * (1.0 - same) + same * (a > 0.0)
    return (p * p + p * q + q * q) * share


@source
def return_mapping(trial, limit):
    """Friction traction from a trial traction, and 1 for sticking, 0 for slipping."""
    return np.minimum(np.maximum(trial, -limit), limit), 1.0 * (np.abs(trial) < limit)


#: The least square of a slope: sections have none, and levers of no length.
SHORT = 1e-30


class Touch(NamedTuple):
    """Points in contact between two states, or at one, (n,). Components of vectors are (4 or 8, n),
    those of r and t first."""

    at: I1
    k: F1  # stiffness times area
    before: F1  # penetrations
    after: F1
    held: F1  # what multipliers of bilateral points take from the mean penetration
    moved: F2  # change of the vectors
    gap: F2  # derivatives by them
    slip: F2
    trial: F1  # friction if all stick
    spring: F1  # its stiffness


class Response(NamedTuple):
    """Pressures and frictions of points, (n,), and their derivatives by gap and slip."""

    pressure: F1
    slope: F1
    friction: F1
    change: F1  # by the gap, of what slips
    spring: F1  # by the slip, of what sticks


TOUCH: TypeAlias = Annotated[Touch, MADE]


@source
def respond(touch, width, friction, sticks, twice):
    """The :class:`Response`; all stick if ``sticks`` is 1, and springs are those of the end of a
    step, ``twice`` 2, or of a state, 1."""
    n = touch.k.size
    pressure, slope, rub, change, spring = (np.empty(n), np.empty(n), np.empty(n), np.empty(n),
                                            np.empty(n))
    for i in indices(n):
        a, b, k = touch.before[i], touch.after[i], touch.k[i]
        mean, trial = mean_pressure(a, b, width) - touch.held[i], touch.trial[i]
        # twice the derivative of the mean by b
        jump = b - a
        apart = 1.0 * (np.abs(jump) > 1e-3 * (width + np.abs(a) + np.abs(b)))
        P, c = k * mean, k * (
            pressure_slope(0.5 * (a + b), width) * (1.0 - apart)
            + 2.0 * (mean_pressure(b, b, width) - mean) * apart / (jump + (1.0 - apart)))
        rub[i], stuck = return_mapping(trial, friction * P)
        stuck = np.maximum(stuck, sticks)
        pressure[i], slope[i], spring[i] = P, c, twice * stuck * touch.spring[i]
        change[i] = friction * np.sign(trial) * (1.0 - stuck) * c
    return Response(pressure, slope, rub, change, spring)


@source
def add_resistance(touch, r, R):
    """Add the forces on the vectors."""
    for x in range(R.shape[0]):
        for i in indices(R.shape[1]):
            R[x, i] += r.friction[i] * touch.slip[x, i] - r.pressure[i] * touch.gap[x, i]


@source
def add_coupling(touch, r, K):
    """Add the derivatives of forces due to those of pressures and frictions; (x, y) in a row."""
    n = touch.gap.shape[0]
    for x in range(n):
        for y in range(n):
            for i in indices(K.shape[1]):
                K[n * x + y, i] += touch.gap[y, i] * (
                    r.slope[i] * touch.gap[x, i] - r.change[i] * touch.slip[x, i]) + (
                    r.spring[i] * touch.slip[x, i] * touch.slip[y, i])


@source
def product(x, y, out):
    """Scalar products of vectors, (n,)."""
    for i in indices(out.size):
        out[i] = 0.0
    for k in range(x.shape[0]):
        for i in indices(out.size):
            out[i] += x[k, i] * y[k, i]


@source
def put(rows, k, i, v):
    """Set the components of the vector number k."""
    rows[2 * k, i], rows[2 * k + 1, i] = v.real, v.imag


@source
def by_slope(t, offset, v):
    """Derivative by the slope t of the component along v of a point at a distance from a curve."""
    short = 1.0 / np.sqrt(np.maximum(dot(t, t), SHORT))
    unit = scaled(short, t)
    return scaled(-offset * short * dot(unit, v), turned(unit))


@source
def add_bend(t, offset, f, i, K):
    """Add its second derivative for a force f to the rows of the slope."""
    n = 4 if K.shape[0] == 16 else 8
    square = np.maximum(dot(t, t), SHORT)
    c = offset / square / square / np.sqrt(square)
    over, along, x, y = c * cross(f, t), c * dot(f, t), t.real, t.imag
    mixed = along * (x * x - y * y) - over * x * y
    K[2 * n + 2, i] += over * y * y - 2.0 * along * x * y
    K[2 * n + 3, i] += mixed
    K[3 * n + 2, i] += mixed
    K[3 * n + 3, i] += over * x * x + 2.0 * along * x * y


@source
def spread(dofs, places, slopes, at, R, out):
    """Add forces on a place and a slope to those on degrees of freedom, of points ``at``."""
    value = np.empty(at.size, np.complex128)
    for b in range(places.shape[0]):
        w, s, rows = places[b], slopes[b] if slopes.shape[0] > 0 else places[b], dofs[b]
        for i in indices(at.size):
            value[i] = np.conj(w[at[i]]) * vector(R[0, i], R[1, i])
        if slopes.shape[0] > 0:
            for i in indices(at.size):
                value[i] += np.conj(s[at[i]]) * vector(R[2, i], R[3, i])
        add_each(out, rows[at], value)
