"""A single material point: what :class:`~skfem_ancf.points.Located` says of many, by numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .kept import kept
from .parts import ON_AXIS, Part, carried, swung
from .series import along_slopes, products

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .beam import Beam
    from .types import Array

#: Elements of which a beam keeps what single points ask for.
ELEMENTS = 4096

#: What is kept of a point that was asked for something once: what is made is kept the second time.
#: For each point that is asked only once it would take longer to keep it than to make it.
AGAIN = ()


class Point:
    """One point of one beam, found in a scene.

    What is made of it is kept in slots: properties would take longer than what they keep.

    Parameters
    ----------
    beam, number, coordinates
        As for :class:`~skfem_ancf.parts.Part`.
    place
        Element and reference point (e, xi, eta).
    x
        Where it was looked for, two numbers; None if it is known by its place only.

    Attributes
    ----------
    one : bool
        True: it was given as a single point.
    n : int
        1.
    off_axis : bool
        It is one of a cable off its axis: its section turns with the tangent.
    recovery, strain_table
        What of recovered fields, and of the strain of the elements, does not depend on the state;
        :data:`AGAIN` if it was asked for once.
    """

    __slots__ = ("_lever", "_node", "_of_element", "_parts", "_weights", "_x", "beam",
                 "coordinates", "number", "off_axis", "place", "recovery", "strain_table")
    one, n = True, 1

    def __init__(self, beam: Beam, number: int, coordinates: slice,
                 place: tuple[int, float, float], x: tuple[float, float] | None = None) -> None:
        self.beam, self.number, self.coordinates = beam, number, coordinates
        self.place, self._x = place, x
        self.off_axis = not beam.has_sections and abs(place[2] - 0.5) > ON_AXIS
        #: First coordinate of the beam of the node that it is, or -1.
        self._node = beam.first_of_node(*place)
        self._of_element: Any = None
        self._weights: Any = None
        self._lever: Any = None
        self._parts: list[Part] | None = None
        self.recovery: Any = None
        self.strain_table: Any = None

    def _element(self):
        """Coordinates (2, nb) of the beam that move the element, and a table of its functions.

        Off the axis of a cable their values without stress, (2, nb), besides.
        """
        if self._of_element is None:
            touched, key = self.beam.touched, (self.place[0], self.off_axis)
            found = touched.get(key)
            self._of_element = found if found is not None else kept(
                touched, key, self._made, ELEMENTS)
        return self._of_element

    def _made(self):
        e, beam = self.place[0], self.beam
        table = beam.series.in_element(beam.scales[e], beam.mesh.mapping().heights_of(e))
        dofs = beam.mesh.t[0, e] * beam.nd + beam.rows
        if not self.off_axis:
            return dofs, table, None
        return dofs, np.stack([table, along_slopes(table)]), beam.q0_local[dofs]

    @property
    def parts(self) -> list[Part]:
        """The point as one of many, a list of one Part."""
        if self._parts is None:
            e, xi, eta = self.place
            self._parts = [Part(self.beam, self.number, self.coordinates, None, np.array([e]),
                                np.array([[xi], [eta]]))]
        return self._parts

    def gather(self, values: Sequence[Array]) -> Array:
        """What is known at :attr:`parts`, (..., 1), at the point, (...)."""
        return values[0][..., 0]

    @property
    def start(self) -> Array:
        """Its position in the stress-free body, (2,)."""
        _, xi, eta = self.place
        if self._x is not None and 0.0 < xi < 1.0 and 0.0 < eta < 1.0:
            return np.array(self._x)
        return self.parts[0].start[:, 0]  # it may have been moved to the border

    def own(self, u: Array) -> Array:
        """Of coordinates ``u`` (..., N) of the scene those of the element, (..., 2, nb)."""
        u, dofs = u[..., self.coordinates], self._element()[0]
        return u[dofs] if u.ndim == 1 else u[..., dofs]

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2) for coordinates ``u`` (..., N) of the scene."""
        if self._node >= 0:
            first = self.coordinates.start + self._node
            return u[..., first:first + 2].copy()
        if not self.off_axis:
            return self.own(u).dot(self._position())
        weights = self._position()
        found = carried(self._section(weights), *_moving(weights, self.own(u)))
        return np.array(found) if u.ndim == 1 else np.stack(found, -1)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2).

        Parameters
        ----------
        u, v
            Displacement of the coordinates of the scene and its rate, shapes (..., N).
        """
        if not self.off_axis:
            return self.displacement(v)
        weights = self._position()
        slope = _moving(weights, self.own(u))[2:]
        found = swung(self._section(weights), *slope, *_moving(weights, self.own(v)))
        return np.array(found) if v.ndim == 1 else np.stack(found, -1)

    def _position(self):
        """Weights of the coordinates of the element in its position, (nb,).

        Off the axis of a cable those in the position of the axis and in its slope, (2, nb).
        """
        weights = self._weights
        if weights is None or weights is AGAIN:
            new = products(self._element()[1], *self.place[1:])
            weights, self._weights = new, AGAIN if weights is None else new
        return weights

    def _section(self, weights):
        """As :func:`~skfem_ancf.parts.carried` takes it."""
        if self._lever is None:
            self._lever = (self.beam.mesh.mapping().lever(*self.place),
                           *self._element()[2].dot(weights[1]).tolist())
        return self._lever

    def strain(self, u: Array, near: dict[Any, Any]) -> Sequence[float]:
        """The strain of the elements (eps_xx, eps_yy, 2 eps_xy).

        Parameters
        ----------
        u
            Coordinates of the scene, shape (N,).
        near
            What points have asked for in this state, by beam and element.
        """
        return self._near(u, near).strain(self)

    def stress(self, u: Array, near: dict[Any, Any]) -> Array:
        """The stress of the elements (S_xx, S_yy, S_xy), shape (3,).

        Parameters
        ----------
        u, near
            As for :meth:`strain`, u of shape (N,).
        """
        found = self._near(u, near).stress(self)
        return self.parts[0].stress(u)[:, 0] if found is None else found

    def _near(self, u, near):
        key = self.number, self.place[0]
        found = near.get(key)
        return found if found is not None else kept(near, key, lambda: self.beam.kinematics.near(
            self.beam, key[1], self.own(u)), ELEMENTS)


def _moving(weights, q):
    """Position and slope of changes q (..., 2, nb) of the coordinates, four components."""
    if q.ndim > 2:
        (x, y), (ax, ay) = np.moveaxis(q.dot(weights.T), (-1, -2), (0, 1))
    else:
        (x, y), (ax, ay) = weights.dot(q.T).tolist()
    return x, y, ax, ay
