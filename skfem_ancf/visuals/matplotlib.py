"""Plots of the deformed body, coloured by a field; films of a motion, by Pillow and imageio."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..actions.obstacles.contact import touching
from ..actions.obstacles.shapes import AROUND, around
from ..beam import WhichBeam
from ..core import (ArrayLike, InputError, StrPath, output_file, refuse, require_flag,
                    require_integer, require_like, require_module, require_option, require_path,
                    require_positive, require_text, retold)
from ..recovery.fields import FIELDS, unit_of, units_of
from ..recovery.grids import layout
from .scenery import (BODIES, GHOST, INK, LOAD, MUTED, RIGID, WALL, WIDE, Scenery, Sketch, rounded,
                      symbols_of)

#: Largest resolution of a file, in dots per inch.
MAX_DPI = 2400
#: Opacity of the first of several states.
FADED = 0.2
#: Length of the line of the largest pressure of contact relative to the picture.
CONTACT = 0.08
#: Height over width below which the colour bar is below a picture.
FLAT = 0.35


def plot_state(state: Any, field: Any = None, ax: Any = None, *,
               thickness: float | str = "auto", undeformed: bool = True, colorbar: bool = True,
               cmap: Any = None, limits: tuple[float, float] | None = None,
               title: str | None = None, unit: str | None = None,
               subdivide: tuple[int, int] = (16, 8), filename: StrPath | None = None,
               dpi: float = 200, recover: bool = True, scale: float | str = 1.0,
               loads: bool = False, supports: bool = False, fade: bool = False,
               contact: bool = False) -> Any:
    """Draw the deformed body of a state, coloured by a field; returns the Axes.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`, or an object with ``beams`` and ``u_of``; or a list of
        them, drawn over each other with one range of colours.
    field
        By default the stress "S_xx" along the beams, or "displacement" where there is none; the
        name of a scalar field in :data:`skfem_ancf.recovery.fields.FIELDS`, as "eps_yy",
        "von_mises" or "eps_1"; "displacement" for its magnitude; or a function or Field, see
        :mod:`skfem_ancf.recovery.fields`.
    ax
        matplotlib Axes to draw in; a new figure by default, which needs no display.
    thickness
        Magnification of the section, for slender beams, noted in the picture. "auto": the integer
        that makes the section about 1/25 of the picture, less where bends would fold, at least 1;
        1 in scenes with obstacles or members that touch each other.
    undeformed
        Draw the reference configuration of the first state in grey behind.
    colorbar
        Draw a colour bar.
    cmap
        matplotlib colour map; by default one for signed fields, symmetric about zero, and one
        for the magnitude of the displacement.
    limits
        Lowest and highest value of the colours; values beyond them take the last colour, and
        the colour bar gets arrows.
    title
        Title of the picture; the name of the field by default, "" for none.
    unit
        For the colour bar, as "Pa"; by default that of the scene, see :meth:`Scene.units
        <skfem_ancf.Scene.units>`.
    subdivide
        Patches along and across each element.
    filename, dpi
        Write the picture (.png, .pdf, .svg) with this resolution; missing folders are created.
    recover
        Recovered strain and stress if available; False for those of the elements.
    scale
        Magnification of displacements, noted in the picture. "auto": the largest is about 1/10 of
        the body, or true to scale if it is larger.
    loads, supports
        Draw the symbols of :func:`plot_scene`, for several states those of the last, with loads at
        its load factor or time.
    fade
        Of several states draw the earlier ones paler, with the outlines of all on top.
    contact
        Draw the contact of the last state, which is to scale then: a line at each contact point, as
        long as its pressure, with a full dot where friction holds; and the largest pressure.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    >>> state.plot("S_xx").get_title(loc="left")
    'second Piola–Kirchhoff stress $S_{xx}$, beam frame'
    """
    save = page(ax, title, filename, dpi, bbox_inches="tight")
    states = list(state) if isinstance(state, (list, tuple)) else [state]
    refuse(not states, "there is no state to draw: got an empty list")
    for one in states:
        require_like("state", one, "State", "beams", "u_of")
    cmap, unit = colormap(cmap), require_text("unit", unit)
    _require_flags(colorbar=colorbar, loads=loads, supports=supports, fade=fade, contact=contact)
    symbols = symbols_of(states[-1], loads, supports)
    scenery = Scenery(states, field, thickness, undeformed, limits, subdivide, recover, scale)
    drawn, values = scenery.field, scenery.found
    if symbols:
        scenery.margin = WIDE
    if ax is None:
        ax = new_axes(_figsize(scenery.every[:, :2], colorbar))
    _ = scenery.every  # with the reference configuration, which is drawn once
    parts = [[k] for k in range(len(states))] if fade else [range(len(states))]
    for k, part in enumerate(parts, 1):
        image, artists = paint(ax, scenery, part, cmap)
        for artist in artists:
            artist.set_alpha(None if k == len(parts) else FADED + (1.0 - FADED) * k / len(parts))
        scenery.undeformed = False
    if symbols:
        Sketch(ax, scenery.scale * states[-1].u, scenery.points(-1)[:, :2],
               units_of(states[-1])).draw(symbols)
    if contact:
        _draw_contact(ax, scenery, states[-1])
    frame(ax, scenery, bool(symbols))
    dress(ax, (drawn.title or drawn.name) if title is None else title, *scenery.axes, scenery.note)
    if colorbar and image is not None:
        beyond = np.any(values < scenery.low) + 2 * np.any(values > scenery.high)
        colour_bar(ax, image, ("neither", "min", "max", "both")[beyond],
                   scenery.label(drawn.symbol, unit))
    save(ax)
    return ax


def _draw_contact(ax, scenery, state):
    """Pressures and sticking of a state at its contact points, and the largest pressure."""
    from matplotlib.collections import LineCollection

    if (found := touching(state)) is None:
        return
    refuse(scenery.note, "contact is drawn without scale= and thickness=, got {}", scenery.note)
    x, size = found.points, float(np.max(np.ptp(scenery.every[:, :2], axis=0)))
    most = int(np.argmax(found.pressure))
    direction = found.force / np.maximum(np.hypot(*found.force), 1e-300)
    tails = x - CONTACT * size * found.pressure / found.pressure[most] * direction
    ax.add_collection(LineCollection(np.array([x, tails]).transpose(2, 0, 1), colors=LOAD,
                                     linewidths=0.8, zorder=4, gid="contact"))
    for stuck in (False, True):
        ax.plot(*x[:, found.sticking == stuck], "o", ms=3, mec=LOAD, mew=0.8, ls="", zorder=4.5,
                mfc=LOAD if stuck else "white", gid="sticking" if stuck else "contact point")
    unit = unit_of(FIELDS["von_mises"], units_of(state))
    ax.update_datalim(np.hstack([tails, tails - 0.05 * size * direction]).T)
    ax.annotate("p = " + rounded(found.pressure[most], "" if unit == "force / area" else unit),
                tails[:, most], tuple(-4 * direction[:, most]), textcoords="offset points",
                fontsize=8, color=LOAD, gid="contact pressure", ha="center",
                va="top" if direction[1, most] > 0 else "bottom")


def plot_scene(scene: Any, ax: Any = None, *, loads: bool = True, supports: bool = True,
               nodes: bool = False, names: bool = False, thickness: float | str = "auto",
               title: str | None = None, filename: StrPath | None = None, dpi: float = 200) -> Any:
    """Draw a scene before it is solved, with its items; returns the Axes.

    Where there are several materials, each has a colour and an entry of the legend.

    Parameters
    ----------
    scene
        A Scene, or a State of it in the reference configuration.
    loads
        Draw forces as straight arrows and moments as curved ones, with their values, and write
        temperature changes and eigenstrains beside the bodies.
    supports
        Draw supports, joints, motors, springs, foundations, masses, drag and controllers. A clamp
        is a line with hatching, a pin a triangle, a support of one direction a triangle on a line,
        or two lines if the section cannot rotate, a hinge a circle, a weld a square.
    nodes
        Draw the nodes of the meshes.
    names
        Write the names of beams, bodies and domains, or their numbers.
    ax, thickness, title, filename, dpi
        As for :func:`plot_state`.
    """
    save = page(ax, title, filename, dpi, bbox_inches="tight")
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    _require_flags(loads=loads, supports=supports, nodes=nodes, names=names)
    state = scene.state(load=0.0) if hasattr(scene, "state") else scene
    scenery = Scenery([state], "displacement", thickness, True, None, (8, 2), False)
    scenery.margin, inside = WIDE, ax is not None
    texts = {}  # of the legend, which says what materials differ in
    for one in dict.fromkeys(layer.material for b in state.beams for layer in b.across.layers):
        E = "E(x, y)" if callable(one.E) else f"E = {one.E:g}"
        texts[one] = f"{type(one).__name__}\n{E}, ν = {one.nu:g}"
    laws = list(dict.fromkeys(texts.values()))
    colours = dict(zip(laws, BODIES)) if 1 < len(laws) <= len(BODIES) else {}
    if ax is None:
        ax = new_axes(_figsize(scenery.every[:, :2], bool(colours)))
    paint(ax, scenery, [0], None, BODIES[0])
    for body, beam in zip(scenery.frames[0], state.beams if colours else ()):
        X, cells = layout(beam, 8, 2)
        which = np.broadcast_to(beam.across.which(np.mean(X[..., cells], axis=-1)), (
            beam.mesh.nelements, len(cells))).ravel()  # the layer of each quad
        corners = body.reference.reshape(2, -1).T[body.cells]
        for k, layer in enumerate(beam.across.layers):
            colour = colours[texts[layer.material]]
            ax.add_collection(PolyCollection(corners[which == k], facecolor=colour, linewidth=0.3,
                                             edgecolor=colour, zorder=1.2, gid="layer"))
    if colours:
        ax.legend(handles=[Patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=text)
                           for text, colour in colours.items()],
                  fontsize=8, frameon=False, **({} if inside else {
                      "loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}))
    drawn = Sketch(ax, state.u, scenery.points(0)[:, :2], units_of(state))
    drawn.draw(symbols_of(state, loads, supports, True))
    if nodes:
        at = np.hstack([np.zeros((2, 0)), *(beam.mesh.p for beam in state.beams)])
        ax.plot(*at, ".", color=INK, ms=4, zorder=3, gid="node")
    if names:
        drawn.names(scenery.grids[0])
    frame(ax, scenery, True)
    dress(ax, title, *scenery.axes, scenery.note)
    save(ax)
    return ax


def frame(ax: Any, scenery: Scenery, wide: bool) -> None:
    """Set the limits, with obstacles near the body; wide ones have room for symbols."""
    if wide:
        box = around(scenery.every[:, :2].T)
        room = 0.1 * np.max(np.ptp(box, axis=1)) * np.array([[-1.0], [1.0]])
        ax.update_datalim(box.mean(axis=1) + room)
    # obstacles of the last state beside, above or below the bodies
    points, walls = scenery.every[:, :2].T, scenery.walls[-1]
    a, along = walls[:, 0], walls[:, 1] - walls[:, 0]
    off = np.sum((around(points).mean(axis=1) - a) * along, axis=1)
    part = np.clip(off / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
    walls = np.concatenate([walls.reshape(-1, 2), a + part[:, None] * along])
    far, near = ((box[:, 0] <= walls) & (walls <= box[:, 1])
                 for box in (around(points, WIDE), around(points)))
    ax.update_datalim(walls[np.all(far, axis=1) & np.any(near, axis=1)])
    ax.set_aspect("equal")
    ax.margins(AROUND if len(scenery.walls[0]) and not wide else 0.04)
    ax.autoscale_view()


def paint(ax: Any, scenery: Scenery, frames: Sequence[int], cmap: Any,
          fill: str | None = None) -> tuple[Any, list[Any]]:
    """Draw frames over each other; returns the coloured image, or None, and all artists."""
    # With a colour ``fill`` the reference configuration has it and nothing is coloured by the
    # field.
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.tri import Triangulation

    ghosts = scenery.outlines(0, True) if scenery.undeformed else []
    rigid = [cell for k in frames for grid in scenery.rigid[k]
             for cell in (grid.x + grid.u).T[grid.cells]]
    edges = [np.vstack([line, line[:1]]) for k in frames for line in scenery.outlines(k)]
    walls = np.concatenate([scenery.walls[k] for k in frames])
    image, artists = None, []
    if ghosts:
        artists.append(ax.add_collection(PolyCollection(
            ghosts, color=fill or GHOST, linewidth=0.5, zorder=1), autolim=True))
    if rigid:
        artists.append(ax.add_collection(PolyCollection(
            rigid, facecolor=RIGID, edgecolor=INK, linewidth=0.5, zorder=1.5), autolim=True))
    if edges and fill is None:
        points, cells = scenery.beam_points(frames), scenery.cells(frames)
        image = ax.tripcolor(
            Triangulation(*points, np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])),
            np.concatenate([b.values for k in frames for b in scenery.frames[k]]),
            shading="gouraud", cmap=scenery.colours(cmap), vmin=scenery.low, vmax=scenery.high,
            zorder=2)
        artists.append(image)
    if edges:
        artists.append(ax.add_collection(LineCollection(edges, colors=INK, linewidths=0.5,
                                                        zorder=3)))
    if len(walls):
        artists.append(ax.add_collection(LineCollection(
            walls, colors=WALL, linewidths=1.2, zorder=2.5), autolim=False))
    return image, artists


def colour_bar(ax: Any, image: Any, extend: str, label: str) -> None:
    """A colour bar as high as the picture, or below a flat one."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    flat = (y1 - y0) < FLAT * (x1 - x0)
    place: dict[str, Any] = (dict(ax=ax, location="bottom", shrink=0.6, aspect=45, pad=0.06)
                             if flat else dict(cax=ax.inset_axes([1.03, 0.0, 0.03, 1.0])))
    bar = ax.figure.colorbar(image, extend=extend, **place)
    bar.outline.set_visible(False)
    bar.set_label(label, fontsize=8, color=MUTED)
    bar.ax.tick_params(labelsize=8, color=MUTED, labelcolor=INK)
    bar.formatter.set_powerlimits((-3, 4))
    bar.formatter.set_useMathText(True)
    (bar.ax.xaxis if flat else bar.ax.yaxis).get_offset_text().set_size(8)


def _figsize(points, colorbar):
    """Figure size with the aspect ratio of its content."""
    width, height = np.maximum(np.ptp(points, axis=0), 1e-300)
    aspect = np.clip(height / width, 0.15, 1.6)
    area = 5.2 * 5.2 if aspect > 0.5 else 36.0
    w = min(8.0, np.sqrt(area / aspect))
    return w + (1.2 if colorbar else 0.3), max(1.6, w * aspect) + 0.9


def plot_path(path: Any, point: ArrayLike, component: int = 1, beam: WhichBeam = None,
              ax: Any = None, *, title: str | None = None, filename: StrPath | None = None,
              dpi: float = 200) -> Any:
    """Draw the load factor of an equilibrium path against a displacement; returns the Axes.

    Unstable parts are dashed, if known; limit points are marked.

    Parameters
    ----------
    path
        A :class:`~skfem_ancf.results.path.Path`.
    point, component, beam
        The material point (x, y), shape (2,); the component (0 or 1) of its displacement, and its
        beam.
    ax, title, filename, dpi
        As for :func:`plot_state`.
    """
    save, component = page(ax, title, filename, dpi), require_integer("component", component, 0, 1)
    ax = new_axes((5.5, 4.0)) if ax is None else ax
    u, load = path.displacement(point, beam)[:, component], path.load
    color = ax.plot([], [])[0].get_color()
    for k in range(len(u) - 1):  # a piece is drawn as its end is
        dashed = path.stable[k + 1] is False
        ax.plot(u[k:k + 2], load[k:k + 2], color=color, lw=1.6, ls=(0, (3, 2)) if dashed else "-")
    turns = np.nonzero(np.diff(np.sign(np.diff(load))))[0] + 1
    ax.plot(u[turns], load[turns], "o", ms=4, color=color)
    dress(ax, title, f"displacement $u_{'xy'[component]}$", "load factor")
    save(ax)
    return ax


def plot_curve(x: ArrayLike, y: ArrayLike, ax: Any = None, *, xlabel: str = "", ylabel: str = "",
               title: str | None = None, filename: StrPath | None = None, dpi: float = 200,
               **options: Any) -> Any:
    """Draw a curve; returns the Axes.

    Parameters
    ----------
    x, y
        Shape (n,) each.
    ax, title, filename, dpi
        As for :func:`plot_state`.
    xlabel, ylabel
        Labels of the axes.
    **options
        Of matplotlib's ``Axes.plot``.
    """
    save, x, y = page(ax, title, filename, dpi), np.asarray(x), np.asarray(y)
    refuse(x.shape != y.shape, "x and y of a curve are of the same instants, sensors of all steps, "
           "got {} and {}", x.shape, y.shape)
    ax = new_axes((5.5, 4.0)) if ax is None else ax
    ax.plot(x, y, **{"lw": 1.6, **options})
    dress(ax, title, xlabel, ylabel)
    save(ax)
    return ax


def figure_class() -> Any:
    """matplotlib's Figure, which needs no display."""
    return require_module("matplotlib.figure", "plot").Figure


def new_axes(size: tuple[float, float], *shape: int, **options: Any) -> Any:
    """The Axes of a new figure; several for a number of rows and columns."""
    return figure_class()(figsize=size, layout="constrained").subplots(*shape, **options)


def colormap(cmap: Any) -> Any:
    """A colour map by its name, or itself; None for none."""
    from matplotlib import colormaps
    from matplotlib.colors import Colormap

    if cmap is None or isinstance(cmap, Colormap):
        return cmap
    return require_option("colour map", cmap, tuple(colormaps))


def page(ax: Any, title: str | None, filename: Any, dpi: float, **options: Any,
         ) -> Callable[[Any], None]:
    """Check the file, or None, and its resolution, before anything is drawn; returns what writes
    the figure of some Axes."""
    figure_class()
    from matplotlib.backend_bases import FigureCanvasBase

    if ax is not None:
        require_like("ax", ax, "matplotlib Axes", "tripcolor", "figure")
    require_text("title", title)
    dpi = require_positive("dpi", dpi)
    refuse(not 1.0 <= dpi <= MAX_DPI, "dpi must lie between 1 and {}, got {!r}", MAX_DPI, dpi)
    if filename is not None:
        known = sorted(FigureCanvasBase.get_supported_filetypes())
        filename = require_path("filename", filename, [f".{kind}" for kind in known])

    def save(ax: Any) -> None:
        if filename is not None:
            with output_file(filename) as temporary:
                ax.figure.savefig(temporary, dpi=dpi, **options)

    return save


def _require_flags(**flags):
    for name, value in flags.items():
        require_flag(name, value)


def dress(ax: Any, title: str | None, xlabel: str = "x", ylabel: str = "y", note: str = "") -> None:
    """Axes without a box, with small numbers: title, or None, labels, a small note above."""
    if title:
        ax.set_title(title, loc="left", fontsize=10, color=INK, pad=18 if note else 6)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(MUTED)
    ax.tick_params(color=MUTED, labelcolor=INK, labelsize=8)
    ax.set_xlabel(xlabel, fontsize=9, color=INK)
    ax.set_ylabel(ylabel, fontsize=9, color=INK)
    if note:
        ax.annotate(note, (0, 1), (0, 5), va="bottom",
                    xycoords="axes fraction", textcoords="offset points", fontsize=8, color=MUTED)


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
    refuse(not (n := len(history.t)), "the history has no instants")
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
            import imageio.v2

            with imageio.v2.get_writer(temporary, format="FFMPEG", mode="I", fps=fps,
                                       macro_block_size=2) as writer:
                for image in images:
                    height, width, _ = image.shape  # players want even numbers of pixels
                    writer.append_data(np.pad(
                        image, ((0, height % 2), (0, width % 2), (0, 0)), "edge"))
        else:
            _gif(temporary, images, fps, scenery.colours(cmap))
    return path


def pixels(name: str, size: Any) -> tuple[int, int]:
    """Check width and height of a picture in pixels; ``name`` is that of the argument."""
    with retold((TypeError, ValueError), "{} must be two integers from {} to {}, the width and "
                "height in pixels, got {!r}", name, *PIXELS, size):
        width, height = (require_integer(name, k, *PIXELS) for k in size)
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
