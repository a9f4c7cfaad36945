"""Quasi-static runs: a sequence of equilibria in time."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import ConvergenceError, ModelWarning, warn
from ..core.types import Array
from ..equations.stability import largest_displacement
from ..equations.system import System
from .increment import Increment, Options, Route
from .newton import Search
from .newton import Steps as Rules
from .outcome import StaticResult, StepFailed

logger = logging.getLogger(__name__)

#: Fraction of the allowed iterations up to which the next increment grows; its growth; reduction
#: after a failure.
FEW, LARGER, CUT = 0.7, 1.5, 0.25
FOLLOWED, JUMPED, AT_REST = "followed", "jumped", "at rest"
#: Smallest increment from rest, relative to the largest, of scenes that only loads or obstacles
#: support: smaller loads stabilise no better. Two smaller ones are tried if all strategies fail.
CUTS_AT_REST, LAST_AT_REST = CUT**3, CUT**5
#: Iterations of a descent in an increment.
BOUNDED = 40
#: Largest number of consecutive jumps.
JUMPS = 3
#: Increments below this fraction of those asked for are slow; number of slow ones in a row after
#: which the strategies of statics take a whole increment.
SLOW, PATIENCE = 1e-2, 30
#: Largest displacement of a node in an increment: in the first one relative to the scene's size,
#: then relative to that at the last rate, or to the size.
FAR, FASTER, NEAR = 0.05, 4.0, 1e-3


class Instant(NamedTuple):
    """An equilibrium at a time."""

    t: float
    result: StaticResult
    way: str  # how it was found: the name of a strategy
    rate: float | None = None  # largest displacement of a node over the last increment of time


def first(system: System, t: float, u: Array | None, memory: Array | None, rules: Rules,
          stable: bool) -> Instant:
    """The equilibrium at a time, from rest or from a displacement (N,) that need not be one.

    The residual at the displacement is reduced to zero in load steps; ``memory`` is the contact
    history there. A scene that only loads and obstacles stabilise may be at rest before they act.
    """
    if memory is None:
        system.forces.contacts.require_clear(np.zeros(system.N) if u is None else u, t)
    with system.stopped_at(t):
        search = Search(system, u, memory, rules, stable, False)
        if search.stabilised_by_loads:
            try:
                return Instant(t, search.at_rest(), AT_REST)
            except StepFailed:
                logger.debug("t = %.6g: not at rest", t)
        result = search.find()
    return Instant(t, result, result.attempts[-1].strategy)


def follow(system: System, ends: Array, increments: int, begin: Instant, rules: Rules,
           stable: bool) -> Iterator[Instant]:
    """Yield equilibria from ``begin`` on.

    Each follows from the one before, by the mixed iteration, then by Newton's method, or by a
    descent if obstacles or only loads stabilise the scene. An increment that fails or moves the
    scene far is cut, since several equilibria may be close. If the smallest one fails, because the
    equilibrium becomes unstable, the strategies of :func:`~skfem_ancf.solvers.newton.solve_static`
    look for another one under constant loads. If increments stay below a hundredth of those asked
    for, they take the next one as a whole, with a ModelWarning, so that the work is bounded.

    ``ends`` are increasing times; ``increments`` is the number of instants of a grid between two of
    them. Increments end at each of these instants, also after cuts. Raises StepFailed or
    ConvergenceError.
    """
    yield begin
    jumps = slow = 0
    for end in ends[ends > begin.t]:
        grid = np.linspace(begin.t, end, increments + 1)[1:]
        most = (end - begin.t) / increments
        size, least = most, rules.min_step * most
        while begin.t < end:
            stalled = slow > PATIENCE
            if stalled:
                warn(f"from t = {begin.t:.6g} on only increments of {size:.3g} succeed, where "
                     f"{most:.3g} was asked for: the next one is solved as solve_static does, "
                     "whatever the path in between", ModelWarning)
                size, slow = most, 0
            target = grid[grid.searchsorted(begin.t, side="right")]
            parts = np.ceil((target - begin.t) / size - 1e-3)
            t = target if parts <= 1.0 else begin.t + (target - begin.t) / parts
            if begin.way == AT_REST:
                least = max(least, CUTS_AT_REST * most)
            smallest = stalled or size <= least
            try:
                found = _next(system, begin, t, rules, stable, smallest)
            except (StepFailed, ConvergenceError) as failure:
                if smallest and (begin.way != AT_REST or size < 2.0 * LAST_AT_REST * most):
                    raise
                logger.info("t = %.6g failed (%s), increment cut", t, failure)
                size *= CUT
                continue
            jumps = jumps + 1 if found.way.startswith(JUMPED) else 0
            if jumps > JUMPS:
                raise StepFailed(f"at t = {t:.6g} even the smallest increments do not lead from "
                                 "one equilibrium to the next")
            slow = slow + 1 if size < SLOW * most else 0
            if found.result.iterations <= FEW * rules.max_iterations:
                size = min(LARGER * size, most)
            begin = found
            yield begin


def _next(system: System, last: Instant, t: float, rules: Rules, stable: bool,
          smallest: bool) -> Instant:
    """The equilibrium at t; by all strategies if the increment is the smallest."""
    route = Route(last.result.u, None, (1.0, 1.0), (last.t, t))
    start = StaticResult(**vars(last.result) | {
        "load": 0.0, "steps": [], "rejected": 0, "unstable": False, "doubt": "",
        "diverging": False})
    failed: Any = None
    far = FAR * system.size
    if last.rate is not None:
        far = max(NEAR * system.size, FASTER * last.rate * (t - last.t))

    def by_iteration(method):
        options = Options(route, method, rules.tol, rules.max_iterations, method == "mixed",
                          close=True)
        step = Increment(system, start, 1.0, options)
        with np.errstate(all="ignore"):  # overflow shows in the residual
            return step.reached(step.solve(stable))

    with system.stopped_at(t), system.histories.lent(span=t - last.t):
        search = Search(system, last.result.u, last.result.memory, rules, stable, False)
        bounded = search.touches or search.stabilised_by_loads
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
        logger.info("t = %.6g: %s, looking for another equilibrium", t, failed)
        result = search.find()
        result.rubbed += last.result.rubbed
    moved = largest_displacement(system, result.u - last.result.u)
    way = FOLLOWED if moved <= far else f"{JUMPED} by {result.attempts[-1].strategy}"
    return Instant(t, result, way, moved / (t - last.t))
