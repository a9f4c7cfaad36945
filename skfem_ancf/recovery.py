"""Recovered strain and stress: from the section forces and the equilibrium of the body.

The strain of an element at a point is the derivative of its displacement, which is less accurate
than the displacement, and not continuous. Here the fields are found again, for each piece of a
beam between two places where its section force jumps:

1. The internal forces of the elements give the force and the moment of every section
   (:mod:`skfem_ancf.section_forces`).
2. The stretch of the fibres follows from the compatibility ``d(r_X)/dY = d(r_Y)/dX``: they turn at
   the rate of their section. This rate and the stretch of the axis are those for which the
   section has its force and moment; S_xx is that of the law.
3. S_xy and S_yy follow from the equilibrium of the body, ``div P + b = 0``, integrated across the
   section from the lower face with its load. What is left at the upper face is spread over the
   area, and Jourawski's shear stress (of a rectangle a parabola) added to S_xy that gives the
   section its shear force. The law's inverse gives eps_yy and eps_xy, which enter step 2: both are
   repeated. Where the width or the law jumps across the section, so do they
   (:mod:`skfem_ancf.panels`): P_2 times the width does not.
4. This is the solution of Saint-Venant, to high order in h / L. Supports and point loads cause
   boundary layers of the length h besides. Where the elements there are short enough to resolve
   them, their own stress is taken, from where it is most accurate: the mean of two Gauss points,
   put at the element's centre (sections cubic along the axis: at the Gauss points), splined.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from copy import copy
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.polynomial.chebyshev import cheb2poly, chebint, chebvander
from scipy import sparse
from scipy.linalg import solve_banded

from .formulations.ecm import EnhancedContinuum
from .kept import kept
from .materials import LinearLaw
from .panels import Moved, Panels
from .point import AGAIN
from .quadrature import gauss
from .refinement import by_element
from .mapping import cross, polynomial
from .sections.jumps import beside
from .section_forces import NotRecovered, SectionForces, Sections, viscous_forces
from .spread import AXIS, SNAP, Sampled, station_of_node, stations_of_vector

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike

    from .beam import Beam
    from .parts import Part
    from .point import Point
    from .results import State
    from .types import Array, Law

#: Rounds of steps 2 and 3 at most, and the change of the stretch, relative to its largest, at which
#: they end.
ROUNDS, SETTLED = 6, 1e-7

#: Iterations of the balance of a section in a round, and at most after the last one.
BALANCE, BALANCE_AT_END = 2, 10

#: Sections up to which the derivative along the axis is a matrix.
FEW = 128

#: Points that are evaluated at once; elements of which arc lengths are kept for single ones.
CHUNK, ELEMENTS = 2048, 4096

#: Within INNER heights of an end of a piece the elements' own stress is used, from LAYER heights on
#: no longer. Not at all if the elements there are longer than COARSE heights; if they are longer
#: than FINE, in part.
INNER, LAYER, FINE, COARSE = 0.5, 1.2, 0.25, 0.5


def strain_of_stress(law: Law, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2),
                     tol: float = 1e-10) -> Array:
    """The strain whose stress is given, by Newton's method.

    Parameters
    ----------
    law
        With ``stress`` and ``moduli``.
    stress
        Of a field of n times m points, shape (3, n, m), or of several, shape (3, ..., n, m); only
        the components ``unknown`` are used.
    strain
        To start from, shape (3, ..., n, m); components not in ``unknown`` keep their values.
    unknown
        Components to find, neighbours.
    tol
        Largest difference of the stress of a field, relative to its largest value.

    Returns
    -------
    ndarray
        As ``strain``.

    Raises
    ------
    NotRecovered
        If there is no such strain.
    """
    k, field = list(unknown), (0, -2, -1)
    strain = np.array(strain, dtype=float)
    if isinstance(law, LinearLaw):
        gap = (stress - law.stress(strain))[k[0]:k[-1] + 1]
        strain[k[0]:k[-1] + 1] += law.compliance(tuple(unknown)).dot(
            gap.reshape(len(k), -1)).reshape(gap.shape)
        return strain
    with np.errstate(all="ignore"):
        for _ in range(30):
            found = law.stress(strain)
            gap = (stress - found)[k]
            size = np.max(np.abs(gap), axis=field)
            if not np.all(np.isfinite(size)):
                left = ~np.isfinite(size)
                break
            left = size > tol * np.maximum(np.max(np.abs(found), axis=field),
                                           np.max(np.abs(stress), axis=field))
            if not np.any(left):
                return strain
            D = np.moveaxis(law.moduli(strain)[np.ix_(k, k)], (0, 1), (-2, -1))
            change = np.linalg.solve(D, np.moveaxis(gap, 0, -1)[..., None])[..., 0]
            strain[k] += left[..., None, None] * np.moveaxis(change, -1, 0)
    raise NotRecovered("no strain has the stress of the section under this law", left)


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


class _Piece:
    """The field between two stations: on sections, at nodes and middles of the elements.

    Arrays of several states have their axis before those of sections and points: "..." below.

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
    """

    def __init__(self, recovery, start, end):
        self.recovery, self.forces = recovery, recovery.forces
        mesh = recovery.beam.mesh
        e = np.arange(int(np.floor(start)), int(np.ceil(end)))
        a, b = np.maximum(start - e, 0.0), np.minimum(end - e, 1.0)
        if np.any((a > 0) & (b < 1)):
            raise NotRecovered("two point loads act inside of one element: put a node at them")
        whole = (a == 0) & (b == 1)
        self.elements = e[whole] if np.any(whole) else e
        side = np.where(a > 0, 1.0, np.where(b < 1, 0.0, 0.5))
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
        area = self.integral(1.0)[:, None]
        self.below = self.from_bottom(self.width) / area
        axis_load = axis.sampled(AXIS) / (area * speed[:, None])
        self.body = self.g * (sections.body + axis_load)
        self.faces = [self._face(k) / speed for k in (0, 1)]
        self.bubble = self._jourawski()
        r = axis.field(self.forces.q, slope=True)
        self.raw_angle = np.unwrap(np.arctan2(r[1, ..., 0], r[0, ..., 0]))
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

    def of(self, k):
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

    def d_ds(self, values):
        """The derivative along the axis of values (..., n, m), by a cubic spline."""
        if len(self.s) > FEW:
            return scipy.interpolate.make_interp_spline(self.s, values, axis=-2)(self.s, 1)
        return self._matrices[0] @ values

    def along(self, values):
        """The integral along the axis of values (..., n), by a cubic spline."""
        if len(self.s) > FEW:
            spline = scipy.interpolate.CubicSpline(self.s, values, axis=-1)
            return spline.antiderivative()(self.s)
        return values @ self._matrices[1].T

    def table(self, values):
        """The _Table of values (7, ..., n, m)."""
        if len(self.s) > FEW:
            return _Table(self.s, scipy.interpolate.CubicSpline(
                self.s, np.moveaxis(values, -2, 0)).c)
        return _Table(self.s, np.tensordot(self._matrices[3], values, (2, -2)))

    def smoothed(self, values):
        """Values (..., n, m) without waves that are shorter than half the height."""
        if len(self.s) > FEW:
            return smoothed(self.s, values, self._short)
        return self._matrices[2] @ values

    def across(self, values):
        """The integral over the height of values (..., n, m)."""
        return (self.span * values) @ self.recovery.panels.whole

    def integral(self, values):
        """The integral over the section, with the width, of values (..., n, m)."""
        return self.across(self.width * values)

    def from_bottom(self, values):
        """The integral from the bottom to each point of values (..., n, m)."""
        if self.moved is None:
            return self.span * (values @ self.recovery.panels.from_bottom.T)
        return (self.span * values) @ self.recovery.panels.from_bottom.T

    def from_axis(self, values):
        """The integral from the axis to each point of values (..., n, m)."""
        if self.moved is None:
            return self.span * (values @ self.recovery.panels.from_axis.T)
        h = self.span / self.moved.stretch
        return self.from_bottom(values) - np.sum(h * values * self.moved.till_axis, axis=-1)[
            ..., None]

    def at_axis(self, values):
        """Values (..., n, m) on the axis, (..., n)."""
        if self.moved is None:
            return values @ self.recovery.panels.axis
        return np.sum(values * self.moved.axis, axis=-1)

    def slope_from_axis(self, values, d_ds):
        """The integral from the axis of the derivative along it, at the same distance from it.

        Values and their derivative are those of (..., n, m) points at the same parts of the height,
        or of their panel.
        """
        found = self.from_axis(d_ds + self.swell * values) - self.lean * values
        return found if self.moved is None else found + self.at_axis(self.lean * values)[..., None]

    # step 2

    def _strain(self):
        """The strain (3, ..., n, m) with S_yy, S_xy, and the stretch, or S_xx, as they are."""
        r = self.recovery
        if self.stress_given:
            return self.E0 + r.strain_of(self.S / self.grade, self.eps - self.E0)
        self.eps[0] = 0.5 * (self.stretch**2 - 1.0)
        eps = r.strain_of(self._fed, self.eps - self.E0, (1, 2))
        self.S[0] = self.grade * r.by_law(lambda law, strain: law.stress(strain)[0], eps)
        return eps + self.E0

    def _section(self):
        """r_Y along t and n, and P_1 along t and n; (..., n, m) each."""
        self.eps = eps = self._strain()
        lam_y = np.sqrt(1.0 + 2.0 * eps[1])
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
            z, force = y / h, (self.S[0] + E * self.stretch**2) / self.g
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
        self.alpha, self.eps, self.rate = np.zeros(shape), np.zeros((3,) + shape), self.phi
        self.S, self.stretch = np.zeros((3,) + shape), np.ones(shape)
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
        self.strain = self.E0 + self.recovery.strain_of(self.S / self.grade, self.eps - self.E0)

    def _rounds(self):
        """Steps 2 and 3 in turn, for each state until its stretch has settled."""
        settled = np.zeros(self.forces.states, dtype=bool)
        for _ in range(ROUNDS):
            before = self.stretch, self.alpha, self.S.copy(), self.phi, self.rate
            self._balance(BALANCE)
            self._turn()
            self._equilibrium()
            if np.any(settled):
                self.stretch, self.alpha, self.S, self.phi, self.rate = (
                    np.where(settled.reshape(settled.shape + (1,) * places), old, new)
                    for places, old, new in zip((2, 2, 2, 1, 1), before, (
                        self.stretch, self.alpha, self.S, self.phi, self.rate)))
            settled = settled | (largest(self.stretch - before[0])
                                 <= SETTLED * largest(self.stretch - 1.0))
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


def _axial(law, strain):
    """Change of S_xx with eps_xx while S_yy and S_xy stay, shape (...), of strains (3, ...)."""
    D = law.D if isinstance(law, LinearLaw) else law.moduli(strain)
    det = D[1, 1] * D[2, 2] - D[1, 2] * D[2, 1]
    return 0.0 * strain[0] + D[0, 0] - (
        D[0, 1] * (D[1, 0] * D[2, 2] - D[1, 2] * D[2, 0])
        + D[0, 2] * (D[1, 1] * D[2, 0] - D[1, 0] * D[2, 1])) / det


def _geometry(beam):
    """The mapping to the body whose sections turn as its axis at jumps of the curvature, if that
    is not the mapping of the mesh.
    """
    if beam.mesh.sections == "linear" or not len(beam.across.bends):
        return None
    return by_element(beam.mesh, beam.across.bends.astype(int)).mapping()


class _Table:
    """Cubic splines along the axis: coefficients (4, n - 1, 7, ..., m) between sections s (n,)."""

    def __init__(self, s, coefficients):
        self.starts = s[:-1]
        self._list = self.starts.tolist()
        self._c = coefficients

    def of(self, k):
        """Those of one of several states."""
        one = copy(self)
        one._c = self._c[:, :, :, k]
        return one

    @cached_property
    def _cubics(self):
        """The coefficients as single points take them, (n - 1, 7, 4, m)."""
        return np.ascontiguousarray(np.moveaxis(self._c, 0, 2))

    def one(self, s, weights, rows):
        """The rows at one place, for the weights (m,) of the points across; a list of numbers."""
        k = max(bisect_right(self._list, s) - 1, 0)
        d = s - self._list[k]
        return [((a * d + b) * d + c) * d + e
                for a, b, c, e in self._cubics[k, rows].dot(weights).tolist()]

    def many(self, s, weights, rows, columns):
        """The rows (rows, n) at places (n,), for weights (n, k) of the points of some columns."""
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


class Recovery:
    """The recovered field of one beam, in one state or in several at once.

    What several states have in common is made once, and the sections of all of them are solved
    together; :meth:`of` is the field of one.

    Parameters
    ----------
    forces
        The :class:`~skfem_ancf.section_forces.SectionForces` of the beam.
    u
        Displacement of its coordinates, shape (N,), or (states, N).

    Raises
    ------
    NotRecovered
        If the fields cannot be recovered.
    """

    def __init__(self, forces: SectionForces, u: Array) -> None:
        self.forces, self.beam = forces, forces.beam
        beam = self.beam
        #: Why it has section forces, but no fields; "" if it has.
        self.why = "" if beam.section.has_fields else (
            f"{beam.section!r} does not say what it is made of: strain and stress are those of a "
            "rectangle with these numbers; State.resultants() has what is known")
        slabs = beam.across.slabs
        if not all(hasattr(slab.measure, "pieces") for slab in slabs):
            raise NotRecovered(f"{beam.section!r} has a measure that does not say its width: give "
                               "it pieces and mean, as Weighted has")
        self.panels = kept(beam.tables, "across", lambda: Panels(slabs, beam.element.order))
        #: Where the points of :attr:`panels` are, of those that move where the section is highest.
        self.eta = self.panels.eta
        self.laws = [(columns, slab.material.law(slab.shear))
                     for slab, columns in zip(slabs, self.panels.slabs)]
        self.lengths, self._inside, self._arcs = kept(beam.tables, "arc", self._arc_tables)
        self.geometry = kept(beam.tables, "geometry", lambda: _geometry(beam))
        self.has_stress = (len(slabs) == 1 and slabs[0].face is None
                           and beam.element.carries_shear_parabola
                           and not isinstance(beam.formulation, EnhancedContinuum))
        self._u = u
        self.pieces = [_Piece(self, a, b) for a, b in zip(forces.cuts[:-1], forces.cuts[1:])]
        for piece in self.pieces:
            refuse(~np.all(np.isfinite(piece.strain), axis=(0, -2, -1)))
        self._tables = [p.table(np.concatenate([p.strain, p.stress, p.angle[None]]))
                        for p in self.pieces]
        self._cuts = forces.cuts.tolist()

    def moved(self, e: Array, xi: Array) -> Moved | None:
        """Where the points across are at sections, if not at :attr:`eta` in all of them.

        Parameters
        ----------
        e, xi
            Elements of the sections and places along them, shapes (n,).
        """
        if not self.panels.moving:
            return None
        return kept(self.beam.tables, ("moved", e.tobytes(), xi.tobytes()),
                    lambda: self.panels.moved(self._height(e, xi)))

    def _height(self, e, xi):
        """Of sections on a tapered mesh: numbers or arrays (n,)."""
        mesh = self.beam.mesh
        return mesh.height * mesh.mapping().relative_height(e, xi)[0]

    def modulus(self, strain: Array) -> Array:
        """Change of S_xx with eps_xx while S_yy and S_xy stay, at strains (3, ...)."""
        return self.by_law(_axial, strain)

    def strain_of(self, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2)) -> Array:
        """:func:`strain_of_stress` of each point's law, at the points across sections.

        Parameters
        ----------
        stress, strain, unknown
            As there, shapes (3, ..., n, m).
        """
        return self.by_law(partial(strain_of_stress, unknown=unknown), stress, strain)

    def by_law(self, function: Callable[..., Array], *fields: Array) -> Array:
        """A function of a law and of fields (..., n, m), of the law that each point has.

        Parameters
        ----------
        function
            Takes the law and the fields where it is that of the material.
        *fields
            At the points across sections, shape (..., n, m).
        """
        if len(self.laws) == 1:
            return function(self.laws[0][1], *fields)
        return np.concatenate([function(law, *(f[..., columns] for f in fields))
                               for columns, law in self.laws], axis=-1)

    def of_slabs(self, of: Callable[..., Any], X: Array, e: Array) -> Any:
        """What a method of Across says of each slab at its points.

        Parameters
        ----------
        of
            Takes a slab, points and elements.
        X, e
            Points across sections, shape (2, n, m), and elements, shape (n,).
        """
        slabs = self.beam.across.slabs
        if len(slabs) == 1:
            return of(slabs[0], X, e)
        return np.concatenate([np.broadcast_to(of(slab, X[..., at], e), X[0, :, at].shape)
                               for slab, at in zip(slabs, self.panels.slabs)], axis=-1)

    def of(self, k: int) -> Recovery:
        """The field of one of several states.

        Parameters
        ----------
        k
            Its number.
        """
        one = copy(self)
        one.forces, one._u = self.forces.of(k), self._u[k]
        one.pieces = [piece.of(k) for piece in self.pieces]
        one._tables = [table.of(k) for table in self._tables]
        return one

    def _arc_tables(self):
        x, w = gauss(8)
        axis = self.beam.mesh.mapping().DF(np.array([x, np.full(8, 0.5)]))[:, 0]
        speed = np.hypot(*axis)
        series = np.linalg.solve(chebvander(2.0 * x - 1.0, 7), speed.T)
        inside = chebint(series, lbnd=-1.0, scl=0.5).T  # (ne, 9): the length from xi = 0
        return np.append(0.0, np.cumsum(speed @ w)), inside, {}

    def arc(self, e: ArrayLike, xi: ArrayLike) -> Array:
        """Arc length along the stress-free axis of places of elements.

        Parameters
        ----------
        e, xi
            Elements and places on [0, 1] along them, of any shapes (...) that fit.

        Returns
        -------
        ndarray
            Shape (...).
        """
        e, xi = np.broadcast_arrays(e, xi)
        if self.beam.mesh.is_straight:
            return self.lengths[e] + xi * (self.lengths[e + 1] - self.lengths[e])
        return self.lengths[e] + np.einsum("...k,...k->...", chebvander(2.0 * xi - 1.0, 8),
                                           self._inside[e])

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Places along an element, (p,), and its own stress there, (3, ..., ne, p, m)."""
        beam, x = self.beam, self.beam.element.sampling.places("xx")
        X = np.array([np.repeat(x, len(self.eta)), np.tile(self.eta, len(x))])
        stress = beam.stress(self._u, X) if self._u.ndim == 1 else np.stack(
            [beam.stress(u, X) for u in self._u], axis=1)
        for factor, eigen in self.forces.eigen:
            e = np.arange(beam.mesh.nelements)
            stress = stress - (eigen.stress_at(self._u, X, e, factor) if self._u.ndim == 1 else
                               np.stack([eigen.stress_at(u, X, e, f)
                                         for u, f in zip(self._u, factor)], axis=1))
        stress = stress.reshape(stress.shape[:-1] + (len(x), len(self.eta)))
        if beam.element.sections == "linear":
            return np.array([0.5]), stress.mean(axis=-2, keepdims=True)
        return x, stress

    def fields(self, X: Array, tind: Array | None = None) -> tuple[Array, Array, Array]:
        """Strain (eps_xx, eps_yy, 2 eps_xy), stress (S_xx, S_yy, S_xy) and angle of the fibres.

        Parameters
        ----------
        X
            Reference points, (2, npoints) or (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        strain, stress, angle
            Shapes (3, ne, np), (3, ne, np) and (ne, np).
        """
        e = np.arange(self.beam.mesh.nelements) if tind is None else np.asarray(tind)
        shape = (len(e), X.shape[-1])
        xi, eta = (np.broadcast_to(x, shape).ravel() for x in X)
        e = np.broadcast_to(e[:, None], shape).ravel()
        values = self._values(self._places(e, xi, eta), slice(7)).reshape((7,) + shape)
        return values[:3], values[3:6], values[6]

    def at(self, part: Part, rows: slice = slice(7)) -> Array:
        """Rows of strain, stress and angle (7 in all) at points of the beam; (rows, n).

        Parameters
        ----------
        part
            The :class:`~skfem_ancf.parts.Part` with the points.
        rows
            A slice of the seven rows.
        """
        places = part.tables.get("recovery")
        if places is None:
            places = part.tables["recovery"] = self._places(part.e, *part.X)
        return self._values(places, rows)

    def at_point(self, point: Point, rows: slice) -> list[float]:
        """As :meth:`at`, of a single point, as a list of numbers.

        Parameters
        ----------
        point
            The :class:`~skfem_ancf.point.Point`.
        rows
            A slice of the seven rows.
        """
        known = point.recovery
        if not known:
            new = self._place(*point.place)
            known, point.recovery = new, AGAIN if known is None else new
        station, end, s, weights = known
        find = bisect_left if end else bisect_right
        piece = min(max(find(self._cuts, station) - 1, 0), len(self._tables) - 1)
        return self._tables[piece].one(s, weights, rows)

    def _place(self, e, xi, eta):
        """As :meth:`_places`, of one point."""
        end = xi > 1.0 - SNAP
        station = e + (1.0 if end else 0.0 if xi < SNAP else xi)
        if self.panels.moving:
            eta = self.panels.place(eta, self._height(e, xi))
        return station, end, self._arc_of_one(e, xi), self.panels.values(eta)

    def _arc_of_one(self, e, xi):
        if self.beam.mesh.is_straight:
            start, end = self.lengths[e:e + 2].tolist()
            return start + xi * (end - start)
        found = self._arcs.get(e)
        if found is None:
            found = kept(self._arcs, e, lambda: self._arc_in(e), ELEMENTS)
        start, inside = found
        return start + polynomial(inside, 2.0 * xi - 1.0)

    def _arc_in(self, e):
        """Of one element the arc length where it begins, and in it, a polynomial of 2 xi - 1.

        Without terms of round-off.
        """
        inside = self._inside[e]
        last = np.max(np.nonzero(np.abs(inside) > 1e-17 * inside[0]))
        return float(self.lengths[e]), cheb2poly(inside[:last + 1]).tolist()

    def _places(self, e, xi, eta):
        """What evaluation at points (n,) needs and does not change with the state.

        Stations, whether they are the right end of their element, arc lengths, and what lies
        across: what :meth:`.panels.Panels.by_panel` returns.
        """
        end = xi > 1.0 - SNAP
        station = e + np.where(end, 1.0, np.where(xi < SNAP, 0.0, xi))
        if self.panels.moving:
            eta = self.panels.place(eta, self._height(e, xi))
        return station, end, self.arc(e, xi), self.panels.by_panel(eta)

    def _values(self, places, rows):
        station, end, s, panels = places
        # a point at a cut that is a node belongs to the piece of its own element
        piece = np.where(end, np.searchsorted(self._cuts, station),
                         np.searchsorted(self._cuts, station, side="right")) - 1
        piece = np.clip(piece, 0, len(self._tables) - 1)
        out = np.empty((len(range(*rows.indices(7))), len(s)))
        for at, columns, weights in panels:
            where, of = s[at], piece[at]
            found = np.empty((len(out), len(where)))
            alone = len(self._tables) == 1
            for k in (0,) if alone else np.unique(of):
                on = slice(None) if alone else of == k
                found[:, on] = self._tables[k].many(where[on], weights[on], rows, columns)
            out[:, at] = found
        return out

    @staticmethod
    def gradient(strain: Array, angle: Array) -> Array:
        """The deformation gradient.

        ``F[:, 0]`` and ``F[:, 1]`` are the derivatives of the position along the axis and across
        the section, in global components.

        Parameters
        ----------
        strain
            (eps_xx, eps_yy, 2 eps_xy), shape (3, ...).
        angle
            Angle of the fibres, in radians, shape (...).

        Returns
        -------
        ndarray
            Shape (2, 2, ...).
        """
        lam_x, lam_y = np.sqrt(1.0 + 2.0 * strain[:2])
        across = angle + np.arccos(strain[2] / (lam_x * lam_y))
        return np.array([[lam_x * np.cos(angle), lam_y * np.cos(across)],
                         [lam_x * np.sin(angle), lam_y * np.sin(across)]])


def actions(state: State) -> list[list[float]]:
    """Where supports and joints act on each beam of a state: element + xi, a list a beam."""
    system = state.system
    t = state.load if state.t is None else state.t
    held = np.zeros(system.N)
    held[system.fixed] = 1.0
    acting = system.forces.acting_rows()
    J = sparse.vstack([system.sparse_jacobian(state.u, t), acting]).tocsc() if (
        system.m or len(acting)) else None
    out: list[list[float]] = []
    for beam, s in zip(system.beams, system.slices):
        nodes = np.nonzero(np.any(held[s].reshape(-1, beam.nd) != 0, axis=1))[0]
        stations = [station_of_node(beam.mesh, int(k)) for k in nodes]
        here = None if J is None else J[:, s]
        for row in () if here is None else here[np.unique(here.indices)].toarray():
            if np.any(row):
                # an equation between neighbouring nodes: at both
                loaded = np.nonzero(np.any(row.reshape(-1, beam.nd) != 0, axis=1))[0]
                stations += (stations_of_vector(beam, row)
                             or [station_of_node(beam.mesh, int(k)) for k in loaded])
        out.append(stations)
    return out


def distributed(states: Sequence[State], beam: Beam) -> tuple[list[Sampled], list[float]]:
    """What force elements that act all along a beam do there, and the stations of other parts.

    Parameters
    ----------
    states
        States of one scene.
    beam
        One of its beams.

    Raises
    ------
    NotRecovered
        If a force element does not say where it acts.
    """
    system = states[0].system
    sampled: list[Sampled] = []
    stations: list[float] = []
    elements = [e for e in system.forces.elements if e.distributed]
    if not elements:
        return sampled, stations
    force = -np.array([system.part_forces(state.u, state.v) for state in states])
    for element in elements:
        if element.along is None:
            raise NotRecovered(f"how {element!r} acts along the beam is not known to it")
        where, facets, at = element.along
        if where is not beam:
            continue
        stations += at
        rows = system.forces.rows_of(element)
        for group in facets:
            w = np.linalg.solve(np.vander(group.xi, increasing=True).T,
                                1.0 / np.arange(1, len(group.xi) + 1))  # of its own rule
            values = force[:, :, rows[len(w) * group.chosen[:, None] + np.arange(len(w))]] / w
            sampled.append(Sampled(group.where, group.elements, group.xi,
                                   values.swapaxes(0, 1)))
    return sampled, stations


def recover(states: Sequence[State], number: int) -> list[Recovery | NotRecovered]:
    """The recovered fields of one beam in some states of a scene, found together.

    Parameters
    ----------
    states
        Each a :class:`~skfem_ancf.results.State`.
    number
        The number of the beam.

    Returns
    -------
    list
        For each state its Recovery, or the NotRecovered that says why there is none.
    """
    loads: list[Any] = []
    alike: dict[Any, list[int]] = {}
    for k, state in enumerate(states):
        u = state.u_of(number)
        loads.append([(state.load * load.factor(state.t), load.spread(u))
                      for load in state.system.loads if load.beam is state.beams[number]])
        # what acts at other places cuts the beam into other pieces
        case: list[Any] = [tuple(state.actions[number])]
        for factor, spread in loads[-1]:
            case += ([None] if spread is None else [spread.stations] if spread.acts_at_stations
                     else [id(spread), factor != 0.0])
        alike.setdefault(tuple(case), []).append(k)
    found: dict[int, Recovery | NotRecovered] = {}
    for same in alike.values():
        found.update(zip(same, _recover_alike([states[k] for k in same], number,
                                              [loads[k] for k in same])))
    return [found[k] for k in range(len(states))]


def _recover_alike(states, number, loads):
    """As :func:`recover`, of states whose loads act at the same places."""
    first, system = states[0], states[0].system
    beam, s = first.beams[number], system.of(first.beams[number])
    try:
        together = [(np.array([of[k][0] for of in loads]), spread)
                    for k, (_, spread) in enumerate(loads[0])]
        u = np.array([state.u[s] for state in states])
        sampled, stations = distributed(states, beam)
        acceleration = None if first.acceleration is None else np.array(
            [(state.acceleration + system.damping_acceleration(state.v))[s] for state in states])
        time = system.retardation[number]
        viscous = None if first.t is None or time == 0.0 else np.array(
            [viscous_forces(beam, state.u[s], state.v[s], time) for state in states])
        with np.errstate(all="ignore"):
            found = Recovery(SectionForces(
                beam, u, together, [*first.actions[number], *stations], acceleration, sampled,
                viscous), u)
        return [found.of(k) for k in range(len(states))]
    except NotRecovered as reason:
        if reason.which is None or len(states) == 1:
            return [reason] * len(states)
        out = []
        good = [k for k, bad in enumerate(reason.which) if not bad]
        rest = iter(_recover_alike([states[k] for k in good], number, [loads[k] for k in good])
                    if good else ())
        for k, bad in enumerate(reason.which):
            out += _recover_alike([states[k]], number, [loads[k]]) if bad else [next(rest)]
        return out
