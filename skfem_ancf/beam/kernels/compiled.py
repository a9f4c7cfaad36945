"""Tables of elements for compiled kernels. Elements are the last axis of arrays, :data:`W`
together, so that loops over them have a constant length. Rows, strains and stresses are scaled in
each element such that few tables are needed: with derivatives ``G[e] = R[e] G D[e]`` and diagonal R
and D (graded meshes, arcs), rows are ``R^-1 r`` and unknowns ``D U``."""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array

from ...core import F1, F2, F3, I1, I2
from .elements import scaled, to_moduli
from .tables import (LINEAR, OF_C, OF_FRAME, OF_G, OF_H, OF_WEIGHTS, SECTION, LawTables, Pattern,
                     StrainTables)

#: Number of elements together.
W = 16
_NOTHING, _NO_INTS = np.zeros((0, 0, 0)), np.zeros(0, np.int64)


class CompiledPattern(NamedTuple):
    """The Pattern for compiled code."""

    rows: I2  # g and h of each sample, (2, ns)
    ways: I2  # the directions in which they change its strain; -1 if g = h, (2, ns)
    pairs: I2  # samples s <= t of each modulus, (2, nq)
    terms: I2  # product, skew product or -1, two directions, modulus, (5, nt)
    factors: F2  # of the terms, (1, nt)
    of: I1  # product of each sample, (ns,)
    products: I2  # rows g <= h, sorted, (2, np)
    skew: I2  # those with g < h, (2, nz)


@lru_cache(64)
def compiled_pattern(pattern: Pattern) -> CompiledPattern:
    """The CompiledPattern of a Pattern."""
    (g, h), ns, (p, a, b, q), (k, l) = (
        pattern.rows, pattern.ns, pattern.terms, pattern.products)
    s, section = np.arange(ns), pattern.kind == SECTION
    first = h if section else 3 * (s % (ns // 2)) + 2 * s // ns  # three at each point of cables
    second = np.where(g == h, -1, g if section else first + 1)
    number, skew = np.concatenate([first, second]), np.cumsum(k != l) - 1
    skew[k == l] = -1
    return CompiledPattern(
        pattern.rows, np.array([first, second]), pattern.pairs,
        np.array([p, skew[p], number[a], number[b], q]), np.where(a == b, 0.5, 1.0)[None],
        pattern.of, pattern.products, np.ascontiguousarray(pattern.products[:, k != l]))


class Sparse(NamedTuple):
    """A sparse matrix by its entries."""

    rows: I1
    columns: I1
    values: F1


class Memory(NamedTuple):
    """History and eigenstrains at the start of an increment, eigenstrains at its end, (., points,
    ne), and its time (1,); moduli (c, c) and stresses at zero strain of what is elastic, or
    empty."""

    history: F3
    before: F3
    now: F3
    span: F1
    elastic: F2
    stress: F3


_NO_MEMORY = Memory(_NOTHING, _NOTHING, _NOTHING, np.zeros(1), np.zeros((0, 0)), _NOTHING)


def memory_of(elements: Any) -> Memory:
    """The Memory of :class:`~skfem_ancf.beam.kernels.kernel.ElementsWithHistory`."""
    elastic = elements.elastic or _NO_MEMORY[4:]
    return Memory(elements.history, elements.before, elements.now, elements.span,
                  *map(np.ascontiguousarray, elastic))


class CompiledTables(NamedTuple):
    """The StrainTables for compiled kernels; n = 1 if all blocks of elements are equal. m is the
    number of functions G, np that of products of rows in tangents. Vectors (2 W) have the
    components x of all elements, then y. K are lower halves of symmetric matrices (m, m), for xx,
    yy and the symmetric part of xy; Z those of the skew part of xy, without diagonal."""

    pattern: CompiledPattern
    kind: int  # SECTION or CABLE
    width: int  # W, as a number that LLVM does not know
    start: I1  # first DOF of each element, (ne,)
    G: F2  # derivatives of the functions but the first, (rows, m)
    own: F3  # or those of each element, (n, rows m, W), else empty
    used: I1  # which of these are not zero, (rows m,)
    D: F3  # factors of the unknowns, (n, m, W), or empty
    sigma: F3  # factors of the strains, (n, ns, W), or empty
    reach: F3  # the same for integration points
    x: F3  # rows in the reference configuration, (n, rows, 2 W)
    rest: F3  # of cables: |r_X| and curvature there, (n, points, 2 W), or empty
    H: F3  # weighted moduli, (n, nq, W)
    P: F2  # from coefficients to K, (m (m + 1) / 2, np)
    Q: F2  # from skew coefficients to Z, (m (m - 1) / 2, nz)
    K: F3  # constant stiffness, (n, m (m + 1) / 2, 3 W), or empty
    Z: F3  # (n, m (m - 1) / 2, W), or empty
    coupled: I2  # functions k >= l that it couples, and 1 if x is coupled to y, (3, nc)
    law: LawTables
    along: Sparse  # from samples to integration points, (3 points, ns), of fibres (points, ns)
    weights: F3  # of the points, (n, points, W)
    mixing: Sparse  # from moduli at the points, (9 or 1 times points,), to those between samples
    memory: Memory


def compiled_tables(t: StrainTables) -> CompiledTables:
    """The CompiledTables of a StrainTables."""
    ne, pattern, section = len(t.start), t.pattern, t.pattern.kind == SECTION

    def each(x, column):  # (1 or ne, ...)
        return x[t.at[:, column]] if len(x) > 1 else x

    G, R, D = scaled(each(t.G, OF_G))
    own, frame, H = len(G) > 1, each(t.frame, OF_FRAME), each(t.H, OF_H)
    scales, reach = (_NOTHING, _NOTHING), each(t.reach, OF_WEIGHTS)
    if len(R) > 1 and not own:
        (g, h), n, (a, b) = pattern.rows, pattern.ns // 2, pattern.pairs
        sigma = R[:, g] * R[:, h] if section else np.concatenate(
            [R[:, g[:n]], R[:, h[n:]] / R[:, g[n:]]], axis=1)
        frame, H = frame / R[:, :, None], H * sigma[:, a] * sigma[:, b]
        scales, reach = (_scales(D), _scales(sigma)), sigma * reach if reach.size else sigma
    m, C = G.shape[2], each(t.C, OF_C)
    (k, l, one, other), (*_, two, opposite) = _lower(m, 0), _lower(m, -1)
    K, Z, coupled = _NOTHING, _NOTHING, np.zeros((3, 0), np.int64)
    if len(C):  # for scaled unknowns
        C = C.reshape(len(C), m, 2, m, 2)
        if len(D) > 1:
            C = C / (D[:, :, None, None, None] * D[:, None, None, :, None])
        C = C[:, k, :, l]
        xy, yx = 0.5 * C[..., 0, 1], 0.5 * C[..., 1, 0]
        K, Z = np.array([C[..., 0, 0], C[..., 1, 1], xy + yx]).transpose(2, 1, 0), xy - yx
        acts = K.any(axis=0)
        acts[:, 2] |= Z.any(axis=1) & (k != l)
        coupled = np.array([k, l, acts[:, 2]], np.int64).compress(acts.any(axis=1), 1)
        K, Z = _blocks(K), _blocks(Z.T.compress(k != l, 1))
    P = Q = np.zeros((0, 0))
    if not own:
        g, h = pattern.products
        both = (G[0].take(g, 0).T[:, None] * G[0].take(h, 0).T).reshape(m * m, -1)
        P = both.take(one, 0) + both.take(other, 0)
        Q = np.ascontiguousarray((both.take(two, 0) - both.take(opposite, 0)).compress(g != h, 1))
    along, mixing = map(_sparse, (
        t.along, t.along[:0] if t.law.kind == LINEAR else to_moduli(
            t.pattern, t.weights.shape[1], t.along)))
    rest = _NOTHING
    if not section:
        z = frame.view(complex)[..., 0].T
        rest = _blocks(np.array([np.abs(z[::2]), (z[1::2] / z[::2]).imag]).T)
    used = G.any(axis=0).ravel().astype(np.int64) if own else _NO_INTS
    return CompiledTables(
        compiled_pattern(pattern), pattern.kind, W, t.start, np.ascontiguousarray(G[0]),
        _blocks(G.reshape(ne, -1)) if own else _NOTHING, used, *scales, _scales(reach),
        _blocks(frame), rest, _blocks(H), P, Q, K, Z, coupled,
        t.law, along, _blocks(each(t.weights, OF_WEIGHTS)), mixing, _NO_MEMORY)


def _sparse(A):
    A = coo_array(A)
    return Sparse(*(x.astype(np.int64) for x in A.coords), A.data)


def _blocks(x):
    """(1 or ne, n, ...) to (1 or blocks, n, ... W); the last element fills the last block."""
    if x.size == 0:
        return np.zeros((0, x.shape[1], 0))
    if len(x) == 1:
        return x[..., None].repeat(W, axis=-1).reshape(1, x.shape[1], -1)
    x = np.concatenate([x, np.repeat(x[-1:], -len(x) % W, axis=0)])
    x = x.reshape(len(x) // W, W, *x.shape[1:])
    last = np.ascontiguousarray(x.transpose(0, *range(2, x.ndim), 1))
    return last.reshape(len(x), x.shape[2], -1)


@lru_cache(64)
def _lower(m, k):
    """Rows and columns of a lower half (m, m), and its positions and those of its transpose."""
    i, j = np.tril_indices(m, k)
    return i, j, m * i + j, m * j + i


def _scales(x):
    """Blocks of factors (1 or ne, n), empty if all are one."""
    return _NOTHING if (x == 1.0).all() else _blocks(x)
