"""Films of a motion: .gif by Pillow, .mp4 by imageio."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import (FileError, InputError, MissingExtra, require_flag, require_integer,
                           require_like, require_option, require_path, require_positive,
                           require_text)
from ..core.archive import output_file
from .matplotlib import colormap, figure_class, triangulation
from .pyvista import dressed, lines_of, new_plotter, pixels
from .scenery import GHOST, INK, MUTED, RIGID, WALL, Scenery

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from ..core.types import Array, StrPath

SUFFIXES = (".gif", ".mp4")
BACKENDS = ("pyvista", "matplotlib")

#: Frames per second, least and most.
FPS = (0.01, 1000)

#: Frames of a film where their number is not given, at most.
FRAMES = 100

#: Width or height up to which a film is drawn in twice the resolution.
LARGEST = 4096


def animate(history: Any, filename: StrPath, field: Any = "eps_yy", *,
            frames: int | None = None, fps: float | None = None, backend: str | None = None,
            thickness: Any = "auto", undeformed: bool = True, cmap: Any = None,
            limits: Any = None, unit: str | None = None, subdivide: tuple[int, int] = (8, 4),
            recover: bool = True, size: tuple[int, int] = (800, 600)) -> Path:
    """Write a film of a motion, coloured by a field.

    The colours have one range and the section one factor of thickness in all frames.

    Parameters
    ----------
    history
        A :class:`~skfem_ancf.dynamics.history.History`.
    filename
        Ends with .gif, or .mp4 (which needs imageio and imageio-ffmpeg); missing folders are made
        before anything is drawn.
    field
        As for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
    frames
        How many instants, evenly chosen; all by default, up to 100.
    fps
        Frames per second; by default as fast as the motion, between 5 and 50.
    backend
        "pyvista" or "matplotlib"; by default the first that is installed.
    thickness, undeformed, cmap, limits, subdivide, recover
        Those of :func:`skfem_ancf.visuals.matplotlib.plot_state`.
    unit
        For the colour bar.
    size
        Width and height of the film in pixels, shape (2,).

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        If the file name ends otherwise, or the history has no instants.
    MissingExtra
        If what is needed is not installed.
    """
    require_like("history", history, "History", "states", "t")
    path, undeformed = _file(filename), require_flag("undeformed", undeformed)
    chosen = _chosen(history, frames)
    backend = _backend(backend)
    cmap = colormap(cmap)
    fps = _fps(history, chosen, fps)
    size, unit = pixels("size", size), require_text("unit", unit)
    scenery = Scenery(list(history.states(chosen)), field, thickness, limits, subdivide,
                      recover)
    draw = _by_pyvista if backend == "pyvista" else _by_matplotlib
    images = draw(scenery, history.t[chosen], size, undeformed, cmap, unit)
    with output_file(path) as temporary:
        (_gif if path.suffix.lower() == ".gif" else _mp4)(
            temporary, images, fps, _colours(scenery, cmap))
    return path


def _file(filename):
    path = require_path("filename", filename, SUFFIXES)
    if path.suffix.lower() == ".mp4":
        for module in ("imageio", "imageio_ffmpeg"):
            try:
                __import__(module)
            except ImportError:
                raise MissingExtra(module, "view") from None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot make the folder {str(path.parent)!r}: {error}") from error
    return path


def _chosen(history, frames):
    n = len(history.t)
    if n == 0:
        raise InputError("the history has no instants")
    frames = min(n, FRAMES) if frames is None else require_integer("frames", frames, 1)
    return np.unique(np.round(np.linspace(0, n - 1, min(frames, n))).astype(int))


def _backend(backend):
    if backend is not None:
        return require_option("backend", backend, BACKENDS)
    for name in BACKENDS:
        try:
            __import__(name)
        except ImportError:
            continue
        return name
    raise MissingExtra("matplotlib", "plot")


def _fps(history, chosen, fps):
    if fps is not None:
        fps = require_positive("fps", fps)
        if not FPS[0] <= fps <= FPS[1]:
            raise InputError(f"fps must lie between {FPS[0]} and {FPS[1]}, got {fps!r}")
        return fps
    span = float(history.t[chosen[-1]] - history.t[chosen[0]])
    return float(np.clip((len(chosen) - 1) / span, 5.0, 50.0)) if span > 0 else 5.0


def _by_pyvista(scenery: Any, t: Array, size: Any, undeformed: bool, cmap: Any,
                unit: str | None) -> Iterator[Array]:
    try:
        import pyvista
    except ImportError:
        raise MissingExtra("pyvista", "view") from None
    # drawn finer and averaged: without a graphics card half the time of VTK's smooth edges
    fine = 2 if max(size) <= LARGEST else 1
    plotter = new_plotter(pyvista, True, (fine * size[0], fine * size[1]))
    try:
        if fine > 1:
            plotter.disable_anti_aliasing()
            plotter.render_window.SetDPI(fine * plotter.render_window.GetDPI())
        mesh, wall = dressed(scenery, plotter, cmap, undeformed, unit)
        # at a point: text in a corner is fitted to the window in each frame
        clock = plotter.add_text("", position=(0.985, 0.955), viewport=True, font_size=9,
                                 color="#444444")
        clock.GetTextProperty().SetJustificationToRight()
        for k, time in enumerate(t):
            mesh.points = scenery.points(k)
            if wall is not None:
                wall.copy_from(lines_of(scenery.walls[k]))
            mesh.point_data[scenery.field.name][:] = scenery.values(k)
            clock.SetInput(f"t = {time:.4g}")
            if k == 0:
                plotter.show(auto_close=False, interactive=False)
            plotter.render()
            yield _picture_of(plotter, fine)
    finally:
        plotter.close()


def _picture_of(plotter, fine):
    """What a plotter has drawn, squares of ``fine`` pixels averaged, (height, width, 3)."""
    import pyvista
    from PIL import Image
    from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

    (width, height), pixels = plotter.window_size, vtkUnsignedCharArray()
    plotter.render_window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
    # VTK begins with the lowest row
    image = Image.frombuffer("RGB", (width, height), memoryview(pyvista.convert_array(pixels)),
                             "raw", "RGB", 0, -1)
    return np.asarray(image.reduce(fine) if fine > 1 else image)


def _by_matplotlib(scenery: Any, t: Array, size: Any, undeformed: bool, cmap: Any,
                   unit: str | None) -> Iterator[Array]:
    Figure = figure_class()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import ListedColormap

    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, layout="constrained")
    canvas, ax, field = FigureCanvasAgg(figure), figure.add_subplot(), scenery.field
    cells = scenery.cells
    low, high = scenery.every.min(axis=0), scenery.every.max(axis=0)
    margin = 0.04 * np.max(high - low)
    if undeformed:
        x = scenery.points(0, True)
        ax.tripcolor(triangulation(x[:, :2].T, cells), np.zeros(len(x)),
                     cmap=ListedColormap([GHOST]), shading="gouraud")
    x = scenery.points(0)
    image = ax.tripcolor(triangulation(x[:, :2].T, cells), scenery.values(0),
                         shading="gouraud", vmin=scenery.low, vmax=scenery.high,
                         cmap=scenery.colours(cmap))
    rigid = ax.add_collection(PolyCollection(scenery.outlines(0), facecolor=RIGID, edgecolor=INK))
    walls = ax.add_collection(LineCollection(scenery.walls[0], colors=WALL, linewidths=1.2))
    ax.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    ax.set_aspect("equal")
    unit = scenery.unit(unit)
    bar = figure.colorbar(image, ax=ax, location="bottom", shrink=0.6, aspect=45)
    bar.set_label((field.title or field.name) + (f" ({unit})" if unit else ""), fontsize=8)
    bar.formatter.set_powerlimits((-3, 4))
    ax.set_title(scenery.note, loc="left", fontsize=8, color=MUTED)
    clock = ax.set_title("", loc="right", fontsize=8, color=INK)
    canvas.draw()
    figure.set_layout_engine("none")
    for k, time in enumerate(t):
        x = scenery.points(k)
        image._triangulation.x, image._triangulation.y = x[:, 0], x[:, 1]
        image.set_array(scenery.values(k))
        rigid.set_verts(scenery.outlines(k))
        walls.set_segments(scenery.walls[k])
        clock.set_text(f"t = {time:.4g}")
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _gif(path, images, fps, colours):
    try:
        from PIL import Image
    except ImportError:
        raise MissingExtra("pillow", "plot") from None
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours)
    frames = [Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE)
              for image in images]
    frames[0].save(path, format="GIF", save_all=True, append_images=frames[1:], loop=0,
                   duration=round(1000 / fps))


def _colours(scenery, cmap):
    """256 colours as bytes: those of the colour map, and greys."""
    from matplotlib import colormaps

    cmap = scenery.colours(cmap)
    shades = (colormaps[cmap] if isinstance(cmap, str) else cmap)(np.linspace(0, 1, 216))
    greys = np.repeat(np.linspace(0, 1, 40)[:, None], 3, axis=1)
    return np.round(255 * np.concatenate([shades[:, :3], greys])).astype(np.uint8).tobytes()


def _mp4(path, images, fps, _):
    import imageio.v2

    with imageio.v2.get_writer(path, format="FFMPEG", mode="I", fps=fps,
                               macro_block_size=2) as writer:
        for image in images:
            height, width, _ = image.shape  # players want even numbers of pixels
            writer.append_data(np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), "edge"))
