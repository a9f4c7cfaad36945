"""What every time integrator shares."""

from dataclasses import dataclass

import numpy as np


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
    """

    t: float
    u: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    algorithmic: np.ndarray
    multipliers: np.ndarray


class Step:
    """One time step of a scheme from a :class:`Motion` y over dt.

    Attributes
    ----------
    t
        Time at the end of the step.
    guess
        Displacement to start the iteration from.
    mass_factor, stiffness_factor
        The iteration matrix is ``mass_factor M + stiffness_factor K``.
    """

    def residual(self, u):
        """Residual of the equation of motion without the joints, shape (N,)."""
        raise NotImplementedError

    def tangent_at(self, u):
        """The displacement at which K is taken."""
        return u

    def finish(self, u, multipliers):
        """The Motion at the end of the step."""
        raise NotImplementedError


class Scheme:
    """A time integrator; a subclass gives its order and :meth:`begin`.

    Attributes
    ----------
    order : int
        Order of convergence of displacements and velocities.
    tol : float
        Default tolerance of the iteration in a step, relative, in the energy norm.
    projects_velocity : bool
        Project the velocity onto the joints' after each step.
    error_constant : float
        The local error is about this number times dt^2 times the change of the acceleration.
    """

    name = ""
    order = 2
    tol = 1e-9
    projects_velocity = True
    error_constant = 1.0 / 12.0

    def begin(self, system, y, dt):
        """A :class:`Step` from the Motion ``y``."""
        raise NotImplementedError
