"""The kernels: stresses, forces and tangents of elements with the same samples of strain.

They take the displacement u of the nodes, and its change du in a step: what is found for a step
is for its middle, in such a way that forces do the work that the strain energy changes by.
Stresses are weighted, of shape (ne, ns); see :mod:`.tables`.
"""

import numpy as np

from ...core.source import primitive, shaped, source
from .arrays import (add_constant, add_forces, add_geometric, add_stiffness, add_to_band, at_points,
                     between, block, changed, derivatives, displaced, from_points, moduli_of, moved,
                     own_moduli, put_columns, sampled, weighted)
from .law import LINEAR, conserve, law_evaluate
from .tables import Destination

#: What :func:`evaluate` finds; given as ``np.int64``, or Numba compiles for each.
(FORCE, TANGENT, MEAN, STRESS, CARRY, VISCOUS, GIVEN, GRADIENTS, TURNED, PUSH, PUSH_MEAN,
 PUSH_TANGENT) = range(12)


@source
def _moduli(t, first, strain, shift):
    """Moduli between samples at a strain, (1, nq) or (ne, nq)."""
    if t.law.kind == LINEAR:
        return own_moduli(t, first, first + strain.shape[1])
    E = at_points(t, strain)
    if shift.size > 0:
        E += shift
    D = np.empty((9, E.shape[1], E.shape[2]))
    law_evaluate(t.law, E, D)
    return moduli_of(t, first, D)


@source
def _stress(t, first, strain, change, shift):
    """Stresses (ns, ne) of the mean strain of a change, which is of size 0 for none."""
    if t.law.kind == LINEAR:
        return weighted(t, own_moduli(t, first, first + strain.shape[1]), strain)
    E = at_points(t, strain)
    if shift.size > 0:
        E += shift
    S = np.empty_like(E)
    law_evaluate(t.law, E, S)
    if change.size > 0:
        conserve(t.law, E, at_points(t, change), S)
    return from_points(t, first, S)


@source
def _shift(shift, first, last):
    """A strain at the points of some elements, (3, points, ne)."""
    if shift.size == 0:
        return np.empty((3, 0, 0))
    return np.ascontiguousarray(shift[:, :, first:last])


@source
def add_force(t, u, du, mean, shift, given, out, f):
    """Add the forces at u, or their mean from u to u + du, to f, and write the stresses.

    Parameters
    ----------
    t
        :class:`~skfem_ancf.beam.kernels.tables.StrainTables`.
    u, du, mean
        Displacement and its change, (N,), and True for the mean.
    shift
        Strains added at the points of a law that is not linear, (3, points, ne), or of size 0.
    given
        Stresses whose forces are wanted in place of those of the strain, or of size 0.
    out, f
        Stresses, and forces (N,); of size 0 where they are not wanted.
    """
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        d = displaced(t, first, last, u)
        dd = displaced(t, first, last, du) if mean else np.zeros_like(d)
        strain, X = sampled(t, first, d, dd)
        change = strain[:0]
        if mean:
            change = changed(t, dd, X)
            strain += 0.5 * change
        if given.size > 0 and out.size == 0:
            T = np.ascontiguousarray(given[first:last].T)
        else:
            T = _stress(t, first, strain, change, _shift(shift, first, last))
            if out.size > 0:
                out[first:last] = T.T
            if given.size > 0:
                T[:] = given[first:last].T
        if f.size > 0:
            add_forces(t, first, X, T, f)


@source
def add_held_force(t, u, f):
    """Add the forces of the constant stiffness to f."""
    for first in range(0, len(t.start) if len(t.C) > 0 else 0, block()):
        add_constant(t, first, min(first + block(), len(t.start)), u, f)


@source
def add_tangent(t, u, sign, given, shift, out, f, to):
    """Add forces to f, ``sign`` times tangents to a band, and write the stresses.

    The geometric part is that of ``given`` stresses, unless these are of size 0. Other arguments
    are those of :func:`add_force`; with a ``sign`` of 0 the tangent is the geometric part alone.
    """
    ne, ns, n = len(t.start), t.rows.shape[1], 2 * t.G.shape[1]
    many = min(block(), ne)
    all_B, all_HB, all_K = np.empty((many, ns, n)), np.empty((many, ns, n)), np.empty((many, n, n))
    for first in range(0, ne, block()):
        last = min(first + block(), ne)
        free = _shift(shift, first, last)
        B, HB, K = all_B[:last - first], all_HB[:last - first], all_K[:last - first]
        d = displaced(t, first, last, u)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        T = _stress(t, first, strain, strain[:0], free)
        if f.size > 0:
            add_forces(t, first, X, T, f)
        if out.size > 0:
            out[first:last] = T.T
        if sign == 0.0:
            K[:] = 0.0
        else:
            derivatives(t, first, X, B)
            moved(t, _moduli(t, first, strain, free), B, HB)
            between(B, HB, K)
            if len(t.C) > 0:
                add_stiffness(t, first, K)
        if given.size > 0:
            T[:] = given[first:last].T
        add_geometric(t, first, d, T, K)
        if sign < 0.0:
            K *= sign
        add_to_band(t, first, K, to, False)


@source
def add_carried(t, u, du, T):
    """Add to stresses what a change du makes of them, linearised at u."""
    for first in range(0, len(T), block()):
        last = min(first + block(), len(T))
        d, dd = displaced(t, first, last, u), displaced(t, first, last, du)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        H = _moduli(t, first, strain, np.empty((3, 0, 0)))
        T[first:last] += weighted(t, H, changed(t, dd, X)).T


@source
def add_turned(t, u, du, to):
    """Add ``B(u)^T H (B(u + du) - B(u))`` to a matrix in two halves."""
    ns, n = t.rows.shape[1], 2 * t.G.shape[1]
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        B, C, HB = (np.empty((last - first, ns, n)), np.empty((last - first, ns, n)),
                    np.empty((last - first, ns, n)))
        d, dd = displaced(t, first, last, u), displaced(t, first, last, du)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        derivatives(t, first, X, B)
        derivatives(t, first, sampled(t, first, d + dd, np.zeros_like(d))[1], C)
        C -= B
        moved(t, _moduli(t, first, strain, np.empty((3, 0, 0))), C, HB)
        K = np.empty((last - first, n, n))
        between(B, HB, K)
        add_to_band(t, first, K, to, True)


@source
def put_gradients(t, u, B, HB):
    """Write the derivatives of the strains and of the stresses, (ne, ns, 2 nb) each."""
    ns, n = t.rows.shape[1], 2 * t.G.shape[1]
    for first in range(0, len(t.start), block()):
        last = min(first + block(), len(t.start))
        one, two = np.empty((last - first, ns, n)), np.empty((last - first, ns, n))
        d = displaced(t, first, last, u)
        strain, X = sampled(t, first, d, np.zeros_like(d))
        derivatives(t, first, X, one)
        moved(t, _moduli(t, first, strain, np.empty((3, 0, 0))), one, two)
        put_columns(one, B[first:last])
        put_columns(two, HB[first:last])


@primitive("skfem_ancf.equations.loops")
def run(t, what, u, v, f, given, out, flat, ld):
    """As :func:`evaluate`; compiled once, and not anew in each function that calls it."""
    evaluate(t, what, u, v, f, given, out, flat, ld)


@source
def evaluate(t, what, u, v, f, given, out, flat, ld):
    """One thing of the elements of one table.

    Parameters
    ----------
    t
        StrainTables.
    what
        ``FORCE``, ``MEAN``, ``STRESS``, ``TANGENT``: see :func:`add_force`, :func:`add_tangent`,
        with the constant stiffness. ``CARRY``, ``TURNED``: :func:`add_carried` to ``given``, and
        :func:`add_turned`. ``VISCOUS``: forces of the stresses that a linear law has of the rate v.
        ``GIVEN``: forces of given stresses alone. ``GRADIENTS``: :func:`put_gradients`, and the
        tangent of given stresses if ``flat`` is not of size 0. ``PUSH``, ``PUSH_MEAN``,
        ``PUSH_TANGENT``: what ``given`` changes, stresses of linear laws, strains of others.
    u, v
        Displacement, and at the end for a mean, shape (N,); its change to carry stresses, its rate
        for viscous ones.
    f
        Forces, added to.
    given, out
        Stresses, and what is written, flat; of size 0 for none.
    flat, ld
        A :class:`~skfem_ancf.beam.kernels.tables.Destination`.
    """
    ne, ns, to = len(t.start), t.rows.shape[1], Destination(flat, ld)
    none, still, nothing = shaped(u[:0], (0, ns)), np.empty((3, 0, 0)), u[:0]
    if what >= PUSH:
        _push(t, what, u, v, f, given, to)
        return
    T = shaped(given, (given.size // ns, ns))
    if what == GRADIENTS:
        both = shaped(out, (2, ne, ns, 2 * t.G.shape[1] + 2))
        put_gradients(t, u, both[0], both[1])
        if flat.size > 0:
            add_tangent(t, u, 1.0, T, still, none, nothing, to)
        return
    S = shaped(out, (out.size // ns, ns))
    if what == TURNED:
        add_turned(t, u, v - u, to)
    elif what == CARRY:
        S[:] = T
        add_carried(t, u, v, S)
    elif what == VISCOUS:
        rates = np.zeros((ne, ns))
        add_carried(t, u, v, rates)
        add_force(t, u, u, False, still, rates, none, f)
    elif what == MEAN:
        du = v - u
        add_force(t, u, du, True, still, T, S, f)
        add_held_force(t, u + 0.5 * du, f)
    elif what == TANGENT:
        add_tangent(t, u, 1.0, T, still, S, f, to)
        add_held_force(t, u, f)
    else:
        add_force(t, u, u, False, still, T, S, f)
        if what == FORCE:
            add_held_force(t, u, f)


@source
def _push(t, what, u, v, f, given, to):
    """What stresses or, of laws that are not linear, strains change that are given."""
    ns, still, du = t.rows.shape[1], np.empty((3, 0, 0)), v - u
    none = shaped(u[:0], (0, ns))
    if t.law.kind == LINEAR:
        T = shaped(given, (given.size // ns, ns))
        if what == PUSH_TANGENT:
            add_tangent(t, u, 0.0, T, still, none, u[:0], to)
        else:
            add_force(t, u, du, what == PUSH_MEAN, still, T, none, f)
        return
    shift = shaped(given, (3, t.weights.shape[1], len(t.start)))
    if what == PUSH_TANGENT:
        add_tangent(t, u, 1.0, none, shift, none, u[:0], to)
        add_tangent(t, u, -1.0, none, still, none, u[:0], to)
        return
    less = np.zeros_like(f)
    add_force(t, u, du, what == PUSH_MEAN, shift, none, none, f)
    add_force(t, u, du, what == PUSH_MEAN, still, none, none, less)
    f -= less
