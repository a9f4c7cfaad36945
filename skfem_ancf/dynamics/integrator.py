"""One time step: its iteration, and the reuse of factors."""

import logging

import numpy as np

from ..errors import SupportError, require_positive
from ..linalg import dense
from .base import ITERATION, Motion
from .rates import rates

logger = logging.getLogger(__name__)

EPS = np.finfo(float).eps
DEPTH = 6  # how often a step is halved


class StepFailed(Exception):
    """The iteration of a step did not converge."""


class Integrator:
    """Advances the motion of a system.

    The factors of the iteration matrix are kept from step to step as long as the iteration
    contracts.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    scheme
        A :class:`~skfem_ancf.dynamics.Scheme`.
    tol
        Tolerance of the iteration in a step, relative, in the energy norm.

    Attributes
    ----------
    iterations, factorizations, substeps
        Residuals solved for, tangents factorised, and parts of steps that were cut.
    limit
        Time beyond which no function of time is asked.
    """

    def __init__(self, system, scheme, tol=None):
        self.system, self.scheme, self.limit = system, scheme, np.inf
        self.tol = scheme.tol if tol is None else require_positive("tol", tol)
        self.A = system.new_band()
        self._coefficients = None
        self._rate = 1.0
        self._energy = 0.0
        self.iterations = self.factorizations = self.substeps = 0

    # motions given as functions of time

    def _rates(self, function, t, dt, ahead):
        """First and second derivative of a function of one time."""
        return rates(lambda times: np.array([function(t) for t in times]), t, dt, ahead, self.limit)

    def _support_rates(self, t, dt, ahead=False):
        """Velocity and acceleration of the fixed coordinates, shape (nfixed,)."""
        s = self.system
        if not s.moves:
            return np.zeros((2, len(s.fixed)))
        return rates(s.values_at, t, dt, ahead, self.limit)

    def _constraint_rate(self, u, v, t, dt, ahead=False):
        """The rate of the joints' Phi, shape (m,)."""
        s = self.system
        rate = s.full_jacobian(u, t) @ v
        if s.drives:
            rate = rate + self._rates(lambda t: s.constraint(u, t), t, dt, ahead)[0]
        return rate

    def _constraint_acceleration(self, u, v, t, dt, ahead=False):
        """The second rate of Phi without accelerations of the coordinates, shape (m,)."""
        s = self.system
        rate = s.quadratic(u, t, v)
        if s.drives:
            rate = (rate + self._rates(lambda t: s.constraint(u, t), t, dt, ahead)[1]
                    + 2.0 * self._rates(lambda t: s.full_jacobian(u, t) @ v, t, dt, ahead)[0])
        return rate

    # the start

    def start(self, u, v, t, dt):
        """The Motion at the start, with consistent velocity, acceleration and multipliers.

        Where motions are given as functions of time, their rates are those in a step dt ahead.
        """
        s = self.system
        y = Motion(t, u.copy(), v.copy(), np.zeros(s.N), None, np.zeros(s.m))
        y.u[s.fixed] = s.values(1.0, t)
        gap = np.max(np.abs(s.constraint(y.u, t)), initial=0.0)
        if gap > 1e-8 * s.size:
            raise SupportError(f"the joints are open by {gap:.3g} at the start: begin with beams "
                               "that fit, or from a static solution (start=)")
        y.v[s.fixed], y.acceleration[s.fixed] = self._support_rates(t, dt, True)
        rate = np.zeros(s.m)
        if s.joints:
            y.v = y.v + s.solve_mass(np.zeros(s.N), y.u, t,
                                     -self._constraint_rate(y.u, y.v, t, dt, True))[0]
            rate = -(self._constraint_acceleration(y.u, y.v, t, dt, True)
                     + s.full_jacobian(y.u, t) @ y.acceleration)
        force = s.external_force(y.u, t) - s.internal_force(y.u) - s.mass.multiply(y.acceleration)
        acceleration, y.multipliers = s.solve_mass(force, y.u, t, rate)
        y.acceleration = y.acceleration + acceleration
        y.algorithmic, y.force = y.acceleration.copy(), y.multipliers
        self._energy = max(self._energy, 0.5 * y.v @ s.mass.multiply(y.v), s.strain_energy(y.u))
        return y

    # a step

    @property
    def ready(self):
        """True if there are factors."""
        return self._coefficients is not None

    def solve(self, b):
        """The iteration matrix's inverse times b (N,)."""
        return self.A.solve(b)

    def _factorize(self, step, u, start):
        """Factors at u, with the stress of the start of the step in the geometric part.

        The stress of an iterate may be far off: turning by a straight predictor stretches.
        """
        s = self.system
        _, pieces = s.assemble(start, t=step.t, geometric=False)
        s.assemble(step.middle(u), carried=s.stress_step(pieces, np.zeros(s.N)), t=step.t)
        self.A.combine(step.mass_factor, s.mass, step.stiffness_factor, s.K)
        self.A.fix(s.fixed_positions)
        self.A.factorize()
        self._coefficients = (step.mass_factor, step.stiffness_factor)
        self.factorizations += 1

    def _velocity(self, step, u, J, supports, dt):
        """The velocity that supports and joints allow, and the joints' impulses in it."""
        s = self.system
        v = step.velocity(u)
        v[s.fixed] = supports
        if not s.joints:
            return v, np.zeros(0)
        Y = s.mass_factors.solve(dense(J.T))
        impulse = np.linalg.solve(s.full_jacobian(u, step.t) @ Y,
                                  self._constraint_rate(u, v, step.t, dt))
        return v - Y @ impulse, impulse

    def advance(self, y, dt):
        """The Motion one step later; raises StepFailed."""
        s = self.system
        step = self.scheme.begin(s, y, dt)
        step.t, step.joint_time = min(step.t, self.limit), min(step.joint_time, self.limit)
        most, reused, fresh_rate, least_rate, diverging = ITERATION
        u, multipliers = step.guess.copy(), y.multipliers.copy()
        u[s.fixed] = s.values(1.0, step.t)
        guess = u.copy()
        v_fixed, a_fixed = self._support_rates(step.t, dt)
        held = step.support_acceleration(v_fixed, a_fixed)
        couples = self.scheme.couples_velocity and not all(joint.constant for joint in s.joints)
        fresh = False
        if self._coefficients != (step.mass_factor, step.stiffness_factor):
            self._factorize(step, u, y.u)
            fresh, self._rate = True, fresh_rate
        # round-off of the strains and of the inertia
        floor = np.hypot(8.0 * s.stiffness_scale * np.sqrt(step.stiffness_factor),
                         EPS * np.sqrt(step.mass_factor * abs(u @ s.mass.multiply(u))))
        v = step.velocity(u)
        v[s.fixed] = v_fixed
        energy = max(self._energy, 0.5 * v @ s.mass.multiply(v))
        wanted = self.tol * np.sqrt(energy) + floor
        before = None
        for _ in range(most):
            acceleration = step.acceleration(u)
            acceleration[s.fixed] = held
            R = (step.force(u) - s.mass.multiply(acceleration)) * s.free
            if s.joints:
                at = step.middle(u)
                J, phi = s.jacobian(at, step.joint_time), s.constraint(u, step.t)
                R = R - multipliers @ J
                if couples:
                    v, impulse = self._velocity(step, u, J, v_fixed, dt)
                    R -= s.free * s.curvature_times(at, step.joint_time, 0.25 * impulse, y.v + v)
            du = self.A.solve(R)
            work = np.sum(np.abs(R * du))
            if s.joints:
                Y = self.A.solve(dense(J.T))
                dm = np.linalg.solve(s.jacobian(u, step.t) @ Y,
                                     s.full_jacobian(u, step.t) @ du + phi)
                du, multipliers = du - Y @ dm, multipliers + dm
                work = np.sum(np.abs(R * du)) + abs(dm @ phi)
            size = np.sqrt(work)
            self.iterations += 1
            if not np.isfinite(size):
                raise StepFailed("the residual is not finite")
            u += du
            if before is not None:
                rate = size / before
                if rate > 1.0 and size <= 1e3 * floor:
                    break  # round-off
                self._rate = max(rate, least_rate)  # of one step, used in the next
                if rate > reused and size * min(1.0, rate) > wanted:
                    if fresh and rate > diverging:
                        raise StepFailed("the iteration diverges")
                    if rate > 1.0:  # old factors have led astray
                        u, multipliers = guess.copy(), y.multipliers.copy()
                    self._factorize(step, u, y.u)
                    fresh, before, self._rate = True, None, fresh_rate
                    continue
            if size * min(1.0, self._rate) <= wanted:
                break
            before = size
        else:
            raise StepFailed(f"no convergence in {most} iterations")
        v, impulse = self._velocity(step, u, s.jacobian(step.middle(u), step.joint_time), v_fixed,
                                    dt)
        new = step.finish(u, v, multipliers, impulse)
        new.acceleration[s.fixed] = new.algorithmic[s.fixed] = a_fixed
        if s.joints and step.acceleration_share:
            rate = (self._constraint_acceleration(u, v, step.t, dt)
                    + s.full_jacobian(u, step.t) @ new.acceleration)
            da, dm = s.solve_mass(np.zeros(s.N), u, step.t, -rate)
            new.acceleration, new.multipliers = new.acceleration + da, new.multipliers + dm
            new.algorithmic = new.algorithmic + step.acceleration_share * da
        self._energy = max(self._energy, 0.5 * new.v @ s.mass.multiply(new.v))
        return new

    def advance_safely(self, y, dt, depth=0):
        """As :meth:`advance`, in two halves where one step does not converge."""
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                return self.advance(y, dt)
        except (StepFailed, np.linalg.LinAlgError) as failure:
            self._coefficients = None
            if depth == DEPTH:
                raise StepFailed(f"{failure}, nor with steps of {dt:.3g}") from None
            logger.info("step of %.3g at t = %.6g halved: %s", dt, y.t, failure)
        self.substeps += 1 if depth else 2
        return self.advance_safely(self.advance_safely(y, 0.5 * dt, depth + 1), 0.5 * dt, depth + 1)

    # what a motion goes on with

    def forget(self):
        """Make new factors in the next step."""
        self._coefficients = None

    def remember(self):
        """Numbers and arrays from which :meth:`recall` goes on as if there had been no break."""
        memory = {"numbers": np.array([self._rate, self._energy, self.iterations,
                                       self.factorizations, self.substeps])}
        if self._coefficients is not None:
            kind, *arrays = self.A._factor
            memory.update(coefficients=np.array(self._coefficients),
                          kind=np.frombuffer(kind.encode(), np.uint8),
                          **{f"factor{k}": a for k, a in enumerate(arrays)})
        return memory

    def recall(self, memory):
        """Go on with what :meth:`remember` gave."""
        self._rate, self._energy, *counts = (float(x) for x in memory["numbers"])
        self.iterations, self.factorizations, self.substeps = map(int, counts)
        self._coefficients = None
        if "coefficients" in memory:
            self._coefficients = tuple(float(c) for c in memory["coefficients"])
            arrays = [memory[f"factor{k}"] for k in range(2) if f"factor{k}" in memory]
            self.A._factor = (bytes(memory["kind"]).decode(), *arrays)
