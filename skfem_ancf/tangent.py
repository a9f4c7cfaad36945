"""The tangent of a scene as a sum of squares of strains, and its accurate inverse.

An entry of the assembled tangent of a slender beam adds stiffnesses to axial strain and shear, E A,
of which bending, E I / L^2, is smaller than the round-off from L / h = 1e8 on, and inaccurate long
before. Where the strains ``B x`` are summed first nothing cancels: their round-off is that of
``eps |x| / L_e`` against ``h |x| / L^2``.
"""

import logging

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.linalg import splu

from .errors import ConvergenceError, SupportError

#: Corrections of a solution; relative size of one that is the last, and of one that may be.
REFINEMENTS, REFINED, ACCEPTED = 6, 1e-12, 1e-6
#: Ratio of one correction to the one before at which they lead nowhere.
SLOW = 0.5

logger = logging.getLogger(__name__)


class StrainTangent:
    """The tangent ``B^T (C B) + S`` of a scene, S the geometric part, loads and joints.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    u, load, t, multipliers
        The state.
    """

    def __init__(self, system, u, load, t, multipliers):
        B, CB, S = [], [], []
        for beam, s in zip(system.beams, system.slices):
            parts = _beam_parts(beam, u[s])
            B.append(parts[0])
            CB.append(parts[1])
            S.append(parts[2])
        self.system, self.free = system, np.nonzero(system.free)[0]
        self.B, self.CB = (sparse.block_diag(part, format="csr")[:, self.free] for part in (B, CB))
        S = sparse.block_diag(S, format="csr") + load_stiffness(system, u, load, t)
        time = load if t is None else t
        self.S = (S + system.curvature(u, time, multipliers))[self.free][:, self.free]
        self.J = sparse.csr_matrix(system.jacobian(u, time)[:, self.free])

    @property
    def symmetric(self):
        """True if the tangent is symmetric between the free coordinates, to round-off."""
        gap = abs(self.S - self.S.T)
        return gap.max() <= 1e-12 * abs(self.S).max() if gap.nnz else True

    def multiply(self, x, S=None):
        """The tangent, or with another S, times x, shape (n,) or (n, k)."""
        return self.B.T @ (self.CB @ x) + (self.S if S is None else S) @ x

    @property
    def size(self):
        """Number of free coordinates and of equations of joints."""
        return self.J.shape[1], self.J.shape[0]

    def require_independent(self):
        """Raise SupportError if equations of joints depend on each other in this state."""
        if not self.J.shape[0]:
            return
        R = scipy.linalg.qr(self.J.toarray().T, mode="r")[0]
        if np.min(np.abs(np.diag(R))) < 1e-12 * np.max(np.abs(R)):
            raise SupportError("the joints are not independent in this state")

    def energies(self, X):
        """x^T K x of each column of X, shape (k,)."""
        return (np.sum((self.B @ X) * (self.CB @ X), axis=0)
                + np.sum(X * (self.S @ X), axis=0))


def _beam_parts(beam, u):
    """B, C B and S of one beam as sparse matrices."""
    kernel, nd = beam.kernel, beam.nd
    rows, cols, B, CB, i, j, S, first = [], [], [], [], [], [], [], 0
    for part in kernel.chunks():
        b, cb, s = kernel.factors(kernel.gather(u, part), part)
        ne, m, n = b.shape
        dofs = nd * beam.mesh.t[0, part][:, None] + np.arange(n)
        number = first + np.arange(ne * m).reshape(ne, m, 1)
        first += ne * m
        rows.append(np.broadcast_to(number, b.shape).ravel())
        cols.append(np.broadcast_to(dofs[:, None], b.shape).ravel())
        B.append(b.ravel())
        CB.append(cb.ravel())
        i.append(np.broadcast_to(dofs[:, :, None], s.shape).ravel())
        j.append(np.broadcast_to(dofs[:, None, :], s.shape).ravel())
        S.append(s.ravel())
    where = np.concatenate(rows), np.concatenate(cols)
    B, CB = (sparse.csr_matrix((np.concatenate(x), where), shape=(first, beam.N)) for x in (B, CB))
    return B, CB, sparse.csr_matrix((np.concatenate(S), (np.concatenate(i), np.concatenate(j))),
                                    shape=(beam.N, beam.N))


def load_stiffness(system, u, load, t=None):
    """Minus the derivative of the loads by the coordinates, sparse, shape (N, N)."""
    K = sparse.csr_matrix((system.N, system.N))
    for item in system.loads:
        if item.constant:
            continue
        s = system.of(item)
        i, j, v = item.stiffness(u[s])
        K = K - sparse.csr_matrix((load * item.factor(t) * v, (s.start + i, s.start + j)),
                                  shape=K.shape)
    return K


class Inverse:
    """Solves ``(K + shift M) x + J^T l = b``, ``J x = 0`` and refines by the strains.

    The factors are those of the assembled matrix, as long as they are good enough for the
    refinement to converge; then those of the larger matrix that has stresses as unknowns, whose
    condition number is the square root of the other's.

    Parameters
    ----------
    tangent
        A :class:`StrainTangent`.
    M
        The mass matrix between the free coordinates, sparse; None with no shift.
    shift
        A number.

    Raises
    ------
    SupportError
        If the matrix is singular.
    """

    def __init__(self, tangent, M=None, shift=0.0):
        self._tangent, self._n, m = tangent, *tangent.size
        self._rest = tangent.S + shift * M if shift else tangent.S
        K = tangent.B.T @ tangent.CB + self._rest
        # unit diagonal: coordinates and joints have units of their own
        diagonal = abs(K.diagonal())
        diagonal[diagonal == 0.0] = 1.0
        self._d = 1.0 / np.sqrt(diagonal)
        J = tangent.J @ sparse.diags(self._d)
        size = np.sqrt(np.asarray(J.multiply(J).sum(axis=1)).ravel()) if m else np.zeros(0)
        self._e = 1.0 / np.where(size > 0, size, 1.0)
        self._by_strains = False
        self._lu = self._factors(K, [])

    def _factors(self, K, stresses):
        """Factors of K between scaled coordinates, the joints, and rows for stresses before."""
        D, E = sparse.diags(self._d), sparse.diags(self._e)
        blocks = [[D @ K @ D]]
        if stresses:
            upper, left, diagonal = stresses
            blocks = [[diagonal, upper @ D], [D @ left, blocks[0][0]]]
        if len(self._e):
            J = E @ self._tangent.J @ D
            none = [None] * len(stresses[:1])
            blocks = [row + [None] for row in blocks]
            blocks[-1][-1] = J.T
            blocks.append(none + [J, None])
        try:
            return splu(sparse.bmat(blocks).tocsc())
        except RuntimeError:
            raise SupportError(
                "the tangent of this state is singular: joints are not independent, or a motion "
                "is free") from None

    def _use_strains(self):
        """Factors with the stresses ``C B x`` as unknowns, in units of the strains' stiffness."""
        B, CB = self._tangent.B, self._tangent.CB
        size, strain = (abs(A).max(axis=1).toarray().ravel() for A in (CB, B))
        held = (size == 0.0) | (strain == 0.0)  # strains of fixed coordinates only
        size = np.sqrt(np.where(held, 1.0, size) / np.where(held, 1.0, strain))
        W, number = sparse.diags(1.0 / size), len(size)
        self._by_strains, self._small = True, 1e-6
        self._lu = self._factors(
            self._rest / self._small,
            [W @ CB, B.T @ sparse.diags(size), -self._small * sparse.eye(number)])

    def _once(self, b, c):
        b, c = self._d[:, None] * b, self._e[:, None] * c
        if self._by_strains:
            none = np.zeros((self._tangent.B.shape[0], b.shape[1]))
            x = self._lu.solve(np.concatenate([none, b / self._small, c]))[len(none):]
            x[self._n:] *= self._small
        else:
            x = self._lu.solve(np.concatenate([b, c]))
        return self._d[:, None] * x[:self._n], self._e[:, None] * x[self._n:]

    def solve(self, b):
        """x for columns b, shape (n, k) or (n,).

        Raises
        ------
        ConvergenceError
            If the refinement does not converge.
        """
        columns = b.reshape(self._n, -1)
        x, good = self._refined(columns)
        if not good and not self._by_strains:
            logger.info("assembled stiffnesses are too inaccurate: stresses become unknowns")
            self._use_strains()
            x, good = self._refined(columns)
        if not good:
            raise ConvergenceError(
                "this tangent cannot be inverted in double precision: the beam is too slender for "
                "elements so short, or the state is critical to round-off")
        return x.reshape(b.shape)

    def _refined(self, b):
        J, before = self._tangent.J, np.inf
        x, l = self._once(b, np.zeros((len(self._e), b.shape[1])))
        for _ in range(REFINEMENTS):
            rest = b - self._tangent.multiply(x, self._rest) - J.T @ l
            dx, dl = self._once(rest, -(J @ x))
            x, l = x + dx, l + dl
            size, step = (np.abs(v / self._d[:, None]).max() for v in (x, dx))
            if not step > REFINED * size:
                break
            if not step < SLOW * before:
                return x, step < ACCEPTED * size
            before = step
        return x, step < ACCEPTED * size
