"""Tables of the joints and loads of a scene, and the kernels that evaluate them. Joints are ``Phi =
c + g . u + u . H u / 2``; c and g may depend on time."""

from typing import NamedTuple

import numpy as np

from ..core.band import Band, add_multiple, clear, copy, mirror
from ..beam.strain_energy import FlatBody, add_eigen_force, add_eigen_tangent, put_eigenstrains
from ..beam.kernels.moments import MomentPack, add_mean_moments, add_moment_stiffness, add_moments
from ..core.callbacks import FORCE, JOINTS, MEAN_FORCE, STIFFNESS, call_custom
from ..core import F1, F2, I1, apart, indices, primitive, source


#: Number of ``lasting`` from which on materials have a history, see
#: :class:`~skfem_ancf.equations.histories.Histories`.
MATERIALS = 2


class JointTables(NamedTuple):
    """The joints of a scene. ``hk, hi, hj, hv`` are H by equation, row, column and value, both
    halves; ``gk, gi`` equation and column of each entry of g; ``sizes`` scale the residual of each
    equation; ``custom`` is the handle of joints that are not quadratic, 0 for none."""

    hk: I1
    hi: I1
    hj: I1
    hv: F1
    gk: I1
    gi: I1
    sizes: F1
    custom: int


class LoadTables(NamedTuple):
    """The loads of a scene; a row of factors is the concatenation of those of all kinds.
    ``vectors`` are dead forces (k, N); ``rows, columns, values, which`` forces linear in the
    displacement and the numbers of their factors; ``eigenstrained`` beams with eigenstrains, and
    ``eigenstrains`` (k, n) for each such load its stresses or, for nonlinear laws, its strains, see
    :func:`~skfem_ancf.beam.strain_energy.eigenstrain_body_of`; ``custom`` is the handle of
    user-defined loads."""

    vectors: F2
    moments: MomentPack
    rows: I1
    columns: I1
    values: F1
    which: I1
    eigenstrained: FlatBody
    eigenstrains: F2
    custom: int


@primitive("skfem_ancf.core.loops")
def add_each(out, at, x):
    np.add.at(out, at, x)


@primitive("skfem_ancf.core.loops")
def least_each(out, at, x):
    """out[at] = min(out[at], x), with repeated indices."""
    np.minimum.at(out, at, x)


@primitive("skfem_ancf.core.loops")
def add_products(out, at, v, x, i):
    np.add.at(out, at, v * x[i])


@primitive("skfem_ancf.core.loops")
def add_triples(out, at, v, x, i, y, j):
    np.add.at(out, at, v * x[i] * y[j])


@primitive("skfem_ancf.core.loops")
def add_entries(J, k, i, v):
    np.add.at(J, (k, i), v)


@primitive("skfem_ancf.core.loops")
def add_weighted_entries(J, k, i, v, x, j):
    np.add.at(J, (k, i), v * x[j])


@primitive("skfem_ancf.core.loops")
def subtract_from_band(A, i, j, v, x, k):
    """A[i, j] -= v x[k] in a band matrix, or in its lower half if only that is stored."""
    there = np.nonzero((i >= j) | (A.top > 0))[0]
    np.add.at(A.flat, (j * A.ld + A.top + i - j)[there], (-v * x[k])[there])


# joints


@apart("joints", JointTables, F1, F1, float, F1, F1)
def constraint(joints, c, g, t, u, phi):
    if joints.custom > 0:
        copy(c, phi)
        call_custom(JOINTS, joints.custom, np.int64(0), t, 1.0, u, u, phi)
        return
    clear(phi)
    add_triples(phi, joints.hk, joints.hv, u, joints.hi, u, joints.hj)
    for k in indices(phi.size):
        phi[k] = c[k] + 0.5 * phi[k]
    add_products(phi, joints.gk, g, u, joints.gi)


@apart("joints", JointTables, F1, float, F1, F1, F1)
def add_constraint_rate(joints, g, t, u, v, out):
    if joints.custom > 0:
        call_custom(JOINTS, joints.custom, np.int64(1), t, 1.0, u, v, out)
        return
    add_products(out, joints.gk, g, v, joints.gi)
    add_triples(out, joints.hk, joints.hv, v, joints.hi, u, joints.hj)


@apart("joints", JointTables, F1, float, F1, F1, F1)
def add_joint_force(joints, g, t, u, multipliers, out):
    if joints.custom > 0:
        call_custom(JOINTS, joints.custom, np.int64(2), t, 1.0, u, multipliers, out)
        return
    add_products(out, joints.gi, g, multipliers, joints.gk)
    add_triples(out, joints.hi, joints.hv, multipliers, joints.hk, u, joints.hj)


@source
def add_curvature_force(joints, multipliers, v, out):
    """out += (sum over k of multipliers[k] H_k) v for tabled joints."""
    add_triples(out, joints.hi, joints.hv, multipliers, joints.hk, v, joints.hj)


@apart("joints", JointTables, F1, float, F1, F2)
def joint_directions(joints, g, t, u, J):
    """J(u), dense, shape (m, N)."""
    flat = J.reshape(J.size)
    clear(flat)
    if joints.custom > 0:
        call_custom(JOINTS, joints.custom, np.int64(3), t, 1.0, u, u, flat)
        return
    add_entries(J, joints.gk, joints.gi, g)
    add_weighted_entries(J, joints.hk, joints.hi, joints.hv, u, joints.hj)


# loads


@source
def _dead_force(loads, factors, out):
    clear(out)
    for k in range(loads.vectors.shape[0]):
        c, vector = factors[k], loads.vectors[k]
        for i in indices(out.size):
            out[i] += c * vector[i]


@source
def _of_moments(loads, factors):
    n = loads.vectors.shape[0]
    return factors[n:n + loads.moments.M.size]


@source
def _eigenstrains(loads, factors):
    """Minus the eigenstrains: loads subtract the internal force that belongs to them."""
    given = np.zeros(loads.eigenstrains.shape[1])
    first = factors.size - loads.eigenstrains.shape[0]
    for k in range(loads.eigenstrains.shape[0]):
        c, one = factors[first + k], loads.eigenstrains[k]
        for i in indices(given.size):
            given[i] -= c * one[i]
    return given


@source
def carry_eigenstrains(loads, factors):
    """Let the laws with a history have the eigenstrains of the loads."""
    if loads.eigenstrains.shape[0] > 0:
        put_eigenstrains(loads.eigenstrained, _eigenstrains(loads, factors))


@apart("eigenstrains", LoadTables, F1, F1, F1, F1)
def _add_eigen_force(loads, factors, u, v, out):
    """Add the force of eigenstrains, or, with v, its mean from u to v."""
    f, given = np.zeros(u.size), _eigenstrains(loads, factors)
    add_eigen_force(loads.eigenstrained, u, v, given, f)
    add_multiple(-1.0, f, out)


@apart("eigenstrains", LoadTables, F1, F1, F1, int)
def _add_eigen_tangent(loads, factors, u, lower, ld):
    """Subtract the derivative of the force of eigenstrains from a lower half."""
    add_eigen_tangent(loads.eigenstrained, u, _eigenstrains(loads, factors), lower, ld)


@apart("statics", LoadTables, F1, float, float, F1, F1)
def external_force(loads, factors, t, scale, u, out):
    """External force of all loads; ``scale`` multiplies user-defined ones, others have factors."""
    _dead_force(loads, factors, out)
    if loads.moments.M.size > 0:
        add_moments(loads.moments, _of_moments(loads, factors), u, out)
    if loads.rows.size > 0:
        add_triples(out, loads.rows, loads.values, factors, loads.which, u, loads.columns)
    if loads.eigenstrains.shape[0] > 0:
        _add_eigen_force(loads, factors, u, u[:0], out)
    if loads.custom > 0:
        call_custom(FORCE, loads.custom, np.int64(0), t, scale, u, u, out)


@apart("motion", LoadTables, F1, float, F1, F1, F1)
def mean_external_force(loads, factors, t, u0, u1, out):
    """Mean force of all loads from u0 to u1, whose work is minus the change of the potentials."""
    _dead_force(loads, factors, out)
    if loads.moments.M.size > 0:
        add_mean_moments(loads.moments, _of_moments(loads, factors), u0, u1, out)
    if loads.rows.size > 0:
        middle = np.empty(out.size)
        for i in indices(out.size):
            middle[i] = 0.5 * (u0[i] + u1[i])
        add_triples(out, loads.rows, loads.values, factors, loads.which, middle, loads.columns)
    if loads.eigenstrains.shape[0] > 0:
        _add_eigen_force(loads, factors, u0, u1, out)
    if loads.custom > 0:
        call_custom(MEAN_FORCE, loads.custom, np.int64(0), t, 1.0, u0, u1, out)


@apart("statics", LoadTables, F1, float, float, F1, Band)
def add_load_stiffness(loads, factors, t, scale, u, A):
    """Subtract the derivative of :func:`external_force` from a band matrix."""
    # If only the lower half is stored, symmetric entries come first, then the upper half.
    lower = A.flat[A.top:]
    if loads.moments.M.size > 0:
        add_moment_stiffness(loads.moments, _of_moments(loads, factors), u, lower, A.ld)
    if loads.eigenstrains.shape[0] > 0:
        _add_eigen_tangent(loads, factors, u, lower, A.ld)
    mirror(A)
    if loads.rows.size > 0:
        subtract_from_band(A, loads.rows, loads.columns, loads.values, factors, loads.which)
    if loads.custom > 0:
        call_custom(STIFFNESS, loads.custom, np.int64(0), t, scale, u, u, A.flat)
