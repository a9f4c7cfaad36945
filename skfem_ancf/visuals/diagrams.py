"""Diagrams of normal force, shear force and bending moment."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..beam.layout import WhichBeam, select_beam
from ..core.errors import InputError, require_flag, require_like
from ..core.types import StrPath
from .matplotlib import figure_class, page, plain, save
from .scenery import INK, MUTED

_ROWS = (("N", "normal force $N$"), ("Q", "shear force $Q$"), ("M", "bending moment $M$"))


def plot_resultants(state: Any, beam: WhichBeam = None, axes: Any = None, *,
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
    title, filename, dpi, recover
        As for :func:`~skfem_ancf.visuals.matplotlib.plot_state`.
    """
    Figure = figure_class()
    require_like("state", state, "State", "beams", "resultants")
    recover = require_flag("recover", recover)
    beams = list(state.beams) if beam is None else [select_beam(state.beams, beam)]
    filename, dpi = page(None, title, filename, dpi)
    if axes is None:
        axes = Figure(figsize=(6.0, 5.4), layout="constrained").subplots(3, 1, sharex=True)
    axes = [axes] if not isinstance(axes, (list, tuple, np.ndarray)) else list(
        np.array(axes, dtype=object).ravel())
    if len(axes) != 3:
        raise InputError(f"axes must be three matplotlib Axes, got {len(axes)}")
    for ax in axes:
        require_like("axes", ax, "matplotlib Axes", "plot", "fill_between")
    several = len(beams) > 1
    for b in beams:
        found = state.resultants(beam=b, recover=recover)
        label = b.name if b.name is not None else f"beam {state.beams.index(b)}"
        for ax, (name, _) in zip(axes, _ROWS):
            values = getattr(found, name)
            line, = ax.plot(found.s, values, lw=1.4, label=label if several else None)
            ax.fill_between(found.s, values, color=line.get_color(), alpha=0.18, lw=0)
    for ax, (_, label) in zip(axes, _ROWS):
        ax.axhline(0.0, color=MUTED, lw=0.6)
        ax.set_ylabel(label, fontsize=9, color=INK)
        ax.ticklabel_format(axis="y", scilimits=(-3, 4), useMathText=True)
        _clear_of_noise(ax)
        plain(ax)
    axes[2].set_xlabel("arc length $s$", fontsize=9, color=INK)
    if several:
        axes[0].legend(fontsize=8, frameon=False)
    if title:
        axes[0].set_title(title, loc="left", fontsize=10, color=INK)
    save(axes[0], filename, dpi=dpi)
    return axes


def _clear_of_noise(ax):
    """Set limits such that round-off about zero is not visible."""
    low, high = ax.get_ylim()
    size = max(abs(low), abs(high))
    others = [max(map(abs, other.get_ylim())) for other in ax.figure.axes if other is not ax]
    if size < 1e-9 * max(others, default=0.0):
        ax.set_ylim(-1.0, 1.0)
