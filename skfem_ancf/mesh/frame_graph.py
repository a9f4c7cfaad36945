"""The graph of a frame, lines between points of the plane, and meshes of its lines."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, cast

import numpy as np
import scipy

from ..core import (Array, InputError, MeshError, ModelWarning, ask_field, refuse, refuse_any,
                    require_finite, require_integer, require_label, require_moderate,
                    require_not_negative, require_option, require_unmasked, shown, warn)
from .curve import Curve
from .mesh_beam import MeshBeam
from .places import is_point, points_of_rows, satisfying
from .mapping import heights_of


# the mesh of the lines of a frame: several chains of elements


def chains_of(s: Array) -> tuple[Array, Array]:
    """Chain numbers of parameters (n,), from 2 k to 2 k + 1 on chain k, and those on the chains."""
    chain = np.floor(0.5 * s).astype(int)
    return chain, s - 2.0 * chain


class MeshLines(MeshBeam):
    """Chains of elements; ``s`` runs from 2 k to 2 k + 1 along chain k."""

    kind = "lines"

    @property
    def parameters(self) -> Array:
        """Parameter of each node on its local chain, from 0 to 1, shape (nvertices,)."""
        return chains_of(cast("Array", self.s))[1]

    def _heights_of(self, height):
        return heights_of_chains(height, self.s, self.t)


class Heights:
    """Height of chains: for each, or once for all, a number or a function of parameters in [0, 1].
    """

    def __init__(self, given: Sequence[float | Callable[[Array], Any]]) -> None:
        self.given = tuple(given)

    def __repr__(self) -> str:
        return ", ".join(map(shown, self.given))

    def __call__(self, s: Array) -> Array:
        (chain, local), out = chains_of(s), np.empty(len(s))
        if len(self.given) == 1:
            return _values(self.given[0], local)
        for k in np.unique(chain).tolist():
            here = chain == k
            out[here] = _values(self.given[k], local[here])
        return out


def _values(height, s):
    return height(s) if callable(height) else np.full(len(s), float(height))


def heights_of_chains(height: Any, s: Array, t: Array, numbers: Any = None
                      ) -> tuple[float, Array | None, Any]:
    """As :func:`~.mapping.heights_of`, for a number, a function, or a list for the chains."""
    chain, local = chains_of(s)
    if not isinstance(height, list):
        largest, heights, _ = heights_of(height, local, t)
        return largest, heights, None if heights is None else Heights([height])
    if not any(map(callable, height)) and len(set(height)) == 1:
        return heights_of(height[0], local, t)
    most, heights, of = 0.0, np.empty((4, t.shape[1])), chain[t[0]]
    for k, one in enumerate(height):
        try:
            largest, some, _ = heights_of(one, local, t[:, of == k])
        except (InputError, MeshError) as error:
            line = k if numbers is None else numbers[k]
            raise type(error)(f"line {line}: {error}") from None
        most, heights[:, of == k] = max(most, largest), largest if some is None else some
    return most, heights, Heights(height)


class Axes:
    """The axes of chains, as a :class:`Curve`: ``arcs`` by number; others straight along ``chord``.
    """

    def __init__(self, arcs: Mapping[int, Curve], start: Array, chord: Array) -> None:
        self.arcs, self.start, self.chord = dict(arcs), start, chord

    def _parts(self, s):
        chain, local = chains_of(s)
        return chain, local, [(arc, chain == k) for k, arc in self.arcs.items()
                              if np.any(chain == k)]

    def nodes(self, s: Array) -> tuple[Array, Array]:
        chain, s, parts = self._parts(s)
        chord = self.chord[:, chain]
        p, tangent = self.start[:, chain] + s * chord, chord / np.hypot(*chord)
        for arc, here in parts:
            p[:, here], tangent[:, here] = arc.nodes(s[here])
        return p, tangent

    def turning(self, s: Array) -> Array:
        _, s, parts = self._parts(s)
        out = np.zeros((2, len(s)))
        for arc, here in parts:
            out[:, here] = arc.turning(s[here])
        return out

    def lengths(self, a: Array, b: Array) -> Array:
        chain, x, parts = self._parts(a)
        y = b - 2 * chain
        out = (y - x) * np.hypot(*self.chord[:, chain])
        for arc, here in parts:
            out[here] = arc.lengths(x[here], y[here])
        return out

    def moved(self, A: Array, shift: Array) -> "Axes":
        return Axes({k: arc.moved(A, shift) for k, arc in self.arcs.items()},
                    A @ self.start + shift[:, None], A @ self.chord)


#: Tolerance for a point that selects a node, relative to the size of the graph.
NEAR = 1e-9
#: Default tolerance for merging points, relative to the size of the graph and to the longest line.
#: Pairs within :data:`CLOSE` times the tolerance cause a warning.
MERGED, OF_LONGEST, CLOSE = 1e-5, 1e-3, 10.0
PLACES = ("the name of nodes, the number of a node, a point as a tuple (x, y), a function of the "
          "points x that returns truth values, or a list of these")


class FrameGraph:
    """The graph of a frame: points, lines between them, and names for both. Arguments are those of
    :meth:`skfem_ancf.Frame.from_lines`; ``beams`` names the groups that are beams, ``lost`` points
    of a mesh that are not in the graph. ``points`` (2, n) that are merged have the same position,
    and ``lines`` (2, m) refer to the first of them, ``same`` (n,); ``given`` are lines as given,
    ``distinct`` those between distinct nodes."""

    def __init__(self, points: Any, lines: Any, groups: Mapping[str, Any] | None = None,
                 nodes: Mapping[str, Any] | None = None,
                 curves: Mapping[int, Callable[[Array], Any]] | None = None,
                 tol: float | None = None, beams: Sequence[str] | None = None,
                 lost: Mapping[str, int] | None = None) -> None:
        self.points = _pairs("points", points).astype(float)
        require_moderate("points", self.points)
        ends = _pairs("lines", lines)
        refuse(np.any(ends != np.floor(ends)), "lines are numbers of points, got {!r}", lines)
        self.lines = ends.astype(np.int64)
        n, m = self.points.shape[1], self.lines.shape[1]
        self.groups = _named("group", "lines", groups, m)
        self.nodes = _named("name", "nodes", nodes, n)
        self.curves = {require_integer("the number of a line in curves", k, 0, m - 1): curve
                       for k, curve in mapping_of("curves", curves).items()}
        self.given, self.lost = self.lines, dict(lost or {})
        a, b = self.lines
        refuse_any((np.minimum(a, b) < 0) | (np.maximum(a, b) >= n), "line {k} joins the points "
                   "{}, which are numbered 0 to {}", self.lines, n - 1, error=MeshError)
        refuse_any(a == b, "line {k} joins the point {} to itself", a, error=MeshError)
        refuse_any(~np.isin(np.arange(n), self.lines), "the point {k} at {:.9g} is in no line: "
                   "remove it, or join it to another point", self.points, error=MeshError)
        self._merge(tol)
        key = np.sort(self.lines[:, self.distinct], axis=0)
        _, first, which = np.unique(key, axis=1, return_index=True, return_inverse=True)
        first = first[np.ravel(which)]
        i, j = pair = np.array([self.distinct[first], self.distinct])
        refuse_any((i != j) & ~np.isin(pair, list(self.curves)).any(axis=0), "lines {} and {} are "
                   "the same: both join the points {}; remove one, or give one of them a curve",
                   i, j, np.sort(self.lines[:, j], axis=0), error=MeshError)
        # warn of nodes on a straight line between its ends: lines are joined at their
        # ends only
        some = np.setdiff1d(self.distinct, list(self.curves))
        a, b = (self.points[:, ends].T for ends in self.lines[:, some])
        half = 0.5 * np.hypot(*(b - a).T)
        used = np.unique(self.lines[:, self.distinct])
        found = scipy.spatial.cKDTree(self.points[:, used].T).query_ball_point(
            0.5 * (a + b), half * (1.0 - 1e-6))
        k = np.repeat(np.arange(len(some)), [*map(len, found)])
        node = used[np.concatenate([*found, []]).astype(int)]
        x, along = self.points[:, node].T - a[k], (b - a)[k] / (2.0 * half[k, None])
        on = np.abs(along[:, 0] * x[:, 1] - along[:, 1] * x[:, 0]) <= max(self.tol,
                                                                       NEAR * self.size)
        if np.any(on):
            node, line = node[on][0], some[k[on][0]]
            more = f", and {np.sum(on) - 1} other(s) likewise" if np.sum(on) > 1 else ""
            at = "({:.9g}, {:.9g})".format(*self.points[:, node])
            warn(f"the node {node} at {at} is on line {line} between its ends{more}, and not "
                 "joined to it: divide the line there if it should be", ModelWarning)
        self.beams = tuple(self.groups) if beams is None else tuple(beams)
        taken = np.full(m, -1)  # the number of the group of each line
        for name in self.beams:
            some = self.groups[name]
            refuse_any(taken[some] >= 0, "line {} is in the groups {!r} and {!r}: groups= names "
                       "the sets of a mesh that are beams", some,
                       np.array(self.beams)[taken[some]], name)
            taken[some] = self.beams.index(name)
            refuse(not np.any(np.isin(some, self.distinct)), "all lines of the group {!r} are "
                   "shorter than tol = {:.3g}", name, self.tol, error=MeshError)

    def _merge(self, tol):
        n, places = self.points.shape[1], self.points
        length = np.hypot(*(places[:, self.lines[1]] - places[:, self.lines[0]]))
        self.tol = require_not_negative("tol", tol, False) if tol is not None else float(min(
            MERGED * self.size, OF_LONGEST * np.max(length)))
        close = max(2.0 * self.tol, min(CLOSE * self.tol, OF_LONGEST * np.max(length)))
        tree = scipy.spatial.cKDTree(places.T)
        pairs = tree.query_pairs(max(close, NEAR * self.size), output_type="ndarray").reshape(-1, 2)
        pairs = pairs[np.lexsort(pairs.T[::-1])]
        apart = np.hypot(*(places[:, pairs[:, 0]] - places[:, pairs[:, 1]]))
        one = (apart <= self.tol * (1.0 + 1e-9)) & (self.tol > 0.0)
        refuse_any(apart[~one] <= NEAR * self.size, "the points {} and {} are both at {:.9g}: give "
                   "tol= to make them one", *pairs[~one].T, places[:, pairs[~one, 0]],
                   error=MeshError)
        joined = scipy.sparse.coo_array((np.ones(int(one.sum())), pairs[one].T), (n, n))
        _, label = scipy.sparse.csgraph.connected_components(joined, directed=False)
        _, first = np.unique(label, return_index=True)
        self.same = first[label]
        self.points, self.lines = places[:, self.same], self.same[self.given]
        self.distinct = np.flatnonzero(self.lines[0] != self.lines[1])
        # move the ends of curves to merged nodes
        for k, curve in self.curves.items():
            refuse(k not in self.distinct, "the ends of line {}, a curve, are one node: give "
                   "tol= below {:.3g}", k, self.tol, error=MeshError)
            shift = (self.points - places)[:, self.given[:, k]]
            if np.any(shift):
                self.curves[k] = partial(_moved, curve, shift)
        refuse(not len(self.distinct), "all lines are shorter than tol = {:.3g}", self.tol,
               error=MeshError)
        if tol is None:
            _warn_of(pairs[one], apart[one], f"are one node, as they are not farther apart than "
                     f"tol = {self.tol:.3g}: give tol= for another distance, tol=0 to keep them "
                     "apart")
        _warn_of(pairs[~one], apart[~one], "are different nodes, as they are farther apart than "
                 f"tol = {self.tol:.3g}: give a larger tol= if they should be one")

    @property
    def size(self) -> float:
        return float(np.max(np.ptp(self.points, axis=1)))

    def nodes_at(self, place: Any) -> Array:
        """Numbers (k,) of the nodes at one of :data:`PLACES`, at numbers or at points, k >= 1."""
        found = self.same[self.points_at(place)]
        return found if len(found) == 1 else np.unique(found)

    def points_at(self, place: Any) -> Array:
        """As :meth:`nodes_at`, with all given points that were merged into each node."""
        n = self.points.shape[1]
        if isinstance(place, (int, np.integer)) and not isinstance(place, bool):
            return np.array([require_integer("the number of a node", place, 0, n - 1)])
        require_unmasked("place", place)
        place = points_of_rows(place)
        if isinstance(place, str):
            refuse(place in self.lost, "{!r} contains the point {} of the mesh, which is not an "
                   "end of a line", place, self.lost.get(place), error=MeshError)
            require_option("name of nodes", place, {**self.nodes, **self.groups})
            if place in self.nodes:
                return self.nodes[place]
            return np.unique(self.given[:, self.groups[place]])
        if is_point(place) and not isinstance(place, list):
            x = require_finite("the point", place, (2,))
            off = np.hypot(*(self.points - x[:, None]))
            k = int(np.argmin(off))
            refuse(off[k] > 1e3 * NEAR * self.size, "no node of the frame is at {:.9g}: the "
                   "nearest is number {} at {:.9g}", x, k, self.points[:, k], error=MeshError)
            return np.array([k])
        if callable(place):
            chosen = satisfying(place, self.points, "nodes")
            refuse(not len(chosen), "the function {!r} selects none of the {} nodes", place, n,
                   error=MeshError)
            return chosen
        if isinstance(place, (list, tuple, set, frozenset)) and len(place) or (
                isinstance(place, np.ndarray) and place.ndim == 1 and len(place)):
            return np.unique(np.concatenate([self.points_at(one) for one in place]))
        raise InputError(f"a place of a frame is {PLACES}, got {shown(place)}")

    def lines_of(self, given: Any) -> Array:
        """Numbers of lines, shape (k,), from the name of a group, a number, or a list of these."""
        if isinstance(given, str):
            return self.groups[require_option("group of lines", given, self.groups)]
        if isinstance(given, (list, tuple, np.ndarray)):
            return np.unique(np.concatenate([self.lines_of(one) for one in given]))
        return np.array([require_integer("the number of a line", given, 0,
                                         self.lines.shape[1] - 1)])

    def mesh(self, lines: Array, elements: Array, height: Any) -> MeshBeam:
        """A mesh with a chain for each of the lines (k,), of ``elements`` (m,) for every line."""
        n = elements[lines]
        first = np.concatenate([[0], np.cumsum(n + 1)])
        line = np.repeat(np.arange(len(lines)), n + 1)
        s = (np.arange(first[-1]) - first[line]) / n[line]
        a, b = self.points[:, self.lines[:, lines]].transpose(1, 0, 2)
        d, size = b - a, np.hypot(*(b - a))
        p, tangent = a[:, line] + s * d[:, line], (d / size)[:, line]
        turning = np.zeros(p.shape)
        left = np.setdiff1d(np.arange(first[-1]), first[1:] - 1)
        lengths = (size / n)[line[left]]
        arcs: dict[int, Curve] = {}
        for k in map(int, np.flatnonzero(np.isin(lines, list(self.curves)))):
            nodes = np.arange(first[k], first[k + 1])
            number, x = int(lines[k]), np.array([a[:, k], b[:, k]]).T
            curve = self.curves[number]
            found = ask_field(f"the curve of line {number} of s",
                              lambda s, curve=curve: curve(s[0]),  # type: ignore[misc]
                              np.array([[0.0, 1.0]] * 2))
            refuse(np.max(np.abs(found - x)) > 1e3 * NEAR * self.size, "the curve of line {} runs "
                   "from {:.9g} to {:.9g} for s from 0 to 1, its points are at {:.9g} and {:.9g}",
                   number, *found.T, *x.T, error=MeshError)
            arc = MeshBeam.init_curve(curve, np.linspace(0.0, 1.0, int(n[k]) + 1),
                                      height[k] if isinstance(height, list) else height)
            p[:, nodes], tangent[:, nodes], turning[:, nodes] = arc.p, arc.p_X, arc.p_XY
            lengths[np.searchsorted(left, nodes[:-1])] = arc.lengths
            arcs[k] = cast("Curve", arc.curve)
        s, t = 2 * line + s, np.array([left, left + 1])
        return MeshLines._from_nodes(
            np.ascontiguousarray(p), t, tangent, lengths, heights_of_chains(height, s, t, lines), s,
            cast("Curve", Axes(arcs, a, d)) if arcs else None, turning)


def mapping_of(name: str, given: Any) -> Mapping[Any, Any]:
    """A dict, or an empty one for None."""
    refuse(given is not None and not isinstance(given, Mapping), "{} must be a dict, got {!r}",
           name, given)
    return given or {}


def _pairs(what, values):
    """Pairs in rows, as an array (2, n)."""
    rows = hasattr(values, "__iter__") and not isinstance(values, (np.ndarray, str, Mapping))
    found = require_finite(what, list(values) if rows else values)
    refuse(found.ndim != 2 or found.shape[1] != 2 or not len(found), "{} are pairs, shape (n, 2), "
           "got {!r} of shape {}{}", what, values, found.shape,
           "; give its transpose" * (found.ndim == 2 and len(found) == 2))
    return found.T


def _named(kind, what, given, n):
    out = {}
    for name, numbers in mapping_of(f"{kind}s of {what}", given).items():
        refuse(require_label(f"a {kind} of {what}", name) is None, "a {} of {} is a text, got None",
               kind, what)
        found = require_finite(f"the numbers of {what} of {name!r}", numbers)
        refuse(found.ndim != 1 or not len(found) or np.any(found != np.floor(found)),
               "{!r} must hold numbers of {}, got {!r}", name, what, numbers)
        out[name] = found = np.unique(found).astype(np.int64)
        refuse_any((found < 0) | (found >= n), "{!r} holds the number {}: the {} are numbered 0 to "
                   "{}", name, found, what, n - 1, error=MeshError)
    return out


def _warn_of(pairs, apart, what):
    """Warn of pairs (k, 2) of points close to each other."""
    if len(pairs):
        (i, j), d = pairs[0], apart[0]
        more = "" if len(pairs) == 1 else f", {len(pairs) - 1} other pair(s) likewise"
        warn(f"the points {i} and {j}, {d:.3g} apart{more}, {what}", ModelWarning)


def _moved(curve, shift, s):
    x, y = curve(s)
    (ax, bx), (ay, by) = shift
    return x + (1.0 - s) * ax + s * bx, y + (1.0 - s) * ay + s * by
