"""Pictures of the deformed body, coloured by a field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import (InputError, MissingExtra, require_finite_scalar, require_flag,
                      require_integer, require_like, require_option, require_path, require_positive,
                      require_text, shown, taught)
from ..fields import DRAWN, Field, find_field, values_on_grid
from ..io.vtu import _subdivision, layout, replacing
from ..obstacles.pictures import AROUND, around, outlines

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..path import Path
    from ..types import StrPath, WhichBeam


#: ``thickness="auto"`` draws a section at least this part of the picture high.
READABLE = 1 / 25

#: Largest resolution of a file, in dots per inch.
MAX_DPI = 2400

_EXTEND = {(False, False): "neither", (True, False): "min", (False, True): "max",
           (True, True): "both"}
_INK, _MUTED, _GHOST, _RIGID = "#222222", "#666666", "#d9d9d9", "#bbbbbb"
_WALL = "#7a5230"


@taught
def plot_state(state: Any, field: str = "eps_yy", ax: Any = None, *,
               thickness: float | str = "auto", undeformed: bool = True, colorbar: bool = True,
               cmap: Any = None, limits: tuple[float, float] | None = None,
               title: str | None = None, unit: str | None = None,
               subdivide: tuple[int, int] = (16, 8), filename: StrPath | None = None,
               dpi: float = 200, recover: bool = True) -> Any:
    """Draw the deformed body of a state, coloured by a field.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`, or anything with its ``beams`` and ``u_of``; or a list
        of them, drawn over each other with one range of colours and the stress-free body of the
        first.
    field
        A name of :data:`skfem_ancf.fields.FIELDS` with one component, as "S_xx", "von_mises" or
        "eps_1"; "displacement" for its magnitude; or a function or Field of your own, see
        :mod:`skfem_ancf.fields`.
    ax
        matplotlib Axes to draw in; a new figure by default, which needs no display.
    thickness
        Factor by which the section is drawn thicker than it is, for slender beams; the picture
        says so. Colours stay those of the material points. "auto": the whole number that makes
        the section about 1/25 of the picture, less where bends would fold, at least 1.
    undeformed
        Draw the stress-free body in grey behind.
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
        For the colour bar, as "Pa".
    subdivide
        Patches along and across each element.
    filename
        Write the picture here too (.png, .pdf, .svg); missing folders are made.
    dpi
        Resolution of the file.
    recover
        Recovered strain and stress (:mod:`skfem_ancf.recovery`) where the state has them; False for
        those of the elements at the points.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    NameUnknown
        If the field is not known; the message lists the known ones.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    >>> ax = state.plot("S_xx")
    >>> ax.get_title(loc="left")
    'second Piola–Kirchhoff stress $S_{xx}$, beam frame'
    """
    Figure = _figure_class()
    from matplotlib.collections import LineCollection, PolyCollection

    drawn, states = find_field(field, DRAWN), _states(state)
    undeformed = require_flag("undeformed", undeformed)
    recover = require_flag("recover", recover)
    colorbar, cmap = require_flag("colorbar", colorbar), _colormap(cmap)
    filename, dpi = _page(ax, title, filename, dpi)
    unit = require_text("unit", unit)
    m, n = _subdivision(subdivide)
    bodies = [_Body(s, beam, drawn, m, n, recover) for s in states for beam in s.beams]
    factor = _thickness(thickness, bodies)
    ghosts = [line for b in bodies[:len(states[0].beams)] if undeformed
              for line in b.outline(b.reference, factor)]
    edges = [line for b in bodies for line in b.outline(b.deformed, factor)]
    rigid = [b.outline_at(s.u_of(b)).T for s in states for b in getattr(s, "bodies", ())]
    values = np.concatenate([np.zeros(0), *(b.values.ravel() for b in bodies)])
    low, high = _limits(limits, values, drawn)

    if ax is None:
        ax = Figure(figsize=_figsize(np.concatenate(ghosts + edges + rigid), colorbar),
                    layout="constrained").add_subplot()
    if ghosts:
        ax.add_collection(PolyCollection(ghosts, facecolor=_GHOST, edgecolor=_GHOST, linewidth=0.5,
                                         zorder=1), autolim=True)
    if rigid:
        ax.add_collection(PolyCollection(rigid, facecolor=_RIGID, edgecolor=_INK, linewidth=0.5,
                                         zorder=1.5), autolim=True)
    if bodies:
        image = ax.tripcolor(_triangulation(bodies, factor), values, shading="gouraud",
                             cmap=cmap or ("RdYlBu_r" if drawn.signed else "viridis"),
                             vmin=low, vmax=high, zorder=2)
    ax.add_collection(LineCollection([np.vstack([line, line[:1]]) for line in edges],
                                     colors=_INK, linewidths=0.5, zorder=3))
    box = around(np.concatenate(ghosts + edges + rigid).T)
    walls = [wall for s in states for wall in outlines(s, box)]
    if walls:
        ax.add_collection(LineCollection(np.concatenate(walls), colors=_WALL, linewidths=1.2,
                                         zorder=2.5), autolim=False)
    ax.set_aspect("equal")
    ax.margins(AROUND if walls else 0.04)
    ax.autoscale_view()
    _dress(ax, (drawn.title or drawn.name) if title is None else title, factor)
    if colorbar and bodies:
        _add_colorbar(ax, image, bool(np.any(values < low)), bool(np.any(values > high)),
                      unit_of(drawn, unit))
    if filename is not None:
        with replacing(filename) as temporary:
            ax.figure.savefig(temporary, dpi=dpi, bbox_inches="tight")
    return ax


def _triangulation(bodies, factor):
    """Two triangles for each quad."""
    from matplotlib.tri import Triangulation

    points = np.concatenate([b.points(b.deformed, factor).reshape(2, -1) for b in bodies], axis=1)
    first = np.concatenate([[0], np.cumsum([b.values.size for b in bodies])])
    cells = np.concatenate([f + b.cells for f, b in zip(first, bodies)])
    return Triangulation(*points, np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]]))


def _states(state):
    """What is drawn, as a list."""
    states = state if isinstance(state, (list, tuple)) else [state]
    if not states:
        raise InputError("there is no state to draw: got an empty list")
    for one in states:
        require_like("state", one, "State", "beams", "u_of")
    return states


def _colormap(cmap):
    """A colour map by its name, or itself; None for none."""
    from matplotlib import colormaps
    from matplotlib.colors import Colormap

    if cmap is None or isinstance(cmap, Colormap):
        return cmap
    return require_option("colour map", cmap, tuple(colormaps))


def _page(ax, title, filename, dpi):
    """The file, or None, and its resolution; what is wrong is said before anything is drawn."""
    from matplotlib.backend_bases import FigureCanvasBase

    if ax is not None:
        require_like("ax", ax, "matplotlib Axes", "tripcolor", "figure")
    require_text("title", title)
    dpi = require_positive("dpi", dpi)
    if not 1.0 <= dpi <= MAX_DPI:
        raise InputError(f"dpi must lie between 1 and {MAX_DPI}, got {dpi!r}")
    if filename is not None:
        known = sorted(FigureCanvasBase.get_supported_filetypes())
        filename = require_path("filename", filename, [f".{kind}" for kind in known])
    return filename, dpi


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
        u, axis_u = values.u.reshape(flat), beam.displacements(state.u_of(beam), ends)
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


def unit_of(field: Field, unit: str | None = None) -> str:
    """What a colour bar says of the unit: nothing for numbers.

    Parameters
    ----------
    field
        A :class:`~skfem_ancf.fields.Field`.
    unit
        To say in place of its own.
    """
    unit = field.unit if unit is None else unit
    return "" if unit == "1" else unit


def _add_colorbar(ax, image, below, above, unit):
    """A bar as high as the picture, or below a flat one."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    flat = (y1 - y0) < 0.35 * (x1 - x0)
    if flat:
        bar = ax.figure.colorbar(image, ax=ax, location="bottom", shrink=0.6, aspect=45, pad=0.06,
                                 extend=_EXTEND[below, above])
    else:
        bar = ax.figure.colorbar(image, cax=ax.inset_axes([1.03, 0.0, 0.03, 1.0]),
                                 extend=_EXTEND[below, above])
    bar.outline.set_visible(False)
    bar.set_label(unit, fontsize=8, color=_MUTED)
    bar.ax.tick_params(labelsize=8, color=_MUTED, labelcolor=_INK)
    bar.formatter.set_powerlimits((-3, 4))
    bar.formatter.set_useMathText(True)
    (bar.ax.xaxis if flat else bar.ax.yaxis).get_offset_text().set_size(8)


def _figsize(points, colorbar):
    """A figure about as wide and high as what is in it."""
    width, height = np.maximum(np.ptp(points, axis=0), 1e-300)
    aspect = np.clip(height / width, 0.15, 1.6)
    area = 5.2 * 5.2 if aspect > 0.5 else 36.0
    w = min(8.0, np.sqrt(area / aspect))
    return w + (1.2 if colorbar else 0.3), max(1.6, w * aspect) + 0.9


def _figure_class():
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtra("matplotlib", "plot") from None
    return Figure


@taught
def plot_path(path: Path, point: ArrayLike, component: int = 1, beam: WhichBeam = None,
              ax: Any = None, *, title: str | None = None, filename: StrPath | None = None,
              dpi: float = 200) -> Any:
    """Draw the load factor of an equilibrium path against a displacement.

    Unstable parts, where they are known, are dashed; turning points of the load are marked.

    Parameters
    ----------
    point
        The material point: its place (x, y) in the stress-free body.
    path
        A :class:`~skfem_ancf.path.Path`.
    component, beam
        Its displacement's component (0 or 1), and the beam it belongs to.
    ax
        Axes to draw on; a new figure by default.
    title
        Title of the picture.
    filename, dpi
        Where to save it, and its resolution.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the component is not 0 or 1.
    MissingExtra
        If matplotlib is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamCable(),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> path = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).continuation(steps=3)
    >>> path.plot((1, 0)).get_ylabel()
    'load factor'
    """
    Figure = _figure_class()
    component = require_integer("component", component, 0, 1)
    filename, dpi = _page(ax, title, filename, dpi)
    if ax is None:
        ax = Figure(figsize=(5.5, 4.0), layout="constrained").subplots()
    u, load = path.displacement(point, beam)[:, component], path.load
    color = ax.plot([], [])[0].get_color()
    for k in range(len(u) - 1):  # a piece is drawn as its end is
        dashed = path.stable[k + 1] is False
        ax.plot(u[k:k + 2], load[k:k + 2], color=color, lw=1.6, ls=(0, (3, 2)) if dashed else "-")
    turns = np.nonzero(np.diff(np.sign(np.diff(load))))[0] + 1
    ax.plot(u[turns], load[turns], "o", ms=4, color=color)
    _dress(ax, title, 1.0)
    ax.set_xlabel(f"displacement $u_{'xy'[component]}$", fontsize=9, color=_INK)
    ax.set_ylabel("load factor", fontsize=9, color=_INK)
    if filename is not None:
        with replacing(filename) as temporary:
            ax.figure.savefig(temporary, dpi=dpi)
    return ax


def _dress(ax, title, factor):
    if title:
        ax.set_title(title, loc="left", fontsize=10, color=_INK, pad=6 if factor == 1.0 else 18)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(_MUTED)
    ax.tick_params(color=_MUTED, labelcolor=_INK, labelsize=8)
    ax.set_xlabel("x", fontsize=9, color=_INK)
    ax.set_ylabel("y", fontsize=9, color=_INK)
    if factor != 1.0:
        ax.annotate(f"section drawn {factor:g} times as thick", (0, 1), (0, 5), va="bottom",
                    xycoords="axes fraction", textcoords="offset points", fontsize=8, color=_MUTED)
