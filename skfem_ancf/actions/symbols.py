"""Symbols of items in pictures: arrows of loads, symbols of supports, joints and springs."""

from __future__ import annotations

from collections.abc import Iterable
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from ..beam.beam import Beam
from ..beam.domain import Domain
from ..beam.kinematics import direction_weights, locate, probe_reference
from ..beam.layout import Layout
from ..beam.rigid import RigidBody
from ..core.errors import AncfError
from ..core.types import Array
from ..mesh.places import facets_of
from .eigenstrain import EigenStrain
from .forces import Control, Drag, Foundation, PointMass, Spring, TorsionalSpring
from .forces.springs import end_of
from .joints import Hinge, Weld
from .joints.weld import Glue
from .joints.nodes import COMPONENTS, Nodes
from .joints.prescribed import (PlaneSection, PrescribedAngle, PrescribedDisplacement,
                                PrescribedPosition, PrescribedTurn)
from .joints.sliders import OnCircle, OnLine, Sleeve, Slot
from .loads import (DeadLoad, EndMoment, LineLoad, Load, Pressure, TimedLoad, Traction, Weight,
                    of_place_and_time)
from .point_force import FollowerForce, PointForce
from .places import Vector, is_ground, named_place, point, section
from .supports import Support

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
    """

    kind: str
    at: tuple[Vector, ...]
    direction: Any = ((0.0, 0.0),)
    value: float = 1.0
    text: str = ""
    turn: tuple[Vector, ...] = ()
    show: bool = False


def all_symbols(items: Iterable[Any], layout: Layout, load: float = 1.0,
                t: float | None = None, start: bool = False) -> list[Symbol]:
    """Symbols of unbound items, with loads multiplied by their factors.

    ``load`` and ``t`` are the load factor, and the time of a motion or None. With ``start`` moving
    or time-dependent loads are those at time 0, or at 1 if they vanish there.
    """
    out = []
    for item in items:
        for one in item.expand(layout):
            if isinstance(one, (TimedLoad, LineLoad)) and not start:
                one = one._with(_time=1.0 if t is None else t)
            factor = one.factor(t) * (load if one.scaled else 1.0) if isinstance(one, Load) else 1.0
            out += [s._replace(value=s.value * factor) if s.kind in LOADS else s
                    for s in symbols(one, layout)]
    return out


@singledispatch
def symbols(item: Any, layout: Layout) -> Iterable[Symbol]:
    """The symbols of an item, none by default; ``@symbols.register`` adds a class.

    Parameters
    ----------
    item
        An item with its beam by number, as ``expand`` returns it.
    layout
        The Layout of the scene.

    Examples
    --------
    A user-defined item, drawn as a mass:

    >>> from skfem_ancf import Beam, ElementBeamCable, Item, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.actions.places import point
    >>> from skfem_ancf.actions.symbols import Symbol, symbols
    >>> class Magnet(Item):
    ...     def energy(self, u, t):
    ...         return 1e-3 * u[-4]**2
    >>> @symbols.register(Magnet)
    ... def draw(item, layout):
    ...     return [Symbol("mass", (point(layout, 0, "right"),), text="magnet ", value=7.0)]
    >>> beam = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamCable(3),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> [text.get_text() for text in Scene(beam).clamp("left").add(Magnet()).plot().texts]
    ['magnet 7']
    """
    return ()


def force_symbol(at: Iterable[Vector], force: Any, turn: Iterable[Vector] = (),
                 show: bool = True) -> Symbol:
    """Arrows of forces (n, 2) at n positions; the value is the largest force."""
    force = np.reshape(force, (-1, 2))
    size = float(np.max(np.hypot(*force.T), initial=0.0))
    return Symbol("force", tuple(at), force / (size or 1.0), size, "", tuple(turn), show)


def at_node(layout: Layout, beam: Beam, node: int) -> Vector:
    """Position of the axis at a node."""
    first = layout.offset(beam) + node * beam.nd
    return Vector(beam.mesh.p[:, node], np.array([[first], [first + 1]]), np.ones(1))


def _inside(layout: Layout, beam: Any, e: int, xi: float, eta: float = 0.5) -> Vector:
    """Position of a point of an element, on the axis of a cable."""
    X = np.array([xi, eta if beam.has_sections else 0.5])
    dofs, weights = probe_reference(beam, e, X)
    start = beam.mesh.mapping().F(X[:, None], np.array([e]))[:, 0, 0]
    return Vector(start, dofs + layout.offset(beam), weights)


def _tangent(beam: Any, e: int, xi: float) -> Array:
    tangent = beam.mesh.mapping().DF(np.array([[xi], [0.5]]), np.array([e]))[:, 0, 0, 0]
    return np.asarray(tangent / np.hypot(*tangent))


def _along(elements: Array, runs: int) -> list[tuple[int, float]]:
    s = np.linspace(0, len(elements), int(np.clip(MOST // runs, 2, ARROWS)))
    k = np.minimum(s.astype(int), len(elements) - 1)
    return list(zip(elements[k].tolist(), (s - k).tolist()))


def _faces(layout: Layout, beam: Any, boundary: Any) -> Iterable[tuple[Any, Any, Any]]:
    """For sections and runs of faces: positions, outward normals (n, 2), directions of sections."""
    n, ne = beam.mesh.p.shape[1], beam.mesh.nelements
    facets = np.sort(np.asarray(facets_of(beam.mesh, boundary)))
    found = [([(int(e), float(xi))], 0.5) for node in facets[facets < n] for xi in (0, 1)
             for e in np.flatnonzero(beam.mesh.t[xi] == node)]
    for side in (0, 1):
        on = facets[(facets >= n + side * ne) & (facets < n + (side + 1) * ne)] - n - side * ne
        ends = np.flatnonzero((np.diff(on) > 1) | (np.diff(beam.mesh.chains[on]) != 0)) + 1
        found += [(_along(run, len(ends) + 1), float(side)) for run in np.split(on, ends)
                  if len(run)]
    for places, eta in found:
        normals, turns = [], []
        for e, xi in places:
            tx, ty = _tangent(beam, e, xi)
            normals.append((2 * xi - 1) * np.array([tx, ty]) if eta == 0.5 else
                           (2 * eta - 1) * np.array([-ty, tx]))
            dofs, _ = probe_reference(beam, e, np.array([xi, 0.5]))
            weights = direction_weights(beam, e, xi)
            turns.append(Vector(beam.q0_local[dofs] @ weights, dofs + layout.offset(beam), weights))
        yield [_inside(layout, beam, e, xi, eta) for e, xi in places], np.array(normals), turns


def _values(function, at):
    x = np.array([place.start for place in at]).T
    return np.broadcast_to(function(x) if callable(function) else function[:, None], x.shape).T


# loads

@symbols.register(Load)
def _(load, layout):
    beam = layout.beam(load.beam)  # user-defined loads and forms: nodal forces
    if isinstance(beam, Beam):
        given = load if isinstance(load, DeadLoad) else load.bind(beam)
        force = given.force(np.zeros(beam.N)).reshape(-1, beam.nd)[:, :2]
        loaded = np.flatnonzero(np.hypot(*force.T) > 1e-9 * np.abs(force).max())
        some = loaded[::1 + len(loaded) // (2 * ARROWS)]
        yield force_symbol((at_node(layout, beam, k) for k in some), force[some], show=False)


@symbols.register(Weight)
def _(load, layout):
    yield force_symbol([Vector(np.zeros(2))], load.g)._replace(kind="weight", text="g = ")


@symbols.register(PointForce)
@symbols.register(FollowerForce)
def _(load, layout):
    turn = [section(layout, load.beam, load.at)[1]] if isinstance(load, FollowerForce) else []
    beam = layout.beam(load.beam)
    if isinstance(beam, Beam):
        e, X = locate(beam, load.at)
        yield force_symbol([_inside(layout, beam, e, *X)], load.total, turn)
    else:
        yield force_symbol([point(layout, load.beam, load.at)], load.total, turn)


@symbols.register(LineLoad)
def _(load, layout):
    beam = layout.beam(load.beam)
    chains = np.unique(beam.mesh.chains) if load.chains is None else load.chains
    given = load.per_length
    functions = ([lambda x, t=t: given(x, t) for t in _times(load)] if of_place_and_time(given)
                 else [given])
    for k, chain in enumerate(chains):
        at = [_inside(layout, beam, *place) for place in _along(
            np.flatnonzero(beam.mesh.chains == chain), len(chains))]
        found = [_values(function, at) for function in functions]
        yield force_symbol(at, next(filter(np.any, found), found[0]), show=k == 0)


@symbols.register(TimedLoad)
def _(load, layout):
    beam = layout.beam(load.beam)
    for t in _times(load):
        try:
            places = load.bind(beam).places(t)
        except AncfError:  # beyond the end of the beam
            continue
        yield from (force_symbol([_inside(layout, beam, e, *X)], force) for force, e, X in places)
        if places:
            return


def _times(load):
    time = getattr(load, "_time", None)
    return (0.0, 1.0) if time is None else (time,)


@symbols.register(Traction)
def _(load, layout):
    for at, _, _ in _faces(layout, layout.beam(load.beam), load.boundary):
        yield force_symbol(at, _values(load.t, at))


@symbols.register(Pressure)
def _(load, layout):
    for at, normals, turns in _faces(layout, layout.beam(load.beam), load.boundary):
        yield force_symbol(at, -load.p * normals, turns)._replace(text="p = ")


@symbols.register(EndMoment)
def _(load, layout):
    yield Symbol("moment", (section(layout, load.beam, load.boundary)[0],), value=load.M, show=True)


@symbols.register(EigenStrain)
def _(strain, layout):
    for name, given in ((name, getattr(strain, name)) for name in strain.given):
        what = "ΔT" if name == "change" else f"eps_{name}"
        number = given is not None and not callable(given)
        if given is not None:
            yield Symbol("eigenstrain", (_middle(layout, strain.beam),), show=number,
                         text=f"{what} = " if number else f"{what}(x, y)",
                         value=given if number else 1.0)


def _middle(layout, beam):
    beam = layout.beam(beam)
    e = np.flatnonzero(beam.mesh.chains == beam.mesh.chains[beam.mesh.nelements // 2])
    return _inside(layout, beam, *_along(e, 1)[ARROWS // 2])


# supports and joints

def _outward(beam: Beam, node: int) -> Array:
    """Direction out of the beam at the end of a chain; below the axis elsewhere."""
    left, right = (bool(np.any(beam.mesh.t[k] == node)) for k in (0, 1))
    tangent = beam.mesh.p_X[:, node]
    return -beam.mesh.p_Y[:, node] if left and right else -tangent if left else tangent


def _boundary(layout: Layout, domain: Domain, boundary: Any) -> Vector:
    """Mean position of a boundary of a domain."""
    dofs = domain.dofs(boundary)
    place = domain.basis.doflocs[:, np.argsort(domain.numbers(np.arange(domain.N)))[dofs]]
    pairs = layout.offset(domain) + dofs.reshape(-1, 2).T
    return Vector(np.nanmean(place, axis=1), pairs, np.full(len(dofs) // 2, 2 / len(dofs)))


@symbols.register(PrescribedDisplacement)
@symbols.register(Support)
def _(support, layout):
    member = layout.beam(support.beam)
    boundary = support.boundary if isinstance(support, Support) else support.at
    dofs = member.dofs(boundary, support.names)
    if isinstance(member, RigidBody):
        yield _support([point(layout, member, boundary)],
                       "x y angle" if len(dofs) == 4 else "x y")
    elif isinstance(member, Domain):
        fixed = [name for k, name in enumerate(("x", "y")) if np.any(dofs % 2 == k)]
        at = _boundary(layout, member, boundary)
        away = at.start - np.mean(member.basis.mesh.p, axis=1)
        yield _support([at], " ".join([*fixed, "angle"]), away / (np.hypot(*away) or 1.0))
    else:
        for node in np.unique(dofs // member.nd).tolist():
            own = dofs[dofs // member.nd == node] % member.nd
            fixed = " ".join(name for name, found in (
                ("x", 0 in own), ("y", 1 in own), ("angle", np.any(own > 1))) if found)
            yield _support([at_node(layout, member, node)], fixed, _outward(member, node))


def _support(at, fixed, direction=(0.0, -1.0)):
    return Symbol("support", tuple(at), (tuple(direction),), text=fixed)


def _support_of(layout, beam, at, fixed):
    """A support symbol: at a node of a beam outward, elsewhere below."""
    member, direction = layout.beam(beam), (0.0, -1.0)
    if isinstance(member, Beam):
        off = np.hypot(*(member.mesh.p - at.start[:, None]))
        if np.min(off) < 1e-9 * member.mesh.height:
            direction = _outward(member, int(np.argmin(off)))
    return _support([at], fixed, direction)


@symbols.register(PlaneSection)
@symbols.register(PrescribedPosition)
def _(joint, layout):
    if isinstance(joint, PrescribedPosition):
        yield _support_of(layout, joint.beam, point(layout, joint.beam, joint.at), "x y")
    else:
        yield _support_of(layout, joint.beam, section(layout, joint.beam, joint.at)[0], "angle")


@symbols.register(PrescribedAngle)
@symbols.register(PrescribedTurn)
def _(joint, layout):
    beam, at = (joint.at if isinstance(joint, PrescribedTurn) else (joint.beam, joint.at))
    place = section(layout, beam, at)[0]
    if any(joint.angle(t) for t in (0.5, 1.0)) or isinstance(joint, PrescribedTurn):
        yield Symbol("motor", (place,), value=float(joint.angle(1.0)) or 1.0)
    else:
        yield _support_of(layout, beam, place, "angle")


@symbols.register(Hinge)
@symbols.register(Weld)
def _(joint, layout):
    weld = isinstance(joint, Weld)
    at = [(section(layout, b, a)[0] if weld else point(layout, b, a))
          for b, a in zip(joint.beams, joint.at) if not is_ground(b)]
    if any(map(is_ground, joint.beams)):
        member = next(b for b in joint.beams if not is_ground(b))
        yield _support_of(layout, member, at[0], "x y angle" if weld else "x y")
    else:
        yield Symbol("joint", tuple(at[:1]), text="weld" if weld else "hinge")


@symbols.register(Glue)
def _(joint, layout):
    yield Symbol("joint", (_boundary(layout, layout.beam(joint.domain), joint.boundary),),
                 text="weld")


@symbols.register(OnLine)
@symbols.register(OnCircle)
def _(joint, layout):
    at = point(layout, joint.beam, joint.at)
    x, y = joint.normal if isinstance(joint, OnLine) else at.start - joint.center
    yield Symbol("slider", (at,), (np.array([-y, x]) / np.hypot(x, y),))


@symbols.register(Sleeve)
@symbols.register(Slot)
def _(joint, layout):
    at = point(layout, *named_place(layout, joint.at))
    if isinstance(joint, Slot):
        along = joint.direction
    else:
        beam = layout.beam(joint.on)
        e, X, *_ = beam.finder.find(at.start[:, None])
        along = _tangent(beam, int(e[0]), float(X[0, 0]))
    yield Symbol("slider", (at,), (along,))


@symbols.register(Nodes)
def _(joint, layout):
    bound, several = joint._thawed(), np.bincount(joint.nodes) > 1
    bound.bind(layout)

    def place(end: int) -> Vector:
        return Vector(joint.graph.points[:, bound.nodes[end]], bound.positions[end][:, None],
                      np.ones(1))

    points = joint.graph.points[:, joint.nodes]
    for end in bound.leaders:
        fixed = [name for name, one in zip(COMPONENTS, bound.fixed[bound.nodes[end]]) if one]
        if fixed:  # away from the lines that meet
            meet = np.flatnonzero(bound.nodes == bound.nodes[end])
            away = np.sum(points[:, meet] - points[:, meet ^ 1], axis=1)
            size = np.hypot(*away)
            yield _support([place(end)], " ".join(fixed),
                           away / size if size > 1e-9 * joint.graph.size else (0.0, -1.0))
    for end in np.flatnonzero(bound.hinged & several[bound.nodes]):
        yield Symbol("joint", (place(end),), text="hinge")


# force elements

@symbols.register(Spring)
def _(spring, layout):
    yield Symbol("spring", tuple(end_of(layout, place) for place in spring.between),
                 text=_stiffness(spring.k))


@symbols.register(TorsionalSpring)
def _(spring, layout):
    yield Symbol("torsional spring", (section(layout, spring.beam, spring.at)[0],),
                 text=_stiffness(spring.k))


def _stiffness(k):
    return f"k = {float(k):.6g}" if isinstance(k, float) else "k(s)"


@symbols.register(PointMass)
def _(mass, layout):
    yield Symbol("mass", (point(layout, mass.beam, mass.at),), text="m = ", value=mass.mass,
                 show=True)


@symbols.register(Foundation)
def _(foundation, layout):
    for at, normals, _ in _faces(layout, layout.beam(foundation.beam), foundation.side):
        for k, (place, normal) in enumerate(zip(at, normals)):
            yield Symbol("foundation", (place,), (normal,),
                         text=_stiffness(foundation.k) if k == len(at) // 2 else "")


@symbols.register(Drag)
def _(drag, layout):
    yield Symbol("drag", (_middle(layout, drag.beam),), text="drag")


@symbols.register(Control)
def _(control, layout):
    at = control._point(layout, control.at)
    yield Symbol("control", (at,), text=f"{control.kind}(t, ...)")
