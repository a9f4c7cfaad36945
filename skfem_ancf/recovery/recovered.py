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

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebint, chebvander

from ..beam.beam import Beam
from ..beam.distribution import SNAP
from ..beam.remembered import remembers
from ..beam.strains import on_grid, stress_at
from ..core.immutable import cached_property
from ..core.linear import largest
from ..core.quadrature import gauss
from ..core.types import Array, Law
from ..formulations.base import EnhancedContinuum
from ..materials import LinearLaw
from ..mesh.numbering import by_element
from ..sections import Layer
from ..sections.across import EDGE
from .section_forces import ALONG, NotFound, NotRecovered, SectionForces, Together
from .segments import EACH, Segment

#: Largest relative change of the strain in the last round, and strain that is round-off.
UNSETTLED, TINY = 0.01, 1e-12

#: Sections closer to a cut than this fraction of an element are at the cut.
AT_CUT = 1e-8

#: Least points of the only interval of a section; additional points (to the order N) and least
#: points of one of several; points of an interval of variable width.
ACROSS, MORE, FEW, ROUND = 7, 2, 5, 17


class ArcLength:
    """Arc length along the reference axis; ``nodes`` (ne + 1,) at ends of elements."""

    def __init__(self, beam: Beam) -> None:
        x, w = gauss(ALONG)
        speed = np.hypot(*beam.mesh.mapping().DF(np.array([x, 0.5 + 0.0 * x]))[:, 0])
        series = np.linalg.solve(chebvander(2.0 * x - 1.0, ALONG - 1), speed.T)
        self._inside = chebint(series, lbnd=-1.0, scl=0.5).T
        self.nodes = np.append(0.0, np.cumsum(speed @ w))

    def at(self, e: Array, xi: Array) -> Array:
        """Arc length at xi of elements e, both of shape (n,)."""
        return self.nodes[e] + np.einsum("...k,...k->...", chebvander(
            2.0 * xi - 1.0, ALONG), self._inside[e])


class Interval(NamedTuple):
    """Part of a section from ``low`` to ``high`` (eta), with nodes of a coordinate s in [0, 1].

    Fields are polynomials in s. If ``curved``, ``eta = middle - half cos(pi s)``, which smooths
    widths with square roots at the ends; otherwise eta is linear in s.
    """

    low: float
    high: float
    curved: bool
    nodes: Array
    inverse: Array  # (n, n) from values at the nodes to coefficients of Chebyshev polynomials

    @property
    def eta(self) -> Array:
        """Eta of the nodes."""
        s = 0.5 - 0.5 * np.cos(np.pi * self.nodes) if self.curved else self.nodes
        return self.low + (self.high - self.low) * s

    def local(self, eta: Array) -> Array:
        """s of points eta."""
        s = (eta - self.low) / (self.high - self.low)
        return np.arccos(np.clip(1.0 - 2.0 * s, -1.0, 1.0)) / np.pi if self.curved else s

    def weights(self, s: Array) -> Array:
        """Interpolation weights from the nodes to points s (...), shape (..., n)."""
        return chebvander(2.0 * s - 1.0, len(self.nodes) - 1) @ self.inverse

    def integrals(self, ends: Array) -> Array:
        """Weights (k, n) of the integrals over eta from s = 0 to ends (k,)."""
        x, w = gauss(len(self.nodes) * (2 if self.curved else 1))
        s = ends[:, None] * x
        slope = 0.5 * np.pi * np.sin(np.pi * s) if self.curved else 1.0 + 0.0 * s
        return (self.high - self.low) * np.einsum("kg,kgn->kn", ends[:, None] * w * slope,
                                                  self.weights(s))


class AcrossPoints(NamedTuple):
    """AcrossPoints across sections: arrays (n, m), or (m,) if all sections are equal.

    ``eta`` are the points, ``stretch`` the relative length of their interval; ``drift`` and
    ``swell`` the derivatives of eta and log(stretch) by the height. ``axis`` and ``till_axis`` are
    weights for the value on the axis, and for the integral from the bottom to the axis.
    """

    eta: Array
    stretch: Any
    drift: Any
    swell: Any
    axis: Array
    till_axis: Array


class Intervals:
    """AcrossPoints ``eta`` (m,) across a section of layers, with weights of integrals and values.

    In some tapered sections the relative intervals vary along the axis; ``eta`` then belongs to the
    highest section, and :meth:`points` gives others. ``layers`` are the columns of each layer,
    ``width`` (m,) its relative width. ``from_bottom`` (m, m) and ``whole`` (m,) are weights of
    integrals over eta; ``bottom`` and ``top`` of the values at the ends.
    """

    def __init__(self, layers: Sequence[Layer], order: int) -> None:
        self._measures = [layer.measure for layer in layers]
        pieces = [(piece, m.mean) for m in self._measures for piece in m.pieces]
        self._intervals = [_interval(low, high, callable(b), order, len(pieces) == 1)
                           for (low, high, b), _ in pieces]
        ends = np.cumsum([0] + [len(i.nodes) for i in self._intervals])
        self._columns = [slice(a, b) for a, b in pairwise(ends.tolist())]
        counts = np.cumsum([0] + [len(m.pieces) for m in self._measures])
        self.layers = [slice(ends[a], ends[b]) for a, b in pairwise(counts)]
        self.eta = np.concatenate([i.eta for i in self._intervals])
        self.width = np.concatenate([
            (b(i.eta) if callable(b) else b) / mean + 0.0 * i.eta
            for i, ((_, _, b), mean) in zip(self._intervals, pieces)])
        self._low, self._high = (np.array([getattr(i, end) for i in self._intervals])
                                 for end in ("low", "high"))
        self.moves = self._measures[0].moves
        self.from_bottom, self.whole = self._integrals(self.eta), np.zeros(ends[-1])
        for i, columns in zip(self._intervals, self._columns):
            self.whole[columns] = i.integrals(np.ones(1))
        self.bottom, self.top = self.weights(np.array([self._low[0], self._high[-1]]))

    def _which(self, eta):
        """The interval of each point; the upper one at an interface."""
        return np.searchsorted(self._high[:-1] - EDGE, eta, side="right")

    def weights(self, eta: Array) -> Array:
        """Weights (k, m) of the values at points eta (k,)."""
        which, out = self._which(eta), np.zeros((len(eta), len(self.eta)))
        for k in np.unique(which):
            i, on = self._intervals[k], np.flatnonzero(which == k)
            out[on, self._columns[k]] = i.weights(i.local(eta[on]))
        return out

    def _integrals(self, eta):
        """Weights (k, m) of the integrals from the bottom to eta."""
        which, out = self._which(eta), np.zeros((len(eta), len(self.eta)))
        for k, (i, columns) in enumerate(zip(self._intervals, self._columns)):
            s = np.where(which > k, 1.0, i.local(np.clip(eta, i.low, i.high)))
            out[:, columns] = np.where(which[:, None] < k, 0.0, i.integrals(s))
        return out

    def _ends_at(self, h):
        """Lower and upper ends of the intervals at heights (n,), shape (nintervals, n) both."""
        ends = [m.ends(h) for m in self._measures]
        return (np.concatenate([e[:-1] for e in ends]), np.concatenate([e[1:] for e in ends]))

    def points(self, h: Array) -> AcrossPoints:
        """The points of sections of heights h (n,)."""
        middle = np.array([0.5])
        if not self.moves:
            return AcrossPoints(self.eta, 1.0, 0.0, 0.0, self.weights(middle)[0],
                          self._integrals(middle)[0])
        of = np.repeat(np.arange(len(self._low)), [len(i.nodes) for i in self._intervals])
        size = (self._high - self._low)[of]
        z = (self.eta - self._low[of]) / size
        (low, high), (low2, high2) = ((end[of].T for end in self._ends_at(k * h))
                                      for k in (1.0, 2.0))
        # ends are a + b / h: their derivative is 2 (end(2 h) - end(h)) / h
        low_rate, high_rate = (2.0 * (b - a) / h[:, None] for a, b in ((low, low2), (high, high2)))
        at = self.place(0.5 + 0.0 * h, h)
        return AcrossPoints(low + (high - low) * z, (high - low) / size,
                      low_rate + (high_rate - low_rate) * z, (high_rate - low_rate) / (high - low),
                      self.weights(at), self._integrals(at))

    def place(self, eta: Array, h: Array) -> Array:
        """Map eta (n,) in sections of heights h (n,) to the highest section."""
        if not self.moves:
            return eta
        low, high = self._ends_at(h)
        which = np.sum(eta >= high[:-1], axis=0)
        low, high = (np.take_along_axis(x, which[None], 0)[0] for x in (low, high))
        starts, ends = self._low[which], self._high[which]
        return starts + (ends - starts) * (eta - low) / (high - low)


def _interval(low, high, curved, order, alone):
    """An Interval; the nodes of a single smooth one include its ends."""
    if alone and not curved:
        n = max(ACROSS, 2 * order + 1)
        nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, n))
        nodes[n // 2] = 0.5
    else:
        n = ROUND if curved else max(FEW, order + MORE)
        nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)
    return Interval(low, high, curved, nodes,
                    np.linalg.inv(chebvander(2.0 * nodes - 1.0, n - 1)))


def strain_of_stress(law: Law, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2),
                     tol: float = 1e-10) -> Array:
    """The strain with a given stress under a law, by Newton's method; both (3, ...).

    Only the consecutive components ``unknown`` of ``strain`` are solved for.
    """
    k = list(unknown)
    if isinstance(law, LinearLaw):
        gap, some = stress - law.stress(strain), slice(k[0], k[-1] + 1)
        strain = strain.astype(gap.dtype)
        strain[some] += (law.compliance(tuple(unknown)) @ gap[some].reshape(len(k), -1)).reshape(
            gap[some].shape)
        return strain
    strain = np.array(strain, dtype=np.result_type(strain, stress, float))
    with np.errstate(all="ignore"):
        for _ in range(30):
            found = law.stress(strain)
            gap = (stress - found)[k]
            size = np.max(np.abs(gap))
            if not np.isfinite(size):
                break
            if size <= tol * max(np.max(np.abs(found)), np.max(np.abs(stress))):
                return strain
            D = np.moveaxis(law.moduli(strain)[np.ix_(k, k)], (0, 1), (-2, -1))
            change = np.linalg.solve(D, np.moveaxis(gap, 0, -1)[..., None])[..., 0]
            strain[k] += np.moveaxis(change, -1, 0)
    raise NotFound("no strain has the stress of the section under this law")


def _axial(law, strain):
    """dS_xx / deps_xx at constant S_yy and S_xy, shape (...), for strains (3, ...)."""
    D = law.D if isinstance(law, LinearLaw) else law.moduli(strain)
    det = D[1, 1] * D[2, 2] - D[1, 2] * D[2, 1]
    return 0.0 * strain[0] + D[0, 0] - (
        D[0, 1] * (D[1, 0] * D[2, 2] - D[1, 2] * D[2, 0])
        + D[0, 2] * (D[1, 1] * D[2, 0] - D[1, 0] * D[2, 1])) / det


class Recovery:
    """The recovered fields of one beam, a :class:`~.segments.Segment` between consecutive cuts.

    ``why`` is the reason for section forces without fields, or "", and ``failed`` is True if an
    iteration failed.
    """

    def __init__(self, forces: Any, u: Any) -> None:
        self.forces, self.beam, self._u = forces, forces.beam, u
        beam, layers = self.beam, self.beam.across.layers
        self.why = "" if beam.section.has_fields else (
            f"{beam.section!r} has no shape: strain and stress are those of a rectangle with its "
            "stiffnesses; State.resultants() has the section forces")
        if remembers(beam):
            self.why = "the stress of its material depends on the path of the strain"
        if forces.pressed:
            self.why = ("an obstacle touches it, at points: pressure between them is not known; "
                        "State.resultants() has the section forces")
        self.intervals = Intervals(layers, beam.element.order)
        laws = [layer.material.law(layer.shear) for layer in layers]
        if forces.small or not beam.has_sections:  # linearised laws; a cable has no others
            laws = [law if isinstance(law, LinearLaw) else LinearLaw(law.moduli(np.zeros(3)))
                    for law in laws]
        self.laws = list(zip(self.intervals.layers, laws))
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
            self.segments = self._solved()
        except NotRecovered as why:
            self.failed = why.failed
            self.why = self.why or str(why)

    @cached_property
    def _parts(self):
        """The recovered fields of each of several instants."""
        parts = [copy.copy(self) for _ in self._u]
        for one, forces, u in zip(parts, self.forces.instants, self._u):
            one.forces, one._u = forces, u
        return parts

    @classmethod
    def together(cls, forces: Sequence[SectionForces], u: Sequence[Array]) -> list[Recovery]:
        """The recovered fields of several instants.

        They are solved together if they have the same cuts, and no history of materials.
        """
        if len(forces) > 1 and all(one.beam is forces[0].beam and np.array_equal(
                one.cuts, forces[0].cuts) for one in forces):
            every = cls(Together(forces), u)
            if every.segments:
                for k, one in enumerate(every._parts):
                    one.segments = [segment.part(k) for segment in every.segments]
                    one.why = every.why
                return every._parts
        return [cls(*each) for each in zip(forces, u)]

    def _solved(self):
        found = [Segment(self, a, b) for a, b in pairwise(self.forces.cuts)]
        strain = np.max([largest(segment.stretch - 1.0, EACH) for segment in found], axis=0)
        change = np.max(np.max([segment.change for segment in found], axis=0)
                        / np.maximum(strain, TINY))
        if change > UNSETTLED:
            raise NotFound("the iteration does not converge: the last change of the strain is "
                           f"{change:.0%} of its largest value")
        return found

    def _heights(self, e, xi):
        return (self.beam.mesh.mapping().height(xi[:, None], e)[0] + 0.0 * xi[:, None])[:, 0]

    def points(self, e: Array, xi: Array) -> AcrossPoints:
        """The :class:`.AcrossPoints` across sections at xi of elements e, shapes (n,)."""
        return self.intervals.points(self._heights(e, xi))

    def modulus(self, strain: Array) -> Array:
        """dS_xx / deps_xx at constant S_yy and S_xy, at strains (3, n, m)."""
        return self.by_law(_axial, strain)

    def strain_of(self, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2)) -> Array:
        """:func:`strain_of_stress` with the law of each point, shapes (3, n, m)."""
        return self.by_law(partial(strain_of_stress, unknown=unknown), stress, strain)

    def by_law(self, function: Callable[..., Array], *fields: Array) -> Array:
        """``function(law, *fields)`` with the law of each point, for fields (..., n, m)."""
        if len(self.laws) == 1:
            return function(self.laws[0][1], *fields)
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
        """Segment numbers of sections, (n,); a node at a cut belongs to the segment of its element.

        ``after`` is True for sections on the right of a cut inside an element.
        """
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
            values = self.segments[k].result(s[on])[:, rows]
            out[:, on] = np.einsum("nrm,nm->rn", values, weights[on])
        return out

    @staticmethod
    def gradient(strain: Array, angle: Array) -> Array:
        """Deformation gradient (2, 2, ...) from strain (3, ...) and fibre angle."""
        lam_x, lam_y = np.sqrt(1.0 + 2.0 * strain[:2])
        across = angle + np.arccos(strain[2] / (lam_x * lam_y))
        return np.array([[lam_x * np.cos(angle), lam_y * np.cos(across)],
                         [lam_x * np.sin(angle), lam_y * np.sin(across)]])
