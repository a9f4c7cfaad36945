"""The integrator of collocation schemes."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ..beam.strain_energy import gradients_size
from ..core.band import factorize, fix, solve
from ..core.types import Array
from .base import Motion
from .collocation import Collocation
from .time_functions import TimeFunctions
from .integrator import Integrator
from .records import JointMotions
from .stage_tangent import Interval, new_points, solve_for
from .stages import collocate

#: Samples of functions of time in a step: Chebyshev points.
SAMPLES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)


class StageIntegrator(Integrator):
    """Integrates a system by collocation, as an Integrator."""

    scheme: Collocation

    @cached_property
    def _backend(self):
        backend = self.system.backend
        return backend.with_tables(backend.tables.copied(len(self.scheme.points)))

    @cached_property
    def _functions(self):
        return TimeFunctions(self.system, np.append(self.scheme.points, 1.0), SAMPLES)

    @cached_property
    def _work(self):
        s, tables = self.system, self.system.backend.tables
        M = s.mass
        return new_points(self.scheme.table.method, s.N, self.m, len(self._matrices.rows.P),
                               tables.stresses.size, gradients_size(tables.plain.body),
                               M._replace(flat=np.zeros(M.flat.size)))

    def run(self, y: Motion, dt: float, n: int, start: float | None = None, first: int = 0,
            block: tuple[int, int] | None = None) -> list[Motion]:
        s, w, histories = self.system, self._work, self.system.histories
        table, begun = self.scheme.table, y.t if start is None else start
        given = self._functions.of(begun, dt, (first, first + n), self.limit, block)
        w.y[0], w.y[1], w.first[:] = y.u, y.v, y.multipliers
        ahead, memory = table.method.ahead, y.memory or {}
        if "stages" in memory:
            w.U[:], w.before[:], w.first[:] = (memory[x] for x in ("stages", "start", "forces"))
            ahead = ahead if dt == y.before else table.ahead(dt / y.before)
        else:
            w.guess[:] = 0.5 * (dt * table.points[:, None])**2 * y.acceleration
        interval = Interval(
            float(dt), int("stages" in memory), ahead, given.times.ravel(),
            _flat(given.factors), _flat(given.supports),
            JointMotions(_flat(given.c), _flat(given.g[:, :, [0, 0, 1, 2]]),
                         int(s.backend.tables.motion_varies)))
        rows, stages = np.full((n + 1, 3, s.N), np.nan), np.empty((n, len(w.U), s.N))
        rows[0, 0], rows[0, 1] = y.u, y.v
        forces = np.empty((n, len(w.U) + 1, self.m))
        kept = histories.values.size if histories.lasting else 0
        memories = np.full((n, 1 + kept), np.nan)
        done = self._call(collocate, y, dt, (rows[1:], memories[:, :1]), self._rule, interval, w,
                          self._state, memories, rows[1:], stages, forces)
        return [replace(y, t=begun + dt * (first + k + 1), u=rows[k + 1, 0], v=rows[k + 1, 1],
                        acceleration=rows[k + 1, 2], algorithmic=rows[k + 1, 2],
                        multipliers=forces[k, -1], force=forces[k, -1], before=dt,
                        dissipated=float(memories[k, 0]),
                        history=memories[k, 1:] if histories.lasting else y.history,
                        memory={"stages": stages[k], "start": rows[k, :2],
                                "forces": forces[k, :-1]})
                for k in range(done)]

    def filtered(self, du: Array) -> Array:
        s, w = self.system, self._work
        k = int(np.argmin(np.abs(w.method.values[1])))
        mu = complex(*w.method.values[:, k]) / self.dt
        x = mu**2 * s.mass.multiply(du) * s.constraints.free
        x, y = np.ascontiguousarray(x.real), np.ascontiguousarray(x.imag)
        solve_for(w, k, x, y)
        return x

    def damped(self, du: Array, time: float) -> Array:
        """Average a damped increment over a time span: (M + D time / 2)^-1 M du."""
        s, M = self.system, self.system.mass
        A = M._replace(flat=M.flat + 0.5 * time * self._work.D.flat, pivots=M.pivots.copy())
        fix(A, s.constraints.fixed)
        if not factorize(A):
            return du
        x = s.mass.multiply(du) * s.constraints.free
        solve(A, x)
        return x

    def _factors(self) -> dict[str, Any]:
        w = self._work
        beside = {"J": w.J, "Y": w.Y, "S": w.S, "Q": w.Q} if len(w.J) else {}
        return {"pairs": w.pairs, "real": w.real.flat, **beside}


def _flat(x):
    """Merge the axes of steps and instants."""
    return np.ascontiguousarray(x).reshape(x.shape[0] * x.shape[1], *x.shape[2:])
