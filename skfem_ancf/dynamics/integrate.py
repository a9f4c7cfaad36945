"""Time integration: arguments and the loop over steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.errors import (AncfError, ConvergenceError, InputError, Interrupted, ModelWarning,
                           require_flag, require_function, shown, warn)
from ..core.progress import progress_bar
from ..core.types import Array, StrPath
from ..equations.stability import largest_displacement
from ..equations.system import System
from ..results.state import State
from .base import Scheme, in_steps
from .checkpoint import Checkpoint
from .history import History
from .run import Run, TimeStepFailed, task_of
from .sensors import Sensor

#: Interval in steps between checks for inverted elements.
LOOKED = 16
#: Memory limit of the dense constraint Jacobians, in gigabytes.
LARGEST = 2.0


def integrate(system: System, scheme: Scheme, start: State | None, u: Array | None, v: Array,
              sensors: Sequence[tuple[str, Sensor]], progress: bool | None,
              until: Callable[[State], float] | None, check: bool, checkpoint: StrPath | None,
              every: int | None, t_start: float | None, **times: Any) -> History:
    """Integrate the equation of motion, see :meth:`skfem_ancf.Scene.integrate`.

    ``u`` and ``v`` (N,) are the displacement of ``start``, if there is one, and the velocity of a
    start that is no instant of a motion; ``times`` are the other arguments of :func:`task_of`.
    """
    if t_start is None:
        t_start = 0.0 if start is None or start._motion is None else start._motion.t
    task = task_of(t_start, **times, sampled=system.forces.sampled)
    # a Frame that is condensed to its nodes stores no dense constraint Jacobians
    size = 24e-9 * system.constraints.m * system.N
    if size > LARGEST and not (in_steps(scheme) and system.mass_solver.by_nodes):
        raise InputError(
            f"time integration stores the derivatives of {system.constraints.m} joint equations by "
            f"{system.N} degrees of freedom as dense matrices, {size:.3g} GB. A Frame avoids this "
            "with 'energy-momentum' and 'generalized-alpha', if it is supported at nodes, has no "
            "other joints, no springs between distant points and no modal damping. Otherwise use "
            "fewer elements, or scene.modes(k)")
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
        run.begin(start, u, v)
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
        text = (f"the motion could not be continued beyond t = {run.y.t:.6g}: {failure}; try a "
                "smaller dt")
        if system.forces.sampled:
            text += (f". The energy reached {max(run.integrator.energy, 0.0):.3g}. If the motion "
                     "does not explain that, the sampled force of "
                     f"{shown(system.forces.sampled[0])} excites vibrations: sample more often, "
                     "add damping, or use scheme='energy-momentum'")
        raise ConvergenceError(text, run.history()) from None
    except AncfError as error:  # from a user's function: attach the motion so far
        vars(error)["state"] = run.history()
        raise
    except KeyboardInterrupt:
        raise Interrupted(f"stopped at t = {run.y.t:.6g} of {task.t_end:.6g}; the exception's "
                          "state is the History up to there", run.history()) from None
    return run.history(), inverted
