"""Springs and dashpots, linear or not, foundations and drag."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, cast

import numpy as np
import scipy

from ...beam.distribution import AXIS, Facets, groups_of, surfaces_of
from ...beam.kernels.section import beam_gradients
from ...beam.kinematics import probe_reference
from ...beam import Layout, RigidBody, WhichBeam, on_body, select_beam
from ...core import (Array, InputError, Place, ask_number, gauss, refuse, require_finite_scalar,
                     require_flag, require_function, require_integer, require_not_negative, shown)
from ...mesh.places import points_of_rows
from ..item import Item, on_each
from ..loads import EndMoment
from ..places import GROUND, Vector, both_of, named_place, point, section
from ..symbols import Symbol, faces_of, middle
from .base import ForceElement, KernelElement
from .kernels import (DRAG, FOUNDATION, KINDS, SPRING, TORSION, Kinds, add_bends, coordinates,
                      mean_slopes)

# user-defined laws of springs and dashpots: force of elongation, angle or rate

#: Points by which the work between two states of a step is integrated.
POINTS = 8
#: Relative round-off of a potential.
ROUND_OFF = 1e-13
#: Relative step of the differences that give the slope of a law.
STEP = 1e-6


class Law:
    """A force, or moment, as a function of one number, with its potential.

    ``given`` is the function, or a pair of it and its potential, by default the integral from zero.
    ``name`` and ``of`` are for messages.

    >>> law = Law("k", lambda s: 3.0 * s**2)
    >>> law(2.0), round(law.potential(2.0), 12), round(law.slope(2.0), 6)
    (12.0, 8.0, 12.0)
    """

    def __init__(self, name: str, given: Any, of: str = "elongation") -> None:
        pair = given if isinstance(given, (tuple, list)) else (given,)
        if not 1 <= len(pair) <= 2 or any(isinstance(part, type) for part in pair):
            raise InputError(f"{name} must be a number, a function of the {of}, or a function and "
                             f"its potential, got {shown(given)}")
        what = f"of the {of} that returns a number"
        self.name, self.of = name, of
        self.function: Callable[[float], float] = require_function(name, pair[0], what)
        self.energy: Any = None if len(pair) == 1 else require_function(
            f"the potential of {name}", pair[1], what)

    def __call__(self, s: float) -> float:
        return ask_number(f"{self.name}({self.of} = {{:g}})", self.function, float(s))

    def potential(self, s: float) -> float:
        """Potential at s, by default the integral of the force from zero."""
        if self.energy is not None:
            return ask_number(f"the potential of {self.name} at {{:g}}", self.energy, float(s))
        return float(scipy.integrate.quad(self, 0.0, s, epsabs=0.0, epsrel=1e-12, limit=200)[0])

    def mean(self, a: float, b: float) -> float:
        """Mean force from a to b, whose work is the change of the potential."""
        if a == b:
            return self(a)
        x, w = gauss(POINTS)
        found = float(np.dot(w, [self(a + (b - a) * z) for z in x]))
        if self.energy is not None:
            before, after = self.potential(a), self.potential(b)
            missing = after - before - (b - a) * found
            if abs(missing) > ROUND_OFF * (abs(before) + abs(after)):
                found += missing / (b - a)
        return found

    def slope(self, s: float, scale: float = 1.0) -> float:
        """Derivative at s by differences."""
        d = STEP * max(abs(s), scale)
        return (self(s + d) - self(s - d)) / (2.0 * d)

    def __repr__(self) -> str:
        return f"<{self.name} {shown(self.function)}>"


class Proportional(float):
    """A linear law."""

    def __call__(self, s: float) -> float:
        return self * s

    def potential(self, s: float) -> float:
        return 0.5 * self * s * s

    def mean(self, a: float, b: float) -> float:
        return 0.5 * self * (a + b)

    def slope(self, s: float, scale: float = 1.0) -> float:
        return float(self)

    def __repr__(self) -> str:
        return f"{self:g}"


def number_or_law(name: str, given: Any, of: str) -> Proportional | Law:
    """A non-negative number or a function as a law."""
    if isinstance(given, Law):
        return given
    if callable(given) or isinstance(given, (tuple, list)):
        law = Law(name, given, of)
        if of.endswith("rate") and law(0.0) != 0.0:
            raise InputError(f"{name} is a force of the {of}, and must be 0 where that is 0, got "
                             f"{law(0.0):g}")
        return law
    return Proportional(require_not_negative(name, given))


# rotations of rigid bodies and of sections with moments, with full turns

class Turns:
    """Rotations of sections with moments, then those of rigid bodies. A displacement defines them
    up to full turns. They are tracked over a sequence of displacements with changes of less than
    half a turn."""

    def __init__(self, system: Any) -> None:
        self._system = system
        self._loads = [cast("EndMoment", load) for load in system.loads if load.turning]
        self.moments, self.number = len(self._loads), len(self._loads) + len(system.bodies)
        pack = system.backend.tables.plain.loads.moments
        first = np.array([system.of(body).start for body in system.bodies], dtype=int)
        directions = np.array([body.q0[2:] for body in system.bodies]).reshape(-1, 2)
        self._groups = [(pack.dofs, pack.c, pack.start), (
            first[:, None, None] + [[2], [3]], np.ones((len(first), 1)), directions)]

    def angles(self, u: Array) -> Array:
        """Rotations at displacements (n, N) in (-pi, pi]: (n, k)."""
        found = [np.zeros((len(u), 0))]
        for dofs, c, start in self._groups:
            d = start + np.einsum("nkim,km->nki", u[:, dofs], c)
            found.append(np.arctan2(start[:, 0] * d[..., 1] - start[:, 1] * d[..., 0],
                                    start[:, 0] * d[..., 0] + start[:, 1] * d[..., 1]))
        return np.concatenate(found, axis=1)

    def begin(self, u: Array) -> Array:
        """Rotations at a displacement (N,) without history, shape (k,)."""
        counted = [load.angle(u[self._system.of(load)]) for load in self._loads]
        return np.append(counted, self.angles(u[None])[0, self.moments:])

    def follow(self, last: Array, u: Array) -> Array:
        """Rotations at successive displacements."""
        if not self.number:
            return np.zeros((len(u), 0))
        return np.unwrap(np.vstack([last, self.angles(u)]), axis=0)[1:]


#: Reference rate for the difference step of a dashpot's law.
STILL = 1e-3


def _stiffness(k):
    return f"k = {float(k):.6g}" if isinstance(k, float) else "k(s)"


def end_of(layout: Layout, place: Any) -> Vector:
    """The Vector of a material point or a fixed point."""
    which, at = named_place(layout, place, GROUND)
    return point(layout, which, at)


class ElasticElement(ForceElement):
    """A force ``k(q) + damping(dq / dt)`` against a coordinate q of the kernels, an elongation or
    an angle."""

    k: Proportional | Law
    damping: Proportional | Law
    #: Reference coordinate for the difference step of a law; that at the end of the last step.
    _scale, _last = 1.0, 0.0
    #: Of a bound one.
    _part: KernelElement

    def _alone(self, *places: Array) -> tuple[Any, ...]:
        """The tables of kernels for this element alone, and vectors for places of its links."""
        kinds = Kinds(1, (np.arange(KINDS + 1) > self._part.kind).astype(np.int64), np.array(
            (0.0, 0.0, *self._part.numbers[2:]))[:, None], np.array([self._last]))
        return kinds, *(np.append(x, np.zeros(4 - x.size))[:, None] for x in places)

    def coordinate(self, x: Array) -> tuple[float, Array]:
        """q and its derivative by the links, (n, 2)."""
        kinds, y = self._alone(x)
        return (float(coordinates(kinds, y)[0]),
                mean_slopes(kinds, y, y).reshape(2, 2)[:len(x)])

    def parts(self) -> list[KernelElement] | None:
        return None if isinstance(self.k, Law) or isinstance(self.damping, Law) else [self._part]

    def amount(self, x: Array, v: Array) -> float:
        """Tension or moment."""
        q, g = self.coordinate(x)
        return float(self.k(q) + self.damping(float(np.sum(g * v))))

    def force(self, x: Array, v: Array, t: float) -> Array:
        return -self.amount(x, v) * self.coordinate(x)[1]

    def potential(self, x: Array) -> float:
        return self.k.potential(self.coordinate(x)[0])

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        mean = self.k.mean(self.coordinate(x)[0], self.coordinate(y)[0])
        return -mean * mean_slopes(*self._alone(x, y)).reshape(2, 2)[:len(x)]

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        (q, g), (kinds, y) = self.coordinate(x), self._alone(x)
        D, n = np.zeros((16, 1)), len(x)
        add_bends(kinds, y, np.append(g, np.zeros(4 - g.size))[:, None], np.array([self.k(q)]), D)
        return -self.k.slope(q, self._scale) * np.multiply.outer(g, g) - D.reshape(
            2, 2, 2, 2)[:n, :, :n]

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        g = self.coordinate(x)[1]
        return -self.damping.slope(float(np.sum(g * v)), STILL) * np.multiply.outer(g, g)


class Spring(ElasticElement):
    """A spring between two points, with a parallel dashpot.

    The tension is ``k (l - length) + damping dl / dt`` with the distance l, or
    ``k(l - length) + damping(dl / dt)`` where these are functions.

    Parameters
    ----------
    k
        Stiffness (force per length), zero or positive; or a function of the elongation that returns
        the force, positive in tension; or a pair of such a function and its potential.
    between
        Two places, each (x, y): the material point there, or a fixed point where there is no beam;
        or (beam, (x, y)) with a Beam, a RigidBody, a name or a number; or ("ground", (x, y)).
    damping
        Force per velocity, zero or positive; or a function of the rate that returns the force.
    length
        Free length; that of the reference configuration by default.
    """

    def __init__(self, k: Any, between: Any, damping: Any = 0.0,
                 length: float | None = None) -> None:
        self.k = number_or_law("k", k, "elongation")
        self.damping = number_or_law("damping", damping, "rate")
        self.length = None if length is None else require_not_negative("length", length, False)
        between = points_of_rows(between)
        refuse(not isinstance(between, (tuple, list)) or len(between) != 2, "between must be two "
               "places, as ((1, 0), (1, 0.5)), got {!r}", between)
        self.between = tuple((place, None) if isinstance(place, RigidBody) else place
                             for place in between)

    def bind(self, layout: Layout) -> list[Vector]:
        a, b = (end_of(layout, place) for place in self.between)
        refuse(not a.weights.size and not b.weights.size, "neither end of the spring between {!r} "
               "is a point of a beam or a rigid body: both would be of the ground", self.between)
        link = b - a
        distance = float(np.hypot(*link.start))
        refuse(distance == 0.0 and self.length != 0.0, "the spring between {!r} has length zero, "
               "and so no direction: name two different points, or give length=0 for a spring that "
               "pulls them together", self.between)
        self._scale = distance if self.length is None else self.length
        self._part = KernelElement(SPRING, link, Vector(np.zeros(2)),
                                   (self.k, self.damping, self._scale, 0.0, 0.0))
        return [link]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield Symbol("spring", tuple(end_of(layout, place) for place in self.between),
                     text=_stiffness(self.k))

    def __repr__(self) -> str:
        return f"<Spring {self.k!r} between {shown(self.between)}>"


class TorsionalSpring(ElasticElement):
    """A torsional spring on a section, with a parallel dashpot.

    The moment is ``k (phi - angle) + damping dphi / dt``, phi the rotation from the reference
    configuration relative to the ground or another section; or ``k(phi - angle) + damping(dphi /
    dt)`` where these are functions. At the start phi is taken in (-pi, pi] about ``angle``. Motions
    and runs count whole turns, from steps or increments of less than half a turn.

    Parameters
    ----------
    k
        Moment per angle, zero or positive; or a function of the angle that returns the moment; or
        a pair of such a function and its potential.
    at
        A place that is one section of a beam, or a point on it; or a RigidBody.
    damping
        Moment per angular velocity, zero or positive; or a function of it.
    beam
        Beam, name or number, in a scene of several.
    other
        The other section as (beam, place), or a RigidBody; None for the ground.
    angle
        Free angle, in [-pi, pi].
    """

    def __init__(self, k: Any, at: Place, damping: Any = 0.0, beam: WhichBeam = None,
                 other: Any = None, angle: float = 0.0) -> None:
        self.k = number_or_law("k", k, "angle")
        self.damping = number_or_law("damping", damping, "angular rate")
        self.at, self.beam = on_body(at, beam)
        self.other = None if other is None else both_of("other", other)
        self.angle = require_finite_scalar("angle", angle)
        refuse(abs(self.angle) > np.pi, "angle must lie in [-pi, pi], got {!r}: the angle of a "
               "section is known up to whole turns only. Of a spring wound by more, add the moment "
               "of the turns, 2 pi k each, by scene.moment", self.angle)

    def bind(self, layout: Layout) -> list[Vector]:
        d = section(layout, self.beam, self.at)[1]
        e = Vector(d.start) if self.other is None else section(layout, *self.other)[1]
        x, y = d.start, e.start
        self._start = a = float(np.arctan2(y[0] * x[1] - y[1] * x[0], x @ y)) + self.angle
        self._part = KernelElement(TORSION, d, e, (
            self.k, self.damping, float(np.cos(a)), float(np.sin(a)), 0.0))
        return [d, e]

    @property
    def key(self) -> Array:
        """Numbers that differ for springs on other sections, (n,)."""
        return np.concatenate([np.ravel(x) for one in self.links
                               for x in (one.start, one.dofs, one.weights)])

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield Symbol("torsional spring", (section(layout, self.beam, self.at)[0],),
                     text=_stiffness(self.k))

    def __repr__(self) -> str:
        return f"<TorsionalSpring {self.k!r} at {shown(self.at)}>"


def spring_force(elements: Sequence[ForceElement], which: Any, u: Array, v: Array,
                 base: Array | None = None) -> float:
    """Tension or moment of a bound spring at u and v (N,); linearised about a base (N,)."""
    # It is given by itself, or by its number among the springs and torsional springs.
    springs = [one for one in elements if isinstance(one, ElasticElement)]
    refuse(not springs, "the scene has no springs")
    spring = next((one for one in springs if one is which), None)
    refuse(spring is None and isinstance(which, ElasticElement), "{!r} is not one of "
           "scene.elements: name it by its number among the {} springs of the scene, in the order "
           "they were added", which, len(springs))
    spring = spring or springs[require_integer("the number of a spring", which, 0,
                                               len(springs) - 1)]

    def at(q):
        return np.array([link(q) for link in spring.links])

    x = at(u)
    if base is None or not np.any(at(base)[0]):
        return spring.amount(x, np.array([link(v) - link.start for link in spring.links]))
    start = at(base)
    q, slope = spring.coordinate(start)
    return spring.amount(start, 0.0 * start) + spring.k.slope(q, spring._scale) * float(
        np.sum(slope * (x - start)))


class Foundation(ForceElement):
    """Winkler foundation: springs along the normal of a side in the reference configuration.

    Parameters
    ----------
    k
        Stiffness per area: force per area and displacement, zero or positive.
    side
        A place of the boundary, see :func:`skfem_ancf.mesh.places.facets_of`; for a cable it acts
        on the axis.
    one_sided
        It acts in compression only.
    damping
        Force per area and velocity, zero or positive; in compression only, if it is one-sided.
    beam
        Beam, name or number, in a scene of several.
    """

    distributed = True

    def __init__(self, k: float, side: Place = "bottom", one_sided: bool = False,
                 damping: float = 0.0, beam: WhichBeam = None) -> None:
        self.k = require_not_negative("k", k)
        self.damping = require_not_negative("damping", damping)
        self.side, self.one_sided = side, require_flag("one_sided", one_sided)
        self.beam = beam

    def bind(self, layout: Layout) -> list[Vector]:
        beam, first = select_beam(layout.beams, self.beam), layout.offset(self.beam)
        self._parts, found = list[KernelElement](), surfaces_of(
            beam, self.side, beam.element.facet_points)
        self.along = (beam, *groups_of(beam.mesh, found))
        none, one_sided = Vector(np.zeros(2)), float(self.one_sided)
        for one in found:
            X = one.X if beam.has_sections else np.array([one.X[0], np.full(len(one.X[0]), 0.5)])
            for e, areas, normals in zip(one.elements.tolist(), one.areas,
                                         one.normals.transpose(1, 2, 0)):
                for x, area, normal in zip(X.T, areas, normals):
                    dofs, weights = probe_reference(beam, e, x)
                    self._parts.append(KernelElement(
                        FOUNDATION, Vector(np.zeros(2), dofs + first, weights), none,
                        (self.k * area, self.damping * area, *normal, one_sided)))
        return [part.d for part in self._parts]

    def parts(self) -> list[KernelElement]:
        return self._parts

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        for at, normals, _ in faces_of(layout, layout.beam(self.beam), self.side):
            for k, (place, normal) in enumerate(zip(at, normals)):
                yield Symbol("foundation", (place,), (normal,),
                             text=_stiffness(self.k) if k == len(at) // 2 else "")

    def __repr__(self) -> str:
        return f"<Foundation {self.k:g} at {self.side!r}>"


class Drag(ForceElement):
    """Quadratic drag per length of the axis in a medium at rest.

    ``-density width / 2 (normal |v_n| v_n + tangential |v_t| v_t)`` per length of the reference
    axis, with the velocities across and along the axis. See Taylor: "Analysis of the swimming of
    long and narrow animals", Proceedings of the Royal Society A 214 (1952); Morison, O'Brien,
    Johnson, Schaaf: "The force exerted by surface waves on piles", Petroleum Transactions 189
    (1950).

    Parameters
    ----------
    density
        Mass per volume of the medium, zero or positive.
    normal, tangential
        Drag coefficients, zero or positive.
    beam
        Beam, name or number; None for all.
    """

    distributed = True

    def __init__(self, density: float, normal: float, tangential: float = 0.0,
                 beam: WhichBeam = None) -> None:
        self.density = require_not_negative("density", density)
        self.normal = require_not_negative("normal", normal)
        self.tangential = require_not_negative("tangential", tangential)
        self.beam = beam

    def expand(self, layout: Layout) -> Sequence[Item]:
        return on_each(self, range(len(layout.beams)))

    def bind(self, layout: Layout) -> list[Vector]:
        beam, first = select_beam(layout.beams, self.beam), layout.offset(self.beam)
        mesh, mapping = beam.mesh, beam.mesh.mapping()
        xi, w = gauss(beam.element.axis_degree + 1)
        X = np.array([xi, 0.5 + 0.0 * xi])
        length = np.sqrt(np.sum(mapping.DF(X)[:, 0] ** 2, axis=0))  # of the axis, by xi
        slopes, frame = beam_gradients(mesh, beam.element, X)
        every = np.arange(mesh.nelements)
        self.along = beam, [Facets(AXIS, every, every, xi)], ()
        q = 0.5 * self.density * w * length * beam.across.outline(X)
        self._parts = list[KernelElement]()
        for e in range(mesh.nelements):
            for k, x in enumerate(X.T):
                dofs, weights = probe_reference(beam, e, x)
                self._parts.append(KernelElement(
                    DRAG, Vector(np.zeros(2), dofs + first, weights),
                    Vector(frame[0, e, k], dofs + first, slopes[0, e, k]),
                    (q[e, k] * self.normal, q[e, k] * self.tangential, 0.0, 0.0, 0.0)))
        return [part.d for part in self._parts]

    def parts(self) -> list[KernelElement]:
        return self._parts

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield Symbol("drag", (middle(layout, self.beam),), text="drag")

    def __repr__(self) -> str:
        return f"<Drag {self.normal:g}, {self.tangential:g}>"
