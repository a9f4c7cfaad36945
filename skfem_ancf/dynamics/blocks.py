"""Many time steps in one compiled call."""

import numpy as np
from scipy.linalg import lapack

from .base import ITERATION, Motion
from .rates import PARTS, step_rates

#: Steps of a call at most, and numbers that they may store: between two calls progress is shown.
BLOCK, STORED = 256, 2_000_000


class CompiledSteps:
    """Steps of a scene whose beams, loads and joints are all compiled.

    They are those of the scheme's :class:`~skfem_ancf.dynamics.base.Step`, to the tolerance of the
    iteration.
    """

    def __init__(self, solver, scheme, system):
        from ..compiled.steps import steps

        self._steps, self._solver, self._system = steps, solver, system
        self._conserving, self._parameters = scheme.compiled
        self._structure = s = system.structure
        self._work = s.stresses(), s.stresses()
        self._M, self._A = s.mass_factor(), np.zeros_like(system.mass._flat)
        self._dt, self._asked = None, (None, None)
        # factors are there, iterations, factorisations, rate, size of the step before
        self._state = np.zeros(5)
        self.longest = int(np.clip(STORED // (4 * system.N), 1, BLOCK))

    @staticmethod
    def applies(scheme, system):
        """True if the scheme has a compiled step, and all of the scene is compiled."""
        return scheme.compiled is not None and system.structure is not None

    def _supports(self, times, dt):
        """Displacement, velocity and acceleration of the fixed coordinates, shape (3, n, k)."""
        s = self._system
        if not s.moves:
            return np.zeros((3, 1, len(s.fixed)))
        _, *found = step_rates(s.values_at, times, dt)
        return np.ascontiguousarray(found)

    def _motion(self, times, dt):
        """c and g of the joints, g where they act, and the rates of c and g."""
        s = self._structure
        if s.joints is None:
            return None
        start = times[:1]
        c, g = s.offsets(start), s.slopes(start)
        c_rates, g_rates, g_joint = (0 * c, 0 * c), (0 * g, 0 * g), g
        if s.motion_varies:
            _, c, *c_rates = step_rates(s.offsets, times, dt)
            if s.turns:
                middle, g, *g_rates = step_rates(s.slopes, times, dt)
                g_joint = middle if self._conserving else g
        rows = c, g, g_joint, c_rates[0], g_rates[0], c_rates[1], g_rates[1]
        return tuple(np.ascontiguousarray(x) for x in rows)

    def _functions(self, start, dt, first, last, limit):
        """Functions of time for steps ``first`` to ``last``: factors, moments, supports, joints."""
        key = start, dt, first, last, limit
        if self._asked[0] != key:
            structure = self._structure
            times = start + dt * (first + np.arange(PARTS * (last - first) + 1) / PARTS)
            times = np.minimum(times, limit)
            ends = times[PARTS::PARTS]
            acting = times[PARTS // 2::PARTS] if self._conserving else ends
            self._asked = key, (ends, structure.factors(acting), structure.moment_factors(acting),
                                self._supports(times, dt), self._motion(times, dt))
        return self._asked[1]

    def run(self, y, dt, n, start=None, first=0, block=None):
        """Up to ``n`` steps from the Motion ``y``; fewer where one fails.

        Parameters
        ----------
        start, first
            ``y`` is at ``start + first dt``.
        block
            Numbers of steps between which functions of time are asked at once, so that what they
            return does not depend on ``first`` and ``n``: these steps by default.

        Returns
        -------
        The number of steps done, and a function that gives the Motion after each.
        """
        s, solver, structure = self._system, self._solver, self._structure
        lowest, highest = (first, first + n) if block is None else block
        asked = self._functions(y.t if start is None else start, dt, lowest, highest, solver.limit)
        if highest - lowest > n:
            a, b = first - lowest, first - lowest + n
            ends, factors, moments, supports, motion = asked
            asked = (ends[a:b], _part(factors, a, b), _part(moments, a, b),
                     _part(supports, a, b, 1),
                     None if motion is None else tuple(_part(x, a, b) for x in motion))
        ends, factors, moment_factors, supports, motion_rows = asked
        if dt != self._dt:
            self._dt, self._state[0] = dt, 0.0
        rows, multiplier_rows = np.empty((n, 4, s.N)), np.empty((n, 2, s.m))
        now = np.array([y.u, y.v, y.acceleration, y.algorithmic])
        multipliers = np.array([y.multipliers, y.force])
        self._state[4] = y.before
        count = self._state.copy()
        done, solver._energy = self._steps(
            structure.cables, structure.beams, structure.moments, structure.joints,
            self._conserving, self._parameters, structure.vectors, factors, moment_factors, s.fixed,
            s.mask, supports, motion_rows, s.mass._flat, self._M, s.mass._ld, s.mass.bandwidth,
            self._A, *self._work, self._state, now, multipliers, dt, solver.tol,
            8.0 * s.stiffness_scale, ITERATION, solver._energy, rows, multiplier_rows)
        solver.iterations += int(self._state[1] - count[1])
        solver.factorizations += int(self._state[2] - count[2])
        if done < n:
            self._state[0] = 0.0

        def motion(k):
            """After step k, counted from 0."""
            return Motion(float(ends[k]), *rows[k], *multiplier_rows[k], before=dt)

        return done, motion

    def mass_factor(self, dt):
        """Factor of the mass in the iteration matrix of a step."""
        if self._conserving:
            return 2.0 / dt**2
        alpha_m, alpha_f, beta, _ = self._parameters
        return (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * dt**2)

    def forget(self):
        """Make new factors in the next step."""
        self._state[0] = 0.0

    @property
    def ready(self):
        """True if there are factors."""
        return self._state[0] != 0.0

    def solve(self, b):
        """The iteration matrix's inverse times b (N,): L D L^T in the band."""
        s = self._system
        A = self._A.reshape(s.N, s.mass._ld).T[:s.mass.bandwidth + 1]
        x = lapack.dtbtrs(A, b, uplo="L", diag="U")[0].ravel() / A[0]
        return lapack.dtbtrs(A, x, uplo="L", trans="T", diag="U")[0].ravel()

    # what a motion goes on with

    def remember(self):
        """Arrays from which :meth:`recall` goes on as if there had been no break."""
        return {"state": self._state.copy(), "A": self._A.copy(),
                "dt": np.array(np.nan if self._dt is None else self._dt)}

    def recall(self, memory):
        """Go on with what :meth:`remember` gave."""
        self._state[:], self._A[:] = memory["state"], memory["A"]
        self._dt = float(memory["dt"])


def _part(rows, a, b, axis=0):
    """Rows a to b of an array, or its only one."""
    if rows.shape[axis] == 1:
        return rows
    return np.ascontiguousarray(rows[a:b] if axis == 0 else rows[:, a:b])
