"""What every time integrator shares: the motion at an instant, and what a scheme is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.errors import CheckpointError
from ..core.types import Array
from ..equations.system import System

#: Part of a step up to which an acceleration is interpolated, where it is a difference.
NEAR = 0.1


@dataclass
class Motion:
    """A motion at one instant.

    Attributes
    ----------
    t
        Time.
    u, v
        Displacement and velocity of the degrees of freedom, shape (N,).
    acceleration
        The acceleration of the equation of motion, shape (N,).
    algorithmic
        The scheme's own acceleration, where it has one, shape (N,).
    multipliers
        Of the joints, shape (m,).
    force
        The multipliers where the last step took them, if that is not at its end, shape (m,).
    before
        Size of the step before; 0 where there is none.
    dissipated
        The work of damping so far.
    contacts
        What points remember of obstacles, shape (k,); None if there are none.
    turns
        Angles with whole turns, as of :class:`~skfem_ancf.actions.forces.turns.Turns`, shape (k,).
    memory
        What else the scheme keeps for its next step: None, or a dict of numbers and arrays.
    """

    t: float
    u: Array
    v: Array
    acceleration: Array
    algorithmic: Array
    multipliers: Array
    force: Array
    before: float = 0.0
    dissipated: float = 0.0
    contacts: Array | None = None
    turns: Array | None = None
    memory: dict[str, Any] | None = None


def interpolate(a: Motion, b: Motion, t: float) -> Motion:
    """The motion at t between two instants: cubic in the displacement, linear in accelerations."""
    h, s = b.t - a.t, (t - a.t) / (b.t - a.t)
    du = b.u - a.u
    u = (a.u + s * s * (3 - 2 * s) * du + h * s * (1 - s) ** 2 * a.v + h * s * s * (s - 1) * b.v)
    v = (6 * s * (1 - s) / h * du + (1 - s) * (1 - 3 * s) * a.v + s * (3 * s - 2) * b.v)

    def linear(name):
        return (1 - s) * getattr(a, name) + s * getattr(b, name)

    return replace(a, t=t, u=u, v=v, **{name: linear(name) for name in (
        "acceleration", "multipliers", "dissipated")})


def stored(arrays: dict[str, Any], name: str, like: Any) -> Any:
    """An array of a checkpoint."""
    found, like = np.asarray(arrays.get(name)), np.asarray(like)
    if found.shape != like.shape or found.dtype.kind != like.dtype.kind:
        raise CheckpointError(f"{name!r} should have the shape {like.shape} and the kind "
                              f"{like.dtype.kind!r}, got {found.shape} and {found.dtype.kind!r}")
    return found


class Scheme:
    """A time integrator: a member of the family of :mod:`skfem_ancf.dynamics.steps`, by numbers.

    A custom scheme is a subclass with other numbers, or one that overrides :meth:`step`.

    Attributes
    ----------
    order : int
        Order of convergence of displacements and velocities.
    parameters : tuple of float
        alpha_m, alpha_f, beta, gamma; by default those of the trapezoidal rule.
    conserving : bool
        Forces are means over the step that conserve energy, and the scheme's acceleration is that
        of its middle.
    tol : float
        Default tolerance of the iteration in a step, relative, in the energy norm.
    joined : bool
        It is for scenes with joints and rigid bodies too.
    adaptive : bool
        It estimates its error, which chooses steps with ``dt="auto"``.
    error_constant : float
        The error that a step adds to the displacement is about this number times dt^(order + 1)
        times the derivative of it of that order: for order 2, times dt^2 times the change of the
        acceleration.
    filtered : int
        How often :meth:`resolved` is applied to the estimated error.
    safety : float
        Factor of the estimated error, as measured: ``benchmarks/tolerances.py``.
    """

    name = ""
    order = 2
    tol = 1e-9
    parameters: tuple[float, ...] = (0.0, 0.0, 0.25, 0.5)
    conserving = collocates = False
    joined = adaptive = True
    error_constant = 1.0 / 12.0
    filtered = 1
    safety = 1.0

    def step(self, integrator: Any, y: Motion, dt: float) -> Motion:
        """Where the motion is one step later.

        A scheme that overrides it is asked for each step, others are taken in blocks. What it
        keeps for its next step goes to the ``memory`` of what it returns. A StepFailed is answered
        by two steps of half the size.

        Parameters
        ----------
        integrator, y, dt
            An :class:`~skfem_ancf.dynamics.integrator.Integrator`, which can ``take`` a step by
            :attr:`parameters`; where the step begins, and its size.
        """
        return integrator.take(y, dt)

    def require(self, system: System) -> None:
        """Raise InputError for a system that the scheme is not for."""

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate of the error that a step adds to the displacement, shape (N,).

        Parameters
        ----------
        old, new, dt
            Start and end of the step, and its size.
        """
        return self.error_constant * dt**2 * (new.algorithmic - old.algorithmic)

    def near(self, system: System) -> float:
        """Part of a step up to which the acceleration is interpolated within it.

        A shorter step to there has it by a difference that is all round-off.
        """
        return NEAR

    def lasting(self, integrator: Any, du: Array, time: float) -> Array:
        """The mean of what is left of a change of the displacement while it is damped.

        Parameters
        ----------
        integrator, du, time
            Who took the last step, the change, shape (N,), and for how long it is damped.
        """
        return du

    def resolved(self, integrator: Any, du: Array) -> Array:
        """What of a change of the displacement a step resolves, by its matrix as a filter.

        Parameters
        ----------
        integrator, du
            Who took the last step, and the change, shape (N,).
        """
        return integrator.filtered(du)


def in_blocks(scheme: Scheme) -> bool:
    """True of a scheme that does not take its steps itself: many are taken at once."""
    return type(scheme).step is Scheme.step


def in_steps(scheme: Scheme) -> bool:
    """True of a scheme whose steps are those of :mod:`skfem_ancf.dynamics.steps`."""
    return in_blocks(scheme) and not scheme.collocates


def same_scheme(a: Scheme, b: Scheme) -> bool:
    """True of schemes of one class with the same numbers."""
    return type(a) is type(b) and repr(sorted(vars(a).items())) == repr(sorted(vars(b).items()))
