"""Sensors: quantities that are recorded at every step."""

import csv
from collections.abc import Callable, Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from ..actions.joints.base import Joint
from ..beam import Located, WhichBeam
from ..core import (Array, CallbackError, CheckpointError, Immutable, NameUnknown, StrPath,
                    ask_array, output_file, refuse, require_flag, require_module, require_option,
                    require_path, shown)
from ..equations.system import System
from ..recovery.fields import FIELDS, find_field
from ..results.state import State
from .base import Motion, Scheme

#: Quantities that are evaluated for many steps at once.
MOVING = ("position", "displacement", "velocity", "acceleration")
#: Quantities of a section.
SECTION = ("N", "Q", "M", "force", "curvature", "shear", "angle")
#: Quantities of contact.
CONTACT = ("contact", "contact_pressure")


class Sensor(Immutable):
    """A quantity that is recorded at every step.

    Parameters
    ----------
    what
        "position", "displacement", "velocity" or "acceleration" of points; "strain", "stress" or
        another name of :data:`skfem_ancf.recovery.fields.FIELDS` at points; "N", "Q", "M", "force",
        "curvature", "shear" or "angle" of sections; "joint_force"; "contact", the sum of contact
        forces, or "contact_pressure", the largest, both as means of each step, so that force times
        step is the impulse (with generalised-alpha values at its end); or a function of the State
        that returns a number or an array.
    at
        Points, as for :meth:`State.displacement <skfem_ancf.results.State.displacement>`; the joint
        for "joint_force"; the obstacle or contact, its item or number, None for all; None for a
        function.
    beam
        The beam, its name or number; searched for by default. Of contact the member on whose
        surface it is, of contact of members one of both.
    recover
        Use recovered fields and section forces, about a millisecond per step and beam; by default
        those of the elements.
    line
        The number of the line, for a frame; searched for by default.
    """

    def __init__(self, what: str | Callable[[State], Any], at: Any = None, beam: WhichBeam = None,
                 recover: bool = False, line: int | None = None) -> None:
        self.recover = require_flag("recover", recover)
        self.what, self.at, self.beam, self.line = what, at, beam, line
        if callable(what) and not isinstance(what, type):
            refuse(at is not None, "a sensor that is a function of the State takes no points: "
                   "leave out at=, got {!r}", at)
            return
        known = (*MOVING, *SECTION, *CONTACT, "joint_force", *FIELDS)
        require_option("quantity of a sensor", what, known)
        if what == "joint_force":
            refuse(not isinstance(at, Joint), 'a sensor of "joint_force" needs at=joint, one of '
                   'scene.joints, got {!r}', at)
        refuse(at is None and what not in CONTACT, "a sensor of {!r} needs points of the body: "
               "give at=", what)

    @property
    def moving(self) -> bool:
        """True if it is evaluated for many steps at once."""
        return self.what in MOVING

    def __repr__(self) -> str:
        where = "" if self.at is None else f" at {shown(self.at)}"
        return f"<Sensor of {shown(self.what)}{where}>"


def locate(sensor: Sensor, system: System) -> Located | None:
    """The material points of a sensor in a scene, or None."""
    if callable(sensor.what) or sensor.what in ("joint_force", *CONTACT):
        return None
    found = system.points.find(sensor.at, sensor.beam, sensor.line, sensor.what not in MOVING)
    refuse(sensor.what in SECTION and len(found.parts) != 1, "the points of a sensor of sections "
           "must be in one beam: use one sensor for each beam")
    refuse(sensor.what == "acceleration" and any(part.off_axis for part in found.parts),
           "the acceleration of a cable is known on its axis only: put the sensor on the axis")
    return found


def read_steps(sensor: Sensor, at: Any, steps: Sequence[Any]) -> Array:
    """Values of a sensor of :data:`MOVING` at steps or States, shape (n, ...)."""
    u = np.array([y.acceleration if sensor.what == "acceleration" else y.u for y in steps])
    if sensor.what == "velocity":
        return at.velocity(u, np.array([y.v for y in steps]))
    return at.displacement(u) + (at.start if sensor.what == "position" else 0.0)


def read(sensor: Sensor, at: Any, state: State) -> Any:
    """The value of a sensor at one State."""
    what: Any = sensor.what
    if callable(what):
        return ask_array("the function of a sensor", None, what, state)
    if what == "joint_force":
        return state.joint_force(sensor.at)
    if what in CONTACT:
        found = state.contact(sensor.at, sensor.beam)
        return found.total if what == "contact" else np.max(found.pressure, initial=0.0)
    if what == "acceleration":
        return at.displacement(state.acceleration)
    if what in MOVING:
        return getattr(state, what)(at)
    if what in ("strain", "stress"):
        return getattr(state, what)(at, recover=sensor.recover)
    if what in SECTION:
        return getattr(state.resultants(at, recover=sensor.recover), what)
    return state.field(find_field(what), at, recover=sensor.recover)


class Readings(dict[str, "Array"]):
    """Readings of sensors: a mapping from names to arrays (nt, ...).

    Parameters
    ----------
    t
        Times of the readings, the start and the end of every step, shape (nt,).
    values
        Arrays by name.
    """

    def __init__(self, t: Array, values: dict[str, Array]) -> None:
        super().__init__(values)
        self.t = t

    def __missing__(self, name: str) -> Array:
        raise NameUnknown("sensor", name, self)

    def to_csv(self, filename: StrPath) -> FilePath:
        """Write the readings to a .csv file, in a folder that is made if needed; returns its path.
        The columns are ``t`` and the sensors; those of a vector are called ``tip 0``, ``tip 1``."""
        path, names, columns = require_path("filename", filename, (".csv",)), ["t"], [self.t]
        for name, x in self.items():
            columns.append(x.reshape(len(self.t), -1))
            names += [name] if x.ndim == 1 else [f"{name} {k}" for k in range(columns[-1].shape[1])]
        with output_file(path) as new, open(new, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            writer.writerows(np.column_stack(columns).tolist())
        return path

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset`` with a variable for each sensor, along "time"."""
        return require_module("xarray", "arrays").Dataset(
            {name: (("time", *(f"{name}_{k}" for k in range(1, x.ndim))), x)
             for name, x in self.items()}, {"time": self.t})

    def __repr__(self) -> str:
        return f"<Readings of {list(self)} at {len(self.t)} times>"


class Recorder:
    """Evaluates the sensors during a run."""

    def __init__(self, sensors: Sequence[tuple[str, Sensor]], system: System, scheme: Scheme,
                 state_of: Callable[[Motion], State]) -> None:
        self.sensors, self._scheme, self._state_of = list(sensors), scheme, state_of
        self._located: list[Any] = [locate(sensor, system) for _, sensor in self.sensors]
        self._t: list[Array] = []
        self._read: list[list[Array]] = [[] for _ in self.sensors]

    def record(self, steps: Sequence[Motion]) -> None:
        """Evaluate all sensors at the ends of steps."""
        if not self.sensors:
            return
        others = [(sensor, at) for (_, sensor), at in zip(self.sensors, self._located)
                  if not sensor.moving]
        rows = [[self._read_step(sensor, at, y, state) for sensor, at in others]
                for y, state in zip(steps, map(self._state_of, steps))] if others else []
        columns = iter(zip(*rows))  # a State reads all sensors, then it is freed
        found = [read_steps(sensor, at, steps) if sensor.moving else next(columns)
                 for (_, sensor), at in zip(self.sensors, self._located)]
        self._t.append(np.array([y.t for y in steps]))
        for (name, _), before, values in zip(self.sensors, self._read, found):
            shapes = [np.shape(one) for one in ([before[0][0]] if before else []) + [*values]]
            for shape in shapes:
                refuse(shape != shapes[0], "the sensor {!r} must return the same shape at all "
                       "times, got {}, then {}", name, shapes[0], shape, error=CallbackError)
            before.append(np.array(values))

    def _read_step(self, sensor, at, y, state):
        """The value of a sensor at the end of a step, of contact the mean over the step."""
        instants = [one for part in y.parts or [y] for one in self._scheme.force_instants(part)
                    ] if sensor.what in CONTACT else ()
        if len(instants) < 2:
            return read(sensor, at, state)
        return sum(time * read(sensor, at, self._state_of(one)) for time, one in instants) / sum(
            time for time, _ in instants)

    def readings(self) -> Readings:
        return Readings(np.concatenate([np.zeros(0), *self._t]), {
            name: np.concatenate(read) if read else np.zeros(0)
            for (name, _), read in zip(self.sensors, self._read)})

    # checkpoints

    def arrays(self) -> dict[str, Array]:
        """The readings as arrays by name, for a checkpoint."""
        found = self.readings()
        return {"t": found.t, **{str(k): values for k, values in enumerate(found.values())}}

    def load(self, arrays: dict[str, Array]) -> None:
        """Restore what :meth:`arrays` returned; raises CheckpointError for other sensors."""
        names = [name for name, _ in self.sensors]
        refuse(len(arrays) != len(names) + 1, "the run had {} sensors, the scene has {}: {}",
               len(arrays) - 1, len(names), names, error=CheckpointError)
        self._t, self._read = [arrays["t"]], [[arrays[str(k)]] for k in range(len(self.sensors))]
