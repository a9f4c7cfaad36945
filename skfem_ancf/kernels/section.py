"""Beams with sections: one term of the strain energy.

Rows of the table are those of d/dX, then of d/dY. A strain sample is ``c (r_g . G_h u + G_g u .
e_h)`` of two rows; g = h and c = 1/2 for a normal strain. Samples are interpolated to the points of
integration, and forces go back the same way. With moduli between samples, which have the
interpolation and the weights in them, the tangent is a sum over pairs of rows.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..materials import LinearLaw
from ..quadrature import tensor
from ..source import F1, F2, F3, I1, I2, column, lanes, source
from .base import (Chain, PairTables, Texts, add_force, add_held_energy, add_tangent, apart, block,
                   in_rounds, load, packed, pair_tables, product)
from .law import (LINEAR, LawTables, law_energy, law_moduli, law_stress, law_tables, linear_stress,
                  mean_stress)


class SectionPack(NamedTuple):
    """The tables of a term; :func:`section_pack` makes it.

    Attributes
    ----------
    table, transposed, frame
        Derivatives of the local functions (rows, nb, 1 or elements), the same as (nb, rows, 1 or
        0), and rows of the frame e_1, e_2, (rows, 2, 1 or elements).
    weights, place
        Of the points of integration, (points, 1 or elements), and which are an element's.
    rows, factors, normal
        g, h and the number of their pair for each sample, (3, samples), c, and the number of
        samples of normal strains, which come first.
    along_xx, along_yy, along_xy
        Interpolation along the axis.
    law
        :class:`~skfem_ancf.kernels.law.LawTables`.
    constant
        Stabilisation (2 nb, 2 nb, 0, 1 or elements).
    start, span
        First coordinate of each element, and 0 to 2 nb - 1.
    pairs
        :class:`~skfem_ancf.kernels.base.PairTables`.
    terms, rounds
        The pair, its number in the skew part, and the rows k and l of ``M[pair] += modulus r_k
        r_l``, (4, n), sorted so that between two ``rounds`` no pair comes twice.
    moduli
        Of a linear law, (n, 1 or elements).
    mixing, parts, mixing_rounds
        Of other laws: the term, the modulus (c, d) as 3 c + d and the point of each summand of a
        modulus, (3, m), and its factor, (m,).
    """

    table: F3
    transposed: F3
    frame: F3
    weights: F2
    place: I1
    rows: I2
    factors: F1
    normal: int
    along_xx: F2
    along_yy: F2
    along_xy: F2
    law: LawTables
    constant: F3
    start: I1
    span: I1
    pairs: PairTables
    terms: I2
    rounds: I1
    moduli: F2
    mixing: I2
    parts: F1
    mixing_rounds: I1


class SectionWork(NamedTuple):
    """Work arrays of a block of elements, of which frame and weights are the elements' own."""

    U: np.ndarray
    d: np.ndarray
    r: np.ndarray
    T: np.ndarray
    samples: np.ndarray
    strain: np.ndarray
    stress: np.ndarray
    frame: np.ndarray
    weights: np.ndarray


@source
def section_work(pack, first, size, u):
    """Work arrays for the elements from ``first`` on."""
    rows, n, nb = pack.table.shape[0], pack.weights.shape[0], pack.table.shape[1]
    frame, weights = np.empty((rows, 2, size)), np.empty((n, size))
    work = SectionWork(np.empty((nb, 2, size), u.dtype), np.empty((rows, 2, size), u.dtype),
                       np.empty((rows, 2, size), u.dtype), np.empty((rows, 2, size), u.dtype),
                       np.empty((pack.factors.size, size), u.dtype),
                       np.empty((3, n, size), u.dtype), np.empty((3, n, size), u.dtype),
                       frame, weights)
    section_place(pack, first, work)
    return work


@source
def section_place(pack, first, work):
    """Frame and weights of the elements from ``first`` on."""
    at = pack.place[first:first + work.U.shape[2]]
    for g in lanes(work.frame.shape[0]):
        for i in lanes(2):
            for e in lanes(at.size):
                work.frame[g, i, e] = pack.frame[g, i, at[e]]
    for p in lanes(work.weights.shape[0]):
        for e in lanes(at.size):
            work.weights[p, e] = pack.weights[p, at[e]]


@source
def section_open(pack, first, size, u, work):
    """Work arrays and coordinates of the next block of elements."""
    if size < work.U.shape[2]:
        work = section_work(pack, first, size, u)
    elif first > 0 and pack.frame.shape[2] > 1:
        section_place(pack, first, work)
    load(pack.start, pack.span, first, u, work.U)
    return work


@source
def pair_strains(rows, factors, r, d, x, samples):
    """c (r_g . d_h + d_g . x_h): the strain if x is the frame, its derivative if x is r."""
    for s in lanes(factors.size):
        g, h, c = rows[0, s], rows[1, s], factors[s]
        for e in lanes(d.shape[2]):
            samples[s, e] = column(c) * (r[g, 0, e] * d[h, 0, e] + r[g, 1, e] * d[h, 1, e]
                                         + d[g, 0, e] * x[h, 0, e] + d[g, 1, e] * x[h, 1, e])


@source
def section_strain(pack, first, work):
    """Displacement gradients d, position gradients r, and the strain samples."""
    d, r = work.d, work.r
    product(pack.table, first, work.U, d)
    for g in lanes(d.shape[0]):
        for i in lanes(2):
            for e in lanes(d.shape[2]):
                r[g, i, e] = work.frame[g, i, e] + d[g, i, e]
    pair_strains(pack.rows, pack.factors, r, d, work.frame, work.samples)


@source
def to_points(L, first, samples, points):
    """points = L samples, from the sample ``first``; returns the sample after."""
    n = points.size // L.shape[0]
    after = first + L.shape[1] * (points.shape[0] // L.shape[0])
    x, y = points.reshape(L.shape[0], n), samples[first:after].reshape(L.shape[1], n)
    for i in range(L.shape[0]):
        for e in lanes(n):
            x[i, e] = 0.0
        for k in range(L.shape[1]):
            c = L[i, k]
            if c != 0.0:
                for e in lanes(n):
                    x[i, e] += c * y[k, e]
    return after


@source
def to_samples(L, first, w, points, samples):
    """samples = L^T w points, from the sample ``first``; returns the sample after."""
    n = points.size // L.shape[0]
    after = first + L.shape[1] * (points.shape[0] // L.shape[0])
    x, y = points.reshape(L.shape[0], n), samples[first:after].reshape(L.shape[1], n)
    weights = w.reshape(L.shape[0], n)
    for k in range(L.shape[1]):
        for e in lanes(n):
            y[k, e] = 0.0
        for i in range(L.shape[0]):
            c = L[i, k]
            if c != 0.0:
                for e in lanes(n):
                    y[k, e] += c * weights[i, e] * x[i, e]
    return after


@source
def strain_points(pack, work):
    """Samples of the strain, interpolated to the points of integration."""
    first = to_points(pack.along_xx, 0, work.samples, work.strain[0])
    first = to_points(pack.along_yy, first, work.samples, work.strain[1])
    to_points(pack.along_xy, first, work.samples, work.strain[2])


@source
def stress_samples(pack, work):
    """The transpose of strain_points, with the weights of the points."""
    first = to_samples(pack.along_xx, 0, work.weights, work.stress[0], work.samples)
    first = to_samples(pack.along_yy, first, work.weights, work.stress[1], work.samples)
    to_samples(pack.along_xy, first, work.weights, work.stress[2], work.samples)


@source
def add_section_force(pack, first, work, f):
    """Add what the stress samples do on the gradients."""
    r, T, samples = work.r, work.T, work.samples
    T[:] = 0.0
    for s in lanes(pack.normal):
        g = pack.rows[0, s]
        for i in range(2):
            for e in lanes(r.shape[2]):
                T[g, i, e] += samples[s, e] * r[g, i, e]
    for s in lanes(pack.normal, pack.factors.size):
        g, h = pack.rows[0, s], pack.rows[1, s]
        for i in range(2):
            for e in lanes(r.shape[2]):
                T[g, i, e] += samples[s, e] * r[h, i, e]
            for e in lanes(r.shape[2]):
                T[h, i, e] += samples[s, e] * r[g, i, e]
    add_force(pack.table, pack.transposed, pack.constant, pack.start, pack.span, first, T, work.U,
              f)


@source
def section_moduli(pack, first, work, moduli):
    """The modulus of each term, shape (terms, elements)."""
    size = moduli.shape[1]
    if pack.law.kind == LINEAR:
        at = pack.place[first:first + size]
        for t in lanes(moduli.shape[0]):
            for e in lanes(size):
                moduli[t, e] = pack.moduli[t, at[e]]
        return
    n = work.strain.shape[1]
    D = np.empty((3, 3, n, size))
    law_moduli(pack.law, work.strain, D)
    flat, w = D.reshape(9, n, size), work.weights
    for c in lanes(9):
        for p in lanes(n):
            for e in lanes(size):
                flat[c, p, e] *= w[p, e]
    moduli[:] = 0.0
    for k in range(pack.mixing_rounds.size - 1):
        for m in lanes(pack.mixing_rounds[k], pack.mixing_rounds[k + 1]):
            t, c, p = pack.mixing[0, m], pack.mixing[1, m], pack.mixing[2, m]
            x = pack.parts[m]
            for e in lanes(size):
                moduli[t, e] += column(x) * flat[c, p, e]


@source
def add_material(terms, rounds, moduli, r, M, M_skew):
    """Add the material part to the factors of the pairs: xx, yy, xy symmetric, and xy skew."""
    for k in range(rounds.size - 1):
        for t in lanes(rounds[k], rounds[k + 1]):
            p, q, g, h = terms[0, t], terms[1, t], terms[2, t], terms[3, t]
            for e in lanes(r.shape[2]):
                c, gx, gy, hx, hy = moduli[t, e], r[g, 0, e], r[g, 1, e], r[h, 0, e], r[h, 1, e]
                x, y = c * gx * hy, c * gy * hx
                M[p, 0, e] += c * gx * hx
                M[p, 1, e] += c * gy * hy
                M[p, 2, e] += 0.5 * (x + y)
                M_skew[q, 0, e] += 0.5 * (x - y)


@source
def add_geometric(rows, samples, M):
    """Add the stress to the factors of the pairs, the same for both components."""
    for s in lanes(samples.shape[0]):
        p = rows[2, s]
        for e in lanes(samples.shape[1]):
            M[p, 0, e] += samples[s, e]
            M[p, 1, e] += samples[s, e]


@source
def add_section_tangent(pack, first, work, carried, use_carried, flat, ld, start):
    """Add the tangents of a block of elements."""
    S, size = work.stress, work.U.shape[2]
    if use_carried:
        block_of = carried[:, :, first:first + size]
        for c in lanes(3):
            for p in lanes(S.shape[1]):
                for e in lanes(size):
                    S[c, p, e] = block_of[c, p, e]
        stress_samples(pack, work)
    M = np.zeros((pack.pairs.pairs.shape[1], 3, size))
    M_skew = np.zeros((pack.pairs.skew.shape[1], 1, size))
    add_geometric(pack.rows, work.samples, M)
    moduli = np.empty((pack.terms.shape[1], size))
    section_moduli(pack, first, work, moduli)
    add_material(pack.terms, pack.rounds, moduli, work.r, M, M_skew)
    add_tangent(pack.table, pack.pairs, pack.start, first, M, M_skew, flat, ld, start)


@source
def section_store(S, first, out):
    """Stresses of a block into those of all elements."""
    block_of = out[:, :, first:first + S.shape[2]]
    for c in lanes(3):
        for p in lanes(S.shape[1]):
            for e in lanes(S.shape[2]):
                block_of[c, p, e] = S[c, p, e]


@source
def section_loop(pack, u, f, tangent, carried, use_carried, stresses, flat, ld, start):
    """Force into f, and if asked for tangent into the band and stresses (3, points, elements)."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = section_work(pack, 0, min(most, elements), u)
    for first in range(0, elements, most):
        work = section_open(pack, first, min(most, elements - first), u, work)
        section_strain(pack, first, work)
        strain_points(pack, work)
        law_stress(pack.law, work.strain, work.stress)
        stress_samples(pack, work)
        add_section_force(pack, first, work, f)
        if tangent:
            section_store(work.stress, first, stresses)
            add_section_tangent(pack, first, work, carried, use_carried, flat, ld, start)


@source
def section_force(pack, u, f):
    """Add the internal force of the displacement u (N,) to f."""
    none = np.empty((1, 1, 1))
    section_loop(pack, u, f, False, none, False, none, none[0, 0], 1, 0)


@source
def section_tangent(pack, u, f, carried, use_carried, stresses, flat, ld, start):
    """Add the internal force to f and the tangent to a band matrix.

    Parameters
    ----------
    pack
        SectionPack.
    u, f
        Displacement and force, shape (N,).
    carried, use_carried
        Stresses (3, points, elements) for the geometric part in place of those of the strain.
    stresses
        Second Piola-Kirchhoff stresses, shape (3, points, elements); written.
    flat, ld, start
        Entry (i, j), i >= j, is added at ``flat[(start + j) * ld + i - j]``.
    """
    section_loop(pack, u, f, True, carried, use_carried, stresses, flat, ld, start)


@source
def section_carry(pack, u, du, before, out):
    """The stresses, linearised, at u + du, from those ``before``: out (3, points, elements)."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = section_work(pack, 0, min(most, elements), u)
    for first in range(0, elements, most):
        size = min(most, elements - first)
        work = section_open(pack, first, size, u, work)
        section_strain(pack, first, work)
        moduli = np.empty((3, 3, 0, 0))
        if pack.law.kind != LINEAR:
            strain_points(pack, work)
            moduli = np.empty((3, 3, work.strain.shape[1], size))
            law_moduli(pack.law, work.strain, moduli)
        load(pack.start, pack.span, first, du, work.U)
        product(pack.table, first, work.U, work.d)
        pair_strains(pack.rows, pack.factors, work.r, work.d, work.r, work.samples)
        strain_points(pack, work)
        if pack.law.kind == LINEAR:
            linear_stress(pack.law.D, work.strain, work.stress)
        else:
            tangent_stress(moduli, work.strain, work.stress)
        section_store(work.stress, first, out)
        add_stored(before, first, out, size)


@source
def tangent_stress(moduli, strain, S):
    """S = D eps with the moduli of each point."""
    for c in range(3):
        for p in lanes(S.shape[1]):
            for e in lanes(S.shape[2]):
                S[c, p, e] = (moduli[c, 0, p, e] * strain[0, p, e]
                              + moduli[c, 1, p, e] * strain[1, p, e]
                              + moduli[c, 2, p, e] * strain[2, p, e])


@source
def add_stored(before, first, out, size):
    """Add the stresses of a block of elements."""
    x, y = before[:, :, first:first + size], out[:, :, first:first + size]
    for c in lanes(out.shape[0]):
        for p in lanes(out.shape[1]):
            for e in lanes(size):
                y[c, p, e] += x[c, p, e]


@source
def section_stress(pack, u, out):
    """The stresses at u, (3, points, elements)."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = section_work(pack, 0, min(most, elements), u)
    for first in range(0, elements, most):
        work = section_open(pack, first, min(most, elements - first), u, work)
        section_strain(pack, first, work)
        strain_points(pack, work)
        law_stress(pack.law, work.strain, work.stress)
        section_store(work.stress, first, out)


@source
def section_mean(pack, u0, u1, f):
    """Add the force B(middle)^T S whose work from u0 to u1 is the change of the energy."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = section_work(pack, 0, min(most, elements), u0)
    for first in range(0, elements, most):
        work = section_open(pack, first, min(most, elements - first), u0, work)
        U, d, samples = work.U, work.d, work.samples
        nb, size = U.shape[0], U.shape[2]
        half = np.empty((nb, 2, size))
        load(pack.start, pack.span, first, u1, half)
        for k in lanes(nb):
            for i in lanes(2):
                for e in lanes(size):
                    half[k, i, e] = 0.5 * (half[k, i, e] - U[k, i, e])
                    U[k, i, e] += half[k, i, e]
        # the mean of both strains is the strain of the mean, and half the square of the rest
        section_strain(pack, first, work)
        product(pack.table, first, half, d)
        for s in lanes(pack.factors.size):
            g, h, c = pack.rows[0, s], pack.rows[1, s], pack.factors[s]
            for e in lanes(size):
                samples[s, e] += column(c) * (d[g, 0, e] * d[h, 0, e] + d[g, 1, e] * d[h, 1, e])
        strain_points(pack, work)
        if pack.law.kind == LINEAR:
            linear_stress(pack.law.D, work.strain, work.stress)
        else:
            middle = work.strain.copy()
            for g in lanes(d.shape[0]):
                for i in lanes(2):
                    for e in lanes(size):
                        d[g, i, e] *= 2.0
            pair_strains(pack.rows, pack.factors, work.r, d, work.r, samples)
            strain_points(pack, work)
            mean_stress(pack.law, middle, work.strain, work.stress)
        stress_samples(pack, work)
        add_section_force(pack, first, work, f)


@source
def section_energy(pack, u, out):
    """Add the strain energy of each element to out, (elements,)."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = section_work(pack, 0, min(most, elements), u)
    for first in range(0, elements, most):
        work = section_open(pack, first, min(most, elements - first), u, work)
        section_strain(pack, first, work)
        strain_points(pack, work)
        W, total = work.stress[0], out[first:first + work.U.shape[2]]
        law_energy(pack.law, work.strain, W)
        for p in range(W.shape[0]):
            for e in lanes(total.size):
                total[e] += work.weights[p, e] * W[p, e]
        add_held_energy(pack.constant, first, work.U, total)


def beam_gradients(mesh, element, X, tind=None):
    """Derivatives of the local functions along the axis and across the section.

    Parameters
    ----------
    mesh, element
        A MeshBeam and a scalar beam element.
    X
        Reference points, shape (2, npoints).
    tind
        Elements, or None for all.

    Returns
    -------
    G : ndarray
        Shape (2, nelements, npoints, 2 nodal_dofs).
    frame : ndarray
        The beam's frame, transposed to (2, nelements, npoints, 2): e_1 and e_2.
    """
    mapping = mesh.mapping()
    frame = mapping.frame(X, tind)
    grad = np.array([element.gbasis(mapping, X, i, tind)[0].grad
                     for i in range(2 * element.nodal_dofs)])
    G = np.einsum("jkep,ijep->kepi", frame, grad, optimize=True)
    # the positions of both nodes together are a translation: exactly, or round-off resists it
    G[..., element.nodal_dofs] = -G[..., 0]
    return np.ascontiguousarray(G), np.ascontiguousarray(np.moveaxis(frame, 0, -1))


class TermTables:
    """The tables of one :class:`~skfem_ancf.formulations.Term` on a mesh and element.

    Attributes
    ----------
    law, points, w
        The law, the points of integration (2, n) and their weights, (1 or elements, n).
    pack
        :class:`SectionPack`.
    """

    def __init__(self, mesh, element, term, width, constant, owner):
        self.law = term.law
        self.shared = mesh.is_uniform
        tind = np.array([0]) if self.shared else None
        self.points, W = term.quadrature
        self.w = width * W * mesh.mapping().detDF(self.points, tind)
        self.section_points = len(term.section[0])
        G, frame, rows, self._sheared, self._along = _rows(mesh, element, term, tind)
        self.pack = section_pack(G, frame, self.w.T, rows, _interpolation(term),
                                 law_tables(self.law, owner), constant, mesh.t[0])

    def _gradients(self, pack, u):
        work = section_work(pack, 0, pack.start.size, u)
        load(pack.start, pack.span, 0, u, work.U)
        section_strain(pack, 0, work)
        return work.r

    def inverted(self, pack, u):
        """True if the body is turned inside out at a sample: det F is not positive."""
        r = self._gradients(pack, u)
        rx, ry = r[self._sheared[0]], r[self._sheared[1]]
        return not np.all(rx[:, 0] * ry[:, 1] > rx[:, 1] * ry[:, 0])

    def shortest(self, pack, u):
        """Smallest stretch of the fibres along the axis, where eps_xx is sampled."""
        rx = self._gradients(pack, u)[self._along]
        return np.sqrt(np.min(np.sum(rx * rx, axis=1)))


def _rows(mesh, element, term, tind):
    """Table and frame, g and h of each component's samples, and those of shear and of eps_xx."""
    xi_x = np.unique(np.concatenate([term.nodes("xx"), term.nodes("xy")]))
    xi_y = np.unique(np.concatenate([term.nodes("yy"), term.nodes("xy")]))
    eta = term.section_nodes
    tables = []
    for k, xi in enumerate((xi_x, xi_y)):
        X, _ = tensor((xi, np.ones(len(xi))), (eta, np.ones(len(eta))))
        G, frame = beam_gradients(mesh, element, X, tind)
        tables.append((G[k].transpose(1, 2, 0), frame[k].transpose(1, 2, 0)))
    G, frame = (np.concatenate(part) for part in zip(*tables))

    def where(name, xi):
        return (np.searchsorted(xi, term.nodes(name))[:, None] * len(eta)
                + np.arange(len(eta))).ravel()

    n = len(tables[0][0])
    xx, yy = where("xx", xi_x), n + where("yy", xi_y)
    xy = where("xy", xi_x), n + where("xy", xi_y)
    return G, frame, ((xx, xx), (yy, yy), xy), xy, xx


def _interpolation(term):
    """Matrices from the samples of xx, yy and xy along the axis to the points of integration."""
    out = []
    for name in ("xx", "yy", "xy"):
        matrix = (term.interpolation(name, term.axis[0]) if term.section_samples is None else
                  term.matrix(name))
        out.append(packed(np.eye(len(term.axis[0])) if matrix is None else matrix))
    return out


def section_pack(G, frame, weights, rows, along, law, constant, left):
    """The SectionPack of one term.

    Parameters
    ----------
    G, frame, weights
        Tables (rows, nb, 1 or elements), (rows, 2, ...) and (points, ...).
    rows
        g and h of the samples of each of xx, yy, xy.
    along
        Their interpolation along the axis.
    law
        LawTables.
    constant
        Stabilisation (2 nb, 2 nb, 0, 1 or elements).
    left
        The left node of each element.
    """
    nb, ne = G.shape[1], len(left)
    (g, h), normal = (np.concatenate(part) for part in zip(*rows)), sum(len(x) for x, _ in rows[:2])
    rows = np.array([g, h])
    factors = np.where(g == h, 0.5, 1.0)
    terms, mixing = _terms(rows, factors, along, weights.shape[0],
                           law.D if law.kind == LINEAR else np.ones((3, 3)))
    moduli = np.zeros((terms.shape[1], 1))
    if law.kind == LINEAR:
        D = np.kron(law.D.reshape(9, 1), weights)
        moduli = mixing @ D
        keep = np.any(np.abs(moduli) > 1e-14 * (abs(mixing) @ np.abs(D)), axis=1)  # else orthogonal
        terms, moduli, mixing = terms[:, keep], moduli[keep], mixing[:0]
    pairs, of = np.unique(np.concatenate([terms[:2], rows], axis=1), axis=1, return_inverse=True)
    of = of.ravel()
    tables = pair_tables(G, pairs, constant)
    own = of[:terms.shape[1]]
    order, rounds = in_rounds(own)
    terms = np.stack([own, tables.pairs[2, own], terms[2], terms[3]])[:, order]
    if law.kind == LINEAR:
        moduli = moduli[order]
    else:
        mixing = mixing[order]
    mixing = mixing.tocoo()
    in_order, mixing_rounds = in_rounds(mixing.row)
    summands = np.array([mixing.row, *np.divmod(mixing.col, weights.shape[0])])[:, in_order]
    shared = G.shape[2] == 1
    return SectionPack(
        packed(G), packed(G.transpose(1, 0, 2)[:, :, :1 if shared else 0]), packed(frame),
        packed(weights), packed(np.zeros(ne) if shared else np.arange(ne), np.int64),
        packed([*rows, of[terms.shape[1]:]], np.int64), factors, int(normal), *along, law,
        packed(constant), packed(left * nb, np.int64), packed(np.arange(2 * nb), np.int64), tables,
        packed(terms, np.int64), rounds, packed(moduli), packed(summands, np.int64),
        packed(mixing.data[in_order]), mixing_rounds)


def _terms(rows, factors, along, points, D):
    """Terms ``M[g, h] += modulus r_k r_l`` and how their moduli come from those at the points.

    Returns
    -------
    terms : ndarray
        g, h, k, l, with g <= h, each once, shape (4, n).
    mixing : sparse matrix
        Moduli of the terms from ``w D`` at the points, shape (n, 9 points): (c, d) of D first.
    """
    ns = points // len(along[0])
    j, start, found = np.arange(ns), np.cumsum([0] + [L.shape[1] * ns for L in along]), []
    for c, d in np.argwhere(D):
        both = along[c][:, :, None] * along[d][:, None, :]  # interpolated to the same point
        i, k, m = (x[:, None] * ns + j for x in np.nonzero(both))
        found.append((start[c] + k, start[d] + m, (3 * c + d) * points + i,
                      np.repeat(both[both != 0.0], ns)))
    s, t, column_of, value = (np.concatenate([x.ravel() for x in part]) for part in zip(*found))
    value = value * factors[s] * factors[t]
    # derivative of a sample: G_h with r_g and G_g with r_h
    terms = np.stack(np.broadcast_arrays(rows[:, None, s], rows[None, :, t], rows[::-1, None, s],
                                         rows[None, ::-1, t])).reshape(4, -1)
    value, column_of = np.tile(value, 4), np.tile(column_of, 4)
    keep = terms[0] <= terms[1]  # the others are the same transposed
    terms, value, column_of = terms[:, keep], value[keep], column_of[keep]
    same = terms[0] == terms[1]
    terms[2:, same] = np.sort(terms[2:, same], axis=0)
    terms, of = np.unique(terms, axis=1, return_inverse=True)
    mixing = sparse.csr_matrix((value, (of.ravel(), column_of)),
                               shape=(terms.shape[1], 9 * points))
    return terms, mixing


class Kernel(Chain):
    """Energy, force and tangent of the strain energy of one beam.

    Parameters
    ----------
    mesh, element, material
        The body, a scalar beam element and a material.
    width
        Width of the section.
    formulation
        A :class:`~skfem_ancf.formulations.Formulation`.
    """

    texts = Texts(3, section_force, section_tangent, section_carry, section_stress, section_mean,
                  section_energy)

    def __init__(self, mesh, element, material, width, formulation):
        super().__init__(mesh, element)
        self.constant = formulation.stabilisation(mesh, element, material, width)
        none = np.zeros((0, 2 * self.nd, 2 * self.nd))
        constants = [none if self.constant is None else self.constant]
        self.tables = []
        for term in formulation.terms(element, material):
            constant = constants.pop() if constants else none
            self.tables.append(TermTables(mesh, element, term, width, constant.transpose(1, 2, 0),
                                          self))
        self.packs = [t.pack for t in self.tables]

    @property
    def shared(self):
        """One table serves all elements."""
        return self.tables[0].shared

    @property
    def points_number(self):
        """Integration points of an element."""
        return sum(t.w.shape[1] for t in self.tables)

    @property
    def section_points(self):
        """Integration points across the section, of the first term."""
        return self.tables[0].section_points

    @property
    def volume(self):
        """Volume of the body, by the rule of the first term."""
        t = self.tables[0]
        return float(np.sum(t.w)) * (self.t.shape[1] if t.shared else 1)

    def inverted(self, u):
        first = self.tables[0]
        return any(first.inverted(apart(first.pack, part), self.gather(u, part).ravel())
                   for part in self.chunks())

    def shortest(self, u):
        """Smallest stretch of the fibres along the axis, where eps_xx is sampled."""
        first = self.tables[0]
        return min(first.shortest(apart(first.pack, part), self.gather(u, part).ravel())
                   for part in self.chunks())

    def strain_increment(self, pack, u, du, out):
        """The strain's derivative in the direction du, (3, points, elements)."""
        unit = pack.law._replace(kind=LINEAR, D=np.eye(3))
        section_carry(pack._replace(law=unit), u, du, np.zeros_like(out), out)

    def weighted_moduli(self, pack, u):
        """w D at the points of integration, shape (3, 3, points, elements)."""
        n, ne = pack.weights.shape[0], pack.start.size
        if pack.law.kind == LINEAR:
            return np.broadcast_to(pack.law.D[:, :, None, None] * pack.weights, (3, 3, n, ne))
        strain, D = np.empty((3, n, ne)), np.empty((3, 3, n, ne))
        unit = pack.law._replace(kind=LINEAR, D=np.eye(3))
        section_stress(pack._replace(law=unit), u, strain)
        law_moduli(pack.law, strain, D)
        return D * pack.weights

    def without_material(self, pack):
        """The pack of a law without stiffness, for given stresses."""
        return pack._replace(terms=packed(pack.terms[:, :0], np.int64),
                             rounds=np.zeros(1, np.int64), moduli=np.zeros((0, pack.start.size)),
                             law=pack.law._replace(kind=LINEAR), pairs=pack.pairs._replace(
                                 held=pack.pairs.held[:, :, :0],
                                 held_skew=pack.pairs.held_skew[:, :, :0]))
