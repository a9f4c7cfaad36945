"""Recovery of strain and stress from section forces and equilibrium.

The strain of an element is a derivative of its displacement: less accurate and discontinuous. The
recovered fields are found for each axial segment between jumps of the section force:

1. The internal forces of the elements give force and moment of every section
   (:mod:`skfem_ancf.recovery.section_forces`).
2. The stretch of the fibres follows from the compatibility ``d(r_X)/dY = d(r_Y)/dX``, with the rate
   of rotation of the section. This rate and the axial stretch are those that give the section its
   force and moment; S_xx follows from the law.
3. S_xy and S_yy follow from ``div P + b = 0``, integrated across the section from the lower face.
   The residual at the upper face is distributed over the area, and Jourawski's shear stress
   (parabolic in a rectangle) is added to match the shear force. The inverse law gives eps_yy and
   eps_xy for step 2; both steps are repeated. Where the width or the law jumps across the section,
   the fields jump and P_2 times the width is continuous.
4. This is Saint-Venant's solution, to high order in h / L. Supports and point loads add boundary
   layers of length h. Where the elements resolve them, the element stress is used, as a spline
   through its most accurate points: the mean of two Gauss points at the element's centre (for
   sections cubic along the axis, the Gauss points).
"""

import copy
from collections.abc import Callable, Sequence
from functools import wraps
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from scipy.linalg.lapack import dgttrf, dgttrs, dpttrf, dpttrs

from ..beam import AXIS, SNAP, remembers
from ..beam.strains import on_grid, stress_at
from ..core import Array, angle_of, cached_property, first_order, unwrapped
from ..core.linear import STEP
from ..formulations import EnhancedContinuum
from ..materials import LinearLaw
from ..mesh.mapping import cross
from ..mesh.numbering import by_element
from ..sections.across import SIDE, off_ends
from .section_forces import (ArcLength, NotFound, NotRecovered, SectionForces, Sections, Together,
                             intervals_of)

#: Largest relative change of the strain in the last round, and strain that is round-off.
UNSETTLED, TINY = 0.01, 1e-12

#: Sections closer to a cut than this fraction of an element are at the cut.
AT_CUT = 1e-8

#: Rounds of steps 2 and 3, and their tolerance; largest number and tolerance if they converge
#: slowly.
ROUNDS, SETTLED = 6, 1e-7
MOST, SLOWLY = 30, 1e-4

#: Fraction of an element next to a load or joint that has no sections. If it is the whole segment,
#: the sections are those of the whole element.
CLOSE = 0.02

#: Tolerance of the stress for which a strain is sought.
BALANCED = 1e-10

#: Iterations of the balance of a section in a round, and after the last one.
BALANCE, BALANCE_AT_END = 2, 10

#: Distance from the ends in heights up to which the element stress is used, and beyond which it is
#: not; element lengths in heights up to which it is used fully, and beyond which it is not.
INNER, LAYER, FINE, COARSE = 0.5, 1.2, 0.25, 0.5


def _by_rows(function):
    """A linear function of real values (n, k) as one of (..., n, m), which may be complex."""
    @wraps(function)
    def applied(self, values):
        if values.ndim == 2 and values.dtype == float:
            return function(self, values)
        rows = np.ascontiguousarray(values.swapaxes(0, -2))
        found = function(self, rows.reshape(len(rows), -1).view(float))
        return np.ascontiguousarray(found).view(rows.dtype).reshape(rows.shape).swapaxes(0, -2)

    return applied


class SectionsAlong:
    """Operators on values at n >= 3 sections of arc lengths s (n,), for values (..., n, m).
    Derivative and integral are those of the cubic spline through the values, whose third derivative
    is continuous at the second section and at the last but one (de Boor, "A Practical Guide to
    Splines", chapter 4); of the parabola through three values."""

    def __init__(self, s: Array, smoothing: float) -> None:
        self.d = d = np.diff(s)
        if len(d) == 2:
            low, middle, high = d[1:], np.array([1.0, 2.0 * (d[0] + d[1]), 1.0]), d[:1]
            low, high = np.append(low, 1.0), np.append(1.0, high)
        else:
            middle = np.concatenate([d[1:2], 2.0 * (d[:-1] + d[1:]), d[-2:-1]])
            low = np.append(d[1:], d[-1] + d[-2])
            high = np.append(d[0] + d[1], d[:-1])
        self._slopes = dgttrf(low, middle, high)[:-1]
        # f - smoothing^2 f'' = values, with f' = 0 at both ends
        c = smoothing**2 / d
        self._w = 0.5 * (np.append(d, 0.0) + np.append(0.0, d))
        self._smooth = dpttrf(self._w + np.append(c, 0.0) + np.append(0.0, c), -c)[:-1]

    @_by_rows
    def d_ds(self, y: Array) -> Array:
        """Axial derivative."""
        d = self.d[:, None]
        b, slope = np.empty_like(y), (y[1:] - y[:-1]) / d
        b[1:-1] = 3.0 * (d[1:] * slope[:-1] + d[:-1] * slope[1:])
        if len(d) == 2:
            b[0], b[-1] = 2.0 * slope
        else:
            for end, first, second in ((0, 0, 1), (-1, -1, -2)):
                both = d[first] + d[second]
                b[end] = ((d[first] + 2.0 * both) * d[second] * slope[first]
                          + d[first]**2 * slope[second]) / both
        return dgttrs(*self._slopes, b)[0]

    def integral(self, values: Array) -> Array:
        """Integral from the first section, of values (..., n)."""
        slope, d = self.d_ds(values[..., None])[..., 0], self.d
        parts = 0.5 * d * (values[..., :-1] + values[..., 1:]) + d * d / 12.0 * (
            slope[..., :-1] - slope[..., 1:])
        out = np.zeros_like(values)
        np.cumsum(parts, axis=-1, out=out[..., 1:])
        return out

    @_by_rows
    def smoothed(self, y: Array) -> Array:
        """Solution f of ``f - smoothing^2 f'' = y`` with f' = 0 at both ends."""
        return dpttrs(*self._smooth, self._w[:, None] * y)[0]


class Segment:
    """The fields between two cuts, at n sections (ends and middles of elements) of m points.
    ``strain`` and ``stress`` are (3, n, m), ``angle`` (n, m) is the direction of the axial fibres.
    Of several instants together, the fields have an axis of the instants before n."""

    def __init__(self, recovery: Any, start: float, end: float) -> None:
        self.recovery, self.forces, r = recovery, recovery.forces, recovery
        self.beam, self.height = r.beam, r.beam.mesh.height
        across, mapping = r.beam.across, r.beam.mesh.mapping()
        #: Sections of cables keep their height when the axis is stretched.
        self.rigid = not self.beam.has_sections
        e = np.arange(int(np.floor(start)), int(np.ceil(end)))
        a, b = np.maximum(start - e, 0.0), np.minimum(end - e, 1.0)
        far = b - a > CLOSE
        if far.any():  # derivatives between close sections are round-off
            e, a, b = e[far], a[far], b[far]
        else:  # whole elements, with the section force of this part
            a, b = 0.0 * a, 0.0 * b + 1.0
        whole = (a == 0) & (b == 1)
        self.elements = e[whole] if whole.any() else e
        self.e = e = np.append(np.repeat(e, 2), e[-1])
        xi = np.append(np.stack([a, 0.5 * (a + b)], 1).ravel(), b[-1])
        self.s = r.arc.at(e, xi)
        self.R, self.M = self.forces.at(e, xi, np.full(len(xi), start))
        if self.forces.viscous is not None:
            self.Rv, self.Mv = (self._at_sections(x[..., self.elements], np.array([0.5]))
                                for x in self.forces.viscous_middles())
            self.R, self.M = self.R - self.Rv, self.M - self.Mv
        moved = np.zeros(len(xi))  # loads may jump at ends inside elements
        moved[0], moved[-1] = SIDE, -SIDE
        xi = xi + moved * ((xi > 0.0) & (xi < 1.0))
        self.points = at = r.intervals.points(r._heights(e, xi))
        #: Weights of integrals from the axis, (m, m), or (n, m, m) where points vary.
        self._till = r.intervals.from_bottom.T - at.till_axis[..., None]
        sections = Sections(self.beam, e, xi, at.eta, self.forces.lifted, r.geometry)
        axis = Sections(self.beam, e, xi, mapping=r.geometry)
        X, speed = off_ends(sections.X), np.hypot(*axis.J[:, 0, :, 0])
        h, slope = mapping.height(sections.X[0], e)
        slope = slope / speed[:, None]
        self.Y, self.span = h * (at.eta - 0.5), h * at.stretch
        self.lean = slope * (at.eta - 0.5 + h * at.drift)
        self.swell = slope * (1.0 / h + at.swell)
        self.width = r.of_layers(across.width, X, e) if r.intervals.moves else (
            r.intervals.width * (r.of_layers(across.breadth, X, e) + 0.0 * X[0]))
        self.grade = r.of_layers(across.grade, X, e)
        self.g = sections.volume / (speed[:, None] * h)
        self.E0 = self.forces.eigenstrain(X, e)
        area = self.integral(1.0)[:, None]
        self.below = self.from_bottom(self.width) / area
        self.body = self.g * (self.forces.body(sections)
                              + self.forces.sampled(axis, AXIS) / (area * speed[:, None]))
        self.faces = [self.forces.face(k, e, xi)[1][..., 0] / speed if k in self.forces.sides
                      else np.zeros((2, len(e))) for k in (0, 1)]
        self.axis_angle = unwrapped(angle_of(*self.forces.tangent(axis)))
        # Jourawski's shear stress up to a factor: first moment of E dA over the width
        self.E = E = self.grade * r.modulus(np.zeros((3,) + self.g.shape))
        centre = (self.integral(E * self.Y) / self.integral(E))[:, None]
        self.jourawski = self.from_bottom(self.width * E * (centre - self.Y)) / self.width
        #: Derivatives along the segment; ``smoothed`` removes short waves, which would grow.
        self.along = SectionsAlong(self.s, 0.5 * self.height)
        s = self.s - self.s.mean()
        #: Symmetric matrix of the least-squares line through values (n,).
        self._line = s[:, None] * s / (s @ s) + 1.0 / len(s)
        self._solve()

    def part(self, k: int) -> "Segment":
        """The segment at instant k of several."""
        one = copy.copy(self)
        vars(one).pop("result", None)
        one.strain, one.stress = self.strain[:, k], self.stress[:, k]
        for name in ("angle", "stretch", "rate", "change"):
            setattr(one, name, getattr(self, name)[k])
        return one

    def _at_sections(self, values, xi):
        """Spline at the sections through values (..., k) at xi (p,) of the elements, k = n p."""
        e = self.elements
        s = self.recovery.arc.at(np.repeat(e, len(xi)), np.tile(xi, len(e)))
        if len(s) == 1:
            return values + np.zeros(len(self.s))
        return scipy.interpolate.CubicSpline(s, values, axis=-1)(self.s)

    # along the axis and across

    def with_slopes(self, values: Array) -> Array:
        """Values (r, n, m) and their derivatives along the segment, (n, 2, r, m)."""
        both = np.array([values, self.along.d_ds(values)])
        return np.ascontiguousarray(both.transpose(2, 0, 1, 3))

    def splined(self, both: Array, s: Array, weights: Array) -> Array:
        """Cubic spline (r, k) at s (k,) through values :meth:`with_slopes`, with weights (k, m)."""
        j = np.minimum(np.maximum(self.s.searchsorted(s, side="right") - 1, 0), len(self.s) - 2)
        d = self.along.d[j]
        t = (s - self.s[j]) / d
        (a, u), (b, v) = ((both.take(i, 0) @ weights[:, None, :, None])[..., 0].transpose(1, 2, 0)
                          for i in (j, j + 1))
        return a + t * (d * u + t * (3.0 * (b - a) - d * (2.0 * u + v)
                                     + t * (2.0 * (a - b) + d * (u + v))))

    def over_height(self, values: Any) -> Array:
        """Integral over the height of values (..., n, m)."""
        return (self.span * values) @ self.recovery.intervals.whole

    def integral(self, values: Any) -> Array:
        """Integral over the area of values (..., n, m)."""
        return self.over_height(self.width * values)

    def from_bottom(self, values: Array) -> Array:
        """Integral from the bottom to each point of values (..., n, m)."""
        return (self.span * values) @ self.recovery.intervals.from_bottom.T

    def from_axis(self, values: Array) -> Array:
        """Integral from the axis to each point of values (..., n, m)."""
        values = self.span * values
        return values @ self._till if self._till.ndim == 2 else (
            values[..., None, :] @ self._till)[..., 0, :]

    def at_axis(self, values: Array) -> Array:
        """Values (..., n, m) on the axis, (..., n)."""
        axis = self.points.axis
        return values @ axis if axis.ndim == 1 else (values * axis).sum(axis=-1)

    def slope_from_axis(self, values: Array, d_ds: Array) -> Array:
        """Integral from the axis of the axial derivative of values (..., n, m)."""
        lean = self.lean * values
        return self.from_axis(d_ds + self.swell * values) - lean + self.at_axis(lean)[..., None]

    # step 2

    def _fibres(self, S):
        """Strain of a cable's fibres and S_xx = P / stretch, with P = E (stretch - 1)."""
        r, longer = self.recovery, self.stretch - 1.0
        eps = r.strain_of(S, np.array([longer, 0.0 * longer, 0.0 * longer]) - self.E0, (1, 2))
        P = self.grade * r.by_law(lambda law, strain: law.stress(strain)[0], eps)
        eps = eps + self.E0
        size = 1.0 + 0.5 * longer  # Green-Lagrange strain over (stretch - 1)
        thin = r.by_law(lambda law, xx: law.D[1, 0] / law.D[1, 1] * xx,
                        size * (longer - self.E0[0]))
        self.thinner = np.sqrt(1.0 - 2.0 * self.at_axis(thin))
        return np.array([size * longer, size * eps[1], eps[2]]), P / self.stretch

    def _section(self):
        """Set strain, r_X, r_Y and the stress P on sections, from S_yy, S_xy and stretch."""
        r = self.recovery
        if self.stress_given:
            eps = self.E0 + r.strain_of(self.S / self.grade, self.eps - self.E0)
        elif self.rigid:
            eps, self.S[0] = self._fibres(self._fed)
        else:
            self.eps[0] = 0.5 * (self.stretch**2 - 1.0)
            eps = r.strain_of(self._fed, self.eps - self.E0, (1, 2))
            self.S[0] = self.grade * r.by_law(lambda law, strain: law.stress(strain)[0], eps)
            eps = eps + self.E0
        self.eps, lam_y = eps, np.sqrt(1.0 + 2.0 * eps[1])
        if self.rigid:  # sections of a cable keep their height
            lam_y = lam_y / self.thinner[..., None]
        lean = self.alpha - _arcsin(eps[2] / (self.stretch * lam_y))
        self.rY = np.array([-lam_y * np.sin(lean), lam_y * np.cos(lean)])
        self.rX = np.array([self.stretch * np.cos(self.alpha), self.stretch * np.sin(self.alpha)])
        self.P = self.rX * self.S[0] + self.rY * self.S[2]

    def _balance(self, times=BALANCE_AT_END):
        """Change S_xx linearly in Y until normal force and moment are balanced."""
        # S_yy has second derivatives of S_xx: short waves would grow
        self._fed = np.concatenate([0.0 * self.S[:1], self.along.smoothed(self.S[1:])]) / self.grade
        N, self.Q = _turned(self.R, self.phi)
        for _ in range(times):
            self._section()
            E = self.E if self.recovery.linear else (
                self.grade * self.recovery.modulus(self.eps - self.E0))
            x, y = self.from_axis(self.rY)
            z = y / self.height
            force = (E + 0.0 * z if self.rigid else self.S[0] + E * self.stretch**2) / self.g
            # force and moment, and their derivatives by stretch 1 / g and bending z / g
            found, moment, one, two, three = self.integral(np.array([
                self.P[0], x * self.P[1] - y * self.P[0], force, z * force, z * z * force]))
            n, m, det = N - found, (self.M - moment) / self.height, one * three - two * two
            a, b = (three * n + two * m) / det, (-one * m - two * n) / det
            change = (a[..., None] + b[..., None] * z) / self.g
            self.stretch = self.stretch + change
            if self.stress_given:
                self.S[0] += E * self.stretch * change
            if (_largest(change) < 1e-12 * _largest(self.eps[0])).all():
                break

    def _turn(self):
        """Set the rate of rotation, and the angles of fibres and frame."""
        intervals, along = self.recovery.intervals, self.g * self.rX[0]
        total = self.over_height(self.rY)
        with_faces = along + self.lean * self.rY[0]
        self.rate = (self.along.d_ds(total[0][..., None])[..., 0]
                     - with_faces @ (intervals.top - intervals.bottom)) / total[1]
        if not np.isfinite(self.rate).all():
            raise NotFound(DIVERGED)
        dt, dn = self.along.d_ds(self.rY)
        normal = (self.slope_from_axis(self.rY[1], dn)
                  + self.from_axis(self.rate[..., None] * self.rY[0]))
        self.alpha = _arcsin(normal / (self.g * self.stretch))
        turned = (self.slope_from_axis(self.rY[0], self.along.smoothed(dt))
                  - self.from_axis(self.rate[..., None] * self.rY[1]))
        self.stretch = (self.at_axis(along)[..., None] + turned) / (self.g * np.cos(self.alpha))
        phi = self.along.integral(self.rate)
        self.phi = phi + (self.axis_angle - phi) @ self._line

    # step 3

    def _viscous_stress(self):
        """Viscous S_xx, linear in Y, and S_xy."""
        if self.forces.viscous is None:
            return 0.0, 0.0
        N, Q = _turned(self.Rv, self.phi)
        (x, y), (a, b) = self.from_axis(self.rY), self.rX
        units = self.recovery.modulus(self.eps - self.E0) * self.grade * np.array(
            [1.0 + 0.0 * y, y / self.height]) / self.g
        K = np.array([[self.integral(a * unit), self.integral((x * b - y * a) * unit)]
                      for unit in units])
        det = K[0, 0] * K[1, 1] - K[0, 1] * K[1, 0]
        first = (K[1, 1] * N - K[1, 0] * self.Mv) / det
        second = (K[0, 0] * self.Mv - K[0, 1] * N) / det
        S = first[..., None] * units[0] + second[..., None] * units[1]
        return S, self._sheared(Q - self.integral(b * S))

    def _sheared(self, force):
        """Jourawski's shear stress (n, m) of shear forces (n,)."""
        return (force / self.integral(self.rY[1] * self.jourawski))[..., None] * self.jourawski

    def _shear(self):
        """Add shear stress to S_xy to match the shear force."""
        self.S[2] += self._sheared(self.Q - self.integral(
            self.rX[1] * self.S[0] + self.rY[1] * self.S[2]))

    def _solve(self):
        shape, dtype = self.axis_angle.shape + self.g.shape[-1:], self.R.dtype
        self.phi, self.alpha, self.stretch = self.axis_angle, np.zeros(shape, dtype), np.ones(
            shape, dtype)
        self.eps, self.S = np.zeros((2, 3) + shape, dtype)
        self.stress_given = False
        for k in range(MOST):
            before = self.stretch
            self._balance(BALANCE)
            self._turn()
            # set S_xy and S_yy from div P + b = 0 and the loads of the faces
            rate, viscous, phi = self.rate[..., None], self._viscous_stress(), self.phi[..., None]
            P = self.width * (self.P + self.rX * viscous[0] + self.rY * viscous[1])
            dP = (self.along.d_ds(P) + rate * np.array([-P[1], P[0]])
                  + self.width * _turned(self.body, phi))
            bottom, top = [_turned(f[..., None], phi) for f in self.faces]
            dP = dP + self.swell * P  # with the flux through oblique faces
            left = top + bottom + self.over_height(dP)[..., None]
            P2 = left * self.below - bottom - self.from_bottom(dP) + self.lean * P
            P2 = P2 / (self.g * self.width)
            det = cross(self.rX, self.rY)
            self.S = np.array([self.S[0], cross(self.rX, P2) / det,
                               cross(P2, self.rY) / det - viscous[1]])
            self._shear()
            self.change = _largest(self.stretch - before)
            if (self.change <= _largest(self.stretch - 1.0) * (
                    SETTLED if k < ROUNDS - 1 else SLOWLY)).all():
                break
        self._balance()
        self._take_samples()
        self.stress, self.angle = self.S, self.phi[..., None] + self.alpha
        self.strain = self._fibres(self.S / self.grade)[0] if self.rigid else (
            self.E0 + self.recovery.strain_of(self.S / self.grade, self.eps - self.E0))
        if not np.isfinite(self.strain).all():
            raise NotFound(DIVERGED)

    # step 4

    def _take_samples(self):
        """Take the element stress near the ends, where elements resolve the boundary layers."""
        r, weight = self.recovery, np.zeros(len(self.s))
        if not r.has_stress:
            return
        lengths = np.diff(r.arc.nodes)[self.e]
        for k in (0, -1):
            h = np.max(np.broadcast_to(self.span, self.g.shape)[k])
            x = np.abs(self.s - self.s[k]) / h
            size = np.max(lengths[x <= LAYER]) / h
            fine = np.clip((COARSE - size) / (COARSE - FINE), 0.0, 1.0)
            z = np.clip((LAYER - x) / (LAYER - INNER), 0.0, 1.0)
            weight = np.maximum(weight, fine * z * z * (3.0 - 2.0 * z))
        if weight.any():
            xi, stress = r.samples  # where it is most accurate, (..., ne, p, m)
            values = np.moveaxis(stress[..., self.elements, :, :], -1, -3)
            values = self._at_sections(values.reshape(*values.shape[:-2], -1), xi)
            self.S += weight[:, None] * (values.swapaxes(-1, -2) - self.S)
            self.stress_given = True
            self._balance()
            self._shear()

    @cached_property
    def result(self) -> Any:
        """Strain, stress and angle with their slopes, (n, 2, 7, m)."""
        return self.with_slopes(first_order(np.concatenate(
            [self.strain, self.stress, self.angle[None]])))


DIVERGED = "the strain is too large: no equilibrium of the section was found"


def _arcsin(x):
    return np.arcsin(np.minimum(np.maximum(x, -1.0), 1.0))


def _largest(z):
    """Largest modulus over sections and points across, the last axes; of a complex step that of
    the change, without round-off."""
    change = z.imag / STEP if z.dtype.kind == "c" else z
    return np.maximum.reduce(np.abs(change), axis=(-2, -1))


def _turned(f, angle):
    """Components of vectors (2, ...) along angles and normal to them."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * f[0] + s * f[1], c * f[1] - s * f[0]])


class Recovery:
    """The recovered fields of one beam, a :class:`Segment` between cuts; ``why`` they are not
    there."""

    def __init__(self, forces: Any, u: Any) -> None:
        self.forces, self.beam, self._u = forces, forces.beam, u
        beam, layers = self.beam, self.beam.across.layers
        self.why = "" if beam.section.has_fields else (
            f"{beam.section!r} has no shape, and no stress: State.resultants() has the section "
            "forces")
        if remembers(beam):
            self.why = "the stress of its material depends on the path of the strain"
        if forces.pressed:
            self.why = ("an obstacle touches it, at points: pressure between them is not known; "
                        "State.resultants() has the section forces")
        self.intervals = intervals_of(tuple(layer.measure for layer in layers),
                                      beam.element.order)
        laws = [layer.material.law(layer.shear) for layer in layers]
        if forces.small or not beam.has_sections:  # linearised laws; a cable has no others
            laws = [law if isinstance(law, LinearLaw) else LinearLaw(law.moduli(np.zeros(3)))
                    for law in laws]
        self.laws, self._law = list(zip(self.intervals.layers, laws)), (
            laws[0] if len(laws) == 1 else None)
        self.linear = all(isinstance(law, LinearLaw) for law in laws)
        self.arc = ArcLength(beam)
        #: Mapping with sections that follow the axis at jumps of the curvature.
        self.geometry = None if beam.mesh.sections == "linear" or not len(
            beam.across.bends) else by_element(beam.mesh, beam.across.bends.astype(int)).mapping()
        self.has_stress = (len(layers) == 1 and layers[0].face is None
                           and beam.element.carries_shear_parabola
                           and not isinstance(beam.formulation, EnhancedContinuum))
        self.segments: list[Segment] = []
        self.failed = False
        if remembers(beam) or forces.pressed:
            return
        try:
            self.segments = [Segment(self, a, b) for a, b in pairwise(self.forces.cuts)]
            strain = np.max([_largest(one.stretch - 1.0) for one in self.segments], axis=0)
            change = np.max(np.max([one.change for one in self.segments], axis=0)
                            / np.maximum(strain, TINY))
            if change > UNSETTLED:
                raise NotFound("the iteration does not converge: the last change of the strain is "
                               f"{change:.0%} of its largest value")
        except NotRecovered as why:
            self.segments, self.failed = [], why.failed
            self.why = self.why or str(why)

    @cached_property
    def _parts(self):
        """The recovered fields of each of several instants."""
        parts = [copy.copy(self) for _ in self._u]
        for one, forces, u in zip(parts, self.forces.instants, self._u):
            one.forces, one._u = forces, u
        return parts

    @classmethod
    def together(cls, forces: Sequence[SectionForces], u: Sequence[Array]) -> "list[Recovery]":
        """The recovered fields of several instants, together if cuts are the same."""
        if len(forces) > 1 and all(one.beam is forces[0].beam and np.array_equal(
                one.cuts, forces[0].cuts) for one in forces):
            every = cls(Together(forces), u)
            if every.segments:
                for k, one in enumerate(every._parts):
                    one.segments = [segment.part(k) for segment in every.segments]
                    one.why = every.why
                return every._parts
        return [cls(*each) for each in zip(forces, u)]

    def _heights(self, e, xi):
        return (self.beam.mesh.mapping().height(xi[:, None], e)[0] + 0.0 * xi[:, None])[:, 0]

    def modulus(self, strain: Array) -> Array:
        """dS_xx / deps_xx at constant S_yy and S_xy, at strains (3, n, m)."""
        def axial(law, strain):
            C = law.compliance((0, 1, 2)) if isinstance(law, LinearLaw) else np.linalg.inv(
                np.moveaxis(law.moduli(strain), (0, 1), (-2, -1)))
            return 0.0 * strain[0] + 1.0 / C[..., 0, 0]

        return self.by_law(axial, strain)

    def strain_of(self, stress: Array, strain: Array, unknown: tuple[int, ...] = (0, 1, 2)
                  ) -> Array:
        """The strain with a given stress under the law of each point, by its ``unknown``
        components, shapes (3, n, m)."""
        k = list(unknown)

        def solved(law, stress, strain):
            if isinstance(law, LinearLaw):
                gap, some = stress - law.stress(strain), slice(k[0], k[-1] + 1)
                strain, C = strain.astype(gap.dtype), law.compliance(unknown)
                strain[some] += (C @ gap[some].reshape(C.shape[1], -1)).reshape(gap[some].shape)
                return strain
            strain = np.array(strain, dtype=np.result_type(strain, stress, float))
            with np.errstate(all="ignore"):
                for _ in range(30):
                    found = law.stress(strain)
                    gap = (stress - found)[k]
                    size = np.max(np.abs(gap))
                    if not np.isfinite(size):
                        break
                    if size <= BALANCED * max(np.max(np.abs(found)), np.max(np.abs(stress))):
                        return strain
                    D = np.moveaxis(law.moduli(strain)[np.ix_(k, k)], (0, 1), (-2, -1))
                    change = np.linalg.solve(D, np.moveaxis(gap, 0, -1)[..., None])[..., 0]
                    strain[k] += np.moveaxis(change, -1, 0)
            raise NotFound("no strain has the stress of the section under this law")

        return self.by_law(solved, stress, strain)

    def by_law(self, function: Callable[..., Array], *fields: Array) -> Array:
        """``function(law, *fields)`` with the law of each point, for fields (..., n, m)."""
        if self._law is not None:
            return function(self._law, *fields)
        return np.concatenate([function(law, *(f[..., columns] for f in fields))
                               for columns, law in self.laws], axis=-1)

    def of_layers(self, of: Callable[..., Any], X: Array, e: Array) -> Any:
        """``of(layer, X, e)`` with the layer of each point X, shapes (2, n, m) and (n,)."""
        return np.concatenate([np.broadcast_to(of(layer, X[..., at], e), X[0, :, at].shape)
                               for layer, at in zip(self.beam.across.layers,
                                                    self.intervals.layers)],
                              axis=-1)

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Sampling points along an element, (p,), and the element stress there, (3, ne, p, m)."""
        if isinstance(self.forces, Together):
            samples = [one.samples for one in self._parts]
            return samples[0][0], np.stack([each for _, each in samples], axis=1)
        beam, x = self.beam, self.beam.element.sampling.places("xx")
        eta, u, e = self.intervals.eta, self._u, np.arange(self.beam.mesh.nelements)
        X = np.array([np.repeat(x, len(eta)), np.tile(eta, len(x))])
        stress = on_grid(stress_at, beam, u, X, None)
        for factor, eigen in self.forces.eigen:
            stress = stress - eigen.stress_at(u, X, e, factor)
        stress = stress.reshape(3, len(e), len(x), len(eta))
        if beam.element.sections == "linear":
            return np.array([0.5]), stress.mean(axis=-2, keepdims=True)
        return x, stress

    def segment_of(self, e: Array, xi: Array, after: Any = False) -> Array:
        """Segment numbers (n,) of sections; at a cut that before it, or ``after``."""
        cuts = self.forces.cuts
        at_node = np.minimum(xi, 1.0 - xi) < SNAP
        place = e + np.where(at_node, np.round(xi), xi)
        inside = cuts[cuts % 1.0 != 0]
        if len(inside):
            nearest = inside[np.argmin(np.abs(place[:, None] - inside), axis=1)]
            place = np.where(np.abs(place - nearest) < AT_CUT, nearest, place)
        before = ((xi > 1.0 - SNAP) | ~at_node) & ~np.asarray(after)
        found = np.where(before, np.searchsorted(cuts, place),
                         np.searchsorted(cuts, place, side="right")) - 1
        return np.clip(found, 0, len(cuts) - 2)

    def at(self, e: Array, X: Array, rows: slice = slice(7)) -> Array:
        """Rows of strain, stress and angle (7 in all) at points X (2, n); shape (rows, n)."""
        xi, eta = X
        if self.intervals.moves:
            eta = self.intervals.place(eta, self._heights(e, xi))
        s, weights, segment = self.arc.at(e, xi), self.intervals.weights(eta), self.segment_of(
            e, xi)
        out = np.empty((len(range(*rows.indices(7))), len(s)))
        for k in np.unique(segment):
            on = segment == k
            one = self.segments[k]
            out[:, on] = one.splined(one.result[:, :, rows], s[on], weights[on])
        return out
