"""What all kinds of beams share: blocks of elements, forces and tangents from rows of a table.

The ``table`` has rows G_g of derivatives of the local functions, shape (elements, rows, nb), or
(1, rows, nb) where elements share them. A force is ``G^T T`` with what the stresses do on each
row; a tangent is a sum over pairs of rows

    K[(a, i), (b, j)] = sum_{g, h} M[g, h, i, j] G[g, a] G[h, b]

and where elements share G its products are constants: a matrix product for a whole block of
elements. The parts symmetric and skew in (a, b) need each pair of rows once.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.errors import InputError
from ...core.caching import ArrayKey
from ...core.linear import first_order, step
from ...core.source import F1, F2, F3, I1, I2, column, lanes, primitive, room, shaped, source
from ...core.types import Array

if TYPE_CHECKING:
    from ...elements.base import ElementBeam
    from ...core.linalg import BandMatrix
    from ...mesh.mesh_beam import MeshBeam

#: Elements of which Python evaluates matrices together; bounds the memory.
CHUNK = 1024
#: What a kernel finds; given as ``np.int64``, or Numba compiles for each.
FORCE, TANGENT, MEAN, STRESS, CARRY, VISCOUS, GIVEN, GRADIENTS, TURNED = range(9)
#: Fields of a pack whose first axis are the elements, where they have matrices of their own.
MATRICES = {"table", "constant"}
#: Those whose last axis are the elements, where they have tables of their own.
BY_ELEMENT = {"frame", "weights", "stiffness", "moduli", "length0", "kappa0"}
#: Fields with numbers of elements in a table, and the table.
PLACES = {"place": "weights", "frame_place": "frame"}
#: Elements, about, whose energies are found at once.
TOGETHER = 4096


class Destination(NamedTuple):
    """Entry (i, j), i >= j, of a tangent is added at ``flat[(start + j) * ld + i - j]``.

    Of one in two halves (j, i) is half of ld behind.
    """

    flat: F1
    ld: int
    start: int


@source
def nowhere(x):
    """The Destination of no tangent."""
    return Destination(x, np.int64(0), np.int64(0))


def no_stresses(pack: Any) -> Array:
    """The stresses of no component, shape (0, points, elements)."""
    return np.empty((0, len(pack.weights), pack.start.size))


@primitive("primitives")
def block(pairs):
    """Elements that a text takes together: NumPy wants many, as long as they stay in cache."""
    return max(64, min(1024, 100000 // pairs))


@primitive("primitives")
def product(A, first, B, out):
    """out[i, j, e] = sum_k A[e, i, k] B[k, j, e], elements from ``first`` on, or of a shared A."""
    if A.shape[0] == 1:
        n = B.shape[1] * B.shape[2]
        np.dot(A[0], B.reshape(-1, n), out.reshape(-1, n))
    else:
        # BLAS takes matrices whose rows are contiguous
        own = np.ascontiguousarray(B.transpose(2, 0, 1))
        out.transpose(2, 0, 1)[...] = A[first:first + len(own)] @ own


@primitive("primitives")
def turned_product(A, turned, first, B, out):
    """out[i, j, e] = sum_k A[e, k, i] B[k, j, e]; a shared one is given as ``turned`` too."""
    if turned.shape[0] == 1:
        product(turned, first, B, out)
    else:
        own = np.ascontiguousarray(B.transpose(2, 0, 1))
        out.transpose(2, 0, 1)[...] = A[first:first + len(own)].transpose(0, 2, 1) @ own


@primitive("primitives")
def add_by_rows(table, first, rows, X, out):
    """out[s, e, k, i] += X[s, i, e] G[g, k] with row g = rows[s] of each element's table."""
    G = table if len(table) == 1 else table[first:first + out.shape[1]]
    out += X.transpose(0, 2, 1)[:, :, None] * G[:, rows].swapaxes(0, 1)[..., None]


@primitive("primitives")
def add_changes(B, start, x, out):
    """out[s, e] += sum_k B[e, s, k] x[start[e] + k], B repeated for copies of the elements."""
    x = x[start[:, None] + np.arange(B.shape[2])].reshape(-1, len(B), B.shape[2], 1)
    out += (B @ x).reshape(len(start), -1).T.reshape(out.shape)


@primitive("primitives")
def add_pushes(B, start, S, f):
    """f[start[e] + k] += sum_s B[e, s, k] S[s, e], B repeated for copies of the elements."""
    S = S.reshape(-1, len(start)).T.reshape(-1, len(B), 1, B.shape[1])
    np.add.at(f, start[:, None] + np.arange(B.shape[2]), (S @ B).reshape(len(start), -1))


@source
def load(start, span, first, u, U):
    """The coordinates (nb, 2, elements) of the elements from ``first`` on."""
    at = start[first:first + U.shape[2]]
    coordinates = shaped(U, (span.size, at.size))
    for k in lanes(span.size):
        for e in lanes(at.size):
            coordinates[k, e] = u[column(span[k]) + at[e]]


@source
def add_force(table, transposed, constant, start, span, first, T, U, f):
    """Add G^T T to f, and C U where a stabilisation is."""
    nb, size = U.shape[0], U.shape[2]
    F, at = room(U.shape, U), start[first:first + size]
    turned_product(table, transposed, first, T, F)
    force = shaped(F, (2 * nb, size))
    if constant.shape[0] > 0:
        held = room((2 * nb, 1, size), U)
        product(constant, first, shaped(U, (2 * nb, 1, size)), held)
        for k in lanes(2 * nb):
            for e in lanes(size):
                force[k, e] += held[k, 0, e]
    for node in range(2):  # elements have no left node in common
        for k in lanes(node * nb, node * nb + nb):
            for e in lanes(size):
                f[column(span[k]) + at[e]] += force[k, e]


def add_held_energy(pack: Any, u: Array, total: Array) -> None:
    """Add 1/2 u C u of the stabilisation of each element.

    Parameters
    ----------
    pack
        The tables, of a :class:`Chain`.
    u, total
        Displacement of the coordinates, shape (N,), and energies, shape (elements,).
    """
    nb = pack.table.shape[2]
    U = np.empty((nb, 2, total.size), u.dtype)
    load(pack.start, pack.span, 0, u, U)
    if len(pack.constant):
        V, held = U.reshape(2 * nb, 1, -1), np.empty((2 * nb, 1, total.size), u.dtype)
        product(pack.constant, 0, V, held)
        total += 0.5 * np.sum(V * held, axis=(0, 1))


class PairTables(NamedTuple):
    """How factors of pairs of rows become tangents; :func:`pair_tables` makes it.

    Attributes
    ----------
    pairs
        Rows g <= h of each pair, and its number among those with g < h; what that has for g = h
        is not used. Shape (3, p).
    symmetric, skew
        ``G_g G_h^T + G_h G_g^T`` (``G_g G_g^T`` for g = h) and ``G_g G_h^T - G_h G_g^T`` of each
        pair, entries (a, b) with a >= b (a > b), shape (1, n, p) and (1, m, p'). Not those with
        the position of the right node: a translation moves both nodes, so that its entries are
        minus those of the left one. Made from others they are so exactly; else round-off, of the
        size of the axial stiffness, would resist translations: in a long chain of short elements
        as much as bending does. Of shape (0, ...) where elements have tables of their own.
    lower, strictly
        a and b of the entries of ``symmetric`` and ``skew``, shape (2, n) and (2, m).
    partners, rounds
        For the tables of elements: g, h, pair and column of its factors in xy, (4, q), sorted so
        that between two ``rounds`` no g comes twice.
    entries, signs, ends
        For each entry (i, j), i >= j, of an element tangent: i - j, j, and its row in the result
        of ``symmetric`` and in that of ``skew``, (4, k); their signs, (2, k). Up to ``ends[1]``
        those of one component and the left node, up to ``ends[2]`` the right node, then of two
        components.
    held, held_skew, held_place
        The stabilisation, as results of ``symmetric`` and ``skew``: (3 n, 0, 1 or elements) and
        (m, ...), and which are an element's.
    """

    pairs: I2
    symmetric: F3
    skew: F3
    lower: I2
    strictly: I2
    partners: I2
    rounds: I1
    entries: I2
    signs: F2
    ends: I1
    held: F2
    held_skew: F2
    held_place: I1


@primitive("primitives")
def element_tangents(table, pairs, first, M, M_skew, K, K_skew):
    """What the products of G do, for elements with tables of their own: G^T (M G)."""
    nb, size = table.shape[2], M.shape[2]
    xy, turn = M[:, 2].copy(), np.zeros((len(M), size))
    off = pairs.pairs[0] != pairs.pairs[1]
    turn[off] = M_skew[pairs.pairs[2, off], 0]
    X = np.stack([M[:, 0], M[:, 1], xy + turn, xy - turn], axis=1)[:, :, None]
    out = np.empty((nb, 3, nb, size))
    for k in range(0, size, 64):  # as many as stay in cache
        part = slice(k, min(k + 64, size))
        G = np.ascontiguousarray(table[first:first + size][part].transpose(1, 2, 0))
        H, x = np.zeros((len(G), 3) + G.shape[1:]), X[..., part]
        for a, b in zip(pairs.rounds[:-1], pairs.rounds[1:]):
            g, h, p, side = pairs.partners[:, a:b]
            rows = slice(None) if len(g) == len(G) else g
            for c, column_of in enumerate((0, 1, side)):
                H[rows, c] += x[p, column_of] * G[h]
        H = np.ascontiguousarray(H.reshape(len(G), 3 * nb, -1).transpose(2, 0, 1))
        K3 = table[first:first + size][part].transpose(0, 2, 1) @ H
        out[..., part] = K3.transpose(1, 2, 0).reshape(nb, 3, nb, -1)
    (a, b), (c, d) = pairs.lower, pairs.strictly
    K[:, 0], K[:, 1] = out[a, 0, b], out[a, 1, b]
    K[:, 2] = 0.5 * (out[a, 2, b] + out[b, 2, a])
    K_skew[:, 0] = 0.5 * (out[c, 2, d] - out[d, 2, c])


@source
def add_tangent(table, pairs, start, first, M, M_skew, to):
    """Add the tangents of a block of elements to a band matrix, from the factors of its pairs."""
    size = M.shape[2]
    K = room((pairs.lower.shape[1], 3, size), M)
    K_skew = room((pairs.strictly.shape[1], 1, size), M)
    if pairs.symmetric.shape[0] == 1:
        product(pairs.symmetric, first, M, K)
        product(pairs.skew, first, M_skew, K_skew)
    else:
        element_tangents(table, pairs, first, M, M_skew, K, K_skew)
    rows, skew = shaped(K, (3 * len(K), size)), shaped(K_skew, (len(K_skew), size))
    where = room(size, start)
    if pairs.held.shape[1] > 0:
        own = pairs.held_place[first:first + size]
        for k in lanes(len(rows)):
            for e in lanes(size):
                rows[k, e] += pairs.held[k, own[e]]
        for k in lanes(len(skew)):
            for e in lanes(size):
                skew[k, e] += pairs.held_skew[k, own[e]]
    at = start[first:first + size]
    for e in lanes(size):
        where[e] = (to.start + at[e]) * to.ld
    for part in range(4):  # elements have no left node in common
        for n in lanes(pairs.ends[part], pairs.ends[part + 1]):
            below, k = pairs.entries[0, n] + pairs.entries[1, n] * to.ld, pairs.entries[2, n]
            m, x, y = pairs.entries[3, n], pairs.signs[0, n], pairs.signs[1, n]
            if part < 2:
                for e in lanes(size):
                    to.flat[column(below) + where[e]] += column(x) * rows[k, e]
            else:
                for e in lanes(size):
                    to.flat[column(below) + where[e]] += (column(x) * rows[k, e]
                                                          + column(y) * skew[m, e])


@primitive("primitives")
def element_products(table, pairs, first, M, M_skew, K, K_skew):
    """As :func:`element_tangents`, of xx, xy, yx and yy that have nothing to do with each other."""
    rows, size, (g, h, k) = table.shape[1], M.shape[2], pairs.pairs
    G, both = table[first:first + size][:, None], np.zeros((4, rows, rows, size))
    x, y = (values.transpose(1, 0, 2) for values in (M, M_skew[k]))
    y = np.where((g != h)[:, None], y, 0.0)
    both[:, h, g], both[:, g, h] = x - y, x + y
    out = (G.transpose(0, 1, 3, 2) @ (both.transpose(3, 0, 1, 2) @ G)).transpose(2, 1, 3, 0)
    (a, b), (c, d) = pairs.lower, pairs.strictly
    K[:] = 0.5 * (out[a, :, b] + out[b, :, a])
    K_skew[:] = 0.5 * (out[c, :, d] - out[d, :, c])


@source
def add_both_halves(table, pairs, start, first, M, M_skew, to):
    """As :func:`add_tangent`, of factors xx, xy, yx and yy, to a matrix in two halves."""
    size, half = M.shape[2], to.ld // 2
    K = room((pairs.lower.shape[1], 4, size), M)
    K_skew = room((pairs.strictly.shape[1], 4, size), M)
    if pairs.symmetric.shape[0] == 1:
        product(pairs.symmetric, first, M, K)
        product(pairs.skew, first, M_skew, K_skew)
    else:
        element_products(table, pairs, first, M, M_skew, K, K_skew)
    rows, skew = shaped(K, (4 * len(K), size)), shaped(K_skew, (4 * len(K_skew), size))
    at, where = start[first:first + size], room(size, start)
    for e in lanes(size):
        where[e] = (to.start + at[e]) * to.ld
    for part in range(4):  # elements have no left node in common
        for n in lanes(pairs.ends[part], pairs.ends[part + 1]):
            j, k, m = pairs.entries[1, n], pairs.entries[2, n] // 3 * 4, pairs.entries[3, n] * 4
            below, i, l = pairs.entries[0, n] + j * to.ld, (pairs.entries[0, n] + j) % 2, j % 2
            x, y = pairs.signs[0, n], pairs.signs[1, n] * (1 - 2 * i * (1 - l))
            ij, ji = 2 * i + l, 2 * l + i
            for e in lanes(size):
                to.flat[column(below) + where[e]] += (column(x) * rows[k + ij, e]
                                                      + column(y) * skew[m + ij, e])
                to.flat[column(below + half) + where[e]] += (column(x) * rows[k + ji, e]
                                                             - column(y) * skew[m + ji, e])


@source
def weigh(D, weights, X, P, Q):
    """P = X times weights, and Q = D X with the moduli of each point.

    Parameters
    ----------
    D, weights
        Shape (c^2, points, elements), (points, elements).
    X, P, Q
        Derivatives of the strains, shape (c, points, elements, k), and (elements, c, points, k).
    """
    n = len(X)
    Q[:] = 0.0
    for c in range(n):
        for p in range(X.shape[1]):
            for e in lanes(len(P)):
                for k in lanes(P.shape[3]):
                    P[e, c, p, k] = column(weights[p, e]) * X[c, p, e, k]
            for d in range(n):
                for e in lanes(len(P)):
                    for k in lanes(P.shape[3]):
                        Q[e, c, p, k] += column(D[n * c + d, p, e]) * X[d, p, e, k]


@source
def add_scaled(c, x, y, out):
    """out = y + c x."""
    for i in lanes(x.shape[0]):
        for j in lanes(x.shape[1]):
            for e in lanes(x.shape[2]):
                out[i, j, e] = y[i, j, e] + c * x[i, j, e]


@source
def copy_stress(x, y):
    """Stresses of a block from or into those of all elements."""
    for c in lanes(x.shape[0]):
        for p in lanes(x.shape[1]):
            for e in lanes(x.shape[2]):
                y[c, p, e] = x[c, p, e]


def packed(values: Any, dtype: Any = np.float64) -> Array:
    """An array as compiled code takes it: contiguous and writable, of one type.

    Parameters
    ----------
    values
        Numbers, of any shape (...).
    dtype
        Their type.
    """
    if type(values) is np.ndarray and values.dtype == dtype and values.flags.carray:
        return values
    return np.array(values, dtype, order="C")


def in_rounds(keys: Array) -> tuple[Array, Array]:
    """An order in which no key comes twice between two ``rounds``: (order, rounds)."""
    order = np.argsort(keys, kind="stable")
    first = np.searchsorted(keys[order], keys[order])
    number = np.empty(len(keys), dtype=np.int64)
    number[order] = np.arange(len(keys)) - first  # how many of the same key come before
    order = np.lexsort((keys, number))
    return order, packed(np.searchsorted(number[order], np.arange(np.max(number, initial=-1) + 2)),
                         np.int64)


def pair_tables(table: Array, pairs: Array, constant: Array, elements: int) -> PairTables:
    """The PairTables of pairs (2, p) of rows, each once, for a table and a stabilisation.

    Parameters
    ----------
    table
        Shape (elements, rows, nb), or (1, rows, nb) where elements share it.
    pairs
        Rows g <= h, shape (2, p).
    constant
        Element stiffness, shape (0, 1 or elements, 2 nb, 2 nb).
    elements
        Their number.
    """
    nb, (g, h), places = table.shape[2], pairs, _places(table.shape[2])
    off, number, partners, rounds = _partners(ArrayKey(pairs))
    (a, b), (c, d) = places.lower, places.strictly
    symmetric, skew = np.zeros((0, len(a), len(g))), np.zeros((0, len(c), np.sum(off) + 1))
    if table.shape[0] == 1:
        G, H = table[0, g].T, table[0, h].T
        symmetric = (G[a] * H[b] + off * H[a] * G[b])[None]
        skew = np.append((G[c] * H[d] - H[c] * G[d])[:, off], np.zeros((len(c), 1)), axis=1)[None]
    return PairTables(packed([g, h, number], np.int64), packed(symmetric), packed(skew),
                      places.lower, places.strictly, partners, rounds, places.entries,
                      places.signs, places.ends, *_held(places, constant, nb, elements))


def scaled_pair_tables(table: Array, rows: Array, columns: Array, pairs: Array, constant: Array,
                       elements: int) -> PairTables:
    """As :func:`pair_tables`, of a table of one element whose rows and columns are multiplied.

    Parameters
    ----------
    table
        Before that, shape (rows, nb); what comes of it is kept.
    rows, columns
        Their factors, shapes (rows,) and (nb,).
    pairs, constant, elements
        As there, shapes (2, p) and (0, 1 or elements, 2 nb, 2 nb).
    """
    unit, ends = _unit_pairs(ArrayKey(table, pairs))
    of_pair = rows.take(pairs[0]) * rows.take(pairs[1])
    (a, b), (c, d) = unit.lower, unit.strictly
    symmetric = np.multiply.outer(columns.take(a) * columns.take(b), of_pair)[None]
    skew = np.multiply.outer(columns.take(c) * columns.take(d), of_pair.take(ends))[None]
    symmetric *= unit.symmetric
    skew *= unit.skew
    if len(constant):
        held, held_skew, place = _held(_places(len(columns)), constant, len(columns), elements)
    else:
        held, held_skew, place = unit.held, unit.held_skew, np.zeros(elements, np.int64)
    return unit._replace(symmetric=symmetric, skew=skew, held=held, held_skew=held_skew,
                         held_place=place)


@lru_cache(64)
def _unit_pairs(content):
    """The PairTables of a table, and of each column of ``skew`` a pair of its rows."""
    table, pairs = content.arrays
    nb = table.shape[1]
    off = np.nonzero(pairs[0] != pairs[1])[0]
    return (pair_tables(table[None], pairs, np.zeros((0, 2 * nb, 2 * nb)), 0),
            np.append(off, 0))  # the last column is zero


def _held(places, constant, nb, elements):
    """``held``, ``held_skew`` and ``held_place`` of PairTables."""
    C = np.ascontiguousarray(constant.reshape(-1, 4 * nb**2).T)
    (a, b), (c, d) = places.held, places.held_skew
    return (0.5 * (C.take(a, axis=0) + C.take(b, axis=0)),
            0.5 * (C.take(c, axis=0) - C.take(d, axis=0)),
            packed(np.arange(elements) * (len(constant) > 1), np.int64))


def pair_numbers(pairs: Array) -> Array:
    """The number of each of pairs (2, p) of rows among those of two rows, shape (p,)."""
    off = pairs[0] != pairs[1]
    return np.where(off, np.cumsum(off) - 1, np.sum(off))


@lru_cache(64)
def _partners(content):
    """Which pairs are of two rows, their numbers, and the ``partners`` and ``rounds``."""
    (g, h), = content.arrays
    off, n, number = g != h, np.arange(len(g)), pair_numbers(content.arrays[0])
    both = np.concatenate([[g, h, n, np.full(len(g), 2)],
                           np.array([h, g, n, np.full(len(g), 3)])[:, off]], axis=1)
    order, rounds = in_rounds(both[0])
    return off, number, packed(both[:, order], np.int64), rounds


class _Places(NamedTuple):
    """The fields of :class:`PairTables` that depend on the number of local functions only.

    ``held`` and ``held_skew`` say which two numbers of a stabilisation make each of those.
    """

    lower: I2
    strictly: I2
    held: I2
    held_skew: I2
    entries: I2
    signs: F2
    ends: I1


@lru_cache(64)
def _places(nb):
    kept = np.delete(np.arange(nb), nb // 2)
    a, b = (kept[k] for k in np.tril_indices(nb - 1))
    c, d = a[a > b], b[a > b]
    n_of, m_of = np.zeros((2, nb, nb), dtype=np.int64)
    n_of[a, b] = n_of[b, a] = np.arange(len(a))
    m_of[c, d] = m_of[d, c] = np.arange(len(c))
    at = np.arange(4 * nb**2).reshape(nb, 2, nb, 2)
    x, y = at[a, 0, b, 0], at[a, 1, b, 1]
    held = [np.array([x, y, at[i, 0, j, 1]]).T.ravel() for i, j in ((a, b), (b, a))]
    return _Places(packed([a, b], np.int64), packed([c, d], np.int64), np.array(held),
                   np.array([at[c, 0, d, 1], at[d, 0, c, 1]]), *_entries(nb, n_of, m_of))


def _entries(nb, n_of, m_of):
    """``entries``, ``signs`` and ``ends`` of PairTables."""
    q = nb // 2
    j, i = np.triu_indices(2 * nb)
    (a, x), (b, y) = np.divmod(i, 2), np.divmod(j, 2)
    sign = np.where(a == q, -1.0, 1.0) * np.where(b == q, -1.0, 1.0)
    a, b = np.where(a == q, 0, a), np.where(b == q, 0, b)
    skew = sign * np.sign(a - b) * np.where(x > y, -1.0, 1.0)
    source_row = 3 * n_of[a, b] + np.where(x == y, x, 2)
    part = 2 * (x != y) + (j >= nb)
    order = np.argsort(part, kind="stable")
    entries = np.array([i - j, j, source_row, m_of[a, b]])[:, order]
    return (packed(entries, np.int64), packed(np.array([sign, skew])[:, order]),
            packed(np.cumsum([0, *np.bincount(part, minlength=4)]), np.int64))


def append_square_root(K: Array, u_e: Array, B: list[Array], CB: list[Array],
                       stress: list[Array]) -> None:
    """Rows R with R^T R = K, a constant and semidefinite element stiffness, and R u.

    Parameters
    ----------
    K
        Element stiffness, shape (ne, 2 nb, 2 nb) or (1, ...).
    u_e
        Displacements of the coordinates of these elements, shape (ne, nb, 2).
    B, CB, stress
        Lists that R (twice) and R u are appended to.
    """
    size = np.sqrt(np.diagonal(K, axis1=1, axis2=2))  # coordinates have units of their own
    size = np.where(size > 0.0, size, 1.0)[:, :, None]
    values, V = np.linalg.eigh(K / (size * size.transpose(0, 2, 1)))
    keep = np.max(values / values[:, -1:], axis=0) > 1e-12
    R = (np.sqrt(np.maximum(values[:, None, keep], 0.0)) * V[:, :, keep] * size).transpose(0, 2, 1)
    R = np.broadcast_to(R, (len(u_e),) + R.shape[1:])
    B.append(R)
    CB.append(R)
    stress.append((R @ u_e.reshape(len(u_e), -1, 1))[..., 0])


class Texts(NamedTuple):
    """The texts of a kind of beams.

    Attributes
    ----------
    components
        Number of its strains.
    evaluate
        A text as :func:`~skfem_ancf.beam.kernels.section.section_evaluate`.
    strain_energy
        A function of a pack, u (N,) and energies (elements,), to which it adds.
    """

    components: int
    evaluate: Any
    strain_energy: Any

    def force(self, pack: Any, u: Array, f: Array) -> None:
        """Add the internal force of a displacement.

        Parameters
        ----------
        pack
            The tables.
        u, f
            Displacement and force, shape (N,).
        """
        none = no_stresses(pack)
        self.evaluate(pack, FORCE, u, u, f, none, none, nowhere(f))

    def viscous(self, pack: Any, u: Array, v: Array, f: Array) -> None:
        """Add the force of stresses in proportion to the rates of the strains.

        Parameters
        ----------
        pack
            The tables, those of ``viscous_packs``.
        u, v, f
            Displacement, its rate and force, shape (N,).
        """
        none = no_stresses(pack)
        self.evaluate(pack, VISCOUS, u, v, f, none, none, nowhere(f))

    def tangent(self, pack: Any, u: Array, f: Array, carried: Array, use_carried: bool,
                stresses: Array, to: Destination) -> None:
        """Add the internal force to f and the tangent to a band matrix.

        Parameters
        ----------
        pack
            The tables.
        u, f
            Displacement and force, shape (N,).
        carried, use_carried
            Stresses (components, points, elements) for the geometric part in place of those of
            the strain.
        stresses
            Second Piola-Kirchhoff stresses, or resultants, of the same shape; written.
        to
            Where the tangent is added.
        """
        given = carried if use_carried else no_stresses(pack)
        self.evaluate(pack, TANGENT, u, u, f, given, stresses, to)

    def carry(self, pack: Any, u: Array, du: Array, before: Array, out: Array) -> None:
        """The stresses, linearised, at u + du, from those before.

        Parameters
        ----------
        pack
            The tables.
        u, du
            Displacement and its change, shape (N,).
        before, out
            Stresses, shape (components, points, elements).
        """
        self.evaluate(pack, CARRY, u, du, u, before, out, nowhere(u))

    def stress(self, pack: Any, u: Array, out: Array) -> None:
        """The stresses at u.

        Parameters
        ----------
        pack
            The tables.
        u
            Displacement, shape (N,).
        out
            Stresses, shape (components, points, elements).
        """
        self.evaluate(pack, STRESS, u, u, u, no_stresses(pack), out, nowhere(u))

    def mean(self, pack: Any, u0: Array, u1: Array, f: Array) -> None:
        """Add the force B(middle)^T S whose work from u0 to u1 is the change of the energy.

        Parameters
        ----------
        pack
            The tables.
        u0, u1, f
            Displacements and force, shape (N,).
        """
        none = no_stresses(pack)
        self.evaluate(pack, MEAN, u0, u1, f, none, none, nowhere(f))


class Assembly:
    """What :meth:`Chain.assemble` found.

    Parameters
    ----------
    kernel
        The :class:`Chain`.
    u
        Displacement of its coordinates, shape (N,).

    Attributes
    ----------
    stresses
        Of each pack, shape (components, points, elements).
    """

    def __init__(self, kernel: "Chain", u: Array, stresses: list[Array]) -> None:
        self._kernel, self._u, self.stresses = kernel, u.copy(), stresses

    def carry(self, du: Array) -> list[Array]:
        """Stresses at ``u + du``, linearised: one array a pack."""
        out = [np.empty_like(S) for S in self.stresses]
        for pack, before, after in zip(self._kernel.packs, self.stresses, out):
            self._kernel.texts.carry(pack, self._u, du, before, after)
        return out


class Chain:
    """Elements of a chain of nodes: gathering, scattering, and the calls of the texts.

    Parameters
    ----------
    mesh, element
        The body and a scalar beam element.

    Attributes
    ----------
    packs
        The tables of each term of the strain energy.
    constant
        The stabilisation, shape (elements, 2 nb, 2 nb) or (1, ...), or None.
    """

    texts: Any = None
    packs: list[Any]
    constant: Array | None

    def __init__(self, mesh: "MeshBeam", element: "ElementBeam") -> None:
        self.nd = 2 * element.nodal_dofs
        self.t = mesh.t
        self.N = self.nd * mesh.p.shape[1]

    def gather(self, u: Array, elements: Any = slice(None)) -> Array:
        """Element values (ne, nb, 2) of a coordinate vector (N,).

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        elements
            A slice or numbers of elements.
        """
        nodes = u.reshape(-1, self.nd)
        t = self.t[:, elements]
        return np.concatenate([nodes[t[0]], nodes[t[1]]], axis=1).reshape(t.shape[1], self.nd, 2)

    def scatter(self, force: Array, elements: Any = slice(None), out: Array | None = None) -> Array:
        """Add element vectors (ne, nb, 2) into a coordinate vector (N,).

        Parameters
        ----------
        force
            Of each element, shape (ne, nb, 2).
        elements
            A slice or numbers of elements.
        out
            What is added to, shape (N,); zeros by default.
        """
        out = np.zeros(self.N, dtype=force.dtype) if out is None else out
        nodes, t = out.reshape(-1, self.nd), self.t[:, elements]
        parts = force.reshape(t.shape[1], 2, self.nd)
        if t.shape[1] == len(nodes) - 1:  # one chain
            nodes[:-1] += parts[:, 0]
            nodes[1:] += parts[:, 1]
            return out
        nodes[t[0]] += parts[:, 0]  # a node is the left end of one element at most
        nodes[t[1]] += parts[:, 1]
        return out

    def checked(self, u: Array) -> Array:
        """A coordinate vector as compiled code takes it: float64, (N,), contiguous, writeable.

        Complex numbers stay: NumPy takes them.

        Raises
        ------
        InputError
            If it is of another shape: compiled code would read other memory.
        """
        if u.shape != (self.N,):
            raise InputError(f"this beam has {self.N} coordinates: their displacement is of shape "
                             f"({self.N},), got {u.shape}; the state of another mesh?")
        if u.dtype == np.float64 and u.flags.c_contiguous and u.flags.writeable:
            return u
        return u if u.dtype == np.complex128 else np.array(u, dtype=np.float64)

    def chunks(self) -> list[slice]:
        """Slices of the elements of which matrices are evaluated together."""
        n = self.t.shape[1]
        if n <= CHUNK:
            return [slice(0, CHUNK)]
        return [slice(k, k + CHUNK) for k in range(0, n, CHUNK)]

    def stresses(self) -> list[Array]:
        """Room for the stresses of each pack, shape (components, points, elements)."""
        return [np.zeros((self.texts.components, pack.weights.shape[0], pack.start.size))
                for pack in self.packs]

    def apart(self, elements: slice = slice(None)) -> list[Any]:
        """The packs of some elements, each with coordinates of its own."""
        return [apart(pack, elements) for pack in self.packs]

    def assemble(self, u: Array, K: "BandMatrix", start: int, force: Array,
                 carried: list[Array] | None = None, geometric: bool = True) -> Assembly:
        """Add the tangent to a band matrix and the internal force to a vector.

        Parameters
        ----------
        u
            Coordinate displacement, shape (N,).
        K, start
            A :class:`~skfem_ancf.core.linalg.BandMatrix`, and the row of the first coordinate in
            it.
        force
            Shape (N,); added to.
        carried
            What :meth:`Assembly.carry` returned, for the geometric part.
        geometric
            Include the geometric part.

        Returns
        -------
        Assembly
            With ``carry(du)``.
        """
        u, stresses = self.checked(u), self.stresses()
        given = carried is not None or not geometric
        used = carried if geometric and carried is not None else self.stresses()
        if K.symmetric:
            for pack, S, C in zip(self.packs, stresses, used):
                self.texts.tangent(pack, u, force, C, given, S,
                                   Destination(K._flat, K._ld, start))
            return Assembly(self, u, stresses)
        force += self.force(u)
        for pack, S in zip(self.packs, stresses):
            self.texts.stress(pack, u, S)
        for part in self.chunks():
            tangents = self.tangents_of(self.apart(part), self.gather(u, part),
                                        [C[:, :, part] for C in used] if given else None)
            K.add_elements(tangents, start, self.nd, self.t[0, part])
        return Assembly(self, u, stresses)

    def force(self, u: Array) -> Array:
        """Internal force of a coordinate displacement (N,), shape (N,)."""
        u = self.checked(u)
        out = np.zeros(self.N, dtype=u.dtype)
        for pack in self.packs:
            self.texts.force(pack, u, out)
        return out

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """A force whose work from u0 to u1 is the change of the energy, shape (N,).

        Parameters
        ----------
        u0, u1
            Displacements of the coordinates, shape (N,).
        """
        u0, u1, out = self.checked(u0), self.checked(u1), np.zeros(self.N)
        for pack in self.packs:
            self.texts.mean(pack, u0, u1, out)
        return out

    def energy(self, u: Array) -> Any:
        """Strain energy of a coordinate displacement (N,), or of many, (k, N): shape () or (k,)."""
        if u.ndim == 1:
            return np.sum(self.energies(u))
        n = max(1, TOGETHER // self.t.shape[1])
        return np.concatenate([np.sum(self._energies(u[k:k + n]), axis=1)
                               for k in range(0, len(u), n)])

    def energies(self, u: Array) -> Array:
        """Strain energy of each element, shape (ne,)."""
        return self._energies(self.checked(u)[None])[0]

    def _energies(self, u):
        """Those of many displacements (k, N), as of k times the elements; shape (k, ne)."""
        out = np.zeros((len(u), self.t.shape[1]), dtype=u.dtype)
        for pack in self.packs:
            many = pack if len(u) == 1 else repeated(pack, len(u), self.N)
            self.texts.strain_energy(many, u.ravel(), out.reshape(-1))
        return out

    def forces(self, u: Array) -> Array:
        """Element forces (ne, nb, 2) of a coordinate displacement (N,)."""
        u_e = self.gather(self.checked(u))
        out = np.zeros(u_e.size, dtype=u_e.dtype)
        for pack in self.apart():
            self.texts.force(pack, u_e.ravel(), out)
        return out.reshape(u_e.shape)

    def small_forces(self, u: Array) -> Array:
        """Element forces (ne, nb, 2) of a small displacement (N,): linear in it.

        Of a :func:`~skfem_ancf.core.linear.step` from the stress-free state they are one, too.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        """
        z = self.gather(self.checked(u if np.iscomplexobj(u) else step(0.0, u)))
        out = np.zeros(z.size, dtype=complex)
        for pack in self.small_packs():
            self.texts.force(apart(pack, slice(None)), z.ravel(), out)
        out = 1j * out.imag.reshape(z.shape)  # without round-off of curved elements at rest
        return out if np.iscomplexobj(u) else first_order(out)

    def small_energy(self, u: Array) -> float:
        """The quadratic part of the strain energy of a displacement (N,): that of small ones."""
        u_e = self.gather(u)
        u_e[:, self.nd // 2] -= u_e[:, 0]  # seen from the first node: less round-off
        u_e[:, 0] = 0.0
        return 0.5 * float(np.sum(u_e * self.small_forces(u)))

    def small_packs(self) -> list[Any]:
        """The :attr:`packs` with constant moduli, those of no strain."""
        return self.packs

    def tangents(self, u: Array, geometric: bool = True) -> Array:
        """Element tangents (ne, 2 nb, 2 nb) of a coordinate displacement (N,).

        Parameters
        ----------
        u
            Displacement, shape (N,).
        geometric
            Include the geometric part.
        """
        u = self.checked(u)
        carried = None if geometric else self.stresses()
        return np.concatenate([self.tangents_of(
            self.apart(part), self.gather(u, part), carried and [C[:, :, part] for C in carried])
            for part in self.chunks()])

    def tangents_of(self, packs: list[Any], u_e: Array,
                    carried: list[Array] | None = None) -> Array:
        """Tangents (ne, 2 nb, 2 nb) of packs as :func:`apart` makes them.

        Parameters
        ----------
        packs
            The packs, all of the same elements.
        u_e
            Displacements of the coordinates of these elements, shape (ne, nb, 2).
        carried
            Stresses of each pack for the geometric part; those of the displacement if None.
        """
        ne, n = len(u_e), 2 * self.nd
        u, force, flat = u_e.ravel(), np.zeros(u_e.size), np.zeros((ne, n, n + 1))
        for k, pack in enumerate(packs):
            S = np.zeros((self.texts.components, pack.weights.shape[0], ne))
            self.texts.tangent(pack, u, force, S if carried is None else carried[k],
                               carried is not None, S, Destination(flat.reshape(-1), n + 1, 0))
        i, j = np.tril_indices(n)
        out = np.empty((ne, n, n))
        out[:, i, j] = out[:, j, i] = flat[:, j, i - j]
        return out

    def factors(self, u_e: Array, elements: slice = slice(None)) -> tuple[Array, Array, Array]:
        """The material part of the element tangents as ``B^T (C B)``: in B nothing cancels.

        Parameters
        ----------
        u_e
            Displacements (ne, nb, 2) of the elements, a slice.
        elements
            The slice.

        Returns
        -------
        B, CB
            The strains' derivatives at all integration points, and the weighted moduli times
            them, shape (ne, m, 2 nb); what is stabilised is a strain too.
        stress
            Weighted stresses, shape (ne, m): ``B^T stress`` is the internal force.
        """
        ne, u = len(u_e), u_e.ravel()
        B: list[Array] = []
        CB: list[Array] = []
        stress: list[Array] = []
        for pack in self.apart(elements):
            S = np.empty((self.texts.components, pack.weights.shape[0], ne))
            rows = np.empty((2 * self.nd,) + S.shape)
            for k, row in enumerate(rows):
                du = np.zeros((ne, 2 * self.nd))
                du[:, k] = 1.0
                self.strain_increment(pack, u, du.ravel(), row)
            self.texts.stress(pack, u, S)
            moduli = self.weighted_moduli(pack, u)
            B.append(rows.transpose(3, 1, 2, 0).reshape(ne, -1, 2 * self.nd))
            CB.append(np.einsum("abpe,kbpe->eapk", moduli, rows, optimize=True
                                ).reshape(B[-1].shape))
            stress.append((pack.weights * S).transpose(2, 0, 1).reshape(ne, -1))
        if self.constant is not None:
            K = self.constant[elements] if len(self.constant) > 1 else self.constant
            append_square_root(K, u_e, B, CB, stress)
        return (np.concatenate(B, axis=1), np.concatenate(CB, axis=1),
                np.concatenate(stress, axis=1))

    def geometric(self, u_e: Array, elements: slice, stress: Array) -> Array:
        """The geometric part (ne, 2 nb, 2 nb) of the element tangents for weighted stresses.

        Parameters
        ----------
        u_e
            Displacements of the coordinates of these elements, shape (ne, nb, 2).
        elements
            A slice of the elements.
        stress
            Weighted stresses as :meth:`factors` returns them, shape (ne, m).
        """
        packs, carried, first = [], [], 0
        for pack in self.apart(elements):
            shape = self.texts.components, pack.weights.shape[0], len(u_e)
            own = stress[:, first:first + shape[0] * shape[1]].reshape(shape[2:] + shape[:2])
            carried.append(np.ascontiguousarray(own.transpose(1, 2, 0) / pack.weights))
            packs.append(self.without_material(pack))
            first += shape[0] * shape[1]
        return self.tangents_of(packs, u_e, carried)

    def strain_increment(self, pack: Any, u: Array, du: Array, out: Array) -> None:
        """The strain's derivative in the direction du, (components, points, elements).

        Parameters
        ----------
        pack
            One of the :attr:`packs`.
        u, du, out
            Displacement and direction, shape (N,), and the result.
        """
        raise NotImplementedError

    def weighted_moduli(self, pack: Any, u: Array) -> Array:
        """Weighted moduli at the points, shape (components, components, points, elements).

        Parameters
        ----------
        pack
            One of the :attr:`packs`.
        u
            Displacement, shape (N,).
        """
        raise NotImplementedError

    def pushed_packs(self) -> list[Any]:
        """Packs for what stress-free strains change, evaluated with what is given for them.

        That is of a cable the stress that changes, and of other beams the strain. No part of them
        is what the beam has without that: its material, where it is linear, its stabilisation.
        """
        raise NotImplementedError

    def without_material(self, pack: Any) -> Any:
        """The pack of a law without stiffness, for given stresses."""
        raise NotImplementedError

    @property
    def linear(self) -> bool:
        """True if all moduli are constant."""
        return True

    def inverted(self, u: Array) -> bool:
        """True if the body is turned inside out somewhere: no deformation of a real one."""
        return False


def apart(pack: Any, elements: slice) -> Any:
    """A pack of some elements, a slice, each with coordinates of its own.

    Parameters
    ----------
    pack
        The tables, of a :class:`Chain`.
    elements
        A slice of the elements.
    """
    number, total = len(pack.start[elements]), pack.start.size
    changes = {"start": np.arange(number) * pack.span.size}
    for name, table in pack._asdict().items():
        if name in MATRICES and len(table) == total > 1:
            changes[name] = table[elements]
        elif name in BY_ELEMENT and table.shape[-1] == total > 1:
            changes[name] = np.ascontiguousarray(table[..., elements])
        elif name in PLACES:
            changes[name] = np.arange(number) * min(1, pack._asdict()[PLACES[name]].shape[-1] - 1)
    held = pack.pairs.held
    changes["pairs"] = pack.pairs._replace(held_place=pack.pairs.held_place[:number])
    if held.shape[1] == total > 1:
        changes["pairs"] = pack.pairs._replace(
            held=packed(held[:, elements]), held_skew=packed(pack.pairs.held_skew[:, elements]),
            held_place=np.arange(number))
    return pack._replace(**changes)


def repeated(pack: Any, n: int, N: int) -> Any:
    """A pack of ``n`` times its elements, each time with coordinates that begin N later.

    Parameters
    ----------
    pack
        The tables, of a :class:`Chain`.
    n, N
        How often, and how far apart.
    """
    total = pack.start.size
    changes = {"start": (pack.start + N * np.arange(n)[:, None]).ravel(),
               "pairs": pack.pairs._replace(held_place=_many(pack.pairs.held_place, n))}
    for name, table in pack._asdict().items():
        if name in MATRICES and len(table) == total > 1 or name in PLACES:
            changes[name] = _many(table, n)
    return pack._replace(**changes)


def _many(x, n):
    """n times an array, one behind the other along its first axis."""
    return np.concatenate([x] * n)
