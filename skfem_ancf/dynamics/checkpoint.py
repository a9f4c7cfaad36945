"""Checkpoints: files of the last instant and the history so far, from which a motion continues."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.archive import Unreadable, read, write
from ..core.errors import CheckpointError, CheckpointWarning, require_integer, require_path, warn
from ..core.types import Array, StrPath
from ..equations.system import System
from .base import Motion, Scheme
from .choice import SCHEMES, get_scheme
from .run import Run, task_of
from .sensors import Sensor

FORMAT = "skfem-ancf checkpoint 12"
#: Default seconds between two checkpoints, and the fraction of time that writing may take.
SECONDS, SHARE = 60.0, 0.05


def _read(path: StrPath) -> dict[str, Any]:
    """The groups of arrays of a checkpoint, and its single arrays, by name."""
    path = require_path("checkpoint", path, (".npz",))
    if not path.exists():
        raise CheckpointError(f"there is no file {str(path)!r}")
    try:
        arrays = read(path)
    except (OSError, Unreadable) as error:
        raise CheckpointError(f"{str(path)!r} cannot be read, it is not a checkpoint or damaged: "
                              f"{error}") from None
    if str(arrays.get("format")) != FORMAT:
        raise CheckpointError(f"{str(path)!r} is not a checkpoint of a motion, or not of this "
                              f"version, which reads {FORMAT!r}")
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
            try:
                there = _read(self.path)
            except CheckpointError as error:
                raise CheckpointError(f"{error}; it is not overwritten: choose another name"
                                      ) from None
            if not there["done"]:
                raise CheckpointError(
                    f"{str(self.path)!r} holds a run up to t = {there['now']['t']:.6g} of "
                    f"{there['task']['t_end']:.6g}: scene.resume({str(self.path)!r}) continues it; "
                    "delete the file to start again")
        try:
            self._write()
        except OSError as error:
            raise CheckpointError(f"the checkpoint {str(self.path)!r} cannot be written: {error}"
                                  ) from None

    def _write(self):
        """Write all that a Run consists of, see :func:`resume`."""
        run, now = self.run, dict(vars(self.run.y))
        groups = {"task": vars(run.task), "run": run.arrays(), "memory": now.pop("memory") or {},
                  "now": now, "history": run.columns(), "sensor": run.recorder.arrays()}
        q0, scheme = _identity(run.system, run.scheme)
        write(self.path, {
            "format": np.array(FORMAT), "every": np.array(self.every or 0), "q0": q0,
            "scheme": np.array(scheme), "done": np.array(run.done), **{
                f"{group}.{name}": x for group, arrays in groups.items()
                for name, x in arrays.items() if x is not None}})
        self._steps, self._clock = run.steps, time.monotonic()

    def update(self) -> None:
        """Write if it is due, or at the end; a failure gives a CheckpointWarning."""
        run, begun = self.run, time.monotonic()
        due = (begun - self._clock > max(SECONDS, self._took / SHARE) if self.every is None
               else run.steps - self._steps >= self.every)
        if not (due or run.done):
            return
        try:
            self._write()
        except OSError as error:
            self._steps, self._clock = run.steps, time.monotonic()
            warn(f"the checkpoint {str(self.path)!r} could not be written at t = "
                 f"{run.y.t:.6g}, the previous one remains: {error}", CheckpointWarning)
        self._took = time.monotonic() - begun


def resume(system: System, path: StrPath, scheme: str | Scheme | type[Scheme] | None = None,
           sensors: Sequence[tuple[str, Sensor]] = ()) -> tuple[Run, Checkpoint]:
    """The Run of a checkpoint file, and the Checkpoint that continues to write it."""
    found = _read(path)
    try:
        name, values = json.loads(found["scheme"])
        if scheme is None or scheme == "auto":  # the file has the scheme that "auto" chose
            if name not in SCHEMES:
                raise CheckpointError(f"the run used a custom scheme, {name!r}: pass it, "
                                      "resume(path, scheme=...)")
            made = SCHEMES[name].__new__(SCHEMES[name])
            vars(made).update(values)
        else:
            made = get_scheme(scheme)
        q0, text = _identity(system, made)
        if not np.array_equal(found["q0"], q0):
            raise CheckpointError("it is from another scene: beams, bodies or their meshes differ")
        if text != found["scheme"]:
            raise CheckpointError(f"the file is from a run with {name!r} and {values}, not with "
                                  f"{made!r}")
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
