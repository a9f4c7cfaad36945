"""The force and the moment in the sections of a beam, from the internal forces of its elements.

The internal force of an element does no work in a rigid motion. With the loads that act on the
element it is therefore in exact equilibrium, whatever the error of the displacement, and the part
of the element between a node and a section gives the force and the moment there.
"""

from __future__ import annotations

from copy import copy
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import AncfError
from ..formulations.ecm import AXIS as WHOLE
from ..core.kept import cached_property, kept
from ..beam.kernels.base import apart
from ..mesh.mapping import cross
from ..core.quadrature import gauss, lagrange
from ..sections.jumps import beside, jumps
from ..beam.distribution import AXIS, BODY, SNAP, station_of_node

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..beam.beam import Beam
    from ..mesh.mapping import MappingBeam
    from ..sections import Slab
    from ..beam.distribution import Sampled
    from ..core.types import Array

#: Points along an element for its loads.
ALONG = 8

#: Points of sections up to which their tables are kept.
SMALL = 4096

#: A section force that changes at a node without a load by more than this part of its largest
#: value: the state is no equilibrium. In a motion more is let pass: schemes that conserve energy
#: hold the equation of motion in the mean over a step only, and the mean of both sides is right.
UNBALANCED, UNBALANCED_MOTION = 0.02, 0.5

#: Strains below this times the coordinates over the length of an element are round-off.
UNLOADED = 16 * np.finfo(float).eps
#: Section forces below this part of those that stress-free strains have alone are round-off.
BALANCED = 1e-4


class NotRecovered(AncfError):
    """The section forces or fields of a beam cannot be recovered; the message says why.

    Parameters
    ----------
    message
        Why.
    which
        Of several states those of which it is true, shape (states,); None for all.
    """

    def __init__(self, message: str, which: Array | None = None) -> None:
        super().__init__(message)
        self.which = which


class Sections:
    """Geometry and loads at points across given sections.

    Parameters
    ----------
    forces
        The :class:`SectionForces` they belong to.
    e, xi
        Element of each section and its place there, shapes (n,).
    eta
        Points across each section, shape (k,) or (n, k).
    lifted
        Of a cable: points off its axis are at ``r + Y r_X``, the latter turned by 90 degrees, as
        its :class:`~skfem_ancf.beam.inertia.Inertia` has them. If not, all are on the axis.
    slab
        The slab of which all points are; None for those that are there.
    mapping
        From the reference cell to the body; None for that of the mesh.
    """

    def __init__(self, forces: SectionForces, e: Array, xi: Array, eta: Array,
                 lifted: bool = False, slab: Slab | None = None,
                 mapping: MappingBeam | None = None) -> None:
        self.forces, self.e, self._slab = forces, e, slab
        beam = forces.beam
        self.shape = len(e), eta.shape[-1]
        self._xi = xi
        name = "places" if mapping is None else "places by each element"
        self.X, self.J = self._kept(name, eta, lambda: self._places(
            xi, eta, mapping or beam.mesh.mapping()))
        self.volume = self.J[0, 0] * self.J[1, 1] - self.J[0, 1] * self.J[1, 0]
        self._arm: Any = 0.0
        if lifted:
            axis = Sections(forces, e, xi, np.array([0.5]))
            self._arm = beam.mesh.mapping().offset(self.X, e) / np.hypot(*axis.J[:, 0])

    def _kept(self, name, eta, make):
        """Tables of places, made once for few of them."""
        e = self.e
        if self.shape[0] * self.shape[1] > SMALL:
            return make()
        return kept(self.forces.beam.tables, (name, e.tobytes(), self._xi.tobytes(),
                                              eta.tobytes()), make)

    def _places(self, xi, eta, mapping):
        """Reference points, and the derivative of the map."""
        X = np.array([np.broadcast_to(xi[:, None], self.shape), np.broadcast_to(eta, self.shape)])
        return X, mapping.DF(X, self.e)

    @property
    def full_volume(self) -> Array:
        """Of bodies that weigh what their height says, see :meth:`.MappingBeam.full_volume`."""
        mesh = self.forces.beam.mesh
        return self.volume if mesh.is_straight else mesh.mapping().full_volume(self.X, self.e)

    @cached_property
    def _functions(self):
        """Local functions and their slopes."""
        def make():
            mesh = self.forces.beam.mesh
            value, slope, _, powers = self.forces.beam.element.of_mesh(
                mesh.mapping(), self.X, self.e)
            scale = (mesh.lengths[self.e][:, None] ** powers).T[:, :, None]
            return value * scale, slope * scale

        return self._kept("functions", self.X[1], make)

    def field(self, q_e: Array, slope: bool = False) -> Array:
        """A field of element coordinates, or its derivative by xi.

        Parameters
        ----------
        q_e
            Coordinates of the elements, shape (ne, nb, 2), of several states (states, ne, nb, 2).
        slope
            The derivative.

        Returns
        -------
        ndarray
            Shape (2, n, k), or (2, states, n, k).
        """
        def of(functions):
            return np.einsum("bnk,...nbi->i...nk", functions, q_e[..., self.e, :, :],
                             optimize=True)

        if slope or not np.any(self._arm):
            return of(self._functions[1 if slope else 0])
        r_xi = of(self._functions[1])
        return of(self._functions[0]) + self._arm * np.array([-r_xi[1], r_xi[0]])

    def spread(self, values: Array) -> Array:
        """Element vectors (..., ne, nb, 2) of forces (2, ..., n, k), summed."""
        parts = np.einsum("bnk,i...nk->n...bi", self._functions[0], values, optimize=True)
        if np.any(self._arm):
            turned = self._arm * np.array([values[1], -values[0]])
            parts = parts + np.einsum("bnk,i...nk->n...bi", self._functions[1], turned,
                                      optimize=True)
        out = np.zeros((self.forces.beam.mesh.nelements,) + parts.shape[1:], parts.dtype)
        np.add.at(out, self.e, parts)
        return np.moveaxis(out, 0, -3)

    @cached_property
    def body(self) -> Array:
        """Force per volume of the stress-free body, inertia included, (2, ..., n, k)."""
        f = self.forces
        body, gravity = (np.moveaxis(x, -1, 0)[..., None, None] for x in f.spread)
        out = np.broadcast_to(body, (2,) + f.states + self.shape) + self.sampled(BODY)
        if f.acceleration is not None:
            gravity = gravity - self.field(f.acceleration)
        return out + self.density * gravity if np.any(gravity) else out

    @cached_property
    def density(self) -> Array:
        """Mass per volume, (n, k)."""
        across = self.forces.beam.across
        if self._slab is not None:
            return across.density(self._slab, self.X, self.e)
        zero, X = np.zeros(self.shape), beside(self.X)
        return across.of_slabs(X, zero, [
            partial(across.density, slab, X, self.e) for slab in across.slabs], self.e,
            graded=False) + zero

    def sampled(self, where: int) -> Any:
        """The sum of :class:`~skfem_ancf.beam.distribution.Sampled` densities there, (2, ..., n,
        k); or 0."""
        xi, eta = self.X[0, :, 0], self.X[1]
        return sum(s.at(self.e, xi, eta, self.forces.beam.mesh.nelements)
                   .reshape((2,) + self.forces.states + (len(xi), -1))
                   for s in self.forces.sampled if s.where == where)

    def face(self, side: int) -> Array:
        """Force per width and xi on the bottom (0) or top (1), where the points are.

        Shape (2, ..., n, k).
        """
        f = self.forces
        out = np.zeros((2,) + f.states + self.shape, f.q.dtype)
        if any(s.where == side for s in f.sampled):
            out += self.sampled(side) / f.beam.across.face(side, self.X, self.e)
        for factor, load in f.faces:
            on = np.multiply.outer(factor, load.faces[side][self.e])[..., None]
            if not np.any(on):
                continue
            if load.pressure is not None:
                r = self.field(f.q, slope=True)
                out += on * load.pressure * (1.0 - 2.0 * side) * np.array([-r[1], r[0]])
            else:
                t = load.traction
                if callable(t):
                    t = _traction(f.beam, t, beside(self.X), self.e)
                else:
                    t = np.asarray(t, dtype=float)[:, None, None]
                out += on * (t * np.hypot(*self.J[:, 0])).reshape(
                    (2,) + (1,) * len(f.states) + (len(self.e), -1))
        return out


def _traction(beam, traction, X, e):
    """What a function of places returns at points of the stress-free body, (2, n, k)."""
    return np.array([np.broadcast_to(c, X.shape[1:])
                     for c in traction(beam.mesh.mapping().F(X, e))])


class SectionForces:
    """Force and moment in the sections of one beam, in one state or in several at once.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    u
        Displacement of its coordinates, shape (N,), or (states, N): then arrays have the axis of
        the states before those of places. Of linear solutions a
        :func:`~skfem_ancf.core.linear.step` from the stress-free state, as are the factors of
        loads; then all that is found is one.
    loads
        Pairs of a factor and a :class:`~skfem_ancf.beam.distribution.Spread`, or None for a load
        whose spread is not known. The factor of several states has shape (states,).
    stations
        Where supports and joints act: element + xi.
    acceleration
        Of the coordinates, shape (N,) or (states, N), or None.
    sampled
        Densities of force besides, :class:`~skfem_ancf.beam.distribution.Sampled`.
    viscous
        Forces of elements that resist the rate of the strain, shape (ne, nb, 2) or
        (states, ne, nb, 2), or None.

    Attributes
    ----------
    cuts
        Stations, ends included, between which the section force is continuous.

    Raises
    ------
    NotRecovered
        If the spread of a load is not known, or the state is no equilibrium.
    """

    def __init__(self, beam: Beam, u: Array, loads: Sequence[tuple[Any, Any]],
                 stations: Sequence[float] = (), acceleration: Array | None = None,
                 sampled: Sequence[Sampled] = (), viscous: Array | None = None) -> None:
        self.beam = beam
        if any(load is None for _, load in loads):
            raise NotRecovered("a load is given by its force on the coordinates only: where it "
                               "acts across the section is not known")
        self.states, self.small = u.shape[:-1], np.iscomplexobj(u)
        self.lifted = not (beam.has_sections or beam.across.simple)
        gather = beam.kernel.gather
        self.q = _each(gather, beam.q0_local + u)
        self.acceleration = None if acceleration is None else _each(gather, acceleration)
        #: Force per volume and per mass, (..., 2) each.
        self.spread = [sum((np.multiply.outer(factor, np.asarray(getattr(load, name)))
                            for factor, load in loads if getattr(load, name) is not None),
                           np.zeros(self.states + (2,))) for name in ("body", "gravity")]
        self.faces = [(factor, load) for factor, load in loads if load.faces is not None
                      and np.any(factor) and np.any(load.faces)]
        self.sampled = [*sampled, *(s.times(factor) for factor, load in loads
                                    for s in load.sampled)]
        self.viscous = viscous
        self.eigen = [(factor, load.eigen) for factor, load in loads if load.eigen is not None]
        self._loads(u)
        self._cut(loads, stations)
        self._check()

    # loads of the elements

    def _loads(self, u):
        """Section forces at both ends of each element, and the loads at points along it."""
        beam, mesh = self.beam, self.beam.mesh
        ne, (x, w) = mesh.nelements, gauss(ALONG)
        e, xi = np.repeat(np.arange(ne), ALONG), np.tile(x, ne)
        parts = []
        for slab, (eta, v) in beam.across.rules(max(beam.element.order, 1) + 1, inertia=True):
            whole = not (beam.has_sections or self.lifted)
            if whole:
                eta, v = WHOLE
            inside = Sections(self, e, xi, eta, self.lifted, slab)
            body = inside.body
            if np.any(body):
                size = beam.across.breadth(slab, inside.X, e, whole) * v * inside.full_volume
                parts.append((inside, size * body))
        for side in (0, 1):
            if any(np.any(load.faces[side]) for _, load in self.faces) or any(
                    s.where == side for s in self.sampled):
                face = Sections(self, e, xi, np.array([float(side)]))
                parts.append((face, beam.across.face(side, face.X, e) * face.face(side)))
        middle = Sections(self, e, xi, np.array([0.5]))
        axis = middle.field(self.q)
        if any(s.where == AXIS for s in self.sampled):
            parts.append((middle, middle.sampled(AXIS)))
        none = np.zeros(axis.shape[:-1])
        force = sum((f.sum(axis=-1) for _, f in parts), none)
        moment = sum((cross(at.field(self.q) - axis, f).sum(axis=-1) for at, f in parts), none[0])
        self._r, self._force, self._moment = (
            x.reshape(x.shape[:-1] + (ne, ALONG)) for x in (axis[..., 0], force, moment))
        w = np.tile(w, ne)
        load: Any = sum(at.spread(f * w[:, None]) for at, f in parts)
        internal = _each(beam.kernel.small_forces if self.small else beam.kernel.forces, u)
        if self.viscous is not None:
            internal = internal + self.viscous
        q = np.split(self.q, 2, axis=-2)
        #: Size of force times height and moment that stress-free strains have alone.
        self._pushed = np.zeros(self.states)
        for factor, eigen in self.eigen:
            if self.small:
                pushed = np.multiply.outer(factor, eigen.small_forces())
            else:
                pushed = eigen.element_forces(u, factor) if u.ndim == 1 else np.array(
                    [eigen.element_forces(x, f) for x, f in zip(u, factor)])
            internal = internal - pushed
            self._pushed = self._pushed + self._size(*_at_ends(q, pushed))
        # of the part of the beam on the right of a section on that on its left
        self.R, self.M = _at_ends(q, internal - load)
        self.ends = np.array([q[0][..., 0, :], q[1][..., 0, :]])

    def _size(self, R, M):
        """The largest force times the height, and moment, of each state."""
        return (np.max(np.abs(R), axis=(0, -2, -1)) * self.beam.mesh.height
                + np.max(np.abs(M), axis=(0, -1)))

    def _round_off(self):
        """What :meth:`_size` is of a beam without load: that of the strains times the stiffness."""
        beam = self.beam
        places = self.q.imag if self.small else self.q
        strain = UNLOADED * np.max(np.abs(places[..., 0, :]), axis=(-2, -1)) / np.min(
            beam.mesh.lengths)
        return strain * (beam.kernel.scale / beam.mesh.lengths.sum() * beam.mesh.height)

    def viscous_middles(self) -> tuple[Array, Array]:
        """The part of force and moment that resists the rate of the strain, in the middle of
        elements, where it is most accurate: shapes (2, ..., ne) and (..., ne).
        """
        left, _ = np.split(np.asarray(self.viscous), 2, axis=-2)
        q, _ = np.split(self.q, 2, axis=-2)
        ne = self.beam.mesh.nelements
        r = Sections(self, np.arange(ne), np.full(ne, 0.5), np.array([0.5])).field(self.q)[..., 0]
        R = -np.moveaxis(left[..., 0, :], -1, 0)
        return R, cross(np.moveaxis(q[..., 0, :], -1, 0) - r, R) - _moments(q, left)

    def of(self, k: int) -> SectionForces:
        """Those of one of several states, of which force and moment can be asked.

        Parameters
        ----------
        k
            Its number.
        """
        one = copy(self)
        one.states, one.q = (), self.q[k]
        for name in ("R", "M", "ends", "_force", "_r"):
            setattr(one, name, getattr(self, name)[:, k])
        one._moment = self._moment[k]
        return one

    def at(self, e: Array, xi: Array, side: Array) -> tuple[Array, Array]:
        """Force and moment about the axis of the right part of the beam on the left.

        Parameters
        ----------
        e, xi
            Sections, shapes (n,).
        side
            End of the element from which the equilibrium is followed: 0, 1, or 0.5 for the mean
            of both; shape (n,).

        Returns
        -------
        force, moment
            Shapes (2, ..., n) and (..., n).
        """
        x, w = gauss(ALONG)
        inner = lagrange(x, np.outer(xi, x).ravel()).reshape(len(xi), ALONG, ALONG)
        till = xi[:, None] * np.einsum("q,nqk->nk", w, inner)  # the integral from 0 to xi
        r = Sections(self, e, xi, np.array([0.5])).field(self.q)[..., 0]
        out = []
        for end, weights in ((0, till), (1, till - w)):
            f, m = self._force[..., e, :], self._moment[..., e, :]
            arm = self._r[..., e, :] - r[..., None]
            R, at = (np.moveaxis(x[end][..., e, :], -1, 0) for x in (self.R, self.ends))
            M = (self.M[end][..., e] + cross(at - r, R)
                 - np.sum(weights * (cross(arm, f) + m), axis=-1))
            R = R - np.sum(weights * f, axis=-1)
            out.append((R, M))
        (R0, M0), (R1, M1) = out
        return R0 + side * (R1 - R0), M0 + side * (M1 - M0)

    # where they jump

    def _cut(self, loads, stations):
        mesh = self.beam.mesh
        stations = list(stations) + [s for _, load in loads for s in load.stations]
        self._acted = self._at_nodes(stations)
        ends = np.setdiff1d(mesh.t[0], mesh.t[1]), np.setdiff1d(mesh.t[1], mesh.t[0])
        stations += [station_of_node(mesh, k) for k in np.concatenate(ends)]
        gaps = np.nonzero(mesh.t[1, :-1] != mesh.t[0, 1:])[0] + 1.0
        for _, load in self.faces:
            for side, face in enumerate(load.faces):
                stations += list(np.nonzero(face[1:] != face[:-1])[0] + 1.0)
                if callable(load.traction) and np.any(face):
                    stations += list(jumps(partial(_traction, self.beam, load.traction),
                                           mesh.nelements, np.array([float(side)])))
        for s in self.sampled:
            stations += [*s.changes(mesh.nelements), *s.jumps(mesh.nelements)]
        stations += list(self.beam.across.jumps)
        for _, eigen in self.eigen:
            stations += list(jumps(eigen.strain_at, mesh.nelements, np.linspace(0.0, 1.0, 5)))
        cuts = np.concatenate([stations, gaps, [0.0, mesh.nelements]])
        self.cuts = np.unique(self._at_nodes(cuts))
        for station in self._acted[self._acted % 1.0 != 0]:
            self._pass_on(int(station))

    def _pass_on(self, e):
        """The section forces at the ends of an element with a point load, from its neighbours.

        Its own internal force is in equilibrium with the load that its nodes take over.
        """
        t = self.beam.mesh.t
        for end, other in ((0, e - 1), (1, e + 1)):
            if e + end in self._acted or np.any(np.floor(
                    self._acted[self._acted % 1.0 != 0]) == other):
                raise NotRecovered("a load or joint at a point inside of an element acts next to "
                                   "another one, or to a support: put a node at the point")
            near = 0 <= other < t.shape[1] and t[end, e] == t[1 - end, other]
            self.R[end][..., e, :] = self.R[1 - end][..., other, :] if near else 0.0
            self.M[end][..., e] = self.M[1 - end][..., other] if near else 0.0

    @staticmethod
    def _at_nodes(stations):
        """Stations, those near a node put at it."""
        stations = np.asarray(stations, dtype=float)
        near = np.round(stations)
        return np.where(np.abs(stations - near) < SNAP, near, stations)

    def _check(self):
        """The section force is continuous, and zero at ends, where nothing acts at a node."""
        mesh = self.beam.mesh
        n = mesh.p.shape[1]
        R = np.zeros(self.states + (n, 2), self.R.dtype)
        M = np.zeros(self.states + (n,), self.M.dtype)
        R[..., mesh.t[1], :], M[..., mesh.t[1]] = self.R[1], self.M[1]
        R[..., mesh.t[0], :] -= self.R[0]
        M[..., mesh.t[0]] -= self.M[0]
        size = np.maximum(self._size(self.R, self.M), BALANCED * self._pushed)
        unloaded = size <= self._round_off()
        if np.any(unloaded):
            raise NotRecovered("the beam carries no load", unloaded)
        place = np.zeros(n)
        place[mesh.t[0]], place[mesh.t[1]] = np.arange(mesh.nelements), 1.0 + np.arange(
            mesh.nelements)
        jump = (np.abs(R).max(axis=-1) * mesh.height + np.abs(M)) / size[..., None]
        jump[..., np.isin(place, self._acted)] = 0.0
        unbalanced = np.max(jump, axis=-1) > (
            UNBALANCED if self.acceleration is None else UNBALANCED_MOTION)
        if np.any(unbalanced):
            k = np.unravel_index(np.argmax(jump), jump.shape)
            raise NotRecovered(
                "the state is no equilibrium under the loads of the scene: at node "
                f"{k[-1]} the section force changes by {jump[k]:.1%} of its largest value",
                unbalanced)


def _each(function, u):
    """A function of a vector (N,), of one state or of each of several (states, N)."""
    return function(u) if u.ndim == 1 else np.array([function(x) for x in u])


def _at_ends(q, force):
    """Forces (2 ends, ..., ne, 2) and moments (2 ends, ..., ne) of element vectors, as sections
    have them; q: coordinates of the left and the right nodes, (..., ne, nb, 2).
    """
    left, right = np.split(force, 2, axis=-2)
    return (np.array([-left[..., 0, :], right[..., 0, :]]),
            np.array([-_moments(q[0], left), _moments(q[1], right)]))


def _moments(q, force):
    """Moments (..., ne) of element vectors on the coordinates but r, (..., ne, nb, 2) both."""
    q, force = (np.moveaxis(x[..., 1:, :], -1, 0) for x in (q, force))
    return np.sum(cross(q, force), axis=-1)


def viscous_forces(beam: Beam, u: Array, v: Array, time: float) -> Array:
    """Forces of the elements of a beam that resist the rate of the strain, shape (ne, nb, 2).

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    u, v
        Displacement of its coordinates and its rate, shape (N,).
    time
        The retardation time.
    """
    kernel = beam.kernel
    u, v = kernel.gather(u).ravel(), kernel.gather(v).ravel()
    out = np.zeros(u.size)
    for pack in kernel.viscous_packs(time):
        kernel.texts.viscous(apart(pack, slice(None)), u, v, out)
    return out.reshape(beam.mesh.nelements, -1, 2)
