"""Frequency responses: amplitudes, phases, and the response to random loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ..core import (Array, ArrayLike, InputError, NearMisses, StrPath, refuse, require_index,
                    require_option)
from ..visuals.matplotlib import dress, new_axes, page
from ..visuals.scenery import MUTED


@dataclass(repr=False)
class FrequencyResponse(NearMisses):
    """Complex amplitudes of outputs for inputs of amplitude 1.

    Attributes
    ----------
    frequencies
        Angular frequencies omega in rad/s, shape (n,).
    values
        ``y / s`` of ``y exp(i omega t)`` and ``s exp(i omega t)``, complex, (n, outputs, inputs).
    inputs, outputs
        Their names.
    """

    frequencies: np.ndarray
    values: np.ndarray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __repr__(self):
        low, high = self.frequencies.min(), self.frequencies.max()
        return (f"<FrequencyResponse at {len(self.frequencies)} frequencies, {low:.4g} to "
                f"{high:.4g} rad/s, of {list(self.outputs)} to {list(self.inputs)}>")

    def of(self, output: int | str = 0, input: int | str = 0) -> Array:
        """Complex amplitudes of one output for one input, shape (n,).

        Parameters
        ----------
        output, input
            Names or numbers.
        """
        return self.values[:, _number("output", output, self.outputs),
                           _number("input", input, self.inputs)]

    @property
    def amplitude(self) -> Array:
        """Moduli, (n, outputs, inputs)."""
        return np.abs(self.values)

    @property
    def phase(self) -> Array:
        """Phases in radians, continuous in the frequency, (n, outputs, inputs)."""
        return np.unwrap(np.angle(self.values), axis=0)

    def rms(self, density: ArrayLike) -> Array:
        """Root mean squares of the outputs under random inputs, shape (outputs,).

        The variance is the integral of ``H S H^*`` over the frequencies, by the trapezoidal rule:
        these have to resolve the resonances.

        Parameters
        ----------
        density
            One-sided spectral densities S per rad/s, of the square of the input: a number or an
            array (n,) for one input; (n, inputs) for independent ones, or cross-spectral matrices
            (n, inputs, inputs).
        """
        n, k = self.values.shape[0], len(self.inputs)
        S: Any = np.asarray(density)
        if S.ndim < 2:
            S = np.broadcast_to(S, (n,))[:, None] if S.shape in ((), (n,)) and k == 1 else S
        if S.shape == (n, k):
            S = S[:, :, None] * np.eye(k)
        if S.shape != (n, k, k):
            raise InputError(f"density must have the shape ({n}, {k}) or ({n}, {k}, {k}) of "
                             f"{n} frequencies and {k} input(s), got {np.shape(density)}")
        found = np.einsum("nri,nij,nrj->nr", self.values, S, self.values.conj()).real
        return np.sqrt(scipy.integrate.trapezoid(found, self.frequencies, axis=0))

    def plot(self, output: int | str = 0, input: int | str = 0, axes: Any = None, *,
             label: str | None = None, title: str | None = None,
             filename: StrPath | None = None, dpi: float = 150) -> Any:
        """Draw amplitude and phase over the frequency (Bode); returns two Axes.

        Parameters
        ----------
        output, input
            Names or numbers.
        axes
            Two matplotlib Axes to draw on; a new figure by default, which needs no display.
        label
            For a legend.
        title, filename, dpi
            As for :func:`~skfem_ancf.visuals.matplotlib.plot_state`.
        """
        save, values = page(None, title, filename, dpi), self.of(output, input)
        from matplotlib.ticker import MultipleLocator

        if axes is None:
            axes = new_axes((6.0, 4.4), 2, 1, sharex=True, height_ratios=(2, 1))
        refuse(np.shape(axes) != (2,), "axes must be two matplotlib Axes, as plot() returns them")
        positive = self.frequencies > 0.0
        w, values = self.frequencies[positive], values[positive]
        axes[0].loglog(w, np.abs(values), lw=1.4, label=label)
        axes[1].semilogx(w, np.degrees(np.unwrap(np.angle(values))), lw=1.4, label=label)
        axes[1].yaxis.set_major_locator(MultipleLocator(90.0))
        for ax in axes:
            ax.grid(True, which="major", lw=0.4, color=MUTED, alpha=0.4)
        dress(axes[1], None, "angular frequency (rad/s)", "phase (degrees)")
        _finish(axes[0], label, title, "", "amplitude", save)
        return axes

    def plot_nyquist(self, output: int | str = 0, input: int | str = 0, ax: Any = None, *,
                     label: str | None = None, title: str | None = None,
                     filename: StrPath | None = None, dpi: float = 150) -> Any:
        """Draw the imaginary over the real part (Nyquist); returns the Axes.

        Parameters
        ----------
        output, input
            Names or numbers.
        ax, label, title, filename, dpi
            As for :meth:`plot`; one Axes.
        """
        save, values = page(None, title, filename, dpi), self.of(output, input)
        ax = new_axes((5.0, 4.4)) if ax is None else ax
        ax.plot(values.real, values.imag, lw=1.4, label=label)
        ax.axhline(0.0, color=MUTED, lw=0.6)
        ax.axvline(0.0, color=MUTED, lw=0.6)
        ax.set_aspect("equal", adjustable="datalim")
        _finish(ax, label, title, "real part", "imaginary part", save)
        return ax


def _finish(ax, label, title, xlabel, ylabel, save):
    if label is not None:
        ax.legend(fontsize=8, frameon=False)
    dress(ax, title, xlabel, ylabel)
    save(ax)


def _number(kind, which, names):
    if isinstance(which, str):
        return names.index(require_option(kind, which, names))
    return require_index(kind, which, len(names))
