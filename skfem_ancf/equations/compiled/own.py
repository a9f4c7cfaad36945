"""Calls of Python from compiled code: one for all, as each takes as long to compile as a kernel."""

import numpy as np
from numba import njit, objmode

from ...core import callbacks as own
from .twin import jit


@njit
def _ask(question, handle, what, t, x, a, b, out):
    with objmode():
        own.QUESTIONS[question](handle, what, t, x, a, b, out)


@jit
def own_force(handle, t, scale, u, out):
    _ask(np.int64(0), handle, np.int64(0), t, scale, u, u, out)


@jit
def own_mean_force(handle, t, u0, u1, out):
    _ask(np.int64(1), handle, np.int64(0), t, 1.0, u0, u1, out)


@jit
def own_load_stiffness(handle, t, scale, u, flat):
    _ask(np.int64(2), handle, np.int64(0), t, scale, u, u, flat)


@jit
def own_joints(handle, what, t, u, v, out):
    _ask(np.int64(3), handle, what, t, 1.0, u, v, out)


@jit
def own_elements(handle, what, t, factor, a, b, out):
    _ask(np.int64(4), handle, what, t, factor, a, b, out)


@jit
def own_poses(handle, t, span, poses):
    _ask(np.int64(5), handle, np.int64(0), t, span, poses, poses, poses)


@njit
def _solve(handle, t, u, multipliers, R, phi, du, dm):
    with objmode(done="boolean"):
        done = own.own_solve(handle, t, u, multipliers, R, phi, du, dm)
    return done


@jit
def own_solve(handle, t, u, multipliers, R, phi, du, dm):
    return _solve(handle, t, u, multipliers, R, phi, du, dm)
