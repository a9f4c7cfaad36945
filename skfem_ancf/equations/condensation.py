"""Static condensation of frames: members are condensed to their ends, ends to the nodes. An end
shares x, y and the rotation of the section with its node; its other unknowns, such as the stretch
of the section's direction, are eliminated. In a frame along this direction the shared unknowns are
those of the node plus the residual of the joint equations. Multipliers are therefore not unknowns:
they are the residual forces at the ends. Statics, modes and time integration use the same
factors."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..actions.joints.nodes import Nodes, chain_ends
from ..beam import Beam
from ..core.band import SMALL, BandMatrix, Inertia
from ..core import Array
from .rank import diagonal_factors

#: A pivot that small beside the diagonal is round-off.
LOST = 1e-13
#: Number of unknowns that an end shares with its node.
SHARED = 3
#: Number of members that are assembled together, to limit the memory.
CHUNK = 1024
#: Largest contraction and largest residual of a refinement with old factors, and with new ones.
OLD, NEW = (0.05, 1e-12), (0.5, 1e-6)
#: Largest number of refinements, and their accuracy.
REFINEMENTS, EXACT = 50, 1e-14
#: What is left of the equations, over their right side, where nothing can be refined.
ROUND_OFF = 1e-12
#: Number of refinements within an iteration.
ROUGHLY = 2


class Group(NamedTuple):
    """At most :data:`CHUNK` members of one beam with equally many elements."""

    members: Array  # numbers among the members of all beams, (M,)
    first: Array  # first DOF of each, (M,)
    nd: int  # DOFs of a node
    elements: int  # elements of a member

    @property
    def places(self) -> Array:
        """DOFs of each member, shape (M, (elements + 1) nd)."""
        return self.first[:, None] + np.arange((self.elements + 1) * self.nd)


def groups_of(beams: Sequence[Beam], slices: Sequence[slice]) -> list[Group]:
    """Group the members of all beams, whose DOFs are the slices."""
    out, number = [], 0
    for beam, s in zip(beams, slices):
        first, last = chain_ends(beam).T
        for n in np.unique(last - first):
            all_of_them = np.flatnonzero(last - first == n)
            out += [Group(number + some, s.start + beam.nd * first[some], beam.nd, int(n))
                    for some in np.split(all_of_them, range(CHUNK, len(all_of_them), CHUNK))]
        number += len(first)
    return out


class Condensed:
    """Factors of ``[K + sum l H, J^T; J, 0]`` of a frame, J and H the joints' derivatives. K is the
    matrix of the beams, which is assembled before :meth:`factorize`. ``size`` is the number of
    unknowns of the nodes; ``at`` are the displacement (N,) and multipliers (m,) of the factors."""

    def __init__(self, system: Any, K: BandMatrix) -> None:
        nodes: Nodes = system.constraints.frame
        self._K, self.at = K, (np.zeros(system.N), np.zeros(system.constraints.m))
        self.nodes, self.groups = nodes, groups_of(system.beams, system.slices)
        # both ends of each member, numbered one after the other
        self._bases = [[_Basis(nodes, group, 2 * group.members + end) for end in (0, 1)]
                       for group in self.groups]
        unknown = ~nodes.fixed  # x, y and the rotation of each node
        unknown[np.setdiff1d(np.arange(len(unknown)), nodes.nodes)] = False  # no line ends there
        rigid = np.zeros(len(unknown), dtype=bool)
        rigid[nodes.nodes[~nodes.hinged]] = True
        unknown[:, 2] &= rigid
        order = _order(nodes)
        number = np.empty(unknown.shape, dtype=np.int64)
        number[order] = np.cumsum(unknown[order]).reshape(-1, 3) - 1
        self.size = int(np.sum(unknown))
        # unknowns of x, y and rotation of each end; `size` stands for none
        unknowns = np.where(unknown, number, self.size)[nodes.nodes]
        unknowns[nodes.hinged, 2] = self.size
        at = unknowns.reshape(-1, 6)
        i, j = (np.broadcast_to(x, (len(at), 6, 6)).ravel() for x in (at[:, :, None], at[:, None]))
        self._inside = np.flatnonzero((i < self.size) & (j < self.size))
        #: rows and columns of the members' entries in the matrix of the nodes
        self._entries = tuple(x[self._inside].astype(np.int32) for x in (i, j))
        self._moves = _Moves(nodes)
        rows = np.flatnonzero(at < self.size)
        #: displacements of the ends from those of the nodes
        self._follow = sparse.csr_array((np.ones(len(rows)), (rows, at.ravel()[rows])),
                                        (at.size, self.size))
        self._gather = self._follow.T.tocsr()
        self._parts: list[_Part] = []
        self._nodes: Any = None

    @property
    def ready(self) -> bool:
        return self._nodes is not None

    def forget(self) -> None:
        self._parts, self._nodes = [], None

    # factors

    def factorize(self, u: Array, multipliers: Array) -> None:
        """Factorise at u and multipliers, with the symmetric part of K; LinAlgError if singular."""
        self.at = u.copy(), multipliers.copy()
        K = self._K if self._K.symmetric else self._K.symmetric_part()
        turns, hinged = self.nodes.turns(u), self.nodes.hinged.reshape(-1, 2)
        follow = self.nodes.turned  # ends that follow a rotation, and scales of their equations
        scales = (np.conj(turns[follow]) * turns[self.nodes.leader[follow]]).real
        # coupling of rotation and stretch of each end by the multipliers of the rotations
        moments, values = np.zeros(len(self.nodes.nodes)), self.nodes.split(multipliers)[1] * scales
        np.add.at(moments, self.nodes.leader[follow], -values)
        moments[follow] += values
        S, self._parts, self._nodes = np.empty((len(hinged), 6, 6)), [], None  # no two at once
        for group, bases in zip(self.groups, self._bases):
            self._parts.append(_Part(group, K, bases, turns, moments, hinged[group.members], S))
        #: end displacements from the residual of the joints; the transpose gives multipliers
        self._moved = self._moves(turns, scales)
        self._pushed = self._moved.T
        self._ends, n, diagonal, lu = S, self.size, np.zeros(0), None
        if n:
            A = sparse.coo_array((S.ravel()[self._inside], self._entries), (n, n)).tocsc()
            diagonal, lu = A.diagonal(), diagonal_factors(A, "NATURAL")
            if lu is None:
                raise np.linalg.LinAlgError("a pivot of the nodes is zero")
        #: the diagonal of the matrix of the nodes, and its sparse factors
        self._nodes = diagonal, lu

    def inertia(self) -> Inertia:
        """Inertia of the tangent on the null space of J."""
        found = [part.inertia() for part in self._parts]
        negative, singular = sum(x.negative for x in found), any(x.singular for x in found)
        diagonal, lu = self._nodes
        # lu.U makes a copy
        pivots = diagonal if lu is None else lu.U.diagonal()[lu.perm_c] / np.abs(diagonal)
        for ratio in [pivots, *(np.sign(part.pivots) for part in self._parts)]:
            negative += int(np.sum(ratio < 0.0))
            singular = singular or bool(np.any(np.abs(ratio) < LOST))
        return Inertia(negative, singular)

    # solution

    def solve(self, b: Array, phi: Array) -> tuple[Array, Array]:
        """x and multipliers for forces b (N,) and residuals phi (m,), or for columns of both."""
        lu, k = self._nodes[1], b[:1].size
        v, x = (self._moved @ phi.reshape(-1, k)).reshape(-1, 6, k), np.zeros((len(b), k))
        f = np.empty(v.shape)
        for part in self._parts:
            f[part.group.members] = part.reduce(b.reshape(x.shape))
        if lu is not None:
            left = self._gather @ (f - self._ends @ v).reshape(-1, k)
            v += (self._follow @ lu.solve(left)).reshape(v.shape)
        for part in self._parts:
            part.expand(v[part.group.members], x)
        multipliers = self._pushed @ (f - self._ends @ v).reshape(-1, k)
        return x.reshape(b.shape), multipliers.reshape(phi.shape)

    def solve_into(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                   dm: Array) -> None:
        """Solve, or factorise if R is empty."""
        if len(R):
            du[:], dm[:] = self.solve(R, phi)
        else:
            self.factorize(u, multipliers)


class CondensedMass:
    """Solves with the mass matrix of a frame and its joints at any displacement. The factors of an
    earlier displacement are used with iterative refinement, and replaced when it converges too
    slowly. ``lag`` is the time from the instant of the joint forces to the end of a step."""

    def __init__(self, system: Any) -> None:
        self._M = system.mass if system.mass.symmetric else system.mass.symmetric_part()
        self._condensed = Condensed(system, self._M)
        self.at: Array | None = None
        self.lag = 0.0
        self._last: tuple[float, Array, Array] | None = None

    def factorize(self, u: Array) -> None:
        self.at = u.copy()
        self._condensed.factorize(self.at, 0.0 * self._condensed.at[1])

    def forget(self, factors: bool = True) -> None:
        """Discard the last solution and, by default, the factors: results do not depend on them."""
        self._last = None
        if factors:
            self.at = None

    def solve(self, u: Array, t: float, b: Array, rate: Array, forces: Any = None,
              scale: float = 0.0, most: int = REFINEMENTS) -> tuple[Array, Array]:
        """Solve ``M x + J^T l = b``, ``J1 x = rate`` for x (N,) and l (m,)."""
        # J1 is the joint Jacobian at u (N,) and t; J is ``forces``, sparse (m, N), or J1. ``scale``
        # is a norm of x to which the accuracy is relative, ``most`` the number of refinements.
        J1 = self._condensed.nodes.derivative(u, t)
        J = (J1 if forces is None else forces).T
        # another iterate at this instant starts from the last solution
        start = self._last[1:] if self._last is not None and self._last[0] == t else None
        rules, found = (scale, most), None
        if self.at is not None:
            found = self._refined(J, J1, start, b, rate, rules, *OLD)
        if found is None:
            self.factorize(u)
            found = self._refined(J, J1, start, b, rate, rules, *NEW)
        if found is None:
            raise np.linalg.LinAlgError("the joints are not independent")
        self._last = (t, *found) if np.all(np.isfinite(found[0])) else None
        return found

    def _refined(self, J, J1, start, b, rate, rules, contraction, rough):
        """The refined solution with the current factors, or None; J is transposed here."""
        (x, l), before, (scale, most) = start or (0.0, 0.0), np.inf, rules
        for k in range(most):
            missing = b, rate
            if k or start:
                missing = b - self._M.multiply(x) - J @ l, rate - J1 @ x
            dx, dl = self._condensed.solve(*missing)
            x, l = x + dx, l + dl
            step, size = np.linalg.norm(dx), max(scale, np.linalg.norm(x))
            left = step * min(1.0, step / before) if before < np.inf else step
            if left <= EXACT * size or not step < np.inf:
                return x, l
            if step > contraction * before:
                # at rest the forces cancel, and x is their round-off
                done = np.linalg.norm(missing[0]) <= ROUND_OFF * np.linalg.norm(b)
                return (x, l) if step <= rough * size or done else None
            before = step
        return (x, l) if most < REFINEMENTS else None

    def solve_into(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                   dm: Array) -> None:
        """Project velocities or accelerations R (N,) onto the joints at u and t."""
        # ``phi`` (m,) is the required change of J R. ``du`` is the displacement of the joint forces
        # on entry; the change is returned in du (N,) and dm (m,). With empty ``multipliers`` a few
        # refinements suffice, since more iterations follow.
        J = None
        if self.lag or not np.array_equal(du, u):
            J = self._condensed.nodes.derivative(du, t - self.lag)
        du[:], dm[:] = self.solve(u, t, 0.0 * R, phi, J, float(np.linalg.norm(R)),
                                  REFINEMENTS if len(multipliers) else ROUGHLY)


def _order(nodes):
    """Node numbers in a fill-reducing order."""
    (i, j), n = nodes.nodes.reshape(-1, 2).T, len(nodes.fixed)
    k = np.arange(n)
    values = np.repeat([1.0, 2.0 * len(i)], [2 * len(i), n])
    A = sparse.csc_array((values, (np.concatenate([i, j, k]), np.concatenate([j, i, k]))), (n, n))
    return np.argsort(splu(A, "MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c)


class _Moves:
    """Displacements of ends relative to their nodes, by residuals of the joint equations."""

    def __init__(self, nodes: Nodes) -> None:
        follow = (nodes.followers, nodes.followers, nodes.turned)
        rows = [3 * ends + k for k, ends in enumerate(follow)]
        self._following = first = sum(map(len, follow))
        columns = [np.arange(first)]
        for k, fixed in enumerate(nodes.supported):
            number = np.full(len(nodes.fixed), -1)
            number[nodes.nodes[fixed]] = first + np.arange(len(fixed))
            ends = np.flatnonzero((number[nodes.nodes] >= 0) & ~((k == 2) & nodes.hinged))
            rows, columns, first = ([*rows, 3 * ends + k],
                                    [*columns, number[nodes.nodes[ends]]], first + len(fixed))
        #: leading ends of those whose rotation is prescribed
        self._prescribed = nodes.leader[ends]
        self._at = np.concatenate(rows), np.concatenate(columns)
        self._shape = 3 * len(nodes.nodes), first

    def __call__(self, turns: Array, scales: Array) -> sparse.csr_array:
        """Matrix from residuals (m,) to end displacements (3 ends,)."""
        # Its transpose maps negative end forces to multipliers.
        values = np.ones(len(self._at[0]))
        values[:self._following] = -1.0
        values[self._following - len(scales):self._following] /= scales
        values[len(values) - len(self._prescribed):] /= np.abs(turns[self._prescribed])
        return sparse.csr_array((values, self._at), self._shape)


class _Basis:
    """Basis of the DOFs of the ends ``ends`` (M,) of a group's members on one side. Its vectors are
    displacements along x and y, the rotation of the section, stretches of the section's direction
    along itself, and the rest."""

    def __init__(self, nodes: Nodes, group: Group, ends: Array) -> None:
        at = nodes.directions[0, ends] - nodes.positions[ends, :1]
        places, first = np.unique(at[0], return_index=True)
        self._c, self._ends, self._start = nodes.weights[ends][:, first], ends, nodes.start[ends]
        self._at, n, nd = places, len(places), group.nd
        self._size = np.sum(self._c**2, axis=1)
        # null space of the weights
        self._others = np.linalg.qr(self._c[:, :, None], mode="complete")[0][:, :, 1:]
        self._template = np.zeros((nd, nd))
        self._template[0, 0] = self._template[1, 1] = 1.0
        used = np.concatenate([[0, 1], places, places + 1])
        self._template[np.setdiff1d(np.arange(nd), used), 2 + 2 * n:] = np.eye(nd - 2 - 2 * n)

    def __call__(self, turns: Array) -> Array:
        """The basis as matrices, shape (M, nd, nd)."""
        d = turns[self._ends] * self._start
        self._length, n, x = np.abs(d), len(self._at), self._at
        along, out = d / self._length, np.repeat(self._template[None], len(d), axis=0)
        turn = (1j * d / self._size)[:, None] * self._c
        out[:, x, 2], out[:, x + 1, 2] = turn.real, turn.imag
        for k in range(n):
            out[:, x[k], 3 + k], out[:, x[k] + 1, 3 + k] = along.real, along.imag
        across = (1j * along)[:, None, None] * self._others
        out[:, x, 3 + n:2 + 2 * n], out[:, x + 1, 3 + n:2 + 2 * n] = across.real, across.imag
        return out

    def add_curvature(self, moments: Array, K: Array) -> None:
        """Add the coupling of rotation and stretch by multipliers to matrices (M, nd, nd)."""
        coupling = (moments[self._ends] / self._length)[:, None] * self._c
        n = len(self._at)
        K[:, 2, 3:3 + n] += coupling
        K[:, 3:3 + n, 2] += coupling


class _Part:
    """A group's members with their inner DOFs eliminated. ``bases`` are those of both sides;
    ``turns`` and ``moments`` (ends,) are their arguments; ``hinged`` (M, 2) marks free rotations.
    The condensed matrices are stored in ``S`` (members, 6, 6). ``pivots`` (k,) belong to the
    eliminated rotations of hinged ends."""

    def __init__(self, group: Group, K: BandMatrix, bases: Sequence[_Basis], turns: Array,
                 moments: Array, hinged: Array, S: Array) -> None:
        self.group, self._places = group, group.places
        sides = left, right = [basis(turns) for basis in bases]
        D, C = _blocks(K, group)
        nd, n = group.nd, group.elements
        first, to_first, last = D[:, 0], C[:, 0], D[:, 1]
        #: of each inner node: matrix, inverse, and response to the first and the next node
        self._inner: list[tuple[Array, Array, Array]] = []
        for k in range(1, n):
            A, inverse = last, _inverse(last)
            X = _solved(A, inverse, np.concatenate([to_first, C[:, k].transpose(0, 2, 1)], axis=2))
            self._inner.append((A, inverse, X))
            first = first - to_first.transpose(0, 2, 1) @ X[:, :, :nd]
            last = D[:, k + 1] - C[:, k] @ X[:, :, nd:]
            to_first = -C[:, k] @ X[:, :, :nd]
        ends = np.empty((len(D), 2, nd, 2, nd))
        ends[:, 0, :, 0] = _projected(left, first, left)
        ends[:, 1, :, 1] = _projected(right, last, right)
        ends[:, 1, :, 0] = _projected(right, to_first, left)
        ends[:, 0, :, 1] = ends[:, 1, :, 0].transpose(0, 2, 1)
        for side, basis in enumerate(bases):
            basis.add_curvature(moments, ends[:, side, :, side])
        p = 2 * (nd - SHARED)
        self._outer = A = ends[:, :, SHARED:, :, SHARED:].reshape(-1, p, p)
        W = ends[:, :, SHARED:, :, :SHARED].reshape(-1, p, 2 * SHARED)
        inverse = _inverse(A)
        shared, own = (_beside([T[:, :, some] for T in sides]).transpose(0, 2, 1)
                       for some in (slice(SHARED), slice(SHARED, None)))
        X = _solved(A, inverse, np.concatenate([W, own], axis=2))
        W = W.transpose(0, 2, 1)
        rest = ends[:, :, :SHARED, :, :SHARED].reshape(-1, 6, 6) - W @ X[:, :, :6]
        #: forces and displacements at the ends from loads on both end nodes
        self._forces = shared - W @ X[:, :, 6:]
        self._flexibility = own.transpose(0, 2, 1) @ X[:, :, 6:]
        self.pivots = np.concatenate([self._release(np.flatnonzero(turning), 3 * k + 2, rest)
                                      for k, turning in enumerate(hinged.T)])
        S[group.members] = rest

    def _release(self, some, k, S):
        """Eliminate the free rotation k of some members; returns the pivots."""
        row, force = S[some, k], self._forces[some, k]
        pivot = row[:, k].copy()
        if not np.all(pivot):
            raise np.linalg.LinAlgError("a hinged end has no stiffness")
        row, along = row[:, :, None], (force / pivot[:, None])[:, None]
        S[some] -= row * (row / pivot[:, None, None]).transpose(0, 2, 1)
        self._forces[some] -= row * along
        self._flexibility[some] += force[:, :, None] * along
        S[some, k] = S[some, :, k] = self._forces[some, k] = 0.0
        return pivot

    def inertia(self) -> Inertia:
        negative, singular = 0, False
        for A in [*(A for A, *_ in self._inner), self._outer]:
            size = 1.0 / np.sqrt(np.abs(A.diagonal(axis1=1, axis2=2)))
            A = size[:, :, None] * A * size[:, None]
            try:
                pivots = np.linalg.cholesky(A).diagonal(axis1=1, axis2=2) ** 2
                if np.min(pivots) > SMALL:
                    continue
            except np.linalg.LinAlgError:
                pass  # members buckle between their ends
            values = np.linalg.eigvalsh(A)
            negative += int(np.sum(values < 0.0))
            singular = singular or bool(np.any(np.abs(values) < LOST))
        return Inertia(negative, singular)

    def reduce(self, b: Array) -> Array:
        """Condense loads, columns (N, k), to end forces (M, 6, k)."""
        nd, columns = self.group.nd, b.shape[1]
        f = b[self._places].reshape(len(self._places), -1, nd, columns)
        known = []
        first, last = f[:, 0], f[:, 1]
        for k, (A, inverse, X) in enumerate(self._inner):
            known.append(_solved(A, inverse, last))
            both = X.transpose(0, 2, 1) @ last
            first, last = first - both[:, :nd], f[:, k + 2] - both[:, nd:]
        outer = np.concatenate([first, last], axis=1)
        self._known = [*known, outer]
        return self._forces @ outer

    def expand(self, v: Array, x: Array) -> None:
        """All displacements x (N, k) from those of the ends (M, 6, k), after :meth:`reduce`."""
        nd, places = self.group.nd, self._places
        ends = self._forces.transpose(0, 2, 1) @ v + self._flexibility @ self._known[-1]
        n = self.group.elements * nd
        x[places[:, [*range(nd), *range(n, n + nd)]]] = ends
        around = ends.copy()
        for k in range(self.group.elements - 1, 0, -1):
            around[:, nd:] = self._known[k - 1] - self._inner[k - 1][2] @ around
            x[places[:, k * nd:(k + 1) * nd]] = around[:, nd:]


def _beside(matrices):
    """Block diagonal (M, 2 nd, 2 k) of two matrices (M, nd, k)."""
    M, nd, k = matrices[0].shape
    out = np.zeros((M, 2, nd, 2, k))
    out[:, 0, :, 0], out[:, 1, :, 1] = matrices
    return out.reshape(M, 2 * nd, 2 * k)


def _inverse(A):
    """Inverses of symmetric matrices, scaled to unit diagonals."""
    size = np.sqrt(np.abs(A.diagonal(axis1=1, axis2=2)))
    scale = size[:, :, None] * size[:, None]
    return np.linalg.inv(A / scale) / scale


def _solved(A, inverse, B):
    """A^-1 B with one refinement, as accurate as by factors."""
    X = inverse @ B
    return X + inverse @ (B - A @ X)


def _projected(S, A, T):
    """S^T A T."""
    return S.transpose(0, 2, 1) @ A @ T


def _blocks(K, group):
    """Diagonal blocks (M, elements + 1, nd, nd) and subdiagonal blocks of members."""
    nd, n, ld = group.nd, group.elements, K.ld
    a, b = np.arange(nd)[:, None], np.arange(nd)
    low, high = np.minimum(a, b), np.maximum(a, b)
    # columns of the band by node
    nodes = K.flat.reshape(-1, ld)[group.places].reshape(-1, n + 1, nd * ld)
    D, C = nodes.take(low * ld + high - low, axis=2), nodes[:, :n].take(b * ld + nd + a - b, axis=2)
    return D, C
