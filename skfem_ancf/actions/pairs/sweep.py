"""Motions far from contact: discs around parts of members do not meet."""

import numpy as np

from ...core import Array
from ..contact.pairs import PairTables

#: Largest number of parts of a chain, and of all but for one of each; largest turn of a part of a
#: beam that cannot touch itself, in radians, and its least stretch.
PARTS, ALL, ARC, LEAST = 32, 500, 1.4, 0.85


class Discs:
    """Discs around parts of chains, of several facets each; ``allowed`` (M, M) says which members
    may touch."""

    def __init__(self, t: PairTables, allowed: Array) -> None:
        order = np.lexsort((t.places, t.chains))
        chains, members, spans = t.chains[order], t.members[order], t.spans[order]
        sizes = np.unique(chains, return_counts=True)[1]
        most = max(1, min(PARTS, ALL // len(sizes)))
        share = np.concatenate([np.arange(n) * min(n, most) // n for n in sizes])
        first = np.flatnonzero(np.diff(chains * PARTS + share, prepend=-1))
        self._first, self._last = first, np.append(first[1:], len(order))
        self._sizes = self._last - first
        self._of, self._tables = np.repeat(np.arange(len(first)), self._sizes), (
            t.dofs[:, order], np.ascontiguousarray(t.weights[:, :, order]), t.starts[:, order],
            t.offsets[order], 0.5 * LEAST * spans)
        i, j = np.triu_indices(len(first))
        some = allowed[members[first[i]], members[first[j]]]
        self._pairs = i, j = i[some], j[some]
        self._own = np.flatnonzero(chains[first[i]] == chains[first[j]])
        self._faces = np.flatnonzero((t.sides[order] < 0.0) & (spans > 0.0))
        self._follows = np.diff(chains[self._faces], prepend=-1) == 0

    def stay_apart(self, z: Array) -> Array:
        """True for straight ways between displacements (n + 1, N) on which no discs meet, but those
        of a beam that is bent too little between them, (n,)."""
        dofs, weights, c, offsets, _ = self._tables
        for w, at in zip(weights, dofs):
            c = c + w * z[:, None, at]
        middle = np.add.reduceat(c[:, 0], self._first, axis=1) / self._sizes
        size = np.abs(c)
        radius = np.maximum.reduceat(np.max(np.abs(c[:, 0] - middle[:, self._of]) + size[
            :, 1:].sum(axis=1), axis=0) + offsets, self._first)
        (i, j), far = self._pairs, np.ones(len(self._pairs[0]), bool)
        far[self._own] = ~self._bent_little(c, size)
        i, j = i[far], j[far]
        a = middle[:, i] - middle[:, j]
        way, a = a[1:] - a[:-1], a[:-1]
        along = np.clip(-(a * way.conj()).real / np.maximum(np.abs(way) ** 2, 1e-300), 0.0, 1.0)
        return np.all(np.abs(a + along * way) > radius[i] + radius[j], axis=1)

    def _bent_little(self, c, size):
        """True for pairs of parts of a chain between which it turns by less than ARC."""
        # It cannot touch itself, see :mod:`skfem_ancf.actions.contact.stretches`.
        slope, turned = c[:, 1, self._faces], np.zeros((len(c), c.shape[2] + 1))
        more = np.tensordot(size[:, 2:, self._faces], np.arange(2, c.shape[1]), (1, 0))
        with np.errstate(invalid="ignore", divide="ignore"):
            within = 2.0 * np.arcsin(more / size[:, 1, self._faces])
        turned[:, 1 + self._faces[1:]] = self._follows[1:] * np.abs(np.angle(
            slope[:, 1:] * slope[:, :-1].conj()))
        turned, (i, j) = np.cumsum(turned, axis=1), (k[self._own] for k in self._pairs)
        turn = turned[:, self._last[j]] - turned[:, self._first[i] + 1]
        most = ARC - np.max(within, axis=1, initial=0.0)
        most[np.any(size[:, 1] < self._tables[4], axis=1)] = 0.0
        return np.all(turn < most[:, None], axis=0)
