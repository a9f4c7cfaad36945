"""Natural frequencies and modes, linear buckling loads, frequency responses."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from scipy.sparse.linalg import spsolve

from ..core import (Array, ArrayLike, InputError, NearMisses, StrPath, refuse,
                    require_finite_scalar, require_index, require_option)
from ..equations.matrices import linear_external_force, linear_force
from ..equations.stability import position_weights
from ..visuals.matplotlib import dress, new_axes, page
from ..visuals.scenery import MUTED
from .state import State

#: Round-off of the frequency of a rigid motion, over that of the slowest bending.
ROUND_OFF = 1e-7
#: A velocity with negligible quadratic terms.
SLOW = 1e-6


@dataclass(repr=False)
class Modes(NearMisses):
    """Natural frequencies and shapes, the lowest first.

    A motion ``shape * exp(i omega t)`` has the eigenvalue ``omega^2``, which is real if all loads
    have a potential. Follower forces may cause complex pairs: two oscillations, one of which grows
    (flutter).

    Attributes
    ----------
    frequencies
        Angular frequencies in rad/s, shape (k,): square roots of the eigenvalues. For a negative
        eigenvalue (divergence) minus the growth rate. With :attr:`flutter` the array is complex:
        the real part is the angular frequency, and minus the imaginary part the growth rate.
    shapes
        Displacements of the degrees of freedom, shape (k, N), of unit modal mass; complex with
        flutter.
    state
        The state of linearisation.
    eigenvalues
        ``omega^2``, shape (k,), complex.
    errors
        Relative errors of the frequencies by the mesh, shape (k,): their change as all beam
        elements are halved, times 4/3. NaN for rigid motions, about a state that was given, under
        loads without a potential, and in scenes with more than 30,000 DOFs.
    """

    frequencies: np.ndarray
    shapes: np.ndarray
    state: State
    eigenvalues: np.ndarray
    errors: np.ndarray | None = None

    def __repr__(self):
        return f"<Modes of {len(self.frequencies)} frequencies, {_listed(self.frequencies)} rad/s>"

    @property
    def flutter(self) -> bool:
        """True if an oscillation grows: there is a complex pair of eigenvalues."""
        return bool(np.any(self.eigenvalues.imag != 0.0))

    @property
    def stable(self) -> bool:
        """True if none of these motions grows."""
        return not self.flutter and bool(np.all(self.frequencies >= 0.0))

    @property
    def damping_ratios(self) -> np.ndarray:
        """Damping ratio of each mode, shape (k,).

        ``shape . D shape / (2 omega)`` with the damping matrix D: exact for Rayleigh and modal
        damping and for viscoelastic materials of one kind, of first order where damping couples
        modes. NaN where a motion does not oscillate.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, Scene,
        ...                         StVenantKirchhoff)
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
        ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01, damping=KelvinVoigt(1e-3))
        >>> modes = Scene(beam).clamp("left").modes(2)
        >>> bool(np.allclose(modes.damping_ratios, 0.5e-3 * modes.frequencies))
        True
        """
        state, system = self.state, self.state.system
        if not system.damped:
            return np.zeros(len(self.shapes))
        out = np.full(len(self.shapes), np.nan)
        rigid = ROUND_OFF * np.sqrt(system.scales.bending_eigenvalue)
        for k, (omega, shape) in enumerate(zip(self.frequencies, self.shapes)):
            if np.iscomplexobj(shape) or not omega.real > rigid:
                continue
            force = system.damping_force(np.array(state.u), SLOW * shape, state.t) / SLOW
            out[k] = shape @ force / (2.0 * omega.real)
        return out

    def mode(self, i: int, amplitude: float | None = None, *,
             displacement: float | None = None) -> State:
        """The state displaced along a mode (its real part), to plot or save.

        It is linearised about :attr:`state`, in equilibrium with the inertia of the vibration.
        About the reference configuration its strain energy is ``(omega amplitude)^2 / 2``.

        Parameters
        ----------
        i
            Number of the mode, negative ones from the end.
        amplitude
            Factor of the shape, which has unit modal mass.
        displacement
            The largest displacement of a node, instead of the factor; by default a tenth of the
            size of the scene.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.01), ElementBeamCable(5),
        ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
        >>> state = Scene(beam).clamp("left").modes(1).mode(0, displacement=0.02)
        >>> round(abs(float(state.displacement("right")[1])), 6)
        0.02
        """
        state, system = self.state, self.state.system
        i = require_index("i", i, len(self.shapes))
        if amplitude is not None and displacement is not None:
            raise InputError("give amplitude or displacement, not both")
        if amplitude is None:
            largest = (0.1 * system.size if displacement is None else
                       require_finite_scalar("displacement", displacement))
            at_nodes = self.shapes[i].real[position_weights(system) > 0.0]
            amplitude = largest / np.hypot(*at_nodes.reshape(-1, 2).T).max()
        d = require_finite_scalar("amplitude", amplitude) * self.shapes[i].real
        acceleration = -self.eigenvalues[i].real * d
        inertia, multipliers, c = system.mass.multiply(acceleration), state.multipliers, (
            system.constraints)
        if c.m:  # which balance the displacement and its inertia
            u, load, t = np.array(state.u), state.load, state._time
            rest = (linear_force(system, u, d, load) - system.internal_force(u, None, load)
                    + inertia + c.curvature(u, t, multipliers) @ d
                    - load * (linear_external_force(system, u, d) - system.external_force(u)))
            J = c.sparse_jacobian(u, t)[:, c.free].tocsr()
            multipliers = multipliers - spsolve((J @ J.T).tocsc(), J @ rest[c.free])
        return State(system, state.u + d, acceleration=acceleration, inertia=inertia,
                     load=state.load, message=f"mode {i}", base=state, multipliers=multipliers)


@dataclass(repr=False)
class Buckling(NearMisses):
    """Load factors at which the reference configuration loses stability, the lowest first.

    Attributes
    ----------
    factors
        Multiples of the loads of the scene, shape (k,).
    shapes
        Displacements of the degrees of freedom, shape (k, N).
    follower : bool
        The loads have no potential: these are factors of divergence, and flutter is possible below
        them; see ``scene.modes`` about a loaded state.
    """

    factors: np.ndarray
    shapes: np.ndarray
    follower: bool = False

    def __repr__(self):
        loads = ", under loads that follow the body" if self.follower else ""
        return f"<Buckling at the load factors {_listed(self.factors)}{loads}>"


def _listed(numbers):
    return ", ".join(f"{x:.6g}" for x in numbers[:6]) + ", ..." * (len(numbers) > 6)


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
