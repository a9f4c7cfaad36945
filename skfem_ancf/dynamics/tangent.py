"""The iteration matrix of a step and its factors."""

import numpy as np

from ..core.band import add_halves, add_multiple, clear, copy, factorize, fix
from ..beam.strain_energy import add_unsymmetric, body_linearised, body_stress, body_tangent
from ..actions.forces.kernels import (add_contact_tangent, add_friction_tangent, element_stiffness,
                                      put_between)
from ..core.callbacks import call_solver
from ..core.source import indices, source
from ..actions.tables import add_load_stiffness, add_products
from .convergence import EXPECTED, LASTING, SINGULAR, SYMMETRIC, UNSYMMETRIC
from .dampers import add_damping, factorize_rows
from .residual import to_damping_velocity, to_middle


@source
def tangent(e, matrices, rule, s, w, state):
    """Assemble the iteration matrix, with the stresses at the start, or mean independent stresses.

    Stresses of an iterate may be far off: a straight prediction of a rotation stretches the beam.
    So may be independent stresses at the end of a step that does not resolve axial vibrations.
    """
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
    _add_elements(e.forces, matrices, s, w)
    if e.forces.contacts.number > 0:
        _add_obstacles(e, matrices, rule, s, w)
    for i in indices(A.size):
        A[i] = s.mass_factor * M[i] + s.stiffness_factor * A[i]


@source
def _add_elements(forces, matrices, s, w):
    """Add the derivatives of force elements to the band and the low-rank rows."""
    if forces.start.size > 0:
        D = np.empty(forces.size)
        element_stiffness(forces, s.acting, w.x.middle, w.y[1],
                          s.damping_factor / s.stiffness_factor, D)
        add_products(matrices.A.flat, forces.band_at, forces.band_weight, D, forces.band_of)
        put_between(forces, D, s.stiffness_factor, matrices.dampers.modes.shape[0],
                    matrices.rows.S)


@source
def _add_obstacles(e, matrices, rule, s, w):
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


@source
def use_unsymmetric(matrices, state):
    """True if the next factors are those of the unsymmetric matrix."""
    return state.mixed_steps[0] > LASTING and matrices.U.flat.size > 0


@source
def factorize_tangent(e, matrices, rule, s, w, state):
    """Factorise the iteration matrix; False on failure."""
    fix(matrices.A, e.fixed)
    state.factorizations[0] += 1
    state.factors[0] = SYMMETRIC
    if rule.solver > 0:  # without right-hand side: factorise
        l, dl, none = w.m.l, w.m.dl, w.x.du[:0]
        for k in indices(l.size):
            dl[k] = s.stiffness_factor * l[k]
        good = call_solver(rule.solver, s.acting, w.x.middle, dl, none, none, none, none)
    else:
        if use_unsymmetric(matrices, state):
            _unsymmetric_tangent(e, matrices, s, w)
            state.factors[0] = UNSYMMETRIC
        good = factorize(factors(matrices, state))
    if not good:
        state.factors[0], state.failure[0] = 0, SINGULAR
        return False
    if rule.solver == 0:
        factorize_rows(factors(matrices, state), matrices.rows, e.free)
    state.contraction[0], state.fresh[0], state.correction[0] = EXPECTED, state.fresh[0] + 1, -1.0
    return True


@source
def _unsymmetric_tangent(e, matrices, s, w):
    """Set U, the iteration matrix with the strain derivatives at the end of the step.

    A mean force ``B(u_m)^T S`` has the derivative ``B(u_m)^T D B(u_1)``. A has B(u_m) instead of
    B(u_1). They differ if more strains are sampled than the stretch of a straight axis can satisfy,
    as in cables of degree 5 and above: then the iteration with A converges slowly or not at all.
    """
    U = matrices.U
    copy(w.x.u, w.x.ahead)
    clear(U.flat)
    add_unsymmetric(e.body, w.x.middle, w.x.ahead, U)
    add_halves(matrices.A, s.stiffness_factor, U)
    fix(U, e.fixed)
