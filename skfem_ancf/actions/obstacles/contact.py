"""Contact points, forces and pressures of a state."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core import Array, InputError, NameUnknown, refuse, require_index
from ..item import Item


@dataclass(frozen=True)
class Contact:
    """Contact of bodies with obstacles, or with each other.

    In a motion with ``"energy-momentum"`` forces and pressures are means over the step that ends at
    the instant, also at points that have parted within it: the force times the step is the impulse.

    Attributes
    ----------
    points
        Positions of contact points, shape (2, n).
    force
        Contact force on each of them, shape (2, n); their sum is ``total``.
    pressure
        Normal force per reference area, shape (n,). Nodal values are in equilibrium with the
        forces, linear in between: forces of single points oscillate along an element.
    gap
        Distance from the obstacle or the other body, negative for penetration, shape (n,).
    nearest
        The smallest distance of all surface points, in contact or not; of bodies from each other,
        infinite if none is near.
    sticking
        True where friction holds the point, shape (n,).
    """

    points: Array
    force: Array
    pressure: Array
    gap: Array
    nearest: float
    sticking: Array

    @property
    def total(self) -> Array:
        """Sum of the forces, shape (2,)."""
        return self.force.sum(axis=1)

    @property
    def penetration(self) -> float:
        """Largest penetration; zero without contact."""
        return max(0.0, -self.nearest)

    @property
    def arrays(self) -> dict[str, Array]:
        """Values at the points by name, forces with a third component of zero, for files."""
        return {"force": np.pad(self.force.T, ((0, 0), (0, 1))), "pressure": self.pressure,
                "gap": self.gap, "sticking": self.sticking.astype(float)}

    def __len__(self) -> int:
        return self.points.shape[1]

    def __repr__(self) -> str:
        return (f"<Contact at {len(self)} points, penetration {self.penetration:.3g}, nearest "
                f"{self.nearest:.3g}>")


def may_touch(one: Any) -> bool:
    """True for a System, or a State of one, with obstacles or with contact of its members."""
    forces = getattr(getattr(one, "system", one), "forces", None)
    return forces is not None and bool(forces.contacts.obstacles or any(
        hasattr(element, "look") for element, _ in forces.changing))


def touching(state: Any) -> Contact | None:
    """Contact of a state; None where nothing touches, and in linear theory."""
    found = contact_of(state) if may_touch(state) and state.base is None else ()
    return found or None


def contact_of(state: Any, which: Any = None, on: Any = None) -> Contact:
    forces, start, span = _step_of(state)
    if not (forces.contacts.obstacles or forces.changing):
        raise InputError("the scene has no contact: scene.obstacle(Circle((0, -1), 0.5)) adds an "
                         "obstacle, scene.contact('all') that of its members with each other")
    members, member = state.system.members, None
    if on is not None:
        names = [getattr(one, "name", None) for one in members]
        known_as = [k for k, one in enumerate(members) if one is on or names[k] == on]
        if isinstance(on, str) and not known_as:
            raise NameUnknown("member", on, [name or k for k, name in enumerate(names)])
        member = known_as[0] if known_as else require_index("on", on, len(members))
    if isinstance(which, Item):
        known = [e for e in forces.elements if e.same(which) and (e.groups or hasattr(e, "look"))]
        refuse(not known, "{!r} is no obstacle and no contact of this scene", which)
    elif which is not None:
        refuse(not forces.contacts.obstacles, "the scene has no obstacle: state.contact() is that "
               "of its members, state.contact(on=...) that of one of them; got {!r}", which)
        known = [forces.contacts.obstacles[require_index("obstacle", which,
                                                         len(forces.contacts.obstacles))]]
    else:
        known = forces.elements
    found = [*_touching(state, forces, start, span, known, member)]
    *parts, nearest = zip(*found) if found else (
        *((np.zeros(shape),) for shape in ((2, 0), (2, 0), (0,), (0,))), (np.zeros(0, bool),),
        (np.inf,))
    places, force, pressure, gap, sticks = (np.concatenate(x, axis=-1) for x in parts)
    return Contact(places, force, pressure, gap, min(nearest), sticks)


def _step_of(state):
    """Forces of items with their history at the start of the last step, the displacement there and
    the size of the step; None and 0 for an instant."""
    start = None if state._motion is None else state._motion.start
    if start is None or start[-1] == 0.0:
        return state._equations.forces, None, 0.0
    u, of_items, span = np.split(start, [state.system.N, len(start) - 1])
    if not of_items.size:
        return state._equations.forces, u, float(span[0])
    memory = np.append(state.memory[:-of_items.size], of_items)
    return state.system.after(memory).forces, u, float(span[0])


def _pushes(state, start, span):
    contacts = state._equations.forces.contacts
    v = None if state.t is None else np.array(state.v)
    found = contacts.obstacles and contacts.pushes(np.array(state.u), v, state._time, start, span)
    return contacts, zip(contacts.groups, found)


def _touching(state, forces, start, span, known, member):
    """Contact points, forces, pressures, gaps, sticking and the least gap of each group of points
    of an obstacle, then of bodies that touch each other, on both sides."""
    contacts, pushes = _pushes(state, start, span)
    for (k, group), push in pushes:
        one, first, on = contacts.obstacles[k], int(group.first[0]), push.touches
        if not any(one is other for other in known) or (
                member is not None and not state.system.slices[member].start <= first < (
                    state.system.slices[member].stop)):
            continue
        yield (push.points[:, on], push.force[:, on], _balanced(group, push.pressure, on)[on],
               push.gap[on], push.held[on], float(push.gap.min()))
    for element, at in forces.changing:
        if not hasattr(element, "look") or not any(element.same(other) for other in known):
            continue
        x, y, force, pressure, gap, sticks, own, other = element.look(
            np.array(state.u)[at].reshape(-1, 2), state._time, element.history,
            None if start is None else start[at].reshape(-1, 2))
        both = [np.append(x, y, axis=1), np.append(force, -force, axis=1),
                *(np.tile(value, 2) for value in (pressure, gap, sticks))]
        here = np.ones(2 * len(gap), bool) if member is None else np.append(own, other) == member
        yield *(value[..., here] for value in both), float(np.min(both[3][here], initial=np.inf))


def loads_of_contact(state: Any, beam: Any, dofs: slice) -> list[tuple[int, float, Array]]:
    """Forces of contact on a beam, whose DOFs are given: element, xi, and nodal force (nb, 2)."""
    u, out, (forces, start, span) = np.array(state.u), [], _step_of(state)
    for (_, group), push in _pushes(state, start, span)[1]:
        if not dofs.start <= group.first[0] < dofs.stop:
            continue
        m, ne, xi = group.points, group.elements - 2, _along_elements(group)
        for k in np.flatnonzero(np.any(push.force, axis=0)).tolist():
            e, F = k // m, push.force[:, k]
            e, at = (e, xi[k]) if e < ne else (0, 0.0) if e == ne else (ne - 1, 1.0)
            nodal = np.outer(group.weights[:, k], F)
            if len(group.slopes):  # beside the axis of a cable, by the rotation of its tangent
                q = u[group.first[k] + np.arange(2 * len(nodal))].reshape(-1, 2)
                x, y = slope = group.starts[2:, k] + group.slopes[:, k] @ q
                nodal -= group.offsets[k] * (F @ slope) / (slope @ slope) ** 1.5 * np.outer(
                    group.slopes[:, k], [-y, x])
            out.append((e, float(at), nodal))
    for element, at in forces.changing:
        if hasattr(element, "loads_on"):
            out += element.loads_on(beam, dofs.start, u[at].reshape(-1, 2), element.history,
                                    None if start is None else start[at].reshape(-1, 2))
    return out


def _along_elements(group):
    """Position xi (n,) of points along their elements, of ends along the height."""
    x = group.starts[:2].reshape(2, 2 * group.elements, -1)
    length = np.cumsum(np.hypot(*np.diff(x, axis=2, prepend=x[..., :1])), axis=1)
    return (length / np.maximum(length[:, -1:], 1e-300)).ravel()


def _balanced(group, pressure, touching):
    """The nodal pressure (n,) in equilibrium with the forces of points; zero where none touches."""
    # The nodal force over the area of its shape function (lumped) on the contact surface; free
    # points between two in contact count if these are less than an element apart. The positions of
    # both nodes have the functions number 0 and half; each side of the beam is separate.
    from scipy.ndimage import binary_closing  # its import takes as long as a solution

    n, m, half = group.elements, group.points, len(group.weights) // 2
    side = np.tile(np.arange(m) // (m // 2), n)
    side[-2 * m:] = 2 + np.repeat((0, 1), m)  # the ends of the beam, each as a whole
    ends = np.array([group.first, group.first + 2 * half])
    ends[1, -2 * m:] = ends[0, -2 * m:]
    nodes = np.unique(ends * 4 + side, return_inverse=True)[1].reshape(2, -1)
    # A corner is a point of bottom or top and points of an end. A face that touches only there
    # faces away from the obstacle: its force is on the other one. So points at corners belong with
    # a point each of the face there that touches more, (2, k).
    last, places, pairs = (n - 2) * m, np.vstack([group.starts[:2], group.offsets]), list[Any]()
    for end, element, first in ((last, 0, 0), (last + m, last - m, -1)):
        ends_of = np.arange(end, end + m)
        for face in (element, element + m // 2):
            sides = np.arange(face, face + m // 2)
            corner = sides[first]
            apart = np.abs(places[:, ends_of] - places[:, [corner]]).max(axis=0)
            near = apart < 1e-6 * group.height
            rest = [group.areas[some[touching[some]]].sum() for some in (
                sides[sides != corner], ends_of[~near])]
            if rest[0] < rest[1]:
                pairs.append((corner, ends_of[~near][0]))
            elif rest[0] > rest[1]:
                pairs += [(i, corner) for i in ends_of[near]]
    moved = np.array(pairs, dtype=int).reshape(-1, 2).T
    nodes[:, moved[0]] = nodes[:, moved[1]]
    closed = touching.copy()
    for k in (0, 1):
        along = np.pad(touching[:-2 * m].reshape(-1, 2, m // 2)[:, k].ravel(), m)
        filled = binary_closing(along, np.ones(m // 2 + 1))[m:-m]
        closed[:-2 * m].reshape(-1, 2, m // 2)[:, k] = filled.reshape(-1, m // 2)
    closed[moved[0]] = False
    shares = group.weights[[0, half]] * group.areas
    force, area = (np.bincount(nodes.ravel(), (shares * factor).ravel())
                   for factor in (pressure, closed))
    mean = (force / np.where(area > 0.0, area, 1.0))[nodes]
    xi = _along_elements(group)
    xi[moved[0]] = xi[moved[1]]
    return np.where(touching, (1.0 - xi) * mean[0] + xi * mean[1], 0.0)
