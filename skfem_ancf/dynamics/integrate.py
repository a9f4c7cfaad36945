"""The loop over time steps: iteration, reuse of factors, step size, storage."""

import logging

import numpy as np

from ..errors import (AncfError, ConvergenceError, InputError, SupportError, require_finite,
                      require_finite_scalar, require_positive, shown, taught)
from ..progress import progress_bar
from .base import Motion
from .blocks import CompiledSteps
from .history import History
from .rates import rates

logger = logging.getLogger(__name__)

MAX_ITERATIONS = 25
EPS = np.finfo(float).eps
MAX_STEPS = 10**9
MIN_RTOL = 1e-12
SLOW = 0.3  # contraction above which the factors are made anew
MANY = 4  # iterations to go above which old factors are made anew


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
    span
        Times of start and end, outside of which no function of time is asked.
    """

    def __init__(self, system, scheme, tol=None, span=(-np.inf, np.inf)):
        self.system, self.scheme, self.span = system, scheme, span
        self.tol = scheme.tol if tol is None else require_positive("tol", tol)
        self.A = system.new_band()
        self._coefficients = None
        self._rate = 1.0
        self._energy = 0.0
        self.iterations = self.factorizations = 0

    # motions given as functions of time

    def _rates(self, function, t, dt):
        """First and second derivative of a function of one time."""
        return rates(lambda times: np.array([function(t) for t in times]), t, dt, self.span)

    def _support_rates(self, t, dt):
        """Velocity and acceleration of the fixed coordinates, shape (nfixed,)."""
        s = self.system
        if not s.moves:
            return np.zeros((2, len(s.fixed)))
        return rates(s.values_at, t, dt, self.span)

    def _constraint_rate(self, u, v, t, dt):
        """The rate of the joints' Phi, shape (m,)."""
        s = self.system
        rate = s.full_jacobian(u, t) @ v
        return rate + self._rates(lambda t: s.constraint(u, t), t, dt)[0] if s.drives else rate

    def _constraint_acceleration(self, u, v, t, dt):
        """The second rate of Phi without accelerations of the coordinates, shape (m,)."""
        s = self.system
        rate = s.quadratic(u, t, v)
        if s.drives:
            rate = (rate + self._rates(lambda t: s.constraint(u, t), t, dt)[1]
                    + 2.0 * self._rates(lambda t: s.full_jacobian(u, t) @ v, t, dt)[0])
        return rate

    # the start

    def start(self, u, v, t, dt):
        """The Motion at the start, with consistent velocity, acceleration and multipliers."""
        s = self.system
        y = Motion(t, u.copy(), v.copy(), np.zeros(s.N), None, np.zeros(s.m))
        y.u[s.fixed] = s.values(1.0, t)
        gap = np.max(np.abs(s.constraint(y.u, t)), initial=0.0)
        if gap > 1e-8 * s.size:
            raise SupportError(f"the joints are open by {gap:.3g} at the start: begin with beams "
                               "that fit, or from a static solution (start=)")
        y.v[s.fixed], y.acceleration[s.fixed] = self._support_rates(t, dt)
        rate = np.zeros(s.m)
        if s.joints:
            y.v = y.v + s.solve_mass(np.zeros(s.N), y.u, t,
                                     -self._constraint_rate(y.u, y.v, t, dt))[0]
            rate = -(self._constraint_acceleration(y.u, y.v, t, dt)
                     + s.full_jacobian(y.u, t) @ y.acceleration)
        force = s.external_force(y.u, t) - s.internal_force(y.u) - s.mass.multiply(y.acceleration)
        acceleration, y.multipliers = s.solve_mass(force, y.u, t, rate)
        y.acceleration = y.acceleration + acceleration
        y.algorithmic = y.acceleration.copy()
        self._energy = max(self._energy, 0.5 * y.v @ s.mass.multiply(y.v), s.strain_energy(y.u))
        return y

    # a step

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
        Y = s.mass_factors.solve(np.ascontiguousarray(J.T))
        impulse = np.linalg.solve(s.full_jacobian(u, step.t) @ Y,
                                  self._constraint_rate(u, v, step.t, dt))
        return v - Y @ impulse, impulse

    def advance(self, y, dt):
        """The Motion one step later; raises StepFailed."""
        s = self.system
        step = self.scheme.begin(s, y, dt)
        u, multipliers = step.guess.copy(), y.multipliers.copy()
        u[s.fixed] = s.values(1.0, step.t)
        guess = u.copy()
        v_fixed, a_fixed = self._support_rates(step.t, dt)
        held = step.support_acceleration(v_fixed, a_fixed)
        couples = self.scheme.couples_velocity and not all(joint.constant for joint in s.joints)
        fresh = False
        if self._coefficients != (step.mass_factor, step.stiffness_factor):
            self._factorize(step, u, y.u)
            fresh, self._rate = True, 0.1
        # round-off of the strains and of the inertia
        floor = np.hypot(8.0 * s.stiffness_scale * np.sqrt(step.stiffness_factor),
                         EPS * np.sqrt(step.mass_factor * abs(u @ s.mass.multiply(u))))
        v = step.velocity(u)
        v[s.fixed] = v_fixed
        energy = max(self._energy, 0.5 * v @ s.mass.multiply(v))
        wanted = self.tol * np.sqrt(energy) + floor
        before = None
        for _ in range(MAX_ITERATIONS):
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
                Y = self.A.solve(np.ascontiguousarray(J.T))
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
                self._rate = max(rate, 0.01)  # it is used in the next step, where it may be larger
                left = np.log(wanted / size) / np.log(min(rate, 0.99))  # iterations to go
                if size > wanted and (rate > SLOW or (left > MANY and not fresh)):
                    if fresh and rate > 2.0:
                        raise StepFailed("the iteration diverges")
                    if rate > 1.0:  # old factors have led astray
                        u, multipliers = guess.copy(), y.multipliers.copy()
                    self._factorize(step, u, y.u)
                    fresh, before, self._rate = True, None, 0.1
                    continue
            if size * min(1.0, self._rate) <= wanted:
                break
            before = size
        else:
            raise StepFailed(f"no convergence in {MAX_ITERATIONS} iterations")
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
            if depth == 6:
                raise StepFailed(f"{failure}, nor with steps of {dt:.3g}") from None
            logger.info("step of %.3g at t = %.6g halved: %s", dt, y.t, failure)
            return self.advance_safely(self.advance_safely(y, 0.5 * dt, depth + 1), 0.5 * dt,
                                       depth + 1)

    def error(self, old, new, dt):
        """Estimate of the local error of a step, relative to the size of the scene."""
        de = self.scheme.error_constant * dt**2 * (new.algorithmic - old.algorithmic)
        mass = sum(b.total_mass for b in self.system.beams)
        return np.sqrt(max(de @ self.system.mass.multiply(de), 0.0) / mass) / self.system.size


@taught
def integrate(system, t_end, dt, scheme, u=None, v=None, t_start=0.0, t_eval=None, tol=None,
              rtol=1e-5, progress=None):
    """Integrate the equation of motion.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    t_end
        Time at the end.
    dt
        Step size, or "auto": chosen so that the local error stays below ``rtol`` of the size of
        the scene.
    scheme
        A :class:`~skfem_ancf.dynamics.Scheme`.
    u, v
        Displacement and velocity at the start, shape (N,); zero by default.
    t_start
        Time at the start.
    t_eval
        Times to store, interpolated by cubic Hermite polynomials in time; every step by default.
    tol
        Tolerance of the iteration in a step; the scheme's own by default.
    rtol
        Tolerance of the automatic step size.
    progress
        Show a progress bar: True, False, or None for "if it takes long".

    Returns
    -------
    History

    Raises
    ------
    ConvergenceError
        If a step fails even when cut to 1/64; its ``state`` is the History up to there.
    SupportError
        If joints repeat or contradict each other, or are open at the start.
    """
    t_start = require_finite_scalar("t_start", t_start)
    t_end = require_finite_scalar("t_end", t_end)
    t_end = require_positive("t_end - t_start", t_end - t_start) + t_start
    auto = isinstance(dt, str)
    if auto and dt != "auto":
        raise InputError(f'dt must be a positive number or "auto", got {dt!r}')
    span = t_end - t_start
    step = 1e-4 * span if auto else min(require_positive("dt", dt), span)
    _require_step(t_start, t_end, step)
    if t_eval is not None:
        t_eval = require_finite("t_eval", t_eval, (None,))
        if (not len(t_eval) or np.any(np.diff(t_eval) <= 0) or t_eval[0] < t_start
                or t_eval[-1] > t_end * (1 + 1e-12)):
            raise InputError(f"t_eval must increase within [{t_start}, {t_end}], got "
                             f"{shown(t_eval)}")
    rtol = require_positive("rtol", rtol)
    if rtol < MIN_RTOL:
        raise InputError(f"rtol must be at least {MIN_RTOL:g}, got {rtol!r}")
    system.require_independent_joints()
    zero = np.zeros(system.N)
    solver = Integrator(system, scheme, tol, (t_start, t_end))
    y = solver.start(zero if u is None else u, zero if v is None else v, t_start, step)
    history = History(system, scheme, solver)
    wanted = iter(() if t_eval is None else t_eval)
    next_time = next(wanted, None)
    if t_eval is None or next_time <= t_start:
        history.append(y)
        next_time = next(wanted, None)
    n = 0
    steps = None if auto else max(1, int(np.ceil(span / step * (1 - 1e-12))))
    blocks = None
    if CompiledSteps.applies(scheme, system):
        blocks = CompiledSteps(solver, scheme, system)
    whole = 0  # steps of one size, of which a block may take many
    if blocks is not None and not auto:
        whole = steps if abs(steps * step - span) < 1e-9 * step else steps - 1

    def advance(y, h):
        """One step, in Python where there is no compiled one or it fails."""
        if blocks is not None:
            done, motion = blocks.run(y, h, 1)
            if done:
                return motion(0)
        return solver.advance_safely(y, h)

    def store(old, new):
        """Keep what was asked for of the step from one Motion to the next."""
        nonlocal next_time
        while next_time is not None and next_time <= new.t * (1 + 1e-14):
            history.append(_between(old, new, next_time))
            next_time = next(wanted, None)
        if t_eval is None:
            history.append(new)

    def store_block(y, first, done, motion):
        """The same for a block of steps, of which only those that hold a time to store are made."""
        def instant(k):
            if k < 0:
                return y
            new = motion(k)
            new.t = t_start + (first + k + 1) * step if first + k + 1 < steps else t_end
            return new

        k, last = -1, y
        while k < done - 1:
            old, k = k, k + 1
            if t_eval is not None:
                until = np.inf if next_time is None else (next_time - t_start) / step - 1 - first
                k = int(min(max(k, until - 1), done - 1))
            before = last if k == old + 1 else instant(k - 1)
            last = instant(k)
            store(before, last)
        return last

    with progress_bar(progress, total=span, desc="time") as bar:
        while (n < steps) if steps is not None else (y.t < t_end - 1e-12 * span):
            if n < whole:
                done, motion = blocks.run(y, step, whole - n)
                if done:
                    old, y = y, store_block(y, n, done, motion)
                    n += done
                    bar.update(y.t - old.t)
                    continue
            if steps is not None:
                # the last step may be shorter; the others are of one size, to keep the factors
                h = step if n < steps - 1 else t_end - y.t
                h = step if abs(h - step) < 1e-9 * step else h
            else:
                h = min(step, t_end - y.t)
            try:
                new = advance(y, h)
            except StepFailed as failure:
                raise ConvergenceError(f"the motion could not be continued beyond t = {y.t:.6g}: "
                                       f"{failure}; try a smaller dt", history.close()) from None
            except AncfError as error:  # of a function of the caller's: what is done is kept
                error.state = history.close()
                raise
            if auto and n > 0:
                error = solver.error(y, new, h)
                factor = 0.9 * (rtol / max(error, 1e-300)) ** (1.0 / 3.0)
                if error > rtol and step > 1e-9 * span:
                    step = h * max(0.2, min(0.7, factor))
                    continue
                if factor > 1.5:  # small changes are not worth new factors
                    step = h * min(2.0, factor)
            if steps is not None:
                new.t = t_start + (n + 1) * step if n < steps - 1 else t_end
            n += 1
            store(y, new)
            bar.update(new.t - y.t)
            y = new
    return history.close()


def _require_step(t_start, t_end, step):
    """Raise InputError where the times of the steps cannot be told apart, or never end."""
    if step < 1e-100 or t_end > 1e100:  # their squares are in the equations
        raise InputError(f"times must lie between 1e-100 and 1e100, got dt = {step!r}, t_end = "
                         f"{t_end!r}")
    if step <= 8 * EPS * max(abs(t_start), abs(t_end)):
        raise InputError(f"dt = {step!r} is below the round-off of the times {t_start!r} to "
                         f"{t_end!r}")
    steps = (t_end - t_start) / step
    if steps > MAX_STEPS:
        raise InputError(f"dt = {step!r} takes {steps:.3g} steps to t_end = {t_end!r}: more than "
                         f"{MAX_STEPS:.0e} are not taken")


def _between(a, b, t):
    """The motion at t between two instants, by Hermite interpolation."""
    h, s = b.t - a.t, (t - a.t) / (b.t - a.t)
    if abs(s - 1.0) < 1e-12:
        return b
    du = b.u - a.u
    u = (a.u + s * s * (3 - 2 * s) * du + h * s * (1 - s) ** 2 * a.v + h * s * s * (s - 1) * b.v)
    v = (6 * s * (1 - s) / h * du + (1 - s) * (1 - 3 * s) * a.v + s * (3 * s - 2) * b.v)
    acceleration = (1 - s) * a.acceleration + s * b.acceleration
    multipliers = (1 - s) * a.multipliers + s * b.multipliers
    return Motion(float(t), u, v, acceleration, acceleration, multipliers)
