"""Residual and iteration matrix of a step, and its factors."""

import numpy as np

from ..actions.forces.kernels import (add_contact_tangent, add_elastic_force, add_friction_tangent,
                                      element_stiffness, keep_entries, put_between)
from ..actions.tables import (add_curvature_force, add_joint_force, add_load_stiffness,
                              add_products, joint_directions, mean_external_force)
from ..beam.strain_energy import (add_force_of, add_unsymmetric, body_force, body_linearised,
                                  body_mean, body_mixed, body_stress, body_tangent)
from ..core.band import (add_multiple, add_scaled, clear, copy, dot, factorize, fix, multiply,
                         subtract_rows)
from ..core.callbacks import JOINTS, call_custom, call_solver
from ..core import apart, indices, source
from ..equations.convergence import EXPECTED, LASTING, SINGULAR, SYMMETRIC, UNSYMMETRIC
from .records import ALL, add_damping, damping_force, factorize_rows


# the residual of a step, ``Q - f - M a - J^T lambda``, at an iterate

@source
def kinetic_energy(M, v, scratch):
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


@apart("motion", *ALL)
def internal_force(e, matrices, rule, s, w, state):
    """The internal force of the iterate without damping."""
    # In the mixed iteration with independent stresses S, the residual of ``S = D eps(u)`` acts in
    # the directions of the factors: ``f = B(u)^T S + B(origin)^T (D eps(u) - S)``, and likewise for
    # viscous stresses.
    u0, u, f, S = w.y[0], w.x.u, w.x.force, w.stresses
    missing, independent, constitutive, slow, rates = S[2], S[3], S[4], S[5], S[6]
    if state.mixed_steps[0] > 0:
        body_mixed(e.body, rule.conserving > 0, u0, u, f, independent, constitutive)
        for i in indices(missing.size):
            missing[i] = constitutive[i] - independent[i]
        if matrices.dampers.viscous > 0:
            body_linearised(e.viscous, w.x.middle, w.x.damping_velocity, S[0], rates)
            add_force_of(e.body, w.x.middle, slow, f)
            for i in indices(missing.size):
                missing[i] += rates[i] - slow[i]
        add_force_of(e.body, w.x.origin, missing, f)
    elif rule.conserving > 0:
        body_mean(e.body, u0, u, f)
    else:
        body_force(e.body, u, f)
    if rule.conserving > 0:
        add_elastic_force(e.forces, s.acting, s.dt, u0, u, f)
    else:
        add_elastic_force(e.forces, s.acting, 0.0, u, u, f)


@apart("damping", *ALL)
def add_damping_force(e, matrices, rule, s, w, state):
    """Add the damping force; materials are included already in the mixed iteration."""
    d, f = w.x.damping, w.x.force
    damping_force(e, matrices.dampers, matrices.M, s.acting, w.x.middle, w.x.damping_velocity,
                  state.mixed_steps[0], d, w.x.scratch)
    for i in indices(f.size):
        f[i] += d[i]


@apart("joints", *ALL)
def directions(e, matrices, rule, s, w, state):
    """Set the joint Jacobian where joints act, and at the end of the step."""
    to_middle(rule, w)
    if rule.solver > 0:
        return
    if e.joints.custom > 0 and rule.conserving > 0:
        flat = w.J[0].reshape(w.J[0].size)
        clear(flat)
        call_custom(JOINTS, e.joints.custom, np.int64(5), s.acting, 1.0, w.x.u, w.y[0], flat)
    else:
        joint_directions(e.joints, s.joints.g[1], s.acting, w.x.middle, w.J[0])
    joint_directions(e.joints, s.joints.g[0], s.t, w.x.u, w.J[1])


@apart("motion", *ALL)
def residual(e, matrices, rule, s, w, state):
    """R = Q - f - M a - J^T lambda."""
    u, base, rest, constrained = w.x.u, w.x.base, w.x.rest, w.x.constrained
    a, R, f, scratch = w.x.acceleration, w.x.residual, w.x.force, w.x.scratch
    for i in indices(u.size):
        a[i] = (s.mass_factor * (u[i] - base[i]) + rest[i]) * e.free[i] + constrained[i]
    multiply(matrices.M, a, scratch)
    mean_external_force(e.loads, s.factors, s.acting, w.y[0] if rule.conserving > 0 else u, u, R)
    for i in indices(u.size):
        R[i] = R[i] - f[i] - scratch[i]
    if rule.solver > 0:
        clear(scratch)
        add_joint_force(e.joints, s.joints.g[1], s.acting, w.x.middle, w.m.l, scratch)
        for i in indices(u.size):
            R[i] -= scratch[i]
    else:
        subtract_rows(w.J[0], w.m.l, R)


@apart("joints", *ALL)
def add_impulses(e, matrices, rule, s, w, state):
    """R -= (impulse . Phi'') (v_0 + v_1) / 4: eq. of Gear, Leimkuhler and Gupta (1985)."""
    v0, v, scratch, share, impulse = w.y[1], w.x.v, w.x.scratch, w.m.phi, w.m.impulse
    if e.joints.custom > 0:
        n = v.size
        ends = np.empty(3 * n + impulse.size)
        copy(v0, ends[:n])
        copy(v, ends[n:2 * n])
        copy(w.y[0], ends[2 * n:3 * n])
        copy(impulse, ends[3 * n:])
        call_custom(JOINTS, e.joints.custom, np.int64(6), s.acting, 1.0, w.x.u, ends, w.x.residual)
        return
    for i in indices(v.size):
        scratch[i] = v0[i] + v[i]
    for k in indices(share.size):
        share[k] = -0.25 * impulse[k]
    add_curvature_force(e.joints, share, scratch, w.x.residual)


@apart("motion", *ALL)
def tangent(e, matrices, rule, s, w, state):
    """Assemble the iteration matrix, with the stresses at the start, or mean independent stresses.
    Stresses of an iterate may be far off: a straight prediction of a rotation stretches the beam.
    So may be independent stresses at the end of a step that does not resolve axial vibrations."""
    M, A, dampers, yes = matrices.M.flat, matrices.A.flat, matrices.dampers, w.x.u.size > 0
    stresses = w.stresses
    if state.mixed_steps[0] > 0 and rule.conserving > 0:
        copy(stresses[3], stresses[1])
        add_multiple(1.0, stresses[5], stresses[1])
    else:
        body_stress(e.body, w.y[0], stresses[1])
        if dampers.viscous > 0:
            body_linearised(e.viscous, w.y[0], w.y[1], stresses[1], stresses[1])
    to_middle(rule, w)
    copy(w.x.middle, w.x.origin)
    copy(w.x.middle, w.x.ahead)
    body_tangent(e.body, w.x.middle, w.x.force, stresses[1], yes, stresses[2], matrices.A)
    if dampers.active > 0:
        add_damping(e.viscous, dampers, matrices.M, s.damping_factor / s.stiffness_factor,
                    w.x.middle, stresses, w.x.scratch, matrices.A)
        for k in range(dampers.modes.shape[0]):
            matrices.rows.S[k, k] = s.damping_factor
    add_load_stiffness(e.loads, s.factors, s.acting, 1.0, w.x.middle, matrices.A)
    if e.forces.start.size > 0:
        _add_elements(e, matrices, rule, s, w, state)
    keep_entries(e.forces, s.acting, s.stiffness_factor, w.y[0] if rule.conserving > 0 else w.x.u,
                 w.x.u)
    if e.forces.contacts.number > 0:
        _add_obstacles(e, matrices, rule, s, w, state)
    for i in indices(A.size):
        A[i] = s.mass_factor * M[i] + s.stiffness_factor * A[i]


@apart("elements", *ALL)
def _add_elements(e, matrices, rule, s, w, state):
    """Add the derivatives of force elements to the band and the low-rank rows."""
    forces = e.forces
    D = np.empty(forces.size)
    element_stiffness(forces, s.acting, w.x.middle, w.y[1], s.damping_factor / s.stiffness_factor,
                      D)
    add_products(matrices.A.flat, forces.band_at, forces.band_weight, D, forces.band_of)
    put_between(forces, D, s.stiffness_factor, matrices.dampers.modes.shape[0], matrices.rows.S)


@apart("contacts", *ALL)
def _add_obstacles(e, matrices, rule, s, w, state):
    """Add the derivatives of contact at the iterate."""
    u, u0 = w.x.u, w.y[0]
    if rule.conserving > 0:
        add_contact_tangent(e.forces, s.acting, s.dt, u0, u, matrices.A)
    else:
        add_contact_tangent(e.forces, s.acting, 0.0, u, u, matrices.A)
    if matrices.dampers.elements > 0:
        to_damping_velocity(e.free, rule, s, w)
        add_friction_tangent(e.forces, s.acting, s.damping_factor / s.stiffness_factor,
                            w.x.middle, w.x.damping_velocity, matrices.A)


@source
def factors(matrices, state):
    """The factorised matrix."""
    return matrices.U if state.factors[0] == UNSYMMETRIC else matrices.A


@apart("motion", *ALL, returns=int)
def factorize_tangent(e, matrices, rule, s, w, state):
    """Factorise the iteration matrix; 0 on failure."""
    fix(matrices.A, e.fixed)
    state.factorizations[0] += 1
    state.factors[0] = SYMMETRIC
    if rule.solver > 0:  # without right-hand side: factorise
        l, dl, none = w.m.l, w.m.dl, w.x.du[:0]
        for k in indices(l.size):
            dl[k] = s.stiffness_factor * l[k]
        good = call_solver(rule.solver, s.acting, w.x.middle, dl, none, none, none, none)
    else:
        if state.mixed_steps[0] > LASTING and matrices.U.flat.size > 0:
            _unsymmetric_tangent(e, matrices, rule, s, w, state)
            state.factors[0] = UNSYMMETRIC
        good = factorize(factors(matrices, state))
    if not good:
        state.factors[0], state.failure[0] = 0, SINGULAR
        return 0
    if rule.solver == 0 and matrices.rows.P.shape[0] > 0:
        factorize_rows(factors(matrices, state), matrices.rows, e.free)
    state.contraction[0], state.fresh[0], state.correction[0] = EXPECTED, state.fresh[0] + 1, -1.0
    return 1


@apart("unsymmetric", *ALL)
def _unsymmetric_tangent(e, matrices, rule, s, w, state):
    """Set U, the iteration matrix with the strain derivatives at the end of the step."""
    # A mean force ``B(u_m)^T S`` has the derivative ``B(u_m)^T D B(u_1)``. A has B(u_m) instead of
    # B(u_1). They differ if more strains are sampled than the stretch of a straight axis can
    # satisfy, as in cables of degree 5 and above: then the iteration with A converges slowly or not
    # at all.
    U = matrices.U
    copy(w.x.u, w.x.ahead)
    clear(U.flat)
    add_unsymmetric(e.body, w.x.middle, w.x.ahead, U)
    add_scaled(matrices.A, s.stiffness_factor, U)
    fix(U, e.fixed)
