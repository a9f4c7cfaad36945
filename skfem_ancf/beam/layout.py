"""The degrees of freedom of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, TypeAlias

import numpy as np

from .beam import Beam
from .domain import Domain
from ..core import Array, InputError, NameUnknown, refuse, shown
from .rigid import RigidBody

#: Argument of :func:`select_beam`: a Beam, its name or number; None for the only one.
WhichBeam: TypeAlias = Beam | str | int | None

#: The same for beams, rigid bodies and domains.
WhichMember: TypeAlias = Beam | RigidBody | Domain | str | int | None


class Layout:
    """Beams, rigid bodies and domains, their names, and the numbers of their DOFs. Actions are
    bound to a Layout. The N DOFs are in the order of ``members``: beams, bodies, domains. ``nodes``
    are those of a frame, a :class:`~skfem_ancf.actions.joints.nodes.Nodes`. Raises InputError if
    there are none, or if members or names are not unique."""

    nodes: Any = None

    def __init__(self, *members: Beam | RigidBody | Domain) -> None:
        for one in members:
            if not isinstance(one, (Beam, RigidBody, Domain)):
                raise InputError("a scene is made of Beams, RigidBodies and Domains, got "
                                 f"{shown(one)}")
        refuse(not members, "a scene needs at least a Beam, a RigidBody or a Domain, got none")
        names = [one.name for one in members if one.name is not None]
        refuse(len(set(names)) < len(names) or len(set(map(id, members))) < len(members), "the "
               "beams of a scene must be different, with different names, got {}", names)
        self.beams = tuple([b for b in members if isinstance(b, Beam)])
        self.bodies = tuple([b for b in members if isinstance(b, RigidBody)])
        self.domains = tuple([b for b in members if isinstance(b, Domain)])
        self.members: tuple[Any, ...] = *self.beams, *self.bodies, *self.domains
        *self._first, self.N = accumulate([b.N for b in self.members], initial=0)
        self._numbers = {id(b): k for k, b in enumerate(self.members)}

    def __reduce__(self):
        return Layout, self.members, {"nodes": self.nodes}

    def number(self, which: WhichMember = None) -> int:
        """The number of a member (object, name or number); None for the only one."""
        if which is None and len(self.members) == 1:
            return 0
        if type(which) is int and 0 <= which < len(self.members):
            return which
        found = self._numbers.get(id(which))
        if found is not None:
            return found
        return self._numbers[id(select_member(self.beams, self.members[len(self.beams):], which))]

    def beam(self, which: WhichMember = None) -> Any:
        """A member by object, name or number; None for the only one."""
        return self.members[self.number(which)]

    def offset(self, which: WhichMember = None) -> int:
        """The first DOF of a member."""
        return self._first[self.number(which)]

    @property
    def sizes(self) -> Array:
        """Typical changes of the DOFs when members move by their size, shape (N,)."""
        return np.concatenate([b.sizes for b in self.members])


def select_beam(beams: Sequence[Beam], beam: WhichMember) -> Beam:
    """A beam by object, name or number; None for the only one."""
    if beam is None and len(beams) == 1:
        return beams[0]
    found: Sequence[Beam] = ()
    if isinstance(beam, Beam):
        found = [b for b in beams if b is beam]
    elif isinstance(beam, str):
        found = [b for b in beams if b.name == beam]
    elif isinstance(beam, int) and not isinstance(beam, bool) and beam >= 0:
        found = list(beams[beam:beam + 1])
    if found:
        return found[0]
    known = [b.name if b.name is not None else k for k, b in enumerate(beams)]
    refuse(not beams, "a beam is needed here, and the scene has none: give one of its members, its "
           "name or its number; got {!r}", beam)
    refuse(beam is None, "the scene has {} beams: choose one with beam=, of {}", len(beams), known)
    refuse(isinstance(beam, (RigidBody, Domain)), "a beam is needed here, got {!r}; beams are {}",
           beam, known)
    raise NameUnknown("beam", beam, known)


def select_member(beams: Sequence[Beam], bodies: Sequence[RigidBody | Domain],
                  which: WhichMember) -> Beam | RigidBody | Domain:
    """A beam, or a rigid body or domain, numbered after the beams; None for the only one."""
    if which is None and not beams and len(bodies) == 1:
        return bodies[0]
    if which is None or not bodies:
        return select_beam(beams, which)
    members = *beams, *bodies
    if isinstance(which, (RigidBody, Domain)):
        if any(b is which for b in bodies):
            return which
        raise NameUnknown("rigid body or domain", which, [b.name or len(beams) + k
                                                for k, b in enumerate(bodies)])
    return select_beam(members, which)  # type: ignore[arg-type]
