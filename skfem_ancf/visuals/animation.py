"""Films of a motion: .gif by Pillow, .mp4 by imageio."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..core.archive import output_file
from ..core import (InputError, StrPath, require_flag, require_integer, require_like,
                    require_module, require_path, require_positive, require_text, shown)
from .matplotlib import FLAT, colormap, colour_bar, dress, figure_class, paint
from .scenery import INK, MUTED, Scenery

SUFFIXES = (".gif", ".mp4")

#: Least and largest frames per second, width and height of a picture.
FPS, PIXELS = (0.01, 1000), (100, 10000)

#: Frames of a film where their number is not given, at most; dots per inch.
FRAMES, DPI = 100, 100


def animate(history: Any, filename: StrPath, field: Any = None, *,
            frames: int | None = None, fps: float | None = None,
            thickness: Any = "auto", undeformed: bool = True, cmap: Any = None,
            limits: Any = None, unit: str | None = None, subdivide: tuple[int, int] = (8, 4),
            recover: bool = True, size: tuple[int, int] | None = None,
            scale: float | str = 1.0) -> Path:
    """Write a film of a motion, coloured by a field; returns its file.

    All frames have the same range of colours and the same thickness factor.

    Parameters
    ----------
    history
        A :class:`~skfem_ancf.dynamics.history.History`.
    filename
        Ends with .gif, or .mp4 (which needs imageio and imageio-ffmpeg); missing folders are
        created.
    frames
        Number of instants, evenly chosen; all by default, up to 100.
    fps
        Frames per second; by default in real time, between 5 and 50.
    field, thickness, undeformed, cmap, limits, unit, subdivide, recover
        As for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
    size
        Width and height of the film in pixels, shape (2,); by default 800 wide, and as high as what
        moves needs.
    scale
        Magnification of displacements, as for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
    """
    require_like("history", history, "History", "states", "t")
    path, undeformed = require_path("filename", filename, SUFFIXES), require_flag(
        "undeformed", undeformed)
    film = path.suffix.lower() == ".mp4"
    for module in ("imageio", "imageio_ffmpeg") if film else ():
        require_module(module, "view")
    if not (n := len(history.t)):
        raise InputError("the history has no instants")
    frames = FRAMES if frames is None else require_integer("frames", frames, 1)
    chosen = np.unique(np.round(np.linspace(0, n - 1, min(frames, n))).astype(int))
    figure_class()
    cmap, unit = colormap(cmap), require_text("unit", unit)
    t = history.t[chosen]
    if fps is None:
        span = float(t[-1] - t[0])
        fps = float(np.clip((len(t) - 1) / span, 5.0, 50.0)) if span > 0 else 5.0
    elif not FPS[0] <= require_positive("fps", fps) <= FPS[1]:
        raise InputError(f"fps must lie between {FPS[0]} and {FPS[1]}, got {fps!r}")
    size = size if size is None else pixels("size", size)
    scenery = Scenery(list(history.states(chosen)), field, thickness, undeformed, limits,
                      subdivide, recover, scale)
    images = _frames(scenery, t, size, cmap, unit)
    with output_file(path) as temporary:
        if film:
            _mp4(temporary, images, fps)
        else:
            _gif(temporary, images, fps, scenery.colours(cmap))
    return path


def pixels(name: str, size: Any) -> tuple[int, int]:
    """Check width and height of a picture in pixels; ``name`` is that of the argument."""
    try:
        width, height = (require_integer(name, k, *PIXELS) for k in size)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be two integers from {PIXELS[0]} to {PIXELS[1]}, the width "
                         f"and height in pixels, got {shown(size)}") from None
    return width, height


def _frames(scenery: Scenery, t: Any, size: Any, cmap: Any, unit: str | None) -> Iterator[Any]:
    """Pictures, shape (height, width, 3), one at a time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    (x0, y0, _), (x1, y1, _) = scenery.every.min(axis=0), scenery.every.max(axis=0)
    if size is None:  # no white bands; a flat picture has its colours below
        aspect = (y1 - y0 + 0.08 * (x1 - x0)) / max(x1 - x0, 1e-300)
        wide = 680 if aspect < FLAT else 620
        size = 800, int(np.clip(wide * aspect + (140 if aspect < FLAT else 105), 200, 900)) // 2 * 2
    figure = figure_class()(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, layout="constrained")
    canvas, ax, field = FigureCanvasAgg(figure), figure.add_subplot(), scenery.field
    margin = 0.04 * max(x1 - x0, y1 - y0)
    ax.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin), aspect="equal")
    dress(ax, None, *scenery.axes)
    image, artists = paint(ax, scenery, [0], cmap)
    if image is not None:
        colour_bar(ax, image, "neither", scenery.label(field.symbol, unit))
    ax.set_title(scenery.note, loc="left", fontsize=8, color=MUTED)
    clock = ax.set_title(" ", loc="right", fontsize=8, color=INK)
    canvas.draw()
    figure.set_layout_engine("none")
    for k, time in enumerate(t):
        for artist in artists:
            artist.remove()
        _, artists = paint(ax, scenery, [k], cmap)
        clock.set_text(f"t = {time:.4g}")
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _gif(path, images, fps, cmap):
    """Write with 256 colours: those of the colour map, and greys."""
    from matplotlib import colormaps

    Image = require_module("PIL.Image", "plot", "pillow")
    shades = (colormaps[cmap] if isinstance(cmap, str) else cmap)(np.linspace(0, 1, 216))
    greys = np.repeat(np.linspace(0, 1, 40)[:, None], 3, axis=1)
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.round(255 * np.concatenate([shades[:, :3], greys])).astype(
        np.uint8).tobytes())
    frames = [Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE)
              for image in images]
    frames[0].save(path, format="GIF", save_all=True, append_images=frames[1:], loop=0,
                   duration=round(1000 / fps))


def _mp4(path, images, fps):
    import imageio.v2

    with imageio.v2.get_writer(path, format="FFMPEG", mode="I", fps=fps,
                               macro_block_size=2) as writer:
        for image in images:
            height, width, _ = image.shape  # players want even numbers of pixels
            writer.append_data(np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), "edge"))
