"""The residual of a step, ``Q - f - M a - J^T lambda``, at an iterate."""

import numpy as np

from ..core.band import clear, copy, dot, multiply, subtract_rows
from ..beam.strain_energy import add_force_of, body_force, body_linearised, body_mean, body_mixed
from ..actions.forces.kernels import add_elastic_force
from ..core.callbacks import custom_joints
from ..core.source import indices, source
from ..actions.tables import (add_curvature_force, add_joint_force, joint_directions,
                              mean_external_force)
from .dampers import damping_beside


@source
def kinetic_energy(M, v, scratch):
    """v . M v / 2."""
    multiply(M, v, scratch)
    return 0.5 * dot(v, scratch)


@source
def to_middle(rule, w):
    """Set the displacement at which tangent and joint Jacobian are taken."""
    u, u0, middle = w.x.u, w.y[0], w.x.middle
    a = 0.5 if rule.conserving > 0 else 0.0
    for i in indices(u.size):
        middle[i] = u[i] + a * (u0[i] - u[i])


@source
def free_velocity(free, rule, s, w):
    """v_1 of the iterate without joint impulses."""
    u, v, base, speed = w.x.u, w.x.v, w.x.base, w.x.speed
    c = rule.gamma / (rule.beta * s.dt)
    for i in indices(u.size):
        v[i] = (speed[i] + c * (u[i] - base[i])) * free[i] + s.supports[1, i]


@source
def to_damping_velocity(free, rule, s, w):
    """Set the velocity of the damping force."""
    u, u0, v, damping_velocity = w.x.u, w.y[0], w.x.v, w.x.damping_velocity
    free_velocity(free, rule, s, w)
    for i in indices(u.size):
        damping_velocity[i] = (u[i] - u0[i]) / s.dt if rule.conserving > 0 else v[i]


@source
def internal_force(e, dampers, rule, w, state):
    """The internal force of the iterate without damping.

    In the mixed iteration with independent stresses S, the residual of ``S = D eps(u)`` acts in the
    directions of the factors::

        f = B(u)^T S + B(origin)^T (D eps(u) - S)

    and likewise for viscous stresses.
    """
    u0, u, f, S = w.y[0], w.x.u, w.x.force, w.stresses
    missing, independent, constitutive, slow, rates = S[2], S[3], S[4], S[5], S[6]
    if state.mixed_steps[0] > 0:
        body_mixed(e.body, rule.conserving > 0, u0, u, f, independent, constitutive)
        for i in indices(missing.size):
            missing[i] = constitutive[i] - independent[i]
        if dampers.viscous > 0:
            body_linearised(e.viscous, w.x.middle, w.x.damping_velocity, S[0], rates)
            add_force_of(e.body, w.x.middle, slow, f)
            for i in indices(missing.size):
                missing[i] += rates[i] - slow[i]
        add_force_of(e.body, w.x.origin, missing, f)
    elif rule.conserving > 0:
        body_mean(e.body, u0, u, f)
    else:
        body_force(e.body, u, f)


@source
def add_elastic(forces, rule, s, w):
    """Add the force of elements, of the iterate or the mean."""
    u, f = w.x.u, w.x.force
    if rule.conserving > 0:
        add_elastic_force(forces, s.acting, s.dt, w.y[0], u, f)
    else:
        add_elastic_force(forces, s.acting, 0.0, u, u, f)


@source
def add_damping_force(e, matrices, s, w, state):
    """Add the damping force; materials are included already in the mixed iteration."""
    d, f = w.x.damping, w.x.force
    damping_beside(e, matrices.dampers, matrices.M, s.acting, w.x.middle, w.x.damping_velocity,
                   state.mixed_steps[0], d, w.x.scratch)
    for i in indices(f.size):
        f[i] += d[i]


@source
def directions(joints, rule, s, w):
    """Set the joint Jacobian where joints act, and at the end of the step."""
    to_middle(rule, w)
    if rule.solver > 0:
        return
    if joints.custom > 0 and rule.conserving > 0:
        flat = w.J[0].reshape(w.J[0].size)
        clear(flat)
        custom_joints(joints.custom, np.int64(5), s.acting, w.x.u, w.y[0], flat)
    else:
        joint_directions(joints, s.joints.g[1], s.acting, w.x.middle, w.J[0])
    joint_directions(joints, s.joints.g[0], s.t, w.x.u, w.J[1])


@source
def residual(loads, joints, free, M, rule, s, w):
    """R = Q - f - M a - J^T lambda."""
    u, base, rest, constrained = w.x.u, w.x.base, w.x.rest, w.x.constrained
    a, R, f, scratch = w.x.acceleration, w.x.residual, w.x.force, w.x.scratch
    for i in indices(u.size):
        a[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * free[i] + constrained[i]
    multiply(M, a, scratch)
    mean_external_force(loads, s.factors, s.acting, w.y[0] if rule.conserving > 0 else u, u, R)
    for i in indices(u.size):
        R[i] = R[i] - f[i] - scratch[i]
    if rule.solver > 0:
        clear(scratch)
        add_joint_force(joints, s.joints.g[1], s.acting, w.x.middle, w.m.l, scratch)
        for i in indices(u.size):
            R[i] -= scratch[i]
    else:
        subtract_rows(w.J[0], w.m.l, R)


@source
def add_impulses(joints, s, w):
    """R -= (impulse . Phi'') (v_0 + v_1) / 4: eq. of Gear, Leimkuhler and Gupta (1985)."""
    v0, v, scratch, share, impulse = w.y[1], w.x.v, w.x.scratch, w.m.phi, w.m.impulse
    if joints.custom > 0:
        n = v.size
        ends = np.empty(3 * n + impulse.size)
        copy(v0, ends[:n])
        copy(v, ends[n:2 * n])
        copy(w.y[0], ends[2 * n:3 * n])
        copy(impulse, ends[3 * n:])
        custom_joints(joints.custom, np.int64(6), s.acting, w.x.u, ends, w.x.residual)
        return
    for i in indices(v.size):
        scratch[i] = v0[i] + v[i]
    for k in indices(share.size):
        share[k] = -0.25 * impulse[k]
    add_curvature_force(joints, share, scratch, w.x.residual)
