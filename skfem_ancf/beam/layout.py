"""The degrees of freedom of a scene, as joints and force elements see them when they are bound."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias

from .beam import Beam
from ..core.errors import InputError, NameUnknown, shown
from .rigid import RigidBody

#: What :func:`select_beam` takes: a Beam, its name or its number; None for the only one.
WhichBeam: TypeAlias = Beam | str | int | None

#: The same, of beams and rigid bodies.
WhichMember: TypeAlias = Beam | RigidBody | str | int | None


class Layout(Protocol):
    """Beams and rigid bodies, and the numbers of their degrees of freedom.

    ``bind(layout)`` of a joint or a force element finds its points in it. A
    :class:`~skfem_ancf.Scene` is one.

    Attributes
    ----------
    beams, bodies, members
        The beams, the rigid bodies, and both: beams first.
    N
        Number of degrees of freedom.
    """

    @property
    def beams(self) -> Sequence[Beam]: ...

    @property
    def bodies(self) -> Sequence[RigidBody]: ...

    @property
    def members(self) -> Sequence[Beam | RigidBody]: ...

    @property
    def N(self) -> int: ...

    def beam(self, beam: WhichMember = None) -> Any:
        """The beam or rigid body meant by itself, a name, a number, or None for the only one."""

    def offset(self, beam: WhichMember) -> int:
        """Number of the first degree of freedom of a beam or rigid body."""


def select_beam(beams: Sequence[Beam], beam: WhichMember) -> Beam:
    """The beam meant by a Beam, a name, a number, or None where there is only one.

    Raises
    ------
    NameUnknown
        If there is no such beam.
    InputError
        If None is given and there are several.
    """
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
    if not beams:
        raise InputError("this is asked of beams, the scene has rigid bodies alone: name one of "
                         f"them, by itself, its name or its number; got {shown(beam)}")
    if beam is None:
        raise InputError(f"the scene has {len(beams)} beams: say which with beam=, one of {known}")
    if isinstance(beam, RigidBody):
        raise InputError(f"this is asked of beams, got {shown(beam)}; beams are {known}")
    raise NameUnknown("beam", beam, known)


def select_member(beams: Sequence[Beam], bodies: Sequence[RigidBody],
                  which: WhichMember) -> Beam | RigidBody:
    """As :func:`select_beam`, of beams and of rigid bodies, which are numbered behind them.

    None is the only beam, without beams the only body.
    """
    if which is None and not beams and len(bodies) == 1:
        return bodies[0]
    if which is None or not bodies:
        return select_beam(beams, which)
    members = *beams, *bodies
    if isinstance(which, RigidBody):
        found = [b for b in bodies if b is which]
        if found:
            return found[0]
        raise NameUnknown("rigid body", which, [b.name or len(beams) + k
                                                for k, b in enumerate(bodies)])
    return select_beam(members, which)  # type: ignore[arg-type]
