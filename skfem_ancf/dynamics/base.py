"""What every time integrator shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import CheckpointError

if TYPE_CHECKING:
    from ..equations.system import System
    from ..core.types import Array

#: Part of a step up to which an acceleration is interpolated, where it is a difference.
NEAR = 0.1


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
        What else is kept for the next step, by the scheme and, as ``contacts``, of obstacles: None,
        or a dict of numbers and arrays.
    dissipated
        The work of damping so far.
    turns
        Angles as of :class:`~skfem_ancf.actions.forces.turns.Turns`, shape (k,); None where nothing
        follows them.
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
    dissipated: float = 0.0
    turns: np.ndarray | None = None

    def __post_init__(self):
        if self.force is None:
            self.force = self.multipliers


def contacts_of(y: Motion) -> Array | None:
    """What points remember of obstacles, shape (k,), or None.

    Parameters
    ----------
    y
        A Motion.
    """
    return (y.memory or {}).get("contacts")


def kept(y: Motion, contacts: Array | None, **others: Array) -> dict[str, Array] | None:
    """The memory of a Motion after a step, or None for nothing.

    Parameters
    ----------
    y
        The Motion before: how stiff obstacles are stays.
    contacts
        What points remember now, shape (k,); None if steps leave nothing behind.
    **others
        What else is kept, arrays of any shape (...,).
    """
    contacts = contacts_of(y) if contacts is None else contacts
    return ({"contacts": contacts} if contacts is not None else {}) | others or None


def recalled(memory: dict[str, Any], name: str, shape: tuple[int, ...], kind: str = "f",
             finite: bool = True) -> Array:
    """An array of what a motion goes on with, of the shape that it has to have.

    Parameters
    ----------
    memory
        Arrays of any shapes (...,) by name.
    name
        Which.
    shape
        Its shape.
    kind
        "f" for floats, "i" for integers, "c" for complex numbers.
    finite
        Its numbers have to be finite.

    Raises
    ------
    CheckpointError
        If it is another, as of a file that was not written by this package.
    """
    found = memory.get(name)
    array = np.asarray(found)
    if found is None or array.shape != shape or array.dtype.kind != kind:
        raise CheckpointError(f"{name!r} must be of the shape {shape} and kind {kind!r}, got " + (
            "none" if found is None else f"{array.shape} and {array.dtype.kind!r}"))
    if finite and not np.isfinite(array).all():
        raise CheckpointError(f"{name!r} has numbers that are not finite")
    return array


def interpolate(a: Motion, b: Motion, t: float) -> Motion:
    """The motion at t between two instants: cubic in the displacement, linear in accelerations.

    Parameters
    ----------
    a, b
        The instants.
    t
        The time.
    """
    h, s = b.t - a.t, (t - a.t) / (b.t - a.t)
    du = b.u - a.u
    u = (a.u + s * s * (3 - 2 * s) * du + h * s * (1 - s) ** 2 * a.v + h * s * s * (s - 1) * b.v)
    v = (6 * s * (1 - s) / h * du + (1 - s) * (1 - 3 * s) * a.v + s * (3 * s - 2) * b.v)

    def linear(x, y):
        return (1 - s) * x + s * y

    return Motion(t, u, v, linear(a.acceleration, b.acceleration), a.algorithmic,
                  linear(a.multipliers, b.multipliers), a.force, a.before, a.memory,
                  linear(a.dissipated, b.dissipated))


class Memories(Sequence):
    """What is kept after each of some steps, made for those that are asked for.

    Parameters
    ----------
    y, n
        The Motion before them, and their number.
    contacts
        What points remember after each, shape (n, k); None if steps leave nothing behind.
    **others
        What else is kept, arrays of shape (n, ...).
    """

    def __init__(self, y: Motion, n: int, contacts: Array | None, **others: Array) -> None:
        self._y, self._n, self._contacts, self._others = y, n, contacts, others

    def __len__(self):
        return self._n

    def __getitem__(self, k):
        if not 0 <= k < self._n:  # arrays may have more
            raise IndexError(k)
        contacts = None if self._contacts is None else self._contacts[k].copy()
        return kept(self._y, contacts, **{name: x[k].copy() for name, x in self._others.items()})


@dataclass
class Steps:
    """Motions after steps of one size that were taken together.

    Attributes
    ----------
    start, dt, first
        Steps end at the times ``start + dt (first + 1)``, ``start + dt (first + 2)`` and so on.
    rows
        Displacement, velocity and acceleration after each, and the scheme's own acceleration where
        it has one, shape (n, 3, N) or (n, 4, N).
    shares
        The multipliers, and those where the step took them if that is not at its end, shape (n, 1,
        m) or (n, 2, m).
    dissipated
        The work of damping so far, shape (n,).
    memories
        What is kept after each, as :attr:`Motion.memory`.
    end
        The time after the last, where round-off makes it another.
    turns
        Angles after each, as of a Motion, shape (n, k), or None.
    """

    start: float
    dt: float
    first: int
    rows: Array
    shares: Array
    dissipated: Array
    memories: Sequence[dict[str, Array] | None]
    end: float | None = None
    turns: Array | None = None

    def __len__(self):
        return len(self.memories)

    def __getitem__(self, k: int) -> Motion:
        """That after the step k, counted from 0, of arrays of its own: it keeps no other."""
        memory = self.memories[k]
        t = self.start + self.dt * (self.first + k + 1)
        if self.end is not None and k + 1 == len(self):
            t = self.end
        return Motion(t, *_named(self.rows[k].copy(), self.shares[k].copy()), self.dt, memory,
                      float(self.dissipated[k]),
                      None if self.turns is None else self.turns[k].copy())

    def columns(self) -> tuple[Array, ...]:
        """All but memories as arrays, in the order of a Motion: (n,), (n, N), (n, m) or (n, k)."""
        n = len(self)
        turns = np.zeros((n, 0)) if self.turns is None else self.turns[:n]
        t = self.start + self.dt * np.arange(self.first + 1, self.first + n + 1)
        if self.end is not None:
            t[-1:] = self.end
        return (t, *_named(self.rows[:n].swapaxes(0, 1), self.shares[:n].swapaxes(0, 1)),
                np.full(n, self.dt), self.dissipated[:n], turns)


def _named(rows: Array, shares: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """What a Motion has from its displacement to its force, of what :class:`Steps` has."""
    u, v, *rates = rows
    return u, v, rates[0], rates[-1], shares[0], shares[-1]


class Scheme:
    """A time integrator: a member of the family of :mod:`skfem_ancf.dynamics.steps`, by numbers.

    A scheme of your own is a subclass with other numbers; or one that overrides :meth:`step`.

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
    text : str
        The text of its steps.
    """

    name = ""
    text = "steps"
    order = 2
    tol = 1e-9
    parameters: tuple[float, ...] = (0.0, 0.0, 0.25, 0.5)
    conserving = False
    joined = adaptive = True
    error_constant = 1.0 / 12.0
    filtered = 1
    safety = 1.0

    def step(self, integrator: Any, y: Motion, dt: float) -> Motion:
        """Where the motion is one step later.

        A scheme that overrides it is asked for each step, others are taken in blocks. What it
        keeps for its next step goes to the ``memory`` of what it returns.

        Parameters
        ----------
        integrator
            An :class:`~skfem_ancf.dynamics.integrator.Integrator`, which has the system and can
            take a step by :attr:`parameters`.
        y
            Where the step begins.
        dt
            Its size.

        Returns
        -------
        Motion

        Raises
        ------
        StepFailed
            If there is no such step: it is tried in two halves.
        """
        return integrator.take(y, dt)

    def in_blocks(self, system: System) -> bool:
        """True if :meth:`run` takes many steps at once.

        Parameters
        ----------
        system
            A :class:`~skfem_ancf.equations.system.System`.
        """
        return type(self).step is Scheme.step

    def run(self, integrator: Any, y: Motion, dt: float, n: int,
            start: float | None = None, first: int = 0,
            block: tuple[int, int] | None = None) -> Steps:
        """Up to n steps: as :meth:`skfem_ancf.dynamics.integrator.Integrator.run`.

        Parameters
        ----------
        integrator
            An :class:`~skfem_ancf.dynamics.integrator.Integrator`.
        y, dt, n, start, first, block
            As there.
        """
        return integrator.run(y, dt, n, start, first, block)

    def require(self, system: System) -> None:
        """Raise InputError for a system that the scheme is not for.

        Parameters
        ----------
        system
            A :class:`~skfem_ancf.equations.system.System`.
        """

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

    def near(self, system: System) -> float:
        """Part of a step up to which the acceleration is interpolated within it.

        A shorter step to there has it by a difference that is all round-off.

        Parameters
        ----------
        system
            A :class:`~skfem_ancf.equations.system.System`.
        """
        return NEAR

    def lasting(self, integrator: Any, du: Array, time: float) -> Array:
        """The mean of what is left of a change of the displacement while it is damped.

        Parameters
        ----------
        integrator
            As of :meth:`resolved`.
        du
            Shape (N,).
        time
            For how long.
        """
        return du

    def resolved(self, integrator: Any, du: Array) -> Array:
        """What of a change of the displacement a step resolves, by its matrix as a filter.

        Parameters
        ----------
        integrator
            It has the factors of the last step.
        du
            Shape (N,).
        """
        if not integrator.ready:
            return du
        s = integrator.system
        return integrator.solve(integrator.mass_factor() * s.mass.multiply(du) * s.constraints.free)


def in_steps(scheme: Scheme) -> bool:
    """True of a scheme whose steps are those of :mod:`skfem_ancf.dynamics.steps`."""
    return type(scheme).step is Scheme.step


def same_scheme(a: Scheme, b: Scheme) -> bool:
    """True of schemes of one class with the same numbers.

    Parameters
    ----------
    a, b
        The schemes.
    """
    if type(a) is not type(b):
        return False
    mine, others = vars(a), vars(b)
    return mine.keys() == others.keys() and all(
        x == others[name] if type(x) is float else repr(x) == repr(others[name])
        for name, x in mine.items())
