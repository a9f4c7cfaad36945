"""What pictures show: bodies of one or more instants on a grid, their colours; symbols of items."""

import re
from collections.abc import Iterable
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from ..actions.loads import LineLoad, Load, TimedLoad
from ..actions.obstacles.contact import may_touch
from ..actions.obstacles.shapes import AROUND, around, outlines
from ..actions.places import Vector
from ..actions.symbols import LOADS, Symbol
from ..beam import Layout
from ..core import (AncfError, Array, refuse, require_finite_scalar, require_flag, require_positive,
                    require_unmasked, retold)
from ..recovery.fields import (DRAWN, Field, find_field, no_value, unit_in, unit_of, units_of,
                               values_on_grid, with_unit)
from ..recovery.grids import Grid, grids, in_space

#: ``thickness="auto"`` draws a section at least this part of the picture high.
READABLE = 1 / 25

#: ``scale="auto"`` draws the largest displacement at most this part of the body.
VISIBLE = 0.12

#: Largest distance of drawn obstacles, relative to the picture of a scene.
WIDE = 0.6

#: Colours of signed fields, visible on white at zero.
SIGNED = "#313695", "#5a91c4", "#ecd27a", "#ee6a41", "#a50026"

#: Colours of lines, of less important ones, of the reference configuration, of bodies and
#: obstacles.
INK, MUTED, GHOST, RIGID, WALL = "#222222", "#666666", "#d9d9d9", "#bbbbbb", "#7a5230"
#: Of bodies in the picture of a scene, one for each material.
BODIES = "#cfdbe6", "#e8d3a8", "#bcd9b4", "#e3bfc3", "#c9bfe0", "#b5dcd8", "#dcc7b2", "#d5d59e"


class _Solid:
    """A domain: drawn positions of its points, the field there, and quads; triangles repeat a
    corner."""

    def __init__(self, grid, field):
        if grid.values is None:
            raise no_value(field)
        values = field.of(grid.values)
        self.values = values if field.components == 1 else np.sqrt(np.sum(values**2, axis=0))
        self.cells = grid.cells[:, [0, 1, 2, -1]]
        self.reference, self.deformed = grid.x, grid.x + grid.u

    def outline(self, undeformed):
        """Edges of the boundary, or of all cells of the reference configuration, (points, 2)."""
        if undeformed:
            return list(self.reference.T[self.cells])
        size = 1e-6 * np.max(np.ptp(self.reference, axis=1))
        number = np.unique(np.round(self.reference / size), axis=1, return_inverse=True)[1].ravel()
        ends = np.concatenate([self.cells[:, [k, (k + 1) % 4]] for k in range(4)])
        ends = ends[number[ends[:, 0]] != number[ends[:, 1]]]
        _, first, times = np.unique(np.sort(number[ends], axis=1), axis=0, return_index=True,
                                    return_counts=True)
        return list(self.deformed.T[ends[first[times == 1]]])


class _Body(_Solid):
    """A beam, with positions (2, nelements, m + 1, rows) once its section is magnified."""

    def __init__(self, grid, field, state, beam, m, scale):
        super().__init__(grid, field)
        self.height = beam.mesh.height
        # the axis is at eta = 1/2, which is on the grid only if it has an odd number of rows
        axis = values_on_grid(state, beam, np.array([np.linspace(0, 1, m + 1),
                                                     np.full(m + 1, 0.5)]), False)
        flat = (2, beam.mesh.nelements, m + 1)
        x, u = (y.reshape(*flat, grid.rows) for y in (grid.x, grid.u))
        axis_x, axis_u = (y.reshape(flat) for y in (axis.x, scale * axis.u))
        #: Points and axis of both configurations.
        self.shapes = (x, axis_x), (x + u, axis_x + axis_u)

    def magnify(self, factor):
        self.reference, self.deformed = (
            axis[..., None] + factor * (x - axis[..., None]) for x, axis in self.shapes)

    def outline(self, undeformed):
        """Closed lines around each chain of elements, shape (points, 2)."""
        x = self.reference if undeformed else self.deformed
        cuts = np.nonzero(np.hypot(*(x[:, 1:, 0] - x[:, :-1, -1])).max(axis=-1)
                          > 1e-6 * self.height)[0] + 1
        out = []
        for part in np.split(np.arange(x.shape[1]), cuts):
            run = x[:, part].reshape(2, -1, x.shape[-1])
            out.append(np.hstack([run[:, :, 0], run[:, -1, 1:], run[:, -2::-1, -1],
                                  run[:, 0, -2:0:-1]]).T)
        return out


def _thickness(thickness, bodies):
    if not (isinstance(thickness, str) and thickness == "auto"):
        return require_positive("thickness", thickness)
    if not bodies:
        return 1.0
    shapes = [shape for b in bodies for shape in b.shapes]
    every = np.concatenate([axis.reshape(2, -1) for _, axis in shapes], axis=1)
    factor = round(READABLE * np.max(np.ptp(every, axis=1)) / max(b.height for b in bodies))
    for x, axis in shapes:  # both faces keep a third of the advance of the axis
        step = np.diff(axis, axis=-1)
        for face in (0, -1):
            offset = np.diff(x[..., face] - axis, axis=-1)
            turn = -np.sum(offset * step, axis=0) / np.sum(step**2, axis=0)
            factor = min(factor, (2 / 3) // max(np.max(turn), 1e-300))
    return float(max(1, factor))


class Scenery:
    """States of the same beams with one thickness factor and one range of colours. Arguments are
    those of :func:`~skfem_ancf.visuals.matplotlib.plot_state`. ``frames`` and ``rigid`` are for
    each state its beams and domains, and the grids of its rigid bodies and of domains without the
    field; ``found`` (n,) the values of all coloured points; ``grids`` are all members."""

    #: How far around the bodies obstacles are drawn.
    margin = AROUND

    def __init__(self, states: list[Any], field: Any, thickness: Any, undeformed: bool,
                 limits: Any, subdivide: tuple[int, int], recover: bool,
                 scale: Any = 1.0) -> None:
        if field is None:  # the displacement where there is no stress
            field = "S_xx" if any(beam.section.has_fields and np.any(state.u_of(beam))
                                  for state in states for beam in state.beams) else "displacement"
        self.field: Field = find_field(field, DRAWN)
        self.undeformed = require_flag("undeformed", undeformed)
        self.frames: list[list[Any]] = []
        self.rigid: list[list[Grid]] = []
        every = [grids(state, subdivide, recover=recover) for state in states]
        if isinstance(scale, str) and scale == "auto":  # 1, 2 or 5 times a power of ten
            both = [grid for found in every for grid in found]
            size = np.max(np.ptp(np.concatenate([grid.x for grid in both], axis=1), axis=1))
            largest = max(float(np.max(np.hypot(*grid.u))) for grid in both)
            scale = 1.0
            if 1e-12 * size < largest < VISIBLE * size:
                wanted = VISIBLE * size / largest
                power = 10.0 ** np.floor(np.log10(wanted))
                scale = float(power * max(k for k in (1, 2, 5)
                                          if k * power <= wanted * (1 + 1e-9)))
        self.scale = require_positive("scale", scale)
        for state, found in zip(states, every):
            found = [grid._replace(u=self.scale * grid.u) for grid in found]
            self.frames.append([_Body(grid, self.field, state, beam, subdivide[0], self.scale)
                                for grid, beam in zip(found, state.beams)])
            self.rigid.append([])
            for grid in found[len(state.beams):]:
                try:
                    self.frames[-1].append(_Solid(grid, self.field))
                except AncfError:  # a rigid body, or the field is not defined there
                    self.rigid[-1].append(grid)
        bodies = [body for frame in self.frames for body in frame]
        if isinstance(thickness, str) and thickness == "auto" and any(map(may_touch, states)):
            thickness = 1.0  # thicker sections would enter each other
        beams = [body for body in bodies if isinstance(body, _Body)]
        self.factor = _thickness(thickness, beams)
        for beam in beams:
            beam.magnify(self.factor)
        self.found = np.concatenate([np.zeros(0), *(body.values for body in bodies)])
        if self.found.size and not np.any(np.isfinite(self.found)):
            raise no_value(self.field)
        require_unmasked("limits", limits)
        if limits is None:
            start = self.field.neutral
            size = np.max(np.abs(self.found[np.isfinite(self.found)] - start), initial=0.0) or 1.0
            self.low, self.high = (start - size if self.field.signed else start), start + size
        else:
            with retold((TypeError, ValueError), "limits must be two numbers, got {!r}", limits):
                low, high = limits
            self.low, self.high = (require_finite_scalar("limits", x) for x in (low, high))
            refuse(not self.low < self.high, "limits must increase, got {!r}", limits)
        self._states, self.grids = states, every

    @cached_property
    def every(self) -> Array:
        """All drawn points, shape (n, 3)."""
        return np.concatenate([self.points(k) for k in range(len(self.frames))]
                              + [self.points(0, True)] * self.undeformed)

    @cached_property
    def walls(self) -> list[Any]:
        """Outlines of obstacles in each frame, shapes (n, 2, 2)."""
        box = around(self.every[:, :2].T, self.margin)
        return [np.concatenate([np.zeros((0, 2, 2)), *outlines(state, box)])
                for state in self._states]

    def beam_points(self, frames: Iterable[int], undeformed: bool = False) -> Array:
        """Points of the beams of frames, shape (2, n), deformed or not."""
        return np.concatenate([np.zeros((2, 0)), *(
            (b.reference if undeformed else b.deformed).reshape(2, -1)
            for k in frames for b in self.frames[k])], axis=1)

    def points(self, k: int, undeformed: bool = False) -> Array:
        """Points of frame ``k`` with rigid bodies, shape (n, 3), deformed or not."""
        return np.concatenate([in_space(self.beam_points([k], undeformed)),
                               *(g.points(undeformed) for g in self.rigid[k])])

    def values(self, k: int) -> Array:
        """Values of frame ``k``, shape (n,); NaN on rigid bodies."""
        return np.concatenate([b.values for b in self.frames[k]] + [
            np.full(g.x.shape[1], np.nan) for g in self.rigid[k]])

    def outlines(self, k: int, undeformed: bool = False) -> list[Array]:
        """Closed lines around the beams of frame ``k``, shapes (n, 2), deformed or not."""
        return [line for b in self.frames[k] for line in b.outline(undeformed)]

    def cells(self, frames: Iterable[int] = (0,)) -> Array:
        """Quads of the beams of frames, as rows of points, (nc, 4)."""
        bodies = [b for k in frames for b in self.frames[k]]
        first = np.cumsum([0] + [b.values.size for b in bodies])
        return np.concatenate([np.zeros((0, 4), dtype=int), *(
            f + b.cells for f, b in zip(first, bodies))])

    @property
    def faces(self) -> Array:
        """Quads and outlines of rigid bodies: number of corners and points of each."""
        cells, at = self.cells(), sum(b.values.size for b in self.frames[0])
        parts = [np.hstack([np.full((len(cells), 1), 4), cells]).ravel()]
        for grid in self.rigid[0]:
            corners = np.full((len(grid.cells), 1), grid.cells.shape[1])
            parts.append(np.hstack([corners, at + grid.cells]).ravel())
            at += grid.x.shape[1]
        return np.concatenate(parts)

    @property
    def note(self) -> str:
        """Text with the magnification of thickness and displacements."""
        said = [] if self.factor == 1.0 else [f"section drawn {self.factor:g} times as thick"]
        return ", ".join(said + [f"displacements {self.scale:g} times as large"] * (
            self.scale != 1.0))

    @property
    def axes(self) -> tuple[str, str]:
        """Labels of the axes, with the unit of length if the scene has one."""
        _, length = units_of(self._states[0]) or ("", "")
        return with_unit("x", length), with_unit("y", length)

    def label(self, text: str, unit: str | None) -> str:
        """A text with the unit; by default that of the field in the scene; "" for none."""
        return with_unit(text, unit_of(self.field, units_of(self._states[0])) if unit is None else
                         unit)

    def colours(self, cmap: Any) -> Any:
        """The given colour map, or by default one that fits the field."""
        from matplotlib.colors import LinearSegmentedColormap

        return cmap or (LinearSegmentedColormap.from_list("signed", SIGNED)
                        if self.field.signed else "viridis")


def rounded(value: float, unit: str) -> str:
    """A number with four digits and its unit: N, kN or MN, and Pa, MPa or GPa."""
    if unit == "Pa" and abs(value) >= 1e5:
        value, unit = (1e-9 * value, "GPa") if abs(value) >= 1e10 else (1e-6 * value, "MPa")
    if re.match(r"N\b", unit) and abs(value) >= 1e4:
        power = 2 if abs(value) >= 1e7 else 1
        value, unit = value / 1000.0**power, "kM"[power - 1] + unit
    return f"{float(f'{value:.4g}'):.9g} {unit}".strip()


#: Colours of loads and of supports.
LOAD, HOLD = "#b3261e", "#1f5f8b"
#: Sizes of symbols relative to the picture: arrows, those of distributed loads, others.
ARROW, SPREAD, SIZE = 0.13, 0.07, 0.03
#: Kinds that are texts beside a body.
NOTES = "eigenstrain", "drag"


def symbols_of(state: Any, loads: bool, supports: bool, start: bool = False) -> list[Symbol]:
    """Symbols of the loads, and of all other items, of the scene of a state."""
    # With ``start`` loads have their full values, as before the solution; those that move or depend
    # on time are those at time 0, or at 1 if they vanish there.
    if not (loads or supports):
        return []
    system: Any = getattr(state, "system", None)
    refuse(getattr(system, "items", None) is None, "a state from a file or another process does "
           "not know the items of its scene: use scene.plot()")
    layout, found, t = Layout(*system.members), list[Symbol](), state.t
    for item in chain.from_iterable(one.expand(layout) for one in system.items):
        factor = 1.0
        if isinstance(item, (TimedLoad, LineLoad)) and not start:
            item = item._with(_time=1.0 if t is None else t)
        if isinstance(item, Load):
            factor = item.factor(t) * (state.load if item.scaled and not start else 1.0)
        found += [s._replace(value=s.value * factor) if s.kind in LOADS else s
                  for s in item.symbols(layout)]
    return [s for s in found if (loads if s.kind in LOADS else supports)]


def unit_of_load(symbol: Symbol, units: tuple[str, str] | None) -> str:
    """The unit of a force, per length or area where it is distributed, or moment; "" if unknown."""
    if units is None or symbol.kind not in ("force", "moment"):
        return ""
    return unit_in(units, symbol.kind) + f"/{units[1]}" * (symbol.per > 0) + "²" * (symbol.per == 2)


class Sketch:
    """Draws symbols on Axes ``ax``; the gid of each artist is the kind of its symbol. ``u`` (N,) is
    the drawn displacement, ``points`` (n, 2) are drawn points of the bodies."""

    def __init__(self, ax: Any, u: Array, points: Array,
                 units: tuple[str, str] | None = None) -> None:
        self.ax, self.u, self.points, self.units = ax, u, points, units
        self.size = float(np.max(np.ptp(points, axis=0)))
        #: The gid of artists.
        self.kind = ""
        #: Where arrows and texts are.
        self.taken = np.full((1, 2), np.inf)

    def draw(self, symbols: Iterable[Symbol]) -> None:
        """Draw symbols: one for all supports of a place, one for all weights of a gravity."""
        one: dict[Any, Symbol] = {}
        for number, s in enumerate(symbols):
            key: Any = number
            if s.kind == "weight":
                key = s.kind, *s.direction[0], s.value
            elif s.kind in ("support", "joint", "eigenstrain"):
                key = s.kind, *(np.round(s.at[0].start / self.size, 6) + 0.0)
            before = one.get(key)
            if s.kind == "support" and before is not None:  # the one with a known direction
                s = max(before, s, key=lambda one: tuple(one.direction[0]) != (0.0, -1.0))._replace(
                    text=f"{before.text} {s.text}")
            elif s.kind == "eigenstrain" and s.value:
                texts = [] if before is None else before.text.split(", ")
                texts.append(s.text + (f"{s.value:.6g}" if s.show else ""))
                s = s._replace(text=", ".join(dict.fromkeys(texts)), show=False)
            one[key] = s if s.value or before is None else before
        largest = max((abs(s.value) for s in one.values() if s.kind == "force" and len(s.at) == 1),
                      default=0.0) or 1.0
        for s in sorted(one.values(), key=lambda s: s.kind in NOTES or len(s.at) > 1):
            if not s.value and s.kind in LOADS:
                continue
            at, mass = np.array([place(self.u) for place in s.at]), s.kind == "mass"
            self.kind = s.kind
            if mark := {"joint": "o" if s.text == "hinge" else "s", "mass": "o",
                        "control": "D"}.get(s.kind):
                self._mark(mark, at[0], INK if mass else "white")
            elif s.kind not in NOTES:
                getattr(self, "_" + s.kind.replace(" ", "_"))(s, at, largest)
            if s.kind in (*NOTES, "mass", "control", "torsional spring"):
                self._beside(f"{s.text}{s.value:.6g}" if mass else s.text, at[0], LOAD if (
                    s.kind in LOADS) else INK if mass else HOLD)

    def names(self, members: Iterable[Grid]) -> None:
        """Write the names of members in their middle; of beams in a section off it."""
        self.kind = "name"
        for grid in members:
            x = grid.x
            if grid.rows > 1:
                columns = x.reshape(2, grid.elements[-1] + 1, -1, grid.rows)
                x = columns[:, columns.shape[1] // 4, columns.shape[2] // 2]
            self._text(grid.name, np.mean(x, axis=1), (1, -1), INK, 10, style="italic")

    # loads

    def _force(self, s, at, largest):
        d = np.array(s.direction)
        for k, turn in enumerate(s.turn):
            now, start = (x @ [1, 1j] for x in (turn(self.u), turn.start))
            z = d[k] @ [1, 1j] * now / start * abs(start / now)
            d[k] = np.array([z.real, z.imag])
        length = np.sign(s.value) * self.size * (
            SPREAD if len(at) > 1 else ARROW * (0.5 + 0.5 * abs(s.value) / largest))
        tips, tails = at, at - length * d
        out = at + length * d
        if len(at) == 1 and self._room(out[0], self.points) > 1.2 * self._room(
                tails[0], self.points):
            tips, tails = out, at
        sizes, order = np.hypot(*d.T), np.argsort(np.abs(np.arange(len(at)) - len(at) // 2))
        clear = [i for i in order if self._room(tails[i], self.taken) > 0.1 * self.size]
        k = [*clear, *order][0] if np.ptp(sizes) < 1e-9 else int(np.argmax(sizes))
        for tip, tail in zip(tips, tails):
            if np.hypot(*(tip - tail)) > 0.005 * self.size:
                self._arrow(tail, tip)
        if len(at) > 1:
            self._line(tails, LOAD, 0.8)
            self.taken = np.vstack([self.taken, 0.5 * (tails[1:] + tails[:-1])])
        if s.show:
            free, other = (tips[0], tails[0]) if tips is out else (tails[k], tips[k])
            self._text(self._value(s), free, free - other, LOAD)

    def _value(self, s):
        """Text and value, with the unit of a force or moment."""
        unit = unit_of_load(s, self.units)
        return s.text + (rounded(abs(s.value), unit) if unit else f"{abs(s.value):.6g}")

    def _weight(self, s, at, largest):
        """One arrow to the right of the picture for all members of one gravity."""
        foot = np.max(self.points, axis=0) + [0.2 * self.size, 0.0]
        tip = foot + ARROW * self.size * np.array(s.direction[0]) * np.sign(s.value)
        self._arrow(foot, tip, color=MUTED)
        self._text(s.text + rounded(abs(s.value), ""), tip, tip - foot, MUTED)

    def _moment(self, s, at, largest):
        motor, color = s.kind == "motor", HOLD if s.kind == "motor" else LOAD
        angle = np.sign(s.value) * np.linspace(-0.75 * np.pi, 0.75 * np.pi, 40)
        arc = at[0] + 1.5 * SIZE * self.size * np.column_stack([np.cos(angle), np.sin(angle)])
        self._arrow(*arc, color=color)
        self._beside("angle(t)" if motor else s.text or self._value(s), at[0], color)

    _motor = _moment

    def _beside(self, text, at, color):
        """Write in a corner about a position, far from bodies and other texts."""
        r = 1.1 * SIZE * self.size

        def room(one):
            far, away = one
            box = self._box(text, at + far * r * np.array(away), away)
            return min(1.0, *(round(self._room(point, others) / r, 3) for point in box
                              for others in (self.points, self.taken)))

        far, away = max([(k, (x, y)) for k in (1, 2, 3) for y in (1, -1) for x in (1, -1)],
                        key=room)
        self._text(text, at + far * r * np.array(away), away, color)

    def _box(self, text, at, away):
        x, y = np.array(away) / (np.hypot(*away) or 1.0)
        width = (0.5 + 0.4 * len(text)) * (np.sign(x) if abs(x) > 0.4 else 0.0)
        return at + self.size * SIZE * np.outer([0.0, 0.5, 1.0], [width, y])

    def _room(self, point, others):
        return float(np.min(np.hypot(*(others - point).T)))

    # supports and joints

    def _support(self, s, at, largest):
        held, base, r = set(s.text.split()), at[0], SIZE * self.size
        single, (x, y) = {"x", "y"} - held, s.direction[0]
        if len(single) == 2:
            return self._mark("s", base)
        if single or "angle" not in held:  # upright, or sideways where only x is held
            x, y = (0.0, 1.0 if y > 0.7 else -1.0) if "y" in held else (1.0 if x > 0.7 else -1.0, 0)
        d, across, wide = np.array([x, y]), np.array([-y, x]), 1.2 * r
        if "angle" in held:  # as wide as the drawn section, unless it is along a body
            off = self.points - base
            far = np.abs(off[np.abs(off @ [y, x]) < 0.002 * self.size] @ across)
            half = float(np.max(far[far < 0.2 * self.size], initial=0.0))
            wide = max(wide, 1.3 * half * (half < 0.15 * self.size))
        if "angle" not in held:
            base = base + 1.5 * r * d
            self._line([at[0], base + 0.8 * r * across, base - 0.8 * r * across, at[0]])
        elif single:
            self._line([base - wide * across, base + wide * across])
        self._ground(base + 0.4 * r * d * len(single), d, wide)

    def _ground(self, foot, d, wide):
        """A line across d with hatching behind it."""
        across, r = np.array([-d[1], d[0]]), SIZE * self.size
        self._line([foot - wide * across, foot + wide * across])
        for k in np.linspace(-wide, wide - 0.4 * r, max(6, round(2 * wide / r))):
            at = foot + k * across
            self._line([at, at + 0.45 * r * (d - across)], HOLD, 0.8)

    def _slider(self, s, at, largest):
        d, r = np.array(s.direction[0]), SIZE * self.size
        for side in (-0.6, 0.6):
            foot = at[0] + side * r * np.array([-d[1], d[0]])
            self._line([foot - 1.5 * r * d, foot + 1.5 * r * d])
        self._mark("o", at[0])

    def _spring(self, s, at, largest):
        a, b = at
        along, r = b - a, 0.5 * SIZE * self.size
        length = np.hypot(*along)
        if length > 0:
            across = np.array([-along[1], along[0]]) / length
            x = np.array([0, 0.2, *np.linspace(0.25, 0.75, 8), 0.8, 1])
            y = np.array([0, 0, *np.tile([1, -1], 4), 0, 0])
            self._line(a + np.outer(x, along) + r * np.outer(y, across))
            for place, end, outwards in zip(s.at, at, (-along, along)):
                if not place.dofs.size:
                    self._ground(end, outwards / length, 1.2 * r)
            if s.text:
                self._text(s.text, 0.5 * (a + b) + r * across, across, HOLD)

    def _foundation(self, s, at, largest):
        foot = at[0] + 2 * SIZE * self.size * np.array(s.direction[0])
        self._spring(s._replace(at=(s.at[0], Vector(foot)), text=""), [at[0], foot], largest)
        if s.text:
            self._text(s.text, foot, s.direction[0], HOLD, 8)

    def _torsional_spring(self, s, at, largest):
        angle = np.linspace(0, 4 * np.pi, 60)
        spiral = SIZE * self.size * angle / angle[-1] * [np.cos(angle), np.sin(angle)]
        self._line(at[0] + spiral.T)

    # artists

    def _arrow(self, *points, color=LOAD):
        from matplotlib.patches import FancyArrowPatch
        from matplotlib.path import Path

        self.ax.add_patch(FancyArrowPatch(
            path=Path(points), arrowstyle="-|>", mutation_scale=9, color=color, lw=1.2, zorder=5,
            gid=self.kind))
        self.ax.update_datalim(points)
        self.taken = np.vstack([self.taken, points, 0.5 * np.add(points[0], points[-1])])

    def _line(self, points, color=HOLD, lw=1.2):
        self.ax.plot(*np.transpose(points), color=color, lw=lw, zorder=4, gid=self.kind,
                     solid_capstyle="round")

    def _mark(self, marker, at, face="white"):
        self.ax.plot(*at, marker, mfc=face, mec=HOLD, ms=6, mew=1.2, zorder=6, gid=self.kind)

    def _text(self, text, at, away, color, far=4, **options):
        from matplotlib.patheffects import withStroke

        x, y = np.array(away) / (np.hypot(*away) or 1.0)
        box = self._box(text, at, away)
        self.ax.update_datalim(box)
        self.taken = np.vstack([self.taken, box])
        self.ax.annotate(
            text, at, (far * x, far * y), textcoords="offset points", fontsize=8, color=color,
            gid=self.kind, zorder=7, path_effects=[withStroke(linewidth=2, foreground="white")],
            ha="left" if x > 0.4 else "right" if x < -0.4 else "center",
            va="bottom" if y > 0.4 else "top" if y < -0.4 else "center", **options)
