"""Arc-length continuation past limit, snap-back and bifurcation points."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np

from ..core.errors import (CallbackError, ConvergenceError, InputError, Interrupted, ask,
                           require_function, require_integer, require_positive, shown)
from ..core.progress import progress_bar
from ..equations.system import System
from .critical import Critical, find_critical
from .tracing import Failed, Point, Tracer

logger = logging.getLogger(__name__)
#: Largest number of steps.
MAX_STEPS = 10**6
#: Deviation of a step from a straight line, relative to its length and to the load.
TURN = 0.03
#: Shortest step, relative to ds.
SHORTEST = 1e-6


def continuation(system: System, steps: int = 100, ds: float = 0.02, ds_max: float | None = None,
                 max_load: float | None = None, until: Callable[[Point], bool] | None = None,
                 tol: float = 1e-8, max_iterations: int = 15, locate: float | None = 1e-8,
                 branch: Critical | None = None, side: int = 1,
                 progress: bool | None = None) -> tuple[list[Point], list[Critical]]:
    """Follow the equilibrium path from the reference configuration or from a bifurcation point.

    A step advances by ``ds`` along the tangent of the path, in the norm of the mean nodal
    displacement over the size of the scene; the load factor is an unknown. For loads that move no
    node, such as heat between walls, the norm includes the strain that their forces could cause.
    Steps get shorter where the path or the load turns, or iterations increase. The geometric
    stiffness uses the independent stress of the mixed iteration. Materials with a history follow
    the path, at once: time stands still. Their tangent is that of further loading.

    Where the load turns, or the number of negative eigenvalues of the tangent changes, the limit or
    bifurcation point within the step is computed.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    steps
        Largest number of steps, at most 10**6.
    ds
        Initial arc length, relative to the size of the scene; later ones adapt.
    ds_max
        Largest arc length; 5 ds by default.
    max_load
        Stop at this absolute load factor; the last point is there.
    until
        A function of a :class:`Point` that returns True to stop, as ``lambda p:
        p.displacement("right")[1] < -0.1``.
    tol
        Relative error of a correction in the energy norm.
    max_iterations
        Iterations before a step is halved.
    locate
        Tolerance at critical points: relative load of a limit point, and arc length of a
        bifurcation point relative to its step. None disables the search.
    branch
        A bifurcation point of an earlier path: follow the path that branches off along its mode.
    side
        1 or -1: along or against the mode.
    progress
        Show a progress bar: True, False, or None for long runs only.

    Returns
    -------
    points, critical : list of Point, list of Critical

    References
    ----------
    Riks: "An incremental approach to the solution of snapping and buckling problems",
    International Journal of Solids and Structures 15 (1979); Magisano, Leonetti, Garcea, CMAME 313
    (2017).
    """
    steps = require_integer("steps", steps, 1, MAX_STEPS)
    ds = require_positive("ds", ds)
    ds_max = 5.0 * ds if ds_max is None else require_positive("ds_max", ds_max)
    limit = np.inf if max_load is None else require_positive("max_load", max_load)
    locate = None if locate is None else require_positive("locate", locate)
    if until is not None:
        require_function("until", until, "of a point of the path that returns True or False")
    if require_integer("side", side, -1, 1) == 0:
        raise InputError("side must be 1 or -1, got 0")
    tracer = Tracer(system, require_positive("tol", tol),
                    require_integer("max_iterations", max_iterations, 1, 10000))
    critical: list[Critical] = []
    with system.histories.lent(None if branch is None else branch.history), progress_bar(
            progress, total=steps, desc="path") as bar:
        points, step = [_start(tracer, branch, side)], ds
        while len(points) <= steps:
            start, straight = points[-1], branch is None or len(points) > 1
            try:
                point, bend = _step(tracer, start, step)
                if straight and bend > 4.0 * TURN and step > ds / 64.0:
                    raise Failed("the path turns")
                last = abs(point.load) >= limit
                if last:
                    point = _land(tracer, start, point, float(np.copysign(limit, point.load)))
                found = find_critical(tracer, start, point, locate) if (
                    locate is not None and straight) else []
            except (Failed, ConvergenceError) as failure:  # that of a law
                step *= 0.5
                logger.info("arc length halved to %.3g: %s", step, failure)
                if step < SHORTEST * ds:
                    raise ConvergenceError(
                        f"the path could not be followed beyond load {start.load:.6g}: "
                        f"{failure}; more elements or a smaller ds may help",
                        (points, critical)) from None
                continue
            except KeyboardInterrupt:
                raise Interrupted(f"stopped at the load {start.load:.6g}; the exception's state is "
                                  "the path up to there", (points, critical)) from None
            for one in [*found, point]:
                one.history = system.histories.after(start, one)
            system.histories.put(point.history)
            critical += found
            points.append(point)
            bar.update(1)
            if last or (until is not None and _ends(until, point)):
                break
            growth = np.sqrt(6.0 / max(point.iterations, 1))
            if straight and bend > 0:
                growth = min(growth, np.sqrt(TURN / bend))
            step = min(ds_max, step * np.clip(growth, 0.5, 1.5))
    return points, critical


def _ends(until, point):
    """The checked result of the user's function."""
    answer = ask("until(point)", until, point)
    if not isinstance(answer, (bool, np.bool_)):
        raise CallbackError(f"until(point) must return True or False, got {shown(answer)}")
    return answer


def _start(tracer, branch, side):
    """The first point of a path."""
    if branch is None:
        point = tracer.stress_free()
        try:
            return tracer.begin(point)
        except Failed as failure:
            raise ConvergenceError(f"the path cannot begin: {failure}", ([point], [])) from None
    point = Point(tracer.system, branch.u, branch.multipliers, branch.load, branch.force, 0.0,
                  branch.error, 0)
    point.tangent, point.multiplier_rate = side * branch.mode, side * branch.multiplier_mode
    point.rate, point.negative, point.history = 0.0, branch.negative, branch.history
    return point


def _step(tracer, start, ds):
    """The next point with its tangent, and the deviation from a straight line."""
    point = tracer.set_tangent(tracer.advance(start, ds), start)
    mean = 0.5 * ds * (start.tangent + point.tangent)
    bend = tracer.norm(point.u - start.u - mean) / ds
    scale = max(abs(start.load), abs(point.load))
    if scale > 0:
        gap = point.load - start.load - 0.5 * ds * (start.rate + point.rate)
        bend = max(bend, abs(gap) / scale)
    return point, bend


def _land(tracer, start, point, load):
    """The point between two at which the load is reached."""
    h, low, high, x = point.arc - start.arc, 0.0, 1.0, 1.0
    for _ in range(60):  # bisection of the cubic interpolation of the load
        x = 0.5 * (low + high)
        low, high = (x, high) if abs(load_between(start, point, x)) < abs(load) else (low, x)
    near = point
    if x < 1.0 - 1e-9:
        near = tracer.set_tangent(tracer.advance(start, x * h), start)
    ds = (load - near.load) / near.rate
    landed = tracer.at_load(near, load, (ds * near.tangent, ds * near.multiplier_rate))
    landed.load, landed.arc = load, near.arc + ds
    return tracer.set_tangent(landed, start)


def load_between(p: Point, q: Point, x: float) -> float:
    """Cubic interpolation of the load at a fraction x of the arc length between two points."""
    h = q.arc - p.arc
    a, b = p.load, h * p.rate
    c = 3 * (q.load - a) - 2 * b - h * q.rate
    d = -2 * (q.load - a) + b + h * q.rate
    return a + x * (b + x * (c + x * d))
