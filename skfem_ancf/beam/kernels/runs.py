"""Kernels of the elements of one :class:`~skfem_ancf.beam.kernels.tables.StrainTables`.

Displacements u are (N,); f (N,) and ``flat`` are added to. Stresses are weighted, flat, (ne, ns);
``flat, ld`` store entry (i, j), i >= j, of a tangent at ``flat[j * ld + i - j]``. Forces and
tangents of the strain include the constant stiffness. Arrays of size 0 are not used.

In compiled code the functions of the same names in :mod:`skfem_ancf.equations.loops` replace them.
"""

from ...core.source import primitive
from .strain import (EIGENSTRAIN, EIGENSTRAIN_MEAN, EIGENSTRAIN_TANGENT, FORCE, GIVEN, GRADIENTS,
                     LINEARISED, MEAN, STRESS, TANGENT, UNSYMMETRIC, VISCOUS, evaluate)

#: Marks kernels with a compiled version.
kernel = primitive("skfem_ancf.equations.loops")


@kernel
def run_force(t, u, f):
    """The force at u."""
    evaluate(t, FORCE, u, u, f, u[:0], u[:0], u[:0], 0)


@kernel
def run_stress(t, u, out):
    """Write the stresses at u."""
    evaluate(t, STRESS, u, u, u[:0], u[:0], out, u[:0], 0)


@kernel
def run_linearised(t, u, du, given, out):
    """Write the given stresses plus the linearised change by du at u."""
    evaluate(t, LINEARISED, u, du, u[:0], given, out, u[:0], 0)


@kernel
def run_mean(t, u, v, f):
    """The force whose work from u to v is the change of the energy."""
    evaluate(t, MEAN, u, v, f, u[:0], u[:0], u[:0], 0)


@kernel
def run_mixed(t, u, given, out, f):
    """The force at u of given stresses; writes those of the strain."""
    evaluate(t, FORCE, u, u, f, given, out, u[:0], 0)


@kernel
def run_mean_mixed(t, u, v, given, out, f):
    """The mean force from u to v of given stresses; writes the mean ones of the strain."""
    evaluate(t, MEAN, u, v, f, given, out, u[:0], 0)


@kernel
def run_given(t, u, given, f):
    """The force at u of given stresses alone."""
    evaluate(t, GIVEN, u, u, f, given, u[:0], u[:0], 0)


@kernel
def run_viscous(t, u, v, f):
    """The force at u of the linearised stresses of a rate v alone."""
    evaluate(t, VISCOUS, u, v, f, u[:0], u[:0], u[:0], 0)


@kernel
def run_tangent(t, u, given, out, f, flat, ld):
    """Tangent and force at u; writes the stresses.

    The geometric part has the given stresses, or those of the strain if there are none.
    """
    evaluate(t, TANGENT, u, u, f, given, out, flat, ld)


@kernel
def run_gradients(t, u, out):
    """Write derivatives of the strains and of the weighted stresses, (2, ne, ns, 2 nb)."""
    evaluate(t, GRADIENTS, u, u, u[:0], u[:0], out, u[:0], 0)


@kernel
def run_unsymmetric(t, u, v, flat, ld):
    """Add ``B(u)^T D (B(v) - B(u))`` to a matrix in two halves."""
    evaluate(t, UNSYMMETRIC, u, v, u[:0], u[:0], u[:0], flat, ld)


@kernel
def run_eigen_force(t, u, given, f):
    """Change of the force at u by eigenstrains.

    ``given`` are stresses for a linear law, else strains at the integration points, (3, points, ne).
    """
    evaluate(t, EIGENSTRAIN, u, u, f, given, u[:0], u[:0], 0)


@kernel
def run_eigen_mean(t, u, v, given, f):
    """Change of the mean force from u to v by eigenstrains."""
    evaluate(t, EIGENSTRAIN_MEAN, u, v, f, given, u[:0], u[:0], 0)


@kernel
def run_eigen_tangent(t, u, given, flat, ld):
    """Change of the tangent at u by eigenstrains."""
    evaluate(t, EIGENSTRAIN_TANGENT, u, u, u[:0], given, u[:0], flat, ld)
