"""The linear systems of a scene: ``[K, J^T; J, 0] [x; l] = [b; c]``, and the signature of K.

Four ways, by what there is beside the band of the beams: LAPACK alone; a Schur complement for a
few multipliers of beams that their supports hold; sparse LU on the null space of J for others;
static condensation for frames.
"""

from __future__ import annotations

import logging
from functools import cached_property
from typing import Any
from weakref import proxy

import numpy as np

from ..core.band import fix
from ..core.linalg import NO_FACTORS, BandMatrix, Inertia
from ..core.types import Array
from .condensation import Condensed
from .null_space import NullSpace, Pattern
from .signature import determinant_sign

logger = logging.getLogger(__name__)

#: Pivots of a positive definite matrix, over its diagonal, at least.
SURE = 1e-10


class LinearSolver:
    """Factorises the tangent of a system with its supports and joints, and solves with it.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`, which has to live as long.

    Other Parameters
    ----------------
    u, t, multipliers
        Where the joints are linearised: displacement (N,), time, multipliers (m,).
    residual, phi
        Right-hand sides: forces (N,), of which those at fixed degrees of freedom are ignored, and
        what the equations of joints should change by, (m,).
    """

    def __init__(self, system: Any) -> None:
        self._system = proxy(system)
        self._at: tuple[Array, float] = np.zeros(0), 0.0
        self._joined: Schur | NullSpace | None = None
        self._pattern = Pattern()

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

    def _far_entries(self):
        """What force elements have outside of the band, at free degrees of freedom."""
        s = self._system
        i, j, w, place = s.forces.far_entries()
        if not len(i):
            return i, j, w
        u, t = self._at
        D = s.forces.stiffness(s.backend.tables.plain.forces, t, u, 0.0 * u, 0.0)
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
        J = constraints.jacobian_entries(u, t)
        entries = tuple(np.append(a, b) for a, b in zip(
            constraints.curvature_entries(u, t, multipliers), self._far_entries()))
        inside = np.abs(entries[0] - entries[1]) <= s.K.bandwidth
        s.K.add(*(x[inside] for x in entries))
        entries = tuple(x[~inside] for x in entries)
        self._joined = None
        if s.symmetric and not len(entries[0]) and constraints.few:
            try:
                self._joined = Schur(s.K, J, constraints)
                return
            except np.linalg.LinAlgError:
                logger.debug("joints hold what the supports leave free")
        self._joined = NullSpace(s.K, J, entries, constraints, self._pattern)

    def solve(self, residual: Array, phi: Any = None) -> tuple[Array, Array]:
        """Solve with the factors.

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
        """Factorise and solve for an iteration of kernels; False if that fails."""
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
        solver = self._joined if self.condensed is None else self.condensed
        assert solver is not None
        return solver.inertia()

    def determinant_sign(self) -> int:
        """The sign of the determinant of what :meth:`inertia` counts: 1 or -1.

        -1 is an odd number of negative eigenvalues, of a tangent that is not symmetric too.
        """
        if not self.coupled:
            return self._system.K.determinant_sign()
        if isinstance(self._joined, NullSpace):
            return determinant_sign(self._joined.reduced())
        return -1 if self.inertia().negative % 2 else 1

    def take_factors(self) -> None:
        """Note that an iteration has left factors of its last tangent."""
        if not self.coupled:
            self._system.K.take_factors()

    def forget(self) -> None:
        """Note that the factors are none of the last solution."""
        self._system.K.clear()
        self._joined = None
        if self.condensed is not None:
            self.condensed.forget()

    def stays(self) -> bool:
        """True if the factors left by an iteration say that no direction gives way.

        Those of its last tangent, which is that of the solution but for the last correction.
        """
        if not self.coupled:
            return self._system.K.definite
        known = self._joined if self.condensed is None else self.condensed.ready
        return bool(known) and self._system.symmetric and self.inertia() == Inertia(0, False)


class Schur:
    """Factors of ``[K, J^T; J, 0]`` by those of a positive definite band matrix.

    Equations of neighbouring degrees of freedom, as of a clamp at an angle, are added to the matrix
    with a stiffness w: ``K + J^T w J`` has the same solution x, and l less by w c.

    Parameters
    ----------
    K
        A :class:`~skfem_ancf.core.linalg.BandMatrix` with its supports fixed.
    J
        Rows, columns and values of J, shapes (k,).
    constraints
        The :class:`~skfem_ancf.equations.constraints.Constraints`.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is not positive definite, as that of a beam that only joints hold; K is as it
        was.
    """

    def __init__(self, K: BandMatrix, J: Any, constraints: Any) -> None:
        self._K, self._J, before = K, constraints.to_dense(*J), K.band.flat.copy()
        self._weights, size = np.zeros(constraints.m), np.abs(K.diagonal())
        for k, row in enumerate(self._J):
            at, = np.nonzero(row)
            if len(at) and np.ptp(at) <= K.bandwidth:
                self._weights[k] = w = np.max(size[at]) / np.max(np.abs(row)) ** 2
                K.add(np.repeat(at, len(at)), np.tile(at, len(at)),
                      w * np.outer(row[at], row[at]).ravel())
        definite = K.factorize().definite
        if not definite or np.any(K.pivots() < SURE * K.diagonal()):
            K.band.flat[:] = before
            raise np.linalg.LinAlgError("the matrix is not positive definite")
        self._Y = K.solve(self._J.T)
        self._S = self._J @ self._Y

    def solve(self, b: Array, c: Array) -> tuple[Array, Array]:
        """x (n,) and l (m,) for right-hand sides (n,) and (m,)."""
        x = self._K.solve(b)
        l = np.linalg.solve(self._S, self._J @ x - c)
        return x - self._Y @ l, l + self._weights * c

    def inertia(self) -> Inertia:
        """That of K where J x = 0."""
        return Inertia(0, False)
