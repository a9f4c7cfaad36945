"""Newton's method with automatic load steps, and the mixed integration point iteration."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import (ConvergenceError, InputError, Interrupted, require_finite, require_flag,
                           require_integer, require_option, require_positive, taught)
from ..core.linalg import INACCURATE
from ..core.callbacks import handle_of
from ..core.progress import progress_bar
from ..core.switch import expecting
from . import stability
from .iteration import (CONVERGED, NOT_CONVERGED, NOT_FINITE, SINGULAR, Rules, Target, Unknowns,
                        equilibrium, room_for_iterations)
from .touching import found_touching

if TYPE_CHECKING:
    from ..equations.system import System
    from ..core.types import Array

logger = logging.getLogger(__name__)

#: Iterations in a load step that are expected, about, and at most.
ITERATIONS = 10
MAX_ITERATIONS = 10000
#: Corrections of the pressure of obstacles in a load step, at most.
AUGMENTED = 50
#: Relative error of an equilibrium that is only a start.
NEAR = 1e-2
#: Iterations to a start, at most.
SOON = 15
METHODS = ("mixed", "newton")


@dataclass
class LoadStep:
    """One converged load step.

    Attributes
    ----------
    load
        Load factor at its end, 1 is full load.
    iterations
        Linear systems solved.
    force_residuals, energy_residuals
        For each iteration the residual in the norm ``sum R_i^2 / K_ii`` and the work of the
        correction ``R . du``, as square roots relative to those of the forces and of the work.
    """

    load: float
    iterations: int
    force_residuals: list = field(default_factory=list)
    energy_residuals: list = field(default_factory=list)


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
    memory
        What load steps have left behind at obstacles, shape (n,), or None.
    astray
        Whether the equilibrium of the laws' first moduli was no better a start; then it is not
        looked for again.
    unstable, doubt
        Whether the equilibrium gives way in some direction, and what could not be told.
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
    astray: bool = False

    def followed_by(self, record: LoadStep, **changes: Any) -> StaticResult:
        """The result after a load step more.

        Parameters
        ----------
        record
            The load step.
        **changes
            What it has changed.
        """
        other = object.__new__(type(self))
        vars(other).update(vars(self), steps=[*self.steps, record], **changes)
        return other

    @property
    def iterations(self) -> int:
        """Linear systems solved in the converged steps."""
        return sum(step.iterations for step in self.steps)


@taught
def solve_static(system: System, u: Array | None = None, method: str = "mixed", tol: float = 1e-8,
                 max_iterations: int = 30, first_step: float = 1.0, min_step: float = 1e-4,
                 progress: bool | None = None, stable: bool = True,
                 memory: Array | None = None) -> StaticResult:
    """Find the equilibrium at full load.

    The load is applied in steps: the first is ``first_step`` of it, a step that fails is cut to a
    quarter, a step that goes well doubles the next. The iteration has converged when the
    correction's work ``R . du`` is below ``tol^2`` times the work done, and the residual, in the
    norm ``sqrt(sum R_i^2 / K_ii)`` in which no unit matters, is below ``tol`` times that of the
    forces; both with the round-off of the strain as a floor.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u
        Displacement to start from, shape (N,); the stress-free state by default. Load steps lead
        from it to the equilibrium under the full load, whatever holds it in its place.
    method
        "mixed": the geometric part of the tangent uses a stress that is carried from one iterate
        to the next by its linearisation. "newton": it uses the stress of the strain. The solution
        is the same.
    tol
        Relative error of a correction in the energy norm.
    max_iterations
        Iterations before a step is given up and cut.
    first_step, min_step
        Parts of the load.
    progress
        Show a progress bar: True, False, or None for "if it takes long".
    stable
        Take no unstable equilibrium: a step that lands on one is cut, and where the path itself
        loses its stability the solution goes on along the direction that gives way, see
        :func:`~skfem_ancf.solvers.stability.descend`. False takes any.
    memory
        What load steps had left behind at obstacles, at the displacement ``u``; shape (n,).

    Returns
    -------
    StaticResult

    Raises
    ------
    ConvergenceError
        If the step falls below ``min_step``; the error has the last converged ``StaticResult`` as
        ``state``.

    References
    ----------
    Magisano, Leonetti, Garcea: "How to improve efficiency and robustness of the Newton method in
    geometrically non-linear structural problem discretized via displacement-based finite
    elements", Computer Methods in Applied Mechanics and Engineering 313 (2017).
    """
    require_option("method", method, METHODS)
    require_flag("stable", stable)
    tol, min_step = require_positive("tol", tol), require_positive("min_step", min_step)
    if not 0.0 < require_positive("first_step", first_step) <= 1.0:
        raise InputError(f"first_step must lie in (0, 1], got {first_step!r}")
    max_iterations = require_integer("max_iterations", max_iterations, 1, MAX_ITERATIONS)
    steps = 1.0 + max(0.0, np.log2(1.0 / first_step))  # each is twice as long as the one before
    with system.forces.contacts.lent(), expecting(ITERATIONS * steps):
        return _load_steps(system, u, memory, stable, (first_step, min_step),
                           (method, tol, max_iterations), progress)


def _load_steps(system, u, memory, stable, steps, options, progress):
    """As :func:`solve_static`, with options that are known to be good."""
    (first_step, min_step), max_iterations = steps, options[-1]
    origin, contacts = (np.zeros(system.N), None), system.forces.contacts
    memory = contacts.begin(origin[0] if u is None else u, 0.0 if u is None else 1.0, memory)
    if u is not None:
        u = require_finite("u", u, (system.N,))
        missing = system.external_force(u) - system.internal_force(u)
        origin = u.copy(), missing * system.mask
    u = origin[0].copy()
    result = StaticResult(u, np.zeros(system.m), 0.0, np.zeros(system.N), [], False,
                          "no load step has converged", memory=memory)
    step, cuts = float(first_step), 0
    options = origin, *options
    with progress_bar(progress, total=1.0, desc="load") as bar:
        while result.load < 1.0:
            load = min(1.0, result.load + step)
            if load > 1.0 - 1e-12:
                load = 1.0
            record = LoadStep(load, 0)
            try:
                with np.errstate(all="ignore"):  # what overflows is seen in the residual
                    found = _step(system, result, load, options, record, stable)
            except _Failed as failure:
                result.rejected += 1
                cuts += isinstance(failure, _Unstable)
                logger.info("load %.6g failed (%s), step cut", load, failure)
                step = 0.25 * (load - result.load)
                found = None
                if stable and (cuts > stability.CUTS or step < min_step):
                    found = _rescue(system, result, load, options, record, failure)
                if found is None:
                    if step < min_step:
                        result.message = _lost(result, load, min_step, failure)
                        raise ConvergenceError(result.message, result) from None
                    continue
                step *= 4.0
            except KeyboardInterrupt:
                raise Interrupted(f"stopped at the load level {result.load:.6g}; the exception's "
                                  "state is what has converged", result) from None
            bar.update(load - result.load)
            u, multipliers, force = found
            contacts.settle(u, _acting(options, load)[1])
            # one assignment: who interrupts finds the old result or the new one
            result = result.followed_by(
                record, u=u, multipliers=multipliers, force=force, load=load,
                memory=contacts.remember())
            cuts = 0
            logger.info("load %.6g converged in %d iterations", load, record.iterations)
            if record.iterations <= max(8, max_iterations // 3):
                step *= 2.0
    result.converged = True
    result.message = f"converged in {len(result.steps)} load steps, {result.iterations} iterations"
    if result.doubt:
        result.message += f"; {result.doubt}"
    return result


def _lost(result, load, min_step, failure):
    """Why there is no solution beyond the last load step."""
    text = (f"no equilibrium found beyond the load level {result.load:.6g}: {failure} at "
            f"{load:.6g}, and steps below {min_step:g} are not tried. ")
    if isinstance(failure, _Unstable):
        return text + ("No stable one was found either from there: stable=False takes the unstable "
                       "one, scene.continuation() follows the path")
    return text + ("Beyond a limit point there is none: use scene.continuation(); else more "
                   "elements or a larger max_iterations may help")


class _Failed(Exception):
    """A load step did not converge; the message says why."""


class _Astray(_Failed):
    """The first corrections of a load step did not get smaller."""


class _Unstable(_Failed):
    """A load step ended at an unstable equilibrium, ``found``."""

    def __init__(self, message, found):
        super().__init__(message)
        self.found = found


def _step(system, result, load, options, record, stable):
    """One load step: a stable equilibrium if that is wanted."""
    full, at = _acting(options, load)
    found = _augmented(system, result, load, options, record, at)
    passed = system.forces.contacts.passed((result.u, _acting(options, result.load)[1]),
                                           (found[0], at))
    if passed:
        raise _Failed(passed)
    if not stable or result.unstable:
        return found
    if not stability.holds(system, found[0], full, found[1], at):
        raise _Unstable("the equilibrium found is unstable", found)
    if result.rejected and not stability.heads_on(system, result, found[0], load, options[0]):
        raise _Unstable("the equilibrium found lies on the other side", found)
    return found


def _augmented(system, result, load, options, record, at):
    """The equilibrium, again until obstacles that ask for it are entered no deeper than that."""
    contacts = system.forces.contacts
    contacts.put_back(result.memory)
    found = _touching(system, result, load, options, record)
    if not contacts.augmented:
        return found
    for _ in range(AUGMENTED):
        if contacts.augment(found[0], at) == 0:
            return found
        found = _from(found, system, result, load, options, record)
    raise _Failed(f"the penetration of obstacles is above its tolerance after {AUGMENTED} "
                  "corrections of the pressure")


def _touching(system, result, load, options, record):
    """The equilibrium; where there are obstacles, by :mod:`skfem_ancf.solvers.touching`."""
    contacts, (origin, method, tol, most) = system.forces.contacts, options
    if not contacts.obstacles:
        return _found(system, result, load, options, record)
    at = _acting(options, load)[1]

    def solve(start, rough):
        one, chosen = LoadStep(load, 0), options
        if rough:
            chosen = origin, method, max(tol, NEAR), min(most, SOON)
        try:
            if start is None:
                return _found(system, result, load, chosen, one)
            return _from(start, system, result, load, chosen, one)
        finally:
            vars(record).update(vars(_both(record, one)))

    return found_touching(contacts, (result.u, _acting(options, result.load)[1]), at, solve,
                          lambda u: system.strain_energy(u, at), _Failed)


def _both(first, then):
    """The records of two iterations of a load step as one."""
    return LoadStep(then.load, first.iterations + then.iterations,
                    first.force_residuals + then.force_residuals,
                    first.energy_residuals + then.energy_residuals)


def _found(system, result, load, options, record):
    """The equilibrium; where a law is left behind on the way, from that of its first moduli.

    A correction that turns the beam far strains it for once, more than a law may bear that others
    than Hooke's are; the equilibrium that Hooke's finds is close to theirs.
    """
    machine = None if result.astray else system.machine.linearised
    if machine is None:
        return _iterate(system, result, load, options, record)
    try:
        return _iterate(system, result, load, options, record, wary=True)
    except _Failed as failed:
        failure = failed
    try:
        origin, method, tol, most = options
        close = _iterate(system, result, load, (origin, method, max(tol, NEAR), most), record,
                         machine=machine)
        return _from(close, system, result, load, options, record)
    except _Failed:
        result.astray = True
    if isinstance(failure, _Astray):
        return _iterate(system, result, load, options, record)
    raise failure


def _from(found, system, result, load, options, record, descent=None):
    """Iterate on from what has been found; the record takes both."""
    one = LoadStep(load, 0)
    try:
        return _iterate(system, replace(result, u=found[0], multipliers=found[1]), load, options,
                        one, descent)
    finally:
        vars(record).update(vars(_both(record, one)))


def _acting(options, load):
    """Load factor and time: a start from a given state has the full load all along."""
    return (load, load) if options[0][1] is None else (1.0, 1.0)


def _rescue(system, result, load, options, record, failure):
    """What :func:`_step` returns, from where the path has lost its stability; or None."""
    full, at = _acting(options, load)
    at_rest = isinstance(failure, _Unstable) and options[0][1] is None and not result.steps
    if at_rest and (weak := stability.weak_at_rest(system)):
        raise ConvergenceError(weak, result)
    if not isinstance(failure, _Unstable) and not stability.gives_way(system, result, load):
        return None
    if not stability.has_potential(system, result.u, full):
        if not isinstance(failure, _Unstable):
            return None
        result.unstable = True
        result.doubt = (f"the path is unstable from the load level {load:.6g} on, and its loads "
                        "have no potential that would lead to a stable equilibrium")
        return failure.found
    origin, method, tol, _ = options

    def iterate(u, multipliers, descent):
        return _from((u, multipliers), system, result, load,
                     (origin, method, tol, stability.DESCENT), record, descent)

    with np.errstate(all="ignore"):
        found, turned = stability.way_down(system, result, load, full, at, origin, iterate, _Failed)
    if turned and not result.doubt:
        result.doubt = (
            f"the path loses its stability between the load levels {result.load:.6g} and "
            f"{load:.6g}, the solution went on along the direction that gives way to a stable "
            "equilibrium, which need not be the only one")
    return found


def _iterate(system, result, load, options, record, descent=None, machine=None, wary=False):
    """Iterate to equilibrium at one load; returns displacement, multipliers, internal force.

    The start is the displacement at load 0 and what was missing there to equilibrium under the
    full load, or None for the stress-free state; the missing part is reduced to nothing.
    """
    start, method, tol, max_iterations = options
    machine = machine or system.machine
    tables = machine.tables
    target = _target(system, result, load, start)
    rules = rules_of(system, method, tol, max_iterations, wary)
    room, solver = machine.room(room_for_iterations, system.m), None
    if descent is not None:
        solver = descent
    elif tables.plain.border.wide:
        solver = system
    while True:
        if solver is not None:
            rules = rules._replace(solver=handle_of(solver))
        x = Unknowns(result.u.copy(), result.multipliers.copy(), np.empty(system.N),
                     tables.stresses, tables.stresses)
        residuals = np.zeros((max_iterations + 1, 2))
        status, n = machine.of(equilibrium)(target, rules, x, room, residuals)
        if status != SINGULAR or solver is not None:
            break
        solver = system  # factors with exchanges of rows, or sparse ones
    record.iterations = n
    record.force_residuals = residuals[:n + 1, 0].tolist()
    record.energy_residuals = residuals[:n, 1].tolist()
    if status == NOT_CONVERGED and n < max_iterations:
        raise _Astray("the first corrections do not get smaller")
    if status != CONVERGED:
        raise _Failed(_ENDS[status].format(max_iterations))
    if system.inverted(x.u):
        raise _Failed("the body is turned inside out")
    if system.lost(x.u):
        raise _Failed(system.lost(x.u))
    if solver is None:
        if n:
            system.take_factors(room.factors)
        else:
            system.K.clear()
    return x.u, x.multipliers, x.force


def rules_of(system: System, method: str, tol: float, max_iterations: int,
             wary: bool = False) -> Rules:
    """When an iteration of a system has converged.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    method, tol, max_iterations
        As for :func:`solve_static`.
    wary
        It ends where the first corrections do not get smaller.
    """
    floor = 8.0 * system.work_noise
    # the residual sums the noise of all coordinates, the work that of the strains
    return Rules(int(method == "mixed"), max_iterations, tol, floor, floor * system.noise,
                 INACCURATE, 0, int(wary))


_ENDS = {SINGULAR: "the tangent is singular", NOT_FINITE: "the strain is not finite",
         NOT_CONVERGED: "no convergence in {} iterations"}


def _target(system, result, load, start):
    """The Target of a load level."""
    tables, (u0, gap) = system.machine.tables, start
    full, at = (load, load) if gap is None else (1.0, 1.0)
    values = system.values(at)
    if gap is not None:
        values = u0[system.fixed] + load * (values - u0[system.fixed])
        gap = (1.0 - load) * gap
    before = full if gap is not None else result.load
    factors = tables.static_factors(full)
    return Target(factors, tables.static_factors(full, before) if tables.prestressed else factors,
                  full, at, *tables.at(at),
                  np.zeros(system.N) if gap is None else gap, values - result.u[system.fixed])
