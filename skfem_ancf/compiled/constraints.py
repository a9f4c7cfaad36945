"""Joints: ``Phi = c + g . u + u . H u / 2``.

Given as H by equation, row, column and value, and where g is not zero by equation and column.
"""

from .band import copy, times_columns
from .jit import inner


@inner
def constraint(joints, c, g, u, phi):
    """Phi at u."""
    hk, hi, hj, hv, gk, gi = joints
    copy(c, phi)
    for a in range(gk.size):
        phi[gk[a]] += g[a] * u[gi[a]]
    for a in range(hk.size):
        phi[hk[a]] += 0.5 * hv[a] * u[hi[a]] * u[hj[a]]


@inner
def jacobian(joints, g, u, J):
    """dPhi / du at u, shape (m, N)."""
    hk, hi, hj, hv, gk, gi = joints
    J[:] = 0.0
    for a in range(gk.size):
        J[gk[a], gi[a]] += g[a]
    for a in range(hk.size):
        J[hk[a], hi[a]] += hv[a] * u[hj[a]]


@inner
def constraint_rate(joints, c1, g1, J, u, v, out):
    """The rate of Phi."""
    gk, gi = joints[4], joints[5]
    times_columns(J, v, out)
    for k in range(out.size):
        out[k] += c1[k]
    for a in range(gk.size):
        out[gk[a]] += g1[a] * u[gi[a]]


@inner
def constraint_acceleration(joints, c2, g1, g2, J, u, v, acceleration, out):
    """The second rate of Phi."""
    hk, hi, hj, hv, gk, gi = joints
    times_columns(J, acceleration, out)
    for k in range(out.size):
        out[k] += c2[k]
    for a in range(gk.size):
        out[gk[a]] += g2[a] * u[gi[a]] + 2.0 * g1[a] * v[gi[a]]
    for a in range(hk.size):
        out[hk[a]] += hv[a] * v[hi[a]] * v[hj[a]]
