"""One-step integration: blocks of steps, single steps, and halved steps after a failure."""

import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..actions.contact.tables import HAS_ENTRIES
from ..actions.obstacles.contact import may_touch
from ..core.band import SPARE, Band, BandMatrix, Coupling, coupling, factorize, fix, solve
from ..core import (I1, Array, ConvergenceError, SupportError, handle_of, hints, refuse,
                    require_positive)
from ..equations.condensation import Condensed, CondensedMass
from ..equations.system import System
from .base import COLUMNS, Motion, Motions, Scheme, in_steps, interpolate
from .schemes import EnergyMomentum
from .collocation import Collocation
from .time_functions import SAMPLES, TimeFunctions, rates
from .records import (FAILURES, Dampers, Interval, JointMotion, LowRankRows,
                      Matrices, Multipliers, Rule, StageWork, StepState, Vectors, Work,
                      acceleration_of_joints, drive_rate, mass_factor, solve_rows)
from .stages import collocate, solve_for
from .steps import factors, steps


logger = logging.getLogger(__name__)

DEPTH = 6  # how often a step is halved
#: Approximate iterations of a step, by which work in NumPy is counted.
OF_STEP = 3
#: Names in checkpoints of the entries beside the band.
KEPT = "kept rows", "kept columns", "kept values"
#: Largest number of steps in a block, and of stored floats.
BLOCK, STORED = 256, 2_000_000


class TimeStepFailed(Exception):
    """The iteration of a step did not converge."""


class Integrator:
    """Integrates a system by one-step schemes. The iteration matrix is factorised again only when
    the iteration contracts too slowly. ``limit`` is the last time at which functions of time are
    sampled, ``longest`` the size of a block."""

    def __init__(self, system: System, scheme: Scheme, tol: float | None = None) -> None:
        scheme.require(system)
        system = system.after()  # whose history steps change
        self.system, self.scheme, self.limit = system, scheme, np.inf
        self.m = system.constraints.m
        self.tol = scheme.tol if tol is None else require_positive("tol", tol)
        refuse(self.tol >= 1.0, "tol is the relative error of the iteration in a step: it must be "
               "less than 1, 1e-6 is coarse; got {!r}", tol)
        if not scheme.conserving:
            alpha_m, alpha_f, beta, _ = scheme.parameters
            kick = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta)
            system.forces.contacts.require_penalty(scheme, kick if in_steps(scheme) else np.inf)
        # collocation evaluates all points of a step at once
        self._backend = system.backend.copied(len(scheme.points)) if isinstance(
            scheme, Collocation) else system.backend
        M, A = system.mass, system.new_band()
        self._nodes: tuple[Condensed, CondensedMass] | None = None
        if in_steps(scheme) and system.mass_solver.by_nodes:
            self._nodes = Condensed(system, A), CondensedMass(system)
        unsymmetric = scheme.conserving and self._nodes is None
        U = BandMatrix.zeros(system.N if unsymmetric else 0, system.bandwidth, symmetric=False)
        # force elements that couple DOFs anywhere
        self._couplings = [Coupling(X, partial(_couplings, system)) for X in (A, U)
                           if system.forces.changing]
        A, U = [one.band for one in self._couplings] or (A, U)
        modes, k = system.modal_damping.rows, len(system.forces.border_rows)
        k += len(modes)
        beside = LowRankRows(np.concatenate([modes, system.forces.border_rows]), np.zeros((k, k)),
                             np.zeros((k, system.N)), np.zeros((k, k)))
        D = M._replace(flat=np.zeros(M.flat.size if system.viscous else 0))
        dampers = Dampers(int(system.damped), int(system.viscous), int(system.forces.resists),
                          system.damping.mass, D, modes)
        self._matrices = Matrices(M, system.mass_solver.factors, A, U, beside, dampers)
        handles = [handle_of(one) for one in self._nodes or ()] or (0, 0)
        self._rule = Rule._make([
            int(scheme.conserving), *map(float, scheme.parameters), self.tol,
            8.0 * system.scales.strain_noise, system.scales.inertia_of_places, *handles])
        self._state = StepState._make(
            np.zeros(1, int if hint is I1 else float) for hint in hints(StepState))
        self.dt, self.substeps, self._lost, self.stopped = np.nan, 0, "", False
        # means over steps differ from values at their ends where a step does not resolve an impact
        self._means = scheme.conserving and may_touch(system)
        self.longest = max(1, min(STORED // (4 * system.N + system.histories.values.size), BLOCK))

    @property
    def iterations(self) -> int:
        """Number of linear solutions."""
        return int(self._state.iterations[0])

    @property
    def factorizations(self) -> int:
        """Number of factorised tangents."""
        return int(self._state.factorizations[0])

    @property
    def energy(self) -> float:
        """The largest energy so far."""
        return float(self._state.energy[0])

    @property
    def failure(self) -> str:
        return self._lost or FAILURES[int(self._state.failure[0])]

    @property
    def ready(self) -> bool:
        """True if the iteration matrix is factorised."""
        return bool(self._state.factors[0] != 0)

    def count(self, other: "Integrator") -> None:
        """Add the counts of another integrator, and reset those."""
        self._state.iterations[:] += other._state.iterations
        self._state.factorizations[:] += other._state.factorizations
        self.substeps += other.substeps
        other.reset()

    def reset(self) -> None:
        self._state.iterations[0] = self._state.factorizations[0] = self.substeps = 0

    def expect(self, energy: float) -> None:
        """Raise the largest energy, to which the tolerance is relative."""
        self._state.energy[0] = max(self.energy, energy)

    # the start

    def start(self, u: Array, v: Array, t: float, dt: float, ahead: bool = True,
              history: Array | None = None) -> Motion:
        """The initial Motion, with consistent velocity, acceleration and multipliers."""
        # Rates of functions of time are those in a step dt after t, or before t unless ``ahead``.
        s, M, (free, m) = self.system, self.system.mass, (self.system.constraints.free, self.m)
        instant = TimeFunctions(s, np.array([0.0 if ahead else 1.0]), SAMPLES)
        given = instant.of(t if ahead else t - dt, dt, (0, 1), self.limit)
        u_fixed, v_fixed, a_fixed = given.supports[0, 0]
        y = Motion(t, np.where(free, u, u_fixed), np.where(free, v, v_fixed), a_fixed.copy(),
                   np.zeros(s.N), np.zeros(m), np.zeros(m))
        self._require_fitting_supports(y.u - u, t)
        tables, J, rate, at = s.backend.tables, None, y.multipliers, min(t, self.limit)
        # the tables of custom joints have no rates of functions of time
        custom = tables.plain.joints.custom > 0 and tables.motion_varies
        if m:
            c, g = given.c[0, 0].copy(), given.g[0, 0]
            gap, J = np.abs(s.constraints.constraint(y.u, at)), s.constraints.full_jacobian(y.u, at)
            refuse(np.any(gap > 1e-8 * tables.plain.joints.sizes), "the joints are not closed at "
                   "the start: the largest gap is {:.3g}. Change the positions of the beams, or "
                   "start from a static solution (start=)", gap.max(), error=SupportError)
            if custom:
                c[1:] = rates(lambda times: np.array([
                    s.constraints.constraint(y.u, x) for x in times]), t, dt, ahead, self.limit)
            joints = JointMotion(c, g, int(tables.motion_varies and not custom))
            drive_rate(tables.plain.joints, joints, t, dt, y.u, rate)
            rate = -(rate + J @ y.v)
        solve = s.mass_solver(y.u, t, J)
        jump = y.v - v  # impulses of the supports change the velocity of the free DOFs
        if m or jump.any():
            y.v = y.v + solve(-M.multiply(jump), rate)[0]
        if m:
            acceleration_of_joints(tables.plain.joints, joints, t, dt, y.u, y.v, rate)
            if custom:
                rate += 2.0 * rates(lambda times: np.array([s.constraints.full_jacobian(
                    y.u, x) @ y.v for x in times]), t, dt, ahead, self.limit)[0]
            rate = -(rate + J @ y.acceleration)
        force, y.history = self._forces(y, history)
        acceleration, y.multipliers = solve(force - M.multiply(y.acceleration), rate)
        y.acceleration += acceleration
        y.algorithmic, y.force = y.acceleration.copy(), y.multipliers
        if self._means:
            of_items = () if y.history is None else y.history[s.histories.end:]
            y.start = np.concatenate([y.u, of_items, [0.0]])
        inertia, kinetic = M.multiply(y.acceleration), 0.5 * float(y.v @ M.multiply(y.v))
        change = dt * float(y.v @ inertia) + 0.5 * dt**2 * float(y.acceleration @ inertia)
        # at rest the energy is still zero
        self.expect(max(s.strain_energy(y.u, t), kinetic, kinetic + change))
        return y

    def _forces(self, y, history):
        """Sum of all forces except inertia, and the history."""
        s = self.system.after(history)
        if s.histories.lasting and history is None:
            s.histories.begin(y.u, y.t, True)
            history = s.histories.values.copy()
        force = s.external_force(y.u, y.t) - s.internal_force(y.u, y.t)
        return force - s.damping_force(y.u, y.v, y.t) if s.damped else force, history

    def _require_fitting_supports(self, jump, t):
        """Raise SupportError if the supports would displace the body suddenly."""
        if not jump.any():
            return
        s = self.system
        along = np.concatenate([member.rigid_motions()[:, 0] for member in s.members])
        gap = np.sqrt(jump @ s.mass.multiply(jump) / (along @ s.mass.multiply(along)))
        refuse(gap > 1e-8 * s.size, "supports would displace the body suddenly by {:.3g} on "
               "average, at t = {:.6g}: start from a state that meets them, as a static solution, "
               "and move them by continuous functions", gap, t, error=SupportError)

    # steps

    @cached_property
    def _functions(self):
        """Sampling where the equation of motion holds, and at the end of a step."""
        middle = 0.5 if self.scheme.conserving else 1.0
        return TimeFunctions(self.system, np.array([middle, 1.0]), SAMPLES)

    @cached_property
    def _work(self):
        s, m, dense = self.system, self.m, 0 if self._nodes else self.m  # J of eliminated joints
        return Work(np.zeros((4, s.N)), Vectors(*np.zeros((len(Vectors._fields), s.N))),
                    Multipliers(*np.zeros((len(Multipliers._fields), m))),
                    np.zeros((4, dense, s.N)), np.zeros((dense, dense)),
                    np.zeros((7, s.backend.tables.stresses.size)))

    def run(self, y: Motion, dt: float, n: int, start: float | None = None, first: int = 0,
            block: tuple[int, int] | None = None) -> Motions:
        """Take up to ``n`` steps from the Motion ``y`` at ``start + first dt``; fewer if one fails.
        Functions of time are sampled for all steps ``range(*block)`` at once; by default for
        these."""
        s, begun = self.system, y.t if start is None else start
        given = self._functions.of(begun, dt, (first, first + n), self.limit, block)
        lasting = s.histories.lasting
        rows, multipliers = np.empty((n, 4, s.N)), np.empty((n, 2, self.m))
        memories = np.full((n, 2 + (s.histories.values.size if lasting else 0)), np.nan)
        kernel, goes_on, ahead, points = self._begin(y, dt, n)
        data = Interval._make([float(dt), goes_on, ahead, *[  # steps and instants in one axis
            x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]) for x in given],
            int(s.backend.tables.motion_varies)])
        done = self._call(kernel, y, dt, (rows, memories[:, :2]), self._rule, data, self._state,
                          self._work, memories, rows, multipliers, points)
        history = memories[:, 2:] if lasting or y.history is None else np.array([y.history] * done)
        turns = np.empty(0) if y.turns is None else y.turns
        columns = (begun + dt * np.arange(first + 1, first + done + 1), *rows.swapaxes(0, 1),
                   *multipliers.swapaxes(0, 1), np.full(done, dt), memories[:, 0], history,
                   np.broadcast_to(turns, (done, len(turns))), np.empty((done, 0)))
        if self._means and done:
            starts = [np.concatenate([[y.u], rows[:done - 1, 0]]), np.full(done, dt)]
            if history.size:
                starts.insert(1, np.concatenate([[y.history], history[:done - 1]])[
                    :, s.histories.end:])
            columns = *columns[:-1], np.column_stack(starts)

        def memory(k):  # the start of a step, for the next guess
            start = np.array([y.u, y.v]) if k % done == 0 else rows[k % done - 1, :2]
            return {"start": start, "points": points[k % done]} if points.size else None

        return Motions({name: x[:done] for name, x in zip(COLUMNS, columns)}, memory)

    def _begin(self, y, dt, n):
        """The kernel, 1 if it continues a step, its extrapolation, and an array for what steps have
        at their points."""
        if self._nodes:
            self._nodes[1].lag = 0.5 * dt if self.scheme.conserving else 0.0
        work = self._work
        work.y[:] = y.u, y.v, y.acceleration, y.algorithmic
        work.m.l0[:], work.m.last[:] = y.multipliers, y.force
        return steps, 0, np.zeros((0, 0)), np.empty((n, 0, 0))

    def _call(self, function: Callable, y: Motion, dt: float, out: tuple[Array, Array],
              *args: Any) -> int:
        """Call a compiled function that takes steps; returns how many succeeded."""
        # On Ctrl-C it counts the steps that are complete, and sets ``stopped``. ``out`` has the
        # displacements, and for each step a number that is NaN until it is complete, and 1 if
        # something may touch in it.
        s, state, before, rows = self.system, self._state, np.array(self._state), out[0]
        if dt != self.dt:
            self.dt, state.factors[0] = dt, 0
        state.last_dt[0], state.failure[0], state.dissipated[0] = y.before, 0, y.dissipated
        call = self._backend.of(function, OF_STEP * len(rows), calls=bool(
            self._nodes or self._couplings))
        try:
            s.histories.put(y.history)
            with np.errstate(all="ignore"):
                done = call(self._matrices, *args)
        except BaseException as error:  # the motion may continue from y
            self._load_state(before)
            self.forget()
            if not isinstance(error, KeyboardInterrupt):
                raise
            done, self.stopped = int(np.argmax(np.append(np.isnan(out[1][:, 0]), True))), True
        done, self._lost = s.constraints.first_lost(rows[:done, 0])
        touches = out[1][:done, 1] > 0.0
        if touches.any() and s.forces.contacts.sweeps:
            u, v = (np.concatenate([[x], rows[:done, k]]) for k, x in enumerate((y.u, y.v)))
            done, passed = s.forces.contacts.sweep.first(u, v, y.t + dt * np.arange(len(u)))
            if passed:
                self._lost = f"the step jumps over the obstacle {passed}"
        if touches[:done].any() and s.forces.changing:
            done = self._first_passed(y, rows, done, dt, touches[:done])
        if done < len(rows):
            self.forget()
        return done

    def _first_passed(self, y, rows, done, dt, touches):
        """The number of steps before the first one that leads through a body."""
        u, passed = np.concatenate([[y.u], rows[:done, 0]]), self.system.forces.passed
        fast = self.system.forces.moves_far(u)
        fast[-1] = True  # what slow steps lead through stays there
        texts = (passed(*((u[j], y.t + j * dt) for j in (k, k + 1)))
                 for k in np.flatnonzero(fast & touches))
        if any(texts):
            for k in range(done):
                if text := passed(*((u[j], y.t + j * dt) for j in (k, k + 1))):
                    self._lost = text
                    return k
        return done

    def take(self, y: Motion, dt: float) -> Motion:
        """One step of size dt from the Motion ``y``; raises TimeStepFailed."""
        taken = self.run(y, dt, 1)
        if self.stopped:
            raise KeyboardInterrupt
        if not taken:
            raise TimeStepFailed(self.failure)
        return taken[0]

    def attempt(self, y: Motion, dt: float, again: bool = True) -> Motion:
        """One step of the scheme, repeated with new factors if it fails; raises TimeStepFailed."""
        while True:
            fresh = not self.ready or dt != self.dt
            try:
                new = self.scheme.step(self, y, dt)
            except (TimeStepFailed, ConvergenceError, np.linalg.LinAlgError) as failure:
                self.forget()
                if fresh or not again:
                    raise TimeStepFailed(str(failure)) from None
                continue
            if new.history is None:  # a custom scheme may not copy it
                new.history = y.history
            return new

    def step(self, y: Motion, dt: float, depth: int = 0) -> Motion:
        """One step, halved recursively if it does not converge; raises TimeStepFailed."""
        try:
            return self.attempt(y, dt, depth == 0)
        except TimeStepFailed as failure:
            if depth == DEPTH:
                past = self.leap(y, dt)
                if past is not None:
                    return interpolate(y, past, y.t + dt)
                raise TimeStepFailed(f"{failure}, nor with steps of {dt:.3g}") from None
            logger.info("step of %.3g at t = %.6g halved: %s", dt, y.t, failure)
        self.substeps += 1 if depth else 2
        middle = self.step(y, 0.5 * dt, depth + 1)
        end = self.step(middle, 0.5 * dt, depth + 1)
        end.parts = [part for one in (middle, end) for part in one.parts or [replace(one)]]
        return end

    def leap(self, y: Motion, dt: float) -> Motion | None:
        """A longer step past a singular position of the joints, or None."""
        # For example, all bars of a linkage may be collinear: steps that end there do not converge.
        # Collocation, which linearises joints once per step, uses an energy-momentum step here.
        system = self.system
        if not self.m or system.forces.contacts.obstacles or system.histories.evolve:
            return None
        other, begin = self, y
        if not in_steps(self.scheme):
            other = Integrator(self.system, EnergyMomentum())
            other.expect(self.energy)
            other.limit = self.limit
            begin = other.start(y.u, y.v, y.t, dt)
            begin.dissipated = y.dissipated
        for factor in (1.5, 2.3, 3.7, 6.1, 11.0, 23.0):  # times the step size
            with suppress(TimeStepFailed):
                return other.attempt(begin, factor * dt)
        return None

    # factors

    def solve(self, b: Array) -> Array:
        """Solve with the last factorised iteration matrix, b of shape (N,)."""
        if self._nodes:
            return self._nodes[0].solve(b, np.zeros(self.m))[0]
        x = b.copy()
        solve_rows(factors(self._matrices, self._state), self._matrices.rows, x)
        return x

    def filtered(self, du: Array) -> Array:
        """What the last step resolves of an increment du (N,): A^-1 (c M du)."""
        if not self.ready:
            return du
        s = self.system
        inertia = mass_factor(self._rule, self.dt) * s.mass.multiply(du)
        return self.solve(inertia * s.constraints.free)

    def forget(self) -> None:
        self._state.factors[0] = 0

    def _load_state(self, values):
        for array, value in zip(self._state, values):
            array[:] = value

    # checkpoints

    def arrays(self) -> dict[str, Any]:
        """Arrays by name from which :meth:`load` continues to the last bit."""
        found = {**self._state._asdict(), "dt": self.dt, "substeps": self.substeps}
        if self._nodes:
            (at, multipliers), mass = self._nodes[0].at, self._nodes[1].at
            found |= {"at": at, "multipliers at": multipliers}
            found |= {} if mass is None else {"mass at": mass}
        if self.ready:
            found |= self._factors()
        if self.system.forces.changing and not self._nodes:
            found |= dict(zip(KEPT, self.system.forces.kept))
        return {name: np.array(array) for name, array in found.items()}

    def load(self, arrays: dict[str, Any]) -> None:
        """Restore what :meth:`arrays` returned."""
        self._load_state([arrays[name] for name in self._state._fields])
        self.dt = float(arrays["dt"])
        self.substeps = int(arrays["substeps"])
        if self.ready:
            for name, array in self._factors().items():
                array[...] = arrays[name]
        if self.system.forces.changing and not self._nodes:
            i, j, values = (np.array(arrays[name]) for name in KEPT)
            self.system.forces.kept = i, j, values
            self.system.forces.clear[HAS_ENTRIES] = float(len(i) > 0)
            if self.ready:
                coupling(factors(self._matrices, self._state), np.zeros(0))
        if self._nodes:
            steps, mass = self._nodes
            if self.ready:
                steps.factorize(arrays["at"], arrays["multipliers at"])
            if "mass at" in arrays:
                mass.factorize(arrays["mass at"])

    def _factors(self) -> dict[str, Array]:
        A, rows, work = factors(self._matrices, self._state), self._matrices.rows, self._work
        beside = {"S": rows.S, "Z": rows.Z, "H": rows.H} if len(rows.P) else {}
        return {"A": A.flat, "pivots": A.pivots, "origin": work.x.origin, "ahead": work.x.ahead,
                "carried": work.stresses[3], "rates": work.stresses[5], **beside}


def _couplings(system):
    i, j, values = system.forces.kept
    kept = system.constraints.free[i] & system.constraints.free[j]
    return i[kept], j[kept], values[kept]


class StageIntegrator(Integrator):
    """Integrates a system by collocation, as an Integrator."""

    scheme: Collocation

    @cached_property
    def _functions(self):
        chebyshev = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)
        return TimeFunctions(self.system, np.append(self.scheme.points, 1.0), chebyshev)

    @cached_property
    def _work(self):
        s, N, m, rows = self.system, self.system.N, self.m, len(self._matrices.rows.P)
        method, D = self.scheme.table.method, s.mass._replace(flat=np.zeros(s.mass.flat.size))
        stresses = s.backend.tables.stresses.size
        n, k, ld, b = len(method.points), method.values.shape[1], D.width + 1 + SPARE, m + rows
        return StageWork._make([
            np.zeros((3, N)), np.zeros((2, N)), *np.zeros((6, n, N)), *np.zeros((4, n, m)),
            *np.zeros((3, n * stresses)), np.zeros((3, stresses)), np.zeros((4, N)),
            np.zeros(2 * b), np.zeros((2 * b, 2 * b)), np.zeros((k, 2 * b, 2 * b)),
            np.zeros((n, N)), np.zeros((k, N * ld), complex),
            Band(np.zeros(N * ld), np.zeros(0, np.int64), ld, D.width, 0), np.zeros((b, N)),
            np.zeros((2 * k, b, N)), np.zeros((2, rows, rows)), np.zeros((2, m, N)),
            np.zeros((m, m)), np.zeros(m), D, method])

    def _begin(self, y, dt, n):
        s, w, table, memory = self.system, self._work, self.scheme.table, y.memory or {}
        w.y[0], w.y[1], w.first[:] = y.u, y.v, y.multipliers
        ahead = table.method.ahead
        if "points" in memory:
            w.U[:], w.first[:] = np.split(memory["points"], [s.N], axis=1)
            w.before[:] = memory["start"]
            ahead = ahead if dt == y.before else table.ahead(dt / y.before)
        else:
            w.guess[:] = 0.5 * (dt * table.points[:, None])**2 * y.acceleration
        return collocate, int("points" in memory), ahead, np.empty((n, len(w.U), s.N + self.m))

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


__all__ = ["Integrator", "StageIntegrator", "TimeStepFailed"]
