"""Forces and moments as functions of time and measurements: controllers, motors."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...beam import Layout, RigidBody, WhichBeam
from ...beam.kernels.moments import mean_turning
from ...core import (Array, InputError, ask_array, ask_number, refuse, require_function,
                     require_option, require_positive, shown)
from ...mesh.places import is_point
from ..places import GROUND, Vector, is_ground, named_place, point, section
from ..symbols import Symbol
from ..bound import differences
from .base import ForceElement
from .kernels import turned

#: Round-off relative to the sampling time.
ROUND_OFF = 1e-9


class MeasuredPoint(NamedTuple):
    """Measurements at a point: ``position`` and ``velocity``, shape (2,) each."""

    position: Array
    velocity: Array


class MeasuredSection(NamedTuple):
    """Rotation of a section and its rate. ``angle`` is measured from the reference configuration in
    radians, in (-pi, pi], counterclockwise."""

    angle: float
    rate: float


class Control(ForceElement):
    """A force on a point, or a moment on a section, as a function of time and measurements.

    Parameters
    ----------
    law
        A function ``law(t, name=..., ...)`` of the time (in statics the load factor) and of the
        measurements named in ``points`` and ``sections``. It returns the force (2,), or the moment,
        counterclockwise.
    at
        Where it acts: a point as for a spring, or for a moment a section: a place or (beam, place).
    kind
        "force" or "moment".
    other
        Where the opposite force or moment acts; None for the ground.
    points, sections
        Names and places of measurements: :class:`MeasuredPoint` and :class:`MeasuredSection`.
    dt
        Sampling time: the law is evaluated at ``t_start + k dt`` and its value held (zero-order
        hold); None to evaluate it continuously, in each iteration.
    beam
        Beam, name or number, for places that name none.
    """

    symmetric = False
    evolves = False

    def __init__(self, law: Callable[..., Any], at: Any, kind: str = "force", other: Any = None,
                 points: Mapping[str, Any] | None = None,
                 sections: Mapping[str, Any] | None = None, dt: float | None = None,
                 beam: WhichBeam = None) -> None:
        self.law = require_function("law", law, "of time and measurements")
        if isinstance(law, type):
            raise InputError(f"law must be a function of time and measurements, got {shown(law)}")
        self.at, self.other, self.beam = at, other, beam
        self.kind = require_option("kind", kind, ("force", "moment"))
        self.points, self.sections = _named("points", points), _named("sections", sections)
        both = {name for name, _ in self.points} & {name for name, _ in self.sections}
        refuse(both, "points and sections must have different names, got {} in both", sorted(both))
        self.dt = None if dt is None else require_positive("dt", dt)

    def bind(self, layout: Layout) -> list[Vector]:
        find = self._point if self.kind == "force" else self._section
        ends = [find(layout, self.at)]
        if self.kind == "moment":
            ends.append(Vector(ends[0].start) if self.other is None else find(layout, self.other))
        elif self.other is not None:
            ends.append(find(layout, self.other))
        refuse(not ends[0].weights.size, "a control acts on a material point, there is none at "
               "{!r}", self.at)
        places = [self._point(layout, place) for _, place in self.points]
        directions = [self._section(layout, place) for _, place in self.sections]
        self._ends = len(ends)
        if self.dt is not None:
            self.start, self.evaluate = self._at_rest, self._held
        self._starts = [d.start for d in directions]
        return [*ends, *places, *directions]

    def _place(self, layout, place, where_none_is=None):
        """A beam or body, and the place on it."""
        named = isinstance(place, RigidBody) or (
            isinstance(place, (tuple, list)) and not is_point(place))
        return named_place(layout, place if named or self.beam is None else (self.beam, place),
                           where_none_is)

    def _point(self, layout, place):
        return point(layout, *self._place(layout, place, GROUND))

    def _section(self, layout, place):
        which, at = self._place(layout, place)
        if is_ground(which):
            raise InputError("the ground does not turn: leave other= out for a moment from there")
        return section(layout, which, at)[1]

    # measurements

    def measured(self, x: Array, v: Array) -> dict[str, Any]:
        """Measurements by name."""
        k = self._ends
        out: dict[str, Any] = {name: MeasuredPoint(np.array(at), np.array(rate)) for (
            name, _), at, rate in zip(self.points, x[k:], v[k:])}
        k += len(self.points)
        for (name, _), start, at, rate in zip(self.sections, self._starts, x[k:], v[k:]):
            y, angle, g = np.append(at, start)[:, None], np.empty(1), np.empty((4, 1))
            turned(np.array([[0.0], [0.0], [1.0], [0.0]]), y, np.zeros(1), angle)
            mean_turning(y, y, g)
            out[name] = MeasuredSection(float(angle[0]), float(g[:2, 0] @ rate))
        return out

    def ask(self, x: Array, v: Array, t: float) -> Any:
        """Value of the law: a number, or a force (2,)."""
        values = self.measured(x, v)
        if self.kind == "moment":
            return ask_number("law(t = {:g})", lambda t: self.law(t, **values), float(t))
        return ask_array("law(t = {:g})", (2,), lambda t: self.law(t, **values), float(t))

    # with a sampling time it has a history: 1 after a sample, its time and its value

    def _at_rest(self):
        return np.zeros(3 if self.kind == "moment" else 4)

    def _held(self, x, v, t, history, dt):
        """Force by the last sample; before the first one, as in statics, by the law."""
        value = self.ask(x, v, t) if history[0] == 0.0 else (
            history[2] if self.kind == "moment" else history[2:])
        return self._on_ends(x, value), history

    def sample(self, x: Array, v: Array, t: float, history: Array) -> Array:
        """The history after a measurement at t, if one is due."""
        due = history[0] == 0.0 or t >= history[1] + (1.0 - ROUND_OFF) * (self.dt or 0.0)
        return np.append((1.0, t), self.ask(x, v, t)) if due else history

    def mean(self, x: Array, y: Array, t: float, history: Array, dt: float) -> Array:
        """The force (n, 2) in the middle of a step."""
        return self._held(0.5 * (x + y), 0.0 * x, t, history, dt)[0]

    # forces

    def force(self, x: Array, v: Array, t: float, *past: Any) -> Array:
        return self._held(x, v, t, *past)[0] if past else self._on_ends(x, self.ask(x, v, t))

    def _on_ends(self, x, value):
        out = np.zeros(np.shape(x))
        if self.kind == "moment":
            g = np.empty((4, 1))
            mean_turning(*2 * [np.reshape(x[:2], (4, 1))], g)
            out[:2] = value * g.reshape(2, 2)
        else:
            out[0] = value
            if self._ends == 2:
                out[1] = -np.asarray(value)
        return out

    def stiffness(self, x: Array, v: Array, t: float, *past: Any) -> Array:
        return differences(lambda y: self.force(y, v, t, *past), x)

    def resistance(self, x: Array, v: Array, t: float, *past: Any) -> Array:
        return differences(lambda w: self.force(x, w, t, *past), v)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield Symbol("control", (self._point(layout, self.at),), text=f"{self.kind}(t, ...)")

    def __repr__(self) -> str:
        how = "" if self.dt is None else f", sampled every {self.dt:g}"
        return f"<Control of a {self.kind} at {shown(self.at)}{how}>"


def _named(what, places):
    if places is None:
        return ()
    if not isinstance(places, dict) or not all(
            isinstance(name, str) and name.isidentifier() and name != "t" for name in places):
        raise InputError(f"{what} must be a dictionary from names, which become arguments of the "
                         f"law, to places, got {shown(places)}")
    return tuple(places.items())
