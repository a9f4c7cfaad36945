"""Single evaluations of the equations of a scene, for what is no whole iteration."""

import numpy as np

from ..beam.strain_energy import (add_viscous_force, body_carry, body_force, body_mean, body_stress,
                                  body_tangent)
from ..actions.forces.kernels import AT_ONCE, add_elastic_force, add_element_tangent
from ..core.source import source
from ..actions.tables import add_load_stiffness

FORCE, TANGENT, CARRY, STRESS, MEAN, VISCOUS = range(6)


@source
def evaluate(e, what, u, v, factors, t, scale, use_carried, stresses, carried, f):
    """Evaluate one thing; one function, so that it is compiled once.

    Parameters
    ----------
    e
        :class:`~skfem_ancf.equations.Equations`.
    what
        FORCE: the internal force at u into f. TANGENT: with it the tangent of the residual into
        ``e.K``, and the stresses; the geometric part takes those ``carried`` if ``use_carried``.
        CARRY: those carried from u to u + v. STRESS: the stresses at u. MEAN: the force whose work
        from u to v is the change of the strain energy. VISCOUS: that of damped materials at the
        velocity v.
    factors, t, scale
        As for :func:`~skfem_ancf.actions.tables.external_force`.
    """
    at = t if np.isfinite(t) else scale  # the time of a motion, in statics the load factor
    if what == FORCE:
        body_force(e.body, u, f)
        add_elastic_force(e.forces, at, 0.0, u, u, f)
    elif what == TANGENT:
        body_tangent(e.body, u, f, carried, use_carried, stresses, e.K)
        add_elastic_force(e.forces, at, 0.0, u, u, f)
        add_load_stiffness(e.loads, factors, t, scale, u, e.K)
        add_element_tangent(e.forces, at, u, e.K)
    elif what == CARRY:
        body_carry(e.body, u, v, stresses, carried)
    elif what == STRESS:
        body_stress(e.body, u, stresses)
    elif what == MEAN:
        body_mean(e.body, u, v, f)
        add_elastic_force(e.forces, at, AT_ONCE, u, v, f)
    else:
        add_viscous_force(e.viscous, u, v, f)
