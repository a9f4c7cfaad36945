"""Point masses: they add to the mass matrix and to the weight."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...beam.layout import Layout, WhichBeam
from ...core.errors import InputError, require_finite, require_not_negative, shown
from ...core.types import Array
from ..places import Vector, point, section
from .base import ForceElement, KernelElement


class PointMass(ForceElement):
    """A mass on a material point, optionally with a moment of inertia.

    Parameters
    ----------
    mass
        Zero or positive.
    at
        The point (x, y) in the reference configuration, or the name of an end.
    inertia
        Moment of inertia about the point, zero or positive; the point must then be on the section
        of a node.
    beam
        Beam, name or number, in a scene of several.
    """

    def __init__(self, mass: float, at: ArrayLike, inertia: float = 0.0,
                 beam: WhichBeam = None) -> None:
        self.mass = require_not_negative("mass", mass)
        self.inertia = require_not_negative("inertia", inertia)
        self.at = at if isinstance(at, str) else tuple(require_finite("at", at, (2,)).tolist())
        self.beam = beam
        if not self.mass and not self.inertia:
            raise InputError("a point mass needs a mass or an inertia that is positive, got two "
                             "zeros")

    def bind(self, layout: Layout) -> list[Vector]:
        self._masses = [(self.mass, point(layout, self.beam, self.at))]
        if self.inertia:
            self._masses.append((self.inertia, section(layout, self.beam, self.at)[1]))
        return [place for _, place in self._masses]

    def parts(self) -> list[KernelElement]:
        return []

    def mass_entries(self) -> tuple[Array, Array, Array]:
        """Rows, columns and values added to the mass matrix, shapes (k,)."""
        rows, columns, values = [], [], []
        for size, place in self._masses:
            for dofs, weights in zip(place.dofs, place.weights):
                rows.append(np.repeat(dofs, len(dofs)))
                columns.append(np.tile(dofs, len(dofs)))
                values.append(size * np.outer(weights, weights).ravel())
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def __repr__(self) -> str:
        return f"<PointMass {self.mass:g} at {shown(self.at)}>"
