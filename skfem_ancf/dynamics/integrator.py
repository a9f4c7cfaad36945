"""Takes time steps: many at once, one, or its halves where it fails."""

from __future__ import annotations

import logging
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations.condensation import Condensed, CondensedMass
from ..core.errors import (AncfError, CheckpointError, InputError, SupportError, require_positive,
                           shown)
from ..core.kept import cached_property, twin_of
from ..core.linalg import halves
from ..core.callbacks import handle_of
from .base import (Memories, Motion, Steps, contacts_of, in_steps, interpolate, kept, recalled,
                   same_scheme)
from .course import Courses
from .rates import rates
from .dampers import Dampers, Rows, solve_rows
from .energy_momentum import EnergyMomentum
from .joined import Joined
from .steps import (BEFORE, COUNT, DISSIPATED, ENERGY, FACTORIZED, FAILURE, FAILURES, READY, STATE,
                    SYMMETRIC, TURNED, Matrices, Rule, factors, mass_factor, room_for_steps, steps)

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..equations.system import System
    from ..core.types import Array
    from .base import Scheme

logger = logging.getLogger(__name__)

DEPTH = 6  # how often a step is halved
#: Lengths of a step past a position in which joints depend on each other, over that to it.
LEAPS = 1.5, 2.3, 3.7, 6.1, 11.0, 23.0
#: Steps of a block at most, and numbers that they may store.
BLOCK, STORED = 256, 2_000_000
#: Coordinates up to which work arrays are kept for the next motion: there making them takes longer
#: than some steps.
LENT = 1000
#: Of texts that ask no function in Python: what runs them sees to warnings.
_NOTHING: AbstractContextManager[None] = nullcontext()


class StepFailed(Exception):
    """The iteration of a step did not converge."""


class Integrator:
    """Advances the motion of a system.

    The factors of the iteration matrix are kept from step to step as long as the iteration
    contracts.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    scheme
        A :class:`~skfem_ancf.dynamics.Scheme`.
    tol
        Tolerance of the iteration in a step, relative, in the energy norm.

    Attributes
    ----------
    substeps
        Parts of steps that were cut.
    limit
        Time beyond which no function of time is asked.
    longest
        Steps of a block at most.
    kept : dict of ndarray
        What a scheme with steps of its own keeps for the next, as factors: :meth:`forget` clears
        it.
    room, asked
        Its work arrays, and functions of time asked for a block of steps.
    machine
        What runs texts: that of the system, or one with other tables.
    """

    def __init__(self, system: System, scheme: Scheme, tol: float | None = None) -> None:
        scheme.require(system)
        if not scheme.conserving:
            alpha_m, alpha_f, beta, _ = scheme.parameters
            kick = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta)
            system.forces.contacts.require_penalty(scheme, kick if in_steps(scheme) else np.inf)
        M, A = system.mass.band, system.new_band()
        self._nodes: tuple[Condensed, CondensedMass] | None = None
        if in_steps(scheme) and system.mass_solver.by_nodes:
            self._nodes = Condensed(system, A), CondensedMass(system)
        turned = scheme.conserving and self._nodes is None
        U = halves(system.N if turned else 0, system.bandwidth)
        self.matrices = Matrices(M, system.mass_solver.factors.band, A.band, U, *_damping(system))
        self._state = np.zeros(STATE)
        self.room: Any = None
        self.asked: Any = None
        self._begun: Any = (None,)
        self.machine = system.machine
        self._ruled: Any = None
        self._begin(system, scheme, tol)
        numbers = 4 * system.N + system.forces.contacts.tables.memory.size
        self.longest = max(1, min(STORED // numbers, BLOCK))

    @cached_property
    def _work(self):
        """Work arrays of the steps of :mod:`~skfem_ancf.dynamics.steps`."""
        s, m = self.system, self.system.constraints.m
        return room_for_steps(s.N, m, s.machine.tables.stresses.size, 0 if self._nodes else m)

    def _begin(self, system, scheme, tol):
        """As if nothing had been integrated yet."""
        self.system, self.scheme, self.limit = system, scheme, np.inf
        self.tol = scheme.tol if tol is None else require_positive("tol", tol)
        if self.tol >= 1.0:
            raise InputError(f"tol is the error of a step's iteration, relative: less than 1, and "
                             f"1e-6 is coarse already; got {shown(tol)}")
        ruled = scheme.conserving, scheme.parameters, self.tol
        if self._ruled != ruled:
            handles = [handle_of(one) for one in self._nodes or ()] or (0, 0)
            self._ruled, self.rule = ruled, Rule(
                int(scheme.conserving), *map(float, scheme.parameters), self.tol,
                8.0 * system.scales.strain_noise, system.scales.inertia_of_places, *handles)
        self._state.fill(0.0)
        self._dt, self.substeps, self._lost = np.nan, 0, ""
        self.kept: dict[str, Array] = {}
        motion_varies = system.machine.tables.motion_varies
        if system.varies or motion_varies or self.asked is None:
            self._courses, self.asked = Courses(scheme.conserving), (None,)
        self._courses.system = system

    @classmethod
    def lent(cls, system: System, scheme: Scheme, tol: float | None = None) -> Integrator:
        """One with the work arrays of a motion that has ended, if there is one.

        Parameters
        ----------
        system, scheme, tol
            As of the class.
        """
        free = system.integrators
        try:
            integrator = free.pop()
        except IndexError:
            return cls(system, scheme, tol)
        if same_scheme(integrator.scheme, scheme):
            integrator._begin(system, scheme, tol)
            return integrator
        return cls(system, scheme, tol)

    def give_back(self) -> None:
        """Its motion has ended: its work arrays are for another one, where they are small."""
        free = self.system.integrators
        if self._nodes is None and self.system.N <= LENT and len(free) < 2:
            # without a circle both go when nobody asks for them any more
            del self.system, self._courses.system
            free.append(self)

    @property
    def iterations(self) -> int:
        """Residuals solved for."""
        return int(self._state[COUNT])

    @property
    def factorizations(self) -> int:
        """Tangents factorised."""
        return int(self._state[FACTORIZED])

    def count(self, other: Integrator) -> None:
        """Add the counts of another, which begins from zero."""
        self._state[[COUNT, FACTORIZED]] += other._state[[COUNT, FACTORIZED]]
        self.substeps += other.substeps
        other.reset()

    def reset(self) -> None:
        """Count from zero."""
        self._state[[COUNT, FACTORIZED]], self.substeps = 0.0, 0

    # the start

    def support_rates(self, t: float, dt: float, ahead: bool = True) -> Any:
        """Velocity and acceleration of the fixed coordinates, shape (nfixed,) each.

        Parameters
        ----------
        t, dt, ahead
            As for :meth:`start`.
        """
        s = self.system
        if not s.constraints.moves:
            return np.zeros((2, len(s.constraints.fixed)))
        return rates(s.constraints.values_at, t, dt, ahead, self.limit)

    def ask(self, start: float, dt: float, n: int) -> None:
        """Ask the functions of joints for the first steps: the start has its rates from there.

        Parameters
        ----------
        start, dt, n
            Where the steps begin, their size, and how many there will be.
        """
        if self.scheme.text == "steps" and self.system.constraints.drives:
            block = 0, min(n, self.longest)
            with suppress(AncfError):  # what fails is said where the motion comes to it
                self._courses.of(start, dt, 0, block[1], block, self.limit)

    def start(self, u: Array, v: Array, t: float, dt: float, ahead: bool = True,
              memory: Array | None = None) -> Motion:
        """The Motion at the start, with consistent velocity, acceleration and multipliers.

        Where motions are given as functions of time, their rates are those in a step dt ahead.

        Parameters
        ----------
        u, v
            Displacement and velocity, shape (N,).
        t, dt
            Time, and the step in which functions of time are asked.
        ahead
            The step begins there; False where it ends.
        memory
            What points remember of obstacles there, shape (k,); None: nothing.
        """
        s = self.system
        instant = t, dt, ahead, self.limit
        asked = self._courses.asked(*instant) if s.constraints.m else None
        # it is that of the motion before from the same place with the same motion of joints
        steady = not (s.varies or s.forces.elements or s.machine.tables.asks)
        key = (u.tobytes(), v.tobytes(), *(() if asked is None else (
            dt, ahead, asked.tobytes()))) if steady else None
        if key is None or self._begun[0] != key:
            self._begun = key, *self._start(u, v, instant, memory)
        _, y, (strain, kinetic, power, change) = self._begun
        y = twin_of(y)
        y.t = t
        # from rest there is no energy yet
        self.expect(max(strain, kinetic, kinetic + dt * power + dt**2 * change))
        return y

    def _start(self, u, v, instant, memory):
        """The same, with the strain energy, the kinetic one and half its two derivatives."""
        s, contacts, (t, dt, ahead, _) = self.system, self.system.forces.contacts, instant
        y = Motion(t, u.copy(), v.copy(), np.zeros(s.N), np.zeros(s.N),
                   np.zeros(s.constraints.m))
        fixed = s.constraints.fixed
        if s.constraints.moves:
            y.u[fixed] = s.constraints.values(1.0, t)
            y.v[fixed], y.acceleration[fixed] = self.support_rates(t, dt, ahead)
        else:
            y.u[fixed] = y.v[fixed] = 0.0
        self._require_held(y.u - u, t)
        rate, J = y.multipliers, None
        joined = None
        if s.constraints.m:
            joined = Joined(s, self._courses.joints(*instant), y.u, instant)
        if joined is not None:
            gap = np.abs(joined.gap())
            if np.any(gap > 1e-8 * s.machine.tables.plain.joints.sizes):
                raise SupportError(f"the joints are open by {gap.max():.3g} at the start: begin "
                                   "with beams that fit, or from a static solution (start=)")
            J = joined.J
        solve = s.mass_solver(y.u, t, J)
        jump = y.v - v  # of fixed coordinates: their impulses move the free ones
        if joined is not None or jump.any():
            closing = rate if joined is None else -joined.rate(y.v)
            y.v = y.v + solve(-s.mass.multiply(jump), closing)[0]
        if joined is not None:
            rate = -joined.bend(y.v, y.acceleration)
        with contacts.lent(memory):
            if memory is not None and not contacts.lasting:
                y.memory = {"contacts": memory}  # how stiff obstacles are
            elif contacts.lasting:
                now = contacts.begin(y.u, t) if memory is None else memory
                y.memory = {"contacts": contacts.tables.memory.copy() if now is None else now}
            force = s.external_force(y.u, t) - s.internal_force(y.u, t)
            if s.constraints.moves:
                force -= s.mass.multiply(y.acceleration)
            if s.damped:
                force = force - s.damping_force(y.u, y.v, t)
        acceleration, y.multipliers = solve(force, rate)
        y.acceleration += acceleration
        y.algorithmic, y.force = y.acceleration.copy(), y.multipliers
        inertia = s.mass.multiply(y.acceleration)
        return y, (s.strain_energy(y.u, t), 0.5 * float(y.v @ s.mass.multiply(y.v)),
                   float(y.v @ inertia), 0.5 * float(y.acceleration @ inertia))

    def _require_held(self, jump, t):
        """Raise SupportError where supports would move a body at once, in the mean of its mass."""
        if not jump.any():
            return
        s = self.system
        along = np.concatenate([member.rigid_motions()[:, 0] for member in s.members])
        gap = np.sqrt(jump @ s.mass.multiply(jump) / (along @ s.mass.multiply(along)))
        if gap > 1e-8 * s.size:
            raise SupportError(
                f"supports would move the body at once by {gap:.3g} in the mean, at t = {t:.6g}: "
                "begin with a state that they hold, as a static solution (start=), and move them "
                "by continuous functions of time")

    def expect(self, energy: float) -> None:
        """The iteration's tolerance is relative to the largest energy of the motion."""
        self._state[ENERGY] = max(self._state[ENERGY], energy)

    @property
    def energy(self) -> float:
        """The largest energy seen."""
        return self._state[ENERGY]

    # steps

    def run(self, y: Motion, dt: float, n: int, start: float | None = None, first: int = 0,
            block: tuple[int, int] | None = None) -> Steps:
        """Up to ``n`` steps from the Motion ``y``; fewer where one fails.

        Parameters
        ----------
        y, dt, n
            Where the motion is, and size and number of the steps.
        start, first
            ``y`` is at ``start + first dt``.
        block
            Numbers of steps between which functions of time are asked at once: these steps by
            default.

        Returns
        -------
        Those that were done.
        """
        s, contacts = self.system, self.system.forces.contacts
        begun, block = y.t if start is None else start, block or (first, first + n)
        course = self._courses.of(begun, dt, first, n, block, self.limit)
        if self._nodes:
            self._nodes[1].lag = 0.5 * dt if self.scheme.conserving else 0.0
        rows, works = np.empty((n, 4, s.N)), np.empty(n)
        multiplier_rows = np.empty((n, 2, s.constraints.m))
        memories = np.empty((n, contacts.tables.memory.size if contacts.lasting else 0))
        work = self._work
        work.y[:] = y.u, y.v, y.acceleration, y.algorithmic
        work.m.l0[:], work.m.last[:] = y.multipliers, y.force
        with contacts.lent(contacts_of(y)):
            done = self.call(steps, y, dt, self.rule, course, self._state, work, memories, rows,
                             multiplier_rows, works)

        memory = Memories(y, done, memories if contacts.lasting else None)
        return Steps(begun, dt, first, rows, multiplier_rows, works, memory)

    def call(self, text: Callable, y: Motion, dt: float, *args: Any) -> int:
        """Take steps by a text of equations, matrices and others.

        Parameters
        ----------
        text, *args
            What it is, and all but its first two arguments, of which ``state`` is
            :attr:`state` and the third from the end takes the displacements, shape (n, k, N).
        y, dt
            Where the motion is, and the size of the steps.

        Returns
        -------
        int
            The number of steps done.
        """
        s, before, rows = self.system, self._state.copy(), args[-3]
        if dt != self._dt:
            self._dt, self._state[READY] = dt, 0.0
        state = self._state
        state[BEFORE], state[FAILURE], state[DISSIPATED] = y.before, 0.0, y.dissipated
        function = self.machine.of(text)
        asks = self.machine.tables.asks
        try:
            with np.errstate(all="ignore") if asks else _NOTHING:
                done = function(self.matrices, *args)
        except BaseException:  # also Ctrl-C: the motion may go on from y
            self._state[:], self._state[READY] = before, 0.0
            raise
        done, self._lost = s.constraints.first_lost(rows[:done, 0])
        if done and s.forces.contacts.sweeps:
            done, self._lost = self._swept(y, dt, rows[:done], self._lost)
        if done < len(rows):
            self._state[READY] = 0.0
        return done

    def _swept(self, y, dt, rows, lost):
        """How many steps of ``rows`` pass through no obstacle, and why there are no more."""
        u, v = (np.concatenate([[x], rows[:, k]]) for k, x in enumerate((y.u, y.v)))
        done, text = self.system.forces.contacts.sweep.first(
            u, v, y.t + dt * np.arange(len(u)))
        return done, f"no step that touches {text}, it jumps over it" if text else lost

    @property
    def state(self) -> Array:
        """What texts keep from step to step, as of :func:`~skfem_ancf.dynamics.steps.steps`."""
        return self._state

    @property
    def failure(self) -> str:
        """Why the last step has failed."""
        return self._lost or FAILURES[int(self._state[FAILURE])]

    def take(self, y: Motion, dt: float) -> Motion:
        """One step from the Motion ``y``; raises StepFailed.

        Parameters
        ----------
        y, dt
            Where the motion is, and the size of the step.
        """
        taken = self.run(y, dt, 1)
        if not taken:
            raise StepFailed(self.failure)
        return taken[0]

    def step(self, y: Motion, dt: float, depth: int = 0) -> Motion:
        """One step, in two halves where it does not converge; raises StepFailed.

        Parameters
        ----------
        y, dt
            Where the motion is, and the size of the step.
        depth
            How often it is halved already.
        """
        try:
            return self.attempt(y, dt, depth == 0)
        except StepFailed as failure:
            if depth == DEPTH:
                past = self.leap(y, dt)
                if past is not None:
                    return interpolate(y, past, y.t + dt)
                raise StepFailed(f"{failure}, nor with steps of {dt:.3g}") from None
            logger.info("step of %.3g at t = %.6g halved: %s", dt, y.t, failure)
        self.substeps += 1 if depth else 2
        return self.step(self.step(y, 0.5 * dt, depth + 1), 0.5 * dt, depth + 1)

    def leap(self, y: Motion, dt: float) -> Motion | None:
        """A longer step, past a position in which joints depend on each other, or None.

        As where all bars of a linkage are in line: steps that end there do not converge, and
        shorter ones end there too. Collocation takes one direction of each joint for a whole step,
        and has none near there: it is a step of the energy-momentum scheme then.

        Parameters
        ----------
        y, dt
            Where the motion is, and the size of a step that has failed.
        """
        if not self.system.constraints.m or self.system.forces.contacts.obstacles:
            return None
        other = self if in_steps(self.scheme) else Integrator.lent(self.system, EnergyMomentum(),
                                                                   None)
        begin = y
        if other is not self:
            other.expect(self.energy)
            other.limit = self.limit
            begin = other.start(y.u, y.v, y.t, dt)
            begin.dissipated = y.dissipated
        for factor in LEAPS:
            with suppress(StepFailed):
                return other.attempt(begin, factor * dt)
        return None

    def attempt(self, y: Motion, dt: float, again: bool = True) -> Motion:
        """One step; raises StepFailed.

        Parameters
        ----------
        y, dt
            As of :meth:`step`.
        again
            By new factors where those of other steps fail.
        """
        while True:
            fresh = not self.ready or dt != self._dt
            try:
                new = self.scheme.step(self, y, dt)
            except (StepFailed, np.linalg.LinAlgError) as failure:
                self.forget()
                if fresh or not again:
                    raise StepFailed(str(failure)) from None
                continue
            if contacts_of(new) is None:  # a scheme of one's own may not hand it on
                new.memory = kept(y, None, **(new.memory or {}))
            return new

    # factors

    @property
    def dt(self) -> float:
        """Size of the last step."""
        return self._dt

    @property
    def ready(self) -> bool:
        """True if there are factors of an iteration matrix."""
        return self._state[READY] != 0.0

    def solve(self, b: Array) -> Array:
        """The inverse of the last iteration matrix times b (N,)."""
        if self._nodes:
            return self._nodes[0].solve(b, np.zeros(self.system.constraints.m))[0]
        x = b.copy()
        solve_rows(factors(self.matrices, self._state), self.matrices.rows, x)
        return x

    def mass_factor(self) -> float:
        """Factor of the mass in the last iteration matrix."""
        return mass_factor(self.rule, self._dt)

    def forget(self) -> None:
        """Make new factors in the next step."""
        self._state[READY] = 0.0
        self.kept.clear()

    # what a motion goes on with

    def remember(self) -> dict[str, Any]:
        """Numbers and arrays from which :meth:`recall` goes on as if there had been no break."""
        memory = {name: array.copy() for name, array in self._factors().items()}
        memory.update(state=self._state.copy(), dt=self._dt, substeps=self.substeps)
        if self._nodes:
            steps, mass = self._nodes
            memory.update({"at": steps.at[0], "multipliers at": steps.at[1],
                           "mass at": np.zeros(0) if mass.at is None else mass.at})
        memory.update({f"kept {name}": array.copy() for name, array in self.kept.items()})
        return memory

    def recall(self, memory: dict[str, Any]) -> None:
        """Go on with what :meth:`remember` gave."""
        self._state[:] = recalled(memory, "state", (STATE,))
        if not (np.isfinite(self._state).all() and self._state[READY] in (0.0, SYMMETRIC, TURNED)
                and self._state[FAILURE] in range(len(FAILURES))):
            raise CheckpointError(f"the state of the steps is {self._state}")
        self._dt = float(recalled(memory, "dt", (), finite=False))
        self.substeps = int(recalled(memory, "substeps", (), "i"))
        self.kept = {name[5:]: np.array(array) for name, array in memory.items()
                     if name.startswith("kept ")}
        for name, array in self._factors().items():
            array[...] = recalled(memory, name, array.shape, array.dtype.kind, finite=False)
            if name == "pivots" and array.size and not 0 <= array.min() <= array.max() < array.size:
                raise CheckpointError("the exchanges of rows are none")
        if self._nodes:
            self._recall_nodes(memory)

    def _recall_nodes(self, memory):
        steps, mass = self._nodes
        s = self.system
        if self.ready:
            steps.factorize(recalled(memory, "at", (s.N,)),
                            recalled(memory, "multipliers at", (s.constraints.m,)))
        if np.shape(memory.get("mass at")) != (0,):
            mass.factorize(recalled(memory, "mass at", (s.N,)))

    def _factors(self):
        """The arrays of the factors of steps, by name; none where there are no such factors."""
        if not self.ready or self.scheme.text != "steps":
            return {}
        A, rows = factors(self.matrices, self._state), self.matrices.rows
        beside = {"S": rows.S, "Z": rows.Z, "H": rows.H} if len(rows.P) else {}
        return {"A": A.flat, "pivots": A.pivots, "origin": self._work.x.origin,
                "ahead": self._work.x.ahead, "carried": self._work.stresses[3],
                "rates": self._work.stresses[5], **beside}


def _damping(system):
    """Rows beside the band, and the Dampers of a system."""
    modes, M = system.modal_damping.rows, system.mass.band
    rows = np.concatenate([modes, system.forces.far_rows()])
    k = len(rows)
    D = M._replace(flat=np.zeros(M.flat.size if system.viscous else 0))
    return (Rows(rows, np.zeros((k, k)), np.zeros(rows.shape), np.zeros((k, k))),
            Dampers(int(system.damped), int(system.viscous), int(system.forces.resists),
                    system.damping.mass, D, modes))


__all__ = ["Integrator", "StepFailed"]
