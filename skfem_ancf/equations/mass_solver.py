"""Solves with the mass matrix of a scene, its supports and its joints; damping of single modes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any
from weakref import proxy

import numpy as np
from scipy.sparse.linalg import splu

from ..core.band import factorize, fix, solve_dependent
from ..core.errors import InputError, shown
from ..core.linalg import BandMatrix, dense
from ..core.types import Array
from .condensation import CondensedMass

#: Equations of the nodes of a frame above which steps of a motion eliminate them.
MANY = 48


class MassSolver:
    """A function of b (N,) and rate (m,): x and l with ``M x + J^T l = b`` and ``J x = rate``.

    The first at free degrees of freedom; x is zero at fixed ones.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`, which has to live as long.
    """

    def __init__(self, system: Any) -> None:
        self._system = proxy(system)

    @cached_property
    def factors(self) -> BandMatrix:
        """The factors of the mass matrix with its supports fixed; made once."""
        s = self._system
        M = s.new_band().combine(1.0, s.mass, 0.0, s.mass)
        fix(M.band, s.constraints.fixed)
        if not factorize(M.band):
            if s.forces.masses:
                raise InputError("the mass matrix is singular to round-off: a mass or an inertia "
                                 f"of {shown(s.forces.masses)} is too large beside the beams")
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        M.take_factors()
        if not self.by_nodes and M.definite:
            M.to_cholesky()  # solved with by LAPACK at once; kernels have those of the band
        return M

    @cached_property
    def by_nodes(self) -> bool:
        """True if steps of a motion condense a frame to its nodes; few equations are a border."""
        s = self._system
        return (s.constraints.condensable and not s.forces.far and s.constraints.m > MANY
                and not len(s.damping.modal))

    @cached_property
    def _condensed(self):
        return CondensedMass(self._system)

    def __call__(self, u: Array, t: float, J: Any = None
                 ) -> Callable[[Array, Array], tuple[Array, Array]]:
        """The solver at one place and time.

        Parameters
        ----------
        u, t
            Where the joints are linearised, shape (N,), and when.
        J
            ``constraints.full_jacobian`` there, shape (m, N), where it is known.
        """
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
        J = J * free if isinstance(J, np.ndarray) else dense(constraints.jacobian(u, t))
        Y = M.solve(J.T)
        S = J @ Y

        def solve(b: Array, rate: Array) -> tuple[Array, Array]:
            x = M.solve(b * free)
            multipliers = J @ x - rate
            if not solve_dependent(S.copy(), multipliers):
                raise np.linalg.LinAlgError("the joints hold nothing in this state")
            return x - Y @ multipliers, multipliers

        return solve


class ModalDamping:
    """The damping of single modes.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`, which has to live as long.
    rest_modes
        As of the system.

    Attributes
    ----------
    rows
        The force that resists v is ``(rows @ v) @ rows``, shape (k, N).
    """

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
        """What resists the velocity v, shape (N,)."""
        return (self.rows @ v) @ self.rows

    def acceleration(self, v: Array) -> Array:
        """The acceleration whose inertia is :meth:`force`, shape (N,)."""
        return (self.rows @ v) @ self._shapes

    @cached_property
    def _shapes(self):
        if not len(self.rows):
            return self.rows
        return splu(self._system.mass.tocsc()).solve(self.rows.T).T
