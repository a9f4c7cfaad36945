"""The broad search: which points may touch which facets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from ...core import Array
from ..contact.tables import weights_of_motion
from .gap import Surfaces, cross, dot

#: Distance of seeds along facets, largest number on a facet, and the distance for which a list of
#: candidates is enough, in heights; larger ones tried where nothing is near.
SEEDS, MOST, SKIN = 1.2, 10, 0.5
SKINS = 2.0, 5.0, 12.0, 30.0, 75.0
#: No contact of a beam with itself, or with a beam that it is joined to, within so many heights.
APART = 3.0
#: Distance of axes that are joined, in heights; parts of an element in which they are searched.
JOINED, FINE = 1e-3, 8
#: Sine of the angle of parallel segments.
PARALLEL = 1e-6
#: How much further points between those of a rule may move.
BETWEEN = 1.1
#: Number of states of which pairs are kept.
KEPT = 3
#: Parts of an element in which crossing axes are searched.
COARSE = 2
#: Largest penetration, in heights; a point as deep as the height lies on the other face.
DEEPEST = 0.75
#: Largest cosine of the angle between outer normals of surfaces that touch.
OPPOSED = -0.2


class Candidates(NamedTuple):
    """Pairs of points and facets, a guess of zeta, and where all points were at the search. It is
    complete until points or facets have moved by half of ``skin``."""

    p: Array
    e: Array
    zeta: Array
    seeds: tuple[Array, Array]
    x: Array
    skin: float


class Touching(NamedTuple):
    """Pairs of points and facets in contact, (n,) each: their closest points and gaps. ``clear`` is
    the least gap of all if there are none."""

    p: Array
    e: Array
    zeta: Array
    gap: Array
    clear: float


class Search:
    """Finds the facet that each point is nearest to. ``allowed`` (M, M) says which members may
    touch; ``begins`` (P,) is the gap at which the pressure begins. ``solids`` are numbers of
    members without axes, and functions that say which places of the reference configuration are
    inside."""

    def __init__(self, surfaces: Surfaces, allowed: Array, solids: Sequence[Any] = ()) -> None:
        self.surfaces, self.allowed, self.begins = surfaces, allowed, np.inf
        f, self._known = surfaces.facets, None
        self._last: list[tuple[Array, Touching]] = []
        (N, _), (D, slope) = surfaces.points
        self.weights = BETWEEN * weights_of_motion(
            np.abs(N) + 2.0 * np.abs(surfaces.shift / slope)[:, None] * np.abs(D), surfaces.dofs,
            int(f.dofs.max()) + 1)
        self.height = h = float(np.min(f.heights))
        m = int(np.clip(np.ceil(np.max(f.lengths) / (SEEDS * h)), 1, MOST))
        self._seed_zeta = (2.0 * np.arange(m) + 1.0) / m - 1.0
        self._near = 0.6 * f.lengths / m + f.offsets
        self.joined = self._joined(solids)

    def candidates(self, z: Array) -> tuple[Candidates, Array, Array]:
        """The candidates at displacements z, with points and normals of the surfaces there."""
        x, n = self.surfaces.outside(z)
        known = self._known
        if known is None or np.max(np.abs(x - known.x)) > 0.5 * known.skin:
            self._known = known = self._search(x, z, SKIN * self.height)
            for skin in SKINS if not len(known.p) else ():  # how far may it move unseen?
                wide = self._search(x, z, skin * self.height)
                if len(wide.p):
                    break
                self._known = known = wide
        return known, x, n

    def _search(self, x, z, skin):
        f, m = self.surfaces.facets, len(self._seed_zeta)
        e, zeta = np.repeat(np.arange(len(f.sides)), m), np.tile(self._seed_zeta, len(f.sides))
        y = self.surfaces.along(e, zeta, 0, z)
        trees = [scipy.spatial.cKDTree(np.column_stack([a.real, a.imag])) for a in (x, y)]
        reach = float(np.max(self._near)) + self.height + skin
        found = trees[0].sparse_distance_matrix(trees[1], reach, output_type="ndarray")
        p, k, far = found["i"], found["j"], found["v"]
        which = (far < self._near[e[k]] + self.height + skin) & self.allowed[
            f.members[f.of[p]], f.members[e[k]]] & ~self._together(p, e[k], zeta[k], f.lengths)
        p, k, far = p[which], k[which], far[which]
        order = np.lexsort((far, e[k], p))
        p, k = p[order], k[order]
        first = np.append(True, (np.diff(p) != 0) | (np.diff(e[k]) != 0))[:len(p)]
        p, k = p[first], k[first]
        return Candidates(p, e[k], zeta[k], self.surfaces.curve(e[k], zeta[k], 0), x,
                          skin)

    def touching(self, z: Array) -> Touching:
        """The pairs with a gap below the one at which the pressure begins."""
        # The last ones are kept: forces and stiffnesses ask for the same states in turn.
        for at, found in self._last:
            if np.array_equal(at, z):
                return found
        found = self._touching(z)
        self._last = [*self._last[1 - KEPT:], (z.copy(), found)]
        return found

    def forget(self) -> None:
        """Forget the last states."""
        self._last = []

    def _touching(self, z):
        known, x, n = self.candidates(z)
        beyond = known.skin + self.height - 2.0 * float(np.max(np.abs(x - known.x)))
        weights, start = known.seeds
        y = start + np.einsum("nb,nb->n", weights, z[self.surfaces.facets.dofs[known.e]])
        far = np.abs(x[known.p] - y) - self._near[known.e] - self.height
        near = far < 0.0
        beyond = np.min(far[~near] + self.height, initial=beyond)
        p, e, f = known.p[near], known.e[near], self.surfaces.facets
        if not len(p):
            return Touching(p, e, np.zeros(0), np.zeros(0), beyond)
        zeta, there = self.surfaces.project(x[p], e, known.zeta[near], z)
        zeta = np.where(there, zeta, np.clip(zeta, -1.0, 1.0))
        c, T = (self.surfaces.along(e, zeta, order, z) for order in (0, 1))
        normal = f.sides[e] * 1j * T / np.abs(T)
        gap = dot(normal, x[p] - c) - f.offsets[e]
        gap[~there] = np.abs(x[p] - c)[~there] - f.offsets[e[~there]]
        begins = np.broadcast_to(self.begins, x.shape)[p]
        apart = ~self._together(p, e, zeta, 0.0 * f.lengths)
        left = np.where(gap < begins, -DEEPEST * self.height - gap, gap - begins)
        beyond = np.min(left[apart], initial=beyond)
        fits = there & apart & (gap < begins) & (gap > -DEEPEST * self.height) & (
            dot(normal, n[p]) < OPPOSED)
        p, e, zeta, gap = p[fits], e[fits], zeta[fits], gap[fits]
        away = np.abs(gap) + np.maximum(np.abs(zeta) - 1.0, 0.0) * f.lengths[e]
        order = np.lexsort((away, p))
        best = order[np.append(True, np.diff(p[order]) != 0)[:len(p)]]
        return Touching(p[best], e[best], zeta[best], gap[best], beyond)

    def place(self, e: Array, zeta: Array) -> Array:
        """Where points of facets are along their curve."""
        f = self.surfaces.facets
        return f.places[e] + 0.5 * (1.0 + zeta) * f.lengths[e]

    # parts that are one body

    def _together(self, p, e, zeta, less):
        """True for points and facets of one beam, or of joined ones, near to each other."""
        # Closer by ``less`` (F,).
        f = self.surfaces.facets
        own, a = f.of[p], self._along(f.of[p], f.zeta[p])
        b, apart = self._along(e, zeta), APART * f.heights[e] - less[e]
        out = (f.members[own] == f.members[e]) & (f.chains[own] == f.chains[e]) & (
            np.abs(a - b) < apart)
        for i, s, j, r in self.joined:
            out |= (f.chains[own] == i) & (f.chains[e] == j) & (np.abs(a - s) < apart) & (
                np.abs(b - r) < apart)
        return out

    def _along(self, e, zeta):
        """Where points of facets are along the axis."""
        f = self.surfaces.facets
        return f.places[e] + 0.5 * (1.0 + zeta) * f.spans[e]

    def _axes(self, z, parts):
        """Ends (n, 2) of short segments of the axes of beams, their chains, places and members."""
        f = self.surfaces.facets
        bottom, top = (np.flatnonzero((f.spans > 0.0) & (f.sides == side)) for side in (-1, 1))
        n, zeta = parts + 1, np.linspace(-1.0, 1.0, parts + 1)
        e, at = np.repeat(bottom, n), np.tile(zeta, len(bottom))
        x = 0.5 * (self.surfaces.along(e, at, 0, z) + self.surfaces.along(
            np.repeat(top, n), at, 0, z)).reshape(-1, n)
        s = self._along(e, at).reshape(-1, n)
        e = np.repeat(bottom, parts)
        return (np.column_stack([x[:, :-1].ravel(), x[:, 1:].ravel()]), f.chains[e],
                0.5 * (s[:, :-1] + s[:, 1:]).ravel(), f.members[e])

    def _joined(self, solids):
        """Chains and places on them, two each, where axes meet in the reference configuration."""
        # Or where axes are in ``solids``, pairs of a member's number and a function of places.
        ends, chains, s, _ = axes = self._axes(np.zeros(self.surfaces.facets.dofs.max() + 1), FINE)
        out, f, near = [], self.surfaces.facets, JOINED * self.height
        for k, contains in solids:
            inside = contains(ends.mean(axis=1)) | contains(ends[:, 0]) | contains(ends[:, 1])
            other = f.chains[np.argmax(f.members == k)]
            out += [(i, a, other, 0.0) for i, a in zip(chains[inside], s[inside])]
        if not len(ends):
            return _thinned(out, self.height)
        i, j = self._close(axes, near)
        met = _distance(ends[i], ends[j]) < near
        for a, b in zip(i[met], j[met]):
            out += [(chains[a], s[a], chains[b], s[b]), (chains[b], s[b], chains[a], s[a])]
        return _thinned(out, self.height)

    def _close(self, axes, near):
        """Pairs of segments of axes that may be as near, and are not parts of one body."""
        ends, chains, s, members = axes
        middle, half = ends.mean(axis=1), 0.5 * np.abs(ends[:, 1] - ends[:, 0])
        tree = scipy.spatial.cKDTree(np.column_stack([middle.real, middle.imag]))
        i, j = tree.query_pairs(2.0 * half.max() + near, output_type="ndarray").T
        apart = APART * self.height + 2.0 * (half[i] + half[j])
        some = self.allowed[members[i], members[j]] & (
            (chains[i] != chains[j]) | (np.abs(s[i] - s[j]) > apart))
        return i[some], j[some]

    def crossed(self, z: Array) -> complex | None:
        """A place where axes cross, or None."""
        ends, chains, s, _ = axes = self._axes(z, COARSE)
        if not len(ends):
            return None
        i, j = self._close(axes, 0.0)
        met = crossing(ends[i], ends[j])
        i, j, apart = i[met], j[met], 2.0 * APART * self.height
        for a, r, b, q in self.joined:
            known = (chains[i] == a) & (chains[j] == b) & (np.abs(s[i] - r) < apart) & (
                np.abs(s[j] - q) < apart)
            i, j = i[~known], j[~known]
        return ends[i[0]].mean() if len(i) else None


    def entered(self, z0: Array, z1: Array) -> complex | None:
        """A place where an axis, or the middle of a solid, enters a solid, z0 to z1, or None."""
        f, (ends, chains, s, members) = self.surfaces.facets, self._axes(z0, COARSE)
        solid = np.flatnonzero(~np.isin(f.members, members))  # edges of bodies and domains
        if not len(solid):
            return None
        sides = [np.array([self.surfaces.along(solid, np.full(len(solid), end), 0, z)
                           for end in (-1.0, 1.0)]) for z in (z0, z1)]
        known = np.unique(f.members[solid])
        middles = [np.array([x[:, f.members[solid] == k].mean() for k in known]) for x in sides]
        a, b = (np.append(x.mean(axis=1), y) for x, y in zip(
            (ends, self._axes(z1, COARSE)[0]), middles))
        first = np.array([f.chains[solid[f.members[solid] == k][0]] for k in known], int)
        chains, s = np.append(chains, first), np.append(s, 0.0 * known)
        members = np.append(members, known)
        # near enough to its edge on the way, not joined to it
        (c0, d0), (c1, d1) = sides
        low, high = (np.array([g(a.real, b.real), g(a.imag, b.imag)])[:, :, None]
                     for g in (np.minimum, np.maximum))
        edges = np.array([c0, d0, c1, d1])
        edges = np.array([edges.real, edges.imag])
        may = np.all((low <= edges.max(axis=1)[:, None]) & (high >= edges.min(axis=1)[:, None]),
                     axis=0)
        p, e = np.nonzero(may & self.allowed[members[:, None], f.members[solid]])
        for i, r, j, _ in self.joined:
            some = (chains[p] == i) & (f.chains[solid[e]] == j) & (
                np.abs(s[p] - r) < 2.0 * APART * self.height)
            p, e = p[~some], e[~some]
        # times at which the point, and both ends of the edge, lie in a line
        u, v = (x[p] - c[e] for x, c in ((a, c0), (b, c1)))
        g, h = ((d - c)[e] for c, d in sides)
        k0, k2 = cross(g, u), cross(h - g, v - u)
        k1 = cross(g, v - u) + cross(h - g, u)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(k1 * k1 - 4.0 * k2 * k0)
            far = -0.5 * (k1 + np.copysign(root, k1))
            for t in (far / k2, k0 / far):
                edge, way = g + t * (h - g), u + t * (v - u)
                share = dot(edge, way) / np.abs(edge) ** 2
                inward = f.sides[solid[e]] * (k1 + 2.0 * t * k2) < 0.0
                hit = (t >= 0.0) & (t <= 1.0) & (share >= 0.0) & (share <= 1.0) & inward
                if np.any(hit):
                    n = int(np.argmax(hit))
                    return a[p[n]] + t[n] * (b - a)[p[n]]
        return None


def crossing(a: Array, b: Array) -> Array:
    """True where segments a and b (n, 2) cross, at an angle that is no round-off."""
    u, v, w = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], b[:, 0] - a[:, 0]
    size = cross(u, v)
    size = np.where(np.abs(size) > PARALLEL * np.abs(u) * np.abs(v), size, np.nan)
    s, r = cross(w, v) / size, cross(w, u) / size
    return (s > 0.0) & (s < 1.0) & (r > 0.0) & (r < 1.0)


def _distance(a, b):
    """The least distance of segments (n, 2)."""
    out = np.where(crossing(a, b), 0.0, np.inf)
    for p, q in ((a, b), (b, a)):
        way = q[:, 1] - q[:, 0]
        for k in (0, 1):
            d = p[:, k] - q[:, 0]
            share = np.clip(dot(way, d) / np.abs(way) ** 2, 0.0, 1.0)
            out = np.minimum(out, np.abs(d - share * way))
    return out


def _thinned(spots, height):
    """Spots without those of nearly equal places."""
    return list({(i, round(2.0 * s / height), j, round(2.0 * r / height)): (i, s, j, r)
                 for i, s, j, r in spots}.values())
