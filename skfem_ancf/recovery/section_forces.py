"""Section forces of a beam from the internal forces of its elements. The internal force of an
element does no work in a rigid motion. With the loads on the element it is therefore in exact
equilibrium, whatever the error of the displacement. Equilibrium of the part of the element between
a node and a section gives the section force and moment."""

from collections.abc import Sequence
from functools import lru_cache, partial
from inspect import ismethod
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebint, chebvander

from ..beam import AXIS, BODY, SNAP, Beam, Sampled, station_of_node
from ..core import AncfError, Array, cached_property, gauss, lagrange
from ..mesh.mapping import MappingBeam, cross
from ..sections.across import EDGE, off_ends, jumps, pieces

#: Quadrature points along an element for its loads.
ALONG = 8

#: Largest relative jump of the section force at an unloaded node, and in a motion: conserving
#: schemes satisfy the equation of motion on average over a step.
UNBALANCED, UNBALANCED_MOTION = 0.02, 0.5

#: Strain that is round-off, relative to position over element length.
UNLOADED = 16 * np.finfo(float).eps
#: Section force that is round-off, relative to that of the eigenstrains alone.
BALANCED = 1e-4


#: Least points of the only interval of a section; additional points (to the order N) and least
#: points of one of several; points of an interval of variable width.
ACROSS, MORE, FEW, ROUND = 7, 2, 5, 17


class NotRecovered(AncfError):
    """Section forces or fields cannot be recovered; the message says why."""

    failed = False

    @property
    def why(self) -> str:
        return str(self)


class NotFound(NotRecovered):
    """An iteration of the recovery failed, mostly because of too large a strain."""

    failed = True


# the axis, and points across sections

class ArcLength:
    """Arc length along the reference axis; ``nodes`` (ne + 1,) at ends of elements."""

    def __init__(self, beam: Beam) -> None:
        self._inside, lengths, (x, w) = None, beam.mesh.lengths, gauss(ALONG)
        if not beam.mesh.is_straight:
            speed = np.hypot(*beam.mesh.mapping().DF(np.array([x, 0.5 + 0.0 * x]))[:, 0])
            series = np.linalg.solve(chebvander(2.0 * x - 1.0, ALONG - 1), speed.T)
            self._inside, lengths = chebint(series, lbnd=-1.0, scl=0.5).T, speed @ w
        self.nodes = np.append(0.0, np.cumsum(lengths))

    def at(self, e: Array, xi: Array) -> Array:
        """Arc length at xi of elements e, both of shape (n,)."""
        return self.nodes[e] + (
            xi * (self.nodes[e + 1] - self.nodes[e]) if self._inside is None else
            (chebvander(2.0 * xi - 1.0, ALONG) * self._inside[e]).sum(axis=-1))


class Interval(NamedTuple):
    """Part of a section, ``low`` to ``high`` (eta), with fields polynomial in s in [0, 1]. If
    ``curved``, ``eta = middle - half cos(pi s)``, which smooths square roots of the width at the
    ends."""

    low: float
    high: float
    curved: bool
    nodes: Array  # s
    eta: Array
    inverse: Array  # (n, n) from values at the nodes to coefficients of Chebyshev polynomials

    def local(self, eta: Array) -> Array:
        s = (eta - self.low) / (self.high - self.low)
        return np.arccos(np.clip(1.0 - 2.0 * s, -1.0, 1.0)) / np.pi if self.curved else s

    def weights(self, s: Array) -> Array:
        """Interpolation weights from the nodes to points s (...), shape (..., n)."""
        return chebvander(2.0 * s - 1.0, len(self.nodes) - 1) @ self.inverse


class AcrossPoints(NamedTuple):
    """Points across sections: arrays (n, m), or (m,) if all sections are equal."""

    eta: Array
    stretch: Any  # relative length of their interval
    drift: Any  # derivative of eta by the height
    swell: Any  # that of log(stretch)
    axis: Array  # weights for the value on the axis
    till_axis: Array  # and for the integral from the bottom to the axis


class Intervals:
    """Points ``eta`` (m,) across a section of layers, the highest one, with weights of integrals
    and values; ``layers`` are columns, ``width`` (m,) is relative."""

    def __init__(self, measures: Sequence[Any], order: int) -> None:
        self._measures = measures
        pieces = [(piece, m.mean) for m in self._measures for piece in m.pieces]
        self._intervals = []
        for (low, high, b), _ in pieces:
            curved = callable(b)
            if len(pieces) > 1 or curved:
                n = ROUND if curved else max(FEW, order + MORE)
                nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)
            else:  # with the ends
                n = max(ACROSS, 2 * order + 1)
                nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, n))
                nodes[n // 2] = 0.5
            s = 0.5 - 0.5 * np.cos(np.pi * nodes) if curved else nodes
            self._intervals.append(Interval(low, high, curved, nodes, low + (high - low) * s,
                                            np.linalg.inv(chebvander(2.0 * nodes - 1.0, n - 1))))
        ends = np.cumsum([0] + [len(i.nodes) for i in self._intervals])
        self._columns = [slice(a, b) for a, b in pairwise(ends.tolist())]
        counts = np.cumsum([0] + [len(m.pieces) for m in self._measures])
        self.layers = [slice(ends[a], ends[b]) for a, b in pairwise(counts)]
        self.eta = np.concatenate([i.eta for i in self._intervals])
        self.width = np.concatenate([
            (b(i.eta) if callable(b) else b) / mean + 0.0 * i.eta
            for i, ((_, _, b), mean) in zip(self._intervals, pieces)])
        self._low, self._high = np.array([(i.low, i.high) for i in self._intervals]).T
        self.moves = self._measures[0].moves
        faces = np.array([self._low[0], self._high[-1]])
        self.from_bottom, (_, self.whole) = self._integrals(self.eta), self._integrals(faces)
        middle = np.array([0.5])
        self._fixed = AcrossPoints(self.eta, 1.0, 0.0, 0.0, self.weights(middle)[0],
                                   self._integrals(middle)[0])
        self.bottom, self.top = self.weights(faces)

    def _which(self, eta):
        """The interval of each point; the upper one at an interface."""
        return np.searchsorted(self._high[:-1] - EDGE, eta, side="right")

    def weights(self, eta: Array) -> Array:
        """Weights (k, m) of the values at points eta (k,)."""
        which, out = self._which(eta), np.zeros((len(eta), len(self.eta)))
        for k in np.unique(which):
            i, on = self._intervals[k], np.flatnonzero(which == k)
            out[on, self._columns[k]] = i.weights(i.local(eta[on]))
        return out

    def _integrals(self, eta):
        """Weights (k, m) of the integrals from the bottom to eta."""
        which, out = self._which(eta), np.zeros((len(eta), len(self.eta)))
        for k, (i, columns) in enumerate(zip(self._intervals, self._columns)):
            end = np.where(which > k, 1.0, i.local(np.clip(eta, i.low, i.high)))[:, None]
            x, w = gauss(len(i.nodes) * (2 if i.curved else 1))
            s = end * x
            w = end * w * (0.5 * np.pi * np.sin(np.pi * s) if i.curved else 1.0 + 0.0 * s)
            out[:, columns] = np.where(which[:, None] < k, 0.0, (i.high - i.low) * (
                w[:, None] @ i.weights(s))[:, 0])
        return out

    def _ends_at(self, h):
        """Lower and upper ends of the intervals at heights (n,), shape (nintervals, n) both."""
        ends = [m.ends(h) for m in self._measures]
        return (np.concatenate([e[:-1] for e in ends]), np.concatenate([e[1:] for e in ends]))

    def points(self, h: Array) -> AcrossPoints:
        """The points of sections of heights h (n,)."""
        if not self.moves:
            return self._fixed
        of = np.repeat(np.arange(len(self._low)), [len(i.nodes) for i in self._intervals])
        size = (self._high - self._low)[of]
        z = (self.eta - self._low[of]) / size
        (low, high), (low2, high2) = ((end[of].T for end in self._ends_at(k * h))
                                      for k in (1.0, 2.0))
        # ends are a + b / h: their derivative is 2 (end(2 h) - end(h)) / h
        low_rate, high_rate = (2.0 * (b - a) / h[:, None] for a, b in ((low, low2), (high, high2)))
        at = self.place(0.5 + 0.0 * h, h)
        return AcrossPoints(
            low + (high - low) * z, (high - low) / size, low_rate + (high_rate - low_rate) * z,
            (high_rate - low_rate) / (high - low), self.weights(at), self._integrals(at))

    def place(self, eta: Array, h: Array) -> Array:
        """Map eta (n,) in sections of heights h (n,) to the highest section."""
        if not self.moves:
            return eta
        low, high = self._ends_at(h)
        which = np.sum(eta >= high[:-1], axis=0)
        low, high = (np.take_along_axis(x, which[None], 0)[0] for x in (low, high))
        starts, ends = self._low[which], self._high[which]
        return starts + (ends - starts) * (eta - low) / (high - low)


intervals_of = lru_cache(32)(Intervals)


class Sections:
    """Points ``eta`` across sections at ``xi`` (n,) of elements ``e`` (n,), with shape functions.
    With ``lifted``, points of a cable off its axis are at ``r + Y r_X`` turned by 90 degrees, as in
    :class:`~skfem_ancf.beam.masses.Masses`; otherwise all are on the axis."""

    def __init__(self, beam: Beam, e: Array, xi: Array, eta: Any = 0.5,
                 lifted: bool = False, mapping: MappingBeam | None = None) -> None:
        self.beam, self.e, eta = beam, e, np.atleast_1d(eta)
        self.X = np.empty((2, len(e), eta.shape[-1]))
        self.X[0], self.X[1] = xi[:, None], eta
        self._mapping = mapping or beam.mesh.mapping()
        self._arm = beam.mesh.mapping().offset(self.X, e) / np.hypot(
            *Sections(beam, e, xi).J[:, 0]) if lifted else None

    @cached_property
    def J(self) -> Array:
        """Derivatives of the reference position by xi and eta, (2, 2, n, k)."""
        return self._mapping.DF(self.X, self.e)

    @property
    def volume(self) -> Array:
        return cross(self.J[:, 0], self.J[:, 1])

    @cached_property
    def _functions(self):
        """Shape functions and their slopes, (nb, n, k) each."""
        return self.beam.element.of_mesh(self.beam.mesh.mapping(), self.X, self.e)[:2]

    def field(self, q: Array, slope: bool = False) -> Array:
        """A field of nodal values (ne, nb, 2), or its derivative by xi; (2, n, k)."""
        def of(functions):
            return (q[self.e].swapaxes(1, 2) @ functions.swapaxes(0, 1)).swapaxes(0, 1)

        r = of(self._functions[int(slope)])
        if slope or self._arm is None:
            return r
        r_xi = of(self._functions[1])
        return r + self._arm * np.array([-r_xi[1], r_xi[0]])

    def nodal(self, force: Array) -> Array:
        """Element vectors (ne, nb, 2) of forces (2, n, k)."""
        def of(functions, force):
            return functions.swapaxes(0, 1) @ force.transpose(1, 2, 0)

        parts = of(self._functions[0], force)
        if self._arm is not None:
            parts = parts + of(self._functions[1], self._arm * np.array([force[1], -force[0]]))
        out = np.zeros((self.beam.mesh.nelements,) + parts.shape[1:], parts.dtype)
        np.add.at(out, self.e, parts)
        return out


class SectionForces:
    """Section forces of a beam for a displacement ``u`` (N,). Between ``cuts``, axial coordinates
    element + xi, they are continuous. For a linear solution ``u``, the load factors and the results
    are complex steps (:func:`~skfem_ancf.core.linear.step`). ``loads`` are pairs of a factor and a
    Distribution (or None), ``stations`` the axial coordinates of supports and joints, ``sampled``
    further force densities, ``viscous`` the viscous element forces (ne, nb, 2); ``pressed`` is True
    if obstacles touch the beam. Raises NotRecovered if the state is not an equilibrium."""

    def __init__(self, beam: Beam, u: Array, loads: Sequence[tuple[Any, Any]],
                 stations: Sequence[float] = (), acceleration: Array | None = None,
                 sampled: Sequence[Sampled] = (), viscous: Array | None = None,
                 pressed: bool = False) -> None:
        self.beam, self.small, self.viscous = beam, np.iscomplexobj(u), viscous
        self.pressed = pressed
        if any(load is None for _, load in loads):
            raise NotRecovered("a load has only a force on the degrees of freedom: its "
                               "distribution across the section is unknown")
        self.lifted = not beam.has_sections
        self.q = beam.kernel.gather(beam.q0_local + u)
        self._acceleration = None if acceleration is None else beam.kernel.gather(acceleration)
        self._body, self._gravity = (
            sum((factor * np.asarray(getattr(load, name)) for factor, load in loads
                 if getattr(load, name) is not None), np.zeros(2)) for name in ("body", "gravity"))
        self._faces = [(factor, load) for factor, load in loads
                       if load.faces is not None and factor and np.any(load.faces)]
        self._sampled = [*sampled, *(s.times(factor) for factor, load in loads
                                     for s in load.sampled)]
        #: Loaded faces: 0 bottom, 1 top.
        self.sides = [side for side in (0, 1) if any(np.any(f.faces[side]) for _, f in self._faces)
                      or any(s.where == side for s in self._sampled)]
        self.eigen = [(factor, load.eigen) for factor, load in loads if load.eigen is not None]
        self._points = [(e, float(station), factor * f)
                        for factor, load in loads for e, xi, f in load.points
                        if (station := _snapped(e + xi)) % 1.0]
        self._cut(loads, stations)
        self._balance(u)
        inside = self._unknown.astype(int)
        for e in inside:
            # take the end forces of an element with an unknown point load from its
            # neighbours
            t = self.beam.mesh.t
            for end, other in ((0, e - 1), (1, e + 1)):
                if e + end in self._acted or other in inside or np.sum(inside == e) > 1:
                    raise NotRecovered("a load or joint at a point inside an element is next to "
                                       "another one, or to a support: put a node at the point")
                near = 0 <= other < t.shape[1] and t[end, e] == t[1 - end, other]
                self.R[end][e] = self.R[1 - end][other] if near else 0.0
                self.M[end][e] = self.M[1 - end][other] if near else 0.0
        self._check()

    # densities of force

    def body(self, at: Sections) -> Array:
        """Force per reference volume with inertia, (2, n, k)."""
        gravity = self._gravity[:, None, None]
        out = self._body[:, None, None] + self.sampled(at, BODY)
        if self._acceleration is not None:
            gravity = gravity - at.field(self._acceleration)
        if gravity.any():
            across, X = self.beam.across, off_ends(at.X)
            out = out + gravity * across.of_layers(
                X, np.zeros(X.shape[1:]), lambda k: across.density(across.layers[k], X, at.e),
                at.e, graded=False)
        return out

    def sampled(self, at: Sections, where: int) -> Array:
        """Sum of the Sampled densities of a kind, (2, n, k)."""
        return sum((s.at(at.e, at.X[0, :, 0], at.X[1], self.beam.mesh.nelements)
                    for s in self._sampled if s.where == where), np.zeros(at.X.shape))

    def eigenstrain(self, X: Array, e: Array) -> Array:
        """Sum of the eigenstrains at reference points X (2, n, k), (3, n, k)."""
        return sum((factor * eigen.strain_at(X, e) for factor, eigen in self.eigen),
                   np.zeros((3,) + X.shape[1:]))

    def tangent(self, axis: Sections) -> Array:
        """Derivative of the axis by xi, (2, n)."""
        return axis.field(self.q, slope=True)[..., 0]

    def face(self, side: int, e: Array, xi: Array) -> tuple[Sections, Array]:
        """Sections at the bottom (0) or top (1), and the force on them per xi, (2, n, 1)."""
        at = Sections(self.beam, e, xi, float(side))
        on, breadth = np.zeros((2, len(e), 1)), None
        for factor, load in self._faces:
            if load.pressure is not None:
                r = at.field(self.q, slope=True)
                force = load.pressure * (1.0 - 2.0 * side) * np.array([-r[1], r[0]])
            else:
                t = load.traction
                t = (_traction(self.beam, t, off_ends(at.X), e) if callable(t) else
                     np.asarray(t, dtype=float)[:, None, None])
                force = t * np.hypot(*at.J[:, 0])
            on = on + factor * load.faces[side][e][:, None] * force
        if on.any():  # a circle has no face
            breadth = self.beam.across.face(side, at.X, e)
            on = breadth * on
        return at, on + self.sampled(at, side)

    def _balance(self, u):
        """Set section forces at both ends of each element, and the loads along it."""
        beam, ne, (x, w) = self.beam, self.beam.mesh.nelements, gauss(ALONG)
        size = np.diff(self._ends)
        xi = (self._ends[:, :-1, None] + size[..., None] * x).ravel()
        e, w = np.repeat(np.arange(ne), ALONG * size.shape[1]), (size[..., None] * w).ravel()
        parts = [self.face(side, e, xi) for side in self.sides]
        for layer, (eta, v) in beam.across.rules(max(beam.element.order, 1) + 1, inertia=True):
            inside = Sections(beam, e, xi, eta, self.lifted)
            body = self.body(inside)
            if body.any():
                volume = inside.volume if beam.mesh.is_straight else (
                    beam.mesh.mapping().full_volume(inside.X, e))  # of sections of full height
                size = beam.across.breadth(layer, inside.X, e) * v * volume
                parts.append((inside, size * body))
        middle = Sections(beam, e, xi)
        axis = middle.field(self.q)
        parts.append((middle, self.sampled(middle, AXIS) + 0.0 * axis))  # complex as the axis
        force = sum(f.sum(axis=-1) for _, f in parts)
        moment = sum(cross(at.field(self.q) - axis, f).sum(axis=-1) for at, f in parts)
        self._r, self._force, self._moment = (
            x.reshape(x.shape[:-1] + (ne, -1)) for x in (axis[..., 0], force, moment))
        load = sum(at.nodal(f * w[:, None]) for at, f in parts)
        for e, _, f in self._points:
            load[e] = load[e] + f
        internal = (beam.kernel.small_forces if self.small else beam.kernel.forces)(u)
        if self.viscous is not None:
            internal = internal + self.viscous
        #: Size of the section forces of the eigenstrains alone.
        self._pushed = 0.0
        for factor, eigen in self.eigen:
            pushed = (factor * eigen.small_forces() if self.small else
                      eigen.element_forces(u, factor))
            internal = internal - pushed
            self._pushed += self._size(*self._at_ends(pushed))
        # action of the part on the right of a section on the part on its left
        self.R, self.M = self._at_ends(internal - load)

    def _at_ends(self, force):
        """Section forces (2 ends, ne, 2) and moments (2 ends, ne) of element vectors."""
        n = force.shape[1] // 2
        return (np.array([-force[:, 0], force[:, n]]), np.array([
            -_moments(self.q[:, :n], force[:, :n]), _moments(self.q[:, n:], force[:, n:])]))

    def _size(self, R, M):
        """The largest force times the height, plus the largest moment."""
        return np.abs(R).max() * self.beam.mesh.height + np.abs(M).max()

    def viscous_middles(self) -> tuple[Array, Array]:
        """Viscous force (2, ne) and moment (ne,) in the middle of elements."""
        ne, n = len(self.q), self.q.shape[1] // 2
        left, q = np.asarray(self.viscous)[:, :n], self.q[:, :n]
        r = Sections(self.beam, np.arange(ne), np.full(ne, 0.5)).field(self.q)[..., 0]
        R = -left[:, 0].T
        return R, cross(q[:, 0].T - r, R) - _moments(q, left)

    def at(self, e: Array, xi: Array, begin: Array) -> tuple[Array, Array]:
        """Force (2, n) and moment (n,) of the right part on the left, for segments at ``begin``."""
        # the mean of equilibrium from both ends of the element; next to an unknown force inside it,
        # only the end on this side
        side = np.full(len(e), 0.5)
        for cut in self._unknown:
            side[e == int(cut)] = np.where(begin[e == int(cut)] >= cut, 1.0, 0.0)
        (x, w), starts, size = gauss(ALONG), self._ends[e, :-1], np.diff(self._ends[e])
        z = np.clip((xi[:, None] - starts) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
        inner = lagrange(x, np.outer(z, x).ravel()).reshape(*z.shape, ALONG, ALONG)
        till = np.einsum("np,q,npqk->npk", size * z, w, inner)  # the integral from 0 to xi
        till, w = (np.reshape(v, (len(e), -1)) for v in (till, size[..., None] * w))
        r = Sections(self.beam, e, xi).field(self.q)[..., 0]
        f, m = self._force[:, e], self._moment[e]
        turning = cross(self._r[:, e] - r[..., None], f) + m
        out = []
        for end, weights in ((0, till), (1, till - w)):
            R = self.R[end][e].T
            M = (self.M[end][e] + cross(self.q[e, end * self.q.shape[1] // 2].T - r, R)
                 - (weights * turning).sum(axis=-1))
            out.append((R - (weights * f).sum(axis=-1), M))
        (R0, M0), (R1, M1) = out
        for k, station, f in self._points:
            on = e == k
            passed, F, q = 1.0 * (begin[on] >= station), f[0] + f[len(f) // 2], self.q[k]
            M = np.sum(cross(q.T, f.T)) - cross(r[:, on], F)
            for R, turn, part in ((R0, M0, passed), (R1, M1, passed - 1.0)):
                R[:, on] -= part * F[:, None]
                turn[on] -= part * M
        return R0 + side * (R1 - R0), M0 + side * (M1 - M0)

    # where they jump

    def _cut(self, loads, stations):
        mesh, across = self.beam.mesh, self.beam.across
        ne = mesh.nelements
        # what touches an end may do so a little beyond it
        stations = np.clip([*stations, *(s for _, load in loads for s in load.stations)],
                           0.0, ne).tolist()
        self._acted = _snapped(stations)
        begins, ends = np.zeros((2, mesh.p.shape[1]), dtype=bool)
        begins[mesh.t[0]], ends[mesh.t[1]] = True, True
        stations += [0.0, ne, *(station_of_node(mesh, k) for k in np.flatnonzero(begins != ends)),
                     *(np.nonzero(mesh.t[1, :-1] != mesh.t[0, 1:])[0] + 1.0), *across.jumps]
        for _, load in self._faces:
            for side, face in enumerate(load.faces):
                stations += list(np.nonzero(face[1:] != face[:-1])[0] + 1.0)
                if callable(load.traction) and np.any(face):
                    ask = partial(_traction, self.beam, load.traction)
                    stations += list(jumps(ask, ne, np.array([float(side)])))
                    part = pieces(ask, np.flatnonzero(face), float(side))
                    stations += list((part.elements + part.begin)[part.begin > 0.0])
        for s in self._sampled:
            stations += [*s.changes(ne), *s.jumps(ne)]
        for _, eigen in self.eigen:
            stations += list(jumps(eigen.strain_at, ne, np.linspace(0.0, 1.0, 5)))
        self.cuts = np.unique(_snapped(stations))
        known = np.array([station for _, station, _ in self._points])
        #: Stations of unknown forces inside elements.
        self._unknown = np.unique(self._acted[(self._acted % 1.0 != 0)
                                              & ~np.isin(self._acted, known)])
        #: Ends of the parts of elements between cuts inside them, (ne, parts + 1), some empty.
        inside = self.cuts[(self.cuts % 1.0) != 0]
        e = inside.astype(int)
        order = np.arange(len(e)) - e.searchsorted(e)
        self._ends = np.ones((ne, 3 + np.max(order, initial=-1)))
        self._ends[:, 0] = 0.0
        self._ends[e, 1 + order] = inside % 1.0

    def _check(self):
        """Raise NotRecovered unless section forces are continuous at unloaded nodes."""
        beam, mesh = self.beam, self.beam.mesh
        n, ne = mesh.p.shape[1], mesh.nelements
        R, M = np.zeros((n, 2), self.R.dtype), np.zeros(n, self.M.dtype)
        R[mesh.t[1]], M[mesh.t[1]] = self.R[1], self.M[1]
        R[mesh.t[0]] -= self.R[0]
        M[mesh.t[0]] -= self.M[0]
        size = max(self._size(self.R, self.M), BALANCED * self._pushed)
        places = np.abs((self.q.imag if self.small else self.q)[:, 0]).max()
        round_off = UNLOADED * places / mesh.lengths.min() * (
            beam.kernel.scale / mesh.lengths.sum() * mesh.height)
        if size <= round_off:
            raise NotRecovered("the beam has no load")
        place = np.zeros(n)
        place[mesh.t[0]], place[mesh.t[1]] = np.arange(ne), 1.0 + np.arange(ne)
        jump = (np.abs(R).max(axis=-1) * mesh.height + np.abs(M)) / size
        jump[np.isin(place, self._acted)] = 0.0
        if jump.max() > (UNBALANCED if self._acceleration is None else UNBALANCED_MOTION):
            raise NotRecovered("the state is not an equilibrium: at node "
                               f"{jump.argmax()} the section force jumps by {jump.max():.1%}")


class Together:
    """Section forces of several instants with the same cuts: the axis of instants is that before n.
    Arrays are as those of :class:`SectionForces`, with it behind the first axis if they have two.
    """

    def __init__(self, instants: Sequence[SectionForces]) -> None:
        self.instants = instants
        self.pressed = any(one.pressed for one in instants)
        self.sides = sorted({side for one in instants for side in one.sides})

    def __getattr__(self, name: str) -> Any:
        first = getattr(self.instants[0], name)

        def stacked(*where: Any) -> Any:
            found = [getattr(one, name)(*where) for one in self.instants]
            if isinstance(found[0], tuple):  # without Sections of a face
                return tuple(None if isinstance(x[0], Sections) else np.stack(
                    x, axis=min(1, x[0].ndim - 1)) for x in zip(*found))
            return np.stack(found, axis=1)

        return stacked if ismethod(first) else first


def _traction(beam, traction, X, e):
    """A function of position at points, (2, n, k)."""
    return np.array([np.broadcast_to(c, X.shape[1:])
                     for c in traction(beam.mesh.mapping().F(X, e))])


def _snapped(stations):
    stations = np.asarray(stations, dtype=float)
    near = np.round(stations)
    return np.where(np.abs(stations - near) < SNAP, near, stations)


def _moments(q, force):
    """Moments (ne,) of element vectors on all DOFs but r, (ne, nb, 2) both."""
    return (q[:, 1:, 0] * force[:, 1:, 1] - q[:, 1:, 1] * force[:, 1:, 0]).sum(axis=-1)
