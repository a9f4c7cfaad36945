"""The strain energy of the shear-rigid cable.

``U = 1/2 int E A eps^2 - 2 E S eps k + E I k^2 ds`` with ``eps = |r'| - 1``, the change ``k`` of
the material curvature ``kappa = r' x r'' / |r'|^2``, the rate at which the tangent turns along the
stress-free axis, and the first moment S of the section about it. Both are sampled at 2 m - 2 Gauss
points of an axis of degree 2 m - 1. Those of the cubic axis miss a mode, equal slopes along the
axis at both nodes: it has a third point in the middle, whose weight falls with the slenderness.

Rows of the table are those of d/dX, then of d^2/dX^2, at the points: ``a = r'``, ``b = r''``.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...core.immutable import read_only
from ...core.linear import first_order
from ...core.quadrature import gauss
from ...core.source import F2, F3, I1, lanes, primitive, room, shaped, source
from ...core.types import Array
from .base import (CARRY, GIVEN, GRADIENTS, MEAN, STRESS, TANGENT, TURNED, VISCOUS, Chain,
                   PairTables, Texts, add_both_halves, add_by_rows, add_force, add_held_energy,
                   add_scaled, add_tangent, block, copy_stress, load, packed, pair_tables, product,
                   scaled_pair_tables, weigh)

if TYPE_CHECKING:
    from ...formulations.base import Formulation
    from ...sections import Across


class CablePack(NamedTuple):
    """The tables of a cable.

    Attributes
    ----------
    table, transposed, frame
        Derivatives of the local functions (1 or elements, rows, nb), those that elements share as
        (1, nb, rows) too, else (0, ...), and a and b in the stress-free state, (rows, 2, 1 or
        elements).
    length0, kappa0
        ``|a|`` and the curvature in the stress-free state, (points, 1 or elements).
    weights, place
        Of the points of integration, (points, 1 or elements), and 0 or the number of an element.
    frame_place
        The same for the stress-free state.
    stiffness
        E A, E I and - E S at the points of integration, (3, points, 1 or elements), as the weights.
    constant
        Stabilisation (0, 1 or elements, 2 nb, 2 nb).
    start, span
        First coordinate of each element, and 0 to 2 nb - 1.
    pairs
        :class:`~skfem_ancf.beam.kernels.base.PairTables` of (a, a), (a, b) and (b, b) of each
        point.
    address
        That of the compiled :func:`cable_block`; 0 for the plain one.
    """

    table: F3
    transposed: F3
    frame: F3
    length0: F2
    kappa0: F2
    weights: F2
    place: I1
    frame_place: I1
    stiffness: F3
    constant: F3
    start: I1
    span: I1
    pairs: PairTables
    address: int = 0


@source
def curvature(a0, a1, b0, b1, square):
    """The material curvature of an axis with derivatives a and b.

    Parameters
    ----------
    a0, a1, b0, b1
        Their components: numbers, or arrays of one shape.
    square
        ``|a|^2``.
    """
    return (a0 * b1 - a1 * b0) / square


@source
def extension(a0, a1, da0, da1, length, length0):
    """The extension of an axis, without cancellation.

    Parameters
    ----------
    a0, a1, da0, da1
        Its derivative, and the displacement part of it: numbers, or arrays of one shape.
    length, length0
        ``|a|``, and the same in the stress-free state.
    """
    return ((2.0 * a0 - da0) * da0 + (2.0 * a1 - da1) * da1) / (length + length0)


@source
def cable_strain(pack, first, d, r, length, kappa, strain):
    """Strains of the elements from ``first`` on, without cancellation in the extension.

    Parameters
    ----------
    d
        Displacement parts of a and b, shape (rows, 2, elements).
    r, length, kappa, strain
        Written: a and b, |a|, the curvature, and (eps, kappa - kappa_0).
    """
    n, size = length.shape[0], length.shape[1]
    at, b = pack.frame_place[first:first + size], r[n:]
    for g in lanes(r.shape[0]):
        for i in lanes(2):
            for e in lanes(size):
                r[g, i, e] = pack.frame[g, i, at[e]] + d[g, i, e]
    for p in lanes(n):
        for e in lanes(size):
            a0, a1, da0, da1 = r[p, 0, e], r[p, 1, e], d[p, 0, e], d[p, 1, e]
            s = a0 * a0 + a1 * a1
            k, root = curvature(a0, a1, b[p, 0, e], b[p, 1, e], s), np.sqrt(s)
            strain[0, p, e] = extension(a0, a1, da0, da1, root, pack.length0[p, at[e]])
            strain[1, p, e] = k - pack.kappa0[p, at[e]]
            length[p, e], kappa[p, e] = root, k


@source
def cable_stress(stiffness, at, strain, other, S):
    """The mean resultants of two strains."""
    EA, EI, ES = stiffness[0], stiffness[1], stiffness[2]
    for p in lanes(S.shape[1]):
        for e in lanes(S.shape[2]):
            x, y = strain[0, p, e] + other[0, p, e], strain[1, p, e] + other[1, p, e]
            S[0, p, e] = 0.5 * (EA[p, at[e]] * x + ES[p, at[e]] * y)
            S[1, p, e] = 0.5 * (EI[p, at[e]] * y + ES[p, at[e]] * x)


@source
def cable_rows(weights, at, r, length, kappa, S, T):
    """What mean resultants of two states do on the gradients; both may be the same.

    eps and kappa are not quadratic in the coordinates; their changes are still linear in the
    step: ``d eps = (a0 + a1) . da / (|a0| + |a1|)`` and, from ``s kappa = a x b``,
    ``mean(s) d kappa = d(a x b) - mean(kappa) ds``.
    """
    n, k = length.shape[1], len(r) - 1
    b, Tb = r[:, n:], T[n:]
    for p in lanes(n):
        for e in lanes(T.shape[2]):
            x, y, w = length[0, p, e], length[k, p, e], 2.0 * weights[p, at[e]]
            M = w * S[1, p, e] / (x * x + y * y)
            N = w * S[0, p, e] / (x + y) - (kappa[0, p, e] + kappa[k, p, e]) * M
            a0, a1 = 0.5 * (r[0, p, 0, e] + r[k, p, 0, e]), 0.5 * (r[0, p, 1, e] + r[k, p, 1, e])
            T[p, 0, e] = N * a0 + 0.5 * M * (b[0, p, 1, e] + b[k, p, 1, e])
            T[p, 1, e] = N * a1 - 0.5 * M * (b[0, p, 0, e] + b[k, p, 0, e])
            Tb[p, 0, e], Tb[p, 1, e] = -M * a1, M * a0


@source
def cable_rates(r, d, length, kappa, rates):
    """Changes of the strains, linearised, by displacement parts d of a and b."""
    n = length.shape[0]
    b, db = r[n:], d[n:]
    for p in lanes(n):
        for e in lanes(r.shape[2]):
            a0, a1, c = r[p, 0, e], r[p, 1, e], 1.0 / length[p, e]
            along = a0 * d[p, 0, e] + a1 * d[p, 1, e]
            change = (d[p, 0, e] * b[p, 1, e] - d[p, 1, e] * b[p, 0, e] + a0 * db[p, 1, e]
                      - a1 * db[p, 0, e] - 2.0 * kappa[p, e] * along)
            rates[0, p, e], rates[1, p, e] = c * along, c * c * change


@source
def cable_factors(stiffness, weights, at, r, length, kappa, stress, M, skew):
    """Factors of the pairs (a, a), (a, b), (b, b) for N d^2 eps + M d^2 kappa and the stiffness."""
    n = length.shape[0]
    b, Maa, Mab, Mbb = r[n:], M[:n], M[n:2 * n], M[2 * n:]
    EA, EI, ES = stiffness[0], stiffness[1], stiffness[2]
    for p in lanes(n):
        for e in lanes(M.shape[2]):
            a0, a1, b0, b1 = r[p, 0, e], r[p, 1, e], b[p, 0, e], b[p, 1, e]
            s, k, w = length[p, e] * length[p, e], kappa[p, e], weights[p, at[e]]
            square = w / s  # over s, over s^(3/2) and over s^2
            cube, fourth = square / length[p, e], square / s
            x, y, z = square * EA[p, at[e]], fourth * EI[p, at[e]], cube * ES[p, at[e]]
            N, m = cube * stress[0, p, e], 2.0 * fourth * stress[1, p, e]
            k0, k1, c = b1 - 2.0 * k * a0, -b0 - 2.0 * k * a1, k * s
            q = 4.0 * k * m  # derivatives of eps by a: a / |a|; of kappa: k / s by a, (-a1, a0) / s
            Maa[p, 0, e] = ((x + q) * a0 * a0 + (y * k0 + 2.0 * z * a0) * k0 + N * a1 * a1
                            - m * (2.0 * b1 * a0 + c))
            Maa[p, 1, e] = ((x + q) * a1 * a1 + (y * k1 + 2.0 * z * a1) * k1 + N * a0 * a0
                            + m * (2.0 * b0 * a1 - c))
            Maa[p, 2, e] = ((x + q - N) * a0 * a1 + y * k0 * k1 + z * (a0 * k1 + a1 * k0)
                            - m * (b1 * a1 - b0 * a0))
            y0, y1 = y * k0 + z * a0, y * k1 + z * a1
            Mab[p, 0, e] = (m * a0 - y0) * a1
            Mab[p, 1, e] = (y1 - m * a1) * a0
            ab, ba = y0 * a0 - m * a0 * a0, m * a1 * a1 - y1 * a1
            Mab[p, 2, e] = 0.5 * (ab + ba)
            skew[p, 0, e] = 0.5 * (ab - ba) + 0.5 * m * s
            Mbb[p, 0, e], Mbb[p, 1, e] = y * a1 * a1, y * a0 * a0
            Mbb[p, 2, e] = -y * a0 * a1


@source
def row_gradients(r, length, kappa, X):
    """Derivatives of the strains by a and b: of eps by a, of kappa by a and by b, (3, n, 2, e).

    That of eps by a is a / |a|, those of kappa are k / s and (-a1, a0) / s.
    """
    n, size, b = length.shape[0], length.shape[1], r[length.shape[0]:]
    for p in lanes(n):
        for e in lanes(size):
            a0, a1, k, c = r[p, 0, e], r[p, 1, e], kappa[p, e], 1.0 / length[p, e]
            q = c * c
            X[0, p, 0, e], X[0, p, 1, e] = c * a0, c * a1
            X[1, p, 0, e] = q * (b[p, 1, e] - 2.0 * k * a0)
            X[1, p, 1, e] = -q * (b[p, 0, e] + 2.0 * k * a1)
            X[2, p, 0, e], X[2, p, 1, e] = -q * a1, q * a0


@source
def turned_factors(stiffness, weights, at, X, Y, M, skew):
    """As :func:`cable_factors`, of ``X^T D (Y - X)`` for two gradients; xx, xy, yx and yy."""
    n = X.shape[1]
    EA, EI, ES = stiffness[0], stiffness[1], stiffness[2]
    aa, ab, bb = M[:n], M[n:2 * n], M[2 * n:]
    for i in range(2):
        for j in range(2):
            k = 2 * i + j
            for p in lanes(n):
                for e in lanes(M.shape[2]):
                    w = weights[p, at[e]]
                    A, I, S = w * EA[p, at[e]], w * EI[p, at[e]], w * ES[p, at[e]]
                    x, y, z = X[0, p, i, e], X[1, p, i, e], X[2, p, i, e]
                    dx, dy = Y[0, p, j, e] - X[0, p, j, e], Y[1, p, j, e] - X[1, p, j, e]
                    dz = Y[2, p, j, e] - X[2, p, j, e]
                    u, v = (S * x + I * y) * dz, z * (S * dx + I * dy)
                    aa[p, k, e] = (A * x + S * y) * dx + (S * x + I * y) * dy
                    ab[p, k, e], skew[p, k, e] = 0.5 * (u + v), 0.5 * (u - v)
                    bb[p, k, e] = I * z * dz


@source
def cable_gradients(table, first, pairs, r, length, kappa, out):
    """Derivatives of the strains into ``out``, (2, points, elements, nb, 2)."""
    n, size = length.shape[0], length.shape[1]
    X = room((3, n, 2, size), r)
    row_gradients(r, length, kappa, X)
    out[:] = 0.0
    for j in range(3):
        g = pairs[j // 2, n:2 * n]
        add_by_rows(table, first, g, X[j], out[(j + 1) // 2])


@source
def cable_evaluate(pack, what, u, v, f, given, out, to):
    """As :func:`~skfem_ancf.beam.kernels.section.section_evaluate`."""
    most = block(pack.pairs.pairs.shape[1])
    for first in range(0, pack.start.size, most):
        last = min(first + most, pack.start.size)
        run_cable(pack, what, first, last, u, v, f, given, out, to)


@primitive("blocks")
def run_cable(pack, what, first, last, u, v, f, given, out, to):
    """As :func:`cable_block`; compiled once, and not anew in each text that calls it."""
    cable_block(pack, what, first, last, u, v, f, given, out, to)


@source
def cable_block(pack, what, first, last, u, v, f, given, out, to):
    """As :func:`cable_evaluate`, for the elements from ``first`` to ``last``."""
    whole, given, out = out, given[:, :, first:last], out[:, :, first:last]
    n, nr, nb, size = len(pack.weights), pack.table.shape[1], pack.table.shape[2], out.shape[2]
    changes, states = what == CARRY or what == VISCOUS, 2 if what == MEAN or what == TURNED else 1
    at, stiffness, weights = pack.place[first:last], pack.stiffness, pack.weights
    U, d, T = room((2, nb, 2, size), u), room((2, nr, 2, size), u), room((nr, 2, size), u)
    r, length, kappa = room((2, nr, 2, size), u), room((2, n, size), u), room((2, n, size), u)
    strain, S = room((2, 2, n, size), u), room((2, n, size), u)
    for k in range(max(states, 1 + changes)):
        load(pack.start, pack.span, first, v if k else u, U[k])
        product(pack.table, first, U[k], d[k])
        if k < states:
            cable_strain(pack, first, d[k], r[k], length[k], kappa[k], strain[k])
    if what == TURNED:
        _add_turned(pack, first, at, r, length, kappa, to)
        return
    if what == GRADIENTS:
        _write_gradients(pack, first, at, r[0], length[0], kappa[0], whole)
        if to.flat.size > 0:
            copy_stress(given, S)
            _add_tangent(pack, first, at, r[0], length[0], kappa[0], S, to)
        return
    k = states - 1
    if changes:
        cable_rates(r[0], d[1], length[0], kappa[0], strain[0])
    cable_stress(stiffness, at, strain[0], strain[k], S)
    if what == CARRY:
        add_scaled(1.0, given, S, S)
    if out.shape[0] > 0:
        copy_stress(S, out)
    if what == STRESS or what == CARRY:
        return
    if given.shape[0] > 0 and what != TANGENT:
        copy_stress(given, S)
    if what == MEAN:
        for k in lanes(nb):
            for i in lanes(2):
                for e in lanes(size):
                    U[0, k, i, e] = 0.5 * (U[0, k, i, e] + U[1, k, i, e])
    cable_rows(weights, at, r[:states], length[:states], kappa[:states], S, T)
    held = pack.constant[:0] if what == GIVEN else pack.constant
    add_force(pack.table, pack.transposed, held, pack.start, pack.span, first, T, U[0], f)
    if what == TANGENT:
        if given.shape[0] > 0:
            copy_stress(given, S)
        _add_tangent(pack, first, at, r[0], length[0], kappa[0], S, to)


@source
def _add_tangent(pack, first, at, r, length, kappa, S, to):
    """The tangent of stresses and stiffnesses at the points."""
    n, size = length.shape[0], length.shape[1]
    M, skew = room((3 * n, 3, size), r), room((n + 1, 1, size), r)
    skew[n:] = 0.0
    cable_factors(pack.stiffness, pack.weights, at, r, length, kappa, S, M, skew)
    add_tangent(pack.table, pack.pairs, pack.start, first, M, skew, to)


@source
def _add_turned(pack, first, at, r, length, kappa, to):
    """What the second state changes of the derivative of stresses of the strains of the first."""
    n, size = length.shape[1], length.shape[2]
    X, M, skew = room((2, 3, n, 2, size), r), room((3 * n, 4, size), r), room((n + 1, 4, size), r)
    skew[n:] = 0.0
    for k in range(2):
        row_gradients(r[k], length[k], kappa[k], X[k])
    turned_factors(pack.stiffness, pack.weights, at, X[0], X[1], M, skew)
    add_both_halves(pack.table, pack.pairs, pack.start, first, M, skew, to)


@source
def _write_gradients(pack, first, at, r, length, kappa, out):
    """What :func:`~skfem_ancf.beam.strain_energy.body_gradients` finds, of the elements from
    ``first`` on."""
    n, nb, size, ne = len(pack.weights), pack.table.shape[2], at.size, pack.start.size
    D, w = room((4, n, size), r), room((n, size), r)
    EA, EI, ES = pack.stiffness[0], pack.stiffness[1], pack.stiffness[2]
    for p in lanes(n):
        for e in lanes(size):
            w[p, e] = pack.weights[p, at[e]]
            D[0, p, e], D[1, p, e] = EA[p, at[e]], ES[p, at[e]]
            D[2, p, e], D[3, p, e] = ES[p, at[e]], EI[p, at[e]]
    X = room((2, n, size, nb, 2), r)
    cable_gradients(pack.table, first, pack.pairs.pairs, r, length, kappa, X)
    B = shaped(out, (2, ne, 2, n, 2 * nb))[:, first:first + size]
    weigh(D, w, shaped(X, (2, n, size, 2 * nb)), B[0], B[1])


def cable_energy(pack: CablePack, u: Array, out: Array) -> None:
    """Add the strain energy of each element to out, (elements,).

    Parameters
    ----------
    pack
        The tables.
    u, out
        Displacement, shape (N,), and energies that are added to, shape (elements,).
    """
    strain = np.empty((2, len(pack.weights), out.size), u.dtype)
    CABLES.stress(_unit(pack), u, strain)
    EA, EI, C = pack.stiffness[:, :, pack.place]
    eps, kappa = strain
    out += 0.5 * np.sum(pack.weights[:, pack.place] * (
        EA * eps * eps + EI * kappa * kappa + 2.0 * C * eps * kappa), axis=0)
    add_held_energy(pack, u, out)


#: Stiffness against the mode that two points of a cubic axis miss, in EI over the square of the
#: length of the beam: the third point has a quarter of it.
MIDDLE = 1200.0


def softened(weight: float) -> tuple[Array, Array]:
    """Three points on [0, 1], exact for cubics: two Gauss points and one of a weight between them.

    Parameters
    ----------
    weight
        That of the middle; of 4/9 and more it is the rule of three Gauss points.
    """
    weight = min(weight, 4.0 / 9.0)
    x = 0.5 / np.sqrt(3.0 * (1.0 - weight))
    outer = 0.5 * (1.0 - weight)
    return np.array([0.5 - x, 0.5, 0.5 + x]), np.array([outer, weight, outer])


CABLES = Texts(2, cable_evaluate, cable_energy)


@lru_cache(64)
def _pairs(n):
    """Pairs (a, a), (a, b) and (b, b) of the rows of n points, a before b; shape (2, 3 n)."""
    p = np.arange(n)
    return read_only(np.array([np.concatenate([p, p, n + p]), np.concatenate([p, n + p, n + p])]))


@lru_cache(64)
def _powers(m):
    """Of the length that the functions of m coordinates a node take; shape (2 m,)."""
    return read_only(np.tile(np.arange(float(m)), 2))


def _square(across):
    """E I about the centroid over E A, where it is largest."""
    if across.simple:
        return across.mesh.height**2 / 12.0
    EA, ES, EI = across.moments(np.array([0.5]), None, "E")[:, :, 0]
    return float(np.max((EI - ES**2 / EA) / EA))


def _has_alone(t):
    """True if an element has no neighbour."""
    if t[0, -1] == t.shape[1] - 1:  # one chain
        return t.shape[1] == 1
    joined = t[0, 1:] == t[1, :-1]
    return not np.all(np.append(False, joined) | np.append(joined, False))


def _unit(pack):
    """The pack whose resultants are the strains."""
    one = np.ones_like(pack.stiffness)
    one[2] = 0.0
    return pack._replace(stiffness=one)


def cross(a: Array, b: Array) -> Array:
    """The out-of-plane component of a x b, along the last axis.

    Parameters
    ----------
    a, b
        Shape (..., 2).
    """
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


class CableKernel(Chain):
    """Energy, force and tangent of a cable.

    Parameters
    ----------
    across
        A body with its section, a :class:`~skfem_ancf.sections.Across`, of an
        ``ElementBeamCable``.
    formulation
        That of the beam; its first term has the Gauss points along the axis.
    """

    texts = CABLES

    def __init__(self, across: "Across", formulation: "Formulation") -> None:
        mesh, element = across.mesh, across.element
        super().__init__(mesh, element)
        self.constant = across.stabilisation(formulation)
        n = formulation.points_along(element, across.layers[0].material)
        if n == 2:
            alpha, length = getattr(formulation, "alpha", 1.0), float(mesh.chain_lengths.min())
            self.rule = softened(alpha * MIDDLE * _square(across) / length**2)
        else:
            if self.constant is None and _has_alone(mesh.t):
                n = max(n, element.axis_degree)  # no neighbour holds a mode that fewer points miss
            self.rule = gauss(n)
        self.points_number = len(self.rule[0])
        longest = mesh.lengths.max()
        self.shared = mesh.is_uniform or longest - mesh.lengths.min() <= 1e-13 * longest
        self._across, self.points = across, self.rule[0]
        self.packs = [self._pack(mesh, element, self.points_number)]

    @property
    def volume(self) -> float:
        """Volume of the body."""
        w, area = self.rule[1], self._across.moments(self.points, what="area")[0]
        return float(area @ w @ self._across.mesh.lengths)

    @property
    def scale(self) -> float:
        """Modulus times volume."""
        pack, = self.packs
        per = pack.weights * pack.stiffness[0]
        return float(per.sum()) * (pack.start.size / per.shape[1])

    def outer_stretches(self, u: Array) -> Array:
        """Stretch of the fibres at the bottom and at the top, (2, points, elements).

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        """
        pack, (eps, kappa) = self.packs[0], first_order(self.strain(self.gather(u)))
        Y = 0.5 * np.transpose(self._across.mesh.mapping().height(self.points)[0])
        kappa0 = pack.kappa0[:, pack.frame_place]
        return np.array([1.0 + (eps - y * kappa) / (1.0 - y * kappa0) for y in (-Y, Y)])

    def _pack(self, mesh, element, n):
        """The tables of the reference element times powers of the lengths, of one or of each."""
        ne, nb = mesh.nelements, self.nd
        L = (mesh.lengths[:1] if self.shared else mesh.lengths)[:, None]
        unit, pairs = self._derivatives(element, n), _pairs(n)
        columns, rows = L ** _powers(nb // 2), np.empty((len(L), 2 * n))
        rows[:, :n], rows[:, n:] = 1.0 / L, 1.0 / L**2
        table = unit * (rows[:, :, None] * columns[:, None])
        frame, length0, kappa0 = self._stress_free(mesh, element, n, table)
        stiffness, where = self._stiffness(), np.arange(ne)
        weights = np.empty(stiffness.shape[1:])
        weights[:] = self.rule[1][:, None] * L.T
        constant = np.zeros((0, 2 * nb, 2 * nb)) if self.constant is None else packed(self.constant)
        return CablePack(
            table, np.ascontiguousarray(table[:int(self.shared)].transpose(0, 2, 1)), frame,
            length0, kappa0, weights, where * (weights.shape[1] > 1), where * (frame.shape[2] > 1),
            stiffness, constant, mesh.t[0].astype(np.int64) * nb, np.arange(2 * nb),
            scaled_pair_tables(unit, rows[0], columns[0], pairs, constant, ne) if self.shared else
            pair_tables(table, pairs, constant, ne))

    def _derivatives(self, element, n):
        """The first and second derivatives of the axis' functions at the points, (2 n, nb)."""
        return np.concatenate([element.axis(self.points, d).T for d in (1, 2)])

    def _stiffness(self):
        """EA, EI and - ES at the points, (3, points, 1 or elements)."""
        few = np.zeros(1, int) if self.shared and self._across.constant else None
        EA, ES, EI = self._across.moments(self.points, few)
        out = np.empty((3, *EA.T.shape))
        out[0], out[1], out[2] = EA.T, EI.T, -ES.T
        return out

    def _stress_free(self, mesh, element, n, table):
        """a and b in the stress-free state, (rows, 2, 1 or elements), its lengths and curvatures.

        The last two of shape (points, 1 or elements).
        """
        if mesh.is_straight:
            p, k = mesh.p, 1 if mesh.is_uniform else mesh.nelements
            left, right = (0, 1) if k == 1 else mesh.t
            e = (p[:, right] - p[:, left]).reshape(2, k) / mesh.lengths[:k]
            frame, length0 = np.zeros((2 * n, 2, k)), np.empty((n, k))
            frame[:n], length0[:] = e, np.hypot(e[0], e[1])
            return frame, length0, np.zeros((n, k))
        q0 = element.rigid(mesh)
        q0[0] = mesh.p - mesh.p.mean(axis=1, keepdims=True)
        q_e = self.gather(np.ascontiguousarray(q0.transpose(2, 0, 1)).ravel())
        frame = packed((table @ q_e).transpose(1, 2, 0))
        a, b = frame[:n], frame[n:]
        square = np.sum(a * a, axis=1)
        return frame, np.sqrt(square), (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / square

    def strain(self, u_e: Array, elements: slice = slice(None)) -> Array:
        """Extension and change of curvature at the integration points, shape (2, points, ne).

        Parameters
        ----------
        u_e
            Displacements of the coordinates of these elements, shape (ne, nb, 2).
        elements
            A slice of the elements.
        """
        pack, = self.apart(elements)
        out = np.empty((2, self.points_number, len(u_e)), u_e.dtype)
        CABLES.stress(_unit(pack), u_e.ravel(), out)
        return out

    def strain_increment(self, pack: CablePack, u: Array, du: Array, out: Array) -> None:
        CABLES.carry(_unit(pack), u, du, np.zeros_like(out), out)

    def weighted_moduli(self, pack: CablePack, u: Array) -> Array:
        n, ne = pack.weights.shape[0], pack.start.size
        EA, EI, C = pack.stiffness
        return np.array([[EA, C], [C, EI]]) * np.broadcast_to(pack.weights, (n, ne))

    def viscous_packs(self, time: float) -> list[CablePack]:
        """The packs with ``time`` times the stiffnesses, without stabilisation."""
        none = np.zeros((0, 2 * self.nd, 2 * self.nd))
        return [pack._replace(stiffness=time * pack.stiffness, constant=packed(none),
                              pairs=pack.pairs._replace(held=packed(pack.pairs.held[:, :0])))
                for pack in self.packs]

    def pushed_packs(self) -> list[CablePack]:
        return self.viscous_packs(0.0)

    def without_material(self, pack: CablePack) -> CablePack:
        return pack._replace(stiffness=np.zeros_like(pack.stiffness),
                             pairs=pack.pairs._replace(held=pack.pairs.held[:, :0]))
