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
        return result if _stays_clear(here, u, result.u) else None
    except (LoadStepFailed, ConvergenceError) as failure:
        if cut and isinstance(failure, LoadStepFailed):
            raise
        logger.debug("without contact: %s", failure)
        return None
    finally:
        here.recycle()


def _stays_clear(system, u0, u1):
    """True if it is known that members do not touch between displacements (N,)."""
    motion = motion_between(system, u0, u1)
    run = system.backend.of(motion_is_clear)
    if motion is None or len(motion) < 3:
        return motion is not None and bool(run(motion))
    far = np.all([e.broad_search.discs.stay_apart(motion.view(complex)[:, at[::2] // 2])
                  for e, at in system.forces.changing], axis=0)
    return all(far[k] or run(motion[k:k + 2]) for k in range(len(far)))


def motion_between(system: System, u0: Array, u1: Array) -> Array | None:
    """Displacements (n, N) of a motion of shapes from u0 to u1; None if anything turns far but a
    beam of one chain, or this many times."""
    # Fixed and joined nodes go straight, so that joints of places hold.
    beams = list(zip(system.beams, system.slices))
    turns = [_turns(beam, u0[s], u1[s]) for beam, s in beams]
    most = max([0.0, *(np.abs(turn).max() for turn in turns)])
    n = max(1, int(np.ceil(most / TURN)))
    if n > MOST or n > 1 and not all(beam.mesh.is_chain for beam, _ in beams) or any(
            np.hypot(*(u1 - u0)[system.of(body)][2:]) > TURN for body in system.bodies):
        return None
    share = np.linspace(0.0, 1.0, n + 1)[:, None]
    out = u0 + share * (u1 - u0)
    if n > 1:
        held = ~system.constraints.free
        held[system.constraints.slopes[1]] = True
        for (beam, s), turn in zip(beams, turns):
            out[1:-1, s] = _turned(beam, u0[s], u1[s], turn, held[s], share[1:-1])
    return out


def _turns(beam, u0, u1):
    """Rotations of the nodes of a chain, the least where it moves least."""
    turn = tangents(beam, u1) * tangents(beam, u0).conj()
    turn = np.cumsum(np.angle(np.append(turn[:1], turn[1:] * turn[:-1].conj())))
    base = np.abs((u1 - u0).view(complex)[::beam.nd // 2]).argmin()
    return turn - 2.0 * np.pi * np.rint(turn[base] / (2.0 * np.pi))


def _turned(beam, u0, u1, turn, held, share):
    """Displacements (n, N) of a chain that turns."""
    a, b = ((beam.q0 + u).view(complex).reshape(-1, beam.nd // 2) for u in (u0, u1))
    z, x, y = _evenly(a, b, turn[:, None], share[..., None]), a[:, 0], b[:, 0]
    at = np.flatnonzero(held.reshape(-1, beam.nd)[:, :2].any(axis=1))
    if not len(at):
        at = np.array([np.abs(y - x).argmin()])
    z[:, 1:, 0] = z[:, :1, 0] + np.cumsum(_evenly(
        np.diff(x), np.diff(y), 0.5 * (turn[1:] + turn[:-1]), share), axis=1)
    lost = x[at] + share * (y - x)[at] - z[:, at, 0]
    z[:, :, 0] += [np.interp(np.arange(len(x)), at, d) for d in lost]
    return z.reshape(len(share), -1).view(float) - beam.q0


def _evenly(x, y, turn, share):
    """Vectors between x and y that turn evenly."""
    return np.exp(1j * share * turn) * (x + share * (y * np.exp(-1j * turn) - x))
