"""Linear systems ``[K, J^T; J, 0] [x; l] = [b; c]`` of a scene, and their inertia. There are four
ways: LAPACK for a band matrix alone; a Schur complement for few multipliers and a definite K;
sparse LU on the null space of J, also for entries outside of the band; static condensation for
frames. Systems with the mass matrix, and modal damping."""

import logging
from collections.abc import Callable
from copy import copy
from typing import Any
from weakref import proxy

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..actions.forces.kernels import rests
from ..core.band import (SMALL, Band, BandMatrix, Inertia, dense, factorize, fix,
                         solve_dependent)
from ..core import Array, cached_property, handle_of, refuse
from .condensation import Condensed, CondensedMass
from .rank import DEPENDENT, Block, blocks, determinant_sign, diagonal_factors, inertia_of

logger = logging.getLogger(__name__)

#: Smallest relative pivot of a definite matrix.
SURE = 1e-10
#: Largest relative residual of factors without pivoting.
ROUGH = 1e-8


class Last:
    """The last factors of a matrix that is more than a band, and its groups of equations."""

    factors: "BandMatrix | Schur | NullSpace | None" = None
    _of: Any = None

    def blocks(self, rows: Array, columns: Array, m: int, n: int) -> list[Block]:
        """The :func:`blocks` of J, cached."""
        of = self._of
        if of is None or not (np.array_equal(of[0], rows) and np.array_equal(of[1], columns)):
            of = self._of = rows, columns, blocks(rows, columns, m, n)
        return of[2]


class LinearSolver:
    """Factorises the tangent of a system with its supports and joints, and solves with it. The
    joints are linearised at a displacement u (N,), a time t and multipliers (m,)."""

    def __init__(self, system: Any) -> None:
        self._system, self.handle = proxy(system), handle_of(self)
        self._at: tuple[Array, float] = np.zeros(0), 0.0
        self._last = Last()
        #: True if the matrix is more than a band: multipliers, or force elements between distant
        #: nodes.
        self.coupled = bool(system.constraints.joints) or system.forces.couples_far
        #: True if it is only while changing elements do something.
        self.at_times = not (system.constraints.joints or len(system.forces.border_rows))
        if not self.coupled:
            self.keep_band()

    def after(self, system: Any) -> "LinearSolver":
        """A copy for a system with another history; matrices and factors are shared."""
        _ = self.condensed, self._supports
        other = copy(self)
        other._system, other.handle = proxy(system), handle_of(other)
        return other

    @cached_property
    def condensed(self) -> Condensed | None:
        """The condensed form of a frame, or None."""
        s = self._system
        if not s.constraints.condensable or not s.symmetric or s.forces.couples_far:
            return None
        return Condensed(s, s.K)

    def assembled_at(self, u: Array, t: float) -> None:
        """Store the displacement (N,) and time (or load factor) of the assembled band."""
        self._at = np.array(u), float(t)

    def _far_entries(self):
        """Entries of force elements outside of the band, at free DOFs."""
        s = self._system
        i, j, w, place = s.forces.border_entries
        u, t = self._at
        if len(i):
            w = w * s.forces.stiffness(s.backend.tables.plain.forces, t, u, 0.0 * u, 0.0)[place]
        if s.forces.changing:
            i, j, w = (np.append(a, b) for a, b in zip(
                (i, j, w), s.forces.changing_entries(t, u, u)))
        free = s.constraints.free
        return i, j, w * (free[i] & free[j])

    def multiply(self, v: Array) -> Array:
        """The assembled tangent times v (N,), before :meth:`factorize`."""
        out = self._system.K.multiply(v)
        if self._system.forces.couples_far:
            i, j, values = self._far_entries()
            out = out + np.bincount(i, values * v[j], self._system.N)
        return out

    @cached_property
    def _supports(self):
        """Places in the band of the entries of fixed DOFs that are 0, and that are 1."""
        band = self._system.K
        marked = band._replace(flat=np.full(band.flat.size, np.nan))
        fix(marked, self._system.constraints.fixed)
        return (marked.flat == 0.0).nonzero()[0], (marked.flat == 1.0).nonzero()[0]

    def factorize(self, u: Any = None, t: float = 0.0, multipliers: Any = None) -> None:
        """Fix the supports and factorise with the joints; LinAlgError if it is singular."""
        s, constraints = self._system, self._system.constraints
        (zeros, ones), entries = self._supports, s.K.flat
        entries[zeros], entries[ones] = 0.0, 1.0
        if not self.coupled:
            s.K.factorize()
            return
        if self.condensed is not None:
            self.condensed.factorize(u, multipliers)
            return
        if u is not None:
            self.assembled_at(u, t)
        if self.at_times and rests(s.forces, self._at[0], 0.0):
            s.K.factorize()
            self.keep_band()
            return
        J = constraints.jacobian_entries(u, t)
        more = tuple(np.append(a, b) for a, b in zip(
            constraints.curvature_entries(u, t, multipliers), self._far_entries()))
        inside = np.abs(more[0] - more[1]) <= s.K.width
        s.K.add(*(x[inside] for x in more))
        more = tuple(x[~inside] for x in more)
        self._last.factors = None
        if not len(more[0]) and not constraints.m:
            s.K.factorize()
            self.keep_band()
            return
        if s.symmetric and not len(more[0]) and constraints.few:
            try:
                self._last.factors = Schur(s.K, J, constraints)
                return
            except np.linalg.LinAlgError:
                logger.debug("the band is not definite without the joints")
        self._last.factors = NullSpace(s.K, J, more, constraints, self._last)

    @property
    def _factors(self):
        found = self._last.factors if self.condensed is None else self.condensed
        if found is None or (found is self.condensed and not found.ready):
            raise np.linalg.LinAlgError("there are no factors")
        return found

    def solve(self, residual: Array, phi: Any = None) -> tuple[Array, Array]:
        """x and multipliers for forces (N,) and constraint residuals (m,)."""
        b, c = residual * self._system.constraints.mask, np.zeros(0) if phi is None else phi
        found = self._factors
        return (found.solve(b), c) if isinstance(found, BandMatrix) else found.solve(b, c)

    def solve_into(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                   dm: Array) -> None:
        """Factorise and solve within a kernel for R at free DOFs."""
        self.factorize(u, t, multipliers)
        if self.coupled:
            du[:], dm[:] = self.solve(R, phi)
        else:  # without detours
            du[:] = self._system.K.solve(R)

    def inertia(self) -> Inertia:
        """Inertia of the symmetric part of the factorised tangent at the free DOFs, on the null
        space of J.

        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(5),
        ...                    StVenantKirchhoff(2e8, 0.3), width=0.01)).pin("left").pin("right")
        >>> system = scene.system
        >>> u = np.zeros(system.N)
        >>> u.reshape(-1, 6)[:, 0] = [0, -1e-4, -2e-4]  # compressed by 2.4 times Euler's load
        >>> u.reshape(-1, 6)[:, 2] = -2e-4
        >>> _ = system.assemble(u)
        >>> system.solver.factorize(u)
        >>> system.solver.inertia()
        Inertia(negative=1, singular=False)
        """
        return self._factors.inertia()

    def determinant_sign(self) -> int:
        """Sign of the determinant of the matrix of :meth:`inertia`, but of the unsymmetric one."""
        if isinstance(self._last.factors, NullSpace):
            return determinant_sign(self._last.factors.reduced())
        if isinstance(self._last.factors, BandMatrix):
            return self._last.factors.determinant_sign()
        return -1 if self.inertia().negative % 2 else 1

    def keep_band(self) -> None:
        """Take the factors of the band for those of the whole."""
        self._last.factors = self._system.K

    def forget(self) -> None:
        """Discard all factors."""
        self._system.K.clear()
        if self.coupled:
            self._last.factors = None
        if self.condensed is not None:
            self.condensed.forget()

    def stays(self) -> bool:
        """True if the last factors of an iteration show a definite tangent."""
        if not self.coupled:
            return self._system.K.definite
        known = self._last.factors if self.condensed is None else self.condensed.ready
        return bool(known) and self._system.symmetric and self.inertia() == Inertia(0, False)


class Schur:
    """Factors of ``[K, J^T; J, 0]`` by those of a band matrix K; LinAlgError if that is not
    positive definite. Equations between neighbouring DOFs, such as a clamp at an angle, are added
    to K with a stiffness w: ``K + J^T w J`` has the same solution x, and l is smaller by w c."""

    def __init__(self, K: BandMatrix, J: Any, constraints: Any) -> None:
        self._K, self._J, before = K, constraints.to_dense(*J), K.flat.copy()
        self._weights, size = np.zeros(constraints.m), np.abs(K.diagonal())
        for k, row in enumerate(self._J):
            at, = np.nonzero(row)
            if len(at) and np.ptp(at) <= K.width:
                self._weights[k] = w = np.max(size[at]) / np.max(np.abs(row)) ** 2
                K.add(np.repeat(at, len(at)), np.tile(at, len(at)),
                      w * np.outer(row[at], row[at]).ravel())
        definite = K.factorize().definite
        if not definite or np.any(K.pivot_values() < SURE * K.diagonal()):
            K.flat[:] = before
            raise np.linalg.LinAlgError("the matrix is not positive definite")
        self._Y = K.solve(self._J.T)
        self._S = self._J @ self._Y

    def solve(self, b: Array, c: Array) -> tuple[Array, Array]:
        """Solve for right-hand sides b (n,) and c (m,); returns x and l."""
        x = self._K.solve(b)
        l = np.linalg.solve(self._S, self._J @ x - c)
        return x - self._Y @ l, l + self._weights * c

    def inertia(self) -> Inertia:
        """Inertia of K on the null space of J."""
        return Inertia(0, False)


# the null space of J: each joint equation eliminates a DOF, x = T y + x_0 with J T = 0. The reduced
# matrix T^T K T is symmetric if K is, and its pivots give the inertia

def eliminated(A: Array) -> tuple[Array, Array, Array]:
    """Pivots (g, k), row echelon forms R of A (g, k, c), and M with ``M A = R``; LinAlgError."""
    g, k, c = A.shape
    size = np.max(np.abs(A), axis=2, initial=0.0)
    if not np.all(size):
        raise np.linalg.LinAlgError("a joint repeats a support")
    R = np.concatenate([A / size[:, :, None], np.broadcast_to(np.eye(k), (g, k, k))], axis=2)
    each, pivots, left = np.arange(g), np.empty((g, k), int), np.ones((g, k, 1))
    for _ in range(k):
        row, column = np.divmod(np.argmax(np.abs(R[:, :, :c] * left).reshape(g, -1), axis=1), c)
        pivot = R[each, row, column]
        if np.any(np.abs(pivot) <= DEPENDENT):
            raise np.linalg.LinAlgError("the joints are dependent in this state")
        R[each, row] /= pivot[:, None]
        factor = R[each, :, column]
        factor[each, row] = 0.0
        R -= factor[:, :, None] * R[each, row][:, None]
        pivots[each, row], left[each, row] = column, 0.0
    return pivots, R[:, :, :c], R[:, :, c:] / size[:, None]


class NullSpace:
    """Sparse factors of ``[K, J^T; J, 0]``. ``entries`` are those of K outside of the band K;
    ``last`` has the groups of joint equations."""

    def __init__(self, K: BandMatrix, J: Any, entries: Any, constraints: Any,
                 last: Last) -> None:
        self._sizes, self._shape = s, (m, n) = constraints.coordinate_sizes, (constraints.m, K.n)
        self._K = K.tocsc()
        if len(entries[0]):
            i, j, v = entries
            self._K = self._K + sparse.csc_array((v, (i, j)), shape=(n, n))
        self._K.data *= s[self._K.indices] * np.repeat(s, np.diff(self._K.indptr))
        self._groups, given = [], np.zeros(n, bool)
        rows, columns, values = J
        for block in last.blocks(rows, columns, m, n):
            (g, k), c = block.rows.shape, block.columns.shape[1]
            A = np.bincount(block.places, (values * s[columns])[block.entries], g * k * c)
            pivots, R, M = eliminated(A.reshape(g, k, c))
            at = np.take_along_axis(block.columns, pivots, axis=1)
            given[at] = True
            self._groups.append((block, at, R, M))
        # a basis (n, n - m) of the null space of J
        free = np.flatnonzero(~given)
        number = np.cumsum(~given) - 1
        parts = [(free, number[free], np.ones(len(free)))]
        for block, at, R, _ in self._groups:
            g, a, b = np.nonzero(R * ~given[block.columns][:, None])
            parts.append((at[g, a], number[block.columns[g, b]], -R[g, a, b]))
        i, j, v = map(np.concatenate, zip(*parts))
        self._T = sparse.csc_array((v, (i, j)), shape=(n, len(free)))
        self._reduced = (self._T.T @ self._K @ self._T).tocsc() if m else self._K
        lu = diagonal_factors(self._reduced, "MMD_AT_PLUS_A") if K.symmetric else None
        self._plain = lu is not None  # all pivots are on the diagonal
        self._lu = splu(self._reduced) if lu is None else lu

    def solve(self, b: Array, c: Array) -> tuple[Array, Array]:
        x, b, T = np.zeros(self._shape[1]), self._sizes * b, self._T
        for block, at, _, M in self._groups:
            x[at] = (M @ c[block.rows][:, :, None])[:, :, 0]
        right = T.T @ (b - self._K @ x)
        y = self._lu.solve(right)
        if self._plain:
            left = right - self._reduced @ y
            largest = np.max(np.abs(right) + abs(self._reduced) @ np.abs(y), initial=0.0)
            if np.max(np.abs(left), initial=0.0) > ROUGH * largest:
                logger.debug("factors without pivoting are not accurate")
                self._lu, self._plain = splu(self._reduced), False
                y = self._lu.solve(right)
            else:
                y += self._lu.solve(left)
        x += T @ y
        rest, l = b - self._K @ x, np.empty(self._shape[0])
        for block, at, _, M in self._groups:
            l[block.rows] = (M.transpose(0, 2, 1) @ rest[at][:, :, None])[:, :, 0]
        return self._sizes * x, l

    def reduced(self) -> Any:
        """K on the null space of J, dense if small."""
        return self._reduced.toarray() if self._shape[1] <= 100 else self._reduced

    def inertia(self) -> Inertia:
        """Inertia of the symmetric part of K on the null space of J."""
        if self._plain:
            pivots, diagonal = self._lu.U.diagonal()[self._lu.perm_c], self._reduced.diagonal()
            if np.all(pivots > SMALL * np.abs(diagonal)):
                return Inertia(0, False)
        A = self.reduced()
        return inertia_of(0.5 * (A + A.T))


# the mass matrix

#: Number of joint equations above which time integration condenses a frame.
MANY = 48


class MassSolver:
    """Solves ``M x + J^T l = b``, ``J x = rate`` at free DOFs; x is zero at fixed ones."""

    def __init__(self, system: Any) -> None:
        self._system = proxy(system)

    @cached_property
    def factors(self) -> BandMatrix:
        """Factors of the mass matrix with its supports fixed."""
        s = self._system
        M = s.new_band().combine(1.0, s.mass, 0.0, s.mass)
        fix(M, s.constraints.fixed)
        if not factorize(M):
            refuse(s.forces.masses, "the mass matrix is singular to round-off: a mass or inertia "
                   "of {!r} is too large compared with the beams", s.forces.masses)
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        M.factors = Band(*M)
        return M

    @cached_property
    def by_nodes(self) -> bool:
        """True if time integration condenses a frame to its nodes."""
        s = self._system
        return (s.constraints.condensable and not s.forces.couples_far and s.constraints.m > MANY
                and not len(s.damping.modal))

    @cached_property
    def _condensed(self):
        return CondensedMass(self._system)

    def __call__(self, u: Array, t: float, J: Any) -> Callable[[Array, Array], tuple[Array, Array]]:
        """A function of b (N,) and rate (m,) that returns x and l, at one displacement and time."""
        # J is ``constraints.full_jacobian(u, t)`` if there are joints.
        if self.by_nodes:
            mass = self._condensed
            mass.forget()

            def solve_by_nodes(b: Array, rate: Array) -> tuple[Array, Array]:
                mass.forget(factors=False)
                return mass.solve(u, t, b, rate)

            return solve_by_nodes
        M, free = self.factors, self._system.constraints.free
        if not self._system.constraints.m:
            return lambda b, rate: (M.solve(b * free), np.zeros(0))
        J = dense(J) * free
        Y = M.solve(J.T)
        S = J @ Y

        def solve(b: Array, rate: Array) -> tuple[Array, Array]:
            x = M.solve(b * free)
            multipliers = J @ x - rate
            if not solve_dependent(S.copy(), multipliers):
                raise np.linalg.LinAlgError("the joints are dependent in this state")
            return x - Y @ multipliers, multipliers

        return solve


class ModalDamping:
    """Damping of single modes: the force on a velocity v is ``(rows @ v) @ rows``, rows (k, N)."""

    def __init__(self, system: Any,
                 rest_modes: Callable[[Any, int], tuple[Array, Array]] | None) -> None:
        self._system = proxy(system)
        ratios, self.rows = system.damping.modal, np.zeros((0, system.N))
        if ratios.any() and rest_modes is not None:
            frequencies, shapes = rest_modes(system, len(ratios))
            weights = np.sqrt(2.0 * ratios * np.maximum(frequencies, 0.0))
            rows = np.array([c * system.mass.multiply(x) for c, x in zip(weights, shapes)])
            self.rows = np.ascontiguousarray(rows[weights > 0.0])

    def force(self, v: Array) -> Array:
        """The damping force for a velocity v, shape (N,)."""
        return (self.rows @ v) @ self.rows

    def acceleration(self, v: Array) -> Array:
        """M^-1 times :meth:`force`, shape (N,)."""
        return (self.rows @ v) @ self._shapes

    @cached_property
    def _shapes(self):
        if not len(self.rows):
            return self.rows
        return splu(self._system.mass.tocsc()).solve(self.rows.T).T
