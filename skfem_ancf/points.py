"""Material points: where many of them are in the beams, and what their coordinates weigh there.

A point is named by its place (x, y) in the stress-free body. One is a tuple, a list or an array of
two numbers; many are an array of shape (2, n), as scikit-fem has them, or a list of points.
"""

from __future__ import annotations

from collections import OrderedDict
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .beam import select_beam, select_member
from .errors import InputError, MeshError, require_finite, shown
from .places import as_point
from .rigid import RigidBody

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .beam import Beam
    from .mesh import MeshBeam
    from .system import System
    from .types import Array, WhichMember

#: Types of numbers of which nothing has to be asked.
PLAIN = (float, int, np.float64)
#: How far from the middle of the section, relative to its height, the axis of a cable reaches.
ON_AXIS = 1e-12

#: Coordinates beyond which a point is looked at before it is looked for.
HUGE = 1e300

#: Points that a scene remembers, at most, and calls.
REMEMBERED_POINTS, REMEMBERED = 2**16, 1024


def is_many(points: Any) -> bool:
    """True for an array of two dimensions, and for a list or tuple of points."""
    if isinstance(points, np.ndarray):
        return points.ndim == 2
    return isinstance(points, (list, tuple)) and len(points) > 0 and all(
        isinstance(p, (list, tuple, np.ndarray)) for p in points)


def as_points(points: Any, mesh: MeshBeam | None = None) -> Array:
    """Many points as an array (2, n), or one as an array (2,).

    Parameters
    ----------
    points
        Two numbers for one point; an array (2, n), or a list of pairs, for many.
    mesh
        The mesh of the beam, for hints in messages.

    Raises
    ------
    MeshError
        If it is neither, with what was probably meant.

    Examples
    --------
    >>> import numpy as np
    >>> as_points([(0, 0.5), (1, 0.5), (2, 0.5)]).shape, as_points(np.zeros((2, 5))).shape
    ((2, 3), (2, 5))
    """
    if not is_many(points):
        return as_point(points, mesh)
    if isinstance(points, np.ndarray):
        if len(points) == 2:
            return require_finite("points", points)
        hint = "; give its transpose" if points.shape[1] == 2 else ""
        raise MeshError("an array of points has shape (2, n), the x in its first row and the y in "
                        f"its second, got {points.shape}{hint}")
    if any(np.shape(p) != (2,) for p in points if not _ragged(p)) or any(map(_ragged, points)):
        hint = "; an array of shape (2, n) is one too" if len(points) == 2 else ""
        raise MeshError(f"each material point of a list is a pair (x, y), got "
                        f"{shown(points)}{hint}")
    return np.array([as_point(p, mesh) for p in points]).T


def _ragged(p):
    return not isinstance(p, np.ndarray) and any(np.ndim(x) for x in p if not isinstance(x, str))


class Part:
    """Points in one beam.

    Parameters
    ----------
    place
        Of a single point: element and reference point; then e and X may be left out.

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

    def __init__(self, beam: Beam, number: int, coordinates: slice, index: Array | None,
                 e: Array | None = None, X: Array | None = None,
                 place: tuple[int, float, float] | None = None) -> None:
        self.beam, self.number, self.coordinates, self.index = beam, number, coordinates, index
        self.n = 1 if e is None else len(e)
        self.tables: dict[Any, Any] = {}  # of others, that depend on the beam and the points only
        known = vars(self)
        if e is not None:
            known["e"], known["X"] = e, X
        if place is not None:
            known["place"] = place
            known["off_axis"] = not beam.has_sections and abs(place[2] - 0.5) > ON_AXIS

    @cached_property
    def e(self) -> Array:
        return np.array([self.place[0]])

    @cached_property
    def X(self) -> Array:
        return np.array([[self.place[1]], [self.place[2]]])

    @cached_property
    def place(self) -> tuple[int, float, float]:
        """Element and reference point of a single point."""
        return int(self.e[0]), float(self.X[0, 0]), float(self.X[1, 0])

    @cached_property
    def at(self) -> Array:
        """Reference points as the fields of a beam take them, (2, n, 1)."""
        return self.X[:, :, None]

    @cached_property
    def start(self) -> Array:
        """Positions in the stress-free body, (2, n)."""
        if self.n == 1 and not self.off_axis and (self.beam.has_sections
                                                  or self.beam.mesh.is_straight):
            beam, (dofs, weights) = self.beam, self.one
            return (beam.origin + beam.q0_local[dofs - self.coordinates.start] @ weights)[:, None]
        return self.beam.mesh.mapping().F(self.at, self.e)[..., 0]

    @cached_property
    def off_axis(self) -> bool:
        """Points of a cable off its axis: their section turns with the tangent."""
        if self.beam.has_sections:
            return False
        if self.n == 1:
            return abs(self.place[2] - 0.5) > ON_AXIS
        return bool(np.any(np.abs(self.X[1] - 0.5) > ON_AXIS))

    @cached_property
    def dofs(self) -> Array:
        """Coordinates of the scene that move each point, (nb, 2, n)."""
        beam = self.beam
        first = self.coordinates.start + beam.mesh.t[0, self.e] * beam.nd
        return first + np.arange(2 * beam.nd).reshape(-1, 2, 1)

    def _table(self, which):
        """The local functions, 0, or their derivatives by xi, 1: (nb, n)."""
        beam, series = self.beam, self.beam.series
        if beam.mesh.heights is not None:  # no polynomial of xi that elements share
            rows = beam.element.of_mesh(beam.mesh.mapping(), self.at, self.e)
            return rows[which][..., 0] * beam.scales[self.e].T
        if self.n == 1:
            e, xi, eta = self.place
            return (series.at(series.tables[which], xi, eta) * beam.scales[e])[:, None]
        return series.values(series.tables[which], self.X) * beam.scales[self.e].T

    @cached_property
    def weights(self) -> Array:
        """Of these coordinates in the position, (nb, n)."""
        return self._table(0)

    @cached_property
    def slopes(self) -> Array:
        """Of these coordinates in the derivative of the position by xi, (nb, n)."""
        return self._table(1)

    @cached_property
    def one(self) -> tuple[Array, Array]:
        """Coordinates (2, nb) and weights (nb,) of a single point on which it depends linearly."""
        return self._one_dofs(), self._table(0)[:, 0]

    @cached_property
    def _one_with_slope(self):
        """Coordinates (2, nb) of a single point, and weights in its place and slope, (nb, 2)."""
        beam, (e, xi, eta) = self.beam, self.place
        if beam.mesh.heights is None:
            both = beam.series.at(beam.series.tables, xi, eta) * beam.scales[e]
        else:
            both = np.array([self._table(0)[:, 0], self._table(1)[:, 0]])
        return self._one_dofs(), both.T

    def _one_dofs(self):
        beam = self.beam
        first = self.coordinates.start + beam.mesh.t[0, self.place[0]] * beam.nd
        return first + beam.rows

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
        if self.n == 1:
            return (u[..., self.one[0]] @ weights[:, 0])[..., None]
        return sum(w * u[..., d] for w, d in zip(weights, self.dofs))

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for coordinates ``u`` (..., N) of the scene."""
        if not self.off_axis:
            return self.combine(self.weights, u)
        alone = self.n == 1 and u.ndim == 1
        if alone:  # by numbers, which is many times faster
            dofs, weights = self._one_with_slope
            (x, ax), (y, ay) = (u[dofs] @ weights).tolist()
        else:
            x, y = np.moveaxis(self.combine(self.weights, u), -2, 0)
            ax, ay = np.moveaxis(self.combine(self.slopes, u), -2, 0)
        lever, bx, by, tx, ty = self._section
        ax, ay = ax + bx, ay + by
        size = (ax * ax + ay * ay) ** 0.5
        moved = x - lever * (ay / size - ty), y + lever * (ax / size - tx)
        return np.array(moved)[:, None] if alone else np.stack(moved, -2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n).

        Parameters
        ----------
        u, v
            Displacement of the coordinates of the scene and its rate, shapes (..., N).
        """
        out = self.combine(self.weights, v)
        if self.off_axis:
            lever, bx, by, _, _ = self._section
            ax, ay = np.moveaxis(self.combine(self.slopes, u), -2, 0)
            px, py = np.moveaxis(self.combine(self.slopes, v), -2, 0)
            ax, ay = ax + bx, ay + by
            turn = lever * (ax * py - ay * px) / (ax * ax + ay * ay) ** 1.5
            out -= np.stack([turn * ax, turn * ay], -2)
        return out

    def strain(self, u: Array) -> Array:
        """The strain of the elements (eps_xx, eps_yy, 2 eps_xy), shape (3, n).

        Parameters
        ----------
        u
            Coordinates of the scene, shape (N,).
        """
        beam = self.beam
        if self.n > 1:
            return beam.kinematics.strain_at(beam, u[self.coordinates], self.e, self.X)
        return self._strain_at(u[self._one_dofs()])[:, None]

    @cached_property
    def _strain_at(self):
        return self.beam.kinematics.strain_of_point(self.beam, *self.place)

    def stress(self, u: Array) -> Array:
        """The stress of the elements (S_xx, S_yy, S_xy), shape (3, n).

        Parameters
        ----------
        u
            Coordinates of the scene, shape (N,).
        """
        beam = self.beam
        return beam.kinematics.stress(beam, self.strain(u)[..., None], u[self.coordinates], self.at,
                                      self.e)[..., 0]

    @cached_property
    def _section(self):
        """How far the points are from the axis, its slope in the stress-free body and its tangent.

        Numbers of a single point.
        """
        q0, mesh = self.beam.q0_local, self.beam.mesh
        if self.n > 1:
            lever = np.ravel(mesh.mapping().offset(self.at, self.e))
            x, y = sum(w * q0[d - self.coordinates.start]
                       for w, d in zip(self.slopes, self.dofs))
        else:
            dofs, weights = self._one_with_slope
            x, y = (q0[dofs - self.coordinates.start] @ weights[:, 1]).tolist()
            lever = (mesh.height * (self.place[2] - 0.5) if mesh.heights is None
                     else float(mesh.mapping().offset(self.at, self.e)[0, 0]))
        size = (x * x + y * y) ** 0.5
        return lever, x, y, x / size, y / size


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

    off_axis = True  # not of one table of weights for both components

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


class Located:
    """Points of a scene.

    Attributes
    ----------
    one : bool
        They were given as a single point.
    n : int
        How many.
    parts : list of Part and BodyPart
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
        """Displacements for coordinates ``u`` (..., N): (..., 2), or (..., 2, n) of many."""
        part = self.parts[0] if self.one else None
        if part is not None and not part.off_axis:
            dofs, weights = part.one
            return u[..., dofs] @ weights
        return self.gather([part.displacement(u) for part in self.parts])

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2), or (..., 2, n) of many points.

        Parameters
        ----------
        u, v
            Displacement of the coordinates of the scene and its rate, shapes (..., N).
        """
        part = self.parts[0] if self.one else None
        if part is not None and not part.off_axis:
            dofs, weights = part.one
            return v[..., dofs] @ weights
        return self.gather([part.velocity(u, v) for part in self.parts])

    @cached_property
    def start(self) -> Array:
        """Positions in the stress-free body."""
        return self.gather([part.start for part in self.parts])


class Points:
    """Finds the points of a scene, and remembers the last ones.

    Parameters
    ----------
    beams, slices
        The beams, and the coordinates in the scene of them and of the bodies behind them.
    bodies
        Rigid bodies.
    """

    def __init__(self, beams: Sequence[Beam], slices: Sequence[slice],
                 bodies: Sequence[RigidBody] = ()) -> None:
        self.beams, self.slices, self.bodies = list(beams), slices, list(bodies)
        self._known: OrderedDict[Any, Located] = OrderedDict()
        self._held = 0

    def find(self, points: Any, beam: WhichMember = None) -> Located:
        """Where points are.

        Parameters
        ----------
        points
            One point, shape (2,), or many, shape (2, n) or a list, see :func:`as_points`; a
            RigidBody for its centre of mass.
        beam
            The beam or rigid body that they are in, its name or number; found for each if it is not
            given.

        Returns
        -------
        Located

        Raises
        ------
        MeshError
            If a point is in none of the beams.
        """
        if self.bodies:
            found = self._of_body(points, beam)
            if found is not None:
                return found
        name = beam if beam is None or isinstance(beam, (str, int)) else id(beam)
        if (type(points) is tuple and len(points) == 2 and type(points[0]) in PLAIN
                and type(points[1]) in PLAIN):
            key: Any = points, name, type(beam)
        else:
            if isinstance(points, (int, float)):
                as_points(points)  # x and y as two arguments: y is no beam
            one = beam is not None or self._alone
            points = as_points(points, select_beam(self.beams, beam).mesh if one else None)
            key = points.tobytes(), points.ndim, name, type(beam)
        found = self._known.get(key)
        if found is None:
            found = self._find(points, beam)
            self._remember(key, found)
        return found

    def _remember(self, key, found):
        if found.n > REMEMBERED_POINTS:
            return
        known = self._known
        self._held += found.n
        known[key] = found
        while known and (len(known) > REMEMBERED or self._held > REMEMBERED_POINTS):
            self._held -= known.popitem(last=False)[1].n

    @property
    def _alone(self):
        return len(self.beams) == 1 and not self.bodies

    def _of_body(self, points, beam):
        """Located of a body that is named; None if none is."""
        if isinstance(points, RigidBody):
            points, beam = points.position, points
        elif beam is None and (self.beams or len(self.bodies) > 1):
            return None
        body = select_member(self.beams, self.bodies, beam)
        if not isinstance(body, RigidBody):
            return None
        x = as_points(body.position if points is None else points)
        start = np.reshape(x, (2, -1))
        return Located(x.ndim == 1, start.shape[1],
                       [BodyPart(body, self._coordinates(body), None, start)])

    def _coordinates(self, body):
        return self.slices[len(self.beams) + [b is body for b in self.bodies].index(True)]

    def _find(self, points, beam):
        if type(points) is tuple or points.ndim == 1:
            found = self._find_one(*points, beam)
            if found is not None:
                return found
        if beam is not None or self._alone:
            beam = select_beam(self.beams, beam)
            x = as_points(points, beam.mesh)
            e, X, outside = beam.finder(np.reshape(x, (2, -1)))
            if np.any(outside > beam.finder.allowed):
                raise beam.finder.refuse(np.reshape(x, (2, -1)), outside)
            k = self.beams.index(beam)
            return Located(x.ndim == 1, len(e), [Part(beam, k, self.slices[k], None, e, X)])
        x = as_points(points)
        one, x = x.ndim == 1, np.reshape(x, (2, -1))
        left, parts = np.arange(x.shape[1]), list[Any]()
        for k, candidate in enumerate(self.beams):
            e, X, outside = candidate.finder(x[:, left])
            on = outside <= candidate.finder.allowed
            if np.any(on) or not x.size:
                parts.append(Part(candidate, k, self.slices[k], left[on], e[on], X[:, on]))
                left = left[~on]
        for body in self.bodies:
            on = body.contains(x[:, left])
            if np.any(on):
                parts.append(BodyPart(body, self._coordinates(body), left[on], x[:, left[on]]))
                left = left[~on]
        if len(left):
            p = (float(c) for c in x[:, left[0]])
            more = f" ({len(left)} of {x.shape[1]} points are)" if x.shape[1] > 1 else ""
            where = "; ".join(
                f"{k if b.name is None else repr(b.name)}: {b.finder.extent}"
                for k, b in list(enumerate(self.beams))[:4])
            raise MeshError(f"the point {shown(tuple(p))} is in none of the {len(self.beams)} "
                            f"beams{more}; {where}")
        if len(parts) == 1:
            parts[0].index = None
        return Located(one, x.shape[1], parts)

    def _find_one(self, x, y, beam):
        """A single point, or None where the general search has to say."""
        if not abs(x) + abs(y) < HUGE:
            return None
        x, y = float(x), float(y)
        wanted = None if beam is None else select_beam(self.beams, beam)
        for k, b in enumerate(self.beams):
            if b is not wanted and wanted is not None:
                continue
            place = b.finder.one(x, y)
            if place:
                return Located(True, 1, [Part(b, k, self.slices[k], None, place=place)])
            if place is None:
                return None
        return None


def require_body(system: System, which: WhichMember) -> RigidBody:
    """The rigid body meant by itself, its name or its number; raises InputError of a beam.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    which
        The RigidBody, its name or its number.
    """
    body = None if which is None else select_member(system.beams, system.bodies, which)
    if not isinstance(body, RigidBody):
        raise InputError(f"this is asked of rigid bodies, got {shown(which)}; those of the scene "
                         f"are {system.bodies}")
    return body
