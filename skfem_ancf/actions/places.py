"""Material points, sections and points of the ground, as functions of the DOFs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..beam import Beam, Domain, Layout, RigidBody, WhichMember
from ..beam.kinematics import direction as direction_of, direction_weights, locate, probe_reference
from ..core import Array, ArrayLike, MeshError, refuse, require_finite
from ..mesh.places import as_point, is_point, node_of

#: Name of the ground, in place of a beam.
GROUND = "ground"


class Vector:
    """A plane vector that is affine in the degrees of freedom (DOFs). It is ``start + sum(u[dofs] *
    weights, axis=1)``: the position of a material point, or the direction of a section or a rigid
    body. ``dofs`` (2, n) are those of both components, None for a constant; ``weights`` are (2, n),
    or (n,) for both."""

    def __init__(self, start: ArrayLike, dofs: Array | None = None,
                 weights: Any = 0.0) -> None:
        self.start = np.asarray(start, dtype=float)
        self.dofs = np.zeros((2, 0), dtype=int) if dofs is None else dofs
        self.weights = weights + np.zeros(self.dofs.shape)

    def __sub__(self, other: "Vector") -> "Vector":
        return Vector(self.start - other.start, np.hstack([other.dofs, self.dofs]),
                      np.hstack([-other.weights, self.weights]))

    def __call__(self, u: Array) -> Array:
        return self.start + np.sum(u[self.dofs] * self.weights, axis=1)

    def row(self, direction: ArrayLike, n: int) -> Array:
        """Derivative of ``direction . vector`` by the DOFs, dense, (n,)."""
        out = np.zeros(n)
        np.add.at(out, self.dofs, np.asarray(direction)[:, None] * self.weights)
        return out

    def entries(self, direction: ArrayLike) -> tuple[Array, Array]:
        """Derivative of ``direction . vector``: DOFs and values."""
        return self.dofs.ravel(), (np.asarray(direction)[:, None] * self.weights).ravel()


def dense_entries(rows: Array, columns: Array, values: Array) -> tuple[Array, Array, Array]:
    """Rows, columns and values (k,) of a matrix (2, n, 2, m) of DOFs (2, n) and (2, m)."""
    i = np.broadcast_to(rows[:, :, None, None], values.shape)
    return i.ravel(), np.broadcast_to(columns, values.shape).ravel(), values.ravel()


def is_ground(beam: Any) -> bool:
    return isinstance(beam, str) and beam == GROUND


def point(layout: Layout, beam: WhichMember, at: Any) -> Vector:
    """The position of a material point, as a :class:`Vector`.

    Parameters
    ----------
    layout
        Of the scene.
    beam
        Beam, rigid body or domain, its name or number; "ground" for a fixed point.
    at
        The point (x, y) in the reference configuration, shape (2,); None for the centre of mass of
        a rigid body; a place of a beam that is one section, as "left", for its axis there.
    """
    if is_ground(beam):
        return Vector(np.array(as_point(at)))
    if beam is None and layout.nodes is not None and is_point(at):
        beam, at = named_place(layout, at)
    member = layout.beam(beam)
    if isinstance(at, str) and isinstance(member, Beam):
        return section(layout, member, at)[0]
    dofs, weights = member.probe(at)
    if not isinstance(member, Beam):
        start = member.place(at)
    else:
        e, X = locate(member, at)
        start = member.mesh.mapping().F(X[:, None], np.array([e]))[:, 0, 0]
    return _of(layout, member, start, dofs, weights)


def section(layout: Layout, beam: WhichMember, place: Any) -> tuple[Vector, Vector]:
    """Position and direction of a section, as two :class:`Vector`.

    Parameters
    ----------
    layout
        Of the scene.
    beam
        Beam or rigid body, its name or number; "ground" for the ground.
    place
        A place that is one section, with the position of the axis; or a material point (x, y),
        whose section may be inside an element. For a cable the position is on the axis and the
        direction is the tangent. For a rigid body a point, or None for its centre of mass. For a
        domain a straight boundary: its mean position and best-fit line.
    """
    if is_ground(beam):
        return point(layout, beam, place), Vector(np.array([1.0, 0.0]))
    if is_point(place) and layout.nodes is not None:
        beam, place = _section_of_frame(layout, beam, place)
    member = layout.beam(beam)
    if isinstance(member, Domain):
        # position and direction of a straight boundary of a domain
        centre, along, mean, line = member.moments(place)
        used, = np.nonzero((mean != 0.0) | (line != 0.0))
        dofs = layout.offset(member) + 2 * used + np.array([[0], [1]])
        return Vector(centre, dofs, mean[used]), Vector(along, dofs, line[used])
    node = None
    if isinstance(member, RigidBody):
        dofs, weights = member.direction()
    else:
        try:
            node = node_of(member.mesh, place)
            dofs, weights = direction_of(member, node)
        except MeshError:
            if not is_point(place):
                raise
            e, X = locate(member, place)  # inside an element
            if not member.has_sections:
                X = np.array([X[0], 0.5])
                place = member.mesh.mapping().F(X[:, None], np.array([e]))[:, 0, 0]
            dofs, _ = probe_reference(member, e, X)
            weights = direction_weights(member, e, float(X[0]))
    on_axis = node is not None and not (is_point(place) and member.has_sections)
    return (at_node(layout, member, node) if on_axis else point(layout, member, place),
            _of(layout, member, member.q0_local[dofs] @ weights, dofs, weights))


def at_node(layout: Layout, beam: Any, node: Any) -> Vector:
    """Position of the axis at a node."""
    first = layout.offset(beam) + node * beam.nd
    return Vector(beam.mesh.p[:, node], np.array([[first], [first + 1]]), np.ones(1))


def _section_of_frame(layout, beam, at):
    """Beam and place of the section at a point: at a node that of the lines rigid there."""
    if beam is not None:
        beam = layout.number(beam)
    ends = [end for end in layout.nodes.ends_at(layout, at) if beam in (None, end[0])]
    if not ends:
        return named_place(layout, at) if beam is None else (beam, at)
    rigid = [end for end in ends if not end[2]]
    k, node, _ = (rigid or ends)[0]
    refuse(not rigid and len(ends) > 1, "the lines at {!r} are hinged there, and each has a "
           "rotation of its own: name the beam of one, or its section, as {!r} and np.array([{}])",
           at, layout.members[k].name or k, node)
    return k, np.array([node])


def _of(layout: Layout, member: Any, start: Array, dofs: Array, weights: Array) -> Vector:
    """A Vector of DOFs of a beam or body, numbered there, without round-off."""
    found = Vector(start, dofs + layout.offset(member), weights)
    size = np.max(np.abs(found.weights), axis=0) * member.sizes[dofs[0]]
    keep = size > 1e-14 * np.max(size)
    found.dofs, found.weights = found.dofs[:, keep], found.weights[:, keep]
    return found


def members_at(layout: Layout, at: ArrayLike, nearest: bool = False) -> list[int]:
    """Numbers of the beams and bodies that contain a material point; with ``nearest``, if all are
    beams, of those with the nearest axes."""
    found, beams, named = [], [], isinstance(at, str)
    if not named:
        at = as_point(at)
    for k, member in enumerate(layout.members):
        if not isinstance(member, Beam):
            if not named and member.contains(np.reshape(at, (2, 1)))[0]:
                found.append(k)
            continue
        try:
            beams.append((k, member, *locate(member, at)))
        except MeshError:
            continue
        found.append(k)
    if not nearest or named or len(found) < 2 or len(beams) < len(found):
        return found
    off = [float(b.finder.from_axis(np.array([e]), X[:, None])[0]) for _, b, e, X in beams]
    return [k for (k, b, *_), d in zip(beams, off) if d <= min(off) + b.finder.equal]


def named_place(layout: Layout, place: Any, where_none_is: str | None = None) -> tuple[Any, Any]:
    """The beam or body of a place, and the place on it."""
    if isinstance(place, RigidBody):
        return place, None
    if isinstance(place, (tuple, list)) and len(place) == 2 and not is_point(place):
        which, at = place
        if is_ground(which):
            at = tuple(map(float, require_finite("a point of the ground", at, (2,))))
        elif isinstance(at, np.ndarray):
            at = tuple(at.tolist())
        return which, at
    found = members_at(layout, place) if isinstance(place, str) else []
    if not found:
        place = require_finite("a point of a spring or a joint", place, (2,))
        found = members_at(layout, place, nearest=True)
    if len(found) > 1 and layout.nodes is not None:  # they share a node
        found = [k for k, *_ in layout.nodes.ends_at(layout, place)][:1] or found
    names = [layout.members[k].name or k for k in found]
    refuse(len(found) > 1, "the point {!r} is in several beams, {}: choose one, as ({[0]!r}, {!r})",
           place, names, names, place)
    refuse(not found and where_none_is is None, "no beam and no rigid body is at the point {!r}: "
           "for one of the ground write ('ground', {!r}), for one outside of the outline of a "
           "rigid body (body, (x, y))", place, place)
    return (found[0] if found else where_none_is), (
        place if isinstance(place, str) else tuple(map(float, place)))


def both_of(name: str, place: Any) -> tuple[Any, Any]:
    """A beam or body and a place on it; a RigidBody alone has the place None."""
    if isinstance(place, RigidBody):
        return place, None
    refuse(not isinstance(place, (tuple, list)) or len(place) != 2 or is_point(place),
           "{} is a beam with a place of it, as (1, 'left'), or a RigidBody, got {!r}", name, place)
    return place[0], place[1]


def joined(layout: Layout, places: Sequence[Any]) -> tuple[list[Any], Any]:
    """Beams and places of a joint."""
    if len(places) > 1:
        pairs = [named_place(layout, place) for place in places]
        return [which for which, _ in pairs], [at for _, at in pairs]
    at = require_finite("the point of a joint", places[0] if places else None, (2,))
    found = members_at(layout, at)
    if len(found) < 2:
        names, near = [layout.members[k].name or k for k in found], ""
        others = [(x, beam.name or k) for k, beam in enumerate(layout.beams) if k not in found
                  for x in beam.mesh.p.T]
        if others:
            x, name = min(others, key=lambda one: np.hypot(*(one[0] - at)))
            near = (f"; the nearest node of another beam, {name!r}, is at ({x[0]:.6g}, "
                    f"{x[1]:.6g}), {np.hypot(*(x - at)):.6g} away")
        refuse(True, "a joint at {!r} needs two beams or rigid bodies there, found {}{}: name a "
               "place of each, as (beam, (x, y)) or ('ground', (x, y))", places[0], names, near)
    return found, tuple(map(float, at))
