"""Recovered strain and stress: from the section forces and the equilibrium of the body.

The strain of an element at a point is the derivative of its displacement, which is less accurate
than the displacement, and not continuous. Here the fields are found again, for each axial segment
between two places where the section force jumps:

1. The internal forces of the elements give the force and the moment of every section
   (:mod:`skfem_ancf.recovery.section_forces`).
2. The stretch of the fibres follows from the compatibility ``d(r_X)/dY = d(r_Y)/dX``: they turn at
   the rate of their section. This rate and the stretch of the axis are those for which the
   section has its force and moment; S_xx is that of the law.
3. S_xy and S_yy follow from the equilibrium of the body, ``div P + b = 0``, integrated across the
   section from the lower face with its load. What is left at the upper face is spread over the
   area, and Jourawski's shear stress (of a rectangle a parabola) added to S_xy that gives the
   section its shear force. The law's inverse gives eps_yy and eps_xy, which enter step 2: both are
   repeated. Where the width or the law jumps across the section, so do they; P_2 times the width
   does not.
4. This is the solution of Saint-Venant, to high order in h / L. Supports and point loads cause
   boundary layers of the length h besides. Where the elements there are short enough to resolve
   them, their own stress is taken, from where it is most accurate: the mean of two Gauss points,
   put at the element's centre (sections cubic along the axis: at the Gauss points), splined.
"""

from __future__ import annotations

from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..beam.strains import on_grid, stress_at
from ..formulations.ecm import EnhancedContinuum
from ..materials import LinearLaw
from .intervals import Intervals, Points
from .segments import Segment
from ..mesh.refinement import by_element
from .section_forces import ArcLength, NotRecovered, SectionForces
from ..beam.distribution import SNAP

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..core.types import Array, Law

#: Fields that the last round changes by more than this part of the largest strain have not settled;
#: strains below the other are round-off.
UNSETTLED, TINY = 0.01, 1e-12

#: Sections nearer than this part of an element to a cut inside of it are at the cut.
AT_CUT = 1e-8

#: Points that are evaluated at once.
CHUNK = 2048


def strain_of_stress(law: Law, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2),
                     tol: float = 1e-10) -> Array:
    """The strain of a given stress under a law, by Newton's method; both (3, ...).

    Neighbouring components ``unknown`` are found, the others stay as they are in ``strain``;
    ``tol`` is relative to the largest stress. Raises NotRecovered if there is no such strain.
    """
    k = list(unknown)
    strain = np.array(strain, dtype=np.result_type(strain, stress, float))
    if isinstance(law, LinearLaw):
        gap = (stress - law.stress(strain))[k[0]:k[-1] + 1]
        strain[k[0]:k[-1] + 1] += law.compliance(tuple(unknown)).dot(
            gap.reshape(len(k), -1)).reshape(gap.shape)
        return strain
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
    raise NotRecovered("no strain has the stress of the section under this law")


def _axial(law, strain):
    """Change of S_xx with eps_xx while S_yy and S_xy stay, shape (...), of strains (3, ...)."""
    D = law.D if isinstance(law, LinearLaw) else law.moduli(strain)
    det = D[1, 1] * D[2, 2] - D[1, 2] * D[2, 1]
    return 0.0 * strain[0] + D[0, 0] - (
        D[0, 1] * (D[1, 0] * D[2, 2] - D[1, 2] * D[2, 0])
        + D[0, 2] * (D[1, 1] * D[2, 0] - D[1, 0] * D[2, 1])) / det


class Recovery:
    """The recovered field of one beam; raises NotRecovered if there is none.

    Attributes
    ----------
    why : str
        Why there are section forces, but no fields; "" if there are.
    segments
        The :class:`~skfem_ancf.recovery.segments.Segment` between each two cuts.
    """

    def __init__(self, forces: SectionForces, u: Array) -> None:
        self.forces, self.beam, self._u = forces, forces.beam, u
        beam, layers = self.beam, self.beam.across.layers
        self.why = "" if beam.section.has_fields else (
            f"{beam.section!r} does not say what it is made of: strain and stress are those of a "
            "rectangle with these numbers; State.resultants() has what is known")
        self.intervals = Intervals(layers, beam.element.order)
        laws = [layer.material.law(layer.shear) for layer in layers]
        if forces.small:  # the law of small strains
            laws = [law if isinstance(law, LinearLaw) else LinearLaw(law.moduli(np.zeros(3)))
                    for law in laws]
        self.laws = list(zip(self.intervals.layers, laws))
        self.arc = ArcLength(beam)
        #: To the body whose sections turn as its axis at jumps of the curvature.
        self.geometry = None if beam.mesh.sections == "linear" or not len(
            beam.across.bends) else by_element(beam.mesh, beam.across.bends.astype(int)).mapping()
        self.has_stress = (len(layers) == 1 and layers[0].face is None
                           and beam.element.carries_shear_parabola
                           and not isinstance(beam.formulation, EnhancedContinuum))
        self.segments = [Segment(self, a, b) for a, b in pairwise(forces.cuts)]
        strain = max(np.max(np.abs(segment.stretch - 1.0)) for segment in self.segments)
        change = max(segment.change for segment in self.segments) / max(strain, TINY)
        if change > UNSETTLED:
            raise NotRecovered("the fields do not settle: the last of their rounds changes the "
                               f"strain by {change:.0%} of its largest value")

    def _heights(self, e, xi):
        return (self.beam.mesh.mapping().height(xi[:, None], e)[0] + 0.0 * xi[:, None])[:, 0]

    def points(self, e: Array, xi: Array) -> Points:
        """The :class:`.Points` across sections at places xi of elements e, shapes (n,)."""
        return self.intervals.points(self._heights(e, xi))

    def modulus(self, strain: Array) -> Array:
        """Change of S_xx with eps_xx while S_yy and S_xy stay, at strains (3, n, m)."""
        return self.by_law(_axial, strain)

    def strain_of(self, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2)) -> Array:
        """:func:`strain_of_stress` of each point's law, shapes (3, n, m)."""
        return self.by_law(partial(strain_of_stress, unknown=unknown), stress, strain)

    def by_law(self, function: Callable[..., Array], *fields: Array) -> Array:
        """``function(law, *fields)`` with the law of each point, of fields (..., n, m)."""
        return np.concatenate([function(law, *(f[..., columns] for f in fields))
                               for columns, law in self.laws], axis=-1)

    def of_layers(self, of: Callable[..., Any], X: Array, e: Array) -> Any:
        """``of(layer, X, e)`` with the layer of each of the points X, shapes (2, n, m) and (n,)."""
        return np.concatenate([np.broadcast_to(of(layer, X[..., at], e), X[0, :, at].shape)
                               for layer, at in zip(self.beam.across.layers,
                                                    self.intervals.layers)],
                              axis=-1)

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Places along an element, (p,), and its own stress there, (3, ne, p, m)."""
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
        """The number of the segment of each section, (n,); a node at a cut is in its own element's.

        ``after`` is True for sections at a cut inside of an element that are on its right.
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
        return np.clip(found, 0, len(self.segments) - 1)

    def fields(self, X: Array, tind: Array | None = None) -> tuple[Array, Array, Array]:
        """Strain (eps_xx, eps_yy, 2 eps_xy), stress (S_xx, S_yy, S_xy), (3, ne, np), and angle of
        the fibres (ne, np), at reference points (2, np) or (2, ne, np) of the elements ``tind``
        (ne,).
        """
        e = np.arange(self.beam.mesh.nelements) if tind is None else np.asarray(tind)
        shape = (len(e), X.shape[-1])
        X = np.array([np.broadcast_to(x, shape).ravel() for x in X])
        values = self.at(np.repeat(e, shape[1]), X).reshape((7,) + shape)
        return values[:3], values[3:6], values[6]

    def at(self, e: Array, X: Array, rows: slice = slice(7)) -> Array:
        """Rows of strain, stress and angle (7 in all) at reference points X (2, n) of elements;
        (rows, n).
        """
        xi, eta = X
        if self.intervals.moves:
            eta = self.intervals.place(eta, self._heights(e, xi))
        s, weights, segment = self.arc.at(e, xi), self.intervals.weights(eta), self.segment_of(
            e, xi)
        out = np.empty((len(range(*rows.indices(7))), len(s)))
        for k in np.unique(segment):
            on = np.flatnonzero(segment == k)
            for part in np.split(on, range(CHUNK, len(on), CHUNK)):
                values = self.segments[k].result(s[part])[:, rows]
                out[:, part] = np.einsum("nrm,nm->rn", values, weights[part])
        return out

    @staticmethod
    def gradient(strain: Array, angle: Array) -> Array:
        """The deformation gradient, (2, 2, ...), of (eps_xx, eps_yy, 2 eps_xy) and the fibres'
        angle.

        ``F[:, 0]`` and ``F[:, 1]`` are the derivatives of the position along the axis and across
        the section, in global components.
        """
        lam_x, lam_y = np.sqrt(1.0 + 2.0 * strain[:2])
        across = angle + np.arccos(strain[2] / (lam_x * lam_y))
        return np.array([[lam_x * np.cos(angle), lam_y * np.cos(across)],
                         [lam_x * np.sin(angle), lam_y * np.sin(across)]])
