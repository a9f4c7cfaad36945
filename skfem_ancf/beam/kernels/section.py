"""Beams with sections: one term of the strain energy.

Rows of the table are those of d/dX, then of d/dY. A strain sample is ``c (r_g . G_h u + G_g u .
e_h)`` of two rows; g = h and c = 1/2 for a normal strain. Samples are interpolated to the points of
integration, and forces go back the same way. With moduli between samples, which have the
interpolation and the weights in them, the tangent is a sum over pairs of rows.
"""

from dataclasses import replace
from functools import lru_cache
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy import sparse

from ...core.caching import ArrayKey
from ...materials import LinearLaw
from ...core.quadrature import product_rule
from ...core.source import F1, F2, F3, I1, I2, column, lanes, primitive, room, shaped, source
from ...core.types import Array
from .base import (CARRY, GIVEN, GRADIENTS, MEAN, STRESS, TANGENT, TURNED, VISCOUS, Chain,
                   PairTables, Texts, add_both_halves, add_by_rows, add_force, add_held_energy,
                   add_scaled, add_tangent, apart, block, copy_stress, in_rounds, load, packed,
                   pair_numbers, pair_tables, product, scaled_pair_tables, weigh)
from .law import LINEAR, LawTables, conserve, law_evaluate, law_tables

if TYPE_CHECKING:

    from ...elements.base import ElementBeam
    from ...formulations.base import Formulation, Term
    from ...mesh.mesh_beam import MeshBeam
    from ...sections import Across, Layer


class SectionPack(NamedTuple):
    """The tables of a term; :func:`section_pack` makes it.

    Attributes
    ----------
    table, transposed, frame
        Derivatives of the local functions (1 or elements, rows, nb), those that elements share as
        (1, nb, rows) too, else (0, ...), and rows of the frame e_1, e_2, (rows, 2, 1 or elements).
    weights, place
        Of the points of integration, (points, 1 or elements), and which are an element's.
    rows, factors, normal
        g, h and the number of their pair for each sample, (3, samples), c, and the number of
        samples of normal strains, which come first.
    along, ends
        Interpolation along the axis of xx, yy and xy, (3, points, samples), the shorter with
        zeros; and their first samples, the last one behind them, (4,).
    law
        :class:`~skfem_ancf.beam.kernels.law.LawTables`.
    constant
        Stabilisation (0, 1 or elements, 2 nb, 2 nb).
    start, span
        First coordinate of each element, and 0 to 2 nb - 1.
    pairs
        :class:`~skfem_ancf.beam.kernels.base.PairTables`.
    terms, rounds
        The pair, its number in the skew part, and the rows k and l of ``M[pair] += modulus r_k
        r_l``, (4, n), sorted so that between two ``rounds`` no pair comes twice.
    moduli
        Of a linear law, (n, 1 or elements).
    mixing, parts, mixing_rounds
        Of other laws: the term, the modulus (c, d) as 3 c + d and the point of each summand of a
        modulus, (3, m), and its factor, (m,).
    grows
        1 if what is given are strains, added to the one there is, and the stress is what that
        changes; see :meth:`Kernel.pushed_packs`.
    address
        That of the compiled :func:`section_block`; 0 for the plain one.
    """

    table: F3
    transposed: F3
    frame: F3
    weights: F2
    place: I1
    rows: I2
    factors: F1
    normal: int
    along: F3
    ends: I1
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
    grows: int = 0
    address: int = 0


@source
def set_tables(frame, weights, at, x, w):
    """Frame and weights of the elements of a block."""
    for g in lanes(x.shape[0]):
        for i in lanes(2):
            for e in lanes(at.size):
                x[g, i, e] = frame[g, i, at[e]]
    for p in lanes(w.shape[0]):
        for e in lanes(at.size):
            w[p, e] = weights[p, at[e]]


@source
def pair_strains(rows, factors, r, d, x, samples):
    """c (r_g . d_h + d_g . x_h): the strain if x is the frame, its derivative if x is r."""
    for s in lanes(factors.size):
        g, h, c = rows[0, s], rows[1, s], factors[s]
        for e in lanes(d.shape[2]):
            samples[s, e] = column(c) * (r[g, 0, e] * d[h, 0, e] + r[g, 1, e] * d[h, 1, e]
                                         + d[g, 0, e] * x[h, 0, e] + d[g, 1, e] * x[h, 1, e])


@source
def _of_component(ends, c, samples, n):
    """The samples of a component, those along the axis first, a view."""
    part = samples[ends[c]:ends[c + 1]]
    return shaped(part, (part.size // n, n))


@source
def to_points(along, ends, samples, points):
    """Samples of the strain, interpolated to the points of integration."""
    n = points[0].size // along.shape[1]
    for c in range(3):
        x, y = shaped(points[c], (along.shape[1], n)), _of_component(ends, c, samples, n)
        for i in range(len(x)):
            for e in lanes(n):
                x[i, e] = 0.0
            for k in range(len(y)):
                if along[c, i, k] != 0.0:
                    for e in lanes(n):
                        x[i, e] += along[c, i, k] * y[k, e]


@source
def to_samples(along, ends, w, points, samples):
    """The transpose of to_points, with the weights of the points."""
    n = w.size // along.shape[1]
    weights = shaped(w, (along.shape[1], n))
    for c in range(3):
        x, y = shaped(points[c], (along.shape[1], n)), _of_component(ends, c, samples, n)
        for k in range(len(y)):
            for e in lanes(n):
                y[k, e] = 0.0
            for i in range(len(x)):
                if along[c, i, k] != 0.0:
                    for e in lanes(n):
                        y[k, e] += along[c, i, k] * weights[i, e] * x[i, e]


@source
def row_forces(rows, normal, r, samples, T):
    """What the stress samples do on the gradients."""
    T[:] = 0.0
    for s in lanes(normal):
        g = rows[0, s]
        for i in range(2):
            for e in lanes(r.shape[2]):
                T[g, i, e] += samples[s, e] * r[g, i, e]
    for s in lanes(normal, rows.shape[1]):
        g, h = rows[0, s], rows[1, s]
        for i in range(2):
            for e in lanes(r.shape[2]):
                T[g, i, e] += samples[s, e] * r[h, i, e]
            for e in lanes(r.shape[2]):
                T[h, i, e] += samples[s, e] * r[g, i, e]


@source
def tangent_stress(D, strain, S):
    """S = D eps with the moduli of each point."""
    for c in range(3):
        for p in lanes(S.shape[1]):
            for e in lanes(S.shape[2]):
                S[c, p, e] = (D[3 * c, p, e] * strain[0, p, e]
                              + D[3 * c + 1, p, e] * strain[1, p, e]
                              + D[3 * c + 2, p, e] * strain[2, p, e])


@source
def term_moduli(pack, at, D, w, moduli):
    """The modulus of each term, (terms, elements), of other than linear laws from D at points."""
    if pack.law.kind == LINEAR:
        for t in lanes(moduli.shape[0]):
            for e in lanes(at.size):
                moduli[t, e] = pack.moduli[t, at[e]]
        return
    for c in lanes(9):
        for p in lanes(len(w)):
            for e in lanes(w.shape[1]):
                D[c, p, e] *= w[p, e]
    moduli[:] = 0.0
    for k in range(pack.mixing_rounds.size - 1):
        for m in lanes(pack.mixing_rounds[k], pack.mixing_rounds[k + 1]):
            t, c, p = pack.mixing[0, m], pack.mixing[1, m], pack.mixing[2, m]
            x = pack.parts[m]
            for e in lanes(w.shape[1]):
                moduli[t, e] += column(x) * D[c, p, e]


@source
def pair_factors(rows, samples, terms, rounds, moduli, r, M, M_skew):
    """Factors of the pairs: xx, yy, xy symmetric, and xy skew, of the stress and the moduli."""
    for s in lanes(samples.shape[0]):
        p = rows[2, s]
        for e in lanes(samples.shape[1]):
            M[p, 0, e] += samples[s, e]
            M[p, 1, e] += samples[s, e]
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
def turned_factors(terms, rounds, moduli, r, d, M, M_skew):
    """As :func:`pair_factors`, of the moduli: what changes d of the rows change; xx, xy, yx, yy."""
    for k in range(rounds.size - 1):
        for t in lanes(rounds[k], rounds[k + 1]):
            p, q, g, h = terms[0, t], terms[1, t], terms[2, t], terms[3, t]
            for i in range(2):
                for j in range(2):
                    for e in lanes(r.shape[2]):
                        c = 0.5 * moduli[t, e]
                        x, y = c * r[g, i, e] * d[h, j, e], c * r[h, i, e] * d[g, j, e]
                        M[p, 2 * i + j, e] += x + y
                        M_skew[q, 2 * i + j, e] += x - y


@source
def section_gradients(pack, first, r, points):
    """Derivatives of the strains at the points, shape (3, points, elements 2 nb)."""
    rows, size, nb = pack.rows, r.shape[2], pack.table.shape[2]
    X, samples = room((2, rows.shape[1], 2, size), r), room((rows.shape[1], size, nb, 2), r)
    for s in lanes(rows.shape[1]):
        g, h, c = rows[0, s], rows[1, s], pack.factors[s]
        for i in range(2):
            for e in lanes(size):
                X[0, s, i, e], X[1, s, i, e] = column(c) * r[h, i, e], column(c) * r[g, i, e]
    samples[:] = 0.0
    add_by_rows(pack.table, first, rows[0], X[0], samples)
    add_by_rows(pack.table, first, rows[1], X[1], samples)
    to_points(pack.along, pack.ends, shaped(samples, (rows.shape[1], 2 * nb * size)), points)


@source
def section_evaluate(pack, what, u, v, f, given, out, to):
    """Everything that depends on the strains, block by block.

    Parameters
    ----------
    pack
        SectionPack.
    what
        ``FORCE``, ``TANGENT``, ``MEAN``, ``STRESS``, ``CARRY``, ``VISCOUS``: the force of
        stresses that a linear law has of the rate of the strain, ``GIVEN``: that of given
        stresses alone, without stabilisation, ``GRADIENTS``, with a destination the tangent too, or
        ``TURNED``: see :func:`~skfem_ancf.beam.strain_energy.add_turned`.
    u, v
        Displacement, and at the end for the mean, its change for carried stresses, its rate for
        viscous ones, shape (N,).
    f
        Force, added to.
    given
        Stresses (3, points, elements): those before, or carried ones for the tangent, or those
        of which the force is in place of the strain's, or of no component (0, ...).
    out
        Stresses, written.
    to
        The :class:`~skfem_ancf.beam.kernels.base.Destination` of the tangent, added to.
    """
    most = block(pack.pairs.pairs.shape[1])
    for first in range(0, pack.start.size, most):
        last = min(first + most, pack.start.size)
        run_section(pack, what, first, last, u, v, f, given, out, to)


@primitive("blocks")
def run_section(pack, what, first, last, u, v, f, given, out, to):
    """As :func:`section_block`; compiled once, and not anew in each text that calls it."""
    section_block(pack, what, first, last, u, v, f, given, out, to)


@source
def section_block(pack, what, first, last, u, v, f, given, out, to):
    """As :func:`section_evaluate`, for the elements from ``first`` to ``last``."""
    table, rows, law = pack.table, pack.rows, pack.law
    whole, given, out = out, given[:, :, first:last], out[:, :, first:last]
    n, nr, nb, size = len(pack.weights), table.shape[1], table.shape[2], out.shape[2]
    to_end, grows = what == MEAN or what == TURNED, pack.grows
    changes = to_end or what == CARRY or what == VISCOUS
    shift = 0.5 if what == MEAN else 0.0
    at = pack.place[first:first + size]
    U, vectors = room((2, nb, 2, size), u), room((4, nr, 2, size), u)
    x, r, d, T = vectors[0], vectors[1], vectors[2], vectors[3]
    strains, w = room((3 + grows, 3, n, size), u), room((n, size), pack.weights)
    strain, change, S = strains[0], strains[1], strains[2]
    samples = room((rows.shape[1], size), u)
    set_tables(pack.frame, pack.weights, at, x, w)
    for part in range(1 + changes):  # the strain is quadratic: its change is a derivative
        load(pack.start, pack.span, first, v if part else u, U[part])
        if part and to_end:
            add_scaled(-1.0, U[0], U[1], U[1])
        product(table, first, U[part], d)
        add_scaled(shift if part else 1.0, d, r if part else x, r)
        pair_strains(rows, pack.factors, r, d, r if part else x, samples)
        to_points(pack.along, pack.ends, samples, strains[part])
    if what == MEAN:
        add_scaled(0.5, change, strain, strain)
        add_scaled(0.5, U[1], U[0], U[0])
    both = room((1 + grows, 9, n, size if what == CARRY or what == GRADIENTS
                 or (what == TANGENT or what == TURNED) and law.kind else 0), w)
    D = both[0]
    none = what == CARRY or what == GRADIENTS or what == TURNED or what == GIVEN and grows == 0
    for part in range(1 + grows):
        if part > 0:
            add_scaled(1.0, given, strain, strain)
        for k in range(1 if none else 0, 2 if D.size > 0 else 1):
            law_evaluate(law, change if what == VISCOUS else strain,
                         both[part] if k else strains[2 + part])
        if what == TURNED:
            _add_turned(pack, first, at, D, w, r, d, to)
            return
        if what == GRADIENTS:
            X = room((3, n, 2 * nb * size), r)
            section_gradients(pack, first, r, X)
            B = shaped(whole, (2, pack.start.size, 3, n, 2 * nb))[:, first:last]
            weigh(D, w, shaped(X, (3, n, size, 2 * nb)), B[0], B[1])
            if to.flat.size > 0:
                copy_stress(given, S)
                to_samples(pack.along, pack.ends, w, S, samples)
                _add_tangent(pack, first, at, samples, D, w, r, to)
            return
        if what == CARRY:
            tangent_stress(D, change, S)
            add_scaled(1.0, given, S, S)
        elif what == MEAN and law.kind != LINEAR:
            conserve(law, strain, change, strains[2 + part])
    if grows > 0:
        given = given[:0]
        add_scaled(-1.0, S, strains[3], S)
        add_scaled(-1.0, D, both[1], D)
    if out.shape[0] > 0:
        copy_stress(S, out)
    if what == STRESS or what == CARRY:
        return
    if given.shape[0] > 0 and what != TANGENT:
        copy_stress(given, S)
    to_samples(pack.along, pack.ends, w, S, samples)
    row_forces(rows, pack.normal, r, samples, T)
    held = pack.constant[:0] if what == GIVEN else pack.constant
    add_force(table, pack.transposed, held, pack.start, pack.span, first, T, U[0], f)
    if what == TANGENT:
        if given.shape[0] > 0:
            copy_stress(given, S)
            to_samples(pack.along, pack.ends, w, S, samples)
        _add_tangent(pack, first, at, samples, D, w, r, to)


@source
def _add_tangent(pack, first, at, samples, D, w, r, to):
    """The tangent of stresses at the samples and of moduli at the points."""
    pairs, size = pack.pairs, r.shape[2]
    M, M_skew = room((pairs.pairs.shape[1], 3, size), r), room((pairs.skew.shape[2], 1, size), r)
    moduli = room((pack.terms.shape[1], size), r)
    M[:], M_skew[:] = 0.0, 0.0
    term_moduli(pack, at, D, w, moduli)
    pair_factors(pack.rows, samples, pack.terms, pack.rounds, moduli, r, M, M_skew)
    add_tangent(pack.table, pairs, pack.start, first, M, M_skew, to)


@source
def _add_turned(pack, first, at, D, w, r, d, to):
    """What changes d of the rows change of the derivative of stresses of the strains."""
    pairs, size = pack.pairs, r.shape[2]
    M, M_skew = room((pairs.pairs.shape[1], 4, size), r), room((pairs.skew.shape[2], 4, size), r)
    moduli = room((pack.terms.shape[1], size), r)
    M[:], M_skew[:] = 0.0, 0.0
    term_moduli(pack, at, D, w, moduli)
    turned_factors(pack.terms, pack.rounds, moduli, r, d, M, M_skew)
    add_both_halves(pack.table, pairs, pack.start, first, M, M_skew, to)


def with_unit_law(pack: SectionPack) -> SectionPack:
    """The pack with a law whose stress is the strain.

    Parameters
    ----------
    pack
        Of any law.
    """
    return pack._replace(law=pack.law._replace(kind=LINEAR, D=np.eye(3)))


def section_energy(pack: SectionPack, u: Array, out: Array) -> None:
    """Add the strain energy of each element to out, (elements,).

    Parameters
    ----------
    pack
        The tables.
    u, out
        Displacement, shape (N,), and energies that are added to, shape (elements,).
    """
    strain = np.empty((3, len(pack.weights), out.size), u.dtype)
    W = np.empty((1,) + strain.shape[1:], u.dtype)
    SECTIONS.stress(with_unit_law(pack), u, strain)
    law_evaluate(pack.law, strain, W)
    out += np.sum(pack.weights[:, pack.place] * W[0], axis=0)
    add_held_energy(pack, u, out)


SECTIONS = Texts(3, section_evaluate, section_energy)


def beam_gradients(mesh: "MeshBeam", element: "ElementBeam", X: Array,
                   tind: Array | None = None) -> tuple[Array, Array]:
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
    slopes, frame = element.slopes(mesh.mapping(), X, tind)
    G = np.ascontiguousarray(slopes.transpose(1, 2, 3, 0))
    # the positions of both nodes together are a translation: exactly, or round-off resists it
    G[..., element.nodal_dofs] = -G[..., 0]
    return G, frame.transpose(1, 2, 3, 0)


class TermTables:
    """The tables of one :class:`~skfem_ancf.formulations.Term` on a mesh and element.

    Parameters
    ----------
    across, layer, term
        The section on its mesh, one of its layers, and a term of it.
    constant
        Stabilisation of each element, shape (0, 1 or elements, 2 nb, 2 nb).
    owner
        What is kept alive as long as a law of one's own is asked.
    rows, asked
        Tables and weights of other terms there, by their places, and points with what
        :func:`beam_gradients` returned for them; both are added to.

    Attributes
    ----------
    term, law, points, w
        The term, its law, the points of integration (2, n) and their weights, (1 or elements, n).
    pack
        :class:`SectionPack`.
    """

    points: Array
    w: Array

    def __init__(self, across: "Across", layer: "Layer", term: "Term", constant: Array,
                 owner: Any, rows: dict[Any, Any] | None = None,
                 asked: "list[tuple[Array, ...]] | None" = None) -> None:
        self.law, self.term, self.layer, mesh = term.law, term, layer, across.mesh
        self.shared = across.uniform
        tind = np.array([0]) if self.shared else None
        self.section_points = len(term.section[0])
        whole = self.section_points == 1
        self.points, W = term.quadrature
        rows = {} if rows is None else rows
        at = id(layer), ArrayKey(self.points, W)
        if at not in rows:
            rows[at] = across.volume(layer, self.points, W, tind, whole)
        self.w = rows[at]
        if term._places not in rows:
            rows[term._places] = _rows(mesh, across.element, term._places, tind,
                                      [] if asked is None else asked)
        G, frame, self._samples, scaled = rows[term._places]
        weights = self.w if layer.grade is None else across.volume(
            layer, *term.quadrature, tind, whole, "grade")
        law = law_tables(self.law, owner)
        sums = _sums_of(self._samples, law, _interpolation(term), weights.shape[1])
        self.pack: SectionPack = section_pack(
            G, frame, weights.T, self._samples, sums, law, constant, mesh.t[0], scaled)

    def _gradients(self, pack, u, rows):
        """Some rows of the deformation gradient, shape (rows, 2, elements)."""
        U = np.empty((pack.table.shape[2], 2, pack.start.size))
        r = np.empty((len(rows),) + U.shape[1:])
        load(pack.start, pack.span, 0, u, U)
        product(pack.table.take(rows, axis=1), 0, U, r)
        r += pack.frame.take(rows, axis=0)
        return r

    def inverted(self, pack: SectionPack, u: Array) -> bool:
        """True if the body is turned inside out at a sample: det F is not positive.

        Parameters
        ----------
        pack
            The tables.
        u
            Displacement, shape (N,).
        """
        return not self.upright(pack, u).all()

    def upright(self, pack: SectionPack, u: Array) -> Any:
        """Where det F is positive, of each sample of the shear and each element.

        Parameters
        ----------
        pack, u
            The tables, and the displacement, shape (N,).
        """
        sheared = self._samples.sheared
        n, r = len(sheared) // 2, self._gradients(pack, u, sheared)
        rx, ry = r[:n], r[n:]
        return rx[:, 0] * ry[:, 1] > rx[:, 1] * ry[:, 0]

    def shortest(self, pack: SectionPack, u: Array) -> Any:
        """Smallest stretch of the fibres along the axis, where eps_xx is sampled.

        Parameters
        ----------
        pack
            The tables.
        u
            Displacement, shape (N,).
        """
        rx = self._gradients(pack, u, self._samples.along)
        return np.sqrt(np.min(np.sum(rx * rx, axis=1)))


def _rows(mesh, element, at, tind, asked):
    """Table and frame, and the :class:`_Samples` that are of their rows.

    Of one table for all elements also that of an element of length and height 1, and what
    multiplies its rows and columns.
    """
    samples = _samples(at)
    if mesh.is_straight and mesh.heights is None and element.by_reference:
        G, frame, scaled = _scaled(
            mesh, element, element.unit_slopes(*(samples.X.take(k, axis=1) for k in samples.where)),
            len(samples.where[0]), slice(None) if tind is None else tind)
        return G, frame, samples, scaled if len(G) == 1 else None
    for X, G, frame in asked:
        among = _among(ArrayKey(X, samples.X))
        if among is not None:
            G, frame = G.take(among, axis=2), frame.take(among, axis=2)
            break
    else:
        G, frame = beam_gradients(mesh, element, samples.X, tind)
        asked.append((samples.X, G, frame))
    return (np.concatenate([x.take(k, axis=1) for x, k in zip(G, samples.where)], axis=1),
            np.concatenate([x.transpose(1, 2, 0)[k] for x, k in zip(frame, samples.where)]),
            samples, None)


def _scaled(mesh, element, unit, n, tind):
    """Tables of straight elements: that of length and height 1, n rows along, times powers."""
    h, L, t = mesh.height, mesh.lengths[tind][:, None], mesh.t[:, tind]
    columns = element.powers(h, L)
    rows, frame = np.empty((len(L), len(unit))), np.empty((len(unit), 2, len(L)))
    rows[:, :n], rows[:, n:] = 1.0 / L, 1.0 / h
    x, y = (mesh.p[:, t[1]] - mesh.p[:, t[0]]) / L.T
    frame[:n, 0], frame[:n, 1], frame[n:, 0], frame[n:, 1] = x, y, -y, x
    return unit * (rows[:, :, None] * columns[:, None]), frame, (unit, rows[0], columns[0])


class _Samples(NamedTuple):
    """Where the strains of a term are sampled.

    Attributes
    ----------
    X, where
        Points (2, n), and which of them are those of the rows along the axis, and across it.
    rows, factors, normal
        As in :class:`SectionPack`, of two rows ``rows`` (2, samples).
    along, sheared
        The rows of eps_xx, and those of eps_xy, first all along, then all across.
    """

    X: Array
    where: list[Array]
    rows: Array
    factors: Array
    normal: int
    along: Array
    sheared: Array


@lru_cache(64)
def _samples(content):
    """The _Samples of places along the axis of xx, yy and xy, and of places across."""
    at_xx, at_yy, at_xy, eta = content.arrays
    along, across = (np.union1d(at, at_xy) for at in (at_xx, at_yy))
    places, n, m = np.union1d(along, across), len(along) * len(eta), len(eta)

    def rows(at, xi):
        return (np.searchsorted(xi, at)[:, None] * m + np.arange(m)).ravel()

    xx, yy, x, y = (rows(at_xx, along), n + rows(at_yy, across), rows(at_xy, along),
                    n + rows(at_xy, across))
    g, h = np.concatenate([xx, yy, x]), np.concatenate([xx, yy, y])
    return _Samples(product_rule((places, places), (eta, eta))[0],
                    [rows(along, places), rows(across, places)], np.array([g, h]),
                    np.where(g == h, 0.5, 1.0), len(xx) + len(yy), xx, np.concatenate([x, y]))


@lru_cache(64)
def _among(content):
    """Which of points (2, n) others (2, m) are, shape (m,); None if one is none of them."""
    points, others = content.arrays
    same = (points[:, :, None] == others[:, None]).all(axis=0)
    return same.argmax(axis=0) if same.any(axis=0).all() else None


def _interpolation(term):
    """Matrices from the samples of xx, yy and xy along the axis to the points of integration."""
    out = []
    for name in ("xx", "yy", "xy"):
        matrix = (term.interpolation(name, term.axis[0]) if term.section_samples is None else
                  term.matrix(name))
        out.append(packed(np.eye(len(term.axis[0])) if matrix is None else matrix))
    return out


def section_pack(G: Array, frame: Array, weights: Array, samples: _Samples, sums: Any,
                 law: LawTables, constant: Array, left: Array,
                 scaled: Any = None) -> SectionPack:
    """The SectionPack of one term.

    Parameters
    ----------
    G, frame, weights
        Tables (1 or elements, rows, nb), (rows, 2, 1 or elements) and (points, 1 or elements).
    samples, sums
        Where it is sampled, and what :func:`_sums_of` returns.
    law
        LawTables.
    constant
        Stabilisation (0, 1 or elements, 2 nb, 2 nb).
    left
        The left node of each element.
    scaled
        A table (rows, nb) whose rows and columns two vectors multiply to make G; or None.
    """
    nb, ne, linear = G.shape[2], len(left), law.kind == LINEAR
    content, (mixing, several, sizes), joined, ends = sums
    keep, moduli = np.ones(mixing.shape[0], bool), np.zeros((mixing.shape[0], 1))
    if linear:
        D = (law.D.reshape(9, 1, 1) * weights).reshape(-1, weights.shape[1])
        moduli = mixing @ D
        if not weights.all():
            keep = moduli.any(axis=1)
        if len(several):  # else orthogonal
            least = 1e-14 * (sizes @ np.abs(D))
            keep[several] = (np.abs(moduli.take(several, axis=0)) > least).any(axis=1)
    layout, shared = _layout(content, len(weights), ArrayKey(keep), linear), len(G) == 1
    if linear:
        moduli = moduli.take(layout.order, axis=0)
    if scaled is not None:
        unit, of_rows, of_columns = scaled
        pairs = scaled_pair_tables(unit, of_rows, of_columns, layout.pairs, constant, ne)
    else:
        pairs = pair_tables(G, layout.pairs, constant, ne)
    return SectionPack(
        packed(G), packed(G.transpose(0, 2, 1)[:int(shared)]), packed(frame),
        packed(weights), np.zeros(ne, np.int64) if shared else np.arange(ne, dtype=np.int64),
        layout.rows, samples.factors, samples.normal, joined, ends, law,
        packed(constant), left.astype(np.int64) * nb, np.arange(2 * nb, dtype=np.int64),
        pairs, layout.terms, layout.rounds, packed(moduli), layout.mixing, layout.parts,
        layout.mixing_rounds)


def _sums_of(samples, law, along, points):
    """What of a term depends on samples, interpolations and which strains its law couples only.

    A key, how moduli come from those at the points, and what :func:`_joined` returns.
    """
    coupled = law.D != 0.0 if law.kind == LINEAR else np.ones((3, 3), bool)
    content = ArrayKey(samples.rows, coupled, *along)
    return content, _terms(content, points)[1:], *_joined(content, points // len(along[0]))


def linearised(pack: SectionPack) -> SectionPack:
    """The pack with a law of constant moduli, those that its own has without strain.

    Parameters
    ----------
    pack
        Of any law.
    """
    if pack.law.kind == LINEAR:
        return pack
    t, c, p = pack.mixing
    moduli = np.zeros((pack.terms.shape[1], pack.weights.shape[1]))
    np.add.at(moduli, t, (pack.parts * pack.law.D.reshape(9)[c])[:, None] * pack.weights[p])
    return pack._replace(law=pack.law._replace(kind=LINEAR), moduli=packed(moduli))


@lru_cache(64)
def _joined(content, ns):
    """The matrices as one array, and the first of the samples of each, which come ns at a time."""
    _, _, *along = content.arrays
    sizes = [L.shape[1] for L in along]
    out = np.zeros((3, len(along[0]), max(sizes)))
    for x, L in zip(out, along):
        x[:, :L.shape[1]] = L
    return out, np.array([0, *accumulate(sizes)], np.int64) * ns


class _Layout(NamedTuple):
    """The fields of a :class:`SectionPack` that depend on rows and interpolations only.

    ``pairs`` (2, p) are those of rows; ``order`` says which of all terms those of the pack are.
    """

    pairs: Array
    order: Array
    rows: I2
    terms: I2
    rounds: I1
    mixing: I2
    parts: F1
    mixing_rounds: I1


@lru_cache(64)
def _layout(content, points, kept, linear):
    """The _Layout of the terms of :func:`_terms` that are kept; of a linear law without mixing."""
    rows, (keep,) = content.arrays[0], kept.arrays
    terms, mixing, *_ = _terms(content, points)
    terms = terms[:, keep]
    pairs, of = np.unique(np.concatenate([terms[:2], rows], axis=1), axis=1, return_inverse=True)
    of, number = of.ravel(), pair_numbers(pairs)
    own = of[:terms.shape[1]]
    order, rounds = in_rounds(own)
    terms = np.stack([own, number[own], terms[2], terms[3]])[:, order]
    mixing = (mixing[:0] if linear else mixing[order]).tocoo()
    in_order, mixing_rounds = in_rounds(mixing.row)
    summands = np.array([mixing.row, *np.divmod(mixing.col, points)])[:, in_order]
    return _Layout(pairs, np.flatnonzero(keep)[order],
                   packed([*rows, of[len(own):]], np.int64), packed(terms, np.int64), rounds,
                   packed(summands, np.int64), packed(mixing.data[in_order]), mixing_rounds)


@lru_cache(64)
def _terms(content, points):
    """Terms ``M[g, h] += modulus r_k r_l`` and how their moduli come from those at the points.

    Parameters
    ----------
    content
        Rows g and h of the samples, which strains the law couples, and the interpolations.
    points
        Number of points of integration.

    Returns
    -------
    terms : ndarray
        g, h, k, l, with g <= h, each once, shape (4, n).
    mixing : sparse matrix
        Moduli of the terms from ``w D`` at the points, shape (n, 9 points): (c, d) of D first.
    several : ndarray
        Numbers of the terms that do not come from one of these, so that they may cancel, (k,).
    sizes : sparse matrix
        The absolute values of their rows, shape (k, 9 points).
    """
    rows, coupled, *along = content.arrays
    factors, ns = np.where(rows[0] == rows[1], 0.5, 1.0), points // len(along[0])
    j, start, found = np.arange(ns), np.cumsum([0] + [L.shape[1] * ns for L in along]), []
    for c, d in np.argwhere(coupled):
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
    exact = mixing.copy()
    exact.eliminate_zeros()
    several = np.flatnonzero(np.diff(exact.indptr) != 1)
    return terms, mixing, several, abs(mixing)[several]


def _viscous(pack, time, none):
    """The pack of a linear law with its moduli times a number, without stabilisation."""
    return pack._replace(law=pack.law._replace(D=packed(time * pack.law.D)),
                         moduli=packed(time * pack.moduli), constant=packed(none),
                         pairs=pack.pairs._replace(held=packed(pack.pairs.held[:, :0])))


class Kernel(Chain):
    """Energy, force and tangent of the strain energy of one beam.

    Parameters
    ----------
    across
        A body with its section, a :class:`~skfem_ancf.sections.Across`.
    formulation
        A :class:`~skfem_ancf.formulations.Formulation`.
    """

    texts = SECTIONS

    def __init__(self, across: "Across", formulation: "Formulation") -> None:
        super().__init__(across.mesh, across.element)
        self.constant = across.stabilisation(formulation)
        none = np.zeros((0, 2 * self.nd, 2 * self.nd))
        constants = [none if self.constant is None else self.constant]
        self.tables: list[TermTables] = []
        rows: dict[Any, Any] = {}
        asked: list[tuple[Array, ...]] = []
        self._across = across
        for layer, terms in across.terms(formulation):
            for term in terms:
                constant = constants.pop() if constants else none
                self.tables.append(TermTables(across, layer, term, constant, self, rows, asked))
        self.packs = [t.pack for t in self.tables]
        layers = [id(t.layer) for t in self.tables]
        #: The tables of the first term of each layer.
        self.firsts = [t for k, t in enumerate(self.tables) if id(t.layer) not in layers[:k]]

    @property
    def linear(self) -> bool:
        return all(pack.law.kind == LINEAR for pack in self.packs)

    @property
    def shared(self) -> bool:
        """One table serves all elements."""
        return self.tables[0].shared

    @property
    def points_number(self) -> int:
        """Integration points of an element."""
        return sum(t.w.shape[1] for t in self.tables)

    @property
    def section_points(self) -> int:
        """Integration points across the section, of the first terms."""
        return sum(t.section_points for t in self.firsts)

    @property
    def volume(self) -> float:
        """Volume of the body, by the rules of the first terms."""
        return sum(float(np.sum(t.w)) * (self.t.shape[1] if t.shared else 1) for t in self.firsts)

    @property
    def scale(self) -> float:
        """Modulus times volume."""
        return sum([float(t.pack.weights.sum()) * t.layer.material.E * (
            self.t.shape[1] if t.shared else 1) for t in self.firsts])

    def inverted(self, u: Array) -> bool:
        return any(first.inverted(pack, u_e) for first, pack, u_e in self._of_firsts(u))

    def _of_firsts(self, u):
        """Each of the first tables with a pack of some elements and their coordinates."""
        parts = self.chunks()
        if len(parts) == 1:
            return [(first, first.pack, u) for first in self.firsts]
        return ((first, apart(first.pack, part), self.gather(u, part).ravel())
                for part in parts for first in self.firsts)

    def shortest(self, u: Array) -> Any:
        """Smallest stretch of the fibres along the axis, where eps_xx is sampled."""
        return min(first.shortest(pack, u_e) for first, pack, u_e in self._of_firsts(u))

    def strain_increment(self, pack: SectionPack, u: Array, du: Array, out: Array) -> None:
        SECTIONS.carry(with_unit_law(pack), u, du, np.zeros_like(out), out)

    def weighted_moduli(self, pack: SectionPack, u: Array) -> Array:
        n, ne = pack.weights.shape[0], pack.start.size
        if pack.law.kind == LINEAR:
            return np.broadcast_to(pack.law.D[:, :, None, None] * pack.weights, (3, 3, n, ne))
        strain, D = np.empty((3, n, ne)), np.empty((3, 3, n, ne))
        SECTIONS.stress(with_unit_law(pack), u, strain)
        law_evaluate(pack.law, strain, D.reshape(9, n, ne))
        return D * pack.weights

    def viscous_packs(self, time: float) -> list[SectionPack]:
        """The packs of a linear law with ``time`` times the moduli at no strain."""
        none = np.zeros((0, 2 * self.nd, 2 * self.nd))
        return [_viscous(t.pack, time, none) if t.pack.law.kind == LINEAR else TermTables(
            self._across, t.layer, replace(t.term, law=LinearLaw(time * t.law.moduli(np.zeros(3)))),
            none, self).pack for t in self.tables]

    def small_packs(self) -> list[SectionPack]:
        return [linearised(pack) for pack in self.packs]

    def pushed_packs(self) -> list[SectionPack]:
        return [pack._replace(
            grows=1, constant=pack.constant[:0],
            moduli=pack.moduli if pack.law.kind != LINEAR else np.zeros_like(pack.moduli),
            pairs=pack.pairs._replace(held=packed(pack.pairs.held[:, :0]))) for pack in self.packs]

    def without_material(self, pack: SectionPack) -> SectionPack:
        return pack._replace(terms=packed(pack.terms[:, :0], np.int64),
                             rounds=np.zeros(1, np.int64), moduli=np.zeros((0, pack.start.size)),
                             law=pack.law._replace(kind=LINEAR),
                             pairs=pack.pairs._replace(held=pack.pairs.held[:, :0]))
