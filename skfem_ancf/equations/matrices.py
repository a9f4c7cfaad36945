"""Linear theory of a scene in a state: forces, sparse matrices, and the tangent by strains. The
entries of an assembled tangent add axial and shear stiffness E A to the bending stiffness E I /
L^2, which is below their round-off from L / h = 1e8 on. Summing the strains ``B x`` first avoids
the cancellation."""

import logging
from copy import copy
from typing import Any, NamedTuple, cast

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..actions.forces.kernels import add_elastic_force
from ..beam import element_dofs, entries_of
from ..beam.strain_energy import body_tangent
from ..core import Array, BandMatrix, ConvergenceError, InputError, SupportError
from .condensation import Condensed
from .rank import is_symmetric
from .system import System

#: Largest number of refinements; their tolerance, and the largest accepted correction.
REFINEMENTS, REFINED, ACCEPTED = 6, 1e-12, 1e-6
#: Largest relative correction of a state in equilibrium to round-off.
NEAR = 1e-5
#: Tolerance of that correction, whose right-hand side is round-off.
ROUGH = 1e-2
#: Number of DOFs below which a frame is not condensed.
FEW = 600
#: Contraction above which the refinement has failed.
SLOW = 0.5

logger = logging.getLogger(__name__)


# forces and energies to first and second order about a displacement, for linear theory


def linear_force(system: System, base: Array, d: Array, load: float = 1.0) -> Array:
    """f(base) + K(base) d, the linearised internal force in statics, shape (N,)."""
    return system.internal_force(base, None, load) + _stiffness_times(system, base, d, load)


def linear_energy(system: System, base: Array, d: Array, load: float = 1.0) -> float:
    """Strain energy and potential of force elements to second order in d (N,)."""
    if base.any() or system.forces.elements:
        second = 0.5 * d @ _stiffness_times(system, base, d, load)
    else:
        second = sum(b.kernel.small_energy(d[s]) for b, s in zip(system.beams, system.slices))
    return float(system.strain_energy(base, load) + second
                 + system.internal_force(base, None, load) @ d)


def linear_external_force(system: System, base: Array, d: Array) -> Array:
    """The linearised force of all loads at full load, shape (N,)."""
    # About the reference configuration the stiffness of the package's follower loads is neglected,
    # as in linear theory; that of user-defined loads counts.
    at_rest = not base.any()
    out = system.external_force(base) - load_stiffness(system, base, 1.0, None, at_rest) @ d
    for one in system.loads if at_rest else ():
        if one.eigen_stresses:  # eigenstrain of nonlinear laws
            s, load, (factor, acting) = system.of(one), cast("Any", one), one.factor_and_load(None)
            out[s] += load.beam.kernel.scatter(load.small_forces(load.at_rest)) - (
                factor * acting.force(base[s]))
    return out


def _stiffness_times(system, base, d, load):
    """The tangent of the internal force times d, by strains where possible."""
    out, at_rest = np.zeros(system.N), not base.any()
    if not d.any():
        return out
    for beam, s in zip(system.beams, system.slices):
        k = beam.kernel
        if at_rest:
            out[s] = k.scatter(k.small_forces(d[s]))
            continue
        K, u = k.tangents(base[s]), k.gather(d[s])
        out[s] = k.scatter(np.einsum("eij,ej->ei", K, u.reshape(len(K), -1)).reshape(u.shape))
    if system.forces.elements:
        out += system.element_stiffness(base, load) @ d
    return out


class SceneMatrices(NamedTuple):
    """The linearised equations of a scene in a state.

    ``M u'' + D u' + K u + J^T l = force``, ``J u = 0`` for changes of displacement u and
    multipliers l from the state, at the free degrees of freedom ``scene.free`` of all N. At an
    equilibrium the force is that of joints and supports.

    Attributes
    ----------
    M
        Mass matrix, (N, N), in CSR format; None if a material has no density.
    D
        Damping matrix, (N, N): minus the derivative of the force by the velocity.
    K
        Tangent stiffness, (N, N): minus the derivative of the force by the displacement, with the
        stress, loads and multipliers of the state. Points stick that touch an obstacle with
        friction, also those that slip.
    force
        Loads minus internal and damping force, shape (N,).
    J
        Jacobian of the joint equations, (m, N).
    """

    M: Any
    D: Any
    K: Any
    force: Array
    J: Any


def matrices_of(system: Any, state: Any) -> SceneMatrices:
    """The SceneMatrices of a System in one of its States, with its history of contact."""
    system = system.after(state.memory).sticking()
    u, v, t, tables = np.array(state.u), state.v, state.t, system.backend.tables
    time = state.load if t is None else t
    K = load_stiffness(system, u, state.load, t) + system.constraints.curvature(
        u, time, state.multipliers)
    D = sparse.csr_array((system.N, system.N))
    for beam, s in zip(system.beams, system.slices):
        i, j = entries_of(s.start + element_dofs(beam))
        K = K + _square(system, i, j, system.histories.kernel(beam).tangents(u[s]))
    if system.viscous:
        band, none = BandMatrix.zeros(system.N, system.bandwidth), tables.stresses
        body_tangent(tables.plain.viscous, u, 0.0 * u, none, True, tables.stresses, band)
        D = D + band.tocsc()
    if system.forces.elements:
        forces = tables.plain.forces
        i, j, k = system.forces.entries(forces, time, u, v, 0.0)
        K = K + _square(system, i, j, k)
        D = D + _square(system, i, j, system.forces.entries(forces, time, u, v, 1.0)[2] - k)
    try:
        M = sparse.csr_array(system.mass.tocsc())
    except InputError:  # no density
        M = None
    if system.damping:
        modes = sparse.csr_array(system.modal_damping.rows)
        D = D + system.damping.mass * M + modes.T @ modes
    force = state.load * system.external_force(u, t) - system.internal_force(u, t, state.load)
    if system.damped:
        force = force - system.damping_force(u, v, t)
    return SceneMatrices(M, sparse.csr_array(D), sparse.csr_array(K), force,
                         system.constraints.sparse_jacobian(u, time))


def _square(system, i, j, values):
    return sparse.csr_array((np.ravel(values), (i, j)), shape=(system.N, system.N))


# the tangent by strains, and its accurate inverse


class StrainTangent:
    """The tangent ``B^T C B + S`` of a scene; S is the part of stresses, loads and joints. The
    state is a displacement u (N,), a load factor, a time (or None) and multipliers (m,)."""

    def __init__(self, system: Any, u: Array, load: float, t: float | None,
                 multipliers: Array) -> None:
        self.system, self.free = system, np.nonzero(system.constraints.free)[0]
        self._at = u, load, t, load if t is None else t
        parts: list[Any] = []  # B and C B of each beam, sparse, and its weighted stresses
        for beam, s in zip(system.beams, system.slices):
            B, CB, stress = system.histories.kernel(beam).gradients(u[s])
            j = np.broadcast_to(element_dofs(beam)[:, None], B.shape).ravel()
            first = B.shape[2] * np.arange(stress.size + 1)
            parts.append((*(sparse.csr_matrix((x.ravel(), j, first), shape=(stress.size, beam.N))
                            for x in (B, CB)), stress.ravel()))
        rigid = system.N - sum(beam.N for beam in system.beams)
        if rigid:  # DOFs without strain
            parts.append((*2 * [sparse.csr_matrix((0, rigid))], np.zeros(0)))
        self._rows = [_joined([part[k] for part in parts]) for k in range(2)]
        self.B, self.CB = self._rows
        if len(self.free) < system.N:
            self.B, self.CB = (rows[:, self.free] for rows in self._rows)
        #: shift, multipliers and factors of a condensed frame
        self._condensed: Any = 0.0, None, None
        self.stress = np.concatenate([part[2] for part in parts])
        #: first stress of each beam but the first one
        self._first = np.cumsum([len(part[2]) for part in parts[:len(system.beams)]])[:-1]
        J = system.constraints.sparse_jacobian(u, self._at[-1])
        self.J = sparse.csr_matrix(J[:, self.free])
        self._set_stress(self.stress, multipliers)

    def _set_stress(self, stress, multipliers):
        self.stress, self.multipliers = stress, multipliers
        K = sparse.csr_matrix(self.system.element_stiffness(self._at[0], self._at[3]))
        self.S = self.geometric(stress, multipliers, self._at[1]) + K[self.free][:, self.free]

    def _element_force(self):
        system, force = self.system, np.zeros(self.system.N)
        u = np.array(self._at[0], dtype=float)
        add_elastic_force(system.backend.tables.plain.forces, self._at[3], 0.0, u, u, 0, force)
        return force[self.free]

    def geometric(self, stress: Array, multipliers: Array, load: float) -> sparse.csr_matrix:
        """The part S (n, n) for stresses (k,), multipliers (m,) and a load factor."""
        u, _, t, time = self._at
        S = []
        for beam, s, own in zip(self.system.beams, self.system.slices,
                                np.split(stress, self._first)):
            S.append(sparse.csr_matrix((beam.N, beam.N)) if not np.any(own) else sparse.csr_matrix(
                (beam.kernel.geometric(u[s], own.reshape(beam.mesh.nelements, -1)).ravel(),
                 entries_of(element_dofs(beam))), shape=(beam.N, beam.N)))
        rigid = self.system.N - sum(part.shape[0] for part in S)
        if rigid:
            S.append(sparse.csr_matrix((rigid, rigid)))
        S = (_joined(S) + load_stiffness(self.system, u, load, t)
             + self.system.constraints.curvature(u, time, multipliers))
        return S[self.free][:, self.free]

    def response(self, force: Array | None = None) -> tuple[Array, Array, Array]:
        """Linear response to the full load: du (N,), stress (k,), multipliers (m,); or to a force
        (N,) on top of the state."""
        system, u, du, gap = self.system, self._at[0], np.zeros(self.system.N), None
        if force is None:
            du[system.constraints.fixed] = system.constraints.values(1.0)
            rest = (system.external_force(u)[self.free] - self._element_force()
                    - self.B.T @ (self._rows[1] @ du))
            gap = -system.constraints.constraint(u + du, 1.0)[:, None]
        else:
            rest = force[self.free]
        x, multipliers = Inverse(self).solve_both(rest[:, None], gap)
        du[self.free] = x[:, 0]
        return du, self.stresses(du), multipliers[:, 0]

    def balance(self, M: sparse.csr_matrix, shift: float) -> None:
        """Replace the stress by one in equilibrium, if the state is an equilibrium to round-off."""
        # The axial stress of a slender beam has the round-off of the strain times E. The correction
        # of the displacement is negligible, that of the stress is not. ``K + shift M`` must be
        # invertible.
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
        """Condensed factors of ``K + shift M`` of a frame; the last ones are cached."""
        (u, load, t, _), system = self._at, self.system
        if self._condensed[0] != shift or self._condensed[1] is not self.multipliers:
            factors = copy(condensed)
            system.assemble(u, load, t=t)
            if shift:
                system.K.combine(1.0, system.K, shift, system.mass)
            factors.factorize(u, self.multipliers)
            self._condensed = shift, self.multipliers, factors
        return self._condensed[2]

    @property
    def symmetric(self) -> bool:
        """True if the tangent is symmetric to round-off."""
        return is_symmetric(self.S, self.system.constraints.coordinate_sizes[self.free])

    def multiply(self, x: Array, S: sparse.csr_matrix | None = None) -> Array:
        """The tangent times x, (n,) or (n, k); with another S if given."""
        return self.B.T @ (self.CB @ x) + (self.S if S is None else S) @ x

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of free DOFs and of joint equations."""
        return self.J.shape[1], self.J.shape[0]

    def stresses(self, du: Array) -> Array:
        """Stresses (k,) of a displacement du (N,) to first order."""
        return self._rows[1] @ du

    def internal(self, stress: Array) -> Array:
        """The internal force of stresses, shape (N,)."""
        return self._rows[0].T @ stress

    def material_energies(self, X: Array) -> Array:
        """x^T B^T C B x of each column of X, shape (k,)."""
        return np.sum((self.B @ X) * (self.CB @ X), axis=0)

    def energies(self, X: Array) -> Array:
        """x^T K x of each column of X, shape (k,)."""
        return self.material_energies(X) + np.sum(X * (self.S @ X), axis=0)


def _joined(parts):
    """Block diagonal matrix."""
    return parts[0] if len(parts) == 1 else sparse.block_diag(parts, format="csr")


def load_stiffness(system: Any, u: Array, load: float, t: float | None = None,
                   first_order: bool = False) -> sparse.csr_matrix:
    """Minus the derivative (N, N) of the loads at u (N,), or of those of first order alone."""
    K = sparse.csr_matrix((system.N, system.N))
    for item in system.loads:
        if item.constant or (first_order and not item.first_order):
            continue
        s = system.of(item)
        factor, acting = item.factor_and_load(t)
        i, j, v = acting.stiffness(u[s])
        K = K - sparse.csr_matrix((load * factor * v, (s.start + i, s.start + j)),
                                  shape=K.shape)
    return K


class Inverse:
    """Solves ``(K + shift M) x + J^T l = b``, ``J x = 0`` with iterative refinement by strains. The
    factors are those of the assembled matrix. If the refinement does not converge, they are those
    of the larger matrix with stresses as unknowns, which has the root of the condition number. M is
    the sparse mass matrix of the free DOFs. Raises SupportError if the matrix is singular."""

    def __init__(self, tangent: StrainTangent, M: Any = None, shift: float = 0.0) -> None:
        self._tangent, self._n = tangent, tangent.size[0]
        self._M, self._shift = M, shift
        self._rest = tangent.S + shift * M if shift else tangent.S
        self._by_strains, self._nodes = False, None
        #: relative error of the last solution before refinement
        self.left = np.inf
        condensed = tangent.system.solver.condensed
        if condensed is not None and self._n > FEW:
            self._nodes = tangent.condense(condensed, shift)
        else:
            self._lu = self._factors(self._scaled(), [])

    def _scaled(self):
        """The assembled matrix; sets the scales of DOFs and joints."""
        tangent, m = self._tangent, self._tangent.size[1]
        K = tangent.B.T @ tangent.CB + self._rest
        # unit diagonal, since units of DOFs and joints differ
        diagonal = abs(K.diagonal())
        diagonal[diagonal == 0.0] = 1.0
        self._d = 1.0 / np.sqrt(diagonal)
        J = tangent.J @ sparse.diags(self._d)
        size = np.sqrt(np.asarray(J.multiply(J).sum(axis=1)).ravel()) if m else np.zeros(0)
        self._e = 1.0 / np.where(size > 0, size, 1.0)
        return K

    def _factors(self, K, stresses):
        """LU factors in scaled DOFs, multipliers and, optionally, stresses."""
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
                "the tangent of this state is singular: joints are dependent, or a rigid motion "
                "is unconstrained") from None

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
        """x for columns b, (n, k) or (n,); ConvergenceError if the refinement fails."""
        return self.solve_both(b.reshape(self._n, -1))[0].reshape(b.shape)

    def once(self, b: Array) -> Array:
        """x for b (n,) without refinement, with a relative error of about :attr:`left`."""
        return self._once(b[:, None], np.zeros((self._tangent.size[1], 1)))[0][:, 0]

    def solve_both(self, b: Array, c: Array | None = None,
                   accepted: float = ACCEPTED) -> tuple[Array, Array]:
        """x (n, k) and l (m, k) for columns b and ``J x = c``, 0 by default."""
        # ``accepted`` is the largest accepted correction relative to x, in the energy norm.
        c = np.zeros((self._tangent.size[1], b.shape[1])) if c is None else c
        x, l, good = self._refined(b, c, accepted)
        if not good and not self._by_strains:
            logger.info("the assembled stiffness is too inaccurate: stresses become unknowns")
            # factorise with the stresses C B x as unknowns, in units of stiffness
            if self._nodes is not None:
                self._scaled()
            B, CB = self._tangent.B, self._tangent.CB
            size, strain = (abs(A).max(axis=1).toarray().ravel() for A in (CB, B))
            empty = (size == 0.0) | (strain == 0.0)  # strains of fixed DOFs only
            size = np.sqrt(np.where(empty, 1.0, size) / np.where(empty, 1.0, strain))
            W, number = sparse.diags(1.0 / size), len(size)
            self._by_strains, self._small = True, 1e-6
            self._lu = self._factors(
                self._rest / self._small,
                [W @ CB, B.T @ sparse.diags(size), -self._small * sparse.eye(number)])
            x, l, good = self._refined(b, c, accepted)
        if not good:
            raise ConvergenceError(
                "this tangent cannot be inverted in double precision: the elements are too short "
                "for so slender a beam, or the state is a critical point to round-off")
        return x, l

    def _norm(self, x):
        """Energy norm of the largest column."""
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
            # estimate of the next correction: step^2 / before
            if not step * step > REFINED * size * min(size, before):
                break
            if not step < SLOW * before:
                return x, l, step <= accepted * size
            before = step
        return x, l, step <= accepted * size
