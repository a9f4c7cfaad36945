"""Single evaluations of the equations of a scene."""

import numpy as np

from ..beam.strain_energy import (add_viscous_force, body_force, body_linearised, body_mean,
                                  body_stress, body_tangent)
from ..actions.forces.kernels import AT_ONCE, add_elastic_force, add_element_tangent
from ..core.source import source
from ..actions.tables import add_load_stiffness

FORCE, TANGENT, LINEARISED, STRESS, MEAN, VISCOUS = range(6)


@source
def evaluate(e, what, u, v, factors, t, scale, use_independent, stresses, independent, f):
    """Evaluate the equations e; one function, so that it is compiled once.

    ``what`` is FORCE: the internal force f at u; TANGENT: also the tangent of the residual in
    ``e.K`` and the stresses, with the independent stresses in the geometric part if
    ``use_independent``; LINEARISED: stresses linearised from u to u + v; STRESS: stresses at u;
    MEAN: the mean force from u to v; VISCOUS: the viscous force at the velocity v. ``factors``,
    ``t`` and ``scale`` are as for :func:`~skfem_ancf.actions.tables.external_force`.
    """
    at = t if np.isfinite(t) else scale  # time, or load factor in statics
    if what == FORCE:
        body_force(e.body, u, f)
        add_elastic_force(e.forces, at, 0.0, u, u, f)
    elif what == TANGENT:
        body_tangent(e.body, u, f, independent, use_independent, stresses, e.K)
        add_elastic_force(e.forces, at, 0.0, u, u, f)
        add_load_stiffness(e.loads, factors, t, scale, u, e.K)
        add_element_tangent(e.forces, at, u, e.K)
    elif what == LINEARISED:
        body_linearised(e.body, u, v, stresses, independent)
    elif what == STRESS:
        body_stress(e.body, u, stresses)
    elif what == MEAN:
        body_mean(e.body, u, v, f)
        add_elastic_force(e.forces, at, AT_ONCE, u, v, f)
    else:
        add_viscous_force(e.viscous, u, v, f)
