"""States and motions for pyvista: grids with all fields, and views of them."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np

from ..actions.obstacles.outlines import around, outlines
from ..core.archive import output_file
from ..core.errors import (InputError, MissingExtra, require_flag, require_index, require_like,
                           require_options, require_path, require_text)
from ..core.types import StrPath
from ..recovery.fields import FIELDS, DomainValues, find_fields
from ..recovery.grids import CELL_TYPES, grids, in_space
from .animation import pixels
from .matplotlib import colormap
from .scenery import RIGID, WALL, Scenery

#: Pictures that a plotter writes.
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


def _pyvista():
    try:
        import pyvista
    except ImportError:
        raise MissingExtra("pyvista", "view") from None
    return pyvista


def _normal(field, values):
    """The component of a tensor normal to the plane, (n,); NaN where the law does not say it."""
    try:
        strain, cable = values.elastic, not values.beam.has_sections
        if field.name == "strain":
            return values.of_materials(lambda law: 0.5 * (law.thickness_stretch(strain)**2 - 1.0))
        if field.name == "stress":
            return values.of_materials(lambda law: (
                law.nu * values.S[0] * (law.plane == "strain") if cable else
                law.stress_zz(strain)), not cable)
        return values.sigma_zz
    except InputError:
        return np.full(values.n, np.nan)


def _arrays(values, wanted, lenient):
    """Arrays by the names that they have in VTK."""
    out = {}
    for field in wanted:
        try:
            value = field.of(values)
        except InputError:
            if not lenient and not isinstance(values, DomainValues):
                raise
            continue  # a law without a stress normal to the plane
        name = f"{field.name} ({field.frame} frame)" if field.components > 1 and field.frame else (
            field.name)
        if field.components == 2:
            value = in_space(value)
        elif field.components == 3:
            xx, yy, xy = value
            zero = np.zeros(values.n)
            value = np.array([xx, yy, _normal(field, values), xy, zero, zero]).T
        out[name] = np.ascontiguousarray(value)
    return out


class Series:
    """A motion for pyvista: one mesh whose points and fields are those of any instant.

    Parameters
    ----------
    history
        A :class:`~skfem_ancf.dynamics.history.History`.
    **options
        Those of :func:`to_pyvista`.

    Attributes
    ----------
    mesh
        The UnstructuredGrid, or the MultiBlock of several beams, now at instant :attr:`k`.
    t
        Times, shape (nt,).
    k : int
        The instant that the mesh shows.
    """

    def __init__(self, history: Any, **options: Any) -> None:
        self._options = require_options("to_pyvista", options, (
            "fields", "subdivide", "lagrange", "undeformed", "recover"))
        self._history, self.t, self.k = history, history.t, 0
        if not len(history):
            raise InputError("the history has no instants")
        self.mesh = to_pyvista(history.state(0), **options)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<Series of {len(self)} instants, mesh at t = {self.t[self.k]:g}>"

    def update(self, k: int) -> Any:
        """Put the mesh at instant ``k``, in the arrays that it has; returns the mesh."""
        k = require_index("k", k, len(self))
        now = to_pyvista(self._history.state(k), **self._options)
        for block, new in zip(_blocks(self.mesh), _blocks(now)):
            if isinstance(block, _pyvista().PolyData):  # the outline of an obstacle
                block.copy_from(new)
                continue
            block.points[:] = new.points
            for name in new.point_data:
                block.point_data[name][:] = new.point_data[name]
            block.Modified()
        self.k = k
        return self.mesh


def _blocks(mesh):
    return list(mesh) if isinstance(mesh, _pyvista().MultiBlock) else [mesh]


def to_pyvista(state: Any, fields: Any = None, subdivide: tuple[int, int] = (8, 4),
               lagrange: bool = False, undeformed: bool = False, recover: bool = True) -> Any:
    """The body of a state as a grid of pyvista.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`.
    fields
        Names of :data:`skfem_ancf.recovery.fields.FIELDS`, functions or Fields; all of the table by
        default. Tensors have VTK's six components xx, yy, zz, xy, yz, xz; the name of a vector
        or tensor says its frame, as "stress (beam frame)".
    subdivide, lagrange, undeformed, recover
        Those of :func:`skfem_ancf.io.vtu.save_vtu`.

    Returns
    -------
    pyvista.UnstructuredGrid, or pyvista.MultiBlock
        Of one beam, or of several and of the outlines of rigid bodies and obstacles by name.
    """
    pv, found = _pyvista(), grids(state, subdivide, lagrange, recover)
    wanted = list(FIELDS.values()) if fields is None else find_fields(fields)
    undeformed = require_flag("undeformed", undeformed)
    mesh = pv.MultiBlock()
    for grid in found:
        cells = np.insert(grid.cells, 0, grid.cells.shape[1], axis=1).ravel()
        types = np.full(len(grid.cells), CELL_TYPES[grid.kind], np.uint8)
        block = pv.UnstructuredGrid(cells, types, grid.points(undeformed))
        if grid.values is not None:
            block.point_data.update(_arrays(grid.values, wanted, fields is None))
            block.cell_data["element"] = grid.elements
        mesh.append(block, name=grid.name)
    box = around(np.concatenate([grid.points(undeformed)[:, :2] for grid in found]).T)
    for k, wall in enumerate(outlines(state, box)):
        mesh.append(_lines(wall), name=f"obstacle {k}")
    return mesh if len(mesh) > 1 else mesh[0]


def has_display() -> bool:
    """True in a notebook, and where windows can be opened."""
    if "ipykernel" in sys.modules or sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def view(state: Any, field: Any = "eps_yy", plotter: Any = None, *,
         thickness: Any = "auto", undeformed: bool = True, cmap: Any = None, limits: Any = None,
         unit: str | None = None,
         subdivide: tuple[int, int] = (16, 8), recover: bool = True,
         off_screen: bool | None = None, window_size: tuple[int, int] = (1000, 700),
         filename: StrPath | None = None) -> Any:
    """Put a state into a plotter of pyvista, coloured by a field; nothing is shown yet.

    Parameters
    ----------
    state, field, thickness, undeformed, cmap, limits, unit, subdivide, recover
        Those of :func:`skfem_ancf.visuals.matplotlib.plot_state`.
    plotter
        A ``pyvista.Plotter`` to draw in; a new one by default.
    off_screen
        Without a window; by default where there is neither a display nor a notebook.
    window_size
        Width and height in pixels.
    filename
        Write a picture (.png, .jpg, ...); missing folders are made.

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
    name, faces, unit = scenery.field.name, scenery.faces, scenery.unit(unit)
    if undeformed:
        ghost = pv.PolyData(scenery.points(0, True) - [0.0, 0.0, 1e-6], faces)
        plotter.add_mesh(ghost, color="#e2e2e2", lighting=False)
    mesh = pv.PolyData(scenery.points(0), faces)
    mesh.point_data[name] = scenery.values(0)
    plotter.add_mesh(
        mesh, scalars=name, clim=(scenery.low, scenery.high), lighting=False,
        cmap=scenery.colours(cmap), nan_color=RIGID,
        scalar_bar_args=dict(title=f"{name} ({unit})\n" if unit else f"{name}\n",
                             color="black", vertical=False, title_font_size=18,
                             label_font_size=14, n_labels=5, position_x=0.2, width=0.6,
                             height=0.09, fmt="%.3g"))
    if len(scenery.walls[0]):
        plotter.add_mesh(_lines(scenery.walls[0]), color=WALL, line_width=2, lighting=False)
    if scenery.note:
        plotter.add_text(scenery.note, position="upper_left", font_size=9, color="#444444")
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    low, high = scenery.every.min(axis=0), scenery.every.max(axis=0)
    width, height = plotter.window_size
    low[1] -= 0.25 * max(high[1] - low[1], (high[0] - low[0]) * height / width)  # the colour bar
    plotter.view_xy(bounds=(low[0], high[0], low[1], high[1], 0.0, 0.0))
    if path is not None:
        with output_file(path) as temporary:
            plotter.screenshot(str(temporary))
    return plotter


def _lines(walls):
    """Straight pieces (n, 2, 2) as a mesh of pyvista."""
    ends = in_space(walls.reshape(-1, 2).T)
    return _pyvista().PolyData(ends, lines=np.insert(
        np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1).ravel())


def _new_plotter(off_screen, window_size):
    """A plotter, with a window where there is a display."""
    from vtkmodules.vtkCommonCore import vtkLogger

    hidden = not has_display()
    off_screen = hidden if off_screen is None else require_flag("off_screen", off_screen)
    size, said = pixels("window_size", window_size), vtkLogger.GetCurrentVerbosityCutoff()
    if hidden and off_screen:  # that there is no display, which VTK looks for all the same
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        return _pyvista().Plotter(off_screen=off_screen, window_size=size)
    finally:
        vtkLogger.SetStderrVerbosity(said)
