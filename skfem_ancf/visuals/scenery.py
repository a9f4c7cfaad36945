"""Geometry and colours of pictures: bodies of one or more instants on a grid."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from ..actions.obstacles.contact import may_touch
from ..actions.obstacles.outlines import AROUND, around, outlines
from ..core import (AncfError, Array, InputError, refuse, require_finite_scalar, require_flag,
                    require_positive, require_unmasked, shown)
from ..recovery.fields import (DRAWN, Field, find_field, no_value, unit_of, units_of,
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


class _Body:
    """One beam: reference and deformed positions of grid points and axis, and the field."""

    def __init__(self, grid, state, beam, m, field, scale):
        self.cells, self.height = grid.cells, beam.mesh.height
        # the axis is at eta = 1/2, which is on the grid only if it has an odd number of rows
        axis = values_on_grid(state, beam, np.array([np.linspace(0, 1, m + 1),
                                                     np.full(m + 1, 0.5)]), False)
        flat = (2, beam.mesh.nelements, m + 1)
        x, u = (y.reshape(*flat, grid.rows) for y in (grid.x, grid.u))
        axis_x, axis_u = (y.reshape(flat) for y in (axis.x, scale * axis.u))
        self.reference, self.deformed = (x, axis_x), (x + u, axis_x + axis_u)
        self.values = _values(field, grid)

    def points(self, body, factor):
        """Positions (2, nelements, m + 1, rows) with the section magnified by ``factor``."""
        x, axis = body
        return axis[..., None] + factor * (x - axis[..., None])

    def outline(self, body, factor):
        """Closed lines around each chain of elements, shape (points, 2)."""
        x = self.points(body, factor)
        cuts = np.nonzero(np.hypot(*(x[:, 1:, 0] - x[:, :-1, -1])).max(axis=-1)
                          > 1e-6 * self.height)[0] + 1
        out = []
        for part in np.split(np.arange(x.shape[1]), cuts):
            run = x[:, part].reshape(2, -1, x.shape[-1])
            out.append(np.hstack([run[:, :, 0], run[:, -1, 1:], run[:, -2::-1, -1],
                                  run[:, 0, -2:0:-1]]).T)
        return out


class _Solid:
    """One domain as a :class:`_Body`: quads; triangles repeat a corner."""

    def __init__(self, grid, field):
        self.cells = grid.cells[:, [0, 1, 2, -1]]
        self.reference, self.deformed = grid.x, grid.x + grid.u
        self.values = _values(field, grid)

    def points(self, body, factor):
        """Positions (2, n)."""
        return body

    def outline(self, body, factor):
        """Edges of the boundary, or of all cells of the reference configuration, (points, 2)."""
        if body is self.reference:
            return list(body.T[self.cells])
        size = 1e-6 * np.max(np.ptp(self.reference, axis=1))
        number = np.unique(np.round(self.reference / size), axis=1, return_inverse=True)[1].ravel()
        ends = np.concatenate([self.cells[:, [k, (k + 1) % 4]] for k in range(4)])
        ends = ends[number[ends[:, 0]] != number[ends[:, 1]]]
        _, first, times = np.unique(np.sort(number[ends], axis=1), axis=0, return_index=True,
                                    return_counts=True)
        return list(body.T[ends[first[times == 1]]])


def _values(field, grid):
    values = field.of(grid.values)
    return values if field.components == 1 else np.sqrt(np.sum(values**2, axis=0))


def _coloured(grid, field):
    """The drawn quads of a domain, or None where the field is not defined."""
    try:
        return None if grid.values is None else _Solid(grid, field)
    except AncfError:
        return None


def _thickness(thickness, bodies):
    if not (isinstance(thickness, str) and thickness == "auto"):
        return require_positive("thickness", thickness)
    if not bodies:
        return 1.0
    shapes = [shape for b in bodies for shape in (b.reference, b.deformed)]
    every = np.concatenate([axis.reshape(2, -1) for _, axis in shapes], axis=1)
    factor = round(READABLE * np.max(np.ptp(every, axis=1)) / max(b.height for b in bodies))
    for x, axis in shapes:  # both faces keep a third of the advance of the axis
        step = np.diff(axis, axis=-1)
        for face in (0, -1):
            offset = np.diff(x[..., face] - axis, axis=-1)
            turn = -np.sum(offset * step, axis=0) / np.sum(step**2, axis=0)
            factor = min(factor, (2 / 3) // max(np.max(turn), 1e-300))
    return float(max(1, factor))


def _scale(scale, found):
    """Magnification of displacements; 1, 2 or 5 times a power of ten for "auto"."""
    if not (isinstance(scale, str) and scale == "auto"):
        return require_positive("scale", scale)
    size = np.max(np.ptp(np.concatenate([grid.x for grid in found], axis=1), axis=1))
    largest = max(float(np.max(np.hypot(*grid.u))) for grid in found)
    if not 1e-12 * size < largest < VISIBLE * size:
        return 1.0
    wanted = VISIBLE * size / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(k for k in (1, 2, 5) if k * power <= wanted * (1 + 1e-9)))


def _limits(limits, values, field):
    require_unmasked("limits", limits)
    if limits is not None:
        try:
            low, high = limits
        except (TypeError, ValueError):
            raise InputError(f"limits must be two numbers, got {shown(limits)}") from None
        low, high = require_finite_scalar("limits", low), require_finite_scalar("limits", high)
        refuse(not low < high, "limits must increase, got {!r}", limits)
        return low, high
    start = field.neutral
    size = np.max(np.abs(values[np.isfinite(values)] - start), initial=0.0) or 1.0
    return (start - size if field.signed else start), start + size


def _default(states):
    """The stress along the beams; the displacement where there is no stress."""
    stressed = any(beam.section.has_fields and np.any(state.u_of(beam))
                   for state in states for beam in state.beams)
    return "S_xx" if stressed else "displacement"


class Scenery:
    """States of the same beams with one thickness factor and one range of colours. Arguments are
    those of :func:`~skfem_ancf.visuals.matplotlib.plot_state`. ``frames`` and ``rigid`` are for
    each state its beams and domains, and the grids of its rigid bodies and of domains without the
    field; ``found`` (n,) the values of all coloured points."""

    #: How far around the bodies obstacles are drawn.
    margin = AROUND

    def __init__(self, states: list[Any], field: Any, thickness: Any, undeformed: bool,
                 limits: Any, subdivide: tuple[int, int], recover: bool,
                 scale: Any = 1.0) -> None:
        self.field: Field = find_field(_default(states) if field is None else field, DRAWN)
        self.undeformed = require_flag("undeformed", undeformed)
        self.frames: list[list[Any]] = []
        self.rigid: list[list[Grid]] = []
        every = [grids(state, subdivide, recover=recover) for state in states]
        self.scale = _scale(scale, [grid for found in every for grid in found])
        for state, found in zip(states, every):
            found = [grid._replace(u=self.scale * grid.u) for grid in found]
            self.frames.append([_Body(grid, state, beam, subdivide[0], self.field, self.scale)
                                for grid, beam in zip(found, state.beams)])
            others = [(grid, _coloured(grid, self.field)) for grid in found[len(state.beams):]]
            self.frames[-1] += [solid for _, solid in others if solid is not None]
            self.rigid.append([grid for grid, solid in others if solid is None])
        self.beams = [body for frame in self.frames for body in frame]
        if isinstance(thickness, str) and thickness == "auto" and any(map(may_touch, states)):
            thickness = 1.0  # thicker sections would enter each other
        self.factor = _thickness(thickness, [b for b in self.beams if isinstance(b, _Body)])
        self.found = np.concatenate([np.zeros(0), *(b.values for b in self.beams)])
        if self.found.size and not np.any(np.isfinite(self.found)):
            raise no_value(self.field)
        self.low, self.high = _limits(limits, self.found, self.field)
        self._states, self._grids = states, every

    @property
    def names(self) -> list[tuple[str, Array]]:
        """Names and positions (2,) of the members of the first frame; beams on the axis."""
        def place(grid):
            if grid.rows == 1:
                return grid.x
            columns = grid.x.reshape(2, grid.elements[-1] + 1, -1, grid.rows)
            return columns[:, columns.shape[1] // 4, columns.shape[2] // 2]

        return [(grid.name, np.mean(place(grid), axis=1)) for grid in self._grids[0]]

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

    @property
    def near_walls(self) -> Array:
        """Points of obstacles of the last frame beside, above or below the bodies, (n, 2)."""
        points, walls = self.every[:, :2].T, self.walls[-1]
        a, along = walls[:, 0], walls[:, 1] - walls[:, 0]
        off = np.sum((around(points).mean(axis=1) - a) * along, axis=1)
        part = np.clip(off / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
        walls = np.concatenate([walls.reshape(-1, 2), a + part[:, None] * along])
        wide, narrow = ((box[:, 0] <= walls) & (walls <= box[:, 1])
                        for box in (around(points, WIDE), around(points)))
        return walls[np.all(wide, axis=1) & np.any(narrow, axis=1)]

    def beam_points(self, frames: Iterable[int], undeformed: bool = False) -> Array:
        """Points of the beams of frames, shape (2, n), deformed or not."""
        return np.concatenate([np.zeros((2, 0)), *(
            b.points(b.reference if undeformed else b.deformed, self.factor).reshape(2, -1)
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
        return [line for b in self.frames[k] for line in b.outline(
            b.reference if undeformed else b.deformed, self.factor)]

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


def unit_of_resultant(name: str, units: tuple[str, str] | None) -> str:
    """The unit of N, Q or M; "" if the scene has no units."""
    return "" if units is None else units[0] if name in "NQ" else f"{units[0]} {units[1]}"


def rounded(value: float, unit: str) -> str:
    """A number with four digits and its unit: N, kN or MN, and Pa, MPa or GPa."""
    if unit == "Pa" and abs(value) >= 1e5:
        value, unit = (1e-9 * value, "GPa") if abs(value) >= 1e10 else (1e-6 * value, "MPa")
    if re.match(r"N\b", unit) and abs(value) >= 1e4:
        power = 2 if abs(value) >= 1e7 else 1
        value, unit = value / 1000.0**power, "kM"[power - 1] + unit
    return f"{float(f'{value:.4g}'):.9g} {unit}".strip()
