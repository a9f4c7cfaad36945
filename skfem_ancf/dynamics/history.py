"""What a motion was: times, positions, energies, momenta."""

from functools import cached_property

import numpy as np

from ..errors import require_index, teaching
from ..results import State


@teaching
class History:
    """A motion at its stored instants.

    Attributes
    ----------
    t
        Times, shape (nt,).
    u, v, acceleration
        Displacement of the coordinates and its rates, shape (nt, N).
    multipliers
        Of the joints, shape (nt, m).
    iterations, factorizations
        Residuals solved for, and tangents factorised, in all steps.
    """

    def __init__(self, system, scheme, solver):
        self.system, self.scheme, self._solver = system, scheme, solver
        self._rows = []

    def append(self, y):
        """Store an instant."""
        self._rows.append((y.t, y.u, y.v, y.acceleration, y.multipliers))

    def close(self):
        """Turn what was stored into arrays."""
        if self._rows:
            self.t, self.u, self.v, self.acceleration, self.multipliers = (
                np.array(column) for column in zip(*self._rows))
        self._rows = []
        self.iterations = self._solver.iterations
        self.factorizations = self._solver.factorizations
        return self

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        return (f"<History of {len(self)} instants, t = {self.t[0]:g} to {self.t[-1]:g}, "
                f"{self.scheme!r}, {self.iterations} iterations, {self.factorizations} "
                "factorisations>")

    def state(self, k):
        """The instant ``k`` as a State: strain, reactions (inertia included), plots, files."""
        k = require_index("k", k, len(self))
        return State(self.system, self.u[k], load=1.0, converged=True, t=float(self.t[k]),
                     message=f"t = {self.t[k]:g}", multipliers=self.multipliers[k],
                     inertia=self.system.mass.multiply(self.acceleration[k]),
                     acceleration=self.acceleration[k])

    def __iter__(self):
        return (self.state(k) for k in range(len(self)))

    # at a material point

    def displacement(self, point, beam=None):
        """Displacement of a material point at all instants, shape (nt, 2)."""
        beam, e, X = self.state(0)._find(point, beam)
        return beam.point_displacement(self.u[:, self.system.of(beam)], e, X)

    def position(self, point, beam=None):
        """Position of a material point at all instants, shape (nt, 2)."""
        first = self.state(0)
        return (first.position(point, beam) - first.displacement(point, beam)
                + self.displacement(point, beam))

    def velocity(self, point, beam=None):
        """Velocity of a material point at all instants, shape (nt, 2)."""
        beam, e, X = self.state(0)._find(point, beam)
        dofs, weights = beam.probe_reference(e, X)
        return self.v[:, self.system.of(beam)][:, dofs] @ weights

    def joint_force(self, joint):
        """What a joint does to its first beam at all instants, shape (nt, m)."""
        return np.array([state.joint_force(joint) for state in self])

    # of the whole

    @cached_property
    def strain_energy(self):
        """Strain energy, shape (nt,)."""
        return np.array([self.system.strain_energy(u) for u in self.u])

    @cached_property
    def kinetic_energy(self):
        """Kinetic energy, shape (nt,)."""
        return np.array([0.5 * v @ self.system.mass.multiply(v) for v in self.v])

    @cached_property
    def potential_energy(self):
        """Potential of the loads, zero in the stress-free state, shape (nt,)."""
        return np.array([self.system.load_potential(u, t) for u, t in zip(self.u, self.t)])

    @property
    def total_energy(self):
        """Sum of the three energies, shape (nt,)."""
        return self.strain_energy + self.kinetic_energy + self.potential_energy

    @cached_property
    def momentum(self):
        """Linear momentum, shape (nt, 2)."""
        return np.array([self.system.momentum(v) for v in self.v])

    @cached_property
    def angular_momentum(self):
        """Angular momentum about the origin of the coordinates, shape (nt,)."""
        return np.array([self.system.angular_momentum(u, v) for u, v in zip(self.u, self.v)])

    # files

    def save(self, filename, progress=None, **options):
        """Write a time series for ParaView: a ``.pvd`` and one ``.vtu`` for each instant.

        Parameters
        ----------
        filename
            Name of the ``.pvd`` file.
        progress
            Show a progress bar: True, False, or None for "if it takes long".
        **options
            Those of :func:`skfem_ancf.io.vtu.save_vtu`.
        """
        from ..io.pvd import PvdWriter
        from ..progress import progress_bar

        with PvdWriter(filename, **options) as writer, progress_bar(
                progress, total=len(self), desc="files") as bar:
            for k in range(len(self)):
                writer.add(self.state(k), float(self.t[k]))
                bar.update(1)
