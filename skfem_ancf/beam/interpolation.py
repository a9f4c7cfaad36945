"""Points of beams and rigid bodies: what their degrees of freedom weigh there."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.types import Array
from ..mesh.places import as_point
from .rigid import RigidBody
from .strains import strain_at, stress_at

#: How far from the middle of the section, relative to its height, the axis of a cable reaches.
ON_AXIS = 1e-12


class BeamPoints:
    """Points of one beam.

    Attributes
    ----------
    beam, number
        The beam and its number.
    slice : slice
        Its degrees of freedom in the scene.
    index
        Which of the points asked for they are, (n,), or None for all.
    e, X
        Elements (n,) and reference points (2, n).
    """

    def __init__(self, beam: Any, number: int, dofs: slice, index: Array | None,
                 e: Array, X: Array) -> None:
        self.beam, self.number, self.slice, self.index = beam, number, dofs, index
        self.n, self.e, self.X = len(e), e, X

    @cached_property
    def at(self) -> Array:
        """Reference points as the fields of a beam take them, (2, n, 1)."""
        return self.X[:, :, None]

    @cached_property
    def start(self) -> Array:
        """Positions in the reference configuration, (2, n)."""
        return self.beam.mesh.mapping().F(self.at, self.e)[..., 0]

    @cached_property
    def off_axis(self) -> bool:
        """Points of a cable off its axis: their section turns with the tangent."""
        return not self.beam.has_sections and bool(np.any(np.abs(self.X[1] - 0.5) > ON_AXIS))

    @cached_property
    def dofs(self) -> Array:
        """Degrees of freedom of the scene that move each point, (nb, 2, n)."""
        first = self.slice.start + self.beam.mesh.t[0, self.e] * self.beam.nd
        return first + np.arange(2 * self.beam.nd).reshape(-1, 2, 1)

    @cached_property
    def _functions(self):
        return self.beam.element.of_mesh(self.beam.mesh.mapping(), self.at, self.e)

    @property
    def weights(self) -> Array:
        """Their weights in the position, (nb, n)."""
        return self._functions[0][..., 0]

    @property
    def slopes(self) -> Array:
        """Their weights in the derivative of the position by xi, (nb, n)."""
        return self._functions[1][..., 0]

    def combine(self, weights: Array, u: Array) -> Array:
        """The sum (..., 2, n) of weighted degrees of freedom (..., N) at each point."""
        return sum(w * u[..., d] for w, d in zip(weights, self.dofs))

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for degrees of freedom ``u`` (..., N) of the scene."""
        moved = self.combine(self.weights, u)
        if not self.off_axis:
            return moved
        before, now = self._tangents(u)
        turn = now / _length(now) - before / _length(before)
        return moved + self._lever * np.stack([-turn[..., 1, :], turn[..., 0, :]], -2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n) for degrees of freedom and their rates, (..., N)."""
        moved = self.combine(self.weights, v)
        if not self.off_axis:
            return moved
        a, rate = self._tangents(u)[1], self.combine(self.slopes, v)
        turn = (a[..., 0, :] * rate[..., 1, :] - a[..., 1, :] * rate[..., 0, :])[..., None, :]
        return moved - self._lever * turn / _length(a) ** 3 * a

    def _tangents(self, u):
        """Derivatives of the axis by xi before and after a displacement, (..., 2, n)."""
        start, q0 = self.slice.start, self.beam.q0_local
        before = sum(w * q0[d - start] for w, d in zip(self.slopes, self.dofs))
        return before, before + self.combine(self.slopes, u)

    @cached_property
    def _lever(self):
        return np.ravel(self.beam.mesh.mapping().offset(self.at, self.e))

    def strain(self, u: Array) -> Array:
        """The strain of the elements, see :func:`~.strains.strain_at`, for ``u`` of the scene."""
        return strain_at(self.beam, u[self.slice], self.e, self.X)

    def stress(self, u: Array) -> Array:
        """The stress of the elements, see :func:`~.strains.stress_at`, for ``u`` of the scene."""
        return stress_at(self.beam, u[self.slice], self.e, self.X)


def _length(a):
    return (a[..., :1, :] ** 2 + a[..., 1:, :] ** 2) ** 0.5


def locate(beam: Any, point: Any) -> tuple[int, Array]:
    """The element of a material point, and its point (xi, eta) of the reference cell.

    The point is its place (x, y) in the reference configuration, or the name of an end; raises
    MeshError outside the body.
    """
    x = as_point(point, beam.mesh)[:, None]
    e, X, outside = beam.finder(x)
    if outside[0] > beam.finder.allowed:
        raise beam.finder.refuse(x, outside)
    return int(e[0]), X[:, 0]


def probe(beam: Any, point: Any, at: tuple[int, Array] | None = None) -> tuple[Array, Array]:
    """As :meth:`Beam.probe <skfem_ancf.Beam.probe>`, of a point that :func:`locate` may know."""
    e, X = locate(beam, point) if at is None else at
    if not beam.has_sections and abs(X[1] - 0.5) > beam.finder.allowed:
        raise InputError(
            f"the point {tuple(map(float, np.ravel(point)))} is off the axis of a cable, whose "
            "position there is no linear function of its degrees of freedom: name a point of the "
            "axis, and put a moment on an end section with scene.moment")
    return probe_reference(beam, e, X)


def probe_reference(beam: Any, e: int, X: Array) -> tuple[Array, Array]:
    """As :func:`probe`, for a point (2,) of the reference cell of an element."""
    one = BeamPoints(beam, 0, slice(0, beam.N), None, np.array([e]), np.reshape(X, (2, 1)))
    return one.dofs[..., 0].T, one.weights[:, 0]


class BodyPoints:
    """Points of one rigid body; attributes as of :class:`BeamPoints`."""

    off_axis = False  # its points move linearly in its degrees of freedom

    def __init__(self, body: RigidBody, dofs: slice, index: Array | None,
                 start: Array) -> None:
        self.body, self.slice, self.index, self.start = body, dofs, index, start
        self._frame = body.local(start)

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for degrees of freedom ``u`` (..., N) of the scene."""
        x, y, c, s = np.moveaxis(u[..., self.slice, None], -2, 0)
        a, b = self._frame
        return np.stack([x + a * c - b * s, y + a * s + b * c], axis=-2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n) for degrees of freedom and their rates, (..., N)."""
        return self.displacement(v)

    @property
    def number(self) -> int:
        """Raises InputError: a rigid body has no fields."""
        raise InputError(f"{self.body!r} has no strain, stress or section forces: ask for points "
                         "of beams")


class Located:
    """Points of a scene.

    Attributes
    ----------
    one : bool
        They were given as a single point.
    n : int
        How many.
    parts : list of BeamPoints and BodyPoints
        Those of each beam and body that has some.
    """

    def __init__(self, one: bool, n: int, parts: Sequence[Any]) -> None:
        self.one, self.n, self.parts = one, n, parts

    def gather(self, values: Sequence[Array]) -> Array:
        """One array of those of the parts, (..., n) each; (...) for a single point."""
        if len(self.parts) == 1 and self.parts[0].index is None:
            out = values[0]
        else:
            out = np.empty(values[0].shape[:-1] + (self.n,))
            for part, value in zip(self.parts, values):
                out[..., part.index] = value
        return out[..., 0] if self.one else out

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2), or (..., 2, n) of many, for degrees of freedom (..., N)."""
        return self.gather([part.displacement(u) for part in self.parts])

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2), or (..., 2, n) of many, for degrees of freedom and their rates."""
        return self.gather([part.velocity(u, v) for part in self.parts])

    @cached_property
    def start(self) -> Array:
        """Positions in the reference configuration."""
        return self.gather([part.start for part in self.parts])
