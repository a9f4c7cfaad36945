"""Calls of Python from compiled code."""

from numba import njit, objmode

from .. import own


@njit
def own_force(handle, t, scale, u, out):
    with objmode():
        own.own_force(handle, t, scale, u, out)


@njit
def own_mean_force(handle, t, u0, u1, out):
    with objmode():
        own.own_mean_force(handle, t, u0, u1, out)


@njit
def own_load_stiffness(handle, t, scale, u, flat):
    with objmode():
        own.own_load_stiffness(handle, t, scale, u, flat)


@njit
def own_joints(handle, what, t, u, v, out):
    with objmode():
        own.own_joints(handle, what, t, u, v, out)


@njit
def own_elements(handle, what, t, factor, a, b, out):
    with objmode():
        own.own_elements(handle, what, t, factor, a, b, out)


@njit
def own_solve(handle, t, u, multipliers, R, phi, du, dm):
    with objmode(done="boolean"):
        done = own.own_solve(handle, t, u, multipliers, R, phi, du, dm)
    return done
