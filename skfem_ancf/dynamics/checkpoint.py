"""Files from which a motion goes on: what they hold, how they are written and checked."""

from __future__ import annotations

import hashlib
import json
import logging
import time
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import archive
from ..core.archive import find_h5py
from ..core.archive import write as _write
from ..core.errors import (CheckpointError, CheckpointWarning, InputError, require_integer,
                           require_path, shown, warn)
from ..actions.forces.system import Forces
from .base import Motion, recalled
from .gauss import Gauss
from .generalized_alpha import HHT, GeneralizedAlpha, Newmark
from .run import MAX_STEPS, Run, Task, task_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..results.state import State
    from ..equations.system import System
    from ..core.types import Array, StrPath
    from .base import Scheme
    from .sensors import Sensor

logger = logging.getLogger(__name__)

FORMAT = 8
#: Times of a motion at which functions of time are compared.
TIMES = 33
#: Points of the surface, about, at which distances of obstacles are.
PLACES = 32
#: Seconds between two files by default, and the part of the time that writing may take.
SECONDS, SHARE = 60.0, 0.05
_MAGIC = "skfem-ancf checkpoint"


# the scene


def _digest(*items):
    h = hashlib.sha256()
    for item in items:
        if isinstance(item, np.ndarray):
            h.update(f"{item.dtype.str}{item.shape}".encode())
            h.update(np.ascontiguousarray(item).tobytes())
        else:
            h.update(repr(item).encode())
    return h.hexdigest()


def _numbers(thing):
    """The attributes of an object that are numbers, text or arrays, in a fixed order."""
    return [(k, v) for k, v in sorted(vars(thing).items())
            if not k.startswith("_")
            and isinstance(v, (bool, int, float, str, tuple, np.ndarray, type(None)))]


def fingerprint(system: System) -> dict[str, str]:
    """What a scene is, part by part, as text; functions of time are not in it.

    Returns
    -------
    dict
        From the name of a part to its hash.
    """
    parts, probe = {}, np.random.default_rng(0).standard_normal(system.N)
    for k, beam in enumerate(system.beams):
        mesh, who = beam.mesh, f"of beam {beam.name or k}"
        parts[f"mesh {who}"] = _digest(mesh.p, mesh.t, mesh.height, mesh.lengths, mesh.sections,
                                       beam.q0, *([] if mesh.heights is None else [mesh.heights]))
        parts[f"element {who}"] = _digest(type(beam.element).__name__, beam.element.order,
                                          beam.element.axis_degree, beam.nd)
        parts[f"material {who}"] = _digest(type(beam.material).__name__, *_numbers(beam.material))
        parts[f"width {who}"] = (_digest(beam.width) if beam.across.plain else _digest(
            *(x for pack in beam.kernel.packs for x in (
                pack.weights, getattr(pack, "stiffness", None), getattr(pack, "moduli", None))),
            *(x for layer in beam.across.layers for x in (
                type(layer.material).__name__, *_numbers(layer.material))),
            *(beam.masses[1::2] if all(layer.density is not None for layer in beam.across.layers)
              else ())))
        parts[f"damping {who}"] = _digest(beam.damping)
        parts[f"formulation {who}"] = _digest(beam.formulation.name, *_numbers(beam.formulation))
    for k, body in enumerate(system.bodies):
        parts[f"rigid body {body.name or k}"] = _digest(body.mass, body.inertia, body.q0)
    held = system.constraints
    parts["supports"] = _digest(held.fixed, held.values(1.0, 0.0)[:0], held.given)
    damping = system.damping
    parts["damping"] = _digest(damping.mass, damping.stiffness, damping.modal)
    for k, load in enumerate(system.loads):
        size = load.beam.size if load.beam in system.bodies else load.beam.mesh.height
        u = 1e-3 * size * probe[system.of(load)]
        parts[f"load {k}"] = _digest(type(load).__name__, system.members.index(load.beam),
                                     load.amplitude is None, load.force(0.0 * u), load.force(u))
    for k, joint in enumerate(system.constraints.all_joints):
        J = [] if joint.moving else [a for u in (0.0 * probe, probe)
                                     for a in joint.entries(u, 0.0)]
        J += [] if joint.moving else [joint.value(0.0 * probe, 0.0)]
        parts[f"joint {k}"] = _digest(type(joint).__name__, joint.equations, joint.moving, *J)
    for k, element in enumerate(system.forces.elements):
        alone = Forces([element.unheld()], system.N, system.bandwidth)
        tables = alone.tables(lambda i, j: i, False, 0)
        values = [alone.stiffness(tables, 0.0, 1e-3 * probe, probe, c) for c in (0.0, 1.0)]
        for place in alone.own:
            x, v = _moved(place)
            values += [np.array(place.force(x - v, 0.0 * v, 0.0)), np.array(place.force(x, v, 0.0))]
        for mass in alone.masses:
            values += mass.mass_entries()
        values += alone.contacts.tables[1:3] if element.groups else []
        parts[f"force element {k}"] = _digest(type(element).__name__, tables.numbers, tables.start,
                                              tables.of, tables.weight, *values)
    return parts


def _moved(element):
    """Points of a force element a little beside their start, and how far: (n, 2) twice."""
    x = np.array([one.start for one in element.links])
    v = 1e-3 * np.linalg.norm(x, axis=-1, keepdims=True) * np.random.default_rng(0).standard_normal(
        x.shape)
    return x + v, v


def functions(system: System, t_start: float, t_end: float) -> dict[str, Array]:
    """Functions of time of a scene at a few times, by name: dict of arrays (n, k).

    A function has no hash; these values tell most that differ.

    Parameters
    ----------
    system
        The :class:`~skfem_ancf.equations.system.System`.
    t_start, t_end
        Times of start and end of the motion.
    """
    times, found = np.linspace(t_start, t_end, TIMES), {}
    for k, load in enumerate(system.loads):
        if load.amplitude is not None:
            found[f"amplitude of load {k}"] = np.array([[load.factor(t)] for t in times])
    for k, joint in enumerate(system.constraints.all_joints):
        if joint.moving:
            found[f"motion of joint {k}"] = np.asarray(joint.offset(times, system.N), dtype=float)
    for k, one in enumerate(system.forces.contacts.obstacles):
        if one.moves:
            found[f"motion of obstacle {k}"] = np.array([one.pose(t)[:6] for t in times])
        x = np.concatenate([group.starts[:2] for group in one.groups], axis=1)
        x = x[:, ::max(1, x.shape[1] // PLACES)]
        found[f"shape of obstacle {k}"] = np.array([one.shape.distance(x, t) for t in times])
    for k, element in enumerate(system.forces.elements):
        if element in system.forces.own:
            x = np.array([one.start for one in element.links])
            found[f"force of element {k}"] = np.array([
                np.ravel(element.unheld().force(x, 0.0 * x, t)) for t in times], dtype=float)
    return found


def same_problem(system: System, start: State, t: float) -> bool:
    """True if a State's accelerations and multipliers are those of the system at a time.

    Parameters
    ----------
    system
        The :class:`~skfem_ancf.equations.system.System`.
    start
        An instant of a motion.
    t
        The time.
    """
    other, u = start.system, start.u
    if other is system and t == start.t:
        return True
    if len(u) != system.N or fingerprint(other) != fingerprint(system):
        return False
    now, then = np.array([t]), np.array([start.t])
    pairs = [(system.external_force(u, t), other.external_force(u, start.t)),
             (system.constraints.values_at(now), other.constraints.values_at(then)),
             (system.constraints.constraint(u, t), other.constraints.constraint(u, start.t))]
    if system.forces.own:  # which may depend on time
        pairs.append((system.internal_force(u, t), other.internal_force(u, start.t)))
    return all(np.array_equal(a, b) for a, b in pairs)


# schemes as text


def _scheme_text(scheme):
    from . import SCHEMES

    values = vars(scheme)
    known = type(scheme) in SCHEMES.values() and all(
        isinstance(v, (int, float)) for v in values.values())
    return {"name": scheme.name or type(scheme).__name__, "values": values if known else None}


def _scheme_of(text, given):
    from . import SCHEMES, get_scheme

    if given is not None and given != "auto":  # what that was is in the file
        scheme = get_scheme(given)
        if _scheme_text(scheme) != text:
            raise CheckpointError(f"the file is of a run by {text}, not by {scheme!r}")
        return scheme
    if text["values"] is None or text["name"] not in SCHEMES:
        raise CheckpointError(f"the run was made by a scheme of your own, {text['name']!r}: give "
                              "it, resume(path, scheme=...)")
    try:
        scheme = _MADE.get(text["name"], lambda values: SCHEMES[text["name"]]())(text["values"])
        known = vars(scheme)
        same = known.keys() == text["values"].keys() and all(
            abs(known[name] - value) <= 1e-12 for name, value in text["values"].items())
    except (KeyError, InputError):
        same = False
    if not same:
        raise CheckpointError(f"there is no scheme {text}")
    known.update({name: type(known[name])(value) for name, value in text["values"].items()})
    return scheme


#: How a scheme with parameters is made of its numbers.
_MADE: dict[str, Callable[[dict[str, Any]], Scheme]] = {
    "generalized-alpha": lambda values: GeneralizedAlpha(
        min(1.0, values["alpha_f"] / (1.0 - values["alpha_f"]))),
    "hht": lambda values: HHT(values["alpha_f"]),
    "newmark": lambda values: Newmark(values["beta"], values["gamma"]),
    "gauss": lambda values: Gauss(values["number"]),
}


# files


def _checksum(arrays):
    return np.frombuffer(bytes.fromhex(_digest(*(
        part for name in sorted(arrays) for part in (name, arrays[name])))), dtype=np.uint8)


def read(path: StrPath) -> tuple[dict[str, Array], dict[str, Any]]:
    """The arrays of a checkpoint by name, and its text; raises CheckpointError."""
    path = require_path("checkpoint", _path(path))
    if not path.exists():
        raise CheckpointError(f"there is no file {str(path)!r}")
    try:
        arrays = archive.read(path)
    except (OSError, archive.Unreadable) as error:
        raise CheckpointError(f"{str(path)!r} cannot be read, it is no checkpoint or damaged: "
                              f"{error}") from None
    checksum = arrays.pop("checksum", None)
    try:
        text = json.loads(bytes(arrays.pop("text")).decode(), parse_constant=float)
        is_one = isinstance(text, dict) and text.get("what") == _MAGIC
    except (KeyError, ValueError, TypeError, RecursionError):
        is_one = False
    if not is_one:
        raise CheckpointError(f"{str(path)!r} is no checkpoint of a motion")
    if text.get("format") != FORMAT:
        raise CheckpointError(f"{str(path)!r} has the format {shown(text.get('format'))}, this "
                              f"version reads {FORMAT}")
    found = _checksum({**arrays, "text": _bytes(text)})
    if checksum is None or not np.array_equal(checksum, found):
        raise CheckpointError(f"{str(path)!r} is damaged: its checksum is not that of its content")
    wrong = _wrong(text)
    if wrong:
        raise CheckpointError(f"{str(path)!r} does not say what a run needs: {wrong}")
    return arrays, text


def _is_number(x):
    return type(x) in (int, float) and abs(x) < np.inf


def _wrong(text):
    """What of the text of a file is of another kind than it is written, or empty."""
    task, scheme = text.get("task"), text.get("scheme")
    if not isinstance(task, dict) or not isinstance(scheme, dict):
        return "task, scheme"
    scene, values, every = text.get("scene"), scheme.get("values"), text.get("every")
    right = {
        "every": every is None or type(every) is int and 1 <= every <= MAX_STEPS,
        "scheme": (scheme.keys() == {"name", "values"} and type(scheme["name"]) is str
                   and (values is None or isinstance(values, dict)
                        and all(map(_is_number, values.values())))),
        "scene": isinstance(scene, dict) and all(type(x) is str for x in scene.values()),
        "task": (task.keys() == _TASK and isinstance(task["breakpoints"], list)
                 and all(map(_is_number, task["breakpoints"]))
                 and all(_is_number(task[name]) for name in ("t_start", "t_end", "rtol"))
                 and all(task[name] is None or _is_number(task[name]) for name in ("dt", "tol"))),
        "t": _is_number(text.get("t")), "done": type(text.get("done")) is bool}
    return ", ".join(name for name, there in right.items() if not there)


#: What of a Task is in the text.
_TASK = {field.name for field in fields(Task)} - {"t_eval"}


def _bytes(text):
    return np.frombuffer(json.dumps(text, sort_keys=True).encode(), dtype=np.uint8)


def _path(path):
    path = require_path("checkpoint", path)
    if path.suffix not in (".npz", ".h5"):
        raise InputError(f"a checkpoint ends in .npz or .h5, got {shown(str(path))}")
    if path.suffix == ".h5":
        find_h5py()
    return path


class Checkpoint:
    """Writes a Run to a file now and then.

    Parameters
    ----------
    path
        Name of the file, ``.npz`` or ``.h5``.
    every
        Steps between two files, or None: by time.
    run
        The Run.
    """

    def __init__(self, path: StrPath, every: int | None, run: Run) -> None:
        self.path, self.run = _path(path), run
        self.every: int | None = None if every is None else require_integer("every", every, 1)
        run.longest = self.every
        self._steps, self._clock, self._took = run.steps, time.monotonic(), 0.0
        task, system = run.task, run.system
        self._functions = functions(system, task.t_start, task.t_end)
        self._text = {
            "what": _MAGIC, "format": FORMAT, "every": self.every,
            "scheme": _scheme_text(run.scheme), "scene": fingerprint(system),
            "functions": sorted(self._functions),
            "task": {k: v for k, v in vars(task).items() if k != "t_eval"}}

    def begin(self) -> None:
        """Write the start, so that what is wrong is said before the run."""
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
        """Raise CheckpointError if the file that is there is worth keeping."""
        try:
            _, text = read(self.path)
        except CheckpointError as error:
            raise CheckpointError(f"{error}; it is not overwritten: choose another name") from None
        if not text["done"]:
            raise CheckpointError(
                f"{str(self.path)!r} holds a run up to t = {text['t']:.6g} of "
                f"{text['task']['t_end']:.6g}: scene.resume({str(self.path)!r}) goes on with it; "
                "delete the file to begin again")

    def _write(self):
        run, y = self.run, self.run.y
        arrays = {f"run.{k}": np.asarray(v) for k, v in run.remember().items()}
        arrays.update({f"history.{k}": v for k, v in run.history.columns().items()})
        for name in run.history.COLUMNS:
            arrays[f"now.{name}"] = np.asarray(getattr(y, name), dtype=float)
        for k, memory in enumerate([y.memory, *run.history.memories]):
            arrays.update({f"memory.{k}.{name}": np.asarray(v)
                           for name, v in (memory or {}).items()})
        for name, values in self._functions.items():
            arrays[f"function.{name}"] = values
        if run.recorder.sensors:
            arrays.update({f"sensor.{k}": v for k, v in run.recorder.remember().items()})
        if run.task.t_eval is not None:
            arrays["t_eval"] = run.task.t_eval
        arrays["text"] = _bytes({**self._text, "t": float(y.t), "done": bool(run.done)})
        _write(self.path, {**arrays, "checksum": _checksum(arrays)})
        self._steps, self._clock = run.steps, time.monotonic()

    def update(self) -> None:
        """Write if it is time to, or the end; warns with CheckpointWarning where it fails."""
        run = self.run
        waited = time.monotonic() - self._clock
        if self.every is not None:
            due = run.steps - self._steps >= self.every
        else:
            due = waited > max(SECONDS, self._took / SHARE)
        if not (due or run.done):
            return
        before = time.monotonic()
        try:
            self._write()
        except OSError as error:
            self._steps, self._clock = run.steps, time.monotonic()
            warn(f"the checkpoint {str(self.path)!r} could not be written at t = "
                          f"{run.y.t:.6g}, the last good one stays: {error}", CheckpointWarning)
        self._took = time.monotonic() - before


# going on


def _compare(system, text, arrays, path):
    """Raise CheckpointError if the scene is another than that of the file."""
    now, then = fingerprint(system), text["scene"]
    other = [part for part in sorted(set(now) | set(then)) if now.get(part) != then.get(part)]
    if not other:
        task = text["task"]
        for name, values in functions(system, task["t_start"], task["t_end"]).items():
            known = arrays.get(f"function.{name}")
            size = np.abs(values).max(initial=0.0)
            if known is None or known.shape != values.shape or known.dtype.kind not in "biuf" or (
                    not np.allclose(
                        values, known, rtol=0, atol=1e-12 * size, equal_nan=True)):
                other.append(name)
    if other:
        raise CheckpointError(f"{str(path)!r} is of another scene, it differs in: "
                              + ", ".join(other))


def resume(system: System, path: StrPath, scheme: str | Scheme | type[Scheme] | None = None,
           sensors: Sequence[tuple[str, Sensor]] = ()) -> tuple[Run, Checkpoint]:
    """The Run of a checkpoint, and the Checkpoint that goes on writing it.

    Parameters
    ----------
    system
        The :class:`~skfem_ancf.equations.system.System`.
    path
        Name of the file.
    scheme
        The scheme, if it is one of the caller's own.
    sensors
        Those of the scene, pairs of name and :class:`~skfem_ancf.dynamics.sensors.Sensor`.

    Raises
    ------
    CheckpointError
        If the file cannot be read, is damaged, or of another scene.
    """
    arrays, text = read(path)
    try:
        said = text["task"]
        task = task_of(**{**said, "dt": "auto" if said["dt"] is None else said["dt"]},
                       t_eval=arrays.get("t_eval"))
    except InputError as error:
        raise CheckpointError(f"{str(path)!r} does not hold what a run needs: {error}") from None
    _compare(system, text, arrays, path)
    made = _scheme_of(text["scheme"], scheme)
    try:
        run = Run(system, made, task, sensors)
        run.recorder.recall({k[7:]: v for k, v in arrays.items() if k.startswith("sensor.")}
                            if sensors or "sensor.t" in arrays else {"t": np.zeros(0)})
        _restore(run, arrays, text)
    except (InputError, KeyError, ValueError, TypeError, IndexError) as error:
        raise CheckpointError(f"{str(path)!r} does not hold what a run needs: "
                              f"{type(error).__name__}: {error}") from None
    except CheckpointError as error:
        raise CheckpointError(f"{str(path)!r} does not hold what a run needs: {error}") from None
    return run, Checkpoint(path, text["every"], run)


def _restore(run, arrays, text):
    columns = {}
    n = len(np.atleast_1d(arrays.get("history.t", ())))
    for name, x in run.history.columns().items():
        columns[name] = recalled(arrays, f"history.{name}", (n, *x.shape[1:]))
        recalled(arrays, f"now.{name}", x.shape[1:])
    memories = [{} for _ in range(n + 1)]
    for name, value in arrays.items():
        if name.startswith("memory."):
            _, k, key = name.split(".", 2)
            memories[range(n + 1)[int(k)]][key] = value
    contacts = run.system.forces.contacts
    for memory in memories:
        if "contacts" in memory:
            recalled(memory, "contacts", (contacts.tables.memory.size,))
    now, *stored = [memory or None for memory in memories]
    run.history.restore(columns, stored)
    t, *rest, before, dissipated, turns = (arrays[f"now.{name}"] for name in run.history.COLUMNS)
    times = columns["t"]
    if (np.diff(times) <= 0.0).any() or n and not run.task.t_start <= times[0] <= times[-1] <= t:
        raise CheckpointError("the times of its instants do not increase up to its own")
    if float(t) != text["t"]:
        raise CheckpointError(f"its times are {float(t)} and {text['t']}")
    run.recall(Motion(float(t), *rest, float(before), now, float(dissipated), turns),
               {k[4:]: v for k, v in arrays.items() if k.startswith("run.")})
    run.recorder.require_alike(run.y)
