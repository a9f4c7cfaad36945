"""Springs and dashpots between points, and between directions of sections."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import (InputError, require_finite_scalar,
                      require_not_negative, shown, teaching)
from ..joints.base import GROUND, Vector, named_place, point, section
from ..rigid import RigidBody, on_body
from .base import ForceElement, Link, Part, difference, link
from .texts import SPRING, TORSION

if TYPE_CHECKING:
    from ..scene import Scene
    from ..types import Place, WhichBeam


def end_of(scene: Scene, place: Any) -> Vector:
    """A material point, or one of the ground.

    Parameters
    ----------
    scene
        What :meth:`ForceElement.bind` was given.
    place
        (x, y): the material point there, or the point of the ground where no beam and no rigid
        body is; a RigidBody, for its centre of mass; (beam, (x, y)); or ("ground", (x, y)).
    """
    which, at = named_place(scene, place, GROUND)
    return point(scene, which, at)


@teaching
class Spring(ForceElement):
    """A spring between two points, with a dashpot along the same line.

    Its force is ``k (l - length) + damping dl / dt`` of the distance l.

    Parameters
    ----------
    k
        Stiffness (force per length), zero or positive.
    between
        Two places, each (x, y): the material point there, or the point of the ground where no beam
        is; or (beam, (x, y)) with a Beam, a RigidBody, a name or a number; or ("ground", (x, y)).
    damping
        Force per velocity, zero or positive.
    length
        Length without force; that of the stress-free state by default.
    """

    def __init__(self, k: float, between: Any, damping: float = 0.0,
                 length: float | None = None) -> None:
        self.k = require_not_negative("k", k)
        self.damping = require_not_negative("damping", damping)
        self.length = None if length is None else require_not_negative("length", length, False)
        if not isinstance(between, (tuple, list)) or len(between) != 2:
            raise InputError("between must be two places, as ((1, 0), (1, 0.5)), got "
                             f"{shown(between)}")
        self.between = tuple((place, None) if isinstance(place, RigidBody) else place
                             for place in between)

    def bind(self, scene: Scene) -> list[Link]:
        a, b = (end_of(scene, place) for place in self.between)
        if not a.weights.size and not b.weights.size:
            raise InputError(f"neither end of the spring between {shown(self.between)} is a point "
                             "of a beam or a rigid body: both would be of the ground")
        self._link = difference(a, b)
        distance = float(np.hypot(*self._link.start))
        if distance == 0.0 and self.length != 0.0:
            raise InputError(f"the spring between {shown(self.between)} has length zero, and so no "
                             "direction: name two different points, or give length=0 for a spring "
                             "that pulls them together")
        self._length = distance if self.length is None else self.length
        return [self._link]

    def parts(self) -> list[Part]:
        return [Part(SPRING, self._link, Link(np.zeros(2)),
                     (self.k, self._length, self.damping, 0.0, 0.0))]

    def __repr__(self) -> str:
        return f"<Spring {self.k:g} between {shown(self.between)}>"


@teaching
class TorsionalSpring(ForceElement):
    """A moment against the angle by which a section turns, with a dashpot.

    The moment is ``k (phi - angle) + damping dphi / dt``, phi the angle from the stress-free state,
    to the ground or to another section, taken in (-pi, pi] about ``angle``.

    Parameters
    ----------
    k
        Moment per angle, zero or positive.
    at
        A place that is one section of a beam, or a point through which it goes; or a RigidBody.
    damping
        Moment per angular velocity, zero or positive.
    beam
        The beam, its name or its number, in a scene of several.
    other
        The other section as (beam, place); None for the ground.
    angle
        The angle without moment, in [-pi, pi].
    """

    def __init__(self, k: float, at: Place, damping: float = 0.0, beam: WhichBeam = None,
                 other: Any = None, angle: float = 0.0) -> None:
        self.k = require_not_negative("k", k)
        self.damping = require_not_negative("damping", damping)
        self.at, self.beam = on_body(at, beam)
        if other is not None and (not isinstance(other, (tuple, list)) or len(other) != 2):
            raise InputError("other must be a section of another beam, as (1, 'left'), got "
                             f"{shown(other)}")
        self.other = None if other is None else tuple(other)
        self.angle = require_finite_scalar("angle", angle)
        if abs(self.angle) > np.pi:
            raise InputError(f"angle must lie in [-pi, pi], got {self.angle!r}: the angle of a "
                             "section is known up to whole turns only. Of a spring wound by "
                             "more, add the moment of the turns, 2 pi k each, by scene.moment")

    def bind(self, scene: Scene) -> list[Link]:
        self._d = link(section(scene, self.beam, self.at)[1])
        self._e = link(Link(self._d.start)) if self.other is None else link(
            section(scene, *self.other)[1])
        d, e = self._d.start, self._e.start
        self._start = float(np.arctan2(e[0] * d[1] - e[1] * d[0], d @ e)) + self.angle
        return [self._d, self._e]

    def parts(self) -> list[Part]:
        return [Part(TORSION, self._d, self._e, (self.k, self.damping, np.cos(self._start),
                                                 np.sin(self._start), 0.0))]

    def __repr__(self) -> str:
        return f"<TorsionalSpring {self.k:g} at {shown(self.at)}>"
