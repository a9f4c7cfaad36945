"""Contact of members of a scene with each other."""

from typing import Any

import numpy as np
from scipy import sparse

from ...beam import Beam, Layout
from ...core import (Array, InputError, NameUnknown, call_loaded, refuse, require_flag,
                     require_label, require_not_negative, require_positive, shown)
from ..contact.contacts import SEEN
from ..contact.points import add_resistance, potential, respond
from ..contact.pairs import (COMPONENTS, both_faced, faced, meet, pair_accept, pair_force,
                             pair_stiffness, place, stiffness_of, touch_of)
from ..forces.base import ForceElement
from ..places import Vector
from .facets import ROUND, facets_of, rounded
from .search import BETWEEN, Search, Surfaces

#: Width of the transition from no pressure to proportional pressure, in heights, as of obstacles.
WIDTH = 1e-3
#: Penetration in heights at which a default stiffness is increased, the one aimed at, and the
#: largest factor.
DEEP, AIM, STIFFEST = 0.01, 0.005, 1e4
#: Of loose members: largest decrease of the stiffness in an increment, smallest stiffness, and the
#: depth relative to the one aimed at from which on it stays.
SOFTER, SOFTEST, PRESSED = 0.1, 1e-4, 0.3
#: Overlap of the reference configuration, in heights, that is an error: meshes of curves are
#: approximate.
CUT = 0.02
#: Part of the height by which a point may move in a step with no look at what it leads through: the
#: pressure of the next one acts.
NEAR = 0.25
#: Part of the height by which a point may move in an interval of a line search.
STRIDE = 0.5


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
        self.symmetric = self.conserves = self.friction == 0.0

    def __repr__(self) -> str:
        return f"<BodyContact {self.name or shown(self.a)}>"

    # binding

    def bind(self, layout: Layout) -> list[Vector]:
        # which members may touch, and their numbers
        n = len(layout.members)
        a, b = _numbers(layout, self.a), _numbers(layout, "all" if self.b is None else self.b)
        allowed = np.zeros((n, n), bool)
        allowed[np.ix_(a, b)] = True
        allowed |= allowed.T
        for k in range(n):
            allowed[k, k] = self.self_contact and k in a and isinstance(layout.members[k], Beam)
        refuse(not allowed.any(), "{!r} has nothing to touch: give self_contact=True for the "
               "contact of a beam with itself, or two members, as scene.contact(0, 1)", self)
        used = np.flatnonzero(allowed.any(axis=0)).tolist()
        beams = [k for k in used if isinstance(layout.members[k], Beam)]
        self._compiled = all(layout.members[k].compiled for k in beams)
        origin = complex(*np.mean([layout.members[k].origin for k in used], axis=0))
        f = facets_of(layout, used, origin)
        # areas on bodies and domains are those of the mean width of beams
        of_beams = np.isin(f.members, beams)
        faces = of_beams & (f.spans > 0.0)
        if faces.any():
            width = np.sum(f.areas[faces[f.of]]) / np.sum(f.lengths[faces])
            f = f._replace(areas=f.areas * np.where(of_beams[f.of], 1.0, width))
        self.dofs = np.unique(f.dofs)
        sharp = f._replace(dofs=np.searchsorted(self.dofs, f.dofs))
        f = rounded(sharp, ROUND * float(np.min(f.heights)))
        surfaces = Surfaces(f)
        if not np.isfinite(f.stiffness).any() and self.penalty is None:
            raise InputError(f"{self!r} has no beam, whose modulus would give a stiffness: give "
                             "stiffness=, a pressure per penetration")
        solids = [(k, lambda x, member=layout.members[k]: member.contains(_plane(x + origin)))
                  for k in used if k not in beams]
        places = np.isin(self.dofs, np.concatenate([layout.offset(k) // 2 + np.flatnonzero(
            layout.members[k].rigid_motions()[::2, 0]) for k in used]))
        self.broad_search = Search(surfaces, sharp, allowed, solids,
                                   (self.penalty, WIDTH, self.friction), places)
        self._surfaces, self.origin = surfaces, origin
        self.weights = self.broad_search.weights
        self.near = NEAR * self.broad_search.height
        self._begin(layout)
        return [Vector(np.zeros(2), 2 * k + np.arange(2)[:, None], 1.0) for k in self.dofs]

    def _begin(self, layout):
        """Set the gaps at which the pressure begins; InputError if members overlap."""
        begins, f = self.broad_search.tables.begins, self._surfaces.facets
        found, at = self._faced(np.zeros(len(self.dofs), complex))
        gap = found.gap[at]
        if len(at):
            k, h = at[np.argmin(gap)], self.broad_search.height
            if found.gap[k] < -CUT * h:
                x = found.x[k] + self.origin
                names = [layout.members[f.members[e]] for e in (f.of[k], found.e[k])]
                raise InputError(
                    f"{names[0]!r} and {names[1]!r} overlap by {-found.gap[k]:.4g} at "
                    f"({x.real:.4g}, {x.imag:.4g}): move them apart, or name in scene.contact(a, "
                    "b) only those that may touch")
        begins[at] = gap

    def _faced(self, z):
        """What points face at displacements z, and those in contact, (n,)."""
        found = faced(self.broad_search.tables, z)
        return found, np.flatnonzero(found.e >= 0)

    # the force element

    def start(self) -> Array:
        """A factor on the stiffness, less 1; then curves and anchors of sticking points."""
        return np.zeros(1 + (2 * len(self._surfaces.facets.of) if self.friction else 0))

    def _tables(self, history):
        return self.broad_search.tables._replace(history=np.ascontiguousarray(history))

    def evaluate(self, x: Array, v: Array, t: float, history: Array, dt: float
                 ) -> tuple[Array, Array]:
        """The force, and the history after an increment."""
        z, after = _complex(x, x)[0], history
        if self.friction:
            after = np.array(history)
            pair_accept(self._tables(history), z, z, after)
        return self.mean(x, x, t, history, dt), after

    def mean(self, x: Array, y: Array, t: float, history: Array, dt: float) -> Array:
        """The mean force of a step from x to y, with exact work."""
        z0, z1 = _complex(x, y)
        out = np.zeros(len(z1), complex)
        pair_force(self._tables(history), z0, z1, z0 is z1, out, np.empty(1))
        return -_plane(out).T

    def potential(self, x: Array, *past: Any) -> float:
        t, (found, p) = self._tables(past[0]), self._faced(_complex(x, x)[0])
        return float(stiffness_of(t, p, found.e[p]) @ potential(
            t.begins[p] - found.gap[p], t.width))

    def stiffness(self, x: Array, v: Array, t: float, *past: Any) -> Any:
        return self.mean_stiffness(x, x, t, *past)

    def mean_stiffness(self, x: Array, y: Array, t: float, *past: Any) -> Any:
        (z0, z1), n, tables = _complex(x, y), 2 * len(self.dofs), self._tables(past[0])
        P = len(tables.of)
        facets, zeta, K = np.empty(P, np.int64), np.empty(P), np.empty((COMPONENTS**2, P))
        k = call_loaded(pair_stiffness, self._compiled, tables, z0, z1, z0 is z1, facets, zeta, K)
        # by the components of degrees of freedom; those of r, t, c and T are products of complex
        # weights, conjugate for derivatives
        p = np.flatnonzero(facets >= 0)
        e = facets[p]
        own, other = (tables.N[:, p], tables.D[:, p]), self._surfaces.weights(e, zeta[p])
        W = np.zeros((k, 2 * len(tables.N), 2, COMPONENTS // 2, 2))
        for part, weights in enumerate((own, other)):
            rows = slice(part * len(tables.N), (part + 1) * len(tables.N))
            for vector, w in enumerate(weights, 2 * part):
                W[:, rows, :, vector] = np.array([[w.real, w.imag], [-w.imag, w.real]]).transpose(
                    3, 2, 0, 1)
        W = W.reshape(k, 4 * len(tables.N), COMPONENTS)
        K = -W @ K[:, :k].T.reshape(k, COMPONENTS, COMPONENTS) @ W.transpose(0, 2, 1)
        dofs = np.concatenate([tables.point_dofs[:, p], tables.dofs[:, e]]).T
        at = (2 * dofs[:, :, None] + np.arange(2)).reshape(k, K.shape[1])
        i, j = np.broadcast_arrays(at[:, :, None], at[:, None])
        return sparse.csr_array((K.ravel(), (i.ravel(), j.ravel())), shape=(n, n))

    # solvers

    def corrected(self, x: Array, t: float, history: Array) -> Array | None:
        found, at, deep = self._depth(x)
        if self.penalty is not None or deep <= DEEP or history[0] >= STIFFEST:
            return None
        return self._stiffened(history, found, at, max(deep / AIM, 2.0))

    def relaxed(self, x: Array, history: Array) -> Array:
        """A history with less stiffness, down to what the depth at x needs. Of loose members the
        pressure is small at first: on stiff faces contacts would open and close in turn."""
        found, at, deep = self._depth(x)
        factor = max(deep / AIM, SOFTER, SOFTEST / (1.0 + history[0]))
        if self.penalty is not None or factor > PRESSED:
            return history
        return self._stiffened(history, found, at, factor)

    def _depth(self, x):
        """What points face, those in contact, and the largest depth in heights."""
        found, at = self._faced(_complex(x, x)[0])
        return found, at, -float(np.min(found.gap[at], initial=0.0)) / self.broad_search.height

    def _stiffened(self, history, found, at, factor):
        """A history with a factor on the stiffness and the same tractions of friction."""
        new = history.copy()
        new[0] = (1.0 + new[0]) * factor - 1.0
        if self.friction:
            anchor = new[1:].reshape(2, -1)[1]
            where = np.zeros(len(anchor))
            where[at] = place(self.broad_search.tables, found.e[at], found.zeta[at])
            anchor[:] = where - (where - anchor) / factor
        return new

    def least_gap(self, x: Array) -> float:
        """The least gap at x; 0 if anything touches. Points move by at most the largest change of x
        times ``weights``."""
        return float(self._faced(_complex(x, x)[0])[0].clear[0])

    def search_intervals(self, x: Array, y: Array) -> float:
        return self._travel(x, y) / (STRIDE * self.broad_search.height)

    def _travel(self, x, y):
        """The largest displacement of a point from x to y."""
        a, b = (self._surfaces.outside(z)[0] for z in _complex(x, y))
        return float(np.max(np.abs(b - a)))

    def passed(self, x: Array, y: Array, t: float) -> str | None:
        z0, z1 = _complex(x, y)
        gap = float(self._faced(z1)[0].clear[0])
        if 2.0 * BETWEEN * self._travel(x, y) < gap:  # neither side came as far as the other
            return None
        if (met := self.broad_search.crossed(z1)) is not None:
            what = "beams have passed through each other"
        elif (met := self.broad_search.entered(z0, z1)) is not None:
            what = "a member has passed into a body"
        else:
            return None
        at = met + self.origin
        return f"{self!r}: {what} at ({at.real:.4g}, {at.imag:.4g})"

    # results

    def look(self, x: Array, t: float, history: Array, before: Array | None = None
             ) -> tuple[Array, ...]:
        """Contact points, and the points that they touch, (2, n) each, and forces on the first.
        Then pressures, gaps, and True for sticking points, (n,), and the members of both, (n,).

        Parameters
        ----------
        before
            Positions (n, 2) at the start of a step, of which forces and pressures are means.
        """
        f, (found, met, touch, r, R) = self._surfaces.facets, self._responding(x, history, before)
        p, e, normal = met.at, met.e, touch.gap[:2]
        at, gap = _plane(found.x[p] + self.origin), self.broad_search.tables.begins[p] - met.after
        return (at, at - gap * normal, -R[:2], r.pressure / (0.5 * f.areas[p]), gap,
                np.abs(r.friction) < (1.0 - SEEN) * self.friction * r.pressure,
                f.members[f.of[p]], f.members[e])

    def _responding(self, x, history, before):
        """Points in contact at x, or in a step: what all face, the Meeting, the Touch, the
        Response, and resisting forces."""
        t, (z0, z1) = self._tables(history), _complex(x if before is None else before, x)
        f0, f1 = both_faced(t, z0, z1, z0 is z1)
        met = meet(t, z0 is z1, f0, f1)
        touch = touch_of(t, f0, f1, met)
        r, R = respond(touch, t.width, t.friction, 0.0, 1.0), np.zeros(touch.gap.shape)
        add_resistance(touch, r, R)
        return f1, met, touch, r, R

    def loads_on(self, beam: Beam, first: int, x: Array, history: Array,
                 before: Array | None = None) -> list[tuple[int, float, Array]]:
        """Of each contact point, and of what it touches: element, xi, nodal force (nb, 2).

        Parameters
        ----------
        beam, first
            The Beam of the elements, and its first DOF.
        before
            As for :meth:`look`.
        """
        t, f, (_, met, _, _, R) = self.broad_search.tables, self._surfaces.facets, self._responding(
            x, history, before)
        out, p, nb, R = list[Any](), met.at, beam.nd, R[::2] + 1j * R[1::2]
        nodes, C = beam.mesh.t[0] * (nb // 2) + first // 2, self._surfaces.weights(met.e, met.zeta)
        own, other = (-(np.conj(N) * a + np.conj(D) * b).T for (N, D), a, b in (
            ((t.N[:, p], t.D[:, p]), R[0], R[1]), (C, R[2], R[3])))
        for e, zeta, part in ((f.of[p], f.zeta[p], own), (met.e, met.zeta, other)):
            left, right = f.ends[e].T
            xi = np.clip(np.where(f.spans[e] > 0.0, (zeta - left) / (right - left),
                                  0.5 - 0.5 * f.sides[e]), 0.0, 1.0)
            for k, node in enumerate(self.dofs[f.dofs[e, 0]]):
                out += [(n, float(xi[k]), _plane(part[k, :nb]).T)
                        for n in np.flatnonzero(nodes == node).tolist()]
        return out


def _plane(z):
    return np.array([z.real, z.imag])


def _complex(x, y):
    """Displacements as complex numbers, one array for equal ones."""
    z0, z1 = (np.array(u, dtype=float, order="C").view(complex)[:, 0] for u in (x, y))
    return z0, z0 if x is y or np.array_equal(x, y) else z1


def _numbers(layout, which):
    """Numbers of members."""
    if isinstance(which, str) and which == "all":
        return list(range(len(layout.members)))
    try:
        return [layout.number(k) for k in (which if isinstance(which, (list, tuple)) else [which])]
    except NameUnknown as error:
        raise NameUnknown(error.kind, error.name, ("all", *error.known)) from None
