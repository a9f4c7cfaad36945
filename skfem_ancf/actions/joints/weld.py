"""Weld between sections of two or more beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...beam.beam import Beam
from ...beam.domain import Domain
from ...beam.layout import Layout
from ...core.errors import InputError, require_flag, require_label
from ...core.types import Array
from ..item import Item
from ..places import Vector, each, is_ground, section, several
from .base import Aligned, Joint, angle_to, equations_of, gradients, rotation
from .glue import Glue


class Weld(Joint):
    """Sections that coincide and keep their relative angles of the reference configuration.

    The direction of a section is its best-fit line, so it may warp and change its thickness; for a
    cable it is the tangent.

    Parameters
    ----------
    beams
        Two or more, each a Beam or a RigidBody, its name or number, or "ground".
    at
        The section of each beam, as ``("right", "left")``, or a material point (x, y), also inside
        an element; or one place for all, as a common point ``(1, 0)``.
    apart
        Allow a distance between the points in the reference configuration, which the weld closes.
    """

    constant = False

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None,
                 apart: bool = False) -> None:
        self.beams, self.name = several(beams), require_label("name", name)
        self.apart = require_flag("apart", apart)
        self.at = each(at, "the section of each beam", len(self.beams))
        self.equations = equations_of(("force along x", "force along y", "moment"),
                                      len(self.beams))

    def expand(self, layout: Layout) -> Sequence[Item]:
        """The weld, or a Glue between a boundary of a domain and a member that is not a cable."""
        members = [None if is_ground(beam) else layout.beam(beam) for beam in self.beams]
        which = [k for k, one in enumerate(members) if isinstance(one, Domain)]
        if not which or any(isinstance(one, Beam) and not one.has_sections for one in members):
            return (self,)
        k = which[0]
        return [Glue(layout.number(self.beams[k]), self.at[k], beam, at, self.name)._with(
            _key=self._key) for n, (beam, at) in enumerate(zip(self.beams, self.at)) if n != k]

    def bind(self, layout: Layout) -> None:
        (self.a, d), *others = (
            section(layout, beam, at) for beam, at in zip(self.beams, self.at))
        self.pairs = []
        for b, e in others:
            self._require_together(layout, b)
            self.pairs.append((b, Aligned(d, e, rotation(angle_to(d.start, e.start)))))

    def _require_together(self, layout: Layout, b: Vector) -> None:
        gap = b.start - self.a.start
        beams = [layout.beam(beam) for beam in self.beams if not is_ground(beam)]
        if not self.apart and np.hypot(*gap) > 1e-6 * min(beam.size for beam in beams):
            centre = next((f": of {beam!r} alone it is the centre of mass that is meant, name "
                           "the point, as (body, (x, y)); or" for beam, at in
                           zip(self.beams, self.at) if at is None), ":")
            raise InputError(
                f"the sections to weld are {np.hypot(*gap):.6g} apart, one at "
                f"({self.a.start[0]:.6g}, {self.a.start[1]:.6g}), the other at "
                f"({b.start[0]:.6g}, {b.start[1]:.6g}){centre} name sections that meet, move a "
                f"mesh by mesh.translated(({0 - gap[0]:.6g}, {0 - gap[1]:.6g})), or weld with "
                "apart=True to draw them together")

    def value(self, u: Array, t: float) -> Array:
        a, out = self.a(u), []
        for b, turned in self.pairs:
            out += [*(a - b(u)), turned.value(u)]
        return np.array(out)

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return gradients(*(terms for b, turned in self.pairs for terms in (
            *([(self.a, n), (b, -n)] for n in np.eye(2)), turned.terms(u))))

    def curvature(self, u: Array, t: float, multipliers: Array) -> tuple[Array, Array, Array]:
        i, j, v = zip(*(turned.second(m) for (_, turned), m in zip(self.pairs, multipliers[2::3])))
        return np.concatenate(i), np.concatenate(j), np.concatenate(v)
