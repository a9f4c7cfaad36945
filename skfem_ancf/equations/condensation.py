"""Static condensation: members of a frame are condensed to their ends, those to the nodes.

An end has the unknowns of its node, x, y and the rotation of the section, and unknowns of its own:
the stretch of the section's direction, and what an element has besides. In the frame of its
direction the first three are those of the node, up to the residual of the node's equations.
So no multiplier is unknown: they are the forces left at the ends.

Statics, modes and motions use the same factors. In a motion kernels ask for them by a handle, see
:mod:`skfem_ancf.core.callbacks`.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..actions.joints.nodes import Nodes, chain_ends
from ..beam.beam import Beam
from ..core.linalg import NO_FACTORS, SMALL, BandMatrix, Inertia
from ..core.types import Array

logger = logging.getLogger(__name__)

#: A pivot that small beside the diagonal is round-off.
LOST = 1e-13
#: Unknowns that an end shares with its node.
SHARED = 3
#: Members whose matrices are made at once, so that what they are made of takes little memory.
CHUNK = 1024
#: Contraction of a refinement and what round-off may leave, up to which factors are kept; the same
#: of new ones.
KEPT, NEW = (0.05, 1e-12), (0.5, 1e-6)
#: Length of a refinement at most, and its accuracy.
REFINEMENTS, EXACT = 50, 1e-14
#: What is left of the equations, over their right side, where nothing can be refined.
ROUND_OFF = 1e-12
#: Corrections where more iterations follow.
ROUGHLY = 2


class Group(NamedTuple):
    """Chains of one beam with equally many elements, at most :data:`CHUNK`.

    Attributes
    ----------
    members
        Their numbers among the chains of all beams, shape (M,).
    first
        First coordinate of each, shape (M,).
    nd, elements
        Coordinates of a node, elements of a chain.
    """

    members: Array
    first: Array
    nd: int
    elements: int

    @property
    def ends(self) -> Array:
        """Numbers of the starts and the ends of the chains, shape (2, M)."""
        return 2 * self.members + np.array([[0], [1]])

    @property
    def places(self) -> Array:
        """Numbers of the coordinates of each chain, shape (M, (elements + 1) nd)."""
        return self.first[:, None] + np.arange((self.elements + 1) * self.nd)

    @property
    def end_places(self) -> Array:
        """The same of their first and last nodes, shape (M, 2 nd)."""
        return self.first[:, None] + np.append(*np.arange(self.nd) + [
            [0], [self.elements * self.nd]])


def groups_of(beams: Sequence[Beam], slices: Sequence[slice]) -> list[Group]:
    """The chains of all beams in groups.

    Parameters
    ----------
    beams, slices
        The beams, and the coordinates of each.
    """
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
    """Factors of ``[K + sum l H, J^T; J, 0]`` of a frame.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System` of a frame that can be condensed.
    K
        The matrix of the beams, which is filled before :meth:`factorize`.

    Other Parameters
    ----------------
    u, t, multipliers
        Where the joints are linearised: displacement (N,), time, multipliers (m,).
    b, R, phi
        Right-hand sides: forces (N,), and what the equations of the nodes should change by, (m,);
        or columns of them, which together take half as long.
    du, dm
        Take the solution, shapes (N,) and (m,).

    Attributes
    ----------
    size : int
        Unknowns of the nodes.
    at : tuple of ndarray
        Displacement (N,) and multipliers (m,) at which it was factorised.
    """

    def __init__(self, system: Any, K: BandMatrix) -> None:
        nodes: Nodes = system.constraints.frame
        self._K, self.at = K, (np.zeros(system.N), np.zeros(system.constraints.m))
        self.nodes, self.groups = nodes, groups_of(system.beams, system.slices)
        self._bases = [[_Basis(nodes, group, ends) for ends in group.ends] for group in self.groups]
        unknown = self._unknown()
        order = _order(nodes)
        number = np.empty(unknown.shape, dtype=np.int64)
        number[order] = np.cumsum(unknown[order]).reshape(-1, 3) - 1
        self.size = int(np.sum(unknown))
        # unknown of each end's x, y and rotation; one behind the last where there is none
        unknowns = np.where(unknown, number, self.size)[nodes.nodes]
        unknowns[nodes.hinged, 2] = self.size
        at = unknowns.reshape(-1, 6)
        i, j = (np.broadcast_to(x, (len(at), 6, 6)).ravel() for x in (at[:, :, None], at[:, None]))
        self._inside = np.flatnonzero((i < self.size) & (j < self.size))
        #: where the entries of the members go in the matrix of the nodes
        self._entries = tuple(x[self._inside].astype(np.int32) for x in (i, j))
        self._moves = _Moves(nodes)
        rows = np.flatnonzero(at < self.size)
        #: displacements of the ends by those of the nodes
        self._follow = sparse.csr_array((np.ones(len(rows)), (rows, at.ravel()[rows])),
                                        (at.size, self.size))
        self._gather = self._follow.T.tocsr()
        self._parts: list[_Part] = []
        self._nodes: Any = None

    @property
    def ready(self) -> bool:
        """True if there are factors."""
        return self._nodes is not None

    def forget(self) -> None:
        """Have no factors."""
        self._parts, self._nodes = [], None

    def _unknown(self):
        """Whether x, y and the rotation of a node are unknown, (number, 3)."""
        out = ~self.nodes.held
        out[np.setdiff1d(np.arange(len(out)), self.nodes.nodes)] = False  # no line ends there
        rigid = np.zeros(len(out), dtype=bool)
        rigid[self.nodes.nodes[~self.nodes.hinged]] = True
        out[:, 2] &= rigid
        return out

    # factors

    def factorize(self, u: Array, multipliers: Array) -> None:
        """Factorise what the matrix holds; of one that is not symmetric its symmetric part.

        Raises
        ------
        numpy.linalg.LinAlgError, RuntimeError
            If the matrix is singular.
        """
        self.at = u.copy(), multipliers.copy()
        K = self._K if self._K.symmetric else self._K.symmetric_part()
        turns, hinged = self.nodes.turns(u), self.nodes.hinged.reshape(-1, 2)
        scales = self._moves.scales(turns)
        moments = self._moments(multipliers, scales)
        S, self._parts, self._nodes = np.empty((len(hinged), 6, 6)), [], None  # no two at once
        for group, bases in zip(self.groups, self._bases):
            self._parts.append(_Part(group, K, bases, turns, moments, hinged[group.members], S))
        #: displacements of the ends by the equations of the nodes, multipliers by forces
        self._moved = self._moves(turns, scales)
        self._pushed = self._moved.T
        self._ends, self._nodes = S, self._factors(S)

    def _moments(self, multipliers, scales):
        """How rotation and stretch of each end are coupled by the multipliers of the rotations."""
        out, follower = np.zeros(len(self.nodes.nodes)), self.nodes.turned
        value = self.nodes.split(multipliers)[1] * scales
        np.add.at(out, self.nodes.leader[follower], -value)
        out[follower] += value
        return out

    def _factors(self, ends):
        """The diagonal of the matrix of the nodes, and its sparse factors."""
        n = self.size
        if not n:
            return np.zeros(0), None
        A = sparse.coo_array((ends.ravel()[self._inside], self._entries), (n, n)).tocsc()
        lu = splu(A, "NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        if not np.array_equal(lu.perm_r, lu.perm_c):
            raise np.linalg.LinAlgError("a pivot of the nodes is zero")
        return A.diagonal(), lu

    def inertia(self) -> Inertia:
        """Signs of the eigenvalues of the tangent on the tangent space of the joints."""
        found = [part.inertia() for part in self._parts]
        negative, singular = sum(x.negative for x in found), any(x.singular for x in found)
        diagonal, lu = self._nodes
        # asked for here only, as these factors are copies
        pivots = diagonal if lu is None else lu.U.diagonal()[lu.perm_c] / np.abs(diagonal)
        for ratio in [pivots, *(np.sign(part.pivots) for part in self._parts)]:
            negative += int(np.sum(ratio < 0.0))
            singular = singular or bool(np.any(np.abs(ratio) < LOST))
        return Inertia(negative, singular)

    # solution

    def solve(self, b: Array, phi: Array) -> tuple[Array, Array]:
        """Solve with the factors.

        Returns
        -------
        x, multipliers
            Of these shapes.
        """
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

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """Solve; without right-hand sides factorise. False if that fails."""
        try:
            if len(R):
                du[:], dm[:] = self.solve(R, phi)
            else:
                self.factorize(u, multipliers)
        except NO_FACTORS as error:
            logger.debug("no factors: %s", error)
            return False
        return True


class CondensedMass:
    """Solves with the mass matrix of a frame and the joints as they are at a displacement.

    The factors are those of an earlier displacement, refined, and computed again where that takes
    long.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System` of a frame that can be condensed.

    Attributes
    ----------
    at : ndarray or None
        Displacement at which it was factorised, shape (N,).
    lag : float
        By how much the joints' forces act before the end of a step.
    """

    def __init__(self, system: Any) -> None:
        self._M = system.mass if system.mass.symmetric else system.mass.symmetric_part()
        self._condensed = Condensed(system, self._M)
        self.at: Array | None = None
        self.lag = 0.0
        self._last: tuple[float, Array, Array] | None = None

    def factorize(self, u: Array) -> None:
        """Make factors at a displacement (N,)."""
        self.at = u.copy()
        self._condensed.factorize(self.at, 0.0 * self._condensed.at[1])

    def forget(self, factors: bool = True) -> None:
        """Begin again: what is solved next does not depend on what was solved before.

        Parameters
        ----------
        factors
            On the factors neither: False, if they are those of the same displacement.
        """
        self._last = None
        if factors:
            self.at = None

    def solve(self, u: Array, t: float, b: Array, rate: Array, forces: Any = None,
              scale: float = 0.0, most: int = REFINEMENTS) -> tuple[Array, Array]:
        """x and l with ``M x + J^T l = b`` and ``J1 x = rate``.

        Parameters
        ----------
        u, t
            Where J1 is taken, shape (N,), and when.
        b, rate
            Shapes (N,) and (m,).
        forces
            J, sparse, shape (m, N); J1 by default.
        scale
            A norm of x below which it need not be exact.
        most
            Corrections after which it is exact enough.

        Returns
        -------
        x, l
            Shapes (N,) and (m,).
        """
        J1 = self._condensed.nodes.derivative(u, t)
        J = (J1 if forces is None else forces).T
        # another iterate of this instant begins with what the last one has found
        start = self._last[1:] if self._last is not None and self._last[0] == t else None
        rules, found = (scale, most), None
        if self.at is not None:
            found = self._refined(J, J1, start, b, rate, rules, *KEPT)
        if found is None:
            self.factorize(u)
            found = self._refined(J, J1, start, b, rate, rules, *NEW)
        if found is None:
            raise np.linalg.LinAlgError("the joints are not independent")
        self._last = (t, *found) if np.all(np.isfinite(found[0])) else None
        return found

    def _refined(self, J, J1, start, b, rate, rules, contraction, rough):
        """The solution by the factors that there are; None where it does not contract so fast.

        J is the transpose of what it is elsewhere.
        """
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

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """By how much R, velocities or accelerations, has to change so that joints stay closed.

        Parameters
        ----------
        t, u
            Time and displacement, shape (N,), at which they are closed.
        multipliers
            Shape (m,); (0,) where a few corrections will do, as more iterations follow.
        R, phi
            What is changed, and by what its product with the joints' derivatives should change,
            shapes (N,) and (m,).
        du, dm
            The change and its multipliers, shapes (N,) and (m,). Before, du is the displacement at
            which the joints' forces act, at a time :attr:`lag` before t.
        """
        try:
            J = None
            if self.lag or not np.array_equal(du, u):
                J = self._condensed.nodes.derivative(du, t - self.lag)
            du[:], dm[:] = self.solve(u, t, 0.0 * R, phi, J, float(np.linalg.norm(R)),
                                      REFINEMENTS if len(multipliers) else ROUGHLY)
        except NO_FACTORS as error:
            logger.debug("no factors: %s", error)
            return False
        return True


def _order(nodes):
    """Numbers of the nodes in an order in which sparse factors stay sparse."""
    (i, j), n = nodes.nodes.reshape(-1, 2).T, len(nodes.held)
    one = np.ones(len(i))
    links = sparse.coo_array((np.append(one, one), (np.append(i, j), np.append(j, i))), (n, n))
    A = (links + 2.0 * len(i) * sparse.eye_array(n)).tocsc()
    return np.argsort(splu(A, "MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c)


class _Moves:
    """How far the equations of the nodes, where they are open, move ends from their nodes.

    Parameters
    ----------
    nodes
        The :class:`~skfem_ancf.actions.joints.nodes.Nodes`.
    """

    def __init__(self, nodes: Nodes) -> None:
        self._turned, self._leading = nodes.turned, nodes.leader[nodes.turned]
        follow = (nodes.followers, nodes.followers, nodes.turned)
        rows = [3 * ends + k for k, ends in enumerate(follow)]
        self._following = first = sum(map(len, follow))
        columns = [np.arange(first)]
        for k, held in enumerate((nodes.held_x, nodes.held_y, nodes.held_angle)):
            number = np.full(len(nodes.held), -1)
            number[nodes.nodes[held]] = first + np.arange(len(held))
            ends = np.flatnonzero((number[nodes.nodes] >= 0) & ~((k == 2) & nodes.hinged))
            rows, columns, first = ([*rows, 3 * ends + k],
                                    [*columns, number[nodes.nodes[ends]]], first + len(held))
        #: of the last, whose rotation is held, the ends that lead
        self._held = nodes.leader[ends]
        self._at = np.concatenate(rows), np.concatenate(columns)
        self._shape = 3 * len(nodes.nodes), first

    def scales(self, turns: Array) -> Array:
        """Of the equations of ends that follow a rotation, by the turns (ends,) of all."""
        return (np.conj(turns[self._turned]) * turns[self._leading]).real

    def __call__(self, turns: Array, scales: Array) -> sparse.csr_array:
        """The displacements (3 ends,) for what equations (m,) should change by.

        The transpose takes forces (3 ends,), negative, to multipliers (m,).
        """
        values = np.ones(len(self._at[0]))
        values[:self._following] = -1.0
        values[self._following - len(scales):self._following] /= scales
        values[len(values) - len(self._held):] /= np.abs(turns[self._held])
        return sparse.csr_array((values, self._at), self._shape)


class _Basis:
    """Unknowns of the ends of a group's members on one side.

    Displacements along x and y, the rotation of the section with all that gives its direction, the
    stretches of that along itself, and what is left.

    Parameters
    ----------
    nodes
        The :class:`~skfem_ancf.actions.joints.nodes.Nodes`.
    group, ends
        The members, and the numbers of these ends, shape (M,).
    """

    def __init__(self, nodes: Nodes, group: Group, ends: Array) -> None:
        at = nodes.directions[0, ends] - nodes.positions[ends, :1]
        places, first = np.unique(at[0], return_index=True)
        self._c, self._ends, self._start = nodes.weights[ends][:, first], ends, nodes.start[ends]
        self._at, n, nd = places, len(places), group.nd
        self._size = np.sum(self._c**2, axis=1)
        # directions in which the weighted sum does not change
        self._others = np.linalg.qr(self._c[:, :, None], mode="complete")[0][:, :, 1:]
        self._template = np.zeros((nd, nd))
        self._template[0, 0] = self._template[1, 1] = 1.0
        used = np.concatenate([[0, 1], places, places + 1])
        self._template[np.setdiff1d(np.arange(nd), used), 2 + 2 * n:] = np.eye(nd - 2 - 2 * n)

    def __call__(self, turns: Array) -> Array:
        """Displacements of the coordinates for these unknowns, shape (M, nd, nd)."""
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
        """Add what multipliers do to rotation and stretch to matrices (M, nd, nd)."""
        coupling = (moments[self._ends] / self._length)[:, None] * self._c
        n = len(self._at)
        K[:, 2, 3:3 + n] += coupling
        K[:, 3:3 + n, 2] += coupling


class _Part:
    """A group's members with their inner coordinates eliminated.

    Parameters
    ----------
    group
        The :class:`Group`.
    K
        Tangent of all beams.
    bases
        The :class:`_Basis` of both sides.
    turns, moments
        Of all ends, as the bases take them, shape (ends,).
    hinged
        Whether the members' starts and ends are, shape (M, 2): their rotations are their own.
    S
        What is left of all members, shape (members, 6, 6); that of these is set.

    Attributes
    ----------
    pivots
        Of the rotations of hinged ends, shape (k,).
    """

    def __init__(self, group: Group, K: BandMatrix, bases: Sequence[_Basis], turns: Array,
                 moments: Array, hinged: Array, S: Array) -> None:
        self.group, self._places = group, group.places
        sides = left, right = [basis(turns) for basis in bases]
        D, C = _blocks(K, group)
        nd, n = group.nd, group.elements
        first, to_first, last = D[:, 0], C[:, 0], D[:, 1]
        #: inner nodes: matrix, its inverse, that by the displacements of the start and the next one
        self._inner: list[tuple[Array, Array, Array]] = []
        for k in range(1, n):
            A, inverse = last, _inverse(last)
            X = _solved(A, inverse, np.concatenate([to_first, C[:, k].transpose(0, 2, 1)], axis=2))
            self._inner.append((A, inverse, X))
            first = first - to_first.transpose(0, 2, 1) @ X[:, :, :nd]
            last = D[:, k + 1] - C[:, k] @ X[:, :, nd:]
            to_first = -C[:, k] @ X[:, :, :nd]
        ends = np.empty((len(D), 2, nd, 2, nd))
        ends[:, 0, :, 0] = _between(left, first, left)
        ends[:, 1, :, 1] = _between(right, last, right)
        ends[:, 1, :, 0] = _between(right, to_first, left)
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
        #: forces at the ends, and displacements where these are held, by those on both end nodes
        self._forces = shared - W @ X[:, :, 6:]
        self._flexibility = own.transpose(0, 2, 1) @ X[:, :, 6:]
        self.pivots = np.concatenate([self._release(np.flatnonzero(turning), 3 * k + 2, rest)
                                      for k, turning in enumerate(hinged.T)])
        S[group.members] = rest

    def _release(self, some, k, S):
        """Eliminate rotation k of some members too, which is their own; returns the pivots."""
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
        """Signs of the eigenvalues of what was eliminated."""
        negative, singular = 0, False
        for A in [*(A for A, *_ in self._inner), self._outer]:
            size = 1.0 / np.sqrt(np.abs(A.diagonal(axis1=1, axis2=2)))
            A = size[:, :, None] * A * size[:, None]
            try:
                pivots = np.linalg.cholesky(A).diagonal(axis1=1, axis2=2) ** 2
                if np.min(pivots) > SMALL:
                    continue
            except np.linalg.LinAlgError:
                logger.debug("lines give way between their ends")
            values = np.linalg.eigvalsh(A)
            negative += int(np.sum(values < 0.0))
            singular = singular or bool(np.any(np.abs(values) < LOST))
        return Inertia(negative, singular)

    def reduce(self, b: Array) -> Array:
        """Forces (M, 6, k) at the ends from those on the coordinates, columns (N, k)."""
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
        """All displacements x (N, k) from those at the ends, (M, 6, k), after :meth:`reduce`."""
        nd, places = self.group.nd, self._places
        ends = self._forces.transpose(0, 2, 1) @ v + self._flexibility @ self._known[-1]
        x[self.group.end_places] = ends
        around = ends.copy()
        for k in range(self.group.elements - 1, 0, -1):
            around[:, nd:] = self._known[k - 1] - self._inner[k - 1][2] @ around
            x[places[:, k * nd:(k + 1) * nd]] = around[:, nd:]


def _beside(matrices):
    """Two matrices (M, nd, k) as blocks of one, (M, 2 nd, 2 k)."""
    M, nd, k = matrices[0].shape
    out = np.zeros((M, 2, nd, 2, k))
    out[:, 0, :, 0], out[:, 1, :, 1] = matrices
    return out.reshape(M, 2 * nd, 2 * k)


def _inverse(A):
    """The inverse of symmetric matrices, in units in which their diagonals are one."""
    size = np.sqrt(np.abs(A.diagonal(axis1=1, axis2=2)))
    scale = size[:, :, None] * size[:, None]
    return np.linalg.inv(A / scale) / scale


def _solved(A, inverse, B):
    """A^-1 B, as accurate as by factors: of what an inverse alone gives A leaves too much."""
    X = inverse @ B
    return X + inverse @ (B - A @ X)


def _between(S, A, T):
    """S^T A T."""
    return S.transpose(0, 2, 1) @ A @ T


def _blocks(K, group):
    """Of chains the matrices of nodes (M, elements + 1, nd, nd), and those between neighbours.

    The latter, (M, elements, nd, nd), have the rows of the right node.
    """
    nd, n, ld = group.nd, group.elements, K.band.ld
    a, b = np.arange(nd)[:, None], np.arange(nd)
    low, high = np.minimum(a, b), np.maximum(a, b)
    # columns of the band, node by node
    nodes = K.band.flat.reshape(-1, ld)[group.places].reshape(-1, n + 1, nd * ld)
    D, C = nodes.take(low * ld + high - low, axis=2), nodes[:, :n].take(b * ld + nd + a - b, axis=2)
    return D, C
