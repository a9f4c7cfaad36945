"""Sweeps over parameters, serial or parallel."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import (CallError, CallbackError, CheckpointWarning, FileError, InputError,
                           Interrupted, NameUnknown, SweepWarning, require_function,
                           require_integer, require_path, shown, warn)
from ..core.progress import progress_bar
from ..core.types import Array, ArrayLike, StrPath
from .members import Sweep, column_of, require_plain
from .probes import Probes, measured
from .workers import Task, here, in_processes, in_threads, on_cluster

#: Least seconds between two files, and least ratio to the time of writing one.
_SECONDS, _RARER = 2.0, 20.0


def sweep(build: Callable[..., Any],
          parameters: Mapping[str, ArrayLike] | Sequence[Mapping[str, Any]],
          measure: Callable[[Any], Any] | tuple[Any, ...] | dict[str, Any],
          workers: int | None = None, client: Any = None,
          path: StrPath | None = None, progress: bool | None = None) -> Sweep:
    """Build, solve and measure a scene for each of many sets of parameters.

    Each member is ``measure(build(**parameters))``: ``build`` makes the scene, ``measure`` solves
    it and returns numbers. Results depend neither on where members are computed nor on their order.
    A member that fails is nan and listed in ``failures``.

    Parameters
    ----------
    build
        Function of the parameters, by keyword, that returns a :class:`Scene`, or another argument
        of ``measure``.
    parameters
        By name, arrays of shape (n, ...), one row for each member; a pandas table; or a list of n
        dicts.
    measure
        Function of the scene that returns a number, an array of numbers, or a dict of them by name,
        with equal names and shapes for all members. Or quantities of ``scene.solve_static()``: a
        pair (what, at) or a triple (what, at, beam) of "displacement" or "position", a point (x,
        y), points (2, n) or the name of an end, and a beam; or a dict of such and of functions of
        the State. These are computed in this process, with one thread for each processor, and built
        one after the other.
    workers
        Number of processes; None for this one only. ``build`` and ``measure`` must be importable:
        defined by ``def`` at the top of a module. Scripts call sweep under
        ``if __name__ == "__main__":``. Linear algebra uses one thread in each process.
    client
        A ``dask.distributed.Client``, instead of ``workers``.
    path
        A file (.npz) for results so far. If it exists, the sweep continues: finished members are
        read from it, failed ones are computed again. The parameters must be those of the file; the
        functions are not compared.
    progress
        Show a progress bar: True, False, or None: on a terminal, after a second, if tqdm is
        installed.

    Raises
    ------
    InputError
        If arguments do not fit.
    NameUnknown, CallError
        If ``build`` takes other parameters.
    FileError
        If the file is of another sweep, or cannot be written.
    PickleError
        If functions cannot be sent to other processes.
    CallbackError
        If all members fail.
    Interrupted
        By Ctrl-C; its ``state`` is the Sweep so far, which is also in the file.

    Examples
    --------
    A cantilever is bent by a force: four moduli.

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff, sweep
    >>> mesh = MeshBeam.init_line(np.linspace(0, 1, 3), height=0.01)
    >>> def build(E):
    ...     beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(E=E, nu=0.3), width=0.01)
    ...     return Scene(beam).clamp("left").point_force((0, -0.01), at=(1, 0))
    >>> def tip(scene):
    ...     return scene.solve_static().displacement((1, 0))[1]
    >>> result = sweep(build, {"E": [1e9, 2e9, 4e9, 8e9]}, tip)
    >>> EI = result["E"] * 0.01**4 / 12
    >>> bool(np.allclose(result["value"], -0.01 / (3 * EI), rtol=1e-4))
    True
    """
    require_function("build", build, "of the parameters that returns a scene")
    task = Task(build, measured(measure))
    if workers is not None and client is not None:
        raise InputError("workers and client exclude each other: give one of them")
    if workers is not None:
        workers = require_integer("workers", workers, 1)
    values = _columns(parameters)
    members = [dict(zip(values, row)) for row in zip(*values.values())]
    if not members:
        raise InputError(f"there are no members in the parameters {shown(parameters)}")
    _require_signature(build, members[0])
    record = _Record({name: column_of(column) for name, column in values.items()},
                     None if path is None else require_path("path", path, (".npz",)))
    places = record.places
    if client is not None:
        source = on_cluster(task, members, places, client)
    elif workers is not None:
        source = in_processes(task, members, places, workers)
    else:
        source = (in_threads if isinstance(task.measure, Probes) else here)(task, members, places)
    try:
        with progress_bar(progress, len(members), "members") as bar, closing(source):
            bar.update(len(members) - len(places))
            for k, found in source:
                record.add(k, found)
                bar.update(1)
    except KeyboardInterrupt:
        raise Interrupted(record.stopped(), record.written()) from None
    except BaseException:
        record.written()
        raise
    return _warned(record.written())


class _Record:
    """Results so far, written to the file at intervals."""

    def __init__(self, columns: dict[str, Array], path: Path | None) -> None:
        self.columns, self.path = columns, path
        self.found: list[dict[str, Array] | str | None] = [None] * len(next(iter(columns.values())))
        self.next = time.monotonic() + _SECONDS
        if path is not None:
            require_plain(columns)
            if path.exists():
                self.found = _done(path, columns)
        self.places = [k for k, one in enumerate(self.found) if one is None]
        if path is not None and self.places:
            Sweep(columns, self.found).save(path)  # fails early

    def add(self, k, found):
        """Add the result of a member; write the file if it is due."""
        self.found[k] = found
        if self.path is not None and time.monotonic() >= self.next:
            begun = time.monotonic()
            self.written()
            now = time.monotonic()
            self.next = now + max(_SECONDS, _RARER * (now - begun))

    def written(self):
        """The Sweep so far; write it, with a warning where that fails."""
        result = Sweep(self.columns, self.found)
        if self.path is not None:
            try:
                result.save(self.path)
            except FileError as error:
                warn(f"the results are not in the file, the sweep goes on: {error}",
                     CheckpointWarning)
        return result

    def stopped(self):
        """The Interrupted error."""
        done = sum(isinstance(one, dict) for one in self.found)
        return (f"interrupted with {done} of {len(self.found)} members done; " + (
            "they are in the state of this exception; with path= the next call would go on"
            if self.path is None else f"call again with {str(self.path)!r} to go on"))


def _columns(parameters):
    """Lists of values by name, of equal lengths."""
    if isinstance(parameters, Mapping) or hasattr(parameters, "columns"):  # of pandas
        columns = {name: _rows(name, values) for name, values in parameters.items()}
        lengths = {name: len(rows) for name, rows in columns.items()}
        if len(set(lengths.values())) > 1:
            raise InputError(f"the parameters must have equal lengths, got {lengths}; for all "
                             "combinations hand a list of dicts, made by itertools.product")
        return columns
    if isinstance(parameters, str) or not hasattr(parameters, "__iter__"):
        raise InputError("parameters must be a dict of arrays or a list of dicts, got "
                         f"{shown(parameters)}")
    members = list(parameters)
    for k, member in enumerate(members):
        if not isinstance(member, Mapping) or set(member) != set(members[0]):
            raise InputError("parameters must be a dict of arrays, or a list of dicts with "
                             f"equal names; the first has {shown(members[0])}, number {k} is "
                             f"{shown(member)}")
    return {name: [member[name] for member in members] for name in (members[0] if members else ())}


def _rows(name, values):
    values = getattr(values, "values", values)  # of pandas and xarray
    if isinstance(values, str) or np.ndim(values) == 0 and not hasattr(values, "__len__"):
        raise InputError(f"the parameter {name!r} must have one value for each member, got "
                         f"{shown(values)}; what is the same for all belongs into build")
    return list(values)


def _require_signature(build, member):
    try:
        known = inspect.signature(build).parameters
    except (TypeError, ValueError):  # of some functions written in C
        return
    if not any(p.kind is p.VAR_KEYWORD for p in known.values()):
        for name in member:
            if name not in known:
                raise NameUnknown("parameter of build", name, known)
    missing = [name for name, p in known.items() if p.default is p.empty and name not in member
               and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    if missing:
        raise CallError(f"build needs {', '.join(map(repr, missing))}, not among the parameters "
                        f"{', '.join(map(repr, member))}")


def _done(path, columns):
    """Results in the file of an interrupted sweep with the same parameters."""
    before = Sweep.load(path)
    if list(before.parameters) != list(columns):
        differ = f"{list(before.parameters)} there, {list(columns)} here"
    elif len(before) != len(next(iter(columns.values()))):
        differ = f"{len(before)} members there, {len(next(iter(columns.values())))} here"
    else:
        differ = next((f"{name!r} of member {k} is {shown(there[k])} there, {shown(now[k])} here"
                       for name, now in columns.items() for there in [before.parameters[name]]
                       for k in range(len(now)) if not _same(there[k], now[k])), "")
    if differ:
        raise FileError(f"{path} is of a sweep with other parameters: {differ}; give another path, "
                        "or delete the file")
    return [{name: x[k] for name, x in before.values.items()} if status == "done" else None
            for k, status in enumerate(before.status)]


def _same(a, b):
    floats = {np.asarray(a).dtype.kind, np.asarray(b).dtype.kind} == {"f"}
    return np.array_equal(a, b, equal_nan=floats)


def _warned(result):
    """The result, after a warning of failures."""
    failures = result.failures
    if failures:
        text = (f"{len(failures)} of {len(result)} members failed, the first with "
                f"{failures[0].parameters}: {failures[0].error}")
        if len(failures) == len(result):
            raise CallbackError(text)
        warn(f"{text}; all are in .failures", SweepWarning)
    return result
