"""What statics finds: load steps, attempts, results, and why a step fails."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from ..core.types import Array


@dataclass
class LoadStep:
    """One converged load step.

    Attributes
    ----------
    load
        Load factor at its end, 1 is full load.
    iterations
        Linear systems solved, with those of other starts that were tried.
    force_residuals, energy_residuals
        For each iteration the residual in the norm ``sum R_i^2 / K_ii`` and the work of the
        correction ``R . du``, as square roots relative to those of the forces and of the work.
    """

    load: float
    iterations: int = 0
    force_residuals: list = field(default_factory=list)
    energy_residuals: list = field(default_factory=list)


class Attempt(NamedTuple):
    """A strategy that was tried, its iterations, and why it was given up.

    Linear systems of load steps that were given up count; ``failure`` is empty if it succeeded.
    """

    strategy: str
    iterations: int
    failure: str = ""

    def __str__(self):
        s = "" if self.iterations == 1 else "s"
        return f"{self.strategy} ({self.iterations} iteration{s})"


@dataclass
class StaticResult:
    """What the iteration found.

    Attributes
    ----------
    u, multipliers, force
        Displacement (N,), multipliers (m,) and internal force (N,).
    load
        The load factor reached.
    steps
        A :class:`LoadStep` for each load step.
    converged, message
        Whether full load was reached, and in words how.
    rejected
        Load steps that were given up.
    unstable, doubt
        Whether the equilibrium gives way in some direction, and what could not be told.
    memory
        What load steps have left behind at obstacles, shape (n,), or None.
    rubbed
        The work of friction in all load steps.
    diverging
        Whether the equilibrium of the laws' first moduli was no better a start; then it is not
        looked for again.
    attempts
        The strategies that were tried, an :class:`Attempt` each; the last is the one that led here.
    """

    u: Array
    multipliers: Array
    load: float
    force: Array
    steps: list[LoadStep]
    converged: bool
    message: str
    rejected: int = 0
    unstable: bool = False
    doubt: str = ""
    memory: Array | None = None
    rubbed: float = 0.0
    diverging: bool = False
    attempts: tuple[Attempt, ...] = ()

    @property
    def iterations(self) -> int:
        """Linear systems solved for the converged steps, with what was tried for them."""
        return sum(step.iterations for step in self.steps)


class Equilibrium(NamedTuple):
    """What an iteration ends with: displacement (N,), multipliers (m,), internal force (N,)."""

    u: Array
    multipliers: Array
    force: Array


class StepFailed(Exception):
    """A load step did not converge; the message says why, ``load`` at which level."""

    load = 1.0


class Diverging(StepFailed):
    """The first corrections of a load step did not get smaller."""


class Soft(StepFailed):
    """The second correction of the mixed iteration does far more work than the loads."""


class Unstable(StepFailed):
    """A load step ended at an unstable equilibrium, ``found``."""

    def __init__(self, message: str, found: Equilibrium) -> None:
        super().__init__(message)
        self.found = found
