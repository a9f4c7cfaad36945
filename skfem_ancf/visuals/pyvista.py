"""States and motions as pyvista grids with all fields, views of them, and an interactive one."""

import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from ..actions.obstacles.contact import may_touch, touching
from ..actions.obstacles.shapes import around, outlines
from ..core import (Array, ArrayLike, ConvergenceError, InputError, StrPath, SupportError,
                    output_file, refuse, require_flag, require_index, require_like, require_module,
                    require_path, require_text, shown)
from ..recovery.fields import FIELDS, find_fields
from ..recovery.grids import CELL_TYPES, COMPONENTS, body_of, facts_of, grids, in_space
from .matplotlib import colormap, pixels
from .scenery import RIGID, WALL, Scenery

#: Pictures that a plotter writes.
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
#: Parts of the height at the top and at the bottom where text, sliders and colours are.
BAR = 0.16


def _pyvista():
    return require_module("pyvista", "view")


class Series:
    """A motion as one pyvista mesh, updated to any instant.

    Parameters
    ----------
    history
        A :class:`~skfem_ancf.dynamics.history.History`.
    fields, subdivide, lagrange, undeformed, recover
        As for :func:`to_pyvista`.

    Attributes
    ----------
    mesh
        The UnstructuredGrid, or the MultiBlock of several beams, at instant :attr:`k`.
    t
        Times, shape (nt,).
    k : int
        The current instant.
    """

    def __init__(self, history: Any, fields: Any = None, subdivide: tuple[int, int] = (8, 4),
                 lagrange: bool = False, undeformed: bool = False, recover: bool = True) -> None:
        self._options = fields, subdivide, lagrange, undeformed, recover
        self._history, self.t, self.k = history, history.t, 0
        refuse(not len(history), "the history has no instants")
        self.mesh = to_pyvista(history.state(0), *self._options)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<Series of {len(self)} instants, mesh at t = {self.t[self.k]:g}>"

    def update(self, k: int) -> Any:
        """Update the mesh in place to instant ``k``; returns it."""
        k = require_index("k", k, len(self))
        to_pyvista(self._history.state(k), *self._options, out=self.mesh)
        self.k = k
        return self.mesh


def to_pyvista(state: Any, fields: Any = None, subdivide: tuple[int, int] = (8, 4),
               lagrange: bool = False, undeformed: bool = False, recover: bool = True,
               out: Any = None) -> Any:
    """The body of a state as a pyvista grid.

    Raises InputError if ``out`` has other members.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`.
    fields
        Names of :data:`skfem_ancf.recovery.fields.FIELDS`, functions or Fields; all of the table by
        default. Arrays have the names and components of files.
    subdivide, lagrange, undeformed, recover
        As for :func:`skfem_ancf.io.save_vtu`.
    out
        The result of this function for a state of the same scene, which is updated in place and
        returned.

    Returns
    -------
    pyvista.UnstructuredGrid, or pyvista.MultiBlock
        Of one beam, or of several and of the outlines of rigid bodies and obstacles by name; of a
        scene with contact "contact" has the contact points.
    """
    pv, found = _pyvista(), grids(state, subdivide, lagrange, recover)
    wanted = list(FIELDS.values()) if fields is None else find_fields(fields)
    undeformed, facts = require_flag("undeformed", undeformed), facts_of(state)
    box = around(np.concatenate([grid.points(undeformed)[:, :2] for grid in found]).T)
    walls = outlines(state, box)
    names = [grid.name for grid in found] + [f"obstacle {k}" for k in range(len(walls))]
    names += ["contact"] * may_touch(state)
    blocks = [None] * len(names)
    if out is not None:
        several = isinstance(out, pv.MultiBlock)
        if not several and not isinstance(out, pv.UnstructuredGrid):
            raise InputError(f"out must be a mesh that to_pyvista returned, got {shown(out)}")
        blocks, known = (list(out), list(out.keys())) if several else ([out], names[:1])
        refuse(known != names, "out must be of the same scene: it has {}, not {}", known, names)
    bodies = [_fill(block, grid, body_of(grid, wanted, undeformed, fields is None), facts)
              for block, grid in zip(blocks, found)]
    others = [_lines(wall) for wall in walls]
    if may_touch(state):
        touch = None if undeformed else touching(state)
        others.append(pv.PolyData() if touch is None else pv.PolyData(in_space(touch.points)))
        for name, values in ({} if touch is None else touch.arrays).items():
            others[-1].point_data[name] = values
    for block, other in zip(blocks[len(found):], others):
        bodies.append(other)
        if block is not None:
            block.copy_from(other)
    if out is None:
        out = pv.MultiBlock(dict(zip(names, bodies))) if len(names) > 1 else bodies[0]
    return out


def _fill(block, grid, body, facts):
    """Update a block for a body, or make a new one for None."""
    if block is None or len(block.points) != len(body.points) or not np.array_equal(
            block.cell_connectivity, body.cells.ravel()):
        cells = np.insert(body.cells, 0, body.cells.shape[1], axis=1).ravel()
        types = np.full(len(body.cells), CELL_TYPES[grid.kind], np.uint8)
        new = _pyvista().UnstructuredGrid(cells, types, body.points)
        new.cell_data["element"] = grid.elements
        if block is not None:
            block.copy_from(new)
        block = new if block is None else block
    block.points[:] = body.points
    for name in [x for x in block.point_data if x in FIELDS and x not in body.data]:
        del block.point_data[name]  # of another state
    for name, values in body.data.items():
        if name in block.point_data:
            block.point_data[name][:] = values
            continue
        block.point_data[name] = values
        array = block.GetPointData().GetArray(name)
        for k, component in enumerate(COMPONENTS.get(array.GetNumberOfComponents(), ())):
            array.SetComponentName(k, component)
    block.field_data.update(facts)
    block.Modified()
    return block


def view(state: Any, field: Any = None, plotter: Any = None, *,
         thickness: Any = "auto", undeformed: bool = True, cmap: Any = None, limits: Any = None,
         unit: str | None = None,
         subdivide: tuple[int, int] = (16, 8), recover: bool = True,
         off_screen: bool | None = None, window_size: tuple[int, int] = (1000, 700),
         filename: StrPath | None = None) -> Any:
    """Add a state to a pyvista plotter, coloured by a field, without showing it.

    Parameters
    ----------
    state, field, thickness, undeformed, cmap, limits, unit, subdivide, recover
        As for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
    plotter
        A ``pyvista.Plotter`` to draw in; a new one by default.
    off_screen
        Without a window; by default if there is neither a display nor a notebook.
    window_size
        Width and height in pixels.
    filename
        Write a picture (.png, .jpg, ...); missing folders are created.

    Returns
    -------
    pyvista.Plotter
        Call its ``show()``, or ``screenshot(...)``.
    """
    pv = _pyvista()
    require_like("state", state, "State", "beams", "u_of")
    path = None if filename is None else require_path("filename", filename, PICTURES)
    if plotter is not None:
        require_like("plotter", plotter, "pyvista Plotter", "add_mesh", "screenshot")
    cmap, unit = colormap(cmap), require_text("unit", unit)
    scenery = Scenery([state], field, thickness, undeformed, limits, subdivide, recover)
    if plotter is None:
        plotter = _new_plotter(off_screen if path is None else True, window_size)
    name, faces = scenery.field.name, scenery.faces
    if undeformed:
        ghost = pv.PolyData(scenery.points(0, True) - [0.0, 0.0, 1e-6], faces)
        plotter.add_mesh(ghost, color="#e2e2e2", lighting=False)
    mesh = pv.PolyData(scenery.points(0), faces)
    mesh.point_data[name] = scenery.values(0)
    plotter.add_mesh(
        mesh, scalars=name, clim=(scenery.low, scenery.high), lighting=False,
        cmap=scenery.colours(cmap), nan_color=RIGID,
        scalar_bar_args=dict(title=scenery.label(name, unit) + "\n",
                             color="black", vertical=False, title_font_size=18,
                             label_font_size=14, n_labels=5, position_x=0.2, width=0.6,
                             height=0.09, fmt="%.3g"))
    if len(scenery.walls[0]):
        plotter.add_mesh(_lines(scenery.walls[0]), color=WALL, line_width=2, lighting=False)
    title = f"load {state.load:g}" if state.t is None else f"t = {state.t:g}"
    plotter.add_text("\n".join(filter(None, (title, scenery.note))),
                     position="upper_left", font_size=9, color="#444444", name="title")
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    look(plotter, scenery.every.min(axis=0), scenery.every.max(axis=0))
    if path is not None:
        with output_file(path) as temporary:
            plotter.screenshot(str(temporary))
    return plotter


def look(plotter: Any, low: Array, high: Array, margin: float = 0.04) -> None:
    """Fill the picture with a box, between parts of its height for text and colours.

    Parameters
    ----------
    plotter
        A ``pyvista.Plotter``.
    low, high
        Opposite corners of the box, shape (2,) or (3,).
    margin
        Added on each side, relative to the larger side of the box.
    """
    around = margin * float(np.max(high - low))
    low, high = low - around, high + around
    width, height = plotter.window_size
    plotter.view_xy(bounds=(low[0], high[0], low[1], high[1], 0.0, 0.0))
    plotter.camera.parallel_scale = 0.5 * max(
        (high[1] - low[1]) / (1.0 - 2.0 * BAR), (high[0] - low[0]) * height / width)


def _lines(walls):
    ends = in_space(walls.reshape(-1, 2).T)
    return _pyvista().PolyData(ends, lines=np.insert(
        np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1).ravel())


def _new_plotter(off_screen, window_size):
    """A plotter, with a window if there is a display."""
    from vtkmodules.vtkCommonCore import vtkLogger

    hidden = not ("ipykernel" in sys.modules or sys.platform in ("win32", "darwin")
                  or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    off_screen = hidden if off_screen is None else require_flag("off_screen", off_screen)
    size, said = pixels("window_size", window_size), vtkLogger.GetCurrentVerbosityCutoff()
    if hidden and off_screen:  # VTK warns of a missing display
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        return _pyvista().Plotter(off_screen=off_screen, window_size=size)
    finally:
        vtkLogger.SetStderrVerbosity(said)


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
        """Solve for a number or a force, and update the body; returns the State. Without an
        equilibrium the body does not move, and the picture shows a message."""
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
        refuse(size == 0.0, "the force must not be zero: it determines the scale of the arrow")
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
