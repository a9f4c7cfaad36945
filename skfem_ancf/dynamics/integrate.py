"""Time integration: arguments and the loop over steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import (AncfError, ConvergenceError, InputError, Interrupted, ModelWarning,
                           require_finite_scalar, require_flag, require_function, require_positive,
                           shown, warn)
from ..core.progress import progress_bar
from ..core.types import Array, StrPath
from ..equations.stability import largest_displacement
from ..equations.system import System
from ..results.state import State
from .base import Scheme, in_steps, same_scheme
from .checkpoint import Checkpoint
from .history import History
from .run import MAX_STEPS, Run, TimeStepFailed, task_of
from .sensors import Sensor

#: Interval in steps between checks for inverted elements.
LOOKED = 16
#: Memory limit of the dense constraint Jacobians, in gigabytes.
LARGEST = 2.0


def integrate(system: System, t_end: float, dt: float | str, scheme: Scheme, u: Array | None = None,
              v: Array | None = None, t_start: float | None = None, t_eval: ArrayLike | None = None,
              tol: float | None = None, rtol: float = 1e-5, progress: bool | None = None,
              start: State | None = None, breakpoints: ArrayLike = (),
              checkpoint: StrPath | None = None, every: int | None = None,
              until: Callable[[State], float] | None = None, check: bool = False,
              sensors: Sequence[tuple[str, Sensor]] = ()) -> History:
    """Integrate the equation of motion.

    Parameters
    ----------
    system, scheme
        A :class:`~skfem_ancf.equations.system.System` and a
        :class:`~skfem_ancf.dynamics.Scheme`.
    u, v
        Initial displacement and velocity, shape (N,); zero by default.
    start
        A State instead of ``u``; an instant of a motion replaces ``v`` too. With the same scene
        and scheme the motion continues exactly: from the last instant of a History to round-off,
        from others to the tolerance of the iteration.
    t_end, dt, t_start, t_eval, tol, rtol, progress, breakpoints, checkpoint, every, until, check
        As for :meth:`skfem_ancf.Scene.integrate`, ``t_eval`` and ``breakpoints`` of shape (n,).
    sensors
        Pairs of name and :class:`~skfem_ancf.dynamics.sensors.Sensor`.

    Returns
    -------
    History

    Raises
    ------
    ConvergenceError
        If a step fails even with 1/64 of its size; ``state`` is the History up to there.
    Interrupted
        On Ctrl-C, a KeyboardInterrupt; ``state`` is the History up to there.
    CheckpointError
        If the checkpoint cannot be written at the start.
    SupportError
        If joints are redundant, contradictory or open at the start, or if supports would displace
        the body suddenly.
    """
    motion = None if start is None else start._motion
    if t_start is None:
        t_start = 0.0 if motion is None else motion.t
    task = task_of(t_start, t_end, dt, t_eval, tol, rtol, [
        *np.atleast_1d(breakpoints), *_samples(system, t_start, t_end)])
    if not (in_steps(scheme) and system.mass_solver.by_nodes):
        _require_room(system)
    if not system.constraints.passing:
        system.constraints.require_independent_joints()
    system.constraints.require_motion()
    if until is not None:
        require_function("until", until, "of a State that returns a number")
    if checkpoint is not None and (until is not None or require_flag("check", check)):
        raise InputError("a checkpoint cannot store the function until=, nor the second motion "
                         "of check=True: leave out checkpoint=, or integrate in parts, "
                         "start=history.state(-1)")

    def begun(task, sensors=(), until=None):
        run = Run(system, scheme, task, sensors, until)
        if start is not None and motion is not None and same_scheme(start._origin[0], scheme):
            arrays = start._origin[1]
            if arrays is not None and len(start.u) == system.N:
                run.keep_size(arrays)
            if start.system is system and t_start == start.t and not system.forces.sampled:
                run.go_on(motion, arrays)
                return run
        rest = np.zeros(system.N)
        displacement = u if u is not None else rest if start is None else start.u
        velocity = v if motion is None else motion.v
        if motion is None:
            system.forces.contacts.require_clear(displacement, t_start)
        run.begin(displacement, rest if velocity is None else velocity,
                  system.histories.of_state(start), None if motion is None else motion.turns)
        return run

    run, file = begun(task, sensors, until), None
    if checkpoint is not None:
        file = Checkpoint(checkpoint, every, run)
        file.begin()
    history = follow(run, file, progress)
    if require_flag("check", check):
        history.error = _difference(history, begun, task, progress)
    return history


def _difference(history, begun, task, progress):
    """Largest difference from the motion with half the step size, over the size of the scene."""
    system, scheme = history.system, history.scheme
    fine = replace(task, t_end=history.t[-1], t_eval=history.t,
                   dt=None if task.dt is None else 0.5 * task.dt,
                   rtol=task.rtol * 0.5**scheme.order)  # an error per unit of time
    try:
        other, _ = _go(begun(fine), None, progress)
    except ConvergenceError:
        return np.nan
    except Interrupted as stopped:
        raise Interrupted(str(stopped), history) from None
    return largest_displacement(system, other.u - history.u) / system.size


def _samples(system, t_start, t_end):
    """Sampling times of controllers with zero-order hold."""
    if not system.forces.sampled:
        return []
    start = require_finite_scalar("t_start", t_start)
    span = require_positive("t_end - t_start", require_finite_scalar("t_end", t_end) - start)
    found = []
    for control in system.forces.sampled:
        if span / control.dt > MAX_STEPS:
            raise InputError(f"dt of {control!r} is too small for a motion of {span:g}")
        found += (start + control.dt * np.arange(1, np.ceil(span / control.dt))).tolist()
    return found


def _require_room(system):
    """Raise InputError if the dense constraint Jacobians would fill the memory."""
    size = 24e-9 * system.constraints.m * system.N
    if size > LARGEST:
        raise InputError(
            f"time integration stores the derivatives of {system.constraints.m} joint equations by "
            f"{system.N} degrees of freedom as dense matrices, {size:.3g} GB. A Frame avoids this "
            "with 'energy-momentum' and 'generalized-alpha', if it is supported at nodes, has no "
            "other joints, no springs between distant points and no modal damping. Otherwise use "
            "fewer elements, or scene.modes(k)")


def follow(run: Run, file: Checkpoint | None = None, progress: bool | None = None) -> History:
    """Take all steps of a Run; warn about inverted elements and deep contact."""
    history, inverted = _go(run, file, progress)
    contacts = run.system.forces.contacts
    texts = [] if inverted is None else [
        f"elements are turned inside out at t = {inverted:.6g} or before: the compression or "
        "bending is too large, and results after that time are meaningless. Use NeoHookean, more "
        "elements, a smaller load or shorter steps"]
    texts += filter(None, [contacts.sweep.deep()])
    texts += run.system.after(run.y.history).forces.contacts.sunk(run.y.u, run.y.t)
    for text in texts:
        warn(text, ModelWarning)
    return history


def _go(run, file, progress):
    """Take all steps; the History, and the time at which elements are inverted, or None."""
    system, task, inverted, looked = run.system, run.task, None, run.steps
    system.forces.contacts.sweep.begin()
    try:
        with progress_bar(progress, total=task.span, desc="time") as bar:
            bar.update(run.y.t - task.t_start)
            while not run.done:
                before = run.y.t
                run.advance()
                bar.update(run.y.t - before)
                if inverted is None and (run.steps >= looked or run.done):
                    looked, u = run.steps + LOOKED, run.y.u
                    if system.inverted(u) or system.folded(u):
                        inverted = run.y.t
                if file is not None:
                    file.update()
    except TimeStepFailed as failure:
        raise ConvergenceError(f"the motion could not be continued beyond t = {run.y.t:.6g}: "
                               f"{failure}; try a smaller dt{_of_samples(run)}",
                               run.history()) from None
    except AncfError as error:  # from a user's function: attach the motion so far
        vars(error)["state"] = run.history()
        raise
    except KeyboardInterrupt:
        raise Interrupted(f"stopped at t = {run.y.t:.6g} of {task.t_end:.6g}; the exception's "
                          "state is the History up to there", run.history()) from None
    return run.history(), inverted


def _of_samples(run):
    """Advice for a motion driven by sampled controllers that fails, or ""."""
    if not run.system.forces.sampled:
        return ""
    energy = max(run.integrator.energy, 0.0)
    return (f". The energy reached {energy:.3g}. If the motion does not explain that, the sampled "
            f"force of {shown(run.system.forces.sampled[0])} excites vibrations: sample more "
            "often, add damping, or use scheme='energy-momentum'")
