"""Diagrams of frequency responses: Bode and Nyquist."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.types import Array, StrPath
from .matplotlib import figure_class, page, plain, save
from .scenery import INK, MUTED


def plot_bode(frequencies: Array, values: Array, axes: Any = None, *, label: str | None = None,
              title: str | None = None, filename: StrPath | None = None, dpi: float = 150) -> Any:
    """Draw amplitude and phase in degrees over the angular frequency; returns two Axes.

    Parameters
    ----------
    frequencies, values
        Angular frequencies, and complex amplitudes, (n,).
    axes
        Two matplotlib Axes to draw on; a new figure by default, which needs no display.
    label
        For a legend.
    title, filename, dpi
        As for :func:`~skfem_ancf.visuals.matplotlib.plot_state`.
    """
    Figure = figure_class()
    filename, dpi = page(None, title, filename, dpi)
    if axes is None:
        axes = Figure(figsize=(6.0, 4.4), layout="constrained").subplots(
            2, 1, sharex=True, height_ratios=(2, 1))
    if np.shape(axes) != (2,):
        raise InputError("axes must be two matplotlib Axes, as plot() returns them")
    positive = frequencies > 0.0
    w, phase = frequencies[positive], np.degrees(np.unwrap(np.angle(values[positive])))
    axes[0].loglog(w, np.abs(values[positive]), lw=1.4, label=label)
    axes[1].semilogx(w, phase, lw=1.4, label=label)
    axes[1].yaxis.set_major_locator(_locator()(90.0))
    for ax, name in zip(axes, ("amplitude", "phase (degrees)")):
        ax.set_ylabel(name, fontsize=9, color=INK)
        ax.grid(True, which="major", lw=0.4, color=MUTED, alpha=0.4)
        plain(ax)
    axes[1].set_xlabel("angular frequency (rad/s)", fontsize=9, color=INK)
    _finish(axes[0], label, title, filename, dpi)
    return axes


def plot_nyquist(values: Array, ax: Any = None, *, label: str | None = None,
                 title: str | None = None, filename: StrPath | None = None,
                 dpi: float = 150) -> Any:
    """Draw the imaginary over the real part of complex amplitudes (n,); returns the Axes.

    Parameters
    ----------
    values, ax, label, title, filename, dpi
        As for :func:`plot_bode`; one Axes.
    """
    Figure = figure_class()
    filename, dpi = page(None, title, filename, dpi)
    if ax is None:
        ax = Figure(figsize=(5.0, 4.4), layout="constrained").subplots()
    ax.plot(values.real, values.imag, lw=1.4, label=label)
    ax.axhline(0.0, color=MUTED, lw=0.6)
    ax.axvline(0.0, color=MUTED, lw=0.6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("real part", fontsize=9, color=INK)
    ax.set_ylabel("imaginary part", fontsize=9, color=INK)
    plain(ax)
    _finish(ax, label, title, filename, dpi)
    return ax


def _locator():
    from matplotlib.ticker import MultipleLocator  # an extra
    return MultipleLocator


def _finish(ax, label, title, filename, dpi):
    if label is not None:
        ax.legend(fontsize=8, frameon=False)
    if title:
        ax.set_title(title, loc="left", fontsize=10, color=INK)
    save(ax, filename, dpi=dpi)
