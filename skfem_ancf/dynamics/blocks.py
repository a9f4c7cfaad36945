"""Many time steps in one compiled call."""

import numpy as np

from .base import Motion
from .rates import step_rates

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
        self._M, self._A = s.mass_factor(), np.empty_like(system.mass._flat)
        self._dt = None
        # factors are there, iterations, factorisations, rate, size of the step before
        self._state = np.zeros(5)
        self._longest = int(np.clip(STORED // (3 * system.N), 1, BLOCK))

    @staticmethod
    def applies(scheme, system):
        """True if the scheme has a compiled step, and all of the scene is compiled."""
        return scheme.compiled is not None and system.structure is not None

    def _supports(self, t, dt, n):
        """Displacement, velocity and acceleration of the fixed coordinates, shape (3, n, k)."""
        s = self._system
        if not s.moves:
            return np.zeros((3, 1, len(s.fixed)))
        _, *found = step_rates(s.values_at, t, dt, n, self._solver.span)
        return np.ascontiguousarray(found)

    def _motion(self, t, dt, n):
        """c and g of the joints, g where they act, and the rates of c and g."""
        s, span = self._structure, self._solver.span
        if s.joints is None:
            return None
        start = np.array([t])
        c, g = s.offsets(start), s.slopes(start)
        c_rates, g_rates, g_joint = (0 * c, 0 * c), (0 * g, 0 * g), g
        if s.motion_varies:
            _, c, *c_rates = step_rates(s.offsets, t, dt, n, span)
            if s.turns:
                middle, g, *g_rates = step_rates(s.slopes, t, dt, n, span)
                g_joint = middle if self._conserving else g
        rows = c, g, g_joint, c_rates[0], g_rates[0], c_rates[1], g_rates[1]
        return tuple(np.ascontiguousarray(x) for x in rows)

    def run(self, y, dt, n):
        """Up to ``n`` steps from the Motion ``y``; fewer where one fails.

        Returns
        -------
        The number of steps done, and a function that gives the Motion after each.
        """
        s, solver, structure = self._system, self._solver, self._structure
        n = min(n, self._longest)
        if dt != self._dt:
            self._dt, self._state[0] = dt, 0.0
        rows, multiplier_rows = np.empty((n, 3, s.N)), np.empty((n, s.m))
        now = np.array([y.u, y.v, y.acceleration, y.algorithmic])
        before, _, force = y.memory or (0.0, None, y.multipliers)
        multipliers = np.array([y.multipliers, force])
        self._state[4] = before
        count = self._state.copy()
        ends = y.t + dt * np.arange(1, n + 1)
        acting = ends - 0.5 * dt if self._conserving else ends
        done, solver._energy = self._steps(
            structure.cables, structure.beams, structure.moments, structure.joints,
            self._conserving, self._parameters, structure.vectors, structure.factors(acting),
            structure.moment_factors(acting), s.fixed, s.mask, self._supports(y.t, dt, n),
            self._motion(y.t, dt, n), s.mass._flat, self._M, s.mass._ld, s.mass.bandwidth, self._A,
            *self._work, self._state, now, multipliers, dt, solver.tol, 8.0 * s.stiffness_scale,
            solver._energy, rows, multiplier_rows)
        solver.iterations += int(self._state[1] - count[1])
        solver.factorizations += int(self._state[2] - count[2])
        if done < n:
            self._state[0] = 0.0

        def motion(k):
            """After step k, counted from 0."""
            u, v, a = rows[k]
            new = Motion(float(ends[k]), u, v, a, a, multiplier_rows[k])
            if k == done - 1:
                new.algorithmic = now[3]
                if self._conserving:
                    new.memory = dt, now[3], multipliers[1]
            return new

        return done, motion
