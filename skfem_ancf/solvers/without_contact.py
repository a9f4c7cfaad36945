"""Equilibria of scenes in which nothing touches.

Corrections of Newton's method lead far beyond an equilibrium, and to know on the way of each that
nothing touches takes longer than to find it. A scene is therefore solved without contact first.
That holds if a motion to the result is known on which nothing touches.

A straight line in the degrees of freedom would shorten what turns far. In the motion each node
turns by its part of the whole, with its slopes, and chords between nodes by the mean of both ends.
"""

import logging
from collections.abc import Callable

import numpy as np

from ..beam.kinematics import tangents
from ..core import Array, ConvergenceError
from ..equations.evaluation import motion_is_clear
from ..equations.system import System
from .iteration import LoadStepFailed, StaticResult

logger = logging.getLogger(__name__)

#: Largest rotation of a node between two displacements of a motion, in radians, and their number.
TURN, MOST = 1.0, 40


def solved_without_contact(system: System, u: Array, memory: Array | None,
                           solve: Callable[[System], StaticResult], cut: bool = False
                           ) -> StaticResult | None:
    """The result of ``solve`` for the scene without contact of members, if it is known that they do
    not touch from u (N,) to there; else None, or LoadStepFailed if a failure is to ``cut`` the
    increment."""
    free = system.without_contact
    if free is None or system.constraints.missing_supports:
        return None
    here = system.recycled(memory, 0.0)
    try:
        if not (here.starts_untouched and not u.any() or here.backend.of(motion_is_clear)(u[None])):
            return None
        result = solve(free)
        motion, run = motion_between(here, u, result.u), here.backend.of(motion_is_clear)
        if motion is None:
            return None
        if len(motion) < 3:
            return result if run(motion) else None
        far = np.all([e.broad_search.discs.stay_apart(motion.view(complex)[:, at[::2] // 2])
                      for e, at in here.forces.changing], axis=0)
        clear = all(far[k] or run(motion[k:k + 2]) for k in range(len(far)))
        return result if clear else None
    except (LoadStepFailed, ConvergenceError) as failure:
        if cut and isinstance(failure, LoadStepFailed):
            raise
        logger.debug("without contact: %s", failure)
        return None
    finally:
        here.recycle()


def motion_between(system: System, u0: Array, u1: Array) -> Array | None:
    """Displacements (n, N) of a motion of shapes from u0 to u1; None if anything turns far but a
    beam of one chain, or this many times."""
    # Fixed and joined nodes go straight, so that joints of places hold.
    beams = list(zip(system.beams, system.slices))
    turns: list[Array] = []  # of the nodes of chains, the least where they move least
    for beam, s in beams:
        turn = tangents(beam, u1[s]) * tangents(beam, u0[s]).conj()
        turn = np.cumsum(np.angle(np.append(turn[:1], turn[1:] * turn[:-1].conj())))
        base = np.abs((u1[s] - u0[s]).view(complex)[::beam.nd // 2]).argmin()
        turns.append(turn - 2.0 * np.pi * np.rint(turn[base] / (2.0 * np.pi)))
    most = max([0.0, *(np.abs(turn).max() for turn in turns)])
    n = max(1, int(np.ceil(most / TURN)))
    if n > MOST or n > 1 and not all(beam.mesh.is_chain for beam, _ in beams) or any(
            np.hypot(*(u1 - u0)[system.of(body)][2:]) > TURN for body in system.bodies):
        return None
    share = np.linspace(0.0, 1.0, n + 1)[:, None]
    out = u0 + share * (u1 - u0)
    if n == 1:
        return out
    held, share = ~system.constraints.free, share[1:-1]
    held[system.constraints.slopes[1]] = True
    for (beam, s), turn in zip(beams, turns):
        a, b = ((beam.q0 + u[s]).view(complex).reshape(-1, beam.nd // 2) for u in (u0, u1))
        z, x, y = _evenly(a, b, turn[:, None], share[..., None]), a[:, 0], b[:, 0]
        at = np.flatnonzero(held[s].reshape(-1, beam.nd)[:, :2].any(axis=1))
        if not len(at):
            at = np.array([np.abs(y - x).argmin()])
        z[:, 1:, 0] = z[:, :1, 0] + np.cumsum(_evenly(
            np.diff(x), np.diff(y), 0.5 * (turn[1:] + turn[:-1]), share), axis=1)
        lost = x[at] + share * (y - x)[at] - z[:, at, 0]
        z[:, :, 0] += [np.interp(np.arange(len(x)), at, d) for d in lost]
        out[1:-1, s] = z.reshape(len(share), -1).view(float) - beam.q0
    return out


def _evenly(x, y, turn, share):
    """Vectors between x and y that turn evenly."""
    return np.exp(1j * share * turn) * (x + share * (y * np.exp(-1j * turn) - x))
