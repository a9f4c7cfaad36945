"""Foundations and drag: force elements at quadrature points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...beam.distribution import AXIS, Facets
from ...beam.kinematics import probe_reference
from ...beam.kernels.section import beam_gradients
from ...beam.layout import Layout, WhichBeam, select_beam
from ...beam.surfaces import groups_of, surfaces_of
from ...core.errors import require_flag, require_not_negative
from ...core.quadrature import gauss
from ...core.types import Place
from ..item import Item
from ..places import Vector
from .base import ForceElement, KernelElement
from .kernels import DRAG, FOUNDATION


class Foundation(ForceElement):
    """Winkler foundation: springs along the normal of a side in the reference configuration.

    Parameters
    ----------
    k
        Stiffness per area: force per area and displacement, zero or positive.
    side
        A place of the boundary, see :func:`skfem_ancf.mesh.places.facets_of`; for a cable it acts
        on the axis.
    one_sided
        It acts in compression only.
    damping
        Force per area and velocity, zero or positive; in compression only, if it is one-sided.
    beam
        Beam, name or number, in a scene of several.
    """

    distributed = True

    def __init__(self, k: float, side: Place = "bottom", one_sided: bool = False,
                 damping: float = 0.0, beam: WhichBeam = None) -> None:
        self.k = require_not_negative("k", k)
        self.damping = require_not_negative("damping", damping)
        self.side, self.one_sided = side, require_flag("one_sided", one_sided)
        self.beam = beam

    def bind(self, layout: Layout) -> list[Vector]:
        beam, first = select_beam(layout.beams, self.beam), layout.offset(self.beam)
        self._at, found = [], surfaces_of(beam, self.side, beam.element.facet_points)
        self.along = (beam, *groups_of(beam.mesh, found))
        for one in found:
            X = one.X if beam.has_sections else np.array([one.X[0], np.full(len(one.X[0]), 0.5)])
            for e, areas, normals in zip(one.elements.tolist(), one.areas,
                                         one.normals.transpose(1, 2, 0)):
                for x, area, normal in zip(X.T, areas, normals):
                    dofs, weights = probe_reference(beam, e, x)
                    self._at.append((Vector(np.zeros(2), dofs + first, weights), float(area),
                                     normal))
        return [place for place, _, _ in self._at]

    def parts(self) -> list[KernelElement]:
        none, one = Vector(np.zeros(2)), float(self.one_sided)
        return [KernelElement(FOUNDATION, place, none,
                              (self.k * area, self.damping * area, n[0], n[1], one))
                for place, area, n in self._at]

    def __repr__(self) -> str:
        return f"<Foundation {self.k:g} at {self.side!r}>"


class Drag(ForceElement):
    """Quadratic drag per length of the axis in a medium at rest.

    ``-density width / 2 (normal |v_n| v_n + tangential |v_t| v_t)`` per length of the reference
    axis, with the velocities across and along the axis.

    Parameters
    ----------
    density
        Mass per volume of the medium, zero or positive.
    normal, tangential
        Drag coefficients, zero or positive.
    beam
        Beam, name or number; None for all.

    References
    ----------
    Taylor: "Analysis of the swimming of long and narrow animals", Proceedings of the Royal Society
    A 214 (1952); Morison, O'Brien, Johnson, Schaaf: "The force exerted by surface waves on piles",
    Petroleum Transactions 189 (1950).
    """

    distributed = True

    def __init__(self, density: float, normal: float, tangential: float = 0.0,
                 beam: WhichBeam = None) -> None:
        self.density = require_not_negative("density", density)
        self.normal = require_not_negative("normal", normal)
        self.tangential = require_not_negative("tangential", tangential)
        self.beam = beam

    def expand(self, layout: Layout) -> Sequence[Item]:
        beams = layout.beams if self.beam is None else [select_beam(layout.beams, self.beam)]
        return [self._with(beam=layout.number(beam)) for beam in beams]

    def bind(self, layout: Layout) -> list[Vector]:
        beam, first = select_beam(layout.beams, self.beam), layout.offset(self.beam)
        mesh, mapping = beam.mesh, beam.mesh.mapping()
        xi, w = gauss(beam.element.axis_degree + 1)
        X = np.array([xi, 0.5 + 0.0 * xi])
        length = np.sqrt(np.sum(mapping.DF(X)[:, 0] ** 2, axis=0))  # of the axis, by xi
        slopes, frame = beam_gradients(mesh, beam.element, X)
        every = np.arange(mesh.nelements)
        self.along = beam, [Facets(AXIS, every, every, xi)], ()
        length = length * beam.across.outline(X)
        self._at = []
        for e in range(mesh.nelements):
            for k, x in enumerate(X.T):
                dofs, weights = probe_reference(beam, e, x)
                place = Vector(np.zeros(2), dofs + first, weights)
                slope = Vector(frame[0, e, k], dofs + first, slopes[0, e, k])
                self._at.append((place, slope, float(w[k] * length[e, k])))
        return [place for place, _, _ in self._at]

    def parts(self) -> list[KernelElement]:
        q = 0.5 * self.density
        return [KernelElement(DRAG, place, slope,
                              (q * self.normal * ds, q * self.tangential * ds, 0.0, 0.0, 0.0))
                for place, slope, ds in self._at]

    def __repr__(self) -> str:
        return f"<Drag {self.normal:g}, {self.tangential:g}>"

