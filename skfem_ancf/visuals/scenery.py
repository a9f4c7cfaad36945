"""What pictures show: bodies of one or more instants on a grid, and their colours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..beam import kinematics
from ..core.errors import (InputError, require_finite_scalar, require_flag, require_positive,
                           shown, require_unmasked)
from ..recovery.fields import DRAWN, Field, find_field, values_on_grid
from ..recovery.grids import in_space, layout, subdivision
from ..core.linear import first_order
from ..core.kept import cached_property
from ..actions.obstacles.pictures import around, obstacles_of, outlines

if TYPE_CHECKING:
    from ..beam.configuration import Configuration
    from ..beam.rigid import RigidBody
    from ..core.types import Array

#: ``thickness="auto"`` draws a section at least this part of the picture high.
READABLE = 1 / 25

#: Colours of lines, of what is less important, of the stress-free body, of bodies and obstacles.
INK, MUTED, GHOST, RIGID, WALL = "#222222", "#666666", "#d9d9d9", "#bbbbbb", "#7a5230"


class _Body:
    """One beam on a grid: the deformed and the stress-free place of each point, and the field."""

    def __init__(self, state, beam, field, m, n, recover):
        X, quads = layout(beam, m, n)
        values, rows = values_on_grid(state, beam, X, recover), X.shape[-1] // (m + 1)
        self.rows, self.height = rows, beam.mesh.height
        self.shape = (2, beam.mesh.nelements, m + 1, rows)
        #: Quads as rows of points, shape (nc, 4).
        self.cells = (np.arange(0, values.n, X.shape[-1])[:, None, None] + quads).reshape(-1, 4)
        # the axis is at eta = 1/2, which is on the grid only if n is even
        ends = np.array([np.linspace(0, 1, m + 1), np.full(m + 1, 0.5)])
        flat = self.shape[:2] + (-1,)
        x, axis = values.x.reshape(flat), beam.mesh.mapping().F(ends)
        u = values.u.reshape(flat)
        axis_u = first_order(kinematics.displacements(
            beam, getattr(state, "_places_of", state.u_of)(beam), ends, None))
        self.reference, self.deformed = (x, axis), (x + u, axis + axis_u)
        self.values = field.of(values)
        if field.components > 1:
            self.values = np.sqrt(np.sum(self.values**2, axis=0))

    def points(self, body, factor):
        """Positions (2, nelements, m + 1, rows) with the section drawn ``factor`` thicker."""
        x, axis = body
        axis = axis[..., None]
        return axis + factor * (x.reshape(self.shape) - axis)

    def outline(self, body, factor):
        """Closed lines around each unbroken run of elements, shape (points, 2)."""
        x = self.points(body, factor)
        cuts = np.nonzero(np.hypot(*(x[:, 1:, 0] - x[:, :-1, -1])).max(axis=-1)
                          > 1e-6 * self.height)[0] + 1
        out = []
        for part in np.split(np.arange(x.shape[1]), cuts):
            run = x[:, part].reshape(2, -1, self.rows)
            out.append(np.hstack([run[:, :, 0], run[:, -1, 1:], run[:, -2::-1, -1],
                                  run[:, 0, -2:0:-1]]).T)
        return out


def _thickness(thickness, bodies):
    if not (isinstance(thickness, str) and thickness == "auto"):
        return require_positive("thickness", thickness)
    if not bodies:
        return 1.0
    shapes = [(b, p) for b in bodies for p in (b.reference, b.deformed)]
    x = np.concatenate([axis.reshape(2, -1) for _, (_, axis) in shapes], axis=1)
    factor = round(READABLE * np.max(np.ptp(x, axis=1)) / max(b.height for b in bodies))
    for body, (x, axis) in shapes:  # both faces keep a third of the advance of the axis
        step = np.diff(axis, axis=-1)
        for face in (0, -1):
            offset = np.diff(x.reshape(body.shape)[..., face] - axis, axis=-1)
            turn = -np.sum(offset * step, axis=0) / np.sum(step**2, axis=0)
            factor = min(factor, (2 / 3) // max(np.max(turn), 1e-300))
    return float(max(1, factor))


def _limits(limits, values, field):
    require_unmasked("limits", limits)
    if limits is not None:
        try:
            low, high = limits
        except (TypeError, ValueError):
            raise InputError(f"limits must be two numbers, got {shown(limits)}") from None
        low, high = require_finite_scalar("limits", low), require_finite_scalar("limits", high)
        if not low < high:
            raise InputError(f"limits must increase, got {shown(limits)}")
        return low, high
    start = field.neutral
    size = np.max(np.abs(values[np.isfinite(values)] - start), initial=0.0) or 1.0
    return (start - size if field.signed else start), start + size


class Scenery:
    """Bodies of one or more instants with one factor of thickness and one range of colours.

    Parameters
    ----------
    states
        States of the same beams.
    field, thickness, limits, subdivide, recover
        Those of :func:`~skfem_ancf.visuals.matplotlib.plot_state`.
    """

    def __init__(self, states: list[Configuration], field: Any, thickness: Any, limits: Any,
                 subdivide: tuple[int, int], recover: bool) -> None:
        self.field: Field = find_field(field, DRAWN)
        m, n = subdivision(subdivide)
        recover = require_flag("recover", recover)
        self.states, self.wall = states, None
        self.frames = [[_Body(state, beam, self.field, m, n, recover) for beam in state.beams]
                       for state in states]
        self.rigid = [[(body, state.u_of(body)) for body in getattr(state, "bodies", ())]
                      for state in states]
        #: The beams of all frames.
        self.every = [body for frame in self.frames for body in frame]
        self.factor = _thickness(thickness, self.every)
        #: Their values, shape (n,).
        self.found = np.concatenate([np.zeros(0), *(b.values.ravel() for b in self.every)])
        self.low, self.high = _limits(limits, self.found, self.field)

    @cached_property
    def walls(self) -> list[Any]:
        """The outlines of obstacles in each frame, shapes (n, 2, 2)."""
        none, states = np.zeros((0, 2, 2)), self.states
        if not obstacles_of(states[0]):
            return [none] * len(states)
        every = [self.points(k, ghost)[:, :2] for k in range(len(states))
                 for ghost in (False, True)]
        box = around(np.concatenate(every).T)
        return [np.concatenate([none, *outlines(state, box)]) for state in states]

    def points(self, k: int, undeformed: bool = False) -> Any:
        """Points of a frame, shape (n, 3).

        Parameters
        ----------
        k
            The frame.
        undeformed
            Those of the stress-free body.
        """
        x = np.concatenate([np.zeros((2, 0)), *(
            b.points(b.reference if undeformed else b.deformed, self.factor).reshape(2, -1)
            for b in self.frames[k])], axis=1)
        return np.concatenate([in_space(x), *(
            outline_points(body, 0.0 * u if undeformed else u) for body, u in self.rigid[k])])

    def values(self, k: int) -> Any:
        """Values of frame ``k``, shape (n,); NaN on rigid bodies."""
        return np.concatenate([b.values.ravel() for b in self.frames[k]] + [
            np.full(body.outline.shape[1], np.nan) for body, _ in self.rigid[k]])

    def outlines(self, k: int) -> list[Any]:
        """Corners of the rigid bodies of frame ``k``, shapes (n, 2)."""
        return [body.outline_at(u).T for body, u in self.rigid[k]]

    @property
    def cells(self) -> Any:
        """Quads of the beams of a frame as rows of points, shape (nc, 4)."""
        return cells_of(self.frames[0])

    @property
    def faces(self) -> Any:
        """Quads, and outlines of rigid bodies: the number of corners and the points of each."""
        cells, at = self.cells, sum(b.values.size for b in self.frames[0])
        parts = [np.hstack([np.full((len(cells), 1), 4), cells]).ravel()]
        for body, _ in self.rigid[0]:
            corners = body.outline.shape[1]
            parts.append(np.append(corners, at + np.arange(corners)))
            at += corners
        return np.concatenate(parts)

    @property
    def note(self) -> str:
        """What the picture says of the thickness."""
        return "" if self.factor == 1.0 else f"section drawn {self.factor:g} times as thick"

    def unit(self, unit: str | None) -> str:
        """What the picture says of the unit, if None is given that of the field; "" for numbers."""
        unit = self.field.unit if unit is None else unit
        return "" if unit == "1" else unit

    def colours(self, cmap: Any) -> Any:
        """The colour map that is given, or for None one that fits the field."""
        return cmap or ("RdYlBu_r" if self.field.signed else "viridis")


def cells_of(bodies: list[Any]) -> Array:
    """Quads of bodies on grids, one behind the other, as rows of points, shape (nc, 4)."""
    first = np.cumsum([0] + [b.values.size for b in bodies])
    return np.concatenate([np.zeros((0, 4), dtype=int), *(
        f + b.cells for f, b in zip(first, bodies))])


def outline_points(body: RigidBody, u: Array) -> Array:
    """The corners of a rigid body's outline, shape (n, 3).

    Parameters
    ----------
    body
        A :class:`~skfem_ancf.RigidBody`.
    u
        Displacement of its coordinates, shape (4,).
    """
    return in_space(body.outline_at(u))
