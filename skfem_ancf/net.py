"""Lines between points of the plane: what a frame is made of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import scipy

from .errors import (FileError, InputError, MeshError, NameUnknown, ask, ask_field,
                     require_finite, require_integer, require_label, require_path, shown)
from .lines import Axes, MeshLines, heights_of_chains
from .mesh import MeshBeam
from .places import is_point, points_of_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from .curve import Curve
    from .types import Array

#: How far from a node a point may be that names it, relative to the size of the net.
NEAR = 1e-9
PLACES = ("the name of nodes, the number of a node, a point as a tuple (x, y), a function of the "
          "points x that returns truth values, or a list of these")


class Net:
    """Points, lines between them, and names for both.

    Parameters
    ----------
    points
        Pairs (x, y): a list, or an array of shape (n, 2).
    lines
        Pairs of numbers of the points that each line joins: a list, or an array of shape (m, 2).
    groups
        Numbers of lines by name; a line is in one group at most.
    nodes
        Numbers of points by name.
    curves
        By the number of a line a function of parameters s (k,), from 0 to 1, that returns points
        (2, k) of its axis.

    Attributes
    ----------
    points, lines
        Shapes (2, n) and (2, m).
    groups, nodes : dict
        Numbers of lines and of points by name.
    curves : dict
        Functions by number of line.
    """

    def __init__(self, points: Any, lines: Any, groups: Mapping[str, Any] | None = None,
                 nodes: Mapping[str, Any] | None = None,
                 curves: Mapping[int, Callable[[Array], Any]] | None = None) -> None:
        self.points = _pairs("points", points).astype(float)
        self.lines = _numbers("lines", lines)
        n, m = self.points.shape[1], self.lines.shape[1]
        self.groups = _named("group", "lines", groups, m)
        self.nodes = _named("name", "nodes", nodes, n)
        self.curves = {require_integer("the number of a line in curves", k, 0, m - 1): curve
                       for k, curve in mapping_of("curves", curves).items()}
        self._require_lines()
        self._require_apart()
        taken = np.zeros(m, dtype=int)
        for name, some in self.groups.items():
            if np.any(taken[some]):
                k = some[np.argmax(taken[some])]
                first = next(other for other in self.groups if k in self.groups[other])
                raise InputError(f"line {k} is in the groups {first!r} and {name!r}: a group is a "
                                 "beam of its own, so a line is in one at most")
            taken[some] = 1

    def _require_lines(self):
        n, (a, b) = self.points.shape[1], self.lines
        bad = np.flatnonzero((np.minimum(a, b) < 0) | (np.maximum(a, b) >= n))
        if len(bad):
            k = int(bad[0])
            raise MeshError(f"line {k} joins the points {self.lines[:, k].tolist()}, which are "
                            f"numbered 0 to {n - 1}")
        for k in np.flatnonzero(a == b):
            raise MeshError(f"line {k} has no length: it joins the point {a[k]} to itself")
        key = np.sort(self.lines, axis=0)
        _, first, which = np.unique(key, axis=1, return_index=True, return_inverse=True)
        again = np.flatnonzero(first[np.ravel(which)] != np.arange(len(a)))
        straight = [k for k in again if not {int(k), int(first[np.ravel(which)[k]])}
                    & set(self.curves)]
        for k in straight:
            raise MeshError(f"lines {first[np.ravel(which)[k]]} and {k} are the same: both join "
                            f"the points {key[:, k].tolist()}; remove one, or give one of them a "
                            "curve")
        alone = np.setdiff1d(np.arange(n), self.lines)
        if len(alone):
            raise MeshError(f"the point {alone[0]} at {_at(self.points[:, alone[0]])} is in no "
                            "line: remove it, or join it to another point")

    def _require_apart(self):
        """No two points at one place: lines would look joined there and not be."""
        for i, j in sorted(scipy.spatial.cKDTree(self.points.T).query_pairs(NEAR * self.size)):
            raise MeshError(f"the points {i} and {j} are both at {_at(self.points[:, i])}: lines "
                            "that end there would not be joined; let them end at one point, with "
                            "hinges where they may turn")

    @property
    def size(self) -> float:
        """Largest extent of the points."""
        return float(np.max(np.ptp(self.points, axis=1)))

    def nodes_at(self, place: Any) -> Array:
        """Numbers of the nodes at a place, shape (k,), k >= 1.

        Parameters
        ----------
        place
            The name of nodes, the number of a node, a point as a tuple (x, y), a function of the
            points x (2, n) that returns n truth values, an array of numbers, an array of points
            (k, 2), or a list of these.

        Raises
        ------
        NameUnknown
            If a name is not known.
        MeshError
            If there is no node at the place.
        InputError
            If it is no place.
        """
        n, place = self.points.shape[1], points_of_rows(place)
        if isinstance(place, str):
            if place not in self.nodes:
                raise NameUnknown("name of nodes", place, self.nodes)
            return self.nodes[place]
        if is_point(place) and not isinstance(place, list):
            return self._node_near(place)
        if isinstance(place, (int, np.integer)) and not isinstance(place, bool):
            return np.array([require_integer("the number of a node", place, 0, n - 1)])
        if callable(place):
            chosen = np.asarray(ask("the function that names nodes, of x,", place, self.points))
            if chosen.shape != (n,) or chosen.dtype != bool:
                raise InputError("a function that names nodes takes points x of shape (2, n) and "
                                 f"returns n truth values, as lambda x: x[1] == 0; for n = {n} it "
                                 f"returned {chosen.dtype} of shape {chosen.shape}")
            if not np.any(chosen):
                raise MeshError(f"the function {place!r} selects none of the {n} nodes")
            return np.flatnonzero(chosen)
        if isinstance(place, (list, tuple, set, frozenset)) and len(place) or (
                isinstance(place, np.ndarray) and place.ndim == 1 and len(place)):
            return np.unique(np.concatenate([self.nodes_at(one) for one in place]))
        raise InputError(f"a place of a frame is {PLACES}, got {shown(place)}")

    def _node_near(self, place):
        x = require_finite("the point", place, (2,))
        off = np.hypot(*(self.points - x[:, None]))
        k = int(np.argmin(off))
        if off[k] > 1e3 * NEAR * self.size:
            raise MeshError(f"no node of the frame is at {_at(x)}: the nearest is number {k} at "
                            f"{_at(self.points[:, k])}")
        return np.array([k])

    def lines_of(self, given: Any) -> Array:
        """Numbers of lines, shape (k,), from the name of a group, a number, or a list of these.

        Parameters
        ----------
        given
            As above.
        """
        if isinstance(given, str):
            if given not in self.groups:
                raise NameUnknown("group of lines", given, self.groups)
            return self.groups[given]
        if isinstance(given, (list, tuple, np.ndarray)):
            return np.unique(np.concatenate([self.lines_of(one) for one in given]))
        return np.array([require_integer("the number of a line", given, 0,
                                         self.lines.shape[1] - 1)])

    def mesh(self, lines: Array, elements: Array, height: Any) -> MeshBeam:
        """A mesh with a chain of elements for each of some lines, in their order.

        Parameters
        ----------
        lines
            Their numbers, shape (k,).
        elements
            How many each of all lines is divided into, shape (m,).
        height
            Of the section: a number, a function of parameters s (n,) from 0 to 1 along each line
            that returns heights (n,), or a list with one of these for each of the lines.
        """
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
            arc = self._arc(int(lines[k]), int(n[k]),
                            height[k] if isinstance(height, list) else height)
            p[:, nodes], tangent[:, nodes], turning[:, nodes] = arc.p, arc.p_X, arc.p_XY
            lengths[np.searchsorted(left, nodes[:-1])] = arc.lengths
            arcs[k] = cast("Curve", arc.curve)
        s, t = 2 * line + s, np.array([left, left + 1])
        largest, heights, taper = heights_of_chains(height, s, t, lines)
        mesh = MeshLines(np.ascontiguousarray(p), t, height=largest, heights=heights, taper=taper,
                         p_X=tangent, p_Y=np.array([0.0 - tangent[1], tangent[0]]),
                         lengths=lengths, p_XY=turning, s=s,
                         curve=cast("Curve", Axes(arcs, a, d)) if arcs else None)
        mesh._boundaries = mesh._build_default_tags()
        return mesh

    def _arc(self, k, n, height):
        curve, ends = self.curves[k], self.points[:, self.lines[:, k]]
        found = ask_field(f"the curve of line {k} of s", lambda x: curve(x[0]),
                          np.array([[0.0, 1.0]] * 2))
        if np.max(np.abs(found - ends)) > 1e3 * NEAR * self.size:
            raise MeshError(f"the curve of line {k} runs from {_at(found[:, 0])} to "
                            f"{_at(found[:, 1])}, its points are at {_at(ends[:, 0])} and "
                            f"{_at(ends[:, 1])}: a curve is a function of s from 0 to 1")
        return MeshBeam.init_curve(curve, np.linspace(0.0, 1.0, n + 1), height)


def mapping_of(name: str, given: Any) -> Mapping[Any, Any]:
    """A dict that was given, or an empty one for None.

    Parameters
    ----------
    name
        What messages call it.
    given
        What was given.
    """
    if given is not None and not isinstance(given, Mapping):
        raise InputError(f"{name} must be a dict, got {shown(given)}")
    return given or {}


def _pairs(what, values):
    """Pairs, each a row, as an array (2, n)."""
    found = require_finite(what, list(values) if _is_iterable(values) else values)
    if found.ndim != 2 or found.shape[1] != 2 or not len(found):
        hint = "; give its transpose" if found.ndim == 2 and len(found) == 2 else ""
        raise InputError(f"{what} are pairs, one at least: a list of pairs or an array of shape "
                         f"(n, 2), got {shown(values)} of shape {found.shape}{hint}")
    return found.T


def _is_iterable(values):
    return hasattr(values, "__iter__") and not isinstance(values, (np.ndarray, str, Mapping))


def _numbers(what, values):
    out = _pairs(what, values)
    if np.any(out != np.floor(out)):
        raise InputError(f"{what} are numbers of points, got {shown(values)}")
    return out.astype(np.int64)


def _named(kind, what, given, n):
    """Numbers by name."""
    out = {}
    for name, numbers in mapping_of(f"{kind}s of {what}", given).items():
        if require_label(f"a {kind} of {what}", name) is None:
            raise InputError(f"a {kind} of {what} is a text, got None")
        found = require_finite(f"the numbers of {what} of {name!r}", numbers)
        if found.ndim != 1 or not len(found) or np.any(found != np.floor(found)):
            raise InputError(f"{name!r} must hold numbers of {what}, got {shown(numbers)}")
        found = np.unique(found).astype(np.int64)
        if found[0] < 0 or found[-1] >= n:
            raise MeshError(f"{name!r} holds the number {found[0] if found[0] < 0 else found[-1]}: "
                            f"the {what} are numbered 0 to {n - 1}")
        out[name] = found
    return out


def _at(x):
    return f"({x[0]:.9g}, {x[1]:.9g})"


def net_from_meshio(mesh: Any) -> Net:
    """The lines of a mesh of meshio, each cell one, with its names.

    Parameters
    ----------
    mesh
        A ``meshio.Mesh``, or a file that meshio reads: Gmsh's ``.msh``, ``.vtu`` and others. Cells
        "line" are straight, "line3" are parabolas through their three points; cells "vertex" give
        names to nodes.

    Raises
    ------
    FileError
        If the file cannot be read.
    MeshError
        If it holds no lines, or points off the plane z = 0.
    """
    import meshio

    if isinstance(mesh, (str, Path)):
        path = require_path("mesh", mesh)
        try:
            mesh = meshio.read(path)
        except (Exception, SystemExit) as error:  # meshio ends the process where it knows no format
            raise FileError(f"{path} cannot be read as a mesh: {error}") from None
    if not isinstance(mesh, meshio.Mesh):
        raise InputError(f"mesh must be a meshio.Mesh or the name of a file, got {shown(mesh)}")
    points = require_finite("the points of the mesh", mesh.points)
    blocks = {k: block for k, block in enumerate(mesh.cells) if block.type in ("line", "line3")}
    if not blocks:
        raise MeshError("the mesh has no lines: its cells are "
                        f"{sorted({block.type for block in mesh.cells}) or 'none'}")
    cells = np.concatenate([block.data[:, :2] for block in blocks.values()]).astype(np.int64)
    used, lines = np.unique(cells, return_inverse=True)
    if points.shape[1] > 2 and np.any(points[used, 2:] != 0.0):
        k = int(used[np.argmax(np.abs(points[used, 2]))])
        raise MeshError(f"the point {k} of the mesh is at z = {points[k, 2]:.9g}: a frame lies in "
                        "the plane z = 0")
    first = dict(zip(blocks, np.cumsum([0] + [len(b.data) for b in blocks.values()])))
    curves = {}
    for k, block in blocks.items():
        if block.type == "line3":
            for i, cell in enumerate(block.data):
                curves[int(first[k]) + i] = _Parabola(points[cell, :2].T)
    groups, nodes = _names(mesh, blocks, first, used)
    return Net(points[used, :2], lines.reshape(-1, 2), groups, nodes, curves)


def _names(mesh, blocks, first, used):
    """Names of lines and of nodes from cell sets, point sets, and physical groups of Gmsh."""
    sets = {name: parts for name, parts in mesh.cell_sets.items()
            if not name.startswith("gmsh:")} or _numbered(mesh)
    groups, nodes = {}, {}
    where = {int(k): i for i, k in enumerate(used)}
    for name, parts in sets.items():
        some = [first[k] + np.asarray(part, dtype=np.int64) for k, part in enumerate(parts)
                if k in blocks and part is not None and len(part)]
        if some:
            groups[name] = np.concatenate(some)
        at = [where[int(p)] for k, part in enumerate(parts)
              if mesh.cells[k].type == "vertex" and part is not None
              for p in np.ravel(mesh.cells[k].data[part]) if int(p) in where]
        if at:
            nodes[name] = np.array(at)
    for name, part in mesh.point_sets.items():
        at = [where[int(p)] for p in np.ravel(part) if int(p) in where]
        if at:
            nodes[name] = np.array(at)
    return groups, nodes


def _numbered(mesh):
    """Cell sets that a file has as numbers: physical groups, or what meshio writes of names.

    Into formats without names it writes data called "a-b", which are 0 in the set a, 1 in b.
    """
    sets = {}
    names = {int(number): name for name, (number, _) in mesh.field_data.items()}
    for key, parts in mesh.cell_data.items():
        found = np.unique(np.concatenate([np.ravel(part) for part in parts]))
        if key == "gmsh:physical":
            known = {int(k): names.get(int(k), str(int(k))) for k in found if k}
        elif found.dtype.kind in "iu" and ":" not in key and -1 <= found[0] and (
                found[-1] < len(key.split("-"))):
            known = dict(enumerate(key.split("-")))
        else:
            continue
        for number, name in known.items():
            sets[name] = [np.flatnonzero(np.ravel(part) == number) for part in parts]
    return sets


class _Parabola:
    """The parabola through two ends and a point between them, at s = 0, 1 and 1/2."""

    def __init__(self, points: Array) -> None:
        self.points = points

    def __call__(self, s: Array) -> Array:
        a, b, c = self.points.T[:, :, None]
        return (a * (1 - s) * (1 - 2 * s) + b * s * (2 * s - 1) + 4 * c * s * (1 - s))
