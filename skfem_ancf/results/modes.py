"""Natural frequencies and modes, and linear buckling loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import spsolve

from ..core import InputError, NearMisses, require_finite_scalar, require_index
from ..equations.matrices import linear_external_force, linear_force
from ..equations.stability import position_weights
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
