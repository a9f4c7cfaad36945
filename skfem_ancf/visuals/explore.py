"""An interactive view: the body follows a slider, or a force whose arrow is dragged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core import (Array, ArrayLike, ConvergenceError, InputError, SupportError, require_finite,
                    require_finite_scalar, shown)
from .pyvista import look, view
from .scenery import Scenery

#: Points along and across an element.
SUBDIVIDE = (8, 4)
#: Length of the arrow of the first force, and margin of the picture, relative to the body.
ARROW, MARGIN = 0.18, 0.06
#: Colour of arrows.
LOAD = "#a50026"


class Explorer:
    """A pyvista plotter whose body follows a number or a force, see :meth:`Scene.explore
    <skfem_ancf.Scene.explore>`.

    Parameters
    ----------
    solve
        A function of a value, and of a State to start from or None, that returns a State.
    values
        Their states determine the fixed range of colours and of the picture; the last is shown.
    field, limits, thickness, off_screen, window_size
        As for :func:`skfem_ancf.visuals.pyvista.view`.

    Attributes
    ----------
    plotter : pyvista.Plotter
        Its ``show()`` opens a window or a notebook cell, ``screenshot()`` writes a file.
    mesh : pyvista.PolyData
        The body; its points and colours change in place.
    value
        The current number or force (2,).
    state : State
        The current solution.
    widget
        The slider or the handle of the arrow, a VTK widget.
    """

    def __init__(self, solve: Callable[[Any, Any], Any], values: Any, *, field: Any = None,
                 limits: Any = None, thickness: Any = "auto", off_screen: bool | None = None,
                 window_size: tuple[int, int] = (1000, 700)) -> None:
        states: list[Any] = []
        for value in values:
            states.append(solve(value, states[-1] if states else None))
        self._solve, self.value, self.state = solve, values[-1], states[-1]
        self.widget: Any = None
        self._follow: Callable[[], None] | None = None
        every = Scenery(states, field, thickness, True, limits, SUBDIVIDE, True)
        self._field, self._limits, self._factor = field, (every.low, every.high), every.factor
        self.plotter = view(self.state, field, thickness=every.factor, limits=self._limits,
                            subdivide=SUBDIVIDE, off_screen=off_screen, window_size=window_size)
        self._name = every.field.name
        self.mesh = next(m for m in self.plotter.meshes if self._name in m.point_data)
        self._low, self._high = every.every.min(axis=0), every.every.max(axis=0)
        self._size = float(max(self._high - self._low))
        look(self.plotter, self._low, self._high, MARGIN)

    def __repr__(self) -> str:
        return f"<Explorer at {shown(self.value)}: {self.state!r}>"

    def set(self, value: Any) -> Any:
        """Solve for a number or a force, and update the body; returns the State.

        Without an equilibrium the body does not move, and the picture shows a message.
        """
        try:
            state = self._solve(value, self.state)
        except (ConvergenceError, SupportError):
            self.plotter.add_text(f"no equilibrium found at {shown(value)}", name="failed",
                                  position="lower_left", font_size=9, color=LOAD)
            return self.state
        if "failed" in self.plotter.actors:
            self.plotter.remove_actor("failed")
        now = Scenery([state], self._field, self._factor, False, self._limits, SUBDIVIDE, True)
        if now.points(0).shape != self.mesh.points.shape:
            raise InputError("the meshes of the scene must stay the same while it is explored")
        self.mesh.points[:] = now.points(0)
        self.mesh.point_data[self._name][:] = now.values(0)
        self.mesh.Modified()
        self.value, self.state = value, state
        if self._follow is not None:
            self._follow()
        self.plotter.render()
        return state

    def slider(self, low: float, high: float, title: str = "") -> None:
        """Add the slider for :meth:`set`.

        Parameters
        ----------
        low, high, title
            Its ends and title.
        """
        self.widget = self.plotter.add_slider_widget(
            lambda x: None if x == self.value else self.set(x), (low, high), value=self.value,
            title=title, interaction_event="always", color="black", fmt="%.4g",
            pointa=(0.55, 0.92), pointb=(0.95, 0.92), title_height=0.025, slider_width=0.03,
            tube_width=0.005)
        self._follow = lambda: self.widget.GetRepresentation().SetValue(self.value)

    def arrow(self, place: Callable[[Any], Array]) -> None:
        """Add the arrow of the force, with a handle at its tip.

        Parameters
        ----------
        place
            A function of the State that returns the position of the force, shape (2,).
        """
        import pyvista

        size = float(np.hypot(*self.value))
        if size == 0.0:
            raise InputError("the force must not be zero: it determines the scale of the arrow")
        scale, drawn = ARROW * self._size / size, pyvista.PolyData()

        def dragged(tip: ArrayLike, widget: Any) -> None:
            self.set((np.array(tip)[:2] - place(self.state)) / scale)

        def draw() -> None:
            start, arrow = place(self.state), scale * np.array(self.value)
            length = float(np.hypot(*arrow))
            drawn.copy_from(pyvista.Arrow(
                start=(*start, 0.0), scale=max(length, 1e-9 * scale), shaft_radius=0.02,
                tip_radius=0.07, direction=(*arrow, 0.0) if length else (1.0, 0.0, 0.0)))
            handle.SetCenter(*start + arrow, 0.0)

        self.widget = handle = self.plotter.add_sphere_widget(
            dragged, center=(*place(self.state) + scale * np.array(self.value), 0.0),
            radius=0.02 * self._size, color=LOAD, pass_widget=True, test_callback=False,
            interaction_event="always")
        self._follow = draw
        draw()
        look(self.plotter, self._low, self._high, MARGIN + ARROW)
        self.plotter.add_mesh(drawn, color=LOAD, lighting=False)


def explorer(solve: Callable[[Any, Any], Any], interval: Any, value: Any, title: str,
             place: Callable[[Any], Array] | None, picture: dict[str, Any]) -> Explorer:
    """An Explorer with its slider, or with its arrow if a place is given. ``solve`` and ``picture``
    are for :class:`Explorer`, ``place`` for :meth:`Explorer.arrow`; ``interval, value, title`` are
    ends, start and title of the slider, or ``value`` is the initial force (2,)."""
    if place is not None:
        made = Explorer(solve, [require_finite("the force", value, (2,))], **picture)
        made.arrow(place)
        return made
    low, high = require_finite("interval", interval, (2,))
    value = high if value is None else require_finite_scalar("value", value)
    if not low <= value <= high or low == high:
        raise InputError(f"interval must be two numbers that grow, with value between, got "
                         f"{shown(interval)} and {value:g}")
    made = Explorer(solve, [low, high, value], **picture)
    made.slider(low, high, title)
    return made
