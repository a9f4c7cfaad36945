"""The tangent of a scene as a sum of squares of strains, and its accurate inverse.

An entry of the assembled tangent of a slender beam adds stiffnesses to axial strain and shear, E A,
of which bending, E I / L^2, is smaller than the round-off from L / h = 1e8 on, and inaccurate long
before. Where the strains ``B x`` are summed first nothing cancels: their round-off is that of
``eps |x| / L_e`` against ``h |x| / L^2``.
"""

from __future__ import annotations

import logging
from copy import copy
from typing import Any

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from ..actions.forces.kernels import add_elastic_force
from ..beam.kinematics import element_dofs, entries_of
from ..core.errors import ConvergenceError, SupportError
from ..core.types import Array
from .condensation import Condensed

#: Corrections of a solution; relative size of one that is the last, and of one that may be.
REFINEMENTS, REFINED, ACCEPTED = 6, 1e-12, 1e-6
#: Relative size of the correction of a state that is in equilibrium but for round-off.
NEAR = 1e-5
#: Tolerance of that correction, whose right-hand side is round-off.
ROUGH = 1e-2
#: Coordinates up to which a frame is not condensed.
FEW = 600
#: Ratio of one correction to the one before at which they lead nowhere.
SLOW = 0.5

logger = logging.getLogger(__name__)


class StrainTangent:
    """The tangent ``B^T (C B) + S`` of a scene, S the geometric part, loads and joints.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u, load, t, multipliers
        The state: displacement (N,), load factor, time of joints that move or None, and multipliers
        (m,).
    """

    def __init__(self, system: Any, u: Array, load: float, t: float | None,
                 multipliers: Array) -> None:
        self.system, self.free = system, np.nonzero(system.constraints.free)[0]
        self._at = u, load, t, load if t is None else t
        parts = [_beam_rows(beam, u[s]) for beam, s in zip(system.beams, system.slices)]
        rigid = system.N - sum(beam.N for beam in system.beams)
        if rigid:  # whose coordinates no strain depends on
            parts.append((*2 * [sparse.csr_matrix((0, rigid))], np.zeros(0)))
        self._rows = [_joined([part[k] for part in parts]) for k in range(2)]
        self.B, self.CB = self._rows
        if len(self.free) < system.N:
            self.B, self.CB = (rows[:, self.free] for rows in self._rows)
        #: shift and multipliers of a frame's factors, and they
        self._condensed: Any = 0.0, None, None
        self.stress = np.concatenate([part[2] for part in parts])
        #: where the stresses of the other beams begin
        self._first = np.cumsum([len(part[2]) for part in parts[:len(system.beams)]])[:-1]
        self.J = sparse.csr_matrix(system.constraints.jacobian(u, self._at[-1])[:, self.free])
        self._set_stress(self.stress, multipliers)

    def _set_stress(self, stress, multipliers):
        self.stress, self.multipliers = stress, multipliers
        self.S = self.geometric(stress, multipliers, self._at[1]) + self._elements()

    def _elements(self):
        """The derivative of the force elements, at free coordinates."""
        u, system = self._at[0], self.system
        i, j, v = system.forces.entries(system.backend.tables.plain.forces, self._at[3], u, 0.0 * u,
                                        0.0)
        K = sparse.csr_matrix((v, (i, j)), shape=(system.N, system.N))
        return K[self.free][:, self.free]

    def _element_force(self):
        system, force = self.system, np.zeros(self.system.N)
        u = np.array(self._at[0], dtype=float)
        add_elastic_force(system.backend.tables.plain.forces, self._at[3], 0.0, u, u, force)
        return force[self.free]

    def geometric(self, stress: Array, multipliers: Array, load: float) -> csr_matrix:
        """The part (n, n) of the tangent due to stresses (k,), multipliers (m,) and loads."""
        u, _, t, time = self._at
        S = [_beam_geometric(beam, u[s], own) for beam, s, own in zip(
            self.system.beams, self.system.slices, np.split(stress, self._first))]
        rigid = self.system.N - sum(part.shape[0] for part in S)
        if rigid:
            S.append(sparse.csr_matrix((rigid, rigid)))
        S = (_joined(S) + load_stiffness(self.system, u, load, t)
             + self.system.constraints.curvature(u, time, multipliers))
        return S[self.free][:, self.free]

    def response(self) -> tuple[Array, Array, Array]:
        """What the full load causes by linear theory: du (N,), stress (k,), multipliers (m,)."""
        system, u = self.system, self._at[0]
        du = np.zeros(system.N)
        du[system.constraints.fixed] = system.constraints.values(1.0)
        rest = (system.external_force(u)[self.free] - self._element_force()
                - self.B.T @ (self._rows[1] @ du))
        gap = -system.constraints.constraint(u + du, 1.0)
        x, multipliers = Inverse(self).solve_both(rest[:, None], gap[:, None])
        du[self.free] = x[:, 0]
        return du, self._rows[1] @ du, multipliers[:, 0]

    def balance(self, M: csr_matrix, shift: float) -> None:
        """Correct the stress to what is in equilibrium, if the state is one to round-off.

        The normal force of a slender beam is E A times a strain that is all round-off. The
        correction of the displacement is too small to matter; that of the stress is not. The matrix
        ``K + shift M``, with the mass (n, n) between free degrees of freedom, must have an inverse.
        """
        u, load, t, _ = self._at
        rest = (load * self.system.external_force(u, t)[self.free] - self.B.T @ self.stress
                - self.J.T @ self.multipliers - self._element_force())
        if not np.any(u) or not np.any(rest):
            return
        du, dm = Inverse(self, M, shift).solve_both(rest[:, None], accepted=ROUGH)
        weight = np.sqrt(abs((self.B.multiply(self.CB)).sum(axis=0)).A1)
        if np.max(weight * np.abs(du[:, 0])) <= NEAR * np.max(weight * np.abs(u[self.free])):
            self._set_stress(self.stress + self.CB @ du[:, 0], self.multipliers + dm[:, 0])

    def condense(self, condensed: Condensed, shift: float) -> Condensed:
        """Factors of ``K + shift M`` of a frame, condensed to its nodes; the last are kept.

        The ``condensed`` form of the system is left as it is.
        """
        (u, load, t, _), system = self._at, self.system
        if self._condensed[0] != shift or self._condensed[1] is not self.multipliers:
            own = copy(condensed)
            system.assemble(u, load, t=t)
            if shift:
                system.K.combine(1.0, system.K, shift, system.mass)
            own.factorize(u, self.multipliers)
            self._condensed = shift, self.multipliers, own
        return self._condensed[2]

    @property
    def symmetric(self) -> bool:
        """True if the tangent is symmetric between the free coordinates, to round-off."""
        return is_symmetric(self.S, self.system.constraints.coordinate_sizes[self.free])

    def multiply(self, x: Array, S: csr_matrix | None = None) -> Array:
        """The tangent times x, (n,) or (n, k); with S (n, n) in place of the geometric part."""
        return self.B.T @ (self.CB @ x) + (self.S if S is None else S) @ x

    @property
    def size(self) -> tuple[int, int]:
        """Number of free coordinates and of equations of joints."""
        return self.J.shape[1], self.J.shape[0]

    def require_independent(self) -> None:
        """Raise SupportError if equations of joints depend on each other in this state."""
        if not self.J.shape[0]:
            return
        R = scipy.linalg.qr(self.J.toarray().T, mode="r")[0]
        if np.min(np.abs(np.diag(R))) < 1e-12 * np.max(np.abs(R)):
            raise SupportError("the joints are not independent in this state")

    def internal(self, stress: Array) -> Array:
        """The internal force of stresses, shape (N,)."""
        return self._rows[0].T @ stress

    def material_energies(self, X: Array) -> Array:
        """x^T B^T C B x of each column x of X, shape (k,)."""
        return np.sum((self.B @ X) * (self.CB @ X), axis=0)

    def energies(self, X: Array) -> Array:
        """x^T K x of each column x of X, shape (k,)."""
        return self.material_energies(X) + np.sum(X * (self.S @ X), axis=0)


def _joined(parts):
    """The sparse matrices of all beams as one."""
    return parts[0] if len(parts) == 1 else sparse.block_diag(parts, format="csr")


def _beam_rows(beam, u):
    """B and C B of one beam as sparse matrices, and its weighted stresses."""
    B, CB, stress = beam.kernel.gradients(u)
    n, stress = B.shape[2], stress.ravel()
    j = np.broadcast_to(element_dofs(beam)[:, None], B.shape).ravel()
    first = n * np.arange(len(stress) + 1)
    return (*(sparse.csr_matrix((x.ravel(), j, first), shape=(len(stress), beam.N))
              for x in (B, CB)), stress)


def _beam_geometric(beam, u, stress):
    """The geometric part of one beam, sparse."""
    if not np.any(stress):
        return sparse.csr_matrix((beam.N, beam.N))
    S = beam.kernel.geometric(u, stress.reshape(beam.mesh.nelements, -1))
    return sparse.csr_matrix((S.ravel(), entries_of(element_dofs(beam))), shape=(beam.N, beam.N))


def is_symmetric(S: csr_matrix, sizes: Array) -> bool:
    """True if a sparse matrix is symmetric to round-off, beside sizes (n,) of its variables."""
    D = sparse.diags(sizes)
    S = D @ S @ D
    gap = abs(S - S.T)
    return not gap.nnz or bool(gap.max() <= 1e-12 * abs(S).max())


def load_stiffness(system: Any, u: Array, load: float, t: float | None = None) -> csr_matrix:
    """Minus the derivative (N, N) of the loads at u (N,), for a load factor and a time or None."""
    K = sparse.csr_matrix((system.N, system.N))
    for item in system.loads:
        if item.constant:
            continue
        s = system.of(item)
        factor, acting = item.acting(t)
        i, j, v = acting.stiffness(u[s])
        K = K - sparse.csr_matrix((load * factor * v, (s.start + i, s.start + j)),
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

    def __init__(self, tangent: StrainTangent, M: Any = None, shift: float = 0.0) -> None:
        self._tangent, self._n = tangent, tangent.size[0]
        self._M, self._shift = M, shift
        self._rest = tangent.S + shift * M if shift else tangent.S
        self._by_strains, self._nodes = False, None
        #: relative error of the factors alone, of the last solution
        self.left = np.inf
        condensed = tangent.system.solver.condensed
        if condensed is not None and self._n > FEW:
            self._nodes = tangent.condense(condensed, shift)
        else:
            self._lu = self._factors(self._scaled(), [])

    def _scaled(self):
        """The assembled matrix, after the units of coordinates and joints have been found."""
        tangent, m = self._tangent, self._tangent.size[1]
        K = tangent.B.T @ tangent.CB + self._rest
        # unit diagonal: coordinates and joints have units of their own
        diagonal = abs(K.diagonal())
        diagonal[diagonal == 0.0] = 1.0
        self._d = 1.0 / np.sqrt(diagonal)
        J = tangent.J @ sparse.diags(self._d)
        size = np.sqrt(np.asarray(J.multiply(J).sum(axis=1)).ravel()) if m else np.zeros(0)
        self._e = 1.0 / np.where(size > 0, size, 1.0)
        return K

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
        if self._nodes is not None:
            self._scaled()
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
        if self._nodes is not None and not self._by_strains:
            return self._nodes.solve(b, c)
        b, c = self._d[:, None] * b, self._e[:, None] * c
        if self._by_strains:
            none = np.zeros((self._tangent.B.shape[0], b.shape[1]))
            x = self._lu.solve(np.concatenate([none, b / self._small, c]))[len(none):]
            x[self._n:] *= self._small
        else:
            x = self._lu.solve(np.concatenate([b, c]))
        return self._d[:, None] * x[:self._n], self._e[:, None] * x[self._n:]

    def solve(self, b: Array) -> Array:
        """x for columns b, shape (n, k) or (n,).

        Raises
        ------
        ConvergenceError
            If the refinement does not converge.
        """
        return self.solve_both(b.reshape(self._n, -1))[0].reshape(b.shape)

    def once(self, b: Array) -> Array:
        """x for a column b, shape (n,), by the factors alone: wrong by about :attr:`left`."""
        return self._once(b[:, None], np.zeros((self._tangent.size[1], 1)))[0][:, 0]

    def solve_both(self, b: Array, c: Array | None = None,
                   accepted: float = ACCEPTED) -> tuple[Array, Array]:
        """x (n, k) and l (m, k) for columns b and ``J x = c``, 0 by default.

        The size of the last correction is ``accepted`` at most, relative to x in the energy norm.
        """
        c = np.zeros((self._tangent.size[1], b.shape[1])) if c is None else c
        x, l, good = self._refined(b, c, accepted)
        if not good and not self._by_strains:
            logger.info("assembled stiffnesses are too inaccurate: stresses become unknowns")
            self._use_strains()
            x, l, good = self._refined(b, c, accepted)
        if not good:
            raise ConvergenceError(
                "this tangent cannot be inverted in double precision: the beam is too slender for "
                "elements so short, or the state is critical to round-off")
        return x, l

    def _norm(self, x):
        """The energy norm of the largest of columns x."""
        energy = self._tangent.material_energies(x)
        if self._shift:
            energy = energy + self._shift * np.sum(x * (self._M @ x), axis=0)
        return np.sqrt(np.max(np.abs(energy)))

    def _refined(self, b, c, accepted):
        J, before = self._tangent.J, np.inf
        x, l = self._once(b, c)
        for k in range(REFINEMENTS):
            rest = b - self._tangent.multiply(x, self._rest) - J.T @ l
            dx, dl = self._once(rest, c - J @ x)
            x, l = x + dx, l + dl
            size, step = self._norm(x), self._norm(dx)
            if k == 0:
                self.left = step / size if size > 0.0 else np.inf
            # the next correction is that part of this one that this is of the one before
            if not step * step > REFINED * size * min(size, before):
                break
            if not step < SLOW * before:
                return x, l, step <= accepted * size
            before = step
        return x, l, step <= accepted * size
