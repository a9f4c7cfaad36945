"""Equilibria of scenes in which nothing touches.

Corrections of Newton's method lead far beyond an equilibrium, and to know on the way of each that
nothing touches takes longer than to find it. A scene is therefore solved without contact first.
That holds if a motion to the result is known on which nothing touches.

A straight line in the degrees of freedom would shorten what turns far. In the motion each node
turns by its part of the whole, with its slopes, and chords between nodes by the mean of both ends.
"""

import logging
from collections.abc import Callable
from typing import Any

import numpy as np

from ..beam.kinematics import tangents
from ..core import Array, ConvergenceError, Interrupted
from ..equations.evaluation import motion_is_clear
from ..equations.system import System
from .iteration import LoadStepFailed, StaticResult

logger = logging.getLogger(__name__)

#: Largest rotation of a node between two displacements of a motion, in radians, and their number.
TURN, MOST = 1.0, 40


def solved_apart(system: System, u: Array, memory: Array | None, t: float,
                 solve: Callable[[System, Array | None], StaticResult]) -> StaticResult | None:
    """The result of ``solve`` for the scene without contact and its part of the history, if it is
    known that nothing touches from u (N,) to there; else None."""
    if system.apart is None or system.constraints.missing_supports:
        return None
    apart, here = system.apart, system.recycled(memory, 0.0)
    ours, theirs = here.histories, apart.histories
    try:
        if not (here.starts_apart and not u.any() or stays_clear(here, t, u)):
            return None
        result = solve(apart, ours.part(theirs, memory))
        if not stays_clear(here, t, u, result.u):
            return None
        result.memory = ours.joined(theirs, memory, result.memory)
        return result
    except Interrupted as stop:
        stop.state.memory = ours.joined(theirs, memory, stop.state.memory)
        raise
    except (LoadStepFailed, ConvergenceError) as failure:
        logger.debug("without contact: %s", failure)
        return None
    finally:
        here.recycle()


def stays_clear(system: System, t: float, *ways: Array) -> bool:
    """True if it is known that nothing touches at a displacement (N,), or from one to another."""
    motion = motion_between(system, *ways) if len(ways) > 1 else np.array(ways)
    if motion is None:
        return False
    run = system.backend.of(motion_is_clear)
    if len(motion) < 3:
        return bool(run(t, motion))
    far = np.all([e.discs.stay_apart(motion.view(complex)[:, at[::2] // 2])
                  for e, at in system.forces.changing], axis=0)
    return all(far[k] or run(t, motion[k:k + 2]) for k in range(len(far)))


def motion_between(system: System, u0: Array, u1: Array) -> Array | None:
    """Displacements (n, N) of a motion of shapes from u0 to u1; None if a solid turns far, or a
    beam many times."""
    # Fixed and joined nodes go straight, so that joints of places hold.
    turns = [_turns(beam, u0[s], u1[s]) for beam, s in zip(system.beams, system.slices)]
    solid = [np.abs(_turns_of_solid(one, u0[s], u1[s])).max() for one, s in zip(
        system.members[len(turns):], system.slices[len(turns):])]
    most = max([0.0, *(np.abs(turn).max() for one in turns for turn in one)])
    n = max(1, int(np.ceil(most / TURN)))
    if max(solid, default=0.0) > TURN or n > MOST:
        return None
    share = np.linspace(0.0, 1.0, n + 1)[:, None]
    out = u0 + share * (u1 - u0)
    if n > 1:
        held = ~system.constraints.free
        held[system.constraints.slopes[1]] = True
        for beam, s, of in zip(system.beams, system.slices, turns):
            _turn(beam, u0[s], u1[s], of, held[s], share, out[:, s])
        out[[0, -1]] = u0, u1
    return out


def _turns(beam: Any, u0: Array, u1: Array) -> list[Array]:
    """Rotations of the nodes of each chain, the least where it moves least."""
    turn = tangents(beam, u1) * tangents(beam, u0).conj()
    moved, out = np.abs((u1 - u0).view(complex)[::beam.nd // 2]), []
    for nodes in _chains(beam.mesh):
        some = turn[nodes]
        one = np.cumsum(np.angle(np.append(some[:1], some[1:] * some[:-1].conj())))
        whole = one[moved[nodes].argmin()] / (2.0 * np.pi)
        out.append(one - 2.0 * np.pi * np.rint(whole))
    return out


def _chains(mesh):
    """The nodes of each chain."""
    if mesh.is_chain:
        return [np.arange(mesh.t.shape[1] + 1)]
    first = np.flatnonzero(np.diff(mesh.chains, prepend=-1))
    return [np.append(nodes[0, 0], nodes[1]) for nodes in np.split(mesh.t, first[1:], axis=1)]


def _turns_of_solid(one, u0, u1):
    """Rotations of a body's director, or of lines between points of a domain."""
    a, b = ((one.q0 + u).view(complex) for u in (u0, u1))
    if len(a) == 2:
        return np.angle(b[1:] * a[1:].conj())
    return np.angle(np.diff(b) * np.diff(a).conj())


def _turn(beam, u0, u1, turns, held, share, out):
    """Set displacements (n, N) of a beam that turns."""
    a, b = ((beam.q0 + u).view(complex).reshape(-1, beam.nd // 2) for u in (u0, u1))
    fixed = held.reshape(-1, beam.nd)[:, :2].any(axis=1)
    z = np.empty((len(share), *a.shape), complex)
    for nodes, turn in zip(_chains(beam.mesh), turns):
        x, y = a[nodes], b[nodes]
        own = z[:, nodes] = _turned(x, y, turn[:, None], share[..., None])
        own[:, 1:, 0] = own[:, :1, 0] + np.cumsum(_turned(np.diff(x[:, 0]), np.diff(
            y[:, 0]), 0.5 * (turn[1:] + turn[:-1]), share), axis=1)
        x, y, at = x[:, 0], y[:, 0], np.flatnonzero(fixed[nodes])
        if not len(at):
            at = np.array([np.abs(y - x).argmin()])
        lost = x[at] + share * (y - x)[at] - own[:, at, 0]
        z[:, nodes, 0] = [way + np.interp(np.arange(len(x)), at, d)
                          for way, d in zip(own[..., 0], lost)]
    out[:] = z.reshape(len(share), -1).view(float) - beam.q0


def _turned(x, y, turn, share):
    """Vectors between x and y that turn evenly."""
    return np.exp(1j * share * turn) * (x + share * (y * np.exp(-1j * turn) - x))
