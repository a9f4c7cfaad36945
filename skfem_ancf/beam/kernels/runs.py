"""Kernels of :class:`~skfem_ancf.beam.kernels.elements.Elements`. Displacements u are (N,); f (N,)
and ``flat`` are added to. Stresses are weighted, flat, (ne, ns); ``flat, ld`` store entry (i, j), i
>= j, of a tangent at ``flat[j * ld + i - j]``. Forces and tangents of the strain include the
constant stiffness. Arrays of size 0 are not used. In compiled code the functions of the same names
in :mod:`.loops` replace them."""

import numpy as np

from ...core import primitive
from .tables import HISTORY, LINEAR

#: Marks kernels with a compiled version.
kernel = primitive("skfem_ancf.beam.kernels.loops")


def _given(e, T):
    """Stresses (ns, ne) from those of all elements, flat."""
    return T.reshape(e.ne, e.ns).T


def _put(e, T, out):
    """Write stresses (ns, ne) to ``out``, flat."""
    out.reshape(e.ne, e.ns)[:] = T.T


def _moved(e, u, v):
    """Relative DOFs, change of the rows from the reference, that from u to v, and directions."""
    # With v, DOFs and directions are means from u to v; without it, the second change is None.
    U, d, one, Y = e.at(u)
    if not v.size:
        return U, (d, one), None, Y
    dU = e.relative(v - u)
    dd = e.rows(dU)
    return U + 0.5 * dU, (d, one), dd, e.directions(one, e.measured(e.x + d + dd))


def _strain(e, at, dd, Y):
    """The strain, in the middle, and its change or None."""
    strain, change = e.strain(*at), None if dd is None else e.change(Y, dd)
    return strain if change is None else strain + 0.5 * change, change


@kernel
def run_force(e, u, v, given, out, f):
    """Force and stresses at u, or with v means from u to v whose work is the change of the energy.
    Given stresses act in place of those of the strain; without ``out``, they act without the
    constant stiffness."""
    U, at, dd, Y = _moved(e, u, v)
    T, whole = None, out.size > 0 or given.size == 0
    if whole:
        T = e.stress(*_strain(e, at, dd, Y))
    if out.size:
        _put(e, T, out)
    if f.size:
        e.add(e.force(Y, _given(e, given) if given.size else T, U if whole else None), f)


@kernel
def run_linearised(e, u, du, given, out, f):
    """Linearised stresses of a change or rate du at u: plus given ones to out, or as forces."""
    _, d, one, Y = e.at(u)
    moduli = e.moduli if e.t.law.kind == LINEAR else e.moduli_at(e.strain(d, one))
    T = e.linear_stress(e.change(Y, e.rows(e.relative(du))), moduli)
    if out.size:
        _put(e, _given(e, given) + T, out)
    if f.size:
        e.add(e.force(Y, T), f)


@kernel
def run_tangent(e, u, given, out, f, flat, ld):
    """Tangent and force at u; writes the stresses."""
    # The geometric part has the given stresses, or those of the strain if there are none.
    U, d, one, Y = e.at(u)
    T, moduli = e.stress_and_moduli(e.strain(d, one))
    if f.size:
        e.add(e.force(Y, T, U), f)
    if out.size:
        _put(e, T, out)
    K = e.tangent(one, Y, _given(e, given) if given.size else T, moduli)
    if e.constant is not None:
        K += e.constant
    e.add_to_band(K, flat, ld)


@kernel
def run_unsymmetric(e, u, v, flat, ld):
    """Add ``B(u)^T D (B(v) - B(u))`` to a matrix, entry (i, j) at ``flat[j * ld + i - j]``."""
    _, d, one, Y = e.at(u)
    B, change = e.derivatives(Y), e.derivatives(e.at(v)[3])
    K = B.transpose(0, 2, 1) @ (e.square(e.moduli_at(e.strain(d, one))) @ (change - B))
    j = np.arange(K.shape[1])
    at = (e.t.start[:, None, None] + j) * ld + j[:, None] - j
    flat += np.bincount(at.ravel(), K.ravel(), len(flat))


@kernel
def run_put(e, given):
    """Set the eigenstrains of a law with a history, minus ``given`` at the points."""
    if e.t.law.kind == HISTORY:
        e.now[:] = -given.reshape(e.now.shape)


@kernel
def run_eigen_force(e, u, v, given, f):
    """Change of the force at u, or with v of the mean from u to v, by eigenstrains."""
    # ``given`` are stresses for a linear law, else strains at the points, (3, points, ne). Laws
    # with a history have it in their strain, see :func:`run_put`.
    if e.t.law.kind == LINEAR:
        run_force(e, u, v, given, u[:0], f)
    elif e.t.law.kind != HISTORY:
        _, at, dd, Y = _moved(e, u, v)
        e.add(e.force(Y, e.stress(*_strain(e, at, dd, Y), given.reshape(3, -1, e.ne))), f)


@kernel
def run_eigen_tangent(e, u, given, flat, ld):
    """Change of the tangent at u by eigenstrains."""
    if e.t.law.kind == HISTORY:
        return
    _, d, one, Y = e.at(u)
    T, moduli = _given(e, given) if e.t.law.kind == LINEAR else None, None
    if T is None:
        strain, shift = e.strain(d, one), given.reshape(3, -1, e.ne)
        T, moduli = e.stress(strain, shift=shift), e.moduli_at(strain, shift)
    e.add_to_band(e.tangent(one, Y, T, moduli), flat, ld)


@kernel
def run_accept(e, u, v, out):
    """Set the history after an increment from u to v; add what it dissipates to ``out[0]``."""
    if e.t.law.kind == HISTORY:
        out[0] += e.accept(u, v)
