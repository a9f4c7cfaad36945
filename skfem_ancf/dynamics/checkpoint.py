"""Checkpoints: files from which a time integration continues."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..actions.forces.system import Forces
from ..core import archive
from ..core.archive import find_h5py, write
from ..core.errors import (CheckpointError, CheckpointWarning, InputError, require_integer,
                           require_path, shown, warn)
from ..core.types import Array, StrPath
from ..equations.system import System
from ..results.state import State
from .base import Motion, Scheme, stored
from .run import Run, task_of
from .sensors import Sensor

FORMAT = "skfem-ancf checkpoint 11"
#: Number of times at which functions of time are compared.
TIMES = 33
#: Approximate number of surface points at which distances to obstacles are compared.
PLACES = 32
#: Default seconds between two checkpoints, and the fraction of time that writing may take.
SECONDS, SHARE = 60.0, 0.05


# the scene


def description(system: System, t_start: float, t_end: float) -> dict[str, Array]:
    """Characteristic arrays of a scene by part, to recognise a different scene.

    They are forces at a pseudo-random displacement and velocity, and samples of functions of time.
    """
    times, rng = np.linspace(t_start, t_end, TIMES), np.random.default_rng(0)
    u, v = 1e-3 * rng.standard_normal((2, system.N)) * np.concatenate(
        [member.sizes for member in system.members])
    with system.forces.without_samples(), system.histories.lent(span=t_end - t_start):
        force, inertia = system.internal_force(u, t_start), system.mass.multiply(u)
        damping = system.damping_force(u, v, t_start) if system.damped else np.zeros(1)
    found = {"supports": np.append(system.constraints.fixed, system.constraints.values_at(times)),
             "damping": damping}
    for k, member in enumerate(system.members):
        part, kind = system.of(member), _kind(system, member)
        name = f"{kind} {k if member.name is None else member.name}"
        found |= {f"mesh of {name}": member.q0, f"stiffness of {name}": force[part],
                  f"mass of {name}": inertia[part]}
    for k, load in enumerate(system.loads):
        found[f"load {k}"] = np.append(load.force(u[system.of(load)]), system.of(load).start)
        if load.amplitude is not None:
            found[f"amplitude of load {k}"] = np.array([load.factor(t) for t in times])
    for k, joint in enumerate(system.constraints.all_joints):
        moments = times if joint.moving else times[:1]
        found[f"joint {k}"] = np.array([joint.value(u, t) for t in moments])
    with system.forces.without_samples():
        for k, element in enumerate(system.forces.elements):
            found[f"force element {k}"] = np.concatenate(
                [np.ravel(x) for x in _of_element(system, element, u, v, times)])
    for k, obstacle in enumerate(system.forces.contacts.obstacles):
        x = np.concatenate([group.starts[:2] for group in obstacle.groups], axis=1)
        x = x[:, ::max(1, x.shape[1] // PLACES)]
        found[f"obstacle {k}"] = np.array([obstacle.shape.distance(x, t) for t in times])
        if obstacle.moves:
            found[f"motion of obstacle {k}"] = np.array([obstacle.pose(t)[:6] for t in times])
    return found


def _kind(system, member):
    return ("rigid body" if member in system.bodies else "domain" if member in system.domains
            else "beam")


def _of_element(system, element, u, v, times):
    """Characteristic arrays of a force element."""
    alone = Forces([element], system.N, system.bandwidth)
    tables = alone.tables(lambda i, j: i, False, 0)
    yield from (tables.numbers, tables.start, tables.of, tables.weight)
    yield from (alone.stiffness(tables, 0.0, u, v, c) for c in (0.0, 1.0))
    for custom in alone.custom:
        x = np.array([one.start for one in custom.links])
        moved = 1e-3 * np.linalg.norm(x, axis=-1, keepdims=True) * np.random.default_rng(
            0).standard_normal(x.shape)
        yield custom.force(x + moved, moved, times[0])
        yield from (custom.force(x, 0.0 * x, t) for t in times)
    yield from (x for mass in alone.masses for x in mass.mass_entries())
    if element.groups:
        yield from alone.contacts.tables[1:3]


def differences(now: dict[str, Array], then: dict[str, Array]) -> list[str]:
    """Names of the parts in which two results of :func:`description` differ."""
    def same(x, y):
        return y is not None and x.shape == y.shape and y.dtype.kind in "biuf" and np.allclose(
            x, y, rtol=0, atol=1e-12 * np.abs(x).max(initial=0.0), equal_nan=True)

    return [*(name for name, x in now.items() if not same(x, then.get(name))),
            *(name for name in then if name not in now)]


def same_problem(system: System, start: State, t: float) -> bool:
    """True if accelerations and multipliers of a State are valid for a system at time t."""
    other, u = start.system, start.u
    if other is system and t == start.t:
        return True
    then: Any = start.t
    if len(u) != system.N or differences(description(system, t, t), description(other, then, then)):
        return False
    pairs = [(system.external_force(u, t), other.external_force(u, then)),
             (system.constraints.constraint(u, t), other.constraints.constraint(u, then))]
    return all(np.array_equal(a, b) for a, b in pairs)


# schemes


def _scheme_text(scheme):
    """The class and parameters of a scheme as JSON."""
    return json.dumps([scheme.name or type(scheme).__name__, vars(scheme)], default=repr)


def _scheme_of(text, given):
    """The scheme of a file: one of the package, or the one that the caller passes."""
    from . import SCHEMES, get_scheme

    name, values = json.loads(text)
    if given is not None and given != "auto":  # the file has the scheme that "auto" chose
        scheme = get_scheme(given)
        if _scheme_text(scheme) != text:
            raise CheckpointError(f"the file is from a run with {name!r} and {values}, not with "
                                  f"{scheme!r}")
        return scheme
    if name not in SCHEMES:
        raise CheckpointError(f"the run used a custom scheme, {name!r}: pass it, "
                              "resume(path, scheme=...)")
    scheme = SCHEMES[name].__new__(SCHEMES[name])
    for attribute, value in values.items():
        setattr(scheme, attribute, value)
    return scheme


# files


def _checksum(arrays):
    h = hashlib.sha256()
    for name in sorted(arrays):
        x = np.ascontiguousarray(arrays[name])
        h.update(f"{name} {x.dtype.str} {x.shape} ".encode() + x.tobytes())
    return np.frombuffer(h.digest(), dtype=np.uint8)


def read(name: StrPath) -> dict[str, Array]:
    """Read the arrays of a checkpoint by name; raises CheckpointError."""
    path = _path(name)
    if not path.exists():
        raise CheckpointError(f"there is no file {str(path)!r}")
    try:
        arrays = archive.read(path)
    except (OSError, archive.Unreadable) as error:
        raise CheckpointError(f"{str(path)!r} cannot be read, it is not a checkpoint or damaged: "
                              f"{error}") from None
    written = arrays.pop("format", None)
    if written is None or written.shape or written.dtype.kind != "S":
        raise CheckpointError(
            f"{str(path)!r} is a checkpoint of an earlier version, which can resume it"
            if "text" in arrays else f"{str(path)!r} is not a checkpoint of a motion")
    if written.item().decode(errors="replace") != FORMAT:
        raise CheckpointError(f"{str(path)!r} has the format {shown(written.item().decode())}, "
                              f"this version reads {FORMAT!r}")
    checksum = arrays.pop("checksum", None)
    if checksum is None or not np.array_equal(checksum, _checksum(arrays)):
        raise CheckpointError(f"{str(path)!r} is damaged: its checksum does not match its content")
    return arrays


def _path(path):
    path = require_path("checkpoint", path)
    if path.suffix not in (".npz", ".h5"):
        raise InputError(f"a checkpoint ends in .npz or .h5, got {shown(str(path))}")
    if path.suffix == ".h5":
        find_h5py()
    return path


def _under(arrays, folder):
    """The arrays whose names begin with a prefix, without it."""
    return {name[len(folder):]: x for name, x in arrays.items() if name.startswith(folder)}


def _named(folder, arrays):
    return {f"{folder}{name}": np.asarray(x) for name, x in arrays.items() if x is not None}


class Checkpoint:
    """Writes a Run to a file at intervals."""

    def __init__(self, path: StrPath, every: int | None, run: Run) -> None:
        self.path, self.run = _path(path), run
        run.longest = self.every = None if every is None else require_integer("every", every, 1)
        self._steps, self._clock, self._took = run.steps, time.monotonic(), 0.0
        task, scheme = run.task, run.scheme
        self._fixed = {
            **_named("task.", vars(task)), **_named("scene.", description(
                run.system, task.t_start, task.t_end)),
            "every": np.array(self.every or 0), "scheme": np.bytes_(_scheme_text(scheme).encode())}

    def begin(self) -> None:
        """Write the start, so that problems show before the run."""
        if self.path.exists():
            self._spare()
        if not self.path.parent.is_dir():
            raise CheckpointError(f"the folder {str(self.path.parent)!r} of the checkpoint does "
                                  "not exist")
        try:
            self._write()
        except OSError as error:
            raise CheckpointError(f"the checkpoint {str(self.path)!r} cannot be written: "
                                  f"{error}") from None

    def _spare(self):
        """Raise CheckpointError if the existing file must not be overwritten."""
        try:
            arrays = read(self.path)
        except CheckpointError as error:
            raise CheckpointError(f"{error}; it is not overwritten: choose another name") from None
        if not arrays["done"]:
            raise CheckpointError(
                f"{str(self.path)!r} holds a run up to t = {arrays['now.t']:.6g} of "
                f"{arrays['task.t_end']:.6g}: scene.resume({str(self.path)!r}) continues it; "
                "delete the file to start again")

    def _write(self):
        run, now = self.run, dict(vars(self.run.y))
        memory = now.pop("memory")
        arrays = {**self._fixed, **_named("run.", run.arrays()), **_named("now.", now),
                  **_named("history.", run.columns()), **_named("memory.", memory or {}),
                  **_named("sensor.", run.recorder.arrays()), "done": np.array(run.done)}
        write(self.path, {**arrays, "format": np.bytes_(FORMAT.encode()),
                          "checksum": _checksum(arrays)})
        self._steps, self._clock = run.steps, time.monotonic()

    def update(self) -> None:
        """Write if it is due, or at the end; a failure gives a CheckpointWarning."""
        run, begun = self.run, time.monotonic()
        if self.every is not None:
            due = run.steps - self._steps >= self.every
        else:
            due = begun - self._clock > max(SECONDS, self._took / SHARE)
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
    arrays = read(path)
    try:
        said = {"dt": "auto", "tol": None, "t_eval": None, **_under(arrays, "task.")}
        task = task_of(**{name: x.item() if getattr(x, "shape", None) == () else x
                          for name, x in said.items()})
        other = differences(description(system, task.t_start, task.t_end),
                            _under(arrays, "scene."))
        if other:
            raise CheckpointError("it is from another scene, which differs in: " + ", ".join(other))
        made = _scheme_of(arrays["scheme"].item().decode(), scheme)
        run = Run(system, made, task, sensors)
        run.recorder.load(_under(arrays, "sensor."))
        columns, now = _under(arrays, "history."), _under(arrays, "now.")
        numbers = {name: float(now[name]) for name in ("t", "before", "dissipated")}
        y = Motion(**{**now, **numbers}, memory=_under(arrays, "memory.") or None)
        for name in ("u", "v", "acceleration", "algorithmic"):
            stored(now, name, np.zeros(system.N))
        run.load(y, _under(arrays, "run."), columns)
    except (InputError, CheckpointError, KeyError, ValueError, TypeError) as error:
        text = str(error) if isinstance(error, CheckpointError) else repr(error)
        raise CheckpointError(f"{str(path)!r} cannot be resumed: {text}") from None
    every = int(arrays["every"])
    return run, Checkpoint(path, every or None, run)
