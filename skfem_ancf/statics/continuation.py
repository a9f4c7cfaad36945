"""Arc-length continuation: equilibria beyond limit and snap-back points."""

import logging

import numpy as np

from ..errors import (CallbackError, ConvergenceError, ask, require_function,
                      require_integer, require_positive, shown, taught)
from ..progress import progress_bar

logger = logging.getLogger(__name__)


#: Steps of the longest path.
MAX_STEPS = 10**6


class _Failed(Exception):
    """A step did not converge."""


class Point:
    """One equilibrium of a path."""

    def __init__(self, u, multipliers, load, force, stable, iterations, arc):
        self.u, self.multipliers, self.load, self.force = u, multipliers, load, force
        self.stable, self.iterations, self.arc = stable, iterations, arc
        self.rate = np.nan  # of the load with the arc length; known once the next step begins


@taught
def continuation(system, steps=100, ds=0.02, ds_max=None, max_load=None, until=None, tol=1e-8,
                 max_iterations=15, progress=None):
    """Follow the equilibrium path from the stress-free state.

    Each step advances by ``ds`` along the tangent of the path, in the norm of the nodes' mean
    displacement over the size of the scene, with the load factor as an unknown, so that the path
    may turn in load and in displacement. The geometric part of the tangent uses the carried
    stress, as in :func:`~skfem_ancf.statics.newton.solve_static`.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    steps
        Largest number of steps.
    ds
        First arc length, relative to the size of the scene; later ones adapt to the iterations.
    ds_max
        Largest arc length; 5 ds by default.
    max_load
        Stop when the load factor exceeds this in size.
    until
        A function of a :class:`Point` that returns True to stop.
    tol
        Relative error of a correction in the energy norm.
    max_iterations
        Iterations before a step is halved.
    progress
        Show a progress bar: True, False, or None for "if it takes long".

    Returns
    -------
    list of Point

    Raises
    ------
    ConvergenceError
        If the arc length falls below ``1e-4 ds``; ``state`` is the list of points so far.

    References
    ----------
    Riks: "An incremental approach to the solution of snapping and buckling problems",
    International Journal of Solids and Structures 15 (1979); Magisano, Leonetti, Garcea, CMAME 313
    (2017).
    """
    steps = require_integer("steps", steps, 1, MAX_STEPS)
    max_iterations = require_integer("max_iterations", max_iterations, 1, 10000)
    tol, ds = require_positive("tol", tol), require_positive("ds", ds)
    if max_load is not None:
        max_load = require_positive("max_load", max_load)
    if until is not None:
        require_function("until", until, "of a point of the path that returns True or False")
    ds_max = 5.0 * ds if ds_max is None else require_positive("ds_max", ds_max)
    weights = np.zeros(system.N)
    for beam, s in zip(system.beams, system.slices):
        weights[s].reshape(-1, beam.nd)[:, :2] = 1.0
    weights /= 0.5 * weights.sum() * system.size**2
    zero = np.zeros(system.N)
    points = [Point(zero, np.zeros(system.m), 0.0, zero, True, 0, 0.0)]
    step, direction = ds, None
    with progress_bar(progress, total=steps, desc="path") as bar:
        while len(points) <= steps:
            try:
                point, new_direction = _advance(system, points[-1], step, direction, weights, tol,
                                                max_iterations)
            except _Failed as failure:
                step *= 0.5
                logger.info("arc length halved to %.3g: %s", step, failure)
                if step < 1e-4 * ds:
                    raise ConvergenceError(
                        f"the path could not be followed beyond load {points[-1].load:.6g}: "
                        f"{failure}; more elements or a smaller ds may help", points) from None
                continue
            direction = new_direction
            points.append(point)
            bar.update(1)
            if max_load is not None and abs(point.load) > max_load:
                break
            if until is not None and _ends(until, point):
                break
            step = min(ds_max, step * np.clip(np.sqrt(6.0 / max(point.iterations, 1)), 0.5, 1.5))
    return points


def _ends(until, point):
    """What the caller's function says to a point."""
    answer = ask("until(point)", until, point)
    if not isinstance(answer, (bool, np.bool_)):
        raise CallbackError(f"until(point) must return True or False, got {shown(answer)}")
    return answer


def _advance(system, start, ds, direction, weights, tol, max_iterations):
    """The next point of the path, and the step from the last one to it."""
    u, m, load = start.u.copy(), start.multipliers.copy(), start.load
    step, carried = np.zeros(system.N), None
    floor = 8.0 * system.work_noise
    unit = system.values(1.0) - system.values(0.0)
    work, reference = np.inf, 0.0
    stable = None
    for k in range(max_iterations + 1):
        with np.errstate(over="ignore", invalid="ignore"):
            force, evaluations = system.assemble(u, load, carried)
            external = system.external_force(u)
        if not np.all(np.isfinite(force)):
            raise _Failed("the strain is not finite")
        residual, phi = load * external - force, system.constraint(u, load)
        if system.joints:
            residual = residual - m @ system.jacobian(u, load)
        closed = np.max(np.abs(phi), initial=0.0) <= 1e-12 * system.size
        if k > 0 and closed and work <= tol * reference + floor:
            return Point(u, m, load, force, stable, k, start.arc + ds), step
        if k == max_iterations:
            break
        drive = external.copy()
        if np.any(unit):
            du0 = np.zeros(system.N)
            du0[system.fixed] = unit
            drive -= system.multiply(du0)
        try:
            system.factorize(u, load, m)
            stable = system.K.positive_definite if not system.joints else None
            dR, mR = system.solve(residual, -phi)
            dF, mF = system.solve(drive, np.zeros(system.m))
        except (np.linalg.LinAlgError, RuntimeError):
            raise _Failed("the tangent is singular") from None
        dF[system.fixed] += unit
        if k == 0:
            size = np.sqrt(dF @ (weights * dF))
            if not size > 0:
                raise _Failed("the loads move nothing")
            sign = 1.0 if direction is None or direction @ (weights * dF) >= 0 else -1.0
            dl = sign * ds / size
            start.rate, plane = sign / size, weights * (sign / size * dF)
            dR, mR = 0.0 * dR, 0.0 * mR
        else:  # the plane at distance ds along the path's tangent
            dl = (ds - plane @ (step + dR)) / (plane @ dF)
        du, dm = dR + dl * dF, mR + dl * mF
        if not np.all(np.isfinite(du)) or np.sqrt(du @ (weights * du)) > 10 * ds:
            raise _Failed("the iteration leaves the path")
        # the first is no correction: there is no residual yet
        work = np.inf if k == 0 else np.sqrt(
            abs((residual * system.free) @ du) + abs(phi @ dm) + abs(dl * (external @ du)))
        carried = system.stress_step(evaluations, du)
        u, m, load, step = u + du, m + dm, load + dl, step + du
        reference = np.sqrt(max(abs(load * external @ u), abs(force @ u), abs(drive @ step * dl)))
    raise _Failed(f"no convergence in {max_iterations} iterations")
