"""The linear systems of time steps of a frame, whose nodes are eliminated.

Texts call an object by its handle, see :mod:`skfem_ancf.core.callbacks`. What they ask for is
linear in the joints' directions of an iterate; factors are those of an earlier one, and the
difference is refined or left to the step's iteration.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from .condensation import Condensed
from ..core.linalg import NO_FACTORS

if TYPE_CHECKING:
    from ..core.linalg import BandMatrix
    from ..core.types import Array

logger = logging.getLogger(__name__)

#: Contraction of a refinement and what round-off may leave, up to which factors are kept; the same
#: of new ones.
KEPT, NEW = (0.05, 1e-12), (0.5, 1e-6)
#: Length of a refinement at most, and its accuracy.
REFINEMENTS, EXACT = 50, 1e-14
#: Corrections where more iterations follow.
ROUGHLY = 2


def condensed(system: Any) -> Condensed:
    """What condenses the matrices of a frame to its nodes.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System` of a frame.

    Raises
    ------
    ValueError
        If it is of no frame.
    """
    nodes = system.constraints.frame
    if nodes is None:
        raise ValueError("the system is of no frame")
    return Condensed(system.beams, system.slices, nodes)


class Eliminated:
    """Solves with the iteration matrix of a step.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System` of a frame that can be condensed.
    A
        The matrix, which texts fill.
    """

    def __init__(self, system: Any, A: BandMatrix) -> None:
        self.A, self._condensed = A, condensed(system)
        #: what it was factorised at: displacement and multipliers
        self.at = np.zeros(system.N), np.zeros(system.constraints.m)

    def factorize(self, u: Array, multipliers: Array) -> None:
        """Make factors of what A holds.

        Parameters
        ----------
        u, multipliers
            Where the joints are linearised, shapes (N,) and (m,).

        Raises
        ------
        numpy.linalg.LinAlgError, RuntimeError
            If it is singular.
        """
        self.at = u.copy(), multipliers.copy()
        A = self.A if self.A.symmetric else self.A.symmetric_part()
        self._condensed.factorize(A, *self.at)

    def solve(self, b: Array) -> Array:
        """What forces (N,) do with joints closed, shape (N,)."""
        return self._condensed.solve(b, np.zeros(len(self.at[1])))[0]

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """Solve; without right-hand sides factorise. False if that fails.

        Parameters
        ----------
        t, u, multipliers
            Time, and where the joints are linearised, shapes (N,) and (m,).
        R, phi
            Right-hand sides, shapes (N,) and (m,), or empty.
        du, dm
            The solution, shapes (N,) and (m,).
        """
        try:
            if len(R):
                du[:], dm[:] = self._condensed.solve(R, phi)
            else:
                self.factorize(u, multipliers)
        except NO_FACTORS as error:
            logger.debug("no factors: %s", error)
            return False
        return True


class EliminatedMass:
    """Solves with the mass matrix and the joints as they are at a displacement.

    The factors are those of an earlier displacement, refined, and made anew where that takes long.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System` of a frame that can be condensed.
    """

    def __init__(self, system: Any) -> None:
        self._system = system
        self._M = system.mass if system.mass.symmetric else system.mass.symmetric_part()
        self._condensed = condensed(system)
        #: displacement at which it was factorised
        self.at: Array | None = None
        #: by how much the joints' forces act before the end of a step
        self.lag = 0.0
        self._last: tuple[float, Array, Array] | None = None

    def factorize(self, u: Array) -> None:
        """Make factors at a displacement (N,)."""
        self.at = u.copy()
        self._condensed.factorize(self._M, self.at, np.zeros(self._system.constraints.m))

    def forget(self, factors: bool = True) -> None:
        """Begin anew: what is solved next does not depend on what was solved before.

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
                return (x, l) if step <= rough * size else None
            before = step
        return (x, l) if most < REFINEMENTS else None

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """By how much R, velocities or accelerations, has to change so that joints stay closed.

        It factorises where it has to.

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
