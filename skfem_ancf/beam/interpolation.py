"""Many points of one beam or rigid body: what their coordinates weigh there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError
from ..core.kept import cached_property

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .rigid import RigidBody
    from ..core.types import Array

#: How far from the middle of the section, relative to its height, the axis of a cable reaches.
ON_AXIS = 1e-12


class Part:
    """Points in one beam.

    Parameters
    ----------
    beam, number, coordinates, index, e, X
        As in the attributes.

    Attributes
    ----------
    beam, number
        The beam and its number.
    coordinates : slice
        Those of the beam in its scene.
    index
        Which of the points they are, (n,), or None for all.
    e, X
        Elements (n,) and reference points (2, n).
    n : int
        How many.
    """

    e: Array
    X: Array

    def __init__(self, beam: Any, number: int, coordinates: slice, index: Array | None,
                 e: Array, X: Array) -> None:
        self.beam, self.number, self.coordinates, self.index = beam, number, coordinates, index
        self.n, self.e, self.X = len(e), e, X
        self.tables: dict[Any, Any] = {}  # of others, that depend on the beam and the points only

    @cached_property
    def at(self) -> Array:
        """Reference points as the fields of a beam take them, (2, n, 1)."""
        return self.X[:, :, None]

    @cached_property
    def start(self) -> Array:
        """Positions in the stress-free body, (2, n)."""
        return self.beam.mesh.mapping().F(self.at, self.e)[..., 0]

    @cached_property
    def off_axis(self) -> bool:
        """Points of a cable off its axis: their section turns with the tangent."""
        return not self.beam.has_sections and bool(np.any(np.abs(self.X[1] - 0.5) > ON_AXIS))

    @cached_property
    def dofs(self) -> Array:
        """Coordinates of the scene that move each point, (nb, 2, n)."""
        beam = self.beam
        first = self.coordinates.start + beam.mesh.t[0, self.e] * beam.nd
        return first + np.arange(2 * beam.nd).reshape(-1, 2, 1)

    def _table(self, which):
        """The local functions, 0, or of a cable their derivatives by xi, 1: (nb, n)."""
        beam, series = self.beam, self.beam.series
        table = series.values(series.tables[which], self.X)
        if beam.mesh.heights is not None:
            table *= series.swollen(beam.mesh.mapping().relative_height(self.e, self.X[0])[0])
        return table * beam.scales[self.e].T

    @cached_property
    def weights(self) -> Array:
        """Of these coordinates in the position, (nb, n)."""
        return self._table(0)

    @cached_property
    def slopes(self) -> Array:
        """Of these coordinates in the derivative of the position by xi, (nb, n)."""
        return self._table(1)

    def combine(self, weights: Array, u: Array) -> Array:
        """The sum of weighted coordinates of the scene at each point.

        Parameters
        ----------
        weights
            Shape (nb, n).
        u
            Coordinates of the scene, or their rates, shape (..., N).

        Returns
        -------
        ndarray
            Shape (..., 2, n).
        """
        return sum(w * u[..., d] for w, d in zip(weights, self.dofs))

    def _moving(self, u):
        """Position and slope of changes u (..., N) of the coordinates, four components."""
        return (*np.moveaxis(self.combine(self.weights, u), -2, 0),
                *np.moveaxis(self.combine(self.slopes, u), -2, 0))

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for coordinates ``u`` (..., N) of the scene."""
        if not self.off_axis:
            return self.combine(self.weights, u)
        return np.stack(carried(self._levers, *self._moving(u)), -2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n).

        Parameters
        ----------
        u, v
            Displacement of the coordinates of the scene and its rate, shapes (..., N).
        """
        if not self.off_axis:
            return self.combine(self.weights, v)
        slope = np.moveaxis(self.combine(self.slopes, u), -2, 0)
        return np.stack(swung(self._levers, *slope, *self._moving(v)), -2)

    def strain(self, u: Array) -> Array:
        """The strain of the elements (eps_xx, eps_yy, 2 eps_xy), shape (3, n).

        Parameters
        ----------
        u
            Coordinates of the scene, shape (N,).
        """
        beam = self.beam
        return beam.kinematics.strain_at(beam, u[self.coordinates], self.e, self.X)

    def stress(self, u: Array) -> Array:
        """The stress of the elements (S_xx, S_yy, S_xy), shape (3, n).

        Parameters
        ----------
        u
            Coordinates of the scene, shape (N,).
        """
        beam, strain = self.beam, self.strain(u)
        if len(beam.across.slabs) == 1:
            return self._stress(strain, u, slice(None))
        which = beam.across.which(self.at, self.e)
        for k in range(len(beam.across.slabs)):
            on = np.nonzero(which == k)[0]
            strain[:, on] = self._stress(strain, u, on)
        return strain

    def _stress(self, strain, u, on):
        """That of some of the points, all of one slab."""
        beam = self.beam
        return beam.kinematics.stress(beam, strain[:, on, None], u[self.coordinates],
                                      self.at[:, on], self.e[on])[..., 0]

    @cached_property
    def _levers(self):
        """Of points off the axis their distance from it, and its slope where there is no stress."""
        lever = np.ravel(self.beam.mesh.mapping().offset(self.at, self.e))
        start, q0 = self.coordinates.start, self.beam.q0_local
        return (lever, *sum(w * q0[d - start] for w, d in zip(self.slopes, self.dofs)))


def carried(section: Sequence[Any], x: Any, y: Any, ax: Any, ay: Any) -> tuple[Any, Any]:
    """The displacement of points whose sections stay normal to an axis.

    Parameters
    ----------
    section
        The distance of the points from the axis, and both components of its derivative by xi where
        there is no stress: numbers, or arrays (n,).
    x, y, ax, ay
        Displacement of the axis, and its derivative by xi: numbers, or arrays (..., n).
    """
    lever, bx, by = section
    ax, ay = ax + bx, ay + by
    size, size0 = (ax * ax + ay * ay) ** 0.5, (bx * bx + by * by) ** 0.5
    return x - lever * (ay / size - by / size0), y + lever * (ax / size - bx / size0)


def swung(section: Sequence[Any], ax: Any, ay: Any, x: Any, y: Any, px: Any, py: Any
          ) -> tuple[Any, Any]:
    """The velocity of points whose sections stay normal to an axis.

    Parameters
    ----------
    section
        As for :func:`carried`.
    ax, ay
        The derivative of the axis' displacement by xi: numbers, or arrays (..., n).
    x, y, px, py
        Velocity of the axis, and its derivative by xi.
    """
    lever, bx, by = section
    ax, ay = ax + bx, ay + by
    turn = lever * (ax * py - ay * px) / (ax * ax + ay * ay) ** 1.5
    return x - turn * ax, y - turn * ay


class BodyPart:
    """Points of one rigid body.

    Attributes
    ----------
    body
        The :class:`~skfem_ancf.RigidBody`.
    coordinates : slice
        Those of the body in its scene.
    index
        Which of the points they are, (n,), or None for all.
    start
        Positions at the start, (2, n).
    """

    off_axis = False  # its points move linearly in its coordinates

    def __init__(self, body: RigidBody, coordinates: slice, index: Array | None,
                 start: Array) -> None:
        self.body, self.coordinates, self.index, self.start = body, coordinates, index, start
        self._frame = body.local(start)

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for coordinates ``u`` (..., N) of the scene."""
        x, y, c, s = np.moveaxis(u[..., self.coordinates, None], -2, 0)
        a, b = self._frame
        return np.stack([x + a * c - b * s, y + a * s + b * c], axis=-2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n).

        Parameters
        ----------
        u, v
            Displacement of the coordinates of the scene and its rate, shapes (..., N).
        """
        return self.displacement(v)

    @property
    def number(self) -> int:
        """Raises InputError: a rigid body has no fields."""
        raise InputError(f"{self.body!r} has no strain, stress or section forces: ask for points "
                         "of beams")


