"""Joints of points and sections: hinge, weld, glue, prescribed motions, plane sections, motors."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import scipy
from scipy import sparse
from skfem import BilinearForm
from skfem.helpers import dot

from ...beam import Beam, BeamPoints, Domain, Layout, RigidBody, WhichBeam, WhichMember, on_body
from ...beam.kinematics import plane
from ...core import (Array, ArrayLike, InputError, MeshError, Place, TimeFunction, ask_number,
                     refuse, require_finite_scalar, require_flag, require_function, require_label,
                     sample, shown)
from ...mesh.places import facets_of, is_point, node_of, points_of_rows
from ..item import Item
from ..loads import EndMoment
from ..places import Vector, both_of, is_ground, point, section
from ..symbols import Symbol, boundary_of, support_of, supports_of
from .base import ComposedJoint, Equation, Joint, aligned, angle_to, rotation

# hinge between two or more beams

def _meeting(beams: Any, at: Any, what: str, names: tuple[str, ...]
             ) -> tuple[tuple[Any, ...], tuple[Any, ...], tuple[str, ...]]:
    """Two or more beams and bodies, the place of each, which is given once for all or once for
    each, and names of the equations between the first and each of the others."""
    refuse(not isinstance(beams, (tuple, list)) or len(beams) < 2, "beams must be two beams or "
           "rigid bodies or more, by Beam, RigidBody, name or number, or 'ground', got {!r}", beams)
    refuse(all(map(is_ground, beams)), "a joint needs a beam or a rigid body, got {!r}", beams)
    refuse(at is None, "a joint needs {}", what)
    at, n = points_of_rows(at), len(beams)
    if isinstance(at, (str, np.ndarray)) or callable(at) or is_point(at):  # one place
        at = (at,) * n
    refuse(not isinstance(at, (tuple, list)) or len(at) != n, "a joint of {} beams needs {}, one "
           "for all of them or one for each, as at=('right', 'left'), got {!r}", n, what, at)
    return tuple(beams), tuple(at), names if n == 2 else tuple(
        f"{name}, from number {k}" for k in range(1, n) for name in names)


class Hinge(ComposedJoint):
    """r_a = r_b for a material point of two beams, and of further ones; rotations are free.

    Parameters
    ----------
    beams
        Two or more, each a Beam or a RigidBody, its name or number, or "ground".
    at
        The point (x, y) in the reference configuration; or one point for each beam, if they are
        apart. None is the centre of mass of a rigid body.
    """

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None) -> None:
        self.beams, self.at, self.equations = _meeting(
            beams, at, "the point at=", ("force along x", "force along y"))
        self.name = require_label("name", name)

    def bind(self, layout: Layout) -> None:
        first, *others = (point(layout, beam, at) for beam, at in zip(self.beams, self.at))
        self.parts = [Equation((first, n), (other, -n)) for other in others for n in np.eye(2)]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        return symbol_of(self, layout, "hinge", "x y", point)


# bond between a boundary of a domain and another member (mortar method)

class Glue(Joint):
    """The boundary of a domain bonded to the surface of another member: the mortar method.

    For each test function of the domain on the boundary, its integral times the difference of the
    displacements is zero: the trace of the domain is the L2 projection of the other displacement.
    The other member may be the end or a side of a beam with sections, a rigid body, another domain
    or the ground. The equations are linear and constant. Raises InputError if a point of the
    boundary is not on the other member at that place. See Bernardi, Maday, Patera: "A new
    nonconforming approach to domain decomposition: the mortar element method", in: Nonlinear
    partial differential equations and their applications (1994).

    Parameters
    ----------
    domain, boundary
        The :class:`~skfem_ancf.Domain`, its name or number, and a boundary of its mesh.
    other, place
        The other member, and for a beam its place, as "left" or "top".
    name
        Name in messages.
    """

    def __init__(self, domain: Any, boundary: Any, other: Any, place: Any = None,
                 name: str | None = None) -> None:
        self.domain, self.boundary = domain, boundary
        self.other, self.place, self.name = other, place, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        domain = layout.beam(self.domain)
        if not isinstance(domain, Domain):
            raise InputError(f"a Glue needs the boundary of a Domain, got {domain!r}")
        basis, first = domain.trace(self.boundary), layout.offset(domain)
        tests = domain.dofs(self.boundary)
        M = BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis).tocoo()
        rows, columns = domain.numbers(M.row), domain.numbers(M.col)
        keep = np.isin(rows, tests)
        row = np.searchsorted(tests, rows[keep])
        one = domain.rigid_motions()[:, :2].sum(axis=1)[columns[keep]]
        size, largest = (np.bincount(row, v) for v in (M.data[keep] * one, np.abs(M.data[keep])))
        size = np.where(size > 1e-6 * largest, size, largest)  # multipliers add up to the force
        found = [(row, first + columns[keep], M.data[keep])]
        if not is_ground(self.other):
            dofs, weights = self._surface(layout, np.reshape(basis.global_coordinates(), (2, -1)))
            for k in range(basis.Nbfun):  # test function k at the points, in component k % 2
                value = (np.asarray(basis.basis[k][0])[k % 2] * basis.dx).ravel()
                test = np.repeat(domain.numbers(basis.element_dofs[k]), basis.dx.shape[1])
                used, = np.nonzero(np.isin(test, tests) & (value != 0.0))
                at, w = dofs[k % 2][:, used], weights[k % 2][:, used]
                found.append((np.broadcast_to(np.searchsorted(tests, test[used]), at.shape).ravel(),
                              at.ravel(), -(value[used] * w).ravel()))
        i, j, v = map(np.concatenate, zip(*found))
        A = sparse.coo_array((v / size[i], (i, j)), shape=(len(tests), layout.N)).tocsr().tocoo()
        keep = np.abs(A.data) > 1e-14  # else round-off
        self.found = A.row[keep], A.col[keep], A.data[keep]
        self.equations = tuple(f"force along {'xy'[c]}" for c in tests % 2)

    def _surface(self, layout: Layout, x: Array) -> tuple[Array, Array]:
        """DOFs and weights in the displacement of points, (2, k, n) both."""
        other, domain = layout.beam(self.other), layout.beam(self.domain)
        try:
            if isinstance(other, Domain):
                dofs, weights = other.probes(x)
            elif isinstance(other, RigidBody):
                dofs, weights = np.moveaxis(np.array([other.probe(p) for p in x.T]), 0, -1)
                dofs = dofs.astype(int)
            else:
                e, X, _ = other.finder.inside(x)
                if self.place is not None and not is_point(self.place):
                    cells = np.unique(other.mesh.f2t[:, facets_of(other.mesh, self.place)])
                    off = x[:, ~np.isin(e, cells)].T
                    if len(off):
                        raise MeshError(f"({off[0, 0]:.6g}, {off[0, 1]:.6g}) is in the beam "
                                        "elsewhere")
                found = BeamPoints(other, 0, slice(0, other.N), None, e, X)
                dofs, weights = found.dofs.swapaxes(0, 1), found.weights
        except MeshError as error:
            raise InputError(f"the boundary {shown(self.boundary)} of {domain!r} does not meet "
                             f"{other!r} at {shown(self.place)}: {error}. Both have to be at one "
                             "place in the reference configuration, and the beam as high as the "
                             "boundary is long: name facets by mesh.with_boundaries({...}), or "
                             "move a mesh by mesh.translated(...)") from None
        return layout.offset(other) + dofs, np.broadcast_to(weights, dofs.shape)

    def value(self, u: Array, t: float) -> Array:
        i, j, v = self.found
        return np.bincount(i, v * u[j], len(self.equations))

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = boundary_of(layout, layout.beam(self.domain), self.boundary)
        return (Symbol("joint", (at,), text="weld"),)


class Weld(ComposedJoint):
    """Sections that coincide and keep their relative angles of the reference configuration.

    The direction of a section is its best-fit line, so it may warp and change its thickness; for a
    cable it is the tangent.

    Parameters
    ----------
    beams
        Two or more, each a Beam or a RigidBody, its name or number, or "ground".
    at
        The section of each beam, as ``("right", "left")``, or a material point (x, y), also inside
        an element; or one place for all, as a common point ``(1, 0)``.
    apart
        Allow a distance between the points in the reference configuration, which the weld closes.
    """

    constant = False

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None,
                 apart: bool = False) -> None:
        self.beams, self.at, self.equations = _meeting(
            beams, at, "the section of each beam", ("force along x", "force along y", "moment"))
        self.name, self.apart = require_label("name", name), require_flag("apart", apart)

    def expand(self, layout: Layout) -> Sequence[Item]:
        """The weld, or a Glue between a boundary of a domain and a member that is not a cable."""
        members = [None if is_ground(beam) else layout.beam(beam) for beam in self.beams]
        which = [k for k, one in enumerate(members) if isinstance(one, Domain)]
        if not which or any(isinstance(one, Beam) and not one.has_sections for one in members):
            return (self,)
        k = which[0]
        return [Glue(layout.number(self.beams[k]), self.at[k], beam, at, self.name)._with(
            _key=self._key) for n, (beam, at) in enumerate(zip(self.beams, self.at)) if n != k]

    def bind(self, layout: Layout) -> None:
        (a, d), *others = (section(layout, beam, at) for beam, at in zip(self.beams, self.at))
        self.parts = []
        for b, e in others:
            gap = b.start - a.start
            beams = [layout.beam(beam) for beam in self.beams if not is_ground(beam)]
            if not self.apart and np.hypot(*gap) > 1e-6 * min(beam.size for beam in beams):
                centre = next((f": of {beam!r} alone it is the centre of mass that is meant, name "
                               "the point, as (body, (x, y)); or" for beam, at in
                               zip(self.beams, self.at) if at is None), ":")
                raise InputError(
                    f"the sections to weld are {np.hypot(*gap):.6g} apart, one at "
                    f"({a.start[0]:.6g}, {a.start[1]:.6g}), the other at "
                    f"({b.start[0]:.6g}, {b.start[1]:.6g}){centre} name sections that meet, move a "
                    f"mesh by mesh.translated(({0 - gap[0]:.6g}, {0 - gap[1]:.6g})), or weld with "
                    "apart=True to draw them together")
            self.parts += [*(Equation((a, n), (b, -n)) for n in np.eye(2)),
                           aligned(d, e, rotation(angle_to(d.start, e.start)))]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        return symbol_of(self, layout, "weld", "x y angle",
                         lambda layout, beam, at: section(layout, beam, at)[0])


def symbol_of(joint: Any, layout: Layout, text: str, fixed: str,
              place: Callable[..., Vector]) -> Iterable[Symbol]:
    """The symbol of a hinge or a weld: on the ground a support with its fixed motions."""
    beam, at = next((b, a) for b, a in zip(joint.beams, joint.at) if not is_ground(b))
    if any(map(is_ground, joint.beams)):
        return (support_of(layout, beam, place(layout, beam, at), fixed),)
    return (Symbol("joint", (place(layout, beam, at),), text=text),)


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
        return [Equation((self.r, n), less=n @ x) for n in np.eye(2)
                for x in sample(self.motion, np.array([t]), "r", (2,))]

    def offset(self, times: Array, N: int) -> Array:
        return self.r.start - sample(self.motion, times, "r", (2,))

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = point(layout, self.beam, self.at)
        return (support_of(layout, self.beam, at, "x y"),)


class PrescribedDisplacement(Joint):
    """Degrees of freedom of a place follow a function of time: ``u[dofs] = displacement(t)``."""

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
        return [Equation((self.d, n)) for n in self._normals(np.array([t]))]

    def _normals(self, times: Array) -> Array:
        a = self.start + sample(self.angle, times, "angle", ())
        return np.column_stack([-np.sin(a), np.cos(a)])

    def terms(self, times: Array, N: int) -> tuple[Array, Array]:
        n = self._normals(times)
        return n @ self.d.start[:, None], (n[:, :, None] * self.d.weights).reshape(len(times), -1)

    def offset(self, times: Array, N: int) -> Array:
        return self.terms(times, N)[0]

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        columns = self.d.dofs.ravel()
        return 0 * columns, columns, self.terms(times, N)[1]

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
            epsabs=1e-13, epsrel=1e-13, limit=500)[0])


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
        return [aligned(self.d, self.e, rotation(angle))]

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
        refuse(len(given) != 1, "a motor has an angle, a speed or a torque: give one of them, got "
               "{}", given or 'none')
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
        self.parts = [Equation((Vector(np.zeros(2), first + 2 * k + np.arange(2)[:, None], 1.0),
                              self.direction)) for k in fixed]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = section(layout, self.beam, self.at)[0]
        return (support_of(layout, self.beam, at, "angle"),)
