"""Many time steps of a simple scene in one compiled call."""

import numpy as np

from .base import Motion

#: Steps of a call: between two calls the progress is shown.
BLOCK = 256


class CompiledSteps:
    """Steps of one beam with compiled kernels, without joints, under dead loads.

    They are those of the scheme's :class:`~skfem_ancf.dynamics.base.Step`, to the tolerance of the
    iteration.
    """

    def __init__(self, solver, scheme, system):
        from ..compiled import steps

        self._steps, self._solver, self._system = steps, solver, system
        self._conserving, self._parameters = scheme.compiled
        kernel = system.beams[0].kernel.compiled
        self._packs = kernel.packs
        self._cable = kernel.cable
        self._strains = np.empty(kernel.shape)
        self._A = np.empty_like(system.mass._flat)
        # factors are there, iterations, factorisations, rate, size of the step before
        self._state = np.zeros(5)

    @staticmethod
    def applies(scheme, system):
        """True if the scene is simple enough and the scheme has a compiled step."""
        return scheme.compiled is not None and system.simple and not system.moves

    def run(self, y, dt, n):
        """Up to ``n`` steps from the Motion ``y``; fewer where one fails. A list of Motions."""
        s, solver = self._system, self._solver
        n = min(n, BLOCK)
        rows, times = np.empty((n, 3, s.N)), np.empty(n)
        now = np.array([y.u, y.v, y.acceleration, y.algorithmic])
        self._state[4] = y.memory[0] if y.memory else 0.0
        before = self._state.copy()
        done, solver._energy = self._steps(
            self._cable, *self._packs, self._strains, self._conserving, self._parameters,
            s.external_force(y.u), ~s.free, s.mass._flat, s.mass._ld, s.mass.bandwidth, self._A,
            self._state, now, y.t, dt, solver.tol, 8.0 * s.stiffness_scale, solver._energy, rows,
            times)
        solver.iterations += int(self._state[1] - before[1])
        solver.factorizations += int(self._state[2] - before[2])
        none = y.multipliers
        motions = [Motion(float(t), u, v, a, a, none)
                   for t, (u, v, a) in zip(times[:done], rows[:done])]
        if done:
            motions[-1].algorithmic = now[3]
            if self._conserving:
                motions[-1].memory = dt, now[3], none
        if done < n:
            self._state[0] = 0.0
        return motions
