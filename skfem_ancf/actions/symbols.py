"""Symbols in pictures: what :meth:`~skfem_ancf.Item.symbols` of loads, supports, joints return."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ..beam import Beam, Domain, Layout, RigidBody, direction_weights, probe_reference
from ..core import Array
from ..mesh.places import facets_of
from .places import Vector, at_node, point

#: Largest number of arrows of a distributed load on one chain or side, and on one beam.
ARROWS, MOST = 9, 200

#: Kinds of symbols that are loads; "support", "joint", "slider", "motor", "spring", "foundation",
#: "torsional spring", "mass", "drag" and "control" are not.
LOADS = "force", "moment", "weight", "eigenstrain"


class Symbol(NamedTuple):
    """One symbol of an item in a picture.

    Attributes
    ----------
    kind
        "force", "moment", "weight", "eigenstrain", "support", "joint", "slider", "motor", "spring",
        "torsional spring", "foundation", "mass", "drag" or "control".
    at
        Positions as n vectors: two ends of a spring, several arrows of a distributed load, else
        one.
    direction
        At each position, shape (n, 2): forces relative to the largest, the outward direction of a
        support, the line of a slider.
    value
        Largest force, moment or mass; 1 for others.
    text
        Text before the value, or beside the symbol; for a support its fixed motions, as "x y".
    turn
        Vectors with which the directions rotate, n or none.
    show
        Show the value.
    per
        Power of length in the denominator of the unit of a force: 1 along a line, 2 on a face.
    """

    kind: str
    at: tuple[Vector, ...]
    direction: Any = ((0.0, 0.0),)
    value: float = 1.0
    text: str = ""
    turn: tuple[Vector, ...] = ()
    show: bool = False
    per: int = 0


def force_symbol(at: Iterable[Vector], force: Any, turn: Iterable[Vector] = (),
                 show: bool = True) -> Symbol:
    """Arrows of forces (n, 2) at n positions; the value is the largest force."""
    force = np.reshape(force, (-1, 2))
    size = float(np.max(np.hypot(*force.T), initial=0.0))
    return Symbol("force", tuple(at), force / (size or 1.0), size, "", tuple(turn), show)


def inside(layout: Layout, beam: Any, e: int, xi: float, eta: float = 0.5) -> Vector:
    """Position of a point of an element, on the axis of a cable."""
    X = np.array([xi, eta if beam.has_sections else 0.5])
    dofs, weights = probe_reference(beam, e, X)
    start = beam.mesh.mapping().F(X[:, None], np.array([e]))[:, 0, 0]
    return Vector(start, dofs + layout.offset(beam), weights)


def tangent_at(beam: Any, e: int, xi: float) -> Array:
    """Unit tangent of the axis."""
    tangent = beam.mesh.mapping().DF(np.array([[xi], [0.5]]), np.array([e]))[:, 0, 0, 0]
    return np.asarray(tangent / np.hypot(*tangent))


def arrows_along(elements: Array, runs: int) -> list[tuple[int, float]]:
    """Elements and xi of the arrows along one of some runs of elements."""
    s = np.linspace(0, len(elements), int(np.clip(MOST // runs, 2, ARROWS)))
    k = np.minimum(s.astype(int), len(elements) - 1)
    return list(zip(elements[k].tolist(), (s - k).tolist()))


def faces_of(layout: Layout, beam: Any, boundary: Any) -> Iterable[tuple[Any, Any, Any]]:
    """For sections and runs of faces: positions, outward normals (n, 2), directions of sections."""
    n, ne = beam.mesh.p.shape[1], beam.mesh.nelements
    facets = np.sort(np.asarray(facets_of(beam.mesh, boundary)))
    found = [([(int(e), float(xi))], 0.5) for node in facets[facets < n] for xi in (0, 1)
             for e in np.flatnonzero(beam.mesh.t[xi] == node)]
    for side in (0, 1):
        on = facets[(facets >= n + side * ne) & (facets < n + (side + 1) * ne)] - n - side * ne
        ends = np.flatnonzero((np.diff(on) > 1) | (np.diff(beam.mesh.chains[on]) != 0)) + 1
        found += [(arrows_along(run, len(ends) + 1), float(side)) for run in np.split(on, ends)
                  if len(run)]
    for places, eta in found:
        normals, turns = [], []
        for e, xi in places:
            tx, ty = tangent_at(beam, e, xi)
            normals.append((2 * xi - 1) * np.array([tx, ty]) if eta == 0.5 else
                           (2 * eta - 1) * np.array([-ty, tx]))
            dofs, _ = probe_reference(beam, e, np.array([xi, 0.5]))
            weights = direction_weights(beam, e, xi)
            turns.append(Vector(beam.q0_local[dofs] @ weights, dofs + layout.offset(beam), weights))
        yield [inside(layout, beam, e, xi, eta) for e, xi in places], np.array(normals), turns


def values_at(function: Any, at: Iterable[Vector]) -> Array:
    """A vector, or the values of a function, at each of some positions, (n, 2)."""
    x = np.array([place.start for place in at]).T
    return np.broadcast_to(function(x) if callable(function) else function[:, None], x.shape).T


def outward(beam: Beam, node: int) -> Array:
    """Direction out of the beam at the end of a chain; below the axis elsewhere."""
    left, right = (bool(np.any(beam.mesh.t[k] == node)) for k in (0, 1))
    tangent = beam.mesh.p_X[:, node]
    return -beam.mesh.p_Y[:, node] if left and right else -tangent if left else tangent


def boundary_of(layout: Layout, domain: Domain, boundary: Any) -> Vector:
    """Mean position of a boundary of a domain."""
    dofs = domain.dofs(boundary)
    place = domain.basis.doflocs[:, np.argsort(domain.numbers(np.arange(domain.N)))[dofs]]
    pairs = layout.offset(domain) + dofs.reshape(-1, 2).T
    return Vector(np.nanmean(place, axis=1), pairs, np.full(len(dofs) // 2, 2 / len(dofs)))


def middle(layout: Layout, beam: Any) -> Vector:
    """Position of the middle of a beam."""
    beam = layout.beam(beam)
    e = np.flatnonzero(beam.mesh.chains == beam.mesh.chains[beam.mesh.nelements // 2])
    return inside(layout, beam, *arrows_along(e, 1)[ARROWS // 2])


def support(at: Iterable[Vector], fixed: str, direction: Any = (0.0, -1.0)) -> Symbol:
    """A support with its fixed motions, as "x y"."""
    return Symbol("support", tuple(at), (tuple(direction),), text=fixed)


def support_of(layout: Layout, beam: Any, at: Vector, fixed: str) -> Symbol:
    """A support: at a node of a beam outward, elsewhere below."""
    member: Any = layout.beam(beam)
    direction: Any = (0.0, -1.0)
    if isinstance(member, Beam):
        off = np.hypot(*(member.mesh.p - at.start[:, None]))
        if np.min(off) < 1e-9 * member.mesh.height:
            direction = outward(member, int(np.argmin(off)))
    return support([at], fixed, direction)


def supports_of(layout: Layout, beam: Any, boundary: Any, names: Any) -> Iterable[Symbol]:
    """The supports of degrees of freedom of a place."""
    member = layout.beam(beam)
    dofs = member.dofs(boundary, names)
    if isinstance(member, RigidBody):
        yield support([point(layout, member, boundary)], "x y angle" if len(dofs) == 4 else "x y")
    elif isinstance(member, Domain):
        fixed = [name for k, name in enumerate(("x", "y")) if np.any(dofs % 2 == k)]
        at = boundary_of(layout, member, boundary)
        away = at.start - np.mean(member.basis.mesh.p, axis=1)
        yield support([at], " ".join([*fixed, "angle"]), away / (np.hypot(*away) or 1.0))
    else:
        for node in np.unique(dofs // member.nd).tolist():
            own = dofs[dofs // member.nd == node] % member.nd
            fixed = [name for name, found in (
                ("x", 0 in own), ("y", 1 in own), ("angle", np.any(own > 1))) if found]
            yield support([at_node(layout, member, node)], " ".join(fixed), outward(member, node))
