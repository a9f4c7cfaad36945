"""Kernels: stresses, forces and tangents of elements with the same samples of strain.

They take the displacement u and its change du in a step. Results for a step belong to its middle,
so that the work of the forces equals the change of the strain energy. Stresses are weighted, (ne,
ns); see :mod:`.tables`.
"""

import numpy as np

from ...core.source import shaped, source
from .arrays import (add_constant, add_forces, add_geometric, add_material, add_products,
                     add_stiffness, add_to_band, at_points, block, changed, derivatives,
                     difference, displaced, from_points, middle, moduli_of, moved, linear_moduli,
                     put_columns, put_stresses, sampled, shifted, stresses_at, weighted)
from .law import LINEAR, conserve, law_evaluate
from .tables import Destination

#: Results of :func:`evaluate`; passed as ``np.int64``, so that Numba compiles once.
(FORCE, TANGENT, MEAN, STRESS, LINEARISED, VISCOUS, GIVEN, GRADIENTS, UNSYMMETRIC,
 EIGENSTRAIN, EIGENSTRAIN_MEAN, EIGENSTRAIN_TANGENT) = range(12)


@source
def _moduli(t, first, strain, shift):
    """Moduli (nq, ne) between samples, or their change by a shift of the strain."""
    if t.law.kind == LINEAR:
        return linear_moduli(t, first, first + strain.shape[1])
    E = at_points(t, strain)
    D = np.empty((9, E.shape[1], E.shape[2]))
    law_evaluate(t.law, E, D)
    if shift.size > 0:
        still, D = D, np.empty(D.shape)
        law_evaluate(t.law, shifted(E, first, shift), D)
        D = difference(D, still)
    return moduli_of(t, first, D)


@source
def _stress(t, first, strain, change, shift):
    """Stresses (ns, ne) for the mean of a change of strain, or their change by a shift."""
    if t.law.kind == LINEAR:
        return weighted(t, linear_moduli(t, first, first + strain.shape[1]), strain)
    E = at_points(t, strain)
    C = at_points(t, change) if change.size > 0 else np.empty((3, 0, 0))
    S = np.empty_like(E)
    _law_stress(t, E, C, S)
    if shift.size > 0:
        still, S = S, np.empty_like(E)
        _law_stress(t, shifted(E, first, shift), C, S)
        S = difference(S, still)
    return from_points(t, first, S)


@source
def _law_stress(t, E, C, S):
    """Stress at the points, whose work on the change C is the change of energy."""
    law_evaluate(t.law, E, S)
    if C.size > 0:
        conserve(t.law, E, C, S)


@source
def add_forces_at(t, what, u, du, given, shift, out, f):
    """Add forces to f, and write the stresses.

    ``what`` is as in :func:`evaluate`; ``du`` (N,) the change or rate of the displacement;
    ``given`` stresses replace those of the strain; ``shift`` (3, points, ne) is added to the strain
    of nonlinear laws; ``out`` are stresses, f (N,) forces. Arrays of size 0 are not used.
    """
    rate = what == LINEARISED or what == VISCOUS
    mean = what == MEAN or what == EIGENSTRAIN_MEAN
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        d = displaced(t, first, last, u)
        still = np.zeros_like(d)
        dd = displaced(t, first, last, du) if du.size > 0 else still
        strain, X = sampled(t, first, d, dd if mean else still)
        change = strain[:0]
        if rate or mean:
            change = changed(t, dd, X)
        if rate:
            T = weighted(t, _moduli(t, first, strain, shift), change)
        elif out.size == 0 and given.size > 0:
            T = stresses_at(given, first, last)
        else:
            T = _stress(t, first, middle(strain, change), change, shift)
        if out.size > 0 and what != VISCOUS:
            put_stresses(T, first, given if what == LINEARISED else given[:0], out)
        if f.size > 0 and what != LINEARISED:
            add_forces(t, first, X, stresses_at(given, first, last) if given.size > 0 else T, f)


@source
def add_tangent(t, u, given, material, shift, out, f, to):
    """Add forces to f and tangents to a band, and write the stresses.

    ``given`` stresses, if any, are those of the geometric part, which is alone unless ``material``.
    Other arguments are as in :func:`add_forces_at`.
    """
    n = 2 * t.G.shape[2]
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        d = displaced(t, first, last, u)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        if f.size > 0 or out.size > 0 or given.size == 0:
            T = _stress(t, first, strain, strain[:0], shift)
        else:
            T = stresses_at(given, first, last)
        w, K = np.zeros((t.products.shape[1], 4, last - first)), np.zeros((last - first, n, n))
        if f.size > 0:
            add_forces(t, first, X, T, f)
        if out.size > 0:
            put_stresses(T, first, given[:0], out)
        if material:
            add_material(t, _moduli(t, first, strain, shift), X, X, w)
            if len(t.C) > 0 and shift.size == 0:
                add_stiffness(t, first, K)
        add_geometric(t, first, d, stresses_at(given, first, last) if given.size > 0 else T, w)
        add_products(t, first, w, 1.0, 1.0, K)
        add_to_band(t, first, K, to, False)


@source
def add_unsymmetric(t, u, du, to):
    """Add ``B(u)^T H (B(u + du) - B(u))`` to a matrix in two halves."""
    n, shift = 2 * t.G.shape[2], np.empty((3, 0, 0))
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        d, dd = displaced(t, first, last, u), displaced(t, first, last, du)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        Y = difference(sampled(t, first, shifted(d, 0, dd), np.zeros_like(d))[1], X)
        H, K = _moduli(t, first, strain, shift), np.zeros((last - first, n, n))
        for k in range(2):
            w = np.zeros((t.products.shape[1], 4, last - first))
            add_material(t, H, X if k == 0 else Y, Y if k == 0 else X, w)
            add_products(t, first, w, 1.0 - k, 1.0 * k, K)
        add_to_band(t, first, K, to, True)


@source
def add_constant_force(t, u, f):
    """Add the forces of the constant stiffness."""
    for first in range(0, len(t.start) if len(t.C) > 0 else 0, block()):
        add_constant(t, first, min(first + block(), len(t.start)), u, f)


@source
def put_gradients(t, u, B, HB):
    """Write the derivatives of strains and stresses, (ne, ns, 2 nb) each."""
    ns, n = t.rows.shape[1], 2 * t.G.shape[2]
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        one, two = np.empty((last - first, ns, n)), np.empty((last - first, ns, n))
        d = displaced(t, first, last, u)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        derivatives(t, first, X, one)
        moved(t, _moduli(t, first, strain, np.empty((3, 0, 0))), one, two)
        put_columns(one, B[first:last])
        put_columns(two, HB[first:last])


@source
def evaluate(t, what, u, v, f, given, out, flat, ld):
    """Evaluate the elements of one table.

    Parameters
    ----------
    t
        StrainTables.
    what
        ``FORCE``, ``MEAN``, ``STRESS``, ``TANGENT``: forces at u, their mean from u to v, stresses,
        forces and tangent, with the constant stiffness. ``LINEARISED``: ``given`` stresses plus
        their linearised change by v at u. ``UNSYMMETRIC``: :func:`add_unsymmetric`. ``VISCOUS``:
        forces of the stresses of a linear law for the rate v. ``GIVEN``: forces of given stresses.
        ``GRADIENTS``: :func:`put_gradients`, and the tangent at given stresses unless ``flat`` is
        empty. ``EIGENSTRAIN``, ``EIGENSTRAIN_MEAN``, ``EIGENSTRAIN_TANGENT``: change by ``given``
        eigenstrains (stresses for linear laws, strains for others).
    u, v
        Displacement, and at the end for a mean, shape (N,).
    f
        Forces, added to.
    given, out
        Given and written stresses, flat; or of size 0.
    flat, ld
        A :class:`~skfem_ancf.beam.kernels.tables.Destination`.
    """
    ne, ns, none = len(t.start), t.rows.shape[1], u[:0]
    shifted = what >= EIGENSTRAIN and t.law.kind != LINEAR
    shift = shaped(given if shifted else none, (3, t.weights.shape[1], ne if shifted else 0))
    stresses = none if shifted else given
    T = shaped(stresses, (stresses.size // ns, ns))
    if what == GRADIENTS:
        both = shaped(out, (2, ne, ns, 2 * t.G.shape[2] + 2))
        put_gradients(t, u, both[0], both[1])
    S = shaped(none if what == GRADIENTS else out, (-1, ns))
    du = none
    if what == MEAN or what == EIGENSTRAIN_MEAN or what == UNSYMMETRIC:
        du = v - u
    elif what == LINEARISED or what == VISCOUS:
        du = v
    if what == UNSYMMETRIC:
        add_unsymmetric(t, u, du, Destination(flat, ld))
    elif what == TANGENT or what == EIGENSTRAIN_TANGENT or what == GRADIENTS:
        if flat.size > 0:
            add_tangent(t, u, T, what != EIGENSTRAIN_TANGENT or shifted, shift, S, f,
                        Destination(flat, ld))
    else:
        add_forces_at(t, what, u, du, T, shift, S, f)
    if what == MEAN:
        add_constant_force(t, u + 0.5 * du, f)
    elif f.size > 0 and (what == FORCE or what == TANGENT):
        add_constant_force(t, u, f)
