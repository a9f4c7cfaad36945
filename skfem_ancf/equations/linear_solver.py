"""The linear systems of a scene: ``[K, J^T; J, 0] [x; l] = [b; c]``, and the signature of K.

Four ways, by what there is beside the band of the beams: LAPACK alone; a Schur complement for a
few multipliers and couplings outside of the band; sparse LU of the saddle-point matrix for many;
static condensation for frames.
"""

from __future__ import annotations

import logging
from functools import cached_property
from typing import TYPE_CHECKING, Any
from weakref import proxy

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu

from ..core.band import fix
from ..core.linalg import INACCURATE, NO_FACTORS, SINGULAR, Inertia
from .border import Border, factors_of, join, mean_stiffness, solve_bordered, stiffen
from .condensation import Condensed
from .signature import determinant_sign, inertia_of, null_basis, row_sizes

if TYPE_CHECKING:
    from ..core.linalg import BandMatrix
    from ..core.types import Array
    from .border import Factors

logger = logging.getLogger(__name__)

#: Degrees of freedom up to which the tangent on the tangent space of joints is a dense matrix.
DENSE = 100
#: Eigenvalue of a border, of springs of unit stiffness, that may be round-off.
UNSURE = 1e-7
#: Rows, columns and values outside of a band.
Entries = tuple[Any, Any, Any]


class LinearSolver:
    """Factorises the tangent of a system with its supports and joints, and solves with it.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`, which has to live as long.
    """

    def __init__(self, system: Any) -> None:
        self._system = proxy(system)
        self._at: tuple[Array, float] = np.zeros(0), 0.0
        self._joined: Bordered | SaddlePoint | None = None
        self._border: Factors | None = None

    @property
    def coupled(self) -> bool:
        """True if the equations have more than a band: multipliers, or elements far apart."""
        return bool(self._system.constraints.joints) or self._system.forces.far

    @cached_property
    def condensed(self) -> Condensed | None:
        """What condenses a frame to its nodes; None of other scenes, and where more is coupled."""
        s = self._system
        if not s.constraints.condensable or not s.symmetric or s.forces.far:
            return None
        return Condensed(s, s.K)

    def assembled_at(self, u: Array, t: float) -> None:
        """Note where the band has been assembled: displacement (N,), and load factor or time."""
        self._at = np.array(u), float(t)

    def _far_entries(self) -> Entries:
        """What force elements have outside of the band, at free degrees of freedom."""
        s = self._system
        i, j, w, place = s.forces.far_entries()
        if not len(i):
            return i, j, w
        u, t = self._at
        D = s.forces.stiffness(s.machine.tables.plain.forces, t, u, 0.0 * u, 0.0)
        free = s.constraints.free
        return i, j, w * D[place] * (free[i] & free[j])

    def multiply(self, v: Array) -> Array:
        """The assembled tangent times a vector (N,), before :meth:`factorize`."""
        out = self._system.K.multiply(v)
        if self._system.forces.far:
            i, j, values = self._far_entries()
            out = out + np.bincount(i, values * v[j], self._system.N)
        return out

    def factorize(self, u: Any = None, t: float = 0.0, multipliers: Any = None) -> None:
        """Fix the supports in the tangent and factorise it, with the joints where there are any.

        Parameters
        ----------
        u, t
            Where the joints are linearised, shape (N,), and when.
        multipliers
            Theirs, shape (m,).

        Raises
        ------
        numpy.linalg.LinAlgError, RuntimeError
            If the matrix is singular.
        """
        s, constraints = self._system, self._system.constraints
        fix(s.K.band, constraints.fixed)
        if not self.coupled:
            s.K.factorize()
            return
        if self.condensed is not None:
            self.condensed.factorize(u, multipliers)
            return
        if u is not None:
            self.assembled_at(u, t)
        J = constraints.jacobian(u, t)
        entries = tuple(np.append(a, b) for a, b in zip(
            constraints.curvature_entries(u, t, multipliers), self._far_entries()))
        sizes = constraints.coordinate_sizes
        if not constraints.bordered:
            K = s.K.tocsc() + _sparse(entries, s.N)
            self._joined = SaddlePoint(K, J, sizes, constraints.free)
            return
        self._joined = Bordered(s.K, J, entries, constraints)
        self._border = self._joined.factors

    def solve(self, residual: Array, phi: Any = None) -> tuple[Array, Array]:
        """Solve with the factors.

        Parameters
        ----------
        residual
            Shape (N,); what it has at fixed degrees of freedom is ignored.
        phi
            What the constraints should change by, shape (m,), where there are joints.

        Returns
        -------
        du, multipliers
            The increments; the second is empty without joints.
        """
        s = self._system
        b, none = residual * s.constraints.mask, np.zeros(0)
        if not self.coupled:
            return s.K.solve(b), none
        solver = self._joined if self.condensed is None else self.condensed
        assert solver is not None
        return solver.solve(b, none if phi is None else phi)

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """Factorise and solve where no border about the band will do; False if that fails.

        Parameters
        ----------
        t, u, multipliers
            Time, and where the joints are linearised, shapes (N,) and (m,).
        R, phi
            Right-hand sides, shapes (N,) and (m,).
        du, dm
            The solution, shapes (N,) and (m,).
        """
        try:
            self.factorize(u, t, multipliers)
            du[:], dm[:] = self.solve(R, phi)
        except NO_FACTORS as error:
            logger.debug("no factors: %s", error)
            return False
        return True

    def inertia(self) -> Inertia:
        """Signs of the eigenvalues of the tangent that :meth:`factorize` has factorised.

        Of the free degrees of freedom, and with joints on the tangent space of their equations:
        how many directions there are in which the scene gives way. Of a tangent that is not
        symmetric they are those of its symmetric part.

        Examples
        --------
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
        K = self._system.K
        if not self.coupled:
            return (K if self._system.symmetric else K.symmetric_part()).inertia()
        if self.condensed is not None:
            return self.condensed.inertia()
        assert self._joined is not None
        if isinstance(self._joined, Bordered) and self._joined.is_definite():
            return Inertia(0, False)
        A = self._joined.reduced()
        return inertia_of(0.5 * (A + A.T))

    def determinant_sign(self) -> int:
        """The sign of the determinant of what :meth:`inertia` counts: 1 or -1.

        -1 is an odd number of negative eigenvalues, of a tangent that is not symmetric too.
        """
        if not self.coupled:
            return self._system.K.determinant_sign()
        if self.condensed is not None:
            return -1 if self.condensed.inertia().negative % 2 else 1
        assert self._joined is not None
        return determinant_sign(self._joined.reduced())

    def take_factors(self, factors: Factors) -> None:
        """Note that an iteration has left factors in the band, and in a border about it."""
        self._system.K.take_factors()
        self._border = factors

    def stays(self) -> bool:
        """True if the factors left by an iteration say that no direction gives way.

        Those of its last tangent, which is that of the solution but for the last correction.
        """
        s = self._system
        if self.condensed is not None:
            return self.condensed.ready and self.condensed.inertia() == Inertia(0, False)
        joints = s.constraints.joints
        if (not s.K.definite or s.forces.far or s.bodies
                or (joints and not s.constraints.bordered)):
            return False
        # what is definite is so on the tangent space of the joints
        return not joints or self._border is None or not len(self._border.S) or (
            not gives_way(self._border))


def _sparse(entries, n):
    i, j, values = entries
    return sparse.csc_array((values, (i, j)), shape=(n, n))


def _reduced(K, J, sizes):
    """The tangent on the tangent space of the joints, sparse if K is."""
    if isinstance(K, np.ndarray):
        T = null_basis(J * sizes) * sizes[:, None]
        return T.T @ K @ T
    T = sparse.csr_array(null_basis(sparse.csr_array(J * sizes)).multiply(sizes[:, None]))
    return (T.T @ K @ T).tocsc()


class SaddlePoint:
    """Sparse factors of ``[K, J^T; J, 0]``.

    Parameters
    ----------
    K, J
        Sparse, shapes (n, n) and (m, n).
    sizes
        Those of the degrees of freedom, which have units of their own, shape (n,).
    free
        Truth values of those that supports leave free, shape (n,).
    """

    def __init__(self, K: Any, J: Any, sizes: Array, free: Array) -> None:
        self._K, self._J, self._sizes = K, J, sizes
        J = sparse.csr_array(J)
        root = np.sqrt(np.mean((np.abs(K.diagonal()) * sizes**2)[free])) or 1.0
        #: rows and columns over their sizes: pivots need one unit
        self._scale = np.append(sizes / root, root / row_sizes(J.multiply(sizes)))
        S = sparse.dia_array((self._scale[None], 0), shape=2 * self._scale.shape)
        self._lu = splu((S @ sparse.block_array([[K, J.T], [J, None]]) @ S).tocsc())

    def solve(self, b: Array, c: Array) -> tuple[Array, Array]:
        """x (n,) and l (m,) for right-hand sides (n,) and (m,)."""
        x = self._scale * self._lu.solve(self._scale * np.append(b, c))
        return x[:len(b)], x[len(b):]

    def reduced(self) -> Any:
        """K where J x = 0, sparse."""
        return _reduced(self._K, self._J, self._sizes)


class Bordered:
    """Factors of ``[A, J^T; J, 0]`` by those of a band matrix and a Schur complement.

    ``A`` is the band matrix plus a few entries outside of its band. A beam that only joints hold
    has a singular matrix of its own: springs hold it before the band is factorised, and are
    taken away in the border, see :mod:`skfem_ancf.equations.border`. Where that is inaccurate a
    :class:`SaddlePoint` solves.

    Parameters
    ----------
    K : BandMatrix
        With its supports fixed. Springs, and the entries that lie in the band, are added to it.
    J
        Shape (m, n), dense and small.
    entries
        Rows, columns and values to add to K, of both halves where it is symmetric, shapes (k,).
    constraints
        The :class:`~skfem_ancf.equations.constraints.Constraints`, which say where springs are.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular.
    """

    def __init__(self, K: BandMatrix, J: Array, entries: Any, constraints: Any) -> None:
        self._K, self._J, self._sizes = K, J, constraints.coordinate_sizes
        self._free = constraints.free
        self._saddle: SaddlePoint | None = None
        (along, springs), loose = constraints.stiff, constraints.loose
        size, stiffness = np.abs(K.diagonal()), np.zeros(len(J))
        for row, first, last in along.tolist():
            stiffness[row] = stiffen(K.band, size, J[row], first, last)
        picked, S = _hold(K, entries, springs, self._sizes * constraints.mask, loose)
        none = np.zeros(0, np.int64)
        self._border = Border(picked, len(springs), loose, none, none, none, none, 0, along)
        self.factors = factors_of(K.band, K.factors, np.array(J), S)
        self.factors.stiffness[:] = stiffness
        join(self.factors, self._border, np.ones(J.shape[1]))
        if not np.all(np.isfinite(self.factors.H)) or np.linalg.slogdet(self.factors.H)[0] == 0.0:
            raise np.linalg.LinAlgError("the matrix is singular")

    def solve(self, b: Array, c: Array) -> tuple[Array, Array]:
        """x (n,) and l (m,) for right-hand sides (n,) and (m,), with one refinement."""
        x, l = np.empty(len(b)), np.empty(len(c))
        if self._saddle is None:
            error = float(solve_bordered(self.factors, self._border, b, c, x, l))
            if error < 0.0:
                raise np.linalg.LinAlgError("the matrix is singular")
            if error < INACCURATE:
                return x, l
            logger.debug("border inaccurate by %.3g: sparse LU", error)
            self._saddle = SaddlePoint(self._matrix(sparse=True), self._J, self._sizes, self._free)
        x, l = self._saddle.solve(b, c)
        return x, l + self.factors.stiffness * c

    def is_definite(self) -> bool:
        """True if A is positive definite where J x = 0; False where one band does not tell.

        ``A + J^T W J`` with a stiff W is so then. Its band is that of A where each joint is of one
        place.
        """
        springs = self._border.picked
        if len(springs) > self._border.springs:
            return False
        K = self._K.symmetric_part()
        K.add(springs, springs, np.diag(self.factors.S))
        size = np.abs(K.diagonal())
        for row in self._J:
            at, = np.nonzero(row)
            if np.ptp(at) > K.bandwidth:
                return False
            v = row[at] * (np.sqrt(np.max(size[at])) / np.max(np.abs(row)))
            i, j = np.repeat(at, len(at)), np.tile(at, len(at))
            K.add(i, j, np.outer(v, v).ravel())
        try:
            return bool(K.shifted(-SINGULAR).factorize().positive_definite)
        except np.linalg.LinAlgError:  # a body's direction, which has no stiffness to go by
            return False

    def _matrix(self, sparse: bool) -> Any:
        """A, stiff along directions, without the springs."""
        at, S = self._border.picked, self.factors.S
        if not sparse:
            A = self._K.toarray()
            np.add.at(A, (at[:, None], at), S)
            return A
        rows = np.broadcast_to(at[:, None], S.shape)
        return self._K.tocsc() + _sparse((rows.ravel(), rows.T.ravel(), S.ravel()), self._K.n)

    def reduced(self) -> Any:
        """A where J x = 0, sparse of many degrees of freedom.

        What stiff springs hold in a border lets go of with the round-off of their stiffness: of
        slender beams that is more than bending.
        """
        return _reduced(self._matrix(self._K.n > DENSE), self._J, self._sizes)


def _hold(K, entries, springs, sizes, loose):
    """Add entries and springs to a band matrix, and factorise it; see :class:`Bordered`.

    Returns the degrees of freedom ``picked`` and S: the matrix with its entries and without springs
    is ``K + P^T S P``, of which the rows of P pick springs and what lies outside of the band.
    """
    i, j, values = entries
    inside = np.abs(i - j) <= K.bandwidth
    K.add(i[inside], j[inside], values[inside])
    diagonal = np.abs(K.diagonal())
    stiffness = diagonal[springs]
    loosely = np.arange(len(springs)) >= len(springs) - loose
    loosely |= stiffness == 0.0
    stiffness[loosely] += mean_stiffness(diagonal, sizes) / sizes[springs[loosely]]**2
    K.add(springs, springs, stiffness)
    K.factorize()
    i, j, values = i[~inside], j[~inside], values[~inside]
    far, where = np.unique(np.append(i, j), return_inverse=True)
    picked, ns = np.append(springs, far), len(springs)
    S = np.zeros((len(picked), len(picked)))
    S[np.arange(ns), np.arange(ns)] = -stiffness
    np.add.at(S, (ns + where[:len(i)], ns + where[len(i):]), values)
    return picked, S


def gives_way(f: Factors) -> bool:
    """False if a matrix, symmetric with a border, is positive definite where J x = 0.

    By Haynsworth, of a K that is: ``[K, C; C^T, -S^-1 (+) 0]`` with the columns ``C = [P^T, J^T]``
    has as many negative eigenvalues as the border's ``-(S^-1 (+) 0) - C^T K^-1 C``, and as
    ``-S^-1`` and the bordered matrix together, which has one more for each row of J. The
    matrix of the border times S from both sides is ``[S, 0; 0, 1] H``, which factors have. What
    is too close to zero to tell, as what springs hold of slender beams, gives way.

    Parameters
    ----------
    f
        A :class:`~skfem_ancf.equations.border.Factors`.
    """
    k, n = len(f.S), len(f.H)
    S = f.S / (f.scale[:k, None] * f.scale[:k])
    size = np.ones(n)
    size[:k] = np.sqrt(np.abs(S).max(axis=1, initial=0.0))
    size[size == 0.0] = 1.0
    both = np.zeros((n + k, n + k))  # with -S beside it, for the directions that S adds
    both[:n, :n], both[n:, n:] = f.H, -S / (size[:k, None] * size[:k])
    both[:k, :n] = S @ f.H[:k]
    both[:n, :n] /= size[:, None] * size
    values, _, info = lapack.dsyevd(both, compute_v=0)  # increasing, of the upper half
    if info != 0:
        raise np.linalg.LinAlgError("the eigenvalues of the border are not found")
    least = UNSURE * max(-values[0], values[-1])
    negative, others = values.searchsorted(-least), values.searchsorted(least, "right")
    return bool(len(values) - others - negative != len(f.J))
