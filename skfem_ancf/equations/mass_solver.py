"""Linear systems with the mass matrix; modal damping."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any
from weakref import proxy

import numpy as np
from scipy.sparse.linalg import splu

from ..core.band import Band, BandMatrix, dense, factorize, fix, solve_dependent
from ..core import Array, refuse
from .condensation import CondensedMass

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

    def __call__(self, u: Array, t: float, J: Any = None
                 ) -> Callable[[Array, Array], tuple[Array, Array]]:
        """A function of b (N,) and rate (m,) that returns x and l, at one displacement and time."""
        # J is ``constraints.full_jacobian(u, t)`` if known.
        if self.by_nodes:
            mass = self._condensed
            mass.forget()

            def solve_by_nodes(b: Array, rate: Array) -> tuple[Array, Array]:
                mass.forget(factors=False)
                return mass.solve(u, t, b, rate)

            return solve_by_nodes
        M, constraints = self.factors, self._system.constraints
        free = constraints.free
        if not constraints.m:
            return lambda b, rate: (M.solve(b * free), np.zeros(0))
        J = dense(constraints.full_jacobian(u, t) if J is None else J) * free
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
