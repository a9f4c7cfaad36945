"""The nodes of a frame: connections between the ends of its lines, and settlements."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from scipy import sparse

from ...beam import Beam, Layout, direction
from ...core import Array, MeshError, cached_property, sample
from ...mesh.frame_graph import FrameGraph
from ..places import Vector
from ..symbols import Symbol, support
from .base import Joint

# prescribed displacements and rotations of the nodes of a frame

#: Components of a node's motion that can be fixed.
COMPONENTS = "x", "y", "angle"


class Settlements:
    """Prescribed displacements of supports along x and y, and rotations in radians: ``numbers`` (n,
    3) proportional to the load factor, or functions of time ``of`` a node and a component."""

    def __init__(self, numbers: Array, of: dict[tuple[int, int], Any] | None = None) -> None:
        self.numbers, self.of = numbers, of or {}
        #: whether nodes move along x and y and rotate
        self.moves = [bool(np.any(numbers[:, k])) or any(at == k for _, at in self.of)
                      for k in range(len(COMPONENTS))]

    def given(self, nodes: Array, k: int, by: float | Callable[[float], float]) -> "Settlements":
        """A copy with nodes displaced by a number or a function of time."""
        numbers, of = self.numbers.copy(), dict(self.of)
        numbers[nodes, k] = 0.0 if callable(by) else by
        for node in map(int, nodes):
            of.pop((node, k), None)
            if callable(by):
                of[node, k] = by
        return Settlements(numbers, of)

    def by(self, nodes: Array, k: int, times: Array) -> Array:
        """Displacements of nodes at some times, shape (n, m)."""
        out = np.multiply.outer(times, self.numbers[nodes, k])
        for (node, at), function in self.of.items():
            if at == k:
                out[:, np.searchsorted(nodes, node)] = sample(function, times, COMPONENTS[k], ())
        return out


#: Names of equations, of followers and of supports.
EQUATIONS = "force along x", "force along y", "moment"


class Nodes(Joint):
    """Ends that meet at a node share its position; rigid ends share its rotation, too.

    Of all chains of all beams in order, start and end; at each node the first rigid end, or else
    the first, is the ``leader``. The equations are ``r_leader - r = 0`` and ``g x g_leader = 0``
    with the section direction g relative to the reference configuration, as in
    :class:`~skfem_ancf.actions.joints.Weld`; then for supports of the leader ``r - r_0 = d`` and
    ``(cos a, sin a) x g = 0``. Linear solvers use unknowns of the nodes instead of the multipliers,
    see :mod:`skfem_ancf.equations.condensation`. ``nodes, hinged`` (ends,) are those of each end;
    ``fixed`` (number, 3) tells whether x, y and rotation are fixed, ``settlements`` how far they
    are displaced; ``lines`` (ends / 2,) are numbers in ``graph``. DOFs are those of ``positions``
    (ends, 2) and of section ``directions`` (2, ends, n) with ``weights`` (ends, n), padded with
    zeros.
    """

    constant = False

    def __init__(self, nodes: Array, hinged: Array, fixed: Array, graph: FrameGraph, lines: Array
                 ) -> None:
        self.nodes, self.hinged, self.fixed = nodes, hinged, fixed
        self.settlements = Settlements(np.zeros(fixed.shape))
        self.graph, self.lines = graph, lines
        # rigid ends come before hinged ones: the first of each node is its leader
        order = np.lexsort((np.arange(len(nodes)), hinged, nodes))
        _, first = np.unique(nodes[order], return_index=True)
        self.leaders = order[first]
        self.leader = self.leading(nodes)
        follows = self.leader != np.arange(len(nodes))
        self.followers = np.flatnonzero(follows)
        self.turned = np.flatnonzero(follows & ~hinged)
        #: whether a node has a rigid end, (number,)
        self.rigid = np.zeros(len(fixed), dtype=bool)
        self.rigid[nodes[~hinged]] = True

    @property
    def moving(self) -> bool:  # type: ignore[override]
        return any(self.settlements.moves)

    @property
    def turning(self) -> bool:
        return self.settlements.moves[2]

    def _shifts(self, times: Array) -> list[Array]:
        return [self.settlements.by(self.nodes[at], k, times)
                for k, at in enumerate(self.supported)]

    def leading(self, nodes: Array) -> Array:
        """Leading ends of nodes, shape (k,)."""
        return self.leaders[np.searchsorted(self.nodes[self.leaders], nodes)]

    def ends_at(self, layout: Layout, at: Any) -> list[tuple[int, int, bool]]:
        """Beam, node of its mesh, and whether it is hinged, of each end at a point; or none."""
        try:
            node = self.graph.nodes_at(tuple(map(float, at)))
        except MeshError:
            return []
        ends, first, out = np.flatnonzero(np.isin(self.nodes, node)), 0, []
        for k, beam in enumerate(layout.beams):
            here = chain_ends(beam).ravel()
            out += [(k, int(here[end - first]), bool(self.hinged[end]))
                    for end in ends if first <= end < first + len(here)]
            first += len(here)
        return out

    def bind(self, layout: Layout) -> None:
        #: leaders whose x, y and rotation are fixed
        self.supported = [self.leaders[on] for on in self.fixed[self.nodes[self.leaders]].T]
        self.supported[2] = self.supported[2][~self.hinged[self.supported[2]]]
        ends = (self.followers, self.followers, self.turned, *self.supported)
        self.equations = tuple(np.repeat(2 * EQUATIONS, list(map(len, ends))).tolist())
        positions, directions, weights, start = [], [], [], []
        for k, beam in enumerate(layout.beams):
            at, first = chain_ends(beam).ravel(), layout.offset(k)
            if beam.mesh.heights is None:  # all alike
                dofs, c = direction(beam, int(at[0]))
                dofs = dofs[:, None] + beam.nd * (at - at[0])[:, None]
                c = np.tile(c, (len(at), 1))
            else:
                found = [direction(beam, int(node)) for node in at]
                dofs, c = np.stack([a for a, _ in found], axis=1), np.array([b for _, b in found])
            q0 = beam.q0_local[dofs]
            start.append(np.sum(c * (q0[0] + 1j * q0[1]), axis=1))
            positions.append(first + at[:, None] * beam.nd + np.arange(2))
            directions.append(first + dofs)
            weights.append(c)
        n = max(c.shape[1] for c in weights)
        self.directions = np.concatenate([np.concatenate(
            [d, np.repeat(d[..., :1], n - d.shape[2], axis=2)], axis=2) for d in directions], 1)
        self.weights = np.concatenate([np.pad(c, ((0, 0), (0, n - c.shape[1]))) for c in weights])
        self.positions, self.start = np.concatenate(positions), np.concatenate(start)
        #: rotations to the frame of the reference configuration, as complex numbers
        self.frame = 1.0 / self.start

    def turns(self, u: Array) -> Array:
        """Section direction of each end relative to the reference configuration."""
        d = u[self.directions]
        return 1.0 + self.frame * np.sum(self.weights * (d[0] + 1j * d[1]), axis=1)

    def value(self, u: Array, t: float) -> Array:
        g, r = self.turns(u), u[self.positions]
        gap = r[self.leader[self.followers]] - r[self.followers]
        angle = np.conj(g[self.turned]) * g[self.leader[self.turned]]
        x, y, turn = (shift[0] for shift in self._shifts(np.array([t])))
        on_x, on_y, on_angle = self.supported
        return np.concatenate([gap[:, 0], gap[:, 1], angle.imag, r[on_x, 0] - x, r[on_y, 1] - y,
                               (np.exp(-1j * turn) * g[on_angle]).imag])

    def offset(self, times: Array, N: int) -> Array:
        moved = self.moved(times, N)
        out = np.zeros((len(times), len(self.equations)))
        out[:, out.shape[1] - moved.shape[1]:] = moved
        return out

    def moved(self, times: Array, N: int) -> Array:
        x, y, turn = self._shifts(times)
        return np.hstack([-x, -y, -np.sin(turn)])

    @cached_property
    def _pattern(self) -> tuple[Array, Array, Array]:
        """Rows and columns of all entries, and the values of the position equations."""
        s, n, k = self.followers, len(self.followers), len(self.turned)
        m, row = self.leader[s], np.arange(len(self.followers))
        (x, y), (on_x, on_y, on_angle) = self.positions.T, self.supported
        a = 2 * n + k + np.arange(len(on_x))
        b = a.size + 2 * n + k + np.arange(len(on_y))
        angles = [(2 * n, self.leader[self.turned]), (2 * n, self.turned),
                  (len(self.equations) - len(on_angle), on_angle)]
        rows, columns = [row, row, n + row, n + row, a, b], [
            x[m], x[s], y[m], y[s], x[on_x], y[on_y]]
        for first, ends in angles:
            at = self.directions[:, ends].transpose(1, 0, 2)
            rows.append(np.broadcast_to(first + np.arange(len(ends))[:, None, None], at.shape))
            columns.append(at)
        values = np.ones(4 * n + len(a) + len(b))
        values[n:2 * n] = values[3 * n:4 * n] = -1.0
        i, j = (np.concatenate([x.ravel() for x in parts]) for parts in (rows, columns))
        return i, j, values

    def _angles(self, factors: Array, ends: Array) -> Array:
        z = (factors * self.frame[ends])[:, None] * self.weights[ends]
        return np.stack([z.imag, z.real], axis=1).ravel()

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        (rows, columns, _), values = self._pattern, self._values(u, t)
        keep = values != 0.0
        return rows[keep], columns[keep], values[keep]

    def _values(self, u: Array, t: float) -> Array:
        """Values of :meth:`entries` with zeros; rotations of supports come last."""
        g, s = self.turns(u), self.turned
        m = self.leader[s]
        return np.concatenate([
            self._pattern[2], self._angles(np.conj(g[s]), m), self._angles(-np.conj(g[m]), s),
            self._angles(np.exp(-1j * self._shifts(np.array([t]))[2][0]), self.supported[2])])

    @cached_property
    def _places(self) -> Any:
        rows, columns, _ = self._pattern
        return sparse.csr_array((np.arange(len(rows)), (rows, columns)))

    def derivative(self, u: Array, t: float) -> sparse.csr_array:
        """Derivative of :meth:`value`, shape (m, N), with constant sparsity."""
        at = self._places
        return sparse.csr_array((self._values(u, t)[at.data], at.indices, at.indptr),
                                shape=(len(self.equations), len(u)))

    def slope_entries(self, times: Array, N: int) -> tuple[Array, Array, Array]:
        (rows, columns, _), values = self._pattern, self._values(np.zeros(N), 0.0)
        out = np.tile(values, (len(times) if self.turning else 1, 1))
        if self.turning:
            for row, turn in zip(out, self._shifts(times)[2]):
                last = self._angles(np.exp(-1j * turn), self.supported[2])
                row[len(row) - len(last):] = last
        return rows, columns, np.broadcast_to(out, (len(times), len(values)))

    def second_entries(self, N: int) -> tuple[Array, Array, Array, Array]:
        s, first = self.turned, 2 * len(self.followers)
        m, unit = self.leader[s], np.array([1.0, 1j])
        a = (self.frame[s, None] * self.weights[s])[:, None] * unit[:, None]  # (k, 2, n)
        b = (self.frame[m, None] * self.weights[m])[:, None] * unit[:, None]
        values = (np.conj(a)[:, :, :, None, None] * b[:, None, None]).imag
        i = np.broadcast_to(self.directions[:, s].transpose(1, 0, 2)[..., None, None], values.shape)
        j = np.broadcast_to(self.directions[:, m].transpose(1, 0, 2)[:, None, None], values.shape)
        k = np.broadcast_to(first + np.arange(len(s))[:, None, None, None, None], values.shape)
        i, j, k, values = i.ravel(), j.ravel(), k.ravel(), values.ravel()
        keep = values != 0.0
        i, j, k, values = i[keep], j[keep], k[keep], values[keep]
        return (np.append(k, k), np.append(i, j), np.append(j, i), np.append(values, values))

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array]:
        k, i, j, values = self.second_entries(len(u))
        return i, j, multipliers[k] * values

    def quadratic(self, u: Array, t: float, v: Array) -> Array:
        k, i, j, values = self.second_entries(len(u))
        return np.bincount(k, values * v[i] * v[j], len(self.equations))

    def split(self, multipliers: Array) -> tuple[Array, ...]:
        """Forces (followers, 2) and moments (turned,) of followers, and support reactions."""
        ends = (self.followers, self.followers, self.turned, *self.supported[:2])
        x, y, *others = np.split(multipliers, np.cumsum([len(at) for at in ends]))
        return np.stack([x, y], axis=1), *others

    def reaction(self, place: Any, u: Array, multipliers: Array) -> tuple[Array, float, dict]:
        """Reaction of some nodes: force, moment about the first of them, and both by name."""
        out, nodes = np.zeros(self.fixed.shape), self.graph.nodes_at(place)
        for k, (at, part) in enumerate(zip(self.supported, self.split(multipliers)[2:])):
            scale = np.abs(self.turns(u)[at]) if k == 2 else 1.0
            out[self.nodes[at], k] = -part * scale
        x, y, moment = out[nodes].T
        r = self.graph.points[:, nodes] + u[self.positions[self.leading(nodes)]].T
        (a, b), fixed = r - r[:, :1], np.flatnonzero(np.any(self.fixed[nodes], axis=0))
        total = {COMPONENTS[k]: float(np.sum(out[nodes, k])) for k in fixed}
        return np.array([x.sum(), y.sum()]), float(np.sum(moment + a * y - b * x)), total

    def parts(self) -> Array:
        """Number of the rigidly connected group of lines of each chain."""
        n = len(self.nodes) // 2
        links = sparse.coo_array((np.ones(len(self.turned)),
                                  (self.turned // 2, self.leader[self.turned] // 2)), (n, n))
        return np.asarray(sparse.csgraph.connected_components(links, directed=False)[1])

    def fixed_motions(self, parts: Array, origin: Array, size: float, number: int) -> Any:
        """Constraints on rigid motions of groups; dense for one group, else sparse."""
        part = np.repeat(parts, 2)
        x, y = (self.graph.points[:, self.nodes] - origin[:, None]) / size
        one = np.ones(len(x))
        motion = np.array([[one, 0 * one, -y], [0 * one, one, x], [0 * one, 0 * one, one]])
        s = self.followers[part[self.followers] != part[self.leader[self.followers]]]
        rows, at, row = [np.zeros((0, 3))], [s[:0]], [s[:0]]
        count = 0
        for k, ends, others in ((0, self.leader[s], s), (1, self.leader[s], s),
                                *((k, at, s[:0]) for k, at in enumerate(self.supported))):
            rows += [motion[k, :, ends], -motion[k, :, others]]
            at += [part[ends], part[others]]
            row += [count + np.arange(len(ends)), count + np.arange(len(others))]
            count += len(ends)
        i, j = np.concatenate(row), 3 * np.concatenate(at)[:, None] + np.arange(3)
        values = np.concatenate(rows)
        if number == 1:
            out = np.zeros((count, 3))
            np.add.at(out, i, values)
            return out
        return sparse.csr_array((values.ravel(), (np.repeat(i, 3), j.ravel())),
                                shape=(count, 3 * number))

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        bound, several = self._thawed(), np.bincount(self.nodes) > 1
        bound.bind(layout)

        def place(end: Any) -> Vector:
            return Vector(self.graph.points[:, bound.nodes[end]], bound.positions[end][:, None],
                          np.ones(1))

        points = self.graph.points[:, self.nodes]
        for end in bound.leaders:
            fixed = [name for name, one in zip(COMPONENTS, bound.fixed[bound.nodes[end]]) if one]
            if fixed:  # away from the lines that meet
                meet = np.flatnonzero(bound.nodes == bound.nodes[end])
                away = np.sum(points[:, meet] - points[:, meet ^ 1], axis=1)
                size = np.hypot(*away)
                yield support([place(end)], " ".join(fixed),
                              away / size if size > 1e-9 * self.graph.size else (0.0, -1.0))
        for end in np.flatnonzero(bound.hinged & several[bound.nodes]):
            yield Symbol("joint", (place(end),), text="hinge")

    def __repr__(self) -> str:
        return f"<Nodes of {len(self.leaders)} nodes>"


def chain_ends(beam: Beam) -> Array:
    """First and last node of each chain of a beam's mesh, shape (chains, 2)."""
    left, right = beam.mesh.t
    start, end = np.ones((2, len(left)), dtype=bool)
    start[1:] = end[:-1] = left[1:] != right[:-1]
    return np.array([left[start], right[end]]).T


def chain_places(beams: Sequence[Beam]) -> Array:
    """A number for each DOF of beams (N,): that of its node, with a gap between any two chains."""
    out, first = [], 0
    for beam in beams:
        starts = np.zeros(beam.mesh.p.shape[1], dtype=np.int64)
        starts[chain_ends(beam)[:, 0]] = 1
        out.append(np.repeat(first + np.arange(len(starts)) + np.cumsum(starts), beam.nd))
        first = out[-1][-1] + 1
    return np.concatenate(out)
