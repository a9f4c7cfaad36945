"""Rates of joints that depend on time, by differences within one step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.callbacks import custom_joints
from ..core.source import F2, F3, indices, source
from ..actions.tables import add_products, add_triples

#: Number of intervals of a step.
PARTS = 4
_FIRST = np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0
_SECOND = np.array([35.0, -104.0, 114.0, -56.0, 11.0]) / 12.0

class JointMotion(NamedTuple):
    """Time-dependent terms of the joints at one instant, see :mod:`skfem_ancf.actions.tables`."""

    c: F2  # c at the end of a step, and its first two rates, (3, m)
    g: F2  # g there, g where the joints act, and the first two rates of g, (4, k)
    drives: int  # 1 if a joint moves


class JointMotions(NamedTuple):
    """The same at several instants, a row for each, or one row if constant."""

    c: F3
    g: F3
    drives: int


@source
def drive_rate(joints, motion, t, dt, u, out):
    """The partial rate of Phi, c' + g' . u, at the end t of a step of dt."""
    c = motion.c[1]
    for k in indices(out.size):
        out[k] = c[k]
    if joints.custom == 0:
        add_products(out, joints.gk, motion.g[2], u, joints.gi)
    elif motion.drives > 0:
        _add_differences(joints, t, dt, u, u, PARTS / dt, 0.0, 0.0, out)


@source
def acceleration_of_joints(joints, motion, t, dt, u, v, out):
    """The second rate of Phi without accelerations: c'' + v . H v + g'' . u + 2 g' . v."""
    c, g = motion.c[2], motion.g[2]
    for k in indices(out.size):
        out[k] = c[k]
    if joints.custom == 0:
        add_triples(out, joints.hk, joints.hv, v, joints.hi, v, joints.hj)
        add_products(out, joints.gk, motion.g[3], u, joints.gi)
        add_products(out, joints.gk, g, v, joints.gi)
        add_products(out, joints.gk, g, v, joints.gi)
    else:
        custom_joints(joints.custom, np.int64(4), t, u, v, out)
        if motion.drives > 0:
            _add_differences(joints, t, dt, u, v, 0.0, (PARTS / dt)**2, 2.0 * PARTS / dt, out)


@source
def _add_differences(joints, t, dt, u, v, first, second, along, out):
    """Custom joints: out += first Phi' + second Phi'' + along (J v)', by differences.

    Joints that do not move have none.
    """
    values = np.empty(out.size)
    for part in range(PARTS + 1):
        time = t - part * dt / PARTS
        for k in range(2):
            c = first * _FIRST[part] + second * _SECOND[part] if k == 0 else along * _FIRST[part]
            if c != 0.0:
                for i in indices(out.size):
                    values[i] = 0.0
                custom_joints(joints.custom, 7 + k, time, u, v, values)
                for i in indices(out.size):
                    out[i] += c * values[i]
