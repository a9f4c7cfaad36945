"""Limit and bifurcation points between two points of a path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.types import Array
from .tracing import Point, Tracer

#: How often a step is halved to separate critical points.
DEPTH = 12


@dataclass
class Critical:
    """A point with a singular tangent stiffness.

    ``kind`` is "limit" or "bifurcation"; ``mode`` (N,) and ``multiplier_mode`` (m,) are the null
    vector, with unit mean displacement over the size of the scene; ``negative`` is the number of
    negative eigenvalues before it, ``change`` the change of that number. Others as in
    :class:`~skfem_ancf.solvers.tracing.Point`.
    """

    kind: str
    u: np.ndarray
    multipliers: np.ndarray
    load: float
    force: np.ndarray
    arc: float
    error: float
    mode: np.ndarray
    multiplier_mode: np.ndarray
    negative: int
    change: int
    history: np.ndarray | None = None


def find_critical(tracer: Tracer, p: Point, q: Point, tol: float) -> list[Critical]:
    """The critical points between two points with tangents, in order."""
    out, stack = [], [(p, q, 0)]
    while stack:
        a, b, depth = stack.pop()
        turns = a.rate * b.rate < 0
        change: Any = None if a.negative is None else b.negative - a.negative
        if not turns and not change:
            continue
        single = change is None or (abs(change) == 1) if turns else abs(change) == 1
        if single or depth == DEPTH:
            if turns and change == 0:
                continue  # a limit point changes the number: these rates are round-off
            if turns:
                out.append(_limit(tracer, p, a, b, tol))
            if not turns or (not single and abs(change) != 1):
                out.append(_bifurcation(tracer, p, a, b, tol))
            continue
        middle = _between(tracer, p, 0.5 * (a.arc + b.arc), b)
        stack += [(middle, b, depth + 1), (a, middle, depth + 1)]
    return out


def _between(tracer, p, arc, b):
    """The point at an arc length after p, or b."""
    return b if arc >= b.arc else tracer.set_tangent(tracer.advance(p, arc - p.arc), p)


def _limit(tracer, p, a, b, tol):
    """The limit point between a and b, by the Illinois method for the rate of the load."""
    end, before = tol * (b.arc - p.arc), a.negative
    change = None if before is None else b.negative - before
    low, high, f, g, best = a, b, a.rate, b.rate, b
    for _ in range(100):
        x = (low.arc * g - high.arc * f) / (g - f)
        best = _between(tracer, p, min(max(x, low.arc + 0.01 * end), high.arc - 0.01 * end), b)
        # parabola of the load, with the second derivative from the rates at both ends
        gap = 0.5 * best.rate**2 * (b.arc - a.arc) / abs(b.rate - a.rate)
        if gap <= 0.1 * tol * abs(best.load):
            break
        if f * best.rate > 0:
            moved, low, f, g = best.arc - low.arc, best, best.rate, 0.5 * g
        else:
            moved, high, g, f = high.arc - best.arc, best, best.rate, 0.5 * f
        if min(moved, high.arc - low.arc) <= end:
            break
    return Critical("limit", best.u, best.multipliers, best.load, best.force, best.arc, best.error,
                    best.tangent, best.multiplier_rate, before, change)


def _bifurcation(tracer, p, a, b, tol):
    """Where the count of negative eigenvalues changes: bisection, and secants of the smallest."""
    end, before, change = tol * (b.arc - p.arc), a.negative, b.negative - a.negative
    mode, values = None, {}
    low, high, best = a, b, b
    for _ in range(100):
        x = 0.5 * (low.arc + high.arc)
        f, g = values.get(low.arc), values.get(high.arc)
        if f is not None and g is not None and f * g < 0:
            guess = (low.arc * g - high.arc * f) / (g - f)
            # overshoot slightly, so that both ends converge
            guess += np.sign(x - guess) * 0.1 * min(guess - low.arc, high.arc - guess)
            x = guess
        best = _between(tracer, p, x, b)
        mode, value = smallest(tracer, best, mode)
        values[best.arc] = value
        low, high = (best, high) if best.negative == before else (low, best)
        if high.arc - low.arc <= end:
            break
    (v, m), _ = mode, value
    v, m = v / tracer.norm(v), m / tracer.norm(v)
    return Critical("bifurcation", best.u, best.multipliers, best.load, best.force, best.arc,
                    best.error, v, m, before, change)


def smallest(tracer: Tracer, point: Point, start: tuple[Array, Array] | None = None
             ) -> tuple[tuple[Array, Array], float]:
    """The eigenvalue closest to zero of the tangent stiffness over its diagonal, and its vector.

    By the inverse power method from ``start``, a vector (N,) and multipliers (m,).
    """
    system = tracer.system
    tracer.factorize(point)
    D, none = np.abs(system.K.diagonal()) * system.constraints.mask, np.zeros(system.constraints.m)
    x = np.random.default_rng(0).standard_normal(system.N) if start is None else start[0]
    x, value = x * system.constraints.mask, np.nan
    for _ in range(12 if start is None else 4):
        x = x / np.sqrt(x @ (D * x))
        y, m = system.solver.solve(D * x, none)
        value = 1.0 / (x @ (D * y))
        x = y
    return (x, m), value
