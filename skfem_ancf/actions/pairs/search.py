"""The broad search: which points may touch which facets."""

from collections.abc import Iterator, Sequence
from copy import copy
from math import comb
from typing import Any

import numpy as np
import scipy

from ...core import Array, Packed, cached_property, gauss_lobatto, handle_of
from ..contact.pairs import (APART, EDGE, ON, OPPOSED, SAME, SKIN, Candidates, Groups, PairTables,
                             Seeds, along as polynomials, facing, may_touch, together)
from ..contact.points import cross, dot
from ..contact.stretches import ALONG, Cut, Rows
from ..contact.tables import weights_of_motion
from .facets import Facets

#: Distance of seeds along facets, largest number on a facet; distances in heights for which a list
#: of candidates is enough that are tried where nothing is near.
SEEDS, MOST, SKINS = 1.2, 10, (2.0, 5.0, 12.0, 30.0, 75.0)
#: Distance of axes that are joined, in heights; parts of an element in which they are searched.
JOINED, FINE = 1e-3, 8
#: No candidates.
_NONE = np.zeros(0, np.int64)
NOBODY = Candidates(_NONE, _NONE, np.zeros(0), _NONE)
#: Sine of the angle of parallel segments.
PARALLEL = 1e-6
#: How much further points between those of a rule may move.
BETWEEN = 1.1
#: Parts of an element in which crossing axes are searched.
COARSE = 2


def displaced(curve: tuple[Array, Array], dofs: Array, z: Array) -> Array:
    """What :meth:`Surfaces.curve` returns for facets with DOFs (n, B), at displacements z, (n,)."""
    weights, start = curve
    return start + np.einsum("nb,nb->n", weights, z[dofs])


class Surfaces:
    """The facets of a scene, with the weights of the points of their surfaces."""

    def __init__(self, facets: Facets) -> None:
        self.facets = f = facets
        self._weights = f.weights.transpose(2, 0, 1)
        self.points = [self.curve(f.of, f.zeta, order) for order in (0, 1)]
        self.shift = (f.sides * f.offsets)[f.of]
        self.dofs = f.dofs[f.of]

    def curve(self, e: Array, zeta: Array, order: int) -> tuple[Array, Array]:
        """Weights (n, B) and constant part (n,) of a derivative of facets by zeta."""
        return (polynomials(self._weights, e, zeta[:, None])[order],
                polynomials(self.facets.starts.T, e, zeta)[order])

    def weights(self, e: Array, zeta: Array) -> tuple[Array, Array]:
        """Weights of places and slopes of facets, (B, n) each."""
        place, slope, _ = polynomials(self._weights, e, zeta[:, None])
        return place.T, slope.T

    def along(self, e: Array, zeta: Array, order: int, z: Array) -> Array:
        """A derivative of facets by zeta at displacements z, (n,)."""
        return displaced(self.curve(e, zeta, order), self.facets.dofs[e], z)

    def outside(self, z: Array) -> tuple[Array, Array]:
        """Points of the surfaces and their outer normals, (P,) each."""
        r, t = (displaced(curve, self.dofs, z) for curve in self.points)
        n = 1j * t / np.abs(t)
        return r + self.shift * n, self.facets.sides[self.facets.of] * n


def packed(x: Array, kind: Any) -> Array:
    """A contiguous array of a kind."""
    return np.ascontiguousarray(x, dtype=kind)


#: Sections extend along d by no more than the height, or ends of cables by this part of it, times
#: the stretch, of which slopes of the element, and mean ones of its neighbours, have EVEN or more.
#: In elements shorter than LONG heights by no more than without stretch.
THIN, EVEN, LONG, TINY = 0.55, 0.82, 1.85, 1e-12


def stretches_of(f: Facets, touch: Array, facets: Facets, moves: Array, places: Array
                 ) -> tuple[Array, Rows]:
    """Beams that may touch themselves, cut into stretches that cannot: of ``facets`` their element
    of such beams, or -1, (F,), and the :class:`~skfem_ancf.actions.contact.stretches.Rows`.

    Parameters
    ----------
    f
        The facets of the beams, before corners are rounded.
    touch
        True for members that may touch themselves, (M,).
    moves, places
        Weights (2, n) of degrees of freedom in the motion of points, and True for those that are
        places, (n,).
    """
    if not touch.any():
        i, c, x = np.zeros((2, 0), np.int64), np.zeros((2, 0), complex), np.zeros(0)
        return np.full(len(facets.sides), -1), Rows(i, c, c[0], x, x, i[0], i[0], 1)
    n, own = f.starts.shape[1], touch[f.members]
    bottom, top = (np.flatnonzero(own & (f.spans > 0.0) & (f.sides == side))
                   for side in (-1, 1))
    chains, far = f.chains[bottom], 1.0 + np.max(f.places + f.spans)
    along = chains * far + f.places[bottom]
    of, at = (np.where(touch[g.members], np.searchsorted(
        along, g.chains * far + g.places + 0.5 * g.spans, "right") - 1, -1)
        for g in (facets, f))
    # control points of polynomials and of their slopes, (n, F, B + 1)
    C = np.concatenate([f.weights, f.starts[:, None]], axis=1)
    points = _controls(n, C)
    slopes = _controls(n - 1, C[..., 1:] * np.arange(1.0, n))
    deep = f.offsets[bottom] == 0.0
    ends = np.flatnonzero(own & (f.spans == 0.0))
    last, right = at[ends], f.places[ends] > f.places[bottom[at[ends]]]
    # sections, and ends from both corners, which must not go back along d
    most = np.where(deep, 1.0, THIN) * f.heights[bottom]
    across, parts = points[:, top[deep]] - points[:, bottom[deep]], list[Any]()
    backward = [(bottom[deep], across), (bottom[deep], -across)]
    for side in (bottom, top):
        corner = np.where(right[:, None], points[-1, side[last]], points[0, side[last]])
        backward.append((bottom[last], np.where(right[:, None], 1.0, -1.0) * (
            points[:, ends] - corner)))
    for e in (bottom, top[deep]):
        parts.append((slopes[:, e], e, 0.5 * ALONG * f.spans[e]))
    # they may be as large as the beam is stretched there, if it is nearly as much nearby
    e = bottom[np.union1d(np.flatnonzero(deep), last)]
    mean = np.mean(slopes, axis=0)
    near = slopes[:, e] - EVEN * mean[e], mean[e] - EVEN * slopes[[0, -1]][:, e]
    parts.append((np.concatenate(near), e, TINY * f.spans[e]))
    for e, x in backward:
        size, grows = most[at[e]], f.spans[e] > LONG * f.heights[e]
        parts.append((x + (grows * 2.0 * size / f.spans[e])[:, None] * mean[e], e, np.where(
            grows, TINY, -1.0) * size))
    # those of an element one after another
    x, e, least = (np.concatenate(y) for y in zip(*(
        (x.transpose(1, 0, 2).reshape(-1, C.shape[1]), np.repeat(e, len(x)),
         np.repeat(least, len(x))) for x, e, least in parts)))
    weights, dofs = np.abs(x[:, :-1]), f.dofs[e]
    sums = [np.sum(weights * own / np.maximum(most[dofs], TINY), axis=1)
            for most, own in zip(moves, (places[dofs], ~places[dofs]))]
    return of, Rows(packed(dofs.T, np.int64), packed(x[:, :-1].T, complex),
                    packed(x[:, -1], complex), packed(least, float),
                    packed(np.maximum(*sums), float), packed(at[e], np.int64),
                    packed(chains, np.int64), n - 1)


def _controls(n, C):
    """Control points of polynomials with n coefficients (..., n) on [-1, 1], (n, ...)."""
    x = gauss_lobatto(n)
    rise = 0.5 + 0.5 * x
    basis = np.array([comb(n - 1, k) * rise**k * (1.0 - rise) ** (n - 1 - k) for k in range(n)]).T
    return np.moveaxis(C @ np.linalg.solve(basis, np.vander(x, n, increasing=True)).T, -1, 0)


#: Largest number of parts of a chain, and of all but for one of each; largest turn of a part of a
#: beam that cannot touch itself, in radians, and its least stretch.
PARTS, ALL, ARC, LEAST = 32, 500, 1.4, 0.85


class Discs:
    """Discs around parts of chains, of several facets each; ``allowed`` (M, M) says which members
    may touch."""

    def __init__(self, t: PairTables, allowed: Array) -> None:
        order = np.lexsort((t.places, t.chains))
        chains, members, spans = t.chains[order], t.members[order], t.spans[order]
        sizes = np.unique(chains, return_counts=True)[1]
        most = max(1, min(PARTS, ALL // len(sizes)))
        share = np.concatenate([np.arange(n) * min(n, most) // n for n in sizes])
        first = np.flatnonzero(np.diff(chains * PARTS + share, prepend=-1))
        self._first, self._last = first, np.append(first[1:], len(order))
        self._sizes = self._last - first
        self._of, self._tables = np.repeat(np.arange(len(first)), self._sizes), (
            t.dofs[:, order], np.ascontiguousarray(t.weights[:, :, order]), t.starts[:, order],
            t.offsets[order], 0.5 * LEAST * spans)
        i, j = np.triu_indices(len(first))
        some = allowed[members[first[i]], members[first[j]]]
        self._pairs = i, j = i[some], j[some]
        self._own = np.flatnonzero(chains[first[i]] == chains[first[j]])
        self._faces = np.flatnonzero((t.sides[order] < 0.0) & (spans > 0.0))
        self._follows = np.diff(chains[self._faces], prepend=-1) == 0

    def stay_apart(self, z: Array) -> Array:
        """True for straight ways between displacements (n + 1, N) on which no discs meet, but those
        of a beam that is bent too little between them, (n,)."""
        dofs, weights, c, offsets, least = self._tables
        for w, at in zip(weights, dofs):
            c = c + w * z[:, None, at]
        middle = np.add.reduceat(c[:, 0], self._first, axis=1) / self._sizes
        size = np.abs(c)
        radius = np.maximum.reduceat(np.max(np.abs(c[:, 0] - middle[:, self._of]) + size[
            :, 1:].sum(axis=1), axis=0) + offsets, self._first)
        (i, j), far = self._pairs, np.ones(len(self._pairs[0]), bool)
        # Parts of a chain between which it turns by less than ARC cannot touch each other, see
        # :mod:`skfem_ancf.actions.contact.stretches`.
        slope, turned = c[:, 1, self._faces], np.zeros((len(c), c.shape[2] + 1))
        more = np.tensordot(size[:, 2:, self._faces], np.arange(2, c.shape[1]), (1, 0))
        with np.errstate(invalid="ignore", divide="ignore"):
            within = 2.0 * np.arcsin(more / size[:, 1, self._faces])
        turned[:, 1 + self._faces[1:]] = self._follows[1:] * np.abs(np.angle(
            slope[:, 1:] * slope[:, :-1].conj()))
        turned = np.cumsum(turned, axis=1)
        turn = turned[:, self._last[j[self._own]]] - turned[:, self._first[i[self._own]] + 1]
        most = ARC - np.max(within, axis=1, initial=0.0)
        most[np.any(size[:, 1] < least, axis=1)] = 0.0
        far[self._own] = ~np.all(turn < most[:, None], axis=0)
        i, j = i[far], j[far]
        a = middle[:, i] - middle[:, j]
        way, a = a[1:] - a[:-1], a[:-1]
        along = np.clip(-(a * way.conj()).real / np.maximum(np.abs(way) ** 2, 1e-300), 0.0, 1.0)
        return np.all(np.abs(a + along * way) > radius[i] + radius[j], axis=1)


class Search:
    """Finds the facet that each point is nearest to.

    ``sharp`` are facets before corners are rounded; ``allowed`` (M, M) says which members may
    touch; ``solids`` are numbers of members without axes, and functions that say which places of
    the reference configuration are inside; ``numbers`` are stiffness or None, width of the
    transition in heights, and coefficient of friction. ``tables`` are those for kernels.
    """

    def __init__(self, surfaces: Surfaces, sharp: Facets, allowed: Array, solids: Sequence[Any],
                 numbers: tuple[float | None, float, float], places: Array) -> None:
        self.surfaces, self.allowed = surfaces, allowed
        f, ((N, _), (D, slope)) = surfaces.facets, surfaces.points
        n = int(f.dofs.max()) + 1
        self.weights = BETWEEN * weights_of_motion(
            np.abs(N) + 2.0 * np.abs(surfaces.shift / slope)[:, None] * np.abs(D), surfaces.dofs, n,
            places[surfaces.dofs])
        self.height = h = float(np.min(f.heights))
        m = int(np.clip(np.ceil(np.max(f.lengths) / (SEEDS * h)), 1, MOST))
        e, zeta = np.repeat(np.arange(len(f.sides)), m), np.tile(
            (2.0 * np.arange(m) + 1.0) / m - 1.0, len(f.sides))
        weights, at = surfaces.curve(e, zeta, 0)
        self._near = 0.6 * f.lengths / m + f.offsets
        self._seeds = zeta, Seeds(packed(e, np.int64), packed(f.dofs[e].T, np.int64), packed(
            weights.T, complex), packed(at, complex), float(np.max(self._near)))
        self.joined = self._joined(solids)
        elements, rows = stretches_of(sharp, np.diag(allowed), f, self.weights, places)
        parts = 2 + 2 * len(rows.chains)
        penalty, width, friction = numbers
        of_facets = {name: packed(getattr(f, name), kind) for kind, names in (
            (float, "sides offsets places lengths spans heights stiffness zeta areas"),
            (np.int64, "members chains curves of")) for name in names.split()}
        if penalty is not None:
            of_facets["stiffness"] = np.full(len(f.sides), penalty)
        self.tables = PairTables(
            used=np.arange(n), dofs=packed(f.dofs.T, np.int64),
            weights=packed(f.weights.transpose(1, 2, 0), complex),
            starts=packed(f.starts.T, complex), near=self._near, reach=packed(
                f.ends.clip(-1.0, 1.0).T * (1.0 + np.where(np.abs(f.ends) == 1.0, EDGE, ON).T),
                float),
            joined=packed(self.joined, float).reshape(-1, 4), begins=np.zeros(len(f.of)),
            opposed=np.where(np.arange(len(f.of)) < len(sharp.of), OPPOSED, SAME),
            point_dofs=packed(surfaces.dofs.T, np.int64), N=packed(N.T, complex),
            D=packed(D.T, complex), height=h, width=width * h, friction=friction, handle=0,
            found=np.zeros(3, np.int64), seen=np.zeros(n, complex), moves=self.weights,
            skin=np.zeros(1), seeds=self._seeds[1], groups=Groups(
                np.zeros(len(f.sides), np.int64), np.zeros(parts + len(allowed), np.int64),
                packed(elements, np.int64), allowed.astype(np.int64)), rows=rows,
            cut=Cut(np.zeros(max(len(rows.chains), 1), np.int64), np.ones(1, np.int64),
                    np.zeros((2, parts), np.int64), np.zeros(parts)), start=facing(0, 0, 0),
            start_at=np.zeros(0, complex), history=np.zeros(1), **of_facets)
        self.candidates = NOBODY
        self.fresh(False)

    def fresh(self, other: bool = True) -> "Search":
        """Search anew, or make a copy that does so."""
        one, t, n = copy(self) if other else self, self.tables, len(self.tables.seen)
        one.tables = t._replace(
            handle=handle_of(one), found=t.found.copy(), seen=np.zeros(n, complex),
            skin=np.zeros(1), start=facing(t.starts.shape[0], t.starts.shape[1], len(t.of)),
            start_at=np.full(n, np.nan + 0j),
            groups=t.groups._replace(of=t.groups.of.copy(), members=t.groups.members.copy()),
            cut=Cut(*(x.copy() for x in t.cut)))
        one.keep(one.candidates)
        return one

    @cached_property
    def discs(self) -> Discs:
        """Discs around parts of the members."""
        return Discs(self.tables, self.allowed)

    def keep(self, candidates: Candidates) -> None:
        """Let the tables have these candidates."""
        self.candidates, self._words = candidates, Packed(candidates)
        self.tables.found[0], self.tables.found[2] = self._words.address, 1

    def search(self, z: Array) -> None:
        """Find the :class:`Candidates` at displacements z, with their skin; the callback of
        kernels."""
        t, x, (zeta, seeds) = self.tables, self.surfaces.outside(z)[0], self._seeds
        y = displaced((seeds.weights.T, seeds.starts), seeds.dofs.T, z)
        known, skin = self._search(x, y, zeta, SKIN * self.height), SKIN
        for wider in SKINS if not len(known.p) else ():  # how far may it move unseen?
            wide = self._search(x, y, zeta, wider * self.height)
            if len(wide.p):
                break
            known, skin = wide, wider
        t.skin[0] = skin * self.height
        self.keep(known)

    def _search(self, x, y, zeta, skin):
        t, f, e = self.tables, self.surfaces.facets, self._seeds[1].e
        trees = [scipy.spatial.cKDTree(np.column_stack([a.real, a.imag])) for a in (x, y)]
        found = trees[0].sparse_distance_matrix(trees[1], t.seeds.widest + self.height + skin,
                                                output_type="ndarray")
        p, k, far = found["i"], found["j"], found["v"]
        which = (far < self._near[e[k]] + self.height + skin) & may_touch(
            t, t.groups.of[f.of[p]], t.groups.of[e[k]]) & ~together(t, p, e[k], zeta[k], 1.0)
        p, k, far = p[which], k[which], far[which]
        order = np.lexsort((far, e[k], p))
        p, k = p[order], k[order]
        first = np.append(True, (np.diff(p) != 0) | (np.diff(e[k]) != 0))[:len(p)]
        p, k = p[first], k[first]
        chain = f.chains[e[k]]
        group = np.unique(p * (1 + np.max(chain, initial=0)) + chain, return_inverse=True)[1]
        return Candidates(*(packed(x, y) for x, y in (
            (p, np.int64), (e[k], np.int64), (zeta[k], float), (group.ravel(), np.int64))))

    # parts that are one body

    def _axes(self, z, parts):
        """Ends (n, 2) of short segments of the axes of beams, their chains, places and members."""
        f = self.surfaces.facets
        bottom, top = (np.flatnonzero((f.spans > 0.0) & (f.sides == side)) for side in (-1, 1))
        n = parts + 1
        e, at = np.repeat(bottom, n), np.linspace(*f.ends[bottom].T, n).T.ravel()
        x = 0.5 * (self.surfaces.along(e, at, 0, z) + self.surfaces.along(
            np.repeat(top, n), at, 0, z)).reshape(-1, n)
        s = (f.places[e] + 0.5 * (1.0 + at) * f.spans[e]).reshape(-1, n)
        e = np.repeat(bottom, parts)
        return (np.column_stack([x[:, :-1].ravel(), x[:, 1:].ravel()]), f.chains[e],
                0.5 * (s[:, :-1] + s[:, 1:]).ravel(), f.members[e])

    def _joined(self, solids):
        """Chains and places on them, two each, where axes meet in the reference configuration."""
        # Or where axes are in ``solids``, pairs of a member's number and a function of places.
        f, out, near = self.surfaces.facets, [], JOINED * self.height
        ends, chains, s, _ = axes = self._axes(np.zeros(f.dofs.max() + 1), FINE)
        for k, contains in solids:
            inside = contains(ends.mean(axis=1)) | contains(ends[:, 0]) | contains(ends[:, 1])
            other = f.chains[np.argmax(f.members == k)]
            out += [(i, a, other, 0.0) for i, a in zip(chains[inside], s[inside])]
        if len(ends):
            i, j = pairs = self._close(axes, near)
            # where two segments are closest, from 0 to 1: at a crossing, or at an end of one
            met, *at = crossing(ends[i], ends[j])
            apart, at = np.where(met, 0.0, np.inf), np.where(met, at, 0.5)
            for one, other in ((0, 1), (1, 0)):
                start, path = ends[pairs[other], 0], np.diff(ends[pairs[other]])[:, 0]
                for k in (0, 1):
                    d = ends[pairs[one], k] - start
                    share = np.clip(dot(path, d) / np.abs(path) ** 2, 0.0, 1.0)
                    gap = np.abs(d - share * path)
                    less, apart = gap < apart, np.minimum(gap, apart)
                    at[one][less], at[other][less] = k, share[less]
            i, j = pairs = np.array(pairs)[:, apart < near]
            r, q = s[pairs] + (at[:, apart < near] - 0.5) * np.abs(np.diff(ends[pairs])[..., 0])
            out += [*zip(chains[i], r, chains[j], q), *zip(chains[j], q, chains[i], r)]
        # without those of nearly equal places
        h = self.height
        return list({(i, round(2.0 * s / h), j, round(2.0 * r / h)): (i, s, j, r)
                     for i, s, j, r in out}.values())

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

    def meetings(self) -> Iterator[tuple[complex, list[tuple[int, Array]]]]:
        """Where parts are taken for joined: the place, and members and DOFs of both."""
        # each place of two axes once, and all of an axis in a body together
        f, spots = self.surfaces.facets, dict[Any, list[Any]]()
        axial = f.spans > 0.0
        axes = set(f.chains[axial].tolist())
        for a, r, b, q in self.joined:
            if b not in axes:
                spots.setdefault((a, b), []).append(r)
            elif (a, r) <= (b, q):
                spots[a, b, r, q] = [r]

        def of_chain(chain: int, places: Sequence[float]) -> Array:  # those near places
            off = np.abs(np.subtract.outer(f.places + 0.5 * f.spans, places)).min(axis=1)
            return np.flatnonzero((f.chains == chain) & axial & (
                off <= 0.5 * f.spans + self.height))

        for (a, b, *at), places in spots.items():
            parts = [of_chain(a, places), of_chain(b, at[1:]) if at else np.flatnonzero(
                f.chains == b)]
            e = of_chain(a, places[:1])
            zeta = np.clip(2.0 * (places[0] - f.places[e]) / f.spans[e] - 1.0, -1.0, 1.0)
            x = self.surfaces.along(e, zeta, 0, np.zeros(f.dofs.max() + 1))
            yield x.mean(), [(int(f.members[e[0]]), np.unique(f.dofs[e])) for e in parts]

    def crossed(self, z: Array) -> complex | None:
        """A place where axes cross, or None."""
        ends, chains, s, _ = axes = self._axes(z, COARSE)
        if not len(ends):
            return None
        i, j = self._close(axes, 0.0)
        met = crossing(ends[i], ends[j])[0]
        i, j = i[met], j[met]
        apart = 2.0 * APART * self.height + 0.5 * np.abs(np.diff(ends)[:, 0])
        for a, r, b, q in self.joined:
            known = (chains[i] == a) & (chains[j] == b) & (np.abs(s[i] - r) < apart[i]) & (
                np.abs(s[j] - q) < apart[j])
            i, j = i[~known], j[~known]
        return ends[i[0]].mean() if len(i) else None

    def entered(self, z0: Array, z1: Array) -> complex | None:
        """A place where an axis, or the middle of a solid, enters a solid, z0 to z1, or None."""
        f = self.surfaces.facets
        solid = np.flatnonzero(~np.isin(f.members, f.members[f.spans > 0.0]))  # bodies, domains
        if not len(solid):
            return None
        ends, chains, s, members = self._axes(z0, COARSE)
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
                edge, path = g + t * (h - g), u + t * (v - u)
                share = dot(edge, path) / np.abs(edge) ** 2
                inward = f.sides[solid[e]] * (k1 + 2.0 * t * k2) < 0.0
                hit = (t >= 0.0) & (t <= 1.0) & (share >= 0.0) & (share <= 1.0) & inward
                if np.any(hit):
                    n = int(np.argmax(hit))
                    return a[p[n]] + t[n] * (b - a)[p[n]]
        return None


def crossing(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """True where segments a and b (n, 2) cross, at an angle that is no round-off, and where on
    them, from 0 to 1."""
    u, v, w = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], b[:, 0] - a[:, 0]
    size = cross(u, v)
    size = np.where(np.abs(size) > PARALLEL * np.abs(u) * np.abs(v), size, np.nan)
    s, r = cross(w, v) / size, cross(w, u) / size
    return (s > 0.0) & (s < 1.0) & (r > 0.0) & (r < 1.0), s, r
