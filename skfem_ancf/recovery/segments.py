"""The recovered field between two stations: steps 2 to 4 of :mod:`skfem_ancf.recovery`."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from scipy.linalg import solve_banded

from ..core.kept import cached_property, kept
from ..core.linear import angle_of, unwrapped
from ..mesh.mapping import cross
from .section_forces import NotRecovered, Sections
from ..sections.jumps import beside
from ..beam.distribution import AXIS

if TYPE_CHECKING:
    from ..core.types import Array

#: Rounds of steps 2 and 3, and the change of the stretch, relative to its largest, at which they
#: end; of those that contract slowly.
ROUNDS, SETTLED = 6, 1e-7
MOST, SLOWLY = 30, 1e-4

#: Part of an element beside a load or a joint that has no sections of its own, up to this. Alone
#: between two of them it has those of the whole element.
CLOSE = 0.02

#: Iterations of the balance of a section in a round, and at most after the last one.
BALANCE, BALANCE_AT_END = 2, 10

#: Sections up to which the derivative along the axis is a matrix.
FEW = 128

#: Points that are evaluated at once.
CHUNK = 2048

#: Within INNER heights of an end of a piece the elements' own stress is used, from LAYER heights on
#: no longer. Not at all if the elements there are longer than COARSE heights; if they are longer
#: than FINE, in part.
INNER, LAYER, FINE, COARSE = 0.5, 1.2, 0.25, 0.5


def smoothed(s: Array, values: Array, length: float) -> Array:
    """The solution f of ``f - length^2 f'' = values`` with f' = 0 at both ends.

    Parameters
    ----------
    s
        Places, increasing, shape (n,).
    values
        Shape (..., n, m).
    length
        Length below which waves are damped.

    Returns
    -------
    ndarray
        Shape (..., n, m).
    """
    d = np.diff(s)
    w = 0.5 * (np.append(d, 0.0) + np.append(0.0, d))
    c = length**2 / d
    band = np.zeros((3, len(s)))
    band[0, 1:], band[2, :-1] = -c, -c
    band[1] = w + np.append(c, 0.0) + np.append(0.0, c)
    right = np.moveaxis(w[:, None] * values, -2, 0)
    found = solve_banded((1, 1), band, right.reshape(len(s), -1), overwrite_b=True,
                         check_finite=False)
    return np.moveaxis(found.reshape(right.shape), 0, -2)


class Piece:
    """The field between two stations: on sections, at nodes and middles of the elements.

    Arrays of several states have their axis before those of sections and points: "..." below.

    Parameters
    ----------
    recovery
        The :class:`~skfem_ancf.recovery.Recovery` of which it is a part.
    start, end
        Element + xi of both stations.

    Attributes
    ----------
    s
        Arc length of the sections, (n,).
    strain, stress
        At the sections and the points ``eta``, (3, ..., n, m).
    angle
        Direction of the fibres along the axis, (..., n, m), in radians.
    rate
        At which the sections turn, (..., n).
    change
        Of the stretch in the last round, (...).
    """

    def __init__(self, recovery: Any, start: float, end: float) -> None:
        self.recovery, self.forces = recovery, recovery.forces
        #: Sections of cables keep their height where the axis is stretched.
        self.rigid = not recovery.beam.has_sections
        mesh = recovery.beam.mesh
        e = np.arange(int(np.floor(start)), int(np.ceil(end)))
        a, b = np.maximum(start - e, 0.0), np.minimum(end - e, 1.0)
        far = b - a > CLOSE
        if np.any(far):  # derivatives by sections that are near each other are round-off
            e, a, b = e[far], a[far], b[far]
        if np.any((a > 0) & (b < 1)):
            raise NotRecovered("two point loads act inside of one element: put a node at them")
        side = np.where(a > 0, 1.0, np.where(b < 1, 0.0, 0.5))
        if not np.any(far):  # the field on whole elements, under the section force of this part
            a, b = 0.0 * a, 0.0 * b + 1.0
        whole = (a == 0) & (b == 1)
        self.elements = e[whole] if np.any(whole) else e
        self.e = np.append(np.repeat(e, 2), e[-1])
        self.xi = xi = np.append(np.stack([a, 0.5 * (a + b)], 1).ravel(), b[-1])
        self.s = recovery.arc(self.e, xi)
        self.R, self.M = self.forces.at(self.e, xi, np.append(np.repeat(side, 2), side[-1]))
        self.Rv = self.Mv = None
        if self.forces.viscous is not None:
            self.Rv, self.Mv = self._viscous()
            self.R, self.M = self.R - self.Rv, self.M - self.Mv
        eta, across = recovery.eta, recovery.beam.across
        at = recovery.moved(self.e, xi)
        if at is not None:
            eta = at.eta
        sections = Sections(self.forces, self.e, xi, eta, self.forces.lifted,
                            mapping=recovery.geometry)
        axis, X = Sections(self.forces, self.e, xi, np.array([0.5]),
                           mapping=recovery.geometry), beside(sections.X)
        speed = np.hypot(*axis.J[:, 0, :, 0])
        h, slope = mesh.mapping().height(sections.X[0], self.e)
        self.Y, self.lean = h * (eta - 0.5), slope / speed[:, None] * (eta - 0.5)
        self.span, self.swell, self.moved = h, slope / (speed[:, None] * h), at
        if at is None:
            self.width = recovery.panels.width * (
                recovery.of_slabs(across.breadth, X, self.e) + 0.0 * X[0])
        else:
            self.span, rate = h * at.stretch, slope / speed[:, None]
            self.lean, self.swell = self.lean + h * rate * at.drift, self.swell + rate * at.swell
            self.width = recovery.of_slabs(across.width, X, self.e)
        self.grade = recovery.of_slabs(across.grade, X, self.e)
        self.g = sections.volume / (speed[:, None] * h)
        self.E0 = sum(np.moveaxis(np.multiply.outer(factor, eigen.strain_at(X, self.e)),
                                  np.ndim(factor), 0) for factor, eigen in self.forces.eigen)
        self._E0_along = 0.0 if isinstance(self.E0, int) else self.E0[0]
        area = self.integral(1.0)[:, None]
        self.below = self.from_bottom(self.width) / area
        axis_load = axis.sampled(AXIS) / (area * speed[:, None])
        self.body = self.g * (sections.body + axis_load)
        self.faces = [self._face(k) / speed for k in (0, 1)]
        self.bubble = self._jourawski()
        r = axis.field(self.forces.q, slope=True)
        self.raw_angle = unwrapped(angle_of(r[0, ..., 0], r[1, ..., 0]))
        self.phi = self.raw_angle
        self._solve()

    def _face(self, side):
        """Force per xi on the bottom (0) or top (1), (2, ..., n)."""
        at = Sections(self.forces, self.e, self.xi, np.array([float(side)]))
        force = at.face(side)
        if np.any(force):  # a circle has no face
            force = self.recovery.beam.across.face(side, at.X, self.e) * force
        return force[..., 0]

    def _jourawski(self):
        """Shear stress in bending but for a factor: first moment of E dA beyond, over the width.

        Of a rectangle of one material a parabola.
        """
        E = self.grade * self.recovery.modulus(np.zeros((3, *self.g.shape)))
        centre = (self.integral(E * self.Y) / self.integral(E))[:, None]
        return self.from_bottom(self.width * E * (centre - self.Y)) / self.width

    def _viscous(self):
        """The part of force and moment that resists the rate of the strain, splined."""
        at = self.elements
        s = self.recovery.arc(at, np.full(len(at), 0.5))
        R, M = (x[..., at] for x in self.forces.viscous_middles())
        if len(s) == 1:
            return R + 0.0 * self.R, M + 0.0 * self.M
        return tuple(scipy.interpolate.CubicSpline(s, x, axis=-1)(self.s) for x in (R, M))

    def of(self, k: int) -> Piece:
        """The field of one of several states."""
        one = copy(self)
        one.strain, one.stress = self.strain[:, k], self.stress[:, k]
        one.angle, one.rate = self.angle[k], self.rate[k]
        return one

    @cached_property
    def _matrices(self):
        """Of values (n,) at the sections their derivative along the axis, by a cubic spline, the
        integral of that spline, what :func:`smoothed` makes of them, and the spline.
        """
        def make():
            one = np.eye(len(self.s))
            spline = scipy.interpolate.CubicSpline(self.s, one)
            return spline(self.s, 1), spline.antiderivative()(self.s), smoothed(
                self.s, one, self._short), spline.c

        return kept(self.recovery.beam.tables, ("sections", self.s.tobytes()), make)

    @property
    def _short(self):
        """Waves that are shorter than this would grow from round to round."""
        return 0.5 * self.recovery.beam.mesh.height

    @cached_property
    def _line(self):
        """From values (n,) at the sections to those of the straight line that fits them best."""
        s = self.s - self.s.mean()
        return s[:, None] * s / (s @ s) + 1.0 / len(s)

    def d_ds(self, values: Array) -> Array:
        """The derivative along the axis of values (..., n, m), by a cubic spline."""
        if len(self.s) > FEW:
            return scipy.interpolate.make_interp_spline(self.s, values, axis=-2)(self.s, 1)
        return self._matrices[0] @ values

    def along(self, values: Array) -> Array:
        """The integral along the axis of values (..., n), by a cubic spline."""
        if len(self.s) > FEW:
            spline = scipy.interpolate.CubicSpline(self.s, values, axis=-1)
            return spline.antiderivative()(self.s)
        return values @ self._matrices[1].T

    def table(self, values: Array) -> Table:
        """The Table of values (7, ..., n, m)."""
        if len(self.s) > FEW:
            return Table(self.s, scipy.interpolate.CubicSpline(
                self.s, np.moveaxis(values, -2, 0)).c)
        return Table(self.s, np.tensordot(self._matrices[3], values, (2, -2)))

    def smoothed(self, values: Array) -> Array:
        """Values (..., n, m) without waves that are shorter than half the height."""
        if len(self.s) > FEW:
            return smoothed(self.s, values, self._short)
        return self._matrices[2] @ values

    def across(self, values: Any) -> Array:
        """The integral over the height of values (..., n, m)."""
        return (self.span * values) @ self.recovery.panels.whole

    def integral(self, values: Any) -> Array:
        """The integral over the section, with the width, of values (..., n, m)."""
        return self.across(self.width * values)

    def from_bottom(self, values: Array) -> Array:
        """The integral from the bottom to each point of values (..., n, m)."""
        if self.moved is None:
            return self.span * (values @ self.recovery.panels.from_bottom.T)
        return (self.span * values) @ self.recovery.panels.from_bottom.T

    def from_axis(self, values: Array) -> Array:
        """The integral from the axis to each point of values (..., n, m)."""
        if self.moved is None:
            return self.span * (values @ self.recovery.panels.from_axis.T)
        h = self.span / self.moved.stretch
        return self.from_bottom(values) - np.sum(h * values * self.moved.till_axis, axis=-1)[
            ..., None]

    def at_axis(self, values: Array) -> Array:
        """Values (..., n, m) on the axis, (..., n)."""
        if self.moved is None:
            return values @ self.recovery.panels.axis
        return np.sum(values * self.moved.axis, axis=-1)

    def slope_from_axis(self, values: Array, d_ds: Array) -> Array:
        """The integral from the axis of the derivative along it, at the same distance from it.

        Parameters
        ----------
        values, d_ds
            Values and their derivative, of points at the same parts of the height or of their
            panel, shape (..., n, m).
        """
        found = self.from_axis(d_ds + self.swell * values) - self.lean * values
        return found if self.moved is None else found + self.at_axis(self.lean * values)[..., None]

    # step 2

    def _strain(self):
        """The strain (3, ..., n, m) with S_yy, S_xy, and the stretch, or S_xx, as they are."""
        r = self.recovery
        if self.stress_given:
            return self.E0 + r.strain_of(self.S / self.grade, self.eps - self.E0)
        if self.rigid:
            eps, self.S[0] = self._fibres(self._fed)
            return eps
        self.eps[0] = 0.5 * (self.stretch**2 - 1.0)
        eps = r.strain_of(self._fed, self.eps - self.E0, (1, 2))
        self.S[0] = self.grade * r.by_law(lambda law, strain: law.stress(strain)[0], eps)
        return eps + self.E0

    def _fibres(self, S):
        """The strain of a cable's fibres, and their S_xx, with S_yy and S_xy as they are in S.

        Hooke's law is that of stretches: P = E (stretch - 1) along a fibre, S_xx = P / stretch.
        """
        r, longer = self.recovery, self.stretch - 1.0
        eps = r.strain_of(S, np.array([longer, 0.0 * longer, 0.0 * longer]) - self.E0, (1, 2))
        P = self.grade * r.by_law(lambda law, strain: law.stress(strain)[0], eps)
        eps = eps + self.E0
        size = 1.0 + 0.5 * longer  # of Green-Lagrange strain over stretch minus 1
        thin = r.by_law(lambda law, xx: law.D[1, 0] / law.D[1, 1] * xx,
                        size * (longer - self._E0_along))
        self.thinner = np.sqrt(1.0 - 2.0 * self.at_axis(thin))
        return np.array([size * longer, size * eps[1], eps[2]]), P / self.stretch

    def _section(self):
        """r_Y along t and n, and P_1 along t and n; (..., n, m) each."""
        self.eps = eps = self._strain()
        lam_y = np.sqrt(1.0 + 2.0 * eps[1])
        if self.rigid:  # a stretch of the axis makes the sections of a cable no thinner
            lam_y = lam_y / self.thinner[..., None]
        lean = self.alpha - np.arcsin(np.clip(eps[2] / (self.stretch * lam_y), -1.0, 1.0))
        self.rY = np.array([-lam_y * np.sin(lean), lam_y * np.cos(lean)])
        self.rX = self.stretch * np.array([np.cos(self.alpha), np.sin(self.alpha)])
        self.P = self.rX * self.S[0] + self.rY * self.S[2]

    def _balance(self, times=BALANCE_AT_END):
        """Change S_xx linearly in Y until the section has its normal force and moment."""
        h = self.recovery.beam.mesh.height
        # short waves would grow from round to round: S_yy holds second derivatives of S_xx
        self._fed = np.concatenate([0.0 * self.S[:1], self.smoothed(self.S[1:])]) / self.grade
        cos, sin = np.cos(self.phi), np.sin(self.phi)
        N, self.Q = cos * self.R[0] + sin * self.R[1], cos * self.R[1] - sin * self.R[0]
        going = np.ones(self.forces.states)
        for _ in range(times):
            self._section()
            E = self.grade * self.recovery.modulus(self.eps - self.E0)
            x, y = self.from_axis(self.rY)
            z, force = y / h, (E if self.rigid else self.S[0] + E * self.stretch**2) / self.g
            # force and moment, and what a stretch and a bending of 1 / g and z / g add to them
            found, moment, one, two, three = self.integral(np.array([
                self.P[0], x * self.P[1] - y * self.P[0], force, z * force, z * z * force]))
            n, m, det = N - found, (self.M - moment) / h, one * three - two * two
            a, b = (three * n + two * m) / det, (-one * m - two * n) / det
            change = (a[..., None] + b[..., None] * z) / self.g * going[..., None, None]
            self.stretch = self.stretch + change
            if self.stress_given:
                self.S[0] += E * self.stretch * change
            going = going * (largest(change) >= 1e-12 * largest(self.eps[0]))
            if not np.any(going):
                break

    # the geometry

    def _turn(self):
        """The rate at which sections turn, the angles of fibres and of the frame."""
        r, along = self.recovery, self.g * self.rX[0]
        total = self.across(self.rY)
        with_faces = along + self.lean * self.rY[0]
        self.rate = (self.d_ds(total[0][..., None])[..., 0]
                     - with_faces @ (r.panels.top - r.panels.bottom)) / total[1]
        dt, dn = self.d_ds(self.rY)
        normal = (self.slope_from_axis(self.rY[1], dn)
                  + self.from_axis(self.rate[..., None] * self.rY[0]))
        self.alpha = np.arcsin(np.clip(normal / (self.g * self.stretch), -1.0, 1.0))
        turned = (self.slope_from_axis(self.rY[0], self.smoothed(dt))
                  - self.from_axis(self.rate[..., None] * self.rY[1]))
        self.stretch = (self.at_axis(along)[..., None] + turned) / (
            self.g * np.cos(self.alpha))
        refuse(~np.all(np.isfinite(self.rate), axis=-1))
        phi = self.along(self.rate)
        self.phi = phi + (self.raw_angle - phi) @ self._line

    # step 3

    def _equilibrium(self):
        """S_xy and S_yy from div P + b = 0 and the loads of the faces."""
        c, s = np.cos(self.phi), np.sin(self.phi)

        def turned(f, c, s):
            return np.array([c * f[0] + s * f[1], -s * f[0] + c * f[1]])

        rate, viscous = self.rate[..., None], self._viscous_stress()
        P = self.width * (self.P + self.rX * viscous[0] + self.rY * viscous[1])
        d0, d1 = self.d_ds(P)
        dP = np.array([d0 - rate * P[1], d1 + rate * P[0]]) + self.width * turned(
            self.body, c[..., None], s[..., None])
        bottom, top = (turned(f, c, s)[..., None] for f in self.faces)
        dP = dP + self.swell * P  # with what leaves oblique faces
        left = top + bottom + self.across(dP)[..., None]
        P2 = left * self.below - bottom - self.from_bottom(dP) + self.lean * P
        P2 = P2 / (self.g * self.width)
        det = cross(self.rX, self.rY)
        self.S = np.array([self.S[0], cross(self.rX, P2) / det,
                           cross(P2, self.rY) / det - viscous[1]])
        self._shear()

    def _viscous_stress(self):
        """S_xx and S_xy that resist the rate of the strain: linear in Y, and a parabola.

        Those of the section's own force and moment of this part.
        """
        if self.Rv is None:
            return 0.0, 0.0
        t, n = (np.array([np.cos(self.phi), np.sin(self.phi)]),
                np.array([-np.sin(self.phi), np.cos(self.phi)]))
        N, Q = np.sum(self.Rv * t, axis=0), np.sum(self.Rv * n, axis=0)
        (x, y), (a, b) = self.from_axis(self.rY), self.rX
        units = self.recovery.modulus(self.eps - self.E0) * self.grade * np.array(
            [1.0 + 0.0 * y, y / self.recovery.beam.mesh.height]) / self.g
        K = np.array([[self.integral(a * unit), self.integral((x * b - y * a) * unit)]
                      for unit in units])
        det = K[0, 0] * K[1, 1] - K[0, 1] * K[1, 0]
        first = (K[1, 1] * N - K[1, 0] * self.Mv) / det
        second = (K[0, 0] * self.Mv - K[0, 1] * N) / det
        S = first[..., None] * units[0] + second[..., None] * units[1]
        bubble = self.bubble
        missing = Q - self.integral(b * S)
        return S, (missing / self.integral(self.rY[1] * bubble))[..., None] * bubble

    def _shear(self):
        """Add Jourawski's shear stress to S_xy, so that the section has its shear force."""
        bubble = self.bubble
        missing = self.Q - self.integral(self.rX[1] * self.S[0] + self.rY[1] * self.S[2])
        self.S[2] += (missing / self.integral(self.rY[1] * bubble))[..., None] * bubble

    def _solve(self):
        shape = self.forces.states + self.g.shape
        self.alpha, self.rate = np.zeros(shape, self.R.dtype), self.phi
        self.eps, self.S = np.zeros((2, 3) + shape, self.R.dtype)
        self.stretch = np.ones(shape, self.R.dtype)
        self.stress_given = False
        self._rounds()
        self._balance()
        weight = self._layers()
        if np.any(weight):
            self.S += weight[:, None] * (self._samples() - self.S)
            self.stress_given = True
            self._balance()
            self._shear()
        self.stress, self.angle = self.S, self.phi[..., None] + self.alpha
        self.strain = self._fibres(self.S / self.grade)[0] if self.rigid else (
            self.E0 + self.recovery.strain_of(self.S / self.grade, self.eps - self.E0))

    def _rounds(self):
        """Steps 2 and 3 in turn, for each state until its stretch has settled."""
        settled = np.zeros(self.forces.states, dtype=bool)
        for k in range(MOST):
            before = self.stretch, self.alpha, self.S.copy(), self.phi, self.rate
            self._balance(BALANCE)
            self._turn()
            self._equilibrium()
            if np.any(settled):
                self.stretch, self.alpha, self.S, self.phi, self.rate = (
                    np.where(settled.reshape(settled.shape + (1,) * places), old, new)
                    for places, old, new in zip((2, 2, 2, 1, 1), before, (
                        self.stretch, self.alpha, self.S, self.phi, self.rate)))
            self.change = largest(self.stretch - before[0])
            settled = settled | (self.change <= largest(self.stretch - 1.0) * (
                SETTLED if k < ROUNDS - 1 else SLOWLY))
            if np.all(settled):
                break

    # step 4

    def _layers(self):
        """How much of the elements' own stress each section takes, (n,): near ends that is fine."""
        r = self.recovery
        if not r.has_stress:
            return np.zeros(len(self.s))
        lengths = np.diff(r.lengths)[self.e]
        weight = np.zeros(len(self.s))
        for k in (0, -1):
            h = np.max(np.broadcast_to(self.span, self.g.shape)[k])
            x = np.abs(self.s - self.s[k]) / h
            size = np.max(lengths[x <= LAYER]) / h
            fine = np.clip((COARSE - size) / (COARSE - FINE), 0.0, 1.0)
            z = np.clip((LAYER - x) / (LAYER - INNER), 0.0, 1.0)
            weight = np.maximum(weight, fine * z * z * (3.0 - 2.0 * z))
        return weight

    def _samples(self):
        """The elements' stress (3, ..., n, m): from where they are most accurate, splined."""
        r = self.recovery
        at, stress = r.samples
        s = r.arc(np.repeat(self.elements, len(at)), np.tile(at, len(self.elements)))
        values = stress[..., self.elements, :, :]
        values = values.reshape(values.shape[:-3] + (len(s), -1))
        if len(s) == 1:
            return np.broadcast_to(values, self.S.shape)
        return scipy.interpolate.CubicSpline(s, values, axis=-2)(self.s)


def refuse(bad: Array) -> None:
    """Raise :class:`NotRecovered` for the fields that have diverged, if there are any.

    Parameters
    ----------
    bad
        True for these, shape (...).
    """
    if np.any(bad):
        raise NotRecovered("the strain is too large: the section has no state of equilibrium", bad)


def largest(values: Array) -> Array:
    """The largest absolute value of each field (..., n, m), shape (...)."""
    return np.max(np.abs(values), axis=(-2, -1))


class Table:
    """Cubic splines along the axis.

    Parameters
    ----------
    s, coefficients
        Arc lengths of the sections, shape (n,), and what is between them, shape
        (4, n - 1, 7, ..., m).
    """

    def __init__(self, s: Array, coefficients: Array) -> None:
        self.starts = s[:-1]
        self._c = coefficients

    def of(self, k: int) -> Table:
        """Those of one of several states."""
        one = copy(self)
        one._c = self._c[:, :, :, k]
        return one

    def many(self, s: Array, weights: Array, rows: slice, columns: Any) -> Array:
        """Values at many places, shape (rows, n).

        Parameters
        ----------
        s, weights
            Their arc lengths, shape (n,), and weights of points across, shape (n, k).
        rows, columns
            Which of the 7, and which points.
        """
        c = np.ascontiguousarray(np.moveaxis(self._c[:, :, rows, columns], 2, 1))
        out = np.empty((c.shape[1], len(s)))
        for first in range(0, len(s), CHUNK):
            part = slice(first, first + CHUNK)
            k = np.maximum(np.searchsorted(self.starts, s[part], side="right") - 1, 0)
            d = (s[part] - self.starts[k])[:, None]
            value = c[0][:, k]
            for power in (1, 2, 3):
                value *= d
                value += c[power][:, k]
            out[:, part] = np.einsum("rnm,nm->rn", value, weights[part])
        return out
