"""Quasi-static runs: equilibria from one time to the next, each from the one before."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..core.types import Array
from ..equations.stability import largest_displacement
from ..equations.system import System
from .increment import Increment, Options, Route
from .newton import Search
from .newton import Steps as Rules
from .outcome import StaticResult, StepFailed

logger = logging.getLogger(__name__)

#: Iterations of an increment, over those at most, up to which the next one may be larger; by how
#: much, and what is left of one that has failed.
FEW, LARGER, CUT = 0.7, 1.5, 0.25
FOLLOWED, JUMPED = "followed", "jumped"
#: Iterations of corrections of bounded size in an increment, at most.
BOUNDED = 20
#: Jumps one after the other, each of the smallest increment.
JUMPS = 3
#: Largest displacement of a node in an increment that is not the smallest: in the first relative to
#: the scene's size, then over that at the rate of the increment before, or relative to the size.
FAR, FASTER, NEAR = 0.05, 4.0, 1e-3


class Instant(NamedTuple):
    """An equilibrium at a time.

    Attributes
    ----------
    t, result
        The time, and a :class:`~skfem_ancf.solvers.outcome.StaticResult`.
    way
        How it was found: the name of a strategy.
    rate
        The largest displacement of a node since the one before, over the time between; or None.
    """

    t: float
    result: StaticResult
    way: str
    rate: float | None = None


def first(system: System, t: float, u: Array | None, memory: Array | None, rules: Rules,
          stable: bool) -> Instant:
    """The equilibrium at a time, from a displacement (N,) that need be none, or from rest.

    From a displacement what is missing to equilibrium, as the force of a support that is no longer
    there, is reduced to nothing. ``memory`` is what is left behind there at obstacles. What only
    loads and obstacles hold need not be held before these act.
    """
    with system.stopped_at(t):
        search = Search(system, u, memory, rules, stable, False)
        if search.held_by_loads:
            try:
                return Instant(t, search.at_rest(), "at rest")
            except StepFailed:
                logger.debug("t = %.6g: something acts", t)
        result = search.find()
    return Instant(t, result, result.attempts[-1].strategy)


def follow(system: System, ends: Array, increments: int, begin: Instant, rules: Rules,
           stable: bool) -> Iterator[Instant]:
    """Equilibria from the one given on, one after the other.

    Each is looked for from the one before, by the mixed iteration, then by Newton's method or,
    where obstacles or only loads hold the scene, by corrections of bounded size. An increment that
    fails is cut, and one that moves the scene far: several equilibria may be near.
    Where the smallest fails, because the equilibrium gives way there, the strategies of
    :func:`~skfem_ancf.solvers.newton.solve_static` lead from the last one to another, as under
    loads that stay.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    ends
        Times at which an increment has to end, ascending.
    increments
        Increments from one end to the next at least.
    begin
        The equilibrium to begin with.
    rules, stable
        Of each increment, as for :func:`~skfem_ancf.solvers.newton.solve_static`.

    Raises
    ------
    StepFailed, ConvergenceError
        If an equilibrium is not found; what was found before has been given.
    """
    yield begin
    jumps = 0
    for end in ends[ends > begin.t]:
        most = (end - begin.t) / increments
        size = most
        while begin.t < end:
            t = end if begin.t + 1.001 * size >= end else begin.t + size
            smallest = size <= rules.min_step * most
            try:
                found = _next(system, begin, t, rules, stable, smallest)
            except StepFailed as failure:
                logger.info("t = %.6g failed (%s), increment cut", t, failure)
                size *= CUT
                continue
            jumps = jumps + 1 if found.way.startswith(JUMPED) else 0
            if jumps > JUMPS:
                raise StepFailed(f"at t = {t:.6g} even the smallest increments do not lead from "
                                 "one equilibrium to the next")
            if found.result.iterations <= FEW * rules.max_iterations:
                size = min(LARGER * size, most)
            begin = found
            yield begin


def _next(system: System, last: Instant, t: float, rules: Rules, stable: bool,
          smallest: bool) -> Instant:
    """The equilibrium at t; by all strategies where the increment is the smallest."""
    route = Route(last.result.u, None, (1.0, 1.0), (last.t, t))
    start = replace(last.result, load=0.0, steps=[], rejected=0, unstable=False, doubt="",
                    diverging=False)
    failed: Any = None
    far = FAR * system.size
    if last.rate is not None:
        far = max(NEAR * system.size, FASTER * last.rate * (t - last.t))

    def by_iteration(method):
        options = Options(route, method, rules.tol, rules.max_iterations, method == "mixed",
                          close=True)
        step = Increment(system, start, 1.0, options)
        with np.errstate(all="ignore"):  # what overflows is seen in the residual
            return step.reached(step.solve(stable))

    with system.stopped_at(t), system.forces.contacts.lent():
        search = Search(system, last.result.u, last.result.memory, rules, stable, False)
        bounded = search.touches or search.held_by_loads
        for method in ("mixed", "descent" if bounded else "newton"):
            try:
                result = (search.descent("mixed", most=BOUNDED) if method == "descent" else
                          by_iteration(method))
            except StepFailed as failure:
                failed = failure
                continue
            moved = largest_displacement(system, result.u - last.result.u)
            if moved > far and not smallest:
                failed = StepFailed(f"a node moves by {moved:.3g}")
                continue
            if method == "descent":
                result.rubbed += last.result.rubbed
            way = FOLLOWED if moved <= far else f"{JUMPED} by {method}"
            return Instant(t, result, way, moved / (t - last.t))
        if not smallest:
            raise failed
        logger.info("t = %.6g: %s, going on to another equilibrium", t, failed)
        result = search.find()
        result.rubbed += last.result.rubbed
    return Instant(t, result, f"{JUMPED} by {result.attempts[-1].strategy}")
