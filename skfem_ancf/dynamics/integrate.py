"""Time integration, and its checkpoints: files from which a motion continues."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.archive import Unreadable, read, write
from ..core import (AncfError, Array, CheckpointError, CheckpointWarning, ConvergenceError,
                    Interrupted, ModelWarning, StrPath, progress_bar, refuse, require_flag,
                    require_function, require_integer, require_path, retold, shown, warn)
from ..equations.stability import largest_displacement
from ..equations.system import System
from ..results.state import State
from .base import Motion, Scheme, in_steps
from .history import History
from .run import Run, TimeStepFailed, task_of
from .schemes import SCHEMES, get_scheme
from .sensors import Sensor

#: Memory limit of the dense constraint Jacobians, in gigabytes.
LARGEST = 2.0
#: Kind of the files.
FORMAT = "skfem-ancf checkpoint 13"
#: Default seconds between two checkpoints, and the fraction of time that writing may take.
SECONDS, SHARE = 60.0, 0.05


def integrate(system: System, scheme: Scheme, start: State | None, u: Array | None, v: Array,
              sensors: Sequence[tuple[str, Sensor]], progress: bool | None,
              until: Callable[[State], float] | None, check: bool, checkpoint: StrPath | None,
              every: int | None, t_start: float | None, **times: Any) -> History:
    """Integrate the equation of motion, see :meth:`skfem_ancf.Scene.integrate`."""
    # ``u`` and ``v`` (N,) are the displacement of ``start``, if there is one, and the velocity of a
    # start that is no instant of a motion; ``times`` are the other arguments of :func:`task_of`.
    if t_start is None:
        t_start = 0.0 if start is None or start._motion is None else start._motion.t
    task = task_of(t_start, **times, sampled=system.forces.sampled)
    # a Frame that is condensed to its nodes stores no dense constraint Jacobians
    size = 24e-9 * system.constraints.m * system.N
    refuse(size > LARGEST and not (in_steps(scheme) and system.mass_solver.by_nodes),
           "time integration stores the derivatives of {} joint equations by {} degrees of freedom "
           "as dense matrices, {:.3g} GB. A Frame avoids this with 'energy-momentum' and "
           "'generalized-alpha', if it is supported at nodes, has no other joints, no springs "
           "between distant points and no modal damping. Otherwise use fewer elements, or "
           "scene.modes(k)", system.constraints.m, system.N, size)
    if not system.constraints.passing:
        system.constraints.require_independent_joints()
    system.constraints.require_motion()
    if until is not None:
        require_function("until", until, "of a State that returns a number")
    refuse(checkpoint is not None and (until is not None or require_flag("check", check)),
           "a checkpoint cannot store the function until=, nor the second motion of check=True: "
           "leave out checkpoint=, or integrate in parts, start=history.state(-1)")

    def begun(task, sensors=(), until=None):
        run = Run(system, scheme, task, sensors, until)
        run.begin(start, u, v)
        return run

    run, file = begun(task, sensors, until), None
    if checkpoint is not None:
        file = Checkpoint(checkpoint, every, run)
        file.begin()
    history = follow(run, file, progress)
    if require_flag("check", check):  # with half the step size
        fine = replace(task, t_end=history.t[-1], t_eval=history.t,
                       dt=None if task.dt is None else 0.5 * task.dt,
                       rtol=task.rtol * 0.5**scheme.order)  # an error per unit of time
        try:
            other, _ = _go(begun(fine), None, progress)
        except ConvergenceError:
            history.error = np.nan
        except Interrupted as stopped:
            raise Interrupted(str(stopped), history) from None
        else:
            history.error = largest_displacement(system, other.u - history.u) / system.size
    return history


def follow(run: Run, file: "Checkpoint | None" = None, progress: bool | None = None) -> History:
    """Take all steps of a Run; warn about inverted elements and deep contact."""
    history, inverted = _go(run, file, progress)
    system, contacts = run.system, run.system.forces.contacts
    texts = [] if inverted is None else [
        f"elements are turned inside out at t = {inverted:.6g} or before: the compression or "
        "bending is too large, and results after that time are meaningless. Use NeoHookean, more "
        "elements, a smaller load or shorter steps"]
    texts += filter(None, [contacts.sweep.deep()])
    # points of a step of collocation that does not resolve stress waves yield to and fro; the work
    # from outside has to be known
    if run.scheme.collocates and system.histories.path_dependent and len(history) > 1 and not (
            system.varies or system.backend.tables.motion_varies or system.forces.elements or any(
                load.potential(0.0 * history.u[0][system.of(load)]) is None
                for load in system.loads)):
        columns = {name: rows[[0, -1]] for name, rows in history._columns.items()}
        ends = History(system, run.scheme, columns, (None, None), history.sensors)
        gain = float(np.diff(ends.total_energy + ends.dissipated)[0])
        size = float(np.max(ends.kinetic_energy + ends.strain_energy))
        if gain > 0.02 * size:
            texts.append(
                f"{run.scheme!r} brought in {gain / size:.0%} of the energy: materials yielded in "
                "steps that do not resolve the waves of stress, and the motion is wrong. Use "
                "scheme='energy-momentum', which keeps the balance, or a smaller dt")
    texts += system.after(run.y.history).forces.contacts.sunk(run.y.u, run.y.t)
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
                    looked, u = run.steps + 16, run.y.u  # now and then
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


# checkpoints: the last instant and the history so far

def _read(path: StrPath) -> dict[str, Any]:
    """The groups of arrays of a checkpoint, and its single arrays, by name."""
    path = require_path("checkpoint", path, (".npz",))
    refuse(not path.exists(), "there is no file {!r}", str(path), error=CheckpointError)
    with retold((OSError, Unreadable), "'{}' cannot be read, it is not a checkpoint or damaged: "
                "{error}", str(path), error=CheckpointError):
        arrays = read(path)
    refuse(str(arrays.get("format")) != FORMAT, "{!r} is not a checkpoint of a motion, or not of "
           "this version, which reads {!r}", str(path), FORMAT, error=CheckpointError)
    found: dict[str, Any] = {"task": {}, "run": {}, "now": {}, "history": {}, "memory": {},
                             "sensor": {}}
    for name, x in arrays.items():
        group, _, rest = name.partition(".")
        (found[group] if rest else found)[rest or name] = x.item() if x.shape == () else x
    return found


class Checkpoint:
    """Writes a Run to a file at intervals."""

    def __init__(self, path: StrPath, every: int | None, run: Run) -> None:
        self.path, self.run = require_path("checkpoint", path, (".npz",)), run
        run.longest = self.every = None if every is None else require_integer("every", every, 1)
        self._steps, self._clock, self._took = run.steps, time.monotonic(), 0.0

    def begin(self) -> None:
        """Write the start, so that problems show before the run."""
        if self.path.exists():
            with retold(CheckpointError, "{error}; it is not overwritten: choose another name",
                        error=CheckpointError):
                there = _read(self.path)
            refuse(not there["done"], "{!r} holds a run up to t = {:.6g} of {:.6g}: "
                   "scene.resume({!r}) continues it; delete the file to start again",
                   str(self.path), there["now"]["t"], there["task"]["t_end"], str(self.path),
                   error=CheckpointError)
        with retold(OSError, "the checkpoint '{}' cannot be written: {error}", str(self.path),
                    error=CheckpointError):
            self._write()

    def _write(self):
        """Write all that a Run consists of: the last instant, and the history so far."""
        run, now, begun = self.run, {**vars(self.run.y), "parts": None}, time.monotonic()
        groups = {"task": vars(run.task), "run": run.arrays(), "memory": now.pop("memory") or {},
                  "now": now, "history": run.columns(), "sensor": run.recorder.arrays()}
        q0, scheme = _identity(run.system, run.scheme)
        try:
            write(self.path, {
                "format": np.array(FORMAT), "every": np.array(self.every or 0), "q0": q0,
                "scheme": np.array(scheme), "done": np.array(run.done), **{
                    f"{group}.{name}": x for group, arrays in groups.items()
                    for name, x in arrays.items() if x is not None}})
        finally:
            self._steps, self._clock = run.steps, time.monotonic()
            self._took = self._clock - begun

    def update(self) -> None:
        """Write if it is due, or at the end; a failure gives a CheckpointWarning."""
        run, waited = self.run, time.monotonic() - self._clock
        if run.done or (waited > max(SECONDS, self._took / SHARE) if self.every is None
                        else run.steps - self._steps >= self.every):
            try:
                self._write()
            except OSError as error:
                warn(f"the checkpoint {str(self.path)!r} could not be written at t = "
                     f"{run.y.t:.6g}, the previous one remains: {error}", CheckpointWarning)


def resume(system: System, path: StrPath, scheme: str | Scheme | type[Scheme] | None = None,
           sensors: Sequence[tuple[str, Sensor]] = ()) -> tuple[Run, Checkpoint]:
    """The Run of a checkpoint file, and the Checkpoint that continues to write it."""
    found = _read(path)
    try:
        name, values = json.loads(found["scheme"])
        if scheme is None or scheme == "auto":  # the file has the scheme that "auto" chose
            refuse(name not in SCHEMES, "the run used a custom scheme, {!r}: pass it, resume(path, "
                   "scheme=...)", name, error=CheckpointError)
            made = SCHEMES[name].__new__(SCHEMES[name])
            vars(made).update(values)
        else:
            made = get_scheme(scheme)
        q0, text = _identity(system, made)
        refuse(not np.array_equal(found["q0"], q0), "it is from another scene: beams, bodies or "
               "their meshes differ", error=CheckpointError)
        refuse(text != found["scheme"], "the file is from a run with {!r} and {}, not with {!r}",
               name, values, made, error=CheckpointError)
        said = {"dt": "auto", "tol": None, "t_eval": None, **found["task"]}
        run = Run(system, made, task_of(**said), sensors)
        run.recorder.load(found["sensor"])
        run.load(Motion(**found["now"], memory=found["memory"] or None), found["run"],
                 found["history"])
        every = found["every"]
    except (CheckpointError, KeyError, ValueError, TypeError) as error:
        why = error if isinstance(error, CheckpointError) else (
            f"it is damaged, or from another scene: {error!r}")
        raise CheckpointError(f"{str(path)!r} cannot be resumed: {why}") from None
    return run, Checkpoint(path, every or None, run)


def _identity(system: System, scheme: Scheme) -> tuple[Array, str]:
    """What a scene is known by, positions and directions of all DOFs; the scheme as JSON."""
    return (np.concatenate([np.ravel(member.q0) for member in system.members]),
            json.dumps([scheme.name or type(scheme).__name__, vars(scheme)], default=repr))
