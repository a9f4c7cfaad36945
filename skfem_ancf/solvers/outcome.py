"""Results of statics: load steps, attempts, and failures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from ..core import Array
from ..equations.evaluation import UNSEEN


@dataclass
class LoadStep:
    """One converged load step.

    Attributes
    ----------
    load
        Load factor at its end; 1 is full load.
    iterations
        Number of linear systems solved, including failed attempts.
    force_residuals, energy_residuals
        For each iteration the residual in the norm ``sum R_i^2 / K_ii`` and the work ``R . du`` of
        the correction, as square roots relative to those of the forces and of the work.
    """

    load: float
    iterations: int = 0
    force_residuals: list = field(default_factory=list)
    energy_residuals: list = field(default_factory=list)


class Attempt(NamedTuple):
    """A strategy that was tried, its iterations, and why it failed ("" if it did not)."""

    strategy: str
    iterations: int
    failure: str = ""

    def __str__(self):
        s = "" if self.iterations == 1 else "s"
        return f"{self.strategy} ({self.iterations} iteration{s})"


@dataclass
class StaticResult:
    """Result of a static solution.

    Attributes
    ----------
    u, multipliers, force
        Displacement (N,), multipliers (m,), and internal force (N,) if known.
    load
        The load factor reached.
    steps
        A :class:`LoadStep` for each load step.
    converged, message
        Whether full load was reached, and how.
    rejected
        Number of rejected load steps.
    unstable, doubt
        Whether the equilibrium is unstable, and doubts about the result.
    memory
        History, shape (n,), or None.
    rubbed
        Work that friction and materials dissipate in all load steps.
    diverging
        Whether the equilibrium of the linearised law was no better start; it is not tried again.
    attempts
        An :class:`Attempt` for each strategy tried; the last one succeeded.
    seen
        What is within the range of the model, see
        :func:`~skfem_ancf.equations.evaluation.examine`.
    """

    u: Array
    multipliers: Array
    load: float
    force: Array | None
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
    seen: int = UNSEEN

    @property
    def iterations(self) -> int:
        """Number of linear systems solved for the converged steps, including failed attempts."""
        return sum([step.iterations for step in self.steps])


class Equilibrium(NamedTuple):
    """Displacement (N,), multipliers (m,), internal force (N,) and range of an equilibrium."""

    u: Array
    multipliers: Array
    force: Array
    seen: int = UNSEEN


class LoadStepFailed(Exception):
    """A load step did not converge; the message says why, ``load`` at which level."""

    load = 1.0


class Diverging(LoadStepFailed):
    """The first corrections of a load step did not decrease."""


class UnboundedMotion(LoadStepFailed):
    """A descent goes on in a motion that nothing restrains."""


class FirstStepTooLarge(LoadStepFailed):
    """The second correction of the mixed iteration did far more work than the loads."""


class Unstable(LoadStepFailed):
    """A load step ended at an unstable equilibrium, ``found``."""

    def __init__(self, message: str, found: Equilibrium) -> None:
        super().__init__(message)
        self.found = found
