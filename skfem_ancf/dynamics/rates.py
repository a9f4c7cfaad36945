"""Rates of motions that are given as functions of time, by differences within one step.

No value from outside of a step is used: neither do the rates at the end of a motion differ from
those of a motion that goes on, nor does a kink at the end of a step spoil those of the next.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..core.frozen import read_only
from ..core.callbacks import own_joints
from ..core.source import F2, F3, lanes, source
from ..actions.tables import add_products, add_triples

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..core.types import Array

#: Intervals into which a step is divided.
PARTS = 4
_FIRST = np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0
_SECOND = np.array([35.0, -104.0, 114.0, -56.0, 11.0]) / 12.0
#: What makes of values in a step, in the order of time, that in its middle, that at its end, and
#: both rates there, times the intervals and their square.
_OF_STEP = np.array([[0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0], _FIRST[::-1],
                     _SECOND[::-1]])
#: Rows of it.
MIDDLE, END, RATE = range(3)


def times_beside(t: float, dt: float, ahead: bool, limit: float) -> Array:
    """Times within one step, first that of its end, shape (PARTS + 1,).

    Parameters
    ----------
    t, dt
        End and size of the step.
    ahead
        The rates at its start are looked for: t is its start, and the first of the times.
    limit
        Time beyond which no function is asked.
    """
    h = dt / PARTS if ahead else -dt / PARTS
    return np.minimum(t + h * np.arange(PARTS + 1), limit)


def rates(function: Callable[[Array], Array], t: float, dt: float, ahead: bool = False,
          limit: float = np.inf) -> Array:
    """First and second derivative at one time, of a function of an array of times.

    Parameters
    ----------
    function
        Takes times (n,), returns (n, k).
    t, dt, ahead, limit
        As of :func:`times_beside`.

    Returns
    -------
    ndarray
        Shape (2, k).
    """
    times = times_beside(t, dt, ahead, limit)
    return of_step(-dt if ahead else dt)[RATE:] @ function(times)[::-1]


@lru_cache(16)
def of_step(dt: float) -> Array:
    """What makes of values in a step that in its middle, that at its end and both rates there.

    Parameters
    ----------
    dt
        Size of the step.

    Returns
    -------
    ndarray
        Shape (4, PARTS + 1), for values in the order of time.
    """
    h = dt / PARTS
    return read_only(_OF_STEP / np.array([[1.0], [1.0], [h], [h * h]]))


def steps_of(values: Array) -> Array:
    """The values in each step: the last one is the first of the next step.

    Parameters
    ----------
    values
        Of a function at ``PARTS`` times in each step, and at the end; shape (PARTS n + 1, k).

    Returns
    -------
    ndarray
        Shape (n, PARTS + 1, k).
    """
    f = np.ascontiguousarray(values, dtype=float)
    along, across = f.strides
    return np.ndarray((len(f) // PARTS, PARTS + 1, f.shape[1]), float, f, 0,
                      (PARTS * along, along, across))


# of joints


class JointMotion(NamedTuple):
    """What of joints depends on time, at one instant.

    Attributes
    ----------
    c
        c of :mod:`skfem_ancf.actions.tables` at the end of a step and its first two rates, shape
        (3, m).
    g
        g there, g when the joints act, and the first two rates of g, shape (4, k).
    drives
        1 if a joint moves.
    """

    c: F2
    g: F2
    drives: int


class JointMotions(NamedTuple):
    """The same at many instants, a row for each, or one row for all."""

    c: F3
    g: F3
    drives: int


@source
def drive_rate(joints, motion, t, dt, u, out):
    """The rate of Phi at rest, at the end t of a step of dt: c' + g' . u."""
    c = motion.c[1]
    for k in lanes(out.size):
        out[k] = c[k]
    if joints.own == 0:
        add_products(out, joints.gk, motion.g[2], u, joints.gi)
    elif motion.drives > 0:
        _add_differences(joints, t, dt, u, u, PARTS / dt, 0.0, 0.0, out)


@source
def acceleration_of_joints(joints, motion, t, dt, u, v, out):
    """The second rate of Phi without accelerations: c'' + v . H v + g'' . u + 2 g' . v."""
    c, g = motion.c[2], motion.g[2]
    for k in lanes(out.size):
        out[k] = c[k]
    if joints.own == 0:
        add_triples(out, joints.hk, joints.hv, v, joints.hi, v, joints.hj)
        add_products(out, joints.gk, motion.g[3], u, joints.gi)
        add_products(out, joints.gk, g, v, joints.gi)
        add_products(out, joints.gk, g, v, joints.gi)
    else:
        own_joints(joints.own, np.int64(4), t, u, v, out)
        if motion.drives > 0:
            _add_differences(joints, t, dt, u, v, 0.0, (PARTS / dt)**2, 2.0 * PARTS / dt, out)


@source
def _add_differences(joints, t, dt, u, v, first, second, along, out):
    """Of joints of one's own: out += first Phi' + second Phi'' + along (J v)', with factors."""
    values = np.empty(out.size)
    for part in range(PARTS + 1):
        time = t - part * dt / PARTS
        for k in range(2):
            c = first * _FIRST[part] + second * _SECOND[part] if k == 0 else along * _FIRST[part]
            if c != 0.0:
                for i in lanes(out.size):
                    values[i] = 0.0
                own_joints(joints.own, k, time, u, v, values)
                for i in lanes(out.size):
                    out[i] += c * values[i]
