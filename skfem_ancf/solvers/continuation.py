"""Arc-length continuation past limit, snap-back and bifurcation points."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from ..core import (NO_FACTORS, Array, CallbackError, ConvergenceError, Interrupted, ask,
                    progress_bar, refuse, require_function, require_integer, require_positive,
                    shown)
from ..equations.convergence import (correction_size, force_size, is_balanced, is_small,
                                     joint_gap, rules_of)
from ..equations.evaluation import invert
from ..equations.stability import position_weights
from ..equations.system import System
from ..results.path import CriticalPoint
from ..results.state import MaterialPoints, State
from .iteration import LoadStepFailed

logger = logging.getLogger(__name__)
#: Largest number of steps.
MAX_STEPS = 10**6
#: Deviation of a step from a straight line, relative to its length and to the load.
TURN = 0.03
#: Shortest step, relative to ds.
SHORTEST = 1e-6
#: Relative motion of the nodes below which the load counts in the arc length.
STILL = 1e-3
#: How often a step is halved to separate critical points.
DEPTH = 12


@dataclass(eq=False, repr=False)
class Point(MaterialPoints):
    """An equilibrium of a path.

    ``displacement(point)`` and ``position(point)`` are as those of a State; ``state`` is one, with
    strain, stress, section forces and reactions. ``u`` (N,), ``multipliers`` (m,), ``load`` and
    ``force`` (N,) are its data; ``arc`` is the arc length from the start, ``error`` the error that
    the last correction leaves in the energy norm, relative to the work done, ``iterations`` the
    linear systems solved. ``rate``, ``tangent`` (N,) and ``multiplier_rate`` (m,) are derivatives
    of load, displacement and multipliers by the arc length, at a critical point the null vector.
    ``negative`` is the number of negative eigenvalues of the tangent stiffness on the null space of
    J, None if loads have no potential.
    """

    system: System
    u: Array
    multipliers: Array
    load: float
    force: Array
    arc: float = 0.0
    error: float = 0.0
    iterations: int = 0
    rate: Any = np.nan
    tangent: Any = None
    multiplier_rate: Any = None
    negative: Any = None
    history: Any = None

    @property
    def v(self) -> Array:  # type: ignore[override]
        return np.zeros_like(self.u)

    @property
    def state(self) -> State:
        return State(self.system, self.u, self.load, self.force, True, self.iterations,
                     "a point of a path", (), self.multipliers, memory=self.history)

    @property
    def stable(self) -> bool | None:
        return None if self.negative is None else self.negative == 0


def continuation(system: System, steps: int = 100, ds: float = 0.02, ds_max: float | None = None,
                 max_load: float | None = None, until: Callable[[Point], bool] | None = None,
                 tol: float = 1e-8, max_iterations: int = 15, locate: float | None = 1e-8,
                 branch: CriticalPoint | None = None, side: int = 1,
                 progress: bool | None = None) -> tuple[list[Point], list[CriticalPoint]]:
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
        Relative error in the energy norm, see :mod:`skfem_ancf.equations.convergence`.
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
    points, critical : list of Point, list of CriticalPoint

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
    refuse(require_integer("side", side, -1, 1) == 0, "side must be 1 or -1, got 0")
    tracer = Tracer(system, require_positive("tol", tol),
                    require_integer("max_iterations", max_iterations, 1, 10000))
    critical: list[CriticalPoint] = []
    with progress_bar(progress, total=steps, desc="path") as bar:
        tracer.system = system.after(None if branch is None else branch.state.memory)
        points, step = [_start(tracer, branch, side)], ds
        while len(points) <= steps:
            start, straight = points[-1], branch is None or len(points) > 1
            try:
                point = tracer.advance(start, step)
                bend = _bend(tracer, start, point, step)
                if straight and bend > 4.0 * TURN and step > ds / 64.0:
                    raise LoadStepFailed("the path turns")
                last = abs(point.load) >= limit
                if last:
                    point = _land(tracer, start, point, float(np.copysign(limit, point.load)))
                found = _criticals(tracer, start, point, locate) if locate and straight else []
            except (LoadStepFailed, ConvergenceError) as failure:  # that of a law
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
            for kind, one, change in found:
                one.history = _history_at(one, start)
                critical.append(CriticalPoint(kind, one.load, one.arc, one.state.replace(
                    message=f"{kind} point"), one.tangent, change, one))
            point.history = _history_at(point, start)
            tracer.system = system.after(point.history)
            points.append(point)
            bar.update(1)
            ends = last or (until is not None and ask("until(point)", until, point))
            if not isinstance(ends, (bool, np.bool_)):
                raise CallbackError(f"until(point) must return True or False, got {shown(ends)}")
            if ends:
                break
            growth = np.sqrt(6.0 / max(point.iterations, 1))
            if straight and bend > 0:
                growth = min(growth, np.sqrt(TURN / bend))
            step = min(ds_max, step * np.clip(growth, 0.5, 1.5))
    return points, critical


def _bend(tracer, a, b, ds):
    """The deviation of a path between two points, a step ds apart, from a straight line."""
    bend = tracer.norm(b.u - a.u - 0.5 * ds * (a.tangent + b.tangent)) / ds
    scale = max(abs(a.load), abs(b.load))
    gap = b.load - a.load - 0.5 * ds * (a.rate + b.rate)
    return max(bend, abs(gap) / scale) if scale > 0 else bend


class Tracer:
    """Corrector and tangent of the equilibrium path of a system."""

    def __init__(self, system: System, tol: float = 1e-8, max_iterations: int = 15) -> None:
        self.whole, self.rules = system, rules_of(system, "mixed", tol, max_iterations)
        #: after the history of the last point
        self.system = system
        weights = position_weights(system)
        self.weights = weights / (0.5 * weights.sum() * system.size**2)
        self.unit = system.constraints.values(1.0) - system.constraints.values(0.0)
        #: weight of the load in the arc length, if it hardly moves the nodes
        self.of_load: float = 0.0

    def norm(self, v: Array) -> float:
        """Mean nodal displacement over the size of the scene."""
        return np.sqrt(v @ (self.weights * v))

    def _drive(self, external, u, load):
        """Derivatives of residual and constraints by the load."""
        system, phi = self.system, np.zeros(self.system.constraints.m)
        if system.constraints.drives:
            h = 1e-6 * max(1.0, abs(load))
            after, before = (system.constraints.constraint(u, load + x) for x in (h, -h))
            phi = (after - before) / (2.0 * h)
        if np.any(self.unit):
            du0 = np.zeros(system.N)
            du0[system.constraints.fixed] = self.unit
            external = external - system.solver.multiply(du0)
            if system.constraints.joints:
                phi = phi + system.constraints.full_jacobian(u, load) @ du0
        return external, -phi

    def factorize(self, point: Point) -> tuple[Array, Array]:
        """Factorise the tangent stiffness at a point and count its negative eigenvalues."""
        system = self.system
        system.assemble(point.u, point.load)
        drive = self._drive(system.external_force(point.u), point.u, point.load)
        try:
            system.solver.factorize(point.u, point.load, point.multipliers)
            if system.symmetric:
                point.negative = system.solver.inertia().negative
        except NO_FACTORS:
            raise LoadStepFailed("the tangent is singular") from None
        return drive

    def set_tangent(self, point: Point, after: Point | None = None) -> Point:
        """Set the tangent of the path at a point."""
        drive, phi = self.factorize(point)
        dF, mF = self.system.solver.solve(drive, phi)
        dF[self.system.constraints.fixed] += self.unit
        size = np.hypot(self.norm(dF), self.of_load)
        if not size > 0 or not np.isfinite(size):
            raise LoadStepFailed("the loads move nothing" if size == 0 else
                                 "the tangent is singular")
        if after is not None and (self.weights * dF) @ (point.u - after.u) + self.of_load**2 * (
                point.load - after.load) < 0:
            size = -size
        point.rate, point.tangent, point.multiplier_rate = 1.0 / size, dF / size, mF / size
        return point

    def advance(self, start: Point, ds: float) -> Point:
        """The next point at the distance ds, with its tangent."""
        first = ds * start.tangent, ds * start.multiplier_rate, ds * start.rate
        return self.set_tangent(self.correct(start, first, ds), start)

    def _balanced(self, residual, phi, *forces):
        """True if residuals (N,) and (m,) are within tolerance; before K has factors."""
        e, rules, weights = self.system.backend.tables.plain, self.rules, self.system.K.diagonal()
        invert(weights, e.sizes)
        norms = np.sqrt([x * x @ weights for x in (residual * e.free, *forces)])
        gap = joint_gap(phi, e.joints.sizes)
        return bool(is_balanced(norms[0], norms[1:].max(), gap, rules.tol, rules.force_noise))

    def correct(self, start: Point, first: tuple[Any, Any, Any], ds: float) -> Point:
        """Iterate from ``start`` and first increments of u, multipliers and load, in the plane at
        the distance ds; if that is infinite, at the load then."""
        system, weights, e = self.system, self.weights, self.system.backend.tables.plain
        u, m, load = start.u, start.multipliers, start.load
        _, stresses = system.assemble(u, load)
        plane, normal = weights * start.tangent, self.of_load**2 * start.rate
        du, dm, dl = first
        step, work, before, rules = np.zeros(system.N), np.inf, 0.0, self.rules
        for k in range(1, rules.iterations + 1):
            independent = system.linearised_stress(u, stresses, du)
            u, m, load, step = u + du, m + dm, load + dl, step + du
            with np.errstate(over="ignore", invalid="ignore"):
                force, stresses = system.assemble(u, load, independent)
                external = system.external_force(u)
            if not np.all(np.isfinite(force)):
                raise LoadStepFailed("the strain is not finite")
            residual, phi = load * external - force, system.constraints.constraint(u, load)
            if system.constraints.joints:
                residual = residual - m @ system.constraints.full_jacobian(u, load)
            pull = dl * external
            reference = max(force_size(e, force, load * external, u),
                            force_size(e, pull, pull, step))
            contraction = work / before if 0.0 < work < before else 1.0
            if is_small(work, contraction, rules.tol, reference, rules.noise) and self._balanced(
                    residual, phi, force, load * external):
                return Point(self.whole, u, m, load, force, start.arc + ds,
                             contraction * work / reference if reference > 0 else 0.0, k)
            drive, gap = self._drive(external, u, load)
            try:
                system.solver.factorize(u, load, m)
                dR, mR = system.solver.solve(residual, -phi)
                dF, mF = system.solver.solve(drive, gap)
            except NO_FACTORS:
                raise LoadStepFailed("the tangent is singular") from None
            dF[system.constraints.fixed] += self.unit
            dl = 0.0 if ds == np.inf else (
                ds - plane @ (step + dR) - normal * (load - start.load)) / (plane @ dF + normal)
            du, dm = dR + dl * dF, mR + dl * mF
            if not np.all(np.isfinite(du)) or np.sqrt(du @ (weights * du)) > 10 * ds:
                raise LoadStepFailed("the iteration leaves the path")
            before = work if k > 1 else 0.0
            pull = dl * external  # the load is an unknown too
            work = np.hypot(correction_size(e, residual * e.free, du, phi, dm),
                            force_size(e, pull, pull, du))
        raise LoadStepFailed(f"no convergence in {rules.iterations} iterations")


def _start(tracer, branch, side):
    """The first point of a path."""
    if branch is not None:
        point = branch.critical
        return replace(point, arc=0.0, tangent=side * point.tangent,
                       multiplier_rate=side * point.multiplier_rate)
    system, zero = tracer.whole, np.zeros(tracer.whole.N)
    point = Point(system, zero, np.zeros(system.constraints.m), 0.0, zero)
    # loads that move no node count with the strain that their forces could cause
    forces = float(np.abs(system.external_force(zero)) @ system.constraints.coordinate_sizes)
    tracer.of_load = forces / system.scales.energy_of_strains if forces > 0 else 0.0
    try:
        tracer.set_tangent(point)
    except LoadStepFailed as failure:
        raise ConvergenceError(f"the path cannot begin: {failure}", ([point], [])) from None
    motion = tracer.norm(point.tangent)
    if motion > STILL * tracer.of_load * point.rate:
        tracer.of_load = 0.0
        point.rate, point.tangent = point.rate / motion, point.tangent / motion
        point.multiplier_rate = point.multiplier_rate / motion
    return point


def _history_at(point, start):
    """The history at a point after another one."""
    system = start.system.after(start.history)
    return system.accept(start.u, point.u, point.load, point.load)[0]


def _land(tracer, start, point, load):
    """The point between two at which the load is reached."""
    h, low, high, x = point.arc - start.arc, 0.0, 1.0, 1.0
    # cubic interpolation of the load, by the fraction of the arc length
    b, gap = h * start.rate, point.load - start.load
    c, d = 3 * gap - 2 * b - h * point.rate, -2 * gap + b + h * point.rate
    for _ in range(60):  # bisection
        x = 0.5 * (low + high)
        below = abs(start.load + x * (b + x * (c + x * d))) < abs(load)
        low, high = (x, high) if below else (low, x)
    near = point
    if x < 1.0 - 1e-9:
        near = tracer.advance(start, x * h)
    ds = (load - near.load) / near.rate
    first = ds * near.tangent, ds * near.multiplier_rate, load - near.load
    landed = tracer.correct(near, first, np.inf)
    landed.load, landed.arc = load, near.arc + ds
    return tracer.set_tangent(landed, start)


def _criticals(tracer, p, q, tol):
    """The critical points between two points with tangents, in order: kind, Point, change."""
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
            if turns:  # the root of the rate of the load by the arc length
                known = {a.arc: a, b.arc: b}

                def rate(arc, known=known):
                    if arc not in known:
                        known[arc] = tracer.advance(p, arc - p.arc)
                    return known[arc].rate

                # a parabola of the load, with the second derivative from the rates at both ends
                near = np.sqrt(2e-3 * tol * abs(b.load) * (b.arc - a.arc) / abs(b.rate - a.rate))
                arc = scipy.optimize.brentq(rate, a.arc, b.arc, xtol=max(near, tol * (
                    b.arc - p.arc)))
                out.append(("limit", replace(known[arc], iterations=0, negative=a.negative),
                            change))
            if not turns or (not single and abs(change) != 1):
                out.append(("bifurcation", _bifurcation(tracer, p, a, b, tol), change))
            continue
        middle = tracer.advance(p, 0.5 * (a.arc + b.arc) - p.arc)
        stack += [(middle, b, depth + 1), (a, middle, depth + 1)]
    return out


def _bifurcation(tracer, p, a, b, tol):
    """Where the count of negative eigenvalues changes: bisection, and secants of the smallest."""
    end = tol * (b.arc - p.arc)
    v, m, values = None, None, {}
    low, high, best = a, b, b
    for _ in range(100):
        x = 0.5 * (low.arc + high.arc)
        f, g = values.get(low.arc), values.get(high.arc)
        if f is not None and g is not None and f * g < 0:
            guess = (low.arc * g - high.arc * f) / (g - f)
            # overshoot slightly, so that both ends converge
            guess += np.sign(x - guess) * 0.1 * min(guess - low.arc, high.arc - guess)
            x = guess
        best = tracer.advance(p, x - p.arc)
        # the eigenvalue closest to zero of the tangent over its diagonal, by the inverse power
        # method from the last mode
        system, first = tracer.system, v is None
        tracer.factorize(best)
        D = np.abs(system.K.diagonal()) * system.constraints.mask
        if first:
            v = np.random.default_rng(0).standard_normal(system.N)
        v = v * system.constraints.mask
        for _ in range(12 if first else 4):
            unit = v / np.sqrt(v @ (D * v))
            v, m = system.solver.solve(D * unit, np.zeros(system.constraints.m))
            values[best.arc] = 1.0 / (unit @ (D * v))
        low, high = (best, high) if best.negative == a.negative else (low, best)
        if high.arc - low.arc <= end:
            break
    return replace(best, iterations=0, rate=0.0, tangent=v / tracer.norm(v),
                   multiplier_rate=m / tracer.norm(v), negative=a.negative)


