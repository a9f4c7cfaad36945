"""Diagrams of normal force, shear force and bending moment."""

from typing import Any

import numpy as np

from ..beam import WhichBeam, select_beam
from ..core import Array, StrPath, refuse, require_flag, require_like, require_option
from ..recovery.fields import unit_in, units_of, with_unit
from ..recovery.grids import grids
from .matplotlib import dress, new_axes, page
from .scenery import GHOST, INK, MUTED, Sketch, rounded, symbols_of

_ROWS = (("N", "normal force $N$"), ("Q", "shear force $Q$"), ("M", "bending moment $M$"))
#: What they are.
KINDS = {"N": "force", "Q": "force", "M": "moment"}

#: Colours of positive and negative section forces on the structure.
SIGNS = "#2f6fa8", "#c1442e"
#: Largest ordinate relative to the size of the structure, and to the middle length of its members;
#: room around the structure; values of these parts of the largest are round-off, or not labelled.
ORDINATE, OF_MEMBERS, ROOM, ROUND_OFF, LABELLED = 0.14, 0.35, 0.22, 1e-8, 0.03
#: Sections of all members together, and in each element at least and at most.
SECTIONS, FEW, MANY = 4000, 9, 65
#: Largest number of labels in a diagram; their least distance, width and height, relative to the
#: structure.
LABELS, APART, WIDE, HIGH = 14, 0.09, 0.2, 0.05
#: The convention of signs, written below.
NOTE = ("N > 0: tension. Q > 0: what follows pushes to the left. Both to the left of a member if "
        "positive.\nM on the side that it stretches, M > 0 on the right (below). Members run from "
        "their first node to their second.")


def plot_resultants(state: Any, beam: WhichBeam = None, axes: Any = None, *, on: str = "auto",
                    title: str | None = None, recover: bool = True,
                    filename: StrPath | None = None, dpi: float = 150) -> Any:
    """Draw normal force, shear force and bending moment along the beams; returns three Axes.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`.
    beam
        Beam, name or number; all beams by default.
    axes
        Three matplotlib Axes to draw on; a new figure by default, which needs no display.
    on
        "structure": filled on the members of the reference configuration, with the extremes of
        each and their units. "length": over the arc length. "auto": the first for frames and
        several beams.
    title, filename, dpi, recover
        As for :func:`~skfem_ancf.visuals.matplotlib.plot_state`.

    Notes
    -----
    On the structure N and Q are drawn to the left of the direction of a member where they are
    positive, and M on the side that it stretches. Each diagram has a scale of its own, the same for
    all members.

    Examples
    --------
    The moment of a girder under a uniform load is q L^2 / 8 = 2 in its middle:

    >>> from skfem_ancf import Frame, StVenantKirchhoff
    >>> girder = Frame.from_lines([(0, 0), (4, 0)], [(0, 1)], height=0.2, width=0.1,
    ...                           material=StVenantKirchhoff(2e8, 0.3))
    >>> state = girder.pin(0).hold(1, "y").line_load((0, -1)).solve_linear()
    >>> [text.get_text() for text in state.plot_resultants()[2].texts]
    ['2']
    """
    save = page(None, title, filename, dpi, bbox_inches="tight")
    require_like("state", state, "State", "beams", "resultants")
    recover = require_flag("recover", recover)
    require_option("on", on, ("auto", "structure", "length"))
    beams = list(state.beams) if beam is None else [select_beam(state.beams, beam)]
    refuse(not beams, 'section forces are those of beams: see state.plot("von_mises")')
    if on == "auto":
        frame = getattr(state.system.constraints, "frame", None)
        on = "length" if frame is None and len(beams) == 1 else "structure"
    if axes is None and on == "length":
        axes = new_axes((6.0, 5.4), 3, 1, sharex=True)
    elif axes is None:  # below each other, on a high structure beside each other
        box = np.ptp(np.hstack([b.mesh.p for b in beams]), axis=1)
        width, height = box + 2.0 * ROOM * max(box)
        w = min(4.2, 6.0 * width / height)
        axes = new_axes((7.0, 21.0 * height / width + 2.0), 3, 1) if height < 0.45 * width else (
            new_axes((3.0 * w, w * height / width + 1.1), 1, 3))
    axes = [axes] if not isinstance(axes, (list, tuple, np.ndarray)) else list(
        np.array(axes, dtype=object).ravel())
    refuse(len(axes) != 3, "axes must be three matplotlib Axes, got {}", len(axes))
    for ax in axes:
        require_like("axes", ax, "matplotlib Axes", "plot", "fill_between")
    (_on_structure if on == "structure" else _over_length)(axes, state, beams, recover)
    if title and on == "structure":
        axes[0].figure.suptitle(title, fontsize=11, color=INK)
    elif title:
        axes[0].set_title(title, loc="left", fontsize=10, color=INK)
    save(axes[0])
    return axes


def _over_length(axes, state, beams, recover):
    several = len(beams) > 1
    for b in beams:
        found = state.resultants(beam=b, recover=recover)
        label = b.name if b.name is not None else f"beam {state.beams.index(b)}"
        for ax, (name, _) in zip(axes, _ROWS):
            values = getattr(found, name)
            line, = ax.plot(found.s, values, lw=1.4, label=label if several else None)
            ax.fill_between(found.s, values, color=line.get_color(), alpha=0.18, lw=0)
    units = units_of(state)
    for ax, (name, label) in zip(axes, _ROWS):
        ax.axhline(0.0, color=MUTED, lw=0.6)
        dress(ax, None, with_unit("arc length $s$", units[1] if units else "") * (ax is axes[2]),
              with_unit(label, unit_in(units, KINDS[name])))
        ax.ticklabel_format(axis="y", scilimits=(-3, 4), useMathText=True)
        size = max(map(abs, ax.get_ylim()))
        if size < 1e-9 * max(max(map(abs, other.get_ylim())) for other in ax.figure.axes):
            ax.set_ylim(-1.0, 1.0)  # round-off about zero is not to be seen
    if several:
        axes[0].legend(fontsize=8, frameon=False)


def lines_of(state: Any, beams: Any, recover: bool = True) -> list[Any]:
    """For each line of beams its Resultants, as a dict of arrays, on enough sections to draw."""
    total = sum(beam.mesh.nelements for beam in beams)
    found = []
    for beam in beams:
        r = state.resultants(beam=beam, recover=recover,
                             sections=int(np.clip(SECTIONS // total, FEW, MANY)))
        for chain in range(int(r.chain[-1]) + 1):
            on = r.chain == chain
            found.append({"beam": beam, "x": r.x[:, on], "normal": r.normal[:, on],
                          **{name: getattr(r, name)[on] for name, _ in _ROWS}})
    return found


def _on_structure(axes, state, beams, recover):
    from matplotlib.collections import PolyCollection

    lines, units = lines_of(state, beams, recover), units_of(state)
    others = grids(state, (1, 1))[len(state.beams):] if len(beams) == len(state.beams) else []
    points = np.hstack([*(line["x"] for line in lines), *(grid.x for grid in others)]).T
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.max(high - low))
    ordinate = min(ORDINATE * size, OF_MEMBERS * float(np.median(
        [np.sum(np.hypot(*np.diff(line["x"]))) for line in lines])))
    force = max(np.max(np.abs(line[name])) for line in lines for name in "NQ")
    noise = {"N": ROUND_OFF * force, "Q": ROUND_OFF * force, "M": ROUND_OFF * force * size}
    known = symbols_of(state, False, True) if hasattr(state.system, "items") else []
    supports = [s for s in known if s.kind in ("support", "joint", "slider")]
    for ax, (name, label) in zip(axes, _ROWS):
        largest = max(np.max(np.abs(line[name])) for line in lines)
        scale = ordinate / largest if largest > noise[name] else 0.0
        for line in lines:
            ax.plot(*line["x"], color=INK, lw=1.6, zorder=3, solid_capstyle="round")
        for grid in others:  # rigid bodies and domains
            ax.add_collection(PolyCollection(grid.x.T[grid.cells], color=GHOST, zorder=1))
        Sketch(ax, np.zeros_like(state.u), points).draw(supports)
        if scale:
            _draw(ax, lines, name, -scale if name == "M" else scale, LABELLED * largest, size,
                  unit_in(units, KINDS[name]))
        (x0, y0), (x1, y1) = low - ROOM * size, high + ROOM * size
        ax.set(aspect="equal", xlim=(x0, x1), ylim=(y0, y1), yticks=[])
        dress(ax, label + " = 0" * (not scale), with_unit("x", units[1] if units else ""), "")
        ax.spines["left"].set_visible(False)
    axes[-1].figure.text(0.99, 0.0, NOTE, va="top", ha="right", fontsize=7, color=MUTED, gid="note")


def _draw(ax, lines, name, scale, least, size, unit):
    """Fill between members and their diagrams, by the sign of the values, and write extremes of
    each line, the largest first, where there is room."""
    # One at an end of a member is moved along it, away from what meets there.
    from matplotlib.patheffects import withStroke

    places = []
    for line in lines:
        values, start, normal = line[name], line["x"], line["normal"]
        for colour, part in zip(SIGNS, (np.maximum(values, 0.0), np.minimum(values, 0.0))):
            edge = start + scale * part * normal
            ax.fill(*np.hstack([start, edge[:, ::-1]]), color=colour, alpha=0.25, lw=0, zorder=1.5,
                    gid="diagram")
        edge = start + scale * values * normal
        ax.plot(*np.hstack([start[:, :1], edge, start[:, -1:]]), color=MUTED, lw=0.9, zorder=2)
        found = {int(np.argmax(values)), int(np.argmin(values))}
        if np.ptp(values) < 0.01 * np.max(np.abs(values)):
            found = {len(values) // 2}  # constant
        for k in found:
            if abs(values[k]) > least:
                side = np.sign(scale * values[k]) * normal[:, k]
                inward = start[:, len(values) // 2] - start[:, k]
                inward *= (k in (0, len(values) - 1)) / (np.hypot(*inward) or 1.0)
                places.append((abs(values[k]), values[k], edge[:, k], side, inward))
    taken: list[tuple[Array, Array]] = []
    for _, value, tip, side, inward in sorted(places, key=lambda one: -one[0]):
        towards = [a if abs(a) > 0.4 else c if abs(c) > 0.4 else 0.0 for a, c in zip(side, inward)]
        middle = tip + 0.5 * size * np.sign(towards) * [WIDE, HIGH]
        if len(taken) < LABELS and all(
                np.hypot(*(tip - other)) > APART * size and
                np.any(np.abs(middle - center) > np.multiply([WIDE, HIGH], size))
                for other, center in taken):
            taken.append((tip, middle))
            ax.annotate(
                rounded(value, unit), tip, 4 * side + 3 * inward, textcoords="offset points",
                fontsize=8, color=SIGNS[0] if value > 0 else SIGNS[1], gid=name, zorder=7,
                path_effects=[withStroke(linewidth=2, foreground="white")],
                ha=("center", "left", "right")[int(np.sign(towards[0]))],
                va=("center", "bottom", "top")[int(np.sign(towards[1]))])
