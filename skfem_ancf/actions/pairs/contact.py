"""Contact of members of a scene with each other."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from ...beam.beam import Beam
from ...beam.layout import Layout
from ...core import (Array, InputError, refuse, require_flag, require_label, require_not_negative,
                     require_positive, shown)
from ..contact.contacts import SEEN
from ..contact.laws import mean_pressure, mean_pressure_slope, return_mapping
from ..forces.base import ForceElement
from ..places import Vector
from .facets import facets_of
from .gap import Pairs, Surfaces, curvature, dot, gaps, mean_slope, slip_row
from .search import Search, Touching

#: Width of the transition from no pressure to proportional pressure, in heights, as of obstacles.
WIDTH = 1e-3
#: Penetration in heights at which a default stiffness is increased, the one aimed at, and the
#: largest factor.
DEEP, AIM, FIRMEST = 0.01, 0.005, 1e4
#: Of loose members: largest decrease of the stiffness in an increment, smallest stiffness, and the
#: depth relative to the one aimed at from which on it stays.
SOFTER, SOFTEST, PRESSED = 0.1, 1e-4, 0.3
#: Overlap of the reference configuration, in heights, that is an error: meshes of curves are
#: approximate.
CUT = 0.02
#: Iterations for the place of a mean force; change of a gap in heights below which none is needed.
MEANS, CLOSE = 8, 1e-9
#: Part of the height by which a point may move in a step with no look at what it leads through: the
#: pressure of the next one acts.
NEAR = 0.25
#: Part of the height by which a point may move in an interval of a line search.
STRIDE = 0.5


class Meeting(NamedTuple):
    """Pairs in contact at one of two states, with penetrations at both, (n,)."""

    pairs: Pairs
    before: Array
    after: Array
    share: Array  # correction of the mean pressure
    end: Touching  # at the second state


class Rubbing(NamedTuple):
    """Friction of pairs: force along the facet, stiffness, 1 for sticking, slip and its rate by the
    place along the facet."""

    force: Array
    stiffness: Array
    sticks: Array
    slip: Array
    rate: Array


class BodyContact(ForceElement):
    """Contact of beams, rigid bodies and domains with each other, and of beams with themselves.

    Points of all surfaces, with the ends of beams, are pressed out of the surfaces that they face.
    The pressure of a point begins at the face, or at the gap of the reference configuration if that
    is negative, and grows by ``stiffness`` times the penetration.

    Parameters
    ----------
    a
        A beam, rigid body or domain, its name or number, a list of these, or "all".
    b
        The same for those that touch ``a``; by default all others.
    friction
        Coulomb's coefficient, zero or positive.
    stiffness
        Pressure per penetration, positive; by default ``E / height``, the smaller one of two beams.
        ``solve_static`` and ``run`` increase it where bodies enter each other by more than a
        hundredth of their height.
    self_contact
        True: beams of ``a`` may touch themselves, too.
    name
        Name in messages.

    Other Parameters
    ----------------
    x, y, v, t, history, dt, past
        Positions (n, 2) and velocities (n, 2), history (k,) and time span as in
        :class:`ForceElement`.

    Notes
    -----
    Where axes meet in the reference configuration, or an axis is in a body, these are taken for
    joined: they do not touch within three heights. Each surface presses with half of the stiffness
    on the other one.

    References
    ----------
    Wriggers: "Computational Contact Mechanics", Springer 2006; Laursen, Chawla: "Design of energy
    conserving algorithms for frictionless dynamic contact problems", International Journal for
    Numerical Methods in Engineering 40 (1997).

    Examples
    --------
    Two cantilevers, one on the other:

    >>> import numpy as np
    >>> from skfem_ancf import (Beam, BodyContact, ElementBeamANCF, MeshBeam, Scene,
    ...                         StVenantKirchhoff)
    >>> leaves = [Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.02, origin=(0, y)),
    ...                ElementBeamANCF(3), StVenantKirchhoff(2e11, 0.3), width=0.05)
    ...           for y in (0.0, -0.02)]
    >>> scene = Scene(*leaves).clamp("left", 0).clamp("left", 1).add(BodyContact("all"))
    >>> scene = scene.point_force((0, -1e3), at=(1, 0), beam=0)
    >>> w = [scene.solve_static().displacement("right", beam)[1] for beam in (0, 1)]
    >>> bool(abs(w[0] / w[1] - 1) < 0.02)
    True
    """

    distributed = changing = True
    resists = False

    def __init__(self, a: Any = "all", b: Any = None, friction: float = 0.0,
                 stiffness: float | None = None, self_contact: bool = False,
                 name: str | None = None) -> None:
        self.a, self.b = a, b
        self.friction = require_not_negative("friction", friction, False)
        self.penalty = None if stiffness is None else require_positive("stiffness", stiffness)
        self.self_contact = require_flag("self_contact", self_contact)
        self.name = require_label("name", name)
        self.symmetric = self.friction == 0.0

    def __repr__(self) -> str:
        return f"<BodyContact {self.name or shown(self.a)}>"

    # binding

    def bind(self, layout: Layout) -> list[Vector]:
        used, allowed = self._members(layout)
        beams = [k for k in used if isinstance(layout.members[k], Beam)]
        origin = complex(*np.mean([layout.members[k].origin for k in used], axis=0))
        surfaces = Surfaces(_widened(facets_of(layout, used, origin), beams))
        self.dofs = np.unique(surfaces.facets.dofs)
        f = surfaces.facets._replace(dofs=np.searchsorted(self.dofs, surfaces.facets.dofs))
        surfaces = Surfaces(f)
        if not np.isfinite(f.firmness).any() and self.penalty is None:
            raise InputError(f"{self!r} has no beam, whose modulus would give a stiffness: give "
                             "stiffness=, a pressure per penetration")
        solids = [(k, _inside(layout.members[k], origin)) for k in used if k not in beams]
        self.search, self.origin = Search(surfaces, allowed, solids), origin
        self.width = WIDTH * self.search.height
        self.weights = np.repeat(np.sqrt(2.0) * self.search.weights, 2)
        self.near = NEAR * self.search.height
        self._begin(layout)
        return [Vector(np.zeros(2), 2 * k + np.arange(2)[:, None], 1.0) for k in self.dofs]

    def _members(self, layout):
        """Numbers of the members, and which of all may touch."""
        n = len(layout.members)
        a, b = _numbers(layout, self.a), _numbers(layout, "all" if self.b is None else self.b)
        allowed = np.zeros((n, n), bool)
        allowed[np.ix_(a, b)] = True
        allowed |= allowed.T
        for k in range(n):
            allowed[k, k] = self.self_contact and k in a and isinstance(layout.members[k], Beam)
        refuse(not allowed.any(), "{!r} has nothing to touch: give self_contact=True for the "
               "contact of a beam with itself, or two members, as scene.contact(0, 1)", self)
        return np.flatnonzero(allowed.any(axis=0)).tolist(), allowed

    def _begin(self, layout):
        """Set the gaps at which the pressure begins; InputError if members overlap."""
        search, h = self.search, self.search.height
        z, begins = np.zeros(len(self.dofs), complex), np.zeros(len(search.surfaces.facets.of))
        search.begins = begins
        found = search.touching(z)
        if len(found.p):
            k, f = int(np.argmin(found.gap)), search.surfaces.facets
            if found.gap[k] < -CUT * h:
                x = search.surfaces.outside(z)[0][found.p[k]] + self.origin
                names = [layout.members[f.members[e]] for e in (f.of[found.p[k]], found.e[k])]
                raise InputError(
                    f"{names[0]!r} and {names[1]!r} overlap by {-found.gap[k]:.4g} at "
                    f"({x.real:.4g}, {x.imag:.4g}): move them apart, or name in scene.contact(a, "
                    "b) only those that may touch")
            begins[found.p] = found.gap
        search.forget()

    # states

    def _meet(self, z0, z1):
        """The :class:`Meeting` between two states, which may be the same array."""
        search, S = self.search, self.search.surfaces
        end = search.touching(z1)
        start = end if z0 is z1 else search.touching(z0)
        p, e, zeta, gap = end[:4]
        if z0 is z1:
            a = search.begins[p] - gap
            return Meeting(S.pairs(p, e, zeta), a, a, 1.0, end)
        left = ~np.isin(start.p, p)
        p, e, zeta = (np.append(x, y[left]) for x, y in zip(end, start[:3]))
        (other, a), (here, b) = (self._other(one, p, e, zeta, z) for one, z in (
            (start, z0), (end, z1)))
        pairs, change = self._mean_place(p, e, np.sort([here, other], axis=0), a - b, z0, z1)
        good = (np.abs(a - b) > CLOSE * search.height) & (np.abs(change) > 0.3 * np.abs(a - b))
        return Meeting(pairs, a, b, np.where(good, (a - b) / np.where(good, change, 1.0), 1.0), end)

    def _other(self, known, p, e, zeta, z):
        """Place and penetration of known pairs at a state; none of those that are apart."""
        S, search = self.search.surfaces, self.search
        gap, at = np.full(len(S.shift), np.inf), np.full(len(S.shift), -1)
        gap[known.p], at[known.p] = known.gap, np.arange(len(known.p))
        zeta, touch = zeta.copy(), at[p] >= 0
        same = touch & (known.e[at[p]] == e) if len(known.p) else touch
        zeta[same] = known.zeta[at[p[same]]]
        rest = ~same
        if np.any(rest):
            found, there = S.project(S.outside(z)[0][p[rest]], e[rest], zeta[rest], z)
            zeta[rest] = np.where(there, found, zeta[rest])
            apart = rest & ~touch
            gap[p[apart]] = np.maximum(gaps(S.pairs(p[apart], e[apart], zeta[apart]), z),
                                       search.begins[p[apart]])
        return zeta, search.begins[p] - gap[p]

    def _mean_place(self, p, e, ends, wanted, z0, z1):
        """Pairs at the place between two ``ends`` (2, n) where the gap changes as wanted."""
        # The gap is least at the closest point, so there is one. Also the change there.
        S = self.search.surfaces

        def at(zeta):
            pairs = S.pairs(p, e, zeta)
            return pairs, gaps(pairs, z1) - gaps(pairs, z0)

        low, high = ends
        below, above = (at(x)[1] - wanted for x in (low, high))
        for _ in range(MEANS):
            slope = above - below
            share = np.where(slope == 0.0, 0.5, -below / np.where(slope == 0.0, 1.0, slope))
            zeta = low + np.clip(share, 0.0, 1.0) * (high - low)
            pairs, change = at(zeta)
            left = change - wanted
            if np.all(np.abs(left) <= 1e-3 * np.abs(wanted) + 1e-15 * self.search.height):
                break
            same = left * below > 0.0
            low, below = np.where(same, zeta, low), np.where(same, left, below)
            high, above = np.where(same, high, zeta), np.where(same, above, left)
        return pairs, change

    def _stiff(self, pairs, history):
        """Stiffness times area of pairs, (n,)."""
        f = self.search.surfaces.facets
        own, firm = f.of[pairs.p], 1.0 + history[0]
        k = np.minimum(f.firmness[own], f.firmness[pairs.e]) if self.penalty is None else (
            self.penalty)
        return 0.5 * firm * k * f.areas[pairs.p]

    # the force element

    def start(self) -> Array:
        """A factor on the stiffness, less 1; then curves and anchors of sticking points."""
        return np.zeros(1 + (2 * len(self.search.surfaces.facets.of) if self.friction else 0))

    def evaluate(self, x: Array, v: Array, t: float, history: Array, dt: float
                 ) -> tuple[Array, Array]:
        """The force, and the history after an increment."""
        z = _complex(x, x)[0]
        met = self._meet(z, z)
        return self._spread(met, self._forces(met, z, z, history)), self._after(met, z, history)

    def mean(self, x: Array, y: Array, t: float, history: Array, dt: float) -> Array:
        """The mean force of a step from x to y, with exact work."""
        z0, z1 = _complex(x, y)
        met = self._meet(z0, z1)
        return self._spread(met, self._forces(met, z0, z1, history))

    def _forces(self, met, z0, z1, history):
        """The forces of pairs on their degrees of freedom, (n, 2 B)."""
        k, pairs = self._stiff(met.pairs, history), met.pairs
        p = k * mean_pressure(met.before, met.after, self.width) * met.share
        rows = p[:, None] * mean_slope(pairs, z0, z1)
        if self.friction:
            T = self._friction(met, z1, history).force
            rows = rows - T[:, None] * slip_row(pairs, 0.5 * (z0 + z1))
        return rows

    def _spread(self, met, rows):
        """Forces (N / 2, 2) from those of pairs."""
        at, n = met.pairs.dofs.ravel(), len(self.dofs)
        return np.column_stack([np.bincount(at, x.ravel(), n) for x in (rows.real, rows.imag)])

    def potential(self, x: Array, *past: Any) -> float:
        z = _complex(x, x)[0]
        met, w = self._meet(z, z), self.width
        a = met.before
        S = (np.maximum(a, 0.0) ** 3 - np.maximum(a - w, 0.0) ** 3) / (6.0 * w)
        return float(self._stiff(met.pairs, past[0]) @ S)

    def stiffness(self, x: Array, v: Array, t: float, *past: Any) -> Any:
        return self.mean_stiffness(x, x, t, *past)

    def mean_stiffness(self, x: Array, y: Array, t: float, *past: Any) -> Any:
        (z0, z1), n = _complex(x, y), 2 * len(self.dofs)
        met = self._meet(z0, z1)
        pairs, middle = met.pairs, 0.5 * (z0 + z1)
        k, a, b, w = self._stiff(pairs, past[0]), met.before, met.after, self.width
        mean = mean_pressure(a, b, w)
        slope = k * mean_pressure_slope(a, b, w, mean)
        G = _real(mean_slope(pairs, z0, z1))
        bend = self.search.surfaces.along(pairs.e, pairs.zeta, 2, middle)
        K = (k * mean)[:, None, None] * curvature(pairs, bend, middle) - (
            slope[:, None] * G)[:, :, None] * G[:, None]
        if self.friction:
            rub = self._friction(met, z1, past[0])
            S, twice = _real(slip_row(pairs, middle)), 1.0 if z0 is z1 else 2.0
            by = (twice * rub.sticks * rub.stiffness)[:, None] * S - (
                self.friction * np.sign(rub.force) * (1.0 - rub.sticks) * slope)[:, None] * G
            K -= S[:, :, None] * by[:, None]
        at = (2 * pairs.dofs[:, :, None] + np.arange(2)).reshape(G.shape)
        i, j = np.broadcast_arrays(at[:, :, None], at[:, None])
        return sparse.csr_array((K.ravel(), (i.ravel(), j.ravel())), shape=(n, n))

    # friction

    def _friction(self, met, z, history):
        """The :class:`Rubbing` of pairs at the end z of a step; none of those that have parted."""
        S, (p, e, zeta, gap) = self.search.surfaces, met.end[:4]
        f, n = S.facets, len(p)
        T, bend = (S.along(e, zeta, order, z) for order in (1, 2))
        normal = f.sides[e] * 1j * T / np.abs(T)
        rate = (np.abs(T) - (gap + f.offsets[e]) * dot(normal, bend) / np.abs(T)) * 2.0 / (
            f.lengths[e])
        key, anchor = history[1:].reshape(2, -1)[:, p]
        held = key == f.curves[e] + 1.0
        slip = np.where(held, rate * (self.search.place(e, zeta) - anchor), 0.0)
        c = self._stiff(met.pairs, history)
        limit = self.friction * c * mean_pressure(met.before, met.after, self.width) * met.share
        slip, rate, held = (np.append(x, np.full(len(c) - n, y)) for x, y in (
            (slip, 0.0), (rate, 1.0), (held, 0.0)))
        force, sticks = return_mapping(c * slip, limit)
        return Rubbing(force, c, sticks * held, slip, rate)

    def _after(self, met, z, history):
        """The history at the end z of an increment."""
        if not self.friction:
            return history
        rub, (p, e, zeta, _) = self._friction(met, z, history), met.end[:4]
        new = np.append(history[:1], np.zeros(len(history) - 1))
        curves, anchors = new[1:].reshape(2, -1)
        curves[p] = self.search.surfaces.facets.curves[e] + 1.0
        anchors[p] = self.search.place(e, zeta) - (rub.force / rub.stiffness / rub.rate)[:len(p)]
        return new

    # solvers

    def corrected(self, x: Array, t: float, history: Array) -> Array | None:
        found, deep = self._depth(x)
        if self.penalty is not None or deep <= DEEP or history[0] >= FIRMEST:
            return None
        return self._stiffened(history, found, max(deep / AIM, 2.0))

    def relaxed(self, x: Array, history: Array) -> Array:
        """A history with less stiffness, down to what the depth at x needs. Of loose members the
        pressure is small at first: on stiff faces contacts would open and close in turn."""
        found, deep = self._depth(x)
        factor = max(deep / AIM, SOFTER, SOFTEST / (1.0 + history[0]))
        if self.penalty is not None or factor > PRESSED:
            return history
        return self._stiffened(history, found, factor)

    def _depth(self, x):
        """Points in contact and the largest depth in heights."""
        found = self.search.touching(_complex(x, x)[0])
        return found, -float(np.min(found.gap, initial=0.0)) / self.search.height

    def _stiffened(self, history, found, factor):
        """A history with a factor on the stiffness and the same tractions of friction."""
        new = history.copy()
        new[0] = (1.0 + new[0]) * factor - 1.0
        if self.friction:
            anchor = new[1:].reshape(2, -1)[1]
            place = np.zeros(len(anchor))
            place[found.p] = self.search.place(found.e, found.zeta)
            anchor[:] = place - (place - anchor) / factor
        return new

    def least_gap(self, x: Array) -> float:
        """The least gap at x; 0 if anything touches. Points move by at most the largest change of x
        times ``weights``."""
        return self.search.touching(_complex(x, x)[0]).clear

    def stride(self, x: Array, y: Array) -> float:
        S = self.search.surfaces
        a, b = (S.outside(z)[0] for z in _complex(x, y))
        return float(np.max(np.abs(b - a)) / (STRIDE * self.search.height))

    def passed(self, x: Array, y: Array, t: float) -> str | None:
        z0, z1 = _complex(x, y)
        if self.stride(x, y) < 1.0 and not len(self.search.candidates(z1)[0].p):
            return None
        if (met := self.search.crossed(z1)) is not None:
            what = "beams have passed through each other"
        elif (met := self.search.entered(z0, z1)) is not None:
            what = "a member has passed into a body"
        else:
            return None
        at = met + self.origin
        return f"{self!r}: {what} at ({at.real:.4g}, {at.imag:.4g})"

    # results

    def look(self, x: Array, t: float, history: Array) -> tuple[Array, ...]:
        """Contact points, and the points that they touch, (2, n) each, and forces on the first.
        Then pressures, gaps, and True for sticking points, (n,), and the members of both, (n,)."""
        z = _complex(x, x)[0]
        met, f = self._meet(z, z), self.search.surfaces.facets
        pairs, area = met.pairs, 0.5 * f.areas[met.pairs.p]
        p = self._stiff(pairs, history) * mean_pressure(met.before, met.after, self.width)
        T = pairs.vectors(z)[3]
        way = T / np.abs(T)
        normal, sticks = pairs.side * 1j * way, np.zeros(len(p), bool)
        force = p * normal
        if self.friction:
            rub = self._friction(met, z, history)
            force, sticks = force - rub.force * way, np.abs(rub.force) < (1.0 - SEEN) * (
                self.friction * p)
        at = self.search.surfaces.outside(z)[0][pairs.p] + self.origin
        return (_plane(at), _plane(at - met.end.gap * normal), _plane(force), p / area,
                met.end.gap, sticks, f.members[f.of[pairs.p]], f.members[pairs.e])

    def loads_on(self, beam: Beam, first: int, x: Array, history: Array
                 ) -> list[tuple[int, float, Array]]:
        """Of each contact point, and of what it touches: element, xi, nodal force (nb, 2).

        Parameters
        ----------
        beam, first
            The Beam of the elements, and its first DOF.
        """
        z, f, out = _complex(x, x)[0], self.search.surfaces.facets, []
        met = self._meet(z, z)
        rows, pairs, nb = self._forces(met, z, z, history), met.pairs, beam.nd
        nodes, B = beam.mesh.t[0] * (nb // 2) + first // 2, pairs.weights[0].shape[1]
        for e, zeta, part in ((f.of[pairs.p], f.zeta[pairs.p], rows[:, :B]),
                              (pairs.e, pairs.zeta, rows[:, B:])):
            xi = 0.5 + 0.5 * np.clip(np.where(f.spans[e] > 0.0, zeta, -f.sides[e]), -1.0, 1.0)
            for k, node in enumerate(self.dofs[f.dofs[e, 0]]):
                out += [(n, float(xi[k]), _plane(part[k, :nb]).T)
                        for n in np.flatnonzero(nodes == node).tolist()]
        return out


def _plane(z):
    return np.array([z.real, z.imag])


def _complex(x, y):
    """Displacements as complex numbers, one array for equal ones."""
    z0, z1 = (np.ascontiguousarray(u, dtype=float).view(complex)[:, 0] for u in (x, y))
    return z0, z0 if x is y or np.array_equal(x, y) else z1


def _real(rows):
    return np.ascontiguousarray(rows).view(float)


def _numbers(layout, which):
    """Numbers of members."""
    if isinstance(which, str) and which == "all":
        return list(range(len(layout.members)))
    return [layout.number(one) for one in (which if isinstance(which, (list, tuple)) else [which])]


def _widened(facets, beams):
    """Facets whose areas on bodies and domains are those of the mean width of beams."""
    f = facets
    of_beams = np.isin(f.members, beams)
    faces = of_beams & (f.spans > 0.0)
    if not faces.any():
        return f
    width = np.sum(f.areas[faces[f.of]]) / np.sum(f.lengths[faces])
    return f._replace(areas=f.areas * np.where(of_beams[f.of], 1.0, width))


def _inside(member, origin):
    return lambda x: member.contains(_plane(x + origin))
