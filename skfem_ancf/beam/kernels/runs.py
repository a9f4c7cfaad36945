"""Kernels of :class:`~skfem_ancf.beam.kernels.elements.Elements`. Displacements u are (N,); f (N,)
and ``flat`` are added to. Stresses are weighted, flat, (ne, ns); ``flat, ld`` store entry (i, j), i
>= j, of a tangent at ``flat[j * ld + i - j]``. Forces and tangents of the strain include the
constant stiffness. Arrays of size 0 are not used. In compiled code the functions of the same names
in :mod:`.loops` replace them."""

import numpy as np

from ...core import primitive
from .law import HISTORY, LINEAR

#: Marks kernels with a compiled version.
kernel = primitive("skfem_ancf.beam.kernels.loops")


def _given(e, T):
    """Stresses (ns, ne) from those of all elements, flat."""
    return T.reshape(e.ne, e.ns).T


def _put(e, T, out):
    """Write stresses (ns, ne) to ``out``, flat."""
    out.reshape(e.ne, e.ns)[:] = T.T


def _mean(e, u, v):
    """Middle of the relative DOFs, directions, middle and change of the strain from u to v."""
    U, d, one = e.at(u)
    dU = e.relative(v - u)
    dd = e.rows(dU)
    Y = e.directions(one, e.measured(e.x + d + dd))
    change = e.change(Y, dd)
    return U + 0.5 * dU, Y, e.strain(d, one) + 0.5 * change, change


@kernel
def run_force(e, u, f):
    U, d, one = e.at(u)
    e.add(e.force(e.directions(one, one), e.stress(e.strain(d, one)), U), f)


@kernel
def run_stress(e, u, out):
    _, d, one = e.at(u)
    _put(e, e.stress(e.strain(d, one)), out)


@kernel
def run_linearised(e, u, du, given, out):
    """Write the given stresses plus the linearised change by du at u."""
    _put(e, _given(e, given) + _rate(e, u, du)[1], out)


def _rate(e, u, du):
    """Directions at u, and the linearised change of the stresses by du."""
    _, d, one = e.at(u)
    Y = e.directions(one, one)
    moduli = e.moduli if e.t.law.kind == LINEAR else e.moduli_at(e.strain(d, one))
    return Y, e.linear_stress(e.change(Y, e.rows(e.relative(du))), moduli)


@kernel
def run_mean(e, u, v, f):
    """The force whose work from u to v is the change of the energy."""
    U, Y, middle, change = _mean(e, u, v)
    e.add(e.force(Y, e.stress(middle, change), U), f)


@kernel
def run_mixed(e, u, given, out, f):
    """The force at u of given stresses; writes those of the strain."""
    U, d, one = e.at(u)
    _put(e, e.stress(e.strain(d, one)), out)
    e.add(e.force(e.directions(one, one), _given(e, given), U), f)


@kernel
def run_mean_mixed(e, u, v, given, out, f):
    """The mean force from u to v of given stresses; writes the mean ones of the strain."""
    U, Y, middle, change = _mean(e, u, v)
    _put(e, e.stress(middle, change), out)
    e.add(e.force(Y, _given(e, given), U), f)


@kernel
def run_given(e, u, given, f):
    """The force at u of given stresses alone."""
    one = e.at(u)[2]
    e.add(e.force(e.directions(one, one), _given(e, given)), f)


@kernel
def run_viscous(e, u, v, f):
    """The force at u of the linearised stresses of a rate v alone."""
    e.add(e.force(*_rate(e, u, v)), f)


@kernel
def run_tangent(e, u, given, out, f, flat, ld):
    """Tangent and force at u; writes the stresses. The geometric part has the given stresses, or
    those of the strain if there are none."""
    U, d, one = e.at(u)
    Y, strain = e.directions(one, one), e.strain(d, one)
    T, moduli = e.stress_and_moduli(strain)
    if f.size:
        e.add(e.force(Y, T, U), f)
    if out.size:
        _put(e, T, out)
    K = e.tangent(one, Y, _given(e, given) if given.size else T, moduli)
    if e.constant is not None:
        K += e.constant
    e.add_to_band(K, flat, ld)


@kernel
def run_gradients(e, u, out):
    """Write derivatives of the strains and of the weighted stresses, (2, ne, ns, 2 nb)."""
    _, d, one = e.at(u)
    both = out.reshape(2, e.ne, e.ns, -1)
    both[0] = e.derivatives(e.directions(one, one))
    np.matmul(e.square(e.moduli_at(e.strain(d, one))), both[0], out=both[1])


@kernel
def run_unsymmetric(e, u, v, flat, ld):
    """Add ``B(u)^T D (B(v) - B(u))`` to a matrix, entry (i, j) at ``flat[j * ld + i - j]``."""
    _, d, one = e.at(u)
    two = e.at(v)[2]
    B, change = e.derivatives(e.directions(one, one)), e.derivatives(e.directions(two, two))
    K = B.transpose(0, 2, 1) @ (e.square(e.moduli_at(e.strain(d, one))) @ (change - B))
    j = np.arange(K.shape[1])
    at = (e.t.start[:, None, None] + j) * ld + j[:, None] - j
    flat += np.bincount(at.ravel(), K.ravel(), len(flat))


def _shift(e, given):
    """Stresses of linear laws, or the shift of the strain of others; the other is None. Laws with a
    history have it in their strain, see :func:`run_put`, and no further stress."""
    if e.t.law.kind == LINEAR:
        return _given(e, given), None
    if e.t.law.kind == HISTORY:
        return np.zeros((e.ns, e.ne)), None
    return None, given.reshape(3, -1, e.ne)


@kernel
def run_put(e, given):
    """Set the eigenstrains of a law with a history, minus ``given`` at the points."""
    if e.t.law.kind == HISTORY:
        e.now[:] = -given.reshape(e.now.shape)


@kernel
def run_eigen_force(e, u, given, f):
    """Change of the force at u by eigenstrains. ``given`` are stresses for a linear law, else
    strains at the points, (3, points, ne)."""
    _, d, one = e.at(u)
    T, shift = _shift(e, given)
    if T is None:
        T = e.stress(e.strain(d, one), shift=shift)
    e.add(e.force(e.directions(one, one), T), f)


@kernel
def run_eigen_mean(e, u, v, given, f):
    """Change of the mean force from u to v by eigenstrains."""
    _, Y, middle, change = _mean(e, u, v)
    T, shift = _shift(e, given)
    e.add(e.force(Y, e.stress(middle, change, shift) if T is None else T), f)


@kernel
def run_eigen_tangent(e, u, given, flat, ld):
    """Change of the tangent at u by eigenstrains."""
    _, d, one = e.at(u)
    T, shift = _shift(e, given)
    moduli = None
    if T is None:
        strain = e.strain(d, one)
        T, moduli = e.stress(strain, shift=shift), e.moduli_at(strain, shift)
    e.add_to_band(e.tangent(one, e.directions(one, one), T, moduli), flat, ld)


@kernel
def run_accept(e, u, v, out):
    """Set the history after an increment from u to v; add what it dissipates to ``out[0]``."""
    if e.t.law.kind == HISTORY:
        out[0] += e.accept(u, v)


@kernel
def add_changes(B, start, x, T):
    """Add ``B[e] x`` at start[e] to T (ne ns,), with B repeated for copies of the elements."""
    x = x[start[:, None] + np.arange(B.shape[2])].reshape(-1, len(B), B.shape[2], 1)
    T += (B @ x).ravel()


@kernel
def add_transposed(B, start, T, f):
    """Add ``B[e]^T T[e]`` at start[e] to f, with B repeated for copies."""
    F = T.reshape(-1, len(B), 1, B.shape[1]) @ B
    np.add.at(f, start[:, None] + np.arange(B.shape[2]), F.reshape(len(start), -1))
