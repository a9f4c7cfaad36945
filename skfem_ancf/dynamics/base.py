"""The state of a motion at an instant, the base class of schemes, differences in time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import factorial
from typing import Any

import numpy as np

from ..core import Array
from ..equations.system import System

#: Fraction of a step below which accelerations are interpolated.
NEAR = 0.1
#: Attributes of a Motion that are stored.
COLUMNS = ("t", "u", "v", "acceleration", "algorithmic", "multipliers", "force", "before",
           "dissipated", "history", "turns", "start")


@dataclass
class Motion:
    """The state of a motion at one instant.

    Attributes
    ----------
    t
        Time.
    u, v, acceleration
        Displacement, velocity and acceleration of the degrees of freedom, shape (N,).
    algorithmic
        The acceleration-like variable w of the scheme, shape (N,).
    multipliers
        Lagrange multipliers of the joints at t, shape (m,).
    force
        Multipliers where the last step evaluates them, which may be within the step, shape (m,).
    before
        Size of the previous step; 0 at the start.
    dissipated
        Work of damping since the start.
    history
        What forces remember, see :class:`~skfem_ancf.equations.histories.Histories`, shape (k,) or
        None.
    turns
        Angles including whole turns, shape (k,), see
        :class:`~skfem_ancf.actions.forces.springs.Turns`.
    memory
        Further data of the scheme for its next step: None, or a dict of numbers and arrays.
    start
        Displacement and history of items at the start of the last step, and its size, shape
        (N + k + 1,), if the forces of contact are means over it; else None.
    parts
        The Motions at the ends of the parts of the last step, or None for a whole one.
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
    history: Array | None = None
    turns: Array | None = None
    memory: dict[str, Any] | None = None
    start: Array | None = None
    parts: "list[Motion] | None" = None


class Motions(Sequence[Motion]):
    """Motions at n instants, by arrays (n, ...) of :data:`COLUMNS`, and their memory by number."""

    # Objects are made at need: they would take as long as the steps of a small model.

    def __init__(self, columns: dict[str, Array],
                 memory: Callable[[int], dict[str, Any] | None] = lambda k: None) -> None:
        self.columns, self._memory = columns, memory

    def __len__(self) -> int:
        return len(self.columns["t"])

    def __getitem__(self, k: Any) -> Any:
        row: dict[str, Any] = {
            name: x[k] if x.ndim > 1 else float(x[k]) for name, x in self.columns.items()}
        row |= {name: None for name in ("history", "start") if not row[name].size}
        return Motion(**row, memory=self._memory(k))


def columns_of(motions: Sequence[Motion]) -> dict[str, Array]:
    """The arrays (nt, ...) of Motions by their names; they are copies."""
    none = np.zeros(0)
    return {name: np.array([none if (x := getattr(y, name)) is None else x for y in motions])
            for name in COLUMNS}


def interpolate(a: Motion, b: Motion, t: float) -> Motion:
    """Interpolate between two instants: cubic Hermite in u, linear in the accelerations."""
    h, s = b.t - a.t, (t - a.t) / (b.t - a.t)
    du, names = b.u - a.u, ("acceleration", "multipliers", "dissipated")
    u = (a.u + s * s * (3 - 2 * s) * du + h * s * (1 - s) ** 2 * a.v + h * s * s * (s - 1) * b.v)
    v = (6 * s * (1 - s) / h * du + (1 - s) * (1 - 3 * s) * a.v + s * (3 * s - 2) * b.v)

    return replace(a, t=t, u=u, v=v, **{
        name: (1 - s) * getattr(a, name) + s * getattr(b, name) for name in names})


class Scheme:
    """A time integration scheme, given by the parameters of generalised-alpha.

    A custom scheme is a subclass with other parameters, or one that overrides :meth:`step`.

    Attributes
    ----------
    order : int
        Order of convergence of displacements and velocities.
    parameters : tuple of float
        alpha_m, alpha_f, beta, gamma. The default is the trapezoidal rule.
    conserving : bool
        Forces are the energy-conserving means over a step, and the equation of motion holds in its
        middle.
    tol : float
        Default tolerance of the iteration in a step, relative, in the energy norm.
    joined : bool
        The scheme works with joints and rigid bodies.
    adaptive : bool
        The scheme estimates its error; ``dt="auto"`` needs it.
    error_constant : float
        C in the local error of the displacement, C dt^(p + 1) d^(p + 1)u/dt^(p + 1), with the
        order p.
    filtered : int
        How often :meth:`resolved` is applied to the estimated error.
    safety : float
        Factor of the estimated error, calibrated by ``benchmarks/tolerances.py``.
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

    def __repr__(self):
        return f"<{type(self).__name__}>"

    def step(self, integrator: Any, y: Motion, dt: float) -> Motion:
        """Advance the motion by one step.

        Schemes that override this method take single steps; others are integrated in blocks. Data
        for the next step belong in the ``memory`` of the result. If the method raises
        TimeStepFailed, two steps of half the size are tried.

        Parameters
        ----------
        integrator
            An :class:`~skfem_ancf.dynamics.integrator.Integrator`; ``integrator.take(y, dt)`` takes
            a step with :attr:`parameters`.
        y, dt
            Start of the step, and its size.
        """
        return integrator.take(y, dt)

    def require(self, system: System) -> None:
        """Raise InputError if the scheme cannot integrate the system."""

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate the error that a step adds to the displacement, shape (N,).

        Parameters
        ----------
        old, new, dt
            Start and end of the step, and its size.
        """
        return self.error_constant * dt**2 * (new.algorithmic - old.algorithmic)

    def near(self, system: System) -> float:
        """Fraction of a step below which accelerations within it are interpolated. In shorter steps
        a finite difference would consist of round-off."""
        return NEAR

    def force_instants(self, y: Motion) -> list[tuple[float, Motion]]:
        """Instants whose forces act in a step that ends at y, or the means of it, each with its
        time: their sum is the impulse."""
        return [(y.before, y)]

    def lasting(self, integrator: Any, du: Array, time: float) -> Array:
        """Average a displacement increment over the time in which damping reduces it, shape (N,).

        Parameters
        ----------
        integrator, du, time
            The integrator of the last step, the increment, shape (N,), and the time span.
        """
        return du

    def resolved(self, integrator: Any, du: Array) -> Array:
        """Filter from a displacement increment what a step does not resolve, shape (N,).

        Parameters
        ----------
        integrator, du
            The integrator of the last step, and the increment, shape (N,).
        """
        return integrator.filtered(du)


def in_blocks(scheme: Scheme) -> bool:
    """True if the scheme does not override ``step``: many steps are taken in one call."""
    return type(scheme).step is Scheme.step


def in_steps(scheme: Scheme) -> bool:
    """True if the scheme is integrated by :mod:`skfem_ancf.dynamics.steps`."""
    return in_blocks(scheme) and not scheme.collocates


# divided differences over the steps of a motion, for error estimates

#: Largest ratio dt |f^(k + 1)| / |f^(k)| in an extrapolation.
GROWTH = 2.0


def difference_row(x: Array) -> Array:
    """Weights (n,) of values at n points in the derivative of order n - 1 of their polynomial."""
    if len(x) < 3:
        return np.ones(1) if len(x) == 1 else np.array([1.0, -1.0]) / (x[0] - x[1])
    gaps = x[:, None] - x
    gaps.flat[::len(x) + 1] = 1.0
    return factorial(len(x) - 1) / gaps.prod(axis=1)


def derivative(old: Motion, new: Motion, t: float, value: Array,
               order: int) -> tuple[int, Array, Array | None]:
    """The two highest derivatives of a function from its values in this step and previous ones."""
    # Returns the order, the derivative of that order and that of one order less, or None; the
    # values are stored in ``new.memory``.
    before = old.memory or {}
    values = np.concatenate([value[None], before.get("values", value[None][:0])])[:order + 1]
    times = np.append(t, before.get("times", ()))[:order + 1]
    new.memory = {**(new.memory or {}), "values": values[:order], "times": times[:order]}
    k = len(times) - 1
    return k, difference_row(times) @ values, (
        difference_row(times[:k]) @ values[:k] if k else None)


def grown(size: Array, lower: Array, missing: int) -> Array:
    """Extrapolate a scaled derivative to a higher one by the ratio of the last two."""
    if not missing:
        return size
    least = np.linalg.norm(lower)
    growth = min(np.linalg.norm(size) / least, GROWTH) if least > 0.0 else 0.0
    return growth**missing * size


