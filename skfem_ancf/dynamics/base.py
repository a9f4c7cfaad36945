"""What every time integrator shares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..system import System
    from ..types import Array

#: The iteration of a step, in NumPy and compiled: iterations at most; contraction up to which
#: factors are kept; contraction expected of new factors, and the least that is expected of any;
#: growth of a correction, with new factors, beyond which the step is given up.
ITERATION = 30, 0.1, 0.1, 0.01, 2.0


@dataclass
class Motion:
    """Where a motion is at one instant.

    Attributes
    ----------
    t
        Time.
    u, v
        Displacement and velocity of the coordinates, shape (N,).
    acceleration
        The acceleration of the equation of motion, shape (N,).
    algorithmic
        The scheme's own acceleration, where it has one.
    multipliers
        Of the joints, shape (m,).
    force
        The multipliers where the last step took them, if that is not at its end; shape (m,).
    before
        Size of the step before; 0 where there is none.
    memory
        What else the scheme keeps for its next step: None, or a dict of numbers and arrays.
    """

    t: float
    u: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    algorithmic: np.ndarray
    multipliers: np.ndarray
    force: np.ndarray | None = None
    before: float = 0.0
    memory: dict | None = None

    def __post_init__(self):
        if self.force is None:
            self.force = self.multipliers


class Step:
    """One time step of a scheme from a :class:`Motion` y over dt.

    The equation that a step solves is ``force(u) - M acceleration(u) - J^T multipliers = 0`` with
    J at ``middle(u)``, ``joint_time``.

    Attributes
    ----------
    t
        Time at the end of the step.
    joint_time
        Time at which the joints act.
    guess
        Displacement to start the iteration from.
    mass_factor, stiffness_factor
        The iteration matrix is ``mass_factor M + stiffness_factor K``.
    acceleration_share
        Where the equation holds at the end of the step: the part of a change of the acceleration,
        made so that the joints' second rate holds too, that the scheme's own acceleration takes.
    """

    acceleration_share = 0.0

    def force(self, u: Array) -> Array:
        """Loads less internal force, shape (N,)."""
        raise NotImplementedError

    def acceleration(self, u: Array) -> Array:
        """The acceleration in the equation, shape (N,)."""
        raise NotImplementedError

    def support_acceleration(self, v: Array, a: Array) -> Array:
        """As :meth:`acceleration`, at fixed coordinates.

        Parameters
        ----------
        v, a
            Velocity and acceleration of the fixed coordinates at the end of the step, shape (k,).

        Returns
        -------
        ndarray
            Shape (k,).
        """
        return a

    def velocity(self, u: Array) -> Array:
        """Velocity at the end of the step before the joints' part in it, shape (N,)."""
        raise NotImplementedError

    def middle(self, u: Array) -> Array:
        """The displacement at which the tangent and the joints' directions are taken."""
        return u

    def finish(self, u: Array, v: Array, multipliers: Array, impulse: Array) -> Motion:
        """The Motion at the end of the step.

        Parameters
        ----------
        u, v, multipliers
            Displacement (N,), velocity (N,) and multipliers (m,) found.
        impulse
            The multipliers of the velocity, shape (m,): ``v = velocity(u) - M^-1 J^T impulse``.
        """
        raise NotImplementedError


class Scheme:
    """A time integrator; a subclass gives its order and :meth:`begin`.

    Attributes
    ----------
    order : int
        Order of convergence of displacements and velocities.
    compiled : tuple or None
        For :mod:`skfem_ancf.dynamics.blocks`: whether the scheme conserves energy, and
        (alpha_m, alpha_f, beta, gamma); None if there is no compiled step.
    tol : float
        Default tolerance of the iteration in a step, relative, in the energy norm.
    couples_velocity : bool
        The joints' part in the velocity acts back on the equation of motion.
    error_constant : float
        The error that a step adds to the displacement is about this number times dt^2 times the
        change of the acceleration.
    """

    name = ""
    order = 2
    tol = 1e-9
    compiled: tuple[bool, tuple[float, ...]] | None = None
    couples_velocity = False
    error_constant = 1.0 / 12.0

    def begin(self, system: System, y: Motion, dt: float) -> Step:
        """The next time step.

        Parameters
        ----------
        system
            The :class:`~skfem_ancf.system.System`.
        y
            Where it starts.
        dt
            Its size.

        Returns
        -------
        Step
        """
        raise NotImplementedError

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate of the error that a step adds to the displacement.

        Parameters
        ----------
        old, new
            Start and end of the step.
        dt
            Its size.

        Returns
        -------
        ndarray
            Shape (N,).
        """
        return self.error_constant * dt**2 * (new.algorithmic - old.algorithmic)
