"""Prescribed motion of a point or a section, plane sections, and motors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...beam.kinematics import plane
from ...beam.layout import Layout, WhichBeam, WhichMember
from ...beam.rigid import on_body
from ...core.errors import (InputError, ask_number, require_finite_scalar, require_function,
                            require_label, sample)
from ...core.types import Array, Place, TimeFunction
from ...mesh.places import node_of
from ..item import Item
from ..loads import EndMoment
from ..places import Vector, both_of, point, section
from ..symbols import Symbol, support_of, supports_of
from .base import Affine, Aligned, ComposedJoint, Joint, angle_to, rotation

#: Largest number of intervals of an integral over time.
PIECES = 500


class PrescribedPosition(ComposedJoint):
    """r = r(t) for a material point. At a node of the axis it only fixes degrees of freedom.

    Parameters
    ----------
    at
        The material point (x, y) in the reference configuration, or the name of an end; or a
        RigidBody, for its centre of mass unless a point is given.
    r
        Function of time that returns the position (2,).
    """

    equations = ("force along x", "force along y")
    moving = True
    driver = "motion"

    def __init__(self, at: Any = None, r: Callable[[float], ArrayLike] | None = None,
                 beam: WhichMember = None, name: str | None = None) -> None:
        self.motion = require_function("r", r, "of time that returns a position (2,)")
        self.at, self.beam = on_body(at, beam)
        self.name = require_label("name", name)

    def bind(self, layout: Layout) -> None:
        self.r = point(layout, self.beam, self.at)

    def parts_at(self, t: float) -> Sequence[Any]:
        return [Affine((self.r, n), less=n @ x) for n in np.eye(2)
                for x in sample(self.motion, np.array([t]), "r", (2,))]

    def offset(self, times: Array, N: int) -> Array:
        return self.r.start - sample(self.motion, times, "r", (2,))

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = point(layout, self.beam, self.at)
        return (support_of(layout, self.beam, at, "x y"),)


class PrescribedDisplacement(Joint):
    """Degrees of freedom of a place follow a function of time: ``u[dofs] = displacement(t)``.

    Parameters
    ----------
    boundary, names, beam
        As for a support, see :class:`~skfem_ancf.actions.supports.Support`.
    displacement
        A function of time, in statics of the load factor, that returns a number in the unit of the
        degrees of freedom.
    """

    moving = True
    driver = "displacement"

    def __init__(self, boundary: Any, names: Any, displacement: Callable[[float], float],
                 beam: WhichMember = None, name: str | None = None) -> None:
        self.displacement = require_function("displacement", displacement,
                                             "of time that returns a number")
        self.at, self.names, self.beam, self.name = boundary, names, beam, name

    def bind(self, layout: Layout) -> None:
        member = layout.beam(self.beam)
        dofs = member.dofs(self.at, self.names)
        self.equations = tuple(f"force on {member.dofnames[d % member.nd]}" for d in dofs)
        self.dofs = dofs + layout.offset(member)
        self.offset(np.zeros(1), 0)  # what is wrong with the function is said here

    def value(self, u: Array, t: float) -> Array:
        return u[self.dofs] + self.offset(np.array([t]), len(u))[0]

    def offset(self, times: Array, N: int) -> Array:
        values = sample(self.displacement, times, "displacement", ())
        return np.repeat(-values[:, None], len(self.dofs), axis=1)

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        n = len(self.dofs)
        return np.arange(n), self.dofs, np.ones(n)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        return supports_of(layout, self.beam, self.at, self.names)


class PrescribedAngle(ComposedJoint):
    """Prescribed rotation of a section or a rigid body: e(t) x d = 0.

    Parameters
    ----------
    at
        The section, as "left" or "right" or a point on it; a RigidBody. Not needed if ``beam`` is a
        RigidBody.
    angle
        Rotation from the reference configuration as a function of time, in radians,
        counterclockwise.
    beam
        Beam, name or number; None where there is only one. Or a RigidBody.
    """

    equations = ("moment",)
    constant = False
    moving = True
    driver = "angle"

    def __init__(self, at: Any = None, angle: Callable[[float], float] | None = None,
                 beam: WhichMember = None, name: str | None = None) -> None:
        self.angle = require_function("angle", angle, "of time that returns radians")
        self.at, self.beam = on_body(at, beam)
        self.name = require_label("name", name)

    def bind(self, layout: Layout) -> None:
        _, self.d = section(layout, self.beam, self.at)
        self.start = np.arctan2(*self.d.start[::-1])

    def parts_at(self, t: float) -> Sequence[Any]:
        return [Affine((self.d, n)) for n in self._normals(np.array([t]))]

    def _normals(self, times: Array) -> Array:
        a = self.start + sample(self.angle, times, "angle", ())
        return np.column_stack([-np.sin(a), np.cos(a)])

    def offset(self, times: Array, N: int) -> Array:
        return self._normals(times) @ self.d.start[:, None]

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        values, columns = self._normals(times)[:, :, None] * self.d.weights, self.d.dofs.ravel()
        return 0 * columns, columns, values.reshape(len(times), -1)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = section(layout, self.beam, self.at)[0]
        if any(self.angle(t) for t in (0.5, 1.0)):
            return (Symbol("motor", (at,), value=float(self.angle(1.0)) or 1.0),)
        return (support_of(layout, self.beam, at, "angle"),)


class Turned:
    """The integral of an angular velocity, a number or a function, from time 0."""

    def __init__(self, speed: float | Callable[[float], float]) -> None:
        self.speed = require_function("speed", speed, "of time that returns radians per time") if (
            callable(speed)) else require_finite_scalar("speed", speed)

    def __call__(self, t: float) -> float:
        if not callable(self.speed):
            return self.speed * t
        return float(scipy.integrate.quad(
            lambda s: ask_number("speed(t={:g})", self.speed, s), 0.0, t,
            epsabs=1e-13, epsrel=1e-13, limit=PIECES)[0])


class PrescribedTurn(ComposedJoint):
    """Prescribed relative rotation of two sections or rigid bodies: d x (R(t) e) = 0.

    Parameters
    ----------
    at, other
        Each (beam, place) with a Beam, a RigidBody, a name or a number, and a place as for
        :class:`PrescribedAngle`: the rotated section, and the reference.
    angle
        Relative rotation from the reference configuration as a function of time, in radians,
        counterclockwise.
    """

    equations = ("moment",)
    constant = tabled = False
    moving = True
    driver = "angle"

    def __init__(self, at: Any, other: Any, angle: Callable[[float], float],
                 name: str | None = None) -> None:
        self.angle = require_function("angle", angle, "of time that returns radians")
        self.at, self.other = both_of("at", at), both_of("other", other)
        self.name = require_label("name", name)

    def bind(self, layout: Layout) -> None:
        (_, self.d), (_, self.e) = (section(layout, *place) for place in (self.at, self.other))
        self.start = angle_to(self.d.start, self.e.start)

    def parts_at(self, t: float) -> Sequence[Any]:
        angle = self.start + ask_number("angle(t={:g})", self.angle, t)
        return [Aligned(self.d, self.e, rotation(angle))]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = section(layout, *self.at)[0]
        return (Symbol("motor", (at,), value=float(self.angle(1.0)) or 1.0),)


# a motor rotates a section or a rigid body


class Motor(Item):
    """Rotate a rigid body or a section by a given angle, at a given speed, or with a torque.

    For a torque that depends on the state use a :class:`~skfem_ancf.Control`.

    Parameters
    ----------
    at
        A RigidBody, or (beam, place) with a place that is one section, as (0, "left").
    angle
        Rotation from the start as a function of time, in radians.
    speed
        Angular velocity, a number or a function of time, integrated from time 0.
    torque
        Moment, a number or a function of time; a function is 1 in statics, as every amplitude.
    other
        The base of the motor, as ``at``: the angle is relative to it, and it takes the opposite
        torque. The ground by default.
    """

    def __init__(self, at: Any, angle: TimeFunction = None, speed: Any = None, torque: Any = None,
                 other: Any = None) -> None:
        given = [name for name, value in (("angle", angle), ("speed", speed), ("torque", torque))
                 if value is not None]
        if len(given) != 1:
            raise InputError("a motor has an angle, a speed or a torque: give one of them, got "
                             f"{given or 'none'}")
        self.at = both_of("at", at)
        self.other = None if other is None else both_of("other", other)
        self.torque = torque if torque is None or callable(torque) else (
            require_finite_scalar("torque", torque))
        self.angle: Any = angle if speed is None else Turned(speed)

    def expand(self, layout: Layout) -> Sequence[Item]:
        if self.torque is None:
            if self.other is None:
                return (PrescribedAngle(self.at[1], self.angle, self.at[0]),)
            return (PrescribedTurn(self.at, self.other, self.angle),)
        M, amplitude = (1.0, self.torque) if callable(self.torque) else (self.torque, None)
        couple = None if self.other is None else object()
        places = [(self.at, M)] + ([] if self.other is None else [(self.other, -M)])
        return [EndMoment(place, size, layout.number(which), amplitude)._with(couple=couple)
                for (which, place), size in places]


# an end section with fixed direction and free thickness

class PlaneSection(ComposedJoint):
    """t . r_Y = 0 at every section point: section slopes stay in the reference plane.

    For a cable, n . r_X = 0. On a beam along a coordinate axis it only fixes degrees of freedom.

    Parameters
    ----------
    at
        The end section, "left" or "right".
    """

    def __init__(self, at: Place, beam: WhichBeam = None, name: str | None = None) -> None:
        self.at, self.beam, self.name = at, beam, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        beam = layout.beam(self.beam)
        node = node_of(beam.mesh, self.at)
        t = beam.mesh.p_X[:, node]
        direction, fixed = plane(beam, t)
        self.direction = np.array([0.0 if abs(x) < 1e-14 else x for x in direction.tolist()])
        first = layout.offset(beam) + node * beam.nd
        self.equations = tuple(f"moment on {beam.element.dofnames[k]}" for k in fixed)
        self.parts = [Affine((Vector(np.zeros(2), first + 2 * k + np.arange(2)[:, None], 1.0),
                              self.direction)) for k in fixed]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = section(layout, self.beam, self.at)[0]
        return (support_of(layout, self.beam, at, "angle"),)

