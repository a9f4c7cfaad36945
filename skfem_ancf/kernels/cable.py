"""The strain energy of the shear-rigid cable.

``U = 1/2 int E A eps^2 + E I (kappa - kappa_0)^2 ds`` with ``eps = |r'| - 1`` and the material
curvature ``kappa = r' x r'' / |r'|^2``, the rate at which the tangent turns along the stress-free
axis. Both are sampled at 2 m - 2 Gauss points of an axis of degree 2 m - 1; for the cubic axis
the mode of equal slopes that this leaves is stabilised.

Rows of the table are those of d/dX, then of d^2/dX^2, at the points: ``a = r'``, ``b = r''``.
"""

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..quadrature import gauss
from ..source import F1, F2, F3, I1, lanes, source
from .base import (Chain, PairTables, Texts, add_force, add_held_energy, add_tangent, block, load,
                   packed, pair_tables, product)


class CablePack(NamedTuple):
    """The tables of a cable.

    Attributes
    ----------
    table, transposed, frame
        Derivatives of the local functions (rows, nb, 1 or elements), the same as (nb, rows, 1 or
        0), and a and b in the stress-free state, (rows, 2, 1 or elements).
    length0, kappa0
        ``|a|`` and the curvature in the stress-free state, (points, 1 or elements).
    weights, place
        Of the points of integration, (points, 1 or elements), and 0 or the number of an element.
    frame_place
        The same for the stress-free state.
    stiffness
        E A and E I.
    constant
        Stabilisation (2 nb, 2 nb, 0, 1 or elements).
    start, span
        First coordinate of each element, and 0 to 2 nb - 1.
    pairs
        :class:`~skfem_ancf.kernels.base.PairTables` of (a, a), (a, b) and (b, b) of each point.
    """

    table: F3
    transposed: F3
    frame: F3
    length0: F2
    kappa0: F2
    weights: F2
    place: I1
    frame_place: I1
    stiffness: F1
    constant: F3
    start: I1
    span: I1
    pairs: PairTables


class CableWork(NamedTuple):
    """Of a block of elements: coordinates, a and b with their displacement parts d, and more.

    ``square`` is |a|^2; ``strain`` are eps and kappa - kappa_0.
    """

    U: np.ndarray
    d: np.ndarray
    r: np.ndarray
    T: np.ndarray
    square: np.ndarray
    kappa: np.ndarray
    strain: np.ndarray
    weights: np.ndarray


@source
def cable_work(pack, size, u):
    """Work arrays of a block of elements."""
    rows, n, nb = pack.table.shape[0], pack.weights.shape[0], pack.table.shape[1]
    return CableWork(np.empty((nb, 2, size), u.dtype), np.empty((rows, 2, size), u.dtype),
                     np.empty((rows, 2, size), u.dtype), np.empty((rows, 2, size), u.dtype),
                     np.empty((n, size), u.dtype), np.empty((n, size), u.dtype),
                     np.empty((2, n, size), u.dtype), np.empty((n, size)))


@source
def cable_strain(pack, first, u, work):
    """Extension without cancellation, and change of curvature, of the elements from ``first``."""
    d, r, square, kappa, n = work.d, work.r, work.square, work.kappa, work.square.shape[0]
    size = work.U.shape[2]
    load(pack.start, pack.span, first, u, work.U)
    product(pack.table, first, work.U, d)
    at, at0 = pack.place[first:first + size], pack.frame_place[first:first + size]
    for g in lanes(d.shape[0]):
        for i in lanes(2):
            for e in lanes(size):
                r[g, i, e] = pack.frame[g, i, at0[e]] + d[g, i, e]
    b = r[n:]
    for p in lanes(n):
        for e in lanes(size):
            a0, a1, da0, da1 = r[p, 0, e], r[p, 1, e], d[p, 0, e], d[p, 1, e]
            s = a0 * a0 + a1 * a1
            k = (a0 * b[p, 1, e] - a1 * b[p, 0, e]) / s
            work.strain[0, p, e] = (((2.0 * a0 - da0) * da0 + (2.0 * a1 - da1) * da1)
                                    / (np.sqrt(s) + pack.length0[p, at0[e]]))
            work.strain[1, p, e] = k - pack.kappa0[p, at0[e]]
            square[p, e], kappa[p, e] = s, k
            work.weights[p, e] = pack.weights[p, at[e]]


@source
def add_cable_force(pack, first, work, f):
    """Add the forces of normal force and moment."""
    T, r, n = work.T, work.r, work.square.shape[0]
    b, Tb, EA, EI = r[n:], T[n:], pack.stiffness[0], pack.stiffness[1]
    for p in lanes(n):
        for e in lanes(T.shape[2]):
            a0, a1, s, w = r[p, 0, e], r[p, 1, e], work.square[p, e], work.weights[p, e]
            M = w * EI * work.strain[1, p, e] / s
            N = w * EA * work.strain[0, p, e] / np.sqrt(s) - 2.0 * work.kappa[p, e] * M
            T[p, 0, e], T[p, 1, e] = N * a0 + M * b[p, 1, e], N * a1 - M * b[p, 0, e]
            Tb[p, 0, e], Tb[p, 1, e] = -M * a1, M * a0
    add_force(pack.table, pack.transposed, pack.constant, pack.start, pack.span, first, T, work.U,
              f)


@source
def cable_factors(pack, work, stress, M, skew):
    """Factors of the pairs (a, a), (a, b), (b, b) for N d^2 eps + M d^2 kappa and the stiffness."""
    r, n = work.r, work.square.shape[0]
    b, Maa, Mab, Mbb, EA, EI = (r[n:], M[:n], M[n:2 * n], M[2 * n:], pack.stiffness[0],
                                pack.stiffness[1])
    for p in lanes(n):
        for e in lanes(M.shape[2]):
            a0, a1, b0, b1 = r[p, 0, e], r[p, 1, e], b[p, 0, e], b[p, 1, e]
            s, k, w = work.square[p, e], work.kappa[p, e], work.weights[p, e]
            x, y = w * EA / s, w * EI / (s * s)
            N, m = w * stress[0, p, e] / (s * np.sqrt(s)), 2.0 * w * stress[1, p, e] / (s * s)
            k0, k1, c = b1 - 2.0 * k * a0, -b0 - 2.0 * k * a1, k * s
            q = 4.0 * k * m  # derivatives of eps by a: a / |a|; of kappa: k / s by a, (-a1, a0) / s
            Maa[p, 0, e] = (x + q) * a0 * a0 + y * k0 * k0 + N * a1 * a1 - m * (2.0 * b1 * a0 + c)
            Maa[p, 1, e] = (x + q) * a1 * a1 + y * k1 * k1 + N * a0 * a0 + m * (2.0 * b0 * a1 - c)
            Maa[p, 2, e] = (x + q - N) * a0 * a1 + y * k0 * k1 - m * (b1 * a1 - b0 * a0)
            Mab[p, 0, e] = (m * a0 - y * k0) * a1
            Mab[p, 1, e] = (y * k1 - m * a1) * a0
            ab, ba = y * k0 * a0 - m * a0 * a0, m * a1 * a1 - y * k1 * a1
            Mab[p, 2, e] = 0.5 * (ab + ba)
            skew[p, 0, e] = 0.5 * (ab - ba) + 0.5 * m * s
            Mbb[p, 0, e], Mbb[p, 1, e] = y * a1 * a1, y * a0 * a0
            Mbb[p, 2, e] = -y * a0 * a1


@source
def cable_resultants(stiffness, strain, first, out):
    """Normal force and moment of a block, into those of all elements."""
    part = out[:, :, first:first + strain.shape[2]]
    for c in range(2):
        x = stiffness[c]
        for p in lanes(strain.shape[1]):
            for e in lanes(strain.shape[2]):
                part[c, p, e] = x * strain[c, p, e]


@source
def cable_loop(pack, u, f, tangent, carried, use_carried, stresses, flat, ld, start):
    """Force into f, and if asked for tangent into the band and stresses (2, points, elements)."""
    most, elements, n = block(pack.pairs.pairs.shape[1]), pack.start.size, pack.weights.shape[0]
    work = cable_work(pack, min(most, elements), u)
    for first in range(0, elements, most):
        size = min(most, elements - first)
        if size < work.U.shape[2]:
            work = cable_work(pack, size, u)
        cable_strain(pack, first, u, work)
        add_cable_force(pack, first, work, f)
        if tangent:
            cable_resultants(pack.stiffness, work.strain, first, stresses)
            used = carried if use_carried else stresses
            M, skew = np.empty((3 * n, 3, size)), np.zeros((n + 1, 1, size))
            cable_factors(pack, work, used[:, :, first:first + size], M, skew)
            add_tangent(pack.table, pack.pairs, pack.start, first, M, skew, flat, ld, start)


@source
def cable_force(pack, u, f):
    """Add the internal force of the displacement u (N,) to f."""
    none = np.empty((1, 1, 1))
    cable_loop(pack, u, f, False, none, False, none, none[0, 0], 1, 0)


@source
def cable_tangent(pack, u, f, carried, use_carried, stresses, flat, ld, start):
    """Add force and tangent, see :func:`~skfem_ancf.kernels.section.section_tangent`.

    The stresses are normal force and moment, shape (2, points, elements).
    """
    cable_loop(pack, u, f, True, carried, use_carried, stresses, flat, ld, start)


@source
def cable_carry(pack, u, du, before, out):
    """The resultants, linearised, at u + du, from those ``before``: out (2, points, elements)."""
    most, elements, n = block(pack.pairs.pairs.shape[1]), pack.start.size, pack.weights.shape[0]
    work = cable_work(pack, min(most, elements), u)
    for first in range(0, elements, most):
        size = min(most, elements - first)
        if size < work.U.shape[2]:
            work = cable_work(pack, size, u)
        cable_strain(pack, first, u, work)
        load(pack.start, pack.span, first, du, work.U)
        product(pack.table, first, work.U, work.d)
        x, y = before[:, :, first:first + size], out[:, :, first:first + size]
        r, b, d, db = work.r, work.r[n:], work.d, work.d[n:]
        for p in lanes(n):
            for e in lanes(size):
                a0, a1, s = r[p, 0, e], r[p, 1, e], work.square[p, e]
                along = a0 * d[p, 0, e] + a1 * d[p, 1, e]
                change = (d[p, 0, e] * b[p, 1, e] - d[p, 1, e] * b[p, 0, e] + a0 * db[p, 1, e]
                          - a1 * db[p, 0, e] - 2.0 * work.kappa[p, e] * along)
                y[0, p, e] = x[0, p, e] + pack.stiffness[0] * along / np.sqrt(s)
                y[1, p, e] = x[1, p, e] + pack.stiffness[1] * change / s


@source
def cable_stress(pack, u, out):
    """Normal force and moment at u, (2, points, elements)."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = cable_work(pack, min(most, elements), u)
    for first in range(0, elements, most):
        if elements - first < work.U.shape[2]:
            work = cable_work(pack, elements - first, u)
        cable_strain(pack, first, u, work)
        cable_resultants(pack.stiffness, work.strain, first, out)


@source
def cable_mean(pack, u0, u1, f):
    """Add a force whose work from u0 to u1 is the change of the energy.

    eps and kappa are not quadratic in the coordinates; their changes are still linear in the
    step: ``d eps = (a0 + a1) . da / (|a0| + |a1|)`` and, from ``s kappa = a x b``,
    ``mean(s) d kappa = d(a x b) - mean(kappa) ds``.
    """
    most, elements, n = block(pack.pairs.pairs.shape[1]), pack.start.size, pack.weights.shape[0]
    work = cable_work(pack, min(most, elements), u0)
    old = cable_work(pack, min(most, elements), u0)
    EA, EI = pack.stiffness[0], pack.stiffness[1]
    for first in range(0, elements, most):
        size = min(most, elements - first)
        if size < work.U.shape[2]:
            work, old = cable_work(pack, size, u0), cable_work(pack, size, u0)
        cable_strain(pack, first, u0, old)
        cable_strain(pack, first, u1, work)
        for k in lanes(work.U.shape[0]):
            for i in lanes(2):
                for e in lanes(size):
                    work.U[k, i, e] = 0.5 * (old.U[k, i, e] + work.U[k, i, e])
        for g in lanes(work.r.shape[0]):
            for i in lanes(2):
                for e in lanes(size):
                    work.r[g, i, e] = 0.5 * (old.r[g, i, e] + work.r[g, i, e])
        T, a, b, Tb = work.T, work.r, work.r[n:], work.T[n:]
        for p in lanes(n):
            for e in lanes(size):
                s0, s1, w = old.square[p, e], work.square[p, e], work.weights[p, e]
                mean = 0.5 * (s0 + s1)
                M = 0.5 * w * EI * (old.strain[1, p, e] + work.strain[1, p, e]) / mean
                N = (w * EA * (old.strain[0, p, e] + work.strain[0, p, e])
                     / (np.sqrt(s0) + np.sqrt(s1)) - (old.kappa[p, e] + work.kappa[p, e]) * M)
                T[p, 0, e] = N * a[p, 0, e] + M * b[p, 1, e]
                T[p, 1, e] = N * a[p, 1, e] - M * b[p, 0, e]
                Tb[p, 0, e], Tb[p, 1, e] = -M * a[p, 1, e], M * a[p, 0, e]
        add_force(pack.table, pack.transposed, pack.constant, pack.start, pack.span, first, T,
                  work.U, f)


@source
def cable_energy(pack, u, out):
    """Add the strain energy of each element to out, (elements,)."""
    most, elements = block(pack.pairs.pairs.shape[1]), pack.start.size
    work = cable_work(pack, min(most, elements), u)
    for first in range(0, elements, most):
        if elements - first < work.U.shape[2]:
            work = cable_work(pack, elements - first, u)
        cable_strain(pack, first, u, work)
        total, strain = out[first:first + work.U.shape[2]], work.strain
        for p in range(strain.shape[1]):
            for e in lanes(total.size):
                total[e] += 0.5 * work.weights[p, e] * (
                    pack.stiffness[0] * strain[0, p, e] * strain[0, p, e]
                    + pack.stiffness[1] * strain[1, p, e] * strain[1, p, e])
        add_held_energy(pack.constant, first, work.U, total)


def cross(a, b):
    """The out-of-plane component of a x b, along the last axis."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


class CableKernel(Chain):
    """Energy, force and tangent of a cable.

    Parameters
    ----------
    mesh, element, material
        The body, an ``ElementBeamCable`` and a material, of which E and nu are used.
    width
        Width of the section.
    formulation
        "assumed" samples at 2 m - 2 Gauss points, any other at 2 m.
    """

    texts = Texts(2, cable_force, cable_tangent, cable_carry, cable_stress, cable_mean,
                  cable_energy)

    def __init__(self, mesh, element, material, width, formulation):
        super().__init__(mesh, element)
        if element.axis_degree > 5 and not mesh.is_straight:
            raise InputError(f"a cable of degree {element.axis_degree} needs a straight mesh: use "
                             "degree 5 on a curve")
        m = element.nodal_dofs
        # 2 m - 2 points miss one mode of an element: for degree 3 it is stabilised, above it is
        # held where two elements meet
        n = 2 * m - 2 + (m > 2 and mesh.nelements == 1) if formulation.name == "assumed" else 2 * m
        self.constant = (formulation.stabilisation(mesh, element, material, width)
                         if m == 2 and formulation.name == "assumed" else None)
        self.points_number = n
        self.shared = mesh.is_uniform or np.ptp(mesh.lengths) <= 1e-13 * np.max(mesh.lengths)
        self.packs = [self._pack(mesh, element, material, width, n)]
        self.volume = float(np.sum(self.packs[0].weights)) * (
            mesh.nelements if self.shared else 1) * width * mesh.height

    def _pack(self, mesh, element, material, width, n):
        E = material.E / (1.0 if material.plane == "stress" else 1.0 - material.nu**2)
        area, ne = width * mesh.height, mesh.nelements
        xi, w = gauss(n)
        L = mesh.lengths[:1] if self.shared else mesh.lengths
        scale = L ** np.tile(np.arange(element.nodal_dofs), 2)[:, None]
        table = np.concatenate([element.axis(xi, d).T[:, :, None] * scale / L**d for d in (1, 2)])
        frame = self._stress_free(mesh, element, xi, table)
        a, b = frame[:n], frame[n:]
        square = np.sum(a * a, axis=1)
        none = np.zeros((0, 2 * self.nd, 2 * self.nd))
        constant = (none if self.constant is None else self.constant).transpose(1, 2, 0)
        p = np.arange(n)
        pairs = np.array([np.concatenate([p, p, n + p]), np.concatenate([p, n + p, n + p])])
        return CablePack(
            packed(table), packed(table.transpose(1, 0, 2)[:, :, :int(self.shared)]),
            packed(frame), packed(np.sqrt(square)),
            packed((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / square), packed(w[:, None] * L),
            packed(np.arange(ne) * (len(L) > 1), np.int64),
            packed(np.arange(ne) * (frame.shape[2] > 1), np.int64),
            np.array([E * area, E * area * mesh.height**2 / 12.0]), packed(constant),
            packed(mesh.t[0] * self.nd, np.int64), packed(np.arange(2 * self.nd), np.int64),
            pair_tables(table, pairs, constant))

    def _stress_free(self, mesh, element, xi, table):
        """a and b in the stress-free state, (rows, 2, 1 or elements)."""
        if mesh.is_straight:
            X = np.array([xi, 0.5 + 0.0 * xi])
            a = np.moveaxis(mesh.mapping().frame(X), 0, -1)[0].transpose(1, 2, 0)
            return np.concatenate([a, np.zeros_like(a)])
        q0 = element.rigid(mesh)
        q0[0] = mesh.p - mesh.p.mean(axis=1, keepdims=True)
        q_e = self.gather(np.ascontiguousarray(q0.transpose(2, 0, 1)).ravel())
        return np.einsum("gke,eki->gie", np.broadcast_to(table, table.shape[:2] + (len(q_e),)), q_e)

    def strain(self, u_e, elements=slice(None)):
        """Extension and change of curvature at the integration points, shape (2, points, ne)."""
        pack, = self.apart(elements)
        out = np.empty((2, self.points_number, len(u_e)))
        cable_stress(pack._replace(stiffness=np.ones(2)), u_e.ravel(), out)
        return out

    def strain_increment(self, pack, u, du, out):
        """The strain's derivative in the direction du, (2, points, elements)."""
        cable_carry(pack._replace(stiffness=np.ones(2)), u, du, np.zeros_like(out), out)

    def weighted_moduli(self, pack, u):
        """Weighted stiffnesses at the points, shape (2, 2, points, elements)."""
        n, ne = pack.weights.shape[0], pack.start.size
        return np.diag(pack.stiffness)[:, :, None, None] * np.broadcast_to(pack.weights, (n, ne))

    def without_material(self, pack):
        """The pack of a cable without stiffness, for given normal forces and moments."""
        return pack._replace(stiffness=np.zeros(2), pairs=pack.pairs._replace(
            held=pack.pairs.held[:, :, :0], held_skew=pack.pairs.held_skew[:, :, :0]))

    # fields

    def section(self, u, xi, tind, mesh, element):
        """Tangent, stretch and curvature at points xi of elements: for the fields of the body.

        Returns
        -------
        tangent, tangent0
            Unit tangents now and in the stress-free state, shape (2, ne, np).
        eps, kappa
            Extension and change of curvature, shape (ne, np).
        """
        t = self.t if tind is None else self.t[:, tind]
        L = (mesh.lengths if tind is None else mesh.lengths[tind])
        xi = np.broadcast_to(xi, (t.shape[1],) + np.shape(xi)[-1:])
        scale = L[:, None] ** np.tile(np.arange(element.nodal_dofs), 2)
        u_e = self.gather(u, slice(None) if tind is None else tind)
        G1, G2 = (np.moveaxis(element.axis(xi, d), 0, -1) * scale[:, None, :]
                  / L[:, None, None] ** d for d in (1, 2))
        q = element.rigid(mesh)
        q[0] = mesh.p
        q = np.moveaxis(q, -1, 0)
        q_e = np.concatenate([q[t[0]], q[t[1]]], axis=1)
        a0, b0 = G1 @ q_e, (0.0 if mesh.is_straight else 1.0) * (G2 @ q_e)
        a, b = a0 + G1 @ u_e, b0 + G2 @ u_e
        s0, s = np.sum(a0**2, axis=-1), np.sum(a**2, axis=-1)
        eps = np.sum((a + a0) * (a - a0), axis=-1) / (np.sqrt(s) + np.sqrt(s0))
        tangent, tangent0 = (np.moveaxis(x / np.sqrt(y)[..., None], -1, 0)
                             for x, y in ((a, s), (a0, s0)))
        return tangent, tangent0, eps, cross(a, b) / s - cross(a0, b0) / s0
