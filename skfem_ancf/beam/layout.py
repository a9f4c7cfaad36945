"""The degrees of freedom of a scene. Its material points and their location in elements: a point is
given by its position (x, y) in the reference configuration, a tuple, a list or an array of two
numbers. Several points are an array (2, n), as in scikit-fem, or a list of points."""

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, TypeAlias, cast

import numpy as np

from ..core import (Array, InputError, MeshError, NameUnknown, cached_property, refuse,
                    require_finite, require_integer, require_point, shown)
from ..mesh.places import as_point
from .beam import Beam
from .domain import Domain, DomainPoints
from .rigid import RigidBody
from .strains import strain_at

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
            refuse(not isinstance(one, (Beam, RigidBody, Domain)), "a scene is made of Beams, "
                   "RigidBodies and Domains, got {!r}", one)
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
    return cast("Beam", select_member(beams, (), beam))


def select_member(beams: Sequence[Beam], bodies: Sequence[RigidBody | Domain],
                  which: WhichMember) -> Beam | RigidBody | Domain:
    """A beam, or a rigid body or domain, numbered after the beams; None for the only one."""
    members: Sequence[Any] = beams if which is None and beams else (*beams, *bodies)
    found: Sequence[Any] = [one for one in members if one is which]
    if which is None:
        found = members if len(members) == 1 else ()
    elif isinstance(which, str):
        found = [one for one in members if one.name == which]
    elif isinstance(which, int) and not isinstance(which, bool) and which >= 0:
        found = members[which:which + 1]
    if found:
        return found[0]
    known = [one.name if one.name is not None else k for k, one in enumerate(members)]
    if bodies and isinstance(which, (RigidBody, Domain)):
        raise NameUnknown("rigid body or domain", which, known[len(beams):])
    refuse(not beams and (which is None or not bodies), "a beam is needed here, and the scene has "
           "none: give one of its members, its name or its number; got {!r}", which)
    refuse(which is None, "the scene has {} beams: choose one with beam=, of {}", len(beams), known)
    refuse(isinstance(which, (RigidBody, Domain)), "a beam is needed here, got {!r}; beams are {}",
           which, known)
    raise NameUnknown("beam", which, known)


def as_points(points: Any) -> Array:
    """Several points as an array (2, n), or one as an array (2,); MeshError for others."""
    if isinstance(points, np.ndarray) and points.ndim == 2:
        if len(points) == 2:
            return require_finite("points", points)
        hint = "; give its transpose, or a list" if points.shape[1] == 2 else ""
        raise MeshError("an array of points has shape (2, n), with x in the first row and y in "
                        f"the second, got {points.shape}{hint}")
    if isinstance(points, (list, tuple)) and len(points) and all(
            isinstance(p, (list, tuple, np.ndarray)) for p in points):
        return np.array([require_point(p) for p in points]).T
    return require_point(points)


class BeamPoints:
    """Points ``X`` (2, n) of the reference cells of elements ``e`` (n,) of one beam. Among the
    requested points they have the numbers ``index`` (n,), None if they are all."""

    def __init__(self, beam: Any, number: int, dofs: slice, index: Array | None,
                 e: Array, X: Array) -> None:
        self.beam, self.number, self.slice, self.index = beam, number, dofs, index
        self.n, self.e, self.X = len(e), e, X
        #: Points of the reference cell in the shape (2, n, 1).
        self.at = X[:, :, None]
        #: A point is off the axis of a cable, where positions are nonlinear.
        self.off_axis = not beam.has_sections and bool((np.abs(X[1] - 0.5) > 1e-12).any())

    @cached_property
    def start(self) -> Array:
        return self.beam.mesh.mapping().F(self.at, self.e)[..., 0]

    @property
    def dofs(self) -> Array:
        """DOFs of the element of each point, (nb, 2, n)."""
        first = self.slice.start + self.beam.mesh.t[0, self.e] * self.beam.nd
        return first + np.arange(2 * self.beam.nd).reshape(-1, 2, 1)

    @cached_property
    def weights(self) -> Array:
        """Shape functions, (nb, n)."""
        return self.beam.element.values(self.beam.mesh.mapping(), self.at, self.e)[..., 0]

    @cached_property
    def slopes(self) -> Array:
        """Derivatives of the shape functions by xi, (nb, n)."""
        return self.beam.element.of_mesh(self.beam.mesh.mapping(), self.at, self.e)[1][..., 0]

    def combine(self, weights: Array, u: Array) -> Array:
        """The sum (..., 2, n) of weighted DOFs (..., N) at each point."""
        if u.ndim == 1:
            return np.asarray((weights[:, None] * u[self.dofs]).sum(axis=0))
        out: Any = 0.0  # without an array of all summands
        for w, d in zip(weights, self.dofs):
            out = out + w * u[..., d]
        return out

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for DOFs ``u`` (..., N) of the scene."""
        moved = self.combine(self.weights, u)
        if not self.off_axis:
            return moved
        before, now = self._tangents(u)
        turn = now / _length(now) - before / _length(before)
        return moved + self._lever * np.stack([-turn[..., 1, :], turn[..., 0, :]], -2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n) for DOFs and their rates, (..., N)."""
        moved = self.combine(self.weights, v)
        if not self.off_axis:
            return moved
        a, rate = self._tangents(u)[1], self.combine(self.slopes, v)
        turn = (a[..., 0, :] * rate[..., 1, :] - a[..., 1, :] * rate[..., 0, :])[..., None, :]
        return moved - self._lever * turn / _length(a) ** 3 * a

    def _tangents(self, u):
        """Derivatives of the axis by xi before and after a displacement, (..., 2, n)."""
        start, q0 = self.slice.start, self.beam.q0_local
        before = sum(w * q0[d - start] for w, d in zip(self.slopes, self.dofs))
        return before, before + self.combine(self.slopes, u)

    @cached_property
    def _lever(self):
        basis, (xi, eta) = self.beam.interpolation, self.X
        return (eta - 0.5) * basis.height * basis.height_at(self.e, xi)

    def strain(self, u: Array, recovery: Any = None) -> Array:
        """Strain (eps_xx, eps_yy, 2 eps_xy), (3, n), recovered if a Recovery is given."""
        if recovery is not None:
            return recovery.at(self.e, self.X, slice(0, 3))
        return strain_at(self.beam, u[self.slice], self.e, self.X)


def _length(a):
    return (a[..., :1, :] ** 2 + a[..., 1:, :] ** 2) ** 0.5


class BodyPoints:
    """Points of a rigid body, with the interface of :class:`BeamPoints`."""

    off_axis = False  # positions are linear in the DOFs

    def __init__(self, body: RigidBody, dofs: slice, index: Array | None,
                 start: Array) -> None:
        self.body, self.slice, self.index, self.start = body, dofs, index, start
        self._frame = body.local(start)

    def displacement(self, u: Array) -> Array:
        x, y, c, s = np.moveaxis(u[..., self.slice, None], -2, 0)
        a, b = self._frame
        return np.stack([x + a * c - b * s, y + a * s + b * c], axis=-2)

    def velocity(self, u: Array, v: Array) -> Array:
        return self.displacement(v)

    @property
    def number(self) -> int:
        """Raises InputError: a rigid body has no fields."""
        raise InputError(f"{self.body!r} has no strain, stress or section forces: use points of "
                         "beams")


class Located:
    """Points of a scene: ``n`` points, or ``one``, in ``parts`` by beam and body."""

    def __init__(self, one: bool, n: int, parts: Sequence[Any]) -> None:
        self.one, self.n, self.parts = one, n, parts

    def gather(self, values: Sequence[Array]) -> Array:
        """Merge arrays (..., n) of the parts; (...) for a single point."""
        if len(self.parts) == 1 and self.parts[0].index is None:
            out = values[0]
        else:
            out = np.empty(values[0].shape[:-1] + (self.n,), np.result_type(*values))
            for part, value in zip(self.parts, values):
                out[..., part.index] = value
        return out[..., 0] if self.one else out

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2), or (..., 2, n) of several, for DOFs (..., N)."""
        return self.gather([part.displacement(u) for part in self.parts])

    def velocity(self, u: Array, v: Array) -> Array:
        return self.gather([part.velocity(u, v) for part in self.parts])

    @cached_property
    def start(self) -> Array:
        return self.gather([part.start for part in self.parts])


class PointLocator:
    """Locates points in beams and bodies; ``lines`` are the line numbers of the chains of a frame.
    """

    def __init__(self, beams: Sequence[Beam], slices: Sequence[slice],
                 bodies: Sequence[RigidBody | Domain] = (), lines: Array | None = None) -> None:
        self.beams, self.slices, self.bodies = list(beams), slices, list(bodies)
        self._lines = lines

    def find(self, points: Any, beam: WhichMember = None, line: int | None = None,
             ask: bool = False) -> Located:
        """Locate one or several points, see :func:`as_points`, or a RigidBody for its centre of
        mass; where beams or lines overlap, in the one with the nearest axis. ``line`` is the number
        of the line of a frame, or of the chain of elements of the beam. With ``ask`` InputError if
        several axes are nearest, as at a node; MeshError if a point is in no beam."""
        if isinstance(points, Located):
            return points
        chain = None
        if line is not None:
            beam, chain = self.chain_of(line, beam)
        if isinstance(points, str):
            beam = select_beam(self.beams, beam)
            points = as_point(points, beam.mesh)
        if self.bodies:
            if isinstance(points, RigidBody):
                points, beam = points.position, points
            if beam is not None or not self.beams and len(self.bodies) == 1:
                body = select_member(self.beams, self.bodies, beam)
                if isinstance(body, (RigidBody, Domain)):
                    if points is None and isinstance(body, RigidBody):
                        points = body.position
                    x = as_points(points)
                    start = x.reshape(2, -1)
                    return Located(x.ndim == 1, start.shape[1],
                                   [self._in_body(body, None, start)])
        if isinstance(points, (int, float)):
            as_points(points)  # raises: x and y were given as two arguments
        if beam is not None:
            beam = select_beam(self.beams, beam)
        elif len(self.beams) == 1 and not self.bodies:
            beam = self.beams[0]
        x = as_points(points)
        one, x = x.ndim == 1, x.reshape(2, -1)
        if beam is None:
            return Located(one, x.shape[1], self._in_all(x, ask))
        e, X, tied = beam.finder.inside(x, chain)
        if ask and np.any(tied):
            self._ask(x[:, [np.argmax(tied)]], [beam])
        k = self.beams.index(beam)
        return Located(one, x.shape[1], [BeamPoints(beam, k, self.slices[k], None, e, X)])

    @cached_property
    def _chains(self):
        """Numbers of the first chain of each beam, and of all chains, (beams + 1,)."""
        return np.cumsum([0] + [int(b.mesh.chains[-1]) + 1 for b in self.beams])

    def chain_of(self, line: int, beam: WhichMember = None) -> tuple[Beam, int]:
        """The beam of a line, and the number of its chain in that beam."""
        if self._lines is None:
            b = select_beam(self.beams, beam)
            return b, require_integer("line", line, 0, int(b.mesh.chains[-1]))
        number = require_integer("line", line, 0)
        at = np.flatnonzero(self._lines == number)
        refuse(not len(at), "the frame has no line {}: lines are numbered 0 to {}, without those "
               "that begin and end at one node", number, np.max(self._lines))
        k = int(np.searchsorted(self._chains, at[0], side="right")) - 1
        refuse(beam is not None and select_beam(self.beams, beam) is not self.beams[k], "line {} "
               "is in the beam {!r}, not in {!r}", number, self.beams[k].name, beam)
        return self.beams[k], int(at[0] - self._chains[k])

    def _ask(self, x, beams):
        """Raise InputError: several axes are nearest to a point, shape (2, 1)."""
        around = []
        for b in beams:
            for chain in range(int(b.mesh.chains[-1]) + 1):
                e, X, outside, _ = b.finder.find(x, chain)
                if outside[0] == 0.0:
                    around.append((float(b.finder.from_axis(e, X)[0]), b, chain))
        least = min(off for off, *_ in around)
        found = [(b, chain) for off, b, chain in around if off <= least + b.finder.equal]
        where = f"the point {shown(tuple(map(float, x[:, 0])))} is equally close to the axes of "
        if self._lines is None and len({id(b) for b, _ in found}) > 1:
            names = [k if b.name is None else b.name
                     for k, b in enumerate(self.beams) if any(b is other for other, _ in found)]
            raise InputError(f"{where}the beams {names}: choose one, as beam={names[0]!r}")
        numbers = sorted(chain if self._lines is None else int(
            self._lines[self._chains[self.beams.index(b)] + chain]) for b, chain in found)
        raise InputError(f"{where}lines {numbers}: choose one, as line={numbers[0]}")

    def _in_body(self, body, index, start):
        kind = DomainPoints if isinstance(body, Domain) else BodyPoints
        dofs = self.slices[len(self.beams) + self.bodies.index(body)]
        return kind(body, dofs, index, start)

    def _in_all(self, x, ask):
        """Points (2, n), each in the beam with the nearest axis, or in a body."""
        which, least = np.full(x.shape[1], -1), np.full(x.shape[1], np.inf)
        elements, cells = np.zeros(x.shape[1], dtype=int), np.zeros(x.shape)
        several, parts = np.zeros(x.shape[1], dtype=bool), list[Any]()
        for k, candidate in enumerate(self.beams):
            finder = candidate.finder
            low, high = finder.box
            near = np.flatnonzero(((low <= x) & (x <= high)).all(axis=0))
            if not len(near):
                continue
            e, X, outside, tied = finder.find(x[:, near])
            on = outside <= finder.allowed
            near, e, X, tied = near[on], e[on], X[:, on], tied[on]
            off, before = finder.from_axis(e, X), least[near]
            nearer, farther = off < before - finder.equal, off > before + finder.equal
            several[near] = np.where(nearer, tied, several[near] | ~farther)
            near, e, X, off = near[nearer], e[nearer], X[:, nearer], off[nearer]
            which[near], least[near], elements[near], cells[:, near] = k, off, e, X
        if ask and np.any(several):
            self._ask(x[:, [np.argmax(several)]], self.beams)
        for k in np.unique(which[which >= 0]):
            at = np.flatnonzero(which == k)
            parts.append(BeamPoints(self.beams[k], int(k), self.slices[k], at, elements[at],
                              cells[:, at]))
        if not x.size:
            parts.append(BeamPoints(self.beams[0], 0, self.slices[0], which, elements, cells))
        left = np.flatnonzero(which < 0)
        for body in self.bodies:
            on = body.contains(x[:, left])
            if np.any(on):
                parts.append(self._in_body(body, left[on], x[:, left[on]]))
                left = left[~on]
        if len(left):
            where = "; ".join(f"{k if b.name is None else repr(b.name)}: {b.finder.extent}"
                              for k, b in list(enumerate(self.beams))[:4])
            more = f" ({len(left)} of {x.shape[1]} points are)" * (x.shape[1] > 1)
            raise MeshError(f"the point {tuple(x[:, left[0]].tolist())} is in none of the "
                            f"{len(self.beams)} beams{more}; {where}")
        if len(parts) == 1:
            parts[0].index = None
        return parts


def require_body(system: Any, which: WhichMember) -> RigidBody:
    """A rigid body of a System by object, name or number; InputError for a beam."""
    body = None if which is None else select_member(system.beams, system.bodies, which)
    if not isinstance(body, RigidBody):
        raise InputError(f"a rigid body is needed here, got {shown(which)}; those of the scene "
                         f"are {system.bodies}")
    return body
